//! What the address of the page asks for: `?scene=pendulum&c=0.5mm&renderer=webgl`.

use eframe::egui::ThemePreference;

use crate::app::AppOptions;
use crate::scene::{Scene, SceneError};

/// What stands in the address without a word of its own.
const DEFAULT_SCENE: &str = "spcmm";

/// A query of the page's address.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Query {
    /// Built-in scene.
    pub scene: String,
    /// Parameters to change, in order.
    pub changes: Vec<(String, String)>,
    /// Light, dark, or as the system asks.
    pub theme: ThemePreference,
    /// Whether the machine stands still at first.
    pub paused: bool,
}

/// What is wrong with a query.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum QueryError {
    /// No such word.
    #[error(
        "{0}: the address of this page takes scene, renderer, theme, paused, c, and keys of parameters such as contact.friction"
    )]
    Key(String),
    /// A word with a value that it does not take.
    #[error("{key} = {value}: must be one of {allowed}")]
    Value {
        /// The word.
        key: &'static str,
        /// What stood there.
        value: String,
        /// What may stand there.
        allowed: &'static str,
    },
    /// A scene or a parameter.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl Default for Query {
    fn default() -> Self {
        Self {
            scene: DEFAULT_SCENE.to_owned(),
            changes: Vec::new(),
            theme: ThemePreference::System,
            paused: false,
        }
    }
}

impl Query {
    /// Reads decoded pairs of key and value.
    ///
    /// # Errors
    /// A key or value that does not exist. Scene and parameters are checked by [`Self::options`].
    pub fn read<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, QueryError> {
        let mut query = Self::default();
        for (key, value) in pairs {
            match key {
                "scene" => query.scene = value.to_owned(),
                // Chosen before the application starts, by `web/main.js`.
                "renderer" if matches!(value, "webgpu" | "webgl") => {}
                "renderer" => return Err(wrong("renderer", value, "webgpu, webgl")),
                "theme" => {
                    query.theme = match value {
                        "light" => ThemePreference::Light,
                        "dark" => ThemePreference::Dark,
                        "system" => ThemePreference::System,
                        _ => return Err(wrong("theme", value, "light, dark, system")),
                    }
                }
                "paused" => {
                    query.paused = match value {
                        "" | "1" | "true" => true,
                        "0" | "false" => false,
                        _ => return Err(wrong("paused", value, "1, 0")),
                    }
                }
                "c" => query
                    .changes
                    .push(("contact.clearance".to_owned(), value.to_owned())),
                key if key.contains('.') => {
                    query.changes.push((key.to_owned(), value.to_owned()));
                }
                _ => return Err(QueryError::Key(key.to_owned())),
            }
        }
        Ok(query)
    }

    /// How the application starts.
    ///
    /// # Errors
    /// An unknown scene, a bad change.
    pub fn options(&self) -> Result<AppOptions, QueryError> {
        let mut options = AppOptions::new(Scene::load(&self.scene, &self.changes)?);
        options.theme = self.theme;
        options.playing = !self.paused;
        Ok(options)
    }
}

fn wrong(key: &'static str, value: &str, allowed: &'static str) -> QueryError {
    QueryError::Value {
        key,
        value: value.to_owned(),
        allowed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_by_hand_sets_scene_and_parameters() {
        let query = Query::read([
            ("scene", "pendulum"),
            ("c", "0.5mm"),
            ("contact.friction", "0.2"),
            ("renderer", "webgl"),
            ("paused", ""),
        ])
        .expect("good");
        let options = query.options().expect("good");
        assert_eq!(options.scene.name, "pendulum");
        assert_eq!(options.scene.contact.clearance, 0.5e-3);
        assert_eq!(options.scene.contact.friction, 0.2);
        assert!(!options.playing);
        assert_eq!(
            Query::read([])
                .expect("empty")
                .options()
                .expect("starts")
                .scene
                .name,
            "spcmm"
        );
    }

    #[test]
    fn a_bad_address_names_what_is_wrong() {
        let said = |pairs: &[(&str, &str)]| {
            let query = Query::read(pairs.iter().copied());
            let options = query.and_then(|query| query.options());
            options.expect_err("bad").to_string()
        };
        assert!(said(&[("scen", "pendulum")]).contains("scen: "));
        assert!(said(&[("renderer", "opengl")]).contains("renderer = opengl"));
        assert!(said(&[("scene", "pendulun")]).contains("did you mean `pendulum`"));
        assert!(said(&[("c", "0.5")]).contains("contact.clearance"));
        assert!(said(&[("contact.frction", "0.5")]).contains("contact.friction"));
    }
}
