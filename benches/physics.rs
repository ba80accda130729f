//! Cost of the equations of motion: one evaluation, real time with Runge-Kutta 4, growth with the number of links, and
//! set-up of the largest scenes.
//!
//! `cargo bench --bench physics`; figures are only comparable within one run or on one machine, never absolute promises.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use jointplay::contact::Memory;
use jointplay::integrate::System;
use jointplay::mechanism::{Mechanism, Touching};
use jointplay::scene::Scene;
use jointplay::simulate::Simulation;
use large::scene_text;
use std::hint::black_box;

#[path = "../tests/common/large.rs"]
mod large;

/// Keys with their values.
type Changes = [(&'static str, &'static str)];

fn load(name: &str, changes: &[(&str, &str)]) -> Scene {
    let changes: Vec<_> = changes.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    Scene::load(name, &changes).expect("a built-in scene loads")
}

/// One derivative of `scene` at its state after `time`, contacts included, with the drive recomputed or not.
fn evaluation(c: &mut Criterion, label: &str, scene: &Scene, time: f64) {
    let mut simulation = Simulation::new(scene).expect("a built-in scene starts");
    simulation.advance_to(time).expect("a built-in scene runs");
    let t = simulation.time();
    let y = simulation.state().to_vec();
    let mut mechanism = Mechanism::new(scene).expect("a built-in scene starts");
    let joints = 0..mechanism.contacts.len();
    let memory: Vec<_> = joints.map(|j| simulation.contact_memory(j)).collect();
    let mut mechanism = mechanism.evaluator(Touching::Located(&memory));
    let mut dy = vec![0.0; y.len()];
    c.bench_function(&format!("{label}: new instant"), |b| {
        let mut n = 0.0;
        b.iter(|| {
            n += 1e-15;
            mechanism.derivative(black_box(t + n), black_box(&y), &mut dy);
        });
    });
    c.bench_function(&format!("{label}: same instant"), |b| {
        b.iter(|| mechanism.derivative(black_box(t), black_box(&y), &mut dy));
    });
}

fn evaluations(c: &mut Criterion) {
    // Settled: all three contacts carry load.
    evaluation(c, "spcmm, tree, three contacts", &load("spcmm", &[]), 0.4);
    evaluation(c, "spcmm, lagrange, three contacts", &load("spcmm", &[("formulation", "lagrange")]), 0.4);
    evaluation(c, "spcmm, tree, all ideal", &load("spcmm", &[("contact.clearance", "0")]), 0.4);
}

fn real_time(c: &mut Criterion) {
    let mut group = c.benchmark_group("10 ms simulated (spcmm, over the first impacts)");
    group.sample_size(20);
    for (label, changes) in [
        ("rk4 at 10 us", vec![("solver.method", "rk4"), ("solver.step", "10 us")]),
        ("dopri5 at 1e-6", vec![("solver.method", "dopri5"), ("solver.tolerance", "1e-6")]),
    ] {
        let scene = load("spcmm", &changes);
        let mut simulation = Simulation::new(&scene).expect("a built-in scene starts");
        simulation.advance_to(7e-3).expect("a built-in scene runs");
        let start = simulation.snapshot();
        group.bench_function(label, |b| {
            b.iter_batched(
                || start.clone(),
                |start| {
                    simulation.restore(&start);
                    simulation.advance_to(17e-3).expect("a built-in scene runs");
                },
                criterion::BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

/// Restoring a state: the target is 5 us in the default scene.
fn snapshots(c: &mut Criterion) {
    let mut group = c.benchmark_group("snapshot");
    for name in ["spcmm", "chain"] {
        let scene = load(name, &[]);
        let mut simulation = Simulation::new(&scene).expect("a built-in scene starts");
        simulation.advance_to(0.02).expect("a built-in scene runs");
        let snapshot = simulation.snapshot();
        group.bench_function(format!("{name}: take"), |b| {
            b.iter(|| black_box(simulation.snapshot()));
        });
        group.bench_function(format!("{name}: restore"), |b| {
            b.iter(|| simulation.restore(black_box(&snapshot)));
        });
    }
    group.finish();
}

/// Simulated spans with the methods that are meant for them, beside Runge-Kutta 4 at 10 us, which runs a tenth of each.
fn spans(c: &mut Criterion) {
    let span = |c: &mut Criterion, name: &str, changes: &Changes, from: f64, to: f64, rk4_to: f64| {
        let mut group = c.benchmark_group(name);
        group.sample_size(10);
        let methods: [(&str, &Changes, f64); 2] = [
            ("automatic at 1e-5", &[("solver.method", "automatic"), ("solver.tolerance", "1e-5")], to),
            ("rk4 at 10 us, a tenth of the span", &[("solver.method", "rk4"), ("solver.step", "10 us")], rk4_to),
        ];
        for (label, method, end) in methods {
            let all: Vec<(&str, &str)> = changes.iter().chain(method).copied().collect();
            let scene = load("spcmm", &all);
            let mut simulation = Simulation::new(&scene).expect("a built-in scene starts");
            simulation.advance_to(from).expect("a built-in scene runs");
            let start = simulation.snapshot();
            group.bench_function(label, |b| {
                b.iter_batched(
                    || {
                        let mut simulation = Simulation::new(&scene).expect("a built-in scene starts");
                        simulation.restore(&start);
                        simulation
                    },
                    |mut simulation| simulation.advance_to(end).expect("a built-in scene runs"),
                    criterion::BatchSize::LargeInput,
                );
            });
        }
        group.finish();
    };
    span(c, "first second, impacts included", &[], 0.0, 1.0, 0.1);
    span(c, "settled, 1 s to 4 s", &[], 1.0, 4.0, 1.3);
    span(c, "all joints ideal, 10 s", &[("contact.clearance", "0")], 0.0, 10.0, 1.0);
}

fn chain(c: &mut Criterion) {
    let mut group = c.benchmark_group("chain, one evaluation");
    for links in [4_u64, 16, 64, 256] {
        let scene = load("chain", &[("chain.links", &links.to_string())]);
        let mut simulation = Simulation::new(&scene).expect("a built-in scene starts");
        simulation.advance_to(2e-3).expect("a built-in scene runs");
        let y = simulation.state().to_vec();
        let t = simulation.time();
        let mut mechanism = Mechanism::new(&scene).expect("a built-in scene starts");
        let memory = vec![Memory::default(); mechanism.contacts.len()];
        let mut mechanism = mechanism.evaluator(Touching::Located(&memory));
        let mut dy = vec![0.0; y.len()];
        group.throughput(criterion::Throughput::Elements(links));
        group.bench_with_input(BenchmarkId::from_parameter(links), &links, |b, _| {
            b.iter(|| mechanism.derivative(black_box(t), black_box(&y), &mut dy));
        });
    }
    group.finish();
}

/// From scene text to a simulation at t = 0, for the largest scene of each kind: `docs/scene-format.md` gives the limits.
fn set_up(c: &mut Criterion) {
    let mut group = c.benchmark_group("set up");
    group.sample_size(10);
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
        group.bench_function(format!("{n} {kind}, {form}, clearance {clearance}"), |b| {
            b.iter(|| {
                let scene = Scene::parse(&text, None, &changes).expect("a scene");
                Simulation::new(&scene).expect("starts").time()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, evaluations, real_time, snapshots, spans, chain, set_up);
criterion_main!(benches);
