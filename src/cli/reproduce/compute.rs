//! Runs all jobs of a report on several threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use indicatif::ProgressBar;

use super::interrupted;
use super::kept::Kept;
use crate::analysis::reproduction::{Agenda, Outcome, Report, ReproductionError};
use crate::analysis::response::ResponseError;
use crate::cli::{Failure, interrupt};

/// Runs the jobs of `work` that `kept` lacks, and keeps their outcomes there; these depend neither on the number of
/// threads nor on interruptions.
///
/// # Errors
/// Ctrl-C; the file system; a run that fails: of those begun, the first in job order.
pub(super) fn compute(work: Agenda, kept: &mut Kept, threads: usize, bar: &ProgressBar) -> Result<Report, Failure> {
    let mut outcomes: Vec<Option<Outcome>> = (0..work.jobs()).map(|_| None).collect();
    for (job, outcome) in kept.found(&work)? {
        outcomes[job] = Some(outcome);
        bar.inc(work.length(job).round() as u64);
    }
    bar.reset_eta();
    let left: Vec<usize> = (0..work.jobs()).filter(|&job| outcomes[job].is_none()).collect();
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let mut done: Vec<(usize, Result<Outcome, Failure>)> = Vec::new();
    let shared = Mutex::new((kept, &mut done));
    let worker = || {
        while !stop.load(Ordering::Relaxed) {
            let Some(&job) = left.get(next.fetch_add(1, Ordering::Relaxed)) else {
                return;
            };
            let mut told = 0.0;
            let outcome = work.run(job, |now| {
                if now - told >= 1.0 {
                    bar.inc((now - told) as u64);
                    told += (now - told).floor();
                }
                !(stop.load(Ordering::Relaxed) || interrupt::asked())
            });
            bar.inc((work.length(job) - told).max(0.0).round() as u64);
            // A thread's panic has already been reported.
            let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
            let (kept, done) = &mut *shared;
            let outcome = match outcome {
                Ok(outcome) => kept.keep(&work, job, &outcome).map(|()| outcome),
                Err(error) if is_cancelled(&error) => return,
                Err(error) => Err(Failure::new(Failure::DIVERGED, error.to_string())),
            };
            if outcome.is_err() {
                stop.store(true, Ordering::Relaxed);
            }
            done.push((job, outcome));
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.clamp(1, work.jobs()) {
            scope.spawn(worker);
        }
    });
    let (kept, _) = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(job, _)| *job);
    for (job, outcome) in done {
        outcomes[job] = Some(outcome?);
    }
    let all: Option<Vec<Outcome>> = outcomes.into_iter().collect();
    match all {
        Some(outcomes) => Ok(work.gather(outcomes)),
        None => Err(interrupted(kept)),
    }
}

fn is_cancelled(error: &ReproductionError) -> bool {
    match error {
        ReproductionError::Run { error, .. } => matches!(**error, ResponseError::Cancelled),
        _ => false,
    }
}
