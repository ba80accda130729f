//! A ball at Z_i + m e in a socket of inner radius r + m c.

use glam::{Mat3, Quat, Vec3};
use parry3d::query::Ray;

use super::{CELL_RADIUS, DrawnJoint, DrawnKind, IDEAL_GAP, WEAR_OPACITY, is_in_contact};
use crate::machine::{Geometry, LooseJoint};
use crate::simulate::{Frame, JointReport, Part, Shape};
use crate::view::cast::cast_ball;
use crate::view::instances::{self, placed};
use crate::view::theme::Material;
use crate::view::{DrawList, Instance, Mesh, Palette, ViewOptions, WearMap, to_f32, zones};

/// Largest drawn inner radius of a socket, in ball radii: it limits the magnification.
const MAX_SOCKET_RADIUS: f32 = 4.2;
/// Thickness of a drawn socket, in ball radii.
const WALL_THICKNESS: f32 = 0.26;
/// Largest outer radius, in ball radii.
pub const MAX_OUTER: f32 = MAX_SOCKET_RADIUS + WALL_THICKNESS;

pub fn drawn(joint: &LooseJoint, now: &JointReport, opening: Vec3, m: f32) -> DrawnJoint {
    let socket_centre = to_f32(&now.socket_centre);
    let ball_radius = joint.contact.ball_radius as f32;
    let eccentricity = to_f32(&now.eccentricity);
    let gap = if now.clearance > 0.0 { m * now.clearance as f32 } else { IDEAL_GAP * ball_radius };
    let outer = ball_radius + gap + WALL_THICKNESS * ball_radius;
    DrawnJoint {
        socket_centre,
        ball_centre: socket_centre + m * eccentricity,
        shift: (m - 1.0) * eccentricity,
        ball_radius,
        inner: ball_radius + gap,
        outer,
        reach: outer,
        opening,
        shape: DrawnKind::Ball,
    }
}

/// Largest magnification at which no socket exceeds [`MAX_SOCKET_RADIUS`] ball radii, or the outer radius `room`, m.
pub fn limit(joint: &LooseJoint, now: &JointReport, room: f32) -> f32 {
    let gap = (now.clearance as f32).max(to_f32(&now.eccentricity).length());
    let radius = joint.contact.ball_radius as f32;
    let room = room - WALL_THICKNESS * radius;
    super::ratio(room.min(MAX_SOCKET_RADIUS * radius) - radius, gap)
}

/// A sphere about the ball's centre.
pub fn replaces(joint: &LooseJoint, body: Option<usize>, shape: &Geometry) -> bool {
    let Geometry::Sphere { centre, .. } = shape else {
        return false;
    };
    joint.carried().body == body && (joint.carried().point - centre).norm() < 0.1 * joint.contact.ball_radius
}

pub fn push(
    joint: &DrawnJoint,
    report: &JointReport,
    (options, palette): (&ViewOptions, &Palette),
    out: &mut DrawList,
) {
    let wall = if options.sockets { joint.inner } else { 0.0 };
    let ball = Instance {
        other: joint.ball_to_socket().extend(wall).to_array(),
        touch: touch(report),
        ..instances::ball(joint.ball_centre, joint.ball_radius, palette.ball)
    };
    if options.wear == WearMap::Off || report.clearance == 0.0 {
        out.solid.push(Mesh::Sphere, ball);
    } else {
        let [r, g, b, _] = ball.colour;
        let colour = [r, g, b, WEAR_OPACITY];
        out.clear_balls.push(Instance { colour, ..ball });
    }
}

/// A cell of the socket's inner face.
pub fn cell(joint: &DrawnJoint, (part, cell): (&Part, usize), axes: &Mat3, mut visit: impl FnMut(Mesh, Mat3, Vec3)) {
    let (Shape::Sphere { grid }, Some([azimuth, _])) = (&part.shape, part.edges(cell).azimuth) else {
        return;
    };
    let size = Mat3::from_diagonal(Vec3::splat(CELL_RADIUS * joint.inner));
    let linear = *axes * Mat3::from_rotation_z(azimuth as f32) * size;
    visit(zones::of_zone(grid.zone_of(cell)), linear, joint.socket_centre);
}

pub fn cast(joint: &DrawnJoint, ray: &Ray, has_wall: bool) -> Option<f32> {
    let ball = cast_ball(joint.ball_centre, joint.ball_radius, ray);
    let socket = has_wall.then(|| cast_ball(joint.socket_centre, joint.outer, ray)).flatten();
    // A ray through the cut-away half of the socket continues inside.
    let socket = socket.filter(|&t| (ray.point_at(t) - joint.socket_centre).dot(joint.opening) <= 0.0);
    [ball, socket].into_iter().flatten().min_by(f32::total_cmp)
}

/// Unit vector from a joint's ball to the contact point, and 1 while in contact.
fn touch(report: &JointReport) -> [f32; 4] {
    // A worn wall is touched where its normal is.
    let worn = report.worn[0] > 0.0 && report.normal_force.norm() > 0.0;
    let towards = if worn { -report.normal_force } else { report.eccentricity };
    to_f32(&towards).normalize_or_zero().extend(f32::from(u8::from(is_in_contact(report)))).to_array()
}

/// The halves of all sockets, sorted from far to near as seen from `eye`.
pub fn push_sockets(frame: &Frame, joints: &[DrawnJoint], eye: Vec3, glass: Material, out: &mut Vec<Instance>) {
    // The half that is cut away stays faintly visible: a ball in contact there is still in its socket.
    let cut_away = glass.with_opacity(0.15 * glass.colour.0[3]);
    // Of two spheres that do not meet, the one with the shorter tangent from the eye is in front: the eye is on its side of
    // the plane between them.
    let tangent = |joint: &DrawnJoint| joint.socket_centre.distance_squared(eye) - joint.outer * joint.outer;
    let mut far_first: Vec<_> = joints.iter().zip(&frame.joints).filter(|(joint, _)| joint.is_ball()).collect();
    far_first.sort_by(|(a, _), (b, _)| tangent(b).total_cmp(&tangent(a)));
    for (joint, report) in far_first {
        let half = |opening, material| {
            let turn = Mat3::from_quat(Quat::from_rotation_arc(Vec3::Z, opening));
            Instance {
                inner_radius: joint.inner / joint.outer,
                other: (-joint.ball_to_socket()).extend(joint.ball_radius).to_array(),
                touch: touch(report),
                ..placed(turn * joint.outer, joint.socket_centre, material)
            }
        };
        let mut halves = [half(joint.opening, glass), half(-joint.opening, cut_away)];
        // The half on the eye's side of the cut comes last.
        if (eye - joint.socket_centre).dot(joint.opening) < 0.0 {
            halves.reverse();
        }
        out.extend(halves);
    }
}
