//! The uncertain parameters of a study.

use std::path::Path;

use super::report::DIGITS;
use super::rows::{Row, rows};
use crate::analysis::distribution::Distribution;
use crate::analysis::iso286::{Fit, FitError};
use crate::cli::Failure;
use crate::scene::{Kind, Scene, Value, contact_parts};
use crate::simulate::matches_pattern;
use crate::units::format_quantity_digits;

/// Range of an input without one of its own, over its value in the scene.
const DEFAULT_RANGE: [f64; 2] = [0.5, 1.5];
/// Largest number of inputs.
const MOST_INPUTS: usize = 64;
/// Process capability of hole and shaft of a fit.
const CAPABILITY: f64 = 1.0;

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

/// The parameters of the file `--tolerances`, then those of the options `--over KEY[=DISTRIBUTION]`. A key may be a pattern,
/// which stands for all numeric parameters that it matches; of a parameter given twice, the later distribution counts. An
/// option without a distribution stands for a uniform one, from half to one and a half of the value.
///
/// # Errors
/// Usage: no such parameter, a distribution that one does not accept, or another form of the file, with its line. Input/output:
/// an unreadable file.
pub fn inputs(scene: &Scene, tolerances: Option<&Path>, over: &[String]) -> Result<Vec<Input>, Failure> {
    let mut inputs: Vec<Input> = Vec::new();
    let mut add = |place: &str, pattern: &str, text: Option<&str>| -> Result<(), Failure> {
        for key in matching(scene, pattern).map_err(|error| Failure::usage(format!("{place}: {error}")))? {
            let input =
                Input::new(scene, &key, text).map_err(|error| Failure::usage(format!("{place}: {key}: {error}")))?;
            match inputs.iter_mut().find(|known| known.key == key) {
                // A later one refines an earlier pattern.
                Some(known) => *known = input,
                None => inputs.push(input),
            }
        }
        Ok(())
    };
    if let Some(path) = tolerances {
        for Row { place, cells: [pattern, text] } in rows("--tolerances", path, ["parameter", "distribution"])? {
            add(&place, &pattern, Some(&text))?;
        }
    }
    for option in over {
        let (pattern, text) = match option.split_once('=') {
            Some((pattern, text)) => (pattern.trim(), Some(text.trim())),
            None => (option.trim(), None),
        };
        add(&format!("--over {option}"), pattern, text)?;
    }
    if inputs.len() > MOST_INPUTS {
        return Err(Failure::usage(format!(
            "{} uncertain parameters; at most {MOST_INPUTS} are possible",
            inputs.len()
        )));
    }
    Ok(inputs)
}

/// Keys of the numeric parameters that match `pattern`; at least one.
///
/// # Errors
/// A sentence: there are none.
pub fn matching(scene: &Scene, pattern: &str) -> Result<Vec<String>, String> {
    let keys: Vec<String> = keys(scene).into_iter().filter(|key| matches_pattern(pattern, key)).collect();
    if keys.is_empty() {
        let near = scene.parameter(pattern).err().map(|error| error.to_string());
        return Err(near.unwrap_or_else(|| format!("no numeric parameter of the scene matches {pattern}")));
    }
    Ok(keys)
}

impl Input {
    /// Parameter `key` of `scene` with the distribution `text`.
    ///
    /// # Errors
    /// A sentence: an unknown key, a word in place of a number, or a distribution that the parameter does not accept.
    pub fn new(scene: &Scene, key: &str, text: Option<&str>) -> Result<Self, String> {
        let parameter = scene.parameter(key).map_err(|error| error.to_string())?;
        let Value::Number(nominal) = scene.get(key).map_err(|error| error.to_string())? else {
            return Err("its values are no real numbers".to_owned());
        };
        let number = |text: &str| match parameter.read(text) {
            Ok(Value::Number(value)) => Ok(value),
            Ok(_) => Err("not a number".to_owned()),
            Err(error) => Err(error.to_string()),
        };
        let distribution = match text {
            None => {
                let [low, high] = DEFAULT_RANGE.map(|part| part * nominal);
                Distribution::uniform(low.min(high), low.max(high))
            }
            Some(text) => match text.split_once("..").filter(|_| !text.contains('(')) {
                Some((low, high)) => Distribution::uniform(number(low.trim())?, number(high.trim())?),
                None => Distribution::parse(text, number, |fit| of_fit(scene, key, fit)),
            },
        };
        let distribution = distribution.map_err(|error| error.to_string())?;
        let (low, high) = distribution.support();
        for end in [low, high].into_iter().filter(|end| end.is_finite()) {
            parameter
                .check(&Value::Number(end))
                .map_err(|error| format!("{}: {error}", parameter.show(&Value::Number(end))))?;
        }
        Ok(Self { key: key.to_owned(), unit: parameter.display_unit(), nominal, distribution })
    }

    /// One of its values, with unit.
    pub fn shown(&self, value: f64) -> String {
        format_quantity_digits(value, self.unit, DIGITS)
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
