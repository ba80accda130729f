//! The single table of frame quantities: their names in plots and files, and how each is read. Plots, their tooltips, saved
//! records and the rows of `run` are all derived from it.

use Quantity as Q;
use SignalSource::{
    Angles, Axes, BodyAxes, ChildTurn, Closing, Consumed, Displacement, Element, ElementValue, FirstTurn, Hinge,
    HingeCoordinate, Joint, JointAxes, OtherAngles, OtherAxes, ProbeDistance, ProbeError, Reaction, Scalar, SecondTurn,
    Site, SiteAxes, Slide, SlideCoordinate, Supplied, Turn, TurnRate,
};

use crate::machine::{ElementKind, Machine, Vec3};
use crate::simulate::angles::pose_of;
use crate::simulate::{BodyMotion, ContactMode, ElementReport, Frame, JointReport, Ledger, Pose, SiteReport};
use crate::words::words;

/// A physical quantity that a plot shows; its channels share one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Quantity {
    NormalForce,
    FrictionForce,
    LubricantForce,
    Eccentricity,
    Penetration,
    Position,
    Angles,
    Velocity,
    AngleRates,
    Acceleration,
    AngleAccelerations,
    ActuatorForce,
    ActuatorTorque,
    Energy,
    EnergyBalance,
    ProbeError,
    TipError,
}

words!(Quantity {
    NormalForce => "normal-force",
    FrictionForce => "friction-force",
    LubricantForce => "lubricant-force",
    Eccentricity => "eccentricity",
    Penetration => "penetration",
    Position => "position",
    Angles => "angles",
    Velocity => "velocity",
    AngleRates => "angle-rates",
    Acceleration => "acceleration",
    AngleAccelerations => "angle-accelerations",
    ActuatorForce => "actuator-force",
    ActuatorTorque => "actuator-torque",
    Energy => "energy",
    EnergyBalance => "energy-balance",
    ProbeError => "probe-error",
    TipError => "tip-error",
});

impl Quantity {
    /// Whether this member of [`Self::EnergyBalance`] takes or stores energy; the others supply it. All members sum to zero.
    pub fn takes(member: &str) -> bool {
        TABLE.iter().any(|signal| matches!(signal.source, Consumed(own, _) if own == member))
    }
}

/// How a signal is read from a frame (SI units, world axes), and for which parts it is repeated.
#[derive(Clone, Copy, Debug)]
pub(super) enum SignalSource {
    /// A single value, with its member name in the plot.
    Scalar(&'static str, fn(&Frame) -> f64),
    /// Vector of the output body: x, y, z.
    Axes(fn(&Pose) -> Vec3),
    /// Angles of the output body: alpha, beta, gamma.
    Angles(fn(&Pose) -> Vec3),
    /// Vector of each body: x, y, z.
    BodyAxes(fn(&BodyMotion) -> Vec3),
    /// Vector of each body except the output body: x, y, z.
    OtherAxes(fn(&BodyMotion) -> Vec3),
    /// Angles of each body except the output body: alpha, beta, gamma.
    OtherAngles(fn(&Pose) -> Vec3),
    /// Coordinate (0) or rate (1) of each sliding joint.
    SlideCoordinate(usize),
    /// Angle (0) or rate (1) of each turning joint; the angle also of a joint that both slides and turns.
    HingeCoordinate(usize),
    /// Angular rate of a joint that both slides and turns.
    TurnRate,
    /// Angle (0) or rate (1) of a universal joint: about its axis in the parent, then about the one in the child.
    FirstTurn(usize),
    SecondTurn(usize),
    /// Force (0) or torque (1) of each fixed, sliding or turning joint on its child: x, y, z.
    Reaction(usize),
    /// Vector of each loop-closing joint, from force and torque on its child: x, y, z.
    Closing(fn(&[Vec3; 2]) -> Vec3),
    /// Value of each joint with play.
    Joint(fn(&JointReport) -> f64),
    /// Vector of each joint with play: x, y, z.
    JointAxes(fn(&JointReport) -> Vec3),
    /// Value of each joint with play that has an axis.
    Displacement(fn(&JointReport) -> f64),
    /// Value of each place where a joint with several can touch.
    Site(fn(&SiteReport) -> f64),
    /// Vector of each of them: x, y, z.
    SiteAxes(fn(&SiteReport) -> Vec3),
    /// Actuator force of each driven slide.
    Slide,
    /// Actuator torque of each driven hinge.
    Hinge,
    /// Actuator torque of each other driven angle: about the axis in the parent, then about the one in the child.
    Turn,
    ChildTurn,
    /// A term of the energy balance that supplies energy, with its member name.
    Supplied(&'static str, fn(&Ledger) -> f64),
    /// A term that takes or stores energy.
    Consumed(&'static str, fn(&Ledger) -> f64),
    /// Error of the probe tip: x, y, z.
    ProbeError,
    /// Its size.
    ProbeDistance,
    /// Vector of each force element that reports it: x, y, z.
    Element(fn(&ElementReport) -> Option<Vec3>),
    /// Value of each force element between two points.
    ElementValue(fn(&ElementReport) -> f64),
}

/// Parts for which a signal is repeated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Repetition {
    /// Not repeated.
    Once,
    /// The output body alone.
    Output,
    /// Bodies.
    Body,
    /// Coordinates of joints that slide or turn.
    Coordinate,
    /// Sliding, turning and fixed joints.
    Reacting,
    /// Joints that close loops.
    Closing,
    /// Joints with play.
    Joint,
    /// Places where joints with several can touch.
    Site,
    /// Driven joints.
    Drive,
    /// Force elements.
    Element,
}

/// Names of a signal's components, in plots and in columns.
pub(super) type Components = &'static [(&'static str, &'static str)];

impl SignalSource {
    pub(super) fn repetition(&self) -> Repetition {
        match self {
            Joint(_) | JointAxes(_) | Displacement(_) => Repetition::Joint,
            Site(_) | SiteAxes(_) => Repetition::Site,
            Closing(_) => Repetition::Closing,
            Slide | Hinge | Turn | ChildTurn => Repetition::Drive,
            Element(_) | ElementValue(_) => Repetition::Element,
            Axes(_) | Angles(_) => Repetition::Output,
            BodyAxes(_) | OtherAxes(_) | OtherAngles(_) => Repetition::Body,
            SlideCoordinate(_) | HingeCoordinate(_) | TurnRate | FirstTurn(_) | SecondTurn(_) => Repetition::Coordinate,
            Reaction(_) => Repetition::Reacting,
            Scalar(..) | Supplied(..) | Consumed(..) | ProbeError | ProbeDistance => Repetition::Once,
        }
    }

    pub(super) fn components(&self) -> Components {
        match self {
            Axes(_) | BodyAxes(_) | OtherAxes(_) | JointAxes(_) | SiteAxes(_) | Reaction(_) | Closing(_)
            | ProbeError | Element(_) => &[("x", "x"), ("y", "y"), ("z", "z")],
            Angles(_) | OtherAngles(_) => &[("α", "alpha"), ("β", "beta"), ("γ", "gamma")],
            _ => &[("", "")],
        }
    }

    /// Member name in its plot, where the signal has its own.
    pub(super) fn member(&self) -> &'static str {
        match *self {
            Scalar(member, _) | Supplied(member, _) | Consumed(member, _) => member,
            _ => "",
        }
    }

    /// Value of one component for part `part`; `None` where the frame does not have it.
    #[inline]
    pub(super) fn value(&self, frame: &Frame, part: usize, component: usize) -> Option<f64> {
        match self {
            Scalar(_, of) => Some(of(frame)),
            Axes(of) | Angles(of) => Some(of(&frame.pose)[component]),
            BodyAxes(of) | OtherAxes(of) => frame.bodies.get(part).map(|body| of(body)[component]),
            OtherAngles(of) => {
                let body = frame.bodies.get(part);
                body.map(|body| of(&pose_of(body))[component])
            }
            SlideCoordinate(order) | HingeCoordinate(order) | FirstTurn(order) | SecondTurn(order) => {
                frame.coordinates.get(part).map(|c| c[*order])
            }
            TurnRate => frame.coordinates.get(part).map(|c| c[1]),
            Reaction(which) => {
                let of_part = frame.reactions.as_ref()?.get(part)?;
                Some(of_part[*which][component])
            }
            Closing(of) => frame.closing.get(part).map(|load| of(load)[component]),
            Joint(of) | Displacement(of) => frame.joints.get(part).map(of),
            Site(of) => frame.sites.get(part).map(of),
            SiteAxes(of) => frame.sites.get(part).map(|site| of(site)[component]),
            JointAxes(of) => frame.joints.get(part).map(|joint| of(joint)[component]),
            Slide | Hinge | Turn | ChildTurn => frame.actuators.get(part).copied(),
            Supplied(_, of) | Consumed(_, of) => frame.ledger.as_ref().map(of),
            ProbeError => frame.probe_error.map(|error| error[component]),
            ProbeDistance => frame.probe_error.map(|error| error.norm()),
            Element(of) => frame.elements.get(part).and_then(of).map(|v| v[component]),
            ElementValue(of) => frame.elements.get(part).map(of),
        }
    }
}

/// What of a machine a signal needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needed {
    Nothing,
    Elements,
    Lubricants,
}

impl Needed {
    /// Whether `machine` has it.
    pub fn is_in(self, machine: &Machine) -> bool {
        match self {
            Self::Nothing => true,
            Self::Elements => !machine.elements.is_empty(),
            Self::Lubricants => {
                machine.elements.iter().any(|element| matches!(element.kind, ElementKind::Lubricant(_)))
            }
        }
    }
}

/// One recorded quantity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signal {
    /// Name of the channel: `@` stands for the name of the part, `#` for that of the component. Empty if frames do not
    /// contain it.
    pub name: &'static str,
    /// Column name in files, with the SI unit, by the same rule.
    pub column: &'static str,
    /// Description.
    pub help: &'static str,
    /// Plot that shows it.
    pub plot: Option<Quantity>,
    /// Place in the rows of `run`, lowest first; a signal without one is written only on request. Signals with the same place are
    /// in table order, part by part where they are repeated. Readers also rely on column positions: append new columns at the
    /// end.
    pub run: Option<u8>,
    /// How it is read.
    pub source: SignalSource,
    /// What a scene without this does not have.
    pub of: Needed,
}

/// A signal in no plot, written by `run` only on request.
const fn on_request(name: &'static str, column: &'static str, source: SignalSource, help: &'static str) -> Signal {
    Signal { name, column, help, plot: None, run: None, source, of: Needed::Nothing }
}

/// The same signal, shown in a plot.
const fn in_plot(plot: Quantity, signal: Signal) -> Signal {
    Signal { plot: Some(plot), ..signal }
}

/// The same signal, among the default columns of `run`.
const fn in_run(place: u8, signal: Signal) -> Signal {
    Signal { run: Some(place), ..signal }
}

const fn in_plot_and_run(plot: Quantity, place: u8, signal: Signal) -> Signal {
    in_plot(plot, in_run(place, signal))
}

const fn of(of: Needed, signal: Signal) -> Signal {
    Signal { of, ..signal }
}

/// Every signal, in the order of saved records and of the members of a plot.
#[rustfmt::skip]
pub(super) const TABLE: &[Signal] = &[
    in_plot_and_run(Q::NormalForce, 2, on_request("@.normal", "@_normal_N", Joint(|joint| joint.normal_force.norm()), "size of the normal force on the carried part; of an ideal joint, of its reaction")),
    in_plot(Q::FrictionForce, on_request("@.friction.size", "@_friction_N", Joint(|joint| joint.friction_force.norm()), "size of the friction force on the carried part")),
    of(Needed::Lubricants, in_plot(Q::LubricantForce, on_request("@.lubricant", "@_lubricant_N", Joint(|joint| joint.lubricant_force.norm()), "size of the force of the lubricant on the carried part"))),
    in_plot_and_run(Q::Eccentricity, 1, on_request("@.eccentricity.size", "@_eccentricity_m", Joint(|joint| joint.eccentricity.norm()), "distance of the ball's centre from the socket's; of a pin or a block, across its axis")),
    in_run(5, on_request("@.eccentricity.#", "@_e#_m", JointAxes(|joint| joint.eccentricity), "ball's centre from the socket's; of a pin or a block, across its axis")),
    in_plot_and_run(Q::Penetration, 5, on_request("@.penetration", "@_penetration_m", Joint(|joint| joint.penetration), "depth in the wall; negative where there is a gap")),
    in_run(5, on_request("@.penetration_rate", "@_penetration_rate_m_s", Joint(|joint| joint.penetration_rate), "rate of the penetration")),
    in_run(5, on_request("@.force.#", "@_force_#_N", JointAxes(|joint| joint.normal_force + joint.friction_force), "force on the carried part; of an ideal joint, its reaction")),
    in_run(5, on_request("@.friction.#", "@_friction_#_N", JointAxes(|joint| joint.friction_force), "friction force on the carried part")),
    in_run(5, on_request("@.state", "@_state", Joint(|joint| state_code(joint.state)), "0 free, 1 creep (slower than slip_speed_high), 2 slip, 3 ideal, 4 stick")),

    in_run(0, on_request(TIME, "t_s", Scalar("time", |frame| frame.time), "simulated time")),
    in_plot_and_run(Q::Position, 0, on_request("@.pose.#", "#_m", Axes(|pose| pose.position), "origin of the output body")),
    in_plot_and_run(Q::Angles, 0, on_request("@.pose.#", "#_rad", Angles(|pose| pose.angles), "orientation of the output body, Rx(alpha) Rz(beta) Ry(gamma)")),
    in_plot_and_run(Q::Velocity, 0, on_request("@.velocity.#", "v#_m_s", Axes(|pose| pose.velocity), "velocity of the output body's origin")),
    in_plot_and_run(Q::AngleRates, 4, on_request("@.velocity.#", "#_rate_rad_s", Angles(|pose| pose.angle_rates), "rate of the output body's angle")),
    in_plot_and_run(Q::Acceleration, 3, on_request("@.acceleration.#", "a#_m_s2", Axes(|pose| pose.acceleration), "acceleration of the output body's origin")),
    in_plot_and_run(Q::AngleAccelerations, 8, on_request("@.acceleration.#", "#_accel_rad_s2", Angles(|pose| pose.angle_accelerations), "second derivative of the output body's angle")),

    in_plot_and_run(Q::Energy, 7, on_request("energy.kinetic", "kinetic_J", Scalar("kinetic", |frame| frame.kinetic), "kinetic energy of all bodies")),
    in_plot_and_run(Q::Energy, 7, on_request("energy.potential", "potential_J", Scalar("potential", |frame| frame.potential), "energy in gravity, 0 at the world's origin, and in contacts and springs")),
    in_plot_and_run(Q::Energy, 7, on_request("energy.elastic", "elastic_J", Scalar("elastic", |frame| frame.elastic), "energy in contacts and springs")),

    in_plot_and_run(Q::ActuatorForce, 6, on_request("@.actuator", "@_actuator_N", Slide, "force of the drive, positive along the joint's axis")),
    in_plot_and_run(Q::ActuatorTorque, 6, on_request("@.actuator", "@_actuator_Nm", Hinge, "torque of the drive, positive about the joint's axis")),
    in_plot_and_run(Q::ActuatorTorque, 6, on_request("@.angle_actuator", "@_angle_actuator_Nm", Turn, "torque of the drive, positive about the joint's axis")),
    in_plot_and_run(Q::ActuatorTorque, 6, on_request("@.child_angle_actuator", "@_child_angle_actuator_Nm", ChildTurn, "torque of the drive, positive about the joint's axis in the child")),

    in_plot_and_run(Q::EnergyBalance, 10, on_request("energy.drive_work", "drive_work_J", Supplied("drives", |ledger| ledger.drive_work), "supplied by the drives since the start")),
    in_plot_and_run(Q::EnergyBalance, 10, on_request("energy.gravity_work", "gravity_work_J", Supplied("gravity", |ledger| ledger.gravity_work), "supplied by gravity since the start")),
    in_plot_and_run(Q::EnergyBalance, 11, on_request("energy.clearance_work", "clearance_work_J", Supplied("clearance", |ledger| ledger.clearance_work), "supplied by moving clearances since the start")),
    in_plot(Q::EnergyBalance, on_request("energy.change_work", "change_work_J", Supplied("changes", |ledger| ledger.change_work), "supplied by changed parameters since the start")),
    // Any scene can be pulled by hand.
    in_plot(Q::EnergyBalance, on_request("energy.external_work", "external_work_J", Supplied("external", |ledger| ledger.external_work), "supplied by external loads since the start")),
    of(Needed::Elements, in_run(14, on_request("energy.external_work", "external_work_J", Supplied("external", |ledger| ledger.external_work), "supplied by external loads since the start"))),
    in_plot_and_run(Q::EnergyBalance, 10, on_request("energy.restitution_loss", "restitution_loss_J", Consumed("restitution", |ledger| ledger.restitution_loss), "lost to restitution since the start")),
    in_plot_and_run(Q::EnergyBalance, 10, on_request("energy.friction_loss", "friction_loss_J", Consumed("friction", |ledger| ledger.friction_loss), "lost to friction since the start")),
    of(Needed::Elements, in_plot_and_run(Q::EnergyBalance, 13, on_request("energy.damping_loss", "damping_loss_J", Consumed("damping", |ledger| ledger.damping_loss), "lost to dampers since the start"))),
    in_plot(Q::EnergyBalance, on_request("energy.kinetic_change", "kinetic_change_J", Consumed("kinetic", |ledger| ledger.kinetic_change), "change of the kinetic energy since the start")),
    in_plot(Q::EnergyBalance, on_request("energy.elastic_change", "elastic_change_J", Consumed("elastic", |ledger| ledger.elastic_change), "change of the elastic energy since the start")),
    in_plot_and_run(Q::EnergyBalance, 11, on_request("energy.residual", "energy_residual_J", Supplied("residual", Ledger::residual), "error of the integration: energy that came from nowhere since the start")),

    // Supplied by the code that computes the ideal motion alongside the run.
    in_plot(Q::TipError, on_request("", "tip_error_m", Scalar("distance", |_| f64::NAN), "")),
    in_plot_and_run(Q::ProbeError, 9, on_request("probe_error.#", "probe_error_#_m", ProbeError, "probe tip from where the ideal mechanism has it")),

    in_run(12, on_request("@.force.#", "@_force_#_N", Element(ElementReport::own_force), "force of the element on its second, or only, point")),
    in_run(12, on_request("@.torque.#", "@_torque_#_Nm", Element(|element| element.torque), "torque of the element on the body")),

    on_request("@.pose.#", "@_#_m", OtherAxes(|body| body.position), "origin of the body"),
    on_request("@.pose.#", "@_#_rad", OtherAngles(|pose| pose.angles), "orientation of the body, Rx(alpha) Rz(beta) Ry(gamma)"),
    on_request("@.velocity.#", "@_v#_m_s", OtherAxes(|body| body.velocity), "velocity of the body's origin"),
    on_request("@.velocity.#", "@_#_rate_rad_s", OtherAngles(|pose| pose.angle_rates), "rate of the body's angle"),
    on_request("@.acceleration.#", "@_a#_m_s2", OtherAxes(|body| body.acceleration), "acceleration of the body's origin"),
    on_request("@.acceleration.#", "@_#_accel_rad_s2", OtherAngles(|pose| pose.angle_accelerations), "second derivative of the body's angle"),
    on_request("@.angular_velocity.#", "@_omega_#_rad_s", BodyAxes(|body| body.angular_velocity), "angular velocity of the body"),
    on_request("@.angular_acceleration.#", "@_omega_rate_#_rad_s2", BodyAxes(|body| body.angular_acceleration), "angular acceleration of the body"),

    on_request("@.position", "@_position_m", SlideCoordinate(0), "coordinate of the joint along its axis"),
    on_request("@.rate", "@_rate_m_s", SlideCoordinate(1), "rate of the joint's coordinate"),
    on_request("@.angle", "@_angle_rad", HingeCoordinate(0), "angle of the joint about its axis"),
    on_request("@.rate", "@_rate_rad_s", HingeCoordinate(1), "rate of the joint's angle"),
    on_request("@.angle_rate", "@_angle_rate_rad_s", TurnRate, "rate of the joint's angle"),
    on_request("@.angle", "@_angle_rad", FirstTurn(0), "angle of the joint about its axis in the parent"),
    on_request("@.angle_rate", "@_angle_rate_rad_s", FirstTurn(1), "rate of that angle"),
    on_request("@.child_angle", "@_child_angle_rad", SecondTurn(0), "angle of the joint about its axis in the child"),
    on_request("@.child_angle_rate", "@_child_angle_rate_rad_s", SecondTurn(1), "rate of that angle"),

    on_request("@.reaction.#", "@_reaction_#_N", Reaction(0), "force of the joint on its child, its drive's included"),
    on_request("@.reaction_torque.#", "@_reaction_torque_#_Nm", Reaction(1), "torque of the joint on its child about its joint point, its drive's included"),
    on_request("@.reaction.#", "@_reaction_#_N", Closing(|load| load[0]), "force of the joint on its child"),
    on_request("@.reaction_torque.#", "@_reaction_torque_#_Nm", Closing(|load| load[1]), "torque of the joint on its child about its joint point"),

    on_request("@.gap", "@_gap_m", Joint(|joint| -joint.penetration), "gap to the wall; negative in contact"),
    on_request("@.clearance", "@_clearance_m", Joint(|joint| joint.clearance), "radial clearance in force"),
    on_request("@.worn", "@_worn_m", Joint(|joint| joint.worn[0]), "by how much the clearance has worn wider since the start"),
    on_request("@.second_worn", "@_second_worn_m", Displacement(|joint| joint.worn[1]), "the same of the second play: along the axis of a pin, along z of a block"),
    on_request("@.slip_speed", "@_slip_speed_m_s", Joint(|joint| joint.slip_speed), "sliding speed that the friction law uses"),

    on_request("@.axial", "@_axial_m", Displacement(|joint| joint.axial), "displacement of the carried part along the joint's axis"),
    on_request("@.tilt", "@_tilt_rad", Displacement(|joint| joint.tilt), "angle between pin and bearing, or block and guide"),
    on_request("@.normal", "@_normal_N", Site(|site| site.normal_force.norm()), "size of the normal force there on the carried part"),
    on_request("@.friction.size", "@_friction_N", Site(|site| site.friction_force.norm()), "size of the friction force there on the carried part"),
    on_request("@.gap", "@_gap_m", Site(|site| site.gap), "distance to the wall; negative in contact, infinite where the joint has no play"),
    on_request("@.force.#", "@_force_#_N", SiteAxes(|site| site.normal_force + site.friction_force), "force there on the carried part"),

    on_request("@.length", "@_length_m", ElementValue(|element| (element.points[1] - element.points[0]).norm()), "distance of the element's points"),

    on_request("tip_error", "probe_error_m", ProbeDistance, "distance of the probe tip from where the ideal mechanism has it"),
];

/// Channel name of the time, the first column of every row.
pub(super) const TIME: &str = "time";

/// Code of a contact state in files.
fn state_code(state: ContactMode) -> f64 {
    match state {
        ContactMode::Free => 0.0,
        ContactMode::Creep => 1.0,
        ContactMode::Slip => 2.0,
        ContactMode::Ideal => 3.0,
        ContactMode::Stick => 4.0,
    }
}
