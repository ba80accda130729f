//! TOML with positions: every value knows its key, line and column, so that every error can name them.

use super::assets::AssetResolver;
use super::error::place_of;
use super::file_number::{FileNumber, Place};
use super::instance::Instance;
use super::key::{ABOVE_ZERO, ANY, DefaultRule, FileKey, FileTable, ListLimit, MAX_SI, UNCHECKED, ValueType, Variants};
use super::parameters::{Kind, ValueFault};
use super::reading::Reading;
use super::visible::visible_line;
use super::{Dimension, SceneError, Vec3, find, format_quantity, si_unit, unit_names};
use jointplay_physics::suggest::{brief, nearest};
use jointplay_physics::units::{all_units, same_unit, split_unit};
use jointplay_physics::words::Words;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The text being read, its name in errors, and the context of its values.
#[derive(Clone, Copy)]
pub(super) struct Document<'d> {
    pub file: Option<&'d str>,
    pub text: &'d str,
    pub reading: &'d Reading<'d>,
    /// How another file includes it, if one does.
    pub include: Option<&'d Inclusion<'d>>,
    /// Innermost group that the values belong to, if any.
    pub instance: Option<&'d Instance<'d>>,
    /// Whether the values belong to a hinge, which changes some dimensions.
    pub on_hinge: bool,
    /// Resolver of the files it names.
    pub assets: &'d AssetResolver<'d>,
}

/// How a scene includes a file: the values that it passes to the file's parameters, by their names in the file.
#[derive(Default)]
pub(super) struct Inclusion<'d> {
    pub values: BTreeMap<&'d str, Node<'d>>,
}

/// A table with the path of its keys.
#[derive(Clone)]
pub(super) struct Section<'d> {
    pub document: Document<'d>,
    pub path: String,
    pub table: &'d DeTable<'d>,
    pub span: Range<usize>,
    /// Rows of its allowed keys.
    pub rows: &'static FileTable,
    /// Selected variant of the table.
    pub word: Option<&'static str>,
}

/// A value with its key.
#[derive(Clone)]
pub(super) struct Node<'d> {
    pub document: Document<'d>,
    pub key: String,
    /// Row of the key; for a list entry, the row of the list.
    pub row: &'static FileKey,
    pub value: &'d Spanned<DeValue<'d>>,
    /// Byte range of the value in the text, if any, and whether a change replaces it.
    written: Option<Range<usize>>,
    changed: bool,
}

impl<'d> Document<'d> {
    /// Parses the text as TOML.
    ///
    /// # Errors
    /// Invalid TOML.
    pub fn parse(&self) -> Result<Spanned<DeTable<'d>>, SceneError> {
        DeTable::parse(self.text).map_err(|error| {
            let span = error.span().unwrap_or(0..0);
            let from = self.text[..span.start].rfind('\n').map_or(0, |at| at + 1);
            let line = self.text[from..].lines().next().unwrap_or_default();
            let message = match unquoted(line) {
                Some(quantity) => format!("a number with a unit is a text: \"{quantity}\", in quotes"),
                None => format!("not valid TOML: {}", error.message()),
            };
            self.error(span, "", None, message)
        })
    }

    /// An error at a position in the text.
    pub fn error(&self, span: Range<usize>, key: &str, value: Option<&str>, message: impl Into<String>) -> SceneError {
        let key = Some(key).filter(|key| !key.is_empty());
        SceneError::in_text(self.file, self.text, span.start, key, value, message)
    }

    /// The text of a value, truncated to fit on a line.
    pub fn excerpt(&self, span: Range<usize>) -> String {
        brief(self.text.get(span).unwrap_or(""))
    }
}

/// The value in `line`, if it is a number with a unit but without quotes.
fn unquoted(line: &str) -> Option<&str> {
    let value = line.split_once('=')?.1.split('#').next()?.trim();
    let (unit, number) = (split_unit(value), value.trim_end_matches(split_unit(value)));
    let known = all_units().any(|(of, ..)| same_unit(of, unit));
    (!unit.is_empty() && known && number.trim().parse::<f64>().is_ok()).then_some(value)
}

impl<'d> Section<'d> {
    /// A table of the file; `rows` describes its allowed keys.
    ///
    /// # Errors
    /// The word that selects its variant is missing or wrong, or a key is not allowed.
    pub fn new(
        document: Document<'d>,
        path: String,
        table: &'d DeTable<'d>,
        span: Range<usize>,
        rows: &'static FileTable,
    ) -> Result<Self, SceneError> {
        let mut section = Self { document, path, table, span, rows, word: None };
        // Words come first: one may select the variant, and thus the allowed keys.
        for key in rows.keys {
            if let (ValueType::Word(_), Some(node)) = (key.value_type, section.get(key.name)) {
                let word = node.choice()?;
                if matches!(rows.variants, Some(Variants::Word(by, _)) if by == key.name) {
                    section.word = Some(word);
                }
            }
        }
        if let Some(Variants::Presence(words)) = rows.variants {
            let mut given = words.iter().filter(|word| section.get(word).is_some());
            section.word = given.next().copied().filter(|_| given.next().is_none());
        }
        let known: Vec<&str> = rows.of(section.word).map(|key| key.name).collect();
        let unknown = table
            .iter()
            .filter(|(key, _)| !known.contains(&key.get_ref().as_ref()))
            .min_by_key(|(key, _)| key.span().start);
        if let Some((key, _)) = unknown {
            return Err(section.unknown_key(key, &known));
        }
        if let (Some(Variants::Word(by, _)), None) = (rows.variants, section.word) {
            section.require(by)?;
        }
        Ok(section)
    }

    /// The error for a key that is not among the `known` ones.
    fn unknown_key(&self, key: &Spanned<Cow<'_, str>>, known: &[&str]) -> SceneError {
        let name = key.get_ref();
        if let (Some(Variants::Word(_, one)), Some(word)) = (self.rows.variants, self.word)
            && let (false, Some(node)) = (one.is_empty(), self.find(name))
        {
            let own = self.rows.of(self.word).filter(|key| !key.of.is_empty());
            let own: Vec<&str> = own.map(|key| key.name).collect();
            let rows = self.rows.keys.iter().filter(|key| key.name == name);
            let words: Vec<&str> = rows.flat_map(|key| key.of).copied().collect();
            let (one, its) = (one.replace("{}", word), one.replace("{}", &words.join(" or ")));
            return node.error(format!("not allowed here: a {one} has {}; a {its} has `{name}`", own.join(", ")));
        }
        let near = nearest(name, known.iter().copied());
        let message = format!("unknown key{near}; allowed here: {}", known.join(", "));
        let document = self.document;
        document.error(key.span(), &self.key(name), None, message)
    }

    /// Full path of a key in this table.
    pub fn key(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }

    /// An optional value.
    pub fn get(&self, name: &str) -> Option<Node<'d>> {
        debug_assert!(self.rows.key(name, None).is_some(), "no row for `{name}` in the table `{}`", self.rows.name);
        self.find(name)
    }

    /// The change of the key `name` of the absent table `table`.
    pub fn change(&self, table: &str, name: &str) -> Option<Node<'d>> {
        let row = self.rows.key(table, None)?.table()?.key(name, None)?;
        Node::new(self.document, format!("{table}.{name}"), row, None)
    }

    /// The value of a key, if present and with a row.
    fn find(&self, name: &str) -> Option<Node<'d>> {
        let row = self.rows.key(name, self.word)?;
        Node::new(self.document, self.key(name), row, self.table.get(name))
    }

    /// A required value.
    pub fn require(&self, name: &str) -> Result<Node<'d>, SceneError> {
        self.get(name).ok_or_else(|| {
            let row = self.rows.key(name, self.word);
            let example = row.map_or("", |row| row.example(self.document.on_hinge));
            self.error(name, format!("missing; write for example `{name} = {example}`"))
        })
    }

    /// Default of a key, if it is a number.
    fn default(&self, name: &str) -> Option<f64> {
        match self.rows.key(name, self.word)?.default {
            DefaultRule::Number(number) => Some(number),
            _ => None,
        }
    }

    /// A number with the dimension, range and default of its row, SI.
    pub fn number(&self, name: &str) -> Result<f64, SceneError> {
        match (self.get(name), self.default(name)) {
            (None, Some(default)) => Ok(default),
            _ => self.require(name)?.number(),
        }
    }

    /// A vector with the dimension, range and default of its row, SI.
    pub fn vector(&self, name: &str) -> Result<Vec3, SceneError> {
        match (self.get(name), self.default(name)) {
            (None, Some(default)) => Ok(Vec3::repeat(default)),
            _ => self.require(name)?.vector(),
        }
    }

    /// Byte offset of this table in the text.
    pub fn offset(&self) -> usize {
        self.span.start
    }

    /// An error about this table as a whole, or about a missing key.
    pub fn error(&self, name: &str, message: impl Into<String>) -> SceneError {
        let key = if name.is_empty() { self.path.clone() } else { self.key(name) };
        self.document.error(self.span.clone(), &key, None, message)
    }

    /// Rejects a key that is not allowed here.
    pub fn refuse(&self, name: &str, why: &str) -> Result<(), SceneError> {
        self.get(name).map_or(Ok(()), |node| Err(node.error(format!("not allowed here: {why}"))))
    }
}

impl<'d> Node<'d> {
    /// The value of `key`: its change if there is one, else the value in the text, if any.
    fn new(
        document: Document<'d>,
        key: String,
        row: &'static FileKey,
        written: Option<&'d Spanned<DeValue<'d>>>,
    ) -> Option<Self> {
        let change = document.reading.change(&key);
        Some(Self {
            document,
            key,
            row,
            value: change.or(written)?,
            written: written.map(Spanned::span),
            changed: change.is_some(),
        })
    }

    /// The same value under another key.
    pub fn with_key(&self, key: String) -> Self {
        let written = self.written.is_some().then_some(self.value);
        Self::new(self.document, key, self.row, written).unwrap_or_else(|| self.clone())
    }

    /// Byte offset of this value in the text.
    pub fn offset(&self) -> usize {
        self.value.span().start
    }

    /// An error about this value.
    pub fn error(&self, message: impl Into<String>) -> SceneError {
        if self.changed {
            let value = self.scalar().unwrap_or_default();
            return SceneError::about(&self.key, Some(&brief(value)), message);
        }
        let span = self.value.span();
        self.document.error(span.clone(), &self.key, Some(&self.document.excerpt(span)), message)
    }

    /// The error for a second `what` with the `name` of `first`.
    pub fn duplicate_error(&self, first: &Self, what: &str, name: &str) -> SceneError {
        let (line, _) = place_of(first.document.text, first.offset());
        let file = first.document.file.filter(|_| first.document.file != self.document.file);
        let of_file = file.map_or_else(String::new, |file| format!(" of {}", visible_line(file)));
        self.error(format!(
            "there is already a {what} of this name, in line {line}{of_file}; names must differ, for example `{name}2`"
        ))
    }

    fn wrong_type(&self, expected: &str) -> SceneError {
        self.error(format!(
            "must be {expected}, not {} {}",
            article(self.value.get_ref()),
            self.value.get_ref().type_str()
        ))
    }

    /// A number or a string, as written.
    pub fn scalar(&self) -> Result<&'d str, SceneError> {
        match self.value.get_ref() {
            DeValue::String(text) => Ok(text),
            DeValue::Float(number) => Ok(number.as_str()),
            DeValue::Integer(number) if number.radix() == 10 => Ok(number.as_str()),
            _ => Err(self.wrong_type("a number or a text")),
        }
    }

    /// A string.
    pub fn text(&self) -> Result<&'d str, SceneError> {
        self.value.get_ref().as_str().ok_or_else(|| self.wrong_type("a text in quotes"))
    }

    /// A boolean.
    pub fn flag(&self) -> Result<bool, SceneError> {
        // A change is a text.
        let changed = self.value.get_ref().as_str().filter(|_| self.changed).and_then(|text| text.parse().ok());
        self.value.get_ref().as_bool().or(changed).ok_or_else(|| self.wrong_type("true or false"))
    }

    /// A finite quantity, SI: a number with its unit, or an expression. It is recorded as a number of the scene under this key.
    pub fn quantity(&self, dimension: Dimension) -> Result<f64, SceneError> {
        self.quantity_in(dimension, UNCHECKED)
    }

    /// As [`Self::quantity`], recorded with the range that its reader allows.
    fn quantity_in(&self, dimension: Dimension, range: (f64, f64)) -> Result<f64, SceneError> {
        let place = self.place_of(Place::Value);
        self.evaluate_text(self.scalar()?, dimension, range, place)
    }

    /// Location of this value in the scene's text.
    fn place_of(&self, in_text: fn(Range<usize>) -> Place) -> Place {
        match &self.written {
            _ if self.document.include.is_some() => Place::Included,
            Some(written) => in_text(written.clone()),
            None => Place::ChangedDefault,
        }
    }

    /// Evaluates and records the quantity `text` at `place`, like [`Self::quantity_in`].
    fn evaluate_text(
        &self,
        text: &str,
        dimension: Dimension,
        (least, most): (f64, f64),
        place: Place,
    ) -> Result<f64, SceneError> {
        let reading = self.document.reading;
        let value =
            reading.evaluate(text, dimension, self.document.instance).map_err(|error| self.error(error.to_string()))?;
        self.limit(value, dimension)?;
        let any = if enters_squared(dimension) { ANY } else { UNCHECKED };
        let range = (least.max(any.0), most.min(any.1));
        reading.record(&self.key, FileNumber::new(value, dimension, range, place, text));
        Ok(value)
    }

    /// Rejects values beyond any mechanism, before their squares overflow in the equations of motion.
    fn limit(&self, value: f64, dimension: Dimension) -> Result<(), SceneError> {
        if enters_squared(dimension) && value.abs() > MAX_SI {
            let limit = format_quantity(MAX_SI, si_unit(dimension));
            return Err(self.error(format!("out of range; allowed -{limit} to {limit}")));
        }
        Ok(())
    }

    /// A quantity with the dimension and range of its row, SI.
    pub fn number(&self) -> Result<f64, SceneError> {
        self.within(self.dimension(), self.row.range())
    }

    /// A quantity in a closed range, SI.
    pub fn within(&self, dimension: Dimension, (least, most): (f64, f64)) -> Result<f64, SceneError> {
        let value = self.quantity_in(dimension, (least, most))?;
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        let unit = si_unit(dimension);
        let mut allowed = match format_quantity(most, unit) {
            top if least == ABOVE_ZERO => format!("out of range; allowed above 0 up to {top}"),
            top => {
                let bottom = format_quantity(least, unit);
                format!("out of range; allowed {bottom} to {top}")
            }
        };
        if !unit.is_empty() {
            allowed += &format!("; units {}", unit_names(dimension).join(", "));
        }
        Err(self.error(allowed))
    }

    /// Example value from its row.
    pub fn example(&self) -> &'static str {
        self.row.example(self.document.on_hinge)
    }

    /// Dimension of its numbers, from its row.
    pub fn dimension(&self) -> Dimension {
        let dimension = self.row.dimension(self.document.on_hinge);
        dimension.unwrap_or(Dimension::None)
    }

    /// A whole number in the range of its row: a number or an expression.
    pub fn whole_number(&self) -> Result<u32, SceneError> {
        let (least, most) = match self.row.value_type {
            ValueType::Whole(least, most) => (least, most),
            _ => (0, u32::MAX),
        };
        let allowed = format!("allowed {least} to {most}; a whole number, no unit");
        let number = self.document.reading.evaluate(self.scalar()?, Dimension::None, self.document.instance);
        let number = number.map_err(|why| self.error(format!("{why}; {allowed}")))?;
        if number.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(&number) {
            return Ok(number as u32);
        }
        Err(self.error(format!("out of range; {allowed}")))
    }

    /// One of the words of its row.
    pub fn choice(&self) -> Result<&'static str, SceneError> {
        let words = match self.row.value_type {
            ValueType::Word(words) | ValueType::Words(words, _) => words,
            _ => &[],
        };
        let text = self.text()?;
        let found = words.iter().copied().find(|word| *word == text);
        found.ok_or_else(|| {
            let near = nearest(text, words.iter().copied());
            self.error(format!("is not one of the choices{near}; allowed {}", words.join(", ")))
        })
    }

    /// An enum variant by its word; the row lists the enum's words.
    pub fn word<T: Words>(&self) -> Result<T, SceneError> {
        let word = self.choice()?;
        Ok(T::of_word(word).expect("the row has the words of the enum"))
    }

    /// A name: letters, digits, `_` and `-`, because keys and column names are built from it. The result is
    /// the full name, with the number of a pattern copy and the prefix of an included file.
    pub fn name(&self) -> Result<Cow<'d, str>, SceneError> {
        let name = self.text()?;
        let is_allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
        if !name.is_empty() && name.len() <= 40 && name.chars().all(is_allowed) {
            return Ok(self.full(name));
        }
        Err(self.error("is not a name; allowed 1 to 40 letters (a to z), digits, `_` and `-`"))
    }

    /// The name of `what`, such as a parameter, as it stands in expressions.
    pub fn identifier(&self, what: &str) -> Result<&'d str, SceneError> {
        let name = self.text()?;
        let is_allowed = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let reserved = ["i", "pi", "e", "t"].contains(&name)
            || all_units().any(|(unit, ..)| unit == name)
            || !name.starts_with(|c: char| is_allowed(c) && !c.is_ascii_digit());
        if reserved || name.len() > 40 || !name.chars().all(is_allowed) {
            return Err(self.error(format!(
                "cannot name {what}, as expressions use it; allowed letters (a to z), digits and `_`, a letter first, but not i, \
                 pi, e, t or a unit"
            )));
        }
        Ok(name)
    }

    /// The full name of a body: with the number of the pattern copy, and the prefix of the included file, that it belongs to.
    pub fn body(&self) -> Result<Cow<'d, str>, SceneError> {
        let name = self.text()?;
        Ok(self.document.instance.map_or(Cow::Borrowed(name), |instance| instance.body(name)))
    }

    /// The full name of a joint, like [`Self::body`].
    pub fn joint(&self) -> Result<Cow<'d, str>, SceneError> {
        let name = self.text()?;
        Ok(self.document.instance.map_or(Cow::Borrowed(name), |instance| instance.joint(name)))
    }

    /// Full name of a part that the text here calls `name`.
    fn full(&self, name: &'d str) -> Cow<'d, str> {
        match self.document.instance {
            Some(instance) => Cow::Owned(instance.name(name)),
            None => Cow::Borrowed(name),
        }
    }

    /// The values of a table whose keys are arbitrary names.
    pub fn named_values(&self) -> Result<BTreeMap<&'d str, Node<'d>>, SceneError> {
        let table = self.value.get_ref().as_table().ok_or_else(|| self.wrong_type("a table"))?;
        let node = |(name, value): (&'d Spanned<Cow<'d, str>>, &'d Spanned<DeValue<'d>>)| {
            let name = &**name.get_ref();
            Some((name, Node::new(self.document, format!("{}.{name}", self.key), self.row, Some(value))?))
        };
        Ok(table.iter().filter_map(node).collect())
    }

    /// The entries of a list, like [`Self::elements`], limited in number by its row.
    pub fn entries(&self) -> Result<Vec<Node<'d>>, SceneError> {
        let elements = self.elements()?;
        let Some(ListLimit { max, entries }) = self.row.list_limit() else {
            return Ok(elements);
        };
        match elements.get(max) {
            None => Ok(elements),
            Some(first) => Err(self.document.error(
                first.value.span(),
                &first.key,
                None,
                format!("too many: {} {entries}; allowed at most {max}", elements.len()),
            )),
        }
    }

    /// The elements of an array, keyed `key[0]`, `key[1]`, …
    pub fn elements(&self) -> Result<Vec<Node<'d>>, SceneError> {
        let array = self.value.get_ref().as_array().ok_or_else(|| self.wrong_type("an array"))?;
        let node = |(index, value)| {
            let key = format!("{}[{index}]", self.key);
            Node::new(self.document, key, self.row, Some(value))
        };
        Ok(array.iter().enumerate().filter_map(node).collect())
    }

    /// N quantities: `["1 mm", 0, "3 mm"]`, or with a common unit, `"1 0 3 mm"`. Each is recorded as a number of the scene; with
    /// three or four, its key ends in the letter of the component.
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
            let count = words.iter().take_while(|word| word.parse::<f64>().is_ok()).count();
            if count != N {
                return Err(self.error(format!("needs {N} numbers, then one unit for all; has {count} numbers")));
            }
            let (numbers, unit) = words.split_at(N);
            let unit = unit.join(" ");
            for (index, (value, number)) in values.iter_mut().zip(numbers).enumerate() {
                let part = Node::new(self.document, key(index), self.row, Some(self.value));
                let part = part.expect("there is a value");
                let place = self.place_of(Place::Part);
                let text = if part.changed { part.scalar()?.to_owned() } else { format!("{number} {unit}") };
                *value = part.evaluate_text(&text, dimension, self.row.range(), place)?;
            }
            return Ok(values);
        }
        let elements = self.elements()?;
        if elements.len() != N {
            return Err(self.error(format!("needs {N} values, has {}", elements.len())));
        }
        for (index, (value, element)) in values.iter_mut().zip(&elements).enumerate() {
            let part = Node::new(self.document, key(index), self.row, Some(element.value));
            *value = part.expect("there is a value").quantity_in(dimension, self.row.range())?;
        }
        Ok(values)
    }

    /// N numbers with the dimension of its row, SI.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N], SceneError> {
        self.quantities(self.dimension())
    }

    /// A vector with the dimension and range of its row, SI.
    pub fn vector(&self) -> Result<Vec3, SceneError> {
        let vector = Vec3::from(self.numbers::<3>()?);
        let (least, most) = self.row.range();
        if vector.min() >= least && vector.max() <= most {
            return Ok(vector);
        }
        let [least, most] = [least, most].map(|at| format_quantity(at, si_unit(self.dimension())));
        Err(self.error(format!("out of range; allowed {least} to {most}")))
    }

    /// A direction, normalised.
    pub fn direction(&self) -> Result<Vec3, SceneError> {
        let vector = Vec3::from(self.quantities::<3>(Dimension::None)?);
        // Scaled first: squares of huge or tiny components would leave the range of f64.
        let size = vector.amax();
        if size > 0.0 { Ok((vector / size).normalize()) } else { Err(self.error("a direction must not be zero")) }
    }

    /// A table with the keys of its row.
    pub fn section(&self) -> Result<Section<'d>, SceneError> {
        self.section_as(self.key.clone())
    }

    /// Like [`Self::section`], with a different path for its keys.
    pub fn section_as(&self, path: String) -> Result<Section<'d>, SceneError> {
        let rows = self.row.table().expect("a row that takes tables");
        let table = self.value.get_ref().as_table().ok_or_else(|| self.wrong_type("a table"))?;
        Section::new(self.document, path, table, self.value.span(), rows)
    }

    /// Path of the table's keys: `prefix` and its name, or its array index if it has none.
    pub fn title(&self, prefix: &str) -> String {
        let name = self.value.get_ref().get("name").and_then(|name| name.get_ref().as_str());
        let title = |name| format!("{prefix}.{}", self.full(name));
        name.map_or_else(|| self.key.clone(), title)
    }

    /// A parameter's value, read and checked against its row of the table.
    pub fn parameter(&self) -> Result<super::Value, SceneError> {
        let parameter = match self.row.value_type {
            ValueType::Parameter(key) => find(key),
            _ => None,
        };
        let parameter = parameter.expect("a row of a parameter");
        // A count or a pure number may be bare; strings and bare numbers are read alike.
        let text = self.scalar()?;
        let (read, Kind::Number { dimension, .. }) = (parameter.read(text), parameter.kind) else {
            let read = parameter.read(text);
            return read.map_err(|error| self.error(error.to_string()));
        };
        match read {
            Err(error) if matches!(error.fault, ValueFault::Quantity(_)) => {
                // Not a quantity: it may be an expression.
                let value = self.document.reading.evaluate(text, dimension, self.document.instance);
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

/// Entries of the list `name` in all `files`, followed by `more`, limited in number by the row of the list.
///
/// # Errors
/// Not a list, or too many entries.
pub(super) fn lists<'d>(files: &[Section<'d>], name: &str, more: Vec<Node<'d>>) -> Result<Vec<Node<'d>>, SceneError> {
    let mut nodes = Vec::new();
    for file in files {
        if let Some(list) = file.get(name) {
            let first = nodes.len();
            nodes.extend(list.entries()?);
            // Indices continue across files.
            for (index, node) in nodes.iter_mut().enumerate().skip(first) {
                node.key = format!("{name}[{index}]");
            }
        }
    }
    nodes.extend(more);
    let Some(ListLimit { max, entries }) = nodes.first().and_then(|node| node.row.list_limit()) else {
        return Ok(nodes);
    };
    match nodes.get(max) {
        None => Ok(nodes),
        Some(first) => Err(first.error(format!(
            "too many: {} {entries} with those of patterns and included files; allowed at most {max}",
            nodes.len()
        ))),
    }
}

/// Whether values of this dimension enter the equations of motion squared, and so are limited by [`MAX_SI`].
fn enters_squared(dimension: Dimension) -> bool {
    !matches!(
        dimension,
        Dimension::Mass
            | Dimension::Density
            | Dimension::Inertia
            | Dimension::Stress
            | Dimension::Force
            | Dimension::Torque
            | Dimension::Stiffness
            | Dimension::ContactStiffness
            | Dimension::Damping
            | Dimension::TurningStiffness
            | Dimension::TurningDamping
            | Dimension::Wear
            | Dimension::Viscosity
    )
}

fn article(value: &DeValue<'_>) -> &'static str {
    if value.is_integer() || value.is_array() { "an" } else { "a" }
}
