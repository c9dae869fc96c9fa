//! One pipeline: its stages, vertex input, depth use and blending, and its creation from them.

use super::data::{CAPSULE_FLOATS, INSTANCE_FLOATS, SPHERE_FLOATS, SPHERE_WORDS, STROKE_FLOATS};
use super::pipelines::DEPTH;
use wgpu::{
    BindGroupLayout, BlendState, CompareFunction, Device, RenderPipeline, ShaderModule, TextureFormat, VertexFormat,
};

/// Depth test and write; nearer is greater.
#[derive(Clone, Copy)]
pub(super) struct DepthUse {
    pub compare: CompareFunction,
    pub write: bool,
    pub bias: i32,
}
pub(super) const WRITE: DepthUse = DepthUse { compare: CompareFunction::GreaterEqual, write: true, bias: 0 };
/// Slightly farther, so that objects in the plane of the floor are visible.
pub(super) const WRITE_BEHIND: DepthUse = DepthUse { bias: -1, ..WRITE };
pub(super) const TEST: DepthUse = DepthUse { write: false, ..WRITE };
pub(super) const TEST_BEHIND: DepthUse = DepthUse { write: false, ..WRITE_BEHIND };
/// At the far plane: pixels with an item.
pub(super) const WHERE_ANY: DepthUse = DepthUse { compare: CompareFunction::Less, write: false, bias: 0 };
pub(super) const ALWAYS: DepthUse = DepthUse { compare: CompareFunction::Always, write: false, bias: 0 };

/// Input of the vertex stage.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Input {
    None,
    Mesh,
    Sphere,
    /// Center, radius and index of a sphere.
    SphereBounds,
    Capsule,
    Stroke,
    /// Two integers.
    Range,
}

/// A pipeline to be created.
pub(super) struct Plan<'a> {
    /// Entry points of the vertex and the fragment stage.
    pub vs: &'a str,
    pub fs: Option<&'a str>,
    pub input: Input,
    pub color: Option<TextureFormat>,
    pub depth: Option<DepthUse>,
    pub blend: Option<BlendState>,
    /// Samples per pixel.
    pub samples: u32,
    /// Constants of the shaders, by name.
    pub constants: &'a [(&'a str, f64)],
}

impl Plan<'_> {
    /// Creates the pipeline of a shader module, with these binding layouts in the order of their
    /// groups.
    pub fn build(
        &self,
        device: &Device,
        module: &ShaderModule,
        layouts: &[Option<&BindGroupLayout>],
    ) -> RenderPipeline {
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.vs),
            bind_group_layouts: layouts,
            immediate_size: 0,
        });
        let vertex = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 8 => Float32x3];
        let rows = attributes(if self.input == Input::Mesh { 2 } else { 0 }, self.input.floats());
        let per_instance = wgpu::VertexBufferLayout {
            array_stride: 4 * self.input.floats(),
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &rows,
        };
        let per_vertex =
            wgpu::VertexBufferLayout { array_stride: 36, step_mode: wgpu::VertexStepMode::Vertex, attributes: &vertex };
        let buffers = match self.input {
            Input::None => vec![],
            Input::Mesh => vec![Some(per_vertex), Some(per_instance)],
            Input::Sphere | Input::Capsule | Input::Stroke => vec![Some(per_instance)],
            Input::SphereBounds => vec![Some(wgpu::VertexBufferLayout {
                array_stride: 4 * SPHERE_WORDS,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &SPHERE_ATTRIBUTES,
            })],
            Input::Range => vec![Some(wgpu::VertexBufferLayout {
                array_stride: 8,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &RANGE,
            })],
        };
        let strip = matches!(self.input, Input::Sphere | Input::SphereBounds | Input::Capsule | Input::Stroke);
        let write_mask =
            if self.fs == Some("fs_nothing") { wgpu::ColorWrites::empty() } else { wgpu::ColorWrites::ALL };
        let targets = [self.color.map(|format| wgpu::ColorTargetState { format, blend: self.blend, write_mask })];
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.fs.unwrap_or(self.vs)),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(self.vs),
                compilation_options: Default::default(),
                buffers: &buffers,
            },
            primitive: wgpu::PrimitiveState {
                topology: if strip {
                    wgpu::PrimitiveTopology::TriangleStrip
                } else {
                    wgpu::PrimitiveTopology::TriangleList
                },
                // of the boxes around capsules, the far sides are drawn
                cull_mode: (self.input == Input::Capsule).then_some(wgpu::Face::Front),
                ..Default::default()
            },
            depth_stencil: self.depth.map(|depth| wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(depth.write),
                depth_compare: Some(depth.compare),
                stencil: Default::default(),
                bias: wgpu::DepthBiasState {
                    constant: 64 * depth.bias,
                    slope_scale: 2.0 * depth.bias as f32,
                    clamp: 0.0,
                },
            }),
            multisample: wgpu::MultisampleState { count: self.samples, ..Default::default() },
            fragment: self.fs.map(|fs| wgpu::FragmentState {
                module,
                entry_point: Some(fs),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: self.constants,
                    ..Default::default()
                },
                targets: if self.color.is_some() { &targets } else { &[] },
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

const SPHERE_ATTRIBUTES: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Float32x4, 1 => Uint32];
const RANGE: [wgpu::VertexAttribute; 1] =
    [wgpu::VertexAttribute { format: VertexFormat::Uint32x2, offset: 0, shader_location: 0 }];

impl Input {
    pub(super) fn floats(self) -> u64 {
        match self {
            Input::None | Input::Range | Input::SphereBounds => 0,
            Input::Mesh => INSTANCE_FLOATS,
            Input::Sphere => SPHERE_FLOATS,
            Input::Capsule => CAPSULE_FLOATS,
            Input::Stroke => STROKE_FLOATS,
        }
    }
}

/// Returns as many vec4 attributes as fill `floats`, from location `first` on.
fn attributes(first: u32, floats: u64) -> Vec<wgpu::VertexAttribute> {
    (0..floats / 4)
        .map(|i| wgpu::VertexAttribute {
            format: VertexFormat::Float32x4,
            offset: 16 * i,
            shader_location: first + i as u32,
        })
        .collect()
}
