//! Normal-force and friction laws.
//!
//! Every normal law here has the form F_N = F(delta) (1 + chi delta_dot / delta_dot0), cut off below 0, with the elastic law F of
//! `elastic.rs`: they differ only in the damping factor chi(ce), so the force itself is one kernel. Whatever F is, an undisturbed impact
//! loses the same part of its energy: the work of the damping, the integral of F chi delta_dot / delta_dot0 over the penetration, follows
//! from the energies alone.

use super::{ApproachSpeed, Bristles, ElasticLaw, Elasticity, FrictionLaw, FrictionVelocity, NormalLaw, Parameters};

/// A law as a tooltip shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShownLaw {
    /// Name of the law.
    pub law: &'static str,
    /// Its formula.
    pub formula: &'static str,
    /// Publication, if other than the paper.
    pub elsewhere: Option<&'static str>,
}

/// A normal law as it is shown on spheres, and on line contact: what follows the elastic force.
macro_rules! on_elastic {
    ($rest:literal) => {
        [concat!("N = K d^1.5", $rest), concat!("N = F", $rest, ", F: elastic force")]
    };
}

/// What distinguishes a normal law from the others.
struct Entry {
    law: &'static str,
    formulas: [&'static str; 2],
    elsewhere: Option<&'static str>,
    /// Damping factor chi for the requested restitution ce.
    damping: fn(f64) -> f64,
}

impl NormalLaw {
    /// - Lankarani & Nikravesh (1990): derived for ce near 1.
    /// - Gonthier et al. (2004): the chi for which an undisturbed impact rebounds with exactly ce, the root of
    ///   chi (1 + ce) = ln((1 + chi) / (1 - ce chi)).
    fn entry(self) -> Entry {
        match self {
            Self::LankaraniNikravesh => Entry {
                law: "Lankarani–Nikravesh normal force",
                formulas: on_elastic!(" (1 + ¾ (1 - e²) d' / d'0), d: penetration, d'0: approach speed"),
                elsewhere: None,
                damping: |ce| 0.75 * (1.0 - ce * ce),
            },
            Self::Hertz => Entry {
                law: "Hertz normal force, without damping",
                formulas: on_elastic!(", d: penetration"),
                elsewhere: Some("Hertz (1882)"),
                damping: |_| 0.0,
            },
            Self::HuntCrossley => Entry {
                law: "Hunt–Crossley normal force",
                formulas: on_elastic!(" (1 + 1.5 (1 - e) d' / d'0), d: penetration, d'0: approach speed"),
                elsewhere: Some("Hunt & Crossley (1975)"),
                damping: |ce| 1.5 * (1.0 - ce),
            },
            Self::Flores => Entry {
                law: "Normal force of Flores et al.",
                formulas: on_elastic!(" (1 + 1.6 (1 - e) / e · d' / d'0), d: penetration, d'0: approach speed"),
                elsewhere: Some("Flores et al. (2011)"),
                damping: |ce| 8.0 * (1.0 - ce) / (5.0 * ce),
            },
            Self::Gonthier => Entry {
                law: "Normal force of Gonthier et al.",
                formulas: on_elastic!(
                    " (1 + χ d' / d'0), χ (1 + e) = ln((1 + χ) / (1 - e χ)), d: penetration, d'0: approach speed"
                ),
                elsewhere: Some("Gonthier et al. (2004)"),
                damping: exact_damping_factor,
            },
        }
    }

    /// The law as a tooltip shows it, on this elastic law.
    pub fn shown(self, elasticity: Elasticity) -> ShownLaw {
        let Entry { law, formulas: [on_spheres, on_line], elsewhere, .. } = self.entry();
        let formula = if matches!(elasticity, Elasticity::Line { .. }) { on_line } else { on_spheres };
        ShownLaw { law, formula, elsewhere }
    }

    /// Damping factor chi for the requested restitution; infinite for 0 in a law that divides by it.
    pub fn damping_factor(self, restitution: f64) -> f64 {
        (self.entry().damping)(restitution)
    }
}

impl FrictionLaw {
    /// The law as a tooltip shows it, and how its friction coefficient depends on the sliding speed.
    pub fn shown(self) -> [ShownLaw; 2] {
        let own = |law, formula| ShownLaw { law, formula, elsewhere: None };
        match self {
            Self::ModifiedCoulomb => [
                own("Coulomb friction with dynamic correction", "F = c_f c_d N against the sliding velocity v"),
                own("Dynamic correction of friction", "c_d = 0 up to v0, (v - v0) / (v1 - v0) up to v1, then 1"),
            ],
            Self::Bristle => [
                ShownLaw {
                    law: "Bristle friction",
                    formula: "F = -(k z + d v) up to μ N, z: deflection of the bristles, z' = v below that limit",
                    elsewhere: Some("Gonthier et al. (2004)"),
                },
                ShownLaw {
                    law: "Stribeck's fall of friction",
                    formula: "μ = μ_k + (μ_s - μ_k) exp(-(v / v_s)²), v: sliding speed",
                    elsewhere: Some("Stribeck (1902)"),
                },
            ],
            Self::None => [own("No friction", "F = 0"); 2],
        }
    }
}

/// Excess of chi (1 + ce) over ln((1 + chi) / (1 - ce chi)): from dv/ddelta of m v dv = -F(delta) (1 + chi v / v0) ddelta,
/// where F ddelta integrates to zero over a whole impact for any elastic law F and mass m.
fn impact_balance(chi: f64, ce: f64) -> f64 {
    chi * (1.0 + ce) - libm::log1p(chi) + libm::log1p(-ce * chi)
}

/// Where `balance`, positive above 0, becomes negative below `high`.
fn sign_change(mut high: f64, balance: impl Fn(f64) -> f64) -> f64 {
    let mut low = 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        *if balance(middle) > 0.0 { &mut low } else { &mut high } = middle;
    }
    0.5 * (low + high)
}

fn exact_damping_factor(ce: f64) -> f64 {
    if ce >= 1.0 {
        return 0.0;
    }
    // The balance is positive for small chi > 0 and falls to minus infinity at chi = 1 / ce.
    sign_change(1.0 / ce, |chi| impact_balance(chi, ce))
}

/// Restitution that an undisturbed impact actually gives with damping factor `chi`, from the closed integral of the law.
pub fn undisturbed_restitution(chi: f64) -> f64 {
    if chi <= 0.0 {
        return 1.0;
    }
    sign_change((1.0 / chi).min(1.0), |ce| impact_balance(chi, ce))
}

/// Coefficients of the force kernel, computed once from [`Parameters`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Force, slope and energy by penetration.
    pub elastic: ElasticLaw,
    /// Damping factor chi, of impacts in which nothing yields.
    pub damping: f64,
    /// Normal law and requested restitution, from which it is.
    pub(crate) law: (NormalLaw, f64),
    /// Approach speed above which the restitution falls, m/s; infinite if it does not.
    pub(crate) yield_speed: f64,
    /// Coefficient of the modified Coulomb law; 0 under another law.
    pub friction: f64,
    /// Bristles of the bristle law.
    pub bristles: Option<Bristles>,
    /// v_a, m/s.
    pub(crate) slip_low: f64,
    /// v_theta, m/s.
    pub slip_high: f64,
    /// Lower bound of the approach speed in the damping term, m/s.
    pub speed_floor: f64,
    /// Ball radius r, m.
    pub ball_radius: f64,
    /// Relative velocity used by friction.
    pub friction_velocity: FrictionVelocity,
    /// Current clearance c > 0, m.
    pub clearance: f64,
    /// Rate of the clearance while it ramps, m/s.
    pub(crate) clearance_rate: f64,
    /// Whether the damping term divides by the contact's largest rate so far instead of its rate at the start.
    pub(crate) uses_largest_rate: bool,
}

impl Coefficients {
    /// Coefficients of a joint whose current clearance is `clearance` > 0, m.
    pub fn new(parameters: &Parameters, clearance: f64) -> Self {
        Self {
            elastic: ElasticLaw::of_joint(parameters, clearance),
            damping: parameters.normal_law.damping_factor(parameters.restitution),
            law: (parameters.normal_law, parameters.restitution),
            yield_speed: if parameters.yield_speed > 0.0 { parameters.yield_speed } else { f64::INFINITY },
            friction: match parameters.friction_law {
                FrictionLaw::ModifiedCoulomb => parameters.friction,
                FrictionLaw::Bristle | FrictionLaw::None => 0.0,
            },
            bristles: Bristles::of(parameters),
            slip_low: parameters.slip_speed_low,
            slip_high: parameters.slip_speed_high,
            speed_floor: parameters.impact_speed_floor,
            ball_radius: parameters.ball_radius,
            friction_velocity: parameters.friction_velocity,
            clearance,
            clearance_rate: 0.0,
            uses_largest_rate: parameters.approach_speed == ApproachSpeed::Largest,
        }
    }

    /// Requested restitution of an impact at the approach speed `speed`, m/s. Above the yield speed it falls with the fourth root of it, as
    /// in fully plastic impacts: K. L. Johnson, Contact Mechanics (1985).
    pub fn restitution_at(&self, speed: f64) -> f64 {
        let (_, restitution) = self.law;
        if speed > self.yield_speed { restitution * (self.yield_speed / speed).sqrt().sqrt() } else { restitution }
    }

    /// Damping factor of an impact at this approach speed, m/s.
    pub fn damping_at(&self, speed: f64) -> f64 {
        if speed > self.yield_speed { self.law.0.damping_factor(self.restitution_at(speed)) } else { self.damping }
    }

    /// Speed over which the damping term of an impact at the approach speed `speed` has the damping factor of slow ones, m/s.
    #[cold]
    #[inline(never)]
    pub(super) fn yielding(&self, speed: f64) -> f64 {
        let damping = self.damping_at(speed);
        if damping > 0.0 { speed * self.damping / damping } else { speed }
    }

    /// Sets the current clearance of a ramp (m), its rate (m/s), and the corresponding elastic law.
    pub(crate) fn set_clearance(&mut self, parameters: &Parameters, clearance: f64, rate: f64) {
        self.elastic = ElasticLaw::of_joint(parameters, clearance);
        (self.clearance, self.clearance_rate) = (clearance, rate);
    }

    /// Normal force F_N >= 0, N (19), for penetration (m), its rate (m/s) and the approach speed delta_dot0 (m/s).
    #[inline]
    pub fn normal_force(&self, penetration: f64, rate: f64, approach_speed: f64) -> f64 {
        if penetration <= 0.0 {
            return 0.0;
        }
        (self.elastic.force(penetration) * (1.0 + self.damping * rate / approach_speed)).max(0.0)
    }

    /// F_T / F_N: Coulomb coefficient times the dynamic correction cd of (21), for a sliding speed in m/s.
    #[inline]
    pub(crate) fn friction_ratio(&self, slip_speed: f64) -> f64 {
        if slip_speed >= self.slip_high {
            self.friction
        } else if slip_speed <= self.slip_low {
            0.0
        } else {
            self.friction * (slip_speed - self.slip_low) / (self.slip_high - self.slip_low)
        }
    }

    /// Derivative of [`Self::friction_ratio`] with respect to the sliding speed, s/m.
    #[inline]
    pub(crate) fn friction_slope(&self, slip_speed: f64) -> f64 {
        if slip_speed <= self.slip_low || slip_speed >= self.slip_high {
            0.0
        } else {
            self.friction / (self.slip_high - self.slip_low)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rebound speed over approach speed of a unit mass, integrated with Runge-Kutta 4 in small steps.
    fn simulated_restitution(law: NormalLaw, ce: f64, elasticity: Elasticity) -> f64 {
        let parameters = Parameters { normal_law: law, restitution: ce, elasticity, ..Parameters::default() };
        let c = Coefficients::new(&parameters, 3e-4);
        let v0 = 0.1;
        let force = |x: f64, v: f64| -c.normal_force(x, v, v0);
        let (mut x, mut v, h) = (0.0, v0, 2e-9);
        loop {
            let (k1x, k1v) = (v, force(x, v));
            let (k2x, k2v) = (v + 0.5 * h * k1v, force(x + 0.5 * h * k1x, v + 0.5 * h * k1v));
            let (k3x, k3v) = (v + 0.5 * h * k2v, force(x + 0.5 * h * k2x, v + 0.5 * h * k2v));
            let (k4x, k4v) = (v + h * k3v, force(x + h * k3x, v + h * k3v));
            x += h / 6.0 * (k1x + 2.0 * k2x + 2.0 * k3x + k4x);
            v += h / 6.0 * (k1v + 2.0 * k2v + 2.0 * k3v + k4v);
            if x <= 0.0 || v < -0.999_999 * v0 * 1.001 {
                return -v / v0;
            }
        }
    }

    #[test]
    fn the_closed_integral_agrees_with_a_simulated_impact() {
        for elasticity in [Elasticity::Sphere, Elasticity::Line { length: 0.024 }] {
            for law in NormalLaw::ALL {
                for ce in [0.3, 0.6, 0.9] {
                    let chi = law.damping_factor(ce);
                    let expected = undisturbed_restitution(chi);
                    let got = simulated_restitution(law, ce, elasticity);
                    assert!((got - expected).abs() < 2e-5, "{elasticity:?} {law:?} ce {ce}: {got} against {expected}");
                }
            }
        }
    }

    #[test]
    fn the_law_of_gonthier_gives_the_requested_restitution() {
        for ce in [0.05, 0.2, 0.5, 0.8, 0.99] {
            let given = undisturbed_restitution(NormalLaw::Gonthier.damping_factor(ce));
            assert!((given - ce).abs() < 1e-9, "{ce}: {given}");
        }
    }

    #[test]
    fn the_law_of_lankarani_and_nikravesh_rebounds_with_two_thirds_if_zero_is_requested() {
        let given = undisturbed_restitution(NormalLaw::LankaraniNikravesh.damping_factor(0.0));
        assert!((given - 0.66).abs() < 5e-3, "{given}");
    }

    #[test]
    fn friction_rises_between_its_two_speeds_and_is_full_above() {
        let c = Coefficients::new(&Parameters::default(), 3e-4);
        assert_eq!(c.friction_ratio(1e-6), 0.0);
        assert_eq!(c.friction_ratio(1e-3), 0.15);
        let half = c.friction_ratio(0.5 * (1e-6 + 1e-4));
        assert!((half - 0.075).abs() < 1e-12);
    }

    #[test]
    fn the_normal_force_is_never_negative() {
        let c = Coefficients::new(&Parameters { restitution: 0.0, ..Parameters::default() }, 3e-4);
        assert_eq!(c.normal_force(1e-6, -1.0, 1e-3), 0.0);
        assert_eq!(c.normal_force(-1e-6, 1.0, 1e-3), 0.0);
    }
}
