//! The energy ledger: every joule is accounted for, and keeping it changes nothing.

mod common;

use common::{Changes, METHODS, SCENES, run_until, simulation};
use jointplay::simulate::{Frame, Ledger, Simulation};

fn ledger(simulation: &Simulation) -> Ledger {
    *simulation.ledger().unwrap()
}

/// The ledger of a built-in scene after `duration`.
fn after(name: &str, changes: &Changes, duration: f64) -> Ledger {
    let mut simulation = simulation(name, changes);
    run_until(&mut simulation, duration);
    let ledger = ledger(&simulation);
    println!(
        "{name} {changes:?}: residual {:.1e} of {ledger:?}",
        ledger.relative_residual()
    );
    ledger
}

#[test]
fn explore() {
    for name in SCENES {
        after(name, &[], 1.0);
    }
    for (name, changes) in [
        ("spcmm", vec![("contact.clearance", "0")]),
        (
            "spcmm",
            vec![("contact.clearance", "0"), ("spcmm.frequency", "4 Hz")],
        ),
        ("spcmm", vec![("joint.S2.clearance", "0")]),
        ("slider-crank", vec![("contact.clearance", "0")]),
        (
            "slider-crank-driven",
            vec![("contact.clearance", "0"), ("joint.C.clearance", "0")],
        ),
        ("spcmm", vec![("contact.friction_velocity", "surface")]),
        ("spcmm", vec![("contact.friction", "0")]),
        (
            "spcmm",
            vec![
                ("contact.normal_law", "gonthier"),
                ("contact.restitution", "0.3"),
            ],
        ),
        (
            "spcmm",
            vec![
                ("contact.normal_law", "flores"),
                ("contact.restitution", "0.3"),
            ],
        ),
    ] {
        after(name, &changes, 1.0);
    }
    for name in ["spcmm", "slider-crank-driven", "pendulum"] {
        for method in METHODS {
            after(name, &[("solver.method", method)], 0.1);
        }
        for form in ["lagrange"] {
            after(name, &[("formulation", form)], 0.1);
        }
    }
}
