//! Timeline of the whole run. A lane per joint with play shows free flight, sliding, creep and contact onsets, each at the height of
//! the end or wall that touches; flags mark user actions. A click or a drag displays any instant.

use eframe::egui::{
    self, Color32, EventFilter, Key, Mesh, Pos2, Rect, Response, Sense, Shape, Stroke, Ui, WidgetInfo,
    accesskit::{Action, ActionData},
    pos2, vec2,
};

use super::icons::{Icon, icon_button};
use super::player::contact_history::ContactHistory;
use super::player::{Flag, Player};
use super::zoom::{self, Zoom};
use super::{spoken, theme, value};
use crate::machine::{LooseKind, Pin, Slide};
use crate::simulate::{ContactMode, RECORDED_JOINTS};

/// Height of the row of flags, and total height of the lanes, points.
const FLAGS_HEIGHT: f32 = 9.0;
const LANES_HEIGHT: f32 = 24.0;
/// Height of a lane among many, and largest height of all lanes, points.
const LANE_HEIGHT: f32 = 4.0;
/// Height of a lane of a joint that can touch at several places, points.
const PLACES_LANE_HEIGHT: f32 = 12.0;
const MAX_LANES_HEIGHT: f32 = 56.0;
/// Window height below which only a low strip is shown, points.
const MIN_WINDOW_HEIGHT: f32 = 360.0;
/// The shortest time range shown, s.
const MIN_RANGE: f64 = 1e-6;
/// Opacity of abandoned and future parts.
const PALE_OPACITY: f32 = 0.35;
/// Fraction of the shown time range per arrow key press.
const KEY_FRACTION: f64 = 0.01;
/// Largest distance at which the pointer hits a flag, points.
const HIT_DISTANCE: f32 = 6.0;

/// State of the timeline strip.
#[derive(Default)]
pub struct Timeline {
    /// Time range shown, s; the whole run unless the user has zoomed.
    zoomed: Option<(f64, f64)>,
}

impl Timeline {
    /// Shows the whole run again.
    pub fn reset(&mut self) {
        self.zoomed = None;
    }

    /// The row: buttons for previous impact, next impact and reverse playback, and the strip. `focus`: the joint whose
    /// impacts are visited. Returns whether the displayed instant changed.
    pub fn ui(&mut self, ui: &mut Ui, player: &mut Player, focus: Option<usize>) -> bool {
        if ui.ctx().content_rect().height() < MIN_WINDOW_HEIGHT {
            return self.strip(ui, player, FLAGS_HEIGHT + 0.6 * LANES_HEIGHT);
        }
        let side = theme::side(ui, 26.0);
        let mut moved = false;
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let target = focus.and_then(|joint| player.running().machine.loose_joints.get(joint));
            let target = target.map_or("any joint".to_owned(), |joint| joint.name.clone());
            let past = player.pacer.shown() > 0.0;
            ui.add_enabled_ui(past, |ui| {
                let help = format!("To the peak of the previous impact of {target} (key ,)");
                if icon_button(ui, Icon::Before, "Previous impact", &help, side, false).clicked() {
                    player.go_to_impact(focus, false);
                    moved = true;
                }
                let help = "Play backwards to the start (key J)";
                let backwards = player.is_playing_backwards();
                let (icon, name) =
                    if backwards { (Icon::Pause, "Pause backwards") } else { (Icon::Backwards, "Play backwards") };
                if icon_button(ui, icon, name, help, side, false).clicked() {
                    if backwards {
                        player.set_playing(false);
                    } else {
                        player.play_backwards();
                    }
                    moved = true;
                }
            });
            ui.add_enabled_ui(player.stopped().is_none() || player.has_future(), |ui| {
                let help = format!("To the peak of the next impact of {target} (key .)");
                if icon_button(ui, Icon::After, "Next impact", &help, side, false).clicked() {
                    player.go_to_impact(focus, true);
                    moved = true;
                }
            });
            let joints = player.contact_history().joints().min(RECORDED_JOINTS);
            let loose = player.running().machine.loose_joints.iter().take(joints);
            let heights =
                loose.map(|joint| if joint.kind.site_names().is_empty() { LANE_HEIGHT } else { PLACES_LANE_HEIGHT });
            let lanes = heights.sum::<f32>().clamp(LANES_HEIGHT, MAX_LANES_HEIGHT);
            moved |= self.strip(ui, player, side.max(FLAGS_HEIGHT + lanes));
        });
        moved
    }

    /// Time range shown, s.
    fn range(&self, player: &Player) -> (f64, f64) {
        let end = player.known_to().max(MIN_RANGE);
        let Some((from, to)) = self.zoomed else {
            return (0.0, end);
        };
        // While playing, the range follows the displayed instant.
        let (shown, length) = (player.pacer.shown(), to - from);
        if player.is_playing() && !(from..=to).contains(&shown) {
            let from = shown - 0.8 * length;
            return zoom::clamp_range((from, from + length), end);
        }
        (from, to)
    }

    fn strip(&mut self, ui: &mut Ui, player: &mut Player, height: f32) -> bool {
        let size = vec2(ui.available_width().max(40.0), height);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        let shown = player.pacer.shown();
        let enabled = ui.is_enabled();
        response.widget_info(|| WidgetInfo::slider(enabled, shown, "Timeline, s"));
        spoken::value(&response, &value::time(shown));
        ui.ctx().accesskit_node_builder(response.id, |node| {
            node.set_min_numeric_value(0.0);
            node.set_max_numeric_value(player.reached());
            for action in [Action::SetValue, Action::Increment, Action::Decrement] {
                node.add_action(action);
            }
        });
        let range = self.range(player);
        if self.zoomed.is_some() {
            self.zoomed = Some(range);
        }
        let scale = Scale { rect, range };
        let clicked_time = self.input(ui, &response, player, &scale);
        if let Some(time) = clicked_time {
            player.go_to(time);
        }
        if ui.is_rect_visible(rect) {
            let scale = Scale { rect, range: self.range(player) };
            paint(ui, player, &scale, &response);
        }
        if let Some(pos) = response.hover_pos() {
            response.clone().on_hover_ui_at_pointer(|ui| describe(ui, player, &scale, pos));
        }
        clicked_time.is_some()
    }

    /// Pointer and key input: returns an instant, or changes the time range.
    fn input(&mut self, ui: &Ui, response: &Response, player: &Player, scale: &Scale) -> Option<f64> {
        let (from, to) = scale.range;
        let length = to - from;
        let requests = |action| ui.input(|input| input.num_accesskit_action_requests(response.id, action)) as f64;
        let mut by = requests(Action::Increment) - requests(Action::Decrement);
        if response.has_focus() {
            let arrows = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
            let pressed = |key| ui.input(|input| input.num_presses(key)) as f64;
            by += pressed(Key::ArrowRight) - pressed(Key::ArrowLeft);
            by += 10.0 * (pressed(Key::PageUp) - pressed(Key::PageDown));
            let ends = [(Key::Home, 0.0), (Key::End, player.reached())];
            if let Some((_, end)) = ends.into_iter().find(|(key, _)| pressed(*key) > 0.0) {
                return Some(end);
            }
        }
        if by != 0.0 {
            return Some(player.pacer.shown() + by * KEY_FRACTION * length);
        }
        let wanted = ui.input(|input| {
            let mut requests = input.accesskit_action_requests(response.id, Action::SetValue);
            requests.find_map(|request| match request.data {
                Some(ActionData::NumericValue(time)) => Some(time),
                _ => None,
            })
        });
        if let Some(time) = wanted {
            return Some(time.clamp(0.0, player.reached()));
        }
        if let Some(zoom) = Zoom::over(ui, response) {
            let (end, width) = (player.known_to(), scale.rect.width());
            let range = zoom.apply(scale.range, scale.time(zoom.place.x), width, MIN_RANGE);
            let part = range.1 - range.0 < end;
            self.zoomed = part.then(|| zoom::clamp_range(range, end));
        }
        if response.double_clicked() {
            self.zoomed = None;
            return None;
        }
        let held = response.clicked() || zoom::drags(ui, response);
        let pos = response.interact_pointer_pos().filter(|_| held)?;
        Some(scale.time(pos.x).clamp(0.0, player.reached()))
    }
}

/// Time scale of the strip.
struct Scale {
    rect: Rect,
    range: (f64, f64),
}

impl Scale {
    fn time(&self, x: f32) -> f64 {
        let share = f64::from((x - self.rect.left()) / self.rect.width());
        self.range.0 + share.clamp(0.0, 1.0) * (self.range.1 - self.range.0)
    }

    fn x(&self, time: f64) -> f32 {
        let share = (time - self.range.0) / (self.range.1 - self.range.0);
        self.rect.left() + (share.clamp(-1.0, 2.0) as f32) * self.rect.width()
    }

    fn lanes(&self) -> Rect {
        self.rect.with_min_y(self.rect.top() + FLAGS_HEIGHT)
    }

    /// The lane of joint `joint` out of `joints`.
    fn lane(&self, joint: usize, joints: usize) -> Rect {
        let lanes = self.lanes();
        let height = lanes.height() / joints.max(1) as f32;
        let top = lanes.top() + joint as f32 * height;
        let gap = if height >= LANE_HEIGHT { 1.0 } else { 0.0 };
        Rect::from_x_y_ranges(lanes.x_range(), top..=top + height - gap)
    }
}

/// Part of a lane, from its top, in which the contacts at a place are marked: of a pin its end a above, b below, the faces of its
/// collars between them; of a block the walls at +y, -y, +z and -z below each other.
fn band(kind: &LooseKind, place: u8) -> [f32; 2] {
    let part = |index: u8, of: u8| [index, index + 1].map(|edge| f32::from(edge) / f32::from(of));
    match kind {
        LooseKind::Ball | LooseKind::Pin(Pin { length: None, .. }) => [0.0, 1.0],
        LooseKind::Pin(Pin { kept: false, .. }) => part(place, 2),
        LooseKind::Pin(_) => part([0, 3, 1, 2][usize::from(place.min(3))], 4),
        LooseKind::Slide(Slide { half_height: None, .. }) => part(1 - place % 2, 2),
        LooseKind::Slide(_) => {
            let (corner, across) = (place / 2, place % 2);
            let is_upper = if across == 0 { corner & 2 != 0 } else { corner & 1 != 0 };
            part(2 * across + u8::from(!is_upper), 4)
        }
    }
}

fn paint(ui: &Ui, player: &Player, scale: &Scale, response: &Response) {
    let visuals = ui.visuals();
    let painter = ui.painter_at(scale.rect.expand(2.0));
    let lanes = scale.lanes();
    painter.rect_filled(lanes, 3.0, visuals.extreme_bg_color);
    let shown = player.pacer.shown();
    let (_, end) = scale.range;
    if let Some(abandoned) = player.abandoned_future() {
        contact_lanes(ui, player, &abandoned.contact_history, scale, (player.reached(), end), PALE_OPACITY);
    }
    contact_lanes(ui, player, player.contact_history(), scale, (0.0, shown), 1.0);
    contact_lanes(ui, player, player.contact_history(), scale, (shown, player.reached()), PALE_OPACITY);
    let flags = |flags: &mut dyn Iterator<Item = Flag>, pale: bool| {
        for flag in flags {
            let later = pale || flag.time > shown;
            let opacity = if later { PALE_OPACITY } else { 1.0 };
            flag_at(ui, scale, flag.time, opacity);
        }
    };
    flags(&mut player.flags(), false);
    if let Some(abandoned) = player.abandoned_future() {
        let ahead = abandoned.flags.iter().filter(|flag| flag.time > player.reached());
        flags(&mut ahead.cloned(), true);
    }
    let x = scale.x(shown);
    let colour = visuals.strong_text_color();
    painter.vline(x, scale.rect.y_range(), Stroke::new(1.5, colour));
    // Fully visible at both ends.
    let handle = pos2(x.clamp(scale.rect.left() + 4.0, scale.rect.right() - 4.0), scale.rect.top() + 4.0);
    painter.circle_filled(handle, 4.0, colour);
    let edge =
        if response.has_focus() { visuals.widgets.hovered.fg_stroke } else { visuals.widgets.noninteractive.bg_stroke };
    painter.rect_stroke(lanes, 3.0, edge, egui::StrokeKind::Outside);
}

/// The lanes between two times, s: sliding in half the joint's colour, creep in full colour, and a mark at each contact onset; of a
/// joint that can touch at several places in the band of each.
fn contact_lanes(
    ui: &Ui,
    player: &Player,
    contacts: &ContactHistory,
    scale: &Scale,
    between: (f64, f64),
    opacity: f32,
) {
    let dark = ui.visuals().dark_mode;
    let pixel = 1.0 / ui.ctx().pixels_per_point();
    let from = between.0.max(scale.range.0);
    let to = between.1.min(scale.range.1);
    if to <= from {
        return;
    }
    let joints = contacts.joints().min(RECORDED_JOINTS);
    let mut bars = Bars::new(scale, pixel, (from, to));
    for joint in 0..joints {
        let lane = scale.lane(joint, joints);
        let colour = theme::series(joint, dark).gamma_multiply(opacity);
        let kind = player.running().machine.loose_joints.get(joint).map(|joint| joint.kind);
        let Some(kind) = kind.filter(|kind| !kind.site_names().is_empty()) else {
            bars.add(
                contacts.states(joint, from, to).map(|(begins, ends, state)| (begins, ends, weight(state))),
                lane,
                colour,
            );
            bars.mark(contacts.touches(joint, from, to), lane, colour);
            continue;
        };
        for ([top, low], places) in bands(&kind) {
            let part = Rect::from_x_y_ranges(
                lane.x_range(),
                lane.top() + top * lane.height()..=lane.top() + low * lane.height(),
            );
            let during = contacts.place_contacts(joint, places, from, to);
            let weighted = during.flat_map(|(begins, ends)| {
                let states = contacts.states(joint, begins, ends);
                states.map(move |(a, b, state)| (a.max(begins), b.min(ends), weight(state)))
            });
            bars.add(weighted, part, colour);
            let begun = contacts.place_touches(joint, from, to).filter(|(_, place)| places >> place & 1 == 1);
            bars.mark(begun.map(|(time, _)| time), part, colour);
        }
    }
    ui.painter().add(Shape::mesh(bars.mesh));
}

/// Share of the colour of a joint in this state.
fn weight(state: ContactMode) -> f32 {
    match state {
        ContactMode::Free => 0.0,
        ContactMode::Slip => 0.5,
        ContactMode::Creep | ContactMode::Stick | ContactMode::Ideal => 1.0,
    }
}

/// The bands of a lane, with the places marked in each, a bit for each place.
fn bands(kind: &LooseKind) -> Vec<([f32; 2], u16)> {
    let mut all: Vec<([f32; 2], u16)> = Vec::new();
    for place in 0..kind.site_names().len() as u8 {
        let own = band(kind, place);
        match all.iter_mut().find(|(known, _)| *known == own) {
            Some((_, places)) => *places |= 1 << place,
            None => all.push((own, 1 << place)),
        }
    }
    all
}

/// Bars whose colour, in a pixel column, is proportional to the time in each state.
struct Bars<'a> {
    scale: &'a Scale,
    pixel: f32,
    /// Times drawn, s.
    between: (f64, f64),
    coverage: Vec<f32>,
    mesh: Mesh,
}

impl<'a> Bars<'a> {
    fn new(scale: &'a Scale, pixel: f32, between: (f64, f64)) -> Self {
        let columns = (scale.rect.width() / pixel).ceil() as usize;
        Self { scale, pixel, between, coverage: vec![0.0; columns + 1], mesh: Mesh::default() }
    }

    /// Adds bars from and to these times, s, with these shares of `colour`, in `part` of the lanes.
    fn add(&mut self, states: impl Iterator<Item = (f64, f64, f32)>, part: Rect, colour: Color32) {
        let columns = self.coverage.len() - 1;
        let (start, end) = self.scale.range;
        let per_second = columns as f64 / (end - start);
        let (from, to) = self.between;
        self.coverage.fill(0.0);
        for (begins, ends, weight) in states.filter(|(.., weight)| *weight > 0.0) {
            let a = (begins.max(from) - start) * per_second;
            let b = (ends.min(to) - start) * per_second;
            let last = (b.floor() as usize).min(columns);
            let first = (a.floor() as usize).min(last);
            for (index, covered_part) in self.coverage[first..=last].iter_mut().enumerate() {
                let left = (first + index) as f64;
                let covered = b.min(left + 1.0) - a.max(left);
                *covered_part += weight * covered.max(0.0) as f32;
            }
        }
        // Adjacent columns of one colour are merged.
        let mut start = 0;
        while start < columns {
            let covered_part = self.coverage[start];
            let same = self.coverage[start..columns].iter();
            let count = same.take_while(|other| (*other - covered_part).abs() < 0.01).count();
            if covered_part > 0.0 {
                let left = self.scale.rect.left() + start as f32 * self.pixel;
                let place = Rect::from_x_y_ranges(left..=left + count as f32 * self.pixel, part.y_range());
                // Even the shortest contact stays visible.
                self.mesh.add_colored_rect(place, colour.gamma_multiply(covered_part.clamp(0.12, 1.0)));
            }
            start += count.max(1);
        }
    }

    /// Marks these times in `part` of the lanes.
    fn mark(&mut self, times: impl Iterator<Item = f64>, part: Rect, colour: Color32) {
        let mut last_mark = f32::NEG_INFINITY;
        for time in times {
            let x = self.scale.x(time);
            if x - last_mark >= self.pixel {
                let mark = Rect::from_min_size(pos2(x, part.top()), vec2(1.0, part.height()));
                self.mesh.add_colored_rect(mark, colour);
                last_mark = x;
            }
        }
    }
}

fn flag_at(ui: &Ui, scale: &Scale, time: f64, opacity: f32) {
    let x = scale.x(time);
    if !scale.rect.x_range().contains(x) {
        return;
    }
    flag(ui, pos2(x, scale.rect.top()), scale.rect.bottom(), opacity);
}

/// A flag at the top `at` of its pole, which ends at the height `low`.
fn flag(ui: &Ui, at: Pos2, low: f32, opacity: f32) {
    let colour = ui.visuals().warn_fg_color.gamma_multiply(opacity);
    let painter = ui.painter();
    painter.vline(at.x, at.y..=low, Stroke::new(1.0, colour));
    let points: Vec<Pos2> = vec![at, at + vec2(8.0, 3.5), at + vec2(0.0, 7.0)];
    painter.add(Shape::convex_polygon(points, colour, Stroke::NONE));
}

/// Tooltip for the pointer position.
fn describe(ui: &mut Ui, player: &Player, scale: &Scale, pos: Pos2) {
    let time = scale.time(pos.x);
    ui.strong(value::time(time));
    let joints = player.contact_history().joints().min(RECORDED_JOINTS);
    let pointed_joint = (0..joints).find(|&joint| scale.lane(joint, joints).y_range().contains(pos.y));
    let contacts = if time > player.reached() {
        player.abandoned_future().map(|abandoned| &abandoned.contact_history)
    } else {
        Some(player.contact_history())
    };
    if let (Some(index), Some(contacts)) = (pointed_joint, contacts) {
        let state = contacts.states(index, time, time + MIN_RANGE).next();
        let words = match state {
            None => "not recorded",
            Some((.., ContactMode::Free)) => "free",
            Some((.., ContactMode::Slip)) => "sliding",
            Some((.., ContactMode::Creep)) => "creeping",
            Some((.., ContactMode::Stick)) => "sticking",
            Some((.., ContactMode::Ideal)) => "ideal",
        };
        let joint = &player.running().machine.loose_joints[index];
        let sites = joint.kind.site_names();
        let at: Vec<&str> =
            contacts.places_at(index, time).filter_map(|place| sites.get(usize::from(place)).copied()).collect();
        let at = if at.is_empty() { String::new() } else { format!(" at {}", at.join(", ")) };
        ui.label(format!("{}: {words}{at}", joint.name));
    }
    let abandoned = player.abandoned_future().into_iter().flat_map(|abandoned| abandoned.flags.iter().cloned());
    for flag in player.flags().chain(abandoned) {
        if (scale.x(flag.time) - pos.x).abs() <= HIT_DISTANCE {
            ui.label(format!("{}: {}", value::time(flag.time), flag.text));
        }
    }
    let known = player.contact_history().known_from();
    if time < known {
        let words = format!("Contacts before {} are no longer stored", value::time(known));
        ui.label(words);
    }
    rows_of_key(ui, &rows_for(player));
    let help = "Of a pin its end a is above and b below, of a block the walls +y, −y, +z, −z from above. Click or drag to go to an \
                instant; wheel or pinch to zoom; double-click to show the whole run.";
    ui.label(egui::RichText::new(help).small().color(faint(ui)));
}

/// A sign of the timeline.
#[derive(Clone, Copy)]
enum Sign {
    /// A contact, with this share of the joint's colour.
    Contact(f32),
    Onset,
    Pale,
    Flag,
}

/// The signs, in a word and in a sentence.
const KEY: [(Sign, &str, &str); 5] = [
    (Sign::Onset, "touches", "A contact begins; while a lane is empty, its ball flies free"),
    (Sign::Contact(0.5), "slides", "Slides along its wall"),
    (Sign::Contact(1.0), "creeps", "Creeps: too slow for full friction"),
    (Sign::Pale, "later", "Not replayed yet, or abandoned"),
    (Sign::Flag, "change", "A parameter was changed, or a body pulled"),
];
/// What the full colour means where contacts stick instead of creeping, and where some do.
const STICKS: (&str, &str) = ("sticks", "Sticks: friction is below its limit");
const CREEPS_OR_STICKS: (&str, &str) =
    ("creeps, sticks", "Creeps: too slow for full friction; or sticks: friction is below its limit");
/// Size of a sign in the key, points.
const SIGN_SIZE: egui::Vec2 = vec2(12.0, 9.0);
/// Least number of signs in the line of the key: those of every run.
const MIN_KEY: usize = 3;
/// Gaps in the line of the key: after a sign, and after a word, points.
const KEY_GAPS: [f32; 2] = [4.0, 10.0];

impl Sign {
    fn paint(self, ui: &Ui, rect: Rect) {
        let colour = theme::series(0, ui.visuals().dark_mode);
        let painter = ui.painter();
        let pole = Rect::from_center_size(rect.center(), vec2(1.5, rect.height()));
        let (place, colour) = match self {
            Self::Contact(share) => (rect, colour.gamma_multiply(share)),
            Self::Onset => (pole, colour),
            Self::Pale => (rect, colour.gamma_multiply(0.5 * PALE_OPACITY)),
            Self::Flag => return flag(ui, rect.center_top() - vec2(4.0, 0.0), rect.bottom(), 1.0),
        };
        painter.rect_filled(place, 0.0, colour);
    }
}

/// The key for the friction laws of the run.
fn rows_for(player: &Player) -> [(Sign, &'static str, &'static str); 5] {
    let joints = &player.running().machine.loose_joints;
    let with_play = joints.iter().filter(|joint| !joint.contact.is_ideal()).count();
    let sticking = joints.iter().filter(|joint| joint.contact.has_bristles()).count();
    let mut rows = KEY;
    if sticking > 0 {
        (rows[2].1, rows[2].2) = if sticking == with_play { STICKS } else { CREEPS_OR_STICKS };
    }
    rows
}

/// The key in one line, at the right end of `ui`, if there is room.
pub fn key(ui: &mut Ui, player: &Player) {
    let rows = rows_for(player);
    let font = egui::TextStyle::Small.resolve(ui.style());
    let ink = ui.visuals().weak_text_color();
    let [after_sign, after_word] = KEY_GAPS;
    let (mut words, mut width, mut height) = (Vec::new(), -after_word, SIGN_SIZE.y);
    for (sign, word, _) in rows {
        let word = ui.painter().layout_no_wrap(word.to_owned(), font.clone(), ink);
        let wider = width + after_word + SIGN_SIZE.x + after_sign + word.size().x;
        if wider > ui.available_width() {
            break;
        }
        (width, height) = (wider, height.max(word.size().y));
        words.push((sign, word));
    }
    if words.len() < MIN_KEY {
        return;
    }
    let (rect, response) = ui.allocate_exact_size(vec2(width, height), Sense::hover());
    let all = rows.map(|(_, _, words)| words).join(". ");
    response
        .widget_info(|| WidgetInfo::labeled(egui::accesskit::Role::Label, true, format!("Key of the timeline. {all}")));
    let mut x = rect.left();
    for (sign, word) in words {
        let place = Rect::from_center_size(pos2(x + 0.5 * SIGN_SIZE.x, rect.center().y), SIGN_SIZE);
        sign.paint(ui, place);
        x += SIGN_SIZE.x + after_sign;
        let at = pos2(x, rect.center().y - 0.5 * word.size().y);
        x += word.size().x + after_word;
        ui.painter().galley(at, word, ink);
    }
    response.on_hover_ui(|ui| {
        ui.strong("The lanes of the timeline");
        ui.label("One lane for each joint with play, in the colours of the plots.");
        rows_of_key(ui, &rows);
    });
}

fn rows_of_key(ui: &mut Ui, rows: &[(Sign, &str, &str)]) {
    for &(sign, _, words) in rows {
        ui.horizontal(|ui| {
            let (rect, _) = ui.allocate_exact_size(SIGN_SIZE, Sense::hover());
            sign.paint(ui, rect);
            ui.label(egui::RichText::new(words).small());
        });
    }
}

fn faint(ui: &Ui) -> Color32 {
    ui.visuals().weak_text_color()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::EndsOn;

    #[test]
    fn places_of_a_joint_have_bands_of_their_own_that_fill_its_lane() {
        let pin = |kept| {
            LooseKind::Pin(Pin { length: Some(0.02), ends: EndsOn::Bearing, kept, face_radius: None, travel: None })
        };
        let slide = |half_height| {
            LooseKind::Slide(Slide { half_length: 0.02, half_width: 0.01, half_height, corner_radius: 1e-3 })
        };
        for (kind, count) in [(pin(false), 2), (pin(true), 4), (slide(None), 2), (slide(Some(0.01)), 4)] {
            let names = kind.site_names();
            let mut all: Vec<[f32; 2]> = (0..names.len() as u8).map(|place| band(&kind, place)).collect();
            all.sort_by(|a, b| a[0].total_cmp(&b[0]));
            all.dedup();
            assert_eq!(all.len(), count, "{names:?}");
            assert_eq!((all[0][0], all[count - 1][1]), (0.0, 1.0));
            let places = bands(&kind).into_iter().map(|(_, places)| places);
            assert_eq!(places.fold(0, |all, places| all | places), ((1_u32 << names.len()) - 1) as u16);
            assert!(all.windows(2).all(|pair| pair[0][1] == pair[1][0]), "{all:?}");
        }
        let at = |kind: LooseKind, name: &str| {
            let place = kind.site_names().iter().position(|own| *own == name).expect("a place") as u8;
            band(&kind, place)
        };
        assert_eq!([at(pin(true), "a"), at(pin(true), "b")], [[0.0, 0.25], [0.75, 1.0]]);
        // 3 and 7 are the corners at +y.
        assert_eq!(at(slide(None), "3y"), at(slide(None), "7y"));
        assert_eq!([at(slide(None), "7y"), at(slide(None), "1y")], [[0.0, 0.5], [0.5, 1.0]]);
        let spatial = slide(Some(0.01));
        // 2 and 4 are at +z, 3 and 4 at +y.
        assert_eq!(
            [at(spatial, "4y"), at(spatial, "2y"), at(spatial, "4z"), at(spatial, "3z")].map(|band| band[0]),
            [0.0, 0.25, 0.5, 0.75]
        );
    }
}
