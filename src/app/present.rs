//! Presentation for a projector and the last row: the picture with large type and thick arrows, time, transport and one plot. It
//! does not affect the run.

use std::sync::Arc;

use eframe::egui::{self, Align2, FontId, Galley, Id, Panel, Rect, Sense, Ui, Vec2, vec2};

#[cfg(not(target_arch = "wasm32"))]
use super::audience::Audience;
use super::bench::Bench;
#[cfg(not(target_arch = "wasm32"))]
use super::keys::Action;
use super::run::Run;
use super::{App, overlay, spoken, theme, transport, value};
use crate::view::{Palette, Theme, ViewOptions};

/// Least text height as a fraction of the screen height, legible from the last row of a lecture hall.
const MIN_TEXT_HEIGHT: f32 = 1.0 / 40.0;
/// Smallest type of the interface, points: tick labels of the arrows' legend.
const SMALLEST_FONT: f32 = 11.0;
/// Type of the caption, points.
const CAPTION_FONT: f32 = 24.0;
/// Type of the badge of an impact in a window, points.
const BADGE_FONT: f32 = 15.0;
/// Padding around its text, points.
const BADGE_PADDING: Vec2 = vec2(4.0, 0.0);
/// Height reserved for a caption, points: one line in its large type, or two in the smallest.
pub(super) const CAPTION_HEIGHT: f32 = 40.0;
/// Least width of a bar with transport and timeline side by side, points.
const MIN_BAR_WIDTH: f32 = 700.0;
/// Width of the buttons at the right end of the bar, points.
const BUTTONS_WIDTH: f32 = 150.0;
/// Thickness of arrows relative to the normal view.
pub(super) const ARROW_THICKNESS: f32 = 2.0;
/// Least relative change of the screen height that changes the type size.
const MIN_HEIGHT_CHANGE: f32 = 0.02;

/// What the audience sees: the presentation in this window, and the window for the class.
#[derive(Default)]
pub struct Presentation {
    running: Option<Running>,
    /// The user's zoom while another is shown: in a presentation and in a tiny window, until it is in effect again.
    pub set_aside_zoom: Option<f32>,
    /// Index of the single plot shown in a presentation and in the audience window.
    pub plot: Option<usize>,
    /// The audience window.
    #[cfg(not(target_arch = "wasm32"))]
    pub audience: Option<Audience>,
}

/// Settings to restore, and the screen height.
struct Running {
    /// Previous thickness of arrows.
    thickness: f32,
    /// Screen height for which the type was sized, points at zoom 1.
    height: Option<f32>,
}

/// Height of the plots below the picture, points: a third of the screen.
pub(super) fn plots_height(ui: &Ui) -> f32 {
    (ui.ctx().content_rect().height() / 3.0).min(0.5 * ui.available_height())
}

/// Least size for controls and picture, points, and smallest zoom that makes room for them.
const MIN_WINDOW_SIZE: egui::Vec2 = egui::vec2(320.0, 300.0);
const MIN_ZOOM: f32 = 0.5;

/// Height of the screen, points at zoom 1.
pub(super) fn screen_height(ctx: &egui::Context) -> f32 {
    ctx.content_rect().height() * ctx.zoom_factor()
}

/// Zoom at which the smallest type is legible from the last row of a screen `height` points high.
pub(super) fn legible_zoom(height: f32) -> f32 {
    (height * MIN_TEXT_HEIGHT / SMALLEST_FONT).max(1.0)
}

impl Presentation {
    /// Whether this window presents.
    pub fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Begins or ends the presentation in this window.
    fn set_running(&mut self, on: bool, options: &mut ViewOptions) {
        if let Some(before) = self.running.take() {
            options.arrows.thickness = before.thickness;
        }
        if on {
            let thickness = std::mem::replace(&mut options.arrows.thickness, ARROW_THICKNESS);
            self.running = Some(Running { thickness, height: None });
        }
    }

    /// The user's zoom of the interface.
    pub fn own_zoom(&self, ctx: &egui::Context) -> f32 {
        self.set_aside_zoom.unwrap_or_else(|| ctx.zoom_factor())
    }

    /// The plot shown in a presentation and in the audience window, if any.
    pub fn single_plot(&self, run: &Run) -> Option<usize> {
        self.plot.filter(|index| *index < run.plots.titles(&run.player).len())
    }

    /// Shows the next of the chosen plots, or none after the last.
    fn show_next_plot(&mut self, run: &Run) {
        self.plot = Some(self.single_plot(run).map_or(0, |index| index + 1));
        self.plot = self.single_plot(run);
    }

    /// Sizes the type: in a presentation for the screen, also after a size change such as entering or leaving full screen;
    /// otherwise as the user chose, but smaller in a window that is too small for its controls, e.g. on a page zoomed to four
    /// times the size.
    pub fn follow_screen(&mut self, ctx: &egui::Context) {
        let (now, own) = (ctx.zoom_factor(), self.own_zoom(ctx));
        let zoom = if let Some(presentation) = &mut self.running {
            let height = screen_height(ctx);
            let is_sized = presentation.height.is_some_and(|sized| {
                // The new zoom takes effect a pass later; only then the height is that of the screen.
                let settled = (now - legible_zoom(sized)).abs() < 1e-3;
                !settled || (height - sized).abs() <= MIN_HEIGHT_CHANGE * sized
            });
            self.set_aside_zoom = Some(own);
            if is_sized {
                return;
            }
            presentation.height = Some(height);
            legible_zoom(height)
        } else {
            let room = ctx.content_rect().size() * now / MIN_WINDOW_SIZE;
            let zoom = own.min(room.min_elem().max(MIN_ZOOM));
            let is_shown = zoom == own && (zoom - now).abs() <= 1e-3;
            self.set_aside_zoom = (!is_shown).then_some(own);
            zoom
        };
        if (zoom - now).abs() > 1e-3 {
            ctx.set_zoom_factor(zoom);
        }
    }
}

impl App {
    /// Begins or ends the presentation. `follow_screen` sizes the type once a frame: a zoom takes effect a pass later, so two
    /// changes within a frame would not see each other.
    pub fn present(&mut self, ctx: &egui::Context, on: bool) {
        if on == self.is_presenting() {
            return;
        }
        if on {
            self.bench.set_aside();
        }
        self.presentation.set_running(on, &mut self.run.viewport.options);
        self.host.fill_screen(ctx, on);
    }

    /// Whether a presentation is active.
    pub fn is_presenting(&self) -> bool {
        self.presentation.is_running()
    }

    /// Shows the next of the chosen plots, or none after the last; in a presented lesson toggles between all and none.
    pub(super) fn show_next_plot(&mut self) {
        if self.is_presenting() && self.course.is_running() {
            self.panels.plots = !self.panels.plots;
        } else {
            self.presentation.show_next_plot(&self.run);
        }
    }

    /// Shows the audience window if it is open.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn audience_ui(&mut self, ctx: &egui::Context) {
        let plot = self.presentation.single_plot(&self.run);
        let Some(audience) = &mut self.presentation.audience else {
            return;
        };
        let (actions, closed) = audience.ui(ctx, &mut self.run, plot, self.tasks.filming().is_some());
        for action in actions {
            match action {
                Action::Plots => self.show_next_plot(),
                other => self.perform_action(ctx, other),
            }
        }
        if closed {
            self.show_audience(false);
        }
    }

    /// Contents of the whole window.
    pub(super) fn presentation_ui(&mut self, ui: &mut Ui) {
        let bar = theme::panel(ui).inner_margin(egui::Margin::symmetric(12, 4));
        let free = !self.tasks.are_under_way();
        let mut leave = false;
        let reset = Panel::bottom("presentation")
            .frame(bar)
            .show(ui, |ui| {
                leave = double_tapped(ui);
                // A lesson needs the height, so the timeline gets the rest of the row.
                let in_lesson = self.course.is_running();
                if !in_lesson {
                    ui.add_enabled_ui(free, |ui| self.run.timeline_ui(ui));
                }
                let backwards = egui::Layout::right_to_left(egui::Align::Center);
                let width = ui.available_width();
                if width < transport::MIN_WIDTH + BUTTONS_WIDTH {
                    let reset = ui.add_enabled_ui(free, |ui| transport::row(ui, &mut self.run.player, true)).inner;
                    let size = vec2(width, ui.spacing().interact_size.y);
                    ui.allocate_ui_with_layout(size, backwards, |ui| leave |= self.presentation_buttons(ui));
                    return reset;
                }
                let size = vec2(width, theme::side(ui, transport::PLAY_SIDE));
                ui.allocate_ui_with_layout(size, backwards, |ui| {
                    leave |= self.presentation_buttons(ui);
                    ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                        ui.add_enabled_ui(free, |ui| {
                            if !in_lesson || width < MIN_BAR_WIDTH {
                                return transport::row(ui, &mut self.run.player, true);
                            }
                            ui.horizontal(|ui| {
                                let reset = transport::minimal(ui, &mut self.run.player);
                                self.run.timeline_ui(ui);
                                reset
                            })
                            .inner
                        })
                        .inner
                    })
                    .inner
                })
                .inner
            })
            .inner;
        self.lesson_panel(ui, bar);
        self.presented_plots(ui, bar);
        self.lesson_twin(ui, bar);
        self.central(ui, reset);
        if leave {
            self.present(ui.ctx(), false);
        }
    }

    /// The buttons at the right end of the bar, from right to left. Returns whether to end the presentation.
    fn presentation_buttons(&mut self, ui: &mut Ui) -> bool {
        let help = "Back to the window with its panels (F5, Esc, double-tap on this bar)";
        let leave = ui.button("Leave").on_hover_text(help).clicked();
        let on = if self.course.is_running() {
            self.panels.plots
        } else {
            self.presentation.single_plot(&self.run).is_some()
        };
        let help = "The next of the chosen plots, after the last none (key P)";
        if ui.add(egui::Button::selectable(on, "Plot")).on_hover_text(help).clicked() {
            self.show_next_plot();
        }
        leave
    }

    /// The selected plot; in a lesson that refers to plots, all of them.
    fn presented_plots(&mut self, ui: &mut Ui, bar: egui::Frame) {
        let in_lesson = self.course.is_running();
        let single = self.presentation.single_plot(&self.run).filter(|_| !in_lesson);
        if single.is_none() && !(in_lesson && self.panels.plots) {
            return;
        }
        let free = !self.tasks.are_under_way();
        let height = plots_height(ui);
        let run = &mut self.run;
        Panel::bottom("plots of the presentation").frame(bar).resizable(false).exact_size(height).show(ui, |ui| {
            ui.take_available_space();
            run.plots_ui(ui, single, free);
        });
    }

    /// The twin's distance under the picture of a presentation, if the lesson uses the bench.
    fn lesson_twin(&self, ui: &mut Ui, bar: egui::Frame) {
        if !self.course.is_running() || !self.panels.bench || self.run.player.twin().is_none() {
            return;
        }
        let height = 0.42 * ui.available_height();
        Panel::bottom("twin of the lesson")
            .frame(bar)
            .resizable(false)
            .exact_size(height)
            .show(ui, |ui| Bench::twin_ui(ui, &self.run.player));
    }
}

impl Run {
    /// The last finished impact: joint, largest normal force, duration.
    pub fn last_impact(&self) -> Option<String> {
        let player = &self.player;
        let shown = player.pacer.shown();
        let impact = player.impact_record().last_ended(shown, shown)?;
        let name = value::site(player.running(), impact.joint, impact.place);
        let force = value::quantity(impact.peak, "N", 3);
        let duration_ms = (impact.end - impact.start) * 1e3;
        Some(format!("{name}, {force}, {} ms", value::number(duration_ms, 2)))
    }

    /// The caption in `place`: the impact at the inspected instant; when `presenting`, otherwise, the last finished one.
    pub(super) fn caption(&self, ui: &Ui, place: Rect, presenting: bool, is_filmed: bool) -> Option<Caption> {
        let badge = self.impact_badge(is_filmed);
        let help = if badge.is_some() {
            "The impact at this instant: its number and joint, when it began, its largest normal force, how long the parts \
             touched, approach and rebound speed"
        } else {
            "The last impact that has ended: its joint, its largest normal force, and how long the parts touched"
        };
        let text = badge.or_else(|| self.last_impact().filter(|_| presenting))?;
        Some(Caption::new(ui, place, &text, help, presenting))
    }
}

/// A caption in the strip below the picture.
pub struct Caption {
    words: Arc<Galley>,
    plate: Rect,
    help: &'static str,
}

impl Caption {
    /// `text` as large as `place` permits.
    fn new(ui: &Ui, place: Rect, text: &str, help: &'static str, presenting: bool) -> Self {
        let ink = ui.visuals().strong_text_color();
        let full = if presenting { CAPTION_FONT } else { BADGE_FONT };
        let room = place.width() - 2.0 * BADGE_PADDING.x;
        let lay = |size: f32| {
            // Text too long in the smallest type wraps to a second line.
            let width = if size > SMALLEST_FONT { f32::INFINITY } else { room };
            ui.painter().layout(text.to_owned(), FontId::proportional(size), ink, width)
        };
        let mut words = lay(full);
        let width = words.size().x;
        if width > room {
            words = lay((full * room / width).max(SMALLEST_FONT));
        }
        Self { words, plate: place, help }
    }

    /// Draws it.
    pub fn ui(self, ui: &Ui) {
        let Self { words, plate, help } = self;
        // In a narrow picture the names of the arrows give way.
        let theme = if ui.visuals().dark_mode { Theme::Dark } else { Theme::Light };
        let painter = ui.painter_at(plate);
        painter.rect_filled(plate, 0.0, overlay::colour(Palette::of(theme).sky));
        let text = words.text().to_owned();
        let at = Align2::LEFT_CENTER.align_size_within_rect(words.size(), plate.shrink2(BADGE_PADDING));
        painter.galley(at.min, words, ui.visuals().strong_text_color());
        let response = ui.interact(plate, Id::unique("last impact"), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &text));
        response.on_hover_text(help);
    }
}

/// Names the bar that fills `ui` for screen readers. Returns whether its empty part was double-clicked or double-tapped. Call it
/// before adding the contents, which take precedence.
pub fn double_tapped(ui: &Ui) -> bool {
    spoken::landmark(ui, "Transport");
    let bar: Rect = ui.max_rect();
    let response = ui.interact(bar, ui.scope_id().with("double tap"), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Toolbar, true, "Transport bar"));
    response.double_clicked()
}
