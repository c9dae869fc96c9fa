//! Meshes with defects.
