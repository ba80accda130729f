//! Where a parameter enters the equations, as its tooltip says it: the law by name, its formula, and the paper's number.

/// Law and formula by the last part of a parameter's key.
const FORMULAS: [(&str, &str, &str); 9] = [
    ("clearance", "Stiffness of the contact", HERTZ),
    ("ball_radius", "Stiffness of the contact", HERTZ),
    ("youngs_modulus", "Stiffness of the contact", HERTZ),
    ("poisson_ratio", "Stiffness of the contact", HERTZ),
    ("friction", "Coulomb friction with dynamic correction", COULOMB),
    ("slip_speed_low", "Dynamic correction of friction", CORRECTION),
    ("slip_speed_high", "Dynamic correction of friction", CORRECTION),
    ("restitution", "Normal force of Lankarani and Nikravesh", NORMAL),
    ("normal_law", "Normal force of Lankarani and Nikravesh", NORMAL),
];

const HERTZ: &str = "K = 4 / (3 (s + s)) · √(R r / (R - r)), s = (1 - ν²) / E, R = r + c";
const COULOMB: &str = "F = c_f c_d N against the sliding velocity v";
const CORRECTION: &str = "c_d = 0 up to v0, (v - v0) / (v1 - v0) up to v1, then 1";
const NORMAL: &str = "N = K d^1.5 (1 + ¾ (1 - e²) d' / d'0), d: penetration, d'0: approach speed";

/// The paper.
const PAPER: &str = "Sheng & Chen (2024)";

/// Name and formula of the law that the parameter `key` enters, where it is one of the contact's.
pub fn formula(key: &str) -> Option<(&'static str, &'static str)> {
    let (group, last) = key.rsplit_once('.')?;
    if group != "contact" && !group.starts_with("joint.") {
        return None;
    }
    FORMULAS.iter().find(|(own, ..)| *own == last).map(|(_, law, formula)| (*law, *formula))
}

/// The row of a parameter, `Paper eqs. (9), (10)`, with the paper named: `Sheng & Chen (2024), eqs. 9, 10`.
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
    fn a_joint_s_own_parameter_has_the_formula_of_the_scene_s() {
        assert_eq!(formula("joint.S1.friction"), formula("contact.friction"));
        assert!(formula("contact.restitution").is_some_and(|(law, _)| law.contains("Lankarani")));
        assert_eq!(formula("spcmm.frequency"), None);
    }
}
