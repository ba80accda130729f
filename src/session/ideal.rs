//! The ideal motion beside the run: the same scene with every ball joint closed, under the same drives and applied forces. It is
//! computed only while shown, up to the displayed instant, and does not affect the run.

use super::clock::Clock;
use super::companion::Companion;
use crate::machine::{AppliedForces, Machine, Output, Vec3};
use crate::simulate::{Frame, Simulation, StartError, closed};

/// The ideal motion follows the recording if it is less than this behind, s, in at most this many steps.
const FOLLOW_LAG: f64 = 0.02;
const FOLLOW_STEPS: u32 = 512;
/// Stepping budget per frame on the way to the displayed instant, s.
const FRAME_BUDGET: f64 = 4e-3;

/// The output point of a scene in `frame`, m: its probe tip, or its output body's origin.
pub fn output_point(output: &Output, frame: &Frame) -> Option<Vec3> {
    let body = frame.bodies.get(output.body)?;
    let arm = output.probe.map_or_else(Vec3::zeros, |probe| body.rotation * probe);
    Some(body.position + arm)
}

/// Gravity and force elements of a run over time. The ideal motion applies the same changes.
#[derive(Clone, Debug, PartialEq)]
pub struct AppliedHistory {
    /// Start time, s, and what acts from then on, in order.
    changes: Vec<(f64, AppliedForces)>,
}

impl AppliedHistory {
    /// Constant from the start.
    pub fn new(forces: AppliedForces) -> Self {
        Self { changes: vec![(f64::NEG_INFINITY, forces)] }
    }

    /// Records that `forces` acted in a step of the run from `start`, s. Later entries belong to an abandoned future and are
    /// dropped.
    /// Returns whether any were dropped or the forces changed.
    pub fn observe(&mut self, start: f64, forces: AppliedForces) -> bool {
        let retained = self.changes.partition_point(|(time, _)| *time <= start);
        let has_dropped = retained < self.changes.len();
        self.changes.truncate(retained.max(1));
        let last = self.changes.len() - 1;
        if self.changes[last].1 == forces {
            return has_dropped;
        }
        if self.changes[last].0 == start {
            self.changes[last].1 = forces;
        } else {
            self.changes.push((start, forces));
        }
        true
    }

    fn at(&self, time: f64) -> &AppliedForces {
        let known = self.changes.partition_point(|(since, _)| *since <= time);
        &self.changes[known.max(1) - 1].1
    }

    /// Time of the next change after `time`, s.
    fn next(&self, time: f64) -> f64 {
        let known = self.changes.partition_point(|(since, _)| *since <= time);
        self.changes.get(known).map_or(f64::INFINITY, |next| next.0)
    }
}

/// The ideal motion of a scene.
#[derive(Clone)]
pub struct Ideal {
    output: Output,
    motion: Result<Companion, StartError>,
}

impl Ideal {
    /// The ideal motion of `machine`, at its start. [`Self::error_message`] reports loops that do not close and a machine too large
    /// with closed joints.
    pub fn new(machine: &Machine) -> Self {
        Self { output: machine.output.clone(), motion: Simulation::new(&closed(machine)).map(Companion::new) }
    }

    /// Advances to `time`, s, up to which the run is recorded, if the motion lags by less than `FOLLOW_LAG`.
    pub fn follow(&mut self, time: f64, forces: &AppliedHistory) {
        if self.motion.as_ref().is_ok_and(|motion| time - motion.simulation.time() < FOLLOW_LAG) {
            let mut left = FOLLOW_STEPS;
            self.move_to(time, forces, || {
                left = left.saturating_sub(1);
                left > 0
            });
        }
    }

    /// Advances to `time`, s, within the budget of a frame.
    pub fn catch_up(&mut self, time: f64, forces: &AppliedHistory, clock: Clock) {
        if self.frame(time).is_none() {
            let start = clock();
            self.move_to(time, forces, || clock() - start < FRAME_BUDGET);
        }
    }

    /// Samples the state at `time`, s, if `may_step` allows the steps needed.
    fn move_to(&mut self, time: f64, forces: &AppliedHistory, mut may_step: impl FnMut() -> bool) {
        let Ok(motion) = &mut self.motion else {
            return;
        };
        if time < motion.simulation.step_start() {
            motion.go_back(time);
        }
        let is_reached = motion.advance(time, |motion| {
            may_step().then(|| {
                motion.save_state();
                let now = motion.simulation.time();
                if motion.simulation.state().applied_forces() != *forces.at(now) {
                    let changed = motion.simulation.set_applied_forces(forces.at(now));
                    changed.expect("an explicit method takes any forces");
                }
                forces.next(now)
            })
        });
        if is_reached {
            motion.sample(time);
        }
    }

    /// Drops states after `time`, s, where applied forces changed or the run branched.
    pub(crate) fn forget_after(&mut self, time: f64) {
        if let Ok(motion) = &mut self.motion {
            motion.forget_after(time);
        }
    }

    /// The frame at `time`, s; `None` if that was not reached.
    pub fn frame(&self, time: f64) -> Option<&Frame> {
        let motion = self.motion.as_ref().ok()?;
        Some(&motion.frame).filter(|frame| frame.time == time)
    }

    /// Whether the motion has not reached `time`, s, yet.
    pub fn is_behind(&self, time: f64) -> bool {
        self.motion.as_ref().is_ok_and(|motion| motion.frame.time != time && motion.stopped.is_none())
    }

    /// Output point of the run in `frame` minus the ideal one at that time, m; `None` if that time was not reached.
    pub fn output_error(&self, frame: &Frame) -> Option<Vec3> {
        let ideal = self.frame(frame.time)?;
        Some(output_point(&self.output, frame)? - output_point(&self.output, ideal)?)
    }

    /// Why there is no ideal motion, or why it ended.
    pub fn error_message(&self) -> Option<String> {
        match &self.motion {
            Err(error) => Some(format!("with ideal joints, {error}")),
            Ok(motion) => motion.stopped.as_ref().map(|stopped| {
                let time = super::value::time(stopped.time);
                format!("with ideal joints, {} at {time}", stopped.fault)
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{BUILT_IN, Scene};
    use crate::session::companion::MAX_STATES;
    use crate::session::player::Player;
    use crate::simulate::Quantity;

    fn scene(name: &str, changes: &[(&str, &str)]) -> Scene {
        let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let changes: Vec<(String, String)> = changes.iter().map(own).collect();
        Scene::load(name, &changes).expect("built in")
    }

    fn catch_up_fully(player: &mut Player) {
        for _ in 0..10_000 {
            player.update_ghosts();
            if !player.is_ideal_behind() {
                return;
            }
        }
        panic!("the ideal motion never catches up");
    }

    /// Output point of `machine` at `time`, from an independent run.
    fn output_of_separate_run(machine: &Machine, output: &Output, time: f64) -> Vec3 {
        let mut frame = Frame::default();
        let mut run = Simulation::new(machine).expect("starts");
        run.advance_to(time).expect("runs");
        run.sample(time, &mut frame);
        output_point(output, &frame).expect("has a body")
    }

    #[test]
    fn the_tip_error_is_recorded_with_and_without_the_picture_of_the_ideal_motion() {
        let scene = scene("four-bar", &[]);
        let [mut shown, mut hidden] = [(); 2].map(|()| Player::new(&scene).expect("starts"));
        shown.set_ideal(true);
        hidden.record_tip_error(true);
        let channel = shown.channels().tip_error();
        for time in [0.02, 0.05, 0.07] {
            for player in [&mut shown, &mut hidden] {
                player.run_to(time);
                player.update_ghosts();
            }
            assert!(hidden.ideal().is_none(), "not shown");
            let [recorded, expected] = [&hidden, &shown].map(|player| {
                let mut bins = Vec::new();
                player.history().bins(channel, 0.0, time, 4000, &mut bins);
                bins
            });
            assert!(recorded.iter().filter(|bin| bin.greatest > 0.0).count() > 50, "{time} s");
            assert_eq!(recorded, expected);
        }
        assert_eq!(hidden.simulation().state_hash(), shown.simulation().state_hash());
    }

    #[test]
    fn the_output_error_equals_that_of_two_separate_runs_and_the_run_is_unchanged() {
        for name in BUILT_IN {
            let scene = scene(name, &[]);
            let [mut with, mut without] = [(); 2].map(|()| Player::new(&scene).expect("starts"));
            with.set_ideal(true);
            // Many loose joints take long to simulate.
            let part = if scene.machine.loose_joints.len() > 3 { 0.4 } else { 1.0 };
            for (turn, time) in [0.013, 0.03, 0.021_3].map(|time| part * time).into_iter().enumerate() {
                if turn == 2 {
                    // Back to the start and there again.
                    with.reset().expect("starts");
                    without.reset().expect("starts");
                }
                with.run_to(time);
                without.run_to(time);
                catch_up_fully(&mut with);
                assert_eq!(with.simulation().state_hash(), without.simulation().state_hash(), "{name}");
                let error = with.ideal().expect("on").output_error(with.frame());
                let error = error.unwrap_or_else(|| panic!("{name}: none at {time}"));
                let time = with.frame().time;
                let expected = output_of_separate_run(&scene.machine, &scene.machine.output, time)
                    - output_of_separate_run(&closed(&scene.machine), &scene.machine.output, time);
                let deviation = (error - expected).norm();
                assert!(deviation < 1e-12 + 1e-9 * expected.norm(), "{name}: {deviation:e}");
                assert!(expected.norm() > 1e-6, "{name}: {expected:?}");
            }
        }
    }

    #[test]
    fn the_output_error_agrees_with_the_closed_form_and_is_recorded() {
        let mut player = Player::new(&scene("spcmm", &[])).expect("starts");
        player.set_ideal(true);
        player.run_to(0.02);
        catch_up_fully(&mut player);
        let error = player.ideal().expect("on").output_error(player.frame());
        let probe = player.frame().probe_error.expect("has a closed form");
        assert!((error.expect("reached") - probe).norm() < 1e-9);
        let channel = player.channels().tip_error();
        assert_eq!(player.channels().list()[channel].quantity, Quantity::TipError);
        let mut bins = Vec::new();
        player.history().bins(channel, 0.0, 0.02, 4000, &mut bins);
        assert!(bins.len() > 50, "{}", bins.len());
        let last = bins[bins.len() - 1];
        assert!((last.greatest - probe.norm()).abs() < 2e-6 * probe.norm() + 1e-9);
        player.set_ideal(false);
        player.run_to(0.03);
        let before = bins.len();
        bins.clear();
        player.history().bins(channel, 0.0, 0.02, 4000, &mut bins);
        assert!(bins.len() <= before + 1, "no new points without the ideal motion");
    }

    #[test]
    fn the_ideal_motion_goes_back_with_the_run_and_follows_its_gravity() {
        let changes = [("joint.B.clearance", "0"), ("joint.C.clearance", "0.1 mm")];
        let scene = scene("slider-crank", &changes);
        let mut player = Player::new(&scene).expect("starts");
        player.set_ideal(true);
        player.run_to(0.05);
        catch_up_fully(&mut player);
        let change = player.simulation().time();
        player.set("gravity.z", "0").expect("in range");
        player.run_to(0.12);
        catch_up_fully(&mut player);
        let time = player.frame().time;
        let ideal_output = |player: &Player| {
            let ideal = player.ideal().expect("on").frame(player.frame().time);
            output_point(&scene.machine.output, ideal.expect("reached")).expect("has a body")
        };
        let mut other = Simulation::new(&closed(&scene.machine)).expect("starts");
        let mut frame = Frame::default();
        while other.time() < change {
            other.step_until(change).expect("runs");
        }
        let mut weightless = AppliedForces::of(&scene.machine);
        weightless.gravity.z = 0.0;
        other.set_applied_forces(&weightless).expect("no element changes");
        other.advance_to(time).expect("runs");
        other.sample(time, &mut frame);
        let expected = output_point(&scene.machine.output, &frame).expect("has a body");
        let deviation = (ideal_output(&player) - expected).norm();
        assert!(deviation < 1e-9, "{deviation:e}");
        // If switched on later, the ideal motion still applies the change.
        player.set_ideal(false);
        player.set_ideal(true);
        catch_up_fully(&mut player);
        assert_eq!(ideal_output(&player), expected);
        // Single steps back.
        for _ in 0..20 {
            player.single_step();
        }
        catch_up_fully(&mut player);
        for _ in 0..20 {
            player.step_back();
            catch_up_fully(&mut player);
        }
        let time = player.frame().time;
        other.advance_to(time).expect("runs");
        let mut uninterrupted = Simulation::new(&closed(&scene.machine)).expect("starts");
        while uninterrupted.time() < change {
            uninterrupted.step_until(change).expect("runs");
        }
        uninterrupted.set_applied_forces(&weightless).expect("no element changes");
        uninterrupted.advance_to(time).expect("runs");
        uninterrupted.sample(time, &mut frame);
        let expected = output_point(&scene.machine.output, &frame).expect("has a body");
        assert!((ideal_output(&player) - expected).norm() < 1e-9);
    }

    #[test]
    fn the_number_of_saved_states_is_bounded_and_every_instant_stays_reachable() {
        let scene = scene("pendulum", &[]);
        let mut ideal = Ideal::new(&scene.machine);
        let forces = AppliedHistory::new(AppliedForces::of(&scene.machine));
        let at = |ideal: &mut Ideal, time: f64| {
            ideal.move_to(time, &forces, || true);
            assert!(ideal.motion.as_ref().expect("starts").states.len() <= MAX_STATES);
            output_point(&scene.machine.output, ideal.frame(time).expect("reached")).expect("a body")
        };
        let times: Vec<f64> = (0..60).map(|k| 0.05 * f64::from(k)).collect();
        let forth: Vec<Vec3> = times.iter().map(|time| at(&mut ideal, *time)).collect();
        for (time, there) in times.iter().zip(&forth).rev() {
            assert_eq!(at(&mut ideal, *time), *there, "bit by bit at {time}");
        }
    }

    #[test]
    fn a_scene_whose_loops_do_not_close_reports_it() {
        // A rod between two sockets that are farther apart than its balls, by less than the play.
        let text = crate::scene::built_in_text("pendulum").expect("built in");
        let second = "
            [[ball_joint]]
            name = \"S2\"
            socket = { body = \"world\", at = \"0 0 -200.2 mm\" }
            ball = { body = \"rod\", at = \"0 0 -100 mm\" }
            opening = [0, -1, 0]
        ";
        let text = text.replace("-30 deg", "0 deg") + second;
        let scene = Scene::parse(&text, None, &[]).expect("reads");
        let mut player = Player::new(&scene).expect("has enough play");
        player.set_ideal(true);
        player.run_to(0.01);
        player.update_ghosts();
        let ideal = player.ideal().expect("on");
        let fault = ideal.error_message().expect("cannot close");
        assert!(fault.contains("ball joint S"), "{fault}");
        assert!(!player.is_ideal_behind() && ideal.output_error(player.frame()).is_none());
    }

    #[test]
    fn applied_forces_follow_the_branch_that_the_run_took() {
        let g = |z: f64| AppliedForces { gravity: Vec3::new(0.0, 0.0, z), ..AppliedForces::of(&Machine::default()) };
        let mut forces = AppliedHistory::new(g(-9.81));
        assert!(!forces.observe(0.0, g(-9.81)));
        assert!(forces.observe(1.0, g(-5.0)));
        assert!(!forces.observe(1.5, g(-5.0)));
        assert!(forces.observe(2.0, g(0.0)));
        assert_eq!(*forces.at(0.5), g(-9.81));
        assert_eq!((forces.at(1.0), forces.next(1.0)), (&g(-5.0), 2.0));
        // Back to 0.9 s: later entries are gone.
        assert!(forces.observe(0.9, g(-9.81)));
        assert_eq!((forces.at(3.0), forces.next(0.0)), (&g(-9.81), f64::INFINITY));
        assert!(forces.observe(1.2, g(1.0)) && forces.observe(1.2, g(2.0)));
        assert_eq!(*forces.at(1.2), g(2.0));
    }
}
