//! Controls of the scene's parameters, built from the parameter table: the three most important first, then those of a single
//! joint, and the rest collapsed by group.

use std::collections::HashMap;

use eframe::egui::{
    self, ComboBox, DragValue, FontId, Frame, Popup, PopupCloseBehavior, Rect, RectAlign, Response, RichText, Slider,
    SliderClamping, TextEdit, Tooltip, Ui,
};

use eframe::egui::text::{CCursor, CCursorRange};

use super::accuracy;
use super::icons::{Icon, icon_button};
use super::player::Player;
use super::worn_for::WornFor;
use super::{equations, keys, layout, spoken, theme, value};
use crate::scene::{Kind, OWN_GROUP, Parameter, SceneError, Scope, SetError, Value};
use crate::simulate::{CLEARANCE_SPEED, Effect};
use crate::units::{format_quantity_digits, from_display, to_display};

/// Shown with its resulting accuracy.
const PRESET: &str = "solver.preset";
/// Parameters shown first.
pub(super) const FIRST: [&str; 3] = ["contact.clearance", "contact.friction", "contact.restitution"];
/// What a first visit is told of them: no symbols, no laws.
const FIRST_WORDS: [&str; 3] = [
    "The gap all round between the ball and the wall of its socket. In a wider gap the ball flies longer and strikes harder.",
    "How strongly the wall holds back a ball that slides along it. Steel on steel has between 0.1 (oiled) and 0.8 (dry).",
    "How fast the ball leaves the wall, compared with how fast it came. With 1 an impact loses no energy.",
];

/// Size of the first parameter of the first visit relative to the others.
const LARGE: f32 = 1.4;

/// Width from which a touch slider has its value beside it, points.
const MIN_WIDTH_WITH_VALUE: f32 = 220.0;
/// Side of the undo button, points.
const UNDO_SIDE: f32 = 22.0;
/// Width of a text field, and its margin on either side, points.
const ENTRY_WIDTH: f32 = 84.0;
const ENTRY_MARGIN: i8 = 6;
/// Width of the sign of a note beside a name, and of the note that it opens, points.
const SIGN_WIDTH: f32 = 16.0;
const SIGN_PADDING: f32 = 4.0;
const NOTE_WIDTH: f32 = 260.0;

/// What is said of a changed value that does not act yet.
const WAITS: &str = "Applies when the run starts again from t = 0.";

/// State of the controls outside the simulation: partially typed values and their errors.
#[derive(Default)]
pub struct Controls {
    drafts: HashMap<String, Draft>,
    joint: usize,
    /// Key of a joint whose slider is scrolled into view and focused.
    revealed: Option<String>,
    worn_for: WornFor,
    /// Whether tooltips say only what a first visit is told.
    plain: bool,
    /// Whether the user asked for a restart, which applies the changes that wait for it.
    asks_restart: bool,
}

#[derive(Default)]
struct Draft {
    text: String,
    error: Option<String>,
}

/// A parameter with its current value.
struct Row<'a> {
    parameter: &'static Parameter,
    /// Key of the scene's value, or of a joint's own value.
    key: &'a str,
    /// Accessible name.
    name: String,
    now: Value,
    /// Width of what stands at the right of its name, points.
    room: f32,
    /// What its tooltip says in place of help, law and range.
    plain: Option<&'static str>,
}

impl Row<'_> {
    fn shown(&self) -> String {
        value::shown(&self.now, &self.parameter.kind)
    }
}

impl Controls {
    /// Discards partially typed values and other state, e.g. for a new scene.
    pub fn clear(&mut self) {
        self.drafts.clear();
        self.joint = 0;
        self.worn_for = WornFor::default();
    }

    /// Brings the slider of `key`, which belongs to a joint with play, into view and focuses it.
    pub fn reveal(&mut self, key: &str) {
        self.drafts.remove(key);
        self.revealed = Some(key.to_owned());
    }

    /// Discards only partially typed values.
    pub fn forget_drafts(&mut self) {
        self.drafts.clear();
        self.worn_for.forget_draft();
    }

    /// As [`WornFor::take_change`].
    pub fn take_change(&mut self) -> Option<(String, [String; 2])> {
        self.worn_for.take_change()
    }

    /// Whether the user has asked for a restart since the last call.
    pub fn take_restart(&mut self) -> bool {
        std::mem::take(&mut self.asks_restart)
    }

    /// Title of the scene.
    pub fn title(&self, ui: &mut Ui, player: &Player) {
        let title = &player.running().title;
        let label = ui.label(RichText::new(title).small().weak());
        spoken::heading(&label, title);
        label.on_hover_text(&player.running().description);
        ui.add_space(2.0);
    }

    /// All controls.
    pub fn ui(&mut self, ui: &mut Ui, player: &mut Player) {
        self.main_controls(ui, player);
        let table = player.pending().parameters();
        ui.separator();
        self.accuracy_ui(ui, player, &table);
        self.one_joint(ui, player);
        let mut groups: Vec<&'static str> = Vec::new();
        // The groups of the scene's author come first.
        let own = table.iter().filter(|p| p.scope == Scope::Own);
        for parameter in own.chain(table.iter().filter(|p| p.scope != Scope::Own)) {
            if !groups.contains(&parameter.group) {
                groups.push(parameter.group);
            }
        }
        for group in groups {
            let rest = || {
                let shown_elsewhere =
                    |p: &Parameter| FIRST.contains(&p.key) || p.key == PRESET || is_scene_parameter(p);
                table.iter().filter(move |p| p.group == group && !shown_elsewhere(p))
            };
            if rest().next().is_none() {
                continue;
            }
            ui.collapsing(RichText::new(group).strong(), |ui| {
                for parameter in rest() {
                    self.control(ui, player, parameter, parameter.key);
                }
            });
        }
    }

    /// The most important controls.
    pub fn main_controls(&mut self, ui: &mut Ui, player: &mut Player) {
        spoken::landmark(ui, "Parameters");
        let table = player.pending().parameters();
        for key in FIRST {
            if let Some(parameter) = table.iter().find(|p| p.key == key) {
                self.control(ui, player, parameter, key);
                ui.add_space(4.0);
            }
        }
        match self.worn_for.ui(ui, player) {
            Ok(restarts) => self.asks_restart |= restarts,
            // Its limit is that of the scene.
            Err(_) => self.worn_for.forget_draft(),
        }
        // Parameters defined by the scene's author.
        for parameter in table.iter().filter(|p| is_scene_parameter(p)) {
            self.control(ui, player, parameter, parameter.key);
            ui.add_space(4.0);
        }
    }

    /// The three contact parameters alone, the first in large type.
    pub fn contact_controls(&mut self, ui: &mut Ui, player: &mut Player) {
        spoken::landmark(ui, "Parameters");
        let (table, fingers) = (player.pending().parameters(), theme::has_fingers(ui));
        self.plain = true;
        for (place, key) in FIRST.into_iter().enumerate() {
            let Some(parameter) = table.iter().find(|p| p.key == key) else {
                continue;
            };
            ui.scope(|ui| {
                if place == 0 {
                    let style = ui.style_mut();
                    style.text_styles.values_mut().for_each(|font| font.size *= LARGE);
                    style.spacing.slider_rail_height *= LARGE;
                    if !fingers {
                        style.spacing.interact_size.y *= LARGE;
                    }
                }
                self.control(ui, player, parameter, key);
            });
            ui.add_space(4.0);
        }
        self.plain = false;
    }

    /// The preset, and the accuracy of the running scene.
    fn accuracy_ui(&mut self, ui: &mut Ui, player: &mut Player, table: &[&'static Parameter]) {
        let header = egui::CollapsingHeader::new(RichText::new("Accuracy").strong()).show(ui, |ui| {
            if let Some(parameter) = table.iter().find(|p| p.key == PRESET) {
                self.control(ui, player, parameter, PRESET);
            }
            accuracy::ui(ui, player);
        });
        header
            .header_response
            .on_hover_text("How far the numbers can be trusted. Method, step and tolerance are set under Solver.");
    }

    /// Contact parameters of a joint with play, which override those of the scene.
    fn one_joint(&mut self, ui: &mut Ui, player: &mut Player) {
        let names: Vec<String> = player.pending().machine.loose_joints.iter().map(|j| j.name.clone()).collect();
        if names.is_empty() {
            return;
        }
        self.joint = self.joint.min(names.len() - 1);
        if let Some(key) = &self.revealed {
            let is_own =
                |name: &String| key.strip_prefix("joint.").is_some_and(|rest| rest.starts_with(&format!("{name}.")));
            self.joint = names.iter().position(is_own).unwrap_or(self.joint);
        }
        let opens = self.revealed.is_some().then_some(true);
        let header = egui::CollapsingHeader::new(RichText::new("One joint").strong()).open(opens).show(ui, |ui| {
            ui.horizontal(|ui| {
                ui.label("Joint");
                layout::choice(ui, ["Joint", ""], None, &mut self.joint, 0..names.len(), |index| names[index].as_str());
            });
            let keys: Vec<String> = player.pending().joint_keys(self.joint).collect();
            for key in keys {
                if let Ok(parameter) = player.pending().parameter(&key) {
                    self.control(ui, player, parameter, &key);
                }
            }
        });
        if header.fully_open() {
            self.revealed = None;
        }
        header.header_response.on_hover_text("Values of one joint only; they override those of the whole scene.");
    }

    /// Control of a parameter under `key`, which may belong to a joint.
    fn control(&mut self, ui: &mut Ui, player: &mut Player, parameter: &'static Parameter, key: &str) {
        // A key missing in the scene (e.g. after shortening a chain) has no control.
        let Ok(now) = player.pending().get(key) else {
            return;
        };
        let name = match key.strip_prefix("joint.").and_then(|rest| rest.rsplit_once('.')) {
            Some((joint, _)) => {
                format!("{} of {}", parameter.label, joint.strip_suffix(".play").unwrap_or(joint))
            }
            None => parameter.label.to_owned(),
        };
        let room = theme::side(ui, UNDO_SIDE)
            + match &parameter.kind {
                Kind::Number { .. } if Self::has_value_beside(ui) => -theme::side(ui, UNDO_SIDE),
                Kind::Number { .. } => 92.0,
                Kind::Choice(_) => 168.0,
                Kind::Count { .. } => 78.0,
            };
        let plain = self.plain.then(|| FIRST.iter().position(|first| *first == key)).flatten();
        let row = Row { parameter, key, name, now, room, plain: plain.map(|place| FIRST_WORDS[place]) };
        ui.push_id(key, |ui| match &parameter.kind {
            Kind::Number { .. } => self.number(ui, player, &row),
            Kind::Choice(words) => self.choice(ui, player, &row, words),
            Kind::Count { min, max } => self.count(ui, player, &row, (*min, *max)),
        });
    }

    /// A sign beside the name of `row` if something is to be said about its value, which opens with the remedy. It has its place
    /// whether it is shown or not, so that it moves nothing.
    fn note(&mut self, ui: &mut Ui, player: &mut Player, row: &Row) {
        let waits = player.is_pending(row.key);
        let advice = player.warning(row.key).cloned();
        let moving = player.moving_play(row.key).map(|play| {
            let now = value::typeset(&format_quantity_digits(play, "mm", 3));
            let rate = value::typeset(&format_quantity_digits(CLEARANCE_SPEED, "mm/s", 3));
            (
                format!("now {now}"),
                format!("It moves to this value at {rate}, so that no wall strikes what is in its way."),
            )
        });
        let brief = match (&advice, &moving) {
            _ if waits => "at restart",
            (_, Some((now, _))) => now,
            (Some(advice), None) => &*advice.brief,
            (None, None) => return,
        };
        let said: Vec<&str> = (waits.then_some(WAITS).into_iter())
            .chain(moving.as_ref().map(|(_, words)| &**words))
            .chain(advice.as_ref().map(|own| &*own.words))
            .collect();
        let said = said.join(" ");
        let colour = ui.visuals().warn_fg_color;
        let text = |words: &str| RichText::new(words).small().strong().color(colour);
        let whole = format!("! {brief}");
        let font = egui::TextStyle::Small.resolve(ui.style());
        let fits = ui.painter().layout_no_wrap(whole.clone(), font, colour).size().x + 2.0 * SIGN_PADDING
            <= ui.available_width() - row.room - ui.spacing().item_spacing.x;
        // No higher than the name beside it.
        ui.spacing_mut().button_padding = egui::vec2(SIGN_PADDING, 0.0);
        let line = ui.text_style_height(&egui::TextStyle::Body);
        let sign = egui::Button::new(text(if fits { &whole } else { "!" })).min_size(egui::vec2(SIGN_WIDTH, line));
        let sign = ui.scope(|ui| {
            ui.spacing_mut().interact_size.y = line;
            ui.add(sign)
        });
        let sign = sign.inner;
        let popup = Popup::from_toggle_button_response(&sign)
            .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
            .align(RectAlign::BOTTOM_START)
            .width(NOTE_WIDTH);
        popup.show(|ui| {
            ui.set_max_width(NOTE_WIDTH);
            ui.label(&said);
            if (waits || moving.is_some()) && ui.button("Restart now").clicked() {
                self.asks_restart = true;
                ui.close();
            }
            if let Some(remedy) = advice.as_ref().and_then(|own| own.remedy.as_ref())
                && ui.button(&remedy.label).clicked()
            {
                self.set(player, &remedy.key_for(row.key), &remedy.value);
                ui.close();
            }
        });
        let sign = if Popup::is_id_open(ui.ctx(), Popup::default_response_id(&sign)) {
            sign
        } else {
            sign.on_hover_text(&said)
        };
        sign.accessible_name(format!("{}: {said}", row.name));
    }

    fn number(&mut self, ui: &mut Ui, player: &mut Player, row: &Row) {
        let Value::Number(si) = row.now else {
            return;
        };
        if Self::has_value_beside(ui) {
            // Slider and value share a row, so that a phone shows three controls.
            ui.spacing_mut().item_spacing.y = 0.0;
            let size = egui::vec2(ui.available_width(), ui.text_style_height(&egui::TextStyle::Body));
            ui.allocate_ui_with_layout(size, egui::Layout::left_to_right(egui::Align::Center), |ui| {
                label(ui, player, row);
                self.note(ui, player, row);
            });
            let size = egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
            let backwards = egui::Layout::right_to_left(egui::Align::Center);
            ui.allocate_ui_with_layout(size, backwards, |ui| {
                self.entry(ui, player, row);
                self.default_button(ui, player, row);
                self.slider(ui, player, row, si);
            });
            return;
        }
        theme::use_dense_rows(ui);
        self.heading(ui, player, row, |this, ui, player| {
            this.default_button(ui, player, row);
            this.entry(ui, player, row);
        });
        self.slider(ui, player, row, si);
    }

    /// Whether the value of a number stands beside its slider.
    fn has_value_beside(ui: &Ui) -> bool {
        theme::has_fingers(ui) && ui.available_width() > MIN_WIDTH_WITH_VALUE
    }

    /// A slider of the available width; `si` is the position of its handle.
    fn slider(&mut self, ui: &mut Ui, player: &mut Player, row: &Row, si: f64) {
        let Kind::Number { display, slider, logarithmic, .. } = row.parameter.kind else {
            return;
        };
        let mut shown = to_display(si, display);
        let (least, greatest) = (to_display(slider.0, display), to_display(slider.1, display));
        ui.spacing_mut().slider_width = ui.available_width().max(40.0);
        // Dragging steps through round values; on a logarithmic scale, through values of three digits.
        let decimals = if logarithmic { None } else { Some(value::decimals(greatest - least)) };
        let slider = Slider::new(&mut shown, least..=greatest)
            .logarithmic(logarithmic)
            .max_decimals_opt(decimals)
            .clamping(SliderClamping::Never)
            .show_value(false);
        let response = keys::slider(ui, slider, [least, greatest]);
        tooltip(ui, &response, player, row);
        if self.revealed.as_deref() == Some(row.key) {
            response.request_focus();
            response.scroll_to_me(None);
        }
        let changed = response.changed();
        spoken::value(&response, &row.shown());
        response.accessible_name(&row.name);
        if changed {
            let digits = if logarithmic { 3 } else { 6 };
            self.set(player, row.key, &format_quantity_digits(from_display(shown, display), display, digits));
        }
    }

    fn choice(&mut self, ui: &mut Ui, player: &mut Player, row: &Row, words: &[&'static str]) {
        self.heading(ui, player, row, |this, ui, player| {
            this.default_button(ui, player, row);
            let mut chosen = None;
            let width = ui.available_width().min(170.0);
            let text = if row.now == Value::Unset { "custom".to_owned() } else { row.shown() };
            let response = ComboBox::from_id_salt("choice")
                .width(width)
                .truncate()
                .selected_text(text)
                .show_ui(ui, |ui| {
                    for word in words {
                        if ui.selectable_label(row.now == Value::Choice(word), *word).clicked() {
                            chosen = Some(*word);
                        }
                    }
                })
                .response;
            tooltip(ui, &response, player, row);
            response.accessible_name(&row.name);
            if let Some(word) = chosen {
                this.set(player, row.key, word);
            }
        });
    }

    fn count(&mut self, ui: &mut Ui, player: &mut Player, row: &Row, (min, max): (u64, u64)) {
        let Value::Count(mut count) = row.now else {
            return;
        };
        self.heading(ui, player, row, |this, ui, player| {
            this.default_button(ui, player, row);
            let response = ui.add(DragValue::new(&mut count).range(min..=max).update_while_editing(false));
            tooltip(ui, &response, player, row);
            let changed = response.changed();
            response.accessible_name(&row.name);
            if changed {
                this.set(player, row.key, &count.to_string());
            }
        });
    }

    /// Name on the left with the sign of a note, and the widgets of `rest` from the right; on a line below without room for them.
    fn heading(
        &mut self,
        ui: &mut Ui,
        player: &mut Player,
        row: &Row,
        rest: impl FnOnce(&mut Self, &mut Ui, &mut Player),
    ) {
        let font = egui::TextStyle::Body.resolve(ui.style());
        let colour = ui.visuals().text_color();
        let name = row.parameter.label;
        let words = ui.painter().layout_no_wrap(name.to_owned(), font, colour);
        let gap = ui.spacing().item_spacing.x;
        let below = words.size().x + gap + SIGN_WIDTH + row.room > ui.available_width();
        let backwards = egui::Layout::right_to_left(egui::Align::Center);
        let mut rest = Some(rest);
        ui.horizontal(|ui| {
            label(ui, player, row);
            self.note(ui, player, row);
            if !below && let Some(rest) = rest.take() {
                ui.with_layout(backwards, |ui| rest(self, ui, player));
            }
        });
        if let Some(rest) = rest {
            let size = egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
            ui.allocate_ui_with_layout(size, backwards, |ui| rest(self, ui, player));
        }
    }

    /// Text field; invalid input remains for correction.
    fn entry(&mut self, ui: &mut Ui, player: &mut Player, row: &Row) {
        let shown = row.shown();
        let mut text = self.drafts.get(row.key).map_or_else(|| shown.clone(), |draft| draft.text.clone());
        let font = fitting_font(ui, &text, ENTRY_WIDTH - 2.0 * f32::from(ENTRY_MARGIN));
        let edit = TextEdit::singleline(&mut text)
            .font(font)
            .desired_width(ENTRY_WIDTH)
            .min_size(egui::vec2(0.0, ui.spacing().interact_size.y))
            .align(egui::Align2::RIGHT_CENTER)
            .background_color(ui.visuals().faint_bg_color)
            .margin(egui::Margin::symmetric(ENTRY_MARGIN, 3));
        let mut edit = edit.show(ui);
        let response = edit.response.response;
        if response.gained_focus() {
            // What is typed takes the place of the value.
            let all = CCursorRange::two(CCursor::new(0), CCursor::new(text.chars().count()));
            edit.state.cursor.set_char_range(Some(all));
            edit.state.store(ui.ctx(), response.id);
        }
        if response.changed() {
            self.drafts.insert(row.key.to_owned(), Draft { text: text.clone(), error: None });
        }
        if response.lost_focus() {
            if ui.input(|i| i.key_pressed(egui::Key::Escape)) {
                self.drafts.remove(row.key);
            } else if text != shown {
                self.set(player, row.key, &value::with_display_unit(&text, &row.parameter.kind));
                if let Some(draft) = self.drafts.get_mut(row.key) {
                    draft.text = text;
                }
            }
        }
        match self.drafts.get(row.key).and_then(|draft| draft.error.as_ref()) {
            // Over the controls below, which stay where they are.
            Some(error) => Tooltip::always_open(ui.ctx().clone(), ui.layer_id(), response.id.with("error"), &response)
                .show(|ui| drop(theme::error(ui, value::typeset(error)))),
            None => {
                tooltip(ui, &response, player, row);
                None
            }
        };
        response.accessible_name(&row.name);
    }

    fn default_button(&mut self, ui: &mut Ui, player: &mut Player, row: &Row) {
        let size = theme::side(ui, UNDO_SIDE);
        // Reserves the space without a button, so that rows stay aligned.
        let Some(original) = player.original(row.key).filter(|original| *original != row.now) else {
            ui.allocate_space(egui::Vec2::splat(size));
            return;
        };
        let help = format!("Back to {}", value::shown(&original, &row.parameter.kind));
        let label = format!("Reset {}", row.name);
        if icon_button(ui, Icon::Undo, &label, &help, size, false).clicked() {
            let outcome = player.set_original(row.key);
            self.apply_outcome(row.key, "", outcome);
        }
    }

    fn set(&mut self, player: &mut Player, key: &str, text: &str) {
        let outcome = player.set(key, text);
        self.apply_outcome(key, text, outcome);
    }

    /// Clears the draft of an accepted value; a rejected one remains, with the reason.
    fn apply_outcome(&mut self, key: &str, text: &str, outcome: Result<Effect, SetError>) {
        match outcome {
            Ok(Effect::Now | Effect::AtReset) => {
                self.drafts.remove(key);
            }
            Err(error) => {
                // The message omits the key, which the control shows.
                let reason = match error {
                    SetError::Scene(SceneError { value: Some(value), message, .. }) => {
                        format!("{value}: {message}")
                    }
                    SetError::Scene(error) => error.message,
                    SetError::Change(error) => error.to_string(),
                };
                let draft = Draft { text: text.to_owned(), error: Some(reason) };
                self.drafts.insert(key.to_owned(), draft);
            }
        }
    }
}

/// Label of the parameter.
fn label(ui: &mut Ui, player: &Player, row: &Row) {
    let name = RichText::new(row.parameter.label);
    let has_effect = equations::without_effect(row.key, player.pending()).is_none();
    let label = ui.label(match FIRST.contains(&row.key) {
        _ if !has_effect => name.weak(),
        true => name.strong(),
        false => name,
    });
    tooltip(ui, &label, player, row);
}

/// Body font, reduced so that the text fits into `room` (points): a truncated unit reads as another unit.
fn fitting_font(ui: &Ui, text: &str, room: f32) -> FontId {
    let body = egui::TextStyle::Body.resolve(ui.style());
    let colour = ui.visuals().text_color();
    let width = ui.painter().layout_no_wrap(text.to_owned(), body.clone(), colour).size().x;
    // Rounded down to half points, which limits the number of cached glyph sizes.
    let size = (2.0 * body.size * (room / width).clamp(0.7, 1.0)).floor() / 2.0;
    FontId::new(size, body.family)
}

/// Whether a control was pressed and the pointer has not left it since: what it does is then to be seen, with nothing over it.
fn is_in_use(ui: &Ui, response: &Response) -> bool {
    let id = response.id.with("in use");
    if response.is_pointer_button_down_on() {
        ui.data_mut(|data| data.insert_temp(id, true));
    } else if !response.contains_pointer() {
        ui.data_mut(|data| data.remove_temp::<bool>(id));
    }
    ui.data(|data| data.get_temp(id)).unwrap_or(false)
}

/// Tooltip above or below a control within its panel: the control in use and the picture stay visible.
pub(super) fn panel_tooltip(ui: &Ui, response: &Response, words: impl FnOnce(&mut Ui)) {
    if is_in_use(ui, response) {
        return;
    }
    const ABOVE: [RectAlign; 1] = [RectAlign::TOP_START];
    let panel = ui.clip_rect().x_range();
    let row = Rect::from_x_y_ranges(panel, response.rect.y_range());
    let frame = Frame::popup(ui.style()).total_margin().sum().x;
    let mut tooltip = Tooltip::for_enabled(response).width(panel.span() - frame);
    tooltip.popup = tooltip.popup.anchor(row).align(RectAlign::BOTTOM_START).align_alternatives(&ABOVE);
    tooltip.show(words);
}

/// The same with what is to be said of a parameter.
fn tooltip(ui: &Ui, response: &Response, player: &Player, row: &Row) {
    let Row { parameter, key, plain, .. } = *row;
    panel_tooltip(ui, response, |ui| {
        ui.strong(parameter.label);
        if let Some(words) = plain {
            ui.label(words);
            return;
        }
        ui.label(value::typeset(parameter.help));
        let shown_law = equations::law(key, player.pending());
        if let Some(shown_law) = &shown_law {
            ui.label(RichText::new(format!("{}: {}", shown_law.law, shown_law.formula)).small());
        }
        let equation = shown_law.and_then(|shown_law| shown_law.elsewhere).unwrap_or(parameter.equation);
        if !equation.is_empty() {
            ui.label(RichText::new(equation).small());
        }
        if let Some(reason) = equations::without_effect(key, player.pending()) {
            ui.label(RichText::new(format!("Without effect: {reason}")).small());
        }
        let mut range = value::typeset(&parameter.range());
        if parameter.key == "contact.clearance"
            && let Ok(Value::Number(radius)) = player.pending().get(&key.replace("clearance", "ball_radius"))
        {
            range = format!("{range} ({})", value::quantity(radius, "mm", 6));
        }
        ui.label(RichText::new(format!("Range {range}")).small());
        ui.label(RichText::new(format!("Key {key}")).small().weak());
        if parameter.at_reset {
            let when = if parameter.scope == Scope::Own {
                "Applies at the next restart; at once where only contacts, gravity, springs, loads or motors depend on it"
            } else {
                "Applies at the next restart"
            };
            ui.label(RichText::new(when).small());
        }
    });
}

/// Whether a parameter is the scene's own, in no group.
fn is_scene_parameter(parameter: &Parameter) -> bool {
    parameter.scope == Scope::Own && parameter.group == OWN_GROUP
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_value_fits_into_its_entry() {
        let ctx = egui::Context::default();
        theme::apply(&ctx, false);
        let mut output = ctx.run_ui(egui::RawInput::default(), |ui| {
            let room = ENTRY_WIDTH - 2.0 * f32::from(ENTRY_MARGIN);
            let width = |text: &str| {
                let font = fitting_font(ui, text, room);
                let galley = ui.painter().layout_no_wrap(text.to_owned(), font.clone(), egui::Color32::BLACK);
                (font.size, galley.size().x)
            };
            assert_eq!(width("0.3 mm").0, 14.0);
            let (size, across) = width("0.568462 mm");
            assert!((10.0..14.0).contains(&size) && across <= room, "{size} {across}");
        });
        // Nothing is uploaded.
        output.textures_delta.clear();
    }
}
