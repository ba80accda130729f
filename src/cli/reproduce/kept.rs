//! Finished blocks of the sweeps, kept beside the report until it is written, so that an interrupted report resumes where
//! it stopped. Everything else takes seconds and is recomputed.

use std::path::{Path, PathBuf};

use crate::analysis::reproduction::{Agenda, Outcome};
use crate::cli::Failure;
use crate::cli::sweep::{Partial, meta};
use crate::cli::warn;
use crate::files::{create_dir_all, remove_dir};

/// One file per sweep, in a folder of their own.
pub(super) struct Kept {
    folder: PathBuf,
    parts: Vec<Partial>,
}

impl Kept {
    /// Opens or creates the folder beside `out`.
    ///
    /// # Errors
    /// As [`Partial::open`].
    pub(super) fn open(out: &Path, work: &Agenda) -> Result<Self, Failure> {
        // By components, which drops a trailing slash.
        let mut name = out.components().as_path().as_os_str().to_owned();
        name.push(".partial");
        let folder = PathBuf::from(name);
        create_dir_all(&folder).map_err(|e| Failure::io(format!("cannot write {}: {e}", folder.display())))?;
        let part = |data: &crate::analysis::reproduction::SweepData| {
            let blocks: Vec<usize> = (0..data.sweep.grid().blocks()).collect();
            let settings = meta(&data.sweep);
            Partial::open(&folder.join(data.file_name()), &settings, &data.sweep, &blocks)
        };
        let parts = work.sweeps().iter().map(part);
        let parts = parts.collect::<Result<_, Failure>>()?;
        Ok(Self { folder, parts })
    }

    /// Its folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether an earlier run left anything.
    pub(super) fn is_begun(&self) -> bool {
        self.parts.iter().any(Partial::is_begun)
    }

    /// Outcomes of earlier runs, by job.
    ///
    /// # Errors
    /// The file system.
    pub(super) fn found(&self, work: &Agenda) -> Result<Vec<(usize, Outcome)>, Failure> {
        let mut parts = Vec::new();
        for part in &self.parts {
            parts.push(part.blocks()?);
        }
        let of = |job: usize| {
            let (s, b) = work.block(job)?;
            Some((job, Outcome::Block(parts[s].remove(&b)?)))
        };
        Ok((0..work.jobs()).filter_map(of).collect())
    }

    /// Keeps the outcome of a job if it is a block.
    ///
    /// # Errors
    /// The file system.
    pub(super) fn keep(&mut self, work: &Agenda, job: usize, outcome: &Outcome) -> Result<(), Failure> {
        match (work.block(job), outcome) {
            (Some((s, b)), Outcome::Block(records)) => self.parts[s].append(b, records),
            _ => Ok(()),
        }
    }

    /// Removes the folder: its content is in the report.
    pub(super) fn remove(self) {
        self.parts.into_iter().for_each(Partial::remove);
        if let Err(error) = remove_dir(&self.folder) {
            warn(&format!("{} is no longer needed and could not be removed: {error}", self.folder.display()));
        }
    }
}
