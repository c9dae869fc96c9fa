//! Devices of a VRPN server or of DTrack, and what they move: words of `[tracker]`, `--vrpn-map` and `--dtrack-map`.

use std::str::FromStr;

const PARTS: [&str; 5] = ["head", "wand", "hand/left", "hand/right", "buttons"];

/// The part that a device moves: `DEVICE:SENSOR=USER/PART`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceMap {
    /// Name of the device; `body` or `flystick` of DTrack.
    pub device: String,
    /// Number of the sensor; of buttons not used.
    pub sensor: i32,
    /// User, by its name at the tracker.
    pub user: String,
    /// `head`, `wand`, `hand/left`, `hand/right` or `buttons`.
    pub part: String,
}

impl DeviceMap {
    /// Checks that it is a device of DTrack that moves one of these users.
    ///
    /// # Errors
    /// The expected value.
    pub fn check_dtrack(&self, users: &[String]) -> Result<(), String> {
        let is_known = match self.device.as_str() {
            "body" => self.part != "buttons",
            "flystick" => true,
            _ => false,
        };
        if !is_known || self.sensor < 0 {
            return Err("body:NUMBER or flystick:NUMBER, and buttons of a flystick alone".into());
        }
        if !users.contains(&self.user) {
            return Err(format!("a user of this tracker: {}", users.join(", ")));
        }
        Ok(())
    }
}

impl FromStr for DeviceMap {
    type Err = String;

    fn from_str(text: &str) -> Result<DeviceMap, String> {
        let expected =
            || format!("expected DEVICE=USER/PART or DEVICE:SENSOR=USER/PART with a PART of {}", PARTS.join(", "));
        let (from, to) = text.split_once('=').ok_or_else(expected)?;
        let (user, part) = to.split_once('/').ok_or_else(expected)?;
        let (device, sensor) = match from.rsplit_once(':') {
            Some((device, sensor)) => (device, sensor.parse().map_err(|_| expected())?),
            None => (from, 0),
        };
        match !device.is_empty() && !user.is_empty() && PARTS.contains(&part) {
            true => Ok(DeviceMap { device: device.into(), sensor, user: user.into(), part: part.into() }),
            false => Err(expected()),
        }
    }
}
