//! Recovery of damaged recordings.

use crate::support::*;
use std::fs::OpenOptions;
use tumble_net::record::*;

#[test]
fn a_complete_file_comes_out_byte_for_byte() {
    let scratch = Scratch::new("mend-whole");
    for compression in COMPRESSIONS {
        let (path, out) = (scratch.file("a.mcap"), scratch.file(&format!("{compression:?}.mcap")));
        record(&path, 20, options(compression, 6));
        let report = recover(&path, &out).unwrap();
        assert_eq!((report.frames, report.messages, report.chunks, report.fault), (20, 41, 5, None));
        assert!(std::fs::read(&path).unwrap() == std::fs::read(&out).unwrap(), "{compression:?}");
    }
}

/// A file that is cut after n frames and recovered equals the finished file of a run of n frames.
#[test]
fn a_cut_file_becomes_that_of_a_shorter_run() {
    let scratch = Scratch::new("mend-cut");
    for compression in COMPRESSIONS {
        let (path, short) = (scratch.file("a.mcap"), scratch.file("short.mcap"));
        let lengths = record(&path, 12, options(compression, 3));
        let file = OpenOptions::new().write(true).open(&path).unwrap();
        for frames in [9, 6, 3] {
            file.set_len(lengths[frames - 1] + 5).unwrap(); // and the beginning of the next record
            let out = scratch.file(&format!("{compression:?}-{frames}.mcap"));
            let report = recover(&path, &out).unwrap();
            assert_eq!((report.frames, report.bytes_used), (frames as u64, lengths[frames - 1]));
            assert!(report.fault.unwrap().contains(&format!("byte {}", lengths[frames - 1])));
            record(&short, frames as u64, options(compression, 3));
            assert!(std::fs::read(&short).unwrap() == std::fs::read(&out).unwrap(), "{compression:?}, {frames} frames");
        }
    }
}

#[test]
fn an_empty_result_is_an_error_and_leaves_no_file() {
    let scratch = Scratch::new("mend-empty");
    let (path, out) = (scratch.file("a.mcap"), scratch.file("out.mcap"));
    let lengths = record(&path, 4, options(Compression::Lz4, 4));
    let file = OpenOptions::new().write(true).open(&path).unwrap();
    // lengths[0] is the size of the file with the scene and no frame yet
    for n in [lengths[0] + 3, lengths[0], 300, 8] {
        file.set_len(n).unwrap();
        let error = recover(&path, &out).unwrap_err();
        assert!(matches!(error, RecordError::NothingToRecover { .. }), "{n}: {error}");
        assert!(!out.exists());
    }
    for bytes in [&b""[..], b"not an MCAP file at all"] {
        std::fs::write(&path, bytes).unwrap();
        assert!(matches!(recover(&path, &out), Err(RecordError::NotMcap { .. })));
        assert!(!out.exists());
    }
}

#[test]
fn nothing_is_overwritten() {
    let scratch = Scratch::new("mend-over");
    let (path, out) = (scratch.file("a.mcap"), scratch.file("precious"));
    record(&path, 4, options(Compression::Lz4, 2));
    let before = std::fs::read(&path).unwrap();
    std::fs::write(&out, "mine").unwrap();
    assert!(matches!(recover(&path, &out), Err(RecordError::Io { .. })));
    assert!(matches!(recover(&path, &path), Err(RecordError::Io { .. })));
    assert_eq!(std::fs::read_to_string(&out).unwrap(), "mine");
    assert!(std::fs::read(&path).unwrap() == before);
}

/// Each flush is a chunk of three frames: with one chunk damaged, three frames are lost and the
/// rest stays.
#[test]
fn a_damaged_chunk_is_left_out_and_named() {
    let scratch = Scratch::new("mend-hole");
    let (path, out) = (scratch.file("a.mcap"), scratch.file("out.mcap"));
    let lengths = record(&path, 12, options(Compression::Zstd, 3));
    let mut bytes = std::fs::read(&path).unwrap();
    let chunk = lengths[2] as usize; // frames 3, 4, 5
    assert_eq!(bytes[chunk], 0x06, "a chunk begins here");
    bytes[chunk + 100] ^= 0x10;
    std::fs::write(&path, &bytes).unwrap();
    let error = read_all(&path).1.unwrap_err();
    assert!(matches!(error, RecordError::Corrupt { offset, .. } if offset == chunk as u64), "{error}");
    let report = recover(&path, &out).unwrap();
    assert_eq!((report.frames, report.chunks, report.damaged_chunks), (9, 4, 1));
    assert!(report.fault.unwrap().contains(&format!("byte {chunk}")));
    let (frames, ending) = read_all(&out);
    let numbers: Vec<u64> = frames.iter().map(|frame| frame.frame).collect();
    assert_eq!((numbers, ending.unwrap()), (vec![0, 1, 2, 6, 7, 8, 9, 10, 11], Ending::Complete));
    assert!(frames.iter().all(|frame| frame.poses == poses(frame.frame) && frame.state == state(frame.frame)));
}

/// A bit flip in any place gives a complete file, or an error and no file.
#[test]
fn whatever_comes_out_is_complete() {
    let scratch = Scratch::new("mend-flip");
    let (path, out) = (scratch.file("a.mcap"), scratch.file("out.mcap"));
    record(&path, 6, options(Compression::Lz4, 2));
    let whole = std::fs::read(&path).unwrap();
    let mut dice = Dice(0xf11b);
    let mut mended = 0;
    for _ in 0..150 {
        let mut bytes = whole.clone();
        bytes[dice.below(whole.len() as u64) as usize] ^= 1 << dice.below(8);
        std::fs::write(&path, &bytes).unwrap();
        match recover(&path, &out) {
            Ok(report) => {
                assert!(report.fault.is_some(), "a flipped bit was not noticed");
                let ending = read_all(&out).1;
                // a flip in the description survives the recovery: no other record repeats its
                // content
                assert!(matches!(ending, Ok(Ending::Complete) | Err(RecordError::NotARecording { .. })), "{ending:?}");
                std::fs::remove_file(&out).unwrap();
                mended += 1;
            }
            Err(_) => assert!(!out.exists()),
        }
    }
    assert!(mended > 10, "{mended}");
}

/// The first chunk has the scene and the definitions of all channels. Without it the frames are
/// whole, and the entities have their names.
#[test]
fn damage_in_the_first_chunk_loses_no_frame() {
    let scratch = Scratch::new("mend-first");
    let (path, out) = (scratch.file("a.mcap"), scratch.file("out.mcap"));
    record(&path, 12, options(Compression::Lz4, 3));
    let whole = std::fs::read(&path).unwrap();
    let names: Vec<String> = {
        let mut reader = read(&path).unwrap();
        reader.next_frame().unwrap();
        reader.entities().iter().map(|entity| entity.name.clone()).collect()
    };
    // records are an opcode, a length of 8 bytes, and a body
    let mut at = 8;
    let length = |at: usize| u64::from_le_bytes(whole[at + 1..at + 9].try_into().unwrap()) as usize;
    while whole[at] != 0x06 {
        at += 9 + length(at);
    }
    let chunk = at + 9..at + 9 + length(at);
    let step = chunk.len() / 60;
    // the first 16 bytes are times, which are not needed
    for flipped in chunk.clone().skip(16).step_by(step.max(1)) {
        let mut bytes = whole.clone();
        bytes[flipped] ^= 0x04;
        std::fs::write(&path, &bytes).unwrap();
        let report = recover(&path, &out).unwrap_or_else(|e| panic!("byte {flipped}: {e}"));
        assert_eq!((report.frames, report.damaged_chunks), (12, 1), "byte {flipped}");
        let (frames, ending) = read_all(&out);
        assert_eq!((frames.len(), ending.unwrap()), (12, Ending::Complete), "byte {flipped}");
        assert!(frames.iter().all(|f| f.poses == poses(f.frame) && f.state == state(f.frame)), "byte {flipped}");
        let mut reader = read(&out).unwrap();
        reader.next_frame().unwrap();
        assert_eq!(reader.entities().iter().map(|e| &e.name).collect::<Vec<_>>(), names.iter().collect::<Vec<_>>());
        std::fs::remove_file(&out).unwrap();
    }
}

#[test]
fn a_pipe_is_no_recording_and_is_not_waited_for() {
    let scratch = Scratch::new("mend-pipe");
    let (path, out) = (scratch.file("pipe"), scratch.file("out.mcap"));
    assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
    let (sent, answer) = std::sync::mpsc::channel();
    std::thread::spawn(move || sent.send((recover(&path, &out).map(drop), is_recording(&path))));
    let (recovered, recording) =
        answer.recv_timeout(std::time::Duration::from_secs(20)).expect("it waits for a writer");
    assert!(matches!(recovered, Err(RecordError::NotMcap { .. })), "{recovered:?}");
    assert!(!recording);
}
