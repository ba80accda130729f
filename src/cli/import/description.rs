//! A robot description in the terms of a scene: bodies, joints and shapes, with a list of the parts that a scene omits.

use std::collections::BTreeMap;
use std::path::{Component, Path};

use super::inertia::Inertial;
use crate::machine::{Mat3, Quat, Vec3};

/// Position, m, and orientation of an inner frame in an outer one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position of the origin, m.
    pub position: Vec3,
    /// Orientation.
    pub rotation: Quat,
}

impl Pose {
    /// The pose of a frame in itself.
    pub fn identity() -> Self {
        Self { position: Vec3::zeros(), rotation: Quat::identity() }
    }

    /// The pose of the outer frame in the inner one.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { position: -(rotation * self.position), rotation }
    }

    /// Transforms a point to the outer frame.
    pub fn point(&self, inner: Vec3) -> Vec3 {
        self.position + self.rotation * inner
    }

    /// Transforms a pose to the outer frame.
    pub fn compose(&self, inner: &Self) -> Self {
        Self { position: self.point(inner.position), rotation: self.rotation * inner.rotation }
    }

    /// Transforms mass and inertia to the outer frame.
    pub fn inertial(&self, inner: Inertial) -> Inertial {
        let turn: Mat3 = *self.rotation.to_rotation_matrix().matrix();
        Inertial {
            mass: inner.mass,
            centre: self.point(inner.centre),
            inertia: turn * inner.inertia * turn.transpose(),
        }
    }
}

/// Form of a shape about the origin of its pose.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// Radius, m.
    Sphere(f64),
    /// Half edges, m.
    Box([f64; 3]),
    /// Radius and half length along z, m.
    Cylinder(f64, f64),
    /// Radius and half length of the cylinder along z, m.
    Capsule(f64, f64),
    /// File beside the description, and the length of its unit, m.
    Mesh(String, f64),
}

/// Length of a mesh file's unit, m, or the reason why a scene cannot show a mesh of this scale.
pub fn mesh_unit(scale: [f64; 3]) -> Result<f64, &'static str> {
    match scale {
        _ if scale.iter().any(|part| *part <= 0.0) => Err("whose scale is not above 0 along every axis"),
        _ if scale != [scale[0]; 3] => Err("whose scale differs between axes"),
        [unit, ..] => Ok(unit),
    }
}

/// A shape of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Form.
    pub form: Form,
    /// Pose on the body.
    pub pose: Pose,
    /// Red, green, blue, 0 to 1.
    pub colour: Option<[f64; 3]>,
    /// Line of the description.
    pub line: u32,
}

/// A moving body.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name in the description.
    pub name: String,
    /// Mass and its distribution, in the body's axes.
    pub inertial: Inertial,
    /// Visible shapes.
    pub shapes: Vec<Shape>,
    /// Line of the description.
    pub line: u32,
}

impl Body {
    /// A body without mass and shapes.
    pub fn new(name: &str, line: u32) -> Self {
        let inertial = Inertial { mass: 0.0, centre: Vec3::zeros(), inertia: Mat3::zeros() };
        Self { name: name.to_owned(), inertial, shapes: Vec::new(), line }
    }
}

/// Motion that a joint allows; axes are given in the child's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// About the axis.
    Hinge(Vec3),
    /// Along the axis.
    Slide(Vec3),
    /// Along and about the axis.
    Cylindrical(Vec3),
    /// About an axis fixed in the parent, then about one fixed in the child.
    Universal(Vec3, Vec3),
    /// About any axis.
    Ball,
    /// Six degrees of freedom.
    Free,
}

/// A joint that carries a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name in the description.
    pub name: String,
    /// Motion that it allows.
    pub kind: Kind,
    /// Index of the body that carries it; `None` for the world.
    pub parent: Option<usize>,
    /// Index of the body that it carries.
    pub child: usize,
    /// Pose of the child in the parent where all coordinates are 0.
    pub pose: Pose,
    /// Point of the child about which it turns, m, in the child.
    pub anchor: Vec3,
    /// Springs and dampers of its coordinates.
    pub springs: Vec<Spring>,
    /// Line of the description.
    pub line: u32,
}

/// A spring with a damper on a coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Coordinate of a joint that has two.
    pub coordinate: Option<&'static str>,
    /// Whether the coordinate is an angle.
    pub is_angle: bool,
    /// N/m or N m/rad.
    pub stiffness: f64,
    /// N s/m or N m s/rad.
    pub damping: f64,
    /// Coordinate without force, m or rad.
    pub rest: f64,
}

/// A joint that closes a loop.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Name in the description.
    pub name: String,
    /// Both bodies; `None` for the world.
    pub bodies: [Option<usize>; 2],
    /// The common frame on each; a ball joint has only its origin in common.
    pub frames: [Pose; 2],
    /// Whether it allows no motion. Otherwise it is a ball joint, with its socket on the first body and its ball on the second.
    pub is_fixed: bool,
    /// Line of the description.
    pub line: u32,
}

/// A robot description.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Description {
    /// Its name.
    pub name: String,
    /// Gravity, m/s^2.
    pub gravity: Vec3,
    /// Moving bodies; the joint that carries a body has the same index.
    pub bodies: Vec<Body>,
    /// One for each body, a parent's before its child's.
    pub joints: Vec<Joint>,
    /// Joints that close loops.
    pub closures: Vec<Closure>,
    /// Shapes that do not move.
    pub fixed: Vec<Shape>,
    /// Omitted parts: first line and number of occurrences, by description.
    omitted: BTreeMap<String, (u32, usize)>,
}

impl Description {
    /// A description without parts, under the gravity of the Earth along -z, the default of both formats.
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), gravity: Vec3::new(0.0, 0.0, -9.81), ..Self::default() }
    }

    /// Records that `what`, on line `line`, is omitted.
    pub fn omit(&mut self, line: u32, what: impl Into<String>) {
        let (first, count) = self.omitted.entry(what.into()).or_insert((line, 0));
        *first = line.min(*first);
        *count += 1;
    }

    /// Whether a body needs no mass, because it lies between joints with one coordinate or two.
    pub fn only_connects(&self, body: usize) -> bool {
        let constrains = |joint: &Joint| !matches!(joint.kind, Kind::Ball | Kind::Free);
        let mut carried = self.joints.iter().filter(|joint| joint.parent == Some(body)).peekable();
        constrains(&self.joints[body]) && carried.peek().is_some() && carried.all(constrains)
    }

    /// Messages about the omitted parts, in the order of the file.
    pub fn omissions(&self) -> Vec<String> {
        let mut all: Vec<_> = self.omitted.iter().map(|(what, (line, count))| (*line, what, *count)).collect();
        all.sort();
        let others = |count: usize| if count > 1 { format!(", and {} more", count - 1) } else { String::new() };
        all.into_iter().map(|(line, what, count)| format!("omitted: {what} (line {line}{})", others(count))).collect()
    }

    /// Pose in the world of each body where all coordinates are 0.
    pub fn poses(&self) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::new();
        for joint in &self.joints {
            let parent = joint.parent.map_or_else(Pose::identity, |parent| poses[parent]);
            poses.push(parent.compose(&joint.pose));
        }
        poses
    }

    /// Omits meshes that a scene in `folder` could not read.
    pub fn omit_unreadable_meshes(&mut self, folder: &Path) {
        let mut missing = Vec::new();
        let mut is_readable = |shape: &Shape| {
            let Form::Mesh(file, _) = &shape.form else {
                return true;
            };
            let is_inside = Path::new(file).components().all(|part| matches!(part, Component::Normal(_)));
            let is_supported = [".stl", ".obj", ".gltf", ".glb"].iter().any(|end| file.to_lowercase().ends_with(end));
            let why = match (is_supported, is_inside, is_inside && folder.join(file).is_file()) {
                (false, ..) => "is not STL, OBJ or glTF",
                (_, false, _) => "is not in the folder of the description or below it",
                (.., false) => "does not exist",
                _ => return true,
            };
            missing.push((shape.line, format!("mesh {file}, which {why}")));
            false
        };
        self.fixed.retain(&mut is_readable);
        self.bodies.iter_mut().for_each(|body| body.shapes.retain(&mut is_readable));
        for (line, what) in missing {
            self.omit(line, what);
        }
    }
}
