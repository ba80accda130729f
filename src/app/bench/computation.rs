//! A background computation that a panel of the bench starts and stops: the request, the running job, and why it failed.

use eframe::egui::{Button, Ui, vec2};

use super::shared_job::SharedJob;
use crate::analysis::sweep_task::Share;
use crate::analysis::task::{Job, Message};
use crate::app::host::Host;

/// Width of the start/stop button, points; fixed, so that it does not move.
const BUTTON_WIDTH: f32 = 120.0;

/// The computation of tasks of type `T`.
pub(super) struct Computation<T> {
    pub requested: Option<T>,
    pub running: Option<Running<T>>,
    pub problem: Option<String>,
}

/// A task being computed.
pub(super) struct Running<T> {
    pub task: T,
    job: SharedJob,
    /// Whether the first message, about what is being computed, has arrived.
    has_plan: bool,
}

impl<T> Default for Computation<T> {
    fn default() -> Self {
        Self { requested: None, running: None, problem: None }
    }
}

impl<T: Clone> Computation<T> {
    /// Starts a requested task on at most `most` workers, and passes messages of a running one to `take`, which returns whether
    /// the message is the plan; later plans are left out. Returns whether a task is running. `name` says what it computes, and
    /// `explain` rewords a failure.
    pub fn update(
        &mut self,
        host: &mut dyn Host,
        name: &str,
        most: impl Fn(&T) -> usize,
        job: fn(T, Share) -> Job,
        mut take: impl FnMut(&T, Message),
        explain: impl Fn(&T, String) -> String,
    ) -> bool {
        if let Some(task) = self.requested.take() {
            self.problem = None;
            let started = SharedJob::start(host, most(&task), |share| job(task.clone(), share));
            self.running = started.map(|job| Running { task, job, has_plan: false });
            if self.running.is_none() {
                self.problem = Some(format!("{name} cannot be computed here"));
            }
        }
        let Some(Running { task, job, has_plan }) = &mut self.running else {
            return false;
        };
        let polled = job.poll(|message| {
            // Every worker sends the plan.
            let is_plan = matches!(message, Message::Plan(_) | Message::Ranges(_) | Message::Axes(_));
            if !is_plan || !std::mem::replace(has_plan, true) {
                take(task, message);
            }
        });
        match polled {
            Ok(true) => return true,
            Ok(false) => {}
            Err(why) => self.problem = Some(explain(task, why)),
        }
        self.running = None;
        false
    }

    /// Reports a frame at `now`, s, so that a running task yields time to the picture; `moves`: whether the picture is animated.
    pub fn report_frame(&mut self, now: f64, moves: bool) {
        if let Some(running) = &mut self.running {
            running.job.report_frame(now, moves);
        }
    }

    /// Whether a task is running or requested.
    pub fn is_running(&self) -> bool {
        self.running.is_some() || self.requested.is_some()
    }

    /// Whether the latest results belong to the requested task, or no task is pending.
    pub fn has_current_results(&self) -> bool {
        self.requested.is_none() && self.running.as_ref().is_none_or(|running| running.has_plan)
    }

    /// Drops the requested and the running task.
    pub fn stop(&mut self) {
        (self.running, self.requested) = (None, None);
    }

    /// The button that starts or stops, each with its tooltip, and the progress, called `done`, in so many `what`. Returns whether
    /// a task is to start.
    pub fn button(&mut self, ui: &mut Ui, start: [&str; 2], stop: [&str; 2], [done, what]: [&str; 2]) -> bool {
        let running = self.is_running();
        let [name, help] = if running { stop } else { start };
        let clicked = ui.horizontal(|ui| {
            let button = Button::new(name).min_size(vec2(BUTTON_WIDTH, 0.0));
            let clicked = ui.add(button).on_hover_text(help).clicked();
            if let Some(running) = &self.running {
                running.job.ui(ui, done, what);
            }
            clicked
        });
        if clicked.inner && running {
            self.stop();
        }
        clicked.inner && !running
    }
}
