//! Tip errors at many positions of the machine: points coloured by the size of the error, with an arrow at the largest.

use glam::Vec3;

use super::arrows::push_error_arrow;
use super::instances::{ball, push_label};
use super::relative::RelativeShot;
use super::theme::{Ghost, Material};
use super::{DrawList, ErrorScale, LabelKind, Mesh, Palette, SceneView, Shot, WearScale, build};
use crate::units::format_quantity_digits;

/// Diameter of a point, points.
const POINT_SIZE: f32 = 9.0;

/// Errors at many positions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Ideal tip position, and the error there, world axes, m.
    pub arrows: Vec<[Vec3; 2]>,
    /// Length of an arrow relative to its error.
    pub factor: f32,
    /// Name of the error quantity.
    pub name: &'static str,
    /// Remark for the label.
    pub note: &'static str,
}

impl Cloud {
    /// The longest error.
    fn longest(&self) -> Option<&[Vec3; 2]> {
        let arrows = self.arrows.iter();
        arrows.max_by(|a, b| a[1].length_squared().total_cmp(&b[1].length_squared()))
    }
}

impl SceneView {
    /// Adds `cloud` to the list built from `shot`, with the largest error as an arrow with a label.
    pub fn add_cloud(&self, shot: &Shot<'_>, cloud: &Cloud, out: &mut DrawList) {
        let relative = RelativeShot::of(shot);
        let origin = relative.as_ref().map_or(Vec3::ZERO, |_| shot.camera.target);
        let shot = &relative.as_ref().map_or(*shot, |relative| relative.shot(shot));
        let colour = Palette::of(shot.options.theme).ghost(Ghost::Twin).edge;
        let Some([tip, error]) = cloud.longest() else {
            return;
        };
        let largest = error.length();
        let (eye, back) = (shot.camera.eye(), shot.camera.axes().2);
        let slope = 2.0 * (shot.camera.field_of_view / 2.0).tan() / shot.size[1].max(1) as f32;
        for [tip, error] in &cloud.arrows {
            let at = *tip - origin;
            let radius = 0.5 * POINT_SIZE * shot.pixels_per_point * slope * (eye - at).dot(back);
            let colour = WearScale::colour(error.length() / largest.max(f32::MIN_POSITIVE));
            out.wear.push(Mesh::Sphere, ball(at, radius.max(0.0), Material { colour, roughness: 1.0, metal: 0.0 }));
        }
        out.error_scale = Some(ErrorScale { name: cloud.name, largest });
        push_error_arrow(shot, *tip - origin, *error * cloud.factor, colour, out);
        let length = format_quantity_digits(f64::from(largest) * 1e6, "", 4);
        let text = format!("{} {length} µm{}, drawn ×{}", cloud.name, cloud.note, build::format_factor(cloud.factor));
        push_label(out, &text.into(), LabelKind::Error, *tip - origin + *error * cloud.factor, colour);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::simulate::{Frame, Simulation};
    use crate::view::{Mesh, PeakMarks, ViewOptions};

    #[test]
    fn points_have_the_colours_of_their_errors_and_the_arrow_ends_where_the_numbers_say() {
        let scene = Scene::load("four-bar", &[]).expect("built in");
        let mut frame = Frame::default();
        Simulation::new(&scene.machine).expect("starts").sample(0.0, &mut frame);
        let view = SceneView::new(&scene, &frame);
        let (marks, camera) = (PeakMarks::new(), view.camera());
        let options = ViewOptions::default();
        let shot = Shot {
            scene: &scene,
            frame: &frame,
            marks: &marks,
            options: &options,
            camera: &camera,
            trail: &[],
            size: [1280, 720],
            pixels_per_point: 1.0,
        };
        let cloud = Cloud {
            arrows: vec![
                [Vec3::new(0.01, 0.02, 0.0), Vec3::new(2e-4, 0.0, -1e-4)],
                [Vec3::new(-0.03, 0.0, 0.04), Vec3::Y * 1e-4],
            ],
            factor: 200.0,
            name: "largest error",
            note: ", contact ignored",
        };
        let cones = |list: &DrawList| list.arrows.by_mesh[Mesh::Cone.index()].len();
        let mut list = DrawList::default();
        view.build(&shot, &mut list);
        let before = cones(&list);
        view.add_cloud(&shot, &cloud, &mut list);
        let [cone] = list.arrows.by_mesh[Mesh::Cone.index()][before..] else {
            panic!("one arrow");
        };
        // The apex of the mesh is at z = 1.
        let [tip, error] = cloud.arrows[0];
        let apex = Vec3::from(cone.world_from_mesh.map(|row| row[2] + row[3]));
        assert!(apex.distance(tip + error * 200.0) < 1e-6, "{apex}");
        let points = &list.wear.by_mesh[Mesh::Sphere.index()];
        assert_eq!(points.len(), 2);
        for (point, [tip, error]) in points.iter().zip(&cloud.arrows) {
            assert!(Vec3::from(point.world_from_mesh.map(|row| row[3])).distance(*tip) < 1e-6);
            let share = error.length() / (5.0_f32).sqrt() * 1e4;
            let [r, g, b, _] = WearScale::colour(share).0;
            let [red, green, blue, _] = point.colour;
            assert!(Vec3::new(red - r, green - g, blue - b).length() < 1e-3, "{share}");
        }
        // Names keep off the points.
        let cover = crate::view::Cover::of(&list, 2.0);
        for [tip, _] in &cloud.arrows {
            let at = camera.project(*tip, [1280, 720]).expect("in front");
            assert_eq!(cover.covered_fractions(at, at), [1.0, 0.0], "{at}");
        }
        assert!((list.error_scale.expect("a scale").largest - 223.6e-6).abs() < 1e-7);
        let label = list.labels.iter().find(|label| label.kind == LabelKind::Error).expect("in the picture");
        assert_eq!(*label.text, *"largest error 223.6 µm, contact ignored, drawn ×200");
        assert!(label.anchor.distance(Vec3::new(0.05, 0.02, -0.02)) < 1e-6, "{}", label.anchor);
    }
}
