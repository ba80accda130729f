//! Several programs as one list of operations on numbered values, for programs that are evaluated at every instant.

use super::{Binary, Number, Program, Step, Unary};

/// Programs with one common variable. Each may also use the results of the programs before it.
#[derive(Clone, Debug, Default)]
pub struct Tape {
    operations: Vec<(usize, Operation)>,
    length: usize,
}

/// An operation on values by index.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Operation {
    Constant(f64),
    Copy(usize),
    Sum(usize, usize),
    Difference(usize, usize),
    Product(usize, usize),
    Scale(f64, usize),
    Shift(f64, usize),
    /// The constant minus the value.
    ConstantMinus(f64, usize),
    /// The sine, and the cosine as the value at the second index.
    SinCos(usize, usize),
    Unary(Unary, usize),
    Binary(Binary, usize, usize),
    /// A constant on the left, or on the right.
    ConstantLeft(Binary, f64, usize),
    ConstantRight(Binary, usize, f64),
}

/// An operand: a value, or a constant.
#[derive(Clone, Copy)]
enum Operand {
    Value(usize),
    Constant(f64),
}

impl Tape {
    /// The variable is value 0, the result of program i is value i + 1.
    pub fn new<'p>(programs: impl ExactSizeIterator<Item = &'p Program>) -> Self {
        let count = programs.len();
        let mut tape = Self { operations: Vec::new(), length: 1 + count };
        for (i, program) in programs.enumerate() {
            let mut stack: Vec<Operand> = Vec::new();
            for step in &program.steps {
                let operand = match *step {
                    Step::Constant(value) => Operand::Constant(value),
                    Step::Variable(index) => Operand::Value(index),
                    Step::Unary(unary) => match stack.pop() {
                        Some(Operand::Value(x)) => tape.unary(unary, x),
                        Some(Operand::Constant(x)) => Operand::Constant(x.unary(unary)),
                        None => continue,
                    },
                    Step::Binary(binary) => {
                        let (Some(y), Some(x)) = (stack.pop(), stack.pop()) else { continue };
                        tape.binary(binary, x, y)
                    }
                };
                stack.push(operand);
            }
            let result = match stack.pop() {
                Some(Operand::Value(x)) => Operation::Copy(x),
                Some(Operand::Constant(x)) => Operation::Constant(x),
                None => Operation::Constant(0.0),
            };
            // The last operation of a program writes its result directly.
            match (result, tape.operations.last_mut()) {
                (Operation::Copy(x), Some((to, _))) if *to == x && x > count && x == tape.length - 1 => {
                    *to = i + 1;
                    tape.length -= 1;
                }
                _ => tape.operations.push((i + 1, result)),
            }
        }
        tape
    }

    /// Adds an operation, unless there is an equal one; returns its value.
    fn push(&mut self, operation: Operation) -> Operand {
        if let Some((to, _)) = self.operations.iter().find(|(_, own)| *own == operation) {
            return Operand::Value(*to);
        }
        self.operations.push((self.length, operation));
        self.length += 1;
        Operand::Value(self.length - 1)
    }

    fn unary(&mut self, unary: Unary, x: usize) -> Operand {
        let (Unary::Sin | Unary::Cos) = unary else {
            return self.push(Operation::Unary(unary, x));
        };
        let known = self.operations.iter().find_map(|(to, own)| match own {
            Operation::SinCos(angle, cosine) if *angle == x => Some((*to, *cosine)),
            _ => None,
        });
        let (sine, cosine) = known.unwrap_or_else(|| {
            let (cosine, sine) = (self.length, self.length + 1);
            self.operations.push((sine, Operation::SinCos(x, cosine)));
            self.length += 2;
            (sine, cosine)
        });
        Operand::Value(if unary == Unary::Sin { sine } else { cosine })
    }

    fn binary(&mut self, binary: Binary, x: Operand, y: Operand) -> Operand {
        use Operand::{Constant, Value};
        self.push(match (binary, x, y) {
            (_, Constant(x), Constant(y)) => return Constant(x.binary(binary, y)),
            (Binary::Add, Value(x), Value(y)) => Operation::Sum(x, y),
            (Binary::Subtract, Value(x), Value(y)) => Operation::Difference(x, y),
            (Binary::Multiply, Value(x), Value(y)) => Operation::Product(x, y),
            (Binary::Multiply, Constant(c), Value(x)) | (Binary::Multiply, Value(x), Constant(c)) => {
                Operation::Scale(c, x)
            }
            (Binary::Add, Constant(c), Value(x)) | (Binary::Add, Value(x), Constant(c)) => Operation::Shift(c, x),
            (Binary::Subtract, Value(x), Constant(c)) => Operation::Shift(-c, x),
            (Binary::Subtract, Constant(c), Value(x)) => Operation::ConstantMinus(c, x),
            (_, Value(x), Value(y)) => Operation::Binary(binary, x, y),
            (_, Constant(c), Value(x)) => Operation::ConstantLeft(binary, c, x),
            (_, Value(x), Constant(c)) => Operation::ConstantRight(binary, x, c),
        })
    }

    /// Number of values.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Computes all values from the variable, value 0.
    ///
    /// # Panics
    /// If there are fewer than [`Self::length`].
    pub fn run<N: Number>(&self, values: &mut [N]) {
        let values = &mut values[..self.length];
        for &(to, operation) in &self.operations {
            match operation {
                Operation::Constant(c) => values[to] = N::constant(c),
                Operation::Copy(x) => values[to] = values[x],
                Operation::Sum(x, y) => values[to] = values[x].binary(Binary::Add, values[y]),
                Operation::Difference(x, y) => values[to] = values[x].binary(Binary::Subtract, values[y]),
                Operation::Product(x, y) => values[to] = values[x].binary(Binary::Multiply, values[y]),
                Operation::Scale(c, x) => values[to] = values[x].scaled(c),
                Operation::Shift(c, x) => values[to] = values[x].shifted(c),
                Operation::ConstantMinus(c, x) => values[to] = N::constant(c).binary(Binary::Subtract, values[x]),
                Operation::SinCos(x, cosine) => (values[to], values[cosine]) = N::sin_cos(values[x]),
                // Kept separate so that the square root is inlined.
                Operation::Unary(Unary::Sqrt, x) => values[to] = values[x].unary(Unary::Sqrt),
                Operation::Unary(unary, x) => values[to] = values[x].unary(unary),
                Operation::Binary(binary, x, y) => values[to] = values[x].binary(binary, values[y]),
                Operation::ConstantLeft(Binary::Divide, c, x) => {
                    values[to] = N::constant(c).binary(Binary::Divide, values[x])
                }
                Operation::ConstantLeft(binary, c, x) => values[to] = N::constant(c).binary(binary, values[x]),
                Operation::ConstantRight(binary, x, c) => values[to] = values[x].binary(binary, N::constant(c)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jet::Jet;

    #[test]
    fn a_tape_has_the_bits_of_its_programs() {
        let texts = [
            "2*t",
            "a",
            "3",
            "sin(a)*cos(t) - t/a",
            "1/(2 + d) + d^2",
            "-t + 4 - d",
            "5 - sqrt(t)*(t - 1)",
            "atan2(a, 3)",
            "cos(b) + sin(b)",
        ];
        let names = ["t", "a", "b", "c", "d"];
        let parse = |text: &&str| Program::parse(text, |name| names.iter().position(|own| *own == name), &names);
        let programs: Vec<Program> = texts.iter().map(|text| parse(text).expect(text)).collect();
        let tape = Tape::new(programs.iter());
        for t in [0.2, 1.7] {
            let mut by_tape = vec![Jet::default(); tape.length()];
            by_tape[0] = Jet::new(t, 1.0, 0.0);
            tape.run(&mut by_tape);
            let mut one_by_one = vec![by_tape[0]];
            for program in &programs {
                one_by_one.push(program.eval(&one_by_one));
            }
            assert_eq!(one_by_one, by_tape[..one_by_one.len()]);
            let mut plain = vec![0.0; tape.length()];
            plain[0] = t;
            tape.run(&mut plain);
            assert!(by_tape.iter().zip(plain).all(|(jet, value)| jet.value == value), "{t}");
        }
    }
}
