//! What the interface paints over a picture: labels, the legend of the arrows, the time. Used by the viewport and
//! by headless frames.

use eframe::egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, pos2, vec2};

use super::value;
use crate::scene::{Scene, format_quantity_digits};
use crate::simulate::{ContactState, Frame};
use crate::view::{
    Colour, DrawList, Label, LabelKind, Legend, Palette, Scaling, Theme, WearMap, WearScale,
};

/// Distance of overlays from the edge, points.
const MARGIN: f32 = 14.0;

/// A view colour as a painter colour.
pub(super) fn colour(colour: Colour) -> Color32 {
    let [r, g, b, a] = colour.to_rgba8();
    Color32::from_rgba_unmultiplied(r, g, b, a)
}

/// Text with a halo in the background colour, readable over anything.
pub(super) fn text(
    painter: &Painter,
    at: Pos2,
    anchor: Align2,
    text: &str,
    size: f32,
    ink: Color32,
    halo: Color32,
) -> Rect {
    let font = FontId::proportional(size);
    let halo = halo.gamma_multiply(0.75);
    for (dx, dy) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
        painter.text(at + vec2(dx, dy), anchor, text, font.clone(), halo);
    }
    painter.text(at, anchor, text, font, ink)
}

/// Least edge of a picture that has room for more than the time, points.
pub(super) const SMALL: f32 = 200.0;

/// Whether a picture is large enough for a legend, names and forces.
pub fn has_room(rect: Rect) -> bool {
    rect.size().min_elem() >= SMALL
}

/// Plates in a picture beyond which further ones are left out, and how far one gives way to others, points: further away it
/// would seem to belong to something else.
const MOST_PLATES: usize = 256;
const FURTHEST: f32 = 72.0;

/// `place` moved down until it lies over none of `plates`; none where that is too far.
fn clear_of(plates: &[Rect], mut place: Rect) -> Option<Rect> {
    let furthest = place.min.y + FURTHEST;
    while let Some(plate) = plates.iter().find(|plate| plate.intersects(place)) {
        place = place.translate(vec2(0.0, plate.max.y + 1.0 - place.min.y));
        if place.min.y > furthest {
            return None;
        }
    }
    Some(place)
}

/// Names of joints and axes at their places.
pub fn labels(painter: &Painter, rect: Rect, scale: f32, list: &DrawList) {
    if !has_room(rect) {
        return;
    }
    let halo = colour(list.background.bottom);
    let is_peak = |label: &&Label| matches!(label.kind, LabelKind::Peak(_));
    let (mut names, mut peaks) = (Vec::new(), list.labels.iter().filter(is_peak));
    // Peaks come and go, so they give way to the names.
    let mut labels = list.labels.iter().filter(|label| !is_peak(label));
    while let Some(label) = labels.next().or_else(|| peaks.next()) {
        let at = rect.min + vec2(label.pixel.x, label.pixel.y) / scale;
        let plate = match label.kind {
            LabelKind::Joint(_) => Some((13.0, Align2::LEFT_BOTTOM, vec2(10.0, -8.0))),
            LabelKind::Peak(_) | LabelKind::Outside => {
                Some((12.0, Align2::LEFT_CENTER, vec2(9.0, 0.0)))
            }
            LabelKind::Error => Some((12.0, Align2::CENTER_TOP, vec2(0.0, 10.0))),
            LabelKind::Axis | LabelKind::Gravity => None,
        };
        if let Some((size, anchor, beside)) = plate {
            if names.len() == MOST_PLATES {
                continue;
            }
            // On a plate of its own: it often lies over a dark part.
            let font = FontId::proportional(size);
            let words = painter.layout_no_wrap(label.text.to_string(), font, colour(label.colour));
            let mut place = anchor.anchor_size(at + beside, words.size());
            if rect.contains(at) {
                let over = place.max.x + 6.0 - rect.max.x;
                place = place.translate(vec2(-over.max(0.0), 0.0));
            }
            let Some(place) = clear_of(&names, place).filter(|place| rect.intersects(*place))
            else {
                continue;
            };
            names.push(place.expand2(vec2(4.0, 1.0)));
            let opacity = 0.8 * label.colour.0[3];
            painter.rect_filled(
                place.expand2(vec2(4.0, 1.0)),
                4.0,
                halo.gamma_multiply(opacity),
            );
            painter.galley(place.min, words, colour(label.colour));
            continue;
        }
        let ink = colour(label.colour);
        text(
            painter,
            at,
            Align2::CENTER_CENTER,
            &label.text,
            12.0,
            ink,
            halo,
        );
    }
}

/// Simulated time in the upper left corner, with notes below it, on a plate of their own.
pub fn time(painter: &Painter, rect: Rect, time: f64, notes: &[String], theme: Theme) {
    let palette = Palette::of(theme);
    let ink = colour(palette.text);
    let line =
        |words: String, size: f32| painter.layout_no_wrap(words, FontId::proportional(size), ink);
    let large = has_room(rect);
    let (size, small_size, margin) = if large {
        (18.0, 13.0, MARGIN)
    } else {
        (11.0, 10.0, 6.0)
    };
    let mut lines = vec![line(format!("t = {}", value::time(time)), size)];
    // The first note says how much the play is magnified: never left out for want of room alone.
    let notes =
        notes
            .iter()
            .filter(|note| !note.is_empty())
            .take(if large { usize::MAX } else { 1 });
    lines.extend(notes.map(|note| line(note.clone(), small_size)));
    lines.retain(|line| line.size().x + 2.0 * margin <= rect.width());
    let width = lines.iter().map(|l| l.size().x).fold(0.0, f32::max);
    let height: f32 = lines.iter().map(|l| l.size().y + 1.0).sum();
    let corner = rect.min + vec2(margin, margin);
    let plate = Rect::from_min_size(corner, vec2(width, height)).expand2(vec2(8.0, 4.0));
    painter.rect_filled(plate, 6.0, colour(palette.sky).gamma_multiply(0.75));
    let mut at = corner;
    for line in lines {
        let step = line.size().y + 1.0;
        painter.galley(at, line, ink);
        at.y += step;
    }
}

/// Approximate width and height of the time with one note per joint, whatever the notes say; points.
pub fn plate(joints: usize) -> [f32; 2] {
    const LONGEST: f32 = 230.0;
    const LINE: f32 = 16.0;
    // Time and magnification come first.
    [
        MARGIN + LONGEST + 8.0,
        MARGIN + 38.0 + LINE * joints as f32 + 8.0,
    ]
}

/// One line per ball joint: its forces as the step reported them.
pub fn force_notes(scene: &Scene, frame: &Frame) -> Vec<String> {
    let newtons = |force: &crate::scene::Vec3| format_quantity_digits(force.norm(), "N", 4);
    scene
        .ball_joints
        .iter()
        .zip(&frame.joints)
        .map(|(joint, report)| match report.state {
            ContactState::Free => format!("{}  free", joint.name),
            ContactState::Ideal => {
                format!("{}  reaction {}", joint.name, newtons(&report.normal_force))
            }
            ContactState::Stick | ContactState::Slip => format!(
                "{}  normal {}, friction {}",
                joint.name,
                newtons(&report.normal_force),
                newtons(&report.friction_force)
            ),
        })
        .collect()
}

/// How to read the arrows, in the lower right corner.
pub fn legend(painter: &Painter, rect: Rect, scale: f32, legend: &Legend, theme: Theme) {
    let palette = Palette::of(theme);
    let (ink, halo) = (colour(palette.text), colour(palette.sky));
    let full = legend.pixels / scale;
    let longest = rect.width() * 0.4;
    // Close up, the reference arrow may be wider than the view: show the part that fits.
    let shown = full.min(longest);
    // Room for half a number beyond the last mark.
    let corner = lower_right(rect, MARGIN) - vec2(12.0, 0.0);
    let axis = corner.y - 18.0;
    let left = corner.x - shown;
    painter.line_segment(
        [pos2(left, axis), pos2(corner.x, axis)],
        Stroke::new(1.5, ink),
    );
    let mut free_from = f32::NEG_INFINITY;
    for tick in legend
        .ticks
        .iter()
        .filter(|tick| tick.fraction * full <= shown + 0.5)
    {
        let x = left + tick.fraction * full;
        painter.line_segment(
            [pos2(x, axis - 4.0), pos2(x, axis + 4.0)],
            Stroke::new(1.5, ink),
        );
        let words = format_quantity_digits(f64::from(tick.force), "", 3);
        // Omitted where it would touch the mark before it.
        if x - 12.0 >= free_from {
            let placed = text(
                painter,
                pos2(x, axis + 5.0),
                Align2::CENTER_TOP,
                &words,
                11.0,
                ink,
                halo,
            );
            free_from = placed.max.x + 4.0;
        }
    }
    let mut at = pos2(corner.x + 12.0, axis - 8.0);
    let mut title = match legend.scaling {
        Scaling::Linear => "Force on the ball, N".to_owned(),
        Scaling::Logarithmic => "Force on the ball, N (logarithmic)".to_owned(),
    };
    if legend.clipped {
        title.push_str(", broken ones are longer");
    }
    at.y = text(painter, at, Align2::RIGHT_BOTTOM, &title, 12.0, ink, halo)
        .min
        .y
        - 2.0;
    for (name, hue, hollow) in [
        ("friction", legend.friction, false),
        ("last peak", legend.normal.filter(|_| legend.peaks), true),
        ("normal", legend.normal, false),
    ] {
        let Some(hue) = hue else {
            continue;
        };
        let placed = text(painter, at, Align2::RIGHT_BOTTOM, name, 12.0, ink, halo);
        let tail = pos2(placed.min.x - 30.0, placed.center().y);
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
            let line = Stroke::new(1.3, colour(hue));
            painter.add(Shape::closed_line(corners, line));
        } else {
            painter.arrow(tail, vec2(24.0, 0.0), Stroke::new(2.5, colour(hue)));
        }
        at.y = placed.min.y - 1.0;
    }
}

/// What a wear map shows, and its unit.
fn wear_words(map: WearMap) -> Option<(&'static str, &'static str)> {
    match map {
        WearMap::Off => None,
        WearMap::Impulse => Some(("impulse", "N s/mm²")),
        WearMap::FrictionWork => Some(("size of friction work", "mJ/mm²")),
    }
}

/// What the colours of `list` stand for, where it has a wear map.
pub fn wear_note(list: &DrawList) -> Option<String> {
    let scale = list.wear_scale?;
    let (what, unit) = wear_words(scale.map)?;
    Some(if scale.largest > 0.0 {
        let largest = format_quantity_digits(f64::from(scale.largest), unit, 3);
        format!("wear map: {what}, at most {largest}")
    } else {
        format!("wear map: {what}, none yet")
    })
}

/// How to read the colours of a wear map, at the right edge above the legend of the arrows; left out where there is no room.
pub fn wear_scale(painter: &Painter, rect: Rect, scale: &WearScale, theme: Theme) {
    const BAR: [f32; 2] = [12.0, 110.0];
    const PARTS: u32 = 48;
    // Above: its own title, the time with its notes, the buttons of the window. Below: the legend of the arrows.
    const FREE: [f32; 2] = [100.0, 122.0];
    let Some((what, unit)) = wear_words(scale.map).filter(|_| scale.largest > 0.0) else {
        return;
    };
    let room = rect.height() - FREE[0] - FREE[1];
    if room < 0.5 * BAR[1] || !has_room(rect) {
        return;
    }
    let palette = Palette::of(theme);
    let (ink, halo) = (colour(palette.text), colour(palette.sky));
    let corner = lower_right(rect, MARGIN) - vec2(0.0, FREE[1] - MARGIN);
    let bar = Rect::from_min_max(corner - vec2(BAR[0], BAR[1].min(room)), corner);
    let at = |place: f32| bar.max.y - place * bar.height();
    for part in 0..PARTS {
        let [from, to] = [part, part + 1].map(|part| part as f32 / PARTS as f32);
        let rows = [pos2(bar.min.x, at(to)), pos2(bar.max.x, at(from))];
        let hue = colour(WearScale::colour(0.5 * (from + to)));
        painter.rect_filled(Rect::from_points(&rows), 0.0, hue);
    }
    let outline = [
        bar.left_top(),
        bar.right_top(),
        bar.right_bottom(),
        bar.left_bottom(),
    ];
    painter.add(Shape::closed_line(outline.to_vec(), Stroke::new(1.0, ink)));
    for tick in scale.ticks() {
        let y = at(scale.place(tick));
        let left = bar.min.x - 4.0;
        painter.line_segment([pos2(left, y), pos2(bar.min.x, y)], Stroke::new(1.0, ink));
        let words = format_quantity_digits(f64::from(tick), "", 1);
        let place = pos2(left - 3.0, y);
        text(
            painter,
            place,
            Align2::RIGHT_CENTER,
            &words,
            11.0,
            ink,
            halo,
        );
    }
    if rect.width() < 520.0 {
        // The note beside the time says what it is; the title would lie over a joint.
        return;
    }
    let title = format!("Wear: {what}, {unit}");
    let place = pos2(bar.max.x, bar.min.y - 6.0);
    text(
        painter,
        place,
        Align2::RIGHT_BOTTOM,
        &title,
        12.0,
        ink,
        halo,
    );
}

/// Lower right corner, `margin` points away from both edges.
pub(super) fn lower_right(rect: Rect, margin: f32) -> Pos2 {
    pos2(rect.max.x - margin, rect.max.y - margin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Context, LayerId, RawInput};
    use glam::{Vec2, Vec3};

    /// Names of a column of `count` joints, `apart` points from each other, as they are painted.
    fn painted(count: usize, apart: f32) -> Vec<(String, Pos2)> {
        let label = |joint: usize| Label {
            text: format!("J{joint}").into(),
            kind: LabelKind::Joint(joint),
            anchor: Vec3::ZERO,
            pixel: Vec2::new(300.0, 100.0 + apart * joint as f32),
            colour: Palette::of(Theme::Light).text,
        };
        let list = DrawList {
            labels: (0..count).map(label).collect(),
            ..DrawList::default()
        };
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(800.0, 600.0));
        let mut output = Context::default().run_ui(RawInput::default(), |ui| {
            let painter = Painter::new(ui.ctx().clone(), LayerId::background(), rect);
            labels(&painter, rect, 1.0, &list);
        });
        // No texture is made of them.
        output.textures_delta.clear();
        let words = output.shapes.into_iter().filter_map(|shape| {
            let Shape::Text(text) = shape.shape else {
                return None;
            };
            Some((text.galley.text().to_owned(), text.pos))
        });
        words.collect()
    }

    #[test]
    fn a_name_stands_by_its_joint_or_not_at_all() {
        let names = painted(8, 40.0);
        assert_eq!(names.len(), 8, "each has room");
        // 4096 joints on 400 points.
        let names = painted(4096, 400.0 / 4096.0);
        assert!((20..=MOST_PLATES).contains(&names.len()), "{}", names.len());
        for (name, at) in names {
            let joint: f32 = name[1..].parse().expect("a number");
            let wanted = 100.0 + joint * 400.0 / 4096.0;
            let off = (at.y - wanted).abs();
            assert!(
                off <= FURTHEST + 30.0,
                "{name}: {off} points from its joint"
            );
        }
    }
}
