//! One frame on the device: buffers and bindings from a draw list, and the draw calls of each pass.

use super::data::{self, Eye};
use super::pipelines::Pipelines;
use super::targets::Targets;
use super::{Gpu, scene};
use crate::list::bounds::Bounds;
use crate::list::debug::strokes;
use crate::{DebugSphere, DrawList, Lens, MAX_SHADOWS, MeshData, RenderError, SphereStyle};
use nalgebra::Matrix4;
use std::ops::Range;
use std::sync::Arc;
use wgpu::util::DeviceExt;
use wgpu::{BindGroup, BindGroupEntry, BindingResource, Buffer, BufferUsages, CommandEncoder, RenderPass, RenderPipeline, TextureView};

/// Meshes on the device, known by their `Arc`: a mesh is uploaded once, and let go when a list no longer holds it.
#[derive(Default)]
pub struct MeshCache {
    known: Vec<(Arc<MeshData>, MeshBuffers)>,
}

#[derive(Clone)]
struct MeshBuffers {
    vertices: Buffer,
    indices: Buffer,
    count: u32,
}

impl MeshCache {
    /// Buffers for the meshes of a list, in its order.
    fn sync(&mut self, gpu: &Gpu, meshes: &[Arc<MeshData>]) -> Result<Vec<MeshBuffers>, RenderError> {
        let mut kept = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            let place = self.known.binary_search_by_key(&Arc::as_ptr(mesh), |(m, _)| Arc::as_ptr(m));
            let buffers = match place {
                Ok(i) => self.known[i].1.clone(),
                Err(_) => {
                    mesh.validate()?;
                    MeshBuffers::new(gpu, mesh)?
                }
            };
            kept.push((mesh.clone(), buffers));
        }
        let buffers = kept.iter().map(|(_, b)| b.clone()).collect();
        // addresses order the cache only; nothing drawn depends on them
        kept.sort_by_key(|(m, _)| Arc::as_ptr(m));
        kept.dedup_by_key(|(m, _)| Arc::as_ptr(m));
        self.known = kept;
        Ok(buffers)
    }
}

impl MeshBuffers {
    fn new(gpu: &Gpu, mesh: &MeshData) -> Result<Self, RenderError> {
        let vertices: Vec<f32> = mesh.positions.iter().zip(&mesh.normals).flat_map(|(p, n)| [p[0], p[1], p[2], n[0], n[1], n[2]]).collect();
        Ok(MeshBuffers {
            vertices: vertex_buffer(gpu, &vertices, "mesh vertices")?,
            indices: buffer(gpu, bytemuck::cast_slice(&mesh.indices), BufferUsages::INDEX, "mesh indices")?,
            count: mesh.indices.len() as u32,
        })
    }
}

/// Instances of one mesh, side by side in the instance buffer; those that throw shadows first.
struct Group {
    mesh: MeshBuffers,
    all: Range<u32>,
    casters: Range<u32>,
}

/// All that one picture needs on the device.
pub struct Frame {
    pub occlusion: bool,
    view: BindGroup,
    shadow_views: Vec<BindGroup>,
    scene: BindGroup,
    occlusion_raw: BindGroup,
    occlusion_blur: BindGroup,
    groups: Vec<Group>,
    instances: Buffer,
    ground: Option<(MeshBuffers, Buffer)>,
    spheres: Batch,
    casting_spheres: u32,
    shells: Batch,
    strokes: Batch,
    strokes_on_top: Batch,
}

/// Instances of a square.
struct Batch {
    buffer: Buffer,
    count: u32,
}

impl Frame {
    pub fn new(
        gpu: &Gpu,
        pipelines: &Pipelines,
        meshes: &mut MeshCache,
        targets: &Targets,
        list: &DrawList,
        lens: &Lens,
    ) -> Result<Self, RenderError> {
        let alone = Eye::new(&lens.view, &lens.projection, targets.width, targets.height);
        let (view, projection): (Matrix4<f32>, Matrix4<f32>) = (lens.view.cast(), lens.projection.cast());
        // views that are parts of one whole fit everything to what is the same for all of them
        let (eye, seen) = match &lens.part {
            Some(part) => (alone.numbered(part), list.whole_box()),
            None => (alone, list.visible_box(&(projection * view))),
        };
        let seen = seen.as_ref();
        let shadows = scene::shadow_eyes(list, seen);
        let reach = scene::occlusion_reach(list, seen, lens.part.is_some());
        let occlusion = reach > 0.0;
        let buffers = meshes.sync(gpu, &list.meshes)?;
        let (groups, instances) = group_instances(gpu, list, &buffers)?;
        let bind_view = |eye: &Eye| -> Result<BindGroup, RenderError> {
            let uniform = buffer(gpu, bytemuck::cast_slice(&eye.floats()), BufferUsages::UNIFORM, "view")?;
            Ok(bind(gpu, &pipelines.view_layout, &[uniform.as_entire_binding()]))
        };
        let reach_uniform = buffer(gpu, bytemuck::cast_slice(&[reach, 0.0, 0.0, 0.0]), BufferUsages::UNIFORM, "occlusion")?;
        let bind_occlusion = |raw: &TextureView| {
            let entries = [BindingResource::TextureView(&targets.view_depth), reach_uniform.as_entire_binding(), BindingResource::TextureView(raw)];
            bind(gpu, &pipelines.occlusion_layout, &entries)
        };
        let scene_uniform = buffer(gpu, bytemuck::cast_slice(&scene::floats(list, seen, &shadows, occlusion)), BufferUsages::UNIFORM, "scene")?;
        let scene_entries = [
            scene_uniform.as_entire_binding(),
            BindingResource::TextureView(&targets.shadow_array),
            BindingResource::Sampler(&pipelines.shadow_sampler),
            BindingResource::TextureView(&targets.occlusion),
            BindingResource::TextureView(&targets.shadow_array),
        ];
        let (spheres, casting_spheres) = sphere_batch(gpu, list)?;
        Ok(Frame {
            occlusion,
            view: bind_view(&eye)?,
            shadow_views: shadows.iter().map(|(_, eye)| bind_view(eye)).collect::<Result<_, _>>()?,
            scene: bind(gpu, &pipelines.scene_layout, &scene_entries),
            occlusion_raw: bind_occlusion(&targets.white),
            occlusion_blur: bind_occlusion(&targets.occlusion_raw),
            groups,
            instances,
            ground: ground(gpu, list, seen)?,
            spheres,
            casting_spheres,
            shells: shell_batch(gpu, list, &view)?,
            strokes: stroke_batch(gpu, list, false)?,
            strokes_on_top: stroke_batch(gpu, list, true)?,
        })
    }

    /// One depth map per shadow.
    pub fn draw_shadows(&self, encoder: &mut CommandEncoder, pipelines: &Pipelines, targets: &Targets) {
        for (view, layer) in self.shadow_views.iter().zip(&targets.shadow_layers) {
            let mut pass = depth_pass(encoder, "shadow", layer);
            pass.set_bind_group(0, view, &[]);
            self.draw_meshes(&mut pass, &pipelines.mesh_depth, |g| g.casters.clone());
            self.spheres.draw(&mut pass, &pipelines.sphere_depth, self.casting_spheres);
        }
    }

    /// Depth as the camera sees it, occlusion from it, and its blur.
    pub fn draw_occlusion(&self, encoder: &mut CommandEncoder, pipelines: &Pipelines, targets: &Targets) {
        {
            let mut pass = depth_pass(encoder, "view depth", &targets.view_depth);
            pass.set_bind_group(0, &self.view, &[]);
            self.draw_ground(&mut pass, &pipelines.mesh_depth);
            self.draw_meshes(&mut pass, &pipelines.mesh_depth, |g| g.all.clone());
            self.spheres.draw(&mut pass, &pipelines.sphere_depth, self.spheres.count);
        }
        let steps = [(&pipelines.occlusion, &targets.occlusion_raw, &self.occlusion_raw), (&pipelines.blur, &targets.occlusion, &self.occlusion_blur)];
        for (pipeline, target, inputs) in steps {
            let mut pass = color_pass(encoder, "occlusion", target, None, None);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.view, &[]);
            pass.set_bind_group(1, inputs, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    /// Everything, with four samples per pixel.
    pub fn draw_picture(&self, encoder: &mut CommandEncoder, pipelines: &Pipelines, targets: &Targets) {
        let mut pass = color_pass(encoder, "picture", &targets.color, Some(&targets.picture), Some(&targets.depth));
        pass.set_bind_group(0, &self.view, &[]);
        pass.set_bind_group(1, &self.scene, &[]);
        pass.set_pipeline(&pipelines.sky);
        pass.draw(0..3, 0..1);
        self.draw_meshes(&mut pass, &pipelines.mesh, |g| g.all.clone());
        self.spheres.draw(&mut pass, &pipelines.sphere, self.spheres.count);
        self.draw_ground(&mut pass, &pipelines.ground);
        self.strokes.draw(&mut pass, &pipelines.line, self.strokes.count);
        self.shells.draw(&mut pass, &pipelines.shell, self.shells.count);
        self.strokes_on_top.draw(&mut pass, &pipelines.line_on_top, self.strokes_on_top.count);
    }

    fn draw_meshes(&self, pass: &mut RenderPass, pipeline: &RenderPipeline, which: impl Fn(&Group) -> Range<u32>) {
        pass.set_pipeline(pipeline);
        pass.set_vertex_buffer(1, self.instances.slice(..));
        for group in self.groups.iter().filter(|g| !which(g).is_empty()) {
            pass.set_vertex_buffer(0, group.mesh.vertices.slice(..));
            pass.set_index_buffer(group.mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..group.mesh.count, 0, which(group));
        }
    }

    fn draw_ground(&self, pass: &mut RenderPass, pipeline: &RenderPipeline) {
        let Some((mesh, instance)) = &self.ground else { return };
        pass.set_pipeline(pipeline);
        pass.set_vertex_buffer(0, mesh.vertices.slice(..));
        pass.set_vertex_buffer(1, instance.slice(..));
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..mesh.count, 0, 0..1);
    }
}

impl Batch {
    fn new(gpu: &Gpu, floats: &[f32], count: usize, what: &'static str) -> Result<Self, RenderError> {
        Ok(Batch { buffer: vertex_buffer(gpu, floats, what)?, count: count as u32 })
    }

    /// The first `count` squares.
    fn draw(&self, pass: &mut RenderPass, pipeline: &RenderPipeline, count: u32) {
        if count > 0 {
            pass.set_pipeline(pipeline);
            pass.set_vertex_buffer(0, self.buffer.slice(..));
            pass.draw(0..4, 0..count);
        }
    }
}

fn group_instances(gpu: &Gpu, list: &DrawList, meshes: &[MeshBuffers]) -> Result<(Vec<Group>, Buffer), RenderError> {
    let mut order: Vec<usize> = (0..list.instances.len()).collect();
    order.sort_by_key(|&i| (list.instances[i].mesh, !list.instances[i].casts_shadow, i));
    let mut floats = Vec::new();
    let mut groups = Vec::new();
    let mut start = 0;
    for run in order.chunk_by(|&a, &b| list.instances[a].mesh == list.instances[b].mesh) {
        run.iter().for_each(|&i| data::instance(&list.instances[i], &mut floats));
        let casting = run.iter().filter(|&&i| list.instances[i].casts_shadow).count() as u32;
        let end = start + run.len() as u32;
        let mesh = meshes[list.instances[run[0]].mesh.0].clone();
        groups.push(Group { mesh, all: start..end, casters: start..start + casting });
        start = end;
    }
    Ok((groups, vertex_buffer(gpu, &floats, "instances")?))
}

fn ground(gpu: &Gpu, list: &DrawList, seen: Option<&Bounds>) -> Result<Option<(MeshBuffers, Buffer)>, RenderError> {
    let Some(ground) = &list.ground else { return Ok(None) };
    let [x, y, reach, _] = scene::floor(list, seen);
    let mut quad = MeshData::ground_quad(reach);
    quad.positions.iter_mut().for_each(|p| *p = [p[0] + x, p[1] + y, ground.height_m]);
    let mut floats = Vec::new();
    let placed = crate::Instance {
        mesh: crate::MeshId(0),
        pose: nalgebra::Isometry3::identity(),
        scale: nalgebra::Vector3::repeat(1.0),
        material: ground.material,
        casts_shadow: false,
    };
    data::instance(&placed, &mut floats);
    Ok(Some((MeshBuffers::new(gpu, &quad)?, vertex_buffer(gpu, &floats, "ground")?)))
}

/// Spheres that throw shadows first, and how many those are.
fn sphere_batch(gpu: &Gpu, list: &DrawList) -> Result<(Batch, u32), RenderError> {
    let mut floats = Vec::new();
    let (casting, other): (Vec<_>, Vec<_>) = list.spheres.iter().partition(|s| s.casts_shadow);
    casting.iter().chain(&other).for_each(|s| data::sphere(s, &mut floats));
    Ok((Batch::new(gpu, &floats, list.spheres.len(), "spheres")?, casting.len() as u32))
}

/// Shells from back to front, so that they blend the right way.
fn shell_batch(gpu: &Gpu, list: &DrawList, view: &Matrix4<f32>) -> Result<Batch, RenderError> {
    let mut shells: Vec<(f32, &DebugSphere)> =
        list.debug_spheres.iter().filter(|s| s.look == SphereStyle::Shell && s.radius > 0.0).map(|s| (view.transform_point(&s.center).z, s)).collect();
    shells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut floats = Vec::new();
    shells.iter().for_each(|(_, s)| data::shell(s, &mut floats));
    Batch::new(gpu, &floats, shells.len(), "shells")
}

fn stroke_batch(gpu: &Gpu, list: &DrawList, on_top: bool) -> Result<Batch, RenderError> {
    let mut floats = Vec::new();
    let wanted: Vec<_> = strokes(list).into_iter().filter(|s| s.style.on_top == on_top).collect();
    wanted.iter().for_each(|s| data::stroke(s, &mut floats));
    Batch::new(gpu, &floats, wanted.len(), "strokes")
}

fn vertex_buffer(gpu: &Gpu, floats: &[f32], what: &'static str) -> Result<Buffer, RenderError> {
    buffer(gpu, bytemuck::cast_slice(floats), BufferUsages::VERTEX, what)
}

/// A buffer with these bytes; refused beyond what the device can hold, never empty.
fn buffer(gpu: &Gpu, bytes: &[u8], usage: BufferUsages, what: &'static str) -> Result<Buffer, RenderError> {
    let cap = gpu.device.limits().max_buffer_size;
    if bytes.len() as u64 > cap {
        return Err(RenderError::TooMany { what, count: bytes.len(), cap: cap as usize });
    }
    let contents = if bytes.is_empty() { &[0; 16] } else { bytes };
    Ok(gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(what), contents, usage }))
}

fn bind(gpu: &Gpu, layout: &wgpu::BindGroupLayout, resources: &[BindingResource]) -> BindGroup {
    let entries: Vec<_> = resources.iter().enumerate().map(|(i, resource)| BindGroupEntry { binding: i as u32, resource: resource.clone() }).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn depth_pass<'e>(encoder: &'e mut CommandEncoder, label: &str, depth: &TextureView) -> RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor { label: Some(label), depth_stencil_attachment: Some(cleared(depth, wgpu::StoreOp::Store)), ..Default::default() })
}

fn color_pass<'e>(encoder: &'e mut CommandEncoder, label: &str, target: &TextureView, resolve: Option<&TextureView>, depth: Option<&TextureView>) -> RenderPass<'e> {
    let store = if resolve.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store };
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store };
    let attachment = wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: resolve, ops };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(attachment)],
        depth_stencil_attachment: depth.map(|d| cleared(d, wgpu::StoreOp::Discard)),
        ..Default::default()
    })
}

/// Depth cleared to the far plane.
fn cleared(view: &TextureView, store: wgpu::StoreOp) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store }), stencil_ops: None }
}

const _: () = assert!(MAX_SHADOWS == 4, "the shaders' array of shadows has this length");
