//! Values recorded for a scene: plot channels and columns of `run`, all derived from one table.

mod choice;
mod table;

pub use choice::{ChannelInfo, UnknownChannel, channels_of, chosen_channels, matches_pattern, matching};
pub use table::Quantity;
use table::TIME;

use super::Frame;
use crate::machine::{Freedom, Joint, JointKind, LooseJoint, LooseKind, Machine, Place};
use std::borrow::Cow;
use table::{Repetition, Signal, SignalSource, TABLE};

/// Largest number of joints with play and drives that are recorded: in a longer chain the rest is not worth the memory.
pub const RECORDED_JOINTS: usize = 12;

/// Largest number of channels picked by name: each costs as much memory as any other.
pub const MAX_PICKED: usize = 32;

/// Where a value is found in a frame.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    source: SignalSource,
    part: usize,
    component: usize,
}

impl Reading {
    /// The value, SI units; `None` where `frame` does not have it.
    #[inline]
    pub fn read(&self, frame: &Frame) -> Option<f64> {
        self.source.value(frame, self.part, self.component)
    }

    /// Requests the value from `frame`, if frames contain it only on request.
    pub fn request(&self, frame: &mut Frame) {
        if matches!(self.source, SignalSource::Reaction(_)) {
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
    picked: Vec<ChannelInfo>,
}

impl Channels {
    /// The channels of `machine`.
    pub fn of(machine: &Machine) -> Self {
        let mut list = Vec::new();
        let in_plots = |signal: &Signal| signal.plot.map(|_| 0);
        lay_out(machine, None, RECORDED_JOINTS, in_plots, |value| {
            list.extend(value.signal.plot.map(|quantity| Channel {
                quantity,
                member: value.member.to_owned(),
                column: value.column,
                reading: value.reading,
            }));
        });
        Self { list, picked: Vec::new() }
    }

    /// Picks the channels of `machine` that match `patterns`, replacing earlier picks; `first` as in [`channels_of`].
    pub fn pick(&mut self, machine: &Machine, first: &Frame, patterns: &[String]) {
        self.picked.clear();
        if patterns.is_empty() {
            return;
        }
        self.picked = channels_of(machine, first);
        let matches = |channel: &ChannelInfo| patterns.iter().any(|p| channel.is_matched_by(p));
        self.picked.retain(|channel| channel.name != TIME && matches(channel));
        self.picked.truncate(MAX_PICKED);
    }

    /// The channels picked by name.
    pub fn picked(&self) -> &[ChannelInfo] {
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

    /// Index of the normal force of joint with play `joint`, if it is recorded.
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
    pub fn request(&self, frame: &mut Frame) {
        frame.reactions = None;
        self.picked.iter().for_each(|channel| channel.reading.request(frame));
    }

    /// Appends the values of the picked channels to `out`, in the manner of [`Self::read`].
    pub fn read_picked(&self, frame: &Frame, out: &mut Vec<f64>) {
        let value = |channel: &ChannelInfo| channel.reading.read(frame).unwrap_or(f64::NAN);
        out.extend(self.picked.iter().map(value));
    }

    /// Reads every channel except the picked ones from `frame` into `out`, SI units; NaN where the frame has no value.
    pub fn read(&self, frame: &Frame, out: &mut Vec<f64>) {
        out.clear();
        let value = |channel: &Channel| channel.reading.read(frame).unwrap_or(f64::NAN);
        out.extend(self.list.iter().map(value));
    }
}

/// One value of a signal.
struct SignalValue<'a> {
    signal: &'a Signal,
    member: &'a str,
    name: String,
    column: String,
    reading: Reading,
}

/// Calls `add` with the values of all signals that have a place, in order of place. Signals that share a place and are repeated
/// for the same parts are laid out part by part. Only the first `max_parts` parts are used.
fn lay_out(
    machine: &Machine,
    first: Option<&Frame>,
    max_parts: usize,
    place: impl Fn(&Signal) -> Option<u8>,
    mut add: impl FnMut(SignalValue<'_>),
) {
    let has = |signal: &&Signal| place(signal).is_some() && signal.of.is_in(machine);
    let mut signals: Vec<&Signal> = TABLE.iter().filter(has).collect();
    signals.sort_by_key(|signal| place(signal));
    let key = |signal: &Signal| (place(signal), signal.source.repetition());
    for group in signals.chunk_by(|a, b| key(a) == key(b)) {
        let parts = parts_of(machine, group[0].source.repetition());
        for (part, (name, freedom)) in parts.into_iter().take(max_parts).enumerate() {
            let exists = |signal: &&&Signal| has_signal(machine, first, signal, part, freedom);
            for signal in group.iter().filter(exists) {
                let source = signal.source;
                for (component, &(symbol, word)) in source.components().iter().enumerate() {
                    let members = [source.member(), symbol, &*name];
                    let named = |pattern: &str| pattern.replace('#', word).replace('@', &name);
                    add(SignalValue {
                        signal,
                        name: named(signal.name),
                        member: members.into_iter().find(|m| !m.is_empty()).unwrap_or_default(),
                        column: named(signal.column),
                        reading: Reading { source, part, component },
                    });
                }
            }
        }
    }
}

/// Names of the parts for which a signal is repeated; for a joint coordinate also the freedom that it measures.
fn parts_of(machine: &Machine, repetition: Repetition) -> Vec<(Cow<'_, str>, Option<Freedom>)> {
    let elements = machine.elements.iter().map(|element| element.name.as_str());
    let coordinates = |joint: &'_ Joint| joint.kind.freedoms().iter().map(|freedom| Some(*freedom));
    let holding = machine.joints.iter().filter(|j| j.kind != JointKind::Free);
    let bodies = machine.bodies.iter().map(|body| body.name.as_str());
    match repetition {
        Repetition::Once => vec![("".into(), None)],
        Repetition::Output => vec![(machine.bodies[machine.output.body].name.as_str().into(), None)],
        Repetition::Body => bodies.map(|name| (name.into(), None)).collect(),
        Repetition::Coordinate => machine
            .kinematic_joints()
            .flat_map(|j| coordinates(j).map(|freedom| (j.name.as_str().into(), freedom)))
            .collect(),
        Repetition::Reacting => holding.map(|j| (j.name.as_str().into(), None)).collect(),
        Repetition::Closing => {
            let closing = machine.closing_joints.iter();
            closing.map(|joint| (joint.name.as_str().into(), None)).collect()
        }
        Repetition::Joint => machine.loose_joints.iter().map(|joint| (joint.name.as_str().into(), None)).collect(),
        Repetition::Site => {
            let sites = |joint: &'_ LooseJoint| 0..joint.kind.site_names().len() as u8;
            let names = machine.loose_joints.iter().flat_map(|j| sites(j).map(|place| j.site_name(place)));
            names.map(|name| (name.into(), None)).collect()
        }
        Repetition::Drive => machine.driven().map(|(j, freedom)| (j.name.as_str().into(), Some(freedom))).collect(),
        Repetition::Element => elements.map(|name| (name.into(), None)).collect(),
    }
}

/// Whether `machine` has `signal` for part `part`; without a `first` frame, whether it may have it.
fn has_signal(
    machine: &Machine,
    first: Option<&Frame>,
    signal: &Signal,
    part: usize,
    freedom: Option<Freedom>,
) -> bool {
    let source = signal.source;
    let known = |may_have: bool| first.map_or(may_have, |f| source.value(f, part, 0).is_some());
    match source {
        SignalSource::Slide | SignalSource::SlideCoordinate(_) => freedom == Some(Freedom::Slide),
        SignalSource::HingeCoordinate(0) if freedom == Some(Freedom::TurnOfSlide) => true,
        SignalSource::Hinge | SignalSource::HingeCoordinate(_) => freedom == Some(Freedom::Turn),
        SignalSource::TurnRate => freedom == Some(Freedom::TurnOfSlide),
        SignalSource::Turn => matches!(freedom, Some(Freedom::TurnOfSlide | Freedom::FirstTurn)),
        SignalSource::ChildTurn => freedom == Some(Freedom::SecondTurn),
        SignalSource::FirstTurn(_) => freedom == Some(Freedom::FirstTurn),
        SignalSource::SecondTurn(_) => freedom == Some(Freedom::SecondTurn),
        SignalSource::OtherAxes(_) | SignalSource::OtherAngles(_) => part != machine.output.body,
        SignalSource::Supplied(..) | SignalSource::Consumed(..) => known(machine.solver.energy_ledger),
        SignalSource::ProbeError | SignalSource::ProbeDistance => known(machine.output.probe.is_some()),
        SignalSource::Displacement(_) => machine.loose_joints[part].kind != LooseKind::Ball,
        SignalSource::Element(_) => known(true),
        SignalSource::ElementValue(_) => matches!(machine.elements[part].describe().place, Place::Between(_)),
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_plot_has_a_signal_and_all_columns_differ() {
        for quantity in Quantity::ALL {
            let mut plots = TABLE.iter().filter_map(|signal| signal.plot);
            assert!(plots.any(|plot| plot == quantity), "{quantity:?}");
        }
        let unnamed = TABLE.iter().filter(|signal| signal.name.is_empty());
        assert_eq!(unnamed.count(), 1, "only what frames do not contain");
        for in_run in [false, true] {
            let is_listed = |signal: &&Signal| {
                if in_run { signal.run.is_some() } else { signal.plot.is_some() }
            };
            let mut columns: Vec<(&str, usize)> = TABLE
                .iter()
                .filter(is_listed)
                .map(|signal| (signal.column, signal.source.repetition() as usize))
                .collect();
            let all = columns.len();
            columns.sort_unstable();
            columns.dedup();
            assert_eq!(columns.len(), all);
        }
    }
}
