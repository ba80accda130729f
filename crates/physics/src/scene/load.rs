//! Where scenes come from: the built-in ones, and files.

use super::beside::{Beside, LARGEST_FILE};
use super::error::{brief, line_and_column, nearest};
use super::{Scene, SceneError, visible_line};
use std::ffi::OsStr;
use std::io::Read;
use std::path::Path;

/// Names of the built-in scenes.
pub const BUILT_IN: [&str; 10] = [
    "spcmm",
    "pendulum",
    "slider-crank",
    "slider-crank-driven",
    "chain",
    "hexapod",
    "delta",
    "four-bar",
    "suspension",
    "press",
];

/// The scene that opens if none is named.
pub const DEFAULT_SCENE: &str = BUILT_IN[0];

/// Most bodies of a scene, including a chain's links.
pub const MOST_BODIES: usize = 10_000;
/// Most ball joints of a scene, including a chain's.
pub const MOST_BALL_JOINTS: usize = 10_000;
/// Most shapes of a scene, on bodies and fixed.
pub const MOST_SHAPES: usize = 50_000;
/// Most force elements of each kind.
pub const MOST_ELEMENTS: usize = 10_000;
/// Most corners of a plate.
pub const MOST_CORNERS: usize = 100;
/// Most changes of a scene.
pub const MOST_CHANGES: usize = 4096;

/// The message for a larger one.
pub fn too_large() -> String {
    format!("too large for a scene file: more than {} MiB", LARGEST_FILE >> 20)
}

/// TOML text of a built-in scene.
pub fn built_in_text(name: &str) -> Option<&'static str> {
    Some(match name {
        "spcmm" => include_str!("../../../../assets/scenes/spcmm.toml"),
        "pendulum" => include_str!("../../../../assets/scenes/pendulum.toml"),
        "slider-crank" => include_str!("../../../../assets/scenes/slider-crank.toml"),
        "slider-crank-driven" => include_str!("../../../../assets/scenes/slider-crank-driven.toml"),
        "chain" => include_str!("../../../../assets/scenes/chain.toml"),
        "hexapod" => include_str!("../../../../assets/scenes/hexapod.toml"),
        "delta" => include_str!("../../../../assets/scenes/delta.toml"),
        "four-bar" => include_str!("../../../../assets/scenes/four-bar.toml"),
        "suspension" => include_str!("../../../../assets/scenes/suspension.toml"),
        "press" => include_str!("../../../../assets/scenes/press.toml"),
        _ => return None,
    })
}

impl Scene {
    /// A built-in scene by name, or a file (contains `/` or ends in `.toml`), with changes applied in order; the last
    /// change of a key wins.
    ///
    /// # Errors
    /// Unreadable file, anything wrong in it, or a bad change.
    pub fn load(argument: impl AsRef<OsStr>, changes: &[(String, String)]) -> Result<Self, SceneError> {
        let path = argument.as_ref();
        // A file name need not be valid UTF-8; messages about it must be.
        let argument = &*path.to_string_lossy();
        if argument.contains('/') || argument.ends_with(".toml") {
            let text = read_file(Path::new(path), argument)?;
            let folder = Path::new(path).parent().unwrap_or(Path::new(""));
            return Self::parse_beside(&text, Some(argument), Beside::in_folder(folder), changes);
        }
        match built_in_text(argument) {
            Some(text) => Self::parse(text, None, changes),
            None => {
                let near = nearest(argument, BUILT_IN);
                let message = format!(
                    "no built-in scene `{}`{near}; built in: {}; the name of a file contains `/` or ends in `.toml`",
                    visible_line(&brief(argument)),
                    BUILT_IN.join(", ")
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
    let metadata = std::fs::metadata(path).map_err(|cause| {
        let stem = name.rsplit('/').next().unwrap_or(name).trim_end_matches(".toml");
        let near = nearest(stem, BUILT_IN);
        error(format!(
            "cannot read this file: {cause}; built-in scenes, named without `/` and `.toml`: {}{near}",
            BUILT_IN.join(", ")
        ))
    })?;
    if metadata.is_dir() {
        return Err(error("this is a directory, not a scene file".to_owned()));
    }
    let mut bytes = Vec::new();
    // One byte more than allowed: a pipe or a device does not report its size.
    std::fs::File::open(path)
        .and_then(|file| file.take(LARGEST_FILE + 1).read_to_end(&mut bytes))
        .map_err(|cause| error(format!("cannot read this file: {cause}")))?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(SceneError { unreadable: false, ..error(too_large()) });
    }
    String::from_utf8(bytes).map_err(|cause| {
        let good = &cause.as_bytes()[..cause.utf8_error().valid_up_to()];
        let good = std::str::from_utf8(good).unwrap_or("");
        SceneError {
            position: Some(line_and_column(good)),
            unreadable: false,
            ..error("not a text file: this byte is not valid UTF-8, so it is no scene file".to_owned())
        }
    })
}
