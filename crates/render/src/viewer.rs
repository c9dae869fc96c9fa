//! A window on a world of a program.

use crate::draw::{DebugDraw, Drawing};
use crate::list::{DrawList, Quality};
use crate::orbit::Orbit;
use crate::window::{Next, WindowApp, WindowOptions, run_window};
use crate::{Camera, RenderError, Screen};
use std::time::{Duration, Instant};
use tumble_core::{StepError, World};
use tumble_scene::{SceneError, SceneFile};
use winit::event::{ElementState, WindowEvent};
use winit::keyboard::{Key, NamedKey};

/// Time between two pictures.
const INTERVAL: Duration = Duration::from_millis(16);
/// Longest time that the steps catch up with at once, s.
const LAG_S: f64 = 0.1;

/// Why a window on a world was closed early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The window or its pictures failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A step of the world failed.
    #[error(transparent)]
    Step(#[from] StepError),
    /// A scene without a text is refused; a fault of tumble.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Pictures of a world in a window, with a camera that the mouse moves: drag with the left button to turn, with another one to
/// move, use the wheel for the distance; Home returns, C shows contacts, Q or Escape closes.
///
/// An application gives it events and the world: see [`view`].
pub struct Viewer {
    title: String,
    drawing: Drawing,
    overlays: DebugDraw,
    list: Option<DrawList>,
    /// The camera of the first list.
    home: Option<Camera>,
    orbit: Orbit,
    quality: Quality,
    /// Whether the list lacks what a key has changed.
    outdated: bool,
    /// Whether the picture is not that of the list and the camera.
    stale: bool,
    closed: bool,
}

impl Viewer {
    /// Makes a viewer with the camera, lights, sky and floor of a scene. The window has the title and the simulated time.
    pub fn new(title: impl Into<String>, scene: &SceneFile) -> Viewer {
        Viewer {
            title: title.into(),
            drawing: Drawing::new(scene),
            overlays: DebugDraw::default(),
            list: None,
            home: None,
            orbit: Orbit::default(),
            quality: Quality::default(),
            outdated: false,
            stale: false,
            closed: false,
        }
    }

    /// Prepares the pictures for the graphics adapter of an open window.
    pub fn open(&mut self, screen: &Screen) {
        self.quality = if screen.is_software() { Quality::fast() } else { Quality::default() };
    }

    /// Handles an event of the window.
    pub fn handle(&mut self, screen: &Screen, event: &WindowEvent) {
        match event {
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                self.key(&event.logical_key)
            }
            event => self.stale |= self.orbit.handle(event, screen.size_px()),
        }
    }

    fn key(&mut self, key: &Key) {
        match key {
            Key::Named(NamedKey::Home) => self.orbit = Orbit::default(),
            Key::Named(NamedKey::Escape) => self.closed = true,
            Key::Character(c) if c == "q" => self.closed = true,
            Key::Character(c) if c == "c" => self.overlays.contacts = !self.overlays.contacts,
            _ => return,
        }
        self.outdated = true;
    }

    /// Returns whether the user has closed the window with a key.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Returns whether the next picture needs the world, although it has not changed.
    pub fn is_outdated(&self) -> bool {
        self.outdated
    }

    /// Takes over the present state of the world.
    ///
    /// # Errors
    /// [`RenderError`]: the world cannot be drawn.
    pub fn update(&mut self, screen: &Screen, world: &World) -> Result<(), RenderError> {
        let mut list = self.drawing.list(world, &self.overlays)?;
        screen.window().set_title(&format!("{}  {:.2} s", self.title, world.time()));
        self.quality.apply(&mut list.settings);
        self.list = Some(list);
        (self.outdated, self.stale) = (false, true);
        Ok(())
    }

    /// Draws and shows the state that was taken over last, if the picture is another one.
    ///
    /// # Errors
    /// [`RenderError`]: the graphics device failed.
    pub fn show(&mut self, screen: &mut Screen) -> Result<(), RenderError> {
        let Some(list) = self.list.as_ref().filter(|_| self.stale) else { return Ok(()) };
        let camera = self.orbit.camera(self.home.get_or_insert(list.camera));
        let [width, height] = screen.size_px();
        screen.renderer().draw(&camera, list, width, height)?;
        screen.show()?;
        self.stale = false;
        Ok(())
    }
}

/// Shows a world in a window and steps it in real time until the window is closed. [`Viewer`] has the keys. A world that is too
/// slow runs in slow motion.
///
/// A process has at most one window, which needs its main thread. [`view_with`] lets a program act before each step.
///
/// ```no_run
/// use tumble_core::prelude::*;
/// use tumble_render::{WindowOptions, view};
/// let mut world = World::default();
/// world.add_static(RigidBody::fixed(Shape::half_space()))?;
/// world.add(RigidBody::new(Shape::sphere(0.1)?).with_mass(1.0).with_pose(Pose::translation(0.0, 0.0, 2.0)))?;
/// view(&mut world, &WindowOptions::new("a fall", [1280, 720]))?;
/// println!("closed after {} s", world.time());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ViewError`]: there is no desktop or graphics adapter, or a step failed.
pub fn view(world: &mut World, options: &WindowOptions) -> Result<(), ViewError> {
    view_with(world, options, |world| Ok(world.step().map(drop)?))
}

/// As [`view`], with a function that takes each step, so it can set forces and drives before.
///
/// # Errors
/// [`ViewError`], and the errors of `step`.
pub fn view_with<E: From<ViewError>>(
    world: &mut World,
    options: &WindowOptions,
    step: impl FnMut(&mut World) -> Result<(), E>,
) -> Result<(), E> {
    let scene = SceneFile::parse("", &options.title).map_err(ViewError::from)?;
    let viewer = Viewer::new(options.title.as_str(), &scene);
    run_window(options, &mut Live { world, step, viewer, pace: Pace::default(), failed: std::marker::PhantomData })
        .map_err(|Ended(error)| error)
}

/// The error that ends a window.
struct Ended<E>(E);

impl<E: From<ViewError>> From<RenderError> for Ended<E> {
    fn from(error: RenderError) -> Self {
        Ended(ViewError::from(error).into())
    }
}

/// A world that is stepped by the clock.
struct Live<'w, E, F> {
    world: &'w mut World,
    step: F,
    viewer: Viewer,
    pace: Pace,
    failed: std::marker::PhantomData<E>,
}

impl<E: From<ViewError>, F: FnMut(&mut World) -> Result<(), E>> WindowApp for Live<'_, E, F> {
    type Error = Ended<E>;

    fn opened(&mut self, screen: &mut Screen) -> Result<(), Ended<E>> {
        self.viewer.open(screen);
        Ok(self.viewer.update(screen, self.world)?)
    }

    fn event(&mut self, screen: &mut Screen, event: &WindowEvent) -> Result<(), Ended<E>> {
        self.viewer.handle(screen, event);
        Ok(())
    }

    fn turn(&mut self, screen: &mut Screen) -> Result<Next, Ended<E>> {
        if self.viewer.is_closed() {
            return Ok(Next::End);
        }
        let begin = Instant::now();
        let steps = self.pace.steps(begin, self.world.settings().dt);
        for _ in 0..steps {
            (self.step)(self.world).map_err(Ended)?;
        }
        if steps > 0 || self.viewer.is_outdated() {
            self.viewer.update(screen, self.world)?;
        }
        self.viewer.show(screen)?;
        Ok(Next::At(begin + INTERVAL))
    }
}

/// Turns the clock into whole steps.
#[derive(Default)]
struct Pace {
    last: Option<Instant>,
    /// Time that is not stepped yet, s.
    due: f64,
}

impl Pace {
    /// Returns the number of steps of `dt` seconds that are due.
    fn steps(&mut self, now: Instant, dt: f64) -> usize {
        let passed = self.last.replace(now).map_or(0.0, |last| now.saturating_duration_since(last).as_secs_f64());
        self.due = (self.due + passed).min(LAG_S.max(dt));
        let steps = (self.due / dt).floor();
        self.due -= steps * dt;
        steps as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_follow_the_clock_and_skip_long_interruptions() {
        let (start, mut pace) = (Instant::now(), Pace::default());
        let at = |ms: u64| start + Duration::from_millis(ms);
        assert_eq!(pace.steps(at(0), 0.01), 0);
        // 16 ms a picture: what does not fit is due in the next one
        let taken: usize = (1..=50).map(|k| pace.steps(at(16 * k), 0.01)).sum();
        assert!((79..=80).contains(&taken), "{taken} steps of 10 ms in 800 ms");
        // after ten seconds 0.1 s counts
        assert!((9..=10).contains(&pace.steps(at(10_800), 0.01)));
        // steps longer than the lag are taken too
        let mut slow = Pace::default();
        slow.steps(at(0), 0.25);
        let taken: usize = (1..=100).map(|k| slow.steps(at(16 * k), 0.25)).sum();
        assert_eq!(taken, 6, "1.6 s");
    }
}
