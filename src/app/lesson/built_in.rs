//! The built-in lessons.

use std::sync::{Arc, LazyLock};

use serde::Deserialize;

use super::format::{CameraTarget, Lesson, Picture, Question};
use crate::scene::{Scene, SceneError, visible_line};
use crate::suggest::nearest;

/// Names and texts in the order of a lecture.
macro_rules! lessons {
    ($($name:literal),+ $(,)?) => {
        [$(($name, include_str!(concat!("../../../assets/lessons/", $name, ".toml")))),+]
    };
}

/// Name and text of each lesson, in the order of a lecture.
pub const BUILT_IN_LESSONS: [(&str, &str); 12] = lessons![
    "rattle",
    "first-impact",
    "clearance",
    "friction",
    "slow-motion",
    "ideal",
    "forces",
    "worn-hinge",
    "wear",
    "twin",
    "chaos",
    "to-the-class",
];

/// Words of a text read aloud or with care in a minute, and minutes that a step takes besides: predicting and watching.
const WORDS_PER_MINUTE: f64 = 150.0;
const MINUTES_PER_STEP: f64 = 0.3;

/// The part of a lesson shown in the list.
#[derive(Deserialize)]
struct Head {
    title: String,
    about: String,
    scene: String,
    picture: Picture,
    step: Vec<StepWords>,
}

/// The words of a step that are read.
#[derive(Deserialize)]
struct StepWords {
    text: String,
    #[serde(default)]
    seen: String,
    question: Option<Question>,
}

/// A built-in lesson in the list.
pub struct LessonCard {
    /// Its name.
    pub name: &'static str,
    /// Its title.
    pub title: String,
    /// What one learns, in a sentence.
    pub about: String,
    /// About how long it takes, min.
    pub minutes: u32,
    /// Number of its steps.
    pub steps: usize,
    scene: String,
    picture: Picture,
}

impl LessonCard {
    fn read(name: &'static str, text: &str) -> Option<Self> {
        let Head { title, about, scene, picture, step: steps } = toml::from_str(text).ok()?;
        let count = |text: &str| text.split_whitespace().count();
        let asked = |question: &Question| {
            count(&question.ask) + question.choices.iter().map(|choice| count(&choice.text)).sum::<usize>()
        };
        let read = |step: &StepWords| count(&step.text) + count(&step.seen) + step.question.as_ref().map_or(0, asked);
        let words: usize = steps.iter().map(read).sum();
        let minutes = words as f64 / WORDS_PER_MINUTE + steps.len() as f64 * MINUTES_PER_STEP;
        Some(Self { name, title, about, minutes: minutes.round() as u32, steps: steps.len(), scene, picture })
    }

    /// The scene of its picture, with the instant, s, and the joint seen from close up, or else the point of view.
    pub fn picture(&self) -> Option<(Scene, f64, Option<CameraTarget>)> {
        self.picture.instant(&self.scene).ok()
    }
}

/// The built-in lessons in the order of a lecture.
pub fn cards() -> &'static [LessonCard] {
    static CARDS: LazyLock<Vec<LessonCard>> =
        LazyLock::new(|| BUILT_IN_LESSONS.iter().filter_map(|(name, text)| LessonCard::read(name, text)).collect());
    &CARDS
}

/// Name and title of each lesson.
pub fn lesson_titles() -> &'static [(&'static str, String)] {
    static TITLES: LazyLock<Vec<(&str, String)>> =
        LazyLock::new(|| cards().iter().map(|card| (card.name, card.title.clone())).collect());
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
