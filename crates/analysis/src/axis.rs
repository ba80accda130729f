//! The values of one varied parameter: equally or geometrically spaced, or listed.

use jointplay_physics::units::{Dimension, parse_quantity};
use jointplay_scene::{Kind, Parameter, Scene, SceneError, Value, ValueError};

/// Option of a sweep, and of a map over the workspace.
const VARY: &str = "--vary";
const OVER: &str = "--over";

/// Largest relative distance of a geometrically spaced value from a whole number that counts as rounding.
const ROUNDING: f64 = 1e-9;

/// Why a range is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RangeError {
    /// Malformed.
    #[error("{text}: expected KEY=A..B:N, KEY=A..B:N:log or KEY=V1,V2,…, e.g. contact.clearance=0.01mm..1mm:200")]
    Form {
        /// As written.
        text: String,
    },
    /// An unknown key, or a value that the scene does not accept.
    #[error("{text}: {error}")]
    Scene {
        /// As written.
        text: String,
        /// What is wrong.
        error: Box<SceneError>,
    },
    /// Neither a parameter nor a driven coordinate.
    #[error("{text}: {error}; {}", driven(.coordinates))]
    NoSubject {
        /// As written.
        text: String,
        /// What is wrong.
        error: Box<SceneError>,
        /// Names of the driven coordinates.
        coordinates: Vec<String>,
    },
    /// Not a value of the parameter.
    #[error("{text}: {value}: {error}")]
    Value {
        /// As written.
        text: String,
        /// The value at fault.
        value: String,
        /// What is wrong and what is allowed.
        error: ValueError,
    },
    /// A range of a parameter whose values are words.
    #[error("{text}: {key} is not a number; list its values, as in {key}={example}")]
    Words {
        /// As written.
        text: String,
        /// Key.
        key: String,
        /// Its allowed words.
        example: String,
    },
    /// A whole-number parameter whose spaced values are not whole.
    #[error("{text}: {key} takes whole numbers, which {count} spaced values from {from} to {to} are not")]
    NotWhole {
        /// As written.
        text: String,
        /// Key.
        key: String,
        /// First value.
        from: u64,
        /// Last value.
        to: u64,
        /// Number of values.
        count: usize,
    },
    /// Geometric spacing from or to a number that is not positive.
    #[error("{text}: both ends of a logarithmic range must be above 0")]
    NotPositive {
        /// As written.
        text: String,
    },
    /// No points.
    #[error("{text}: the range is empty: {what}")]
    Empty {
        /// As written.
        text: String,
        /// Why.
        what: String,
    },
    /// The last value is below the first.
    #[error(
        "{text}: the range is reversed: its first end is above its second; write {to}..{from} (--start \
         follow-down runs through it downwards)"
    )]
    Reversed {
        /// As written.
        text: String,
        /// First end as written.
        from: String,
        /// Second end as written.
        to: String,
    },
    /// Axes that do not fit together, or not with the starts.
    #[error("{0}")]
    Together(String),
}

fn driven(coordinates: &[String]) -> String {
    if coordinates.is_empty() {
        return "the scene has no driven coordinate".to_owned();
    }
    format!("driven coordinates: {}", coordinates.join(", "))
}

/// A driven coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinate {
    /// Index in the order of [`Machine::driven`](jointplay_physics::machine::Machine::driven).
    pub index: usize,
    /// Length or angle.
    pub dimension: Dimension,
}

/// What an axis varies.
enum Subject {
    Parameter(&'static Parameter),
    Coordinate(Coordinate),
}

impl Subject {
    /// The subject called `key` of an axis written as `text`.
    fn find(scene: &Scene, option: &str, text: &str, key: &str) -> Result<Self, RangeError> {
        let error = match scene.parameter(key) {
            Ok(parameter) => return Ok(Self::Parameter(parameter)),
            Err(error) => error,
        };
        if option != OVER {
            return Err(of_scene(text, error));
        }
        let names = scene.machine.driven().map(|(joint, freedom)| {
            let dimension = if freedom.turns() { Dimension::Angle } else { Dimension::Length };
            (format!("{}.{}", joint.name, freedom.word()), dimension)
        });
        let names: Vec<(String, Dimension)> = names.collect();
        match names.iter().position(|(name, _)| name == key) {
            Some(index) => Ok(Self::Coordinate(Coordinate { index, dimension: names[index].1 })),
            None => {
                let coordinates = names.into_iter().map(|(name, _)| name).collect();
                Err(RangeError::NoSubject { text: text.to_owned(), error: Box::new(error), coordinates })
            }
        }
    }

    fn coordinate(&self) -> Option<Coordinate> {
        match self {
            Self::Parameter(_) => None,
            Self::Coordinate(coordinate) => Some(*coordinate),
        }
    }

    fn read(&self, value: &str) -> Result<Value, ValueError> {
        match self {
            Self::Parameter(parameter) => parameter.read(value),
            Self::Coordinate(coordinate) => {
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
    /// SI; `whole` for counts.
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
    option: &'static str,
    key: String,
    /// As written, with the option, for error messages.
    text: String,
    coordinate: Option<Coordinate>,
    values: Values,
}

impl Axis {
    /// Parses `KEY=A..B:N`, `KEY=A..B:N:log` or `KEY=V1,V2,…` for `scene`.
    ///
    /// # Errors
    /// An unknown key, a malformed or empty range, or a value that the parameter does not accept.
    pub fn parse(scene: &Scene, text: &str) -> Result<Self, RangeError> {
        Self::of_option(VARY, scene, text)
    }

    /// The same; KEY may also be a driven coordinate by the name of its channel, such as `crank.angle` or `slider.position`.
    ///
    /// # Errors
    /// The same.
    pub fn parse_over(scene: &Scene, text: &str) -> Result<Self, RangeError> {
        Self::of_option(OVER, scene, text)
    }

    fn of_option(option: &'static str, scene: &Scene, written: &str) -> Result<Self, RangeError> {
        let text = &format!("{option} {written}");
        let form = || RangeError::Form { text: text.to_owned() };
        let (key, values) = written.split_once('=').ok_or_else(form)?;
        let (key, values) = (key.trim(), values.trim());
        let (subject, values) = if let Some((from, rest)) = values.split_once("..") {
            let range = parts(text, rest)?;
            let subject = Subject::find(scene, option, text, key)?;
            let values = spaced(scene, &subject, text, key, from.trim(), range)?;
            (subject, values)
        } else {
            let subject = Subject::find(scene, option, text, key)?;
            if !values.contains(',') {
                return Err(form());
            }
            let listed =
                values.split(',').map(|value| subject.read(value).map_err(|error| of_value(text, value, error)));
            let listed = Values::Listed(listed.collect::<Result<_, _>>()?);
            (subject, listed)
        };
        let coordinate = subject.coordinate();
        Ok(Self { option, key: key.to_owned(), text: text.to_owned(), coordinate, values })
    }

    /// A parameter with listed values.
    ///
    /// # Errors
    /// An unknown key, no values, or a value that the parameter does not accept.
    pub fn listed(scene: &Scene, key: &str, values: Vec<Value>) -> Result<Self, RangeError> {
        let text = format!("{VARY} {key}");
        let parameter = scene.parameter(key).map_err(|error| of_scene(&text, error))?;
        if values.is_empty() {
            return Err(RangeError::Empty { text, what: "0 values".to_owned() });
        }
        for value in &values {
            parameter.check(value).map_err(|error| of_value(&text, &parameter.show(value), error))?;
        }
        Ok(Self { option: VARY, key: key.to_owned(), text, coordinate: None, values: Values::Listed(values) })
    }

    /// Tries the first and the last value, or every listed one, in `scene`.
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
            trial.set_value(&self.key, &self.value(i)).map_err(|error| of_scene(&self.text, error))?;
        }
        Ok(())
    }

    /// Key of the parameter, or name of the coordinate.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// The driven coordinate, if it varies one.
    pub fn coordinate(&self) -> Option<Coordinate> {
        self.coordinate
    }

    /// The option that gave it.
    pub(super) fn option(&self) -> &'static str {
        self.option
    }

    /// Number of values.
    pub fn count(&self) -> usize {
        match &self.values {
            Values::Spaced { count, .. } => *count,
            Values::Listed(values) => values.len(),
        }
    }

    /// Value `i` in the form that the scene accepts.
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

    /// The words of a parameter without numbers; `None` for one with numbers.
    pub fn words(&self) -> Option<Vec<&'static str>> {
        let Values::Listed(values) = &self.values else {
            return None;
        };
        let word = |value: &Value| if let Value::Choice(word) = value { Some(*word) } else { None };
        values.iter().map(word).collect()
    }

    /// How the values are given: `linear`, `log` or `list`.
    pub fn spacing(&self) -> &'static str {
        match &self.values {
            Values::Spaced { spacing: Spacing::Linear, .. } => "linear",
            Values::Spaced { spacing: Spacing::Geometric, .. } => "log",
            Values::Listed(_) => "list",
        }
    }

    /// Whether its values are listed and not spaced.
    pub fn is_listed(&self) -> bool {
        matches!(self.values, Values::Listed(_))
    }

    /// Whether its values are numbers in ascending order.
    pub(super) fn is_ascending(&self) -> bool {
        let ordered = (1..self.count()).all(|i| self.number(i - 1) < self.number(i));
        ordered && !self.number(0).is_nan()
    }

    /// Whether its values take effect only at a reset of `scene`.
    pub(super) fn waits(&self, scene: &Scene) -> bool {
        let at = |i| {
            let mut scene = scene.clone();
            let parameter = scene.set_value(&self.key, &self.value(i)).ok()?;
            Some((parameter.at_reset, scene))
        };
        let ends = at(0).zip(at(self.count() - 1));
        ends.is_some_and(|((waits, first), (_, last))| {
            waits && !first.machine.differs_in_conditions_alone(&last.machine)
        })
    }

    /// Error of an axis with words where numbers are needed.
    pub(super) fn not_numbers(&self, scene: &Scene) -> RangeError {
        no_numbers(scene, &self.text, &self.key)
    }
}

fn of_scene(text: &str, error: SceneError) -> RangeError {
    RangeError::Scene { text: text.to_owned(), error: Box::new(error) }
}

fn of_value(text: &str, value: &str, error: ValueError) -> RangeError {
    RangeError::Value { text: text.to_owned(), value: value.trim().to_owned(), error }
}

fn no_numbers(scene: &Scene, text: &str, key: &str) -> RangeError {
    let example = scene.parameter(key).map(|parameter| parameter.range().replace(", ", ",")).unwrap_or_default();
    RangeError::Words { text: text.to_owned(), key: key.to_owned(), example }
}

/// Last value, number of values and spacing of a range that continues with `rest`: `B:N` or `B:N:log`.
fn parts<'a>(text: &str, rest: &'a str) -> Result<(&'a str, &'a str, Spacing), RangeError> {
    let parts: Vec<&str> = rest.split(':').map(str::trim).collect();
    match parts[..] {
        [last, count] => Ok((last, count, Spacing::Linear)),
        [last, count, "log"] => Ok((last, count, Spacing::Geometric)),
        _ => Err(RangeError::Form { text: text.to_owned() }),
    }
}

/// Reads the range of `key` that begins with `first` and continues with `rest`, from [`parts`].
fn spaced(
    scene: &Scene,
    subject: &Subject,
    text: &str,
    key: &str,
    first: &str,
    (last, count, spacing): (&str, &str, Spacing),
) -> Result<Values, RangeError> {
    let own = || text.to_owned();
    let form = || RangeError::Form { text: own() };
    let empty = |what: String| Err(RangeError::Empty { text: own(), what });
    let count: usize = count.parse().map_err(|_| form())?;
    if count == 0 {
        return empty("0 values".to_owned());
    }
    let read = |end: &str| subject.read(end).map_err(|error| of_value(text, end, error));
    if subject.has_words() {
        return Err(no_numbers(scene, text, key));
    }
    let (from, to, whole) = match (read(first)?, read(last)?) {
        (Value::Number(from), Value::Number(to)) => (from, to, false),
        (Value::Count(from), Value::Count(to)) => (from as f64, to as f64, true),
        _ => return Err(no_numbers(scene, text, key)),
    };
    if from > to {
        return Err(RangeError::Reversed { text: own(), from: first.to_owned(), to: last.to_owned() });
    }
    if (from == to) != (count == 1) {
        return empty(if count == 1 {
            "1 value between two different ends; give both ends the same value, or more values".to_owned()
        } else {
            format!("both ends are {first}, so there is 1 value and not {count}")
        });
    }
    if spacing == Spacing::Geometric && from <= 0.0 {
        return Err(RangeError::NotPositive { text: own() });
    }
    let values = Values::Spaced { spacing, from, to, count, whole };
    if whole && (0..count).any(|i| values.number(i).fract() != 0.0) {
        return Err(RangeError::NotWhole { text: own(), key: key.to_owned(), from: from as u64, to: to as u64, count });
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
        let law = axis("contact.normal_law=hertz,flores").expect("two laws");
        assert_eq!(law.words(), Some(vec!["hertz", "flores"]));
        assert_eq!(law.value(1), Value::Choice("flores"));
        assert!(law.number(0).is_nan() && !law.is_ascending());
    }

    #[test]
    fn ranges_that_are_none_say_why() {
        for (text, fragment) in [
            ("contact.clearance", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm..1mm", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm..1mm:x", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm..1mm:5:cubic", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm", "expected KEY=A..B:N"),
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
        assert!(matches!(Axis::parse(&chain, "chain.links=2..6:4"), Err(RangeError::NotWhole { .. })));
    }
}
