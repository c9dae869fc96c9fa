//! Images of a world, rendered without a window by one graphics device that all worlds of the
//! process share.

use crate::arrays::convert::{number, vec3};
use crate::errors::{Error, Result, caught};
use crate::world::shared::Shared;
use nalgebra::{Point3, Vector3};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};
use tumble::collide::Vec3;
use tumble::dynamics::World;
use tumble::render::{Camera, CaveView, DebugDraw, DrawList, Drawing, Image, RenderError, Renderer};
use tumble::scene::cave::resolve_cave;
use tumble::scene::{SceneFile, SceneFile as Scene};

/// Default size of an image, pixels.
const USUAL: [u32; 2] = [640, 480];
/// Side of the shadow maps of a cave, which cover everything that its screens show.
const CAVE_SHADOWS: u32 = 4096;

/// Made for the first image, which takes longer than drawing one.
static RENDERER: Mutex<Option<Renderer>> = Mutex::new(None);
/// The process that made it, or tried to; 0 for none.
static MADE_BY: AtomicU32 = AtomicU32::new(0);

/// A requested image.
pub struct Shot {
    size: [Option<u32>; 2],
    from: From,
    overlays: DebugDraw,
}

enum From {
    Scene,
    Camera(Camera),
    /// A facet of a cave.
    Facet(String, String),
    /// A cave, unfolded.
    Cave(String),
}

impl Shot {
    /// Checks the arguments before anything is drawn.
    pub fn new(
        size: [Option<u32>; 2],
        camera: Option<&Bound<'_, PyAny>>,
        facet: Option<&str>,
        cave: Option<&str>,
        overlays: Option<&str>,
    ) -> Result<Shot> {
        let overlays = overlays
            .map_or(Ok(DebugDraw::default()), str::parse)
            .map_err(|e: tumble::render::UnknownOverlay| Error::value(e.to_string()))?;
        let from = match (camera, facet, cave) {
            (None, None, None) => From::Scene,
            (Some(camera), None, None) => From::Camera(camera_of(camera)?),
            (None, Some(facet), None) => {
                let parts = facet.rsplit_once(':').filter(|(cave, name)| !cave.is_empty() && !name.is_empty());
                let (cave, name) = parts.ok_or_else(|| {
                    Error::value(format!("facet: expected CAVE:NAME, such as cube4:front, got `{facet}`"))
                })?;
                if size != [None, None] {
                    return Err(Error::value(
                        "the size of a facet is set by the cave (size_px); width and height cannot be combined with facet",
                    ));
                }
                From::Facet(cave.into(), name.into())
            }
            (None, None, Some(cave)) => From::Cave(cave.into()),
            _ => return Err(Error::value("only one of camera, facet and cave can be given")),
        };
        Ok(Shot { size, from, overlays })
    }

    /// Returns the image as an array, shape (height, width, 4). The world is locked only while the
    /// draw list is made.
    pub fn take<'py>(&self, py: Python<'py>, shared: &Shared) -> Result<Bound<'py, PyArray3<u8>>> {
        ready(py)?;
        let image = py.detach(|| {
            let (list, scene) =
                shared.read(|inner| Ok((self.list(&inner.world, &inner.scene)?, inner.scene.clone())))?;
            let mut kept = RENDERER.lock().unwrap_or_else(PoisonError::into_inner);
            let renderer = kept.as_mut().ok_or_else(|| Error::Internal("the graphics device was lost".into()))?;
            caught(|| self.draw(renderer, list, &scene))
        })?;
        Ok(PyArray1::from_vec(py, image.rgba).reshape([image.height as usize, image.width as usize, 4])?)
    }

    fn list(&self, world: &World, scene: &Scene) -> Result<DrawList> {
        let mut list = Drawing::new(scene).list(world, &self.overlays)?;
        if let From::Camera(camera) = self.from {
            list.camera = camera;
        }
        Ok(list)
    }

    fn draw(&self, renderer: &mut Renderer, mut list: DrawList, scene: &SceneFile) -> Result<Image> {
        let size = [self.size[0].unwrap_or(USUAL[0]), self.size[1].unwrap_or(USUAL[1])];
        Ok(match &self.from {
            From::Scene | From::Camera(_) => renderer.render(&list, size[0], size[1])?,
            From::Facet(cave, name) => {
                list.settings.shadow_map_size = CAVE_SHADOWS;
                let cave = resolve_cave(cave)?.load()?;
                let facet = cave.facet(name)?.clone();
                CaveView::new(cave, scene)?.draw(renderer, &list, &facet)?
            }
            From::Cave(cave) => {
                list.settings.shadow_map_size = CAVE_SHADOWS;
                CaveView::new(resolve_cave(cave)?.load()?, scene)?.draw_unfolded(renderer, &list, size)?
            }
        })
    }
}

/// Makes the device if there is none yet. Drivers print warnings to stderr if no runtime directory
/// is set, as over ssh or in a container. Any folder satisfies them, so one is set while the device
/// is made.
fn ready(py: Python<'_>) -> Result<()> {
    let kept = || RENDERER.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    match MADE_BY.load(Ordering::Relaxed) {
        // A driver's threads do not exist in a forked process, which would wait for them forever.
        other if other != 0 && other != process => return Err(Error::Render(RenderError::Device {
            adapter: "any adapter".into(),
            reason: "this process was forked from one that had rendered; start it with `spawn` (multiprocessing.get_context(\"spawn\"))".into(),
        })),
        _ => MADE_BY.store(process, Ordering::Relaxed),
    }
    if py.detach(|| kept().is_some()) {
        return Ok(());
    }
    let (environ, name) = (py.import("os")?.getattr("environ")?, "XDG_RUNTIME_DIR");
    let named = environ.contains(name)?;
    if !named {
        environ.set_item(name, std::env::temp_dir().to_string_lossy())?;
    }
    let made = py.detach(|| {
        let mut kept = kept();
        if kept.is_none() {
            *kept = Some(caught(|| Ok(Renderer::new()?))?);
        }
        Ok(())
    });
    if !named {
        environ.call_method1("pop", (name, py.None()))?;
    }
    made
}

/// Converts `(eye, target)`, optionally followed by `up` and the field of view in degrees.
fn camera_of(camera: &Bound<'_, PyAny>) -> Result<Camera> {
    let wrong = || {
        Error::value(
            "camera: expected (eye, target), (eye, target, up) or (eye, target, up, fov_deg), or a tumble.Camera",
        )
    };
    let parts: Vec<Bound<'_, PyAny>> = camera.try_iter().map_err(|_| wrong())?.take(5).collect::<PyResult<_>>()?;
    if !(2..=4).contains(&parts.len()) {
        return Err(wrong());
    }
    let point = |k: usize, what: &str| -> Result<Vec3> { vec3(&parts[k], what) };
    let (eye, target) = (point(0, "camera.eye")?, point(1, "camera.target")?);
    let up = if parts.len() > 2 { point(2, "camera.up")? } else { Vec3::z() };
    let fov_deg = if parts.len() > 3 { number(parts[3].extract::<f64>()?, "camera.fov_deg")? } else { 40.0 };
    let far = 1e3 * (target - eye).norm().max(1.0);
    Ok(Camera::LookAt {
        eye: Point3::from(eye.cast::<f32>()),
        target: Point3::from(target.cast::<f32>()),
        up: Vector3::from(up.cast::<f32>()),
        vertical_fov_rad: (fov_deg as f32).to_radians(),
        near_m: (2e-5 * far) as f32,
        far_m: far as f32,
    })
}
