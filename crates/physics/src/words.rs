//! Enums whose variants are named by words in files and in the interface.

/// An enum with a word for each variant.
pub trait Words: Copy + 'static {
    /// The words, in menu order.
    const WORDS: &'static [&'static str];

    /// Word of this variant.
    fn word(self) -> &'static str;

    /// Variant of a word.
    fn of_word(word: &str) -> Option<Self>;
}

/// Implements `ALL`, `word` and [`Words`] for an enum, and `Display`, `Serialize` and `Deserialize` by word. A variant without a
/// word does not compile.
#[macro_export]
macro_rules! named_by_words {
    ($name:ident { $($variant:ident => $word:literal),+ $(,)? }) => {
        impl $name {
            /// Every variant, in menu order.
            #[allow(dead_code, reason = "some enums of the file format are never listed")]
            pub const ALL: [Self; [$($word),+].len()] = [$(Self::$variant),+];

            /// Word of this variant in files and menus.
            pub const fn word(self) -> &'static str {
                match self {
                    $(Self::$variant => $word),+
                }
            }
        }

        impl $crate::words::Words for $name {
            const WORDS: &'static [&'static str] = &[$($word),+];

            fn word(self) -> &'static str {
                self.word()
            }

            fn of_word(word: &str) -> Option<Self> {
                match word {
                    $($word => Some(Self::$variant),)+
                    _ => None,
                }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.word())
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(self.word())
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let word = <String as serde::Deserialize>::deserialize(deserializer)?;
                let known = <Self as $crate::words::Words>::of_word(&word);
                known.ok_or_else(|| serde::de::Error::unknown_variant(&word, <Self as $crate::words::Words>::WORDS))
            }
        }
    };
}

pub use crate::named_by_words as words;
