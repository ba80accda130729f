//! Invariants of reading any bytes as a scene file, shared by the fuzz target and the test that runs its corpus.
//!
//! A line `#set KEY=VALUE`, a comment of the file, stands for `--set KEY=VALUE`.

use jointplay::scene::{Scene, Value, visible};
use jointplay::simulate::{Frame, Simulation};

/// Scenes with more bodies are started but not stepped, to save time.
const MAX_BODIES: usize = 16;
/// Number of steps in each formulation.
const STEPS: usize = 4;
/// Largest number of changes that are applied.
const MAX_CHANGES: usize = 8;

/// How far the bytes were accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Not UTF-8: refused before a scene is read.
    NoText,
    /// Refused as a scene.
    Refused,
    /// A scene that does not start.
    NoStart,
    /// A scene that starts.
    Starts,
}

/// The changes that a text asks for.
fn changes(text: &str) -> Vec<(String, String)> {
    text.lines()
        .filter_map(|line| line.strip_prefix("#set ")?.split_once('='))
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .take(MAX_CHANGES)
        .collect()
}

/// Reads `bytes` as the scene file `fuzz.toml`, writes and reads back its parameters, starts it in both formulations and
/// takes some steps.
///
/// # Panics
/// Where an invariant is violated: an error without a position or a message, a message with terminal control characters, a
/// value that does not read back, a start or a step that is not finite.
pub fn check(bytes: &[u8]) -> Outcome {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Outcome::NoText;
    };
    let changes = changes(text);
    let scene = match Scene::parse(text, Some("fuzz.toml"), &changes) {
        Ok(scene) => scene,
        Err(error) => {
            let words = error_text(&error);
            assert!(!error.message.is_empty(), "an error without a message");
            let changed = |key: &String| changes.iter().any(|(changed, _)| changed == key);
            if error.file.is_none() && error.key.as_ref().is_some_and(changed) {
                return Outcome::Refused;
            }
            assert!(words.starts_with("fuzz.toml"), "{words}");
            if let Some((line, column)) = error.position {
                // A carriage return counts as a character of its line.
                let lines: Vec<&str> = text.split('\n').collect();
                assert!((1..=lines.len()).contains(&(line as usize)), "line of: {words}");
                let length = lines[line as usize - 1].chars().count() + 1;
                assert!((1..=length).contains(&(column as usize)), "column of: {words}");
            } else {
                // An entry that is missing from the whole file has no line.
                assert!(error.message.contains("missing") || error.key.is_some(), "no position: {words}");
            }
            return Outcome::Refused;
        }
    };
    let warnings = scene.machine.warnings().into_iter().map(|w| w.to_string());
    for words in warnings.chain([scene.title.clone(), scene.name.clone()]) {
        assert_eq!(visible(&words), *words);
    }
    for parameter in scene.parameters() {
        let value = scene.get(parameter.key).expect("its own key");
        if value != Value::Unset {
            let written = parameter.write(&value);
            assert_eq!(parameter.read(&written).as_ref(), Ok(&value), "{} = {written}", parameter.key);
        }
    }
    if !changes.is_empty() {
        // A saved scene must be readable; saving may be refused.
        match scene.to_toml() {
            Ok(saved) => assert!(Scene::parse(&saved, None, &[]).is_ok(), "{saved}"),
            Err(error) => assert!(!error_text(&error).is_empty()),
        }
    }
    let outcome = run(&scene);
    let other = match scene.get("formulation") {
        Ok(Value::Choice("tree")) => "lagrange",
        _ => "tree",
    };
    let mut scene = scene;
    scene.set("formulation", other).expect("a choice of every scene");
    run(&scene);
    outcome
}

/// Starts `scene` and takes some steps.
fn run(scene: &Scene) -> Outcome {
    let mut simulation = match Simulation::new(&scene.machine) {
        Ok(simulation) => simulation,
        Err(error) => {
            assert!(!error_text(&scene.locate(&error)).is_empty());
            return Outcome::NoStart;
        }
    };
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    for body in &frame.bodies {
        assert!(body.position.iter().all(|x| x.is_finite()));
    }
    if scene.machine.bodies.len() > MAX_BODIES {
        return Outcome::Starts;
    }
    for _ in 0..STEPS {
        let before = simulation.time();
        if let Err(stopped) = simulation.step() {
            assert_eq!(visible(&stopped.to_string()), stopped.to_string());
            break;
        }
        assert!(simulation.time() > before, "a step that does not advance the time");
    }
    assert!(simulation.state_vector().iter().all(|x| x.is_finite()));
    let joints = &simulation.statistics().joints;
    assert!(joints.iter().all(|joint| joint.peak_normal >= 0.0 && joint.peak_normal.is_finite()));
    for doubt in simulation.doubts() {
        let words = doubt.to_string();
        assert_eq!(visible(&words), words);
    }
    Outcome::Starts
}

/// The text of an error, checked for terminal control characters.
fn error_text(error: &impl std::fmt::Display) -> String {
    let words = error.to_string();
    assert_eq!(visible(&words), words);
    words
}
