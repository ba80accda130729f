//! Why a simulation stopped, in numbers; the wording is formed on display.

use serde::{Deserialize, Serialize};

use crate::units::format_quantity_digits;

/// Why the divergence guard stopped a simulation. The state is the last good one.
#[derive(Debug, Clone, PartialEq, thiserror::Error, Serialize, Deserialize)]
#[error("stopped at t = {}: {fault}; {advice}", format_quantity_digits(*time, "s", 7))]
pub struct Stopped {
    /// Time of the last good state, s.
    pub time: f64,
    /// What went wrong.
    pub fault: StopFault,
    /// What to try.
    pub advice: StopAdvice,
}

/// Faults that stop a simulation.
#[derive(Debug, Clone, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum StopFault {
    /// An ideal motion at a pose beyond which its loops could close on another branch.
    #[error("the loops through the ideal joints pass a singular pose")]
    SingularLoops,
    /// An ideal motion whose output body has left the path in closed form.
    #[error(
        "the output body is {distance:.1e} m off its path in [closed_form]: the path does not fit the drives here, or the loops \
         have closed on another branch"
    )]
    OffPath {
        /// Distance of the probe's tip, or of the body's origin without a probe, from the path, m.
        distance: f64,
    },
    /// Loops left open by projection.
    #[error("the loops through the ideal joints came apart by {open:.1e} m")]
    OpenLoops {
        /// Largest gap, m.
        open: f64,
    },
    /// Stabilised constraints that have drifted too far to hold the mechanism together.
    #[error("the constraints of formulation lagrange drifted by {drift:.1e} m")]
    Drift {
        /// Largest constraint error, m or rad.
        drift: f64,
    },
    /// Constraint rows of the `lagrange` form that become dependent.
    #[error("the constraints pass a singular pose")]
    SingularConstraints,
    /// A joint that has come apart through its wall.
    #[error("joint {joint}: it is {penetration:.3e} m inside its wall, more than a tenth of the radius there")]
    LeftSocket {
        /// Name of the site.
        joint: String,
        /// m.
        penetration: f64,
    },
    /// A wall that has worn through.
    #[error("joint {joint}: its wall has worn by {depth:.3e} m in one direction, more than its radius")]
    WornThrough {
        /// Name of the joint.
        joint: String,
        /// m.
        depth: f64,
    },
    /// A fixed step that stored more energy in a contact than the approach can have brought.
    #[error(
        "joint {joint}: one step put it {penetration:.3e} m inside its wall, with {times:.1} times the energy that it can have \
         arrived with"
    )]
    Overshoot {
        /// Name of the site.
        joint: String,
        /// m.
        penetration: f64,
        /// Energy stored over energy of the approach.
        times: f64,
    },
    /// An absurd or undefined speed.
    #[error("body {body}: speed {speed:.3e} m/s, angular speed {angular_speed:.3e} rad/s")]
    AbsurdSpeed {
        /// Name.
        body: String,
        /// m/s.
        speed: f64,
        /// rad/s.
        angular_speed: f64,
    },
    /// Accelerations that are not finite.
    #[error("the accelerations are not finite")]
    NotFinite,
    /// A step over which no contact forces were found.
    #[error("no contact forces satisfy the equations of a step of {shortest:.0e} s")]
    NoForces {
        /// Shortest step tried at this time, s.
        shortest: f64,
    },
    /// A step size as small as rounding.
    #[error("the tolerance requires steps shorter than {shortest:.0e} s")]
    ShortStep {
        /// Shortest step tried at this time, s.
        shortest: f64,
    },
}

/// What to try after a simulation has stopped.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum StopAdvice {
    /// Closed loops cannot stay closed here.
    #[error("the ideal joints are (nearly) dependent here: keep clear of this pose, or give a joint a clearance")]
    Dependent,
    /// The path in closed form is wrong, or left.
    #[error("correct its functions, or leave out x, y and z; or keep clear of singular poses")]
    FittingPath,
    /// Adaptive steps are already as short as needed: the motion itself is beyond the model.
    #[error("try slower drives, a stiffer contact, or a tighter solver.tolerance (now {tolerance:e})")]
    GentlerMotion {
        /// Current value.
        tolerance: f64,
    },
    /// The fixed step is too long.
    #[error("try a smaller solver.step (now {step:e} s) or solver.method = automatic")]
    ShorterStep {
        /// Current value, s.
        step: f64,
    },
    /// The method does not suit the scene.
    #[error("try solver.method = automatic, or else a softer contact")]
    OtherMethod,
    /// Nothing is left to wear.
    #[error("try a smaller contact.wear_coefficient, or a shorter run")]
    LessWear,
    /// A tolerance that cannot be met in this scene.
    #[error("try a looser solver.tolerance (now {tolerance:e}) or a softer or heavier scene")]
    LooserTolerance {
        /// Current value.
        tolerance: f64,
    },
}
