//! A computation on its own thread.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Duration;

use web_time::Instant;

use super::host::BackgroundTask;
use crate::analysis::task::{Job, Message, perform};

/// Computing time between two rests, if the thread must rest.
const BUSY_TIME: Duration = Duration::from_millis(40);

/// A thread that runs a job. Dropping it cancels the job.
pub struct Thread {
    messages: Option<Receiver<Message>>,
    cancelled: Arc<AtomicBool>,
    /// Rest as a multiple of the computing time (`f64` bits).
    rest: Arc<AtomicU64>,
}

impl Thread {
    /// Starts `job`; `None` if the system cannot create a thread.
    pub fn start(job: Job) -> Option<Self> {
        let (sender, messages) = channel();
        let cancelled = Arc::new(AtomicBool::new(false));
        let is_cancelled = Arc::clone(&cancelled);
        let rest = Arc::new(AtomicU64::new(0.0_f64.to_bits()));
        let resting = Arc::clone(&rest);
        let work = move || {
            let mut spell = Instant::now();
            perform(&job, &mut |message| {
                // A closed receiver counts as cancellation.
                if is_cancelled.load(Ordering::Relaxed) || sender.send(message).is_err() {
                    return ControlFlow::Break(());
                }
                let computed = spell.elapsed();
                if computed >= BUSY_TIME {
                    let rest = f64::from_bits(resting.load(Ordering::Relaxed));
                    std::thread::sleep(computed.mul_f64(rest));
                    spell = Instant::now();
                }
                ControlFlow::Continue(())
            });
        };
        let builder = std::thread::Builder::new().name("computation".to_owned());
        builder.spawn(work).ok()?;
        Some(Self { messages: Some(messages), cancelled, rest })
    }
}

impl BackgroundTask for Thread {
    fn poll(&mut self) -> Option<Message> {
        match self.messages.as_ref()?.try_recv() {
            Ok(message) => {
                if matches!(message, Message::Done | Message::Failed(_)) {
                    self.messages = None;
                }
                Some(message)
            }
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.messages = None;
                // A thread that ended without a final message was cancelled or has failed.
                let cancelled = self.cancelled.load(Ordering::Relaxed);
                (!cancelled).then(|| Message::Failed("the computation stopped unexpectedly".to_owned()))
            }
        }
    }

    fn rest(&mut self, rest: f64) {
        self.rest.store(rest.to_bits(), Ordering::Relaxed);
    }

    fn cancel(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}

impl Drop for Thread {
    fn drop(&mut self) {
        self.cancel();
    }
}
