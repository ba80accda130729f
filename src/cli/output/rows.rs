//! Rows of equal width, limited by disk space: full blocks move from memory to an unnamed file.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};

/// Values per block, 8 MiB.
const BLOCK: usize = 1 << 20;

/// Rows in order.
#[derive(Debug)]
pub struct Rows {
    width: usize,
    /// Rows per full block.
    rows_per_block: usize,
    /// The latest rows, row-major.
    block: Vec<f64>,
    /// Full blocks, each column-major.
    spool: Option<File>,
    spooled: usize,
}

impl Rows {
    /// An empty store for rows of `width` values.
    pub fn new(width: usize) -> Self {
        Self { width, rows_per_block: (BLOCK / width).max(1), block: Vec::new(), spool: None, spooled: 0 }
    }

    /// Moves full blocks to `spool` from now on; without a spool all rows stay in memory.
    pub fn spool_to(&mut self, spool: File) {
        self.spool = Some(spool);
    }

    /// Appends a row.
    ///
    /// # Errors
    /// A full disk.
    pub fn push(&mut self, row: &[f64]) -> io::Result<()> {
        debug_assert_eq!(row.len(), self.width, "one value for each column");
        self.block.extend(row);
        if self.block.len() < self.rows_per_block * self.width {
            return Ok(());
        }
        let Some(spool) = &mut self.spool else {
            return Ok(());
        };
        let mut bytes = Vec::with_capacity(8 * self.block.len());
        for column in 0..self.width {
            let values = self.block[column..].iter().step_by(self.width);
            values.for_each(|value| bytes.extend(value.to_le_bytes()));
        }
        spool.seek(SeekFrom::End(0))?;
        spool.write_all(&bytes)?;
        self.spooled += 1;
        self.block.clear();
        Ok(())
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.spooled * self.rows_per_block + self.block.len() / self.width
    }

    /// Calls `each` with every row, in order.
    ///
    /// # Errors
    /// A disk error, or an error of `each`.
    pub fn for_each(&self, mut each: impl FnMut(&[f64]) -> io::Result<()>) -> io::Result<()> {
        let n = self.rows_per_block;
        let mut row = vec![0.0; self.width];
        for block in 0..self.spooled {
            let values = self.read(block, 0, self.width * n)?;
            for k in 0..n {
                let of_row = values[k..].iter().step_by(n);
                row.iter_mut().zip(of_row).for_each(|(to, from)| *to = *from);
                each(&row)?;
            }
        }
        self.block.chunks_exact(self.width).try_for_each(each)
    }

    /// Calls `each` with every value of a column, in order.
    ///
    /// # Errors
    /// A disk error, or an error of `each`.
    pub fn column(&self, column: usize, mut each: impl FnMut(f64) -> io::Result<()>) -> io::Result<()> {
        let n = self.rows_per_block;
        for block in 0..self.spooled {
            let values = self.read(block, column * n, n)?;
            values.into_iter().try_for_each(&mut each)?;
        }
        let rows = self.block.chunks_exact(self.width);
        rows.map(|row| row[column]).try_for_each(each)
    }

    /// Reads `count` values of a spooled block, starting at value `from`.
    fn read(&self, block: usize, from: usize, count: usize) -> io::Result<Vec<f64>> {
        let mut bytes = vec![0; 8 * count];
        let at = 8 * (block * self.rows_per_block * self.width + from) as u64;
        if let Some(mut spool) = self.spool.as_ref() {
            spool.seek(SeekFrom::Start(at))?;
            spool.read_exact(&mut bytes)?;
        }
        let words = bytes.as_chunks().0.iter();
        Ok(words.map(|word| f64::from_le_bytes(*word)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::OutputFile;

    #[test]
    fn spooled_rows_read_back_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        let target = OutputFile::claim(&folder.path().join("a.csv"), false).unwrap();
        let mut rows = Rows::new(3);
        rows.rows_per_block = 4;
        rows.spool_to(target.spool().unwrap());
        let value = |k: usize, column: usize| (10 * k + column) as f64;
        for k in 0..11 {
            rows.push(&[0, 1, 2].map(|column| value(k, column))).unwrap();
        }
        assert_eq!((rows.len(), rows.spooled, rows.block.len()), (11, 2, 9));
        let mut k = 0;
        rows.for_each(|row| {
            assert_eq!(row, [0, 1, 2].map(|column| value(k, column)));
            k += 1;
            Ok(())
        })
        .unwrap();
        assert_eq!(k, 11);
        for column in 0..3 {
            let mut all = Vec::new();
            rows.column(column, |value| {
                all.push(value);
                Ok(())
            })
            .unwrap();
            let expected: Vec<f64> = (0..11).map(|k| value(k, column)).collect();
            assert_eq!(all, expected);
        }
        #[cfg(unix)]
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "the spool has no name");
    }
}
