//! Scenes as data: what a mechanism is, its file format, and the one table of its parameters.

mod error;
mod model;
mod parameters;

pub use error::*;
pub use model::*;
pub use parameters::*;

/// Names of the built-in scenes.
pub const BUILT_IN: [&str; 5] = ["spcmm", "pendulum", "slider-crank", "slider-crank-driven", "chain"];

impl Scene {
    /// A built-in scene by name, or a file (contains `/` or ends in `.toml`), with changes applied in order.
    ///
    /// # Errors
    /// Unreadable file, anything wrong in it, or a bad change.
    pub fn load(_argument: &str, _changes: &[(String, String)]) -> Result<Self, SceneError> {
        todo!()
    }

    /// A scene from TOML text; `file` is the name that errors give.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(_text: &str, _file: Option<&str>, _changes: &[(String, String)]) -> Result<Self, SceneError> {
        todo!()
    }

    /// Parameters this scene has, in table order.
    pub fn parameters(&self) -> Vec<&'static Parameter> {
        todo!()
    }

    /// Value of `key` (`joint.<name>.<…>` included).
    ///
    /// # Errors
    /// A key this scene has not, with the nearest right one.
    pub fn get(&self, _key: &str) -> Result<Value, SceneError> {
        todo!()
    }

    /// Changes a parameter in place and records it in `changes`. `chain.links` rebuilds the scene.
    ///
    /// # Errors
    /// Unknown key, wrong unit, out of range, or a scene that would no longer hold together; `self` is then unchanged.
    pub fn set(&mut self, _key: &str, _value: &str) -> Result<&'static Parameter, SceneError> {
        todo!()
    }
}
