//! Ctrl-C, SIGTERM and SIGHUP end a run in an orderly way; repeating the signal ends it at once.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::Failure;

/// `timeout` signals its child and then the child's group: signals this close together are one request.
const ONE_REQUEST: Duration = Duration::from_secs(1);

static REQUESTED: AtomicBool = AtomicBool::new(false);
static INSTALL: Once = Once::new();

/// From now on these signals are recorded instead of ending the process.
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
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    if !outlives_its_terminal() {
        signals.add_signal(SIGHUP)?;
    }
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || signals.forever().for_each(|_| on_signal()))?;
    Ok(())
}

/// Whether `nohup` started the program, which then continues when its terminal is closed.
#[cfg(unix)]
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
