//! Pins, rails and crosses for joints that the scene does not draw itself, tree joints and loop-closing joints alike.

use glam::Vec3;
use parry3d::query::Ray;

use super::cast::cast;
use super::drawn::DrawnShape;
use super::joint::DrawnJoint;
use super::solids::{Pose, Solid};
use super::to_f32;
use crate::machine::{Joint, JointKind, Role};
use crate::scene::Scene;
use crate::simulate::Frame;

/// Radius of a pin as a fraction of the hub's width; its maximum, and its value without a hub, in radii of the scene.
const PIN_PER_HUB: f32 = 0.2;
const MAX_PIN_RADIUS: f32 = 0.04;
const PIN_WITHOUT_HUB: f32 = 0.02;
/// Overhang of a rail beyond the child's shapes, in radii of the scene.
const RAIL_OVERHANG: f32 = 0.25;
/// Radii of a rail and its sleeve, in radii of the scene.
const RAIL: [f32; 2] = [0.012, 0.022];
/// Half length and radius of a bearing; radius, half length and distance from the bearing of the pin across its shaft, which
/// shows that it turns. All in radii of the shaft.
const BEARING: [f32; 2] = [1.5, 1.35];
const CROSS_PIN: [f32; 3] = [0.3, 1.6, 0.6];
/// Most shapes of a body examined for each of its joints: set-up time stays proportional to the scene.
const MAX_SHAPES: usize = 500;
/// Largest sine of the angle between an axis and a bar that lies along it.
const MAX_SINE: f32 = 0.02;

/// A round bar, in the frame of its body.
pub(super) struct Symbol {
    /// Body; `None` is the world.
    pub body: Option<usize>,
    pub from: Vec3,
    pub to: Vec3,
    pub radius: f32,
    pub role: Role,
}

impl Symbol {
    /// Its ends in `frame`, m, world axes.
    pub fn ends(&self, frame: &Frame) -> [Vec3; 2] {
        let pose = Pose::in_frame(frame, self.body);
        [self.from, self.to].map(|end| pose.apply(end))
    }
}

/// A joint at one instant, world axes.
#[derive(Clone, Copy)]
struct JointPlacement<'a> {
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
    shapes.resize_with(scene.machine.bodies.len() + 1, Vec::new);
    // Shapes of the world come last.
    let index_of = |body: Option<usize>| body.unwrap_or(scene.machine.bodies.len());
    for part in parts {
        let shapes = &mut shapes[index_of(part.body)];
        if shapes.len() < MAX_SHAPES {
            shapes.push((part.role, part.place(frame, joints)));
        }
    }
    let mut symbols = Vec::new();
    let joined = scene.machine.joints.iter().chain(&scene.machine.closing_joints);
    for joint in joined.filter(|joint| joint.drawn) {
        let (parent, child) = (Pose::in_frame(frame, joint.parent), Pose::in_frame(frame, Some(joint.child)));
        let parent_shapes: &[_] = match joint.parent {
            Some(parent) => &shapes[parent],
            None => &[],
        };
        let placement = JointPlacement {
            joint,
            point: child.apply(to_f32(&joint.child_point)),
            axis: (parent.rotation * to_f32(&joint.axis)).normalize_or(Vec3::X),
            shapes: [&shapes[index_of(None)], parent_shapes, &shapes[joint.child]],
        };
        if !placement.point.is_finite() || !placement.axis.is_finite() {
            continue;
        }
        let mut bar = |body, ends: [Vec3; 2], radius, role| {
            let pose = Pose::in_frame(frame, body);
            let local = |point: Vec3| pose.rotation.transpose() * (point - pose.position);
            let [from, to] = ends.map(local);
            symbols.push(Symbol { body, from, to, radius, role });
        };
        match joint.kind {
            JointKind::Revolute if !placement.has_pin() => {
                let hub = placement.hub(radius);
                let pin_radius = match hub {
                    Some([low, high]) => (PIN_PER_HUB * (high - low)).min(MAX_PIN_RADIUS * radius),
                    None => PIN_WITHOUT_HUB * radius,
                };
                let [low, high] = hub.unwrap_or_default();
                let ends = [low - 1.5 * pin_radius, high + 1.5 * pin_radius];
                bar(joint.parent, placement.on_axis(ends), pin_radius, Role::Pin);
            }
            JointKind::Prismatic if !placement.has_rail() => {
                placement.slide(radius, &mut bar);
            }
            JointKind::Cylindrical if !placement.parent_has_rail() => {
                // A shaft of the child needs a bearing.
                let (pin_radius, beside) = match placement.bar_on_axis(placement.shapes[2]) {
                    Some(shaft) => {
                        let [half, sleeve] = BEARING.map(|part| part * shaft);
                        let ends = placement.on_axis([-half, half]);
                        bar(joint.parent, ends, sleeve, Role::Rail);
                        let [low, high] = placement.span();
                        (shaft, (half + CROSS_PIN[2] * shaft).copysign(low + high))
                    }
                    None => {
                        placement.slide(radius, &mut bar);
                        (RAIL[1] * radius, 0.0)
                    }
                };
                let across = placement.axis.any_orthonormal_vector() * CROSS_PIN[1] * pin_radius;
                let [at, _] = placement.on_axis([beside, beside]);
                let ends = [at - across, at + across];
                bar(Some(joint.child), ends, CROSS_PIN[0] * pin_radius, Role::Pin);
            }
            JointKind::Universal => {
                let second = child.rotation * to_f32(&joint.child_axis);
                let pins = [placement.axis, second].map(|axis| JointPlacement { axis, ..placement });
                let reach = |pin: &JointPlacement<'_>| {
                    let [low, high] = pin.hub(radius).unwrap_or_default();
                    high.max(-low)
                };
                let half = reach(&pins[0]).max(reach(&pins[1]));
                let (pin_radius, out) = match half > 0.0 {
                    true => ((2.0 * PIN_PER_HUB * half).min(MAX_PIN_RADIUS * radius), 1.5),
                    false => (PIN_WITHOUT_HUB * radius, 4.0),
                };
                let end = half + out * pin_radius;
                for (pin, body) in pins.iter().zip([joint.parent, Some(joint.child)]) {
                    if !pin.has_pin() {
                        bar(body, pin.on_axis([-end, end]), pin_radius, Role::Pin);
                    }
                }
            }
            JointKind::Revolute | JointKind::Prismatic | JointKind::Cylindrical => {}
            JointKind::Fixed | JointKind::Free => {}
        }
    }
    symbols
}

impl JointPlacement<'_> {
    /// Points of the axis at these distances from the joint.
    fn on_axis(&self, along: [f32; 2]) -> [Vec3; 2] {
        along.map(|along| self.point + self.axis * along)
    }

    /// A rail on the parent and a sleeve on the child; `radius` is that of the scene.
    fn slide(&self, radius: f32, bar: &mut impl FnMut(Option<usize>, [Vec3; 2], f32, Role)) {
        let [rail, sleeve] = RAIL.map(|part| part * radius);
        let [low, high] = self.span();
        let ends = [low - RAIL_OVERHANG * radius, high + RAIL_OVERHANG * radius];
        bar(self.joint.parent, self.on_axis(ends), rail, Role::Rail);
        let ends = self.on_axis([-2.0 * sleeve, 2.0 * sleeve]);
        bar(Some(self.joint.child), ends, sleeve, Role::Slider);
    }

    /// Radius of a bar (not a disc) among `shapes` that lies on the joint's axis, m.
    fn bar_on_axis(&self, shapes: &[(Role, Solid<'_>)]) -> Option<f32> {
        let along = |(_, solid): &(Role, Solid<'_>)| match *solid {
            Solid::Bar { from, to, radius, .. } => {
                let bar = (to - from).normalize_or_zero();
                let offset = (from - self.point).reject_from_normalized(self.axis);
                let is_long = from.distance(to) > radius;
                let lies_on_axis =
                    is_long && bar.cross(self.axis).length() < MAX_SINE && offset.length() < 0.5 * radius;
                lies_on_axis.then_some(radius)
            }
            _ => None,
        };
        shapes.iter().find_map(along)
    }

    /// Whether a bar of the scene lies on the joint's axis.
    fn has_pin(&self) -> bool {
        let mut shapes = self.shapes.iter();
        shapes.any(|shapes| self.bar_on_axis(shapes).is_some())
    }

    /// Shapes of the parent, or of the world without one.
    fn parent_shapes(&self) -> &[(Role, Solid<'_>)] {
        self.shapes[usize::from(self.joint.parent.is_some())]
    }

    /// Whether the scene draws a rail for the child.
    fn has_rail(&self) -> bool {
        self.parent_has_rail() || self.has_pin()
    }

    /// As [`Self::has_rail`], counting only shapes of the parent.
    fn parent_has_rail(&self) -> bool {
        let parent = self.parent_shapes();
        parent.iter().any(|(role, _)| *role == Role::Rail) || self.bar_on_axis(parent).is_some()
    }

    /// Extent of the shapes of both bodies along the axis, from the joint, m. Rays start at the distance `start`, m.
    fn hub(&self, start: f32) -> Option<[f32; 2]> {
        let mut ends: Option<[f32; 2]> = None;
        for (_, solid) in self.shapes[1].iter().chain(self.shapes[2]) {
            let (mut sum, mut count) = (Vec3::ZERO, 0.0);
            solid.extent(|point, _| (sum, count) = (sum + point, count + 1.0));
            let inwards = (sum / count - self.point).reject_from_normalized(self.axis);
            // The joint may lie on the very edge of its hub.
            for point in [self.point, self.point + inwards * 0.05] {
                let reach = |out: Vec3| {
                    let ray = Ray::new(point + out * start, -out);
                    // A shape that contains the start of the ray is not a hub.
                    let hit_distance = cast(solid, &ray).filter(|distance| *distance > 0.0)?;
                    Some(start - hit_distance)
                };
                if let (Some(high), Some(low)) = (reach(self.axis), reach(-self.axis)) {
                    let [lowest, highest] = ends.unwrap_or([-low, high]);
                    ends = Some([lowest.min(-low), highest.max(high)]);
                }
            }
        }
        ends
    }

    /// Extent of the child's shapes along the axis, from its joint, m.
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
