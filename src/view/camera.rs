//! Orbit camera. Pixels count from the top left of the picture.

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::{Bounds, Eye};
use crate::scene::SignedAxis;

/// A named viewpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Level, from the front.
    Front,
    /// Level, from the right.
    Side,
    /// From above.
    Top,
    /// From above, at an angle.
    Isometric,
}

impl Preset {
    /// All of them, in the order of their keys.
    pub const ALL: [Self; 4] = [Self::Isometric, Self::Front, Self::Side, Self::Top];

    /// Name for buttons.
    pub fn label(self) -> &'static str {
        match self {
            Self::Front => "Front",
            Self::Side => "Side",
            Self::Top => "Top",
            Self::Isometric => "Isometric",
        }
    }
}

/// A perspective camera that orbits a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Orbit centre, m.
    pub target: Vec3,
    /// Azimuth about the vertical, rad; 0 looks from the front.
    pub yaw: f32,
    /// Elevation, rad; positive looks down.
    pub pitch: f32,
    /// Distance from eye to target, m.
    pub distance: f32,
    /// Vertical field of view, rad.
    pub field_of_view: f32,
    up: Vec3,
    right: Vec3,
    isometric: (f32, f32),
    followed: Option<Vec3>,
}

/// Steepest elevation; a right angle looks straight down.
const MAX_PITCH: f32 = std::f32::consts::FRAC_PI_2;

impl Camera {
    /// Isometric view of `bounds` with `down` pointing down on the screen.
    pub fn new(down: SignedAxis, bounds: Bounds) -> Self {
        let down = super::to_f32(&down.unit());
        // The axis that points right in the front view: Z for the paper's X-down scene, whose sliders 1 and 2 move along Z;
        // X for the usual Z-up and Y-up scenes.
        let right = if down.x == 0.0 { Vec3::X } else { Vec3::Z };
        let mut camera = Self {
            target: bounds.centre,
            yaw: 0.0,
            pitch: 0.0,
            distance: 1.0,
            field_of_view: 0.6,
            up: -down,
            right,
            isometric: (0.6, 0.32),
            followed: None,
        };
        camera.preset(Preset::Isometric);
        camera.fit(bounds, 16.0 / 9.0);
        camera
    }

    /// Replaces the yaw and pitch, rad, of the isometric view, and turns to it.
    pub fn with_isometric(mut self, yaw: f32, pitch: f32) -> Self {
        self.isometric = (yaw, pitch.clamp(-MAX_PITCH, MAX_PITCH));
        self.preset(Preset::Isometric);
        self
    }

    /// Turns to a named viewpoint; target and distance stay the same.
    pub fn preset(&mut self, preset: Preset) {
        (self.yaw, self.pitch) = match preset {
            Preset::Front => (0.0, 0.0),
            Preset::Side => (MAX_PITCH, 0.0),
            Preset::Top => (0.0, MAX_PITCH),
            Preset::Isometric => self.isometric,
        };
    }

    /// Moves so that all of `bounds` fits into a picture of the given aspect ratio (width by height); the direction stays the same.
    pub fn fit(&mut self, bounds: Bounds, aspect: f32) {
        let half = (self.field_of_view / 2.0).tan();
        let half_angle = (half * aspect.min(1.0)).atan();
        self.target = bounds.centre;
        self.distance = (bounds.radius.max(1e-6) / half_angle.sin()) * 1.02;
    }

    /// Moves so that the spheres (centre, radius) just fill a picture of `size`, with a small margin; the direction stays the same.
    /// The given numbers of pixels at the left, right, top and bottom stay free.
    pub(super) fn fit_balls(&mut self, balls: &[(Vec3, f32)], size: [u32; 2], [left, right, top, bottom]: [f32; 4]) {
        const MARGIN: f32 = 1.16;
        let axes = self.axes();
        let [width, height] = size.map(|n| n.max(1) as f32);
        // Slope of one pixel. The reserved space is limited so that most of the picture remains.
        let pixel = 2.0 * (self.field_of_view / 2.0).tan() / height;
        let free_of = |edge: f32, low: f32, high: f32| {
            let limit = (0.6 * edge / (low + high).max(1e-3)).min(1.0);
            let (middle, half) = (limit * (low - high) / 2.0, (edge - limit * (low + high)) / 2.0 / MARGIN);
            (pixel * (half - middle), pixel * (half + middle))
        };
        // Along one screen axis, up to slopes `low` and `high`: a sphere at (x, depth z towards the eye) is inside both
        // edges if x - x0 + r sqrt(1 + high^2) <= (d - z) high, and likewise below. The two tightest edges give d, and the
        // x0 that stays midway for any greater d.
        let span = |axis: Vec3, (low, high): (f32, f32)| {
            let reach = |sign: f32, slope: f32| {
                let edge = |&(p, r): &(Vec3, f32)| {
                    sign * p.dot(axis) + r * (1.0 + slope * slope).sqrt() + p.dot(axes.2) * slope
                };
                balls.iter().map(edge).fold(f32::NEG_INFINITY, f32::max)
            };
            let (above, below) = (reach(1.0, high), reach(-1.0, low));
            let midway = move |d: f32| (above - below + d * (low - high)) / 2.0;
            (midway, (above + below) / (low + high))
        };
        let (x, from_x) = span(axes.0, free_of(width, left, right));
        let (y, from_y) = span(axes.1, free_of(height, bottom, top));
        let eye_depth = from_x.max(from_y);
        let depths = || balls.iter().map(|(p, _)| p.dot(axes.2));
        let middle = (depths().fold(f32::INFINITY, f32::min) + depths().fold(f32::NEG_INFINITY, f32::max)) / 2.0;
        let (x, y) = (x(eye_depth), y(eye_depth));
        if eye_depth - middle > 0.0 && x.is_finite() && y.is_finite() {
            self.target = axes.0 * x + axes.1 * y + axes.2 * middle;
            self.distance = (eye_depth - middle).max(1e-4);
        }
    }

    /// Looks at a sphere of `radius` about `centre` from the side that `opening` points to, a little from above.
    pub fn close_up(&mut self, centre: Vec3, opening: Vec3, radius: f32) {
        let out = opening.normalize_or(self.back_at(0.0));
        let level = Vec2::new(out.dot(self.right), out.dot(self.back_at(0.0)));
        // An opening straight up or down does not determine the yaw, which then stays the same.
        if level.length() > 1e-3 {
            self.yaw = level.x.atan2(level.y) + 0.25;
        }
        self.pitch = (out.dot(self.up).clamp(-1.0, 1.0).asin() + 0.25).clamp(-MAX_PITCH, MAX_PITCH);
        self.fit(Bounds { centre, radius }, 1.0);
    }

    /// Orbits by a drag of `drag` pixels.
    pub fn orbit(&mut self, drag: Vec2) {
        const RADIANS_PER_PIXEL: f32 = 0.006;
        self.yaw = (self.yaw - drag.x * RADIANS_PER_PIXEL).rem_euclid(std::f32::consts::TAU);
        self.pitch = (self.pitch + drag.y * RADIANS_PER_PIXEL).clamp(-MAX_PITCH, MAX_PITCH);
    }

    /// Pans by a drag of `drag` pixels: points at the target's distance stay under the cursor.
    pub fn pan(&mut self, drag: Vec2, size: [u32; 2]) {
        let metres = self.metres_per_pixel(size);
        let (right, up, _) = self.axes();
        self.target += (up * drag.y - right * drag.x) * metres;
    }

    /// Zooms by `factor` (above 1 is nearer); the point under `cursor` at the target's distance stays there.
    pub fn zoom(&mut self, factor: f32, cursor: Vec2, size: [u32; 2]) {
        if !(factor.is_finite() && factor > 0.0) {
            return;
        }
        let before = self.metres_per_pixel(size);
        self.distance = (self.distance / factor).clamp(1e-4, 1e4);
        let shrink = before - self.metres_per_pixel(size);
        let off_centre = cursor - Vec2::new(size[0] as f32, size[1] as f32) / 2.0;
        let (right, up, _) = self.axes();
        self.target += (right * off_centre.x - up * off_centre.y) * shrink;
    }

    /// Zooms by `factor` about a point of the scene, which stays where it is on the screen. The target moves to its depth,
    /// so that zooming in never passes it.
    pub fn zoom_about(&mut self, factor: f32, point: Vec3, size: [u32; 2]) {
        let (eye, back) = (self.eye(), self.axes().2);
        let depth = (eye - point).dot(back);
        if !(depth > 1e-4) {
            return;
        }
        self.target = eye - back * depth;
        self.distance = depth;
        if let Some(pixel) = self.project(point, size) {
            self.zoom(factor, pixel, size);
        }
    }

    /// Moves with a followed point. Call in each frame with its position, or `None` to stay.
    pub fn follow(&mut self, point: Option<Vec3>) {
        if let (Some(now), Some(before)) = (point, self.followed) {
            self.target += now - before;
        }
        self.followed = point;
    }

    /// Interpolates to `goal`: `t` = 0 stays, 1 arrives. For smooth changes of view.
    pub fn towards(&self, goal: &Self, t: f32) -> Self {
        use std::f32::consts::{PI, TAU};
        let turn = (goal.yaw - self.yaw + PI).rem_euclid(TAU) - PI;
        Self {
            target: self.target.lerp(goal.target, t),
            yaw: self.yaw + turn * t,
            pitch: self.pitch + (goal.pitch - self.pitch) * t,
            distance: self.distance * (goal.distance / self.distance).powf(t),
            field_of_view: self.field_of_view + (goal.field_of_view - self.field_of_view) * t,
            ..*goal
        }
    }

    /// The scene's up direction, a unit vector.
    pub fn up(&self) -> Vec3 {
        self.up
    }

    /// Unit vector that points to the right in the front view.
    pub fn front_right(&self) -> Vec3 {
        self.right
    }

    /// Eye point, m.
    pub fn eye(&self) -> Vec3 {
        self.target + self.axes().2 * self.distance
    }

    /// Unit vectors right, up (on the screen) and back (towards the eye), world axes.
    pub fn axes(&self) -> (Vec3, Vec3, Vec3) {
        let level = self.back_at(self.yaw);
        let (sin, cos) = self.pitch.sin_cos();
        let back = level * cos + self.up * sin;
        let up = self.up * cos - level * sin;
        (up.cross(back), up, back)
    }

    /// Size of one pixel at the target's distance, m.
    pub fn metres_per_pixel(&self, size: [u32; 2]) -> f32 {
        2.0 * self.distance * (self.field_of_view / 2.0).tan() / size[1].max(1) as f32
    }

    /// View as matrices for a picture of `size` pixels.
    pub fn view(&self, size: [u32; 2]) -> Eye {
        let (_, up, back) = self.axes();
        let position = self.eye();
        let aspect = size[0].max(1) as f32 / size[1].max(1) as f32;
        let (near, far) = (self.distance * 0.02, self.distance * 50.0);
        let clip_from_view = glam::camera::rh::proj::directx::perspective(self.field_of_view, aspect, near, far);
        let view_from_world: Mat4 = glam::camera::rh::view::look_to_mat4(position, -back, up);
        Eye { clip_from_world: clip_from_view * view_from_world, position }
    }

    /// Pixel of a world point; `None` behind the eye.
    pub fn project(&self, point: Vec3, size: [u32; 2]) -> Option<Vec2> {
        self.view(size).project(point, size)
    }

    /// Ray through a pixel: origin and unit direction.
    pub fn ray(&self, pixel: Vec2, size: [u32; 2]) -> (Vec3, Vec3) {
        let (right, up, back) = self.axes();
        let off_centre = (pixel - Vec2::new(size[0] as f32, size[1] as f32) / 2.0) * self.metres_per_pixel(size);
        let through = right * off_centre.x - up * off_centre.y - back * self.distance;
        (self.eye(), through.normalize())
    }

    fn back_at(&self, yaw: f32) -> Vec3 {
        let (sin, cos) = yaw.sin_cos();
        self.right.cross(self.up) * cos + self.right * sin
    }
}

impl Eye {
    /// Pixel of a world point in a picture of `size`; `None` behind the eye.
    pub fn project(&self, point: Vec3, size: [u32; 2]) -> Option<Vec2> {
        let clip: Vec4 = self.clip_from_world * point.extend(1.0);
        if clip.w <= 0.0 {
            return None;
        }
        let x = (clip.x / clip.w * 0.5 + 0.5) * size[0] as f32;
        let y = (0.5 - clip.y / clip.w * 0.5) * size[1] as f32;
        Some(Vec2::new(x, y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [1280, 720];

    fn camera(down: SignedAxis) -> Camera {
        Camera::new(down, Bounds { centre: Vec3::new(0.2, -0.1, 0.05), radius: 0.3 })
    }

    #[test]
    fn down_points_down_on_the_screen_from_every_level_side() {
        use SignedAxis::*;
        for axis in [PlusX, MinusX, PlusY, MinusY, PlusZ, MinusZ] {
            for preset in [Preset::Front, Preset::Side, Preset::Isometric] {
                let mut camera = camera(axis);
                camera.preset(preset);
                let down = crate::view::to_f32(&axis.unit());
                let here = camera.project(camera.target, SIZE).expect("before the eye");
                let below = camera.project(camera.target + 0.02 * down, SIZE).expect("before the eye");
                assert!(below.y > here.y + 5.0, "{axis:?} {preset:?}: {here} {below}");
                assert!((below.x - here.x).abs() < 1e-2, "{axis:?} {preset:?}");
            }
        }
    }

    #[test]
    fn a_ray_through_a_pixel_meets_the_point_that_projects_there() {
        let camera = camera(SignedAxis::PlusX);
        for point in [Vec3::new(0.1, 0.0, 0.2), Vec3::new(0.3, -0.2, -0.1), camera.target] {
            let pixel = camera.project(point, SIZE).expect("before the eye");
            let (origin, direction) = camera.ray(pixel, SIZE);
            let distance = (point - origin).cross(direction).length();
            assert!(distance < 1e-5, "passes {distance} m from {point}");
        }
    }

    #[test]
    fn zoom_keeps_the_point_under_the_cursor() {
        let mut camera = camera(SignedAxis::MinusZ);
        let cursor = Vec2::new(1000.0, 150.0);
        let (right, up, _) = camera.axes();
        let offset = (cursor - Vec2::new(640.0, 360.0)) * camera.metres_per_pixel(SIZE);
        let under = camera.target + right * offset.x - up * offset.y;
        for factor in [1.3, 2.0, 0.25] {
            camera.zoom(factor, cursor, SIZE);
            let now = camera.project(under, SIZE).expect("before the eye");
            assert!(now.distance(cursor) < 0.05, "factor {factor}: {now}");
        }
        let before = camera;
        camera.zoom(f32::NAN, cursor, SIZE);
        camera.zoom(-1.0, cursor, SIZE);
        assert_eq!(camera, before, "a bad factor changes nothing");
    }

    #[test]
    fn pan_moves_the_scene_with_the_cursor() {
        let mut camera = camera(SignedAxis::MinusZ);
        let point = camera.target;
        camera.pan(Vec2::new(100.0, -40.0), SIZE);
        let now = camera.project(point, SIZE).expect("before the eye");
        assert!(now.distance(Vec2::new(740.0, 320.0)) < 0.05, "{now}");
    }

    #[test]
    fn zooming_about_a_point_keeps_it_in_place_and_in_front() {
        let mut camera = camera(SignedAxis::PlusX);
        let point = Vec3::new(0.3, 0.05, -0.2);
        let before = camera.project(point, SIZE).expect("before the eye");
        for _ in 0..100 {
            camera.zoom_about(1.3, point, SIZE);
        }
        let after = camera.project(point, SIZE).expect("before the eye");
        assert!(before.distance(after) < 1.0, "{before} {after}");
        assert!(camera.eye().distance(point) < 1e-3);
    }

    #[test]
    fn following_keeps_the_followed_point_in_place_on_the_screen() {
        let mut camera = camera(SignedAxis::MinusZ);
        let start = Vec3::new(0.25, 0.0, 0.1);
        camera.follow(Some(start));
        let before = camera.project(start, SIZE).expect("before the eye");
        let moved = start + Vec3::new(0.03, -0.02, 0.05);
        camera.follow(Some(moved));
        let after = camera.project(moved, SIZE).expect("before the eye");
        assert!(before.distance(after) < 0.05, "{before} {after}");
    }

    #[test]
    fn fitting_touches_an_edge_and_crosses_none() {
        let balls =
            [(Vec3::new(0.5, 0.0, 0.0), 0.05), (Vec3::new(-0.3, 0.2, 0.1), 0.1), (Vec3::new(0.0, -0.4, 0.2), 0.0)];
        for (size, reserved) in [
            ([1280, 720], [0.0; 4]),
            ([300, 900], [0.0; 4]),
            ([640, 400], [250.0, 0.0, 0.0, 60.0]),
            ([640, 400], [0.0, 150.0, 90.0, 0.0]),
            ([640, 400], [0.0, 0.0, 180.0, 0.0]),
        ] {
            let mut camera = camera(SignedAxis::MinusZ);
            camera.fit_balls(&balls, size, reserved);
            let [w, h] = size.map(|n| n as f32);
            let [left, right, top, bottom] = reserved;
            let (free_w, free_h) = (w - left - right, h - top - bottom);
            let mut least = f32::INFINITY;
            for (centre, radius) in balls {
                // Points of each ball, seen from all sides.
                for k in 0..200 {
                    let (a, b) = (k as f32 * 0.7, k as f32 * 0.31);
                    let on = centre + radius * Vec3::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos());
                    let p = camera.project(on, size).expect("before the eye");
                    least = least
                        .min((p.x - left) / free_w)
                        .min((w - right - p.x) / free_w)
                        .min((p.y - top) / free_h)
                        .min((h - bottom - p.y) / free_h);
                }
            }
            // The margin of 16 % leaves 0.5 (1 - 1/1.16) = 6.9 % at the tightest edge.
            assert!((0.06..0.08).contains(&least), "{size:?} {reserved:?}: {least}");
        }
    }
}
