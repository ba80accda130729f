//! Work outside the interpreter's lock.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::prelude::*;

use crate::errors::exception;

/// Steps of a simulation between two checks for Ctrl-C; they take some milliseconds.
pub const STEPS_BETWEEN_CHECKS: u32 = 4096;

/// Runs `work` without the interpreter's lock.
///
/// # Errors
/// A panic in `work`, which is a bug, as `InternalError`.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    // After a panic, which is reported as a bug, the values it interrupted are not used again.
    py.detach(|| catch_unwind(AssertUnwindSafe(work))).map_err(|panic| internal_error(py, &*panic))
}

/// Runs `work` while holding the interpreter's lock: for short work, or work that calls Python.
///
/// # Errors
/// A panic in `work`, which is a bug, as `InternalError`.
pub fn guarded<T>(py: Python<'_>, work: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| internal_error(py, &*panic))
}

fn internal_error(py: Python<'_>, panic: &(dyn Any + Send)) -> PyErr {
    let cause = panic.downcast_ref::<&str>().copied().or(panic.downcast_ref::<String>().map(String::as_str));
    let message = format!(
        "internal error in jointplay {}: {}. This is a bug in the program; please report this line and the call that led \
         to it.",
        env!("CARGO_PKG_VERSION"),
        cause.unwrap_or("unknown cause"),
    );
    exception(py, "InternalError", &message, None)
}

/// Calls `progress` with the finished fraction, 0 to 1, and raises a pending `KeyboardInterrupt`.
///
/// # Errors
/// `KeyboardInterrupt`, or what `progress` raises.
pub fn report_progress(py: Python<'_>, progress: Option<&Bound<'_, PyAny>>, fraction: f64) -> PyResult<()> {
    py.check_signals()?;
    if let Some(progress) = progress {
        progress.call1((fraction.clamp(0.0, 1.0),))?;
    }
    Ok(())
}
