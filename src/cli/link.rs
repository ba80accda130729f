//! Runs of a share link: what was done on the way is done again after the same steps, so that page and program compare by the same hash.

use std::collections::VecDeque;

use super::Failure;
use crate::analysis::section::Schedule;
use crate::app::{Entry, Event, Link};
use crate::scene::LiveScene;
use crate::scene::Scene;

/// The rest of a link's run.
pub struct Way {
    entries: VecDeque<Entry>,
    /// The scene as its file gives it.
    original: Scene,
    /// Instants at which steps end.
    sections: Option<Schedule>,
    /// Where it ends: accepted steps, or else an instant, s.
    steps: Option<u64>,
    time: Option<f64>,
    hash: Option<u64>,
    version: Option<String>,
}

/// Reads a link.
///
/// # Errors
/// A link that cannot be read.
pub fn parse(text: &str) -> Result<Link, Failure> {
    Link::parse(text).map_err(|error| Failure::usage(error.to_string()))
}

impl Way {
    /// The way to the instant of `link`.
    ///
    /// # Errors
    /// The link's scene without its changes cannot be read.
    pub fn new(mut link: Link) -> Result<Self, Failure> {
        link.log.base.clear();
        let original = link.load()?;
        let Link { log, steps, time, hash, version, .. } = link;
        Ok(Self { entries: log.entries.into(), original, sections: None, steps, time, hash, version })
    }

    /// The link's instant, s; `None` if it names none.
    pub fn time(&self) -> Option<f64> {
        self.time.or(self.steps.map(|_| 0.0))
    }

    /// Whether `simulation` is at the link's instant.
    pub fn is_there(&self, simulation: &LiveScene) -> bool {
        let there = match (self.steps, self.time) {
            (Some(steps), _) => simulation.statistics().steps >= steps,
            (None, Some(time)) => simulation.time() >= time,
            (None, None) => true,
        };
        there && self.entries.is_empty()
    }

    /// The hash of the state at the link's instant, if the link has one.
    pub fn hash(&self) -> Option<u64> {
        self.hash
    }

    /// Does what was done before the next step, and takes that step, which ends at `end`, s, at the latest; without one it ends
    /// where it will, as in the window. None where the link's instant is reached.
    ///
    /// # Errors
    /// In words: a change that is refused, a step that is refused and was not in the link's run.
    pub fn step(&mut self, simulation: &mut LiveScene, end: Option<f64>) -> Result<(), String> {
        self.do_due(simulation)?;
        if end.is_none() && self.is_there(simulation) {
            return Ok(());
        }
        let section = self.sections.as_ref().map_or(f64::INFINITY, |sections| sections.next(simulation.time()));
        match simulation.step_until(section.min(end.unwrap_or(f64::INFINITY))) {
            Err(stopped) if !self.expects_stop(simulation) => Err(stopped.to_string()),
            _ => Ok(()),
        }
    }

    fn do_due(&mut self, simulation: &mut LiveScene) -> Result<(), String> {
        let steps = simulation.statistics().steps;
        while let Some(entry) = self.entries.pop_front_if(|entry| entry.steps <= steps && entry.event != Event::Stop) {
            self.sections = entry.event.schedule().or(self.sections);
            let done = entry.event.apply(simulation, &self.original);
            done.map_err(|error| format!("the change that the link made after {} steps: {error}", entry.steps))?;
        }
        Ok(())
    }

    /// Whether a refused step was refused in the link's run, too.
    fn expects_stop(&mut self, simulation: &LiveScene) -> bool {
        let steps = simulation.statistics().steps;
        self.entries.pop_front_if(|entry| entry.event == Event::Stop && entry.steps == steps).is_some()
    }

    /// The state compared with the link's, in words; the error if they differ.
    pub fn verdict(&self, simulation: &LiveScene) -> Result<String, String> {
        let found = simulation.state_hash();
        match self.hash {
            None => Ok("the link has no hash to compare with".to_owned()),
            Some(wanted) if wanted == found => Ok(format!("state reproduced: hash {found:016x} agrees")),
            Some(wanted) => {
                let made =
                    self.version.as_deref().map_or("another version".to_owned(), |made| format!("version {made}"));
                Err(format!(
                    "the state hash is {found:016x}, the link says {wanted:016x}; the link was made by {made}, this is {}",
                    crate::VERSION
                ))
            }
        }
    }
}
