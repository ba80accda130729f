//! Columns of results, such as the rows of a run. SI units, world axes.

use crate::scene::Scene;
use crate::simulate::{Frame, Reading, UnknownChannel, chosen_columns, run_columns};

/// Values of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers.
    Numbers(Vec<f64>),
    /// Whole numbers.
    Whole(Vec<i64>),
    /// Words.
    Words(Vec<String>),
}

impl Values {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Whole(values) => values.len(),
            Self::Words(words) => words.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A column of a table, or an array of an archive.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name, with the unit.
    pub name: String,
    /// Shape of the array, if it is not one row of values.
    pub shape: Option<Vec<usize>>,
    /// Values, row-major.
    pub values: Values,
}

impl Column {
    /// A column of numbers.
    pub fn numbers(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), shape: None, values: Values::Numbers(values) }
    }

    /// A column of whole numbers.
    pub fn whole(name: impl Into<String>, values: Vec<i64>) -> Self {
        Self { name: name.into(), shape: None, values: Values::Whole(values) }
    }

    /// A column of words.
    pub fn words<'a>(name: impl Into<String>, words: impl IntoIterator<Item = &'a str>) -> Self {
        let words: Vec<String> = words.into_iter().map(str::to_owned).collect();
        Self { name: name.into(), shape: None, values: Values::Words(words) }
    }

    /// The same values as an array of `shape`.
    pub fn shaped(self, shape: Vec<usize>) -> Self {
        Self { shape: Some(shape), ..self }
    }
}

/// Columns of equal length, in order.
#[derive(Clone, Debug, Default)]
pub struct Table {
    columns: Vec<Column>,
    /// Where in a frame to read the value of each column; empty if the rows are not frames.
    readings: Vec<Reading>,
}

/// A value that is not finite.
#[derive(Debug, thiserror::Error)]
#[error("{column} is {value} at t = {time:.6e} s")]
pub struct NotFinite {
    /// Column.
    column: String,
    /// Value.
    value: f64,
    /// Time of the row, s.
    time: f64,
}

impl Table {
    /// An empty table with the columns of `scene`; `first` shows whether it has a tip error and a ledger.
    pub fn new(scene: &Scene, first: &Frame) -> Self {
        Self::of_channels(run_columns(&scene.machine, first))
    }

    /// An empty table with the time and the channels that match `patterns`.
    ///
    /// # Errors
    /// A pattern without a match.
    pub fn of_patterns(scene: &Scene, first: &Frame, patterns: &[String]) -> Result<Self, UnknownChannel> {
        chosen_columns(&scene.machine, first, patterns).map(Self::of_channels)
    }

    fn of_channels((names, readings): (Vec<String>, Vec<Reading>)) -> Self {
        Self { columns: names.into_iter().map(|name| Column::numbers(name, Vec::new())).collect(), readings }
    }

    /// A table of rows other than those of a run.
    pub fn of_rows<const N: usize>(names: [&str; N], rows: impl Iterator<Item = [f64; N]>) -> Self {
        let mut columns = names.map(|_| Vec::new());
        rows.for_each(|row| columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value)));
        names.into_iter().zip(columns).map(|(name, values)| Column::numbers(name, values)).collect()
    }

    /// Makes `frame` request the quantities that the columns need.
    pub fn request(&self, frame: &mut Frame) {
        self.readings.iter().for_each(|reading| reading.request(frame));
    }

    /// Its columns.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// Makes room for `rows` more rows; returns whether there is.
    pub fn reserve(&mut self, rows: usize) -> bool {
        self.columns.iter_mut().all(|column| match &mut column.values {
            Values::Numbers(values) => values.try_reserve_exact(rows).is_ok(),
            Values::Whole(values) => values.try_reserve_exact(rows).is_ok(),
            Values::Words(words) => words.try_reserve_exact(rows).is_ok(),
        })
    }

    /// Appends the row of `frame`.
    ///
    /// # Errors
    /// A value that is not finite, except one that is unknown in the frame. The table is then unchanged.
    pub fn push(&mut self, frame: &Frame) -> Result<(), NotFinite> {
        let is_wrong = |reading: &Reading| reading.read(frame).is_some_and(|value| !value.is_finite());
        if let Some(c) = self.readings.iter().position(is_wrong) {
            let value = self.readings[c].read(frame).unwrap_or(f64::NAN);
            return Err(NotFinite { column: self.columns[c].name.clone(), value, time: frame.time });
        }
        for (reading, column) in self.readings.iter().zip(&mut self.columns) {
            if let Values::Numbers(values) = &mut column.values {
                // There is no tip error after the ideal mechanism has stopped.
                values.push(reading.read(frame).unwrap_or(f64::NAN));
            }
        }
        Ok(())
    }
}

impl FromIterator<Column> for Table {
    fn from_iter<T: IntoIterator<Item = Column>>(columns: T) -> Self {
        Self { columns: columns.into_iter().collect(), readings: Vec::new() }
    }
}
