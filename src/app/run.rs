//! The run and its views.

use eframe::egui::Ui;

use super::beside::Beside;
use super::controls::Controls;
use super::impact_list::ImpactList;
use super::keys::Action;
use super::microscope::Microscope;
use super::player::Player;
use super::plots::Plots;
use super::timeline::Timeline;
use super::undo::Undo;
use super::viewport::Viewport;
use super::{Link, opening, transport};
use crate::scene::Scene;
use crate::session::pace::LONGEST_STEPPING;
use crate::view::{Preset, ViewOptions};

/// The run, the views that follow its instant, and the controls that change it.
pub struct Run {
    pub player: Player,
    pub viewport: Viewport,
    pub(super) beside: Beside,
    pub plots: Plots,
    pub timeline: Timeline,
    pub controls: Controls,
    pub microscope: Microscope,
    pub impact_list: ImpactList,
    pub undo: Undo,
    /// Range of the plots in the latest frame, and the one recorded in detail, s.
    plotted: [(f64, f64); 2],
}

impl Run {
    /// `player` seen with `options`.
    pub fn new(mut player: Player, options: ViewOptions) -> Self {
        let plots = Plots::of(player.running());
        player.record_tip_error(plots.has_tip_error());
        Self {
            viewport: Viewport::new(&player, options),
            beside: None,
            plots,
            timeline: Timeline::default(),
            controls: Controls::default(),
            microscope: Microscope::default(),
            impact_list: ImpactList::default(),
            undo: Undo::default(),
            plotted: <_>::default(),
            player,
        }
    }

    /// Shows `player`, at the start of `scene`, in place of the run, which is returned.
    pub fn show_scene(&mut self, scene: &Scene, mut player: Player) -> Player {
        player.clock = self.player.clock;
        let is_other_scene = scene.source.text != self.player.pending().source.text;
        let scale = if is_other_scene { opening::time_scale(scene) } else { self.player.pacer.scale() };
        player.pacer.set_scale(scale);
        player.set_playing(self.player.is_playing() || self.player.stopped().is_some());
        player.set_ideal(self.player.ideal().is_some());
        let before = std::mem::replace(&mut self.player, player);
        self.viewport.show_scene(&self.player);
        self.timeline.reset();
        self.plots.reset();
        self.plots.comparison.clear();
        if is_other_scene {
            self.plots.restore_initial(scene);
        }
        self.player.record_tip_error(self.plots.has_tip_error());
        self.controls.clear();
        self.undo.clear();
        before
    }

    /// Applies camera, followed part, plots and instruments of `link`.
    ///
    /// # Errors
    /// There is no ideal ghost; the message says why.
    pub fn apply_link(&mut self, link: &Link) -> Result<(), String> {
        if let Some(pose) = link.camera {
            self.viewport.set_pose(pose);
        }
        // The existence of the parts was checked when the link was read.
        let scene = self.player.running();
        self.viewport.follow(link.followed_part(scene).ok().flatten());
        if let Some(chosen) = &link.plots {
            self.plots.chosen.clone_from(chosen);
        }
        if let Some(channels) = &link.channels {
            self.plots.picked.clone_from(channels);
        }
        if let Some(window) = link.window {
            self.plots.window = window;
        }
        let mut shown_ideal = Ok(());
        if let Some(shown) = &link.instruments {
            let joint = link.microscope_joint(scene).ok().flatten();
            self.microscope.set_open(joint.is_some());
            if let Some(joint) = joint {
                self.microscope.focus(joint);
            }
            self.viewport.options.wear = shown.wear;
            shown_ideal = self.show_ideal(shown.ideal);
        }
        // Channels are recorded from now on, not from the first frame on.
        self.player.pick(&self.plots.picked);
        shown_ideal
    }

    /// Applies the link settings that [`Self::apply_link`] leaves to the caller.
    pub fn set_look(&mut self, link: &Link) {
        if let Some(scale) = link.time_scale {
            self.player.pacer.set_scale(scale);
        }
        if let Some(magnification) = link.magnification {
            self.viewport.options.magnification = magnification;
        }
    }

    /// Pauses and shows `time`, s: any previously displayed instant.
    pub fn show_instant(&mut self, time: f64) {
        self.player.go_to(time);
        self.viewport.restore_marks(&self.player);
    }

    /// The timeline with its navigation.
    pub fn timeline_ui(&mut self, ui: &mut Ui) {
        if self.timeline.ui(ui, &mut self.player, self.viewport.focus()) {
            self.viewport.restore_marks(&self.player);
        }
    }

    /// The plots, or that of index `single`; a click shows its instant, unless a task is under way (not `free`).
    pub fn plots_ui(&mut self, ui: &mut Ui, single: Option<usize>, free: bool) {
        let clicked_time = match single {
            Some(index) => self.plots.single(ui, &self.player, index),
            None => self.plots.ui(ui, &self.player),
        };
        if let Some(time) = clicked_time.filter(|_| free) {
            self.show_instant(time);
        }
    }

    /// Pauses and runs to `time`, s, without a time limit. Impacts on the way are recorded but do not glow.
    pub fn run_to(&mut self, time: f64) {
        self.player.run_to(time);
        self.player.advance(0.0);
        self.viewport.clear_history(&self.player);
    }

    /// Resets to t = 0 with all changes applied.
    ///
    /// # Errors
    /// The changed scene does not start, as a message.
    pub fn reset(&mut self) -> Result<(), String> {
        self.player.reset().map_err(|error| self.player.pending().locate(&error).to_string())?;
        self.timeline.reset();
        self.plots.reset();
        self.plots.comparison.reset();
        self.beside = None;
        self.viewport.restart(&self.player);
        Ok(())
    }

    /// Advances by `dt` seconds, the player by `step`; returns whether the state is still changing.
    pub fn advance(&mut self, dt: f64, step: impl FnOnce(&mut Player, f64)) -> bool {
        self.player.plotted = self.plots.length(&self.player);
        self.player.record_tip_error(self.plots.has_tip_error());
        let was_seeking = self.player.is_seeking();
        // Two machines side by side show the same instant: the current one waits for the other.
        let waits = self.plots.comparison.is_behind(&self.player);
        step(&mut self.player, if waits { 0.0 } else { dt });
        if was_seeking && !self.player.is_seeking() {
            self.viewport.restore_marks(&self.player);
        }
        let moves = self.retrace_plotted() | self.viewport.advance(&self.player, dt as f32);
        let moves = self.advance_earlier_runs(dt as f32) || moves;
        moves || was_seeking || self.player.is_seeking() || self.player.is_playing() || self.player.is_ideal_behind()
    }

    /// Has the range of the plots recorded in detail once it stands still. Returns whether that is still to be done.
    fn retrace_plotted(&mut self) -> bool {
        let range = self.plots.range(&self.player);
        let [latest, detailed] = &mut self.plotted;
        let stands = std::mem::replace(latest, range) == range;
        if self.player.is_playing() || range == *detailed {
            return false;
        }
        if stands {
            *detailed = range;
            self.player.retrace_range(range.0, range.1);
        }
        !stands
    }

    /// Steps between two frames, as [`Player::step_between`].
    pub fn step_between(&mut self, since: f64) -> Option<bool> {
        let comparison = &mut self.plots.comparison;
        let waits = comparison.is_behind(&self.player);
        let behind = if waits { None } else { self.player.step_between(since) };
        let lags = comparison.follow(&self.player, LONGEST_STEPPING);
        behind.or(lags.then_some(true)).map(|behind| behind || lags)
    }

    /// Performs an action on the run and its views; others have no effect.
    pub fn perform(&mut self, action: Action) {
        let player = &mut self.player;
        match action {
            Action::PlayPause => player.set_playing(!player.is_playing()),
            Action::Step => player.single_step(),
            Action::StepBack => {
                player.step_back();
                self.viewport.restore_marks(player);
            }
            Action::Backwards if player.is_playing_backwards() => player.set_playing(false),
            Action::Backwards => player.play_backwards(),
            Action::Impact { forward } => {
                player.go_to_impact(self.viewport.focus(), forward);
                self.viewport.restore_marks(player);
            }
            Action::Home => self.show_instant(0.0),
            Action::End => {
                let end = player.reached();
                self.show_instant(end);
            }
            Action::Slower | Action::Faster => {
                let scale = transport::next_scale(player.pacer.scale(), action == Action::Faster);
                player.pacer.set_scale(scale);
            }
            Action::Fit => self.viewport.fit(),
            Action::Camera { redo } => self.undo_camera(redo),
            Action::Preset(index) => {
                if let Some(preset) = Preset::ALL.get(index) {
                    self.viewport.preset(*preset);
                }
            }
            Action::CloseUp(joint) if joint < player.running().machine.loose_joints.len() => {
                self.microscope.focus(joint);
                self.viewport.show_close_up(player, joint);
            }
            Action::Microscope => self.microscope.set_open(!self.microscope.is_open()),
            Action::ImpactList => self.impact_list.toggle(),
            Action::Magnify => self.viewport.next_magnification(),
            Action::Arrows => {
                let arrows = &mut self.viewport.options.arrows;
                let on = !(arrows.normal || arrows.friction);
                (arrows.normal, arrows.friction) = (on, on);
            }
            _ => {}
        }
    }
}
