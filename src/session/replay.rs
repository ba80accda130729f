//! Replays a run to the instant of a link, within a time budget per frame, and verifies the state.

use super::goal::Obstacle;
use super::link::Link;
use super::player::Player;

/// The outcome of a link.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Verdict {
    /// The state has the hash of the link.
    #[error("State reproduced: hash {0:016x} agrees")]
    Agrees(u64),
    /// The state has another hash.
    #[error(
        "State differs: hash {found:016x}, the link says {expected:016x}. It was made by {}, this is {}",
        .version.as_ref().map_or("another version".to_owned(), |version| format!("version {version}")),
        crate::VERSION
    )]
    Differs {
        /// Hash of the link.
        expected: u64,
        /// Hash of the state.
        found: u64,
        /// Version of the program that made the link.
        version: Option<String>,
    },
    /// The instant is reached; the link has no hash to compare with.
    #[error("State of the link reached; it has no hash to compare with")]
    Reached,
    /// The instant could not be reached, for this reason.
    #[error("State of the link not reproduced: {0}")]
    Failed(String),
}

impl Verdict {
    /// Compares the hash `found` of the state at the instant of `link` with that of the link.
    pub fn of(link: &Link, found: u64) -> Self {
        match link.hash {
            None => Self::Reached,
            Some(expected) if expected == found => Self::Agrees(found),
            Some(expected) => Self::Differs { expected, found, version: link.version.clone() },
        }
    }
}

/// A link that is being replayed.
#[derive(Debug)]
pub struct Replay {
    link: Link,
}

impl Replay {
    /// A replay to the instant of `link` by `player`, which is at its start; `None` if the link names no instant.
    pub fn new(link: Link, player: &mut Player) -> Option<Self> {
        link.has_instant().then(|| {
            player.queue(link.log.entries.iter().cloned());
            Self { link }
        })
    }

    /// The link.
    pub fn link(&self) -> &Link {
        &self.link
    }

    /// Fraction of the way completed, 0 to 1.
    pub fn fraction(&self, player: &Player) -> f32 {
        let fraction = match (self.link.steps, self.link.time) {
            (Some(steps), _) if steps > 0 => player.steps() as f64 / steps as f64,
            (None, Some(time)) if time > 0.0 => player.simulation().time() / time,
            _ => 1.0,
        };
        fraction.clamp(0.0, 1.0) as f32
    }

    /// Continues while `may_step` allows it; returns the verdict once the instant is reached.
    pub fn advance(&self, player: &mut Player, may_step: impl FnMut() -> bool) -> Option<Verdict> {
        match player.continue_to(self.link.goal(), may_step) {
            Ok(true) => {
                player.set_playing(self.link.playing == Some(true));
                Some(Verdict::of(&self.link, player.simulation().state_hash()))
            }
            Ok(false) => None,
            Err(Obstacle::Stopped(_)) if self.link.steps.is_none() => Some(Verdict::Reached),
            Err(Obstacle::Stopped(_)) => {
                Some(Verdict::Failed("the run stopped before the instant of the link".to_owned()))
            }
            Err(obstacle) => Some(Verdict::Failed(obstacle.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::session::link::SceneText;
    use crate::session::log::{Event, Log};

    fn player(scene: &str) -> Player {
        Player::new(&Scene::load(scene, &[]).expect("built in")).expect("starts")
    }

    /// A link to the state of `player`, encoded and parsed again.
    fn link_to(player: &Player) -> Link {
        let link = Link {
            scene: SceneText::of(player.running()),
            log: player.log(),
            steps: Some(player.steps()),
            time: Some(player.pacer.shown()),
            hash: Some(player.simulation().state_hash()),
            ..Link::default()
        };
        Link::parse(&link.format()).expect("a link")
    }

    /// Replays `link` in chunks of `chunk_steps` steps.
    fn follow(link: Link, chunk_steps: u32) -> (Player, Verdict, u32) {
        let mut player = Player::new(&link.load().expect("loads")).expect("starts");
        let replay = Replay::new(link, &mut player).expect("an instant");
        for chunks in 1.. {
            let mut left = chunk_steps;
            let verdict = replay.advance(&mut player, || {
                left = left.saturating_sub(1);
                left > 0
            });
            if let Some(verdict) = verdict {
                return (player, verdict, chunks);
            }
            assert!((0.0..1.0).contains(&replay.fraction(&player)));
        }
        unreachable!()
    }

    fn assert_reproduced(player: &Player) {
        let link = link_to(player);
        let (copy, verdict, chunks) = follow(link, 50);
        assert_eq!(verdict, Verdict::Agrees(player.simulation().state_hash()));
        assert_eq!(copy.log(), player.log(), "the copy's own link is the same");
        assert_eq!(copy.pacer.shown().to_bits(), player.pacer.shown().to_bits());
        assert!(chunks > 1, "in more than one frame");
    }

    #[test]
    fn live_changes_of_every_kind_are_reproduced_bit_by_bit() {
        for scene in ["spcmm", "pendulum", "slider-crank"] {
            let mut original = player(scene);
            original.set("contact.friction", "0.3").expect("in range");
            original.pacer.set_scale(0.5);
            original.set_playing(true);
            let play = |original: &mut Player, frames: usize| {
                for _ in 0..frames {
                    original.advance(1.0 / 60.0);
                }
            };
            play(&mut original, 4);
            // Smaller than the ball's eccentricity: the wall closes in over many steps.
            original.set("contact.clearance", "0.1 mm").expect("in range");
            play(&mut original, 3);
            let joint = original.running().machine.loose_joints[0].name.clone();
            let joint_key = format!("joint.{joint}.clearance");
            original.set(&joint_key, "0.4 mm").expect("in range");
            original.set_playing(false);
            for _ in 0..9 {
                original.single_step();
            }
            original.step_back();
            original.step_back();
            original.set("solver.preset", "real-time").expect("a preset");
            original.set("solver.method", "radau5").expect("a method");
            original.set("gravity.y", "2 m/s^2").expect("in range");
            original.set_playing(true);
            play(&mut original, 3);
            original.set("solver.method", "automatic").expect("a method");
            original.set_original("contact.clearance").expect("the value of the file");
            play(&mut original, 5);
            assert!(original.log().entries.len() >= 8);
            assert_reproduced(&original);
            // The change comes at the end of a step whose beginning is displayed.
            original.pacer.set_scale(1e-4);
            original.set_playing(true);
            original.advance(1.0 / 60.0);
            assert!(original.pacer.shown() < original.simulation().time());
            original.set("contact.friction", "0.1").expect("in range");
            assert_reproduced(&original);
        }
    }

    #[test]
    fn live_changes_of_force_elements_are_reproduced_bit_by_bit() {
        let mut original = player("suspension");
        original.run_to(20e-3);
        for (key, value) in [("spring.coil.stiffness", "200 kN/m"), ("spring.damper.damping", "10 kN s/m")] {
            let effect = original.set(key, value).expect("in range");
            assert_eq!(effect, crate::simulate::Effect::Now, "{key}");
            original.run_to(original.simulation().time() + 10e-3);
        }
        // The ground would jump to another phase.
        assert_eq!(original.set("parameter.rate", "3 Hz").expect("in range"), crate::simulate::Effect::AtReset);
        assert!(original.simulation().ledger().expect("on").change_work != 0.0);
        assert_reproduced(&original);
    }

    #[test]
    fn changes_before_a_reset_apply_from_the_start_of_the_next_run() {
        let mut original = player("spcmm");
        original.run_to(5e-3);
        original.set("contact.clearance", "0.5 mm").expect("in range");
        original.set("spcmm.frequency", "0.4 Hz").expect("in range");
        original.run_to(9e-3);
        original.reset().expect("starts");
        assert!(original.log().entries.is_empty());
        assert_eq!(original.log().base.len(), 2);
        original.run_to(40e-3);
        // A change that waits for the next reset is in the link, too.
        original.set("spcmm.frequency", "0.45 Hz").expect("in range");
        assert_reproduced(&original);
        let (copy, ..) = follow(link_to(&original), 50);
        assert!(copy.is_pending("spcmm.frequency"));
    }

    #[test]
    fn a_run_stopped_by_the_guard_stops_again_when_replayed() {
        let mut original = player("spcmm");
        original.set("solver.method", "rk4").expect("a method");
        original.set("solver.step", "1 ms").expect("in range");
        original.run_to(0.5);
        assert!(original.stopped().is_some());
        original.set("solver.step", "10 us").expect("in range");
        let (copy, verdict, _) = follow(link_to(&original), 5);
        assert_eq!(verdict, Verdict::Agrees(original.simulation().state_hash()));
        assert_eq!(copy.stopped(), original.stopped());

        // After stepping back, the refused step leaves no trace.
        let mut original = player("spcmm");
        original.set("solver.method", "rk4").expect("a method");
        original.set("solver.step", "1 ms").expect("in range");
        while original.stopped().is_none() {
            original.single_step();
        }
        original.step_back();
        assert!(original.stopped().is_none());
        let log = original.log();
        let events = log.entries.iter().map(|entry| &entry.event);
        assert!(!events.clone().any(|event| *event == Event::Stop));
        assert_eq!(follow(link_to(&original), 5).1, Verdict::Agrees(original.simulation().state_hash()));
    }

    #[test]
    fn a_different_state_or_an_invalid_event_is_reported() {
        let mut original = player("pendulum");
        original.run_to(20e-3);
        let mut link = link_to(&original);
        link.steps = link.steps.map(|steps| steps + 1);
        assert!(matches!(follow(link, 50).1, Verdict::Differs { .. }));

        let mut link = link_to(&original);
        link.log.set(3, "contact.clearance", "0.5 kg");
        let Verdict::Failed(reason) = follow(link, 50).1 else {
            panic!("a mass is not a clearance");
        };
        assert!(reason.contains("wrong unit"), "{reason}");

        for pull in ["3 @7 0 0 0 0 0 0 1 0", "3 @0 0 0 0 1e300 0 0 1 0"] {
            let mut link = link_to(&original);
            link.log = Log::read(Vec::new(), pull).expect("a log");
            let Verdict::Failed(reason) = follow(link, 50).1 else {
                panic!("the pull is out of range: {pull}");
            };
            let reasons = ["body 7 is pulled, of 1", "1000000 m"];
            assert!(reasons.iter().any(|text| reason.contains(text)), "{reason}");
        }

        let mut link = link_to(&original);
        link.log.push(3, Event::Stop);
        assert!(matches!(follow(link, 50).1, Verdict::Failed(_)));
    }

    #[test]
    fn a_link_with_only_a_time_is_reached_and_displayed_exactly() {
        let link = Link::parse("?scene=spcmm&c=0.5mm&t=9.5ms").expect("a link");
        let (player, verdict, _) = follow(link, 5);
        assert_eq!(verdict, Verdict::Reached);
        assert_eq!(player.pacer.shown(), 9.5e-3);
        assert_eq!(player.log(), Log::new(&player.running().changes));
    }
}
