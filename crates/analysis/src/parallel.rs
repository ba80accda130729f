//! Independent jobs on several threads of this machine.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use rayon::ThreadPoolBuilder;

/// Time between two calls of a watcher while no job finishes.
const WATCH_INTERVAL: Duration = Duration::from_millis(50);

/// The system starts no threads.
#[derive(Debug, thiserror::Error)]
#[error("cannot start {threads} threads: {cause}")]
pub struct NoThreads {
    /// Requested number.
    threads: usize,
    /// Why.
    cause: rayon::ThreadPoolBuildError,
}

/// Performs `work` for each of `jobs` on `threads` threads. `watch` is called on this thread with each result, and without one at
/// least every 50 ms; no job starts after it breaks, and it still gets what is finished. `work` gets a function that returns whether to continue, and returns `None`
/// if it stopped early.
///
/// # Errors
/// The system starts no threads.
///
/// # Panics
/// If a job panics; the jobs that run then end first.
pub fn run_parallel<T: Send>(
    jobs: &[usize],
    threads: usize,
    work: impl Fn(usize, &dyn Fn() -> bool) -> Option<T> + Sync,
    mut watch: impl FnMut(Option<(usize, T)>) -> ControlFlow<()>,
) -> Result<(), NoThreads> {
    let threads = threads.clamp(1, jobs.len().max(1));
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().map_err(|cause| NoThreads { threads, cause })?;
    let stop = AtomicBool::new(false);
    let (stop, work) = (&stop, &work);
    pool.in_place_scope_fifo(|scope| {
        let (send, results) = mpsc::channel();
        for &job in jobs {
            let send = send.clone();
            scope.spawn_fifo(move |_| {
                let may_continue = || !stop.load(Ordering::Relaxed);
                let on_panic = StopOnPanic(stop);
                if let Some(result) = may_continue().then(|| work(job, &may_continue)).flatten() {
                    // The receiver outlives the jobs.
                    let _ = send.send((job, result));
                }
                drop(on_panic);
            });
        }
        drop(send);
        loop {
            let result = match results.recv_timeout(WATCH_INTERVAL) {
                Ok(result) => Some(result),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            let is_stopped = stop.load(Ordering::Relaxed) && result.is_none();
            if !is_stopped && watch(result).is_break() {
                stop.store(true, Ordering::Relaxed);
            }
        }
    });
    Ok(())
}

/// Stops the other jobs when one panics.
struct StopOnPanic<'a>(&'a AtomicBool);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;

    #[test]
    fn every_job_is_done_once_on_any_number_of_threads() {
        let jobs: Vec<usize> = (0..100).map(|job| 3 * job).collect();
        for threads in [1, 2, 7, 1000] {
            let mut done = Vec::new();
            let watch = |result: Option<(usize, usize)>| {
                done.extend(result);
                ControlFlow::Continue(())
            };
            run_parallel(&jobs, threads, |job, _| Some(job + 1), watch).expect("threads");
            done.sort_unstable();
            assert_eq!(done, jobs.iter().map(|&job| (job, job + 1)).collect::<Vec<_>>());
        }
        run_parallel(&[], 2, |job, _| Some(job), |_| panic!("nothing to watch")).expect("threads");
    }

    #[test]
    fn no_job_starts_after_the_watcher_has_stopped() {
        let jobs: Vec<usize> = (0..1000).collect();
        let (mut seen, finished) = (0, AtomicUsize::new(0));
        // Without the watcher's word the jobs from 8 on would never end.
        let work = |job: usize, may_continue: &dyn Fn() -> bool| {
            while job >= 8 && may_continue() {
                std::thread::yield_now();
            }
            (job < 8).then(|| finished.fetch_add(1, Ordering::Relaxed))
        };
        let watch = |result: Option<(usize, usize)>| {
            seen += usize::from(result.is_some());
            if seen >= 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        run_parallel(&jobs, 4, work, watch).expect("threads");
        // No finished result is lost.
        assert!(seen >= 3 && seen == finished.into_inner(), "{seen}");
    }

    #[test]
    #[should_panic = "job 1"]
    fn a_panic_stops_the_other_jobs_and_goes_on() {
        let work = |job: usize, may_continue: &dyn Fn() -> bool| -> Option<()> {
            assert!(job != 1, "job 1");
            while may_continue() {
                std::thread::yield_now();
            }
            None
        };
        let _ = run_parallel(&[0, 1, 2], 2, work, |_| ControlFlow::Continue(()));
    }
}
