//! Programs of [`PortablePicture`](super::portable::PortablePicture) for other renderers: the WGSL as it
//! is with its state, and its translation to GLSL ES 3.00 for WebGL 2.

use super::finish::FINISH_WGSL;
use super::pipeline_plan::{Input, Plan};
use super::pipelines::{EDGE_PIXELS_WGSL, EDGE_SAMPLES_WGSL, picture_wgsl};
use super::portable::PortableKey;
use crate::RenderError;
use std::collections::BTreeMap;
use wgpu::naga::back::{self, glsl};
use wgpu::naga::{self, ShaderStage, front, valid};

/// State of a program, in the words of WebGPU.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Entry point of the vertex stage.
    pub vs: &'static str,
    /// Entry point of the fragment stage; `None` for a program that draws depth alone.
    pub fs: Option<&'static str>,
    /// Values of the shaders' constants; they are for the fragment stage.
    pub constants: Vec<(&'static str, f64)>,
    /// Samples per pixel.
    pub samples: u32,
    /// Whether it has a color target.
    pub color: bool,
    /// `greater-equal` or `always`.
    pub compare: &'static str,
    /// Whether depth is written.
    pub write: bool,
    /// Depth bias: constant, and factor of the slope.
    pub bias: [i32; 2],
    /// Whether colors are blended over the target, with alpha multiplied in.
    pub blend: bool,
    /// Whether front faces are left out.
    pub cull_front: bool,
    /// Whether each instance is a strip of triangles.
    pub strip: bool,
    /// Number of vertices of an instance, if they come from no mesh.
    pub vertices: u32,
    /// Whether a mesh is drawn: positions, normals and texture coordinates at the locations 0, 1 and 8,
    /// and instances from location 2.
    pub mesh: bool,
    /// Numbers of an instance, in vectors of four; 0 without instances.
    pub floats: u32,
    /// Whether the second location is an integer that nothing reads, and there are no more.
    pub bounds: bool,
}

/// The two stages of a program as GLSL ES 3.00.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GlslProgram {
    /// Vertex stage.
    pub vertex: String,
    /// Fragment stage.
    pub fragment: String,
    /// Names of uniform blocks, and the variable of the WGSL behind each: `view` or `scene`; `place` of a
    /// pass.
    pub blocks: BTreeMap<String, String>,
    /// Names of samplers, and the texture of the WGSL behind each.
    pub textures: BTreeMap<String, String>,
}

/// A fragment stage for depth alone.
const NOTHING: &str = "#version 300 es\nprecision highp float;\nvoid main() {}\n";

impl PortableKey {
    /// Returns the state of the program.
    pub fn recipe(self) -> Recipe {
        let constants = self.constants();
        let Plan { vs, fs, input, color, depth, blend, samples, .. } = self.plan(&constants);
        let names = |name: &str| ENTRIES.iter().copied().find(|entry| *entry == name).unwrap_or("");
        let (vs, fs) = (names(vs), fs.map(names));
        let bias = depth.map_or(0, |d| d.bias);
        Recipe {
            vs,
            fs,
            samples,
            color: color.is_some(),
            compare: if depth.is_some_and(|d| d.compare == wgpu::CompareFunction::Always) {
                "always"
            } else {
                "greater-equal"
            },
            write: depth.is_some_and(|d| d.write),
            bias: [64 * bias, 2 * bias],
            blend: blend.is_some(),
            cull_front: input == Input::Capsule,
            strip: !matches!(input, Input::None | Input::Mesh),
            vertices: match input {
                Input::None => 3,
                Input::Capsule => 14,
                _ => 4,
            },
            mesh: input == Input::Mesh,
            floats: match input {
                Input::SphereBounds => super::data::SPHERE_FLOATS as u32,
                input => input.floats() as u32,
            },
            bounds: input == Input::SphereBounds,
            constants,
        }
    }
}

/// Entry points of programs.
const ENTRIES: [&str; 23] = [
    "vs_sky",
    "fs_sky",
    "vs_ground",
    "fs_ground",
    "vs_mesh",
    "fs_mesh",
    "vs_shell",
    "fs_sphere",
    "vs_capsule",
    "vs_capsule_depth",
    "fs_capsule",
    "fs_shell",
    "vs_soft",
    "fs_soft",
    "vs_line",
    "fs_line",
    "vs_mesh_depth",
    "vs_bounds",
    "fs_bounds_depth",
    "vs_near",
    "fs_near_depth",
    "fs_capsule_depth",
    "vs_sphere",
];

/// The shaders of all programs for WebGPU. With one sample per pixel, edges of spheres are whole pixels.
pub fn portable_wgsl(samples: u32) -> String {
    picture_wgsl() + if samples > 1 { EDGE_SAMPLES_WGSL } else { EDGE_PIXELS_WGSL }
}

/// The shader of the passes of a [`PortableFacet`](crate::PortableFacet) for WebGPU: the entry points
/// `vs_place`, `fs_place` and `fs_surface`.
pub fn portable_pass_wgsl() -> &'static str {
    FINISH_WGSL
}

/// Translates programs to GLSL ES 3.00.
pub struct GlslTranslator {
    pictures: Shaders,
    passes: Shaders,
}

/// Shaders that have been read.
struct Shaders {
    module: naga::Module,
    info: valid::ModuleInfo,
}

impl Shaders {
    fn read(source: &str) -> Result<Shaders, RenderError> {
        let module = front::wgsl::parse_str(source).map_err(|e| failed(&e))?;
        let mut validator = valid::Validator::new(valid::ValidationFlags::all(), valid::Capabilities::default());
        let info = validator.validate(&module).map_err(|e| failed(&e.into_inner()))?;
        Ok(Shaders { module, info })
    }
}

impl GlslTranslator {
    /// Reads the shaders.
    ///
    /// # Errors
    /// The shaders are invalid.
    pub fn new() -> Result<GlslTranslator, RenderError> {
        // without interpolation that WebGL lacks: w is 1 where it is used, so the result is the same
        let source = portable_wgsl(1).replace("@interpolate(linear)", "@interpolate(perspective)");
        Ok(GlslTranslator { pictures: Shaders::read(&source)?, passes: Shaders::read(FINISH_WGSL)? })
    }

    /// Translates the pass of a facet's picture; see [`PortablePass::is_surface`](crate::PortablePass).
    ///
    /// # Errors
    /// The pass uses what GLSL ES 3.00 lacks.
    pub fn pass(&self, is_surface: bool) -> Result<GlslProgram, RenderError> {
        let mut program = GlslProgram::default();
        let fs = if is_surface { "fs_surface" } else { "fs_place" };
        program.vertex = self.passes.stage(ShaderStage::Vertex, "vs_place", &[], &mut program)?;
        program.fragment = self.passes.stage(ShaderStage::Fragment, fs, &[], &mut program)?;
        Ok(program)
    }

    /// Translates a program.
    ///
    /// # Errors
    /// The program uses what GLSL ES 3.00 lacks.
    pub fn program(&self, key: PortableKey) -> Result<GlslProgram, RenderError> {
        let recipe = key.recipe();
        let mut program = GlslProgram { fragment: NOTHING.into(), ..GlslProgram::default() };
        program.vertex = self.pictures.stage(ShaderStage::Vertex, recipe.vs, &[], &mut program)?;
        if let Some(fs) = recipe.fs {
            program.fragment = self.pictures.stage(ShaderStage::Fragment, fs, &recipe.constants, &mut program)?;
        }
        Ok(program)
    }
}

impl Shaders {
    fn stage(
        &self,
        shader_stage: ShaderStage,
        entry_point: &str,
        constants: &[(&str, f64)],
        names: &mut GlslProgram,
    ) -> Result<String, RenderError> {
        let values = constants.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let (module, info) = back::pipeline_constants::process_overrides(
            &self.module,
            &self.info,
            Some((shader_stage, entry_point)),
            &values,
        )
        .map_err(|e| failed(&e))?;
        let options = glsl::Options {
            version: glsl::Version::Embedded { version: 300, is_webgl: true },
            ..glsl::Options::default()
        };
        let entry = glsl::PipelineOptions { shader_stage, entry_point: entry_point.into(), multiview: None };
        let mut text = String::new();
        let policies = naga::proc::BoundsCheckPolicies::default();
        let mut writer =
            glsl::Writer::new(&mut text, &module, &info, &options, &entry, policies).map_err(|e| failed(&e))?;
        let reflection = writer.write().map_err(|e| failed(&e))?;
        let variable = |handle: naga::Handle<naga::GlobalVariable>| {
            module.global_variables[handle].name.clone().unwrap_or_default()
        };
        names.blocks.extend(reflection.uniforms.into_iter().map(|(handle, name)| (name, variable(handle))));
        names.textures.extend(reflection.texture_mapping.into_iter().map(|(name, t)| (name, variable(t.texture))));
        Ok(text)
    }
}

fn failed(error: &dyn std::error::Error) -> RenderError {
    let mut reason = error.to_string();
    let mut cause = error.source();
    while let Some(inner) = cause {
        reason += &format!(": {inner}");
        cause = inner.source();
    }
    RenderError::Translation { reason }
}
