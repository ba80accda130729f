//! Expressions such as `10 * sin(2*pi*3*t) * exp(-t/2)`: parsed once into a postfix program, then evaluated for any number type
//! without allocating.
//!
//! Implemented here because existing crates call std's elementary functions, whose bits differ between native and wasm, or
//! require a regex engine, and do not report the byte of an error.

mod derivatives;
mod tape;

pub use tape::Tape;

use crate::suggest::{brief, did_you_mean, nearest_name};

/// Longest expression, bytes.
pub(crate) const MAX_EXPRESSION_LENGTH: usize = 4000;
/// Maximum nesting of parentheses, calls, signs and powers.
const MAX_DEPTH: usize = 60;
/// Maximum number of intermediate results on the stack.
const STACK: usize = 32;

/// An operation on one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is what its name says in the table of functions")]
pub enum Unary {
    Negate,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Ln,
    Sqrt,
    /// 0 below 0, 1 above 1, between them 10 x^3 - 15 x^4 + 6 x^5: twice continuously differentiable.
    SmoothStep,
    Abs,
}

/// An operation on two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is what its name says in the table of functions")]
pub enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Atan2,
    Min,
    Max,
}

/// Number type of an evaluation: f64, or one that carries more (derivatives, a dimension).
///
/// Operations on constants must agree with f64, because the parser folds constants.
pub trait Number: Copy {
    /// A constant.
    fn constant(value: f64) -> Self;
    /// The result of `operation`.
    fn unary(self, operation: Unary) -> Self;
    /// The result of `operation` with `self` on the left, or as the first argument.
    fn binary(self, operation: Binary, other: Self) -> Self;

    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self) {
        (self.unary(Unary::Sin), self.unary(Unary::Cos))
    }

    /// `self` times `factor`.
    fn scaled(self, factor: f64) -> Self {
        Self::constant(factor).binary(Binary::Multiply, self)
    }

    /// `self` plus `shift`.
    fn shifted(self, shift: f64) -> Self {
        Self::constant(shift).binary(Binary::Add, self)
    }
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn sin_cos(self) -> (Self, Self) {
        libm::sincos(self)
    }

    fn unary(self, operation: Unary) -> Self {
        match operation {
            Unary::Negate => -self,
            Unary::Sin => libm::sin(self),
            Unary::Cos => libm::cos(self),
            Unary::Tan => libm::tan(self),
            Unary::Asin => libm::asin(self),
            Unary::Acos => libm::acos(self),
            Unary::Atan => libm::atan(self),
            Unary::Sinh => libm::sinh(self),
            Unary::Cosh => libm::cosh(self),
            Unary::Tanh => libm::tanh(self),
            Unary::Exp => libm::exp(self),
            Unary::Ln => libm::log(self),
            Unary::Sqrt => self.sqrt(),
            Unary::SmoothStep => smooth_step(self).0,
            Unary::Abs => self.abs(),
        }
    }

    fn binary(self, operation: Binary, other: Self) -> Self {
        match operation {
            Binary::Add => self + other,
            Binary::Subtract => self - other,
            Binary::Multiply => self * other,
            Binary::Divide => self / other,
            Binary::Power => libm::pow(self, other),
            Binary::Atan2 => libm::atan2(self, other),
            Binary::Min => self.min(other),
            Binary::Max => self.max(other),
        }
    }
}

/// Several numbers at once; each has the bits that it has alone.
impl<N: Number, const COUNT: usize> Number for [N; COUNT] {
    fn constant(value: f64) -> Self {
        [N::constant(value); COUNT]
    }

    fn unary(self, operation: Unary) -> Self {
        self.map(|x| x.unary(operation))
    }

    fn binary(self, operation: Binary, other: Self) -> Self {
        std::array::from_fn(|i| self[i].binary(operation, other[i]))
    }

    fn sin_cos(self) -> (Self, Self) {
        let both = self.map(N::sin_cos);
        (both.map(|(sine, _)| sine), both.map(|(_, cosine)| cosine))
    }

    fn scaled(self, factor: f64) -> Self {
        self.map(|x| x.scaled(factor))
    }

    fn shifted(self, shift: f64) -> Self {
        self.map(|x| x.shifted(shift))
    }
}

/// 10 x^3 - 15 x^4 + 6 x^5 between 0 and 1, constant outside, with its first two derivatives: all three are continuous.
pub(crate) fn smooth_step(x: f64) -> (f64, f64, f64) {
    if x <= 0.0 {
        return (0.0, 0.0, 0.0);
    }
    if x >= 1.0 {
        return (1.0, 0.0, 0.0);
    }
    let y = 1.0 - x;
    (x * x * x * (10.0 + x * (6.0 * x - 15.0)), 30.0 * (x * y) * (x * y), 60.0 * x * y * (y - x))
}

/// Meaning of a name before `(`.
#[derive(Clone, Copy)]
enum Call {
    One(Unary),
    Two(Binary),
}

/// Functions: name, operation, and whether its first two derivatives are continuous wherever it has a value.
const FUNCTIONS: [(&str, Call, bool); 18] = [
    ("sin", Call::One(Unary::Sin), true),
    ("cos", Call::One(Unary::Cos), true),
    ("tan", Call::One(Unary::Tan), true),
    ("asin", Call::One(Unary::Asin), true),
    ("acos", Call::One(Unary::Acos), true),
    ("atan", Call::One(Unary::Atan), true),
    ("sinh", Call::One(Unary::Sinh), true),
    ("cosh", Call::One(Unary::Cosh), true),
    ("tanh", Call::One(Unary::Tanh), true),
    ("exp", Call::One(Unary::Exp), true),
    ("ln", Call::One(Unary::Ln), true),
    ("sqrt", Call::One(Unary::Sqrt), true),
    ("smoothstep", Call::One(Unary::SmoothStep), true),
    ("abs", Call::One(Unary::Abs), false),
    ("pow", Call::Two(Binary::Power), true),
    // Except for the jump at the negative x axis.
    ("atan2", Call::Two(Binary::Atan2), true),
    ("min", Call::Two(Binary::Min), false),
    ("max", Call::Two(Binary::Max), false),
];

/// Constants; a variable of the same name takes precedence.
const CONSTANTS: [(&str, f64); 2] = [("pi", std::f64::consts::PI), ("e", std::f64::consts::E)];

/// One step of a program.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    Constant(f64),
    Variable(usize),
    Unary(Unary),
    Binary(Binary),
}

/// A parsed expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    steps: Vec<Step>,
    /// Largest number of intermediate results on the stack.
    stack_depth: usize,
    kink: Option<&'static str>,
}

impl Program {
    /// Indices of the variables that the program uses; some may occur twice.
    pub fn variables(&self) -> impl Iterator<Item = usize> + '_ {
        self.steps.iter().filter_map(|step| match step {
            Step::Variable(index) => Some(*index),
            _ => None,
        })
    }

    /// Parses `text`. `variable` maps a name to the index of its value in [`Self::eval`]; `names` are candidates for the
    /// suggestions of an error.
    ///
    /// # Errors
    /// Position and cause of the error.
    pub fn parse(
        text: &str,
        variable: impl Fn(&str) -> Option<usize>,
        names: &[&str],
    ) -> Result<Self, ExpressionError> {
        Self::parse_text(text, variable, names, |_| None, false)
    }

    /// As [`Self::parse`]; a number may be followed by a unit, which multiplies it. `unit` returns the length of the unit at the
    /// start of a text, and the index of its size among the variables.
    ///
    /// # Errors
    /// As [`Self::parse`], and a power of a number with a unit, which is ambiguous unless written at the unit as in `m^2`.
    pub fn parse_with_units(
        text: &str,
        variable: impl Fn(&str) -> Option<usize>,
        names: &[&str],
        unit: impl Fn(&str) -> Option<(usize, usize)>,
    ) -> Result<Self, ExpressionError> {
        Self::parse_text(text, variable, names, unit, true)
    }

    fn parse_text(
        text: &str,
        variable: impl Fn(&str) -> Option<usize>,
        names: &[&str],
        unit: impl Fn(&str) -> Option<(usize, usize)>,
        angles: bool,
    ) -> Result<Self, ExpressionError> {
        if text.len() > MAX_EXPRESSION_LENGTH {
            return Err(ExpressionError { at: 0, fault: Fault::TooLong });
        }
        let mut parser = Parser {
            text,
            at: 0,
            steps: Vec::new(),
            stack_depth: 0,
            max_stack_depth: 0,
            depth: 0,
            kink: None,
            variable: &variable,
            names,
            unit: &unit,
            angles,
        };
        parser.sum()?;
        match parser.peek() {
            None => Ok(Self { steps: parser.steps, stack_depth: parser.max_stack_depth, kink: parser.kink }),
            Some(_) => Err(parser.unexpected("an operator")),
        }
    }

    /// Value for these variables.
    ///
    /// # Panics
    /// If `variables` lacks one that the text uses.
    pub fn eval<N: Number>(&self, variables: &[N]) -> N {
        // To clear the whole stack would take longer than a short program.
        match self.stack_depth {
            0..=4 => self.eval_on::<N, 4>(variables),
            5..=8 => self.eval_on::<N, 8>(variables),
            _ => self.eval_on::<N, STACK>(variables),
        }
    }

    /// The same with a stack of this depth.
    fn eval_on<N: Number, const DEPTH: usize>(&self, variables: &[N]) -> N {
        let mut stack = [N::constant(0.0); DEPTH];
        let mut top = 0;
        for step in &self.steps {
            match *step {
                Step::Constant(value) => {
                    stack[top] = N::constant(value);
                    top += 1;
                }
                Step::Variable(index) => {
                    stack[top] = variables[index];
                    top += 1;
                }
                Step::Unary(operation) => stack[top - 1] = stack[top - 1].unary(operation),
                Step::Binary(operation) => {
                    top -= 1;
                    stack[top - 1] = stack[top - 1].binary(operation, stack[top]);
                }
            }
        }
        stack[0]
    }

    /// The same program with `values` bound to all variables but the first `free`, and constants folded.
    ///
    /// # Panics
    /// As [`Self::eval`].
    pub fn with_bound_variables(&self, free: usize, values: &[f64]) -> Self {
        let mut steps: Vec<Step> = Vec::new();
        for &step in &self.steps {
            let step = match step {
                Step::Variable(index) if index >= free => Step::Constant(values[index - free]),
                step => step,
            };
            match (step, &mut steps[..]) {
                (Step::Unary(operation), [.., Step::Constant(x)]) => *x = x.unary(operation),
                (Step::Binary(operation), [.., Step::Constant(x), Step::Constant(y)]) => {
                    *x = x.binary(operation, *y);
                    steps.pop();
                }
                _ => steps.push(step),
            }
        }
        Self { steps, stack_depth: self.stack_depth, kink: self.kink }
    }

    /// A function in the program whose derivatives jump, if any.
    pub fn kink(&self) -> Option<&'static str> {
        self.kink
    }

    /// Number of steps: constants, variables and operations.
    pub fn length(&self) -> usize {
        self.steps.len()
    }

    /// Whether the program uses variable `index`.
    pub fn uses(&self, index: usize) -> bool {
        self.steps.contains(&Step::Variable(index))
    }
}

/// An error in an expression.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{fault}")]
pub struct ExpressionError {
    /// Byte offset in the text.
    pub at: usize,
    /// The fault at that offset.
    pub fault: Fault,
}

/// Faults of expressions.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// Unexpected text.
    #[error("{} where {expected} is expected", .found.map_or_else(|| "ends".to_owned(), |found| format!("`{found}`")))]
    Expected {
        /// Expected text.
        expected: &'static str,
        /// Character found; `None` at the end.
        found: Option<char>,
    },
    /// No variable, constant or function has this name.
    #[error(
        "no {} `{}`{}{}",
        if *.called { "function" } else { "variable" },
        brief(.name),
        did_you_mean(.nearest.as_deref()),
        function_list(*.called)
    )]
    Unknown {
        /// The name.
        name: String,
        /// Nearest known name.
        nearest: Option<String>,
        /// Whether it is called like a function.
        called: bool,
    },
    /// A function has the wrong number of arguments.
    #[error("`{function}` takes {}", if *.expected == 1 { "one argument".to_owned() } else { format!("{expected} arguments") })]
    Arguments {
        /// The function.
        function: &'static str,
        /// Required number.
        expected: usize,
    },
    /// A function without its arguments.
    #[error("`{0}` is a function: its argument follows in parentheses")]
    NotCalled(&'static str),
    /// Not a finite f64.
    #[error("no finite number")]
    NoNumber,
    /// Nested too deeply.
    #[error("nested too deeply")]
    TooDeep,
    /// Longer than 4000 characters.
    #[error("too long; allowed at most {MAX_EXPRESSION_LENGTH} bytes")]
    TooLong,
}

/// The functions, if one of them was meant.
fn function_list(called: bool) -> String {
    if called { format!("; functions: {}", FUNCTIONS.map(|row| row.0).join(", ")) } else { String::new() }
}

struct Parser<'t> {
    text: &'t str,
    at: usize,
    steps: Vec<Step>,
    /// Depth of the stack after `steps`.
    stack_depth: usize,
    max_stack_depth: usize,
    depth: usize,
    kink: Option<&'static str>,
    variable: &'t dyn Fn(&str) -> Option<usize>,
    names: &'t [&'t str],
    unit: &'t dyn Fn(&str) -> Option<(usize, usize)>,
    /// Whether angles are distinct from pure numbers; results in radians are then not folded.
    angles: bool,
}

type ParseResult = Result<(), ExpressionError>;

impl<'t> Parser<'t> {
    /// Next character that is not a space.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        self.text[self.at..].chars().next()
    }

    /// Consumes `expected` if it is next.
    fn consume(&mut self, expected: &str) -> bool {
        self.peek();
        let found = self.text[self.at..].starts_with(expected);
        if found {
            self.at += expected.len();
        }
        found
    }

    fn error(&self, at: usize, fault: Fault) -> ExpressionError {
        ExpressionError { at, fault }
    }

    fn unexpected(&mut self, expected: &'static str) -> ExpressionError {
        let found = self.peek();
        self.error(self.at, Fault::Expected { expected, found })
    }

    /// Adds a step, or folds it if its operands are constant.
    fn push(&mut self, step: Step) -> ParseResult {
        let returns_angle =
            matches!(step, Step::Unary(Unary::Asin | Unary::Acos | Unary::Atan) | Step::Binary(Binary::Atan2));
        let folds = !(self.angles && returns_angle);
        match (step, &mut self.steps[..]) {
            (Step::Unary(operation), [.., Step::Constant(x)]) if folds => *x = x.unary(operation),
            (Step::Binary(operation), [.., Step::Constant(x), Step::Constant(y)]) if folds => {
                *x = x.binary(operation, *y);
                self.steps.pop();
                self.stack_depth -= 1;
            }
            _ => {
                match step {
                    Step::Constant(_) | Step::Variable(_) => self.stack_depth += 1,
                    Step::Unary(_) => {}
                    Step::Binary(_) => self.stack_depth -= 1,
                }
                self.steps.push(step);
            }
        }
        self.max_stack_depth = self.max_stack_depth.max(self.stack_depth);
        if self.stack_depth > STACK {
            return Err(self.error(self.at, Fault::TooDeep));
        }
        Ok(())
    }

    /// Terms with `+` and `-` between them.
    fn sum(&mut self) -> ParseResult {
        self.product()?;
        loop {
            let operation = match self.peek() {
                Some('+') => Binary::Add,
                Some('-') => Binary::Subtract,
                _ => return Ok(()),
            };
            self.at += 1;
            self.product()?;
            self.push(Step::Binary(operation))?;
        }
    }

    /// Factors with `*` and `/` between them.
    fn product(&mut self) -> ParseResult {
        self.signed()?;
        loop {
            let operation = match self.peek() {
                Some('*') => Binary::Multiply,
                Some('/') => Binary::Divide,
                _ => return Ok(()),
            };
            self.at += 1;
            self.signed()?;
            self.push(Step::Binary(operation))?;
        }
    }

    /// A power with its sign, which binds weaker: -x^2 = -(x^2). Every nesting passes through here.
    fn signed(&mut self) -> ParseResult {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(self.error(self.at, Fault::TooDeep));
        }
        if self.consume("-") {
            self.signed()?;
            self.push(Step::Unary(Unary::Negate))?;
        } else if self.consume("+") {
            self.signed()?;
        } else {
            self.atom()?;
            // Right-associative: x^y^z = x^(y^z).
            if self.consume("^") || self.consume("**") {
                self.signed()?;
                self.push(Step::Binary(Binary::Power))?;
            }
        }
        self.depth -= 1;
        Ok(())
    }

    fn atom(&mut self) -> ParseResult {
        match self.peek() {
            Some('(') => {
                self.at += 1;
                self.sum()?;
                self.close()
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.name(),
            _ => Err(self.unexpected("a number, a name or `(`")),
        }
    }

    fn close(&mut self) -> ParseResult {
        match self.consume(")") {
            true => Ok(()),
            false => Err(self.unexpected("an operator or `)`")),
        }
    }

    fn number(&mut self) -> ParseResult {
        let rest = &self.text[self.at..];
        let digits = |from: usize| {
            let tail = rest[from..].bytes();
            from + tail.take_while(u8::is_ascii_digit).count()
        };
        let mut end = digits(0);
        if rest[end..].starts_with('.') {
            end = digits(end + 1);
        }
        if rest[end..].starts_with(['e', 'E']) {
            let sign = usize::from(rest[end + 1..].starts_with(['+', '-']));
            let exponent = digits(end + 1 + sign);
            // An `e` without digits does not begin an exponent.
            if exponent > end + 1 + sign {
                end = exponent;
            }
        }
        match rest[..end].parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.at += end;
                self.push(Step::Constant(value))?;
                self.unit()
            }
            _ => Err(self.error(self.at, Fault::NoNumber)),
        }
    }

    /// The unit after a number, if any.
    fn unit(&mut self) -> ParseResult {
        self.peek();
        let Some((length, size)) = (self.unit)(&self.text[self.at..]) else {
            return Ok(());
        };
        let simple = !self.text[self.at..self.at + length].contains(['/', ' ', '^']);
        self.at += length;
        self.push(Step::Variable(size))?;
        if simple && let Some(power) = self.unit_power() {
            self.push(Step::Constant(power))?;
            self.push(Step::Binary(Binary::Power))?;
        }
        self.push(Step::Binary(Binary::Multiply))?;
        let power = self.peek() == Some('^') || self.text[self.at..].starts_with("**");
        if power {
            return Err(self.unexpected("an operator other than a power"));
        }
        Ok(())
    }

    /// A whole power written at a unit, as in `m^2`; it applies to the unit alone.
    fn unit_power(&mut self) -> Option<f64> {
        let mut rest = self.text[self.at..].strip_prefix('^')?.chars();
        let power = rest.next()?.to_digit(10).filter(|power| *power > 0)?;
        let whole = !rest.next().is_some_and(|c| c.is_alphanumeric() || ".^_".contains(c));
        whole.then(|| {
            self.at += 2;
            f64::from(power)
        })
    }

    /// A variable, a constant or a call. A name may contain dots.
    fn name(&mut self) -> ParseResult {
        let (start, rest) = (self.at, &self.text[self.at..]);
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.')).unwrap_or(rest.len());
        let name = &rest[..end];
        self.at += end;
        let row = FUNCTIONS.iter().find(|row| row.0 == name);
        if self.consume("(") {
            let Some(&(function, call, smooth)) = row else {
                return Err(self.unknown(start, name, true));
            };
            if !smooth {
                self.kink = Some(function);
            }
            return self.arguments(start, function, call);
        }
        if let Some(index) = (self.variable)(name) {
            return self.push(Step::Variable(index));
        }
        match (CONSTANTS.iter().find(|row| row.0 == name), row) {
            (Some(&(_, value)), _) => self.push(Step::Constant(value)),
            (None, Some(&(function, ..))) => Err(self.error(start, Fault::NotCalled(function))),
            (None, None) => Err(self.unknown(start, name, false)),
        }
    }

    fn unknown(&self, at: usize, name: &str, called: bool) -> ExpressionError {
        let functions = FUNCTIONS.iter().map(|row| row.0);
        let nearest = if called {
            nearest_name(name, functions)
        } else {
            let constants = CONSTANTS.iter().map(|row| row.0);
            nearest_name(name, self.names.iter().copied().chain(constants))
        };
        let (name, nearest) = (name.to_owned(), nearest.map(str::to_owned));
        self.error(at, Fault::Unknown { name, nearest, called })
    }

    fn arguments(&mut self, start: usize, function: &'static str, call: Call) -> ParseResult {
        let (expected, step) = match call {
            Call::One(operation) => (1, Step::Unary(operation)),
            Call::Two(operation) => (2, Step::Binary(operation)),
        };
        let wrong = self.error(start, Fault::Arguments { function, expected });
        if self.peek() == Some(')') {
            return Err(wrong);
        }
        self.sum()?;
        for _ in 1..expected {
            if !self.consume(",") {
                return Err(match self.peek() {
                    Some(')') => wrong,
                    _ => self.unexpected("an operator or `,`"),
                });
            }
            self.sum()?;
        }
        if self.peek() == Some(',') {
            return Err(wrong);
        }
        self.close()?;
        self.push(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Program, ExpressionError> {
        let names = ["t", "arm.length"];
        Program::parse(text, |name| names.iter().position(|known| *known == name), &names)
    }

    fn value(text: &str) -> f64 {
        parse(text).expect(text).eval(&[0.5, 3.0])
    }

    #[test]
    fn precedence_and_association_are_those_of_mathematics() {
        for (text, expected) in [
            ("1 + 2 * 3", 7.0),
            ("7 - 2 - 1", 4.0),
            ("8 / 4 / 2", 1.0),
            ("2 ^ 3 ^ 2", 512.0),
            ("2 ** 3", 8.0),
            ("2 * 3 ** 2", 18.0),
            ("-2 ^ 2", -4.0),
            ("2 ^ -1", 0.5),
            ("2 - -3", 5.0),
            ("-(1 + t) * 2", -3.0),
            ("arm.length * t", 1.5),
            ("1.5e+1 + .5 + 2.", 17.5),
            ("2e3", 2000.0),
            ("atan2(1, 1) * 4", std::f64::consts::PI),
            ("max(min(1, 2), pow(2, 3))", 8.0),
            ("sin(pi / 2) + ln(e)", 2.0),
            ("smoothstep(t)", 0.5),
            ("abs(-t)", 0.5),
        ] {
            assert_eq!(value(text), expected, "{text}");
        }
        let by_hand = 10.0 * libm::sin(2.0 * std::f64::consts::PI * 3.0 * 0.5) * libm::exp(-0.25);
        assert_eq!(value("10 * sin(2*pi*3*t) * exp(-t/2)"), by_hand);
    }

    #[test]
    fn constant_subexpressions_are_folded() {
        assert_eq!(parse("2*pi*3 * t").unwrap().steps.len(), 3);
        assert!(parse("t").unwrap().uses(0) && !parse("1 + arm.length").unwrap().uses(0));
    }

    #[test]
    fn every_function_has_a_value_and_kinks_are_reported() {
        for (name, call, smooth) in FUNCTIONS {
            let text = match call {
                Call::One(_) => format!("{name}(t)"),
                Call::Two(_) => format!("{name}(t, 2)"),
            };
            let program = parse(&text).expect(&text);
            assert!(program.eval(&[0.5, 3.0]).is_finite(), "{text}");
            assert_eq!(program.kink().is_none(), smooth, "{text}");
        }
    }

    #[test]
    fn errors_state_their_cause_and_byte() {
        for (text, at, message) in [
            ("", 0, "ends where a number, a name or `(` is expected"),
            ("1 +", 3, "ends where a number, a name or `(` is expected"),
            ("(1 + t", 6, "ends where an operator or `)` is expected"),
            ("1 2", 2, "`2` where an operator is expected"),
            ("2t", 1, "`t` where an operator is expected"),
            ("3 * é", 4, "no variable `é`"),
            ("3 $ t", 2, "`$` where an operator is expected"),
            ("sin t", 0, "`sin` is a function"),
            ("sqr(t)", 0, "no function `sqr` (did you mean `sqrt`?)"),
            ("2 * arm.lenght", 4, "no variable `arm.lenght` (did you mean `arm.length`?)"),
            ("1 + sin(t, 2)", 4, "`sin` takes one argument"),
            ("atan2(t)", 0, "`atan2` takes 2 arguments"),
            ("cos()", 0, "`cos` takes one argument"),
            ("1e999", 0, "no finite number"),
            (".", 0, "no finite number"),
        ] {
            let error = parse(text).expect_err(text);
            assert_eq!(error.at, at, "{text}: {error}");
            assert!(error.to_string().starts_with(message), "{text}: {error}");
        }
    }

    #[test]
    fn depth_and_length_are_bounded() {
        let fault = |text: String| parse(&text).expect_err("refused").fault;
        assert_eq!(fault("(".repeat(3000)), Fault::TooDeep);
        assert_eq!(fault("-".repeat(3000)), Fault::TooDeep);
        assert_eq!(fault("t^".repeat(1500)), Fault::TooDeep);
        assert_eq!(fault("t+(".repeat(40)), Fault::TooDeep);
        assert_eq!(fault(" ".repeat(5000)), Fault::TooLong);
        // A long sum is not nested deeply.
        assert_eq!(value(&vec!["t"; 1900].join("+")), 950.0);
        let nested = format!("{}t{}", "(t+".repeat(30), ")".repeat(30));
        assert_eq!(value(&nested), 15.5);
    }
}
