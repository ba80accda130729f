//! Search for peaks inside a step, which is sampled as for an output row.

use super::Stepping;
use crate::simulate::peaks::PenetrationCubic;

/// A step whose forces stay below this fraction of their peaks so far is not searched.
pub(super) const NEAR_PEAK: f64 = 0.5;
/// Fractions at which a fixed step is sampled.
const PARTS: [f64; 3] = [0.25, 0.5, 0.75];

impl Stepping<'_> {
    /// Records the reactions at the end of the step just accepted and fully evaluated. Without contacts they are smooth, and
    /// their peaks lie on the parabola through three step ends.
    pub(super) fn track_reactions(&mut self) {
        let smooth = self.mechanism.contacts.is_empty();
        for j in 0..self.state.joints.len() {
            let Some(reaction) = self.mechanism.reaction(j) else {
                continue;
            };
            let (size, time) = (reaction.norm(), self.state.now.t);
            let vertex = self.state.joints[j].reaction.push_and_find_peak(time, size);
            self.take_reaction(j, if smooth { vertex } else { size }, time);
        }
    }

    /// Finds the largest normal force of every contact over the step just accepted, and its step fraction, from the
    /// penetration cubic; no force where none can come near a peak so far. A peak inside a located step is re-evaluated there: the
    /// cubic's rate, which sets the damping, differs from that of the motion.
    pub(super) fn find_peak_forces(&mut self, h: f64) {
        let (located, rounding) = (self.locates(), self.rounding());
        for c in 0..self.state.now.gaps.len() {
            let contact_state = self.before.contact_states[c].unfrozen();
            if !contact_state.active {
                continue;
            }
            let cubic = PenetrationCubic::new(self.before.gaps[c], self.state.now.gaps[c], h, rounding);
            let law = *self.mechanism.contacts.coefficients(c);
            let j = self.mechanism.contacts.joint_of(c);
            let run_peak = self.state.record.statistics.joints[j].peak_normal;
            let least = run_peak.min(self.state.joints[j].peak.normal).min(self.state.record.impacts.peak_under_way(c));
            if cubic.force_bound(&law, &contact_state) <= least.min(NEAR_PEAK * run_peak) {
                self.attempt.peak_forces[c] = (0.0, 1.0);
                continue;
            }
            let (force, theta) = cubic.strongest(&law, &contact_state);
            self.attempt.peak_forces[c] = (force, theta);
            if !located || theta <= 0.0 || theta >= 1.0 || force <= least {
                continue;
            }
            self.evaluate_at(self.before.t + theta * h);
            let inside = self.mechanism.contacts.gap(c).normal_force;
            let ends = cubic.stronger_end(&law, &contact_state);
            self.attempt.peak_forces[c] = if inside > ends.0 { (inside, theta) } else { ends };
        }
    }

    /// Searches the step just accepted for peaks.
    pub(super) fn search_peaks(&mut self) {
        self.attempt.is_near_peak = std::mem::take(&mut self.attempt.may_contain_peak);
        self.search_contacts();
        self.search_reactions();
        self.state.record.impacts.end_step(&mut self.attempt.events);
    }

    /// Samples a fixed step near a contact peak: if the step is long compared with an impact, an output row inside it sees other
    /// rates than the penetration cubic.
    fn search_contacts(&mut self) {
        if !self.attempt.is_near_peak || self.locates() {
            return;
        }
        let (t0, t) = (self.before.t, self.state.now.t);
        for part in PARTS {
            let time = t0 + part * (t - t0);
            self.evaluate_at(time);
            for j in 0..self.state.joints.len() {
                if let Some(reaction) = self.mechanism.reaction(j) {
                    self.take_reaction(j, reaction.norm(), time);
                }
                for c in self.mechanism.contacts.of_joint(j) {
                    let gap = self.mechanism.contacts.gap(c);
                    let (push, size) = (self.mechanism.contacts.push(c), gap.normal_force);
                    self.state.record.impacts.raise_peak(c, size, push, time);
                    if self.is_peak(j, size, time) {
                        self.state.joints[j].peak.normal_force = push * size;
                    }
                }
            }
        }
    }

    /// Searches the step just accepted for peaks of reactions caused by impacts at other joints. Steps around an impact are
    /// too uneven for a parabola through their ends: it would have spurious peaks.
    fn search_reactions(&mut self) {
        if !self.mechanism.has_reactions() || self.mechanism.contacts.is_empty() {
            return;
        }
        let (t0, t) = (self.before.t, self.state.now.t);
        for j in 0..self.state.joints.len() {
            let Some((start, end)) = self.state.joints[j].reaction.ends(t0, t) else {
                continue;
            };
            if start.max(end) <= NEAR_PEAK * self.state.record.statistics.joints[j].peak_normal {
                continue;
            }
            let middle = self.reaction_at(j, 0.5 * (t0 + t));
            let curvature = start - 2.0 * middle + end;
            // Vertex of the parabola through the three.
            let theta = 0.5 + 0.25 * (start - end) / curvature;
            if curvature < 0.0 && theta > 0.0 && theta < 1.0 {
                self.reaction_at(j, t0 + theta * (t - t0));
            }
        }
    }

    /// Magnitude of the reaction of joint `j` at `time` within the latest step, N; recorded if it is a peak.
    fn reaction_at(&mut self, j: usize, time: f64) -> f64 {
        self.evaluate_at(time);
        let size = self.mechanism.reaction(j).map_or(0.0, |force| force.norm());
        self.take_reaction(j, size, time);
        size
    }

    fn take_reaction(&mut self, j: usize, size: f64, time: f64) {
        if self.is_peak(j, size, time)
            && let Some(reaction) = self.mechanism.reaction(j)
        {
            self.state.joints[j].peak.normal_force = reaction;
        }
    }

    /// Records a force if it is the largest so far; returns whether it is the largest since the peaks were last taken.
    fn is_peak(&mut self, j: usize, size: f64, time: f64) -> bool {
        let statistics = &mut self.state.record.statistics;
        if size > statistics.joints[j].peak_normal {
            statistics.joints[j].peak_normal = size;
            statistics.joints[j].peak_time = time;
        }
        let peak = &mut self.state.joints[j].peak;
        let largest = size > peak.normal;
        if largest {
            (peak.normal, peak.time) = (size, time);
        }
        largest
    }
}
