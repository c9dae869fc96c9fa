//! `--urdf`: a robot whose collision geometry is spheres.

use crate::args::SphereTreeOptions;
use crate::failure::Failure;
use std::path::Path;

/// Reads a robot, covers its links by spheres, prints and writes.
pub fn spherize(_path: &Path, _options: &SphereTreeOptions) -> Result<(), Failure> {
    Err(Failure::input("not yet"))
}
