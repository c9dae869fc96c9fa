//! The shaders of pictures for software drivers: numbers of the uniforms `view` and `scene` as flat
//! inputs of the fragment stage.
//!
//! llvmpipe reads a number of a uniform for each pixel by itself, with a check of its bounds: 25
//! instructions for eight pixels, and a surface reads 40 numbers or more. An input that is the same for
//! a whole triangle is read once for 16 pixels. The values are the same, and so is every bit of a picture.
//!
//! Marks in the shaders say where:
//!
//! | mark | becomes |
//! |---|---|
//! | `//KEPT 9` in a struct | the members, from this location on |
//! | `/*KEPT*/` at the end of a constructor | their values |
//! | `//KEPT out` | the values, as members of `out` |
//! | `//TAKE` at the beginning of a fragment stage | `kept_view` and `kept_scene` are filled from `in` |
//! | `//TAKE view` | the same from the uniform `view`, for depth alone |
//!
//! Functions of fragment stages then read these instead of `view` and `scene`.

/// Number of lights in `kept_scene`; further ones are read from the uniform.
pub(super) const KEPT_LIGHTS: usize = 3;

/// The members: what a vertex stage writes. Of a view, either the origins or the directions of rays
/// change across the picture, and either footprint is 0.
const VALUES: [&str; 15 + 2 * KEPT_LIGHTS] = [
    "vec4f(view.origin_0.xyz, view.size.z)",
    "vec4f(view.dir_0.xyz, view.size.w)",
    "vec4f(select(view.origin_x.xyz, view.dir_x.xyz, view.lens.x > 0.5), view.lens.x)",
    "vec4f(select(view.origin_y.xyz, view.dir_y.xyz, view.lens.x > 0.5), select(view.lens.z, view.lens.y, view.lens.x > 0.5))",
    "view.depth",
    "vec4f(view.clip_from_world[0].w, view.clip_from_world[1].w, view.clip_from_world[2].w, view.clip_from_world[3].w)",
    "scene.zenith",
    "scene.horizon",
    "scene.ground",
    "scene.backdrop",
    "vec4f(scene.tone.xy, view.grid.x, scene.tone.w)",
    "scene.floor",
    "vec4f(scene.bounce.xyz, view.grid.y)",
    "vec4f(scene.lights[0].shadow.xy, scene.lights[1].shadow.xy)",
    "vec4f(scene.lights[2].shadow.xy, 0.0, 0.0)",
    "scene.lights[0].at",
    "scene.lights[0].color",
    "scene.lights[1].at",
    "scene.lights[1].color",
    "scene.lights[2].at",
    "scene.lights[2].color",
];

/// Largest number of inputs of a fragment stage with them: those of a mesh.
pub(super) const INPUTS: u32 = 9 + VALUES.len() as u32;

/// Members of `scene` that are kept.
const OF_SCENE: [&str; 7] = ["zenith", "horizon", "ground", "backdrop", "tone", "floor", "bounce"];

/// The numbers that a fragment stage has taken, and how it takes them.
const DECLARATION: &str = "
struct KeptScene {
    zenith: vec4f, horizon: vec4f, ground: vec4f, backdrop: vec4f, tone: vec4f, floor: vec4f, bounce: vec4f,
    light_0: Light, light_1: Light, light_2: Light,
};
var<private> kept_view: View;
var<private> kept_scene: KeptScene;
";
const TAKE: &str = "
    let perspective = v2.w > 0.5;
    kept_view.origin_0 = vec4f(v0.xyz, 0.0);
    kept_view.origin_x = vec4f(select(v2.xyz, vec3f(0.0), perspective), 0.0);
    kept_view.origin_y = vec4f(select(v3.xyz, vec3f(0.0), perspective), 0.0);
    kept_view.dir_0 = vec4f(v1.xyz, 0.0);
    kept_view.dir_x = vec4f(select(vec3f(0.0), v2.xyz, perspective), 0.0);
    kept_view.dir_y = vec4f(select(vec3f(0.0), v3.xyz, perspective), 0.0);
    kept_view.size = vec4f(0.0, 0.0, v0.w, v1.w);
    kept_view.lens = vec4f(v2.w, select(0.0, v3.w, perspective), select(v3.w, 0.0, perspective), 0.0);
    kept_view.depth = v4;
    kept_view.clip_from_world[0].w = v5.x;
    kept_view.clip_from_world[1].w = v5.y;
    kept_view.clip_from_world[2].w = v5.z;
    kept_view.clip_from_world[3].w = v5.w;
    kept_view.grid = vec4f(v10.z, v12.w, 0.0, 0.0);
    kept_scene = KeptScene(v6, v7, v8, v9, v10, v11, v12, Light(v15, v16, vec4f(v13.xy, 0.0, 0.0)),
        Light(v17, v18, vec4f(v13.zw, 0.0, 0.0)), Light(v19, v20, vec4f(v14.xy, 0.0, 0.0)));
}
";

/// A part of the shaders.
#[derive(Clone, Copy)]
pub(super) enum Part {
    /// All its functions that read `view` are of fragment stages.
    Fragment(&'static str),
    /// Those that read `view` are of vertex stages.
    Vertex(&'static str),
}

impl Part {
    /// Returns the text with its marks, which are comments.
    pub fn text(self) -> &'static str {
        match self {
            Part::Fragment(text) | Part::Vertex(text) => text,
        }
    }
}

/// Returns the shaders with flat inputs.
pub(super) fn with_flat_inputs(parts: &[Part]) -> String {
    let mut out = String::from(DECLARATION);
    let numbered = |format: &dyn Fn(usize) -> String| (0..VALUES.len()).map(format).collect::<Vec<_>>().join(", ");
    out += &format!("fn take({}) {{{TAKE}", numbered(&|k| format!("v{k}: vec4f")));
    for part in parts {
        for line in part.text().lines() {
            match line.trim() {
                "//TAKE" => out += &format!("    take({});", numbered(&|k| format!("in.kept_{k}"))),
                "//TAKE view" => {
                    let of_view = VALUES.map(|value| if value.contains("scene") { "vec4f(0.0)" } else { value });
                    out += &format!("    take({});", of_view.join(", "));
                }
                "//KEPT out" => {
                    VALUES.iter().enumerate().for_each(|(k, value)| out += &format!("    out.kept_{k} = {value};\n"))
                }
                other => match other.strip_prefix("//KEPT ").and_then(|first| first.parse::<usize>().ok()) {
                    Some(first) => {
                        out += &numbered(&|k| format!("@location({}) @interpolate(flat) kept_{k}: vec4f", first + k))
                    }
                    None => {
                        out += &with_kept_names(line, *part).replace("/*KEPT*/", &format!(", {}", VALUES.join(", ")))
                    }
                },
            }
            out.push('\n');
        }
    }
    out
}

/// Returns a line that reads the kept numbers instead of the uniforms.
fn with_kept_names(line: &str, part: Part) -> String {
    let mut line = line.to_owned();
    if let Part::Fragment(_) = part {
        line = line.replace("view.", "kept_view.");
    }
    for name in OF_SCENE {
        line = line.replace(&format!("scene.{name}"), &format!("kept_scene.{name}"));
    }
    (0..KEPT_LIGHTS).fold(line, |line, k| line.replace(&format!("scene.lights[{k}]"), &format!("kept_scene.light_{k}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Renderer;
    use crate::gpu::Pipelines;

    /// A picture with every kind of item, by shaders that read uniforms and by those with flat inputs.
    #[test]
    fn flat_inputs_change_no_bit_of_a_picture() {
        let Ok(mut renderer) = Renderer::new() else { return };
        if !renderer.gpu.flat_inputs {
            return;
        }
        let scene = "[ground]\npattern = \"wood\"\n[[body]]\nname = \"a\"\nshape = { type = \"sphere\", radius_m = 0.5 }\nposition_m = [0, 0, 0.5]\nmass_kg = 1\n\
            [[body]]\nname = \"b\"\nshape = { type = \"box\", size_m = [0.5, 0.6, 0.7] }\nposition_m = [1, 0.5, 0.5]\nmass_kg = 1\n\
            [[body]]\nname = \"c\"\nshape = { type = \"capsule\", radius_m = 0.2, length_m = 0.6 }\nposition_m = [-1, 0.2, 0.6]\nmass_kg = 1\n";
        for lights in 0..=4 {
            let light = |k: usize| {
                format!(
                    "[[light]]\ntype = \"point\"\nposition_m = [{k}, -1, 2]\nintensity = {}\n",
                    1.0 + 0.3 * k as f64
                )
            };
            let text: String = std::iter::once(scene.to_owned()).chain((0..lights).map(light)).collect();
            let scene = tumble_scene::SceneFile::parse(&text, "flat.toml").unwrap();
            let (world, _) = scene.build().unwrap();
            let mut list = crate::Drawing::new(&scene).list(&world, &crate::DebugDraw::default()).unwrap();
            list.soft_spheres.push(crate::SoftSphere {
                center: nalgebra::Point3::new(0.3, -0.5, 0.8),
                radius: 0.4,
                color: [0.9, 0.4, 0.1],
                opacity: 0.5,
                shader: crate::Shader::Lit,
            });
            for quality in ["fastest", "fast", "default", "fastest,samples=4"] {
                quality.parse::<crate::Quality>().unwrap().apply(&mut list.settings);
                let pictures = [true, false].map(|flat| {
                    renderer.pipelines = Pipelines::new(&renderer.gpu.device, true, flat);
                    renderer.render(&list, 160, 120).unwrap()
                });
                assert!(pictures[0].rgba == pictures[1].rgba, "{lights} lights, {quality}");
                let first = &pictures[0].rgba[..4];
                assert!(pictures[0].rgba.chunks_exact(4).any(|pixel| pixel != first), "something is seen");
            }
        }
    }

    #[test]
    fn every_mark_is_replaced_and_all_inputs_have_values() {
        let parts = [
            Part::Vertex(
                "struct Out {\n    //KEPT 2\n};\n    return Out(x /*KEPT*/);\n    //KEPT out\n    let w = view.size.x;",
            ),
            Part::Fragment(
                "    //TAKE\n    let a = view.size.z + scene.tone.x + scene.lights[2].at.x + scene.lights[i].at.x;",
            ),
            Part::Fragment("    //TAKE view"),
        ];
        let text = with_flat_inputs(&parts);
        assert!(!text.contains("KEPT") && !text.contains("TAKE"), "{text}");
        assert!(text.contains("kept_view.size.z + kept_scene.tone.x + kept_scene.light_2.at.x + scene.lights[i].at.x"));
        assert!(
            text.contains("let w = view.size.x;") && text.contains("@location(22) @interpolate(flat) kept_20: vec4f")
        );
        let depth_only = text.rsplit_once("take(").unwrap().1;
        assert!(depth_only.contains("view.depth") && !depth_only.contains("scene"), "{depth_only}");
    }
}
