//! Positions of everything drawn at one instant: the single source for drawing, picking and bounds.
//!
//! Bodies are drawn in place, joints with their play magnified; only the end of a bar that carries a ball, a pin or a block moves
//! with it, so that no gap opens between them.

use std::sync::Arc;

use glam::Vec3;
use parry3d::shape::SharedShape;

use super::cast::distance;
use super::joint::{self, DrawnJoint};
use super::solids::{BarKind, Pose, Solid};
use super::surface::surface;
use super::theme::Material;
use super::{Colour, Mesh, MeshData, Palette, to_f32, zones};
use crate::machine::{Geometry, Role, Shape};
use crate::mesh;
use crate::scene::{Scene, sticks};
use crate::simulate::Frame;

/// A shape of the scene, in its body's frame.
pub(super) struct DrawnShape {
    /// Body; `None` is the world.
    pub body: Option<usize>,
    /// Index among `fixed_shapes`, or among the body's shapes.
    pub index: usize,
    pub role: Role,
    /// Colour set in the scene.
    colour: Option<Colour>,
    form: Form,
}

enum Form {
    Bar { ends: [End; 2], radius: f32, kind: BarKind },
    Box { centre: Vec3, size: Vec3 },
    Ball { centre: Vec3, radius: f32 },
    Mesh { triangles: SceneMesh, pose_in_body: Pose },
}

/// A mesh specific to the scene.
#[derive(Clone)]
struct SceneMesh {
    mesh: Mesh,
    /// Shape for ray casts.
    shape: Option<SharedShape>,
    /// Points whose convex hull contains the mesh.
    points: Arc<[Vec3]>,
}

/// End of a bar, and the joint with play it reaches into.
struct End {
    point: Vec3,
    joint: Option<JointEnd>,
}

#[derive(Clone, Copy)]
enum JointEnd {
    /// The joint's ball, pin or block is on this end.
    Ball(usize),
    /// The joint's socket or bearing is in front of this end.
    Socket(usize),
}

/// Shapes of `scene`, and the meshes that are not shared: those of wear maps, then its plates and the
/// meshes of its files.
pub(super) fn parts(scene: &Scene) -> (Vec<DrawnShape>, Vec<MeshData>) {
    let mut meshes = Meshes { data: zones::meshes(), from_files: Vec::new() };
    let mut parts = Vec::new();
    let roles = scene.machine.body_roles();
    let fixed = scene.machine.fixed_shapes.iter().enumerate().map(|(i, shape)| (None, i, shape));
    let sticks = sticks(scene);
    let moving = scene.machine.bodies.iter().enumerate().flat_map(|(b, body)| {
        let shapes = sticks.get(&b).unwrap_or(&body.shapes);
        shapes.iter().enumerate().map(move |(i, shape)| (Some(b), i, shape))
    });
    for (body, index, shape) in fixed.chain(moving) {
        if let Some(form) = form(scene, body, shape, &mut meshes) {
            parts.push(DrawnShape {
                body,
                index,
                role: shape.role.unwrap_or_else(|| body.map_or(Role::Frame, |body| roles[body])),
                colour: shape.colour.map(|[red, green, blue]| Colour::hex(u32::from_be_bytes([0, red, green, blue]))),
                form,
            });
        }
    }
    let is_probe_drawn = parts.iter().any(|part| part.role == Role::Probe);
    if let (Some(tip), false) = (&scene.machine.output.probe, is_probe_drawn) {
        let size = scene.machine.loose_joints.first().map_or(0.01, |joint| joint.contact.ball_radius) as f32;
        let form = Form::Ball { centre: to_f32(tip), radius: 0.4 * size };
        parts.push(DrawnShape {
            body: Some(scene.machine.output.body),
            index: 0,
            role: Role::Probe,
            colour: None,
            form,
        });
    }
    (parts, meshes.data)
}

fn form(scene: &Scene, body: Option<usize>, shape: &Shape, meshes: &mut Meshes) -> Option<Form> {
    // A joint draws its own ball, pin or block.
    if scene.machine.loose_joints.iter().any(|own| joint::replaces(own, body, &shape.geometry)) {
        return None;
    }
    let bar = |from, to, radius: f64, kind| {
        let ends = [from, to].map(|point| {
            let point = to_f32(point);
            End { point, joint: joint_at_end(scene, body, point) }
        });
        Some(Form::Bar { ends, radius: radius as f32, kind })
    };
    match &shape.geometry {
        Geometry::Capsule { from, to, radius } => bar(from, to, *radius, BarKind::Capsule),
        Geometry::Cylinder { from, to, radius } => bar(from, to, *radius, BarKind::Cylinder),
        Geometry::Cone { from, to, radius } => bar(from, to, *radius, BarKind::Cone),
        Geometry::Box { centre, size } => Some(Form::Box { centre: to_f32(centre), size: to_f32(size) }),
        Geometry::Sphere { centre, radius } => Some(Form::Ball { centre: to_f32(centre), radius: *radius as f32 }),
        Geometry::Plate { corners, triangles, thickness } => {
            let corners: Vec<Vec3> = corners.iter().map(to_f32).collect();
            let mesh = plate(&corners, triangles, *thickness as f32)?;
            let points: Vec<Vec3> = mesh.vertices.iter().map(|(p, _)| Vec3::new(p[0], p[1], p[2])).collect();
            let faces = mesh.indices.chunks_exact(3).map(|face| [face[0], face[1], face[2]]).collect();
            let shape = if HAS_MESHES && !is_convex(&corners, triangles) {
                SharedShape::trimesh(points.clone(), faces).ok()
            } else {
                SharedShape::convex_hull(&points)
            };
            let triangles = SceneMesh { shape, points: points.into(), mesh: meshes.add(mesh)? };
            let pose_in_body = Pose::WORLD;
            Some(Form::Mesh { triangles, pose_in_body })
        }
        Geometry::Mesh { mesh, unit, position, rotation } => Some(Form::Mesh {
            triangles: meshes.file_mesh(mesh, *unit)?,
            pose_in_body: Pose::new(position, &rotation.to_rotation_matrix().into_inner()),
        }),
    }
}

/// Whether picking tests the faces of meshes. The page reads no files: it omits that code and picks a plate by its convex hull.
const HAS_MESHES: bool = cfg!(not(target_arch = "wasm32"));

/// Meshes that are not shared by all scenes.
struct Meshes {
    data: Vec<MeshData>,
    /// Meshes of files, with the length of the file's unit, m.
    from_files: Vec<(Arc<mesh::Mesh>, f64, SceneMesh)>,
}

impl Meshes {
    fn add(&mut self, mesh: MeshData) -> Option<Mesh> {
        let id = u16::try_from(self.data.len()).ok()?;
        self.data.push(mesh);
        Some(Mesh::Plate(id))
    }

    /// The mesh of a file, shared by all shapes that use it.
    fn file_mesh(&mut self, file: &Arc<mesh::Mesh>, unit: f64) -> Option<SceneMesh> {
        let same =
            |(other, length, _): &&(Arc<mesh::Mesh>, f64, SceneMesh)| Arc::ptr_eq(other, file) && *length == unit;
        if let Some((_, _, known)) = self.from_files.iter().find(same) {
            return Some(known.clone());
        }
        let scaled = |p: &[f32; 3]| Vec3::from(p.map(|x| (f64::from(x) * unit) as f32));
        let vertices = file.vertices().iter().map(scaled).collect();
        let bounds = file.bounds().map(|end| scaled(&end));
        let corner = |i: usize| Vec3::from([0, 1, 2].map(|axis| bounds[i >> axis & 1][axis]));
        let shape = if HAS_MESHES { SharedShape::trimesh(vertices, file.triangles().to_vec()).ok() } else { None };
        let scene_mesh =
            SceneMesh { shape, points: (0..8).map(corner).collect(), mesh: self.add(surface(file, unit))? };
        self.from_files.push((file.clone(), unit, scene_mesh.clone()));
        Some(scene_mesh)
    }
}

/// The joint with play that a bar's end reaches into, if any.
fn joint_at_end(scene: &Scene, body: Option<usize>, end: Vec3) -> Option<JointEnd> {
    for (i, own) in scene.machine.loose_joints.iter().enumerate() {
        if own.carried().body == body && joint::holds_end(own, end) {
            return Some(JointEnd::Ball(i));
        }
        if own.carrier().body == body && to_f32(&own.carrier().point).distance(end) < joint::wall_reach(own) {
            return Some(JointEnd::Socket(i));
        }
    }
    None
}

/// Whether a polygon filled by `triangles` is convex.
fn is_convex(corners: &[Vec3], triangles: &[[usize; 3]]) -> bool {
    let area = |&[i, j, k]: &[usize; 3]| (corners[j] - corners[i]).cross(corners[k] - corners[i]);
    let (normal, n) = (triangles.iter().map(area).sum::<Vec3>(), corners.len());
    (0..n).all(|i| area(&[i, (i + 1) % n, (i + 2) % n]).dot(normal) >= 0.0)
}

/// Prism over a polygon filled by `triangles`, extruded by half the thickness to both sides.
fn plate(corners: &[Vec3], triangles: &[[usize; 3]], thickness: f32) -> Option<MeshData> {
    let n = corners.len();
    let area = |&[i, j, k]: &[usize; 3]| (corners[j] - corners[i]).cross(corners[k] - corners[i]);
    let normal = triangles.iter().map(area).sum::<Vec3>().try_normalize()?;
    let mut mesh = MeshData::default();
    let mut face = |points: &[Vec3], normal: Vec3, triangles: &[[usize; 3]]| {
        let first = mesh.vertices.len();
        mesh.vertices.extend(points.iter().map(|p| ([p.x, p.y, p.z, 0.0], normal.to_array())));
        mesh.indices.extend(triangles.as_flattened().iter().map(|i| (first + i) as u32));
    };
    let half = normal * (thickness / 2.0);
    let top: Vec<Vec3> = corners.iter().map(|&c| c + half).collect();
    let bottom: Vec<Vec3> = corners.iter().map(|&c| c - half).collect();
    let from_below: Vec<[usize; 3]> = triangles.iter().map(|&[i, j, k]| [k, j, i]).collect();
    face(&top, normal, triangles);
    face(&bottom, -normal, &from_below);
    for i in 0..n {
        let (a, b) = (corners[i], corners[(i + 1) % n]);
        let out = (b - a).cross(normal).normalize_or_zero();
        face(&[a - half, b - half, b + half, a + half], out, &[[0, 1, 2], [0, 2, 3]]);
    }
    Some(mesh)
}

impl DrawnShape {
    /// Its colour and finish.
    pub fn material(&self, palette: &Palette) -> Material {
        let material = palette.material(self.role);
        Material { colour: self.colour.unwrap_or(material.colour), ..material }
    }

    /// Whether it is a bar.
    pub fn is_bar(&self) -> bool {
        matches!(self.form, Form::Bar { .. })
    }

    /// Whether it ends at the outer face of the socket or bearing of joint `joint`.
    pub fn reaches_socket(&self, joint: usize) -> bool {
        match &self.form {
            Form::Bar { ends, .. } => {
                ends.iter().any(|end| matches!(end.joint, Some(JointEnd::Socket(j)) if j == joint))
            }
            _ => false,
        }
    }

    /// The part placed in `frame`, its ends fitted to the drawn joints.
    pub fn place(&self, frame: &Frame, joints: &[DrawnJoint]) -> Solid<'_> {
        let pose = Pose::in_frame(frame, self.body);
        match &self.form {
            Form::Bar { ends, radius, kind } => {
                let mut points = [pose.apply(ends[0].point), pose.apply(ends[1].point)];
                let mut has_cap = [true; 2];
                for i in 0..2 {
                    match ends[i].joint {
                        Some(JointEnd::Ball(j)) => points[i] += joints.get(j).map_or(Vec3::ZERO, |joint| joint.shift),
                        Some(JointEnd::Socket(j)) => {
                            let cut = joints.get(j).and_then(|joint| end_at_socket(points[1 - i], points[i], joint));
                            if let Some(point) = cut {
                                (points[i], has_cap[i]) = (point, false);
                            }
                        }
                        None => {}
                    }
                }
                Solid::Bar { from: points[0], to: points[1], radius: *radius, kind: *kind, has_cap }
            }
            Form::Box { centre, size } => {
                Solid::Box { centre: pose.apply(*centre), size: *size, rotation: pose.rotation }
            }
            Form::Ball { centre, radius } => Solid::Ball { centre: pose.apply(*centre), radius: *radius },
            Form::Mesh { triangles, pose_in_body } => Solid::Mesh {
                mesh: triangles.mesh,
                shape: triangles.shape.as_ref(),
                points: &triangles.points,
                pose: pose.compose(pose_in_body),
            },
        }
    }
}

/// New end of a bar from `start` to `end` that reaches into a drawn socket or bearing: on the outer face.
fn end_at_socket(start: Vec3, end: Vec3, joint: &DrawnJoint) -> Option<Vec3> {
    let radius = 0.99 * joint.outer;
    let to_end = end - joint.socket_centre;
    if to_end.length() >= radius {
        return None;
    }
    if start.distance(joint.socket_centre) <= radius {
        // Entirely inside: nothing left to draw.
        return Some(start);
    }
    // |to_end + s along| = radius for the s > 0 towards the start.
    let along = (start - end).normalize_or_zero();
    let b = to_end.dot(along);
    let s = -b + (b * b + radius * radius - to_end.length_squared()).sqrt();
    Some(end + along * s)
}

/// Outer radius, m, to which the socket or bearing of each joint may grow before it intersects the part that carries it, with
/// `joints` drawn without magnification. Parts that it already touches, or that end at its outer face, do not limit it.
pub(super) fn max_outer_radii(scene: &Scene, parts: &[DrawnShape], frame: &Frame, joints: &[DrawnJoint]) -> Vec<f32> {
    let max_outer_radius = |(i, joint): (usize, &DrawnJoint)| {
        let body = scene.machine.loose_joints[i].carrier().body;
        parts
            .iter()
            .filter(|part| part.body == body && !part.reaches_socket(i))
            .filter_map(|part| distance(&part.place(frame, joints), joint.socket_centre))
            .filter(|&distance| distance > joint.outer)
            .fold(f32::INFINITY, f32::min)
    };
    joints.iter().enumerate().map(max_outer_radius).collect()
}
