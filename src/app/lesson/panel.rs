//! The lesson panel: text, question, and navigation buttons.

use eframe::egui::{
    self, Button, Color32, FontFamily, Layout, RadioButton, RichText, ScrollArea, TextFormat, TextStyle, Ui,
    text::LayoutJob,
};

use super::control_finder::ControlFinder;
use super::names::Names;
use super::text::{self, Block, SpanStyle};
use super::{Course, RunningLesson};
use crate::app::command::Command;
use crate::app::player::Player;
use crate::app::{spoken, theme};

/// Height from which a step on a phone shows the title of its lesson, points.
const MIN_HEIGHT_WITH_TITLE: f32 = 290.0;
/// Height of a choice for mouse input, points.
const CHOICE_HEIGHT: f32 = 24.0;
/// Hidden height of a page above which a button to scroll appears, points.
const MIN_HIDDEN: f32 = 8.0;
/// Smallest gap between the navigation buttons, points.
const MIN_GAP: f32 = 2.0;

impl Course {
    /// The whole panel. `low`: in a presentation operated by mouse, whose screen is low in points.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player, presented: bool, low: bool) -> Option<Command> {
        let elsewhere = if presented { self.item_outside_presentation(ui.ctx(), player) } else { None };
        let Some(running) = &mut self.running else {
            return None;
        };
        spoken::landmark(ui, "Lesson");
        let own = running.is_setting_machine || running.is_run_of_step(player);
        let backwards = Layout::bottom_up(egui::Align::Min);
        ui.with_layout(backwards, |ui| {
            let (command, more, shows_progress) = buttons(ui, running);
            running.has_progress_in_title = !shows_progress;
            ui.with_layout(Layout::top_down(egui::Align::Min), |ui| {
                let id = (running.lesson.name.clone(), running.step);
                let page = ScrollArea::vertical().id_salt(id).auto_shrink(false);
                let set = page.show(ui, |ui| {
                    // Space for the scroll bar.
                    ui.set_max_width(ui.available_width() - 10.0);
                    if low {
                        ui.spacing_mut().interact_size.y = CHOICE_HEIGHT;
                        ui.spacing_mut().icon_width = CHOICE_HEIGHT - 8.0;
                    }
                    if more {
                        // The last line of a page is repeated at the top of the next.
                        ui.scroll_with_delta(egui::vec2(0.0, 40.0 - ui.clip_rect().height()));
                    }
                    let set = running.page(ui, own);
                    if let Some(elsewhere) = &elsewhere {
                        ui.label(RichText::new(elsewhere).weak());
                    }
                    set
                });
                let below = set.content_size.y - set.state.unclamped_offset().y - set.inner_rect.height();
                if running.hides_rest != (below > MIN_HIDDEN) {
                    running.hides_rest = below > MIN_HIDDEN;
                    ui.ctx().request_repaint();
                }
                if set.inner { Some(Command::SetStep) } else { command }
            })
            .inner
        })
        .inner
    }

    /// The item the step refers to that the presentation does not show.
    fn item_outside_presentation(&self, ctx: &egui::Context, player: &Player) -> Option<String> {
        let labels = self.pointed_controls(player);
        let places = ControlFinder::places(ctx, &labels);
        let missing: Vec<String> =
            labels.into_iter().filter(|name| places.iter().all(|(own, _)| own != name)).collect();
        (!missing.is_empty()).then(|| format!("In the window (F5): {}", missing.join(", ")))
    }
}

/// Back, Next, progress, and Leave, at positions independent of the page. Returns the command, whether to scroll, and whether
/// the progress has room. In a narrow panel it is abbreviated, or stands in the title.
fn buttons(ui: &mut Ui, running: &RunningLesson) -> (Option<Command>, bool, bool) {
    let (mut command, mut more, mut shows_progress) = (None, false, false);
    let last = running.lesson.steps.len() - 1;
    ui.horizontal(|ui| {
        let names: &[&str] =
            if running.hides_rest { &["Back", "Next", "More", "End"] } else { &["Back", "Next", "End"] };
        let widths = names.iter().map(|name| width(ui, name, TextStyle::Button) + 2.0 * ui.spacing().button_padding.x);
        let free = ui.available_width() - widths.sum::<f32>();
        let gap = (free / (names.len() - 1) as f32).clamp(MIN_GAP, ui.spacing().item_spacing.x.max(MIN_GAP));
        ui.spacing_mut().item_spacing.x = gap;
        for (forward, name, help, possible) in [
            (false, "Back", "Previous step (Page Up)", running.step > 0),
            (true, "Next", "Next step (Page Down)", running.step < last),
        ] {
            let button = ui.add_enabled(possible, Button::new(name)).on_hover_text(help);
            if button.clicked() {
                command = Some(Command::TurnPage { forward });
            }
        }
        let count = running.progress();
        let fits = |words: &String| width(ui, words, TextStyle::Body) + gap * names.len() as f32 <= free;
        if let Some(words) = [format!("Step {count}"), count].into_iter().find(fits) {
            ui.label(words);
            shows_progress = true;
        }
        ui.with_layout(Layout::right_to_left(egui::Align::Center), |ui| {
            let help = "Ends the lesson and restores the window as it was before";
            let leave = ui.button("End").on_hover_text(help);
            if leave.accessible_name("Leave the lesson").clicked() {
                command = Some(Command::LeaveLesson);
            }
            let help = "Scroll down to the rest of the step";
            more = running.hides_rest && ui.button("More").on_hover_text(help).clicked();
        });
    });
    (command, more, shows_progress)
}

/// Width of `words` in one line, points.
fn width(ui: &Ui, words: &str, style: TextStyle) -> f32 {
    let font = style.resolve(ui.style());
    ui.painter().layout_no_wrap(words.to_owned(), font, Color32::PLACEHOLDER).size().x
}

impl RunningLesson {
    /// The step among all steps.
    fn progress(&self) -> String {
        format!("{} of {}", self.step + 1, self.lesson.steps.len())
    }

    /// Title, text, question and answer of the step; returns whether to reset the machine. `own`: it runs as set by the step.
    fn page(&mut self, ui: &mut Ui, own: bool) -> bool {
        let lesson = self.lesson.clone();
        let step = &lesson.steps[self.step];
        let mut set = false;
        {
            let names = self.measured.names();
            if theme::has_fingers(ui) && ui.clip_rect().height() < MIN_HEIGHT_WITH_TITLE {
                // The answers come first.
                ui.spacing_mut().item_spacing.y = 2.0;
            } else {
                let progress =
                    if self.has_progress_in_title { format!(" ({})", self.progress()) } else { String::new() };
                ui.label(RichText::new(format!("{}{progress}", lesson.title)).small().weak());
            }
            spoken::heading(&ui.label(RichText::new(&step.title).heading().strong()), &step.title);
            if let Some(why) = self.measured.fault() {
                theme::error(ui, format!("This lesson cannot be computed: {why}"));
            }
            prose(ui, &step.text, &names);
        }
        if let Some(question) = &step.question {
            ui.spacing_mut().item_spacing.y = 2.0;
            let (correct, names) = (self.correct_choice(), self.measured.names());
            let shows = self.reached && own;
            let mut predicted = self.predicted;
            ui.separator();
            ui.label(RichText::new(filled(&question.ask, &names)).strong());
            for (index, choice) in question.choices.iter().enumerate() {
                let words = filled(&choice.text, &names);
                let colour = ui.visuals().selection.stroke.color;
                let words = match (shows, correct == Some(index)) {
                    (true, true) => RichText::new(words).strong().color(colour),
                    (true, false) => RichText::new(words).weak(),
                    (false, _) => RichText::new(words),
                };
                let chosen = predicted == Some(index);
                let help = "Your prediction. The run shows whether it is correct.";
                let radio = ui
                    .scope(|ui| {
                        // The correct choice must not fade with the others.
                        ui.visuals_mut().disabled_alpha = 1.0;
                        ui.add_enabled(!self.reached, RadioButton::new(chosen, words))
                    })
                    .inner;
                if radio.on_hover_text(help).clicked() {
                    predicted = Some(index).filter(|_| !chosen);
                }
            }
            if let Some(verdict) = self.verdict().filter(|_| shows) {
                let colour = ui.visuals().selection.stroke.color;
                ui.label(RichText::new(verdict).strong().color(colour));
            } else if !self.reached {
                ui.label(RichText::new("Make a prediction, then press Play (space)").weak());
            }
            self.predicted = predicted;
        } else if step.until.is_some() && !self.reached {
            ui.label(RichText::new("Press Play (space)").weak());
        }
        if !own {
            theme::warning(
                ui,
                "The machine has been changed since this step began. The text describes the unchanged run.",
            );
            let help = "Resets the machine to the state in which this step begins";
            set = ui.button("Restart this step").on_hover_text(help).clicked();
        }
        if (self.reached || step.until.is_none()) && !step.seen.is_empty() {
            ui.separator();
            ui.label(RichText::new("What you saw").small().weak());
            prose(ui, &step.seen, &self.measured.names());
        }
        if std::mem::take(&mut self.has_new_result) {
            // The answer may lie below the visible part.
            ui.scroll_to_cursor(Some(egui::Align::BOTTOM));
        }
        set
    }
}

/// `text` with its values filled in, or the error message if that fails.
fn filled(text: &str, names: &Names<'_>) -> String {
    text::fill(text, names).unwrap_or_else(|why| why)
}

/// Renders Markdown with values filled in.
fn prose(ui: &mut Ui, markdown: &str, names: &Names<'_>) {
    for block in text::blocks(&filled(markdown, names)) {
        if block.entry {
            ui.horizontal_top(|ui| {
                ui.label("•");
                paragraph(ui, &block);
            });
        } else {
            paragraph(ui, &block);
        }
    }
}

fn paragraph(ui: &mut Ui, block: &Block) {
    let body = TextStyle::Body.resolve(ui.style());
    let (plain, strong) = (ui.visuals().text_color(), ui.visuals().strong_text_color());
    let mut job = LayoutJob::default();
    for piece in &block.pieces {
        let mut format = TextFormat::simple(body.clone(), plain);
        match piece.face {
            SpanStyle::Plain => {}
            SpanStyle::Emphasis => format.italics = true,
            SpanStyle::Strong => format.color = strong,
            SpanStyle::Code => {
                format.font_id.family = FontFamily::Monospace;
                format.background = ui.visuals().code_bg_color;
            }
        }
        job.append(&text::unbroken(&piece.text), 0.0, format);
    }
    ui.add(egui::Label::new(job).wrap());
}
