//! The uncertain parameters of a study.

use super::StudyError;
use crate::distribution::Distribution;
use crate::iso286::{Fit, FitError};
use jointplay_physics::simulate::matches_pattern;
use jointplay_physics::suggest::nearest;
use jointplay_physics::units::{QuantityError, parse_quantity, si_unit};
use jointplay_scene::{Kind, Parameter, Scene, SceneError, Value, ValueError, ValueFault, contact_parts};

/// Default range of an input, as multiples of its value in the scene.
const DEFAULT_RANGE: [f64; 2] = [0.5, 1.5];
/// Largest number of inputs.
const MAX_INPUTS: usize = 64;
/// Assumed process capability of the hole and the shaft of a fit.
const CAPABILITY: f64 = 1.0;

/// A request to vary one or several parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Uncertainty {
    /// Option, or file with line, for messages.
    pub place: String,
    /// A key, or a pattern for all numeric parameters that it matches.
    pub pattern: String,
    /// The distribution as given; `None` for a uniform one from half to one and a half times the value, within the allowed
    /// range.
    pub distribution: Option<String>,
}

/// A parameter with its distribution.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Key of the parameter.
    pub key: String,
    /// Display unit.
    pub unit: &'static str,
    /// SI unit.
    pub si_unit: &'static str,
    /// Value in the scene, SI.
    pub nominal: f64,
    /// Distribution, SI.
    pub distribution: Distribution,
    /// Whether the distribution was given; otherwise it is uniform from half to one and a half times the value, within the
    /// allowed range.
    pub is_given: bool,
}

impl Uncertainty {
    /// Parses `PATTERN[=DISTRIBUTION]`; `option` is the command-line option it was given for.
    pub fn parse(option: &str, text: &str) -> Self {
        let (pattern, distribution) = match text.split_once('=') {
            Some((pattern, distribution)) => (pattern, Some(distribution.trim().to_owned())),
            None => (text, None),
        };
        Self { place: format!("{option} {text}"), pattern: pattern.trim().to_owned(), distribution }
    }
}

/// The parameters of all `requested`, in order. If a parameter is requested twice, the later distribution applies.
///
/// # Errors
/// With the place: no such parameter, or a distribution that a parameter does not accept. More than 64 parameters.
pub fn inputs(scene: &Scene, requested: &[Uncertainty]) -> Result<Vec<Input>, StudyError> {
    let mut inputs: Vec<Input> = Vec::new();
    for Uncertainty { place, pattern, distribution } in requested {
        for key in matching(scene, pattern).map_err(|error| error.at(place))? {
            let input = Input::new(scene, &key, distribution.as_deref());
            let input = input.map_err(|error| error.at(&key).at(place))?;
            match inputs.iter_mut().find(|known| known.key == key) {
                // A later request refines an earlier pattern.
                Some(known) => *known = input,
                None => inputs.push(input),
            }
        }
    }
    check_count(inputs.len())?;
    Ok(inputs)
}

/// Requires at most [`MAX_INPUTS`] inputs.
pub(super) fn check_count(found: usize) -> Result<(), StudyError> {
    if found > MAX_INPUTS { Err(StudyError::TooMany { found, most: MAX_INPUTS }) } else { Ok(()) }
}

/// Table row and SI value of the real-valued parameter `key`.
pub(super) fn real_parameter(scene: &Scene, key: &str) -> Result<(&'static Parameter, f64), StudyError> {
    let parameter = scene.parameter(key)?;
    match scene.get(key)? {
        Value::Number(nominal) => Ok((parameter, nominal)),
        Value::Count(_) | Value::Choice(_) | Value::Unset => Err(StudyError::NotReal),
    }
}

/// Requires that the parameter accepts `end`, SI.
pub(super) fn check_end(parameter: &Parameter, end: f64) -> Result<(), StudyError> {
    let value = Value::Number(end);
    parameter.check(&value).map_err(|error| StudyError::End { value: parameter.show(&value), error })
}

/// Requires that `scene` accepts `end`, SI, with its other values; for example, not every moment of inertia belongs to a body.
fn try_end(scene: &Scene, key: &str, parameter: &Parameter, end: f64) -> Result<(), StudyError> {
    let value = Value::Number(end);
    let rejected = |error: SceneError| StudyError::RejectedEnd { value: parameter.show(&value), why: error.message };
    scene.clone().set_value(key, &value).map(|_| ()).map_err(rejected)
}

/// Keys of the numeric parameters that match `pattern`, or of the matching numbers in the scene file if no parameter matches;
/// at least one.
///
/// # Errors
/// No match.
pub fn matching(scene: &Scene, pattern: &str) -> Result<Vec<String>, StudyError> {
    let parameters = real_keys(scene);
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
                    |text| parse_unchecked(parameter, text).map_err(|error| error.to_string()),
                    |fit| fit_distribution(scene, key, fit),
                ),
            },
        }?;
        let (low, high) = distribution.support();
        // A distribution without limits is checked at its median.
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

    /// The default range, SI, if no distribution was given.
    pub fn assumed_range(&self) -> Option<(f64, f64)> {
        (!self.is_given).then(|| self.distribution.support())
    }

    /// Quantile of the input at probability `u`, 0 < u < 1.
    pub fn at(&self, u: f64) -> f64 {
        self.distribution.quantile(u)
    }
}

/// Parses a number in a unit of `parameter`, SI, without its range check: a standard deviation may lie outside the range of the
/// parameter.
fn parse_unchecked(parameter: &Parameter, text: &str) -> Result<f64, StudyError> {
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

/// Distribution of the radial clearance of a ball joint with a fit, at the diameter of its ball.
fn fit_distribution(scene: &Scene, key: &str, fit: &str) -> Result<Distribution, String> {
    let joint = key.strip_prefix("joint.").and_then(|rest| rest.strip_suffix(".clearance"));
    let joints = scene.machine.ball_joints.iter();
    let own_radius = joints.clone().find(|ball| Some(ball.name.as_str()) == joint).map(|ball| ball.contact.ball_radius);
    let radius = own_radius.or((key == "contact.clearance").then_some(scene.machine.contact.ball_radius));
    let radius = radius.ok_or_else(|| format!("{fit}: a fit gives a clearance, and {key} is none"))?;
    let fit: Fit = fit.parse().map_err(|error: FitError| error.to_string())?;
    fit.radial_clearance(2.0 * radius, CAPABILITY).map_err(|error| error.to_string())
}

/// Keys of the real-valued parameters of a scene: first its own, then those of each ball joint.
fn real_keys(scene: &Scene) -> Vec<String> {
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
    fn a_default_range_is_clamped_to_the_allowed_range() {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        let ends = |key: &str| Input::new(&scene, key, None).expect("a range").assumed_range();
        assert_eq!(ends("contact.restitution"), Some((0.45, 1.0)));
        let nominal = scene.machine.ball_joints[0].contact.clearance;
        assert_eq!(ends("joint.A.clearance"), Some((0.5 * nominal, 1.5 * nominal)));
        let given = Input::new(&scene, "contact.restitution", Some("0.45..1")).expect("a range");
        assert_eq!(given.assumed_range(), None);
    }

    #[test]
    fn a_value_of_zero_has_no_default_range() {
        let changes = [("contact.clearance".to_owned(), "0mm".to_owned())];
        let scene = Scene::load("four-bar", &changes).expect("built in");
        let message = Input::new(&scene, "contact.clearance", None).expect_err("no range").to_string();
        assert_eq!(
            message,
            "is 0 mm in the scene, so the default range, 0.5 to 1.5 times this value, is empty: give a range, KEY=A..B"
        );
        assert!(Input::new(&scene, "contact.clearance", Some("0mm..0.1mm")).is_ok());
    }

    #[test]
    fn a_standard_deviation_may_lie_below_the_allowed_range_of_its_parameter() {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        // A ball has a radius of at least 0.1 mm.
        let radius = |text: &str| Input::new(&scene, "contact.ball_radius", Some(text));
        let ball = radius("normal(10 mm, 20 um)").expect("a distribution");
        assert!((ball.at(0.841_344_746_068_543) - 10.02e-3).abs() < 1e-12, "{}", ball.at(0.841_344_746_068_543));
        for (text, expected) in [
            ("normal(10 mm, -20 um)", "standard deviation of a normal distribution must be above 0"),
            ("normal(10 um, 20 um)", "0.01 mm: out of range; allowed 0.1 mm to 1000 mm"),
            ("normal(1 mm, 20 um, 10 um..2 mm)", "0.01 mm: out of range; allowed 0.1 mm to 1000 mm"),
            ("triangular(10 um, 1 mm, 2 mm)", "0.01 mm: out of range; allowed 0.1 mm to 1000 mm"),
            ("normal(10 mm, 20 s)", "unit"),
        ] {
            let message = radius(text).expect_err(text).to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
    }

    #[test]
    fn ends_that_the_scene_rejects_are_refused() {
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
            let message = Input::new(&scene, key, Some(text)).expect_err(text).to_string();
            assert!(message.starts_with(&expected), "{key}={text}: {message}");
        }
        assert!(Input::new(&scene, "body.coupler.mass", Some("1 g..2 kg")).is_ok());
    }

    #[test]
    fn a_pattern_matches_parameters_first_then_numbers_of_the_file() {
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
