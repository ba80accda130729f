//! Long computations as plain data, so that a desktop thread and a browser worker run the same code.

use std::ops::ControlFlow;
use std::pin::pin;
use std::task::{Context, Waker};

use serde::{Deserialize, Serialize};

use super::RunContext;
use super::map_task::{self, MapMessage, MapTask};
use super::one_at_a_time_task::{self, OneAtATimeMessage, OneAtATimeReport, OneAtATimeRun, OneAtATimeTask};
use super::presets::{self, Measured};
use super::source::{SceneSource, TaskFault};
use super::sweep_task::{self, Range, Share, SweepMessage, SweepTask, SweptPoint};
use jointplay_physics::machine::Preset;

/// A computation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Job {
    /// Speed and error of presets on a scene in its current form.
    Presets {
        /// The scene.
        scene: SceneSource,
        /// Words of `solver.preset`.
        presets: Vec<String>,
    },
    /// Points of a sweep, or a share of them.
    Sweep(SweepTask, Share),
    /// One-at-a-time runs of uncertain parameters, or a share of them.
    OneAtATime(OneAtATimeTask, Share),
    /// The tip's error over the workspace.
    Map(MapTask),
}

/// Messages of a running computation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Message {
    /// Fraction done, 0 to 1; for a share, as a fraction of the whole.
    Progress(f64),
    /// Measurements of the requested presets, by their words.
    Presets(Vec<(String, Measured)>),
    /// The accepted ranges of a sweep; its points follow.
    Ranges(Vec<Range>),
    /// A point of a sweep.
    Point(Box<SweptPoint>),
    /// The accepted one-at-a-time runs; their results follow.
    Plan(OneAtATimeReport),
    /// A finished one-at-a-time run.
    Run(OneAtATimeRun),
    /// A message about a map.
    Map(MapMessage),
    /// End of the results.
    Done,
    /// The computation failed, for this reason.
    Failed(String),
}

impl From<SweepMessage> for Message {
    fn from(message: SweepMessage) -> Self {
        match message {
            SweepMessage::Progress(done) => Self::Progress(done),
            SweepMessage::Ranges(ranges) => Self::Ranges(ranges),
            SweepMessage::Point(point) => Self::Point(point),
        }
    }
}

impl From<OneAtATimeMessage> for Message {
    fn from(message: OneAtATimeMessage) -> Self {
        match message {
            OneAtATimeMessage::Progress(done) => Self::Progress(done),
            OneAtATimeMessage::Plan(plan) => Self::Plan(plan),
            OneAtATimeMessage::Run(run) => Self::Run(run),
        }
    }
}

/// Runs `job`. `clock` returns seconds from any origin; `report` receives each message and may cancel. The last message is
/// [`Message::Done`] or [`Message::Failed`], unless cancelled.
pub fn perform(job: &Job, clock: &mut dyn FnMut() -> f64, report: &mut dyn FnMut(Message) -> ControlFlow<()>) {
    let mut rest = async || {};
    let performed = pin!(perform_with_rests(job, clock, report, &mut rest));
    let end = performed.poll(&mut Context::from_waker(Waker::noop()));
    assert!(end.is_ready(), "without rests, nothing waits");
}

/// As [`perform`], but a computation that can be shared awaits `rest` every few milliseconds, so that other work can proceed.
pub async fn perform_with_rests(
    job: &Job,
    clock: &mut dyn FnMut() -> f64,
    report: &mut dyn FnMut(Message) -> ControlFlow<()>,
    rest: &mut impl AsyncFnMut(),
) {
    let outcome = match job {
        Job::Presets { scene, presets } => measure_presets(scene, presets, clock, report),
        Job::Map(task) => map_task::run(task, &mut |message| report(Message::Map(message)), rest).await,
        Job::Sweep(task, share) => sweep_task::run(task, *share, &mut |message| report(message.into()), rest).await,
        Job::OneAtATime(task, share) => {
            one_at_a_time_task::run(task, *share, &mut |message| report(message.into()), rest).await
        }
    };
    let last = match outcome {
        Ok(()) => Message::Done,
        Err(TaskFault::Cancelled) => return,
        Err(fault) => Message::Failed(fault.to_string()),
    };
    // After the last message there is nothing to cancel.
    let _ = report(last);
}

fn measure_presets(
    scene: &SceneSource,
    words: &[String],
    clock: &mut dyn FnMut() -> f64,
    report: &mut dyn FnMut(Message) -> ControlFlow<()>,
) -> Result<(), TaskFault> {
    let scene = scene.scene()?;
    let presets: Vec<Preset> = words
        .iter()
        .map(|word| {
            let found = Preset::ALL.into_iter().find(|preset| preset.word() == word);
            found.ok_or_else(|| TaskFault::NoPreset(word.clone()))
        })
        .collect::<Result<_, _>>()?;
    let mut progress = |done| report(Message::Progress(done));
    let points = presets::measure(&scene, &presets, &mut RunContext::new(clock, &mut progress))?;
    let measured = points.iter().map(Measured::of);
    let message = Message::Presets(words.iter().cloned().zip(measured).collect());
    match report(message) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(TaskFault::Cancelled),
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;
    use std::task::Poll;

    use super::*;
    use crate::design::Start;
    use jointplay_scene::Scene;

    fn job(changes: &[(&str, &str)], presets: &[&str]) -> Job {
        let owned = |&(k, v): &(&str, &str)| (k.to_owned(), v.to_owned());
        let changes: Vec<_> = changes.iter().map(owned).collect();
        let scene = Scene::load("pendulum", &changes).expect("built in");
        Job::Presets { scene: SceneSource::of(&scene), presets: presets.iter().map(|&word| word.to_owned()).collect() }
    }

    /// The first messages of `job`, up to `limit`, after which it is cancelled.
    fn messages(job: &Job, limit: usize) -> Vec<Message> {
        let mut ticks = 0.0;
        let mut clock = || {
            ticks += 1e-3;
            ticks
        };
        let mut received = Vec::new();
        perform(job, &mut clock, &mut |message| {
            received.push(message);
            if received.len() < limit { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        received
    }

    #[test]
    fn a_preset_is_measured_on_the_changed_scene() {
        let job = job(&[("contact.clearance", "0.2 mm")], &["preview"]);
        // A job must survive its serialisation as text.
        let text = serde_json::to_string(&job).expect("plain data");
        let job: Job = serde_json::from_str(&text).expect("its own text");
        let received = messages(&job, usize::MAX);
        assert_eq!(received.last(), Some(&Message::Done));
        let Some(Message::Presets(found)) = received.iter().rev().nth(1) else {
            panic!("{received:?}");
        };
        let error = found[0].1.peak_error.expect("the pendulum has impacts");
        assert!(error > 0.0 && error < 0.2, "{error}");
        assert!(received.iter().any(|m| matches!(m, Message::Progress(p) if *p > 0.5)));
    }

    #[test]
    fn a_sweep_with_rests_sends_the_same_messages() {
        let scene = Scene::load("slider-crank-driven", &[]).expect("built in");
        let task = SweepTask {
            scene: SceneSource::of(&scene),
            vary: vec!["contact.clearance=0.2mm..0.4mm:2".to_owned()],
            periods: 3,
            discard: 1,
            phase: 0.0,
            start: Start::Cold,
            exponent: false,
        };
        let job = Job::Sweep(task, Share::WHOLE);
        let (mut received, mut rests, mut waits) = (Vec::new(), 0, 0);
        let mut report = |message| {
            received.push(message);
            ControlFlow::Continue(())
        };
        let mut rest = async || {
            let mut woken = false;
            rests += 1;
            poll_fn(|_| match std::mem::replace(&mut woken, true) {
                true => Poll::Ready(()),
                false => Poll::Pending,
            })
            .await;
        };
        let mut clock = || 0.0;
        {
            let mut sweep = pin!(perform_with_rests(&job, &mut clock, &mut report, &mut rest));
            let mut context = Context::from_waker(Waker::noop());
            while sweep.as_mut().poll(&mut context).is_pending() {
                waits += 1;
            }
        }
        assert!(rests > 2 && waits == rests, "{rests} rests, {waits} waits");
        assert_eq!(received, messages(&job, usize::MAX));
    }

    #[test]
    fn a_cancelled_job_sends_no_further_messages_and_faults_are_reported() {
        assert_eq!(messages(&job(&[], &["preview"]), 3).len(), 3);
        let received = messages(&job(&[], &["quick"]), usize::MAX);
        assert!(matches!(&received[..], [Message::Failed(why)] if why.contains("quick")));
    }
}
