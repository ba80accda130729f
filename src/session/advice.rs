//! Warnings about settings that are valid but may surprise, in the words of the window, each with the change that removes it.

use crate::analysis::presets::too_slow;
use crate::machine::{Brief, Doubt, Warning};
use crate::scene::Scene;
use crate::session::value;
use crate::units::format_quantity_digits;

/// A warning about a setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Key of the parameter, without its section where joints with play may override it; `None` if it concerns no parameter.
    key: Option<&'static str>,
    /// The sentence of files and the command line.
    pub text: String,
    /// A few words that fit beside a control.
    pub brief: String,
    /// The same as `text` in plain words.
    pub words: String,
    /// What removes it, if one change does.
    pub remedy: Option<Remedy>,
}

/// A change of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Remedy {
    /// What the button says.
    pub label: String,
    /// Key of the parameter, as that of [`Advice`].
    key: &'static str,
    /// The value, as a user writes it.
    pub value: String,
}

impl Remedy {
    /// The full key of the parameter to change for the control of `control`: of the same joint, or of all.
    pub fn key_for(&self, control: &str) -> String {
        match control.rsplit_once('.') {
            Some((section, _)) if !self.key.contains('.') => format!("{section}.{}", self.key),
            _ => self.key.to_owned(),
        }
    }
}

impl Advice {
    /// Whether it is about the value of `key`.
    pub fn concerns(&self, key: &str) -> bool {
        let last = key.strip_prefix("contact.").or_else(|| key.strip_prefix("joint.")?.rsplit('.').next());
        // A pin's clearance is its radial play.
        let last = last.map(|last| if last == "radial" { "clearance" } else { last });
        self.key.is_some_and(|own| own == last.unwrap_or(key))
    }

    fn new(warning: &Warning) -> Self {
        let text = warning.to_string();
        let remedy = |label: String, key, value: String| Some(Remedy { label, key, value });
        let (brief, words, remedy) = match warning {
            Warning::Doubt(Doubt::Restitution { joints, law, requested, achieved, yielding }) => {
                let [requested, gives] = [*requested, *achieved].map(|value| value::number(value, 2));
                let at = yielding.map(|speed| format!(" at {}", format_quantity_digits(speed, "mm/s", 3)));
                let words = format!(
                    "{joints}: {requested} is asked for{}, but the contact law {} gives {gives} in an undisturbed impact.",
                    at.unwrap_or_default(),
                    law.word()
                );
                let other = "Use the contact law gonthier".to_owned();
                let remedy = if requested == "0" { None } else { remedy(other, "normal_law", "gonthier".to_owned()) };
                (format!("gives {gives}"), words, remedy)
            }
            Warning::Doubt(Doubt::Clearance { .. }) => ("very small".to_owned(), text.clone(), None),
            Warning::Doubt(Doubt::ShortPin { .. }) => ("very large".to_owned(), text.clone(), None),
            Warning::Doubt(Doubt::Lubricant { .. }) => ("small for its film".to_owned(), text.clone(), None),
            Warning::Doubt(Doubt::Step { joint, step, duration, brief, recommended }) => {
                let time = |seconds: f64| format_quantity_digits(seconds, "us", 3);
                let what = match brief {
                    Brief::Impact => "an impact is over",
                    Brief::Sliding => "friction reverses the sliding",
                    Brief::Bristles => "the bristles follow the sliding",
                };
                let words = format!(
                    "{joint}: {what} in about {}, which a step of {} does not resolve.",
                    time(*duration),
                    time(*step)
                );
                let value = format_quantity_digits(*recommended, "us", 6);
                ("too long".to_owned(), words, remedy(format!("Use {}", value::typeset(&value)), "solver.step", value))
            }
            Warning::Doubt(Doubt::Tolerance { loosest, .. }) => {
                let value = format!("{loosest:e}");
                let words = "Impacts may gain or lose much of their energy at this tolerance.".to_owned();
                ("too loose".to_owned(), words, remedy(format!("Use {value}"), "solver.tolerance", value))
            }
            Warning::StiffFriction { joints, slip_speed_high } => {
                let speed = format_quantity_digits(*slip_speed_high, "mm/s", 3);
                let words =
                    format!("{joints}: full friction from {speed} on makes the run slow: it needs small steps.");
                ("slow".to_owned(), words, None)
            }
            Warning::Doubt(Doubt::MoreJoints | Doubt::Overshoot { .. }) | Warning::MeshUnit { .. } => {
                (String::new(), text.clone(), None)
            }
        };
        Self { key: warning.key(), text, brief, words: value::typeset(&words), remedy }
    }
}

/// The warnings about the settings of `scene`.
pub fn of(scene: &Scene) -> Vec<Advice> {
    let slow = too_slow(scene).map(|slow| Advice {
        key: Some("solver.preset"),
        text: slow.to_string(),
        brief: "slow".to_owned(),
        words: format!(
            "This preset does not keep up with real time here: with its default values the scene ran at {:.2} times real time \
             on one core of {}.",
            slow.pace, slow.machine
        ),
        remedy: Some(Remedy {
            label: "Use preview, which is faster".to_owned(),
            key: "solver.preset",
            value: "preview".to_owned(),
        }),
    });
    scene.machine.warnings().iter().map(Advice::new).chain(slow).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(changes: &[(&str, &str)]) -> Scene {
        let changes: Vec<(String, String)> =
            changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Scene::load("spcmm", &changes).expect("valid")
    }

    /// The offered change, carried out on a control, leaves no warning about that control.
    #[test]
    fn a_remedy_removes_its_warning() {
        for (key, value) in [
            ("contact.restitution", "0.3"),
            ("joint.S2.restitution", "0.3"),
            ("contact.yield_speed", "1 mm/s"),
            ("solver.tolerance", "0.01"),
        ] {
            let scene = changed(&[(key, value)]);
            let advice = of(&scene);
            let own = advice.iter().find(|advice| advice.concerns(key)).expect("a warning");
            assert!(!own.words.contains(" = ") && !own.words.contains("normal_law"), "{}", own.words);
            let remedy = own.remedy.as_ref().expect("a remedy");
            let mended = changed(&[(key, value), (&remedy.key_for(key), &remedy.value)]);
            assert!(!of(&mended).iter().any(|advice| advice.concerns(key)), "{:?}", of(&mended));
        }
        let bristles = [("contact.friction_law", "bristle"), ("contact.bristle_damping", "50 N s/m")];
        for (own, step) in [(&[][..], "1 ms"), (&bristles, "2 us")] {
            let by = |step: &str| changed(&[&[("solver.method", "rk4"), ("solver.step", step)], own].concat());
            let advice = of(&by(step));
            let step = advice.iter().find(|advice| advice.concerns("solver.step")).expect("too long");
            let remedy = step.remedy.as_ref().expect("a remedy");
            assert!(!of(&by(&remedy.value)).iter().any(|advice| advice.concerns("solver.step")));
        }
    }
}
