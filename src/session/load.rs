//! Runs a scene to a section of a sweep by the same steps as the sweep, within a time budget per frame.

use std::collections::VecDeque;

use super::goal::Goal;
use super::log::{Entry, Event};
use super::player::Player;
use crate::analysis::section::Schedule;
use crate::analysis::source::SceneSource;
use crate::analysis::sweep_task::SweptPoint;

/// A section of a sweep, and how to reach it.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// The scene as the run starts.
    pub scene: SceneSource,
    /// Keys that the sweep varied.
    varied: Vec<String>,
    /// Remaining legs: the events at the start of each, and its end, s.
    legs: VecDeque<(Vec<Event>, f64)>,
    /// End of the current leg, s, and of the last.
    leg_end: f64,
    end_time: f64,
}

/// How a load ended.
pub type Arrival = Result<(), String>;

impl Load {
    /// Plans the run to section `section` (discarded ones included) of point `index` of a sweep over `scene` with `periods`
    /// periods per point. `None` if a point on the way is missing.
    pub fn new<'a>(
        scene: &SceneSource,
        points: impl Fn(usize) -> Option<&'a SweptPoint>,
        index: usize,
        section: usize,
        periods: usize,
    ) -> Option<Self> {
        let mut chain = vec![points(index)?];
        while let Some(before) = chain[chain.len() - 1].after {
            chain.push(points(before)?);
        }
        // The first point is where the run starts.
        let first = chain[chain.len() - 1].settings.clone();
        let leg = |(at, point): (usize, &&SweptPoint)| {
            let sections = if at == 0 { section + 1 } else { periods };
            let schedule = Schedule { first: point.first, interval: point.interval, sections, discard: 0 };
            let changes = point.settings.iter().filter(|_| at + 1 < chain.len());
            let changes = changes.map(|(key, value)| Event::set(key, value));
            (changes.chain([schedule.into()]).collect(), schedule.time(sections.saturating_sub(1)))
        };
        let legs: VecDeque<_> = chain.iter().enumerate().map(leg).rev().collect();
        let varied = first.iter().map(|(key, _)| key.clone()).collect();
        let mut scene = scene.clone();
        scene.changes.extend(first);
        Some(Self { scene, varied, end_time: legs.back()?.1, legs, leg_end: 0.0 })
    }

    /// Keys that the sweep varied.
    pub fn varied(&self) -> &[String] {
        &self.varied
    }

    /// Fraction of the way completed, 0 to 1.
    pub fn fraction(&self, player: &Player) -> f32 {
        (player.simulation().time() / self.end_time).clamp(0.0, 1.0) as f32
    }

    /// Continues while `may_step` allows it; returns the outcome once the load has ended.
    pub fn advance(&mut self, player: &mut Player, mut may_step: impl FnMut() -> bool) -> Option<Arrival> {
        loop {
            match player.continue_to(Goal::at(self.leg_end), &mut may_step) {
                Ok(true) => {}
                Ok(false) => return None,
                Err(obstacle) => return Some(Err(obstacle.to_string())),
            }
            let Some((events, end)) = self.legs.pop_front() else {
                return Some(Ok(()));
            };
            let steps = player.steps();
            player.queue(events.into_iter().map(|event| Entry { steps, event }));
            self.leg_end = end;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::design::Start;
    use crate::analysis::drive::observed;
    use crate::analysis::sweep_task::{Share, SweepTask};
    use crate::analysis::task::{Job, Message, perform};
    use crate::scene::Scene;
    use std::ops::ControlFlow;

    #[test]
    fn a_followed_point_is_reached_by_the_same_steps() {
        let changes = [("spcmm.frequency".to_owned(), "5 Hz".to_owned())];
        let scene = Scene::load("spcmm", &changes).expect("built in");
        let task = SweepTask {
            scene: SceneSource::of(&scene),
            vary: vec!["contact.clearance=0.2mm..0.4mm:3".to_owned()],
            periods: 3,
            discard: 1,
            phase: 0.25,
            start: Start::FollowDown,
            exponent: false,
        };
        let mut points = vec![None; 3];
        perform(&Job::Sweep(task.clone(), Share::WHOLE), &mut |message| {
            if let Message::Point(point) = message {
                let index = point.index;
                points[index] = Some(*point);
            }
            ControlFlow::Continue(())
        });
        let find = |index: usize| points.get(index)?.as_ref();
        for (index, section) in [(2, 0), (1, 1), (0, 0)] {
            let load = Load::new(&task.scene, find, index, task.discard + section, 3);
            let mut load = load.expect("all points are computed");
            let scene = load.scene.scene().expect("valid settings");
            let mut player = Player::new(&scene).expect("starts");
            let arrival = loop {
                let mut left = 100;
                let arrival = load.advance(&mut player, || {
                    left -= 1;
                    left > 0
                });
                if let Some(arrival) = arrival {
                    break arrival;
                }
            };
            assert_eq!((arrival, load.fraction(&player)), (Ok(()), 1.0));
            let point = find(index).expect("computed");
            let state = observed(&player.frame().pose);
            assert_eq!(state[..6], point.sections[section], "point {index}");
            let clearance = player.pending().machine.contact.clearance;
            assert_eq!(clearance, point.values[0]);
        }
        // A point that was cancelled makes those after it unreachable.
        points[1] = None;
        let find = |index: usize| points.get(index)?.as_ref();
        assert_eq!(Load::new(&task.scene, find, 0, 1, 3), None);
    }
}
