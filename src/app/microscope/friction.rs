//! Diagram of the friction force over the displacement of the surfaces of a contact: its loops are the hysteresis of the friction law.

use eframe::egui::{Align2, Pos2, Rect, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::draw::{self, Sheet};
use super::magnified_joint::MagnifiedJoint;
use crate::app::friction::{Contact, Point};
use crate::app::overlay::colour;
use crate::app::player::Player;
use crate::app::value;
use crate::contact::{FrictionLaw, FrictionVelocity, Parameters};

/// Height where there is room, and least height, points.
pub const HEIGHT: f32 = 140.0;
pub const MIN_HEIGHT: f32 = 110.0;
/// Margins of the curves beside the labels: left, top, right, bottom, points.
const MARGINS: [f32; 4] = [52.0, 22.0, 12.0, 20.0];
/// Space around the curves, as a fraction of their range.
const PADDING: f64 = 0.08;
/// Least range of displacements, m: less is rounding.
const MIN_SPAN: f64 = 1e-8;
/// Space between the outer labels of displacements from which the axis is named there, points.
const MIN_GAP_FOR_NAME: f32 = 84.0;
/// Width from which the limit of the instant is beside the title, points.
const MIN_WIDTH_WITH_LIMIT: f32 = 250.0;

/// What it shows: components along the main direction of sliding.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionCurve {
    /// Place of the joint.
    pub place: usize,
    /// Whether it is in contact.
    pub touches: bool,
    /// The points, the oldest first; the last one is marked.
    pub points: Vec<CurvePoint>,
}

/// One point of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// s.
    pub time: f64,
    /// Of the carried part over the carrier, m.
    pub displacement: f64,
    /// Force of the carried part on the carrier, N.
    pub friction: f64,
    /// Limit of friction, N.
    pub limit: f64,
}

/// Where the curve is on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionScale {
    /// Area of the curves, points of the screen.
    pub area: Rect,
    /// Displacements at its left and right edges, m.
    pub displacements: [f64; 2],
    /// Largest force, at its upper edge, N; the lower edge is its negative.
    pub force: f64,
}

impl FrictionScale {
    /// Place of a displacement, m, and a force, N.
    pub fn place(&self, displacement: f64, force: f64) -> Pos2 {
        let [least, most] = self.displacements;
        let x = (displacement - least) / (most - least);
        let y = 0.5 * (1.0 - force / self.force);
        self.area.lerp_inside(vec2(x as f32, y as f32))
    }
}

/// Whether the diagram is shown for a joint with these parameters: its law must exert friction.
pub fn is_shown(contact: &Parameters) -> bool {
    !contact.is_ideal() && contact.friction > 0.0 && contact.friction_law != FrictionLaw::None
}

/// Main direction in which the surfaces slide.
fn main_direction(points: &[Point]) -> [f64; 2] {
    let ways = points.windows(2).map(|pair| [0, 1].map(|i| pair[1].displacement[i] - pair[0].displacement[i]));
    // Twice the angle of each way, so that to and fro are one direction.
    let [x, y] = ways.fold([0.0; 2], |[x, y], [a, b]| {
        let length = a.hypot(b).max(f64::MIN_POSITIVE);
        [x + (a * a - b * b) / length, y + 2.0 * a * b / length]
    });
    let angle = 0.5 * y.atan2(x);
    let along = [angle.cos(), angle.sin()];
    // The curve must not turn about when a direction near an axis changes a little.
    if along[0] + 0.5 * along[1] < 0.0 { along.map(|x| -x) } else { along }
}

impl FrictionCurve {
    /// That of joint `joint` at the displayed instant: of the present contact, or in free flight of the latest, over a few seconds of viewing.
    /// `None` if none is known.
    pub fn of(player: &Player, joint: usize) -> Option<Self> {
        let Contact { place, points, now } = player.friction().contact(joint, player.frame())?;
        let end = now.as_ref().or(points.last())?.time;
        let first = points.partition_point(|point| point.time < end - player.automatic_window());
        let shown: Vec<Point> = points[first..].iter().copied().chain(now).collect();
        let along = main_direction(&shown);
        let component = |vector: [f64; 2]| along[0] * vector[0] + along[1] * vector[1];
        let points = shown.iter().map(|point| CurvePoint {
            time: point.time,
            displacement: component(point.displacement),
            friction: -component(point.friction),
            limit: point.limit,
        });
        Some(Self { place, touches: now.is_some(), points: points.collect() })
    }

    fn scale(&self, rect: Rect) -> FrictionScale {
        let [left, top, right, bottom] = MARGINS;
        let area = Rect::from_min_max(rect.min + vec2(left, top), rect.max - vec2(right, bottom));
        let range = |least: f64, most: f64| [least.min(most), most.max(least)];
        let [least, most] = self
            .points
            .iter()
            .map(|point| [point.displacement; 2])
            .reduce(|a, b| range(a[0].min(b[0]), a[1].max(b[1])))
            .unwrap_or_default();
        let [middle, half] = [0.5 * (least + most), (0.5 + PADDING) * (most - least).max(MIN_SPAN)];
        let force = self.points.iter().map(|point| point.limit.max(point.friction.abs())).fold(0.0, f64::max);
        let force = if force > 0.0 { (1.0 + 2.0 * PADDING) * force } else { 1.0 };
        FrictionScale { area, displacements: [middle - half, middle + half], force }
    }
}

/// The diagram of joint `joint` at the cursor of `ui`, `height` points high, with its scale; an empty one before the first contact.
pub fn diagram(
    ui: &mut Ui,
    player: &Player,
    magnified: &MagnifiedJoint,
    (joint, height): (usize, f32),
) -> Option<(FrictionCurve, FrictionScale)> {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    let Some(curve) = FrictionCurve::of(player, joint) else {
        draw::empty(ui, rect, "No contact, no friction so far");
        return None;
    };
    let scale = curve.scale(rect);
    let name = match magnified.places.get(curve.place) {
        Some((name, _)) => format!("Friction over sliding at {name}"),
        None => "Friction over sliding".to_owned(),
    };
    let title = if curve.touches { name } else { format!("{name}, latest contact") };
    let now = curve.points.last()?;
    let limit = format!("limit {}", value::quantity(now.limit, "N", 3));
    let words = format!(
        "{title}: {} after {}, {limit}",
        value::quantity(now.friction, "N", 3),
        draw::length(now.displacement, 3)
    );
    response.widget_info(|| WidgetInfo::labeled(eframe::egui::Role::Image, true, &words));
    let sheet = Sheet::new(ui, rect, magnified);
    axes(&sheet, &scale);
    let painter = sheet.painter.with_clip_rect(scale.area.expand(1.0));
    let limit_colour = colour(sheet.palette.normal);
    for sign in [1.0, -1.0] {
        let points = curve.points.iter().map(|point| scale.place(point.displacement, sign * point.limit));
        draw::polyline(&painter, points, Stroke::new(1.0, limit_colour.gamma_multiply(0.6)));
    }
    let places = curve.points.iter().map(|point| (point.time, scale.place(point.displacement, point.friction)));
    let end = scale.place(now.displacement, now.friction);
    let ink = colour(sheet.palette.friction);
    draw::fading(&sheet, &painter, ink, places, (now.time, end));
    let fill = if curve.touches { limit_colour } else { sheet.ink };
    sheet.painter.circle(end, draw::CENTRE_RADIUS, fill, Stroke::new(1.5, sheet.background));
    let title = sheet.words(rect.min + vec2(8.0, 5.0), Align2::LEFT_TOP, &title, sheet.ink);
    if curve.touches && rect.right() - title.right() > 90.0 && rect.width() >= MIN_WIDTH_WITH_LIMIT {
        sheet.words(pos2(rect.right() - 8.0, rect.top() + 5.0), Align2::RIGHT_TOP, &limit, limit_colour);
    }
    let [part, wall] = magnified.kind.parts();
    let contact = player.running().machine.loose_joints.get(joint).map(|joint| joint.contact);
    // With the velocity of the centres, the law does not see how the surfaces slide.
    let of_centres = contact.is_some_and(|contact| contact.friction_velocity == FrictionVelocity::Centres);
    let [what, area] = if of_centres {
        ["centres", ""]
    } else {
        ["surfaces", " The area of a closed loop is the energy that friction takes."]
    };
    let help = format!(
        "Friction force of the {part} on the {wall} over the displacement of their {what} since the contact began, both along the main \
         direction of sliding on the wall; the last {} of the contact at most. The orange lines are the limit of friction, + and - μ N.{area} \
         Bristles bend before they slide, and friction rises and falls along a slope; the modified Coulomb law depends on the sliding speed alone, and friction jumps where the sliding reverses.",
        value::time(player.automatic_window())
    );
    response.on_hover_text(help);
    Some((curve, scale))
}

/// The axes with their marks.
fn axes(sheet: &Sheet<'_>, scale: &FrictionScale) {
    let FrictionScale { area, displacements: [least, most], force } = *scale;
    let line = Stroke::new(1.0, sheet.faint.gamma_multiply(0.5));
    let painter = &sheet.painter;
    let zero = scale.place(least, 0.0).y;
    painter.hline(area.x_range(), zero, line);
    painter.line_segment([area.left_top(), area.left_bottom()], line);
    let mark = draw::round_down(force / (1.0 + PADDING));
    for value in [mark, 0.0, -mark] {
        let at = scale.place(least, value);
        painter.line_segment([at - vec2(3.0, 0.0), at], line);
        sheet.words(at - vec2(5.0, 0.0), Align2::RIGHT_CENTER, &value::quantity(value, "N", 3), sheet.faint);
    }
    let step = draw::round_down(0.5 * (most - least));
    let [first, last] = [(least / step).ceil(), (most / step).floor()];
    let largest = least.abs().max(most.abs());
    let (unit, digits) = (if largest < 1e-5 { "um" } else { "mm" }, value::digits_within(most - least, largest));
    let mut gap = area.x_range();
    for count in 0..=(last - first) as u32 {
        let value = (first + f64::from(count)) * step;
        let at = pos2(scale.place(value, 0.0).x, area.bottom());
        painter.line_segment([at, at - vec2(0.0, 3.0)], line);
        let (is_first, is_last) = (count == 0, value >= last * step);
        if is_first || is_last {
            let words = value::quantity(value, unit, digits);
            let words = sheet.words(at + vec2(0.0, 3.0), Align2::CENTER_TOP, &words, sheet.faint);
            if is_first { gap.min = words.right() } else { gap.max = words.left() }
        }
    }
    if gap.span() > MIN_GAP_FOR_NAME {
        sheet.words(pos2(gap.center(), area.bottom() + 3.0), Align2::CENTER_TOP, "displacement", sheet.faint);
    }
}
