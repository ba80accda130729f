//! A scene whose drive follows functions of `[closed_form]`: the path must be that of the machine.

use crate::common::parse;
use jointplay::analysis::ideal_fault::{IdealFault, ideal_fault};
use jointplay::machine::StartRule;
use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Simulation, StopFault};

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
    settled.machine.start = StartRule::Settled;
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
