//! A pin in a bearing that is cut open, with its collars.
//!
//! Along the axis the bearing is drawn to scale. At each point of it, the pin's axis is drawn at m times its real distance from
//! that of the bearing: the pin leans, but its sections stay circles across the bearing's axis. So it touches the wall of radius
//! r + m c at its ends, or at the ends of the bearing, exactly when the real one does. Collars follow the tilt as planes.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Vec3};
use parry3d::query::Ray;

use super::{CELL_RADIUS, DrawnJoint, DrawnKind, IDEAL_GAP, MAX_SINE, column, ratio};
use crate::machine::{EndsOn, Geometry, LooseJoint, Pin, Role};
use crate::simulate::{Frame, JointReport, Part, SiteReport};
use crate::view::cast::cast as cast_solid;
use crate::view::instances::placed;
use crate::view::solids::{BarKind, Solid};
use crate::view::theme::Material;
use crate::view::{Layer, Mesh, MeshData, Palette, to_f32, zones};

/// Outer radius of a bearing, in inner radii.
const OUTER: f32 = 1.24;
/// Most play drawn across the axis, in radii of the pin and in lengths of the shorter part; most along it, in such lengths.
const MAX_PLAY: [f32; 2] = [0.8, 0.2];
const MAX_AXIAL_PLAY: f32 = 0.35;
/// How far the longer part is drawn beyond the shorter, if that is not known, in lengths of the shorter.
const OVERHANG: f32 = 0.25;
/// Thickness of a collar, in radii of the pin; radius of the shaft from a short pin to its collars.
const COLLAR: f32 = 0.14;
const NECK: f32 = 0.45;
/// Opacity of the half of a bearing that remains, of the half that is cut away, and of a collar.
const OPACITY: [f32; 3] = [0.42, 0.07, 0.62];
/// Width of the ring that shows the wear of a face, in radii of its collar; most that a flat facet of a cell turns, rad.
const FACE_RING: f32 = 0.2;
const FACET: f32 = TAU / 72.0;
/// Sectors of half a bearing.
const SECTORS: u32 = 48;

#[derive(Clone, Copy, Debug)]
pub struct DrawnPin {
    /// Unit vector along the bearing's axis, and across it to the side that is cut open.
    axis: Vec3,
    cut: Vec3,
    /// How far the pin's axis moves across per length along it.
    slope: Vec3,
    /// Where its middle is along the bearing's axis, m.
    at: f32,
    /// Half lengths of the bearing and of the pin, m.
    bearing: f32,
    pin: f32,
    /// Distance of the places `a` and `b` from the middle of the part that has ends, m.
    end: f32,
    ends: EndsOn,
    /// Whether it touches at one place, from end to end.
    is_planar: bool,
    collars: Option<Collars>,
}

#[derive(Clone, Copy, Debug)]
struct Collars {
    radius: f32,
    /// Radius at which they touch; `None`: on the axis, whatever the tilt.
    contact: Option<f32>,
    /// Gap to each face of the bearing while the pin is in the middle, m.
    play: f32,
}

/// Half length of the shorter part.
fn half_length(kind: &Pin, radius: f32) -> f32 {
    0.5 * kind.seat_length(f64::from(radius)) as f32
}

pub fn drawn(
    joint: &LooseJoint,
    kind: &Pin,
    (now, frame): (&JointReport, &Frame),
    opening: Vec3,
    m: f32,
) -> DrawnJoint {
    let radius = joint.contact.ball_radius as f32;
    let [bearing, pin] = joint.frames.map(|own| frame.axes_of(&own));
    let (a, b) = (bearing.column(0), pin.column(0));
    let along = a.dot(&b);
    let slope = to_f32(&(b / along - a));
    let slope = if slope.is_finite() && kind.length.is_some() { m * slope } else { Vec3::ZERO };
    let axis = column(&bearing, 0);
    let axial_play = kind.kept && now.second_clearance > 0.0;
    let real = now.axial as f32;
    let at = if axial_play { m * real } else { real };
    // The wall belongs to the longer part: where the real contact is along it, the axes are as far apart as there.
    let from = match kind.ends {
        EndsOn::Bearing if kind.length.is_some() => at - real,
        EndsOn::Bearing | EndsOn::Pin => 0.0,
    };
    let socket_centre = to_f32(&now.socket_centre);
    let eccentricity = to_f32(&now.eccentricity);
    let gap = if now.clearance > 0.0 { m * now.clearance as f32 } else { IDEAL_GAP * radius };
    let inner = radius + gap;
    let short = half_length(kind, radius);
    let face_play = if axial_play { m * now.second_clearance as f32 } else { IDEAL_GAP * radius };
    let collars = (kind.kept && kind.length.is_some()).then(|| {
        let contact = kind.face_radius.map(|radius| radius as f32);
        let hides = (OUTER * inner).min(kind.collar_radius(f64::from(radius)) as f32);
        Collars { radius: contact.map_or(hides, |contact| contact.max(1.02 * radius)), contact, play: face_play }
    });
    let beyond = kind.travel.map_or(2.0 * OVERHANG * short, |travel| travel as f32).max(0.3 * radius);
    let long = short + beyond + if collars.is_some() { 0.0 } else { (at.abs() - beyond).max(0.0) };
    let (bearing, pin) = match kind.ends {
        EndsOn::Pin if kind.length.is_some() => (long, short),
        // It carries its collars.
        EndsOn::Bearing | EndsOn::Pin if collars.is_some() => (short, long.max(short + face_play + COLLAR * radius)),
        EndsOn::Bearing | EndsOn::Pin => (short, long),
    };
    let cut = opening.reject_from_normalized(axis).try_normalize().unwrap_or(axis.any_orthonormal_vector());
    let ball_centre = socket_centre + m * eccentricity + slope * from + axis * at;
    let is_planar = kind.length.is_none();
    let shape = DrawnPin { axis, cut, slope, at, bearing, pin, end: short, ends: kind.ends, is_planar, collars };
    DrawnJoint {
        socket_centre,
        ball_centre,
        shift: ball_centre - (socket_centre + eccentricity + axis * real),
        ball_radius: radius,
        inner,
        outer: OUTER * inner,
        reach: bearing.max(pin).hypot(OUTER * inner),
        // A pin that stays in its plane is seen along its axis.
        opening: if is_planar { axis * if opening.dot(axis) < 0.0 { -1.0 } else { 1.0 } } else { cut },
        shape: DrawnKind::Pin(shape),
    }
}

/// Largest magnification that leaves the joint recognisable, and its bearing within the radius `room`, m.
pub fn limit(joint: &LooseJoint, kind: &Pin, now: &JointReport, room: f32) -> f32 {
    let radius = joint.contact.ball_radius as f32;
    let length = 2.0 * half_length(kind, radius);
    let most = (MAX_PLAY[0] * radius).min(room / OUTER - radius);
    let most = if kind.length.is_some() { most.min(MAX_PLAY[1] * length) } else { most };
    let gap = (now.clearance as f32).max(to_f32(&now.eccentricity).length());
    let axial = if kind.kept { now.second_clearance as f32 } else { 0.0 };
    ratio(most, gap).min(ratio(MAX_AXIAL_PLAY * length, axial))
}

/// A round bar on the joint's axis: the pin itself, or a bush of the bearing.
pub fn replaces(joint: &LooseJoint, body: Option<usize>, shape: &Geometry) -> bool {
    let (from, to, own) = match shape {
        Geometry::Cylinder { from, to, radius } | Geometry::Capsule { from, to, radius } => (from, to, *radius),
        _ => return false,
    };
    let radius = joint.contact.ball_radius;
    joint.frames.iter().zip([false, true]).any(|(end, is_pin)| {
        let axis = (end.rotation * crate::machine::Vec3::x()).normalize();
        let (along, apart) = (to - from, end.origin.point - from);
        let at = apart.dot(&axis) / along.dot(&axis);
        end.origin.body == body
            && along.cross(&axis).norm() < MAX_SINE * along.norm()
            && apart.cross(&axis).norm() < 0.1 * radius
            && (0.0..=1.0).contains(&at)
            && if is_pin { (own / radius - 1.0).abs() < 0.15 } else { (1.0..3.0).contains(&(own / radius)) }
    })
}

impl DrawnPin {
    /// Point of the pin's axis at `x` along that of the bearing, m.
    fn axis_at(&self, joint: &DrawnJoint, x: f32) -> Vec3 {
        joint.ball_centre + (self.axis + self.slope) * (x - self.at)
    }

    /// A round bar about the pin's axis between two places of it.
    fn bar(&self, joint: &DrawnJoint, [from, to]: [f32; 2], radius: f32) -> [Mat3; 2] {
        let across = self.axis.cross(self.cut);
        let linear = Mat3::from_cols(self.cut * radius, across * radius, (self.axis + self.slope) * (to - from));
        [linear, Mat3::from_cols(self.axis_at(joint, from), Vec3::ZERO, Vec3::ZERO)]
    }

    /// The pin, and the thinner shaft to its collars if it is shorter than the bearing.
    pub fn push_shaft(&self, joint: &DrawnJoint, layer: &mut Layer, material: Material) {
        let mut push = |half: f32, radius| {
            let [linear, at] = self.bar(joint, [self.at - half, self.at + half], radius);
            layer.push(Mesh::Cylinder, placed(linear, at.x_axis, material));
        };
        push(self.pin, joint.ball_radius);
        if let Some(collars) = self.collars {
            let half = self.bearing + collars.play + COLLAR * joint.ball_radius;
            if half > self.pin {
                push(half, NECK * joint.ball_radius);
            }
        }
    }

    pub fn push_collars(&self, joint: &DrawnJoint, palette: &Palette, layer: &mut Layer) {
        if let Some(collars) = self.collars {
            let thickness = COLLAR * joint.ball_radius;
            let material = palette.material(Role::Pin).with_opacity(OPACITY[2]);
            for side in [-1.0, 1.0] {
                let [x, y] = [self.cut, self.axis.cross(self.cut)].map(|across| self.on_collar(&collars, across));
                let face = self.collar(joint, &collars, side);
                // Its inner face is at the gap; the mesh begins at the lower one.
                let base = if side > 0.0 { face } else { face - self.axis * thickness };
                let linear = Mat3::from_cols(x * collars.radius, y * collars.radius, self.axis * thickness);
                layer.push(Mesh::Cylinder, placed(linear, base, material));
            }
        }
    }

    /// Direction in the plane of the collars' faces above the direction `across` the axis.
    fn on_collar(&self, collars: &Collars, across: Vec3) -> Vec3 {
        if collars.contact.is_some() { across - self.axis * self.slope.dot(across) } else { across }
    }

    /// Centre of the face of the collar on the side `side` of the bearing, +1 or -1. In the plane of the face, a point `p` across
    /// the axis lies at side (half bearing + play) + at - slope . p.
    fn collar(&self, joint: &DrawnJoint, collars: &Collars, side: f32) -> Vec3 {
        let flat = side * (self.bearing + collars.play) + self.at;
        if collars.contact.is_none() {
            return self.axis_at(joint, flat);
        }
        // x = flat - slope . p(x), with p(x) the pin's axis there.
        let middle = (joint.ball_centre - joint.socket_centre).reject_from_normalized(self.axis);
        let steep = self.slope.length_squared();
        let x = (flat - self.slope.dot(middle) + steep * self.at) / (1.0 + steep);
        self.axis_at(joint, x)
    }

    pub fn push_bearing(&self, joint: &DrawnJoint, mesh: Mesh, palette: &Palette, layer: &mut Layer) {
        for (cut, opacity) in [(self.cut, OPACITY[0]), (-self.cut, OPACITY[1])] {
            let across = self.axis.cross(cut);
            let linear = Mat3::from_cols(cut * joint.inner, across * joint.inner, self.axis * (2.0 * self.bearing));
            layer.push(mesh, placed(linear, joint.socket_centre, palette.socket.with_opacity(opacity)));
        }
    }

    /// Ends of the pin, collars included.
    pub fn shaft_ends(&self, joint: &DrawnJoint) -> [Vec3; 2] {
        let collars = self.collars.map_or(0.0, |collars| self.bearing + collars.play);
        let half = self.pin.max(collars);
        [self.at - half, self.at + half].map(|x| self.axis_at(joint, x))
    }

    /// Where along the bearing's axis the end `a` (`place` 0) or `b` is, m.
    fn end_at(&self, place: usize) -> f32 {
        let side = if place == 0 { -self.end } else { self.end };
        side + if self.ends == EndsOn::Pin { self.at } else { 0.0 }
    }

    /// Side of the bearing on which the face of place `place` is: moved towards +axis onto its front face, the pin's collar at the
    /// other end touches.
    fn face_side(place: usize) -> f32 {
        if place == 2 { -1.0 } else { 1.0 }
    }

    /// A cell of the bearing's wall, from the end of the shorter part to its middle, or of the ring on a face.
    pub fn cell(
        &self,
        joint: &DrawnJoint,
        (part, cell): (&Part, usize),
        axes: &Mat3,
        mut visit: impl FnMut(Mesh, Mat3, Vec3),
    ) {
        let place = usize::from(part.place);
        let [from, to] = part.edges(cell).azimuth.map_or([0.0, TAU], |edges| edges.map(|edge| edge as f32));
        let facets = ((to - from) / FACET - 0.01).ceil().max(1.0);
        let width = (to - from) / facets;
        for facet in 0..facets as u32 {
            let (sin, cos) = (from + width * (facet as f32 + 0.5)).sin_cos();
            let out = axes.x_axis * cos + axes.y_axis * sin;
            let wide = 2.0 * (0.5 * width).tan();
            if place < 2 {
                let end = self.end_at(place);
                let inwards = if place == 0 { self.end } else { -self.end };
                let [low, high] = [end, end + inwards * if self.is_planar { 2.0 } else { 1.0 }];
                let (radius, along) = (CELL_RADIUS * joint.inner, self.axis * (high - low).abs());
                let linear = Mat3::from_cols(out, self.axis.cross(out) * (wide * radius), along);
                visit(zones::SQUARE, linear, joint.socket_centre + out * radius + self.axis * (0.5 * (low + high)));
            } else {
                let outwards = self.axis * Self::face_side(place);
                let outer = self.collars.map_or(joint.outer, |collars| collars.radius);
                let band = FACE_RING * outer;
                // Seen from outside; just in front of the face.
                let linear = Mat3::from_cols(-outwards, out * band, out.cross(outwards) * (wide * outer));
                let above = self.bearing + (1.0 - CELL_RADIUS) * joint.ball_radius;
                visit(zones::SQUARE, linear, joint.socket_centre + outwards * above + out * (outer - 0.5 * band));
            }
        }
    }

    /// Where it touches, or would: of the ends `a` and `b`, of the collars `front` and `back`.
    pub fn site_point(&self, joint: &DrawnJoint, place: usize, site: &SiteReport) -> Vec3 {
        match place {
            0 | 1 => {
                let x = self.end_at(place);
                let centre = self.axis_at(joint, x);
                let out = centre - (joint.socket_centre + self.axis * x);
                centre + out.normalize_or_zero() * joint.ball_radius
            }
            _ => {
                let side = Self::face_side(place);
                let face = joint.socket_centre + self.axis * (side * self.bearing);
                match self.collars.and_then(|collars| collars.contact) {
                    None => {
                        let centre = self.axis_at(joint, side * self.bearing);
                        face + (centre - face).reject_from_normalized(self.axis)
                    }
                    Some(radius) => {
                        let out = to_f32(&site.contact_point) - joint.socket_centre;
                        face + out.reject_from_normalized(self.axis).normalize_or_zero() * radius
                    }
                }
            }
        }
    }

    /// Point of the wall, or of a face, in the direction `out`, at place `place`.
    pub fn wall_point(&self, joint: &DrawnJoint, out: Vec3, place: Option<usize>) -> Vec3 {
        let along = out.dot(self.axis);
        if self.collars.is_some() && along.abs() > 0.9 {
            // Pushed against the collar from the other side.
            return joint.socket_centre - self.axis * (self.bearing * along.signum());
        }
        let end = place.filter(|place| *place < 2).map_or(0.0, |place| self.end_at(place));
        joint.socket_centre + self.axis * end + out.reject_from_normalized(self.axis).normalize_or_zero() * joint.inner
    }

    pub fn extent(&self, joint: &DrawnJoint, mut visit: impl FnMut(Vec3, f32)) {
        for side in [-self.bearing, self.bearing] {
            visit(joint.socket_centre + self.axis * side, joint.outer);
        }
        let radius = self.collars.map_or(joint.ball_radius, |collars| collars.radius.max(joint.ball_radius));
        self.shaft_ends(joint).into_iter().for_each(|end| visit(end, radius));
    }

    pub fn cast(&self, joint: &DrawnJoint, ray: &Ray, has_wall: bool) -> Option<f32> {
        let bar = |from, to, radius| Solid::Bar { from, to, radius, kind: BarKind::Cylinder, has_cap: [false; 2] };
        let [from, to] = self.shaft_ends(joint);
        let pin = cast_solid(&bar(from, to, joint.ball_radius), ray);
        let half = self.axis * self.bearing;
        let bearing = bar(joint.socket_centre - half, joint.socket_centre + half, joint.outer);
        let bearing = has_wall.then(|| cast_solid(&bearing, ray)).flatten();
        // A ray through the half that is cut away continues inside.
        let bearing = bearing.filter(|&t| (ray.point_at(t) - joint.socket_centre).dot(self.cut) <= 0.0);
        [pin, bearing].into_iter().flatten().min_by(f32::total_cmp)
    }
}

/// Half a bearing: inner radius 1, outer radius [`OUTER`], from z = -1/2 to 1/2, cut open towards +x.
pub fn bearing() -> MeshData {
    let mut mesh = MeshData::default();
    let mut quad = |corners: [([f32; 3], [f32; 3]); 4]| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners.map(|([x, y, z], normal)| ([x, y, z, 0.0], normal)));
        mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    };
    let at = |k: u32| {
        let (sin, cos) = (PI * (0.5 + k as f32 / SECTORS as f32)).sin_cos();
        [cos, sin]
    };
    for k in 0..SECTORS {
        let [p, q] = [at(k), at(k + 1)];
        let point = |[x, y]: [f32; 2], radius: f32, z: f32| [x * radius, y * radius, z];
        let out = |[x, y]: [f32; 2]| [x, y, 0.0];
        let inwards = |[x, y]: [f32; 2]| [-x, -y, 0.0];
        let (low, high) = (-0.5, 0.5);
        quad([(p, low), (q, low), (q, high), (p, high)].map(|(c, z)| (point(c, OUTER, z), out(c))));
        quad([(q, low), (p, low), (p, high), (q, high)].map(|(c, z)| (point(c, 1.0, z), inwards(c))));
        quad([(p, OUTER), (q, OUTER), (q, 1.0), (p, 1.0)].map(|(c, r)| (point(c, r, high), [0.0, 0.0, 1.0])));
        quad([(q, OUTER), (p, OUTER), (p, 1.0), (q, 1.0)].map(|(c, r)| (point(c, r, low), [0.0, 0.0, -1.0])));
    }
    for side in [-1.0, 1.0] {
        let corners = [(1.0, -0.5), (OUTER, -0.5), (OUTER, 0.5), (1.0, 0.5)];
        let mut face = corners.map(|(y, z)| ([0.0, side * y, z], [1.0, 0.0, 0.0]));
        if side < 0.0 {
            face.reverse();
        }
        quad(face);
    }
    mesh
}
