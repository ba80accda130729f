//! Pictures of a block between the walls of its guide, with the gaps of its corners.

use eframe::egui::{Align2, Rect, Shape, Stroke, pos2, vec2};
use glam::Vec3;

use super::draw::{self, Sheet};
use crate::app::overlay::colour;
use crate::app::paths::Point;
use crate::app::value;
use crate::machine::Slide;
use crate::view::to_f32;

/// Half length of the block, its half width, and the play, as fractions of the width and of the height of its picture.
const HALF_LENGTH: f32 = 0.33;
const HALF_WIDTH: f32 = 0.17;
const PLAY: f32 = 0.14;
/// Length of the arrow of the largest force, as a fraction of the height.
const ARROW: f32 = 0.26;
/// Radius of the mark of a corner, points.
const MARK: f32 = 3.5;

/// Signs of x and of the axis across the walls, of the corners in a view.
const CORNERS: [[usize; 2]; 4] = [[0, 0], [0, 1], [1, 0], [1, 1]];

/// The place with the smallest gap among those that a view shows in one corner.
fn nearest(gaps: &[f64], candidates: &[usize]) -> Option<usize> {
    let known = candidates.iter().copied().filter(|place| *place < gaps.len());
    known.min_by(|a, b| gaps[*a].total_cmp(&gaps[*b]))
}

/// Places in the corner `[x, across]` of the view across y (`view` 0) or z, by their order among the names of the sites.
pub fn places(is_planar: bool, view: usize, [x, across]: [usize; 2]) -> Vec<usize> {
    match (is_planar, view) {
        (true, _) => vec![2 * x + across],
        (false, 0) => [0, 1].map(|z| 2 * (4 * x + 2 * across + z)).to_vec(),
        (false, _) => [0, 1].map(|y| 2 * (4 * x + 2 * y + across) + 1).to_vec(),
    }
}

/// One view across each pair of walls, with the path of the block's centre up to `now`. Returns what the picture shows.
pub fn draw(sheet: &Sheet<'_>, kind: &Slide, path: &[Point], now: f64) -> &'static str {
    let magnified = sheet.magnified();
    let is_planar = kind.half_height.is_none();
    let views = if is_planar { 1 } else { 2 };
    let forces = magnified.places.iter().map(|(_, site)| site.normal_force.norm());
    let largest = forces.fold(0.0, f64::max);
    let report = &magnified.report;
    let height = (sheet.rect.height() - 20.0) / views as f32;
    for view in 0..views {
        let top = sheet.rect.top() + view as f32 * height;
        let rect = Rect::from_x_y_ranges(sheet.rect.x_range(), top..=top + height);
        let (play, half) = match view {
            0 => (report.clearance, kind.half_width),
            _ => (report.second_clearance, kind.half_height.unwrap_or_default()),
        };
        one_view(sheet, rect, &View { axis: 1 + view, play, half: [kind.half_length, half], largest, path, now });
    }
    let tilt = value::quantity(report.tilt, "deg", 3);
    let mut words = format!("tilt {tilt}");
    if largest > 0.0 {
        words += &format!(", longest arrow {}", value::quantity(largest, "N", 3));
    }
    words += &draw::path_words(path, now);
    let below = pos2(sheet.rect.center().x, sheet.rect.bottom() - 4.0);
    sheet.words(below, Align2::CENTER_BOTTOM, &words, sheet.ink);
    "The block between the walls of its guide, with the gap or the depth of each corner. The play is magnified until it can be \
     seen, by the factor given. A corner in contact is orange; its arrow is the normal force on the block. Of two corners behind \
     each other the nearer to its wall is shown. The path of the block's centre covers the latest six impacts and fades with age: along \
     the guide it has the scale of the block (recorded for the first 12 joints)."
}

/// What one view shows.
struct View<'a> {
    /// Axis of the guide across the walls, 1 or 2, and the play there, m.
    axis: usize,
    play: f64,
    /// Half length of the block, and half of its dimension across the walls, m.
    half: [f64; 2],
    /// The force of the longest arrow, N.
    largest: f64,
    path: &'a [Point],
    now: f64,
}

/// The view across one pair of walls.
fn one_view(sheet: &Sheet<'_>, rect: Rect, shown: &View<'_>) {
    let &View { axis: number, play, half: [half_length, half], largest, path, now } = shown;
    let view = number - 1;
    let Sheet { painter, palette, .. } = sheet;
    let magnified = sheet.magnified();
    let contact = colour(palette.normal);
    let wall_colour = colour(palette.socket.colour.with_opacity(0.9));
    let centre = rect.center();
    let [long, wide, gap] = [HALF_LENGTH * rect.width(), HALF_WIDTH * rect.height(), PLAY * rect.height()];
    let axis = ["y", "z"][view];
    let left = pos2(rect.left() + 6.0, centre.y);
    let mut scale = String::new();
    if play <= 0.0 {
        sheet.words(left, Align2::LEFT_CENTER, &format!("{axis}: no play"), sheet.faint);
    } else {
        let factor = (gap / wide) as f64 * half / play;
        let words = format!("{axis}, play {}, drawn ×{}", draw::length(play, 3), value::number(factor, 2));
        scale = words;
    }
    let reach = vec2(0.46 * rect.width(), 0.0);
    for side in [-1.0, 1.0] {
        let at = centre + vec2(0.0, side * (wide + gap));
        painter.line_segment([at - reach, at + reach], Stroke::new(2.0, wall_colour));
    }
    let is_planar = magnified.places.len() == 4;
    let gaps: Vec<f64> = magnified.places.iter().map(|(_, site)| site.gap).collect();
    let sign = |positive: usize| if positive == 1 { 1.0 } else { -1.0_f32 };
    let corner = |[x, across]: [usize; 2]| {
        let place = nearest(&gaps, &places(is_planar, view, [x, across]));
        let open = place.map(|place| gaps[place]).filter(|gap| gap.is_finite() && play > 0.0);
        let out = wide + gap * open.map_or(1.0, |open| (1.0 - open / play) as f32);
        // The second axis points up.
        (place, centre + vec2(sign(x) * long, -sign(across) * out))
    };
    let outline = [[0, 0], [0, 1], [1, 1], [1, 0]].map(|signs| corner(signs).1);
    painter.add(Shape::closed_line(outline.to_vec(), Stroke::new(1.5, sheet.ink)));
    if play <= 0.0 {
        return;
    }
    let [along, across] = [0, number].map(|i| to_f32(&magnified.axes[0].column(i).into_owned()));
    let [stretch, factor] = [f64::from(long) / half_length, f64::from(gap) / play].map(|scale| scale as f32);
    // The view goes along the guide with the block.
    let at = magnified.report.axial as f32;
    let scaled = |v: Vec3| centre + vec2((v.dot(along) - at) * stretch, -v.dot(across) * factor);
    let block = to_f32(&magnified.report.eccentricity) + along * at;
    draw::path(sheet, &painter.with_clip_rect(rect), path, now, scaled, scaled(block));
    // In the block, which moves, below the path of its centre.
    let below = outline[0].lerp(outline[2], 0.5) + vec2(0.0, 0.5 * wide);
    sheet.words(below, Align2::CENTER_CENTER, &scale, sheet.faint);
    for signs in CORNERS {
        let (Some(place), at) = corner(signs) else {
            continue;
        };
        let (name, site) = &magnified.places[place];
        let touches = site.gap < 0.0;
        let ink = if touches { contact } else { sheet.ink };
        let up = sign(signs[1]);
        if touches && largest > 0.0 {
            let arrow = vec2(0.0, up * ARROW * rect.height() * (site.normal_force.norm() / largest) as f32);
            if arrow.length() > 2.0 {
                painter.arrow(at, arrow, Stroke::new(2.0, contact));
            }
        }
        painter.circle_filled(at, MARK, ink);
        let name = name.strip_prefix(&magnified.name).map_or(name.as_str(), |place| place.trim_start_matches('.'));
        let words = match site.gap {
            gap if gap < 0.0 => format!("{name}: {} deep", draw::length(-gap, 3)),
            gap => format!("{name}: {}", draw::length(gap, 3)),
        };
        let beyond = pos2(at.x, centre.y - up * (wide + gap + 4.0));
        let align = if up > 0.0 { Align2::CENTER_BOTTOM } else { Align2::CENTER_TOP };
        sheet.words(beyond, align, &words, ink);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::LooseKind;

    #[test]
    fn each_corner_of_a_view_shows_the_places_that_lie_there() {
        for half_height in [None, Some(0.01)] {
            let kind =
                LooseKind::Slide(Slide { half_length: 0.02, half_width: 0.01, half_height, corner_radius: 1e-3 });
            let names = kind.site_names();
            let mut seen = vec![0; names.len()];
            for view in 0..if half_height.is_some() { 2 } else { 1 } {
                for signs in CORNERS {
                    for place in places(half_height.is_none(), view, signs) {
                        seen[place] += 1;
                        // 1 is - - -, 2 - - +, 3 - + -: in the order of the signs of x, y, z.
                        let corner = names[place][..1].parse::<usize>().expect("a digit") - 1;
                        let across = if view == 0 { corner >> 1 & 1 } else { corner & 1 };
                        assert_eq!([corner >> 2, across], signs, "{}", names[place]);
                        assert!(names[place].ends_with(["y", "z"][view]));
                    }
                }
            }
            assert!(seen.iter().all(|count| *count == 1), "{seen:?}");
        }
        assert_eq!(nearest(&[3e-4, -1e-6, 2e-4], &[0, 1]), Some(1));
    }
}
