//! The window embedded in another page: the picture with a transport bar, and the panels requested by its link.

use eframe::egui::{self, Frame, Panel, ScrollArea, Ui};

use super::{App, spoken, transport};
use crate::session::embedded::{Embedded, Part};

/// Width of the controls beside the picture, points.
const CONTROLS_WIDTH: f32 = 250.0;
/// Least width that leaves a slider a track of 120 points.
const MIN_CONTROLS_WIDTH: f32 = 160.0;
/// Height of the plots, and of the controls below the picture, as shares of the window's.
const PLOTS_FRACTION: f32 = 0.34;
const CONTROLS_FRACTION: f32 = 0.4;
/// Size of the frame that [`App::embedding`] writes, CSS pixels.
const FRAME_SIZE: [u32; 2] = [800, 500];

impl App {
    /// The complete interface of an embedded window.
    pub(super) fn embedded_ui(&mut self, ui: &mut Ui, bar: Frame) {
        let Some(panels) = self.panels.embedded.clone() else {
            return;
        };
        self.lesson_panel(ui, bar);
        let free = !self.tasks.are_under_way();
        let wide = ui.available_width() > ui.available_height();
        let reset = Panel::bottom("transport")
            .frame(bar)
            .show(ui, |ui| {
                spoken::landmark(ui, "Transport");
                if panels.contains(Part::Timeline) {
                    ui.add_enabled_ui(free, |ui| self.run.timeline_ui(ui));
                }
                ui.add_enabled_ui(free, |ui| transport::row(ui, &mut self.run.player, true)).inner
            })
            .inner;
        if panels.contains(Part::Controls) {
            let panel = if wide {
                let width = CONTROLS_WIDTH.min((0.45 * ui.available_width()).max(MIN_CONTROLS_WIDTH));
                Panel::left("controls").exact_size(width)
            } else {
                Panel::bottom("controls below").exact_size(CONTROLS_FRACTION * ui.available_height())
            };
            panel.frame(bar).resizable(false).show(ui, |ui| {
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    ui.set_max_width(ui.available_width() - 10.0);
                    ui.add_enabled_ui(free, |ui| self.run.controls.main_controls(ui, &mut self.run.player));
                });
            });
        }
        if panels.contains(Part::Bench) {
            let panel = Panel::right("bench").exact_size(0.45 * ui.available_width());
            let command = panel.frame(bar).resizable(false).show(ui, |ui| {
                ScrollArea::vertical()
                    .id_salt("bench")
                    .auto_shrink(false)
                    .show(ui, |ui| {
                        ui.set_max_width(ui.available_width() - 10.0);
                        let bench = |ui: &mut Ui| self.bench.ui(ui, &mut self.run.player);
                        ui.add_enabled_ui(free, bench).inner
                    })
                    .inner
            });
            self.perform_all(ui.ctx(), command.inner);
        }
        if panels.contains(Part::Plots) {
            let panel = Panel::bottom("plots").exact_size(PLOTS_FRACTION * ui.available_height());
            let clicked_time = panel.frame(bar).resizable(false).show(ui, |ui| {
                ui.take_available_space();
                self.run.plots.ui(ui, &self.run.player)
            });
            if let Some(time) = clicked_time.inner.filter(|_| free) {
                self.run.player.go_to(time);
                self.run.viewport.clear_history(&self.run.player);
            }
        }
        self.central(ui, reset);
    }

    /// An HTML line that embeds this state in another page, with the three most important controls.
    ///
    /// # Errors
    /// A message: there is no page, or the state does not fit in a link.
    pub fn embedding(&self) -> Result<String, String> {
        let address = self.page_address();
        if address.is_empty() {
            let why = "No page address is set for the frame; set one with --page or JOINTPLAY_PAGE";
            return Err(why.to_owned());
        }
        let panels = self.panels.embedded.clone();
        let mut link = self.link();
        link.embedded = Some(panels.unwrap_or_else(Embedded::with_controls));
        let (fragment, _) = link.format_short(self.run.player.pending())?;
        let escaped = |text: &str| {
            let text = text.replace('&', "&amp;").replace('"', "&quot;");
            text.replace('<', "&lt;")
        };
        let [width, height] = FRAME_SIZE;
        Ok(format!(
            "<iframe src=\"{}\" width=\"{width}\" height=\"{height}\" style=\"border: 0\" loading=\"lazy\" \
             allow=\"fullscreen; clipboard-write\" title=\"{}\"></iframe>",
            escaped(&format!("{address}#{fragment}")),
            escaped(&self.run.player.running().title)
        ))
    }

    /// Copies [`Self::embedding`].
    pub(super) fn copy_embedding(&mut self, ctx: &egui::Context) {
        match self.embedding() {
            Ok(line) => {
                ctx.copy_text(line);
                self.messages.notify("HTML line copied");
            }
            Err(reason) => self.messages.fail(reason),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panel_words_are_read_and_written() {
        for words in ["", "controls", "controls,timeline,plots,bench"] {
            assert_eq!(Embedded::read(words).expect("read").write(), words);
        }
        assert_eq!(Embedded::read("plots controls").expect("read").write(), "controls,plots");
        let error = Embedded::read("slider").expect_err("no panel");
        assert!(error.contains("`slider`") && error.contains("controls"), "{error}");
    }
}
