//! The restitution check: each impact says what was asked for, what its law gives, and what it really gave.

mod common;

use common::{Changes, METHODS, simulation};
use jointplay::simulate::{Impact, Simulation};

/// All impacts that finish before `end`, taken step by step.
fn impacts(simulation: &mut Simulation, end: f64) -> Vec<Impact> {
    let mut found = Vec::new();
    while simulation.time() < end {
        simulation.step().unwrap();
        simulation.take_impacts(&mut found);
    }
    found
}

fn of(name: &str, changes: &Changes, end: f64) -> Vec<Impact> {
    impacts(&mut simulation(name, changes), end)
}

#[test]
fn explore() {
    for (name, changes) in [
        (
            "pendulum",
            vec![
                ("contact.normal_law", "gonthier"),
                ("contact.restitution", "0.5"),
            ],
        ),
        (
            "pendulum",
            vec![("contact.restitution", "0"), ("contact.friction", "0")],
        ),
        ("spcmm", vec![]),
    ] {
        for method in METHODS {
            let mut changes = changes.clone();
            changes.push(("solver.method", method));
            println!("{name} {changes:?}");
            for i in of(name, &changes, 0.05).iter().take(8) {
                println!("   {:?} given {:.5}", i, i.given());
            }
        }
    }
}
