//! Conversion of a world to the entities and poses of a recording.

use crate::names::{Names, Site, shortened};
use crate::record::{
    Contact, Deforming, Entity, Images, MAX_CONTACTS, MAX_EVENTS, Pixels, Point, Pose, Readings, RecordedEvent,
    RecordedImage, Shape, Surface, VisualPart,
};
use nalgebra::Translation3;
use std::collections::BTreeMap;
use tumble_collide::{Shape as Solid, TriMesh, Vec3};
use tumble_core::{ArticulatedBody, ContactPoint, Drawn, Event, EventKind, ObjectId, RigidBody, Visual, World};

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

/// Returns every body and every link as one entity, fixed links too. A link has the name `BODY/LINK`, or `BODY/NUMBER` with its
/// index in [`Model::frames`](tumble_core::Model::frames) if a link of the body has no name, or another entity the same one; a
/// part of another object with several parts has `OBJECT/NUMBER`. The nodes of a surface are no entities ([`deforming`] has
/// the surface). A name of more than [`MAX_NAME_BYTES`](crate::record::MAX_NAME_BYTES) is replaced by its beginning and a
/// hash of the whole.
pub fn entities(world: &World) -> Vec<Entity> {
    let names = Names::of(world);
    sites(world).map(|site| Entity { name: names.site(site), parts: drawn_parts(world, site) }).collect()
}

/// Returns the poses of the entities, in the order of [`entities`].
pub fn poses(world: &World) -> Vec<Pose> {
    sites(world).filter_map(|site| site_pose(world, site)).map(|frame| pose(&frame)).collect()
}

/// Returns the contacts of the last step between the [`entities`] whose surfaces touch. Of more
/// than [`MAX_CONTACTS`], those with the largest forces are kept, the largest first.
pub fn contacts(world: &World) -> Vec<Contact> {
    let index: BTreeMap<Site, u32> = sites(world).zip(0..).collect();
    let entity = |id, part| index.get(&Site::of_part(world, id, part)?).copied();
    let contact = |c: &ContactPoint| {
        Some(Contact {
            a: entity(c.a, c.part_a)?,
            b: entity(c.b, c.part_b)?,
            shapes: [shape_number(world, c.a, c.part_a, c.shape_a), shape_number(world, c.b, c.part_b, c.shape_b)],
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

/// Returns the images of all cameras by name; long names as those of [`entities`], whose indices are in segmentations. Each image
/// is made now.
pub fn images(world: &World) -> Images {
    let index: BTreeMap<Site, u32> = sites(world).zip(0..).collect();
    let entity = |part: Option<(ObjectId, usize)>| {
        let (id, part) = part?;
        index.get(&Site::of_part(world, id, part)?).copied()
    };
    let one = |id| {
        let (width, height, pixels) = if let Some(image) = world.depth_image(id) {
            (image.width, image.height, Pixels::Depth(image.pixels.iter().map(|depth| *depth as f32).collect()))
        } else if let Some(image) = world.color_image(id) {
            (image.width, image.height, Pixels::Color(image.pixels))
        } else {
            let image = world.segmentation_image(id)?;
            (image.width, image.height, Pixels::Parts(image.pixels.into_iter().map(entity).collect()))
        };
        let image = RecordedImage { width: width as u32, height: height as u32, pixels };
        Some((shortened(world.name(id)?.to_owned()), image))
    };
    world.sensors().filter_map(one).collect()
}

/// Returns the events of the last step, at most [`MAX_EVENTS`], the first ones, with the names of [`entities`].
pub fn events(world: &World) -> Vec<RecordedEvent> {
    let kind =
        |event: &Event| EventKind::NAMES.iter().find(|(_, kind)| *kind == event.kind).map_or("", |(name, _)| name);
    let names = Names::of(world);
    let one = |event: &Event| {
        let sides = [(Some(event.a), event.part_a, event.shape_a), (event.b, event.part_b, event.shape_b)];
        let pairs = event.is_of_parts();
        let side = |(id, part, _): (Option<ObjectId>, usize, usize)| {
            let site = Site::of_part(world, id?, part).filter(|_| pairs);
            Some(site.map_or_else(|| names.object(id.unwrap_or_default()), |site| names.site(site)))
        };
        let link = |(id, part, _): (Option<ObjectId>, usize, usize)| {
            world.part_name(id?, part).filter(|_| pairs).map(|link| shortened(link.to_owned()))
        };
        let shape_name = |(id, part, shape): (Option<ObjectId>, usize, usize)| {
            world.shape_name(id?, part, shape).filter(|_| event.has_shapes()).map(|name| shortened(name.to_owned()))
        };
        let [a, b] = sides.map(side);
        RecordedEvent {
            kind: kind(event).to_owned(),
            a: a.unwrap_or_default(),
            b,
            bodies: sides.map(|(id, _, _)| id.map(|id| names.object(id))),
            links: sides.map(link),
            shapes: sides.map(|(id, part, shape)| id.map_or(0, |id| shape_number(world, id, part, shape))),
            shape_names: sides.map(shape_name),
            impulse: event.impulse.into(),
            point: event.point.into(),
        }
    };
    world.events().iter().take(MAX_EVENTS).map(one).collect()
}

/// Shows recorded contacts in a world that has the same entities, as those of its last step.
/// Velocities and impulses are not recorded and are zero.
pub fn show_contacts(world: &mut World, contacts: &[Contact]) {
    let entities: Vec<Site> = sites(world).collect();
    let side = |entity: u32, shape: u32| match *entities.get(entity as usize)? {
        Site::Part(id, part) => Some((id, part, shape as usize)),
        Site::Link(id, link) => {
            let (part, shape, _) = world.get::<ArticulatedBody>(id)?.shapes_of(link).nth(shape as usize)?;
            Some((id, part, shape))
        }
    };
    let point = |c: &Contact| {
        let sides = [side(c.a, c.shapes[0])?, side(c.b, c.shapes[1])?];
        Some(ContactPoint::shown(sides, c.point.into(), c.normal.into(), c.depth, c.force.into()))
    };
    let shown: Vec<ContactPoint> = contacts.iter().filter_map(point).collect();
    world.replica().set_contacts(shown);
}

/// Returns the number of a shape among those of its body or link, for the part and the index that contacts report.
fn shape_number(world: &World, id: ObjectId, part: usize, shape: usize) -> u32 {
    world.get::<ArticulatedBody>(id).map_or(shape, |body| body.shape_number(part, shape)) as u32
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
    let names = Names::of(world);
    sites(world).map(|site| names.site(site)).collect()
}

fn sites(world: &World) -> impl Iterator<Item = Site> + '_ {
    let whole = |id: ObjectId| world.object(id).and_then(|o| o.renderable()).is_some_and(|r| r.surface().is_some());
    let parts = move |id: ObjectId| {
        if whole(id) { 0 } else { world.view().state_range(id).map_or(0, |span| span.parts.len()) }
    };
    world.ids().iter().flat_map(move |&id| {
        let links = world.get::<ArticulatedBody>(id).map(|body| body.model().frames().len());
        (0..links.unwrap_or_else(|| parts(id))).map(move |number| match links {
            Some(_) => Site::Link(id, number),
            None => Site::Part(id, number),
        })
    })
}

/// Returns the present pose of a site in the world.
fn site_pose(world: &World, site: Site) -> Option<tumble_collide::Pose> {
    match site {
        Site::Part(id, part) => world.pose(id, part),
        Site::Link(id, link) => {
            let model = world.get::<ArticulatedBody>(id)?.model();
            let frame = model.frames().get(link)?;
            Some(world.pose(id, frame.link.unwrap_or(model.links().len()))? * frame.pose)
        }
    }
}

fn drawn_parts(world: &World, site: Site) -> Vec<VisualPart> {
    let part = |visual: &Visual, frame: &tumble_collide::Pose| {
        let [r, g, b] = visual.appearance.color;
        let color = [r, g, b, 1.0].map(f64::from).map(|c| c as _);
        Some(VisualPart { shape: drawn(visual.drawn()?), pose: pose(&(frame * visual.pose)), color })
    };
    match site {
        Site::Part(id, number) => {
            let visuals = world.object(id).and_then(|o| o.renderable()).map_or(&[][..], |r| r.visuals());
            let center = world.get::<RigidBody>(id).map_or(Vec3::zeros(), RigidBody::center_of_mass);
            let frame = tumble_collide::Pose::from(Translation3::from(center));
            visuals.iter().filter(|v| v.part == number).filter_map(|v| part(v, &frame)).collect()
        }
        Site::Link(id, link) => {
            let Some(body) = world.get::<ArticulatedBody>(id) else { return Vec::new() };
            let frame = body.model().frames()[link].pose.inverse();
            body.visuals_of_links().filter(|(of, _)| *of == link).filter_map(|(_, v)| part(v, &frame)).collect()
        }
    }
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
