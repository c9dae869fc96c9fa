//! A cave that stands in a scene.

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

/// Pixels drawn beyond the edges of a facet and cut off again: what occlusion may reach across an edge.
pub const RIM_PX: u32 = 48;

/// Behind and between the facets of an unfolded cave.
const BACKGROUND: [u8; 4] = [24, 24, 26, 255];

/// A cave at its place in a scene, with what its facets read from files.
pub struct CaveView {
    cave: Cave,
    place: CavePlace,
    /// By facet.
    warps: Vec<Option<Warp>>,
    /// By facet.
    blends: Vec<Option<Blend>>,
    /// The two of them for the device, by facet.
    finishes: Vec<Option<Arc<Finish>>>,
}

impl CaveView {
    /// The cave where the scene puts it; where the scene does not say, upright with the first user's eye at the scene's camera, facing as it does.
    /// Reads the files of warps and blends.
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

    /// Where it stands in the scene.
    pub fn place(&self) -> &CavePlace {
        &self.place
    }

    /// Puts it elsewhere in the scene.
    pub fn set_place(&mut self, place: CavePlace) {
        self.place = place;
    }

    /// The users, to be moved as they move: what is drawn next is seen by their new eyes.
    pub fn users_mut(&mut self) -> &mut [User] {
        &mut self.cave.users
    }

    /// What the eye to the `side` (−1 left, 0 between, +1 right) sees through a facet's screen, in the scene.
    ///
    /// # Errors
    /// As [`FacetView::new`].
    pub fn eye(&self, facet: &Facet, side: f64) -> Result<FacetView, RenderError> {
        let (screen, user) = (&self.cave.screens[facet.screen], &self.cave.users[facet.user]);
        let at = |p: Point3<f64>| Point3::from(self.place.to_scene(p.into()));
        let corners = [screen.lower_left_m, screen.lower_right_m, screen.upper_left_m].map(at);
        FacetView::new(at(user.eye(side)), corners, facet.near_m * self.place.scale, facet.far_m * self.place.scale)
    }

    /// The size of a facet's finished picture, and of all facets unfolded to fit `most` pixels, for who must know before.
    pub fn size_px(&self, facet: Option<&Facet>, most: [u32; 2]) -> [u32; 2] {
        match facet {
            Some(facet) => facet.whole_px(),
            None => unfold(&self.cave, most).0,
        }
    }

    /// A facet's picture as its projector gets it: both eyes, bent, darkened, mirrored.
    ///
    /// # Errors
    /// As [`Renderer::render_from`].
    pub fn draw(&self, renderer: &mut Renderer, list: &DrawList, facet: &Facet) -> Result<Image, RenderError> {
        let stage = renderer.stage(list)?;
        self.draw_on_device(renderer, &stage, facet)?;
        renderer.read()
    }

    /// The same, but the picture stays on the device ([`Renderer::picture`]). One stage serves all facets of a frame.
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
            // each eye by itself: mirroring the whole would give each the other's half
            let placed =
                Placed { whole_px: facet.whole_px(), at_px, begin, flip: facet.flip, channels, finish: finish.clone() };
            renderer.draw_placed(stage, &self.eye(facet, *side)?.part(w, h, RIM_PX), [w, h], &placed)?;
        }
        Ok(())
    }

    /// What [`CaveView::draw`] gives, with all that is done to finished pictures done in memory: the reference for the device.
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

    /// All facets unfolded into one picture of at most `most` pixels: what the point between the eyes sees, neither bent nor mirrored.
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

    /// The same, but the picture stays on the device ([`Renderer::picture`]).
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

    /// Warp and blend of a facet in numbers for the device.
    fn finish(&self, index: usize) -> Option<Arc<Finish>> {
        let size = self.cave.facets[index].size_px;
        let small = |place: [f64; 2]| place.map(|p| p as f32);
        let warp =
            self.warps[index].as_ref().map(|warp| warp.sources(size).into_iter().map(|from| from.map(small)).collect());
        let shares = self.blends[index].as_ref().map(Blend::bytes);
        (warp.is_some() || shares.is_some()).then(|| Arc::new(Finish { size, warp, shares }))
    }
}

/// The first user's eye at the camera's, upright.
fn default_place(cave: &Cave, scene: &SceneFile) -> CavePlace {
    let user = &cave.users[0];
    let (eye, towards) = match &scene.camera {
        Some(camera) => (camera.eye_m, (Vector3::from(camera.target_m) - Vector3::from(camera.eye_m)).into()),
        // a scene without a camera: a few steps back from its origin
        None => ([0.0, -4.0, user.eye_m.z], [0.0, 1.0, 0.0]),
    };
    CavePlace::standing(user.eye_m.into(), user.forward.into(), eye, towards)
}
