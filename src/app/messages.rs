//! Messages: problems, verdicts and notices over the picture, and the report for screen readers.

use std::fmt::Display;
use std::time::Duration;

use eframe::egui::{self, Align2, Color32, Frame, Id, Label, Rect, RichText, ScrollArea, Ui};

use super::announce::Announcer;
use super::command::Command;
use super::host::Host;
use super::player::Player;
use super::tasks::Tasks;
use super::{Verdict, opening};

/// Display time of a verdict that needs no action, s.
const VERDICT_TIME: f64 = 6.0;
/// Key under which the height of the messages is stored.
const MESSAGES_KEY: &str = "height of the messages";

/// A message about the last action, shown for a few seconds.
struct Notice {
    text: String,
    /// Time of its first display, s of viewing.
    since: Option<f64>,
}

impl Notice {
    /// Longer messages take longer to read.
    fn remaining_time(&mut self, now: f64) -> f64 {
        let length = 3.0 + 0.05 * self.text.len() as f64;
        *self.since.get_or_insert(now) + length - now
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
    /// Whether the user has dismissed the notice of the initial changes.
    changes_seen: bool,
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

    /// Expires a verdict that needs no action after some seconds.
    pub fn expire_verdict(&mut self, ctx: &egui::Context) {
        if !self.verdict.as_ref().is_some_and(needs_no_action) {
            return;
        }
        let now = ctx.input(|input| input.time);
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
        let shows_verdict = self.shown_verdict(around).is_some();
        self.problem.is_some() || shows_verdict || tasks.are_under_way() || self.shows_first_notice(player, around)
    }

    /// Whether the first-time scene is displayed and its notice not yet dismissed.
    fn shows_first_notice(&self, player: &Player, around: Surroundings) -> bool {
        around == Surroundings::Window && !self.changes_seen && opening::is_rattling(player.pending())
    }

    /// The verdict on a link while it is displayed.
    fn shown_verdict(&self, around: Surroundings) -> Option<&Verdict> {
        let is_shown = self.verdict_shown != Some(f64::NEG_INFINITY);
        let is_relevant = |verdict: &&Verdict| around != Surroundings::Page || !needs_no_action(verdict);
        self.verdict.as_ref().filter(is_relevant).filter(|_| is_shown)
    }

    /// Area of the messages at the lower edge of `area`.
    pub fn area(ui: &Ui, area: Rect) -> Rect {
        // Height in the previous frame; initially one line with a button.
        let height = ui.data(|data| data.get_temp(Id::unique(MESSAGES_KEY)));
        let height = height.unwrap_or(ui.spacing().interact_size.y + 16.0);
        Align2::CENTER_BOTTOM.align_size_within_rect(egui::vec2(area.width().min(640.0), height), area)
    }

    /// Messages over the lower edge of the picture in `area`; they appear and disappear without affecting the layout. Returns the
    /// command chosen in them.
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
            self.notice_plate(ui, area);
            return None;
        }
        let row = ui.spacing().interact_size.y;
        let most = if self.is_refused(player) {
            // Hides the picture, which does not show what the link promised.
            let fill = ui.visuals().panel_fill;
            ui.painter().rect_filled(area.expand(10.0), 0.0, fill);
            area.height()
        } else {
            (area.height() - row - 8.0).max(60.0)
        };
        let place = Self::area(ui, area);
        let shown = ui.scope_builder(egui::UiBuilder::new().max_rect(place), |ui| {
            ScrollArea::vertical()
                .id_salt("messages")
                .max_height(most)
                .min_scrolled_height(most)
                .show(ui, |ui| self.strips(ui, player, tasks, around))
        });
        let now = shown.response.rect.height();
        if now != place.height() {
            ui.data_mut(|data| data.insert_temp(id, now));
            ui.ctx().request_repaint();
        }
        self.notice_plate(ui, area.with_max_y(place.top() - 8.0));
        shown.inner.inner
    }

    /// Errors, the progress of a task, and the verdict on a link.
    fn strips(&mut self, ui: &mut Ui, player: &Player, tasks: &Tasks, around: Surroundings) -> Option<Command> {
        let mut chosen = None;
        if self.shows_first_notice(player, around) && self.changes_strip(ui) {
            chosen = Some(Command::PaperSettings);
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
        chosen
    }

    /// Notice of the changes the window started with; returns whether to revert them.
    fn changes_strip(&mut self, ui: &mut Ui) -> bool {
        let words = "Driven at 6 Hz; in the paper at 0.5 Hz.";
        let row = plate(ui, ui.visuals().weak_text_color()).show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                ui.label(words);
                let help = "The scene as in its file. Its joints rattle for 70 ms and come to rest; at 6 Hz they \
                            rattle in every period";
                let paper = ui.button("The paper's settings").on_hover_text(help).clicked();
                (paper, ui.button("Dismiss").clicked())
            })
            .inner
        });
        let (paper, dismissed) = row.inner;
        self.changes_seen |= dismissed;
        paper
    }

    /// A notice displayed for a few seconds.
    fn notice_plate(&mut self, ui: &Ui, area: Rect) {
        let now = ui.input(|input| input.time);
        let Some(notice) = &mut self.notice else {
            return;
        };
        let left = notice.remaining_time(now);
        if left <= 0.0 {
            self.notice = None;
            return;
        }
        ui.ctx().request_repaint_after(Duration::from_secs_f64(left));
        let font = egui::TextStyle::Body.resolve(ui.style());
        let colour = ui.visuals().text_color();
        let width = (area.width() - 24.0).max(40.0);
        let words = ui.painter().layout(notice.text.clone(), font, colour, width);
        let above = egui::vec2(0.0, ui.spacing().interact_size.y + 8.0);
        let place = Align2::CENTER_BOTTOM.align_size_within_rect(words.size(), area.translate(-above));
        let fill = ui.visuals().window_fill.gamma_multiply(0.92);
        ui.painter().rect_filled(place.expand2(egui::vec2(10.0, 5.0)), 6.0, fill);
        ui.painter().galley(place.min, words, colour);
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
