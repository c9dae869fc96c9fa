//! Pictures of caves: the view of each eye through each screen.
//!
//! [`FacetView`] is the projection. [`CaveView`] is a cave at its place in a scene; it draws facets
//! one by one, or unfolded side by side. [`Warp`] and [`Blend`] bend and darken finished pictures
//! for projectors, and [`CalibrationPattern`] helps to set them up.

mod blend;
mod calibration;
mod canvas;
mod compose;
pub(crate) mod font;
mod perspective;
mod unfold;
mod view;
mod warp;

pub use blend::Blend;
pub(crate) use blend::encoded;
pub use calibration::{CalibrationPattern, calibration_picture};
pub(crate) use canvas::fill_rect;
pub(crate) use compose::blank;
pub use perspective::FacetView;
pub use unfold::{Tile, unfold};
pub use view::{CaveView, RIM_PX};
pub use warp::Warp;
