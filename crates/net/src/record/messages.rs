//! Conversion between the structs of this module and Foxglove's messages, both ways.

use super::scene::{Entity, Pose, Shape, VisualPart};
use super::schemas::ROOT_FRAME;
use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, FrameTransform, FrameTransforms, Point3, Pose as FoxPose, Quaternion,
    SceneEntity, SceneEntityDeletion, SceneUpdate, SpherePrimitive, Timestamp, TriangleListPrimitive, Vector3,
    scene_entity_deletion,
};
use std::collections::BTreeSet;

const NANOS_PER_SECOND: u64 = 1_000_000_000;

/// Converts simulated seconds to whole nanoseconds, rounded to the nearest. `time_s` is within
/// `0..=MAX_TIME_S`.
pub(crate) fn nanoseconds(time_s: f64) -> u64 {
    (time_s * NANOS_PER_SECOND as f64).round() as u64
}

/// Converts a log time to Foxglove's time stamp. Below `MAX_TIME_S` the seconds fit 32 bits;
/// beyond, they saturate.
pub(crate) fn stamp(log_time: u64) -> Timestamp {
    let seconds = u32::try_from(log_time / NANOS_PER_SECOND).unwrap_or(u32::MAX);
    Timestamp::new(seconds, (log_time % NANOS_PER_SECOND) as u32)
}

/// Returns a message with all entities, and with the removal of names in `before` that are gone.
pub(crate) fn scene_update(log_time: u64, entities: &[Entity], before: &[String]) -> SceneUpdate {
    let present: BTreeSet<&str> = entities.iter().map(|entity| entity.name.as_str()).collect();
    let gone = before.iter().filter(|name| !present.contains(name.as_str()));
    SceneUpdate {
        deletions: gone.map(|name| deletion(log_time, name)).collect(),
        entities: entities.iter().map(|entity| scene_entity(log_time, entity)).collect(),
    }
}

pub(crate) fn deletion(log_time: u64, name: &str) -> SceneEntityDeletion {
    SceneEntityDeletion {
        timestamp: Some(stamp(log_time)),
        r#type: scene_entity_deletion::Type::MatchingId as i32,
        id: name.to_owned(),
    }
}

fn scene_entity(log_time: u64, entity: &Entity) -> SceneEntity {
    let mut out = SceneEntity {
        timestamp: Some(stamp(log_time)),
        frame_id: entity.name.clone(),
        id: entity.name.clone(),
        frame_locked: true,
        ..Default::default()
    };
    for part in &entity.parts {
        push_part(&mut out, part);
    }
    out
}

fn push_part(out: &mut SceneEntity, part: &VisualPart) {
    let pose = Some(fox_pose(&part.pose));
    let color = Some(fox_color(part.color));
    match &part.shape {
        Shape::Sphere { radius } => out.spheres.push(ball(&part.pose, part.color, *radius)),
        Shape::Box { size } => out.cubes.push(CubePrimitive { pose, size: Some(vector(*size)), color }),
        Shape::Cylinder { radius, length } => out.cylinders.push(tube(&part.pose, part.color, *radius, *length)),
        Shape::Capsule { radius, length } => {
            out.cylinders.push(tube(&part.pose, part.color, *radius, *length));
            for end in [-0.5 * length, 0.5 * length] {
                let cap = Pose { position: along_z(&part.pose, end), ..part.pose };
                out.spheres.push(ball(&cap, part.color, *radius));
            }
        }
        Shape::Ellipsoid { size } => out.spheres.push(SpherePrimitive { pose, size: Some(vector(*size)), color }),
        Shape::Cone { radius, height } => {
            let middle = Pose { position: along_z(&part.pose, 0.25 * height), ..part.pose };
            out.cylinders.push(CylinderPrimitive { top_scale: 0.0, ..tube(&middle, part.color, *radius, *height) });
        }
        Shape::Mesh { vertices, triangles } => out.triangles.push(triangle_list(pose, color, vertices, triangles)),
        Shape::Plane { size } => {
            let s = 0.5 * size;
            let corners = [[-s, -s, 0.0], [s, -s, 0.0], [s, s, 0.0], [-s, s, 0.0]];
            out.triangles.push(triangle_list(pose, color, &corners, &[[0, 1, 2], [0, 2, 3]]));
        }
    }
}

fn ball(pose: &Pose, color: [f32; 4], radius: f64) -> SpherePrimitive {
    SpherePrimitive { pose: Some(fox_pose(pose)), size: Some(vector([2.0 * radius; 3])), color: Some(fox_color(color)) }
}

fn tube(pose: &Pose, color: [f32; 4], radius: f64, length: f64) -> CylinderPrimitive {
    CylinderPrimitive {
        pose: Some(fox_pose(pose)),
        size: Some(vector([2.0 * radius, 2.0 * radius, length])),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(fox_color(color)),
    }
}

pub(crate) fn triangle_list(
    pose: Option<FoxPose>,
    color: Option<Color>,
    vertices: &[[f64; 3]],
    triangles: &[[u32; 3]],
) -> TriangleListPrimitive {
    TriangleListPrimitive {
        pose,
        points: vertices.iter().map(|&[x, y, z]| Point3 { x, y, z }).collect(),
        color,
        colors: Vec::new(),
        indices: triangles.as_flattened().to_vec(),
    }
}

/// Returns the point `(0, 0, d)` of the frame `pose`, in its parent: `p + d·R(q)·e_z`.
fn along_z(pose: &Pose, d: f64) -> [f64; 3] {
    let [x, y, z, w] = pose.rotation;
    let axis = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)];
    std::array::from_fn(|k| pose.position[k] + d * axis[k])
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

fn quaternion([x, y, z, w]: [f64; 4]) -> Quaternion {
    Quaternion { x, y, z, w }
}

fn fox_pose(pose: &Pose) -> FoxPose {
    FoxPose { position: Some(vector(pose.position)), orientation: Some(quaternion(pose.rotation)) }
}

pub(crate) fn fox_color(c: [f32; 4]) -> Color {
    Color { r: c[0].into(), g: c[1].into(), b: c[2].into(), a: c[3].into() }
}

/// Returns transforms from the root to each entity, with the numbers still to be set.
pub(crate) fn transforms_for(entities: &[Entity]) -> FrameTransforms {
    let blank = |entity: &Entity| FrameTransform {
        parent_frame_id: ROOT_FRAME.into(),
        child_frame_id: entity.name.clone(),
        ..Default::default()
    };
    FrameTransforms { transforms: entities.iter().map(blank).collect() }
}

/// Sets the numbers of one frame; `poses` has as many elements as the message has transforms.
pub(crate) fn set_transforms(message: &mut FrameTransforms, log_time: u64, poses: &[Pose]) {
    for (transform, pose) in message.transforms.iter_mut().zip(poses) {
        transform.timestamp = Some(stamp(log_time));
        transform.translation = Some(vector(pose.position));
        transform.rotation = Some(quaternion(pose.rotation));
    }
}

/// Returns names and poses of a message. An absent field means the identity, because protobuf's
/// zeros would be no rotation.
pub(crate) fn poses_of(message: FrameTransforms) -> Vec<(String, Pose)> {
    let read = |t: FrameTransform| (t.child_frame_id, read_pose(t.translation, t.rotation));
    message.transforms.into_iter().map(read).collect()
}

fn read_pose(position: Option<Vector3>, rotation: Option<Quaternion>) -> Pose {
    Pose {
        position: position.map_or([0.0; 3], |v| [v.x, v.y, v.z]),
        rotation: rotation.map_or(Pose::IDENTITY.rotation, |q| [q.x, q.y, q.z, q.w]),
    }
}

/// Returns the entities of a message; parts in the order spheres, boxes, cylinders, meshes.
pub(crate) fn entities_of(message: SceneUpdate) -> Vec<Entity> {
    message.entities.into_iter().map(read_entity).collect()
}

fn read_entity(entity: SceneEntity) -> Entity {
    let numbers = |size: Option<Vector3>| size.map_or([0.0; 3], |v| [v.x, v.y, v.z]);
    let mut parts = Vec::new();
    for p in entity.spheres {
        let size = numbers(p.size);
        let shape = match size.iter().all(|x| *x == size[0]) {
            true => Shape::Sphere { radius: size[0] / 2.0 },
            false => Shape::Ellipsoid { size },
        };
        parts.push(read_part(shape, p.pose, p.color));
    }
    for p in entity.cubes {
        parts.push(read_part(Shape::Box { size: numbers(p.size) }, p.pose, p.color));
    }
    for p in entity.cylinders {
        let [diameter, _, length] = numbers(p.size);
        if p.top_scale == 0.0 && p.bottom_scale == 1.0 {
            let mut part = read_part(Shape::Cone { radius: diameter / 2.0, height: length }, p.pose, p.color);
            part.pose.position = along_z(&part.pose, -0.25 * length);
            parts.push(part);
        } else {
            parts.push(read_part(Shape::Cylinder { radius: diameter / 2.0, length }, p.pose, p.color));
        }
    }
    for p in entity.triangles {
        let vertices = p.points.iter().map(|v| [v.x, v.y, v.z]).collect();
        let triangles = p.indices.as_chunks::<3>().0.to_vec();
        parts.push(read_part(Shape::Mesh { vertices, triangles }, p.pose, p.color));
    }
    Entity { name: entity.id, parts }
}

fn read_part(shape: Shape, pose: Option<FoxPose>, color: Option<Color>) -> VisualPart {
    let pose = pose.map_or(Pose::IDENTITY, |p| read_pose(p.position, p.orientation));
    let color = color.map_or([0.0; 4], |c| [c.r as f32, c.g as f32, c.b as f32, c.a as f32]);
    VisualPart { shape, pose, color }
}
