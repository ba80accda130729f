//! `tree` and `lagrange` are two derivations of the same equations, with different unknowns: every kind of joint, element and drive must
//! move the same by both. Tests of such a part need only one of them where its scene is checked here or by [`check`].

use std::path::Path;

use crate::common::matrix::FORMULATIONS;
use crate::common::{MACHINES, SCENES, frame_now, parse, run_until, simulation};
use crate::stiff::{ELEMENT_CASES, serial_chain};
use crate::two_degrees::{G, train};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::built_in_text;

/// Position and turn of bodies and coordinates, m and rad: errors of 1e-10 per step, which add up over some hundred steps and grow in
/// impacts. Their rates are larger by the rate of an impact, 1e3 1/s; forces, relative to the largest of their kind, by its square.
const TOLERANCE: f64 = 1e-7;
/// Length of a run, s.
const END: f64 = 10e-3;

fn end(name: &str, text: &str, formulation: &str) -> Frame {
    let changes = [("formulation", formulation), ("solver.method", "dopri5"), ("solver.tolerance", "1e-10")];
    let scene = parse(text, &changes);
    let mut simulation = Simulation::new(&scene.machine).unwrap_or_else(|error| panic!("{name}: {error}"));
    simulation.advance_to(END).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mut frame = Frame { reactions: Some(Vec::new()), ..Frame::default() };
    simulation.sample(END, &mut frame);
    frame
}

/// Numbers of a frame by kind, each with its bound; relative to the largest of its kind if so marked.
fn numbers(frame: &Frame) -> [(&'static str, f64, bool, Vec<f64>); 6] {
    let bodies = || frame.bodies.iter();
    let poses = bodies().flat_map(|body| body.position.iter().chain(&body.rotation).copied().collect::<Vec<_>>());
    let rates =
        bodies().flat_map(|body| body.velocity.iter().chain(&body.angular_velocity).copied().collect::<Vec<_>>());
    let (coordinates, coordinate_rates): (Vec<_>, Vec<_>) = frame.coordinates.iter().map(|&[q, v]| (q, v)).unzip();
    let loads = frame.reactions.iter().flatten().chain(&frame.closing).flatten().flatten().copied();
    [
        ("pose", TOLERANCE, false, poses.collect()),
        ("velocity", 1e3 * TOLERANCE, false, rates.collect()),
        ("coordinate", TOLERANCE, false, coordinates),
        ("rate", 1e3 * TOLERANCE, false, coordinate_rates),
        ("actuator", 1e4 * TOLERANCE, true, frame.actuators.clone()),
        ("reaction", 1e4 * TOLERANCE, true, loads.collect()),
    ]
}

/// Checks that a scene moves alike by both formulations.
pub fn check(name: &str, text: &str) {
    let [tree, lagrange] = FORMULATIONS.map(|formulation| numbers(&end(name, text, formulation)));
    assert!(!tree[0].3.is_empty(), "{name}: no bodies");
    for ((kind, bound, relative, a), (.., b)) in tree.into_iter().zip(lagrange) {
        assert_eq!(a.len(), b.len(), "{name}: {kind}");
        let largest = a.iter().fold(0.0, |most: f64, a| most.max(a.abs()));
        let off = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let bound = if relative { bound * largest.max(1e-3) } else { bound };
        println!("{name}: {kind} {off:e} of {largest:e}");
        assert!(off < bound, "{name}: {kind} off by {off:e} of {largest:e}");
    }
}

/// The corpus covers every key of the format: each kind of joint, element and drive.
#[test]
fn both_formulations_move_every_scene_of_the_corpus_alike() {
    let folder = Path::new(crate::ROOT).join("tests/fuzz/corpus");
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
fn both_formulations_move_every_kind_of_joint_and_every_element_on_it_alike() {
    check("cylindrical and universal", &train(-G));
    check("hinges, slides and a driven one", &serial_chain(""));
    for (name, elements) in ELEMENT_CASES {
        check(name, &serial_chain(elements));
    }
}

/// The crank turns about the world's x axis, along which the slider moves.
#[test]
fn coordinates_are_the_angles_and_travels_of_the_joints() {
    for (name, time) in [("slider-crank", 0.1), ("slider-crank-driven", 1.3)] {
        let mut simulation = simulation(name, &[]);
        run_until(&mut simulation, time);
        let frame = frame_now(&mut simulation);
        let [crank, slider] = frame.coordinates[..] else { panic!("{:?}", frame.coordinates) };
        let body = &frame.bodies[0];
        let angle = libm::atan2(body.rotation.m32, body.rotation.m22);
        assert!(libm::sin(0.5 * (crank[0] - angle)).abs() < 1e-12);
        assert!((crank[1] - body.angular_velocity.x).abs() < 1e-12);
        assert!((slider[0] - frame.pose.position.x).abs() < 1e-12);
        assert!((slider[1] - frame.pose.velocity.x).abs() < 1e-12);
    }
}
