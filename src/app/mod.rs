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
mod cards;
#[cfg(not(target_arch = "wasm32"))]
mod chooser;
mod click;
mod command;
mod compare;
mod controls;
mod curve;
#[cfg(not(target_arch = "wasm32"))]
mod desktop;
mod dialogs;
mod embed;
mod equations;
mod field;
mod files;
mod film;
mod focus;
mod ghosts;
mod graphics;
mod header;
#[cfg(not(target_arch = "wasm32"))]
mod headless;
mod hint;
mod host;
mod icons;
mod impact_list;
mod keys;
mod labels;
mod layout;
mod lesson;
mod messages;
mod microscope;
mod open;
mod opening;
mod options;
mod overlay;
mod pace;
mod panels;
mod picture;
mod plots;
mod present;
mod pull;
mod reload;
#[cfg(not(target_arch = "wasm32"))]
mod remembered;
mod ruler;
mod run;
#[cfg(not(target_arch = "wasm32"))]
mod saved;
mod scene_pictures;
mod sound;
#[cfg(all(feature = "sound", not(target_arch = "wasm32")))]
mod speaker;
mod spoken;
mod stack;
mod tasks;
mod theme;
mod timeline;
mod touch;
mod transport;
mod undo;
mod viewport;
mod visit;
#[cfg(not(target_arch = "wasm32"))]
mod window;
mod worn_for;
mod zoom;

use eframe::egui::{self, ThemePreference, Ui};
use eframe::egui_wgpu;

use crate::machine::Vec3;
use crate::session::pace::LONGEST_FRAME;
use crate::session::{friction, link, load, log, paths, player, twin, value, watch};
use crate::simulate::StartError;
use crate::view::Quality;

pub use crate::session::embedded::Embedded;
pub use crate::session::link::settings::PlotWindow;
pub use crate::session::link::{
    CameraPose, Link, LinkError, MAX_LINK_LENGTH, NOT_A_PAGE_ADDRESS, SceneText, is_page_address,
};
pub use crate::session::replay::{Replay, Verdict};
use bench::Bench;
pub use click::{Click, MAX_CLICKS, PITCHES, TimeWindow, Voice, clicks};
pub use compare::{Comparison, EarlierRun};
#[cfg(not(target_arch = "wasm32"))]
pub use desktop::DesktopHost;
use dialogs::Dialog;
use files::Files;
pub use film::FilmSettings;
use focus::FocusKeeper;
use graphics::Graphics;
#[cfg(not(target_arch = "wasm32"))]
pub use headless::Headless;
use hint::Hint;
pub use host::{BackgroundTask, Clock, DroppedFile, Host, NoHost, OpenedFile, SaveFile};
use keys::Action;
use lesson::Course;
pub use lesson::{BUILT_IN_LESSONS, Lesson, RunningLesson, lesson_titles};
pub use log::{Entry, Event, Log};
use messages::Messages;
pub use microscope::{Circle, CurvePoint, FrictionCurve, FrictionScale, Microscope};
pub use options::AppOptions;
pub use overlay::{Overlay, Room, Strips, force_notes, strips, triad};
use panels::{Panels, Sheet};
use picture::Picture;
pub use player::Player;
pub use plots::Plots;
use present::Presentation;
#[cfg(not(target_arch = "wasm32"))]
pub use remembered::{Store, StoredSettings};
use run::Run;
use sound::Sound;
use tasks::Tasks;
use visit::Visit;
#[cfg(not(target_arch = "wasm32"))]
pub use window::{WindowError, run_native};

/// Polling period of background computations for progress.
const POLL_PERIOD: std::time::Duration = std::time::Duration::from_millis(100);

/// The application. Each part changes for one reason; what concerns several of them is done here and in the modules of commands
/// (`command`), opening (`open`), lessons and layout.
pub struct App {
    run: Run,
    bench: Bench,
    tasks: Tasks,
    course: Course,
    messages: Messages,
    hint: Hint,
    visit: Option<Visit>,
    /// Reduced motion.
    calm: bool,
    dialog: Option<Dialog>,
    focus: FocusKeeper,
    panels: Panels,
    presentation: Presentation,
    files: Files,
    host: Box<dyn Host>,
    graphics: Graphics,
    picture: Picture,
    sound: Sound,
    /// Settings for the next start; `None` disables storing them.
    #[cfg(not(target_arch = "wasm32"))]
    store: Option<Store>,
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
        let named_file = options.scene.source.file.clone().filter(|_| options.link.is_none());
        let mut app = Self {
            run: Run::new(player, options.view),
            bench: Bench::default(),
            tasks: Tasks::default(),
            course: Course::default(),
            messages: Messages::new(options.problem),
            hint: Hint::new(options.calm),
            visit: None,
            calm: options.calm,
            dialog: None,
            focus: FocusKeeper::default(),
            panels: Panels::new(options.embedded),
            presentation: Presentation::default(),
            files: Files::of(named_file),
            host: Box::new(NoHost),
            graphics: Graphics::new(options.contrast),
            picture: Picture::default(),
            sound: Sound::default(),
            #[cfg(not(target_arch = "wasm32"))]
            store: None,
        };
        let starts_step = options.link.is_none();
        app.hint.begin(&options.scene);
        if let Some(link) = options.link {
            app.show_link(link);
        }
        if let Some((lesson, step)) = options.lesson {
            app.resume_lesson(lesson, step, starts_step);
        }
        if options.visit {
            app.begin_visit();
        }
        app.attach(ctx, state, options.theme);
        Ok(app)
    }

    /// Continues in another window, or with new graphics after a device loss; the state is unchanged.
    pub fn attach(&mut self, ctx: &egui::Context, state: Option<&egui_wgpu::RenderState>, theme: ThemePreference) {
        self.graphics.attach(ctx, state, theme);
        self.panels.forget_sizes();
        // A picture in progress is lost.
        self.picture.forget();
        self.tasks.cancel_film(&mut self.run);
    }

    /// Sets the platform services.
    pub fn set_host(&mut self, host: Box<dyn Host>) {
        self.host = host;
    }

    /// Applies the settings in `store`, and records the window's settings in it from now on.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn store_settings_in(&mut self, ctx: &egui::Context, store: Store) {
        store.apply(ctx);
        self.store = Some(store);
    }

    /// Opens or closes the audience window.
    #[cfg(not(target_arch = "wasm32"))]
    fn show_audience(&mut self, on: bool) {
        self.presentation.audience = on.then(audience::Audience::open);
    }

    /// Whether the audience window is open.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn has_audience(&self) -> bool {
        self.presentation.audience.is_some()
    }

    /// The player.
    pub fn player(&self) -> &Player {
        &self.run.player
    }

    /// The player, mutable.
    pub fn player_mut(&mut self) -> &mut Player {
        &mut self.run.player
    }

    /// The plots and their settings, mutable.
    pub fn plots_mut(&mut self) -> &mut Plots {
        &mut self.run.plots
    }

    /// The runs from before a change.
    pub fn comparison(&self) -> &Comparison {
        &self.run.plots.comparison
    }

    /// The microscope.
    pub fn microscope(&self) -> &Microscope {
        &self.run.microscope
    }

    /// The microscope, mutable.
    pub fn microscope_mut(&mut self) -> &mut Microscope {
        &mut self.run.microscope
    }

    /// Whether the list of impacts is shown.
    pub fn has_impact_list(&self) -> bool {
        self.run.impact_list.is_open()
    }

    /// One line about the impact at the displayed instant, e.g. after `>>` or `<<`. `None` during playback.
    pub fn impact_badge(&self) -> Option<String> {
        self.run.impact_badge(self.tasks.filming().is_some())
    }

    /// The last finished impact: joint, largest normal force, duration.
    pub fn last_impact(&self) -> Option<String> {
        self.run.last_impact()
    }

    /// Description of the next undo (`redo`: redo); `None` if there is none.
    pub fn undo_words(&self, redo: bool) -> Option<String> {
        self.run.undo.words(redo)
    }

    /// The chaos bench.
    pub fn bench(&self) -> &Bench {
        &self.bench
    }

    /// The lesson in progress.
    pub fn course(&self) -> Option<&RunningLesson> {
        self.course.running()
    }

    /// Whether all highlighted items of the lesson's step are visible.
    pub fn shows_highlights(&self, ctx: &egui::Context) -> bool {
        self.course.shows_highlights(ctx, &self.run.player)
    }

    /// Panels of an embedded window; `None` for a stand-alone window.
    pub fn embedded(&self) -> Option<&Embedded> {
        self.panels.embedded.as_ref()
    }

    /// Whether the initial link could not be opened and nothing was done since; the window then shows another scene behind the
    /// error message.
    pub fn is_refused(&self) -> bool {
        self.messages.is_refused(&self.run.player)
    }

    /// The verdict on the initial link.
    pub fn verdict(&self) -> Option<&Verdict> {
        self.messages.verdict()
    }

    /// Description of the mechanism's state in sentences; updated about once a second and after an event.
    pub fn announcement(&self) -> &str {
        self.messages.announcement()
    }

    /// Shows a message for a few seconds.
    pub fn notify(&mut self, text: String) {
        self.messages.notify(text);
    }

    /// Progress of the replay to the state of a link, 0 to 1; `None` if there is none.
    pub fn replaying(&self) -> Option<f32> {
        self.tasks.replaying(&self.run.player)
    }

    /// Progress of the run to a section of a sweep, 0 to 1; `None` if there is none.
    pub fn loading(&self) -> Option<f32> {
        self.tasks.loading(&self.run.player)
    }

    /// Progress of the film, 0 to 1; `None` if none is being made.
    pub fn filming(&self) -> Option<f32> {
        self.tasks.filming()
    }

    /// Whether a browser key event called `name` has an action here, alone or with the command key.
    pub fn uses(&self, ctx: &egui::Context, name: &str, command: bool) -> bool {
        if ctx.memory(egui::Memory::focused).is_some() {
            return true;
        }
        let key = egui::Key::from_name(if name == " " { "Space" } else { name });
        match key.and_then(keys::action).filter(|_| !command) {
            None => command,
            Some(Action::TurnPage { .. }) => self.course.is_running(),
            Some(Action::Close) => {
                let list = self.has_impact_list();
                list || self.dialog.is_some() || self.messages.has_problem() || self.tasks.are_under_way()
            }
            Some(_) => true,
        }
    }

    /// Lets slow frames reduce the quality of the moving picture: for a window or page, where pictures need not be reproducible.
    pub fn follow_frame_rate(&mut self) {
        self.run.viewport.follow_frame_rate(true);
    }

    /// Quality of the latest picture.
    pub fn picture_quality(&self) -> Quality {
        self.run.viewport.quality()
    }

    /// Camera pose, or its target while the camera moves; `None` before the first picture.
    pub fn camera_pose(&self) -> Option<CameraPose> {
        self.run.viewport.pose()
    }

    /// Window position, points, of a point of the scene, m; `None` behind the camera.
    pub fn place_in_view(&self, point: &Vec3) -> Option<egui::Pos2> {
        self.run.viewport.place(point)
    }

    /// Joint, force in N and age in s of every marked peak.
    pub fn peak_marks(&self) -> Vec<(usize, f32, f64)> {
        self.run.viewport.peak_marks(&self.run.player)
    }

    /// Whether what play costs is shown.
    pub fn shows_costs(&self) -> bool {
        self.bench.shows_costs()
    }

    /// Shows or closes what play costs.
    pub fn show_costs(&mut self, open: bool) {
        self.bench.show_costs(open);
        self.panels.show(Sheet::Bench, open);
    }

    /// Whether impacts are heard.
    pub fn is_sounding(&self) -> bool {
        self.sound.is_on()
    }

    /// Switches sound on or off.
    pub fn set_sound(&mut self, on: bool) {
        if let Some(notice) = self.sound.set(on, self.host.as_mut()) {
            self.messages.notify(notice);
        }
    }

    /// Resets to t = 0 with all changes applied.
    pub fn reset(&mut self) {
        let reset = self.run.reset();
        self.messages.report(reset);
    }

    /// Pauses and shows `time`, s: any previously displayed instant.
    pub fn show_instant(&mut self, time: f64) {
        self.run.show_instant(time);
    }

    /// Pauses and runs to `time`, s, without a time limit. Impacts on the way are recorded but do not glow.
    pub fn run_to(&mut self, time: f64) {
        self.run.run_to(time);
    }

    /// Advances the state by `dt` seconds; returns whether it is still changing.
    pub fn advance(&mut self, dt: f64) -> bool {
        let Self { run, tasks, messages, sound, host, .. } = self;
        run.player.pick(&run.plots.picked);
        if tasks.advance(run, messages) {
            return true;
        }
        let moves = run.advance(dt, |player, dt| sound.advance(player, dt, host.as_mut()));
        messages.observe(&run.player);
        moves
    }

    /// Steps the runs between two frames, as [`Player::step_between`].
    pub fn step_between(&mut self, since: f64) -> Option<bool> {
        if self.tasks.are_under_way() || since > LONGEST_FRAME { None } else { self.run.step_between(since) }
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        // A hidden window shows nothing, and its time stands still.
        if ctx.input(|input| input.viewport().visible()) == Some(false) {
            return;
        }
        self.focus.begin(ctx);
        self.run.follow_changes(ctx, self.tasks.are_under_way(), self.course.is_running());
        self.receive_undo(ctx);
        for action in keys::pressed(ctx, self.course.is_running()) {
            self.perform_action(ctx, action);
        }
        #[cfg(not(target_arch = "wasm32"))]
        self.receive_path(ctx, _frame);
        self.receive_files(ctx);
        self.receive_saved_scene(ctx);
        self.receive_links(ctx);
        self.receive_picture(ctx);
        self.advance_film(ctx);
        self.presentation.follow_screen(ctx);
        // Without sound the first visit is silent: nobody has asked for it.
        if let Some(why) = self.sound.check(self.host.as_mut()).filter(|_| self.visit.is_none()) {
            self.messages.notify(why);
        }
        if self.bench.update(self.host.as_mut()) {
            ctx.request_repaint_after(POLL_PERIOD);
        }
        self.run.viewport.cloud = self.bench.take_cloud(&self.run.player);
        let (now, dt) = ctx.input(|input| (input.time, input.stable_dt));
        let moves = self.advance(f64::from(dt));
        if moves {
            ctx.request_repaint();
        }
        self.bench.report_frame(now, moves);
        self.advance_lesson(ctx);
        self.messages.expire(ctx);
        let lesson = self.course.running().map_or_else(String::new, RunningLesson::report);
        self.messages.announce(ctx, self.host.as_mut(), &self.run.player, &self.tasks, &lesson);
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(store) = &mut self.store {
            let scene = (self.run.player.pending(), self.files.scene.name());
            store.record(ctx, &self.presentation, Some(scene).filter(|_| !self.course.is_running()));
        }
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
        self.focus.end(ui.ctx(), self.dialog.is_some());
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
