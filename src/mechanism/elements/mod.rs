//! Force elements: what pushes bodies without a constraint. Each kind is one file. Loose ball joints are among them; the others
//! are those of a scene's own list, each kind with a row below.

mod contact;
mod load;
mod pull;
mod spring;

pub(super) use contact::Contact;
pub use contact::Gap;

use super::Powers;
use super::contacts::{Counts, Touching};
use super::kinematics::{Kinematics, Wrench};
use super::model::{Anchor, Model};
use crate::contact::Stiffness;
use crate::scene::{Attachment, Element, Mat3, Scene, Vec3};
pub use pull::Pull;

/// Motion of the bodies at `t`, s, and what decides which contacts carry a force.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    pub t: f64,
    pub motion: &'a [Kinematics],
    pub touching: Touching<'a>,
}

/// What elements add to at an evaluation.
pub(super) struct Loads<'a> {
    /// On the bodies, about their centroids; the last is the world's.
    pub wrench: &'a mut [Wrench],
    pub counts: &'a mut Counts,
    /// A sliding speed or a penetration rate was beyond the piece of its law that the memory holds.
    pub left_piece: bool,
}

/// How the force between two points answers to their relative motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coupling {
    /// The points, first the one that `force` acts on, each with how far beyond it along `normal` its body is pushed, m.
    pub sides: [(Anchor, f64); 2],
    /// Zero where the bodies are pushed at the points.
    pub normal: Vec3,
    /// Force on the first, N, where it acts along a normal that turns with the points; zero elsewhere.
    pub force: Vec3,
    /// Derivatives of the force.
    pub stiffness: Stiffness,
    /// Whether the part of it by slip follows the surfaces and not the points.
    pub reads_surfaces: bool,
}

impl Coupling {
    /// Of a force on the second of two points that acts there: by their distance, N/m, and by its rate, N s/m.
    fn between_points([from, to]: [Anchor; 2], by_displacement: Mat3, by_rate: Mat3) -> Self {
        Self {
            sides: [(to, 0.0), (from, 0.0)],
            normal: Vec3::zeros(),
            force: Vec3::zeros(),
            stiffness: Stiffness::between_points(by_displacement, by_rate),
            reads_surfaces: false,
        }
    }
}

/// What an element reports of an instant. SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ElementReport {
    /// Where it acts: both points of an element between two, the same point twice of another, m.
    pub points: [Vec3; 2],
    /// Force on the second, N.
    pub force: Vec3,
    /// Torque on the body, N m, of a kind that has one.
    pub torque: Option<Vec3>,
}

/// Something that loads bodies by their motion and by time. Allocates nothing.
pub(super) trait ForceElement: Send {
    /// Adds its loads.
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>);

    /// The two points to whose relative motion it answers; `None` where nothing of it is stiff.
    fn ends(&self) -> Option<[Anchor; 2]>;

    /// How it answers there, after an evaluation; `None` where it does not.
    fn coupling(&self, at: &At<'_>) -> Option<Coupling>;

    /// Energy stored, J; of a contact that at the gap last measured.
    fn stored(&self, motion: &[Kinematics]) -> f64;

    /// Adds its powers at `t`, after an evaluation.
    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers);
}

/// One of a scene's own list. A ball joint is reported as one, loose or not.
pub(super) trait SceneElement: ForceElement {
    /// Period of what it does by time alone, s; infinite where that does not change.
    fn period(&self) -> f64 {
        f64::INFINITY
    }

    /// What it does at `t`.
    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport;
}

/// Makes the element of one kind; its points as anchors.
type Make = fn(&Element, &[Anchor]) -> Box<dyn SceneElement>;

/// Every kind by its section.
const KINDS: [(&str, Make); 2] = [("spring", spring::make), ("load", load::make)];

/// The force elements of `scene`, in its order.
pub(super) fn elements_of(scene: &Scene, model: &Model) -> Vec<Box<dyn SceneElement>> {
    let make = |element: &Element| {
        let anchors: Vec<Anchor> = element
            .points
            .iter()
            .map(|point| model.anchor(scene, point))
            .collect();
        let (_, make) = KINDS
            .iter()
            .find(|(section, _)| *section == element.kind.section)
            .expect("every kind of the scene format has its element");
        make(element, &anchors)
    };
    scene.elements.iter().map(make).collect()
}

/// The element of a hand that pulls.
pub(super) fn hand(scene: &Scene, model: &Model, pull: Pull) -> Box<dyn SceneElement> {
    let point = Attachment {
        body: Some(pull.body),
        point: pull.point,
    };
    let on = model.anchor(scene, &point);
    Box::new(pull::Hand { on, pull })
}

/// Position and velocity of a point, m and m/s, and its arm from the centroid.
fn point_of(anchor: &Anchor, motion: &[Kinematics]) -> (Vec3, Vec3, Vec3) {
    let m = &motion[anchor.body];
    let arm = m.rotation * anchor.offset;
    (m.position + arm, m.point_velocity(&arm), arm)
}

/// Adds a force at an arm from a body's centroid.
fn push(wrench: &mut Wrench, arm: &Vec3, force: &Vec3) {
    wrench.force += force;
    wrench.torque += arm.cross(force);
}
