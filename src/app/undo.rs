//! Undo and redo of parameter and view changes, and apart from them of the point of view. A gesture, such as a slider drag, is one
//! change.
//!
//! Undoing a parameter change applies at the displayed instant, like any other change: it does not go back in time.

use eframe::egui::{self, Key, Modifiers, Ui};

use super::icons::{Icon, icon_button};
use super::keys::Action;
use super::player::Edit;
use super::run::Run;
use super::{layout, theme, value};
use crate::scene::Scene;
use crate::session::link::CameraPose;
use crate::session::link::settings::PlotWindow;
use crate::simulate::Quantity;
use crate::view::{Quality, ScenePart, ViewOptions};

/// Length of the history; the oldest changes are dropped.
const MAX_CHANGES: usize = 200;
/// Successive changes of one parameter within this time are merged, s: wheel notches, arrow keys on a slider.
const MERGE_TIME: f64 = 0.5;
/// Side of a button in the header, points.
const BUTTON_SIDE: f32 = 26.0;
/// This key takes the place of several parameters and must be applied first.
const PRESET: &str = "solver.preset";

/// View settings chosen by the user.
#[derive(Clone, Debug, PartialEq)]
struct View {
    options: ViewOptions,
    camera: CameraPose,
    followed: Option<ScenePart>,
    chosen: Vec<Quantity>,
    picked: Vec<String>,
    window: PlotWindow,
}

impl View {
    fn of(run: &Run) -> Option<Self> {
        let mut options = run.viewport.options.clone();
        // These are not user choices.
        options.quality = Quality::FULL;
        options.theme = crate::view::Theme::Light;
        options.arrows.thickness = 1.0;
        Some(Self {
            options,
            camera: run.viewport.pose()?,
            followed: run.viewport.followed(),
            chosen: run.plots.chosen.clone(),
            picked: run.plots.picked.clone(),
            window: run.plots.window,
        })
    }

    /// Whether the camera is unchanged, apart from following a body and fitting the picture.
    fn has_camera_of(&self, other: &Self) -> bool {
        let (a, b) = (&self.camera, &other.camera);
        let near = |a: f32, b: f32| (a - b).abs() <= 1e-5 * (1.0 + a.abs());
        let fits = a.fitted.is_some() && b.fitted.is_some();
        let follows = self.followed.is_some() && self.followed == other.followed;
        let same_place = || near(a.distance, b.distance) && a.target.iter().zip(b.target).all(|(a, b)| near(*a, b));
        let same_direction = self.followed == other.followed && near(a.yaw, b.yaw) && near(a.pitch, b.pitch);
        same_direction && (fits || (follows && near(a.distance, b.distance)) || same_place())
    }

    /// Name of the difference from `other` apart from the camera; `None` if equal.
    fn difference(&self, other: &Self) -> Option<&'static str> {
        if self.options.magnification != other.options.magnification {
            return Some("Magnification of the play");
        }
        if self.options != other.options {
            return Some("View options");
        }
        if self.chosen != other.chosen || self.picked != other.picked {
            return Some("Choice of plots");
        }
        (self.window != other.window).then_some("Window of the plots")
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Change {
    Parameters(Vec<Edit>),
    View(Box<[View; 2]>),
    Camera(Box<[View; 2]>),
}

struct Entry {
    /// Name of the change.
    name: String,
    /// Displayed values before and after; "" for the view.
    values: [String; 2],
    change: Change,
    /// Time of the latest edit, s of viewing.
    at: f64,
}

impl Entry {
    fn keys(&self) -> Vec<&str> {
        match &self.change {
            Change::Parameters(edits) => edits.iter().map(|edit| &*edit.key).collect(),
            Change::View(_) | Change::Camera(_) => Vec::new(),
        }
    }

    /// Whether `later` continues this change.
    fn is_continued_by(&self, later: &Self) -> bool {
        let (own, later_keys) = (self.keys(), later.keys());
        self.name == later.name
            && own.is_empty() == later_keys.is_empty()
            && later_keys.iter().all(|key| own.contains(key))
    }

    /// Whether the change has no effect.
    fn has_no_effect(&self) -> bool {
        match &self.change {
            Change::Parameters(edits) => edits.iter().all(|edit| edit.before == edit.after),
            Change::View(ends) => ends[0].difference(&ends[1]).is_none(),
            Change::Camera(ends) => ends[0].has_camera_of(&ends[1]),
        }
    }

    fn extend(&mut self, later: Self) {
        match (&mut self.change, later.change) {
            (Change::Parameters(own), Change::Parameters(later)) => {
                for later in later {
                    if let Some(own) = own.iter_mut().find(|own| own.key == later.key) {
                        own.after = later.after;
                    }
                }
            }
            (Change::View(own), Change::View(later)) | (Change::Camera(own), Change::Camera(later)) => {
                let [_, after] = *later;
                own[1] = after;
            }
            _ => {}
        }
        let [_, after] = later.values;
        self.values[1] = after;
        self.at = later.at;
    }
}

/// Changes, and those undone.
#[derive(Default)]
struct History {
    done: Vec<Entry>,
    undone: Vec<Entry>,
}

impl History {
    /// Adds a change; `is_held`: the pointer has stayed down since the one before.
    fn record(&mut self, entry: Entry, is_held: bool) {
        self.undone.clear();
        let last = self.done.last_mut().filter(|last| last.is_continued_by(&entry));
        match last.filter(|last| is_held || entry.at - last.at < MERGE_TIME) {
            Some(last) => last.extend(entry),
            None => self.done.push(entry),
        }
        self.done.pop_if(|last| last.has_no_effect());
        if self.done.len() > MAX_CHANGES {
            self.done.remove(0);
        }
    }

    /// Moves the change to undo, or to redo, to the other side and returns it.
    fn take(&mut self, redo: bool) -> Option<&Entry> {
        let Self { done, undone } = self;
        let (from, to) = if redo { (undone, done) } else { (done, undone) };
        to.push(from.pop()?);
        to.last()
    }
}

/// The undo and redo history.
#[derive(Default)]
pub struct Undo {
    changes: History,
    cameras: History,
    /// The view at the latest check.
    view: Option<View>,
    /// Whether the pointer has stayed down since the latest change.
    held: bool,
}

impl Undo {
    /// Clears the history for a new scene.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    fn record(&mut self, entry: Entry, held: bool) {
        let history = if matches!(entry.change, Change::Camera(_)) { &mut self.cameras } else { &mut self.changes };
        history.record(entry, self.held);
        self.held = held;
    }

    /// Time of the latest change, s of viewing.
    fn last(&self) -> Option<f64> {
        self.changes.done.last().map(|last| last.at)
    }

    /// Description of the next undo or redo; `None` if there is none.
    pub fn words(&self, redo: bool) -> Option<String> {
        let entry = if redo { &self.changes.undone } else { &self.changes.done }.last()?;
        let value = &entry.values[usize::from(redo)];
        let verb = if redo { "Redo" } else { "Undo" };
        Some(if value.is_empty() {
            format!("{verb}: {}", entry.name)
        } else {
            format!("{verb}: {}, to {value}", entry.name)
        })
    }

    /// Whether the key of undo (`Some(false)`) or redo is pressed.
    pub fn pressed(ctx: &egui::Context) -> Option<bool> {
        let both = Modifiers::COMMAND | Modifiers::SHIFT;
        let redo =
            ctx.input_mut(|input| input.consume_key(both, Key::Z) || input.consume_key(Modifiers::COMMAND, Key::Y));
        (redo || ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::Z))).then_some(redo)
    }

    /// Undo and redo buttons of the header; returns `redo` of the clicked one.
    pub fn buttons(&self, ui: &mut Ui, is_free: bool) -> Option<bool> {
        let side = theme::side(ui, BUTTON_SIDE);
        let mut chosen = None;
        for (redo, icon, name, key) in
            [(false, Icon::Undo, "Undo", "Ctrl+Z"), (true, Icon::Redo, "Redo", "Ctrl+Shift+Z")]
        {
            let words = self.words(redo);
            let help = words
                .as_ref()
                .map_or_else(|| format!("Nothing to {}", name.to_lowercase()), |words| format!("{words} ({key})"));
            let clicked = ui
                .add_enabled_ui(words.is_some() && is_free, |ui| icon_button(ui, icon, name, "", side, false))
                .inner
                .on_hover_text(&help)
                .on_disabled_hover_text(&help)
                .clicked();
            if clicked {
                chosen = Some(redo);
            }
        }
        chosen
    }

    /// Buttons for the previous and the next point of view; returns the action of the clicked one.
    pub fn camera_buttons(&self, ui: &mut Ui) -> Option<Action> {
        let mut chosen = None;
        ui.horizontal(|ui| {
            for (redo, name, help) in [
                (false, "Previous view", "Back to the point of view before the latest turn of the camera (key Z)"),
                (true, "Next view", "Forward again (key Y)"),
            ] {
                let all = if redo { &self.cameras.undone } else { &self.cameras.done };
                let button = ui.add_enabled(!all.is_empty(), egui::Button::new(name));
                if button.on_hover_text(help).clicked() {
                    chosen = Some(Action::Camera { redo });
                }
            }
        });
        chosen
    }

    /// The same in the menu of a small window.
    pub fn entries(&self, ui: &mut Ui, is_free: bool) -> Option<bool> {
        let mut chosen = None;
        for (redo, name) in [(false, "Undo"), (true, "Redo")] {
            let words = self.words(redo);
            let button = egui::Button::new(words.as_deref().unwrap_or(name));
            if ui.add_enabled(words.is_some() && is_free, button).clicked() {
                chosen = Some(redo);
                layout::close_menu(ui);
            }
        }
        chosen
    }
}

/// Name of the parameter `key` and the displayed form of `text`, or of the scene file's value if that is `None`.
fn name_and_value(scene: &Scene, original: Option<String>, key: &str, text: Option<&str>) -> (String, String) {
    let name = value::named(scene, key).map_or_else(|| key.to_owned(), |(name, _)| name);
    let value = text.map(value::typeset).or(original).unwrap_or_default();
    (name, value)
}

impl Run {
    /// Undoes the latest change, or redoes the last undone one, if there is one.
    ///
    /// # Errors
    /// The value of a parameter is refused, as a message; the others are restored.
    pub fn undo(&mut self, redo: bool) -> Result<(), String> {
        let mut outcome = Ok(());
        let Some(change) = self.undo.changes.take(redo).map(|entry| entry.change.clone()) else {
            return outcome;
        };
        match &change {
            Change::Parameters(edits) => {
                let mut edits: Vec<&Edit> = edits.iter().collect();
                edits.sort_by_key(|edit| edit.key != PRESET);
                for edit in edits {
                    let wanted = if redo { &edit.after } else { &edit.before };
                    if let Err(error) = self.player.restore_parameter(&edit.key, wanted.as_deref()) {
                        outcome = Err(error.to_string());
                    }
                }
                self.player.take_edits();
                self.controls.forget_drafts();
            }
            Change::View(ends) => {
                let view = ends[usize::from(redo)].clone();
                let now = &self.viewport.options;
                let (quality, theme, thickness) = (now.quality, now.theme, now.arrows.thickness);
                self.viewport.options = view.options.clone();
                let options = &mut self.viewport.options;
                (options.quality, options.theme, options.arrows.thickness) = (quality, theme, thickness);
                self.plots.chosen.clone_from(&view.chosen);
                self.plots.picked.clone_from(&view.picked);
                self.plots.window = view.window;
                self.undo.view = View::of(self);
            }
            Change::Camera(_) => {}
        }
        outcome
    }

    /// Returns to the point of view before the latest change of the camera, or to that after the last undone one.
    pub fn undo_camera(&mut self, redo: bool) {
        let change = self.undo.cameras.take(redo).map(|entry| entry.change.clone());
        if let Some(Change::Camera(ends)) = change {
            let view = &ends[usize::from(redo)];
            self.viewport.set_pose(view.camera);
            self.viewport.follow(view.followed);
            self.undo.view = View::of(self);
        }
    }

    /// Records changes since the previous frame; during a task (`is_busy`) there are none of the user's.
    pub(super) fn follow_changes(&mut self, ctx: &egui::Context, is_busy: bool, in_lesson: bool) {
        let (now, held) = ctx.input(|input| (input.time, input.pointer.any_down() || input.any_touches()));
        let edits = self.player.take_edits();
        let named = self.controls.take_change();
        if is_busy {
            self.undo.view = None;
            return;
        }
        self.compare(!held && self.undo.last().is_none_or(|at| now - at > MERGE_TIME), in_lesson);
        // Those before the last give way to it: a preset, or the settings whose place it takes.
        if let Some(edit) = edits.last() {
            let original = self.player.original(&edit.key);
            let scene = self.player.pending();
            let kind = scene.parameter(&edit.key).ok().map(|parameter| &parameter.kind);
            let original = original.zip(kind).map(|(value, kind)| value::shown(&value, kind));
            let (name, values) = named.unwrap_or_else(|| {
                let ends = [&edit.before, &edit.after];
                let [(name, before), (_, after)] =
                    ends.map(|text| name_and_value(scene, original.clone(), &edit.key, text.as_deref()));
                (name, [before, after])
            });
            self.undo.record(Entry { name, values, change: Change::Parameters(edits), at: now }, held);
        }
        self.follow_view(now, held, in_lesson);
        self.undo.held &= held;
    }

    /// Records a view change once its gesture has ended. Lesson steps also change the view, so in a lesson only parameter changes
    /// are recorded.
    fn follow_view(&mut self, now: f64, held: bool, in_lesson: bool) {
        let view = View::of(self).filter(|_| !in_lesson);
        let Some(view) = view else {
            self.undo.view = None;
            return;
        };
        let Some(before) = &mut self.undo.view else {
            self.undo.view = Some(view);
            return;
        };
        let (differs, turned) = (view.difference(before), !view.has_camera_of(before));
        if differs.is_none() && !turned {
            // A camera that follows a body or fits the scene moves by itself.
            *before = view;
            return;
        }
        if held {
            return;
        }
        let ends = Box::new([std::mem::replace(before, view.clone()), view]);
        let changes = differs.map(|name| (name, Change::View(ends.clone())));
        for (name, change) in changes.into_iter().chain(turned.then_some(("Camera", Change::Camera(ends)))) {
            self.undo.record(Entry { name: name.to_owned(), values: Default::default(), change, at: now }, held);
        }
    }
}
