//! The rows of a run: the columns that a scene has, and one row per sampled instant. SI units, world axes.

use std::io;

use super::rows::Rows;
use crate::files::OutputFile;
use crate::scene::Scene;
use crate::simulate::{Frame, Reading, UnknownChannel, chosen_columns, run_columns};

/// Rows of one run, in order of time.
#[derive(Debug)]
pub struct Table {
    names: Vec<String>,
    /// Where in a frame to read the value of each column; empty if the rows are not frames.
    readings: Vec<Reading>,
    rows: Rows,
    /// The row being assembled.
    values: Vec<f64>,
}

/// Why a row was rejected.
#[derive(Debug, thiserror::Error)]
pub enum RowError {
    /// A value that is not finite.
    #[error("{column} is {value} at t = {time:.6e} s")]
    NotFinite {
        /// Column.
        column: String,
        /// Value.
        value: f64,
        /// Time of the row, s.
        time: f64,
    },
    /// A disk error.
    #[error(transparent)]
    Disk(#[from] io::Error),
}

impl Table {
    /// An empty table with the columns of `scene`; `first` shows whether it has a tip error and a ledger.
    pub fn new(scene: &Scene, first: &Frame) -> Self {
        Self::of_columns(run_columns(&scene.machine, first))
    }

    /// An empty table with the time and the channels that match `patterns`.
    ///
    /// # Errors
    /// A pattern without a match.
    pub fn of_channels(scene: &Scene, first: &Frame, patterns: &[String]) -> Result<Self, UnknownChannel> {
        chosen_columns(&scene.machine, first, patterns).map(Self::of_columns)
    }

    fn of_columns((names, readings): (Vec<String>, Vec<Reading>)) -> Self {
        Self { rows: Rows::new(names.len()), names, readings, values: Vec::new() }
    }

    /// A table of rows other than those of a run.
    pub fn of_rows<const N: usize>(names: [&str; N], rows: impl Iterator<Item = [f64; N]>) -> Self {
        let mut table = Self {
            names: names.map(str::to_owned).to_vec(),
            rows: Rows::new(N),
            readings: Vec::new(),
            values: Vec::new(),
        };
        for row in rows {
            // Cannot fail in memory.
            let _ = table.rows.push(&row);
        }
        table
    }

    /// Holds only the latest rows in memory and spools the others to a file beside `target`.
    ///
    /// # Errors
    /// Input/output.
    pub fn spool_beside(&mut self, target: &OutputFile) -> Result<(), crate::files::FileError> {
        self.rows.spool_to(target.spool()?);
        Ok(())
    }

    /// Makes `frame` request the quantities that the columns need.
    pub fn request(&self, frame: &mut Frame) {
        self.readings.iter().for_each(|reading| reading.request(frame));
    }

    /// Column names, in order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Calls `each` with every row in order, each as long as [`Self::names`].
    ///
    /// # Errors
    /// A disk error, or an error of `each`.
    pub fn rows(&self, each: impl FnMut(&[f64]) -> io::Result<()>) -> io::Result<()> {
        self.rows.for_each(each)
    }

    /// Calls `each` with every value of one column, in order of time.
    ///
    /// # Errors
    /// A disk error, or an error of `each`.
    pub fn column(&self, column: usize, each: impl FnMut(f64) -> io::Result<()>) -> io::Result<()> {
        self.rows.column(column, each)
    }

    /// Appends the row of `frame`.
    ///
    /// # Errors
    /// A value that is not finite, except one that is unknown in the frame; a full disk. The table is then unchanged.
    pub fn push(&mut self, frame: &Frame) -> Result<(), RowError> {
        self.values.clear();
        for (reading, column) in self.readings.iter().zip(&self.names) {
            let value = reading.read(frame);
            if let Some(value) = value.filter(|value| !value.is_finite()) {
                return Err(RowError::NotFinite { column: column.clone(), value, time: frame.time });
            }
            // There is no tip error after the ideal mechanism has stopped.
            self.values.push(value.unwrap_or(f64::NAN));
        }
        Ok(self.rows.push(&self.values)?)
    }
}
