//! The file that `sweep` and `merge` write: an archive, or a table with its metadata beside it.

use std::path::Path;

use super::archive::{Archive, Source};
use super::csv;
use crate::cli::Failure;
use crate::cli::output::{ChecksumWriter, Format, claim_account, write_meta};
use crate::files::{OutputFile, publish};

/// The file to be written, claimed before the sweep runs.
pub struct Target {
    file: OutputFile,
    /// Metadata beside a table.
    account: Option<OutputFile>,
}

impl Target {
    /// Checks that `path` can be written; only an archive can hold a shard.
    ///
    /// # Errors
    /// Another ending, an existing file without `force`, or an unwritable folder.
    pub fn claim(path: &Path, force: bool, is_shard: bool) -> Result<Self, Failure> {
        let wrong = |what: &str| Failure::usage(format!("--out {}: {what}", path.display()));
        let account = match Format::of(path) {
            Ok(Format::Npz) => false,
            Ok(Format::Csv) if is_shard => {
                return Err(wrong("a shard is a NumPy archive; use the extension .npz, and .csv for `merge`"));
            }
            Ok(Format::Csv) => true,
            _ => {
                return Err(wrong(
                    "a sweep is written as a NumPy archive or as a table of points; use the extension .npz or .csv",
                ));
            }
        };
        let file = OutputFile::claim(path, force)?;
        let account = if account { Some(claim_account(path, force)?) } else { None };
        Ok(Self { file, account })
    }

    /// Writes the result.
    ///
    /// # Errors
    /// A file system error; an existing file is then unchanged.
    pub fn write(self, archive: &Archive, source: &mut impl Source) -> Result<(), Failure> {
        let Some(account) = self.account else {
            return archive.write(self.file, source);
        };
        let mut failure = None;
        let mut checksum = String::new();
        let rows = self.file.fill(|file| {
            let mut file = ChecksumWriter::new(file);
            csv::write(&mut file, archive, source, &mut failure)?;
            checksum = file.checksum();
            Ok(())
        });
        if let Some(failure) = failure {
            return Err(failure);
        }
        let mut meta = archive.meta().clone();
        meta.insert("rows_crc32".into(), checksum.into());
        let account = account.fill(|file| write_meta(file, &meta))?;
        // In this order, a kill between the two renames never leaves rows without metadata.
        Ok(publish(vec![account, rows?])?)
    }
}
