//! Client of a VRPN server, on a thread of its own: reports of devices become the messages that trackers send as
//! OSC, and go through the same decoder.
//!
//! The client connects by TCP, and again a second after a connection was lost. It writes nothing but its greeting.

use super::osc::{Counts, OscDecoder, TrackedInput};
use super::presence::Presence;
use super::socket::{POLL_INTERVAL, lock};
use crate::failure::Failure;
use rosc::{OscMessage, OscType};
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tumble::net::vrpn::{GREETING, Report, VrpnStream};
use tumble::scene::cave::{DeviceMap, Tracker};

/// Time to connect and to be greeted.
const GREETING_TIMEOUT: Duration = Duration::from_secs(3);
/// Time between two attempts.
const RETRY_INTERVAL: Duration = Duration::from_secs(1);
/// Largest number of buttons of a user.
const MAX_BUTTONS: i32 = 32;

/// A connection to a server and its thread.
pub struct VrpnClient {
    decoder: Arc<Mutex<OscDecoder>>,
    presence: Arc<Presence>,
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl VrpnClient {
    /// Starts the thread. The axes and the users are those of the tracker.
    ///
    /// # Errors
    /// An address that has no meaning, and maps of users that the tracker does not have.
    pub fn open(server: &str, maps: &[DeviceMap], tracker: &Tracker) -> Result<VrpnClient, Failure> {
        if maps.is_empty() {
            return Err(Failure::input("--vrpn: no device moves a user; name them with --vrpn-map DEVICE=USER/PART"));
        }
        if let Some(stray) = maps.iter().find(|map| !tracker.users.contains(&map.user)) {
            let users = tracker.users.join(", ");
            return Err(Failure::input(format!("--vrpn-map: there is no user \"{}\"; there are {users}", stray.user)));
        }
        let unknown =
            |why: String| Failure::input(format!("--vrpn {server}: {why}; expected HOST:PORT, such as 10.0.0.7:3883"));
        let address = server.to_socket_addrs().map_err(|e| unknown(e.to_string()))?.next();
        let address = address.ok_or_else(|| unknown("has no address".into()))?;
        let (decoder, end) = (Arc::new(Mutex::new(OscDecoder::new(tracker))), Arc::new(AtomicBool::new(false)));
        let presence = Arc::new(Presence::new(format!("VRPN {address}")));
        let (maps, ended) = (maps.to_vec(), end.clone());
        let session = Session { address, maps, decoder: decoder.clone(), presence: presence.clone(), end: ended };
        let builder = std::thread::Builder::new().name("vrpn".into());
        let thread = builder.spawn(move || session.run()).map_err(|e| Failure::run("the VRPN client", e))?;
        Ok(VrpnClient { decoder, presence, end, thread: Some(thread) })
    }

    /// Returns the users' input that changed since the last call.
    pub fn inputs(&self) -> Vec<TrackedInput> {
        lock(&self.decoder).inputs()
    }

    /// Returns whether the server answers.
    pub fn presence(&self) -> &Presence {
        &self.presence
    }

    /// Returns the counts.
    pub fn counts(&self) -> Counts {
        lock(&self.decoder).counts.clone()
    }
}

impl Drop for VrpnClient {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The part of a client on its thread.
struct Session {
    address: SocketAddr,
    maps: Vec<DeviceMap>,
    decoder: Arc<Mutex<OscDecoder>>,
    presence: Arc<Presence>,
    end: Arc<AtomicBool>,
}

impl Session {
    fn run(&self) {
        while !self.ended() {
            if let Err(why) = self.connect() {
                self.presence.lost(Instant::now(), &why);
            }
            let wait = Instant::now();
            while wait.elapsed() < RETRY_INTERVAL && !self.ended() {
                std::thread::sleep(POLL_INTERVAL);
            }
        }
    }

    fn ended(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }

    /// Reads until the end or a fault, which it returns.
    fn connect(&self) -> Result<(), String> {
        let failed = |e: std::io::Error| e.to_string();
        let mut socket = TcpStream::connect_timeout(&self.address, GREETING_TIMEOUT).map_err(failed)?;
        socket.set_read_timeout(Some(POLL_INTERVAL)).map_err(failed)?;
        socket.set_write_timeout(Some(GREETING_TIMEOUT)).map_err(failed)?;
        socket.write_all(&GREETING).map_err(failed)?;
        let (mut stream, mut buttons) = (VrpnStream::default(), vec![0u32; self.maps.len()]);
        let (start, mut heard, mut bytes) = (Instant::now(), false, [0; 4096]);
        while !self.ended() {
            match socket.read(&mut bytes) {
                Ok(0) => return Err("the server closed the connection".into()),
                Ok(length) => {
                    if !std::mem::replace(&mut heard, true) {
                        self.presence.found("is connected");
                    }
                    stream.take(&bytes[..length], |report| self.apply(&report, &mut buttons))?;
                }
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                    if !heard && start.elapsed() > GREETING_TIMEOUT {
                        return Err(format!("the server says nothing for {} s", GREETING_TIMEOUT.as_secs()));
                    }
                }
                Err(e) => return Err(e.to_string()),
            }
        }
        Ok(())
    }

    /// Gives a report to the decoder as the message of an OSC tracker.
    fn apply(&self, report: &Report, buttons: &mut [u32]) {
        for (map, held) in self.maps.iter().zip(buttons) {
            let args = match report {
                Report::Pose { device, sensor, numbers }
                    if *device == map.device && *sensor == map.sensor && map.part != "buttons" =>
                {
                    numbers.iter().map(|x| OscType::Double(*x)).collect()
                }
                Report::Button { device, button, held: pressed }
                    if *device == map.device && map.part == "buttons" && (0..MAX_BUTTONS - 1).contains(button) =>
                {
                    *held = (*held & !(1 << button)) | (u32::from(*pressed) << button);
                    vec![OscType::Long(i64::from(*held))]
                }
                _ => continue,
            };
            let addr = format!("/tumble/user/{}/{}", map.user, map.part);
            lock(&self.decoder).apply_one(Instant::now(), &OscMessage { addr, args });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;
    use tumble::net::sync::Input;

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

    fn tracker() -> Tracker {
        Tracker { users: vec!["viewer".into()], origin_m: [0.0, 0.0, 0.5], ..Tracker::of(&[]) }
    }

    /// Waits for inputs, at most 10 s.
    fn awaited(client: &VrpnClient, wanted: impl Fn(&Input) -> bool) -> Input {
        let start = Instant::now();
        loop {
            if let Some(input) = client.inputs().into_iter().map(|tracked| tracked.input).find(&wanted) {
                return input;
            }
            assert!(start.elapsed() < Duration::from_secs(10), "no such input");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// A server that speaks the protocol: greets, names, reports; drops the connection, and is found again with
    /// other numbers for the same names.
    #[test]
    fn poses_and_buttons_arrive_and_a_lost_server_is_found_again() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let at = listener.local_addr().unwrap().to_string();
        let maps = ["Glasses:1=viewer/head", "Wand=viewer/hand/right", "Wand=viewer/buttons"];
        let maps: Vec<DeviceMap> = maps.iter().map(|map| map.parse().unwrap()).collect();
        let client = VrpnClient::open(&at, &maps, &tracker()).unwrap_or_else(|e| panic!("{}", e.report()));
        for (round, x) in [(0, 0.25), (1, 0.75)] {
            let (mut socket, _) = listener.accept().unwrap();
            let mut greeting = [0; 24];
            socket.read_exact(&mut greeting).unwrap();
            assert!(greeting.starts_with(b"vrpn: ver. 07.35  0"));
            let (glasses, wand, poses, pressed) = (3 + round, 8 - round, 1 + round, 6 + round);
            let unit = [0.0, 0.0, 0.0, 1.0];
            let at = |x: f64| [x, 0.5, 1.25, unit[0], unit[1], unit[2], unit[3]];
            let bytes = [
                GREETING.to_vec(),
                named(glasses, -1, "Glasses"),
                named(wand, -1, "Wand"),
                named(poses, -2, "vrpn_Tracker Pos_Quat"),
                named(pressed, -2, "vrpn_Button Change"),
                // sensor 0 of the glasses moves nothing, and a quaternion of length 2 is dropped
                pose(glasses, poses, 0, at(9.0)),
                pose(wand, poses, 0, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0]),
                pose(wand, poses, 0, at(-x)),
                message(wand, pressed, &[2i32.to_be_bytes(), 1i32.to_be_bytes()].concat()),
                pose(glasses, poses, 1, at(x)),
            ]
            .concat();
            bytes.chunks(17).for_each(|part| socket.write_all(part).unwrap());
            let input = awaited(&client, |input| input.head.is_some_and(|head| head.translation.x == x));
            let head = input.head.unwrap().translation;
            assert_eq!([head.x, head.y, head.z], [x, 0.5, 1.75]);
            assert_eq!((input.hands[1].unwrap().translation.x, input.buttons), (-x, 4));
        }
        assert_eq!(client.counts().dropped["invalid_rotation"], 2);
        // each loss of the connection is reported, also for the same reason, and is an alarm
        let (start, about) = (Instant::now(), client.presence());
        while about.alarm().is_none() {
            assert!(start.elapsed() < Duration::from_secs(10), "the loss is no alarm");
            std::thread::sleep(Duration::from_millis(5));
        }
        let closed = "the server closed the connection";
        assert_eq!(about.alarm().unwrap(), format!("VRPN {at}: {closed}"));
        let (lost, found) = (format!("VRPN {at}: {closed}; tries again"), format!("VRPN {at}: is connected"));
        assert_eq!(about.lines(), [found.clone(), lost.clone(), found, lost]);
    }

    #[test]
    fn a_map_names_device_sensor_user_and_part() {
        let map: DeviceMap = "Glasses 1:2=viewer/hand/left".parse().unwrap();
        assert_eq!(
            (map.device.as_str(), map.sensor, map.user.as_str(), map.part.as_str()),
            ("Glasses 1", 2, "viewer", "hand/left")
        );
        for wrong in ["Glasses", "Glasses=viewer", "Glasses=viewer/foot", "=viewer/head", "G:x=viewer/head", "G=/head"]
        {
            assert!(wrong.parse::<DeviceMap>().unwrap_err().starts_with("expected DEVICE"), "{wrong}");
        }
        let stray = ["G=other/head".parse().unwrap()];
        let said = VrpnClient::open("127.0.0.1:1", &stray, &tracker()).err().unwrap();
        assert!(said.report().contains("there is no user \"other\"; there are viewer"), "{}", said.report());
    }
}
