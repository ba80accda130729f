//! The lesson in progress with the window that it restores.

use std::sync::Arc;

use eframe::egui;

use super::control_finder::ControlFinder;
use super::{Lesson, PreviousWindow, RunningLesson};
use crate::app::bench::Bench;
use crate::app::panels::Panels;
use crate::app::player::Player;
use crate::app::reload::SceneFile;
use crate::app::run::Run;
use crate::app::theme;

/// The lesson in progress, if any.
#[derive(Default)]
pub struct Course {
    pub(super) running: Option<Box<RunningLesson>>,
    /// Snapshot of the window before the lesson.
    before: Option<Box<PreviousWindow>>,
}

impl Course {
    /// The lesson in progress.
    pub fn running(&self) -> Option<&RunningLesson> {
        self.running.as_deref()
    }

    /// Whether there is one.
    pub fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Takes the snapshot of the window, unless the current lesson has already done so.
    pub fn remember_window(&mut self, run: &mut Run, panels: &Panels, bench: &mut Bench) {
        self.before.get_or_insert_with(|| Box::new(PreviousWindow::take(run, panels, bench)));
    }

    /// Stores the run just replaced by another scene, and its file, if the lesson restores it.
    pub fn remember_run(&mut self, player: Player, file: SceneFile) {
        if let Some(before) = &mut self.before {
            before.remember_run(player, file);
        }
    }

    /// Begins or continues `lesson` at step `step`, counted from 0.
    pub fn begin(&mut self, lesson: Arc<Lesson>, step: usize) {
        self.running = Some(Box::new(RunningLesson::new(lesson, step)));
    }

    /// Ends the lesson; returns it with the snapshot.
    pub fn end(&mut self) -> Option<(Arc<Lesson>, Option<Box<PreviousWindow>>)> {
        let running = self.running.take()?;
        Some((running.lesson, self.before.take()))
    }

    /// Draws rings around the step's highlighted items, over everything, without affecting the layout; those of joints in the
    /// `area` of the picture.
    pub fn ring_highlights(&self, ui: &egui::Ui, run: &Run) {
        let wanted = self.running().map_or(&[][..], |running| &running.current_step().highlight);
        let player = &run.player;
        let joints = &player.running().machine.loose_joints;
        let joint = |name: &String| joints.iter().position(|joint| joint.name == *name);
        let places = ControlFinder::places(ui.ctx(), &self.pointed_controls(player));
        let stroke = egui::Stroke::new(3.0, theme::series(1, ui.visuals().dark_mode));
        let layer = egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("rings"));
        let painter = ui.ctx().layer_painter(layer);
        for (_, rect) in places {
            painter.rect_stroke(rect.expand(4.0), 8.0, stroke, egui::StrokeKind::Outside);
        }
        let inside = painter.with_clip_rect(run.viewport.scene_area());
        for joint in wanted.iter().filter_map(joint) {
            if let Some(place) = run.viewport.place_of_ball(player, joint) {
                inside.circle_stroke(place, 26.0, stroke);
            }
        }
    }

    /// Whether all highlighted items of the step are visible.
    pub fn shows_highlights(&self, ctx: &egui::Context, player: &Player) -> bool {
        let labels = self.pointed_controls(player);
        ControlFinder::places(ctx, &labels).len() == labels.len()
    }

    /// Names of the highlighted controls of the step.
    pub(super) fn pointed_controls(&self, player: &Player) -> Vec<String> {
        let wanted = self.running().map_or(&[][..], |running| &running.current_step().highlight);
        let joints = &player.running().machine.loose_joints;
        wanted.iter().filter(|name| joints.iter().all(|joint| joint.name != **name)).cloned().collect()
    }
}
