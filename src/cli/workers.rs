//! Independent jobs on several threads, for sweeps.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::{sync::mpsc, thread};

use super::{Failure, interrupt};

/// Runs `work` for each job of `todo` and passes the results to `receive` on this thread as they arrive. No job starts after
/// Ctrl-C or a failure. `work` gets a function that returns whether to continue, and returns `None` if it stopped early.
///
/// # Errors
/// The error of `work` or `receive` whose job comes first in `todo`.
pub fn run_jobs<T: Send>(
    todo: &[usize],
    threads: usize,
    work: impl Fn(usize, &dyn Fn() -> bool) -> Option<Result<T, Failure>> + Sync,
    mut receive: impl FnMut(usize, T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let may_continue = || !(stop.load(Ordering::Relaxed) || interrupt::is_requested());
    let worker = |send: mpsc::SyncSender<(usize, Result<T, Failure>)>| {
        while let Some(&job) = todo.get(next.fetch_add(1, Ordering::Relaxed)).filter(|_| may_continue()) {
            let Some(result) = work(job, &may_continue) else {
                return;
            };
            // The receiver outlives the threads.
            let _ = send.send((job, result));
        }
    };
    let mut failed: Option<(usize, Failure)> = None;
    thread::scope(|scope| {
        let (send, results) = mpsc::sync_channel(threads);
        for _ in 0..threads.min(todo.len()) {
            let send = send.clone();
            scope.spawn(|| worker(send));
        }
        drop(send);
        for (job, result) in results {
            let received = match result {
                Ok(result) if failed.is_none() => receive(job, result),
                result => result.map(|_| ()),
            };
            if let Err(failure) = received {
                stop.store(true, Ordering::Relaxed);
                if failed.as_ref().is_none_or(|(first, _)| job < *first) {
                    failed = Some((job, failure));
                }
            }
        }
    });
    failed.map_or(Ok(()), |(_, failure)| Err(failure))
}
