//! Curves of recorded quantities, drawn so that no coloured pixel represents a value that was not recorded: each pixel column is
//! filled from the least to the greatest value in it. Lines with mitred joins would overshoot at every peak. Where only the range of
//! a long stretch is known, that range is a pale block, not a curve.

use std::ops::RangeInclusive;
use std::sync::Arc;

use eframe::egui::{Color32, Mesh, Pos2, Rect, Shape, Stroke, Ui, pos2, vec2};
use egui_plot::{PlotBounds, PlotGeometry, PlotItem, PlotItemBase, PlotPoint, PlotTransform};

use super::player::FINEST_BIN;
use crate::session::history::Bin;

/// Width of a curve, points.
pub const WIDTH: f32 = 1.4;
/// Length of the dashes where curves coincide and alternate, points.
pub const DASH: f32 = 6.0;

/// Widest bin that is part of a curve, points.
pub const MAX_BIN_WIDTH: f32 = 5.0;
/// Opacity of a wider one.
const PALE: f32 = 0.25;

/// Most pixels over which a steep curve fades into the next column.
const MAX_FADE: f32 = 6.0;

/// A recorded curve in SI units.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Bins in order of time.
    pub bins: Vec<Bin>,
    /// Its colour.
    pub colour: Color32,
}

impl Trace {
    /// Least and greatest value recorded around `time`, s.
    pub fn at(&self, time: f64) -> Option<(f64, f64)> {
        let after = self.bins.partition_point(|bin| bin.from <= time);
        let bin = self.bins[..after].last()?;
        (time <= bin.to).then_some((bin.least, bin.greatest))
    }
}

/// Whether `bin` shows where in it the curve is: it has a single value or is not wider than `widest`, s, or nothing finer is ever
/// recorded.
pub fn is_narrow(bin: &Bin, widest: f64) -> bool {
    bin.least == bin.greatest || bin.to - bin.from <= widest.max(1.5 * FINEST_BIN)
}

/// Curves over a common time axis. None hides another: in a pixel column, taller curves are drawn behind shorter ones, and
/// coincident curves alternate.
pub struct Curves<'a> {
    base: PlotItemBase,
    traces: &'a [Trace],
    /// Unit of the time axis in s, and of the value axis in SI units.
    units: [f64; 2],
    width: f32,
    /// Dash length, points; `None` for solid lines.
    dashes: Option<f32>,
}

impl<'a> Curves<'a> {
    /// Curves over axes with the given `units`: time unit in s, and value unit in SI units.
    pub fn new(traces: &'a [Trace], units: [f64; 2]) -> Self {
        Self { base: PlotItemBase::new("curves".to_owned()), traces, units, width: WIDTH, dashes: None }
    }

    /// Uses dashes `length` points long and `width` points thick.
    pub fn dashed(mut self, width: f32, length: f32) -> Self {
        (self.width, self.dashes) = (width, Some(length));
        self
    }

    fn mesh(&self, transform: &PlotTransform, scale: f32) -> Mesh {
        let frame = transform.frame();
        let bounds = transform.bounds();
        let per =
            |d: usize, length: f32| f64::from(length * scale) / (bounds.max()[d] - bounds.min()[d]) / self.units[d];
        let (across, up) = (per(0, frame.width()), per(1, frame.height()));
        let origin = [
            f64::from(frame.left() * scale) - bounds.min()[0] * self.units[0] * across,
            f64::from(frame.bottom() * scale) + bounds.min()[1] * self.units[1] * up,
        ];
        let first = (frame.left() * scale).floor() as i64;
        let count = ((frame.right() * scale).ceil() as i64 - first).max(0) as usize;
        // Points far outside are clipped just beyond the frame.
        let (top, bottom) = (frame.top() - frame.height(), frame.bottom() + frame.height());
        let clip = (f64::from(top * scale), f64::from(bottom * scale));
        let place = |time: f64, value: f64| {
            let y = (origin[1] - value * up).clamp(clip.0, clip.1);
            [origin[0] + time * across, y]
        };
        let width = self.width * scale;
        let widest = f64::from(MAX_BIN_WIDTH * scale) / across;
        let all: Vec<Vec<Bar>> =
            self.traces.iter().map(|trace| bars(&spans(&trace.bins, widest, place, first, count), width)).collect();
        let dash = (DASH * scale).round().max(1.0);
        let mut mesh = Mesh::default();
        for trace in self.traces {
            for bin in trace.bins.iter().filter(|bin| !is_narrow(bin, widest)) {
                let corners = [(bin.from, bin.greatest), (bin.to, bin.least)].map(|(time, value)| {
                    let [x, y] = place(time, value);
                    pos2(x as f32 / scale, y as f32 / scale)
                });
                let block = Rect::from_points(&corners).expand2(vec2(0.0, 0.5 * self.width));
                mesh.add_colored_rect(block.intersect(*frame), trace.colour.gamma_multiply(PALE));
            }
        }
        let mut column_bars: Vec<(usize, Bar)> = Vec::new();
        let mut groups: Vec<Vec<(usize, Bar)>> = Vec::new();
        for column in 0..count {
            column_bars.clear();
            let present = all.iter().enumerate().map(|(index, bars)| (index, bars[column]));
            column_bars.extend(present.filter(|(_, bar)| bar.height() > 0.0));
            if let Some(length) = self.dashes {
                let gap = (column as f32 / (length * scale).max(1.0)) as usize % 2 == 1;
                column_bars.retain(|(_, bar)| !gap || bar.height() > 3.0 * width);
            }
            // Parallel curves keep their order, whichever is steeper in this column.
            let rank = |bar: &Bar| {
                if bar.height() > 3.0 * width { bar.height() } else { 0.0 }
            };
            column_bars.sort_by(|a, b| rank(&b.1).total_cmp(&rank(&a.1)));
            groups.clear();
            for &(index, bar) in &column_bars {
                match groups.iter_mut().find(|group| group[0].1.coincides(&bar)) {
                    Some(group) => group.push((index, bar)),
                    None => groups.push(vec![(index, bar)]),
                }
            }
            let x = (first + column as i64) as f32;
            for group in &groups {
                paint(&mut mesh, x, scale, dash, group, |index| self.traces[index].colour);
            }
        }
        mesh
    }
}

/// Paints the pixel column at `x`: one bar, or several coincident bars that alternate along it.
fn paint(mesh: &mut Mesh, x: f32, scale: f32, dash: f32, group: &[(usize, Bar)], colour: impl Fn(usize) -> Color32) {
    if let [(index, bar)] = group {
        bar.paint(mesh, x, scale, (f32::NEG_INFINITY, f32::INFINITY), colour(*index));
        return;
    }
    // Alternates along the longer side, so that level and steep parts look alike.
    let bar_of_piece = |piece: i64| group[piece.rem_euclid(group.len() as i64) as usize];
    let tallest = group.iter().map(|(_, bar)| bar.height()).fold(0.0, f32::max);
    if tallest <= 0.5 * dash {
        let (index, bar) = bar_of_piece((x / dash).floor() as i64);
        bar.paint(mesh, x, scale, (f32::NEG_INFINITY, f32::INFINITY), colour(index));
        return;
    }
    let ends = group.iter().map(|(_, bar)| (bar.top - bar.soft_top, bar.bottom + bar.soft_bottom));
    let (low, high) = ends.fold((f32::INFINITY, f32::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    for piece in (low / dash).floor() as i64..=(high / dash).floor() as i64 {
        let (index, bar) = bar_of_piece(piece);
        let ends = (piece as f32 * dash, (piece + 1) as f32 * dash);
        bar.paint(mesh, x, scale, ends, colour(index));
    }
}

/// The part of a pixel column that a curve covers, y downwards; empty if `top` is below `bottom`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    top: f32,
    bottom: f32,
}

impl Span {
    const EMPTY: Self = Self { top: f32::INFINITY, bottom: f32::NEG_INFINITY };

    fn include(&mut self, y: f64) {
        self.top = self.top.min(y as f32);
        self.bottom = self.bottom.max(y as f32);
    }

    fn join(self, other: Self) -> Self {
        Self { top: self.top.min(other.top), bottom: self.bottom.max(other.bottom) }
    }
}

/// Spans of the `count` pixel columns from `first` for a curve through those `bins` that are not wider than `widest`, s; `place` maps
/// time and value to pixels.
fn spans(bins: &[Bin], widest: f64, place: impl Fn(f64, f64) -> [f64; 2], first: i64, count: usize) -> Vec<Span> {
    let mut spans = vec![Span::EMPTY; count];
    let column = |x: f64| {
        let at = x.floor() as i64 - first;
        usize::try_from(at).ok().filter(|at| *at < count)
    };
    let mut line = |[xa, ya]: [f64; 2], [xb, yb]: [f64; 2]| {
        let last = first + count as i64;
        let slope = if xb > xa { (yb - ya) / (xb - xa) } else { 0.0 };
        for at in (xa.floor() as i64).max(first)..=(xb.floor() as i64).min(last - 1) {
            let span = &mut spans[(at - first) as usize];
            let (left, right) = (at as f64, (at + 1) as f64);
            span.include(if left <= xa { ya } else { ya + (left - xa) * slope });
            span.include(if right >= xb { yb } else { ya + (right - xa) * slope });
        }
    };
    // The pen passes through every bin: from its junction with the previous bin, over its middle, to its junction with the next.
    let mut pen: Option<(f64, f64)> = None;
    let mut extremes: Vec<(f64, f64)> = Vec::new();
    for (index, bin) in bins.iter().enumerate() {
        if bin.least.is_nan() || bin.greatest.is_nan() || !is_narrow(bin, widest) {
            pen = None;
            continue;
        }
        let next = bins.get(index + 1).filter(|next| next.from == bin.to && is_narrow(next, widest));
        let exit = next.map(|next| {
            // Middle of their overlap, or of the gap between them.
            0.5 * (bin.least.max(next.least) + bin.greatest.min(next.greatest))
        });
        let wanted = match (pen, exit) {
            (Some((_, entry)), Some(exit)) => 0.5 * (entry + exit),
            (Some((_, value)), None) | (None, Some(value)) => value,
            (None, None) => 0.5 * (bin.least + bin.greatest),
        };
        let value = wanted.clamp(bin.least, bin.greatest);
        let middle = 0.5 * (bin.from + bin.to);
        let (time, entry) = pen.unwrap_or((bin.from, value));
        line(place(time, entry), place(middle, value));
        let end = exit.unwrap_or(value);
        line(place(middle, value), place(bin.to, end));
        for (extreme, reached) in
            [(bin.greatest, bin.greatest <= entry.max(end)), (bin.least, bin.least >= entry.min(end))]
        {
            if !reached {
                extremes.push((middle, extreme));
            }
        }
        pen = Some((bin.to, end));
    }
    for (time, value) in extremes {
        let [x, y] = place(time, value);
        if let Some(at) = column(x) {
            spans[at].include(y);
        }
    }
    spans
}

/// A painted column: full colour between its ends; each end fades over the given number of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bar {
    top: f32,
    bottom: f32,
    soft_top: f32,
    soft_bottom: f32,
}

impl Bar {
    const EMPTY: Self = Self { top: 0.0, bottom: 0.0, soft_top: 0.0, soft_bottom: 0.0 };

    fn height(&self) -> f32 {
        self.bottom - self.top
    }

    /// Whether the two bars would hide each other.
    fn coincides(&self, other: &Self) -> bool {
        (self.top - other.top).abs() < 1.0 && (self.bottom - other.bottom).abs() < 1.0
    }

    /// Adds the bar to `mesh`, clipped to the range between two heights (pixels).
    fn paint(&self, mesh: &mut Mesh, x: f32, scale: f32, (low, high): (f32, f32), colour: Color32) {
        let profile = [
            (self.top - 0.5 * self.soft_top, 0.0),
            (self.top + 0.5 * self.soft_top, 1.0),
            (self.bottom - 0.5 * self.soft_bottom, 1.0),
            (self.bottom + 0.5 * self.soft_bottom, 0.0),
        ];
        for ends in profile.windows(2) {
            let ((ya, a), (yb, b)) = (ends[0], ends[1]);
            let (from, to) = (ya.max(low), yb.min(high));
            if from >= to {
                continue;
            }
            let index = mesh.vertices.len() as u32;
            for y in [from, to] {
                let part = a + (b - a) * (y - ya) / (yb - ya);
                let colour = colour.gamma_multiply(part);
                for x in [x, x + 1.0] {
                    mesh.colored_vertex(pos2(x / scale, y / scale), colour);
                }
            }
            mesh.add_triangle(index, index + 1, index + 2);
            mesh.add_triangle(index + 1, index + 2, index + 3);
        }
    }
}

/// The bars of a curve: `width` pixels thick in level and steep parts alike, and never beyond its own peaks and troughs.
fn bars(spans: &[Span], width: f32) -> Vec<Bar> {
    // Full columns on either side; the rest of the width softens the ends.
    let beside = (0.5 * (width - 1.0) + 0.25).floor().max(0.0) as usize;
    let rest = (width - 2.0 * beside as f32 - 1.0).max(0.0);
    let widened = |at: usize| {
        let last = spans.len() - 1;
        let near = spans[at.saturating_sub(beside)..=(at + beside).min(last)].iter();
        near.fold(Span::EMPTY, |all, span| all.join(*span))
    };
    let widened: Vec<Span> = (0..spans.len()).map(widened).collect();
    let bar = |at: usize| {
        let Span { top, bottom } = widened[at];
        if top > bottom {
            return Bar::EMPTY;
        }
        let before = at.checked_sub(1).map_or(Span::EMPTY, |at| widened[at]);
        let around = before.join(widened.get(at + 1).copied().unwrap_or(Span::EMPTY));
        // Extent of the curve beyond this column, limited to its slope here.
        let extension = |by: f32| by.clamp(0.0, (bottom - top).min(MAX_FADE));
        let (up, down) = (extension(top - around.top), extension(around.bottom - bottom));
        let more = |beyond: f32| (0.5 * rest * beyond).min(1.0);
        let (mut top, mut bottom) = (top - more(up), bottom + more(down));
        if bottom - top < width {
            let middle = 0.5 * (top + bottom);
            (top, bottom) = (middle - 0.5 * width, middle + 0.5 * width);
        }
        Bar { top, bottom, soft_top: up.max(1.0), soft_bottom: down.max(1.0) }
    };
    (0..spans.len()).map(bar).collect()
}

impl PlotItem for Curves<'_> {
    fn shapes(&self, ui: &Ui, transform: &PlotTransform, shapes: &mut Vec<Shape>) {
        let mesh = self.mesh(transform, ui.ctx().pixels_per_point());
        if !mesh.is_empty() {
            shapes.push(Shape::Mesh(Arc::new(mesh)));
        }
    }

    fn initialize(&mut self, _x_range: RangeInclusive<f64>) {}

    fn color(&self) -> Color32 {
        Color32::TRANSPARENT
    }

    fn geometry(&self) -> PlotGeometry<'_> {
        PlotGeometry::None
    }

    fn bounds(&self) -> PlotBounds {
        PlotBounds::NOTHING
    }

    fn base(&self) -> &PlotItemBase {
        &self.base
    }

    fn base_mut(&mut self) -> &mut PlotItemBase {
        &mut self.base
    }
}

/// Points for the hit test, connected by a line if it has a width; sharp corners are split.
pub struct Path<'a> {
    base: PlotItemBase,
    points: &'a [PlotPoint],
    colour: Color32,
    width: f32,
}

impl<'a> Path<'a> {
    /// Hit-test points of a curve drawn by [`Curves`].
    pub fn readings(name: &str, points: &'a [PlotPoint], colour: Color32) -> Self {
        Self::line(name, points, colour, 0.0)
    }

    /// A line of `width` points.
    pub fn line(name: &str, points: &'a [PlotPoint], colour: Color32, width: f32) -> Self {
        let base = PlotItemBase::new(name.to_owned());
        Self { base, points, colour, width }
    }
}

impl PlotItem for Path<'_> {
    fn shapes(&self, _ui: &Ui, transform: &PlotTransform, shapes: &mut Vec<Shape>) {
        if self.width <= 0.0 {
            return;
        }
        let stroke = Stroke::new(self.width, self.colour);
        let places = self.points.iter().map(|p| transform.position_from_point(p));
        shapes.extend(parts(places).into_iter().map(|part| Shape::line(part, stroke)));
    }

    fn initialize(&mut self, _x_range: RangeInclusive<f64>) {}

    fn color(&self) -> Color32 {
        self.colour
    }

    fn geometry(&self) -> PlotGeometry<'_> {
        PlotGeometry::Points(self.points)
    }

    fn bounds(&self) -> PlotBounds {
        let mut bounds = PlotBounds::NOTHING;
        self.points.iter().for_each(|point| bounds.extend_with(point));
        bounds
    }

    fn base(&self) -> &PlotItemBase {
        &self.base
    }

    fn base_mut(&mut self) -> &mut PlotItemBase {
        &mut self.base
    }
}

/// Splits a line at sharp corners, so that no mitre overshoots.
fn parts(points: impl Iterator<Item = Pos2>) -> Vec<Vec<Pos2>> {
    /// Least cosine of the turning angle at which a join is smooth.
    const SMOOTH: f32 = 0.8;
    let mut parts: Vec<Vec<Pos2>> = vec![Vec::new()];
    for point in points {
        let Some(part) = parts.last_mut() else { break };
        let turn = match part[..] {
            [.., last] if last.distance_sq(point) < 0.01 => continue,
            [.., before, last] => (last - before).normalized().dot((point - last).normalized()),
            _ => 1.0,
        };
        if turn < SMOOTH {
            let corner = part[part.len() - 1];
            parts.push(vec![corner, point]);
        } else {
            part.push(point);
        }
    }
    parts.retain(|part| part.len() > 1);
    parts
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests;
