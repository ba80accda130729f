//! The clock that measures stepping time; it is injected, so that tests can control it.

use std::sync::OnceLock;

use web_time::Instant;

/// Seconds since an arbitrary origin, to measure the stepping time of a frame.
pub type Clock = fn() -> f64;

/// Wall-clock time.
pub fn wall() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}
