//! Symbols of bushings, stops and motors: simple solids at their points and joints.

use std::f32::consts::TAU;

use glam::{Mat3, Quat, Vec3};

use super::solids::{BarKind, Pose, Solid, push_solid};
use super::theme::Material;
use super::{Colour, Layer, Line, to_f32};
use crate::machine::{self, Bushing, Freedom, Joint, JointCoordinate, Motor, Stop};
use crate::scene::Scene;
use crate::simulate::{ElementReport, Frame};

/// Half length and radius of a bushing's sleeve, and of the pin in it, in radii of the scene.
const SLEEVE: [f32; 2] = [0.03, 0.055];
const PIN: [f32; 2] = [0.06, 0.02];
/// Thickness and radius of the disc at the end of a slide.
const BUFFER: [f32; 2] = [0.016, 0.055];
/// Start and end, from the joint, and radius of the bar at the limit of a hinge.
const PEG: [f32; 3] = [0.05, 0.16, 0.013];
/// Start and end of a motor's case along the axis of a hinge, on both sides of it, or behind a slide; and its radius.
const HINGE_CASE: [f32; 2] = [-0.09, 0.09];
const SLIDE_CASE: [f32; 2] = [-0.36, -0.24];
const CASE_RADIUS: f32 = 0.035;
/// Radius of the arc about a motor's axis, and the length of a straight arrow beside it.
const ARC_RADIUS: f32 = 0.075;
const ARROW_LENGTH: f32 = 0.12;
/// Segments of an arc, its extent in turns, and the length of the barbs at its tip in radii of the arc.
const SEGMENTS: u16 = 36;
const ARC_TURNS: f32 = 0.75;
const BARB_LENGTH: f32 = 0.45;

/// Drawing style.
pub(super) struct Style {
    /// Radius of the scene, m.
    pub radius: f32,
    /// Width of lines, pixels.
    pub width: f32,
    /// Material.
    pub material: Material,
    /// Material of an enclosing part: the sleeve of a bushing, the case of a motor.
    pub outer: Material,
    /// Colour of lines.
    pub colour: Colour,
}

fn bar(from: Vec3, to: Vec3, radius: f32) -> Solid<'static> {
    Solid::Bar { from, to, radius, kind: BarKind::Cylinder, has_cap: [false; 2] }
}

fn rotation(quat: &machine::Quat) -> Mat3 {
    Mat3::from_quat(Quat::from_xyzw(quat.i as f32, quat.j as f32, quat.k as f32, quat.w as f32))
}

/// A sleeve at the point of one body and a pin at that of the other, along the bushing axis of lowest rotational stiffness.
pub(super) fn push_bushing(bushing: &Bushing, report: &ElementReport, frame: &Frame, style: &Style, layer: &mut Layer) {
    let axes = Pose::in_frame(frame, bushing.from.body).rotation * rotation(&bushing.axes);
    let stiffness = &bushing.turning_stiffness;
    // Among equally soft axes the last wins: the axis of a rotationally symmetric part is z.
    let softest = (0..3).rev().min_by(|&a, &b| stiffness[a].total_cmp(&stiffness[b])).unwrap_or(2);
    let along = axes.col(softest) * style.radius;
    let [outer, inner] = report.points.map(|point| to_f32(&point));
    push_solid(
        layer,
        &bar(outer - along * SLEEVE[0], outer + along * SLEEVE[0], SLEEVE[1] * style.radius),
        style.outer,
    );
    push_solid(layer, &bar(inner - along * PIN[0], inner + along * PIN[0], PIN[1] * style.radius), style.material);
}

/// The coordinate of a joint that an element acts on, world axes.
struct Axis<'a> {
    joint: &'a Joint,
    freedom: Freedom,
    parent: Pose,
    /// Origin, m, and unit vector.
    origin: Vec3,
    along: Vec3,
}

impl<'a> Axis<'a> {
    fn of(coordinate: JointCoordinate, report: &ElementReport, scene: &'a Scene, frame: &Frame) -> Option<Self> {
        let freedom = coordinate.freedom;
        let joint = scene.machine.kinematic_joints().nth(coordinate.joint)?;
        let parent = Pose::in_frame(frame, joint.parent);
        let (pose, axis) = match freedom {
            Freedom::SecondTurn => (Pose::in_frame(frame, Some(joint.child)), &joint.child_axis),
            _ => (parent, &joint.axis),
        };
        let along = (pose.rotation * to_f32(axis)).normalize_or(Vec3::X);
        Some(Self { joint, freedom, parent, origin: to_f32(&report.points[0]), along })
    }

    /// Unit vector across the axis towards the child's centre at joint angle `angle`, rad; `None` if the centre lies on the
    /// axis.
    fn direction(&self, scene: &Scene, angle: f32) -> Option<Vec3> {
        let arm = scene.machine.bodies[self.joint.child].centre - self.joint.child_point;
        let at_zero = self.parent.rotation * rotation(&self.joint.rotation) * to_f32(&arm);
        let across = at_zero.reject_from_normalized(self.along).try_normalize()?;
        Some(Quat::from_axis_angle(self.along, angle) * across)
    }
}

/// A disc at each limit of a slide; at a hinge a bar towards the centre of the turning body at the limit.
pub(super) fn push_stop(
    stop: &Stop,
    report: &ElementReport,
    (scene, frame): (&Scene, &Frame),
    style: &Style,
    layer: &mut Layer,
) {
    let Some(axis) = Axis::of(stop.on, report, scene, frame) else {
        return;
    };
    for (limit, side) in [(stop.lower, -1.0), (stop.upper, 1.0)] {
        let limit = limit as f32;
        if !limit.is_finite() {
            continue;
        }
        let solid = if axis.freedom.turns() {
            let outwards = axis.direction(scene, limit).unwrap_or_else(|| axis.along.any_orthonormal_vector());
            let [from, to, radius] = PEG.map(|part| part * style.radius);
            bar(axis.origin + outwards * from, axis.origin + outwards * to, radius)
        } else {
            let [thickness, radius] = BUFFER.map(|part| part * style.radius);
            let from = axis.origin + axis.along * limit;
            bar(from, from + axis.along * (side * thickness), radius)
        };
        push_solid(layer, &solid, style.material);
    }
}

/// A case on the axis of the joint, with an arrow about it or along it.
pub(super) fn push_motor(
    motor: &Motor,
    report: &ElementReport,
    (scene, frame): (&Scene, &Frame),
    style: &Style,
    layer: &mut Layer,
    lines: &mut Vec<Line>,
) {
    let Some(axis) = Axis::of(motor.on, report, scene, frame) else {
        return;
    };
    let thickness = CASE_RADIUS * style.radius;
    let [from, to] = if axis.freedom.turns() { HINGE_CASE } else { SLIDE_CASE }.map(|part| part * style.radius);
    let at = |along: f32| axis.origin + axis.along * along;
    push_solid(layer, &bar(at(from), at(to), thickness), style.outer);
    let side = axis.along.any_orthonormal_vector();
    let other = axis.along.cross(side);
    let mut line = |from, to| lines.push(Line::new(from, to, style.width, [style.colour; 2]));
    if axis.freedom.turns() {
        let (centre, radius) = (at(to), ARC_RADIUS * style.radius);
        let on = |part: f32, out: f32| {
            let (sin, cos) = (TAU * ARC_TURNS * part).sin_cos();
            centre + (side * cos + other * sin) * (radius * out)
        };
        let arc_point = |k: u16| on(f32::from(k) / f32::from(SEGMENTS), 1.0);
        (0..SEGMENTS).for_each(|k| line(arc_point(k), arc_point(k + 1)));
        let back = 1.0 - BARB_LENGTH / (TAU * ARC_TURNS);
        [1.0 - 0.6 * BARB_LENGTH, 1.0 + 0.6 * BARB_LENGTH]
            .into_iter()
            .for_each(|out| line(on(back, out), on(1.0, 1.0)));
    } else {
        let beside = side * (1.5 * thickness);
        let (tail, tip) = (at(from) + beside, at(from + ARROW_LENGTH * style.radius) + beside);
        let back = tip - axis.along * (BARB_LENGTH * ARC_RADIUS * style.radius);
        line(tail, tip);
        [-1.0, 1.0]
            .into_iter()
            .for_each(|sign| line(back + side * (sign * 0.6 * BARB_LENGTH * ARC_RADIUS * style.radius), tip));
    }
}
