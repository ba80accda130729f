//! The largest loads of force elements and of all joints except those with play.

use serde::{Deserialize, Serialize};

use crate::machine::{JointKind, Machine, Vec3};
use crate::mechanism::Mechanism;

/// Largest magnitude of a force, N, or of a torque, N m, and its time, s; `None` if there is no such load.
pub type LoadPeak = Option<(f64, f64)>;

/// Largest force and torque of each force element, each tree joint except free ones, and each loop-closing joint, in scene order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadPeaks {
    parts: Vec<[LoadPeak; 2]>,
    /// Time of the latest step end at which loads were recorded, s.
    seen: f64,
    actuators: Vec<f64>,
}

impl LoadPeaks {
    pub(super) fn new(machine: &Machine) -> Self {
        let holding = machine.joints.iter().filter(|joint| joint.kind != JointKind::Free);
        let parts = machine.elements.len() + holding.count() + machine.closing_joints.len();
        Self { parts: vec![[None; 2]; parts], seen: 0.0, actuators: vec![0.0; machine.driven().count()] }
    }

    /// Force and torque of each part.
    pub fn parts(&self) -> &[[LoadPeak; 2]] {
        &self.parts
    }

    /// Time since loads were last recorded at the end of a step, s.
    pub(super) fn age(&self, time: f64) -> f64 {
        time - self.seen
    }

    /// Whether these fit the same scene as `own`.
    pub(super) fn fits(&self, own: &Self) -> bool {
        self.parts.len() == own.parts.len() && self.actuators.len() == own.actuators.len()
    }

    /// Records the loads at the step end `time`, where everything has just been evaluated.
    pub(super) fn evaluate(&mut self, mechanism: &mut Mechanism, time: f64) {
        self.seen = time;
        mechanism.actuator_forces(&mut self.actuators);
        self.record(mechanism, time);
    }

    /// Records the loads at `time` after [`Mechanism::actuator_forces`].
    pub(super) fn record(&mut self, mechanism: &mut Mechanism, time: f64) {
        let mut parts = self.parts.iter_mut();
        let mut update = |loads: [Option<Vec3>; 2]| {
            let part = parts.next().expect("a peak for each part");
            for (peak, load) in part.iter_mut().zip(loads) {
                let size = load.map(|load| load.norm());
                if let Some(size) = size.filter(|size| peak.is_none_or(|(largest, _)| *size > largest)) {
                    *peak = Some((size, time));
                }
            }
        };
        mechanism.element_reports(time).for_each(|element| update([element.own_force(), element.torque]));
        mechanism.joint_reactions().for_each(|load| update(load.map(Some)));
        mechanism.closing_loads().for_each(|load| update(load.map(Some)));
    }
}
