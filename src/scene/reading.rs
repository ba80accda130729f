//! What is known of a scene while it is being read: changes, the scene's own parameters, the numbers so far.

use std::borrow::Cow;
use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use toml::Spanned;
use toml::de::DeValue;

use super::copy::Copy;
use super::expression::{Number as _, Program};
use super::given::FileNumber;
use super::quantity::Quantity;
use super::units::{Dimension, all_units, parse_quantity, split_unit, unit_at_start};

/// What is known of a scene while it is being read.
#[derive(Default)]
pub(super) struct Reading<'d> {
    /// Changes that are not parameters of the table: they replace what the text gives.
    changes: BTreeMap<&'d str, Spanned<DeValue<'d>>>,
    /// The scene's own parameters.
    own: RefCell<BTreeMap<String, Quantity>>,
    numbers: RefCell<BTreeMap<String, FileNumber>>,
    /// The sizes of [`all_units`].
    units: OnceCell<Vec<Quantity>>,
}

impl<'d> Reading<'d> {
    /// With these changes, of keys that are not parameters of the table.
    pub fn new(changes: impl Iterator<Item = &'d (String, String)>) -> Self {
        let value = |text: &'d str| Spanned::new(0..0, DeValue::String(text.trim().into()));
        Self {
            changes: changes
                .map(|(key, text)| (key.as_str(), value(text)))
                .collect(),
            ..Self::default()
        }
    }

    /// What `key` was changed to.
    pub fn change(&'d self, key: &str) -> Option<&'d Spanned<DeValue<'d>>> {
        if self.changes.is_empty() {
            return None;
        }
        self.changes.get(key)
    }

    /// The SI value of a quantity or an expression; `copy` is that of a pattern to which it belongs.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn evaluate(
        &self,
        text: &str,
        dimension: Dimension,
        copy: Option<&Copy>,
    ) -> Result<f64, String> {
        let error = match parse_quantity(text, dimension) {
            Ok(value) => return Ok(value),
            Err(error) => error.to_string(),
        };
        let plain = plain(text);
        let own = self.own.borrow();
        let mut names: Vec<&str> = own.keys().map(String::as_str).collect();
        let mut values: Vec<Quantity> = own.values().copied().collect();
        if let Some(copy) = copy {
            names.push("i");
            values.push(Quantity::constant(f64::from(copy.number)));
        }
        let first_unit = values.len();
        let units = self.units.get_or_init(|| {
            let unit = |(_, of, size)| Quantity::new(size, of);
            all_units().map(unit).collect()
        });
        values.extend(units);
        let program = Program::parse_with_units(
            &plain,
            |name| names.iter().position(|own| *own == name),
            &names,
            |rest| unit_at_start(rest).map(|(length, place)| (length, first_unit + place)),
        );
        let may_be_meant = operates(&plain) || split_unit(&plain) == plain;
        match program {
            Ok(program) => {
                let uses_own = (0..first_unit).any(|own| program.uses(own));
                if !uses_own && !operates(&plain) {
                    // A number with its unit: what is wrong with it, the first error knows better.
                    return Err(error);
                }
                let value = program.eval(&values);
                // A parameter alone is a quantity like any other, and no product in which radians come and go.
                value.of(dimension, uses_own && program.length() == 1)
            }
            Err(wrong) if may_be_meant && !names.is_empty() => Err(wrong.to_string()),
            Err(_) => Err(error),
        }
    }

    /// Adds the scene's own parameter `name`, for expressions that follow.
    pub fn own(&self, name: &str, value: f64, dimension: Dimension) {
        let value = Quantity::new(value, dimension);
        self.own.borrow_mut().insert(name.to_owned(), value);
    }

    /// Keeps a number under its key.
    pub fn record(&self, key: &str, number: FileNumber) {
        self.numbers.borrow_mut().insert(key.to_owned(), number);
    }

    /// The numbers so far.
    pub fn numbers(&self) -> BTreeMap<String, FileNumber> {
        self.numbers.take()
    }
}

/// Whether a text is more than a number with its unit.
fn operates(text: &str) -> bool {
    let rest = split_unit(text);
    // A unit has letters after its stroke: `m/s`.
    let number = |part: &str| part.trim_start().starts_with(|c: char| c.is_ascii_digit());
    let divides = rest.split('/').skip(1).any(number);
    divides || rest.starts_with(['/', '^']) || rest.contains(['*', '+', '-', '('])
}

/// The text with the signs that only units may have spelt out.
fn plain(text: &str) -> Cow<'_, str> {
    if text.is_ascii() {
        return Cow::Borrowed(text);
    }
    let spelt = text
        .replace(['µ', 'μ'], "u")
        .replace('²', "^2")
        .replace('³', "^3");
    Cow::Owned(spelt.replace(['·', '⋅'], " ").replace('°', " deg"))
}
