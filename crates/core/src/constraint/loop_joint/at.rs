//! Loop joints between parts in their present poses.

use super::{LoopJoint, LoopJointError, LoopJointKind, PartRef};
use crate::ObjectId;
use crate::world::World;
use nalgebra::{Rotation3, Translation3};
use tumble_collide::{Mat3, Pose, Quat, Vec3};

/// One side of a loop joint: a frame fixed to a part, or to the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Object and part; `None` for the world.
    pub part: Option<(ObjectId, usize)>,
    /// The frame in the part's axes, or in the world's if there is no part; m.
    pub frame: Pose,
    /// The link whose shapes a touch sensor reads, an index in [`Model::frames`](crate::Model::frames) of an articulated
    /// body; `None` for the link of the part. Nothing else reads it.
    pub link: Option<usize>,
}

impl Anchor {
    /// Returns a frame of the world.
    pub fn world(frame: Pose) -> Anchor {
        Anchor { part: None, frame, link: None }
    }

    /// Returns a frame fixed to one part of an object.
    pub fn on(id: ObjectId, part: usize, frame: Pose) -> Anchor {
        Anchor { part: Some((id, part)), frame, link: None }
    }

    /// Returns whether it is fixed to a part of an object.
    pub(crate) fn is_on(&self, other: ObjectId) -> bool {
        self.part.is_some_and(|(id, _)| id == other)
    }
}

/// The place of a joint, in the world at present.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointPlace {
    /// Origin of both frames, or of A's frame for kinds with a length, m.
    pub point: Vec3,
    /// Origin of B's frame, m, of gears, racks and kinds with a length; `None` for `point`.
    pub second_point: Option<Vec3>,
    /// The z axis of both frames, of any length above 0.
    pub axis: Vec3,
    /// The x axis of both frames, made perpendicular to `axis`; `None` for any. That of planar and spherical joints is by default the axis of the
    /// world that follows, in the order x, y, z, x, the one nearest to `axis`. For a universal joint
    /// the axis that is fixed to B; for gears and racks the z axis of B, `axis` by default.
    pub second_axis: Option<Vec3>,
    /// Points of the world over which the rope of a pulley runs, m; zero for other kinds.
    pub ground: [Vec3; 2],
}

impl JointPlace {
    /// Returns a place at a point, with the z axis of the world.
    pub fn at(point: Vec3) -> JointPlace {
        JointPlace { point, second_point: None, axis: Vec3::z(), second_axis: None, ground: [Vec3::zeros(); 2] }
    }

    /// Returns a place on a line: a point and a direction of any length above 0.
    pub fn on_line(point: Vec3, axis: Vec3) -> JointPlace {
        JointPlace { axis, ..JointPlace::at(point) }
    }

    /// Returns a place between two points.
    pub fn between(point: Vec3, second_point: Vec3) -> JointPlace {
        JointPlace { second_point: Some(second_point), ..JointPlace::at(point) }
    }

    /// Returns the place of a pulley: the ends of its rope, and the points of the world over which it runs.
    pub fn over(points: [Vec3; 2], ground: [Vec3; 2]) -> JointPlace {
        JointPlace { ground, ..JointPlace::between(points[0], points[1]) }
    }

    /// Returns this place with a second axis.
    #[must_use]
    pub fn with_second_axis(mut self, axis: Vec3) -> Self {
        self.second_axis = Some(axis);
        self
    }
}

impl LoopJoint {
    /// Joins two parts in their present poses; without a part the side is the world. A distance, a rope
    /// and a spring get their present length.
    ///
    /// # Errors
    /// [`LoopJointError`] if the sides are the same, a part does not exist, or the place is not valid.
    pub fn joining(
        name: impl Into<String>,
        kind: LoopJointKind,
        world: &World,
        a: PartRef,
        b: PartRef,
        place: JointPlace,
    ) -> Result<LoopJoint, LoopJointError> {
        let name = name.into();
        let JointPlace { point, second_point, axis, second_axis, ground } = place;
        let second_point = second_point.unwrap_or(point);
        let own_axes = matches!(kind, LoopJointKind::Gear | LoopJointKind::Rack);
        let next = || Vec3::ith((axis.iamax() + 1) % 3, 1.0);
        let second_axis = match kind {
            LoopJointKind::Planar | LoopJointKind::Spherical => Some(second_axis.unwrap_or_else(next)),
            _ => second_axis,
        };
        let (second_z, second_x) = if own_axes { (second_axis.unwrap_or(axis), None) } else { (axis, second_axis) };
        let directions = [Some(axis), second_axis].into_iter().flatten();
        if [point, second_point].into_iter().chain(ground).chain(directions).any(|v| v.iter().any(|x| !x.is_finite())) {
            return Err(LoopJointError::NotFinite(name));
        }
        if second_point != point && !(kind.has_length() || own_axes) {
            return Err(LoopJointError::Parameter { name, kind, parameter: "second_point" });
        }
        let rotations = [rotation(&name, axis, second_x)?, rotation(&name, second_z, second_x)?];
        let points = [point, if kind.has_length() || own_axes { second_point } else { point }];
        let frames = [0, 1].map(|side| Pose::from_parts(Translation3::from(points[side]), rotations[side]));
        let mut sides = frames.map(Anchor::world);
        for ((side, part), frame) in sides.iter_mut().zip([a, b]).zip(frames) {
            if let Some((id, part)) = part {
                let part_state =
                    world.part_state(id, part).ok_or_else(|| LoopJointError::Gone { name: name.clone(), part })?;
                *side = Anchor::on(id, part, part_state.pose.inverse() * frame);
            }
        }
        let joint = LoopJoint::new(name, kind, sides[0], sides[1])?;
        let mut joint = joint.with_transmission(|t| (t.references, t.ground) = (frames, ground))?;
        if kind.has_length() && kind != LoopJointKind::Pulley {
            joint.set_length((points[0] - points[1]).norm())?;
        }
        Ok(joint)
    }

    /// Joins two parts in their present poses by a spherical joint at a world point (m).
    ///
    /// # Errors
    /// As [`joining`](Self::joining).
    pub fn spherical_at(
        name: impl Into<String>,
        world: &World,
        a: PartRef,
        b: PartRef,
        point: Vec3,
    ) -> Result<LoopJoint, LoopJointError> {
        LoopJoint::joining(name, LoopJointKind::Spherical, world, a, b, JointPlace::at(point))
    }

    /// Joins two parts in their present poses by a revolute joint at a world point (m) about a
    /// world axis (any length but 0).
    ///
    /// # Errors
    /// As [`joining`](Self::joining).
    pub fn revolute_at(
        name: impl Into<String>,
        world: &World,
        a: PartRef,
        b: PartRef,
        point: Vec3,
        axis: Vec3,
    ) -> Result<LoopJoint, LoopJointError> {
        LoopJoint::joining(name, LoopJointKind::Revolute, world, a, b, JointPlace::on_line(point, axis))
    }

    /// Joins two parts rigidly in their present poses. The world point (m) is the origin of both
    /// frames; it affects only the reported errors and the torque.
    ///
    /// # Errors
    /// As [`joining`](Self::joining).
    pub fn fixed_at(
        name: impl Into<String>,
        world: &World,
        a: PartRef,
        b: PartRef,
        point: Vec3,
    ) -> Result<LoopJoint, LoopJointError> {
        LoopJoint::joining(name, LoopJointKind::Fixed, world, a, b, JointPlace::at(point))
    }

    /// Joins two parts in their present poses by a prismatic joint along a world axis (any length
    /// but 0) through a world point (m).
    ///
    /// # Errors
    /// As [`joining`](Self::joining).
    pub fn prismatic_at(
        name: impl Into<String>,
        world: &World,
        a: PartRef,
        b: PartRef,
        point: Vec3,
        axis: Vec3,
    ) -> Result<LoopJoint, LoopJointError> {
        LoopJoint::joining(name, LoopJointKind::Prismatic, world, a, b, JointPlace::on_line(point, axis))
    }
}

/// Returns the orientation of a frame by its z axis and its x axis, which is made perpendicular.
fn rotation(name: &str, z: Vec3, x: Option<Vec3>) -> Result<Quat, LoopJointError> {
    let Some(z) = z.try_normalize(0.0) else { return Err(LoopJointError::Axis(name.into())) };
    let x = match x {
        None => z.cross(&Vec3::ith(z.iamin(), 1.0)).normalize(),
        Some(x) if x == Vec3::zeros() => return Err(LoopJointError::Axis(name.into())),
        Some(x) => match (x.normalize() - z * z.dot(&x.normalize())).try_normalize(1e-6) {
            Some(x) => x,
            None => return Err(LoopJointError::Parallel(name.into())),
        },
    };
    let axes = Mat3::from_columns(&[x, z.cross(&x), z]);
    Ok(Quat::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)))
}
