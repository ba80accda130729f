//! Expressions and conditions over the measures of a lesson.

use crate::expression::Fault;
use crate::scene::{Kind, Quantity, Scene, Value, evaluate};
use crate::suggest::nearest;
use crate::units::Dimension;

/// The measures of a lesson by name, as far as they are known.
pub struct Names<'l> {
    /// Those that are known.
    pub known: Vec<(&'l str, Quantity)>,
    /// All of them, each as 1 of its dimension where that is known beforehand.
    all: Vec<(&'l str, Quantity)>,
}

impl<'l> Names<'l> {
    /// None of `all` is known yet; each is 1 of its dimension, where that is known beforehand.
    pub fn to_come(all: Vec<(&'l str, Quantity)>) -> Self {
        let known = Vec::new();
        Self { known, all }
    }

    /// Whether `expression` can be computed once all of them are known.
    ///
    /// # Errors
    /// Where it is wrong, and why.
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

    /// The instant that `expression` gives, s; `None` if it is still to come or is no time.
    pub fn time(&self, expression: &str) -> Option<f64> {
        let quantity = evaluate(expression, &self.known).ok()?;
        quantity.of(Dimension::Time, false).ok()
    }

    /// Whether `condition` holds; `None` if that is still to come or it compares what cannot be compared.
    pub fn holds(&self, condition: &str) -> Option<bool> {
        let mut all = true;
        for (left, sign, right) in comparisons(condition)? {
            let left = evaluate(left, &self.known).ok()?;
            let right = evaluate(right, &self.known).ok()?;
            // A pure 0 stands for 0 of any dimension.
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

/// The comparisons of `condition`, a chain such as `1.8 < b / a < 2.2`, or several joined by `and`; `None` if there is none.
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

/// The number that `scene` gives a parameter.
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
