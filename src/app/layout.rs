//! Layout: panels side by side in a large window; picture and a collapsible sheet in a small one.

use eframe::egui::{self, Align2, CentralPanel, Frame, Id, Panel, Popup, ScrollArea, Ui};

#[cfg(not(target_arch = "wasm32"))]
use super::audience;
use super::{App, overlay, present, spoken, theme, transport};
use crate::view::Preset;

/// A window below this width or height is small, points.
const SMALL_WIDTH: f32 = 760.0;
const SMALL_HEIGHT: f32 = 480.0;
/// Width below which time and buttons do not fit side by side in a picture, points.
const MIN_WIDTH_SIDE_BY_SIDE: f32 = 250.0;
/// Width below which an embedded picture shows only machine and time, points.
const MIN_WIDTH_WITH_CONTROLS: f32 = 280.0;
/// Width of a lesson panel beside the picture, points.
const LESSON_WIDTH: f32 = 340.0;

/// Key under which the height of the messages is stored.
const MESSAGES_KEY: &str = "height of the messages";

/// Arrangement of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Arrangement {
    /// Panels beside and below the picture.
    Large,
    /// Picture above, sheet below.
    Portrait,
    /// Picture on the left, sheet on the right.
    Landscape,
}

/// Content of a small window's sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// Makes scroll bars in `ui` visible at rest from here on: touch input does not hover.
pub(super) fn show_bar(ui: &mut Ui) {
    let bar = &mut ui.spacing_mut().scroll;
    bar.dormant_handle_opacity = 0.6;
    bar.floating_width = bar.bar_width;
}

/// The entries of a menu, scrollable on a low screen, with a visible scroll bar.
pub(super) fn entries(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    show_bar(ui);
    let bar = &mut ui.spacing_mut().scroll;
    bar.floating_allocated_width = bar.bar_width;
    // Leaves room for the frame and for a strip of the background.
    let most = ui.ctx().content_rect().height() - 48.0;
    ScrollArea::vertical()
        .max_height(most)
        // Otherwise the first height would persist when an entry later grows.
        .min_scrolled_height(most)
        .show(ui, add);
}

/// A menu. Opened by keyboard, it focuses its first entry; it closes when it loses the focus. `stays`: a click on an entry leaves
/// it open.
pub(super) fn menu(ui: &mut Ui, name: &str, stays: bool, add: impl FnOnce(&mut Ui)) -> egui::Response {
    use egui::containers::menu::{MenuButton, MenuConfig};
    let close =
        if stays { egui::PopupCloseBehavior::CloseOnClickOutside } else { egui::PopupCloseBehavior::CloseOnClick };
    let opened = ui.scope_id().with((name, "opened by keyboard"));
    // The entries exist in the pass after opening; the focus moves from the button to the first of them.
    if ui.data_mut(|data| data.remove_temp::<bool>(opened)).is_some() {
        ui.memory_mut(|memory| memory.move_focus(egui::FocusDirection::Next));
    }
    let button = MenuButton::new(name).config(MenuConfig::new().close_behavior(close));
    let (response, shown) = button.ui(ui, |ui| entries(ui, add));
    if shown.is_some() {
        if response.clicked() && response.has_focus() {
            ui.data_mut(|data| data.insert_temp(opened, true));
            ui.ctx().request_repaint();
        }
        let focused = ui.memory(egui::Memory::focused);
        // A widget focused when a click opened the menu, such as the last slider, may stay focused.
        let focus_key = response.id.with("focus when opened");
        if response.clicked() {
            ui.data_mut(|data| data.insert_temp(focus_key, focused));
        }
        let before = ui.data(|data| data.get_temp::<Option<Id>>(focus_key)).flatten();
        let elsewhere = focused
            .filter(|focused| *focused != response.id && Some(*focused) != before)
            .and_then(|focused| ui.ctx().read_response(focused))
            // Popups opened from a menu are also in the foreground.
            .is_some_and(|focused| focused.layer_id.order != egui::Order::Foreground);
        if elsewhere {
            Popup::close_id(ui.ctx(), Popup::default_response_id(&response));
        }
    }
    response
}

/// Closes the menu around `ui`, if any: entries may also be shown outside a menu.
pub(super) fn close_menu(ui: &Ui) {
    if egui::containers::menu::is_in_menu(ui) {
        ui.close();
    }
}

/// A menu entry with a tooltip, which closes the menu; returns whether it was clicked.
pub(super) fn entry(ui: &mut Ui, name: &str, help: &str) -> bool {
    let clicked = ui.button(name).on_hover_text(help).clicked();
    if clicked {
        close_menu(ui);
    }
    clicked
}

/// A combo box of `options` for `value`, with its accessible name and its tooltip, if any.
pub(super) fn choice<T: Copy + PartialEq, W: Into<egui::WidgetText>>(
    ui: &mut Ui,
    [name, help]: [&str; 2],
    width: Option<f32>,
    value: &mut T,
    options: impl IntoIterator<Item = T>,
    label: impl Fn(T) -> W,
) {
    let response = egui::ComboBox::from_id_salt(name)
        .width(width.unwrap_or(ui.spacing().combo_width))
        .selected_text(label(*value))
        .show_ui(ui, |ui| {
            for option in options {
                ui.selectable_value(value, option, label(option));
            }
        })
        .response;
    let response = if help.is_empty() { response } else { response.on_hover_text(help) };
    response.accessible_name(name);
}

/// Reserves `lines` lines of small text; longer content scrolls, and nothing below moves.
pub(super) fn reserve_lines(ui: &mut Ui, id: &str, lines: usize, add: impl FnOnce(&mut Ui)) {
    let line = ui.text_style_height(&egui::TextStyle::Small) + 2.0;
    let height = lines as f32 * line;
    let size = egui::vec2(ui.available_width(), height);
    let place = ui.allocate_exact_size(size, egui::Sense::hover()).0;
    let inside = egui::UiBuilder::new().max_rect(place).layout(egui::Layout::top_down(egui::Align::LEFT));
    ui.scope_builder(inside, |ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        ScrollArea::vertical().id_salt(id).max_height(height).min_scrolled_height(height).auto_shrink(false).show(
            ui,
            |ui| {
                // Space for the scroll bar.
                ui.set_max_width(ui.available_width() - 10.0);
                add(ui);
            },
        );
    });
}

/// Hint over the picture while a file hovers over the window.
fn drop_hint(ui: &Ui, area: egui::Rect) {
    if ui.input(|input| input.raw.hovered_files.is_empty()) {
        return;
    }
    let colour = ui.visuals().selection.stroke.color;
    let fill = ui.visuals().window_fill.gamma_multiply(0.85);
    let painter = ui.painter_at(area);
    painter.rect_filled(area, 0.0, fill);
    let edge = egui::Stroke::new(2.0, colour);
    painter.rect_stroke(area.shrink(8.0), 8.0, edge, egui::StrokeKind::Inside);
    let font = egui::TextStyle::Heading.resolve(ui.style());
    let place = egui::Align2::CENTER_CENTER;
    painter.text(area.center(), place, "Drop a scene file to open it", font, colour);
}

impl App {
    /// The whole interface, in the available space.
    pub fn show(&mut self, ui: &mut Ui) {
        let size = ui.available_size();
        let arrangement = if size.y < SMALL_HEIGHT || (size.x < SMALL_WIDTH && size.x > size.y) {
            Arrangement::Landscape
        } else if size.x < SMALL_WIDTH {
            Arrangement::Portrait
        } else {
            Arrangement::Large
        };
        let compact = arrangement != Arrangement::Large;
        self.compact = compact;
        self.touched |= ui.input(|input| input.has_touch_screen());
        let fingers = compact || self.touched;
        if self.fingers != Some(fingers) {
            theme::apply_size(ui.ctx(), fingers);
            self.fingers = Some(fingers);
            // Applied in this pass, so that the picture is framed at its final size.
            ui.set_style(ui.ctx().global_style());
        }
        self.summary(ui);
        // An embedded window shares its keys with the surrounding page.
        if self.embedded().is_none() {
            transport::set_first_tab_stop(ui);
        }
        if self.dialog.is_some() {
            // Disabling closes tooltips above the dialog; the dialog's backdrop does the dimming.
            ui.visuals_mut().disabled_alpha = 1.0;
            ui.disable();
        }
        if self.is_presenting() {
            self.presentation_ui(ui);
            return self.floating_elements(ui);
        }
        if self.embedded().is_some() {
            let bar = theme::panel(ui).inner_margin(egui::Margin::symmetric(8, 4));
            self.embedded_ui(ui, bar);
            return self.floating_elements(ui);
        }
        let margin = if arrangement == Arrangement::Landscape {
            egui::Margin::symmetric(12, 4)
        } else {
            egui::Margin::symmetric(12, 8)
        };
        let bar = theme::panel(ui).inner_margin(margin);
        Panel::top("header").frame(bar).show(ui, |ui| self.header(ui, compact));
        match arrangement {
            Arrangement::Large => self.side_by_side(ui, bar),
            Arrangement::Portrait => self.portrait(ui, bar),
            Arrangement::Landscape => self.landscape(ui, bar),
        }
        self.floating_elements(ui);
    }

    /// Elements above all panels.
    fn floating_elements(&mut self, ui: &Ui) {
        self.save_earlier_run();
        self.impact_list_ui(ui.ctx());
        self.ring_highlights(ui);
        self.dialog_ui(ui.ctx());
    }

    /// Lesson panel at the side of a wide window. A small window shows lessons in its sheet instead.
    pub(super) fn lesson_panel(&mut self, ui: &mut Ui, bar: Frame) {
        if self.course().is_none() {
            return;
        }
        let panel = if ui.available_width() > ui.available_height() {
            let width = LESSON_WIDTH.min(0.42 * ui.available_width());
            Panel::right("lesson").exact_size(width)
        } else {
            Panel::bottom("lesson").exact_size(0.42 * ui.available_height())
        };
        panel.frame(bar).resizable(false).show(ui, |ui| self.lesson_ui(ui));
    }

    fn side_by_side(&mut self, ui: &mut Ui, bar: Frame) {
        self.lesson_panel(ui, bar);
        let free = !self.is_under_way();
        let in_lesson = self.course().is_some();
        let Self {
            player,
            controls,
            plots,
            bench,
            timeline,
            viewport,
            show_controls,
            show_plots,
            show_bench,
            #[cfg(not(target_arch = "wasm32"))]
            audience,
            #[cfg(not(target_arch = "wasm32"))]
            single_plot,
            ..
        } = self;
        let mut present = false;
        Panel::left("controls").frame(bar).default_size(300.0).size_range(240.0..=480.0).show_collapsible(
            ui,
            show_controls,
            |ui| {
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    // Space for the scroll bar beside the fields.
                    ui.set_max_width(ui.available_width() - 10.0);
                    ui.spacing_mut().item_spacing.y = 5.0;
                    controls.title(ui, player);
                    ui.add_enabled_ui(free, |ui| controls.ui(ui, player));
                });
            },
        );
        let bench_request = Panel::right("bench")
            .frame(bar)
            .resizable(true)
            .default_size(400.0)
            .size_range(300.0..=640.0)
            .show_collapsible(ui, show_bench, |ui| {
                ScrollArea::vertical()
                    // A lesson has its own scroll position.
                    .id_salt(("bench", in_lesson))
                    .auto_shrink(false)
                    .show(ui, |ui| {
                        ui.set_max_width(ui.available_width() - 10.0);
                        ui.add_enabled_ui(free, |ui| bench.ui(ui, player)).inner
                    })
                    .inner
            });
        // Limits the plots so that the picture remains usable in a low window.
        let plots_height = (0.34 * ui.available_height()).clamp(150.0, 230.0);
        Panel::bottom("plots")
            .frame(bar)
            .resizable(true)
            .default_size(plots_height)
            .size_range(150.0..=600.0)
            .show_collapsible(ui, show_plots, |ui| {
                spoken::landmark(ui, "Plots");
                // Otherwise the panel would shrink to its content.
                ui.take_available_space();
                ui.horizontal(|ui| {
                    plots.header(ui, player);
                    #[cfg(not(target_arch = "wasm32"))]
                    if audience.is_some() {
                        audience::choose_plot(ui, &plots.titles(player), single_plot);
                    }
                });
                if let Some(time) = plots.ui(ui, player).filter(|_| free) {
                    player.go_to(time);
                    viewport.restore_marks(player);
                }
            });
        for (panel, name) in
            [("controls", "Width of the controls"), ("bench", "Width of the bench"), ("plots", "Height of the plots")]
        {
            spoken::splitter(ui, panel, name);
        }
        let reset = Panel::bottom("transport")
            .frame(bar)
            .show(ui, |ui| {
                present = present::double_tapped(ui);
                let contents = ui.add_enabled_ui(free, |ui| {
                    if timeline.ui(ui, player, viewport.focus()) {
                        viewport.restore_marks(player);
                    }
                    transport::ui(ui, player)
                });
                contents.inner
            })
            .inner;
        self.central(ui, reset);
        if present {
            self.present(ui.ctx(), true);
        }
        if let Some(request) = bench_request.and_then(|shown| shown.inner) {
            self.apply_bench_request(request);
        }
    }

    fn portrait(&mut self, ui: &mut Ui, bar: Frame) {
        if self.sheet.is_some() {
            // Fits a lesson question with its answers.
            let share = if self.sheet == Some(Sheet::Lesson) { 0.47 } else { 0.42 };
            let height = (ui.available_height() * share).max(160.0);
            Panel::bottom("sheet").frame(bar).exact_size(height).show(ui, |ui| self.sheet(ui));
        }
        let free = !self.is_under_way();
        let mut present = false;
        let reset = Panel::bottom("transport")
            .frame(bar)
            .show(ui, |ui| {
                present = present::double_tapped(ui);
                ui.add_enabled_ui(free, |ui| self.timeline_ui(ui));
                let reset = ui.add_enabled_ui(free, |ui| transport::row(ui, &mut self.player));
                ui.horizontal(|ui| {
                    self.sheet_tabs(ui, false);
                    let backwards = egui::Layout::right_to_left(egui::Align::Center);
                    ui.with_layout(backwards, |ui| transport::achieved_pace_below(ui, &self.player));
                });
                reset.inner
            })
            .inner;
        self.central(ui, reset);
        if present {
            self.present(ui.ctx(), true);
        }
    }

    fn landscape(&mut self, ui: &mut Ui, bar: Frame) {
        let free = !self.is_under_way();
        let mut present = false;
        let reset = Panel::bottom("transport")
            .frame(bar)
            .show(ui, |ui| {
                present = present::double_tapped(ui);
                ui.add_enabled_ui(free, |ui| self.timeline_ui(ui));
                ui.horizontal(|ui| {
                    let tabs = if self.course().is_some() { 350.0 } else { 270.0 };
                    // Tabs that would cover the buttons become a menu.
                    let folded = ui.available_width() < tabs + transport::MIN_WIDTH;
                    let tabs = if folded { 90.0 } else { tabs };
                    let room = ui.available_width() - tabs;
                    let reset = ui
                        .allocate_ui(egui::vec2(room, ui.spacing().interact_size.y), |ui| {
                            ui.add_enabled_ui(free, |ui| transport::row(ui, &mut self.player)).inner
                        })
                        .inner;
                    let backwards = egui::Layout::right_to_left(egui::Align::Center);
                    ui.with_layout(backwards, |ui| {
                        if folded {
                            menu(ui, "Panels", false, |ui| self.sheet_tabs(ui, false));
                        } else {
                            self.sheet_tabs(ui, true);
                        }
                    });
                    reset
                })
                .inner
            })
            .inner;
        if self.sheet.is_some() {
            let width = (ui.available_width() * 0.42).clamp(260.0, 340.0).min(0.55 * ui.available_width());
            Panel::right("sheet beside").frame(bar).resizable(false).exact_size(width).show(ui, |ui| self.sheet(ui));
        }
        self.central(ui, reset);
        if present {
            self.present(ui.ctx(), true);
        }
    }

    /// The picture in the remaining space. Resets the run if a panel (`reset`) or the picture requests it.
    pub(super) fn central(&mut self, ui: &mut Ui, reset: bool) {
        let picture = CentralPanel::no_frame().show(ui, |ui| self.picture(ui));
        if reset || picture.inner {
            self.reset();
        }
    }

    pub(super) fn timeline_ui(&mut self, ui: &mut Ui) {
        let focus = self.viewport.focus();
        if self.timeline.ui(ui, &mut self.player, focus) {
            self.viewport.restore_marks(&self.player);
        }
    }

    /// Tabs of the sheet; clicking the active tab collapses it. `backwards`: the layout runs from right to left.
    fn sheet_tabs(&mut self, ui: &mut Ui, backwards: bool) {
        let mut tabs = vec![
            (Sheet::Controls, "Controls", "Parameters shown or hidden"),
            (Sheet::Plots, "Plots", "Plots shown or hidden"),
            (Sheet::Bench, "Bench", "Chaos bench and what play costs, shown or hidden"),
        ];
        if self.course().is_some() {
            tabs.insert(0, (Sheet::Lesson, "Lesson", "Lesson shown or hidden"));
        }
        if backwards {
            tabs.reverse();
        }
        for (sheet, name, help) in tabs {
            let on = self.sheet == Some(sheet);
            let tab = egui::Button::selectable(on, name);
            if ui.add(tab).on_hover_text(help).clicked() {
                self.fold(sheet);
            }
        }
    }

    /// Shows `sheet`, or collapses it if it is open.
    pub(super) fn fold(&mut self, sheet: Sheet) {
        self.sheet = (self.sheet != Some(sheet)).then_some(sheet);
    }

    fn sheet(&mut self, ui: &mut Ui) {
        show_bar(ui);
        if self.sheet == Some(Sheet::Lesson) {
            return self.lesson_ui(ui);
        }
        let free = !self.is_under_way();
        let Self { player, controls, plots, bench, sheet, viewport, .. } = self;
        let mut bench_request = None;
        ScrollArea::vertical().id_salt("sheet").auto_shrink(false).show(ui, |ui| {
            // Space for the scroll bar.
            ui.set_max_width(ui.available_width() - 14.0);
            match sheet {
                Some(Sheet::Controls) => {
                    ui.add_enabled_ui(free, |ui| controls.ui(ui, player));
                }
                Some(Sheet::Plots) => {
                    spoken::landmark(ui, "Plots");
                    plots.header(ui, player);
                    let size = egui::vec2(ui.available_width(), 340.0);
                    let clicked_time = ui.allocate_ui(size, |ui| plots.ui(ui, player)).inner;
                    if let Some(time) = clicked_time.filter(|_| free) {
                        player.go_to(time);
                        viewport.restore_marks(player);
                    }
                }
                Some(Sheet::Bench) => {
                    bench_request = ui.add_enabled_ui(free, |ui| bench.ui(ui, player)).inner;
                }
                Some(Sheet::Lesson) | None => {}
            }
        });
        if let Some(request) = bench_request {
            self.apply_bench_request(request);
        }
    }

    /// The 3D view with its buttons and, after a stop, the reason. Returns whether the user asked for a reset.
    pub(super) fn picture(&mut self, ui: &mut Ui) -> bool {
        spoken::landmark(ui, "The machine");
        let plain = self.picture.hides_controls();
        if !plain {
            self.microscope_beside(ui);
        }
        let area = ui.available_rect_before_wrap();
        let whole = area;
        let area = self.picture_before(ui, area, plain);
        self.picture_rect = area;
        let presenting = self.is_presenting() || self.embedded().is_some();
        self.player.update_ghosts();
        let caption = self.caption_plate(ui, area, self.is_presenting());
        let mut above: Vec<_> = caption.iter().map(|(_, plate)| *plate).collect();
        let inner = area.shrink(10.0);
        let row = egui::vec2(inner.width(), ui.spacing().interact_size.y);
        let width = |name: &str| {
            let font = egui::TextStyle::Button.resolve(ui.style());
            let words = ui.painter().layout_no_wrap(name.to_owned(), font, egui::Color32::BLACK);
            words.size().x + 2.0 * ui.spacing().button_padding.x + ui.spacing().item_spacing.x
        };
        let options = width("View options");
        let cameras: f32 = Preset::ALL.into_iter().map(Preset::label).chain(["Fit"]).map(width).sum();
        // The time is to the left of the buttons.
        let gap = ui.spacing().item_spacing.x;
        let narrow = area.width() < overlay::time_extent(ui.painter()) + cameras + options - gap + 10.0;
        // Beside the microscope on a phone, the time needs the full upper edge.
        let edge = if area.width() < MIN_WIDTH_SIDE_BY_SIDE { Align2::RIGHT_BOTTOM } else { Align2::RIGHT_TOP };
        if !plain && !presenting {
            let size = egui::vec2(if narrow { options } else { options + cameras }, row.y);
            above.push(edge.align_size_within_rect(size, inner));
        }
        if !plain && self.has_messages() {
            above.push(self.messages_area(ui, inner));
        }
        let mut place = ui.new_child(egui::UiBuilder::new().max_rect(area));
        self.viewport.bare = self.embedded().is_some() && area.width() < MIN_WIDTH_WITH_CONTROLS;
        self.viewport.ui(&mut place, &self.player, plain, &above);
        ui.advance_cursor_after_rect(whole);
        if let Some(joint) = self.viewport.take_clicked() {
            self.focus(joint);
            self.microscope.set_open(true);
            ui.request_repaint();
        }
        if let Some(pull) = self.viewport.take_pull()
            && !self.is_under_way()
            && let Err(error) = self.player.pull(pull)
        {
            self.problem = Some(error.to_string());
        }
        if plain {
            // A saved picture has no buttons.
            return false;
        }
        let backwards = egui::Layout::right_to_left(egui::Align::Center);
        let buttons = egui::UiBuilder::new().max_rect(edge.align_size_within_rect(row, inner)).layout(backwards);
        ui.scope_builder(buttons, |ui| {
            if presenting {
                return;
            }
            menu(ui, "View options", false, |ui| {
                ui.set_min_width(230.0);
                if narrow {
                    ui.horizontal_wrapped(|ui| self.viewport.camera_buttons(ui, false));
                    ui.separator();
                }
                self.instruments(ui);
                ui.add_space(4.0);
                self.viewport.options_ui(ui);
            });
            if !narrow {
                ui.with_layout(backwards, |ui| self.viewport.camera_buttons(ui, true));
            }
        });
        self.caption(ui, area, caption);
        drop_hint(ui, whole);
        let messages = self.messages(ui, whole.shrink(10.0));
        self.notice_plate(ui, messages);
        let middle = egui::UiBuilder::new().max_rect(inner.shrink2(egui::vec2(0.0, 44.0)));
        ui.scope_builder(middle, |ui| transport::banner(ui, &self.player)).inner
    }

    /// Area of the messages at the lower edge of `area`.
    fn messages_area(&self, ui: &Ui, area: egui::Rect) -> egui::Rect {
        // Height in the previous frame; initially one line with a button.
        let height = ui.data(|data| data.get_temp(Id::unique(MESSAGES_KEY)));
        let height = height.unwrap_or(ui.spacing().interact_size.y + 16.0);
        Align2::CENTER_BOTTOM.align_size_within_rect(egui::vec2(area.width().min(640.0), height), area)
    }

    /// Messages over the lower edge of the picture; they appear and disappear without affecting the layout. Returns the free part
    /// of `area`.
    fn messages(&mut self, ui: &mut Ui, area: egui::Rect) -> egui::Rect {
        let id = Id::unique(MESSAGES_KEY);
        if !self.has_messages() {
            ui.data_mut(|data| data.remove_temp::<f32>(id));
            return area;
        }
        let row = ui.spacing().interact_size.y;
        let most = if self.is_refused() {
            // Hides the picture, which does not show what the link promised.
            let fill = ui.visuals().panel_fill;
            ui.painter().rect_filled(area.expand(10.0), 0.0, fill);
            area.height()
        } else {
            (area.height() - row - 8.0).max(60.0)
        };
        let place = self.messages_area(ui, area);
        let shown = ui.scope_builder(egui::UiBuilder::new().max_rect(place), |ui| {
            ScrollArea::vertical()
                .id_salt("messages")
                .max_height(most)
                .min_scrolled_height(most)
                .show(ui, |ui| self.strips(ui));
        });
        let now = shown.response.rect.height();
        if now != place.height() {
            ui.data_mut(|data| data.insert_temp(id, now));
            ui.ctx().request_repaint();
        }
        area.with_max_y(place.top() - 8.0)
    }

    /// A notice displayed for a few seconds.
    fn notice_plate(&mut self, ui: &Ui, area: egui::Rect) {
        let now = ui.input(|input| input.time);
        let Some(notice) = &mut self.notice else {
            return;
        };
        let left = notice.remaining_time(now);
        if left <= 0.0 {
            self.notice = None;
            return;
        }
        ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(left));
        let font = egui::TextStyle::Body.resolve(ui.style());
        let colour = ui.visuals().text_color();
        let width = (area.width() - 24.0).max(40.0);
        let words = ui.painter().layout(notice.text.clone(), font, colour, width);
        let above = egui::vec2(0.0, ui.spacing().interact_size.y + 8.0);
        let place = egui::Align2::CENTER_BOTTOM.align_size_within_rect(words.size(), area.translate(-above));
        let fill = ui.visuals().window_fill.gamma_multiply(0.92);
        ui.painter().rect_filled(place.expand2(egui::vec2(10.0, 5.0)), 6.0, fill);
        ui.painter().galley(place.min, words, colour);
    }
}
