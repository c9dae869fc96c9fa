//! Decoder of a tracker's messages (Open Sound Control 1.0, parsed by `rosc`).
//!
//! | address | arguments |
//! |---|---|
//! | `/tumble/user/NAME/head` | `x y z qx qy qz qw`: position in m and unit quaternion in the tracker's axes; the origin is between the eyes, x to the right, y ahead, z up for `z_up` |
//! | `/tumble/user/NAME/hand/left`, `…/hand/right` | the same; without arguments: not tracked |
//! | `/tumble/user/NAME/wand` | the same; it points along its y axis |
//! | `/tumble/user/NAME/buttons` | one number: bit mask of the wand's held buttons; the first picks and pulls |
//! | `/tumble/user/NAME/keys` | held keys by USB HID usage; no arguments for none |
//!
//! Numbers may be float, double or int. A message can only move a user. Invalid messages are
//! counted by reason and have no effect.

use super::dtrack;
use rosc::{OscMessage, OscPacket, OscType};
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::Instant;
use tumble::collide::{Pose, Quat, Vec3};
use tumble::net::sync::{Input, MAX_KEYS};
use tumble::scene::cave::{Axes, DeviceMap, Tracker};

/// Maximum length of a datagram, bytes.
pub const MAX_DATAGRAM_BYTES: usize = 1536;
/// Maximum number of messages in a datagram.
const MAX_MESSAGES: usize = 64;
/// Maximum distance of a pose from the origin, m.
const MAX_DISTANCE_M: f64 = 100.0;
/// Tolerance for the length of a quaternion in single precision.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Reason for which a datagram or message was dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Dropped {
    /// From an address that is not among the senders.
    UnknownSender,
    /// More than the limit in a tenth of a second, or in one datagram.
    TooMany,
    /// A datagram longer than [`MAX_DATAGRAM_BYTES`].
    TooLong,
    /// Not OSC, or not the output of DTrack.
    Malformed,
    /// An address with another prefix or suffix.
    UnknownAddress,
    /// For a user that the cave does not have.
    UnknownUser,
    /// Wrong number or type of arguments.
    Arguments,
    /// Not finite, or more than 100 m from the origin.
    OutOfRange,
    /// A quaternion that is not of unit length.
    InvalidRotation,
}

impl Dropped {
    /// Returns the name in reports and summaries.
    pub fn name(self) -> &'static str {
        match self {
            Dropped::UnknownSender => "unknown_sender",
            Dropped::TooMany => "too_many",
            Dropped::TooLong => "too_long",
            Dropped::Malformed => "malformed",
            Dropped::UnknownAddress => "unknown_address",
            Dropped::UnknownUser => "unknown_user",
            Dropped::Arguments => "arguments",
            Dropped::OutOfRange => "out_of_range",
            Dropped::InvalidRotation => "invalid_rotation",
        }
    }
}

/// Counts of received data. They wrap.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Datagrams.
    pub datagrams: u64,
    /// Applied messages.
    pub taken: u64,
    /// Dropped datagrams and messages, by reason.
    pub dropped: BTreeMap<&'static str, u64>,
}

/// Input of a user, and when it was received.
#[derive(Clone, Debug)]
pub struct TrackedInput {
    pub input: Input,
    /// Receipt of the last message for the user.
    pub received: Instant,
    /// Receipt of the head's pose.
    pub head_received: Option<Instant>,
}

/// State of one user's devices.
#[derive(Clone, Debug, Default)]
struct TrackedUser {
    head: Option<Pose>,
    wand: Option<Pose>,
    hands: [Option<Pose>; 2],
    buttons: u32,
    keys: Vec<u16>,
    /// Receipt of the last message that has not been returned yet.
    fresh: Option<Instant>,
    head_received: Option<Instant>,
    sequence: u64,
}

/// Decoder of a tracker's datagrams, without socket and clock.
pub struct OscDecoder {
    names: Vec<String>,
    senders: Vec<IpAddr>,
    /// Tracker to cave: `x_cave = rotation · x + origin`; orientations `rotation · q · rotation⁻¹`.
    rotation: Quat,
    origin: Vec3,
    /// Bodies of DTrack that move users; empty for a tracker that sends OSC.
    dtrack_map: Vec<DeviceMap>,
    users: Vec<TrackedUser>,
    pub counts: Counts,
}

impl OscDecoder {
    /// Creates the decoder.
    pub fn new(tracker: &Tracker) -> OscDecoder {
        let rotation = match tracker.axes {
            Axes::ZUp => Quat::identity(),
            // y becomes z, z becomes −y
            Axes::YUp => Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::FRAC_PI_2),
        };
        let users = vec![TrackedUser::default(); tracker.users.len()];
        OscDecoder {
            names: tracker.users.clone(),
            senders: tracker.senders.clone(),
            rotation,
            origin: tracker.origin_m.into(),
            dtrack_map: tracker.dtrack_map.clone(),
            users,
            counts: Counts::default(),
        }
    }

    /// Returns whether datagrams from this address are accepted: it is among the senders, or there
    /// are none.
    pub fn knows(&self, from: IpAddr) -> bool {
        self.senders.is_empty() || self.senders.iter().any(|known| known.to_canonical() == from.to_canonical())
    }

    /// Counts a datagram that is dropped unread.
    pub fn skip(&mut self, why: Dropped) {
        self.counts.datagrams = self.counts.datagrams.wrapping_add(1);
        self.drop(why);
    }

    fn drop(&mut self, why: Dropped) {
        let count = self.counts.dropped.entry(why.name()).or_default();
        *count = count.wrapping_add(1);
    }

    /// Decodes a datagram that was received at a time. One longer than [`MAX_DATAGRAM_BYTES`] may be truncated behind that
    /// length.
    pub fn take(&mut self, at: Instant, from: IpAddr, bytes: &[u8]) {
        self.counts.datagrams = self.counts.datagrams.wrapping_add(1);
        if !self.knows(from) {
            return self.drop(Dropped::UnknownSender);
        }
        if bytes.len() > MAX_DATAGRAM_BYTES {
            return self.drop(Dropped::TooLong);
        }
        if !self.dtrack_map.is_empty() {
            return match dtrack::messages(bytes, &self.dtrack_map) {
                Ok(messages) => messages.iter().for_each(|message| self.apply_one(at, message)),
                Err(why) => self.drop(why),
            };
        }
        let packet = match rosc::decoder::decode_udp(bytes) {
            Ok(([], packet)) => packet,
            _ => return self.drop(Dropped::Malformed),
        };
        let (mut waiting, mut count) = (vec![packet], 0);
        while let Some(packet) = waiting.pop() {
            match packet {
                OscPacket::Bundle(bundle) => waiting.extend(bundle.content.into_iter().rev()),
                OscPacket::Message(_) if count == MAX_MESSAGES => return self.drop(Dropped::TooMany),
                OscPacket::Message(message) => {
                    count += 1;
                    self.apply_one(at, &message);
                }
            }
        }
    }

    /// Applies a message that was received at a time, or counts why not.
    pub(super) fn apply_one(&mut self, at: Instant, message: &OscMessage) {
        match self.apply(at, message) {
            Ok(()) => self.counts.taken = self.counts.taken.wrapping_add(1),
            Err(why) => self.drop(why),
        }
    }

    fn apply(&mut self, at: Instant, message: &OscMessage) -> Result<(), Dropped> {
        let rest = message.addr.strip_prefix("/tumble/user/").ok_or(Dropped::UnknownAddress)?;
        let (name, what) = rest.split_once('/').ok_or(Dropped::UnknownAddress)?;
        let user = self.names.iter().position(|n| n == name).ok_or(Dropped::UnknownUser)?;
        let args = &message.args;
        let mut next = self.users[user].clone();
        match what {
            "head" => {
                (next.head, next.head_received) = (Some(self.pose(args)?.ok_or(Dropped::Arguments)?), Some(at));
            }
            "wand" => next.wand = self.pose(args)?,
            "hand/left" => next.hands[0] = self.pose(args)?,
            "hand/right" => next.hands[1] = self.pose(args)?,
            "buttons" => {
                let [held] = whole::<u32>(args)?[..] else { return Err(Dropped::Arguments) };
                next.buttons = held;
            }
            "keys" if args.len() <= MAX_KEYS => next.keys = whole(args)?,
            "keys" => return Err(Dropped::Arguments),
            _ => return Err(Dropped::UnknownAddress),
        }
        self.users[user] = TrackedUser { fresh: Some(at), ..next };
        Ok(())
    }

    /// Returns a pose in the cave's frame; `None` without arguments.
    fn pose(&self, args: &[OscType]) -> Result<Option<Pose>, Dropped> {
        if args.is_empty() {
            return Ok(None);
        }
        let numbers: Vec<f64> = args.iter().map(number).collect::<Option<_>>().ok_or(Dropped::Arguments)?;
        let [x, y, z, i, j, k, w] = numbers[..] else { return Err(Dropped::Arguments) };
        let (position, rotation) = (Vec3::new(x, y, z), nalgebra::Quaternion::new(w, i, j, k));
        // also false for NaN
        if !numbers.iter().all(|n| n.is_finite()) || position.norm() > MAX_DISTANCE_M {
            return Err(Dropped::OutOfRange);
        }
        if (rotation.norm() - 1.0).abs() > UNIT_TOLERANCE {
            return Err(Dropped::InvalidRotation);
        }
        let rotation = self.rotation * Quat::from_quaternion(rotation) * self.rotation.inverse();
        Ok(Some(Pose::from_parts((self.rotation * position + self.origin).into(), rotation)))
    }

    /// Returns the users' input that changed since the last call.
    pub fn inputs(&mut self) -> Vec<TrackedInput> {
        let mut inputs = Vec::new();
        for (k, user) in self.users.iter_mut().enumerate() {
            let Some(received) = user.fresh.take() else { continue };
            user.sequence = user.sequence.wrapping_add(1);
            // without a wand the right hand takes its place
            let wand = user.wand.or(user.hands[1]);
            let TrackedUser { head, hands, buttons, ref keys, sequence, head_received, .. } = *user;
            let input = Input { sequence, user: k as u16, head, wand, hands, buttons, keys: keys.clone() };
            inputs.push(TrackedInput { input, received, head_received });
        }
        inputs
    }
}

fn number(argument: &OscType) -> Option<f64> {
    match *argument {
        OscType::Float(x) => Some(x.into()),
        OscType::Double(x) => Some(x),
        OscType::Int(x) => Some(x.into()),
        _ => None,
    }
}

fn whole<T: TryFrom<i64>>(arguments: &[OscType]) -> Result<Vec<T>, Dropped> {
    let one = |argument: &OscType| match *argument {
        OscType::Int(x) => T::try_from(x.into()).ok(),
        OscType::Long(x) => T::try_from(x).ok(),
        _ => None,
    };
    arguments.iter().map(one).collect::<Option<_>>().ok_or(Dropped::Arguments)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;

    fn decoder() -> OscDecoder {
        let user = |name: &str| tumble::scene::cave::User {
            name: name.into(),
            eye_m: nalgebra::Point3::origin(),
            forward: Vec3::y(),
            up: Vec3::z(),
            interpupillary_m: 0.06,
        };
        OscDecoder::new(&Tracker { senders: vec![Ipv4Addr::LOCALHOST.into()], ..Tracker::of(&[user("a"), user("b")]) })
    }

    /// `/tumble/user/a/head`, seven floats: one meter up, no rotation.
    fn head() -> Vec<u8> {
        let mut bytes = b"/tumble/user/a/head\0,fffffff\0\0\0\0".to_vec();
        [0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0].iter().for_each(|x| bytes.extend(x.to_be_bytes()));
        bytes
    }

    #[test]
    fn only_listed_senders_are_heard() {
        let mut decoder = decoder();
        decoder.take(Instant::now(), Ipv4Addr::new(10, 0, 0, 7).into(), &head());
        assert!(decoder.inputs().is_empty() && decoder.counts.dropped["unknown_sender"] == 1);
        decoder.take(Instant::now(), Ipv4Addr::LOCALHOST.into(), &head());
        let inputs = decoder.inputs();
        assert_eq!(
            (inputs.len(), inputs[0].input.user, inputs[0].input.sequence, inputs[0].input.head.unwrap().translation.z),
            (1, 0, 1, 1.0)
        );
        // returned once
        assert!(decoder.inputs().is_empty());
        // as a dual-stack socket reports the same sender
        decoder.take(Instant::now(), Ipv4Addr::LOCALHOST.to_ipv6_mapped().into(), &head());
        assert!(decoder.inputs().len() == 1 && decoder.counts.dropped["unknown_sender"] == 1);
    }

    /// A million packets: random bytes, and a valid one with random changes, cuts and repeats. All
    /// are counted, and none has an effect that a valid message cannot have.
    #[test]
    fn a_million_random_packets_do_no_harm() {
        let (mut decoder, good) = (decoder(), head());
        let mut x = 0x9E37_79B9_7F4A_7C15u64;
        let mut random = |max: usize| {
            // xorshift (Marsaglia 2003)
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            (x >> 11) as usize % max
        };
        let mut bytes = Vec::new();
        for round in 0..1_000_000u32 {
            bytes.clear();
            if round % 2 == 0 {
                let first = [b'/', b'#', 0, b',', random(256) as u8][random(5)];
                bytes.push(first);
                bytes.extend((0..random(96)).map(|_| random(256) as u8));
            } else {
                (0..1 + random(2)).for_each(|_| bytes.extend(&good));
                (0..random(4)).for_each(|_| {
                    let at = random(bytes.len());
                    bytes[at] = random(256) as u8;
                });
                bytes.truncate(1 + random(2 * bytes.len()));
            }
            decoder.take(Instant::now(), Ipv4Addr::LOCALHOST.into(), &bytes);
        }
        assert_eq!(decoder.counts.datagrams, 1_000_000);
        assert_eq!(decoder.counts.taken + decoder.counts.dropped.values().sum::<u64>(), 1_000_000);
        assert!(decoder.counts.taken > 10_000 && decoder.counts.dropped["malformed"] > 100_000, "{:?}", decoder.counts);
        for TrackedInput { input, .. } in decoder.inputs() {
            for pose in [input.head, input.wand, input.hands[0], input.hands[1]].into_iter().flatten() {
                assert!(pose.translation.vector.norm() <= MAX_DISTANCE_M && (pose.rotation.norm() - 1.0).abs() < 1e-12);
            }
        }
    }
}
