//! The grammar of a user's expression: as on paper, `-x^2` is -(x²) and `2^3^2` is 2⁹. What the evaluating library is given
//! has every bracket written, numbers without exponents and names of ours, so that it has nothing to decide.

use std::iter::Peekable;
use std::str::CharIndices;

/// Where something is wrong, in characters from 0, and what.
pub(super) type Slip = (usize, String);

/// Functions of one value.
const UNARY: &[&str] = &[
    "abs", "signum", "sqrt", "cbrt", "exp", "ln", "log2", "log10", "sin", "cos", "tan", "asin", "acos",
    "atan", "sinh", "cosh", "tanh", "floor", "ceil", "round", "trunc", "fract",
];
/// Functions of two.
const BINARY: &[&str] = &["min", "max", "atan2"];
/// Numbers with a name; a parameter of that name goes before.
const CONSTANTS: &[(&str, f64)] = &[
    ("pi", std::f64::consts::PI),
    ("PI", std::f64::consts::PI),
    ("π", std::f64::consts::PI),
    ("e", std::f64::consts::E),
    ("E", std::f64::consts::E),
    ("TAU", std::f64::consts::TAU),
    ("τ", std::f64::consts::TAU),
];
/// Brackets within brackets, signs before signs.
const DEEPEST: usize = 64;

/// Words and signs of one expression.
const LONGEST: usize = 1000;

/// A text in the words of the library, and the names behind its `v00`, `v01`, ..., each with the column where it came first.
pub(super) struct Written {
    pub text: String,
    pub names: Vec<(String, usize)>,
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64),
    Word(String),
    Sign(char),
}

/// Reads `text`; `is_name` says which words are signals and parameters.
pub(super) fn read(text: &str, is_name: &dyn Fn(&str) -> bool) -> Result<Written, Slip> {
    let tokens = tokens(text)?;
    if tokens.is_empty() {
        return Err((0, "it is empty".to_owned()));
    }
    if let Some((column, _)) = tokens.get(LONGEST) {
        return Err((*column, format!("more than {LONGEST} words and signs")));
    }
    let end = text.chars().count();
    let mut reader = Reader { tokens: &tokens, at: 0, depth: 0, end, names: Vec::new(), is_name };
    let text = reader.sum()?;
    match reader.next() {
        None => Ok(Written { text, names: reader.names }),
        Some((column, Token::Sign(')'))) => Err((column, "this bracket closes nothing".to_owned())),
        Some((column, Token::Sign(','))) => {
            Err((column, "a comma stands between two values of min, max or atan2".to_owned()))
        }
        Some((column, _)) => Err((column, "an operator is missing before this".to_owned())),
    }
}

fn tokens(text: &str) -> Result<Vec<(usize, Token)>, Slip> {
    let mut tokens = Vec::new();
    let mut letters = text.char_indices().peekable();
    let mut column = 0;
    while let Some((at, letter)) = letters.next() {
        let from = column;
        let mut take = |letters: &mut Peekable<CharIndices<'_>>, more: &dyn Fn(&str, char) -> bool| {
            let mut end = at + letter.len_utf8();
            while let Some((_, next)) =
                letters.next_if(|(_, next)| more(text.get(at..end).unwrap_or(""), *next))
            {
                end += next.len_utf8();
                column += 1;
            }
            text.get(at..end).unwrap_or("").to_owned()
        };
        if letter.is_ascii_digit() || letter == '.' {
            let in_number = |so_far: &str, next: char| {
                next.is_alphanumeric()
                    || next == '.'
                    || (matches!(next, '+' | '-') && so_far.ends_with(['e', 'E']))
            };
            let word = take(&mut letters, &in_number);
            let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
            let number = number.ok_or_else(|| (from, format!("`{word}` is no number")))?;
            tokens.push((from, Token::Number(number)));
        } else if letter.is_alphabetic() || letter == '_' {
            let word = take(&mut letters, &|_, next| next.is_alphanumeric() || next == '_');
            tokens.push((from, Token::Word(word)));
        } else if "+-*/^(),".contains(letter) {
            tokens.push((from, Token::Sign(letter)));
        } else if !letter.is_whitespace() {
            return Err((from, format!("`{letter}` means nothing here")));
        }
        column += 1;
    }
    Ok(tokens)
}

/// Goes down the grammar, and writes what it reads.
struct Reader<'a> {
    tokens: &'a [(usize, Token)],
    at: usize,
    depth: usize,
    /// Column behind the last letter.
    end: usize,
    names: Vec<(String, usize)>,
    is_name: &'a dyn Fn(&str) -> bool,
}

impl Reader<'_> {
    fn next(&mut self) -> Option<(usize, Token)> {
        let token = self.tokens.get(self.at).cloned();
        self.at += 1;
        token
    }

    /// Takes one of these signs, should it be next.
    fn take(&mut self, signs: &str) -> Option<char> {
        match self.tokens.get(self.at) {
            Some((_, Token::Sign(sign))) if signs.contains(*sign) => {
                self.at += 1;
                Some(*sign)
            }
            _ => None,
        }
    }

    /// Column of the token before the next one.
    fn last(&self) -> usize {
        self.at.checked_sub(1).and_then(|before| self.tokens.get(before)).map_or(0, |(column, _)| *column)
    }

    fn sum(&mut self) -> Result<String, Slip> {
        let mut left = self.product()?;
        while let Some(sign) = self.take("+-") {
            let right = self.product()?;
            left = format!("({left}{sign}{right})");
        }
        Ok(left)
    }

    fn product(&mut self) -> Result<String, Slip> {
        let mut left = self.signed()?;
        while let Some(sign) = self.take("*/") {
            let right = self.signed()?;
            left = format!("({left}{sign}{right})");
        }
        Ok(left)
    }

    fn signed(&mut self) -> Result<String, Slip> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err((self.last(), format!("more than {DEEPEST} brackets and signs within each other")));
        }
        let read = match self.take("+-") {
            Some('-') => format!("(-({}))", self.signed()?),
            Some(_) => self.signed()?,
            None => self.power()?,
        };
        self.depth -= 1;
        Ok(read)
    }

    fn power(&mut self) -> Result<String, Slip> {
        let base = self.value()?;
        if self.take("^").is_none() {
            return Ok(base);
        }
        let exponent = self.signed()?;
        Ok(format!("({base}^{exponent})"))
    }

    fn value(&mut self) -> Result<String, Slip> {
        let before = self.last();
        let follows_a_sign = self.at > 0;
        match self.next() {
            Some((_, Token::Number(number))) => Ok(format!("({number})")),
            Some((column, Token::Word(word))) => match self.take("(") {
                Some(_) => self.call(&word, column),
                None => self.word(word, column),
            },
            Some((column, Token::Sign('('))) => {
                let inner = self.sum()?;
                self.close(column)?;
                Ok(inner)
            }
            Some((column, Token::Sign(')')))
                if !self.tokens[..self.at].iter().any(|(_, it)| *it == Token::Sign('(')) =>
            {
                Err((column, "this bracket closes nothing".to_owned()))
            }
            Some((column, Token::Sign(')'))) => {
                Err((column, "a value is missing before this bracket".to_owned()))
            }
            Some((column, Token::Sign(','))) => {
                Err((column, "a value is missing before this comma".to_owned()))
            }
            Some((column, Token::Sign(_))) => {
                Err((column, "a value is missing before this operator".to_owned()))
            }
            None if follows_a_sign => match self.tokens.last() {
                Some((column, Token::Sign('('))) => Err((*column, "this bracket is never closed".to_owned())),
                _ => Err((before, "a value is missing after this operator".to_owned())),
            },
            None => Err((self.end, "a value is missing".to_owned())),
        }
    }

    /// A signal, a parameter or a constant.
    fn word(&mut self, word: String, column: usize) -> Result<String, Slip> {
        if !(self.is_name)(&word) {
            if let Some((_, number)) = CONSTANTS.iter().find(|(name, _)| *name == word) {
                return Ok(format!("({number})"));
            }
            if UNARY.contains(&word.as_str()) || BINARY.contains(&word.as_str()) {
                return Err((column, format!("`{word}` is a function: a bracket is missing behind it")));
            }
            return Err((column, format!("`{word}` is neither a signal nor a parameter")));
        }
        let known = self.names.iter().position(|(name, _)| *name == word);
        let index = known.unwrap_or_else(|| {
            self.names.push((word, column));
            self.names.len() - 1
        });
        Ok(format!("v{index:02}"))
    }

    /// What stands in the bracket behind a function's name.
    fn call(&mut self, function: &str, column: usize) -> Result<String, Slip> {
        let bracket = self.last();
        let takes_two = BINARY.contains(&function);
        if function == "log" {
            return Err((column, "`log` may be either: write `ln` or `log10`".to_owned()));
        }
        if !takes_two && !UNARY.contains(&function) {
            let known = [UNARY, BINARY].concat().join(", ");
            return Err((column, format!("`{function}` is no function; there are {known}")));
        }
        let first = self.sum()?;
        if !takes_two {
            if self.take(",").is_some() {
                return Err((self.last(), format!("`{function}` takes one value")));
            }
            self.close(bracket)?;
            return Ok(format!("({function}({first}))"));
        }
        if self.take(",").is_none() {
            return Err((column, format!("`{function}` takes two values, with a comma between them")));
        }
        let second = self.sum()?;
        if self.take(",").is_some() {
            return Err((self.last(), format!("`{function}` takes two values")));
        }
        self.close(bracket)?;
        Ok(format!("(({first}) {function} ({second}))"))
    }

    fn close(&mut self, bracket: usize) -> Result<(), Slip> {
        match self.tokens.get(self.at) {
            None => Err((bracket, "this bracket is never closed".to_owned())),
            Some((_, Token::Sign(')'))) => {
                self.at += 1;
                Ok(())
            }
            Some((column, Token::Sign(','))) => {
                Err((*column, "a comma stands between two values of min, max or atan2".to_owned()))
            }
            Some((column, _)) => Err((*column, "an operator is missing before this".to_owned())),
        }
    }
}
