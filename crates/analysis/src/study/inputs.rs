//! The uncertain parameters of a study.

use super::StudyError;
use crate::distribution::Distribution;
use crate::iso286::{Fit, FitError};
use jointplay_physics::simulate::matches_pattern;
use jointplay_physics::suggest::nearest;
use jointplay_physics::units::{QuantityError, parse_quantity, si_unit};
use jointplay_scene::{Kind, Parameter, Scene, SceneError, Value, ValueError, ValueFault, contact_parts};

/// Range of an input without one of its own, over its value in the scene.
const DEFAULT_RANGE: [f64; 2] = [0.5, 1.5];
/// Largest number of inputs.
const MAX_INPUTS: usize = 64;
/// Process capability of hole and shaft of a fit.
const CAPABILITY: f64 = 1.0;

/// Parameters with a distribution, as requested.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Uncertainty {
    /// Option, or file with line, for messages.
    pub place: String,
    /// A key, or a pattern that stands for all numeric parameters that it matches.
    pub pattern: String,
    /// The distribution, as written; `None`: uniform, from half to one and a half of the value, within what is allowed.
    pub distribution: Option<String>,
}

/// A parameter with its distribution.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Key.
    pub key: String,
    /// Unit in which it is shown.
    pub unit: &'static str,
    /// SI unit.
    pub si_unit: &'static str,
    /// Value in the scene, SI.
    pub nominal: f64,
    /// Distribution, SI.
    pub distribution: Distribution,
    /// Whether it was given; else it is uniform, from half to one and a half of the value, within what is allowed.
    pub is_given: bool,
}

impl Uncertainty {
    /// Reads `PATTERN[=DISTRIBUTION]`; `option` is what the user wrote it for.
    pub fn parse(option: &str, text: &str) -> Self {
        let (pattern, distribution) = match text.split_once('=') {
            Some((pattern, distribution)) => (pattern, Some(distribution.trim().to_owned())),
            None => (text, None),
        };
        Self { place: format!("{option} {text}"), pattern: pattern.trim().to_owned(), distribution }
    }
}

/// The parameters of all `requested`, in order. Of a parameter that is requested twice, the later distribution counts.
///
/// # Errors
/// With its place: no such parameter, or a distribution that one does not accept. More than 64 parameters.
pub fn inputs(scene: &Scene, requested: &[Uncertainty]) -> Result<Vec<Input>, StudyError> {
    let mut inputs: Vec<Input> = Vec::new();
    for Uncertainty { place, pattern, distribution } in requested {
        for key in matching(scene, pattern).map_err(|error| error.at(place))? {
            let input = Input::new(scene, &key, distribution.as_deref());
            let input = input.map_err(|error| error.at(&key).at(place))?;
            match inputs.iter_mut().find(|known| known.key == key) {
                // A later one refines an earlier pattern.
                Some(known) => *known = input,
                None => inputs.push(input),
            }
        }
    }
    check_count(inputs.len())?;
    Ok(inputs)
}

/// Requires no more inputs than a study varies.
pub(super) fn check_count(found: usize) -> Result<(), StudyError> {
    if found > MAX_INPUTS { Err(StudyError::TooMany { found, most: MAX_INPUTS }) } else { Ok(()) }
}

/// Row and value, SI, of the real parameter `key`.
pub(super) fn real_parameter(scene: &Scene, key: &str) -> Result<(&'static Parameter, f64), StudyError> {
    let parameter = scene.parameter(key)?;
    match scene.get(key)? {
        Value::Number(nominal) => Ok((parameter, nominal)),
        Value::Count(_) | Value::Choice(_) | Value::Unset => Err(StudyError::NotReal),
    }
}

/// Requires an end, SI, that the parameter accepts.
pub(super) fn check_end(parameter: &Parameter, end: f64) -> Result<(), StudyError> {
    let value = Value::Number(end);
    parameter.check(&value).map_err(|error| StudyError::End { value: parameter.show(&value), error })
}

/// Requires an end, SI, that `scene` accepts with its other values: such as a moment of inertia that a body can have.
fn try_end(scene: &Scene, key: &str, parameter: &Parameter, end: f64) -> Result<(), StudyError> {
    let value = Value::Number(end);
    let refused = |error: SceneError| StudyError::NoEnd { value: parameter.show(&value), why: error.message };
    scene.clone().set_value(key, &value).map(|_| ()).map_err(refused)
}

/// Keys of the numeric parameters that match `pattern`, or, where there are none, of the numbers of the file; at least one.
///
/// # Errors
/// There are none.
pub fn matching(scene: &Scene, pattern: &str) -> Result<Vec<String>, StudyError> {
    let parameters = keys(scene);
    let numbers = || scene.source.numbers.keys().cloned();
    let matches = |key: &String| matches_pattern(pattern, key);
    let mut found: Vec<String> = parameters.iter().filter(|key| matches(key)).cloned().collect();
    if found.is_empty() {
        found.extend(numbers().filter(matches));
    }
    if found.is_empty() {
        if !pattern.contains(['*', '?']) {
            scene.parameter(pattern)?;
        }
        let of_all_joints = contact_parts().map(|part| format!("joint.*.{part}"));
        let known: Vec<String> = of_all_joints.chain(parameters).chain(numbers()).collect();
        let nearest = nearest(pattern, known.iter().map(String::as_str));
        return Err(StudyError::NoMatch { pattern: pattern.to_owned(), nearest });
    }
    Ok(found)
}

impl Input {
    /// Parameter `key` of `scene` with the distribution `text`.
    ///
    /// # Errors
    /// An unknown key, a word in place of a number, or a distribution that the parameter does not accept.
    pub fn new(scene: &Scene, key: &str, text: Option<&str>) -> Result<Self, StudyError> {
        let (parameter, nominal) = real_parameter(scene, key)?;
        let number = |text: &str| match parameter.read(text) {
            Ok(Value::Number(value)) => Ok(value),
            Ok(Value::Count(_) | Value::Choice(_) | Value::Unset) => Err(StudyError::NotReal),
            Err(error) => Err(StudyError::End { value: text.to_owned(), error }),
        };
        let distribution = match text {
            None => {
                let allowed = |value: f64| match parameter.kind {
                    Kind::Number { min, max, .. } => value.clamp(min, max),
                    _ => value,
                };
                let [low, high] = DEFAULT_RANGE.map(|part| allowed(part * nominal));
                if low == high {
                    return Err(StudyError::NoRange { value: parameter.show(&Value::Number(nominal)) });
                }
                Distribution::uniform(low.min(high), low.max(high))
            }
            Some(text) => match text.split_once("..").filter(|_| !text.contains('(')) {
                Some((low, high)) => Distribution::uniform(number(low.trim())?, number(high.trim())?),
                None => Distribution::parse(
                    text,
                    |text| unlimited(parameter, text).map_err(|error| error.to_string()),
                    |fit| of_fit(scene, key, fit),
                ),
            },
        }?;
        let (low, high) = distribution.support();
        // Of a distribution without limits, its middle.
        for end in [low, high, distribution.quantile(0.5)].into_iter().filter(|end| end.is_finite()) {
            check_end(parameter, end)?;
            if text.is_some() {
                try_end(scene, key, parameter, end)?;
            }
        }
        let si_unit = match parameter.kind {
            Kind::Number { dimension, .. } => si_unit(dimension),
            _ => "",
        };
        Ok(Self {
            key: key.to_owned(),
            unit: parameter.display_unit(),
            si_unit,
            nominal,
            distribution,
            is_given: text.is_some(),
        })
    }

    /// The range, SI, that was assumed because none was given.
    pub fn assumed_range(&self) -> Option<(f64, f64)> {
        (!self.is_given).then(|| self.distribution.support())
    }

    /// Its value at the fraction `u` of all values, 0 < u < 1.
    pub fn at(&self, u: f64) -> f64 {
        self.distribution.quantile(u)
    }
}

/// A number in the unit of `parameter`, SI, within its range or not: a standard deviation has another range than its mean.
fn unlimited(parameter: &Parameter, text: &str) -> Result<f64, StudyError> {
    match (parameter.read(text), parameter.kind) {
        (Ok(Value::Number(value)), _) => Ok(value),
        (Err(ValueError { fault: ValueFault::OutOfRange, .. }), Kind::Number { dimension, .. }) => {
            let fault = |error: QuantityError| ValueError { fault: error.into(), allowed: parameter.allowed() };
            Ok(parse_quantity(text.trim(), dimension).map_err(fault)?)
        }
        (Err(error), _) => Err(error.into()),
        (Ok(Value::Count(_) | Value::Choice(_) | Value::Unset), _) => Err(StudyError::NotReal),
    }
}

/// The clearance of a ball joint under a fit at the diameter of its ball.
fn of_fit(scene: &Scene, key: &str, fit: &str) -> Result<Distribution, String> {
    let joint = key.strip_prefix("joint.").and_then(|rest| rest.strip_suffix(".clearance"));
    let joints = scene.machine.ball_joints.iter();
    let own = joints.clone().find(|ball| Some(ball.name.as_str()) == joint).map(|ball| ball.contact.ball_radius);
    let radius = own.or((key == "contact.clearance").then_some(scene.machine.contact.ball_radius));
    let radius = radius.ok_or_else(|| format!("{fit}: a fit gives a clearance, and {key} is none"))?;
    let fit: Fit = fit.parse().map_err(|error: FitError| error.to_string())?;
    fit.radial_clearance(2.0 * radius, CAPABILITY).map_err(|error| error.to_string())
}

/// Keys of the real numbers of a scene: its own, then those of each ball joint.
fn keys(scene: &Scene) -> Vec<String> {
    let own = scene.parameters().into_iter();
    let own = own.filter(|parameter| matches!(parameter.kind, Kind::Number { .. })).map(|p| p.key.to_owned());
    let joints = scene.machine.ball_joints.iter();
    let of_joints = joints.flat_map(|joint| contact_parts().map(move |part| format!("joint.{}.{part}", joint.name)));
    let all = own.chain(of_joints);
    all.filter(|key| matches!(scene.get(key), Ok(Value::Number(_)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_that_nobody_gave_is_one_that_the_parameter_allows() {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        let ends = |key: &str| Input::new(&scene, key, None).expect("a range").assumed_range();
        assert_eq!(ends("contact.restitution"), Some((0.45, 1.0)));
        let nominal = scene.machine.ball_joints[0].contact.clearance;
        assert_eq!(ends("joint.A.clearance"), Some((0.5 * nominal, 1.5 * nominal)));
        let given = Input::new(&scene, "contact.restitution", Some("0.45..1")).expect("a range");
        assert_eq!(given.assumed_range(), None);
    }

    #[test]
    fn a_value_of_nothing_has_no_range_by_default() {
        let changes = [("contact.clearance".to_owned(), "0mm".to_owned())];
        let scene = Scene::load("four-bar", &changes).expect("built in");
        let said = Input::new(&scene, "contact.clearance", None).expect_err("no range").to_string();
        assert_eq!(said, "is 0 mm in the scene, and half to one and a half of that is no range: give one, KEY=A..B");
        assert!(Input::new(&scene, "contact.clearance", Some("0mm..0.1mm")).is_ok());
    }

    #[test]
    fn a_deviation_may_be_smaller_than_every_value_of_its_parameter() {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        // A ball has a radius of at least 0.1 mm.
        let of = |text: &str| Input::new(&scene, "contact.ball_radius", Some(text));
        let ball = of("normal(10 mm, 20 um)").expect("a distribution");
        assert!((ball.at(0.841_344_746_068_543) - 10.02e-3).abs() < 1e-12, "{}", ball.at(0.841_344_746_068_543));
        for (text, expected) in [
            ("normal(10 mm, -20 um)", "standard deviation of a normal distribution must be above 0"),
            ("normal(10 um, 20 um)", "0.01 mm: out of range; allowed 0.1 mm to 1000 mm"),
            ("normal(1 mm, 20 um, 10 um..2 mm)", "0.01 mm: out of range; allowed 0.1 mm to 1000 mm"),
            ("triangular(10 um, 1 mm, 2 mm)", "0.01 mm: out of range; allowed 0.1 mm to 1000 mm"),
            ("normal(10 mm, 20 s)", "unit"),
        ] {
            let said = of(text).expect_err(text).to_string();
            assert!(said.contains(expected), "{text}: {said}");
        }
    }

    #[test]
    fn an_end_that_a_number_of_the_file_does_not_allow_is_refused() {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        let mass = "out of range; allowed above 0 up to 1e9 kg; units kg, g, mg, t";
        for (key, text, expected) in [
            ("body.coupler.mass", "-1 kg..2 kg", format!("-1 kg: {mass}")),
            ("body.coupler.mass", "0 g..2 kg", format!("0 g: {mass}")),
            ("body.coupler.mass", "1 kg..2e9 kg", format!("2e9 kg: {mass}")),
            ("body.coupler.mass", "normal(-1 kg, 1 g)", format!("-1 kg: {mass}")),
            ("body.coupler.mass", "normal(1 kg, 1 kg, -1 kg..2 kg)", format!("-1 kg: {mass}")),
            ("body.coupler.inertia.x", "-1 kg m^2..1 kg m^2", "-1 kg m^2: no body has this inertia".to_owned()),
            ("contact.clearance", "0 mm..10 mm", "10 mm: clearance 10 mm must be below the ball radius".to_owned()),
        ] {
            let said = Input::new(&scene, key, Some(text)).expect_err(text).to_string();
            assert!(said.starts_with(&expected), "{key}={text}: {said}");
        }
        assert!(Input::new(&scene, "body.coupler.mass", Some("1 g..2 kg")).is_ok());
    }

    #[test]
    fn a_pattern_finds_parameters_then_numbers_of_the_file() {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        let found = |pattern: &str| matching(&scene, pattern).map_err(|error| error.to_string());
        assert_eq!(found("joint.A.clearance"), Ok(vec!["joint.A.clearance".to_owned()]));
        let masses = found("body.*.mass").expect("masses");
        assert!(masses.len() > 1 && masses.iter().all(|key| scene.source.numbers.contains_key(key)), "{masses:?}");
        assert_eq!(found(&masses[0]), Ok(vec![masses[0].clone()]));
        assert_eq!(
            found("joint.*.clearence"),
            Err("no number of the scene matches joint.*.clearence (did you mean `joint.*.clearance`?)".to_owned())
        );
    }
}
