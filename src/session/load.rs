//! Runs a scene to a section of a sweep by the same steps as the sweep, within a time budget per frame.

use super::player::Player;
use crate::analysis::section::Schedule;
use crate::analysis::source::SceneSource;
use crate::analysis::sweep_task::SweptPoint;

/// One sweep point on the way: its settings and its step ends.
#[derive(Clone, Debug, PartialEq)]
struct Leg {
    settings: Vec<(String, String)>,
    schedule: Schedule,
}

/// A section of a sweep, and how to reach it.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// The scene as the run starts.
    pub scene: SceneSource,
    /// Keys that the sweep varied.
    varied: Vec<String>,
    legs: Vec<Leg>,
    next: usize,
    total: f64,
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
        let leg = |point: &SweptPoint, sections| Leg {
            settings: point.settings.clone(),
            schedule: Schedule { first: point.first, interval: point.interval, sections, discard: 0 },
        };
        let mut point = points(index)?;
        let mut legs = vec![leg(point, section + 1)];
        while let Some(before) = point.after {
            point = points(before)?;
            legs.push(leg(point, periods));
        }
        legs.reverse();
        let mut scene = scene.clone();
        let varied = legs[0].settings.iter().map(|(key, _)| key.clone()).collect();
        // The first point is where the run starts.
        scene.changes.append(&mut legs[0].settings);
        let last = legs.last()?.schedule;
        Some(Self { scene, varied, total: last.time(last.sections.saturating_sub(1)), legs, next: 0 })
    }

    /// Keys that the sweep varied.
    pub fn varied(&self) -> &[String] {
        &self.varied
    }

    /// Fraction of the way completed, 0 to 1.
    pub fn fraction(&self, player: &Player) -> f32 {
        (player.simulation().time() / self.total).clamp(0.0, 1.0) as f32
    }

    /// Continues while `may_step`; returns how it ended, once there.
    pub fn advance(&mut self, player: &mut Player, mut may_step: impl FnMut() -> bool) -> Option<Arrival> {
        loop {
            if player.sections_to_come() == 0 {
                let Some(leg) = self.legs.get(self.next) else {
                    player.show(player.simulation().time());
                    return Some(Ok(()));
                };
                for (key, value) in &leg.settings {
                    if let Err(error) = player.set(key, value) {
                        return Some(Err(error.to_string()));
                    }
                }
                player.end_steps_at(leg.schedule);
                self.next += 1;
            }
            if !may_step() {
                player.show(player.simulation().time());
                return None;
            }
            if !player.step() {
                let why = player.stopped().map(ToString::to_string);
                return Some(Err(why.unwrap_or_default()));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::drive::observed;
    use crate::analysis::grid::Start;
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
        perform(&Job::Sweep(task.clone(), Share::WHOLE), &mut || 0.0, &mut |message| {
            if let Message::Point(point) = message {
                let index = point.index;
                points[index] = Some(*point);
            }
            ControlFlow::Continue(())
        });
        let find = |index: usize| points.get(index)?.as_ref();
        for (index, kept) in [(2, 0), (1, 1), (0, 0)] {
            let way = Load::new(&task.scene, find, index, task.discard + kept, 3);
            let mut way = way.expect("all came");
            let scene = way.scene.scene().expect("its settings");
            let mut player = Player::new(&scene).expect("starts");
            let arrival = loop {
                let mut left = 100;
                let arrival = way.advance(&mut player, || {
                    left -= 1;
                    left > 0
                });
                if let Some(arrival) = arrival {
                    break arrival;
                }
            };
            assert_eq!((arrival, way.fraction(&player)), (Ok(()), 1.0));
            let point = find(index).expect("came");
            let state = observed(&player.frame().pose);
            assert_eq!(state[..6], point.sections[kept], "point {index}");
            let wanted = player.pending().machine.contact.clearance;
            assert_eq!(wanted, point.values[0]);
        }
        // A point that was cancelled makes those after it unreachable.
        points[1] = None;
        let find = |index: usize| points.get(index)?.as_ref();
        assert_eq!(Load::new(&task.scene, find, 0, 1, 3), None);
    }
}
