//! Names and formats of output files, which appear complete or not at all.

mod csv;
mod json;
mod npz;
mod table;

pub use csv::ChecksumWriter;
pub use json::write_meta;
pub use table::{Column, Table, Values};

use std::path::{Path, PathBuf};

use serde_json::{Map, Value as Json};

use super::failure::Failure;
use crate::analysis::axis::Axis;
use crate::files::{FileError, OutputFile, PendingFile, same_file};
use crate::scene::read_regular;

/// Largest number of values in the rows of a run, which are in memory: 2 GiB.
const MAX_VALUES: u64 = 1 << 28;

/// Size limit of metadata, bytes: they have the texts of a scene and of its meshes, 12 MiB together.
const MAX_METADATA_SIZE: u64 = 64 << 20;

/// File format of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowFormat {
    /// Text, one row per line; a second file beside it holds the metadata.
    Csv,
    /// One object: `meta` and `columns`.
    Json,
    /// NumPy archive: one array per column, and `meta`.
    Npz,
}

impl RowFormat {
    /// The format of a file by its extension.
    ///
    /// # Errors
    /// Any other extension.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "csv" => Ok(Self::Csv),
            "json" => Ok(Self::Json),
            "npz" => Ok(Self::Npz),
            _ => Err(Failure::usage(format!(
                "{}: the file extension selects the format; use .csv, .json or .npz",
                path.display()
            ))),
        }
    }
}

/// Output file for the rows of a run, claimed and checked to be writable before the run starts.
pub struct RowsFile {
    format: RowFormat,
    rows: OutputFile,
    /// Metadata of a CSV file, kept apart because plain readers treat every line after the header as data.
    metadata: Option<OutputFile>,
}

impl RowsFile {
    /// Checks that `path` can be written.
    ///
    /// # Errors
    /// Unknown extension (usage), existing file without `force`, unwritable folder (input/output).
    pub fn claim(path: &Path, force: bool) -> Result<Self, Failure> {
        let format = RowFormat::of(path)?;
        // The user's own name is claimed first, so that an error names it.
        let rows = OutputFile::claim(path, force)?;
        let metadata = match format {
            RowFormat::Csv => Some(claim_metadata(path, force)?),
            RowFormat::Json | RowFormat::Npz => None,
        };
        Ok(Self { format, rows, metadata })
    }

    /// The files that `option` with `path` writes, for [`check_distinct`].
    pub fn names(option: &str, path: &Path) -> Vec<(String, PathBuf)> {
        let mut names = vec![(option.to_owned(), path.to_owned())];
        if RowFormat::of(path) == Ok(RowFormat::Csv) {
            names.push((format!("the .meta.json of {option}"), metadata_path(path)));
        }
        names
    }

    /// The file of the rows, as it was named.
    pub fn path(&self) -> &Path {
        self.rows.path()
    }

    /// All files that it writes.
    pub fn targets(&mut self) -> impl Iterator<Item = &mut OutputFile> {
        std::iter::once(&mut self.rows).chain(&mut self.metadata)
    }

    /// Writes rows and metadata under temporary names.
    ///
    /// # Errors
    /// A file system error.
    pub fn fill(self, table: &Table, mut meta: Map<String, Json>) -> Result<Vec<PendingFile>, Failure> {
        let mut checksum = String::new();
        let rows = self.rows.fill(|file| match self.format {
            RowFormat::Csv => {
                let mut file = csv::ChecksumWriter::new(file);
                csv::write(&mut file, table)?;
                checksum = file.checksum();
                Ok(())
            }
            RowFormat::Json => json::write(file, table, &meta),
            RowFormat::Npz => npz::write(file, table.columns().iter().cloned(), &meta),
        })?;
        let Some(metadata) = self.metadata else {
            return Ok(vec![rows]);
        };
        meta.insert("rows_crc32".into(), checksum.into());
        let metadata_file = metadata.fill(|file| json::write_meta(file, &meta))?;
        // In this order, a kill between the two renames never leaves rows without metadata.
        Ok(vec![metadata_file, rows])
    }
}

/// Writes `columns`, arrays of any shape, and `meta` as a NumPy archive under a temporary name. One column is in memory at a time.
///
/// # Errors
/// A file system error.
pub fn fill_archive(
    file: OutputFile,
    columns: impl Iterator<Item = Column>,
    meta: &Map<String, Json>,
) -> Result<PendingFile, FileError> {
    file.fill(|content| npz::write(content, columns, meta))
}

/// The values of a varied parameter at `indices`: numbers, SI, or words.
pub fn axis_column(axis: &Axis, name: &str, indices: impl Iterator<Item = usize>) -> Column {
    match axis.words() {
        Some(words) => Column::words(name, indices.map(|i| words[i])),
        None => Column::numbers(name, indices.map(|i| axis.number(i)).collect()),
    }
}

/// Checks that the metadata file beside `path` can be written: `run.csv` has `run.csv.meta.json`.
///
/// # Errors
/// It exists without `force`, or its folder is unwritable.
pub fn claim_metadata(path: &Path, force: bool) -> Result<OutputFile, Failure> {
    let meta = metadata_path(path);
    // Metadata left by a run that was killed between its two renames is worthless and may be replaced.
    let is_orphan = !path.exists() && is_metadata(&meta);
    Ok(OutputFile::claim(&meta, force || is_orphan)?)
}

fn metadata_path(path: &Path) -> PathBuf {
    path.with_added_extension("meta.json")
}

/// Whether the file is metadata that this program wrote beside rows or a film.
fn is_metadata(path: &Path) -> bool {
    let meta = read_regular(path, MAX_METADATA_SIZE).unwrap_or_default();
    let meta: Json = serde_json::from_slice(&meta).unwrap_or_default();
    let checked = |key: &str| meta[key].is_string();
    meta["program"] == crate::files::PROGRAM && (checked("rows_crc32") || checked("film_crc32"))
}

/// Rejects a command whose outputs, or an output and its input, are one file; each path comes with its description.
///
/// # Errors
/// Usage, with the two.
pub fn check_distinct(named: &[(String, PathBuf)]) -> Result<(), Failure> {
    for (i, (what, path)) in named.iter().enumerate() {
        let others: Vec<&Path> = named[..i].iter().map(|(_, path)| path.as_path()).collect();
        if let Some(j) = same_file(path, &others) {
            return Err(Failure::usage(format!(
                "{what} and {} name the same file, {}: give each its own",
                named[j].0,
                path.display()
            )));
        }
    }
    Ok(())
}

/// Makes room for the rows of a run in `table`.
///
/// # Errors
/// Usage, with the numbers: more rows than a file holds, or than fit into memory.
pub fn reserve(table: &mut Table, rows: u64) -> Result<(), Failure> {
    let columns = table.columns().len();
    let values = rows.saturating_mul(columns as u64);
    let limit = if values > MAX_VALUES {
        format!("more than the limit of {} GiB", MAX_VALUES * 8 / (1 << 30))
    } else if !table.reserve(rows as usize) {
        "which do not fit into memory".to_owned()
    } else {
        return Ok(());
    };
    Err(Failure::usage(format!(
        "{rows} rows of {columns} columns are {:.1} GiB of numbers, {limit}; choose a longer --every or a shorter --duration (at most {} \
         rows), or fewer --channels",
        values as f64 * 8.0 / f64::from(1u32 << 30),
        MAX_VALUES / columns as u64,
    )))
}
