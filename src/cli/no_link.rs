//! Stand-in for [`super::link`] in a program without the window, which reads no links.

use crate::scene::LiveScene;

/// A replay that never exists.
pub enum LinkReplay {}

impl LinkReplay {
    /// Never called.
    pub fn time(&self) -> Option<f64> {
        match *self {}
    }

    /// Never called.
    pub fn hash(&self) -> Option<u64> {
        match *self {}
    }

    /// Never called.
    pub fn is_reached(&self, _simulation: &LiveScene) -> bool {
        match *self {}
    }

    /// Never called.
    pub fn step(&mut self, _simulation: &mut LiveScene, _end: Option<f64>) -> Result<(), String> {
        match *self {}
    }

    /// Never called.
    pub fn verdict(&self, _simulation: &LiveScene) -> Result<String, String> {
        match *self {}
    }
}
