//! Snapshot of the window before a lesson, restored when the lesson ends.

use super::Lesson;
use crate::app::CameraPose;
use crate::app::bench::Bench;
use crate::app::compare::Comparison;
use crate::app::messages::Messages;
use crate::app::panels::{Panels, Sheet};
use crate::app::player::Player;
use crate::app::plots::PlotChoice;
use crate::app::reload::SceneFile;
use crate::app::run::Run;
use crate::app::tasks::Tasks;
use crate::app::undo::Undo;
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
    /// Whether the microscope was open, and its joint with play.
    microscope: (bool, usize),
    ideal: bool,
    scale: f64,
    /// Runs from before a change, and the undo history.
    comparison: Comparison,
    undo: Undo,
    /// The run and its file, once a lesson scene has replaced them.
    run: Option<(Player, SceneFile)>,
}

impl PreviousWindow {
    /// Takes the snapshot. A lesson starts with an empty bench.
    pub fn take(run: &mut Run, panels: &Panels, bench: &mut Bench) -> Self {
        bench.show_costs(false);
        Self {
            panels: [panels.controls, panels.plots, panels.bench],
            sheet: panels.sheet,
            plots: run.plots.choice(),
            bench: std::mem::take(bench),
            options: run.viewport.options.clone(),
            pose: run.viewport.pose(),
            fitted_aspect: run.viewport.fitted_aspect(),
            followed: run.viewport.followed(),
            microscope: (run.microscope.is_open(), run.microscope.joint()),
            ideal: run.player.ideal().is_some(),
            scale: run.player.pacer.scale(),
            comparison: std::mem::take(&mut run.plots.comparison),
            undo: std::mem::take(&mut run.undo),
            run: None,
        }
    }

    /// Stores the run just replaced by a lesson scene; only the first such run belongs to the snapshot.
    pub fn remember_run(&mut self, player: Player, file: SceneFile) {
        self.run.get_or_insert((player, file));
    }

    /// Restores the window from before `lesson`; returns the file of its run if a lesson scene had replaced it. A machine opened
    /// meanwhile that does not belong to the lesson stays.
    pub fn restore(
        self,
        lesson: &Lesson,
        run: &mut Run,
        panels: &mut Panels,
        bench: &mut Bench,
        tasks: &mut Tasks,
        messages: &mut Messages,
    ) -> Option<SceneFile> {
        tasks.cancel_film(run);
        [panels.controls, panels.plots, panels.bench] = self.panels;
        panels.sheet = self.sheet;
        run.plots.restore_choice(self.plots);
        *bench = self.bench;
        run.microscope.set_open(self.microscope.0);
        let text = &run.player.pending().source.text;
        if !lesson.runs.iter().any(|run| run.scene.source.text == *text) {
            return None;
        }
        tasks.clear();
        messages.clear();
        let thickness = run.viewport.options.arrows.thickness;
        run.viewport.options = self.options;
        // A presentation may still be active.
        run.viewport.options.arrows.thickness = thickness;
        let mut own_file = None;
        if let Some((player, file)) = self.run {
            (run.player, own_file) = (player, Some(file));
            run.controls.clear();
            run.timeline.reset();
            run.viewport.show_scene(&run.player);
            (run.plots.comparison, run.undo) = (self.comparison, self.undo);
        } else {
            run.player.pacer.set_scale(self.scale);
            messages.warn(run.show_ideal(self.ideal));
        }
        if let Some(pose) = self.pose {
            run.viewport.set_pose_for(pose, self.fitted_aspect);
        }
        run.viewport.follow(self.followed);
        run.microscope.focus(self.microscope.1);
        own_file
    }
}
