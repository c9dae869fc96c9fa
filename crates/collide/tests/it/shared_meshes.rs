//! Access to the public test meshes.

use std::path::PathBuf;

/// Returns the folder: `TUMBLE_MESHES`, else the nearest `shared/meshes` above this crate. Reports
/// on stderr if there is none.
pub fn folder() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("TUMBLE_MESHES") {
        return Some(path.into());
    }
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let found = here.ancestors().map(|a| a.join("shared/meshes")).find(|p| p.is_dir());
    if found.is_none() {
        // bypasses the harness, which hides the output of passing tests
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: no shared/meshes above {} and TUMBLE_MESHES is not set\n", here.display()),
        );
    }
    found
}

/// Returns the text of one mesh file; `None` (with a report) without the folder.
pub fn text(name: &str) -> Option<String> {
    let path = folder()?.join(name);
    Some(std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}
