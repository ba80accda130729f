//! Bifurcation diagram of a sweep and its other results over the varied parameter; a click selects a section.

use eframe::egui::{Grid, Pos2, Rect, RichText, Sense, Ui};
use egui_plot::{HLine, LineStyle, PlotPoint, PlotPoints, PlotTransform, Points, VLine};

use super::coordinate::BenchCoordinate;
use super::plane::{AxisLabel, plane, set_accessible_name};
use super::portrait::title;
use super::sweep_results::SweepResults;
use crate::analysis::regime::Regime;
use crate::analysis::sweep_task::SweptPoint;
use crate::app::{layout, theme, value};
use crate::simulate::Doubt;
use crate::units::to_display;

const HEIGHT: f32 = 230.0;
/// Largest distance of a click from a point, points.
const HIT_DISTANCE: f32 = 16.0;

/// Quantity plotted over the varied parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Ordinate {
    #[default]
    Sections,
    Exponent,
    Peak,
    Probe,
}

impl Ordinate {
    const ALL: [Self; 4] = [Self::Sections, Self::Exponent, Self::Peak, Self::Probe];

    fn label(self) -> &'static str {
        match self {
            Self::Sections => "Sections",
            Self::Exponent => "Exponent",
            Self::Peak => "Peak force",
            Self::Probe => "Tip error",
        }
    }

    fn axis(self, coordinate: BenchCoordinate) -> AxisLabel {
        match self {
            Self::Sections => coordinate.axis(),
            Self::Exponent => AxisLabel::new("largest Lyapunov exponent", "1/s"),
            Self::Peak => AxisLabel::new("peak normal force", "N"),
            Self::Probe => AxisLabel::new("largest tip error", "µm"),
        }
    }
}

/// The kinds of motion with their series colour indices.
const REGIMES: [(Regime, usize); 5] = [
    (Regime::Periodic(1), 0),
    (Regime::QuasiPeriodic, 2),
    (Regime::Chaotic, 1),
    (Regime::NotSettled, 4),
    (Regime::Unclear, 7),
];

/// A drawn point: its position, and the indices of its sweep point and of its section.
type Mark = (PlotPoint, usize, usize);

/// The diagram.
#[derive(Default)]
pub struct Diagram {
    ordinate: Ordinate,
    /// The settings of the current marks; `None` if they must be rebuilt.
    mark_settings: Option<(Ordinate, BenchCoordinate)>,
    marks: [Vec<PlotPoint>; REGIMES.len()],
    all: Vec<Mark>,
    /// Marks of unreliable points.
    doubtful: Vec<PlotPoint>,
    diverged: Vec<f64>,
    transform: Option<PlotTransform>,
    /// Position of the last drawing, points of the screen, and its visible fraction.
    plane: Option<Rect>,
    visible_fraction: f32,
    /// The latest selection.
    picked: Option<(usize, usize)>,
}

impl Diagram {
    /// Clears it for a new sweep.
    pub fn clear(&mut self) {
        (self.mark_settings, self.picked, self.transform) = (None, None, None);
    }

    /// Invalidates the marks after a point has arrived.
    pub fn invalidate(&mut self) {
        self.mark_settings = None;
    }

    /// Position of a section in the last drawing, points of the screen.
    pub fn place(&self, index: usize, section: usize) -> Option<Pos2> {
        let is = |mark: &&Mark| (mark.1, mark.2) == (index, section);
        let (point, ..) = self.all.iter().find(is)?;
        Some(self.transform.as_ref()?.position_from_point(point))
    }

    /// Plot area of the last drawing, without heading and key, points of the screen.
    pub fn plane(&self) -> Option<Rect> {
        self.plane
    }

    /// Visible fraction of that area.
    pub fn visible_fraction(&self) -> f32 {
        self.visible_fraction
    }

    /// The diagram of `results`; returns the clicked point and its retained section.
    pub fn ui(&mut self, ui: &mut Ui, results: &SweepResults, coordinate: BenchCoordinate) -> Option<(usize, usize)> {
        let parameter = results.parameter();
        let unit = parameter.map_or("", |parameter| parameter.display_unit());
        let label = parameter.map_or(results.range.key.as_str(), |parameter| parameter.label);
        let shown = |si: f64| to_display(si, unit);
        self.heading_ui(ui, results);
        if self.mark_settings != Some((self.ordinate, coordinate)) {
            self.rebuild_marks(results, coordinate, &shown);
        }
        let across = AxisLabel::new(label.to_lowercase(), value::typeset(unit));
        let up = self.ordinate.axis(coordinate);
        title(
            ui,
            &format!("{} over {}", up.title(), across.title()),
            "Result of the sweep at each value. A click on a point runs the swept scene with that value from its \
             start to that section and plays on from there. It asks first if that would change the current scene.",
        );
        let dark = ui.visuals().dark_mode;
        let (faint, bad) = (ui.visuals().weak_text_color(), ui.visuals().error_fg_color);
        let warn = ui.visuals().warn_fg_color;
        let (from, to) = (shown(results.range.from), shown(results.range.to));
        let margin = if to > from { 0.03 * (to - from) } else { 0.5 * from.abs().max(1e-3) };
        let picked = self.picked;
        let now = self.all.iter().find(|mark| picked == Some((mark.1, mark.2))).map(|mark| mark.0);
        let response = plane(ui, "diagram", &across, &up, HEIGHT).sense(Sense::click()).show(ui, |plot| {
            plot.set_plot_bounds_x(from - margin..=to + margin);
            plot.set_auto_bounds([false, true]);
            if self.ordinate == Ordinate::Exponent {
                plot.hline(HLine::new("0", 0.0).color(faint).width(1.0));
            }
            for value in &self.diverged {
                let line = VLine::new("diverged", *value).color(bad);
                plot.vline(line.style(LineStyle::dotted_dense()).width(1.0));
            }
            for ((regime, colour), marks) in REGIMES.iter().zip(&self.marks) {
                let points = Points::new(regime.word(), PlotPoints::Borrowed(marks));
                plot.points(points.color(theme::series(*colour, dark)).radius(1.8));
            }
            let rings = Points::new("doubtful", PlotPoints::Borrowed(&self.doubtful));
            plot.points(rings.color(warn).filled(false).radius(3.5));
            if let Some(now) = now {
                let ring = Points::new("loaded", PlotPoints::Owned(vec![now]));
                plot.points(ring.color(faint).filled(false).radius(6.0));
            }
        });
        set_accessible_name(&response, "the sweep", &across, &up);
        let clicked = response.response.clicked();
        let pointer = response.response.interact_pointer_pos();
        self.transform = Some(response.transform);
        let plane = response.response.rect;
        self.visible_fraction = plane.intersect(ui.clip_rect()).height().max(0.0) / plane.height();
        self.plane = Some(plane);
        self.legend_ui(ui, results, dark);
        let at = pointer.filter(|_| clicked)?;
        let nearest = self
            .all
            .iter()
            .map(|mark| (response.transform.position_from_point(&mark.0).distance(at), mark))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        if nearest.0 > theme::side(ui, HIT_DISTANCE) {
            return None;
        }
        self.picked = Some((nearest.1.1, nearest.1.2));
        self.picked
    }

    fn heading_ui(&mut self, ui: &mut Ui, results: &SweepResults) {
        ui.horizontal_wrapped(|ui| {
            let names = ["Diagram of", "What the diagram shows over the varied parameter"];
            layout::choice(ui, names, Some(110.0), &mut self.ordinate, Ordinate::ALL, Ordinate::label);
            let computed = results.points.iter().flatten().count();
            let words = format!("{computed} of {} values", results.points.len());
            ui.label(RichText::new(words).small().weak()).on_hover_text("Values computed so far");
        });
    }

    /// Legend of the colours with the number of values of each kind.
    fn legend_ui(&self, ui: &mut Ui, results: &SweepResults, dark: bool) {
        let weak = ui.visuals().weak_text_color();
        let mut entries: Vec<_> = REGIMES
            .iter()
            .map(|(regime, colour)| {
                let points = results.points.iter().flatten();
                let count = points.filter(|point| point.regime_code == regime.code()).count();
                let help = "Kind of motion, and at how many values it was found";
                (count, regime.word(), theme::series_text(*colour, dark), help)
            })
            .collect();
        let help = "Values at which the divergence guard stopped the run, or that could not start";
        let bad = ui.visuals().error_fg_color;
        entries.push((self.diverged.len(), "diverged", bad, help));
        let doubtful = results.points.iter().flatten().filter(|point| point.doubts != 0);
        let kinds = doubtful.clone().fold(0, |kinds, point| kinds | point.doubts);
        let of_kind = Doubt::KINDS.iter().enumerate().filter(|(k, _)| kinds >> k & 1 == 1).map(|(_, kind)| *kind);
        let help = format!(
            "Values whose results are marked as doubtful, ringed above{}{}",
            if kinds == 0 { "" } else { ": " },
            of_kind.collect::<Vec<_>>().join(", ")
        );
        let warn = ui.visuals().warn_fg_color;
        entries.push((doubtful.count(), "doubtful", warn, &help));
        ui.scope(|ui| {
            // These rows are not controls and need no touch height.
            ui.spacing_mut().interact_size.y = 0.0;
            Grid::new("regimes").num_columns(3).show(ui, |ui| {
                for (index, (count, word, colour, help)) in entries.into_iter().enumerate() {
                    let text = RichText::new(format!("{count} {word}")).small();
                    let text = if count > 0 { text.strong().color(colour) } else { text.color(weak) };
                    ui.label(text).on_hover_text(help);
                    if index % 3 == 2 {
                        ui.end_row();
                    }
                }
            });
        });
    }

    fn rebuild_marks(&mut self, results: &SweepResults, coordinate: BenchCoordinate, shown: &dyn Fn(f64) -> f64) {
        self.marks.iter_mut().for_each(Vec::clear);
        self.all.clear();
        self.doubtful.clear();
        self.diverged.clear();
        for point in results.points.iter().flatten() {
            let Some(value) = point.values.first().map(|&si| shown(si)) else {
                continue;
            };
            if point.diverged.is_some() {
                self.diverged.push(value);
                continue;
            }
            let is = |(regime, _): &(Regime, usize)| regime.code() == point.regime_code;
            let place = REGIMES.iter().position(is).unwrap_or(REGIMES.len() - 1);
            let mut add = |up: f64, section| {
                let at = PlotPoint::new(value, up);
                self.marks[place].push(at);
                if point.doubts != 0 {
                    self.doubtful.push(at);
                }
                self.all.push((at, point.index, section));
            };
            match self.ordinate {
                Ordinate::Sections => {
                    for (k, section) in point.sections.iter().enumerate() {
                        add(coordinate.shown(section[coordinate.index()]), k);
                    }
                }
                other => {
                    if let Some(up) = other.of(point) {
                        add(up, point.sections.len().saturating_sub(1));
                    }
                }
            }
        }
        self.mark_settings = Some((self.ordinate, coordinate));
    }
}

impl Ordinate {
    /// The single value of a point, in the unit of its axis.
    fn of(self, point: &SweptPoint) -> Option<f64> {
        match self {
            Self::Sections => None,
            Self::Exponent => point.exponent.map(|(value, _)| value),
            Self::Peak => point.peak,
            Self::Probe => point.probe.map(|(largest, _)| 1e6 * largest),
        }
    }
}
