//! Runs all jobs of a report on several threads. Finished blocks of the sweeps are kept beside the report until it is written,
//! so that an interrupted report resumes where it stopped; everything else takes seconds and is recomputed.

use std::path::{Path, PathBuf};

use indicatif::ProgressBar;

use crate::analysis::reproduction::{Agenda, Outcome, Report, RunError, SweepData};
use crate::analysis::response::ResponseError;
use crate::cli::sweep::{Partial, meta};
use crate::cli::workers::run_jobs;
use crate::cli::{Failure, warn};
use crate::files::{create_dir_all, remove_dir};

/// The finished blocks: one file per sweep, in a folder of their own.
pub(super) struct FinishedBlocks {
    folder: PathBuf,
    parts: Vec<Partial>,
}

impl FinishedBlocks {
    /// Opens or creates the folder beside `out`.
    ///
    /// # Errors
    /// As [`Partial::open`].
    pub(super) fn open(out: &Path, work: &Agenda) -> Result<Self, Failure> {
        // Going through components drops a trailing slash.
        let mut name = out.components().as_path().as_os_str().to_owned();
        name.push(".partial");
        let folder = PathBuf::from(name);
        create_dir_all(&folder).map_err(|e| Failure::io(format!("cannot write {}: {e}", folder.display())))?;
        let part = |data: &SweepData| {
            let blocks: Vec<usize> = (0..data.sweep.design().blocks()).collect();
            Partial::open(&folder.join(data.file_name()), &meta(&data.sweep), &data.sweep, &blocks)
        };
        let parts = work.sweeps().iter().map(part).collect::<Result<_, Failure>>()?;
        Ok(Self { folder, parts })
    }

    /// The folder, if an earlier run left anything there.
    pub(super) fn resumed_folder(&self) -> Option<&Path> {
        self.parts.iter().any(Partial::has_finished_blocks).then_some(&self.folder)
    }

    /// The error of a report interrupted by Ctrl-C.
    pub(super) fn interrupted(&self) -> Failure {
        let folder = self.folder.display();
        let message = format!("interrupted; no report was written, and the same command resumes from {folder}");
        Failure::new(Failure::INTERRUPTED, message)
    }

    /// Removes the folder once the report has its content.
    pub(super) fn remove(self) {
        self.parts.into_iter().for_each(Partial::remove);
        if let Err(error) = remove_dir(&self.folder) {
            warn(&format!("{} is no longer needed and could not be removed: {error}", self.folder.display()));
        }
    }
}

/// Runs the jobs of `work` that `finished` lacks; their outcomes depend neither on the number of threads nor on interruptions.
///
/// # Errors
/// Ctrl-C; the file system; the first failed run in job order, among those started.
pub(super) fn compute(
    work: Agenda,
    finished: &mut FinishedBlocks,
    threads: usize,
    bar: &ProgressBar,
) -> Result<Report, Failure> {
    let mut outcomes: Vec<Option<Outcome>> = (0..work.jobs()).map(|_| None).collect();
    let mut blocks = finished.parts.iter().map(Partial::blocks).collect::<Result<Vec<_>, _>>()?;
    for (job, outcome) in outcomes.iter_mut().enumerate() {
        *outcome = work.block(job).and_then(|(s, b)| Some(Outcome::Block(blocks[s].remove(&b)?)));
        bar.inc(if outcome.is_some() { work.length(job).round() as u64 } else { 0 });
    }
    bar.reset_eta();
    let remaining: Vec<usize> = (0..work.jobs()).filter(|&job| outcomes[job].is_none()).collect();
    let run = |job: usize, may_continue: &dyn Fn() -> bool| {
        let mut reported = 0.0;
        let outcome = work.run(job, |now| {
            bar.inc((now - reported) as u64);
            reported += f64::floor(now - reported);
            may_continue()
        });
        bar.inc((work.length(job) - reported).max(0.0).round() as u64);
        match outcome {
            Err(RunError { error, .. }) if matches!(*error, ResponseError::Cancelled) => None,
            outcome => Some(outcome.map_err(|error| Failure::new(Failure::DIVERGED, error.to_string()))),
        }
    };
    run_jobs(&remaining, threads, run, |job, outcome| {
        if let (Some((s, b)), Outcome::Block(records)) = (work.block(job), &outcome) {
            finished.parts[s].append(b, records)?;
        }
        outcomes[job] = Some(outcome);
        Ok(())
    })?;
    let outcomes: Option<Vec<Outcome>> = outcomes.into_iter().collect();
    outcomes.map(|outcomes| work.gather(outcomes)).ok_or_else(|| finished.interrupted())
}
