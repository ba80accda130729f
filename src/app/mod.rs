//! The application: one [`App`] shared by the desktop window, the browser and headless frames.
//!
//! `logic` advances the state (keys, stepping, recording), `ui` displays it.

mod accuracy;
mod announce;
#[cfg(not(target_arch = "wasm32"))]
mod audience;
#[cfg(not(target_arch = "wasm32"))]
mod background;
mod bench;
mod beside;
mod canvas;
#[cfg(not(target_arch = "wasm32"))]
mod chooser;
mod click;
mod compare;
mod controls;
mod curve;
#[cfg(not(target_arch = "wasm32"))]
mod desktop;
mod dialogs;
mod embed;
mod equations;
mod files;
mod film;
mod ghosts;
mod header;
#[cfg(not(target_arch = "wasm32"))]
mod headless;
mod host;
mod icons;
mod impact_list;
mod keys;
mod labels;
mod layout;
mod lesson;
mod microscope;
mod opening;
mod overlay;
mod pace;
mod picture;
mod plots;
mod present;
mod pull;
mod reload;
#[cfg(not(target_arch = "wasm32"))]
mod remembered;
#[cfg(not(target_arch = "wasm32"))]
mod saved;
mod scene_pictures;
mod sound;
#[cfg(all(feature = "sound", not(target_arch = "wasm32")))]
mod speaker;
mod spoken;
mod stack;
mod theme;
mod timeline;
mod transport;
mod undo;
mod viewport;
#[cfg(not(target_arch = "wasm32"))]
mod window;
mod zoom;

use std::sync::Arc;

use eframe::egui::{self, ThemePreference, Ui};
use eframe::egui_wgpu;

use crate::analysis::ready_sweeps::{READY_SWEEPS, ReadySweep};
use crate::analysis::source::SceneSource;
use crate::machine::Vec3;
use crate::render;
use crate::scene::{DEFAULT_SCENE, Scene};
use crate::session::pace::{LONGEST_FRAME, LONGEST_STEPPING};
use crate::session::{link, load, log, paths, player, twin, value, watch};
use crate::simulate::{Simulation, StartError};
use crate::view::{Preset, Quality, ViewOptions};

pub use crate::session::embedded::Embedded;
pub use crate::session::link::settings::PlotWindow;
pub use crate::session::link::{
    CameraPose, Link, LinkError, MAX_LINK_LENGTH, NOT_A_PAGE_ADDRESS, SceneText, is_page_address,
};
pub use crate::session::replay::{Replay, Verdict};
use announce::Announcer;
use bench::Bench;
pub use click::{Click, MAX_CLICKS, PITCHES, TimeWindow, Voice, clicks};
pub use compare::{Comparison, EarlierRun};
use controls::Controls;
#[cfg(not(target_arch = "wasm32"))]
pub use desktop::DesktopHost;
use dialogs::{Answer, Dialog};
pub use film::FilmSettings;
#[cfg(not(target_arch = "wasm32"))]
pub use headless::Headless;
pub use host::{BackgroundTask, Clock, DroppedFile, Host, NoHost, OpenedFile, SaveFile};
use keys::Action;
use layout::Sheet;
pub use lesson::{BUILT_IN_LESSONS, Lesson, RunningLesson, lesson_titles};
use load::Load;
pub use log::{Entry, Event, Log};
pub use microscope::{Circle, Microscope};
pub use overlay::{Overlay, force_notes, plates};
use picture::Picture;
pub use player::Player;
pub use plots::Plots;
use reload::SceneFile;
#[cfg(not(target_arch = "wasm32"))]
pub use remembered::{Store, StoredSettings};
use scene_pictures::ScenePictures;
use sound::Sound;
use timeline::Timeline;
use viewport::Viewport;
#[cfg(not(target_arch = "wasm32"))]
pub use window::{WindowError, run_native};

/// Time budget per frame for replaying to the state of a link, s; keeps the window responsive twenty times a second.
const REPLAY_BUDGET: f64 = 0.03;

/// Returns a predicate: whether a frame that starts now may still step.
fn replay_budget(clock: Clock) -> impl Fn() -> bool {
    let start = clock();
    move || clock() - start < REPLAY_BUDGET
}

/// Display time of a verdict that needs no action, s.
const VERDICT_TIME: f64 = 6.0;

/// Polling period of background computations for progress.
const POLL_PERIOD: std::time::Duration = std::time::Duration::from_millis(100);

/// Start options of the application.
#[derive(Clone, Debug)]
pub struct AppOptions {
    /// The scene to show.
    pub scene: Scene,
    /// Theme: light, dark or system.
    pub theme: ThemePreference,
    /// Whether the run plays from the start.
    pub playing: bool,
    /// Simulated seconds per second.
    pub time_scale: f64,
    /// View options.
    pub view: ViewOptions,
    /// The link that `scene` comes from; its state is reproduced.
    pub link: Option<Link>,
    /// The lesson of the scene, and its step, counted from 0.
    pub lesson: Option<(Arc<Lesson>, usize)>,
    /// Panels of an embedded window; `None` for a stand-alone window.
    pub embedded: Option<Embedded>,
    /// A message to show at once, e.g. why a link could not be opened.
    pub problem: Option<String>,
    /// Reduced motion: starts paused and without flashes, whatever the other options.
    pub calm: bool,
    /// High contrast: texts and edges in black and white.
    pub contrast: bool,
    /// Clock that measures the stepping time of a frame.
    pub clock: Clock,
}

impl AppOptions {
    /// Plays `scene` at its own time scale, with the play magnified enough to be visible.
    pub fn new(scene: Scene) -> Self {
        Self {
            time_scale: opening::time_scale(&scene),
            scene,
            theme: ThemePreference::System,
            playing: true,
            view: ViewOptions { magnification: 20.0, ..ViewOptions::default() },
            link: None,
            lesson: None,
            embedded: None,
            problem: None,
            calm: false,
            contrast: false,
            clock: host::wall,
        }
    }

    /// The first-time scene: the default scene, driven so fast that its joints rattle at every turn. The window states the
    /// change, and how to revert to the scene file.
    pub fn first() -> Self {
        Self { time_scale: opening::RATTLING_SCALE, ..Self::new(opening::rattling()) }
    }

    /// Starts `lesson` at step `step`, counted from 0.
    pub fn for_lesson(lesson: Arc<Lesson>, step: usize) -> Self {
        Self { playing: false, lesson: Some((lesson.clone(), step)), ..Self::new(lesson.runs[0].scene.clone()) }
    }

    /// Reads a link: a URL, a query (`?…`), a fragment (`#…`) or bare pairs. A link without settings for a run gives the same as
    /// [`Self::first`].
    ///
    /// # Errors
    /// The link cannot be read, or its scene is invalid or fails to start; as a message.
    pub fn from_link(text: &str) -> Result<Self, String> {
        let link = Link::parse(text).map_err(|error| error.to_string())?;
        let lesson = link.lesson.as_deref().map(Lesson::built_in).transpose();
        let lesson = lesson.map_err(|error| format!("link: {error}"))?;
        let lesson = lesson.map(|lesson| (lesson, link.step.unwrap_or(1) - 1));
        if let Some((lesson, step)) = lesson.as_ref().filter(|(lesson, step)| *step >= lesson.steps.len()) {
            return Err(format!("link: step = {}: allowed 1 to {}", step + 1, lesson.steps.len()));
        }
        if let Some((lesson, step)) = &lesson
            && !link.has_instant()
            && link.log.base.is_empty()
        {
            return Ok(Self {
                theme: link.theme.map_or(ThemePreference::System, theme::preference),
                embedded: link.embedded.clone(),
                ..Self::for_lesson(lesson.clone(), *step)
            });
        }
        if link.requests_nothing(text) {
            let theme = link.theme.map_or(ThemePreference::System, theme::preference);
            return Ok(Self { theme, embedded: link.embedded, ..Self::first() });
        }
        let scene = link.load().map_err(|error| format!("link: {error}"))?;
        Simulation::new(&scene.machine).map_err(|error| format!("link: {}", scene.locate(&error)))?;
        link.followed_part(&scene).map_err(|error| error.to_string())?;
        link.microscope_joint(&scene).map_err(|error| error.to_string())?;
        let mut options = Self::new(scene);
        options.lesson = lesson;
        options.embedded.clone_from(&link.embedded);
        options.playing = link.playing.unwrap_or(!link.has_instant());
        if let Some(scale) = link.time_scale {
            options.time_scale = scale;
        }
        if let Some(magnification) = link.magnification {
            options.view.magnification = magnification;
        }
        if let Some(theme) = link.theme {
            options.theme = theme::preference(theme);
        }
        options.link = Some(link);
        Ok(options)
    }

    /// As [`Self::from_link`], but a bad link gives the default scene, paused, in the panels requested by the link, with the
    /// reason as [`Self::problem`].
    pub fn from_link_or_default(text: &str) -> Self {
        Self::from_link(text).unwrap_or_else(|problem| {
            let scene = Scene::load(DEFAULT_SCENE, &[]).expect("built-in scenes are right");
            let embedded = link::requested_panels(text);
            Self { problem: Some(problem), playing: false, embedded, ..Self::new(scene) }
        })
    }
}

/// A message about the last action, shown for a few seconds.
struct Notice {
    text: String,
    /// Time of its first display, s of viewing.
    since: Option<f64>,
}

impl Notice {
    fn new(text: impl Into<String>) -> Self {
        let (text, since) = (text.into(), None);
        Self { text, since }
    }

    /// Longer messages take longer to read.
    fn remaining_time(&mut self, now: f64) -> f64 {
        let length = 3.0 + 0.05 * self.text.len() as f64;
        *self.since.get_or_insert(now) + length - now
    }
}

/// The application.
pub struct App {
    player: Player,
    controls: Controls,
    viewport: Viewport,
    /// Picture of a run from before a change, and that run's number.
    beside: Option<(u64, Box<Viewport>)>,
    plots: Plots,
    timeline: Timeline,
    bench: Bench,
    dialog: Option<Dialog>,
    /// Error of the last attempt to open or reset.
    problem: Option<String>,
    /// Whether `problem` is the failure to open the initial link.
    refused: bool,
    show_controls: bool,
    show_plots: bool,
    show_bench: bool,
    /// Content of the sheet in a small window.
    sheet: Option<Sheet>,
    compact: bool,
    /// Whether touch input has ever occurred.
    touched: bool,
    /// Whether the controls are sized for touch; `None` before the first pass.
    fingers: Option<bool>,
    host: Box<dyn Host>,
    /// Page address typed by the user, which replaces the host's; "" for none.
    page: String,
    /// Empty for a scene from a link: a link must not make the program read a file.
    scene_file: SceneFile,
    replay: Option<Replay>,
    /// A run in progress to a section of a sweep, and whether a twin starts there.
    load: Option<(Load, bool)>,
    verdict: Option<Verdict>,
    /// Time of the verdict's first display, s of viewing, if it needs no action; minus infinity once it has expired.
    verdict_shown: Option<f64>,
    notice: Option<Notice>,
    /// Whether the user has dismissed the notice of the initial changes.
    changes_seen: bool,
    announcer: Announcer,
    microscope: Microscope,
    impact_list: impact_list::ImpactList,
    undo: undo::Undo,
    picture: Picture,
    scene_pictures: ScenePictures,
    /// The film in progress.
    film: Option<film::RunningFilm>,
    /// Settings of the last film.
    film_settings: Option<film::FilmSettings>,
    presentation: Option<present::Presentation>,
    /// The user's zoom while another is shown: in a presentation and in a tiny window, until it is in effect again.
    set_aside_zoom: Option<f32>,
    /// Index of the single plot shown in a presentation and in the audience window.
    single_plot: Option<usize>,
    /// The audience window.
    #[cfg(not(target_arch = "wasm32"))]
    audience: Option<audience::Audience>,
    /// Settings for the next start; `None` disables storing them.
    #[cfg(not(target_arch = "wasm32"))]
    store: Option<Store>,
    /// Files waiting for a path from the host.
    #[cfg(not(target_arch = "wasm32"))]
    saving: Vec<SaveFile>,
    embedded: Option<Embedded>,
    sound: Sound,
    /// The lesson in progress.
    running_lesson: Option<Box<RunningLesson>>,
    /// Snapshot of the window before the lesson.
    before_lesson: Option<Box<lesson::PreviousWindow>>,
    /// Area of the 3D view, points.
    picture_rect: egui::Rect,
    /// Whether texts and edges are black and white.
    contrast: bool,
    /// Graphics adapter and backend; "" without a window.
    renderer: String,
    /// Graphics of the window, for drawing pictures off screen.
    graphics: Option<egui_wgpu::RenderState>,
}

impl App {
    /// Creates the application for a window, with its theme and renderer.
    ///
    /// # Errors
    /// The scene fails to start.
    pub fn new(cc: &eframe::CreationContext<'_>, options: AppOptions) -> Result<Self, StartError> {
        Self::with_context(&cc.egui_ctx, cc.wgpu_render_state.as_ref(), options)
    }

    /// The same without a window.
    ///
    /// # Errors
    /// The scene fails to start.
    pub fn with_context(
        ctx: &egui::Context,
        state: Option<&egui_wgpu::RenderState>,
        mut options: AppOptions,
    ) -> Result<Self, StartError> {
        if options.calm {
            (options.playing, options.view.flash) = (false, false);
            if let Some(link) = &mut options.link {
                link.playing = Some(false);
            }
        }
        let mut player = Player::new(&options.scene)?;
        player.clock = options.clock;
        player.pacer.set_scale(options.time_scale);
        player.set_playing(options.playing);
        let mut app = Self {
            viewport: Viewport::new(&player, options.view),
            controls: Controls::default(),
            beside: None,
            plots: Plots::of(&options.scene),
            timeline: Timeline::default(),
            bench: Bench::default(),
            dialog: None,
            refused: options.problem.is_some(),
            problem: options.problem,
            show_controls: true,
            show_plots: true,
            show_bench: false,
            sheet: Some(Sheet::Controls),
            compact: false,
            touched: false,
            fingers: None,
            host: Box::new(NoHost),
            page: String::new(),
            scene_file: SceneFile::named(options.scene.source.file.clone().filter(|_| options.link.is_none())),
            replay: None,
            load: None,
            verdict: None,
            verdict_shown: None,
            notice: None,
            changes_seen: false,
            announcer: Announcer::default(),
            microscope: Microscope::default(),
            impact_list: impact_list::ImpactList::default(),
            undo: undo::Undo::default(),
            picture: Picture::default(),
            scene_pictures: ScenePictures::default(),
            film: None,
            film_settings: None,
            presentation: None,
            set_aside_zoom: None,
            single_plot: None,
            #[cfg(not(target_arch = "wasm32"))]
            audience: None,
            #[cfg(not(target_arch = "wasm32"))]
            store: None,
            #[cfg(not(target_arch = "wasm32"))]
            saving: Vec::new(),
            embedded: options.embedded,
            sound: Sound::default(),
            running_lesson: None,
            before_lesson: None,
            picture_rect: egui::Rect::ZERO,
            contrast: options.contrast,
            renderer: String::new(),
            graphics: None,
            player,
        };
        let starts_step = options.link.is_none();
        if let Some(link) = options.link {
            app.show_link(link);
        }
        if let Some((lesson, step)) = options.lesson {
            app.resume_lesson(lesson, step, starts_step);
        }
        app.attach(ctx, state, options.theme);
        Ok(app)
    }

    /// Applies camera, followed part, plots and instruments of `link`, and goes to its instant; other settings stay.
    fn show_link(&mut self, link: Link) {
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
        if let Some(shown) = &link.instruments {
            let joint = link.microscope_joint(scene).ok().flatten();
            self.microscope.set_open(joint.is_some());
            if let Some(joint) = joint {
                self.microscope.focus(joint);
            }
            self.viewport.options.wear = shown.wear;
            self.show_ideal(shown.ideal);
        }
        // Channels are recorded from now on, not from the first frame on.
        self.player.pick(&self.plots.picked);
        self.replay = Replay::new(link, &mut self.player);
        if self.replay.is_some() {
            self.player.set_playing(false);
        }
    }

    /// Continues in another window, or with new graphics after a device loss; the state is unchanged.
    pub fn attach(&mut self, ctx: &egui::Context, state: Option<&egui_wgpu::RenderState>, theme: ThemePreference) {
        theme::apply(ctx, self.contrast);
        ctx.set_theme(theme);
        self.renderer = String::new();
        if let Some(state) = state {
            render::install(state);
            let info = state.adapter.get_info();
            self.renderer = format!("{} {}", info.backend, info.name).trim().to_owned();
        }
        self.fingers = None;
        self.graphics = state.cloned();
        // A picture in progress is lost.
        self.picture.forget();
        self.scene_pictures = ScenePictures::default();
        self.cancel_film();
    }

    /// The player.
    pub fn player(&self) -> &Player {
        &self.player
    }

    /// Whether the initial link could not be opened and nothing was done since; the window then shows another scene behind the
    /// error message.
    pub fn is_refused(&self) -> bool {
        self.refused && self.problem.is_some() && !self.player.is_playing()
    }

    /// Whether a browser key event called `name` has an action here, alone or with the command key.
    pub fn uses(&self, ctx: &egui::Context, name: &str, command: bool) -> bool {
        if ctx.memory(egui::Memory::focused).is_some() {
            return true;
        }
        let key = egui::Key::from_name(if name == " " { "Space" } else { name });
        match key.and_then(keys::action).filter(|_| !command) {
            None => command,
            Some(Action::TurnPage { .. }) => self.running_lesson.is_some(),
            Some(Action::Close) => self.dialog.is_some() || self.problem.is_some() || self.is_under_way(),
            Some(_) => true,
        }
    }

    /// The player, mutable.
    pub fn player_mut(&mut self) -> &mut Player {
        &mut self.player
    }

    /// Lets slow frames reduce the quality of the moving picture: for a window or page, where pictures need not be reproducible.
    pub fn follow_frame_rate(&mut self) {
        self.viewport.follow_frame_rate(true);
    }

    /// Quality of the latest picture.
    pub fn picture_quality(&self) -> Quality {
        self.viewport.quality()
    }

    /// Camera pose, or its target while the camera moves; `None` before the first picture.
    pub fn camera_pose(&self) -> Option<CameraPose> {
        self.viewport.pose()
    }

    /// Window position, points, of a point of the scene, m; `None` behind the camera.
    pub fn place_in_view(&self, point: &Vec3) -> Option<egui::Pos2> {
        self.viewport.place(point, self.picture_rect)
    }

    /// The plots and their settings, mutable.
    pub fn plots_mut(&mut self) -> &mut Plots {
        &mut self.plots
    }

    /// Whether what play costs is shown.
    pub fn shows_costs(&self) -> bool {
        self.bench.shows_costs()
    }

    /// Shows or closes what play costs.
    pub fn show_costs(&mut self, open: bool) {
        self.bench.show_costs(open);
        if self.compact {
            self.sheet = open.then_some(Sheet::Bench);
        } else {
            self.show_bench = open;
        }
    }

    /// The chaos bench.
    pub fn bench(&self) -> &Bench {
        &self.bench
    }

    /// Whether the run is being replayed to the state of a link or to a section of a sweep, or filmed; it takes no commands
    /// meanwhile.
    fn is_under_way(&self) -> bool {
        self.replay.is_some() || self.load.is_some() || self.film.is_some()
    }

    /// Progress of the run to a section of a sweep, 0 to 1; `None` if there is none.
    pub fn loading(&self) -> Option<f32> {
        let (load, _) = self.load.as_ref()?;
        Some(load.fraction(&self.player))
    }

    /// Handles a request of the bench.
    fn apply_bench_request(&mut self, request: bench::BenchRequest) {
        match request {
            bench::BenchRequest::Section(load) => self.start_load(load),
            bench::BenchRequest::Value { key, text } => match self.player.set(&key, &text) {
                Err(error) => self.problem = Some(error.to_string()),
                Ok(_) => {
                    self.controls.reveal(&key);
                    if self.compact {
                        self.bench.set_aside();
                        self.sheet = Some(Sheet::Controls);
                    } else {
                        self.show_controls = true;
                    }
                }
            },
            bench::BenchRequest::Ready(sweep) => match sweep.scene() {
                Err(error) => self.problem = Some(error.to_string()),
                Ok(scene) => {
                    let lost_changes = value::changes(self.player.pending());
                    // Changes made by another ready sweep are no loss.
                    let ready_scenes = READY_SWEEPS.iter().filter_map(|ready| ready.scene().ok());
                    let mut known_scenes = ready_scenes.chain([scene]);
                    let same =
                        known_scenes.any(|scene| value::differences(&scene, self.player.pending(), &[]).is_empty());
                    if same || lost_changes.is_empty() {
                        self.start_ready_sweep(sweep);
                    } else {
                        self.dialog = Some(Dialog::Ready { sweep, lost: lost_changes });
                    }
                }
            },
        }
    }

    /// Opens the scene of a ready sweep and starts the sweep.
    fn start_ready_sweep(&mut self, sweep: &'static ReadySweep) {
        let scene = sweep.scene().map_err(|error| error.to_string());
        self.problem = scene.and_then(|scene| self.show_scene(&scene)).err();
        if self.problem.is_none() {
            self.bench.start(sweep, self.player.pending());
        }
    }

    /// Runs to a section of a sweep; asks first if more than the varied parameter would change.
    fn start_load(&mut self, load: Load) {
        match load.scene.scene() {
            Err(error) => self.problem = Some(error.to_string()),
            Ok(scene) => {
                let changes = value::differences(&scene, self.player.pending(), load.varied());
                if changes.is_empty() {
                    self.go_to_section(load);
                } else {
                    let load = Box::new(load);
                    self.dialog = Some(Dialog::Load { load, changes });
                }
            }
        }
    }

    /// Restarts the scene of a sweep and runs to a section.
    fn go_to_section(&mut self, load: Load) {
        let phase = self.player.watch().phase();
        let twin = self.player.twin().is_some();
        let pose = self.viewport.pose();
        let (target, current) = (&load.scene, SceneSource::of(self.player.pending()));
        let same = (&target.text, &target.beside) == (&current.text, &current.beside);
        let file = self.scene_file.name().map(str::to_owned).filter(|_| same);
        let scene = load.scene.scene().map_err(|error| error.to_string());
        self.problem = scene.and_then(|scene| self.show_scene(&scene)).err();
        if self.problem.is_none() {
            self.player.set_playing(false);
            self.player.set_phase(phase);
            if let Some(pose) = pose.filter(|_| same) {
                self.viewport.set_pose(pose);
            }
            self.scene_file = SceneFile::named(file);
            self.load = Some((load, twin));
        }
    }

    /// Opens a built-in scene or a file; on an error the running scene stays, and the reason is shown.
    pub fn open(&mut self, argument: &str) -> Result<(), String> {
        let scene = Scene::load(argument, &[]).map_err(|error| error.to_string())?;
        self.show_scene(&scene)?;
        self.scene_file = SceneFile::named(scene.source.file.clone());
        Ok(())
    }

    /// Opens a link in any form, a built-in scene or a file; on an error the running scene stays.
    ///
    /// # Errors
    /// As [`Self::open_link`] and [`Self::open`], as a message.
    pub fn open_any(&mut self, ctx: &egui::Context, text: &str) -> Result<(), String> {
        if link::is_link(text) { self.open_link(ctx, text) } else { self.open(text.trim()) }
    }

    /// Resets to t = 0 with all changes applied.
    pub fn reset(&mut self) {
        match self.player.reset() {
            Ok(()) => {
                self.problem = None;
                self.timeline.reset();
                self.plots.reset();
                self.plots.comparison.reset();
                self.beside = None;
                self.viewport.restart(&self.player);
            }
            Err(error) => self.problem = Some(self.player.pending().locate(&error).to_string()),
        }
    }

    /// Description of the mechanism's state in sentences; updated about once a second and after an event.
    pub fn announcement(&self) -> &str {
        self.announcer.text()
    }

    /// The verdict on the initial link.
    pub fn verdict(&self) -> Option<&Verdict> {
        self.verdict.as_ref()
    }

    /// Progress of the replay to the state of a link, 0 to 1; `None` if there is none.
    pub fn replaying(&self) -> Option<f32> {
        let replay = self.replay.as_ref()?;
        Some(replay.fraction(&self.player))
    }

    /// Stops a replay or a run to a section at the present instant; cancels a film.
    fn cancel_replay(&mut self) {
        self.cancel_film();
        if self.load.take().is_some() {
            self.viewport.clear_history(&self.player);
        }
        if self.replay.take().is_some() {
            self.player.drop_queued();
            let reason = "it was stopped on the way".to_owned();
            self.verdict = Some(Verdict::Failed(reason));
            self.viewport.clear_history(&self.player);
        }
    }

    /// Opens a link in place of the running scene; on an error that scene stays, and the reason is shown and returned.
    ///
    /// # Errors
    /// As [`AppOptions::from_link`].
    pub fn open_link(&mut self, ctx: &egui::Context, text: &str) -> Result<(), String> {
        let opened = AppOptions::from_link(text).and_then(|options| {
            if options.lesson.is_some() {
                self.remember_window();
            }
            self.show_scene(&options.scene)?;
            let starts_step = options.link.is_none();
            self.player.pacer.set_scale(options.time_scale);
            self.player.set_playing(options.playing);
            // A stand-alone window remains one.
            if let (Some(panels), Some(wanted)) = (&mut self.embedded, options.embedded) {
                *panels = wanted;
            }
            self.viewport.options.magnification = options.view.magnification;
            if let Some(link) = options.link {
                if let Some(theme) = link.theme {
                    ctx.set_theme(theme::preference(theme));
                }
                self.show_link(link);
            }
            if let Some((lesson, step)) = options.lesson {
                self.resume_lesson(lesson, step, starts_step);
            }
            Ok(())
        });
        self.problem = opened.clone().err();
        opened
    }

    /// Pauses and shows `time`, s: any previously displayed instant.
    pub fn show_instant(&mut self, time: f64) {
        self.player.go_to(time);
        self.viewport.restore_marks(&self.player);
    }

    /// Ball joint, force in N and age in s of every marked peak.
    pub fn peak_marks(&self) -> Vec<(usize, f32, f64)> {
        self.viewport.peak_marks(&self.player)
    }

    /// Pauses and runs to `time`, s, without a time limit. Impacts on the way are recorded but do not glow.
    pub fn run_to(&mut self, time: f64) {
        self.player.run_to(time);
        self.player.advance(0.0);
        self.viewport.clear_history(&self.player);
    }

    /// Advances the state by `dt` seconds; returns whether it is still changing.
    pub fn advance(&mut self, dt: f64) -> bool {
        self.player.pick(&self.plots.picked);
        if let Some(replay) = &self.replay {
            let may_step = replay_budget(self.player.clock);
            self.verdict = replay.advance(&mut self.player, may_step);
            if self.verdict.is_some() {
                self.verdict_shown = None;
                self.replay = None;
                self.viewport.clear_history(&self.player);
            }
            return true;
        }
        if let Some((load, twin)) = &mut self.load {
            let may_step = replay_budget(self.player.clock);
            if let Some(arrival) = load.advance(&mut self.player, may_step) {
                match arrival {
                    Ok(()) => {
                        self.player.set_twin(*twin);
                        self.player.set_playing(true);
                    }
                    Err(why) => self.problem = Some(why),
                }
                self.load = None;
                self.viewport.clear_history(&self.player);
            }
            return true;
        }
        if self.film.is_some() {
            return true;
        }
        self.player.plotted = self.plots.length(&self.player);
        let was_seeking = self.player.is_seeking();
        // Two machines side by side show the same instant: the current one waits for the other.
        let waits = self.plots.comparison.is_behind(&self.player);
        self.advance_with_sound(if waits { 0.0 } else { dt });
        if was_seeking && !self.player.is_seeking() {
            self.viewport.restore_marks(&self.player);
        }
        self.announcer.observe(&self.player);
        let moves = self.viewport.advance(&self.player, dt as f32);
        let moves = self.advance_earlier_runs(dt as f32) || moves;
        moves || was_seeking || self.player.is_seeking() || self.player.is_playing() || self.player.is_ideal_behind()
    }

    /// Steps the runs between two frames, as [`Player::step_between`].
    pub fn step_between(&mut self, since: f64) -> Option<bool> {
        if self.is_under_way() || since > LONGEST_FRAME {
            return None;
        }
        let comparison = &mut self.plots.comparison;
        let waits = comparison.is_behind(&self.player);
        let behind = if waits { None } else { self.player.step_between(since) };
        let lags = comparison.follow(&self.player, LONGEST_STEPPING);
        behind.or(lags.then_some(true)).map(|behind| behind || lags)
    }

    fn show_scene(&mut self, scene: &Scene) -> Result<(), String> {
        let mut player = Player::new(scene).map_err(|error| scene.locate(&error).to_string())?;
        // Cancelled first, because a film uses another time scale.
        self.cancel_film();
        player.clock = self.player.clock;
        let is_other_scene = scene.source.text != self.player.pending().source.text;
        let scale = if is_other_scene { opening::time_scale(scene) } else { self.player.pacer.scale() };
        player.pacer.set_scale(scale);
        player.set_playing(self.player.is_playing() || self.player.stopped().is_some());
        player.set_ideal(self.player.ideal().is_some());
        let before = std::mem::replace(&mut self.player, player);
        let file = std::mem::take(&mut self.scene_file);
        self.remember_run(before, file);
        self.viewport.show_scene(&self.player);
        self.timeline.reset();
        self.plots.reset();
        self.plots.comparison.clear();
        if is_other_scene {
            self.plots.restore_initial(scene);
        }
        self.controls.clear();
        self.undo.clear();
        (self.problem, self.refused) = (None, false);
        self.replay = None;
        self.load = None;
        self.film_settings = None;
        (self.verdict, self.verdict_shown) = (None, None);
        Ok(())
    }

    fn perform_action(&mut self, ctx: &egui::Context, action: Action) {
        // An open dialog blocks the machine's controls.
        if self.dialog.is_some() && !matches!(action, Action::Help | Action::Close) {
            return;
        }
        let moves = matches!(
            action,
            Action::PlayPause
                | Action::Step
                | Action::StepBack
                | Action::Backwards
                | Action::Impact { .. }
                | Action::Home
                | Action::End
                | Action::Reset
        );
        if self.is_under_way() && moves {
            return;
        }
        let player = &mut self.player;
        match action {
            Action::PlayPause => player.set_playing(!player.is_playing()),
            Action::Step => player.single_step(),
            Action::StepBack => {
                player.step_back();
                self.viewport.restore_marks(&self.player);
            }
            Action::Backwards if player.is_playing_backwards() => player.set_playing(false),
            Action::Backwards => player.play_backwards(),
            Action::Impact { forward } => {
                player.go_to_impact(self.viewport.focus(), forward);
                self.viewport.restore_marks(&self.player);
            }
            Action::Home | Action::End => {
                let end = player.reached();
                self.show_instant(if action == Action::End { end } else { 0.0 });
            }
            Action::Reset => self.reset(),
            Action::Slower | Action::Faster => {
                let scale = transport::next_scale(player.pacer.scale(), action == Action::Faster);
                player.pacer.set_scale(scale);
            }
            Action::Fit => self.viewport.fit(),
            Action::Preset(index) => {
                if let Some(preset) = Preset::ALL.get(index) {
                    self.viewport.preset(*preset);
                }
            }
            Action::CloseUp(joint) => {
                if joint < self.player.running().machine.loose_joints.len() {
                    self.microscope.focus(joint);
                    self.viewport.show_close_up(&self.player, joint);
                }
            }
            Action::IdealGhost => self.show_ideal(self.player.ideal().is_none()),
            Action::Microscope => {
                let open = !self.microscope.is_open();
                self.microscope.set_open(open);
            }
            Action::ImpactList => self.show_impact_list(!self.has_impact_list()),
            Action::Magnify => self.viewport.next_magnification(),
            Action::Sound => self.set_sound(!self.is_sounding()),
            Action::Arrows => {
                let arrows = &mut self.viewport.options.arrows;
                let on = !(arrows.normal || arrows.friction);
                (arrows.normal, arrows.friction) = (on, on);
            }
            Action::TurnPage { forward } => self.change_step(forward),
            Action::Present => self.present(ctx, !self.is_presenting()),
            Action::Costs => self.show_costs(!self.shows_costs()),
            Action::Bench if self.compact => self.fold(Sheet::Bench),
            Action::Bench => self.show_bench = !self.show_bench,
            Action::Plots if self.is_presenting() => self.show_next_plot(),
            Action::Panel if self.compact => self.fold(Sheet::Controls),
            Action::Plots if self.compact => self.fold(Sheet::Plots),
            Action::Panel => self.show_controls = !self.show_controls,
            Action::Plots => self.show_plots = !self.show_plots,
            Action::Theme => ctx.set_theme(match ctx.theme() {
                egui::Theme::Dark => ThemePreference::Light,
                egui::Theme::Light => ThemePreference::Dark,
            }),
            Action::Help => {
                self.dialog = if self.dialog == Some(Dialog::Help) { None } else { Some(Dialog::Help) };
            }
            Action::Close => self.close_innermost(ctx),
        }
    }

    /// Closes the innermost element: menu, dialog, operation in progress, message, presentation or microscope.
    fn close_innermost(&mut self, ctx: &egui::Context) {
        // A menu and a list close themselves.
        if egui::Popup::is_any_open(ctx) || self.dialog.take().is_some() {
            return;
        }
        if self.is_under_way() {
            self.cancel_replay();
        } else if self.problem.take().is_some() {
            // Only the message closes.
        } else if self.is_presenting() {
            self.present(ctx, false);
        } else {
            self.microscope.set_open(false);
        }
    }

    /// Expires a verdict that needs no action after some seconds.
    fn expire_verdict(&mut self, ctx: &egui::Context) {
        if !self.verdict.as_ref().is_some_and(files::needs_no_action) {
            return;
        }
        let now = ctx.input(|input| input.time);
        let left = *self.verdict_shown.get_or_insert(now) + VERDICT_TIME - now;
        if left <= 0.0 {
            self.verdict_shown = Some(f64::NEG_INFINITY);
        } else {
            ctx.request_repaint_after(std::time::Duration::from_secs_f64(left));
        }
    }

    /// Makes an announcement if one is due.
    fn announce(&mut self, ctx: &egui::Context) {
        let now = ctx.input(|input| input.time);
        let (announced, wait) = self.announcer.update(now, &self.player, &self.current_message());
        if announced {
            let event = self.announcer.is_event();
            self.host.announce(self.announcer.text(), event);
            ctx.request_repaint();
        }
        if let Some(wait) = wait {
            ctx.request_repaint_after(std::time::Duration::from_secs_f64(wait));
        }
    }

    /// The report for screen readers: in the accessibility tree, announced politely on changes.
    fn summary(&self, ui: &mut Ui) {
        let place = egui::Rect::from_min_size(ui.max_rect().min, egui::Vec2::ZERO);
        let id = egui::Id::unique("summary");
        let response = ui.interact(place, id, egui::Sense::hover());
        let words = self.announcer.text();
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Status, true, words));
        ui.ctx().accesskit_node_builder(id, |node| {
            node.set_live(egui::accesskit::Live::Polite);
        });
    }

    fn dialog_ui(&mut self, ctx: &egui::Context) {
        let Some(mut dialog) = self.dialog.take() else {
            return;
        };
        match dialogs::ui(ctx, &mut dialog, &self.player, &self.renderer) {
            Some(Answer::Close) => {}
            Some(Answer::Save(path)) => {
                if let Dialog::Save { files, .. } = dialog {
                    self.save_as(path, files);
                }
            }
            Some(Answer::Copy) => {
                if let Dialog::Link(shared) = dialog {
                    self.copy(ctx, shared.link());
                    if shared.is_editable() {
                        self.page = shared.page().to_owned();
                    }
                }
            }
            Some(Answer::Film) => {
                if let Dialog::Film { settings } = dialog {
                    self.problem = self.make_film(settings).err();
                }
            }
            Some(Answer::Sweep) => {
                if let Dialog::Ready { sweep, .. } = dialog {
                    self.start_ready_sweep(sweep);
                }
            }
            #[cfg(not(target_arch = "wasm32"))]
            Some(Answer::StartAsNew) => self.reset_to_first_start(ctx),
            Some(Answer::Load) => {
                if let Dialog::Load { load, .. } = dialog {
                    self.go_to_section(*load);
                }
            }
            Some(Answer::Open(argument)) => {
                if let Err(reason) = self.open_any(ctx, &argument) {
                    // The dialog shows the error instead.
                    self.problem = None;
                    self.dialog = Some(Dialog::Open { path: argument, error: Some(reason) });
                }
            }
            None => self.dialog = Some(dialog),
        }
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        // A hidden window shows nothing, and its time stands still.
        if ctx.input(|input| input.viewport().visible()) == Some(false) {
            return;
        }
        self.follow_changes(ctx);
        for action in keys::pressed(ctx) {
            self.perform_action(ctx, action);
        }
        #[cfg(not(target_arch = "wasm32"))]
        self.receive_path(ctx, _frame);
        self.receive_files(ctx);
        self.receive_saved_scene(ctx);
        self.receive_links(ctx);
        self.receive_picture(ctx);
        self.advance_film(ctx);
        self.follow_screen(ctx);
        self.check_sound();
        if self.bench.update(self.host.as_mut()) {
            ctx.request_repaint_after(POLL_PERIOD);
        }
        self.viewport.cloud = self.bench.take_cloud(&self.player);
        let (now, dt) = ctx.input(|input| (input.time, input.stable_dt));
        let moves = self.advance(f64::from(dt));
        if moves {
            ctx.request_repaint();
        }
        self.bench.report_frame(now, moves);
        self.advance_lesson(ctx);
        self.expire_verdict(ctx);
        self.announce(ctx);
        #[cfg(not(target_arch = "wasm32"))]
        self.remember(ctx);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
        #[cfg(not(target_arch = "wasm32"))]
        self.audience_ui(ui.ctx());
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn on_exit(&mut self) {
        if let Some(store) = &mut self.store {
            store.write();
        }
    }

    #[cfg(target_arch = "wasm32")]
    fn as_any_mut(&mut self) -> Option<&mut dyn std::any::Any> {
        Some(&mut *self)
    }
}
