//! Ctrl-C ends a run in good order; a second one ends it at once.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use super::Failure;

static ASKED: AtomicBool = AtomicBool::new(false);
static LISTEN: Once = Once::new();

/// From now on Ctrl-C is noted instead of ending the process.
pub fn listen() {
    LISTEN.call_once(|| {
        let outcome = ctrlc::set_handler(|| {
            if ASKED.swap(true, Ordering::Relaxed) {
                std::process::exit(i32::from(Failure::INTERRUPTED));
            }
        });
        if let Err(error) = outcome {
            log::warn!("Ctrl-C will end the program without writing its rows: {error}");
        }
    });
}

/// Whether Ctrl-C was pressed.
pub fn asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
