//! `frames.jsonl`: one line per shown frame of a facet.

use crate::cave::facet_report::Reporter;
use crate::failure::Failure;
use crate::frames_folder::{LIST, begin, facet_folder, picture_paths};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
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
    reporter: Reporter,
}

/// Treatment of the frames of an earlier run in the same folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Earlier {
    /// They are an error.
    Refuse,
    /// They are removed.
    Remove,
    /// They are of this run: the facet was started again.
    Continue,
}

impl FrameLog {
    /// Creates the folder. It must have no frames of an earlier run, which `Earlier::Remove`
    /// removes; `Earlier::Continue` appends to those that this run has written before.
    pub fn open(
        folder: &Path,
        facet: &str,
        pictures: bool,
        earlier: Earlier,
        reporter: Reporter,
    ) -> Result<FrameLog, Failure> {
        let folder = facet_folder(folder, facet);
        let failed = |e: std::io::Error| Failure::input(format!("{}: cannot be written: {e}", folder.display()));
        std::fs::create_dir_all(&folder).map_err(failed)?;
        if earlier != Earlier::Continue {
            begin(&folder, earlier == Earlier::Remove)?;
        }
        let (truncate, append) = (earlier == Earlier::Remove, earlier != Earlier::Remove);
        let mut options = OpenOptions::new();
        options.create(true).write(true).truncate(truncate).append(append);
        let file = options.open(folder.join(LIST)).map_err(failed)?;
        let (frames, incoming) = sync_channel(MAX_WAITING + 1);
        let waiting = Arc::new(AtomicUsize::new(0));
        let (left, reports) = (waiting.clone(), reporter.clone());
        let writer = std::thread::Builder::new()
            .name("frames".into())
            .spawn(move || write_all(&folder, file, &incoming, &left, &reports));
        let writer = writer.map_err(|e| Failure::run("the frames", e))?;
        Ok(FrameLog { frames: Some(frames), writer: Some(writer), waiting, pictures, reporter })
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
        self.reporter.update(|report| report.waiting += 1);
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

/// Writes each picture, and then its line. A picture has its name when it is whole.
fn write_all(
    folder: &Path,
    mut file: File,
    incoming: &Receiver<(FrameLine, Option<Image>)>,
    waiting: &AtomicUsize,
    reporter: &Reporter,
) -> Result<(), Failure> {
    let wrong = |file: &Path, why: &dyn std::fmt::Display| Failure::run(&format!("writing {}", file.display()), why);
    let lines = folder.join(LIST);
    while let Ok((line, image)) = incoming.recv() {
        if let Some(image) = image {
            let [path, unfinished] = picture_paths(folder, line.frame);
            write_picture(&image, &unfinished, reporter)
                .and_then(|()| std::fs::rename(&unfinished, &path).map_err(|e| e.to_string()))
                .map_err(|e| {
                    let _ = std::fs::remove_file(&unfinished); // it may not have been created
                    wrong(&path, &e)
                })?;
        }
        let text = serde_json::to_string(&line).map_err(|e| wrong(&lines, &e))? + "\n";
        file.write_all(text.as_bytes()).map_err(|e| wrong(&lines, &e))?;
        waiting.fetch_sub(1, Ordering::AcqRel);
        reporter.update(|report| (report.written, report.waiting) = (report.written + 1, report.waiting - 1));
    }
    Ok(())
}

/// Writes a picture and reports its progress, because one picture can take seconds.
fn write_picture(image: &Image, path: &Path, reporter: &Reporter) -> Result<(), String> {
    let file = File::create(path).map_err(|e| e.to_string())?;
    let rows = |rows: u32| reporter.update(|report| report.progress += u64::from(rows));
    image.encode_png(BufWriter::new(file), rows).map_err(|e| e.to_string())
}

/// Returns the bytes in hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
