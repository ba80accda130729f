//! A background computation that several workers share: progress, remaining time, and time for the picture.

use eframe::egui::{ProgressBar, Ui};

use super::throttle::Throttle;
use crate::analysis::sweep_task::Share;
use crate::analysis::task::{Job, Message};
use crate::app::host::{BackgroundTask, Host};

/// Elapsed time below which no remaining time is estimated, s.
const MIN_ELAPSED: f64 = 1.0;

/// A running computation.
pub struct SharedJob {
    workers: Vec<Worker>,
    throttle: Throttle,
    /// Time of the first frame since the start, and of the latest frame, s.
    since: Option<f64>,
    now: f64,
}

/// A worker, and its completed fraction of the whole.
struct Worker {
    running: Box<dyn BackgroundTask>,
    done: f64,
    finished: bool,
}

impl SharedJob {
    /// Starts the shares of a job on all workers of `host`, at most `most` of them; `None` if that is impossible.
    pub fn start(host: &mut dyn Host, most: usize, job: impl Fn(Share) -> Job) -> Option<Self> {
        let of = host.workers().min(most).max(1);
        let worker = |index| {
            let running = host.start(job(Share { index, of }))?;
            Some(Worker { running, done: 0.0, finished: false })
        };
        let workers: Option<Vec<_>> = (0..of).map(worker).collect();
        Some(Self { workers: workers?, throttle: Throttle::default(), since: None, now: 0.0 })
    }

    /// Hands all results since the last call to `take`; returns whether a worker is still running.
    ///
    /// # Errors
    /// Why one of them has failed.
    pub fn poll(&mut self, mut take: impl FnMut(Message)) -> Result<bool, String> {
        for worker in &mut self.workers {
            while let Some(message) = worker.running.poll() {
                match message {
                    Message::Progress(done) => worker.done = done,
                    Message::Done => worker.finished = true,
                    Message::Failed(why) => return Err(why),
                    result => take(result),
                }
            }
        }
        Ok(self.workers.iter().any(|worker| !worker.finished))
    }

    /// Reports a frame at `now`, s, so that the workers yield time to the picture; `moves`: whether the picture is animated.
    pub fn report_frame(&mut self, now: f64, moves: bool) {
        self.since.get_or_insert(now);
        self.now = now;
        if let Some(rest) = self.throttle.frame(now, moves) {
            for worker in &mut self.workers {
                worker.running.rest(rest);
            }
        }
    }

    /// Progress in the rest of the row, with accessible `name`, for `what` is computed.
    pub fn ui(&self, ui: &mut Ui, name: &str, what: &str) {
        let done = self.completed_fraction();
        let mut words = format!("{} %", (100.0 * done).floor());
        if let Some(left) = self.remaining_time() {
            words += &format!(", {left}");
        }
        let help = format!(
            "Fraction of the {what} computed so far. While the picture moves, they leave time for 20 frames per second; they \
             are faster when the run is paused"
        );
        let bar = ProgressBar::new(done as f32).text(words);
        ui.add(bar.desired_width(ui.available_width())).on_hover_text(help).accessible_name(name);
    }

    /// Completed fraction, 0 to 1.
    fn completed_fraction(&self) -> f64 {
        self.workers.iter().map(|worker| worker.done).sum()
    }

    /// Estimated remaining time at the average speed so far; `None` while too little is known.
    fn remaining_time(&self) -> Option<String> {
        let (spent, done) = (self.now - self.since?, self.completed_fraction());
        (spent >= MIN_ELAPSED && done > 0.0).then(|| remaining_time_text(spent * (1.0 - done).max(0.0) / done))
    }
}

/// Formats a remaining time, s.
fn remaining_time_text(left: f64) -> String {
    match left {
        _ if left < 10.0 => "a few seconds left".to_owned(),
        _ if left < 90.0 => format!("about {} s left", 10.0 * (left / 10.0).round()),
        _ if left < 5400.0 => format!("about {} min left", (left / 60.0).round()),
        _ => format!("about {} h left", (left / 3600.0).round()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remaining_time_is_shown_no_finer_than_it_is_known() {
        for (left, words) in [
            (3.0, "a few seconds left"),
            (42.0, "about 40 s left"),
            (130.0, "about 2 min left"),
            (7500.0, "about 2 h left"),
        ] {
            assert_eq!(remaining_time_text(left), words);
        }
    }
}
