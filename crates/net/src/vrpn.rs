//! The stream of a VRPN server (Virtual-Reality Peripheral Network, version 7), read from its bytes.
//!
//! ```text
//! greeting, both ways   24 bytes:  "vrpn: ver. 07.35", two spaces, log mode "0", zeros
//! message               6 × i32, big-endian:  length, seconds, microseconds, sender, type, sequence
//!                       contents of length − 24 bytes, then zeros to a multiple of 8
//! type −1, −2           the number in `sender` has the name in the contents: i32 length with the last zero, text
//! "vrpn_Tracker Pos_Quat"   i32 sensor, i32 0, 3 × f64 position (m), 4 × f64 quaternion (x y z w)
//! "vrpn_Button Change"      i32 button, i32 1 held or 0
//! ```
//!
//! Numbers of senders and types are those of the server. A client that asks for no UDP gets everything by TCP. Other
//! messages are skipped. Source: the published `vrpn_Connection`, `vrpn_Tracker` and `vrpn_Button`.
//!
//! Limits: a message has at most 64 KiB, a name 128 bytes, a connection 1024 senders and as many types. A stream that
//! exceeds them or has another form ends the connection.

use std::collections::BTreeMap;

/// Length of the greeting, bytes.
pub const GREETING_BYTES: usize = 24;
/// The greeting of a client that wants no log.
pub const GREETING: [u8; GREETING_BYTES] = *b"vrpn: ver. 07.35  0\0\0\0\0\0";
/// Length of the numbers before the contents, bytes.
const HEADER_BYTES: usize = 24;
/// Largest message, bytes.
const MAX_MESSAGE_BYTES: usize = 64 << 10;
/// Largest name, bytes.
const MAX_NAME_BYTES: usize = 128;
/// Largest number of senders, and of types.
const MAX_NAMES: usize = 1024;

/// A report of a device.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// A pose.
    Pose {
        /// Name of the device.
        device: String,
        /// Number of the sensor.
        sensor: i32,
        /// `x y z qx qy qz qw`, m, in the tracker's axes; any numbers.
        numbers: [f64; 7],
    },
    /// A button that was pressed or released.
    Button {
        /// Name of the device.
        device: String,
        /// Number of the button.
        button: i32,
        /// Whether it is held.
        held: bool,
    },
}

/// Reader of a stream, without socket and clock.
#[derive(Default)]
pub struct VrpnStream {
    greeted: bool,
    bytes: Vec<u8>,
    senders: BTreeMap<i32, String>,
    types: BTreeMap<i32, String>,
}

impl VrpnStream {
    /// Takes bytes as they arrive, and gives `report` each report that is complete.
    ///
    /// # Errors
    /// The fault of a stream that is no VRPN 7 or exceeds a limit. It ends the connection.
    pub fn take(&mut self, bytes: &[u8], mut report: impl FnMut(Report)) -> Result<(), String> {
        self.bytes.extend_from_slice(bytes);
        let mut at = 0;
        if !self.greeted {
            if self.bytes.len() < GREETING_BYTES {
                return Ok(());
            }
            greeting(&self.bytes[..GREETING_BYTES])?;
            (self.greeted, at) = (true, GREETING_BYTES);
        }
        while let Some(length) = message_bytes(&self.bytes[at..])? {
            let padded = length.next_multiple_of(8);
            if self.bytes.len() < at + padded {
                break;
            }
            let message = self.bytes[at..at + length].to_vec();
            at += padded;
            if let Some(found) = self.message(&message)? {
                report(found);
            }
        }
        self.bytes.drain(..at);
        Ok(())
    }

    fn message(&mut self, message: &[u8]) -> Result<Option<Report>, String> {
        let number = |word: usize| int(message, 4 * word).unwrap_or_default();
        let (sender, kind, contents) = (number(3), number(4), &message[HEADER_BYTES..]);
        match kind {
            -1 => name(&mut self.senders, sender, contents, "sender")?,
            -2 => name(&mut self.types, sender, contents, "type")?,
            _ => {}
        }
        let (Some(device), Some(kind)) = (self.senders.get(&sender), self.types.get(&kind)) else { return Ok(None) };
        let device = device.clone();
        Ok(match kind.as_str() {
            "vrpn_Tracker Pos_Quat" if contents.len() >= 64 => {
                let numbers = std::array::from_fn(|k| float(contents, 8 + 8 * k).unwrap_or(f64::NAN));
                int(contents, 0).map(|sensor| Report::Pose { device, sensor, numbers })
            }
            "vrpn_Button Change" => match (int(contents, 0), int(contents, 4)) {
                (Some(button), Some(state)) => Some(Report::Button { device, button, held: state != 0 }),
                _ => None,
            },
            _ => None,
        })
    }
}

/// Checks the greeting of a server.
fn greeting(bytes: &[u8]) -> Result<(), String> {
    match bytes.strip_prefix(b"vrpn: ver. ") {
        Some(rest) if rest.starts_with(b"07.") => Ok(()),
        Some(rest) => Err(format!("the server speaks VRPN {}, expected 07", String::from_utf8_lossy(&rest[..5]))),
        None => Err("the server does not speak VRPN".into()),
    }
}

/// Returns the length of the message at the beginning, without what fills it up; `None` if it has not arrived.
fn message_bytes(bytes: &[u8]) -> Result<Option<usize>, String> {
    let Some(length) = int(bytes, 0) else { return Ok(None) };
    match usize::try_from(length) {
        Ok(length) if (HEADER_BYTES..=MAX_MESSAGE_BYTES).contains(&length) => Ok(Some(length)),
        _ => Err(format!("a message has {length} bytes, expected {HEADER_BYTES} to {MAX_MESSAGE_BYTES}")),
    }
}

/// Stores the name of a sender or a type.
fn name(names: &mut BTreeMap<i32, String>, number: i32, contents: &[u8], what: &str) -> Result<(), String> {
    let text = contents.get(4..).unwrap_or_default();
    let text = text.split(|byte| *byte == 0).next().unwrap_or_default();
    if text.len() > MAX_NAME_BYTES {
        return Err(format!("a {what} has a name of {} bytes, expected at most {MAX_NAME_BYTES}", text.len()));
    }
    if names.len() >= MAX_NAMES && !names.contains_key(&number) {
        return Err(format!("there are more than {MAX_NAMES} names of a {what}"));
    }
    names.insert(number, String::from_utf8_lossy(text).into_owned());
    Ok(())
}

fn int(bytes: &[u8], at: usize) -> Option<i32> {
    bytes.get(at..at + 4)?.try_into().ok().map(i32::from_be_bytes)
}

fn float(bytes: &[u8], at: usize) -> Option<f64> {
    bytes.get(at..at + 8)?.try_into().ok().map(f64::from_be_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A message by the description of the protocol.
    fn message(sender: i32, kind: i32, contents: &[u8]) -> Vec<u8> {
        let numbers = [24 + contents.len() as i32, 1_700_000_000, 250_000, sender, kind, 7];
        let mut out: Vec<u8> = numbers.iter().flat_map(|n| n.to_be_bytes()).collect();
        out.extend(contents);
        out.resize(out.len().next_multiple_of(8), 0);
        out
    }

    fn named(number: i32, kind: i32, name: &str) -> Vec<u8> {
        message(number, kind, &[&(name.len() as i32 + 1).to_be_bytes(), name.as_bytes(), &[0]].concat())
    }

    fn pose(sender: i32, kind: i32, sensor: i32, numbers: [f64; 7]) -> Vec<u8> {
        let mut contents = [sensor.to_be_bytes(), [0; 4]].concat();
        contents.extend(numbers.iter().flat_map(|x| x.to_be_bytes()));
        message(sender, kind, &contents)
    }

    /// A server's stream: names, a pose, a message of a kind that is not used, a button.
    fn stream() -> Vec<u8> {
        [
            b"vrpn: ver. 07.33  0\0\xed\0\0\0".to_vec(),
            named(0, -1, "VRPN Control"),
            named(3, -1, "Glasses"),
            named(9, -2, "vrpn_Tracker Pos_Quat"),
            named(4, -2, "vrpn_Button Change"),
            named(5, -2, "vrpn_Base pong_message"),
            message(3, 5, &[]),
            pose(3, 9, 2, [0.1, 0.2, 1.7, 0.0, 0.0, 0.0, 1.0]),
            message(3, 4, &[1i32.to_be_bytes(), 1i32.to_be_bytes()].concat()),
        ]
        .concat()
    }

    /// However the bytes are cut, the reports are the same.
    #[test]
    fn reports_do_not_depend_on_packets() {
        let wanted = [
            Report::Pose { device: "Glasses".into(), sensor: 2, numbers: [0.1, 0.2, 1.7, 0.0, 0.0, 0.0, 1.0] },
            Report::Button { device: "Glasses".into(), button: 1, held: true },
        ];
        let bytes = stream();
        for size in [1, 3, 7, 24, 100, bytes.len()] {
            let (mut stream, mut found) = (VrpnStream::default(), Vec::new());
            bytes.chunks(size).for_each(|part| stream.take(part, |report| found.push(report)).unwrap());
            assert_eq!(found, wanted, "{size}");
            assert!(stream.bytes.is_empty());
        }
    }

    #[test]
    fn other_streams_are_refused() {
        let said = |bytes: &[u8]| VrpnStream::default().take(bytes, |_| {}).unwrap_err();
        assert_eq!(said(b"HTTP/1.1 400 Bad Request"), "the server does not speak VRPN");
        assert_eq!(said(b"vrpn: ver. 06.11  0\0\0\0\0\0"), "the server speaks VRPN 06.11, expected 07");
        let long = [GREETING.to_vec(), (65_537i32).to_be_bytes().to_vec()].concat();
        assert_eq!(said(&long), "a message has 65537 bytes, expected 24 to 65536");
        let short = [GREETING.to_vec(), (-8i32).to_be_bytes().to_vec()].concat();
        assert_eq!(said(&short), "a message has -8 bytes, expected 24 to 65536");
        let many: Vec<u8> = (0..1025).flat_map(|i| named(i, -1, "x")).collect();
        assert_eq!(said(&[GREETING.to_vec(), many].concat()), "there are more than 1024 names of a sender");
        let name = "n".repeat(129);
        assert!(said(&[GREETING.to_vec(), named(1, -1, &name)].concat()).contains("a name of 129 bytes"));
    }

    /// 300,000 streams with changed, repeated and cut bytes: no panic, no buffer beyond a message.
    #[test]
    fn changed_streams_do_no_harm() {
        let good = stream();
        let mut x = 0x9E37_79B9_7F4A_7C15u64;
        let mut random = |max: usize| {
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            (x >> 11) as usize % max
        };
        let (mut reports, mut refused) = (0u32, 0u32);
        for _ in 0..300_000 {
            let mut bytes = good.clone();
            (0..1 + random(4)).for_each(|_| {
                let at = random(bytes.len());
                bytes[at] = random(256) as u8;
            });
            bytes.truncate(1 + random(bytes.len() + bytes.len() / 2));
            let mut stream = VrpnStream::default();
            refused += u32::from(stream.take(&bytes, |_| reports += 1).is_err());
            assert!(stream.bytes.len() <= MAX_MESSAGE_BYTES + bytes.len());
        }
        assert!(reports > 10_000 && refused > 10_000, "{reports} {refused}");
    }
}
