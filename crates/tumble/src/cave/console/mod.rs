//! The operator's console: a link of the launcher by which a person or a script watches and directs a
//! run (`--console`). `tumble console` and the served page speak HTTP/1.1 over it
//! ([`tumble::net::control`]).
//!
//! ```text
//! connection ─► thread with a time-out ─┬─ status, log, pictures: read from memory
//!                                       └─ actions: queue of 16 ─► the run, between two frames ─► answer
//! ```
//!
//! A client that sends garbage, sends slowly or asks for too much costs a thread for 3 s and at most 4
//! KiB; it never delays a frame.

mod client;
mod http;
mod status;

pub use client::console;
pub use status::{ConsoleStatus, FacetStatus};

use crate::cave::listener::Listener;
use crate::failure::Failure;
use std::collections::{BTreeMap, VecDeque};
use std::io::Read;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tumble::net::control::{Action, MIN_TOKEN_BYTES};

/// Default port.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:47300";
/// Maximum number of actions that wait for the run.
const MAX_WAITING: usize = 16;
/// Number of lines of the log that are kept.
const MAX_LINES: usize = 500;
/// Maximum length of a line, bytes.
const MAX_LINE_BYTES: usize = 1024;
/// Maximum length of a token file, bytes.
const MAX_TOKEN_BYTES: u64 = 1024;

/// Content that clients read without the run.
#[derive(Default)]
struct Shown {
    /// JSON.
    status: String,
    lines: VecDeque<String>,
    /// PNG files by facet.
    pictures: BTreeMap<String, Vec<u8>>,
}

/// An action that waits for the run, and where its answer goes.
pub struct Asked {
    pub action: Action,
    answer: SyncSender<Result<String, String>>,
}

impl Asked {
    /// Answers: what was done, or why not.
    pub fn answer(self, done: Result<String, String>) {
        let _ = self.answer.try_send(done); // the client may have gone
    }
}

/// The run's side of a console.
pub struct Console {
    listener: Listener,
    shown: Arc<Mutex<Shown>>,
    asked: Receiver<Asked>,
}

impl Console {
    /// Listens at this address. Clients need the token.
    ///
    /// # Errors
    /// The address cannot be used.
    pub fn open(at: SocketAddr, token: String) -> Result<Console, Failure> {
        let shown = Arc::new(Mutex::new(Shown { status: "{}".into(), ..Shown::default() }));
        let (ask, asked) = sync_channel(MAX_WAITING);
        let listener =
            http::start(at, token, shown.clone(), ask).map_err(|e| Failure::run(&format!("--console {at}"), e))?;
        Ok(Console { listener, shown, asked })
    }

    /// Returns the address.
    pub fn address(&self) -> SocketAddr {
        self.listener.address()
    }

    /// Returns the next action that waits.
    pub fn next(&self) -> Option<Asked> {
        self.asked.try_recv().ok()
    }

    /// Shows the state of the run.
    pub fn set_status(&self, status: &ConsoleStatus) {
        lock(&self.shown).status = serde_json::to_string(status).unwrap_or_else(|_| "{}".into());
    }

    /// Adds a line to the log.
    pub fn log(&self, line: &str) {
        let mut shown = lock(&self.shown);
        if shown.lines.len() == MAX_LINES {
            shown.lines.pop_front();
        }
        let end = (0..=line.len().min(MAX_LINE_BYTES)).rev().find(|&n| line.is_char_boundary(n)).unwrap_or(0);
        shown.lines.push_back(line[..end].to_owned());
    }

    /// Shows a facet's last picture.
    pub fn set_picture(&self, facet: &str, png: Vec<u8>) {
        lock(&self.shown).pictures.insert(facet.to_owned(), png);
    }
}

/// Reads a token from a file; surrounding white space does not count.
///
/// # Errors
/// The file cannot be read, or the token is shorter than 16 bytes.
pub fn read_token(file: &Path) -> Result<String, Failure> {
    let wrong = |why: String| Failure::input(format!("{}: {why}", file.display()));
    let mut text = String::new();
    if std::fs::metadata(file).is_ok_and(|about| !about.is_file()) {
        return Err(wrong("is no regular file".into()));
    }
    std::fs::File::open(file)
        .and_then(|file| file.take(MAX_TOKEN_BYTES).read_to_string(&mut text))
        .map_err(|e| wrong(e.to_string()))?;
    let token = text.trim();
    if token.len() < MIN_TOKEN_BYTES || !token.bytes().all(|b| b.is_ascii_graphic()) {
        return Err(wrong(format!("expected at least {MIN_TOKEN_BYTES} printable characters without spaces")));
    }
    Ok(token.to_owned())
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
