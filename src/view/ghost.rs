//! Ghosts: other states of the machine, drawn translucent and outlined in front of it.

use glam::Vec3;

use super::arrows::push_error;
use super::build;
use super::joint;
use super::relative::RelativeShot;
use super::solids::push_solid;
use super::theme::{Ghost, GhostLook, Material};
use super::{Colour, DrawList, Palette, SceneView, Shot, to_f32};
use crate::session::ideal::output_point;
use crate::simulate::Frame;
use crate::units::format_quantity_digits;

impl GhostLook {
    /// Surface and outline at `visibility`, 0 to 1.
    fn materials(&self, visibility: f32, pixels_per_point: f32) -> [Material; 2] {
        let material = |colour: Colour| Material {
            colour: colour.with_opacity(visibility * colour.0[3]),
            // See `Instance`.
            roughness: self.width * pixels_per_point,
            metal: self.slice,
        };
        [material(self.fill), material(self.edge)]
    }
}

impl SceneView {
    /// Adds the moving parts of the scene in the state `ghost` to the list built from `shot`. The farther a part is from
    /// its position in `shot`, the more visible it is. Returns whether any part is far enough to be visible.
    pub fn add_ghost(&self, shot: &Shot<'_>, ghost: &Frame, which: Ghost, out: &mut DrawList) -> bool {
        let relative = RelativeShot::of(shot);
        let relative_ghost = relative.as_ref().map(|relative| relative.frame(ghost));
        let shot = &relative.as_ref().map_or(*shot, |relative| relative.shot(shot));
        let ghost = relative_ghost.as_ref().unwrap_or(ghost);
        let look = Palette::of(shot.options.theme).ghost(which);
        let at = |frame| joint::joints(shot.scene, frame, out.magnification);
        let (shown_joints, ghost_joints) = (at(shot.frame), at(ghost));
        let (eye, back) = (shot.camera.eye(), shot.camera.axes().2);
        let target = shot.camera.metres_per_pixel(shot.size) / shot.camera.distance;
        // Fades in as the distance grows from half a point to three.
        let materials = |from: Vec3, to: Vec3| {
            let pixel = target * (eye - to).dot(back);
            let visibility = (from.distance(to) / pixel / shot.pixels_per_point - 0.5) / 2.5;
            let visibility = visibility.clamp(0.0, 1.0);
            (pixel > 0.0 && visibility > 0.0).then(|| look.materials(visibility, shot.pixels_per_point))
        };
        let mut differs = false;
        for part in self.parts.iter().filter(|part| part.body.is_some()) {
            let (from, to) = (part.place(shot.frame, &shown_joints), part.place(ghost, &ghost_joints));
            let (mut starts, mut farthest) = (Vec::new(), (0.0, Vec3::ZERO, Vec3::ZERO));
            from.extent(|point, _| starts.push(point));
            let mut starts = starts.into_iter();
            to.extent(|point, _| {
                let start = starts.next().unwrap_or(point);
                if start.distance(point) > farthest.0 {
                    farthest = (start.distance(point), start, point);
                }
            });
            if let Some([fill, edge]) = materials(farthest.1, farthest.2) {
                push_solid(&mut out.ghost, &to, fill);
                push_solid(&mut out.ghost_edges, &to, edge);
                differs = true;
            }
        }
        for (from, to) in shown_joints.iter().zip(&ghost_joints) {
            let points = from.carried_points().into_iter().zip(to.carried_points());
            let farthest = points.max_by(|(a, b), (c, d)| a.distance(*b).total_cmp(&c.distance(*d)));
            if let Some([fill, edge]) = farthest.and_then(|(from, to)| materials(from, to)) {
                to.push_carried(&mut out.ghost, fill);
                to.push_carried(&mut out.ghost_edges, edge);
                differs = true;
            }
        }
        differs
    }

    /// Adds the error arrow of the output point, starting at its position in `ideal`. It is magnified like the play, or less if
    /// that does not fit. Its label gives the length and, if magnified, the factor.
    pub fn add_output_error(&self, shot: &Shot<'_>, ideal: &Frame, out: &mut DrawList) {
        let relative = RelativeShot::of(shot);
        let relative_ideal = relative.as_ref().map(|relative| relative.frame(ideal));
        let shot = &relative.as_ref().map_or(*shot, |relative| relative.shot(shot));
        let ideal = relative_ideal.as_ref().unwrap_or(ideal);
        let output = &shot.scene.machine.output;
        let (Some(from), Some(to)) = (output_point(output, ideal), output_point(output, shot.frame)) else {
            return;
        };
        let error = to - from;
        let max_factor = 0.5 * self.bounds().radius / (error.norm() as f32).max(f32::MIN_POSITIVE);
        let factor = out.magnification.min(max_factor).max(1.0);
        let length = format_quantity_digits(error.norm() * 1e6, "", 4);
        let text = if factor > 1.0 {
            format!("tip error {length} µm, drawn ×{}", build::format_factor(factor))
        } else {
            format!("tip error {length} µm")
        };
        let colour = Palette::of(shot.options.theme).ghost(Ghost::Ideal).edge;
        let along = to_f32(&error) * factor;
        push_error(shot, to_f32(&from), along, colour, &text.into(), out);
    }
}
