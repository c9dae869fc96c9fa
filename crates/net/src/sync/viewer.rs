//! The users' heads and the cave's place in the scene, which are sent as one object among the
//! others (thesis §IV.C, `SidData`).

use super::wire::{ByteReader, MessageError, put_f64};
use tumble_collide::{Pose, Quat, Vec3};

/// Name of the viewer in the object table.
pub const VIEWER_NAME: &str = "SidData";
/// Maximum number of users of a cave.
pub const MAX_USERS: usize = 256;

/// A user, in the cave's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct User {
    /// Head: the origin between the eyes (m), x to the right, y ahead, z up.
    pub head: Pose,
    /// Distance between the eyes, m.
    pub interpupillary_m: f64,
    /// Sequence number of the newest [`Input`](super::Input) of this user that the frame shows; 0
    /// if there is none.
    pub input: u64,
}

/// Users and place of the cave, in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Viewer {
    /// Users in the order of the cave file.
    pub users: Vec<User>,
    /// Pose of the cave's frame in the scene.
    pub cave: Pose,
    /// Meters of the scene per meter of the cave.
    pub scale: f64,
}

impl Default for Viewer {
    fn default() -> Viewer {
        Viewer { users: Vec::new(), cave: Pose::identity(), scale: 1.0 }
    }
}

impl Viewer {
    /// Appends pose (7 numbers), scale, count (u16), and 80 bytes per user. Users beyond
    /// `MAX_USERS` are left out.
    pub fn write(&self, out: &mut Vec<u8>) {
        let users = &self.users[..self.users.len().min(MAX_USERS)];
        put_exact_pose(out, &self.cave);
        put_f64(out, &[self.scale]);
        out.extend((users.len() as u16).to_le_bytes());
        for user in users {
            put_exact_pose(out, &user.head);
            put_f64(out, &[user.interpupillary_m]);
            out.extend(user.input.to_le_bytes());
        }
    }

    /// Reads the bytes of [`write`](Self::write).
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(bytes: &[u8]) -> Result<Viewer, MessageError> {
        let mut rest = ByteReader(bytes);
        let (cave, scale) = (exact_pose(&mut rest)?, rest.f64()?);
        let count = rest.u16()?;
        if count as usize > MAX_USERS || scale <= 0.0 {
            return Err(MessageError::Malformed("more than 256 users, or a scale that is not above 0"));
        }
        let user = |_| Ok(User { head: exact_pose(&mut rest)?, interpupillary_m: rest.f64()?, input: rest.u64()? });
        let users = (0..count).map(user).collect::<Result<_, MessageError>>()?;
        rest.end()?;
        Ok(Viewer { users, cave, scale })
    }
}

/// Appends position, then quaternion as `x, y, z, w`.
pub(crate) fn put_exact_pose(out: &mut Vec<u8>, pose: &Pose) {
    put_f64(out, pose.translation.vector.as_slice());
    put_f64(out, pose.rotation.coords.as_slice());
}

pub(crate) fn exact_pose(bytes: &mut ByteReader<'_>) -> Result<Pose, MessageError> {
    let [x, y, z] = bytes.f64s()?;
    let [i, j, k, w] = bytes.f64s()?;
    let rotation = nalgebra::Quaternion::new(w, i, j, k);
    if (rotation.norm_squared() - 1.0).abs() > 1e-6 {
        return Err(MessageError::Malformed("an orientation that is not of unit length"));
    }
    Ok(Pose::from_parts(Vec3::new(x, y, z).into(), Quat::new_unchecked(rotation)))
}
