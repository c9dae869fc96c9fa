//! A window on a world of a program: the program publishes frames, and a process of its own draws
//! them, because a window needs the main thread of its process.
//!
//! | message | bytes |
//! |---|---|
//! | kind: 0 opening, 1 object table, 2 frame | 1 |
//! | number of the frame, simulated time (s), length of the rest, little-endian | 8, 8, 4 |
//! | title, size and views in postcard; a NetSync snapshot; a NetSync state | any |
//!
//! The process of the window writes one line when the window is open, and the reason where it cannot be to stderr.

use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::world::class::World;
use crate::world::pickling::SceneRecord;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::{Deserialize, Serialize};
use std::io::{ErrorKind, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tumble::dynamics::World as Core;
use tumble::dynamics::archive::{open, seal};
use tumble::net::sync::{MAX_CONTACTS, Mirror, Publisher, Viewer};
use tumble::render::winit::event::WindowEvent;
use tumble::render::{Next, Screen, Viewer as Pictures, WindowApp, WindowOptions, run_window};

const HEAD: &[u8; 8] = b"tumbleW1";
const HEADER_BYTES: usize = 21;
/// Largest message.
const MAX_BYTES: usize = 1 << 30;
/// Time between two pictures.
const INTERVAL: Duration = Duration::from_millis(16);

/// The first message.
#[derive(Serialize, Deserialize)]
struct Opening {
    title: String,
    size: [u32; 2],
    scene: SceneRecord,
}

fn message(kind: u8, frame: u64, time: f64, body: &[u8]) -> Result<Vec<u8>> {
    let length = u32::try_from(body.len()).ok().filter(|n| *n as usize <= MAX_BYTES);
    let length = length.ok_or_else(|| Error::value("the world is too large for a window"))?;
    Ok([&[kind][..], &frame.to_le_bytes(), &time.to_le_bytes(), &length.to_le_bytes(), body].concat())
}

/// Makes the messages of a window.
#[pyclass(frozen, module = "tumble._native")]
pub struct _WindowFeed {
    publisher: Mutex<(Publisher, Vec<u8>, u64)>,
}

#[pymethods]
impl _WindowFeed {
    #[new]
    fn new() -> Result<_WindowFeed> {
        let publisher = Publisher::new(&Core::default(), false, 0).with_contacts(MAX_CONTACTS);
        Ok(_WindowFeed { publisher: Mutex::new((publisher, Vec::new(), 0)) })
    }

    /// Returns the first message.
    #[pyo3(signature = (world, title, size, **unknown), text_signature = "($self, world, title, size)")]
    fn opening<'py>(
        &self,
        py: Python<'py>,
        world: &Bound<'_, World>,
        title: String,
        #[pyo3(from_py_with = whole::size)] size: [u32; 2],
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyBytes>> {
        keywords::check(unknown, "_WindowFeed.opening")?;
        let scene = world.get().shared.read(|inner| Ok(SceneRecord::of(&inner.scene)))?;
        Ok(PyBytes::new(py, &message(0, 0, 0.0, &seal(HEAD, &Opening { title, size, scene })?)?))
    }

    /// Returns the messages of the present state; empty if nothing changed.
    #[pyo3(signature = (world, **unknown), text_signature = "($self, world)")]
    fn frame<'py>(
        &self,
        py: Python<'py>,
        world: &Bound<'_, World>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyBytes>> {
        keywords::check(unknown, "_WindowFeed.frame")?;
        let mut kept = self.publisher.lock().unwrap_or_else(PoisonError::into_inner);
        let (publisher, last, count) = &mut *kept;
        let bytes = world.get().shared.read(|inner| {
            let frame = publisher
                .publish(&inner.world, &Viewer::default(), *count + 1)
                .map_err(|e| Error::value(e.to_string()))?;
            if !frame.fresh && frame.state == *last {
                return Ok(Vec::new());
            }
            *count += 1;
            let time = inner.world.time();
            let table = match frame.fresh {
                true => message(1, *count, time, &publisher.snapshot())?,
                false => Vec::new(),
            };
            let state = message(2, *count, time, &frame.state)?;
            *last = frame.state;
            Ok([table, state].concat())
        })?;
        Ok(PyBytes::new(py, &bytes))
    }
}

/// Shows the messages of stdin in a window until it is closed or they end.
#[pyfunction]
pub fn _show_window(py: Python<'_>) -> Result<()> {
    py.detach(|| {
        let mut input = std::io::stdin().lock();
        let Some((0, _, _, opening)) = read(&mut input)? else {
            return Err(Error::value("the messages of a window do not begin with its opening"));
        };
        let opening: Opening = open(HEAD, &opening).map_err(Error::Archive)?;
        drop(input);
        let shown = Arc::new(Shown::default());
        let feed = shown.clone();
        std::thread::spawn(move || feed.follow());
        let mut app = App::new(&opening.title, opening.scene.scene()?, shown);
        run_window(&WindowOptions::new(opening.title, opening.size), &mut app)
    })
}

/// Kind, frame, time and payload of a message.
type Message = (u8, u64, f64, Vec<u8>);

/// Reads a message; `None` at the end.
fn read(input: &mut impl Read) -> Result<Option<Message>> {
    let failed = |source| Error::File { file: "the messages of a window".into(), source };
    let mut head = [0; HEADER_BYTES];
    match input.read_exact(&mut head) {
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Ok(None),
        outcome => outcome.map_err(failed)?,
    }
    let eight = |at: usize| head[at..at + 8].try_into().unwrap_or_default();
    let length = u32::from_le_bytes(head[17..21].try_into().unwrap_or_default()) as usize;
    if length > MAX_BYTES {
        return Err(Error::value(format!("a message of {length} bytes")));
    }
    let mut body = Vec::new();
    input.take(length as u64).read_to_end(&mut body).map_err(failed)?;
    if body.len() < length {
        return Ok(None);
    }
    Ok(Some((head[0], u64::from_le_bytes(eight(1)), f64::from_le_bytes(eight(9)), body)))
}

/// The world of the window, which a thread keeps up to date.
struct Shown {
    mirror: Mutex<Mirror>,
    /// Whether the mirror has changed since it was drawn.
    fresh: AtomicBool,
    ended: AtomicBool,
}

impl Default for Shown {
    fn default() -> Shown {
        let mirror = Mutex::new(Mirror::new(Core::default()));
        Shown { mirror, fresh: AtomicBool::new(false), ended: AtomicBool::new(false) }
    }
}

impl Shown {
    fn mirror(&self) -> MutexGuard<'_, Mirror> {
        self.mirror.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Applies messages until they end.
    fn follow(&self) {
        let mut input = std::io::stdin().lock();
        loop {
            let applied = match read(&mut input) {
                Ok(Some((1, _, _, table))) => self.mirror().apply_snapshot(&table),
                Ok(Some((2, frame, time, state))) => self.mirror().apply_state(frame, time, &state),
                Ok(_) => break,
                Err(error) => {
                    eprintln!("window: {error}");
                    break;
                }
            };
            if let Err(error) = applied {
                eprintln!("window: {error}");
                break;
            }
            self.fresh.store(true, Ordering::Release);
        }
        self.ended.store(true, Ordering::Release);
    }
}

struct App {
    shown: Arc<Shown>,
    pictures: Pictures,
}

impl App {
    fn new(name: &str, scene: tumble::scene::SceneFile, shown: Arc<Shown>) -> App {
        App { shown, pictures: Pictures::new(name, &scene) }
    }
}

impl WindowApp for App {
    type Error = Error;

    fn opened(&mut self, screen: &mut Screen) -> Result<()> {
        self.pictures.open(screen);
        // the program waits for this line; without it the window is still open
        let _ = writeln!(std::io::stdout(), "open");
        Ok(())
    }

    fn event(&mut self, screen: &mut Screen, event: &WindowEvent) -> Result<()> {
        self.pictures.handle(screen, event);
        Ok(())
    }

    fn turn(&mut self, screen: &mut Screen) -> Result<Next> {
        if self.pictures.is_closed() || self.shown.ended.load(Ordering::Acquire) {
            return Ok(Next::End);
        }
        let begin = Instant::now();
        if self.shown.fresh.swap(false, Ordering::AcqRel) || self.pictures.is_outdated() {
            self.pictures.update(screen, self.shown.mirror().world())?;
        }
        self.pictures.show(screen)?;
        Ok(Next::At(begin + INTERVAL))
    }
}
