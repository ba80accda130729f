//! The application: one [`App`] that the desktop window, the browser and headless frames share.
//!
//! `logic` moves the state (keys, stepping, recording), `ui` shows it.

mod controls;
mod dialogs;
#[cfg(not(target_arch = "wasm32"))]
mod headless;
mod icons;
mod keys;
mod overlay;
mod player;
mod plots;
mod theme;
mod transport;
mod value;
mod viewport;
#[cfg(not(target_arch = "wasm32"))]
mod window;

use eframe::egui::{
    self, CentralPanel, ComboBox, Frame, Panel, RichText, ScrollArea, ThemePreference, Ui,
};
use eframe::egui_wgpu;

use crate::render;
use crate::scene::{BUILT_IN, Scene};
use crate::simulate::StartError;
use crate::view::{Preset, ViewOptions};

use controls::Controls;
use dialogs::{Answer, Dialog};
#[cfg(not(target_arch = "wasm32"))]
pub use headless::{Headless, HeadlessError, Overlay, UiFrame};
use keys::Action;
pub use overlay::{force_notes, plate};
pub use player::Player;
pub use plots::{Plots, Window};
use viewport::Viewport;
#[cfg(not(target_arch = "wasm32"))]
pub use window::{WindowError, run_native};

/// Below this width the window shows everything in one column, points.
const NARROW: f32 = 760.0;

/// How the application starts.
#[derive(Clone, Debug)]
pub struct AppOptions {
    /// The scene on show.
    pub scene: Scene,
    /// Light, dark, or as the system asks.
    pub theme: ThemePreference,
    /// Whether time passes from the start.
    pub playing: bool,
    /// Simulated seconds per second.
    pub time_scale: f64,
    /// Choices about the picture.
    pub view: ViewOptions,
}

impl AppOptions {
    /// Plays `scene` fifty times slower than it is, its play magnified so that it can be seen.
    pub fn new(scene: Scene) -> Self {
        Self {
            scene,
            theme: ThemePreference::System,
            playing: true,
            time_scale: 0.02,
            view: ViewOptions {
                magnification: 20.0,
                ..ViewOptions::default()
            },
        }
    }
}

/// The application.
pub struct App {
    player: Player,
    controls: Controls,
    viewport: Viewport,
    plots: Plots,
    dialog: Option<Dialog>,
    /// What the last attempt to open or reset said.
    problem: Option<String>,
    show_controls: bool,
    show_plots: bool,
    hint_dismissed: bool,
}

impl App {
    /// For a window: sets up the theme and the renderer.
    ///
    /// # Errors
    /// A scene that cannot start.
    pub fn new(cc: &eframe::CreationContext<'_>, options: AppOptions) -> Result<Self, StartError> {
        Self::with_context(&cc.egui_ctx, cc.wgpu_render_state.as_ref(), options)
    }

    /// The same without a window.
    ///
    /// # Errors
    /// A scene that cannot start.
    pub fn with_context(
        ctx: &egui::Context,
        state: Option<&egui_wgpu::RenderState>,
        options: AppOptions,
    ) -> Result<Self, StartError> {
        theme::apply(ctx);
        ctx.set_theme(options.theme);
        if let Some(state) = state {
            render::install(state);
        }
        let mut player = Player::new(&options.scene)?;
        player.pacer.set_scale(options.time_scale);
        player.set_playing(options.playing);
        Ok(Self {
            viewport: Viewport::new(&player, options.view),
            controls: Controls::default(),
            plots: Plots::default(),
            dialog: None,
            problem: None,
            show_controls: true,
            show_plots: true,
            hint_dismissed: false,
            player,
        })
    }

    /// The running scene.
    pub fn player(&self) -> &Player {
        &self.player
    }

    /// The running scene, to drive it.
    pub fn player_mut(&mut self) -> &mut Player {
        &mut self.player
    }

    /// Which plots are shown.
    pub fn plots_mut(&mut self) -> &mut Plots {
        &mut self.plots
    }

    /// Opens a built-in scene or a file; on an error the running scene stays and the reason is shown.
    pub fn open(&mut self, argument: &str) -> Result<(), String> {
        let scene = Scene::load(argument, &[]).map_err(|error| error.to_string())?;
        self.show_scene(&scene)
    }

    /// Shows `problem` above everything until it is dismissed.
    pub fn report(&mut self, problem: String) {
        self.problem = Some(problem);
    }

    /// Back to t = 0 with every change applied.
    pub fn reset(&mut self) {
        match self.player.reset() {
            Ok(()) => {
                self.problem = None;
                self.viewport.restart(&self.player);
            }
            Err(error) => self.problem = Some(error.located(self.player.wanted()).to_string()),
        }
    }

    /// Moves the state on by `dt` seconds; whether it goes on moving by itself.
    pub fn advance(&mut self, dt: f64) -> bool {
        self.player.advance(dt);
        let moves = self.viewport.advance(&self.player, dt as f32);
        moves || self.player.is_playing()
    }

    fn show_scene(&mut self, scene: &Scene) -> Result<(), String> {
        let mut player = Player::new(scene).map_err(|error| error.located(scene).to_string())?;
        player.pacer.set_scale(self.player.pacer.scale());
        player.set_playing(self.player.is_playing() || self.player.stopped().is_some());
        self.player = player;
        self.viewport.show_scene(&self.player);
        self.controls.clear();
        self.problem = None;
        Ok(())
    }

    fn act(&mut self, ctx: &egui::Context, action: Action) {
        // Under a dialog the machine is out of reach.
        if self.dialog.is_some() && !matches!(action, Action::Help | Action::Close) {
            return;
        }
        let player = &mut self.player;
        match action {
            Action::PlayPause => player.set_playing(!player.is_playing()),
            Action::Step => player.single_step(),
            Action::StepBack => player.step_back(),
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
            Action::CloseUp(joint) => self.viewport.close_up(&self.player, joint),
            Action::Magnify => self.viewport.next_magnification(),
            Action::Arrows => {
                let arrows = &mut self.viewport.options.arrows;
                let on = !(arrows.normal || arrows.friction);
                (arrows.normal, arrows.friction) = (on, on);
            }
            Action::Panel => self.show_controls = !self.show_controls,
            Action::Plots => self.show_plots = !self.show_plots,
            Action::Theme => ctx.set_theme(match ctx.theme() {
                egui::Theme::Dark => ThemePreference::Light,
                egui::Theme::Light => ThemePreference::Dark,
            }),
            Action::Help => {
                self.dialog = if self.dialog == Some(Dialog::Help) {
                    None
                } else {
                    Some(Dialog::Help)
                };
            }
            Action::Close => {
                self.dialog = None;
                self.problem = None;
            }
        }
    }

    /// A scene file dropped on the window.
    fn take_dropped(&mut self, ctx: &egui::Context) {
        let Some(file) = ctx.input(|input| input.raw.dropped_files.first().cloned()) else {
            return;
        };
        let name = file.path().display().to_string();
        let opened = dropped_text(&*file).and_then(|text| {
            Scene::parse(&text, Some(&name), &[]).map_err(|error| error.to_string())
        });
        self.problem = opened.and_then(|scene| self.show_scene(&scene)).err();
    }

    /// Everything, in whatever space there is.
    pub fn show(&mut self, ui: &mut Ui) {
        let narrow = ui.available_width() < NARROW;
        let margin = egui::Margin::symmetric(12, 8);
        let bar = Frame::side_top_panel(ui.style()).inner_margin(margin);
        Panel::top("header")
            .frame(bar)
            .show(ui, |ui| self.header(ui, narrow));
        self.problem_banner(ui, bar);
        if narrow {
            self.one_column(ui, bar);
        } else {
            self.side_by_side(ui, bar);
        }
        self.dialog_ui(ui.ctx());
    }

    fn side_by_side(&mut self, ui: &mut Ui, bar: Frame) {
        let Self {
            player,
            controls,
            plots,
            show_controls,
            show_plots,
            ..
        } = self;
        Panel::left("controls")
            .frame(bar)
            .default_size(300.0)
            .size_range(240.0..=480.0)
            .show_collapsible(ui, show_controls, |ui| {
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    // Room for the scroll bar beside the fields.
                    ui.set_max_width(ui.available_width() - 10.0);
                    ui.spacing_mut().item_spacing.y = 5.0;
                    controls.ui(ui, player);
                });
            });
        Panel::bottom("plots")
            .frame(bar)
            .resizable(true)
            .default_size(230.0)
            .size_range(150.0..=600.0)
            .show_collapsible(ui, show_plots, |ui| {
                // Else the panel would shrink to what the plots leave of it.
                ui.take_available_space();
                plots.header(ui, player);
                plots.ui(ui, player);
            });
        let asked = Panel::bottom("transport")
            .frame(bar)
            .show(ui, |ui| transport::ui(ui, player))
            .inner;
        let stop = CentralPanel::no_frame()
            .show(ui, |ui| self.picture(ui))
            .inner;
        if asked.or(stop).is_some() {
            self.reset();
        }
    }

    fn one_column(&mut self, ui: &mut Ui, bar: Frame) {
        let height = (ui.available_height() * 0.42).max(160.0);
        let stop = Panel::top("picture")
            .frame(Frame::NONE)
            .exact_size(height)
            .show(ui, |ui| self.picture(ui))
            .inner;
        let Self {
            player,
            controls,
            plots,
            show_controls,
            show_plots,
            ..
        } = self;
        let asked = Panel::top("transport")
            .frame(bar)
            .show(ui, |ui| transport::ui(ui, player))
            .inner;
        CentralPanel::default().frame(bar).show(ui, |ui| {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                ui.set_max_width(ui.available_width() - 10.0);
                if *show_controls {
                    controls.ui(ui, player);
                    ui.separator();
                }
                if *show_plots {
                    plots.header(ui, player);
                    ui.allocate_ui(egui::vec2(ui.available_width(), 340.0), |ui| {
                        plots.ui(ui, player)
                    });
                }
            });
        });
        if asked.or(stop).is_some() {
            self.reset();
        }
    }

    /// The 3D view with its buttons and, after a stop, the reason.
    fn picture(&mut self, ui: &mut Ui) -> Option<transport::Asked> {
        let area = ui.max_rect();
        self.viewport.ui(ui, &self.player);
        let inner = area.shrink(10.0);
        let narrow = area.width() < 520.0;
        let buttons = egui::UiBuilder::new()
            .max_rect(inner)
            .layout(egui::Layout::right_to_left(egui::Align::Min));
        ui.scope_builder(buttons, |ui| {
            ui.menu_button("View options", |ui| {
                ui.set_min_width(230.0);
                if narrow {
                    ui.horizontal_wrapped(|ui| self.viewport.camera_buttons(ui, false));
                    ui.separator();
                }
                self.viewport.options_ui(ui);
            });
            if !narrow {
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Min), |ui| {
                    self.viewport.camera_buttons(ui, true)
                });
            }
        });
        self.settled_hint(ui, inner);
        let middle = egui::UiBuilder::new().max_rect(inner.shrink2(egui::vec2(0.0, 44.0)));
        ui.scope_builder(middle, |ui| transport::banner(ui, &self.player))
            .inner
    }

    /// What to do when nothing happens any more, in the middle of the lower edge.
    fn settled_hint(&mut self, ui: &mut Ui, area: egui::Rect) {
        let player = &self.player;
        if self.hint_dismissed || !player.is_playing() || !player.has_settled() {
            return;
        }
        let size = egui::vec2(186.0, 26.0);
        let place = egui::Align2::CENTER_BOTTOM.align_size_within_rect(size, area);
        let row = egui::UiBuilder::new()
            .max_rect(place)
            .layout(egui::Layout::left_to_right(egui::Align::Center));
        let fill = ui.visuals().window_fill.gamma_multiply(0.8);
        ui.painter().rect_filled(place, 6.0, fill);
        ui.scope_builder(row, |ui| {
            ui.add_space(8.0);
            ui.label(RichText::new("Settled: R restarts").weak())
                .on_hover_text("No ball has struck its socket for 0.2 s of simulated time");
            let close = ui
                .add(egui::Button::new("×").frame(false))
                .on_hover_text("Do not show this again")
                .accessible_name("Dismiss the hint");
            self.hint_dismissed |= close.clicked();
        });
    }

    fn header(&mut self, ui: &mut Ui, narrow: bool) {
        ui.horizontal(|ui| {
            if !narrow {
                ui.label(RichText::new("Jointplay").heading().strong());
                ui.add_space(8.0);
            }
            let name = self.player.scene().name.clone();
            let mut wanted = None;
            ComboBox::from_id_salt("scene")
                .width(if narrow { 110.0 } else { 170.0 })
                .selected_text(&name)
                .show_ui(ui, |ui| {
                    for built_in in BUILT_IN {
                        if ui.selectable_label(name == built_in, built_in).clicked() {
                            wanted = Some(built_in);
                        }
                    }
                })
                .response
                .on_hover_text(&self.player.scene().title)
                .accessible_name("Scene");
            if let Some(wanted) = wanted {
                self.problem = self.open(wanted).err();
            }
            if ui
                .button("Open…")
                .on_hover_text("Open a scene file")
                .clicked()
            {
                self.dialog = Some(Dialog::Open {
                    path: String::new(),
                    error: None,
                });
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui
                    .button("?")
                    .on_hover_text("Keys (?)")
                    .accessible_name("Keys")
                    .clicked()
                {
                    self.dialog = Some(Dialog::Help);
                }
                // What does not fit is left out rather than laid over the rest; a key stands for the theme.
                let room = ui.available_width();
                if room > 80.0 && ui.button("About").clicked() {
                    self.dialog = Some(Dialog::About);
                }
                if room > 200.0 {
                    theme_box(ui);
                }
            });
        });
    }

    fn problem_banner(&mut self, ui: &mut Ui, bar: Frame) {
        let Some(problem) = self.problem.clone() else {
            return;
        };
        let colour = ui.visuals().error_fg_color;
        Panel::top("problem")
            .frame(bar.fill(colour.gamma_multiply(0.14)))
            .show(ui, |ui| {
                ui.horizontal_wrapped(|ui| {
                    ui.label(RichText::new(problem).color(colour));
                    if ui.button("Dismiss").clicked() {
                        self.problem = None;
                    }
                });
            });
    }

    fn dialog_ui(&mut self, ctx: &egui::Context) {
        let Some(mut dialog) = self.dialog.take() else {
            return;
        };
        match dialogs::ui(ctx, &mut dialog, &self.player) {
            Some(Answer::Close) => {}
            Some(Answer::Open(argument)) => {
                if let Err(reason) = self.open(&argument) {
                    self.dialog = Some(Dialog::Open {
                        path: argument,
                        error: Some(reason),
                    });
                }
            }
            None => self.dialog = Some(dialog),
        }
    }
}

#[cfg(not(target_arch = "wasm32"))]
fn dropped_text(file: &dyn egui::DroppedFile) -> Result<String, String> {
    let name = file.path().display();
    let bytes = file.bytes().map_err(|error| format!("{name}: {error}"))?;
    String::from_utf8(bytes).map_err(|_| format!("{name}: not a text file"))
}

#[cfg(target_arch = "wasm32")]
fn dropped_text(file: &dyn egui::DroppedFile) -> Result<String, String> {
    Err(format!(
        "{}: a browser hands files over only later; this page cannot open them",
        file.path().display()
    ))
}

/// Light, dark or as the system asks.
fn theme_box(ui: &mut Ui) {
    let label = |preference| match preference {
        ThemePreference::System => "System theme",
        ThemePreference::Light => "Light",
        ThemePreference::Dark => "Dark",
    };
    let mut preference = ui.ctx().options(|options| options.theme_preference);
    let before = preference;
    ComboBox::from_id_salt("theme")
        .width(104.0)
        .selected_text(label(preference))
        .show_ui(ui, |ui| {
            for choice in [
                ThemePreference::System,
                ThemePreference::Light,
                ThemePreference::Dark,
            ] {
                ui.selectable_value(&mut preference, choice, label(choice));
            }
        })
        .response
        .on_hover_text("Light or dark (key T)")
        .accessible_name("Theme");
    if preference != before {
        ui.ctx().set_theme(preference);
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        // Behind another window nothing is shown and time stands still.
        if ctx.input(|input| input.viewport().visible()) == Some(false) {
            return;
        }
        for action in keys::pressed(ctx) {
            self.act(ctx, action);
        }
        self.take_dropped(ctx);
        let dt = ctx.input(|input| input.stable_dt);
        if self.advance(f64::from(dt)) {
            ctx.request_repaint();
        }
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.show(ui);
    }
}
