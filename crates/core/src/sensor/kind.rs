//! The quantities that sensors read.

use serde::{Deserialize, Serialize};

/// The quantity that a sensor reads. A reading has 3 numbers, or 1 or 4 where stated. Axes are those of the site unless
/// stated otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum SensorKind {
    /// Acceleration of the site less that of gravity, m/s², the mean over the frame.
    Accelerometer,
    /// Angular velocity, rad/s, at the end of the frame.
    Gyroscope,
    /// Velocity of the site's origin, m/s, at the end of the frame.
    Velocimeter,
    /// Force of a joint, N, the mean over the frame: that of the parent on the child, which carries the site; of a loop joint, that
    /// on its side A, in the axes of the joint on A.
    Force,
    /// Torque of a joint about the site's origin, N·m, with the sign of the force; of a loop joint, about its point on A.
    Torque,
    /// 1 number: sum of the normal forces of contacts on the site's link or rigid body, N, the mean over the frame.
    Touch,
    /// 1 number: distance from the site's origin along its z axis to the next surface of another part, m; −1 for none.
    RangeFinder,
    /// Position of the site's origin, m, in the reference.
    Position,
    /// 4 numbers: orientation of the site in the reference, `x, y, z, w`, with `w ≥ 0`.
    Orientation,
    /// Velocity of the site's origin as the reference sees it, m/s, in the axes of the reference.
    LinearVelocity,
    /// Angular velocity against the reference, rad/s, in the axes of the reference.
    AngularVelocity,
    /// Acceleration of the site's origin, m/s², the mean over the frame, world axes.
    LinearAcceleration,
    /// Angular acceleration, rad/s², the mean over the frame, world axes.
    AngularAcceleration,
    /// 1 number: position of a joint, rad or m.
    JointPosition,
    /// 1 number: velocity of a joint, rad/s or m/s.
    JointVelocity,
    /// 1 number: force of the drive of a joint, N·m or N, the mean over the frame, with what `apply_generalized` adds.
    DriveForce,
    /// An image of distances along the z axis of the site, m; −1 where nothing is: [`World::depth_image`](crate::World::depth_image).
    Depth,
    /// An image of the parts that a camera sees: [`World::segmentation_image`](crate::World::segmentation_image).
    Segmentation,
    /// An image of the colors that a camera sees: [`World::color_image`](crate::World::color_image).
    Color,
}

use SensorKind::*;

impl SensorKind {
    /// All kinds.
    pub const ALL: [SensorKind; 19] = [
        Accelerometer,
        Gyroscope,
        Velocimeter,
        Force,
        Torque,
        Touch,
        RangeFinder,
        Position,
        Orientation,
        LinearVelocity,
        AngularVelocity,
        LinearAcceleration,
        AngularAcceleration,
        JointPosition,
        JointVelocity,
        DriveForce,
        Depth,
        Segmentation,
        Color,
    ];
    /// Their names in Python and in scene files, in the same order.
    pub const NAMES: [&'static str; 19] = [
        "accelerometer",
        "gyroscope",
        "velocimeter",
        "force",
        "torque",
        "touch",
        "range_finder",
        "position",
        "orientation",
        "linear_velocity",
        "angular_velocity",
        "linear_acceleration",
        "angular_acceleration",
        "joint_position",
        "joint_velocity",
        "drive_force",
        "depth",
        "segmentation",
        "color",
    ];

    /// Returns its name in Python and in scene files.
    pub fn name(self) -> &'static str {
        SensorKind::NAMES[self as usize]
    }

    /// Returns the kind of that name.
    pub fn by_name(name: &str) -> Option<SensorKind> {
        SensorKind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Returns how many numbers of the state a reading has: none of an image, which is made when it is read.
    pub fn numbers(self) -> usize {
        match self {
            Touch | RangeFinder | JointPosition | JointVelocity | DriveForce => 1,
            Orientation => 4,
            Depth | Segmentation | Color => 0,
            _ => 3,
        }
    }

    /// Returns whether it reads a position, velocity or drive of a joint.
    pub fn reads_dof(self) -> bool {
        matches!(self, JointPosition | JointVelocity | DriveForce)
    }

    /// Returns whether it reads the force or torque of a joint.
    pub fn reads_joint(self) -> bool {
        matches!(self, Force | Torque)
    }

    /// Returns whether it reads an image.
    pub fn is_camera(self) -> bool {
        matches!(self, Depth | Segmentation | Color)
    }

    /// Returns whether it reads numbers to which noise can be added: an image of parts has none.
    pub fn has_noise(self) -> bool {
        self != Segmentation
    }

    /// Returns whether it may have a reference.
    pub fn has_reference(self) -> bool {
        matches!(self, Position | Orientation | LinearVelocity | AngularVelocity)
    }

    /// Returns whether it must be on a body.
    pub(crate) fn needs_body(self) -> bool {
        matches!(self, Force | Torque | Touch)
    }

    /// Returns whether it needs the impulses of the frame.
    pub(crate) fn needs_loads(self) -> bool {
        matches!(self, Force | Torque | Touch | DriveForce)
    }
}
