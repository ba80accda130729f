//! State of the reader: changes, user-defined parameters, and the numbers read so far.

use std::borrow::Cow;
use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use toml::Spanned;
use toml::de::DeValue;

use super::file_number::FileNumber;
use super::instance::Instance;
use super::quantity::{DimensionError, Quantity};
use jointplay_physics::expression::{ExpressionError, Number as _, Program};
use jointplay_physics::units::{Dimension, QuantityError, all_units, parse_quantity, split_unit, unit_at_start};

/// Why a text is not a valid quantity or expression.
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
    /// Byte offset of the error in the text; 0 if it concerns the whole text.
    pub fn at(&self) -> usize {
        match self {
            Self::Expression(error) => error.at,
            Self::Quantity(_) | Self::Dimension(_) => 0,
        }
    }
}

/// State of the reader.
#[derive(Default)]
pub(super) struct Reading<'d> {
    /// Changes of keys outside the parameter table: they replace values in the text.
    changes: BTreeMap<&'d str, Spanned<DeValue<'d>>>,
    /// User-defined parameters, by their full names: with the prefix of the included file that defines them.
    own: RefCell<BTreeMap<String, Quantity>>,
    numbers: RefCell<BTreeMap<String, FileNumber>>,
    /// Functions of the scene's closed form read so far, with their values at t = 0.
    functions: RefCell<Vec<(String, Quantity)>>,
    /// SI sizes of [`all_units`].
    units: OnceCell<Vec<Quantity>>,
}

impl<'d> Reading<'d> {
    /// A reader state with these `changes` of keys outside the parameter table.
    pub fn new(changes: impl Iterator<Item = &'d (String, String)>) -> Self {
        let value = |text: &'d str| Spanned::new(0..0, DeValue::String(text.trim().into()));
        Self { changes: changes.map(|(key, text)| (key.as_str(), value(text))).collect(), ..Self::default() }
    }

    /// The changed value of `key`, if any.
    pub fn change(&'d self, key: &str) -> Option<&'d Spanned<DeValue<'d>>> {
        if self.changes.is_empty() {
            return None;
        }
        self.changes.get(key)
    }

    /// The SI value of a quantity or an expression; `instance` is the group that it belongs to, if any.
    ///
    /// # Errors
    /// Invalid syntax, unit or dimension.
    pub fn evaluate(
        &self,
        text: &str,
        dimension: Dimension,
        instance: Option<&Instance<'_>>,
    ) -> Result<f64, ReadingError> {
        let error = match parse_quantity(text, dimension) {
            Ok(value) => return Ok(value),
            Err(error) => error,
        };
        let ascii = to_ascii(text);
        let own = self.own.borrow();
        let (names, mut values) = named(&own, instance);
        let first_unit = values.len();
        values.extend(self.units());
        let program = Program::parse_with_units(
            &ascii,
            |name| names.iter().position(|own| *own == name),
            &names,
            |rest| unit_at_start(rest).map(|(length, place)| (length, first_unit + place)),
        );
        let may_be_expression = has_operators(&ascii) || split_unit(&ascii) == ascii;
        match program {
            Ok(program) => {
                let uses_own = (0..first_unit).any(|own| program.uses(own));
                if !uses_own && !has_operators(&ascii) {
                    // A number with its unit: the first error is more specific.
                    return Err(error.into());
                }
                let value = program.eval(&values);
                // A lone parameter must match exactly: only in products are radians optional.
                Ok(value.of(dimension, uses_own && program.length() == 1)?)
            }
            Err(wrong) if may_be_expression && !names.is_empty() => Err(wrong.into()),
            Err(_) => Err(error.into()),
        }
    }

    /// Compiles `text` as a function of the time t, s, with the current values of user-defined parameters. The flag says
    /// whether it has units: if a parameter or number in it has a unit, t is a time and the value must have `dimension`.
    /// Otherwise all numbers are pure.
    ///
    /// # Errors
    /// Invalid syntax, unit or dimension.
    pub fn formula(
        &self,
        text: &str,
        dimension: Dimension,
        instance: Option<&Instance<'_>>,
    ) -> Result<(Program, bool), ReadingError> {
        let (program, value, has_units) = self.compile(text, &[], instance)?;
        if has_units {
            value.of(dimension, false)?;
        }
        Ok((program, has_units))
    }

    /// As [`Self::formula`], for a function of the scene's closed form, or an expression of its functions, which are variables after t. The
    /// quantity is the value at t = 0, which need not be finite.
    ///
    /// # Errors
    /// Invalid syntax, unit or dimension.
    pub fn function(&self, text: &str) -> Result<(Program, Quantity), ReadingError> {
        let (program, value, _) = self.compile(text, &self.functions.borrow(), None)?;
        value.dimension()?;
        Ok((program, value))
    }

    /// Compiles `text` as a function of t and `functions`; the program, its value at t = 0, and whether it has units.
    fn compile(
        &self,
        text: &str,
        functions: &[(String, Quantity)],
        instance: Option<&Instance<'_>>,
    ) -> Result<(Program, Quantity, bool), ReadingError> {
        let own = self.own.borrow();
        let of_time = [("t", Quantity::new(0.0, Dimension::Time))];
        let functions = functions.iter().map(|(name, value)| (name.as_str(), *value));
        let (mut names, mut values): (Vec<&str>, Vec<Quantity>) = of_time.into_iter().chain(functions).unzip();
        let free = names.len();
        let (own_names, own_values) = named(&own, instance);
        names.extend(own_names);
        values.extend(own_values);
        let first_unit = values.len();
        values.extend(self.units());
        let variable = |name: &str| names.iter().position(|of| *of == name);
        let numbers: Vec<f64> = values[free..].iter().map(Quantity::value).collect();
        let bare = Program::parse(text, variable, &names);
        let has_unit = |program: &Program| (1..first_unit).any(|own| program.uses(own) && !values[own].is_pure());
        if let Ok(program) = &bare
            && !has_unit(program)
        {
            let start: Vec<f64> = values.iter().map(Quantity::value).collect();
            return Ok((program.with_bound_variables(free, &numbers), Quantity::constant(program.eval(&start)), false));
        }
        let ascii = to_ascii(text);
        let unit = |rest: &str| {
            let (length, place) = unit_at_start(rest)?;
            Some((length, first_unit + place))
        };
        match Program::parse_with_units(&ascii, variable, &names, unit) {
            Ok(program) => Ok((program.with_bound_variables(free, &numbers), program.eval(&values), true)),
            // The error of the parse without units is more specific.
            Err(wrong) => Err(bare.err().unwrap_or(wrong).into()),
        }
    }

    /// SI sizes of [`all_units`].
    fn units(&self) -> &[Quantity] {
        self.units.get_or_init(|| {
            let unit = |(_, of, size)| Quantity::new(size, of);
            all_units().map(unit).collect()
        })
    }

    /// Defines the user parameter `name` for later expressions.
    pub fn define_parameter(&self, name: &str, value: f64, dimension: Dimension) {
        let value = Quantity::new(value, dimension);
        self.own.borrow_mut().insert(name.to_owned(), value);
    }

    /// Whether a parameter of the scene or a function has this name.
    pub fn is_defined(&self, name: &str) -> bool {
        self.own.borrow().contains_key(name) || self.functions.borrow().iter().any(|(own, _)| own == name)
    }

    /// Defines a function of the scene's closed form for later expressions.
    pub fn add_function(&self, name: &str, value: Quantity) {
        self.functions.borrow_mut().push((name.to_owned(), value));
    }

    /// Functions of the scene's closed form read so far, in order.
    pub fn functions(&self) -> Vec<(String, Quantity)> {
        self.functions.borrow().clone()
    }

    pub fn record(&self, key: &str, number: FileNumber) {
        self.numbers.borrow_mut().insert(key.to_owned(), number);
    }

    /// Takes the numbers recorded so far.
    pub fn numbers(&self) -> BTreeMap<String, FileNumber> {
        self.numbers.take()
    }
}

/// Names and values for expressions: the number `i` of a pattern copy, the parameters of the included file around `instance`, and
/// those of the scene with other names.
fn named<'a>(own: &'a BTreeMap<String, Quantity>, instance: Option<&Instance<'_>>) -> (Vec<&'a str>, Vec<Quantity>) {
    let prefix = instance.map_or("", Instance::prefix);
    let local = |name: &'a str| name.strip_prefix(prefix).filter(|name| !name.contains('.'));
    let shadowed = |name: &str| !prefix.is_empty() && own.contains_key(&format!("{prefix}{name}"));
    let visible = own.iter().filter_map(|(name, value)| {
        let common = || Some(&**name).filter(|name| !name.contains('.') && !shadowed(name));
        Some((local(name).or_else(common)?, *value))
    });
    let number = instance.and_then(Instance::number).map(|number| ("i", Quantity::constant(f64::from(number))));
    visible.chain(number).unzip()
}

/// Whether a text has operators beyond those of a number with its unit.
fn has_operators(text: &str) -> bool {
    let rest = split_unit(text);
    // In a unit, letters follow the slash: `m/s`.
    let starts_with_digit = |part: &str| part.trim_start().starts_with(|c: char| c.is_ascii_digit());
    let divides = rest.split('/').skip(1).any(starts_with_digit);
    divides || rest.starts_with(['/', '^']) || rest.contains(['*', '+', '-', '('])
}

/// The text with unit symbols such as `µ`, `²` and `°` in ASCII.
fn to_ascii(text: &str) -> Cow<'_, str> {
    if text.is_ascii() {
        return Cow::Borrowed(text);
    }
    let ascii = text.replace(['µ', 'μ'], "u").replace('²', "^2").replace('³', "^3");
    Cow::Owned(ascii.replace(['·', '⋅'], " ").replace('°', " deg"))
}
