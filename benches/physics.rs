//! Cost of the equations of motion: one evaluation, real time with Runge-Kutta 4, growth with the number of links, and
//! set-up of the largest scenes.
//!
//! `cargo bench --bench physics`; figures are only comparable within one run or on one machine, never absolute promises.

use jointplay::contact::ContactState;
use jointplay::integrate::System;
use jointplay::mechanism::{ActiveSet, Mechanism};
use jointplay::scene::Scene;
use jointplay::simulate::Simulation;
use large::scene_text;
use std::hint::black_box;
use std::time::Instant;
use timing::{Stopwatch, in_words};

#[path = "../tests/common/large.rs"]
mod large;
mod timing;

/// Keys with their values.
type Changes = [(&'static str, &'static str)];

fn load(name: &str, changes: &[(&str, &str)]) -> Scene {
    let changes: Vec<_> = changes.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Scene::load(name, &changes).expect("a built-in scene loads")
}

/// One derivative of `scene` at its state after `time`, contacts included, with the drive recomputed or not.
fn evaluation(watch: &Stopwatch, label: &str, scene: &Scene, time: f64) {
    let mut simulation = Simulation::new(&scene.machine).expect("a built-in scene starts");
    simulation.advance_to(time).expect("a built-in scene runs");
    let t = simulation.time();
    let y = simulation.state_vector().to_vec();
    let mut mechanism = Mechanism::new(&scene.machine).expect("a built-in scene starts");
    let joints = 0..scene.machine.loose_joints.len();
    let states: Vec<_> = joints.flat_map(|j| simulation.contact_states(j)).copied().collect();
    let mut mechanism = mechanism.evaluator(ActiveSet::Located(&states));
    let mut dy = vec![0.0; y.len()];
    let mut n = 0.0;
    watch.time(&format!("{label}: new instant"), || {
        n += 1e-15;
        mechanism.derivative(black_box(t + n), black_box(&y), &mut dy);
    });
    watch.time(&format!("{label}: same instant"), || mechanism.derivative(black_box(t), black_box(&y), &mut dy));
}

fn evaluations(watch: &Stopwatch) {
    // Settled: all three contacts carry load.
    evaluation(watch, "spcmm, tree, three contacts", &load("spcmm", &[]), 0.4);
    evaluation(watch, "spcmm, lagrange, three contacts", &load("spcmm", &[("formulation", "lagrange")]), 0.4);
    evaluation(watch, "spcmm, tree, all ideal", &load("spcmm", &[("contact.clearance", "0")]), 0.4);
}

fn real_time(watch: &Stopwatch) {
    for (label, changes) in [
        ("rk4 at 10 us", vec![("solver.method", "rk4"), ("solver.step", "10 us")]),
        ("dopri5 at 1e-6", vec![("solver.method", "dopri5"), ("solver.tolerance", "1e-6")]),
    ] {
        let scene = load("spcmm", &changes);
        let mut simulation = Simulation::new(&scene.machine).expect("a built-in scene starts");
        simulation.advance_to(7e-3).expect("a built-in scene runs");
        let start = simulation.snapshot();
        watch.time(&format!("10 ms simulated (spcmm, over the first impacts)/{label}"), || {
            simulation.restore(&start);
            simulation.advance_to(17e-3).expect("a built-in scene runs");
        });
    }
}

/// Restoring a state: the target is 5 us in the default scene.
fn snapshots(watch: &Stopwatch) {
    for name in ["spcmm", "chain"] {
        let scene = load(name, &[]);
        let mut simulation = Simulation::new(&scene.machine).expect("a built-in scene starts");
        simulation.advance_to(0.02).expect("a built-in scene runs");
        let snapshot = simulation.snapshot();
        watch.time(&format!("snapshot/{name}: take"), || simulation.snapshot());
        watch.time(&format!("snapshot/{name}: restore"), || simulation.restore(black_box(&snapshot)));
    }
}

/// Time spans with the methods meant for them, compared with Runge-Kutta 4 at 10 us, which runs a tenth of each.
fn spans(watch: &Stopwatch) {
    let span = |name: &str, changes: &Changes, from: f64, to: f64, rk4_to: f64| {
        let methods: [(&str, &Changes, f64); 2] = [
            ("automatic at 1e-5", &[("solver.method", "automatic"), ("solver.tolerance", "1e-5")], to),
            ("rk4 at 10 us, a tenth of the span", &[("solver.method", "rk4"), ("solver.step", "10 us")], rk4_to),
        ];
        for (label, method, end) in methods {
            let all: Vec<(&str, &str)> = changes.iter().chain(method).copied().collect();
            let scene = load("spcmm", &all);
            let mut simulation = Simulation::new(&scene.machine).expect("a built-in scene starts");
            simulation.advance_to(from).expect("a built-in scene runs");
            let start = simulation.snapshot();
            watch.time_part(&format!("{name}/{label}"), || {
                let mut simulation = Simulation::new(&scene.machine).expect("a built-in scene starts");
                simulation.restore(&start);
                let clock = Instant::now();
                simulation.advance_to(end).expect("a built-in scene runs");
                clock.elapsed()
            });
        }
    };
    span("first second, impacts included", &[], 0.0, 1.0, 0.1);
    span("settled, 1 s to 4 s", &[], 1.0, 4.0, 1.3);
    span("all joints ideal, 10 s", &[("contact.clearance", "0")], 0.0, 10.0, 1.0);
}

fn chain(watch: &Stopwatch) {
    for links in [4, 16, 64, 256] {
        let scene = load("chain", &[("chain.links", &links.to_string())]);
        let mut simulation = Simulation::new(&scene.machine).expect("a built-in scene starts");
        simulation.advance_to(2e-3).expect("a built-in scene runs");
        let y = simulation.state_vector().to_vec();
        let t = simulation.time();
        let mut mechanism = Mechanism::new(&scene.machine).expect("a built-in scene starts");
        let states = vec![ContactState::default(); mechanism.contacts.len()];
        let mut mechanism = mechanism.evaluator(ActiveSet::Located(&states));
        let mut dy = vec![0.0; y.len()];
        let name = format!("chain, one evaluation/{links}");
        let median = watch.time(&name, || mechanism.derivative(black_box(t), black_box(&y), &mut dy));
        if let Some(median) = median {
            println!("    {} a link", in_words(median / f64::from(links)));
        }
    }
}

/// The slider-crank of Flores with its loose joint as a ball, as a pin that does not tilt, and as a pin with two ends: 30 ms, and how many
/// times a ball each costs.
fn pins(watch: &Stopwatch) {
    let text = jointplay::scene::built_in_text("flores").expect("a benchmark");
    let (machine, _) = text.split_once("[[ball_joint]]").expect("its loose joint is its last part");
    let pin = |play: &str| {
        format!(
            "{machine}[[joint]]\nname = \"S\"\nkind = \"revolute\"\nparent = \"slider\"\nchild = \"rod\"\naxis = [0, 1, 0]\n\
             child_point = \"120 0 0 mm\"\ncloses_loop = true\napproach_speed = \"start\"\nplay = {{ {play} }}\n"
        )
    };
    let kinds =
        [("ball", text.to_owned()), ("planar pin", pin("planar = true")), ("pin of 20 mm", pin("length = \"20 mm\""))];
    for method in ["dopri5", "radau5", "automatic", "discrete-gradient"] {
        let mut ball = None;
        for (kind, text) in &kinds {
            let accuracy = [("solver.method", method), ("solver.tolerance", "1e-6")];
            let changes: Vec<_> = accuracy.map(|(key, value)| (key.to_owned(), value.to_owned())).to_vec();
            let scene = Scene::parse(text, None, &changes).expect("a scene");
            let mut simulation = Simulation::new(&scene.machine).expect("starts");
            let start = simulation.snapshot();
            let median = watch.time(&format!("30 ms of a slider-crank, {method}/{kind}"), || {
                simulation.restore(&start);
                simulation.advance_to(0.03).expect("runs");
            });
            if let Some(median) = median {
                println!("    {:.2} times a ball", median / *ball.get_or_insert(median));
            }
        }
    }
}

/// From scene text to a simulation at t = 0, for the largest scene of each kind: `docs/scene-format.md` gives the limits.
fn set_up(watch: &Stopwatch) {
    for (kind, n, form, clearance) in [
        ("free bodies", 10_000, "tree", "0 m"),
        ("free bodies", 10_000, "lagrange", "0 m"),
        ("pendulums", 10_000, "tree", "0.1 mm"),
        ("pendulums", 10_000, "tree", "0 m"),
        ("pendulums", 10_000, "lagrange", "0 m"),
        ("sockets of one body", 10_000, "tree", "0.1 mm"),
        ("balls of one body", 10_000, "lagrange", "0.1 mm"),
        ("balls of one body", 194, "tree", "0 m"),
        ("balls of one body", 188, "lagrange", "0 m"),
        ("hinges in a row", 566, "tree", "0 m"),
        ("hinges in a row", 10_000, "lagrange", "0 m"),
        ("hinges on one body", 2043, "tree", "0 m"),
        ("hinges on one body", 113, "lagrange", "0 m"),
    ] {
        let text = scene_text(kind, n, clearance);
        let changes = [("formulation".to_owned(), form.to_owned())];
        watch.time(&format!("set up/{n} {kind}, {form}, clearance {clearance}"), || {
            let scene = Scene::parse(&text, None, &changes).expect("a scene");
            Simulation::new(&scene.machine).expect("starts").time()
        });
    }
}

fn main() {
    let watch = Stopwatch::new();
    for part in [evaluations, real_time, snapshots, spans, chain, pins, set_up] {
        part(&watch);
    }
}
