//! A cave that stands in a scene.

use super::compose::{blank, combined, flipped, paste};
use super::perspective::FacetView;
use super::unfold::{Tile, unfold};
use super::{Blend, Warp};
use crate::{DrawList, Image, RenderError, Renderer};
use nalgebra::{Point3, Vector3};
use tumble_scene::cave::{Cave, Facet};
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
}

impl CaveView {
    /// The cave where the scene puts it; where the scene does not say, upright with the first user's eye at the scene's camera, facing as it does.
    /// Reads the files of warps and blends.
    ///
    /// # Errors
    /// [`RenderError::File`] and others for warps and blends that cannot be read or do not fit.
    pub fn new(cave: Cave, scene: &SceneFile) -> Result<CaveView, RenderError> {
        let place = scene.cave.unwrap_or_else(|| default_place(&cave, scene));
        let warps = cave.facets.iter().map(|f| f.warp_file.as_deref().map(Warp::load).transpose()).collect::<Result<_, _>>()?;
        let blend = |f: &Facet| f.blend_file.as_deref().map(|path| Blend::load(path, f.size_px)).transpose();
        let blends = cave.facets.iter().map(blend).collect::<Result<_, _>>()?;
        Ok(CaveView { cave, place, warps, blends })
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
    pub fn stand(&mut self, place: CavePlace) {
        self.place = place;
    }

    /// Whether a facet's picture is bent or darkened for its projector.
    pub fn is_bent(&self, facet: &Facet) -> bool {
        facet.warp_file.is_some() || facet.blend_file.is_some()
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
        let index = self.cave.facets.iter().position(|f| f.name == facet.name);
        let [w, h] = facet.size_px;
        let one = |side: &f64| -> Result<Image, RenderError> { renderer.render_from(&self.eye(facet, *side)?.part(w, h, RIM_PX), list, w, h) };
        let mut eyes = facet.stereo.sides().iter().map(one).collect::<Result<Vec<_>, _>>()?;
        if let Some(warp) = index.and_then(|i| self.warps[i].as_ref()) {
            eyes = eyes.iter().map(|eye| warp.apply(eye)).collect();
        }
        if let Some(blend) = index.and_then(|i| self.blends[i].as_ref()) {
            eyes.iter_mut().for_each(|eye| blend.apply(eye));
        }
        // each eye by itself: mirroring the whole would give each the other's half
        Ok(combined(eyes.into_iter().map(|eye| flipped(eye, facet.flip)).collect(), facet.stereo))
    }

    /// All facets unfolded into one picture of at most `most` pixels: what the point between the eyes sees, neither bent nor mirrored.
    ///
    /// # Errors
    /// As [`Renderer::render_from`].
    pub fn draw_unfolded(&self, renderer: &mut Renderer, list: &DrawList, most: [u32; 2]) -> Result<Image, RenderError> {
        let ([width, height], tiles) = unfold(&self.cave, most);
        let mut whole = blank(width, height, BACKGROUND);
        for Tile { facet, position_px, size_px: [w, h] } in tiles {
            let view = self.eye(&self.cave.facets[facet], 0.0)?.part(w, h, RIM_PX);
            paste(&mut whole, &renderer.render_from(&view, list, w, h)?, position_px[0], position_px[1]);
        }
        Ok(whole)
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
