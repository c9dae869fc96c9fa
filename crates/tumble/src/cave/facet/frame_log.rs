//! `frames.jsonl`: one line per shown frame of a facet.

use crate::cave::run_setup::facet_folder;
use crate::failure::Failure;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{SystemTime, UNIX_EPOCH};
use tumble::render::Image;

/// One line of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameLine {
    pub frame: u64,
    pub time_s: f64,
    /// Hash of the applied and drawn state, hexadecimal.
    pub state: String,
    /// First 16 bytes of the BLAKE3 hash of the picture's pixels, hexadecimal; zeros without a
    /// picture.
    pub image: String,
    /// Time of presentation, µs since 1970: comparable between processes of one machine.
    pub shown_unix_us: u64,
}

/// Maximum number of frames that wait to be written; meanwhile the facet draws no further frame.
const MAX_WAITING: usize = 2;

/// Writer of a facet's folder. It has its own thread, because compressing a large picture can take
/// longer than the server's drop timeout.
pub struct FrameLog {
    frames: Option<SyncSender<(FrameLine, Option<Image>)>>,
    writer: Option<JoinHandle<Result<(), Failure>>>,
    waiting: Arc<AtomicUsize>,
    pictures: bool,
}

impl FrameLog {
    /// Creates the folder and continues after the lines that this run has written before. Pictures
    /// of earlier runs are removed.
    pub fn open(folder: &Path, facet: &str, pictures: bool, anew: bool) -> Result<FrameLog, Failure> {
        let folder = facet_folder(folder, facet);
        let failed = |e: std::io::Error| Failure::input(format!("{}: cannot be written: {e}", folder.display()));
        std::fs::create_dir_all(&folder).map_err(failed)?;
        let file = OpenOptions::new().create(true).append(true).open(folder.join("frames.jsonl")).map_err(failed)?;
        if anew {
            file.set_len(0).map_err(failed)?;
            let all = std::fs::read_dir(&folder).map_err(failed)?;
            let old = |name: &str| {
                name.strip_prefix("frame_")
                    .and_then(|n| n.strip_suffix(".png"))
                    .is_some_and(|n| n.parse::<u64>().is_ok())
            };
            for entry in all.flatten().filter(|e| e.file_name().to_str().is_some_and(old)) {
                std::fs::remove_file(entry.path()).map_err(failed)?;
            }
        }
        let (frames, incoming) = sync_channel(MAX_WAITING + 1);
        let waiting = Arc::new(AtomicUsize::new(0));
        let left = waiting.clone();
        let writer =
            std::thread::Builder::new().name("frames".into()).spawn(move || write_all(&folder, file, &incoming, &left));
        let writer = writer.map_err(|e| Failure::run("the frames", e))?;
        Ok(FrameLog { frames: Some(frames), writer: Some(writer), waiting, pictures })
    }

    /// Returns whether another frame may be drawn.
    pub fn has_room(&self) -> bool {
        self.waiting.load(Ordering::Acquire) < MAX_WAITING
    }

    /// Returns an error of the writer so far, such as a full disk.
    pub fn check(&mut self) -> Result<(), Failure> {
        if self.writer.as_ref().is_some_and(JoinHandle::is_finished) { self.finish() } else { Ok(()) }
    }

    /// Logs a presented frame.
    pub fn shown(
        &mut self,
        frame: u64,
        time_s: f64,
        state: &[u8; 16],
        hash: &[u8; 16],
        image: Option<Image>,
    ) -> Result<(), Failure> {
        let shown = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let line =
            FrameLine { frame, time_s, state: hex(state), image: hex(hash), shown_unix_us: shown.as_micros() as u64 };
        self.waiting.fetch_add(1, Ordering::AcqRel);
        let sent =
            self.frames.as_ref().is_some_and(|frames| frames.send((line, image.filter(|_| self.pictures))).is_ok());
        if sent { Ok(()) } else { self.finish() }
    }

    /// Waits until everything is written and returns an error of the writer.
    pub fn finish(&mut self) -> Result<(), Failure> {
        self.frames = None;
        self.writer.take().map_or(Ok(()), |writer| {
            writer.join().unwrap_or_else(|_| Err(Failure::run("the frames", "their writer has ended")))
        })
    }
}

/// Writes each picture, and then its line.
fn write_all(
    folder: &Path,
    mut file: File,
    incoming: &Receiver<(FrameLine, Option<Image>)>,
    waiting: &AtomicUsize,
) -> Result<(), Failure> {
    let wrong = |file: &Path, why: &dyn std::fmt::Display| Failure::run(&format!("writing {}", file.display()), why);
    let lines = folder.join("frames.jsonl");
    while let Ok((line, image)) = incoming.recv() {
        if let Some(image) = image {
            let path = folder.join(format!("frame_{:06}.png", line.frame));
            image.write_png(&path).map_err(|e| wrong(&path, &e))?;
        }
        let text = serde_json::to_string(&line).map_err(|e| wrong(&lines, &e))? + "\n";
        file.write_all(text.as_bytes()).map_err(|e| wrong(&lines, &e))?;
        waiting.fetch_sub(1, Ordering::AcqRel);
    }
    Ok(())
}

/// Returns the bytes in hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
