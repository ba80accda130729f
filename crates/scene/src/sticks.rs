//! Default shapes of a body without shapes: bars from its centroid to its joints.

use std::collections::BTreeMap;

use jointplay_physics::machine::{Geometry, JointKind, Shape, Vec3};

use super::Scene;

/// Radii of the bars and of the ball at the centroid, relative to the length of the longest bar.
const BAR: f64 = 0.03;
const BALL: f64 = 0.08;

/// Default shapes of all bodies without shapes, by body index.
pub fn sticks(scene: &Scene) -> BTreeMap<usize, Vec<Shape>> {
    let bodies_without_shapes = scene.machine.bodies.iter().enumerate();
    let bodies_without_shapes = bodies_without_shapes.filter(|(_, body)| body.shapes.is_empty());
    let mut points: BTreeMap<usize, Vec<Vec3>> = bodies_without_shapes.map(|(i, _)| (i, Vec::new())).collect();
    let constrained = scene.machine.joints.iter().filter(|joint| joint.kind != JointKind::Free);
    let tree = constrained.flat_map(|joint| joint.points());
    let balls = scene.machine.loose_joints.iter();
    let balls = balls.flat_map(|joint| [joint.carrier(), joint.carried()]);
    for end in tree.chain(balls) {
        if let Some(points) = end.body.and_then(|body| points.get_mut(&body)) {
            points.push(end.point);
        }
    }
    let shapes = points.into_iter().map(|(body, points)| {
        let centre = scene.machine.bodies[body].centre;
        let lengths = points.iter().map(|point| (point - centre).norm());
        let longest = lengths.fold(0.0, f64::max);
        let bars = points.iter().map(|point| Geometry::Capsule { from: centre, to: *point, radius: BAR * longest });
        let ball = Geometry::Sphere { centre, radius: BALL * longest };
        let shape = |geometry| Shape { geometry, role: None, colour: None };
        let shapes = bars.chain([ball]).filter(|_| longest > 0.0);
        (body, shapes.map(shape).collect())
    });
    shapes.collect()
}
