//! Header and frames of a datagram, the packets of a handshake, and the header of a sample in
//! shared memory: accepted bytes are written back identically.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_net::sync::shm::wire::{HEADER_BYTES, SampleHeader};
use tumble_net::sync::udp::handshake::{Hello, Reply};
use tumble_net::sync::udp::keys::Handshake;
use tumble_net::sync::udp::{SharedKey, frames, packet};

fuzz_target!(|bytes: &[u8]| {
    if let Some(frames) = frames::parse(bytes) {
        let mut written = Vec::new();
        frames.iter().for_each(|frame| frame.write(&mut written));
        assert_eq!(written, bytes);
    }
    if let Some(bytes) = bytes.first_chunk::<HEADER_BYTES>() {
        let words: Vec<u64> = bytes
            .chunks_exact(8)
            .map(|word| word.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte)))
            .collect();
        let words = [0, 1, 2, 3, 4, 5].map(|k| words[k]);
        assert!(SampleHeader::parse(words).is_ok_and(|head| head.words() == words) || SampleHeader::parse(words).is_err());
    }
    // a matching header and checksum, so that the checks behind them are reached
    let mut datagram = bytes[..bytes.len().min(packet::MAX_DATAGRAM - packet::TAG_BYTES)].to_vec();
    if datagram.len() < packet::HEADER_BYTES {
        assert!(packet::parse(bytes).is_err());
        return;
    }
    let _ = packet::parse(&datagram);
    let handshake = Handshake::new(&SharedKey::new([7; 32]));
    packet::set_length(&mut datagram);
    let tagged = &mut datagram.clone();
    handshake.tag(tagged);
    packet::finish(&mut datagram, &[0; packet::TAG_BYTES]);
    for datagram in [&datagram, tagged] {
        if let Ok(header) = packet::parse(datagram) {
            let mut again = Vec::new();
            packet::begin(&mut again, header);
            assert_eq!((again[..3].to_vec(), &again[9..]), (datagram[..3].to_vec(), &datagram[9..packet::HEADER_BYTES]));
            let _ = (Hello::read(datagram, &handshake), Reply::read(datagram, &handshake));
        }
    }
});
