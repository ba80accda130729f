//! Loading of built-in scenes and scene files.

use super::assets::{AssetResolver, MAX_FILE_SIZE};
use super::error::line_and_column;
use super::file::{ReadError, read_regular};
use super::{Scene, SceneError, visible_line};
use jointplay_physics::suggest::{brief, did_you_mean, nearest, nearest_name};
use std::ffi::OsStr;
use std::path::Path;

/// Embeds scenes from folders of `assets/`: defines the lists of their names and a lookup of their texts.
macro_rules! embedded {
    ($($(#[$about:meta])* $list:ident in $folder:literal: $($name:literal),+;)+) => {
        $($(#[$about])* pub const $list: [&str; [$($name),+].len()] = [$($name),+];)+

        /// TOML text of a built-in scene or of a benchmark.
        pub fn built_in_text(name: &str) -> Option<&'static str> {
            Some(match name {
                $($($name => include_str!(concat!("../assets/", $folder, "/", $name, ".toml")),)+)+
                _ => return None,
            })
        }
    };
}

embedded! {
    /// Names of the built-in scenes, which the window lists.
    BUILT_IN in "scenes":
        "measuring-machine", "spcmm", "pendulum", "slider-crank", "slider-crank-driven", "chain", "hexapod", "delta", "four-bar",
        "suspension", "press", "slider-crank-worn", "excavator";
    /// Names of the benchmarks, machines with known answers (`docs/validation.md`): known by name alone.
    BENCHMARKS in "benchmarks":
        "simple-pendulum", "n-four-bar", "squeezer", "bricard", "governor", "flores", "flip", "cardan", "backlash", "ball",
        "scott-russell", "trammel", "level-pin", "thrown-pin", "free-housing", "crank-pin", "driven-slide", "released-slide", "belt",
        "worn-pin", "oiled";
}

/// The scene opened if none is named.
pub const DEFAULT_SCENE: &str = BUILT_IN[0];

/// Maximum number of bodies in a scene.
pub const MAX_BODIES: usize = 10_000;
/// Maximum number of ball joints in a scene.
pub(crate) const MAX_BALL_JOINTS: usize = 10_000;
/// Maximum number of shapes in a scene, on bodies and fixed.
pub const MAX_SHAPES: usize = 50_000;
/// Maximum number of force elements of each kind.
pub(crate) const MAX_ELEMENTS: usize = 10_000;
/// Maximum number of corners of a plate.
pub(crate) const MAX_CORNERS: usize = 100;
/// Maximum number of changed parameters.
pub const MAX_CHANGES: usize = 4096;

/// Error message for a scene file above the size limit.
pub fn too_large() -> String {
    format!("too large for a scene file: more than {} MiB", MAX_FILE_SIZE >> 20)
}

/// A suggestion of the built-in scene or benchmark nearest to `name`, and the list of the built-in ones.
fn known_names(name: &str) -> (String, String) {
    let near = nearest(name, BUILT_IN.into_iter().chain(BENCHMARKS));
    // `scenes` lists the benchmarks.
    (near, BUILT_IN.join(", "))
}

/// Whether `typed` may be `name` with a letter too many, too few or wrong, after a right beginning.
fn is_slip(typed: &str, name: &str) -> bool {
    let beginning = name.len().div_ceil(2);
    typed.len().abs_diff(name.len()) <= 1 && typed.get(..beginning) == name.get(..beginning)
}

impl Scene {
    /// Loads a built-in scene or benchmark by name, or a file (contains `/` or ends in `.toml`). Changes are applied in order;
    /// the last change of a key wins.
    ///
    /// # Errors
    /// Unknown name, unreadable or invalid file, or invalid change.
    pub fn load(argument: impl AsRef<OsStr>, changes: &[(String, String)]) -> Result<Self, SceneError> {
        let path = argument.as_ref();
        // A file name need not be valid UTF-8; messages about it must be.
        let argument = &*path.to_string_lossy();
        if argument.contains('/') || argument.ends_with(".toml") {
            let text = read_file(Path::new(path), argument)?;
            let folder = Path::new(path).parent().unwrap_or(Path::new(""));
            return Self::parse_with_assets(&text, Some(argument), AssetResolver::in_folder(folder), changes);
        }
        match built_in_text(argument) {
            Some(text) => Self::parse(text, None, changes),
            None => {
                let (near, known) = known_names(argument);
                let message = format!(
                    "no built-in scene `{}`{near}; built in: {known}; the name of a file contains `/` or ends in `.toml`",
                    visible_line(&brief(argument))
                );
                Err(SceneError { message, ..SceneError::default() })
            }
        }
    }
}

fn read_file(path: &Path, name: &str) -> Result<String, SceneError> {
    let error = |message: String| SceneError {
        file: Some(name.to_owned()),
        message,
        unreadable: true,
        ..SceneError::default()
    };
    let bytes = read_regular(path, MAX_FILE_SIZE).map_err(|cause| match cause {
        ReadError::TooLarge(_) => SceneError { unreadable: false, ..error(too_large()) },
        ReadError::Unreadable(_) if !path.exists() => {
            // Perhaps the name of a built-in scene, written as a file or with a slip; a file of one's own is another name.
            let stem = name.rsplit('/').next().unwrap_or(name).trim_end_matches(".toml");
            let near = nearest_name(stem, BUILT_IN.into_iter().chain(BENCHMARKS)).filter(|near| is_slip(stem, near));
            let (_, known) = known_names(stem);
            let hint = near.map_or_else(String::new, |near| {
                format!("; built-in scenes, named without `/` and `.toml`: {known}{}", did_you_mean(Some(near)))
            });
            error(format!("{cause}{hint}"))
        }
        _ => error(cause.to_string()),
    })?;
    String::from_utf8(bytes).map_err(|cause| {
        let valid = &cause.as_bytes()[..cause.utf8_error().valid_up_to()];
        let valid = std::str::from_utf8(valid).unwrap_or("");
        SceneError {
            position: Some(line_and_column(valid)),
            unreadable: false,
            ..error("not a text file: this byte is not valid UTF-8, so it is not a scene file".to_owned())
        }
    })
}
