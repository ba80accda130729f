//! A sweep as a job in plain data, which reports every point as soon as it is finished.

use serde::{Deserialize, Serialize};

use super::axis::Axis;
use super::design::{Design, Start};
use super::drive::drive_period;
use super::point::{Plan, PointResult};
use super::source::{SceneSource, TaskFault};
use super::sweep::{BlockRun, Sweep};
use super::task::Message;

/// Simulation steps between two checks for cancellation.
pub(super) const STEPS: u32 = 400;
/// Coordinates of the output body: x, y, z in m, alpha, beta, gamma in rad.
pub(crate) const COORDINATES: usize = 6;
/// Largest total number of kept sections that a window holds and draws.
const MAX_SECTIONS: usize = 50_000;

/// A request for a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepTask {
    /// The scene, without the varied parameters.
    pub scene: SceneSource,
    /// Ranges as on the command line: `contact.clearance=0.01mm..1mm:200`.
    pub vary: Vec<String>,
    /// Drive periods per point, including discarded ones.
    pub periods: usize,
    /// Transient periods to discard.
    pub discard: usize,
    /// Drive phase of the sections as a fraction of the period, 0 <= phase < 1.
    pub phase: f64,
    /// State from which points start.
    pub start: Start,
    /// Whether to measure the largest Lyapunov exponent.
    pub exponent: bool,
}

/// Share of a sweep for one of several workers. The results do not depend on the division into shares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Share {
    /// Index, from 0.
    pub index: usize,
    /// Number of shares.
    pub of: usize,
}

impl Share {
    /// The whole sweep.
    pub const WHOLE: Self = Self { index: 0, of: 1 };
}

/// One varied parameter of a running sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Key of the parameter.
    pub key: String,
    /// First value, SI.
    pub from: f64,
    /// Last value, SI.
    pub to: f64,
    /// Number of values.
    pub count: usize,
}

/// One point of a sweep. Unknown values are `None`, because JSON has no NaN.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SweptPoint {
    /// Index in the sweep; the last range varies fastest.
    pub index: usize,
    /// Value of each varied parameter, SI.
    pub values: Vec<f64>,
    /// Keys and values in the syntax of the user; they parse back to the same bits.
    pub settings: Vec<(String, String)>,
    /// The preceding point, from which it continued; `None` for a cold start.
    pub after: Option<usize>,
    /// Time of the first section, including discarded ones, s.
    pub first: f64,
    /// Time from one section to the next, s.
    pub interval: f64,
    /// Time at which the divergence guard stopped the run, s from the point's start; there are no sections then.
    pub diverged: Option<f64>,
    /// Kind of motion in a word, with the period if there is one; "" if the point did not reach its end.
    pub regime: String,
    /// Regime code in files; -1 if the point did not reach its end.
    pub regime_code: i64,
    /// Largest Lyapunov exponent and its standard error, 1/s.
    pub exponent: Option<(f64, Option<f64>)>,
    /// Kept sections: the six coordinates of each, SI.
    pub sections: Vec<[f64; COORDINATES]>,
    /// Largest normal force in any joint over the kept periods, N.
    pub peak: Option<f64>,
    /// Largest and root-mean-square tip error over the kept periods, m.
    pub probe: Option<(f64, f64)>,
    /// Doubts about the result: bit k is set for kind k of [`jointplay_physics::simulate::Doubt::KINDS`].
    pub doubts: u32,
}

/// Computes a share of a sweep point by point, from coarse to fine unless points follow each other, and awaits `rest` every
/// [`STEPS`] steps.
pub(super) async fn run(
    task: &SweepTask,
    share: Share,
    send: &mut dyn FnMut(Message) -> Result<(), TaskFault>,
    rest: &mut impl AsyncFnMut(),
) -> Result<(), TaskFault> {
    let scene = task.scene.scene()?;
    let axes = task.vary.iter().map(|text| Axis::parse(&scene, text));
    let axes = axes.collect::<Result<Vec<_>, _>>()?;
    if let Some(axis) = axes.iter().find(|axis| axis.words().is_some()) {
        return Err(axis.not_numbers(&scene).into());
    }
    let ranges = axes.iter().map(|axis| Range {
        key: axis.key().to_owned(),
        from: axis.number(0),
        to: axis.number(axis.count() - 1),
        count: axis.count(),
    });
    let ranges: Vec<Range> = ranges.collect();
    if !(0.0..1.0).contains(&task.phase) {
        return Err(TaskFault::Phase(task.phase));
    }
    let plan = Plan { periods: task.periods, discard: task.discard, phase: task.phase, exponent: task.exponent };
    let design = Design::crossed(&scene, axes, &[task.start])?;
    let kept = task.periods.saturating_sub(task.discard);
    if kept.saturating_mul(design.points()) > MAX_SECTIONS {
        return Err(TaskFault::TooManySections { points: design.points(), kept, most: MAX_SECTIONS });
    }
    let sweep = Sweep::new(scene, design, plan)?;
    send(Message::Ranges(ranges))?;
    let blocks = sweep.design().blocks();
    let mut completed = 0;
    let order = coarse_first(blocks).into_iter();
    for b in order.skip(share.index).step_by(share.of.max(1)) {
        let mut block = Block::new(&sweep, b);
        while !block.run.is_done() {
            rest().await;
            block.advance();
            if let Some(point) = block.latest() {
                completed += 1;
                send(Message::Point(Box::new(point)))?;
            }
            let part = block.run.current().map_or(0.0, |run| run.taken() as f64 / task.periods as f64);
            send(Message::Progress((completed as f64 + part) / sweep.design().points() as f64))?;
        }
    }
    Ok(())
}

/// The numbers 0 to n - 1, each once: first the ends, then the midpoints of the gaps, and so on.
fn coarse_first(n: usize) -> Vec<usize> {
    let mut order = Vec::with_capacity(n);
    let Some(last) = n.checked_sub(1) else {
        return order;
    };
    let mut seen = vec![false; n];
    let mut stride = n.next_power_of_two();
    while stride > 0 {
        for i in (0..n).step_by(stride).chain([last]) {
            if !std::mem::replace(&mut seen[i], true) {
                order.push(i);
            }
        }
        stride /= 2;
    }
    order
}

/// A block being computed, with the data needed to reproduce its points.
struct Block<'a> {
    sweep: &'a Sweep,
    run: BlockRun<'a>,
    reported: usize,
    /// Time of the first section of the current point, s, and whether it starts cold.
    first: Option<(f64, bool)>,
    /// Index of the previous point and time of its last section, s.
    before: Option<(usize, f64)>,
}

impl<'a> Block<'a> {
    fn new(sweep: &'a Sweep, b: usize) -> Self {
        Self { run: sweep.begin(b), sweep, reported: 0, first: None, before: None }
    }

    fn advance(&mut self) {
        if self.run.current().is_none() {
            // The first step starts the point, which determines the times of its sections.
            self.run.advance(1);
            self.first = self.run.current().map(|run| (run.first(), run.is_cold()));
        } else {
            self.run.advance(STEPS);
        }
    }

    /// The point just finished, if any.
    fn latest(&mut self) -> Option<SweptPoint> {
        let (index, result) = self.run.finished().get(self.reported)?;
        self.reported += 1;
        let (first, is_cold) = self.first.take().unwrap_or((0.0, true));
        let before = self.before.take();
        let settings = self.sweep.design().settings(*index);
        let scene = self.sweep.design().scene(self.sweep.scene(), *index).ok();
        let interval = scene.as_ref().and_then(|scene| drive_period(scene).ok());
        let interval = interval.unwrap_or(0.0);
        let write = |key: &str, value| {
            let parameter = self.sweep.scene().parameter(key);
            parameter.map_or_else(|_| String::new(), |parameter| parameter.write(value))
        };
        let mut point = SweptPoint {
            index: *index,
            settings: settings.iter().map(|(key, value)| ((*key).to_owned(), write(key, value))).collect(),
            after: before.filter(|_| !is_cold).map(|(index, _)| index),
            first,
            interval,
            regime_code: -1,
            ..SweptPoint::default()
        };
        let indices = self.sweep.design().indices(*index).into_iter();
        let axes = self.sweep.design().axes().iter().zip(indices);
        point.values.extend(axes.map(|(axis, i)| axis.number(i)));
        match result {
            None => point.diverged = Some(0.0),
            Some(PointResult { stopped: Some(time), .. }) => point.diverged = Some(*time),
            Some(result) => {
                set_result(&mut point, result);
                let periods = self.sweep.protocol().plan().map_or(1, |plan| plan.periods);
                self.before = Some((*index, first + (periods - 1) as f64 * interval));
            }
        }
        Some(point)
    }
}

fn set_result(point: &mut SweptPoint, result: &PointResult) {
    let finite = |value: f64| value.is_finite().then_some(value);
    point.regime = result.regime.to_string();
    point.regime_code = result.regime.code();
    point.exponent = result
        .evidence
        .exponent
        .as_ref()
        .and_then(|exponent| Some((finite(exponent.value)?, finite(exponent.standard_error))));
    let rows = result.sections.chunks_exact(super::drive::OBSERVABLES.len());
    point.sections = rows.map(|row| std::array::from_fn(|i| row[i])).collect();
    let peaks = result.joints.iter().map(|joint| joint.peak_kept);
    point.peak = finite(peaks.fold(f64::NEG_INFINITY, f64::max));
    point.probe = result.probe;
    point.doubts = result.doubts;
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::task::{Job, perform};
    use jointplay_scene::Scene;

    fn task(vary: &[&str]) -> SweepTask {
        let changes = [("spcmm.frequency".to_owned(), "5 Hz".to_owned())];
        let scene = Scene::load("spcmm", &changes).expect("built in");
        SweepTask {
            scene: SceneSource::of(&scene),
            vary: vary.iter().map(|&text| text.to_owned()).collect(),
            periods: 3,
            discard: 1,
            phase: 0.25,
            start: Start::Cold,
            exponent: false,
        }
    }

    /// The first messages of a sweep, up to `limit`, after which it is cancelled.
    fn messages_of(task: SweepTask, limit: usize) -> Vec<Message> {
        messages_of_share(task, Share::WHOLE, limit)
    }

    fn messages_of_share(task: SweepTask, share: Share, limit: usize) -> Vec<Message> {
        let mut messages = Vec::new();
        // Jobs and messages must survive their serialisation as text.
        let text = serde_json::to_string(&Job::Sweep(task, share)).expect("plain data");
        let job = serde_json::from_str(&text).expect("its own text");
        perform(&job, &mut |message| {
            let text = serde_json::to_string(&message).expect("plain data");
            messages.push(serde_json::from_str(&text).expect("its own text"));
            if messages.len() < limit { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        messages
    }

    fn points(messages: &[Message]) -> Vec<&SweptPoint> {
        messages
            .iter()
            .filter_map(|message| match message {
                Message::Point(point) => Some(&**point),
                _ => None,
            })
            .collect()
    }

    #[test]
    fn coarse_order_starts_at_the_ends_and_contains_every_number_once() {
        assert_eq!(coarse_first(9), [0, 8, 4, 2, 6, 1, 3, 5, 7]);
        for n in 0..40 {
            let mut order = coarse_first(n);
            order.sort_unstable();
            assert!(order.into_iter().eq(0..n), "{n}");
        }
    }

    #[test]
    fn the_settings_of_a_point_reproduce_its_sections() {
        let task = task(&["contact.clearance=0.2mm..0.4mm:3"]);
        let messages = messages_of(task.clone(), usize::MAX);
        assert_eq!(messages.last(), Some(&Message::Done));
        let points = points(&messages);
        let order: Vec<usize> = points.iter().map(|point| point.index).collect();
        assert_eq!(order, [0, 2, 1]);
        for point in points {
            assert_eq!(point.sections.len(), 2);
            assert_eq!((point.first, point.interval), (0.05, 0.2));
            assert!(point.peak.is_some_and(|peak| peak > 1.0) && !point.regime.is_empty());
            // A run with the point's settings and the same steps reproduces the section.
            let mut source = task.scene.clone();
            source.changes.extend(point.settings.iter().cloned());
            let scene = source.scene().expect("its own settings");
            let mut machine = crate::drive::ObservedRun::new(&scene).expect("starts");
            for k in 0..task.periods {
                let end = point.first + k as f64 * point.interval;
                while machine.simulation().time() < end {
                    machine.simulation_mut().step_until(end).expect("runs");
                }
            }
            let pose = machine.frame().pose;
            let computed = crate::drive::observed(&pose);
            assert_eq!(computed[..6], *point.sections.last().expect("kept"));
        }
    }

    #[test]
    fn shares_together_yield_every_point_bit_for_bit() {
        // Four shares, first of two cold points, so that two shares are empty, then of two blocks of points that follow each
        // other.
        let is_cold = task(&["contact.clearance=0.2mm..0.4mm:2"]);
        let mut followed = task(&["contact.friction=0.1..0.3:26"]);
        (followed.start, followed.periods, followed.discard) = (Start::FollowUp, 2, 1);
        followed.scene.changes.push(("solver.preset".to_owned(), "preview".to_owned()));
        for task in [is_cold, followed] {
            let mut whole: Vec<_> = messages_of(task.clone(), usize::MAX);
            let mut shared = Vec::new();
            let mut done = 0.0;
            for index in 0..4 {
                let messages = messages_of_share(task.clone(), Share { index, of: 4 }, usize::MAX);
                assert!(matches!(messages[0], Message::Ranges(_)));
                assert_eq!(messages.last(), Some(&Message::Done));
                done += messages.iter().rev().find_map(progress).unwrap_or(0.0);
                shared.extend(messages);
            }
            assert!((done - 1.0).abs() < 1e-12, "{done}");
            let sorted = |messages: &mut Vec<Message>| {
                let mut points: Vec<SweptPoint> = points(messages).into_iter().cloned().collect();
                points.sort_by_key(|point| point.index);
                points
            };
            assert_eq!(sorted(&mut shared), sorted(&mut whole));
        }
    }

    fn progress(message: &Message) -> Option<f64> {
        match message {
            Message::Progress(done) => Some(*done),
            _ => None,
        }
    }

    #[test]
    fn a_point_that_follows_another_names_it() {
        let mut task = task(&["contact.friction=0.1..0.3:3"]);
        task.start = Start::FollowDown;
        let messages = messages_of(task, usize::MAX);
        let points = points(&messages);
        let after: Vec<_> = points.iter().map(|p| (p.index, p.after)).collect();
        assert_eq!(after, [(2, None), (1, Some(2)), (0, Some(1))]);
        let first: Vec<f64> = points.iter().map(|p| p.first).collect();
        assert!((first[1] - 0.65).abs() < 1e-12 && (first[2] - 1.25).abs() < 1e-12);
    }

    #[test]
    fn states_follow_a_user_parameter_if_only_contacts_depend_on_it() {
        let built_in = Scene::load("slider-crank-driven", &[]).expect("built in");
        let parameter = "[[parameter]]\nname = \"gap\"\nvalue = \"0.2 mm\"\n";
        let text = format!("{}\n{parameter}", built_in.source.text);
        for (place, instead, followed) in [
            ("clearance = \"0.3 mm\"", "clearance = \"gap\"", true),
            ("mass = \"0.12 kg\"", "mass = \"gap * 600 kg / 1 m\"", false),
        ] {
            let text = text.replacen(place, instead, 1);
            let scene = Scene::parse(&text, None, &[]).expect("a scene");
            let mut task = task(&["parameter.gap=0.2mm..0.3mm:2"]);
            (task.scene, task.start) = (SceneSource::of(&scene), Start::FollowUp);
            let messages = messages_of(task, usize::MAX);
            if followed {
                let after: Vec<_> = points(&messages).iter().map(|point| point.after).collect();
                assert_eq!(after, [None, Some(0)]);
            } else {
                let [Message::Failed(why)] = &messages[..] else {
                    panic!("{messages:?}");
                };
                assert!(why.contains("at the next reset"), "{why}");
            }
        }
    }

    #[test]
    fn a_cancelled_sweep_sends_no_further_messages_and_invalid_ranges_are_reported() {
        let good = task(&["contact.friction=0.1..0.3:3"]);
        assert_eq!(messages_of(good, 3).len(), 3);
        for (vary, words) in [
            ("contact.friction=0.3..0.1:3", "reversed"),
            ("contact.friction=0.1..0.3", "expected KEY=A..B:N"),
            ("contact.friction=0.1..0.3:900000", "more than the window draws"),
            ("contact.clearance=0.1mm..20mm:3", "below the ball radius"),
        ] {
            let messages = messages_of(task(&[vary]), usize::MAX);
            let [Message::Failed(why)] = &messages[..] else {
                panic!("{vary}: {messages:?}");
            };
            assert!(why.contains(words), "{why}");
        }
    }
}
