//! Force elements other than contacts: what pushes bodies without a constraint. Each kind is one file, and a row below.

mod load;
mod pull;
mod spring;

use super::kinematics::{Kinematics, Wrench};
use super::model::{Anchor, Model};
use crate::scene::{Attachment, Element, Mat3, Scene, Vec3};
pub use pull::Pull;

/// How the force of an element between two points answers to their relative motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coupling {
    /// dF/d(e) of the force F on `to`, by the distance e from `from` to `to`, N/m.
    pub by_displacement: Mat3,
    /// dF/d(e_dot), N s/m.
    pub by_rate: Mat3,
}

/// Powers of an element, W.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ElementPowers {
    /// Turned into heat.
    pub dissipated: f64,
    /// Given by what is outside of the scene.
    pub supplied: f64,
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

/// Something that loads bodies by their motion and by time.
pub(super) trait ForceElement: Send {
    /// Adds its loads at `t` to those on the bodies, about their centroids. Allocates nothing.
    fn load(&self, t: f64, motion: &[Kinematics], wrench: &mut [Wrench]);

    /// The two points that it couples, and how; `None` where nothing of it is stiff.
    fn coupling(&self, motion: &[Kinematics]) -> Option<([Anchor; 2], Coupling)>;

    /// Energy stored, J.
    fn stored(&self, motion: &[Kinematics]) -> f64;

    /// Powers at `t`.
    fn powers(&self, t: f64, motion: &[Kinematics]) -> ElementPowers;

    /// Period of what it does by time alone, s; infinite where that does not change.
    fn period(&self) -> f64 {
        f64::INFINITY
    }

    /// What it does at `t`.
    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport;
}

/// Makes the element of one kind; its points as anchors.
type Make = fn(&Element, &[Anchor]) -> Box<dyn ForceElement>;

/// Every kind by its section.
const KINDS: [(&str, Make); 2] = [("spring", spring::make), ("load", load::make)];

/// The force elements of `scene`, in its order.
pub(super) fn elements_of(scene: &Scene, model: &Model) -> Vec<Box<dyn ForceElement>> {
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
pub(super) fn hand(scene: &Scene, model: &Model, pull: Pull) -> Box<dyn ForceElement> {
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
