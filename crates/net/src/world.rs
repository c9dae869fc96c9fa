//! Conversion of a world to the entities and poses of a recording.

use crate::record::{
    Contact, Deforming, Entity, MAX_CONTACTS, MAX_EVENTS, MAX_NAME_BYTES, Point, Pose, Readings, RecordedEvent, Shape,
    Surface, VisualPart,
};
use nalgebra::Translation3;
use std::collections::BTreeMap;
use tumble_collide::{Shape as Solid, TriMesh, Vec3};
use tumble_core::{ContactPoint, Drawn, Event, EventKind, ObjectId, RigidBody, World};
use xxhash_rust::xxh3::xxh3_64;

/// Sides of a rounded cylinder.
const SIDES: usize = 48;

/// Side of the square that represents a half-space, m.
const PLANE_M: f64 = 40.0;

/// Returns the surfaces and particles of a world. Objects that are not enabled are left out.
pub fn deforming(world: &World) -> Deforming {
    let mut shown = Deforming::default();
    for &id in world.ids().iter().filter(|id| world.status(**id).is_some_and(|status| status.enabled)) {
        let Some(drawn) = world.object(id).and_then(|object| object.renderable()) else { continue };
        if let (Some(surface), Some(range)) = (drawn.surface(), world.view().state_range(id)) {
            let [r, g, b] = surface.appearance.color;
            shown.surfaces.push(Surface {
                name: shortened(world.name(id).unwrap_or_default().to_owned()),
                vertices: world.part_states()[range.parts.clone()].iter().map(|part| part.position().into()).collect(),
                triangles: surface.triangles.to_vec(),
                color: [r, g, b, 1.0],
            });
        }
        if let Some(cloud) = world.state_of(id).and_then(|x| drawn.cloud(x)) {
            let byte = |share: f32| (255.0 * share.clamp(0.0, 1.0)).round() as u8;
            shown.points.extend(cloud.spheres.map(|sphere| {
                let [red, green, blue] = sphere.color.unwrap_or(cloud.appearance.color).map(byte);
                let opacity = if cloud.transparent { sphere.opacity as f32 } else { 1.0 };
                Point { position: sphere.center.cast().into(), color: [red, green, blue, byte(opacity)] }
            }));
        }
    }
    shown
}

/// Returns every drawable part as one entity. It has the name of its object, followed by `/part` if
/// the object has several parts. The nodes of a surface are no entities ([`deforming`] has the surface). A name of more than [`MAX_NAME_BYTES`] is replaced by its
/// beginning and a hash of the whole.
pub fn entities(world: &World) -> Vec<Entity> {
    sites(world).map(|(id, part)| entity(world, id, part)).collect()
}

/// Returns the poses of the entities, in the order of [`entities`].
pub fn poses(world: &World) -> Vec<Pose> {
    sites(world).filter_map(|(id, part)| world.pose(id, part)).map(|frame| pose(&frame)).collect()
}

/// Returns the contacts of the last step between the [`entities`] whose surfaces touch. Of more
/// than [`MAX_CONTACTS`], those with the largest forces are kept, the largest first.
pub fn contacts(world: &World) -> Vec<Contact> {
    let index: BTreeMap<(ObjectId, usize), u32> = sites(world).zip(0..).collect();
    let contact = |c: &ContactPoint| {
        Some(Contact {
            a: *index.get(&(c.a, c.part_a))?,
            b: *index.get(&(c.b, c.part_b))?,
            shapes: [c.shape_a as u32, c.shape_b as u32],
            point: c.point.into(),
            normal: c.normal.into(),
            depth: c.depth,
            force: c.force.into(),
        })
    };
    strongest(world, MAX_CONTACTS).into_iter().filter_map(contact).collect()
}

/// Returns the readings of all measuring sensors by name; long names as those of [`entities`].
pub fn readings(world: &World) -> Readings {
    let one = |id| Some((shortened(world.name(id)?.to_owned()), world.reading(id)?.to_vec()));
    world.sensors().filter_map(one).collect()
}

/// Returns the events of the last step, at most [`MAX_EVENTS`], the first ones, with the names of [`entities`].
pub fn events(world: &World) -> Vec<RecordedEvent> {
    let kind =
        |event: &Event| EventKind::NAMES.iter().find(|(_, kind)| *kind == event.kind).map_or("", |(name, _)| name);
    let one = |event: &Event| RecordedEvent {
        kind: kind(event).to_owned(),
        a: name(world, event.a, event.part_a),
        b: event.b.map(|b| name(world, b, event.part_b)),
        shapes: [event.shape_a as u32, event.shape_b as u32],
        impulse: event.impulse.into(),
        point: event.point.into(),
    };
    world.events().iter().take(MAX_EVENTS).map(one).collect()
}

/// Shows recorded contacts in a world that has the same entities, as those of its last step.
/// Velocities and impulses are not recorded and are zero.
pub fn show_contacts(world: &mut World, contacts: &[Contact]) {
    let entities: Vec<(ObjectId, usize)> = sites(world).collect();
    let point = |c: &Contact| {
        let (&(a, part_a), &(b, part_b)) = (entities.get(c.a as usize)?, entities.get(c.b as usize)?);
        let [shape_a, shape_b] = c.shapes.map(|shape| shape as usize);
        let sides = [(a, part_a, shape_a), (b, part_b, shape_b)];
        Some(ContactPoint::shown(sides, c.point.into(), c.normal.into(), c.depth, c.force.into()))
    };
    world.replica().set_contacts(contacts.iter().filter_map(point));
}

/// Returns the contacts of the last step whose surfaces touch. If there are more than `max`, those
/// with the largest forces are kept, the largest first.
pub(crate) fn strongest(world: &World, max: usize) -> Vec<&ContactPoint> {
    if max == 0 {
        return Vec::new();
    }
    let mut contacts: Vec<&ContactPoint> = world.contacts().iter().filter(|c| c.is_touching()).collect();
    if contacts.len() > max {
        contacts.sort_by(|a, b| b.force.norm_squared().total_cmp(&a.force.norm_squared()));
        contacts.truncate(max);
    }
    contacts
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

/// Returns a name of at most [`MAX_NAME_BYTES`]. A longer name is replaced by its beginning, `~`,
/// and 16 hexadecimal digits, the XXH3 of the whole name.
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
    let whole = |id: ObjectId| world.object(id).and_then(|o| o.renderable()).is_some_and(|r| r.surface().is_some());
    let parts = move |id: ObjectId| {
        if whole(id) { 0 } else { world.view().state_range(id).map_or(0, |span| span.parts.len()) }
    };
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
        Solid::HalfSpace => Shape::Plane { size: PLANE_M },
        Solid::Sphere { radius } => Shape::Sphere { radius: *radius },
        Solid::Box { half_extents } => Shape::Box { size: (2.0 * half_extents).into() },
        Solid::Capsule { radius, half_length } => Shape::Capsule { radius: *radius, length: 2.0 * half_length },
        Solid::Cylinder(c) => Shape::Cylinder { radius: c.radius(), length: 2.0 * c.half_length() },
        Solid::Mesh(mesh) => triangles(mesh.mesh()),
        Solid::Compound(compound) => triangles(&compound.mesh()),
        Solid::Ellipsoid { half_axes } => Shape::Ellipsoid { size: (2.0 * half_axes).into() },
        Solid::Cone { radius, height } => Shape::Cone { radius: *radius, height: *height },
        Solid::RoundedBox { .. } | Solid::RoundedCylinder { .. } => triangles(&shape.surface_mesh(SIDES)),
    }
}

fn triangles(mesh: &TriMesh) -> Shape {
    Shape::Mesh { vertices: mesh.vertices.iter().map(|v| (*v).into()).collect(), triangles: mesh.triangles.clone() }
}
