//! Gamepads by the joystick interface of Linux (`/dev/input/js0` and so on), without a library.
//!
//! A gamepad is a keyboard: it holds the keys by which a user walks and turns, and pressed buttons are
//! the digits that scripted events know. Events have 8 bytes: time (u32, ms), value (i16), kind (1
//! button, 2 axis; 128 is added to the state at the beginning), number.
//!
//! | | |
//! |---|---|
//! | left stick, cross | W A S D: walk |
//! | right stick, to the sides | arrow keys: turn |
//! | triggers | Q and E: down and up |
//! | shoulder buttons | V and B: hands |
//! | buttons 0 to 3, 6 to 10 | digits 1 to 9 |
//!
//! Numbers are those that the kernel gives pads with two sticks.

use crate::cave::simulation::key;
use crate::failure::Failure;
use rustix::io::ioctl_fionbio;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tumble::net::sync::Input;

/// Number of devices that are looked for.
const MAX_DEVICES: usize = 16;
/// Length of an event, bytes.
const EVENT_BYTES: usize = 8;
/// Maximum number of events of a frame; the rest waits for the next one.
const MAX_EVENTS: usize = 256;
/// Part of the way of a stick at which it counts as pushed.
const PUSHED: i16 = i16::MAX / 2;
/// Interval at which a device is looked for again.
const RETRY_INTERVAL: Duration = Duration::from_secs(1);
/// Interval at which held keys are sent again, because inputs expire.
const RESEND_INTERVAL: Duration = Duration::from_millis(250);

/// Axes with the keys of their two directions; up and left are negative. Triggers rest at the negative
/// end, so they have one.
const AXES: [(u8, Option<u16>, Option<u16>); 7] = [
    (0, Some(key::A), Some(key::D)),
    (1, Some(key::W), Some(key::S)),
    (2, None, Some(key::Q)),
    (3, Some(key::LEFT), Some(key::RIGHT)),
    (5, None, Some(key::E)),
    (6, Some(key::A), Some(key::D)),
    (7, Some(key::W), Some(key::S)),
];
/// Keys of buttons.
const BUTTONS: [(u8, u16); 11] = [
    (0, DIGIT_1),
    (1, DIGIT_1 + 1),
    (2, DIGIT_1 + 2),
    (3, DIGIT_1 + 3),
    (4, key::V),
    (5, key::B),
    (6, DIGIT_1 + 4),
    (7, DIGIT_1 + 5),
    (8, DIGIT_1 + 6),
    (9, DIGIT_1 + 7),
    (10, DIGIT_1 + 8),
];
/// The digit 1 by USB HID usage; the others follow.
const DIGIT_1: u16 = 0x1E;

/// A user's gamepad, present or not.
pub struct Gamepad {
    user: u16,
    devices: Vec<PathBuf>,
    device: Option<File>,
    tried: Option<Instant>,
    said: bool,
    quiet: bool,
    pad: Pad,
    sequence: u64,
    /// The keys that were sent last, and when.
    sent: Option<(Vec<u16>, Instant)>,
}

impl Gamepad {
    /// Takes the first gamepad of this machine for a user, as soon as there is one.
    pub fn new(user: u16, quiet: bool) -> Gamepad {
        Gamepad::of((0..MAX_DEVICES).map(|k| PathBuf::from(format!("/dev/input/js{k}"))).collect(), user, quiet)
    }

    fn of(devices: Vec<PathBuf>, user: u16, quiet: bool) -> Gamepad {
        let (device, tried, said, pad) = (None, None, false, Pad::default());
        Gamepad { user, devices, device, tried, said, quiet, pad, sequence: 0, sent: None }
    }

    /// Returns the user's input if it has changed since the last call, or must be repeated.
    pub fn input(&mut self, now: Instant) -> Option<Input> {
        self.find(now);
        if let Some(mut device) = self.device.take() {
            match self.pad.read(&mut device) {
                Ok(()) => self.device = Some(device),
                // unplugged: nothing is held
                Err(_) => {
                    self.pad = Pad::default();
                    self.say("is gone");
                }
            }
        }
        let keys = self.pad.keys();
        let known = self
            .sent
            .as_ref()
            .is_some_and(|(sent, at)| *sent == keys && (keys.is_empty() || now.duration_since(*at) < RESEND_INTERVAL));
        if known || self.sent.is_none() && keys.is_empty() {
            return None;
        }
        self.sequence += 1;
        self.sent = Some((keys.clone(), now));
        let (sequence, user) = (self.sequence, self.user);
        Some(Input { sequence, user, head: None, wand: None, hands: [None; 2], buttons: 0, keys })
    }

    /// Looks for a device once a second. Reports once that there is none.
    fn find(&mut self, now: Instant) {
        if self.device.is_some() || self.tried.is_some_and(|at| now.duration_since(at) < RETRY_INTERVAL) {
            return;
        }
        self.tried = Some(now);
        let open = |path: &PathBuf| File::open(path).and_then(|file| Ok(ioctl_fionbio(&file, true).map(|()| file)?));
        match self.devices.iter().find_map(|path| Some((open(path).ok()?, path.display().to_string()))) {
            Some((file, path)) => {
                (self.device, self.said) = (Some(file), true);
                self.say(&format!("is {path}"));
            }
            None if !std::mem::replace(&mut self.said, true) => self.say("is not there; waits for one"),
            None => {}
        }
    }

    fn say(&self, what: &str) {
        if !self.quiet {
            eprintln!("gamepad: {what}");
        }
    }
}

/// The state of a gamepad.
#[derive(Default)]
struct Pad {
    /// Value of each axis that was moved, by number.
    axes: [i16; 8],
    /// Held buttons, by bits.
    buttons: u32,
    /// The begin of an event.
    rest: Vec<u8>,
}

impl Pad {
    /// Reads the events that have come.
    fn read(&mut self, device: &mut impl Read) -> std::io::Result<()> {
        let mut bytes = [0; EVENT_BYTES];
        for _ in 0..MAX_EVENTS {
            match device.read(&mut bytes[self.rest.len()..]) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(length) => {
                    let begin = self.rest.len();
                    self.rest.extend_from_slice(&bytes[begin..begin + length]);
                    if let Ok(event) = <[u8; EVENT_BYTES]>::try_from(&self.rest[..]) {
                        self.take(event);
                        self.rest.clear();
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn take(&mut self, [_, _, _, _, low, high, kind, number]: [u8; EVENT_BYTES]) {
        let value = i16::from_le_bytes([low, high]);
        match kind & 0x7F {
            1 if number < 32 => {
                let bit = 1 << number;
                self.buttons = if value != 0 { self.buttons | bit } else { self.buttons & !bit };
            }
            2 => self.axes.get_mut(usize::from(number)).into_iter().for_each(|axis| *axis = value),
            _ => {}
        }
    }

    /// Returns the held keys, in ascending order.
    fn keys(&self) -> Vec<u16> {
        let pushed = |(number, less, more): (u8, Option<u16>, Option<u16>)| match self.axes[usize::from(number)] {
            value if value > PUSHED => more,
            value if value < -PUSHED => less,
            _ => None,
        };
        let held = |(number, key): (u8, u16)| (self.buttons >> number & 1 == 1).then_some(key);
        let mut keys: Vec<u16> =
            AXES.into_iter().filter_map(pushed).chain(BUTTONS.into_iter().filter_map(held)).collect();
        keys.sort_unstable();
        keys.dedup();
        keys
    }
}

/// Returns the index of a user by its name.
///
/// # Errors
/// There is no such user.
pub fn user_of(name: &str, users: &[tumble::scene::cave::User]) -> Result<u16, Failure> {
    let found = users.iter().position(|user| user.name == name).map(|k| k as u16);
    found.ok_or_else(|| {
        let names: Vec<&str> = users.iter().map(|user| user.name.as_str()).collect();
        Failure::input(format!("--gamepad {name}: there is no such user; there are {}", names.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::os::unix::net::UnixStream;

    fn event(kind: u8, number: u8, value: i16) -> [u8; EVENT_BYTES] {
        let [low, high] = value.to_le_bytes();
        [1, 2, 3, 4, low, high, kind, number]
    }

    #[test]
    fn sticks_triggers_and_buttons_hold_keys() {
        let (mut pad, full) = (Pad::default(), i16::MAX);
        // the state at the beginning: triggers rest at the negative end
        for number in [2, 5] {
            pad.take(event(0x82, number, -full));
        }
        assert!(pad.keys().is_empty());
        for (events, keys) in [
            (vec![event(2, 1, -full)], vec![key::W]),
            (vec![event(2, 0, full)], vec![key::D, key::W]),
            (vec![event(2, 0, full / 3), event(2, 1, full)], vec![key::S]),
            (vec![event(2, 1, 0), event(2, 3, i16::MIN)], vec![key::LEFT]),
            (vec![event(2, 3, 0), event(2, 5, full), event(1, 4, 1)], vec![key::E, key::V]),
            // the cross says the same as the stick
            (vec![event(2, 5, -full), event(1, 4, 0), event(2, 6, -full), event(2, 0, -full)], vec![key::A]),
            (vec![event(2, 6, 0), event(2, 0, 0), event(1, 0, 1), event(1, 10, 1)], vec![0x1E, 0x26]),
            // what no pad has
            (vec![event(1, 0, 0), event(1, 10, 0), event(1, 200, 1), event(2, 99, full), event(7, 0, 1)], vec![]),
        ] {
            events.into_iter().for_each(|event| pad.take(event));
            assert_eq!(pad.keys(), keys);
        }
    }

    #[test]
    fn events_are_read_in_pieces_until_the_end() {
        let (mut here, mut there) = UnixStream::pair().unwrap();
        there.set_nonblocking(true).unwrap();
        let mut pad = Pad::default();
        let bytes = [event(2, 1, i16::MIN), event(1, 5, 1)].concat();
        for (piece, keys) in bytes.chunks(5).zip([vec![], vec![key::W], vec![key::W], vec![key::B, key::W]]) {
            here.write_all(piece).unwrap();
            pad.read(&mut there).unwrap();
            assert_eq!(pad.keys(), keys);
        }
        drop(here);
        assert!(pad.read(&mut there).is_err());
    }

    #[test]
    fn held_keys_are_repeated_and_an_unplugged_pad_holds_none() {
        let mut gamepad = Gamepad::of(vec!["/nonexistent/js0".into()], 3, true);
        let begin = Instant::now();
        let after = |ms| begin + Duration::from_millis(ms);
        assert!(gamepad.input(begin).is_none() && gamepad.said);
        gamepad.pad.take(event(1, 0, 1));
        let input = gamepad.input(after(10)).unwrap();
        assert_eq!((input.user, input.sequence, input.keys), (3, 1, vec![DIGIT_1]));
        assert!(gamepad.input(after(200)).is_none());
        assert_eq!(gamepad.input(after(300)).unwrap().sequence, 2);
        // a device that ends at once
        gamepad.device = Some(File::open("/dev/null").unwrap());
        assert!(gamepad.input(after(310)).unwrap().keys.is_empty());
        assert!(gamepad.input(after(900)).is_none() && gamepad.device.is_none());
    }
}
