//! Values recorded for a scene: plot channels and columns of `run`, all laid out from one table.

mod choice;
mod table;

pub use choice::{Listed, NoChannel, channels_of, chosen_columns, matches_pattern, matching};
use table::TIME;
pub use table::{PLOT_WORDS, PlotKind, Quantity};

use super::Frame;
use crate::machine::{Freedom, Joint, JointKind, Machine};
use table::{Each, Signal, TABLE, Take};

/// Largest number of ball joints and drives that are recorded: in a longer chain the rest is not worth the memory.
pub const RECORDED_JOINTS: usize = 12;

/// Largest number of channels picked by name: each costs as much memory as any other.
pub const MOST_PICKED: usize = 32;

/// Where a value is found in a frame.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    take: Take,
    part: usize,
    component: usize,
}

impl Reading {
    /// The value, SI units; `None` where `frame` does not have it.
    #[inline]
    pub fn read(&self, frame: &Frame) -> Option<f64> {
        self.take.value(frame, self.part, self.component)
    }

    /// Requests the value from `frame`, if frames contain it only on request.
    pub fn ask(&self, frame: &mut Frame) {
        if matches!(self.take, Take::Reaction(_)) {
            frame.reactions.get_or_insert_default();
        }
    }
}

/// One recorded series.
#[derive(Clone, Debug)]
pub struct Channel {
    /// What it measures.
    pub quantity: Quantity,
    /// Which member: a joint's name, an axis, a kind of energy.
    pub member: String,
    column: String,
    reading: Reading,
}

impl PartialEq for Channel {
    /// Quantity and member identify a channel; where it is read follows from them.
    fn eq(&self, other: &Self) -> bool {
        (self.quantity, &self.member) == (other.quantity, &other.member)
    }
}

impl Channel {
    /// Name of its column in a file, with the SI unit: the same as the `run` column of the quantity.
    pub fn column(&self) -> &str {
        &self.column
    }
}

/// The channels of one scene, in the order in which [`Channels::read`] writes them.
#[derive(Clone, Debug, Default)]
pub struct Channels {
    list: Vec<Channel>,
    picked: Vec<Listed>,
}

impl Channels {
    /// The channels of `machine`.
    pub fn of(machine: &Machine) -> Self {
        let mut list = Vec::new();
        let in_plots = |signal: &Signal| signal.plot.map(|_| 0);
        lay_out(machine, None, RECORDED_JOINTS, in_plots, |found| {
            list.extend(found.signal.plot.map(|quantity| Channel {
                quantity,
                member: found.member.to_owned(),
                column: found.column,
                reading: found.reading,
            }));
        });
        Self { list, picked: Vec::new() }
    }

    /// Picks the channels of `machine` that match `patterns`, replacing earlier picks; `first` as in [`run_columns`].
    pub fn pick(&mut self, machine: &Machine, first: &Frame, patterns: &[String]) {
        self.picked.clear();
        if patterns.is_empty() {
            return;
        }
        self.picked = channels_of(machine, first);
        let matches = |channel: &Listed| patterns.iter().any(|p| channel.is_chosen_by(p));
        self.picked.retain(|channel| channel.name != TIME && matches(channel));
        self.picked.truncate(MOST_PICKED);
    }

    /// The channels picked by name.
    pub fn picked(&self) -> &[Listed] {
        &self.picked
    }

    /// The channels in order, without the picked ones.
    pub fn list(&self) -> &[Channel] {
        &self.list
    }

    /// Number of channels, without the picked ones.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there are no channels, apart from picked ones.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Index of the normal force of ball joint `joint`, if it is recorded.
    pub fn normal_force(&self, joint: usize) -> Option<usize> {
        let own = |c: &Channel| c.quantity == Quantity::NormalForce && c.reading.part == joint;
        self.list.iter().position(own)
    }

    /// Index of the tip error, which frames do not contain.
    pub fn tip_error(&self) -> usize {
        let own = |c: &Channel| c.quantity == Quantity::TipError;
        self.list.iter().position(own).unwrap_or_default()
    }

    /// Makes `frame` request the picked channels and nothing else.
    pub fn ask(&self, frame: &mut Frame) {
        frame.reactions = None;
        self.picked.iter().for_each(|channel| channel.reading.ask(frame));
    }

    /// Appends the values of the picked channels to `out`, in the manner of [`Self::read`].
    pub fn read_picked(&self, frame: &Frame, out: &mut Vec<f64>) {
        let value = |channel: &Listed| channel.reading.read(frame).unwrap_or(f64::NAN);
        out.extend(self.picked.iter().map(value));
    }

    /// Reads every channel except the picked ones from `frame` into `out`, SI units; NaN where the frame has no value.
    pub fn read(&self, frame: &Frame, out: &mut Vec<f64>) {
        out.clear();
        let value = |channel: &Channel| channel.reading.read(frame).unwrap_or(f64::NAN);
        out.extend(self.list.iter().map(value));
    }
}

/// Names and readings of the columns of `run`, in order. The frame `first` shows whether the machine has a tip error and a
/// ledger, and what its elements report.
pub fn run_columns(machine: &Machine, first: &Frame) -> (Vec<String>, Vec<Reading>) {
    let (mut names, mut readings) = (Vec::new(), Vec::new());
    let in_run = |signal: &Signal| signal.run;
    lay_out(machine, Some(first), usize::MAX, in_run, |found| {
        names.push(found.column);
        readings.push(found.reading);
    });
    (names, readings)
}

/// One value of a signal.
struct Found<'a> {
    signal: &'a Signal,
    member: &'a str,
    name: String,
    column: String,
    reading: Reading,
}

/// Calls `add` with the values of all signals that have a place, in order of place. Signals that share a place and are repeated
/// for the same parts are laid out part by part. Only the first `most` parts are used.
fn lay_out(
    machine: &Machine,
    first: Option<&Frame>,
    most: usize,
    place: impl Fn(&Signal) -> Option<u8>,
    mut add: impl FnMut(Found<'_>),
) {
    let mut signals: Vec<&Signal> = TABLE.iter().filter(|s| place(s).is_some()).collect();
    signals.sort_by_key(|signal| place(signal));
    let key = |signal: &Signal| (place(signal), signal.take.each());
    for group in signals.chunk_by(|a, b| key(a) == key(b)) {
        let parts = parts_of(machine, group[0].take.each());
        for (part, (name, freedom)) in parts.into_iter().take(most).enumerate() {
            let here = |signal: &&&Signal| has(machine, first, signal, part, freedom);
            for signal in group.iter().filter(here) {
                let take = signal.take;
                for (component, &(symbol, word)) in take.components().iter().enumerate() {
                    let members = [take.member(), symbol, name];
                    let named = |pattern: &str| pattern.replace('#', word).replace('@', name);
                    add(Found {
                        signal,
                        name: named(signal.name),
                        member: members.into_iter().find(|m| !m.is_empty()).unwrap_or_default(),
                        column: named(signal.column),
                        reading: Reading { take, part, component },
                    });
                }
            }
        }
    }
}

/// Names of the parts for which a signal is repeated; for a joint coordinate also the freedom that it measures.
fn parts_of(machine: &Machine, each: Each) -> Vec<(&str, Option<Freedom>)> {
    let joints = machine.ball_joints.iter().map(|joint| joint.name.as_str());
    let elements = machine.elements.iter().map(|element| element.name.as_str());
    let coordinates = |joint: &'_ Joint| joint.kind.freedoms().iter().map(|freedom| Some(*freedom));
    let holding = machine.joints.iter().filter(|j| j.kind != JointKind::Free);
    let bodies = machine.bodies.iter().map(|body| body.name.as_str());
    match each {
        Each::Once => vec![("", None)],
        Each::Output => vec![(machine.bodies[machine.output.body].name.as_str(), None)],
        Each::Body => bodies.map(|name| (name, None)).collect(),
        Each::Coordinate => {
            machine.kinematic_joints().flat_map(|j| coordinates(j).map(|freedom| (j.name.as_str(), freedom))).collect()
        }
        Each::Holding => holding.map(|j| (j.name.as_str(), None)).collect(),
        Each::Closing => {
            let closing = machine.closing_joints.iter();
            closing.map(|joint| (joint.name.as_str(), None)).collect()
        }
        Each::Joint => joints.map(|name| (name, None)).collect(),
        Each::Drive => machine.driven().map(|(j, freedom)| (j.name.as_str(), Some(freedom))).collect(),
        Each::Element => elements.map(|name| (name, None)).collect(),
    }
}

/// Whether `machine` has `signal` for part `part`; without a `first` frame, whether it may have it.
fn has(machine: &Machine, first: Option<&Frame>, signal: &Signal, part: usize, freedom: Option<Freedom>) -> bool {
    let take = signal.take;
    let known = |may_have: bool| first.map_or(may_have, |f| take.value(f, part, 0).is_some());
    match take {
        Take::Slide | Take::SlideCoordinate(_) => freedom == Some(Freedom::Slide),
        Take::HingeCoordinate(0) if freedom == Some(Freedom::TurnOfSlide) => true,
        Take::Hinge | Take::HingeCoordinate(_) => freedom == Some(Freedom::Turn),
        Take::TurnRate => freedom == Some(Freedom::TurnOfSlide),
        Take::Turn => matches!(freedom, Some(Freedom::TurnOfSlide | Freedom::FirstTurn)),
        Take::ChildTurn => freedom == Some(Freedom::SecondTurn),
        Take::FirstTurn(_) => freedom == Some(Freedom::FirstTurn),
        Take::SecondTurn(_) => freedom == Some(Freedom::SecondTurn),
        Take::OtherAxes(_) | Take::OtherAngles(_) => part != machine.output.body,
        Take::Given(..) | Take::Taken(..) => {
            known(machine.solver.energy_ledger) && (!signal.of_elements || !machine.elements.is_empty())
        }
        Take::ProbeError | Take::ProbeDistance => known(machine.output.probe.is_some()),
        Take::Element(_) => known(true),
        Take::ElementValue(_) => machine.elements[part].is_between_points(),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn every_plot_has_a_signal_and_no_two_signals_have_one_column() {
        for quantity in Quantity::ALL {
            let mut plots = TABLE.iter().filter_map(|signal| signal.plot);
            assert!(plots.any(|plot| plot == quantity), "{quantity:?}");
        }
        for in_run in [false, true] {
            let here = |signal: &&Signal| {
                if in_run { signal.run.is_some() } else { signal.plot.is_some() }
            };
            let mut columns: Vec<(&str, usize)> =
                TABLE.iter().filter(here).map(|signal| (signal.column, signal.take.each() as usize)).collect();
            let all = columns.len();
            columns.sort_unstable();
            columns.dedup();
            assert_eq!(columns.len(), all);
        }
    }

    #[test]
    fn readers_that_know_columns_by_their_place_find_them() {
        let text = crate::scene::built_in_text("slider-crank-driven").expect("built in");
        let load = "[[load]]\nname = \"wind\"\non = { body = \"rod\" }\nforce = \"1 0 0 N\"\n";
        let scene = Scene::parse(&format!("{text}\n{load}"), None, &[]).expect("reads");
        let mut first = Frame::default();
        let mut simulation = crate::simulate::Simulation::new(&scene.machine).expect("starts");
        simulation.sample(0.0, &mut first);
        let (names, readings) = run_columns(&scene.machine, &first);
        let last = "drive_work_J,gravity_work_J,restitution_loss_J,friction_loss_J,clearance_work_J,energy_residual_J,\
                    wind_force_x_N,wind_force_y_N,wind_force_z_N,wind_torque_x_Nm,wind_torque_y_Nm,wind_torque_z_Nm,\
                    damping_loss_J,external_work_J";
        assert!(names.join(",").ends_with(last), "{names:?}");
        assert_eq!(names.len(), readings.len());
        let known = |reading: &Reading| reading.read(&first).is_some_and(f64::is_finite);
        assert!(readings.iter().all(known));
    }
}
