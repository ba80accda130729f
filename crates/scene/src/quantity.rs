//! Dimensioned numbers for the expressions in scene files.

use super::{Dimension, format_quantity, si_unit, unit_names};
use jointplay_physics::expression::{Binary, ExpressionError, Number, Program, Unary};
use jointplay_physics::units::{all_units, powers, unit_at_start};

/// A number with its dimension, or the reason why it has none.
#[derive(Clone, Copy, Debug)]
pub struct Quantity {
    value: f64,
    /// Exponents of kg, m, s and rad.
    powers: Result<[i8; 4], DimensionError>,
}

/// Why a quantity has no value of the required dimension.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DimensionError {
    /// Sum or comparison of different dimensions.
    #[error("adds or compares quantities of different dimensions")]
    Mixed,
    /// A function of a quantity that is not a pure number.
    #[error("takes a function of a quantity that is not a pure number")]
    NotPure,
    /// A root or power that gives units with non-integer exponents.
    #[error("takes a root or a power whose unit would not be whole")]
    Power,
    /// Infinite or NaN.
    #[error("is not a finite number")]
    NotFinite,
    /// A value of the wrong dimension.
    #[error("gives {}", wrong_dimension(*.value, *.powers, *.required))]
    WrongDimension {
        /// SI value.
        value: f64,
        /// Exponents of kg, m, s and rad.
        powers: [i8; 4],
        /// The dimension required.
        required: Dimension,
    },
}

impl Quantity {
    /// `value` in SI units.
    pub fn new(value: f64, dimension: Dimension) -> Self {
        Self { value, powers: Ok(powers(dimension)) }
    }

    /// Its SI value, regardless of its dimension.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Its unit in the base units; empty for a pure number, or where there is none.
    pub fn unit(&self) -> String {
        self.powers.map_or_else(|_| String::new(), unit_of)
    }

    /// Whether it is a pure number.
    pub(crate) fn is_pure(&self) -> bool {
        matches!(self.powers, Ok([0, 0, 0, 0]))
    }

    /// Whether it has a dimension.
    ///
    /// # Errors
    /// An invalid operation led to it.
    pub(super) fn dimension(&self) -> Result<(), DimensionError> {
        self.powers.map(|_| ())
    }

    /// Exponents of kg, m, s and rad; `None` after an invalid operation.
    pub fn powers(&self) -> Option<[i8; 4]> {
        self.powers.ok()
    }

    /// Its SI value if it has this dimension. Unless `exact`, radians are optional in products (omega r, 2 pi f); a bare number
    /// for an angle is rejected as a likely mistake.
    ///
    /// # Errors
    /// Wrong dimension, an invalid operation, or a value that is not finite.
    pub fn of(self, dimension: Dimension, exact: bool) -> Result<f64, DimensionError> {
        self.powers?;
        if !self.value.is_finite() {
            return Err(DimensionError::NotFinite);
        }
        self.has(dimension, exact)?;
        Ok(self.value + 0.0)
    }

    /// Whether it has this dimension, by the rules of [`Self::of`]; its value may be infinite or not a number.
    pub(super) fn has(self, dimension: Dimension, exact: bool) -> Result<(), DimensionError> {
        let (own, required) = (self.powers?, powers(dimension));
        let angle = !exact && required[..3] != [0; 3] || required[3] == own[3] || self.value == 0.0;
        if own[..3] == required[..3] && angle {
            return Ok(());
        }
        Err(DimensionError::WrongDimension { value: self.value, powers: own, required: dimension })
    }
}

/// Evaluates an expression such as `first + 0.2 ms` with named quantities.
///
/// # Errors
/// Position and cause of an error in the text.
pub fn evaluate(text: &str, names: &[(&str, Quantity)]) -> Result<Quantity, ExpressionError> {
    let known: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
    let units = all_units().map(|(_, dimension, size)| Quantity::new(size, dimension));
    let own = names.iter().map(|(_, quantity)| *quantity);
    let values: Vec<Quantity> = own.chain(units).collect();
    let program = Program::parse_with_units(
        text,
        |name| known.iter().position(|own| *own == name),
        &known,
        |rest| unit_at_start(rest).map(|(length, place)| (length, known.len() + place)),
    )?;
    Ok(program.eval(&values))
}

/// Error text: a value with its unit, and the required units.
fn wrong_dimension(value: f64, powers: [i8; 4], required: Dimension) -> String {
    let (value, unit) = (format_quantity(value, ""), unit_of(powers));
    match unit_names(required).as_slice() {
        [] => format!("{value} {unit}, but must be a pure number"),
        units => format!(
            "{value}{}{unit}, which is not in {}; units {}",
            if unit.is_empty() { "" } else { " " },
            si_unit(required),
            units.join(", ")
        ),
    }
}

/// Unit with these exponents of the base units: `kg m s^-2`.
fn unit_of(powers: [i8; 4]) -> String {
    let part = |(unit, power): (&str, i8)| match power {
        0 => None,
        1 => Some(unit.to_owned()),
        _ => Some(format!("{unit}^{power}")),
    };
    let parts: Vec<String> = ["kg", "m", "s", "rad"].into_iter().zip(powers).filter_map(part).collect();
    parts.join(" ")
}

/// Exponents of a sum. Radians are ignored next to other units.
fn common(a: Quantity, b: Quantity) -> Result<[i8; 4], DimensionError> {
    let (of_a, of_b) = (a.powers?, b.powers?);
    let zero = |q: Quantity, powers: [i8; 4]| q.value == 0.0 && powers == [0; 4];
    if zero(a, of_a) {
        return Ok(of_b);
    }
    let same = of_a == of_b || of_a[..3] == of_b[..3] && of_a[..3] != [0; 3];
    (same || zero(b, of_b)).then_some(of_a).ok_or(DimensionError::Mixed)
}

/// Exponents times `factor`, which must give small integers.
fn scaled(powers: [i8; 4], factor: f64) -> Result<[i8; 4], DimensionError> {
    let mut scaled = [0; 4];
    for (to, power) in scaled.iter_mut().zip(powers) {
        let value = f64::from(power) * factor;
        if value != libm::trunc(value) || value.abs() > 100.0 {
            return Err(DimensionError::Power);
        }
        *to = value as i8;
    }
    Ok(scaled)
}

impl Number for Quantity {
    fn constant(value: f64) -> Self {
        Self { value, powers: Ok([0; 4]) }
    }

    fn unary(self, operation: Unary) -> Self {
        let pure = |powers: [i8; 4]| match powers[..3] == [0; 3] {
            true => Ok([0; 4]),
            false => Err(DimensionError::NotPure),
        };
        let powers = self.powers.and_then(|powers| match operation {
            Unary::Negate | Unary::Abs => Ok(powers),
            Unary::Sqrt => scaled(powers, 0.5),
            Unary::Asin | Unary::Acos | Unary::Atan => pure(powers).map(|_| [0, 0, 0, 1]),
            _ => pure(powers),
        });
        Self { value: self.value.unary(operation), powers }
    }

    fn binary(self, operation: Binary, other: Self) -> Self {
        let each = |combine: fn(i8, i8) -> Option<i8>| {
            let (a, b) = (self.powers?, other.powers?);
            let mut powers = [0; 4];
            for (to, (a, b)) in powers.iter_mut().zip(a.into_iter().zip(b)) {
                *to = combine(a, b).ok_or(DimensionError::Power)?;
            }
            Ok(powers)
        };
        let powers = match operation {
            Binary::Add | Binary::Subtract | Binary::Min | Binary::Max => common(self, other),
            Binary::Multiply => each(i8::checked_add),
            Binary::Divide => each(i8::checked_sub),
            Binary::Atan2 => common(self, other).map(|_| [0, 0, 0, 1]),
            Binary::Power => match (self.powers, other.powers) {
                (Ok(base), Ok([0, 0, 0, 0])) => scaled(base, other.value),
                (Ok(_), Ok(_)) => Err(DimensionError::NotPure),
                (Err(fault), _) | (_, Err(fault)) => Err(fault),
            },
        };
        Self { value: self.value.binary(operation, other.value), powers }
    }
}
