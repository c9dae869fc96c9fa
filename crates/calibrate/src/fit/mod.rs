//! Poses and lenses of a camera and of projectors, and the places of walls, from decoded photographs.

mod bundle;
mod least_squares;
mod lens;
mod resection;
mod start;
mod wall;

pub(crate) use bundle::Fit;
pub use bundle::{Mark, Measurement, Quality, View};
pub(crate) use lens::{Pose, lens_pixel, lens_ray};
pub(crate) use wall::{Wall, nearest};
