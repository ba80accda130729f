//! Tornado of a study: for each input, two bars from the output with the scene's values to those at its ends. A click on a bar
//! selects the end.

use eframe::egui::{
    Align2, CursorIcon, FontId, Rect, RichText, Role, Sense, Stroke, StrokeKind, TextStyle, TextWrapMode, Ui,
    WidgetInfo, WidgetText, pos2, vec2,
};

use super::cost_study::CostStudy;
use crate::analysis::study::NAMED;
use crate::app::player::Player;
use crate::app::{theme, value};
use crate::scene::Value;

/// Height of a bar with its texts, for a mouse and for touch, points.
const BAR: (f32, f32) = (18.0, 30.0);
/// Gap between two inputs, and between two columns, points.
const GAP: f32 = 8.0;
/// Margin of a bar above and below, points.
const MARGIN: f32 = 2.0;
/// Largest part of the width for the names.
const NAMES: f32 = 0.3;
/// Digits of a value on show.
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
    /// The value of the input and the output there, as shown.
    texts: [String; 2],
    /// Output, SI.
    value: Option<f64>,
    /// Full description.
    words: String,
    /// Whether the slider is there.
    here: bool,
}

impl Tornado {
    /// Clears it for a new study.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Sorts the complete rows, unless they would move under the pointer.
    fn arrange(&mut self, ui: &Ui, study: &CostStudy, output: usize) {
        let inputs = study.task.keys.len();
        if self.order.len() != inputs {
            self.order = (0..inputs).collect();
        }
        let (finished, all) = study.counts();
        let pointed = self.area.is_some_and(|area| ui.rect_contains_pointer(area));
        if finished == all && self.sorted != Some(output) && !pointed {
            (self.order, self.sorted) = (study.by_effect(output), Some(output));
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
        let unit = unit(study.plan.units[output].as_deref().unwrap_or_default(), least.abs().max(most.abs()));
        let shown = |si: f64| value::quantity(si, unit, DIGITS);
        let what = NAMED[output].label.to_lowercase();
        let base = study.base(output);
        let with_base = base.map_or_else(|| "…".to_owned(), shown);
        ui.label(RichText::new(format!("With the values of the scene: {with_base}")).small())
            .on_hover_text(format!("{}; at the line from which the bars begin", NAMED[output].help));
        let ends = |input: usize| [0, 1].map(|end| End::new(study, output, (input, end), player, &what, &shown));
        let ends: Vec<[End; 2]> = self.order.iter().map(|&input| ends(input)).collect();

        let bar = if theme::has_fingers(ui) { BAR.1 } else { BAR.0 };
        let height = self.order.len() as f32 * (2.0 * bar + GAP);
        let (area, _) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
        self.area = Some(area);
        let font = TextStyle::Small.resolve(ui.style());
        let widest =
            |texts: &mut dyn Iterator<Item = &str>| texts.map(|text| width(ui, text, &font)).fold(0.0, f32::max) + GAP;
        let names: Vec<[&str; 2]> = self.order.iter().map(|&input| name(&study.task.keys[input])).collect();
        let first = widest(&mut names.iter().flatten().copied()).min(NAMES * area.width());
        let column = |at: usize| widest(&mut ends.iter().flatten().map(|end| &*end.texts[at]));
        let (left, right) = (area.left() + first + column(0), area.right() - column(1));
        let span = if most > least { most - least } else { 1.0 };
        let across = |si: f64| left + ((si - least) / span) as f32 * (right - left).max(0.0);

        let visuals = ui.visuals().clone();
        let ink = visuals.text_color();
        let mut clicked = None;
        for (row, (&input, ends)) in self.order.iter().zip(&ends).enumerate() {
            let top = area.top() + row as f32 * (2.0 * bar + GAP) + 0.5 * GAP;
            for (line, text) in names[row].iter().enumerate() {
                let galley = WidgetText::from(*text).into_galley(
                    ui,
                    Some(TextWrapMode::Truncate),
                    first - GAP,
                    TextStyle::Small,
                );
                let at = pos2(area.left(), top + (line as f32 + 0.5) * bar - 0.5 * galley.size().y);
                let colour = if line == 0 { visuals.strong_text_color() } else { visuals.weak_text_color() };
                ui.painter().galley_with_override_text_color(at, galley, colour);
            }
            for (end, own) in ends.iter().enumerate() {
                let place = Rect::from_x_y_ranges(
                    area.left() + first - 0.5 * GAP..=area.right(),
                    top + end as f32 * bar..=top + (end + 1) as f32 * bar,
                );
                let id = ui.scope_id().with((&study.task.keys[input], end));
                let response = ui.interact(place, id, Sense::click());
                response.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), &own.words));
                let painter = ui.painter();
                if own.here {
                    painter.rect_filled(place, 3.0, visuals.selection.bg_fill);
                } else if response.hovered() {
                    painter.rect_filled(place, 3.0, visuals.widgets.hovered.weak_bg_fill);
                }
                if response.has_focus() {
                    painter.rect_stroke(place, 3.0, visuals.widgets.hovered.fg_stroke, StrokeKind::Inside);
                }
                let middle = place.center().y;
                let [of_input, of_output] = &own.texts;
                painter.text(pos2(left - 0.5 * GAP, middle), Align2::RIGHT_CENTER, of_input, font.clone(), ink);
                painter.text(pos2(area.right(), middle), Align2::RIGHT_CENTER, of_output, font.clone(), ink);
                if let Some((base, end_value)) = base.zip(own.value) {
                    let (a, b) = (across(base), across(end_value));
                    let drawn = Rect::from_x_y_ranges(a.min(b)..=a.max(b), place.y_range()).shrink2(vec2(0.0, MARGIN));
                    let colour = theme::series(end, visuals.dark_mode);
                    painter.rect_filled(drawn, 0.0, if earlier { colour.gamma_multiply(0.45) } else { colour });
                }
                if response.on_hover_cursor(CursorIcon::PointingHand).on_hover_text(&own.words).clicked() {
                    clicked = Some((input, end));
                }
            }
        }
        if let Some(base) = base {
            ui.painter().vline(across(base), area.y_range(), Stroke::new(1.0, ink));
        }
        clicked
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
        let (key, there) = (&study.task.keys[input], study.task.ends[input][end]);
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
        let at = of_input(there);
        let nominal = study.plan.nominal[input];
        let more = match (value.flatten(), study.base(output)) {
            (Some(si), Some(base)) if si != base => {
                let than = if si > base { "more" } else { "less" };
                format!(", {} {than} than with {}", shown((si - base).abs()), of_input(nominal))
            }
            (Some(_), Some(_)) => format!(", as with {}", of_input(nominal)),
            _ if value == Some(None) => ": the run did not start, or diverged".to_owned(),
            _ => String::new(),
        };
        Self {
            words: format!("{label} of {joint} {at}: {what} {of_output}{more}"),
            here: player.pending().get(key) == Ok(Value::Number(there)),
            texts: [at, of_output],
            value: value.flatten(),
        }
    }
}

/// Joint and parameter of a key.
fn name(key: &str) -> [&str; 2] {
    let (joint, part) = key.strip_prefix("joint.").unwrap_or(key).rsplit_once('.').unwrap_or((key, ""));
    [joint, part]
}

/// The unit in which values up to `most` are shown.
fn unit(si: &str, most: f64) -> &str {
    match si {
        "m" if most < 1e-3 => "um",
        "m" => "mm",
        other => other,
    }
}

fn width(ui: &Ui, text: &str, font: &FontId) -> f32 {
    let colour = ui.visuals().text_color();
    ui.painter().layout_no_wrap(text.to_owned(), font.clone(), colour).size().x
}
