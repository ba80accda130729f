//! Parameters of a scene by key: reading and changing.

use super::error::{brief, nearest, nearest_parameter};
use super::read::{SPCMM_DIMENSIONS, VIEW_SETTINGS};
use super::table::{self, contact_part, find};
use super::*;
use crate::contact::{self, ApproachSpeed, FrictionLaw, FrictionVelocity, NormalLaw};
use crate::integrate::Method;

const VELOCITIES: [FrictionVelocity; 3] = [
    FrictionVelocity::Centres,
    FrictionVelocity::Surface,
    FrictionVelocity::Printed,
];
const APPROACHES: [ApproachSpeed; 2] = [ApproachSpeed::Start, ApproachSpeed::Largest];
const NORMALS: [NormalLaw; 5] = [
    NormalLaw::LankaraniNikravesh,
    NormalLaw::Hertz,
    NormalLaw::HuntCrossley,
    NormalLaw::Flores,
    NormalLaw::Gonthier,
];
const FRICTIONS: [FrictionLaw; 2] = [FrictionLaw::ModifiedCoulomb, FrictionLaw::None];
const FORMS: [Formulation; 2] = [Formulation::Tree, Formulation::Lagrange];
const METHODS: [Method; 7] = [
    Method::SemiImplicitEuler,
    Method::ImexEuler,
    Method::RungeKutta4,
    Method::DormandPrince5,
    Method::Rosenbrock,
    Method::Radau5,
    Method::Automatic,
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

/// The word of a normal-force law.
pub(super) fn normal_law_word(law: NormalLaw) -> &'static str {
    let at = NORMALS.iter().position(|other| *other == law);
    at.map_or("", |at| table::NORMAL_LAWS[at])
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
        "approach_speed" => {
            return word(
                &table::APPROACH_SPEEDS,
                &APPROACHES,
                &contact.approach_speed,
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
        "approach_speed" => {
            contact.approach_speed = item(&table::APPROACH_SPEEDS, &APPROACHES, value)
        }
        "normal_law" => contact.normal_law = item(&table::NORMAL_LAWS, &NORMALS, value),
        "friction_law" => contact.friction_law = item(&table::FRICTION_LAWS, &FRICTIONS, value),
        _ => unreachable!("{part} is no contact key"),
    }
}

impl BallJoint {
    /// A contact parameter of this joint by the last part of its key; `None` where there is no such part.
    pub fn value(&self, part: &str) -> Option<Value> {
        let known = table().iter().filter_map(contact_part).any(|p| p == part);
        known.then(|| contact_value(&self.contact, part))
    }
}

/// A key resolved against a scene: its row, and the joint it is for.
struct Resolved {
    parameter: &'static Parameter,
    joint: Option<usize>,
}

/// Whether a key has its place in a scene file although it is no parameter.
fn file_only(key: &str) -> bool {
    let (section, rest) = key.split_once('.').unwrap_or((key, ""));
    match section {
        "spcmm" => SPCMM_DIMENSIONS.contains(&rest),
        "view" => VIEW_SETTINGS.contains(&rest),
        "chain" => ["hang", "rotation"].contains(&rest) || rest.starts_with("link."),
        "output" => ["body", "probe"].contains(&rest),
        "name" | "title" | "description" | "start" => rest.is_empty(),
        _ => false,
    }
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
                None if file_only(key) => Err(SceneError::about(
                    key,
                    None,
                    "only in the scene file: it cannot be changed from outside it",
                )),
                None => {
                    let here = self.parameters();
                    let near =
                        nearest_parameter(key, here.iter().map(|parameter| parameter.key), &[]);
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
            let listed = if names.len() > 12 {
                format!("{}, …", names[..12].join(", "))
            } else {
                names.join(", ")
            };
            let first = name.split('.').next().unwrap_or(name);
            let hinge = self.joints.iter().any(|joint| joint.name == first);
            let message = if hinge {
                let parts: Vec<&str> = table().iter().filter_map(contact_part).collect();
                format!(
                    "`{first}` is no ball joint: its drive, start, axis and points stand in the scene file alone. Such keys \
                     are joint.<ball joint>.<key>; ball joints: {listed}; keys: {}",
                    parts.join(", ")
                )
            } else {
                let near = nearest(name, names.iter().copied());
                format!(
                    "no ball joint `{}`{near}; ball joints: {listed}",
                    brief(name)
                )
            };
            return Err(SceneError::about(key, None, message));
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
                Some(preset) => word(&table::PRESETS, &Preset::ALL, preset),
                None => Value::Unset,
            },
            "solver.energy_ledger" => {
                word(&table::SWITCHES, &[true, false], &self.solver.energy_ledger)
            }
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
        if self.changes.len() >= MOST_CHANGES {
            let message =
                format!("too many parameters are changed; allowed at most {MOST_CHANGES}");
            return Err(SceneError::about(key, Some(text), message));
        }
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
            ("solver.preset", _) => self.apply_preset(item(&table::PRESETS, &Preset::ALL, value)),
            ("solver.energy_ledger", _) => {
                self.solver.energy_ledger = item(&table::SWITCHES, &[true, false], value);
            }
            ("view.down", _) => self.view.down = item(&table::AXES, &AXES, value),
            _ => unreachable!("{key} has no field here"),
        }
    }

    /// What the scene's text does not give by name follows the preset.
    fn apply_preset(&mut self, preset: Preset) {
        let (method, step, tolerance) = preset.point();
        let free = |key: &str| !self.source.places.contains_key(key);
        let (method_free, step_free, tolerance_free) = (
            free("solver.method"),
            free("solver.step"),
            free("solver.tolerance"),
        );
        let solver = &mut self.solver;
        solver.preset = Some(preset);
        if method_free {
            solver.method = method;
        }
        if step_free {
            solver.step = step;
        }
        if tolerance_free {
            solver.tolerance = tolerance;
        }
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
}
