//! Which panels are shown, and the arrangement of the window.

use eframe::egui::containers::panel::PanelState;
use eframe::egui::{self, Rangef, Rect, Ui, Vec2, vec2};

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
    /// Experiments: order or chaos, or what play costs.
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
    /// Shares of the window that the panels of a large one have, by name, and the size that they refer to, points.
    shares: Vec<(&'static str, f32)>,
    shared: Vec2,
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
            shares: Vec::new(),
            shared: Vec2::ZERO,
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

    /// Lets the resizable panels of a large window keep their shares when its size changes: (name, whether its height
    /// counts, allowed sizes).
    pub fn keep_shares(&mut self, ui: &Ui, panels: [(&'static str, bool, Rangef); 3]) {
        let size = ui.ctx().content_rect().size();
        for (name, is_height, range) in panels {
            let id = ui.scope_id().with(name);
            let Some(mut state) = PanelState::load(ui.ctx(), id) else {
                continue;
            };
            let along = |size: Vec2| if is_height { size.y } else { size.x };
            let known = self.shares.iter_mut().find(|(known, _)| *known == name);
            match known {
                Some((_, share)) if size != self.shared => {
                    let side = range.clamp(*share * along(size));
                    let wanted = if is_height { vec2(state.size().x, side) } else { vec2(side, state.size().y) };
                    state.outer_rect = Rect::from_min_size(state.outer_rect.min, wanted);
                    ui.data_mut(|data| data.insert_persisted(id, state));
                }
                Some((_, share)) => {
                    // Within its range the panel has the share it was given; the user may have moved its edge.
                    let side = range.clamp(*share * along(size));
                    if (along(state.size()) - side).abs() > 0.5 {
                        *share = along(state.size()) / along(size);
                    }
                }
                None => self.shares.push((name, along(state.size()) / along(size))),
            }
        }
        self.shared = size;
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
                "Experiments",
                "Experiments shown or hidden: order or chaos (key B) with sweeps and a twin; what play costs (key W)",
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
            (Sheet::Bench, "Experiments", "Order or chaos, and what play costs, shown or hidden"),
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
