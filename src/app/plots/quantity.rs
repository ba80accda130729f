//! How the plot of each quantity is labelled and drawn.

use PlotKind::{Bands, Curves, FromZero, FromZeroWithClearances};

use crate::simulate::Quantity;

/// How a plot shows its channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::app) enum PlotKind {
    /// One curve per channel, over their range.
    Curves,
    /// Curves over a range that begins at zero: no value is ever negative.
    FromZero,
    /// As `FromZero`, with the clearances of the joints.
    FromZeroWithClearances,
    /// Bands stacked on both sides of zero.
    Bands,
}

/// How a plot presents its quantity.
pub(in crate::app) struct QuantityPlot {
    /// Sentence-case name.
    pub label: &'static str,
    /// Axis unit, and its value in SI units.
    pub unit: (&'static str, f64),
    pub kind: PlotKind,
    /// A one-sentence description.
    pub help: &'static str,
}

/// The plot of `quantity`.
#[rustfmt::skip]
pub(in crate::app) fn plot_of(quantity: Quantity) -> QuantityPlot {
    let (label, unit, kind, help) = match quantity {
        Quantity::NormalForce => ("Normal force", ("N", 1.0), FromZero, "Size of the normal force on each ball; of the whole reaction where a joint is ideal."),
        Quantity::FrictionForce => ("Friction force", ("N", 1.0), FromZero, "Size of the friction force on each ball."),
        Quantity::LubricantForce => ("Lubricant force", ("N", 1.0), FromZero, "Size of the force of the lubricant on each ball."),
        Quantity::Eccentricity => ("Eccentricity", ("mm", 1e-3), FromZeroWithClearances, "Distance of each ball's centre from its socket's centre. Contact begins at the clearance; at a wall that wears by direction, farther out by what has worn off there."),
        Quantity::Penetration => ("Indentation", ("µm", 1e-6), Curves, "How deep each ball presses into its socket; below zero there is a gap."),
        Quantity::Position => ("Position", ("mm", 1e-3), Curves, "Origin of the output body in world axes."),
        Quantity::Angles => ("Angles", ("mrad", 1e-3), Curves, "Angles α, β, γ of the output body."),
        Quantity::Velocity => ("Velocity", ("m/s", 1.0), Curves, "Velocity of the output body's origin."),
        Quantity::AngleRates => ("Angle rates", ("rad/s", 1.0), Curves, "Rates of the angles α, β, γ."),
        Quantity::Acceleration => ("Acceleration", ("m/s²", 1.0), Curves, "Acceleration of the output body's origin."),
        Quantity::AngleAccelerations => ("Angle accelerations", ("rad/s²", 1.0), Curves, "Second derivatives of the angles α, β, γ."),
        Quantity::ActuatorForce => ("Actuator force", ("N", 1.0), Curves, "Force that each driven slide needs, positive along its axis."),
        Quantity::ActuatorTorque => ("Actuator torque", ("N m", 1.0), Curves, "Torque that each driven hinge needs, positive about its axis."),
        Quantity::Energy => ("Energy", ("mJ", 1e-3), Curves, "Kinetic, potential and elastic energy of the whole mechanism."),
        Quantity::EnergyBalance => ("Energy balance", ("mJ", 1e-3), Bands, "Since the start: work of drives, gravity, moving clearances, changed parameters and loads from outside, loss by restitution, friction and dampers, change of kinetic and elastic energy, and the residual, which is the error of the integration."),
        Quantity::ProbeError => ("Tip error by axis", ("mm", 1e-3), Curves, "Position of the probe tip less that of the ideal mechanism at the same time, by world axis."),
        Quantity::TipError => ("Tip error", ("µm", 1e-6), FromZero, "Distance of the output point (the probe tip, or the output body's origin) from where ideal joints have it at the same time. While this is chosen, the machine with ideal joints runs alongside; key G shows it."),
    };
    QuantityPlot { label, unit, kind, help }
}
