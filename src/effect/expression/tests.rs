use super::*;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn evaluates_signals_and_parameters() {
    let expression = Expression::parse("-b*body_rate_rad_s*abs(body_rate) + k", &["b", "k"]).expect("parses");
    let point = Point { body_rate: -2.0, ..Point::default() };
    assert_eq!(expression.value(&[3.0, 0.5], &point), 12.5);
    assert!(expression.names("body_rate") && !expression.names("body_angle"));
}

/// As on paper.
#[test]
fn means_what_it_says() {
    let point = Point { body_rate: 3.0, ..Point::default() };
    let value = |text: &str| {
        let (b, k) = (2.0_f64, 5.0_f64);
        Expression::parse(&format!("{text}+0*(b+k)"), &["b", "k"]).expect("parses").value(&[b, k], &point)
    };
    for (text, expected) in [
        ("-body_rate^2*b", -18.0),
        ("exp(-(body_rate/b)^2)", (-2.25_f64).exp()),
        ("b*exp(-body_rate^2)", 2.0 * (-9.0_f64).exp()),
        ("2^b^3", 256.0),
        ("2^-b", 0.25),
        ("k-b-1", 2.0),
        ("k/b/2", 1.25),
        ("--b", 2.0),
        ("b*-k", -10.0),
        ("1e-3*b + 2.5E+1", 25.002),
        (".5*b", 1.0),
        ("min(max(b,1),max(k,1))", 2.0),
        ("max(-b, min(k, 3))", 3.0),
        ("atan2(b, b)", std::f64::consts::FRAC_PI_4),
        ("log10(100)*log2(8)", 6.0),
        ("2*pi + 0*e", std::f64::consts::TAU),
        ("1-(b-k)", 4.0),
        ("2*(b+\tk)", 14.0),
    ] {
        let found = value(text);
        assert!(
            (found - expected).abs() <= 1e-12 * expected.abs().max(1.0),
            "{text}: {found}, not {expected}"
        );
    }
}

/// Whatever a parameter is called, it is that parameter.
#[test]
fn a_parameter_may_have_the_name_of_a_constant_or_begin_like_a_function() {
    let names = ["e", "PI", "max_rate", "minimum", "atan2x", "τ"];
    let text = names.join("+");
    let expression = Expression::parse(&text, &names).expect("parses");
    assert_eq!(expression.value(&[1.0, 2.0, 4.0, 8.0, 16.0, 32.0], &Point::default()), 63.0);
}

#[test]
fn nothing_is_too_long_or_too_deep_to_be_refused() {
    let deep = |open: &str| format!("{}b", open.repeat(100_000));
    for text in [deep("("), deep("-"), deep("sin("), deep("2^"), "b+".repeat(100_000)] {
        let error = Expression::parse(&text, &["b"]).unwrap_err();
        let ExpressionError::Syntax { reason, .. } = error;
        assert!(reason.contains("more than 1000 words and signs"), "{reason}");
    }
    for text in ["(", "-", "sin(", "2^"].map(|open| format!("{}b", open.repeat(200))) {
        let error = Expression::parse(&text, &["b"]).unwrap_err();
        assert!(error.to_string().contains("within each other"), "{error}");
    }
    let long = format!("b{}", "+b".repeat(499));
    assert_eq!(Expression::parse(&long, &["b"]).expect("parses").value(&[1.0], &Point::default()), 500.0);
}

#[test]
fn looks_only_at_what_is_known_where_it_acts() {
    let of = |text: &str, site| Expression::parse(text, &["k"]).expect("parses").at(site);
    assert!(of("k*time", Site::SteadyRate).is_ok());
    let error = of("k + k*torque_nm", Site::BodyRateSensor).unwrap_err();
    let ExpressionError::Syntax { column, reason, .. } = &error;
    assert_eq!(*column, 6, "{error}");
    assert!(reason.contains("`torque` is not known at `body_rate_sensor`; there are time"), "{error}");
    assert!(of("k*hover_rate/propeller_rate", Site::Command).is_err());
}

/// Of a law as long as a file, on as many lines, the part that is wrong is shown.
#[test]
fn an_error_in_a_long_law_shows_its_place() {
    let text = format!("b{} ?{}", "\n+b".repeat(200), "\n+b".repeat(200));
    let said = Expression::parse(&text, &["b"]).expect_err("?").to_string();
    assert!(said.chars().count() < 350, "{said}");
    let lines: Vec<&str> = said.lines().collect();
    let marked = lines[2].find('^').and_then(|column| lines[1].chars().nth(column));
    assert_eq!((lines.len(), marked), (3, Some('?')), "{said}");
}

#[test]
fn marks_the_place() {
    let cases = [
        ("-b*body_rat", 3, "`body_rat` is neither"),
        ("-b*(body_rate", 3, "never closed"),
        ("b*body_rate)", 11, "closes nothing"),
        ("b*/body_rate", 2, "missing before this operator"),
        ("b*body_rate*", 11, "missing after"),
        ("b*body_rate # 2", 12, "means nothing"),
        ("", 0, "empty"),
        ("sin(+)", 5, "missing before this bracket"),
        ("b*foo(body_rate)", 2, "`foo` is no function; there are"),
        ("b (body_rate)", 0, "`b` is no function"),
        ("2*body_rate", 11, "`b` does not appear in it"),
        ("b body_rate", 2, "an operator is missing before this"),
        ("b*1e", 2, "`1e` is no number"),
        ("1.2.3*b", 0, "`1.2.3` is no number"),
        ("log(b)", 0, "write `ln` or `log10`"),
        ("b*sin", 2, "a bracket is missing behind it"),
        ("sin(b, 1)", 5, "takes one value"),
        ("max(b)", 0, "takes two values"),
        ("max(b, 1, 2)", 8, "takes two values"),
        ("b, 1", 1, "a comma stands between"),
        ("b > 1", 2, "`>` means nothing here"),
        ("(b b)", 3, "an operator is missing"),
        ("()*b", 1, "a value is missing before this bracket"),
        ("é*b + ü", 0, "`é` is neither"),
    ];
    for (text, place, words) in cases {
        let error = Expression::parse(text, &["b"]).unwrap_err();
        let ExpressionError::Syntax { column, reason, .. } = &error;
        assert_eq!(*column, place, "{error}");
        assert!(reason.contains(words), "{error}");
    }
}

/// An expression as a tree, which a text is written from and whose value is worked out without either grammar or program.
enum Tree {
    Number(f64),
    /// A signal or parameter, and its value.
    Name(&'static str, f64),
    Negated(Box<Tree>),
    Joined(char, Box<[Tree; 2]>),
    Called(&'static str, Vec<Tree>),
}

const OF_ONE: [&str; 22] = [
    "abs", "signum", "sqrt", "cbrt", "exp", "ln", "log2", "log10", "sin", "cos", "tan", "asin", "acos",
    "atan", "sinh", "cosh", "tanh", "floor", "ceil", "round", "trunc", "fract",
];

impl Tree {
    fn draw(random: &mut ChaCha8Rng, names: &[(&'static str, f64)], depth: usize) -> Self {
        let kind = if depth == 0 { random.random_range(0..2) } else { random.random_range(0..10) };
        let below = |random: &mut ChaCha8Rng| Self::draw(random, names, depth.saturating_sub(1));
        match kind {
            0 => Self::Number(*[0.0, 0.5, 1.0, 2.0, 3.0, 1e-3, 2.5e4].choose(random).expect("some")),
            1 => {
                let (name, value) = names.choose(random).expect("some");
                Self::Name(name, *value)
            }
            2 => Self::Negated(Box::new(below(random))),
            3 => Self::Called(OF_ONE.choose(random).expect("some"), vec![below(random)]),
            4 => Self::Called(
                ["min", "max", "atan2"].choose(random).expect("some"),
                vec![below(random), below(random)],
            ),
            _ => {
                let sign = *['+', '-', '*', '/', '^'].choose(random).expect("some");
                Self::Joined(sign, Box::new([below(random), below(random)]))
            }
        }
    }

    fn value(&self) -> f64 {
        match self {
            Self::Number(value) | Self::Name(_, value) => *value,
            Self::Negated(inner) => -inner.value(),
            Self::Joined(sign, both) => {
                let [a, b] = [both[0].value(), both[1].value()];
                match sign {
                    '+' => a + b,
                    '-' => a - b,
                    '*' => a * b,
                    '/' => a / b,
                    _ => a.powf(b),
                }
            }
            Self::Called(function, of) => {
                match (*function, of[0].value(), of.last().expect("some").value()) {
                    ("abs", a, _) => a.abs(),
                    ("signum", a, _) => a.signum(),
                    ("sqrt", a, _) => a.sqrt(),
                    ("cbrt", a, _) => a.cbrt(),
                    ("exp", a, _) => a.exp(),
                    ("ln", a, _) => a.ln(),
                    ("log2", a, _) => a.log2(),
                    ("log10", a, _) => a.log10(),
                    ("sin", a, _) => a.sin(),
                    ("cos", a, _) => a.cos(),
                    ("tan", a, _) => a.tan(),
                    ("asin", a, _) => a.asin(),
                    ("acos", a, _) => a.acos(),
                    ("atan", a, _) => a.atan(),
                    ("sinh", a, _) => a.sinh(),
                    ("cosh", a, _) => a.cosh(),
                    ("tanh", a, _) => a.tanh(),
                    ("floor", a, _) => a.floor(),
                    ("ceil", a, _) => a.ceil(),
                    ("round", a, _) => a.round(),
                    ("trunc", a, _) => a.trunc(),
                    ("fract", a, _) => a.fract(),
                    ("min", a, b) => a.min(b),
                    ("max", a, b) => a.max(b),
                    ("atan2", a, b) => a.atan2(b),
                    (other, ..) => panic!("{other} is no function"),
                }
            }
        }
    }

    /// How tightly it binds: sums 1, products 2, signs 3, powers 4, what needs no bracket 5.
    fn strength(&self) -> usize {
        match self {
            Self::Negated(_) => 3,
            Self::Joined('+' | '-', _) => 1,
            Self::Joined('*' | '/', _) => 2,
            Self::Joined(..) => 4,
            _ => 5,
        }
    }

    /// As people write it, with brackets where it binds less than `least`, and sometimes where it need not.
    fn write(&self, least: usize, random: &mut ChaCha8Rng) -> String {
        let space = if random.random_bool(0.2) { " " } else { "" };
        let text = match self {
            Self::Number(value) => format!("{value:?}"),
            Self::Name(name, _) => (*name).to_owned(),
            Self::Negated(inner) => format!("-{space}{}", inner.write(3, random)),
            Self::Joined(sign, both) => {
                let (left, right) = match sign {
                    '+' | '-' => (1, 2),
                    '*' | '/' => (2, 3),
                    _ => (5, 3),
                };
                let (left, right) = (both[0].write(left, random), both[1].write(right, random));
                format!("{left}{space}{sign}{space}{right}")
            }
            Self::Called(function, of) => {
                let of: Vec<String> = of.iter().map(|it| it.write(1, random)).collect();
                format!("{function}({space}{})", of.join(","))
            }
        };
        if self.strength() < least || random.random_bool(0.1) { format!("({text})") } else { text }
    }
}

/// What it should mean, worked out from the tree that a text was written from, is what the text's program gives.
#[test]
fn random_expressions_come_to_what_their_trees_come_to() {
    let point = Point { body_rate: -1.7, body_angle: 0.37, thrust: 5.1, time: 12.3, ..Point::default() };
    let names =
        [("body_rate_rad_s", -1.7), ("body_angle", 0.37), ("thrust", 5.1), ("time_s", 12.3), ("k", 0.83)];
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let (mut numbers, mut deep) = (0, 0);
    for round in 0..20_000 {
        let tree = Tree::draw(&mut random, &names, round % 9);
        let text = format!("{}+0*k", tree.write(1, &mut random));
        // A tree may grow beyond what is read.
        let Ok(expression) = Expression::parse(&text, &["k"]) else {
            assert!(text.len() > 1000, "{text}");
            continue;
        };
        let (found, expected) = (expression.value(&[0.83], &point), tree.value());
        let near = (found - expected).abs() <= 1e-9 * expected.abs() || found == expected;
        assert!(near || (found.is_nan() && expected.is_nan()), "{text}: {found}, not {expected}");
        numbers += usize::from(found.is_finite());
        deep += usize::from(text.len() > 100);
    }
    assert!(numbers > 10_000 && deep > 3_000, "{numbers} with a value, {deep} long ones");
}

/// The stack holds what the grammar lets through, and not more is asked of it than brackets ask.
#[test]
fn the_deepest_expression_that_is_read_is_run_too() {
    let (open, close) = ("k+1*max(2,".repeat(60), ")".repeat(60));
    let expression = Expression::parse(&format!("{open}k{close}"), &["k"]).expect("not too deep");
    assert_eq!(expression.value(&[1.0], &Point::default()), 62.0);
    assert!(expression.value(&[], &Point::default()).is_nan());
}

/// Play stands still within its width and is dragged along at it; a lag has gone 63 % of its way after its time constant.
#[test]
fn play_and_lag_remember() {
    let at = |command: f64, memory: Option<f64>| Point { command, memory, ..Point::default() };
    let play = Expression::parse("k*(play(command,w)-command)", &["k", "w"]).expect("parses");
    let numbers = [2.0, 0.1];
    assert!(play.remembers());
    assert_eq!(play.value(&numbers, &at(0.5, None)), 0.0, "at rest");
    let mut held = play.memory_at_rest(&numbers, &at(0.5, None));
    for (command, expected) in [(0.55, 0.5), (0.7, 0.6), (0.65, 0.6), (0.4, 0.5)] {
        held = play.memory_after(&numbers, held, &at(command, None), 0.02);
        assert!((held - expected).abs() < 1e-12, "{command}: {held}");
    }
    assert!((play.value(&numbers, &at(0.4, Some(held))) - 0.2).abs() < 1e-12);
    assert_eq!(play.memory_rate(&numbers), 0.0);
    let lag = Expression::parse("lag(command, t)", &["t"]).expect("parses");
    let after = lag.memory_after(&[0.5], 0.0, &at(1.0, None), 0.5);
    assert!((after - (1.0 - (-1.0_f64).exp())).abs() < 1e-12 && lag.memory_rate(&[0.5]) == 2.0);
    assert!(!Expression::parse("k", &["k"]).expect("parses").remembers());
}

/// Above its threshold one, below the other minus one, and in between what it was; at rest by the sign.
#[test]
fn a_relay_is_between_its_thresholds_what_it_was() {
    let at = |command: f64, memory: Option<f64>| Point { command, memory, ..Point::default() };
    let relay = Expression::parse("k*relay(command-0.5,w)", &["k", "w"]).expect("parses");
    for numbers in [[3.0, 0.1], [3.0, -0.1]] {
        for (command, level) in [(0.55, 1.0), (0.45, -1.0), (0.9, 1.0)] {
            assert_eq!(relay.memory_at_rest(&numbers, &at(command, None)), level, "{command}");
            assert_eq!(relay.value(&numbers, &at(command, None)), 3.0 * level, "{command}");
        }
        let mut held = -1.0;
        let way = [(0.58, -1.0), (0.61, 1.0), (0.41, 1.0), (0.5, 1.0), (0.39, -1.0), (0.59, -1.0)];
        for (command, expected) in way {
            held = relay.memory_after(&numbers, held, &at(command, None), 0.02);
            assert_eq!(held, expected, "{command}");
        }
    }
    assert_eq!(relay.memory_rate(&[3.0, 0.1]), 0.0);
    assert_eq!(relay.value(&[3.0, 0.1], &at(0.5, Some(-1.0))), -3.0);
}

#[test]
fn one_memory_is_all_that_a_law_has_where_it_may_have_one() {
    let twice = Expression::parse("k*play(command,k)+lag(command,k)", &["k"]).expect_err("two");
    let ExpressionError::Syntax { column, .. } = &twice;
    assert_eq!(*column, 18, "{twice}");
    // Within each other they would have one place for what both remember.
    for within in
        ["k*relay(lag(command,k),k)", "k*lag(command,play(command,k))", "k*relay(relay(command,k),k)"]
    {
        let error = Expression::parse(within, &["k"]).expect_err("two within each other");
        assert!(error.to_string().contains("one play, lag or relay is all that a law may have"), "{error}");
    }
    let of = |site| Expression::parse("k*play(command,k)", &["k"]).expect("parses").at(site);
    assert!(of(Site::Command).is_ok() && of(Site::SteadyRate).is_ok());
    assert!(of(Site::RotorAcceleration).is_err());
    // Constants are done at once, what remembers is not.
    let constant = Expression::parse("play(1,0.5)*k", &["k"]).expect("parses");
    assert_eq!(constant.value(&[1.0], &Point { memory: Some(3.0), ..Point::default() }), 3.0);
}
