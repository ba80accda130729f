//! Output files: what they are called, that they appear whole, and what is in them.

mod csv;
mod json;
mod npz;
mod table;
mod target;

pub use csv::significant;
pub use table::{NotFinite, Table};
pub use target::{Folder, MANIFEST, Target};

use std::path::{Path, PathBuf};

use serde_json::Value as Json;

use super::failure::Failure;

/// Largest number of values a run may hold in memory: 4 GiB.
const MOST_VALUES: u64 = 1 << 29;

/// File format of a run's rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Text, one row a line; what made it stands in a second file beside it.
    Csv,
    /// One object: `meta` and `columns`.
    Json,
    /// NumPy archive: one array a column, and `meta`.
    Npz,
}

impl Format {
    /// The format that a file's ending asks for.
    ///
    /// # Errors
    /// An ending that is none of the three.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default();
        match ending.to_ascii_lowercase().as_str() {
            "csv" => Ok(Self::Csv),
            "json" => Ok(Self::Json),
            "npz" => Ok(Self::Npz),
            _ => Err(Failure::usage(format!(
                "{}: the file's ending chooses its format; use .csv, .json or .npz",
                path.display()
            ))),
        }
    }
}

/// Where a run's rows will go: claimed, and known to be writable, before the run starts.
pub struct RowsFile {
    format: Format,
    rows: Target,
    /// CSV has no place for what made it: a plain reader takes the first line for the header and every other for data.
    beside: Option<Target>,
}

impl RowsFile {
    /// Checks that `path` can be written.
    ///
    /// # Errors
    /// Unknown ending (usage), existing file without `force`, unwritable folder (input/output).
    pub fn claim(path: &Path, force: bool) -> Result<Self, Failure> {
        let format = Format::of(path)?;
        // The name that the user gave first: an error is to name that one.
        let rows = Target::claim(path, force)?;
        let beside = match format {
            Format::Csv => Some(Target::claim(&Self::meta_path(path), force)?),
            Format::Json | Format::Npz => None,
        };
        Ok(Self {
            format,
            rows,
            beside,
        })
    }

    /// The file beside a CSV file that says what made it: `run.csv` has `run.csv.meta.json`.
    pub fn meta_path(path: &Path) -> PathBuf {
        let mut name = path.as_os_str().to_owned();
        name.push(".meta.json");
        PathBuf::from(name)
    }

    /// The rows' final name.
    pub fn path(&self) -> &Path {
        self.rows.path()
    }

    /// Writes everything under the final names.
    ///
    /// # Errors
    /// Whatever the file system says; the final names are then as they were.
    pub fn write(self, table: &Table, meta: &Json) -> Result<(), Failure> {
        match self.format {
            Format::Csv => {
                if let Some(beside) = self.beside {
                    beside.write(|file| json::write_meta(file, meta))?;
                }
                self.rows.write(|file| csv::write(file, table))
            }
            Format::Json => self.rows.write(|file| json::write(file, table, meta)),
            Format::Npz => self.rows.write(|file| npz::write(file, table, meta)),
        }
    }
}

/// Refuses a run whose rows would not fit in memory.
///
/// # Errors
/// Usage, with the numbers.
pub fn check_size(rows: u64, columns: usize) -> Result<(), Failure> {
    let values = rows.saturating_mul(columns as u64);
    if values <= MOST_VALUES {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "{rows} rows of {columns} columns would take {:.0} GiB of memory, more than the limit of {} GiB; \
         choose a longer --every or a shorter --duration (at most {} rows)",
        values as f64 * 8.0 / f64::from(1u32 << 30),
        MOST_VALUES * 8 / (1 << 30),
        MOST_VALUES / columns as u64,
    )))
}
