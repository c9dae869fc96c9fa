//! Forces, behaviors and intersection tests written in Python, and their view of the world.

pub mod callbacks;
pub mod code;
pub mod columns;
pub mod intersect;
pub mod layout;
pub mod view;
