//! Rigid bodies and their appearance.

use std::sync::Arc;

use super::{Mat3, Mesh, Quat, Vec3};
use crate::words::words;

/// A rigid body. The scene places its frame; the centroid may lie elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Unique name.
    pub name: String,
    /// Mass, kg; 0 for a body that only connects joints, see [`super::MasslessFault`].
    pub mass: f64,
    /// Centroid in the body frame, m.
    pub centre: Vec3,
    /// Inertia about the centroid, body axes, kg m^2; symmetric positive definite, or 0 with the mass.
    pub inertia: Mat3,
    /// Shapes to draw, body frame.
    pub shapes: Vec<Shape>,
    /// Density of the shapes from which mass, centroid and inertia were computed, kg/m^3; `None` if the file gives these.
    pub density: Option<f64>,
}

impl Body {
    /// A body of mass `mass` (kg) without shapes, whose centroid is the frame origin; `inertia` (kg m^2) is about the centroid.
    pub fn new(name: &str, mass: f64, inertia: Mat3) -> Self {
        Self { name: name.to_owned(), mass, centre: Vec3::zeros(), inertia, shapes: Vec::new(), density: None }
    }
}

/// Role of a shape, which determines its colour and material in the view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A sliding part.
    Slider,
    /// A part turned by a drive: a crank.
    DrivingRod,
    /// A passive part: a coupler, a link.
    DrivenRod,
    /// The part that does the machine's work.
    Platform,
    /// A shaft, bolt or bearing.
    Pin,
    /// A measuring tip.
    Probe,
    /// A guide on which a part slides.
    Rail,
    /// Fixed structure.
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
    /// Role; `None` takes that of its body ([`super::Machine::body_roles`]).
    pub role: Option<Role>,
    /// Red, green and blue (sRGB), in place of the role's colour.
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
        /// Triangulation, as indices of corners ([`super::triangulate`]).
        triangles: Vec<[usize; 3]>,
        /// Thickness.
        thickness: f64,
    },
    /// Triangle mesh from a file.
    Mesh {
        /// Mesh in the file's frame and unit, shared by all shapes of that file.
        mesh: Arc<Mesh>,
        /// Length of the file's unit.
        unit: f64,
        /// Origin of the file's frame.
        position: Vec3,
        /// Orientation of the file's frame.
        rotation: Quat,
    },
}
