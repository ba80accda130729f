//! Row types of the scene file: a row describes a key and its value. The reader, the JSON schema and the reference use the
//! same rows. They are in `format.rs`; those of force elements and drive laws are in `elements.rs` and `drives.rs`.

use jointplay_physics::units::Dimension;

/// Largest length, speed, angle, … allowed in a file, SI.
pub(super) const MAX_SI: f64 = 1e6;
/// Lower end of a range that excludes 0.
pub const ABOVE_ZERO: f64 = f64::MIN_POSITIVE;
/// Range of a number limited only by [`MAX_SI`].
pub(super) const ANY: (f64, f64) = (-MAX_SI, MAX_SI);
/// Range of numbers that are not checked one by one.
pub(super) const UNCHECKED: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// A section of the file, or a table within one.
#[derive(Debug)]
pub struct FileTable {
    /// Unique name.
    pub name: &'static str,
    /// Heading: `[[body]]` for a section of the file.
    pub head: &'static str,
    /// One-line description.
    pub help: &'static str,
    /// Keys. A name may occur twice, for different variants.
    pub keys: &'static [FileKey],
    /// Rule that selects the variant; `None` if there is only one.
    pub variants: Option<Variants>,
    /// Another table whose keys are all included in this one.
    pub also: Option<&'static FileTable>,
}

/// Rule that selects the variant of a table, and thus its keys.
#[derive(Clone, Copy, Debug)]
pub enum Variants {
    /// By the word under a key. The second text is a noun for errors, with `{}` for the word: `{} joint`; if it is "", keys of
    /// other variants are reported as unknown.
    Word(&'static str, &'static str),
    /// By which one of these keys is present.
    Presence(&'static [&'static str]),
}

/// A key of a table.
#[derive(Clone, Copy, Debug)]
pub struct FileKey {
    /// Name in the file.
    pub name: &'static str,
    /// Type of its value.
    pub value_type: ValueType,
    /// Example in TOML; "" for a parameter of the parameter table.
    pub example: &'static str,
    /// Type of its value and example on a hinge, if different.
    pub on_hinge: Option<(ValueType, &'static str)>,
    /// Default.
    pub default: DefaultRule,
    /// Reference frame of the value; "" if none.
    pub frame: &'static str,
    /// One-line description.
    pub help: &'static str,
    /// Variants of the table that have this key; all if empty.
    pub of: &'static [&'static str],
    /// Whether it can be changed only in the file.
    pub fixed: bool,
}

/// Type of a key's value.
#[derive(Clone, Copy, Debug)]
pub enum ValueType {
    /// A quantity or an expression: dimension and closed range, SI.
    Number(Dimension, (f64, f64)),
    /// Three numbers: dimension and closed range of each component, SI.
    Vector(Dimension, (f64, f64)),
    /// This many numbers of one dimension.
    Numbers(usize, Dimension),
    /// A nonzero vector of pure numbers, of any length.
    Direction,
    /// A quantity of any dimension.
    Quantity,
    /// A range: two quantities.
    Range,
    /// A whole number in a closed range.
    Whole(u32, u32),
    /// `true` or `false`.
    Flag,
    /// A string.
    Text,
    /// A new name.
    Name,
    /// The name of a body.
    Body,
    /// The name of a joint.
    Joint,
    /// The name of a file beside the scene.
    File,
    /// One of these words.
    Word(&'static [&'static str]),
    /// A list of these words.
    Words(&'static [&'static str], ListLimit),
    /// The value of a parameter, by its key in the parameter table.
    Parameter(&'static str),
    /// A table.
    Table(&'static FileTable),
    /// A list of tables.
    List(&'static FileTable, ListLimit),
    /// A list of vectors.
    Vectors(Dimension, ListLimit),
    /// A list of pairs of quantities.
    Pairs([Dimension; 2], ListLimit),
    /// A list of file names, beside the scene, or of tables that name them.
    Files(&'static FileTable, ListLimit),
    /// A table of quantities of any dimension, by any names.
    Values,
}

/// Maximum length of a list, and the noun for its entries.
#[derive(Clone, Copy, Debug)]
pub struct ListLimit {
    /// Maximum number of entries.
    pub max: usize,
    /// Plural noun for the entries.
    pub entries: &'static str,
}

/// A limit of `max` entries; `entries` is their plural noun.
pub(super) const fn at_most(max: usize, entries: &'static str) -> ListLimit {
    ListLimit { max, entries }
}

/// Default of an omitted key.
#[derive(Clone, Copy, Debug)]
pub enum DefaultRule {
    /// Required.
    Required,
    /// Required unless this other key is present.
    RequiredUnless(&'static str),
    /// This number, SI, for each component; for a rotation, the identity; infinite for no limit.
    Number(f64),
    /// A default described in words.
    Description(&'static str),
}

impl FileTable {
    /// A table without variants.
    pub(super) const fn new(
        name: &'static str,
        head: &'static str,
        help: &'static str,
        keys: &'static [FileKey],
    ) -> Self {
        Self { name, head, help, keys, variants: None, also: None }
    }

    /// Declares that the table includes all keys of `other`.
    pub(super) const fn also(mut self, other: &'static Self) -> Self {
        self.also = Some(other);
        self
    }

    /// Adds variants.
    pub(super) const fn by(mut self, variants: Variants) -> Self {
        self.variants = Some(variants);
        self
    }

    /// Rows of the variant `word`; all rows if `None`.
    pub fn of(&self, word: Option<&'static str>) -> impl Iterator<Item = &'static FileKey> + use<> {
        let keys = self.keys.iter();
        keys.filter(move |key| word.is_none_or(|word| key.is_of(word)))
    }

    /// Row of the key `name`, of the variant `word` if it has one.
    pub fn key(&self, name: &str, word: Option<&'static str>) -> Option<&'static FileKey> {
        let named = |key: &&FileKey| key.name == name;
        self.of(word).find(named).or_else(|| self.keys.iter().find(named))
    }

    /// Names of its variants; empty if it has none.
    pub fn words(&self) -> &'static [&'static str] {
        match self.variants {
            None => &[],
            Some(Variants::Presence(words)) => words,
            Some(Variants::Word(by, _)) => match self.key(by, None).map(|key| key.value_type) {
                Some(ValueType::Word(words)) => words,
                _ => &[],
            },
        }
    }
}

/// A required key.
pub(super) const fn key(
    name: &'static str,
    value_type: ValueType,
    example: &'static str,
    help: &'static str,
) -> FileKey {
    FileKey {
        name,
        value_type,
        example,
        on_hinge: None,
        default: DefaultRule::Required,
        frame: "",
        help,
        of: &[],
        fixed: false,
    }
}

impl FileKey {
    /// Makes the key optional, with a default described by `words`.
    pub(super) const fn default_text(mut self, words: &'static str) -> Self {
        self.default = DefaultRule::Description(words);
        self
    }

    /// Sets the default, SI.
    pub(super) const fn default_value(mut self, value: f64) -> Self {
        self.default = DefaultRule::Number(value);
        self
    }

    /// Sets the default to 0.
    pub(super) const fn default_zero(self) -> Self {
        self.default_value(0.0)
    }

    /// Makes the key optional if `other` is present.
    pub(super) const fn unless(mut self, other: &'static str) -> Self {
        self.default = DefaultRule::RequiredUnless(other);
        self
    }

    /// Sets the reference frame.
    pub(super) const fn frame(mut self, frame: &'static str) -> Self {
        self.frame = frame;
        self
    }

    /// Restricts the key to these variants of its table.
    pub(super) const fn of(mut self, variants: &'static [&'static str]) -> Self {
        self.of = variants;
        self
    }

    /// Sets dimension and example on a hinge; of pairs, the dimension of the second number: a length that is the first becomes an angle.
    pub(super) const fn on_hinge(mut self, dimension: Dimension, example: &'static str) -> Self {
        let value_type = match self.value_type {
            ValueType::Number(_, range) => ValueType::Number(dimension, range),
            ValueType::Pairs([Dimension::Length, _], limit) => ValueType::Pairs([Dimension::Angle, dimension], limit),
            ValueType::Pairs([first, _], limit) => ValueType::Pairs([first, dimension], limit),
            other => other,
        };
        self.on_hinge = Some((value_type, example));
        self
    }

    /// Makes the key changeable only in the file.
    pub(super) const fn fixed(mut self) -> Self {
        self.fixed = true;
        self
    }

    /// Whether the variant `word` has this key.
    pub fn is_of(&self, word: &str) -> bool {
        self.of.is_empty() || self.of.contains(&word)
    }

    /// Table of its value, or of the entries of its list.
    pub fn table(&self) -> Option<&'static FileTable> {
        match self.value_type {
            ValueType::Table(table) | ValueType::List(table, _) | ValueType::Files(table, _) => Some(table),
            _ => None,
        }
    }

    /// Example, that for a hinge if `hinge`.
    pub(super) fn example(&self, hinge: bool) -> &'static str {
        let own = self.on_hinge.filter(|_| hinge);
        own.map_or(self.example, |(_, example)| example)
    }

    /// Type of its value, that on a hinge if `hinge`.
    pub fn value_type(&self, hinge: bool) -> &ValueType {
        let own = self.on_hinge.as_ref().filter(|_| hinge);
        own.map_or(&self.value_type, |(value_type, _)| value_type)
    }

    /// Dimensions of its numbers, two for pairs; empty if it has no numbers. `hinge` selects those on a hinge.
    pub fn dimensions(&self, hinge: bool) -> &[Dimension] {
        match self.value_type(hinge) {
            ValueType::Number(dimension, _)
            | ValueType::Vector(dimension, _)
            | ValueType::Numbers(_, dimension)
            | ValueType::Vectors(dimension, _) => std::slice::from_ref(dimension),
            ValueType::Pairs(dimensions, _) => dimensions,
            _ => &[],
        }
    }

    /// Dimension of its numbers, if any; for pairs, of the second number. `hinge` selects the dimension on a hinge.
    pub fn dimension(&self, hinge: bool) -> Option<Dimension> {
        self.dimensions(hinge).last().copied()
    }

    /// Closed range of its numbers, SI.
    pub fn range(&self) -> (f64, f64) {
        match self.value_type {
            ValueType::Number(_, range) | ValueType::Vector(_, range) => range,
            _ => UNCHECKED,
        }
    }

    /// Limit of its list, if any.
    pub fn list_limit(&self) -> Option<ListLimit> {
        match self.value_type {
            ValueType::List(_, limit)
            | ValueType::Vectors(_, limit)
            | ValueType::Pairs(_, limit)
            | ValueType::Words(_, limit)
            | ValueType::Files(_, limit) => Some(limit),
            _ => None,
        }
    }
}

/// A quantity limited only by [`MAX_SI`].
pub(super) const fn number(dimension: Dimension) -> ValueType {
    ValueType::Number(dimension, ANY)
}

/// A quantity above 0 and at most `max`, SI.
pub(super) const fn positive(dimension: Dimension, max: f64) -> ValueType {
    ValueType::Number(dimension, (ABOVE_ZERO, max))
}

/// A vector without a range.
pub(super) const fn vector(dimension: Dimension) -> ValueType {
    ValueType::Vector(dimension, UNCHECKED)
}
