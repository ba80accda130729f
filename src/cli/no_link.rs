//! In place of [`super::link`] in a program without the window, which reads no links.

use crate::scene::LiveScene;

/// There is none.
pub enum Way {}

impl Way {
    /// As there.
    pub fn time(&self) -> Option<f64> {
        match *self {}
    }

    /// As there.
    pub fn hash(&self) -> Option<u64> {
        match *self {}
    }

    /// As there.
    pub fn is_there(&self, _simulation: &LiveScene) -> bool {
        match *self {}
    }

    /// As there.
    pub fn step(&mut self, _simulation: &mut LiveScene, _end: Option<f64>) -> Result<(), String> {
        match *self {}
    }

    /// As there.
    pub fn verdict(&self, _simulation: &LiveScene) -> Result<String, String> {
        match *self {}
    }
}
