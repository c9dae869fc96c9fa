//! Conversion of a world to the entities and poses of a recording.

use crate::record::{Entity, MAX_NAME_BYTES, Pose, Shape, VisualPart};
use nalgebra::Translation3;
use tumble_collide::{Shape as Solid, TriMesh, Vec3};
use tumble_core::{Drawn, ObjectId, RigidBody, World};
use xxhash_rust::xxh3::xxh3_64;

/// Half the side of the square that represents a half-space, m.
const PLANE_M: f64 = 20.0;

/// Returns every drawable part as one entity. It has the name of its object, followed by `/part` if
/// the object has several parts. A name of more than [`MAX_NAME_BYTES`] is replaced by its beginning
/// and a hash of the whole.
pub fn entities(world: &World) -> Vec<Entity> {
    sites(world).map(|(id, part)| entity(world, id, part)).collect()
}

/// Returns the poses of the entities, in the order of [`entities`].
pub fn poses(world: &World) -> Vec<Pose> {
    sites(world).filter_map(|(id, part)| world.pose(id, part)).map(|frame| pose(&frame)).collect()
}

/// Returns the names of the entities, in the order of [`entities`].
pub fn names(world: &World) -> Vec<String> {
    sites(world).map(|(id, part)| name(world, id, part)).collect()
}

fn name(world: &World, id: ObjectId, part: usize) -> String {
    let name = world.name(id).unwrap_or_default();
    let several = world.view().state_range(id).is_some_and(|span| span.parts.len() > 1);
    shortened(if several { format!("{name}/{part}") } else { name.to_owned() })
}

/// Returns a name of at most [`MAX_NAME_BYTES`]. A longer name is replaced by its beginning, `~`, and 16 hexadecimal digits, the XXH3
/// of the whole name.
fn shortened(name: String) -> String {
    if name.len() <= MAX_NAME_BYTES {
        return name;
    }
    let hash = format!("~{:016x}", xxh3_64(name.as_bytes()));
    let room = MAX_NAME_BYTES - hash.len();
    let end = (0..=room).rev().find(|&n| name.is_char_boundary(n)).unwrap_or(0);
    name[..end].to_owned() + &hash
}

fn sites(world: &World) -> impl Iterator<Item = (ObjectId, usize)> + '_ {
    let parts = |id: ObjectId| world.view().state_range(id).map_or(0, |span| span.parts.len());
    world.ids().iter().flat_map(move |&id| (0..parts(id)).map(move |part| (id, part)))
}

fn entity(world: &World, id: ObjectId, part: usize) -> Entity {
    let object = world.object(id);
    let visuals = object.and_then(|o| o.renderable()).map_or(&[][..], |r| r.visuals());
    let center = world.get::<RigidBody>(id).map_or(Vec3::zeros(), RigidBody::center_of_mass);
    let parts = visuals.iter().filter(|v| v.part == part).filter_map(|v| {
        let [r, g, b] = v.appearance.color;
        let color = [r, g, b, 1.0].map(f64::from).map(|c| c as _);
        let placed = Translation3::from(center) * v.pose;
        Some(VisualPart { shape: drawn(v.drawn()?), pose: pose(&placed), color })
    });
    Entity { name: name(world, id, part), parts: parts.collect() }
}

fn pose(pose: &tumble_collide::Pose) -> Pose {
    Pose { position: pose.translation.vector.into(), rotation: pose.rotation.coords.into() }
}

fn drawn(drawn: Drawn<'_>) -> Shape {
    let shape = match drawn {
        Drawn::Mesh(mesh) => return triangles(mesh),
        Drawn::Shape(shape) => shape,
    };
    match shape {
        Solid::HalfSpace => Shape::Plane { half_size: PLANE_M },
        Solid::Sphere { radius } => Shape::Sphere { radius: *radius },
        Solid::Box { half_extents } => Shape::Box { half_extents: (*half_extents).into() },
        Solid::Capsule { radius, half_length } => Shape::Capsule { radius: *radius, half_height: *half_length },
        Solid::Cylinder(c) => Shape::Cylinder { radius: c.radius(), half_height: c.half_length() },
        Solid::Mesh(mesh) => triangles(mesh.mesh()),
    }
}

fn triangles(mesh: &TriMesh) -> Shape {
    Shape::Mesh { vertices: mesh.vertices.iter().map(|v| (*v).into()).collect(), triangles: mesh.triangles.clone() }
}
