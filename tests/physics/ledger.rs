//! The energy ledger: every joule is accounted for. `promises.rs` checks that keeping the ledger does not change a run.

use crate::common::{Changes, METHODS, SCENES, live, run_until, simulation};
use jointplay_physics::simulate::{Frame, Ledger, Simulation};

/// Bound on the residual with the preset `accurate`, relative to the energy exchanged.
const RESIDUAL_BOUND: f64 = 1e-4;

/// Advances by `time`, truncating the last step.
fn run_for(simulation: &mut Simulation, time: f64) {
    let end = simulation.time() + time;
    run_until(simulation, end);
}

fn ledger(simulation: &Simulation) -> Ledger {
    *simulation.ledger().unwrap()
}

/// The ledger of a built-in scene after `duration`.
fn ledger_after(name: &str, changes: &Changes, duration: f64) -> Ledger {
    let mut simulation = simulation(name, changes);
    run_until(&mut simulation, duration);
    let ledger = ledger(&simulation);
    let residual = ledger.relative_residual();
    println!("{name} {changes:?}: residual {residual:.1e} of {ledger:?}");
    ledger
}

/// Checks that the ledger balances to `bound`, and that it would not without any of the terms in `required`.
fn check_balance(case: &str, ledger: &Ledger, bound: f64, required: &[&str]) {
    let residual = ledger.relative_residual().abs();
    assert!(residual < bound, "{case}: {residual:e}, {ledger:?}");
    assert!(ledger.exchanged > 0.0, "{case}");
    let terms = [
        ("drive", ledger.drive_work),
        ("gravity", ledger.gravity_work),
        ("kinetic", ledger.kinetic_change),
        ("elastic", ledger.elastic_change),
        ("restitution", ledger.restitution_loss),
        ("friction", ledger.friction_loss),
        ("clearance", ledger.clearance_work),
        ("change", ledger.change_work),
    ];
    for (name, value) in terms {
        if required.contains(&name) {
            let without = (ledger.residual().abs() - value.abs()).abs() / ledger.exchanged;
            assert!(without > 2.0 * bound, "{case}: {name} is only {value:e} J");
        }
    }
}

#[test]
fn the_papers_scene_balances_over_a_second() {
    let accurate = ("solver.preset", "accurate");
    let ledger = ledger_after("spcmm", &[accurate], 1.0);
    let terms = ["drive", "gravity", "restitution", "friction"];
    check_balance("spcmm", &ledger, RESIDUAL_BOUND, &terms);
    // The contacts store energy under the weight they carry.
    assert!(ledger.elastic_change > 1e-7);
    // During impacts the stored energy is significant.
    let mut simulation = simulation("spcmm", &[accurate]);
    let mut largest: f64 = 0.0;
    while simulation.time() < 0.02 {
        simulation.step().unwrap();
        let ledger = *simulation.ledger().unwrap();
        largest = largest.max(ledger.elastic_change);
        assert!(ledger.relative_residual().abs() < RESIDUAL_BOUND);
    }
    assert!(largest > 1e-3 * simulation.ledger().unwrap().exchanged);
}

#[test]
fn every_built_in_scene_balances() {
    for name in SCENES {
        let terms: &[&str] = match name {
            "slider-crank-driven" => &["drive", "gravity", "kinetic", "friction"],
            "spcmm" => &["gravity", "friction"],
            _ => &["gravity", "kinetic", "friction"],
        };
        let ledger = ledger_after(name, &[], 0.3);
        check_balance(name, &ledger, RESIDUAL_BOUND, terms);
        assert!(ledger.restitution_loss > 0.0);
        assert_eq!((ledger.clearance_work, ledger.change_work), (0.0, 0.0));
        let driven = ["measuring-machine", "spcmm", "slider-crank-driven"].contains(&name);
        assert_eq!(ledger.drive_work == 0.0, !driven, "{name}");
    }
}

#[test]
fn every_law_friction_and_formulation_balances() {
    let surface = ("contact.friction_velocity", "surface");
    let centres = ("contact.friction_velocity", "centres");
    let weak = ("contact.restitution", "0.3");
    let dead = ("contact.restitution", "0");
    let law = |name| ("contact.normal_law", name);
    let lagrange = ("formulation", "lagrange");
    let strong = ("contact.friction", "1");
    let lossy: &[&str] = &["restitution", "friction"];
    let cases: [(&str, &Changes, &[&str]); 12] = [
        ("spcmm", &[surface], lossy),
        ("spcmm", &[centres, strong], lossy),
        ("spcmm", &[("contact.friction", "0")], &["restitution"]),
        ("spcmm", &[law("hertz")], &["friction"]),
        ("spcmm", &[law("gonthier"), weak], lossy),
        ("spcmm", &[law("flores"), weak], lossy),
        // Clamping the force at 0 contributes to its loss.
        ("spcmm", &[law("hunt-crossley"), dead], lossy),
        ("spcmm", &[lagrange], lossy),
        ("slider-crank-driven", &[lagrange], &["drive"]),
        ("slider-crank", &[centres, strong], &["friction"]),
        ("pendulum", &[centres, strong], &["friction"]),
        ("chain", &[law("gonthier"), weak], lossy),
    ];
    for (name, changes, terms) in cases {
        let duration = if changes.contains(&lagrange) { 0.05 } else { 0.2 };
        let ledger = ledger_after(name, changes, duration);
        check_balance(&format!("{name} {changes:?}"), &ledger, RESIDUAL_BOUND, terms);
        if changes.contains(&law("hertz")) {
            assert!(ledger.restitution_loss.abs() < 1e-12);
        }
        if changes.contains(&("contact.friction", "0")) {
            assert_eq!(ledger.friction_loss, 0.0);
        }
    }
}

#[test]
fn ideal_and_partly_ideal_mechanisms_balance() {
    let ideal = ("contact.clearance", "0");
    let fast = ("spcmm.frequency", "4 Hz");
    let lagrange = ("formulation", "lagrange");
    // Pure kinematics is integrated by a sixth-order quadrature over about fifty steps per period.
    let cases: [(&str, &Changes, f64); 9] = [
        ("spcmm", &[ideal], 1e-8),
        ("spcmm", &[ideal, fast], 1e-6),
        ("spcmm", &[ideal, lagrange], RESIDUAL_BOUND),
        ("spcmm", &[("joint.S2.clearance", "0")], RESIDUAL_BOUND),
        ("spcmm", &[("joint.S1.clearance", "0"), ("joint.S3.clearance", "0")], RESIDUAL_BOUND),
        ("slider-crank", &[ideal], RESIDUAL_BOUND),
        ("slider-crank", &[ideal, lagrange], RESIDUAL_BOUND),
        ("slider-crank-driven", &[("joint.C.clearance", "0")], RESIDUAL_BOUND),
        ("pendulum", &[ideal], RESIDUAL_BOUND),
    ];
    for (name, changes, bound) in cases {
        // A fraction of a drive's period, so that the works do not sum to zero.
        let ledger = ledger_after(name, changes, 0.31);
        let terms: &[&str] = if name == "spcmm" { &["drive", "gravity"] } else { &["gravity", "kinetic"] };
        check_balance(&format!("{name} {changes:?}"), &ledger, bound, terms);
    }
}

#[test]
fn every_method_keeps_a_ledger() {
    for name in ["spcmm", "pendulum"] {
        for method in METHODS {
            // A fixed step of 10 us resolves the force of an impact to a per cent, its energy to some parts in a thousand.
            let bound = match method {
                "rk4" => 5e-4,
                _ => RESIDUAL_BOUND,
            };
            let ledger = ledger_after(name, &[("solver.method", method)], 0.1);
            check_balance(&format!("{name}, {method}"), &ledger, bound, &["gravity"]);
        }
    }
}

#[test]
fn the_residual_is_the_error_of_the_integration() {
    let residual = |method: &str, step: &str| {
        let changes = [("solver.method", method), ("solver.step", step)];
        ledger_after("pendulum", &changes, 0.02).relative_residual().abs()
    };
    let (coarse, fine) = (residual("rk4", "8 us"), residual("rk4", "1 us"));
    assert!(fine < 0.1 * coarse, "{coarse:e} {fine:e}");
    let residual_at = |tolerance: &str| {
        let changes = [("solver.tolerance", tolerance), ("solver.method", "dopri5")];
        ledger_after("spcmm", &changes, 0.03).relative_residual().abs()
    };
    let (loose, tight) = (residual_at("1e-4"), residual_at("1e-9"));
    assert!(tight < 1e-2 * loose && tight < 1e-6, "{loose:e} {tight:e}");
}

#[test]
fn live_changes_are_entered_in_the_ledger() {
    for method in ["automatic", "rk4"] {
        // The fixed step resolves the hard impacts at the end.
        let changes = [("solver.method", method), ("solver.step", "2 us")];
        let mut simulation = live("spcmm", &changes);
        let bound = if method == "rk4" { 5e-4 } else { RESIDUAL_BOUND };
        simulation.advance_to(0.4).unwrap();
        // The balls have settled on their walls, which now move inwards.
        simulation.set("contact.clearance", "0.29 mm").unwrap();
        run_for(&mut simulation, 2e-3);
        let during_ramp = ledger(&simulation);
        assert!(during_ramp.clearance_work != 0.0);
        run_for(&mut simulation, 18e-3);
        let after_ramp = ledger(&simulation);
        let case = format!("{method}, after a ramp");
        check_balance(&case, &after_ramp, RESIDUAL_BOUND, &["clearance"]);
        // At the same penetration a softer contact stores less energy, a stiffer one more.
        simulation.set("contact.youngs_modulus", "50 GPa").unwrap();
        let softer = ledger(&simulation);
        assert!(softer.change_work < 0.0);
        assert!((softer.residual() - after_ramp.residual()).abs() < 1e-15);
        simulation.set("contact.youngs_modulus", "400 GPa").unwrap();
        simulation.set("gravity.x", "-9.81 m/s^2").unwrap();
        // Creep is too stiff for a fixed step in the hard impacts that follow and would unbalance the ledger.
        simulation.set("contact.friction", "0").unwrap();
        let stiffer = ledger(&simulation);
        let jump = stiffer.elastic_change - softer.elastic_change;
        assert!((stiffer.change_work - softer.change_work - jump).abs() < 1e-15);
        assert!((stiffer.residual() - after_ramp.residual()).abs() < 1e-15);
        run_for(&mut simulation, 30e-3);
        // A larger clearance releases the balls.
        simulation.set("contact.clearance", "0.6 mm").unwrap();
        run_for(&mut simulation, 30e-3);
        let case = format!("{method}, after all changes");
        check_balance(&case, &ledger(&simulation), bound, &["restitution"]);
    }
}

#[test]
fn softening_a_loaded_contact_is_entered_in_the_ledger() {
    // Soft enough that the stored energy is significant.
    let mut simulation = live("pendulum", &[("contact.youngs_modulus", "1 GPa")]);
    simulation.advance_to(0.3).unwrap();
    let before = ledger(&simulation);
    simulation.set("contact.youngs_modulus", "100 GPa").unwrap();
    simulation.advance_to(0.32).unwrap();
    let after = ledger(&simulation);
    println!("{before:?}\n{after:?}");
    check_balance("stiffened", &after, RESIDUAL_BOUND, &["change"]);
}

#[test]
fn the_ledger_restarts_at_a_reset_and_its_switch_waits_for_one() {
    let mut simulation = live("pendulum", &[]);
    simulation.advance_to(0.05).unwrap();
    let first_run = ledger(&simulation);
    simulation.reset().unwrap();
    assert_eq!(ledger(&simulation), Ledger::default());
    simulation.advance_to(0.05).unwrap();
    assert_eq!(ledger(&simulation), first_run);
    simulation.set("solver.energy_ledger", "off").unwrap();
    simulation.step().unwrap();
    assert!(simulation.ledger().is_some());
    simulation.reset().unwrap();
    assert!(simulation.ledger().is_none());
}

#[test]
fn frames_inside_a_step_balance_too() {
    for (name, changes, until) in [
        ("spcmm", vec![], 0.4),
        ("spcmm", vec![("contact.clearance", "0")], 0.4),
        ("spcmm", vec![("joint.S2.clearance", "0")], 0.05),
        ("spcmm", vec![("solver.method", "dopri5")], 0.02),
        ("pendulum", vec![("solver.method", "rk4")], 0.02),
    ] {
        let bound = if changes == [("solver.method", "rk4")] { 1e-3 } else { RESIDUAL_BOUND };
        let mut simulation = simulation(name, &changes);
        let mut frame = Frame::default();
        simulation.sample(0.0, &mut frame);
        let (kinetic, elastic) = (frame.kinetic, frame.elastic);
        let mut worst: f64 = 0.0;
        while simulation.time() < until {
            simulation.step().unwrap();
            let (from, to) = (simulation.step_start(), simulation.time());
            for part in [0.0, 0.1, 0.4, 0.8, 1.0] {
                simulation.sample(from + part * (to - from), &mut frame);
                let ledger = frame.ledger.unwrap();
                // The energies of the row agree with its ledger.
                let error =
                    ledger.kinetic_change + ledger.elastic_change - (frame.kinetic - kinetic + frame.elastic - elastic);
                assert!(error.abs() < 1e-12, "{name}: {error:e}");
                worst = worst.max(ledger.residual().abs());
            }
            assert_eq!(frame.ledger, simulation.ledger().copied());
        }
        let exchanged = ledger(&simulation).exchanged;
        println!("{name} {changes:?}: {:.1e}", worst / exchanged);
        assert!(worst < bound * exchanged, "{name} {changes:?}: {worst:e} of {exchanged:e}");
    }
}
