//! Images, recordings and warnings about slow loading.

pub mod orbit;
pub mod picture;
pub mod recording;
pub mod slow;
pub mod sound;
pub mod window;
