//! Shaders, binding layouts and pipelines. Layouts are created once per device, shaders and
//! pipelines when a picture first needs them. There is one for each pass, pattern and quality, so
//! that none computes what it does not show.

use super::kept::{KEPT_LIGHTS, Part, with_flat_inputs};
use super::pipeline_plan::{ALWAYS, DepthUse, Input, Plan, TEST, TEST_BEHIND, WHERE_ANY, WRITE, WRITE_BEHIND};
use crate::{DrawList, Light, Settings, Shadows};
use std::collections::BTreeMap;
use std::sync::OnceLock;
use wgpu::{
    BindGroupLayout, BindGroupLayoutEntry, BindingType, BlendState, CompareFunction, Device, RenderPipeline,
    ShaderModule, ShaderStages, TextureFormat,
};

/// The picture: linear in the shader, sRGB in memory, averaged in linear light.
pub const COLOR: TextureFormat = TextureFormat::Rgba8UnormSrgb;
/// Reversed depth needs floating point.
pub const DEPTH: TextureFormat = TextureFormat::Depth32Float;
/// Ambient occlusion.
pub const OCCLUSION: TextureFormat = TextureFormat::R8Unorm;
/// Index of the nearest sphere.
pub const ID: TextureFormat = TextureFormat::R32Uint;

/// Textures that are read, not sampled; depth textures too.
const NUMBERS: wgpu::TextureSampleType = wgpu::TextureSampleType::Float { filterable: false };

/// Everything except the edges of spheres.
const PICTURE_PARTS: [Part; 12] = [
    Part::Vertex(include_str!("../shaders/variant.wgsl")),
    Part::Fragment(include_str!("../shaders/view.wgsl")),
    Part::Vertex(include_str!("../shaders/noise.wgsl")),
    Part::Vertex(include_str!("../shaders/pattern.wgsl")),
    Part::Fragment(include_str!("../shaders/light.wgsl")),
    Part::Vertex(include_str!("../shaders/surface.wgsl")),
    Part::Vertex(include_str!("../shaders/mesh.wgsl")),
    Part::Vertex(include_str!("../shaders/sphere.wgsl")),
    Part::Fragment(include_str!("../shaders/soft.wgsl")),
    Part::Vertex(include_str!("../shaders/capsule.wgsl")),
    Part::Vertex(include_str!("../shaders/line.wgsl")),
    Part::Fragment(include_str!("../shaders/sky.wgsl")),
];

/// The shaders of pictures, except the edges of spheres.
pub(super) fn picture_wgsl() -> String {
    PICTURE_PARTS.map(Part::text).concat()
}

pub(super) const EDGE_SAMPLES_WGSL: &str = include_str!("../shaders/edge_samples.wgsl");
pub(super) const EDGE_PIXELS_WGSL: &str = include_str!("../shaders/edge_pixels.wgsl");
const OCCLUSION_WGSL: &str = concat!(include_str!("../shaders/view.wgsl"), include_str!("../shaders/occlusion.wgsl"));

/// The kind of item that a pipeline draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pass {
    Sky,
    Ground,
    Mesh,
    Sphere,
    Capsule,
    Soft,
    Shell,
    Line,
    LineOnTop,
}

/// Common properties of all pipelines of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Variant {
    pub samples: u32,
    shadows: u32,
    occlusion: bool,
    softbox: bool,
    reflections: bool,
    /// Whether the only light is directional; set only with the cheap approximation of light.
    one_sun: bool,
    /// Number of lights, or 4 if there are more than three.
    lights: u32,
}

impl Variant {
    pub fn new(list: &DrawList, shadows: Shadows, occlusion: bool) -> Self {
        let Settings { samples, reflections, .. } = list.settings;
        let one_sun = !reflections && matches!(list.lights[..], [Light::Directional { .. }]);
        Variant {
            samples,
            shadows: shadows.number(),
            occlusion,
            softbox: list.sky.softbox > 0.0 && reflections,
            reflections,
            one_sun,
            lights: list.lights.len().min(KEPT_LIGHTS + 1) as u32,
        }
    }

    /// The same with this many samples per pixel.
    pub fn with_samples(self, samples: u32) -> Self {
        Variant { samples, ..self }
    }

    /// With one sample per pixel, the nearest depth is drawn first, and only the nearest surface is
    /// lit.
    pub fn depth_first(&self) -> bool {
        self.samples == 1
    }

    /// Without occlusion, the depth of spheres is drawn first, so that the shader that lights
    /// spheres does not run for pixels without one. (Software drivers run a shader to its end after
    /// a discard, but not after a failed depth test.)
    pub fn spheres_first(&self) -> bool {
        self.depth_first() && !self.occlusion
    }
}

/// The key of a pipeline: pass, surface number ([`crate::Material`]'s), variant.
pub type Key = (Pass, u32, Variant);

/// Everything that does not change from picture to picture.
pub struct Pipelines {
    pub view_layout: BindGroupLayout,
    pub scene_layout: BindGroupLayout,
    pub occlusion_layout: BindGroupLayout,
    pub texture_layout: BindGroupLayout,
    pub shadow_sampler: wgpu::Sampler,
    device: Device,
    /// Source of the shaders, except the edges of spheres.
    common: String,
    /// Whether shaders can write which samples of a pixel they cover.
    sample_masks: bool,
    depth: OnceLock<[RenderPipeline; 5]>,
    ids: OnceLock<[RenderPipeline; 5]>,
    mesh_first: OnceLock<RenderPipeline>,
    occlusion: OnceLock<[RenderPipeline; 2]>,
    /// For several samples per pixel, and for one.
    modules: [OnceLock<ShaderModule>; 2],
    known: BTreeMap<Key, RenderPipeline>,
}

impl Pipelines {
    /// `sample_masks`: whether shaders can write which samples of a pixel they cover; `flat_inputs`: whether
    /// their fragment stages take the numbers of uniforms as inputs.
    pub fn new(device: &Device, sample_masks: bool, flat_inputs: bool) -> Self {
        // OpenGL has no interpolation without perspective; in the shaders that use it w is 1, so
        // the result is the same
        let common = if flat_inputs { with_flat_inputs(&PICTURE_PARTS) } else { picture_wgsl() };
        let common =
            if sample_masks { common } else { common.replace("@interpolate(linear)", "@interpolate(perspective)") };
        let view_layout = layout(device, "view", &[uniform(0)]);
        let scene_layout = layout(
            device,
            "scene",
            &[
                uniform(0),
                texture(1, wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2Array),
                entry(2, BindingType::Sampler(wgpu::SamplerBindingType::Comparison)),
                texture(3, NUMBERS, wgpu::TextureViewDimension::D2),
                texture(4, NUMBERS, wgpu::TextureViewDimension::D2Array),
                texture(5, wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2),
                texture(6, wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2),
            ],
        );
        let occlusion_layout = layout(
            device,
            "occlusion",
            &[
                texture(0, NUMBERS, wgpu::TextureViewDimension::D2),
                uniform(1),
                texture(2, NUMBERS, wgpu::TextureViewDimension::D2),
            ],
        );
        let filtered = wgpu::TextureSampleType::Float { filterable: true };
        let albedo = [
            texture(0, filtered, wgpu::TextureViewDimension::D2),
            entry(1, BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
        ];
        let texture_layout = layout(device, "texture", &albedo);
        Pipelines {
            shadow_sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(CompareFunction::GreaterEqual),
                ..Default::default()
            }),
            view_layout,
            scene_layout,
            occlusion_layout,
            texture_layout,
            device: device.clone(),
            common,
            sample_masks,
            depth: OnceLock::new(),
            ids: OnceLock::new(),
            mesh_first: OnceLock::new(),
            occlusion: OnceLock::new(),
            modules: Default::default(),
            known: BTreeMap::new(),
        }
    }

    /// Depth only: floor, meshes, spheres, spheres near the eye, and capsules.
    pub fn depth(&self) -> &[RenderPipeline; 5] {
        self.depth.get_or_init(|| {
            let mesh = self.depth_pipeline("vs_mesh_depth", None, Input::Mesh, None, WRITE);
            [
                mesh.clone(),
                mesh,
                self.depth_pipeline("vs_bounds", Some("fs_bounds_depth"), Input::SphereBounds, None, WRITE),
                self.depth_pipeline("vs_near", Some("fs_near_depth"), Input::SphereBounds, None, WRITE),
                self.depth_pipeline("vs_capsule_depth", Some("fs_capsule_depth"), Input::Capsule, None, WRITE),
            ]
        })
    }

    /// Depth and the index of the nearest sphere, in the order of [`Self::depth`].
    pub fn ids(&self) -> &[RenderPipeline; 5] {
        let (mesh, no_id) = ("vs_mesh_depth", Some("fs_no_id"));
        self.ids.get_or_init(|| {
            [
                self.depth_pipeline(mesh, no_id, Input::Mesh, Some(ID), WRITE_BEHIND),
                self.depth_pipeline(mesh, no_id, Input::Mesh, Some(ID), WRITE),
                self.depth_pipeline("vs_bounds", Some("fs_bounds_id"), Input::SphereBounds, Some(ID), WRITE),
                self.depth_pipeline("vs_near", Some("fs_near_id"), Input::SphereBounds, Some(ID), WRITE),
                self.depth_pipeline("vs_capsule_depth", Some("fs_capsule_no_id"), Input::Capsule, Some(ID), WRITE),
            ]
        })
    }

    /// Depth of meshes in the picture's pass.
    pub fn mesh_first(&self) -> &RenderPipeline {
        self.mesh_first.get_or_init(|| {
            let plan = Plan {
                vs: "vs_mesh_depth",
                fs: Some("fs_nothing"),
                input: Input::Mesh,
                color: Some(COLOR),
                depth: Some(WRITE),
                blend: None,
                samples: 1,
                constants: &[],
            };
            plan.build(&self.device, self.module(true), &self.picture_layouts())
        })
    }

    /// Occlusion, and its blur.
    pub fn occlusion(&self) -> &[RenderPipeline; 2] {
        self.occlusion.get_or_init(|| {
            let module = shader(&self.device, "occlusion", OCCLUSION_WGSL);
            ["fs_occlusion", "fs_blur"].map(|fs| {
                let plan = Plan {
                    vs: "vs_whole",
                    fs: Some(fs),
                    input: Input::None,
                    color: Some(OCCLUSION),
                    depth: None,
                    blend: None,
                    samples: 1,
                    constants: &[],
                };
                plan.build(&self.device, &module, &[Some(&self.view_layout), Some(&self.occlusion_layout)])
            })
        })
    }

    fn depth_pipeline(
        &self,
        vs: &str,
        fs: Option<&str>,
        input: Input,
        color: Option<TextureFormat>,
        depth: DepthUse,
    ) -> RenderPipeline {
        let plan = Plan { vs, fs, input, color, depth: Some(depth), blend: None, samples: 1, constants: &[] };
        plan.build(&self.device, self.module(true), &[Some(&self.view_layout)])
    }

    fn picture_layouts(&self) -> [Option<&BindGroupLayout>; 3] {
        [Some(&self.view_layout), Some(&self.scene_layout), Some(&self.texture_layout)]
    }

    /// The shaders for one sample per pixel, or for several.
    fn module(&self, one_sample: bool) -> &ShaderModule {
        let one_sample = one_sample || !self.sample_masks;
        let edges = if one_sample { EDGE_PIXELS_WGSL } else { EDGE_SAMPLES_WGSL };
        self.modules[usize::from(one_sample)]
            .get_or_init(|| shader(&self.device, "picture", &[&self.common, edges].concat()))
    }

    /// Creates the missing pipelines.
    pub fn prepare(&mut self, keys: impl Iterator<Item = Key>) {
        for key in keys {
            if !self.known.contains_key(&key) {
                let made = self.make(key);
                self.known.insert(key, made);
            }
        }
    }

    /// Returns a pipeline that [`Pipelines::prepare`] has created.
    pub fn of(&self, key: Key) -> Option<&RenderPipeline> {
        self.known.get(&key)
    }

    fn make(&self, (pass, surface, variant): Key) -> RenderPipeline {
        let constants = constants(surface, variant);
        let plan = plan(pass, variant, &constants);
        plan.build(&self.device, self.module(variant.depth_first()), &self.picture_layouts())
    }
}

/// Returns the plan of a pipeline that draws items in color.
pub(super) fn plan<'a>(pass: Pass, variant: Variant, constants: &'a [(&'a str, f64)]) -> Plan<'a> {
    let over = Some(BlendState::PREMULTIPLIED_ALPHA_BLENDING);
    let first = variant.depth_first();
    let (solid, behind, seen) = match (first, variant.spheres_first()) {
        (_, true) => (TEST, WRITE_BEHIND, WHERE_ANY),
        (true, _) => (TEST, TEST_BEHIND, ALWAYS),
        _ => (WRITE, WRITE_BEHIND, WRITE),
    };
    let (vs, fs, input, depth, blend) = match pass {
        // at the far plane: only pixels without an item
        Pass::Sky => ("vs_sky", "fs_sky", Input::None, TEST, None),
        Pass::Ground => ("vs_ground", "fs_ground", Input::Mesh, behind, None),
        Pass::Mesh => ("vs_mesh", "fs_mesh", Input::Mesh, solid, None),
        Pass::Sphere if first => ("vs_seen", "fs_sphere_seen", Input::Range, seen, None),
        Pass::Sphere => ("vs_sphere", "fs_sphere", Input::SphereBounds, seen, None),
        Pass::Capsule if variant.spheres_first() => ("vs_capsule", "fs_capsule", Input::Capsule, WRITE, None),
        Pass::Capsule => ("vs_capsule", "fs_capsule", Input::Capsule, solid, None),
        Pass::Soft => ("vs_soft", "fs_soft", Input::Sphere, TEST, over),
        Pass::Shell => ("vs_shell", "fs_shell", Input::Sphere, TEST, over),
        Pass::Line => ("vs_line", "fs_line", Input::Stroke, TEST, over),
        Pass::LineOnTop => ("vs_line", "fs_line", Input::Stroke, ALWAYS, over),
    };
    Plan { vs, fs: Some(fs), input, color: Some(COLOR), depth: Some(depth), blend, samples: variant.samples, constants }
}

/// Returns the constants of the shaders for a surface.
pub(super) fn constants(surface: u32, variant: Variant) -> [(&'static str, f64); 9] {
    let flag = |on: bool| f64::from(u8::from(on));
    [
        ("SURFACE", f64::from(surface % 1000)),
        ("COAT", flag(surface / 1000 % 10 == 1)),
        ("TEXTURED", flag(surface >= 10_000)),
        ("SHADOWS", f64::from(variant.shadows)),
        ("OCCLUSION", flag(variant.occlusion)),
        ("SOFTBOX", flag(variant.softbox)),
        ("REFLECTIONS", flag(variant.reflections)),
        ("ONE_SUN", flag(variant.one_sun)),
        ("LIGHTS", f64::from(variant.lights)),
    ]
}

fn shader(device: &Device, label: &str, source: &str) -> ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

fn layout(device: &Device, label: &str, entries: &[BindGroupLayoutEntry]) -> BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
}

fn entry(binding: u32, ty: BindingType) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry { binding, visibility: ShaderStages::VERTEX_FRAGMENT, ty, count: None }
}

fn uniform(binding: u32) -> BindGroupLayoutEntry {
    entry(
        binding,
        BindingType::Buffer { ty: wgpu::BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: None },
    )
}

fn texture(
    binding: u32,
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> BindGroupLayoutEntry {
    entry(binding, BindingType::Texture { sample_type, view_dimension, multisampled: false })
}
