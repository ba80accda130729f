//! What must hold for any bytes that are given as a scene file: shared by the fuzz target and the test that runs its corpus.

use jointplay::scene::{Scene, Value};
use jointplay::simulate::{Frame, Simulation};

/// Bodies beyond which a scene is only read: starting costs time, not insight.
const MOST_BODIES: usize = 16;

/// What became of the bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// No text, which the reader of files refuses before a scene is read.
    NoText,
    /// Refused as a scene.
    Refused,
    /// A scene that does not start.
    NoStart,
    /// A scene that starts.
    Starts,
}

/// Reads `bytes` as the scene file `fuzz.toml`, writes and reads back its parameters, and starts it.
///
/// # Panics
/// Where the program breaks a promise: an error without a place or words, a value that does not read back, a start that is
/// not finite.
pub fn check(bytes: &[u8]) -> Fate {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Fate::NoText;
    };
    let scene = match Scene::parse(text, Some("fuzz.toml"), &[]) {
        Ok(scene) => scene,
        Err(error) => {
            let words = error.to_string();
            assert!(!error.message.is_empty(), "an error says what is wrong");
            assert!(words.starts_with("fuzz.toml"), "{words}");
            if let Some((line, column)) = error.position {
                // A carriage return counts as a character of its line.
                let lines: Vec<&str> = text.split('\n').collect();
                assert!(
                    (1..=lines.len()).contains(&(line as usize)),
                    "line of: {words}"
                );
                let length = lines[line as usize - 1].chars().count() + 1;
                assert!(
                    (1..=length).contains(&(column as usize)),
                    "column of: {words}"
                );
            } else {
                // A thing that is missing from the whole file has no line.
                assert!(
                    error.message.contains("missing") || error.key.is_some(),
                    "no place: {words}"
                );
            }
            return Fate::Refused;
        }
    };
    let _ = scene.warnings();
    for parameter in scene.parameters() {
        let value = scene.get(parameter.key).expect("its own key");
        if value != Value::Unset {
            let written = parameter.write(&value);
            assert_eq!(
                parameter.read(&written).as_ref(),
                Ok(&value),
                "{} = {written}",
                parameter.key
            );
        }
    }
    if scene.bodies.len() > MOST_BODIES {
        return Fate::Starts;
    }
    let mut simulation = match Simulation::new(&scene) {
        Ok(simulation) => simulation,
        Err(error) => {
            assert!(!error.located(&scene).to_string().is_empty());
            return Fate::NoStart;
        }
    };
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    for body in &frame.bodies {
        assert!(body.position.iter().all(|x| x.is_finite()), "{text}");
    }
    if let Err(stopped) = simulation.step() {
        assert!(!stopped.to_string().is_empty());
    }
    assert!(simulation.state().iter().all(|x| x.is_finite()), "{text}");
    Fate::Starts
}
