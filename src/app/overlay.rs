//! Overlays painted on a picture: labels, arrow legend, time. Used by the viewport and by headless frames.

use eframe::egui::epaint::RectShape;
use eframe::egui::{Align2, FontId, Painter, Pos2, Rect, Shape, Stroke, pos2, vec2};

use super::labels::{self, LabelPositions};
pub(super) use super::labels::{SMALL_PICTURE, colour, fits_labels, text};
use super::value;
use crate::scene::Scene;
use crate::simulate::{ContactMode, Frame};
use crate::units::format_quantity_digits;
use crate::view::{ARROW_LENGTH, DrawList, Legend, Palette, Scaling, Theme, ViewOptions, WearMap, WearScale};

/// Distance of overlays from the edge, points.
const MARGIN: f32 = 14.0;

/// Font size of the time in a picture with enough room, points.
const TIME_FONT_SIZE: f32 = 18.0;

/// Usual longest line of the time, and of the notes on joints below it, points.
const LINE_LENGTHS: [f32; 2] = [150.0, 230.0];

/// Longest axis of the legend relative to the picture's width.
const MAX_AXIS_FRACTION: f32 = 0.4;

/// Contents of the overlay.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Simulated time, s.
    pub time: Option<f64>,
    /// Lines below the time, after those about the picture itself; e.g. [`force_notes`].
    pub notes: Vec<String>,
    /// Whether to draw the legend of the arrows.
    pub legend: bool,
    /// Whether to draw names of joints and axes.
    pub labels: bool,
}

/// Paints the overlay of `list` in `rect`; `scale` is pixels per point. Names avoid the rest and the rectangles painted `above`
/// it, and reuse their `places` in the previous picture where possible.
#[expect(clippy::too_many_arguments, reason = "one call for a whole picture")]
pub fn paint(
    painter: &Painter,
    rect: Rect,
    scale: f32,
    list: &DrawList,
    theme: Theme,
    overlay: &Overlay,
    above: &[Rect],
    places: &mut LabelPositions,
) {
    let mut occupied = above.to_vec();
    if !list.overlay.is_empty() {
        occupied.push(triad(rect));
    }
    if let Some(scale) = &list.wear_scale {
        occupied.extend(wear_scale(painter, rect, scale, theme));
    }
    if let Some(shown) = list.legend.as_ref().filter(|_| overlay.legend && fits_labels(rect)) {
        occupied.push(legend(painter, rect, scale, shown, theme));
    }
    if let Some(at) = overlay.time {
        let notes = [Some(list.magnification_text.clone()), wear_note(list)];
        let notes = notes.into_iter().flatten().chain(overlay.notes.clone());
        occupied.push(time(painter, rect, at, notes, theme));
    }
    if overlay.labels {
        labels::paint(painter, rect, scale, list, occupied, places);
    }
}

/// Simulated time in the upper left corner with notes below it, on a plate; returns the plate.
fn time(painter: &Painter, rect: Rect, time: f64, notes: impl Iterator<Item = String>, theme: Theme) -> Rect {
    let palette = Palette::of(theme);
    let ink = colour(palette.text);
    let line = |words: String, size: f32| painter.layout_no_wrap(words, FontId::proportional(size), ink);
    let large = fits_labels(rect);
    let (size, small_size, margin) = if large { (TIME_FONT_SIZE, 13.0, MARGIN) } else { (11.0, 10.0, 6.0) };
    let mut lines = vec![line(format!("t = {}", value::time(time)), size)];
    // The first note states the magnification of the play and is never omitted for lack of room alone.
    let notes = notes.filter(|note| !note.is_empty());
    let notes = notes.take(if large { usize::MAX } else { 1 });
    lines.extend(notes.map(|note| line(note, small_size)));
    lines.retain(|line| line.size().x + 2.0 * margin <= rect.width());
    let mut width = lines.iter().map(|l| l.size().x).fold(0.0, f32::max);
    if large {
        // Otherwise the plate would jump as the digits of the time change.
        width = width.max(LINE_LENGTHS[0].min(rect.width() - 2.0 * margin));
    }
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
    plate
}

/// Right edge of the longest possible time in a picture, points.
pub fn time_extent(painter: &Painter) -> f32 {
    let longest = format!("t = {} ms", "0".repeat(value::MAX_TIME_CHARACTERS - 3));
    let words =
        painter.layout_no_wrap(longest, FontId::proportional(TIME_FONT_SIZE), colour(Palette::of(Theme::Light).text));
    MARGIN + words.size().x + 8.0
}

/// Approximate width and height of the time with one note per joint, whatever the text; points.
pub fn plate(joints: usize) -> [f32; 2] {
    const LINE: f32 = 16.0;
    // The first lines are time and magnification.
    let longest = LINE_LENGTHS[usize::from(joints > 0)];
    [MARGIN + longest + 8.0, MARGIN + 38.0 + LINE * joints as f32 + 8.0]
}

/// Approximate area of axes and gravity.
fn triad(rect: Rect) -> Rect {
    // Gravity is beside the axes if there is room: `SceneView::push_triad`.
    let width = if rect.width() < 300.0 { 118.0 } else { 164.0 };
    Align2::LEFT_BOTTOM.align_size_within_rect(vec2(width, 118.0), rect)
}

/// Approximate areas of the time with one note per joint, the axes and the legend in a picture in `rect`.
pub fn plates(rect: Rect, joints: usize, options: &ViewOptions) -> Vec<Rect> {
    let large = fits_labels(rect);
    let [width, height] = if large { plate(joints) } else { [130.0, 36.0] };
    let mut plates = vec![Align2::LEFT_TOP.align_size_within_rect(vec2(width, height), rect)];
    if options.triad && large {
        plates.push(triad(rect));
    }
    if (options.arrows.normal || options.arrows.friction) && large {
        let [least, rows] = match options.arrows.scaling {
            Scaling::Linear => [112.0, 88.0],
            Scaling::Logarithmic => [190.0, 88.0],
        };
        let axis = (ARROW_LENGTH * rect.height()).min(MAX_AXIS_FRACTION * rect.width()) + 24.0;
        let size = vec2(axis.max(least) + MARGIN + 6.0, rows + MARGIN);
        plates.push(Align2::RIGHT_BOTTOM.align_size_within_rect(size, rect));
    }
    plates
}

/// One line per ball joint: its forces as the step reported them.
pub fn force_notes(scene: &Scene, frame: &Frame) -> Vec<String> {
    let newtons = |force: &crate::machine::Vec3| format_quantity_digits(force.norm(), "N", 4);
    scene
        .machine
        .loose_joints
        .iter()
        .zip(&frame.joints)
        .map(|(joint, report)| match report.state {
            ContactMode::Free => format!("{}  free", joint.name),
            ContactMode::Ideal => {
                format!("{}  reaction {}", joint.name, newtons(&report.normal_force))
            }
            ContactMode::Creep | ContactMode::Slip => format!(
                "{}  normal {}, friction {}",
                joint.name,
                newtons(&report.normal_force),
                newtons(&report.friction_force)
            ),
        })
        .collect()
}

/// Legend of the arrows in the lower right corner; returns its area.
fn legend(painter: &Painter, rect: Rect, scale: f32, legend: &Legend, theme: Theme) -> Rect {
    let palette = Palette::of(theme);
    let (ink, halo) = (colour(palette.text), colour(palette.sky));
    let full = legend.pixels / scale;
    let longest = rect.width() * MAX_AXIS_FRACTION;
    // In a close-up the reference arrow may be wider than the view; only the part that fits is drawn.
    let shown = full.min(longest);
    // Space for half a number beyond the last mark.
    let corner = lower_right(rect, MARGIN) - vec2(12.0, 0.0);
    let axis = corner.y - 18.0;
    let back = painter.add(Shape::Noop);
    let left = corner.x - shown;
    painter.line_segment([pos2(left, axis), pos2(corner.x, axis)], Stroke::new(1.5, ink));
    let mut all = Rect::from_min_max(pos2(left, axis), corner + vec2(12.0, 0.0));
    let mut free_from = f32::NEG_INFINITY;
    for tick in legend.ticks.iter().filter(|tick| tick.fraction * full <= shown + 0.5) {
        let x = left + tick.fraction * full;
        painter.line_segment([pos2(x, axis - 4.0), pos2(x, axis + 4.0)], Stroke::new(1.5, ink));
        let words = format_quantity_digits(f64::from(tick.force), "", 3);
        // Omitted if it would touch the previous mark.
        if x - 12.0 >= free_from {
            let placed = text(painter, pos2(x, axis + 5.0), Align2::CENTER_TOP, &words, 11.0, ink, halo);
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
    let placed = text(painter, at, Align2::RIGHT_BOTTOM, &title, 12.0, ink, halo);
    all |= placed;
    at.y = placed.min.y - 2.0;
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
        all |= Rect::from_min_max(tail - vec2(0.0, 4.5), placed.max);
        at.y = placed.min.y - 1.0;
    }
    let plate = all.expand2(vec2(6.0, 3.0)).intersect(rect);
    painter.set(back, RectShape::filled(plate, 6.0, halo.gamma_multiply(0.75)));
    plate
}

/// Quantity of a wear map, and its unit.
fn wear_words(map: WearMap) -> Option<(&'static str, &'static str)> {
    match map {
        WearMap::Off => None,
        WearMap::Impulse => Some(("impulse", "N s/mm²")),
        WearMap::FrictionWork => Some(("size of friction work", "mJ/mm²")),
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

/// Colour scale of a wear map, at the right edge above the legend of the arrows; returns its area. Omitted if there is no room.
fn wear_scale(painter: &Painter, rect: Rect, scale: &WearScale, theme: Theme) -> Option<Rect> {
    const BAR_SIZE: [f32; 2] = [12.0, 110.0];
    const PARTS: u32 = 48;
    // Above: title, time with notes, buttons of the window. Below: legend of the arrows.
    const MARGINS: [f32; 2] = [100.0, 122.0];
    let (what, unit) = wear_words(scale.map).filter(|_| scale.largest > 0.0)?;
    let room = rect.height() - MARGINS[0] - MARGINS[1];
    if room < 0.5 * BAR_SIZE[1] || !fits_labels(rect) {
        return None;
    }
    let palette = Palette::of(theme);
    let (ink, halo) = (colour(palette.text), colour(palette.sky));
    let corner = lower_right(rect, MARGIN) - vec2(0.0, MARGINS[1] - MARGIN);
    let bar = Rect::from_min_max(corner - vec2(BAR_SIZE[0], BAR_SIZE[1].min(room)), corner);
    let at = |place: f32| bar.max.y - place * bar.height();
    for part in 0..PARTS {
        let [from, to] = [part, part + 1].map(|part| part as f32 / PARTS as f32);
        let rows = [pos2(bar.min.x, at(to)), pos2(bar.max.x, at(from))];
        let hue = colour(WearScale::colour(0.5 * (from + to)));
        painter.rect_filled(Rect::from_points(&rows), 0.0, hue);
    }
    let outline = [bar.left_top(), bar.right_top(), bar.right_bottom(), bar.left_bottom()];
    painter.add(Shape::closed_line(outline.to_vec(), Stroke::new(1.0, ink)));
    let mut all = bar;
    for tick in scale.ticks() {
        let y = at(scale.position(tick));
        let left = bar.min.x - 4.0;
        painter.line_segment([pos2(left, y), pos2(bar.min.x, y)], Stroke::new(1.0, ink));
        let words = format_quantity_digits(f64::from(tick), "", 1);
        let place = pos2(left - 3.0, y);
        all |= text(painter, place, Align2::RIGHT_CENTER, &words, 11.0, ink, halo);
    }
    // In a narrow picture the title would cover a joint; the note beside the time has the same information.
    if rect.width() >= 520.0 {
        let title = format!("Wear: {what}, {unit}");
        let place = pos2(bar.max.x, bar.min.y - 6.0);
        all |= text(painter, place, Align2::RIGHT_BOTTOM, &title, 12.0, ink, halo);
    }
    Some(all)
}

/// Lower right corner, `margin` points away from both edges.
pub(super) fn lower_right(rect: Rect, margin: f32) -> Pos2 {
    pos2(rect.max.x - margin, rect.max.y - margin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::labels::{MAX_GAP, MAX_PLATES, MIN_LEADER};
    use crate::app::theme;
    use crate::view::{Label, LabelKind, PeakMarks, SceneView, Shot, ViewOptions};
    use eframe::egui::{Context, LayerId, RawInput};
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

    #[test]
    fn the_plate_of_the_time_does_not_move_as_digits_change() {
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(800.0, 600.0));
        let plates = [0.0, 9.9e-6, 0.9999e-3, 9.9999e-3, 10e-3, 0.9999, 123.4].map(|at| {
            let found = std::cell::Cell::new(Rect::NOTHING);
            let note = ["clearance drawn ×20".to_owned()];
            shapes(rect, |painter| found.set(time(painter, rect, at, note.clone().into_iter(), Theme::Light)));
            found.get()
        });
        assert!(plates.iter().all(|plate| *plate == plates[0]), "{plates:?}");
    }

    #[test]
    fn a_name_keeps_clear_of_time_legend_and_caption() {
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(800.0, 600.0));
        let caption = Rect::from_min_size(pos2(300.0, 12.0), vec2(200.0, 40.0));
        let at = |x: f32, y: f32| Label {
            text: "S1".into(),
            kind: LabelKind::Joint(0),
            anchor: Vec3::ZERO,
            pixel: glam::Vec2::new(x, y),
            colour: Palette::of(Theme::Light).text,
        };
        // Inside the time's plate, below the caption, and at the legend.
        let list = DrawList {
            labels: vec![at(60.0, 45.0), at(400.0, 60.0), at(700.0, 575.0)],
            legend: Some(Legend {
                reference: 100.0,
                pixels: 120.0,
                scaling: Scaling::Linear,
                clipped: false,
                ticks: Vec::new(),
                normal: Some(Palette::of(Theme::Light).text),
                peaks: false,
                friction: None,
            }),
            ..DrawList::default()
        };
        let overlay = Overlay { time: Some(0.0), legend: true, labels: true, ..Overlay::default() };
        let texts = |overlay: &Overlay| {
            let shapes = shapes(rect, |painter| {
                let mut places = LabelPositions::default();
                paint(painter, rect, 1.0, &list, Theme::Light, overlay, &[caption], &mut places);
            });
            let texts = shapes.into_iter().filter_map(|shape| match shape {
                Shape::Text(text) => Some((text.galley.text().to_owned(), text.visual_bounding_rect())),
                _ => None,
            });
            texts.collect::<Vec<_>>()
        };
        let all = texts(&overlay);
        let (names, others): (Vec<_>, Vec<_>) = all.into_iter().partition(|(text, _)| text == "S1");
        assert_eq!(names.len(), 3);
        assert!(others.len() > 2);
        for (_, name) in &names {
            assert!(!name.intersects(caption));
            for (other, place) in &others {
                assert!(!name.intersects(*place), "over {other}");
            }
        }
        // Alone, the labels would overlap the time.
        let labels_only = texts(&Overlay { labels: true, ..Overlay::default() });
        assert!(labels_only[0].1.intersects(others.iter().find(|(text, _)| text.starts_with("t =")).expect("time").1));
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
