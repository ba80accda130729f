//! Pins and rails of hinges and slides that a scene does not draw itself.

use glam::Vec3;
use parry3d::query::Ray;

use super::cast::cast;
use super::drawn::{DrawnJoint, DrawnShape, Pose, Solid};
use super::to_f32;
use crate::scene::{Joint, JointKind, Role, Scene};
use crate::simulate::Frame;

/// Radius of a pin, at most, in radii of the scene.
const RADIUS: f32 = 0.016;
/// How far a pin or a rail may reach from its joint, in radii of the scene.
const REACH: f32 = 0.3;
/// Sine of the angle at which a bar still lies along an axis.
const ALONG: f32 = 0.02;

/// A round bar, in the frame of its body.
pub(super) struct Symbol {
    /// Body; `None` is the world.
    pub body: Option<usize>,
    pub from: Vec3,
    pub to: Vec3,
    pub radius: f32,
    pub role: Role,
}

/// A joint at one instant, world axes.
struct Place<'a> {
    joint: &'a Joint,
    /// The child's joint point, m.
    point: Vec3,
    /// Unit vector.
    axis: Vec3,
    /// Shapes of the world, of its parent and of its child.
    shapes: [&'a [(Role, Solid<'a>)]; 3],
}

/// Symbols of the joints of `scene` in `frame`; `radius` is that of the scene, m.
pub(super) fn symbols(
    scene: &Scene,
    parts: &[DrawnShape],
    frame: &Frame,
    joints: &[DrawnJoint],
    radius: f32,
) -> Vec<Symbol> {
    let mut shapes: Vec<Vec<(Role, Solid<'_>)>> = Vec::new();
    shapes.resize_with(scene.bodies.len() + 1, Vec::new);
    // The world last.
    let of = |body: Option<usize>| body.unwrap_or(scene.bodies.len());
    for part in parts {
        shapes[of(part.body)].push((part.role, part.place(frame, joints)));
    }
    let mut symbols = Vec::new();
    for joint in scene.joints.iter().filter(|joint| joint.drawn) {
        let (parent, child) = (
            Pose::in_frame(frame, joint.parent),
            Pose::in_frame(frame, Some(joint.child)),
        );
        let own: &[_] = match joint.parent {
            Some(parent) => &shapes[parent],
            None => &[],
        };
        let place = Place {
            joint,
            point: child.apply(to_f32(&joint.child_point)),
            axis: (parent.rotation * to_f32(&joint.axis)).normalize_or(Vec3::X),
            shapes: [&shapes[of(None)], own, &shapes[joint.child]],
        };
        if !place.point.is_finite() || !place.axis.is_finite() {
            continue;
        }
        let mut bar = |body, [from, to]: [f32; 2], radius, role| {
            let pose = Pose::in_frame(frame, body);
            let local = |along: f32| {
                pose.rotation.transpose() * (place.point + place.axis * along - pose.position)
            };
            let (from, to) = (local(from), local(to));
            symbols.push(Symbol {
                body,
                from,
                to,
                radius,
                role,
            });
        };
        match joint.kind {
            JointKind::Revolute if !place.has_pin() => {
                let half = place.half_width(REACH * radius);
                let thick = (0.5 * half).clamp(0.5 * RADIUS * radius, RADIUS * radius);
                let half = half + 1.2 * thick;
                bar(joint.parent, [-half, half], thick, Role::Pin);
            }
            JointKind::Prismatic if !place.has_rail() => {
                let thick = RADIUS * radius;
                let [low, high] = place.span();
                let ends = [low - REACH * radius, high + REACH * radius];
                bar(joint.parent, ends, 0.5 * thick, Role::Rail);
                bar(
                    Some(joint.child),
                    [-2.0 * thick, 2.0 * thick],
                    thick,
                    Role::Slider,
                );
            }
            _ => {}
        }
    }
    symbols
}

impl Place<'_> {
    /// Whether a bar of the scene lies along the axis through the joint.
    fn has_pin(&self) -> bool {
        let along = |solid: &Solid<'_>| match *solid {
            Solid::Bar {
                from, to, radius, ..
            } => {
                let bar = (to - from).normalize_or_zero();
                let near = from + bar * (self.point - from).dot(bar).clamp(0.0, from.distance(to));
                bar.cross(self.axis).length() < ALONG
                    && bar != Vec3::ZERO
                    && near.distance(self.point) < 0.5 * radius
            }
            _ => false,
        };
        let mut shapes = self.shapes.iter().copied().flatten();
        shapes.any(|(_, solid)| along(solid))
    }

    /// Whether the scene draws what the child slides on.
    fn has_rail(&self) -> bool {
        let of_parent = match self.joint.parent {
            Some(_) => self.shapes[1],
            None => self.shapes[0],
        };
        of_parent.iter().any(|(role, _)| *role == Role::Rail) || self.has_pin()
    }

    /// How far the shapes of the two bodies reach along the axis to both sides of the joint, m, as far as `most`.
    fn half_width(&self, most: f32) -> f32 {
        let mut widest = 0.0;
        for (_, solid) in self.shapes[1].iter().chain(self.shapes[2]) {
            for out in [self.axis, -self.axis] {
                let ray = Ray::new(self.point + out * most, -out);
                let reach = cast(solid, &ray).map_or(0.0, |distance| most - distance);
                // What begins beyond is no hub.
                if reach < most {
                    widest = reach.max(widest);
                }
            }
        }
        widest
    }

    /// How far the child's shapes reach along the axis, from its joint, m.
    fn span(&self) -> [f32; 2] {
        let (mut low, mut high) = (0.0_f32, 0.0_f32);
        for (_, solid) in self.shapes[2] {
            solid.extent(|point, radius| {
                let along = (point - self.point).dot(self.axis);
                low = low.min(along - radius);
                high = high.max(along + radius);
            });
        }
        [low, high]
    }
}
