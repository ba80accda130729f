//! The single table of what is read from a frame: names in plots and in files, and how each value is read. Plots, their
//! tooltips, saved records and the rows of `run` are all derived from it.

use Quantity as Q;
use Take::{
    Angles, Axes, Element, Given, Hinge, Joint, JointAxes, ProbeError, Slide, Taken, Whole,
};

use crate::scene::Vec3;
use crate::simulate::{ContactState, ElementReport, Frame, JointReport, Ledger, Pose};

/// A physical quantity that a plot shows; its channels share one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Quantity {
    NormalForce,
    FrictionForce,
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

/// How a plot presents its quantity.
struct Plot {
    quantity: Quantity,
    label: &'static str,
    /// Axis unit, and its value in SI units.
    unit: (&'static str, f64),
    kind: PlotKind,
    help: &'static str,
}

/// What a plot shows of its channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotKind {
    /// A curve of each, over whatever range they have.
    Curves,
    /// The same over a range that begins at zero: none is ever negative.
    FromZero,
    /// The same with the clearances of the joints.
    FromZeroWithClearances,
    /// Bands stacked on both sides of zero.
    Bands,
}

/// Every plot, in list order.
const PLOTS: &[Plot] = &[
    Plot {
        quantity: Q::NormalForce,
        label: "Normal force",
        unit: ("N", 1.0),
        kind: PlotKind::FromZero,
        help: "Size of the normal force on each ball; of the whole reaction where a joint is ideal.",
    },
    Plot {
        quantity: Q::FrictionForce,
        label: "Friction force",
        unit: ("N", 1.0),
        kind: PlotKind::FromZero,
        help: "Size of the friction force on each ball.",
    },
    Plot {
        quantity: Q::Eccentricity,
        label: "Eccentricity",
        unit: ("mm", 1e-3),
        kind: PlotKind::FromZeroWithClearances,
        help: "Distance of each ball's centre from its socket's centre. Contact begins at the clearance.",
    },
    Plot {
        quantity: Q::Penetration,
        label: "Penetration",
        unit: ("µm", 1e-6),
        kind: PlotKind::Curves,
        help: "How deep each ball presses into its socket; below zero there is a gap.",
    },
    Plot {
        quantity: Q::Position,
        label: "Position",
        unit: ("mm", 1e-3),
        kind: PlotKind::Curves,
        help: "Origin of the output body in world axes.",
    },
    Plot {
        quantity: Q::Angles,
        label: "Angles",
        unit: ("mrad", 1e-3),
        kind: PlotKind::Curves,
        help: "Angles α, β, γ of the output body.",
    },
    Plot {
        quantity: Q::Velocity,
        label: "Velocity",
        unit: ("m/s", 1.0),
        kind: PlotKind::Curves,
        help: "Velocity of the output body's origin.",
    },
    Plot {
        quantity: Q::AngleRates,
        label: "Angle rates",
        unit: ("rad/s", 1.0),
        kind: PlotKind::Curves,
        help: "Rates of the angles α, β, γ.",
    },
    Plot {
        quantity: Q::Acceleration,
        label: "Acceleration",
        unit: ("m/s²", 1.0),
        kind: PlotKind::Curves,
        help: "Acceleration of the output body's origin.",
    },
    Plot {
        quantity: Q::AngleAccelerations,
        label: "Angle accelerations",
        unit: ("rad/s²", 1.0),
        kind: PlotKind::Curves,
        help: "Second derivatives of the angles α, β, γ.",
    },
    Plot {
        quantity: Q::ActuatorForce,
        label: "Actuator force",
        unit: ("N", 1.0),
        kind: PlotKind::Curves,
        help: "Force that each driven slide needs, positive along its axis.",
    },
    Plot {
        quantity: Q::ActuatorTorque,
        label: "Actuator torque",
        unit: ("N m", 1.0),
        kind: PlotKind::Curves,
        help: "Torque that each driven hinge needs, positive about its axis.",
    },
    Plot {
        quantity: Q::Energy,
        label: "Energy",
        unit: ("mJ", 1e-3),
        kind: PlotKind::Curves,
        help: "Kinetic, potential and elastic energy of the whole mechanism.",
    },
    Plot {
        quantity: Q::EnergyBalance,
        label: "Energy balance",
        unit: ("mJ", 1e-3),
        kind: PlotKind::Bands,
        help: "Since the start: work of drives, gravity, moving clearances, changed parameters and loads from outside, loss \
               by restitution, friction and dampers, change of kinetic and elastic energy, and the residual, which is the \
               error of the integration.",
    },
    Plot {
        quantity: Q::ProbeError,
        label: "Probe error",
        unit: ("mm", 1e-3),
        kind: PlotKind::Curves,
        help: "Probe tip minus the tip of the ideal mechanism at the same time.",
    },
    Plot {
        quantity: Q::TipError,
        label: "Tip error",
        unit: ("µm", 1e-6),
        kind: PlotKind::FromZero,
        help: "Distance of the output point (the probe tip, or the output body's origin) from where ideal joints have it at the \
               same time. Recorded while the ideal ghost is on (key G).",
    },
];

impl Quantity {
    /// All of them, in list order.
    pub const ALL: [Self; PLOTS.len()] = {
        let mut all = [Self::NormalForce; PLOTS.len()];
        let mut i = 0;
        while i < all.len() {
            all[i] = PLOTS[i].quantity;
            assert!(all[i] as usize == i, "plots stand in the order of the enum");
            i += 1;
        }
        all
    };

    fn plot(self) -> &'static Plot {
        &PLOTS[self as usize]
    }

    /// Sentence-case name.
    pub fn label(self) -> &'static str {
        self.plot().label
    }

    /// Axis unit, and its value in SI units.
    pub fn unit(self) -> (&'static str, f64) {
        self.plot().unit
    }

    /// What its plot shows of its channels.
    pub fn kind(self) -> PlotKind {
        self.plot().kind
    }

    /// A one-sentence description.
    pub fn help(self) -> &'static str {
        self.plot().help
    }

    /// Whether this member of [`Self::EnergyBalance`] takes or stores energy; the others supply it. All of them sum to
    /// zero.
    pub fn takes(member: &str) -> bool {
        TABLE
            .iter()
            .any(|signal| matches!(signal.take, Taken(own, _) if own == member))
    }
}

/// How a signal is read from a frame (SI units, world axes), and what it is repeated for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Take {
    /// A single value; with its member name in the plot.
    Whole(&'static str, fn(&Frame) -> f64),
    /// Of the output body, along x, y, z.
    Axes(fn(&Pose) -> Vec3),
    /// Of the output body, by alpha, beta, gamma.
    Angles(fn(&Pose) -> Vec3),
    /// Of each ball joint.
    Joint(fn(&JointReport) -> f64),
    /// Of each ball joint, along x, y, z.
    JointAxes(fn(&JointReport) -> Vec3),
    /// Actuator of each driven slide.
    Slide,
    /// Actuator of each driven hinge.
    Hinge,
    /// A term of the energy balance that supplies energy, with its member name.
    Given(&'static str, fn(&Ledger) -> f64),
    /// A term that takes or stores energy.
    Taken(&'static str, fn(&Ledger) -> f64),
    /// Along x, y, z.
    ProbeError,
    /// Of each force element that reports it, along x, y, z.
    Element(fn(&ElementReport) -> Option<Vec3>),
}

/// What a signal is repeated for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Each {
    /// Nothing: there is one.
    Once,
    /// Ball joints.
    Joint,
    /// Driven joints.
    Drive,
    /// Force elements.
    Element,
}

/// Names of a signal's components: in plots, and in columns.
pub(super) type Components = &'static [(&'static str, &'static str)];

impl Take {
    pub(super) fn each(&self) -> Each {
        match self {
            Joint(_) | JointAxes(_) => Each::Joint,
            Slide | Hinge => Each::Drive,
            Element(_) => Each::Element,
            Whole(..) | Axes(_) | Angles(_) | Given(..) | Taken(..) | ProbeError => Each::Once,
        }
    }

    pub(super) fn components(&self) -> Components {
        match self {
            Axes(_) | JointAxes(_) | ProbeError | Element(_) => {
                &[("x", "x"), ("y", "y"), ("z", "z")]
            }
            Angles(_) => &[("α", "alpha"), ("β", "beta"), ("γ", "gamma")],
            Whole(..) | Joint(_) | Slide | Hinge | Given(..) | Taken(..) => &[("", "")],
        }
    }

    /// Member name in its plot, where the signal has its own.
    pub(super) fn member(&self) -> &'static str {
        match *self {
            Whole(member, _) | Given(member, _) | Taken(member, _) => member,
            _ => "",
        }
    }

    /// Value of one component for part `part`; `None` where the frame does not have it.
    #[inline]
    pub(super) fn value(&self, frame: &Frame, part: usize, component: usize) -> Option<f64> {
        match self {
            Whole(_, of) => Some(of(frame)),
            Axes(of) | Angles(of) => Some(of(&frame.pose)[component]),
            Joint(of) => frame.joints.get(part).map(of),
            JointAxes(of) => frame.joints.get(part).map(|joint| of(joint)[component]),
            Slide | Hinge => frame.actuators.get(part).copied(),
            Given(_, of) | Taken(_, of) => frame.ledger.as_ref().map(of),
            ProbeError => frame.probe_error.map(|error| error[component]),
            Element(of) => frame.elements.get(part).and_then(of).map(|v| v[component]),
        }
    }
}

/// One recorded quantity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signal {
    /// Column name in files, with the SI unit: `@` stands for the name of the part, `#` for that of the component.
    pub column: &'static str,
    /// Plot that shows it.
    pub plot: Option<Quantity>,
    /// Place in the rows of `run`, lowest first. Signals of the same place keep the order of the table, part by part where
    /// they are repeated. Readers also rely on column positions: append new columns at the end.
    pub run: Option<u8>,
    /// How it is read.
    pub take: Take,
    /// Whether it is absent in a scene without force elements.
    pub of_elements: bool,
}

/// A signal in both a plot and `run`.
const fn both(column: &'static str, plot: Quantity, run: u8, take: Take) -> Signal {
    Signal {
        column,
        plot: Some(plot),
        run: Some(run),
        take,
        of_elements: false,
    }
}

/// A signal in a plot only.
const fn plotted(column: &'static str, plot: Quantity, take: Take) -> Signal {
    Signal {
        run: None,
        ..both(column, plot, 0, take)
    }
}

/// A signal in `run` only.
const fn listed(column: &'static str, run: u8, take: Take) -> Signal {
    Signal {
        plot: None,
        ..both(column, Q::NormalForce, run, take)
    }
}

const fn of_elements(signal: Signal) -> Signal {
    Signal {
        of_elements: true,
        ..signal
    }
}

/// Every signal, in the order of saved records and of the members of a plot.
#[rustfmt::skip]
pub(super) const TABLE: &[Signal] = &[
    both("@_normal_N", Q::NormalForce, 2, Joint(|joint| joint.normal_force.norm())),
    plotted("@_friction_N", Q::FrictionForce, Joint(|joint| joint.friction_force.norm())),
    both("@_eccentricity_m", Q::Eccentricity, 1, Joint(|joint| joint.eccentricity.norm())),
    listed("@_e#_m", 5, JointAxes(|joint| joint.eccentricity)),
    both("@_penetration_m", Q::Penetration, 5, Joint(|joint| joint.penetration)),
    listed("@_penetration_rate_m_s", 5, Joint(|joint| joint.penetration_rate)),
    listed("@_force_#_N", 5, JointAxes(|joint| joint.normal_force + joint.friction_force)),
    listed("@_friction_#_N", 5, JointAxes(|joint| joint.friction_force)),
    listed("@_state", 5, Joint(|joint| state_code(joint.state))),

    listed("t_s", 0, Whole("time", |frame| frame.time)),
    both("#_m", Q::Position, 0, Axes(|pose| pose.position)),
    both("#_rad", Q::Angles, 0, Angles(|pose| pose.angles)),
    both("v#_m_s", Q::Velocity, 0, Axes(|pose| pose.velocity)),
    both("#_rate_rad_s", Q::AngleRates, 4, Angles(|pose| pose.angle_rates)),
    both("a#_m_s2", Q::Acceleration, 3, Axes(|pose| pose.acceleration)),
    both("#_accel_rad_s2", Q::AngleAccelerations, 8, Angles(|pose| pose.angle_accelerations)),

    both("kinetic_J", Q::Energy, 7, Whole("kinetic", |frame| frame.kinetic)),
    both("potential_J", Q::Energy, 7, Whole("potential", |frame| frame.potential)),
    both("elastic_J", Q::Energy, 7, Whole("elastic", |frame| frame.elastic)),

    both("@_actuator_N", Q::ActuatorForce, 6, Slide),
    both("@_actuator_Nm", Q::ActuatorTorque, 6, Hinge),

    both("drive_work_J", Q::EnergyBalance, 10, Given("drives", |ledger| ledger.drive_work)),
    both("gravity_work_J", Q::EnergyBalance, 10, Given("gravity", |ledger| ledger.gravity_work)),
    both("clearance_work_J", Q::EnergyBalance, 11, Given("clearance", |ledger| ledger.clearance_work)),
    plotted("change_work_J", Q::EnergyBalance, Given("changes", |ledger| ledger.change_work)),
    // Any scene can be pulled by hand.
    plotted("external_work_J", Q::EnergyBalance, Given("external", |ledger| ledger.external_work)),
    of_elements(listed("external_work_J", 14, Given("external", |ledger| ledger.external_work))),
    both("restitution_loss_J", Q::EnergyBalance, 10, Taken("restitution", |ledger| ledger.restitution_loss)),
    both("friction_loss_J", Q::EnergyBalance, 10, Taken("friction", |ledger| ledger.friction_loss)),
    of_elements(both("damping_loss_J", Q::EnergyBalance, 13, Taken("damping", |ledger| ledger.damping_loss))),
    plotted("kinetic_change_J", Q::EnergyBalance, Taken("kinetic", |ledger| ledger.kinetic_change)),
    plotted("elastic_change_J", Q::EnergyBalance, Taken("elastic", |ledger| ledger.elastic_change)),
    both("energy_residual_J", Q::EnergyBalance, 11, Given("residual", Ledger::residual)),

    // Supplied by whoever computes the ideal motion alongside the run.
    plotted("tip_error_m", Q::TipError, Whole("distance", |_| f64::NAN)),
    both("probe_error_#_m", Q::ProbeError, 9, ProbeError),

    listed("@_force_#_N", 12, Element(ElementReport::own_force)),
    listed("@_torque_#_Nm", 12, Element(|element| element.torque)),
];

/// Code of a contact state in files.
fn state_code(state: ContactState) -> f64 {
    match state {
        ContactState::Free => 0.0,
        ContactState::Stick => 1.0,
        ContactState::Slip => 2.0,
        ContactState::Ideal => 3.0,
    }
}
