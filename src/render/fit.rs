//! View culling, and the region of the shadow map.

use glam::{Mat4, Vec3, Vec4};

use crate::view::{Eye, Instance};

/// A sphere around an instance, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BoundingSphere {
    pub centre: Vec3,
    pub radius: f32,
}

impl BoundingSphere {
    /// Bounding sphere of an instance of a mesh with `bounds`, centre and half size; `round` for a part of the unit sphere.
    pub fn around(instance: &Instance, bounds: &[Vec3; 2], round: bool) -> Self {
        let rows = instance.world_from_mesh.map(Vec4::from);
        let column = |j: usize| Vec3::new(rows[0][j], rows[1][j], rows[2][j]);
        let axes = [0, 1, 2].map(column);
        if round {
            return Self { centre: column(3), radius: axes[0].length() };
        }
        let [middle, half] = bounds;
        let along = |k: usize| axes[k].length() * half[k];
        Self {
            centre: column(3) + axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z,
            radius: Vec3::new(along(0), along(1), along(2)).length(),
        }
    }
}

/// View frustum: planes through the eye.
pub(super) struct Frustum {
    planes: [Vec4; 5],
}

impl Frustum {
    pub fn new(eye: &Eye) -> Self {
        let row = |i| eye.clip_from_world.row(i);
        let planes = [row(3) + row(0), row(3) - row(0), row(3) + row(1), row(3) - row(1), row(3)];
        let unit = |plane: Vec4| plane / plane.truncate().length().max(f32::MIN_POSITIVE);
        Self { planes: planes.map(unit) }
    }

    /// Whether part of `sphere` may be in the picture; true for a position that is NaN.
    pub fn may_contain(&self, sphere: &BoundingSphere) -> bool {
        let outside = |plane: &Vec4| plane.dot(sphere.centre.extend(1.0)) < -sphere.radius;
        !self.planes.iter().any(outside)
    }
}

/// Region of the shadow map: a square across the light, and the depth range of the casters, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Region {
    pub centre: Vec3,
    pub radius: f32,
    depths: [f32; 2],
}

/// The region needed for the view: all `casters` in view (the flag), and those whose shadows on the floor (a point of it, and
/// up) are in view.
pub(super) fn shadow_region(
    casters: &[(BoundingSphere, bool)],
    light: Vec3,
    floor: Option<(Vec3, Vec3)>,
    eye: &Eye,
) -> Region {
    let frustum = Frustum::new(eye);
    let steep = floor.filter(|(_, up)| light.dot(*up) > 0.05);
    let on_floor = |sphere: &BoundingSphere| {
        let (point, up) = steep?;
        let along = (sphere.centre - point).dot(up) / light.dot(up);
        let shadow = BoundingSphere {
            centre: sphere.centre - light * along,
            // Elongated by a low light.
            radius: sphere.radius / light.dot(up),
        };
        frustum.may_contain(&shadow).then_some(())
    };
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let mut depths = [f32::INFINITY, f32::NEG_INFINITY];
    for (sphere, seen) in casters {
        if !(sphere.centre.is_finite() && sphere.radius.is_finite()) {
            continue;
        }
        let depth = sphere.centre.dot(light);
        depths[0] = depths[0].min(depth - sphere.radius);
        depths[1] = depths[1].max(depth + sphere.radius);
        if *seen || on_floor(sphere).is_some() {
            low = low.min(sphere.centre - sphere.radius);
            high = high.max(sphere.centre + sphere.radius);
        }
    }
    if !(low.cmple(high).all() && depths[0] < depths[1]) {
        return Region { centre: Vec3::ZERO, radius: 1.0, depths: [-1.0, 1.0] };
    }
    let centre = (low + high) / 2.0;
    let farthest = casters
        .iter()
        .filter(|(sphere, seen)| *seen || on_floor(sphere).is_some())
        .map(|(sphere, _)| (sphere.centre - centre).reject_from_normalized(light).length() + sphere.radius)
        .filter(|radius| radius.is_finite())
        .fold(f32::MIN_POSITIVE, f32::max);
    Region {
        centre,
        // In steps, so that shadows keep their texels during small motions.
        radius: SIZE_RATIO.powf(farthest.log(SIZE_RATIO).ceil()).max(1e-4),
        depths,
    }
}

/// Ratio of neighbouring sizes of the region.
const SIZE_RATIO: f32 = 1.1;

impl Region {
    /// Orthographic view from the light on a map with a side of `texels`.
    pub fn light_from_world(&self, light: Vec3, texels: u32) -> Mat4 {
        let up = light.any_orthonormal_vector();
        let right = up.cross(light);
        let texel = 2.0 * self.radius / texels as f32;
        let snap = |x: f32| (x / texel).round() * texel;
        let (x, y) = (snap(self.centre.dot(right)), snap(self.centre.dot(up)));
        let [far, near] = self.depths;
        let depth = 1.05 * (near - far).max(1e-6);
        let row = |axis: Vec3, offset: f32, scale: f32| (axis * scale).extend(-offset * scale);
        Mat4::from_cols(
            row(right, x, 1.0 / self.radius),
            row(up, y, 1.0 / self.radius),
            row(-light, -near - 0.02 * depth, 1.0 / depth),
            Vec4::W,
        )
        .transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::{SceneView, fixture};

    #[test]
    fn spheres_in_view_are_kept_and_distant_ones_are_culled() {
        let (scene, frame) = fixture::pendulum();
        let camera = SceneView::new(&scene, &frame).camera();
        let eye = camera.view([640, 360]);
        let frustum = Frustum::new(&eye);
        let (right, up, back) = camera.axes();
        let half = camera.distance * (camera.field_of_view / 2.0).tan();
        let shows = |centre, radius| frustum.may_contain(&BoundingSphere { centre, radius });
        assert!(shows(camera.target, 1e-3));
        for (axis, edge) in [(right, half * 640.0 / 360.0), (up, half)] {
            for side in [-1.0, 1.0] {
                let at = |part: f32| camera.target + axis * (side * part * edge);
                assert!(shows(at(0.99), 1e-6) && !shows(at(1.01), 1e-6));
                assert!(shows(at(1.01), 0.05 * edge), "partly inside");
            }
        }
        assert!(!shows(camera.eye() + back, 1e-3), "behind the eye");
    }

    #[test]
    fn the_shadow_map_fits_the_casters_in_view_tightly() {
        let (scene, frame) = fixture::pendulum();
        let camera = SceneView::new(&scene, &frame).camera();
        let eye = camera.view([640, 360]);
        let light = Vec3::new(0.3, -0.4, 0.8).normalize();
        let sphere = |offset: Vec3, radius| BoundingSphere { centre: camera.target + offset * camera.distance, radius };
        let (right, _, _) = camera.axes();
        let casters = [
            (sphere(Vec3::ZERO, 0.01), true),
            (sphere(0.1 * right, 0.002), true),
            // Far outside, but between them and the light.
            (sphere(20.0 * light, 0.01), false),
        ];
        let region = shadow_region(&casters, light, None, &eye);
        let map = region.light_from_world(light, 1024);
        let mut widest = 0.0_f32;
        for (k, (sphere, seen)) in casters.iter().enumerate() {
            for side in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
                let at = map.project_point3(sphere.centre + side * sphere.radius);
                assert!((0.0..=1.0).contains(&at.z), "{k}: {at}");
                if *seen {
                    assert!(at.x.abs() <= 1.01 && at.y.abs() <= 1.01, "{k}: {at}");
                    widest = widest.max(at.x.abs()).max(at.y.abs());
                }
            }
        }
        assert!(widest > 0.6, "{widest}");
        // The light's side is nearer.
        let depth = |k: usize| map.project_point3(casters[k].0.centre).z;
        assert!(depth(2) < depth(0));
    }
}
