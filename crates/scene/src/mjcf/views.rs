//! Cameras and lights: those of the world for the scene, all others for their links.

use nalgebra::{Matrix3, Rotation3, Translation3};
use tumble_core::collide::{Pose, Quat, Vec3};
use tumble_core::{CameraMount, LightMount, Spread};

use super::scene::{Assembly, Place};
use super::tree::{Body, Camera, Light};
use crate::parse::mount::Mounts;
use crate::parse::view::{CameraSpec, LightKind, LightSpec};

/// Radius of a light, m.
const LIGHT_RADIUS: f64 = 0.1;
/// Largest number of lights of a scene.
const MAX_LIGHTS: usize = 64;

/// Reads the cameras and lights of bodies that are fixed to the world. The first camera becomes that
/// of the scene.
pub(super) fn read(assembly: &mut Assembly<'_, '_>) {
    let (bodies, reader) = (assembly.bodies, assembly.reader);
    let mut lights = Vec::new();
    let in_world = |number: &usize| assembly.places[*number] == Place::World;
    for (number, body) in bodies.iter().enumerate().filter(|(number, _)| in_world(number)) {
        let pose = assembly.poses[number];
        for camera in &body.cameras {
            match &mut assembly.scene.camera {
                none @ None => *none = Some(world_camera(camera, &pose)),
                Some(_) => reader.notes.add(&camera.frame.element, "cameras of the world after the first are left out"),
            }
        }
        for light in &body.lights {
            match lights.len() < MAX_LIGHTS {
                true => lights.push(world_light(light, &pose)),
                false => reader.notes.add(&light.element, "lights after the first 64 are left out"),
            }
        }
        for site in &body.sites {
            reader.notes.add(&site.element, "sites of the world are left out, except in <equality>");
        }
    }
    if !lights.is_empty() {
        assembly.scene.lights = lights;
    }
}

fn world_camera(camera: &Camera<'_>, pose: &Pose) -> CameraSpec {
    let pose = pose * camera.frame.pose;
    let eye = pose.translation.vector;
    CameraSpec {
        eye_m: eye.into(),
        target_m: (eye - pose.rotation * Vec3::z()).into(),
        up: (pose.rotation * Vec3::y()).into(),
        vertical_fov_deg: camera.fovy,
        near_m: 0.05,
        far_m: 500.0,
    }
}

fn world_light(light: &Light<'_>, pose: &Pose) -> LightSpec {
    let kind = match light.directional {
        true => LightKind::Directional { direction: (pose.rotation * light.direction).into() },
        false => LightKind::Point { position_m: pose.transform_point(&light.position.into()).coords.into() },
    };
    LightSpec { kind, color: light.color, intensity: 1.0, casts_shadow: light.casts_shadow && light.directional }
}

/// Returns the cameras and lights of a body as mounts in its frame, each with its name.
pub(super) fn mounts(body: &Body<'_>) -> Vec<(Option<String>, Pose, Mounts)> {
    let mut mounts = Vec::new();
    for Camera { frame, fovy } in &body.cameras {
        // MuJoCo's camera looks along −z with y up; a mount looks along x with z up.
        let turn = Matrix3::from_columns(&[-Vec3::z(), -Vec3::x(), Vec3::y()]);
        let turn = Quat::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        let pose = Pose::from_parts(Translation3::identity(), turn);
        let camera = CameraMount { vertical_fov: fovy.to_radians(), ..CameraMount::new("", 0, pose) };
        mounts.push((frame.name.clone(), frame.pose, Mounts { camera: Some(camera), light: None }));
    }
    for light in &body.lights {
        let turn = Quat::rotation_between(&Vec3::x(), &light.direction);
        let turn = turn.unwrap_or_else(|| Quat::from_axis_angle(&Vec3::z_axis(), std::f64::consts::PI));
        let spread = if light.directional { Spread::Directional } else { Spread::Point { radius: LIGHT_RADIUS } };
        let mount = LightMount {
            part: 0,
            pose: Pose::from_parts(Translation3::from(light.position), turn),
            spread,
            color: light.color,
            intensity: 1.0,
            casts_shadow: light.casts_shadow && light.directional,
        };
        mounts.push((None, Pose::identity(), Mounts { camera: None, light: Some(mount) }));
    }
    mounts
}
