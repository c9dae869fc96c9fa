//! `[tracker]`: the source of head and hand positions.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use toml::de::DeValue;

use super::{DeviceMap, User};
use crate::parse::fields::{Fields, Names};

/// Default UDP port for datagrams of a tracker.
pub const TRACKER_PORT: u16 = 47_200;
/// Largest number of senders.
const MAX_SENDERS: usize = 64;
/// Largest number of devices.
const MAX_DEVICES: usize = 64;

/// Axes of the tracker's frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// The cave's axes: x to the right, y ahead, z up.
    ZUp,
    /// Axes of OpenXR and most headsets: x to the right, y up, z back.
    YUp,
}

const AXES: Names<Axes> = &[("z_up", Axes::ZUp), ("y_up", Axes::YUp)];

/// `[tracker]`. All keys have defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracker {
    /// Address on which datagrams (OSC) are received. Default 127.0.0.1.
    pub address: IpAddr,
    /// UDP port, 1 to 65535. Default 47200.
    pub port: u16,
    /// Names of the cave's users at the tracker, in the order of the users. Default: their own
    /// names.
    pub users: Vec<String>,
    /// Accepted senders. Default: every sender that reaches `address`. Required if `address` is not
    /// local, unless datagrams are sealed.
    pub senders: Vec<IpAddr>,
    /// Whether datagrams are sealed with the key of `[security]`, as `tumble relay` sends them.
    /// Default false.
    pub sealed: bool,
    /// Default `z_up`.
    pub axes: Axes,
    /// Origin of the tracker's frame in the cave, m. Default 0, 0, 0.
    pub origin_m: [f64; 3],
    /// VRPN server (TCP), `HOST:PORT`, instead of datagrams. Default: none.
    pub vrpn: Option<String>,
    /// Devices of that server with the parts that they move; at least one.
    pub vrpn_map: Vec<DeviceMap>,
    /// Bodies of DTrack with the parts that they move: datagrams are its output instead of OSC. Default:
    /// none.
    pub dtrack_map: Vec<DeviceMap>,
    /// User, by its name at the tracker, whose head and hands are those of a headset of this machine by
    /// OpenXR, instead of datagrams; the axes are then `y_up`. Default: none.
    pub openxr: Option<String>,
}

impl Tracker {
    /// Returns the default settings for these users.
    pub fn of(users: &[User]) -> Tracker {
        Tracker {
            address: Ipv4Addr::LOCALHOST.into(),
            port: TRACKER_PORT,
            users: users.iter().map(|u| u.name.clone()).collect(),
            senders: Vec::new(),
            sealed: false,
            axes: Axes::ZUp,
            origin_m: [0.0; 3],
            vrpn: None,
            vrpn_map: Vec::new(),
            dtrack_map: Vec::new(),
            openxr: None,
        }
    }

    /// Returns address and port.
    pub fn socket(&self) -> SocketAddr {
        (self.address, self.port).into()
    }

    /// Reads the table. `has_key`: the cave has a `[security]`.
    pub(crate) fn read(mut f: Fields<'_>, users: &[User], has_key: bool) -> Tracker {
        let default = Tracker::of(users);
        let problems = f.log.count();
        let address = f
            .optional_text("address")
            .and_then(|(text, value)| address_of(&f, "address", text, value))
            .unwrap_or(default.address);
        let port = u32::from(default.port);
        let users = read_users(&mut f, users).unwrap_or(default.users);
        let vrpn = read_vrpn(&mut f);
        let vrpn_map = read_vrpn_map(&mut f, &users, vrpn.is_some());
        let dtrack_map = read_dtrack_map(&mut f, &users, vrpn.is_some());
        let openxr = read_openxr(&mut f, &users, vrpn.is_some(), !dtrack_map.is_empty());
        let axes = if openxr.is_some() { Axes::YUp } else { default.axes };
        let tracker = Tracker {
            vrpn,
            vrpn_map,
            dtrack_map,
            openxr,
            address,
            port: f.integer_or("port", 1..=65535, port) as u16,
            users,
            senders: read_senders(&mut f),
            sealed: f.flag_or("sealed", default.sealed),
            axes: f.choice_or("axes", AXES, axes),
            origin_m: f.vector_or("origin_m", crate::parse::bound::Bound::ANY, default.origin_m),
        };
        if f.log.count() == problems && !tracker.address.is_loopback() && tracker.senders.is_empty() && !tracker.sealed
        {
            let message = format!("{} listens at {} without `senders`", f.what, tracker.address);
            f.log.report(f.span.clone(), message, "expected the IP addresses of accepted senders, such as senders = [\"10.0.0.7\"], or sealed = true; other datagrams of trackers are not authenticated");
        }
        if f.log.count() == problems && tracker.sealed && !has_key {
            let message = format!("{} is sealed and the cave has no key", f.what);
            f.log.report(f.span.clone(), message, "expected a [security] with a key_file");
        }
        if f.log.count() == problems && tracker.openxr.is_some() && tracker.axes != Axes::YUp {
            let message = format!("{} has `openxr` and axes = \"z_up\"", f.what);
            f.log.report(f.span.clone(), message, "expected \"y_up\", the axes of OpenXR, or no `axes`");
        }
        f.finish();
        tracker
    }
}

fn read_users(f: &mut Fields<'_>, users: &[User]) -> Option<Vec<String>> {
    let place = f.value("users")?;
    let expected = format!("one unique name without / for each of the cave's {} users, in their order", users.len());
    let names: Vec<String> = match place.get_ref() {
        DeValue::Array(items) => items.iter().filter_map(|item| Some(item.get_ref().as_str()?.to_owned())).collect(),
        _ => Vec::new(),
    };
    let right = |k: usize| {
        !names[k].is_empty() && names[k].len() <= 64 && !names[k].contains('/') && !names[..k].contains(&names[k])
    };
    if names.len() != users.len() || !(0..names.len()).all(right) {
        f.wrong("users", place, expected);
    }
    Some(names)
}

fn read_senders(f: &mut Fields<'_>) -> Vec<IpAddr> {
    let items = f.list("senders", MAX_SENDERS, "a list of IP addresses");
    items
        .into_iter()
        .filter_map(|value| f.as_text("senders", value).and_then(|text| address_of(f, "senders", text, value)))
        .collect()
}

fn read_vrpn(f: &mut Fields<'_>) -> Option<String> {
    let (server, value) = f.optional_text("vrpn")?;
    let well = server.rsplit_once(':').is_some_and(|(host, port)| {
        !host.is_empty() && !host.contains(char::is_whitespace) && port.parse::<u16>().is_ok_and(|port| port > 0)
    });
    if !well {
        f.wrong("vrpn", value, "HOST:PORT, such as \"10.0.0.7:3883\"");
    }
    Some(server.to_owned())
}

fn read_vrpn_map(f: &mut Fields<'_>, users: &[String], has_server: bool) -> Vec<DeviceMap> {
    let items = f.list("vrpn_map", MAX_DEVICES, "a list of devices, such as \"Glasses=user/head\"");
    let mut maps = Vec::new();
    for value in &items {
        let Some(text) = f.as_text("vrpn_map", value) else { continue };
        match text.parse::<DeviceMap>() {
            Ok(map) if users.contains(&map.user) => maps.push(map),
            Ok(_) => f.wrong("vrpn_map", value, format!("a user of this tracker: {}", users.join(", "))),
            Err(expected) => f.wrong("vrpn_map", value, expected.trim_start_matches("expected ")),
        }
    }
    let missing = match (has_server, items.is_empty()) {
        (true, true) => Some((
            "`vrpn` without `vrpn_map`: no device moves a user",
            "expected a list of devices, such as vrpn_map = [\"Glasses=user/head\"]",
        )),
        (false, false) => {
            Some(("`vrpn_map` without `vrpn`", "expected the server of the devices, such as vrpn = \"10.0.0.7:3883\""))
        }
        _ => None,
    };
    if let Some((what, expected)) = missing {
        f.log.report(f.span.clone(), format!("{} has {what}", f.what), expected);
    }
    maps
}

fn read_dtrack_map(f: &mut Fields<'_>, users: &[String], has_vrpn: bool) -> Vec<DeviceMap> {
    let items = f.list("dtrack_map", MAX_DEVICES, "a list of bodies, such as \"body:0=user/head\"");
    let mut maps = Vec::new();
    for value in &items {
        let Some(text) = f.as_text("dtrack_map", value) else { continue };
        let map = text.parse::<DeviceMap>().and_then(|map| map.check_dtrack(users).map(|()| map));
        match map {
            Ok(map) => maps.push(map),
            Err(expected) => f.wrong("dtrack_map", value, expected.trim_start_matches("expected ")),
        }
    }
    if has_vrpn && !items.is_empty() {
        let message = format!("{} has `vrpn` and `dtrack_map`", f.what);
        f.log.report(f.span.clone(), message, "expected one tracker");
    }
    maps
}

fn read_openxr(f: &mut Fields<'_>, users: &[String], has_vrpn: bool, has_dtrack: bool) -> Option<String> {
    let (user, value) = f.optional_text("openxr")?;
    if !users.iter().any(|known| known == user) {
        f.wrong("openxr", value, format!("a user of this tracker: {}", users.join(", ")));
    }
    if let Some((other, _)) = [("vrpn", has_vrpn), ("dtrack_map", has_dtrack)].into_iter().find(|(_, has)| *has) {
        let message = format!("{} has `openxr` and `{other}`", f.what);
        f.log.report(f.span.clone(), message, "expected one tracker");
    }
    Some(user.to_owned())
}

fn address_of(f: &Fields<'_>, key: &str, text: &str, value: &crate::parse::fields::Value<'_>) -> Option<IpAddr> {
    let address = text.parse().ok();
    if address.is_none() {
        f.wrong(key, value, "an IP address, such as \"127.0.0.1\"");
    }
    address
}
