//! Which quantities of a simulation are recorded for the plots, in which order, and how they are read from a frame.

use super::{Frame, Ledger};
use crate::scene::{JointKind, Scene, Vec3};

/// Ball joints, and drives, that are recorded; in a longer chain the rest would cost more memory than they tell.
pub const RECORDED_JOINTS: usize = 12;

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

/// How a term of the balance is read, J.
type Take = fn(&Ledger) -> f64;

impl Quantity {
    /// All of them, in the order in which a list shows them.
    pub const ALL: [Self; 16] = [
        Self::NormalForce,
        Self::FrictionForce,
        Self::Eccentricity,
        Self::Penetration,
        Self::Position,
        Self::Angles,
        Self::Velocity,
        Self::AngleRates,
        Self::Acceleration,
        Self::AngleAccelerations,
        Self::ActuatorForce,
        Self::ActuatorTorque,
        Self::Energy,
        Self::EnergyBalance,
        Self::ProbeError,
        Self::TipError,
    ];

    /// Members of [`Self::EnergyBalance`]: kinetic and elastic change equal the works given by drives, gravity, clearance,
    /// changes and loads from outside, less the losses by restitution, friction and dampers, plus the residual.
    const BALANCE: [(&str, Take); 11] = [
        ("drives", |ledger| ledger.drive_work),
        ("gravity", |ledger| ledger.gravity_work),
        ("clearance", |ledger| ledger.clearance_work),
        ("changes", |ledger| ledger.change_work),
        ("external", |ledger| ledger.external_work),
        ("restitution", |ledger| ledger.restitution_loss),
        ("friction", |ledger| ledger.friction_loss),
        ("damping", |ledger| ledger.damping_loss),
        ("kinetic", |ledger| ledger.kinetic_change),
        ("elastic", |ledger| ledger.elastic_change),
        ("residual", Ledger::residual),
    ];

    /// Those that a scene without force elements has not.
    const OF_ELEMENTS: [&str; 2] = ["external", "damping"];

    /// Those of the balance that take energy, or hold it; the others give. All together cancel.
    pub const TAKES: [&str; 5] = ["restitution", "friction", "damping", "kinetic", "elastic"];

    /// Sentence-case name.
    pub fn label(self) -> &'static str {
        match self {
            Self::NormalForce => "Normal force",
            Self::FrictionForce => "Friction force",
            Self::Eccentricity => "Eccentricity",
            Self::Penetration => "Penetration",
            Self::Position => "Position",
            Self::Angles => "Angles",
            Self::Velocity => "Velocity",
            Self::AngleRates => "Angle rates",
            Self::Acceleration => "Acceleration",
            Self::AngleAccelerations => "Angle accelerations",
            Self::ActuatorForce => "Actuator force",
            Self::ActuatorTorque => "Actuator torque",
            Self::Energy => "Energy",
            Self::EnergyBalance => "Energy balance",
            Self::ProbeError => "Probe error",
            Self::TipError => "Tip error",
        }
    }

    /// Unit on the axis, and SI units in one of it.
    pub fn unit(self) -> (&'static str, f64) {
        match self {
            Self::NormalForce | Self::FrictionForce | Self::ActuatorForce => ("N", 1.0),
            Self::ActuatorTorque => ("N m", 1.0),
            Self::Eccentricity | Self::Position | Self::ProbeError => ("mm", 1e-3),
            Self::Penetration | Self::TipError => ("µm", 1e-6),
            Self::Angles => ("mrad", 1e-3),
            Self::Velocity => ("m/s", 1.0),
            Self::AngleRates => ("rad/s", 1.0),
            Self::Acceleration => ("m/s²", 1.0),
            Self::AngleAccelerations => ("rad/s²", 1.0),
            Self::Energy | Self::EnergyBalance => ("mJ", 1e-3),
        }
    }

    /// What it is, in a sentence.
    pub fn help(self) -> &'static str {
        match self {
            Self::NormalForce => {
                "Size of the normal force on each ball; of the whole reaction where a joint is ideal."
            }
            Self::FrictionForce => "Size of the friction force on each ball.",
            Self::Eccentricity => {
                "Distance of each ball's centre from its socket's centre. Contact begins at the clearance."
            }
            Self::Penetration => {
                "How deep each ball presses into its socket; below zero there is a gap."
            }
            Self::Position => "Origin of the output body in world axes.",
            Self::Angles => "Angles α, β, γ of the output body.",
            Self::Velocity => "Velocity of the output body's origin.",
            Self::AngleRates => "Rates of the angles α, β, γ.",
            Self::Acceleration => "Acceleration of the output body's origin.",
            Self::AngleAccelerations => "Second derivatives of the angles α, β, γ.",
            Self::ActuatorForce => "Force that each driven slide needs, positive along its axis.",
            Self::ActuatorTorque => "Torque that each driven hinge needs, positive about its axis.",
            Self::Energy => "Kinetic, potential and elastic energy of the whole mechanism.",
            Self::EnergyBalance => {
                "Since the start: work of drives, gravity, moving clearances, changed parameters and loads from outside, loss \
                 by restitution, friction and dampers, change of kinetic and elastic energy, and the residual, which is the \
                 error of the integration."
            }
            Self::ProbeError => "Probe tip minus the tip of the ideal mechanism at the same time.",
            Self::TipError => {
                "Distance of the output point (the probe tip, or the output body's origin) from where ideal joints have it at the \
                 same time. Recorded while the ideal ghost is on (key G)."
            }
        }
    }
}

/// One recorded series.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// What it measures.
    pub quantity: Quantity,
    /// Which one of them: a joint's name, an axis, a kind of energy.
    pub member: String,
}

impl Channel {
    /// Name of its column in a file, with the SI unit: that of `run` for the same quantity.
    pub fn column(&self) -> String {
        let member = self.member.as_str();
        let angle = match member {
            "α" => "alpha",
            "β" => "beta",
            "γ" => "gamma",
            other => other,
        };
        match self.quantity {
            Quantity::NormalForce => format!("{member}_normal_N"),
            Quantity::FrictionForce => format!("{member}_friction_N"),
            Quantity::Eccentricity => format!("{member}_eccentricity_m"),
            Quantity::Penetration => format!("{member}_penetration_m"),
            Quantity::Position => format!("{member}_m"),
            Quantity::Angles => format!("{angle}_rad"),
            Quantity::Velocity => format!("v{member}_m_s"),
            Quantity::AngleRates => format!("{angle}_rate_rad_s"),
            Quantity::Acceleration => format!("a{member}_m_s2"),
            Quantity::AngleAccelerations => format!("{angle}_accel_rad_s2"),
            Quantity::ActuatorForce => format!("{member}_actuator_N"),
            Quantity::ActuatorTorque => format!("{member}_actuator_Nm"),
            Quantity::Energy => format!("{member}_J"),
            Quantity::EnergyBalance => match member {
                "drives" => "drive_work_J".to_owned(),
                "changes" => "change_work_J".to_owned(),
                "restitution" | "friction" | "damping" => format!("{member}_loss_J"),
                "kinetic" | "elastic" => format!("{member}_change_J"),
                "residual" => "energy_residual_J".to_owned(),
                other => format!("{other}_work_J"),
            },
            Quantity::ProbeError => format!("probe_error_{member}_m"),
            Quantity::TipError => "tip_error_m".to_owned(),
        }
    }
}

/// The channels of one scene, in the order in which [`Channels::read`] writes them.
#[derive(Clone, Debug, Default)]
pub struct Channels {
    list: Vec<Channel>,
    joints: usize,
    drives: usize,
    probe: bool,
    balance: bool,
    elements: bool,
}

/// Members of the energy balance of a scene, with force `elements` or without.
fn balance_of(elements: bool) -> impl Iterator<Item = (&'static str, Take)> {
    let all = Quantity::BALANCE.into_iter();
    all.filter(move |(member, _)| elements || !Quantity::OF_ELEMENTS.contains(member))
}

impl Channels {
    /// The channels that `scene` has.
    pub fn of(scene: &Scene) -> Self {
        let joints = scene.ball_joints.len().min(RECORDED_JOINTS);
        let all_driven = scene.joints.iter().filter(|joint| joint.drive.is_some());
        let driven = || all_driven.clone().take(RECORDED_JOINTS);
        let mut list = Vec::new();
        let mut add = |quantity, member: &str| {
            list.push(Channel {
                quantity,
                member: member.to_owned(),
            });
        };
        for joint in scene.ball_joints.iter().take(joints) {
            for quantity in &Quantity::ALL[..4] {
                add(*quantity, &joint.name);
            }
        }
        for (quantity, members) in [
            (Quantity::Position, ["x", "y", "z"]),
            (Quantity::Angles, ["α", "β", "γ"]),
            (Quantity::Velocity, ["x", "y", "z"]),
            (Quantity::AngleRates, ["α", "β", "γ"]),
            (Quantity::Acceleration, ["x", "y", "z"]),
            (Quantity::AngleAccelerations, ["α", "β", "γ"]),
            (Quantity::Energy, ["kinetic", "potential", "elastic"]),
        ] {
            for member in members {
                add(quantity, member);
            }
        }
        for joint in driven() {
            let quantity = match joint.kind {
                JointKind::Revolute => Quantity::ActuatorTorque,
                _ => Quantity::ActuatorForce,
            };
            add(quantity, &joint.name);
        }
        let (balance, elements) = (scene.solver.energy_ledger, !scene.elements.is_empty());
        if balance {
            for (member, _) in balance_of(elements) {
                add(Quantity::EnergyBalance, member);
            }
        }
        let probe = scene.output.probe.is_some();
        if probe {
            for member in ["x", "y", "z"] {
                add(Quantity::ProbeError, member);
            }
        }
        add(Quantity::TipError, "distance");
        Self {
            list,
            joints,
            drives: driven().count(),
            probe,
            balance,
            elements,
        }
    }

    /// The channels in order.
    pub fn list(&self) -> &[Channel] {
        &self.list
    }

    /// Number of channels.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Index of the normal force of ball joint `joint`, if it is recorded.
    pub fn normal_force(&self, joint: usize) -> Option<usize> {
        (joint < self.joints).then_some(4 * joint)
    }

    /// Index of the error of the output point.
    pub fn tip_error(&self) -> usize {
        self.list.len() - 1
    }

    /// Reads every channel from `frame` into `out`, SI units; the error of the output point, which is no part of a frame, is
    /// NaN.
    pub fn read(&self, frame: &Frame, out: &mut Vec<f64>) {
        out.clear();
        for report in frame.joints.iter().take(self.joints) {
            out.extend([
                report.normal_force.norm(),
                report.friction_force.norm(),
                report.eccentricity.norm(),
                report.penetration,
            ]);
        }
        let pose = &frame.pose;
        for vector in [
            pose.position,
            pose.angles,
            pose.velocity,
            pose.angle_rates,
            pose.acceleration,
            pose.angle_accelerations,
            Vec3::new(frame.kinetic, frame.potential, frame.elastic),
        ] {
            out.extend(vector.iter());
        }
        out.extend(frame.actuators.iter().take(self.drives));
        if self.balance {
            let ledger = frame.ledger.unwrap_or_default();
            out.extend(balance_of(self.elements).map(|(_, take)| take(&ledger)));
        }
        if self.probe {
            out.extend(frame.probe_error.unwrap_or(Vec3::repeat(f64::NAN)).iter());
        }
        out.push(f64::NAN);
        debug_assert_eq!(out.len(), self.list.len());
    }
}
