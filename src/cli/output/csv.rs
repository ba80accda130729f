//! Rows as text: a header line followed only by data, so that any reader accepts it.

use std::io::{self, Write};

use super::{Table, Values};
use crate::cli::tables::quoted;

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

/// `value` with `digits` significant digits, trailing zeros dropped, as C's `%.<digits>g` writes it (but 0 for -0).
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let Some((mantissa, exponent)) = scientific.split_once('e') else {
        return scientific; // not finite: "NaN", "inf"
    };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if exponent < -4 || exponent >= digits as i32 {
        let sign = if exponent < 0 { '-' } else { '+' };
        return format!("{}e{sign}{:02}", trim(mantissa), exponent.unsigned_abs());
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    trim(&format!("{value:.decimals$}")).to_owned()
}

fn trim(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

#[cfg(test)]
mod tests {
    use super::significant;

    #[test]
    fn numbers_look_as_in_the_reference_files() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (0.203, "0.203"),
            (-0.038_316_734_517_7, "-0.0383167345177"),
            (3.925_231_146_71e-17, "3.92523114671e-17"),
            (1.123_152_959_62e-6, "1.12315295962e-06"),
            (0.000_1, "0.0001"),
            (0.000_01, "1e-05"),
            (771.151_234_567_89, "771.151234568"),
            (1.0e12, "1e+12"),
            (123_456_789_012.0, "123456789012"),
            (999_999_999_999.6, "1e+12"),
            (0.999_999_999_999_9, "1"),
            (0.1 + 0.2, "0.3"),
            (-2.5e-300, "-2.5e-300"),
        ] {
            assert_eq!(significant(value, 12), text);
        }
    }

    #[test]
    fn twelve_digits_are_preserved() {
        let mut value = 1.234_567_890_123_456_7e-20;
        while value < 1e20 {
            let back: f64 = significant(value, 12).parse().unwrap();
            // Half a unit of the twelfth digit is at most 5e-12 of the value.
            assert!((back - value).abs() <= 5.000_1e-12 * value, "{value:e}");
            value *= 3.7;
        }
    }
}
