//! Rows of the parameter table, and checks of their values.

use super::field::Access;
use super::key::ABOVE_ZERO;
use super::value::Value;
use jointplay_physics::suggest::{did_you_mean, nearest_name};
use jointplay_physics::units::{Dimension, QuantityError, exact_quantity, format_quantity, parse_quantity, unit_names};

/// Type and range of a parameter's value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A number with its dimension and closed range in SI units; `display` is the unit shown to the user.
    Number {
        /// Physical dimension.
        dimension: Dimension,
        /// Minimum, SI.
        min: f64,
        /// Maximum, SI.
        max: f64,
        /// Unit for display and sliders, e.g. "mm".
        display: &'static str,
        /// Ends of the slider's travel, SI (inside min..=max; typed entry reaches the rest).
        slider: (f64, f64),
        /// Whether the slider is logarithmic.
        logarithmic: bool,
    },
    /// A whole number in a closed range.
    Count {
        /// Minimum.
        min: u64,
        /// Maximum.
        max: u64,
    },
    /// One of a list of words.
    Choice(&'static [&'static str]),
}

impl Kind {
    /// The value of this kind that is `number` in SI units.
    pub(super) fn value_of(self, number: f64) -> Value {
        match self {
            Self::Count { .. } => Value::Count(number as u64),
            _ => Value::Number(number),
        }
    }
}

/// Scenes in which a key exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// In every scene.
    Every,
    /// In every scene, and as `joint.<name>.<last part>` for one joint.
    Contact,
    /// Only as `joint.<name>.<key>`, for a joint of a kind that has it.
    Joint,
    /// Only in the scene whose file defines it.
    Own,
}

impl Scope {
    /// The scope in words.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Every => "every scene",
            Self::Contact => "every scene; also `joint.<name>.<key>` for one joint with play",
            Self::Joint => "`joint.<name>.<key>` for one joint with a table `play`",
            Self::Own => "scenes whose file gives it",
        }
    }
}

/// A row of the parameter table.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Key, e.g. `contact.clearance`.
    pub key: &'static str,
    /// Where its value is stored in a scene.
    pub(super) access: Access,
    /// Sentence-case name for the interface, e.g. "Clearance".
    pub label: &'static str,
    /// Heading it is listed under, e.g. "Contact".
    pub group: &'static str,
    /// Type and range of its value.
    pub kind: Kind,
    /// Value if neither the file nor a change gives one.
    pub default: Value,
    /// Scenes in which it exists.
    pub scope: Scope,
    /// Takes effect only at the next reset (it would move a drive mid-run, or change the equations).
    pub at_reset: bool,
    /// What the quantity is, in a sentence or two, and the effect of extreme values.
    pub help: &'static str,
    /// Which equation it enters, e.g. "paper eqs. (9), (10)".
    pub equation: &'static str,
}

/// Each row exists once.
impl PartialEq for Parameter {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

/// Why a text or a value is not valid for a parameter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{fault}; {allowed}")]
pub struct ValueError {
    /// Cause.
    pub fault: ValueFault,
    /// Allowed values, in words.
    pub allowed: String,
}

/// Cause of an invalid value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ValueFault {
    /// Not a quantity of the right dimension.
    #[error("{0}")]
    Quantity(#[from] QuantityError),
    /// Out of range.
    #[error("out of range")]
    OutOfRange,
    /// Not a whole number.
    #[error("is not a whole number")]
    NotWhole,
    /// Not one of the choices.
    #[error("is not one of the choices{}", did_you_mean(*.nearest))]
    NoChoice {
        /// The nearest choice, if one is near.
        nearest: Option<&'static str>,
    },
    /// A choice of earlier versions; the text says what took its place.
    #[error("{0}")]
    Gone(&'static str),
    /// A value of the wrong type, such as a number for a choice.
    #[error("is of the wrong kind")]
    WrongKind,
}

/// Values that files and links of earlier versions may have: key, value, and what took its place.
const GONE: &[(&str, &str, &str)] = &[
    (
        "contact.friction_velocity",
        "printed",
        "is gone: use centres, the velocity of the paper's friction law (15), (16); what printed gave is in docs/tried.md",
    ),
    (
        "solver.method",
        "semi-implicit-euler",
        "is gone: use rk4, which has a fixed step, too, or discrete-gradient, which is fast at low accuracy",
    ),
];

impl Parameter {
    /// Unit in which values are shown; "" for pure numbers, counts and choices.
    pub fn display_unit(&self) -> &'static str {
        match self.kind {
            Kind::Number { display, .. } => display,
            _ => "",
        }
    }

    /// A value for display, with its unit: `0.3 mm`.
    pub fn show(&self, value: &Value) -> String {
        match value {
            Value::Number(si) => format_quantity(*si, self.display_unit()),
            Value::Count(count) => count.to_string(),
            Value::Choice(word) => (*word).to_owned(),
            Value::Unset => "none".to_owned(),
        }
    }

    /// The range or the choices, in words: `0 Hz to 50 Hz`.
    pub fn range(&self) -> String {
        match self.kind {
            // The table's upper end is the largest ball radius; the actual limit is this joint's ball radius.
            Kind::Number { min, display, .. } if self.key == "contact.clearance" => {
                format!("{} to below the ball radius", format_quantity(min, display))
            }
            Kind::Number { min, max, display, .. } if min == ABOVE_ZERO => {
                format!("above 0 up to {}", format_quantity(max, display))
            }
            Kind::Number { min, max, display, .. } => {
                format!("{} to {}", format_quantity(min, display), format_quantity(max, display))
            }
            Kind::Count { min, max } => format!("{min} to {max}"),
            Kind::Choice(words) => words.join(", "),
        }
    }

    /// Accepted units, in words; "" for a choice.
    pub fn units(&self) -> String {
        match self.kind {
            Kind::Number { dimension, .. } => match unit_names(dimension).as_slice() {
                [] => "a pure number, no unit".to_owned(),
                names => format!("units {}", names.join(", ")),
            },
            Kind::Count { .. } => "a whole number, no unit".to_owned(),
            Kind::Choice(_) => String::new(),
        }
    }

    /// Allowed values and units, in words.
    pub fn allowed(&self) -> String {
        let units = self.units();
        let separator = if units.is_empty() { "" } else { "; " };
        format!("allowed {}{separator}{units}", self.range())
    }

    /// Parses a value as users write it, and checks its range.
    ///
    /// # Errors
    /// Invalid value; the error states what is allowed, without the key.
    pub fn read(&self, text: &str) -> Result<Value, ValueError> {
        let text = text.trim();
        let value = match self.kind {
            Kind::Number { dimension, .. } => {
                let number = parse_quantity(text, dimension).map_err(|error| ValueError {
                    fault: error.into(),
                    // The error already lists the units.
                    allowed: format!("allowed {}", self.range()),
                })?;
                Value::Number(number)
            }
            Kind::Count { .. } => match text.parse::<u64>() {
                Ok(count) => Value::Count(count),
                Err(_) if text.parse::<i128>().is_ok() => {
                    return Err(self.refuse(ValueFault::OutOfRange));
                }
                Err(_) => return Err(self.refuse(ValueFault::NotWhole)),
            },
            Kind::Choice(words) => {
                // "x" means "+x".
                let word = text.to_lowercase();
                let found =
                    words.iter().find(|choice| **choice == word || choice.strip_prefix('+') == Some(word.as_str()));
                let Some(choice) = found else {
                    let gone = GONE.iter().find(|(key, value, _)| (*key, *value) == (self.key, &*word));
                    let nearest = || nearest_name(text, words.iter().copied());
                    return Err(self.refuse(match gone {
                        Some((_, _, now)) => ValueFault::Gone(now),
                        None => ValueFault::NoChoice { nearest: nearest() },
                    }));
                };
                Value::Choice(choice)
            }
        };
        self.check(&value)?;
        Ok(value)
    }

    /// Checks that a value has this parameter's type and is in range.
    ///
    /// # Errors
    /// Invalid value; the error states what is allowed, without the key.
    pub fn check(&self, value: &Value) -> Result<(), ValueError> {
        let fine = match (self.kind, value) {
            (Kind::Number { min, max, .. }, Value::Number(number)) => (min..=max).contains(number),
            (Kind::Count { min, max }, Value::Count(count)) => (min..=max).contains(count),
            (Kind::Choice(words), Value::Choice(word)) => words.contains(word),
            _ => return Err(self.refuse(ValueFault::WrongKind)),
        };
        if fine { Ok(()) } else { Err(self.refuse(ValueFault::OutOfRange)) }
    }

    fn refuse(&self, fault: ValueFault) -> ValueError {
        ValueError { fault, allowed: self.allowed() }
    }

    /// Formats a value so that [`Self::read`] returns exactly the same value.
    pub fn write(&self, value: &Value) -> String {
        match (self.kind, value) {
            (Kind::Number { dimension, display, .. }, Value::Number(si)) => exact_quantity(*si, display, dimension),
            _ => self.show(value),
        }
    }
}
