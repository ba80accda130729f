//! Contact of a ball in its socket: pure functions of gap, rates and parameters. SI units, f64.

mod approach;
mod bristle;
mod discrete;
mod elastic;
mod film;
mod force;
mod law;
mod line;
mod slip;
mod state;

pub use approach::ApproachBranch;
pub use bristle::{BristleForce, Bristles};
pub use discrete::{ContactStep, StepForce};
pub use elastic::ElasticLaw;
pub use film::{Film, FilmShape};
pub use force::{Force, Separation, Stiffness};
pub use law::{Coefficients, ShownLaw, undisturbed_restitution};
pub use slip::FrictionBranch;
pub use state::{ContactPhase, ContactState};

use serde::{Deserialize, Serialize};

use crate::words::words;

type Vec3 = nalgebra::Vector3<f64>;
type Mat3 = nalgebra::Matrix3<f64>;

/// Normal-force law of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
pub enum NormalLaw {
    /// Lankarani & Nikravesh (1990), paper eq. (19). Valid only for restitution near 1.
    LankaraniNikravesh,
    /// Hertz without damping: elastic.
    Hertz,
    /// Hunt & Crossley (1975).
    HuntCrossley,
    /// Flores, Machado, Silva & Martins (2011): valid for low restitution too.
    Flores,
    /// Gonthier, McPhee, Lange & Piedbœuf (2004): exact restitution over the whole range 0 < ce <= 1.
    Gonthier,
}

words!(NormalLaw {
    LankaraniNikravesh => "lankarani-nikravesh",
    Hertz => "hertz",
    HuntCrossley => "hunt-crossley",
    Flores => "flores",
    Gonthier => "gonthier",
});

/// Friction law of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
pub enum FrictionLaw {
    /// Modified Coulomb of Ambrósio, paper eqs. (20)-(21).
    ModifiedCoulomb,
    /// Elastic bristles that slide at their limit, after Gonthier et al. (2004): sticks.
    Bristle,
    /// No friction.
    None,
}

words!(FrictionLaw {
    ModifiedCoulomb => "modified-coulomb",
    Bristle => "bristle",
    None => "none",
});

/// Sliding velocity used by the friction law.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
pub enum FrictionVelocity {
    /// Relative velocity of the two centres, paper eqs. (15)-(16).
    Centres,
    /// Relative velocity of the two material points in contact.
    Surface,
}

words!(FrictionVelocity {
    Centres => "centres",
    Surface => "surface",
});

/// Where a contact takes off what it wears.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
pub enum WearShape {
    /// Of the whole surface that the play is between, evenly.
    Even,
    /// Of the wall of a socket or a bearing where it is touched; of other surfaces evenly.
    Profile,
}

words!(WearShape {
    Even => "even",
    Profile => "profile",
});

/// Approach speed by which the damping term of the normal force divides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd)]
pub enum ApproachSpeed {
    /// The penetration rate at which the contact began, paper eq. (19).
    Start,
    /// The largest penetration rate of the contact so far.
    Largest,
}

words!(ApproachSpeed {
    Start => "start",
    Largest => "largest",
});

/// Elastic law of a joint's contacts. A length is that of the pin in its bearing, or of the part of it that bears, m; both parts are of the
/// same material.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
pub enum Elasticity {
    /// F = K d^1.5, spheres after Hertz, K from radii and material: `elastic = "sphere"`. Used for pins, too, which it makes too soft.
    #[default]
    Sphere,
    /// F = K d^1.5 with this K > 0, N/m^1.5, whatever the play: `stiffness`. Of a ball, of a pin, whose ends have half of it each, or of
    /// each corner of a block.
    Stiffness(f64),
    /// F = K d^1.5 with the K at which a pin under this force is as deep as in line contact: `stiffness_at`.
    StiffnessAt {
        /// N; below [`ElasticLaw::largest_line_force`].
        force: f64,
        /// L, m.
        length: f64,
    },
    /// Johnson's line contact of a pin: `elastic = "line"`. Each end has half of it.
    Line {
        /// L, m.
        length: f64,
    },
}

/// Contact parameters of a joint with play. SI units.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Parameters {
    /// Radial clearance c = R - r, m, or play to each wall; 0 makes the joint ideal in these directions.
    pub clearance: f64,
    /// Play of a pin along its axis, to each side, or of a block to each wall across the first two, m; 0: none. A ball has no other.
    pub second_clearance: f64,
    /// Coulomb coefficient cf; with bristles, the kinetic one.
    pub friction: f64,
    /// Static over kinetic coefficient, at least 1: with bristles.
    pub static_friction_ratio: f64,
    /// v_s, m/s: the speed at which the coefficient has fallen most of the way from the static to the kinetic one, with bristles.
    pub stribeck_speed: f64,
    /// k > 0, N/m, of the bristles.
    pub bristle_stiffness: f64,
    /// d, N s/m, of the bristles.
    pub bristle_damping: f64,
    /// Requested restitution ce, 0..=1.
    pub restitution: f64,
    /// Approach speed above which it falls, m/s; 0: it does not.
    pub yield_speed: f64,
    /// Young's modulus E of both bodies, Pa.
    pub youngs_modulus: f64,
    /// Poisson's ratio nu of both bodies.
    pub poisson_ratio: f64,
    /// Ball radius r, m.
    pub ball_radius: f64,
    /// Elastic law.
    pub elasticity: Elasticity,
    /// Sliding velocity used by the friction law.
    pub friction_velocity: FrictionVelocity,
    /// v_a, m/s: no friction below it.
    pub slip_speed_low: f64,
    /// v_theta, m/s: full friction above it.
    pub slip_speed_high: f64,
    /// Lower bound of the approach speed in the damping term, m/s.
    pub impact_speed_floor: f64,
    /// Approach speed in the damping term.
    pub approach_speed: ApproachSpeed,
    /// Normal-force law.
    pub normal_law: NormalLaw,
    /// Friction law.
    pub friction_law: FrictionLaw,
    /// Worn volume by normal force and sliding distance, m^2/N (Archard); 0: nothing wears.
    pub wear_coefficient: f64,
    /// Where that volume is taken off.
    pub wear_shape: WearShape,
}

impl Parameters {
    /// Each play, m; 0 where the joint is ideal.
    pub fn clearances(&self) -> [f64; 2] {
        [self.clearance, self.second_clearance]
    }

    /// Whether its contacts have bristles, whose deflections are part of the state.
    pub fn has_bristles(&self) -> bool {
        self.friction_law == FrictionLaw::Bristle && !self.is_ideal()
    }

    /// Whether its round walls wear by direction, so that their profiles are part of the state.
    pub(crate) fn has_profile(&self) -> bool {
        self.wear_shape == WearShape::Profile && self.clearance > 0.0
    }

    /// What determines the equations that the joint adds, and its state: whether it has each play, bristles, and profiles.
    pub(crate) fn structure(&self) -> [bool; 4] {
        let [first, second] = self.clearances().map(|play| play > 0.0);
        [first, second, self.has_bristles(), self.has_profile()]
    }

    /// Whether the joint has no play.
    pub fn is_ideal(&self) -> bool {
        self.clearances() == [0.0; 2]
    }

    /// The same joint without play.
    pub fn without_play(self) -> Self {
        Self { clearance: 0.0, second_clearance: 0.0, ..self }
    }

    /// The paper's values (Table 2) with the default scene's clearance and friction.
    pub const DEFAULT: Self = Self {
        clearance: 0.3e-3,
        second_clearance: 0.0,
        friction: 0.15,
        static_friction_ratio: 1.0,
        stribeck_speed: 1e-3,
        bristle_stiffness: 1e8,
        bristle_damping: 2e3,
        restitution: 0.9,
        yield_speed: 0.0,
        youngs_modulus: 206e9,
        poisson_ratio: 0.3,
        ball_radius: 0.010,
        elasticity: Elasticity::Sphere,
        friction_velocity: FrictionVelocity::Surface,
        slip_speed_low: 1e-6,
        slip_speed_high: 1e-4,
        impact_speed_floor: 1e-3,
        approach_speed: ApproachSpeed::Start,
        normal_law: NormalLaw::LankaraniNikravesh,
        friction_law: FrictionLaw::ModifiedCoulomb,
        wear_coefficient: 0.0,
        wear_shape: WearShape::Even,
    };
}

impl Default for Parameters {
    fn default() -> Self {
        Self::DEFAULT
    }
}
