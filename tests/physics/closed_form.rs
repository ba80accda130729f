//! A scene whose drive follows functions of `[closed_form]`: the path must be that of the machine.

use crate::common::parse;
use jointplay_analysis::ideal_fault::{IdealFault, ideal_fault};
use jointplay_physics::machine::{Machine, StartRule};
use jointplay_physics::mechanism::{Mechanism, MechanismError, periods_of};
use jointplay_physics::simulate::{Frame, Simulation, StopFault};
use jointplay_scene::Scene;

/// A crank of 30 mm that turns at 2 Hz and pushes a block through a rod of `length`: x = r cos + sqrt(L^2 - r^2 sin^2).
fn slider_crank(length: &str) -> Scene {
    with_path_error("0 mm", length)
}

/// The same with an error `fault` in x of the closed-form path.
fn with_path_error(fault: &str, length: &str) -> Scene {
    let text = format!(
        r#"
        start = "ideal"
        parameter = [{{ name = "r", value = "30 mm" }}, {{ name = "l", value = "{length}" }}]
        contact = {{ clearance = 0 }}
        output = {{ body = "block", probe = "10 5 0 mm" }}
        body = [
            {{ name = "crank", mass = "1 kg", inertia = "1e-3 1e-3 1e-3 kg m^2" }},
            {{ name = "rod", mass = "1 kg", inertia = "1e-3 1e-3 1e-3 kg m^2" }},
            {{ name = "block", mass = "1 kg", inertia = "1e-3 1e-3 1e-3 kg m^2" }},
        ]
        joint = [
            {{ name = "A", kind = "revolute", child = "crank", axis = [0, 1, 0], drive = {{ law = "function", function = "turn" }} }},
            {{ name = "B", kind = "revolute", parent = "crank", parent_point = ["r", 0, 0], child = "rod", axis = [0, 1, 0] }},
            {{ name = "C", kind = "prismatic", child = "block", axis = [1, 0, 0], start = {{ position = "r + l" }} }},
        ]
        ball_joint = [{{ name = "S", socket = {{ body = "block" }}, ball = {{ body = "rod", at = ["l", 0, 0] }} }}]
        [closed_form]
        frequency = "2 Hz"
        x = "r*cos(turn) + sqrt(left) + ({fault})"
        y = "0 mm"
        z = "0 mm"
        functions = [
            {{ name = "turn", formula = "2*pi*2 Hz*t" }},
            {{ name = "left", formula = "l*l - (r*sin(turn))^2", positive = "the rod is too short" }},
        ]
        "#
    );
    parse(&text, &[])
}

#[test]
fn a_user_scene_follows_its_closed_form() {
    let mut simulation = Simulation::new(&slider_crank("100 mm").machine).expect("starts");
    let mut frame = Frame::default();
    let mut travel = (f64::INFINITY, 0.0_f64);
    for k in 1..=50 {
        let time = 0.01 * f64::from(k);
        simulation.advance_to(time).expect("runs");
        simulation.sample(time, &mut frame);
        let error = frame.probe_error.expect("is known").norm();
        assert!(error < 1e-12, "{error:e} at {time}");
        let x = frame.bodies[2].position.x;
        travel = (travel.0.min(x), travel.1.max(x));
    }
    assert!((travel.0 - 0.07).abs() < 1e-4 && (travel.1 - 0.13).abs() < 1e-4, "{travel:?}");
    let short = Simulation::new(&slider_crank("25 mm").machine).expect_err("cannot turn").to_string();
    assert!(short.starts_with("the rod is too short at t = 0.1250 s: left = -2.7500e-4"), "{short}");
}

#[test]
fn a_closed_form_that_contradicts_the_machine_is_reported() {
    let message =
        Simulation::new(&with_path_error("5 mm", "100 mm").machine).expect_err("the path is wrong by 5 mm").to_string();
    assert!(
        message.starts_with("where the loops close at t = 0, body block is 5 mm off its path in [closed_form]"),
        "{message}"
    );
    let mut settled = with_path_error("5 mm", "100 mm");
    settled.set("contact.clearance", "0.1 mm").expect("a clearance in range");
    settled.machine_mut().start = StartRule::Settled;
    assert_eq!(Simulation::new(&settled.machine).expect_err("the path is still wrong").to_string(), message);
    // Correct at the start, wrong later.
    for with_play in [false, true] {
        let mut scene = with_path_error("2 mm*sin(turn)", "100 mm");
        if with_play {
            scene.set("contact.clearance", "0.1 mm").expect("a clearance in range");
        }
        let Some(IdealFault::OffPath(time, distance)) = ideal_fault(&scene, || true) else {
            panic!("the path is wrong");
        };
        let expected = 2e-3 * (2.0 * std::f64::consts::TAU * time).sin();
        assert!(time < 0.05 && (distance - expected).abs() < 1e-9, "{distance} at {time}");
    }
    let scene = slider_crank("100 mm");
    assert!(ideal_fault(&scene, || true).is_none());
    // An examination that is cut short says so.
    let mut left = 3;
    let may_continue = || {
        left -= 1;
        left >= 0
    };
    assert!(matches!(ideal_fault(&scene, may_continue), Some(IdealFault::NotExamined(time)) if time > 0.0));
}

#[test]
fn a_run_without_play_stops_where_it_leaves_its_closed_form() {
    let right = "x = \"across + (slider_plane + driving_rod)\"";
    let text = include_str!("../../assets/scenes/spcmm.toml");
    assert!(text.contains(right));
    let text = text.replace(right, "x = \"across + 0.001*amplitude_x*phase + (slider_plane + driving_rod)\"");
    let scene = parse(&text, &[("contact.clearance", "0")]);
    let mut simulation = Simulation::new(&scene.machine).expect("starts where it should");
    let stopped = simulation.advance_to(0.5).expect_err("leaves the path");
    assert!(matches!(stopped.fault, StopFault::OffPath { distance } if distance < 2e-5), "{stopped}");
}

/// The default scene with these keys changed.
fn paper(changes: &[(&str, &str)]) -> Machine {
    Machine::clone(&crate::common::scene("spcmm", changes).machine)
}

/// Position, rate and acceleration of the three sliders, which follow functions of the closed form.
fn sliders(machine: &Machine, time: f64) -> [[f64; 3]; 3] {
    let mut simulation = Simulation::new(machine).expect("starts");
    let mut frame = Frame::default();
    simulation.advance_to(time).expect("runs");
    simulation.sample(time, &mut frame);
    [1, 2, 3].map(|n| {
        let at = machine.bodies.iter().position(|body| body.name == format!("slider{n}")).expect("a slider");
        let (body, axis) = (&frame.bodies[at], machine.joints[at].axis);
        [body.position.dot(&axis), body.velocity.dot(&axis), body.acceleration.dot(&axis)]
    })
}

#[test]
fn sliders_of_the_paper_have_the_reference_values() {
    let machine = paper(&[]);
    let expected = [
        [0.1364935480, -0.11575599, -0.13201567],
        [0.2409227735, -0.04964883, -0.0671871],
        [0.1864724056, -0.07282449, -0.08487076],
    ];
    for (slider, expected) in sliders(&machine, 0.0).iter().zip(expected) {
        for ((value, expected), limit) in slider.iter().zip(expected).zip([1e-10, 1e-8, 1e-8]) {
            assert!((value - expected).abs() < limit, "{slider:?} {expected}");
        }
    }
    for (slider, value) in sliders(&machine, 0.5).iter().zip([0.0902403840, 0.2210909323, 0.1575618239]) {
        assert!((slider[0] - value).abs() < 1e-10, "{slider:?}");
    }
}

#[test]
fn roots_are_real_in_the_stated_range_of_the_socket_plane() {
    for (socket_plane, reachable) in [(0.041518, true), (0.041516, false), (0.364482, true), (0.364484, false)] {
        let machine = paper(&[("spcmm.slider_plane", &format!("{} m", socket_plane - 0.028))]);
        assert_eq!(Mechanism::new(&machine).is_ok(), reachable, "x_s = {socket_plane}");
    }
}

#[test]
fn the_error_names_the_function_with_the_lowest_negative_value() {
    let mut machine = paper(&[("spcmm.slider_plane", "0 m")]);
    let fault = |machine: &Machine| match Mechanism::new(machine) {
        Err(MechanismError::Unreachable(error)) => error,
        _ => panic!("the rod is long enough"),
    };
    let error = fault(&machine);
    assert_eq!((error.function.as_str(), error.what.as_str()), ("root1", "slider 1: rod too short"));
    assert!(error.value.starts_with('-') && error.value.ends_with(" m^2"), "{error}");
    let functions = &mut machine.closed_form.as_mut().expect("has one").functions;
    functions.iter_mut().for_each(|function| function.positive = None);
    let error = fault(&machine);
    assert!(error.to_string().starts_with("a function has no value at t = 0."), "{error}");
    assert!(error.function == "f1" && error.value == "NaN m" && error.requirement == "finite", "{error}");
}

#[test]
fn a_motion_at_another_pace_is_the_same_motion() {
    let machine = paper(&[]);
    let mut slow = machine.clone();
    slow.closed_form.as_mut().expect("has one").pace = 0.25;
    assert!(periods_of(&machine).all(|period| period == 2.0) && periods_of(&slow).all(|period| period == 8.0));
    for (a, b) in sliders(&machine, 0.02).iter().zip(&sliders(&slow, 0.08)) {
        for ((a, b), [factor, limit]) in a.iter().zip(b).zip([[1.0, 1e-15], [4.0, 1e-14], [16.0, 1e-13]]) {
            assert!((a - factor * b).abs() < limit, "{a:?} {b:?}");
        }
    }
    let still = paper(&["spcmm.amplitude_x", "spcmm.amplitude_beta"].map(|key| (key, "0")));
    assert!(periods_of(&still).all(f64::is_infinite));
}
