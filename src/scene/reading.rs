//! What is known of a scene while it is being read: changes, the scene's own parameters, the numbers so far.

use std::cell::RefCell;
use std::collections::BTreeMap;
use toml::Spanned;
use toml::de::DeValue;

use super::copy::Copy;
use super::expression::{Number as _, Program};
use super::given::FileNumber;
use super::quantity::Quantity;
use super::units::{Dimension, all_units, parse_quantity, unit_at_start};

/// What is known of a scene while it is being read.
#[derive(Default)]
pub(super) struct Reading<'d> {
    /// Changes that are not parameters of the table: they replace what the text gives.
    changes: BTreeMap<&'d str, Spanned<DeValue<'d>>>,
    /// The scene's own parameters.
    own: RefCell<BTreeMap<String, Quantity>>,
    numbers: RefCell<BTreeMap<String, FileNumber>>,
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
        let own = self.own.borrow();
        let mut names: Vec<&str> = own.keys().map(String::as_str).collect();
        let mut values: Vec<Quantity> = own.values().copied().collect();
        if let Some(copy) = copy {
            names.push("i");
            values.push(Quantity::constant(f64::from(copy.number)));
        }
        let may_be_meant = !names.is_empty();
        let first_unit = values.len();
        values.extend(all_units().map(|(_, of, size)| Quantity::new(size, of)));
        let program = Program::parse_with_units(
            text,
            |name| names.iter().position(|own| *own == name),
            &names,
            |rest| unit_at_start(rest).map(|(length, place)| (length, first_unit + place)),
        );
        match program {
            // A number and its unit alone: what is wrong with it, the first error knows better.
            Ok(program)
                if program.length() <= 3 + usize::from(text.trim().starts_with('-'))
                    && !(0..first_unit).any(|own| program.uses(own))
                    && !text.contains(['*', '+', '(']) =>
            {
                Err(error)
            }
            Ok(program) => program.eval(&values).of(dimension),
            Err(wrong)
                if may_be_meant && !text.trim().starts_with(|c: char| c.is_ascii_digit()) =>
            {
                Err(wrong.to_string())
            }
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
