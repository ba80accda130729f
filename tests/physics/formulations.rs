//! `tree` and `lagrange` are two derivations of the same equations, with different unknowns: every kind of joint, element and drive must
//! move the same by both.

use std::path::Path;

use crate::common::{MACHINES, SCENES, parse};
use jointplay::scene::built_in_text;
use jointplay::simulate::{Frame, Simulation};

/// Position and turn of bodies, m and rad: errors of 1e-10 per step, which add up over some hundred steps and grow in impacts.
const TOLERANCE: f64 = 1e-7;
/// Length of a run, s.
const END: f64 = 10e-3;

fn end(name: &str, text: &str, formulation: &str) -> Frame {
    let changes = [("formulation", formulation), ("solver.method", "dopri5"), ("solver.tolerance", "1e-10")];
    let scene = parse(text, &changes);
    let mut simulation = Simulation::new(&scene.machine).unwrap_or_else(|error| panic!("{name}: {error}"));
    simulation.advance_to(END).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mut frame = Frame::default();
    simulation.sample(END, &mut frame);
    frame
}

fn check(name: &str, text: &str) {
    let [tree, lagrange] = ["tree", "lagrange"].map(|formulation| end(name, text, formulation));
    assert!(tree.bodies.len() == lagrange.bodies.len() && !tree.bodies.is_empty(), "{name}");
    for (a, b) in tree.bodies.iter().zip(&lagrange.bodies) {
        let (moved, turned) = ((a.position - b.position).norm(), (a.rotation - b.rotation).norm());
        println!("{name}: {moved:e} m, {turned:e} rad");
        assert!(moved < TOLERANCE && turned < TOLERANCE, "{name}: {moved:e} m, {turned:e} rad");
    }
}

/// The corpus covers every key of the format: each kind of joint, element and drive.
#[test]
fn both_formulations_move_every_scene_of_the_corpus_alike() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        // A rod of 1e-300 kg is beyond the range of the constraint equations.
        if name.starts_with("good-") && name != "good-tiny-and-huge.toml" {
            check(&name, &std::fs::read_to_string(path).unwrap());
        }
    }
}

#[test]
fn both_formulations_move_every_built_in_scene_alike() {
    for name in SCENES.into_iter().chain(MACHINES) {
        check(name, built_in_text(name).unwrap());
    }
}

#[test]
fn both_formulations_report_the_same_joint_coordinates() {
    for name in ["slider-crank", "slider-crank-driven"] {
        let at = |form: &str| {
            let scene = crate::common::scene(name, &[("formulation", form), ("solver.preset", "accurate")]);
            let mut simulation = Simulation::new(&scene.machine).expect("starts");
            // The driven crank turns more than once; the other stays within half a turn.
            let time = if name == "slider-crank" { 0.1 } else { 1.3 };
            simulation.advance_to(time).expect("runs");
            let mut frame = Frame::default();
            simulation.sample(time, &mut frame);
            let moving = scene.machine.joints.iter().flat_map(|joint| joint.kind.freedoms());
            assert_eq!(frame.coordinates.len(), moving.count());
            frame
        };
        let (tree, lagrange) = (at("tree"), at("lagrange"));
        assert_eq!(tree.coordinates.len(), 2);
        for (a, b) in tree.coordinates.iter().zip(&lagrange.coordinates) {
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() < 1e-3 * a.abs().max(1.0), "{name}: {a} {b}");
            }
        }
        let [crank, slider] = tree.coordinates[..] else {
            unreachable!();
        };
        let body = &tree.bodies[0];
        // The crank turns about the world's x axis, along which the slider moves.
        let angle = libm::atan2(body.rotation.m32, body.rotation.m22);
        assert!(libm::sin(0.5 * (crank[0] - angle)).abs() < 1e-12);
        assert!((crank[1] - body.angular_velocity.x).abs() < 1e-12);
        assert!((slider[0] - tree.pose.position.x).abs() < 1e-12);
        assert!((slider[1] - tree.pose.velocity.x).abs() < 1e-12);
    }
}
