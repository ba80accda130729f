//! Whether the motion of a run relative to its drives has ended.
//!
//! - A scene with moving drives has settled when every ball with play has, over the last eighth of the drives' period, stayed
//!   in contact, moved in its socket by no more than [`MAX_DISPLACEMENT`] of the clearance (at that rate, it hardly crosses its
//!   play once per period), and carried the same load within [`MAX_LOAD_CHANGE`]. If motion resumes after such an interval, the
//!   next one must last a whole period: a ball that crosses its play once per turn is quiet in between.
//! - A scene without a periodic drive is at rest when no drive moves and no point of a body has moved by more than
//!   [`MAX_DISPLACEMENT`] of the smallest clearance for [`REST_TIME`]. A pendulum also stops at the end of each swing, but only
//!   briefly.
//! - A scene without play never settles: nothing in it rattles.
//!
//! The criteria use only the frames of the run and the laws of its drives.

use std::sync::Arc;

use crate::analysis::drive::common_period;
use crate::machine::Vec3;
use crate::mechanism::{Law, laws_of};
use crate::scene::Scene;
use crate::simulate::{ContactMode, Frame, JointReport};

/// Fraction of the period over which a driven scene is watched.
const WATCHED_FRACTION: f64 = 1.0 / 8.0;
/// How long a scene without drives is watched, s.
const REST_TIME: f64 = 0.5;
/// Largest displacement of a ball, or of a point of a body, over that time, in clearances.
const MAX_DISPLACEMENT: f64 = 0.15;
/// Largest relative change of a contact force over that time.
const MAX_LOAD_CHANGE: f64 = 0.25;
/// Instants stored per observation interval.
const INSTANTS: f64 = 16.0;

/// An earlier instant, for comparison.
#[derive(Clone, Debug, Default)]
struct Instant {
    time: f64,
    points: Vec<Vec3>,
    /// Normal force by joint with play, N; empty without a drive.
    loads: Vec<f64>,
}

/// Detects from the frames of a run whether it has settled.
#[derive(Clone, Debug)]
pub struct Settling {
    /// Longest period of the drives, s; `None` if none is periodic.
    period: Option<f64>,
    /// Laws of the drives of a scene without a periodic one.
    laws: Vec<Arc<dyn Law>>,
    /// Size of the machine at the start, m.
    size: f64,
    /// Body of each socket, and clearance of each joint with play, m.
    joints: Vec<Option<(Option<usize>, f64)>>,
    /// Earlier instants that equal the latest within the tolerances, oldest first.
    past: Vec<Instant>,
    /// The latest instant.
    latest: Instant,
    /// Start of the quiet time, s.
    quiet_since: Option<f64>,
    /// Whether motion resumed after a quiet time.
    has_resumed: bool,
}

impl Settling {
    /// Observes a run of `scene` from now on.
    pub fn new(scene: &Scene) -> Self {
        let period = common_period(&scene.machine).unwrap_or_else(|[first, second]| Some(first.max(second)));
        let play = |joint: &crate::machine::LooseJoint| {
            let clearance = joint.contact.clearance;
            (clearance > 0.0).then_some((joint.carrier().body, clearance))
        };
        Self {
            period,
            laws: if period.is_none() { laws_of(&scene.machine).collect() } else { Vec::new() },
            size: 0.0,
            joints: scene.machine.loose_joints.iter().map(play).collect(),
            past: Vec::new(),
            latest: Instant::default(),
            quiet_since: None,
            has_resumed: false,
        }
    }

    /// Whether periodic drives move the machine: once settled, it moves without rattling; otherwise it is at rest.
    pub fn is_driven(&self) -> bool {
        self.period.is_some()
    }

    /// Whether the motion has settled.
    pub fn has_settled(&self) -> bool {
        let needed = match self.period {
            Some(period) if self.has_resumed => period,
            _ => 0.0,
        };
        self.quiet_since.is_some_and(|since| self.latest.time - since >= needed)
    }

    /// Records the next instant of the run.
    pub fn record(&mut self, frame: &Frame) {
        let smallest = self.joints.iter().flatten().map(|(_, c)| *c);
        let smallest = smallest.fold(f64::INFINITY, f64::min);
        if !smallest.is_finite() || frame.joints.len() != self.joints.len() {
            return;
        }
        let is_free = |(play, now): (&Option<_>, &JointReport)| play.is_some() && now.state == ContactMode::Free;
        let is_driven = self.is_driven();
        let moves = |law: &Arc<dyn Law>| law.at(frame.time).rate != 0.0;
        if self.laws.iter().any(moves) || (is_driven && self.joints.iter().zip(&frame.joints).any(is_free)) {
            self.past.clear();
        }
        self.sample(frame);
        let interval = self.period.map_or(REST_TIME, |period| period * WATCHED_FRACTION);
        let Self { joints, latest, .. } = self;
        self.past.retain(|then| {
            let mut points = then.points.iter().zip(&latest.points).enumerate();
            let is_still = points.all(|(i, (a, b))| {
                let clearance = if is_driven { joints[i].map(|(_, clearance)| clearance) } else { Some(smallest) };
                clearance.is_none_or(|clearance| (a - b).norm() <= MAX_DISPLACEMENT * clearance)
            });
            let mut loads = then.loads.iter().zip(&latest.loads);
            // Instants older than two intervals are no longer needed.
            is_still
                && latest.time - then.time < 2.0 * interval
                && loads.all(|(a, b)| (a - b).abs() <= MAX_LOAD_CHANGE * a)
        });
        let age_of = |then: Option<&Instant>| then.map(|then| latest.time - then.time);
        let is_quiet = age_of(self.past.first()).is_some_and(|age| age >= interval);
        match (is_quiet, self.quiet_since) {
            (true, None) => self.quiet_since = Some(latest.time),
            (false, Some(_)) => (self.quiet_since, self.has_resumed) = (None, true),
            _ => {}
        }
        if age_of(self.past.last()).is_none_or(|age| age >= interval / INSTANTS) {
            self.past.push(latest.clone());
        }
    }

    /// Samples positions: in a driven scene the balls in the axes of their sockets, otherwise points of the bodies.
    fn sample(&mut self, frame: &Frame) {
        if let Some(body) = frame.bodies.first().filter(|_| self.size == 0.0) {
            let distances = frame.joints.iter().map(|joint| (joint.ball_centre - body.position).norm());
            self.size = distances.fold(0.0, f64::max);
        }
        let size = self.size;
        let Instant { time, points, loads } = &mut self.latest;
        *time = frame.time;
        points.clear();
        loads.clear();
        if self.period.is_none() {
            // Beside a body's origin, two points at the size of the machine show its rotation.
            points.extend(frame.bodies.iter().flat_map(|body| {
                let far = |axis: usize| body.position + size * body.rotation.column(axis);
                [body.position, far(0), far(1)]
            }));
            points.extend(frame.joints.iter().map(|joint| joint.ball_centre));
            return;
        }
        for (joint, now) in self.joints.iter().zip(&frame.joints) {
            let socket = joint.and_then(|(body, _)| body);
            let axes = socket.and_then(|body| frame.bodies.get(body));
            points.push(match axes {
                Some(body) => body.rotation.transpose() * now.eccentricity,
                None => now.eccentricity,
            });
            loads.push(joint.map_or(0.0, |_| now.normal_force.norm()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Simulation;

    /// Runs `scene` to `to`, s. Returns the times at which it settled or resumed.
    fn changes_of_state(scene: &Scene, to: f64) -> Vec<f64> {
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut settling = Settling::new(scene);
        let (mut frame, mut switch_times) = (Frame::default(), Vec::new());
        while simulation.time() < to {
            simulation.step().expect("runs");
            simulation.sample(simulation.time(), &mut frame);
            settling.record(&frame);
            if settling.has_settled() != (switch_times.len() % 2 == 1) {
                switch_times.push(frame.time);
            }
        }
        switch_times
    }

    fn scene(name: &str, changes: &[(&str, &str)]) -> Scene {
        let changes: Vec<(String, String)> =
            changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Scene::load(name, &changes).expect("built in")
    }

    #[test]
    fn the_papers_mechanism_settles_after_rattling_and_stays_settled() {
        let switch_times = changes_of_state(&scene("spcmm", &[]), 2.2);
        assert!(switch_times.len() == 1 && (0.1..0.45).contains(&switch_times[0]), "{switch_times:?}");
    }

    #[test]
    fn a_swinging_pendulum_and_a_mechanism_driven_across_its_play_never_settle() {
        for (name, changes, to) in [
            ("pendulum", &[][..], 3.0),
            ("chain", &[("chain.links", "3")], 1.5),
            ("slider-crank", &[], 1.5),
            ("slider-crank-driven", &[], 4.0),
            ("slider-crank-driven", &[("contact.friction", "0")], 3.0),
            ("slider-crank-driven", &[("contact.friction", "0.5")], 3.0),
        ] {
            let switch_times = changes_of_state(&scene(name, changes), to);
            assert!(switch_times.is_empty(), "{name} {changes:?}: {switch_times:?}");
        }
    }

    #[test]
    fn a_machine_is_at_rest_only_while_no_drive_moves_and_no_body_turns() {
        let text = scene("pendulum", &[]).source.text.replace("-30 deg", "0 deg");
        let at_rest = |text: &str, to: f64| {
            let scene = Scene::parse(text, None, &[]).expect("a scene");
            let switch_times = changes_of_state(&scene, to);
            (Settling::new(&scene).is_driven(), switch_times.len() % 2 == 1)
        };
        // The socket moves by less than the tolerance in half a second.
        let carriage = r#"
            [[body]]
            name = "carriage"
            mass = "1 kg"
            inertia = "1 1 1 kg m^2"
            [[joint]]
            name = "slide"
            kind = "prismatic"
            child = "carriage"
            axis = [1, 0, 0]
            drive = { law = "ramp", to = "0.1 mm", start = "1.5 s", duration = "3 s" }
        "#;
        let carried = text.replace(r#"socket = { body = "world","#, r#"socket = { body = "carriage","#) + carriage;
        assert_ne!(carried, text.clone() + carriage);
        assert_eq!([1.4, 3.0, 6.0].map(|to| at_rest(&carried, to)), [(false, true), (false, false), (false, true)]);
        // A rod that turns about its own axis, without friction.
        let turning = text.replace("friction = 0.15", "friction = 0");
        assert!(at_rest(&turning, 3.0).1);
        let turning = turning.replace("[joint.start]", "[joint.start]\nangular_velocity = \"0 0 1 rad/s\"");
        assert!(!at_rest(&turning, 3.0).1);
    }

    #[test]
    fn a_rod_that_hangs_straight_down_comes_to_rest() {
        let text = scene("pendulum", &[]).source.text.to_string();
        let hanging = text.replace("-30 deg", "0 deg");
        assert_ne!(hanging, text);
        let hanging = Scene::parse(&hanging, None, &[]).expect("a scene");
        let switch_times = changes_of_state(&hanging, 1.5);
        assert!(switch_times.len() == 1 && switch_times[0] > REST_TIME, "{switch_times:?}");
    }
}
