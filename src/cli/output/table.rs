//! Columns of results, such as the rows of a run. SI units, world axes.

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
}

impl Table {
    /// An empty table with columns of numbers.
    pub fn new(names: impl IntoIterator<Item = impl Into<String>>) -> Self {
        names.into_iter().map(|name| Column::numbers(name, Vec::new())).collect()
    }

    /// A table of rows.
    pub fn of_rows<const N: usize>(names: [&str; N], rows: impl Iterator<Item = [f64; N]>) -> Self {
        let mut table = Self::new(names);
        rows.for_each(|row| table.push(&row));
        table
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

    /// Appends a row of numbers.
    pub fn push(&mut self, row: &[f64]) {
        for (column, value) in self.columns.iter_mut().zip(row) {
            if let Values::Numbers(values) = &mut column.values {
                values.push(*value);
            }
        }
    }
}

impl FromIterator<Column> for Table {
    fn from_iter<T: IntoIterator<Item = Column>>(columns: T) -> Self {
        Self { columns: columns.into_iter().collect() }
    }
}
