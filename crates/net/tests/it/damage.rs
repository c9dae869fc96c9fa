//! Truncation at every byte and flips of every bit: errors, never panics, and never a wrong frame.

use crate::support::*;
use std::fs::OpenOptions;
use std::io::{Seek, SeekFrom, Write};
use tumble_net::record::*;

#[test]
fn cut_at_every_byte_it_reads_up_to_the_last_flush() {
    let scratch = Scratch::new("cut");
    for compression in COMPRESSIONS {
        let path = scratch.file("a.mcap");
        let lengths = record(&path, 8, options(compression, 2));
        let file = OpenOptions::new().write(true).open(&path).unwrap();
        let full = file.metadata().unwrap().len();
        let mut max = 8;
        for n in (0..full).rev() {
            file.set_len(n).unwrap();
            let safe =
                lengths.iter().rposition(|length| *length <= n && *length != lengths[0]).map_or(0, |k| k / 2 * 2);
            // Frame k is on disk once frame k | 1 is recorded, and lengths[1] is the first length
            // with frames.
            let safe = if n >= lengths[1] { safe.max(2) } else { 0 };
            match read_all(&path) {
                (frames, Ok(Ending::Cut { offset, .. })) => {
                    assert!(offset <= n);
                    assert!(
                        frames.len() >= safe && frames.len() <= max,
                        "{} frames of {n} bytes, {safe} are safe",
                        frames.len()
                    );
                    assert_eq!(frames.len() % 2, 0, "whole flushes");
                    assert_frames(&frames);
                    max = frames.len();
                }
                (_, Ok(Ending::Complete)) => panic!("{n} of {full} bytes pass for a complete file"),
                (_, Err(error)) => {
                    assert!(n < lengths[0] && safe == 0, "{n} bytes: {error}");
                    assert!(error.to_string().contains("byte"), "{error}");
                }
            }
        }
        assert_eq!(max, 0);
    }
}

#[test]
fn every_flipped_bit_is_noticed() {
    let scratch = Scratch::new("flip");
    let path = scratch.file("a.mcap");
    record(&path, 4, options(Compression::Lz4, 2));
    let bytes = std::fs::read(&path).unwrap();
    let mut file = OpenOptions::new().write(true).open(&path).unwrap();
    let mut put = |at: usize, byte: u8| {
        file.seek(SeekFrom::Start(at as u64)).unwrap();
        file.write_all(&[byte]).unwrap();
    };
    for at in 0..bytes.len() {
        for bit in 0..8 {
            put(at, bytes[at] ^ (1 << bit));
            let (frames, ending) = read_all(&path);
            assert!(!matches!(ending, Ok(Ending::Complete)), "bit {bit} of byte {at} was not noticed");
            assert_true_frames(&frames);
        }
        put(at, bytes[at]);
    }
    assert!(matches!(read_all(&path).1, Ok(Ending::Complete)), "the file is whole again");
}

/// Heavier damage, aimed at lengths as well: runs of random, zero and 0xff bytes.
#[test]
fn random_damage_never_panics() {
    let scratch = Scratch::new("dice");
    let mut dice = Dice(0x5eed);
    for compression in COMPRESSIONS {
        let path = scratch.file("a.mcap");
        record(&path, 6, options(compression, 2));
        let whole = std::fs::read(&path).unwrap();
        let mut noticed = 0;
        for round in 0..3000 {
            let mut bytes = whole.clone();
            let (at, run) = (dice.below(bytes.len() as u64) as usize, 1 + dice.below(16) as usize);
            let kind = dice.below(3);
            for byte in bytes.iter_mut().skip(at).take(run) {
                *byte = [dice.below(256) as u8, 0, 0xff][kind as usize];
            }
            std::fs::write(&path, &bytes).unwrap();
            let (frames, ending) = read_all(&path);
            assert_true_frames(&frames);
            noticed += usize::from(!matches!(ending, Ok(Ending::Complete)));
            // A run of zeros may hit a checksum, which then counts as "none made".
            assert!(
                bytes == whole || kind == 1 || !matches!(ending, Ok(Ending::Complete)),
                "round {round}: not noticed"
            );
        }
        assert!(noticed > 2500, "{compression:?}: {noticed}");
    }
}

/// With all checksums disabled, damage reaches the parsers behind them.
#[test]
fn damage_behind_the_checksums_never_panics() {
    let scratch = Scratch::new("behind");
    let (path, out) = (scratch.file("a.mcap"), scratch.file("out.mcap"));
    record(&path, 4, options(Compression::None, 2));
    let mut whole = std::fs::read(&path).unwrap();
    let chunks = forget_checksums(&mut whole);
    assert_eq!(chunks.len(), 3, "the scene's and two of frames");
    let mut dice = Dice(0xbad5eed);
    let (mut refused, mut mended) = (0, 0);
    for round in 0..6000 {
        let mut bytes = whole.clone();
        let (start, end) = chunks[dice.below(3) as usize];
        for _ in 0..1 + dice.below(3) {
            let at = start + dice.below((end - start) as u64) as usize;
            bytes[at] = [dice.below(256) as u8, 0, 0xff, bytes[at] ^ 1 << dice.below(8)][dice.below(4) as usize];
        }
        std::fs::write(&path, &bytes).unwrap();
        refused += usize::from(read_all(&path).1.is_err());
        if round % 20 == 0 && recover(&path, &out).is_ok() {
            std::fs::remove_file(&out).unwrap();
            mended += 1;
        }
    }
    // much of a file is schema text and numbers, in which a change is no error
    assert!(refused > 1000 && mended > 100, "{refused} refused, {mended} mended");
}

/// Sets the checksums of all chunks and of the data to "none made"; returns where each chunk's body
/// begins and ends.
fn forget_checksums(bytes: &mut [u8]) -> Vec<(usize, usize)> {
    let mut chunks = Vec::new();
    let mut at = 8;
    loop {
        let body = at + 9;
        let end = body + u64::from_le_bytes(bytes[at + 1..body].try_into().unwrap()) as usize;
        match bytes[at] {
            0x06 => {
                bytes[body + 24..body + 28].fill(0); // behind two times and a size
                chunks.push((body, end));
            }
            0x0f => {
                bytes[body..end].fill(0);
                return chunks;
            }
            _ => {}
        }
        at = end;
    }
}
