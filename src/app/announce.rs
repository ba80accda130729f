//! Spoken descriptions of the mechanism's state, for users who cannot see the picture.

use super::player::Player;
use super::value;
use crate::simulate::ContactMode;
use crate::units::format_quantity_digits;

/// Least time between two reports without an event, s.
const MIN_INTERVAL: f64 = 1.0;
/// Most joints reported individually; beyond that, only counts are reported.
const MAX_JOINTS: usize = 6;

/// Reports about once a second, and immediately after an event.
#[derive(Debug, Default)]
pub struct Announcer {
    text: String,
    /// The report without impacts.
    text_without_impacts: String,
    /// A change of this text is an event.
    event_key: String,
    /// What the lesson said in the latest report that included it: it is said once.
    lesson: String,
    reported: f64,
    /// Whether the latest report is about an event.
    event: bool,
    /// Strongest impact since the last report: joint, N, s.
    strongest: Option<(usize, f64, f64)>,
}

impl Announcer {
    /// The latest report.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether an event caused the latest report, rather than elapsed time.
    pub fn is_event(&self) -> bool {
        self.event
    }

    /// Records the impacts of a frame.
    pub fn observe(&mut self, player: &Player) {
        for (joint, peak) in player.peaks().iter().enumerate() {
            if peak.normal > self.strongest.map_or(0.0, |(_, force, _)| force) {
                self.strongest = Some((joint, peak.normal, peak.time));
            }
        }
    }

    /// Makes a report at `now`, s of viewing, if one is due. Returns whether it did, and the time until the next check if a
    /// report is due later. `news` is the application's own message, `lesson` that of the lesson in progress.
    pub fn update(&mut self, now: f64, player: &Player, news: &str, lesson: &str) -> (bool, Option<f64>) {
        let event_key =
            format!("{} {} {} {news}", player.running().name, player.is_playing(), player.stopped().is_some());
        let teaches = lesson != self.lesson;
        let event = event_key != self.event_key || teaches;
        let text_without_impacts = sentences(player, news, None);
        if !teaches && text_without_impacts == self.text_without_impacts && self.strongest.is_none() {
            return (false, None);
        }
        let wait = self.reported + MIN_INTERVAL - now;
        if !event && wait > 0.0 {
            return (false, Some(wait));
        }
        (self.event_key, self.event) = (event_key, event);
        self.text = sentences(player, news, self.strongest);
        if teaches && !lesson.is_empty() {
            self.text = format!("{lesson} {}", self.text);
        }
        lesson.clone_into(&mut self.lesson);
        self.text_without_impacts = text_without_impacts;
        self.reported = now;
        self.strongest = None;
        (true, None)
    }
}

fn sentences(player: &Player, news: &str, strongest: Option<(usize, f64, f64)>) -> String {
    let scene = player.running();
    let mut parts = Vec::new();
    if !news.is_empty() {
        parts.push(format!("{}.", news.trim_end_matches('.')));
    }
    parts.push(format!("{}.", scene.title));
    let time = duration(player.pacer.shown());
    parts.push(if let Some(stopped) = player.stopped() {
        format!("The run has stopped at {time}: {}.", stopped.fault)
    } else if player.is_playing() {
        let scale = value::time_scale(player.pacer.scale());
        format!("Running at time scale {scale}, {time}.")
    } else {
        format!("Paused at {time}.")
    });
    parts.extend(joints(player));
    if let Some((joint, force, time)) = strongest
        && let Some(joint) = scene.machine.loose_joints.get(joint)
    {
        parts.push(format!(
            "Largest normal force since the last report: {} at {}, at {}.",
            newtons(force),
            joint.name,
            duration(time)
        ));
    }
    parts.join(" ")
}

fn joints(player: &Player) -> Option<String> {
    let scene = player.running();
    let settled = player.has_settled();
    let reports = &player.frame().joints;
    if reports.is_empty() {
        return None;
    }
    if reports.len() > MAX_JOINTS {
        let free = reports.iter().filter(|joint| joint.state == ContactMode::Free);
        let free = free.count();
        return Some(format!(
            "Of {} {} {free} are free and {} in contact.",
            reports.len(),
            value::joints(&scene.machine),
            reports.len() - free
        ));
    }
    let each: Vec<String> = scene
        .machine
        .loose_joints
        .iter()
        .zip(reports)
        .enumerate()
        .map(|(index, (joint, report))| {
            // Where, of several places, and how it lies.
            let names = joint.kind.site_names().iter().zip(player.frame().sites_of(index));
            let places: Vec<&str> = names.filter(|(_, site)| site.gap < 0.0).map(|(name, _)| *name).collect();
            let at = if places.is_empty() { String::new() } else { format!(" at {}", places.join(" and ")) };
            let tilt = match joint.kind.site_names() {
                [] => String::new(),
                _ => format!(", tilt {} degrees", format_quantity_digits(report.tilt.to_degrees(), "", 2)),
            };
            let force = newtons(report.normal_force.norm());
            let name = &joint.name;
            match report.state {
                ContactMode::Free => format!("{name} free{tilt}"),
                ContactMode::Ideal => format!("{name} ideal, {force}"),
                _ if settled => format!("{name} settled{at}{tilt}, {force}"),
                ContactMode::Creep => format!("{name} in contact{at}, creeping{tilt}, {force}"),
                ContactMode::Slip => format!("{name} in contact{at}, sliding{tilt}, {force}"),
                ContactMode::Stick => format!("{name} in contact{at}, sticking{tilt}, {force}"),
            }
        })
        .collect();
    Some(format!("{}.", each.join("; ")))
}

fn newtons(force: f64) -> String {
    format!("{} newtons", format_quantity_digits(force, "", 3))
}

fn duration(seconds: f64) -> String {
    if seconds == 0.0 {
        "the start".to_owned()
    } else if seconds >= 1.0 {
        format!("{seconds:.2} seconds")
    } else if seconds >= 1e-3 {
        format!("{:.2} milliseconds", seconds * 1e3)
    } else {
        format!("{:.1} microseconds", seconds * 1e6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn player(scene: &str) -> Player {
        Player::new(&Scene::load(scene, &[]).expect("built in")).expect("starts")
    }

    #[test]
    fn a_report_states_the_activity_and_the_strongest_impact() {
        let mut player = player("pendulum");
        let mut announcer = Announcer::default();
        assert_eq!(announcer.update(0.0, &player, "", ""), (true, None));
        assert_eq!(announcer.text(), "Pendulum on a ball joint. Paused at the start. S1 free.");
        player.pacer.set_scale(0.02);
        player.set_playing(true);
        assert!(announcer.update(0.1, &player, "", "").0, "at once");
        assert!(announcer.is_event());
        assert!(announcer.text().contains("Running at time scale 1:50"));
        let (mut reports, mut hit) = (0, false);
        for frame in 0..120 {
            player.advance(1.0 / 60.0);
            announcer.observe(&player);
            let now = 0.1 + f64::from(frame) / 60.0;
            if announcer.update(now, &player, "", "").0 {
                reports += 1;
                hit |= announcer.text().contains("Largest normal force since");
            }
        }
        assert!((1..=2).contains(&reports), "{reports} in two seconds");
        assert!(!announcer.is_event());
        assert!(hit, "{}", announcer.text());
        player.set_playing(false);
        assert!(announcer.update(2.2, &player, "", "").0);
        assert!(!announcer.update(9.0, &player, "", "").0, "nothing new");
        player.single_step();
        let (announced, wait) = announcer.update(2.3, &player, "", "");
        assert!(!announced && wait.is_some_and(|wait| wait > 0.8));
        assert!(announcer.update(3.3, &player, "", "").0);
        assert!(announcer.update(3.4, &player, "Link copied", "").0);
        assert!(announcer.text().starts_with("Link copied. Pendulum"));
        // What a lesson says is said at once, and once.
        assert!(announcer.update(3.5, &player, "", "Answer: It falls freely.").0 && announcer.is_event());
        assert!(announcer.text().starts_with("Answer: It falls freely. Pendulum"), "{}", announcer.text());
        player.single_step();
        assert!(announcer.update(5.0, &player, "", "Answer: It falls freely.").0);
        assert!(announcer.text().starts_with("Pendulum"), "{}", announcer.text());
    }

    #[test]
    fn settled_joints_and_long_chains_are_reported_briefly() {
        let mut rests = player("spcmm");
        rests.pacer.set_scale(1.0);
        rests.set_playing(true);
        for _ in 0..40 {
            rests.advance(1.0 / 60.0);
        }
        // A frame on a slow machine may fall short of its target time.
        while !rests.has_settled() {
            rests.advance(1.0 / 60.0);
        }
        let mut announcer = Announcer::default();
        announcer.update(0.0, &rests, "", "");
        let text = announcer.text();
        assert!(text.contains("S1 settled, ") && text.contains(" newtons"), "{text}");
        let mut announcer = Announcer::default();
        announcer.update(0.0, &player("chain"), "", "");
        let all_free = "Of 8 ball joints 8 are free and 0 in contact.";
        assert!(announcer.text().ends_with(all_free), "{}", announcer.text());
    }

    #[test]
    fn of_a_pin_the_ends_that_touch_and_its_tilt_are_told() {
        let scene = Scene::load("thrown-pin", &[]).expect("a scene");
        let mut player = Player::new(&scene).expect("starts");
        let mut told = [false; 3];
        for _ in 0..600 {
            player.single_step();
            let text = joints(&player).expect("a joint");
            let touches = |place: usize| player.frame().sites[place].gap < 0.0;
            let expected = match [touches(0), touches(1)] {
                [true, true] => "J in contact at a and b",
                [true, false] => "J in contact at a,",
                [false, true] => "J in contact at b,",
                [false, false] => continue,
            };
            // At the very onset.
            if player.frame().joints[0].state == ContactMode::Free {
                continue;
            }
            assert!(touches(2) || touches(3) || text.starts_with(expected), "{text}");
            assert!(text.contains(", tilt ") && text.contains(" degrees, "), "{text}");
            told[usize::from(touches(0)) + 2 * usize::from(touches(1)) - 1] = true;
        }
        assert!(told[0] && told[1], "{told:?}");
    }
}
