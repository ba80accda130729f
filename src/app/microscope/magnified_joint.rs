//! State of one joint with play for the microscope, read from the displayed instant and the record. No force is computed here.

use std::fmt::Write as _;

use super::draw;
use crate::app::paths::axes_of;
use crate::app::player::Player;
use crate::app::value;
use crate::contact::ElasticLaw;
use crate::machine::{Attachment, LooseKind, Mat3, Vec3};
use crate::simulate::{ContactMode, Frame, Impact, JointReport, SiteReport, WornWall};

/// Number of impacts covered by the path.
pub const IMPACTS: usize = 6;

/// One joint with play at the displayed instant. SI units, world axes; what is said of a ball holds for a pin and a block, too.
pub struct MagnifiedJoint {
    pub name: String,
    pub kind: LooseKind,
    /// Places where it can touch, with their names, if there are several.
    pub places: Vec<(String, SiteReport)>,
    /// Axes of the frames of the carrier and of the carried part as columns.
    pub axes: [Mat3; 2],
    /// Whether it touches, and where it does is known.
    pub touches: bool,
    /// Joint report of the step.
    pub report: JointReport,
    /// Axes of the socket's body as columns.
    pub carrier: Mat3,
    /// Walls that wear by direction.
    pub walls: Vec<WornWall>,
    /// n = e/|e| (8), or where a worn wall presses, against its force; `None` where the centres coincide.
    pub normal: Option<Vec3>,
    /// Velocity of the ball's centre relative to the socket's, de/dt, m/s.
    pub velocity: Vec3,
    /// Sliding velocity of a ball as used by the friction law, m/s; `None` out of contact, and of other parts.
    pub sliding: Option<Vec3>,
    /// Geometry of the contact; `None` in an ideal joint, and in one with several places.
    pub patch: Option<ContactPatch>,
    /// The latest impact whose end is known.
    pub impact: Option<Impact>,
    /// Start of the path shown, s.
    pub since: f64,
}

/// Ball and wall near the contact point: the gap grows as x²/(2 R) from there, where R is the effective radius.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPatch {
    /// R = (r + c) r / c, m: 1/R is the difference of both curvatures.
    pub effective_radius: f64,
    /// Penetration delta, m; negative for a gap.
    pub penetration: f64,
    /// Deepest penetration of the latest impact, m; 0 without one.
    pub deepest: f64,
    /// Radius of the elastic contact patch, m; `None` out of contact.
    pub radius: Option<f64>,
}

/// Velocity of an attachment point, m/s; zero for the world.
fn velocity_of(frame: &Frame, at: &Attachment) -> Vec3 {
    let motion = at.body.and_then(|body| frame.bodies.get(body));
    motion.map_or_else(Vec3::zeros, |motion| {
        motion.velocity + motion.angular_velocity.cross(&(motion.rotation * at.point))
    })
}

impl MagnifiedJoint {
    /// State of joint `joint`; `None` if the scene has no such joint.
    pub fn of(player: &Player, joint: usize) -> Option<Self> {
        let (frame, shown) = (player.frame(), player.pacer.shown());
        let spec = player.running().machine.loose_joints.get(joint)?;
        let report = *frame.joints.get(joint)?;
        let distance = report.eccentricity.norm();
        let ideal = report.state == ContactMode::Ideal;
        let walls: Vec<_> = frame.worn_walls.iter().filter(|wall| wall.joint == joint).cloned().collect();
        let force = report.normal_force.norm();
        let presses = force > 0.0 && !walls.is_empty();
        let normal = if presses { report.normal_force / -force } else { report.eccentricity / distance };
        let normal = (distance > 0.0 && !ideal).then_some(normal);
        let velocity = velocity_of(frame, &spec.carried()) - velocity_of(frame, &spec.carrier());
        let touches = report.state.touches();
        let slides = touches && normal.is_some() && spec.kind == LooseKind::Ball;
        let sliding = slides.then_some(report.sliding.velocity);
        let mut impacts = player.impact_record().latest(Some(joint), shown);
        let impact = impacts.next().copied();
        let first = impacts.nth(IMPACTS - 2);
        let since = first.map_or(f64::NEG_INFINITY, |impact| impact.start);
        let (radius, clearance) = (spec.contact.ball_radius, report.clearance);
        let places = frame.sites_of(joint).iter().enumerate();
        let places: Vec<_> = places.map(|(place, site)| (spec.site_name(place as u8), *site)).collect();
        let patch = (!ideal && clearance > 0.0 && places.is_empty()).then(|| ContactPatch {
            effective_radius: ElasticLaw::effective_radius(radius, clearance),
            penetration: report.penetration,
            radius: ElasticLaw::of_joint(&spec.contact, clearance).patch(radius, clearance, report.penetration),
            deepest: impact.map_or(0.0, |impact| impact.deepest),
        });
        Some(Self {
            name: spec.name.clone(),
            kind: spec.kind,
            places,
            axes: spec.frames.map(|own| frame.axes_of(&own)),
            touches: touches && normal.is_some(),
            carrier: axes_of(frame, spec.carrier().body),
            walls,
            report,
            normal,
            velocity,
            sliding,
            patch,
            impact,
            since,
        })
    }

    /// Where the centre of the part is, from the middle of the wall at place `place`, m, when it touches that with the normal `normal`.
    pub fn limit(&self, place: usize, normal: &Vec3) -> Vec3 {
        let clearance = self.report.clearance;
        self.wall(place)
            .map_or(normal * clearance, |wall| self.carrier * wall.limit(&self.carrier.tr_mul(normal), clearance))
    }

    /// The wall at place `place`, if it wears by direction.
    pub fn wall(&self, place: usize) -> Option<&WornWall> {
        self.walls.iter().find(|wall| usize::from(wall.place) == place)
    }

    /// Whether it can tilt.
    pub fn tilts(&self) -> bool {
        !self.places.is_empty()
    }

    /// Whether it touches at one place, of which a section can be drawn.
    pub fn has_section(&self) -> bool {
        self.places.is_empty()
    }

    /// Penetration where it is deepest, m, negative for a gap; `None` in an ideal joint.
    pub fn penetration(&self) -> Option<f64> {
        (self.patch.is_some() || self.tilts() && self.report.state != ContactMode::Ideal)
            .then_some(self.report.penetration)
    }

    /// The play in a sentence or two.
    pub fn in_words(&self) -> String {
        let Self { name, report, .. } = self;

        let [off, play] = [report.eccentricity.norm(), report.clearance].map(|length| draw::length(length, 3));
        let [part, wall] = self.kind.parts();
        let state = value::contact(report.state, part);
        let mean = draw::length(report.worn[0], 3);
        let worn = if self.walls.is_empty() { String::new() } else { format!(", worn by {mean} on average") };
        if self.kind == LooseKind::Ball {
            return format!(
                "Ball joint {name} under the microscope. {state}. Ball's centre {off} from the socket's, clearance {play}{worn}."
            );
        }
        let title = if matches!(self.kind, LooseKind::Pin(_)) { "Pin" } else { "Slide" };
        let mut words = format!("{title} {name} under the microscope. {state}. ");
        let _ = write!(words, "Middle of the {part} {off} off the {wall}'s axis, clearance {play}{worn}");
        if self.tilts() {
            let (tilt, axial) = (value::quantity(report.tilt, "deg", 3), draw::length(report.axial, 3));
            let _ = write!(words, ", tilt {tilt}, axial position {axial}");
        }
        let touching: Vec<&str> =
            self.places.iter().filter(|(_, site)| site.gap < 0.0).map(|(name, _)| name.as_str()).collect();
        if !touching.is_empty() {
            let _ = write!(words, "; it touches at {}", touching.join(", "));
        }
        words + "."
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn player(scene: &str, changes: &[(&str, &str)]) -> Player {
        let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let changes: Vec<(String, String)> = changes.iter().map(own).collect();
        let scene = Scene::load(scene, &changes).expect("built in");
        Player::new(&scene).expect("starts")
    }

    #[test]
    fn a_worn_wall_is_drawn_where_it_is_touched() {
        let profile = [("contact.wear_shape", "profile"), ("contact.friction_law", "modified-coulomb")];
        let wear = |coefficient| [profile[0], profile[1], ("contact.wear_coefficient", coefficient)];
        for (scene, changes, steps) in [("pendulum", wear("1e-7 m^2/N"), 3000), ("worn-pin", wear("2e-7 m^2/N"), 1200)]
        {
            let mut player = player(scene, &changes);
            let (mut touched, mut deepest) = (0, 0.0_f64);
            for _ in 0..steps {
                player.single_step();
                let magnified = MagnifiedJoint::of(&player, 0).expect("has a joint");
                let Some(normal) = magnified.normal.filter(|_| magnified.report.normal_force.norm() > 0.0) else {
                    continue;
                };
                // Beyond the drawn wall by the penetration, along the normal. A pin that lies flat is as deep at both ends.
                let beyond = magnified.report.eccentricity - magnified.limit(0, &normal);
                let expected = normal * magnified.report.penetration;
                let tolerance = if scene == "worn-pin" { 2e-9 } else { 1e-12 };
                assert!((beyond - expected).norm() < tolerance, "{scene}: {beyond} {expected}");
                deepest = deepest.max(magnified.limit(0, &normal).norm() / magnified.report.clearance - 1.0);
                touched += 1;
            }
            assert!(touched > 100 && deepest > 0.05, "{scene}: {touched} {deepest}");
        }
    }

    #[test]
    fn the_sliding_velocity_is_that_of_the_friction_law() {
        for velocity in ["centres", "surface"] {
            let mut player = player("pendulum", &[("contact.friction_velocity", velocity)]);
            let mut compared = 0;
            for _ in 0..4000 {
                player.single_step();
                let magnified = MagnifiedJoint::of(&player, 0).expect("has a joint");
                let rate = magnified.normal.map_or(0.0, |normal| normal.dot(&magnified.velocity));
                let reported = magnified.report.penetration_rate;
                assert!((rate - reported).abs() < 1e-12 + 1e-9 * magnified.velocity.norm());
                // The friction law has no sliding velocity where the normal force is clipped to zero.
                let presses = magnified.report.normal_force.norm() > 0.0;
                let Some(sliding) = magnified.sliding.filter(|_| presses) else {
                    continue;
                };
                let read = magnified.report.slip_speed;
                assert!((sliding.norm() - read).abs() < 1e-12 + 1e-9 * read, "{velocity}: {sliding} {read}");
                // Friction opposes sliding; near the threshold speed below which it vanishes, its law is extrapolated.
                let friction = magnified.report.friction_force;
                assert!(read < 1e-5 || friction.dot(&sliding) < 0.0);
                compared += 1;
            }
            assert!(compared > 200, "{velocity}: {compared}");
        }
    }

    #[test]
    fn an_impact_is_shown_once_its_end_is_known_and_not_before_its_onset() {
        let mut player = player("spcmm", &[]);
        let (mut before, mut ends) = (None, Vec::new());
        while ends.len() < 3 {
            player.single_step();
            let magnified = MagnifiedJoint::of(&player, 0).expect("has a joint");
            if let Some(impact) = magnified.impact.filter(|_| magnified.impact != before) {
                assert!(impact.end <= player.pacer.shown() && impact.joint == 0);
                ends.push(impact);
                before = magnified.impact;
            }
        }
        // The first impact of S1 in `physics.md`.
        assert!((ends[0].start - 7.801_422_908e-3).abs() < 1e-6);
        assert!((ends[0].approach_speed - 0.076_909).abs() < 1e-4);
        let expected = ends[0].separation_speed / ends[0].approach_speed;
        assert!((ends[0].achieved() - expected).abs() < 1e-15 && ends[0].requested == 0.9);
        // Going back into an impact shows its recorded outcome.
        player.step_back();
        assert_eq!(MagnifiedJoint::of(&player, 0).expect("has a joint").impact, Some(ends[2]));
        while player.pacer.shown() >= ends[2].start {
            player.step_back();
        }
        let magnified = MagnifiedJoint::of(&player, 0).expect("has a joint");
        assert_eq!(magnified.impact, Some(ends[1]));
        assert_eq!(magnified.since, f64::NEG_INFINITY, "fewer than are shown");
    }

    #[test]
    fn an_ideal_joint_has_no_patch() {
        let ideal = player("spcmm", &[("contact.clearance", "0")]);
        let magnified = MagnifiedJoint::of(&ideal, 0).expect("has a joint");
        assert!(magnified.patch.is_none() && magnified.normal.is_none() && magnified.impact.is_none());
    }
}
