//! The numbers of a scene file: each can be changed by its key, and may be an expression of the scene's own parameters.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{LazyLock, Mutex, PoisonError};
use toml::Spanned;
use toml::de::DeValue;

use super::access::file_only;
use super::document::{Node, Section, lists};
use super::expression::{self, Program};
use super::field::Access;
use super::pattern::Copy;
use super::quantity::Quantity;
use super::units::{all_units, parse_quantity, same_unit, split_unit, unit_at_start, unit_within};
use super::*;
use expression::Number as _;

/// A number that the scene was built from.
#[derive(Clone, Debug, PartialEq)]
pub struct FileNumber {
    /// SI.
    pub value: f64,
    /// Its dimension.
    pub dimension: Dimension,
    pub(super) place: Place,
    /// Unit in which the file writes it, or the SI one.
    pub(super) unit: &'static str,
}

/// Where in the scene's text a number is written: a range of bytes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Place {
    /// The number alone.
    Value(Range<usize>),
    /// A vector in one text.
    Part(Range<usize>),
    /// In a file that the scene includes.
    Included,
    /// Nowhere: it has a default, and was changed.
    Absent,
}

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
    /// With these changes.
    pub fn new(changes: &'d [(String, String)]) -> Self {
        let of_the_table = |key: &str| {
            let own = key
                .strip_prefix("joint.")
                .and_then(|key| key.rsplit_once('.'));
            find(key).is_some()
                || own.is_some_and(|(_, part)| find(&format!("contact.{part}")).is_some())
        };
        let numbers = |key: &str| !of_the_table(key) && !file_only(key);
        let changes = changes.iter().filter(|(key, _)| numbers(key));
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
                if program.length() <= 3
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

/// Reads `[[parameter]]`: the scene's own parameters, in the order of the files, in which one may be made of those before it.
///
/// # Errors
/// Anything wrong in one.
pub(super) fn read_own(files: &[Section<'_>]) -> Result<Vec<&'static Parameter>, SceneError> {
    let mut rows: Vec<&'static Parameter> = Vec::new();
    for node in lists(files, "parameter", MOST_OWN, "parameters")? {
        let row = read_row(&node)?;
        if rows.iter().any(|other| other.key == row.key) {
            let name = node.section(&OWN_KEYS)?.require("name", "\"stroke\"")?;
            return Err(name.error("there is already a parameter of this name; names must differ"));
        }
        rows.push(row);
    }
    Ok(rows)
}

/// Most parameters that a file may define.
const MOST_OWN: usize = 1000;
const OWN_KEYS: [&str; 6] = ["name", "label", "value", "unit", "range", "help"];

fn read_row(node: &Node<'_>) -> Result<&'static Parameter, SceneError> {
    let title = node.title("parameter");
    let section = node.section_as(title.clone(), &OWN_KEYS)?;
    let name_node = section.require("name", "\"stroke\"")?;
    let name = name_node.name()?;
    let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let reserved =
        ["i", "pi", "e"].contains(&&*name) || name.starts_with(|c: char| c.is_ascii_digit());
    if reserved || !name.chars().all(letters) {
        return Err(name_node.error(
            "cannot name a parameter, as expressions use it; allowed letters (a to z), digits and `_`, a letter first, but not i, pi or e",
        ));
    }
    let value_node = section.require("value", "\"20 mm\"")?;
    let text = value_node.scalar()?;
    let unit = section.get("unit").map(|node| node.text()).transpose()?;
    // The unit's dimension; without one, that of the value as it is written.
    let wanted = unit.unwrap_or_else(|| split_unit(text));
    let found = all_units().find(|(of, ..)| same_unit(of, wanted));
    let (unit, dimension) = match found {
        Some((unit, dimension, _)) => (unit, dimension),
        None if wanted.is_empty() => ("", Dimension::None),
        None => {
            let (at, key) = match section.get("unit") {
                Some(node) => (node, "unknown unit"),
                None => (
                    value_node,
                    "its unit is not to be seen here: give it with `unit`, for example `unit = \"mm\"`",
                ),
            };
            return Err(at.error(key));
        }
    };
    let value = value_node.retitled(title).quantity(dimension)?;
    let text = |key: &str| section.get(key).map(|node| node.text()).transpose();
    let label = text("label")?.unwrap_or(&name);
    let help = text("help")?.unwrap_or("A parameter of this scene.");
    let range = match section.get("range") {
        None => None,
        Some(node) => {
            let [least, most] = node.quantities::<2>(dimension)?;
            if least >= most {
                return Err(node.error("the first value must be below the second"));
            }
            Some((least, most))
        }
    };
    let row = Row {
        key: format!("parameter.{name}"),
        label: visible_line(label).into_owned(),
        help: visible_line(help).into_owned(),
        dimension,
        unit,
        range: range.unwrap_or((-LARGEST, LARGEST)),
        slider: range.unwrap_or_else(|| around(value)),
        default: value,
    };
    let row = interned(row);
    row.check(&Value::Number(value)).map_err(|error| {
        let node = section
            .require("value", "")
            .map(|node| node.retitled(row.key.to_owned()));
        node.map_or_else(|missing| missing, |node| node.error(error.to_string()))
    })?;
    section.document.reading.own(&name, value, dimension);
    Ok(row)
}

/// Travel of a slider around a value without a range.
fn around(value: f64) -> (f64, f64) {
    match value.total_cmp(&0.0) {
        _ if value == 0.0 => (-1.0, 1.0),
        std::cmp::Ordering::Less => (2.0 * value, 0.0),
        _ => (0.0, 2.0 * value),
    }
}

impl FileNumber {
    /// Written as `text` at `place`.
    pub(super) fn new(value: f64, dimension: Dimension, place: Place, text: &str) -> Self {
        Self {
            value,
            dimension,
            place,
            unit: unit_within(text, dimension).unwrap_or(si_unit(dimension)),
        }
    }

    /// Its row, as that of a parameter. What the reader allows is checked when the scene is read again.
    pub(super) fn row(&self, key: &str) -> &'static Parameter {
        interned(Row {
            key: key.to_owned(),
            label: key.to_owned(),
            help: "A number of the scene file.".to_owned(),
            dimension: self.dimension,
            unit: self.unit,
            range: (-LARGEST, LARGEST),
            slider: around(self.value),
            default: self.value,
        })
    }
}

/// Beyond any number of a scene file: limits are the reader's.
const LARGEST: f64 = 1e13;

/// A row that does not stand in the table.
struct Row {
    key: String,
    label: String,
    help: String,
    dimension: Dimension,
    unit: &'static str,
    range: (f64, f64),
    slider: (f64, f64),
    default: f64,
}

/// Rows live as long as the program, like those of the table: one for each key that was ever asked for, as it was then.
fn interned(row: Row) -> &'static Parameter {
    static ROWS: LazyLock<Mutex<BTreeMap<String, &'static Parameter>>> =
        LazyLock::new(Mutex::default);
    let bits = |(a, b): (f64, f64)| (a.to_bits(), b.to_bits());
    let identity = format!(
        "{} {} {} {:?} {} {:?} {:?} {}",
        row.key,
        row.label,
        row.help,
        row.dimension,
        row.unit,
        bits(row.range),
        bits(row.slider),
        row.default.to_bits(),
    );
    let mut rows = ROWS.lock().unwrap_or_else(PoisonError::into_inner);
    rows.entry(identity).or_insert_with(|| {
        let text = |text: String| -> &'static str { Box::leak(text.into_boxed_str()) };
        Box::leak(Box::new(Parameter {
            key: text(row.key),
            access: Access::Number,
            label: text(row.label),
            group: "Machine",
            kind: Kind::Number {
                dimension: row.dimension,
                min: row.range.0,
                max: row.range.1,
                display: row.unit,
                slider: row.slider,
                logarithmic: false,
            },
            default: Value::Number(row.default),
            scope: Scope::Own,
            at_reset: true,
            help: text(row.help),
            equation: "Wherever the scene file uses it",
        }))
    })
}
