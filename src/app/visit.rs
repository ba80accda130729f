//! The first visit: one ball of the machine from close up, in slow motion, with a sentence, the contact parameters, and ways on.

use eframe::egui::{self, Button, CentralPanel, Event, Panel, RichText, ScrollArea, Ui, vec2};

use super::command::Command;
use super::dialogs::Dialog;
use super::keys::Action;
use super::overlay::Room;
use super::{App, BUILT_IN_LESSONS, layout, opening, spoken, theme, value};

/// Simulated seconds per second: a ball takes about half a second from wall to wall.
const SCALE: f64 = 0.01;
/// The joint with play shown.
const JOINT: usize = 0;
/// Width of the panel beside the picture relative to the window's, and its range, points.
const PANEL_SHARE: f32 = 0.3;
const PANEL_WIDTHS: [f32; 2] = [340.0, 420.0];
/// Height of the panel below the picture relative to the window's.
const PANEL_HEIGHT_SHARE: f32 = 0.56;

/// The first visit under way.
#[derive(Default)]
pub struct Visit {
    /// Whether it was shown, which is remembered.
    shown: bool,
    /// Whether it has switched sound on, once the visitor had made a gesture.
    sounds: Option<bool>,
}

impl App {
    /// Whether the first visit is shown.
    pub fn is_first_visit(&self) -> bool {
        self.visit.is_some()
    }

    /// Begins the first visit. Under reduced motion it stands still, at a touch.
    pub(super) fn begin_visit(&mut self) {
        self.visit = Some(Visit::default());
        self.run.player.pacer.set_scale(SCALE);
        let options = &mut self.run.viewport.options;
        (options.joint_names, options.triad) = (false, false);
        self.run.viewport.begin_close_up(&self.run.player, JOINT);
        self.run.viewport.ruler.only_grows(true);
        if self.calm {
            self.run.player.go_to_impact(Some(JOINT), true);
        }
    }

    /// Ends it with what it changed of the window; returns whether there was one.
    pub(super) fn end_visit(&mut self) -> bool {
        let Some(visit) = self.visit.take() else {
            return false;
        };
        if visit.sounds == Some(true) {
            // The notice of the switch would concern something that the visitor has not done.
            let _ = self.sound.set(false, self.host.as_mut());
        }
        let usual = crate::view::ViewOptions::default();
        let options = &mut self.run.viewport.options;
        (options.joint_names, options.triad) = (usual.joint_names, usual.triad);
        self.run.viewport.ruler.only_grows(false);
        true
    }

    /// Ends it, and shows the whole machine with its panels.
    pub(super) fn leave_visit(&mut self) {
        if self.end_visit() {
            let scale = opening::time_scale(self.run.player.running());
            self.run.player.pacer.set_scale(scale);
            self.run.viewport.show_whole();
            self.hint.begin_after_visit(self.run.player.pending());
        }
    }

    /// Ends it for an `action` that concerns the window; returns whether the action has thereby been performed.
    pub(super) fn leave_visit_for(&mut self, action: Action) -> bool {
        if self.visit.is_none() || matches!(action, Action::PlayPause | Action::Sound | Action::Theme) {
            return false;
        }
        self.leave_visit();
        action == Action::Close
    }

    /// The whole interface during the first visit.
    pub(super) fn visit_ui(&mut self, ui: &mut Ui) {
        if let Some(visit) = &mut self.visit
            && !std::mem::replace(&mut visit.shown, true)
        {
            self.host.note_visit();
        }
        let size = ui.available_size();
        let margin =
            if self.panels.is_compact() { egui::Margin::symmetric(12, 8) } else { egui::Margin::symmetric(20, 14) };
        let frame = theme::panel(ui).inner_margin(margin);
        let panel = if size.x > size.y {
            let width = (PANEL_SHARE * size.x).clamp(PANEL_WIDTHS[0], PANEL_WIDTHS[1]).min(0.5 * size.x);
            Panel::right("first visit").exact_size(width)
        } else {
            Panel::bottom("first visit below").exact_size(PANEL_HEIGHT_SHARE * size.y)
        };
        let panel = panel.frame(frame).resizable(false).show(ui, |ui| {
            layout::show_bar(ui);
            // A lying phone is too low for everything: the sliders scroll above the ways on.
            let is_low = self.panels.is_compact() && size.x > size.y;
            let below = is_low.then(|| {
                let frame = egui::Frame::new().inner_margin(egui::Margin { top: 6, ..egui::Margin::ZERO });
                Panel::bottom("ways on").frame(frame).show(ui, |ui| self.ways_on(ui)).inner
            });
            ScrollArea::vertical()
                .auto_shrink(false)
                .show(ui, |ui| {
                    self.visit_panel(ui);
                    if is_low { None } else { self.ways_on(ui) }
                })
                .inner
                .or(below.flatten())
        });
        let is_press = |event: &Event| {
            matches!(event, Event::PointerButton { pressed: true, .. } | Event::Key { pressed: true, .. })
        };
        let has_gesture = ui.input(|input| input.events.iter().any(is_press));
        self.sound_for_visit(has_gesture);
        let left = CentralPanel::no_frame().show(ui, |ui| self.visit_picture(ui)).inner;
        if left || self.run.player.stopped().is_some() || self.messages.has_problem() {
            self.leave_visit();
        }
        self.perform_all(ui.ctx(), panel.inner);
    }

    /// Switches sound on once the visitor has made a gesture, before which a browser lets no page make any.
    fn sound_for_visit(&mut self, has_gesture: bool) {
        let is_on = self.sound.is_on();
        if let Some(visit) = &mut self.visit
            && has_gesture
            && visit.sounds.is_none()
        {
            visit.sounds = Some(!is_on);
            let _ = self.sound.set(true, self.host.as_mut());
        }
    }

    /// The ball. Returns whether a gesture on it asks for the whole machine.
    fn visit_picture(&mut self, ui: &mut Ui) -> bool {
        spoken::landmark(ui, "The machine");
        let area = ui.available_rect_before_wrap();
        self.panels.picture = area;
        self.run.player.update_ghosts();
        self.run.viewport.bare = false;
        self.run.viewport.hides_time = false;
        self.run.viewport.ui(ui, &self.run.player, false, Room::default());
        self.run.viewport.take_clicked();
        self.run.viewport.take_pull();
        let is_free = self.dialog.is_none();
        ui.input(|input| {
            let inside = |pos: egui::Pos2| area.contains(pos);
            let on_it = |event: &Event| match event {
                Event::PointerButton { pressed: true, pos, .. } => inside(*pos),
                Event::MouseWheel { .. } | Event::Zoom(_) => input.pointer.hover_pos().is_some_and(inside),
                _ => false,
            };
            is_free && input.events.iter().any(on_it)
        })
    }

    /// Sentence and sliders.
    fn visit_panel(&mut self, ui: &mut Ui) {
        // Space for the scroll bar.
        ui.set_max_width(ui.available_width() - 10.0);
        spoken::landmark(ui, "First visit");
        let player = &self.run.player;
        let clearance = player.frame().joints.get(JOINT).map_or(0.0, |joint| joint.clearance);
        let sentence = sentence(clearance);
        let heading = ui.add(
            egui::Label::new(
                RichText::new(&sentence).size(if self.panels.is_compact() { 20.0 } else { 24.0 }).strong(),
            )
            .wrap(),
        );
        spoken::heading(&heading, &sentence);
        let scale = value::number(1.0 / player.pacer.scale(), 3);
        ui.label(if self.calm && !player.is_playing() {
            "It stands still, because your system asks for reduced motion. Play moves it.".to_owned()
        } else {
            // As long with sound as without, so that the switch moves nothing.
            let listen = if self.sound.is_on() { "Listen to its impacts." } else { "Turn on Sound to hear it." };
            format!("Slowed down {scale} times. Move a slider and watch the ball. {listen}")
        });
        let gap = if self.panels.is_compact() { 0.0 } else { 8.0 };
        ui.add_space(gap);
        self.run.controls.contact_controls(ui, &mut self.run.player);
        ui.add_space(0.5 * gap);
        ui.horizontal(|ui| {
            let playing = self.run.player.is_playing();
            if ui.button(if playing { "Pause" } else { "Play" }).clicked() {
                self.run.player.set_playing(!playing);
            }
            if super::sound::switch(ui, self.sound.is_on()) {
                if let Some(visit) = &mut self.visit {
                    // From here on the visitor's own choice.
                    visit.sounds = Some(false);
                }
                let on = !self.sound.is_on();
                let _ = self.sound.set(on, self.host.as_mut());
            }
        });
        ui.add_space(gap);
    }

    /// The three ways on; returns the command of the one chosen.
    fn ways_on(&mut self, ui: &mut Ui) -> Option<Command> {
        // A phone has buttons of a finger's size, and no room for three rows of them.
        let short = theme::has_fingers(ui);
        let height = if short { 1.0 } else { 1.2 } * ui.spacing().interact_size.y;
        let way = |ui: &mut Ui, width: f32, name: &str, help: &str| {
            let button = Button::new(RichText::new(name).strong());
            ui.add_sized(vec2(width, height), button).on_hover_text(help).clicked()
        };
        let width = ui.available_width();
        if way(ui, width, "The whole machine", "The camera moves back, and the panels appear (Esc)") {
            self.leave_visit();
        }
        let half = if short { 0.5 * (width - ui.spacing().item_spacing.x) } else { width };
        let others = |ui: &mut Ui| {
            let why = way(ui, half, "Show me why", "The first lesson, step by step");
            (why, way(ui, half, "Choose a machine", "All machines, with pictures"))
        };
        let (why, choose) = if short { ui.horizontal(others).inner } else { others(ui) };
        if why {
            self.leave_visit();
            return Some(Command::Lesson(BUILT_IN_LESSONS[0].0));
        }
        choose.then_some(Command::Ask(Dialog::Machines { chosen: None }))
    }
}

/// What the run's own `clearance`, m, means for the ball.
fn sentence(clearance: f64) -> String {
    if clearance > 0.0 {
        format!("This ball is {} too small for its socket.", value::quantity(clearance, "mm", 3))
    } else {
        "This ball fits its socket without play.".to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sentence_has_the_clearance_with_its_unit() {
        assert_eq!(sentence(0.3e-3), "This ball is 0.3 mm too small for its socket.");
        assert_eq!(sentence(0.4567e-3), "This ball is 0.457 mm too small for its socket.");
        assert_eq!(sentence(0.0), "This ball fits its socket without play.");
    }
}
