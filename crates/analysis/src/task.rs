//! Long computations as plain data, so that a desktop thread and a browser worker run the same code.

use std::ops::ControlFlow;
use std::pin::pin;
use std::task::{Context, Waker};

use serde::{Deserialize, Serialize};

use super::map_task::{self, MapTask, TipErrors};
use super::one_at_a_time_task::{self, OneAtATimeReport, OneAtATimeRun, OneAtATimeTask};
use super::source::TaskFault;
use super::sweep_task::{self, Range, Share, SweepTask, SweptPoint};

/// A computation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Job {
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
    /// The accepted ranges of a sweep; its points follow.
    Ranges(Vec<Range>),
    /// A point of a sweep.
    Point(Box<SweptPoint>),
    /// The accepted one-at-a-time runs; their results follow.
    Plan(OneAtATimeReport),
    /// A finished one-at-a-time run.
    Run(OneAtATimeRun),
    /// The accepted axes of a map: name and values in order, SI. The points follow, with the last axis varying fastest.
    Axes(Vec<(String, Vec<f64>)>),
    /// The next point of a map; `None` if it has no result.
    MapPoint(Option<TipErrors>),
    /// End of the results.
    Done,
    /// The computation failed, for this reason.
    Failed(String),
}

/// Runs `job`. `report` receives each message and may cancel. The last message is [`Message::Done`] or [`Message::Failed`], unless
/// cancelled.
pub fn perform(job: &Job, report: &mut dyn FnMut(Message) -> ControlFlow<()>) {
    let mut rest = async || {};
    let performed = pin!(perform_with_rests(job, report, &mut rest));
    let end = performed.poll(&mut Context::from_waker(Waker::noop()));
    assert!(end.is_ready(), "without rests, nothing waits");
}

/// As [`perform`], but a computation that can be shared awaits `rest` every few milliseconds, so that other work can proceed.
pub async fn perform_with_rests(
    job: &Job,
    report: &mut dyn FnMut(Message) -> ControlFlow<()>,
    rest: &mut impl AsyncFnMut(),
) {
    let mut send = |message| match report(message) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(TaskFault::Cancelled),
    };
    let outcome = match job {
        Job::Map(task) => map_task::run(task, &mut send, rest).await,
        Job::Sweep(task, share) => sweep_task::run(task, *share, &mut send, rest).await,
        Job::OneAtATime(task, share) => one_at_a_time_task::run(task, *share, &mut send, rest).await,
    };
    let last = match outcome {
        Ok(()) => Message::Done,
        Err(TaskFault::Cancelled) => return,
        Err(fault) => Message::Failed(fault.to_string()),
    };
    // After the last message there is nothing to cancel.
    let _ = report(last);
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;
    use std::task::Poll;

    use super::*;
    use crate::design::Start;
    use crate::source::SceneSource;
    use jointplay_scene::Scene;

    fn sweep(vary: &str) -> Job {
        let scene = Scene::load("slider-crank-driven", &[]).expect("built in");
        let task = SweepTask {
            scene: SceneSource::of(&scene),
            vary: vec![vary.to_owned()],
            periods: 3,
            discard: 1,
            phase: 0.0,
            start: Start::Cold,
            exponent: false,
        };
        Job::Sweep(task, Share::WHOLE)
    }

    /// The first messages of `job`, up to `limit`, after which it is cancelled.
    fn messages(job: &Job, limit: usize) -> Vec<Message> {
        let mut received = Vec::new();
        perform(job, &mut |message| {
            received.push(message);
            if received.len() < limit { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        received
    }

    #[test]
    fn a_sweep_with_rests_sends_the_same_messages() {
        let job = sweep("contact.clearance=0.2mm..0.4mm:2");
        // A job must survive its serialisation as text.
        let text = serde_json::to_string(&job).expect("plain data");
        let job: Job = serde_json::from_str(&text).expect("its own text");
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
        {
            let mut sweep = pin!(perform_with_rests(&job, &mut report, &mut rest));
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
        assert_eq!(messages(&sweep("contact.clearance=0.2mm..0.4mm:2"), 3).len(), 3);
        let received = messages(&sweep("contact.clearence=0.2mm..0.4mm:2"), usize::MAX);
        assert!(matches!(&received[..], [Message::Failed(why)] if why.contains("contact.clearence")), "{received:?}");
    }
}
