//! Angles of hinges count turns: elements read the angle from the start on, however the equations represent it.

use crate::common::matrix::{FORMULATIONS, every_variant};
use crate::common::{frame_now, parse, run_until};
use crate::elements::frame_at;
use crate::joint_elements::start_simulation;
use jointplay_physics::machine::Vec3;
use jointplay_physics::simulate::Simulation;

/// Moment of inertia about the hinge, kg m^2; the centroid is on the axis.
const INERTIA: f64 = 0.01;

/// How the angle of the hinge `h` is known.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Angle {
    /// As a coordinate of the equations.
    Coordinate,
    /// From poses, because they are the coordinates.
    Poses,
    /// From poses, because the joint closes a loop.
    Closing,
    /// Both.
    ClosingPoses,
}
use Angle::{Closing, ClosingPoses, Coordinate, Poses};

const ANGLES: [Angle; 4] = [Coordinate, Poses, Closing, ClosingPoses];

impl Angle {
    fn closes_loop(self) -> bool {
        matches!(self, Closing | ClosingPoses)
    }

    /// The scene of one body that starts at an angle, rad, with a rate, rad/s.
    fn text(self, [angle, rate]: [f64; 2], more: &str) -> String {
        let joint = "[[joint]]\nname = \"h\"\nkind = \"revolute\"\nchild = \"b\"\naxis = [0, 1, 0]\n";
        let joints = if self.closes_loop() {
            format!(
                "[[joint]]\nname = \"carrier\"\nkind = \"free\"\nchild = \"b\"\n\
                 start = {{ position = \"0 0 0 m\", rotation = {{ axis = [0, 1, 0], angle = \"{angle:e} rad\" }}, \
                 angular_velocity = \"0 {rate:e} 0 rad/s\" }}\n{joint}closes_loop = true\n"
            )
        } else {
            format!("{joint}start = {{ position = \"{angle:e} rad\", velocity = \"{rate:e} rad/s\" }}\n")
        };
        format!(
            "[gravity]\nz = 0\n[[body]]\nname = \"b\"\nmass = \"1 kg\"\ninertia = \"1e-2 1e-2 1e-2 kg m^2\"\n{joints}{more}"
        )
    }

    fn formulation(self) -> &'static str {
        FORMULATIONS[usize::from(matches!(self, Poses | ClosingPoses))]
    }

    fn start(self, start: [f64; 2], more: &str, changes: &[(&str, &str)]) -> Simulation {
        let mut all = vec![("formulation", self.formulation())];
        all.extend(changes.iter().filter(|(key, _)| *key != "formulation"));
        start_simulation(&self.text(start, more), &all)
    }
}

fn coordinate(simulation: &mut Simulation) -> [f64; 2] {
    frame_now(simulation).coordinates[0]
}

/// Torque of the only element on the body about the axis of the hinge, N m.
fn torque(simulation: &mut Simulation) -> f64 {
    frame_now(simulation).elements[0].torque.expect("a torque").y
}

fn check_energy(simulation: &Simulation, label: &str) {
    let ledger = simulation.ledger().expect("a ledger");
    assert!(ledger.share() < 1e-5, "{label}: {ledger:?}");
    assert!(simulation.doubts().is_empty(), "{label}: {:?}", simulation.doubts());
}

#[test]
fn a_stop_at_one_end_leaves_a_body_alone_that_turns_away_from_it() {
    let trial = include_str!("../trials/one-sided-stop.toml");
    for formulation in FORMULATIONS {
        let mut simulation = start_simulation(trial, &[("formulation", formulation)]);
        run_until(&mut simulation, 2.0);
        let [angle, rate] = coordinate(&mut simulation);
        assert!((angle + 6.0).abs() < 1e-6 && (rate + 3.0).abs() < 1e-6, "{formulation}: {angle} {rate}");
        check_energy(&simulation, formulation);
    }
    for (limit, sense) in [("upper = \"90 deg\"", -1.0), ("lower = \"-90 deg\"", 1.0)] {
        let stop = format!("[[stop]]\nname = \"s\"\njoint = \"h\"\ntorque = \"10 N m\"\ndepth = \"1 deg\"\n{limit}\n");
        for known in ANGLES {
            let label = format!("{known:?} {limit}");
            let mut simulation = known.start([0.0, 20.0 * sense], &stop, &[]);
            run_until(&mut simulation, 2.0);
            let [angle, rate] = coordinate(&mut simulation);
            let errors = [angle - 40.0 * sense, rate - 20.0 * sense];
            assert!(errors.iter().all(|error| error.abs() < 1e-4), "{label}: {errors:?}");
            check_energy(&simulation, &label);
        }
    }
}

#[test]
fn stops_hold_at_either_side_of_half_a_turn_and_beyond() {
    let (speed, force, depth): (f64, f64, f64) = (10.0, 10.0, 1_f64.to_radians());
    // All energy is stored at the deepest point: 2/5 K d^2.5.
    let stiffness = force / depth.powf(1.5);
    let deepest = (0.5 * INERTIA * speed * speed / (0.4 * stiffness)).powf(0.4);
    for limit in [179_f64, 181.0, 530.0] {
        let stop = format!(
            "[[stop]]\nname = \"s\"\njoint = \"h\"\nlower = \"-{limit} deg\"\nupper = \"{limit} deg\"\ntorque = \"{force} N m\"\n\
             depth = \"1 deg\"\n"
        );
        for (known, sense) in ANGLES.into_iter().flat_map(|known| [(known, 1.0), (known, -1.0)]) {
            let label = format!("{known:?} {limit} {sense}");
            let mut simulation = known.start([0.0, speed * sense], &stop, &[("solver.tolerance", "1e-9")]);
            let arrival = limit.to_radians() / speed;
            let mut farthest: f64 = 0.0;
            while simulation.time() < arrival + 0.05 {
                simulation.step_until(arrival + 0.05).unwrap();
                let [angle, _] = coordinate(&mut simulation);
                farthest = farthest.max(sense * angle - limit.to_radians());
            }
            assert!(farthest < 1.001 * deepest && farthest > 0.9 * deepest, "{label}: {farthest} {deepest}");
            let [_, rate] = coordinate(&mut simulation);
            assert!((rate + speed * sense).abs() < 1e-4, "{label}: {rate}");
            check_energy(&simulation, &label);
        }
    }
}

#[test]
fn a_spring_wound_beyond_half_a_turn_pulls_back_to_its_position() {
    let trial = include_str!("../trials/clock.toml");
    for formulation in FORMULATIONS {
        let mut simulation = start_simulation(trial, &[("formulation", formulation)]);
        let torque = torque(&mut simulation);
        assert!((torque + 4.0).abs() < 1e-12, "{formulation}: {torque}");
    }
    for (start, position) in [(350.0_f64, 0.0_f64), (-190.0, 0.0), (20.0, 700.0), (725.0, 1.0)] {
        let spring = format!(
            "[[joint_spring]]\nname = \"s\"\njoint = \"h\"\nposition = \"{position} deg\"\nstiffness = \"2 N m/rad\"\n"
        );
        for known in ANGLES {
            let mut simulation = known.start([start.to_radians(), 0.0], &spring, &[]);
            // A joint that closes a loop has no start of its own: it begins within half a turn of 0.
            let start = if known.closes_loop() { start - 360.0 * (start / 360.0).round() } else { start };
            let torque = torque(&mut simulation);
            let error = torque + 2.0 * (start - position).to_radians();
            assert!(error.abs() < 1e-11, "{known:?} {start} {position}: {torque}");
            let [angle, _] = coordinate(&mut simulation);
            assert!((angle - start.to_radians()).abs() < 1e-11, "{known:?} {start}: {angle}");
        }
    }
}

#[test]
fn a_wound_spring_swings_over_several_turns_in_every_method() {
    let position = -400_f64.to_radians();
    let stiffness = 2.0;
    let spring = format!(
        "[[joint_spring]]\nname = \"s\"\njoint = \"h\"\nposition = \"-400 deg\"\nstiffness = \"{stiffness} N m/rad\"\n"
    );
    let omega = (stiffness / INERTIA).sqrt();
    for variant in every_variant() {
        let method = variant.method;
        let first_order = variant.bound() > 1e-6;
        let known = if variant.formulation == "tree" { [Coordinate, Closing] } else { [Poses, ClosingPoses] };
        for known in known {
            let mut changes = variant.close();
            if first_order {
                changes[1].1 = "50 us";
            }
            let mut simulation = known.start([0.0, 0.0], &spring, &changes);
            // Most of the way back after a swing to -800 degrees.
            let end = 0.4;
            run_until(&mut simulation, end);
            let [angle, _] = coordinate(&mut simulation);
            let expected = position - position * (omega * end).cos();
            let bound = if first_order { 0.05 } else { 1e-5 };
            assert!((angle - expected).abs() < bound, "{known:?} {method}: {angle} {expected}");
        }
    }
}

#[test]
fn a_motor_reaches_a_target_beyond_a_turn() {
    let motor = "[[motor]]\nname = \"m\"\njoint = \"h\"\nstiffness = \"1 N m/rad\"\ndamping = \"0.2 N m s/rad\"\n\
                 target = { law = \"constant\", position = \"400 deg\", velocity = \"0 rad/s\" }\n";
    for known in ANGLES {
        let mut simulation = known.start([0.0, 0.0], motor, &[]);
        run_until(&mut simulation, 3.0);
        let [angle, _] = coordinate(&mut simulation);
        assert!((angle.to_degrees() - 400.0).abs() < 1e-3, "{known:?}: {angle}");
        check_energy(&simulation, &format!("{known:?}"));
    }
}

#[test]
fn a_search_of_the_rest_passes_half_a_turn() {
    let spring = "[[joint_spring]]\nname = \"s\"\njoint = \"h\"\nposition = \"250 deg\"\nstiffness = \"1 N m/rad\"\n";
    for known in ANGLES {
        let mut simulation = known.start([2.0, 0.0], spring, &[("start", "equilibrium")]);
        let [angle, _] = coordinate(&mut simulation);
        assert!((angle.to_degrees() - 250.0).abs() < 1e-6, "{known:?}: {angle}");
        assert!(torque(&mut simulation).abs() < 1e-8, "{known:?}");
    }
}

#[test]
fn a_constant_torque_over_many_turns_creates_no_energy() {
    let spring = "[[joint_spring]]\nname = \"s\"\njoint = \"h\"\npreload = \"-0.5 N m\"\n";
    for known in ANGLES {
        let mut simulation = known.start([0.0, 0.0], spring, &[]);
        run_until(&mut simulation, 2.0);
        let [angle, rate] = coordinate(&mut simulation);
        assert!((angle - 100.0).abs() < 1e-3 && (rate - 100.0).abs() < 1e-3, "{known:?}: {angle} {rate}");
        let elastic = simulation.ledger().expect("a ledger").elastic_change;
        assert!((elastic + 50.0).abs() < 1e-3, "{known:?}: {elastic}");
        check_energy(&simulation, &format!("{known:?}"));
    }
}

#[test]
fn angles_of_joints_with_two_degrees_of_freedom_count_turns() {
    for (kind, coordinate, part) in [
        ("kind = \"cylindrical\"", "angle", 1),
        ("kind = \"universal\"\nchild_axis = [1, 0, 0]", "angle", 0),
        ("kind = \"universal\"\nchild_axis = [1, 0, 0]", "child_angle", 1),
    ] {
        let spring = format!(
            "[[joint_spring]]\nname = \"s\"\njoint = \"h\"\ncoordinate = \"{coordinate}\"\nposition = \"400 deg\"\n\
             stiffness = \"2 N m/rad\"\n"
        );
        let position = 400_f64.to_radians();
        let omega = (2.0 / INERTIA).sqrt();
        for known in ANGLES {
            let label = format!("{known:?} {kind} {coordinate}");
            let text = known.text([0.0, 0.0], &spring).replace("kind = \"revolute\"", kind);
            let text = text.replace("start = { position = \"0e0 rad\", velocity = \"0e0 rad/s\" }\n", "");
            let mut simulation = start_simulation(&text, &[("formulation", known.formulation())]);
            run_until(&mut simulation, 0.3);
            let angle = frame_now(&mut simulation).coordinates[part][0];
            let expected = position * (1.0 - (omega * 0.3).cos());
            assert!((angle - expected).abs() < 1e-4, "{label}: {angle} {expected}");
            check_energy(&simulation, &label);
        }
    }
}

#[test]
fn turns_survive_snapshots_saved_states_going_back_and_live_changes() {
    let spring =
        "[[joint_spring]]\nname = \"s\"\njoint = \"h\"\nposition = \"-900 deg\"\nstiffness = \"0.1 N m/rad\"\n";
    for known in ANGLES {
        let mut simulation = known.start([0.0, 0.0], spring, &[]);
        run_until(&mut simulation, 0.8);
        let [angle, _] = coordinate(&mut simulation);
        assert!(angle < -500_f64.to_radians(), "{known:?}: {angle}");
        let saved = serde_json::to_string(&simulation.snapshot()).unwrap();
        let mut copy = simulation.clone();
        run_until(&mut simulation, 1.2);
        let (hash, end) = (simulation.state().hash(), coordinate(&mut simulation));
        run_until(&mut copy, 1.2);
        assert_eq!((copy.state().hash(), coordinate(&mut copy)), (hash, end), "{known:?}");
        // Back from a later instant, and into a simulation that has not moved.
        run_until(&mut simulation, 1.5);
        let fresh = known.start([0.0, 0.0], spring, &[]);
        for mut other in [simulation.clone(), fresh] {
            other.resume(&serde_json::from_str(&saved).unwrap()).unwrap();
            let [there, _] = coordinate(&mut other);
            assert!((there - angle).abs() < 1e-12, "{known:?}: {there} {angle}");
            run_until(&mut other, 1.2);
            assert_eq!((other.state().hash(), coordinate(&mut other)), (hash, end), "{known:?}");
        }
        // Gravity exerts no torque, and another method continues from the same angle.
        for (key, value) in [("gravity.z", "-5 m/s^2"), ("solver.method", "radau5"), ("solver.method", "rk4")] {
            let next = parse(&known.text([0.0, 0.0], spring), &[("formulation", known.formulation()), (key, value)]);
            let [before, _] = coordinate(&mut simulation);
            simulation.adopt(&next.machine).unwrap();
            let [after, _] = coordinate(&mut simulation);
            assert!((after - before).abs() < 1e-12, "{known:?} {key}: {after} {before}");
        }
    }
}

#[test]
fn samples_inside_a_step_count_the_turns_of_their_own_instant() {
    let spring = "[[joint_spring]]\nname = \"s\"\njoint = \"h\"\npreload = \"0.1 N m\"\n";
    for known in ANGLES {
        let mut simulation = known.start([0.0, 60.0], spring, &[]);
        while simulation.time() < 0.5 {
            simulation.step().unwrap();
            let (from, to) = (simulation.step_start(), simulation.time());
            for part in 0..=4 {
                let t = from + 0.25 * f64::from(part) * (to - from);
                let mut frame = jointplay_physics::simulate::Frame::default();
                simulation.sample(t, &mut frame);
                let expected = 60.0 * t - 5.0 * t * t;
                assert!((frame.coordinates[0][0] - expected).abs() < 1e-4, "{known:?} {t}");
                let stored = 0.1 * expected;
                assert!((frame.elastic - stored).abs() < 1e-4, "{known:?} {t}: {} {stored}", frame.elastic);
            }
        }
    }
}

#[test]
fn steps_of_several_turns_are_counted() {
    let joint = |name: &str, parent: &str, child: &str, more: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\nkind = \"revolute\"\n{parent}child = \"{child}\"\naxis = [0, 1, 0]\n{more}\n"
        )
    };
    let body =
        |name: &str| format!("[[body]]\nname = \"{name}\"\nmass = \"1 kg\"\ninertia = \"1e-2 1e-2 1e-2 kg m^2\"\n");
    // Two wheels on one axis, and a soft spring on a hinge between them.
    let text = format!(
        "[gravity]\nz = 0\n{}{}{}{}{}[[joint_spring]]\nname = \"s\"\njoint = \"h\"\nstiffness = \"1e-9 N m/rad\"\n",
        body("a"),
        body("b"),
        joint("left", "", "a", "start = { velocity = \"-700 rad/s\" }"),
        joint("right", "", "b", "start = { velocity = \"800 rad/s\" }"),
        joint("h", "parent = \"a\"\n", "b", "closes_loop = true"),
    );
    let mut simulation = start_simulation(&text, &[]);
    let frame = frame_at(&mut simulation, 1.0);
    assert!(simulation.statistics().steps < 300, "{}", simulation.statistics().steps);
    let [angle, _] = frame.coordinates[2];
    assert!((angle - 1500.0).abs() < 1e-3, "{angle}");
    assert!((frame.elements[0].torque.unwrap() + Vec3::y() * 1.5e-6).norm() < 1e-11);
}
