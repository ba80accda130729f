//! Ready-made sweeps for the chaos bench; each states its expected result in advance.

use super::design::Start;
use super::source::SceneSource;
use super::sweep_task::SweepTask;
use jointplay_scene::{Scene, SceneError};

/// A sweep over a built-in scene.
#[derive(Debug, PartialEq, Eq)]
pub struct ReadySweep {
    /// Label of the button.
    pub name: &'static str,
    /// Expected result in one sentence, checked by `tests/physics/ready_sweeps.rs`.
    pub shows: &'static str,
    /// The built-in scene.
    pub scene: &'static str,
    /// Parameter changes.
    pub changes: &'static [(&'static str, &'static str)],
    /// The varied parameter.
    pub key: &'static str,
    /// First and last value, with their unit.
    pub from: &'static str,
    #[allow(missing_docs)]
    pub to: &'static str,
    /// Number of values.
    pub values: usize,
    /// Drive periods per value, including the transient; forty periods after it reveal chaos without an exponent.
    pub periods: usize,
    /// Transient periods to discard.
    pub discard: usize,
}

/// All ready-made sweeps.
pub const READY_SWEEPS: [ReadySweep; 3] = [
    ReadySweep {
        name: "Road to chaos",
        shows: "The four-bar, its crank at 21 to 45 rad/s: every turn is alike until the balls knock, at 24. From there on chaos, but \
                for two regular windows: at 27 every turn is alike again, at 29 every second one.",
        scene: "four-bar",
        // The schemes of `automatic` have different errors, which makes the exponent of a regular motion uncertain by a third
        // of 1/s.
        changes: &[("solver.method", "radau5")],
        key: "parameter.speed",
        from: "21 rad/s",
        to: "45 rad/s",
        values: 25,
        periods: 80,
        discard: 40,
    },
    ReadySweep {
        name: "Friction ends chaos",
        shows: "The driven slider-crank, friction 0 to 0.016: chaos up to about 0.004, every turn alike from about 0.006.",
        scene: "slider-crank-driven",
        changes: &[],
        key: "contact.friction",
        from: "0",
        to: "0.016",
        values: 17,
        periods: 60,
        discard: 20,
    },
    ReadySweep {
        name: "Clearance alone does not cause chaos",
        shows: "The paper's machine, clearance 0.01 to 1 mm: with its friction every period is alike, and nothing is chaotic.",
        scene: "spcmm",
        changes: &[],
        key: "contact.clearance",
        from: "0.01 mm",
        to: "1 mm",
        values: 12,
        periods: 30,
        discard: 10,
    },
];

impl ReadySweep {
    /// Loads the scene with its changes.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let changes: Vec<(String, String)> = self.changes.iter().map(owned).collect();
        Scene::load(self.scene, &changes)
    }

    /// The sweep over `scene`, with sections at the start of the drive period.
    pub fn task(&self, scene: &Scene) -> SweepTask {
        let Self { key, from, to, values, .. } = self;
        SweepTask {
            scene: SceneSource::of(scene),
            vary: vec![format!("{key}={from}..{to}:{values}")],
            periods: self.periods,
            discard: self.discard,
            phase: 0.0,
            start: Start::Cold,
            exponent: false,
        }
    }
}
