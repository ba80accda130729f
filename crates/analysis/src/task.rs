//! Long computations as plain data, so that a thread on the desktop and a worker in the browser run the same code.

use std::ops::ControlFlow;
use std::pin::pin;
use std::task::{Context, Waker};

use serde::{Deserialize, Serialize};

use super::RunContext;
use super::alone_task::{self, AloneMessage, AlonePlan, AloneRun, AloneTask};
use super::map_task::{self, MapMessage, MapTask};
use super::presets::{self, Measured};
use super::source::{SceneSource, TaskFault};
use super::sweep_task::{self, Range, Share, SweepMessage, SweepTask, SweptPoint};
use jointplay_physics::machine::Preset;

/// A computation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Job {
    /// Cost and error of presets on a scene as it is.
    Presets {
        /// The scene.
        scene: SceneSource,
        /// Words of `solver.preset`.
        presets: Vec<String>,
    },
    /// Points over a range of a parameter, or a share of them.
    Sweep(SweepTask, Share),
    /// The effect of each uncertain parameter alone, or a share of its runs.
    Alone(AloneTask, Share),
    /// The tip's error over the workspace.
    Map(MapTask),
}

/// Messages of a running computation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Message {
    /// Fraction done, 0 to 1; for a share, as a fraction of the whole.
    Progress(f64),
    /// The requested presets, by their words.
    Presets(Vec<(String, Measured)>),
    /// The accepted ranges of a sweep; its points follow.
    Ranges(Vec<Range>),
    /// A point of a sweep.
    Point(Box<SweptPoint>),
    /// The accepted runs of parameters alone; their results follow.
    Plan(AlonePlan),
    /// One of these runs.
    Run(AloneRun),
    /// About a map.
    Map(MapMessage),
    /// End of the results.
    Done,
    /// Reason for the lack of a result.
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

impl From<AloneMessage> for Message {
    fn from(message: AloneMessage) -> Self {
        match message {
            AloneMessage::Progress(done) => Self::Progress(done),
            AloneMessage::Plan(plan) => Self::Plan(plan),
            AloneMessage::Run(run) => Self::Run(run),
        }
    }
}

/// Runs `job`. `clock` returns seconds from any origin; `report` receives each message and may cancel. The last message is
/// [`Message::Done`] or [`Message::Failed`], unless cancelled.
pub fn perform(job: &Job, clock: &mut dyn FnMut() -> f64, report: &mut dyn FnMut(Message) -> ControlFlow<()>) {
    let mut rest = async || {};
    let performed = pin!(perform_with_rests(job, clock, report, &mut rest));
    let end = performed.poll(&mut Context::from_waker(Waker::noop()));
    assert!(end.is_ready(), "nothing in it waits");
}

/// As [`perform`]; a computation that can be shared awaits `rest` every few milliseconds.
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
        Job::Alone(task, share) => alone_task::run(task, *share, &mut |message| report(message.into()), rest).await,
    };
    let last = match outcome {
        Ok(()) => Message::Done,
        Err(TaskFault::Cancelled) => return,
        Err(fault) => Message::Failed(fault.to_string()),
    };
    // Nothing is left to cancel.
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
        let own = |&(k, v): &(&str, &str)| (k.to_owned(), v.to_owned());
        let changes: Vec<_> = changes.iter().map(own).collect();
        let scene = Scene::load("pendulum", &changes).expect("built in");
        Job::Presets { scene: SceneSource::of(&scene), presets: presets.iter().map(|&word| word.to_owned()).collect() }
    }

    fn messages(job: &Job, most: usize) -> Vec<Message> {
        let mut ticks = 0.0;
        let mut clock = || {
            ticks += 1e-3;
            ticks
        };
        let mut said = Vec::new();
        perform(job, &mut clock, &mut |message| {
            said.push(message);
            if said.len() < most { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        said
    }

    #[test]
    fn a_preset_is_measured_on_the_scene_as_it_is() {
        let job = job(&[("contact.clearance", "0.2 mm")], &["preview"]);
        // Jobs are sent as text.
        let text = serde_json::to_string(&job).expect("plain data");
        let job: Job = serde_json::from_str(&text).expect("its own text");
        let said = messages(&job, usize::MAX);
        assert_eq!(said.last(), Some(&Message::Done));
        let Some(Message::Presets(found)) = said.iter().rev().nth(1) else {
            panic!("{said:?}");
        };
        let error = found[0].1.peak_error.expect("the pendulum has impacts");
        assert!(error > 0.0 && error < 0.2, "{error}");
        assert!(said.iter().any(|m| matches!(m, Message::Progress(p) if *p > 0.5)));
    }

    #[test]
    fn a_sweep_with_rests_reports_the_same() {
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
        let (mut said, mut rests, mut waits) = (Vec::new(), 0, 0);
        let mut report = |message| {
            said.push(message);
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
        assert_eq!(said, messages(&job, usize::MAX));
    }

    #[test]
    fn a_cancelled_job_ends_and_faults_are_reported() {
        assert_eq!(messages(&job(&[], &["preview"]), 3).len(), 3);
        let said = messages(&job(&[], &["quick"]), usize::MAX);
        assert!(matches!(&said[..], [Message::Failed(why)] if why.contains("quick")));
    }
}
