//! An open scene: its world, and what the page draws of it.

use crate::triangles::{self, CORNER};
use nalgebra::{Matrix4, Vector3};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use tumble_collide::{Pose, Shape, TriMesh};
use tumble_core::{Drawn, MeshKey, ObjectId, Visual, World};
use tumble_scene::{LightKind, Pattern, SceneFile, shipped};

/// Numbers of an instance: a matrix by columns, then color and opacity.
const INSTANCE: usize = 20;
/// Largest coordinate of a sphere of a cloud that is drawn, m.
const FAR_M: f64 = 1e5;
/// Largest opacity of what is not solid: the page draws with a pattern what is below 1.
const LESS_THAN_ONE: f32 = 0.999;

/// An open scene.
pub struct Session {
    /// The world.
    pub world: World,
    /// Position and normal of each corner of the triangles of all meshes.
    pub geometry: Vec<f32>,
    /// The placed meshes in the order of the description's `draws`, then the spheres of clouds: a matrix by columns, color and opacity each; 1 is solid.
    pub instances: Vec<f32>,
    /// Position, normal and color of each corner of surfaces that deform.
    pub surfaces: Vec<f32>,
    /// Visuals in the order of their meshes.
    placed: Vec<Placed>,
}

/// A visual and its mesh.
struct Placed {
    object: ObjectId,
    /// Index among the visuals of its object.
    visual: usize,
    mesh: usize,
}

impl Session {
    /// Opens a shipped scene by name, or a text. Returns it with its description as JSON.
    ///
    /// # Errors
    /// The report of a text that is no scene, or the reason why its world cannot be built.
    pub fn open(text: &str) -> Result<(Session, String), String> {
        let known = shipped().iter().find(|scene| scene.name == text.trim());
        let read = known.map_or_else(|| SceneFile::parse(text, "scene.toml"), |scene| scene.read());
        let file = read.map_err(|error| error.report(false))?;
        let (world, notes) = file.build().map_err(|error| error.to_string())?;
        let mut session =
            Session { world, geometry: Vec::new(), instances: Vec::new(), surfaces: Vec::new(), placed: Vec::new() };
        let meshes = session.place();
        let description = session.description(known.map_or("", |scene| scene.name), &file, &meshes, &notes);
        Ok((session, description.to_string()))
    }

    /// Advances by a number of frames.
    ///
    /// # Errors
    /// That of a step; the world is then at the frame before it.
    pub fn step(&mut self, frames: u32) -> Result<(), String> {
        (0..frames).try_for_each(|_| self.world.step().map(drop).map_err(|error| error.to_string()))
    }

    /// Returns 64 hexadecimal digits of BLAKE3 over the bytes of the flat state (little-endian `f64`).
    pub fn hash(&self) -> String {
        let bytes: Vec<u8> = self.world.state().iter().flat_map(|x| x.to_le_bytes()).collect();
        blake3::hash(&bytes).to_hex().to_string()
    }

    /// Makes one mesh for all visuals of equal geometry. Returns the first corner and the number of corners of each; the first mesh is
    /// the unit sphere of clouds.
    fn place(&mut self) -> Vec<[usize; 2]> {
        let mut meshes = Vec::new();
        let mut known: BTreeMap<MeshKey, usize> = BTreeMap::new();
        let sphere = triangles::of_shape(&Shape::Sphere { radius: 1.0 });
        add(&sphere, &mut self.geometry, &mut meshes);
        for &object in self.world.ids() {
            for (visual, drawn) in visuals(&self.world, object).iter().enumerate() {
                let Some(drawn) = drawn.drawn() else { continue };
                let mesh = *known.entry(MeshKey::of(drawn)).or_insert_with(|| {
                    let surface = match drawn {
                        Drawn::Shape(shape) => triangles::of_shape(shape),
                        Drawn::Mesh(mesh) => TriMesh::clone(mesh),
                    };
                    add(&surface, &mut self.geometry, &mut meshes);
                    meshes.len() - 1
                });
                self.placed.push(Placed { object, visual, mesh });
            }
        }
        self.placed.sort_by_key(|placed| placed.mesh);
        meshes
    }

    /// Writes instances and surfaces of the present state. Objects that are not enabled have no size.
    pub fn picture(&mut self) {
        self.instances.clear();
        self.surfaces.clear();
        let world = &self.world;
        let looks = world.looks();
        for placed in &self.placed {
            let visual = &visuals(world, placed.object)[placed.visual];
            let enabled = world.status(placed.object).is_some_and(|status| status.enabled);
            let matrix = match world.pose(placed.object, visual.part).filter(|_| enabled) {
                Some(pose) => (pose * visual.pose).to_homogeneous().cast(),
                None => Matrix4::zeros(),
            };
            let color = looks.colors.get(&placed.object).copied().unwrap_or(visual.appearance.color);
            push(&mut self.instances, &matrix, color);
        }
        for &id in world.ids() {
            let Some(drawn) = world.object(id).and_then(|object| object.renderable()) else { continue };
            if !world.status(id).is_some_and(|status| status.enabled) {
                continue;
            }
            if let Some(cloud) = world.state_of(id).and_then(|x| drawn.cloud(x)) {
                for sphere in cloud.spheres.filter(|sphere| sphere.center.amax() < FAR_M && sphere.radius > 0.0) {
                    let matrix = Pose::translation(sphere.center.x, sphere.center.y, sphere.center.z).to_homogeneous();
                    let matrix = matrix * Matrix4::from_diagonal(&Vector3::repeat(sphere.radius).push(1.0));
                    push(&mut self.instances, &matrix.cast(), sphere.color.unwrap_or(cloud.appearance.color));
                    if let (true, Some(opacity)) = (cloud.transparent, self.instances.last_mut()) {
                        *opacity = (sphere.opacity as f32).min(LESS_THAN_ONE);
                    }
                }
            }
            if let (Some(surface), Some(range)) = (drawn.surface(), world.view().state_range(id)) {
                let parts = &world.part_states()[range.parts.clone()];
                let points: Vec<Vector3<f32>> = parts.iter().map(|part| part.pose.translation.vector.cast()).collect();
                let mut corners = Vec::new();
                triangles::append(&points, &surface.triangles, &mut corners);
                for corner in corners.chunks_exact(CORNER) {
                    self.surfaces.extend(corner.iter().chain(&surface.appearance.color));
                }
            }
        }
    }

    /// Returns what the page needs to know once.
    fn description(&self, name: &str, file: &SceneFile, meshes: &[[usize; 2]], notes: &[String]) -> Value {
        let mut draws: Vec<[usize; 3]> = Vec::new();
        for (k, placed) in self.placed.iter().enumerate() {
            match draws.last_mut().filter(|draw| draw[0] == placed.mesh) {
                Some(draw) => draw[2] += 1,
                None => draws.push([placed.mesh, k, 1]),
            }
        }
        let lights: Vec<Value> = file
            .lights
            .iter()
            .map(|light| match light.kind {
                LightKind::Directional { direction } => {
                    json!({ "direction": direction, "color": light.color, "intensity": light.intensity })
                }
                LightKind::Point { position_m } => {
                    json!({ "position": position_m, "color": light.color, "intensity": light.intensity })
                }
            })
            .collect();
        let camera = file.camera.as_ref().map(|camera| {
            json!({ "eye": camera.eye_m, "target": camera.target_m, "up": camera.up, "fov": camera.vertical_fov_deg,
                    "near": camera.near_m, "far": camera.far_m })
        });
        let ground = file.ground.as_ref().map(|ground| {
            let look = &ground.appearance;
            let plain = look.pattern == Pattern::Plain;
            json!({ "height": ground.height_m, "color": look.color, "scale": look.pattern_scale_m,
                    "second": if plain { look.color } else { look.second_color } })
        });
        let sky = &file.sky;
        json!({
            "name": name,
            "description": file.description,
            "dt": self.world.settings().dt,
            "notes": notes,
            "meshes": meshes,
            "draws": draws,
            "placed": self.placed.len(),
            "lights": lights,
            "camera": camera,
            "ground": ground,
            "sky": { "zenith": sky.zenith_color, "horizon": sky.horizon_color, "ground": sky.nadir_color, "intensity": sky.intensity },
        })
    }
}

/// Returns the names of the shipped scenes.
pub(crate) fn scenes() -> Value {
    shipped().iter().map(|scene| scene.name).collect()
}

fn visuals(world: &World, object: ObjectId) -> &[Visual] {
    world.object(object).and_then(|object| object.renderable()).map_or(&[], |drawn| drawn.visuals())
}

fn add(mesh: &TriMesh, geometry: &mut Vec<f32>, meshes: &mut Vec<[usize; 2]>) {
    let first = geometry.len() / CORNER;
    triangles::append(&triangles::small(&mesh.vertices), &mesh.triangles, geometry);
    meshes.push([first, geometry.len() / CORNER - first]);
}

fn push(instances: &mut Vec<f32>, matrix: &Matrix4<f32>, color: [f32; 3]) {
    instances.extend(matrix.iter().chain(&color).chain(&[1.0]));
    debug_assert_eq!(instances.len() % INSTANCE, 0);
}
