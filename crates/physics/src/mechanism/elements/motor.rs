//! Motor on a slide or hinge. Its force or torque is F + k (target - q) + d (target' - q'), clamped to a limit, where q is the
//! joint's coordinate. Its work counts as drive work.

use std::sync::Arc;

use super::coordinate::{CoordinateLaw, Slopes};
use crate::jet::Jet;
use crate::machine;
use crate::mechanism::Powers;
use crate::mechanism::drives::Law;

pub(super) struct Motor {
    pub motor: machine::Motor,
    pub target: Option<Arc<dyn Law>>,
}

impl Motor {
    /// The force or torque on the child without its limit.
    fn unclamped(&self, [x, v]: [f64; 2]) -> f64 {
        self.motor.force - (self.motor.stiffness * x + self.motor.damping * v)
    }
}

impl CoordinateLaw for Motor {
    fn target(&self, t: f64) -> Jet {
        self.target.as_ref().map_or_else(Jet::default, |law| law.at(t))
    }

    fn force(&self, deviation: [f64; 2]) -> f64 {
        self.unclamped(deviation).clamp(-self.motor.limit, self.motor.limit)
    }

    fn is_stiff(&self) -> bool {
        self.motor.stiffness > 0.0 || self.motor.damping > 0.0
    }

    fn slopes(&self, deviation: [f64; 2]) -> Option<Slopes> {
        let machine::Motor { stiffness, damping, limit, .. } = self.motor;
        let is_constant = self.unclamped(deviation).abs() > limit || (stiffness == 0.0 && damping == 0.0);
        (!is_constant).then_some(Slopes { by_position: -stiffness, by_rate: -damping })
    }

    fn work(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        0.5 * (self.force(from) + self.force(to)) * (to[0] - from[0])
    }

    fn add_powers(&self, deviation: [f64; 2], rate: f64, powers: &mut Powers) {
        powers.drive += self.force(deviation) * rate;
    }
}
