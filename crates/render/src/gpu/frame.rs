//! One picture of a stage: bindings of its viewpoint, and the passes in their order.

use super::data::Eye;
use super::pipelines::Pipelines;
use super::spheres::{Choice, Which};
use super::stage::{Batch, Stage, bind_view};
use super::targets::{ShadowMaps, Targets};
use super::{Gpu, meshes::uniform_buffer};
use crate::{Lens, RenderError};
use wgpu::{BindGroup, BindGroupEntry, BindingResource, CommandEncoder, RenderPass, TextureView};

/// Device resources of one picture, in addition to its stage.
pub struct Frame<'a> {
    stage: &'a Stage,
    targets: &'a Targets,
    view: BindGroup,
    scene: BindGroup,
    occlusion_raw: BindGroup,
    occlusion_blur: BindGroup,
    /// Soft spheres and shells, in the order of this view.
    transparent: [Batch; 2],
    choice: Choice,
}

impl<'a> Frame<'a> {
    pub fn new(
        gpu: &Gpu,
        pipelines: &Pipelines,
        stage: &'a Stage,
        maps: &ShadowMaps,
        targets: &'a Targets,
        lens: &Lens,
    ) -> Result<Self, RenderError> {
        let alone = Eye::new(&lens.view, &lens.projection, targets.width, targets.height);
        let eye = lens.part.iter().fold(alone, |eye, part| eye.numbered(part));
        let reach = uniform_buffer(gpu, &[stage.reach, 0.0, 0.0, 0.0], "occlusion")?;
        let bind_occlusion = |raw: &TextureView| {
            let entries = [
                BindingResource::TextureView(&targets.view_depth),
                reach.as_entire_binding(),
                BindingResource::TextureView(raw),
            ];
            bind(gpu, &pipelines.occlusion_layout, &entries)
        };
        let scene_entries = [
            stage.scene.as_entire_binding(),
            BindingResource::TextureView(&maps.array),
            BindingResource::Sampler(&pipelines.shadow_sampler),
            BindingResource::TextureView(&targets.occlusion),
            BindingResource::TextureView(&maps.array),
            BindingResource::TextureView(&targets.ids),
            BindingResource::TextureView(&stage.spheres.appearances),
        ];
        Ok(Frame {
            view: bind_view(gpu, pipelines, &eye)?,
            scene: bind(gpu, &pipelines.scene_layout, &scene_entries),
            occlusion_raw: bind_occlusion(&targets.white),
            occlusion_blur: bind_occlusion(&targets.occlusion_raw),
            transparent: [stage.soft_from(gpu, &eye)?, stage.shells_from(gpu, &lens.view.cast())?],
            choice: stage.spheres.choose(gpu, &eye, Which::All)?,
            stage,
            targets,
        })
    }

    /// Records all passes except the shadow maps.
    pub fn draw(&self, encoder: &mut CommandEncoder, pipelines: &Pipelines) {
        let (occlusion, variant) = (self.stage.reach > 0.0, &self.stage.variant);
        if occlusion || variant.depth_first() {
            let ids = variant.depth_first().then_some(&self.targets.ids);
            let mut pass = match ids {
                Some(ids) => color_pass(
                    encoder,
                    "view depth",
                    ids,
                    None,
                    Some(cleared(&self.targets.view_depth, wgpu::StoreOp::Store)),
                ),
                None => depth_pass(encoder, "view depth", &self.targets.view_depth),
            };
            pass.set_bind_group(0, &self.view, &[]);
            if variant.spheres_first() {
                self.stage.draw_sphere_depth(&mut pass, pipelines.ids(), &self.choice);
            } else {
                self.stage.draw_view_depth(
                    &mut pass,
                    if ids.is_some() { pipelines.ids() } else { pipelines.depth() },
                    &self.choice,
                );
            }
        }
        if occlusion {
            self.draw_occlusion(encoder, pipelines);
        }
        let mut pass = self.picture_pass(encoder);
        pass.set_bind_group(0, &self.view, &[]);
        pass.set_bind_group(1, &self.scene, &[]);
        self.stage.draw_picture(&mut pass, pipelines, &self.choice, &self.transparent);
    }

    /// Occlusion from depth, and its blur.
    fn draw_occlusion(&self, encoder: &mut CommandEncoder, pipelines: &Pipelines) {
        let t = self.targets;
        let [occlusion, blur] = pipelines.occlusion();
        for (pipeline, target, inputs) in
            [(occlusion, &t.occlusion_raw, &self.occlusion_raw), (blur, &t.occlusion, &self.occlusion_blur)]
        {
            let mut pass = color_pass(encoder, "occlusion", target, None, None);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.view, &[]);
            pass.set_bind_group(1, inputs, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    fn picture_pass<'e>(&self, encoder: &'e mut CommandEncoder) -> RenderPass<'e> {
        let t = self.targets;
        match &t.samples {
            Some((color, depth)) => {
                color_pass(encoder, "picture", color, Some(&t.picture), Some(cleared(depth, wgpu::StoreOp::Discard)))
            }
            None => {
                // all depth exists and is only read, or the depth of spheres exists and the rest is
                // added
                let added = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Discard };
                let depth_ops = self.stage.variant.spheres_first().then_some(added);
                let depth =
                    wgpu::RenderPassDepthStencilAttachment { view: &t.view_depth, depth_ops, stencil_ops: None };
                color_pass(encoder, "picture", &t.picture, None, Some(depth))
            }
        }
    }
}

/// Binds resources in the order of the layout.
pub fn bind(gpu: &Gpu, layout: &wgpu::BindGroupLayout, resources: &[BindingResource]) -> BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .enumerate()
        .map(|(i, resource)| BindGroupEntry { binding: i as u32, resource: resource.clone() })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// Begins a pass that draws depth only.
pub fn depth_pass<'e>(encoder: &'e mut CommandEncoder, label: &str, depth: &TextureView) -> RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        depth_stencil_attachment: Some(cleared(depth, wgpu::StoreOp::Store)),
        ..Default::default()
    })
}

/// Begins a pass that starts black.
pub fn color_pass<'e>(
    encoder: &'e mut CommandEncoder,
    label: &str,
    target: &TextureView,
    resolve: Option<&TextureView>,
    depth: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
) -> RenderPass<'e> {
    let store = if resolve.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store };
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store };
    let attachment = wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: resolve, ops };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(attachment)],
        depth_stencil_attachment: depth,
        ..Default::default()
    })
}

/// Depth, cleared to the far plane.
fn cleared(view: &TextureView, store: wgpu::StoreOp) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store }),
        stencil_ops: None,
    }
}
