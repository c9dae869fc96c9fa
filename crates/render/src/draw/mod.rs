//! From a world and its scene to a draw list. The world is only read.

mod deforming;
mod detail;
mod looks;
mod overlay;
mod surface;
mod tree;
mod unwrap;
mod views;

pub use overlay::{DebugDraw, UnknownOverlay};
pub use tree::{UpAxis, tree_over_mesh};
pub use views::{NamedView, UnknownView};

use crate::{
    Camera, DebugStyle, DrawList, Ground, Image, Light, Material, MeshData, MeshId, Pattern, RenderError, Sky, Texture,
};
use nalgebra::{Isometry3, Point3, Vector3};
use overlay::{island_colors, sleep_colors};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tumble_collide::{Pose, Shape, TriMesh, Vec3};
use tumble_core::{Appearance, Detail, Drawn, MeshKey, Visual, VisualGeometry, World};
use tumble_scene::{LightKind, LightSpec, MeshSource, SceneFile};
use unwrap::Unwrapped;

/// Sides of ellipsoids, cones and rounded cylinders.
const SIDES: usize = 64;

/// Half the side of the square that represents a half-space, m.
const PLANE_M: f32 = 60.0;
/// Edges sharper than this stay sharp, rad.
const CREASE_RAD: f32 = 0.7;

/// Factor on light intensities: the filmic curve shows this much light as white.
const LIGHT: f32 = 1.7;

/// Radius of rounded box edges, as a fraction of the shortest half side.
const ROUNDING: f32 = 0.06;

/// Which mesh of a geometry is drawn.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Form {
    Full,
    /// With the texture coordinates of its file.
    Textured,
    /// With less detail.
    Simple,
}

/// A geometry and the form in which it is drawn.
type FormKey = (MeshKey, Form);

/// Makes draw lists of one scene. Meshes are converted once and shared by all frames.
pub struct Drawing {
    meshes: BTreeMap<FormKey, Arc<MeshData>>,
    edges: BTreeMap<MeshKey, Vec<[[f32; 3]; 2]>>,
    /// Keeps the geometry of the converted meshes in memory, because the keys contain addresses.
    sources: Vec<VisualGeometry>,
    textures: BTreeMap<Arc<Path>, Arc<Image>>,
    /// The scene's mesh files; read when a mesh with a texture occurs for the first time.
    mesh_files: Vec<PathBuf>,
    unwrapped: Option<Vec<Unwrapped>>,
    base: DrawList,
    camera: Option<Camera>,
    /// Numbers of spheres and of instances in the last list.
    spheres: usize,
    instances: usize,
    /// Detail of all objects, if set; otherwise each object has its own.
    pub detail: Option<Detail>,
}

/// Meshes of one list by the key of their shape, and textures by their file.
#[derive(Default)]
struct Placed {
    meshes: BTreeMap<FormKey, MeshId>,
    textures: BTreeMap<Arc<Path>, usize>,
}

impl Drawing {
    /// Prepares camera, lights, sky and floor of the scene.
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
            material: surface::of_spec(&g.appearance),
        });
        let camera = scene.camera.as_ref().map(|c| Camera::LookAt {
            eye: Point3::from(color(c.eye_m)),
            target: Point3::from(color(c.target_m)),
            up: Vector3::from(color(c.up)),
            vertical_fov_rad: (c.vertical_fov_deg as f32).to_radians(),
            near_m: c.near_m as f32,
            far_m: c.far_m as f32,
        });
        let mesh_files = scene
            .meshes
            .iter()
            .filter_map(|m| if let MeshSource::File { path, .. } = &m.source { Some(path.clone()) } else { None });
        Drawing {
            meshes: BTreeMap::new(),
            edges: BTreeMap::new(),
            sources: Vec::new(),
            textures: BTreeMap::new(),
            mesh_files: mesh_files.collect(),
            unwrapped: None,
            base,
            camera,
            spheres: 0,
            instances: 0,
            detail: None,
        }
    }

    /// Returns the draw list of the world's present state, with overlays.
    ///
    /// # Errors
    /// [`RenderError`] if a mesh has more vertices than can be drawn.
    pub fn list(&mut self, world: &World, overlays: &DebugDraw) -> Result<DrawList, RenderError> {
        let (mut list, looks) = (self.base.clone(), world.looks());
        looks::change_lights(&mut list, &looks);
        list.spheres.reserve(self.spheres);
        list.instances.reserve(self.instances);
        let mut placed = Placed::default();
        let tints =
            if overlays.sleep { Some(sleep_colors(world)) } else { overlays.islands.then(|| island_colors(world)) };
        for &id in world.ids() {
            let (Some(name), Some(object)) = (world.name(id), world.object(id)) else { continue };
            if !world.status(id).is_some_and(|s| s.enabled) {
                continue;
            }
            for mount in object.light().map_or(&[][..], |l| l.lights()) {
                list.lights.extend(
                    world
                        .part_state(id, mount.part)
                        .map(|part_state| views::carried_light(mount, &(part_state.pose * mount.pose))),
                );
            }
            let tint = tints.as_ref().and_then(|tints| tints.get(&id)).copied();
            for visual in object.renderable().map_or(&[][..], |r| r.visuals()) {
                let Some(part_state) = world.part_state(id, visual.part) else { continue };
                let recolored = looks::recolored(visual, looks.colors.get(&id));
                let visual = recolored.as_ref().unwrap_or(visual);
                self.place(&mut list, &mut placed, name, visual, &(part_state.pose * visual.pose), tint)?;
            }
            let Some(drawn) = object.renderable() else { continue };
            if let (Some(surface), Some(range)) = (drawn.surface(), world.view().state_range(id)) {
                let parts = &world.part_states()[range.parts.clone()];
                self.place_surface(&mut list, name, surface, parts, tint)?;
            }
            if let Some(cloud) = world.state_of(id).and_then(|x| drawn.cloud(x)) {
                deforming::place_cloud(&mut list, name, cloud, tint);
            }
        }
        (self.spheres, self.instances) = (list.spheres.len(), list.instances.len());
        list.camera = self.camera.unwrap_or_else(|| list.framing_camera(Vector3::new(-0.5, 1.0, -0.5)));
        looks::change_camera(&mut list, &looks, world)?;
        overlays.draw(world, &mut list);
        Ok(list)
    }

    fn place(
        &mut self,
        list: &mut DrawList,
        placed: &mut Placed,
        name: &str,
        visual: &Visual,
        pose: &Pose,
        tint: Option<[f32; 3]>,
    ) -> Result<(), RenderError> {
        let Some(drawn) = visual.drawn() else { return Ok(()) };
        let detail = self.detail.unwrap_or(visual.appearance.detail);
        let mut material = match tint {
            Some(color) => Material::matte(color),
            None => surface::of_appearance(&visual.appearance, name),
        };
        if detail == Detail::Full && tint.is_none() {
            material.texture = self.texture(list, placed, &visual.appearance)?;
        } else {
            material = Material { pattern: Pattern::Plain, clearcoat: 0.0, ..material };
        }
        if let (Detail::SphereTree(level), Drawn::Shape(shape)) = (detail, drawn)
            && detail::draw_tree_spheres(list, shape, level, pose, material).is_some()
        {
            return Ok(());
        }
        if detail == Detail::Wireframe {
            return self.place_edges(list, visual, drawn, pose, material.color);
        }
        if let Drawn::Shape(Shape::Sphere { radius }) = drawn {
            list.add_sphere(
                Point3::from(small(&pose.translation.vector)),
                *radius as f32,
                pose.rotation.cast(),
                material,
            );
            return Ok(());
        }
        let simple = detail == Detail::Simplified;
        if let Drawn::Shape(Shape::Capsule { radius, half_length }) = drawn
            && !simple
        {
            list.add_capsule(pose.cast(), *radius as f32, 2.0 * *half_length as f32, material);
            return Ok(());
        }
        let textured = material.texture.is_some();
        let form = match (simple, textured) {
            (true, _) => Form::Simple,
            (_, true) => Form::Textured,
            _ => Form::Full,
        };
        let key = (MeshKey::of(drawn), form);
        let mesh = match placed.meshes.get(&key) {
            Some(mesh) => *mesh,
            None => {
                let data = match self.meshes.get(&key) {
                    Some(data) => data.clone(),
                    None => {
                        let full = match if textured { self.unwrapped(drawn) } else { None } {
                            Some(unwrapped) => unwrapped?,
                            None => mesh_of(drawn)?,
                        };
                        let data = if simple { detail::simplified(&full) } else { full };
                        self.sources.push(visual.geometry.clone());
                        self.meshes.entry(key).or_insert(Arc::new(data)).clone()
                    }
                };
                *placed.meshes.entry(key).or_insert(list.add_mesh(data))
            }
        };
        let pose: Isometry3<f32> = pose.cast();
        list.add_instance(mesh, pose, material).casts_shadow = !matches!(drawn, Drawn::Shape(Shape::HalfSpace));
        Ok(())
    }
}

impl Drawing {
    /// Draws a wireframe: rings around a sphere, otherwise the edges of the mesh.
    fn place_edges(
        &mut self,
        list: &mut DrawList,
        visual: &Visual,
        drawn: Drawn<'_>,
        pose: &Pose,
        color: [f32; 3],
    ) -> Result<(), RenderError> {
        let pose: Isometry3<f32> = pose.cast();
        if let Drawn::Shape(Shape::Sphere { radius }) = drawn {
            list.wire_sphere(pose.translation.vector.into(), *radius as f32, DebugStyle::new(color).width(1.5));
            return Ok(());
        }
        let key = MeshKey::of(drawn);
        if !self.edges.contains_key(&key) {
            let mesh = match drawn {
                // without rounded edges, which would double the lines
                Drawn::Shape(Shape::Box { half_extents }) => MeshData::cuboid((2.0 * small(half_extents)).into()),
                other => mesh_of(other)?,
            };
            self.sources.push(visual.geometry.clone());
            self.edges.insert(key, detail::edges(&mesh));
        }
        detail::draw_edges(list, &self.edges[&key], &pose, color);
        Ok(())
    }

    /// Returns a mesh with the texture coordinates of its file, if it has any.
    fn unwrapped(&mut self, drawn: Drawn<'_>) -> Option<Result<MeshData, RenderError>> {
        let Drawn::Shape(Shape::Mesh(mesh)) = drawn else { return None };
        let mesh = mesh.mesh();
        let files = self
            .unwrapped
            .get_or_insert_with(|| self.mesh_files.iter().filter_map(|path| Unwrapped::load(path)).collect());
        let places = files.iter().find_map(|file| file.places_of(&mesh.triangles))?;
        Some(MeshData::from_unwrapped(&positions(mesh), &mesh.triangles, places, CREASE_RAD))
    }

    /// Adds the texture of an appearance to the list; its file is read at the first use.
    fn texture(
        &mut self,
        list: &mut DrawList,
        placed: &mut Placed,
        look: &Appearance,
    ) -> Result<Option<Texture>, RenderError> {
        let Some(path) = &look.texture else { return Ok(None) };
        let repeat_m =
            look.properties.iter().find(|(name, _)| name == "scale_m").map_or(1.0, |(_, value)| *value as f32);
        let id = match placed.textures.get(path) {
            Some(id) => *id,
            None => {
                if !self.textures.contains_key(path) {
                    self.textures.insert(path.clone(), Arc::new(Image::load_png(path)?));
                }
                list.textures.push(self.textures[path].clone());
                placed.textures.insert(path.clone(), list.textures.len() - 1);
                list.textures.len() - 1
            }
        };
        Ok(Some(Texture { id, repeat_m }))
    }
}

fn mesh_of(drawn: Drawn<'_>) -> Result<MeshData, RenderError> {
    let shape = match drawn {
        Drawn::Mesh(mesh) => return triangles(mesh),
        Drawn::Shape(shape) => shape,
    };
    Ok(match shape {
        Shape::HalfSpace => MeshData::ground_quad(2.0 * PLANE_M),
        Shape::Sphere { radius } => MeshData::uv_sphere(*radius as f32, 24),
        Shape::Box { half_extents } => {
            let half = small(half_extents);
            let (half, radius) = ([half.x, half.y, half.z], ROUNDING * half.min());
            // on long thin boxes the rounding would be finer than a pixel and flicker
            if radius < 0.2 * ROUNDING * half[0].max(half[1]).max(half[2]) {
                MeshData::cuboid(half.map(|h| 2.0 * h))
            } else {
                MeshData::rounded_cuboid(half.map(|h| 2.0 * h), radius, 2)
            }
        }
        Shape::Capsule { radius, half_length } => MeshData::capsule(*radius as f32, 2.0 * *half_length as f32, 32),
        Shape::Cylinder(c) => MeshData::cylinder(c.radius() as f32, 2.0 * c.half_length() as f32, 48),
        Shape::Mesh(mesh) => triangles(mesh.mesh())?,
        Shape::Compound(compound) => triangles(&compound.mesh())?,
        Shape::Ellipsoid { .. } | Shape::Cone { .. } | Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {
            triangles(&shape.surface_mesh(SIDES))?
        }
    })
}

fn triangles(mesh: &TriMesh) -> Result<MeshData, RenderError> {
    MeshData::from_triangles(&positions(mesh), &mesh.triangles, CREASE_RAD)
}

fn positions(mesh: &TriMesh) -> Vec<[f32; 3]> {
    mesh.vertices.iter().map(|v| small(v).into()).collect()
}

/// Converts a point or vector to the renderer's precision.
fn small(v: &Vec3) -> Vector3<f32> {
    v.cast()
}

fn light(spec: &LightSpec) -> Light {
    let (color, intensity, casts_shadow) = (spec.color.map(|c| c as f32), spec.intensity as f32, spec.casts_shadow);
    match spec.kind {
        LightKind::Directional { direction } => Light::Directional {
            direction: Vector3::from(direction.map(|c| c as f32)),
            color,
            intensity: LIGHT * intensity,
            angular_radius_rad: 0.02,
            casts_shadow,
        },
        LightKind::Point { position_m } => Light::Point {
            position: Point3::from(position_m.map(|c| c as f32)),
            color,
            intensity: LIGHT * intensity,
            radius_m: 0.1,
            casts_shadow,
        },
    }
}
