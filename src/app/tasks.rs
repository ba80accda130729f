//! Tasks that the run is busy with.

use super::film::{FilmSettings, RunningFilm};
use super::load::Load;
use super::messages::Messages;
use super::player::Player;
use super::run::Run;
use super::{Clock, Link, Replay};
use crate::session::replay::Verdict;

/// Time budget per frame for replaying to the state of a link, s; keeps the window responsive twenty times a second.
const REPLAY_BUDGET: f64 = 0.03;

/// Returns a predicate: whether a frame that starts now may still step.
pub fn replay_budget(clock: Clock) -> impl Fn() -> bool {
    let start = clock();
    move || clock() - start < REPLAY_BUDGET
}

/// Tasks that take the run to a state of their own; it takes no commands meanwhile.
#[derive(Default)]
pub struct Tasks {
    /// A replay to the state of a link.
    replay: Option<Replay>,
    /// A run in progress to a section of a sweep, and whether a twin starts there.
    load: Option<(Load, bool)>,
    /// The film in progress.
    pub(super) film: Option<RunningFilm>,
    /// Settings of the last film.
    pub(super) film_settings: Option<FilmSettings>,
}

impl Tasks {
    /// Whether there is one.
    pub fn are_under_way(&self) -> bool {
        self.replay.is_some() || self.load.is_some() || self.film.is_some()
    }

    /// Starts the replay of `link`, if its state is not the present one.
    pub fn start_replay(&mut self, link: Link, player: &mut Player) {
        self.replay = Replay::new(link, player);
        if self.replay.is_some() {
            player.set_playing(false);
        }
    }

    /// The replay under way.
    pub fn replay(&self) -> Option<&Replay> {
        self.replay.as_ref()
    }

    /// Starts the run to a section; if `twin`, a twin starts there.
    pub fn start_load(&mut self, load: Load, twin: bool) {
        self.load = Some((load, twin));
    }

    /// Forgets the tasks of another scene, whose film has been cancelled.
    pub fn clear(&mut self) {
        (self.replay, self.load, self.film_settings) = (None, None, None);
    }

    /// Progress of the replay to the state of a link, 0 to 1; `None` if there is none.
    pub fn replaying(&self, player: &Player) -> Option<f32> {
        Some(self.replay.as_ref()?.fraction(player))
    }

    /// Progress of the run to a section of a sweep, 0 to 1; `None` if there is none.
    pub fn loading(&self, player: &Player) -> Option<f32> {
        let (load, _) = self.load.as_ref()?;
        Some(load.fraction(player))
    }

    /// Progress of the film, 0 to 1; `None` if none is being made.
    pub fn filming(&self) -> Option<f32> {
        Some(self.film.as_ref()?.fraction())
    }

    /// The tasks in words, with their progress, 0 to 1.
    pub fn progress(&self, player: &Player) -> impl Iterator<Item = (&'static str, f32)> {
        let tasks = [
            ("Reproducing the state of the link", self.replaying(player)),
            ("Running to the chosen section", self.loading(player)),
            ("Making the film", self.filming()),
        ];
        tasks.into_iter().filter_map(|(words, fraction)| Some((words, fraction?)))
    }

    /// Advances replay or run to a section by a frame. Returns whether a task was under way.
    pub fn advance(&mut self, run: &mut Run, messages: &mut Messages) -> bool {
        if let Some(replay) = &self.replay {
            let may_step = replay_budget(run.player.clock);
            let verdict = replay.advance(&mut run.player, may_step);
            let is_over = verdict.is_some();
            messages.set_verdict(verdict);
            run.viewport.hold_scale(&run.player, run.player.pacer.shown());
            if is_over {
                self.replay = None;
                run.viewport.release_scale();
                run.viewport.clear_history(&run.player);
            }
            return true;
        }
        if let Some((load, twin)) = &mut self.load {
            let may_step = replay_budget(run.player.clock);
            run.viewport.hold_scale(&run.player, run.player.pacer.shown());
            if let Some(arrival) = load.advance(&mut run.player, may_step) {
                match arrival {
                    Ok(()) => {
                        run.player.set_twin(*twin);
                        run.player.set_playing(true);
                    }
                    Err(why) => messages.fail(why),
                }
                self.load = None;
                run.viewport.release_scale();
                run.viewport.clear_history(&run.player);
            }
            return true;
        }
        self.film.is_some()
    }

    /// Stops a replay or a run to a section at the present instant; cancels a film.
    pub fn cancel(&mut self, run: &mut Run, messages: &mut Messages) {
        self.cancel_film(run);
        run.viewport.release_scale();
        if self.load.take().is_some() {
            run.viewport.clear_history(&run.player);
        }
        if self.replay.take().is_some() {
            run.player.drop_queued();
            messages.set_verdict(Some(Verdict::Failed("it was stopped on the way".to_owned())));
            run.viewport.clear_history(&run.player);
        }
    }

    /// Cancels the film; no file remains.
    pub fn cancel_film(&mut self, run: &mut Run) {
        if let Some(running) = self.film.take() {
            running.return_run(run);
        }
    }
}
