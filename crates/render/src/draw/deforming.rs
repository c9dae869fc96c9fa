//! Surfaces and clouds that change with the state: their geometry is made anew for each list.

use super::{Drawing, small, surface};
use crate::{DebugStyle, DrawList, Material, MeshData, Pattern, RenderError, SoftSphere, SphereCloud};
use nalgebra::{Isometry3, Point3};
use std::sync::Arc;
use tumble_core::{Appearance, Cloud, CloudSphere, Detail, PartState, PartSurface};

/// Largest coordinate of a sphere of a cloud that is drawn, m: what has flown away is left out.
const FAR_M: f64 = 1e5;

impl Drawing {
    /// Adds a surface through parts, whose states are those of its object.
    pub(super) fn place_surface(
        &self,
        list: &mut DrawList,
        name: &str,
        drawn: &PartSurface,
        parts: &[PartState],
        tint: Option<[f32; 3]>,
    ) -> Result<(), RenderError> {
        let positions: Vec<[f32; 3]> = parts.iter().map(|part| small(&part.pose.translation.vector).into()).collect();
        let wires = self.detail.unwrap_or(drawn.appearance.detail) == Detail::Wireframe;
        let crease = if wires { 0.0 } else { drawn.crease as f32 };
        let mesh = MeshData::from_triangles(&positions, &drawn.triangles, crease)?;
        let material = plain(&drawn.appearance, name, tint);
        if wires {
            let style = DebugStyle::new(material.color).width(1.0);
            for [a, b, c] in drawn.triangles.iter().map(|corners| corners.map(|i| Point3::from(positions[i as usize])))
            {
                [(a, b), (b, c), (c, a)]
                    .into_iter()
                    .filter(|(a, b)| a.coords.as_slice() < b.coords.as_slice())
                    .for_each(|(from, to)| list.line(from, to, style));
            }
        } else if !mesh.indices.is_empty() {
            let mesh = list.add_mesh(Arc::new(mesh));
            list.add_instance(mesh, Isometry3::identity(), material);
        }
        Ok(())
    }
}

/// Adds the spheres of a cloud.
pub(super) fn place_cloud(list: &mut DrawList, name: &str, cloud: Cloud<'_>, tint: Option<[f32; 3]>) {
    let material = plain(cloud.appearance, name, tint);
    let shown = cloud.spheres.filter(|sphere| sphere.center.amax() < FAR_M && sphere.radius as f32 > 0.0);
    let place = |sphere: &CloudSphere| (Point3::from(small(&sphere.center)), sphere.radius as f32);
    let color = |sphere: &CloudSphere| if tint.is_some() { None } else { sphere.color };
    if cloud.transparent {
        list.soft_spheres.extend(shown.map(|sphere| {
            let ((center, radius), color) = (place(&sphere), color(&sphere).unwrap_or(material.color));
            SoftSphere { center, radius, color, opacity: sphere.opacity as f32, shader: material.shader }
        }));
        return;
    }
    let (mut spheres, mut colors) = (Vec::new(), Vec::new());
    for sphere in shown {
        spheres.push(place(&sphere));
        colors.extend(color(&sphere));
    }
    if colors.len() != spheres.len() {
        colors.clear(); // all have one, or none is used
    }
    if !spheres.is_empty() {
        list.clouds.push(SphereCloud { spheres, colors, material });
    }
}

/// Returns the material without a pattern, which would not move with the surface.
fn plain(appearance: &Appearance, name: &str, tint: Option<[f32; 3]>) -> Material {
    match tint {
        Some(color) => Material::matte(color),
        None => Material { pattern: Pattern::Plain, ..surface::of_appearance(appearance, name) },
    }
}
