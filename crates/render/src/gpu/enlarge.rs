//! Pictures that are drawn with half of the pixels in each direction and then enlarged
//! ([`Resolution::Half`](crate::Resolution)), before they are finished for a projector.
//!
//! A software driver decodes and encodes each color of an sRGB texture in the shader. It mixes the codes instead, by views
//! without that encoding; the picture differs by a level or two at edges.

use super::Gpu;
use super::frame::{bind, color_pass};
use super::pipelines::COLOR;
use super::targets::{Targets, finished_texture_for};
use wgpu::{BindGroupLayout, BindingResource, RenderPipeline, Texture, TextureFormat, TextureView};

/// Largest number of sizes whose textures are kept.
const MAX_KEPT: usize = 8;

/// The texture of a picture, and the view of it that passes read.
#[derive(Clone)]
pub struct Drawn {
    pub texture: Texture,
    pub view: TextureView,
}

impl Targets {
    /// Returns the picture as it was drawn.
    pub fn drawn(&self) -> Drawn {
        Drawn { texture: self.resolved.clone(), view: self.picture.clone() }
    }
}

/// The pass that enlarges, and its pictures.
pub struct Enlarger {
    layout: BindGroupLayout,
    pipeline: RenderPipeline,
    sampler: wgpu::Sampler,
    /// Encoding of the views that it reads and writes.
    format: TextureFormat,
    kept: Vec<Drawn>,
}

/// Returns the number of pixels that are drawn for this many.
pub fn half(pixels: u32) -> u32 {
    pixels.div_ceil(2)
}

/// Returns the format in which colors are mixed.
pub fn mixed_format(gpu: &Gpu) -> TextureFormat {
    if gpu.flat_inputs { TextureFormat::Rgba8Unorm } else { COLOR }
}

impl Enlarger {
    pub fn new(gpu: &Gpu) -> Enlarger {
        let (device, format) = (&gpu.device, mixed_format(gpu));
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let colors = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let entries = [entry(0, colors), entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering))];
        let layout = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("enlarge"), entries: &entries });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("enlarge"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../shaders/enlarge.wgsl").into()),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("enlarge"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("enlarge"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vs_enlarge"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fs_enlarge"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("enlarge"),
            mag_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Enlarger { layout, pipeline, sampler, format, kept: Vec::new() }
    }

    /// Records the pass that enlarges the picture of the targets to this size. The next picture of the same size
    /// takes the place of this one.
    pub fn enlarge(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        from: &Targets,
        [width, height]: [u32; 2],
    ) -> Drawn {
        let fits = |drawn: &Drawn| (drawn.texture.width(), drawn.texture.height()) == (width, height);
        let drawn = self.kept.iter().find(|drawn| fits(drawn)).cloned().unwrap_or_else(|| {
            let texture = finished_texture_for(gpu, "enlarged", width, height);
            let drawn = Drawn { view: texture.create_view(&Default::default()), texture };
            if self.kept.len() >= MAX_KEPT {
                self.kept.remove(0);
            }
            self.kept.push(drawn.clone());
            drawn
        });
        let mixed = wgpu::TextureViewDescriptor { format: Some(self.format), ..Default::default() };
        let [small, large] = [&from.resolved, &drawn.texture].map(|texture| texture.create_view(&mixed));
        let resources = [BindingResource::TextureView(&small), BindingResource::Sampler(&self.sampler)];
        let inputs = bind(gpu, &self.layout, &resources);
        let mut pass = color_pass(encoder, "enlarge", &large, None, None);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &inputs, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        drawn
    }
}
