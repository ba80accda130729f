//! Accessors that read and write parameters of a scene.

use super::ViewSettings;
use super::value::Value;
use jointplay_physics::contact;
use jointplay_physics::machine::{LooseJoint, Machine};
use jointplay_physics::words::Words;

/// Reads and writes one field of a `T`. Values written have already passed the row's range check.
#[derive(Debug)]
pub struct Field<T> {
    pub(super) get: fn(&T) -> Value,
    pub(super) set: fn(&mut T, &Value),
}

// A derive would require `T: Copy`.
impl<T> Clone for Field<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Field<T> {}

/// Where the value of a row is stored.
#[derive(Clone, Copy, Debug)]
pub enum Access {
    /// In the contact parameters of the scene and of each joint with play.
    Contact(Field<contact::Parameters>),
    /// In the machine.
    Machine(Field<Machine>),
    /// In the view settings.
    View(Field<ViewSettings>),
    /// In the scene's text; a change reads the scene again.
    Number,
    /// In the scene's text, as part of a joint with play.
    Joint(fn(&LooseJoint) -> Value),
}

/// A type that a field can hold.
pub(super) trait FieldValue: Sized {
    fn to_value(self) -> Value;
    fn of_value(value: &Value) -> Self;
}

impl FieldValue for f64 {
    fn to_value(self) -> Value {
        Value::Number(self)
    }

    fn of_value(value: &Value) -> Self {
        match value {
            Value::Number(number) => *number,
            _ => unreachable!("the table has checked the kind"),
        }
    }
}

impl FieldValue for u32 {
    fn to_value(self) -> Value {
        Value::Count(u64::from(self))
    }

    fn of_value(value: &Value) -> Self {
        match value {
            Value::Count(count) => u32::try_from(*count).expect("the table has checked the range"),
            _ => unreachable!("the table has checked the kind"),
        }
    }
}

/// Words for `true` and `false`.
pub(super) const SWITCH: [&str; 2] = ["on", "off"];

impl FieldValue for bool {
    fn to_value(self) -> Value {
        Value::Choice(if self { SWITCH[0] } else { SWITCH[1] })
    }

    fn of_value(value: &Value) -> Self {
        *value == Value::Choice(SWITCH[0])
    }
}

/// The enum variant named by `value`.
pub(super) fn word_of<T: Words>(value: &Value) -> T {
    match value {
        Value::Choice(word) => T::of_word(word).expect("the table has checked the word"),
        _ => unreachable!("the table has checked the kind"),
    }
}

/// A field by its path: `field!(solver.step)` of a machine.
macro_rules! field {
    ($($path:ident).+) => {
        Field {
            get: |it| FieldValue::to_value(it.$($path).+),
            set: |it, value| it.$($path).+ = FieldValue::of_value(value),
        }
    };
}

/// A field that holds one of the words of an enum, by its path.
macro_rules! word_field {
    ($($path:ident).+) => {
        Field {
            get: |it| Value::Choice(Words::word(it.$($path).+)),
            set: |it, value| it.$($path).+ = word_of(value),
        }
    };
}

pub(super) use {field, word_field};
