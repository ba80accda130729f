//! Ideal motion with which a probe is compared. If it has no closed form, the same machine with every ball joint ideal is
//! simulated alongside.

use serde::{Deserialize, Serialize};

use super::{IdealModel, IdealSource, IdealState, IdealWorkspace, Model, StateMismatch, Stepping};
use crate::integrate::Method;
use crate::machine::{AppliedForces, Formulation, Machine, StartRule, Vec3};
use crate::simulate::{Frame, StartError, Stopped};

/// Tolerance of the ideal motion: without impacts, accuracy is cheap.
const TOLERANCE: f64 = 1e-10;
/// First step, s.
const FIRST_STEP: f64 = 1e-4;
/// Number of latest step ends stored. Both motions step at most 10 ms, so that samples within a step lie among them.
const STORED_TIPS: usize = 64;

/// Why a probe has no ideal motion to be compared with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProbeFault {
    /// The ideal mechanism cannot start.
    #[error("cannot start: {0}")]
    NoStart(StartError),
    /// It could not continue.
    #[error("{0}")]
    Stopped(Stopped),
}

/// Tip at the end of a step: position, velocity and acceleration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct TipSample {
    time: f64,
    tip: [Vec3; 3],
}

/// Tip at the latest step ends, and why the motion stopped, if it did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct TipHistory {
    /// Ring buffer.
    ring: Vec<TipSample>,
    count: usize,
    /// Why it stopped.
    stopped: Option<Stopped>,
}

impl IdealSource {
    /// Chooses the source for `machine`; `closed_form` if its mechanism knows the ideal motion in closed form.
    pub(super) fn of(machine: &Machine, closed_form: bool) -> Self {
        let Some(probe) = machine.output.probe.filter(|_| !closed_form) else {
            return Self::ClosedForm;
        };
        if machine.loose_joints.iter().all(|j| j.contact.is_ideal()) {
            return Self::SelfReference;
        }
        match Model::new(&closed(machine)) {
            Ok(model) => Self::Simulated(Box::new(IdealModel { model, body: machine.output.body, probe })),
            Err(error) => Self::None(error),
        }
    }

    /// The model that is simulated alongside, if any.
    pub(super) fn simulated(&self) -> Option<&IdealModel> {
        match self {
            Self::Simulated(ideal) => Some(ideal),
            Self::ClosedForm | Self::SelfReference | Self::None(_) => None,
        }
    }

    /// The state alongside at t = 0, if there is one.
    pub(super) fn start(&self) -> Option<Box<IdealState>> {
        self.simulated().map(|ideal| Box::new(ideal.start()))
    }

    /// Why there is no ideal motion, if it failed; `state` is that alongside.
    pub(super) fn fault(&self, state: Option<&IdealState>) -> Option<ProbeFault> {
        match self {
            Self::ClosedForm | Self::SelfReference => None,
            Self::None(error) => Some(ProbeFault::NoStart(error.clone())),
            Self::Simulated(_) => state?.tips.stopped.clone().map(ProbeFault::Stopped),
        }
    }
}

impl IdealModel {
    fn start(&self) -> IdealState {
        let mut state = IdealState {
            state: self.model.start(),
            tips: TipHistory { ring: vec![TipSample::default(); STORED_TIPS], count: 0, stopped: None },
        };
        let mut work = self.workspace(&state);
        self.record_tip(&mut state, &mut work);
        state
    }

    pub(super) fn workspace(&self, state: &IdealState) -> Box<IdealWorkspace> {
        Box::new(IdealWorkspace { workspace: self.model.workspace(&state.state), frame: Frame::default() })
    }

    /// Records the current tip.
    fn record_tip(&self, state: &mut IdealState, work: &mut IdealWorkspace) {
        let IdealWorkspace { workspace, frame } = work;
        let time = state.state.time();
        self.model.sample(&mut state.state, workspace, time, frame);
        let body = &frame.bodies[self.body];
        let (arm, w) = (body.rotation * self.probe, body.angular_velocity);
        let acceleration = body.acceleration + body.angular_acceleration.cross(&arm) + w.cross(&w.cross(&arm));
        let velocity = body.velocity + w.cross(&arm);
        let tips = &mut state.tips;
        tips.ring[tips.count % STORED_TIPS] =
            TipSample { time: frame.time, tip: [body.position + arm, velocity, acceleration] };
        tips.count += 1;
    }

    /// The tip at `time`, m; `None` before the oldest sample, and after the motion stopped.
    fn tip(&self, state: &mut IdealState, work: &mut IdealWorkspace, time: f64) -> Option<Vec3> {
        while state.state.time() < time && state.tips.stopped.is_none() {
            match self.model.step(&mut state.state, &mut work.workspace) {
                Ok(()) => self.record_tip(state, work),
                Err(stopped) => state.tips.stopped = Some(stopped),
            }
        }
        state.tips.tip(time)
    }

    /// Tip in `frame` minus the ideal tip at its time, m.
    pub(super) fn error(&self, state: &mut IdealState, work: &mut IdealWorkspace, frame: &Frame) -> Option<Vec3> {
        let body = &frame.bodies[self.body];
        let tip = body.position + body.rotation * self.probe;
        Some(tip - self.tip(state, work, frame.time)?)
    }

    /// Lets `forces` act from `time` on.
    pub(super) fn set_applied_forces(
        &self,
        state: &mut IdealState,
        work: &mut IdealWorkspace,
        time: f64,
        forces: &AppliedForces,
    ) {
        self.tip(state, work, time);
        let mut run = Stepping::new(&self.model, &mut state.state, &mut work.workspace);
        run.rewind_to(time);
        run.set_applied_forces(forces).expect("an explicit method takes any forces");
        // Samples after `time` are no longer valid.
        state.tips.forget_after(time);
        self.record_tip(state, work);
    }
}

impl IdealState {
    /// As [`State::bytes`](super::State::bytes).
    pub(super) fn bytes(&self) -> usize {
        self.state.bytes() + std::mem::size_of_val(&self.tips.ring[..])
    }

    /// Takes over the elements of `next`, which act in it already, after it was read.
    pub(super) fn adopt_elements(&mut self, own: &IdealModel, next: &Machine) {
        self.state.elements.adopt(&own.model.machine, next);
    }

    /// As [`Snapshot::with_elements_of`](super::Snapshot::with_elements_of).
    pub(super) fn share_elements(&mut self, written: &Self) {
        self.state.elements.share(&written.state.elements);
    }

    /// Checks a state that was read against its model.
    pub(super) fn check(&self, own: &IdealModel) -> Result<(), StateMismatch> {
        if self.tips.ring.len() != STORED_TIPS {
            return Err(StateMismatch);
        }
        own.model.check(&self.state)
    }
}

/// `machine` with every ball joint ideal, with the same drives and gravity, solved accurately enough to serve as a reference. It
/// has no probe.
pub fn closed(machine: &Machine) -> Machine {
    let mut ideal = machine.clone();
    for joint in &mut ideal.loose_joints {
        joint.contact = joint.contact.without_play();
    }
    // Balls may start off-centre in their play.
    ideal.start = StartRule::Ideal;
    ideal.formulation = Formulation::Tree;
    ideal.output.probe = None;
    ideal.solver.preset = None;
    ideal.solver.method = Method::DormandPrince5;
    ideal.solver.tolerance = TOLERANCE;
    ideal.solver.step = FIRST_STEP;
    ideal.solver.energy_ledger = false;
    ideal
}

impl TipHistory {
    fn tip(&self, time: f64) -> Option<Vec3> {
        let oldest = self.count.saturating_sub(STORED_TIPS);
        let at = |k: usize| &self.ring[k % STORED_TIPS];
        let newest = at(self.count.checked_sub(1)?);
        if time >= newest.time {
            return (time == newest.time).then_some(newest.tip[0]);
        }
        let before = (oldest..self.count).rev().find(|&k| at(k).time <= time)?;
        Some(quintic(at(before), at(before + 1), time))
    }

    fn forget_after(&mut self, time: f64) {
        while self.count > 1 && self.ring[(self.count - 1) % STORED_TIPS].time > time {
            self.count -= 1;
        }
    }
}

/// Quintic interpolation of positions, velocities and accelerations at both ends.
fn quintic(a: &TipSample, b: &TipSample, time: f64) -> Vec3 {
    let h = b.time - a.time;
    let s = (time - a.time) / h;
    let ([x0, v0, a0], [x1, v1, a1]) = (a.tip, b.tip);
    let (v0, v1, a0, a1) = (v0 * h, v1 * h, a0 * (h * h), a1 * (h * h));
    // Remainders at the end after subtracting the parabola from the start.
    let (x, v, c) = (x1 - x0 - v0 - a0 * 0.5, v1 - v0 - a0, a1 - a0);
    let (c3, c4, c5) = (x * 10.0 - v * 4.0 + c * 0.5, x * -15.0 + v * 7.0 - c, x * 6.0 - v * 3.0 + c * 0.5);
    x0 + (v0 + (a0 * 0.5 + (c3 + (c4 + c5 * s) * s) * s) * s) * s
}
