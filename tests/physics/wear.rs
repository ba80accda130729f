//! Wear maps: the cells add up to the totals of the run, lie at the contact points, and do not affect the run.

use crate::common::{Changes, METHODS, SCENES, live, run_until, simulation};
use jointplay_physics::machine::Mat3;
use jointplay_physics::simulate::{Cell, Frame, Simulation, Wear};
use jointplay_scene::LiveScene;

/// A run over `duration` with its wear map; the last step is cut at its end.
fn run_with_map(name: &str, changes: &Changes, duration: f64) -> LiveScene {
    let mut simulation = live(name, changes);
    simulation.track_wear();
    run_until(&mut simulation, duration);
    simulation.commit_wear();
    simulation
}

fn wear(simulation: &Simulation) -> &Wear {
    simulation.wear().unwrap()
}

/// Sum over the cells of ball joint `j`.
fn sum(wear: &Wear, j: usize) -> Cell {
    let mut sum = Cell::default();
    for cell in wear.cells(j) {
        sum.contacts += cell.contacts;
        sum.impulse += cell.impulse;
        sum.friction_work += cell.friction_work;
    }
    sum
}

#[test]
fn friction_work_and_contacts_agree_with_ledger_and_counters() {
    let check = |case: &str, simulation: &Simulation| {
        let wear = wear(simulation);
        let joints = simulation.statistics().joints.len();
        let sums: Vec<Cell> = (0..joints).map(|j| sum(wear, j)).collect();
        let contacts: Vec<u64> = sums.iter().map(|sum| sum.contacts).collect();
        let begun = simulation.statistics().joints.iter().map(|joint| joint.impacts);
        assert!(begun.eq(contacts), "{case}");
        let loss = simulation.ledger().unwrap().friction_loss;
        let work: f64 = sums.iter().map(|sum| sum.friction_work).sum();
        let sizes = (0..joints).flat_map(|j| wear.cells(j));
        let size: f64 = sizes.map(|cell| cell.friction_work.abs()).sum();
        println!("{case}: {work:e} of {loss:e}, {:e}", work - loss);
        // The two sums differ only in their order.
        assert!(size > 1e-7, "{case}: {size:e}");
        assert!((work - loss).abs() < 1e-11 * size, "{case}: {work:e}, {loss:e}");
    };
    for name in SCENES {
        check(name, &run_with_map(name, &[], 0.1));
    }
    for method in METHODS {
        let changes = [("solver.method", method), ("contact.friction_velocity", "surface")];
        check(method, &run_with_map("spcmm", &changes, 0.03));
    }
    let lagrange = ("formulation", "lagrange");
    let ideal = ("joint.S2.clearance", "0");
    let run = run_with_map("spcmm", &[lagrange, ideal], 0.03);
    let cells = wear(&run).cells(1);
    assert!(cells.is_empty(), "an ideal joint has no wear cells");
    check("partly ideal", &run);
    // Parameters that change in contact.
    let mut run = run_with_map("spcmm", &[], 0.2);
    for (key, value) in
        [("contact.friction", "0.3"), ("contact.youngs_modulus", "150 GPa"), ("contact.clearance", "0.25 mm")]
    {
        run.set(key, value).unwrap();
        let end = run.time() + 0.05;
        run_until(&mut run, end);
    }
    run.commit_wear();
    check("live changes", &run);
}

#[test]
fn impulses_are_time_integrals_of_the_normal_force() {
    for method in ["automatic", "radau5"] {
        let mut simulation = simulation("spcmm", &[("solver.method", method)]);
        simulation.track_wear();
        let (mut frame, mut expected) = (Frame::default(), [0.0; 3]);
        while simulation.time() < 0.05 {
            simulation.step().unwrap();
            let (from, to) = (simulation.step_start(), simulation.time());
            // Gauss quadrature with five points.
            let root = (10.0_f64 / 7.0).sqrt();
            let (inner, outer) = ((5.0 - 2.0 * root).sqrt() / 3.0, (5.0 + 2.0 * root).sqrt() / 3.0);
            let (inner_weight, outer_weight) =
                ((322.0 + 13.0 * 70.0_f64.sqrt()) / 1800.0, (322.0 - 13.0 * 70.0_f64.sqrt()) / 1800.0);
            let middle = 64.0 / 225.0;
            for (at, weight) in [
                (-outer, outer_weight),
                (-inner, inner_weight),
                (0.0, middle),
                (inner, inner_weight),
                (outer, outer_weight),
            ] {
                simulation.sample(from + 0.5 * (1.0 + at) * (to - from), &mut frame);
                for (expected, joint) in expected.iter_mut().zip(&frame.joints) {
                    *expected += weight * (to - from) * joint.normal_force.norm();
                }
            }
        }
        simulation.commit_wear();
        for (j, expected) in expected.into_iter().enumerate() {
            let impulse = sum(wear(&simulation), j).impulse;
            println!("{method}, joint {j}: {impulse} N s, {:e}", impulse / expected - 1.0);
            // Simpson's rule, or Radau's, over steps that resolve an impact.
            assert!((impulse / expected - 1.0).abs() < 1e-4, "{method}: {impulse} {expected}");
        }
    }
}

#[test]
fn a_wear_map_needs_no_ledger_and_ends_at_a_reset() {
    let without_ledger = run_with_map("pendulum", &[("solver.energy_ledger", "off")], 0.05);
    let mut with_ledger = run_with_map("pendulum", &[], 0.05);
    assert!(wear(&without_ledger).cells(0) == wear(&with_ledger).cells(0));
    with_ledger.reset().unwrap();
    assert!(with_ledger.wear().is_none());
}

#[test]
fn a_cell_lies_where_the_ball_touches() {
    for name in ["spcmm", "pendulum", "slider-crank"] {
        let mut simulation = simulation(name, &[]);
        simulation.advance_to(0.5).unwrap();
        simulation.track_wear();
        let (empty, mut frame) = (wear(&simulation).clone(), Frame::default());
        let joints = simulation.machine().loose_joints.len();
        let mut expected = vec![vec![0.0; empty.grid().cells()]; joints];
        while simulation.time() < 0.6 {
            simulation.step().unwrap();
            simulation.sample(simulation.time(), &mut frame);
            let h = simulation.time() - simulation.step_start();
            let machine = simulation.machine().clone();
            for (j, joint) in machine.loose_joints.iter().enumerate() {
                let rotation = match joint.carrier().body {
                    Some(b) => frame.bodies[b].rotation,
                    None => Mat3::identity(),
                };
                let report = &frame.joints[j];
                let direction = rotation.transpose() * report.eccentricity.normalize();
                let cell = empty.grid().cell(&(empty.grid_from_body(j) * direction));
                expected[j][cell] += h * report.normal_force.norm();
            }
        }
        simulation.commit_wear();
        let wear = wear(&simulation);
        for (j, expected) in expected.iter().enumerate() {
            if wear.cells(j).is_empty() {
                continue;
            }
            let impulse = |cell: usize| wear.cells(j)[cell].impulse;
            let total: f64 = expected.iter().sum();
            let difference: f64 = (0..expected.len()).map(|i| (impulse(i) - expected[i]).abs()).sum();
            println!("{name}, joint {j}: {difference:e} of {total:e}");
            // The reference assigns a whole step at the edge of two cells to one of them.
            assert!(total > 0.0 && difference < 0.05 * total, "{name}, joint {j}: {difference} of {total}");
        }
    }
}
