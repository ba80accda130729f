//! The program's runs against another solver and independently derived equations, stored in `tests/reference/solver.toml` by
//! `tests/reference/solver`.

use crate::common::{Changes, frame_now, run_until, scene};
use jointplay_physics::mechanism::Mechanism;
use jointplay_physics::simulate::Simulation;
use nalgebra::{Quaternion, UnitQuaternion};
use serde::Deserialize;

#[derive(Deserialize)]
struct Rows {
    run: Vec<Run>,
}

/// A stored run of another solver.
#[derive(Deserialize)]
struct Run {
    scene: String,
    changes: Vec<(String, String)>,
    equations: String,
    solver: String,
    end: f64,
    contacts: Vec<Contact>,
    state: Vec<f64>,
}

/// Joint, time, approach speed and largest normal force, in order of the starts.
type Contact = (usize, f64, f64, f64);

/// The stored run of `solver` with `equations` that are the program's (`borrowed`) or independent (`again`).
fn stored_run(name: &str, changes: &Changes, equations: &str, solver: &str, end: f64) -> Run {
    let file = format!("{}/tests/reference/solver.toml", crate::ROOT);
    let rows: Rows = toml::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let mut runs = rows.run.into_iter();
    let run = runs.find(|run| {
        let same = run.changes.iter().map(|(key, value)| (&**key, &**value)).eq(changes.iter().copied());
        same && (&*run.scene, &*run.equations, &*run.solver, run.end) == (name, equations, solver, end)
    });
    run.unwrap_or_else(|| {
        panic!("no run of {name} with {changes:?} to {end}: add it to tests/reference/solver/main.rs")
    })
}

/// The program's run to `time`, and its contacts as in [`Run`].
fn own_run(name: &str, changes: &Changes, time: f64) -> (Simulation, Vec<Contact>) {
    let mut simulation = Simulation::new(&scene(name, changes).machine).unwrap();
    let mut contacts: Vec<Contact> = Vec::new();
    let mut peaks = Vec::new();
    while simulation.time() < time {
        simulation.step_until(time).unwrap();
        simulation.take_peaks(&mut peaks);
        for (j, peak) in peaks.iter().enumerate() {
            if peak.impacts > 0 {
                let speed = simulation.contact_states(j)[0].approach_speed;
                contacts.push((j, simulation.time(), speed, 0.0));
            } else if let Some(contact) = contacts.iter_mut().rev().find(|c| c.0 == j) {
                contact.3 = contact.3.max(peak.normal);
            }
        }
    }
    (simulation, contacts)
}

/// Checks that the contacts agree one by one.
fn assert_same_contacts(label: &str, ours: &[Contact], expected: &[Contact]) {
    assert_eq!(ours.len(), expected.len(), "{label}");
    // The last contact may be in progress.
    for (n, (a, b)) in ours.iter().zip(expected).enumerate().take(ours.len() - 1) {
        println!(
            "{label}: contact {n}: joint {}, {:.9} s, off by {:.1e} s, {:.1e} m/s; {:.3} N, off by {:.1e}",
            b.0,
            b.1,
            a.1 - b.1,
            a.2 - b.2,
            b.3,
            a.3 / b.3 - 1.0
        );
        assert_eq!(a.0, b.0, "{label}");
        assert!((a.1 - b.1).abs() < 1e-9, "{label}: time of contact {n}");
        assert!((a.2 / b.2 - 1.0).abs() < 1e-6, "{label}: approach speed of contact {n}");
        assert!((a.3 / b.3 - 1.0).abs() < 1e-5, "{label}: peak of contact {n}");
    }
}

const TIGHT: (&str, &str) = ("solver.tolerance", "1e-11");

#[test]
fn the_pendulum_agrees_with_other_equations_and_another_solver() {
    let end = 0.03;
    for solver in ["Tsitouras", "Bdf"] {
        let stored_run = stored_run("pendulum", &[], "again", solver, end);
        for method in ["dopri5", "automatic"] {
            let changes = [("solver.method", method), TIGHT];
            let (mut simulation, contacts) = own_run("pendulum", &changes, end);
            let label = format!("{solver} and {method}");
            assert_same_contacts(&label, &contacts, &stored_run.contacts);
            assert!(contacts.len() > 3, "only {} contacts", contacts.len());
            let body = frame_now(&mut simulation).bodies[0];
            let angle = body.rotation[(0, 2)].atan2(body.rotation[(2, 2)]);
            let [x, z, turned] = stored_run.state[..3] else { panic!() };
            let errors = [body.position.x - x, body.position.y, body.position.z - z, angle - turned];
            println!("{label}: off by {errors:?} m, m, m, rad");
            assert!(errors.iter().all(|error| error.abs() < 1e-9), "{label}: {errors:?}");
        }
    }
}

#[test]
fn the_measuring_mechanism_agrees_with_other_equations() {
    let end = 0.025;
    let changes = [("contact.clearance", "0.5 mm"), ("contact.friction", "0.2")];
    let stored_run = stored_run("spcmm", &changes, "again", "Tsitouras", end);
    let method = [("solver.method", "dopri5"), TIGHT];
    let (mut simulation, contacts) = own_run("spcmm", &[&changes[..], &method].concat(), end);
    assert_same_contacts("spcmm", &contacts, &stored_run.contacts);
    assert!(contacts.len() >= 6, "only {} contacts", contacts.len());
    // The quantities of a Poincaré section.
    let pose = frame_now(&mut simulation).pose;
    let [x, _, _, w, i, j, k] = stored_run.state[..7] else { panic!() };
    let axes = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)).to_rotation_matrix();
    let beta = -axes[(0, 1)].asin();
    let errors = [pose.position.x - x, pose.angles.y - beta];
    println!("x {x} m, beta {beta} rad, off by {errors:?}");
    assert!(errors.iter().all(|error| error.abs() < 1e-9), "{errors:?}");
}

#[test]
fn the_measuring_mechanism_moves_the_same_under_another_solver() {
    let end = 0.013;
    let stored_run = stored_run("spcmm", &[], "borrowed", "Tsitouras", end);
    let (simulation, contacts) = own_run("spcmm", &[("solver.method", "dopri5"), TIGHT], end);
    assert_same_contacts("spcmm", &contacts, &stored_run.contacts);
    assert!(contacts.len() >= 6, "only {} contacts", contacts.len());
    let position_error = position_error(&simulation, &stored_run);
    println!("off by {position_error:.1e} m or rad");
    assert!(position_error < 1e-9, "{position_error}");
}

/// Largest difference of positions from those of another solver, m or rad.
fn position_error(simulation: &Simulation, stored_run: &Run) -> f64 {
    let positions = Mechanism::new(simulation.machine()).unwrap().positions();
    assert_eq!(simulation.state_vector().len(), stored_run.state.len());
    let pairs = simulation.state_vector()[..positions].iter().zip(&stored_run.state);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Number of contacts until `end` of a scene with ideal joints under an implicit solver, and the largest difference of positions
/// then, m or rad.
pub fn compare_with_other_solver(name: &str, changes: &Changes, end: f64) -> (usize, f64) {
    let stored_run = stored_run(name, changes, "borrowed", "Bdf", end);
    let mut simulation = Simulation::new(&scene(name, &[changes, &[TIGHT]].concat()).machine).unwrap();
    run_until(&mut simulation, end);
    let position_error = position_error(&simulation, &stored_run);
    println!("{name}: off by {position_error:.1e} m or rad, {} contacts", stored_run.contacts.len());
    (stored_run.contacts.len(), position_error)
}

#[test]
fn a_mechanism_with_an_ideal_joint_moves_the_same_under_an_implicit_solver() {
    let (contacts, position_error) = compare_with_other_solver("spcmm", &[("joint.S1.clearance", "0")], 0.012);
    assert!(contacts >= 2);
    assert!(position_error < 1e-9, "{position_error}");
}

#[test]
fn peaks_with_the_presets_agree_with_another_solver() {
    // The first five impacts are over, the sixth has not begun.
    let end = 0.0118;
    let stored_run = stored_run("spcmm", &[], "borrowed", "Tsitouras", end);
    assert_eq!(stored_run.contacts.len(), 5);
    for preset in ["real-time", "accurate", "reference"] {
        let (_, contacts) = own_run("spcmm", &[("solver.preset", preset)], end);
        assert_eq!(contacts.len(), 5, "{preset}");
        for (a, b) in contacts.iter().zip(&stored_run.contacts) {
            let force_error = a.3 / b.3 - 1.0;
            println!("{preset}: joint {}: {:.2} N, off by {force_error:.1e}", a.0, b.3);
            assert!(a.0 == b.0 && force_error.abs() < 0.01, "{preset}: {force_error}");
        }
    }
}
