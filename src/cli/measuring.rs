//! Analyses timed on this machine, with a progress bar, until Ctrl-C.

use std::ops::ControlFlow;

use super::{Failure, interrupt, progress};
use crate::analysis::{AnalysisError, RunContext};
use crate::scene::Scene;

/// Parts of the progress bar.
const PARTS: f64 = 1000.0;

/// Runs `analysis`; an error of `scene` names the line of its file.
///
/// # Errors
/// Errors of the analysis; Ctrl-C.
pub fn measure<T>(
    quiet: bool,
    scene: Option<&Scene>,
    analysis: impl FnOnce(&mut RunContext) -> Result<T, AnalysisError>,
) -> Result<T, Failure> {
    interrupt::listen();
    let bar = progress::bar(!quiet, PARTS as u64);
    let mut clock = clock();
    let mut progress = |done: f64| {
        bar.set_position((done * PARTS) as u64);
        if interrupt::is_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let result = analysis(&mut RunContext::new(&mut clock, &mut progress));
    bar.finish_and_clear();
    result.map_err(|error| match (error, scene) {
        (AnalysisError::Cancelled, _) => {
            Failure::new(Failure::INTERRUPTED, "interrupted; nothing was written".to_owned())
        }
        (AnalysisError::Start(error), Some(scene)) => scene.locate(&error).into(),
        (AnalysisError::Scene(error), _) => error.into(),
        (error @ AnalysisError::Stopped(_), _) => Failure::new(Failure::DIVERGED, error.to_string()),
        (error, _) => Failure::usage(error.to_string()),
    })
}

/// Whether less than `most` s of processor time have passed on this thread since this call.
pub fn within(most: f64) -> impl FnMut() -> bool {
    let mut clock = clock();
    let end = clock() + most;
    move || clock() < end
}

/// Processor time of this thread, which does the stepping, s; it excludes other load on the machine.
#[cfg(unix)]
fn clock() -> impl FnMut() -> f64 {
    use rustix::time::{ClockId, clock_gettime};
    || {
        let time = clock_gettime(ClockId::ThreadCPUTime);
        time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
    }
}

/// Wall-clock time, s.
#[cfg(not(unix))]
fn clock() -> impl FnMut() -> f64 {
    let started = std::time::Instant::now();
    move || started.elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{StopAdvice, StopFault, Stopped};

    #[test]
    fn only_a_run_that_was_stopped_counts_as_diverged() {
        let code = |error| measure::<()>(true, None, |_| Err(error)).map_err(|f| f.code);
        let stopped = Stopped { time: 0.1, fault: StopFault::SingularLoops, advice: StopAdvice::Dependent };
        assert_eq!(code(stopped.into()), Err(Failure::DIVERGED));
        let too_long = AnalysisError::TooLong { cost: 1.0 };
        assert_eq!(code(too_long), Err(Failure::USAGE));
    }
}
