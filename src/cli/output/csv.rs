//! Rows as text: a header line followed only by data, so that any reader accepts it.

use std::io::{self, Write};

use super::{Table, Values};
use crate::cli::tables::quoted;
use crate::units::significant;

/// Writes header and rows.
pub(super) fn write(out: &mut impl Write, table: &Table) -> io::Result<()> {
    let heads: Vec<String> = table.columns().iter().map(|column| quoted(&column.name)).collect();
    writeln!(out, "{}", heads.join(","))?;
    for row in 0..table.rows() {
        for (i, column) in table.columns().iter().enumerate() {
            let separator = if i > 0 { "," } else { "" };
            match &column.values {
                Values::Numbers(values) => write!(out, "{separator}{}", significant(values[row], 12))?,
                Values::Whole(values) => write!(out, "{separator}{}", values[row])?,
                Values::Words(words) => write!(out, "{separator}{}", quoted(&words[row]))?,
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Forwards bytes and computes their CRC-32, which tells a reader whether rows and metadata belong together.
pub struct ChecksumWriter<W> {
    inner: W,
    checksum: crc32fast::Hasher,
}

impl<W: Write> ChecksumWriter<W> {
    /// A writer that has forwarded nothing yet.
    pub fn new(inner: W) -> Self {
        let checksum = crc32fast::Hasher::new();
        Self { inner, checksum }
    }

    /// The CRC-32 as eight hexadecimal digits.
    pub fn checksum(self) -> String {
        format!("{:08x}", self.checksum.finalize())
    }
}

impl<W: Write> Write for ChecksumWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.checksum.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}
