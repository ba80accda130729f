//! A motion that is known in closed form: driven coordinates, and the pose of the output body where no joint has play, as
//! functions of time alone.

use std::fmt::Debug;

use super::MechanismError;
use crate::jet::Jet;
use crate::machine::{Mat3, Vec3};

/// Most coordinates that one closed form drives.
pub const MOST_DRIVEN: usize = 3;

/// The motion at one instant.
#[derive(Clone, Copy, Debug)]
pub struct ClosedMotion {
    /// Driven coordinates, m or rad.
    pub driven: [Jet; MOST_DRIVEN],
    /// Origin of the output body, m.
    pub position: [Jet; 3],
    /// Its rotation.
    pub rotation: Mat3,
    /// Its angular velocity, rad/s.
    pub angular_velocity: Vec3,
    /// Its angular acceleration, rad/s^2.
    pub angular_acceleration: Vec3,
}

/// Drives whose law, and the motion of the output body with it, are known for every instant.
pub trait ClosedForm: Debug + Send + Sync {
    /// The motion at `t`.
    fn at(&self, t: f64) -> ClosedMotion;

    /// Checks that the mechanism can follow it at every instant.
    ///
    /// # Errors
    /// Where it cannot.
    fn check(&self) -> Result<(), MechanismError>;
}
