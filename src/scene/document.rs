//! TOML with positions: every value knows its key, line and column, so that every error can name them.

use super::beside::Beside;
use super::copy::Copy as PatternCopy;
use super::error::{brief, line_text, nearest, place_of};
use super::given::{FileNumber, Place};
use super::parameters::{Kind, ValueFault};
use super::reading::Reading;
use super::{Dimension, SceneError, Vec3, find};
use crate::words::Words;
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Largest length, speed, angle, … in SI units that a file may give.
pub(super) const MAX_SI: f64 = 1e6;

/// The text being read, its name in errors, and what its values may refer to.
#[derive(Clone, Copy)]
pub(super) struct Document<'d> {
    pub file: Option<&'d str>,
    pub text: &'d str,
    pub reading: &'d Reading<'d>,
    /// Whether another file includes it.
    pub included: bool,
    /// The copy of a pattern that the values belong to.
    pub copy: Option<&'d PatternCopy>,
    /// Files that it names.
    pub beside: &'d Beside<'d>,
}

/// A table with the path of its keys.
#[derive(Clone)]
pub(super) struct Section<'d> {
    pub document: Document<'d>,
    pub path: String,
    pub table: &'d DeTable<'d>,
    pub span: Range<usize>,
}

/// A value with its key.
#[derive(Clone)]
pub(super) struct Node<'d> {
    pub document: Document<'d>,
    pub key: String,
    pub value: &'d Spanned<DeValue<'d>>,
    /// Where the text gives a value, and whether it is not this one: a change came after it.
    written: Option<Range<usize>>,
    changed: bool,
}

impl<'d> Document<'d> {
    /// Its text as TOML.
    ///
    /// # Errors
    /// Where it is none.
    pub fn parse(&self) -> Result<Spanned<DeTable<'d>>, SceneError> {
        DeTable::parse(self.text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            let message = format!("not valid TOML: {}", error.message());
            self.error(span, "", None, message)
        })
    }

    /// An error at a position in the text.
    pub fn error(
        &self,
        span: Range<usize>,
        key: &str,
        value: Option<&str>,
        message: impl Into<String>,
    ) -> SceneError {
        let (line, column) = place_of(self.text, span.start);
        let mut error = SceneError::about(key, value, message);
        if key.is_empty() {
            error.key = None;
        }
        error.file = self.file.map(str::to_owned);
        error.position = Some((line, column));
        error.line_text = line_text(self.text, line);
        error
    }

    /// The text of a value, truncated to fit on a line.
    pub fn excerpt(&self, span: Range<usize>) -> String {
        brief(self.text.get(span).unwrap_or(""))
    }
}

impl<'d> Section<'d> {
    /// A table whose keys are all among `known`.
    pub fn new(
        document: Document<'d>,
        path: String,
        table: &'d DeTable<'d>,
        span: Range<usize>,
        known: &[&str],
    ) -> Result<Self, SceneError> {
        let section = Self {
            document,
            path,
            table,
            span,
        };
        let unknown = table
            .keys()
            .filter(|key| !known.contains(&key.get_ref().as_ref()))
            .min_by_key(|key| key.span().start);
        match unknown {
            None => Ok(section),
            Some(key) => {
                let near = nearest(key.get_ref(), known.iter().copied());
                let message = format!("unknown key{near}; allowed here: {}", known.join(", "));
                Err(document.error(key.span(), &section.key(key.get_ref()), None, message))
            }
        }
    }

    /// Full path of a key in this table.
    pub fn key(&self, name: &str) -> String {
        if self.path.is_empty() {
            name.to_owned()
        } else {
            format!("{}.{name}", self.path)
        }
    }

    /// An optional value.
    pub fn get(&self, name: &str) -> Option<Node<'d>> {
        Node::new(self.document, self.key(name), self.table.get(name))
    }

    /// A required value; `like` is an example of one.
    pub fn require(&self, name: &str, like: &str) -> Result<Node<'d>, SceneError> {
        self.get(name).ok_or_else(|| {
            self.error(
                name,
                format!("missing; write for example `{name} = {like}`"),
            )
        })
    }

    /// Byte offset of this table in the text.
    pub fn place(&self) -> usize {
        self.span.start
    }

    /// An error about this table as a whole, or about a missing key.
    pub fn error(&self, name: &str, message: impl Into<String>) -> SceneError {
        let key = if name.is_empty() {
            self.path.clone()
        } else {
            self.key(name)
        };
        self.document.error(self.span.clone(), &key, None, message)
    }

    /// Rejects a key that makes no sense here.
    pub fn refuse(&self, name: &str, why: &str) -> Result<(), SceneError> {
        self.get(name).map_or(Ok(()), |node| {
            Err(node.error(format!("not allowed here: {why}")))
        })
    }
}

impl<'d> Node<'d> {
    /// What `key` stands for: its change if there is one, else the value in the text, if any.
    fn new(
        document: Document<'d>,
        key: String,
        written: Option<&'d Spanned<DeValue<'d>>>,
    ) -> Option<Self> {
        let change = document.reading.change(&key);
        Some(Self {
            document,
            key,
            value: change.or(written)?,
            written: written.map(Spanned::span),
            changed: change.is_some(),
        })
    }

    /// The same value under another key.
    pub fn retitled(&self, key: String) -> Self {
        let written = self.written.is_some().then_some(self.value);
        Self::new(self.document, key, written).unwrap_or_else(|| self.clone())
    }

    /// Byte offset of this value in the text.
    pub fn place(&self) -> usize {
        self.value.span().start
    }

    /// An error about this value.
    pub fn error(&self, message: impl Into<String>) -> SceneError {
        if self.changed {
            let value = self.scalar().unwrap_or_default();
            return SceneError::about(&self.key, Some(&brief(value)), message);
        }
        let span = self.value.span();
        self.document.error(
            span.clone(),
            &self.key,
            Some(&self.document.excerpt(span)),
            message,
        )
    }

    fn wrong_type(&self, wanted: &str) -> SceneError {
        self.error(format!(
            "must be {wanted}, not {} {}",
            article(self.value.get_ref()),
            self.value.get_ref().type_str()
        ))
    }

    /// A number or a text, as written.
    pub fn scalar(&self) -> Result<&'d str, SceneError> {
        match self.value.get_ref() {
            DeValue::String(text) => Ok(text),
            DeValue::Float(number) => Ok(number.as_str()),
            DeValue::Integer(number) if number.radix() == 10 => Ok(number.as_str()),
            _ => Err(self.wrong_type("a number or a text")),
        }
    }

    /// A text.
    pub fn text(&self) -> Result<&'d str, SceneError> {
        self.value
            .get_ref()
            .as_str()
            .ok_or_else(|| self.wrong_type("a text in quotes"))
    }

    /// A boolean.
    pub fn flag(&self) -> Result<bool, SceneError> {
        self.value
            .get_ref()
            .as_bool()
            .ok_or_else(|| self.wrong_type("true or false"))
    }

    /// A finite quantity, SI: a number with its unit, or an expression. From now on it is a number of the scene, under this key.
    pub fn quantity(&self, dimension: Dimension) -> Result<f64, SceneError> {
        let place = self.place_of(Place::Value);
        self.number(self.scalar()?, dimension, place)
    }

    /// Where the scene's text gives this value.
    fn place_of(&self, here: fn(Range<usize>) -> Place) -> Place {
        match &self.written {
            _ if self.document.included => Place::Included,
            Some(written) => here(written.clone()),
            None => Place::Absent,
        }
    }

    /// The quantity `text`, at `place`, as [`Self::quantity`].
    fn number(&self, text: &str, dimension: Dimension, place: Place) -> Result<f64, SceneError> {
        let reading = self.document.reading;
        let value = reading
            .evaluate(text, dimension, self.document.copy)
            .map_err(|message| self.error(message))?;
        self.limit(value, dimension)?;
        reading.record(&self.key, FileNumber::new(value, dimension, place, text));
        Ok(value)
    }

    /// Rejects values beyond any mechanism, before their squares overflow in the equations of motion.
    fn limit(&self, value: f64, dimension: Dimension) -> Result<(), SceneError> {
        let moves = !matches!(
            dimension,
            Dimension::Mass
                | Dimension::Density
                | Dimension::Inertia
                | Dimension::Stress
                | Dimension::Force
                | Dimension::Torque
                | Dimension::Stiffness
                | Dimension::Damping
                | Dimension::TurningStiffness
                | Dimension::TurningDamping
        );
        if moves && value.abs() > MAX_SI {
            let limit = super::format_quantity(MAX_SI, super::si_unit(dimension));
            return Err(self.error(format!("out of range; allowed -{limit} to {limit}")));
        }
        Ok(())
    }

    /// A quantity above 0 and at most `max` (SI, shown in `unit`).
    pub fn positive(&self, dimension: Dimension, max: f64, unit: &str) -> Result<f64, SceneError> {
        let value = self.quantity(dimension)?;
        if value > 0.0 && value <= max {
            return Ok(value);
        }
        let units = super::unit_names(dimension).join(", ");
        let top = super::format_quantity(max, unit);
        Err(self.error(format!(
            "out of range; allowed above 0 up to {top}; units {units}"
        )))
    }

    /// A quantity in a closed range, SI.
    pub fn within(&self, dimension: Dimension, range: (f64, f64)) -> Result<f64, SceneError> {
        let value = self.quantity(dimension)?;
        let (least, most) = range;
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        let unit = super::si_unit(dimension);
        let mut allowed = format!(
            "out of range; allowed {} to {}",
            super::format_quantity(least, unit),
            super::format_quantity(most, unit)
        );
        if !unit.is_empty() {
            allowed += &format!("; units {}", super::unit_names(dimension).join(", "));
        }
        Err(self.error(allowed))
    }

    /// One of some words.
    pub fn choice(&self, words: &[&'static str]) -> Result<&'static str, SceneError> {
        let text = self.text()?;
        let found = words.iter().copied().find(|word| *word == text);
        found.ok_or_else(|| {
            let near = nearest(text, words.iter().copied());
            self.error(format!(
                "is not one of the choices{near}; allowed {}",
                words.join(", ")
            ))
        })
    }

    /// One of an enum's words.
    pub fn word<T: Words>(&self) -> Result<T, SceneError> {
        let word = self.choice(T::WORDS)?;
        Ok(T::of_word(word).expect("one of its words"))
    }

    /// A name: letters, digits, `_` and `-`, as keys and column names are built from it; in a copy of a pattern, numbered.
    pub fn name(&self) -> Result<Cow<'d, str>, SceneError> {
        let name = self.text()?;
        let fine = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        if !name.is_empty() && name.len() <= 40 && name.chars().all(fine) {
            return Ok(self.numbered(name));
        }
        Err(self.error("is not a name; allowed 1 to 40 letters (a to z), digits, `_` and `-`"))
    }

    /// The name of a body: in a copy of a pattern that has this body, that of the copy.
    pub fn body(&self) -> Result<Cow<'d, str>, SceneError> {
        let name = self.text()?;
        let copy = self.document.copy;
        Ok(copy.map_or(Cow::Borrowed(name), |copy| copy.body(name)))
    }

    /// The name of a joint, as [`Self::body`].
    pub fn joint(&self) -> Result<Cow<'d, str>, SceneError> {
        let name = self.text()?;
        let copy = self.document.copy;
        Ok(copy.map_or(Cow::Borrowed(name), |copy| copy.joint(name)))
    }

    fn numbered(&self, name: &'d str) -> Cow<'d, str> {
        match self.document.copy {
            Some(copy) => Cow::Owned(copy.name(name)),
            None => Cow::Borrowed(name),
        }
    }

    /// The elements of an array of at most `most`; `what` names them in errors. As [`Self::elements`].
    pub fn elements_up_to(&self, most: usize, what: &str) -> Result<Vec<Node<'d>>, SceneError> {
        let elements = self.elements()?;
        match elements.get(most) {
            None => Ok(elements),
            Some(first) => Err(self.document.error(
                first.value.span(),
                &first.key,
                None,
                format!(
                    "too many: {} {what}; allowed at most {most}",
                    elements.len()
                ),
            )),
        }
    }

    /// The elements of an array, keyed `key[0]`, `key[1]`, …
    pub fn elements(&self) -> Result<Vec<Node<'d>>, SceneError> {
        let array = self
            .value
            .get_ref()
            .as_array()
            .ok_or_else(|| self.wrong_type("an array"))?;
        let node = |(index, value)| {
            Node::new(self.document, format!("{}[{index}]", self.key), Some(value))
        };
        Ok(array.iter().enumerate().filter_map(node).collect())
    }

    /// N quantities: `["1 mm", 0, "3 mm"]`, or with a common unit, `"1 0 3 mm"`. Each is a number of the scene, with the letter
    /// of its component for its key where there are three or four.
    pub fn quantities<const N: usize>(&self, dimension: Dimension) -> Result<[f64; N], SceneError> {
        let letters = match N {
            3 => "xyz",
            4 => "wxyz",
            _ => "",
        };
        let key = |index: usize| match letters.get(index..=index) {
            Some(letter) => format!("{}.{letter}", self.key),
            None => format!("{}[{index}]", self.key),
        };
        let mut values = [0.0; N];
        if let Some(text) = self.value.get_ref().as_str() {
            let words: Vec<&str> = text.split_whitespace().collect();
            let count = words
                .iter()
                .take_while(|word| word.parse::<f64>().is_ok())
                .count();
            if count != N {
                return Err(self.error(format!(
                    "needs {N} numbers, then one unit for all; has {count} numbers"
                )));
            }
            let (numbers, unit) = words.split_at(N);
            let unit = unit.join(" ");
            for (index, (value, number)) in values.iter_mut().zip(numbers).enumerate() {
                let part = Node::new(self.document, key(index), Some(self.value));
                let part = part.expect("there is a value");
                let place = self.place_of(Place::Part);
                *value = if part.changed {
                    part.number(part.scalar()?, dimension, place)?
                } else {
                    part.number(&format!("{number} {unit}"), dimension, place)?
                };
            }
            return Ok(values);
        }
        let elements = self.elements()?;
        if elements.len() != N {
            return Err(self.error(format!("needs {N} values, has {}", elements.len())));
        }
        for (index, (value, element)) in values.iter_mut().zip(&elements).enumerate() {
            let part = Node::new(self.document, key(index), Some(element.value));
            *value = part.expect("there is a value").quantity(dimension)?;
        }
        Ok(values)
    }

    /// A vector with a dimension, SI.
    pub fn vector(&self, dimension: Dimension) -> Result<Vec3, SceneError> {
        self.quantities::<3>(dimension).map(Vec3::from)
    }

    /// A direction, normalised.
    pub fn direction(&self) -> Result<Vec3, SceneError> {
        let vector = self.vector(Dimension::None)?;
        // Scaled first: squares of huge or tiny components would leave the range of f64.
        let size = vector.amax();
        if size > 0.0 {
            Ok((vector / size).normalize())
        } else {
            Err(self.error("a direction must not be zero"))
        }
    }

    /// A table whose keys are all among `known`.
    pub fn section(&self, known: &[&str]) -> Result<Section<'d>, SceneError> {
        self.section_as(self.key.clone(), known)
    }

    /// As [`Self::section`], with a different path for its keys.
    pub fn section_as(&self, path: String, known: &[&str]) -> Result<Section<'d>, SceneError> {
        let table = self
            .value
            .get_ref()
            .as_table()
            .ok_or_else(|| self.wrong_type("a table"))?;
        Section::new(self.document, path, table, self.value.span(), known)
    }

    /// Checks the word that the key `name` of a table selects, if present: it determines which other keys are allowed, so a
    /// wrong word must be reported before any of those.
    pub fn check_word<T: Words>(&self, path: &str, name: &str) -> Result<(), SceneError> {
        let node = self.peek(path, name);
        node.map_or(Ok(()), |node| node.word::<T>().map(|_| ()))
    }

    /// Value of the key `name` of a table whose keys have the path `path`, if it is a table with such a key.
    pub fn peek(&self, path: &str, name: &str) -> Option<Node<'d>> {
        Some(Node {
            document: self.document,
            key: format!("{path}.{name}"),
            value: self.value.get_ref().as_table()?.get(name)?,
            written: None,
            changed: false,
        })
    }

    /// Value of the table's `name` key, for the paths of its keys; the array index if there is none yet.
    pub fn title(&self, prefix: &str) -> String {
        let name = self
            .value
            .get_ref()
            .get("name")
            .and_then(|name| name.get_ref().as_str());
        let title = |name| format!("{prefix}.{}", self.numbered(name));
        name.map_or_else(|| self.key.clone(), title)
    }

    /// A parameter's value, read and checked against its row of the table.
    pub fn parameter(&self, key: &str) -> Result<super::Value, SceneError> {
        let parameter = find(key).expect("only keys of the table are asked for");
        // A count or a pure number may be written bare; text and bare numbers read alike.
        let text = self.scalar()?;
        let (read, Kind::Number { dimension, .. }) = (parameter.read(text), parameter.kind) else {
            let read = parameter.read(text);
            return read.map_err(|error| self.error(error.to_string()));
        };
        match read {
            Err(error) if matches!(error.fault, ValueFault::Quantity(_)) => {
                // No quantity: an expression, perhaps.
                let value = self
                    .document
                    .reading
                    .evaluate(text, dimension, self.document.copy);
                let value = value.map_err(|why| self.error(format!("{why}; {}", error.allowed)))?;
                let value = super::Value::Number(value);
                let checked = parameter.check(&value);
                checked.map_err(|error| self.error(error.to_string()))?;
                Ok(value)
            }
            read => read.map_err(|error| self.error(error.to_string())),
        }
    }
}

/// Entries of the list `name` of all `files`, at most `most`; `what` names them in errors.
///
/// # Errors
/// No list, or too many entries.
pub(super) fn lists<'d>(
    files: &[Section<'d>],
    name: &str,
    most: usize,
    what: &str,
) -> Result<Vec<Node<'d>>, SceneError> {
    let mut nodes = Vec::new();
    for file in files {
        if let Some(list) = file.get(name) {
            let first = nodes.len();
            nodes.extend(list.elements_up_to(most, what)?);
            // Counted through all files.
            for (index, node) in nodes.iter_mut().enumerate().skip(first) {
                node.key = format!("{name}[{index}]");
            }
        }
    }
    match nodes.get(most) {
        None => Ok(nodes),
        Some(first) => Err(first.error(format!(
            "too many: {} {what} in all files; allowed at most {most}",
            nodes.len()
        ))),
    }
}

fn article(value: &DeValue<'_>) -> &'static str {
    if value.is_integer() || value.is_array() {
        "an"
    } else {
        "a"
    }
}
