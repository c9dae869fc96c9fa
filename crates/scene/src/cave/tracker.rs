//! `[tracker]`: what tells where heads and hands are.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use toml::de::DeValue;

use super::User;
use crate::fields::{Fields, Names};

/// Where datagrams of a tracker are heard where nothing is said.
pub const TRACKER_PORT: u16 = 47_200;
/// Most senders that are listed.
const MOST_SENDERS: usize = 64;

/// Axes of the tracker's space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// The cave's own: x to the right, y ahead, z up.
    ZUp,
    /// As of most headsets and of OpenXR: x to the right, y up, z back.
    YUp,
}

const AXES: Names<Axes> = &[("z_up", Axes::ZUp), ("y_up", Axes::YUp)];

/// `[tracker]`. All keys have defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracker {
    /// Where datagrams (OSC) are heard. Default 127.0.0.1.
    pub address: IpAddr,
    /// UDP port, 1 to 65535. Default 47200.
    pub port: u16,
    /// The names by which the tracker knows the cave's users, in the order of these. Default: their own.
    pub users: Vec<String>,
    /// Whom is listened to. Default: everybody who reaches `address`; needed where that is not this machine alone.
    pub senders: Vec<IpAddr>,
    /// Default `z_up`.
    pub axes: Axes,
    /// Origin of the tracker's space in the cave, m. Default 0, 0, 0.
    pub origin_m: [f64; 3],
}

impl Tracker {
    /// With the defaults, for these users.
    pub fn of(users: &[User]) -> Tracker {
        Tracker {
            address: Ipv4Addr::LOCALHOST.into(),
            port: TRACKER_PORT,
            users: users.iter().map(|u| u.name.clone()).collect(),
            senders: Vec::new(),
            axes: Axes::ZUp,
            origin_m: [0.0; 3],
        }
    }

    /// Address and port.
    pub fn socket(&self) -> SocketAddr {
        (self.address, self.port).into()
    }

    pub(crate) fn read(mut f: Fields<'_>, users: &[User]) -> Tracker {
        let usual = Tracker::of(users);
        let problems = f.log.count();
        let address = f
            .optional_text("address")
            .and_then(|(text, value)| address_of(&f, "address", text, value))
            .unwrap_or(usual.address);
        let port = u32::from(usual.port);
        let tracker = Tracker {
            address,
            port: f.integer_or("port", 1..=65535, port) as u16,
            users: read_users(&mut f, users).unwrap_or(usual.users),
            senders: read_senders(&mut f),
            axes: f.choice_or("axes", AXES, usual.axes),
            origin_m: f.vector_or("origin_m", crate::bound::Bound::ANY, usual.origin_m),
        };
        if f.log.count() == problems && !tracker.address.is_loopback() && tracker.senders.is_empty() {
            let message = format!("{} listens at {}, and has no `senders`", f.what, tracker.address);
            f.log.report(f.span.clone(), message, "wanted the IP addresses of those that are listened to, such as senders = [\"10.0.0.7\"]; what comes is not sealed");
        }
        f.finish();
        tracker
    }
}

fn read_users(f: &mut Fields<'_>, users: &[User]) -> Option<Vec<String>> {
    let place = f.value("users")?;
    let wanted = format!(
        "one name for each of the cave's {} users, in their order, that no other has and without /",
        users.len()
    );
    let names: Vec<String> = match place.get_ref() {
        DeValue::Array(items) => items.iter().filter_map(|item| Some(item.get_ref().as_str()?.to_owned())).collect(),
        _ => Vec::new(),
    };
    let right = |k: usize| {
        !names[k].is_empty() && names[k].len() <= 64 && !names[k].contains('/') && !names[..k].contains(&names[k])
    };
    if names.len() != users.len() || !(0..names.len()).all(right) {
        f.wrong("users", place, wanted);
    }
    Some(names)
}

fn read_senders(f: &mut Fields<'_>) -> Vec<IpAddr> {
    let items = f.list("senders", MOST_SENDERS, "a list of IP addresses");
    items
        .into_iter()
        .filter_map(|value| f.as_text("senders", value).and_then(|text| address_of(f, "senders", text, value)))
        .collect()
}

fn address_of(f: &Fields<'_>, key: &str, text: &str, value: &crate::fields::Value<'_>) -> Option<IpAddr> {
    let address = text.parse().ok();
    if address.is_none() {
        f.wrong(key, value, "an IP address, such as \"127.0.0.1\"");
    }
    address
}
