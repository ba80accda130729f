//! Peak loads of force elements and of joints without play, in words and as JSON.

use serde_json::{Map, Value as Json, json};

use crate::machine::JointKind;
use crate::simulate::{LoadPeak, Simulation};
use crate::units::significant;

/// Units of force and torque, with the summary keys of the peak value and its time.
const LOADS: [(&str, &str, &str); 2] =
    [("N", "peak_force_N", "peak_force_time_s"), ("N m", "peak_torque_Nm", "peak_torque_time_s")];

/// An element or a joint with the peaks of its force and its torque.
pub struct Part<'a> {
    /// Kind of part and its name.
    pub label: String,
    name: &'a str,
    kind: &'static str,
    peaks: [LoadPeak; 2],
    /// Peaks up to these are rounding errors, N and N m.
    rounding: [f64; 2],
}

/// A peak below this fraction of the largest peak of all parts is a rounding error.
const ROUNDING: f64 = 1e-12;

impl Part<'_> {
    /// Kind and peaks, in words.
    pub fn description(&self) -> String {
        let reported = self.peaks.iter().zip(self.rounding).zip(LOADS);
        let reported =
            reported.filter_map(|((peak, least), (unit, ..))| Some((peak.filter(|(size, _)| *size > least)?, unit)));
        let words: Vec<String> = reported
            .map(|((size, time), unit)| format!("{} {unit} at {} s", significant(size, 6), significant(time, 6)))
            .collect();
        let peaks = if words.is_empty() { "no force".to_owned() } else { format!("peak {}", words.join(", ")) };
        format!("{}, {peaks}", self.kind)
    }
}

/// All parts whose peaks `simulation` records.
pub fn parts(simulation: &Simulation) -> Vec<Part<'_>> {
    let machine = simulation.machine();
    let elements = machine.elements.iter().map(|element| ("Element", &element.name, element.describe().word));
    let constraining = machine.joints.iter().filter(|joint| joint.kind != JointKind::Free);
    let joints = constraining.chain(&machine.closing_joints).map(|joint| ("Joint", &joint.name, joint.kind.word()));
    let peaks = simulation.load_peaks().map_or(&[][..], |peaks| peaks.parts());
    let largest = |i: usize| peaks.iter().filter_map(|part| part[i]).fold(0.0, |most, (size, _)| size.max(most));
    let rounding = [0, 1].map(|i| ROUNDING * largest(i));
    let all = elements.chain(joints).zip(peaks);
    all.map(|((title, name, kind), &peaks)| Part { label: format!("{title} {name}"), name, kind, peaks, rounding })
        .collect()
}

/// Adds the peaks to a summary, by name.
pub fn describe(simulation: &Simulation, facts: &mut Map<String, Json>) {
    let parts = parts(simulation);
    for (i, (_, value, time)) in LOADS.into_iter().enumerate() {
        let known = || parts.iter().filter_map(|part| Some((part.name.to_owned(), part.peaks[i]?)));
        facts.insert(value.into(), known().map(|(name, (size, _))| (name, json!(size))).collect());
        facts.insert(time.into(), known().map(|(name, (_, when))| (name, json!(when))).collect());
    }
}
