//! A compiled expression: a flat program in postfix order, run on a stack of fixed size.

use super::Point;

/// Reads one signal of a point.
pub(super) type Signal = fn(&Point) -> f64;
/// A function of one value.
pub(super) type Unary = fn(f64) -> f64;
/// A function of two values, the first of them beneath the second on the stack.
pub(super) type Binary = fn(f64, f64) -> f64;

/// One step of a program. What takes values takes them from the top of the stack and leaves its result there.
#[derive(Debug, Clone, Copy)]
pub(super) enum Operation {
    Constant(f64),
    Signal(Signal),
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
        let is_done = operation.takes() > 0 && taken.all(|taken| matches!(taken, Operation::Constant(_)));
        self.operations.push(operation);
        if is_done {
            let done: Vec<Operation> = self.operations.drain(first..).collect();
            self.operations.push(Operation::Constant(run::<USUAL>(&done, &[], &Point::default())));
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
            run::<USUAL>(&self.operations, parameters, point)
        } else {
            run::<DEEPEST>(&self.operations, parameters, point)
        }
    }
}

/// Runs operations on a stack of `SIZE` values, a power of two. The value on top is kept apart from it; places are taken by
/// their remainder, so that none lies outside, which [`Program::fits`] sees to anyway.
fn run<const SIZE: usize>(operations: &[Operation], parameters: &[f64], point: &Point) -> f64 {
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
    top
}
