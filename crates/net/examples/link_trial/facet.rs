//! A facet that draws nothing: checks each state, sends READY, waits for PRESENT, sends PRESENTED.

use super::options::Options;
use super::{Failure, clock_ns};
use std::time::{Duration, Instant};
use tumble_net::sync::shm::ShmFacet;
use tumble_net::sync::transport::{Delivery, FacetLink, LinkEvent, Message};
use tumble_net::sync::udp::{SharedKey, Timing, UdpFacet};

/// Words of a message: its kind, and its frame.
pub const STATE: u64 = 1;
pub const PRESENT: u64 = 2;
pub const END: u64 = 3;
pub const READY: u64 = 4;
pub const PRESENTED: u64 = 5;

/// Returns the word `at` of a message; `u64::MAX` if the message is shorter.
pub fn word(message: &[u8], at: usize) -> u64 {
    message.get(8 * at..8 * at + 8).and_then(|bytes| bytes.try_into().ok()).map_or(u64::MAX, u64::from_le_bytes)
}

/// Returns a message of these words.
pub fn words(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

pub fn connect(options: &Options) -> Result<Box<dyn FacetLink>, Failure> {
    if options.transport == "shm" {
        return Ok(Box::new(ShmFacet::new(&options.run, options.facet)?));
    }
    let key = options.key.as_deref().map(SharedKey::read).transpose()?;
    Ok(Box::new(UdpFacet::connect(options.connect, options.facet, key, Timing::default())?))
}

/// Runs until the server sends END or is gone, or nothing arrives for 20 s.
pub fn run(options: &Options) -> Result<(), Failure> {
    let mut link = connect(options)?;
    let mut message = Message::default();
    let mut expected = 0;
    let (mut faults, mut last) = (0u64, Instant::now());
    while last.elapsed() < Duration::from_secs(20) {
        let event = link.recv(Duration::from_secs(1), &mut message)?;
        let now = clock_ns();
        match event {
            None => continue,
            Some(LinkEvent::Opened) => {}
            Some(LinkEvent::Closed(why)) => {
                if expected > 0 {
                    return Err(format!(
                        "facet {}: the server is gone ({why:?}) after frame {expected}",
                        options.facet
                    )
                    .into());
                }
            }
            Some(LinkEvent::Message) => {
                let frame = word(&message, 1);
                match word(&message, 0) {
                    STATE => {
                        // whole, in order, once: length, frame, and the frame again at the end
                        let whole = message.len() == options.bytes && word(&message[message.len() - 8..], 0) == frame;
                        faults += u64::from(!whole) + u64::from(frame != expected);
                        expected = frame + 1;
                        link.send(
                            Delivery::Reliable,
                            &words(&[READY, frame, now.saturating_sub(word(&message, 2)), faults]),
                        )?;
                    }
                    PRESENT => {
                        link.send(Delivery::Reliable, &words(&[PRESENTED, frame, now]))?;
                    }
                    _ => {
                        // gives the link time to acknowledge
                        std::thread::sleep(Duration::from_millis(100));
                        return Ok(());
                    }
                }
            }
        }
        last = Instant::now();
    }
    Err(format!("facet {}: nothing came for 20 s", options.facet).into())
}
