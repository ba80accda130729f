//! The 3D viewport: camera by mouse, picking, and what the interface paints over the picture.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use eframe::egui::{
    self, Checkbox, PointerButton, Pos2, Rect, RectAlign, RichText, Role, Sense, Slider, Tooltip, Ui, WidgetInfo, vec2,
};
use glam::{Vec2, Vec3};

use super::labels::Places;
use super::overlay::{self, Overlay};
use super::pace::{Pace, Seen};
use super::player::Player;
use super::pull::Grip;
use super::{ghosts, keys, spoken, value, zoom};
use crate::machine::Vec3 as Exact;
use crate::render;
use crate::session::link::CameraPose;
use crate::simulate::{ContactState, Pull};
use crate::view::{
    Camera, DrawList, PeakMarks, Picked, Preset, Quality, SEEN, Scaling, SceneView, Shot, Theme, ViewOptions, WearMap,
    to_f32,
};

/// Points of the probe's trail that are kept.
const TRAIL: usize = 1500;

/// Farthest camera distance by the wheel, in radii of the machine.
const FARTHEST: f32 = 30.0;

/// A finger that stays for so long, s, within so many points takes hold of what is under it.
const HOLD: f64 = 0.5;
const STILL: f32 = 6.0;

/// A shot of what the player shows. A macro, since the draw list is borrowed at the same time.
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

/// Camera, view options and everything kept between two pictures of one scene.
pub struct Viewport {
    /// What to draw and how.
    pub options: ViewOptions,
    view: SceneView,
    camera: Camera,
    /// Where the camera is moving to; `None` once it is there.
    goal: Option<Camera>,
    fit_pending: bool,
    /// Width over height of the picture that was last fitted, or of a wider one in which the camera has been moved since: a narrower
    /// one shows as much across.
    fitted: f32,
    /// Everything has been fitted into the picture and the camera not been moved since: another shape is fitted anew.
    fits: bool,
    /// While a picture is drawn off screen: width over height of the view on the screen.
    frozen: Option<f32>,
    marks: PeakMarks,
    places: Places,
    #[cfg(not(target_arch = "wasm32"))]
    second_places: Places,
    /// What is shown; the one before, and room for the next.
    list: Arc<DrawList>,
    next: DrawList,
    /// Number of what is shown, another one for every other picture.
    revision: u64,
    /// The same of the second window: what it shows, and its number.
    #[cfg(not(target_arch = "wasm32"))]
    second: (Arc<DrawList>, u64),
    trail: Vec<Vec3>,
    followed: Option<Picked>,
    time: f64,
    /// The user has turned, moved or chosen the view: it is no longer the one with which a scene opens.
    moved: bool,
    /// What the pointer holds, and whether that changed.
    grip: Option<Grip>,
    /// When the finger on the picture came down, s of viewing; infinite once it has gone on or taken hold.
    finger_since: Option<f64>,
    grip_changed: bool,
    /// More than one finger has been down since none was.
    pinched: bool,
    /// Ball joint that was clicked, until it is taken.
    clicked: Option<usize>,
    /// What the frames on the screen allow; `None`: the options' quality, always.
    pace: Option<Pace>,
    /// What it shows, where another picture is beside it, and the force of the longest arrow in both, N.
    pub title: Option<String>,
    pub(super) common: Option<f32>,
    /// Machine and time alone: there is no room for more.
    pub(super) bare: bool,
    /// Where it is shown.
    place: render::Place,
}

impl Viewport {
    /// A viewport that shows all of the player's scene.
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
            places: Places::default(),
            #[cfg(not(target_arch = "wasm32"))]
            second_places: Places::default(),
            list: Arc::new(DrawList::default()),
            next: DrawList::default(),
            revision: 0,
            #[cfg(not(target_arch = "wasm32"))]
            second: <_>::default(),
            trail: Vec::new(),
            followed: None,
            time: player.pacer.shown(),
            moved: false,
            grip: None,
            finger_since: None,
            grip_changed: false,
            pinched: false,
            clicked: None,
            pace: None,
            title: None,
            common: None,
            bare: false,
            place: render::Place::Window,
        }
    }

    /// A second viewport, for another run beside the first.
    pub fn beside(player: &Player) -> Self {
        Self { place: render::Place::Beside, ..Self::new(player, ViewOptions::default()) }
    }

    /// Force of the longest arrow, N.
    pub(super) fn reference(&self) -> f32 {
        self.marks.reference(&self.options.arrows)
    }

    /// Looks from where `other` looks.
    pub fn look_as(&mut self, other: &Self) {
        (self.camera, self.goal) = (other.camera, other.goal);
        (self.fit_pending, self.fitted, self.moved) = (other.fit_pending, other.fitted, other.moved);
        (self.frozen, self.followed, self.fits) = (other.frozen, other.followed, other.fits);
    }

    /// The same with its options, as it is drawn.
    pub fn link(&mut self, other: &Self) {
        self.options.clone_from(&other.options);
        self.options.quality = other.quality();
        self.look_as(other);
    }

    /// Where the camera is or is moving to; `None` before the first picture.
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

    /// Width over height of the picture that the camera was placed for.
    pub fn shape(&self) -> f32 {
        self.fitted
    }

    /// As [`Self::set_pose`], placed for a picture of this [`Self::shape`].
    pub fn set_pose_for(&mut self, pose: CameraPose, shape: f32) {
        self.set_pose(pose);
        self.fitted = shape;
    }

    /// Places the camera.
    pub fn set_pose(&mut self, pose: CameraPose) {
        self.camera.yaw = pose.yaw;
        self.camera.pitch = pose.pitch;
        self.camera.distance = pose.distance;
        self.camera.target = Vec3::from_array(pose.target);
        (self.goal, self.fit_pending, self.moved) = (None, false, pose.fitted.is_none());
        self.fits = !self.moved;
        self.fitted = pose.fitted.unwrap_or(self.fitted);
    }

    /// After a jump in time: drops marks and trail from before it.
    pub fn arrive(&mut self, player: &Player) {
        self.time = player.pacer.shown();
        self.marks.clear(self.time);
        self.trail.clear();
    }

    /// Ball joint, force in N and age in s of every mark.
    pub fn peak_marks(&self, player: &Player) -> Vec<(usize, f32, f64)> {
        let marks = self.marks.marks(player.frame());
        marks.map(|mark| (mark.joint, mark.force.length(), mark.age)).collect()
    }

    /// As [`Self::arrive`] where the run was before: the blows shortly before that instant are shown as when it was reached by playing.
    pub fn revisit(&mut self, player: &Player) {
        self.arrive(player);
        self.recall(player);
    }

    /// Shows the blows shortly before the displayed instant as when it was reached by playing.
    fn recall(&mut self, player: &Player) {
        let (shown, fade) = (player.pacer.shown(), SEEN * player.pacer.scale());
        let peaks = player.impact_record().peaks(shown - fade, shown);
        let blows = peaks.map(|(joint, top)| (joint, crate::view::to_f32(&top.force), top.time));
        self.marks.recall(player.frame(), blows, fade);
    }

    /// Shows another scene, or the same one after a reset that changed its shapes; the choices stay.
    pub fn show_scene(&mut self, player: &Player) {
        *self = Self { pace: self.pace.take().map(|_| Pace::default()), ..Self::new(player, self.options.clone()) };
    }

    /// After a reset: the same shapes at t = 0.
    pub fn restart(&mut self, player: &Player) {
        self.view = SceneView::new(player.running(), player.frame());
        self.arrive(player);
        self.followed = None;
    }

    /// Updates peak marks, flashes, trail and moving camera, `dt` seconds after the last frame. Returns whether something still
    /// moves by itself.
    pub fn advance(&mut self, player: &Player, dt: f32) -> bool {
        let shown = player.pacer.shown();
        let fade = SEEN * player.pacer.scale();
        self.marks.update(player.frame(), player.peaks(), fade);
        if shown != self.time || player.is_playing() {
            if shown < self.time {
                // What comes after the displayed instant has not happened yet, but what came before it has.
                self.trail.clear();
                self.recall(player);
            }
            self.time = shown;
            self.extend_trail(player);
        }
        if let Some(picked) = self.followed {
            let anchor = self.view.anchor(player.frame(), picked);
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

    /// Turns to a named point of view and shows everything.
    pub fn preset(&mut self, preset: Preset) {
        self.follow(None);
        let mut goal = self.goal.unwrap_or(self.camera);
        goal.preset(preset);
        self.goal = Some(goal);
        self.fit_pending = true;
        self.moved = true;
    }

    /// Shows everything from where the camera looks.
    pub fn fit(&mut self) {
        self.follow(None);
        self.fit_pending = true;
    }

    /// Looks into ball joint `joint`.
    pub fn close_up(&mut self, player: &Player, joint: usize) {
        if joint < player.frame().joints.len() {
            let mut goal = self.camera;
            let scene = player.running();
            self.view.close_up(&mut goal, joint, scene, player.frame(), &self.options);
            self.glide(player, goal, joint);
        }
    }

    /// Centres the view on ball joint `joint` and keeps it there.
    pub fn centre(&mut self, player: &Player, joint: usize) {
        if let Some(centre) = self.view.anchor(player.frame(), Picked::Joint(joint)) {
            let mut goal = self.goal.unwrap_or(self.camera);
            goal.target = centre;
            self.glide(player, goal, joint);
        }
    }

    /// Moves to `goal`, and follows ball joint `joint` from now on.
    fn glide(&mut self, player: &Player, goal: Camera, joint: usize) {
        self.goal = Some(goal);
        (self.fit_pending, self.fits, self.moved) = (false, false, true);
        let picked = Picked::Joint(joint);
        self.follow(Some(picked));
        let anchor = self.view.anchor(player.frame(), picked);
        self.camera.follow(anchor);
        if let Some(goal) = &mut self.goal {
            goal.follow(anchor);
        }
    }

    /// Lets slow frames lower the quality while the picture moves, or does not.
    pub fn follow_frame_rate(&mut self, on: bool) {
        self.pace = on.then(Pace::default);
    }

    /// With which quality the latest picture was drawn.
    pub fn quality(&self) -> Quality {
        self.list.quality
    }

    /// World vectors to the right and up in the picture.
    pub fn across(&self) -> [Vec3; 2] {
        let (right, up, _) = self.camera.axes();
        [right, up]
    }

    /// The ball joint that was clicked since the last call.
    pub fn take_clicked(&mut self) -> Option<usize> {
        self.clicked.take()
    }

    /// Keeps a body or joint where it is on the screen; `None` lets go.
    pub fn follow(&mut self, picked: Option<Picked>) {
        self.followed = picked;
        self.camera.follow(None);
        if let Some(goal) = &mut self.goal {
            goal.follow(None);
        }
    }

    /// The present pull of the pointer, if it has changed; `Some(None)` if the pointer let go.
    pub fn take_pull(&mut self) -> Option<Option<Pull>> {
        let changed = std::mem::take(&mut self.grip_changed);
        changed.then(|| self.grip.as_ref().map(Grip::pull))
    }

    /// The ball joint in focus: the one that is followed.
    pub fn focus(&self) -> Option<usize> {
        match self.followed {
            Some(Picked::Joint(joint)) => Some(joint),
            _ => None,
        }
    }

    /// What [`Self::follow`] was given.
    pub fn followed(&self) -> Option<Picked> {
        self.followed
    }

    /// From now on the view is drawn as it is, whatever the shape of the picture: everything in a view of this `aspect` (width
    /// by height) stays in the picture. `None`: it refits itself when that is due.
    pub fn freeze(&mut self, aspect: Option<f32>) {
        self.frozen = aspect;
    }

    /// The camera for a picture of `aspect`, width by height: none shows less across than where it was placed, and one off screen no
    /// less than the view on the screen.
    fn framed(&self, aspect: f32) -> Camera {
        self.framed_as(self.frozen, aspect)
    }

    /// The same with everything in it that is in a view of aspect `shape`.
    fn framed_as(&self, shape: Option<f32>, aspect: f32) -> Camera {
        let mut camera = self.camera;
        let shape = shape.unwrap_or(aspect);
        let wider = self.fitted.max(shape) / shape.min(aspect);
        if wider > 1.0 {
            let half = (camera.field_of_view / 2.0).tan() * wider;
            camera.field_of_view = 2.0 * half.atan();
        }
        camera
    }

    /// Moves the camera by hand in a picture of `size`.
    fn by_hand(&mut self, size: [u32; 2], act: impl FnOnce(&mut Camera)) {
        let aspect = size[0] as f32 / size[1] as f32;
        let framed = self.framed(aspect).field_of_view;
        let field_of_view = std::mem::replace(&mut self.camera.field_of_view, framed);
        act(&mut self.camera);
        self.camera.field_of_view = field_of_view;
        self.fitted = self.fitted.max(aspect);
        (self.goal, self.fits, self.moved) = (None, false, true);
    }

    /// Where a point of the scene, m, is drawn, points, in a picture over `rect`; `None` behind the camera.
    pub fn place(&self, point: &Exact, rect: Rect) -> Option<Pos2> {
        let screen = Screen::new(rect, 1.0);
        let pixel = self.framed(screen.aspect()).project(to_f32(point), screen.size)?;
        Some(rect.min + vec2(pixel.x, pixel.y))
    }

    /// The next factor of a short list for the magnification of the play.
    pub fn next_magnification(&mut self) {
        const STEPS: [f32; 6] = [1.0, 5.0, 10.0, 20.0, 50.0, 100.0];
        let next = STEPS.iter().find(|&&step| step > self.options.magnification * 1.001);
        self.options.magnification = *next.unwrap_or(&STEPS[0]);
    }

    /// The picture with its overlays, over all of `ui`; a `plain` one shows nothing about what is under the cursor.
    /// Names, and the machine where it is fitted, keep clear of what is painted `above` it.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player, plain: bool, above: &[Rect]) {
        let (rect, response) =
            ui.allocate_exact_size(ui.available_size().max(vec2(16.0, 16.0)), Sense::click_and_drag());
        let name = if self.place == render::Place::Window { "3D view" } else { "3D view before the change" };
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
        let screen = Screen::new(rect, ui.ctx().pixels_per_point());
        let size = screen.size;
        self.options.theme = if ui.visuals().dark_mode { Theme::Dark } else { Theme::Light };
        let triad = self.options.triad;
        self.options.triad &= !self.bare;

        let aspect = screen.aspect();
        // Folding the sheet or turning a phone would leave half of the mechanism outside.
        // A touch alone makes its controls larger and the picture a little smaller: nothing moves under the finger.
        let reshaped = !(0.88..=1.25).contains(&(aspect / self.fitted)) && !ui.input(|i| i.pointer.any_down());
        if self.frozen.is_none() && (self.fit_pending || (reshaped && self.fits)) {
            self.fit_pending = false;
            (self.fitted, self.fits) = (aspect, true);
            // The first picture of a scene does not move into place.
            let first = self.list.size == [0, 0];
            let mut goal = self.goal.unwrap_or(self.camera);
            let plates = overlay::plates(rect, 0, &self.options).into_iter();
            let plates = plates.take(if self.bare { 1 } else { usize::MAX }).chain(above.iter().copied());
            let corners = |plate: Rect| [plate.min, plate.max].map(|corner| screen.pixel(corner));
            let plates: Vec<_> = plates.map(corners).collect();
            self.view.fit_around(&mut goal, player.running(), player.frame(), &self.options, size, &plates);
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
        let tapped = response.interact_pointer_pos().filter(|_| response.clicked()).and_then(pick).map(|hit| hit.what);
        let on_screen = !plain && self.frozen.is_none();
        let follows = self.pace.is_some() && on_screen;
        let said = if follows {
            self.compose_paced(ui, player, &camera, &screen)
        } else {
            self.compose(player, &camera, &screen, self.options.quality)
        };
        if let Some(Picked::Joint(joint)) = tapped {
            self.clicked = Some(joint);
        } else if response.double_clicked() {
            self.follow(tapped);
        }
        let painter = ui.painter_at(rect);
        let revision = follows.then_some(self.revision);
        let list = self.list.clone();
        painter.add(render::Viewport::revised(rect, list, revision, self.place));
        // Of what was drawn, which may have fewer pixels than are shown.
        let Screen { scale, .. } = screen.drawn_with(self.list.quality);
        let overlay = self.overlay(player, said);
        let theme = self.options.theme;
        overlay::paint(&painter, rect, scale, &self.list, theme, &overlay, above, &mut self.places);
        if let Some(hit) = hovered {
            // Away from the nearer edge: the transport below stays free.
            let low = response.hover_pos().is_some_and(|pos| pos.y > rect.center().y);
            let align = if low { RectAlign::TOP_START } else { RectAlign::BOTTOM_START };
            let mut card = Tooltip::for_enabled(&response).at_pointer().gap(12.0);
            card.popup = card.popup.align(align);
            card.show(|ui| describe(ui, player, hit.what));
        }
        self.options.triad = triad;
    }

    /// What is written over the picture; `said`: about ghosts.
    fn overlay(&self, player: &Player, said: Vec<String>) -> Overlay {
        let following = self.followed.and_then(|picked| name_of(player, picked));
        let following = following.map(|name| format!("following {name}"));
        Overlay {
            time: Some(player.pacer.shown()),
            notes: self.title.clone().into_iter().chain(following).chain(said).collect(),
            legend: !self.bare,
            labels: !self.bare,
        }
    }

    /// The view of the latest [`Self::ui`] in a second window, over all of `ui`, with arrows of another `thickness`. It takes no input.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn second_ui(&mut self, ui: &mut Ui, player: &Player, thickness: f32, above: Option<Rect>) {
        let (rect, _) = ui.allocate_exact_size(ui.available_size().max(vec2(16.0, 16.0)), Sense::hover());
        let screen = Screen::new(rect, ui.ctx().pixels_per_point());
        let aspect = |[width, height]: [u32; 2]| width as f32 / height.max(1) as f32;
        let shape = self.frozen.unwrap_or(aspect(self.list.size));
        let camera = self.framed_as(Some(shape), aspect(screen.size));
        let own = std::mem::replace(&mut self.options.arrows.thickness, thickness);
        let quality = self.list.quality;
        let said = self.list_next(player, &camera, &screen, quality);
        self.options.arrows.thickness = own;
        let (list, revision) = &mut self.second;
        if self.next != **list {
            show_next(list, &mut self.next, revision);
        }
        let painter = ui.painter_at(rect);
        painter.add(render::Viewport::revised(rect, list.clone(), Some(*revision), render::Place::Second));
        let Screen { scale, .. } = screen.drawn_with(quality);
        let overlay = self.overlay(player, said);
        let (list, theme) = (&self.second.0, self.options.theme);
        overlay::paint(&painter, rect, scale, list, theme, &overlay, above.as_slice(), &mut self.second_places);
    }

    /// Describes what `screen` shows with `quality` in `self.next`; returns what is said about ghosts.
    fn list_next(&mut self, player: &Player, camera: &Camera, screen: &Screen, quality: Quality) -> Vec<String> {
        let mut list = std::mem::take(&mut self.next);
        let drawn = screen.drawn_with(quality);
        let own = self.options.arrows.reference;
        self.options.arrows.reference = own.or(self.common);
        let shot = shot!(self, player, camera, drawn);
        self.view.build(&shot, &mut list);
        list.quality = quality;
        let said = ghosts::add(&self.view, &shot, player, &mut list);
        if let Some(wear) = player.wear() {
            self.view.add_wear(&shot, wear, &mut list);
        }
        self.options.arrows.reference = own;
        self.next = list;
        said
    }

    /// The same in `self.list`, as another picture.
    fn compose(&mut self, player: &Player, camera: &Camera, screen: &Screen, quality: Quality) -> Vec<String> {
        let said = self.list_next(player, camera, screen, quality);
        self.show_next();
        said
    }

    /// The same with what quality the frames allow; the picture before stays if nothing has changed.
    fn compose_paced(&mut self, ui: &Ui, player: &Player, camera: &Camera, screen: &Screen) -> Vec<String> {
        let before = self.list.quality;
        let said = self.list_next(player, camera, screen, before);
        // Bodies first: what mostly differs.
        let moves = self.next.solid != self.list.solid || self.next != *self.list;
        let Some(pace) = &mut self.pace else {
            return said;
        };
        let (now, dt) = ui.input(|input| (input.time, f64::from(input.stable_dt)));
        let quality = pace.frame(&Seen { size: screen.size, moves, now, dt, drawing: player.drawing(dt) });
        if let Some(wait) = pace.until_still(now).filter(|_| quality != Quality::FULL) {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(wait));
        }
        if quality != before {
            return self.compose(player, camera, screen, quality);
        }
        if moves {
            self.show_next();
        }
        said
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
            self.by_hand(size, |camera| camera.pan(Vec2::new(shift.x, shift.y), size));
            self.zoom(player, fingers.zoom_delta, fingers.center_pos, screen);
        }
        if self.pinched {
            // The finger that stays down longer does not rotate the view.
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
            self.by_hand(size, |camera| camera.pan(delta, size));
        } else if response.dragged_by(PointerButton::Primary) {
            self.by_hand(size, |camera| camera.orbit(delta));
        }
        if let Some(pos) = response.hover_pos() {
            self.zoom(player, zoom::factor(ui), pos, screen);
        }
    }

    /// Takes hold of a body by press and drag, or by a long touch; returns whether the pointer holds one.
    fn pull(&mut self, ui: &Ui, response: &egui::Response, player: &Player, screen: &Screen) -> bool {
        let (finger, shift, origin) = ui.input(|i| (i.any_touches(), i.modifiers.shift, i.pointer.press_origin()));
        let taken =
            if finger { self.finger_stays(ui, response) } else { response.drag_started_by(PointerButton::Primary) };
        if let Some(origin) = origin.filter(|_| taken) {
            let camera = self.framed(screen.aspect());
            let shot = shot!(self, player, &camera, screen);
            let hit = self.view.pick(&shot, screen.pixel(origin));
            self.grip = hit.and_then(|hit| Grip::new(player, hit));
            self.grip_changed |= self.grip.is_some();
        }
        let camera = self.framed(screen.aspect());
        let Some(grip) = &mut self.grip else {
            return false;
        };
        // Not the response's: egui takes the pointer from it after a long touch.
        let held = ui.input(|i| i.pointer.latest_pos().filter(|_| i.pointer.primary_down()));
        match held {
            None => {
                self.grip = None;
                self.grip_changed = true;
            }
            Some(pos) => {
                let moved = ui.input(|i| i.pointer.delta()) * screen.scale;
                if moved != egui::Vec2::ZERO || taken {
                    let moved = Vec2::new(moved.x, moved.y);
                    grip.drag(&camera, screen.pixel(pos), moved, screen.size, shift);
                    self.grip_changed = true;
                }
            }
        }
        true
    }

    /// Whether a finger has just stayed for long enough where it came down. (What egui calls a long touch does not come to what
    /// can be dragged.)
    fn finger_stays(&mut self, ui: &Ui, response: &egui::Response) -> bool {
        if !response.is_pointer_button_down_on() {
            self.finger_since = None;
            return false;
        }
        let (now, way) = ui.input(|i| {
            let way = i.pointer.latest_pos().zip(i.pointer.press_origin());
            (i.time, way.map_or(0.0, |(pos, origin)| pos.distance(origin)))
        });
        let since = self.finger_since.get_or_insert(now);
        if way > STILL {
            *since = f64::INFINITY;
        }
        let left = *since + HOLD - now;
        if left > 0.0 {
            if left.is_finite() {
                ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(left));
            }
            return false;
        }
        *since = f64::INFINITY;
        true
    }

    /// Zooms in by `factor` on what is at `pos`, points.
    fn zoom(&mut self, player: &Player, factor: f32, pos: Pos2, screen: &Screen) {
        if factor == 1.0 {
            return;
        }
        let camera = self.framed(screen.aspect());
        let shot = shot!(self, player, &camera, screen);
        let hit = self.view.pick(&shot, screen.pixel(pos));
        let bounds = self.view.bounds();
        // Over the background the zoom is about the whole machine, and neither end of its range loses it.
        let point = hit.map_or(bounds.centre, |hit| hit.point);
        let from = self.camera.eye().distance(bounds.centre);
        let lost = match hit {
            _ if factor < 1.0 => from > FARTHEST * bounds.radius,
            Some(_) => false,
            None => from < bounds.radius,
        };
        self.by_hand(screen.size, |camera| {
            if !lost {
                camera.zoom_about(factor, point, screen.size);
            }
        });
    }

    /// Buttons for points of view, each added in turn; `backwards` where the layout runs from right to left.
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
            "Draws eccentricity and clearance larger than they are, together, so that the ball never leaves its \
             socket. The motion of the machine stays as it is. Key X.",
        );
        let slider = Slider::new(&mut options.magnification, 1.0..=100.0).logarithmic(true).prefix("×").max_decimals(1);
        let slider = keys::slider(ui, slider).accessible_name("Magnification of the clearance");
        spoken::value(&slider, &format!("{} times", value::number(f64::from(options.magnification), 3)));
        ui.add_space(4.0);
        ui.label("Force arrows");
        ui.horizontal(|ui| {
            ui.checkbox(&mut options.arrows.normal, "Normal").on_hover_text("Normal force on each ball, N");
            ui.checkbox(&mut options.arrows.friction, "Friction").on_hover_text("Friction force on each ball, N");
            ui.add_enabled(options.arrows.normal, Checkbox::new(&mut options.arrows.peaks, "Peaks")).on_hover_text(
                "A hollow arrow where a ball has struck: its largest normal force, N, and how long ago that was in \
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
            .on_hover_text("The scale follows the largest force; off, it stays")
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
            .on_hover_text("A ring of light about a joint when its ball has struck, brighter for a harder blow");
        ui.checkbox(&mut options.joint_names, "Joint names").on_hover_text("Names beside the ball joints");
        ui.horizontal(|ui| {
            ui.checkbox(&mut options.sockets, "Sockets")
                .on_hover_text("The cut-open sockets; without them the balls stand free");
            ui.checkbox(&mut options.hinges, "Hinges and slides")
                .on_hover_text("Pins and rails where the scene draws none of its own");
        });
        ui.checkbox(&mut options.floor, "Floor grid").on_hover_text("The floor with its grid and the shadows on it");
        ui.checkbox(&mut options.triad, "Axes and gravity")
            .on_hover_text("World axes X, Y, Z and the direction of gravity g");
        ui.checkbox(&mut options.trail, "Trail of the tip").on_hover_text("Where the probe tip has been");
        ui.add_space(4.0);
        ui.label("Wear map").on_hover_text(
            "Colours the inner faces of the sockets by what they took since the reset, in cells of equal area; the balls are then \
             seen through. The scale is logarithmic and follows the largest value.",
        );
        ui.horizontal(|ui| {
            for (map, name, help) in [
                (WearMap::Off, "Off", "Sockets as they are"),
                (WearMap::Impulse, "Impulse", "How often and how hard: time integral of the normal force, N s/mm²"),
                (WearMap::FrictionWork, "Friction work", "Size of the work that friction took, mJ/mm²"),
            ] {
                ui.radio_value(&mut options.wear, map, name)
                    .on_hover_text(help)
                    .accessible_name(format!("Wear map: {name}"));
            }
        });
        let mut follows = self.pace.is_some();
        let quality = ui
            .checkbox(&mut follows, "Reduce detail to keep up")
            .on_hover_text(
                "While the picture moves and its frames take longer than 1/24 s: without the shade between balls and sockets, \
                 then with one sample per pixel instead of four, with coarser and hard shadows, and at last with fewer pixels, \
                 down to half of them along each edge. With time to spare it has more again. At rest, in saved pictures and \
                 films it has all of it.",
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

    fn extend_trail(&mut self, player: &Player) {
        let output = &player.running().machine.output;
        let (Some(probe), Some(body)) = (output.probe, player.frame().bodies.get(output.body)) else {
            return;
        };
        if self.trail.len() == TRAIL {
            // Half at once: shifting the whole trail for every point would be too costly.
            self.trail.drain(..TRAIL / 2);
        }
        self.trail.push(to_f32(&(body.position + body.rotation * probe)));
    }
}

/// Shows `next` in place of `list`, as another picture.
fn show_next(list: &mut Arc<DrawList>, next: &mut DrawList, revision: &mut u64) {
    static PICTURES: AtomicU64 = AtomicU64::new(0);
    *revision = PICTURES.fetch_add(1, Ordering::Relaxed);
    // egui has dropped the clone of the previous frame: nothing is copied.
    std::mem::swap(Arc::make_mut(list), next);
}

/// Where the picture is in the window.
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

    /// Width over height.
    fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1] as f32
    }

    /// The same with the pixels that `quality` draws.
    fn drawn_with(&self, quality: Quality) -> Self {
        Self::new(self.rect, self.scale * quality.sharpness)
    }

    /// Pixel of the picture at `pos`, points of the window.
    fn pixel(&self, pos: Pos2) -> Vec2 {
        let pixel = (pos - self.rect.min) * self.scale;
        Vec2::new(pixel.x, pixel.y)
    }
}

fn name_of(player: &Player, picked: Picked) -> Option<&str> {
    let scene = player.running();
    match picked {
        Picked::Body(index) => scene.machine.bodies.get(index).map(|body| body.name.as_str()),
        Picked::Joint(index) => scene.machine.ball_joints.get(index).map(|joint| joint.name.as_str()),
        Picked::Fixed(_) => None,
    }
}

/// What is known about the part under the cursor.
fn describe(ui: &mut Ui, player: &Player, picked: Picked) {
    // A tooltip is as wide as its longest line, not as the first.
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
        Picked::Body(index) => {
            if let (Some(body), Some(motion)) = (player.running().machine.bodies.get(index), frame.bodies.get(index)) {
                row(ui, "Mass", body.mass, "kg");
                row(ui, "Speed", motion.velocity.norm(), "m/s");
                row(ui, "Angular speed", motion.angular_velocity.norm(), "rad/s");
                row(ui, "Acceleration", motion.acceleration.norm(), "m/s^2");
            }
        }
        Picked::Joint(index) => {
            if let Some(joint) = frame.joints.get(index) {
                ui.label(value::contact(joint.state));
                row(ui, "Normal force", joint.normal_force.norm(), "N");
                row(ui, "Friction force", joint.friction_force.norm(), "N");
                if joint.state != ContactState::Ideal {
                    row(ui, "Eccentricity", joint.eccentricity.norm(), "mm");
                    row(ui, "Clearance", joint.clearance, "mm");
                    row(ui, "Indentation", joint.penetration.max(0.0), "um");
                }
            }
        }
        Picked::Fixed(_) => {}
    }
    ui.label(RichText::new("Double-click to follow").small().weak());
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::app::theme;
    use crate::scene::Scene;
    use crate::view::{Cover, LabelKind};

    /// A scene that is seen in pictures of several sizes at once.
    struct Watched<const N: usize> {
        player: Player,
        viewports: [Viewport; N],
        ctx: egui::Context,
    }

    /// Plates of a picture: of the time, of the legend, of labels.
    #[derive(Default)]
    struct Seen {
        time: Option<Rect>,
        legend: Option<Rect>,
        labels: Vec<Rect>,
        list: Arc<DrawList>,
    }

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

        /// Picture `at`, of `size`, points.
        fn draw(&mut self, at: usize, size: egui::Vec2) -> Seen {
            let Self { player, viewports, ctx } = self;
            let viewport = &mut viewports[at];
            let input = egui::RawInput {
                screen_rect: Some(Rect::from_min_size(Pos2::ZERO, size)),
                ..egui::RawInput::default()
            };
            let mut output = ctx.run_ui(input, |ui| viewport.ui(ui, player, false, &[]));
            output.textures_delta.clear();
            let mut seen = Seen { list: viewport.list.clone(), ..Seen::default() };
            for shape in output.shapes {
                let egui::Shape::Rect(plate) = shape.shape else {
                    continue;
                };
                let (place, middle) = (plate.rect, plate.rect.center());
                match plate.corner_radius.nw {
                    6 if middle.x < size.x / 2.0 => seen.time = Some(place),
                    6 => seen.legend = Some(place),
                    4 => seen.labels.push(place),
                    _ => {}
                }
            }
            seen
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

    /// The scene whose ten seconds take longest.
    const LONGEST: &str = "hexapod";

    #[test]
    fn what_is_written_over_a_machine_hides_none_of_it_and_stays_where_it_is() {
        crate::scene::BUILT_IN.into_iter().filter(|scene| *scene != LONGEST).for_each(watch);
    }

    #[test]
    #[ignore = "full: half a minute"]
    fn full_what_is_written_over_the_longest_hides_none_of_it_and_stays_where_it_is() {
        watch(LONGEST);
    }

    /// Watches a scene for ten seconds.
    fn watch(scene: &str) {
        const FRAMES: usize = 20;
        // Of a plate, beyond what the cells of the cover are too coarse for; names are placed by coarser ones.
        const HIDDEN: [f32; 2] = [0.005, 0.08];
        let mut watched = Watched::<{ PICTURES.len() }>::new(scene);
        let mut stood: [HashMap<LabelKind, _>; PICTURES.len()] = Default::default();
        let mut moves = [0; PICTURES.len()];
        for frame in 0..FRAMES {
            for (at, size) in PICTURES.into_iter().enumerate() {
                let seen = watched.draw(at, size);
                let what = format!("{scene}, {size}, frame {frame}");
                let [time, legend] = [seen.time, seen.legend].map(|plate| plate.expect("written"));
                let all: Vec<Rect> = seen.labels.iter().copied().chain([time, legend]).collect();
                for (i, plate) in all.iter().enumerate() {
                    assert!(!all[i + 1..].iter().any(|other| other.intersects(*plate)), "{what}");
                }
                let mut now = watched.viewports[at].places.0.clone();
                now.retain(|kind, _| matches!(kind, LabelKind::Joint(_)));
                let before = std::mem::replace(&mut stood[at], now);
                let moved = |(kind, place)| before.get(kind).is_some_and(|was| was != place);
                moves[at] += stood[at].iter().filter(|label| moved(*label)).count();
                if frame % 2 > 0 {
                    continue;
                }
                let cover = Cover::of(&seen.list, 2.0);
                let under = |plate: Rect| {
                    let [min, max] = [plate.min, plate.max].map(|corner| Vec2::new(corner.x, corner.y));
                    cover.under(min, max)
                };
                for plate in [time, legend] {
                    let hidden: f32 = under(plate).iter().sum();
                    assert!(hidden < HIDDEN[0], "{what}: {hidden} of {plate}");
                }
                for plate in &seen.labels {
                    let [_, balls] = under(*plate);
                    assert!(balls < HIDDEN[1], "{what}: balls under {balls} of {plate}");
                }
            }
            watched.pass(10.0 / FRAMES as f32);
        }
        for (at, size) in PICTURES.into_iter().enumerate() {
            // On average none more than once in two seconds, whatever passes behind it.
            let (moves, names) = (moves[at], stood[at].len());
            assert!(names > 0 && moves <= 5 * names, "{scene}, {size}: {moves} of {names}");
        }
    }

    #[test]
    fn another_shape_is_fitted_anew_until_the_camera_is_moved_and_then_shows_as_much_across() {
        let (wide, narrow) = (vec2(980.0, 432.0), vec2(420.0, 432.0));
        let settled = |watched: &mut Watched<1>, size| {
            watched.draw(0, size);
            watched.viewports[0].goal.unwrap_or(watched.viewports[0].camera)
        };
        let mut fresh = Watched::<1>::new("spcmm");
        let expected = settled(&mut fresh, narrow);
        let mut watched = Watched::<1>::new("spcmm");
        let first = settled(&mut watched, wide);
        // A little at a time, as a panel that opens.
        for width in [940.0, 890.0, 700.0, 600.0] {
            settled(&mut watched, vec2(width, 432.0));
        }
        assert_eq!(settled(&mut watched, narrow), expected);
        assert_eq!(settled(&mut watched, wide), first);
        // A point of view that was chosen fits, too.
        for watched in [&mut watched, &mut fresh] {
            watched.viewports[0].preset(Preset::Front);
        }
        let expected = settled(&mut fresh, narrow);
        settled(&mut watched, wide);
        assert_eq!(settled(&mut watched, narrow), expected);

        settled(&mut watched, wide);
        while watched.viewports[0].advance(&watched.player, 0.1) {}
        watched.viewports[0].by_hand([980, 432], |camera| camera.orbit(Vec2::new(40.0, 10.0)));
        let placed = watched.viewports[0].camera;
        let across = |viewport: &Viewport, size: [u32; 2]| {
            let camera = viewport.framed(size[0] as f32 / size[1] as f32);
            size.map(|edge| edge as f32 * camera.metres_per_pixel(size))
        };
        let before = across(&watched.viewports[0], [980, 432]);
        for size in [[420, 432], [980, 300], [300, 900], [980, 432]] {
            let _ = settled(&mut watched, vec2(size[0] as f32, size[1] as f32));
            assert_eq!(watched.viewports[0].camera, placed);
            let after = across(&watched.viewports[0], size);
            assert!(after[0] >= 0.999 * before[0] && after[1] >= 0.999 * before[1], "{size:?}: {before:?} {after:?}");
        }
        // A hand on the camera makes nothing jump.
        let before = across(&watched.viewports[0], [300, 900]);
        watched.viewports[0].by_hand([300, 900], |camera| camera.pan(Vec2::ZERO, [300, 900]));
        assert_eq!(across(&watched.viewports[0], [300, 900]), before);
    }

    #[test]
    fn the_first_picture_does_not_move_into_place() {
        let scene = Scene::load("spcmm", &[]).expect("built in");
        let player = Player::new(&scene).expect("starts");
        let mut viewport = Viewport::new(&player, ViewOptions::default());
        let draw = |viewport: &mut Viewport| {
            let ctx = egui::Context::default();
            theme::apply(&ctx, false);
            let mut output = ctx.run_ui(egui::RawInput::default(), |ui| viewport.ui(ui, &player, true, &[]));
            // No texture is made of it.
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
