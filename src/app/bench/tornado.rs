//! Tornado of a study: for each input, two bars from the output with the scene's values to those at its ends. A click on a bar
//! selects the end.

use eframe::egui::{
    Align2, CursorIcon, Id, Rect, RichText, Role, Sense, Stroke, StrokeKind, TextStyle, TextWrapMode, Ui, WidgetInfo,
    WidgetText, pos2, vec2,
};
use egui_plot::GridInput;

use super::cost_study::{CostStudy, joint_of};
use crate::analysis::study::NAMED;
use crate::app::player::Player;
use crate::app::{plots, theme, value};
use crate::scene::Value;
use crate::units::{from_display, to_display};

/// Height of a bar with its texts, for a mouse and for touch, points.
const BAR_HEIGHTS: (f32, f32) = (18.0, 30.0);
/// Gap between two inputs, and between two columns, points.
const GAP: f32 = 8.0;
/// Margin of a bar above and below, points.
const MARGIN: f32 = 2.0;
/// Largest part of the width for the names.
const MAX_NAMES_FRACTION: f32 = 0.3;
/// Opacity of the bars of an earlier setting.
const PALE_OPACITY: f32 = 0.45;
/// Length of a mark on the axis, least distance of two, points, and their approximate number.
const MARK: f32 = 4.0;
const MIN_MARK_DISTANCE: f32 = 44.0;
const MAX_MARKS: f64 = 4.0;
/// Digits of a displayed value.
const DIGITS: usize = 4;

/// Rows of the drawing.
#[derive(Default)]
pub struct Tornado {
    /// Inputs from top to bottom.
    order: Vec<usize>,
    /// The output by which they are sorted.
    sorted: Option<usize>,
    /// Position of the last drawing, points.
    area: Option<Rect>,
}

/// An end of an input.
struct End {
    /// Displayed values of the input and of the output at this end.
    texts: [String; 2],
    /// Output, SI.
    value: Option<f64>,
    /// Full description.
    words: String,
    /// Whether the slider is at this end.
    is_current: bool,
}

impl Tornado {
    /// Clears it for a new study.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Sorts the complete rows, unless they would move under the pointer.
    fn arrange(&mut self, ui: &Ui, study: &CostStudy, output: usize) {
        let inputs = study.task.over.len();
        if self.order.len() != inputs {
            self.order = (0..inputs).collect();
        }
        let (finished, all) = study.run_counts();
        let is_pointed_at = self.area.is_some_and(|area| ui.rect_contains_pointer(area));
        if finished == all && self.sorted != Some(output) && !is_pointed_at {
            (self.order, self.sorted) = (study.ranked_by_effect(output), Some(output));
        }
    }

    /// The tornado of `output`, pale if it is of an `earlier` setting; returns the input and the end that were clicked.
    pub fn ui(
        &mut self,
        ui: &mut Ui,
        study: &CostStudy,
        output: usize,
        player: &Player,
        earlier: bool,
    ) -> Option<(usize, usize)> {
        self.arrange(ui, study, output);
        let values = self.order.iter().flat_map(|&input| [0, 1].map(|end| study.end(output, input, end).flatten()));
        let values = || values.clone().chain([study.base(output)]).flatten();
        let (least, most) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let unit = study.display_unit(output);
        let shown = |si: f64| value::quantity(si, unit, DIGITS);
        let what = NAMED[output].label.to_lowercase();
        let base = study.base(output);
        let with_base = base.map_or_else(|| "…".to_owned(), shown);
        ui.label(RichText::new(format!("With the values of the scene: {with_base}")).small())
            .on_hover_text(format!("{}; at the line from which the bars begin", NAMED[output].help));
        legend(ui, earlier);
        let ends = |input: usize| [0, 1].map(|end| End::new(study, output, (input, end), player, &what, &shown));
        let ends: Vec<[End; 2]> = self.order.iter().map(|&input| ends(input)).collect();

        let bar = if theme::has_fingers(ui) { BAR_HEIGHTS.1 } else { BAR_HEIGHTS.0 };
        let height = self.order.len() as f32 * (2.0 * bar + GAP);
        let (area, _) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
        self.area = Some(area);
        let names: Vec<[&str; 2]> = self.order.iter().map(|&input| name(&study.task.over[input].0)).collect();
        let column = |at: usize| widest(ui, ends.iter().flatten().map(|end| &*end.texts[at]));
        let first = widest(ui, names.iter().flatten().copied()).min(MAX_NAMES_FRACTION * area.width());
        let place = Place {
            area,
            bar,
            names: first,
            plane: [area.left() + first + column(0), area.right() - column(1)],
            values: [least, most],
            base,
            earlier,
        };
        let mut clicked = None;
        for (row, (&input, ends)) in self.order.iter().zip(&ends).enumerate() {
            for (line, own) in ends.iter().enumerate() {
                let strip = place.strip(row, line);
                place.name_ui(ui, strip, names[row][line], line == 0);
                let id = ui.scope_id().with((&study.task.over[input].0, line));
                if place.end_ui(ui, strip, id, own, line) {
                    clicked = Some((input, line));
                }
            }
        }
        if let Some(base) = base {
            let ink = Stroke::new(1.0, ui.visuals().text_color());
            ui.painter().vline(place.across(base), area.y_range(), ink);
        }
        place.axis_ui(ui, unit, NAMED[output].label);
        clicked
    }
}

/// Layout of the drawing.
struct Place {
    area: Rect,
    /// Height of a bar.
    bar: f32,
    /// Width of the names.
    names: f32,
    /// Left and right edge of the bars.
    plane: [f32; 2],
    /// The values at those edges, SI.
    values: [f64; 2],
    /// The value from which the bars begin, SI.
    base: Option<f64>,
    /// Whether the bars are pale.
    earlier: bool,
}

impl Place {
    /// Position of a value, points.
    fn across(&self, si: f64) -> f32 {
        let ([left, right], [least, most]) = (self.plane, self.values);
        let span = if most > least { most - least } else { 1.0 };
        left + ((si - least) / span) as f32 * (right - left).max(0.0)
    }

    /// The line of an end.
    fn strip(&self, row: usize, line: usize) -> Rect {
        let top = self.area.top() + row as f32 * (2.0 * self.bar + GAP) + 0.5 * GAP + line as f32 * self.bar;
        Rect::from_x_y_ranges(self.area.x_range(), top..=top + self.bar)
    }

    /// The axis below the bars: marks in `unit`, and what it shows.
    fn axis_ui(&self, ui: &mut Ui, unit: &str, what: &str) {
        let line = ui.text_style_height(&TextStyle::Small);
        let (area, _) = ui.allocate_exact_size(vec2(self.area.width(), 2.0 * line + MARK + 4.0), Sense::hover());
        let [left, right] = self.plane;
        let (painter, ink) = (ui.painter(), ui.visuals().weak_text_color());
        let (font, stroke) = (TextStyle::Small.resolve(ui.style()), Stroke::new(1.0, ink));
        painter.hline(left..=right, area.top(), stroke);
        let bounds = self.values.map(|si| to_display(si, unit));
        let distance = f64::from(MIN_MARK_DISTANCE / (right - left).max(1.0)) * (bounds[1] - bounds[0]);
        let input = GridInput { bounds: (bounds[0], bounds[1]), base_step_size: distance };
        let most = bounds[0].abs().max(bounds[1].abs());
        for mark in plots::marks(&input, MAX_MARKS) {
            let x = self.across(from_display(mark.value, unit));
            painter.vline(x, area.top()..=area.top() + MARK, stroke);
            let text = plots::tick(mark.value, mark.step_size, most);
            painter.text(pos2(x, area.top() + MARK), Align2::CENTER_TOP, text, font.clone(), ink);
        }
        let name = match unit {
            "" => what.to_owned(),
            unit => format!("{what}, {}", value::typeset(unit)),
        };
        painter.text(pos2(right, area.top() + MARK + line), Align2::RIGHT_TOP, name, font, ink);
    }

    fn name_ui(&self, ui: &Ui, strip: Rect, text: &str, strong: bool) {
        let fits = self.names - GAP;
        let galley = WidgetText::from(text).into_galley(ui, Some(TextWrapMode::Truncate), fits, TextStyle::Small);
        let at = strip.left_center() - vec2(0.0, 0.5 * galley.size().y);
        let visuals = ui.visuals();
        let colour = if strong { visuals.strong_text_color() } else { visuals.weak_text_color() };
        ui.painter().galley_with_override_text_color(at, galley, colour);
    }

    /// Bar and values of an end; returns whether it was clicked.
    fn end_ui(&self, ui: &Ui, strip: Rect, id: Id, own: &End, end: usize) -> bool {
        let strip = strip.with_min_x(strip.left() + self.names - 0.5 * GAP);
        let response = ui.interact(strip, id, Sense::click());
        response.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), &own.words));
        let (painter, visuals) = (ui.painter(), ui.visuals());
        if own.is_current {
            painter.rect_filled(strip, 3.0, visuals.selection.bg_fill);
        } else if response.hovered() {
            painter.rect_filled(strip, 3.0, visuals.widgets.hovered.weak_bg_fill);
        }
        if response.has_focus() {
            painter.rect_stroke(strip, 3.0, visuals.widgets.hovered.fg_stroke, StrokeKind::Inside);
        }
        let (font, ink) = (TextStyle::Small.resolve(ui.style()), visuals.text_color());
        let middle = strip.center().y;
        for (text, right) in own.texts.iter().zip([self.plane[0] - 0.5 * GAP, strip.right()]) {
            painter.text(pos2(right, middle), Align2::RIGHT_CENTER, text, font.clone(), ink);
        }
        if let Some((base, value)) = self.base.zip(own.value) {
            let (a, b) = (self.across(base), self.across(value));
            let bar = Rect::from_x_y_ranges(a.min(b)..=a.max(b), strip.y_range()).shrink2(vec2(0.0, MARGIN));
            let colour = theme::series(end, visuals.dark_mode);
            painter.rect_filled(bar, 0.0, if self.earlier { colour.gamma_multiply(PALE_OPACITY) } else { colour });
        }
        let help = format!("{}. A click moves the slider there", own.words);
        response.on_hover_cursor(CursorIcon::PointingHand).on_hover_text(help).clicked()
    }
}

impl End {
    fn new(
        study: &CostStudy,
        output: usize,
        (input, end): (usize, usize),
        player: &Player,
        what: &str,
        shown: &dyn Fn(f64) -> String,
    ) -> Self {
        let (key, ends) = &study.task.over[input];
        let si_value = ends[end];
        let parameter = study.parameter(input);
        let unit = parameter.map_or("", |parameter| parameter.display_unit());
        let of_input = |si: f64| value::quantity(si, unit, DIGITS);
        let label = parameter.map_or("", |parameter| parameter.label);
        let value = study.end(output, input, end);
        let of_output = match value {
            None => "…".to_owned(),
            Some(None) => "no result".to_owned(),
            Some(Some(si)) => shown(si),
        };
        let [joint, _] = name(key);
        let at = of_input(si_value);
        let nominal = study.plan.nominal[input];
        let difference = match (value.flatten(), study.base(output)) {
            (Some(si), Some(base)) if si != base => {
                let than = if si > base { "more" } else { "less" };
                format!(", {} {than} than with {}", shown((si - base).abs()), of_input(nominal))
            }
            (Some(_), Some(_)) => format!(", as with {}", of_input(nominal)),
            _ if value == Some(None) => ": the run did not start, or diverged".to_owned(),
            _ => String::new(),
        };
        Self {
            words: format!("{label} of {joint} {at}: {what} {of_output}{difference}"),
            is_current: player.pending().get(key) == Ok(Value::Number(si_value)),
            texts: [at, of_output],
            value: value.flatten(),
        }
    }
}

/// Joint and parameter of a key.
fn name(key: &str) -> [&str; 2] {
    [joint_of(key).unwrap_or(key), key.rsplit_once('.').map_or("", |(_, part)| part)]
}

/// What the two colours stand for; pale if the bars are of an `earlier` setting.
fn legend(ui: &mut Ui, earlier: bool) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 5.0;
        ui.spacing_mut().interact_size.y = ui.text_style_height(&TextStyle::Small);
        for (end, words) in ["With the lower value", "With the upper value"].into_iter().enumerate() {
            let (swatch, _) = ui.allocate_exact_size(vec2(10.0, 10.0), Sense::hover());
            let colour = theme::series(end, ui.visuals().dark_mode);
            // Round, unlike the bars.
            let fill = if earlier { colour.gamma_multiply(PALE_OPACITY) } else { colour };
            ui.painter().circle_filled(swatch.center(), 5.0, fill);
            ui.label(RichText::new(words).small());
            ui.add_space(8.0);
        }
    });
}

/// Width of a column of `texts`, with the gap beside it, points.
fn widest<'t>(ui: &Ui, texts: impl Iterator<Item = &'t str>) -> f32 {
    let (font, colour) = (TextStyle::Small.resolve(ui.style()), ui.visuals().text_color());
    let width = |text: &str| ui.painter().layout_no_wrap(text.to_owned(), font.clone(), colour).size().x;
    texts.map(width).fold(0.0, f32::max) + GAP
}
