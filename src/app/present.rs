//! Presentation: the picture, large type and thick arrows, for a projector and the last row. It changes nothing of the run.

use std::sync::Arc;

use eframe::egui::{self, Align2, FontId, Galley, Id, Panel, Rect, Sense, Ui, Vec2, vec2};

use super::{App, overlay, theme, transport, value};

/// Least height of a text as a share of the screen's: what the last row of a lecture hall can read.
const LEAST_TEXT: f32 = 1.0 / 40.0;
/// Smallest type of the interface, points: that of the ticks of the arrows' legend.
const SMALLEST: f32 = 11.0;
/// Type of the caption, points.
const CAPTION: f32 = 24.0;
/// Type of the badge of an impact in a window, points.
const BADGE: f32 = 15.0;
/// Room about its words, points.
const PAD: Vec2 = vec2(12.0, 4.0);
/// Width that the time takes in the corner of the picture, points.
const TIME: f32 = 170.0;
/// Least height of the plots of a lesson, points.
const LEAST_PLOTS: f32 = 130.0;
/// How much thicker arrows are.
const THICKNESS: f32 = 2.0;
/// Change of the screen's height that the type follows, as a share of it.
const FOLLOWED: f32 = 0.02;

/// What was before, and how the screen is.
pub struct Presentation {
    /// Zoom of the interface before.
    zoom: f32,
    /// Thickness of arrows before.
    thickness: f32,
    /// Height of the screen that the type was sized for, points at zoom 1.
    height: f32,
}

/// Height of the screen, points at zoom 1.
fn screen_height(ctx: &egui::Context) -> f32 {
    ctx.content_rect().height() * ctx.zoom_factor()
}

/// Zoom at which the smallest type is legible from the last row of a screen `height` points high.
fn legible(height: f32) -> f32 {
    (height * LEAST_TEXT / SMALLEST).max(1.0)
}

impl App {
    /// Begins or ends the presentation.
    pub fn present(&mut self, ctx: &egui::Context, on: bool) {
        if on == self.presentation.is_some() {
            return;
        }
        match self.presentation.take() {
            Some(before) => {
                ctx.set_zoom_factor(before.zoom);
                self.viewport.options.arrows.thickness = before.thickness;
            }
            None => {
                let height = screen_height(ctx);
                self.presentation = Some(Presentation {
                    zoom: ctx.zoom_factor(),
                    thickness: self.viewport.options.arrows.thickness,
                    height,
                });
                ctx.set_zoom_factor(legible(height));
                self.viewport.options.arrows.thickness = THICKNESS;
            }
        }
        self.host.fill_screen(ctx, on);
    }

    /// Whether it is a presentation.
    pub fn is_presenting(&self) -> bool {
        self.presentation.is_some()
    }

    /// Sizes the type for the screen, once its size has changed: on the way to the full screen and back.
    pub(super) fn follow_screen(&mut self, ctx: &egui::Context) {
        let Some(presentation) = &mut self.presentation else {
            return;
        };
        let height = screen_height(ctx);
        let change = (height - presentation.height).abs();
        // A pass later the new zoom is in force: only then the height is that of the screen.
        let settled = (ctx.zoom_factor() - legible(presentation.height)).abs() < 1e-3;
        if settled && change > FOLLOWED * presentation.height {
            presentation.height = height;
            ctx.set_zoom_factor(legible(height));
        }
    }

    /// The whole of the window.
    pub(super) fn presentation_ui(&mut self, ui: &mut Ui) {
        let bar = theme::panel(ui).inner_margin(egui::Margin::symmetric(12, 4));
        let free = !self.is_under_way();
        let mut leave = false;
        let asked = Panel::bottom("presentation")
            .frame(bar)
            .show(ui, |ui| {
                leave = double_tapped(ui);
                let row = egui::Layout::right_to_left(egui::Align::Center);
                let size = vec2(ui.available_width(), theme::side(ui, transport::PLAY));
                ui.allocate_ui_with_layout(size, row, |ui| {
                    let help = "Back to the window with its panels (F5, Esc, double-tap on this bar)";
                    leave |= ui.button("Leave").on_hover_text(help).clicked();
                    ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                        ui.add_enabled_ui(free, |ui| transport::row(ui, &mut self.player)).inner
                    })
                    .inner
                })
                .inner
            })
            .inner;
        self.lesson_beside(ui, bar);
        self.lesson_plots(ui, bar);
        self.central(ui, asked);
        if leave {
            self.present(ui.ctx(), false);
        }
    }

    /// The plots of a lesson that speaks of them.
    fn lesson_plots(&mut self, ui: &mut Ui, bar: egui::Frame) {
        if self.course().is_none() || !self.show_plots {
            return;
        }
        let free = !self.is_under_way();
        let height = (0.36 * ui.available_height()).max(LEAST_PLOTS);
        let Self { player, plots, viewport, .. } = self;
        Panel::bottom("plots of the lesson").frame(bar).resizable(false).exact_size(height).show(ui, |ui| {
            ui.take_available_space();
            if let Some(time) = plots.ui(ui, player).filter(|_| free) {
                player.go_to(time);
                viewport.revisit(player);
            }
        });
    }

    /// The last finished impact: ball joint, largest normal force, how long it lasted.
    pub fn last_impact(&self) -> Option<String> {
        let player = &self.player;
        let shown = player.pacer.shown();
        // The simulation may be a step ahead of what is on show.
        let mut impacts = player.simulation().impacts().rev();
        let impact = impacts.find(|impact| impact.end <= shown)?;
        let name = &player.scene().ball_joints[impact.joint].name;
        let force = value::quantity(impact.peak, "N", 3);
        let lasted = (impact.end - impact.start) * 1e3;
        Some(format!("{name}, {force}, {} ms", value::number(lasted, 2)))
    }

    /// The words of the caption and the plate they stand on: the impact under way at an instant that is looked at; in a
    /// presentation, otherwise, the last one that ended.
    pub(super) fn caption_plate(&self, ui: &Ui) -> Option<(Arc<Galley>, Rect)> {
        let presenting = self.is_presenting();
        let area = ui.available_rect_before_wrap();
        let ink = ui.visuals().strong_text_color();
        if !presenting && (!overlay::has_room(area) || self.picture.is_plain()) {
            return None;
        }
        let text = self.impact_badge().or_else(|| self.last_impact().filter(|_| presenting))?;
        let lay = |size| {
            let font = FontId::proportional(size);
            ui.painter().layout_no_wrap(text.clone(), font, ink)
        };
        let mut inside = area.shrink(12.0);
        if !presenting {
            // Below the buttons and the time.
            inside.min.y += overlay::plate(2)[1].max(ui.spacing().interact_size.y + 8.0);
        }
        let full = if presenting { CAPTION } else { BADGE };
        let mut words = lay(full);
        let room = inside.width() - 2.0 * PAD.x;
        if words.size().x > room {
            words = lay((full * room / words.size().x).max(SMALLEST));
        }
        let middle = Align2::CENTER_TOP.align_size_within_rect(words.size(), inside);
        // Beside a lesson there is no room in the middle: the time stands on the left. Beside the microscope, too, there is
        // room below the time alone.
        let place = if !presenting || middle.left() >= area.left() + TIME {
            middle
        } else {
            if inside.right() - words.size().x < area.left() + TIME {
                inside.min.y += overlay::plate(1)[1];
            }
            Align2::RIGHT_TOP.align_size_within_rect(words.size(), inside)
        };
        Some((words, place.expand2(PAD)))
    }

    pub(super) fn caption(&self, ui: &Ui, caption: Option<(Arc<Galley>, Rect)>) {
        let Some((words, plate)) = caption else {
            return;
        };
        let painter = ui.painter_at(self.picture_rect);
        painter.rect_filled(plate, 6.0, ui.visuals().window_fill.gamma_multiply(0.85));
        let text = words.text().to_owned();
        painter.galley(plate.min + PAD, words, ui.visuals().strong_text_color());
        let response = ui.interact(plate, Id::unique("last impact"), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &text));
        let help = if self.impact_badge().is_some() {
            "The impact at this instant: its number and ball joint, when it began, its largest normal force, how long the ball \
             touched, approach and rebound speed"
        } else {
            "The last impact that has ended: its ball joint, its largest normal force, and how long the ball touched"
        };
        response.on_hover_text(help);
    }
}

/// Whether the bar that fills `ui` is double-clicked or double-tapped where it holds nothing else. Comes before its contents, which
/// lie over it.
pub fn double_tapped(ui: &Ui) -> bool {
    let bar: Rect = ui.max_rect();
    let response = ui.interact(bar, ui.scope_id().with("double tap"), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Toolbar, true, "Transport bar"));
    response.double_clicked()
}
