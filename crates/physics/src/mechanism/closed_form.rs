//! Motion known in closed form, as functions of time alone: driven coordinates and, where no joint has play, the pose of the
//! output body.

use std::fmt::Debug;

use super::MechanismError;
use crate::jet::Jet;
use crate::machine::{Mat3, Vec3};

/// Maximum number of coordinates driven by one closed form.
pub const MOST_DRIVEN: usize = 3;

/// The motion at one instant.
#[derive(Clone, Copy, Debug)]
pub struct ClosedMotion {
    /// Driven coordinates, m or rad.
    pub driven: [Jet; MOST_DRIVEN],
    /// Origin of the output body, m.
    pub position: [Jet; 3],
    /// Rotation of the output body.
    pub rotation: Mat3,
    /// Its angular velocity, rad/s.
    pub angular_velocity: Vec3,
    /// Its angular acceleration, rad/s^2.
    pub angular_acceleration: Vec3,
}

/// Closed-form laws of the drives, with the resulting motion of the output body.
pub trait ClosedForm: Debug + Send + Sync {
    /// The motion at `t`.
    fn at(&self, t: f64) -> ClosedMotion;

    /// Checks that the mechanism can follow the motion at every instant.
    ///
    /// # Errors
    /// The mechanism cannot follow it.
    fn check(&self) -> Result<(), MechanismError>;
}
