//! The recent friction at the contacts of joints with play, over the displacement of the surfaces: drawn by the microscope.

use super::paths::axes_of;
use crate::machine::{LooseJoint, Mat3, Vec3};
use crate::scene::Scene;
use crate::simulate::{Frame, JointReport, RECORDED_JOINTS, SiteReport};

/// Points stored per joint, for all its places together.
const MAX_POINTS: usize = 4096;
/// A point that differs by less than these parts of the limit of friction and of the contact's largest displacement counts as unmoved.
const FORCE_RESOLUTION: f64 = 0.01;
const DISPLACEMENT_RESOLUTION: f64 = 0.005;

/// A contact at one instant. The components are along two directions across the normal, fixed in the carrier's body on a plane wall; on a
/// curved wall they turn with the normal as little as possible, so that a displacement is a way along the wall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Time, s.
    pub time: f64,
    /// Way of the carried part's surface over the carrier's since the contact began, m; in a contact under way when the record began,
    /// since then.
    pub displacement: [f64; 2],
    /// Friction force on the carried part, N.
    pub friction: [f64; 2],
    /// Sliding velocity, m/s.
    pub velocity: [f64; 2],
    /// Limit of friction, N.
    pub limit: f64,
    /// The normal, and the first of the two directions, in the axes of the carrier's body.
    normal: Vec3,
    direction: Vec3,
    /// Whether the surfaces press. The first point at which they no longer do ends the contact, and is zero.
    presses: bool,
}

/// The larger of the two differences of the components.
fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).abs().max((a[1] - b[1]).abs())
}

/// A direction across the unit vector `normal`: near a coordinate axis.
fn across(normal: &Vec3) -> Vec3 {
    let axis = Vec3::ith(normal.abs().imin(), 1.0);
    (axis - normal * normal.dot(&axis)).normalize()
}

impl Point {
    /// A joint at `time`, s, or one of its places, with the axes of its carrier's body as columns, after `before`.
    fn of(time: f64, (report, site): (&JointReport, Option<&SiteReport>), axes: &Mat3, before: Option<&Self>) -> Self {
        let (depth, force, friction, sliding) = match site {
            Some(site) => (-site.gap, &site.normal_force, &site.friction_force, &site.sliding),
            None => (report.penetration, &report.normal_force, &report.friction_force, &report.sliding),
        };
        let nothing = Self { time, ..Self::default() };
        if depth <= 0.0 {
            return nothing;
        }
        let before = before.filter(|before| before.presses);
        let normal = axes.tr_mul(force).try_normalize(0.0).or(before.map(|before| before.normal));
        let Some(normal) = normal else {
            return nothing;
        };
        let direction = before.map_or_else(
            || across(&normal),
            |Self { normal: old, direction, .. }| {
                // By the smallest rotation from the old normal to the new one.
                let both = old + normal;
                let turned = direction - both * (both.dot(direction) / (1.0 + old.dot(&normal)));
                (turned - normal * normal.dot(&turned)).try_normalize(0.0).unwrap_or_else(|| across(&normal))
            },
        );
        let second = normal.cross(&direction);
        let components = |vector: &Vec3| {
            let own = axes.tr_mul(vector);
            [direction.dot(&own), second.dot(&own)]
        };
        let velocity = components(&sliding.velocity);
        let displacement = before.map_or([0.0; 2], |before| {
            let half = 0.5 * (time - before.time);
            [0, 1].map(|i| before.displacement[i] + half * (before.velocity[i] + velocity[i]))
        });
        Self {
            time,
            displacement,
            friction: components(friction),
            velocity,
            limit: sliding.limit,
            normal,
            direction,
            presses: true,
        }
    }

    /// Whether a curve can leave `self` out beside `other`; `extent` is the largest displacement of the contact, m.
    fn is_close_to(&self, other: &Self, extent: f64) -> bool {
        let limit = FORCE_RESOLUTION * self.limit.max(other.limit);
        distance(self.friction, other.friction) <= limit
            && (self.limit - other.limit).abs() <= limit
            && distance(self.displacement, other.displacement) <= DISPLACEMENT_RESOLUTION * extent
    }
}

/// Friction at the latest contacts of the first [`RECORDED_JOINTS`] joints with play.
#[derive(Clone, Default)]
pub struct FrictionRecord {
    joints: Vec<JointRecord>,
}

#[derive(Clone)]
struct JointRecord {
    /// Body of the carrier.
    carrier: Option<usize>,
    /// By place.
    places: Vec<PlaceRecord>,
}

#[derive(Clone, Default)]
struct PlaceRecord {
    points: Vec<Point>,
    /// Largest displacement of the latest contact, m.
    extent: f64,
}

/// One contact up to an instant.
pub struct Contact<'a> {
    /// The place of the joint.
    pub place: usize,
    /// The recorded points, the oldest first.
    pub points: &'a [Point],
    /// The instant itself; `None` if the contact has ended before.
    pub now: Option<Point>,
}

impl FrictionRecord {
    /// An empty record for `scene`.
    pub fn new(scene: &Scene) -> Self {
        let joints = scene.machine.loose_joints.iter().take(RECORDED_JOINTS);
        let empty = |joint: &LooseJoint| JointRecord {
            carrier: joint.carrier().body,
            places: vec![PlaceRecord::default(); joint.kind.site_names().len().max(1)],
        };
        Self { joints: joints.map(empty).collect() }
    }

    /// Records an instant of the run. An instant before the latest starts a new branch: later points are dropped.
    pub fn record(&mut self, frame: &Frame) {
        for (joint, own) in self.joints.iter_mut().enumerate().take(frame.joints.len()) {
            let most = MAX_POINTS / own.places.len();
            let (report, sites) = (&frame.joints[joint], frame.sites_of(joint));
            let axes = axes_of(frame, own.carrier);
            for (place, record) in own.places.iter_mut().enumerate() {
                let PlaceRecord { points, extent } = record;
                let kept = points.partition_point(|point| point.time <= frame.time);
                if kept < points.len() {
                    points.truncate(kept);
                    let latest = points.iter().rev().take_while(|point| point.presses);
                    *extent = latest.map(|point| distance(point.displacement, [0.0; 2])).fold(0.0, f64::max);
                }
                let last = points.last();
                if last.is_some_and(|last| last.time == frame.time) {
                    continue;
                }
                let point = Point::of(frame.time, (report, sites.get(place)), &axes, last);
                let has_begun = !last.is_some_and(|last| last.presses);
                if has_begun {
                    if !point.presses {
                        continue;
                    }
                    *extent = 0.0;
                }
                *extent = extent.max(distance(point.displacement, [0.0; 2]));
                // The latest instant is always there: the next one replaces it if a curve does not need it.
                if let [.., before, last] = &mut points[..]
                    && before.presses
                    && point.presses
                    && last.is_close_to(before, *extent)
                {
                    *last = point;
                    continue;
                }
                if points.len() == most {
                    // Half at once: shifting all points for each new one would be too costly.
                    points.drain(..most / 2);
                }
                points.push(point);
            }
        }
    }

    /// The contact of joint `joint` in `frame`, of several the one that has lasted longest; in free flight the latest one. `None` if none is
    /// known.
    pub fn contact(&self, joint: usize, frame: &Frame) -> Option<Contact<'_>> {
        let own = self.joints.get(joint).filter(|_| joint < frame.joints.len())?;
        let (report, sites) = (&frame.joints[joint], frame.sites_of(joint));
        let axes = axes_of(frame, own.carrier);
        let contacts = own.places.iter().enumerate().filter_map(|(place, record)| {
            let known = &record.points[..record.points.partition_point(|point| point.time < frame.time)];
            let recorded = record.points.get(known.len()).filter(|point| point.time == frame.time);
            let of_frame = || Point::of(frame.time, (report, sites.get(place)), &axes, known.last());
            let now = recorded.copied().unwrap_or_else(of_frame);
            let end = known.iter().rposition(|point| point.presses).map_or(0, |last| last + 1);
            let is_another = now.presses && end < known.len();
            let start = known[..end].iter().rposition(|point| !point.presses).map_or(0, |before| before + 1);
            let points = if is_another { &[] } else { &known[start..end] };
            let contact = Contact { place, points, now: Some(now).filter(|now| now.presses) };
            (contact.now.is_some() || !points.is_empty()).then_some(contact)
        });
        // A contact under way before one that has ended; then the earlier start, or the later end.
        let order = |contact: &Contact<'_>| match (contact.now, contact.points) {
            (Some(now), points) => (false, points.first().map_or(now.time, |first| first.time)),
            (None, points) => (true, -points.last().map_or(f64::NEG_INFINITY, |last| last.time)),
        };
        contacts.min_by(|a, b| {
            let [a, b] = [a, b].map(order);
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::player::Player;
    use crate::simulate::{Simulation, Sliding};

    /// A block of 1 kg that lies in its guide and is pushed to and fro beyond the limit of friction.
    fn pushed_block(amplitude: f64) -> Scene {
        let text = format!(
            r#"
            [gravity]
            y = "-9.81 m/s^2"
            [contact]
            friction_law = "bristle"
            restitution = 0.5
            [solver]
            method = "radau5"
            tolerance = 1e-8
            [[body]]
            name = "block"
            mass = "1 kg"
            inertia = "1e-3 1e-3 1e-3 kg m^2"
            [[joint]]
            name = "J"
            kind = "prismatic"
            child = "block"
            axis = [1, 0, 0]
            play = {{ y = "1 um", half_length = "25 mm", half_y = "1 mm", planar = true }}
            [[load]]
            name = "push"
            on = {{ body = "block" }}
            force = "1 0 0 N"
            factor = {{ law = "formula", formula = "{amplitude} * sin(2*pi*50*t)" }}
            "#
        );
        Scene::parse(&text, None, &[]).expect("valid")
    }

    fn owned(changes: &[(&str, &str)]) -> Vec<(String, String)> {
        changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
    }

    fn points(player: &Player, place: usize) -> &[Point] {
        &player.friction().joints[0].places[place].points
    }

    #[test]
    fn points_hold_the_forces_and_velocities_of_a_run_of_its_own() {
        for (scene, law) in [("spcmm", "bristle"), ("spcmm", "modified-coulomb"), ("slider-crank-worn", "bristle")] {
            let scene = Scene::load(scene, &owned(&[("contact.friction_law", law)])).expect("built in");
            let mut player = Player::new(&scene).expect("starts");
            player.run_to(0.03);
            let mut other = Simulation::new(&scene.machine).expect("starts");
            let mut frame = Frame::default();
            let mut all: Vec<(usize, usize, Point)> = Vec::new();
            for (joint, own) in player.friction().joints.iter().enumerate() {
                for (place, record) in own.places.iter().enumerate() {
                    all.extend(record.points.iter().map(|point| (joint, place, *point)));
                }
            }
            all.sort_by(|a, b| a.2.time.total_cmp(&b.2.time));
            assert!(all.len() > 200, "{law}: {}", all.len());
            let mut compared = 0;
            for (joint, place, point) in all {
                while other.time() < point.time {
                    other.step().expect("runs");
                }
                other.sample(point.time, &mut frame);
                let report = &frame.joints[joint];
                let (depth, force, normal, velocity) = match frame.sites_of(joint).get(place) {
                    Some(site) => (-site.gap, site.friction_force, site.normal_force, site.sliding.velocity),
                    None => (report.penetration, report.friction_force, report.normal_force, report.sliding.velocity),
                };
                if !point.presses {
                    assert!(depth <= 0.0);
                    assert_eq!(point, Point { time: point.time, ..Point::default() });
                    continue;
                }
                // The static coefficient is the kinetic one.
                let limit = scene.machine.loose_joints[joint].contact.friction * normal.norm();
                assert!((point.limit - limit).abs() <= 1e-12 * limit, "{law}: {point:?}, not {limit}");
                // Components across the normal, in whatever directions.
                let [of_force, of_velocity] = [point.friction, point.velocity].map(|[x, y]| Vec3::new(x, y, 0.0));
                let [size, speed] = [force.norm(), velocity.norm()];
                assert!((of_force.norm() - size).abs() <= 1e-6 * size, "{law}: {point:?}, not {force}");
                // Where the normal force is clipped to zero, its direction is not known.
                assert!(
                    limit == 0.0 || (of_velocity.norm() - speed).abs() <= 1e-6 * speed,
                    "{law}: {point:?}, not {velocity}"
                );
                let off = of_force.dot(&of_velocity) - force.dot(&velocity);
                assert!(off.abs() <= 1e-6 * size * speed, "{law}: {point:?}");
                assert!(force.norm() <= limit * (1.0 + 1e-9), "{law} at {} s", point.time);
                compared += 1;
            }
            assert!(compared > 150, "{law}: {compared}");
        }
    }

    #[test]
    fn a_loop_encloses_the_energy_that_friction_takes() {
        // Elastic, perfectly plastic: 4 (x - s) mu N for a loop from -x to x; two corners carry the weight.
        let scene = pushed_block(1.5);
        let mut player = Player::new(&scene).expect("starts");
        player.run_to(0.4);
        let now = player.friction().contact(0, player.frame()).expect("it lies");
        let period: Vec<Point> = now.points.iter().copied().filter(|point| point.time >= 0.38).collect();
        let area: f64 = period
            .windows(2)
            .map(|pair| {
                -0.5 * (pair[0].friction[0] + pair[1].friction[0]) * (pair[1].displacement[0] - pair[0].displacement[0])
            })
            .sum();
        let [least, most] =
            [f64::min, f64::max].map(|of| period.iter().map(|point| point.displacement[0]).reduce(of).expect("points"));
        let force = 0.15 * 0.5 * 9.81;
        let expected = 4.0 * (0.5 * (most - least) - force / 1e8) * force;
        assert!(expected > 0.0 && (area / expected - 1.0).abs() < 0.03, "{area:e} J, not {expected:e} J");
    }

    #[test]
    fn a_run_that_goes_back_repeats_its_points_and_memory_is_bounded() {
        let scene = Scene::load("spcmm", &owned(&[("contact.friction_law", "bristle")])).expect("built in");
        let mut player = Player::new(&scene).expect("starts");
        player.run_to(12e-3);
        let shown = player.pacer.shown();
        let before = points(&player, 0).to_vec();
        for _ in 0..400 {
            player.step_back();
        }
        assert!(player.pacer.shown() < shown - 1e-4);
        player.run_to(shown);
        let after = points(&player, 0);
        assert!(after.is_sorted_by(|a, b| a.time < b.time));
        // Points may be others, but not their values.
        let at = |time: f64| after.iter().find(|point| point.time == time);
        let both: Vec<(&Point, &Point)> = before.iter().filter_map(|own| Some((own, at(own.time)?))).collect();
        assert!(both.len() > before.len() / 2, "{} of {}", both.len(), before.len());
        let way = before.iter().map(|point| distance(point.displacement, [0.0; 2])).fold(0.0, f64::max);
        for (own, again) in both {
            assert_eq!(own.limit, again.limit);
            assert!(distance(own.friction, again.friction) <= 1e-6 * own.limit, "{own:?} {again:?}");
            assert!(distance(own.displacement, again.displacement) < 1e-3 * way, "{own:?} {again:?}");
        }

        let mut record = FrictionRecord::new(&scene);
        let mut frame = player.frame().clone();
        for step in 0..20_000 {
            frame.time = f64::from(step) * 1e-5;
            // The wall turns under the surface, which slides along it.
            let (sine, cosine) = (1e-3 * f64::from(step)).sin_cos();
            frame.joints[0].penetration = 1e-6;
            frame.joints[0].normal_force = Vec3::new(cosine, sine, 0.0);
            frame.joints[0].sliding = Sliding { velocity: Vec3::new(-sine, cosine, 0.0), limit: 10.0 };
            frame.joints[0].friction_force = frame.joints[0].sliding.velocity * f64::from(step % 7);
            record.record(&frame);
            assert!(record.joints[0].places[0].points.len() <= MAX_POINTS);
        }
        let last = record.joints[0].places[0].points.last().expect("points");
        let axes = axes_of(&frame, scene.machine.loose_joints[0].carrier().body);
        assert_eq!(axes, crate::machine::Mat3::identity(), "a socket of the world");
        let way = distance(last.displacement, [0.0; 2]);
        assert!((way - frame.time).abs() < 1e-9, "{way} m along the wall since the contact began");
    }

    #[test]
    fn of_several_places_the_one_in_contact_longest_is_shown_and_in_flight_the_latest() {
        let scene = pushed_block(0.0);
        let mut player = Player::new(&scene).expect("starts");
        player.run_to(1e-3);
        let mut record = FrictionRecord::new(&scene);
        let mut frame = player.frame().clone();
        let gaps = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
        let expected = [None, Some((1, true)), Some((1, true)), Some((0, true)), Some((0, false)), Some((1, true))];
        for (step, (gaps, expected)) in gaps.into_iter().zip(expected).enumerate() {
            frame.time = step as f64;
            for (site, gap) in frame.sites.iter_mut().zip(gaps.into_iter().chain([1.0; 2])) {
                (site.gap, site.normal_force) = (gap, Vec3::y());
            }
            record.record(&frame);
            let found = record.contact(0, &frame).map(|contact| (contact.place, contact.now.is_some()));
            assert_eq!(found, expected, "{step}");
        }
        // At an earlier instant, the contact of that time.
        frame.time = 3.5;
        frame.sites[0].gap = -1.0;
        frame.sites[1].gap = 1.0;
        let earlier = record.contact(0, &frame).expect("known");
        assert_eq!((earlier.place, earlier.points.len(), earlier.now.map(|now| now.time)), (0, 2, Some(3.5)));
    }
}
