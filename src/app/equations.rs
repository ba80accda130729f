//! Place of a parameter in the equations, for its tooltip: name of the law, formula, and the paper's equation number or, for a
//! law not used in the paper, its publication.

use crate::contact::{FrictionLaw, NormalLaw, Parameters};
use crate::scene::Scene;

const HERTZ: &str = "K = 4 / (3 (s + s)) · √(R r / (R - r)), s = (1 - ν²) / E, R = r + c";
const COULOMB: &str = "F = c_f c_d N against the sliding velocity v";
const CORRECTION: &str = "c_d = 0 up to v0, (v - v0) / (v1 - v0) up to v1, then 1";

/// The paper.
const PAPER: &str = "Sheng & Chen (2024)";

/// A law as shown in a tooltip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShownLaw {
    /// Name of the law.
    pub law: &'static str,
    /// Its formula.
    pub formula: &'static str,
    /// Publication, if other than the paper.
    pub elsewhere: Option<&'static str>,
}

impl ShownLaw {
    const fn new(law: &'static str, formula: &'static str) -> Self {
        Self { law, formula, elsewhere: None }
    }
}

/// The law of `scene` that uses the parameter `key`; `None` unless it is a contact parameter.
pub fn law(key: &str, scene: &Scene) -> Option<ShownLaw> {
    let (group, last) = key.rsplit_once('.')?;
    let contact = match group.strip_prefix("joint.") {
        Some(name) => &scene.machine.ball_joints.iter().find(|joint| joint.name == name)?.contact,
        None if group == "contact" => &scene.machine.contact,
        None => return None,
    };
    law_of(last, contact)
}

/// The same for the last part of its key.
fn law_of(last: &str, contact: &Parameters) -> Option<ShownLaw> {
    let is_frictionless = contact.friction_law == FrictionLaw::None;
    Some(match last {
        "clearance" | "ball_radius" | "youngs_modulus" | "poisson_ratio" => {
            ShownLaw::new("Stiffness of the contact", HERTZ)
        }
        "friction" | "friction_law" | "slip_speed_low" | "slip_speed_high" if is_frictionless => {
            ShownLaw::new("No friction", "F = 0")
        }
        "friction" | "friction_law" => ShownLaw::new("Coulomb friction with dynamic correction", COULOMB),
        "slip_speed_low" | "slip_speed_high" => ShownLaw::new("Dynamic correction of friction", CORRECTION),
        "restitution" | "normal_law" => normal_force_law(contact.normal_law),
        _ => return None,
    })
}

/// The damping factors match `contact::damping_factor`.
fn normal_force_law(law: NormalLaw) -> ShownLaw {
    let (law, formula, elsewhere) = match law {
        NormalLaw::LankaraniNikravesh => (
            "Lankarani–Nikravesh normal force",
            "N = K d^1.5 (1 + ¾ (1 - e²) d' / d'0), d: penetration, d'0: approach speed",
            None,
        ),
        NormalLaw::Hertz => {
            ("Hertz normal force, without damping", "N = K d^1.5, d: penetration", Some("Hertz (1882)"))
        }
        NormalLaw::HuntCrossley => (
            "Hunt–Crossley normal force",
            "N = K d^1.5 (1 + 1.5 (1 - e) d' / d'0), d: penetration, d'0: approach speed",
            Some("Hunt & Crossley (1975)"),
        ),
        NormalLaw::Flores => (
            "Normal force of Flores et al.",
            "N = K d^1.5 (1 + 1.6 (1 - e) / e · d' / d'0), d: penetration, d'0: approach speed",
            Some("Flores et al. (2011)"),
        ),
        NormalLaw::Gonthier => (
            "Normal force of Gonthier et al.",
            "N = K d^1.5 (1 + χ d' / d'0), χ (1 + e) = ln((1 + χ) / (1 - e χ)), d: penetration, d'0: approach speed",
            Some("Gonthier et al. (2004)"),
        ),
    };
    ShownLaw { law, formula, elsewhere }
}

/// The source of a parameter, `Paper eqs. (9), (10)`, with the paper's name: `Sheng & Chen (2024), eqs. 9, 10`.
pub fn source(equation: &str) -> String {
    let named = equation.replace("Paper eq", &format!("{PAPER}, eq")).replace("paper eq", &format!("{PAPER}, eq"));
    let mut out = String::with_capacity(named.len());
    let mut rest = named.as_str();
    while let Some(at) = rest.find('(') {
        let (before, from) = rest.split_at(at);
        out.push_str(before);
        let number = from[1..].find(')').map(|end| &from[1..=end]);
        match number.filter(|number| number.len() < 3 && number.bytes().all(|byte| byte.is_ascii_digit())) {
            Some(number) => {
                out.push_str(number);
                rest = &from[number.len() + 2..];
            }
            None => {
                out.push('(');
                rest = &from[1..];
            }
        }
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::damping_factor;
    use crate::scene::{Quantity, evaluate};
    use crate::units::Dimension;

    #[test]
    fn equations_are_named_by_their_paper() {
        assert_eq!(source("Paper eq. (19)"), "Sheng & Chen (2024), eq. 19");
        assert_eq!(source("Paper eqs. (9), (12), (19)"), "Sheng & Chen (2024), eqs. 9, 12, 19");
        assert_eq!(source("Solves paper eqs. (55), (58) in time"), "Solves Sheng & Chen (2024), eqs. 55, 58 in time");
        assert_eq!(
            source("Paper eqs. (37) to (39), in x - (a1 + L1)"),
            "Sheng & Chen (2024), eqs. 37 to 39, in x - (a1 + L1)"
        );
        assert_eq!(source("No equation: display only"), "No equation: display only");
    }

    #[test]
    fn a_parameter_shows_the_law_of_its_own_joint() {
        let changes = [("contact.friction_law", "none"), ("joint.S2.normal_law", "hertz")];
        let changes = changes.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let scene = Scene::load("spcmm", &changes).expect("built in");
        assert_eq!(law("joint.S1.restitution", &scene), law("contact.restitution", &scene));
        assert_eq!(law("joint.S2.restitution", &scene), Some(normal_force_law(NormalLaw::Hertz)));
        assert_eq!(law("contact.friction", &scene).expect("stated").formula, "F = 0");
        assert_eq!(law("spcmm.frequency", &scene), None);
    }

    #[test]
    fn the_displayed_normal_force_is_that_of_the_active_law() {
        let ce = 0.7;
        for normal_law in NormalLaw::ALL {
            let contact = Parameters { normal_law, ..Parameters::default() };
            let stated = law_of("restitution", &contact).expect("stated");
            let chi = damping_factor(normal_law, ce);
            let factor = stated.formula.split_once("(1 + ").and_then(|(_, rest)| rest.split_once("d' / d'0"));
            let Some((factor, _)) = factor else {
                assert_eq!(chi, 0.0, "{stated:?}");
                continue;
            };
            if factor.trim() == "χ" {
                let condition = chi * (1.0 + ce) - ((1.0 + chi) / (1.0 - ce * chi)).ln();
                assert!(condition.abs() < 1e-12 && stated.formula.contains("χ (1 + e) = ln((1 + χ) / (1 - e χ))"));
                continue;
            }
            // Rewritten in the expression syntax of scene files.
            let text = factor.trim().trim_end_matches('·').replace('¾', "0.75").replace("e²", "e^2");
            let text = text.replace(" (", " * (");
            let value = evaluate(&text, &[("e", Quantity::new(ce, Dimension::None))]).expect("arithmetic").value();
            assert!((value - chi).abs() < 1e-12, "{stated:?}: {text} = {value}, not {chi}");
        }
    }
}
