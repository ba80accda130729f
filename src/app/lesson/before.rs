//! Snapshot of the window before a lesson, restored when the lesson ends.

use super::Lesson;
use crate::app::bench::Bench;
use crate::app::compare::Comparison;
use crate::app::layout::Sheet;
use crate::app::player::Player;
use crate::app::plots::PlotChoice;
use crate::app::reload::SceneFile;
use crate::app::undo::Undo;
use crate::app::{App, CameraPose};
use crate::view::{ScenePart, ViewOptions};

/// All settings that a lesson changes.
pub struct PreviousWindow {
    /// Whether controls, plots and bench were shown.
    panels: [bool; 3],
    sheet: Option<Sheet>,
    plots: PlotChoice,
    bench: Bench,
    options: ViewOptions,
    pose: Option<CameraPose>,
    fitted_aspect: f32,
    followed: Option<ScenePart>,
    /// Whether the microscope was open, and its ball joint.
    microscope: (bool, usize),
    ideal: bool,
    scale: f64,
    /// Runs from before a change, and the undo history.
    comparison: Comparison,
    undo: Undo,
    /// The run and its file, once a lesson scene has replaced them.
    run: Option<(Player, SceneFile)>,
}

impl App {
    /// Takes the snapshot, unless the current lesson has already done so.
    pub(in crate::app) fn remember_window(&mut self) {
        if self.before_lesson.is_some() {
            return;
        }
        self.bench.show_costs(false);
        self.before_lesson = Some(Box::new(PreviousWindow {
            panels: [self.show_controls, self.show_plots, self.show_bench],
            sheet: self.sheet,
            plots: self.plots.choice(),
            // A lesson starts with an empty bench.
            bench: std::mem::take(&mut self.bench),
            options: self.viewport.options.clone(),
            pose: self.viewport.pose(),
            fitted_aspect: self.viewport.fitted_aspect(),
            followed: self.viewport.followed(),
            microscope: (self.microscope.is_open(), self.microscope.joint()),
            ideal: self.player.ideal().is_some(),
            scale: self.player.pacer.scale(),
            comparison: std::mem::take(&mut self.plots.comparison),
            undo: std::mem::take(&mut self.undo),
            run: None,
        }));
    }

    /// Stores the run just replaced by a lesson scene; only the first such run belongs to the snapshot.
    pub(in crate::app) fn remember_run(&mut self, player: Player, file: SceneFile) {
        if let Some(before) = &mut self.before_lesson
            && before.run.is_none()
        {
            before.run = Some((player, file));
        }
    }

    /// Restores the window from before `lesson`. A machine opened meanwhile that does not belong to the lesson stays.
    pub(super) fn restore_window(&mut self, lesson: &Lesson) {
        let Some(before) = self.before_lesson.take() else {
            return;
        };
        self.cancel_film();
        [self.show_controls, self.show_plots, self.show_bench] = before.panels;
        self.sheet = before.sheet;
        self.plots.restore_choice(before.plots);
        self.bench = before.bench;
        self.microscope.set_open(before.microscope.0);
        let text = &self.player.pending().source.text;
        if !lesson.runs.iter().any(|run| run.scene.source.text == *text) {
            return;
        }
        (self.replay, self.load, self.verdict, self.problem, self.film_settings) = (None, None, None, None, None);
        let thickness = self.viewport.options.arrows.thickness;
        self.viewport.options = before.options;
        // A presentation may still be active.
        self.viewport.options.arrows.thickness = thickness;
        if let Some((player, file)) = before.run {
            (self.player, self.scene_file) = (player, file);
            self.controls.clear();
            self.timeline.reset();
            self.viewport.show_scene(&self.player);
            (self.plots.comparison, self.undo) = (before.comparison, before.undo);
        } else {
            self.player.pacer.set_scale(before.scale);
            self.show_ideal(before.ideal);
        }
        if let Some(pose) = before.pose {
            self.viewport.set_pose_for(pose, before.fitted_aspect);
        }
        self.viewport.follow(before.followed);
        self.microscope.focus(before.microscope.1);
    }
}
