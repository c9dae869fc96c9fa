//! Views of lights: the tightest view that contains all shadow casters, or six views around a lamp
//! inside their box.

use super::data::Eye;
use crate::camera::{frustum, orthographic};
use crate::list::bounds::{Bounds, corners_of, union};
use crate::{DrawList, Light, Shadows};
use nalgebra::{Matrix4, Point3, Vector3, Vector4};

/// Returns the views of a light onto the shadow casters near the `seen` box: one, or six for a lamp
/// inside their box with soft shadows, or none.
pub fn eyes_of(light: &Light, list: &DrawList, seen: &Bounds) -> Vec<Eye> {
    let size = list.settings.shadow_map_size;
    let Some(casters) = union(list.casters_near(seen).map(|c| c.2)).filter(|_| light.casts_shadow()) else {
        return Vec::new();
    };
    match light {
        Light::Directional { direction, .. } => vec![sun(direction, list, seen, &casters, size)],
        Light::Point { position, radius_m, .. } => match lamp(position, &casters, size) {
            Some(eye) => vec![eye],
            None if list.settings.shadows == Shadows::Soft => lamp_amid(position, *radius_m, &casters, size),
            None => Vec::new(),
        },
    }
}

/// A parallel view along `direction`. Its x axis follows the longer side of the scene, and the axes
/// are scaled independently, so that a long lane wastes no texels.
fn sun(direction: &Vector3<f32>, list: &DrawList, seen: &Bounds, (lo, hi): &Bounds, size: u32) -> Eye {
    let back = -direction.normalize();
    let extent = hi - lo;
    let long = if extent.x >= extent.y { Vector3::x() } else { Vector3::y() };
    let along = if back.cross(&long).norm() > 1e-3 { long } else { Vector3::z() };
    let side = (along - back * back.dot(&along)).normalize();
    let up = back.cross(&side);
    let view = view_matrix(&side, &up, &back, &nalgebra::center(lo, hi));
    let far = Vector3::repeat(f32::MAX);
    let (mut min, mut max) = (far, -far);
    for (points, radius, _) in list.casters_near(seen) {
        for p in points.iter().map(|p| view.transform_point(p).coords) {
            (min, max) = (min.inf(&p.add_scalar(-radius)), max.sup(&p.add_scalar(radius)));
        }
    }
    // room for the filter at the edge, and never without extent
    let margin = (max - min) * 0.02 + Vector3::repeat(1e-3 + 1e-4 * extent.norm());
    Eye::new(&view.cast(), &orthographic(min - margin, max + margin).cast(), size, size)
}

/// A perspective view from a lamp outside the box around the shadow casters. It looks at the box's
/// nearest point, with the tightest frustum around its corners.
fn lamp(position: &Point3<f32>, casters: &Bounds, size: u32) -> Option<Eye> {
    let (lo, hi) = casters;
    let nearest = Point3::from(position.coords.sup(&lo.coords).inf(&hi.coords));
    let forward = (nearest - position).try_normalize(1e-3 * (hi - lo).norm().max(1e-3))?;
    let back = -forward;
    let along = if back.z.abs() > 0.9 { Vector3::x() } else { Vector3::z() };
    let side = along.cross(&back).normalize();
    let up = back.cross(&side);
    let view = view_matrix(&side, &up, &back, position);
    let corners = corners_of(casters).map(|p| view.transform_point(&p));
    let (mut near, mut far, mut min, mut max) = (f32::MAX, 0f32, [f32::MAX; 2], [-f32::MAX; 2]);
    for p in corners {
        let s = -p.z;
        near = near.min(s);
        far = far.max(s);
        for k in 0..2 {
            // beyond 80 degrees to a side, a flat frustum would leave no texels for the rest
            let t = (p[k] / s.max(1e-6)).clamp(-5.7, 5.7);
            (min[k], max[k]) = (min[k].min(t), max[k].max(t));
        }
    }
    let (near, far) = ((near * 0.98).max(far * 1e-3), far * 1.02);
    let row = |k: usize| {
        let pad = 0.02 * (max[k] - min[k]) + 1e-3;
        let (a, b) = (min[k] - pad, max[k] + pad);
        [2.0 / (b - a), (b + a) / (b - a)]
    };
    let projection = frustum(row(0), row(1), near, far);
    Some(Eye::new(&view.cast(), &projection.cast(), size, size))
}

/// Wider than 90 degrees, so that filters near the edge of one side of the cube stay within its
/// map.
const CUBE_TANGENT: f32 = 1.25;

/// Perspective views to the six sides of a cube around a lamp, +x, -x, +y, -y, +z, -z; objects
/// inside the lamp are not seen.
fn lamp_amid(position: &Point3<f32>, radius: f32, casters: &Bounds, size: u32) -> Vec<Eye> {
    let far = corners_of(casters).iter().map(|p| (p - position).norm()).fold(0.0, f32::max).max(1e-3) * 1.02;
    let near = radius.max(1e-3 * far).min(0.5 * far);
    let scale = [1.0 / CUBE_TANGENT, 0.0];
    let projection = frustum(scale, scale, near, far);
    let sides = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y(), Vector3::z(), -Vector3::z()];
    let view = |forward: Vector3<f32>| {
        let back = -forward;
        let along = if back.z.abs() > 0.9 { Vector3::x() } else { Vector3::z() };
        let side = along.cross(&back);
        view_matrix(&side, &back.cross(&side), &back, position)
    };
    sides.into_iter().map(|forward| Eye::new(&view(forward).cast(), &projection.cast(), size, size)).collect()
}

fn view_matrix(side: &Vector3<f32>, up: &Vector3<f32>, back: &Vector3<f32>, at: &Point3<f32>) -> Matrix4<f32> {
    let row = |v: &Vector3<f32>| Vector4::new(v.x, v.y, v.z, -v.dot(&at.coords)).transpose();
    Matrix4::from_rows(&[row(side), row(up), row(back), Vector4::w().transpose()])
}

/// `struct Shadow` of the shaders.
pub fn floats(eye: &Eye, size: u32) -> Vec<f32> {
    let m = eye.clip_from_world;
    let inverse = m.try_inverse().unwrap_or(Matrix4::identity());
    let mut out: Vec<f32> = m.iter().chain(inverse.iter()).map(|&x| x as f32).collect();
    out.extend(eye.depth.map(|x| x as f32));
    let [wide, high] = eye.map_widths_per_meter();
    let texel = 1.0 / (wide.min(high) * f64::from(size));
    out.extend([wide as f32, high as f32, f32::from(u8::from(eye.perspective)), texel as f32]);
    out
}
