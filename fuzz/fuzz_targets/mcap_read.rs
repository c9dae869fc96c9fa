//! A recording: read to its end or its first error. The reader needs a file, so the bytes go
//! through a file in memory if the system has one.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::path::PathBuf;
use std::sync::LazyLock;

static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("tumble-fuzz-{}.mcap", std::process::id()))
});

fuzz_target!(|bytes: &[u8]| {
    if std::fs::write(&*FILE, bytes).is_err() {
        return;
    }
    let Ok(mut reader) = tumble_net::record::read(&*FILE) else { return };
    let mut last = None;
    while let Ok(Some(frame)) = reader.next_frame() {
        assert!(last.is_none_or(|l| l < frame.frame), "frames go up");
        assert_eq!(frame.poses.len(), reader.entities().len());
        last = Some(frame.frame);
    }
});
