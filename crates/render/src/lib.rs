//! Draws worlds: from a world to pixels.
//!
//! A [`DrawList`] is plain data: meshes, spheres, lights, debug lines and a [`Camera`]. It is
//! built, checked, printed and compared without a GPU. A [`Renderer`] turns it into an [`Image`]
//! with wgpu, headless. On a machine without a graphics card a software driver does the work.
//!
//! ```no_run
//! use tumble_render::{DrawList, Ground, Light, Material, Renderer};
//! use nalgebra::{Point3, UnitQuaternion, Vector3};
//! let mut list = DrawList::default();
//! list.add_sphere(Point3::new(0.0, 0.0, 0.5), 0.5, UnitQuaternion::identity(), Material::billiard_ball(9));
//! list.ground = Some(Ground::grid(0.0));
//! list.lights.push(Light::sun(Vector3::new(0.5, 0.6, -1.0), 2.5));
//! list.camera = list.framing_camera(Vector3::new(-1.0, 0.8, -0.5));
//! Renderer::new()?.render(&list, 640, 480)?.write_png("sphere.png")?;
//! # Ok::<(), tumble_render::RenderError>(())
//! ```
//!
//! Conventions: world z up, right-handed, meters, radians; colors in the list are sRGB from 0 to 1;
//! `f32` throughout. The same list on the same adapter gives the same bytes.
//!
//! Passes: depth maps of the lights that cast shadows; depth of the camera's view, and ambient
//! occlusion from it; then one pass for everything else, by default with four samples per pixel:
//! spheres, capsules, meshes, floor, backdrop, lines, translucent shells, lines on top.

mod camera;
mod caption;
mod draw;
mod error;
mod facet;
mod gpu;
mod image;
mod list;
mod material;
mod mesh;
mod orbit;
mod sliders;
mod viewer;
mod viewpoint;
mod window;

pub use camera::Camera;
pub use caption::caption;
pub use draw::{DebugDraw, Drawing, NamedView, UnknownOverlay, UnknownView, UpAxis, tree_over_mesh};
pub use error::RenderError;
pub use facet::{
    Blend, CalibrationPattern, CaveView, ColorTable, FacetView, NumberFormat, Pfm, PortableEye, PortableFacet,
    PortableFinish, PortableNumbers, PortablePass, ProjectorColor, RIM_PX, ScreenMesh, Tile, Warp, as_projected,
    calibration_picture, finished_calibration_picture, unfold,
};
pub use gpu::{
    FreeParticle, FreeParticles, GlslProgram, GlslTranslator, GpuParticles, MAX_OBSTACLES, MAX_PARTICLES, Obstacle,
    ObstacleShape, PortableDraw, PortableItems, PortableKey, PortablePicture, PortableView, Precision, Reading, Recipe,
    Renderer, Screen, Shown, Stage, Wall, portable_pass_wgsl, portable_wgsl,
};
pub use image::Image;
pub use list::{
    Capsule, DebugLine, DebugPoint, DebugSphere, DebugStyle, DrawList, Ground, Instance, Light, MAX_ITEMS, MAX_LIGHTS,
    MAX_SHADOWS, MAX_TEXTURES, MeshId, Quality, Resolution, Settings, Shadows, Sky, SoftSphere, Sphere, SphereCloud,
    SphereStyle, UnknownQuality,
};
pub use material::{Material, Pattern, Shader, Texture};
pub use mesh::{MAX_MESH_VERTICES, MeshData};
pub use sliders::{Slider, SliderPanel};
pub use viewer::{ViewError, Viewer, view, view_with};
pub use viewpoint::{Lens, Part, Viewpoint};
pub use window::{Mailbox, Next, WallApp, WallLoop, WindowApp, WindowOptions, run_window};
pub use winit;

/// Longest side of a picture, pixels; a device may allow less.
pub const MAX_SIDE: u32 = 16384;
/// Largest number of pixels of a picture; 7680 x 4320 fits.
pub const MAX_PIXELS: u64 = 1 << 25;
