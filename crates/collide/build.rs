//! Computes a hash of the sources of this crate. The cache of sphere trees and shapes uses it as
//! the version of the builders.

use std::path::{Path, PathBuf};

fn main() {
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    println!("cargo::rerun-if-changed=src");
    for file in sources(Path::new("src")) {
        // unreadable files count as empty: the compiler reports them
        let bytes = std::fs::read(&file).unwrap_or_default();
        let name = file.to_string_lossy().replace('\\', "/");
        for byte in name.bytes().chain(bytes).filter(|b| *b != b'\r') {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
    println!("cargo::rustc-env=TUMBLE_BUILDERS={hash:016x}");
}

/// Returns the files below a folder, sorted.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for path in entries.map(|e| e.path()) {
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}
