//! One-at-a-time runs of a study as a job in plain data, which reports every run as soon as it is finished.

use serde::{Deserialize, Serialize};

use super::orbit::Orbit as _;
use super::source::{SceneSource, TaskFault};
use super::study::{OneAtATimePlan, Output, RunSpan, StudyRuns, outputs};
use super::sweep_task::{STEPS, Share};
use super::task::Message;
use jointplay_physics::simulate::{MAX_RUN_DURATION, Simulation};

/// A request for one-at-a-time runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OneAtATimeTask {
    /// The scene.
    pub scene: SceneSource,
    /// Keys of the varied parameters, each with its lower and its upper end, SI.
    pub over: Vec<(String, [f64; 2])>,
    /// Names of outputs, as on the command line.
    pub outputs: Vec<String>,
    /// Observed part of each run.
    pub span: RunSpan,
}

/// The accepted runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OneAtATimeReport {
    /// Value of each parameter in the scene, SI.
    pub nominal: Vec<f64>,
    /// SI unit of each requested output, "" for a dimensionless number; `None` for an output that the scene does not have.
    pub units: Vec<Option<String>>,
}

/// A finished run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OneAtATimeRun {
    /// 0 for the run with the values of the scene; 1 + 2 i and 2 + 2 i for parameter i at its lower and at its upper end.
    pub index: usize,
    /// The requested outputs, SI; `None` for an output that the scene does not have, and if the run did not start or diverged.
    pub outputs: Vec<Option<f64>>,
}

/// Computes a share of the runs of `task` one after another, and awaits `rest` every [`STEPS`] steps.
pub(super) async fn run(
    task: &OneAtATimeTask,
    share: Share,
    send: &mut dyn FnMut(Message) -> Result<(), TaskFault>,
    rest: &mut impl AsyncFnMut(),
) -> Result<(), TaskFault> {
    let RunSpan { duration, from } = task.span;
    if !(0.0 <= from && from < duration && duration <= MAX_RUN_DURATION) {
        return Err(TaskFault::Span { duration, from });
    }
    let scene = task.scene.scene()?;
    Simulation::new(&scene.machine).map_err(|error| scene.locate(&error))?;
    let alone = OneAtATimePlan::new(&scene, &task.over)?;
    let keys: Vec<String> = task.over.iter().map(|(key, _)| key.clone()).collect();
    // An output can be unknown in this scene: not every scene has a probe or an energy ledger.
    let known = task.outputs.iter().map(|name| outputs(&scene, name).ok().and_then(|mut outputs| outputs.pop()));
    let known: Vec<Option<Output>> = known.collect();
    let available: Vec<Output> = known.iter().flatten().cloned().collect();
    let runs = StudyRuns::new(&scene, &keys, &available, task.span, &alone.rows())?;
    send(Message::Plan(OneAtATimeReport {
        nominal: alone.nominal().to_vec(),
        units: known.iter().map(|output| output.as_ref().map(|output| output.unit.to_owned())).collect(),
    }))?;
    let all = runs.sweep().design().blocks();
    for (finished, index) in (share.index..all).step_by(share.of.max(1)).enumerate() {
        let mut block = runs.sweep().begin(index);
        while !block.is_done() {
            rest().await;
            block.advance(STEPS);
            let part = block.current().map_or(0.0, |run| run.machine().time() / duration);
            send(Message::Progress((finished as f64 + part) / all as f64))?;
        }
        let mut values = runs.outputs_of(&block.records()).into_iter();
        let mut next =
            |output: &Option<Output>| output.as_ref().and_then(|_| values.next()).filter(|value| value.is_finite());
        send(Message::Run(OneAtATimeRun { index, outputs: known.iter().map(&mut next).collect() }))?;
        send(Message::Progress((finished + 1) as f64 / all as f64))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::study::{matching, real_parameter};
    use crate::task::{Job, perform};
    use jointplay_scene::Scene;

    const OUTPUTS: [&str; 3] = ["tip-error", "peak-force", "impacts"];

    /// A task that varies the parameters that match a pattern by half of their values.
    fn task(scene: &str, pattern: &str) -> OneAtATimeTask {
        let changes = [("spcmm.frequency".to_owned(), "5 Hz".to_owned())];
        let scene = Scene::load(scene, if scene == "spcmm" { &changes } else { &[] }).expect("built in");
        let range = |key: String| {
            let (_, nominal) = real_parameter(&scene, &key).expect("a number");
            (key, [0.5 * nominal, 1.5 * nominal])
        };
        OneAtATimeTask {
            scene: SceneSource::of(&scene),
            over: matching(&scene, pattern).expect("parameters").into_iter().map(range).collect(),
            outputs: OUTPUTS.map(str::to_owned).to_vec(),
            span: RunSpan { duration: 0.06, from: 0.02 },
        }
    }

    /// The messages of a share, given by its index; the job and the messages pass through text.
    fn messages_of(task: &OneAtATimeTask, index: usize, of: usize) -> Vec<Message> {
        let text = serde_json::to_string(&Job::OneAtATime(task.clone(), Share { index, of })).expect("plain data");
        let mut messages = Vec::new();
        perform(&serde_json::from_str(&text).expect("its own text"), &mut |message| {
            let text = serde_json::to_string(&message).expect("plain data");
            assert_eq!(serde_json::from_str::<Message>(&text).expect("its own text"), message);
            messages.push(message);
            ControlFlow::Continue(())
        });
        messages
    }

    fn runs(messages: &[Message]) -> Vec<OneAtATimeRun> {
        let mut runs: Vec<OneAtATimeRun> = messages
            .iter()
            .filter_map(|message| match message {
                Message::Run(run) => Some(run.clone()),
                _ => None,
            })
            .collect();
        runs.sort_by_key(|run| run.index);
        runs
    }

    #[test]
    fn shares_reproduce_the_study_bit_for_bit_and_the_nominal_run_comes_first() {
        let task = task("spcmm", "joint.*.clearance");
        let whole = messages_of(&task, 0, 1);
        assert_eq!(whole.last(), Some(&Message::Done));
        let first = whole.iter().find(|message| matches!(message, Message::Run(_)));
        assert!(matches!(first, Some(Message::Run(OneAtATimeRun { index: 0, .. }))));
        let scene = task.scene.scene().expect("built in");
        let available: Vec<Output> =
            OUTPUTS.iter().flat_map(|name| outputs(&scene, name).expect("an output")).collect();
        let alone = OneAtATimePlan::new(&scene, &task.over).expect("ends");
        let keys: Vec<String> = task.over.iter().map(|(key, _)| key.clone()).collect();
        let study = StudyRuns::new(&scene, &keys, &available, task.span, &alone.rows()).expect("runs");
        let expected: Vec<OneAtATimeRun> = (0..study.sweep().design().blocks())
            .map(|index| {
                let mut block = study.sweep().begin(index);
                while !block.is_done() {
                    block.advance(10_000);
                }
                let outputs = study.outputs_of(&block.records());
                OneAtATimeRun { index, outputs: outputs.into_iter().map(Some).collect() }
            })
            .collect();
        assert_eq!(expected.len(), 7);
        // Each end changes the outputs.
        assert!(expected[1..].iter().all(|run| run.outputs[..2] != expected[0].outputs[..2]));
        assert_eq!(runs(&whole), expected);
        let shared: Vec<Message> = [2, 0, 1].into_iter().flat_map(|index| messages_of(&task, index, 3)).collect();
        assert_eq!(runs(&shared), expected);
        let done = |messages: &[Message]| {
            let last = messages.iter().rev().find_map(|message| match message {
                Message::Progress(done) => Some(*done),
                _ => None,
            });
            last.expect("progress")
        };
        assert!((done(&whole) - 1.0).abs() < 1e-12);
        let shares: f64 = (0..3).map(|index| done(&messages_of(&task, index, 3))).sum();
        assert!((shares - 1.0).abs() < 1e-12, "{shares}");
        let plan = whole.iter().find_map(|message| match message {
            Message::Plan(plan) => Some(plan),
            _ => None,
        });
        let plan = plan.expect("a plan");
        let (key, ends) = &task.over[1];
        assert_eq!((&**key, *ends), ("joint.S2.clearance", [0.5, 1.5].map(|part| part * plan.nominal[1])));
        assert_eq!(plan.units, ["m", "N", ""].map(|unit| Some(unit.to_owned())));
    }

    #[test]
    fn an_output_that_the_scene_lacks_is_left_out() {
        let messages = messages_of(&task("pendulum", "joint.*.friction"), 0, 1);
        let Some(Message::Plan(plan)) = messages.first() else {
            panic!("{messages:?}");
        };
        assert_eq!(plan.units, [None, Some("N".to_owned()), Some(String::new())]);
        for run in runs(&messages) {
            assert!(run.outputs[0].is_none() && run.outputs[1].is_some_and(|force| force > 0.0), "{run:?}");
        }
    }

    #[test]
    fn faults_are_reported() {
        let good = || task("spcmm", "joint.*.clearance");
        let over = |key: &str, ends| OneAtATimeTask { over: vec![(key.to_owned(), ends)], ..good() };
        let with_span = |duration, from| OneAtATimeTask { span: RunSpan { duration, from }, ..good() };
        for (task, words) in [
            (over("joint.S9.clearance", [1e-4, 2e-4]), "joint.S9.clearance: "),
            (over("joint.S1.clearance", [4e-4, 2e-4]), "joint.S1.clearance: the lower limit"),
            (over("joint.S1.friction", [0.0, 99.0]), "joint.S1.friction: 99: out of range"),
            (over("solver.preset", [0.0, 1.0]), "solver.preset: its values are not real numbers"),
            (with_span(0.1, 0.1), "runs of 0.1 s, observed from 0.1 s on"),
            (with_span(f64::NAN, 0.0), "must begin before the end"),
        ] {
            let messages = messages_without_text(&task);
            let [Message::Failed(why)] = &messages[..] else {
                panic!("{words}: {messages:?}");
            };
            assert!(why.contains(words), "{why}");
        }
    }

    /// As [`messages_of`], for a task with numbers that text cannot represent.
    fn messages_without_text(task: &OneAtATimeTask) -> Vec<Message> {
        let mut messages = Vec::new();
        perform(&Job::OneAtATime(task.clone(), Share::WHOLE), &mut |message| {
            messages.push(message);
            ControlFlow::Continue(())
        });
        messages
    }

    #[test]
    fn a_cancelled_task_sends_no_further_messages() {
        let mut messages = 0;
        perform(&Job::OneAtATime(task("spcmm", "joint.*.clearance"), Share::WHOLE), &mut |_| {
            messages += 1;
            if messages < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        assert_eq!(messages, 3);
    }
}
