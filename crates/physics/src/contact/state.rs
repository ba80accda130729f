//! Contact state carried from step to step; part of the simulation state.

use serde::{Deserialize, Serialize};

use super::{ApproachBranch, Coefficients, FrictionBranch};

/// Contact state of one joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactState {
    /// Whether ball and socket are in contact.
    pub active: bool,
    /// Approach speed, m/s: delta_dot0 of this contact, or its largest rate so far, not below the scene's floor; 0 while free.
    pub approach_speed: f64,
    /// Whether the floor applied: this contact then rebounds higher than requested.
    pub below_speed_floor: bool,
    /// Active branch of the friction law.
    pub friction_branch: FrictionBranch,
    /// Active branch of the approach-speed rule.
    pub approach_branch: ApproachBranch,
}

/// Phase of a contact, by the sign of its penetration rate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ContactPhase {
    /// The penetration grows for the first time.
    #[default]
    Compression,
    /// The penetration falls for the first time.
    Restitution,
    /// The penetration has grown again: the contact lasts.
    Lasting,
}

impl ContactPhase {
    /// The phase after a step that ends at the penetration rate `rate`, m/s.
    pub fn after(self, rate: f64) -> Self {
        match self {
            Self::Compression if rate < 0.0 => Self::Restitution,
            Self::Restitution if rate > 0.0 => Self::Lasting,
            other => other,
        }
    }
}

impl ContactState {
    /// State of a contact that begins at the penetration rate `rate` (m/s).
    pub(crate) fn at_onset(c: &Coefficients, rate: f64) -> Self {
        Self {
            active: true,
            approach_speed: rate.max(c.speed_floor),
            below_speed_floor: rate < c.speed_floor,
            ..Self::default()
        }
    }

    /// State of a contact that begins and ends within a step: its approach speed is the current rate.
    pub(crate) fn within_step(c: &Coefficients) -> Self {
        Self { approach_branch: ApproachBranch::Rising, ..Self::at_onset(c, c.speed_floor) }
    }

    /// The same state with the full laws instead of single branches.
    pub(crate) fn unfrozen(self) -> Self {
        Self { friction_branch: FrictionBranch::Unfrozen, approach_branch: ApproachBranch::Unfrozen, ..self }
    }

    /// Updates the largest rate, if the law uses it, after a step that ends at the rate `end`; `fastest` gives the largest rate
    /// within the step. Returns whether the update changes the force at the end of the step.
    pub(crate) fn update_largest_rate(&mut self, c: &Coefficients, end: f64, fastest: impl FnOnce() -> f64) -> bool {
        if !c.uses_largest_rate {
            return false;
        }
        // With located corners, a step ends where the rate is largest.
        let is_unfrozen = self.approach_branch == ApproachBranch::Unfrozen;
        let fastest = if is_unfrozen { fastest() } else { end };
        let changes = is_unfrozen && fastest > self.approach_speed.max(end);
        self.approach_speed = self.approach_speed.max(fastest);
        changes
    }

    /// Selects the current branch of the approach-speed rule if none is frozen. A rate below the largest so far exceeds it only
    /// at a corner, but a rising rate may have stopped rising.
    pub(crate) fn freeze_approach(&mut self, c: &Coefficients, rate: f64) {
        if self.active && self.approach_branch == ApproachBranch::Unfrozen {
            self.approach_branch = c.approach_branch_at(self.approach_speed, rate);
        } else if self.approach_branch == ApproachBranch::Rising && rate < self.approach_speed {
            self.approach_branch = ApproachBranch::Held;
        }
    }

    /// Speed in the damping term, m/s, at the penetration rate `rate`; while the joint is free, the rate itself.
    #[inline]
    pub fn approach(&self, c: &Coefficients, rate: f64) -> f64 {
        if self.active { c.approach(self.approach_branch, self.approach_speed, rate) } else { c.with_floor(rate) }
    }

    /// Whether the approach speed is the rate itself, so that the damping term does not depend on it.
    pub(crate) fn approach_follows_rate(&self, c: &Coefficients, rate: f64) -> bool {
        self.active && c.approach_follows_rate(self.approach_branch, self.approach_speed, rate)
    }

    /// Whether the rate may cross into another branch of the rule. A rising rate may pass its maximum in any step.
    #[inline]
    pub(super) fn may_leave_approach_branch(&self, rate: f64) -> bool {
        match self.approach_branch {
            ApproachBranch::Unfrozen => false,
            ApproachBranch::Held => rate > self.approach_speed,
            ApproachBranch::Rising => true,
        }
    }
}
