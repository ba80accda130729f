//! Runs of a share link. Live changes are replayed after the same steps, so that page and program can compare state hashes.

use super::Failure;
use crate::scene::LiveScene;
use crate::session::goal::Obstacle;
use crate::session::link::Link;
use crate::session::log::{Event, Script};
use crate::session::replay::Verdict;

/// The run of a link, and its position in the link's log. No player shows it: its samples would count among the largest sampled
/// forces of the run.
pub struct LinkedRun {
    link: Link,
    script: Script,
}

/// Reads a link.
///
/// # Errors
/// A link that cannot be read.
pub fn parse(text: &str) -> Result<Link, Failure> {
    Link::parse(text).map_err(|error| Failure::usage(error.to_string()))
}

impl LinkedRun {
    /// The run up to the instant of `link`.
    pub fn new(mut link: Link) -> Self {
        Self { script: Script::new(std::mem::take(&mut link.log)), link }
    }

    /// The link's instant, s; `None` if it names none.
    pub fn time(&self) -> Option<f64> {
        self.link.time.or(self.link.steps.map(|_| 0.0))
    }

    /// Whether `simulation` is at the link's instant.
    pub fn is_reached(&self, simulation: &LiveScene) -> bool {
        self.link.goal().is_reached(simulation) && !self.script.has_more()
    }

    /// The hash of the state at the link's instant, if the link has one.
    pub fn hash(&self) -> Option<u64> {
        self.link.hash
    }

    /// Applies the changes due before the next step, then takes that step, which ends at `end`, s, at the latest. Without `end`
    /// the step is not truncated, as in the window, and none is taken once the link's instant is reached.
    ///
    /// # Errors
    /// A message about a rejected change, or about a step that was rejected only here or only in the link's run.
    pub fn step(&mut self, simulation: &mut LiveScene, end: Option<f64>) -> Result<(), String> {
        let steps = simulation.statistics().steps;
        let applied = self.script.apply_due(simulation);
        applied.map_err(|error| format!("the change that the link made after {steps} steps: {error}"))?;
        if end.is_none() && self.is_reached(simulation) {
            return Ok(());
        }
        let must_stop = self.script.due(steps) == Some(&Event::Stop);
        match self.script.step(simulation, end.unwrap_or(f64::INFINITY)) {
            Ok(()) if must_stop && end.is_none() => Err(Obstacle::MissedStop.to_string()),
            Err(stopped) if !must_stop => Err(stopped.to_string()),
            _ => Ok(()),
        }
    }

    /// Compares the state with the link's. Returns the verdict as text, as an error if the states differ.
    pub fn verdict(&self, simulation: &LiveScene) -> Result<String, String> {
        let verdict = Verdict::of(&self.link, simulation.state_hash());
        let message = verdict.to_string();
        if matches!(verdict, Verdict::Differs { .. }) { Err(message) } else { Ok(message) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_replay_that_misses_a_recorded_stop_ends_with_an_error() {
        let mut link = Link::parse("?scene=pendulum&steps=9").expect("a link");
        link.log.push(3, Event::Stop);
        let mut simulation = crate::cli::start(&link.load().expect("built in")).expect("starts");
        let mut replay = LinkedRun::new(link);
        let outcomes: Vec<_> = (0..9).map(|_| replay.step(&mut simulation, None)).collect();
        assert_eq!(outcomes.iter().position(Result::is_err), Some(3), "{outcomes:?}");
    }
}
