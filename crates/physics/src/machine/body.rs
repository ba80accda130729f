//! Rigid bodies and what they look like.

use std::sync::Arc;

use super::{Mat3, Mesh, Quat, Vec3};
use crate::words::words;

/// A rigid body. The file places its frame; the centroid may lie elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Unique name.
    pub name: String,
    /// Mass, kg.
    pub mass: f64,
    /// Centroid in the body frame, m.
    pub centre: Vec3,
    /// Inertia about the centroid, body axes, kg m^2; symmetric positive definite.
    pub inertia: Mat3,
    /// What to draw, body frame.
    pub shapes: Vec<Shape>,
    /// Density of the shapes from which mass, centroid and inertia were computed, kg/m^3; `None` where the file gives those.
    pub density: Option<f64>,
}

impl Body {
    /// A body of `mass`, kg, whose centroid is the origin of its frame, with the inertia about that, kg m^2, and without shapes.
    pub fn new(name: &str, mass: f64, inertia: Mat3) -> Self {
        Self { name: name.to_owned(), mass, centre: Vec3::zeros(), inertia, shapes: Vec::new(), density: None }
    }
}

/// What a shape represents: the view picks its colour and material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A part that slides.
    Slider,
    /// A part that a drive turns: a crank.
    DrivingRod,
    /// A part that follows: a coupler, a link.
    DrivenRod,
    /// The part that does the machine's work.
    Platform,
    /// A shaft, bolt or bearing.
    Pin,
    /// A measuring tip.
    Probe,
    /// What a part slides on.
    Rail,
    /// What stands still.
    Frame,
}

words!(Role {
    Slider => "slider",
    DrivingRod => "driving-rod",
    DrivenRod => "driven-rod",
    Platform => "platform",
    Pin => "pin",
    Probe => "probe",
    Rail => "rail",
    Frame => "frame",
});

/// A drawn shape in its body's frame (or the world's).
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Form and position.
    pub geometry: Geometry,
    /// What it represents; `None` leaves that to what its body does ([`Scene::body_roles`]).
    pub role: Option<Role>,
    /// Red, green and blue (sRGB), where it is not to have the colour of its role.
    pub colour: Option<[u8; 3]>,
}

/// Form and position of a shape, m.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// Round bar with hemispherical ends.
    Capsule {
        /// One end of the axis.
        from: Vec3,
        /// Other end of the axis.
        to: Vec3,
        /// Radius.
        radius: f64,
    },
    /// Round bar with flat ends.
    Cylinder {
        /// Centre of one end.
        from: Vec3,
        /// Centre of the other end.
        to: Vec3,
        /// Radius.
        radius: f64,
    },
    /// Cone with its base at `from` and its tip at `to`.
    Cone {
        /// Centre of the base.
        from: Vec3,
        /// Tip.
        to: Vec3,
        /// Radius of the base.
        radius: f64,
    },
    /// Box along the body axes.
    Box {
        /// Centre.
        centre: Vec3,
        /// Full edge lengths.
        size: Vec3,
    },
    /// Ball.
    Sphere {
        /// Centre.
        centre: Vec3,
        /// Radius.
        radius: f64,
    },
    /// Flat plate: a polygon extruded to both sides of its plane.
    Plate {
        /// Corners in order, in one plane.
        corners: Vec<Vec3>,
        /// What fills it, as indices of corners: [`super::fill`].
        triangles: Vec<[usize; 3]>,
        /// Thickness.
        thickness: f64,
    },
    /// Triangles of a file.
    Mesh {
        /// In the file's frame and unit; shapes of the same file share them.
        mesh: Arc<Mesh>,
        /// Length of the file's unit.
        unit: f64,
        /// Origin of the file's frame.
        position: Vec3,
        /// Orientation of the file's frame.
        rotation: Quat,
    },
}
