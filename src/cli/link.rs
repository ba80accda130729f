//! Runs of a share link. Live changes are replayed after the same steps, so that page and program can compare state hashes.

use std::collections::VecDeque;

use super::Failure;
use crate::analysis::section::Schedule;
use crate::app::{Entry, Event, Link};
use crate::scene::LiveScene;
use crate::scene::Scene;

/// The remaining replay of a link's run.
pub struct Way {
    entries: VecDeque<Entry>,
    /// The scene as parsed from its file.
    original: Scene,
    /// Section instants, at which steps end.
    sections: Option<Schedule>,
    /// End of the run: number of accepted steps, or else a time, s.
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
    /// The replay up to the instant of `link`.
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

    /// Applies the changes due before the next step, then takes that step, which ends at `end`, s, at the latest. Without `end`
    /// the step is not truncated, as in the window, and none is taken once the link's instant is reached.
    ///
    /// # Errors
    /// Text: a rejected change, or a rejected step that was not rejected in the link's run.
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

    /// Whether the link's run also rejected this step.
    fn expects_stop(&mut self, simulation: &LiveScene) -> bool {
        let steps = simulation.statistics().steps;
        self.entries.pop_front_if(|entry| entry.event == Event::Stop && entry.steps == steps).is_some()
    }

    /// Compares the state with the link's, in words; an error if they differ.
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
