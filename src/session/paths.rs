//! The recent path of each ball in its socket, drawn by the microscope.

use crate::machine::Mat3;
use crate::scene::Scene;
use crate::simulate::{Frame, RECORDED_JOINTS};

/// Points stored per ball joint.
const MAX_POINTS: usize = 4096;
/// A ball that has moved by less than this fraction of its clearance counts as unmoved.
const RESOLUTION: f32 = 1e-3;

/// Position of a ball's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Time, s.
    pub time: f64,
    /// Position from the socket's centre, in the axes of the socket's body, m: the path turns with its socket.
    pub position: [f32; 3],
    /// The joint's clearance then, m.
    pub clearance: f32,
}

/// The latest path of each of the first [`RECORDED_JOINTS`] ball joints.
#[derive(Clone, Default)]
pub struct Paths {
    joints: Vec<Path>,
}

#[derive(Clone)]
struct Path {
    /// The body that carries the socket; `None` is the world.
    carrier: Option<usize>,
    points: Vec<Point>,
}

/// Axes of body `body` as columns; those of the world for `None`.
pub fn axes_of(frame: &Frame, body: Option<usize>) -> Mat3 {
    body.and_then(|body| frame.bodies.get(body)).map_or_else(Mat3::identity, |motion| motion.rotation)
}

impl Paths {
    /// Empty paths for `scene`.
    pub fn new(scene: &Scene) -> Self {
        let joints = scene.machine.loose_joints.iter().take(RECORDED_JOINTS);
        let path = |joint: &crate::machine::LooseJoint| Path { carrier: joint.carrier().body, points: Vec::new() };
        Self { joints: joints.map(path).collect() }
    }

    /// Records an instant of the run. An instant before the latest starts a new branch: later points are dropped.
    pub fn record(&mut self, frame: &Frame) {
        for (path, joint) in self.joints.iter_mut().zip(&frame.joints) {
            let points = &mut path.points;
            while points.last().is_some_and(|last| last.time > frame.time) {
                points.pop();
            }
            let local = axes_of(frame, path.carrier).tr_mul(&joint.eccentricity);
            let position = [local.x as f32, local.y as f32, local.z as f32];
            let resolution = RESOLUTION * joint.clearance as f32;
            let has_moved = |last: &Point| {
                let squares = last.position.iter().zip(&position).map(|(a, b)| (a - b) * (a - b));
                squares.sum::<f32>() > resolution * resolution
            };
            // In an ideal joint the ball cannot move.
            if joint.clearance <= 0.0 || !points.last().is_none_or(has_moved) {
                continue;
            }
            if points.len() == MAX_POINTS {
                // Half at once: shifting all points for each new one would be too costly.
                points.drain(..MAX_POINTS / 2);
            }
            let time = frame.time;
            points.push(Point { time, position, clearance: joint.clearance as f32 });
        }
    }

    /// The path of ball joint `joint` from `from` to `to`, s, the oldest point first; empty where none is recorded.
    pub fn between(&self, joint: usize, from: f64, to: f64) -> &[Point] {
        let Some(path) = self.joints.get(joint) else {
            return &[];
        };
        let start = path.points.partition_point(|point| point.time < from);
        let end = path.points.partition_point(|point| point.time <= to);
        &path.points[start..end.max(start)]
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
            let points = player.paths().between(joint, ALL.0, ALL.1);
            assert!(points.len() > 100, "{}: {}", spec.name, points.len());
            assert!(points.is_sorted_by(|a, b| a.time < b.time));
        }
        let points = player.paths().between(0, ALL.0, ALL.1);
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
        let before = player.paths().between(0, ALL.0, shown).to_vec();
        for _ in 0..30 {
            player.single_step();
        }
        let shown = player.pacer.shown();
        assert!(player.paths().between(0, ALL.0, ALL.1).len() > before.len());
        for _ in 0..30 {
            player.step_back();
        }
        let now = player.pacer.shown();
        assert_eq!(player.paths().between(0, ALL.0, now), before);
        player.set("contact.friction", "0.5").expect("in range");
        player.run_to(shown);
        let points = player.paths().between(0, ALL.0, ALL.1);
        assert!(points.is_sorted_by(|a, b| a.time < b.time));
        assert_eq!(points[..before.len()], before);

        let mut paths = Paths::new(player.running());
        let mut frame = player.frame().clone();
        for step in 0..20_000 {
            frame.time = f64::from(step) * 1e-5;
            frame.joints[0].eccentricity.x = 1e-4 * f64::from(step % 3);
            paths.record(&frame);
            assert!(paths.between(0, ALL.0, ALL.1).len() <= MAX_POINTS);
        }
        assert_eq!(paths.between(0, 0.19999, ALL.1).len(), 1);
        // A ball at rest is one point.
        assert!(paths.between(1, ALL.0, ALL.1).len() == 1);
    }

    #[test]
    fn after_the_clearance_has_shrunk_the_path_stays_within_it() {
        let mut player = player("spcmm");
        player.run_to(20e-3);
        player.set("contact.clearance", "0.1 mm").expect("in range");
        player.run_to(180e-3);
        let clearance = player.frame().joints[0].clearance;
        assert!((clearance - 0.1e-3).abs() < 1e-12, "it has arrived: {clearance}");
        let all = player.paths().between(0, ALL.0, ALL.1);
        let distance = |point: &Point| point.position.iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!(all.iter().any(|point| distance(point) > 0.2e-3), "earlier it was farther out");
        let now = of_clearance(all, clearance);
        assert!(now.len() > 20, "{}", now.len());
        assert!(now.iter().all(|point| distance(point) < 1.05 * clearance as f32));
        assert!(of_clearance(all, 0.2e-3).is_empty());
    }
}
