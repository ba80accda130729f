//! Expressions and conditions over the measures of a lesson.

use crate::expression::Fault;
use crate::scene::{Kind, Quantity, Scene, Value, evaluate};
use crate::suggest::nearest;
use crate::units::Dimension;

/// The measures of a lesson by name, known or pending.
pub struct Names<'l> {
    /// The known measures.
    pub known: Vec<(&'l str, Quantity)>,
    /// All measures, each with value 1 and its dimension where that is known in advance.
    all: Vec<(&'l str, Quantity)>,
}

impl<'l> Names<'l> {
    /// Starts with no measure known; `all` holds 1 of each dimension where that is known in advance.
    pub fn unmeasured(all: Vec<(&'l str, Quantity)>) -> Self {
        let known = Vec::new();
        Self { known, all }
    }

    /// Checks that `expression` can be evaluated once all measures are known.
    ///
    /// # Errors
    /// Position and cause of the fault.
    pub fn check(&self, expression: &str) -> Result<(), String> {
        let Err(error) = evaluate(expression, &self.all) else {
            return Ok(());
        };
        let Fault::Unknown { name, called: false, .. } = &error.fault else {
            return Err(error.to_string());
        };
        let all = || self.all.iter().map(|(name, _)| *name);
        let known: Vec<&str> = all().collect();
        let near = nearest(name, all());
        Err(format!("no measure `{name}`{near}; allowed: {}", known.join(", ")))
    }

    /// The instant given by `expression`, s; `None` if it is pending or not a time.
    pub fn time(&self, expression: &str) -> Option<f64> {
        let quantity = evaluate(expression, &self.known).ok()?;
        quantity.of(Dimension::Time, false).ok()
    }

    /// Whether `condition` holds; `None` if it is pending or compares different dimensions.
    pub fn holds(&self, condition: &str) -> Option<bool> {
        let mut all = true;
        for (left, sign, right) in comparisons(condition)? {
            let left = evaluate(left, &self.known).ok()?;
            let right = evaluate(right, &self.known).ok()?;
            // A plain 0 is compatible with any dimension.
            let same = left.powers()? == right.powers()? || right.value() == 0.0;
            all &= match sign {
                _ if !same => return None,
                '<' => left.value() < right.value(),
                '>' => left.value() > right.value(),
                _ => left.value() == right.value(),
            };
        }
        Some(all)
    }
}

/// The comparisons of `condition`: a chain such as `1.8 < b / a < 2.2`, or several joined by `and`; `None` if there is none.
pub fn comparisons(condition: &str) -> Option<Vec<(&str, char, &str)>> {
    let mut out = Vec::new();
    for part in condition.split(" and ") {
        let signs: Vec<(usize, char)> = part.char_indices().filter(|(_, c)| matches!(c, '<' | '>' | '=')).collect();
        let ends = signs.iter().map(|(at, _)| *at).chain([part.len()]);
        let mut from = 0;
        let sides: Vec<&str> = ends
            .map(|end| {
                let side = part[from..end].trim();
                from = (end + 1).min(part.len());
                side
            })
            .collect();
        for (pair, (_, sign)) in sides.windows(2).zip(&signs) {
            out.push((pair[0], *sign, pair[1]));
        }
        if signs.is_empty() {
            return None;
        }
    }
    Some(out)
}

/// The value of a parameter of `scene`.
pub fn parameter(scene: &Scene, key: &str) -> Result<Quantity, String> {
    let value = scene.get(key).map_err(|error| error.to_string())?;
    let dimension = match scene.parameter(key).map(|parameter| parameter.kind) {
        Ok(Kind::Number { dimension, .. }) => dimension,
        _ => Dimension::None,
    };
    match value {
        Value::Number(si) => Ok(Quantity::new(si, dimension)),
        Value::Count(count) => Ok(Quantity::new(count as f64, dimension)),
        _ => Err(format!("`{key}` is not a number")),
    }
}
