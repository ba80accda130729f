//! Buffers and passes.

use std::mem::size_of;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, Vec4};
use wgpu::util::DeviceExt as _;

use super::meshes::{self, COARSE_PIXELS, Detail};
use super::pipelines::{Pipelines, SHADOW};
use super::{RenderTarget, wgpu};
use crate::view::{DrawList, Eye, Instance, Layer, Line, Mesh, MeshData};

/// Side of the shadow map, pixels: within the 2048 that WebGL2 guarantees.
const SHADOW_SIZE: u32 = 1536;

/// `Globals` of `shaders/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Globals {
    clip_from_world: [[f32; 4]; 4],
    light_from_world: [[f32; 4]; 4],
    eye: [f32; 4],
    light: [f32; 4],
    up: [f32; 4],
    background_top: [f32; 4],
    background_bottom: [f32; 4],
    picture: [f32; 4],
    floor_centre: [f32; 4],
    floor_along: [f32; 4],
    floor_colour: [f32; 4],
    floor_lines: [f32; 4],
}

/// A mesh on the device.
struct Loaded {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
}

/// A buffer that grows as needed.
struct Growing {
    label: &'static str,
    buffer: wgpu::Buffer,
}

/// Instances of one mesh within the instance buffer.
struct Batch {
    detail: Detail,
    mesh: usize,
    first: u64,
    count: u32,
}

/// Draws draw lists; keeps pipelines, meshes and instance buffers between pictures.
pub struct Renderer {
    pipelines: Pipelines,
    globals: wgpu::Buffer,
    globals_group: wgpu::BindGroup,
    shadow_map: wgpu::TextureView,
    shadow_group: wgpu::BindGroup,
    meshes: Vec<Loaded>,
    /// The shared meshes for instances of a few pixels, by [`Mesh::index`].
    coarse: Vec<Loaded>,
    plates: Arc<[MeshData]>,
    instances: Growing,
    lines: Growing,
    marks: Growing,
    /// All instances of a picture, layer by layer.
    packed: Vec<Instance>,
}

impl Renderer {
    /// Creates pipelines and shared meshes on `device`.
    pub fn new(device: &wgpu::Device) -> Self {
        let pipelines = Pipelines::new(device);
        let globals = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("globals"),
            size: size_of::<Globals>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let globals_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("globals"),
            layout: &pipelines.globals,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: globals.as_entire_binding(),
            }],
        });
        let shadow_map = device
            .create_texture(&wgpu::TextureDescriptor {
                label: Some("shadow map"),
                size: wgpu::Extent3d {
                    width: SHADOW_SIZE,
                    height: SHADOW_SIZE,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: SHADOW,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
            .create_view(&Default::default());
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });
        let shadow_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow"),
            layout: &pipelines.shadow,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&shadow_map),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(&sampler),
                },
            ],
        });
        Self {
            globals,
            globals_group,
            shadow_map,
            shadow_group,
            meshes: meshes::shared(Detail::Fine)
                .iter()
                .map(|mesh| load(device, mesh))
                .collect(),
            coarse: meshes::shared(Detail::Coarse)
                .iter()
                .map(|mesh| load(device, mesh))
                .collect(),
            plates: Arc::new([]),
            instances: Growing::new(device, "instances"),
            lines: Growing::new(device, "lines"),
            marks: Growing::new(device, "marks"),
            packed: Vec::new(),
            pipelines,
        }
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
            self.meshes.truncate(Mesh::SHARED);
            self.meshes
                .extend(list.plates.iter().map(|mesh| load(device, mesh)));
        }
        self.packed.clear();
        let height = target.size()[1];
        let pixels = |instance: &Instance| radius_on_screen(&list.eye, height, instance);
        let solid = self.pack(&list.solid, pixels);
        let faded = self.pack(&list.faded, pixels);
        let ghost = self.pack(&list.ghost, pixels);
        let ghost_edges = self.pack(&list.ghost_edges, pixels);
        let arrows = self.pack(&list.arrows, pixels);
        let overlay = self.pack(&list.overlay, pixels);
        let halos = self.pack_mesh(Mesh::Sphere.index(), &list.halos, pixels);
        let sockets = self.pack_mesh(Mesh::Socket.index(), &list.sockets, pixels);
        let wear = self.pack(&list.wear, pixels);
        let clear_balls = self.pack_mesh(Mesh::Sphere.index(), &list.clear_balls, pixels);
        self.instances
            .write(device, queue, bytemuck::cast_slice(&self.packed));
        self.lines
            .write(device, queue, bytemuck::cast_slice(&list.lines));
        self.marks
            .write(device, queue, bytemuck::cast_slice(&list.marks));
        queue.write_buffer(
            &self.globals,
            0,
            bytemuck::bytes_of(&globals(list, target.size())),
        );

        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow"),
                color_attachments: &[],
                depth_stencil_attachment: Some(depth_attachment(
                    &self.shadow_map,
                    wgpu::StoreOp::Store,
                )),
                ..Default::default()
            });
            pass.set_bind_group(0, &self.globals_group, &[]);
            self.draw_meshes(&mut pass, &self.pipelines.cast_shadow, &solid);
            self.draw_meshes(&mut pass, &self.pipelines.cast_shadow, &faded);
            self.draw_meshes(&mut pass, &self.pipelines.cast_shadow, &clear_balls);
        }

        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.samples,
                depth_slice: None,
                resolve_target: Some(&target.picture_view),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            depth_stencil_attachment: Some(depth_attachment(&target.depth, wgpu::StoreOp::Discard)),
            ..Default::default()
        });
        let pipelines = &self.pipelines;
        pass.set_bind_group(0, &self.globals_group, &[]);
        pass.set_bind_group(1, &self.shadow_group, &[]);
        pass.set_pipeline(&pipelines.background);
        pass.draw(0..3, 0..1);
        self.draw_meshes(&mut pass, &pipelines.solid, &solid);
        if list.floor.is_some() {
            pass.set_pipeline(&pipelines.floor);
            pass.draw(0..4, 0..1);
        }
        draw_lines(&mut pass, &pipelines.line, &self.lines, &list.lines);
        self.draw_meshes(&mut pass, &pipelines.faded, &faded);
        self.draw_meshes(&mut pass, &pipelines.halo, &halos);
        self.draw_meshes(&mut pass, &pipelines.socket_far, &sockets);
        self.draw_meshes(&mut pass, &pipelines.socket_near, &sockets);
        // After the sockets, whose glass would tint their colours.
        self.draw_meshes(&mut pass, &pipelines.wear_behind, &wear);
        self.draw_meshes(&mut pass, &pipelines.wear, &wear);
        self.draw_meshes(&mut pass, &pipelines.faded, &clear_balls);
        self.draw_meshes(&mut pass, &pipelines.ghost_depth, &ghost);
        self.draw_meshes(&mut pass, &pipelines.ghost, &ghost);
        self.draw_meshes(&mut pass, &pipelines.ghost_edge, &ghost_edges);
        // After the sockets, so that glass does not dim a force.
        draw_lines(&mut pass, &pipelines.outline, &self.marks, &list.marks);
        self.draw_meshes(&mut pass, &pipelines.mark_behind, &arrows);
        self.draw_meshes(&mut pass, &pipelines.mark, &arrows);
        self.draw_meshes(&mut pass, &pipelines.overlay, &overlay);
    }

    /// Packs all instances of `layer`; `pixels` gives an instance's radius on the screen.
    fn pack(&mut self, layer: &Layer, pixels: impl Fn(&Instance) -> f32 + Copy) -> Vec<Batch> {
        let meshes = layer.by_mesh.iter().enumerate();
        meshes
            .flat_map(|(mesh, instances)| self.pack_mesh(mesh, instances, pixels))
            .collect()
    }

    /// Coarse instances, then fine ones; either may be none. Translucent lists run from far to near, and what is coarse is far.
    fn pack_mesh(
        &mut self,
        mesh: usize,
        instances: &[Instance],
        pixels: impl Fn(&Instance) -> f32,
    ) -> [Batch; 2] {
        [Detail::Coarse, Detail::Fine].map(|detail| {
            let first = self.packed.len();
            let small =
                |instance: &&Instance| mesh < Mesh::SHARED && pixels(instance) <= COARSE_PIXELS;
            let of_detail = instances
                .iter()
                .filter(|instance| small(instance) == (detail == Detail::Coarse));
            self.packed.extend(of_detail);
            Batch {
                detail,
                mesh,
                first: (first * size_of::<Instance>()) as u64,
                count: (self.packed.len() - first) as u32,
            }
        })
    }

    fn draw_meshes(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipeline: &wgpu::RenderPipeline,
        batches: &[Batch],
    ) {
        pass.set_pipeline(pipeline);
        for batch in batches.iter().filter(|batch| batch.count > 0) {
            let meshes = match batch.detail {
                Detail::Fine => &self.meshes,
                Detail::Coarse => &self.coarse,
            };
            let Some(mesh) = meshes.get(batch.mesh) else {
                continue;
            };
            pass.set_vertex_buffer(0, mesh.vertices.slice(..));
            // An offset slice, because WebGL2 has no first instance.
            let end = batch.first + u64::from(batch.count) * size_of::<Instance>() as u64;
            pass.set_vertex_buffer(1, self.instances.buffer.slice(batch.first..end));
            pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..mesh.count, 0, 0..batch.count);
        }
    }
}

impl Growing {
    fn new(device: &wgpu::Device, label: &'static str) -> Self {
        Self {
            label,
            buffer: Self::make(device, label, 4096),
        }
    }

    fn make(device: &wgpu::Device, label: &str, size: u64) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST;
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let needed = bytes.len() as u64;
        if self.buffer.size() < needed {
            self.buffer = Self::make(device, self.label, needed.next_power_of_two());
        }
        queue.write_buffer(&self.buffer, 0, bytes);
    }
}

fn draw_lines(
    pass: &mut wgpu::RenderPass<'_>,
    pipeline: &wgpu::RenderPipeline,
    buffer: &Growing,
    lines: &[Line],
) {
    if lines.is_empty() {
        return;
    }
    pass.set_pipeline(pipeline);
    let bytes = size_of_val(lines) as u64;
    pass.set_vertex_buffer(0, buffer.buffer.slice(..bytes));
    pass.draw(0..4, 0..lines.len() as u32);
}

fn depth_attachment(
    view: &wgpu::TextureView,
    store: wgpu::StoreOp,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations {
            load: wgpu::LoadOp::Clear(1.0),
            store,
        }),
        stencil_ops: None,
    }
}

fn load(device: &wgpu::Device, mesh: &MeshData) -> Loaded {
    let vertices: Vec<f32> = mesh
        .vertices
        .iter()
        .flat_map(|(p, n)| p.iter().chain(n).copied())
        .collect();
    let buffer = |label, contents, usage| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents,
            usage,
        })
    };
    Loaded {
        vertices: buffer(
            "vertices",
            bytemuck::cast_slice(&vertices),
            wgpu::BufferUsages::VERTEX,
        ),
        indices: buffer(
            "indices",
            bytemuck::cast_slice(&mesh.indices),
            wgpu::BufferUsages::INDEX,
        ),
        count: mesh.indices.len() as u32,
    }
}

fn globals(list: &DrawList, size: [u32; 2]) -> Globals {
    let light = &list.light;
    let floor = list.floor;
    let with = |v: Vec3, w: f32| v.extend(w).to_array();
    Globals {
        clip_from_world: list.eye.clip_from_world.to_cols_array_2d(),
        light_from_world: light_from_world(light.direction, light.centre, light.radius)
            .to_cols_array_2d(),
        eye: with(list.eye.position, 1.0),
        light: with(light.direction, list.exposure),
        up: with(light.up, 2.0 * light.radius / SHADOW_SIZE as f32),
        background_top: list.background.top.0,
        background_bottom: list.background.bottom.0,
        picture: [
            size[0] as f32,
            size[1] as f32,
            1.0 / SHADOW_SIZE as f32,
            0.0,
        ],
        floor_centre: floor.map_or([0.0; 4], |f| with(f.centre, f.radius)),
        floor_along: floor.map_or([0.0; 4], |f| with(f.along, f.spacing)),
        floor_colour: floor.map_or([0.0; 4], |f| f.colour.0),
        floor_lines: floor.map_or([0.0; 4], |f| f.lines.0),
    }
}

/// Radius across an instance's axis, pixels, at the nearer of its origin and its tip (0, 0, 1): what its roundness is seen
/// by. Infinite where either is not in front of the eye.
fn radius_on_screen(eye: &Eye, height: u32, instance: &Instance) -> f32 {
    let rows = instance.world_from_mesh.map(Vec4::from);
    let column = |j: usize| Vec3::new(rows[0][j], rows[1][j], rows[2][j]);
    let depth = |at: Vec3| eye.clip_from_world.row(3).dot(at.extend(1.0));
    let nearest = depth(column(3)).min(depth(column(3) + column(2)));
    if nearest <= 0.0 {
        return f32::INFINITY;
    }
    let radius = column(0).length().max(column(1).length());
    let scale = eye.clip_from_world.row(1).truncate().length();
    radius * scale / nearest * 0.5 * height as f32
}

/// Orthographic view from the light onto the sphere that needs shadows.
fn light_from_world(direction: Vec3, centre: Vec3, radius: f32) -> Mat4 {
    let up = direction.any_orthonormal_vector();
    let view =
        glam::camera::rh::view::look_to_mat4(centre + direction * (2.0 * radius), -direction, up);
    glam::camera::rh::proj::directx::orthographic(
        -radius,
        radius,
        -radius,
        radius,
        0.5 * radius,
        4.0 * radius,
    ) * view
}

#[cfg(test)]
mod tests {
    use glam::{Mat3, Quat};

    use super::*;
    use crate::view::{SceneView, fixture};

    #[test]
    fn the_radius_on_the_screen_is_the_one_that_points_span() {
        const SIZE: [u32; 2] = [480, 360];
        let (scene, frame) = fixture::pendulum();
        let camera = SceneView::new(&scene, &frame).camera();
        let eye = camera.view(SIZE);
        let turn = Mat3::from_quat(Quat::from_rotation_x(0.7));
        let at = |origin: Vec3, radius: f32| {
            let linear = turn * Mat3::from_diagonal(Vec3::new(radius, radius, 1e-6));
            let rows = [0, 1, 2].map(|i| linear.row(i).extend(origin[i]).to_array());
            let instance = Instance {
                world_from_mesh: rows,
                ..Instance::zeroed()
            };
            radius_on_screen(&eye, SIZE[1], &instance)
        };
        let (right, _, back) = camera.axes();
        for radius in [1e-4_f32, 1e-3, 1e-2] {
            let ends = [-radius, radius].map(|r| eye.project(camera.target + r * right, SIZE));
            let [Some(from), Some(to)] = ends else {
                panic!("the target is behind the eye");
            };
            let (found, spanned) = (at(camera.target, radius), from.distance(to) / 2.0);
            assert!((found / spanned - 1.0).abs() < 1e-2, "{found} {spanned}");
        }
        assert!(at(camera.eye() + back, 1e-3).is_infinite());
    }
}
