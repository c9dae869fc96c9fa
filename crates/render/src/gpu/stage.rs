//! A draw list on the device: the data that all viewpoints share.

use super::cull::PixelBox;
use super::data::{self, Eye};
use super::meshes::{MeshBuffers, MeshCache, uniform_buffer, vertex_buffer};
use super::pipelines::{Key, Pass, Pipelines, Variant};
use super::spheres::{Choice, Spheres, Which};
use super::targets::{MAX_LAYERS, ShadowMaps};
use super::{Gpu, scene};
use crate::list::bounds::Bounds;
use crate::list::debug::strokes;
use crate::{
    DebugSphere, DrawList, Instance, Material, MeshData, MeshId, RenderError, Resolution, Shadows, SoftSphere,
    SphereStyle,
};
use std::ops::Range;
use wgpu::{BindGroup, Buffer, CommandEncoder, RenderPass, RenderPipeline};

/// A list on the device, to be drawn from any number of viewpoints ([`crate::Renderer::stage`]).
/// Shadows are fitted to the whole world, for every viewpoint.
pub struct Stage {
    pub(super) serial: u64,
    pub(super) variant: Variant,
    pub(super) shadow_map_size: u32,
    /// Whether pictures are drawn with half of the pixels in each direction, and enlarged.
    pub(super) half: bool,
    pub(super) reach: f32,
    /// Each with the spheres that cast its shadows.
    pub(super) shadow_views: Vec<(BindGroup, Choice)>,
    pub(super) scene: Buffer,
    shells: Vec<DebugSphere>,
    soft_spheres: Vec<SoftSphere>,
    groups: Vec<Group>,
    instances: Buffer,
    /// With its surface and texture.
    ground: Option<(MeshBuffers, Buffer, (u32, Option<usize>))>,
    pub(super) spheres: Spheres,
    capsules: Buffer,
    capsule_groups: Vec<Same>,
    strokes: [Batch; 2],
    textures: Textures,
}

/// Textures of a list, bound.
pub(super) struct Textures {
    pub white: BindGroup,
    pub list: Vec<BindGroup>,
}

impl Textures {
    fn of(&self, number: Option<usize>) -> &BindGroup {
        number.and_then(|i| self.list.get(i)).unwrap_or(&self.white)
    }
}

/// Items with one surface, contiguous in a buffer, shadow casters first.
pub(super) struct Same {
    pub surface: u32,
    pub texture: Option<usize>,
    pub all: Range<u32>,
    pub casters: Range<u32>,
}

/// Instances of one mesh.
struct Group {
    mesh: MeshBuffers,
    same: Same,
}

/// Instances of a square.
pub struct Batch {
    pub buffer: Buffer,
    pub count: u32,
}

impl Stage {
    /// `seen`: the bounds that shadows, floor and occlusion are fitted to; `part`: whether these
    /// are of the whole world.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn new(
        gpu: &Gpu,
        pipelines: &mut Pipelines,
        meshes: &mut MeshCache,
        textures: Textures,
        list: &DrawList,
        seen: Option<&Bounds>,
        part: bool,
        serial: u64,
    ) -> Result<Self, RenderError> {
        let s = &list.settings;
        let shadows = if s.shadows == Shadows::Off { Vec::new() } else { scene::shadow_eyes(list, seen) };
        let reach = scene::occlusion_reach(list, seen, part);
        let buffers = meshes.sync(gpu, &list.meshes)?;
        let (groups, instances) = group_instances(gpu, list, &buffers)?;
        let spheres = Spheres::new(gpu, list)?;
        let (capsule_groups, order) = group_items(&list.capsules, |c| (&c.material, c.casts_shadow));
        let mut capsule_floats = Vec::with_capacity(data::CAPSULE_FLOATS as usize * order.len());
        order.iter().for_each(|&i| data::capsule(&list.capsules[i], &mut capsule_floats));
        let stage = Stage {
            serial,
            variant: Variant::new(list, if shadows.is_empty() { Shadows::Off } else { s.shadows }, reach > 0.0),
            shadow_map_size: s.shadow_map_size,
            half: s.resolution == Resolution::Half,
            reach,
            shadow_views: shadows
                .iter()
                .map(|(_, eye)| Ok((bind_view(gpu, pipelines, eye)?, spheres.choose(gpu, eye, Which::Casters)?)))
                .collect::<Result<_, RenderError>>()?,
            scene: uniform_buffer(gpu, &scene::floats(list, seen, &shadows), "scene")?,
            shells: list
                .debug_spheres
                .iter()
                .filter(|s| s.kind == SphereStyle::Shell && s.radius > 0.0)
                .cloned()
                .collect(),
            soft_spheres: list.soft_spheres.clone(),
            groups,
            instances,
            ground: ground(gpu, list, seen)?,
            spheres,
            capsules: vertex_buffer(gpu, &capsule_floats, "capsules")?,
            capsule_groups,
            textures,
            strokes: [stroke_batch(gpu, list, false)?, stroke_batch(gpu, list, true)?],
        };
        pipelines.prepare(stage.keys(gpu.choosy));
        Ok(stage)
    }

    /// The keys of all pipelines that a picture of it needs, and of those that a later one may need, whose
    /// creation would delay it. Software drivers compile at the first use in any case, and get no others.
    fn keys(&self, choosy: bool) -> impl Iterator<Item = Key> {
        let present = [
            (Pass::Sky, true),
            (Pass::Soft, !self.soft_spheres.is_empty()),
            (Pass::Shell, !self.shells.is_empty()),
            (Pass::Line, self.strokes[0].count > 0),
            (Pass::LineOnTop, self.strokes[1].count > 0),
        ];
        let fixed = present.into_iter().filter(move |(_, present)| *present || !choosy).map(|(pass, _)| (pass, 0));
        let ground = self.ground.iter().map(|(_, _, (surface, _))| (Pass::Ground, *surface));
        let meshes = self.groups.iter().map(|g| (Pass::Mesh, g.same.surface));
        let spheres = self.spheres.groups.iter().map(|g| (Pass::Sphere, g.surface));
        let capsules = self.capsule_groups.iter().map(|g| (Pass::Capsule, g.surface));
        fixed
            .chain(ground)
            .chain(meshes)
            .chain(spheres)
            .chain(capsules)
            .map(|(pass, surface)| (pass, surface, self.variant))
    }

    /// Draws one depth map per shadow.
    pub(super) fn draw_shadows(&self, encoder: &mut CommandEncoder, pipelines: &Pipelines, maps: &ShadowMaps) {
        for ((view, choice), layer) in self.shadow_views.iter().zip(&maps.layers) {
            let mut pass = super::frame::depth_pass(encoder, "shadow", layer);
            pass.set_bind_group(0, view, &[]);
            self.draw_depth(&mut pass, pipelines.depth(), choice, |same| same.casters.clone());
        }
    }

    /// Draws the depth of everything including the floor; `by` holds pipelines for floor, meshes,
    /// spheres, near spheres and capsules.
    pub(super) fn draw_view_depth(&self, pass: &mut RenderPass, by: &[RenderPipeline; 5], choice: &Choice) {
        if let Some((mesh, instance, _)) = &self.ground {
            pass.set_pipeline(&by[0]);
            draw_mesh(pass, mesh, instance, 0..1);
        }
        self.draw_depth(pass, by, choice, |same| same.all.clone());
    }

    /// Draws the depth of spheres alone, with or without the index of the nearest.
    pub(super) fn draw_sphere_depth(&self, pass: &mut RenderPass, by: &[RenderPipeline; 5], choice: &Choice) {
        pass.set_vertex_buffer(0, choice.spheres.slice(..));
        for pipeline in &by[2..if choice.near { 4 } else { 3 }] {
            pass.set_pipeline(pipeline);
            choice.ranges.iter().filter(|range| !range.is_empty()).for_each(|range| pass.draw(0..4, range.clone()));
        }
    }

    fn draw_depth(
        &self,
        pass: &mut RenderPass,
        by: &[RenderPipeline; 5],
        choice: &Choice,
        which: impl Fn(&Same) -> Range<u32>,
    ) {
        pass.set_pipeline(&by[1]);
        self.groups.iter().for_each(|g| draw_mesh(pass, &g.mesh, &self.instances, which(&g.same)));
        if !self.capsule_groups.is_empty() {
            pass.set_pipeline(&by[4]);
            pass.set_vertex_buffer(0, self.capsules.slice(..));
            self.capsule_groups
                .iter()
                .map(&which)
                .filter(|range| !range.is_empty())
                .for_each(|range| pass.draw(0..14, range));
        }
        self.draw_sphere_depth(pass, by, choice);
    }

    /// Draws everything in color, with the view's own order of transparent items: soft spheres and shells.
    pub(super) fn draw_picture(
        &self,
        pass: &mut RenderPass,
        pipelines: &Pipelines,
        choice: &Choice,
        [soft, shells]: &[Batch; 2],
    ) {
        let select = |pass: &mut RenderPass, which, surface| {
            pipelines.of((which, surface, self.variant)).map(|p| pass.set_pipeline(p)).is_some()
        };
        self.draw_spheres(pass, choice, &select);
        pass.set_bind_group(2, &self.textures.white, &[]);
        if self.variant.spheres_first() && !self.groups.is_empty() {
            pass.set_pipeline(pipelines.mesh_first());
            self.groups.iter().for_each(|g| draw_mesh(pass, &g.mesh, &self.instances, g.same.all.clone()));
        }
        for same in &self.capsule_groups {
            pass.set_bind_group(2, self.textures.of(same.texture), &[]);
            if select(pass, Pass::Capsule, same.surface) {
                pass.set_vertex_buffer(0, self.capsules.slice(..));
                pass.draw(0..14, same.all.clone());
            }
        }
        for g in &self.groups {
            pass.set_bind_group(2, self.textures.of(g.same.texture), &[]);
            if select(pass, Pass::Mesh, g.same.surface) {
                draw_mesh(pass, &g.mesh, &self.instances, g.same.all.clone());
            }
        }
        if let Some((mesh, instance, (surface, texture))) = &self.ground
            && select(pass, Pass::Ground, *surface)
        {
            pass.set_bind_group(2, self.textures.of(*texture), &[]);
            draw_mesh(pass, mesh, instance, 0..1);
        }
        pass.set_bind_group(2, &self.textures.white, &[]);
        if select(pass, Pass::Sky, 0) {
            pass.draw(0..3, 0..1);
        }
        for (which, batch) in [
            (Pass::Soft, soft),
            (Pass::Line, &self.strokes[0]),
            (Pass::Shell, shells),
            (Pass::LineOnTop, &self.strokes[1]),
        ] {
            if batch.count > 0 && select(pass, which, 0) {
                pass.set_vertex_buffer(0, batch.buffer.slice(..));
                pass.draw(0..4, 0..batch.count);
            }
        }
    }

    /// Draws spheres by surface: by squares, or all of a surface at once if the nearest is known.
    fn draw_spheres(
        &self,
        pass: &mut RenderPass,
        choice: &Choice,
        select: &impl Fn(&mut RenderPass, Pass, u32) -> bool,
    ) {
        for (i, same) in self.spheres.groups.iter().enumerate().filter(|(i, _)| !choice.ranges[*i].is_empty()) {
            pass.set_bind_group(2, self.textures.of(same.texture), &[]);
            if !select(pass, Pass::Sphere, same.surface) {
                continue;
            }
            if self.variant.depth_first() {
                scissor(pass, &choice.boxes[i]);
                pass.set_vertex_buffer(0, self.spheres.ranges.slice(..));
                pass.draw(0..3, i as u32..i as u32 + 1);
            } else {
                pass.set_vertex_buffer(0, choice.spheres.slice(..));
                pass.draw(0..4, choice.ranges[i].clone());
            }
        }
        scissor(pass, &choice.picture);
    }

    /// Orders soft spheres for a viewpoint.
    pub(super) fn soft_from(&self, gpu: &Gpu, eye: &Eye) -> Result<Batch, RenderError> {
        let floats = super::soft::far_to_near(&self.soft_spheres, eye);
        Batch::new(gpu, &floats, self.soft_spheres.len(), "soft spheres")
    }

    /// Sorts shells from back to front, so that they blend correctly.
    pub(super) fn shells_from(&self, gpu: &Gpu, view: &nalgebra::Matrix4<f32>) -> Result<Batch, RenderError> {
        let mut shells: Vec<(f32, &DebugSphere)> =
            self.shells.iter().map(|s| (view.transform_point(&s.center).z, s)).collect();
        shells.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut floats = Vec::new();
        shells.iter().for_each(|(_, s)| data::shell(s, &mut floats));
        Batch::new(gpu, &floats, shells.len(), "shells")
    }
}

impl Batch {
    fn new(gpu: &Gpu, floats: &[f32], count: usize, what: &'static str) -> Result<Self, RenderError> {
        Ok(Batch { buffer: vertex_buffer(gpu, floats, what)?, count: count as u32 })
    }
}

/// Binds a viewpoint.
pub fn bind_view(gpu: &Gpu, pipelines: &Pipelines, eye: &Eye) -> Result<BindGroup, RenderError> {
    let uniform = uniform_buffer(gpu, &eye.floats(), "view")?;
    Ok(super::frame::bind(gpu, &pipelines.view_layout, &[uniform.as_entire_binding()]))
}

/// Limits what follows to a rectangle of the picture.
fn scissor(pass: &mut RenderPass, PixelBox { from: [left, top], to: [right, bottom] }: &PixelBox) {
    pass.set_scissor_rect(*left, *top, right - left, bottom - top);
}

fn draw_mesh(pass: &mut RenderPass, mesh: &MeshBuffers, instances: &Buffer, range: Range<u32>) {
    if !range.is_empty() {
        pass.set_vertex_buffer(0, mesh.vertices.slice(..));
        pass.set_vertex_buffer(1, instances.slice(..));
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..mesh.count, 0, range);
    }
}

fn group_instances(gpu: &Gpu, list: &DrawList, meshes: &[MeshBuffers]) -> Result<(Vec<Group>, Buffer), RenderError> {
    let (groups, floats) = placed_meshes(list);
    let groups = groups.into_iter().map(|(mesh, same)| Group { mesh: meshes[mesh.0].clone(), same }).collect();
    Ok((groups, vertex_buffer(gpu, &floats, "instances")?))
}

/// Groups placed meshes by mesh and surface; returns the groups and the numbers of all instances.
pub(super) fn placed_meshes(list: &DrawList) -> (Vec<(MeshId, Same)>, Vec<f32>) {
    let items = &list.instances;
    let mut order: Vec<usize> = (0..items.len()).collect();
    let kind = |i: usize| (items[i].mesh, items[i].material.surface(), items[i].material.texture.map(|t| t.id));
    order.sort_by_key(|&i| (kind(i), !items[i].casts_shadow, i));
    let mut floats = Vec::with_capacity(data::INSTANCE_FLOATS as usize * items.len());
    order
        .iter()
        .for_each(|&i| data::instance(&items[i], !list.meshes[items[i].mesh.0].unwrapped.is_empty(), &mut floats));
    let groups = runs(&order, kind, |i| items[i].casts_shadow)
        .map(|(same, first)| (items[first].mesh, Same { surface: kind(first).1, texture: kind(first).2, ..same }))
        .collect();
    (groups, floats)
}

/// Groups spheres or capsules by surface; returns the groups and the order.
pub(super) fn group_items<T>(items: &[T], kind: impl Fn(&T) -> (&Material, bool)) -> (Vec<Same>, Vec<usize>) {
    let kinds: Vec<_> =
        items.iter().map(kind).map(|(m, casts)| ((m.surface(), m.texture.map(|t| t.id)), casts)).collect();
    let mut order: Vec<usize> = (0..items.len()).collect();
    order.sort_by_key(|&i| (kinds[i].0, !kinds[i].1, i));
    let groups = runs(&order, |i| kinds[i].0, |i| kinds[i].1)
        .map(|(same, first)| Same { surface: kinds[first].0.0, texture: kinds[first].0.1, ..same })
        .collect();
    (groups, order)
}

/// The clouds of a list, whose spheres come after all others.
pub(super) fn cloud_groups(list: &DrawList) -> impl Iterator<Item = Same> + '_ {
    let mut end = list.spheres.len() as u32;
    list.clouds.iter().map(move |cloud| {
        let start = end;
        end += cloud.spheres.len() as u32;
        Same { surface: cloud.material.surface(), texture: None, all: start..end, casters: start..start }
    })
}

/// Forms runs of one kind, with the first item of each; shadow casters come first in each run.
fn runs<K: PartialEq>(
    order: &[usize],
    kind: impl Fn(usize) -> K,
    casts: impl Fn(usize) -> bool,
) -> impl Iterator<Item = (Same, usize)> {
    let mut start = 0;
    order.chunk_by(move |&a, &b| kind(a) == kind(b)).map(move |run| {
        let casting = run.iter().filter(|&&i| casts(i)).count() as u32;
        let all = start..start + run.len() as u32;
        start = all.end;
        (Same { surface: 0, texture: None, casters: all.start..all.start + casting, all }, run[0])
    })
}

/// The ground's mesh, its single instance, and its surface and texture.
type GroundBatch = (MeshBuffers, Buffer, (u32, Option<usize>));

fn ground(gpu: &Gpu, list: &DrawList, seen: Option<&Bounds>) -> Result<Option<GroundBatch>, RenderError> {
    let Some(ground) = &list.ground else { return Ok(None) };
    let [x, y, reach, _] = scene::floor(list, seen);
    let mut quad = MeshData::ground_quad(2.0 * reach);
    quad.positions.iter_mut().for_each(|p| *p = [p[0] + x, p[1] + y, ground.height_m]);
    let mut floats = Vec::new();
    let placed = Instance {
        mesh: MeshId(0),
        pose: nalgebra::Isometry3::identity(),
        scale: nalgebra::Vector3::repeat(1.0),
        material: ground.material,
        casts_shadow: false,
    };
    data::instance(&placed, false, &mut floats);
    Ok(Some((
        MeshBuffers::new(gpu, &quad)?,
        vertex_buffer(gpu, &floats, "ground")?,
        (ground.material.surface(), ground.material.texture.map(|t| t.id)),
    )))
}

fn stroke_batch(gpu: &Gpu, list: &DrawList, on_top: bool) -> Result<Batch, RenderError> {
    let mut floats = Vec::new();
    let wanted: Vec<_> = strokes(list).into_iter().filter(|s| s.style.on_top == on_top).collect();
    wanted.iter().for_each(|s| data::stroke(s, &mut floats));
    Batch::new(gpu, &floats, wanted.len(), "strokes")
}

const _: () = assert!(MAX_LAYERS == 12, "the shaders' array of shadows has this length");
