//! Pictures of caves: the view of each eye through each screen.
//!
//! [`FacetView`] is the projection. [`CaveView`] is a cave at its place in a scene; it draws facets
//! one by one, or unfolded side by side. Pictures on curved screens are put together from a cube of
//! pictures around the eye. [`Warp`], [`Blend`] and [`ProjectorColor`] bend, darken and color finished
//! pictures for projectors, and [`CalibrationPattern`] helps to set them up.

mod blend;
mod calibration;
mod canvas;
mod color;
mod color_patterns;
mod compose;
mod cube;
mod curved;
pub(crate) mod font;
mod lut;
mod perspective;
mod pfm;
mod portable;
mod raster;
mod surface;
mod unfold;
mod view;
mod warp;

pub use blend::Blend;
pub(crate) use blend::encoded;
pub use calibration::{CalibrationPattern, as_projected, calibration_picture, finished_calibration_picture};
pub(crate) use canvas::fill_rect;
pub use color::ProjectorColor;
pub(crate) use compose::{Parity, blank};
pub use lut::ColorTable;
pub use perspective::FacetView;
pub use pfm::Pfm;
pub use portable::{NumberFormat, PortableEye, PortableFacet, PortableFinish, PortableNumbers, PortablePass};
pub use surface::ScreenMesh;
pub use unfold::{Tile, unfold};
pub use view::{CaveView, RIM_PX};
pub use warp::Warp;
