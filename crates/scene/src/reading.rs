//! What is known of a scene while it is being read: changes, the scene's own parameters, the numbers so far.

use std::borrow::Cow;
use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use toml::Spanned;
use toml::de::DeValue;

use super::given::FileNumber;
use super::pattern_instance::PatternInstance;
use super::quantity::{DimensionError, Quantity};
use jointplay_physics::expression::{ExpressionError, Number as _, Program};
use jointplay_physics::units::{Dimension, QuantityError, all_units, parse_quantity, split_unit, unit_at_start};

/// Why a text is neither a quantity nor an expression that gives one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum ReadingError {
    #[error(transparent)]
    Quantity(#[from] QuantityError),
    #[error(transparent)]
    Expression(#[from] ExpressionError),
    #[error(transparent)]
    Dimension(#[from] DimensionError),
}

impl ReadingError {
    /// Byte of the text at which it is wrong; 0 where all of it is.
    pub fn at(&self) -> usize {
        match self {
            Self::Expression(error) => error.at,
            Self::Quantity(_) | Self::Dimension(_) => 0,
        }
    }
}

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
        Self { changes: changes.map(|(key, text)| (key.as_str(), value(text))).collect(), ..Self::default() }
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
        copy: Option<&PatternInstance>,
    ) -> Result<f64, ReadingError> {
        let error = match parse_quantity(text, dimension) {
            Ok(value) => return Ok(value),
            Err(error) => error,
        };
        let plain = plain(text);
        let own = self.own.borrow();
        let (names, mut values) = named(&own, copy);
        let first_unit = values.len();
        values.extend(self.units());
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
                    return Err(error.into());
                }
                let value = program.eval(&values);
                // A parameter alone is a quantity like any other, and no product in which radians come and go.
                Ok(value.of(dimension, uses_own && program.length() == 1)?)
            }
            Err(wrong) if may_be_meant && !names.is_empty() => Err(wrong.into()),
            Err(_) => Err(error.into()),
        }
    }

    /// The expression `text` of the time t, s, with the scene's own parameters as they are now, and whether it is one of
    /// quantities: if a parameter in it has a unit, or a number, then t is a time, and its value has this `dimension`.
    /// Otherwise all are pure numbers.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn formula(
        &self,
        text: &str,
        dimension: Dimension,
        copy: Option<&PatternInstance>,
    ) -> Result<(Program, bool), ReadingError> {
        let own = self.own.borrow();
        let (mut names, mut values) = named(&own, copy);
        names.insert(0, "t");
        values.insert(0, Quantity::new(0.0, Dimension::Time));
        let first_unit = values.len();
        values.extend(self.units());
        let variable = |name: &str| names.iter().position(|of| *of == name);
        let numbers: Vec<f64> = values[1..].iter().map(Quantity::value).collect();
        let bare = Program::parse(text, variable, &names);
        let has_unit = |program: &Program| (1..first_unit).any(|own| program.uses(own) && !values[own].is_pure());
        if let Ok(program) = &bare
            && !has_unit(program)
        {
            return Ok((program.bound(&numbers), false));
        }
        let spelt = plain(text);
        let unit = |rest: &str| {
            let (length, place) = unit_at_start(rest)?;
            Some((length, first_unit + place))
        };
        match Program::parse_with_units(&spelt, variable, &names, unit) {
            Ok(program) => {
                program.eval(&values).of(dimension, false)?;
                Ok((program.bound(&numbers), true))
            }
            // Without units in it, the first error knows better.
            Err(wrong) => Err(bare.err().unwrap_or(wrong).into()),
        }
    }

    /// The sizes of [`all_units`].
    fn units(&self) -> &[Quantity] {
        self.units.get_or_init(|| {
            let unit = |(_, of, size)| Quantity::new(size, of);
            all_units().map(unit).collect()
        })
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

/// Names and values that expressions may use: the scene's own parameters, and the number of a pattern's copy.
fn named<'a>(own: &'a BTreeMap<String, Quantity>, copy: Option<&PatternInstance>) -> (Vec<&'a str>, Vec<Quantity>) {
    let mut names: Vec<&str> = own.keys().map(String::as_str).collect();
    let mut values: Vec<Quantity> = own.values().copied().collect();
    if let Some(copy) = copy {
        names.push("i");
        values.push(Quantity::constant(f64::from(copy.number)));
    }
    (names, values)
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
    let spelt = text.replace(['µ', 'μ'], "u").replace('²', "^2").replace('³', "^3");
    Cow::Owned(spelt.replace(['·', '⋅'], " ").replace('°', " deg"))
}
