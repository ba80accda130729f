//! Builds the draw list from a scene and a frame.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use parry3d::query::Ray;

use super::arrows::{ARROW_LENGTH, push_arrow, push_forces};
use super::attachments::{Style, push_bushing, push_motor, push_stop};
use super::cast::cast;
use super::coil::push_coil;
use super::cover::{Cover, CoverKind};
use super::drawn::{self, DrawnShape, max_outer_radii};
use super::ground::push_ground;
use super::instances::{self, bar, push_label};
use super::joint::{self, DrawnJoint, Fittings, push_sockets};
use super::relative::RelativeShot;
use super::solids::push_solid;
use super::symbols::{Symbol, symbols};
use super::theme::Material;
use super::{
    Background, Bounds, Camera, DrawList, Floor, Instance, LabelKind, Layer, Light, Line, Mesh, MeshData, Palette,
    Shot, Swept, ViewOptions, to_f32,
};
use crate::machine::{Element, ElementKind, LooseJoint, Role};
use crate::scene::{Scene, SignedAxis};
use crate::simulate::{ElementReport, Frame};

/// Precomputed view data of a scene: built once per scene, and again when its bodies or shapes change.
pub struct SceneView {
    pub(super) parts: Vec<DrawnShape>,
    symbols: Vec<Symbol>,
    plates: Arc<[MeshData]>,
    /// Name of each joint with play, and those of its places.
    joint_names: Vec<(Arc<str>, Vec<Arc<str>>)>,
    axis_names: [Arc<str>; 4],
    bounds: Bounds,
    down: SignedAxis,
    isometric: Option<(f64, f64)>,
    /// Coordinate of the floor along `down`, m.
    floor: f32,
    /// Largest outer radius of each drawn socket, m, limited by the part that carries it.
    pub(super) max_outer_radii: Vec<f32>,
    /// Points of the moving parts at the start, m, for the occlusion test of fixed parts.
    occlusion_points: Vec<Vec3>,
    /// Joints with play at the start.
    initial_joints: Vec<DrawnJoint>,
    fittings: Fittings,
}

/// Smallest picture edge that leaves room for the triad, points.
const MIN_SIZE_WITH_TRIAD: f32 = 200.0;
/// Smallest width that leaves room for the gravity arrow between axes and legend, points.
const MIN_SIZE_WITH_GRAVITY: f32 = 300.0;
/// Radius of the halo of a joint that was hit, in radii of its socket; and largest width of its ring, points.
const HALO: f32 = 1.7;
const WIDEST_HALO: f32 = 22.0;
/// Most points of moving parts tested for occlusion: every frame casts a ray to each.
const MAX_OCCLUSION_POINTS: usize = 600;
/// Width of an arrow's outline, points.
const OUTLINE: f32 = 1.1;
/// Radius of a drawn spring, in radii of the scene.
const COIL: f32 = 0.025;
/// Radius of the ring that marks the ground under a tyre, in radii of the scene.
const GROUND: f32 = 0.12;

impl SceneView {
    /// Prepares the meshes and bounds of `scene`; `frame` is any frame of it, preferably the first.
    pub fn new(scene: &Scene, frame: &Frame) -> Self {
        let (parts, mut plates) = drawn::parts(scene);
        let joints = joint::joints(scene, frame, 1.0);
        let down = to_f32(&scene.view.down.unit());
        let bounds_without_symbols = bounds(&extents(&parts, &[], frame, &joints));
        let symbols = symbols(scene, &parts, frame, &joints, bounds_without_symbols.radius);
        let extents = extents(&parts, &symbols, frame, &joints);
        let bounds = bounds(&extents);
        let lowest = extents.iter().map(|(p, r)| p.dot(down) + r).fold(f32::NEG_INFINITY, f32::max);
        let floor = match scene.view.floor {
            Some(floor) => floor as f32,
            // Leave room for motion.
            None if lowest.is_finite() => lowest + 0.15 * bounds.radius,
            None => bounds.radius,
        };
        let max_outer_radii = max_outer_radii(scene, &parts, frame, &joints);
        let fittings = Fittings::new(scene, frame, bounds.centre, &mut plates);
        let moving = parts.iter().filter(|part| part.body.is_some());
        let mut occlusion_points = Vec::new();
        for part in moving {
            let mut ends = Vec::new();
            part.place(frame, &joints).extent(|point, _| ends.push(point));
            let middle = ends.iter().sum::<Vec3>() / ends.len().max(1) as f32;
            occlusion_points.push(middle);
            // A bar is long: include its ends.
            occlusion_points.extend(ends.into_iter().take(2).filter(|_| part.is_bar()));
        }
        occlusion_points.retain(|point| point.is_finite());
        let stride = occlusion_points.len().div_ceil(MAX_OCCLUSION_POINTS).max(1);
        let occlusion_points = occlusion_points.into_iter().step_by(stride).collect();
        Self {
            max_outer_radii,
            occlusion_points,
            symbols,
            initial_joints: joints,
            fittings,
            parts,
            plates: plates.into(),
            joint_names: scene.machine.loose_joints.iter().map(names).collect(),
            axis_names: ["X", "Y", "Z", "g"].map(Arc::from),
            bounds,
            down: scene.view.down,
            isometric: scene.view.isometric,
            floor,
        }
    }

    /// Bounding sphere of everything drawn in the frame given to [`Self::new`].
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Isometric camera that shows the whole scene.
    pub fn camera(&self) -> Camera {
        let camera = Camera::new(self.down, self.bounds);
        match self.isometric {
            Some((yaw, pitch)) => camera.with_isometric(yaw as f32, pitch as f32),
            None => camera,
        }
    }

    /// Moves `camera` so that everything drawn in `frame` fills a picture of `size`; the direction is kept.
    pub fn fit(&self, camera: &mut Camera, scene: &Scene, frame: &Frame, options: &ViewOptions, size: [u32; 2]) {
        self.fit_around(camera, scene, frame, options, size, &[], &Swept::default());
    }

    /// Adds everything drawn in `frame` to `motion`.
    pub fn add_motion(&self, motion: &mut Swept, scene: &Scene, frame: &Frame, options: &ViewOptions) {
        motion.add(self.solids(scene, frame, options).into_iter().flatten());
    }

    /// As [`Self::fit`], with room for `motion`, and with the machine clear of `plates` (minimum and maximum corner, pixels), which
    /// overlay the picture. Selects the view with the largest machine, or the one with the least area under plates.
    #[expect(clippy::too_many_arguments, reason = "one call for a whole picture")]
    pub fn fit_around(
        &self,
        camera: &mut Camera,
        scene: &Scene,
        frame: &Frame,
        options: &ViewOptions,
        size: [u32; 2],
        plates: &[[Vec2; 2]],
        motion: &Swept,
    ) {
        // Fractions of the width of the plates at a side that are kept clear.
        const SHARES: [f32; 4] = [0.0, 0.35, 0.7, 1.0];
        // Cells along the shorter edge, and gap between machine and plates, in cells.
        const CELLS: f32 = 80.0;
        const GAP: f32 = 1.5;
        // Most solids compared with the plates; beyond that some are skipped.
        const MAX_SOLIDS: usize = 300;
        let solids = self.solids(scene, frame, options);
        let mut balls: Vec<(Vec3, f32)> = solids.iter().flatten().copied().collect();
        // Half a reference length of arrows around each joint: they point anywhere, and most are shorter. Included even if
        // not drawn, so that pictures with and without them can be compared.
        let arrow = ARROW_LENGTH * self.bounds.radius;
        let centres = (0..frame.joints.len()).filter_map(|i| joint::anchor(scene, frame, i));
        balls.extend(centres.map(|centre| (centre, arrow)));
        balls.extend(motion.spheres());
        balls.retain(|(centre, radius)| centre.is_finite() && radius.is_finite());
        let whole = Vec2::new(size[0] as f32, size[1] as f32);
        let mut reserved = [0.0_f32; 4];
        for [low, high] in plates {
            let middle = (*low + *high) / 2.0;
            let (x, y) = if middle.x < whole.x / 2.0 { (0, high.x) } else { (1, whole.x - low.x) };
            reserved[x] = reserved[x].max(y);
            let (x, y) = if middle.y < whole.y / 2.0 { (2, high.y) } else { (3, whole.y - low.y) };
            reserved[x] = reserved[x].max(y);
        }
        let shares = |room: f32| SHARES.into_iter().map(move |share| share * room).take(if room > 0.0 { 4 } else { 1 });
        let mut candidates: Vec<([f32; 4], Camera)> = Vec::new();
        for left in shares(reserved[0]) {
            for right in shares(reserved[1]) {
                for top in shares(reserved[2]) {
                    for bottom in shares(reserved[3]) {
                        let (mut candidate, free) = (*camera, [left, right, top, bottom]);
                        candidate.fit_balls(&balls, size, free);
                        candidates.push((free, candidate));
                    }
                }
            }
        }
        let room = |free: &[f32; 4]| free.iter().sum::<f32>();
        candidates
            .sort_by(|(a, near), (b, far)| near.distance.total_cmp(&far.distance).then(room(a).total_cmp(&room(b))));
        let cell = whole.min_element() / CELLS;
        let step = solids.len().div_ceil(MAX_SOLIDS).max(1);
        let mut least = f32::INFINITY;
        let mut best = *camera;
        for (_, candidate) in candidates {
            let mut cover = Cover::new(size, cell);
            let eye = candidate.view(size);
            for solid in solids.iter().step_by(step).filter(|_| !plates.is_empty()) {
                cover.add(&eye, size, solid.iter().copied(), CoverKind::Body);
            }
            let gap = Vec2::splat(GAP * cell);
            let covered = |[low, high]: &[Vec2; 2]| cover.covered_fractions(*low - gap, *high + gap)[0];
            let covered: f32 = plates.iter().map(covered).sum();
            if covered < least {
                (least, best) = (covered, candidate);
            }
            if covered == 0.0 {
                break;
            }
        }
        *camera = best;
    }

    /// Magnification as drawn; at most the one requested in `options`.
    pub(super) fn magnification(&self, scene: &Scene, frame: &Frame, options: &ViewOptions) -> f32 {
        joint::magnification(scene, frame, &self.max_outer_radii, options.magnification)
    }

    /// Opacity of part `index` from `eye`: a fixed part that hides much of the moving parts becomes translucent. It is
    /// based on the first frame, so that it changes only with the viewpoint.
    pub(super) fn opacity(&self, index: usize, eye: Vec3) -> f32 {
        const HIDDEN_RANGE: [f32; 2] = [0.05, 0.16];
        const MIN_OPACITY: f32 = 0.22;
        if self.parts[index].body.is_some() || self.occlusion_points.is_empty() {
            return 1.0;
        }
        let solid = self.parts[index].place(&Frame::default(), &self.initial_joints);
        let hidden = |point: &&Vec3| {
            let to_point = **point - eye;
            let ray = Ray::new(eye, to_point.normalize_or_zero());
            cast(&solid, &ray).is_some_and(|distance| distance < to_point.length())
        };
        let share = self.occlusion_points.iter().filter(hidden).count() as f32 / self.occlusion_points.len() as f32;
        let t = ((share - HIDDEN_RANGE[0]) / (HIDDEN_RANGE[1] - HIDDEN_RANGE[0])).clamp(0.0, 1.0);
        1.0 - (1.0 - MIN_OPACITY) * t * t * (3.0 - 2.0 * t)
    }

    /// For each drawn solid, spheres (centre, radius) whose convex hull contains it.
    fn solids(&self, scene: &Scene, frame: &Frame, options: &ViewOptions) -> Vec<Vec<(Vec3, f32)>> {
        let joints = joint::joints(scene, frame, self.magnification(scene, frame, options));
        let palette = Palette::of(options.theme);
        let mut solids = solids(&self.parts, &self.symbols, frame, &joints);
        for (element, report) in scene.machine.elements.iter().zip(&frame.elements) {
            let (mut layer, mut lines) = (Layer::default(), Vec::new());
            layer.clear(Mesh::SHARED);
            self.push_element((element, report), (scene, frame), &palette, 1.0, &mut layer, &mut lines);
            solids.extend(layer.by_mesh[Mesh::Cylinder.index()].iter().map(|bar| {
                let [x, y, z] = bar.world_from_mesh;
                let column = |k: usize| Vec3::new(x[k], y[k], z[k]);
                let radius = column(0).length();
                vec![(column(3), radius), (column(3) + column(2), radius)]
            }));
            solids.push(lines.iter().flat_map(|line| [(line.from.into(), 0.0), (line.to.into(), 0.0)]).collect());
        }
        solids
    }

    /// Centre of the ball, pin or block of joint `joint` as drawn, m.
    pub fn ball(&self, scene: &Scene, frame: &Frame, options: &ViewOptions, joint: usize) -> Option<Vec3> {
        let m = self.magnification(scene, frame, options);
        joint::joints(scene, frame, m).get(joint).map(|drawn| drawn.ball_centre)
    }

    /// Turns `camera` to a close-up of joint `joint`, looking into its opening.
    pub fn close_up(&self, camera: &mut Camera, joint: usize, scene: &Scene, frame: &Frame, options: &ViewOptions) {
        let m = self.magnification(scene, frame, options);
        if let Some(drawn) = joint::joints(scene, frame, m).get(joint) {
            camera.close_up(drawn.socket_centre, drawn.opening, 2.2 * drawn.reach);
        }
    }

    /// Rebuilds `out`, reusing its buffers.
    pub fn build(&self, shot: &Shot<'_>, out: &mut DrawList) {
        let relative = RelativeShot::of(shot);
        let shot = &relative.as_ref().map_or(*shot, |relative| relative.shot(shot));
        let Shot { scene, frame, options, camera, .. } = *shot;
        let palette = Palette::of(options.theme);
        self.begin(shot, &palette, out);

        let m = self.magnification(scene, frame, options);
        out.magnification = m;
        out.magnification_text = magnification_text(m, options.magnification);
        let joints = joint::joints(scene, frame, m);
        let eye = camera.eye();
        for (i, part) in self.parts.iter().enumerate() {
            let opacity = self.opacity(i, eye + to_f32(&frame.origin));
            let layer = if opacity < 1.0 { &mut out.faded } else { &mut out.solid };
            let material = part.material(&palette).with_opacity(opacity);
            push_solid(layer, &part.place(frame, &joints), material);
        }
        for symbol in self.symbols.iter().filter(|_| options.hinges) {
            let [from, to] = symbol.ends(frame);
            let material = palette.material(symbol.role);
            out.solid.push(Mesh::Cylinder, bar(from, to - from, symbol.radius, material));
        }
        for (i, joint) in joints.iter().enumerate() {
            joint.push(i, frame, &self.fittings, (options, &palette), out);
            let flash = shot.marks.flash(i);
            if options.flash && flash > 0.02 {
                let light = Material { colour: palette.flash.with_opacity(flash), ..palette.ball };
                // In a close-up, a wider ring would hide the surroundings of the joint.
                let pixel = (joint.socket_centre - eye).dot(-camera.axes().2) * camera.metres_per_pixel(shot.size)
                    / camera.distance;
                let ring = ((HALO - 1.0) * joint.reach).min(WIDEST_HALO * shot.pixels_per_point * pixel.max(0.0));
                let halo = instances::ball(joint.socket_centre, joint.reach + ring, light);
                out.halos.push(Instance { metal: joint.reach / (joint.reach + ring), ..halo });
            }
        }
        if options.sockets {
            push_sockets(frame, &joints, eye, palette.socket, &mut out.sockets);
        }

        for element in scene.machine.elements.iter().zip(&frame.elements) {
            let points = shot.pixels_per_point;
            self.push_element(element, (scene, frame), &palette, points, &mut out.solid, &mut out.lines);
        }
        push_forces(shot, &joints, &palette, out);
        if options.trail {
            push_trail(shot, &palette, &mut out.lines);
        }
        if options.triad {
            self.push_triad(shot, &palette, out);
        }
        if options.joint_names {
            let up = camera.axes().1;
            for (i, (joint, (name, places))) in joints.iter().zip(&self.joint_names).enumerate() {
                // Of several places, the one with the largest force.
                let (mut name, mut largest) = (name, 0.0);
                joint.contacts(&frame.joints[i], frame.sites_of(i), |contact| {
                    let place = contact.place.and_then(|place| places.get(place));
                    if let Some(place) = place.filter(|_| contact.normal.length() > largest) {
                        (name, largest) = (place, contact.normal.length());
                    }
                });
                let anchor = joint.socket_centre + up * (1.15 * joint.beside());
                push_label(out, name, LabelKind::Joint(i), anchor, palette.text);
            }
        }
    }

    /// Adds the symbol of a force element.
    fn push_element(
        &self,
        (element, report): (&Element, &ElementReport),
        (scene, frame): (&Scene, &Frame),
        palette: &Palette,
        pixels_per_point: f32,
        solid: &mut Layer,
        lines: &mut Vec<Line>,
    ) {
        let [from, to] = report.points.map(|point| to_f32(&point));
        let width = 2.2 * pixels_per_point;
        let material = palette.material(Role::Pin);
        let colour = material.colour;
        let style = Style {
            radius: self.bounds.radius,
            width,
            material,
            outer: palette.material(Role::Slider),
            colour: palette.text,
        };
        match &element.kind {
            ElementKind::Spring(_) | ElementKind::JointSpring(_) => {
                let radius = COIL * self.bounds.radius;
                push_coil(from, to, radius, width, colour, lines);
            }
            ElementKind::Tyre(tyre) => {
                let up = to_f32(&tyre.up);
                let radius = GROUND * self.bounds.radius;
                push_ground(from, up, radius, width, colour, lines);
            }
            ElementKind::Bushing(bushing) => {
                push_bushing(bushing, report, frame, &style, solid);
            }
            ElementKind::Stop(stop) => push_stop(stop, report, (scene, frame), &style, solid),
            ElementKind::Motor(motor) => {
                push_motor(motor, report, (scene, frame), &style, solid, lines);
            }
            ElementKind::Load(_) | ElementKind::Lubricant(_) => {}
        }
    }

    fn begin(&self, shot: &Shot<'_>, palette: &Palette, out: &mut DrawList) {
        let meshes = Mesh::SHARED + self.plates.len();
        for layer in [
            &mut out.solid,
            &mut out.faded,
            &mut out.ghost,
            &mut out.ghost_edges,
            &mut out.arrows,
            &mut out.wear,
            &mut out.overlay,
        ] {
            layer.clear(meshes);
        }
        out.halos.clear();
        out.sockets.clear();
        out.clear_balls.clear();
        out.lines.clear();
        out.marks.clear();
        out.labels.clear();
        (out.legend, out.wear_scale, out.error_scale) = (None, None, None);
        out.size = shot.size;
        out.eye = shot.camera.view(shot.size);
        out.background = Background { top: palette.sky, bottom: palette.ground };
        out.exposure = palette.exposure;
        out.quality = shot.options.quality;
        (out.outline, out.rim) = (palette.outline, palette.rim);
        out.outline_width = OUTLINE * shot.pixels_per_point * shot.options.arrows.thickness;
        if !Arc::ptr_eq(&out.plates, &self.plates) {
            out.plates = self.plates.clone();
        }

        let Bounds { centre, radius } = self.bounds;
        let (up, right) = (shot.camera.up(), shot.camera.front_right());
        let back = right.cross(up);
        // From above, the left and the front: fixed to the scene, so that shadows do not move with the camera.
        let key = (up - 0.45 * right + 0.55 * back).normalize();
        let across = 2.0 * key.dot(up) * up - key;
        out.light = Light {
            direction: key,
            // From the opposite side, low.
            strip: (across - 0.5 * up).normalize(),
            up,
            radius,
            studio: palette.studio,
            behind: palette.behind,
        };
        out.floor = shot.options.floor.then(|| {
            let spacing = 10_f32.powf(radius.log10().floor() - 1.0);
            let snap = |x: f32| (x / (10.0 * spacing)).round() * 10.0 * spacing;
            Floor {
                centre: right * snap(centre.dot(right)) + back * snap(centre.dot(back))
                    - up * self.floor
                    - to_f32(&shot.frame.origin),
                along: right,
                spacing,
                radius: 4.5 * radius,
                colour: palette.floor,
                lines: palette.grid,
            }
        });
    }

    /// Axes and gravity in the lower left corner, at constant size on the screen.
    fn push_triad(&self, shot: &Shot<'_>, palette: &Palette, out: &mut DrawList) {
        let camera = shot.camera;
        let points = shot.size.map(|n| n as f32 / shot.pixels_per_point);
        // In a small picture it would cover the machine.
        if points[0].min(points[1]) < MIN_SIZE_WITH_TRIAD {
            return;
        }
        let scale = shot.pixels_per_point * camera.metres_per_pixel(shot.size);
        let (right, up, _) = camera.axes();
        let corner = {
            let [width, height] = shot.size.map(|n| n as f32 * camera.metres_per_pixel(shot.size) / 2.0);
            camera.target - right * (width - 62.0 * scale) - up * (height - 62.0 * scale)
        };
        // Perspective would distort the triad there: it is sheared to look as in the centre.
        let back = camera.axes().2;
        let lean = (corner - camera.target) / camera.distance;
        let sheared = |point: Vec3| point - lean * (point - corner).dot(back);
        for (i, axis) in Vec3::AXES.into_iter().enumerate() {
            let colour = palette.axes[i];
            push_arrow(&mut out.overlay, corner, axis * (38.0 * scale), 1.9 * scale, colour);
            push_label(out, &self.axis_names[i], LabelKind::Axis, sheared(corner + axis * (47.0 * scale)), colour);
        }
        let gravity = to_f32(&shot.scene.machine.gravity).try_normalize();
        if let Some(gravity) = gravity.filter(|_| points[0] >= MIN_SIZE_WITH_GRAVITY) {
            let length = gravity * (34.0 * scale);
            let start = corner + right * (74.0 * scale) - length * 0.5;
            push_arrow(&mut out.overlay, start, length, 1.9 * scale, palette.gravity);
            let anchor = start + length * 0.5 + right * (13.0 * scale);
            push_label(out, &self.axis_names[3], LabelKind::Gravity, sheared(anchor), palette.gravity);
        }
        for instance in out.overlay.by_mesh.iter_mut().flatten() {
            let rows = instance.world_from_mesh.map(Vec4::from);
            // Depth relative to the corner, of the mesh's axes and origin.
            let depth = rows[0] * back.x + rows[1] * back.y + rows[2] * back.z - Vec4::W * corner.dot(back);
            instance.world_from_mesh = [0, 1, 2].map(|i| (rows[i] - lean[i] * depth).to_array());
        }
    }
}

/// Name of a joint, and those of the places where it can touch if it has several.
fn names(joint: &LooseJoint) -> (Arc<str>, Vec<Arc<str>>) {
    let places = 0..joint.kind.site_names().len() as u8;
    (joint.name.as_str().into(), places.map(|place| joint.site_name(place).into()).collect())
}

/// Spheres (centre, radius) whose convex hull contains everything drawn.
fn extents(parts: &[DrawnShape], symbols: &[Symbol], frame: &Frame, joints: &[DrawnJoint]) -> Vec<(Vec3, f32)> {
    solids(parts, symbols, frame, joints).into_iter().flatten().collect()
}

/// As [`extents`], separately for each solid.
fn solids(parts: &[DrawnShape], symbols: &[Symbol], frame: &Frame, joints: &[DrawnJoint]) -> Vec<Vec<(Vec3, f32)>> {
    let pins = symbols.iter().map(|symbol| symbol.ends(frame).map(|end| (end, symbol.radius)).to_vec());
    let shapes = parts.iter().map(|part| {
        let mut spheres = Vec::new();
        part.place(frame, joints).extent(|centre, radius| spheres.push((centre, radius)));
        spheres
    });
    let sockets = joints.iter().map(|joint| {
        let mut spheres = Vec::new();
        joint.extent(|centre, radius| spheres.push((centre, radius)));
        spheres
    });
    let springs = frame.elements.iter().map(|element| element.points);
    let springs = springs.filter(|[from, to]| from != to);
    let springs = springs.map(|ends| ends.map(|end| (to_f32(&end), 0.0)).to_vec());
    let mut solids: Vec<_> = pins.chain(shapes).chain(sockets).chain(springs).collect();
    for spheres in &mut solids {
        spheres.retain(|(centre, radius)| centre.is_finite() && radius.is_finite());
    }
    solids
}

fn bounds(extents: &[(Vec3, f32)]) -> Bounds {
    let low = extents.iter().map(|&(p, r)| p - r).reduce(Vec3::min);
    let high = extents.iter().map(|&(p, r)| p + r).reduce(Vec3::max);
    let (Some(low), Some(high)) = (low, high) else {
        return Bounds { centre: Vec3::ZERO, radius: 0.1 };
    };
    let centre = (low + high) / 2.0;
    let radius = extents.iter().map(|&(p, r)| p.distance(centre) + r).fold(0.0, f32::max);
    Bounds { centre, radius: radius.max(1e-4) }
}

/// A magnification as text, without the multiplication sign.
pub(super) fn format_factor(x: f32) -> String {
    if (x - x.round()).abs() < 0.05 { format!("{x:.0}") } else { format!("{x:.1}") }
}

fn magnification_text(drawn: f32, requested: f32) -> String {
    if drawn < requested * 0.999 {
        format!("clearance drawn ×{} (×{} does not fit)", format_factor(drawn), format_factor(requested))
    } else {
        format!("clearance drawn ×{}", format_factor(drawn))
    }
}

/// Adds the trail; older parts are fainter.
fn push_trail(shot: &Shot<'_>, palette: &Palette, lines: &mut Vec<Line>) {
    let last = shot.trail.len().saturating_sub(1) as f32;
    let colour = |i: usize| palette.trail.with_opacity(0.9 * (i as f32 / last).sqrt());
    let width = 2.2 * shot.pixels_per_point;
    for (i, ends) in shot.trail.windows(2).enumerate() {
        let colours = [colour(i), colour(i + 1)];
        lines.push(Line::new(ends[0], ends[1], width, colours));
    }
}
