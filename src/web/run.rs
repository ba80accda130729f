//! Runs without a picture, for scripts: the browser's counterpart of `jointplay run`.

use wasm_bindgen::prelude::*;

use crate::scene::{BUILT_IN, Kind, Scene, table};
use crate::simulate::Simulation;

/// The program's version.
#[wasm_bindgen]
pub fn version() -> String {
    crate::VERSION.to_owned()
}

/// Names of the built-in scenes.
#[wasm_bindgen]
pub fn scenes() -> Vec<String> {
    BUILT_IN.map(str::to_owned).to_vec()
}

/// Named values of parameter `key`, e.g. those of `solver.method`; empty if it has none.
#[wasm_bindgen]
pub fn choices(key: &str) -> Vec<String> {
    let row = table().iter().find(|row| row.key == key);
    match row.map(|row| row.kind) {
        Some(Kind::Choice(words)) => words.iter().map(|&word| word.to_owned()).collect(),
        _ => Vec::new(),
    }
}

/// A running scene.
#[wasm_bindgen]
pub struct Run {
    simulation: Simulation,
}

#[wasm_bindgen]
impl Run {
    /// Starts a built-in scene with `changes`, each `key=value`.
    ///
    /// # Errors
    /// Text: an unknown scene, a bad change, a scene that cannot start.
    #[wasm_bindgen(constructor)]
    pub fn new(scene: &str, changes: Vec<String>) -> Result<Run, JsError> {
        let changes: Vec<(String, String)> = changes
            .iter()
            .map(|change| {
                let (key, value) =
                    change.split_once('=').ok_or_else(|| JsError::new(&format!("`{change}` is not `key=value`")))?;
                Ok((key.to_owned(), value.to_owned()))
            })
            .collect::<Result<_, JsError>>()?;
        let scene = Scene::load(scene, &changes)?;
        let simulation = Simulation::new(&scene.machine).map_err(|e| JsError::new(&scene.locate(&e).to_string()))?;
        Ok(Self { simulation })
    }

    /// Steps until exactly `time`, s.
    ///
    /// # Errors
    /// Text: the divergence guard stopped it.
    #[wasm_bindgen(js_name = advanceTo)]
    pub fn advance_to(&mut self, time: f64) -> Result<(), JsError> {
        // The last step is truncated, as in `jointplay run`.
        while self.simulation.time() < time {
            self.simulation.step_until(time)?;
        }
        Ok(())
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        self.simulation.time()
    }

    /// State hash (`docs/numerics.md`), 16 hexadecimal digits.
    #[wasm_bindgen(js_name = stateHash)]
    pub fn state_hash(&self) -> String {
        format!("{:016x}", self.simulation.state_hash())
    }
}
