//! `camera = { … }` and `light = { … }` of a body or link: a camera and a light that move with it
//! (thesis §III.A).

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{CameraMount, LightMount, Spread};

use crate::parse::appearance::read_color;
use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};
use crate::parse::view::FOV;

/// The camera and the light attached to a body or link. Poses are in the frame of the shape or
/// link; `part` is set when the world is built.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mounts {
    /// `camera`.
    pub camera: Option<CameraMount>,
    /// `light`.
    pub light: Option<LightMount>,
}

#[derive(Clone, Copy)]
enum Kind {
    Directional,
    Point,
}

const KINDS: Names<Kind> = &[("directional", Kind::Directional), ("point", Kind::Point)];

impl Mounts {
    pub(crate) fn read(f: &mut Fields<'_>) -> Mounts {
        let (log, what) = (f.log, f.what.clone());
        let example = "{ position_m = [0, 0, 0.1], forward = [1, 0, 0] }";
        let camera = f
            .value("camera")
            .and_then(|value| Fields::of(log, value, format!("the camera of {what}"), example))
            .map(read_camera);
        let example = "{ type = \"point\", position_m = [0, 0, 0.1] }";
        let light = f
            .value("light")
            .and_then(|value| Fields::of(log, value, format!("the light of {what}"), example))
            .and_then(read_light);
        Mounts { camera, light }
    }
}

fn read_camera(mut f: Fields<'_>) -> CameraMount {
    let position = f.vector_or("position_m", Bound::ANY, [0.0; 3]);
    let (ahead, up) = (f.direction_or("forward", [1.0, 0.0, 0.0]), f.direction_or("up", [0.0, 0.0, 1.0]));
    let fov_deg = f.number_or("vertical_fov_deg", FOV, 40.0);
    let (near, far) = (f.number_or("near_m", Bound::POSITIVE, 0.05), f.number_or("far_m", Bound::POSITIVE, 500.0));
    if near >= far {
        f.log.report(
            f.span.clone(),
            format!("`near_m` of {} is {near} and `far_m` is {far}", f.what),
            "expected near_m less than far_m",
        );
    }
    let pose = facing(position, ahead, up).unwrap_or_else(|| {
        f.log.report(
            f.span.clone(),
            format!("{} looks along its `up`", f.what),
            "expected two directions that are not parallel",
        );
        Pose::identity()
    });
    f.finish();
    CameraMount { vertical_fov: fov_deg.to_radians(), near, far, ..CameraMount::new("", 0, pose) }
}

fn read_light(mut f: Fields<'_>) -> Option<LightMount> {
    let Some(kind) = f.choice("type", KINDS) else {
        f.give_up();
        return None;
    };
    let (spread, position, ahead) = match kind {
        Kind::Directional => (Spread::Directional, [0.0; 3], f.direction("direction")),
        Kind::Point => {
            let radius = f.number_or("radius_m", Bound::POSITIVE, 0.1);
            (Spread::Point { radius }, f.vector_or("position_m", Bound::ANY, [0.0; 3]), [1.0, 0.0, 0.0])
        }
    };
    let up = if ahead[2].abs() > 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
    let light = LightMount {
        part: 0,
        pose: facing(position, ahead, up).unwrap_or_else(Pose::identity),
        spread,
        color: read_color(&mut f, "color", [1.0, 1.0, 1.0]),
        intensity: f.number_or("intensity", Bound::NOT_NEGATIVE, 1.0),
        casts_shadow: f.flag_or("casts_shadow", spread == Spread::Directional),
    };
    f.finish();
    Some(light)
}

/// Returns the pose at a position with x along `forward` and z as close to `up` as possible; `None`
/// if the two are parallel.
pub fn facing(position: [f64; 3], ahead: [f64; 3], up: [f64; 3]) -> Option<Pose> {
    let x = Vec3::from(ahead).try_normalize(1e-9)?;
    let y = Vec3::from(up).cross(&x).try_normalize(1e-6)?;
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, x.cross(&y)]));
    Some(Pose::from_parts(Translation3::from(Vec3::from(position)), UnitQuaternion::from_rotation_matrix(&turn)))
}
