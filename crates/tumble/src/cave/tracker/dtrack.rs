//! Decoder of the output of DTrack, the program of trackers by Advanced Realtime Tracking: lines of text in a datagram
//! become the messages that other trackers send as OSC, and go through the same decoder.
//!
//! ```text
//! fr 4711                                    number of the frame
//! 6d 1 [0 1.000][x y z η θ φ][b0 … b8]       number of bodies; number, quality; mm, degrees; rotation
//! 6df2 1 1 [0 1.000 4 2][x y z][b0 … b8][buttons axes …]      Flysticks: defined, sent; number, quality, counts
//!
//!     | b0 b3 b6 |
//! R = | b1 b4 b7 |        from the body to the room
//!     | b2 b5 b8 |
//! ```
//!
//! A quality below 0 is not tracked, and neither is a body that is missing in its line. The angles are not used.

use super::osc::Dropped;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use rosc::{OscMessage, OscType};
use tumble::scene::cave::DeviceMap;

/// Largest number of bodies of a line.
const MAX_BODIES: usize = 64;
/// Tolerance of `RᵀR − 1`: numbers have six digits after the point.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// Returns the messages of a datagram for these devices: `body:NUMBER` and `flystick:NUMBER`.
///
/// # Errors
/// Text that is no output of DTrack. Poses and buttons of it are right or none.
pub fn messages(bytes: &[u8], maps: &[DeviceMap]) -> Result<Vec<OscMessage>, Dropped> {
    let text = std::str::from_utf8(bytes).map_err(|_| Dropped::Malformed)?;
    let mut lines = text.lines().filter_map(|line| line.trim().split_once(' '));
    if !lines.clone().any(|(kind, _)| kind == "fr") {
        return Err(Dropped::Malformed);
    }
    let mut out = Vec::new();
    lines.try_for_each(|(kind, rest)| match kind {
        "6d" => read(rest, "body", 3, maps, &mut out),
        "6df2" => read(rest, "flystick", 4, maps, &mut out),
        // calibrations, markers, times and devices of other kinds
        _ => Ok(()),
    })?;
    Ok(out)
}

/// Reads the bodies of a line, each of which has this number of groups in brackets.
fn read(text: &str, device: &str, groups: usize, maps: &[DeviceMap], out: &mut Vec<OscMessage>) -> Result<(), Dropped> {
    let (head, blocks) = text.split_at(text.find('[').unwrap_or(text.len()));
    let count: usize = head.split_whitespace().last().and_then(|word| word.parse().ok()).ok_or(Dropped::Malformed)?;
    let blocks = blocks_of(blocks)?;
    if count > MAX_BODIES || blocks.len() != count * groups {
        return Err(Dropped::Malformed);
    }
    let bodies: Vec<Body<'_>> = blocks.chunks_exact(groups).map(Body::read).collect::<Result<_, _>>()?;
    for map in maps.iter().filter(|map| map.device == device) {
        let body = bodies.iter().find(|body| body.number == map.sensor && body.quality >= 0.0);
        let args = match (map.part.as_str(), body) {
            ("buttons", Some(body)) => vec![OscType::Int(body.buttons())],
            (_, Some(body)) => body.pose()?,
            // the last head stays, and hands rest
            ("head" | "buttons", None) => continue,
            (_, None) => Vec::new(),
        };
        out.push(OscMessage { addr: format!("/tumble/user/{}/{}", map.user, map.part), args });
    }
    Ok(())
}

/// Returns the numbers of each pair of brackets.
fn blocks_of(text: &str) -> Result<Vec<Vec<f64>>, Dropped> {
    let (mut rest, mut blocks) = (text.trim(), Vec::new());
    while !rest.is_empty() {
        let inside = rest.strip_prefix('[').ok_or(Dropped::Malformed)?;
        let (numbers, more) = inside.split_once(']').ok_or(Dropped::Malformed)?;
        let numbers = numbers.split_whitespace().map(str::parse).collect::<Result<_, _>>();
        blocks.push(numbers.map_err(|_| Dropped::Malformed)?);
        rest = more.trim_start();
    }
    Ok(blocks)
}

/// A body or a Flystick.
struct Body<'a> {
    number: i32,
    quality: f64,
    position_mm: &'a [f64],
    rotation: &'a [f64],
    /// Words of 32 buttons, then axes; empty for a body.
    controls: &'a [f64],
}

impl Body<'_> {
    fn read(blocks: &[Vec<f64>]) -> Result<Body<'_>, Dropped> {
        let ([head, place, rotation, more @ ..], none) = (blocks, [].as_slice()) else {
            return Err(Dropped::Malformed);
        };
        let (&[number, quality, ..], true, 9) = (&head[..], place.len() >= 3, rotation.len()) else {
            return Err(Dropped::Malformed);
        };
        let controls = more.first().map_or(none, Vec::as_slice);
        Ok(Body { number: number as i32, quality, position_mm: &place[..3], rotation, controls })
    }

    /// Returns the arguments of a pose: m, and a unit quaternion.
    fn pose(&self) -> Result<Vec<OscType>, Dropped> {
        let matrix = Matrix3::from_column_slice(self.rotation);
        let skew = (matrix.transpose() * matrix - Matrix3::identity()).abs().max();
        // also false for NaN
        if !(skew <= ROTATION_TOLERANCE && matrix.determinant() > 0.0) {
            return Err(Dropped::InvalidRotation);
        }
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
        let numbers = self.position_mm.iter().map(|x| x / 1000.0).chain([q.i, q.j, q.k, q.w]);
        Ok(numbers.map(OscType::Double).collect())
    }

    /// Returns the mask of the first buttons, of which users have 31.
    fn buttons(&self) -> i32 {
        self.controls.first().map_or(0, |&mask| (mask as i64 & i64::from(i32::MAX)) as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn maps() -> Vec<DeviceMap> {
        let words = ["body:0=a/head", "body:3=a/hand/left", "flystick:0=a/wand", "flystick:0=a/buttons"];
        words.map(|word| word.parse().unwrap()).into()
    }

    /// A quarter turn about z: the body's x is the room's y.
    const QUARTER: &str = "[0.000000 1.000000 0.000000 -1.000000 0.000000 0.000000 0.000000 0.000000 1.000000]";

    #[test]
    fn bodies_and_flysticks_become_messages() {
        let text = format!(
            "fr 21753\r\nts 39596.024831\r\n6dcal 2\r\n6d 1 [0 1.000][326.848 -187.216 1609.503 0.0 0.0 90.0]{QUARTER}\r\n\
             6df2 1 1 [0 1.000 4 2][-100.0 200.0 1300.0]{QUARTER}[5 0.00 -1.00]\r\n"
        );
        let messages = messages(text.as_bytes(), &maps()).unwrap();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let expected: [(&str, &[f64]); 3] = [
            ("/tumble/user/a/head", &[0.326_848, -0.187_216, 1.609_503, 0.0, 0.0, half, half]),
            // not in its line
            ("/tumble/user/a/hand/left", &[]),
            ("/tumble/user/a/wand", &[-0.1, 0.2, 1.3, 0.0, 0.0, half, half]),
        ];
        for (message, (address, numbers)) in messages.iter().zip(expected) {
            assert_eq!((message.addr.as_str(), message.args.len()), (address, numbers.len()));
            for (arg, number) in message.args.iter().zip(numbers) {
                assert!(matches!(arg, OscType::Double(x) if (x - number).abs() < 1e-9), "{message:?}");
            }
        }
        assert_eq!((messages.len(), messages[3].args.clone()), (4, vec![OscType::Int(5)]));
    }

    #[test]
    fn what_is_not_tracked_moves_nothing_and_what_is_wrong_is_refused() {
        let lost = format!("fr 1\n6d 2 [0 -1.000][0 0 0 0 0 0]{QUARTER}[3 -1.0][0 0 0 0 0 0]{QUARTER}\n6df2 1 0\n");
        let addresses: Vec<String> = messages(lost.as_bytes(), &maps()).unwrap().into_iter().map(|m| m.addr).collect();
        assert_eq!(addresses, ["/tumble/user/a/hand/left", "/tumble/user/a/wand"]);
        let good = format!("fr 1\n6d 1 [0 1.0][1 2 3 0 0 0]{QUARTER}\n");
        assert_eq!(messages(good.as_bytes(), &maps()).unwrap().len(), 2);
        let mirrored = good.replace("0.000000 1.000000]", "0.000000 -1.000000]");
        assert_eq!(messages(mirrored.as_bytes(), &maps()), Err(Dropped::InvalidRotation));
        assert_eq!(messages(good.replace("fr 1", "ts 1").as_bytes(), &maps()), Err(Dropped::Malformed));
        // cut, changed and random text: an error or messages, and no panic
        let mut x = 0x9E37_79B9_7F4A_7C15u64;
        for round in 0..200_000usize {
            // xorshift (Marsaglia 2003)
            x ^= x << 13;
            x ^= x >> 7;
            x ^= x << 17;
            let mut bytes = good.clone().into_bytes();
            let at = (x >> 20) as usize % bytes.len();
            match round % 3 {
                0 => bytes.truncate(at),
                1 => bytes[at] = b"[] 9e-.n\n"[(x >> 50) as usize % 9],
                _ => bytes[at] = (x >> 50) as u8,
            }
            let _ = messages(&bytes, &maps());
        }
    }
}
