//! Before and after: copies of the run from before a parameter change. They are stepped along with the run; the plots show their
//! curves in grey, and one can be displayed beside the picture at the same instant and from the same camera.

use eframe::egui::{self, Color32, RichText, TextEdit, Ui, vec2};

use super::player::Player;
use super::{layout, value};

/// Most pinned runs, in addition to the latest run before a change.
const MAX_PINNED: usize = 3;
/// Stepping time per frame for all of them: fraction of the frame time, and least value, s, during playback and while waiting for
/// one of them.
const BUDGET_FRACTION: f64 = 0.2;
const MIN_BUDGET: f64 = 3e-3;
/// Upper limit at low frame rates; keeps the interface responsive.
const MAX_BUDGET: f64 = 16e-3;
const WAITING_FACTOR: f64 = 3.0;
/// Share of a member's colour in the grey of its old curve: enough to distinguish members.
const HUE_FRACTION: f32 = 0.3;
/// Dash lengths of pinned curves, points.
const DASHES: [f32; MAX_PINNED] = [8.0, 4.0, 2.0];
/// Least width of a name in a legend, points.
const MIN_LEGEND_WIDTH: f32 = 30.0;
/// Line symbols in a legend.
const LINE_SYMBOLS: [&str; 1 + MAX_PINNED] = ["—", "– –", "- -", "· ·"];
/// Grey levels of the latest and the pinned curves; 0 is the background.
const GREY_LEVELS: [f32; 1 + MAX_PINNED] = [0.55, 0.7, 0.6, 0.5];

/// A run from before a change.
pub struct EarlierRun {
    /// The parameter that was changed.
    key: String,
    /// Name given by the user.
    name: Option<String>,
    /// 0 for the latest, which the next change replaces; otherwise pinned.
    place: usize,
    /// Whether its curves are shown.
    pub shown: bool,
    run: Box<Player>,
    /// Serial number.
    number: u64,
}

impl EarlierRun {
    /// Its name; by default the changed parameter with its value in this run.
    pub fn name(&self) -> String {
        let name = self.name.as_ref().filter(|name| !name.trim().is_empty());
        name.cloned().unwrap_or_else(|| named(&self.run, &self.key))
    }

    /// The run.
    pub fn run(&self) -> &Player {
        &self.run
    }

    /// The run, mutable.
    pub(super) fn run_mut(&mut self) -> &mut Player {
        &mut self.run
    }

    /// The changed parameter with its value in the run of `player`.
    pub(super) fn named_in(&self, player: &Player) -> String {
        named(player, &self.key)
    }

    /// Grey of the old curve whose current version has `colour`.
    pub fn colour(&self, colour: Color32, dark: bool) -> Color32 {
        let level = GREY_LEVELS[self.place];
        let grey = Color32::from_gray((255.0 * if dark { level } else { 1.0 - level }) as u8);
        grey.lerp_to_gamma(colour, HUE_FRACTION)
    }

    /// Dash length of its curves, points; `None` for a solid line.
    pub fn dashes(&self) -> Option<f32> {
        self.place.checked_sub(1).map(|pinned| DASHES[pinned])
    }

    /// Whether it has not reached the instant displayed by `player`.
    fn lags(&self, player: &Player) -> bool {
        self.run.reached() < player.pacer.shown() && self.run.stopped().is_none()
    }

    /// Index in its record of the quantity that `player` records at `channel`.
    pub fn channel(&self, player: &Player, channel: usize) -> Option<usize> {
        let (own, other) = (&self.run, player.channels());
        if let Some(wanted) = other.list().get(channel) {
            return own.channels().list().iter().position(|channel| channel == wanted);
        }
        let picked = other.picked().get(channel.checked_sub(player.picked().start)?)?;
        let same = own.channels().picked().iter().position(|channel| channel.column == picked.column)?;
        Some(own.picked().start + same)
    }

    /// Differences from the run of `player`, one line per parameter.
    fn differences(&self, player: &Player) -> String {
        let all = value::differences(self.run.running(), player.running(), &[]);
        let ends = self.run.stopped().map(|stopped| format!("It {stopped}"));
        let all: Vec<String> = all.into_iter().chain(ends).collect();
        if all.is_empty() { "Same parameters as now".to_owned() } else { all.join("\n") }
    }
}

/// The parameter `key` of the running scene, with its value.
fn named(run: &Player, key: &str) -> String {
    value::named(run.running(), key).map_or_else(|| key.to_owned(), |(name, value)| format!("{name}: {value}"))
}

/// The runs from before changes.
pub struct Comparison {
    /// Whether the run before a change is retained.
    on: bool,
    runs: Vec<EarlierRun>,
    /// Place of the run displayed beside the picture, and of the run whose record is to be saved.
    beside: Option<usize>,
    to_save: Option<usize>,
    /// Number of runs so far.
    count: u64,
}

impl Default for Comparison {
    fn default() -> Self {
        Self { on: true, runs: Vec::new(), beside: None, to_save: None, count: 0 }
    }
}

/// A request from the menu.
enum Request {
    Pin,
    Save,
    Remove,
}

impl Comparison {
    /// Discards all runs for a new scene.
    pub fn clear(&mut self) {
        (self.runs, self.beside) = (Vec::new(), None);
    }

    /// Whether the run before a change is retained.
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// Stores `run`, from before `key` was changed, as the latest.
    pub fn add(&mut self, run: Box<Player>, key: String) {
        self.runs.retain(|earlier| earlier.place != 0);
        self.runs.insert(0, EarlierRun { key, name: None, place: 0, shown: true, run, number: self.count });
        self.count += 1;
    }

    /// The stored runs, latest first.
    pub fn kept(&self) -> &[EarlierRun] {
        &self.runs
    }

    /// The runs with visible curves.
    pub fn shown(&self) -> impl Iterator<Item = &EarlierRun> {
        self.runs.iter().filter(|earlier| earlier.shown)
    }

    /// Whether the run displayed beside that of `player` has not reached the displayed instant.
    pub fn is_behind(&self, player: &Player) -> bool {
        let beside = self.runs.iter().find(|earlier| Some(earlier.place) == self.beside);
        beside.is_some_and(|earlier| earlier.lags(player))
    }

    /// Advances the runs to the time of `player` in a frame of `dt` seconds; returns whether one of them still lags behind.
    pub fn advance(&mut self, player: &Player, dt: f64) -> bool {
        let waited = !player.is_playing() || self.is_behind(player);
        let budget = (BUDGET_FRACTION * dt).max(MIN_BUDGET) * if waited { WAITING_FACTOR } else { 1.0 };
        let lags = self.follow(player, budget.min(MAX_BUDGET));
        for earlier in &mut self.runs {
            earlier.run.publish_peaks();
            earlier.run.update_ghosts();
        }
        lags
    }

    /// The same with a time `budget`, s, between frames or within one.
    pub fn follow(&mut self, player: &Player, budget: f64) -> bool {
        let start = (player.clock)();
        let may_step = || (player.clock)() - start < budget;
        let mut lags = false;
        for earlier in &mut self.runs {
            let run = &mut earlier.run;
            run.plotted = player.plotted;
            if run.records_tip_error() != player.records_tip_error() {
                run.record_tip_error(player.records_tip_error());
            }
            run.pick(player.picks());
            run.pacer.set_scale(player.pacer.scale());
            if run.ideal().is_some() != player.ideal().is_some() {
                run.set_ideal(player.ideal().is_some());
            }
            let shown = player.pacer.shown();
            let is_beside = self.beside == Some(earlier.place);
            if is_beside || shown > run.reached() || (earlier.shown && may_step()) {
                // To a known instant, too: its record is fine only around the instant it displays.
                lags |= !run.follow(shown, may_step);
            } else {
                lags |= earlier.shown && run.pacer.shown() != shown;
            }
        }
        lags
    }

    /// Follows a reset: a run whose parameters have changed since its start is restarted, because its record is no longer valid.
    pub fn reset(&mut self) {
        self.runs.retain_mut(|earlier| earlier.run.is_unchanged_since_start() || earlier.run.reset().is_ok());
        for earlier in &mut self.runs {
            earlier.run.follow(0.0, || true);
            earlier.run.publish_peaks();
        }
    }

    fn pin(&mut self, at: usize) {
        let free = (1..=MAX_PINNED).find(|place| self.runs.iter().all(|earlier| earlier.place != *place));
        let Some(earlier) = self.runs.get_mut(at) else {
            return;
        };
        let place = if earlier.place == 0 { free } else { Some(0) };
        if let Some(place) = place {
            if self.beside == Some(earlier.place) {
                self.beside = Some(place);
            }
            earlier.place = place;
        }
        // An unpinned run becomes the latest.
        if place == Some(0) {
            let earlier = self.runs.remove(at);
            self.runs.retain(|earlier| earlier.place != 0);
            self.runs.insert(0, earlier);
        }
    }

    /// Legend of a plot's grey curves, in the rest of a row `height` points high.
    pub fn legend(&mut self, ui: &mut Ui, player: &Player, height: f32, plot: &str) {
        let count = self.runs.len().max(1) as f32;
        let width = (ui.available_width() / count - 6.0).min(170.0);
        if width < MIN_LEGEND_WIDTH {
            return;
        }
        for earlier in &mut self.runs {
            let mut text = format!("{} {}", LINE_SYMBOLS[earlier.place], earlier.name());
            if earlier.lags(player) {
                text += &format!(" (computed to {})", value::time(earlier.run.reached()));
            }
            let name = format!("{text} in {plot}");
            let mut text = RichText::new(text).small().weak();
            if !earlier.shown {
                text = text.strikethrough();
            }
            let button = egui::Button::new(text).frame(false).truncate();
            let response = ui.scope(|ui| {
                ui.set_max_width(width);
                ui.add(button.min_size(vec2(0.0, height)))
            });
            let response = response.inner;
            ui.ctx().accesskit_node_builder(response.id, |node| {
                node.set_toggled(earlier.shown.into());
                node.set_label(name);
            });
            if response.on_hover_text("Show or hide the curves of the run before the change").clicked() {
                earlier.shown = !earlier.shown;
            }
        }
    }

    /// The menu.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player) {
        let name = match self.runs.len() {
            0 => "Before and after".to_owned(),
            count => format!("Before and after ({count})"),
        };
        let help = "Runs with the old value of a changed parameter: in the plots, or side by side";
        layout::menu(ui, &name, true, |ui| self.entries(ui, player)).on_hover_text(help);
    }

    fn entries(&mut self, ui: &mut Ui, player: &Player) {
        ui.checkbox(&mut self.on, "Keep the run before a change")
            .on_hover_text("When a parameter changes, a second run continues with the old value; its curves are grey");
        if self.runs.is_empty() {
            ui.weak("Change a parameter to compare");
        }
        let mut request = None;
        let full = self.runs.iter().filter(|earlier| earlier.place > 0).count() == MAX_PINNED;
        for (at, earlier) in self.runs.iter_mut().enumerate() {
            ui.separator();
            ui.push_id(at, |ui| {
                let differences = earlier.differences(player);
                let own = named(&earlier.run, &earlier.key);
                let name = earlier.name.get_or_insert_with(|| own.clone());
                ui.add(TextEdit::singleline(name).desired_width(240.0))
                    .on_hover_text(format!("Name of this run in the legends\n{differences}"))
                    .accessible_name("Name");
                if *name == own {
                    earlier.name = None;
                }
                ui.horizontal(|ui| {
                    ui.checkbox(&mut earlier.shown, "Curves").on_hover_text("Show its curves in the plots, in grey");
                    let pinned = earlier.place > 0;
                    let pin = egui::Button::new("Pin").selected(pinned);
                    let help = format!("Keep this run when another parameter changes; at most {MAX_PINNED}");
                    if ui.add_enabled(pinned || !full, pin).on_hover_text(help).clicked() {
                        request = Some((at, Request::Pin));
                    }
                    let beside = self.beside == Some(earlier.place);
                    let help =
                        "Show this machine beside the current one, at the same instant and from the same point of view";
                    let switch = egui::Button::new("Side by side").selected(beside);
                    if ui.add(switch).on_hover_text(help).clicked() {
                        self.beside = (!beside).then_some(earlier.place);
                    }
                    if ui.button("Save").on_hover_text("Save its record as CSV").clicked() {
                        request = Some((at, Request::Save));
                    }
                    if ui.button("Remove").on_hover_text("Discard this run").clicked() {
                        request = Some((at, Request::Remove));
                    }
                });
            });
        }
        match request {
            Some((at, Request::Save)) => self.to_save = Some(self.runs[at].place),
            Some((at, Request::Pin)) => self.pin(at),
            Some((at, Request::Remove)) => {
                let removed = self.runs.remove(at);
                self.beside = self.beside.filter(|place| *place != removed.place);
            }
            None => {}
        }
    }

    /// Displays the current machine alone again.
    pub(super) fn hide_comparison(&mut self) {
        self.beside = None;
    }

    /// The run whose machine is displayed beside the current one, and its number.
    pub fn beside(&mut self) -> Option<(&mut EarlierRun, u64)> {
        let place = self.beside?;
        let earlier = self.runs.iter_mut().find(|earlier| earlier.place == place)?;
        let number = earlier.number;
        Some((earlier, number))
    }

    /// The run whose record is to be saved; clears the request.
    pub fn take_run_to_save(&mut self) -> Option<&EarlierRun> {
        let place = self.to_save.take()?;
        self.runs.iter().find(|earlier| earlier.place == place)
    }
}
