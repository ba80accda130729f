//! The uncertain parameters of a study.

use super::StudyError;
use crate::distribution::Distribution;
use crate::iso286::{Fit, FitError};
use jointplay_physics::simulate::matches_pattern;
use jointplay_scene::{Kind, Parameter, Scene, Value, contact_parts};

/// Range of an input without one of its own, over its value in the scene.
const DEFAULT_RANGE: [f64; 2] = [0.5, 1.5];
/// Largest number of inputs.
const MOST_INPUTS: usize = 64;
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
    /// Value in the scene, SI.
    pub nominal: f64,
    /// Distribution, SI.
    pub distribution: Distribution,
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
        let at = |place: &str, error| StudyError::At { place: place.to_owned(), error: Box::new(error) };
        for key in matching(scene, pattern).map_err(|error| at(place, error))? {
            let input = Input::new(scene, &key, distribution.as_deref());
            let input = input.map_err(|error| at(place, at(&key, error)))?;
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
    if found > MOST_INPUTS { Err(StudyError::TooMany { found, most: MOST_INPUTS }) } else { Ok(()) }
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

/// Keys of the numeric parameters that match `pattern`; at least one.
///
/// # Errors
/// There are none.
pub fn matching(scene: &Scene, pattern: &str) -> Result<Vec<String>, StudyError> {
    let keys: Vec<String> = keys(scene).into_iter().filter(|key| matches_pattern(pattern, key)).collect();
    if keys.is_empty() {
        scene.parameter(pattern)?;
        return Err(StudyError::NoMatch(pattern.to_owned()));
    }
    Ok(keys)
}

impl Input {
    /// Parameter `key` of `scene` with the distribution `text`.
    ///
    /// # Errors
    /// An unknown key, a word in place of a number, or a distribution that the parameter does not accept.
    pub fn new(scene: &Scene, key: &str, text: Option<&str>) -> Result<Self, StudyError> {
        let (parameter, nominal) = real_parameter(scene, key)?;
        let number = |text: &str| match parameter.read(text)? {
            Value::Number(value) => Ok(value),
            Value::Count(_) | Value::Choice(_) | Value::Unset => Err(StudyError::NotReal),
        };
        let distribution = match text {
            None => {
                let allowed = |value: f64| match parameter.kind {
                    Kind::Number { min, max, .. } => value.clamp(min, max),
                    _ => value,
                };
                let [low, high] = DEFAULT_RANGE.map(|part| allowed(part * nominal));
                Distribution::uniform(low.min(high), low.max(high))
            }
            Some(text) => match text.split_once("..").filter(|_| !text.contains('(')) {
                Some((low, high)) => Distribution::uniform(number(low.trim())?, number(high.trim())?),
                None => Distribution::parse(
                    text,
                    |text| number(text).map_err(|error| error.to_string()),
                    |fit| of_fit(scene, key, fit),
                ),
            },
        }?;
        let (low, high) = distribution.support();
        for end in [low, high].into_iter().filter(|end| end.is_finite()) {
            check_end(parameter, end)?;
        }
        Ok(Self { key: key.to_owned(), unit: parameter.display_unit(), nominal, distribution })
    }

    /// Its value at the fraction `u` of all values, 0 < u < 1.
    pub fn at(&self, u: f64) -> f64 {
        self.distribution.quantile(u)
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
        let ends = |key: &str| Input::new(&scene, key, None).expect("a range").distribution.support();
        assert_eq!(ends("contact.restitution"), (0.45, 1.0));
        let nominal = scene.machine.ball_joints[0].contact.clearance;
        assert_eq!(ends("joint.A.clearance"), (0.5 * nominal, 1.5 * nominal));
    }
}
