//! The 3D viewport: mouse camera, picking, and overlays on the picture.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use eframe::egui::{
    self, Checkbox, PointerButton, Pos2, Rect, RectAlign, RichText, Role, Sense, Slider, Tooltip, Ui, WidgetInfo, vec2,
};
use glam::{Vec2, Vec3};

use super::labels::LabelPositions;
use super::overlay::{self, Overlay, Room, Strips};
use super::pace::{Pace, ShownFrame};
use super::player::Player;
use super::pull::Grip;
use super::ruler::RulerScale;
use super::{ghosts, keys, opening, spoken, value, zoom};
use crate::machine::Vec3 as Exact;
use crate::render;
use crate::session::expected::ExpectedMotion;
use crate::session::link::CameraPose;
use crate::simulate::{ContactMode, Pull};
use crate::view::{
    Camera, Cloud, DrawList, MARK_DURATION, PeakMarks, Preset, Quality, Scaling, ScenePart, SceneView, Shot, Swept,
    Theme, ViewOptions, WearMap, to_f32,
};

/// Length of the probe's trail, points.
const TRAIL_LENGTH: usize = 1500;

/// Largest camera distance by zooming, in radii of the machine.
const MAX_CAMERA_DISTANCE: f32 = 30.0;

/// Distance of the camera at the first visit relative to that of a close-up.
const NEARER: f32 = 0.62;
/// Greatest distance of the expected motion from the machine, in its radii.
const MAX_EXPECTED_DISTANCE: f32 = 4.0;

/// A touch that stays this long, s, within this distance, points, grips the body under it.
const GRIP_TIME: f64 = 0.5;
const GRIP_DISTANCE: f32 = 6.0;
/// Rings around the pointer that are searched for a body to pull: radius, points, and number of places.
const GRIP_RINGS: [(f32, usize); 3] = [(0.0, 1), (5.0, 6), (10.0, 8)];

/// The shot of the player's displayed instant. A macro, because the draw list is borrowed at the same time.
macro_rules! shot {
    ($self:ident, $player:ident, $camera:expr, $screen:expr) => {
        Shot {
            scene: $player.running(),
            frame: $player.frame(),
            marks: &$self.marks,
            options: &$self.options,
            camera: $camera,
            trail: &$self.trail,
            size: $screen.size,
            pixels_per_point: $screen.scale,
        }
    };
}

/// Camera, view options and data retained between pictures of one scene.
pub struct Viewport {
    /// The view options.
    pub options: ViewOptions,
    view: SceneView,
    camera: Camera,
    /// Target of the moving camera; `None` once reached.
    goal: Option<Camera>,
    fit_pending: bool,
    /// Aspect ratio (width / height) of the last fitted picture, or of a wider one in which the camera was moved since; a
    /// narrower picture shows the same width.
    fitted: f32,
    /// Whether the scene is fitted and the camera was not moved since; a new aspect ratio is then refitted.
    fits: bool,
    /// Aspect ratio of the view on the screen, while a picture is drawn off screen.
    frozen: Option<f32>,
    marks: PeakMarks,
    places: LabelPositions,
    #[cfg(not(target_arch = "wasm32"))]
    second_places: LabelPositions,
    /// The displayed list; the next one reuses the buffers of the previous.
    list: Arc<DrawList>,
    next: DrawList,
    /// Unique number of the displayed picture.
    revision: u64,
    /// Displayed list of the second window, and its number.
    #[cfg(not(target_arch = "wasm32"))]
    second: (Arc<DrawList>, u64),
    trail: Vec<Vec3>,
    /// Where the machine was, and where it is expected during the next turn of its drives.
    motion: Swept,
    expected: ExpectedMotion,
    followed: Option<ScenePart>,
    time: f64,
    /// Whether the user has changed the view from the scene's initial one.
    moved: bool,
    /// The pointer's grip, and whether it changed.
    grip: Option<Grip>,
    /// Start of the touch on the picture, s of viewing; infinite once it has moved or gripped.
    finger_since: Option<f64>,
    grip_changed: bool,
    /// Whether there was more than one finger since the last time there was none.
    pinched: bool,
    /// The clicked joint, and whether it was a double click, until it is taken.
    clicked: Option<(usize, bool)>,
    /// What the latest single click hit.
    tapped: Option<ScenePart>,
    /// Quality control by frame time; `None` always uses the quality of the options.
    pace: Option<Pace>,
    /// Title, if another picture is beside it; common reference force of the arrows in both, N.
    pub title: Option<String>,
    /// Errors of the tip over the workspace.
    pub(super) cloud: Option<Cloud>,
    pub(super) common: Option<f32>,
    /// Reference force of a run under reproduction, or of a film, N.
    run_scale: Option<f32>,
    /// How the scale of the arrows changes.
    pub(super) ruler: RulerScale,
    /// Whether only machine and time are shown for lack of room.
    pub(super) bare: bool,
    /// Whether the time is shown elsewhere in the window.
    pub(super) hides_time: bool,
    /// Area of the scene in the latest picture, points.
    scene: Rect,
    /// Place of the picture in the renderer.
    place: render::PictureSlot,
}

impl Viewport {
    /// A viewport that shows the whole scene.
    pub fn new(player: &Player, options: ViewOptions) -> Self {
        let view = SceneView::new(player.running(), player.frame());
        Self {
            camera: view.camera(),
            goal: None,
            fit_pending: true,
            fitted: 1.0,
            fits: true,
            frozen: None,
            view,
            options,
            marks: PeakMarks::new(),
            places: LabelPositions::default(),
            #[cfg(not(target_arch = "wasm32"))]
            second_places: LabelPositions::default(),
            list: Arc::new(DrawList::default()),
            next: DrawList::default(),
            revision: 0,
            #[cfg(not(target_arch = "wasm32"))]
            second: <_>::default(),
            trail: Vec::new(),
            motion: Swept::default(),
            expected: ExpectedMotion::default(),
            followed: None,
            time: player.pacer.shown(),
            moved: false,
            grip: None,
            finger_since: None,
            grip_changed: false,
            pinched: false,
            clicked: None,
            tapped: None,
            pace: None,
            title: None,
            cloud: None,
            common: None,
            run_scale: None,
            ruler: RulerScale::default(),
            bare: false,
            hides_time: false,
            scene: Rect::ZERO,
            place: render::PictureSlot::Window,
        }
    }

    /// A second viewport, for another run beside the first.
    pub fn beside(player: &Player) -> Self {
        Self { place: render::PictureSlot::Beside, ..Self::new(player, ViewOptions::default()) }
    }

    /// Force of the longest arrow, N.
    pub(super) fn reference(&self) -> f32 {
        self.marks.reference(&self.options.arrows)
    }

    /// Scales the arrows by the largest force of the run up to `until`, s, or by the present forces if they are larger, until
    /// [`Self::release_scale`].
    pub(super) fn hold_scale(&mut self, player: &Player, until: f64) {
        let joints = player.frame().joints.iter();
        let present = joints.map(|joint| joint.normal_force.norm() as f32).filter(|force| force.is_finite());
        let past = player.impact_record().peaks(0.0, until).map(|(_, peak)| peak.force.norm() as f32);
        let largest = present.chain(past).fold(self.marks.largest(), f32::max);
        self.run_scale = Some(PeakMarks::reference_for(largest).max(self.run_scale.unwrap_or(0.0)));
    }

    /// Lets the scale of the arrows follow the recent forces again.
    pub(super) fn release_scale(&mut self) {
        self.run_scale = None;
    }

    /// Copies the camera of `other`.
    pub fn copy_camera(&mut self, other: &Self) {
        (self.camera, self.goal) = (other.camera, other.goal);
        (self.fit_pending, self.fitted, self.moved) = (other.fit_pending, other.fitted, other.moved);
        (self.frozen, self.followed, self.fits) = (other.frozen, other.followed, other.fits);
    }

    /// Copies the camera and the effective options of `other`.
    pub fn copy_view(&mut self, other: &Self) {
        self.options.clone_from(&other.options);
        self.options.quality = other.quality();
        self.places.beside.clone_from(&other.places.own);
        self.copy_camera(other);
    }

    /// Whether the names of `other` have moved since [`Self::copy_view`].
    pub fn lags_behind_names_of(&self, other: &Self) -> bool {
        self.places.beside != other.places.own
    }

    /// Camera pose, or its target while the camera moves; `None` before the first picture.
    pub fn pose(&self) -> Option<CameraPose> {
        let camera = self.goal.unwrap_or(self.camera);
        let own = self.moved || self.followed.is_some();
        (own || !self.fit_pending).then(|| CameraPose {
            fitted: (!own).then_some(self.fitted),
            yaw: camera.yaw,
            pitch: camera.pitch,
            distance: camera.distance,
            target: camera.target.to_array(),
        })
    }

    /// Aspect ratio for which the camera was placed.
    pub fn fitted_aspect(&self) -> f32 {
        self.fitted
    }

    /// As [`Self::set_pose`], for a picture of aspect ratio [`Self::fitted_aspect`].
    pub fn set_pose_for(&mut self, pose: CameraPose, aspect: f32) {
        self.set_pose(pose);
        self.fitted = aspect;
    }

    /// Sets the camera pose.
    pub fn set_pose(&mut self, pose: CameraPose) {
        self.camera.yaw = pose.yaw;
        self.camera.pitch = pose.pitch;
        self.camera.distance = pose.distance;
        self.camera.target = Vec3::from_array(pose.target);
        (self.goal, self.fit_pending, self.moved) = (None, false, pose.fitted.is_none());
        self.fits = !self.moved;
        self.fitted = pose.fitted.unwrap_or(self.fitted);
    }

    /// Drops earlier marks and trail after a jump in time.
    pub fn clear_history(&mut self, player: &Player) {
        self.time = player.pacer.shown();
        self.marks.clear(self.time);
        self.trail.clear();
    }

    /// Joint, force in N and age in s of every mark.
    pub fn peak_marks(&self, player: &Player) -> Vec<(usize, f32, f64)> {
        let marks = self.marks.marks(player.frame());
        marks.map(|mark| (mark.joint, mark.force.length(), mark.age)).collect()
    }

    /// As [`Self::clear_history`] for an instant reached before: shows the preceding blows as in playback.
    pub fn restore_marks(&mut self, player: &Player) {
        self.clear_history(player);
        self.restore_recent_peaks(player);
    }

    /// Shows the blows before the displayed instant as in playback.
    fn restore_recent_peaks(&mut self, player: &Player) {
        let (shown, fade) = (player.pacer.shown(), MARK_DURATION * player.pacer.scale());
        let peaks = player.impact_record().peaks(shown - fade, shown);
        let blows = peaks.map(|(joint, top)| (joint, crate::view::to_f32(&top.force), top.time));
        self.marks.recall(player.frame(), blows, fade);
        self.locate_marks(player);
    }

    /// Marks past impacts at the end or corner that was hit.
    fn locate_marks(&mut self, player: &Player) {
        let joints = &player.running().machine.loose_joints;
        self.marks.locate(|joint, time| {
            joints.get(joint).filter(|joint| !joint.kind.site_names().is_empty())?;
            player.impact_record().place_of_peak(joint, time)
        });
    }

    /// Shows another scene, or the same one after a reset that changed its shapes; user settings stay.
    pub fn show_scene(&mut self, player: &Player) {
        *self = Self { pace: self.pace.take().map(|_| Pace::default()), ..Self::new(player, self.options.clone()) };
    }

    /// After a reset with unchanged shapes: shows t = 0.
    pub fn restart(&mut self, player: &Player) {
        self.view = SceneView::new(player.running(), player.frame());
        self.clear_history(player);
        (self.motion, self.expected) = (Swept::default(), ExpectedMotion::default());
        self.followed = None;
    }

    /// Updates peak marks, flashes, trail and camera, `dt` seconds after the last frame. Returns whether something is still
    /// moving.
    pub fn advance(&mut self, player: &Player, dt: f32) -> bool {
        let shown = player.pacer.shown();
        let fade = MARK_DURATION * player.pacer.scale();
        self.marks.update(player.frame(), player.peaks(), fade);
        self.locate_marks(player);
        if shown != self.time || player.is_playing() {
            if shown < self.time {
                // Blows after the displayed instant are dropped, those before it restored.
                self.trail.clear();
                self.restore_recent_peaks(player);
            }
            self.time = shown;
            self.extend_trail(player);
            self.view.add_motion(&mut self.motion, player.running(), player.frame(), &self.options);
        }
        if let Some(picked) = self.followed {
            let anchor = self.view.anchor(player.running(), player.frame(), picked);
            self.camera.follow(anchor);
            if let Some(goal) = &mut self.goal {
                goal.follow(anchor);
            }
        }
        let Some(goal) = self.goal else {
            return false;
        };
        let rate = 1.0 - (-dt * 14.0).exp();
        self.camera = self.camera.towards(&goal, rate);
        let near = (self.camera.target - goal.target).length() < 1e-3 * goal.distance
            && (self.camera.distance - goal.distance).abs() < 1e-3 * goal.distance
            && (self.camera.yaw - goal.yaw).abs() < 1e-3
            && (self.camera.pitch - goal.pitch).abs() < 1e-3;
        if near {
            self.camera = goal;
            self.goal = None;
        }
        true
    }

    /// Turns to a named point of view and fits the scene.
    pub fn preset(&mut self, preset: Preset) {
        self.follow(None);
        let mut goal = self.goal.unwrap_or(self.camera);
        goal.preset(preset);
        self.goal = Some(goal);
        self.fit_pending = true;
        self.moved = true;
    }

    /// Fits the scene from the present direction.
    pub fn fit(&mut self) {
        self.follow(None);
        self.fit_pending = true;
    }

    /// Moves close to joint `joint`.
    pub fn show_close_up(&mut self, player: &Player, joint: usize) {
        if joint < player.frame().joints.len() {
            let mut goal = self.camera;
            let scene = player.running();
            self.view.close_up(&mut goal, joint, scene, player.frame(), &self.options);
            self.move_and_follow(player, goal, joint);
        }
    }

    /// Shows joint `joint` from close up at once, larger than [`Self::show_close_up`].
    pub fn begin_close_up(&mut self, player: &Player, joint: usize) {
        self.show_close_up(player, joint);
        if let Some(mut goal) = self.goal.take() {
            goal.distance *= NEARER;
            self.camera = goal;
        }
    }

    /// Moves back to the whole scene, as it was first shown.
    pub fn show_whole(&mut self) {
        self.follow(None);
        let first = self.view.camera();
        let mut goal = self.goal.unwrap_or(self.camera);
        (goal.yaw, goal.pitch) = (first.yaw, first.pitch);
        self.goal = Some(goal);
        (self.fit_pending, self.moved) = (true, false);
    }

    /// Centres the view on joint `joint` and follows it.
    pub fn centre(&mut self, player: &Player, joint: usize) {
        if let Some(centre) = self.view.anchor(player.running(), player.frame(), ScenePart::Joint(joint)) {
            let mut goal = self.goal.unwrap_or(self.camera);
            goal.target = centre;
            self.move_and_follow(player, goal, joint);
        }
    }

    /// Moves to `goal` and follows joint `joint`.
    fn move_and_follow(&mut self, player: &Player, goal: Camera, joint: usize) {
        self.goal = Some(goal);
        (self.fit_pending, self.fits, self.moved) = (false, false, true);
        let picked = ScenePart::Joint(joint);
        self.follow(Some(picked));
        let anchor = self.view.anchor(player.running(), player.frame(), picked);
        self.camera.follow(anchor);
        if let Some(goal) = &mut self.goal {
            goal.follow(anchor);
        }
    }

    /// Switches the reduction of quality at slow frame rates on or off.
    pub fn follow_frame_rate(&mut self, on: bool) {
        self.pace = on.then(Pace::default);
    }

    /// Quality of the latest picture.
    pub fn quality(&self) -> Quality {
        self.list.quality
    }

    /// World vectors to the right and up in the picture.
    pub fn picture_axes(&self) -> [Vec3; 2] {
        let (right, up, _) = self.camera.axes();
        [right, up]
    }

    /// The joint clicked since the last call, by its ball or its name, and whether it was a double click.
    pub fn take_clicked(&mut self) -> Option<(usize, bool)> {
        self.clicked.take()
    }

    /// Fixes a body or joint at its screen position; `None` releases it.
    pub fn follow(&mut self, picked: Option<ScenePart>) {
        self.followed = picked;
        self.camera.follow(None);
        if let Some(goal) = &mut self.goal {
            goal.follow(None);
        }
    }

    /// The present pull if it has changed; `Some(None)` after a release.
    pub fn take_pull(&mut self) -> Option<Option<Pull>> {
        let changed = std::mem::take(&mut self.grip_changed);
        changed.then(|| self.grip.as_ref().map(Grip::pull))
    }

    /// The joint in focus, i.e. the followed one.
    pub fn focus(&self) -> Option<usize> {
        match self.followed {
            Some(ScenePart::Joint(joint)) => Some(joint),
            _ => None,
        }
    }

    /// The followed part, as set by [`Self::follow`].
    pub fn followed(&self) -> Option<ScenePart> {
        self.followed
    }

    /// Freezes the view: pictures of any shape contain everything visible in a view of this `aspect` (width by height). `None`
    /// resumes automatic refitting.
    pub fn freeze(&mut self, aspect: Option<f32>) {
        self.frozen = aspect;
    }

    /// The camera for a picture of `aspect` (width by height): it shows at least the width for which the camera was placed, and
    /// off screen at least the view on the screen.
    fn framed(&self, aspect: f32) -> Camera {
        self.framed_for_aspect(self.frozen, aspect)
    }

    /// The same for a picture that contains everything visible in a view of aspect `shape`.
    fn framed_for_aspect(&self, shape: Option<f32>, aspect: f32) -> Camera {
        let mut camera = self.camera;
        let shape = shape.unwrap_or(aspect);
        let wider = self.fitted.max(shape) / shape.min(aspect);
        if wider > 1.0 {
            let half = (camera.field_of_view / 2.0).tan() * wider;
            camera.field_of_view = 2.0 * half.atan();
        }
        camera
    }

    /// Applies a manual camera movement in a picture of `size`.
    fn move_camera_manually(&mut self, size: [u32; 2], act: impl FnOnce(&mut Camera)) {
        let aspect = size[0] as f32 / size[1] as f32;
        let framed = self.framed(aspect).field_of_view;
        let field_of_view = std::mem::replace(&mut self.camera.field_of_view, framed);
        act(&mut self.camera);
        self.camera.field_of_view = field_of_view;
        self.fitted = self.fitted.max(aspect);
        (self.goal, self.fits, self.moved) = (None, false, true);
    }

    /// Position, points, of a point of the scene, m, in the latest picture; `None` behind the camera.
    pub fn place(&self, point: &Exact) -> Option<Pos2> {
        let screen = Screen::new(self.scene, 1.0);
        let pixel = self.framed(screen.aspect()).project(to_f32(point), screen.size)?;
        Some(self.scene.min + vec2(pixel.x, pixel.y))
    }

    /// Position, points, of the ball of joint `joint` as drawn in the latest picture; `None` behind the camera.
    pub fn place_of_ball(&self, player: &Player, joint: usize) -> Option<Pos2> {
        let centre = self.view.ball(player.running(), player.frame(), &self.options, joint)?;
        let screen = Screen::new(self.scene, 1.0);
        let pixel = self.framed(screen.aspect()).project(centre, screen.size)?;
        Some(self.scene.min + vec2(pixel.x, pixel.y))
    }

    /// Restores the area of the scene on the screen after a picture off screen.
    pub fn set_scene_area(&mut self, area: Rect) {
        self.scene = area;
    }

    /// Area of the scene in the latest picture, points, without the strips of text above and below it.
    pub fn scene_area(&self) -> Rect {
        self.scene
    }

    /// Cycles the magnification of the play through a short list.
    pub fn next_magnification(&mut self) {
        const STEPS: [f32; 6] = [1.0, 5.0, 10.0, 20.0, 50.0, 100.0];
        let next = STEPS.iter().find(|&&step| step > self.options.magnification * 1.001);
        self.options.magnification = *next.unwrap_or(&STEPS[0]);
    }

    /// The picture over all of `ui`, with its text in strips above and below, which have `room` for widgets; a `plain` one does
    /// not describe the part under the cursor.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player, plain: bool, room: Room) -> Strips {
        let whole = ui.available_rect_before_wrap();
        let whole = Rect::from_min_size(whole.min, whole.size().max(vec2(16.0, 16.0)));
        let strips = self.cut(whole, player, room, self.hides_time);
        let rect = strips.scene;
        self.scene = rect;
        ui.advance_cursor_after_rect(whole);
        let response = ui.interact(rect, ui.scope_id().with("scene"), Sense::click_and_drag());
        let name = if self.place == render::PictureSlot::Window { "3D view" } else { "3D view before the change" };
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
        if !self.hides_time {
            let words = ui.interact(strips.top, ui.scope_id().with("time"), Sense::hover());
            words.widget_info(|| WidgetInfo::labeled(Role::Label, true, value::time(player.pacer.shown())));
        }
        let screen = Screen::new(rect, ui.ctx().pixels_per_point());
        let size = screen.size;
        self.options.theme = if ui.visuals().dark_mode { Theme::Dark } else { Theme::Light };
        let triad = self.options.triad;
        self.options.triad &= !self.bare;

        let aspect = screen.aspect();
        // Collapsing the sheet or rotating a phone would leave half of the mechanism outside. A mere touch enlarges the controls
        // and shrinks the picture a little: nothing may move under the finger.
        let reshaped = !(0.88..=1.4).contains(&(aspect / self.fitted)) && !ui.input(|i| i.pointer.any_down());
        if self.frozen.is_none() && (self.fit_pending || (reshaped && self.fits)) {
            self.fit_pending = false;
            (self.fitted, self.fits) = (aspect, true);
            // The first picture of a scene is not animated.
            let first = self.list.size == [0, 0];
            let mut goal = self.goal.unwrap_or(self.camera);
            let plate = Some(overlay::triad(rect)).filter(|_| self.options.triad && overlay::fits_labels(rect));
            let corners = |plate: Rect| [plate.min, plate.max].map(|corner| screen.pixel(corner));
            let plates: Vec<_> = plate.map(corners).into_iter().collect();
            self.expect_motion(player);
            self.motion.add(self.trail.iter().map(|point| (*point, 0.0)));
            let (scene, frame) = (player.running(), player.frame());
            self.view.fit_around(&mut goal, scene, frame, &self.options, size, &plates, &self.motion);
            if first {
                (self.camera, self.goal) = (goal, None);
            } else {
                self.goal = Some(goal);
                ui.ctx().request_repaint();
            }
        }
        self.drag(ui, &response, player, &screen);
        let camera = self.framed(aspect);
        let shot = shot!(self, player, &camera, screen);
        let pick = |pos: Pos2| self.view.pick(&shot, screen.pixel(pos));
        let hovered = response.hover_pos().filter(|_| !plain && !response.dragged()).and_then(pick);
        // A lifted finger does not hover.
        // A name is its joint.
        let named = |pos: Pos2| self.places.joint_at(pos).map(ScenePart::Joint);
        let what = |pos: Pos2| named(pos).or_else(|| pick(pos).map(|hit| hit.what));
        let tapped = response.interact_pointer_pos().filter(|_| response.clicked()).and_then(what);
        let hovered_name = response.hover_pos().filter(|_| !plain && !response.dragged()).and_then(named);
        // The second click of two is for what the first one hit, which may have moved the picture since.
        let tapped = match (response.clicked(), response.double_clicked()) {
            (true, true) => self.tapped.take().or(tapped),
            (true, false) => {
                self.tapped = tapped;
                tapped
            }
            (false, _) => tapped,
        };
        let on_screen = !plain && self.frozen.is_none();
        let follows = self.pace.is_some() && on_screen;
        let ghost_notes = if follows {
            self.compose_paced(ui, player, &camera, &screen)
        } else {
            self.compose(player, &camera, &screen, self.options.quality)
        };
        // A hand where a drag pulls a body.
        if self.grip.is_some() {
            ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
        } else if !plain
            && !response.dragged()
            && let Some(pos) = response.hover_pos()
            && self.grip_near(player, &camera, &screen, pos).is_some()
        {
            ui.ctx().set_cursor_icon(egui::CursorIcon::Grab);
        }
        if hovered_name.is_some() {
            ui.ctx().set_cursor_icon(egui::CursorIcon::PointingHand);
        }
        if let Some(ScenePart::Joint(joint)) = tapped {
            self.clicked = Some((joint, response.double_clicked()));
        } else if response.double_clicked() {
            self.follow(tapped);
        }
        let painter = ui.painter_at(rect);
        let revision = follows.then_some(self.revision);
        let list = self.list.clone();
        painter.add(render::Viewport::revised(rect, list, revision, self.place));
        // Scale of the drawn picture, which may have fewer pixels than the screen.
        let Screen { scale, .. } = screen.with_quality(self.list.quality);
        let theme = self.options.theme;
        if self.frozen.is_none() {
            // Before the first force there is no scale.
            let is_known = self.marks.largest() > 0.0 || self.options.arrows.reference.is_some();
            let reference = self.list.legend.as_ref().filter(|_| is_known).map(|legend| legend.reference);
            if let Some(left) = self.ruler.show(reference, ui.input(|input| input.time)) {
                ui.ctx().request_repaint_after(Duration::from_secs_f64(left));
            }
        }
        let overlay = self.overlay(player, ghost_notes, room, self.hides_time);
        let strip_painter = ui.painter_at(whole);
        overlay::paint(&strip_painter, &strips, scale, &self.list, theme, &overlay, &mut self.places);
        if let Some(what) = hovered_name.or(hovered.map(|hit| hit.what)) {
            // Placed away from the nearer edge, so that the transport below stays free.
            let low = response.hover_pos().is_some_and(|pos| pos.y > rect.center().y);
            let align = if low { RectAlign::TOP_START } else { RectAlign::BOTTOM_START };
            let mut card = Tooltip::for_enabled(&response).at_pointer().gap(12.0);
            card.popup = card.popup.align(align);
            card.show(|ui| describe(ui, player, what));
        }
        self.options.triad = triad;
        strips
    }

    /// Number of notes above the picture for which there are places.
    pub(super) fn notes(&self, player: &Player) -> usize {
        // The magnification, and the colours of a wear map.
        let own = 1 + usize::from(self.options.wear != WearMap::Off) + ghosts::most_notes(player);
        own + usize::from(self.title.is_some()) + usize::from(self.followed.is_some())
    }

    /// Cuts the picture in `whole`.
    fn cut(&self, whole: Rect, player: &Player, room: Room, hides_time: bool) -> Strips {
        let overlay = self.overlay(player, Vec::new(), room, hides_time);
        let notes = self.notes(player);
        let has_map = self.cloud.as_ref().is_some_and(|cloud| !cloud.arrows.is_empty());
        overlay::strips(whole, &overlay, notes, &self.options, has_map)
    }

    /// The overlay of the picture; `ghost_notes`: notes on ghosts.
    fn overlay(&self, player: &Player, ghost_notes: Vec<String>, room: Room, hides_time: bool) -> Overlay {
        let following = self.followed.and_then(|picked| name_of(player, picked));
        let following = following.map(|name| format!("following {name}"));
        Overlay {
            time: Some(player.pacer.shown()).filter(|_| !hides_time),
            notes: self.title.clone().into_iter().chain(following).chain(ghost_notes).collect(),
            legend: !self.bare,
            labels: !self.bare,
            has_new_scale: self.frozen.is_none() && self.ruler.is_new(),
            room,
        }
    }

    /// The view of the latest [`Self::ui`] in a second window, over all of `ui`, with another arrow `thickness`. It takes no
    /// input.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn second_ui(&mut self, ui: &mut Ui, player: &Player, thickness: f32, room: Room) -> Strips {
        let (whole, _) = ui.allocate_exact_size(ui.available_size().max(vec2(16.0, 16.0)), Sense::hover());
        let strips = self.cut(whole, player, room, false);
        let rect = strips.scene;
        let screen = Screen::new(rect, ui.ctx().pixels_per_point());
        let aspect = |[width, height]: [u32; 2]| width as f32 / height.max(1) as f32;
        let shape = self.frozen.unwrap_or(aspect(self.list.size));
        let camera = self.framed_for_aspect(Some(shape), aspect(screen.size));
        let own_thickness = std::mem::replace(&mut self.options.arrows.thickness, thickness);
        let quality = self.list.quality;
        let ghost_notes = self.list_next(player, &camera, &screen, quality);
        self.options.arrows.thickness = own_thickness;
        let (list, revision) = &mut self.second;
        if self.next != **list {
            show_next(list, &mut self.next, revision);
        }
        let painter = ui.painter_at(rect);
        painter.add(render::Viewport::revised(rect, list.clone(), Some(*revision), render::PictureSlot::Second));
        let Screen { scale, .. } = screen.with_quality(quality);
        let overlay = self.overlay(player, ghost_notes, room, false);
        let (list, theme) = (&self.second.0, self.options.theme);
        overlay::paint(&ui.painter_at(whole), &strips, scale, list, theme, &overlay, &mut self.second_places);
        strips
    }

    /// Builds the draw list for `screen` at `quality` in `self.next`; returns the notes on ghosts.
    fn list_next(&mut self, player: &Player, camera: &Camera, screen: &Screen, quality: Quality) -> Vec<String> {
        let mut list = std::mem::take(&mut self.next);
        let reduced_screen = screen.with_quality(quality);
        let own_reference = self.options.arrows.reference;
        let automatic = || Some(self.ruler.follow(self.marks.reference(&self.options.arrows)));
        self.options.arrows.reference = own_reference.or(self.common).or(self.run_scale).or_else(automatic);
        let shot = shot!(self, player, camera, reduced_screen);
        self.view.build(&shot, &mut list);
        list.quality = quality;
        let ghost_notes = ghosts::add(&self.view, &shot, player, &mut list);
        if let Some(wear) = player.wear() {
            self.view.add_wear(&shot, wear, &mut list);
        }
        if let Some(cloud) = &self.cloud {
            self.view.add_cloud(&shot, cloud, &mut list);
        }
        self.options.arrows.reference = own_reference;
        self.next = list;
        ghost_notes
    }

    /// The same in `self.list`, as a new picture.
    fn compose(&mut self, player: &Player, camera: &Camera, screen: &Screen, quality: Quality) -> Vec<String> {
        let ghost_notes = self.list_next(player, camera, screen, quality);
        self.show_next();
        ghost_notes
    }

    /// The same at the quality permitted by the frame times; an unchanged picture is retained.
    fn compose_paced(&mut self, ui: &Ui, player: &Player, camera: &Camera, screen: &Screen) -> Vec<String> {
        let before = self.list.quality;
        let ghost_notes = self.list_next(player, camera, screen, before);
        // Compares bodies first, which differ most often.
        let moves = self.next.solid != self.list.solid || self.next != *self.list;
        let Some(pace) = &mut self.pace else {
            return ghost_notes;
        };
        let (now, dt) = ui.input(|input| (input.time, f64::from(input.stable_dt)));
        let quality = pace.frame(&ShownFrame { size: screen.size, moves, now, dt, drawing: player.drawing(dt) });
        if let Some(wait) = pace.time_to_rest(now).filter(|_| quality != Quality::FULL) {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(wait));
        }
        if quality != before {
            return self.compose(player, camera, screen, quality);
        }
        if moves {
            self.show_next();
        }
        ghost_notes
    }

    fn show_next(&mut self) {
        show_next(&mut self.list, &mut self.next, &mut self.revision);
    }

    fn drag(&mut self, ui: &Ui, response: &egui::Response, player: &Player, screen: &Screen) {
        let Screen { rect, size, scale } = *screen;
        let (shift, fingers, touches) = ui.input(|i| (i.modifiers.shift, i.multi_touch(), i.any_touches()));
        self.pinched &= touches;
        if let Some(fingers) = fingers
            && (self.pinched || rect.contains(fingers.center_pos))
        {
            self.pinched = true;
            let shift = fingers.translation_delta * scale;
            self.move_camera_manually(size, |camera| camera.pan(Vec2::new(shift.x, shift.y), size));
            self.zoom(player, fingers.zoom_delta, fingers.center_pos, screen);
        }
        if self.pinched {
            // The remaining finger of a pinch does not rotate the view.
            return;
        }
        let delta = response.drag_delta() * scale;
        let delta = Vec2::new(delta.x, delta.y);
        if self.pull(ui, response, player, screen) {
            return;
        }
        let pans = response.dragged_by(PointerButton::Secondary)
            || response.dragged_by(PointerButton::Middle)
            || (shift && response.dragged_by(PointerButton::Primary));
        if pans {
            self.move_camera_manually(size, |camera| camera.pan(delta, size));
        } else if response.dragged_by(PointerButton::Primary) {
            self.move_camera_manually(size, |camera| camera.orbit(delta));
        }
        if let Some(pos) = response.hover_pos() {
            self.zoom(player, zoom::factor(ui), pos, screen);
        }
    }

    /// Grips a body by press and drag or by a long touch; returns whether the pointer grips one.
    fn pull(&mut self, ui: &Ui, response: &egui::Response, player: &Player, screen: &Screen) -> bool {
        let (finger, shift, origin) = ui.input(|i| (i.any_touches(), i.modifiers.shift, i.pointer.press_origin()));
        let starts_grip =
            if finger { self.is_long_touch(ui, response) } else { response.drag_started_by(PointerButton::Primary) };
        if let Some(origin) = origin.filter(|_| starts_grip) {
            let camera = self.framed(screen.aspect());
            self.grip = self.grip_near(player, &camera, screen, origin);
            self.grip_changed |= self.grip.is_some();
        }
        let camera = self.framed(screen.aspect());
        let Some(grip) = &mut self.grip else {
            return false;
        };
        // Not from the response: egui takes the pointer from it after a long touch.
        let pointer = ui.input(|i| i.pointer.latest_pos().filter(|_| i.pointer.primary_down()));
        match pointer {
            None => {
                self.grip = None;
                self.grip_changed = true;
            }
            Some(pos) => {
                let moved = ui.input(|i| i.pointer.delta()) * screen.scale;
                if moved != egui::Vec2::ZERO || starts_grip {
                    let moved = Vec2::new(moved.x, moved.y);
                    grip.drag(&camera, screen.pixel(pos), moved, screen.size, shift);
                    self.grip_changed = true;
                }
            }
        }
        true
    }

    /// A grip of the body at `pos`, points, or of the nearest within reach: thin rods are hard to hit.
    fn grip_near(&self, player: &Player, camera: &Camera, screen: &Screen, pos: Pos2) -> Option<Grip> {
        let shot = shot!(self, player, camera, screen);
        let around = GRIP_RINGS.into_iter().flat_map(|(radius, count)| {
            (0..count).map(move |k| radius * egui::Vec2::angled(std::f32::consts::TAU * k as f32 / count as f32))
        });
        let mut all = around.map(|offset| pos + offset).filter(|pos| screen.rect.contains(*pos));
        all.find_map(|pos| Grip::new(player, self.view.pick(&shot, screen.pixel(pos))?))
    }

    /// Whether a touch has just stayed in place long enough. (egui's own long touch is not reported to draggable widgets.)
    fn is_long_touch(&mut self, ui: &Ui, response: &egui::Response) -> bool {
        if !response.is_pointer_button_down_on() {
            self.finger_since = None;
            return false;
        }
        let (now, travel) = ui.input(|i| {
            let travel = i.pointer.latest_pos().zip(i.pointer.press_origin());
            (i.time, travel.map_or(0.0, |(pos, origin)| pos.distance(origin)))
        });
        let since = self.finger_since.get_or_insert(now);
        if travel > GRIP_DISTANCE {
            *since = f64::INFINITY;
        }
        let left = *since + GRIP_TIME - now;
        if left > 0.0 {
            if left.is_finite() {
                ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(left));
            }
            return false;
        }
        *since = f64::INFINITY;
        true
    }

    /// Zooms by `factor` about the point at `pos`, points.
    fn zoom(&mut self, player: &Player, factor: f32, pos: Pos2, screen: &Screen) {
        if factor == 1.0 {
            return;
        }
        let camera = self.framed(screen.aspect());
        let shot = shot!(self, player, &camera, screen);
        let hit = self.view.pick(&shot, screen.pixel(pos));
        let bounds = self.view.bounds();
        // Over the background, zooming is about the whole machine, which stays in view at both limits.
        let point = hit.map_or(bounds.centre, |hit| hit.point);
        let from = self.camera.eye().distance(bounds.centre);
        let at_limit = match hit {
            _ if factor < 1.0 => from > MAX_CAMERA_DISTANCE * bounds.radius,
            Some(_) => false,
            None => from < bounds.radius,
        };
        self.move_camera_manually(screen.size, |camera| {
            if !at_limit {
                camera.zoom_about(factor, point, screen.size);
            }
        });
    }

    /// Buttons for points of view; `backwards`: the layout runs from right to left.
    pub fn camera_buttons(&mut self, ui: &mut Ui, backwards: bool) {
        let mut buttons: Vec<Option<Preset>> = Preset::ALL.into_iter().map(Some).chain([None]).collect();
        if backwards {
            buttons.reverse();
        }
        for button in buttons {
            match button {
                Some(preset) => {
                    let key = Preset::ALL.iter().position(|p| *p == preset).map_or(0, |i| i + 1);
                    let help = format!("Look from here (key {key})");
                    if ui.button(preset.label()).on_hover_text(help).clicked() {
                        self.preset(preset);
                    }
                }
                None => {
                    if ui.button("Fit").on_hover_text("Show everything (key F)").clicked() {
                        self.fit();
                    }
                }
            }
        }
    }

    /// View options.
    pub fn options_ui(&mut self, ui: &mut Ui) {
        let options = &mut self.options;
        ui.label("Magnification of the clearance").on_hover_text(
            "Draws eccentricity and clearance enlarged by the same factor, so the parts stay within their play. The \
             motion of the machine is not magnified. Key X.",
        );
        let slider = Slider::new(&mut options.magnification, 1.0..=100.0).logarithmic(true).prefix("×").max_decimals(1);
        let slider = keys::slider(ui, slider, [1.0, 100.0]).accessible_name("Magnification of the clearance");
        spoken::value(&slider, &format!("{} times", value::number(f64::from(options.magnification), 3)));
        ui.add_space(4.0);
        ui.label("Force arrows");
        ui.horizontal(|ui| {
            ui.checkbox(&mut options.arrows.normal, "Normal")
                .on_hover_text("Normal force on each ball, pin or block, N");
            ui.checkbox(&mut options.arrows.friction, "Friction")
                .on_hover_text("Friction force on each ball, pin or block, N");
            ui.add_enabled(options.arrows.normal, Checkbox::new(&mut options.arrows.peaks, "Peaks")).on_hover_text(
                "A hollow arrow where a part has struck: its largest normal force, N, and how long ago that was in \
                     simulated time. It fades as simulated time passes.",
            );
        });
        ui.horizontal(|ui| {
            ui.radio_value(&mut options.arrows.scaling, Scaling::Linear, "Linear")
                .on_hover_text("Length in proportion to the force");
            ui.radio_value(&mut options.arrows.scaling, Scaling::Logarithmic, "Logarithmic")
                .on_hover_text("Length by the logarithm of the force, over three decades");
        });
        let mut automatic = options.arrows.reference.is_none();
        if ui
            .checkbox(&mut automatic, "Automatic scale")
            .on_hover_text("The scale follows the largest force; when off, it stays fixed")
            .changed()
        {
            options.arrows.reference = if automatic { None } else { Some(self.marks.reference(&options.arrows)) };
        }
        if let Some(reference) = &mut options.arrows.reference {
            let slider = ui
                .add(Slider::new(reference, 0.1..=10_000.0).logarithmic(true).suffix(" N").max_decimals(1))
                .on_hover_text("Force of the longest arrow in the legend")
                .accessible_name("Force of the reference arrow");
            spoken::value(&slider, &format!("{} N", value::number(f64::from(*reference), 6)));
        }
        ui.add_space(4.0);
        ui.label("Show");
        ui.checkbox(&mut options.flash, "Flash joints on impact")
            .on_hover_text("A ring of light about a joint when its parts have struck, brighter for a harder blow");
        ui.checkbox(&mut options.joint_names, "Joint names").on_hover_text("Names beside the joints with play");
        ui.horizontal(|ui| {
            ui.checkbox(&mut options.sockets, "Sockets").on_hover_text("The sockets, cut open");
            ui.checkbox(&mut options.hinges, "Hinges and slides")
                .on_hover_text("Pins and rails where the scene draws none of its own");
        });
        ui.checkbox(&mut options.floor, "Floor grid").on_hover_text("The floor with its grid and the shadows on it");
        ui.checkbox(&mut options.triad, "Axes and gravity")
            .on_hover_text("World axes X, Y, Z and the direction of gravity g");
        ui.checkbox(&mut options.trail, "Trail of the tip").on_hover_text("Where the probe tip has been");
        ui.add_space(4.0);
        ui.label("Wear map").on_hover_text(
            "Colours the walls of joints with play by impulse or friction work per area since the reset, or by what has worn off; \
             balls, pins and blocks become translucent. The scale is logarithmic and follows the largest value.",
        );
        ui.horizontal(|ui| {
            for (map, name, help) in [
                (WearMap::Off, "Off", "Walls as they are"),
                (WearMap::Impulse, "Impulse", "How often and how hard: time integral of the normal force, N s/mm²"),
                (WearMap::FrictionWork, "Friction work", "Magnitude of the friction work, mJ/mm²"),
                (WearMap::Depth, "Depth", "Depth of what has worn off, µm; 0 without a wear coefficient"),
            ] {
                ui.radio_value(&mut options.wear, map, name)
                    .on_hover_text(help)
                    .accessible_name(format!("Wear map: {name}"));
            }
        });
        let mut follows = self.pace.is_some();
        let quality = ui.checkbox(&mut follows, "Reduce detail to keep up").on_hover_text(
            "Reduces detail while the picture moves and a frame takes longer than 1/24 s: first the ambient \
                 shading between balls and sockets, then one sample per pixel instead of four, coarser and hard \
                 shadows, and finally fewer pixels, down to half along each edge. Detail returns when there is time \
                 to spare. At rest, and in saved pictures and films, it is complete.",
        );
        if quality.changed() {
            self.follow_frame_rate(follows);
        }
        if self.followed.is_some()
            && ui.button("Stop following").on_hover_text("Stop following (double-click on the ground)").clicked()
        {
            self.follow(None);
        }
    }

    /// Adds where the machine will be during a turn of its drives, as it moves without play.
    fn expect_motion(&mut self, player: &Player) {
        let scene = player.running();
        let Some(frames) = self.expected.of(&scene.machine, opening::viewing_period(scene)) else {
            return;
        };
        let farthest = MAX_EXPECTED_DISTANCE * self.view.bounds().radius;
        let centre = self.view.bounds().centre;
        let mut solids = Swept::default();
        for frame in frames {
            self.view.add_motion(&mut solids, scene, &frame, &self.options);
        }
        // What flies or runs away is not followed so far.
        let near = solids.spheres().iter().filter(|(at, radius)| at.distance(centre) + radius < farthest);
        self.motion.add(near.copied());
    }

    fn extend_trail(&mut self, player: &Player) {
        let output = &player.running().machine.output;
        let (Some(probe), Some(body)) = (output.probe, player.frame().bodies.get(output.body)) else {
            return;
        };
        if self.trail.len() == TRAIL_LENGTH {
            // Drops half at once: shifting the trail for every point would be too costly.
            self.trail.drain(..TRAIL_LENGTH / 2);
        }
        self.trail.push(to_f32(&(body.position + body.rotation * probe)));
    }
}

/// Displays `next` in place of `list`, as a new picture.
fn show_next(list: &mut Arc<DrawList>, next: &mut DrawList, revision: &mut u64) {
    static PICTURES: AtomicU64 = AtomicU64::new(0);
    *revision = PICTURES.fetch_add(1, Ordering::Relaxed);
    // egui has dropped the clone of the previous frame, so nothing is copied.
    std::mem::swap(Arc::make_mut(list), next);
}

/// Area of the picture in the window.
#[derive(Clone, Copy)]
struct Screen {
    /// Points.
    rect: Rect,
    /// Pixels.
    size: [u32; 2],
    /// Pixels per point.
    scale: f32,
}

impl Screen {
    fn new(rect: Rect, scale: f32) -> Self {
        let pixels = |length: f32| ((length * scale).round() as u32).max(1);
        Self { rect, size: [pixels(rect.width()), pixels(rect.height())], scale }
    }

    /// Aspect ratio, width / height.
    fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1] as f32
    }

    /// The same area with the resolution of `quality`.
    fn with_quality(&self, quality: Quality) -> Self {
        Self::new(self.rect, self.scale * quality.sharpness)
    }

    /// Pixel of the picture at `pos`, points of the window.
    fn pixel(&self, pos: Pos2) -> Vec2 {
        let pixel = (pos - self.rect.min) * self.scale;
        Vec2::new(pixel.x, pixel.y)
    }
}

fn name_of(player: &Player, picked: ScenePart) -> Option<&str> {
    let scene = player.running();
    match picked {
        ScenePart::Body(index) => scene.machine.bodies.get(index).map(|body| body.name.as_str()),
        ScenePart::Joint(index) => scene.machine.loose_joints.get(index).map(|joint| joint.name.as_str()),
        ScenePart::Fixed(_) => None,
    }
}

/// Describes the part under the cursor.
fn describe(ui: &mut Ui, player: &Player, picked: ScenePart) {
    // Makes the tooltip as wide as its longest line.
    ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
    let row = |ui: &mut Ui, name: &str, si: f64, unit: &str| {
        ui.label(format!("{name}  {}", value::quantity(si, unit, 3)));
    };
    let frame = player.frame();
    let Some(name) = name_of(player, picked) else {
        ui.label("Part of the frame: it does not move");
        return;
    };
    ui.strong(name);
    match picked {
        ScenePart::Body(index) => {
            if let (Some(body), Some(motion)) = (player.running().machine.bodies.get(index), frame.bodies.get(index)) {
                row(ui, "Mass", body.mass, "kg");
                row(ui, "Speed", motion.velocity.norm(), "m/s");
                row(ui, "Angular speed", motion.angular_velocity.norm(), "rad/s");
                row(ui, "Acceleration", motion.acceleration.norm(), "m/s^2");
            }
        }
        ScenePart::Joint(index) => {
            if let (Some(spec), Some(joint)) =
                (player.running().machine.loose_joints.get(index), frame.joints.get(index))
            {
                ui.label(value::contact(joint.state, spec.kind.parts()[0]));
                row(ui, "Normal force", joint.normal_force.norm(), "N");
                row(ui, "Friction force", joint.friction_force.norm(), "N");
                if joint.lubricant_force.norm() > 0.0 {
                    row(ui, "Lubricant force", joint.lubricant_force.norm(), "N");
                }
                if joint.state != ContactMode::Ideal {
                    row(ui, "Eccentricity", joint.eccentricity.norm(), "mm");
                    row(ui, "Clearance", joint.clearance, "mm");
                    row(ui, "Indentation", joint.penetration.max(0.0), "um");
                }
            }
        }
        ScenePart::Fixed(_) => {}
    }
    let gestures = match picked {
        ScenePart::Joint(_) => "Click for the microscope, double-click for a close-up",
        ScenePart::Body(_) | ScenePart::Fixed(_) => "Double-click to follow",
    };
    ui.label(RichText::new(gestures).small().weak());
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::app::theme;
    use crate::scene::Scene;
    use crate::view::{Cover, LabelKind};

    /// A scene displayed in pictures of several sizes at once.
    struct Watched<const N: usize> {
        player: Player,
        viewports: [Viewport; N],
        ctx: egui::Context,
    }

    /// What is drawn in a picture.
    #[derive(Default)]
    struct Drawn {
        /// Plates of the labels.
        labels: Vec<Rect>,
        list: Arc<DrawList>,
    }

    /// As in a window: buttons above, a caption below.
    const ROOM: Room = Room { buttons: vec2(118.0, 26.0), words: 40.0, notes: 0, is_wide: false };

    impl<const N: usize> Watched<N> {
        fn new(scene: &str) -> Self {
            let scene = Scene::load(scene, &[]).expect("built in");
            let mut player = Player::new(&scene).expect("starts");
            player.clock = || 0.0;
            player.pacer.set_scale(crate::app::opening::time_scale(&scene));
            player.set_playing(true);
            let options = ViewOptions { magnification: 20.0, ..ViewOptions::default() };
            let ctx = egui::Context::default();
            theme::apply(&ctx, false);
            let viewports = std::array::from_fn(|_| Viewport::new(&player, options.clone()));
            Self { viewports, player, ctx }
        }

        /// Draws picture `at` with `size`, points.
        fn draw(&mut self, at: usize, size: egui::Vec2) -> Drawn {
            let Self { player, viewports, ctx } = self;
            let viewport = &mut viewports[at];
            let input = egui::RawInput {
                screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size)),
                ..egui::RawInput::default()
            };
            let mut output = ctx.run_ui(input, |ui| {
                viewport.ui(ui, player, false, ROOM);
            });
            output.textures_delta.clear();
            let mut drawn = Drawn { list: viewport.list.clone(), ..Drawn::default() };
            for shape in output.shapes {
                if let egui::Shape::Rect(plate) = shape.shape
                    && plate.corner_radius.nw == 4
                {
                    drawn.labels.push(plate.rect);
                }
            }
            drawn
        }

        fn pass(&mut self, dt: f32) {
            self.player.advance(f64::from(dt));
            for viewport in &mut self.viewports {
                viewport.advance(&self.player, dt);
            }
        }
    }

    /// Pictures in windows of 1280 × 800, 1920 × 1080 and 390 × 844.
    const PICTURES: [egui::Vec2; 3] = [vec2(980.0, 432.0), vec2(1620.0, 690.0), vec2(390.0, 296.0)];

    /// The scene with the longest computing time for ten seconds.
    const LONGEST: &str = "hexapod";

    #[test]
    fn overlays_hide_no_part_of_a_machine_and_stay_in_place() {
        crate::scene::BUILT_IN.into_iter().filter(|scene| *scene != LONGEST).for_each(watch);
    }

    #[test]
    #[ignore = "full: half a minute"]
    fn full_overlays_hide_no_part_of_the_slowest_machine_and_stay_in_place() {
        watch(LONGEST);
    }

    /// Watches a scene for ten seconds and checks its labels.
    fn watch(scene: &str) {
        const FRAMES: usize = 20;
        let mut watched = Watched::<{ PICTURES.len() }>::new(scene);
        let mut previous_places: [HashMap<LabelKind, _>; PICTURES.len()] = Default::default();
        let (mut moves, mut names) = ([0; PICTURES.len()], [0; PICTURES.len()]);
        for frame in 0..FRAMES {
            for (at, size) in PICTURES.into_iter().enumerate() {
                let drawn = watched.draw(at, size);
                let area = watched.viewports[at].scene_area();
                let context = format!("{scene}, {size}, frame {frame}");
                for (i, plate) in drawn.labels.iter().enumerate() {
                    assert!(!drawn.labels[i + 1..].iter().any(|other| other.intersects(*plate)), "{context}");
                    assert!(area.contains_rect(*plate), "{context}");
                }
                let viewport = &watched.viewports[at];
                let mut parts = Swept::default();
                let (scene_now, shown) = (watched.player.running(), watched.player.frame());
                viewport.view.add_motion(&mut parts, scene_now, shown, &viewport.options);
                parts.add(viewport.trail.iter().map(|point| (*point, 0.0)));
                let camera = viewport.framed(area.aspect_ratio());
                let points = [area.width() as u32, area.height() as u32];
                for (part, _) in parts.spheres() {
                    let pixel = camera.project(*part, points).expect("before the eye");
                    let place = area.min + vec2(pixel.x, pixel.y);
                    assert!(area.contains(place), "{context}: a part at {place} leaves {area}");
                }
                let mut now = watched.viewports[at].places.own.clone();
                now.retain(|kind, _| matches!(kind, LabelKind::Joint(_)));
                names[at] += now.len();
                let before = std::mem::replace(&mut previous_places[at], now);
                let moved = |(kind, place)| before.get(kind).is_some_and(|was| was != place);
                moves[at] += previous_places[at].iter().filter(|label| moved(*label)).count();
                let cover = Cover::of(&drawn.list, 2.0);
                for plate in &drawn.labels {
                    // The cells at the edge extend beyond the plate by less than their size.
                    let inside = plate.shrink(2.0).translate(-area.min.to_vec2());
                    let [min, max] = [inside.min, inside.max].map(|corner| Vec2::new(corner.x, corner.y));
                    assert_eq!(cover.covered_fractions(min, max), [0.0; 2], "{context}: a part under {plate}");
                }
            }
            watched.pass(10.0 / FRAMES as f32);
        }
        for (at, size) in PICTURES.into_iter().enumerate() {
            // On average a name moves at most once in 2 s, whatever swings past it.
            let all = FRAMES * watched.player.running().machine.loose_joints.len();
            let (moves, names) = (moves[at], names[at]);
            assert!(5 * names > all && 4 * moves <= names, "{scene}, {size}: {moves} of {names} of {all}");
        }
    }

    #[test]
    fn a_new_aspect_ratio_is_refitted_until_the_camera_is_moved_and_then_shows_no_less() {
        let (wide, narrow) = (vec2(980.0, 432.0), vec2(420.0, 432.0));
        let settled = |watched: &mut Watched<1>, size| {
            watched.draw(0, size);
            watched.viewports[0].goal.unwrap_or(watched.viewports[0].camera)
        };
        let mut fresh = Watched::<1>::new("spcmm");
        let expected = settled(&mut fresh, narrow);
        let mut watched = Watched::<1>::new("spcmm");
        let first = settled(&mut watched, wide);
        // In small steps, like an opening panel.
        for width in [940.0, 890.0, 700.0, 600.0] {
            settled(&mut watched, vec2(width, 432.0));
        }
        assert_eq!(settled(&mut watched, narrow), expected);
        assert_eq!(settled(&mut watched, wide), first);
        // A selected point of view is fitted, too.
        for watched in [&mut watched, &mut fresh] {
            watched.viewports[0].preset(Preset::Front);
        }
        let expected = settled(&mut fresh, narrow);
        settled(&mut watched, wide);
        assert_eq!(settled(&mut watched, narrow), expected);

        settled(&mut watched, wide);
        while watched.viewports[0].advance(&watched.player, 0.1) {}
        let area = |viewport: &Viewport| [viewport.scene.width() as u32, viewport.scene.height() as u32];
        let placed_in = area(&watched.viewports[0]);
        watched.viewports[0].move_camera_manually(placed_in, |camera| camera.orbit(Vec2::new(40.0, 10.0)));
        let placed = watched.viewports[0].camera;
        let across = |viewport: &Viewport, size: [u32; 2]| {
            let camera = viewport.framed(size[0] as f32 / size[1] as f32);
            size.map(|edge| edge as f32 * camera.metres_per_pixel(size))
        };
        let before = across(&watched.viewports[0], area(&watched.viewports[0]));
        for size in [[420, 432], [980, 300], [300, 900], [980, 432]] {
            let _ = settled(&mut watched, vec2(size[0] as f32, size[1] as f32));
            assert_eq!(watched.viewports[0].camera, placed);
            let after = across(&watched.viewports[0], area(&watched.viewports[0]));
            assert!(after[0] >= 0.999 * before[0] && after[1] >= 0.999 * before[1], "{size:?}: {before:?} {after:?}");
        }
        // Manual camera movement makes nothing jump.
        let before = across(&watched.viewports[0], [300, 900]);
        watched.viewports[0].move_camera_manually([300, 900], |camera| camera.pan(Vec2::ZERO, [300, 900]));
        assert_eq!(across(&watched.viewports[0], [300, 900]), before);
    }

    #[test]
    fn arrows_have_the_scale_of_the_run_while_it_is_reproduced() {
        let scene = Scene::load("spcmm", &[]).expect("built in");
        let mut player = Player::new(&scene).expect("starts");
        player.run_to(20e-3);
        let peaks = player.impact_record().peaks(0.0, 20e-3);
        let largest = peaks.map(|(_, peak)| peak.force.norm() as f32).fold(0.0, f32::max);
        let mut viewport = Viewport::new(&player, ViewOptions::default());
        // As after a jump: no recent peak is known.
        viewport.clear_history(&player);
        viewport.hold_scale(&player, 20e-3);
        let ctx = egui::Context::default();
        theme::apply(&ctx, false);
        let reference = |viewport: &mut Viewport| {
            let mut output = ctx.run_ui(egui::RawInput::default(), |ui| {
                viewport.ui(ui, &player, true, Room::default());
            });
            output.textures_delta.clear();
            viewport.list.legend.as_ref().expect("drawn").reference
        };
        // Rounded up to 1, 2 or 5 times a power of ten.
        let held = reference(&mut viewport);
        assert!(largest > 100.0 && held >= largest && held < 2.6 * largest, "{held} for {largest}");
        viewport.release_scale();
        assert!(reference(&mut viewport) < largest);
    }

    #[test]
    fn the_first_picture_does_not_move_into_place() {
        let scene = Scene::load("spcmm", &[]).expect("built in");
        let player = Player::new(&scene).expect("starts");
        let mut viewport = Viewport::new(&player, ViewOptions::default());
        let draw = |viewport: &mut Viewport| {
            let ctx = egui::Context::default();
            theme::apply(&ctx, false);
            let mut output = ctx.run_ui(egui::RawInput::default(), |ui| {
                viewport.ui(ui, &player, true, Room::default());
            });
            // Nothing is uploaded.
            output.textures_delta.clear();
        };
        let unfitted = viewport.camera;
        draw(&mut viewport);
        assert_ne!(viewport.camera, unfitted);
        assert_eq!(viewport.goal, None);
        viewport.preset(Preset::Top);
        draw(&mut viewport);
        assert!(viewport.goal.is_some(), "later ones do");
    }
}
