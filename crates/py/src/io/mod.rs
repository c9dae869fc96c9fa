//! Images, recordings and warnings about slow loading.

pub mod picture;
pub mod recording;
pub mod slow;
pub mod sound;
pub mod window;
