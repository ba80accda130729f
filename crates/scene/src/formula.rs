//! Formulas of drives and loads: a prescribed coordinate or a factor as a function of time.

use super::document::Node;
use super::{Dimension, SceneError, parse_quantity};
use jointplay_physics::expression::Program;
use jointplay_physics::jet::Jet;

/// Reads a formula in `t` for a coordinate of `dimension`, or for a factor, which has none; returns the compiled program and the
/// size of its `unit`, SI.
pub(super) fn read_formula(
    node: &Node<'_>,
    unit: Option<&Node<'_>>,
    dimension: Dimension,
) -> Result<(Program, f64), SceneError> {
    let text = node.text()?;
    let document = node.document;
    let (program, has_units) = document
        .reading
        .formula(text, dimension, document.instance)
        .map_err(|error| error_within(node, text, error.at(), &error.to_string()))?;
    if let Some(function) = program.kink() {
        let at = text.find(function).unwrap_or(0);
        let why = match dimension {
            Dimension::None => "no step would end there",
            _ => "a drive would need an infinite force there",
        };
        let message = format!(
            "`{function}` has no second derivative where it turns: {why}; smoothstep(x) rises smoothly from 0 to 1"
        );
        return Err(error_within(node, text, at, &message));
    }
    let scale = match unit {
        None => 1.0,
        Some(unit) if has_units => {
            let why =
                "not allowed here: a formula with quantities has its own unit; a parameter without one is a number";
            return Err(unit.error(why));
        }
        Some(unit) => {
            let one = format!("1 {}", unit.text()?);
            parse_quantity(&one, dimension).map_err(|error| unit.error(error.to_string()))?
        }
    };
    let start = program.eval(&[Jet::new(0.0, 1.0, 0.0)]);
    let finite = [start.value, start.rate, start.acceleration].map(f64::is_finite);
    if finite != [true; 3] {
        let what = match dimension {
            Dimension::None => ["value", "derivative", "second derivative"],
            _ => ["position", "speed", "acceleration"],
        };
        let missing = finite.iter().position(|is_finite| !is_finite).unwrap_or(0);
        return Err(node.error(format!("has no finite {} at t = 0", what[missing])));
    }
    Ok((program, scale))
}

/// An error at the byte offset `at` of the string `text`, the value of `node`.
pub(super) fn error_within(node: &Node<'_>, text: &str, at: usize, message: &str) -> SceneError {
    let span = node.value.span();
    let inner = span.start + 1;
    // A string with escapes or triple quotes is marked as a whole, because its offsets differ from the source.
    let is_literal = node.document.text.get(inner..).is_some_and(|rest| rest.starts_with(text));
    let start = if is_literal { inner + at } else { span.start };
    let excerpt = node.document.excerpt(span.clone());
    node.document.error(start..span.end, &node.key, Some(&excerpt), message)
}
