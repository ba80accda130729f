//! Force arrows, the ruler that scales them, the hollow marks of past peaks, and the error arrow.

use glam::Vec3;

use super::instances::{bar, push_label};
use super::joint::DrawnJoint;
use super::theme::Material;
use super::{
    Camera, Colour, DrawList, LabelKind, Layer, Legend, Line, Mark, Mesh, Palette, Scaling, Shot, Tick, to_f32,
};
use crate::machine::ElementKind;
use crate::units::format_quantity_digits;

/// Reference length of arrows, as a fraction of the picture height.
pub const ARROW_LENGTH: f32 = 0.22;
/// Longest arrow, in reference lengths.
const MAX_RELATIVE_LENGTH: f32 = 2.5;
/// Radius of the thickest shaft, as a fraction of the picture height.
const MAX_SHAFT_RADIUS: f32 = 0.0055;
/// Shortest arrow with the full thickness, in shaft radii; a shorter one is proportionally thinner.
const FULL_THICKNESS_LENGTH: f32 = 10.0;
/// Length and radius of a head, in radii of the shaft.
const HEAD: [f32; 2] = [5.5, 2.3];
/// Gaps in the shaft of an arrow too long to be drawn in full: its three parts, from tail to neck.
const BREAK: [[f32; 2]; 3] = [[0.0, 0.44], [0.48, 0.52], [0.56, 1.0]];
/// Most past peaks with a label: the largest.
const MAX_PEAK_LABELS: usize = 3;
/// Outline width of a mark, points.
const OUTLINE_WIDTH: f32 = 1.8;

/// A shaft with its head.
#[derive(Clone, Copy)]
pub(super) struct Arrow {
    pub tail: Vec3,
    pub along: Vec3,
    /// Radius of the shaft, m.
    pub radius: f32,
    /// Whether it is too long to be drawn in full, so that its shaft has gaps.
    pub is_broken: bool,
}

impl Arrow {
    /// An arrow with a shaft radius of at most `radius`.
    pub fn new(tail: Vec3, along: Vec3, radius: f32) -> Self {
        Self { tail, along, radius: radius.min(along.length() / FULL_THICKNESS_LENGTH), is_broken: false }
    }

    fn neck(&self) -> Vec3 {
        let length = self.along.length();
        self.along * ((length - HEAD[0] * self.radius) / length)
    }

    pub fn push(&self, layer: &mut Layer, colour: Colour) {
        if !(self.radius > 0.0 && self.radius.is_finite()) {
            return;
        }
        let material = Material { colour, roughness: 0.55, metal: 0.0 };
        let (neck, radius) = (self.neck(), self.radius);
        let segments = if self.is_broken { &BREAK[..] } else { &[[0.0, 1.0]][..] };
        for [from, to] in segments {
            let segment = bar(self.tail + neck * *from, neck * (to - from), radius, material);
            layer.push(Mesh::Cylinder, segment);
        }
        let head = bar(self.tail + neck, self.along - neck, HEAD[1] * radius, material);
        layer.push(Mesh::Cone, head);
    }

    /// Its outline as seen from `eye`.
    fn outline(&self, eye: Vec3, colour: Colour, width: f32, lines: &mut Vec<Line>) {
        let side = self.along.cross(eye - self.tail).normalize_or_zero();
        let neck = self.tail + self.neck();
        let (shaft, head) = (side * self.radius, side * (HEAD[1] * self.radius));
        let corners = [
            self.tail - shaft,
            neck - shaft,
            neck - head,
            self.tail + self.along,
            neck + head,
            neck + shaft,
            self.tail + shaft,
        ];
        lines.extend((0..corners.len()).map(|i| {
            let next = corners[(i + 1) % corners.len()];
            Line::new(corners[i], next, width, [colour; 2])
        }));
    }
}

/// Converts pixels to lengths in the scene.
struct Ruler {
    eye: Vec3,
    axes: (Vec3, Vec3, Vec3),
    /// Pixels per unit slope.
    slope: f32,
}

impl Ruler {
    fn new(camera: &Camera, size: [u32; 2]) -> Self {
        Self {
            eye: camera.eye(),
            axes: camera.axes(),
            slope: size[1] as f32 / (2.0 * (camera.field_of_view / 2.0).tan()),
        }
    }

    /// Length, m, of a line from `tail` along the unit vector `along` that is `pixels` long on the screen if it lies across the
    /// line of sight (parallel to the picture or perpendicular to the ray from the eye), and never longer; and the size of a
    /// pixel there, m. `None` behind the eye.
    ///
    /// In slopes (x, y) of the picture and depth z, the end of a line of length s lies at (p + s q) / (z + s w), with q and w
    /// the components of `along` in the picture and away from the eye. Its start is p / z. This gives a length in slopes of s
    /// |q - p w / z| / (z + s w), solved for s. |q - p w / z| is 1 in the picture plane, 0 along the ray, and more than 1 where
    /// a wide picture stretches lengths across the ray.
    fn measure(&self, tail: Vec3, along: Vec3, pixels: f32) -> Option<(f32, f32)> {
        let (right, up, back) = self.axes;
        let from_eye = tail - self.eye;
        let (depth, away) = (-from_eye.dot(back), -along.dot(back));
        let across = |axis: Vec3| along.dot(axis) - from_eye.dot(axis) / depth * away;
        let stretch = across(right).hypot(across(up)).max(1.0);
        let length = pixels * depth / (self.slope * stretch - pixels * away);
        let pixel = depth / self.slope;
        (pixel > 0.0 && length.is_finite() && length > 0.0).then_some((length, pixel))
    }
}

/// Length of an arrow in reference lengths, and whether it had to be clipped.
fn arrow_length(force: f32, reference: f32, scaling: Scaling) -> (f32, bool) {
    let ratio = force / reference;
    let length = match scaling {
        Scaling::Linear => ratio,
        Scaling::Logarithmic => (1.0 + 999.0 * ratio).log10() / 3.0,
    };
    (length.min(MAX_RELATIVE_LENGTH), length > MAX_RELATIVE_LENGTH)
}

/// Arrows of the current forces, marks of past peaks, and their legend.
pub(super) fn push_forces(shot: &Shot<'_>, joints: &[DrawnJoint], palette: &Palette, out: &mut DrawList) {
    let options = &shot.options.arrows;
    let draws_joint_forces = (options.normal || options.friction) && !joints.is_empty();
    let elements = shot.scene.machine.elements.iter().zip(&shot.frame.elements);
    let loads = elements.filter(|(element, _)| options.normal && element.describe().is_external);
    let loads = loads.map(|(_, report)| report);
    let mut external = loads.chain(&shot.frame.pull).peekable();
    if !draws_joint_forces && external.peek().is_none() {
        return;
    }
    let ruler = Ruler::new(shot.camera, shot.size);
    let height = shot.size[1] as f32;
    let max_radius = MAX_SHAFT_RADIUS * options.thickness;
    let reference = shot.marks.reference(options);
    let mut clipped = false;
    // `None` for a zero force.
    let mut arrow = |force: Vec3, tail: Vec3| {
        let along = force.try_normalize()?;
        let (length, is_broken) = arrow_length(force.length(), reference, options.scaling);
        let (length, pixel) = ruler.measure(tail, along, length * ARROW_LENGTH * height)?;
        clipped |= is_broken;
        Some(Arrow { is_broken, ..Arrow::new(tail, along * length, max_radius * height * pixel) })
    };
    let reports = joints.iter().zip(&shot.frame.joints).enumerate();
    for (i, (joint, report)) in reports.filter(|_| draws_joint_forces) {
        joint.contacts(report, shot.frame.sites_of(i), |contact| {
            for (is_drawn, force, colour) in [
                (options.normal, contact.normal, palette.normal),
                (options.friction, contact.friction, palette.friction),
            ] {
                if let Some(arrow) = is_drawn.then(|| arrow(force, contact.point)).flatten() {
                    arrow.push(&mut out.arrows, colour);
                }
            }
        });
        let film = to_f32(&report.lubricant_force);
        let from = joint.ball_centre - film.normalize_or_zero() * joint.ball_radius;
        if let Some(arrow) = options.normal.then(|| arrow(film, from)).flatten() {
            arrow.push(&mut out.arrows, palette.lubricant);
        }
    }
    for report in external {
        let point = to_f32(&report.points[1]);
        if let Some(arrow) = arrow(to_f32(&report.force), point) {
            arrow.push(&mut out.arrows, palette.external);
            let text = format_quantity_digits(report.force.norm(), "N", 3);
            let tip = arrow.tail + arrow.along;
            push_label(out, &text.into(), LabelKind::External, tip, palette.external);
        }
    }
    if let Some(pull) = &shot.frame.pull {
        let [from, to] = pull.points.map(|point| to_f32(&point));
        let width = OUTLINE_WIDTH * shot.options.arrows.thickness * shot.pixels_per_point;
        let faint = palette.external.with_opacity(0.6);
        out.lines.push(Line::new(from, to, width, [faint; 2]));
    }
    if !draws_joint_forces {
        return;
    }
    let draws_peaks = options.normal && options.peaks;
    let mut forces: Vec<f32> = shot.marks.marks(shot.frame).map(|mark| mark.force.length()).collect();
    forces.sort_by(|a, b| b.total_cmp(a));
    let least_labelled = forces.get(MAX_PEAK_LABELS - 1).copied().unwrap_or(0.0);
    for mark in shot.marks.marks(shot.frame).filter(|_| draws_peaks) {
        let Some(joint) = joints.get(mark.joint) else {
            continue;
        };
        // On the wall that was hit.
        let contact = joint.wall_point(mark.force, mark.place.map(usize::from));
        if let Some(arrow) = arrow(mark.force, contact) {
            let [colour, ink] = [palette.normal, palette.text].map(|colour| colour.with_opacity(mark.strength.sqrt()));
            let width = OUTLINE_WIDTH * shot.options.arrows.thickness * shot.pixels_per_point;
            arrow.outline(ruler.eye, colour, width, &mut out.marks);
            if mark.force.length() < least_labelled {
                continue;
            }
            let kind = LabelKind::Peak(mark.joint);
            push_label(out, &peak_label(&mark).into(), kind, arrow.tail + arrow.along, ink);
        }
    }
    let marks: &[f32] = match options.scaling {
        Scaling::Linear => &[0.5, 1.0],
        Scaling::Logarithmic => &[0.001, 0.01, 0.1, 1.0],
    };
    let tick = |mark: &f32| Tick {
        force: mark * reference,
        fraction: arrow_length(mark * reference, reference, options.scaling).0,
    };
    let is_lubricated =
        shot.scene.machine.elements.iter().any(|element| matches!(element.kind, ElementKind::Lubricant(_)));
    let are_balls = joints.iter().all(DrawnJoint::is_ball);
    out.legend = Some(Legend {
        on: if are_balls { "ball" } else { "carried part" },
        reference,
        pixels: ARROW_LENGTH * height,
        scaling: options.scaling,
        clipped,
        ticks: marks.iter().map(tick).collect(),
        normal: options.normal.then_some(palette.normal),
        peaks: draws_peaks,
        friction: options.friction.then_some(palette.friction),
        lubricant: (options.normal && is_lubricated).then_some(palette.lubricant),
    });
}

/// An arrow for a length in the scene instead of a force, with its label at its head.
pub(super) fn push_error(
    shot: &Shot<'_>,
    tail: Vec3,
    along: Vec3,
    colour: Colour,
    text: &std::sync::Arc<str>,
    out: &mut DrawList,
) {
    push_error_arrow(shot, tail, along, colour, out);
    push_label(out, text, LabelKind::Error, tail + along, colour);
}

/// As [`push_error`], without a label.
pub(super) fn push_error_arrow(shot: &Shot<'_>, tail: Vec3, along: Vec3, colour: Colour, out: &mut DrawList) {
    let ruler = Ruler::new(shot.camera, shot.size);
    let height = shot.size[1] as f32;
    let unit = along.normalize_or(shot.camera.axes().0);
    if let Some((_, pixel)) = ruler.measure(tail, unit, 1.0) {
        let max_radius = MAX_SHAFT_RADIUS * shot.options.arrows.thickness;
        let arrow = Arrow::new(tail, along, max_radius * height * pixel);
        arrow.push(&mut out.arrows, colour);
    }
}

/// Force of the peak, and how long ago in simulated time.
fn peak_label(mark: &Mark) -> String {
    let (ago, unit) = match mark.age {
        age if age < 0.9995e-3 => (age * 1e6, "µs"),
        age if age < 0.9995 => (age * 1e3, "ms"),
        age => (age, "s"),
    };
    let force = format_quantity_digits(f64::from(mark.force.length()), "N", 3);
    format!("peak {force}, {} {unit} ago", format_quantity_digits(ago, "", 2))
}

/// An arrow of the triad.
pub(super) fn push_arrow(layer: &mut Layer, tail: Vec3, along: Vec3, radius: f32, colour: Colour) {
    Arrow::new(tail, along, radius).push(layer, colour);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SignedAxis;
    use crate::view::Bounds;

    #[test]
    fn a_line_across_the_sight_has_its_length_in_pixels_everywhere() {
        const SIZE: [u32; 2] = [1600, 700];
        const PIXELS: f32 = 154.0;
        let bounds = Bounds { centre: Vec3::new(0.1, -0.2, 0.3), radius: 0.4 };
        let mut checked = 0;
        for (field_of_view, zoom) in [(0.6, 1.0), (0.6, 12.0), (1.2, 1.0), (0.2, 0.3)] {
            let mut camera = Camera::new(SignedAxis::PlusX, bounds);
            camera.field_of_view = field_of_view;
            camera.distance /= zoom;
            let ruler = Ruler::new(&camera, SIZE);
            let (right, up, back) = camera.axes();
            for (x, y) in [(0.5, 0.5), (0.15, 0.5), (0.9, 0.8), (0.6, 0.1)] {
                let pixel = glam::Vec2::new(x * SIZE[0] as f32, y * SIZE[1] as f32);
                let (eye, ray) = camera.ray(pixel, SIZE);
                for depth in [0.3, 1.0, 2.0] {
                    let tail = eye + ray * (depth * camera.distance);
                    for turn in 0..12 {
                        let (sin, cos) = (turn as f32 * 0.52).sin_cos();
                        let in_picture = right * cos + up * sin;
                        let square = in_picture.reject_from(ray).normalize();
                        let length = |along: Vec3| {
                            let (length, _) = ruler.measure(tail, along, PIXELS).expect("seen");
                            let end = camera.project(tail + along * length, SIZE);
                            end.expect("seen").distance(pixel)
                        };
                        for along in [in_picture, square] {
                            let measured = length(along);
                            assert!((measured - PIXELS).abs() < 0.01 * PIXELS, "{along}: {measured}");
                            checked += 1;
                        }
                        // Pointing towards the eye or away from it, it is shorter.
                        for tilt in [0.7, -0.7] {
                            let measured = length((in_picture + back * tilt).normalize());
                            assert!(measured <= PIXELS * 1.001, "{measured}");
                        }
                        let measured = length(-ray);
                        assert!(measured < 1.0, "along the ray: {measured}");
                    }
                }
            }
        }
        assert!(checked > 1000);
    }

    #[test]
    fn an_arrow_that_would_be_too_long_is_broken() {
        let arrow = Arrow { is_broken: true, ..Arrow::new(Vec3::ZERO, Vec3::X, 0.01) };
        let mut layer = Layer::default();
        layer.clear(Mesh::SHARED);
        arrow.push(&mut layer, Colour::hex(0));
        assert_eq!(layer.by_mesh[Mesh::Cylinder.index()].len(), 3);
        let linear = |force| arrow_length(force, 100.0, Scaling::Linear);
        assert_eq!((linear(250.0), linear(300.0)), ((2.5, false), (2.5, true)));
    }

    #[test]
    fn a_peak_is_told_with_three_digits_and_its_age_in_a_fitting_unit() {
        let mark = |age: f64| Mark { joint: 0, place: None, force: Vec3::new(0.0, 870.6, 0.0), age, strength: 1.0 };
        assert_eq!(peak_label(&mark(2.14e-3)), "peak 871 N, 2.1 ms ago");
        assert_eq!(peak_label(&mark(38.4e-6)), "peak 871 N, 38 µs ago");
        assert_eq!(peak_label(&mark(0.312)), "peak 871 N, 310 ms ago");
        assert_eq!(peak_label(&mark(1.26)), "peak 871 N, 1.3 s ago");
    }
}
