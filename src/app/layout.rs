//! Layout: panels side by side in a large window; picture and a collapsible sheet in a small one.

use eframe::egui::{self, Align2, CentralPanel, Frame, Id, Panel, Popup, Rangef, ScrollArea, Ui};

#[cfg(not(target_arch = "wasm32"))]
use super::audience;
use super::command::Command;
use super::files::record_files;
use super::header::Header;
use super::keys::Action;
use super::messages::{Messages, Surroundings};
use super::overlay::Room;
use super::panels::{Arrangement, Sheet};
#[cfg(not(target_arch = "wasm32"))]
use super::remembered::Store;
use super::{App, overlay, present, spoken, theme, touch, transport};
use crate::view::Preset;

/// Width below which time and buttons do not fit side by side in a picture, points.
const MIN_WIDTH_SIDE_BY_SIDE: f32 = 250.0;
/// Width below which an embedded picture shows only machine and time, points.
const MIN_WIDTH_WITH_CONTROLS: f32 = 280.0;
/// Least and largest width of the controls and of the bench, and height of the plots, points.
const PANEL_SIZES: [[f32; 2]; 3] = [[240.0, 480.0], [300.0, 640.0], [150.0, 600.0]];
/// Distance of buttons and messages from the edge of the picture, points.
const MARGIN: f32 = 10.0;
/// Width of a lesson panel beside the picture, points.
const LESSON_WIDTH: f32 = 340.0;

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

/// Labels and options in a menu, which begin where the names of its entries do.
pub(super) fn aligned<R>(ui: &mut Ui, add: impl FnOnce(&mut Ui) -> R) -> R {
    let left = ui.spacing().button_padding.x as i8;
    Frame::new().inner_margin(egui::Margin { left, ..egui::Margin::ZERO }).show(ui, add).inner
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
        let arrangement = self.panels.arrange(ui);
        self.messages.summary(ui);
        // An embedded window shares its keys with the surrounding page.
        if self.panels.embedded.is_none() {
            transport::set_first_tab_stop(ui);
        }
        if self.dialog.is_some() {
            // Disabling closes tooltips above the dialog; the dialog's backdrop does the dimming.
            ui.visuals_mut().disabled_alpha = 1.0;
            ui.disable();
        }
        if self.visit.is_some() {
            self.visit_ui(ui);
            return self.floating_elements(ui);
        }
        if self.is_presenting() {
            self.presentation_ui(ui);
            return self.floating_elements(ui);
        }
        if self.panels.embedded.is_some() {
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
        Panel::top("header").frame(bar).show(ui, |ui| self.header(ui));
        match arrangement {
            Arrangement::Large => self.side_by_side(ui, bar),
            Arrangement::Portrait => self.portrait(ui, bar),
            Arrangement::Landscape => self.landscape(ui, bar),
        }
        self.floating_elements(ui);
    }

    /// The header; its commands are carried out before the panels below are shown.
    fn header(&mut self, ui: &mut Ui) {
        let has_page = !self.page_address().is_empty();
        let mut header = Header {
            run: &self.run,
            is_busy: self.tasks.are_under_way(),
            panels: &mut self.panels,
            picture: &mut self.picture,
            graphics: &mut self.graphics,
            has_page,
            #[cfg(not(target_arch = "wasm32"))]
            recent: self.store.as_ref().map(Store::recent),
            #[cfg(not(target_arch = "wasm32"))]
            has_audience: self.presentation.audience.is_some(),
            has_lessons_button: false,
            commands: Vec::new(),
        };
        header.ui(ui);
        let commands = header.commands;
        self.perform_all(ui.ctx(), commands);
    }

    /// Elements above all panels.
    fn floating_elements(&mut self, ui: &Ui) {
        if let Some(earlier) = self.run.plots.comparison.take_run_to_save() {
            let files = record_files(earlier.run());
            self.save(files);
        }
        self.course.ring_highlights(ui, &self.run);
        self.dialog_ui(ui.ctx());
    }

    /// Lesson panel at the side of a wide window. A small window shows lessons in its sheet instead.
    pub(super) fn lesson_panel(&mut self, ui: &mut Ui, bar: Frame) {
        if !self.course.is_running() {
            return;
        }
        // In a presentation the machine has two thirds of the screen.
        let share = if self.is_presenting() { 1.0 / 3.0 } else { 0.42 };
        let panel = if ui.available_width() > ui.available_height() {
            let width = LESSON_WIDTH.min(share * ui.available_width());
            Panel::right("lesson").exact_size(width)
        } else {
            Panel::bottom("lesson").exact_size(share * ui.available_height())
        };
        panel.frame(bar).resizable(false).show(ui, |ui| self.lesson_ui(ui));
    }

    fn side_by_side(&mut self, ui: &mut Ui, bar: Frame) {
        self.lesson_panel(ui, bar);
        let free = !self.tasks.are_under_way();
        let in_lesson = self.course.is_running();
        let Self { run, bench, panels, .. } = self;
        #[cfg(not(target_arch = "wasm32"))]
        let presentation = &mut self.presentation;
        let mut present = false;
        let [controls, side, below] = PANEL_SIZES.map(|[least, most]| Rangef::new(least, most));
        panels.keep_shares(ui, [("controls", false, controls), ("bench", false, side), ("plots", true, below)]);
        Panel::left("controls").frame(bar).default_size(300.0).size_range(controls).show_collapsible(
            ui,
            &mut panels.controls,
            |ui| {
                touch::pinch_enlarges(ui, ui.max_rect());
                ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                    // Space for the scroll bar beside the fields.
                    ui.set_max_width(ui.available_width() - 10.0);
                    ui.spacing_mut().item_spacing.y = 5.0;
                    run.controls.title(ui, &run.player);
                    ui.add_enabled_ui(free, |ui| run.controls.ui(ui, &mut run.player));
                });
            },
        );
        let command = Panel::right("bench")
            .frame(bar)
            .resizable(true)
            .default_size(400.0)
            .size_range(side)
            .show_collapsible(ui, &mut panels.bench, |ui| {
                ScrollArea::vertical()
                    // A lesson has its own scroll position.
                    .id_salt(("bench", in_lesson))
                    .auto_shrink(false)
                    .show(ui, |ui| {
                        ui.set_max_width(ui.available_width() - 10.0);
                        ui.add_enabled_ui(free, |ui| bench.ui(ui, &mut run.player)).inner
                    })
                    .inner
            });
        // Limits the plots so that the picture remains usable in a low window.
        let plots_height = (0.34 * ui.available_height()).clamp(150.0, 230.0);
        Panel::bottom("plots")
            .frame(bar)
            .resizable(true)
            .default_size(plots_height)
            .size_range(below)
            .show_collapsible(ui, &mut panels.plots, |ui| {
                spoken::landmark(ui, "Plots");
                // Otherwise the panel would shrink to its content.
                ui.take_available_space();
                ui.horizontal(|ui| {
                    run.plots.header(ui, &run.player);
                    #[cfg(not(target_arch = "wasm32"))]
                    if presentation.audience.is_some() {
                        audience::choose_plot(ui, &run.plots.titles(&run.player), &mut presentation.plot);
                    }
                });
                run.plots_ui(ui, None, free);
            });
        for (panel, name) in
            [("controls", "Width of the controls"), ("bench", "Width of the bench"), ("plots", "Height of the plots")]
        {
            spoken::splitter(ui, panel, name);
        }
        let asked = Panel::bottom("transport")
            .frame(bar)
            .show(ui, |ui| {
                present = present::double_tapped(ui);
                let contents = ui.add_enabled_ui(free, |ui| {
                    run.timeline_ui(ui);
                    transport::ui(ui, &mut run.player)
                });
                contents.inner
            })
            .inner;
        self.central(ui, asked);
        if present {
            self.present(ui.ctx(), true);
        }
        self.perform_all(ui.ctx(), command.and_then(|shown| shown.inner));
    }

    fn portrait(&mut self, ui: &mut Ui, bar: Frame) {
        if self.panels.sheet.is_some() {
            // Fits a lesson question with its answers.
            let share = if self.panels.sheet == Some(Sheet::Lesson) { 0.47 } else { 0.42 };
            let height = (ui.available_height() * share).max(160.0);
            Panel::bottom("sheet").frame(bar).exact_size(height).show(ui, |ui| self.sheet(ui));
        }
        let free = !self.tasks.are_under_way();
        let mut present = false;
        let asked = Panel::bottom("transport")
            .frame(bar)
            .show(ui, |ui| {
                present = present::double_tapped(ui);
                ui.add_enabled_ui(free, |ui| self.run.timeline_ui(ui));
                let asked = ui.add_enabled_ui(free, |ui| transport::row(ui, &mut self.run.player, false));
                ui.horizontal(|ui| {
                    self.panels.tabs(ui, self.course.is_running(), false);
                    let backwards = egui::Layout::right_to_left(egui::Align::Center);
                    ui.with_layout(backwards, |ui| transport::limit_below(ui, &self.run.player));
                });
                asked.inner
            })
            .inner;
        self.central(ui, asked);
        if present {
            self.present(ui.ctx(), true);
        }
    }

    fn landscape(&mut self, ui: &mut Ui, bar: Frame) {
        let free = !self.tasks.are_under_way();
        let mut present = false;
        let asked = Panel::bottom("transport")
            .frame(bar)
            .show(ui, |ui| {
                present = present::double_tapped(ui);
                ui.add_enabled_ui(free, |ui| self.run.timeline_ui(ui));
                ui.horizontal(|ui| {
                    let tabs = if self.course.is_running() { 350.0 } else { 270.0 };
                    // Tabs that would cover the buttons become a menu.
                    let folded = ui.available_width() < tabs + transport::MIN_WIDTH;
                    let tabs = if folded { 90.0 } else { tabs };
                    let room = ui.available_width() - tabs;
                    let asked = ui
                        .allocate_ui(egui::vec2(room, ui.spacing().interact_size.y), |ui| {
                            ui.add_enabled_ui(free, |ui| transport::row(ui, &mut self.run.player, true)).inner
                        })
                        .inner;
                    let backwards = egui::Layout::right_to_left(egui::Align::Center);
                    ui.with_layout(backwards, |ui| {
                        if folded {
                            menu(ui, "Panels", false, |ui| self.panels.tabs(ui, self.course.is_running(), false));
                        } else {
                            self.panels.tabs(ui, self.course.is_running(), true);
                        }
                    });
                    asked
                })
                .inner
            })
            .inner;
        if self.panels.sheet.is_some() {
            // Leaves sliders tracks of 120 points, if the picture can spare the width.
            let width = (ui.available_width() * 0.42).clamp(310.0, 340.0).min(0.55 * ui.available_width());
            Panel::right("sheet beside").frame(bar).resizable(false).exact_size(width).show(ui, |ui| self.sheet(ui));
        }
        self.central(ui, asked);
        if present {
            self.present(ui.ctx(), true);
        }
    }

    /// The picture in the remaining space. Carries out what the transport bar `asked` for, and restarts the run if the controls
    /// request it.
    pub(super) fn central(&mut self, ui: &mut Ui, asked: Option<Action>) {
        if self.run.impact_list_ui(ui, !self.tasks.are_under_way()) {
            self.perform(ui.ctx(), Command::SaveImpacts);
        }
        CentralPanel::no_frame().show(ui, |ui| self.picture(ui));
        let restart = self.run.controls.take_restart();
        if let Some(action) = asked.or(restart.then_some(Action::Reset)) {
            self.perform_action(ui.ctx(), action);
        }
    }

    fn sheet(&mut self, ui: &mut Ui) {
        show_bar(ui);
        if self.panels.sheet != Some(Sheet::Plots) {
            touch::pinch_enlarges(ui, ui.max_rect());
        }
        if self.panels.sheet == Some(Sheet::Lesson) {
            return self.lesson_ui(ui);
        }
        let free = !self.tasks.are_under_way();
        let Self { run, bench, panels, .. } = self;
        let mut command = None;
        // Each content keeps its scroll position.
        ScrollArea::vertical().id_salt(("sheet", panels.sheet)).auto_shrink(false).show(ui, |ui| {
            // Space for the scroll bar.
            ui.set_max_width(ui.available_width() - 14.0);
            match panels.sheet {
                Some(Sheet::Controls) => {
                    ui.add_enabled_ui(free, |ui| run.controls.ui(ui, &mut run.player));
                }
                Some(Sheet::Plots) => {
                    spoken::landmark(ui, "Plots");
                    run.plots.header(ui, &run.player);
                    let size = egui::vec2(ui.available_width(), 340.0);
                    ui.allocate_ui(size, |ui| run.plots_ui(ui, None, free));
                }
                Some(Sheet::Bench) => {
                    command = ui.add_enabled_ui(free, |ui| bench.ui(ui, &mut run.player)).inner;
                }
                Some(Sheet::Lesson) | None => {}
            }
        });
        self.perform_all(ui.ctx(), command);
    }

    /// The 3D view with its buttons, and the messages below it.
    pub(super) fn picture(&mut self, ui: &mut Ui) {
        spoken::landmark(ui, "The machine");
        let plain = self.picture.hides_controls();
        if !plain {
            self.run.microscope_beside(ui);
        }
        let whole = ui.available_rect_before_wrap();
        let halves = self.run.halves(whole);
        let area = halves.map_or(whole, |[_, now]| now);
        self.panels.picture = area;
        let presenting = self.is_presenting() || self.panels.embedded.is_some();
        self.run.player.update_ghosts();
        let width = |name: &str| {
            let font = egui::TextStyle::Button.resolve(ui.style());
            let words = ui.painter().layout_no_wrap(name.to_owned(), font, egui::Color32::BLACK);
            words.size().x + 2.0 * ui.spacing().button_padding.x + ui.spacing().item_spacing.x
        };
        let options = width("View options");
        let cameras: f32 = Preset::ALL.into_iter().map(Preset::label).chain(["Fit"]).map(width).sum();
        let narrow = area.width() < overlay::NOTES_WIDTH + cameras + options;
        let row = ui.spacing().interact_size.y;
        let buttons = egui::vec2(if narrow { options } else { options + cameras } + MARGIN, row);
        let has_buttons = !plain && !presenting;
        // Beside the microscope on a phone, the time needs the full upper edge.
        let below = has_buttons && area.width() < MIN_WIDTH_SIDE_BY_SIDE;
        let around = if self.panels.embedded.is_some() {
            Surroundings::Page
        } else if self.course.is_running() || self.is_presenting() {
            Surroundings::Lecture
        } else {
            Surroundings::Window
        };
        let has_messages = !plain && self.messages.are_shown(&self.run.player, &self.tasks, around);
        let has_caption = self.is_presenting() || (overlay::fits_labels(area) && !plain);
        let mut room = Room::default();
        if has_caption {
            room.words = present::CAPTION_HEIGHT;
        }
        if below {
            (room.words, room.is_wide) = (room.words.max(row), true);
        } else if has_buttons {
            room.buttons = buttons;
        }
        if has_messages {
            room.words = room.words.max(Messages::height(ui));
            room.is_wide |= self.messages.have_buttons(&self.run.player, &self.tasks, around);
        }
        // The transport of a large window shows it.
        self.run.viewport.hides_time = has_buttons && !self.panels.is_compact();
        self.run.picture_before(ui, halves.map(|[before, _]| before), plain, room);
        let viewport = &mut self.run.viewport;
        viewport.bare = self.panels.embedded.is_some() && area.width() < MIN_WIDTH_WITH_CONTROLS;
        let mut place = ui.new_child(egui::UiBuilder::new().max_rect(area));
        let strips = viewport.ui(&mut place, &self.run.player, plain, room);
        self.run.follow_names(ui.ctx());
        ui.advance_cursor_after_rect(whole);
        if let Some((joint, twice)) = self.run.viewport.take_clicked() {
            if twice {
                self.run.perform(Action::CloseUp(joint));
            } else {
                self.run.focus(joint);
            }
            self.run.microscope.set_open(true);
            ui.request_repaint();
        }
        if let Some(pull) = self.run.viewport.take_pull()
            && !self.tasks.are_under_way()
        {
            self.messages.warn(self.run.player.pull(pull));
        }
        if plain {
            // A saved picture has no buttons.
            return;
        }
        if has_buttons && !(below && has_messages) {
            let inside = if below { strips.words } else { strips.top };
            let backwards = egui::Layout::right_to_left(egui::Align::Center);
            let place =
                Align2::RIGHT_CENTER.align_size_within_rect(buttons, inside.with_max_x(inside.right() - MARGIN));
            let place = egui::UiBuilder::new().max_rect(place).layout(backwards);
            if let Some(action) = ui.scope_builder(place, |ui| self.picture_buttons(ui, narrow)).inner {
                self.perform_action(ui.ctx(), action);
            }
        }
        let caption = if has_caption && !has_messages {
            self.run.caption(ui, strips.words, self.is_presenting(), self.tasks.filming().is_some())
        } else {
            None
        };
        if let Some(caption) = caption {
            caption.ui(ui);
        } else if !has_messages && around != Surroundings::Lecture && overlay::fits_labels(area) {
            // A caption answers a question, and takes the place of the sentence that the scene opens with.
            let taken = if below && has_buttons { buttons.x } else { 0.0 };
            let place = strips.sentence();
            self.hint.ui(ui, place.with_max_x(place.right() - taken));
        }
        drop_hint(ui, whole);
        let refused = self.messages.is_refused(&self.run.player);
        let inside = if refused { whole.shrink(MARGIN) } else { strips.words };
        let command = self.messages.ui(ui, inside, &self.run.player, &self.tasks, around);
        self.perform_all(ui.ctx(), command);
    }

    /// Buttons in the strip above the picture, from right to left; in a `narrow` one only the menu. Returns the action chosen in it.
    fn picture_buttons(&mut self, ui: &mut Ui, narrow: bool) -> Option<Action> {
        let mut action = None;
        menu(ui, "View options", false, |ui| {
            ui.set_min_width(230.0);
            if narrow {
                ui.horizontal_wrapped(|ui| self.run.viewport.camera_buttons(ui, false));
                ui.separator();
            }
            if entry(ui, "Present", "Picture and transport for a class: large type, thick arrows (F5)") {
                action = Some(Action::Present);
            }
            action = action.or(self.run.undo.camera_buttons(ui));
            aligned(ui, |ui| {
                action = action.or(self.run.instruments(ui, self.sound.is_on()));
                ui.add_space(4.0);
                self.run.viewport.options_ui(ui);
            });
        });
        if !narrow {
            self.run.viewport.camera_buttons(ui, true);
        }
        action
    }
}
