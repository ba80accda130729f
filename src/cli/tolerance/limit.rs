//! Limits of outputs.

use crate::analysis::lot::Limit;
use crate::analysis::study::Output;
use crate::cli::Failure;
use crate::cli::study::{display_value, outputs};
use crate::scene::Scene;

/// Reads the options `--limit OUTPUT=HIGH`, `OUTPUT=LOW..HIGH` or `OUTPUT=LOW..`; a pattern of channels limits each of them.
///
/// # Errors
/// Usage: an unknown output or one given twice, no value of it, or limits in the wrong order.
pub fn read(scene: &Scene, options: &[String]) -> Result<(Vec<Output>, Vec<Limit>), Failure> {
    let (mut all, mut limits) = (Vec::<Output>::new(), Vec::new());
    for option in options {
        let wrong = |what: &str| Failure::usage(format!("--limit {option}: {what}"));
        let (name, range) =
            option.split_once('=').ok_or_else(|| wrong("expected OUTPUT=LIMIT, e.g. tip-error=50um"))?;
        for output in outputs(scene, "--limit", name.trim())? {
            if all.iter().any(|known| known.name == output.name) {
                return Err(wrong(&format!("{} has a limit already; LOW..HIGH gives both", output.name)));
            }
            let limit = read_one(&output, range).map_err(|error| wrong(&error))?;
            all.push(output);
            limits.push(limit);
        }
    }
    Ok((all, limits))
}

fn read_one(output: &Output, text: &str) -> Result<Limit, String> {
    let end = |text: &str| if text.trim().is_empty() { Ok(None) } else { output.read(text).map(Some) };
    let (lower, upper) = match text.split_once("..") {
        Some((lower, upper)) => (end(lower)?, end(upper)?),
        None => (None, end(text)?),
    };
    match (lower, upper) {
        (None, None) => Err("expected a value, or LOW..HIGH".to_owned()),
        (Some(lower), Some(upper)) if lower >= upper => Err("the lower limit must be below the upper one".to_owned()),
        _ => Ok(Limit { lower, upper }),
    }
}

/// A limit in words.
pub fn describe(limit: &Limit, unit: &str) -> String {
    let display = |value| display_value(value, unit);
    match (limit.lower, limit.upper) {
        (Some(lower), Some(upper)) => format!("from {} to {}", display(lower), display(upper)),
        (Some(lower), None) => format!("at least {}", display(lower)),
        (None, upper) => format!("at most {}", display(upper.unwrap_or(f64::NAN))),
    }
}
