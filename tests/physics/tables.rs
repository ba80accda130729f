//! Measured forces and motions stay between their points, or the run is doubted.

use crate::common::{THREE_VARIANTS, parse};
use crate::elements::frame_at;
use jointplay_physics::machine::{Doubt as MachineDoubt, Machine};
use jointplay_physics::simulate::{Doubt, Simulation};
use jointplay_scene::Scene;

/// A force of 0, then 100 N from 0.101 s to 0.2 s, then 0, on 1 kg.
const SQUARE: &str = include_str!("../trials/square.toml");
/// A drive at 0 until 0.1 s and at 0.1 m from 0.1001 s.
const STEP: &str = include_str!("../trials/step.toml");

/// The scene with these lines about interpolation in its table.
fn interpolated(text: &str, interpolation: &str) -> Scene {
    parse(&text.replace("law = \"table\",", &format!("law = \"table\", {interpolation}")), &[])
}

/// The sentence about a table that overshoots, before a run and after one.
fn overshoot(scene: &Scene) -> Option<String> {
    let is_overshoot = |doubt: &MachineDoubt| matches!(doubt, MachineDoubt::Overshoot { .. });
    let before = scene.machine.doubts().into_iter().find(is_overshoot);
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    simulation.step().unwrap();
    let after = simulation.doubts().into_iter().find_map(|doubt| match doubt {
        Doubt::Machine(doubt) => Some(doubt).filter(is_overshoot),
        _ => None,
    });
    assert_eq!(before, after);
    before.map(|doubt| doubt.to_string())
}

#[test]
fn a_measured_pulse_has_the_impulse_of_its_points() {
    for given in ["", "interpolation = \"monotone\",", "interpolation = \"linear\","] {
        let scene = interpolated(SQUARE, given);
        assert_eq!(overshoot(&scene), None);
        for (method, formulation) in THREE_VARIANTS {
            let mut machine = Machine::clone(&scene.machine);
            let changes = [("solver.method", method), ("solver.tolerance", "1e-8"), ("formulation", formulation)];
            machine.solver = parse(SQUARE, &changes).machine.solver;
            machine.formulation = parse(SQUARE, &changes).machine.formulation;
            let mut simulation = Simulation::new(&machine).unwrap();
            for n in 0..=1000 {
                let frame = frame_at(&mut simulation, 0.25e-3 * f64::from(n));
                let force = frame.elements[0].force.x;
                assert!((-1e-9..100.0 + 1e-9).contains(&force), "{given} {method}: {force} at {}", frame.time);
            }
            let frame = frame_at(&mut simulation, 1.0);
            // 1 kg: the speed is the impulse, 100 N times 0.1 s by straight lines.
            let off = frame.bodies[0].velocity.x - 10.0;
            assert!(off.abs() < 1e-7, "{given} {method}: {off:e}");
            assert!(simulation.ledger().unwrap().relative_residual().abs() < 1e-7);
        }
    }
    let sentence = overshoot(&interpolated(SQUARE, "interpolation = \"spline\",")).expect("the spline overshoots");
    for fragment in ["factor of L", "between 0 and 100", "interpolation = monotone"] {
        assert!(sentence.contains(fragment), "{sentence}");
    }
}

#[test]
fn a_measured_step_is_doubted_or_stays_within_its_points() {
    let sentence = overshoot(&interpolated(STEP, "")).expect("the spline overshoots");
    for fragment in ["drive of g", "between 0 mm and 100 mm", "interpolation = monotone"] {
        assert!(sentence.contains(fragment), "{sentence}");
    }
    let scene = interpolated(STEP, "interpolation = \"monotone\",");
    assert_eq!(overshoot(&scene), None);
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    for n in 0..=400 {
        let frame = frame_at(&mut simulation, 1e-3 * f64::from(n));
        let x = frame.bodies[0].position.x;
        assert!((-1e-12..0.1 + 1e-12).contains(&x), "{x} at {}", frame.time);
    }
    assert!((frame_at(&mut simulation, 0.5).bodies[0].position.x - 0.1).abs() < 1e-12);
}

#[test]
fn the_mean_of_a_repeated_load_is_near_that_of_straight_lines() {
    let points = "[[\"0 s\", 0], [\"0.1 s\", 120], [\"0.3 s\", 80], [\"1 s\", 0]]";
    let text = &SQUARE[..SQUARE.find("factor").unwrap()];
    let speed = |more: &str| {
        let text = format!("{text}factor = {{ law = \"table\", {more} repeat = true, points = {points} }}\n");
        frame_at(&mut Simulation::new(&parse(&text, &[]).machine).unwrap(), 1.0).bodies[0].velocity.x
    };
    // (0.1 s * 120 + 0.2 s * 200 + 0.7 s * 80) N / 2.
    assert!((speed("interpolation = \"linear\",") - 54.0).abs() < 1e-3);
    // A monotone cubic is flat at the peak of four points, and stays between them.
    assert!((44.0..64.0).contains(&speed("")), "{}", speed(""));
}

#[test]
fn splines_of_characteristics_are_doubted_with_their_units() {
    let text = "[gravity]\nz = 0\n[[body]]\nname = \"m\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
        [[joint]]\nname = \"h\"\nkind = \"revolute\"\nchild = \"m\"\naxis = [0, 0, 1]\n\
        [[joint_spring]]\nname = \"detent\"\njoint = \"h\"\n\
        characteristic = [[\"-30 deg\", 0], [\"-2 deg\", 0], [\"-1 deg\", \"5 N m\"], [\"1 deg\", \"-5 N m\"], [\"2 deg\", 0], [\"30 deg\", 0]]\n";
    assert_eq!(overshoot(&parse(text, &[])), None);
    let sentence =
        overshoot(&parse(&format!("{text}interpolation = \"spline\"\n"), &[])).expect("the spline overshoots");
    for fragment in ["characteristic of detent", "between -5 N m and 5 N m", "deg"] {
        assert!(sentence.contains(fragment), "{sentence}");
    }
}
