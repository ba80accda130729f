//! Ctrl-C, SIGTERM and SIGHUP end a run in an orderly way; repeating the signal ends it at once. A file that exceeds the limit on
//! its size is an error like a full disk, not the end of the process.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::Failure;

/// `timeout` signals its child and then the child's group: signals this close together are one request.
const ONE_REQUEST: Duration = Duration::from_secs(1);

static REQUESTED: AtomicBool = AtomicBool::new(false);
/// Whether a signal ends the process at once, because nothing needs to be written or removed.
static AT_ONCE: AtomicBool = AtomicBool::new(true);
static INSTALL: Once = Once::new();

/// To be called first of all: from now on these signals end the process at once, with the exit code of an interrupted run.
#[cfg(unix)]
pub fn begin() {
    use signal_hook::consts::SIGXFSZ;
    use signal_hook::flag;
    static FILE_TOO_LARGE: AtomicBool = AtomicBool::new(false);
    let code = i32::from(Failure::INTERRUPTED);
    let ends = signals().into_iter().map(|signal| flag::register_conditional_shutdown(signal, code, &AT_ONCE));
    // With a handler, the write fails instead.
    let too_large = std::iter::once_with(|| flag::register(SIGXFSZ, &FILE_TOO_LARGE));
    if let Some(Err(error)) = ends.chain(too_large).find(Result::is_err) {
        log::warn!("a signal will end the program without an exit code: {error}");
    }
}

/// Windows ends the process by itself.
#[cfg(not(unix))]
pub fn begin() {}

/// From now on these signals are recorded instead of ending the process. To be called before anything is written.
pub fn listen() {
    // A test that runs a command in its own process must still end on Ctrl-C.
    if cfg!(test) {
        return;
    }
    INSTALL.call_once(|| {
        let mut signals = Signals::default();
        let outcome = catch(move || {
            REQUESTED.store(true, Ordering::Relaxed);
            if signals.must_exit(Instant::now()) {
                std::process::exit(i32::from(Failure::INTERRUPTED));
            }
        });
        if let Err(error) = outcome {
            AT_ONCE.store(true, Ordering::SeqCst);
            log::warn!("Ctrl-C will end the program without writing its rows: {error}");
        }
    });
}

/// Whether the user requested the end of the run.
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// The signals received so far.
#[derive(Default)]
struct Signals {
    count: u32,
    first: Option<Instant>,
}

impl Signals {
    /// Records a signal and returns whether to exit at once: on the third, or on the second unless it just echoes the first.
    fn must_exit(&mut self, now: Instant) -> bool {
        self.count += 1;
        let first = *self.first.get_or_insert(now);
        self.count > 2 || now.duration_since(first) > ONE_REQUEST
    }
}

#[cfg(unix)]
fn catch(mut on_signal: impl FnMut() + Send + 'static) -> std::io::Result<()> {
    let mut signals = signal_hook::iterator::Signals::new(signals())?;
    AT_ONCE.store(false, Ordering::SeqCst);
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || signals.forever().for_each(|_| on_signal()))?;
    Ok(())
}

/// The signals that end a run.
#[cfg(unix)]
fn signals() -> Vec<i32> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let hang_up = (!outlives_its_terminal()).then_some(SIGHUP);
    [SIGINT, SIGTERM].into_iter().chain(hang_up).collect()
}

/// Whether `nohup` started the program, which then continues when its terminal is closed.
#[cfg(unix)]
#[expect(clippy::disallowed_methods, reason = "reads a file of the system")]
fn outlives_its_terminal() -> bool {
    use std::io::IsTerminal;
    match std::fs::read_to_string("/proc/self/status") {
        Ok(status) => {
            let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
            let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
            mask.is_some_and(|mask| mask & 1 != 0)
        }
        // Outside Linux: `nohup` redirects output away from the terminal.
        Err(_) => !std::io::stderr().is_terminal(),
    }
}

#[cfg(windows)]
fn catch(on_signal: impl FnMut() + Send + 'static) -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(on_signal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_echoed_signal_is_not_a_second_request_and_a_third_exits() {
        let start = Instant::now();
        let exits = |after: &[u64]| {
            let mut signals = Signals::default();
            let mut each = after.iter().map(|ms| start + Duration::from_millis(*ms));
            each.position(|now| signals.must_exit(now))
        };
        assert_eq!(exits(&[0, 20]), None);
        assert_eq!(exits(&[0, 0, 40]), Some(2));
        assert_eq!(exits(&[0, 20, 5000]), Some(2));
        assert_eq!(exits(&[0, 1500]), Some(1));
    }
}
