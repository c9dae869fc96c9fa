//! The content of a window: the scene's camera, one facet of a cave, or the whole cave unfolded.

use super::user::Rig;
use tumble::collide::Vec3;
use tumble::render::{CaveView, DrawList, Image, RIM_PX, RenderError, Screen, Viewpoint, unfold};
use tumble::scene::cave::{Facet, Flip, Stereo};

/// Factor by which shadow maps of a cave are wider, as in its screenshots.
const CAVE_SHADOWS: u32 = 2;

/// The content of a window.
pub enum ViewMode {
    /// The view of one camera.
    Camera,
    /// A facet, as its projector shows it.
    Facet(Box<CaveView>, Box<Facet>),
    /// All facets, seen from the point between the eyes.
    Unfolded(Box<CaveView>),
}

/// A line of sight, world axes.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// The eye, m.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// The middle of the view, a unit vector.
    pub axis: Vec3,
}

/// A view in a rectangle of the window.
struct Tile<'a> {
    from: From<'a>,
    position_px: [u32; 2],
    size_px: [u32; 2],
    flip: [bool; 2],
}

/// The eye of a tile: through a flat rectangle, or the one on a side of a facet's user, whose screen
/// is curved.
enum From<'a> {
    Flat(Box<dyn Viewpoint>),
    Curved(&'a CaveView, &'a Facet, f64),
}

impl ViewMode {
    /// Returns the user's eyes: the list's camera, or the cave's user at the cave's place.
    pub fn rig(&self, list: &DrawList) -> Rig {
        let (view, user) = match self {
            ViewMode::Camera => return Rig::Eye(list.camera),
            ViewMode::Facet(view, facet) => (view, facet.user),
            ViewMode::Unfolded(view) => (view, 0),
        };
        let user = &view.cave().users[user];
        Rig::Cave { place: *view.place(), eye_m: user.eye_m.into(), forward: user.forward.into() }
    }

    /// Moves the cave to the user's place, or the list's camera to the user's eye.
    pub fn set_place(&mut self, rig: &Rig, list: &mut DrawList) {
        match (self, rig) {
            (ViewMode::Camera, Rig::Eye(camera)) => list.camera = *camera,
            (ViewMode::Facet(view, _) | ViewMode::Unfolded(view), Rig::Cave { place, .. }) => view.set_place(*place),
            _ => {}
        }
    }

    /// Widens the shadow maps for a cave, because one map serves all of its screens.
    pub fn widen_shadows(&self, list: &mut DrawList) {
        if !matches!(self, ViewMode::Camera) {
            list.settings.shadow_map_size = (CAVE_SHADOWS * list.settings.shadow_map_size).min(8192);
        }
    }

    /// Draws on the window's device; the window shows it next.
    pub fn draw(&self, screen: &mut Screen, list: &DrawList) -> Result<(), RenderError> {
        let [w, h] = screen.size_px();
        let renderer = screen.renderer();
        match self {
            ViewMode::Camera => renderer.draw(&list.camera, list, w, h),
            ViewMode::Facet(view, facet) => {
                let stage = renderer.stage(list)?;
                view.draw_on_device(renderer, &stage, facet)
            }
            ViewMode::Unfolded(view) => {
                let stage = renderer.stage(list)?;
                view.draw_unfolded_on_device(renderer, &stage, [w, h])
            }
        }
    }

    /// Draws and reads the picture back into memory.
    pub fn picture(&self, screen: &mut Screen, list: &DrawList) -> Result<Image, RenderError> {
        self.draw(screen, list)?;
        screen.renderer().read()
    }

    /// Returns the line of sight through a pixel, for an anaglyph that of the left eye; `None` if
    /// nothing is shown there.
    pub fn ray(&self, list: &DrawList, size_px: [u32; 2], at_px: [f64; 2]) -> Option<Ray> {
        ray(&self.tiles(list, size_px).ok()?, at_px)
    }

    fn tiles<'a>(&'a self, list: &DrawList, size_px: [u32; 2]) -> Result<Vec<Tile<'a>>, RenderError> {
        Ok(match self {
            ViewMode::Camera => {
                let from = From::Flat(Box::new(list.camera));
                vec![Tile { from, position_px: [0; 2], size_px, flip: [false; 2] }]
            }
            ViewMode::Facet(view, facet) => eyes(view, facet)?,
            ViewMode::Unfolded(view) => {
                let tile = |t: tumble::render::Tile| -> Result<Tile<'a>, RenderError> {
                    let from = from(view, &view.cave().facets[t.facet], 0.0, t.size_px)?;
                    Ok(Tile { from, position_px: t.position_px, size_px: t.size_px, flip: [false; 2] })
                };
                unfold(view.cave(), size_px).1.into_iter().map(tile).collect::<Result<_, _>>()?
            }
        })
    }
}

/// Returns the line of sight through a pixel of a facet's picture, as [`ViewMode::ray`] does.
pub fn facet_ray(view: &CaveView, facet: &Facet, at_px: [f64; 2]) -> Option<Ray> {
    ray(&eyes(view, facet).ok()?, at_px)
}

/// Returns the line of sight through a pixel of tiles.
fn ray(tiles: &[Tile], at_px: [f64; 2]) -> Option<Ray> {
    let within =
        |t: &&Tile| (0..2).all(|k| (0.0..f64::from(t.size_px[k])).contains(&(at_px[k] - f64::from(t.position_px[k]))));
    let tile = tiles.iter().find(within)?;
    let share: [f64; 2] =
        std::array::from_fn(|k| (at_px[k] - f64::from(tile.position_px[k])) / f64::from(tile.size_px[k]));
    let share: [f64; 2] = std::array::from_fn(|k| if tile.flip[k] { 1.0 - share[k] } else { share[k] });
    let from = match &tile.from {
        From::Flat(from) => from,
        From::Curved(view, facet, side) => {
            let (origin, direction) = view.sight(facet, *side, share)?;
            let (_, axis) = view.sight(facet, *side, [0.5; 2])?;
            return Some(Ray { origin: origin.coords, direction, axis });
        }
    };
    let lens = from.lens(tile.size_px[0] as f32 / tile.size_px[1] as f32).ok()?;
    let back = (lens.projection * lens.view).try_inverse()?;
    let at = |depth: f64| {
        back.transform_point(&nalgebra::Point3::new(2.0 * share[0] - 1.0, 1.0 - 2.0 * share[1], depth)).coords
    };
    let (near, far) = (at(0.0), at(0.5));
    let rotation = lens.view.fixed_view::<3, 3>(0, 0).transpose();
    let origin = -(rotation * lens.view.fixed_view::<3, 1>(0, 3));
    Some(Ray { origin, direction: (far - near).try_normalize(1e-12)?, axis: -rotation.column(2).into_owned() })
}

/// Returns the views of a facet in their rectangles: one per eye, or one from between the eyes.
fn eyes<'a>(view: &'a CaveView, facet: &'a Facet) -> Result<Vec<Tile<'a>>, RenderError> {
    let [w, h] = facet.size_px;
    let flip = [matches!(facet.flip, Flip::Horizontal | Flip::Both), matches!(facet.flip, Flip::Vertical | Flip::Both)];
    let eye = |(i, side): (usize, &f64)| -> Result<Tile<'a>, RenderError> {
        let position_px = match facet.stereo {
            Stereo::SideBySide if i > 0 => [w, 0],
            Stereo::TopBottom if i > 0 => [0, h],
            _ => [0, 0],
        };
        Ok(Tile { from: from(view, facet, *side, [w, h])?, position_px, size_px: [w, h], flip })
    };
    facet.eyes(0).iter().enumerate().map(eye).collect()
}

/// Returns the eye on a side of a facet's user, for a picture of this size.
fn from<'a>(view: &'a CaveView, facet: &'a Facet, side: f64, [w, h]: [u32; 2]) -> Result<From<'a>, RenderError> {
    if !view.cave().screens[facet.screen].is_flat() {
        return Ok(From::Curved(view, facet, side));
    }
    Ok(From::Flat(Box::new(view.eye(facet, side)?.part(w, h, RIM_PX))))
}
