//! Orbit camera. Pixels count from the top left of the picture.

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::{Bounds, Eye};
use crate::scene::SignedAxis;

/// A named point of view.
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

/// A perspective camera that turns about a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// What it turns about, m.
    pub target: Vec3,
    /// Turn about the vertical, rad; 0 looks from the front.
    pub yaw: f32,
    /// Height angle, rad; positive looks down.
    pub pitch: f32,
    /// Eye to target, m.
    pub distance: f32,
    /// Vertical angle of view, rad.
    pub field_of_view: f32,
    up: Vec3,
    right: Vec3,
    followed: Option<Vec3>,
}

/// Steepest view; a right angle is looking straight down.
const STEEPEST: f32 = std::f32::consts::FRAC_PI_2;

impl Camera {
    /// Isometric view of `bounds` with `down` pointing down on the screen.
    pub fn new(down: SignedAxis, bounds: Bounds) -> Self {
        let down = super::to_f32(&down.unit());
        // The horizontal axis that runs to the right in the front view: Z for the paper's X-down scene (its sliders 1
        // and 2 move along Z), X for the usual Z-up and Y-up ones.
        let right = if down.x == 0.0 { Vec3::X } else { Vec3::Z };
        let mut camera = Self {
            target: bounds.centre,
            yaw: 0.0,
            pitch: 0.0,
            distance: 1.0,
            field_of_view: 0.6,
            up: -down,
            right,
            followed: None,
        };
        camera.preset(Preset::Isometric);
        camera.fit(bounds, 16.0 / 9.0);
        camera
    }

    /// Turns to a named point of view; target and distance stay.
    pub fn preset(&mut self, preset: Preset) {
        (self.yaw, self.pitch) = match preset {
            Preset::Front => (0.0, 0.0),
            Preset::Side => (STEEPEST, 0.0),
            Preset::Top => (0.0, STEEPEST),
            Preset::Isometric => (0.6, 0.42),
        };
    }

    /// Moves so that all of `bounds` is in a picture of the given aspect (width by height); the direction stays.
    pub fn fit(&mut self, bounds: Bounds, aspect: f32) {
        let half = (self.field_of_view / 2.0).tan();
        let half_angle = (half * aspect.min(1.0)).atan();
        self.target = bounds.centre;
        self.distance = (bounds.radius.max(1e-6) / half_angle.sin()) * 1.02;
    }

    /// Looks at a ball of `radius` about `centre` from the side to which `opening` points, a little from above.
    pub fn close_up(&mut self, centre: Vec3, opening: Vec3, radius: f32) {
        let out = opening.normalize_or(self.back_at(0.0));
        let level = Vec2::new(out.dot(self.right), out.dot(self.back_at(0.0)));
        // An opening straight up or down says nothing about the turn: that stays as it is.
        if level.length() > 1e-3 {
            self.yaw = level.x.atan2(level.y) + 0.25;
        }
        self.pitch = (out.dot(self.up).clamp(-1.0, 1.0).asin() + 0.25).clamp(-STEEPEST, STEEPEST);
        self.fit(Bounds { centre, radius }, 1.0);
    }

    /// Turns by a drag of `drag` pixels.
    pub fn orbit(&mut self, drag: Vec2) {
        const RADIANS_PER_PIXEL: f32 = 0.006;
        self.yaw = (self.yaw - drag.x * RADIANS_PER_PIXEL).rem_euclid(std::f32::consts::TAU);
        self.pitch = (self.pitch + drag.y * RADIANS_PER_PIXEL).clamp(-STEEPEST, STEEPEST);
    }

    /// Shifts by a drag of `drag` pixels: what lies at the target's distance stays under the cursor.
    pub fn pan(&mut self, drag: Vec2, size: [u32; 2]) {
        let metres = self.metres_per_pixel(size);
        let (right, up, _) = self.axes();
        self.target += (up * drag.y - right * drag.x) * metres;
    }

    /// Comes nearer by `factor` (above 1 is nearer); what is under `cursor` at the target's distance stays there.
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

    /// Moves with a followed point: call each frame with its place, or `None` to stay.
    pub fn follow(&mut self, point: Option<Vec3>) {
        if let (Some(now), Some(before)) = (point, self.followed) {
            self.target += now - before;
        }
        self.followed = point;
    }

    /// Part of the way to `goal`: `t` = 0 stays, 1 arrives. For smooth changes of view.
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

    /// Unit vector up in the scene.
    pub fn up(&self) -> Vec3 {
        self.up
    }

    /// Unit vector that runs to the right in the front view.
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

    /// Length at the target's distance that one pixel covers, m.
    pub fn metres_per_pixel(&self, size: [u32; 2]) -> f32 {
        2.0 * self.distance * (self.field_of_view / 2.0).tan() / size[1].max(1) as f32
    }

    /// View as matrices for a picture of `size` pixels.
    pub fn view(&self, size: [u32; 2]) -> Eye {
        let (_, up, back) = self.axes();
        let position = self.eye();
        let aspect = size[0].max(1) as f32 / size[1].max(1) as f32;
        let (near, far) = (self.distance * 0.02, self.distance * 50.0);
        let clip_from_view =
            glam::camera::rh::proj::directx::perspective(self.field_of_view, aspect, near, far);
        let view_from_world: Mat4 = glam::camera::rh::view::look_to_mat4(position, -back, up);
        Eye {
            clip_from_world: clip_from_view * view_from_world,
            position,
        }
    }

    /// Pixel of a world point; `None` behind the eye.
    pub fn project(&self, point: Vec3, size: [u32; 2]) -> Option<Vec2> {
        self.view(size).project(point, size)
    }

    /// Ray through a pixel: origin and unit direction.
    pub fn ray(&self, pixel: Vec2, size: [u32; 2]) -> (Vec3, Vec3) {
        let (right, up, back) = self.axes();
        let off_centre =
            (pixel - Vec2::new(size[0] as f32, size[1] as f32) / 2.0) * self.metres_per_pixel(size);
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
