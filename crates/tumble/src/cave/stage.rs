//! Scene, environment and cave of a run, as the server and every facet build them.

use super::args::Stage;
use crate::failure::Failure;
use std::path::Path;
use tumble::collide::Pose;
use tumble::core::{Mode, World};
use tumble::net::sync::transport::MAX_FACETS;
use tumble::net::sync::{User, Viewer, scene_hash};
use tumble::render::CaveView;
use tumble::scene::cave::{Cave, resolve_cave};
use tumble::scene::{CavePlace, SceneFile, ShapeSpec, WorldSettings, resolve_scene};

/// Name of the seat of the one process that draws a preview.
pub const PREVIEW: &str = "preview";

/// What all processes of a run have in common.
pub struct Setting {
    pub scene: SceneFile,
    pub cave: Cave,
    /// As the files make it, before the first step.
    pub world: World,
    /// By which they know that they mean the same.
    pub hash: [u8; 32],
    /// What is worth saying.
    pub notes: Vec<String>,
}

impl Setting {
    /// Reads the files and builds the world, whose settings `adapt` may change: time and method are the server's alone, and nothing that is seen at
    /// the start depends on them.
    pub fn load(stage: &Stage, adapt: impl FnOnce(&mut WorldSettings)) -> Result<Setting, Failure> {
        let mut scene = resolve_scene(&stage.scene, &[])?.load()?;
        adapt(&mut scene.world);
        let cave = resolve_cave(&stage.cave)?.load()?;
        if cave.facets.len() > MAX_FACETS {
            return Err(Failure::input(format!("{}: a run has at most {MAX_FACETS} facets, this cave has {}", cave.file, cave.facets.len())));
        }
        let mut notes = Vec::new();
        if let Some(name) = &stage.environment {
            surround(&mut scene, resolve_scene(name, &[])?.load()?, &mut notes)?;
        }
        let (world, built) = scene.build().map_err(Failure::input)?;
        notes.extend(built);
        // everything that is drawn and stands in no body
        let seen = format!("{:?} {:?} {:?} {:?} {:?}", scene.camera, scene.cave, scene.lights, scene.sky, scene.ground);
        let hash = scene_hash(&seen, &world);
        Ok(Setting { scene, cave, world, hash, notes })
    }

    /// The cave at its place in the scene.
    pub fn view(&self) -> Result<CaveView, Failure> {
        CaveView::new(self.cave.clone(), &self.scene).map_err(Failure::input)
    }

    /// Who looks, as the files say.
    pub fn viewer(&self) -> Result<Viewer, Failure> {
        let view = self.view()?;
        let users = self.cave.users.iter().map(|user| User { head: head_of(user), interpupillary_m: user.interpupillary_m, input: 0 }).collect();
        Ok(Viewer { users, cave: pose_of(view.place()), scale: view.place().scale })
    }
}

/// Stands the cave and its users in the view as the viewer of a frame has them.
pub fn follow(view: &mut CaveView, viewer: &Viewer) {
    view.stand(place_of(&viewer.cave, viewer.scale));
    for (user, seen) in view.users_mut().iter_mut().zip(&viewer.users) {
        user.eye_m = seen.head.translation.vector.into();
        user.forward = seen.head.rotation * nalgebra::Vector3::y();
        user.up = seen.head.rotation * nalgebra::Vector3::z();
        user.interpupillary_m = seen.interpupillary_m;
    }
}

/// A cave's place as a pose: `x_scene = pose · (scale · x_cave)`.
pub fn pose_of(place: &CavePlace) -> Pose {
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), place.heading_deg.to_radians());
    Pose::from_parts(nalgebra::Vector3::from(place.origin_m).into(), turn)
}

/// The way back; caves are upright, so only the turn about the vertical counts.
pub fn place_of(pose: &Pose, scale: f64) -> CavePlace {
    let (_, _, heading) = pose.rotation.euler_angles();
    CavePlace { origin_m: pose.translation.vector.into(), heading_deg: heading.to_degrees(), scale }
}

/// The head of a user of a cave file: x to the right, y ahead, z up.
fn head_of(user: &tumble::scene::cave::User) -> Pose {
    let (right, ahead) = (user.right(), user.forward);
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[right, ahead, right.cross(&ahead)]));
    Pose::from_parts(user.eye_m.coords.into(), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Puts a scene into another one's surroundings (thesis §IV.C: the immersive scene).
fn surround(scene: &mut SceneFile, from: SceneFile, notes: &mut Vec<String>) -> Result<(), Failure> {
    let still = from.bodies.iter().filter(|b| b.mode == Mode::Static && b.alive).count();
    notes.push(format!("environment {}: its camera, lights, sky, ground and {still} bodies that do not move; camera and lights of {} are ignored", from.file, scene.file));
    let moving = from.bodies.iter().filter(|b| b.mode != Mode::Static).count() + from.articulated.len();
    if moving > 0 {
        notes.push(format!("environment {}: {moving} objects that move are left out; put them into the scene", from.file));
    }
    (scene.camera, scene.cave, scene.lights, scene.sky, scene.ground) = (from.camera, from.cave, from.lights, from.sky, from.ground);
    let (meshes, materials) = (scene.meshes.len(), scene.materials.len());
    scene.meshes.extend(from.meshes);
    scene.materials.extend(from.materials);
    for mut body in from.bodies.into_iter().filter(|b| b.mode == Mode::Static && b.alive) {
        if scene.bodies.iter().any(|b| b.name == body.name) || scene.articulated.iter().any(|a| a.name == body.name) {
            return Err(Failure::input(format!("{}: body \"{}\" of the environment has the name of one of {}; rename one", from.file, body.name, scene.file)));
        }
        body.collides = false;
        body.material = body.material.map(|m| m + materials);
        if let ShapeSpec::Mesh { mesh } = &mut body.shape {
            *mesh += meshes;
        }
        scene.bodies.push(body);
    }
    Ok(())
}

/// Where a facet's files go in a folder; a name may have dots, and none leads out.
pub fn facet_folder(folder: &Path, name: &str) -> std::path::PathBuf {
    folder.join(if name.starts_with('.') { format!("_{name}") } else { name.to_owned() })
}
