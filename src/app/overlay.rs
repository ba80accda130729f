//! Overlays painted on a picture: labels, arrow legend, time. Used by the viewport and by headless frames.

use eframe::egui::text::{LayoutJob, TextWrapping};
use eframe::egui::{Align2, FontId, Galley, Painter, Rect, Shape, Stroke, Vec2, pos2, vec2};

use super::labels::{self, LabelPositions};
pub(super) use super::labels::{SMALL_PICTURE, colour, fits_labels, text};
use super::value;
use crate::scene::Scene;
use crate::simulate::{ContactMode, Frame};
use crate::units::format_quantity_digits;
use crate::view::{Colour, DrawList, ErrorScale, Legend, Palette, Scaling, Theme, ViewOptions, WearMap, WearScale};

/// Distance of overlays from the edge, points.
const MARGIN: f32 = 14.0;

/// Font size of the time, and of the notes beside it, in a picture with enough room and in a small one, points.
const FONT_SIZES: [[f32; 2]; 2] = [[18.0, 13.0], [11.0, 11.0]];
/// Widths reserved for the time, the magnification, and any other note at these sizes, points: they stay in place as digits change.
const CELLS: [[f32; 3]; 2] = [[148.0, 250.0, 228.0], [88.0, 214.0, 150.0]];
/// Heights of a line with the time and of one with notes alone, points.
const LINES: [[f32; 2]; 2] = [[24.0, 18.0], [15.0, 13.0]];

/// Width of the time and the magnification side by side, points.
pub const NOTES_WIDTH: f32 = 2.0 * MARGIN + CELLS[0][0] + CELLS[0][1];

/// Height of the legend of the arrows, and of a colour scale, points.
const LEGEND_HEIGHT: f32 = 40.0;
/// Width of the names in the legend, with their arrows, points.
const NAMES_WIDTH: f32 = 168.0;
/// Least width of its axis with a title, linear and logarithmic, points.
const AXIS_WIDTH: [f32; 2] = [136.0, 200.0];
/// Longest axis of the legend relative to the picture's width.
const MAX_AXIS_FRACTION: f32 = 0.3;
/// Width below which words do not fit beside the legend, points.
const MIN_WIDTH_BESIDE_LEGEND: f32 = 640.0;
/// Least height of the scene between its strips, points; with less room, strips are left out.
const MIN_SCENE_HEIGHT: f32 = 56.0;
/// Least share of the scene in a picture with a colour scale.
const MIN_SCENE_SHARE: f32 = 0.42;

/// Contents of the overlay.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Simulated time, s.
    pub time: Option<f64>,
    /// Notes after those about the picture itself; e.g. [`force_notes`].
    pub notes: Vec<String>,
    /// Whether to draw the legend of the arrows.
    pub legend: bool,
    /// Whether to draw names of joints and axes.
    pub labels: bool,
    /// Whether the legend of the arrows says that its scale is new.
    pub has_new_scale: bool,
    /// Room for the caller's own widgets.
    pub room: Room,
}

/// Room for widgets in the strips above and below the scene, points.
#[derive(Clone, Copy, Debug, Default)]
pub struct Room {
    /// At the right end of the upper strip.
    pub buttons: Vec2,
    /// Height of the place for words in the lower strip.
    pub words: f32,
    /// Least number of notes above the scene to reserve places for.
    pub notes: usize,
    /// Whether the words need the whole width of a narrow picture; otherwise they may cover the names in the legend.
    pub is_wide: bool,
}

/// A picture, cut so that no text lies over the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strips {
    /// Time and notes; buttons at its right end.
    pub top: Rect,
    /// The scene.
    pub scene: Rect,
    /// Legends and words.
    pub bottom: Rect,
    /// Place for words in the lower strip.
    pub words: Rect,
    /// Place of the legend of the arrows.
    legend: Rect,
    /// Place of the colour scale of a wear map or an error map.
    scale: Rect,
}

impl Strips {
    /// The scene alone in `rect`, without text.
    pub fn of_scene(rect: Rect) -> Self {
        let (top, bottom) = (rect.with_max_y(rect.top()), rect.with_min_y(rect.bottom()));
        Self { top, scene: rect, bottom, words: bottom, legend: bottom, scale: bottom }
    }

    /// Place for a sentence that leaves by itself: that of the words, and in a narrow picture that of the legend, too.
    pub fn sentence(&self) -> Rect {
        let covers = self.words.intersects(self.legend) && self.legend.left() < self.words.right();
        if covers { self.words.union(self.legend) } else { self.words }
    }
}

/// Whether `rect` has room for a legend, as an index of the sizes.
fn class(rect: Rect) -> usize {
    usize::from(!fits_labels(rect))
}

/// Notes on the picture itself, before the caller's.
fn all_notes(list: &DrawList, overlay: &Overlay) -> Vec<String> {
    let own = [Some(list.magnification_text.clone()), wear_note(list)];
    let notes = own.into_iter().flatten().chain(overlay.notes.iter().cloned());
    notes.filter(|note| !note.is_empty()).collect()
}

/// Offsets of the time, if shown, and of `notes` notes in a strip `width` points wide, and its height.
fn cells(class: usize, width: f32, time: bool, notes: usize) -> (Vec<Vec2>, f32) {
    let [time_width, magnification, other] = CELLS[class];
    let widths =
        time.then_some(time_width).into_iter().chain((0..notes).map(|k| if k == 0 { magnification } else { other }));
    let (mut x, mut y) = (0.0, 0.0);
    let mut line = LINES[class][usize::from(!time)];
    let mut offsets = Vec::new();
    for cell in widths {
        if x > 0.0 && x + cell > width {
            (x, y) = (0.0, y + line);
            line = LINES[class][1];
        }
        offsets.push(vec2(x, y));
        x += cell;
    }
    let height = if offsets.is_empty() { 0.0 } else { y + line + 6.0 };
    (offsets, height)
}

/// Cuts the picture in `rect` for `notes` notes, those on the picture itself included. The strips depend on what is shown, not on
/// its digits, so that nothing moves as numbers change.
pub fn strips(rect: Rect, overlay: &Overlay, notes: usize, options: &ViewOptions, map: bool) -> Strips {
    let large = fits_labels(rect);
    // In the row of other words the legend takes no room from the scene.
    let has_row = overlay.room.words >= LEGEND_HEIGHT && !overlay.room.is_wide;
    let has_legend = overlay.legend && (large || has_row) && (options.arrows.normal || options.arrows.friction);
    let has_scale = large && (map || options.wear != WearMap::Off);
    let strips = cut(rect, overlay, notes, has_legend, has_scale);
    // In a low picture the note on the colours must do.
    let is_low = has_scale && strips.scene.height() < MIN_SCENE_SHARE * rect.height();
    if is_low { cut(rect, overlay, notes, has_legend, false) } else { strips }
}

fn cut(rect: Rect, overlay: &Overlay, notes: usize, has_legend: bool, has_scale: bool) -> Strips {
    let class = class(rect);
    let (large, margin) = (class == 0, if class == 0 { MARGIN } else { 6.0 });
    // In a small picture the first note, which states the magnification of the play, is the only one.
    let notes = notes.max(overlay.room.notes);
    let notes = if large { notes } else { notes.min(1) };
    let width = rect.width() - 2.0 * margin - overlay.room.buttons.x;
    let (_, height) = cells(class, width, overlay.time.is_some(), notes);
    let buttons = if overlay.room.buttons.y > 0.0 { overlay.room.buttons.y + 4.0 } else { 0.0 };
    let mut top = height.max(buttons).round();
    let legend = if has_legend { LEGEND_HEIGHT } else { 0.0 };
    let beside = rect.width() >= MIN_WIDTH_BESIDE_LEGEND;
    let words = overlay.room.words.round();
    let is_stacked = !beside && overlay.room.is_wide;
    // A long message with its button comes before the legend.
    let crowded = is_stacked && top + legend + words + 4.0 > rect.height() - 2.0 * MIN_SCENE_HEIGHT;
    let (legend, has_legend) = if crowded { (0.0, false) } else { (legend, has_legend) };
    let row = if is_stacked { legend + words } else { legend.max(words) };
    let scale = if has_scale { LEGEND_HEIGHT } else { 0.0 };
    // Beside the legend if no words are.
    let own_row = if words > 0.0 || !beside { scale } else { 0.0 };
    let row = row.max(scale - own_row);
    let mut bottom = if row + own_row > 0.0 { row + own_row + 4.0 } else { 0.0 };
    let room = (rect.height() - MIN_SCENE_HEIGHT).max(0.0);
    if top + bottom > room {
        bottom = bottom.min((room - top).max(0.0)).floor();
        top = top.min(room).floor();
    }
    let low = rect.bottom() - bottom;
    let bottom = rect.with_min_y(low);
    let inside = bottom.shrink2(vec2(margin.min(bottom.width() / 2.0), (bottom.height() / 2.0).min(2.0)));
    let scale = inside.with_max_y((inside.top() + scale).min(inside.bottom()));
    let rest = inside.with_min_y((inside.top() + own_row).min(inside.bottom()));
    let (legend, words) = if beside {
        let legend_width = if has_legend { legend_width(rect) } else { 0.0 };
        let cut = rest.right() - legend_width;
        let words = rest.with_max_x(if has_legend { cut - 12.0 } else { cut });
        (rest.with_min_x(cut).with_min_y(rest.bottom() - legend), words)
    } else if !is_stacked {
        let axis = if has_legend { AXIS_WIDTH[0] + 24.0 } else { 0.0 };
        (rest.with_min_y(rest.bottom() - legend), rest.with_max_x(rest.right() - axis))
    } else {
        let cut = (rest.top() + legend).min(rest.bottom());
        (rest.with_max_y(cut), rest.with_min_y(cut))
    };
    Strips {
        top: rect.with_max_y(rect.top() + top),
        scene: Rect::from_min_max(pos2(rect.left(), rect.top() + top), pos2(rect.right(), low)),
        bottom,
        words,
        legend,
        scale,
    }
}

/// Width reserved for the legend in a picture in `rect`.
fn legend_width(rect: Rect) -> f32 {
    NAMES_WIDTH + (MAX_AXIS_FRACTION * rect.width()).max(AXIS_WIDTH[1]) + 24.0
}

/// Paints the overlay of `list`, drawn in `strips.scene`; `scale` is pixels per point. Names reuse their `places` in the previous
/// picture where possible.
pub fn paint(
    painter: &Painter,
    strips: &Strips,
    scale: f32,
    list: &DrawList,
    theme: Theme,
    overlay: &Overlay,
    places: &mut LabelPositions,
) {
    let palette = Palette::of(theme);
    painter.rect_filled(strips.top, 0.0, colour(palette.sky));
    painter.rect_filled(strips.bottom, 0.0, colour(palette.sky));
    let Strips { scene, .. } = *strips;
    if let Some(scale) = &list.wear_scale {
        wear_scale(painter, strips.scale, scale, theme);
    }
    if let Some(scale) = &list.error_scale {
        error_scale(painter, strips.scale, scale, theme);
    }
    if let Some(shown) = list.legend.as_ref().filter(|_| overlay.legend && strips.legend.height() >= LEGEND_HEIGHT) {
        legend(painter, strips.legend, scale, shown, overlay.has_new_scale, theme);
    }
    let whole = scene.union(strips.top).union(strips.bottom);
    time(painter, strips.top, overlay, &all_notes(list, overlay), theme, whole);
    if overlay.labels && fits_labels(whole) {
        let occupied = if list.overlay.is_empty() { Vec::new() } else { vec![triad(scene)] };
        labels::paint(painter, scene, scale, list, occupied, places);
    } else {
        places.clear_plates();
    }
}

/// Simulated time and notes in the upper strip of the picture in `whole`.
fn time(painter: &Painter, strip: Rect, overlay: &Overlay, notes: &[String], theme: Theme, whole: Rect) {
    let ink = colour(Palette::of(theme).text);
    let class = class(whole);
    let (large, margin) = (class == 0, if class == 0 { MARGIN } else { 6.0 });
    let notes = if large { notes } else { &notes[..notes.len().min(1)] };
    let width = strip.width() - 2.0 * margin - overlay.room.buttons.x;
    let (offsets, height) = cells(class, width, overlay.time.is_some(), notes.len());
    if strip.height() < height.min(LINES[class][1]) {
        return;
    }
    let [large_font, small] = FONT_SIZES[class];
    let words = overlay.time.map(|time| (format!("t = {}", value::time(time)), large_font));
    let words = words.into_iter().chain(notes.iter().map(|note| (note.clone(), small)));
    // Single lines stand in the middle of a strip made higher by buttons.
    let corner = strip.min + vec2(margin, ((strip.height() - height) / 2.0).max(0.0) + 3.0);
    let first = LINES[class][usize::from(overlay.time.is_none())];
    for (k, (words, size)) in words.enumerate() {
        let Some(&offset) = offsets.get(k) else {
            break;
        };
        let next = offsets.get(k + 1).filter(|next| next.y == offset.y);
        let room = next.map_or(width, |next| next.x - 8.0) - offset.x;
        let line = if offset.y == 0.0 { first } else { LINES[class][1] };
        let mut job = LayoutJob::simple_singleline(words, FontId::proportional(size), ink);
        job.wrap = TextWrapping::truncate_at_width(room.max(40.0));
        let words = painter.layout_job(job);
        let at = corner + offset + vec2(0.0, (line - words.size().y) / 2.0);
        painter.galley(at, words, ink);
    }
}

/// Approximate area of axes and gravity.
pub fn triad(rect: Rect) -> Rect {
    // Gravity is beside the axes if there is room: `SceneView::push_triad`.
    let width = if rect.width() < 300.0 { 118.0 } else { 164.0 };
    Align2::LEFT_BOTTOM.align_size_within_rect(vec2(width, 118.0), rect)
}

/// One line per joint with play: its forces as the step reported them.
pub fn force_notes(scene: &Scene, frame: &Frame) -> Vec<String> {
    let newtons = |force: &crate::machine::Vec3| format_quantity_digits(force.norm(), "N", 4);
    scene
        .machine
        .loose_joints
        .iter()
        .zip(&frame.joints)
        .map(|(joint, report)| match report.state {
            ContactMode::Free if report.lubricant_force.norm() > 0.0 => {
                format!("{}  lubricant {}", joint.name, newtons(&report.lubricant_force))
            }
            ContactMode::Free => format!("{}  free", joint.name),
            ContactMode::Ideal => {
                format!("{}  reaction {}", joint.name, newtons(&report.normal_force))
            }
            ContactMode::Creep | ContactMode::Slip | ContactMode::Stick => format!(
                "{}  normal {}, friction {}",
                joint.name,
                newtons(&report.normal_force),
                newtons(&report.friction_force)
            ),
        })
        .collect()
}

/// Legend of the arrows at the right end of `place`: names on the left, the axis on the right.
fn legend(painter: &Painter, place: Rect, scale: f32, legend: &Legend, is_new: bool, theme: Theme) {
    let palette = Palette::of(theme);
    let (ink, halo) = (colour(palette.text), colour(palette.sky));
    let full = legend.pixels / scale;
    // In a close-up the reference arrow may be wider than the view; only the part that fits is drawn.
    let names = place.width() >= NAMES_WIDTH + AXIS_WIDTH[0] + 24.0;
    let longest = place.width() - 24.0 - if names { NAMES_WIDTH } else { 0.0 };
    let shown = full.min(longest);
    let least = AXIS_WIDTH[usize::from(legend.scaling == Scaling::Logarithmic)];
    let reserved = shown.max(least).min(longest);
    // Space for half a number beyond the last mark.
    let right = place.right() - 12.0;
    let axis = place.bottom() - 18.0;
    let left = right - shown;
    painter.line_segment([pos2(left, axis), pos2(right, axis)], Stroke::new(1.5, ink));
    let mut free_from = f32::NEG_INFINITY;
    for tick in legend.ticks.iter().filter(|tick| tick.fraction * full <= shown + 0.5) {
        let x = left + tick.fraction * full;
        painter.line_segment([pos2(x, axis - 4.0), pos2(x, axis + 4.0)], Stroke::new(1.5, ink));
        let words = format_quantity_digits(f64::from(tick.force), "", 3);
        // Omitted if it would touch the previous mark.
        if x - 12.0 >= free_from {
            let placed = text(painter, pos2(x, axis + 4.0), Align2::CENTER_TOP, &words, 11.0, ink, halo);
            free_from = placed.max.x + 4.0;
        }
    }
    let (kind, short) = match legend.scaling {
        Scaling::Linear => (format!("Force on the {}, N", legend.on), "Force, N"),
        Scaling::Logarithmic => (format!("Force on the {}, N (logarithmic)", legend.on), "N (logarithmic)"),
    };
    let font = FontId::proportional(12.0);
    let broken = [format!("{kind}, broken ones are longer"), format!("{short}, broken: longer")];
    let whole = [kind, short.to_owned()];
    let titles = if legend.clipped { broken } else { whole };
    let lay = |title: &String, ink| painter.layout_no_wrap(title.clone(), font.clone(), ink);
    let at = |words: &Galley| pos2(place.right() - words.size().x, place.top() - 1.0);
    if is_new {
        // In the place of the title, and with its colours exchanged; the plate stays within `place`, which the opening sentence
        // covers in a narrow picture.
        let force = format_quantity_digits(f64::from(legend.reference), "N", 3);
        let words = lay(&format!("New scale: {force}"), halo);
        let corner = at(&words) + vec2(-6.0, 1.0);
        painter.rect_filled(Rect::from_min_size(corner, words.size() + vec2(6.0, 0.0)), 3.0, ink);
        painter.galley(corner + vec2(3.0, 0.0), words, halo);
    } else if let Some(title) =
        titles.iter().map(|title| lay(title, ink)).find(|words| words.size().x <= reserved + 24.0)
    {
        painter.galley(at(&title), title, ink);
    }
    if !names {
        return;
    }
    let hues = [
        ("normal", legend.normal, false),
        ("lubricant", legend.lubricant, false),
        ("last peak", legend.normal.filter(|_| legend.peaks), true),
        ("friction", legend.friction, false),
    ];
    // Behind the longest name of the first column.
    let second = if legend.lubricant.is_some() { 90.0 } else { 76.0 };
    let rows = [place.top() + 9.0, place.bottom() - 11.0];
    let corner = (place.right() - 24.0 - reserved - NAMES_WIDTH).max(place.left());
    for (k, (name, hue, hollow)) in hues.into_iter().filter_map(|(n, h, o)| h.map(|h| (n, h, o))).enumerate() {
        let tail = pos2(corner + [0.0, second][k / 2], rows[k % 2]);
        if hollow {
            let outline = [
                vec2(0.0, -2.0),
                vec2(15.0, -2.0),
                vec2(15.0, -4.5),
                vec2(24.0, 0.0),
                vec2(15.0, 4.5),
                vec2(15.0, 2.0),
                vec2(0.0, 2.0),
            ];
            let corners = outline.map(|corner| tail + corner).to_vec();
            painter.add(Shape::closed_line(corners, Stroke::new(1.3, colour(hue))));
        } else {
            painter.arrow(tail, vec2(24.0, 0.0), Stroke::new(2.5, colour(hue)));
        }
        text(painter, tail + vec2(30.0, 0.0), Align2::LEFT_CENTER, name, 12.0, ink, halo);
    }
}

/// Quantity of a wear map, and its unit.
fn wear_words(map: WearMap) -> Option<(&'static str, &'static str)> {
    match map {
        WearMap::Off => None,
        WearMap::Impulse => Some(("impulse", "N s/mm²")),
        WearMap::FrictionWork => Some(("size of friction work", "mJ/mm²")),
        WearMap::Depth => Some(("depth", "µm")),
    }
}

/// Note on the meaning of the colours in `list`, if it has a wear map.
fn wear_note(list: &DrawList) -> Option<String> {
    let scale = list.wear_scale?;
    let (what, unit) = wear_words(scale.map)?;
    Some(if scale.largest > 0.0 {
        let largest = format_quantity_digits(f64::from(scale.largest), unit, 3);
        format!("wear map: {what}, at most {largest}")
    } else {
        format!("wear map: {what}, none yet")
    })
}

/// Colour scale of a wear map in `place`.
fn wear_scale(painter: &Painter, place: Rect, scale: &WearScale, theme: Theme) {
    let Some((what, unit)) = wear_words(scale.map).filter(|_| scale.largest > 0.0) else {
        return;
    };
    let ticks = scale.ticks();
    let ticks = ticks.into_iter().map(|tick| (scale.position(tick), format_quantity_digits(f64::from(tick), "", 1)));
    colour_scale(painter, place, &format!("Wear: {what}, {unit}"), ticks, WearScale::colour, theme);
}

/// Colour scale of the tip's errors in `place`.
fn error_scale(painter: &Painter, place: Rect, scale: &ErrorScale, theme: Theme) {
    let ticks = [0.0, 0.5, 1.0].map(|share| {
        let micrometres = f64::from(share * scale.largest) * 1e6;
        (share, format_quantity_digits(micrometres, "", 3))
    });
    let title = format!("{}, µm", scale.name);
    colour_scale(painter, place, &title, ticks.into_iter(), WearScale::colour, theme);
}

/// A colour bar with its title above and marks at (position 0 to 1, words) below, in `place`.
fn colour_scale(
    painter: &Painter,
    place: Rect,
    title: &str,
    ticks: impl Iterator<Item = (f32, String)>,
    hue: impl Fn(f32) -> Colour,
    theme: Theme,
) {
    const PARTS: u32 = 48;
    if place.height() < LEGEND_HEIGHT {
        return;
    }
    let palette = Palette::of(theme);
    let (ink, halo) = (colour(palette.text), colour(palette.sky));
    let bar = Rect::from_min_size(place.min + vec2(12.0, 15.0), vec2((place.width() - 24.0).min(220.0), 8.0));
    let at = |share: f32| bar.left() + share * bar.width();
    for part in 0..PARTS {
        let [from, to] = [part, part + 1].map(|part| part as f32 / PARTS as f32);
        let columns = [pos2(at(from), bar.top()), pos2(at(to), bar.bottom())];
        painter.rect_filled(Rect::from_points(&columns), 0.0, colour(hue(0.5 * (from + to))));
    }
    let outline = [bar.left_top(), bar.right_top(), bar.right_bottom(), bar.left_bottom()];
    painter.add(Shape::closed_line(outline.to_vec(), Stroke::new(1.0, ink)));
    let mut free_from = f32::NEG_INFINITY;
    for (share, words) in ticks {
        let x = at(share);
        painter.line_segment([pos2(x, bar.bottom()), pos2(x, bar.bottom() + 3.0)], Stroke::new(1.0, ink));
        if x - 12.0 >= free_from {
            let placed = text(painter, pos2(x, bar.bottom() + 2.0), Align2::CENTER_TOP, &words, 11.0, ink, halo);
            free_from = placed.max.x + 4.0;
        }
    }
    text(painter, place.min - vec2(0.0, 1.0), Align2::LEFT_TOP, title, 12.0, ink, halo);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::labels::{MAX_GAP, MAX_PLATES, MIN_LEADER};
    use crate::app::theme;
    use crate::view::{Label, LabelKind, PeakMarks, SceneView, Shot, Tick};
    use eframe::egui::{Context, LayerId, Pos2, RawInput};
    use glam::Vec3;

    /// Painted names of a column of `count` joints, `apart` points from each other.
    fn painted(count: usize, apart: f32) -> Vec<(String, Pos2)> {
        let label = |joint: usize| Label {
            text: format!("J{joint}").into(),
            kind: LabelKind::Joint(joint),
            anchor: Vec3::ZERO,
            pixel: glam::Vec2::new(300.0, 100.0 + apart * joint as f32),
            colour: Palette::of(Theme::Light).text,
        };
        let list = DrawList { labels: (0..count).map(label).collect(), ..DrawList::default() };
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(800.0, 600.0));
        let words = shapes_of(&list, rect).into_iter().filter_map(|shape| {
            let Shape::Text(text) = shape else {
                return None;
            };
            Some((text.galley.text().to_owned(), text.pos))
        });
        words.collect()
    }

    /// Shapes painted for the labels of `list`.
    fn shapes_of(list: &DrawList, rect: Rect) -> Vec<Shape> {
        shapes(rect, |painter| labels::paint(painter, rect, 1.0, list, Vec::new(), &mut LabelPositions::default()))
    }

    fn shapes(rect: Rect, paint: impl Fn(&Painter)) -> Vec<Shape> {
        let ctx = Context::default();
        theme::apply(&ctx, false);
        let mut output = ctx.run_ui(RawInput::default(), |ui| {
            paint(&Painter::new(ui.ctx().clone(), LayerId::background(), rect));
        });
        // No texture is uploaded.
        output.textures_delta.clear();
        output.shapes.into_iter().map(|shape| shape.shape).collect()
    }

    #[test]
    fn names_of_twelve_joints_do_not_overlap_and_distant_ones_have_leaders() {
        for (scene, joints) in [("hexapod", 12), ("delta", 12)] {
            let scene = Scene::load(scene, &[]).expect("built in");
            let mut frame = Frame::default();
            let mut simulation = crate::simulate::Simulation::new(&scene.machine).expect("starts");
            simulation.sample(0.0, &mut frame);
            let view = SceneView::new(&scene, &frame);
            let (options, marks, size) = (ViewOptions::default(), PeakMarks::new(), [640, 400]);
            let mut camera = view.camera();
            view.fit(&mut camera, &scene, &frame, &options, size);
            let mut list = DrawList::default();
            let shot = Shot {
                scene: &scene,
                frame: &frame,
                marks: &marks,
                options: &options,
                camera: &camera,
                trail: &[],
                size,
                pixels_per_point: 1.0,
            };
            view.build(&shot, &mut list);
            let named = |kind| matches!(kind, LabelKind::Joint(_));
            list.labels.retain(|label| named(label.kind));
            assert_eq!(list.labels.len(), joints.min(scene.machine.loose_joints.len()));
            let rect = Rect::from_min_size(Pos2::ZERO, vec2(640.0, 400.0));
            let (mut plates, mut ends) = (Vec::new(), Vec::new());
            for shape in shapes_of(&list, rect) {
                match shape {
                    Shape::Rect(plate) => plates.push(plate.rect),
                    Shape::LineSegment { points, .. } => ends.push(points),
                    _ => {}
                }
            }
            assert_eq!(plates.len(), list.labels.len(), "every joint is named");
            for (i, plate) in plates.iter().enumerate() {
                let others = &plates[i + 1..];
                assert!(!others.iter().any(|other| other.intersects(*plate)), "{i}");
                let at = list.labels[i].pixel;
                let (at, led) = (pos2(at.x, at.y), plate.distance_to_pos(pos2(at.x, at.y)) > MIN_LEADER);
                let line = ends.iter().find(|[from, _]| from.distance(at) < 0.01);
                assert_eq!(line.is_some(), led, "{i}");
                let arrives = line.is_none_or(|[_, to]| plate.distance_to_pos(*to) < 0.01);
                assert!(arrives, "{i}");
            }
        }
    }

    /// Texts painted for `overlay` over `list`, cut as `strips`.
    fn texts(list: &DrawList, strips: &Strips, overlay: &Overlay) -> Vec<(String, Rect)> {
        let whole = Rect::from_min_size(Pos2::ZERO, vec2(1000.0, 1000.0));
        let shapes = shapes(whole, |painter| {
            paint(painter, strips, 1.0, list, Theme::Light, overlay, &mut LabelPositions::default());
        });
        let texts = shapes.into_iter().filter_map(|shape| match shape {
            Shape::Text(text) => Some((text.galley.text().to_owned(), text.visual_bounding_rect())),
            _ => None,
        });
        texts.collect()
    }

    fn full_legend(clipped: bool) -> Legend {
        let ink = Palette::of(Theme::Light).text;
        let tick = |force: f32| Tick { force, fraction: force / 100.0 };
        Legend {
            on: "ball",
            reference: 100.0,
            pixels: 120.0,
            scaling: Scaling::Linear,
            clipped,
            ticks: vec![tick(50.0), tick(100.0)],
            normal: Some(ink),
            peaks: true,
            friction: Some(ink),
            lubricant: Some(ink),
        }
    }

    #[test]
    fn time_notes_legend_and_scale_stay_in_the_strips_whatever_the_size() {
        let sizes = [[1600.0, 900.0], [980.0, 432.0], [640.0, 400.0], [390.0, 296.0], [500.0, 235.0], [180.0, 165.0]];
        for [width, height] in sizes {
            let whole = Rect::from_min_size(pos2(20.0, 30.0), vec2(width, height));
            for (room, wear) in [(Room::default(), false), (Room { words: 40.0, ..Room::default() }, true)] {
                let options =
                    ViewOptions { wear: if wear { WearMap::Impulse } else { WearMap::Off }, ..ViewOptions::default() };
                let notes = vec!["following S1".to_owned(), "tip error 123.4 µm".to_owned()];
                let overlay =
                    Overlay { time: Some(0.0), notes, legend: true, labels: true, room, ..Overlay::default() };
                let strips = strips(whole, &overlay, 3 + usize::from(wear), &options, false);
                let Strips { top, scene, bottom, words, .. } = strips;
                assert_eq!(top.union(scene).union(bottom), whole, "{whole}");
                assert!((top.height() + scene.height() + bottom.height() - height).abs() < 1e-3, "{whole}");
                assert!(scene.height() >= 0.4 * height, "{whole}: {scene}");
                assert!(bottom.contains_rect(words), "{whole}: {words}");
                let list = DrawList {
                    legend: Some(full_legend(wear)),
                    wear_scale: wear.then_some(WearScale { map: WearMap::Impulse, largest: 1.2 }),
                    magnification_text: "clearance drawn ×20".to_owned(),
                    ..DrawList::default()
                };
                let all = texts(&list, &strips, &overlay);
                assert!(all.iter().any(|(text, _)| text.starts_with("t = ")), "{whole}: {all:?}");
                assert!(all.iter().any(|(text, _)| text.contains("×20")), "{whole}: {all:?}");
                for (text, place) in all {
                    // The halo is a point wide.
                    let place = place.shrink(1.5);
                    assert!(!place.intersects(scene) && whole.contains_rect(place), "{whole}: {text} at {place}");
                }
            }
        }
    }

    #[test]
    fn nothing_moves_as_the_digits_of_the_time_change() {
        let whole = Rect::from_min_size(Pos2::ZERO, vec2(800.0, 600.0));
        let list = DrawList { magnification_text: "clearance drawn ×20".to_owned(), ..DrawList::default() };
        let places = [0.0, 9.9e-6, 0.9999e-3, 9.9999e-3, 10e-3, 0.9999, 123.4].map(|at| {
            let overlay = Overlay { time: Some(at), ..Overlay::default() };
            let strips = strips(whole, &overlay, 1, &ViewOptions::default(), false);
            let texts = texts(&list, &strips, &overlay);
            let note = texts.iter().find(|(text, _)| text.starts_with("clearance")).expect("noted").1;
            let time = texts.iter().find(|(text, _)| text.starts_with("t =")).expect("written").1;
            assert!(!note.intersects(time), "{at}");
            (strips.scene, note)
        });
        assert!(places.iter().all(|place| *place == places[0]), "{places:?}");
    }

    #[test]
    fn a_name_is_near_its_joint_or_omitted() {
        let names = painted(8, 40.0);
        assert_eq!(names.len(), 8, "each has room");
        // 4096 joints on 400 points.
        let names = painted(4096, 400.0 / 4096.0);
        assert!((20..=MAX_PLATES).contains(&names.len()), "{}", names.len());
        for (name, at) in names {
            let joint: f32 = name[1..].parse().expect("a number");
            let wanted = 100.0 + joint * 400.0 / 4096.0;
            let off = (at.y - wanted).abs();
            assert!(off <= MAX_GAP + 30.0, "{name}: {off} points from its joint");
        }
    }
}
