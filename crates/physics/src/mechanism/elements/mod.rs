//! Force elements: everything that loads bodies without a constraint, one file per kind. The contacts of joints with play are among
//! them; the others come from the scene's list, each kind with an entry below.

mod bushing;
mod characteristic;
mod contact;
mod coordinate;
mod film;
mod joint_spring;
mod load;
mod motor;
mod pull;
mod spring;
mod stop;
mod tyre;

pub(super) use contact::Contact;
pub use contact::Gap;

use serde::{Deserialize, Serialize};

use super::Contacts;
use super::drives::law_of;
use super::kinematics::{Kinematics, Wrench};
use super::loose::Spot;
use super::model::{Anchor, Model};
use crate::contact::{ContactState, Stiffness};
use crate::machine::{self, Attachment, Element, ElementKind, JointCoordinate, LoadAxes, Machine, Mat3, Vec3};
use bushing::Bushing;
pub(super) use coordinate::AngleReference;
use coordinate::{Coordinate, OnCoordinate};
pub(super) use film::Film;
use joint_spring::JointSpring;
use load::Load;
use motor::Motor;
pub use pull::Pull;
use spring::Spring;
use stop::Stop;
use tyre::Tyre;

/// Determines which contacts carry a force.
#[derive(Clone, Copy, Debug)]
pub enum ActiveSet<'a> {
    /// By the contact state: the stepper locates the events that change it.
    Located(&'a [ContactState]),
    /// By penetration at every evaluation: for steppers without event location.
    Immediate(&'a [ContactState]),
    /// No contact carries a force.
    Nothing,
    /// No contact carries a force, nor does a film: they are solved for.
    Solved,
}

impl<'a> ActiveSet<'a> {
    /// By the contact state if events are `located`, otherwise by penetration.
    pub fn by(located: bool, contact_states: &'a [ContactState]) -> Self {
        if located { Self::Located(contact_states) } else { Self::Immediate(contact_states) }
    }

    /// Contact state of joint `j` if it may carry a force.
    #[inline]
    pub(in crate::mechanism) fn contact_state(self, j: usize) -> Option<&'a ContactState> {
        match self {
            Self::Located(all) => Some(&all[j]).filter(|state| state.active),
            Self::Immediate(all) => Some(&all[j]),
            Self::Nothing | Self::Solved => None,
        }
    }
}

/// Evaluation counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Evaluations of the equations of motion.
    pub equations: u64,
    /// Evaluations of all contacts at an instant; 0 in a scene without clearance.
    pub contacts: u64,
    /// Evaluations of one contact's friction; 0 in a scene without friction.
    pub friction: u64,
    /// Approximate time of linear algebra beside the evaluations, ns, as estimated for the bounds of a run.
    pub algebra: u64,
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.equations += other.equations;
        self.contacts += other.contacts;
        self.friction += other.friction;
        self.algebra += other.algebra;
    }
}

/// Motion of the bodies at `t`, s, and the active contacts.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    pub t: f64,
    pub motion: &'a [Kinematics],
    pub active_set: ActiveSet<'a>,
    /// Deflections of the contacts' bristles, m; empty without any.
    pub bristles: &'a [f64],
}

/// A number that shows on which side of an edge of its force an element is.
#[derive(Clone, Copy, Debug)]
pub enum EdgeIndicator {
    /// In any unit; above 0 where the element presses.
    Contact(f64),
    /// The same of a force whose slope has a vertical tangent at first contact.
    VerticalOnset(f64),
    /// Number of kinks passed, plus a fraction that grows from 0 to 1 up to the next.
    Segment(f64),
}

/// Edges of one element: depth of contact, and the smaller of that and an indicator that falls to 0 when contact is lost while still
/// compressed; then the segments of its elastic and of its damping force. All are `None` where it has no such edge.
pub(super) type Edges = [Option<EdgeIndicator>; 4];

impl EdgeIndicator {
    /// The number, which is continuous.
    pub fn value(self) -> f64 {
        match self {
            Self::Contact(value) | Self::VerticalOnset(value) | Self::Segment(value) => value,
        }
    }

    /// The largest whole number, kinks passed or 1 for an element that presses, not above the indicator.
    pub fn side(self) -> f64 {
        match self {
            Self::Contact(value) | Self::VerticalOnset(value) => f64::from(value > 0.0),
            Self::Segment(value) => value.floor(),
        }
    }

    /// Whether the element presses.
    fn presses(self) -> bool {
        self.side() > 0.0
    }

    /// Whether it presses with a force whose slope was vertical at first contact.
    pub fn has_vertical_onset(&self) -> bool {
        matches!(self, Self::VerticalOnset(value) if *value > 0.0)
    }

    /// The value at the first edge on the way to `later`, if there is one.
    pub(crate) fn edge_towards(self, later: Self) -> Option<f64> {
        let [from, to] = [self.side(), later.side()];
        match self {
            _ if from == to => None,
            Self::Segment(_) if from < to => Some(from + 1.0),
            Self::Segment(_) => Some(from),
            Self::Contact(_) | Self::VerticalOnset(_) => Some(0.0),
        }
    }
}

/// Accumulators of an evaluation.
pub(super) struct Loads<'a> {
    /// Loads on the bodies about their centroids; the last is the world's.
    pub(crate) wrench: &'a mut [Wrench],
    pub counts: &'a mut Counts,
    /// By contact: set where it leaves the frozen branches of its laws. Empty if that is not recorded.
    pub(crate) has_left_branch: &'a mut [bool],
}

/// Linearisation of the force between two points with respect to their relative motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coupling {
    /// The points, first the one `force` acts on, each with the distance from it to the point of application along `normal`, m.
    pub sides: [(Anchor, f64); 2],
    /// Zero if the force acts at the points themselves.
    pub normal: Vec3,
    /// Force on the first, N, if it acts along a normal that rotates with the points; otherwise zero.
    pub force: Vec3,
    /// Derivatives of the force.
    pub stiffness: Stiffness,
    /// Whether the slip-dependent part follows the surfaces rather than the points.
    pub(crate) uses_surface_velocity: bool,
    /// For an element between coincident points of two bodies, in axes fixed to the bodies: the dependence of its torque on their
    /// relative rotation. A common rotation of both bodies leaves force and torque unchanged.
    pub(crate) torque_derivatives: Option<TorqueDerivatives>,
}

/// Linearisation of the torque on the first of two bodies (and its opposite on the second) with respect to their relative motion.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TorqueDerivatives {
    /// Derivatives with respect to relative rotation, N m/rad, and to relative angular velocity, N m s/rad.
    pub(crate) by_rotation: Mat3,
    pub(crate) by_angular_velocity: Mat3,
    /// By positions and by velocities, if it has such: derivatives of the force with respect to the relative rotation, N/rad or N s/rad,
    /// and of the torque with respect to the displacement, N or N s.
    pub(crate) mixed: Option<[[Mat3; 2]; 2]>,
}

impl Coupling {
    /// For a force acting at the second of two points: derivatives with respect to their displacement, N/m, and its rate, N s/m.
    fn between_points([from, to]: [Anchor; 2], by_displacement: Mat3, by_rate: Mat3) -> Self {
        Self {
            sides: [(to, 0.0), (from, 0.0)],
            normal: Vec3::zeros(),
            force: Vec3::zeros(),
            stiffness: Stiffness::between_points(by_displacement, by_rate),
            uses_surface_velocity: false,
            torque_derivatives: None,
        }
    }

    /// For a force at the second of two coincident points, N/m and N s/m, and a torque on its body.
    fn at_one_point(
        [from, to]: [Anchor; 2],
        [by_displacement, by_rate]: [Mat3; 2],
        torque_derivatives: TorqueDerivatives,
    ) -> Self {
        let mut coupling = Self::between_points([from, to], by_displacement, by_rate);
        // With these distances, `Column::turn` is the relative angular velocity itself.
        coupling.sides = [(to, 1.0), (from, 1.0)];
        coupling.torque_derivatives = Some(torque_derivatives);
        coupling
    }
}

/// Report of an element at one instant. SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ElementReport {
    /// Points of application, m: both points of an element between two, otherwise the same point twice.
    pub points: [Vec3; 2],
    /// Force on the second point, N.
    pub force: Vec3,
    /// Torque on the body, N m, if any; for an element on a hinge, on the child.
    pub torque: Option<Vec3>,
    /// Whether the load is a pure torque pair.
    pub(crate) is_pure_torque: bool,
    /// For a stop in contact: its depth, and the depth at which it exerts the force given in the scene, m or rad.
    pub depth: Option<[f64; 2]>,
}

impl ElementReport {
    /// [`Self::force`], unless the load is a pure torque pair.
    pub fn own_force(&self) -> Option<Vec3> {
        (!self.is_pure_torque).then_some(self.force)
    }
}

/// Powers at one instant, or their integrals over time (then in J).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Powers {
    /// Supplied by the drives: actuator force times rate, W.
    pub drive: f64,
    /// Dissipated by the damping of the normal forces, W: (F_N - K delta^1.5) d(delta)/dt.
    pub restitution: f64,
    /// Dissipated by friction, W: -F_T . (velocity of the ball's point - velocity of the socket's point) (24).
    pub friction: f64,
    /// Supplied by ramping clearances, W: -F_N dc/dt + 2/5 dK/dt delta^2.5.
    pub clearance: f64,
    /// Dissipated by the dampers of force elements, W.
    pub damping: f64,
    /// Supplied by external loads, W.
    pub external: f64,
}

/// A part that presses against a wall of its joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallContact {
    /// Where.
    pub spot: Spot,
    /// F_N, N.
    pub normal_force: f64,
    /// Power dissipated by friction, W.
    pub(crate) friction_power: f64,
}

impl Powers {
    /// Adds `weight` times `other`.
    pub fn add(&mut self, weight: f64, other: &Self) {
        self.drive += weight * other.drive;
        self.restitution += weight * other.restitution;
        self.friction += weight * other.friction;
        self.clearance += weight * other.clearance;
        self.damping += weight * other.damping;
        self.external += weight * other.external;
    }
}

/// A load on bodies that depends on their motion and on time: its force, the energy stored in it and its power, and what steppers
/// need of it. Allocates nothing.
pub(super) trait ForceElement: Send + Sync {
    /// Adds its loads.
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>);

    /// Stored energy at `t`, J; for a contact, at the gap last measured.
    fn stored(&self, _t: f64, _motion: &[Kinematics]) -> f64 {
        0.0
    }

    /// Work from one pose to a nearby one at `t`, J, of the part of its force that is not in [`Self::stored`].
    fn work(&self, _t: f64, _poses: [&[Kinematics]; 2]) -> f64 {
        0.0
    }

    /// Adds its powers at `t`, after an evaluation.
    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers);

    /// The two points in `motion` on whose relative motion, and that of their bodies, the force depends; `None` if it is not
    /// stiff.
    fn ends(&self, _motion: &[Kinematics]) -> Option<[Anchor; 2]> {
        None
    }

    /// Linearisation after an evaluation; `None` if there is none.
    fn coupling(&self, _at: &At<'_>) -> Option<Coupling> {
        None
    }

    /// Where it is among the edges of its force. Explicit steps end where a side changes.
    fn edges(&self, _t: f64, _motion: &[Kinematics]) -> Edges {
        Edges::default()
    }

    /// Freezes the force on its smooth continuation from these sides of its [`Self::edges`], regardless of the motion; unfreezes it
    /// where they are `None`.
    fn freeze(&mut self, _sides: Edges) {}

    /// Sets the reference that determines the turns of the angle on which it acts, if any. The element reads its joint's
    /// coordinate, which counts turns, although it measures poses.
    fn set_angle_reference(&mut self, _reference: AngleReference) {}

    /// The film, if it is one.
    fn film(&self) -> Option<&Film> {
        None
    }

    /// Takes the present parameters and clearance of the joint in which it is, if it depends on them.
    fn follow(&mut self, _contacts: &Contacts, _t: f64) {}

    /// Its report at `t`; empty for a joint with play, which is reported as a joint.
    fn report(&self, _t: f64, _motion: &[Kinematics]) -> ElementReport {
        ElementReport::default()
    }
}

/// The force elements of `machine`, in the order of the scene.
pub(super) fn elements_of(machine: &Machine, model: &Model) -> Vec<Box<dyn ForceElement>> {
    machine.elements.iter().map(|element| element_of(machine, model, element)).collect()
}

/// The force element for `element`, of `machine` or in place of one of its own.
pub(super) fn element_of(machine: &Machine, model: &Model, element: &Element) -> Box<dyn ForceElement> {
    let anchor = |point: &Attachment| model.anchor(machine, point);
    let coordinate = |on: JointCoordinate| Coordinate::of(machine, model, on);
    let law = law_of(element);
    match &element.kind {
        ElementKind::Spring(spring) => Box::new(Spring::new(spring, [&spring.from, &spring.to].map(anchor))),
        ElementKind::Load(load) => Box::new(Load { load: load.clone(), on: anchor(&load.on), factor: law }),
        ElementKind::JointSpring(spring) => {
            Box::new(OnCoordinate { on: coordinate(spring.on), law: JointSpring::new(spring) })
        }
        ElementKind::Stop(stop) => Box::new(OnCoordinate { on: coordinate(stop.on), law: Stop::new(stop) }),
        ElementKind::Bushing(bushing) => Box::new(Bushing::new(bushing, [&bushing.from, &bushing.to].map(anchor))),
        ElementKind::Motor(motor) => {
            Box::new(OnCoordinate { on: coordinate(motor.on), law: Motor { motor: motor.clone(), target: law } })
        }
        ElementKind::Tyre(tyre) => Box::new(Tyre::new(tyre, anchor(&tyre.on), law)),
        ElementKind::Lubricant(film) => Box::new(Film::new(film, machine, model)),
    }
}

/// The element for the `force`, N, of gravity on body `body`.
pub(super) fn weight(body: usize, force: Vec3) -> Box<dyn ForceElement> {
    let centroid = Attachment { body: Some(body), point: Vec3::zeros() };
    let load = machine::Load { on: centroid, force, torque: Vec3::zeros(), axes: LoadAxes::World, factor: None };
    Box::new(Load { load, on: Anchor { body, offset: Vec3::zeros() }, factor: None })
}

/// The element for a pulling hand.
pub(super) fn hand(machine: &Machine, model: &Model, pull: Pull) -> Box<dyn ForceElement> {
    let point = Attachment { body: Some(pull.body), point: pull.point };
    let on = model.anchor(machine, &point);
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
