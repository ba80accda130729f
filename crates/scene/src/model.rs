//! A scene: the machine described by its file, the view settings and the source text. `read.rs` builds it from a file,
//! `access.rs` changes it by key.

use std::collections::BTreeMap;
use std::ops::Deref;
use std::sync::Arc;

use super::Parameter;
use super::file_number::FileNumber;
use jointplay_physics::machine::{Machine, Vec3};
use jointplay_physics::words::words;

/// A scene file and the machine it describes. A copy shares both until one of the two is changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Source text and its origin, and what it says that no change affects: also read as fields of the scene.
    pub source: Arc<Source>,
    /// The machine to simulate.
    pub machine: Arc<Machine>,
    /// View settings.
    pub view: ViewSettings,
    /// Keys (without prefix) in which each joint with play differs from the scene's `contact.*`.
    pub(super) overrides: Arc<Vec<Vec<&'static str>>>,
    /// Parameters changed since the file was read, in order: key and value as a user would write them.
    pub changes: Vec<(String, String)>,
}

impl Deref for Scene {
    type Target = Source;

    fn deref(&self) -> &Source {
        &self.source
    }
}

impl Scene {
    /// The machine, to be changed: no longer that of copies of this scene.
    pub fn machine_mut(&mut self) -> &mut Machine {
        Arc::make_mut(&mut self.machine)
    }
}

/// Texts of files, by the names used in the scene.
pub type Texts = BTreeMap<String, Arc<str>>;

/// Where a scene's text came from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// Short name: `name` in the file, or else the file name without its extension.
    pub name: String,
    /// A one-line title, for lists.
    pub title: String,
    /// A paragraph for the user.
    pub description: String,
    /// What the machine is for and what to watch, in a sentence; "" for none.
    pub watch: String,
    /// The file as the user named it; `None` for a built-in scene.
    pub file: Option<String>,
    /// The TOML text.
    pub text: Arc<str>,
    /// Byte offsets in the text for errors found after reading: each parameter in the text, by key; `closed_form` for its
    /// section; `joint.<name>` for each joint with play.
    pub places: BTreeMap<String, usize>,
    /// Numbers parsed from the text, by key.
    pub numbers: BTreeMap<String, FileNumber>,
    /// Rows of the user-defined parameters, in file order.
    pub own: Vec<&'static Parameter>,
    /// Contents of the files named by the scene, as of loading.
    pub beside: Texts,
    pub(super) as_read: Option<AsRead>,
}

/// What a text says where changes do not replace its numbers: other changes start from here again without another reading.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AsRead {
    pub machine: Arc<Machine>,
    pub view: ViewSettings,
    pub overrides: Arc<Vec<Vec<&'static str>>>,
    /// Changes of numbers of the text.
    pub changes: Vec<(String, String)>,
}

/// A world axis with its sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SignedAxis {
    PlusX,
    MinusX,
    PlusY,
    MinusY,
    PlusZ,
    MinusZ,
}

words!(SignedAxis {
    PlusX => "+x",
    MinusX => "-x",
    PlusY => "+y",
    MinusY => "-y",
    PlusZ => "+z",
    MinusZ => "-z",
});

impl SignedAxis {
    /// Unit vector, world axes.
    pub fn unit(self) -> Vec3 {
        match self {
            Self::PlusX => Vec3::x(),
            Self::MinusX => -Vec3::x(),
            Self::PlusY => Vec3::y(),
            Self::MinusY => -Vec3::y(),
            Self::PlusZ => Vec3::z(),
            Self::MinusZ => -Vec3::z(),
        }
    }
}

/// Initial view of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSettings {
    /// World axis that points down on the screen.
    pub down: SignedAxis,
    /// Position of the floor grid: coordinate along `down`, m; `None` lets the view choose.
    pub floor: Option<f64>,
    /// Azimuth about the vertical and elevation of the isometric view, rad, if the default would hide something.
    pub isometric: Option<(f64, f64)>,
    /// Initial time scale, simulated seconds per second; `None` lets the window choose.
    pub time_scale: Option<f64>,
    /// Initial plots, each a word of a [`Quantity`](jointplay_physics::simulate::Quantity); if the first is `None`, the window
    /// chooses.
    pub plots: [Option<&'static str>; MAX_PLOTS],
}

/// Maximum number of initial plots.
pub const MAX_PLOTS: usize = 4;

/// Key of the preset.
pub(super) const PRESET: &str = "solver.preset";

/// Keys whose place a preset takes.
pub(crate) const SOLVER_KEYS: [&str; 4] =
    ["solver.method", "solver.step", "solver.tolerance", "solver.steps_per_impact"];
