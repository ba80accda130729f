//! What a contact remembers between steps: part of the state.

use super::{ApproachPiece, Coefficients, FrictionPiece};

/// Contact memory of one joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// In contact.
    pub active: bool,
    /// Speed that the damping term divides by: delta_dot0 of this contact, or its largest rate so far, not below the scene's
    /// floor, m/s; 0 while free.
    pub approach_speed: f64,
    /// The floor was used: this contact rebounds higher than requested.
    pub floored: bool,
    /// Active piece of the friction law.
    pub friction_piece: FrictionPiece,
    /// Active piece of the rule for the approach speed.
    pub approach_piece: ApproachPiece,
}

impl Memory {
    /// Memory of a contact that begins at `rate` (m/s).
    pub fn begun(c: &Coefficients, rate: f64) -> Self {
        Self {
            active: true,
            approach_speed: rate.max(c.speed_floor),
            floored: rate < c.speed_floor,
            ..Self::default()
        }
    }

    /// Speed that the damping term divides by if the penetration grows at `rate`, m/s: the rate itself until a contact has a
    /// memory.
    #[inline]
    pub fn approach(&self, c: &Coefficients, rate: f64) -> f64 {
        if self.active {
            c.approach(self.approach_piece, self.approach_speed, rate)
        } else {
            rate.max(c.speed_floor)
        }
    }

    /// Whether that is the rate itself, so that the damping term does not depend on it.
    pub(super) fn follows(&self, c: &Coefficients, rate: f64) -> bool {
        self.active && c.approach_follows(self.approach_piece, self.approach_speed, rate)
    }

    /// Whether the rate may pass from one piece of the rule to the next. A rising rate may pass its maximum in any step.
    #[inline]
    pub(super) fn may_turn(&self, rate: f64) -> bool {
        match self.approach_piece {
            ApproachPiece::Unsplit => false,
            ApproachPiece::Held => rate > self.approach_speed,
            ApproachPiece::Rising => true,
        }
    }
}
