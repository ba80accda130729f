//! Nothing is allocated in the stepping loop, and little for a change of a parameter.
#![allow(unsafe_code, reason = "a global allocator that counts can only be written with it")]

mod common;
#[path = "common/large.rs"]
mod large;

use common::{MACHINES, METHODS, SCENES, simulation};
use jointplay::scene::Scene;
use jointplay::session::player::Player;
use jointplay::simulate::{Frame, Simulation};
use large::scene_text;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::thread::LocalKey;

thread_local! {
    /// Allocations of this thread and their bytes; other tests run in parallel.
    static COUNT: Cell<u64> = const { Cell::new(0) };
    static BYTES: Cell<u64> = const { Cell::new(0) };
}

struct CountingAllocator;

fn count(bytes: usize) {
    // A thread that is ending has no counter anymore, and its allocations do not matter.
    let _ = COUNT.try_with(|count| count.set(count.get() + 1));
    let _ = BYTES.try_with(|count| count.set(count.get() + bytes as u64));
}

// SAFETY: every call is passed unchanged to the system's allocator.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        unsafe { System.realloc(pointer, layout, size) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Number of allocations made by `work`.
fn allocations(work: impl FnOnce()) -> u64 {
    counted(&COUNT, work)
}

/// Bytes allocated by `work`.
fn bytes(work: impl FnOnce()) -> u64 {
    counted(&BYTES, work)
}

fn counted(counter: &'static LocalKey<Cell<u64>>, work: impl FnOnce()) -> u64 {
    let before = counter.get();
    work();
    counter.get() - before
}

#[test]
fn the_counter_counts_allocations() {
    assert_eq!(allocations(|| drop(std::hint::black_box(vec![1.0; 8]))), 1);
    let mut grown = vec![1.0];
    assert!(allocations(|| grown.extend(std::hint::black_box([2.0; 9]))) > 0);
}

#[test]
fn laws_of_drives_allocate_nothing() {
    let text = include_str!("fuzz/corpus/good-laws.toml");
    for form in ["tree", "lagrange"] {
        let changes = [("formulation".to_owned(), form.to_owned())];
        let scene = Scene::parse(text, None, &changes).unwrap();
        let mut simulation = Simulation::new(&scene.machine).unwrap();
        simulation.step().unwrap();
        let count = allocations(|| simulation.advance_to(0.05).unwrap());
        assert_eq!(count, 0, "{form}");
    }
}

#[test]
fn curves_tyres_and_samples_of_reactions_allocate_nothing() {
    for text in [include_str!("fuzz/corpus/good-spring-curves.toml"), include_str!("fuzz/corpus/good-tyre.toml")] {
        for form in ["tree", "lagrange"] {
            let changes = [("formulation".to_owned(), form.to_owned())];
            let scene = Scene::parse(text, None, &changes).unwrap();
            let mut simulation = Simulation::new(&scene.machine).unwrap();
            let mut frame = Frame { reactions: Some(Vec::new()), ..Frame::default() };
            simulation.step().unwrap();
            simulation.sample(simulation.time(), &mut frame);
            let count = allocations(|| {
                while simulation.time() < 0.05 {
                    simulation.step().unwrap();
                    simulation.sample(simulation.time(), &mut frame);
                }
            });
            assert_eq!(count, 0, "{form}");
            assert_eq!(frame.reactions.map(|all| all.len()), Some(1));
        }
    }
}

#[test]
fn joints_with_two_degrees_of_freedom_closing_joints_and_every_kind_of_play_allocate_nothing() {
    let corpus = [
        include_str!("fuzz/corpus/good-universal.toml"),
        include_str!("fuzz/corpus/good-loop-joints.toml"),
        include_str!("fuzz/corpus/good-pins.toml"),
        include_str!("fuzz/corpus/good-block.toml"),
        include_str!("fuzz/corpus/good-planar-play.toml"),
        include_str!("fuzz/corpus/good-wear.toml"),
        include_str!("fuzz/corpus/good-lubricants.toml"),
    ];
    for text in corpus {
        for method in METHODS {
            for form in ["tree", "lagrange"] {
                let changes = [("formulation", form), ("solver.method", method)];
                let mut simulation = Simulation::new(&common::parse(text, &changes).machine).unwrap();
                let mut frame = Frame::default();
                simulation.track_wear();
                simulation.step().unwrap();
                simulation.sample(simulation.time(), &mut frame);
                let count = allocations(|| {
                    while simulation.time() < 4e-3 {
                        simulation.step().unwrap();
                        simulation.sample(simulation.time(), &mut frame);
                    }
                });
                assert_eq!(count, 0, "{method} {form}");
                assert!(!frame.coordinates.is_empty() || simulation.statistics().impacts() > 0);
            }
        }
    }
}

#[test]
fn steps_samples_and_peaks_allocate_nothing() {
    for name in SCENES {
        for method in METHODS {
            for form in ["tree", "lagrange"] {
                for clearance in ["as given", "0"] {
                    let mut changes =
                        vec![("solver.method", method), ("solver.tolerance", "1e-5"), ("formulation", form)];
                    if clearance == "0" {
                        changes.push(("contact.clearance", "0"));
                    }
                    let mut simulation = simulation(name, &changes);
                    let (mut frame, mut peaks) = (Frame::default(), Vec::new());
                    simulation.sample(0.0, &mut frame);
                    simulation.take_peaks(&mut peaks);
                    simulation.track_wear();
                    let end = if form == "tree" { 0.02 } else { 0.0125 };
                    let count = allocations(|| {
                        while simulation.time() < end {
                            simulation.step().unwrap();
                            let (from, to) = (simulation.step_start(), simulation.time());
                            simulation.sample(0.5 * (from + to), &mut frame);
                            simulation.sample(to, &mut frame);
                            simulation.take_peaks(&mut peaks);
                            std::hint::black_box(simulation.state_hash());
                        }
                        simulation.step_until(end + 1e-6).unwrap();
                    });
                    let case = format!("{name}, {method}, {form}, clearance {clearance}");
                    assert_eq!(count, 0, "{case}");
                    let impacts: u64 = simulation.statistics().impacts();
                    assert_eq!(impacts == 0, clearance == "0", "{case}: {impacts}");
                }
            }
        }
    }
}

#[test]
fn steps_of_the_machines_allocate_nothing() {
    for name in MACHINES {
        let mut simulation = simulation(name, &[]);
        simulation.step().unwrap();
        let count = allocations(|| simulation.advance_to(9e-3).unwrap());
        assert_eq!(count, 0, "{name}");
        assert!(simulation.statistics().impacts() > 0);
    }
}

#[test]
fn a_moving_clearance_allocates_nothing() {
    for method in METHODS {
        let mut simulation = common::live("pendulum", &[("solver.method", method)]);
        simulation.advance_to(0.03).unwrap();
        simulation.set("contact.clearance", "0.25 mm").unwrap();
        simulation.set("contact.friction", "0.2").unwrap();
        let count = allocations(|| simulation.advance_to(0.06).unwrap());
        assert_eq!(count, 0, "{method}");
    }
}

#[test]
fn setup_allocations_grow_linearly_with_the_scene() {
    for (kind, form, clearance) in [
        ("free bodies", "tree", "0 m"),
        ("free bodies", "lagrange", "0 m"),
        ("pendulums", "tree", "0 m"),
        ("pendulums", "lagrange", "0 m"),
        ("balls of one body", "tree", "0.1 mm"),
        ("balls of one body", "lagrange", "0.1 mm"),
        ("sockets of one body", "tree", "0.1 mm"),
        ("a chain", "tree", "0 m"),
        ("a chain", "lagrange", "0 m"),
        ("hinges in a row", "lagrange", "0 m"),
    ] {
        let needed = |n: usize| {
            let text = scene_text(kind, n, clearance);
            bytes(|| {
                let changes = [("formulation".to_owned(), form.to_owned())];
                let scene = Scene::parse(&text, Some("big.toml"), &changes).unwrap();
                std::hint::black_box(scene.machine.warnings());
                std::hint::black_box(Simulation::new(&scene.machine).unwrap().time());
            })
        };
        let (single, double) = (needed(400), needed(800));
        // Vectors double their capacity as they grow, so that the waste varies between sizes.
        let growth = double as f64 / single as f64;
        assert!(growth < 2.6, "{kind}, {form}: {single}, then {double} bytes");
    }
}

#[test]
fn a_change_copies_neither_text_nor_record_and_reads_the_text_only_for_its_numbers() {
    let load = || Scene::load("spcmm", &[]).unwrap();
    let reading = bytes(|| drop(load()));
    let mut player = Player::new(&load()).unwrap();
    player.run_to(0.1);
    player.set("contact.friction", "0.2").unwrap();
    let moved = bytes(|| drop(player.set("contact.friction", "0.21")));
    assert!(moved < 32 << 10, "{moved}");
    let solver = bytes(|| {
        player.set("solver.preset", "preview").unwrap();
        player.set("solver.method", "radau5").unwrap();
        player.set_original("solver.method").unwrap();
    });
    assert!(solver < reading / 4, "{solver} of {reading}");
    let number = bytes(|| drop(player.set("spcmm.frequency", "0.3 Hz")));
    assert!(number < reading + reading / 4, "{number} of {reading}");
    let copied = bytes(|| drop(player.clone()));
    assert!(copied < 1 << 20, "{copied}");
}
