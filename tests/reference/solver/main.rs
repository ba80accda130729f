//! Writes tests/reference/solver.toml: runs of an independent solver crate, on the program's equations and on equations derived
//! independently here. Each run lists its changes, its contacts in the order of their start, and its final state.

mod borrowed;
mod integrate;
mod machine;
mod pendulum;

use std::fmt::Write;

use borrowed::ProgramEquations;
use integrate::{Equations, Solver, integrate};
use jointplay::scene::Scene;
use machine::Machine;
use pendulum::Pendulum;

/// Keys and values as a user writes them.
type Changes<'a> = [(&'a str, &'a str)];

fn scene(name: &str, changes: &Changes) -> Scene {
    let changes: Vec<_> = changes.iter().map(|&(key, value)| (key.to_owned(), value.to_owned())).collect();
    Scene::load(name, &changes).unwrap()
}

/// The part of the file written so far.
struct Rows(String);

impl Rows {
    /// Adds a run of the named `equations`.
    fn add(
        &mut self,
        (word, equations): (&str, &dyn Equations),
        (name, changes): (&str, &Changes),
        (solver, tolerance): (Solver, f64),
        end: f64,
    ) {
        let run = integrate(equations, solver, tolerance, end);
        println!("{name}, equations {word}, {solver:?}: {} contacts", run.contacts.len());
        let changes: Vec<_> = changes.iter().map(|(key, value)| [key, value]).collect();
        let rows = &mut self.0;
        write!(rows, "\n[[run]]\nscene = {name:?}\nchanges = {changes:?}\nequations = {word:?}\n").unwrap();
        write!(rows, "solver = \"{solver:?}\"\ntolerance = {tolerance:?}\nend = {end:?}\ncontacts = [\n").unwrap();
        for (joint, time, speed, peak) in run.contacts {
            writeln!(rows, "    [{joint}, {time:?}, {speed:?}, {peak:?}],").unwrap();
        }
        writeln!(rows, "]\nstate = {:?}", run.y).unwrap();
    }

    fn borrowed(&mut self, name: &str, changes: &Changes, with: (Solver, f64), end: f64) {
        self.add(("borrowed", &ProgramEquations::new(&scene(name, changes))), (name, changes), with, end);
    }
}

fn main() {
    let mut rows = Rows(String::from(
        "# Made by diffsol 0.18.0: cargo run --release --manifest-path tests/reference/solver/Cargo.toml\n\
         # Contacts: joint, time in s, approach speed in m/s, largest normal force in N; then the state at the end.\n\
         # Equations: borrowed from the program, or written down again in tests/reference/solver.\n",
    ));
    for with in [(Solver::Tsitouras, 1e-12), (Solver::Bdf, 1e-11)] {
        rows.add(("again", &Pendulum::default()), ("pendulum", &[]), with, 0.03);
    }
    let changes = [("contact.clearance", "0.5 mm"), ("contact.friction", "0.2")];
    let machine = Machine::new(0.5e-3, 0.2, &scene("spcmm", &changes));
    rows.add(("again", &machine), ("spcmm", &changes), (Solver::Tsitouras, 1e-12), 0.025);
    rows.borrowed("spcmm", &[], (Solver::Tsitouras, 1e-12), 0.013);
    // The first five impacts are over, the sixth has not begun.
    rows.borrowed("spcmm", &[], (Solver::Tsitouras, 1e-11), 0.0118);
    // These solvers do not project onto the constraints, so that the equations alone keep the loops closed.
    let implicit = (Solver::Bdf, 1e-10);
    rows.borrowed("spcmm", &[("joint.S1.clearance", "0")], implicit, 0.012);
    for (name, joint, end) in [
        ("hexapod", "A6", 0.010),
        ("delta", "B2", 0.003),
        ("four-bar", "A", 0.012),
        ("suspension", "lower", 0.004),
        ("press", "wrist", 0.030),
    ] {
        let key = format!("joint.{joint}.clearance");
        // The solver uses the approach speed at the start of a contact, not the largest since.
        let start = ("contact.approach_speed", "start");
        let changes = [("contact.clearance", "0"), (&*key, "0.1 mm"), start];
        rows.borrowed(name, &changes, implicit, end);
    }
    std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/../solver.toml"), rows.0).unwrap();
}
