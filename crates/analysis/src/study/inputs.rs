//! The varied parameters of a study.

use super::StudyError;
use jointplay_physics::simulate::matches_pattern;
use jointplay_physics::suggest::nearest;
use jointplay_physics::units::{QuantityError, parse_quantity};
use jointplay_scene::{Kind, Parameter, Scene, Value, ValueError, ValueFault};

/// Largest number of varied parameters.
const MAX_INPUTS: usize = 64;

/// Requires at most [`MAX_INPUTS`] parameters.
pub(super) fn check_count(found: usize) -> Result<(), StudyError> {
    if found > MAX_INPUTS { Err(StudyError::TooMany { found, most: MAX_INPUTS }) } else { Ok(()) }
}

/// Table row and SI value of the real-valued parameter `key`.
///
/// # Errors
/// An unknown key, or a parameter whose values are no real numbers.
pub fn real_parameter(scene: &Scene, key: &str) -> Result<(&'static Parameter, f64), StudyError> {
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
        let of_all_joints = (0..scene.machine.loose_joints.len()).flat_map(|joint| {
            let own = format!("joint.{}.", scene.machine.loose_joints[joint].name);
            scene.joint_keys(joint).map(move |key| key.replacen(&own, "joint.*.", 1))
        });
        let known: Vec<String> = of_all_joints.chain(parameters).chain(numbers()).collect();
        let nearest = nearest(pattern, known.iter().map(String::as_str));
        return Err(StudyError::NoMatch { pattern: pattern.to_owned(), nearest });
    }
    Ok(found)
}

/// Parses a number in a unit of the parameter `key`, SI, without its range check: a standard deviation may lie outside the range
/// of the parameter.
///
/// # Errors
/// As [`real_parameter`]; a text that is no number with such a unit.
pub fn read_unchecked(scene: &Scene, key: &str, text: &str) -> Result<f64, StudyError> {
    let (parameter, _) = real_parameter(scene, key)?;
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

/// Keys of the real-valued parameters of a scene: first its own, then those of each joint with play.
fn real_keys(scene: &Scene) -> Vec<String> {
    let own = scene.parameters().into_iter();
    let own = own.filter(|parameter| matches!(parameter.kind, Kind::Number { .. })).map(|p| p.key.to_owned());
    let of_joints = (0..scene.machine.loose_joints.len()).flat_map(|joint| scene.joint_keys(joint));
    let all = own.chain(of_joints);
    all.filter(|key| matches!(scene.get(key), Ok(Value::Number(_)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standard_deviation_may_lie_below_the_allowed_range_of_its_parameter() {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        // A ball has a radius of at least 0.1 mm.
        let read = |text: &str| read_unchecked(&scene, "contact.ball_radius", text);
        assert_eq!(read(" 20 um"), Ok(20e-6));
        for (text, expected) in [("20 s", "wrong unit `s`"), ("much", "is not a number")] {
            let message = read(text).expect_err(text).to_string();
            assert!(message.contains(expected), "{text}: {message}");
        }
        assert_eq!(read_unchecked(&scene, "solver.preset", "fine"), Err(StudyError::NotReal));
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
