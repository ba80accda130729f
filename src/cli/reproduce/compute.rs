//! All jobs of a report, on some threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use indicatif::ProgressBar;

use super::interrupted;
use crate::analysis::reproduction::{Findings, Outcome, ReproductionError, Work};
use crate::analysis::response::ResponseError;
use crate::cli::{Failure, interrupt};

/// Does all of `work`; what comes out does not depend on the number of threads.
///
/// # Errors
/// Ctrl-C; a run that cannot be done, the first in order of the jobs that was begun.
pub(super) fn compute(work: Work, threads: usize, bar: &ProgressBar) -> Result<Findings, Failure> {
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let done: Mutex<Vec<(usize, Result<Outcome, ReproductionError>)>> = Mutex::new(Vec::new());
    let worker = || {
        loop {
            let job = next.fetch_add(1, Ordering::Relaxed);
            if job >= work.jobs() || stop.load(Ordering::Relaxed) {
                return;
            }
            let mut told = 0.0;
            let outcome = work.run(job, |now| {
                if now - told >= 1.0 {
                    bar.inc((now - told) as u64);
                    told += (now - told).floor();
                }
                !(stop.load(Ordering::Relaxed) || interrupt::asked())
            });
            bar.inc((work.length(job) - told).max(0.0).round() as u64);
            if outcome.is_err() {
                stop.store(true, Ordering::Relaxed);
            }
            // A thread that panicked has been told of already.
            let mut done = done
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner);
            done.push((job, outcome));
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.clamp(1, work.jobs()) {
            scope.spawn(worker);
        }
    });
    if interrupt::asked() {
        return Err(interrupted());
    }
    let mut done = done
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(job, _)| *job);
    let is_cancelled = |error: &ReproductionError| match error {
        ReproductionError::Run { error, .. } => matches!(**error, ResponseError::Cancelled),
        ReproductionError::Extent(_) => false,
    };
    let mut outcomes = Vec::with_capacity(done.len());
    for (_, outcome) in done {
        match outcome {
            Ok(outcome) => outcomes.push(outcome),
            Err(error) if is_cancelled(&error) => {}
            Err(error) => return Err(Failure::new(Failure::DIVERGED, error.to_string())),
        }
    }
    Ok(work.gather(outcomes))
}
