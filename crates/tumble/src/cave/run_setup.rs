//! Scene, environment and cave of a run, which server and facets build in the same way.

use super::args::CaveSceneOptions;
use crate::failure::Failure;
use std::path::Path;
use tumble::collide::Pose;
use tumble::dynamics::{Mode, World};
use tumble::net::sync::transport::MAX_FACETS;
use tumble::net::sync::{User, Viewer, scene_hash};
use tumble::render::CaveView;
use tumble::scene::cave::{Cave, CaveSource, Surface, resolve_cave};
use tumble::scene::{CavePlace, SceneFile, read_file, resolve_scene, visual_notes};

/// Name of the slot of the process that draws a preview.
pub const PREVIEW: &str = "preview";

/// Role of a process in a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Steps the world.
    Server,
    /// Draws the world.
    Facet,
}

/// Data that all processes of a run have in common.
pub struct RunSetup {
    pub scene: SceneFile,
    pub cave: Cave,
    /// World before the first step.
    pub world: World,
    /// Hash of the scene.
    pub hash: [u8; 32],
    /// Hash of scene, cave and textures. It must be equal on server and facet for a join.
    pub join_hash: [u8; 32],
    /// Identity of the cave: its canonical path or shipped name. One run at a time may use it.
    pub place: String,
    /// Notes for the user.
    pub notes: Vec<String>,
}

impl RunSetup {
    /// Reads the cave and the environment and builds the world of `scene`. Stepping options may
    /// differ between server and facets, because nothing visible at the start depends on them.
    pub fn load(mut scene: SceneFile, surroundings: &CaveSceneOptions, role: Role) -> Result<RunSetup, Failure> {
        let source = resolve_cave(&surroundings.cave)?;
        let cave = source.load()?;
        let place = match &source {
            CaveSource::Path(path) => path.canonicalize().unwrap_or(path.clone()).display().to_string(),
            CaveSource::Shipped(cave) => cave.name.to_owned(),
        };
        if cave.facets.len() > MAX_FACETS {
            return Err(Failure::input(format!(
                "{}: a run has at most {MAX_FACETS} facets, this cave has {}",
                cave.file,
                cave.facets.len()
            )));
        }
        let mut notes = Vec::new();
        if let Some(name) = &surroundings.environment {
            merge_environment(&mut scene, resolve_scene(name, &[])?.load()?, &mut notes)?;
        }
        let build = if role == Role::Server { SceneFile::build } else { SceneFile::build_drawn };
        let (world, built) = build(&scene).map_err(Failure::input)?;
        notes.extend(built);
        // everything visible that belongs to no body
        let seen = format!("{:?} {:?} {:?} {:?} {:?}", scene.camera, scene.cave, scene.lights, scene.sky, scene.ground);
        let hash = scene_hash(&seen, &world);
        let join_hash = hash_for_joining(&hash, &cave, &world);
        notes.extend(visual_notes(world.visuals()));
        Ok(RunSetup { scene, cave, world, hash, join_hash, place, notes })
    }

    /// Returns the cave at its place in the scene.
    pub fn view(&self) -> Result<CaveView, Failure> {
        CaveView::new(self.cave.clone(), &self.scene).map_err(Failure::input)
    }

    /// Returns the users and the cave's place as the files define them.
    pub fn viewer(&self) -> Result<Viewer, Failure> {
        let view = self.view()?;
        let users = self
            .cave
            .users
            .iter()
            .map(|user| User { head: head_pose(user), interpupillary_m: user.interpupillary_m, input: 0 })
            .collect();
        Ok(Viewer { users, cave: pose_of(view.place()), scale: view.place().scale })
    }
}

/// Returns the hash of a scene with the visible properties of a cave and the bytes of all textures.
/// Addresses, nodes and windows are local to a machine and excluded.
fn hash_for_joining(scene: &[u8; 32], cave: &Cave, world: &World) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    let mut put = |bytes: &[u8]| {
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    };
    // an unreadable file is reported where it is used
    let content = |path: &Path| read_file(path).map_or([0; 32], |bytes| *blake3::hash(&bytes).as_bytes());
    put(scene);
    put(format!("{:?} {:?}", cave.sync.mode, cave.users).as_bytes());
    // files count by their content: folders differ between machines
    for mut screen in cave.screens.iter().cloned() {
        if let Surface::Mesh { file } = &mut screen.surface {
            put(&content(&std::mem::take(file)));
        }
        put(format!("{screen:?}").as_bytes());
    }
    for f in &cave.facets {
        let mut color = f.color.clone();
        let table = color.as_mut().and_then(|color| color.lut_file.take());
        put(format!(
            "{:?} {} {} {:?} {} {} {:?} {} {:?} {color:?}",
            f.name, f.screen, f.user, f.size_px, f.near_m, f.far_m, f.stereo, f.swap_eyes, f.flip
        )
        .as_bytes());
        [&f.warp_file, &f.blend_file, &f.black_file, &table]
            .into_iter()
            .for_each(|file| put(&file.as_deref().map_or([0; 32], content)));
    }
    let textures: std::collections::BTreeSet<_> =
        world.visuals().filter_map(|visual| visual.appearance.texture.clone()).collect();
    // by file name, like the scene's hash: folders differ between machines
    let mut textures: Vec<_> =
        textures.iter().map(|path| (path.file_name().unwrap_or_default().as_encoded_bytes(), content(path))).collect();
    textures.sort();
    for (name, bytes) in textures {
        put(name);
        put(&bytes);
    }
    *hasher.finalize().as_bytes()
}

/// Applies a frame and its viewer to the view: the cave's place, the users' heads, the eye of
/// `frame_sequential`.
pub fn apply_viewer(view: &mut CaveView, viewer: &Viewer, frame: u64) {
    view.set_frame(frame);
    view.set_place(place_of(&viewer.cave, viewer.scale));
    for (user, seen) in view.users_mut().iter_mut().zip(&viewer.users) {
        user.eye_m = seen.head.translation.vector.into();
        user.forward = seen.head.rotation * nalgebra::Vector3::y();
        user.up = seen.head.rotation * nalgebra::Vector3::z();
        user.interpupillary_m = seen.interpupillary_m;
    }
}

/// Converts a cave's place to a pose: `x_scene = pose · (scale · x_cave)`.
pub fn pose_of(place: &CavePlace) -> Pose {
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), place.heading_deg.to_radians());
    Pose::from_parts(nalgebra::Vector3::from(place.origin_m).into(), turn)
}

/// Converts a pose to a cave's place. Caves are upright, so only the rotation about the vertical
/// counts.
pub fn place_of(pose: &Pose, scale: f64) -> CavePlace {
    let (_, _, heading) = pose.rotation.euler_angles();
    CavePlace { origin_m: pose.translation.vector.into(), heading_deg: heading.to_degrees(), scale }
}

/// Returns the head pose of a user of a cave file: x to the right, y ahead, z up.
fn head_pose(user: &tumble::scene::cave::User) -> Pose {
    let (right, ahead) = (user.right(), user.forward);
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[
        right,
        ahead,
        right.cross(&ahead),
    ]));
    Pose::from_parts(user.eye_m.coords.into(), nalgebra::UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Puts a scene into the environment of another scene (thesis §IV.C: the immersive scene).
fn merge_environment(scene: &mut SceneFile, from: SceneFile, notes: &mut Vec<String>) -> Result<(), Failure> {
    let still = from.bodies.iter().filter(|b| b.mode == Mode::Static && b.enabled).count();
    notes.push(format!("environment {}: its camera, lights, sky, ground and {still} bodies that do not move; camera and lights of {} are ignored", from.file, scene.file));
    let moving = from.bodies.iter().filter(|b| b.mode != Mode::Static).count() + from.articulated.len();
    if moving > 0 {
        notes.push(format!(
            "environment {}: {moving} objects that move are left out; put them into the scene",
            from.file
        ));
    }
    (scene.camera, scene.cave, scene.lights, scene.sky, scene.ground) =
        (from.camera, from.cave, from.lights, from.sky, from.ground);
    let (meshes, materials) = (scene.meshes.len(), scene.materials.len());
    scene.meshes.extend(from.meshes);
    scene.materials.extend(from.materials);
    for mut body in from.bodies.into_iter().filter(|b| b.mode == Mode::Static && b.enabled) {
        if scene.bodies.iter().any(|b| b.name == body.name) || scene.articulated.iter().any(|a| a.name == body.name) {
            return Err(Failure::input(format!(
                "{}: body \"{}\" of the environment has the name of one of {}; rename one",
                from.file, body.name, scene.file
            )));
        }
        body.collidable = false;
        body.material = body.material.map(|m| m + materials);
        body.shape.shift_meshes(meshes);
        scene.bodies.push(body);
    }
    Ok(())
}
