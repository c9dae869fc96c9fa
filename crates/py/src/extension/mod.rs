//! Forces and behaviors written in Python, and their view of the world.

pub mod callbacks;
pub mod columns;
pub mod layout;
pub mod view;
