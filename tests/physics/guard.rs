//! A run that cannot continue stops with place, time and advice, and keeps its last good state.

use crate::common::{frame_now, live, parse, run_until, scene, simulation};
use jointplay_physics::simulate::{Simulation, StopAdvice, StopFault, Stopped};
use jointplay_physics::units::format_quantity_digits;
use jointplay_scene::{LiveScene, built_in_text};

/// Steps until the guard stops the run.
fn run_to_stop(simulation: &mut Simulation) -> Stopped {
    while simulation.time() < 10.0 {
        if let Err(stopped) = simulation.step() {
            return stopped;
        }
    }
    panic!("no stop within 10 s");
}

/// Checks that the state is the last good one, can be sampled, and is not changed by further steps.
fn check_last_good_state(simulation: &mut Simulation, stopped: &Stopped) {
    assert_eq!(simulation.time(), stopped.time);
    let hash = simulation.state_hash();
    assert!(simulation.state_vector().iter().all(|x| x.is_finite()));
    for time in [simulation.step_start(), simulation.time()] {
        let mut frame = jointplay_physics::simulate::Frame::default();
        simulation.sample(time, &mut frame);
        let text = format!("{frame:?}");
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
    for _ in 0..3 {
        let repeated = simulation.step().unwrap_err();
        assert_eq!(repeated.time, stopped.time);
        assert_eq!(simulation.state_hash(), hash);
        // A step truncated by output fails as well and leaves the state unchanged.
        let end = simulation.time() + simulation.machine().solver.step.max(0.005);
        assert!(simulation.step_until(end).is_err());
        assert_eq!(simulation.state_hash(), hash);
    }
    assert_eq!(frame_now(simulation).time, stopped.time);
}

#[test]
fn a_step_far_too_long_for_the_contact_is_stopped_with_advice() {
    for name in ["spcmm", "pendulum", "chain"] {
        let mut simulation =
            live(name, &[("solver.method", "rk4"), ("solver.step", "10 ms"), ("contact.youngs_modulus", "1000 GPa")]);
        let stopped = run_to_stop(&mut simulation);
        println!("{name}: {stopped}");
        let text = stopped.to_string();
        let machine = simulation.machine();
        let joints = machine.loose_joints.iter().map(|j| format!("joint {}", j.name));
        let bodies = machine.bodies.iter().map(|b| format!("body {}", b.name));
        assert!(joints.chain(bodies).any(|named| text.contains(&named)), "{text}");
        assert!(
            text.starts_with(&format!("stopped at t = {}: ", format_quantity_digits(stopped.time, "s", 7))),
            "{text}"
        );
        assert!(stopped.advice.to_string().contains("solver.step"), "{text}");
        assert!(stopped.advice.to_string().contains("solver.method = automatic"), "{text}");
        check_last_good_state(&mut simulation, &stopped);
        // The advice helps from a reset.
        simulation.set("solver.method", "automatic").unwrap();
        simulation.reset().unwrap();
        simulation.advance_to(0.02).unwrap();
    }
}

#[test]
fn following_the_advice_in_mid_run_lets_the_run_continue() {
    let mut simulation = live("pendulum", &[("solver.method", "rk4"), ("solver.step", "10 ms")]);
    let stopped = run_to_stop(&mut simulation);
    simulation.set("solver.step", "1 us").unwrap();
    for _ in 0..100 {
        simulation.step().unwrap();
    }
    assert!(simulation.time() > stopped.time);
}

fn start_error(scene: &jointplay_scene::Scene) -> String {
    match LiveScene::new(scene) {
        Ok(_) => panic!("started"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn ideal_ball_joints_that_do_not_close_are_named() {
    let text = built_in_text("slider-crank").unwrap();
    let moved = text.replace("position = \"200 mm\"", "position = \"205 mm\"");
    assert_ne!(moved, text);
    let ideal = parse(&moved, &[("contact.clearance", "0")]);
    let error = start_error(&ideal);
    println!("{error}");
    assert!(error.contains("ball joint C") && error.contains("5 mm apart as given"), "{error}");
    // With clearance the ball is outside its socket, too.
    let error = start_error(&parse(&moved, &[]));
    println!("{error}");
    assert!(error.contains("joint C: as given it is") && error.contains("its play 0.3 mm"), "{error}");
}

#[test]
fn a_trajectory_that_the_rods_cannot_reach_names_slider_and_time() {
    for form in ["tree", "lagrange"] {
        let changes = [("spcmm.amplitude_x", "100 mm"), ("formulation", form)];
        let error = start_error(&scene("spcmm", &changes));
        println!("{error}");
        assert!(error.starts_with("slider "), "{error}");
        assert!(error.contains(": rod too short at t = "), "{error}");
        assert!(error.contains(" s: root") && error.contains(" = -") && error.contains("must be above 0"), "{error}");
    }
    // A live change waits for the reset; a reset that cannot start leaves the run unchanged.
    let mut simulation = live("spcmm", &[]);
    simulation.advance_to(0.01).unwrap();
    let hash = simulation.state_hash();
    simulation.set("spcmm.amplitude_x", "100 mm").unwrap();
    assert!(simulation.reset().is_err());
    assert_eq!(simulation.state_hash(), hash);
    simulation.step().unwrap();
}

#[test]
fn redundant_ideal_joints_share_the_load() {
    let text = built_in_text("pendulum").unwrap();
    // A second ball joint at the same point adds three redundant rows.
    let doubled = format!(
        "{text}\n[[ball_joint]]\nname = \"S2\"\nsocket = {{ body = \"world\", at = [0, 0, 0] }}\n\
         ball = {{ body = \"rod\", at = \"0 0 100 mm\" }}\nopening = [0, -1, 0]\n"
    );
    for form in ["tree", "lagrange"] {
        let changes = [("contact.clearance", "0"), ("formulation", form)];
        let mut double = Simulation::new(&parse(&doubled, &changes).machine).unwrap();
        let mut single = Simulation::new(&parse(text, &changes).machine).unwrap();
        run_until(&mut double, 0.1);
        run_until(&mut single, 0.1);
        let (two, one) = (frame_now(&mut double), frame_now(&mut single));
        assert!((two.bodies[0].position - one.bodies[0].position).norm() < 1e-7);
        for joint in &two.joints {
            let half = joint.normal_force - one.joints[0].normal_force * 0.5;
            assert!(half.norm() < 1e-5, "{form}: {half}");
        }
        let one = [changes[0], ("joint.S2.clearance", "0.3 mm"), changes[1]];
        LiveScene::new(&parse(&doubled, &one)).unwrap();
    }
}

#[test]
fn a_start_in_a_singular_pose_is_refused() {
    // With the slider plane level with the hinges the rods cannot support the platform.
    for plane in ["175 mm", "174.9999999 mm", "175.000000001 mm"] {
        for clearance in ["0", "0.3 mm"] {
            let changes = [("spcmm.slider_plane", plane), ("contact.clearance", clearance)];
            let error = start_error(&scene("spcmm", &changes));
            assert!(error.contains("singular pose"), "{error}");
        }
    }
    simulation("spcmm", &[("spcmm.slider_plane", "174.99 mm")]);
}

#[test]
fn an_excessive_drive_stops_the_adaptive_method_too() {
    let text = built_in_text("slider-crank-driven").unwrap();
    let too_fast = text.replace("velocity = \"6 rad/s\"", "velocity = \"300000 rad/s\"");
    assert_ne!(too_fast, text);
    let mut simulation = LiveScene::new(&parse(&too_fast, &[])).unwrap();
    let stopped = run_to_stop(&mut simulation);
    println!("{stopped}");
    let text = stopped.to_string();
    assert!(text.contains("body crank") || text.contains("joint C"), "{text}");
    assert!(stopped.advice.to_string().contains("slower drives"), "{text}");
    check_last_good_state(&mut simulation, &stopped);
}

#[test]
fn passing_a_singular_pose_of_the_loops_is_reported() {
    // Inside the range of slider planes in which the Jacobian changes its sign.
    let changes = [("contact.clearance", "0"), ("spcmm.slider_plane", "165 mm")];
    let mut simulation = simulation("spcmm", &changes);
    let stopped = run_to_stop(&mut simulation);
    println!("{stopped}");
    assert!(stopped.fault.to_string().contains("loops"), "{stopped}");
    assert!(stopped.advice.to_string().contains("clearance"), "{stopped}");
    assert!((stopped.time - 0.074).abs() < 2e-3);
    // Deeper in the range a step may jump across the pose to another branch, which the sign of the Jacobian reveals.
    let deeper = [("contact.clearance", "0"), ("spcmm.slider_plane", "170 mm")];
    let stopped = run_to_stop(&mut self::simulation("spcmm", &deeper));
    assert!(stopped.fault.to_string().contains("singular pose"), "{stopped}");
    let hash = simulation.state_hash();
    assert!(simulation.step().is_err());
    assert_eq!(simulation.state_hash(), hash);
}

#[test]
fn the_lagrange_formulation_stops_before_a_singular_pose_too() {
    let changes = [
        ("formulation", "lagrange"),
        ("contact.clearance", "0"),
        ("spcmm.slider_plane", "162 mm"),
        ("spcmm.frequency", "5 Hz"),
    ];
    let mut simulation = simulation("spcmm", &changes);
    let stopped = run_to_stop(&mut simulation);
    println!("{stopped}");
    assert!(stopped.fault.to_string().contains("singular pose"), "{stopped}");
    assert!(stopped.advice.to_string().contains("clearance"), "{stopped}");
    // It stops where `tree` does, rather than by ever smaller steps.
    assert!((stopped.time - 1.066e-3).abs() < 2e-6, "{stopped}");
    assert!(simulation.statistics().steps < 1000);
    assert!(simulation.ledger().unwrap().drive_work.is_finite());
    let text = format!("{:?}", frame_now(&mut simulation));
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
}

/// Two four-bars whose links are collinear ten times in ten seconds: neither formulation leaves its branch there, which would cost
/// up to half the energy.
#[test]
fn flat_poses_are_passed_on_the_same_branch_in_both_formulations() {
    for (formulation, tolerance) in [("tree", "1e-6"), ("lagrange", "1e-4"), ("lagrange", "1e-6")] {
        let changes = [("formulation", formulation), ("solver.tolerance", tolerance)];
        let mut simulation = simulation("n-four-bar", &changes);
        run_until(&mut simulation, 10.0);
        let ledger = simulation.ledger().unwrap();
        assert!(ledger.relative_residual().abs() < 1e-6, "{formulation} {tolerance}: {ledger:?}");
        let angle = frame_now(&mut simulation).coordinates[0][0];
        // `lagrange` measures the angle only modulo a turn.
        let angle_error = (angle - 31.750597187).rem_euclid(std::f64::consts::TAU);
        assert!(angle_error.min(std::f64::consts::TAU - angle_error) < 1e-3, "{formulation} {tolerance}: {angle}");
    }
}

/// A crank drives a four-bar towards a dead centre, which no step can pass at any tolerance.
#[test]
fn a_dead_centre_stops_the_run_and_is_reported() {
    let text = r#"
        start = "ideal"
        [[joint]]
        name = "crank"
        kind = "revolute"
        child = "crank"
        axis = [0, 0, 1]
        drive = { law = "constant", velocity = "1 rad/s" }
        [[joint]]
        name = "coupler"
        kind = "revolute"
        parent = "crank"
        child = "coupler"
        parent_point = "100 0 0 mm"
        axis = [0, 0, 1]
        start = { position = "60 deg" }
        [[joint]]
        name = "rocker"
        kind = "revolute"
        child = "rocker"
        parent_point = "200 0 0 mm"
        axis = [0, 0, 1]
        start = { position = "100 deg" }
        [[ball_joint]]
        name = "S"
        socket = { body = "coupler", at = "150 0 0 mm" }
        ball = { body = "rocker", at = "80 0 0 mm" }
        clearance = 0
    "#;
    let body = |name| format!("[[body]]\nname = \"{name}\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n");
    let bodies: String = ["crank", "coupler", "rocker"].map(body).concat();
    let text = text.to_owned() + &bodies;
    for formulation in ["tree", "lagrange"] {
        let mut simulation = LiveScene::new(&parse(&text, &[("formulation", formulation)])).unwrap();
        let stopped = simulation.advance_to(8.0).unwrap_err();
        assert_eq!((stopped.fault, stopped.advice), (StopFault::SingularLoops, StopAdvice::Dependent), "{formulation}");
        assert!((stopped.time - 1.64336).abs() < 1e-4, "{formulation}: {}", stopped.time);
    }
}
