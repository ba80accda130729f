//! Place of a parameter in the equations, for its tooltip: name of the law, formula, and the paper's equation number or, for a
//! law not used in the paper, its publication. The formulas are those of the laws themselves (`contact`).

use crate::contact::{ElasticLaw, FrictionLaw, Parameters, ShownLaw};
use crate::scene::Scene;

/// The law of `scene` that uses the parameter `key`; `None` unless it is a contact parameter that the laws in force use. Without friction
/// that law stands for every parameter of friction.
pub fn law(key: &str, scene: &Scene) -> Option<ShownLaw> {
    let (group, last) = key.rsplit_once('.')?;
    let contact = match group.strip_prefix("joint.") {
        Some(name) => &scene.machine.loose_joints.iter().find(|joint| joint.name == name)?.contact,
        None if group == "contact" => &scene.machine.contact,
        None => return None,
    };
    law_of(last, contact)
}

/// The same for the last part of its key.
fn law_of(last: &str, contact: &Parameters) -> Option<ShownLaw> {
    let [friction, correction] = contact.friction_law.shown();
    let of =
        |law: FrictionLaw, shown: ShownLaw| [law, FrictionLaw::None].contains(&contact.friction_law).then_some(shown);
    Some(match last {
        "clearance" | "ball_radius" | "youngs_modulus" | "poisson_ratio" => ElasticLaw::shown(contact.elasticity),
        "friction" | "friction_law" => friction,
        "slip_speed_low" | "slip_speed_high" => return of(FrictionLaw::ModifiedCoulomb, correction),
        "static_friction_ratio" | "stribeck_speed" => return of(FrictionLaw::Bristle, correction),
        "bristle_stiffness" | "bristle_damping" => return of(FrictionLaw::Bristle, friction),
        "restitution" | "yield_speed" | "normal_law" => contact.normal_law.shown(contact.elasticity),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Elasticity, NormalLaw};
    use crate::scene::{Quantity, evaluate};
    use crate::units::Dimension;

    #[test]
    fn a_parameter_shows_the_law_of_its_own_joint() {
        let changes = [("contact.friction_law", "none"), ("joint.S2.normal_law", "hertz")];
        let changes = changes.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let scene = Scene::load("spcmm", &changes).expect("built in");
        assert_eq!(law("joint.S1.restitution", &scene), law("contact.restitution", &scene));
        assert_eq!(law("joint.S2.restitution", &scene), Some(NormalLaw::Hertz.shown(Elasticity::Sphere)));
        assert_eq!(law("contact.friction", &scene).expect("stated").formula, "F = 0");
        assert_eq!(law("spcmm.frequency", &scene), None);
    }

    #[test]
    fn a_parameter_of_friction_shows_the_law_in_force_if_that_uses_it() {
        let own = |key: &str, friction_law| law_of(key, &Parameters { friction_law, ..Parameters::default() });
        let [bristle, coulomb, none] = [FrictionLaw::Bristle, FrictionLaw::ModifiedCoulomb, FrictionLaw::None];
        for (key, user, symbol) in [
            ("slip_speed_low", coulomb, "v0"),
            ("slip_speed_high", coulomb, "v1"),
            ("static_friction_ratio", bristle, "μ_s"),
            ("stribeck_speed", bristle, "v_s"),
            ("bristle_stiffness", bristle, "k z"),
            ("bristle_damping", bristle, "d v"),
        ] {
            assert!(own(key, user).is_some_and(|shown| shown.formula.contains(symbol)), "{key}");
            let other = if user == bristle { coulomb } else { bristle };
            assert_eq!(own(key, other), None, "{key}");
            assert_eq!(own(key, none).map(|shown| shown.formula), Some("F = 0"), "{key}");
        }
    }

    #[test]
    fn the_displayed_normal_force_is_that_of_the_active_law() {
        let ce = 0.7;
        let laws = [Elasticity::Sphere, Elasticity::Line { length: 0.02 }]
            .into_iter()
            .flat_map(|elasticity| NormalLaw::ALL.into_iter().map(move |normal_law| (elasticity, normal_law)));
        for (elasticity, normal_law) in laws {
            let contact = Parameters { normal_law, elasticity, ..Parameters::default() };
            let stated = law_of("restitution", &contact).expect("stated");
            let on_spheres = elasticity == Elasticity::Sphere;
            assert!(stated.formula.starts_with(if on_spheres { "N = K d^1.5" } else { "N = F" }), "{stated:?}");
            let chi = normal_law.damping_factor(ce);
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
