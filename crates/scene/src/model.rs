//! A scene: the machine that its file describes, how that is to be viewed, and the text from which it was read. `read.rs` builds it
//! from a file, `parameters.rs` changes it by key.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::given::{FileNumber, UserParameter};
use jointplay_physics::machine::{Machine, Vec3};
use jointplay_physics::words::words;

/// A scene file with the machine that it describes.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Short name: that of the built-in scene, or of the file without its extension.
    pub name: String,
    /// A one-line title, for lists.
    pub title: String,
    /// A paragraph for the user.
    pub description: String,
    /// What it describes.
    pub machine: Machine,
    /// Set in scenes made of repeated links.
    pub chain: Option<Chain>,
    /// How it is to be viewed.
    pub view: ViewSettings,
    /// Keys (without prefix) in which each ball joint differs from the scene's `contact.*`.
    pub(super) overrides: Vec<Vec<&'static str>>,
    /// Text the scene was read from, and its origin: a reset reads it again with the changes.
    pub source: Source,
    /// Parameters changed since the file was read, in order: key and value as a user would write them.
    pub changes: Vec<(String, String)>,
}

/// Texts of files by the names that a scene gives them.
pub type Texts = BTreeMap<String, Arc<str>>;

/// Where a scene's text came from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// The file as the user named it; `None` for a built-in scene.
    pub file: Option<String>,
    /// The TOML text.
    pub text: String,
    /// Byte offsets in the text of what errors found after reading point to: each parameter given in the text, by key;
    /// `spcmm`, its section; `joint.<name>`, each ball joint (a chain's: its section).
    pub places: BTreeMap<String, usize>,
    /// Numbers from which the scene was built, by key.
    pub numbers: Arc<BTreeMap<String, FileNumber>>,
    /// The scene's own parameters, in the order of the file.
    pub own: Vec<UserParameter>,
    /// Texts of the files beside the scene that it names, as they were when it was loaded.
    pub beside: Texts,
}

/// A row of equal links.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chain {
    /// Number of links.
    pub links: usize,
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

/// How the scene is to be viewed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSettings {
    /// World axis that points down on the screen.
    pub down: SignedAxis,
    /// Position of the floor grid: coordinate along `down`, m; `None` lets the view choose.
    pub floor: Option<f64>,
    /// Azimuth about the vertical and elevation of the isometric view, rad, where the usual one would hide something.
    pub isometric: Option<(f64, f64)>,
    /// Simulated seconds per second that a window begins with; `None` lets it choose.
    pub time_scale: Option<f64>,
    /// Plots that a window begins with, each one of [`PLOT_WORDS`](jointplay_physics::simulate::PLOT_WORDS); `None` at first lets it choose.
    pub plots: [Option<&'static str>; MOST_PLOTS],
}

/// Most plots that a window may begin with.
pub const MOST_PLOTS: usize = 4;

/// Keys of what a preset stands for, in the order of [`jointplay_physics::machine::Preset::point`].
pub const SOLVER_KEYS: [&str; 3] = ["solver.method", "solver.step", "solver.tolerance"];
