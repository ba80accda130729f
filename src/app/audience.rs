//! The audience window: a second window that shows the presentation while the controls stay in the first. It accepts only keys
//! and a double-click, and does not affect the run.

use eframe::egui::{self, CentralPanel, Panel, PointerButton, Ui, ViewportBuilder, ViewportCommand, ViewportId, vec2};

use super::keys::Action;
use super::overlay::Room;
use super::run::Run;
use super::{keys, layout, present, theme};

/// Initial size, points at zoom 1.
const INITIAL_SIZE: egui::Vec2 = vec2(1280.0, 720.0);

/// State of the window in its latest frame.
pub struct Audience {
    /// Its height, points at zoom 1.
    height: f32,
    fills_screen: bool,
}

/// Results of a frame.
struct FrameResults {
    height: f32,
    closed: bool,
    tapped: bool,
    keys: Vec<Action>,
}

/// Its viewport ID.
fn id() -> ViewportId {
    ViewportId::from_hash_of("window for the class")
}

/// Selects the plot of the window from those with these `titles`.
pub fn choose_plot(ui: &mut Ui, titles: &[String], chosen: &mut Option<usize>) {
    ui.label("For the class");
    let title = |index: Option<usize>| index.and_then(|index| titles.get(index)).map_or("None", |title| title);
    let help = "The plot in the window for the class (key P there)";
    let all = [None].into_iter().chain((0..titles.len()).map(Some));
    layout::choice(ui, ["For the class", help], Some(110.0), chosen, all, title);
}

/// Menu entry of the window, on platforms with several windows; `on`: whether it is open. Returns whether it was clicked.
pub fn entry(ui: &mut Ui, on: bool) -> bool {
    let help = "A second window for the projector: picture, time, impact and one plot in large type. A double-click on it, or \
                F5, fills its screen";
    ui.add(egui::Button::selectable(on, "Window for the class")).on_hover_text(help).clicked()
}

impl Audience {
    /// The window when it opens.
    pub fn open() -> Self {
        Self { height: INITIAL_SIZE.y, fills_screen: false }
    }

    /// Shows the window with the plot of index `plot`. Returns the actions of its keys, and whether it was closed.
    pub fn ui(
        &mut self,
        ctx: &egui::Context,
        run: &mut Run,
        plot: Option<usize>,
        is_filmed: bool,
    ) -> (Vec<Action>, bool) {
        let zoom = present::legible_zoom(self.height);
        // In points at the initial zoom; a changed size would resize the window.
        let size = INITIAL_SIZE / present::legible_zoom(INITIAL_SIZE.y);
        let builder = ViewportBuilder::default()
            .with_title("Jointplay: window for the class")
            .with_app_id("jointplay")
            .with_inner_size(size)
            .with_min_inner_size(size / 4.0);
        // egui has one zoom for all windows. This window is drawn immediately with its own zoom, which keys do not change.
        let own = ctx.options(|options| (options.zoom_factor, options.zoom_with_keyboard));
        ctx.options_mut(|options| (options.zoom_factor, options.zoom_with_keyboard) = (zoom, false));
        let results = ctx.show_viewport_immediate(id(), builder, |ui, _| contents(ui, run, plot, is_filmed));
        ctx.options_mut(|options| (options.zoom_factor, options.zoom_with_keyboard) = own);
        if self.height != results.height {
            self.height = results.height;
            ctx.request_repaint();
        }
        let mut actions = results.keys;
        actions.retain(|key| {
            // Close leaves full screen, as in the first window.
            if *key == Action::Present || (*key == Action::Close && self.fills_screen) {
                self.switch_full_screen(ctx);
            }
            !matches!(key, Action::Present | Action::Close)
        });
        if results.tapped {
            self.switch_full_screen(ctx);
        }
        (actions, results.closed)
    }

    fn switch_full_screen(&mut self, ctx: &egui::Context) {
        self.fills_screen = !self.fills_screen;
        ctx.send_viewport_cmd_to(id(), ViewportCommand::Fullscreen(self.fills_screen));
    }
}

/// Contents of the window: the picture of `run`, and its plot of index `plot`.
fn contents(ui: &mut Ui, run: &mut Run, plot: Option<usize>, is_filmed: bool) -> FrameResults {
    let ctx = ui.ctx().clone();
    let results = ctx.input(|input| {
        let tapped = input.pointer.button_double_clicked(PointerButton::Primary);
        (input.viewport().close_requested(), tapped)
    });
    let results = FrameResults {
        height: present::screen_height(&ctx),
        closed: results.0,
        tapped: results.1,
        keys: keys::pressed(&ctx, true),
    };
    ui.visuals_mut().disabled_alpha = 1.0;
    ui.disable();
    if let Some(index) = plot {
        let bar = theme::panel(ui).inner_margin(egui::Margin::symmetric(12, 4));
        let height = present::plots_height(ui);
        Panel::bottom("plot for the class").frame(bar).resizable(false).exact_size(height).show(ui, |ui| {
            ui.take_available_space();
            run.plots.second(ui, &run.player, index);
        });
    }
    CentralPanel::no_frame().show(ui, |ui| {
        let room = Room { words: present::CAPTION_HEIGHT, ..Room::default() };
        let strips = run.viewport.second_ui(ui, &run.player, present::ARROW_THICKNESS, room);
        if let Some(caption) = run.caption(ui, strips.words, true, is_filmed) {
            caption.ui(ui);
        }
    });
    results
}
