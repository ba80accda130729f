//! Placement of labels (joint names, force magnitudes and the like) in a picture: clear of each other, of other text and of the
//! machine; a label without such a place is omitted. A label keeps its place relative to its anchor until that place becomes
//! unsuitable.

use std::collections::HashMap;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use eframe::egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Vec2, pos2, vec2};

use crate::view::{Colour, Cover, DrawList, Label, LabelKind};

/// Most plates in a picture; number of names without room after which no more are tried.
pub(super) const MAX_PLATES: usize = 256;
const MAX_UNPLACED: usize = 256;
/// Distances of a plate from its anchor, points; a plate further away would seem to belong to something else.
const GAPS: [f32; 8] = [8.0, 16.0, 28.0, 42.0, 57.0, 72.0, 96.0, MAX_GAP];
pub(super) const MAX_GAP: f32 = 120.0;
/// Directions from the anchor to the plate, from the preferred to the opposite direction.
const DIRECTIONS: [f32; 12] = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0, -4.0, 5.0, -5.0, 6.0];
/// Distance beyond which a leader line connects the plate to its anchor, points.
pub(super) const MIN_LEADER: f32 = 14.0;
/// Padding around the text of a plate, points.
const PADDING: Vec2 = vec2(4.0, 1.0);
/// Cell size of the coverage map of bodies, points.
const CELL_SIZE: f32 = 3.0;
/// Distances of a new place from the machine, points, if there is one: the farther, the longer a label keeps it.
const CLEARANCES: [f32; 3] = [16.0, 8.0, 3.0];
/// Cost of a place: each further distance, each further direction.
const GAP_COST: f32 = 0.08;
const DIRECTION_COST: f32 = 0.015;
/// Cost of a leader that crosses another plate, or crosses this one.
const CROSSING_COST: f32 = 2.0;
/// Cost difference from the best place at which a label moves.
const MOVING_THRESHOLD: f32 = 0.6;
/// Opacity below which a peak mark has no label.
const MIN_OPACITY: f32 = 0.25;

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

/// Smallest edge of a picture with room for more than the time, points.
pub(super) const SMALL_PICTURE: f32 = 200.0;

/// Whether a picture is large enough for a legend, names and forces.
pub fn fits_labels(rect: Rect) -> bool {
    rect.size().min_elem() >= SMALL_PICTURE
}

/// Indices of distance and direction.
type Place = (usize, usize);

/// Label positions of a picture, reused in the next.
#[derive(Clone, Debug, Default)]
pub struct LabelPositions {
    pub(super) own: HashMap<LabelKind, Place>,
    /// Those of the picture beside it, which come first, so that both look alike.
    pub(super) beside: HashMap<LabelKind, Place>,
    /// Plates of the names of joints with play in the latest picture.
    plates: Vec<(usize, Rect)>,
}

impl LabelPositions {
    /// The joint whose name is at `pos`.
    pub(super) fn joint_at(&self, pos: Pos2) -> Option<usize> {
        self.plates.iter().find(|(_, plate)| plate.contains(pos)).map(|(joint, _)| *joint)
    }

    /// Forgets where names are, in a picture without any.
    pub(super) fn clear_plates(&mut self) {
        self.plates.clear();
    }
}

/// A label to place.
struct LabelRequest<'a> {
    label: &'a Label,
    /// Its anchor, points of the window.
    at: eframe::egui::Pos2,
    /// Text size.
    size: f32,
    /// Preferred direction of its kind, rad, clockwise from the right.
    direction: f32,
}

impl<'a> LabelRequest<'a> {
    fn of(label: &'a Label, rect: Rect, scale: f32) -> Option<Self> {
        let at = rect.min + vec2(label.pixel.x, label.pixel.y) / scale;
        let (size, direction) = match label.kind {
            LabelKind::Joint(_) => (13.0, -FRAC_PI_4),
            LabelKind::Peak(_) | LabelKind::External => (12.0, 0.0),
            LabelKind::Error => (12.0, FRAC_PI_2),
            LabelKind::Axis | LabelKind::Gravity => return None,
        };
        let faint = matches!(label.kind, LabelKind::Peak(_)) && label.colour.0[3] < MIN_OPACITY;
        (rect.contains(at) && !faint).then_some(Self { label, at, size, direction })
    }

    /// The plate of `size` at a place.
    fn plate(&self, size: Vec2, (gap, turn): Place) -> Rect {
        let (sin, cos) = (self.direction + DIRECTIONS[turn] * PI / 6.0).sin_cos();
        let half = size / 2.0;
        // A side or a corner faces the anchor.
        let out = vec2(cos, sin) / cos.abs().max(sin.abs());
        Rect::from_center_size(self.at + vec2(cos, sin) * GAPS[gap] + out * half, size)
    }
}

/// The leader line from an anchor to its plate, if that is far away.
fn leader(at: Pos2, plate: Rect) -> Option<[Pos2; 2]> {
    let end = plate.clamp(at);
    (end.distance(at) > MIN_LEADER).then_some([at, end])
}

/// Whether a line crosses a plate.
fn crosses([from, to]: [Pos2; 2], plate: Rect) -> bool {
    const POINTS: usize = 12;
    (0..=POINTS).any(|k| plate.contains(from.lerp(to, k as f32 / POINTS as f32)))
}

/// Draws names of joints and axes at their places in `rect`, avoiding the rectangles `occupied`.
pub(super) fn paint(
    painter: &Painter,
    rect: Rect,
    scale: f32,
    list: &DrawList,
    mut occupied: Vec<Rect>,
    places: &mut LabelPositions,
) {
    let before = std::mem::take(&mut places.own);
    places.clear_plates();
    let halo = colour(list.background.bottom);
    for label in list.labels.iter().filter(|label| matches!(label.kind, LabelKind::Axis | LabelKind::Gravity)) {
        let at = rect.min + vec2(label.pixel.x, label.pixel.y) / scale;
        text(painter, at, Align2::CENTER_CENTER, &label.text, 12.0, colour(label.colour), halo);
    }
    let cover = Cover::of(list, CELL_SIZE * scale);
    let cost = |(gap, turn): Place| GAP_COST * gap as f32 + DIRECTION_COST * turn as f32;
    let is_clear = |plate: Rect| {
        let [min, max] = [plate.min, plate.max].map(|corner| (corner - rect.min) * scale);
        let covered = cover.covered_fractions(glam::Vec2::new(min.x, min.y), glam::Vec2::new(max.x, max.y));
        covered == [0.0; 2]
    };
    let is_peak = |label: &&Label| matches!(label.kind, LabelKind::Peak(_));
    // Peaks are short-lived, so names have priority.
    let labels = list.labels.iter().filter(|label| !is_peak(label)).chain(list.labels.iter().filter(is_peak));
    let most = occupied.len() + MAX_PLATES;
    let mut failures_left = MAX_UNPLACED;
    let mut leaders: Vec<[Pos2; 2]> = Vec::new();
    // Labels with a previous place come first, so that a new label displaces none.
    let mut requests: Vec<_> = labels.filter_map(|label| LabelRequest::of(label, rect, scale)).collect();
    requests.sort_by_key(|request| (is_peak(&request.label), !before.contains_key(&request.label.kind)));
    for request in requests {
        if occupied.len() == most || failures_left == 0 {
            break;
        }
        let LabelRequest { label, at, .. } = request;
        // A mark that fades with age has legible words until it is gone.
        let ink = colour(label.colour.with_opacity(1.0));
        let words = painter.layout_no_wrap(label.text.to_string(), FontId::proportional(request.size), ink);
        let size = words.size() + 2.0 * PADDING;
        let free = |place: Place, distance: f32| {
            let plate = request.plate(size, place);
            let clear = rect.contains_rect(plate)
                && !occupied.iter().any(|other| other.intersects(plate))
                && is_clear(plate.expand(distance));
            let crosses = || {
                let own = leader(at, plate);
                let over = own.is_some_and(|line| occupied.iter().any(|other| crosses(line, *other)));
                over || leaders.iter().any(|line| crosses(*line, plate))
            };
            clear.then(|| (cost(place) + if crosses() { CROSSING_COST } else { 0.0 }, place, plate))
        };
        let places_before = [&places.beside, &before].map(|places| places.get(&label.kind));
        let previous = places_before.into_iter().flatten().find_map(|place| free(*place, 0.0));
        let all = || (0..GAPS.len()).flat_map(|gap| (0..DIRECTIONS.len()).map(move |turn| (gap, turn)));
        let best_at =
            |clearance: f32| all().filter_map(|place| free(place, clearance)).min_by(|a, b| a.0.total_cmp(&b.0));
        let best = || CLEARANCES.into_iter().find_map(best_at);
        let found = match previous {
            // No place can be better by more than `MOVING_THRESHOLD`.
            Some(previous_place) if previous_place.0 <= MOVING_THRESHOLD => Some(previous_place),
            Some(previous_place) => {
                best().filter(|best| best.0 < previous_place.0 - MOVING_THRESHOLD).or(Some(previous_place))
            }
            None => best(),
        };
        let Some((_, place, plate)) = found else {
            failures_left -= 1;
            continue;
        };
        places.own.insert(label.kind, place);
        if let LabelKind::Joint(joint) = label.kind {
            places.plates.push((joint, plate));
        }
        occupied.push(plate);
        if let Some(line) = leader(at, plate) {
            leaders.push(line);
            painter.line_segment(line, Stroke::new(1.0, ink.gamma_multiply(0.7)));
        }
        // A separate plate, since the text often lies over a dark part.
        painter.rect_filled(plate, 4.0, halo.gamma_multiply(0.8));
        painter.galley(pos2(plate.min.x, plate.min.y) + PADDING, words, ink);
    }
}

#[cfg(test)]
mod tests {
    use eframe::egui::{Context, LayerId, Pos2, RawInput};
    use glam::{Mat4, Vec3};

    use super::*;
    use crate::app::theme;
    use crate::view::{Eye, Instance, Layer, Mesh, Palette, Theme};

    /// A picture of 400 × 300 pixels (1 mm per pixel), with the anchor of a name and the centre of a 40 mm cube.
    fn list(name: [f32; 2], cube: [f32; 2]) -> DrawList {
        let clip_from_world = Mat4::from_scale(Vec3::new(2.0 / 400.0, -2.0 / 300.0, 1.0))
            .mul_mat4(&Mat4::from_translation(Vec3::new(-200.0, -150.0, 0.5)));
        let mut solid = Layer { by_mesh: vec![Vec::new(); Mesh::SHARED] };
        let [x, y] = cube;
        solid.by_mesh[Mesh::Cube.index()].push(Instance {
            world_from_mesh: [[40.0, 0.0, 0.0, x], [0.0, 40.0, 0.0, y], [0.0, 0.0, 0.1, 0.0]],
            ..bytemuck::Zeroable::zeroed()
        });
        let label = Label {
            text: "S1".into(),
            kind: LabelKind::Joint(0),
            anchor: Vec3::ZERO,
            pixel: name.into(),
            colour: Palette::of(Theme::Light).text,
        };
        DrawList {
            size: [400, 300],
            eye: Eye { clip_from_world, position: Vec3::ZERO },
            solid,
            labels: vec![label],
            ..DrawList::default()
        }
    }

    fn place(list: &DrawList, places: &mut LabelPositions) -> Place {
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(400.0, 300.0));
        let ctx = Context::default();
        theme::apply(&ctx, false);
        let mut output = ctx.run_ui(RawInput::default(), |ui| {
            let painter = Painter::new(ui.ctx().clone(), LayerId::background(), rect);
            paint(&painter, rect, 1.0, list, Vec::new(), places);
        });
        // No texture is uploaded.
        output.textures_delta.clear();
        places.own[&LabelKind::Joint(0)]
    }

    #[test]
    fn a_name_gives_way_to_a_body_and_does_not_flicker_beside_it() {
        let name = [200.0, 150.0];
        let free = place(&list(name, [60.0, 60.0]), &mut LabelPositions::default());
        assert_eq!(free, (0, 0), "nothing is in the way");
        let over = list(name, [225.0, 130.0]);
        let beside = place(&over, &mut LabelPositions::default());
        assert_ne!(beside, free, "a body is where it would stand");
        // A body that approaches slowly and jitters.
        let mut places = LabelPositions::default();
        let mut places_seen = Vec::new();
        for frame in 0..120 {
            let shake = [-3.0, 3.0][frame % 2];
            let at = [300.0 - 0.55 * frame as f32 + shake, 130.0 + shake];
            places_seen.push(place(&list(name, at), &mut places));
        }
        places_seen.dedup();
        let differing: std::collections::HashSet<_> = places_seen.iter().collect();
        assert_eq!(places_seen[0], free);
        assert!((2..=3).contains(&places_seen.len()), "{places_seen:?}");
        assert_eq!(differing.len(), places_seen.len(), "it returns nowhere: {places_seen:?}");
        // The picture beside decides where both have room.
        let mut places = LabelPositions { beside: [(LabelKind::Joint(0), (2, 6))].into(), ..LabelPositions::default() };
        assert_eq!(place(&list(name, [60.0, 60.0]), &mut places), (2, 6));
        places.own = [(LabelKind::Joint(0), free)].into();
        assert_eq!(place(&list(name, [60.0, 60.0]), &mut places), (2, 6));
        // The same pictures give the same places.
        assert_eq!(place(&over, &mut LabelPositions::default()), beside);
    }
}
