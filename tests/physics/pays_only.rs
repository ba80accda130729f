//! The cost of a scene depends only on the features that it uses, and its summary lists them.

use crate::common::{frame_now, scene, simulation};
use jointplay_physics::mechanism::{Mechanism, Summary};
use jointplay_physics::simulate::ContactMode;

fn summary(name: &str, changes: &[(&str, &str)]) -> Summary {
    Mechanism::new(&scene(name, changes).machine).unwrap().summary()
}

const IDEAL: (&str, &str) = ("contact.clearance", "0");

#[test]
fn rigid_scenes_evaluate_no_contact() {
    for name in jointplay_scene::BUILT_IN {
        for form in ["tree", "lagrange"] {
            let changes = [IDEAL, ("formulation", form)];
            let mut simulation = simulation(name, &changes);
            for _ in 0..50 {
                simulation.step().unwrap();
            }
            let frame = frame_now(&mut simulation);
            let evaluations = simulation.statistics().contact_evaluations;
            assert_eq!(evaluations, 0, "{name}, {form}");
            assert!(frame.joints.iter().all(|j| j.state == ContactMode::Ideal));
            let summary = simulation.mechanism().summary();
            assert_eq!((summary.contacts, summary.frictional_contacts), (0, 0));
            assert_eq!(summary.ideal_joints, simulation.machine().loose_joints.len());
        }
        // With play the counter is not zero.
        let mut simulation = simulation(name, &[]);
        simulation.step().unwrap();
        assert!(simulation.statistics().contact_evaluations > 0, "{name}");
    }
}

#[test]
fn fully_driven_ideal_scenes_solve_no_differential_equation() {
    let mut driven = simulation("spcmm", &[IDEAL]);
    let summary = driven.mechanism().summary();
    assert!(!summary.solves_differential_equation);
    assert_eq!(summary.degrees_of_freedom, 0);
    driven.advance_to(0.5).unwrap();
    let statistics = driven.statistics().clone();
    // One evaluation per step, for the reactions; no step is rejected at any tolerance.
    assert_eq!(statistics.evaluations, statistics.steps);
    assert_eq!(statistics.rejected, 0);
    // The result does not depend on the stepper: any method and step reach the same state.
    let mut other = simulation("spcmm", &[IDEAL, ("solver.method", "rk4"), ("solver.step", "10 ms")]);
    other.advance_to(0.5).unwrap();
    assert_eq!(driven.state_hash(), other.state_hash());
    for (name, changes) in [
        ("spcmm", vec![]),
        ("spcmm", vec![IDEAL, ("joint.S1.clearance", "0.1 mm")]),
        ("spcmm", vec![IDEAL, ("formulation", "lagrange")]),
        ("slider-crank", vec![IDEAL]),
        // Its rod is still free to spin about its axis.
        ("slider-crank-driven", vec![IDEAL]),
        ("pendulum", vec![IDEAL]),
    ] {
        assert!(self::summary(name, &changes).solves_differential_equation, "{name} {changes:?}");
    }
}

#[test]
fn frictionless_scenes_evaluate_no_friction() {
    let run = |changes: &[(&str, &str)]| {
        let mut simulation = simulation("spcmm", changes);
        while simulation.time() < 0.011 {
            simulation.step().unwrap();
        }
        let statistics = simulation.statistics();
        assert!(statistics.contact_evaluations > 0, "{changes:?}");
        statistics.friction_evaluations
    };
    for change in [("contact.friction_law", "none"), ("contact.friction", "0")] {
        let summary = summary("spcmm", &[change]);
        assert_eq!((summary.contacts, summary.frictional_contacts), (3, 0));
        for method in crate::common::METHODS {
            let method = ("solver.method", method);
            assert_eq!(run(&[change, method]), 0, "{change:?}, {method:?}");
            // With friction the counter is not zero.
            assert!(run(&[method]) > 0, "{method:?}");
        }
        let mut simulation = simulation("spcmm", &[change]);
        while simulation.time() < 0.011 {
            simulation.step().unwrap();
            for joint in frame_now(&mut simulation).joints {
                assert_eq!(joint.friction_force.norm(), 0.0);
                assert_eq!(joint.slip_speed, 0.0);
            }
        }
    }
    let one = summary("spcmm", &[("joint.S2.friction", "0")]);
    assert_eq!((one.contacts, one.frictional_contacts), (3, 2));
}

#[test]
fn links_of_a_chain_are_separate_blocks() {
    for links in ["1", "8", "64"] {
        let count: usize = links.parse().unwrap();
        let chain = summary("chain", &[("chain.links", links)]);
        assert_eq!(chain.single_body_blocks, count);
        assert_eq!(chain.velocity_coordinates, 6 * count);
    }
    assert_eq!(summary("pendulum", &[]).single_body_blocks, 1);
    // The platform and its rods form one block.
    assert_eq!(summary("spcmm", &[]).single_body_blocks, 0);
}

#[test]
fn counts_of_the_built_in_scenes() {
    // (scene, changes, bodies, driven bodies, drives, contacts, ideal joints, degrees of freedom,
    //  tree: velocities, positions, rows; lagrange: rows)
    type Row = (&'static str, Vec<(&'static str, &'static str)>, [usize; 6], [usize; 3], usize);
    let play = |joint| (joint, "0.3 mm");
    let rows: [Row; 10] = [
        // The platform's quaternion has one position more than velocities.
        ("spcmm", vec![], [7, 3, 3, 3, 0, 9], [9, 10, 0], 33),
        (
            "spcmm",
            vec![IDEAL, play("joint.S1.clearance"), play("joint.S2.clearance")],
            [7, 3, 3, 2, 1, 6],
            [9, 10, 3],
            36,
        ),
        ("spcmm", vec![IDEAL, play("joint.S3.clearance")], [7, 3, 3, 1, 2, 3], [9, 10, 6], 39),
        ("spcmm", vec![IDEAL], [7, 3, 3, 0, 3, 0], [9, 10, 9], 42),
        ("pendulum", vec![], [1, 0, 0, 1, 0, 6], [6, 7, 0], 0),
        ("pendulum", vec![IDEAL], [1, 0, 0, 0, 1, 3], [6, 7, 3], 3),
        ("slider-crank", vec![], [3, 0, 0, 1, 1, 5], [8, 9, 3], 13),
        ("slider-crank", vec![IDEAL], [3, 0, 0, 0, 2, 2], [8, 9, 6], 16),
        ("slider-crank-driven", vec![], [3, 1, 1, 1, 1, 4], [7, 8, 3], 14),
        ("chain", vec![], [8, 0, 0, 8, 0, 48], [48, 56, 0], 0),
    ];
    for (name, changes, [bodies, driven, drives, contacts, ideal, free], tree, rows) in rows {
        for form in ["tree", "lagrange"] {
            let changes = [&changes[..], &[("formulation", form)]].concat();
            let summary = summary(name, &changes);
            let case = format!("{name} {changes:?}: {summary:?}");
            assert_eq!((summary.bodies, summary.driven_bodies, summary.drives), (bodies, driven, drives), "{case}");
            assert_eq!((summary.contacts, summary.ideal_joints), (contacts, ideal), "{case}");
            assert_eq!(summary.frictional_contacts, contacts, "{case}");
            assert_eq!(summary.degrees_of_freedom, free, "{case}");
            let expected = if form == "tree" { tree } else { [6 * bodies, 7 * bodies, rows] };
            let counts = [summary.velocity_coordinates, summary.position_coordinates, summary.constraint_rows];
            assert_eq!(counts, expected, "{case}");
        }
    }
}
