//! A sweep: its scene, its points, and the computation of the points block by block. The caller schedules the blocks; the
//! records of a block depend only on the sweep and the block number.

use std::fmt::{Display as _, Formatter};

use super::argument::Argument;
use super::design::{Design, Start};
use super::drive::{NoPeriod, ObservedRun};
use super::layout::Layout;
use super::point::{PointResult, PointRun, Protocol};
use jointplay_physics::mechanism::MechanismError;
use jointplay_physics::simulate::{MAX_RUN_DURATION, Simulation, StartError};
use jointplay_scene::{Scene, SceneError, Value};

/// Largest total number of kept sections; an array of them takes 512 MiB.
const MAX_SECTIONS: usize = 1 << 26;

/// Reasons why a sweep is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SweepError {
    /// No kept periods.
    #[error(fmt = nothing_kept)]
    NothingKept {
        /// The counted quantity, periods or crossings.
        counted: Argument,
        /// Number of periods or crossings.
        all: usize,
        /// Number of discarded ones.
        discard: usize,
    },
    /// More numbers than a result can hold.
    #[error(
        "{points} points with {kept} kept sections each are more than a result holds ({most} sections): vary fewer values, keep \
         fewer periods, or discard more of them"
    )]
    TooLarge {
        /// Points.
        points: usize,
        /// Kept sections of a point.
        kept: usize,
        /// Largest allowed number of sections.
        most: usize,
    },
    /// A run that is longer than allowed.
    #[error(fmt = too_long)]
    TooLong {
        /// Periods.
        periods: usize,
        /// Parameters of the point.
        point: String,
        /// Drive period at the point, s.
        period: f64,
        /// Largest allowed number of periods.
        most: usize,
    },
    /// A scene without a drive phase.
    #[error("{0}; take a driven scene such as spcmm or slider-crank-driven")]
    NoPeriod(#[from] NoPeriod),
    /// A point that the scene does not accept, or that cannot start.
    #[error("the scene cannot start at {point}: {error}")]
    Infeasible {
        /// Parameters of the point.
        point: String,
        /// The reason.
        error: Box<SceneError>,
    },
}

fn nothing_kept(counted: &Argument, all: &usize, discard: &usize, f: &mut Formatter<'_>) -> std::fmt::Result {
    counted.write(all, f)?;
    f.write_str(if f.alternate() { ", " } else { " " })?;
    Argument::Discard.write(discard, f)?;
    f.write_str(": they include those discarded, so ")?;
    Argument::Discard.fmt(f)?;
    f.write_str(" must be less than ")?;
    counted.fmt(f)
}

fn too_long(periods: &usize, point: &str, period: &f64, most: &usize, f: &mut Formatter<'_>) -> std::fmt::Result {
    Argument::Periods.write(periods, f)?;
    write!(f, ": at {point} the longest run allowed, {MAX_RUN_DURATION:e} s, covers {most} periods of {period} s")
}

/// A sweep.
#[derive(Clone, Debug)]
pub struct Sweep {
    scene: Scene,
    design: Design,
    protocol: Protocol,
    layout: Layout,
}

impl Sweep {
    /// A sweep of `scene`. Before anything runs, it checks that the scene starts for every value of each range with the other
    /// ranges at their ends, and at up to 4096 points inside a map or of a table. A point without a position of rest to start in is
    /// recorded as unable to start.
    ///
    /// # Errors
    /// No kept periods, no drive phase where sections need one, or a value at which the scene cannot start.
    pub fn new(scene: Scene, design: Design, protocol: impl Into<Protocol>) -> Result<Self, SweepError> {
        let sweep = Self::untried(scene, design, protocol)?;
        sweep.design.checked_points().into_iter().try_for_each(|point| sweep.check(point))?;
        Ok(sweep)
    }

    /// A sweep whose points are not checked in advance; a point that cannot start is recorded as such.
    ///
    /// # Errors
    /// No kept periods, or too many sections.
    pub fn untried(scene: Scene, design: Design, protocol: impl Into<Protocol>) -> Result<Self, SweepError> {
        let protocol = protocol.into();
        if let Some((all, discard)) = protocol.sections() {
            if discard >= all {
                let counted = if protocol.plan().is_some() { Argument::Periods } else { Argument::Crossings };
                return Err(SweepError::NothingKept { counted, all, discard });
            }
            let (points, kept) = (design.points(), protocol.kept());
            if kept > MAX_SECTIONS / points {
                return Err(SweepError::TooLarge { points, kept, most: MAX_SECTIONS });
            }
        }
        let layout = Layout::new(&scene, &protocol);
        Ok(Self { scene, design, protocol, layout })
    }

    /// Requires that a point can start, or merely lacks a position of rest, and that its run is not longer than allowed.
    fn check(&self, point: usize) -> Result<(), SweepError> {
        let scene = self.design.scene(&self.scene, point);
        let started = scene.and_then(|scene| {
            match Simulation::new(&scene.machine) {
                // Whether a search succeeds shows only in the search: such a point is recorded as unable to start.
                Ok(_) | Err(StartError(MechanismError::NoRest { .. })) => Ok(scene),
                Err(error) => Err(scene.locate(&error)),
            }
        });
        let infeasible = |error| SweepError::Infeasible { point: self.describe(point), error: Box::new(error) };
        let interval = self.protocol.interval(&started.map_err(infeasible)?)?;
        match self.protocol.plan() {
            Some(plan) if plan.periods > (MAX_RUN_DURATION / interval) as usize => Err(SweepError::TooLong {
                periods: plan.periods,
                point: self.describe(point),
                period: interval,
                most: (MAX_RUN_DURATION / interval) as usize,
            }),
            _ => Ok(()),
        }
    }

    /// Parameters of a point, formatted for the user.
    pub fn describe(&self, point: usize) -> String {
        let written = |(key, value): (&str, Value)| {
            let shown = self.scene.parameter(key).map(|parameter| parameter.show(&value));
            format!("{key} = {}", shown.unwrap_or_default())
        };
        let settings = self.design.settings(point).into_iter();
        settings.map(written).collect::<Vec<_>>().join(", ")
    }

    /// The scene, without the varied parameters.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The points.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Length of each point's run, and the recorded quantities.
    pub fn protocol(&self) -> &Protocol {
        &self.protocol
    }

    /// The arrays of the result.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Block `b`, not yet started.
    pub fn begin(&self, b: usize) -> BlockRun<'_> {
        BlockRun { sweep: self, order: self.design.order(b), position: 0, run: None, machine: None, done: Vec::new() }
    }
}

/// A block of points being computed.
pub struct BlockRun<'a> {
    sweep: &'a Sweep,
    order: Vec<usize>,
    /// Position of the current point in `order`.
    position: usize,
    run: Option<PointRun>,
    /// State at the end of the previous point, if the next point follows it.
    machine: Option<ObservedRun>,
    done: Vec<(usize, Option<PointResult>)>,
}

impl BlockRun<'_> {
    /// Points finished so far, in the order of computation: index and result, which is `None` if the point could not start.
    pub fn finished(&self) -> &[(usize, Option<PointResult>)] {
        &self.done
    }

    /// The point being computed.
    pub fn current(&self) -> Option<&PointRun> {
        self.run.as_ref()
    }

    /// Whether every point is finished.
    pub fn is_done(&self) -> bool {
        self.position >= self.order.len()
    }

    /// Advances by at most `steps` simulation steps, not past the end of a point.
    pub fn advance(&mut self, steps: u32) {
        if self.is_done() {
            return;
        }
        let Some(mut run) = self.run.take().or_else(|| self.start()) else {
            self.close(None, None);
            return;
        };
        for _ in 0..steps {
            if run.step().is_err() {
                self.close(Some(run.stopped()), None);
                return;
            }
            if run.is_done() {
                let (result, machine) = run.finish();
                self.close(Some(result), Some(machine));
                return;
            }
        }
        self.run = Some(run);
    }

    /// Starts the next point, which continues from the previous one if it follows it.
    fn start(&mut self) -> Option<PointRun> {
        let sweep = self.sweep;
        let point = self.order[self.position];
        let scene = sweep.design.scene(&sweep.scene, point).ok()?;
        let interval = sweep.protocol.interval(&scene).ok()?;
        let run = self.machine.take();
        let followed = run.and_then(|run| PointRun::follow(run, &scene.machine, &sweep.protocol, interval));
        followed.or_else(|| PointRun::cold(&scene, &sweep.protocol, interval).ok())
    }

    /// Finishes the current point; the next one follows `machine`, or starts cold without one.
    fn close(&mut self, result: Option<PointResult>, machine: Option<ObservedRun>) {
        let point = self.order[self.position];
        self.done.push((point, result));
        self.position += 1;
        self.machine = machine.filter(|_| self.sweep.design.start(point) != Start::Cold);
    }

    /// Records of the finished block, in point order.
    pub fn records(mut self) -> Vec<f64> {
        self.done.sort_by_key(|(point, _)| *point);
        let mut records = Vec::new();
        for (_, result) in &self.done {
            self.sweep.layout.append(result.as_ref(), &mut records);
        }
        // Processors compute NaN of either sign; text has one.
        records.iter_mut().filter(|value| value.is_nan()).for_each(|value| *value = f64::NAN);
        records
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Axis;
    use crate::crossing::Crossing;
    use crate::point::{Plan, Span};
    use crate::statistic::ChannelStatistic;
    use jointplay_physics::simulate::Frame;

    fn sweep_of(name: &str, vary: &str, span: Span, keep: &str) -> (Sweep, Vec<PointResult>) {
        let scene = Scene::load(name, &[]).expect("built in");
        let keep = ChannelStatistic::parse_list(&scene, keep).expect("channels");
        let design = Design::crossed(&scene, vec![Axis::parse(&scene, vary).expect("a range")], &[Start::Cold]);
        let sweep =
            Sweep::new(scene, design.expect("points"), Protocol { span, keep, joints: false }).expect("a sweep");
        let mut results = Vec::new();
        for b in 0..sweep.design().blocks() {
            let mut block = sweep.begin(b);
            while !block.is_done() {
                block.advance(100);
            }
            results.extend(block.finished().iter().map(|(_, result)| result.clone().expect("starts")));
        }
        (sweep, results)
    }

    /// Compares with statistics of a run that the test itself steps and samples.
    #[test]
    fn a_duration_needs_no_drive_and_its_statistics_match_a_direct_run() {
        let span = Span::Duration { duration: 0.06, from: 0.02 };
        let keep = "rod.pose.x:min,rod.pose.x:max,rod.velocity.x:mean,rod.pose.x:end,*.normal:max,*.normal:mean";
        let (sweep, results) = sweep_of("pendulum", "gravity.z=-9.81m/s^2..-5m/s^2:2", span, keep);
        let names: Vec<&str> = sweep.layout().columns().iter().map(|column| &column.name[..]).collect();
        assert_eq!(names[..4], ["status", "stopped_at_s", "doubts", "energy_residual"]);
        for (point, result) in results.iter().enumerate() {
            let scene = sweep.design().scene(sweep.scene(), point).expect("a scene");
            let mut simulation = Simulation::new(&scene.machine).expect("starts");
            let mut frame = Frame::default();
            let (mut x, mut forces, mut peaks): (Vec<f64>, Vec<f64>, Vec<_>) = Default::default();
            for end in [0.02, 0.06] {
                // Only the part after the transient counts.
                simulation.take_peaks(&mut peaks);
                (x, forces) = (Vec::new(), Vec::new());
                loop {
                    simulation.sample(simulation.time(), &mut frame);
                    x.push(frame.pose.position.x);
                    forces.push(frame.joints[0].normal_force.norm());
                    if simulation.time() >= end {
                        break;
                    }
                    simulation.step_until(end).expect("runs");
                }
            }
            simulation.take_peaks(&mut peaks);
            let value = |name: &str| {
                let at = names.iter().position(|column| *column == name).expect(name);
                let mut record = Vec::new();
                sweep.layout().append(Some(result), &mut record);
                record[at]
            };
            assert_eq!(value("status"), 0.0);
            assert_eq!(value("x_end_m"), x[x.len() - 1]);
            let least = x.iter().copied().fold(f64::INFINITY, f64::min);
            let largest = x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert!((value("x_min_m") - least).abs() < 1e-9 && (value("x_max_m") - largest).abs() < 1e-9);
            // The mean velocity is the displacement over the time.
            let first = value("x_end_m") - 0.04 * value("vx_mean_m_s");
            assert!((first - x[0]).abs() < 1e-5, "{first} {}", x[0]);
            assert!(result.statistics.iter().all(|value| value.is_finite()));
            let joint = &scene.machine.loose_joints[0].name;
            let peak = value(&format!("{joint}_normal_max_N"));
            assert_eq!(peak, peaks[0].normal);
            assert!(forces.iter().all(|force| *force <= peak * (1.0 + 1e-12)));
            let mean = value(&format!("{joint}_normal_mean_N"));
            assert!(mean > 0.0 && mean < peak, "{mean} {peak}");
        }
    }

    #[test]
    fn a_point_without_enough_crossings_has_no_kept_part() {
        let scene = Scene::load("pendulum", &[]).expect("built in");
        // The pendulum starts at 30 degrees and swings through the vertical at least once in a second.
        let crossing = Crossing::parse(&scene, "rod.pose.gamma=0deg").expect("an angle");
        for (discard, has_kept_part) in [(1, true), (40, false)] {
            let (count, crossing) = (50, crossing.clone());
            let span = Span::Crossings { crossing, count, discard, duration: 1.0 };
            let (sweep, results) =
                sweep_of("pendulum", "gravity.z=-9.81m/s^2..-5m/s^2:2", span, "*.normal:max,time:end");
            for result in results {
                assert!(result.crossings >= 1 && result.crossings < 40, "{}", result.crossings);
                let (peak, end) = (result.statistics[0], result.statistics[1]);
                assert_eq!((peak.is_finite(), end == 1.0), (has_kept_part, has_kept_part));
                assert!(has_kept_part || result.joints[0].impacts_kept == 0);
                assert_eq!(result.times.len(), result.crossings.saturating_sub(discard));
                let mut record = Vec::new();
                sweep.layout().append(Some(&result), &mut record);
                assert_eq!(record.len(), sweep.layout().record_length());
            }
        }
    }

    #[test]
    fn a_given_period_replaces_the_period_of_the_drives() {
        let plan = Plan { periods: 3, discard: 1, phase: 0.0, exponent: false };
        let span = Span::Sections { plan, interval: Some(0.01) };
        let (sweep, results) = sweep_of("pendulum", "gravity.z=-9.81m/s^2..-5m/s^2:2", span, "time:end");
        assert_eq!(sweep.layout().kept(), 2);
        assert!(
            results.iter().all(|result| (result.statistics[0] - 0.03).abs() < 1e-12 && result.sections.len() == 24)
        );
    }
}
