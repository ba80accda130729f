//! Applied forces of a running machine: gravity, and its force elements with what changed in them since the start.

use serde::{Deserialize, Serialize};

use std::borrow::Cow;
use std::sync::Arc;

use super::{Characteristic, Drive, Element, ElementKind, Machine, Motor, Vec3};
use crate::words::words;

/// Largest magnitude of a controlled number, SI; a limit may be infinite.
const LARGEST: f64 = 1e12;

/// A number of a force element that a controller sets while the machine runs, SI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ElementNumber {
    /// Constant part of a motor's force, N, or torque, N m.
    Force,
    Stiffness,
    Damping,
    Limit,
    /// Where a motor's target is now, m or rad. The target moves on from there at [`Self::TargetRate`].
    Target,
    TargetRate,
    /// Of a spring between two points.
    Length,
    /// Coordinate at which a spring on a joint carries its preload.
    Position,
    Preload,
    /// Force and torque of a load where its factor is 1, in its axes.
    ForceX,
    ForceY,
    ForceZ,
    TorqueX,
    TorqueY,
    TorqueZ,
    /// Of a film, Pa s.
    Viscosity,
}

words!(ElementNumber {
    Force => "force",
    Stiffness => "stiffness",
    Damping => "damping",
    Limit => "limit",
    Target => "target",
    TargetRate => "target_rate",
    Length => "length",
    Position => "position",
    Preload => "preload",
    ForceX => "force_x",
    ForceY => "force_y",
    ForceZ => "force_z",
    TorqueX => "torque_x",
    TorqueY => "torque_y",
    TorqueZ => "torque_z",
    Viscosity => "viscosity",
});

/// Why a number of an element was not set.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ControlFault {
    /// There is no such element.
    #[error("element {element} of {elements} (counted from 0)")]
    NoElement {
        /// Index.
        element: usize,
        /// Number of elements.
        elements: usize,
    },
    /// The element has no such number: another kind has it, or a curve stands in its place.
    #[error("{element} has no {number} that could be set")]
    NoNumber {
        /// Name.
        element: String,
        /// The number.
        number: ElementNumber,
    },
    /// Out of range.
    #[error("{number} of {element} = {value}; allowed {least:e} to {LARGEST:e}, SI")]
    Range {
        /// Name.
        element: String,
        /// The number.
        number: ElementNumber,
        /// SI.
        value: f64,
        /// SI.
        least: f64,
    },
}

/// A number that was set. Of a target: its position at t = 0, and its rate. The largest double stands for no limit, since a file of a
/// state holds finite numbers only.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Control {
    element: usize,
    number: ElementNumber,
    value: f64,
}

/// Force elements of a running machine: those of its scene with the changes since the start, and numbers that were set directly.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LiveElements {
    /// Those of the scene; `None` while they are as at the start. Not part of a saved state, since the scene beside it has them.
    #[serde(skip)]
    changed: Option<Arc<[Element]>>,
    controls: Vec<Control>,
}

impl PartialEq for LiveElements {
    fn eq(&self, other: &Self) -> bool {
        let same = match (&self.changed, &other.changed) {
            (Some(own), Some(other)) => Arc::ptr_eq(own, other) || own == other,
            (None, None) => true,
            _ => false,
        };
        same && self.controls == other.controls
    }
}

/// Gravity and force elements of a running machine: what acts on it whether or not its joints have play.
#[derive(Clone, Debug, PartialEq)]
pub struct AppliedForces {
    /// m/s^2.
    pub gravity: Vec3,
    /// Its force elements.
    pub elements: LiveElements,
}

impl AppliedForces {
    /// Those of `machine` at its start.
    pub fn of(machine: &Machine) -> Self {
        Self { gravity: machine.gravity, elements: LiveElements::default() }
    }
}

impl LiveElements {
    /// The scene's own elements, of a machine that started as `machine`.
    fn of_scene<'a>(&'a self, machine: &'a Machine) -> &'a [Element] {
        self.changed.as_deref().unwrap_or(&machine.elements)
    }

    /// Element `i` as it acts in a machine that started as `machine`.
    ///
    /// # Panics
    /// An index beyond the machine's elements.
    pub fn element<'a>(&'a self, machine: &'a Machine, i: usize) -> Cow<'a, Element> {
        let mut element = Cow::Borrowed(&self.of_scene(machine)[i]);
        for control in self.controls.iter().filter(|control| control.element == i) {
            if let Some(number) = element.to_mut().number_mut(control.number) {
                *number = if control.value == f64::MAX { f64::INFINITY } else { control.value };
            }
        }
        element
    }

    /// Whether no element differs from how the machine started.
    pub fn is_as_started(&self) -> bool {
        self.changed.is_none() && self.controls.is_empty()
    }

    /// Takes over the elements of `next`, which differs from `machine` only in conditions. What was set of an element holds until
    /// the scene changes that element.
    pub(crate) fn adopt(&mut self, machine: &Machine, next: &Machine) {
        let before = self.changed.as_deref().unwrap_or(&machine.elements);
        if before == next.elements {
            return;
        }
        self.controls.retain(|control| before[control.element] == next.elements[control.element]);
        self.changed = (machine.elements != next.elements).then(|| next.elements.clone().into());
    }

    /// Takes over the scene's elements of `other`.
    pub(crate) fn share(&mut self, other: &Self) {
        self.changed.clone_from(&other.changed);
    }

    /// Sets a number of element `i`, or of a target its position at t = 0 or its rate.
    pub(crate) fn set(&mut self, element: usize, number: ElementNumber, value: f64) {
        let value = value.min(f64::MAX);
        let own = self.controls.iter_mut().find(|own| (own.element, own.number) == (element, number));
        match own {
            Some(own) => own.value = value,
            None => self.controls.push(Control { element, number, value }),
        }
    }

    /// Checks controls that were read: they are numbers that elements of `machine` have.
    pub(crate) fn fits(&self, machine: &Machine) -> bool {
        self.controls.iter().all(|control| {
            let mut element = machine.elements.get(control.element).cloned();
            control.value.is_finite()
                && element.as_mut().is_some_and(|element| element.number_mut(control.number).is_some())
        })
    }

    /// Approximate size in bytes; shared elements do not count.
    pub(crate) fn bytes(&self) -> usize {
        std::mem::size_of_val(&self.controls[..])
    }
}

impl ElementNumber {
    /// Least value that it may have.
    fn least(self) -> f64 {
        match self {
            Self::Stiffness | Self::Damping | Self::Limit | Self::Length | Self::Viscosity => 0.0,
            _ => -LARGEST,
        }
    }
}

impl Element {
    /// Whether a running machine can continue with `next` in its place: the same kind at the same place, with other forces. The
    /// depth of a stop is a scale of the steps, and at another frequency a law would jump to another phase: both wait for a reset.
    pub(super) fn can_become(&self, next: &Self) -> bool {
        let (own, other) = (self.describe(), next.describe());
        let is_constant = |law: Option<(_, &Drive)>| matches!(law, None | Some((_, Drive::Constant { .. })));
        self.name == next.name
            && (own.word, own.place, own.stop_depth) == (other.word, other.place, other.stop_depth)
            && (own.law == other.law || (is_constant(own.law) && is_constant(other.law)))
    }

    /// A number of the element as it stands; `None` if the kind does not have it. A target becomes one at a constant rate.
    fn number_mut(&mut self, number: ElementNumber) -> Option<&mut f64> {
        use ElementNumber as N;
        match &mut self.kind {
            ElementKind::Motor(motor) => motor.number_mut(number),
            ElementKind::Spring(spring) => match number {
                N::Length => Some(&mut spring.length),
                _ => line_number_mut([&mut spring.elastic, &mut spring.damping], number),
            },
            ElementKind::JointSpring(spring) => match number {
                N::Position => Some(&mut spring.position),
                _ => line_number_mut([&mut spring.elastic, &mut spring.damping], number),
            },
            ElementKind::Load(load) => match number {
                N::ForceX => Some(&mut load.force.x),
                N::ForceY => Some(&mut load.force.y),
                N::ForceZ => Some(&mut load.force.z),
                N::TorqueX => Some(&mut load.torque.x),
                N::TorqueY => Some(&mut load.torque.y),
                N::TorqueZ => Some(&mut load.torque.z),
                _ => None,
            },
            ElementKind::Lubricant(film) => (number == N::Viscosity).then_some(&mut film.viscosity),
            ElementKind::Stop(_) | ElementKind::Bushing(_) | ElementKind::Tyre(_) => None,
        }
    }

    /// Value of a number; `None` if the kind does not have it.
    pub(crate) fn number(&self, number: ElementNumber) -> Option<f64> {
        self.clone().number_mut(number).copied()
    }

    /// Checks that `value` can be set.
    ///
    /// # Errors
    /// The element has no such number, or the value is out of range.
    pub(crate) fn check_number(&self, number: ElementNumber, value: f64) -> Result<(), ControlFault> {
        let element = || self.name.clone();
        if self.clone().number_mut(number).is_none() {
            return Err(ControlFault::NoNumber { element: element(), number });
        }
        let least = number.least();
        let is_unlimited = number == ElementNumber::Limit && value == f64::INFINITY;
        if (least..=LARGEST).contains(&value) || is_unlimited {
            Ok(())
        } else {
            Err(ControlFault::Range { element: element(), number, value, least })
        }
    }
}

/// Stiffness, damping or preload of a spring; `None` where a curve stands in its place.
fn line_number_mut([elastic, damping]: [&mut Characteristic; 2], number: ElementNumber) -> Option<&mut f64> {
    match (number, elastic, damping) {
        (ElementNumber::Stiffness, Characteristic::Line { slope, .. }, _) => Some(slope),
        (ElementNumber::Preload, Characteristic::Line { offset, .. }, _) => Some(offset),
        (ElementNumber::Damping, _, Characteristic::Line { slope, .. }) => Some(slope),
        _ => None,
    }
}

impl Motor {
    fn number_mut(&mut self, number: ElementNumber) -> Option<&mut f64> {
        match number {
            ElementNumber::Force => Some(&mut self.force),
            ElementNumber::Stiffness => Some(&mut self.stiffness),
            ElementNumber::Damping => Some(&mut self.damping),
            ElementNumber::Limit => Some(&mut self.limit),
            ElementNumber::Target | ElementNumber::TargetRate => {
                if !matches!(self.target, Some(Drive::Constant { .. })) {
                    self.target = Some(Drive::Constant { position: 0.0, velocity: 0.0 });
                }
                match &mut self.target {
                    Some(Drive::Constant { position, velocity }) => {
                        Some(if number == ElementNumber::Target { position } else { velocity })
                    }
                    _ => None,
                }
            }
            _ => None,
        }
    }
}
