//! A picture as plain numbers, for a program without this renderer that draws it with these shaders: a
//! web browser that shows a facet of a cave.
//!
//! ```text
//! DrawList, Viewpoint ─► PortablePicture: struct View, struct Scene, instances, meshes, draws
//! PortableKey         ─► Recipe: entry points, constants, state; or its translation to GLSL ES 3.00
//! ```
//!
//! The instances have the layout of the vertex stages. Spheres are drawn one by one instead of through
//! the index of the nearest sphere, and there is no ambient occlusion; all else is as on the device.

use super::data::{self, Eye};
use super::pipeline_plan::{Input, Plan, WRITE};
use super::pipelines::{self, Pass, Variant};
use super::scene;
use super::stage::{Same, cloud_groups, group_items, placed_meshes};
use crate::list::debug::strokes;
use crate::{
    DebugSphere, DrawList, Image, Instance, MeshData, MeshId, Part, RenderError, Shadows, SphereCloud, SphereStyle,
    Viewpoint,
};
use std::sync::{Arc, OnceLock};

/// A picture as plain numbers.
#[derive(Clone, Debug)]
pub struct PortablePicture {
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Samples per pixel, 1 or 4.
    pub samples: u32,
    /// `struct View` of the shaders.
    pub view: Vec<f32>,
    /// `struct Scene` of the shaders.
    pub scene: Vec<f32>,
    /// `struct View` of each layer of the shadow maps.
    pub shadow_views: Vec<Vec<f32>>,
    /// Side of a shadow map, texels.
    pub shadow_map_size: u32,
    /// Meshes by their index in draws.
    pub meshes: Vec<Arc<MeshData>>,
    /// Textures by their index in draws.
    pub textures: Vec<Arc<Image>>,
    /// Numbers of all instances, by the index of [`PortableItems`].
    pub items: [Vec<f32>; PortableItems::COUNT],
    /// Draws of depth alone into the shadow maps, and draws in color, each in its order.
    pub casters: Vec<PortableDraw>,
    /// See `casters`.
    pub draws: Vec<PortableDraw>,
}

/// The parts of a picture that depend on the view.
#[derive(Clone, Debug, PartialEq)]
pub struct PortableView {
    /// `struct View` of the shaders.
    pub floats: Vec<f32>,
    /// [`PortableItems::Soft`], the farthest first.
    pub soft: Vec<f32>,
    /// [`PortableItems::Shells`], the farthest first.
    pub shells: Vec<f32>,
}

impl PortableView {
    /// Makes the numbers of one view for a picture of this size.
    ///
    /// # Errors
    /// An invalid viewpoint.
    pub fn new(list: &DrawList, from: &dyn Viewpoint, [width, height]: [u32; 2]) -> Result<PortableView, RenderError> {
        let lens = from.lens(width as f32 / height as f32)?;
        let alone = Eye::new(&lens.view, &lens.projection, width, height);
        let eye = lens.part.iter().fold(alone, |eye, part| eye.numbered(&Part { rim_px: 0, ..*part }));
        let view = lens.view.cast();
        let mut spheres: Vec<_> =
            list.debug_spheres.iter().filter(|s| s.kind == SphereStyle::Shell && s.radius > 0.0).collect();
        spheres.sort_by(|a, b| depth(&view, a).total_cmp(&depth(&view, b)));
        let mut shells = Vec::new();
        spheres.iter().for_each(|s| data::shell(s, &mut shells));
        Ok(PortableView { floats: eye.floats(), soft: super::soft::far_to_near(&list.soft_spheres, &eye), shells })
    }
}

/// Returns the coordinate of a sphere along the view, which grows towards the eye.
fn depth(view: &nalgebra::Matrix4<f32>, sphere: &DebugSphere) -> f32 {
    view.transform_point(&sphere.center).z
}

/// Kinds of instances, each in an array of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PortableItems {
    /// None: the vertex stage has no input.
    Nothing,
    /// Placed meshes, 24 numbers each.
    Meshes,
    /// The floor, as a placed mesh.
    Ground,
    /// Spheres, 20 numbers each.
    Spheres,
    /// Capsules, 24 numbers each.
    Capsules,
    /// Translucent spheres, 20 numbers each.
    Shells,
    /// Lines and points, 16 numbers each.
    Strokes,
    /// Soft spheres, 20 numbers each.
    Soft,
}

impl PortableItems {
    /// Number of kinds.
    pub const COUNT: usize = 8;
}

/// Instances that one program draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PortableDraw {
    /// The program.
    pub key: PortableKey,
    /// The array of the instances.
    pub items: PortableItems,
    /// The mesh, for placed meshes and the floor.
    pub mesh: Option<usize>,
    /// The texture.
    pub texture: Option<usize>,
    /// First instance.
    pub first: u32,
    /// Number of instances.
    pub count: u32,
}

/// The key of a program: what [`recipe`](PortableKey::recipe) makes of it never changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PortableKey(pub(super) Kind);

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    MeshDepth,
    SphereDepth,
    NearSphereDepth,
    CapsuleDepth,
    Picture(Pass, u32, Variant),
}

/// The constants of the shaders for a program.
pub(super) type Constants = Vec<(&'static str, f64)>;

impl PortableKey {
    pub(super) fn constants(self) -> Constants {
        match self.0 {
            Kind::Picture(_, surface, variant) => pipelines::constants(surface, variant).to_vec(),
            _ => Vec::new(),
        }
    }

    pub(super) fn plan<'a>(self, constants: &'a [(&'a str, f64)]) -> Plan<'a> {
        let depth = |vs, fs, input| Plan {
            vs,
            fs,
            input,
            color: None,
            depth: Some(WRITE),
            blend: None,
            samples: 1,
            constants: &[],
        };
        match self.0 {
            Kind::MeshDepth => depth("vs_mesh_depth", None, Input::Mesh),
            Kind::SphereDepth => depth("vs_bounds", Some("fs_bounds_depth"), Input::SphereBounds),
            Kind::NearSphereDepth => depth("vs_near", Some("fs_near_depth"), Input::SphereBounds),
            Kind::CapsuleDepth => depth("vs_capsule_depth", Some("fs_capsule_depth"), Input::Capsule),
            // with the plans of several samples, nothing depends on a pass before
            Kind::Picture(Pass::Sphere, _, variant) => {
                let plan = pipelines::plan(Pass::Sphere, variant.with_samples(4), constants);
                Plan { vs: "vs_shell", input: Input::Sphere, samples: variant.samples, ..plan }
            }
            Kind::Picture(pass, _, variant) => {
                Plan { samples: variant.samples, ..pipelines::plan(pass, variant.with_samples(4), constants) }
            }
        }
    }
}

impl PortablePicture {
    /// Makes the numbers of a picture of this size, as [`crate::Renderer::draw_stage`] would draw it
    /// without ambient occlusion.
    ///
    /// # Errors
    /// A list that cannot be drawn, or an invalid viewpoint.
    pub fn new(list: &DrawList, from: &dyn Viewpoint, size_px: [u32; 2]) -> Result<PortablePicture, RenderError> {
        list.validate()?;
        list.meshes.iter().try_for_each(|mesh| mesh.validate())?;
        let PortableView { floats: view, soft, shells } = PortableView::new(list, from, size_px)?;
        let seen = list.whole_box();
        let settings = &list.settings;
        let shadows = match settings.shadows {
            Shadows::Off => Vec::new(),
            _ => scene::shadow_eyes(list, seen.as_ref()),
        };
        let variant = Variant::new(list, if shadows.is_empty() { Shadows::Off } else { settings.shadows }, false);
        let mut picture = PortablePicture {
            size_px,
            samples: settings.samples,
            view,
            scene: scene::floats(list, seen.as_ref(), &shadows),
            shadow_views: shadows.iter().map(|(_, eye)| eye.floats()).collect(),
            shadow_map_size: settings.shadow_map_size,
            meshes: list.meshes.clone(),
            textures: list.textures.clone(),
            items: Default::default(),
            casters: Vec::new(),
            draws: Vec::new(),
        };
        let near =
            |eye: &Eye| eye.near_any(list.spheres.iter().map(|s| (s.center, s.radius)).collect::<Vec<_>>().iter());
        let near_lamp = shadows.iter().any(|(_, eye)| near(eye));
        picture.add_spheres(list, variant, near_lamp);
        picture.add_capsules(list, variant);
        picture.add_meshes(list, variant);
        picture.add_ground(list, scene::floor(list, seen.as_ref()), variant);
        picture.draw(Pass::Sky, 0, variant, PortableItems::Nothing, None, &one());
        picture.items[PortableItems::Soft as usize] = soft;
        picture.items[PortableItems::Shells as usize] = shells;
        picture.add_soft(list, variant);
        picture.add_overlays(list, variant);
        Ok(picture)
    }

    /// Adds a draw in color.
    fn draw(
        &mut self,
        pass: Pass,
        surface: u32,
        variant: Variant,
        items: PortableItems,
        mesh: Option<usize>,
        same: &Same,
    ) {
        let key = PortableKey(Kind::Picture(pass, surface, variant));
        let (first, count) = (same.all.start, same.all.len() as u32);
        self.draws.push(PortableDraw { key, items, mesh, texture: same.texture, first, count });
    }

    /// Adds a draw into the shadow maps.
    fn cast(&mut self, kind: Kind, items: PortableItems, mesh: Option<usize>, same: &Same) {
        let (first, count) = (same.casters.start, same.casters.len() as u32);
        if count > 0 && !self.shadow_views.is_empty() {
            self.casters.push(PortableDraw { key: PortableKey(kind), items, mesh, texture: None, first, count });
        }
    }

    fn add_spheres(&mut self, list: &DrawList, variant: Variant, near_lamp: bool) {
        let (mut groups, order) = group_items(&list.spheres, |s| (&s.material, s.casts_shadow));
        groups.extend(cloud_groups(list));
        let floats = &mut self.items[PortableItems::Spheres as usize];
        order.iter().for_each(|&i| data::sphere_floats(&list.spheres[i], floats));
        list.clouds.iter().flat_map(SphereCloud::each).for_each(|sphere| data::sphere_floats(&sphere, floats));
        for same in &groups {
            self.draw(Pass::Sphere, same.surface, variant, PortableItems::Spheres, None, same);
            self.cast(Kind::SphereDepth, PortableItems::Spheres, None, same);
            if near_lamp {
                self.cast(Kind::NearSphereDepth, PortableItems::Spheres, None, same);
            }
        }
    }

    fn add_capsules(&mut self, list: &DrawList, variant: Variant) {
        let (groups, order) = group_items(&list.capsules, |c| (&c.material, c.casts_shadow));
        let floats = &mut self.items[PortableItems::Capsules as usize];
        order.iter().for_each(|&i| data::capsule(&list.capsules[i], floats));
        for same in &groups {
            self.draw(Pass::Capsule, same.surface, variant, PortableItems::Capsules, None, same);
            self.cast(Kind::CapsuleDepth, PortableItems::Capsules, None, same);
        }
    }

    fn add_meshes(&mut self, list: &DrawList, variant: Variant) {
        let (groups, floats) = placed_meshes(list);
        self.items[PortableItems::Meshes as usize] = floats;
        for (MeshId(mesh), same) in &groups {
            self.draw(Pass::Mesh, same.surface, variant, PortableItems::Meshes, Some(*mesh), same);
            self.cast(Kind::MeshDepth, PortableItems::Meshes, Some(*mesh), same);
        }
    }

    /// Adds the floor: one square for all floors, scaled and placed.
    fn add_ground(&mut self, list: &DrawList, [x, y, reach, height]: [f32; 4], variant: Variant) {
        static SQUARE: OnceLock<Arc<MeshData>> = OnceLock::new();
        let Some(ground) = &list.ground else { return };
        let placed = Instance {
            mesh: MeshId(self.meshes.len()),
            pose: nalgebra::Isometry3::translation(x, y, height),
            scale: nalgebra::Vector3::new(2.0 * reach, 2.0 * reach, 1.0),
            material: ground.material,
            casts_shadow: false,
        };
        data::instance(&placed, false, &mut self.items[PortableItems::Ground as usize]);
        self.meshes.push(SQUARE.get_or_init(|| Arc::new(MeshData::ground_quad(1.0))).clone());
        let (surface, texture) = (ground.material.surface(), ground.material.texture.map(|t| t.id));
        let same = Same { texture, ..one() };
        self.draw(Pass::Ground, surface, variant, PortableItems::Ground, Some(placed.mesh.0), &same);
    }

    /// Adds soft spheres, the farthest first.
    fn add_soft(&mut self, list: &DrawList, variant: Variant) {
        let all = 0..list.soft_spheres.len() as u32;
        if !all.is_empty() {
            let same = Same { surface: 0, texture: None, casters: 0..0, all };
            self.draw(Pass::Soft, 0, variant, PortableItems::Soft, None, &same);
        }
    }

    /// Adds lines, translucent spheres from back to front, and lines on top.
    fn add_overlays(&mut self, list: &DrawList, variant: Variant) {
        let shells = self.items[PortableItems::Shells as usize].len() / data::SPHERE_FLOATS as usize;
        let (on_top, behind): (Vec<_>, Vec<_>) = strokes(list).into_iter().partition(|s| s.style.on_top);
        let floats = &mut self.items[PortableItems::Strokes as usize];
        behind.iter().chain(&on_top).for_each(|s| data::stroke(s, floats));
        let (lines, all) = (behind.len() as u32, (behind.len() + on_top.len()) as u32);
        for (pass, items, range) in [
            (Pass::Line, PortableItems::Strokes, 0..lines),
            (Pass::Shell, PortableItems::Shells, 0..shells as u32),
            (Pass::LineOnTop, PortableItems::Strokes, lines..all),
        ] {
            if !range.is_empty() {
                self.draw(
                    pass,
                    0,
                    variant,
                    items,
                    None,
                    &Same { surface: 0, texture: None, casters: 0..0, all: range },
                );
            }
        }
    }
}

/// One item.
fn one() -> Same {
    Same { surface: 0, texture: None, all: 0..1, casters: 0..0 }
}
