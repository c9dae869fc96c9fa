//! A cave at its place in a scene.

use super::compose::{EyePlace, Parity, combined, flipped};
use super::curved::{Curved, EyeInCave};
use super::perspective::FacetView;
use super::surface::{ScreenMesh, shown};
use super::unfold::{Tile, unfold};
use super::{Blend, ProjectorColor, Warp, blend, color};
use crate::gpu::{Bend, Finish, Placed};
use crate::{DrawList, Image, RenderError, Renderer, Stage};
use nalgebra::{Point3, Vector3};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use tumble_scene::cave::{Cave, Facet, Flip, Screen, Surface, User};
use tumble_scene::{CavePlace, SceneFile};

/// Pixels drawn beyond the edges of a facet and cut off again; occlusion reaches this far across an
/// edge.
pub const RIM_PX: u32 = 48;

/// Background of the unfolded picture, between the facets.
const BACKGROUND: [u8; 4] = [24, 24, 26, 255];

/// A cave at its place in a scene, with the files of its facets.
pub struct CaveView {
    cave: Cave,
    place: CavePlace,
    /// Number of the frame that is drawn.
    frame: u64,
    /// By facet.
    warps: Vec<Option<Warp>>,
    /// Shares of light and of lift, by facet.
    masks: Vec<Option<Vec<[f32; 4]>>>,
    /// By facet.
    colors: Vec<Option<ProjectorColor>>,
    /// By screen.
    meshes: Vec<Option<ScreenMesh>>,
    /// Warp, blend and color for the device, by facet on a flat screen.
    finishes: Vec<Option<Arc<Finish>>>,
    /// The same with what each pixel shows, by facet on a curved screen.
    curved: Vec<Option<Curved>>,
    /// Curved screens in unfolded pictures, by facet and size.
    unfolded: Mutex<Vec<(Tile, Arc<Curved>)>>,
}

/// Largest number of curved screens of unfolded pictures that are kept.
const MAX_KEPT: usize = 64;

impl CaveView {
    /// Places the cave as the scene says; by default upright, with the first user's eye at the
    /// scene's camera and facing as it does. Reads the files of meshes, warps, blends and
    /// colors.
    ///
    /// # Errors
    /// [`RenderError::File`] and others for files that cannot be read or do not fit.
    pub fn new(cave: Cave, scene: &SceneFile) -> Result<CaveView, RenderError> {
        let place = scene.cave.unwrap_or_else(|| default_place(&cave, scene));
        let warps =
            cave.facets.iter().map(|f| f.warp_file.as_deref().map(Warp::load).transpose()).collect::<Result<_, _>>()?;
        let mesh = |s: &Screen| match &s.surface {
            Surface::Mesh { file } => ScreenMesh::load(file).map(Some),
            _ => Ok(None),
        };
        let meshes = cave.screens.iter().map(mesh).collect::<Result<_, _>>()?;
        let mask =
            |path: &Option<PathBuf>, f: &Facet| path.as_deref().map(|path| Blend::load(path, f.size_px)).transpose();
        let masks = |f: &Facet| -> Result<_, RenderError> {
            Ok(blend::masks(mask(&f.blend_file, f)?.as_ref(), mask(&f.black_file, f)?.as_ref()))
        };
        let masks = cave.facets.iter().map(masks).collect::<Result<_, _>>()?;
        let colors = cave.facets.iter().map(ProjectorColor::load).collect::<Result<_, _>>()?;
        let (finishes, curved, unfolded) = (Vec::new(), Vec::new(), Mutex::default());
        let mut view = CaveView { cave, place, frame: 0, warps, masks, colors, meshes, finishes, curved, unfolded };
        view.finishes = (0..view.cave.facets.len()).map(|i| view.finish(i)).collect();
        view.curved = (0..view.cave.facets.len()).map(|i| view.on_curve(i)).collect();
        Ok(view)
    }

    /// The cave.
    pub fn cave(&self) -> &Cave {
        &self.cave
    }

    /// Its place in the scene.
    pub fn place(&self) -> &CavePlace {
        &self.place
    }

    /// Moves it to another place in the scene.
    pub fn set_place(&mut self, place: CavePlace) {
        self.place = place;
    }

    /// The number of the frame that is drawn next; 0 at first. It decides which eye `frame_sequential`
    /// shows.
    pub fn set_frame(&mut self, frame: u64) {
        self.frame = frame;
    }

    /// Returns the sides of the eyes in a facet's next picture, in the order of their places.
    pub(super) fn eyes(&self, facet: &Facet) -> &'static [f64] {
        facet.eyes(self.frame)
    }

    /// The users; the next picture is drawn from the eyes that are set here.
    pub fn users_mut(&mut self) -> &mut [User] {
        &mut self.cave.users
    }

    /// Returns the view of one eye through a facet's screen, in the scene. `side` is −1 for the
    /// left eye, 0 for between the eyes, +1 for the right eye.
    ///
    /// # Errors
    /// As [`FacetView::new`]; and [`RenderError::BadValue`] for a curved screen, which is no window
    /// with straight edges.
    pub fn eye(&self, facet: &Facet, side: f64) -> Result<FacetView, RenderError> {
        let (screen, user) = (&self.cave.screens[facet.screen], &self.cave.users[facet.user]);
        if !screen.is_flat() {
            let value = format!("{}, which is curved", screen.name);
            let expected = "a flat screen";
            return Err(RenderError::BadValue { what: "facet", index: facet.screen, field: "screen", value, expected });
        }
        let at = |p: Point3<f64>| Point3::from(self.place.to_scene(p.into()));
        let corners = [screen.lower_left_m, screen.lower_right_m, screen.upper_left_m].map(at);
        FacetView::new(at(user.eye(side)), corners, facet.near_m * self.place.scale, facet.far_m * self.place.scale)
    }

    /// Returns the eye and the direction from it to what a place of one eye's picture shows, in the
    /// scene: the place goes from 0 to 1, to the right and down, before mirroring. `None` where the
    /// picture shows nothing. Warps of flat screens do not count. On curved screens it is the middle of
    /// a pixel.
    pub fn sight(&self, facet: &Facet, side: f64, share: [f64; 2]) -> Option<(Point3<f64>, Vector3<f64>)> {
        let scene = |p: Point3<f64>| Point3::from(self.place.to_scene(p.into()));
        let (screen, eye) = (&self.cave.screens[facet.screen], self.cave.users[facet.user].eye(side));
        let towards = match self.index(facet).and_then(|i| self.curved[i].as_ref()) {
            Some(curved) => eye + curved.direction(share, &eye)?,
            None => screen.upper_left_m + screen.across() * share[0] - screen.upward() * share[1],
        };
        let origin = scene(eye);
        Some((origin, (scene(towards) - origin).try_normalize(1e-12)?))
    }

    /// Returns the point of the cave that each pixel of one eye's picture shows, m, cave axes, by rows
    /// from the top, after the warp and before mirroring. `None` for a pixel that shows nothing, and for
    /// a facet whose pixels show directions.
    pub fn points(&self, facet: &Facet) -> Option<Vec<Option<[f64; 3]>>> {
        let (index, screen) = (self.index(facet)?, &self.cave.screens[facet.screen]);
        if let Some(curved) = &self.curved[index] {
            return curved.points();
        }
        let [w, h] = facet.size_px;
        let at = |[x, y]: [f64; 2]| {
            let (u, v) = ((x + 0.5) / f64::from(w), (y + 0.5) / f64::from(h));
            (screen.upper_left_m + screen.across() * u - screen.upward() * v).coords.into()
        };
        Some(match &self.warps[index] {
            Some(warp) => warp.sources([w, h]).into_iter().map(|from| from.map(at)).collect(),
            None => (0..h).flat_map(|y| (0..w).map(move |x| [x.into(), y.into()])).map(|p| Some(at(p))).collect(),
        })
    }

    /// The shares of red, green and blue light that each pixel of a facet keeps, and of the lift of
    /// black; `None` without masks.
    pub fn masks(&self, facet: &Facet) -> Option<&[[f32; 4]]> {
        self.masks[self.index(facet)?].as_deref()
    }

    /// The size of a facet's finished picture, or of all facets unfolded into at most `most`
    /// pixels.
    pub fn size_px(&self, facet: Option<&Facet>, most: [u32; 2]) -> [u32; 2] {
        match facet {
            Some(facet) => facet.whole_px(),
            None => unfold(&self.cave, most).0,
        }
    }

    /// Draws a facet's picture as its projector shows it: both eyes, warped, blended, mirrored.
    ///
    /// # Errors
    /// As [`Renderer::render_from`].
    pub fn draw(&self, renderer: &mut Renderer, list: &DrawList, facet: &Facet) -> Result<Image, RenderError> {
        let stage = renderer.stage(list)?;
        self.draw_on_device(renderer, &stage, facet)?;
        renderer.read()
    }

    /// Draws a facet's picture and leaves it on the device ([`Renderer::picture`]). One stage
    /// serves all facets of a frame.
    ///
    /// # Errors
    /// As [`Renderer::draw_stage`].
    pub fn draw_on_device(&self, renderer: &mut Renderer, stage: &Stage, facet: &Facet) -> Result<(), RenderError> {
        let index = self.index(facet);
        let finish = index.and_then(|i| self.finishes[i].clone());
        let curved = index.and_then(|i| self.curved[i].as_ref());
        let [w, h] = facet.size_px;
        for (i, side) in self.eyes(facet).iter().enumerate() {
            let EyePlace { at_px, channels, parity } = EyePlace::new(facet.stereo, i, [w, h]);
            let begin = (i == 0).then_some([0, 0, 0, 255]);
            // each eye is mirrored by itself; mirroring the whole would swap the eyes
            let (whole_px, flip, finish) = (facet.whole_px(), facet.flip, finish.clone());
            let placed = Placed { whole_px, at_px, begin, flip, channels, parity, finish };
            match curved {
                Some(curved) => curved.draw(renderer, stage, &self.around(facet, *side), placed)?,
                None => {
                    renderer.draw_placed(stage, &self.eye(facet, *side)?.part(w, h, RIM_PX), [w, h], &placed)?;
                }
            }
        }
        renderer.submit()
    }

    /// Returns what the pixels of a facet on a curved screen show.
    pub(super) fn curved(&self, facet: &Facet) -> Option<&Curved> {
        self.curved[self.index(facet)?].as_ref()
    }

    /// Returns warp, blend and color of a facet on a flat screen.
    pub(super) fn flat_finish(&self, facet: &Facet) -> Option<Arc<Finish>> {
        self.finishes[self.index(facet)?].clone()
    }

    /// Returns the eye, the place and the depths of the views around it.
    pub(super) fn around(&self, facet: &Facet, side: f64) -> EyeInCave {
        let eye = self.cave.users[facet.user].eye(side);
        EyeInCave { eye, place: self.place, near_m: facet.near_m, far_m: facet.far_m }
    }

    /// Draws as [`CaveView::draw`] does, with warp, blend and mirroring in memory: the reference
    /// for the device.
    ///
    /// # Errors
    /// As [`Renderer::render_from`].
    pub fn draw_in_memory(
        &self,
        renderer: &mut Renderer,
        list: &DrawList,
        facet: &Facet,
    ) -> Result<Image, RenderError> {
        let index = self.index(facet);
        let [w, h] = facet.size_px;
        let curved = index.and_then(|i| self.curved[i].as_ref());
        let mut one = |side: &f64| -> Result<Image, RenderError> {
            match curved {
                Some(curved) => curved.draw_in_memory(renderer, list, &self.around(facet, *side)),
                None => renderer.render_from(&self.eye(facet, *side)?.part(w, h, RIM_PX), list, w, h),
            }
        };
        let finished = |eye: Image| match curved {
            // put together through the warp already
            Some(_) => self.colored(eye, index),
            None => self.finished(eye, facet),
        };
        let eyes = self.eyes(facet).iter().map(|side| Ok(flipped(finished(one(side)?), facet.flip)));
        Ok(combined(eyes.collect::<Result<_, RenderError>>()?, facet.stereo))
    }

    /// Warps, blends and colors a picture of one eye of a facet, in memory.
    pub(super) fn finished(&self, image: Image, facet: &Facet) -> Image {
        let index = self.index(facet);
        let warped = index.and_then(|i| self.warps[i].as_ref()).map(|warp| warp.apply(&image));
        self.colored(warped.unwrap_or(image), index)
    }

    fn colored(&self, mut image: Image, index: Option<usize>) -> Image {
        let finish = index.map(|i| (self.masks[i].as_deref(), self.colors[i].as_ref()));
        if let Some((masks, color)) = finish.filter(|(masks, color)| masks.is_some() || color.is_some()) {
            color::apply(&mut image, masks, color);
        }
        image
    }

    /// Draws all facets unfolded into one picture of at most `most` pixels, seen from between the
    /// eyes, not warped and not mirrored.
    ///
    /// # Errors
    /// As [`Renderer::render_from`].
    pub fn draw_unfolded(
        &self,
        renderer: &mut Renderer,
        list: &DrawList,
        most: [u32; 2],
    ) -> Result<Image, RenderError> {
        let stage = renderer.stage(list)?;
        self.draw_unfolded_on_device(renderer, &stage, most)?;
        renderer.read()
    }

    /// Draws all facets unfolded and leaves the picture on the device ([`Renderer::picture`]).
    ///
    /// # Errors
    /// As [`Renderer::draw_stage`].
    pub fn draw_unfolded_on_device(
        &self,
        renderer: &mut Renderer,
        stage: &Stage,
        most: [u32; 2],
    ) -> Result<(), RenderError> {
        let (whole_px, tiles) = unfold(&self.cave, most);
        for (i, tile) in tiles.into_iter().enumerate() {
            let begin = (i == 0).then_some(BACKGROUND);
            let Tile { facet: index, position_px, size_px: [w, h] } = tile;
            let facet = &self.cave.facets[index];
            let (flip, channels, parity) = (Flip::None, [true; 3], Parity::default());
            let placed = Placed { whole_px, at_px: position_px, begin, flip, channels, parity, finish: None };
            match self.unfolded(tile) {
                Some(curved) => curved.draw(renderer, stage, &self.around(facet, 0.0), placed)?,
                None => renderer.draw_placed(stage, &self.eye(facet, 0.0)?.part(w, h, RIM_PX), [w, h], &placed)?,
            }
        }
        renderer.submit()
    }

    /// Returns the curved screen of a tile, from those kept; `None` for a flat one.
    fn unfolded(&self, tile: Tile) -> Option<Arc<Curved>> {
        let mut kept = self.unfolded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, curved)) =
            kept.iter().find(|(known, _)| (known.facet, known.size_px) == (tile.facet, tile.size_px))
        {
            return Some(curved.clone());
        }
        let facet = &self.cave.facets[tile.facet];
        let screen = &self.cave.screens[facet.screen];
        let shown = shown(screen, self.meshes[facet.screen].as_ref(), None, tile.size_px)?;
        let finish = Finish { size: tile.size_px, bend: Bend::Surface(shown), shares: None, color: None };
        let curved = Arc::new(Curved::new(finish, &self.cave.users[facet.user].eye_m));
        if kept.len() >= MAX_KEPT {
            kept.remove(0);
        }
        kept.push((tile, curved.clone()));
        Some(curved)
    }

    fn index(&self, facet: &Facet) -> Option<usize> {
        self.cave.facets.iter().position(|f| f.name == facet.name)
    }

    /// Returns warp, blend and color of a facet as numbers for the device.
    fn finish(&self, index: usize) -> Option<Arc<Finish>> {
        let size = self.cave.facets[index].size_px;
        let small = |place: [f64; 2]| place.map(|p| p as f32);
        let bend = match &self.warps[index] {
            Some(warp) => Bend::Warp(warp.sources(size).into_iter().map(|from| from.map(small)).collect()),
            None => Bend::None,
        };
        let (shares, color) = (self.masks[index].clone(), self.colors[index].clone());
        (bend != Bend::None || shares.is_some() || color.is_some())
            .then(|| Arc::new(Finish { size, bend, shares, color }))
    }

    /// Returns what the pixels of a facet on a curved screen show, with its blend and color.
    fn on_curve(&self, index: usize) -> Option<Curved> {
        let facet = &self.cave.facets[index];
        let (screen, mesh) = (&self.cave.screens[facet.screen], self.meshes[facet.screen].as_ref());
        let bend = Bend::Surface(shown(screen, mesh, self.warps[index].as_ref(), facet.size_px)?);
        let (shares, color) = (self.masks[index].clone(), self.colors[index].clone());
        Some(Curved::new(Finish { size: facet.size_px, bend, shares, color }, &self.cave.users[facet.user].eye_m))
    }
}

/// Places the first user's eye at the scene's camera, upright.
fn default_place(cave: &Cave, scene: &SceneFile) -> CavePlace {
    let user = &cave.users[0];
    let (eye, towards) = match &scene.camera {
        Some(camera) => (camera.eye_m, (Vector3::from(camera.target_m) - Vector3::from(camera.eye_m)).into()),
        // a scene without a camera: a few steps back from its origin
        None => ([0.0, -4.0, user.eye_m.z], [0.0, 1.0, 0.0]),
    };
    CavePlace::standing(user.eye_m.into(), user.forward.into(), eye, towards)
}
