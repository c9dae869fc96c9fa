//! Files to worlds: scene TOML, meshes by path; every error names file, line and column.
