//! A cave at its place in a scene.

use super::compose::{combined, flipped};
use super::perspective::FacetView;
use super::unfold::{Tile, unfold};
use super::{Blend, Warp};
use crate::gpu::{Finish, Placed};
use crate::{DrawList, Image, RenderError, Renderer, Stage};
use nalgebra::{Point3, Vector3};
use std::sync::Arc;
use tumble_scene::cave::{Cave, Facet, Flip, Stereo, User};
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
    /// By facet.
    warps: Vec<Option<Warp>>,
    /// By facet.
    blends: Vec<Option<Blend>>,
    /// Warp and blend for the device, by facet.
    finishes: Vec<Option<Arc<Finish>>>,
}

impl CaveView {
    /// Places the cave as the scene says; by default upright, with the first user's eye at the
    /// scene's camera and facing as it does. Reads the files of warps and blends.
    ///
    /// # Errors
    /// [`RenderError::File`] and others for warps and blends that cannot be read or do not fit.
    pub fn new(cave: Cave, scene: &SceneFile) -> Result<CaveView, RenderError> {
        let place = scene.cave.unwrap_or_else(|| default_place(&cave, scene));
        let warps =
            cave.facets.iter().map(|f| f.warp_file.as_deref().map(Warp::load).transpose()).collect::<Result<_, _>>()?;
        let blend = |f: &Facet| f.blend_file.as_deref().map(|path| Blend::load(path, f.size_px)).transpose();
        let blends = cave.facets.iter().map(blend).collect::<Result<_, _>>()?;
        let mut view = CaveView { cave, place, warps, blends, finishes: Vec::new() };
        view.finishes = (0..view.cave.facets.len()).map(|i| view.finish(i)).collect();
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

    /// The users; the next picture is drawn from the eyes that are set here.
    pub fn users_mut(&mut self) -> &mut [User] {
        &mut self.cave.users
    }

    /// Returns the view of one eye through a facet's screen, in the scene. `side` is −1 for the
    /// left eye, 0 for between the eyes, +1 for the right eye.
    ///
    /// # Errors
    /// As [`FacetView::new`].
    pub fn eye(&self, facet: &Facet, side: f64) -> Result<FacetView, RenderError> {
        let (screen, user) = (&self.cave.screens[facet.screen], &self.cave.users[facet.user]);
        let at = |p: Point3<f64>| Point3::from(self.place.to_scene(p.into()));
        let corners = [screen.lower_left_m, screen.lower_right_m, screen.upper_left_m].map(at);
        FacetView::new(at(user.eye(side)), corners, facet.near_m * self.place.scale, facet.far_m * self.place.scale)
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
        let finish = self.index(facet).and_then(|i| self.finishes[i].clone());
        let [w, h] = facet.size_px;
        for (i, side) in facet.stereo.sides().iter().enumerate() {
            let (at_px, channels) = match (facet.stereo, i) {
                (Stereo::Anaglyph, 0) => ([0, 0], [true, false, false]),
                (Stereo::Anaglyph, _) => ([0, 0], [false, true, true]),
                (Stereo::SideBySide, 1) => ([w, 0], [true; 3]),
                (Stereo::TopBottom, 1) => ([0, h], [true; 3]),
                _ => ([0, 0], [true; 3]),
            };
            let begin = (i == 0).then_some([0, 0, 0, 255]);
            // each eye is mirrored by itself; mirroring the whole would swap the eyes
            let placed =
                Placed { whole_px: facet.whole_px(), at_px, begin, flip: facet.flip, channels, finish: finish.clone() };
            renderer.draw_placed(stage, &self.eye(facet, *side)?.part(w, h, RIM_PX), [w, h], &placed)?;
        }
        Ok(())
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
        let one = |side: &f64| -> Result<Image, RenderError> {
            renderer.render_from(&self.eye(facet, *side)?.part(w, h, RIM_PX), list, w, h)
        };
        let mut eyes = facet.stereo.sides().iter().map(one).collect::<Result<Vec<_>, _>>()?;
        if let Some(warp) = index.and_then(|i| self.warps[i].as_ref()) {
            eyes = eyes.iter().map(|eye| warp.apply(eye)).collect();
        }
        if let Some(blend) = index.and_then(|i| self.blends[i].as_ref()) {
            eyes.iter_mut().for_each(|eye| blend.apply(eye));
        }
        Ok(combined(eyes.into_iter().map(|eye| flipped(eye, facet.flip)).collect(), facet.stereo))
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
        for (i, Tile { facet, position_px, size_px: [w, h] }) in tiles.into_iter().enumerate() {
            let begin = (i == 0).then_some(BACKGROUND);
            let placed =
                Placed { whole_px, at_px: position_px, begin, flip: Flip::None, channels: [true; 3], finish: None };
            renderer.draw_placed(
                stage,
                &self.eye(&self.cave.facets[facet], 0.0)?.part(w, h, RIM_PX),
                [w, h],
                &placed,
            )?;
        }
        Ok(())
    }

    fn index(&self, facet: &Facet) -> Option<usize> {
        self.cave.facets.iter().position(|f| f.name == facet.name)
    }

    /// Returns warp and blend of a facet as numbers for the device.
    fn finish(&self, index: usize) -> Option<Arc<Finish>> {
        let size = self.cave.facets[index].size_px;
        let small = |place: [f64; 2]| place.map(|p| p as f32);
        let warp =
            self.warps[index].as_ref().map(|warp| warp.sources(size).into_iter().map(|from| from.map(small)).collect());
        let shares = self.blends[index].as_ref().map(Blend::bytes);
        (warp.is_some() || shares.is_some()).then(|| Arc::new(Finish { size, warp, shares }))
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
