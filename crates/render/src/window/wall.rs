//! Windows that belong together: one event loop, one device, and messages from other threads, such as one
//! for each window.

use super::{WindowOptions, check_size, create, no_desktop};
use crate::RenderError;
use crate::gpu::Wall;
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::WindowId;

/// An application in several windows. Each is named by its index in the options.
pub trait WallApp {
    /// The error that ends it early.
    type Error: From<RenderError>;
    /// Request of another thread.
    type Message: Send + 'static;

    /// Called when all windows are open.
    ///
    /// # Errors
    /// Any error that ends the application.
    fn opened(&mut self, wall: &mut Wall) -> Result<(), Self::Error>;

    /// Called for every event. The window already has its new size. An event that asks for the end of a
    /// window closes none by itself.
    ///
    /// # Errors
    /// Any error that ends the application.
    fn event(&mut self, wall: &mut Wall, window: usize, event: &WindowEvent) -> Result<(), Self::Error>;

    /// Called for every message. Returns whether the windows stay open.
    ///
    /// # Errors
    /// Any error that ends the application.
    fn message(&mut self, wall: &mut Wall, message: Self::Message) -> Result<bool, Self::Error>;
}

/// The way of other threads to the application.
pub struct Mailbox<M: 'static>(EventLoopProxy<M>);

impl<M> Clone for Mailbox<M> {
    fn clone(&self) -> Self {
        Mailbox(self.0.clone())
    }
}

impl<M> Mailbox<M> {
    /// Sends a message, and wakes the application. Returns `false` if it has ended.
    #[must_use]
    pub fn send(&self, message: M) -> bool {
        self.0.send_event(message).is_ok()
    }
}

/// The event loop of several windows; a process has one.
pub struct WallLoop<M: 'static>(EventLoop<M>);

impl<M: Send + 'static> WallLoop<M> {
    /// Connects to the desktop.
    ///
    /// # Errors
    /// [`RenderError::NoWindow`] without a desktop.
    pub fn new() -> Result<Self, RenderError> {
        EventLoop::with_user_event().build().map(WallLoop).map_err(|e| no_desktop(&e))
    }

    /// Returns the way of other threads to the application.
    pub fn mailbox(&self) -> Mailbox<M> {
        Mailbox(self.0.create_proxy())
    }

    /// Opens a window for each of the options, on the adapter that the first one names, and runs the
    /// application until it ends.
    ///
    /// # Errors
    /// [`RenderError::NoWindow`], [`RenderError::BadSize`], [`RenderError::NoAdapter`],
    /// [`RenderError::Device`], and the application's own errors.
    pub fn run<A: WallApp<Message = M>>(self, options: &[WindowOptions], app: &mut A) -> Result<(), A::Error> {
        options.iter().try_for_each(check_size)?;
        let mut host = Host { options, app, wall: None, outcome: Ok(()) };
        let ended = self.0.run_app(&mut host);
        host.outcome?;
        ended.map_err(|e| RenderError::NoWindow { reason: e.to_string() }.into())
    }
}

struct Host<'a, A: WallApp> {
    options: &'a [WindowOptions],
    app: &'a mut A,
    wall: Option<Wall>,
    outcome: Result<(), A::Error>,
}

impl<A: WallApp> Host<'_, A> {
    /// Ends the event loop if there is an error, or nothing is to be shown any more.
    fn checked(&mut self, event_loop: &ActiveEventLoop, result: Result<bool, A::Error>) {
        match result {
            Ok(true) => return,
            Err(error) if self.outcome.is_ok() => self.outcome = Err(error),
            Ok(false) | Err(_) => {}
        }
        event_loop.exit();
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<bool, A::Error> {
        let windows =
            self.options.iter().map(|options| create(event_loop, options)).collect::<Result<Vec<_>, RenderError>>()?;
        let adapter = self.options.first().and_then(|options| options.adapter.as_deref());
        let wall = self.wall.insert(Wall::new(event_loop, &windows, adapter)?);
        self.app.opened(wall).map(|()| true)
    }

    fn dispatch(&mut self, id: WindowId, event: &WindowEvent) -> Result<bool, A::Error> {
        let Some(wall) = &mut self.wall else { return Ok(true) };
        let Some(window) = wall.index(id) else { return Ok(true) };
        match event {
            WindowEvent::Resized(size) => wall.resize(window, [size.width, size.height])?,
            WindowEvent::RedrawRequested => {
                wall.show_again(window)?;
            }
            _ => {}
        }
        self.app.event(wall, window, event).map(|()| true)
    }
}

impl<A: WallApp> ApplicationHandler<A::Message> for Host<'_, A> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.wall.is_none() {
            event_loop.set_control_flow(ControlFlow::Wait);
            let opened = self.open(event_loop);
            self.checked(event_loop, opened);
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, id: WindowId, event: WindowEvent) {
        let outcome = self.dispatch(id, &event);
        self.checked(event_loop, outcome);
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, message: A::Message) {
        let Some(wall) = &mut self.wall else { return };
        let outcome = self.app.message(wall, message);
        self.checked(event_loop, outcome);
    }

    fn exiting(&mut self, _event_loop: &ActiveEventLoop) {
        // the desktop's video modes return
        self.wall.iter().for_each(Wall::leave_full_screen);
        // before the event loop, whose display they use
        self.wall = None;
    }
}
