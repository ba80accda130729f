//! The slider "Worn for": clearances after hours of operation, extrapolated from the growth by wear in the last full period of the run.
//!
//! The slider counts from the clearances as they were set. What it extrapolates becomes a change of parameters like any other, so that
//! links, saved scenes and undo have it. The handle stands where the scene says: at the age of the run's scene if this slider made
//! exactly that scene, otherwise at 0. So a change by hand, undo or another scene leave no age that is untrue. A machine with walls that
//! wear by direction has no slider: no clearance says what they become.

use std::sync::Arc;

use eframe::egui::{self, Key, RichText, Slider, Ui};

use super::controls::panel_tooltip;
use super::player::Player;
use super::{keys, spoken, theme, value};
use crate::machine::LooseJoint;
use crate::scene::{Scene, SetError};
use crate::units::format_quantity_digits;

/// Name of the slider.
const NAME: &str = "Worn for";
/// Range of the slider, h: 0, then from the first on.
const RANGE_HOURS: [f64; 2] = [0.1, 10_000.0];
const SECONDS: f64 = 3600.0;
/// Digits of the slider's hours, of a clearance in words, and of one that is set.
const HOUR_DIGITS: usize = 3;
const SHOWN_DIGITS: usize = 3;
const SET_DIGITS: usize = 9;
/// Space below the slider, points.
const RING: f32 = 4.0;
/// Most lines of plays; the last of more says how many are left out.
const MAX_LINES: usize = 4;
/// Most ages remembered for undo and redo.
const MAX_AGES: usize = 200;
/// Halvings of the ratio of the slider's ends that find the longest time which the scene allows.
const HALVINGS: usize = 24;

const HELP: &str = "How wide the clearances are after this time of operation, if they go on growing as in the last full period of the run: \
     the rate measured there times the time; until a new run has had its period, as in the run before. The run starts again with them when \
     the slider is let go. Wear usually changes the rate; short times, one after the other, follow it.";

/// A play that wears.
struct Play {
    joint: usize,
    place: usize,
    /// Key of its parameter.
    key: String,
    name: String,
    /// As set, m.
    set: f64,
}

/// The plays of `scene` that wear.
fn wearing_plays(scene: &Scene) -> Vec<Play> {
    let all = &scene.machine.loose_joints;
    let wearing = |joint: &LooseJoint| joint.contact.wear_coefficient > 0.0;
    if all.iter().any(|joint| wearing(joint) && joint.wears_by_direction()) {
        return Vec::new();
    }
    let wearing = all.iter().enumerate().filter(|(_, joint)| wearing(joint));
    let plays = wearing.flat_map(|(j, joint)| {
        let all = joint.contact.clearances().into_iter().zip(["clearance", "second_clearance"]).enumerate();
        let loose: Vec<_> = all.filter(|(_, (set, _))| *set > 0.0).collect();
        let is_one = loose.len() == 1;
        loose.into_iter().map(move |(place, (set, part))| {
            let key = scene.joint_key(j, part);
            let part = key.rsplit('.').next().unwrap_or_default();
            let name = if is_one { joint.name.clone() } else { format!("{}, {part}", joint.name) };
            Play { joint: j, place, key, name, set }
        })
    });
    plays.collect()
}

/// A scene that the slider made.
#[derive(Clone)]
struct Age {
    /// Text and changes of the scene, the latter sorted.
    text: Arc<str>,
    changes: Vec<(String, String)>,
    /// The jumps that led to it: hours since the clearances were set, and the clearances, m. It begins with those set.
    jumps: Vec<(f64, Vec<f64>)>,
    /// The texts of the clearances that were set; `None` without a change.
    set: Vec<Option<String>>,
}

impl Age {
    /// The clearances of `scene` as they are set.
    fn new(scene: &Scene, plays: &[Play]) -> Self {
        let text_of = |play: &Play| {
            let last = scene.changes.iter().rfind(|(key, _)| *key == play.key);
            last.map(|(_, text)| text.clone())
        };
        Self {
            text: scene.source.text.clone(),
            changes: sorted(scene),
            jumps: vec![(0.0, plays.iter().map(|play| play.set).collect())],
            set: plays.iter().map(text_of).collect(),
        }
    }

    fn hours(&self) -> f64 {
        self.jumps.last().map_or(0.0, |(hours, _)| *hours)
    }

    /// Growth in the last jump, m/s: the rate of the run before.
    fn latest_rates(&self) -> Option<Vec<f64>> {
        let [.., (from, before), (to, after)] = self.jumps.as_slice() else {
            return None;
        };
        Some(before.iter().zip(after).map(|(before, after)| (after - before) / ((to - from) * SECONDS)).collect())
    }

    /// Clearances after `hours`: on the way here, or beyond by `rates`, m/s.
    fn after(&self, hours: f64, rates: &[f64]) -> Vec<f64> {
        let next = self.jumps.iter().position(|(own, _)| *own > hours);
        let (before, plays) = &self.jumps[next.unwrap_or(self.jumps.len()) - 1];
        let Some((end, later)) = next.map(|next| &self.jumps[next]) else {
            let grow = |(play, rate): (&f64, &f64)| play + rate * (hours - before) * SECONDS;
            return plays.iter().zip(rates).map(grow).collect();
        };
        let part = (hours - before) / (end - before);
        plays.iter().zip(later).map(|(play, later)| play + (later - play) * part).collect()
    }
}

fn sorted(scene: &Scene) -> Vec<(String, String)> {
    let mut changes = scene.changes.clone();
    changes.sort();
    changes
}

/// A position of the handle that has not been applied.
struct Draft {
    hours: f64,
    /// Longest time that the scene allows, h, with the joint that ends it.
    limit: Option<(f64, String)>,
    /// For these rates, m/s.
    rates: Vec<f64>,
}

/// State of the slider.
#[derive(Default)]
pub struct WornFor {
    /// Number of lines for plays, 0 while it is not shown; `None` before the first frame of a scene.
    lines: Option<usize>,
    draft: Option<Draft>,
    ages: Vec<Age>,
    /// Hours before and after the latest change, for its name in the history.
    changed: Option<[f64; 2]>,
}

impl WornFor {
    /// Forgets the position of the handle that was not applied.
    pub fn forget_draft(&mut self) {
        self.draft = None;
    }

    /// Takes the name of the change just made, with its values before and after.
    pub fn take_change(&mut self) -> Option<(String, [String; 2])> {
        let [before, after] = self.changed.take()?;
        Some((NAME.to_owned(), [before, after].map(in_hours)))
    }

    /// The age of `scene`.
    fn age(&self, scene: &Scene, plays: &[Play]) -> Age {
        let changes = sorted(scene);
        let made = self.ages.iter().rfind(|age| age.text == scene.source.text && age.changes == changes);
        let made = made.filter(|age| age.set.len() == plays.len());
        made.cloned().unwrap_or_else(|| Age::new(scene, plays))
    }

    /// The slider with its words, if the scene wears. Returns whether the run is to start again.
    ///
    /// # Errors
    /// The scene refuses a clearance; nothing is changed then.
    pub fn ui(&mut self, ui: &mut Ui, player: &mut Player) -> Result<bool, SetError> {
        let plays = wearing_plays(player.pending());
        // It comes and goes with a parameter below it, which does not move under the pointer.
        let pointer = ui.input(|input| input.pointer.latest_pos());
        let is_over = pointer.is_some_and(|at| ui.clip_rect().contains(at));
        let lines = self.lines.filter(|_| is_over).unwrap_or(plays.len().min(MAX_LINES));
        self.lines = Some(lines);
        if lines == 0 {
            self.draft = None;
            return Ok(false);
        }
        let age = self.age(player.pending(), &plays);
        let rates = player.wear_rates().map(|all| -> Vec<f64> {
            plays.iter().map(|play| all.get(play.joint).map_or(0.0, |rates| rates[play.place])).collect()
        });
        // Until the worn machine has run for a period, it goes on as the run before.
        let rates = rates.or_else(|| age.latest_rates());
        let rates = rates.filter(|rates| rates.iter().any(|rate| *rate > 0.0));
        let is_let_go = ui.push_id(NAME, |ui| self.slider(ui, player, (&plays, &age, rates.as_deref()))).inner;
        ui.add_space(4.0);
        let Some(draft) = self.draft.take_if(|_| is_let_go) else {
            return Ok(false);
        };
        self.apply(player, &plays, age, &draft)
    }

    /// Slider and words; returns whether the handle was let go.
    fn slider(&mut self, ui: &mut Ui, player: &Player, (plays, age, rates): (&[Play], &Age, Option<&[f64]>)) -> bool {
        theme::use_dense_rows(ui);
        if rates.is_none() {
            self.draft = None;
        }
        let mut hours = self.draft.as_ref().map_or(age.hours(), |draft| draft.hours);
        let label = ui
            .horizontal(|ui| {
                let label = ui.label(NAME);
                let right = egui::Layout::right_to_left(egui::Align::Center);
                ui.with_layout(right, |ui| ui.label(in_hours(hours)));
                label
            })
            .inner;
        ui.spacing_mut().slider_width = ui.available_width().max(40.0);
        let [least, greatest] = RANGE_HOURS;
        let slider =
            Slider::new(&mut hours, 0.0..=greatest).logarithmic(true).smallest_positive(least).show_value(false);
        let response = ui.add_enabled_ui(rates.is_some(), |ui| keys::slider(ui, slider, [0.0, greatest])).inner;
        for response in [&response, &label] {
            panel_tooltip(ui, response, |ui| {
                ui.strong(NAME);
                ui.label(HELP);
            });
        }
        let (moved, escaped) = (response.changed(), ui.input(|input| input.key_pressed(Key::Escape)));
        // The next period may have other rates.
        let is_outdated = self.draft.as_ref().is_some_and(|draft| rates.is_some_and(|rates| draft.rates != rates));
        if let Some(rates) = rates.filter(|_| (moved || is_outdated) && !escaped) {
            let hours: f64 = format_quantity_digits(hours, "", HOUR_DIGITS).parse().unwrap_or(hours);
            self.draft(player.pending(), (plays, age, rates), hours);
        }
        if escaped {
            self.draft = None;
        }
        let shown = self.draft.as_ref().map_or(age.hours(), |draft| draft.hours);
        spoken::value(&response, &in_hours(shown));
        response.clone().accessible_name(NAME);
        // A lesson's ring around the slider needs it.
        ui.add_space(RING);
        self.words(ui, player, (plays, age, rates), shown);
        // With the keys the handle takes several steps.
        let by_keys = response.has_focus() && !response.dragged();
        let entered = by_keys && ui.input(|input| input.key_pressed(Key::Enter));
        let moved_otherwise = moved && !response.dragged() && !response.has_focus();
        response.drag_stopped() || response.lost_focus() || entered || moved_otherwise
    }

    /// Moves the handle to `hours`, or as far as the scene allows.
    fn draft(&mut self, scene: &Scene, (plays, age, rates): (&[Play], &Age, &[f64]), hours: f64) {
        let known = self.draft.take().filter(|draft| draft.rates == rates);
        let limit = known.map_or_else(|| longest(scene, plays, age, rates), |draft| draft.limit);
        let hours = limit.as_ref().map_or(hours, |(most, _)| hours.min(*most));
        self.draft = Some(Draft { hours, limit, rates: rates.to_vec() });
    }

    /// What the slider does or did, in a line, and the plays with the handle at `hours`; always as many lines.
    fn words(&self, ui: &mut Ui, player: &Player, (plays, age, rates): (&[Play], &Age, Option<&[f64]>), hours: f64) {
        let period = if player.is_driven() { "period" } else { "second" };
        let limit = self.draft.as_ref().and_then(|draft| draft.limit.as_ref()).filter(|(most, _)| hours >= *most);
        let is_measured = player.wear_rates().is_some();
        let heading = match (limit, &self.draft, rates) {
            (Some((_, joint)), ..) => format!("No longer: {joint} is as wide as the scene allows"),
            (None, Some(_), _) if is_measured => format!("Extrapolated from the last {period}:"),
            (None, Some(_), _) => "Extrapolated from the run before:".to_owned(),
            (None, None, _) if hours > 0.0 => "Extrapolated from the run before:".to_owned(),
            (None, None, Some(_)) => "From the clearances as set:".to_owned(),
            (None, None, None) if is_measured => format!("Nothing wore in the last {period}"),
            (None, None, None) => format!("Let the run go on for a full {period}"),
        };
        let mut line = |text: String| ui.add(egui::Label::new(RichText::new(text).small().weak()).truncate());
        line(heading);
        let after = match &self.draft {
            Some(draft) => age.after(hours, &draft.rates),
            None => plays.iter().map(|play| play.set).collect(),
        };
        let set = &age.jumps[0].1;
        let mut order: Vec<usize> = (0..plays.len()).collect();
        let lines = self.lines.unwrap_or(MAX_LINES);
        if plays.len() > lines {
            let growth = |k: usize| rates.map_or(after[k] - set[k], |rates| rates[k]);
            order.sort_by(|a, b| growth(*b).total_cmp(&growth(*a)));
            order.truncate(lines - 1);
        }
        let shown = |play: f64| value::quantity(play, "mm", SHOWN_DIGITS);
        for k in &order {
            let (name, [from, to]) = (&plays[*k].name, [set[*k], after[*k]].map(shown));
            let from = from.trim_end_matches("mm").trim_end();
            line(if hours > 0.0 { format!("{name} {from} to {to}") } else { format!("{name} {to}") });
        }
        if order.len() < plays.len() {
            line(format!("and {} more", plays.len() - order.len()));
        }
        for _ in plays.len()..lines {
            line(String::new());
        }
    }

    /// Changes the clearances to those of `draft`.
    fn apply(&mut self, player: &mut Player, plays: &[Play], age: Age, draft: &Draft) -> Result<bool, SetError> {
        let (before, hours) = (age.hours(), draft.hours);
        if hours == before {
            return Ok(false);
        }
        let after = age.after(hours, &draft.rates);
        player.set_all(NAME, &changes(plays, &age, &after, hours))?;
        let mut next = age;
        next.jumps.retain(|(own, _)| *own < hours || *own == 0.0);
        if hours > 0.0 {
            next.jumps.push((hours, after));
        }
        (next.text, next.changes) = (player.pending().source.text.clone(), sorted(player.pending()));
        self.ages.push(next);
        let surplus = self.ages.len().saturating_sub(MAX_AGES);
        self.ages.drain(..surplus);
        self.changed = Some([before, hours]);
        Ok(true)
    }
}

/// Values of the parameters of `plays` for the clearances `after`, m; at 0 hours those from which `age` began.
fn changes(plays: &[Play], age: &Age, after: &[f64], hours: f64) -> Vec<(String, Option<String>)> {
    let value = |(k, play): (usize, &Play)| {
        let grown = || Some(format_quantity_digits(after[k], "mm", SET_DIGITS));
        (play.key.clone(), if hours > 0.0 { grown() } else { age.set[k].clone() })
    };
    plays.iter().enumerate().map(value).collect()
}

/// The longest time whose clearances `scene` allows, h, with the joint whose clearance is then as wide as allowed; `None` if it allows
/// all of the slider.
fn longest(scene: &Scene, plays: &[Play], age: &Age, rates: &[f64]) -> Option<(f64, String)> {
    let refused = |hours: f64| {
        let mut changed = scene.clone();
        let values = changes(plays, age, &age.after(hours, rates), hours);
        values.into_iter().zip(plays).find_map(|((key, value), play)| match changed.with(&key, &value?) {
            Ok(next) => {
                changed = next;
                None
            }
            Err(_) => Some(play.name.clone()),
        })
    };
    let [mut allowed, mut longer] = RANGE_HOURS;
    let mut joint = refused(longer)?;
    for _ in 0..HALVINGS {
        let middle = (allowed * longer).sqrt();
        match refused(middle) {
            Some(first) => (longer, joint) = (middle, first),
            None => allowed = middle,
        }
    }
    // Rounded down to the digits of the slider.
    let step = 10_f64.powf(allowed.log10().floor() - 2.0);
    let most = (allowed / step).floor() * step;
    Some((if refused(most).is_none() { most.max(age.hours()) } else { age.hours() }, joint))
}

fn in_hours(hours: f64) -> String {
    format!("{} h", value::number(hours, HOUR_DIGITS))
}
