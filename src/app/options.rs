//! Start options of the application.

use std::sync::Arc;

use eframe::egui::ThemePreference;

use super::host::{self, Clock};
use super::{Embedded, Lesson, Link, link, opening, theme};
use crate::scene::{DEFAULT_SCENE, Scene};
use crate::simulate::Simulation;
use crate::view::ViewOptions;

/// Start options of the application.
#[derive(Clone, Debug)]
pub struct AppOptions {
    /// The scene to show.
    pub scene: Scene,
    /// Theme: light, dark or system.
    pub theme: ThemePreference,
    /// Whether the run plays from the start.
    pub playing: bool,
    /// Simulated seconds per second.
    pub time_scale: f64,
    /// View options.
    pub view: ViewOptions,
    /// The link that `scene` comes from; its state is reproduced.
    pub link: Option<Link>,
    /// The lesson of the scene, and its step, counted from 0.
    pub lesson: Option<(Arc<Lesson>, usize)>,
    /// Whether the window begins with one ball from close up, for somebody who comes for the first time.
    pub visit: bool,
    /// Panels of an embedded window; `None` for a stand-alone window.
    pub embedded: Option<Embedded>,
    /// A message to show at once, e.g. why a link could not be opened.
    pub problem: Option<String>,
    /// Reduced motion: starts paused and without flashes, whatever the other options.
    pub calm: bool,
    /// High contrast: texts and edges in black and white.
    pub contrast: bool,
    /// Clock that measures the stepping time of a frame.
    pub clock: Clock,
}

impl AppOptions {
    /// Plays `scene` at its own time scale, with the play magnified enough to be visible.
    pub fn new(scene: Scene) -> Self {
        Self {
            time_scale: opening::time_scale(&scene),
            scene,
            theme: ThemePreference::System,
            playing: true,
            view: ViewOptions { magnification: 20.0, ..ViewOptions::default() },
            link: None,
            lesson: None,
            visit: false,
            embedded: None,
            problem: None,
            calm: false,
            contrast: false,
            clock: host::wall,
        }
    }

    /// Plays the default scene.
    pub fn default_scene() -> Self {
        Self::new(Scene::load(DEFAULT_SCENE, &[]).expect("built-in scenes are right"))
    }

    /// The first visit, in the default scene.
    pub fn first() -> Self {
        Self { visit: true, ..Self::default_scene() }
    }

    /// Starts `lesson` at step `step`, counted from 0.
    pub fn for_lesson(lesson: Arc<Lesson>, step: usize) -> Self {
        Self { playing: false, lesson: Some((lesson.clone(), step)), ..Self::new(lesson.runs[0].scene.clone()) }
    }

    /// Reads a link: a URL, a query (`?…`), a fragment (`#…`) or bare pairs. A link without settings for a run gives the same as
    /// [`Self::first`].
    ///
    /// # Errors
    /// The link cannot be read, or its scene is invalid or fails to start; as a message.
    pub fn from_link(text: &str) -> Result<Self, String> {
        let link = Link::parse(text).map_err(|error| error.to_string())?;
        let lesson = link.lesson.as_deref().map(Lesson::built_in).transpose();
        let lesson = lesson.map_err(|error| format!("link: {error}"))?;
        let lesson = lesson.map(|lesson| (lesson, link.step.unwrap_or(1) - 1));
        if let Some((lesson, step)) = lesson.as_ref().filter(|(lesson, step)| *step >= lesson.steps.len()) {
            return Err(format!("link: step = {}: allowed 1 to {}", step + 1, lesson.steps.len()));
        }
        if let Some((lesson, step)) = &lesson
            && !link.has_instant()
            && link.log.base.is_empty()
        {
            return Ok(Self {
                theme: link.theme.map_or(ThemePreference::System, theme::preference),
                embedded: link.embedded.clone(),
                ..Self::for_lesson(lesson.clone(), *step)
            });
        }
        if link.requests_nothing(text) {
            let theme = link.theme.map_or(ThemePreference::System, theme::preference);
            let visit = link.embedded.is_none();
            return Ok(Self { theme, visit, embedded: link.embedded, ..Self::default_scene() });
        }
        let scene = link.load().map_err(|error| format!("link: {error}"))?;
        Simulation::new(&scene.machine).map_err(|error| format!("link: {}", scene.locate(&error)))?;
        link.followed_part(&scene).map_err(|error| error.to_string())?;
        link.microscope_joint(&scene).map_err(|error| error.to_string())?;
        let mut options = Self::new(scene);
        options.lesson = lesson;
        options.embedded.clone_from(&link.embedded);
        options.playing = link.playing.unwrap_or(!link.has_instant());
        if let Some(scale) = link.time_scale {
            options.time_scale = scale;
        }
        if let Some(magnification) = link.magnification {
            options.view.magnification = magnification;
        }
        if let Some(theme) = link.theme {
            options.theme = theme::preference(theme);
        }
        options.link = Some(link);
        Ok(options)
    }

    /// As [`Self::from_link`], but a bad link gives the default scene, paused, in the panels requested by the link, with the
    /// reason as [`Self::problem`].
    pub fn from_link_or_default(text: &str) -> Self {
        Self::from_link(text).unwrap_or_else(|problem| {
            let embedded = link::requested_panels(text);
            Self { problem: Some(problem), playing: false, embedded, ..Self::default_scene() }
        })
    }
}
