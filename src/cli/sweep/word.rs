//! Words in NumPy archives, as Unicode arrays of fixed width.

use std::io::{Read, Write};

use ndarray_npy::{ReadDataError, ReadableElement, WritableElement, WriteDataError};
use py_literal::Value;

/// Width of every array of words, characters.
const WIDTH: usize = 32;
/// NumPy's name of the type: little-endian UTF-32, padded with zeros.
const TYPE: &str = "<U32";

/// A word of at most [`WIDTH`] characters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Word(pub String);

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

impl ReadableElement for Word {
    fn read_to_end_exact_vec<R: Read>(reader: R, described: &Value, len: usize) -> Result<Vec<Self>, ReadDataError> {
        if *described != Self::type_descriptor() {
            return Err(ReadDataError::WrongDescriptor(described.clone()));
        }
        let length = len * WIDTH * size_of::<u32>();
        let mut bytes = Vec::new();
        // One more byte shows whether the data are too long.
        reader.take(length as u64 + 1).read_to_end(&mut bytes)?;
        if bytes.len() < length {
            return Err(ReadDataError::MissingData);
        }
        if bytes.len() > length {
            return Err(ReadDataError::ExtraBytes(1));
        }
        let word = |bytes: &[u8]| {
            let codes = bytes.as_chunks().0.iter().map(|code| u32::from_le_bytes(*code));
            let letters = codes.take_while(|code| *code != 0).map(char::from_u32);
            letters.collect::<Option<String>>().map(Self)
        };
        let words = bytes.chunks_exact(WIDTH * size_of::<u32>()).map(word);
        words.collect::<Option<_>>().ok_or_else(|| ReadDataError::ParseData("not a Unicode character".into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Kind, table};

    #[test]
    fn words_of_every_parameter_fit_and_read_back() {
        let choices = table().iter().filter_map(|parameter| match parameter.kind {
            Kind::Choice(words) => Some(words),
            _ => None,
        });
        let words: Vec<Word> = choices.flatten().map(|word| Word((*word).to_owned())).collect();
        assert!(words.len() > 10);
        let mut bytes = Vec::new();
        Word::write_slice(&words, &mut bytes).unwrap();
        let read = |bytes: &[u8], len| Word::read_to_end_exact_vec(bytes, &Word::type_descriptor(), len);
        assert_eq!(read(&bytes, words.len()).unwrap(), words);
        assert!(read(&bytes[1..], words.len()).is_err());
        assert!(read(&bytes, words.len() - 1).is_err());
        assert!(Word::read_to_end_exact_vec(&bytes[..], &Value::String("<f8".to_owned()), words.len()).is_err());
    }
}
