//! Which panels are shown, and the arrangement of the window.

use eframe::egui::{self, Rect, Ui};

use super::{Embedded, theme};

/// A window below this width or height is small, points.
const SMALL_WIDTH: f32 = 760.0;
const SMALL_HEIGHT: f32 = 480.0;

/// Arrangement of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrangement {
    /// Panels beside and below the picture.
    Large,
    /// Picture above, sheet below.
    Portrait,
    /// Picture on the left, sheet on the right.
    Landscape,
}

/// A panel; in a small window, content of its sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sheet {
    /// Parameters.
    Controls,
    /// Plots.
    Plots,
    /// Chaos bench, or what play costs.
    Bench,
    /// The lesson in progress.
    Lesson,
}

/// The panels shown, and what they are sized for.
#[derive(Clone)]
pub struct Panels {
    /// Whether controls, plots and bench are shown in a large window.
    pub controls: bool,
    pub plots: bool,
    pub bench: bool,
    /// Content of the sheet in a small window.
    pub sheet: Option<Sheet>,
    /// Whether the window is small.
    compact: bool,
    /// Whether touch input has ever occurred.
    touched: bool,
    /// Whether the controls are sized for touch; `None` before the first pass.
    fingers: Option<bool>,
    /// Panels of an embedded window; `None` for a stand-alone window.
    pub embedded: Option<Embedded>,
    /// Area of the 3D view, points.
    pub picture: Rect,
}

impl Panels {
    /// The panels of a new window.
    pub fn new(embedded: Option<Embedded>) -> Self {
        Self {
            controls: true,
            plots: true,
            bench: false,
            sheet: Some(Sheet::Controls),
            compact: false,
            touched: false,
            fingers: None,
            embedded,
            picture: Rect::ZERO,
        }
    }

    /// Whether the window is small.
    pub fn is_compact(&self) -> bool {
        self.compact
    }

    /// Whether touch input has ever occurred.
    pub fn is_touched(&self) -> bool {
        self.touched
    }

    /// Sizes the controls again in the next pass.
    pub fn forget_sizes(&mut self) {
        self.fingers = None;
    }

    /// Chooses the arrangement for the space in `ui`, and sizes the controls for mouse or touch.
    pub fn arrange(&mut self, ui: &mut Ui) -> Arrangement {
        let size = ui.available_size();
        let arrangement = if size.y < SMALL_HEIGHT || (size.x < SMALL_WIDTH && size.x > size.y) {
            Arrangement::Landscape
        } else if size.x < SMALL_WIDTH {
            Arrangement::Portrait
        } else {
            Arrangement::Large
        };
        self.compact = arrangement != Arrangement::Large;
        self.touched |= ui.input(|input| input.has_touch_screen());
        let fingers = self.compact || self.touched;
        if self.fingers != Some(fingers) {
            theme::apply_size(ui.ctx(), fingers);
            self.fingers = Some(fingers);
            // Applied in this pass, so that the picture is framed at its final size.
            ui.set_style(ui.ctx().global_style());
        }
        arrangement
    }

    /// Shows or hides `panel` as the arrangement demands: in the sheet or at its side.
    pub fn show(&mut self, panel: Sheet, on: bool) {
        match panel {
            _ if self.compact => self.sheet = on.then_some(panel),
            Sheet::Controls => self.controls = on,
            Sheet::Plots => self.plots = on,
            Sheet::Bench => self.bench = on,
            Sheet::Lesson => {}
        }
    }

    /// Shows `panel`, or hides it if it is shown.
    pub fn toggle(&mut self, panel: Sheet) {
        let is_shown = match panel {
            _ if self.compact => self.sheet == Some(panel),
            Sheet::Controls => self.controls,
            Sheet::Plots => self.plots,
            Sheet::Bench => self.bench,
            Sheet::Lesson => false,
        };
        self.show(panel, !is_shown);
    }

    /// Switches of the panels in the header of a large window.
    pub fn switches(&mut self, ui: &mut Ui) {
        let panels = [
            (&mut self.controls, "Controls", "Parameters shown or hidden (key C)"),
            (&mut self.plots, "Plots", "Plots shown or hidden (key P)"),
            (
                &mut self.bench,
                "Bench",
                "Bench shown or hidden: chaos bench (key B) with sweeps and twin run; what play costs (key W)",
            ),
        ];
        for (on, name, help) in panels {
            if ui.add(egui::Button::selectable(*on, name)).on_hover_text(help).clicked() {
                *on = !*on;
            }
        }
    }

    /// Tabs of the sheet; clicking the active tab collapses it. `backwards`: the layout runs from right to left.
    pub fn tabs(&mut self, ui: &mut Ui, in_lesson: bool, backwards: bool) {
        let mut tabs = vec![
            (Sheet::Controls, "Controls", "Parameters shown or hidden"),
            (Sheet::Plots, "Plots", "Plots shown or hidden"),
            (Sheet::Bench, "Bench", "Chaos bench and what play costs, shown or hidden"),
        ];
        if in_lesson {
            tabs.insert(0, (Sheet::Lesson, "Lesson", "Lesson shown or hidden"));
        }
        if backwards {
            tabs.reverse();
        }
        for (sheet, name, help) in tabs {
            let on = self.sheet == Some(sheet);
            if ui.add(egui::Button::selectable(on, name)).on_hover_text(help).clicked() {
                self.toggle(sheet);
            }
        }
    }
}
