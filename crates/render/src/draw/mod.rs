//! From a world and its scene to a draw list. Reads the world, never writes it.

mod overlay;
mod surface;
mod tree;

pub use overlay::{DebugDraw, UnknownOverlay};
pub use tree::{UpAxis, tree_over_mesh};

use crate::{Camera, DrawList, Ground, Light, MeshData, MeshId, RenderError, Sky};
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;
use tumble_collide::{Pose, Shape, TriMesh, Vec3};
use tumble_core::{Visual, World};
use tumble_scene::{LightKind, LightSpec, SceneFile};

/// Half the side of the square that stands for a half-space, metres.
const PLANE_M: f32 = 60.0;
/// Edges sharper than this stay sharp, radians.
const CREASE_RAD: f32 = 0.7;

/// What the filmic curve shows as white is this much light.
const LIGHT: f32 = 1.7;

/// Edges of boxes are rounded by this share of the shortest half side.
const ROUNDING: f32 = 0.06;

/// Makes draw lists of one scene; meshes are converted once and shared by all frames.
pub struct Drawing {
    meshes: BTreeMap<String, Arc<MeshData>>,
    base: DrawList,
    camera: Option<Camera>,
}

/// Meshes of one list by the key of their shape.
type Placed = BTreeMap<String, MeshId>;

impl Drawing {
    /// Camera, lights, sky and floor of the scene.
    pub fn new(scene: &SceneFile) -> Drawing {
        let mut base = DrawList { lights: scene.lights.iter().map(light).collect(), ..DrawList::default() };
        let sky = &scene.sky;
        let color = |c: [f64; 3]| c.map(|c| c as f32);
        base.sky = Sky {
            zenith: color(sky.zenith_color),
            horizon: color(sky.horizon_color),
            ground: color(sky.nadir_color),
            ambient: sky.intensity as f32,
            softbox: 3.0,
            backdrop: None,
        };
        base.ground = scene.ground.as_ref().map(|g| Ground {
            height_m: g.height_m as f32,
            reach_m: PLANE_M,
            material: surface::of_spec(&g.look),
        });
        let camera = scene.camera.as_ref().map(|c| Camera::LookAt {
            eye: Point3::from(color(c.eye_m)),
            target: Point3::from(color(c.target_m)),
            up: Vector3::from(color(c.up)),
            vertical_fov_rad: (c.vertical_fov_deg as f32).to_radians(),
            near_m: c.near_m as f32,
            far_m: c.far_m as f32,
        });
        Drawing { meshes: BTreeMap::new(), base, camera }
    }

    /// The world as it is now, with overlays.
    ///
    /// # Errors
    /// [`RenderError`] where a mesh has more vertices than can be drawn.
    pub fn list(&mut self, world: &World, overlays: &DebugDraw) -> Result<DrawList, RenderError> {
        let mut list = self.base.clone();
        let mut placed = Placed::new();
        for &id in world.ids() {
            let Some(object) = world.object(id) else { continue };
            let Some(renderable) = object.renderable().filter(|_| world.status(id).is_some_and(|s| s.alive)) else { continue };
            for visual in renderable.visuals() {
                let Some(site) = world.site(id, visual.part) else { continue };
                self.place(&mut list, &mut placed, object.name(), visual, &(site.pose * visual.pose))?;
            }
        }
        list.camera = self.camera.unwrap_or_else(|| list.framing_camera(Vector3::new(-0.5, 1.0, -0.5)));
        overlays.draw(world, &mut list);
        Ok(list)
    }

    fn place(&mut self, list: &mut DrawList, placed: &mut Placed, name: &str, visual: &Visual, pose: &Pose) -> Result<(), RenderError> {
        let material = surface::of_look(&visual.look, name);
        if let Shape::Sphere { radius } = visual.shape {
            list.add_sphere(Point3::from(small(&pose.translation.vector)), radius as f32, pose.rotation.cast(), material);
            return Ok(());
        }
        let key = key(&visual.shape);
        let mesh = match placed.get(&key) {
            Some(mesh) => *mesh,
            None => {
                let data = match self.meshes.get(&key) {
                    Some(data) => data.clone(),
                    None => self.meshes.entry(key.clone()).or_insert(Arc::new(mesh_of(&visual.shape)?)).clone(),
                };
                *placed.entry(key).or_insert(list.add_mesh(data))
            }
        };
        let pose: Isometry3<f32> = pose.cast();
        list.add_instance(mesh, pose, material).casts_shadow = !matches!(visual.shape, Shape::HalfSpace);
        Ok(())
    }
}

/// What makes two shapes share a mesh: their numbers, or the shared mesh itself.
fn key(shape: &Shape) -> String {
    match shape {
        Shape::Mesh(mesh) => format!("mesh {:p}", Arc::as_ptr(mesh)),
        Shape::Cylinder(c) => format!("cylinder {} {}", c.radius(), c.half_length()),
        other => format!("{other:?}"),
    }
}

fn mesh_of(shape: &Shape) -> Result<MeshData, RenderError> {
    Ok(match shape {
        Shape::HalfSpace => MeshData::ground_quad(PLANE_M),
        Shape::Sphere { radius } => MeshData::uv_sphere(*radius as f32, 24),
        Shape::Box { half_extents } => {
            let half = small(half_extents);
            let (half, radius) = ([half.x, half.y, half.z], ROUNDING * half.min());
            // on long thin boxes the rounding would be finer than a pixel, and glitter
            if radius < 0.2 * ROUNDING * half[0].max(half[1]).max(half[2]) { MeshData::cuboid(half) } else { MeshData::rounded_cuboid(half, radius, 2) }
        }
        Shape::Capsule { radius, half_length } => MeshData::capsule(*radius as f32, *half_length as f32, 32),
        Shape::Cylinder(c) => MeshData::cylinder(c.radius() as f32, c.half_length() as f32, 48),
        Shape::Mesh(mesh) => triangles(mesh.mesh())?,
    })
}

fn triangles(mesh: &TriMesh) -> Result<MeshData, RenderError> {
    let positions: Vec<[f32; 3]> = mesh.vertices.iter().map(|v| small(v).into()).collect();
    MeshData::from_triangles(&positions, &mesh.triangles, CREASE_RAD)
}

/// A point or vector in the renderer's precision.
fn small(v: &Vec3) -> Vector3<f32> {
    v.cast()
}

fn light(spec: &LightSpec) -> Light {
    let (color, intensity, casts_shadow) = (spec.color.map(|c| c as f32), spec.intensity as f32, spec.casts_shadow);
    match spec.kind {
        LightKind::Directional { direction } => Light::Directional {
            direction: Vector3::from(direction.map(|c| c as f32)), color, intensity: LIGHT * intensity, angular_radius_rad: 0.02, casts_shadow,
        },
        LightKind::Point { position_m } => Light::Point {
            position: Point3::from(position_m.map(|c| c as f32)), color, intensity: LIGHT * intensity, radius_m: 0.1, casts_shadow,
        },
    }
}
