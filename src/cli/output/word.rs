//! Words in NumPy archives, as Unicode arrays of fixed width.

use std::io::{self, Seek, Write};

use ndarray::Array1;
use ndarray_npy::{NpzWriter, WritableElement, WriteDataError};
use py_literal::Value;

use super::as_io;
use crate::analysis::axis::Axis;

/// Width of every array of words, characters.
const WIDTH: usize = 32;
/// NumPy's name of the type: little-endian UTF-32, padded with zeros.
const TYPE: &str = "<U32";

/// Adds the values of a varied parameter: numbers, SI, or words.
///
/// # Errors
/// Input/output.
pub fn add_axis<W: Write + Seek>(archive: &mut NpzWriter<W>, axis: &Axis) -> io::Result<()> {
    match axis.words() {
        Some(words) => add_words(archive, axis.key(), words),
        None => archive.add_array(axis.key(), &Array1::from_iter(axis.numbers())).map_err(as_io),
    }
}

/// Adds an array of words.
///
/// # Errors
/// Input/output.
pub fn add_words<W: Write + Seek>(archive: &mut NpzWriter<W>, name: &str, words: Vec<&str>) -> io::Result<()> {
    let words: Array1<Word> = words.into_iter().map(|word| Word(word.to_owned())).collect();
    archive.add_array(name, &words).map_err(as_io)
}

/// A word of at most [`WIDTH`] characters.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Word(String);

impl WritableElement for Word {
    fn type_descriptor() -> Value {
        Value::String(TYPE.to_owned())
    }

    fn write<W: Write>(&self, mut writer: W) -> Result<(), WriteDataError> {
        let letters = self.0.chars().map(u32::from).chain(std::iter::repeat(0));
        let bytes: Vec<u8> = letters.take(WIDTH).flat_map(u32::to_le_bytes).collect();
        Ok(writer.write_all(&bytes)?)
    }

    fn write_slice<W: Write>(slice: &[Self], mut writer: W) -> Result<(), WriteDataError> {
        slice.iter().try_for_each(|word| word.write(&mut writer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Kind, table};

    #[test]
    fn words_of_every_parameter_fit() {
        let choices = table().iter().filter_map(|parameter| match parameter.kind {
            Kind::Choice(words) => Some(words),
            _ => None,
        });
        let words: Vec<Word> = choices.flatten().map(|word| Word((*word).to_owned())).collect();
        assert!(words.len() > 10 && words.iter().all(|word| word.0.chars().count() <= WIDTH));
        let mut bytes = Vec::new();
        Word::write_slice(&words[..2], &mut bytes).unwrap();
        let codes: Vec<u32> = bytes.as_chunks().0.iter().map(|code| u32::from_le_bytes(*code)).collect();
        for (word, codes) in words.iter().zip(codes.chunks(WIDTH)) {
            let letters: String =
                codes.iter().take_while(|code| **code != 0).filter_map(|c| char::from_u32(*c)).collect();
            assert_eq!(letters, word.0);
        }
    }
}
