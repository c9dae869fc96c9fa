//! Hash of a scene, by which server and facets check that they have the same one.

use super::viewer::put_exact_pose;
use super::wire::{put_f64, put_name};
use std::path::Path;
use tumble_collide::{Shape, TriMesh};
use tumble_core::{Appearance, Drawn, World};

/// Returns the BLAKE3 hash of a scene. It covers `text` (camera, lights, sky of the file) and
/// everything visible in the world: names, status, poses, shapes with all vertices of meshes, and
/// appearances with the names of their texture files. So a changed mesh file is found even if the
/// scene file is the same.
pub fn scene_hash(text: &str, world: &World) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(text.len() as u64).to_le_bytes());
    hasher.update(text.as_bytes());
    let mut out = Vec::new();
    for &id in world.ids() {
        out.clear();
        let (Some(name), Some(object)) = (world.name(id), world.object(id)) else { continue };
        put_name(&mut out, name);
        out.extend(format!("{:?}", world.status(id)).bytes());
        let parts = world.view().state_range(id).map_or(0, |span| span.parts.len());
        (0..parts)
            .filter_map(|part| world.part_state(id, part))
            .for_each(|part_state| put_exact_pose(&mut out, &part_state.pose));
        for visual in object.renderable().map_or(&[][..], |r| r.visuals()) {
            let Some(drawn) = visual.drawn() else { continue };
            out.extend((visual.part as u64).to_le_bytes());
            put_exact_pose(&mut out, &visual.pose);
            match drawn {
                Drawn::Mesh(mesh) => put_mesh(&mut out, mesh),
                Drawn::Shape(Shape::Mesh(mesh)) => put_mesh(&mut out, mesh.mesh()),
                Drawn::Shape(Shape::Compound(compound)) => put_mesh(&mut out, &compound.mesh()),
                Drawn::Shape(Shape::Cylinder(c)) => put_f64(&mut out, &[4.0, c.radius(), c.half_length()]),
                Drawn::Shape(Shape::RoundedCylinder { core, rounding }) => {
                    put_f64(&mut out, &[10.0, core.radius(), core.half_length(), *rounding]);
                }
                Drawn::Shape(other) => out.extend(format!("{other:?}").bytes()), // plain numbers, written so that they read back the same
            }
            // by file name only: the folder differs between machines
            let texture = visual
                .appearance
                .texture
                .as_deref()
                .and_then(|path| path.file_name())
                .map(|name| Path::new(name).into());
            out.extend(format!("{:?}", Appearance { texture, ..visual.appearance.clone() }).bytes());
        }
        hasher.update(&(out.len() as u64).to_le_bytes());
        hasher.update(&out);
    }
    *hasher.finalize().as_bytes()
}

fn put_mesh(out: &mut Vec<u8>, mesh: &TriMesh) {
    out.extend((mesh.vertices.len() as u64).to_le_bytes());
    mesh.vertices.iter().for_each(|v| put_f64(out, v.as_slice()));
    out.extend(mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
}
