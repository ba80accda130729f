//! Takes a new run to a section of a sweep by the same steps that the sweep took, a bounded share of each frame.

use super::player::Player;
use crate::analysis::section::Schedule;
use crate::analysis::swept::SweptPoint;
use crate::analysis::task::SceneSource;

/// One point on the way: what is set there and where its steps end.
#[derive(Clone, Debug, PartialEq)]
struct Leg {
    settings: Vec<(String, String)>,
    schedule: Schedule,
}

/// A section of a sweep, and the way there.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// The scene as the run starts.
    pub scene: SceneSource,
    legs: Vec<Leg>,
    next: usize,
    total: f64,
}

/// How a load ended.
pub type Arrival = Result<(), String>;

impl Load {
    /// The way to section `section` (discarded ones included) of the point `index` of a sweep over `scene` with so many
    /// `periods` at each point. `None` where a point on the way is missing.
    pub fn new<'a>(
        scene: &SceneSource,
        points: impl Fn(usize) -> Option<&'a SweptPoint>,
        index: usize,
        section: usize,
        periods: usize,
    ) -> Option<Self> {
        let leg = |point: &SweptPoint, sections| Leg {
            settings: point.settings.clone(),
            schedule: Schedule {
                first: point.first,
                interval: point.interval,
                sections,
                discard: 0,
            },
        };
        let mut point = points(index)?;
        let mut legs = vec![leg(point, section + 1)];
        while let Some(before) = point.after {
            point = points(before)?;
            legs.push(leg(point, periods));
        }
        legs.reverse();
        let mut scene = scene.clone();
        // The first point is where the run starts.
        scene.changes.append(&mut legs[0].settings);
        let last = legs.last()?.schedule;
        Some(Self {
            scene,
            total: last.time(last.sections.saturating_sub(1)),
            legs,
            next: 0,
        })
    }

    /// Part of the way that lies behind, 0 to 1.
    pub fn fraction(&self, player: &Player) -> f32 {
        (player.simulation().time() / self.total).clamp(0.0, 1.0) as f32
    }

    /// Goes on while `may_step`; how it ended once it is there.
    pub fn advance(
        &mut self,
        player: &mut Player,
        mut may_step: impl FnMut() -> bool,
    ) -> Option<Arrival> {
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
            if !player.replay_step() {
                let why = player.stopped().map(ToString::to_string);
                return Some(Err(why.unwrap_or_default()));
            }
        }
    }
}
