//! Pictures of the microscope: plane view of the clearance sphere, and section of the contact.

use std::f64::consts::TAU;

use eframe::egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, Ui, Vec2, pos2, vec2};
use glam::Vec3;

use super::magnified_joint::{ContactPatch, MagnifiedJoint};
use crate::app::overlay::{colour, text};
use crate::app::paths::Point;
use crate::app::value;
use crate::scene::SignedAxis;
use crate::view::{Palette, Theme, to_f32};

/// Radius of the clearance circle, as a fraction of the picture's side.
const CIRCLE_RADIUS: f32 = 0.39;
/// Radius of the ball-centre mark, points.
pub const CENTRE_RADIUS: f32 = 4.5;
/// Length of the arrow at the reference speed, points.
const ARROW_LENGTH: f32 = 40.0;
/// Width and height of the words in the upper left corner of the sphere's picture, of the axes in the lower left, and height and least
/// width of the scale in the lower right, points.
const CORNER_TEXT: Vec2 = vec2(90.0, 40.0);
const CORNER_TRIAD: Vec2 = vec2(68.0, 58.0);
const CORNER_SCALE: Vec2 = vec2(54.0, 30.0);
/// Largest length of the scale, in clearances.
const LARGEST_BAR: f64 = 0.9;
/// Height of the words in a picture without axes, all in one line, points.
const WORDS_LINE: f32 = 19.0;
/// Least radius of the circle beside the axes, as a fraction of the picture's side; otherwise they are left out.
const MIN_RADIUS_BESIDE_TRIAD: f32 = 0.34;
/// Distance between the circle and the words, and between the places that are tried, points.
const CORNER_GAP: f32 = 4.0;
/// Steps of the radius, and the least one, as fractions of the picture's side.
const RADIUS_STEP: f32 = 0.02;
const MIN_CIRCLE_RADIUS: f32 = 0.21;
/// Path points closer than this on the screen are merged, points.
const MIN_DISTANCE: f32 = 0.8;
/// Least scale of the section, m; typical penetrations are some micrometres.
const MIN_DEPTH_SCALE: f64 = 0.5e-6;

/// Projection plane of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plane {
    /// The screen plane.
    #[default]
    View,
    /// The plane of two world axes.
    Xy,
    /// See [`Self::Xy`].
    Yz,
    /// See [`Self::Xy`].
    Zx,
}

impl Plane {
    pub const ALL: [Self; 4] = [Self::View, Self::Xy, Self::Yz, Self::Zx];

    pub fn label(self) -> &'static str {
        match self {
            Self::View => "View",
            Self::Xy => "XY",
            Self::Yz => "YZ",
            Self::Zx => "ZX",
        }
    }

    /// World vectors to the right and up in the picture; `view`: those of the 3D view. Gravity points down in the picture if
    /// possible.
    pub fn axes(self, down: SignedAxis, view: [Vec3; 2]) -> [Vec3; 2] {
        let [first, second] = match self {
            Self::View => return view,
            Self::Xy => [Vec3::X, Vec3::Y],
            Self::Yz => [Vec3::Y, Vec3::Z],
            Self::Zx => [Vec3::Z, Vec3::X],
        };
        let down = to_f32(&down.unit());
        if first.dot(down) != 0.0 {
            [second, -down]
        } else if second.dot(down) != 0.0 {
            [first, -down]
        } else {
            [first, second]
        }
    }
}

/// Largest 1, 2 or 5 times a power of ten not above `value` > 0.
pub fn round_down(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let steps = [5.0, 2.0, 1.0].map(|step| step * power);
    let fits = steps.into_iter().find(|step| *step <= value * 1.000_001);
    fits.unwrap_or(power)
}

/// Smallest such number not below `value`.
pub fn round_up(value: f64) -> f64 {
    let below = round_down(value);
    let leading = (below / 10_f64.powf(below.log10().floor())).round();
    match leading {
        _ if below >= value => below,
        2.0 => 2.5 * below,
        _ => 2.0 * below,
    }
}

/// Formats a length.
pub fn length(si: f64, digits: usize) -> String {
    let unit = if si.abs() < 9.9995e-6 { "um" } else { "mm" };
    value::quantity(si, unit, digits)
}

/// Area of a picture, and its colours.
pub struct Sheet<'a> {
    pub(super) painter: Painter,
    pub(super) rect: Rect,
    pub(super) palette: Palette,
    pub(super) ink: Color32,
    pub(super) faint: Color32,
    pub(super) background: Color32,
    magnified: &'a MagnifiedJoint,
}

impl<'a> Sheet<'a> {
    pub fn new(ui: &Ui, rect: Rect, magnified: &'a MagnifiedJoint) -> Self {
        let dark = ui.visuals().dark_mode;
        let theme = if dark { Theme::Dark } else { Theme::Light };
        let sheet = Self {
            painter: ui.painter_at(rect),
            rect,
            palette: Palette::of(theme),
            ink: ui.visuals().text_color(),
            faint: ui.visuals().weak_text_color(),
            background: ui.visuals().extreme_bg_color,
            magnified,
        };
        sheet.painter.rect_filled(rect, 4.0, sheet.background);
        sheet
    }

    /// The joint that it shows.
    pub fn magnified(&self) -> &'a MagnifiedJoint {
        self.magnified
    }

    pub(super) fn words(&self, at: Pos2, anchor: Align2, words: &str, ink: Color32) -> Rect {
        text(&self.painter, at, anchor, words, 11.0, ink, self.background)
    }

    /// A scale bar with its length; the right end is at `end`.
    fn bar(&self, end: Pos2, points: f32, words: &str) {
        let stroke = Stroke::new(1.5, self.ink);
        let start = end - vec2(points, 0.0);
        self.painter.line_segment([start, end], stroke);
        for at in [start, end] {
            let tick = vec2(0.0, 3.5);
            self.painter.line_segment([at - tick, at + tick], stroke);
        }
        let middle = start.lerp(end, 0.5) - vec2(0.0, 3.0);
        self.words(middle, Align2::CENTER_BOTTOM, words, self.ink);
    }
}

/// Centre and radius of the circle, points of the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Position of the socket's centre.
    pub centre: Pos2,
    /// Radius of the clearance.
    pub radius: f32,
}

/// Size of the words in the upper left corner.
fn corner_text(rect: Rect, has_triad: bool) -> Vec2 {
    if has_triad { CORNER_TEXT } else { vec2(rect.width(), WORDS_LINE) }
}

/// The place of the circle, and whether the axes have room beside it.
fn place_circle(rect: Rect) -> (Circle, bool) {
    let beside = largest_circle(rect, true);
    let has_triad = beside.radius >= MIN_RADIUS_BESIDE_TRIAD * rect.size().min_elem();
    if has_triad { (beside, true) } else { (largest_circle(rect, false), false) }
}

/// The largest circle, and of these the one nearest to the middle of `rect`, that no words in its corners cross.
fn largest_circle(rect: Rect, has_triad: bool) -> Circle {
    let side = rect.size().min_elem();
    let steps = ((CIRCLE_RADIUS - MIN_CIRCLE_RADIUS) / RADIUS_STEP).round() as usize;
    let radii = (0..=steps).map(|step| side * (CIRCLE_RADIUS - RADIUS_STEP * step as f32));
    let least = Circle { centre: rect.center(), radius: MIN_CIRCLE_RADIUS * side };
    let placed = radii.filter_map(|radius| {
        let scale = vec2(CORNER_SCALE.x.max(LARGEST_BAR as f32 * radius + 14.0), CORNER_SCALE.y);
        let triad = Align2::LEFT_BOTTOM.align_size_within_rect(CORNER_TRIAD, rect);
        let words = [
            Align2::LEFT_TOP.align_size_within_rect(corner_text(rect, has_triad), rect),
            Align2::RIGHT_BOTTOM.align_size_within_rect(scale, rect),
        ];
        let words: Vec<Rect> = words.into_iter().chain(has_triad.then_some(triad)).collect();
        let inside = rect.shrink(radius + CORNER_GAP);
        let is_clear = |centre: &Pos2| words.iter().all(|own| own.distance_to_pos(*centre) >= radius + CORNER_GAP);
        let tried = |half: f32| {
            let count = (half.max(0.0) / CORNER_GAP).floor() as i32;
            (-count..=count).map(|step| step as f32 * CORNER_GAP)
        };
        let centres = tried(0.5 * inside.width())
            .flat_map(|x| tried(0.5 * inside.height()).map(move |y| rect.center() + vec2(x, y)));
        let distance = |centre: &Pos2| centre.distance(rect.center());
        let nearest = centres.filter(is_clear).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map(|centre| Circle { centre, radius })
    });
    placed.into_iter().next().unwrap_or(least)
}

/// The clearance sphere seen normal to a plane: path and centre of the ball, contact, velocity, scale. `axes` point to the right
/// and up; `speed` is the reference speed of the velocity arrow, m/s.
pub fn sphere(sheet: &Sheet<'_>, axes: [Vec3; 2], path: &[Point], now: f64, speed: f64) -> Circle {
    let Sheet { painter, rect, palette, magnified, .. } = sheet;
    let report = &magnified.report;
    let (circle, has_triad) = place_circle(*rect);
    let clearance = report.clearance as f32;
    let worn = outline(magnified, 0, axes);
    let scale = circle.radius / worn.as_ref().map_or(clearance, |worn| worn.reach);
    let project = |v: Vec3| vec2(v.dot(axes[0]), -v.dot(axes[1]));

    let hairline = Stroke::new(1.0, sheet.faint.gamma_multiply(0.5));
    for reach in [vec2(1.0, 0.0), vec2(0.0, 1.0)] {
        let end = reach * circle.radius;
        painter.line_segment([circle.centre - end, circle.centre + end], hairline);
    }
    wall(sheet, (circle.centre, scale), clearance, worn.as_ref());

    let place = |v: Vec3| circle.centre + project(v) * scale;
    let ball_centre = place(to_f32(&report.eccentricity));
    self::path(sheet, painter, path, now, place, ball_centre);

    let touches = magnified.touches;
    let contact = colour(palette.normal);
    if let (true, Some(normal)) = (touches, magnified.normal) {
        // The clearance sphere bounds the ball's centre, so contact and normal are drawn there.
        let foot = place(to_f32(&magnified.limit(0, &normal)));
        let out = project(to_f32(&normal));
        painter.line_segment([foot, foot + out * 22.0], Stroke::new(2.0, contact));
        let across = vec2(-out.y, out.x) * 9.0;
        painter.line_segment([foot - across, foot + across], Stroke::new(2.0, contact));
    }
    let moving = colour(palette.friction);
    let velocity = to_f32(&magnified.sliding.unwrap_or(magnified.velocity));
    let arrow = project(velocity) * (ARROW_LENGTH / speed as f32);
    if arrow.length() > 2.0 {
        painter.arrow(ball_centre, arrow, Stroke::new(2.0, moving));
    }
    let fill = if touches { contact } else { sheet.ink };
    painter.circle(ball_centre, CENTRE_RADIUS, fill, Stroke::new(1.5, sheet.background));

    if has_triad {
        triad(sheet, axes);
    }
    let bar = round_down(f64::from(clearance) * LARGEST_BAR);
    let end = pos2(rect.right() - 10.0, rect.bottom() - 9.0);
    sheet.bar(end, bar as f32 * scale, &length(bar, 3));
    let ruler = pos2(rect.left() + 10.0, rect.top() + 12.0);
    painter.arrow(ruler, vec2(ARROW_LENGTH, 0.0), Stroke::new(2.0, moving));
    let words = value::quantity(speed, "m/s", 3);
    let beside = ruler + vec2(ARROW_LENGTH + 6.0, 0.0);
    let speed = sheet.words(beside, Align2::LEFT_CENTER, &words, moving);
    if path.len() > 1 {
        let words = format!("path of {}", path_length(path, now));
        let (at, align) = if has_triad {
            (ruler + vec2(0.0, 9.0), Align2::LEFT_TOP)
        } else {
            (pos2(speed.right() + 8.0, ruler.y), Align2::LEFT_CENTER)
        };
        sheet.words(at, align, &words, colour(palette.trail));
    }
    circle
}

/// Directions in which the outline of a worn wall is found.
const OUTLINE: u16 = 120;

/// Outline of what a worn wall leaves to the centre of the part, seen in a plane.
pub struct Outline {
    /// Points to the right and down of the middle, m.
    points: Vec<Vec2>,
    /// Largest distance of one from it, m.
    pub reach: f32,
}

/// That of the place `place` in the plane of `axes`, to the right and up; `None` of a wall that does not wear by direction.
pub fn outline(magnified: &MagnifiedJoint, place: usize, axes: [Vec3; 2]) -> Option<Outline> {
    magnified.wall(place)?;
    let axes = axes.map(|axis| crate::machine::Vec3::from(axis.as_dvec3().to_array()).normalize());
    let point = |i| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(OUTLINE)).sin_cos();
        let limit = magnified.limit(place, &(axes[0] * cos + axes[1] * sin));
        vec2(limit.dot(&axes[0]) as f32, -limit.dot(&axes[1]) as f32)
    };
    let points: Vec<Vec2> = (0..OUTLINE).map(point).collect();
    let reach = points.iter().map(|point| point.length()).fold(0.0, f32::max);
    Some(Outline { points, reach })
}

/// The wall about a place on the screen, points per metre: a circle of the radius `clearance`, m, faint where it has worn to `worn`.
pub fn wall(sheet: &Sheet<'_>, (centre, scale): (Pos2, f32), clearance: f32, worn: Option<&Outline>) {
    let ink = colour(sheet.palette.socket.colour.with_opacity(0.9));
    let unworn = if worn.is_some() { sheet.faint.gamma_multiply(0.6) } else { ink };
    sheet.painter.circle_stroke(centre, clearance * scale, Stroke::new(1.5, unworn));
    if let Some(Outline { points, .. }) = worn {
        let around = points.iter().chain(points.first()).map(|point| centre + *point * scale);
        polyline(&sheet.painter, around, Stroke::new(1.5, ink));
    }
}

/// A path up to the point `end`, which is there at `now`, s; it fades with age. `place` projects a position, world axes.
pub fn path(sheet: &Sheet<'_>, painter: &Painter, points: &[Point], now: f64, place: impl Fn(Vec3) -> Pos2, end: Pos2) {
    let column = |i: usize| to_f32(&sheet.magnified.carrier.column(i).into_owned());
    let carrier = glam::Mat3::from_cols(column(0), column(1), column(2));
    let places = points.iter().map(|point| (point.time, place(carrier * Vec3::from_array(point.position))));
    fading(sheet, painter, colour(sheet.palette.trail), places, (now, end));
}

/// A curve through places with their times, s, up to the last, `end`; it fades with age.
pub fn fading(
    sheet: &Sheet<'_>,
    painter: &Painter,
    new_colour: Color32,
    places: impl Iterator<Item = (f64, Pos2)>,
    (now, end): (f64, Pos2),
) {
    let old_colour = sheet.faint.gamma_multiply(0.45);
    let mut places = places.peekable();
    let start = places.peek().map_or(now, |first| first.0);
    let age = (now - start).max(f64::MIN_POSITIVE);
    let mut before: Option<Pos2> = None;
    for (time, at) in places {
        if let Some(from) = before {
            if from.distance(at) < MIN_DISTANCE {
                continue;
            }
            let fraction = ((time - start) / age) as f32;
            let stroke = Stroke::new(1.2 + 0.6 * fraction, old_colour.lerp_to_gamma(new_colour, fraction));
            painter.line_segment([from, at], stroke);
        }
        before = Some(at);
    }
    if let Some(from) = before {
        painter.line_segment([from, end], Stroke::new(1.8, new_colour));
    }
}

/// A curve of one colour.
pub fn polyline(painter: &Painter, places: impl Iterator<Item = Pos2>, stroke: Stroke) {
    let mut drawn: Vec<Pos2> = Vec::new();
    for at in places {
        if drawn.last().is_none_or(|last| last.distance(at) >= MIN_DISTANCE) {
            drawn.push(at);
        }
    }
    painter.line(drawn, stroke);
}

/// How long before `now` a path begins.
fn path_length(points: &[Point], now: f64) -> String {
    value::quantity(now - points.first().map_or(now, |point| point.time), "ms", 3)
}

/// The same as the end of a line of words; empty without a path.
pub fn path_words(points: &[Point], now: f64) -> String {
    if points.len() > 1 { format!(", path of {}", path_length(points, now)) } else { String::new() }
}

/// The world axes in the lower left corner of the picture.
fn triad(sheet: &Sheet<'_>, axes: [Vec3; 2]) {
    const LENGTH: f32 = 22.0;
    let origin = pos2(sheet.rect.left() + 34.0, sheet.rect.bottom() - 34.0);
    for (i, axis) in Vec3::AXES.into_iter().enumerate() {
        let along = vec2(axis.dot(axes[0]), -axis.dot(axes[1])) * LENGTH;
        if along.length() < 0.15 * LENGTH {
            continue;
        }
        let ink = colour(sheet.palette.axes[i]);
        sheet.painter.arrow(origin, along, Stroke::new(1.5, ink));
        let beyond = origin + along + along.normalized() * 8.0;
        sheet.words(beyond, Align2::CENTER_CENTER, ["X", "Y", "Z"][i], ink);
    }
}

/// Section of the undeformed ball and wall around the contact point: the part below the wall line is the elastic penetration over
/// the contact patch. Depths are exaggerated relative to widths by the displayed factor.
pub fn section(sheet: &Sheet<'_>, patch: &ContactPatch) {
    let Sheet { painter, rect, palette, .. } = sheet;
    let depth = round_up(1.1 * patch.penetration.max(patch.deepest).max(MIN_DEPTH_SCALE));
    let radius = patch.effective_radius;
    let half = 1.3 * (2.0 * radius * depth).sqrt();
    let width_scale = f64::from(rect.width()) / (2.0 * half);
    let wall = rect.top() + 0.55 * rect.height();
    let depth_scale = 0.36 * f64::from(rect.height()) / depth;
    let middle = f64::from(rect.center().x);
    let ball = |x: f64| {
        let below = (patch.penetration - x * x / (2.0 * radius)) * depth_scale;
        pos2((middle + x * width_scale) as f32, wall + below as f32)
    };
    let steps = 48;
    let points: Vec<Pos2> = (0..=steps).map(|i| ball(half * (2.0 * f64::from(i) / f64::from(steps) - 1.0))).collect();
    let contact = colour(palette.normal);
    for pair in points.windows(2) {
        if pair[0].y.max(pair[1].y) > wall {
            let [a, b] = [pair[0], pair[1]].map(|p| pos2(p.x, p.y.max(wall)));
            let corners = vec![pos2(a.x, wall), pos2(b.x, wall), b, a];
            let fill = contact.gamma_multiply(0.25);
            painter.add(Shape::convex_polygon(corners, fill, Stroke::NONE));
        }
    }
    let wall_colour = colour(palette.socket.colour.with_opacity(0.9));
    painter.hline(rect.x_range(), wall, Stroke::new(1.5, wall_colour));
    painter.line(points, Stroke::new(1.5, sheet.ink));
    if let Some(radius) = patch.radius {
        let centre = pos2(rect.center().x, wall);
        let reach = vec2((radius * width_scale) as f32, 0.0);
        let stroke = Stroke::new(3.5, contact);
        painter.line_segment([centre - reach, centre + reach], stroke);
    }
    let above = pos2(rect.center().x, rect.top() + 5.0);
    sheet.words(above, Align2::CENTER_TOP, sheet.magnified.kind.parts()[0], sheet.ink);
    let below = pos2(rect.left() + 8.0, wall + 3.0);
    sheet.words(below, Align2::LEFT_TOP, "wall", sheet.ink);
    let times = value::number(depth_scale / width_scale, 2);
    let words = format!("depths ×{times}");
    // Inside the ball during penetration; otherwise beside its lowest point.
    if patch.penetration > 0.0 {
        sheet.words(above + vec2(0.0, 14.0), Align2::CENTER_TOP, &words, sheet.faint);
    } else {
        let right = pos2(rect.right() - 8.0, wall - 3.0);
        sheet.words(right, Align2::RIGHT_BOTTOM, &words, sheet.faint);
    }
    let bar = round_down(0.5 * half);
    let end = pos2(rect.right() - 10.0, rect.bottom() - 8.0);
    sheet.bar(end, (bar * width_scale) as f32, &length(bar, 3));
    // Vertical, at the left edge, downward from the wall line.
    let down = round_down(depth);
    let stroke = Stroke::new(1.5, sheet.ink);
    let top = pos2(rect.left() + 48.0, wall);
    let foot = top + vec2(0.0, (down * depth_scale) as f32);
    painter.line_segment([top, foot], stroke);
    for at in [top, foot] {
        painter.line_segment([at - vec2(3.5, 0.0), at + vec2(3.5, 0.0)], stroke);
    }
    let beside = Pos2::lerp(&top, foot, 0.5) + vec2(6.0, 0.0);
    let words = length(down, 3);
    sheet.words(beside, Align2::LEFT_CENTER, &words, sheet.ink);
}

/// Text in the middle of an empty picture.
pub fn empty(ui: &Ui, rect: Rect, words: &str) {
    ui.painter().rect_filled(rect, 4.0, ui.visuals().extreme_bg_color);
    let font = FontId::proportional(12.0);
    let ink = ui.visuals().weak_text_color();
    let width = (rect.width() - 16.0).max(40.0);
    let galley = ui.painter().layout(words.to_owned(), font, ink, width);
    let at = Align2::CENTER_CENTER.align_size_within_rect(galley.size(), rect);
    ui.painter().galley(at.min, galley, ink);
}

/// Side of the picture in a given space: as large as possible with `below` points left under it.
pub fn side(space: Vec2, below: f32) -> f32 {
    space.x.min((space.y - below).max(0.55 * space.y)).max(96.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round() {
        for (value, down, up) in [
            (0.27e-3, 0.2e-3, 0.5e-3),
            (0.5e-3, 0.5e-3, 0.5e-3),
            (3.1e-6, 2e-6, 5e-6),
            (6.0, 5.0, 10.0),
            (1.2, 1.0, 2.0),
        ] {
            assert!((round_down(value) / down - 1.0).abs() < 1e-9, "{value}");
            assert!((round_up(value) / up - 1.0).abs() < 1e-9, "{value}");
        }
        assert_eq!(length(0.2e-3, 3), "0.2 mm");
        assert_eq!(length(2e-6, 3), "2 µm");
    }

    #[test]
    fn no_words_cross_the_circle() {
        for [width, height] in
            [[134.0, 134.0], [310.0, 240.0], [206.0, 150.0], [118.0, 110.0], [320.0, 320.0], [400.0, 96.0]]
        {
            let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(width, height));
            let (Circle { centre, radius }, has_triad) = place_circle(rect);
            let triad = Align2::LEFT_BOTTOM.align_size_within_rect(CORNER_TRIAD, rect);
            assert!(!has_triad || triad.distance_to_pos(centre) > radius, "{rect}");
            assert_eq!(has_triad, width > 200.0, "{rect}");
            assert!(rect.contains_rect(Rect::from_center_size(centre, Vec2::splat(2.0 * radius))), "{rect}");
            let scale = vec2(CORNER_SCALE.x, CORNER_SCALE.y);
            let scale = Align2::RIGHT_BOTTOM.align_size_within_rect(scale, rect);
            let words = Align2::LEFT_TOP.align_size_within_rect(corner_text(rect, has_triad), rect);
            assert!(words.distance_to_pos(centre) > radius && scale.distance_to_pos(centre) > radius, "{rect}");
            assert!(radius >= 0.2 * rect.size().min_elem(), "{rect}: {radius}");
        }
        // A large picture has the largest circle in its middle.
        let rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(320.0, 320.0));
        assert_eq!(place_circle(rect), (Circle { centre: rect.center(), radius: CIRCLE_RADIUS * 320.0 }, true));
    }

    #[test]
    fn gravity_points_down_in_the_plane() {
        for down in [SignedAxis::PlusX, SignedAxis::MinusZ, SignedAxis::PlusY] {
            for plane in [Plane::Xy, Plane::Yz, Plane::Zx] {
                let [right, up] = plane.axes(down, [Vec3::X, Vec3::Y]);
                assert_eq!(right.dot(up), 0.0);
                let down = to_f32(&down.unit());
                let within = right.cross(up).dot(down) == 0.0;
                assert_eq!(up.dot(down), if within { -1.0 } else { 0.0 });
            }
        }
        let view = [Vec3::Z, Vec3::Y];
        assert_eq!(Plane::View.axes(SignedAxis::PlusX, view), view);
    }
}
