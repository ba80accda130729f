//! The built-in lessons.

use std::sync::{Arc, LazyLock};

use serde::Deserialize;

use super::format::Lesson;
use crate::scene::{SceneError, visible_line};
use crate::suggest::nearest;

/// Names and texts in the order of a lecture.
macro_rules! lessons {
    ($($name:literal),+ $(,)?) => {
        [$(($name, include_str!(concat!("../../../assets/lessons/", $name, ".toml")))),+]
    };
}

/// Name and text of each lesson, in the order of a lecture.
pub const BUILT_IN_LESSONS: [(&str, &str); 10] = lessons![
    "rattle",
    "first-impact",
    "clearance",
    "friction",
    "slow-motion",
    "ideal",
    "forces",
    "twin",
    "chaos",
    "to-the-class",
];

/// The part of a lesson shown in the menu.
#[derive(Deserialize)]
struct Head {
    title: String,
}

/// Name and title of each lesson.
pub fn lesson_titles() -> &'static [(&'static str, String)] {
    static TITLES: LazyLock<Vec<(&str, String)>> = LazyLock::new(|| {
        let title = |text: &str| toml::from_str::<Head>(text).map_or(String::new(), |h| h.title);
        let all = BUILT_IN_LESSONS.iter();
        all.map(|(name, text)| (*name, title(text))).collect()
    });
    &TITLES
}

impl Lesson {
    /// A built-in lesson by its name.
    ///
    /// # Errors
    /// No lesson has this name; the error lists the existing names.
    pub fn built_in(name: &str) -> Result<Arc<Self>, SceneError> {
        let names = BUILT_IN_LESSONS.map(|(name, _)| name);
        let Some((name, text)) = BUILT_IN_LESSONS.iter().find(|(own, _)| *own == name) else {
            let near = nearest(name, names);
            let message = format!(
                "no lesson `{}`{near}; built in: {}; the name of a file contains `/` or ends in `.toml`",
                visible_line(&name.chars().take(60).collect::<String>()),
                names.join(", ")
            );
            return Err(SceneError { message, ..SceneError::default() });
        };
        Self::parse(name, text, None).map(Arc::new)
    }

    /// A built-in lesson by name, or a lesson file (the argument contains `/` or ends in `.toml`).
    ///
    /// # Errors
    /// Those of [`Self::built_in`] and [`Self::read`].
    pub fn load(argument: &str) -> Result<Arc<Self>, SceneError> {
        if argument.contains('/') || argument.ends_with(".toml") {
            Self::read(argument).map(Arc::new)
        } else {
            Self::built_in(argument)
        }
    }
}
