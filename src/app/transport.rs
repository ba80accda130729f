//! Transport bar: play, step, reset, time scale, and what keeps the run below it.

use eframe::egui::{
    self, ComboBox, FocusDirection, Id, Key, RichText, Sense, Slider, TextStyle, TextWrapMode, Ui, Vec2, WidgetText,
};

use super::icons::{Icon, icon_button};
use super::keys::Action;
use super::player::Player;
use super::{keys, spoken, theme, timeline, value};
use crate::session::pace::{Limit, SCALE_RANGE};

/// Time scales in the list.
pub const SCALES: [f64; 8] = [1.0, 0.5, 0.1, 0.05, 0.02, 0.01, 1e-3, 1e-4];

/// Width of the list of time scales, points: fits the longest entry.
const SCALES_WIDTH: f32 = 94.0;
/// Width of the buttons for ten times slower and faster in touch size, points.
const TENS_WIDTH: f32 = 116.0;
/// Width of the achieved time scale without its limit, points.
const LIMIT_WIDTH: f32 = 120.0;
/// Drag distance from one time scale to the next, points.
const SCALE_DISTANCE: f32 = 20.0;

/// Width of [`row`] with its buttons and the list of time scales in touch size, points.
pub const MIN_WIDTH: f32 = 306.0;

/// Key under which the play button's ID is stored between frames.
const FIRST_STOP_KEY: &str = "first stop of Tab";

/// Size of the play button, points.
pub const PLAY_SIDE: f32 = 40.0;

/// The neighbour of `scale` in [`SCALES`], faster or slower.
pub fn next_scale(scale: f64, faster: bool) -> f64 {
    if faster {
        SCALES.iter().rev().copied().find(|&s| s > scale * 1.0001).unwrap_or(SCALES[0])
    } else {
        SCALES.iter().copied().find(|&s| s < scale * 0.9999).unwrap_or(SCALES[SCALES.len() - 1])
    }
}

/// The bar in one row, or in two if it is narrow. Returns what the user asked for that affects more than the player.
pub fn ui(ui: &mut Ui, player: &mut Player) -> Option<Action> {
    let narrow = ui.available_width() < 620.0;
    let row = egui::Layout::left_to_right(egui::Align::Center);
    let size = egui::vec2(ui.available_width(), theme::side(ui, PLAY_SIDE));
    let asked = ui
        .allocate_ui_with_layout(size, row, |ui| {
            let asked = buttons(ui, player);
            time(ui, player);
            if !narrow {
                ui.add_space(6.0);
                speed(ui, player, narrow);
                settled_hint(ui, player);
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| timeline::key(ui, player));
            }
            asked
        })
        .inner;
    if narrow {
        ui.horizontal(|ui| {
            speed(ui, player, narrow);
            settled_hint(ui, player);
        });
    }
    asked
}

/// The bar in one row, without items that do not fit; the time is above the picture, and the limit possibly [below](limit_below).
/// Returns as [`ui`].
pub fn row(ui: &mut Ui, player: &mut Player, has_limit: bool) -> Option<Action> {
    ui.horizontal(|ui| {
        let asked = buttons(ui, player);
        if ui.available_width() >= SCALES_WIDTH {
            scales(ui, player);
        }
        if ui.available_width() >= LIMIT_WIDTH + TENS_WIDTH {
            tens(ui, player);
        }
        if has_limit && ui.available_width() > LIMIT_WIDTH {
            limit(ui, player);
        }
        settled_hint(ui, player);
        asked
    })
    .inner
}

/// The buttons and the list of time scales alone. Returns as [`ui`].
pub fn minimal(ui: &mut Ui, player: &mut Player) -> Option<Action> {
    let asked = buttons(ui, player);
    scales(ui, player);
    asked
}

/// Hint for a settled run, at the right end, where it displaces nothing.
fn settled_hint(ui: &mut Ui, player: &Player) {
    if !player.is_playing() || !player.has_settled() || ui.available_width() < 180.0 {
        return;
    }
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
        let (words, help) = if player.is_driven() {
            (
                "No rattling. Press R to restart",
                "The drives move the machine, but the motion relative to them has ended: for an eighth of their period no \
                 ball with play has left its socket's wall or moved along it by more than 15 % of the clearance, and no \
                 load has changed by more than 25 %",
            )
        } else {
            (
                "At rest. Press R to restart",
                "No drive moves, and for 0.5 s no point of a body has moved by more than 15 % of the smallest clearance",
            )
        };
        ui.label(RichText::new(words).weak()).on_hover_text(help);
    });
}

/// Focuses the play button on Tab if nothing has the focus: most users come to play, and header and parameters are many stops
/// away. From there Tab cycles through all controls. Call it before any widget is shown.
pub fn set_first_tab_stop(ui: &Ui) {
    let play = ui.data_mut(|data| data.remove_temp::<Option<Id>>(Id::unique(FIRST_STOP_KEY)).flatten());
    let tab = ui.input(|input| input.key_pressed(Key::Tab) && !input.modifiers.shift);
    if let Some(play) = play.filter(|_| tab && ui.memory(|memory| memory.focused().is_none())) {
        ui.memory_mut(|memory| {
            memory.request_focus(play);
            memory.move_focus(FocusDirection::None);
        });
    }
}

/// To the start, play, step and restart. Returns as [`ui`].
fn buttons(ui: &mut Ui, player: &mut Player) -> Option<Action> {
    let (small, large) = (theme::side(ui, 30.0), theme::side(ui, PLAY_SIDE));
    let mut asked = None;
    // The others come first where there is little room; a drag on the timeline goes to the start, too.
    if ui.available_width() > MIN_WIDTH + small + ui.spacing().item_spacing.x {
        let past = player.pacer.shown() > 0.0;
        ui.add_enabled_ui(past, |ui| {
            let help = "To the start of the run, which keeps what has been computed (key Home)";
            if icon_button(ui, Icon::Start, "Start of the run", help, small, false).clicked() {
                asked = Some(Action::Home);
            }
        });
    }
    let help = if player.has_pending_changes() {
        "Runs again from t = 0 with the changes that wait for it (key R)"
    } else {
        "Runs again from t = 0 (key R)"
    };
    let (icon, name, play_help) = if player.is_playing() {
        (Icon::Pause, "Pause", "Pause (space)")
    } else {
        (Icon::Play, "Play", "Play (space)")
    };
    let runs = player.stopped().is_none();
    ui.add_enabled_ui(runs, |ui| {
        let play = icon_button(ui, icon, name, play_help, large, true);
        if ui.is_enabled() {
            ui.data_mut(|data| data.insert_temp(Id::unique(FIRST_STOP_KEY), Some(play.id)));
        }
        if play.clicked() {
            player.set_playing(!player.is_playing());
        }
        let step_help = "One step of the solver (right arrow; left arrow takes it back)";
        if icon_button(ui, Icon::Step, "Step", step_help, small, false).clicked() {
            player.single_step();
        }
    });
    if ui.add(egui::Button::new("Restart").min_size(Vec2::splat(small))).on_hover_text(help).clicked() {
        asked = Some(Action::Reset);
    }
    ui.add_space(6.0);
    asked
}

/// Fixed size for any time, so that neighbours do not move when digits change.
fn clock(ui: &Ui) -> Vec2 {
    let font = egui::TextStyle::Monospace.resolve(ui.style());
    let digits = "0".repeat(value::MAX_TIME_CHARACTERS);
    let galley = ui.painter().layout_no_wrap(digits, font, egui::Color32::PLACEHOLDER);
    galley.size().ceil()
}

fn time(ui: &mut Ui, player: &Player) {
    let time = RichText::new(value::time(player.pacer.shown()));
    let label = egui::Label::new(time.monospace().strong()).halign(egui::Align::RIGHT);
    ui.add_sized(clock(ui), label).on_hover_text("Simulated time");
}

fn speed(ui: &mut Ui, player: &mut Player, narrow: bool) {
    let mut scale = player.pacer.scale();
    ui.label("Time scale").on_hover_text(
        "Simulated time over real time: at 1:50 a second shows a fiftieth of a simulated second (keys \
                        + and -)",
    );
    ui.spacing_mut().slider_width = if narrow { 90.0 } else { 150.0 };
    let slider = Slider::new(&mut scale, SCALE_RANGE.0..=SCALE_RANGE.1).logarithmic(true).show_value(false);
    let response = keys::slider(ui, slider, [SCALE_RANGE.0, SCALE_RANGE.1])
        .on_hover_text("1:1 is real time, 1:10 000 the slowest motion");
    if response.changed() {
        player.pacer.set_scale(scale);
    }
    spoken::value(&response, &value::time_scale(scale).replace(':', " to "));
    response.accessible_name("Time scale");
    scales(ui, player);
    if !narrow && ui.available_width() >= TENS_WIDTH {
        tens(ui, player);
    }
    limit(ui, player);
}

/// Buttons for a tenth and ten times the time scale.
fn tens(ui: &mut Ui, player: &mut Player) {
    let now = player.pacer.scale();
    for (words, name, scale) in [("÷10", "Ten times slower", now / 10.0), ("×10", "Ten times faster", now * 10.0)] {
        let possible = (SCALE_RANGE.0 * 0.999..=SCALE_RANGE.1 * 1.001).contains(&scale);
        let button = ui.add_enabled(possible, egui::Button::new(words));
        let help = format!("{name}: {}", value::time_scale(scale.clamp(SCALE_RANGE.0, SCALE_RANGE.1)));
        let button = button.on_hover_text(help).on_disabled_hover_text("At the end of the range of time scales");
        if button.clicked() {
            player.pacer.set_scale(scale.clamp(SCALE_RANGE.0, SCALE_RANGE.1));
        }
        button.accessible_name(name);
    }
}

/// Selection of the time scale: the list, or a drag across it.
fn scales(ui: &mut Ui, player: &mut Player) {
    let list = ComboBox::from_id_salt("time scale")
        .width(SCALES_WIDTH)
        .truncate()
        .selected_text(value::time_scale(player.pacer.scale()))
        .show_ui(ui, |ui| {
            for preset in SCALES {
                let chosen = (player.pacer.scale() / preset - 1.0).abs() < 1e-3;
                if ui.selectable_label(chosen, value::time_scale(preset)).clicked() {
                    player.pacer.set_scale(preset);
                }
            }
        })
        .response
        .on_hover_text("Simulated time over real time: choose a value, or drag to the right for faster")
        .accessible_name("Time scale preset");
    // The list itself senses the drag: a separate widget on top would intercept its clicks.
    let drag = list.interact(Sense::DRAG);
    if !drag.dragged() {
        return;
    }
    // Part of the drag already used by passed time scales.
    let used: Option<f32> = ui.data(|data| data.get_temp(drag.id));
    let mut used = used.filter(|_| !drag.drag_started()).unwrap_or(0.0);
    let travel = drag.total_drag_delta().unwrap_or_default().x;
    while (travel - used).abs() >= SCALE_DISTANCE {
        let faster = travel > used;
        player.pacer.set_scale(next_scale(player.pacer.scale(), faster));
        used += SCALE_DISTANCE.copysign(travel - used);
    }
    ui.data_mut(|data| data.insert_temp(drag.id, used));
}

/// What limits the run, in the rest of the row below a narrow [`row`].
pub fn limit_below(ui: &mut Ui, player: &Player) {
    if ui.available_width() < LIMIT_WIDTH {
        // Smaller text beside an additional tab.
        let styles = &mut ui.style_mut().text_styles;
        if let Some(small) = styles.get(&egui::TextStyle::Small).cloned() {
            styles.insert(egui::TextStyle::Body, small);
        }
    }
    limit(ui, player);
}

/// What the window says of a run that does not keep up with its time scale. It changes rarely enough to be read, and says nothing
/// while the run keeps up: the list beside it shows the time scale then.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ShownLimit {
    /// Requested time scale that it refers to.
    requested: f64,
    /// Instant of the next reading, s.
    next: f64,
    /// Achieved time scale, and its limit.
    shown: Option<(f64, Limit)>,
    /// Successive readings that contradict it.
    contradictions: u32,
}

impl ShownLimit {
    /// Time between two readings, s.
    const READING: f64 = 0.5;
    /// Number of successive readings that replace one limit by another or by none.
    const REPLACED_AFTER: u32 = 4;

    /// Takes what limits a run with the time scale `requested` at `now`, s, if a reading is due.
    fn read(&mut self, now: f64, requested: f64, limit: Option<(f64, Limit)>) {
        if self.requested != requested {
            *self = Self { requested, next: now + Self::READING, ..Self::default() };
        }
        if now < self.next {
            return;
        }
        self.next = now + Self::READING;
        let kind = |limit: Option<(f64, Limit)>| limit.map(|(_, kind)| kind);
        let agrees = kind(limit) == kind(self.shown);
        self.contradictions = if agrees { 0 } else { self.contradictions + 1 };
        if agrees || self.shown.is_none() || self.contradictions >= Self::REPLACED_AFTER {
            (self.shown, self.contradictions) = (limit, 0);
        }
    }
}

/// The achieved time scale and what limits it, if it is below the requested one.
fn limit(ui: &mut Ui, player: &Player) {
    let key = Id::unique("shown limit");
    if !player.is_playing() {
        ui.data_mut(|data| data.remove::<ShownLimit>(key));
        return;
    }
    let (now, requested) = (ui.input(|input| input.time), player.pacer.scale());
    let mut shown: ShownLimit = ui.data(|data| data.get_temp(key)).unwrap_or_default();
    shown.read(now, requested, player.pacer.reached_scale().zip(player.limit()));
    ui.data_mut(|data| data.insert_temp(key, shown));
    let Some((achieved, limit)) = shown.shown else {
        return;
    };
    let (by, help) = match limit {
        Limit::Computing => (
            "computing",
            "This computer cannot step as fast as the time scale asks. The simulation runs slower and skips nothing. \
             A looser tolerance or the preset preview helps.",
        ),
        Limit::Drawing => (
            "drawing",
            "Drawing takes too much time for the time scale. The simulation runs slower and skips nothing. A smaller \
             window, fewer plots and fewer instruments help.",
        ),
    };
    let achieved = value::rounded_time_scale(achieved);
    // Without room, only the tooltip says what limits it.
    let words = [format!("{by} allows only {achieved}"), format!("only {achieved}")];
    let colour = ui.visuals().warn_fg_color;
    let [long, short] = words.map(|words| {
        let words = WidgetText::from(RichText::new(words).color(colour));
        words.into_galley(ui, Some(TextWrapMode::Extend), f32::INFINITY, TextStyle::Body)
    });
    ui.label(if long.size().x <= ui.available_width() { long } else { short }).on_hover_text(help);
}

/// Banner of a run that the divergence guard stopped. Returns whether the user asked for a restart.
pub fn banner(ui: &mut Ui, player: &Player) -> bool {
    let Some(stopped) = player.stopped() else {
        return false;
    };
    let colour = ui.visuals().error_fg_color;
    egui::Frame::new()
        .fill(ui.visuals().window_fill)
        .stroke(egui::Stroke::new(1.0, colour))
        .corner_radius(6.0)
        .inner_margin(10.0)
        .show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new(format!("Stopped at {}", value::time(stopped.time))).strong().color(colour));
                ui.label(stopped.fault.to_string());
                ui.label(stopped.advice.to_string());
                ui.button("Restart the run").clicked()
            })
            .inner
        })
        .inner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_read_twice_a_second_and_replaced_only_after_two_seconds() {
        let mut shown = ShownLimit::default();
        let (slow, fast) = ((0.3, Limit::Drawing), (0.31, Limit::Drawing));
        let mut at = |ticks: u32, limit| {
            shown.read(f64::from(ticks) * 0.1, 0.5, limit);
            shown.shown
        };
        assert_eq!(at(0, Some(slow)), None, "the first half second measures");
        assert_eq!(at(5, Some(slow)), Some(slow));
        assert_eq!(at(9, Some(fast)), Some(slow));
        assert_eq!(at(10, Some(fast)), Some(fast));
        // At the threshold, and between two causes, the words stand still.
        let others = [None, Some((0.3, Limit::Computing)), None];
        for (count, other) in others.into_iter().enumerate() {
            assert_eq!(at(15 + 5 * count as u32, other), Some(fast));
        }
        assert_eq!(at(30, Some(slow)), Some(slow));
        for ticks in [35, 40, 45] {
            assert_eq!(at(ticks, None), Some(slow));
        }
        assert_eq!(at(50, None), None);
    }

    #[test]
    fn the_scale_keys_walk_the_list_both_ways_and_stop_at_its_ends() {
        assert_eq!(next_scale(0.02, true), 0.05);
        assert_eq!(next_scale(0.02, false), 0.01);
        assert_eq!(next_scale(0.03, true), 0.05);
        assert_eq!(next_scale(1.0, true), 1.0);
        assert_eq!(next_scale(1e-4, false), 1e-4);
    }
}
