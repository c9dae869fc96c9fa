//! The picture of a facet as plain numbers: what a program without this renderer needs to draw and finish it.
//!
//! ```text
//! each eye:   views ─► source (the picture, or faces of a cube around the eye) ─► pass ─► the whole
//! ```

use super::compose::EyePlace;
use super::view::CaveView;
use crate::gpu::{Finish, Placed, PortablePicture, PortableView, place_floats};
use crate::{DrawList, RenderError};
use std::sync::Arc;
use tumble_scene::cave::{Facet, Flip, Stereo};

/// The picture of a facet as plain numbers.
#[derive(Clone, Debug)]
pub struct PortableFacet {
    /// Everything that all views have in common, and the first view.
    pub picture: PortablePicture,
    /// Size of the whole, pixels.
    pub whole_px: [u32; 2],
    /// Whether each pixel of the display must be one of the picture, because the eyes are interlaced.
    pub is_interlaced: bool,
    /// The eyes in the order of their places. Empty if the picture is the whole as it is.
    pub eyes: Vec<PortableEye>,
}

/// The views of one eye, and the pass that puts them into the whole.
#[derive(Clone, Debug)]
pub struct PortableEye {
    /// Size of the source, pixels.
    pub source_px: [u32; 2],
    /// Views, all of one size, each with its top left corner in the source, pixels.
    pub views: Vec<(PortableView, [u32; 2])>,
    /// The pass.
    pub pass: PortablePass,
}

/// A pass that puts an eye's picture into the whole: bent, blended, mirrored.
#[derive(Clone, Debug)]
pub struct PortablePass {
    /// `struct Place` of the shader.
    pub place: Vec<f32>,
    /// Whether the source is a cube of pictures: the fragment stage is `fs_surface` instead of `fs_place`.
    pub is_surface: bool,
    /// Top left corner in the whole, and size, pixels; nothing else is written.
    pub at_px: [u32; 2],
    /// See `at_px`.
    pub size_px: [u32; 2],
    /// Which of red, green and blue are written.
    pub channels: [bool; 3],
    /// Warp, blend and color; `None` for a picture that only changes its place.
    pub finish: Option<PortableFinish>,
}

/// Warp, blend and color of a facet, which are the same in all frames.
#[derive(Clone, Debug)]
pub struct PortableFinish(pub(crate) Arc<Finish>);

/// Format of a pixel of [`PortableNumbers`]: how many floats of which size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberFormat {
    /// Two of 32 bits.
    Rg32Float,
    /// Four of 32 bits.
    Rgba32Float,
    /// Four of 16 bits.
    Rgba16Float,
}

/// Numbers for each pixel, as a texture that is read without a filter.
#[derive(Clone, Debug, PartialEq)]
pub struct PortableNumbers {
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Format of a pixel.
    pub format: NumberFormat,
    /// Rows from the top, little endian.
    pub bytes: Vec<u8>,
}

impl PortableFinish {
    /// Returns whether both are of one facet of one cave.
    pub fn is_same(&self, other: &PortableFinish) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Returns which textures of the shader have an effect, in the order of
    /// [`PortableFinish::textures`].
    pub fn used(&self) -> [bool; 3] {
        self.0.used()
    }

    /// Returns the textures of the shader: `warp`, `shares` and `table`; `None` for those without effect.
    pub fn textures(&self) -> [Option<PortableNumbers>; 3] {
        self.0.textures()
    }
}

impl CaveView {
    /// Returns a facet's picture as plain numbers: what [`CaveView::draw`] draws, without ambient
    /// occlusion.
    ///
    /// # Errors
    /// As [`PortablePicture::new`].
    pub fn portable(&self, list: &DrawList, facet: &Facet) -> Result<PortableFacet, RenderError> {
        let (size, whole_px) = (facet.size_px, facet.whole_px());
        let curved = self.curved(facet);
        let is_whole = curved.is_none() && self.flat_finish(facet).is_none() && facet.flip == Flip::None;
        if is_whole && let (Stereo::Mono | Stereo::Left | Stereo::Right, [side]) = (facet.stereo, self.eyes(facet)) {
            let from = self.eye(facet, *side)?.part(size[0], size[1], 0);
            let picture = PortablePicture::new(list, &from, size)?;
            return Ok(PortableFacet { picture, whole_px, is_interlaced: false, eyes: Vec::new() });
        }
        let (mut picture, mut eyes) = (None, Vec::new());
        for (i, side) in self.eyes(facet).iter().enumerate() {
            let EyePlace { at_px, channels, parity } = EyePlace::new(facet.stereo, i, size);
            let (views, view_px, source_px, around, finish) = match curved {
                Some(curved) => {
                    let from = self.around(facet, *side);
                    (
                        curved.views(&from)?,
                        curved.view_px(),
                        curved.source_px(),
                        Some(curved.source(&from)),
                        Some(curved.finish()),
                    )
                }
                None => {
                    let view = self.eye(facet, *side)?.part(size[0], size[1], 0);
                    (vec![(view, [0, 0])], size, size, None, self.flat_finish(facet))
                }
            };
            if picture.is_none() {
                picture = views.first().map(|(view, _)| PortablePicture::new(list, view, view_px)).transpose()?;
            }
            let view = |(view, at)| Ok((PortableView::new(list, &view, view_px)?, at));
            let views = views.into_iter().map(view).collect::<Result<_, RenderError>>()?;
            let placed = Placed { whole_px, at_px, begin: None, flip: facet.flip, channels, parity, finish };
            let place = place_floats(0, size, &placed, around).to_vec();
            let finish = placed.finish.map(PortableFinish);
            let pass = PortablePass { place, is_surface: around.is_some(), at_px, size_px: size, channels, finish };
            eyes.push(PortableEye { source_px, views, pass });
        }
        // a facet has at least one eye with at least one view
        let nothing = || RenderError::Translation { reason: "a facet without eyes".into() };
        let is_interlaced = matches!(facet.stereo, Stereo::Rows | Stereo::Columns | Stereo::Checkerboard);
        Ok(PortableFacet { picture: picture.ok_or_else(nothing)?, whole_px, is_interlaced, eyes })
    }
}
