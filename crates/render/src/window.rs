//! A window with a program in it: opening, events, pace, end. What is shown is the program's business ([`WindowApp`]).
//!
//! One window per process: the desktop's library allows one event loop.

use crate::RenderError;
use crate::gpu::Screen;
use std::sync::Arc;
use std::time::Instant;
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::window::{Window, WindowId};

/// How the window opens.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowOptions {
    /// In the title bar.
    pub title: String,
    /// Width and height of the picture in it, pixels.
    pub size_px: [u32; 2],
    /// Place of its upper left corner on the desktop; `None` leaves it to the desktop.
    pub position_px: Option<[i32; 2]>,
    /// Title bar and frame.
    pub decorated: bool,
    /// Whether the user may change its size.
    pub resizable: bool,
}

impl WindowOptions {
    /// An ordinary window.
    pub fn new(title: impl Into<String>, size_px: [u32; 2]) -> WindowOptions {
        WindowOptions { title: title.into(), size_px, position_px: None, decorated: true, resizable: true }
    }
}

/// When the program wants its turn again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// At this moment, whatever happens before.
    At(Instant),
    /// After the next event.
    Event,
    /// Never: close the window.
    End,
}

/// A program in a window.
pub trait WindowApp {
    /// What ends it early.
    type Error: From<RenderError>;

    /// The window is open.
    ///
    /// # Errors
    /// Whatever ends the program.
    fn opened(&mut self, screen: &mut Screen) -> Result<(), Self::Error> {
        let _ = screen;
        Ok(())
    }

    /// Something happened. The screen already has a new size; what closes the window is told too, and then it closes.
    ///
    /// # Errors
    /// Whatever ends the program.
    fn event(&mut self, screen: &mut Screen, event: &WindowEvent) -> Result<(), Self::Error>;

    /// Its turn: time to draw and show. Called at the moments it asked for.
    ///
    /// # Errors
    /// Whatever ends the program.
    fn turn(&mut self, screen: &mut Screen) -> Result<Next, Self::Error>;
}

/// Opens a window and runs the program until it ends or the window is closed.
///
/// # Errors
/// [`RenderError::NoWindow`] where there is no desktop, [`RenderError::BadSize`], [`RenderError::NoAdapter`], [`RenderError::Device`]; and the program's own.
pub fn run_window<A: WindowApp>(options: &WindowOptions, app: &mut A) -> Result<(), A::Error> {
    let refused = |reason: String| RenderError::NoWindow { reason };
    let [width, height] = options.size_px;
    let (max_side, max_pixels) = (crate::MAX_SIDE, crate::MAX_PIXELS);
    let sides = 1..=max_side;
    if !sides.contains(&width) || !sides.contains(&height) || u64::from(width) * u64::from(height) > max_pixels {
        return Err(RenderError::BadSize { width, height, max_side, max_pixels }.into());
    }
    let event_loop = EventLoop::new().map_err(|e| refused(tried(without_place(&e.to_string()))))?;
    let mut host = Host { options, app, screen: None, next: Next::At(Instant::now()), outcome: Ok(()) };
    let ended = event_loop.run_app(&mut host);
    host.outcome?;
    ended.map_err(|e| refused(e.to_string()).into())
}

/// The window library's message without the line of its source at which it was made.
fn without_place(reason: &str) -> String {
    let said = reason.split_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(reason, |(_, said)| said);
    said.trim_end_matches('.').to_string()
}

/// With what was tried, where something was.
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
    /// Ends with an error, if there is one.
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
        let [width, height] = self.options.size_px;
        let mut wanted = Window::default_attributes()
            .with_title(&self.options.title)
            .with_inner_size(PhysicalSize::new(width, height))
            .with_decorations(self.options.decorated)
            .with_resizable(self.options.resizable);
        if let Some([x, y]) = self.options.position_px {
            wanted = wanted.with_position(PhysicalPosition::new(x, y));
        }
        let window = event_loop.create_window(wanted).map_err(|e| RenderError::NoWindow { reason: e.to_string() })?;
        let screen = self.screen.insert(Screen::new(event_loop, Arc::new(window))?);
        self.app.opened(screen)
    }

    fn told(&mut self, event: &WindowEvent) -> Result<(), A::Error> {
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
        let told = self.told(&event);
        self.checked(event_loop, told);
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
        // before the event loop, whose display it lies on
        self.screen = None;
    }
}
