//! Lessons: steps with a text and a machine state, questions answered by the run, and explanations.

mod before;
mod built_in;
mod control_finder;
mod course;
mod format;
mod measure;
mod names;
mod panel;
#[cfg(test)]
mod tests;
mod text;

use std::sync::Arc;

use eframe::egui::{self, Ui};

use super::log::Event;
use super::panels::Sheet;
use super::player::Player;
use super::tasks::replay_budget;
use super::{App, Link};
use crate::session::replay::Verdict;
use before::PreviousWindow;
pub use built_in::{BUILT_IN_LESSONS, LessonCard, cards, lesson_titles};
pub use course::Course;
pub use format::{CameraTarget, Lesson};
use format::{PanelName, Step};
use measure::LessonMeasures;
use names::{Names, comparisons};

/// Latest time of a live change after its nominal instant, s: the longest solver step.
const MAX_DELAY: f64 = 10e-3;

/// A lesson in progress.
pub struct RunningLesson {
    lesson: Arc<Lesson>,
    step: usize,
    /// The machine is being brought to the state of the step.
    is_setting_machine: bool,
    /// Index of the predicted choice.
    predicted: Option<usize>,
    /// The machine has reached the end of the step.
    reached: bool,
    /// The result has not been drawn yet.
    has_new_result: bool,
    /// Whether the panel hides the lower part of the step.
    hides_rest: bool,
    /// Whether the progress has no room between the buttons.
    has_progress_in_title: bool,
    measured: LessonMeasures,
}

impl RunningLesson {
    /// Starts at step `step`, counted from 0, or at the last step if there are fewer.
    pub fn new(lesson: Arc<Lesson>, step: usize) -> Self {
        Self {
            step: step.min(lesson.steps.len() - 1),
            is_setting_machine: false,
            predicted: None,
            reached: false,
            has_new_result: false,
            hides_rest: false,
            has_progress_in_title: false,
            measured: LessonMeasures::new(lesson.clone()),
            lesson,
        }
    }

    /// The lesson.
    pub fn lesson(&self) -> &Lesson {
        &self.lesson
    }

    /// Index of the step.
    pub fn step(&self) -> usize {
        self.step
    }

    /// Name and step (counted from 1) for a link; `None` unless the lesson is built in.
    pub(super) fn link_position(&self) -> Option<(String, usize)> {
        let name = &self.lesson.name;
        let known = BUILT_IN_LESSONS.iter().any(|(own, _)| own == name);
        known.then(|| (name.clone(), self.step + 1))
    }

    fn current_step(&self) -> &Step {
        &self.lesson.steps[self.step]
    }

    /// Whether the answer and the explanation are displayed.
    pub fn is_reached(&self) -> bool {
        self.reached
    }

    /// Whether the machine is still being brought to the state of the step.
    pub fn is_busy(&self) -> bool {
        self.is_setting_machine
    }

    /// Computes all measures of the lesson without a time limit.
    ///
    /// # Errors
    /// The cause of a failed computation.
    pub fn measure(&mut self) -> Result<(), String> {
        self.measured.advance(|| true);
        self.measured.fault().map_or(Ok(()), |why| Err(why.to_owned()))
    }

    /// Index of the correct choice of this step's question; `None` while unknown.
    pub fn correct_choice(&self) -> Option<usize> {
        let names = self.measured.names();
        let choices = &self.current_step().question.as_ref()?.choices;
        choices.iter().position(|choice| names.holds(&choice.when) == Some(true))
    }

    /// The instant at which the step ends, s.
    pub fn until(&self) -> Option<f64> {
        self.measured.names().time(self.current_step().until.as_ref()?)
    }

    /// Checks the lesson: every text can be filled in, every claim holds, and every question has exactly one correct choice.
    /// Computes all measures first.
    ///
    /// # Errors
    /// The first fault, as a message.
    pub fn examine(&mut self) -> Result<(), String> {
        self.measure()?;
        let names = self.measured.names();
        for (index, step) in self.lesson.steps.iter().enumerate() {
            let at = |what: String| format!("{}, step {}: {what}", self.lesson.name, index + 1);
            let question = step.question.as_ref();
            let question_texts = question.into_iter().flat_map(|question| {
                let choices = question.choices.iter().map(|choice| &choice.text);
                std::iter::once(&question.ask).chain(choices)
            });
            for text in [&step.text, &step.seen].into_iter().chain(question_texts) {
                text::fill(text, &names).map_err(at)?;
            }
            for claim in &step.claims {
                if names.holds(claim) != Some(true) {
                    let values = known_values(claim, &names);
                    return Err(at(format!("`{claim}` does not hold: {values}")));
                }
            }
            if let Some(question) = question {
                let correct = question.choices.iter().filter(|c| names.holds(&c.when) == Some(true));
                let correct: Vec<&str> = correct.map(|choice| &*choice.text).collect();
                if correct.len() != 1 {
                    let values: Vec<String> = question.choices.iter().map(|c| known_values(&c.when, &names)).collect();
                    let values = values.join("; ");
                    return Err(at(format!("{} choices are correct, not one: {correct:?}: {values}", correct.len())));
                }
            }
            if let Some(until) = &step.until {
                let begin = self.lesson.steps[self.lesson.run_start_step(index)].link.time;
                if !names.time(until).is_some_and(|until| Some(until) > begin) {
                    return Err(at(format!("`{until}` is not an instant after the beginning of the step")));
                }
            }
        }
        Ok(())
    }

    /// What is said of the lesson to those who do not see it: the step, and once it is reached the answer and the next step.
    pub fn report(&self) -> String {
        let step = self.current_step();
        let names = self.measured.names();
        let plain = |markdown: &str| {
            let filled = text::fill(markdown, &names).unwrap_or_default();
            let letters = |block: text::Block| block.pieces.iter().map(|piece| &*piece.text).collect::<String>();
            text::blocks(&filled).into_iter().map(letters).collect::<Vec<_>>().join(" ")
        };
        let count = self.lesson.steps.len();
        if !self.reached || step.until.is_none() {
            let ask = step.question.as_ref().map_or_else(String::new, |question| format!(" {}", plain(&question.ask)));
            return format!("Step {} of {count}: {}. {}{ask}", self.step + 1, step.title, plain(&step.text));
        }
        let answer = self.verdict().map_or_else(String::new, |verdict| format!("{verdict}. "));
        let seen = plain(&step.seen);
        let next = match self.lesson.steps.get(self.step + 1) {
            Some(next) => format!("Next step: {}.", next.title),
            None => "This was the last step.".to_owned(),
        };
        format!("{answer}{seen} {next}")
    }

    /// The answer to the step's question, compared with the prediction; `None` while unknown.
    fn verdict(&self) -> Option<String> {
        let (correct, words) = (self.correct_choice()?, self.answer()?);
        Some(match self.predicted {
            Some(choice) if choice == correct => format!("As predicted: {words}"),
            Some(_) => format!("Not as predicted. Answer: {words}"),
            None => format!("Answer: {words}"),
        })
    }

    /// Text of the correct choice; `None` while unknown.
    pub fn answer(&self) -> Option<String> {
        let choice = &self.current_step().question.as_ref()?.choices[self.correct_choice()?];
        text::fill(&choice.text, &self.measured.names()).ok()
    }

    /// The whole lesson as text with values and answers, after [`Self::examine`].
    ///
    /// # Errors
    /// As [`Self::examine`].
    pub fn print(&mut self) -> Result<String, String> {
        self.examine()?;
        let mut out = format!("{}\n", self.lesson.title);
        let lesson = self.lesson.clone();
        for (index, step) in lesson.steps.iter().enumerate() {
            self.step = index;
            let names = self.measured.names();
            let words = |text: &str| {
                let filled = text::fill(text, &names).unwrap_or_default();
                let blocks = text::blocks(&filled);
                let lines = blocks.iter().map(|block| {
                    let letters: String = block.pieces.iter().map(|piece| &*piece.text).collect();
                    format!("  {}{letters}\n", if block.entry { "- " } else { "" })
                });
                lines.collect::<String>()
            };
            out += &format!("\n{}. {}\n{}", index + 1, step.title, words(&step.text));
            if let Some(question) = &step.question {
                out += &words(&question.ask);
                for (index, choice) in question.choices.iter().enumerate() {
                    let mark = if self.correct_choice() == Some(index) { "x" } else { " " };
                    out += &format!("  [{mark}]{}", words(&choice.text));
                }
            }
            out += &words(&step.seen);
        }
        Ok(out)
    }

    /// Whether the displayed run belongs to the step, i.e. the user has not changed the machine.
    fn is_run_of_step(&self, player: &Player) -> bool {
        let run = &self.lesson.runs[self.current_step().run];
        let log = player.log();
        let begin = &self.lesson.steps[self.lesson.run_start_step(self.step)];
        let same = (!begin.twin || player.twin().is_some())
            && log.base == run.scene.changes
            && player.running().source.text == run.scene.source.text
            && log.entries.len() == run.changes.len();
        let mut pairs = log.entries.iter().zip(player.flags()).zip(&run.changes);
        same && pairs.all(|((entry, flag), (time, key, value))| {
            entry.event == Event::set(key, value) && (0.0..=MAX_DELAY).contains(&(flag.time - time))
        })
    }
}

/// Both sides of each comparison in a condition, with their values.
fn known_values(condition: &str, names: &Names<'_>) -> String {
    let mut out: Vec<String> = Vec::new();
    for (left, _, right) in comparisons(condition).unwrap_or_default() {
        for side in [left, right] {
            let value = crate::scene::evaluate(side, &names.known)
                .map_err(|error| error.to_string())
                .and_then(|quantity| text::words(quantity, None));
            out.push(format!("{side} is {}", value.unwrap_or_else(|why| why)));
        }
    }
    out.join(", ")
}

impl App {
    /// Continues `lesson` at step `step`, counted from 0; if `starts_step`, the machine is set for that step.
    pub(super) fn resume_lesson(&mut self, lesson: Arc<Lesson>, step: usize, starts_step: bool) {
        self.course.remember_window(&mut self.run, &self.panels, &mut self.bench);
        self.course.begin(lesson, step);
        self.panels.sheet = Some(Sheet::Lesson);
        if starts_step {
            self.set_step();
        }
    }

    /// Starts a built-in lesson.
    pub(super) fn open_lesson(&mut self, name: &str) {
        match Lesson::built_in(name) {
            Ok(lesson) => self.resume_lesson(lesson, 0, true),
            Err(error) => self.messages.fail(error),
        }
    }

    /// Ends the lesson and restores the window.
    pub(super) fn leave_lesson(&mut self) {
        if let Some((lesson, Some(before))) = self.course.end() {
            let Self { run, panels, bench, tasks, messages, .. } = self;
            if let Some(file) = before.restore(&lesson, run, panels, bench, tasks, messages) {
                self.files.scene = file;
            }
        }
        // That of the lesson's scene.
        self.hint.end();
        if self.panels.sheet == Some(Sheet::Lesson) {
            self.panels.sheet = None;
        }
    }

    /// The panel of the lesson.
    pub(super) fn lesson_ui(&mut self, ui: &mut Ui) {
        let presented = self.presentation.is_running();
        let low = presented && !self.panels.is_touched();
        let command = self.course.ui(ui, &self.run.player, presented, low);
        self.perform_all(ui.ctx(), command);
    }

    /// Goes to the next or the previous step of the lesson.
    pub(super) fn change_step(&mut self, forward: bool) {
        let Some(running) = &mut self.course.running else {
            return;
        };
        let last = running.lesson.steps.len() - 1;
        let step = match forward {
            true if running.step < last => running.step + 1,
            false if running.step > 0 => running.step - 1,
            _ => return,
        };
        // A continuing step needs no new state if the machine is where the previous step left it: not before the previous step's
        // end, and not past the end of this one, which would reveal the answer.
        let shown = self.run.player.pacer.shown();
        let end = |step: usize| {
            let until = running.lesson.steps[step].until.as_ref();
            until.and_then(|until| running.measured.names().time(until))
        };
        let in_place = end(running.step).is_none_or(|end| shown >= end) && end(step).is_none_or(|end| shown < end);
        let starts_run = running.lesson.steps[step].begins;
        let continues = forward && !starts_run && in_place && running.is_run_of_step(&self.run.player);
        (running.step, running.predicted, running.reached) = (step, None, false);
        if continues {
            self.run.player.set_playing(false);
            self.apply_camera_of_step(false);
        } else {
            self.set_step();
        }
    }

    /// Sets the machine for the step: to the start of its run, or to the end of the previous step in that run.
    pub(super) fn set_step(&mut self) {
        let Some(running) = &mut self.course.running else {
            return;
        };
        (running.is_setting_machine, running.predicted, running.reached) = (true, None, false);
        let begin = &running.lesson.steps[running.lesson.run_start_step(running.step)];
        let (scene, link) = (running.lesson.runs[begin.run].scene.clone(), begin.link.clone());
        let before = &running.lesson.steps[running.lesson.run_start_step(running.step)..running.step];
        let names = running.measured.names();
        let mut ends = before.iter().rev().filter_map(|step| step.until.as_ref());
        let whole = begin.twin || !running.lesson.runs[begin.run].changes.is_empty();
        let left_at = ends.find_map(|until| names.time(until)).filter(|_| !whole);
        let same = self.run.player.pending().source.text == scene.source.text;
        let pose = self.run.viewport.pose().filter(|_| same && link.camera.is_none());
        let shown = self.show_scene(&scene);
        self.messages.report(shown);
        self.run.player.set_playing(false);
        if let Some(pose) = pose {
            self.run.viewport.set_pose(pose);
        }
        let mut link = link;
        // Live changes and twin runs must be replayed from the start.
        if let Some(end) = left_at {
            link.time = Some(end);
        }
        link.instruments.get_or_insert_default();
        self.run.set_look(&link);
        self.show_link(link);
    }

    /// Applies the view settings of the step; the machine is unchanged. `is_fresh`: the machine was just set, so the settings of
    /// earlier steps apply as well.
    fn apply_camera_of_step(&mut self, is_fresh: bool) {
        let Some(running) = &self.course.running else {
            return;
        };
        let (lesson, last) = (running.lesson.clone(), running.step);
        let first = if is_fresh { 0 } else { last };
        let steps = &lesson.steps[first..=last];
        let begin = if is_fresh { lesson.run_start_step(last) } else { last };
        for step in &lesson.steps[begin..=last] {
            if !step.begins && step.link != Link::default() {
                // The camera continues to follow its joint.
                let followed = self.run.viewport.followed().filter(|_| step.link.camera.is_none());
                self.run.set_look(&step.link);
                self.show_link(step.link.clone());
                self.run.viewport.follow(followed);
            }
        }
        // The latest camera setting applies.
        let places = |step: &&Step| step.view.is_some() || step.link.camera.is_some();
        match steps.iter().rev().find(places).and_then(|step| step.view) {
            Some(CameraTarget::From(preset)) => self.run.viewport.preset(preset),
            Some(CameraTarget::At(joint)) => {
                self.run.viewport.show_close_up(&self.run.player, joint);
            }
            None => {}
        }
        if let Some(open) = steps.iter().rev().find_map(|step| step.open.as_ref()) {
            let is_open = |panel| open.contains(&panel);
            self.panels.controls = is_open(PanelName::Controls);
            self.panels.plots = is_open(PanelName::Plots);
            self.panels.bench = is_open(PanelName::Bench);
        }
    }

    /// Advances the lesson alongside the run: computes its measures, and stops the machine at the end of the step.
    pub(super) fn advance_lesson(&mut self, ctx: &egui::Context) {
        let Some(running) = &mut self.course.running else {
            return;
        };
        if !running.measured.advance(replay_budget(self.run.player.clock)) {
            ctx.request_repaint();
        }
        if running.is_setting_machine {
            if self.tasks.replay().is_some() {
                return;
            }
            running.is_setting_machine = false;
            if self.messages.verdict() == Some(&Verdict::Reached) {
                self.messages.set_verdict(None);
            }
            let begin = &running.lesson.steps[running.lesson.run_start_step(running.step)];
            for (_, key, value) in &running.lesson.runs[begin.run].changes {
                if let Err(error) = self.run.player.set(key, value) {
                    self.messages.fail(error);
                }
            }
            // These are not user edits.
            self.run.player.take_edits();
            if begin.twin {
                self.run.player.set_twin(true);
            }
            self.apply_camera_of_step(true);
            ctx.request_repaint();
            return;
        }
        if running.reached || self.tasks.are_under_way() {
            return;
        }
        let Some(running) = &mut self.course.running else {
            return;
        };
        if let Some(until) = running.until()
            && self.run.player.pacer.shown() >= until
        {
            (running.reached, running.has_new_result) = (true, true);
            if self.run.player.is_playing() {
                self.show_instant(until);
            }
            ctx.request_repaint();
        }
    }
}
