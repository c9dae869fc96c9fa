//! The draw list: everything a picture shows, as plain data. It is built, tested, printed and
//! compared without a GPU.

pub(crate) mod bounds;
pub(crate) mod debug;
mod quality;
mod text;
mod validate;
pub use quality::{Quality, Resolution, Shadows, UnknownQuality};
pub use validate::{MAX_ITEMS, MAX_LIGHTS, MAX_SHADOWS, MAX_TEXTURES};

pub use debug::{DebugLine, DebugPoint, DebugSphere, DebugStyle, SphereStyle};

use crate::{Camera, Image, Material, MeshData, Pattern, Shader};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// A mesh of a [`DrawList`]: its index in [`DrawList::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MeshId(pub usize);

/// A mesh placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The mesh.
    pub mesh: MeshId,
    /// Pose of the mesh's frame in the world.
    pub pose: Isometry3<f32>,
    /// Factors along the mesh's own axes, applied before the pose; none may be 0.
    pub scale: Vector3<f32>,
    /// The material.
    pub material: Material,
    /// Whether it casts shadows. A large object that only receives them, such as a floor slab,
    /// should not: shadows are sharper then.
    pub casts_shadow: bool,
}

/// A sphere, drawn by ray casting: round at every distance and cheap by the thousand.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    /// Center in the world.
    pub center: Point3<f32>,
    /// Radius, m, above 0.
    pub radius: f32,
    /// Object to world, for patterns that show rotation.
    pub orientation: UnitQuaternion<f32>,
    /// The material.
    pub material: Material,
    /// Whether it casts a shadow.
    pub casts_shadow: bool,
}

/// Spheres of one material that cast no shadow and do not turn, such as particles: drawn as [`Sphere`]s are, with less work for
/// each.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereCloud {
    /// Centers in the world and radii, m, above 0.
    pub spheres: Vec<(Point3<f32>, f32)>,
    /// A base color of each, sRGB; empty for that of the material.
    pub colors: Vec<[f32; 3]>,
    /// The material of all, which has no texture.
    pub material: Material,
}

impl SphereCloud {
    /// Returns them one by one.
    pub(crate) fn each(&self) -> impl Iterator<Item = Sphere> + '_ {
        self.spheres.iter().enumerate().map(|(i, (center, radius))| Sphere {
            center: *center,
            radius: *radius,
            orientation: UnitQuaternion::identity(),
            material: Material { color: self.colors.get(i).copied().unwrap_or(self.material.color), ..self.material },
            casts_shadow: false,
        })
    }
}

/// A transparent sphere whose matter thins out toward its rim: a puff of smoke, a flame, a drop of mist. Soft spheres are
/// drawn after all opaque items, those farther from the eye first, so their order in a list does not matter. They
/// cast and receive no shadows. An opaque surface cuts them at the plane through the center.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftSphere {
    /// Center in the world.
    pub center: Point3<f32>,
    /// Radius, m, above 0.
    pub radius: f32,
    /// Color, sRGB.
    pub color: [f32; 3],
    /// Share of the light from behind that its middle blocks, 0 to 1; above 0.999999 it counts as that, so that every
    /// one has a soft rim.
    pub opacity: f32,
    /// How light is applied: scattered by `Lit` ones, `Unlit` ones have the color itself.
    pub shader: Shader,
}

/// A capsule, drawn by ray casting like a sphere: all points within a radius of a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Capsule {
    /// Pose of its frame in the world: the middle of the segment, which lies along z.
    pub pose: Isometry3<f32>,
    /// Radius, m, above 0.
    pub radius: f32,
    /// Length of the segment, m, 0 or more.
    pub length: f32,
    /// The material.
    pub material: Material,
    /// Whether it casts a shadow.
    pub casts_shadow: bool,
}

/// A light source. Colors are sRGB. Intensity 1 with white at perpendicular incidence gives a
/// well-lit surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Parallel light, like the sun.
    Directional {
        /// Direction in which the light travels, from the source into the scene; any length above
        /// 0.
        direction: Vector3<f32>,
        /// Color.
        color: [f32; 3],
        /// Irradiance on a perpendicular surface, divided by π.
        intensity: f32,
        /// Half the angle under which the source is seen, rad: the softness of shadows (sun
        /// 0.0047).
        angular_radius_rad: f32,
        /// Whether it casts shadows.
        casts_shadow: bool,
    },
    /// A lamp. Outside the box around all shadow casters it has one shadow map. Inside it has six,
    /// and only with soft shadows. Objects closer to its center than its own radius cast no shadow.
    Point {
        /// Position in the world.
        position: Point3<f32>,
        /// Color.
        color: [f32; 3],
        /// Irradiance at a distance of 1 m, divided by π.
        intensity: f32,
        /// Radius of the source, m: the softness of shadows.
        radius_m: f32,
        /// Whether it casts shadows.
        casts_shadow: bool,
    },
}

impl Light {
    /// A sun with soft shadows that travels along `direction`.
    pub fn sun(direction: Vector3<f32>, intensity: f32) -> Self {
        Light::Directional {
            direction,
            color: [1.0, 0.97, 0.92],
            intensity,
            angular_radius_rad: 0.02,
            casts_shadow: true,
        }
    }

    /// A lamp at `position` that gives `intensity` at the distance `at_m`.
    pub fn lamp(position: Point3<f32>, intensity: f32, at_m: f32) -> Self {
        Light::Point {
            position,
            color: [1.0, 0.95, 0.87],
            intensity: intensity * at_m * at_m,
            radius_m: 0.05 * at_m,
            casts_shadow: true,
        }
    }

    /// Returns whether it is set to cast shadows.
    pub fn casts_shadow(&self) -> bool {
        match self {
            Light::Directional { casts_shadow, .. } | Light::Point { casts_shadow, .. } => *casts_shadow,
        }
    }
}

/// The surroundings of the scene: the background, the ambient light and the reflections in glossy
/// surfaces. Colors are sRGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// Straight up.
    pub zenith: [f32; 3],
    /// At eye level.
    pub horizon: [f32; 3],
    /// Straight down: light from below.
    pub ground: [f32; 3],
    /// Factor on the light of the sky, not on the background.
    pub ambient: f32,
    /// Brightness of a panel overhead that only glossy surfaces reflect, as photographers use; 0
    /// for none.
    pub softbox: f32,
    /// A flat sRGB background color that replaces the gradient; light and reflections stay.
    pub backdrop: Option<[f32; 3]>,
}

impl Default for Sky {
    fn default() -> Self {
        Sky {
            zenith: [0.42, 0.53, 0.68],
            horizon: [0.80, 0.84, 0.88],
            ground: [0.42, 0.40, 0.38],
            ambient: 1.0,
            softbox: 0.0,
            backdrop: None,
        }
    }
}

impl Sky {
    /// A dim, warm hall: for tables and lanes under lamps.
    pub fn hall() -> Self {
        Sky {
            zenith: [0.27, 0.25, 0.24],
            horizon: [0.33, 0.30, 0.28],
            ground: [0.22, 0.19, 0.17],
            ambient: 2.4,
            softbox: 5.0,
            backdrop: None,
        }
    }

    /// No ambient light and a flat backdrop: for tests and plots.
    pub fn flat(backdrop: [f32; 3]) -> Self {
        Sky {
            zenith: [0.0; 3],
            horizon: [0.0; 3],
            ground: [0.0; 3],
            ambient: 0.0,
            softbox: 0.0,
            backdrop: Some(backdrop),
        }
    }
}

/// A floor that fades into the horizon. It receives shadows and casts none.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Height of its plane, world z.
    pub height_m: f32,
    /// Distance from the middle of the visible objects at which it has faded away.
    pub reach_m: f32,
    /// The material; patterns use world coordinates.
    pub material: Material,
}

impl Ground {
    /// A gray floor at the height with a grid of 1 m.
    pub fn grid(height_m: f32) -> Self {
        let pattern = Pattern::Grid { line: [0.46, 0.47, 0.49], size_m: 1.0, width_m: 0.02 };
        Ground { height_m, reach_m: 60.0, material: Material::matte([0.60, 0.61, 0.63]).with_pattern(pattern) }
    }
}

/// Settings of the picture as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Factor on all light before tone mapping.
    pub exposure: f32,
    /// Side of a shadow map in texels (256 to 8192).
    pub shadow_map_size: u32,
    /// Reach of ambient occlusion, m: `None` for a twelfth of the radius of the visible objects;
    /// `Some(0.0)` turns it off.
    pub occlusion_m: Option<f32>,
    /// Filmic tone curve; without it light above 1 is clipped (tests and plots).
    pub tone_map: bool,
    /// How shadows are drawn.
    pub shadows: Shadows,
    /// Samples per pixel: 1, or 4 for smooth edges.
    pub samples: u32,
    /// Whether surfaces reflect the sky and have clear coats and full highlights; without it a
    /// cheap approximation is used.
    pub reflections: bool,
    /// How many of the pixels are drawn.
    pub resolution: Resolution,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            exposure: 1.0,
            shadow_map_size: 2048,
            occlusion_m: None,
            tone_map: true,
            shadows: Shadows::Soft,
            samples: 4,
            reflections: true,
            resolution: Resolution::Full,
        }
    }
}

/// Everything a picture shows.
///
/// ```
/// use tumble_render::{DrawList, Instance, Light, Material, MeshData};
/// let mut list = DrawList::default();
/// let cube = list.add_mesh(MeshData::unit_box());
/// list.add_instance(cube, nalgebra::Isometry3::translation(0.0, 0.0, 0.5), Material::plastic([0.8, 0.3, 0.2]));
/// list.lights.push(Light::sun(nalgebra::Vector3::new(0.4, 0.5, -1.0), 2.5));
/// list.camera = list.framing_camera(nalgebra::Vector3::new(-1.0, 1.5, -0.8));
/// assert!(list.to_text().contains("instance 0: mesh 0"));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrawList {
    /// Meshes by [`MeshId`]. They are shared, so that a list per frame copies nothing and the
    /// renderer uploads each once.
    pub meshes: Vec<Arc<MeshData>>,
    /// Textures, by the index in [`crate::Texture`]; shared like meshes.
    pub textures: Vec<Arc<Image>>,
    /// Placed meshes.
    pub instances: Vec<Instance>,
    /// Spheres.
    pub spheres: Vec<Sphere>,
    /// Many small spheres of one material each.
    pub clouds: Vec<SphereCloud>,
    /// Transparent spheres.
    pub soft_spheres: Vec<SoftSphere>,
    /// Capsules.
    pub capsules: Vec<Capsule>,
    /// Debug lines and arrows.
    pub lines: Vec<DebugLine>,
    /// Debug points.
    pub points: Vec<DebugPoint>,
    /// Debug spheres, as rings or translucent shells.
    pub debug_spheres: Vec<DebugSphere>,
    /// Lights, at most [`crate::MAX_LIGHTS`]; the first [`crate::MAX_SHADOWS`] that are set to cast
    /// shadows do.
    pub lights: Vec<Light>,
    /// The viewpoint.
    pub camera: Camera,
    /// The surroundings.
    pub sky: Sky,
    /// The floor.
    pub ground: Option<Ground>,
    /// Settings of the picture as a whole.
    pub settings: Settings,
}

impl DrawList {
    /// Adds a mesh for [`DrawList::add_instance`].
    pub fn add_mesh(&mut self, mesh: impl Into<Arc<MeshData>>) -> MeshId {
        self.meshes.push(mesh.into());
        MeshId(self.meshes.len() - 1)
    }

    /// Places a mesh at its own size; it casts shadows.
    pub fn add_instance(&mut self, mesh: MeshId, pose: Isometry3<f32>, material: Material) -> &mut Instance {
        self.instances.push(Instance { mesh, pose, scale: Vector3::repeat(1.0), material, casts_shadow: true });
        let last = self.instances.len() - 1;
        &mut self.instances[last]
    }

    /// Adds a sphere that casts a shadow.
    pub fn add_sphere(
        &mut self,
        center: Point3<f32>,
        radius: f32,
        orientation: UnitQuaternion<f32>,
        material: Material,
    ) -> &mut Sphere {
        self.spheres.push(Sphere { center, radius, orientation, material, casts_shadow: true });
        let last = self.spheres.len() - 1;
        &mut self.spheres[last]
    }

    /// Returns the number of spheres, those of clouds among them.
    pub fn sphere_count(&self) -> usize {
        self.spheres.len() + self.clouds.iter().map(|cloud| cloud.spheres.len()).sum::<usize>()
    }

    /// Adds a capsule of this radius (m) around a segment of this length (m). It casts a shadow.
    pub fn add_capsule(&mut self, pose: Isometry3<f32>, radius: f32, length: f32, material: Material) -> &mut Capsule {
        self.capsules.push(Capsule { pose, radius, length, material, casts_shadow: true });
        let last = self.capsules.len() - 1;
        &mut self.capsules[last]
    }
}
