//! Pictures of a pin in its bearing: a section across the axis at each end, and the gaps of its collars.

use eframe::egui::{Align2, Stroke, pos2, vec2};
use glam::Vec3;

use super::draw::{self, Sheet};
use super::magnified_joint::MagnifiedJoint;
use crate::app::overlay::colour;
use crate::app::paths::{Point, ends_of_pin};
use crate::app::value;
use crate::machine::Pin;
use crate::view::to_f32;

/// Radius of the mark of the pin's axis, points.
const MARK: f32 = 4.0;
/// Heights of the title of the circles, of the words below them, and of the gaps of the collars, points.
const TITLE: f32 = 18.0;
const WORDS: f32 = 34.0;
const FACES: f32 = 46.0;
/// Length of the arrow of the largest force, in radii of the circles.
const ARROW: f32 = 0.85;
/// Share of the room that the circles take.
const SHARE: f32 = 0.8;

/// Vectors to the right and up in a section across the bearing's axis, seen as nearly as possible from where `axes` is.
pub fn across(magnified: &MagnifiedJoint, axes: [Vec3; 2]) -> [Vec3; 2] {
    let column = |i: usize| to_f32(&magnified.axes[0].column(i).into_owned());
    let axis = column(0);
    let towards = if axes[0].cross(axes[1]).dot(axis) < 0.0 { -axis } else { axis };
    let up = axes[1].reject_from_normalized(axis);
    let up = if up.length() > 0.1 { up.normalize() } else { column(1) };
    [up.cross(towards), up]
}

/// Both sections with the paths of the ends up to `now`, and the gaps of the collars. Returns what the picture shows.
pub fn draw(sheet: &Sheet<'_>, kind: &Pin, axes: [Vec3; 2], paths: [&[Point]; 2], now: f64) -> &'static str {
    let Sheet { painter, rect, palette, .. } = sheet;
    let magnified = sheet.magnified();
    let report = &magnified.report;
    let axes = across(magnified, axes);
    let has_faces = kind.kept && report.second_clearance > 0.0;
    let below = WORDS + if has_faces { FACES } else { 0.0 };
    let room = vec2(0.5 * rect.width(), (rect.height() - TITLE - below).max(40.0));
    let radius = 0.5 * SHARE * room.min_elem();
    let contact = colour(palette.normal);
    let force = |place: usize| magnified.places.get(place).map_or(0.0, |(_, site)| site.normal_force.norm());
    let largest = force(0).max(force(1));
    for (place, axis) in ends_of_pin(kind, report, &magnified.axes).iter().enumerate() {
        let Some((name, site)) = magnified.places.get(place) else {
            continue;
        };
        let centre = pos2(rect.left() + (0.5 + place as f32) * room.x, rect.top() + TITLE + 0.5 * room.y);
        let touches = site.gap < 0.0;
        sheet.words(
            pos2(centre.x, rect.top() + 4.0),
            Align2::CENTER_TOP,
            name,
            if touches { contact } else { sheet.ink },
        );
        let hairline = Stroke::new(1.0, sheet.faint.gamma_multiply(0.5));
        for reach in [vec2(radius, 0.0), vec2(0.0, radius)] {
            painter.line_segment([centre - reach, centre + reach], hairline);
        }
        let clearance = report.clearance as f32;
        let worn = draw::outline(magnified, place, axes);
        let scale = radius / worn.as_ref().map_or(clearance, |worn| worn.reach);
        if report.clearance > 0.0 {
            draw::wall(sheet, (centre, scale), clearance, worn.as_ref());
        } else {
            let wall = colour(palette.socket.colour.with_opacity(0.9));
            painter.circle_stroke(centre, radius, Stroke::new(1.5, wall));
            sheet.words(centre, Align2::CENTER_CENTER, "no radial play", sheet.faint);
            continue;
        }
        let project = |v: Vec3| vec2(v.dot(axes[0]), -v.dot(axes[1]));
        let scaled = |v: Vec3| centre + project(v) * scale;
        let at = scaled(to_f32(axis));
        draw::path(sheet, painter, paths[place], now, scaled, at);
        if touches {
            let (foot, out) = match worn {
                None => {
                    let out = (at - centre).normalized();
                    (centre + out * radius, out)
                }
                Some(_) => {
                    let pressed = site.normal_force.try_normalize(0.0).map(|force| -force);
                    let normal = pressed.unwrap_or_else(|| axis.normalize());
                    (scaled(to_f32(&magnified.limit(place, &normal))), project(to_f32(&normal)).normalized())
                }
            };
            let along = vec2(-out.y, out.x) * 9.0;
            painter.line_segment([foot - along, foot + along], Stroke::new(2.0, contact));
        }
        if largest > 0.0 {
            let arrow = project(to_f32(&site.normal_force)) * (ARROW * radius / largest as f32);
            if arrow.length() > 2.0 {
                painter.arrow(at, arrow, Stroke::new(2.0, contact));
            }
        }
        painter.circle_filled(at, MARK, if touches { contact } else { sheet.ink });
        let gap = match site.gap {
            gap if gap < 0.0 => format!("{} deep, {}", draw::length(-gap, 3), value::quantity(force(place), "N", 3)),
            gap => format!("gap {}", draw::length(gap, 3)),
        };
        let under = pos2(centre.x, centre.y + 0.5 * room.y - 1.0);
        sheet.words(under, Align2::CENTER_BOTTOM, &gap, if touches { contact } else { sheet.ink });
    }
    let tilt = value::quantity(report.tilt, "deg", 3);
    let words = format!("tilt {tilt}, axial position {}", draw::length(report.axial, 3));
    let line = rect.top() + TITLE + room.y + 4.0;
    sheet.words(pos2(rect.center().x, line), Align2::CENTER_TOP, &words, sheet.ink);
    let mut scale = match largest > 0.0 {
        true => {
            format!("circle {}, longest arrow {}", draw::length(report.clearance, 3), value::quantity(largest, "N", 3))
        }
        false => format!("circle: clearance {}", draw::length(report.clearance, 3)),
    };
    scale += &draw::path_words(paths[0], now);
    sheet.words(pos2(rect.center().x, line + 14.0), Align2::CENTER_TOP, &scale, sheet.faint);
    if has_faces {
        faces(sheet);
    }
    "Sections across the bearing at both ends. The outlines are how far the pin's axis can go; the mark is that axis, which leaves them only by \
     the penetration. Its path covers the latest six impacts and fades with age (recorded for the first 12 joints). In contact mark and wall are orange, and the arrow is the normal force on the pin. The line below is the \
     play along the axis, with the gaps of the collars: of a tilted pin they close before the mark reaches the end."
}

/// The play along the axis: a mark between the faces.
fn faces(sheet: &Sheet<'_>) {
    let Sheet { painter, rect, palette, .. } = sheet;
    let magnified = sheet.magnified();
    let contact = colour(palette.normal);
    let wall = colour(palette.socket.colour.with_opacity(0.9));
    let (y, half) = (rect.bottom() - 28.0, 0.3 * rect.width());
    let centre = pos2(rect.center().x, y);
    painter.line_segment([centre - vec2(half, 0.0), centre + vec2(half, 0.0)], Stroke::new(1.0, sheet.faint));
    // To the right the pin moves towards +axis, onto its front face.
    for (place, side) in [(3, -1.0), (2, 1.0)] {
        let Some((name, site)) = magnified.places.get(place) else {
            continue;
        };
        let touches = site.gap < 0.0;
        let ink = if touches { contact } else { sheet.ink };
        let end = centre + vec2(side * half, 0.0);
        let stroke = Stroke::new(if touches { 3.0 } else { 2.0 }, if touches { contact } else { wall });
        painter.line_segment([end - vec2(0.0, 9.0), end + vec2(0.0, 9.0)], stroke);
        let gap = match site.gap {
            gap if gap < 0.0 => {
                let force = value::quantity(site.normal_force.norm(), "N", 3);
                format!("{name}: {} deep, {force}", draw::length(-gap, 3))
            }
            gap => format!("{name}: gap {}", draw::length(gap, 3)),
        };
        let (at, align) = match side < 0.0 {
            true => (pos2(rect.left() + 8.0, y + 11.0), Align2::LEFT_TOP),
            false => (pos2(rect.right() - 8.0, y + 11.0), Align2::RIGHT_TOP),
        };
        sheet.words(at, align, &gap, ink);
    }
    let share = (magnified.report.axial / magnified.report.second_clearance) as f32;
    painter.circle_filled(centre + vec2(share.clamp(-1.2, 1.2) * half, 0.0), MARK, sheet.ink);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::player::Player;
    use crate::machine::LooseKind;
    use crate::scene::Scene;

    #[test]
    fn each_end_is_drawn_at_its_own_distance_from_the_wall() {
        for ends_on in ["pin", "bearing"] {
            let text = crate::scene::built_in_text("thrown-pin").expect("a benchmark").to_owned();
            let text = text.replace("ends = \"pin\"", &format!("ends = \"{ends_on}\""));
            let scene = Scene::parse(&text, None, &[]).expect("a scene");
            let mut player = Player::new(&scene).expect("starts");
            let (mut touched, mut apart) = ([0; 2], 0);
            for _ in 0..600 {
                player.single_step();
                let magnified = MagnifiedJoint::of(&player, 0).expect("a joint");
                let LooseKind::Pin(kind) = magnified.kind else {
                    panic!("a pin");
                };
                let ends = ends_of_pin(&kind, &magnified.report, &magnified.axes);
                for (place, axis) in ends.iter().enumerate() {
                    let site = magnified.places[place].1;
                    // The gap neglects nothing but the square of the tilt: (2 c / L)^2 of c.
                    let gap = magnified.report.clearance - axis.norm();
                    assert!((gap - site.gap).abs() < 1e-8, "{place}: {gap} {}", site.gap);
                    touched[place] += u32::from(site.gap < 0.0);
                }
                let [a, b] = [0, 1].map(|place| magnified.places[place].1.gap < 0.0);
                apart += u32::from(a != b);
                let words = magnified.in_words();
                assert!(words.starts_with("Pin J under the microscope. ") && words.contains(", tilt "), "{words}");
                assert_eq!(words.contains("J.a"), a, "{words}");
                assert_eq!(words.contains("J.b"), b, "{words}");
            }
            assert!(touched[0] > 3 && touched[1] > 3 && apart > 3, "{touched:?} {apart}");
        }
    }
}
