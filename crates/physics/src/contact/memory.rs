//! What a contact remembers between steps: part of the state.

use serde::{Deserialize, Serialize};

use super::{ApproachPiece, Coefficients, FrictionPiece};

/// Contact memory of one joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
        Self { active: true, approach_speed: c.floored(rate), floored: rate < c.speed_floor, ..Self::default() }
    }

    /// Memory of a contact that begins and ends within a step: its approach speed is the rate at each instant.
    pub fn passing(c: &Coefficients) -> Self {
        Self { approach_piece: ApproachPiece::Rising, ..Self::begun(c, c.speed_floor) }
    }

    /// The same on the whole laws.
    pub fn unsplit(self) -> Self {
        Self { friction_piece: FrictionPiece::Unsplit, approach_piece: ApproachPiece::Unsplit, ..self }
    }

    /// Raises the largest rate so far, if it counts, by a step that ends at the rate `end`; `fastest` is the largest over the
    /// whole step. Returns whether the force at its end changes with it.
    pub fn rise(&mut self, c: &Coefficients, end: f64, fastest: impl FnOnce() -> f64) -> bool {
        if !c.largest {
            return false;
        }
        // Located corners end a step where the rate is largest.
        let whole = self.approach_piece == ApproachPiece::Unsplit;
        let fastest = if whole { fastest() } else { end };
        let changes = whole && fastest > self.approach_speed.max(end);
        self.approach_speed = self.approach_speed.max(fastest);
        changes
    }

    /// Puts it on the current piece of the rule for the approach speed if it holds none. A rate below the largest so far exceeds
    /// it only at a corner, but a rising one may have stopped rising.
    pub fn hold_approach(&mut self, c: &Coefficients, rate: f64) {
        if self.active && self.approach_piece == ApproachPiece::Unsplit {
            self.approach_piece = c.approach_piece_at(self.approach_speed, rate);
        } else if self.approach_piece == ApproachPiece::Rising && rate < self.approach_speed {
            self.approach_piece = ApproachPiece::Held;
        }
    }

    /// Speed that the damping term divides by if the penetration grows at `rate`, m/s: the rate itself until a contact has a
    /// memory.
    #[inline]
    pub fn approach(&self, c: &Coefficients, rate: f64) -> f64 {
        if self.active { c.approach(self.approach_piece, self.approach_speed, rate) } else { c.floored(rate) }
    }

    /// Whether that is the rate itself, so that the damping term does not depend on it.
    pub fn follows(&self, c: &Coefficients, rate: f64) -> bool {
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
