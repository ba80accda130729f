//! Promises of every run, for any scene, method and formulation: the same calls give the same bits; sampling, the ledger and wear
//! maps change none of them; every frame satisfies the invariants; and a run resumes from a snapshot or a file as if uninterrupted.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::common::invariants::{finite, violation};
use crate::common::matrix::{FORMULATIONS, Variant, every_variant, for_every};
use crate::common::{FOUR_VARIANTS, MACHINES, METHODS, SCENES, frame_now, parse, run_until, scene};
use crate::planar_loops::{Extras, GRASHOF, PLAIN};
use crate::{loop_joints, two_degrees};
use jointplay_physics::machine::Quat;
use jointplay_physics::simulate::{Frame, Ledger, Model, Simulation};
use jointplay_scene::{LiveScene, Scene, built_in_text};

/// Steps before and after the snapshot of a run without contacts.
const BEFORE: u32 = 10;
const AFTER: u32 = 120;
/// Steps within which every scene with clearances has two impacts.
const MAX_STEPS: u32 = 20_000;

/// Steps into the second contact of any joint, or [`BEFORE`] steps without contacts; returns the number of steps.
fn step_into_contact(simulation: &mut Simulation) -> u32 {
    if simulation.mechanism().summary().contacts == 0 {
        (0..BEFORE).for_each(|_| simulation.step().unwrap());
        return BEFORE;
    }
    let mut steps = 0;
    while simulation.statistics().impacts() < 2 {
        simulation.step().unwrap();
        steps += 1;
        assert!(steps < MAX_STEPS, "no impact");
    }
    simulation.step().unwrap();
    let joints = 0..simulation.machine().loose_joints.len();
    assert!(joints.flat_map(|j| simulation.contact_states(j)).any(|contact| contact.active), "nothing touches");
    steps + 1
}

/// Changes three parameters: one acts at once, a clearance moves gradually, and the formulation waits for a reset.
fn change_parameters(simulation: &mut LiveScene) {
    simulation.set("contact.friction", "0.1").unwrap();
    let machine = simulation.machine().clone();
    let loose = machine.loose_joints.iter().position(|joint| joint.contact.clearance > 0.0);
    if let Some(joint) = loose {
        let is_play = |key: &String| [".clearance", ".play.radial", ".play.y"].iter().any(|end| key.ends_with(end));
        let key = simulation.pending().joint_keys(joint).find(is_play).expect("each kind has a play");
        let smaller = format!("{:e} m", 0.9 * machine.loose_joints[joint].contact.clearance);
        simulation.set(&key, &smaller).unwrap();
    }
    let other = FORMULATIONS.into_iter().find(|word| *word != machine.formulation.word()).expect("two");
    simulation.set("formulation", other).unwrap();
}

/// The state hash, and as text the latest frame, the frame in the middle of the last step, statistics and ledger.
fn observe(simulation: &mut Simulation) -> (u64, String) {
    let mut middle = Frame::default();
    let time = 0.5 * (simulation.step_start() + simulation.time());
    simulation.sample(time, &mut middle);
    let end = frame_now(simulation);
    let text = format!("{middle:?} {end:?} {:?} {:?}", simulation.statistics(), simulation.ledger());
    (simulation.state_hash(), text)
}

fn continue_run(simulation: &mut Simulation) -> (u64, String) {
    (0..AFTER).for_each(|_| simulation.step().unwrap());
    observe(simulation)
}

/// Steps once, samples the step, checks the invariants, and takes peaks and impacts.
fn watched_step(simulation: &mut Simulation, variant: Variant) {
    let mut frame = Frame { reactions: Some(Vec::new()), ..Frame::default() };
    simulation.step().unwrap();
    let (from, to) = (simulation.step_start(), simulation.time());
    for part in [0.0, 0.3, 1.0] {
        simulation.sample(from + part * (to - from), &mut frame);
        assert!(finite(&frame), "t = {}", frame.time);
    }
    assert_eq!(violation(&frame, simulation.machine(), variant.formulation), None);
    simulation.take_peaks(&mut Vec::new());
    simulation.take_impacts().for_each(drop);
}

/// Checks all promises for `scene`; returns the hash at the end.
fn check_promises(scene: &Scene, variant: Variant) -> u64 {
    let mut plain = LiveScene::new(scene).unwrap();
    let start = plain.state_hash();
    let steps = step_into_contact(&mut plain);
    let at_snapshot = observe(&mut plain);
    let saved = serde_json::to_string(&*plain.snapshot()).unwrap();
    change_parameters(&mut plain);
    let (mut peaks, mut later_peaks) = (Vec::new(), Vec::new());
    let snapshot = plain.snapshot();
    plain.take_peaks(&mut peaks);
    let first = continue_run(&mut plain);

    // Sampled in every step, with a wear map, after a reset during the run.
    let mut watched = LiveScene::new(scene).unwrap();
    (0..BEFORE).for_each(|_| watched_step(&mut watched, variant));
    watched.reset().unwrap();
    assert_eq!((watched.time(), watched.state_hash()), (0.0, start));
    assert_eq!(watched.ledger(), Some(&Ledger::default()));
    watched.track_wear();
    (0..steps).for_each(|_| watched_step(&mut watched, variant));
    assert!(observe(&mut watched) == at_snapshot, "watched");
    change_parameters(&mut watched);
    let watched_snapshot = watched.snapshot();
    (0..AFTER).for_each(|_| watched_step(&mut watched, variant));
    assert!(observe(&mut watched) == first, "watched");
    watched.commit_wear();
    let wear = watched.wear().unwrap().clone();
    watched.restore(&watched_snapshot);
    assert!(continue_run(&mut watched) == first, "watched, restored");
    watched.commit_wear();
    assert!(*watched.wear().unwrap() == wear, "the same wear");

    // Without a ledger.
    let mut without_ledger = scene.clone();
    without_ledger.set("solver.energy_ledger", "off").unwrap();
    let mut without_ledger = LiveScene::new(&without_ledger).unwrap();
    (0..steps).for_each(|_| without_ledger.step().unwrap());
    change_parameters(&mut without_ledger);
    (0..AFTER).for_each(|_| without_ledger.step().unwrap());
    assert_eq!((without_ledger.state_hash(), without_ledger.ledger()), (first.0, None), "without a ledger");
    assert_eq!(
        (without_ledger.state_vector(), without_ledger.statistics()),
        (plain.state_vector(), plain.statistics())
    );

    // Restored into itself, copied, and restored into an unrelated simulation with other settings.
    let unrelated = LiveScene::new(&crate::common::scene("spcmm", &[])).unwrap();
    let now = {
        plain.restore(&snapshot);
        observe(&mut plain)
    };
    assert!(continue_run(&mut plain.clone()) == first, "copied");
    for mut other in [plain, unrelated] {
        other.restore(&snapshot);
        other.take_peaks(&mut later_peaks);
        assert_eq!(later_peaks, peaks);
        assert!(observe(&mut other) == now, "restored");
        assert!(continue_run(&mut other) == first, "restored");
    }
    // Resumed from a file.
    let mut resumed = LiveScene::new(scene).unwrap();
    resumed.resume(&serde_json::from_str(&saved).unwrap()).unwrap();
    assert_eq!(resumed.state_hash(), at_snapshot.0, "resumed");
    change_parameters(&mut resumed);
    assert!(continue_run(&mut resumed) == first, "resumed");
    first.0
}

/// Prints the case and checks its promises.
fn check_case(name: &str, scene: &Scene, variant: Variant) -> u64 {
    println!("{name}, {variant}");
    check_promises(scene, variant)
}

#[test]
fn every_built_in_scene_keeps_the_promises_with_every_method_and_formulation() {
    for name in SCENES {
        let mut hashes = BTreeSet::new();
        for variant in every_variant() {
            hashes.insert(check_case(name, &scene(name, &variant.changes()), variant));
        }
        // Methods give different hashes, except that `automatic` may equal the explicit method throughout.
        assert!(hashes.len() >= METHODS.len(), "{name}: {}", hashes.len());
    }
}

#[test]
fn ideal_scenes_keep_the_promises() {
    for_every(SCENES, |name, variant| {
        let [method, formulation] = variant.changes();
        let mut changes = vec![method, formulation, ("contact.clearance", "0")];
        if name == "chain" {
            changes.push(("chain.links", "3"));
        }
        check_case(name, &scene(name, &changes), variant);
    });
}

/// Variants that together cover every kind of Jacobian and error control.
fn four_variants() -> [Variant; 4] {
    FOUR_VARIANTS.map(|(method, formulation)| Variant { method, formulation })
}

#[test]
fn machines_and_loops_keep_the_promises() {
    for (name, variant) in MACHINES.into_iter().zip(four_variants().into_iter().cycle()) {
        check_case(name, &scene(name, &variant.changes()), variant);
    }
    for variant in every_variant() {
        check_case("train", &parse(&two_degrees::train(-two_degrees::G), &variant.changes()), variant);
        check_case("four-bar with a bob", &parse(&loop_joints::four_bar_with_a_bob(), &variant.changes()), variant);
    }
    let ideal = Extras { start: "ideal", ..PLAIN };
    for with in [ideal, Extras { driven: &[0], ..ideal }, Extras { clearance: "0.3 mm", ..ideal }] {
        for variant in four_variants() {
            check_case("planar four-bar", &GRASHOF.scene(Quat::identity(), with, &variant.changes()), variant);
        }
    }
}

/// The corpus covers every key of the format.
#[test]
fn scenes_of_the_corpus_keep_the_promises() {
    let folder = Path::new(crate::ROOT).join("tests/fuzz/corpus");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    // A rod of 1e-300 kg has no second impact.
    let good = |path: &&PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy();
        name.starts_with("good-") && name != "good-tiny-and-huge.toml"
    };
    let good = paths.iter().filter(good);
    for (path, variant) in good.zip(four_variants().into_iter().cycle()) {
        let text = std::fs::read_to_string(path).unwrap();
        check_case(&path.display().to_string(), &parse(&text, &variant.changes()), variant);
    }
}

/// A slider-crank with an ideal joint and a pendulum whose loose balls start off the centres of their sockets.
fn eccentric_scenes() -> [(&'static str, String); 2] {
    let text = |name: &str, from: &str, to: &str| {
        let text = built_in_text(name).unwrap();
        assert!(text.contains(from));
        text.replace(from, to)
    };
    let slider = "position = \"200 mm\", velocity";
    [
        ("C", text("slider-crank", slider, "position = \"200.2 mm\", velocity")),
        ("S1", text("pendulum", "position = [0, 0, 0]", "position = \"0.2 0 0 mm\"")),
    ]
}

#[test]
fn a_state_is_restored_even_where_a_start_would_be_refused() {
    for (joint, text) in eccentric_scenes() {
        for variant in four_variants() {
            let scene = parse(&text, &variant.changes());
            let mut simulation = LiveScene::new(&scene).unwrap();
            simulation.advance_to(1e-3).unwrap();
            simulation.set(&format!("joint.{joint}.clearance"), "0.05 mm").unwrap();
            assert!(LiveScene::new(simulation.running()).is_err(), "{joint}, {variant}");
            simulation.advance_to(4e-3).unwrap();
            let snapshot = simulation.snapshot();
            let first = continue_run(&mut simulation);
            let mut other = Simulation::new(&scene.machine).unwrap();
            for target in [&mut simulation, &mut other] {
                target.restore(&snapshot);
                assert!(continue_run(target) == first, "{joint}, {variant}");
            }
        }
    }
}

#[test]
fn pending_changes_of_a_snapshot_take_effect_at_the_reset_of_a_copy() {
    let mut simulation = crate::common::live("spcmm", &[]);
    run_until(&mut simulation, 0.05);
    simulation.set("contact.clearance", "0.1 mm").unwrap();
    simulation.set("spcmm.frequency", "1 Hz").unwrap();
    simulation.set("contact.friction", "0.3").unwrap();
    run_until(&mut simulation, 0.06);
    let clearance = frame_now(&mut simulation).joints[0].clearance;
    assert!(clearance > 0.1e-3 && clearance < 0.3e-3, "{clearance}");
    let mut fresh = LiveScene::new(&scene("spcmm", &[])).unwrap();
    fresh.restore(&simulation.snapshot());
    assert_eq!(fresh.running().machine.contact.friction, 0.3);
    fresh.reset().unwrap();
    assert_eq!(fresh.pending().machine.closed_form.as_ref().unwrap().frequency, 1.0);
    assert_eq!(fresh.running().machine.closed_form.as_ref().unwrap().frequency, 1.0);
    assert_eq!(frame_now(&mut fresh).joints[0].clearance, 0.1e-3);
}

#[test]
fn threads_share_a_model_and_step_states_of_their_own() {
    let model = Model::new(&crate::common::scene("pendulum", &[]).machine).unwrap();
    let run = || {
        let mut state = model.start();
        let mut workspace = model.workspace(&state);
        while state.time() < 0.015 {
            model.step(&mut state, &mut workspace).unwrap();
        }
        state
    };
    let [one, other] =
        std::thread::scope(|scope| [scope.spawn(run), scope.spawn(run)].map(|thread| thread.join().unwrap()));
    assert_eq!(one, other);
}
