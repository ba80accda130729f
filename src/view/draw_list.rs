//! The plain list that `render` draws: no handles, no GPU types; equal lists give equal pictures.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec2, Vec3};

use super::{Colour, Quality, WearMap};

/// A mesh shared by many instances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mesh {
    /// Unit sphere about the origin.
    Sphere,
    /// Radius 1, flat ends at z = 0 and z = 1.
    Cylinder,
    /// Base of radius 1 at z = 0, tip at z = 1.
    Cone,
    /// Cube of edge 1 about the origin.
    Cube,
    /// Half of a spherical shell of outer radius 1, open towards +z; [`Instance::inner_radius`] is its inner radius.
    Socket,
    /// `DrawList::plates[i]`: those of the cells of wear maps, then the plates of the scene.
    Plate(u16),
}

impl Mesh {
    /// Number of shared meshes, before the first plate.
    pub const SHARED: usize = 5;

    /// Whether the shared mesh of this index is a part of the unit sphere.
    pub fn is_round(index: usize) -> bool {
        index == Self::Sphere.index() || index == Self::Socket.index()
    }

    /// Index in [`Layer`]: shared meshes first, then plates.
    pub fn index(self) -> usize {
        match self {
            Self::Sphere => 0,
            Self::Cylinder => 1,
            Self::Cone => 2,
            Self::Cube => 3,
            Self::Socket => 4,
            Self::Plate(i) => Self::SHARED + usize::from(i),
        }
    }
}

/// Triangles of one mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Position (x, y, z) with a mark, then the normal. The mark is 0, except on sockets: 1 on the inner face, 2 and 3 at the
    /// outer and inner edge of the cut face.
    pub vertices: Vec<([f32; 4], [f32; 3])>,
    /// Three per triangle, counter-clockwise seen from outside.
    pub indices: Vec<u32>,
}

impl MeshData {
    /// Centre and half size of its bounding box.
    pub fn bounds(&self) -> [Vec3; 2] {
        let points = || self.vertices.iter().map(|(p, _)| Vec3::new(p[0], p[1], p[2]));
        let low = points().reduce(Vec3::min).unwrap_or_default();
        let high = points().reduce(Vec3::max).unwrap_or_default();
        [(low + high) / 2.0, (high - low) / 2.0]
    }
}

/// One placed mesh.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Instance {
    /// Rows of the affine transform from mesh to world.
    pub world_from_mesh: [[f32; 4]; 3],
    /// Red, green, blue (sRGB-encoded), opacity.
    pub colour: [f32; 4],
    /// From 0 (mirror) to 1 (chalk); for a ghost's outline its width, pixels.
    pub roughness: f32,
    /// From 0 (plastic) to 1 (metal); for a ghost its depth slice ([`super::GhostLook::slice`]), for a halo the radius of the
    /// socket that it surrounds, in radii of the halo.
    pub metal: f32,
    /// Inner radius of a socket, in units of its outer radius; unused elsewhere.
    pub inner_radius: f32,
    /// Unused.
    pub pad: f32,
    /// Facing sphere, which is the socket's inner face for a ball and the ball for a socket: vector to its centre, m, and
    /// radius, m; 0 without one.
    pub other: [f32; 4],
    /// Unit vector from the ball's centre to the contact point, and 1 while in contact.
    pub touch: [f32; 4],
}

/// Instances by mesh ([`Mesh::index`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layer {
    /// One list for each mesh.
    pub by_mesh: Vec<Vec<Instance>>,
}

impl Layer {
    pub(super) fn clear(&mut self, meshes: usize) {
        self.by_mesh.resize_with(meshes, Vec::new);
        self.by_mesh.iter_mut().for_each(Vec::clear);
    }

    pub(super) fn push(&mut self, mesh: Mesh, instance: Instance) {
        self.by_mesh[mesh.index()].push(instance);
    }

    /// Number of instances.
    pub fn len(&self) -> usize {
        self.by_mesh.iter().map(Vec::len).sum()
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.by_mesh.iter().all(Vec::is_empty)
    }
}

/// A straight line of constant width on the screen.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Line {
    /// One end, m.
    pub from: [f32; 3],
    /// Width, pixels.
    pub width: f32,
    /// Other end, m.
    pub to: [f32; 3],
    /// Unused.
    pub pad: f32,
    /// Colour at `from`.
    pub from_colour: [f32; 4],
    /// Colour at `to`.
    pub to_colour: [f32; 4],
}

impl Line {
    pub(super) fn new(from: Vec3, to: Vec3, width: f32, [start, end]: [Colour; 2]) -> Self {
        Self { from: from.to_array(), width, to: to.to_array(), pad: 0.0, from_colour: start.0, to_colour: end.0 }
    }
}

/// Viewpoint of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// World to clip space (z in 0..1, y up).
    pub clip_from_world: Mat4,
    /// Eye point, m. Far from the world's origin all points of a list are measured from the camera's target.
    pub position: Vec3,
}

/// The only light that casts shadows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector from the scene towards the light.
    pub direction: Vec3,
    /// Unit vector towards the reflected strip of the studio.
    pub strip: Vec3,
    /// Unit vector up: the direction of sky light.
    pub up: Vec3,
    /// Radius of the scene, m.
    pub radius: f32,
    /// Brightness of the key light, and of the reflected ground, sky and window.
    pub studio: [f32; 4],
    /// Brightness of the light along the edges of parts.
    pub behind: f32,
}

/// Background of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    /// At the top edge.
    pub top: Colour,
    /// At the bottom edge.
    pub bottom: Colour,
}

/// Floor with its grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// Centre of the grid, m: grid lines pass through it.
    pub centre: Vec3,
    /// Unit vector along one set of lines.
    pub along: Vec3,
    /// Distance between thin lines, m; every tenth is thick.
    pub spacing: f32,
    /// Distance from `centre` at which it has faded out, m.
    pub radius: f32,
    /// Colour of the plane.
    pub colour: Colour,
    /// Colour of the lines.
    pub lines: Colour,
}

/// The object that a label names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LabelKind {
    /// An axis of the triad.
    Axis,
    /// The gravity arrow.
    Gravity,
    /// A joint with play, by index.
    Joint(usize),
    /// The mark of a joint's peak, by index.
    Peak(usize),
    /// The arrow of an external force.
    External,
    /// The error of the output point.
    Error,
}

/// Text that the interface draws over the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// The text.
    pub text: Arc<str>,
    /// The object that it names.
    pub kind: LabelKind,
    /// Anchor point, m, in the coordinates of [`DrawList::eye`].
    pub anchor: Vec3,
    /// Pixel of the anchor, from the top left; labels outside the picture are left out.
    pub pixel: Vec2,
    /// Colour of the text.
    pub colour: Colour,
}

/// One tick of the arrow legend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Force, N.
    pub force: f32,
    /// Length of its arrow in units of the reference length.
    pub fraction: f32,
}

/// The arrow legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// What the forces act on: balls, or other parts, too.
    pub on: &'static str,
    /// Force whose arrow has the reference length, N.
    pub reference: f32,
    /// Reference length, pixels: the same for an arrow across the line of sight anywhere in the picture.
    pub pixels: f32,
    /// Length against force.
    pub scaling: super::Scaling,
    /// Whether some arrow is longer than can be drawn (a fixed reference far too small): its shaft is broken.
    pub clipped: bool,
    /// Ticks on the scale, ascending.
    pub ticks: Vec<Tick>,
    /// Colour of normal forces; `None` if they are not drawn.
    pub normal: Option<Colour>,
    /// Whether past peaks are marked.
    pub peaks: bool,
    /// Colour of friction; `None` if it is not drawn.
    pub friction: Option<Colour>,
    /// Colour of the forces of lubricants; `None` if there are none.
    pub lubricant: Option<Colour>,
}

/// The colour legend of a wear map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WearScale {
    /// Quantity shown: an impulse in N s/mm^2, or the magnitude of a work in mJ/mm^2.
    pub map: WearMap,
    /// Largest value in the picture; 0 until a ball has been in contact.
    pub largest: f32,
}

/// The colour legend of a map of the tip's errors; linear from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorScale {
    /// Name of the error quantity.
    pub name: &'static str,
    /// Largest error in the map, m.
    pub largest: f32,
}

/// Everything to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawList {
    /// Size of the picture for which `eye` and label pixels hold.
    pub size: [u32; 2],
    /// Viewpoint.
    pub eye: Eye,
    /// Light.
    pub light: Light,
    /// Background.
    pub background: Background,
    /// Factor on all light.
    pub exposure: f32,
    /// Outline of arrows.
    pub outline: Colour,
    /// Its width, pixels.
    pub outline_width: f32,
    /// Rim around a contact point.
    pub rim: Colour,
    /// Rendering quality.
    pub quality: Quality,
    /// Floor, if any.
    pub floor: Option<Floor>,
    /// The scene's own meshes; shared, so that a renderer can tell by pointer whether it has loaded them.
    pub plates: Arc<[MeshData]>,
    /// Solids that cast shadows.
    pub solid: Layer,
    /// Fixed solids in front of moving ones, drawn translucent.
    pub faded: Layer,
    /// Force arrows: solid, and visible through whatever is in front of them.
    pub arrows: Layer,
    /// Other states of the machine, translucent in front of everything but arrows.
    pub ghost: Layer,
    /// The ghosts in their outline colour.
    pub ghost_edges: Layer,
    /// Halos of joints that were hit.
    pub halos: Vec<Instance>,
    /// Sockets, farthest first: for each the remaining half and, fainter, the half cut away.
    pub sockets: Vec<Instance>,
    /// Cells of wear maps, in their own colours regardless of light; fainter behind solids and behind the wall.
    pub wear: Layer,
    /// Translucent balls in front of wear maps.
    pub clear_balls: Vec<Instance>,
    /// Solids in front of everything: the triad.
    pub overlay: Layer,
    /// Lines.
    pub lines: Vec<Line>,
    /// Lines in front of everything: outlines of past peaks.
    pub marks: Vec<Line>,
    /// Text for the interface to draw.
    pub labels: Vec<Label>,
    /// The arrow legend; `None` if no arrows are drawn.
    pub legend: Option<Legend>,
    /// The wear-map legend; `None` if none is drawn.
    pub wear_scale: Option<WearScale>,
    /// The legend of the tip's errors; `None` if no map is drawn.
    pub error_scale: Option<ErrorScale>,
    /// Magnification of the play as drawn.
    pub magnification: f32,
    /// Its label: "clearance drawn ×50"; notes a reduced magnification.
    pub magnification_text: String,
}

impl Default for DrawList {
    /// An empty list of size 0. Its buffers are reused from build to build.
    fn default() -> Self {
        let ground = Colour::hex(0xFFFFFF);
        Self {
            size: [0, 0],
            eye: Eye { clip_from_world: Mat4::IDENTITY, position: Vec3::ZERO },
            light: Light {
                direction: Vec3::Z,
                strip: Vec3::Z,
                up: Vec3::Z,
                radius: 1.0,
                studio: [1.0; 4],
                behind: 0.0,
            },
            background: Background { top: ground, bottom: ground },
            exposure: 1.0,
            outline: Colour::hex(0),
            outline_width: 1.0,
            rim: ground,
            quality: Quality::FULL,
            floor: None,
            plates: Arc::new([]),
            solid: Layer::default(),
            faded: Layer::default(),
            ghost: Layer::default(),
            ghost_edges: Layer::default(),
            arrows: Layer::default(),
            halos: Vec::new(),
            sockets: Vec::new(),
            wear: Layer::default(),
            clear_balls: Vec::new(),
            overlay: Layer::default(),
            lines: Vec::new(),
            marks: Vec::new(),
            labels: Vec::new(),
            legend: None,
            wear_scale: None,
            error_scale: None,
            magnification: 1.0,
            magnification_text: String::new(),
        }
    }
}
