//! Finds the key responsible for an inconsistent scene.

use super::error::{line_text, place_of};
use super::*;
use jointplay_physics::machine::ContactConflict;
use jointplay_physics::mechanism::{CostlyTask, MechanismError};
use jointplay_physics::simulate::StartError;

impl Scene {
    /// Explains why the machine cannot start, with the relevant line of the file and change.
    pub fn locate(&self, error: &StartError) -> SceneError {
        let own = self.source.own.iter();
        let counts = own.clone().filter(|own| matches!(own.kind, Kind::Count { .. }));
        let joint_keys = |joint: &str, parts: &[&str]| {
            let mut keys = ["parameter.", "formulation", "start"].map(str::to_owned).to_vec();
            keys.extend(own.clone().map(|own| own.key.to_owned()));
            for part in parts {
                keys.push(format!("contact.{part}"));
                keys.push(format!("joint.{joint}.{part}"));
            }
            (format!("joint.{joint}"), keys)
        };
        let (title, keys) = match &error.0 {
            MechanismError::Unreachable(_) | MechanismError::OffPath { .. } | MechanismError::Singular => {
                ("closed_form".to_owned(), own.map(|own| own.key.to_owned()).collect())
            }
            MechanismError::Open { given: gap }
            | MechanismError::NoClosure { given: gap, .. }
            | MechanismError::InconsistentDrives { rate: gap } => joint_keys(&gap.joint, &["clearance"]),
            MechanismError::OutsideSocket { joint, .. } => joint_keys(joint, &["clearance", "ball_radius"]),
            MechanismError::TooLarge { .. } | MechanismError::TooCostly { .. } => {
                let concerns_formulation =
                    matches!(error.0, MechanismError::TooCostly { of: CostlyTask::Formulation(_), .. });
                let title = if concerns_formulation { "formulation" } else { "solver.method" };
                let keys = ["solver.method", "formulation"].into_iter().chain(counts.map(|own| own.key));
                (title.to_owned(), keys.map(str::to_owned).collect())
            }
            MechanismError::NeedsMass { .. } => ("formulation".to_owned(), vec!["formulation".to_owned()]),
            MechanismError::Undetermined { joint } => joint_keys(joint, &[]),
            MechanismError::NoRest { .. } => ("start".to_owned(), vec!["start".to_owned()]),
            MechanismError::TooLargeForRest { .. } => {
                let keys = std::iter::once("start").chain(counts.map(|own| own.key));
                ("start".to_owned(), keys.map(str::to_owned).collect())
            }
            // The reader builds only consistent machines.
            MechanismError::Machine(_) => ("body".to_owned(), Vec::new()),
            MechanismError::Branching { joints } => {
                joint_keys(joints.first().map_or("", String::as_str), &["clearance"])
            }
        };
        self.start_error(&title, &keys, error.to_string())
    }

    /// An error at start about `title` (see [`Source::places`]). It points to that line of the file and names the latest change
    /// of one of `keys`; an entry that ends in a dot is a prefix.
    pub(super) fn start_error(&self, title: &str, keys: &[String], message: String) -> SceneError {
        let concerns =
            |changed: &str| keys.iter().any(|key| changed == key || (key.ends_with('.') && changed.starts_with(key)));
        let change = self.changes.iter().rfind(|(changed, _)| concerns(changed));
        let at = self.source.places.get(title);
        let place = at.map(|&at| place_of(&self.source.text, at));
        let mut error = match change {
            Some((key, value)) => SceneError::about(key, Some(value), message),
            None => SceneError::about(title, None, message),
        };
        error.file.clone_from(&self.source.file);
        // A built-in scene has no file to edit, so a change that explains the error is enough.
        if self.source.file.is_some() || change.is_none() {
            error.position = place;
            error.line_text = place.and_then(|(line, _)| line_text(&self.source.text, line));
        }
        error
    }
}

impl Scene {
    /// Keys that could be at fault, most likely first.
    pub(super) fn keys_of(&self, conflict: &ContactConflict) -> Vec<String> {
        let key = |part: &'static str| match conflict.joint {
            _ if part == "start" => part.to_owned(),
            Some(joint) => {
                let kind = &self.machine.loose_joints[joint].kind;
                // A play or a radius may be that of the scene; so may both plays of a block.
                let of_contact = play::contact_part(kind, part);
                let is_own = self.overrides[joint].contains(&of_contact);
                match of_contact {
                    _ if is_own => self.joint_key(joint, of_contact),
                    "second_clearance" => "contact.clearance".to_owned(),
                    _ if of_contact.starts_with("play") => self.joint_key(joint, part),
                    _ => format!("contact.{of_contact}"),
                }
            }
            None => format!("contact.{part}"),
        };
        let mut keys: Vec<String> = conflict.fault.parts().into_iter().map(key).collect();
        // A joint's override is more likely at fault than the shared setting.
        keys.sort_by_key(|key| !key.starts_with("joint."));
        keys
    }

    pub(super) fn conflict_text(&self, conflict: &ContactConflict, key: &str) -> String {
        match conflict.joint.map(|index| &self.machine.loose_joints[index].name) {
            Some(name) if !key.starts_with("joint.") => {
                format!("{} (in joint {name})", conflict.fault)
            }
            _ => conflict.fault.to_string(),
        }
    }

    /// The error for the change of `key` that introduced the conflict.
    pub(super) fn blame_change(&self, conflict: &ContactConflict, key: &str) -> SceneError {
        let value = self.changes.iter().rfind(|(changed, _)| changed == key).map(|(_, value)| value.as_str());
        SceneError::about(key, value, self.conflict_text(conflict, key))
    }

    /// The error for the latest change related to the conflict; `None` if the file alone causes it.
    pub(super) fn blame_changes(&self, conflict: &ContactConflict) -> Option<SceneError> {
        let keys = self.keys_of(conflict);
        let (key, _) = self.changes.iter().rfind(|(changed, _)| keys.contains(changed))?;
        Some(self.blame_change(conflict, key))
    }
}

#[cfg(test)]
mod tests {
    use super::super::built_in_text;
    use super::*;
    use jointplay_physics::simulate::{Frame, Simulation};

    fn start_error(text: &str, changes: &[(&str, &str)]) -> SceneError {
        let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let changes: Vec<(String, String)> = changes.iter().map(own).collect();
        let scene = Scene::parse(text, Some("mine.toml"), &changes).expect("reads");
        let error = Simulation::new(&scene.machine).expect_err("cannot start");
        scene.locate(&error)
    }

    #[test]
    fn a_start_error_points_to_its_line_and_names_the_change() {
        let text = built_in_text("spcmm").expect("built in");
        let line_of = |text: &str, what: &str| {
            let at = text.lines().position(|line| line == what);
            at.map(|at| at as u32 + 1)
        };
        let far = text.replace("value = \"25 mm\"", "value = \"200 mm\"");
        let error = start_error(&far, &[]);
        assert_eq!(error.position.map(|p| p.0), line_of(text, "[closed_form]"));
        assert_eq!(error.line_text.as_deref(), Some("[closed_form]"));
        let error = start_error(text, &[("spcmm.amplitude_x", "200 mm")]);
        assert_eq!(error.key.as_deref(), Some("spcmm.amplitude_x"));
        assert!(error.to_string().starts_with("mine.toml:"), "{error}");

        let text = built_in_text("slider-crank").expect("built in");
        let open = text.replace("at = \"0 0 80 mm\"", "at = \"0 0 380 mm\"");
        let error = start_error(&open, &[]);
        assert_eq!(error.position.map(|p| p.0), line_of(text, "[[ball_joint]]"));
        assert!(error.to_string().contains("ball joint B"), "{error}");
    }

    #[test]
    fn values_as_given_are_not_turned_to_the_closed_form() {
        let text = built_in_text("spcmm").expect("built in");
        let given = text
            .replace("start = \"ideal\"", "start = \"as-given\"")
            .replace("0.4106585548949 rad", "0.4111585548949 rad");
        let scene = Scene::parse(&given, None, &[]).expect("reads");
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut frame = Frame::default();
        simulation.sample(0.0, &mut frame);
        let eccentricities = frame.joints.iter().map(|joint| joint.eccentricity.norm());
        let largest = eccentricities.fold(0.0, f64::max);
        // Half a milliradian at the end of a rod of 200 mm.
        assert!((largest / 0.1e-3 - 1.0).abs() < 0.01, "{largest}");
    }
}
