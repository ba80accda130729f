//! The recent paths of the parts of joints with play, drawn by the microscope: of a ball's centre, of both ends of a pin's axis, or of
//! its middle if it does not tilt, of a block's centre.

use crate::machine::{EndsOn, LooseJoint, LooseKind, Mat3, Pin, Vec3};
use crate::scene::Scene;
use crate::simulate::{Frame, JointReport, RECORDED_JOINTS};

/// Points stored per path.
const MAX_POINTS: usize = 4096;
/// A point that has moved by less than this fraction of the clearance counts as unmoved.
const RESOLUTION: f32 = 1e-3;

/// Position of a point of the carried part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Time, s.
    pub time: f64,
    /// Position from where the point is without play, of a block from the middle of its guide, in the axes of the carrier's body, m:
    /// the path turns with the socket.
    pub position: [f32; 3],
    /// The joint's clearance then, m.
    pub clearance: f32,
}

/// The latest paths of the first [`RECORDED_JOINTS`] joints with play.
#[derive(Clone, Default)]
pub struct Paths {
    joints: Vec<JointPaths>,
}

#[derive(Clone)]
struct JointPaths {
    joint: LooseJoint,
    /// One, or those of both ends of a pin.
    paths: Vec<Vec<Point>>,
}

/// Where the pin's axis is at the places `a` and `b`, from the bearing's axis, m, world axes; `axes` are those of the frames of bearing and
/// pin as columns.
pub fn ends_of_pin(kind: &Pin, report: &JointReport, axes: &[Mat3; 2]) -> [Vec3; 2] {
    let [bearing, pin] = axes;
    let (a, b) = (bearing.column(0), pin.column(0));
    let slope = b / a.dot(&b) - a;
    let half = 0.5 * kind.length.unwrap_or_default();
    // The ends are those of the bearing, past which the pin has slid, or those of the pin.
    let slid = if kind.ends == EndsOn::Bearing { report.axial } else { 0.0 };
    [-half, half].map(|x| report.eccentricity + slope * (x - slid))
}

/// What a path follows, m, world axes, by its number.
fn tracked(joint: &LooseJoint, report: &JointReport, frame: &Frame) -> [Vec3; 2] {
    let axes = || joint.frames.map(|own| frame.axes_of(&own));
    match &joint.kind {
        LooseKind::Pin(pin) if pin.length.is_some() => ends_of_pin(pin, report, &axes()),
        LooseKind::Ball | LooseKind::Pin(_) => [report.eccentricity; 2],
        LooseKind::Slide(_) => [report.eccentricity + axes()[0].column(0) * report.axial; 2],
    }
}

/// Axes of body `body` as columns; those of the world for `None`.
pub fn axes_of(frame: &Frame, body: Option<usize>) -> Mat3 {
    body.and_then(|body| frame.bodies.get(body)).map_or_else(Mat3::identity, |motion| motion.rotation)
}

impl Paths {
    /// Empty paths for `scene`.
    pub fn new(scene: &Scene) -> Self {
        let joints = scene.machine.loose_joints.iter().take(RECORDED_JOINTS);
        let empty = |joint: &LooseJoint| {
            let count = if matches!(joint.kind, LooseKind::Pin(Pin { length: Some(_), .. })) { 2 } else { 1 };
            JointPaths { joint: joint.clone(), paths: vec![Vec::new(); count] }
        };
        Self { joints: joints.map(empty).collect() }
    }

    /// Records an instant of the run. An instant before the latest starts a new branch: later points are dropped.
    pub fn record(&mut self, frame: &Frame) {
        for (own, report) in self.joints.iter_mut().zip(&frame.joints) {
            for points in &mut own.paths {
                while points.last().is_some_and(|last| last.time > frame.time) {
                    points.pop();
                }
            }
            // In an ideal joint the part cannot move.
            if report.clearance.max(report.second_clearance) <= 0.0 {
                continue;
            }
            let carrier = axes_of(frame, own.joint.carrier().body);
            let resolution = RESOLUTION * report.clearance.max(report.second_clearance) as f32;
            for (points, at) in own.paths.iter_mut().zip(tracked(&own.joint, report, frame)) {
                let local = carrier.tr_mul(&at);
                let position = [local.x as f32, local.y as f32, local.z as f32];
                let has_moved = |last: &Point| {
                    let squares = last.position.iter().zip(&position).map(|(a, b)| (a - b) * (a - b));
                    squares.sum::<f32>() > resolution * resolution
                };
                if !points.last().is_none_or(has_moved) {
                    continue;
                }
                if points.len() == MAX_POINTS {
                    // Half at once: shifting all points for each new one would be too costly.
                    points.drain(..MAX_POINTS / 2);
                }
                points.push(Point { time: frame.time, position, clearance: report.clearance as f32 });
            }
        }
    }

    /// Path `number` of joint `joint` from `from` to `to`, s, the oldest point first; empty where none is recorded.
    pub fn between(&self, joint: usize, number: usize, from: f64, to: f64) -> &[Point] {
        let Some(points) = self.joints.get(joint).and_then(|own| own.paths.get(number)) else {
            return &[];
        };
        let start = points.partition_point(|point| point.time < from);
        let end = points.partition_point(|point| point.time <= to);
        &points[start..end.max(start)]
    }
}

/// The end of `path` since the clearance was last another one than `clearance`, m.
pub fn of_clearance(path: &[Point], clearance: f64) -> &[Point] {
    let before = path.iter().rposition(|point| point.clearance != clearance as f32);
    &path[before.map_or(0, |last| last + 1)..]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::player::Player;
    use crate::simulate::Simulation;

    const ALL: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

    fn player(scene: &str) -> Player {
        let scene = Scene::load(scene, &[]).expect("built in");
        Player::new(&scene).expect("starts")
    }

    #[test]
    fn a_path_holds_the_positions_of_the_ball_in_the_axes_of_its_socket() {
        // The crank turns the socket of B, which is ideal in the built-in scene: only C has clearance there.
        let changes = [("joint.B.clearance".to_owned(), "0.3 mm".to_owned())];
        let scene = Scene::load("slider-crank", &changes).expect("built in");
        let mut player = Player::new(&scene).expect("starts");
        player.run_to(0.05);
        let mut other = Simulation::new(&scene.machine).expect("starts");
        let mut frame = Frame::default();
        for (joint, spec) in scene.machine.loose_joints.iter().enumerate() {
            let points = player.paths().between(joint, 0, ALL.0, ALL.1);
            assert!(points.len() > 100, "{}: {}", spec.name, points.len());
            assert!(points.is_sorted_by(|a, b| a.time < b.time));
        }
        let points = player.paths().between(0, 0, ALL.0, ALL.1);
        let (mut at, mut rotation_change) = (0, 0.0_f64);
        while at < points.len() {
            let point = points[at];
            while other.time() < point.time {
                other.step().expect("runs");
            }
            other.sample(point.time, &mut frame);
            let joint = &frame.joints[0];
            let carrier = axes_of(&frame, scene.machine.loose_joints[0].carrier().body);
            let eccentricity = carrier * crate::machine::Vec3::from(point.position.map(f64::from));
            let deviation = (eccentricity - joint.eccentricity).norm();
            assert!(deviation < 1e-9, "{deviation:e} m at {} s", point.time);
            rotation_change = rotation_change.max((carrier - Mat3::identity()).norm());
            at += 7;
        }
        assert!(rotation_change > 0.1, "the socket turns: {rotation_change}");
    }

    #[test]
    fn points_after_a_step_back_are_dropped_and_memory_is_bounded() {
        let mut player = player("spcmm");
        player.run_to(8.6e-3);
        // The rest of the displayed step is recorded by the next.
        player.single_step();
        player.step_back();
        let shown = player.pacer.shown();
        let before = player.paths().between(0, 0, ALL.0, shown).to_vec();
        for _ in 0..30 {
            player.single_step();
        }
        let shown = player.pacer.shown();
        assert!(player.paths().between(0, 0, ALL.0, ALL.1).len() > before.len());
        for _ in 0..30 {
            player.step_back();
        }
        let now = player.pacer.shown();
        assert_eq!(player.paths().between(0, 0, ALL.0, now), before);
        player.set("contact.friction", "0.5").expect("in range");
        player.run_to(shown);
        let points = player.paths().between(0, 0, ALL.0, ALL.1);
        assert!(points.is_sorted_by(|a, b| a.time < b.time));
        assert_eq!(points[..before.len()], before);

        let mut paths = Paths::new(player.running());
        let mut frame = player.frame().clone();
        for step in 0..20_000 {
            frame.time = f64::from(step) * 1e-5;
            frame.joints[0].eccentricity.x = 1e-4 * f64::from(step % 3);
            paths.record(&frame);
            assert!(paths.between(0, 0, ALL.0, ALL.1).len() <= MAX_POINTS);
        }
        assert_eq!(paths.between(0, 0, 0.19999, ALL.1).len(), 1);
        // A ball at rest is one point.
        assert!(paths.between(1, 0, ALL.0, ALL.1).len() == 1);
    }
    #[test]
    fn both_ends_of_a_pin_and_the_centre_of_a_block_keep_within_their_play() {
        let pin = Scene::load("thrown-pin", &[]).expect("a benchmark");
        let mut player = Player::new(&pin).expect("starts");
        player.run_to(4e-3);
        let ends = [0, 1].map(|number| player.paths().between(0, number, ALL.0, ALL.1));
        let far = |points: &[Point]| points.iter().map(|p| p.position[1].hypot(p.position[2])).fold(0.0, f32::max);
        for points in ends {
            // Across the axis, which is x, the end reaches the wall and the depth of a contact beyond it, 1 um.
            assert!(points.len() > 100 && (far(points) / 1e-4 - 1.0).abs() < 0.1, "{}", far(points));
        }
        assert!(ends[0][ends[0].len() / 2].position != ends[1][ends[1].len() / 2].position, "it tilts");
        assert!(player.paths().between(0, 2, ALL.0, ALL.1).is_empty());
        let slide = Scene::load("slider-crank-worn", &[]).expect("built in");
        let joint = slide.machine.loose_joints.iter().position(|joint| joint.name == "guide").expect("a slide");
        let mut player = Player::new(&slide).expect("starts");
        player.run_to(0.05);
        let (points, report) = (player.paths().between(joint, 0, ALL.0, ALL.1), player.frame().joints[joint]);
        // The guide is that of the world.
        let axes = player.frame().axes_of(&slide.machine.loose_joints[joint].frames[0]);
        let last = axes.tr_mul(&Vec3::from(points.last().expect("it moved").position.map(f64::from)));
        assert!((last.x - report.axial).abs() < 1e-4 && last.y.abs() < 1.1 * report.clearance, "{last}");
        let along = |point: &Point| axes.column(0).dot(&Vec3::from(point.position.map(f64::from)));
        let [low, high] = [f64::min, f64::max].map(|of| points.iter().map(along).reduce(of).expect("points"));
        assert!(high - low > 10.0 * report.clearance, "{low} to {high}");
    }

    #[test]
    fn after_the_clearance_has_shrunk_the_path_stays_within_it() {
        let mut player = player("spcmm");
        player.run_to(20e-3);
        player.set("contact.clearance", "0.1 mm").expect("in range");
        player.run_to(180e-3);
        let clearance = player.frame().joints[0].clearance;
        assert!((clearance - 0.1e-3).abs() < 1e-12, "it has arrived: {clearance}");
        let all = player.paths().between(0, 0, ALL.0, ALL.1);
        let distance = |point: &Point| point.position.iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!(all.iter().any(|point| distance(point) > 0.2e-3), "earlier it was farther out");
        let now = of_clearance(all, clearance);
        assert!(now.len() > 20, "{}", now.len());
        assert!(now.iter().all(|point| distance(point) < 1.05 * clearance as f32));
        assert!(of_clearance(all, 0.2e-3).is_empty());
    }
}
