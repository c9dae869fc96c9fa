//! Contacts for a sound engine (`--sound`): Open Sound Control over UDP, a bundle or more per frame.
//!
//! | address | arguments |
//! |---|---|
//! | `/tumble/impact` | names of both bodies; `x y z` of the point; impulse, N·s |
//! | `/tumble/slide` | names of both bodies; `x y z` of the point; normal force, N; speed of sliding, m/s |
//! | `/tumble/listener` | name of the user; `x y z qx qy qz qw` of the head |
//! | `/tumble/frame` | frame number, simulated time, s; number of contacts left out |
//!
//! Points and heads are in the scene's frame, m. Datagrams are not authenticated and nothing is
//! received. A datagram that cannot be sent is counted and forgotten: sound never delays a frame.

use crate::failure::Failure;
use rosc::{OscBundle, OscMessage, OscPacket, OscTime, OscType};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use tumble::dynamics::{ObjectId, World};
use tumble::net::sync::Viewer;
use tumble::sound::{Impact, Impacts, Slide, slides};

/// Maximum number of impacts, and of slides, of a frame; those with the largest impulse or power are
/// sent.
const MAX_PER_FRAME: usize = 64;
/// Maximum length of a datagram, bytes.
const MAX_DATAGRAM_BYTES: usize = 1400;
/// Maximum length of a name, bytes; longer ones are cut.
const MAX_NAME_BYTES: usize = 64;
/// Time tag of OSC: at once.
const AT_ONCE: OscTime = OscTime { seconds: 0, fractional: 1 };

/// Counts of the sound's datagrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Datagrams sent.
    pub datagrams: u64,
    /// Datagrams that the system refused.
    pub not_sent: u64,
    /// Impacts sent.
    pub impacts: u64,
    /// Contacts left out because a frame had too many.
    pub left_out: u64,
}

/// Sends the contacts of a run.
pub struct ContactSound {
    socket: UdpSocket,
    users: Vec<String>,
    finder: Impacts,
    impacts: Vec<Impact>,
    slides: Vec<Slide>,
    pub counts: Counts,
}

impl ContactSound {
    /// Opens the sound for an engine at this address; `users` names the users.
    pub fn open(engine: SocketAddr, users: Vec<String>) -> Result<ContactSound, Failure> {
        let failed = |e| Failure::run(&format!("--sound {engine}"), e);
        if engine.port() == 0 {
            return Err(Failure::input(format!("--sound {engine}: nothing listens at port 0; expected 1 to 65535")));
        }
        let any: SocketAddr = match engine {
            SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
            SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        let socket = UdpSocket::bind(any).map_err(failed)?;
        socket.set_nonblocking(true).map_err(failed)?;
        socket.connect(engine).map_err(failed)?;
        Ok(ContactSound {
            socket,
            users,
            finder: Impacts::default(),
            impacts: Vec::new(),
            slides: Vec::new(),
            counts: Counts::default(),
        })
    }

    /// Collects the contacts of a step.
    pub fn step(&mut self, world: &World) {
        self.impacts.extend(self.finder.after_step(world));
        // a contact that slides is sent once a frame, as it is after the last step
        self.slides.clear();
        self.slides.extend(slides(world));
    }

    /// Sends the contacts of a frame.
    pub fn frame(&mut self, frame: u64, world: &World, viewer: &Viewer) {
        let (mut impacts, mut slides) = (std::mem::take(&mut self.impacts), std::mem::take(&mut self.slides));
        let left_out = keep_loudest(&mut impacts, |impact| impact.impulse)
            + keep_loudest(&mut slides, |slide| slide.force * slide.speed);
        self.counts.left_out += left_out as u64;
        self.counts.impacts += impacts.len() as u64;
        let floats = |numbers: &[f64]| numbers.iter().map(|x| OscType::Float(*x as f32)).collect::<Vec<_>>();
        let message = |address: &str, args: Vec<OscType>| OscMessage { addr: address.into(), args };
        let frame = [OscType::Long(frame as i64), OscType::Double(world.time()), OscType::Int(left_out as i32)];
        let mut messages = vec![message("/tumble/frame", frame.to_vec())];
        for (name, user) in self.users.iter().zip(&viewer.users) {
            let at = viewer.cave * nalgebra::Point3::from(user.head.translation.vector * viewer.scale);
            let turn = viewer.cave.rotation * user.head.rotation;
            let pose = floats(&[at.x, at.y, at.z, turn.i, turn.j, turn.k, turn.w]);
            messages.push(message("/tumble/listener", [vec![name_of(name)], pose].concat()));
        }
        let names = |bodies: &[ObjectId; 2]| bodies.map(|id| name_of(world.name(id).unwrap_or_default())).to_vec();
        for Impact { bodies, point, impulse, .. } in &impacts {
            let numbers = floats(&[point.x, point.y, point.z, *impulse]);
            messages.push(message("/tumble/impact", [names(bodies), numbers].concat()));
        }
        for Slide { bodies, point, force, speed } in &slides {
            let numbers = floats(&[point.x, point.y, point.z, *force, *speed]);
            messages.push(message("/tumble/slide", [names(bodies), numbers].concat()));
        }
        bundles(messages).iter().for_each(|datagram| self.send(datagram));
    }

    fn send(&mut self, datagram: &[u8]) {
        let sent = self.socket.send(datagram).is_ok();
        *if sent { &mut self.counts.datagrams } else { &mut self.counts.not_sent } += 1;
    }
}

/// Keeps the loudest items in their order, and returns how many were left out.
fn keep_loudest<T: Copy>(items: &mut Vec<T>, loudness: impl Fn(&T) -> f64) -> usize {
    let left_out = items.len().saturating_sub(MAX_PER_FRAME);
    if left_out > 0 {
        let mut sorted: Vec<(usize, T)> = items.iter().copied().enumerate().collect();
        sorted.sort_by(|(_, a), (_, b)| loudness(b).total_cmp(&loudness(a)));
        sorted.truncate(MAX_PER_FRAME);
        sorted.sort_by_key(|(index, _)| *index);
        *items = sorted.into_iter().map(|(_, item)| item).collect();
    }
    left_out
}

fn name_of(name: &str) -> OscType {
    let end = (0..=name.len().min(MAX_NAME_BYTES)).rev().find(|&n| name.is_char_boundary(n)).unwrap_or(0);
    // a zero would end the text
    OscType::String(name[..end].replace('\0', " "))
}

/// Encodes the messages in bundles that fit into datagrams.
fn bundles(messages: Vec<OscMessage>) -> Vec<Vec<u8>> {
    let encode = |content: &[OscPacket]| {
        let bundle = OscBundle { timetag: AT_ONCE, content: content.to_vec() };
        rosc::encoder::encode(&OscPacket::Bundle(bundle)).unwrap_or_default() // writes to memory
    };
    let (mut datagrams, mut content): (Vec<Vec<u8>>, Vec<OscPacket>) = (Vec::new(), Vec::new());
    let mut size = 16;
    for message in messages {
        let packet = OscPacket::Message(message);
        let bytes = 4 + rosc::encoder::encode(&packet).map_or(0, |bytes| bytes.len());
        if size + bytes > MAX_DATAGRAM_BYTES && !content.is_empty() {
            datagrams.push(encode(&content));
            (content, size) = (Vec::new(), 16);
        }
        content.push(packet);
        size += bytes;
    }
    datagrams.push(encode(&content));
    datagrams
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble::collide::Shape;
    use tumble::dynamics::{Material, RigidBody, Settings};

    /// Returns the messages of a datagram.
    fn messages(datagram: &[u8]) -> Vec<OscMessage> {
        let (rest, packet) = rosc::decoder::decode_udp(datagram).unwrap();
        let OscPacket::Bundle(bundle) = packet else { panic!("no bundle") };
        assert!(rest.is_empty());
        let one = |packet| match packet {
            OscPacket::Message(message) => message,
            OscPacket::Bundle(_) => panic!("a bundle within a bundle"),
        };
        bundle.content.into_iter().map(one).collect()
    }

    /// A receiver gets one impact of a sphere that falls from 0.5 m onto the ground: `m √(2 g h)` times
    /// 1 + e, at the place where it touches.
    #[test]
    fn a_receiver_gets_the_impulse_and_the_place_of_an_impact() {
        let engine = UdpSocket::bind("127.0.0.1:0").unwrap();
        engine.set_read_timeout(Some(std::time::Duration::from_secs(5))).unwrap();
        let mut sound = ContactSound::open(engine.local_addr().unwrap(), vec!["viewer".into()]).ok().unwrap();
        let mut world = World::new(Settings::default().with_dt(1e-3)).unwrap();
        world.add_static(RigidBody::fixed(Shape::half_space()).with_name("ground")).unwrap();
        let material = Material { restitution: 0.5, ..Material::default() };
        let sphere =
            RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("sphere").with_mass(2.0).with_material(material);
        world.add(sphere.with_pose(tumble::collide::Pose::translation(0.3, -0.2, 0.6))).unwrap();
        let viewer = Viewer {
            users: vec![tumble::net::sync::User {
                head: tumble::collide::Pose::translation(0.0, 0.0, 1.7),
                interpupillary_m: 0.064,
                input: 0,
            }],
            ..Viewer::default()
        };
        let (mut impacts, mut bytes) = (Vec::new(), [0; 2048]);
        for frame in 0..40 {
            for _ in 0..10 {
                world.step().unwrap();
                sound.step(&world);
            }
            sound.frame(frame, &world, &viewer);
            let length = engine.recv(&mut bytes).unwrap();
            let messages = messages(&bytes[..length]);
            assert_eq!(messages[0].addr, "/tumble/frame");
            assert_eq!(messages[0].args[0], OscType::Long(frame as i64));
            assert_eq!(messages[1].addr, "/tumble/listener");
            assert_eq!(messages[1].args[3], OscType::Float(1.7));
            impacts.extend(messages.into_iter().filter(|message| message.addr == "/tumble/impact"));
        }
        let first = impacts.first().expect("an impact");
        let mut names: Vec<String> = first.args[..2].iter().filter_map(|arg| arg.clone().string()).collect();
        names.sort();
        assert_eq!(names, ["ground", "sphere"]);
        let numbers: Vec<f32> = first.args[2..].iter().filter_map(|arg| arg.clone().float()).collect();
        assert!((numbers[0] - 0.3).abs() < 1e-3 && (numbers[1] + 0.2).abs() < 1e-3 && numbers[2].abs() < 0.01);
        let expected = 2.0 * (2.0f64 * 9.81 * 0.5).sqrt() * 1.5;
        assert!((f64::from(numbers[3]) - expected).abs() < 0.02 * expected, "{numbers:?}, expected {expected}");
        assert_eq!(impacts.len(), 1, "the next is after 0.64 s");
    }

    #[test]
    fn what_lies_on_the_ground_from_the_start_is_no_impact() {
        let engine = UdpSocket::bind("127.0.0.1:0").unwrap();
        let mut sound = ContactSound::open(engine.local_addr().unwrap(), Vec::new()).ok().unwrap();
        let mut world = World::new(Settings::default()).unwrap();
        world.add_static(RigidBody::fixed(Shape::half_space())).unwrap();
        let sphere = RigidBody::new(Shape::sphere(0.1).unwrap()).with_mass(2.0);
        world.add(sphere.with_pose(tumble::collide::Pose::translation(0.0, 0.0, 0.1))).unwrap();
        for frame in 0..20 {
            world.step().unwrap();
            assert!(!world.events().is_empty(), "it touches");
            sound.step(&world);
            sound.frame(frame, &world, &Viewer::default());
        }
        assert_eq!(sound.counts.impacts, 0);
    }

    #[test]
    fn too_many_contacts_are_cut_to_the_loudest_and_datagrams_stay_short() {
        let mut items: Vec<f64> = (0..200).map(|k| f64::from(k * 37 % 200)).collect();
        assert_eq!(keep_loudest(&mut items, |x| *x), 136);
        assert!(items.len() == 64 && items.iter().all(|x| *x >= 136.0));
        let long = OscMessage { addr: "/tumble/impact".into(), args: vec![name_of(&"ü".repeat(500)); 2] };
        let datagrams = bundles(vec![long; 130]);
        assert!(datagrams.iter().all(|datagram| datagram.len() <= MAX_DATAGRAM_BYTES));
        assert_eq!(datagrams.iter().map(|datagram| messages(datagram).len()).sum::<usize>(), 130);
    }
}
