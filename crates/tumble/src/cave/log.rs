//! `frames.jsonl`: a line for each frame that a facet has shown.

use super::stage::facet_folder;
use crate::failure::Failure;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};
use tumble::render::Image;

/// A line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    pub frame: u64,
    pub time_s: f64,
    /// Hash of what was applied and drawn, hexadecimal.
    pub state: String,
    /// First 16 bytes of the BLAKE3 of the picture's pixels, hexadecimal; zeros without a picture.
    pub image: String,
    /// When it was shown, microseconds since 1970: comparable between processes of one machine.
    pub shown_unix_us: u64,
}

/// A facet's folder.
pub struct FrameLog {
    folder: PathBuf,
    lines: BufWriter<File>,
    pictures: bool,
}

impl FrameLog {
    /// Makes the folder, and goes on behind the lines that a facet before it has written in this run. Pictures of runs before are removed.
    pub fn open(folder: &Path, facet: &str, pictures: bool, anew: bool) -> Result<FrameLog, Failure> {
        let folder = facet_folder(folder, facet);
        let failed = |e: std::io::Error| Failure::input(format!("{}: cannot be written: {e}", folder.display()));
        std::fs::create_dir_all(&folder).map_err(failed)?;
        let file = OpenOptions::new().create(true).append(true).open(folder.join("frames.jsonl")).map_err(failed)?;
        if anew {
            file.set_len(0).map_err(failed)?;
            let all = std::fs::read_dir(&folder).map_err(failed)?;
            let old = |name: &str| name.strip_prefix("frame_").and_then(|n| n.strip_suffix(".png")).is_some_and(|n| n.parse::<u64>().is_ok());
            for entry in all.flatten().filter(|e| e.file_name().to_str().is_some_and(old)) {
                std::fs::remove_file(entry.path()).map_err(failed)?;
            }
        }
        Ok(FrameLog { folder, lines: BufWriter::new(file), pictures })
    }

    /// A frame that is on the screen. The line is written whole, behind the picture.
    pub fn shown(&mut self, frame: u64, time_s: f64, state: &[u8; 16], hash: &[u8; 16], image: Option<&Image>) -> Result<(), Failure> {
        let shown = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        if let Some(image) = image.filter(|_| self.pictures) {
            image.write_png(self.folder.join(format!("frame_{frame:06}.png"))).map_err(|e| Failure::run("the frames", e))?;
        }
        let line = Line { frame, time_s, state: hex(state), image: hex(hash), shown_unix_us: shown.as_micros() as u64 };
        let text = serde_json::to_string(&line).map_err(|e| Failure::run("the frames", e))? + "\n";
        self.lines.write_all(text.as_bytes()).and_then(|()| self.lines.flush()).map_err(|e| Failure::run("the frames", e))
    }
}

/// In hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
