//! The draw list: everything a picture shows, as plain data. No GPU is needed to build, test, print or compare one.

pub(crate) mod bounds;
pub(crate) mod debug;
mod quality;
mod text;
mod validate;
pub use quality::{Quality, Shadows, UnknownQuality};
pub use validate::{MAX_ITEMS, MAX_LIGHTS, MAX_SHADOWS, MAX_TEXTURES};

pub use debug::{DebugLine, DebugPoint, DebugSphere, DebugStyle, SphereStyle};

use crate::{Camera, Image, Material, MeshData, Pattern};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// A mesh of a [`DrawList`]: its place in [`DrawList::meshes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MeshId(pub usize);

/// A mesh placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Which mesh.
    pub mesh: MeshId,
    /// Pose of the mesh's frame in the world.
    pub pose: Isometry3<f32>,
    /// Factors along the mesh's own axes, applied before the pose; none may be 0.
    pub scale: Vector3<f32>,
    /// Its surface.
    pub material: Material,
    /// Whether it throws shadows. Turn off for what only receives them and is large (a floor slab): shadows are sharper then.
    pub casts_shadow: bool,
}

/// A sphere, drawn by ray casting: round at every distance and cheap by the thousand.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    /// Centre in the world.
    pub center: Point3<f32>,
    /// Radius in metres, above 0.
    pub radius: f32,
    /// Object to world, for patterns that show rotation.
    pub orientation: UnitQuaternion<f32>,
    /// Its surface.
    pub material: Material,
    /// Whether it throws a shadow.
    pub casts_shadow: bool,
}

/// A capsule, drawn by ray casting like a sphere: what lies within a radius of a segment.
#[derive(Clone, Debug, PartialEq)]
pub struct Capsule {
    /// Pose of its frame in the world: the middle of the segment, which lies along z.
    pub pose: Isometry3<f32>,
    /// Half the length of the segment in metres, 0 or more.
    pub half_length: f32,
    /// Radius in metres, above 0.
    pub radius: f32,
    /// Its surface.
    pub material: Material,
    /// Whether it throws a shadow.
    pub casts_shadow: bool,
}

/// A source of light. Colours are sRGB; intensity 1 with white is a well-lit surface at perpendicular light.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Parallel light, like the sun.
    Directional {
        /// The way the light travels (from the source into the scene); any length above 0.
        direction: Vector3<f32>,
        /// Colour.
        color: [f32; 3],
        /// Irradiance on a perpendicular surface, divided by π.
        intensity: f32,
        /// Half the angle under which the source is seen, in radians: the softness of shadows (sun 0.0047).
        angular_radius_rad: f32,
        /// Whether it throws shadows.
        casts_shadow: bool,
    },
    /// A lamp. Outside the box around everything that throws shadows one map holds them; amid it six do, and only where shadows are soft. What is nearer
    /// to its middle than its own radius throws none.
    Point {
        /// Where, in the world.
        position: Point3<f32>,
        /// Colour.
        color: [f32; 3],
        /// Irradiance at a distance of 1 m, divided by π.
        intensity: f32,
        /// Radius of the source in metres: the softness of shadows.
        radius_m: f32,
        /// Whether it throws shadows.
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

    /// Whether it is meant to throw shadows.
    pub fn casts_shadow(&self) -> bool {
        match self {
            Light::Directional { casts_shadow, .. } | Light::Point { casts_shadow, .. } => *casts_shadow,
        }
    }
}

/// What surrounds the scene: the background, the ambient light and what glossy surfaces reflect. Colours are sRGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// Straight up.
    pub zenith: [f32; 3],
    /// At eye level.
    pub horizon: [f32; 3],
    /// Straight down: what comes back from below.
    pub ground: [f32; 3],
    /// Factor of the light that the sky gives (not of the background).
    pub ambient: f32,
    /// A bright panel overhead that only glossy surfaces see, as photographers use; 0 for none.
    pub softbox: f32,
    /// One flat sRGB background colour instead of the gradient (light and reflections stay).
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

    /// No ambient light, a flat backdrop: for tests and plots.
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

/// A floor that fades into the horizon. It receives shadows and throws none.
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Height of its plane, world z.
    pub height_m: f32,
    /// How far it reaches from the middle of what is seen before it has faded away.
    pub reach_m: f32,
    /// Its surface; patterns run in world coordinates.
    pub material: Material,
}

impl Ground {
    /// A grey floor at the height with a grid of 1 m.
    pub fn grid(height_m: f32) -> Self {
        let pattern = Pattern::Grid { line: [0.46, 0.47, 0.49], size_m: 1.0, width_m: 0.02 };
        Ground { height_m, reach_m: 60.0, material: Material::matte([0.60, 0.61, 0.63]).with_pattern(pattern) }
    }
}

/// Numbers of the picture as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Factor on all light before tone mapping.
    pub exposure: f32,
    /// Side of a shadow map in texels (256 to 8192).
    pub shadow_map_size: u32,
    /// Reach of ambient occlusion in metres: `None` for a twelfth of the radius of what is seen; `Some(0.0)` turns it off.
    pub occlusion_m: Option<f32>,
    /// Filmic tone curve; without it light above 1 is cut off (tests and plots).
    pub tone_map: bool,
    /// How shadows are drawn.
    pub shadows: Shadows,
    /// Samples per pixel: 1, or 4 for smooth edges.
    pub samples: u32,
    /// Whether surfaces mirror the sky, lacquer and lamps as they should; without, light is a cheap likeness of that.
    pub reflections: bool,
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
    /// Meshes by [`MeshId`]. Shared, so that a list per frame copies nothing and the renderer uploads each once.
    pub meshes: Vec<Arc<MeshData>>,
    /// Pictures on surfaces, by the number in [`crate::Texture`]; shared like meshes.
    pub textures: Vec<Arc<Image>>,
    /// Placed meshes.
    pub instances: Vec<Instance>,
    /// Spheres.
    pub spheres: Vec<Sphere>,
    /// Capsules.
    pub capsules: Vec<Capsule>,
    /// Debug: lines and arrows.
    pub lines: Vec<DebugLine>,
    /// Debug: points.
    pub points: Vec<DebugPoint>,
    /// Debug: wire or translucent spheres.
    pub debug_spheres: Vec<DebugSphere>,
    /// Lights, at most [`crate::MAX_LIGHTS`]; the first [`crate::MAX_SHADOWS`] that throw shadows do.
    pub lights: Vec<Light>,
    /// Point of view.
    pub camera: Camera,
    /// Surroundings.
    pub sky: Sky,
    /// Floor.
    pub ground: Option<Ground>,
    /// Numbers of the picture as a whole.
    pub settings: Settings,
}

impl DrawList {
    /// Adds a mesh to place with [`DrawList::add_instance`].
    pub fn add_mesh(&mut self, mesh: impl Into<Arc<MeshData>>) -> MeshId {
        self.meshes.push(mesh.into());
        MeshId(self.meshes.len() - 1)
    }

    /// Places a mesh, at its own size, throwing shadows.
    pub fn add_instance(&mut self, mesh: MeshId, pose: Isometry3<f32>, material: Material) -> &mut Instance {
        self.instances.push(Instance { mesh, pose, scale: Vector3::repeat(1.0), material, casts_shadow: true });
        let last = self.instances.len() - 1;
        &mut self.instances[last]
    }

    /// Adds a sphere that throws a shadow.
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

    /// Adds a capsule that throws a shadow.
    pub fn add_capsule(
        &mut self,
        pose: Isometry3<f32>,
        half_length: f32,
        radius: f32,
        material: Material,
    ) -> &mut Capsule {
        self.capsules.push(Capsule { pose, half_length, radius, material, casts_shadow: true });
        let last = self.capsules.len() - 1;
        &mut self.capsules[last]
    }
}
