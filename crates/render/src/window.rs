//! A window that runs an application: opening, events, timing, end. The application decides what
//! the window shows ([`WindowApp`]).
//!
//! A process has one such window, or several with one device ([`WallLoop`]), because the window library
//! allows one event loop.

mod monitor;
mod wall;

use crate::RenderError;
use crate::gpu::Screen;
use std::sync::Arc;
use std::time::Instant;
pub use wall::{Mailbox, WallApp, WallLoop};
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::monitor::MonitorHandle;
use winit::window::{Fullscreen, Window, WindowId};

/// Options of a new window.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowOptions {
    /// Text of the title bar.
    pub title: String,
    /// Width and height of its content, pixels.
    pub size_px: [u32; 2],
    /// Position of its upper left corner on the desktop; `None` leaves it to the desktop.
    pub position_px: Option<[i32; 2]>,
    /// Whether it has a title bar and a frame.
    pub decorated: bool,
    /// Whether the user may change its size.
    pub resizable: bool,
    /// Name of the monitor from whose upper left corner the position counts; `None` for the desktop.
    pub monitor: Option<String>,
    /// Whether it covers the monitor, which must have the size of its content, or with `refresh_hz` a video
    /// mode of this size.
    pub full_screen: bool,
    /// Refresh rate of the monitor within 0.5 Hz, Hz. A full screen sets it, with its size, by the video mode;
    /// for other windows the monitor must have it.
    pub refresh_hz: Option<f64>,
    /// Text that the name of the graphics adapter must contain, in any case.
    pub adapter: Option<String>,
    /// Whether it is shown when it opens; `winit::window::Window::set_visible` shows it later.
    pub visible: bool,
}

impl WindowOptions {
    /// A decorated, resizable window at a place that the desktop chooses.
    pub fn new(title: impl Into<String>, size_px: [u32; 2]) -> WindowOptions {
        WindowOptions {
            title: title.into(),
            size_px,
            position_px: None,
            decorated: true,
            resizable: true,
            monitor: None,
            full_screen: false,
            refresh_hz: None,
            adapter: None,
            visible: true,
        }
    }
}

/// When the application is called next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// At this time, even without an event.
    At(Instant),
    /// After the next event.
    Event,
    /// Never: closes the window.
    End,
}

/// An application in a window.
pub trait WindowApp {
    /// The error that ends it early.
    type Error: From<RenderError>;

    /// Called when the window is open.
    ///
    /// # Errors
    /// Any error that ends the application.
    fn opened(&mut self, screen: &mut Screen) -> Result<(), Self::Error> {
        let _ = screen;
        Ok(())
    }

    /// Called for every event. The screen already has its new size; the event that closes the
    /// window comes before it closes.
    ///
    /// # Errors
    /// Any error that ends the application.
    fn event(&mut self, screen: &mut Screen, event: &WindowEvent) -> Result<(), Self::Error>;

    /// Called at the requested times, to draw and show.
    ///
    /// # Errors
    /// Any error that ends the application.
    fn turn(&mut self, screen: &mut Screen) -> Result<Next, Self::Error>;
}

/// Opens a window and runs the application until it ends or the window is closed.
///
/// # Errors
/// [`RenderError::NoWindow`] without a desktop, [`RenderError::BadSize`],
/// [`RenderError::NoAdapter`], [`RenderError::Device`], and the application's own errors.
pub fn run_window<A: WindowApp>(options: &WindowOptions, app: &mut A) -> Result<(), A::Error> {
    check_size(options)?;
    let event_loop = EventLoop::new().map_err(|e| no_desktop(&e))?;
    let mut host = Host { options, app, screen: None, next: Next::At(Instant::now()), outcome: Ok(()) };
    let ended = event_loop.run_app(&mut host);
    host.outcome?;
    ended.map_err(|e| RenderError::NoWindow { reason: e.to_string() }.into())
}

/// Returns the error of an event loop that cannot begin.
fn no_desktop(error: &winit::error::EventLoopError) -> RenderError {
    RenderError::NoWindow { reason: tried(without_place(&error.to_string())) }
}

/// Checks the size of a window's content.
fn check_size(options: &WindowOptions) -> Result<(), RenderError> {
    let [width, height] = options.size_px;
    let (max_side, max_pixels) = (crate::MAX_SIDE, crate::MAX_PIXELS);
    let sides = 1..=max_side;
    if !sides.contains(&width) || !sides.contains(&height) || u64::from(width) * u64::from(height) > max_pixels {
        return Err(RenderError::BadSize { width, height, max_side, max_pixels });
    }
    Ok(())
}

/// Opens a window as its options say.
fn create(event_loop: &ActiveEventLoop, options: &WindowOptions) -> Result<Arc<Window>, RenderError> {
    let [width, height] = options.size_px;
    let mut wanted = Window::default_attributes()
        .with_title(&options.title)
        .with_inner_size(PhysicalSize::new(width, height))
        .with_decorations(options.decorated)
        .with_resizable(options.resizable)
        .with_visible(options.visible);
    let monitor = monitor::find(event_loop, options)?;
    let corner = monitor.as_ref().map_or(PhysicalPosition::default(), MonitorHandle::position);
    let position = if options.full_screen { Some([0, 0]) } else { options.position_px };
    if let Some([x, y]) = position {
        wanted = wanted.with_position(PhysicalPosition::new(corner.x + x, corner.y + y));
    }
    if options.full_screen {
        // a desktop without a window manager takes position and size alone
        let covered = match monitor::video_mode(monitor.as_ref(), options)? {
            Some(mode) => Fullscreen::Exclusive(mode),
            None => Fullscreen::Borderless(monitor),
        };
        wanted = wanted.with_decorations(false).with_fullscreen(Some(covered));
    }
    let window = event_loop.create_window(wanted).map_err(|e| RenderError::NoWindow { reason: e.to_string() })?;
    Ok(Arc::new(window))
}

/// Removes the source line of the window library from its message.
fn without_place(reason: &str) -> String {
    let said = reason.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(reason, |(_, said)| said);
    said.trim_end_matches('.').to_string()
}

/// Adds the displays that were tried.
fn tried(reason: String) -> String {
    let set = |name: &str| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(|value| format!("{name}={}", value.to_string_lossy()))
    };
    let tried: Vec<String> = ["WAYLAND_DISPLAY", "WAYLAND_SOCKET", "DISPLAY"].into_iter().filter_map(set).collect();
    if tried.is_empty() { reason } else { format!("{}: {reason}", tried.join(", ")) }
}

struct Host<'a, A: WindowApp> {
    options: &'a WindowOptions,
    app: &'a mut A,
    screen: Option<Screen>,
    next: Next,
    outcome: Result<(), A::Error>,
}

impl<A: WindowApp> Host<'_, A> {
    /// Ends the event loop if there is an error.
    fn checked(&mut self, event_loop: &ActiveEventLoop, result: Result<(), A::Error>) {
        if let Err(error) = result {
            if self.outcome.is_ok() {
                self.outcome = Err(error);
            }
            self.next = Next::End;
            event_loop.exit();
        }
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<(), A::Error> {
        let window = create(event_loop, self.options)?;
        let adapter = self.options.adapter.as_deref();
        let screen = self.screen.insert(Screen::new(event_loop, window, adapter)?);
        self.app.opened(screen)
    }

    fn dispatch(&mut self, event: &WindowEvent) -> Result<(), A::Error> {
        let Some(screen) = &mut self.screen else { return Ok(()) };
        match event {
            WindowEvent::Resized(size) => screen.resize([size.width, size.height])?,
            WindowEvent::RedrawRequested => {
                screen.show()?;
            }
            _ => {}
        }
        self.app.event(screen, event)
    }

    fn turn(&mut self) -> Result<(), A::Error> {
        let Some(screen) = &mut self.screen else { return Ok(()) };
        self.next = self.app.turn(screen)?;
        Ok(())
    }
}

impl<A: WindowApp> ApplicationHandler for Host<'_, A> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.screen.is_none() {
            let opened = self.open(event_loop);
            self.checked(event_loop, opened);
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _id: WindowId, event: WindowEvent) {
        let outcome = self.dispatch(&event);
        self.checked(event_loop, outcome);
        if self.next == Next::Event {
            self.next = Next::At(Instant::now());
        }
        if matches!(event, WindowEvent::CloseRequested | WindowEvent::Destroyed) {
            self.next = Next::End;
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        if let Next::At(moment) = self.next
            && Instant::now() >= moment
        {
            let turned = self.turn();
            self.checked(event_loop, turned);
        }
        match self.next {
            Next::At(moment) => event_loop.set_control_flow(ControlFlow::WaitUntil(moment)),
            Next::Event => event_loop.set_control_flow(ControlFlow::Wait),
            Next::End => event_loop.exit(),
        }
    }

    fn exiting(&mut self, _event_loop: &ActiveEventLoop) {
        // the desktop's video mode returns
        self.screen.iter().for_each(Screen::leave_full_screen);
        // before the event loop, whose display it uses
        self.screen = None;
    }
}
