//! What the sections of a scene file are made of: rows, each a key with the value that it takes. The reader, the JSON schema and
//! the reference all go by the same rows. They are in `format.rs`, and those of force elements and laws of drives where these are.

use jointplay_physics::units::Dimension;

/// Largest length, speed, angle, … in SI units that a file may give.
pub(super) const MAX_SI: f64 = 1e6;
/// Lower end of a range that excludes 0.
pub const ABOVE_ZERO: f64 = f64::MIN_POSITIVE;
/// Range of a number that only [`MAX_SI`] bounds.
pub(super) const ANY: (f64, f64) = (-MAX_SI, MAX_SI);
/// Range of numbers that are checked together.
const UNCHECKED: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// A section of the file, or a table within one.
#[derive(Debug)]
pub struct FileTable {
    /// Its name, that of no other table.
    pub name: &'static str,
    /// What it is called: `[[body]]` where the file has a section for it.
    pub head: &'static str,
    /// What it is.
    pub help: &'static str,
    /// Its keys. One may stand there twice, for different variants.
    pub keys: &'static [FileKey],
    /// What decides which of them there are.
    pub variants: Option<Variants>,
    /// Another table, all of whose keys are among its own.
    pub also: Option<&'static FileTable>,
}

/// What decides which keys a table has.
#[derive(Clone, Copy, Debug)]
pub enum Variants {
    /// The word of a key, and what one of a word is called: `a {} joint`; "" where the keys of other words are as unknown
    /// as any others.
    Word(&'static str, &'static str),
    /// Which one of these keys is there.
    Presence(&'static [&'static str]),
}

/// A key of a table.
#[derive(Clone, Copy, Debug)]
pub struct FileKey {
    /// As the file writes it.
    pub name: &'static str,
    /// Its value.
    pub takes: ValueType,
    /// An example, as a file writes it; "" for a parameter of the table of parameters.
    pub like: &'static str,
    /// Dimension and example where it belongs to a hinge, if they are others there.
    pub on_hinge: Option<(Dimension, &'static str)>,
    /// What holds where it is left out.
    pub absent: DefaultRule,
    /// In whose frame its value is; "" where it has none.
    pub frame: &'static str,
    /// What it is, in a line.
    pub help: &'static str,
    /// Variants of the table that have it; all if empty.
    pub of: &'static [&'static str],
    /// Whether it can only be changed in the file, although it is a number.
    pub fixed: bool,
}

/// Values that a key takes.
#[derive(Clone, Copy, Debug)]
pub enum ValueType {
    /// A quantity or an expression: dimension, and closed range, SI.
    Number(Dimension, (f64, f64)),
    /// Three of them.
    Vector(Dimension, (f64, f64)),
    /// A number of them.
    Numbers(usize, Dimension),
    /// A vector that is not 0, of pure numbers; its length does not matter.
    Direction,
    /// A quantity of any dimension.
    Quantity,
    /// Two of them.
    Range,
    /// A whole number in a closed range.
    Whole(u32, u32),
    /// `true` or `false`.
    Flag,
    /// A text.
    Text,
    /// A new name.
    Name,
    /// The name of a body.
    Body,
    /// The name of a joint.
    Joint,
    /// The name of a file beside the scene.
    File,
    /// One of some words.
    Word(&'static [&'static str]),
    /// A list of them.
    Words(&'static [&'static str], ListLimit),
    /// The value of a row of the table of parameters, by its key there.
    Parameter(&'static str),
    /// A table.
    Table(&'static FileTable),
    /// A list of tables.
    List(&'static FileTable, ListLimit),
    /// A list of vectors.
    Vectors(Dimension, ListLimit),
    /// A list of pairs of quantities.
    Pairs([Dimension; 2], ListLimit),
    /// A list of names of files beside the scene.
    Files(ListLimit),
}

/// How many entries a list may have, and what they are called.
#[derive(Clone, Copy, Debug)]
pub struct ListLimit {
    /// Most of them.
    pub most: usize,
    /// What they are called.
    pub what: &'static str,
}

/// At most `most` entries, called `what`.
pub(super) const fn many(most: usize, what: &'static str) -> ListLimit {
    ListLimit { most, what }
}

/// What holds where a key is left out.
#[derive(Clone, Copy, Debug)]
pub enum DefaultRule {
    /// It must be given.
    Fault,
    /// It must be given, unless this other key is.
    Or(&'static str),
    /// This number, SI, of each component; no rotation; no limit if it is infinite.
    Is(f64),
    /// What the words say.
    Means(&'static str),
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

    /// With all keys of `other` among its own.
    pub(super) const fn also(mut self, other: &'static Self) -> Self {
        self.also = Some(other);
        self
    }

    /// With variants.
    pub(super) const fn by(mut self, variants: Variants) -> Self {
        self.variants = Some(variants);
        self
    }

    /// Rows of the variant `word`; all if there is none.
    pub fn of(&self, word: Option<&'static str>) -> impl Iterator<Item = &'static FileKey> + use<> {
        let keys = self.keys.iter();
        keys.filter(move |key| word.is_none_or(|word| key.is_of(word)))
    }

    /// Row of the key `name`: that of the variant `word` if it has one.
    pub fn key(&self, name: &str, word: Option<&'static str>) -> Option<&'static FileKey> {
        let named = |key: &&FileKey| key.name == name;
        self.of(word).find(named).or_else(|| self.keys.iter().find(named))
    }

    /// Words of its variants; none if it has no variants.
    pub fn words(&self) -> &'static [&'static str] {
        match self.variants {
            None => &[],
            Some(Variants::Presence(words)) => words,
            Some(Variants::Word(by, _)) => match self.key(by, None).map(|key| key.takes) {
                Some(ValueType::Word(words)) => words,
                _ => &[],
            },
        }
    }
}

/// A key that must be given.
pub(super) const fn key(name: &'static str, takes: ValueType, like: &'static str, help: &'static str) -> FileKey {
    FileKey { name, takes, like, on_hinge: None, absent: DefaultRule::Fault, frame: "", help, of: &[], fixed: false }
}

impl FileKey {
    /// One that may be left out; `words` say what holds then.
    pub(super) const fn absent(mut self, words: &'static str) -> Self {
        self.absent = DefaultRule::Means(words);
        self
    }

    /// One that is `value`, SI, where it is left out.
    pub(super) const fn is(mut self, value: f64) -> Self {
        self.absent = DefaultRule::Is(value);
        self
    }

    /// One that is 0 where it is left out.
    pub(super) const fn zero(self) -> Self {
        self.is(0.0)
    }

    /// One that may be left out where `other` is given.
    pub(super) const fn or(mut self, other: &'static str) -> Self {
        self.absent = DefaultRule::Or(other);
        self
    }

    /// In the frame `frame`.
    pub(super) const fn frame(mut self, frame: &'static str) -> Self {
        self.frame = frame;
        self
    }

    /// Of these variants of its table.
    pub(super) const fn of(mut self, variants: &'static [&'static str]) -> Self {
        self.of = variants;
        self
    }

    /// Of another dimension on a hinge.
    pub(super) const fn on_hinge(mut self, dimension: Dimension, like: &'static str) -> Self {
        self.on_hinge = Some((dimension, like));
        self
    }

    /// One that only the file can change.
    pub(super) const fn fixed(mut self) -> Self {
        self.fixed = true;
        self
    }

    /// Whether the variant `word` has it.
    pub fn is_of(&self, word: &str) -> bool {
        self.of.is_empty() || self.of.contains(&word)
    }

    /// The table that it takes, or those of which it takes a list.
    pub fn table(&self) -> Option<&'static FileTable> {
        match self.takes {
            ValueType::Table(table) | ValueType::List(table, _) => Some(table),
            _ => None,
        }
    }

    /// An example; `hinge`: whether it belongs to one.
    pub(super) fn like(&self, hinge: bool) -> &'static str {
        let own = self.on_hinge.filter(|_| hinge);
        own.map_or(self.like, |(_, like)| like)
    }

    /// Dimension of its numbers, where they have one; of pairs, that of the second. `hinge`: whether it belongs to one.
    pub fn dimension(&self, hinge: bool) -> Option<Dimension> {
        let dimension = match self.takes {
            ValueType::Number(dimension, _)
            | ValueType::Vector(dimension, _)
            | ValueType::Numbers(_, dimension)
            | ValueType::Vectors(dimension, _)
            | ValueType::Pairs([_, dimension], _) => dimension,
            _ => return None,
        };
        let own = self.on_hinge.filter(|_| hinge);
        Some(own.map_or(dimension, |(dimension, _)| dimension))
    }

    /// Closed range of its numbers, SI.
    pub fn range(&self) -> (f64, f64) {
        match self.takes {
            ValueType::Number(_, range) | ValueType::Vector(_, range) => range,
            _ => UNCHECKED,
        }
    }

    /// Most entries of its list.
    pub fn many(&self) -> Option<ListLimit> {
        match self.takes {
            ValueType::List(_, many)
            | ValueType::Vectors(_, many)
            | ValueType::Pairs(_, many)
            | ValueType::Words(_, many)
            | ValueType::Files(many) => Some(many),
            _ => None,
        }
    }
}

/// A quantity that only [`MAX_SI`] bounds.
pub(super) const fn number(dimension: Dimension) -> ValueType {
    ValueType::Number(dimension, ANY)
}

/// A quantity above 0 and at most `most`, SI.
pub(super) const fn positive(dimension: Dimension, most: f64) -> ValueType {
    ValueType::Number(dimension, (ABOVE_ZERO, most))
}

/// Three quantities.
pub(super) const fn vector(dimension: Dimension) -> ValueType {
    ValueType::Vector(dimension, UNCHECKED)
}
