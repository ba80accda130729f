//! Joints with play as drawn. What a kind looks like is in its file; only this one asks which kind it is.
//!
//! With a magnification m of the play, the carried part is drawn at m times its displacement from its place without play, and the
//! wall at m times the play: a contact is closed in the picture exactly when it is closed in the machine. Displacements along an
//! axis on which the part is free are no play, and are drawn as they are.

mod ball;
mod pin;
mod slide;
#[cfg(test)]
mod tests;

use glam::{Mat3, Vec3};
use parry3d::query::Ray;

use super::solids::Pose;
use super::theme::Material;
use super::{DrawList, Layer, Mesh, MeshData, Palette, ViewOptions, WearMap, to_f32};
use crate::machine::{self, Geometry, LooseJoint, LooseKind};
use crate::scene::Scene;
use crate::simulate::{ContactMode, Frame, JointReport, Part, SiteReport};

pub(super) use ball::push_sockets;
use pin::DrawnPin;
use slide::DrawnSlide;

/// Gap drawn where there is no play, in radii of the pin or ball: two parts must not coincide.
const IDEAL_GAP: f32 = 0.02;
/// Radius of the drawn cells of a wear map, in inner radii of the wall: just in front of it.
const CELL_RADIUS: f32 = 0.99;
/// Opacity of a part in front of a wear map.
const WEAR_OPACITY: f32 = 0.25;
/// Largest sine of the angle between parallel lines.
const MAX_SINE: f64 = 0.02;

/// A joint with play as drawn, world axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrawnJoint {
    /// Place of the carried part without play: the socket's centre, the middle of the bearing, or where the block is along its
    /// guide.
    pub socket_centre: Vec3,
    /// Centre of the ball, of the pin or of the block.
    pub ball_centre: Vec3,
    /// Drawn minus real position of the carried part.
    pub shift: Vec3,
    /// Radius of the ball or of the pin.
    pub ball_radius: f32,
    /// Inner and outer radius of the socket or of the bearing; 0 for a guide.
    pub inner: f32,
    pub outer: f32,
    /// Radius of a sphere around the joint.
    pub reach: f32,
    /// Unit vector: the side from which one looks into the joint.
    pub opening: Vec3,
    shape: DrawnKind,
}

#[derive(Clone, Copy, Debug)]
enum DrawnKind {
    Ball,
    Pin(DrawnPin),
    Slide(DrawnSlide),
}

/// A place that touches, as drawn: the point on the carried part, and the forces on it, N.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrawnContact {
    /// Among [`LooseKind::site_names`]; `None` of the whole joint.
    pub place: Option<usize>,
    pub point: Vec3,
    pub normal: Vec3,
    pub friction: Vec3,
}

/// Meshes and dimensions that the drawn joints of a scene need.
pub(super) struct Fittings {
    /// Half a bearing: [`pin::bearing`].
    bearing: Option<Mesh>,
    /// Ends of each guide along its axis, m; empty for others.
    guides: Vec<[f32; 2]>,
}

impl Fittings {
    /// For `scene`, whose first frame is `frame`; `middle` is that of the scene, m. Adds a mesh to `meshes` if there is a pin.
    pub fn new(scene: &Scene, frame: &Frame, middle: Vec3, meshes: &mut Vec<MeshData>) -> Self {
        let joints = &scene.machine.loose_joints;
        let has_pin = joints.iter().any(|joint| matches!(joint.kind, LooseKind::Pin(_)));
        let bearing = u16::try_from(meshes.len()).ok().filter(|_| has_pin).map(Mesh::Plate);
        meshes.extend(bearing.map(|_| pin::bearing()));
        let guide = |(joint, report): (&LooseJoint, &JointReport)| match &joint.kind {
            LooseKind::Slide(slide) => {
                let axis = column(&frame.axes_of(&joint.frames[0]), 0);
                slide::guide(slide, report.axial as f32, (middle - to_f32(&report.socket_centre)).dot(axis))
            }
            _ => [0.0; 2],
        };
        Self { bearing, guides: joints.iter().zip(&frame.joints).map(guide).collect() }
    }
}

/// Column `i` of `matrix`.
fn column(matrix: &machine::Mat3, i: usize) -> Vec3 {
    to_f32(&matrix.column(i).into_owned())
}

/// Every joint with play as drawn at magnification `m`.
pub(super) fn joints(scene: &Scene, frame: &Frame, m: f32) -> Vec<DrawnJoint> {
    let drawn = scene.machine.loose_joints.iter().zip(&frame.joints).map(|(joint, report)| {
        let opening = Pose::in_frame(frame, joint.carrier().body).rotation * to_f32(&joint.opening);
        let opening = opening.normalize_or(Vec3::Z);
        match &joint.kind {
            LooseKind::Ball => ball::drawn(joint, report, opening, m),
            LooseKind::Pin(kind) => pin::drawn(joint, kind, (report, frame), opening, m),
            LooseKind::Slide(kind) => slide::drawn(joint, kind, (report, frame), opening, m),
        }
    });
    drawn.collect()
}

/// Magnification as drawn, at most `requested`: no part grows beyond what its kind permits, or beyond `max_outer_radii`, m.
pub(super) fn magnification(scene: &Scene, frame: &Frame, max_outer_radii: &[f32], requested: f32) -> f32 {
    let requested = if requested.is_finite() { requested.clamp(1.0, 100.0) } else { 1.0 };
    let limits = scene.machine.loose_joints.iter().zip(&frame.joints).enumerate().map(|(i, (joint, now))| {
        let room = max_outer_radii.get(i).copied().unwrap_or(f32::INFINITY);
        match &joint.kind {
            LooseKind::Ball => ball::limit(joint, now, room),
            LooseKind::Pin(kind) => pin::limit(joint, kind, now, room),
            LooseKind::Slide(kind) => slide::limit(kind, now),
        }
    });
    limits.fold(requested, f32::min).max(1.0)
}

/// Largest `m` at which the play `gap` takes up at most `room`.
fn ratio(room: f32, gap: f32) -> f32 {
    if gap > 0.0 { room / gap } else { f32::INFINITY }
}

/// Whether the joint draws a shape of `body` itself, so that the scene's is left out.
pub(super) fn replaces(joint: &LooseJoint, body: Option<usize>, shape: &Geometry) -> bool {
    match &joint.kind {
        LooseKind::Ball => ball::replaces(joint, body, shape),
        LooseKind::Pin(_) => pin::replaces(joint, body, shape),
        LooseKind::Slide(kind) => slide::replaces(joint, kind, body, shape),
    }
}

/// Whether a bar of the carried part that ends at `end`, in that body's frame, ends in the joint.
pub(super) fn holds_end(joint: &LooseJoint, end: Vec3) -> bool {
    let from_centre = end - to_f32(&joint.carried().point);
    match &joint.kind {
        LooseKind::Ball | LooseKind::Pin(_) => from_centre.length() < 1.3 * joint.contact.ball_radius as f32,
        LooseKind::Slide(kind) => slide::contains(joint, kind, from_centre),
    }
}

/// Distance from the carrier's point within which a bar of the carrier ends at the joint's wall, m.
pub(super) fn wall_reach(joint: &LooseJoint) -> f32 {
    match &joint.kind {
        LooseKind::Ball | LooseKind::Pin(_) => ball::MAX_OUTER * joint.contact.ball_radius as f32,
        // Walls are where they are, whatever ends near the middle of the guide.
        LooseKind::Slide(_) => 0.0,
    }
}

/// Point that a view of joint `joint` is centred on, m.
pub(super) fn anchor(scene: &Scene, frame: &Frame, joint: usize) -> Option<Vec3> {
    let report = frame.joints.get(joint)?;
    let spec = scene.machine.loose_joints.get(joint)?;
    let along = match spec.kind {
        LooseKind::Ball | LooseKind::Pin(_) => Vec3::ZERO,
        LooseKind::Slide(_) => column(&frame.axes_of(&spec.frames[0]), 0) * report.axial as f32,
    };
    Some(to_f32(&report.socket_centre) + along)
}

/// Whether the joint reports contact.
pub(super) fn is_in_contact(report: &JointReport) -> bool {
    report.state.touches()
}

impl DrawnJoint {
    /// Whether it is a ball in a socket.
    pub fn is_ball(&self) -> bool {
        matches!(self.shape, DrawnKind::Ball)
    }

    /// Distance from its centre at which its name is beside it, m.
    pub fn beside(&self) -> f32 {
        match &self.shape {
            DrawnKind::Ball | DrawnKind::Pin(_) => self.outer,
            DrawnKind::Slide(_) => self.ball_radius,
        }
    }

    /// Vector from the centre of the carried part to where it is without play, m.
    pub fn ball_to_socket(&self) -> Vec3 {
        self.socket_centre - self.ball_centre
    }

    /// Adds joint number `i` without its socket, which [`push_sockets`] adds.
    pub fn push(
        &self,
        i: usize,
        frame: &Frame,
        fittings: &Fittings,
        (options, palette): (&ViewOptions, &Palette),
        out: &mut DrawList,
    ) {
        // What hides a wear map is seen through.
        let is_clear = options.wear != WearMap::Off && frame.joints[i].state != ContactMode::Ideal;
        let seen = |material: Material| if is_clear { material.with_opacity(WEAR_OPACITY) } else { material };
        let carried = |out: &mut DrawList, push: &dyn Fn(&mut Layer)| {
            push(if is_clear { &mut out.faded } else { &mut out.solid });
        };
        match &self.shape {
            DrawnKind::Ball => return ball::push(self, &frame.joints[i], (options, palette), out),
            DrawnKind::Pin(pin) => {
                carried(out, &|layer| pin.push_shaft(self, layer, seen(palette.ball)));
                pin.push_collars(self, palette, &mut out.faded);
                if let (true, Some(bearing)) = (options.sockets, fittings.bearing) {
                    pin.push_bearing(self, bearing, palette, &mut out.faded);
                }
            }
            DrawnKind::Slide(slide) => {
                carried(out, &|layer| slide.push_block(layer, seen(palette.material(machine::Role::Slider))));
                if options.sockets {
                    let span = fittings.guides.get(i).copied().unwrap_or_default();
                    slide.push_walls(self, span, palette, &mut out.faded);
                }
            }
        }
        if frame.joints[i].state == ContactMode::Ideal {
            return;
        }
        // Where a ball has a rim around its contact point, the others have a mark.
        let radius = self.mark_radius();
        let mark = Material { colour: palette.rim, roughness: 0.9, metal: 0.0 };
        self.contacts(&frame.joints[i], frame.sites_of(i), |contact| {
            out.solid.push(Mesh::Sphere, super::instances::ball(contact.point, radius, mark));
        });
    }

    /// Calls `visit` with the meshes, each with its linear map and its place, that make a cell of a wear map; `axes` are those of its
    /// division.
    pub fn cell(&self, cell: (&Part, usize), axes: &Mat3, visit: impl FnMut(Mesh, Mat3, Vec3)) {
        match &self.shape {
            DrawnKind::Ball => ball::cell(self, cell, axes, visit),
            DrawnKind::Pin(pin) => pin.cell(self, cell, axes, visit),
            DrawnKind::Slide(slide) => slide.cell(self, cell.0, visit),
        }
    }

    fn mark_radius(&self) -> f32 {
        match &self.shape {
            DrawnKind::Ball | DrawnKind::Pin(_) => 0.07 * self.ball_radius,
            DrawnKind::Slide(slide) => slide.mark_radius(),
        }
    }

    /// Adds the carried part as a ghost.
    pub fn push_carried(&self, layer: &mut Layer, material: Material) {
        match &self.shape {
            DrawnKind::Ball => {
                layer.push(Mesh::Sphere, super::instances::ball(self.ball_centre, self.ball_radius, material));
            }
            DrawnKind::Pin(pin) => pin.push_shaft(self, layer, material),
            DrawnKind::Slide(slide) => slide.push_block(layer, material),
        }
    }

    /// Points of the carried part that show how far it has moved.
    pub fn carried_points(&self) -> [Vec3; 2] {
        match &self.shape {
            DrawnKind::Ball => [self.ball_centre; 2],
            DrawnKind::Pin(pin) => pin.shaft_ends(self),
            DrawnKind::Slide(slide) => slide.diagonal(),
        }
    }

    /// Calls `visit` for each place that touches or exerts a force.
    pub fn contacts(&self, report: &JointReport, sites: &[SiteReport], mut visit: impl FnMut(DrawnContact)) {
        let mut at = |place, point, normal: &machine::Vec3, friction: &machine::Vec3| {
            visit(DrawnContact { place, point, normal: to_f32(normal), friction: to_f32(friction) });
        };
        if sites.is_empty() {
            if is_in_contact(report) || report.normal_force.norm_squared() > 0.0 {
                // The wall pushes the carried part away from the contact point, which therefore lies opposite to the normal force.
                let normal = to_f32(&report.normal_force).normalize_or_zero();
                let point = self.ball_centre - normal * self.ball_radius;
                at(None, point, &report.normal_force, &report.friction_force);
            }
            return;
        }
        if report.state == ContactMode::Ideal {
            return at(None, self.ball_centre, &report.normal_force, &report.friction_force);
        }
        for (place, site) in sites.iter().enumerate() {
            if site.gap < 0.0 || site.normal_force.norm_squared() > 0.0 {
                at(Some(place), self.site_point(place, site), &site.normal_force, &site.friction_force);
            }
        }
    }

    /// Point of the carried part that touches, or would, at place `place`.
    fn site_point(&self, place: usize, site: &SiteReport) -> Vec3 {
        match &self.shape {
            DrawnKind::Ball => self.ball_centre,
            DrawnKind::Pin(pin) => pin.site_point(self, place, site),
            DrawnKind::Slide(slide) => slide.corner_of(place),
        }
    }

    /// Point of the wall that a force in this direction on the carried part comes from, at place `place` if that is known.
    pub fn wall_point(&self, force: Vec3, place: Option<usize>) -> Vec3 {
        let out = -force.normalize_or_zero();
        match &self.shape {
            DrawnKind::Ball => self.socket_centre + out * self.inner,
            DrawnKind::Pin(pin) => pin.wall_point(self, out, place),
            DrawnKind::Slide(slide) => slide.wall_point(self, out, place),
        }
    }

    /// Calls `visit` with spheres (centre, radius) whose convex hull contains it.
    pub fn extent(&self, mut visit: impl FnMut(Vec3, f32)) {
        match &self.shape {
            DrawnKind::Ball => visit(self.socket_centre, self.outer),
            DrawnKind::Pin(pin) => pin.extent(self, visit),
            DrawnKind::Slide(slide) => slide.corners().for_each(|corner| visit(corner, 0.0)),
        }
    }

    /// Distance along `ray`; without its wall if that is not drawn.
    pub fn cast(&self, ray: &Ray, has_wall: bool) -> Option<f32> {
        match &self.shape {
            DrawnKind::Ball => ball::cast(self, ray, has_wall),
            DrawnKind::Pin(pin) => pin.cast(self, ray, has_wall),
            DrawnKind::Slide(slide) => slide.cast(ray),
        }
    }
}
