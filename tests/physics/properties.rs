//! Random values of the parameter table: within their ranges a scene starts or explains why not, outside them the error states the
//! allowed range. `PROPTEST_CASES` sets the number of cases, `PROPTEST_RNG_SEED` selects others.

use std::sync::LazyLock;

use crate::common::invariants::finite;
use crate::common::{METHODS, SCENES};
use jointplay_physics::machine::Doubt as MachineDoubt;
use jointplay_physics::simulate::{Doubt, Frame};
use jointplay_scene::{BUILT_IN, Kind, LiveScene, Parameter, Scene, Scope, Value, table};
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestCaseError};

/// Steps after every start, and evaluations after which a case ends early.
const STEPS: u32 = 8;
const MAX_EVALUATIONS: u64 = 3000;
/// More links behave the same at the start and cost time.
const MAX_LINKS: u64 = 12;

/// A fixed set of cases, unless the environment selects others.
pub fn config(cases: u32) -> ProptestConfig {
    let is_set = |name| std::env::var_os(name).is_some();
    let default = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
    if is_set("PROPTEST_CASES") || is_set("PROPTEST_RNG_SEED") {
        return default;
    }
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(1), ..default }
}

/// Values in a row's range, including its ends; wide ranges are sampled logarithmically.
fn values(parameter: &'static Parameter) -> BoxedStrategy<Value> {
    match parameter.kind {
        Kind::Number { min, max, .. } => {
            // Ranges that begin at 0 or below are sampled logarithmically from 1e-9.
            let least = if min > 0.0 { min } else { 1e-9 };
            let decades = (least.ln()..max.ln()).prop_map(move |x| x.exp().clamp(min, max));
            let negative = decades.clone().prop_map(move |x| (-x).max(min));
            prop_oneof![
                1 => Just(min),
                1 => Just(max),
                1 => Just(0.0_f64.clamp(min, max)),
                3 => min..=max,
                4 => decades,
                1 => negative,
            ]
            .prop_map(Value::Number)
            .boxed()
        }
        Kind::Count { min, max } => (min..=max.min(MAX_LINKS)).prop_map(Value::Count).boxed(),
        Kind::Choice(words) => proptest::sample::select(words).prop_map(Value::Choice).boxed(),
    }
}

/// A built-in scene, read once.
fn built_in(name: &str) -> &'static Scene {
    static ALL: LazyLock<Vec<Scene>> = LazyLock::new(|| BUILT_IN.map(|name| Scene::load(name, &[]).unwrap()).into());
    ALL.iter().find(|scene| scene.name == name).expect("built in")
}

/// A built-in scene that has this row.
fn with_row(row: &Parameter) -> Scene {
    built_in(if row.scope == Scope::Own { "chain" } else { "spcmm" }).clone()
}

/// Any row of the table, or the number of links of `chain`.
fn rows() -> impl Strategy<Value = &'static Parameter> {
    let rows: Vec<&Parameter> = table().iter().chain(built_in("chain").parameter("chain.links")).collect();
    proptest::sample::select(rows)
}

/// A row of the table as a key of `scene`: for all joints, or for one of them.
fn key(scene: &Scene, parameter: &Parameter, joint: usize) -> String {
    // Two thirds of the keys are for all joints.
    let joints = &scene.machine.loose_joints;
    match parameter.key.strip_prefix("contact.") {
        Some(part) if joint.is_multiple_of(3) => {
            format!("joint.{}.{part}", joints[joint / 3 % joints.len()].name)
        }
        _ => parameter.key.to_owned(),
    }
}

/// One of `scenes`, and changes within the ranges of its keys.
fn changed_scenes(scenes: &'static [&'static str]) -> impl Strategy<Value = (&'static str, Vec<(String, String)>)> {
    let of_scene = |name: &'static str| {
        let scene = built_in(name);
        let rows: Vec<BoxedStrategy<(&'static Parameter, Value)>> =
            scene.parameters().into_iter().map(|row| values(row).prop_map(move |value| (row, value)).boxed()).collect();
        let change = proptest::strategy::Union::new(rows);
        proptest::collection::vec((change, any::<usize>()), 1..=8).prop_map(move |changes| {
            let write = |((row, value), joint): ((&'static Parameter, Value), usize)| {
                (key(scene, row, joint), row.write(&value))
            };
            (name, changes.into_iter().map(write).collect::<Vec<_>>())
        })
    };
    proptest::sample::select(scenes).prop_flat_map(of_scene)
}

fn fail(what: impl Into<String>) -> TestCaseError {
    TestCaseError::fail(what.into())
}

/// Checks that an error message is readable and names the key of one of `changes`.
fn check_message(words: &str, changes: &[(String, String)]) -> Result<(), TestCaseError> {
    prop_assert!(!words.contains("NaN") && words.len() < 2000, "{words}");
    let part = |key: &str| key.rsplit('.').next().unwrap_or_default().to_owned();
    prop_assert!(changes.iter().any(|(key, _)| words.contains(&part(key))), "no key in: {words}");
    Ok(())
}

/// A scene with ideal and loose joints, any method and formulation, for which the results of a run must be consistent.
#[derive(Clone, Debug)]
struct Mixed {
    scene: &'static str,
    changes: Vec<(String, String)>,
}

fn mixed() -> impl Strategy<Value = Mixed> {
    let word = proptest::sample::select;
    (
        word(&SCENES[..]),
        word(&METHODS[..]),
        word(&["tree", "lagrange"][..]),
        word(&["start", "largest"][..]),
        word(&["5 us", "10 us", "25 us", "100 us"][..]),
        1e-7..5e-5_f64,
        proptest::collection::vec(proptest::option::weighted(0.7, 0.02..0.4_f64), 3),
    )
        .prop_map(|(scene, method, form, approach, step, tolerance, joints)| {
            let mut changes = vec![
                ("solver.method".to_owned(), method.to_owned()),
                ("formulation".to_owned(), form.to_owned()),
                ("contact.approach_speed".to_owned(), approach.to_owned()),
                ("solver.step".to_owned(), step.to_owned()),
                ("solver.tolerance".to_owned(), format!("{tolerance:e}")),
            ];
            if scene == "chain" {
                changes.push(("chain.links".to_owned(), "3".to_owned()));
            }
            let machine = Scene::load(scene, &changes).unwrap().machine;
            for (joint, clearance) in machine.loose_joints.iter().zip(&joints) {
                let key = format!("joint.{}.clearance", joint.name);
                let value = clearance.map_or("0".to_owned(), |c| format!("{c:.4} mm"));
                changes.push((key, value));
            }
            Mixed { scene, changes }
        })
}

/// How far a peak from the ends of steps may be below and above the largest of many rows: at a loose tolerance the cubic through both
/// ends of a step and the method's own interpolant differ.
const BELOW: f64 = 0.02;
const ABOVE: f64 = 0.06;

/// Rows within every step.
const ROWS: u32 = 6;

proptest! {
    #![proptest_config(config(32))]

    #[test]
    fn summary_rows_and_impacts_agree(mixed in mixed()) {
        let scene = match Scene::load(mixed.scene, &mixed.changes) {
            Ok(scene) => scene,
            Err(error) => return check_message(&error.to_string(), &mixed.changes),
        };
        let (Ok(mut plain), Ok(mut sampled)) = (LiveScene::new(&scene), LiveScene::new(&scene)) else {
            return Ok(());
        };
        let joints = scene.machine.loose_joints.len();
        let mut frame = Frame::default();
        let (mut rows, mut impacts) = (vec![0.0_f64; joints], Vec::new());
        while plain.time() < 0.012 {
            let stopped = plain.step().err();
            prop_assert_eq!(&sampled.step().err(), &stopped);
            if stopped.is_some() {
                break;
            }
            let (from, to) = (sampled.step_start(), sampled.time());
            for n in 0..=ROWS {
                let time = from + (to - from) * f64::from(n) / f64::from(ROWS);
                sampled.sample(time, &mut frame);
                for (row, report) in rows.iter_mut().zip(&frame.joints) {
                    *row = row.max(report.normal_force.norm());
                }
            }
            impacts.extend(sampled.take_impacts());
        }
        prop_assert!(plain.state() == sampled.state(), "looking changed the state");
        let statistics = plain.statistics();
        let unresolved = |doubt: &Doubt| matches!(doubt, Doubt::Unresolved { .. } | Doubt::Machine(MachineDoubt::Step { .. }));
        // Within a step longer than an impact the force depends on the interpolation; such runs raise a doubt.
        let resolved = !plain.doubts().iter().any(unresolved);
        for (j, joint) in scene.machine.loose_joints.iter().enumerate() {
            let (row, name) = (rows[j], &joint.name);
            // Peaks as printed by a run, which has rows, and by a sweep, which has none.
            let (printed, from_steps) = (sampled.peak(j).0, statistics.joints[j].peak_normal);
            prop_assert!(printed >= row, "{}: {} below the rows' {}", name, printed, row);
            let agrees = from_steps >= row * (1.0 - BELOW) - 1.0 && from_steps <= row * (1.0 + ABOVE) + 1.0;
            prop_assert!(!resolved || agrees, "{}: {}, rows {}", name, from_steps, row);
            prop_assert!((0.0..=plain.time()).contains(&statistics.joints[j].peak_time));
            let impacts_of_joint = || impacts.iter().filter(move |impact| impact.joint == j);
            prop_assert!(impacts_of_joint().count() as u64 <= statistics.joints[j].impacts, "{}", name);
            prop_assert!(joint.contact.clearance > 0.0 || impacts_of_joint().count() == 0, "{}", name);
            let chi = joint.contact.normal_law.damping_factor(joint.contact.restitution);
            let largest = joint.contact.approach_speed == jointplay_physics::contact::ApproachSpeed::Largest;
            for impact in impacts_of_joint() {
                prop_assert!(impact.peak <= from_steps * (1.0 + 1e-12), "{:?} beyond {}", impact, from_steps);
                prop_assert!(impact.start < impact.end && impact.end <= plain.time(), "{:?}", impact);
                prop_assert!(impact.damping <= statistics.joints[j].damping, "{:?}", impact);
                prop_assert!(!largest || impact.damping <= chi * (1.0 + 2e-6), "{:?}", impact);
            }
        }
        let ledger = (plain.ledger().copied(), sampled.ledger().copied());
        prop_assert_eq!(ledger.0, ledger.1);
    }
}

proptest! {
    #![proptest_config(config(400))]

    #[test]
    fn any_values_in_range_start_or_are_refused_and_stay_finite((name, changes) in changed_scenes(&BUILT_IN)) {
        let scene = match Scene::load(name, &changes) {
            Ok(scene) => scene,
            Err(error) => return check_message(&error.to_string(), &changes),
        };
        for (key, text) in &changes {
            let last = changes.iter().rfind(|(other, _)| other == key);
            let may_be_overridden = key.starts_with("contact.") || key.starts_with("solver.");
            if !may_be_overridden && last.is_some_and(|(_, other)| other == text) {
                let row = scene.parameter(key).map_err(|error| fail(error.to_string()))?;
                let value = scene.get(key).map_err(|error| fail(error.to_string()))?;
                prop_assert_eq!(row.read(text), Ok(value), "{} = {}", key, text);
            }
        }
        prop_assert!(scene.machine.warnings().iter().all(|warning| warning.to_string().ends_with('.')));
        let mut simulation = match LiveScene::new(&scene) {
            Ok(simulation) => simulation,
            Err(error) => return check_message(&scene.locate(&error).to_string(), &changes),
        };
        let mut frame = Frame::default();
        simulation.sample(0.0, &mut frame);
        prop_assert!(finite(&frame), "not finite at the start");
        for _ in 0..STEPS {
            let before = simulation.time();
            match simulation.step() {
                Ok(()) => prop_assert!(simulation.time() > before),
                Err(stopped) => {
                    prop_assert_eq!(simulation.time(), before);
                    prop_assert!(!stopped.to_string().contains("NaN"), "{}", stopped);
                }
            }
            let inside = 0.5 * (simulation.step_start() + simulation.time());
            for time in [inside, simulation.time()] {
                simulation.sample(time, &mut frame);
                prop_assert!(finite(&frame), "not finite at t = {time:e}");
            }
            if simulation.time() == before || simulation.statistics().evaluations > MAX_EVALUATIONS {
                break;
            }
        }
        let words: Vec<String> = simulation.doubts().iter().map(ToString::to_string).collect();
        prop_assert!(words.iter().all(|doubt| doubt.ends_with('.') && !doubt.contains("NaN")), "{words:?}");
    }

    #[test]
    fn any_live_changes_are_accepted_or_refused_and_stay_finite((name, changes) in changed_scenes(&SCENES)) {
        let mut simulation = LiveScene::new(built_in(name)).unwrap();
        // During the first impacts.
        simulation.advance_to(8e-3).map_err(|stopped| fail(stopped.to_string()))?;
        let mut frame = Frame::default();
        for (key, value) in &changes {
            let hash = simulation.state_hash();
            if let Err(error) = simulation.set(key, value) {
                check_message(&error.to_string(), &changes)?;
                prop_assert_eq!(simulation.state_hash(), hash, "changed by a refused value");
            }
            for _ in 0..2 {
                let stopped = simulation.step().is_err();
                for time in [simulation.step_start(), simulation.time()] {
                    simulation.sample(time, &mut frame);
                    prop_assert!(finite(&frame), "not finite at t = {time:e} after {key} = {value}");
                }
                if stopped {
                    return Ok(());
                }
            }
        }
        // Pending changes take effect at the reset, or the reset is refused and the run continues.
        let time = simulation.time();
        let scene = simulation.pending().clone();
        match simulation.reset() {
            Ok(()) => prop_assert_eq!(simulation.time(), 0.0),
            Err(error) => {
                prop_assert_eq!(simulation.time(), time);
                check_message(&scene.locate(&error).to_string(), &changes)?;
            }
        }
    }

    #[test]
    fn every_value_can_be_written_and_read_back(
        (row, value) in rows().prop_flat_map(|row| values(row).prop_map(move |value| (row, value)))
    ) {
        let text = row.write(&value);
        prop_assert_eq!(row.read(&text), Ok(value.clone()), "{}", text);
        prop_assert!(row.check(&value).is_ok());
        let mut scene = with_row(row);
        match scene.set_value(row.key, &value) {
            Ok(_) => {
                prop_assert_eq!(scene.get(row.key).unwrap(), value);
                // The recorded changes reproduce the scene.
                let reloaded = Scene::load(&scene.name, &scene.changes).unwrap();
                prop_assert_eq!(reloaded.get(row.key).unwrap(), scene.get(row.key).unwrap());
            }
            Err(error) => prop_assert!(error.to_string().contains(row.key), "{}", error),
        }
    }

    #[test]
    fn a_value_out_of_range_names_key_value_range_and_unit(
        row in rows(), above in any::<bool>(), beyond in 1e-6..10.0_f64
    ) {
        let outside = match row.kind {
            Kind::Number { min, max, .. } => {
                let edge = if above { max } else { min };
                let size = edge.abs().max(1e-9) * beyond;
                Value::Number(if above { edge + size } else { edge - size })
            }
            Kind::Count { min, max } => Value::Count(if above { max + 1 + beyond as u64 } else { min - 1 }),
            Kind::Choice(_) => return Ok(()),
        };
        prop_assert!(row.check(&outside).is_err());
        let text = row.write(&outside);
        let mut scene = with_row(row);
        let before = scene.clone();
        let words = scene.set(row.key, &text).unwrap_err().to_string();
        prop_assert!(words.starts_with(&format!("{} = {text}: ", row.key)), "{}", words);
        prop_assert!(words.contains(&row.range()), "{}", words);
        prop_assert!(words.contains(&row.units()), "{}", words);
        prop_assert_eq!(scene.changes, before.changes);
    }

    #[test]
    fn any_text_as_a_value_is_read_or_refused(row in rows(), text in "\\PC{0,24}") {
        if let Err(words) = row.read(&text) {
            prop_assert!(words.allowed.contains(&row.range()), "{}", words);
        }
    }

    #[test]
    fn any_text_as_a_key_is_known_or_refused(text in "[a-z._]{0,30}|\\PC{0,24}") {
        let mut scene = built_in("spcmm").clone();
        if let Err(error) = scene.set(&text, "1") {
            prop_assert!(!error.to_string().is_empty());
        }
    }
}
