//! Buffers and passes.

use std::mem::size_of;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use wgpu::util::DeviceExt as _;

use super::finish::Finish;
use super::fit::{self, BoundingSphere, shadow_region};
use super::meshes::{self, LEVELS};
use super::passes::{Group, PASSES, PassContent};
use super::pipelines::{Pipelines, SHADOW};
use super::target::{ColorEncoding, extent};
use super::{RenderTarget, wgpu};
use crate::view::{Colour, DrawList, Eye, Instance, Line, Mesh, MeshData};

/// Side of the shadow map, pixels: within the 2048 that WebGL2 guarantees.
const SHADOW_SIZE: u32 = 1536;
/// Half width of a shadow's edge, in radii of the scene; and its limits in texels, within which nine comparisons are smooth.
const SHADOW_EDGE: f32 = 0.003;
const SHADOW_EDGE_TEXELS: [f32; 2] = [1.2, 2.5];

/// `Globals` of `shaders/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Globals {
    clip_from_world: [[f32; 4]; 4],
    light_from_world: [[f32; 4]; 4],
    eye: [f32; 4],
    light: [f32; 4],
    up: [f32; 4],
    studio: [f32; 4],
    strip: [f32; 4],
    background_top: [f32; 4],
    background_bottom: [f32; 4],
    picture: [f32; 4],
    floor_centre: [f32; 4],
    floor_along: [f32; 4],
    floor_colour: [f32; 4],
    floor_lines: [f32; 4],
    outline: [f32; 4],
    rim: [f32; 4],
}

/// A mesh on the device.
struct GpuMesh {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
    /// Centre and half size of its bounding box.
    bounds: [Vec3; 2],
}

/// A buffer that grows as needed.
struct GrowableBuffer {
    label: &'static str,
    buffer: wgpu::Buffer,
}

/// The shadow map.
struct Shadow {
    /// Side, pixels.
    size: u32,
    map: wgpu::TextureView,
    group: wgpu::BindGroup,
}

impl Shadow {
    fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, sampler: &wgpu::Sampler, size: u32) -> Self {
        let map = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shadow map"),
            size: extent([size; 2]),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: SHADOW,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let map = map.create_view(&Default::default());
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow"),
            layout,
            entries: &[
                entry(0, wgpu::BindingResource::TextureView(&map)),
                entry(1, wgpu::BindingResource::Sampler(sampler)),
            ],
        });
        Self { size, map, group }
    }
}

/// Instances of one mesh within the instance buffer: those in view come first.
struct Batch {
    level: usize,
    mesh: usize,
    first: u64,
    in_view: u32,
    count: u32,
}

/// Renders draw lists; reuses pipelines, meshes and instance buffers between pictures.
pub struct Renderer {
    pipelines: Pipelines,
    globals: wgpu::Buffer,
    globals_group: wgpu::BindGroup,
    shadow: Shadow,
    sampler: wgpu::Sampler,
    /// Meshes by level of detail, the finest first, then by [`Mesh::index`]; only the finest level has the plates.
    meshes: Vec<Vec<GpuMesh>>,
    plates: Arc<[MeshData]>,
    instances: GrowableBuffer,
    lines: GrowableBuffer,
    marks: GrowableBuffer,
    /// All instances of a picture, group by group.
    packed: Vec<Instance>,
    /// Bounding spheres of shadow casters, and whether they are in view.
    casters: Vec<(BoundingSphere, bool)>,
    encoding: ColorEncoding,
}

impl Renderer {
    /// Creates pipelines and shared meshes on `device`, which belongs to `adapter`.
    pub fn new(device: &wgpu::Device, adapter: &wgpu::Adapter) -> Self {
        let encoding = ColorEncoding::supported_by(adapter);
        let pipelines = Pipelines::new(device, encoding);
        let globals = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("globals"),
            size: size_of::<Globals>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let globals_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("globals"),
            layout: &pipelines.globals,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: globals.as_entire_binding() }],
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        let shadow = Shadow::new(device, &pipelines.shadow, &sampler, SHADOW_SIZE);
        Self {
            globals,
            globals_group,
            shadow,
            sampler,
            meshes: LEVELS
                .iter()
                .map(|level| {
                    let shared = meshes::shared(level.sectors);
                    shared.iter().map(|mesh| load(device, mesh)).collect()
                })
                .collect(),
            plates: Arc::new([]),
            instances: GrowableBuffer::new(device, "instances"),
            lines: GrowableBuffer::new(device, "lines"),
            marks: GrowableBuffer::new(device, "marks"),
            packed: Vec::new(),
            casters: Vec::new(),
            encoding,
            pipelines,
        }
    }

    /// A target for pictures of `size` pixels with 4 samples or 1 per pixel.
    pub fn target(&self, device: &wgpu::Device, size: [u32; 2], samples: u32) -> RenderTarget {
        RenderTarget::new(device, size, samples, self.encoding)
    }

    /// The last pass, from its targets to attachments of `format`.
    pub(super) fn finish(&self, device: &wgpu::Device, format: wgpu::TextureFormat) -> Finish {
        Finish::new(device, self.encoding, format)
    }

    /// Records the passes that draw `list` to `target`. One picture per submission: the buffers are shared.
    pub fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        target: &RenderTarget,
        list: &DrawList,
    ) {
        if !Arc::ptr_eq(&self.plates, &list.plates) {
            self.plates = list.plates.clone();
            self.meshes[0].truncate(Mesh::SHARED);
            self.meshes[0].extend(list.plates.iter().map(|mesh| load(device, mesh)));
        }
        let fine = list.quality.fine_shadows;
        let side = if fine { SHADOW_SIZE } else { SHADOW_SIZE / 2 };
        if self.shadow.size != side {
            self.shadow = Shadow::new(device, &self.pipelines.shadow, &self.sampler, side);
        }
        let batches = self.pack(list, target.size());
        self.instances.write(device, queue, bytemuck::cast_slice(&self.packed));
        self.lines.write(device, queue, bytemuck::cast_slice(&list.lines));
        self.marks.write(device, queue, bytemuck::cast_slice(&list.marks));
        let globals = self.globals_of(list, target.size());
        queue.write_buffer(&self.globals, 0, bytemuck::bytes_of(&globals));

        let passes = PASSES.iter().enumerate().filter(|(_, pass)| draws_something(pass.draws, list, &batches));
        let (shadow, picture): (Vec<_>, Vec<_>) = passes.partition(|(_, pass)| pass.is_shadow_pass());
        let pipeline = |index| self.pipelines.pass(device, target.samples(), index);
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow"),
                color_attachments: &[],
                depth_stencil_attachment: Some(depth_attachment(&self.shadow.map, wgpu::StoreOp::Store)),
                ..Default::default()
            });
            pass.set_bind_group(0, &self.globals_group, &[]);
            for (index, step) in shadow {
                pass.set_pipeline(pipeline(index));
                self.step(&mut pass, step.draws, list, &batches);
            }
        }
        let (view, resolve_target, store) = match &target.multisampled {
            Some(multisampled) => (multisampled, Some(&target.light), wgpu::StoreOp::Discard),
            None => (&target.light, None, wgpu::StoreOp::Store),
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store },
            })],
            depth_stencil_attachment: Some(depth_attachment(&target.depth, wgpu::StoreOp::Discard)),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.globals_group, &[]);
        pass.set_bind_group(1, &self.shadow.group, &[]);
        for (index, step) in picture {
            pass.set_pipeline(pipeline(index));
            self.step(&mut pass, step.draws, list, &batches);
        }
    }

    /// Creates one pipeline that no picture for `target` has needed so far, so that a later one need not wait for it.
    pub(super) fn create_next_pipeline(&self, device: &wgpu::Device, target: &RenderTarget) {
        self.pipelines.create_next(device, target.samples());
    }

    /// Number of triangles of meshes that the passes of `list` draw.
    #[cfg(test)]
    pub(super) fn triangles(&mut self, list: &DrawList) -> u64 {
        let batches = self.pack(list, list.size);
        let of = |group: Group, count: fn(&Batch) -> u32| {
            let batches = batches[group as usize].iter();
            let drawn = batches.filter_map(|batch| {
                let mesh = self.meshes[batch.level].get(batch.mesh)?;
                Some(u64::from(mesh.count / 3) * u64::from(count(batch)))
            });
            drawn.sum::<u64>()
        };
        let drawn = PASSES.iter().map(|pass| match pass.draws {
            PassContent::Meshes(Group::Casters) => CASTERS.iter().map(|group| of(*group, |batch| batch.count)).sum(),
            PassContent::Meshes(group) => of(group, |batch| batch.in_view),
            _ => 0,
        });
        drawn.sum()
    }

    fn step(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        draws: PassContent,
        list: &DrawList,
        batches: &[Vec<Batch>; Group::COUNT],
    ) {
        match draws {
            PassContent::FullScreen => pass.draw(0..3, 0..1),
            PassContent::Floor => pass.draw(0..4, 0..1),
            PassContent::Lines => draw_lines(pass, &self.lines, &list.lines),
            PassContent::Marks => draw_lines(pass, &self.marks, &list.marks),
            PassContent::Meshes(Group::Casters) => {
                for group in CASTERS {
                    self.draw_meshes(pass, &batches[group as usize], |batch| batch.count);
                }
            }
            PassContent::Meshes(group) => {
                self.draw_meshes(pass, &batches[group as usize], |batch| batch.in_view);
            }
        }
    }

    /// Packs all instances of `list` for a picture of `size`, and collects the shadow casters.
    fn pack(&mut self, list: &DrawList, size: [u32; 2]) -> [Vec<Batch>; Group::COUNT] {
        let mut packer = InstancePacker {
            eye: &list.eye,
            height: size[1],
            meshes: &self.meshes,
            packed: &mut self.packed,
            casters: &mut self.casters,
        };
        packer.packed.clear();
        packer.casters.clear();
        let mut batches = [const { Vec::new() }; Group::COUNT];
        for (group, layer) in [
            (Group::Solid, &list.solid),
            (Group::Faded, &list.faded),
            (Group::Ghost, &list.ghost),
            (Group::GhostEdges, &list.ghost_edges),
            (Group::Arrows, &list.arrows),
            (Group::Overlay, &list.overlay),
            (Group::Wear, &list.wear),
        ] {
            let casts = CASTERS.contains(&group);
            for (mesh, all) in layer.by_mesh.iter().enumerate() {
                let plain = all.iter().filter(|one| group != Group::Solid || !has_facing_sphere(one));
                packer.mesh(mesh, plain, casts, &mut batches[group as usize]);
            }
        }
        let sphere = Mesh::Sphere.index();
        let solid = list.solid.by_mesh.get(sphere).map_or(&[][..], |all| all);
        for (group, balls) in
            [(Group::Balls, solid), (Group::Halos, &list.halos[..]), (Group::ClearBalls, &list.clear_balls[..])]
        {
            let casts = CASTERS.contains(&group);
            let balls = balls.iter().filter(|one| group != Group::Balls || has_facing_sphere(one));
            packer.mesh(sphere, balls, casts, &mut batches[group as usize]);
        }
        packer.in_order(Mesh::Socket.index(), &list.sockets, &mut batches[Group::Sockets as usize]);
        batches
    }

    fn draw_meshes(&self, pass: &mut wgpu::RenderPass<'_>, batches: &[Batch], count: impl Fn(&Batch) -> u32) {
        for batch in batches.iter().filter(|batch| count(batch) > 0) {
            let Some(mesh) = self.meshes[batch.level].get(batch.mesh) else {
                continue;
            };
            pass.set_vertex_buffer(0, mesh.vertices.slice(..));
            // An offset slice, because WebGL2 has no first instance.
            let end = batch.first + u64::from(batch.count) * size_of::<Instance>() as u64;
            pass.set_vertex_buffer(1, self.instances.buffer.slice(batch.first..end));
            pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..mesh.count, 0, 0..count(batch));
        }
    }

    fn globals_of(&self, list: &DrawList, size: [u32; 2]) -> Globals {
        let light = &list.light;
        let floor = list.floor;
        let with = |v: Vec3, w: f32| v.extend(w).to_array();
        let coloured = |colour: Colour, w: f32| Vec3::from(colour.linear()).extend(w).to_array();
        let plane = floor.map(|floor| (floor.centre, light.up));
        let region = shadow_region(&self.casters, light.direction, plane, &list.eye);
        let texels = self.shadow.size;
        let texel = 2.0 * region.radius / texels as f32;
        let shadow_edge = (SHADOW_EDGE * light.radius / texel).clamp(SHADOW_EDGE_TEXELS[0], SHADOW_EDGE_TEXELS[1]);
        let flag = |on: bool| f32::from(u8::from(on));
        let shadow_neighbours = flag(list.quality.fine_shadows);
        Globals {
            clip_from_world: list.eye.clip_from_world.to_cols_array_2d(),
            light_from_world: region.light_from_world(light.direction, texels).to_cols_array_2d(),
            eye: with(list.eye.position, 1.0),
            light: with(light.direction, list.exposure),
            up: with(light.up, texel),
            studio: light.studio,
            strip: with(light.strip, light.behind),
            background_top: coloured(list.background.top, shadow_neighbours),
            background_bottom: coloured(list.background.bottom, 1.0),
            picture: [size[0] as f32, size[1] as f32, 1.0 / texels as f32, shadow_edge],
            floor_centre: floor.map_or([0.0; 4], |f| with(f.centre, f.radius)),
            floor_along: floor.map_or([0.0; 4], |f| with(f.along, f.spacing)),
            floor_colour: floor.map_or([0.0; 4], |f| coloured(f.colour, 1.0)),
            floor_lines: floor.map_or([0.0; 4], |f| coloured(f.lines, 1.0)),
            outline: coloured(list.outline, list.outline_width),
            rim: coloured(list.rim, flag(list.quality.occlusion)),
        }
    }
}

/// Whether the instance is a ball shaded by its socket's wall or marked at its contact point.
fn has_facing_sphere(instance: &&Instance) -> bool {
    instance.other[3] > 0.0 || instance.touch[3] > 0.0
}

/// Groups that cast shadows.
const CASTERS: [Group; 4] = [Group::Solid, Group::Balls, Group::Faded, Group::ClearBalls];

/// Sorts instances by mesh, level of detail and whether they are in view.
struct InstancePacker<'a> {
    eye: &'a Eye,
    height: u32,
    meshes: &'a [Vec<GpuMesh>],
    packed: &'a mut Vec<Instance>,
    casters: &'a mut Vec<(BoundingSphere, bool)>,
}

impl InstancePacker<'_> {
    /// Packs instances of one mesh in any order; those out of view are packed only if they cast shadows.
    fn mesh<'i>(
        &mut self,
        mesh: usize,
        all: impl Iterator<Item = &'i Instance>,
        casts: bool,
        batches: &mut Vec<Batch>,
    ) {
        let Some(GpuMesh { bounds, .. }) = self.meshes[0].get(mesh) else {
            return;
        };
        let frustum = fit::Frustum::new(self.eye);
        let place = |instance: &'i Instance| {
            let ball = BoundingSphere::around(instance, bounds, Mesh::is_round(mesh));
            let in_view = frustum.may_contain(&ball);
            (instance, self.level(mesh, instance, in_view), in_view, ball)
        };
        let places: Vec<(&Instance, usize, bool, BoundingSphere)> = all.map(place).collect();
        if places.is_empty() {
            return;
        }
        if casts {
            self.casters.extend(places.iter().map(|(.., in_view, ball)| (*ball, *in_view)));
        }
        for level in 0..LEVELS.len() {
            let first = self.packed.len();
            let mut count = 0;
            for is_in_view in [true, false].into_iter().filter(|is_in_view| *is_in_view || casts) {
                let chosen = places.iter().filter(|(_, of, in_view, _)| (*of, *in_view) == (level, is_in_view));
                self.packed.extend(chosen.map(|(instance, ..)| linear(instance)));
                if is_in_view {
                    count = self.packed.len() - first;
                }
            }
            self.push(batches, level, mesh, first, count);
        }
    }

    /// Packs instances of one mesh in the given order: translucent ones run from far to near.
    fn in_order(&mut self, mesh: usize, all: &[Instance], batches: &mut Vec<Batch>) {
        let frustum = fit::Frustum::new(self.eye);
        let bounds = self.meshes[0][mesh].bounds;
        let (mut first, mut run) = (self.packed.len(), 0);
        for instance in all {
            if !frustum.may_contain(&BoundingSphere::around(instance, &bounds, Mesh::is_round(mesh))) {
                continue;
            }
            let level = self.level(mesh, instance, true);
            if level != run {
                self.push(batches, run, mesh, first, self.packed.len() - first);
                (first, run) = (self.packed.len(), level);
            }
            self.packed.push(linear(instance));
        }
        self.push(batches, run, mesh, first, self.packed.len() - first);
    }

    fn push(&self, batches: &mut Vec<Batch>, level: usize, mesh: usize, first: usize, in_view: usize) {
        batches.push(Batch {
            level,
            mesh,
            first: (first * size_of::<Instance>()) as u64,
            in_view: in_view as u32,
            count: (self.packed.len() - first) as u32,
        });
    }

    /// Level of detail for an instance: the coarsest whose corners do not show.
    fn level(&self, mesh: usize, instance: &Instance, in_view: bool) -> usize {
        if mesh >= Mesh::SHARED {
            return 0;
        }
        let radius = radius_on_screen(self.eye, self.height, instance, in_view);
        let fits = LEVELS.iter().rposition(|level| radius <= level.pixels);
        fits.unwrap_or(0)
    }
}

/// The instance with its colour linear.
fn linear(instance: &Instance) -> Instance {
    let [r, g, b] = Colour(instance.colour).linear();
    Instance { colour: [r, g, b, instance.colour[3]], ..*instance }
}

impl GrowableBuffer {
    fn new(device: &wgpu::Device, label: &'static str) -> Self {
        Self { label, buffer: Self::create(device, label, 4096) }
    }

    fn create(device: &wgpu::Device, label: &str, size: u64) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST;
        device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
    }

    fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let needed = bytes.len() as u64;
        if self.buffer.size() < needed {
            self.buffer = Self::create(device, self.label, needed.next_power_of_two());
        }
        queue.write_buffer(&self.buffer, 0, bytes);
    }
}

/// Whether a pass over `draws` changes the picture. Most passes are empty in most pictures, and a software driver needs a tenth
/// of a second to create each pipeline.
fn draws_something(draws: PassContent, list: &DrawList, batches: &[Vec<Batch>; Group::COUNT]) -> bool {
    match draws {
        PassContent::FullScreen => true,
        PassContent::Floor => list.floor.is_some(),
        PassContent::Lines => !list.lines.is_empty(),
        PassContent::Marks => !list.marks.is_empty(),
        PassContent::Meshes(Group::Casters) => {
            CASTERS.iter().any(|group| batches[*group as usize].iter().any(|batch| batch.count > 0))
        }
        PassContent::Meshes(group) => batches[group as usize].iter().any(|batch| batch.in_view > 0),
    }
}

fn draw_lines(pass: &mut wgpu::RenderPass<'_>, buffer: &GrowableBuffer, lines: &[Line]) {
    let bytes = size_of_val(lines) as u64;
    pass.set_vertex_buffer(0, buffer.buffer.slice(..bytes));
    pass.draw(0..4, 0..lines.len() as u32);
}

fn depth_attachment(view: &wgpu::TextureView, store: wgpu::StoreOp) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store }),
        stencil_ops: None,
    }
}

fn load(device: &wgpu::Device, mesh: &MeshData) -> GpuMesh {
    let vertices: Vec<f32> = mesh.vertices.iter().flat_map(|(p, n)| p.iter().chain(n).copied()).collect();
    let buffer = |label, contents, usage| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
    };
    GpuMesh {
        vertices: buffer("vertices", bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
        indices: buffer("indices", bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
        count: mesh.indices.len() as u32,
        bounds: mesh.bounds(),
    }
}

/// Radius across an instance's axis, pixels, at the nearer of its origin and its tip (0, 0, 1): the size of its visible
/// curvature. Infinite if either is not in front of the eye. For an instance that is not `in_view` but casts a shadow, the radius
/// if the eye faced it.
fn radius_on_screen(eye: &Eye, height: u32, instance: &Instance, in_view: bool) -> f32 {
    let rows = instance.world_from_mesh.map(Vec4::from);
    let column = |j: usize| Vec3::new(rows[0][j], rows[1][j], rows[2][j]);
    let away = |at: Vec3| match in_view {
        true => eye.clip_from_world.row(3).dot(at.extend(1.0)),
        false => at.distance(eye.position),
    };
    let nearest = away(column(3)).min(away(column(3) + column(2)));
    if nearest <= 0.0 {
        return f32::INFINITY;
    }
    let radius = column(0).length().max(column(1).length());
    let scale = eye.clip_from_world.row(1).truncate().length();
    radius * scale / nearest * 0.5 * height as f32
}

#[cfg(test)]
mod tests {
    use glam::{Mat3, Quat};

    use super::*;
    use crate::view::{SceneView, fixture};

    #[test]
    fn the_radius_on_the_screen_equals_that_of_projected_points() {
        const SIZE: [u32; 2] = [480, 360];
        let (scene, frame) = fixture::pendulum();
        let camera = SceneView::new(&scene, &frame).camera();
        let eye = camera.view(SIZE);
        let turn = Mat3::from_quat(Quat::from_rotation_x(0.7));
        let at = |origin: Vec3, radius: f32| {
            let linear = turn * Mat3::from_diagonal(Vec3::new(radius, radius, 1e-6));
            let rows = [0, 1, 2].map(|i| linear.row(i).extend(origin[i]).to_array());
            let instance = Instance { world_from_mesh: rows, ..Instance::zeroed() };
            [true, false].map(|in_view| radius_on_screen(&eye, SIZE[1], &instance, in_view))
        };
        let (right, _, back) = camera.axes();
        for radius in [1e-4_f32, 1e-3, 1e-2] {
            let ends = [-radius, radius].map(|r| eye.project(camera.target + r * right, SIZE));
            let [Some(from), Some(to)] = ends else {
                panic!("the target is behind the eye");
            };
            let spanned = from.distance(to) / 2.0;
            for computed in at(camera.target, radius) {
                assert!((computed / spanned - 1.0).abs() < 1e-2, "{computed} {spanned}");
            }
        }
        let [in_view, unseen] = at(camera.eye() + back, 1e-3);
        assert!(in_view.is_infinite() && unseen.is_finite());
    }
}
