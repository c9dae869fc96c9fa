//! A picture on a curved screen: faces of a cube around the eye, put together pixel by pixel.

use super::compose::{blank, paste};
use super::cube::Cube;
use super::perspective::FacetView;
use super::view::RIM_PX;
use super::warp::sample;
use crate::gpu::{Around, Bend, Finish, Placed};
use crate::{DrawList, Image, RenderError, Renderer, Stage};
use nalgebra::{Point3, Vector3};
use std::sync::Arc;
use tumble_scene::CavePlace;

/// The content of each pixel of a picture, and the resolution of the faces.
pub(super) struct Curved {
    finish: Arc<Finish>,
    cube: Cube,
}

/// An eye in a cave.
pub(super) struct EyeInCave {
    /// Cave axes, m.
    pub eye: Point3<f64>,
    pub place: CavePlace,
    /// Depths that are drawn, in m of the cave.
    pub near_m: f64,
    pub far_m: f64,
}

impl Curved {
    /// Chooses the resolution of the faces for an eye.
    pub fn new(finish: Finish, eye: &Point3<f64>) -> Curved {
        let finish = Arc::new(finish);
        let cube = Cube::fitting(shown(&finish), finish.size, eye);
        Curved { finish, cube }
    }

    /// Draws the faces that the eye needs, and places the picture.
    pub fn draw(
        &self,
        renderer: &mut Renderer,
        stage: &Stage,
        from: &EyeInCave,
        mut placed: Placed,
    ) -> Result<(), RenderError> {
        let (cube, size) = (&self.cube, self.finish.size);
        for face in self.faces(from) {
            let at = [cube.atlas_px(), cube.corner_px(face)];
            renderer.draw_face(stage, &self.view(face, from, RIM_PX)?, cube.tile_px(), at)?;
        }
        placed.finish = Some(self.finish());
        renderer.place_surface(self.source(from), size, &placed)
    }

    /// Returns what each pixel shows, its blend and its color.
    pub fn finish(&self) -> Arc<Finish> {
        self.finish.clone()
    }

    /// Returns the cube of pictures around an eye as the source of a pass.
    pub fn source(&self, from: &EyeInCave) -> Around {
        let eye = from.eye.coords.map(|x| x as f32).into();
        Around { eye, side_px: self.cube.side_px, border_px: self.cube.border_px() }
    }

    /// Returns the size of the picture with all faces, pixels.
    pub fn source_px(&self) -> [u32; 2] {
        self.cube.atlas_px()
    }

    /// Returns the size of a face, pixels.
    pub fn view_px(&self) -> [u32; 2] {
        [self.cube.tile_px(); 2]
    }

    /// Returns the views of the faces that the eye needs, without a rim, each with its top left corner
    /// in the picture of all.
    pub fn views(&self, from: &EyeInCave) -> Result<Vec<(FacetView, [u32; 2])>, RenderError> {
        let view = |&face: &usize| Ok((self.view(face, from, 0)?, self.cube.corner_px(face)));
        self.faces(from).iter().map(view).collect()
    }

    /// Draws the picture in memory, without blend and color: the reference for the device.
    pub fn draw_in_memory(
        &self,
        renderer: &mut Renderer,
        list: &DrawList,
        from: &EyeInCave,
    ) -> Result<Image, RenderError> {
        let black = [0, 0, 0, 255];
        let ([w, h], side) = (self.cube.atlas_px(), self.cube.tile_px());
        let mut faces = blank(w, h, black);
        for face in self.faces(from) {
            let picture = renderer.render_from(&self.view(face, from, RIM_PX)?, list, side, side)?;
            let [x, y] = self.cube.corner_px(face);
            paste(&mut faces, &picture, x, y);
        }
        let mut out = blank(self.finish.size[0], self.finish.size[1], black);
        let places = self.cube.places(shown(&self.finish), &from.eye);
        for (pixel, place) in out.rgba.chunks_exact_mut(4).zip(places) {
            if let Some([x, y]) = place {
                pixel.copy_from_slice(&sample(&faces, x, y));
            }
        }
        Ok(out)
    }

    /// Returns the direction from the eye to what the pixel at a place of the picture shows: shares
    /// from 0 to 1, to the right and down.
    pub fn direction(&self, share: [f64; 2], eye: &Point3<f64>) -> Option<Vector3<f64>> {
        let [w, h] = self.finish.size;
        let at = |share: f64, side: u32| ((share * f64::from(side)).max(0.0) as usize).min(side as usize - 1);
        let pixel = shown(&self.finish)[at(share[1], h) * w as usize + at(share[0], w)];
        super::surface::direction(pixel, eye).map(Vector3::from)
    }

    /// Returns the point that each pixel shows; `None` if one shows a direction.
    pub fn points(&self) -> Option<Vec<Option<[f64; 3]>>> {
        let point = |[x, y, z, w]: &[f32; 4]| match *w {
            0.0 => None,
            w => Some((w > 0.0).then(|| [*x, *y, *z].map(f64::from))),
        };
        shown(&self.finish).iter().map(point).collect()
    }

    fn faces(&self, from: &EyeInCave) -> Vec<usize> {
        let seen = self.cube.seen(shown(&self.finish), self.finish.size[0], &from.eye);
        let faces: Vec<usize> = (0..6).filter(|&face| seen[face]).collect();
        // a picture that shows nothing is made of a face too
        if faces.is_empty() { vec![0] } else { faces }
    }

    fn view(&self, face: usize, from: &EyeInCave, rim_px: u32) -> Result<FacetView, RenderError> {
        let at = |p: Point3<f64>| Point3::from(from.place.to_scene(p.into()));
        let corners = self.cube.corners(face, &from.eye).map(at);
        let (near, far) = (from.near_m * from.place.scale, from.far_m * from.place.scale);
        let side = self.cube.tile_px();
        Ok(FacetView::new(at(from.eye), corners, near, far)?.part(side, side, rim_px))
    }
}

/// Returns what each pixel shows.
fn shown(finish: &Finish) -> &[[f32; 4]] {
    match &finish.bend {
        Bend::Surface(shown) => shown,
        _ => &[],
    }
}
