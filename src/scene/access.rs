//! Parameters of a scene by key: reading, changing, and what must hold between them.

use super::error::nearest;
use super::table::{self, contact_part, find};
use super::*;
use crate::contact::{self, FrictionLaw, FrictionVelocity, NormalLaw};
use crate::integrate::Method;

const VELOCITIES: [FrictionVelocity; 2] = [FrictionVelocity::Centres, FrictionVelocity::Surface];
const NORMALS: [NormalLaw; 5] = [
    NormalLaw::LankaraniNikravesh,
    NormalLaw::Hertz,
    NormalLaw::HuntCrossley,
    NormalLaw::Flores,
    NormalLaw::Gonthier,
];
const FRICTIONS: [FrictionLaw; 2] = [FrictionLaw::ModifiedCoulomb, FrictionLaw::None];
const FORMS: [Formulation; 2] = [Formulation::Tree, Formulation::Lagrange];
const METHODS: [Method; 3] = [
    Method::SemiImplicitEuler,
    Method::RungeKutta4,
    Method::DormandPrince5,
];
const PRESETS: [Preset; 4] = [
    Preset::Preview,
    Preset::RealTime,
    Preset::Accurate,
    Preset::Reference,
];
const AXES: [SignedAxis; 6] = [
    SignedAxis::PlusX,
    SignedAxis::MinusX,
    SignedAxis::PlusY,
    SignedAxis::MinusY,
    SignedAxis::PlusZ,
    SignedAxis::MinusZ,
];

/// The word of an item: `words` and `items` run in parallel.
fn word<T: PartialEq, const N: usize>(
    words: &'static [&'static str; N],
    items: &[T; N],
    item: &T,
) -> Value {
    let at = items
        .iter()
        .position(|other| other == item)
        .expect("every variant has its word");
    Value::Choice(words[at])
}

/// The item of a word.
fn item<T: Copy, const N: usize>(words: &[&str; N], items: &[T; N], value: &Value) -> T {
    let at = words
        .iter()
        .position(|other| matches!(value, Value::Choice(word) if word == other));
    items[at.expect("the table has checked the word")]
}

fn number(value: &Value) -> f64 {
    match value {
        Value::Number(number) => *number,
        _ => unreachable!("the table has checked the kind"),
    }
}

/// A contact parameter by the last part of its key.
pub(super) fn contact_value(contact: &contact::Parameters, part: &str) -> Value {
    Value::Number(match part {
        "clearance" => contact.clearance,
        "friction" => contact.friction,
        "restitution" => contact.restitution,
        "youngs_modulus" => contact.youngs_modulus,
        "poisson_ratio" => contact.poisson_ratio,
        "ball_radius" => contact.ball_radius,
        "slip_speed_low" => contact.slip_speed_low,
        "slip_speed_high" => contact.slip_speed_high,
        "impact_speed_floor" => contact.impact_speed_floor,
        "friction_velocity" => {
            return word(
                &table::FRICTION_VELOCITIES,
                &VELOCITIES,
                &contact.friction_velocity,
            );
        }
        "normal_law" => return word(&table::NORMAL_LAWS, &NORMALS, &contact.normal_law),
        "friction_law" => return word(&table::FRICTION_LAWS, &FRICTIONS, &contact.friction_law),
        _ => unreachable!("{part} is no contact key"),
    })
}

/// Writes a contact parameter by the last part of its key; the value has passed the table.
pub(super) fn set_contact_value(contact: &mut contact::Parameters, part: &str, value: &Value) {
    match part {
        "clearance" => contact.clearance = number(value),
        "friction" => contact.friction = number(value),
        "restitution" => contact.restitution = number(value),
        "youngs_modulus" => contact.youngs_modulus = number(value),
        "poisson_ratio" => contact.poisson_ratio = number(value),
        "ball_radius" => contact.ball_radius = number(value),
        "slip_speed_low" => contact.slip_speed_low = number(value),
        "slip_speed_high" => contact.slip_speed_high = number(value),
        "impact_speed_floor" => contact.impact_speed_floor = number(value),
        "friction_velocity" => {
            contact.friction_velocity = item(&table::FRICTION_VELOCITIES, &VELOCITIES, value)
        }
        "normal_law" => contact.normal_law = item(&table::NORMAL_LAWS, &NORMALS, value),
        "friction_law" => contact.friction_law = item(&table::FRICTION_LAWS, &FRICTIONS, value),
        _ => unreachable!("{part} is no contact key"),
    }
}

/// A key resolved against a scene: its row, and the joint it is for.
struct Resolved {
    parameter: &'static Parameter,
    joint: Option<usize>,
}

impl Scene {
    /// Whether a row's keys exist in this scene.
    fn has(&self, parameter: &Parameter) -> bool {
        match parameter.scope {
            Scope::Every | Scope::Contact => true,
            Scope::Spcmm => self.spcmm.is_some(),
            Scope::Chain => self.chain.is_some(),
        }
    }

    /// Parameters this scene has, in table order; a contact row also stands for `joint.<name>.<key>`.
    pub fn parameters(&self) -> Vec<&'static Parameter> {
        table()
            .iter()
            .filter(|parameter| self.has(parameter))
            .collect()
    }

    fn resolve(&self, key: &str) -> Result<Resolved, SceneError> {
        let Some((name, part)) = key
            .strip_prefix("joint.")
            .and_then(|rest| rest.rsplit_once('.'))
        else {
            return match find(key) {
                Some(parameter) if self.has(parameter) => Ok(Resolved {
                    parameter,
                    joint: None,
                }),
                Some(parameter) => {
                    let place = parameter.scope.describe();
                    Err(SceneError::about(
                        key,
                        None,
                        format!(
                            "the scene `{}` has no such key: it exists only in {place}",
                            self.name
                        ),
                    ))
                }
                None => {
                    // Keys without their section are a common slip: compare both forms.
                    let here = self.parameters();
                    let near = match here.iter().find(|p| p.key.rsplit('.').next() == Some(key)) {
                        Some(parameter) => format!("; did you mean `{}`?", parameter.key),
                        None => nearest(key, here.iter().map(|parameter| parameter.key)),
                    };
                    Err(SceneError::about(key, None, format!("unknown key{near}")))
                }
            };
        };
        let Some(joint) = self.ball_joints.iter().position(|joint| joint.name == name) else {
            let names: Vec<&str> = self
                .ball_joints
                .iter()
                .map(|joint| joint.name.as_str())
                .collect();
            let near = nearest(name, names.iter().copied());
            let listed = if names.len() > 12 {
                format!("{}, …", names[..12].join(", "))
            } else {
                names.join(", ")
            };
            return Err(SceneError::about(
                key,
                None,
                format!("no ball joint `{name}`{near}; ball joints: {listed}"),
            ));
        };
        match find(&format!("contact.{part}")) {
            Some(parameter) => Ok(Resolved {
                parameter,
                joint: Some(joint),
            }),
            None => {
                let parts = table().iter().filter_map(contact_part);
                Err(SceneError::about(
                    key,
                    None,
                    format!("unknown key{}", nearest(part, parts)),
                ))
            }
        }
    }

    /// Value of `key` (`joint.<name>.<…>` included).
    ///
    /// # Errors
    /// A key this scene has not, with the nearest right one.
    pub fn get(&self, key: &str) -> Result<Value, SceneError> {
        let Resolved { parameter, joint } = self.resolve(key)?;
        if let Some(part) = contact_part(parameter) {
            let contact = joint.map_or(&self.contact, |joint| &self.ball_joints[joint].contact);
            return Ok(contact_value(contact, part));
        }
        let spcmm = |pick: fn(&Spcmm) -> f64| Value::Number(self.spcmm.as_ref().map_or(0.0, pick));
        Ok(match parameter.key {
            "gravity.x" => Value::Number(self.gravity.x),
            "gravity.y" => Value::Number(self.gravity.y),
            "gravity.z" => Value::Number(self.gravity.z),
            "spcmm.slider_plane" => spcmm(|s| s.slider_plane),
            "spcmm.amplitude_x" => spcmm(|s| s.amplitude_x),
            "spcmm.amplitude_beta" => spcmm(|s| s.amplitude_beta),
            "spcmm.frequency" => spcmm(|s| s.frequency),
            "chain.links" => Value::Count(self.chain.map_or(0, |chain| chain.links as u64)),
            "formulation" => word(&table::FORMULATIONS, &FORMS, &self.formulation),
            "solver.method" => word(&table::METHODS, &METHODS, &self.solver.method),
            "solver.step" => Value::Number(self.solver.step),
            "solver.tolerance" => Value::Number(self.solver.tolerance),
            "solver.preset" => match &self.solver.preset {
                Some(preset) => word(&table::PRESETS, &PRESETS, preset),
                None => Value::Unset,
            },
            "view.down" => word(&table::AXES, &AXES, &self.view.down),
            other => unreachable!("{other} has no field"),
        })
    }

    /// Parameter row of `key` (`joint.<name>.<…>` included).
    ///
    /// # Errors
    /// A key this scene has not, with the nearest right one.
    pub fn parameter(&self, key: &str) -> Result<&'static Parameter, SceneError> {
        self.resolve(key).map(|resolved| resolved.parameter)
    }

    /// Changes a parameter in place and records it in `changes`. `chain.links` and `spcmm.slider_plane` rebuild the
    /// scene from its source with the changes so far.
    ///
    /// # Errors
    /// Unknown key, wrong unit, out of range, or a scene that would no longer hold together; `self` is then unchanged.
    pub fn set(&mut self, key: &str, value: &str) -> Result<&'static Parameter, SceneError> {
        let mut next = self.clone();
        let parameter = next.change(key, value)?;
        if matches!(key, "chain.links" | "spcmm.slider_plane") {
            next = next.rebuilt()?;
        }
        next.check_contacts()
            .map_err(|fault| fault.blame_change(&next, key))?;
        *self = next;
        Ok(parameter)
    }

    /// As [`Self::set`] with a value in SI units, for sliders: the text recorded reads back to the same bits.
    ///
    /// # Errors
    /// As [`Self::set`]; [`Value::Unset`] takes the change back, as [`Self::undo_change`].
    pub fn set_value(
        &mut self,
        key: &str,
        value: &Value,
    ) -> Result<&'static Parameter, SceneError> {
        let parameter = self.parameter(key)?;
        if *value == Value::Unset {
            return self.undo_change(key);
        }
        if matches!(value, Value::Number(number) if !number.is_finite()) {
            return Err(SceneError::about(
                key,
                None,
                format!("must be a finite number; {}", parameter.allowed()),
            ));
        }
        self.set(key, &parameter.write(value))
    }

    /// Takes a change back: the parameter is again what the scene's text says.
    ///
    /// # Errors
    /// A key this scene has not, or a scene that would no longer hold together; `self` is then unchanged.
    pub fn undo_change(&mut self, key: &str) -> Result<&'static Parameter, SceneError> {
        let parameter = self.parameter(key)?;
        let mut next = self.clone();
        next.changes.retain(|(changed, _)| changed != key);
        *self = next.rebuilt()?;
        Ok(parameter)
    }

    /// The scene read again from its text with its changes, less those of joints that are no more.
    fn rebuilt(&self) -> Result<Self, SceneError> {
        let mut changes = self.changes.clone();
        if let Some((_, links)) = changes.iter().find(|(key, _)| key == "chain.links") {
            // Every ball joint of a chain is J1 to JN.
            let links: u64 = links.parse().unwrap_or(u64::MAX);
            changes.retain(|(key, _)| {
                match key
                    .strip_prefix("joint.J")
                    .and_then(|rest| rest.split('.').next())
                {
                    Some(index) => index.parse::<u64>().is_ok_and(|index| index <= links),
                    None => true,
                }
            });
        }
        Self::parse(&self.source.text, self.source.file.as_deref(), &changes)
    }

    /// Applies and records one change without the checks between parameters.
    pub(super) fn change(
        &mut self,
        key: &str,
        text: &str,
    ) -> Result<&'static Parameter, SceneError> {
        let text = text.trim();
        let Resolved { parameter, joint } = self.resolve(key).map_err(|mut error| {
            error.value = Some(text.into());
            error
        })?;
        let value = parameter
            .read(text)
            .map_err(|message| SceneError::about(key, Some(text), message))?;
        match (contact_part(parameter), joint) {
            (Some(part), Some(joint)) => {
                let joint = &mut self.ball_joints[joint];
                set_contact_value(&mut joint.contact, part, &value);
                if !joint.overrides.contains(&part) {
                    joint.overrides.push(part);
                }
            }
            (Some(part), None) => self.set_contact(part, &value),
            (None, _) => self.write(parameter.key, &value),
        }
        self.changes.retain(|(changed, _)| changed != key);
        self.changes.push((key.to_owned(), text.to_owned()));
        if parameter.key.starts_with("solver.") {
            self.resolve_preset();
        }
        Ok(parameter)
    }

    /// A contact parameter of the scene, and of every joint that has none of its own.
    pub(super) fn set_contact(&mut self, part: &'static str, value: &Value) {
        set_contact_value(&mut self.contact, part, value);
        for joint in self
            .ball_joints
            .iter_mut()
            .filter(|joint| !joint.overrides.contains(&part))
        {
            set_contact_value(&mut joint.contact, part, value);
        }
    }

    /// Writes a parameter that is not a contact's; the value has passed the table.
    pub(super) fn write(&mut self, key: &str, value: &Value) {
        let spcmm = self.spcmm.as_mut();
        match (key, spcmm) {
            ("gravity.x", _) => self.gravity.x = number(value),
            ("gravity.y", _) => self.gravity.y = number(value),
            ("gravity.z", _) => self.gravity.z = number(value),
            ("spcmm.slider_plane", Some(spcmm)) => spcmm.slider_plane = number(value),
            ("spcmm.amplitude_x", Some(spcmm)) => spcmm.amplitude_x = number(value),
            ("spcmm.amplitude_beta", Some(spcmm)) => spcmm.amplitude_beta = number(value),
            ("spcmm.frequency", Some(spcmm)) => spcmm.frequency = number(value),
            ("chain.links", _) => {
                if let (Some(chain), Value::Count(links)) = (self.chain.as_mut(), value) {
                    chain.links = usize::try_from(*links).expect("the table allows a few thousand");
                }
            }
            ("formulation", _) => self.formulation = item(&table::FORMULATIONS, &FORMS, value),
            ("solver.method", _) => self.solver.method = item(&table::METHODS, &METHODS, value),
            ("solver.step", _) => self.solver.step = number(value),
            ("solver.tolerance", _) => self.solver.tolerance = number(value),
            ("solver.preset", _) => self.apply_preset(item(&table::PRESETS, &PRESETS, value)),
            ("view.down", _) => self.view.down = item(&table::AXES, &AXES, value),
            _ => unreachable!("{key} has no field here"),
        }
    }

    fn apply_preset(&mut self, preset: Preset) {
        let (method, step, tolerance) = preset.point();
        self.solver = Solver {
            preset: Some(preset),
            method,
            step,
            tolerance,
        };
    }

    /// Solver settings that were changed by name win over a preset, whichever came first.
    fn resolve_preset(&mut self) {
        for key in ["solver.method", "solver.step", "solver.tolerance"] {
            if let Some((_, text)) = self.changes.iter().rfind(|(changed, _)| changed == key) {
                let read = find(key).map(|parameter| parameter.read(text));
                if let Some(Ok(value)) = read {
                    self.write(key, &value);
                }
            }
        }
    }

    /// What must hold between the contact parameters of one joint.
    pub(super) fn check_contacts(&self) -> Result<(), Fault> {
        check_contact(&self.contact).map_err(|(parts, message)| Fault {
            joint: None,
            parts,
            message,
        })?;
        for (index, joint) in self.ball_joints.iter().enumerate() {
            check_contact(&joint.contact).map_err(|(parts, message)| Fault {
                joint: Some(index),
                parts,
                message,
            })?;
        }
        Ok(())
    }

    /// Choices that are allowed but may not mean what the user expects, one sentence each.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        for (joints, contact) in self.contact_groups() {
            let near_one = contact.restitution >= 0.8 || contact.clearance == 0.0;
            if contact.normal_law == NormalLaw::LankaraniNikravesh && !near_one {
                warnings.push(format!(
                    "{joints}: restitution {} with lankarani-nikravesh, which is right only near 1 (asked for 0, it gives \
                     about 0.66); flores or gonthier suit low restitution.",
                    contact.restitution
                ));
            }
            if contact.clearance > 0.0 && contact.clearance <= 1e-5 {
                warnings.push(format!(
                    "{joints}: clearance {} is so small that the contact patch is no longer small against the ball \
                     (radius {}), which the contact law assumes.",
                    format_quantity(contact.clearance, "mm"),
                    format_quantity(contact.ball_radius, "mm")
                ));
            }
            if contact.clearance > 0.0
                && contact.slip_speed_high < 1e-6
                && contact.friction_law == FrictionLaw::ModifiedCoulomb
            {
                warnings.push(format!(
                    "{joints}: slip_speed_high {} makes friction very stiff; expect small steps.",
                    format_quantity(contact.slip_speed_high, "mm/s")
                ));
            }
        }
        let rattles = self
            .ball_joints
            .iter()
            .any(|joint| joint.contact.clearance > 0.0);
        if rattles && !self.solver.method.is_adaptive() && self.solver.step > 20e-6 {
            warnings.push(format!(
                "solver.step {}: an impact lasts about 0.1 ms, which a fixed step above 20 us does not resolve.",
                format_quantity(self.solver.step, "us")
            ));
        }
        warnings
    }

    /// Ball joints with equal contact parameters, named together.
    fn contact_groups(&self) -> Vec<(String, contact::Parameters)> {
        let mut groups: Vec<(Vec<&str>, contact::Parameters)> = Vec::new();
        for joint in &self.ball_joints {
            match groups
                .iter_mut()
                .find(|(_, contact)| *contact == joint.contact)
            {
                Some((names, _)) => names.push(&joint.name),
                None => groups.push((vec![&joint.name], joint.contact)),
            }
        }
        let title = |names: &[&str]| match names {
            [first, .., last] if names.len() > 6 => format!("{first} to {last}"),
            _ => names.join(", "),
        };
        groups
            .into_iter()
            .map(|(names, contact)| (title(&names), contact))
            .collect()
    }
}

/// Two parameters that do not go together.
pub(super) struct Fault {
    pub joint: Option<usize>,
    /// Last parts of the keys at fault, the likelier first.
    pub parts: [&'static str; 2],
    pub message: String,
}

impl Fault {
    /// Keys that could be to blame in `scene`, the likelier first.
    pub fn keys(&self, scene: &Scene) -> Vec<String> {
        let joint = self.joint.map(|index| &scene.ball_joints[index]);
        let key = |part: &&'static str| match joint {
            Some(joint) if joint.overrides.contains(part) => format!("joint.{}.{part}", joint.name),
            _ => format!("contact.{part}"),
        };
        let mut keys: Vec<String> = self.parts.iter().map(key).collect();
        // What one joint has of its own departs from what holds for all.
        keys.sort_by_key(|key| !key.starts_with("joint."));
        keys
    }

    fn text(&self, scene: &Scene, key: &str) -> String {
        match self.joint.map(|index| &scene.ball_joints[index].name) {
            Some(name) if !key.starts_with("joint.") => {
                format!("{} (in ball joint {name})", self.message)
            }
            _ => self.message.clone(),
        }
    }

    /// The error of the change of `key` that brought the fault in.
    fn blame_change(&self, scene: &Scene, key: &str) -> SceneError {
        let value = scene
            .changes
            .iter()
            .rfind(|(changed, _)| changed == key)
            .map(|(_, value)| value.as_str());
        SceneError::about(key, value, self.text(scene, key))
    }

    /// The error of the latest change that has to do with the fault; `None` if it was in the file.
    pub fn blame_changes(&self, scene: &Scene) -> Option<SceneError> {
        let keys = self.keys(scene);
        let (key, _) = scene
            .changes
            .iter()
            .rfind(|(changed, _)| keys.contains(changed))?;
        Some(self.blame_change(scene, key))
    }
}

fn check_contact(contact: &contact::Parameters) -> Result<(), ([&'static str; 2], String)> {
    if contact.clearance >= contact.ball_radius {
        return Err((
            ["clearance", "ball_radius"],
            format!(
                "clearance {} must be below the ball radius, {}; allowed 0 mm to below {1}; units {}",
                format_quantity(contact.clearance, "mm"),
                format_quantity(contact.ball_radius, "mm"),
                unit_names(Dimension::Length).join(", ")
            ),
        ));
    }
    if contact.slip_speed_low >= contact.slip_speed_high {
        return Err((
            ["slip_speed_low", "slip_speed_high"],
            format!(
                "slip_speed_low {} must be below slip_speed_high {}; units {}",
                format_quantity(contact.slip_speed_low, "mm/s"),
                format_quantity(contact.slip_speed_high, "mm/s"),
                unit_names(Dimension::Speed).join(", ")
            ),
        ));
    }
    let divides = matches!(contact.normal_law, NormalLaw::Flores | NormalLaw::Gonthier);
    if divides && contact.restitution == 0.0 {
        let Value::Choice(law) = contact_value(contact, "normal_law") else {
            unreachable!("a law is a choice")
        };
        return Err((
            ["restitution", "normal_law"],
            format!(
                "the law {law} divides by the restitution: with it, allowed above 0 to 1; a pure number, no unit"
            ),
        ));
    }
    Ok(())
}
