//! The picture of one level of a sphere tree over its mesh (thesis Fig. 16).

use super::overlay::SHELL_COLORS;
use super::{CREASE_RAD, small};
use crate::{DebugStyle, DrawList, Light, Material, MeshData, RenderError};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use std::f32::consts::FRAC_PI_2;
use tumble_collide::{SphereTree, TriMesh, Vec3};

/// Opening angle of the camera: narrower than for the bounding sphere of the mesh's box, which most
/// meshes leave half empty.
const LENS_RAD: f32 = 0.58;

/// The axis of a mesh that points up in its picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// x.
    X,
    /// y, the convention of most graphics meshes.
    Y,
    /// z.
    #[default]
    Z,
}

/// Returns a draw list of the mesh with the translucent spheres of `level` (0 is the root), seen
/// from the front and above. The mesh is scaled to a diagonal of 1 around its middle, so that light
/// and camera are the same for all meshes.
///
/// # Errors
/// [`RenderError`] if the mesh has more vertices than can be drawn.
pub fn tree_over_mesh(mesh: &TriMesh, tree: &SphereTree, level: u32, up: UpAxis) -> Result<DrawList, RenderError> {
    let bounds = mesh.aabb();
    let (middle, scale) = (0.5 * (bounds.min + bounds.max), 1.0 / mesh.diagonal().max(f64::MIN_POSITIVE));
    let turn: UnitQuaternion<f32> = match up {
        UpAxis::X => UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -FRAC_PI_2),
        UpAxis::Y => UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2),
        UpAxis::Z => UnitQuaternion::identity(),
    };
    let place = |p: &Vec3| turn * small(&((p - middle) * scale));
    let positions: Vec<[f32; 3]> = mesh.vertices.iter().map(|v| place(v).into()).collect();
    let mut list = DrawList::default();
    let id = list.add_mesh(MeshData::from_triangles(&positions, &mesh.triangles, CREASE_RAD)?);
    list.add_instance(
        id,
        Isometry3::identity(),
        Material { color: [0.75, 0.76, 0.78], roughness: 0.6, ..Material::default() },
    );
    list.lights.push(Light::sun(Vector3::new(0.4, 0.7, -1.0), 2.5));
    for (node, color) in tree.at_level(level).zip(SHELL_COLORS.iter().cycle()) {
        list.shell(
            Point3::from(place(&node.center)),
            (node.radius * scale) as f32,
            DebugStyle::new(*color).opacity(0.6),
        );
    }
    list.sky.backdrop = Some([1.0; 3]);
    list.camera = list.framing_camera(Vector3::new(-0.3, 1.0, -0.35)).with_fov(LENS_RAD);
    Ok(list)
}
