//! Saved pictures of the 3D view, the view with plots, or the whole window, at any size. The same code redraws them off screen at
//! that size, so that labels and arrows are sharp.

use eframe::egui::{self, CentralPanel, DragValue, Panel, Rect, RichText, Ui, Vec2, vec2};
use eframe::egui_wgpu::RenderState;

use super::App;
use super::canvas::{Canvas, Pending};
use super::files::{describe, file_stem};
use super::host::SaveFile;
use super::layout;
use super::overlay::SMALL_PICTURE;
use super::theme;
use crate::render::RenderError;

/// Height of the plots below the view, points.
const PLOTS_HEIGHT: f32 = 230.0;
/// Least edge of a picture of the view, points, if its pixels permit: a small view is enlarged to fit names and legend.
const MIN_EDGE: f32 = 1.1 * SMALL_PICTURE;
/// Sizes to choose from, as multiples of the size on the screen.
const SCALES: [u32; 3] = [1, 2, 4];
/// Range of a typed edge, pixels. The adapter's own limit is reported when it is exceeded.
const EDGE_RANGE: std::ops::RangeInclusive<u32> = 16..=65_536;
/// Timeout for a picture that does not arrive, s.
const TIMEOUT: f64 = 20.0;

/// Contents of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Contents {
    /// The 3D view without its buttons.
    #[default]
    View,
    /// The 3D view with the plots below it.
    Plots,
    /// The whole window.
    Window,
}

impl Contents {
    const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::View, "View only", "The 3D view without its buttons"),
        (Self::Plots, "View and plots", "The 3D view with the plots below it"),
        (Self::Window, "Whole window", "The window as it is, with all panels"),
    ];
}

/// Settings of the next picture, and a pending picture.
pub struct Picture {
    contents: Contents,
    /// Multiple of the size on the screen; `None`: the typed size `own_size`.
    times: Option<u32>,
    own_size: [u32; 2],
    /// Whether a picture was requested.
    requested: bool,
    pending: Option<(Pending, f64)>,
    /// Contents of the current off-screen pass.
    drawn: Option<Contents>,
}

impl Default for Picture {
    fn default() -> Self {
        Self {
            contents: Contents::View,
            times: Some(SCALES[0]),
            own_size: [1920, 1080],
            requested: false,
            pending: None,
            drawn: None,
        }
    }
}

impl Picture {
    /// Whether this pass draws off screen.
    pub fn is_drawn(&self) -> bool {
        self.drawn.is_some()
    }

    /// Whether the view is drawn without its buttons and hints.
    pub fn hides_controls(&self) -> bool {
        self.drawn.is_some_and(|drawn| drawn != Contents::Window)
    }

    /// Discards a pending picture.
    pub fn forget(&mut self) {
        (self.requested, self.pending) = (false, None);
    }

    /// Size of the picture in pixels, and its pixels per point, for contents of `points` on the screen.
    fn size(&self, points: Vec2, screen: f32) -> ([u32; 2], f32) {
        let (pixels, scale) = match self.times {
            Some(times) => {
                let pixels = [points.x, points.y].map(|edge| (edge * screen).round() as u32);
                (pixels.map(|edge| edge * times), screen * times as f32)
            }
            None => {
                let [across, down] = self.own_size.map(|edge| edge as f32);
                (self.own_size, (across / points.x).min(down / points.y))
            }
        };
        if self.times == Some(1) {
            return (pixels, scale);
        }
        // Text with fewer pixels than on an ordinary screen is illegible; in a small view, larger text leaves no room for names.
        let readable = screen.min(1.0);
        let room = match self.contents {
            Contents::Window => f32::INFINITY,
            Contents::View | Contents::Plots => pixels[0].min(pixels[1]) as f32 / MIN_EDGE,
        };
        (pixels, scale.min(room).max(readable))
    }

    /// Options and save button of a picture of the window with the 3D view in `view`; returns whether to save it.
    pub fn menu(&mut self, ui: &mut Ui, view: Rect) -> bool {
        let asked = layout::entry(ui, "Picture…", "A picture as chosen below, PNG");
        layout::aligned(ui, |ui| self.choices(ui, view));
        asked
    }

    /// What a picture shows, and its size.
    fn choices(&mut self, ui: &mut Ui, view: Rect) {
        let (points, screen) = (self.points(ui.ctx(), view), ui.ctx().pixels_per_point());
        // Options have round marks, unlike the actions around them.
        ui.horizontal_wrapped(|ui| {
            for (contents, name, help) in Contents::ALL {
                ui.radio_value(&mut self.contents, contents, name).on_hover_text(help);
            }
        });
        ui.horizontal_wrapped(|ui| {
            for times in SCALES {
                let help = format!("{times} times as many pixels along each edge as on the screen");
                ui.radio_value(&mut self.times, Some(times), format!("{times}×")).on_hover_text(help);
            }
            ui.radio_value(&mut self.times, None, "Own size").on_hover_text("Choose width and height");
        });
        ui.add_enabled_ui(self.times.is_none(), |ui| {
            ui.horizontal(|ui| {
                for (edge, name) in self.own_size.iter_mut().zip(["Width", "Height"]) {
                    ui.label(name);
                    ui.add(DragValue::new(edge).range(EDGE_RANGE).suffix(" px"))
                        .on_hover_text("Edge of the picture, pixels")
                        .accessible_name(format!("{name} of the picture"));
                }
            });
        });
        let ([width, height], _) = self.size(points, screen);
        ui.label(RichText::new(format!("{width} × {height} pixels")).small().weak());
    }

    /// Screen size of the contents, points, with the 3D view in `view`.
    fn points(&self, ctx: &egui::Context, view: Rect) -> Vec2 {
        let view = view.size();
        let points = match self.contents {
            Contents::View => view,
            Contents::Plots => view + vec2(0.0, PLOTS_HEIGHT),
            Contents::Window => ctx.content_rect().size(),
        };
        points.max(Vec2::splat(1.0))
    }

    /// Asks for the chosen picture, which is saved once it has been read back from the graphics adapter.
    pub fn request(&mut self, ctx: &egui::Context) {
        self.forget();
        self.requested = true;
        ctx.request_repaint();
    }
}

impl App {
    /// Draws the picture requested by [`Picture::request`], and collects it when available.
    pub(super) fn receive_picture(&mut self, ctx: &egui::Context) {
        let now = ctx.input(|input| input.time);
        if std::mem::take(&mut self.picture.requested) {
            match self.draw_picture(ctx) {
                Ok(pending) => self.picture.pending = Some((pending, now)),
                Err(reason) => self.messages.fail(reason),
            }
        }
        let Some((pending, since)) = &mut self.picture.pending else {
            return;
        };
        let Some(image) = pending.take() else {
            if now - *since > TIMEOUT {
                self.picture.forget();
                self.messages.fail("The graphics adapter did not return the picture");
            }
            ctx.request_repaint();
            return;
        };
        self.picture.pending = None;
        let described = describe(&self.run.player);
        let software = format!("jointplay {}", crate::VERSION);
        let texts = [("Software", software.as_str()), ("Description", described.as_str())];
        let bytes = image
            .map_err(|error| error.to_string())
            .and_then(|image| image.png(&texts).map_err(|error| error.to_string()));
        match bytes {
            Ok(bytes) => self.save(vec![SaveFile {
                name: format!("{}.png", file_stem(&self.run.player)),
                mime: "image/png",
                bytes,
            }]),
            Err(reason) => self.messages.fail(format!("The picture cannot be saved: {reason}")),
        }
    }

    /// Draws the picture off screen.
    fn draw_picture(&mut self, ctx: &egui::Context) -> Result<Pending, String> {
        let state: RenderState =
            self.graphics.state.clone().ok_or("The picture cannot be drawn: there is no graphics adapter")?;
        let resolution = self.picture.size(self.picture.points(ctx, self.panels.picture), ctx.pixels_per_point());
        let contents = self.picture.contents;
        let aspect = self.run.viewport.scene_area().aspect_ratio();
        let pending = self.draw_off_screen(ctx, &mut Canvas::beside(&state), contents, resolution, aspect, true);
        pending.map_err(|error| format!("The picture cannot be drawn: {error}"))
    }

    /// Draws a film frame of `size` pixels that contains everything in a view of `aspect`; the `first` one settles the layout.
    ///
    /// # Errors
    /// The size cannot be drawn; the message says why.
    pub(super) fn draw_frame(
        &mut self,
        ctx: &egui::Context,
        canvas: &mut Canvas,
        contents: Contents,
        size: [u32; 2],
        aspect: f32,
        first: bool,
    ) -> Result<Pending, String> {
        let saved = (self.picture.contents, self.picture.times, self.picture.own_size);
        (self.picture.contents, self.picture.times, self.picture.own_size) = (contents, None, size);
        let resolution = self.picture.size(self.picture.points(ctx, self.panels.picture), ctx.pixels_per_point());
        (self.picture.contents, self.picture.times, self.picture.own_size) = saved;
        let pending = self.draw_off_screen(ctx, canvas, contents, resolution, aspect, first);
        pending.map_err(|error| error.to_string())
    }

    /// Draws `contents` with (pixels, pixels per point) on `canvas`, with everything in a view of `aspect`; `new` if it has not drawn
    /// these contents before.
    fn draw_off_screen(
        &mut self,
        ctx: &egui::Context,
        canvas: &mut Canvas,
        contents: Contents,
        (size, scale): ([u32; 2], f32),
        aspect: f32,
        new: bool,
    ) -> Result<Pending, RenderError> {
        if new {
            // Panels, collapsing headers and scroll positions as in the window.
            let memory = ctx.memory(Clone::clone);
            canvas.ctx.memory_mut(|own| *own = memory);
            // Copying the memory overwrote fonts and zoom.
            canvas.ctx.set_fonts(theme::fonts());
            canvas.ctx.options_mut(|options| options.zoom_factor = 1.0);
            canvas.ctx.set_theme(ctx.theme());
            canvas.time = ctx.input(|input| input.time);
        }
        let saved = self.panels.clone();
        let scene = self.run.viewport.scene_area();
        self.run.viewport.freeze(Some(aspect));
        self.picture.drawn = Some(contents);
        // egui settles new layouts over a few passes.
        let mut output = Ok(egui::FullOutput::default());
        for _ in 0..if new { 3 } else { 1 } {
            output = canvas.pass(size, scale, |ui| self.show_contents(ui, contents));
            if output.is_err() {
                break;
            }
        }
        self.picture.drawn = None;
        self.run.viewport.freeze(None);
        self.run.viewport.set_scene_area(scene);
        self.panels = saved;
        Ok(canvas.paint(output?, size, scale))
    }

    fn show_contents(&mut self, ui: &mut Ui, contents: Contents) {
        if contents == Contents::Window {
            return self.show(ui);
        }
        if contents == Contents::Plots {
            let bar = theme::panel(ui);
            Panel::bottom("plots of a picture")
                .frame(bar.inner_margin(egui::Margin::symmetric(12, 8)))
                .exact_size(PLOTS_HEIGHT)
                .show(ui, |ui| self.run.plots.ui(ui, &self.run.player));
        }
        CentralPanel::no_frame().show(ui, |ui| self.picture(ui));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_larger_picture_is_sharper_and_a_small_view_gets_room_for_its_names() {
        let of = |times, own_size, points, screen| {
            let picture = Picture { times, own_size, ..Picture::default() };
            picture.size(points, screen)
        };
        let view = vec2(980.0, 470.0);
        assert_eq!(of(Some(1), [0, 0], view, 1.0), ([980, 470], 1.0));
        assert_eq!(of(Some(4), [0, 0], view, 1.0), ([3920, 1880], 4.0));
        assert_eq!(of(Some(2), [0, 0], view, 1.5), ([2940, 1410], 3.0));
        // Same relative size as in the view: just fits.
        assert_eq!(of(None, [1960, 2000], view, 1.0), ([1960, 2000], 2.0));
        // Type is never smaller than on the screen.
        assert_eq!(of(None, [490, 235], view, 1.0), ([490, 235], 1.0));
        let small = vec2(390.0, 150.0);
        assert_eq!(of(Some(1), [0, 0], small, 1.0), ([390, 150], 1.0));
        let (pixels, scale) = of(Some(4), [0, 0], small, 1.0);
        assert_eq!(pixels, [1560, 600]);
        assert!((pixels[1] as f32 / scale - MIN_EDGE).abs() < 0.1, "{scale}");
    }
}
