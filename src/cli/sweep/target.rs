//! The file that `sweep` and `merge` write: an archive, or a table of the points.

use std::path::Path;

use super::archive::{Archive, Source};
use super::{csv, parquet};
use crate::cli::Failure;
use crate::cli::output::{ChecksumWriter, claim_metadata, write_meta};
use crate::files::{OutputFile, publish};

/// The file to be written, claimed before the sweep runs.
pub struct Target {
    file: OutputFile,
    format: Format,
}

/// Its format, by its extension.
enum Format {
    /// All arrays.
    Npz,
    /// A table as text, with the metadata in a file of its own.
    Csv(OutputFile),
    /// A table with types.
    Parquet,
}

impl Target {
    /// Checks that `path` can be written; only an archive can hold a shard.
    ///
    /// # Errors
    /// An unknown extension, an existing file without `force`, or an unwritable folder.
    pub fn claim(path: &Path, force: bool, is_shard: bool) -> Result<Self, Failure> {
        let wrong = |what: &str| Failure::usage(format!("--out {}: {what}", path.display()));
        let extension =
            path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_ascii_lowercase();
        match &*extension {
            "npz" => {}
            "csv" | "parquet" if is_shard => {
                return Err(wrong("a shard is a NumPy archive; use the extension .npz, and a table for `merge`"));
            }
            "csv" | "parquet" => {}
            _ => {
                return Err(wrong(
                    "a sweep is written as a NumPy archive or as a table of points; use the extension .npz, .csv or .parquet",
                ));
            }
        }
        let file = OutputFile::claim(path, force)?;
        let format = match &*extension {
            "csv" => Format::Csv(claim_metadata(path, force)?),
            "parquet" => Format::Parquet,
            _ => Format::Npz,
        };
        Ok(Self { file, format })
    }

    /// Writes the result.
    ///
    /// # Errors
    /// A file system error; an existing file is then unchanged.
    pub fn write(self, archive: &Archive, source: &mut impl Source) -> Result<(), Failure> {
        let mut failure = None;
        let files = match self.format {
            Format::Npz => return archive.write(self.file, source),
            Format::Csv(metadata) => {
                let mut checksum = String::new();
                let rows = self.file.fill(|file| {
                    let mut file = ChecksumWriter::new(file);
                    csv::write(&mut file, archive, source, &mut failure)?;
                    checksum = file.checksum();
                    Ok(())
                });
                let mut meta = archive.meta().clone();
                meta.insert("rows_crc32".into(), checksum.into());
                // In this order, a kill between the two renames never leaves rows without metadata.
                rows.and_then(|rows| Ok(vec![metadata.fill(|file| write_meta(file, &meta))?, rows]))
            }
            Format::Parquet => {
                let rows = self.file.fill(|file| parquet::write(file, archive, source, &mut failure));
                rows.map(|rows| vec![rows])
            }
        };
        match failure {
            Some(failure) => Err(failure),
            None => Ok(publish(files?)?),
        }
    }
}
