//! A compiled expression: a flat program in postfix order, run on a stack of fixed size.

use super::{Point, step_response};

/// Reads one signal of a point.
pub(super) type ReadSignal = fn(&Point) -> f64;
/// A function of one value.
pub(super) type Unary = fn(f64) -> f64;
/// A function of two values, the first of them beneath the second on the stack.
pub(super) type Binary = fn(f64, f64) -> f64;

/// A function that remembers: of what is beneath on the stack, with the number on top.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Remembering {
    /// Play: it stands still until what it follows has gone the number away from it, and then is dragged along.
    Play,
    /// A first-order lag with the number [s] as its time constant.
    Lag,
    /// A relay: one beyond the number, minus one beyond its negative, and between them what it was.
    Relay,
}

impl Remembering {
    /// What it holds where `value` has lasted; a relay between its thresholds is where it would be without any.
    fn at_rest(self, value: f64) -> f64 {
        match self {
            Self::Play | Self::Lag => value,
            Self::Relay => value.signum(),
        }
    }

    /// What it holds `span` [s] later, while `value` holds.
    fn after(self, held: f64, value: f64, number: f64, span: f64) -> f64 {
        match self {
            Self::Play => held.max(value - number.abs()).min(value + number.abs()),
            Self::Lag => held + (value - held) * step_response(number.abs().recip(), span),
            Self::Relay if value > number.abs() => 1.0,
            Self::Relay if value < -number.abs() => -1.0,
            Self::Relay => held,
        }
    }
}

/// One step of a program. What takes values takes them from the top of the stack and leaves its result there.
#[derive(Debug, Clone, Copy)]
pub(super) enum Operation {
    Constant(f64),
    Signal(ReadSignal),
    /// The parameter of this index.
    Parameter(usize),
    Negate,
    Square,
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Unary(Unary),
    Binary(Binary),
    /// What is remembered; its value now where nothing is yet.
    Remember(Remembering),
}

impl Operation {
    /// How many values it takes from the stack.
    fn takes(self) -> usize {
        match self {
            Self::Constant(_) | Self::Signal(_) | Self::Parameter(_) => 0,
            Self::Negate | Self::Square | Self::Unary(_) => 1,
            _ => 2,
        }
    }
}

/// Operations in postfix order, which leave one value on the stack.
#[derive(Debug, Clone, Default)]
pub(super) struct Program {
    operations: Vec<Operation>,
    /// Values on the stack behind the last operation, and the most at any time.
    height: usize,
    highest: usize,
    /// The place of the operation that remembers.
    remembers: Option<(usize, Remembering)>,
}

/// Most values on the stack, a power of two: three for each of the 64 brackets and signs that may stand within each other fit.
const DEEPEST: usize = 256;
/// As many as almost every expression needs; a large stack takes longer to clear than such an expression to run.
const USUAL: usize = 8;

impl Program {
    /// Adds an operation; one that takes constants alone is done at once.
    pub fn push(&mut self, operation: Operation) {
        self.height = (self.height + 1).saturating_sub(operation.takes());
        self.highest = self.highest.max(self.height);
        let operation = match (operation, self.operations.last()) {
            (Operation::Power, Some(Operation::Constant(2.0))) => {
                self.operations.pop();
                Operation::Square
            }
            _ => operation,
        };
        let first = self.operations.len().saturating_sub(operation.takes());
        let mut taken = self.operations.iter().skip(first);
        let is_lasting = matches!(operation, Operation::Remember(_));
        let is_done = operation.takes() > 0
            && !is_lasting
            && taken.all(|taken| matches!(taken, Operation::Constant(_)));
        if let Operation::Remember(kind) = operation {
            self.remembers = Some((self.operations.len(), kind));
        }
        self.operations.push(operation);
        if is_done {
            let done: Vec<Operation> = self.operations.drain(first..).collect();
            self.operations.push(Operation::Constant(run::<USUAL>(&done, &[], &Point::default()).1));
        }
    }

    /// Whether it fits on the stack.
    pub fn fits(&self) -> bool {
        self.highest <= DEEPEST
    }

    /// What it comes to; a parameter that is not there is not a number.
    #[inline]
    pub fn value(&self, parameters: &[f64], point: &Point) -> f64 {
        if self.highest <= USUAL {
            run::<USUAL>(&self.operations, parameters, point).1
        } else {
            run::<DEEPEST>(&self.operations, parameters, point).1
        }
    }

    /// Whether it has a function that remembers.
    pub fn remembers(&self) -> bool {
        self.remembers.is_some()
    }

    /// What the function that remembers follows, and its number.
    fn followed(&self, parameters: &[f64], point: &Point) -> Option<(Remembering, f64, f64)> {
        let (place, kind) = self.remembers?;
        let (value, number) = run::<DEEPEST>(self.operations.get(..place)?, parameters, point);
        Some((kind, value, number))
    }

    /// What it remembers in the steady state.
    pub fn memory_at_rest(&self, parameters: &[f64], point: &Point) -> f64 {
        self.followed(parameters, point).map_or(0.0, |(kind, value, _)| kind.at_rest(value))
    }

    /// What it remembers `span` [s] after it remembered `held`, the point held.
    pub fn memory_after(&self, parameters: &[f64], held: f64, point: &Point, span: f64) -> f64 {
        let followed = self.followed(parameters, point);
        followed.map_or(held, |(kind, value, number)| kind.after(held, value, number, span))
    }

    /// [1/s] how fast it may forget; none of a play or a relay, which do not care for time.
    pub fn memory_rate(&self, parameters: &[f64]) -> f64 {
        match self.followed(parameters, &Point::default()) {
            Some((Remembering::Lag, _, number)) => number.abs().recip(),
            _ => 0.0,
        }
    }
}

/// Runs operations on a stack of `SIZE` values, a power of two; the last two values, the one on top behind. The value on top is kept apart from it; places are taken by
/// their remainder, so that none lies outside, which [`Program::fits`] sees to anyway.
fn run<const SIZE: usize>(operations: &[Operation], parameters: &[f64], point: &Point) -> (f64, f64) {
    let mut stack = [0.0; SIZE];
    let mut height = 0_usize;
    let mut top = f64::NAN;
    for operation in operations {
        let pushed = match *operation {
            Operation::Constant(value) => value,
            Operation::Signal(read) => read(point),
            Operation::Parameter(index) => parameters.get(index).copied().unwrap_or(f64::NAN),
            Operation::Negate => {
                top = -top;
                continue;
            }
            Operation::Square => {
                top *= top;
                continue;
            }
            Operation::Unary(function) => {
                top = function(top);
                continue;
            }
            two => {
                height = height.wrapping_sub(1);
                let under = stack[height % SIZE];
                top = match two {
                    Operation::Add => under + top,
                    Operation::Subtract => under - top,
                    Operation::Multiply => under * top,
                    Operation::Divide => under / top,
                    Operation::Binary(function) => function(under, top),
                    Operation::Remember(kind) => point.memory.unwrap_or_else(|| kind.at_rest(under)),
                    _ => under.powf(top),
                };
                continue;
            }
        };
        // The first value pushes what is not a number yet beneath it, where nobody looks.
        stack[height % SIZE] = top;
        height = height.wrapping_add(1);
        top = pushed;
    }
    (stack[height.wrapping_sub(1) % SIZE], top)
}
