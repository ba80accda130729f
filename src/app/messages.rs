//! Messages: problems, verdicts and notices over the picture, and the report for screen readers.

use std::fmt::Display;
use std::time::Duration;

use eframe::egui::{self, Align2, Color32, Frame, Id, Label, Rect, RichText, ScrollArea, Ui};

use super::Verdict;
use super::announce::Announcer;
use super::command::Command;
use super::host::Host;
use super::player::Player;
use super::tasks::Tasks;
use super::transport;

/// Display time of a verdict that needs no action, s.
const VERDICT_TIME: f64 = 5.0;
/// Display time of a notice, s.
const NOTICE_TIME: f64 = 5.0;
/// Least height of the messages in a window too low for more, and their greatest width, points.
const LEAST_HEIGHT: f32 = 30.0;
const MAX_WIDTH: f32 = 640.0;
/// Key under which the height of the messages is stored.
const MESSAGES_KEY: &str = "height of the messages";

/// A message about the last action, shown for a few seconds.
struct Notice {
    text: String,
    /// Time of its first display, s of viewing.
    since: Option<f64>,
}

impl Notice {
    fn remaining_time(&mut self, now: f64) -> f64 {
        *self.since.get_or_insert(now) + NOTICE_TIME - now
    }
}

/// The window around the messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surroundings {
    /// A window of its own.
    Window,
    /// The same, with a lesson or a presentation.
    Lecture,
    /// Another page, where space is scarce: verdicts that need no action are omitted.
    Page,
}

/// What the application tells the user.
#[derive(Default)]
pub struct Messages {
    /// Error of the last attempt to open or reset.
    problem: Option<String>,
    /// Whether `problem` is the failure to open the initial link.
    refused: bool,
    /// On the link whose state was last reproduced.
    verdict: Option<Verdict>,
    /// Time of the verdict's first display, s of viewing, if it needs no action; minus infinity once it has expired.
    verdict_shown: Option<f64>,
    notice: Option<Notice>,
    announcer: Announcer,
}

impl Messages {
    /// Begins with why the initial link could not be opened, if so.
    pub fn new(problem: Option<String>) -> Self {
        Self { refused: problem.is_some(), problem, ..Self::default() }
    }

    /// Shows why something failed.
    pub fn fail(&mut self, problem: impl Display) {
        self.problem = Some(problem.to_string());
    }

    /// Shows why an attempt failed, if so; an earlier problem stays otherwise.
    pub fn warn(&mut self, outcome: Result<(), impl Display>) {
        if let Err(problem) = outcome {
            self.fail(problem);
        }
    }

    /// Shows why an attempt to open or reset failed, or removes an earlier problem. Returns whether it succeeded.
    pub fn report(&mut self, outcome: Result<(), String>) -> bool {
        self.problem = outcome.err();
        self.problem.is_none()
    }

    /// Shows a message for a few seconds.
    pub fn notify(&mut self, text: impl Into<String>) {
        self.notice = Some(Notice { text: text.into(), since: None });
    }

    /// Whether a problem is shown.
    pub fn has_problem(&self) -> bool {
        self.problem.is_some()
    }

    /// Removes the problem; returns whether there was one.
    pub fn dismiss_problem(&mut self) -> bool {
        self.problem.take().is_some()
    }

    /// Whether the problem is the failure to open the initial link, and nothing was done since.
    pub fn is_refused(&self, player: &Player) -> bool {
        self.refused && self.problem.is_some() && !player.is_playing()
    }

    /// The verdict on a link.
    pub fn verdict(&self) -> Option<&Verdict> {
        self.verdict.as_ref()
    }

    /// Replaces the verdict.
    pub fn set_verdict(&mut self, verdict: Option<Verdict>) {
        (self.verdict, self.verdict_shown) = (verdict, None);
    }

    /// Removes problem and verdict with the scene that they are about.
    pub fn clear(&mut self) {
        (self.problem, self.refused) = (None, false);
        self.set_verdict(None);
    }

    /// Expires a notice, and a verdict that needs no action, after some seconds.
    pub fn expire(&mut self, ctx: &egui::Context) {
        let now = ctx.input(|input| input.time);
        if let Some(notice) = &mut self.notice {
            let left = notice.remaining_time(now);
            if left <= 0.0 {
                self.notice = None;
            } else {
                ctx.request_repaint_after(Duration::from_secs_f64(left));
            }
        }
        if !self.verdict.as_ref().is_some_and(needs_no_action) {
            return;
        }
        let left = *self.verdict_shown.get_or_insert(now) + VERDICT_TIME - now;
        if left <= 0.0 {
            self.verdict_shown = Some(f64::NEG_INFINITY);
        } else {
            ctx.request_repaint_after(Duration::from_secs_f64(left));
        }
    }

    /// The current message in one sentence; "" for none.
    fn current(&self, player: &Player, tasks: &Tasks) -> String {
        if let Some(problem) = &self.problem {
            // The other lines show the position in the file.
            return problem.lines().next().unwrap_or("").to_owned();
        }
        let task = tasks.progress(player).last().map(|(words, _)| words.to_owned());
        let notice = || self.notice.as_ref().map(|notice| notice.text.clone());
        let verdict = || self.verdict.as_ref().map(Verdict::to_string);
        task.or_else(notice).or_else(verdict).unwrap_or_default()
    }

    /// The latest report for screen readers.
    pub fn announcement(&self) -> &str {
        self.announcer.text()
    }

    /// Records the impacts of a frame for the next report.
    pub fn observe(&mut self, player: &Player) {
        self.announcer.observe(player);
    }

    /// Makes an announcement if one is due; `lesson`: what the lesson says, "" for none.
    pub fn announce(&mut self, ctx: &egui::Context, host: &mut dyn Host, player: &Player, tasks: &Tasks, lesson: &str) {
        let now = ctx.input(|input| input.time);
        let news = self.current(player, tasks);
        let (announced, wait) = self.announcer.update(now, player, &news, lesson);
        if announced {
            host.announce(self.announcer.text(), self.announcer.is_event());
            ctx.request_repaint();
        }
        if let Some(wait) = wait {
            ctx.request_repaint_after(Duration::from_secs_f64(wait));
        }
    }

    /// The report for screen readers: in the accessibility tree, announced politely on changes.
    pub fn summary(&self, ui: &Ui) {
        let place = Rect::from_min_size(ui.max_rect().min, egui::Vec2::ZERO);
        let id = Id::unique("summary");
        let response = ui.interact(place, id, egui::Sense::hover());
        let words = self.announcer.text();
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Status, true, words));
        ui.ctx().accesskit_node_builder(id, |node| {
            node.set_live(egui::accesskit::Live::Polite);
        });
    }

    /// Whether [`Self::ui`] has messages.
    pub fn are_shown(&self, player: &Player, tasks: &Tasks, around: Surroundings) -> bool {
        self.notice.is_some() || self.have_buttons(player, tasks, around)
    }

    /// Whether there is a message with a button, which needs width.
    pub fn have_buttons(&self, player: &Player, tasks: &Tasks, around: Surroundings) -> bool {
        let stays = self.problem.is_some() || player.stopped().is_some() || self.shown_verdict(around).is_some();
        stays || tasks.are_under_way()
    }

    /// The verdict on a link while it is displayed.
    fn shown_verdict(&self, around: Surroundings) -> Option<&Verdict> {
        let is_shown = self.verdict_shown != Some(f64::NEG_INFINITY);
        let is_relevant = |verdict: &&Verdict| around != Surroundings::Page || !needs_no_action(verdict);
        self.verdict.as_ref().filter(is_relevant).filter(|_| is_shown)
    }

    /// Height of the messages in the previous frame, points; initially one line with a button.
    pub fn height(ui: &Ui) -> f32 {
        let height = ui.data(|data| data.get_temp(Id::unique(MESSAGES_KEY)));
        height.unwrap_or(ui.spacing().interact_size.y + 16.0)
    }

    /// Messages in `area`, which has [`Self::height`] if the window permits. Returns the command chosen in them.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        area: Rect,
        player: &Player,
        tasks: &Tasks,
        around: Surroundings,
    ) -> Option<Command> {
        let id = Id::unique(MESSAGES_KEY);
        if !self.are_shown(player, tasks, around) {
            ui.data_mut(|data| data.remove_temp::<f32>(id));
            return None;
        }
        if self.is_refused(player) {
            // Hides the picture, which does not show what the link promised.
            let fill = ui.visuals().panel_fill;
            ui.painter().rect_filled(area.expand(10.0), 0.0, fill);
        }
        let height = area.height().max(LEAST_HEIGHT);
        let width = area.width().min(MAX_WIDTH);
        let place = Align2::LEFT_BOTTOM.align_size_within_rect(egui::vec2(width, height), area);
        let shown = ui.scope_builder(egui::UiBuilder::new().max_rect(place), |ui| {
            ScrollArea::vertical()
                .id_salt("messages")
                .max_height(height)
                .min_scrolled_height(height)
                .show(ui, |ui| self.strips(ui, player, tasks, around))
        });
        let content = shown.inner.content_size.y;
        let most = 0.5 * ui.ctx().content_rect().height();
        let wanted = content.min(most);
        // Nothing moves under a pressed pointer.
        if wanted != Self::height(ui) && !ui.input(|input| input.pointer.any_down()) {
            ui.data_mut(|data| data.insert_temp(id, wanted));
            ui.ctx().request_repaint();
        }
        shown.inner.inner
    }

    /// Errors, the progress of a task, and the verdict on a link.
    fn strips(&mut self, ui: &mut Ui, player: &Player, tasks: &Tasks, around: Surroundings) -> Option<Command> {
        let mut chosen = None;
        if transport::banner(ui, player) {
            chosen = Some(Command::Reset);
        }
        let colour = ui.visuals().error_fg_color;
        if self.problem.as_ref().is_some_and(|problem| strip(ui, problem, colour)) {
            self.problem = None;
        }
        let stop = match tasks.filming() {
            Some(_) => ("Cancel", "Cancels the film; the run returns to where it was (Esc)"),
            None => ("Stop here", "Stay at the time that the run has reached (Esc)"),
        };
        for (words, fraction) in tasks.progress(player) {
            if progress_row(ui, words, fraction, stop) {
                chosen = Some(Command::StopTasks);
            }
        }
        let dismissed = self.shown_verdict(around).is_some_and(|verdict| {
            let colour = match verdict {
                Verdict::Agrees(_) => ui.visuals().selection.stroke.color,
                Verdict::Reached => ui.visuals().weak_text_color(),
                Verdict::Differs { .. } => ui.visuals().warn_fg_color,
                Verdict::Failed(_) => ui.visuals().error_fg_color,
            };
            strip(ui, &verdict.to_string(), colour)
        });
        if dismissed {
            self.verdict = None;
        }
        self.notice_plate(ui);
        chosen
    }

    /// A notice displayed for a few seconds.
    fn notice_plate(&self, ui: &mut Ui) {
        if let Some(notice) = &self.notice {
            plate(ui, ui.visuals().panel_fill).show(ui, |ui| ui.add(Label::new(&notice.text).wrap()));
        }
    }
}

/// Whether a verdict needs no action; it then disappears after some seconds.
fn needs_no_action(verdict: &Verdict) -> bool {
    matches!(verdict, Verdict::Agrees(_) | Verdict::Reached)
}

/// The opaque background of a message.
fn plate(ui: &Ui, colour: Color32) -> Frame {
    let fill = ui.visuals().panel_fill.lerp_to_gamma(colour, 0.14);
    Frame::new().fill(fill).corner_radius(6.0).inner_margin(egui::Margin::symmetric(12, 8))
}

/// Progress of a run to its target; returns whether it was cancelled. The last argument is the label and tooltip of the stop
/// button.
fn progress_row(ui: &mut Ui, words: &str, fraction: f32, (stop, help): (&str, &str)) -> bool {
    let plate = plate(ui, ui.visuals().panel_fill);
    let row = plate.show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            let percent = (fraction * 100.0).floor();
            ui.label(format!("{words}… {percent} %"));
            ui.add(egui::ProgressBar::new(fraction).desired_width(120.0)).accessible_name("Run so far");
            ui.button(stop).on_hover_text(help).clicked()
        })
        .inner
    });
    row.inner
}

/// A coloured strip with a message; returns whether it was dismissed.
fn strip(ui: &mut Ui, words: &str, colour: Color32) -> bool {
    let shown = plate(ui, colour).show(ui, |ui| {
        let narrow = ui.available_width() < 520.0;
        let words = Label::new(RichText::new(words).color(colour)).wrap();
        if narrow {
            ui.add(words);
            return ui.button("Dismiss").clicked();
        }
        ui.horizontal_top(|ui| {
            // Space for the button and the gap before it.
            let room = ui.available_width() - 90.0;
            ui.vertical(|ui| {
                ui.set_width(room);
                ui.add(words);
            });
            ui.button("Dismiss").clicked()
        })
        .inner
    });
    shown.inner
}
