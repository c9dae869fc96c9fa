//! A video, encoded by the program `ffmpeg`: frames go in through its standard input, and error
//! messages come out of stderr.
//!
//! No call blocks for ever. If a frame is not accepted within [`TIMEOUT`], or ffmpeg does not end
//! within it, the video fails. The child process is killed and reaped in every case.

use crate::failure::Failure;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tumble::render::Image;

/// Longest time that ffmpeg may take for one frame, or to end.
const TIMEOUT: Duration = Duration::from_secs(60);
/// Time between two polls of the child process.
const POLL_INTERVAL: Duration = Duration::from_millis(2);
/// Bytes of ffmpeg's messages that are kept, the last ones.
const MAX_MESSAGE_BYTES: usize = 4096;

/// A video in progress.
pub struct Video {
    child: Child,
    frames: Option<SyncSender<Vec<u8>>>,
    writer: Option<JoinHandle<()>>,
    messages: Option<JoinHandle<String>>,
    size: [u32; 2],
}

impl Video {
    /// Checks that `ffmpeg` can be started.
    pub fn probe() -> Result<(), Failure> {
        let started = Command::new("ffmpeg")
            .arg("-version")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        match started {
            Ok(mut child) => wait(&mut child, TIMEOUT).map(|_| ()),
            Err(e) => Err(missing(&e)),
        }
    }

    /// Starts a video of this size in pixels, with `per_second` frames per second.
    pub fn start(path: &Path, size: [u32; 2], per_second: f64) -> Result<Video, Failure> {
        let mut command = Command::new("ffmpeg");
        command.args(["-hide_banner", "-nostdin", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba"]);
        command.args(["-s", &format!("{}x{}", size[0], size[1]), "-r", &per_second.to_string(), "-i", "pipe:0"]);
        // even sides, and the pixel format that players support
        command
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-movflags", "+faststart"])
            .arg("--")
            .arg(path);
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| missing(&e))?;
        let (send, receive) = sync_channel(2);
        let (input, stderr) = (child.stdin.take(), child.stderr.take());
        let writer = input.map(|input| std::thread::spawn(move || feed(input, &receive)));
        let messages = stderr.map(|from| std::thread::spawn(move || collect_messages(from)));
        Ok(Video { child, frames: Some(send), writer, messages, size })
    }

    /// Adds a frame.
    pub fn add(&mut self, image: &Image) -> Result<(), Failure> {
        if [image.width, image.height] != self.size {
            return Err(Failure::run(
                "the video",
                format!(
                    "a frame of {} x {} pixels in a video of {} x {}",
                    image.width, image.height, self.size[0], self.size[1]
                ),
            ));
        }
        let (mut frame, begin) = (image.rgba.clone(), Instant::now());
        loop {
            let Some(frames) = &self.frames else { return Err(self.failed("the video has ended")) };
            match frames.try_send(frame) {
                Ok(()) => return Ok(()),
                Err(TrySendError::Disconnected(_)) => return Err(self.failed("ffmpeg ended early")),
                Err(TrySendError::Full(_)) if begin.elapsed() > TIMEOUT => {
                    return Err(self.failed("ffmpeg accepts no more frames"));
                }
                Err(TrySendError::Full(back)) => frame = back,
            }
            std::thread::sleep(POLL_INTERVAL);
        }
    }

    /// Waits until the last frames are written.
    pub fn finish(mut self) -> Result<(), Failure> {
        drop(self.frames.take());
        match wait(&mut self.child, TIMEOUT) {
            Ok(true) => Ok(()),
            Ok(false) => Err(self.failed("ffmpeg failed")),
            Err(_) => Err(self.failed("ffmpeg does not end")),
        }
    }

    /// Ends the child process and returns a failure with its messages.
    fn failed(&mut self, what: &str) -> Failure {
        self.end();
        let messages = self.messages.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        let messages = messages.trim();
        Failure::run(
            "the video",
            if messages.is_empty() { format!("{what}, without a message") } else { format!("{what}: {messages}") },
        )
    }

    fn end(&mut self) {
        drop(self.frames.take());
        let _ = self.child.kill(); // it may have ended by itself
        let _ = self.child.wait();
        if let Some(writer) = self.writer.take() {
            let _ = writer.join(); // its pipe is closed
        }
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        self.end();
    }
}

fn feed(mut input: std::process::ChildStdin, frames: &Receiver<Vec<u8>>) {
    // a write to a child process that has ended fails; the next `add` then reports it
    while let Ok(frame) = frames.recv() {
        if input.write_all(&frame).is_err() {
            return;
        }
    }
}

/// Returns the last messages of the child process.
fn collect_messages(mut from: std::process::ChildStderr) -> String {
    let (mut messages, mut piece) = (Vec::new(), [0; 1024]);
    while let Ok(count @ 1..) = from.read(&mut piece) {
        messages.extend_from_slice(&piece[..count]);
        let extra = messages.len().saturating_sub(MAX_MESSAGE_BYTES);
        messages.drain(..extra);
    }
    String::from_utf8_lossy(&messages).into_owned()
}

/// Waits for the end of the child process and returns whether it succeeded; kills it at the
/// timeout.
fn wait(child: &mut Child, timeout: Duration) -> Result<bool, Failure> {
    let begin = Instant::now();
    loop {
        match child.try_wait() {
            Ok(Some(status)) => return Ok(status.success()),
            Ok(None) if begin.elapsed() < timeout => std::thread::sleep(POLL_INTERVAL),
            Ok(None) => {
                let _ = child.kill(); // it may have ended just now
                let _ = child.wait();
                return Err(Failure::run("the video", "ffmpeg does not answer"));
            }
            Err(e) => return Err(Failure::run("the video", e)),
        }
    }
}

fn missing(error: &std::io::Error) -> Failure {
    match error.kind() {
        ErrorKind::NotFound => Failure::run(
            "the video",
            "there is no ffmpeg; on Debian and Ubuntu: apt-get install ffmpeg; or write pictures with --frames-dir",
        ),
        _ => Failure::run("the video", format!("ffmpeg cannot be started: {error}")),
    }
}
