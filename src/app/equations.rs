//! Place of a parameter in the equations, for its tooltip: name of the law, formula, and the paper's equation number or, for a
//! law not used in the paper, its publication. The formulas are those of the laws themselves (`contact`).

use crate::contact::{ElasticLaw, FrictionLaw, NormalLaw, Parameters, ShownLaw};
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

/// What leaves the contact parameter `key` without effect: no joint with play that takes its value has a law that uses it.
pub fn without_effect(key: &str, scene: &Scene) -> Option<&'static str> {
    let (group, last) = key.rsplit_once('.')?;
    let name = group.strip_prefix("joint.");
    if name.is_none() && group != "contact" {
        return None;
    }
    let joints = scene.machine.loose_joints.iter().filter(|joint| name.is_none_or(|name| joint.name == name));
    let mut reasons = joints.map(|joint| unused_by(last, &joint.contact));
    let first = reasons.next()??;
    reasons.all(|reason| reason.is_some()).then_some(first)
}

/// What leaves the last part of a key without effect under the laws of `contact`.
fn unused_by(last: &str, contact: &Parameters) -> Option<&'static str> {
    let law = contact.friction_law;
    let bristle = ["static_friction_ratio", "stribeck_speed", "bristle_stiffness", "bristle_damping"];
    let of_sliding = ["friction_velocity", "slip_speed_low", "slip_speed_high"];
    let is_frictionless = law == FrictionLaw::ModifiedCoulomb && contact.friction == 0.0;
    let of_damping = ["restitution", "impact_speed_floor"];
    let reasons = [
        (law == FrictionLaw::None, &["friction", "friction_velocity"][..], "the friction law is none"),
        (law != FrictionLaw::ModifiedCoulomb, &of_sliding[1..], "only the friction law modified-coulomb uses it"),
        (law != FrictionLaw::Bristle, &bristle, "only the friction law bristle uses it"),
        (is_frictionless, &of_sliding, "the friction coefficient is 0"),
        (contact.static_friction_ratio == 1.0, &["stribeck_speed"], "the static friction ratio is 1"),
        (contact.normal_law == NormalLaw::Hertz, &of_damping, "the normal law hertz loses no energy"),
        (contact.wear_coefficient == 0.0, &["wear_shape"], "the wear coefficient is 0"),
    ];
    reasons.into_iter().find(|(holds, keys, _)| *holds && keys.contains(&last)).map(|(_, _, reason)| reason)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Elasticity;
    use crate::scene::{Quantity, evaluate};
    use crate::simulate::Simulation;
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
    fn a_parameter_without_effect_changes_no_bit_of_the_motion() {
        let [law, ratio] = ["contact.friction_law", "contact.static_friction_ratio"];
        let settings = [
            &[(law, "modified-coulomb")][..],
            &[(law, "modified-coulomb"), ("contact.friction", "0")],
            &[(law, "bristle")],
            &[(law, "bristle"), (ratio, "1.5")],
            &[(law, "none")],
            &[("contact.normal_law", "hertz")],
        ];
        let end = |changes: &[(&str, &str)]| {
            let changes: Vec<_> = changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
            let scene = Scene::load("pendulum", &changes).expect("built in");
            let mut simulation = Simulation::new(&scene.machine).expect("starts");
            simulation.advance_to(0.05).expect("runs");
            let bits: Vec<u64> = simulation.state_vector().iter().map(|x| x.to_bits()).collect();
            (bits, scene)
        };
        for set in settings {
            let (before, scene) = end(set);
            for (key, value) in [
                ("contact.friction", "0.3"),
                ("contact.friction_velocity", "centres"),
                ("contact.slip_speed_low", "0.03 mm/s"),
                ("contact.slip_speed_high", "30 mm/s"),
                ("contact.static_friction_ratio", "2"),
                ("contact.stribeck_speed", "20 mm/s"),
                ("contact.bristle_stiffness", "2000 N/mm"),
                ("contact.bristle_damping", "100 N s/m"),
                ("contact.restitution", "0.5"),
                ("contact.impact_speed_floor", "500 mm/s"),
            ] {
                let is_unused = without_effect(key, &scene).is_some();
                assert_eq!(end(&[set, &[(key, value)]].concat()).0 == before, is_unused, "{key} under {set:?}");
            }
        }
    }

    #[test]
    fn a_value_that_one_joint_uses_has_an_effect() {
        let changes = [("joint.S2.friction_law".to_owned(), "bristle".to_owned())];
        let scene = Scene::load("spcmm", &changes).expect("built in");
        for (key, is_unused) in [
            ("contact.bristle_stiffness", false),
            ("joint.S1.bristle_stiffness", true),
            ("joint.S2.bristle_stiffness", false),
            ("contact.slip_speed_low", false),
            ("joint.S2.slip_speed_low", true),
            ("contact.wear_shape", true),
            ("contact.clearance", false),
            ("spcmm.frequency", false),
        ] {
            assert_eq!(without_effect(key, &scene).is_some(), is_unused, "{key}");
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
