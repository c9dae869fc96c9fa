//! Input of a user on its way to the server (thesis §III.C): head, wand, hands, buttons and keys.

use super::viewer::{MAX_USERS, exact_pose, put_exact_pose};
use super::wire::{ByteReader, MessageError};
use tumble_collide::Pose;

/// Maximum number of keys held at a time.
pub const MAX_KEYS: usize = 32;

/// State of one user's devices. Each message holds the whole state, so the next message repairs the
/// loss of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Number of the message, one higher for each message of a user; it wraps. The frame that shows
    /// the input carries this number ([`User::input`](super::User::input)).
    pub sequence: u64,
    /// Index of the user in the cave file.
    pub user: u16,
    /// Head in the cave's frame if it is tracked: origin between the eyes (m), x to the right, y
    /// ahead, z up.
    pub head: Option<Pose>,
    /// Wand in the cave's frame, if there is one. It points along its y axis.
    pub wand: Option<Pose>,
    /// Left and right hand in the cave's frame if they are tracked, with the axes of the head.
    pub hands: [Option<Pose>; 2],
    /// Bit mask of the wand's held buttons. Bit 0 picks and pulls.
    pub buttons: u32,
    /// Held keys by USB HID usage (page 7), at most [`MAX_KEYS`]; further keys are left out.
    pub keys: Vec<u16>,
}

impl Input {
    /// Appends the message.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.sequence.to_le_bytes());
        out.extend(self.user.to_le_bytes());
        let poses = [self.head, self.wand, self.hands[0], self.hands[1]];
        let flags = (0..4).fold(0, |flags, k| flags | u8::from(poses[k].is_some()) << k);
        out.extend([flags, self.keys.len().min(MAX_KEYS) as u8]);
        out.extend(self.buttons.to_le_bytes());
        poses.iter().flatten().for_each(|pose| put_exact_pose(out, pose));
        self.keys.iter().take(MAX_KEYS).for_each(|key| out.extend(key.to_le_bytes()));
    }

    /// Reads the message.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &[u8]) -> Result<Input, MessageError> {
        let mut rest = ByteReader(payload);
        let (sequence, user, flags, keys, buttons) = (rest.u64()?, rest.u16()?, rest.u8()?, rest.u8()?, rest.u32()?);
        if flags > 15 || keys as usize > MAX_KEYS || user as usize >= MAX_USERS {
            return Err(MessageError::Malformed("an unknown flag, too many keys, or an unknown user"));
        }
        let mut pose = |bit: u8| if flags & bit != 0 { exact_pose(&mut rest).map(Some) } else { Ok(None) };
        let (head, wand, hands) = (pose(1)?, pose(2)?, [pose(4)?, pose(8)?]);
        let keys = (0..keys).map(|_| rest.u16()).collect::<Result<_, _>>()?;
        rest.end()?;
        Ok(Input { sequence, user, head, wand, hands, buttons, keys })
    }
}
