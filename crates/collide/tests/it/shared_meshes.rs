//! Where the public test meshes are.

use std::path::PathBuf;

/// The folder: `TUMBLE_MESHES`, else the nearest `shared/meshes` above this crate; says so on stderr if there is
/// none.
pub fn folder() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("TUMBLE_MESHES") {
        return Some(path.into());
    }
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let found = here.ancestors().map(|a| a.join("shared/meshes")).find(|p| p.is_dir());
    if found.is_none() {
        // past the harness, which keeps what passing tests print
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: no shared/meshes above {} and TUMBLE_MESHES is not set\n", here.display()),
        );
    }
    found
}

/// The text of one mesh file, `None` (and said) where the folder is absent.
pub fn text(name: &str) -> Option<String> {
    let path = folder()?.join(name);
    Some(std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}
