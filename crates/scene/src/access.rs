//! Reading and changing the parameters of a scene by key.

use super::assets::AssetResolver;
use super::error::{nearest_parameter, no_ball_joint};
use super::field::Access;
use super::model::AsRead;
use super::numbers::row_of_number;
use super::read::{changes_of_text, is_fixed_in_file, replaces_text};
use super::table::{contact_part, find, joint_part};
use super::*;
use jointplay_physics::integrate::StepControl;
use jointplay_physics::machine::{LooseKind, Slide, Solver};
use jointplay_physics::suggest::{did_you_mean, nearest, nearest_name};
use std::sync::Arc;

/// Keys of changes that set the solver by its method and numbers.
pub(super) fn sets_solver(changes: &[(String, String)]) -> impl Iterator<Item = &str> {
    changes.iter().map(|(key, _)| &**key).filter(|key| SOLVER_KEYS.contains(key))
}

/// What is wrong with a preset beside `key`, one of [`SOLVER_KEYS`].
pub(super) fn beside_preset(key: &str) -> String {
    format!(
        "{PRESET} is given, too: give a preset, or a method with its number, and leave out either {PRESET} or {key}"
    )
}

/// Checks that `changes` made at once do not ask for a preset and for a method or its number.
///
/// # Errors
/// They do; the error is about the method or the number.
pub fn check_solver_changes(changes: &[(String, String)]) -> Result<(), SceneError> {
    let method = changes.iter().find(|(key, _)| SOLVER_KEYS.contains(&&**key));
    match method.filter(|_| changes.iter().any(|(key, _)| key == PRESET)) {
        Some((key, value)) => Err(SceneError::about(key, Some(value), beside_preset(key))),
        None => Ok(()),
    }
}

/// A key resolved against a scene: its row, and the joint it applies to.
struct Resolved {
    parameter: &'static Parameter,
    joint: Option<usize>,
    /// The key, as changes have it.
    key: Option<String>,
}

impl Scene {
    /// Keys (without prefix) in which joint with play `joint` differs from the scene's `contact.*`.
    pub fn overrides(&self, joint: usize) -> &[&'static str] {
        &self.overrides[joint]
    }

    /// Keys of the parameters of joint with play `joint`.
    pub fn joint_keys(&self, joint: usize) -> impl Iterator<Item = String> + '_ {
        let joint = &self.machine.loose_joints[joint];
        play::parts_of(joint).map(|part| format!("joint.{}.{part}", joint.name))
    }

    /// Key of the contact parameter `part` of joint with play `joint`: `joint.J.play.radial` for the `clearance` of a pin, and its
    /// `play.axial` for the `second_clearance`.
    pub fn joint_key(&self, joint: usize, part: &str) -> String {
        let joint = &self.machine.loose_joints[joint];
        format!("joint.{}.{}", joint.name, play::own_part(&joint.kind, part))
    }

    /// Parameters of this scene in table order, then user-defined ones; a contact row also stands for `joint.<name>.<key>`.
    pub fn parameters(&self) -> Vec<&'static Parameter> {
        table().iter().chain(self.source.own.iter().copied()).collect()
    }

    /// Row of a number of the file, by key.
    fn number(&self, key: &str) -> Option<&'static Parameter> {
        let number = self.source.numbers.get(key)?;
        if is_fixed_in_file(key) {
            return None;
        }
        let own = self.source.own.iter().copied().find(|row| row.key == key);
        Some(own.unwrap_or_else(|| row_of_number(key, number)))
    }

    fn lookup(&self, key: &str) -> Option<Resolved> {
        if let Some(parameter) = self.number(key) {
            return Some(Resolved { parameter, joint: None, key: None });
        }
        let Some((name, part)) = joint_part(key) else {
            let parameter = find(key).filter(|parameter| parameter.scope != Scope::Joint)?;
            return Some(Resolved { parameter, joint: None, key: None });
        };
        let (joint, part) = self.loose_joint(name, part)?;
        let (parameter, part) = play::parameter_of(&self.machine.loose_joints[joint], &part)?;
        let key = format!("joint.{}.{part}", self.machine.loose_joints[joint].name);
        Some(Resolved { parameter, joint: Some(joint), key: Some(key) })
    }

    /// The joint with play of a key, and what follows its name in it.
    pub(super) fn loose_joint_of(&self, key: &str) -> Option<(&LooseJoint, String)> {
        let (name, part) = joint_part(key)?;
        let (joint, part) = self.loose_joint(name, part)?;
        Some((&self.machine.loose_joints[joint], part))
    }

    /// The joint with play to which the last parts of a key belong, with what follows its name: `play.radial` of `J.play` and
    /// `radial`.
    fn loose_joint(&self, name: &str, part: &str) -> Option<(usize, String)> {
        let named = |name: &str| self.machine.loose_joints.iter().position(|joint| joint.name == name);
        let with_table = || Some((named(name.strip_suffix(".play")?)?, format!("play.{part}")));
        named(name).map(|joint| (joint, part.to_owned())).or_else(with_table)
    }

    fn resolve(&self, key: &str) -> Result<Resolved, SceneError> {
        self.lookup(key).ok_or_else(|| SceneError::about(key, None, self.explain_missing(key)))
    }

    /// Why this scene has no such key, with the nearest one.
    fn explain_missing(&self, key: &str) -> String {
        let numbers = self.source.numbers.keys().map(String::as_str);
        let Some((name, part)) = joint_part(key) else {
            if is_fixed_in_file(key) {
                return "only in the scene file: it cannot be changed from outside it".to_owned();
            }
            let parameters = self.parameters();
            let table = parameters.iter().map(|parameter| parameter.key);
            // A longer search would cost more than the hint is worth.
            let near = nearest_parameter(key, table.chain(numbers.take(MAX_CHANGES)), &[]);
            return format!("unknown key{near}");
        };
        let balls = &self.machine.loose_joints;
        if let Some((joint, part)) = self.loose_joint(name, part) {
            let joint = &balls[joint];
            let of_play = play::own_part(&joint.kind, &part);
            let near = if of_play == part { nearest_name(&part, play::parts_of(joint)) } else { Some(of_play) };
            let near = near.map(|near| format!("joint.{}.{near}", joint.name));
            return format!("unknown key{}", did_you_mean(near.as_deref()));
        }
        let parts: Vec<&str> = table().iter().filter_map(contact_part).collect();
        // The name of a joint in an included file has dots.
        let matches_start = |joint: &&Joint| {
            name.strip_prefix(&*joint.name).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let Some(first) = self.machine.kinematic_joints().find(matches_start).map(|joint| &*joint.name) else {
            return no_ball_joint(name, balls);
        };
        // Its numbers are keys only if they are in the file.
        let own = format!("joint.{first}.");
        let given: Vec<&str> = numbers.filter(|key| key.starts_with(&own)).collect();
        let near = nearest(key, given.iter().copied());
        let names: Vec<&str> = balls.iter().map(|joint| joint.name.as_str()).collect();
        let listed = if names.len() > 12 { format!("{}, …", names[..12].join(", ")) } else { names.join(", ") };
        format!(
            "`{first}` is not a joint with play, and the file gives no such number of it{near}; its numbers: {}. Joints with play, \
             {listed}, have joint.<joint>.<key>; keys: {}",
            if given.is_empty() { "none".to_owned() } else { given.join(", ") },
            parts.join(", ")
        )
    }

    /// Value of `key` (including `joint.<name>.<…>`).
    ///
    /// # Errors
    /// A key this scene does not have; the error suggests the nearest one.
    pub fn get(&self, key: &str) -> Result<Value, SceneError> {
        let Resolved { parameter, joint, .. } = self.resolve(key)?;
        Ok(match parameter.access {
            Access::Contact(field) => {
                let own = joint.map(|joint| &self.machine.loose_joints[joint].contact);
                (field.get)(own.unwrap_or(&self.machine.contact))
            }
            Access::Machine(field) => (field.get)(&self.machine),
            Access::View(field) => (field.get)(&self.view),
            Access::Joint(get) => joint.map_or(Value::Unset, |joint| get(&self.machine.loose_joints[joint])),
            Access::Number => {
                let number = self.source.numbers.get(key);
                number.map_or(Value::Unset, |number| parameter.kind.value_of(number.value))
            }
        })
    }

    /// Parameter row of `key` (including `joint.<name>.<…>`).
    ///
    /// # Errors
    /// A key this scene does not have; the error suggests the nearest one.
    pub fn parameter(&self, key: &str) -> Result<&'static Parameter, SceneError> {
        self.resolve(key).map(|resolved| resolved.parameter)
    }

    /// Changes a parameter in place and records it in `changes`, or reads the scene again from its source with all changes so
    /// far. A preset takes the place of method, step, tolerance and steps per impact, and the reverse: the method and the number
    /// of a preset that one of them replaces remain, as changes.
    ///
    /// # Errors
    /// Unknown key, wrong unit, out of range, or an inconsistent scene; `self` is then unchanged.
    pub fn set(&mut self, key: &str, value: &str) -> Result<&'static Parameter, SceneError> {
        *self = self.with(key, value)?;
        self.parameter(key)
    }

    /// This scene after [`Self::set`].
    ///
    /// # Errors
    /// Same as [`Self::set`].
    pub fn with(&self, key: &str, value: &str) -> Result<Self, SceneError> {
        let mut next = self.clone();
        let leaves_preset = SOLVER_KEYS.contains(&key) && self.machine.solver.preset.is_some();
        if key == PRESET {
            next.changes.retain(|(changed, _)| !SOLVER_KEYS.contains(&&**changed));
        } else if leaves_preset {
            next.leave_preset()?;
        }
        next.change(key, value)?;
        if leaves_preset || replaces_text(key) {
            next = next.rebuilt(&next.changes)?;
        }
        next.apply_preset();
        next.machine.check_contacts().map_err(|conflict| next.blame_change(&conflict, key))?;
        Ok(next)
    }

    /// Like [`Self::set`], with a value in SI units, for sliders: the recorded text reads back to the same bits.
    ///
    /// # Errors
    /// Same as [`Self::set`]. [`Value::Unset`] reverts the change, like [`Self::undo_change`].
    pub fn set_value(&mut self, key: &str, value: &Value) -> Result<&'static Parameter, SceneError> {
        if *value == Value::Unset {
            return self.undo_change(key);
        }
        let parameter = self.parameter(key)?;
        if matches!(value, Value::Number(number) if !number.is_finite()) {
            return Err(SceneError::about(key, None, format!("must be a finite number; {}", parameter.allowed())));
        }
        self.set(key, &parameter.write(value))
    }

    /// Reverts a change: the parameter returns to its value in the scene's text.
    ///
    /// # Errors
    /// A key this scene does not have, or an inconsistent scene; `self` is then unchanged.
    pub fn undo_change(&mut self, key: &str) -> Result<&'static Parameter, SceneError> {
        let parameter = self.parameter(key)?;
        *self = self.without(key)?;
        Ok(parameter)
    }

    /// This scene after [`Self::undo_change`].
    ///
    /// # Errors
    /// Same as [`Self::undo_change`].
    pub fn without(&self, key: &str) -> Result<Self, SceneError> {
        let own = self.resolve(key)?.key;
        let key = own.as_deref().unwrap_or(key);
        let mut changes = self.changes.clone();
        changes.retain(|(changed, _)| changed != key);
        self.rebuilt(&changes)
    }

    /// The scene of the same text with these `changes` alone, made at once.
    ///
    /// # Errors
    /// Same as [`Self::load`].
    pub fn with_changes(&self, changes: &[(String, String)]) -> Result<Self, SceneError> {
        self.read_again(changes, |_, _| true)
    }

    /// The value that `key` has once its change is reverted; `text` is the scene as read from the same text without changes. A ball
    /// joint without a value of its own in the text then follows the common value, and a solver that no change sets the text's
    /// preset.
    pub fn value_without_change(&self, text: &Self, key: &str) -> Option<Value> {
        if !self.changes.iter().any(|(changed, _)| changed == key) {
            return self.get(key).ok();
        }
        let Resolved { parameter, joint, .. } = self.lookup(key)?;
        let is_own = |part: &str| {
            let joint = text.lookup(key).and_then(|resolved| resolved.joint);
            joint.is_some_and(|joint| text.overrides[joint].contains(&part))
        };
        if joint.is_some() && !contact_part(parameter).is_some_and(is_own) {
            return match (parameter.scope, contact_part(parameter)) {
                // Nothing moves along the axis of a pin that does not say so.
                (Scope::Joint, Some("second_clearance")) if parameter.key == "play.axial" => Some(Value::Number(0.0)),
                (Scope::Joint, Some("second_clearance")) => self.get("contact.clearance").ok(),
                (Scope::Joint, Some(part)) => self.get(&format!("contact.{part}")).ok(),
                _ => self.get(parameter.key).ok(),
            };
        }
        if let (true, Some(preset)) = (SOLVER_KEYS.contains(&key), text.machine.solver.preset) {
            if sets_solver(&self.changes).any(|changed| changed != key) {
                return Some(parameter.default.clone());
            }
            let mut next = text.clone();
            next.machine_mut().solver = preset.solver(&self.machine);
            return next.get(key).ok();
        }
        text.get(key).ok()
    }

    /// As [`Self::with_changes`], except the changes of keys that the scene no longer has, such as those of a joint beyond the
    /// end of a shortened chain.
    fn rebuilt(&self, changes: &[(String, String)]) -> Result<Self, SceneError> {
        self.read_again(changes, |scene, key| scene.lookup(key).is_some())
    }

    /// As [`Self::read`], from this scene's text. That is read again only for other numbers in it, and for the places that errors
    /// name.
    fn read_again(&self, changes: &[(String, String)], retains: fn(&Self, &str) -> bool) -> Result<Self, SceneError> {
        if let Some(as_read) = &self.source.as_read
            && changes_of_text(changes).eq(&as_read.changes)
        {
            let AsRead { machine, view, overrides, .. } = as_read.clone();
            let mut scene = Self { source: self.source.clone(), machine, view, overrides, changes: Vec::new() };
            if scene.apply(changes, retains).is_ok() && scene.machine.check_contacts().is_ok() {
                return Ok(scene);
            }
        }
        let source = &self.source;
        let beside = AssetResolver::known(&source.beside);
        Self::read(&source.text, source.file.as_deref(), beside, changes, retains)
    }

    /// Makes the `changes` of keys that this scene, as read from its text, `retains`; without the checks of contacts.
    pub(super) fn apply(
        &mut self,
        changes: &[(String, String)],
        retains: fn(&Self, &str) -> bool,
    ) -> Result<(), SceneError> {
        check_solver_changes(changes)?;
        if sets_solver(changes).next().is_some() {
            // They take the place of the text's preset.
            self.machine_mut().solver.preset = None;
        }
        for (key, value) in changes {
            if retains(self, key) {
                self.change(key, value)?;
            }
        }
        self.apply_preset();
        Ok(())
    }

    /// Records that joint with play `joint` has its own value of the contact parameter `part`.
    pub(super) fn add_override(&mut self, joint: usize, part: &'static str) {
        if !self.overrides[joint].contains(&part) {
            Arc::make_mut(&mut self.overrides)[joint].push(part);
        }
    }

    /// Applies and records one change, without the checks across parameters.
    pub(super) fn change(&mut self, key: &str, text: &str) -> Result<&'static Parameter, SceneError> {
        let text = text.trim();
        let Resolved { parameter, joint, key: own } = self.resolve(key).map_err(|mut error| {
            error.value = Some(text.into());
            error
        })?;
        let key = own.as_deref().unwrap_or(key);
        let value = parameter.read(text).map_err(|error| SceneError::about(key, Some(text), error.to_string()))?;
        match (parameter.access, joint) {
            (Access::Contact(field), Some(joint)) => {
                (field.set)(&mut self.machine_mut().loose_joints[joint].contact, &value);
                self.add_override(joint, contact_part(parameter).unwrap_or_default());
            }
            // Applied when the text is read.
            _ if replaces_text(key) => {}
            _ => self.write(parameter, &value),
        }
        self.changes.retain(|(changed, _)| changed != key);
        if self.changes.len() >= MAX_CHANGES {
            let message = format!("too many parameters are changed; allowed at most {MAX_CHANGES}");
            return Err(SceneError::about(key, Some(text), message));
        }
        self.changes.push((key.to_owned(), text.to_owned()));
        Ok(parameter)
    }

    /// Applies the solver's preset to this machine.
    pub(super) fn apply_preset(&mut self) {
        if let Some(preset) = self.machine.solver.preset {
            let energy_ledger = self.machine.solver.energy_ledger;
            let solver = Solver { energy_ledger, ..preset.solver(&self.machine) };
            if solver != self.machine.solver {
                self.machine_mut().solver = solver;
            }
        }
    }

    /// Puts the method that the preset chose for this machine and its number in the place of the preset.
    fn leave_preset(&mut self) -> Result<(), SceneError> {
        let number = match self.machine.solver.method.control() {
            StepControl::Fixed => "solver.step",
            StepControl::Error => "solver.tolerance",
            StepControl::PerImpact => "solver.steps_per_impact",
        };
        self.changes.retain(|(changed, _)| changed != PRESET);
        for key in ["solver.method", number] {
            let text = self.parameter(key)?.write(&self.get(key)?);
            self.change(key, &text)?;
        }
        Ok(())
    }

    /// Writes a value already checked against the table; a contact value also applies to joints that do not override it.
    pub(super) fn write(&mut self, parameter: &'static Parameter, value: &Value) {
        match parameter.access {
            Access::Contact(field) => {
                let machine = Arc::make_mut(&mut self.machine);
                (field.set)(&mut machine.contact, value);
                let part = contact_part(parameter).unwrap_or_default();
                let joints = machine.loose_joints.iter_mut().zip(&*self.overrides);
                for (joint, overrides) in joints {
                    let [follows, follows_second] = [part, "second_clearance"].map(|own| !overrides.contains(&own));
                    // Of other joints only the velocity of the surfaces has a meaning.
                    let has = joint.kind == LooseKind::Ball || part != "friction_velocity";
                    if follows && has {
                        (field.set)(&mut joint.contact, value);
                    }
                    let spatial = matches!(joint.kind, LooseKind::Slide(Slide { half_height: Some(_), .. }));
                    if part == "clearance" && spatial && follows_second {
                        joint.contact.second_clearance = machine.contact.clearance;
                    }
                }
            }
            Access::Machine(field) => (field.set)(self.machine_mut(), value),
            Access::View(field) => (field.set)(&mut self.view, value),
            Access::Number | Access::Joint(_) => {}
        }
    }
}
