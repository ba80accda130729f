//! The equations of a mechanism as its users call them: loads, gaps along a path, limits of cost.

use crate::common::{parse, scene};
use crate::large::scene_text;
use jointplay_physics::machine::Vec3;
use jointplay_physics::mechanism::{ActiveSet, Mechanism, MechanismError};
use jointplay_scene::BUILT_IN;

#[test]
fn computing_the_actuator_forces_again_changes_no_load() {
    let mut driven = 0;
    for (name, formulation) in BUILT_IN.iter().flat_map(|name| ["tree", "lagrange"].map(|form| (name, form))) {
        let mut mechanism = Mechanism::new(&scene(name, &[("formulation", formulation)]).machine).unwrap();
        let start = mechanism.start().unwrap();
        mechanism.evaluator(ActiveSet::Nothing).evaluate_fully(0.0, &start, &mut vec![0.0; start.len()]);
        let mut compute = || {
            let mut forces = vec![0.0; mechanism.drives()];
            mechanism.actuator_forces(&mut forces);
            let loads: Vec<[Vec3; 2]> = mechanism.joint_reactions().collect();
            (forces, loads)
        };
        let first = compute();
        assert!((0..3).all(|_| compute() == first), "{name} {formulation}");
        driven += usize::from(first.0.iter().any(|force| *force != 0.0));
    }
    assert!(driven > 5, "{driven}");
}

#[test]
fn a_gap_along_its_path_is_that_of_the_whole_mechanism() {
    let loose: &[(&str, &str)] = &[];
    let partly = &[("joint.S2.clearance", "0")][..];
    let scenes = [
        ("spcmm", loose),
        ("spcmm", partly),
        ("chain", loose),
        ("slider-crank", loose),
        ("slider-crank-driven", loose),
        ("pendulum", loose),
    ];
    for (name, changes) in scenes {
        for formulation in ["tree", "lagrange"] {
            let changes = [changes, &[("formulation", formulation)]].concat();
            let scene = scene(name, &changes);
            let mut whole = Mechanism::new(&scene.machine).unwrap();
            let mut along = Mechanism::new(&scene.machine).unwrap();
            let start = along.start().unwrap();
            let mut y = whole.start().unwrap();
            along.measure(0.0, &start);
            for (i, y) in y.iter_mut().enumerate() {
                *y += 1e-3 * libm::sin(i as f64);
            }
            for step in 1..4 {
                let t = 0.013 * f64::from(step);
                whole.measure(t, &y);
                for j in 0..whole.contacts.len() {
                    // Components off the path must not be read.
                    let mut known = vec![f64::NAN; y.len()];
                    for part in along.gap_components(j).unwrap() {
                        known[part.clone()].copy_from_slice(&y[part.clone()]);
                    }
                    along.measure_one(j, t, &known);
                    let (one, all) = (along.contacts.gap(j), whole.contacts.gap(j));
                    assert_eq!(format!("{one:?}"), format!("{all:?}"), "{name} {j}");
                    assert_eq!(along.slip_speed(j), whole.slip_speed(j), "{name} {j}");
                }
                // Then the whole mechanism at the same instant.
                along.measure(t, &y);
                for (one, all) in along.contacts.gaps().zip(whole.contacts.gaps()) {
                    assert_eq!(format!("{one:?}"), format!("{all:?}"), "{name}");
                }
            }
        }
    }
}

/// Whether `kind` with `n` parts is accepted, or the error message.
fn acceptance(kind: &str, n: usize, formulation: &str) -> Result<(), String> {
    let scene = parse(&scene_text(kind, n, "0 m"), &[("formulation", formulation)]);
    match Mechanism::new(&scene.machine) {
        Ok(_) => Ok(()),
        Err(error @ MechanismError::TooCostly { .. }) => Err(error.to_string()),
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn the_limits_are_those_of_the_documentation() {
    let page = include_str!("../../docs/scene-format.md");
    for (kind, formulation, row) in [
        ("hinges in a row", "tree", "hinges in a row"),
        ("hinges on one body", "tree", "hinges on one free body"),
        ("hinges on one body", "lagrange", "hinges on one free body"),
        ("balls of one body", "tree", "bodies on ideal ball joints"),
        ("balls of one body", "lagrange", "bodies on ideal ball joints"),
    ] {
        let line = page.lines().find(|line| line.starts_with(&format!("| {row}")));
        let column = 2 + usize::from(formulation == "lagrange");
        let stated = line.expect(row).split('|').nth(column).map(str::trim);
        let stated: usize = stated.and_then(|most| most.parse().ok()).expect("a number");
        // One more for the body that carries them.
        let most = stated + usize::from(kind.ends_with("one body"));
        assert_eq!(acceptance(kind, most, formulation), Ok(()), "{kind}");
        let message = acceptance(kind, most + 1, formulation).expect_err("beyond the limit");
        assert!(message.contains("allowed at most"), "{kind}: {message}");
    }
}

#[test]
fn the_other_formulation_is_advised_if_it_is_within_the_limits() {
    let message = acceptance("hinges in a row", 5000, "tree").expect_err("too deep");
    assert!(message.ends_with("choose formulation = lagrange"), "{message}");
    assert_eq!(acceptance("hinges in a row", 5000, "lagrange"), Ok(()));
    let message = acceptance("hinges on one body", 1000, "lagrange").expect_err("too wide");
    assert!(message.ends_with("choose formulation = tree"), "{message}");
    assert_eq!(acceptance("hinges on one body", 1000, "tree"), Ok(()));
}
