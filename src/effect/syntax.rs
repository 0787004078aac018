//! The grammar of a user's expression: as on paper, `-x^2` is -(x²) and `2^3^2` is 2⁹. It is compiled while it is read.

use std::iter::Peekable;
use std::str::CharIndices;

use super::program::{Binary, Operation, Program, Remembering, Unary};
use super::thresholds::THRESHOLDS;

/// Where something is wrong, in characters from 0, and what.
pub(super) type SyntaxFault = (usize, String);

/// Functions of one value.
const UNARY: &[(&str, Unary)] = &[
    ("abs", f64::abs),
    ("signum", f64::signum),
    ("sqrt", f64::sqrt),
    ("cbrt", f64::cbrt),
    ("exp", f64::exp),
    ("ln", f64::ln),
    ("log2", f64::log2),
    ("log10", f64::log10),
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("asin", f64::asin),
    ("acos", f64::acos),
    ("atan", f64::atan),
    ("sinh", f64::sinh),
    ("cosh", f64::cosh),
    ("tanh", f64::tanh),
    ("floor", f64::floor),
    ("ceil", f64::ceil),
    ("round", f64::round),
    ("trunc", f64::trunc),
    ("fract", f64::fract),
];
/// Functions of two.
const BINARY: &[(&str, Binary)] = &[("min", f64::min), ("max", f64::max), ("atan2", f64::atan2)];
/// Functions of a value and a number that remember.
const REMEMBERING: &[(&str, Remembering)] =
    &[("play", Remembering::Play), ("lag", Remembering::Lag), ("relay", Remembering::Relay)];
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

/// A text as a program, and the signals and parameters it reads, each with the column where it came first.
pub(super) struct Compiled {
    pub program: Program,
    pub names: Vec<(String, usize)>,
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64),
    Word(String),
    Sign(char),
}

/// Compiles `text`; `bind` reads the words that are signals and parameters.
pub(super) fn compile(text: &str, bind: &dyn Fn(&str) -> Option<Operation>) -> Result<Compiled, SyntaxFault> {
    let tokens = tokens(text)?;
    if tokens.is_empty() {
        return Err((0, "it is empty".to_owned()));
    }
    if let Some((column, _)) = tokens.get(THRESHOLDS.longest_expression) {
        return Err((*column, format!("more than {} words and signs", THRESHOLDS.longest_expression)));
    }
    let end = text.chars().count();
    let compiled = Compiled { program: Program::default(), names: Vec::new() };
    let mut reader = Reader { tokens: &tokens, at: 0, depth: 0, end, compiled, bind };
    reader.sum()?;
    match reader.next() {
        None if !reader.compiled.program.fits() => Err((0, "too much within each other".to_owned())),
        None => Ok(reader.compiled),
        Some((column, Token::Sign(')'))) => Err((column, "this bracket closes nothing".to_owned())),
        Some((column, Token::Sign(','))) => Err((
            column,
            "a comma stands between two values of min, max, atan2, play, lag or relay".to_owned(),
        )),
        Some((column, _)) => Err((column, "an operator is missing before this".to_owned())),
    }
}

fn tokens(text: &str) -> Result<Vec<(usize, Token)>, SyntaxFault> {
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

/// Goes down the grammar, and compiles what it reads.
struct Reader<'a> {
    tokens: &'a [(usize, Token)],
    at: usize,
    depth: usize,
    /// Column behind the last letter.
    end: usize,
    compiled: Compiled,
    bind: &'a dyn Fn(&str) -> Option<Operation>,
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

    fn emit(&mut self, operation: Operation) {
        self.compiled.program.push(operation);
    }

    fn sum(&mut self) -> Result<(), SyntaxFault> {
        self.product()?;
        while let Some(sign) = self.take("+-") {
            self.product()?;
            self.emit(if sign == '+' { Operation::Add } else { Operation::Subtract });
        }
        Ok(())
    }

    fn product(&mut self) -> Result<(), SyntaxFault> {
        self.signed()?;
        while let Some(sign) = self.take("*/") {
            self.signed()?;
            self.emit(if sign == '*' { Operation::Multiply } else { Operation::Divide });
        }
        Ok(())
    }

    fn signed(&mut self) -> Result<(), SyntaxFault> {
        self.depth += 1;
        if self.depth > THRESHOLDS.deepest_brackets {
            let most = THRESHOLDS.deepest_brackets;
            return Err((self.last(), format!("more than {most} brackets and signs within each other")));
        }
        match self.take("+-") {
            Some(sign) => {
                self.signed()?;
                if sign == '-' {
                    self.emit(Operation::Negate);
                }
            }
            None => self.power()?,
        }
        self.depth -= 1;
        Ok(())
    }

    fn power(&mut self) -> Result<(), SyntaxFault> {
        self.value()?;
        if self.take("^").is_some() {
            self.signed()?;
            self.emit(Operation::Power);
        }
        Ok(())
    }

    fn value(&mut self) -> Result<(), SyntaxFault> {
        let before = self.last();
        let follows_a_sign = self.at > 0;
        match self.next() {
            Some((_, Token::Number(number))) => {
                self.emit(Operation::Constant(number));
                Ok(())
            }
            Some((column, Token::Word(word))) => match self.take("(") {
                Some(_) => self.call(&word, column),
                None => self.word(word, column),
            },
            Some((column, Token::Sign('('))) => {
                self.sum()?;
                self.close(column)
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
    fn word(&mut self, word: String, column: usize) -> Result<(), SyntaxFault> {
        if let Some(operation) = (self.bind)(&word) {
            self.emit(operation);
            if !self.compiled.names.iter().any(|(name, _)| *name == word) {
                self.compiled.names.push((word, column));
            }
            return Ok(());
        }
        if let Some((_, number)) = CONSTANTS.iter().find(|(name, _)| *name == word) {
            self.emit(Operation::Constant(*number));
            return Ok(());
        }
        if function_names().any(|name| name == word) {
            return Err((column, format!("`{word}` is a function: a bracket is missing behind it")));
        }
        Err((column, format!("`{word}` is neither a signal nor a parameter")))
    }

    /// What stands in the bracket behind a function's name.
    fn call(&mut self, function: &str, column: usize) -> Result<(), SyntaxFault> {
        let bracket = self.last();
        if function == "log" {
            return Err((column, "`log` may be either: write `ln` or `log10`".to_owned()));
        }
        if let Some((_, unary)) = UNARY.iter().find(|(name, _)| *name == function) {
            self.sum()?;
            if self.take(",").is_some() {
                return Err((self.last(), format!("`{function}` takes one value")));
            }
            self.emit(Operation::Unary(*unary));
        } else if let Some(operation) = of_two(function) {
            self.sum()?;
            if self.take(",").is_none() {
                return Err((column, format!("`{function}` takes two values, with a comma between them")));
            }
            self.sum()?;
            if self.take(",").is_some() {
                return Err((self.last(), format!("`{function}` takes two values")));
            }
            // Asked behind what stands in its bracket: that may remember, too.
            if matches!(operation, Operation::Remember(_)) && self.compiled.program.remembers() {
                return Err((column, "one play, lag or relay is all that a law may have".to_owned()));
            }
            self.emit(operation);
        } else {
            let known: Vec<&str> = function_names().collect();
            return Err((column, format!("`{function}` is no function; there are {}", known.join(", "))));
        }
        self.close(bracket)
    }

    fn close(&mut self, bracket: usize) -> Result<(), SyntaxFault> {
        match self.tokens.get(self.at) {
            None => Err((bracket, "this bracket is never closed".to_owned())),
            Some((_, Token::Sign(')'))) => {
                self.at += 1;
                Ok(())
            }
            Some((column, Token::Sign(','))) => Err((
                *column,
                "a comma stands between two values of min, max, atan2, play, lag or relay".to_owned(),
            )),
            Some((column, _)) => Err((*column, "an operator is missing before this".to_owned())),
        }
    }
}

/// The function of two values with this name.
fn of_two(function: &str) -> Option<Operation> {
    let binary = BINARY.iter().find(|(name, _)| *name == function);
    let remembering = REMEMBERING.iter().find(|(name, _)| *name == function);
    binary
        .map(|(_, binary)| Operation::Binary(*binary))
        .or_else(|| remembering.map(|(_, kind)| Operation::Remember(*kind)))
}

fn function_names() -> impl Iterator<Item = &'static str> {
    let of_two = BINARY.iter().map(|(name, _)| *name).chain(REMEMBERING.iter().map(|(name, _)| *name));
    UNARY.iter().map(|(name, _)| *name).chain(of_two)
}
