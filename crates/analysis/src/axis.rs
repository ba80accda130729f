//! The values of one varied parameter: linearly or geometrically spaced, or listed.

use std::fmt::{Display as _, Formatter};

use super::argument::Argument;
use jointplay_physics::units::{Dimension, parse_quantity};
use jointplay_scene::{Kind, Parameter, Scene, SceneError, Value, ValueError};

/// Relative distance from a whole number below which a geometrically spaced value counts as whole.
const ROUNDING: f64 = 1e-9;

/// Reasons why a range does not define values.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RangeFault {
    /// A malformed range.
    #[error("expected KEY=A..B:N, KEY=A..B:N:log or KEY=V1,V2,…, e.g. contact.clearance=0.01mm..1mm:200")]
    Form,
    /// An unknown key, or a value that the scene does not accept.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// A key that is neither a parameter nor a driven coordinate.
    #[error("{error}; {}", coordinate_list(.coordinates))]
    NoSubject {
        /// The error of the parameter.
        error: Box<SceneError>,
        /// Names of the driven coordinates.
        coordinates: Vec<String>,
    },
    /// A text that is not a value of the parameter.
    #[error("{value}: {error}")]
    Value {
        /// The invalid value.
        value: String,
        /// The reason, and the allowed values.
        error: ValueError,
    },
    /// A range of a parameter whose values are words.
    #[error("{key} is not a number; list its values, as in {key}={example}")]
    Words {
        /// Key of the parameter.
        key: String,
        /// Allowed words of the parameter.
        example: String,
    },
    /// A whole-number parameter whose spaced values are not whole.
    #[error("{key} takes whole numbers, which {count} spaced values from {from} to {to} are not")]
    NotWhole {
        /// Key of the parameter.
        key: String,
        /// First value.
        from: u64,
        /// Last value.
        to: u64,
        /// Number of values.
        count: usize,
    },
    /// A geometric range with an end that is not positive.
    #[error("both ends of a logarithmic range must be above 0")]
    NotPositive,
    /// A range without values, or with a contradictory number of values.
    #[error("the range is empty: {what}")]
    Empty {
        /// The reason.
        what: String,
    },
    /// The last value is below the first.
    #[error(
        "the range is reversed: its first end is above its second; write {to}..{from} (a start of follow-down runs through it \
         downwards)"
    )]
    Reversed {
        /// First end as given.
        from: String,
        /// Second end as given.
        to: String,
    },
}

/// Reasons why axes and starts do not define points.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RangeError {
    /// An invalid axis.
    #[error(fmt = write_axis_error)]
    Axis {
        /// Argument that gave the axis.
        argument: Argument,
        /// Text of the axis as given.
        text: String,
        /// The reason.
        fault: RangeFault,
    },
    /// A key that is given twice.
    #[error(fmt = write_duplicate_key)]
    DuplicateKey {
        /// Argument that gave the key.
        argument: Argument,
        /// The key.
        key: String,
    },
    /// A start that the axes do not allow.
    #[error(fmt = write_start_error)]
    Start {
        /// Word of the start.
        start: &'static str,
        /// The reason.
        why: String,
        /// Alternative to a cold start, in words; empty if there is none.
        or: &'static str,
    },
    /// Axes that cannot be combined: the responsible argument, if there is one, and the reason.
    #[error(fmt = write_combination_error)]
    Together(Option<Argument>, String),
}

fn write_axis_error(argument: &Argument, text: &str, fault: &RangeFault, f: &mut Formatter<'_>) -> std::fmt::Result {
    argument.fmt(f)?;
    f.write_str(if f.alternate() { ": " } else { " " })?;
    write!(f, "{text}: {fault}")
}

fn write_duplicate_key(argument: &Argument, key: &str, f: &mut Formatter<'_>) -> std::fmt::Result {
    argument.fmt(f)?;
    f.write_str(if f.alternate() { ": " } else { " " })?;
    write!(f, "{key} is given twice")
}

fn write_start_error(start: &str, why: &str, or: &str, f: &mut Formatter<'_>) -> std::fmt::Result {
    Argument::Start.write(start, f)?;
    write!(f, ": {why}; use ")?;
    Argument::Start.write("cold", f)?;
    f.write_str(or)
}

fn write_combination_error(argument: &Option<Argument>, what: &str, f: &mut Formatter<'_>) -> std::fmt::Result {
    if let Some(argument) = argument {
        argument.fmt(f)?;
        f.write_str(": ")?;
    }
    f.write_str(what)
}

fn coordinate_list(coordinates: &[String]) -> String {
    if coordinates.is_empty() {
        return "the scene has no driven coordinate".to_owned();
    }
    format!("driven coordinates: {}", coordinates.join(", "))
}

/// A driven coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivenCoordinate {
    /// Index in the order of [`Machine::driven`](jointplay_physics::machine::Machine::driven).
    pub index: usize,
    /// Length or angle.
    pub dimension: Dimension,
}

/// The quantity that an axis varies.
enum Subject {
    Parameter(&'static Parameter),
    DrivenCoordinate(DrivenCoordinate),
}

impl Subject {
    /// The quantity called `key`, for an axis given by `argument`.
    fn find(scene: &Scene, argument: Argument, key: &str) -> Result<Self, RangeFault> {
        let error = match scene.parameter(key) {
            Ok(parameter) => return Ok(Self::Parameter(parameter)),
            Err(error) => error,
        };
        if argument != Argument::Over {
            return Err(RangeFault::Scene(Box::new(error)));
        }
        let names = scene.machine.driven().map(|(joint, freedom)| {
            let dimension = if freedom.turns() { Dimension::Angle } else { Dimension::Length };
            (format!("{}.{}", joint.name, freedom.word()), dimension)
        });
        let names: Vec<(String, Dimension)> = names.collect();
        match names.iter().position(|(name, _)| name == key) {
            Some(index) => Ok(Self::DrivenCoordinate(DrivenCoordinate { index, dimension: names[index].1 })),
            None => {
                let coordinates = names.into_iter().map(|(name, _)| name).collect();
                Err(RangeFault::NoSubject { error: Box::new(error), coordinates })
            }
        }
    }

    fn coordinate(&self) -> Option<DrivenCoordinate> {
        match self {
            Self::Parameter(_) => None,
            Self::DrivenCoordinate(coordinate) => Some(*coordinate),
        }
    }

    fn read(&self, value: &str) -> Result<Value, ValueError> {
        match self {
            Self::Parameter(parameter) => parameter.read(value),
            Self::DrivenCoordinate(coordinate) => {
                let number = parse_quantity(value.trim(), coordinate.dimension);
                let refuse = |error: jointplay_physics::units::QuantityError| ValueError {
                    fault: error.into(),
                    allowed: "a position of the drive".to_owned(),
                };
                number.map(Value::Number).map_err(refuse)
            }
        }
    }

    fn has_words(&self) -> bool {
        matches!(self, Self::Parameter(parameter) if matches!(parameter.kind, Kind::Choice(_)))
    }
}

/// Spacing of the values between two ends, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Spacing {
    Linear,
    Geometric,
}

#[derive(Clone, Debug, PartialEq)]
enum Values {
    /// Spaced values, SI; `whole` marks whole numbers.
    Spaced {
        spacing: Spacing,
        from: f64,
        to: f64,
        count: usize,
        whole: bool,
    },
    Listed(Vec<Value>),
}

impl Values {
    /// Value `i`, SI; NaN for a word.
    fn number(&self, i: usize) -> f64 {
        match self {
            Self::Listed(values) => match values[i] {
                Value::Number(number) => number,
                Value::Count(count) => count as f64,
                Value::Choice(_) | Value::Unset => f64::NAN,
            },
            Self::Spaced { to, count, .. } if i + 1 == *count => *to,
            Self::Spaced { spacing: Spacing::Linear, from, to, count, .. } => {
                from + (to - from) * i as f64 / (count - 1) as f64
            }
            Self::Spaced { spacing: Spacing::Geometric, from, to, count, whole } => {
                let value = from * libm::pow(to / from, i as f64 / (count - 1) as f64);
                let nearest = value.round();
                if *whole && (value - nearest).abs() < ROUNDING * value { nearest } else { value }
            }
        }
    }
}

/// One varied parameter, or driven coordinate, with its values in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    argument: Argument,
    key: String,
    /// Text as given, for error messages.
    text: String,
    coordinate: Option<DrivenCoordinate>,
    values: Values,
}

impl Axis {
    /// Parses `KEY=A..B:N`, `KEY=A..B:N:log` or `KEY=V1,V2,…` for `scene`.
    ///
    /// # Errors
    /// An unknown key, a malformed or empty range, or a value that the parameter does not accept.
    pub fn parse(scene: &Scene, text: &str) -> Result<Self, RangeError> {
        Self::of_argument(Argument::Vary, scene, text)
    }

    /// Parses as [`Self::parse`], but KEY may also name a driven coordinate by its channel, such as `crank.angle` or
    /// `slider.position`.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn parse_over(scene: &Scene, text: &str) -> Result<Self, RangeError> {
        Self::of_argument(Argument::Over, scene, text)
    }

    fn of_argument(argument: Argument, scene: &Scene, text: &str) -> Result<Self, RangeError> {
        let read = || {
            let (key, values) = text.split_once('=').ok_or(RangeFault::Form)?;
            let (key, values) = (key.trim(), values.trim());
            let (subject, values) = if let Some((from, rest)) = values.split_once("..") {
                let range = parse_range(rest)?;
                let subject = Subject::find(scene, argument, key)?;
                let values = spaced_values(scene, &subject, key, from.trim(), range)?;
                (subject, values)
            } else {
                let subject = Subject::find(scene, argument, key)?;
                let listed =
                    values.split(',').map(|value| subject.read(value).map_err(|error| value_fault(value, error)));
                let listed = Values::Listed(listed.collect::<Result<_, _>>()?);
                (subject, listed)
            };
            let (key, text) = (key.to_owned(), text.to_owned());
            Ok(Self { argument, key, text, coordinate: subject.coordinate(), values })
        };
        read().map_err(|fault| RangeError::Axis { argument, text: text.to_owned(), fault })
    }

    /// An axis over listed values of a parameter.
    ///
    /// # Errors
    /// An unknown key, no values, or a value that the parameter does not accept.
    pub fn listed(scene: &Scene, key: &str, values: Vec<Value>) -> Result<Self, RangeError> {
        let (argument, text) = (Argument::Vary, key.to_owned());
        let read = || {
            let parameter = scene.parameter(key).map_err(|error| RangeFault::Scene(Box::new(error)))?;
            if values.is_empty() {
                return Err(RangeFault::Empty { what: "0 values".to_owned() });
            }
            let check = |value| parameter.check(value).map_err(|error| value_fault(&parameter.show(value), error));
            values.iter().try_for_each(check)
        };
        match read() {
            Ok(()) => Ok(Self { argument, key: text.clone(), text, coordinate: None, values: Values::Listed(values) }),
            Err(fault) => Err(RangeError::Axis { argument, text, fault }),
        }
    }

    /// Checks the first and the last value, or every listed value, in `scene`.
    ///
    /// # Errors
    /// A value that the scene does not accept.
    pub(super) fn check(&self, scene: &Scene) -> Result<(), RangeError> {
        if self.coordinate.is_some() {
            return Ok(());
        }
        let last = self.count() - 1;
        let all = 0..if self.is_listed() { last } else { 1 };
        for i in all.chain([last]) {
            let mut trial = scene.clone();
            trial
                .set_value(&self.key, &self.value(i))
                .map_err(|error| self.error(RangeFault::Scene(Box::new(error))))?;
        }
        Ok(())
    }

    /// Key of the parameter, or name of the coordinate.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// The driven coordinate, if the axis varies one.
    pub fn coordinate(&self) -> Option<DrivenCoordinate> {
        self.coordinate
    }

    /// Error for an axis whose key is given twice.
    pub(super) fn duplicate_error(&self) -> RangeError {
        RangeError::DuplicateKey { argument: self.argument, key: self.key.clone() }
    }

    fn error(&self, fault: RangeFault) -> RangeError {
        RangeError::Axis { argument: self.argument, text: self.text.clone(), fault }
    }

    /// Number of values.
    pub fn count(&self) -> usize {
        match &self.values {
            Values::Spaced { count, .. } => *count,
            Values::Listed(values) => values.len(),
        }
    }

    /// Value `i` as a scene value.
    pub fn value(&self, i: usize) -> Value {
        match &self.values {
            Values::Spaced { whole: true, .. } => Value::Count(self.number(i) as u64),
            Values::Spaced { .. } => Value::Number(self.number(i)),
            Values::Listed(values) => values[i].clone(),
        }
    }

    /// Value `i`, SI; NaN for a word.
    pub fn number(&self, i: usize) -> f64 {
        self.values.number(i)
    }

    /// All values in order, SI; NaN for words.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.count()).map(|i| self.number(i))
    }

    /// The words of a parameter whose values are words; `None` if they are numbers.
    pub fn words(&self) -> Option<Vec<&'static str>> {
        let Values::Listed(values) = &self.values else {
            return None;
        };
        let word = |value: &Value| if let Value::Choice(word) = value { Some(*word) } else { None };
        values.iter().map(word).collect()
    }

    /// Spacing of the values: `linear`, `log` or `list`.
    pub fn spacing(&self) -> &'static str {
        match &self.values {
            Values::Spaced { spacing: Spacing::Linear, .. } => "linear",
            Values::Spaced { spacing: Spacing::Geometric, .. } => "log",
            Values::Listed(_) => "list",
        }
    }

    /// Whether the values are listed, not spaced.
    pub fn is_listed(&self) -> bool {
        matches!(self.values, Values::Listed(_))
    }

    /// Whether the values are numbers in ascending order.
    pub(super) fn is_ascending(&self) -> bool {
        let ordered = (1..self.count()).all(|i| self.number(i - 1) < self.number(i));
        ordered && !self.number(0).is_nan()
    }

    /// Whether a change along the axis takes effect only at a reset of `scene`.
    pub(super) fn waits_for_restart(&self, scene: &Scene) -> bool {
        let at = |i| {
            let mut scene = scene.clone();
            let parameter = scene.set_value(&self.key, &self.value(i)).ok()?;
            Some((parameter.at_reset, scene))
        };
        let ends = at(0).zip(at(self.count() - 1));
        ends.is_some_and(|((waits, first), (_, last))| {
            waits && !first.machine.differs_only_in_conditions(&last.machine)
        })
    }

    /// Error for an axis with words where numbers are needed.
    pub(super) fn not_numbers(&self, scene: &Scene) -> RangeError {
        self.error(not_a_number_fault(scene, &self.key))
    }
}

fn value_fault(value: &str, error: ValueError) -> RangeFault {
    RangeFault::Value { value: value.trim().to_owned(), error }
}

fn not_a_number_fault(scene: &Scene, key: &str) -> RangeFault {
    let example = scene.parameter(key).map(|parameter| parameter.range().replace(", ", ",")).unwrap_or_default();
    RangeFault::Words { key: key.to_owned(), example }
}

/// Last value, number of values and spacing from `rest`, the part of a range after `..`: `B:N` or `B:N:log`.
fn parse_range(rest: &str) -> Result<(&str, &str, Spacing), RangeFault> {
    let parts: Vec<&str> = rest.split(':').map(str::trim).collect();
    match parts[..] {
        [last, count] => Ok((last, count, Spacing::Linear)),
        [last, count, "log"] => Ok((last, count, Spacing::Geometric)),
        _ => Err(RangeFault::Form),
    }
}

/// Values of the range of `key` that begins with `first` and continues as parsed by [`parse_range`].
fn spaced_values(
    scene: &Scene,
    subject: &Subject,
    key: &str,
    first: &str,
    (last, count, spacing): (&str, &str, Spacing),
) -> Result<Values, RangeFault> {
    let empty = |what: String| Err(RangeFault::Empty { what });
    let count: usize = count.parse().map_err(|_| RangeFault::Form)?;
    if count == 0 {
        return empty("0 values".to_owned());
    }
    let read = |end: &str| subject.read(end).map_err(|error| value_fault(end, error));
    if subject.has_words() {
        return Err(not_a_number_fault(scene, key));
    }
    let (from, to, whole) = match (read(first)?, read(last)?) {
        (Value::Number(from), Value::Number(to)) => (from, to, false),
        (Value::Count(from), Value::Count(to)) => (from as f64, to as f64, true),
        _ => return Err(not_a_number_fault(scene, key)),
    };
    if from > to {
        return Err(RangeFault::Reversed { from: first.to_owned(), to: last.to_owned() });
    }
    if (from == to) != (count == 1) {
        return empty(if count == 1 {
            "1 value between two different ends; give both ends the same value, or more values".to_owned()
        } else {
            format!("both ends are {first}, so there is 1 value and not {count}")
        });
    }
    if spacing == Spacing::Geometric && from <= 0.0 {
        return Err(RangeFault::NotPositive);
    }
    let values = Values::Spaced { spacing, from, to, count, whole };
    if whole && (0..count).any(|i| values.number(i).fract() != 0.0) {
        return Err(RangeFault::NotWhole { key: key.to_owned(), from: from as u64, to: to as u64, count });
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(text: &str) -> Result<Axis, RangeError> {
        Axis::parse(&Scene::load("spcmm", &[]).expect("built in"), text)
    }

    #[test]
    fn values_are_linear_with_both_ends() {
        let clearance = axis("contact.clearance=0.01mm..1mm:200").expect("a range");
        assert_eq!(clearance.count(), 200);
        assert_eq!((clearance.number(0), clearance.number(199)), (1e-5, 1e-3));
        let steps: Vec<f64> = clearance.numbers().collect();
        for pair in steps.windows(2) {
            assert!((pair[1] - pair[0] - 0.99e-3 / 199.0).abs() < 1e-15);
        }
        assert_eq!(axis("contact.friction=0.2..0.2:1").map(|axis| axis.number(0)), Ok(0.2));
    }

    #[test]
    fn logarithmic_values_have_one_ratio_and_both_ends() {
        let clearance = axis("contact.clearance=0.01mm..1mm:5:log").expect("a range");
        assert_eq!((clearance.number(0), clearance.number(4)), (1e-5, 1e-3));
        let steps: Vec<f64> = clearance.numbers().collect();
        for pair in steps.windows(2) {
            assert!((pair[1] / pair[0] / 10_f64.sqrt() - 1.0).abs() < 1e-14, "{steps:?}");
        }
        let chain = Scene::load("chain", &[]).expect("built in");
        let links = Axis::parse(&chain, "chain.links=2..16:4:log").expect("whole powers of two");
        assert_eq!((0..4).map(|i| links.value(i)).collect::<Vec<_>>(), [2, 4, 8, 16].map(Value::Count));
    }

    #[test]
    fn lists_hold_numbers_with_units_or_words() {
        let clearance = axis("contact.clearance=0.5mm, 20um,1mm").expect("a list");
        assert_eq!(clearance.numbers().collect::<Vec<_>>(), [5e-4, 20e-6, 1e-3]);
        assert_eq!((clearance.words(), clearance.is_ascending()), (None, false));
        let one = axis("contact.clearance=0.5mm").expect("one value");
        assert_eq!(one.numbers().collect::<Vec<_>>(), [5e-4]);
        let law = axis("contact.normal_law=hertz,flores").expect("two laws");
        assert_eq!(law.words(), Some(vec!["hertz", "flores"]));
        assert_eq!(law.value(1), Value::Choice("flores"));
        assert!(law.number(0).is_nan() && !law.is_ascending());
    }

    #[test]
    fn errors_of_invalid_ranges_state_the_reason() {
        for (text, fragment) in [
            ("contact.clearance", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm..1mm", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm..1mm:x", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm..1mm:5:cubic", "expected KEY=A..B:N"),
            ("contact.clearance=", "is not a number"),
            ("contact.clearance=0.1mm..1mm:0", "empty: 0 values"),
            ("contact.clearance=1mm..0.1mm:5", "reversed"),
            ("contact.clearance=1mm..1mm:5", "empty: both ends"),
            ("contact.clearance=0.1mm..1mm:1", "empty: 1 value"),
            ("contact.clearance=0.1..1mm:5", "0.1: needs a unit"),
            ("contact.clearance=0.1mm,1", "1: needs a unit"),
            ("contact.friction=0..1:5:log", "must be above 0"),
            ("contact.clearence=0.1mm..1mm:5", "did you mean `contact.clearance`?"),
            ("contact.normal_law=hertz..flores:2", "list its values"),
            ("contact.normal_law=hertz,floers", "did you mean `flores`?"),
            ("chain.links=2..4:3", "unknown key"),
            ("contact.friction=-1..1:3", "-1: out of range"),
        ] {
            let error = axis(text).expect_err(text).to_string();
            assert!(error.contains(fragment), "{text}: {error}");
            assert!(error.starts_with("--vary"), "{error}");
        }
        let chain = Scene::load("chain", &[]).expect("built in");
        let links = Axis::parse(&chain, "chain.links=2..6:3").expect("whole numbers");
        assert_eq!(links.value(1), Value::Count(4));
        let error = Axis::parse(&chain, "chain.links=2..6:4");
        assert!(matches!(error, Err(RangeError::Axis { fault: RangeFault::NotWhole { .. }, .. })));
    }
}
