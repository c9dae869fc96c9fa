//! Finding scenes by path and by name, and reading them from disk.

use std::path::PathBuf;

use tumble_scene::{MAX_BYTES, MeshSource, SceneError, SceneFile, SceneSource, resolve_scene};

/// A new folder for one test, removed when it goes out of scope.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("tumble-scene-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).expect("the folder for temporary files can be written");
        Folder(path)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        std::fs::create_dir_all(path.parent().expect("inside the folder")).expect("can be written");
        std::fs::write(&path, bytes).expect("can be written");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_name_is_looked_for_in_the_folders_first_and_then_among_the_shipped() {
    let folder = Folder::new("names");
    let own = folder.write("stack/scene.toml", b"description = \"mine\"\n");
    assert!(matches!(resolve_scene("stack", &[]), Ok(SceneSource::Shipped(scene)) if scene.name == "stack"));
    let found = resolve_scene("stack", std::slice::from_ref(&folder.0)).unwrap();
    assert!(matches!(&found, SceneSource::Path(path) if *path == own));
    assert_eq!(found.load().unwrap().description, "mine");
}

#[test]
fn a_path_may_be_the_file_or_its_folder() {
    let folder = Folder::new("paths");
    let file = folder.write("one/scene.toml", b"description = \"by path\"\n");
    for path in [file.clone(), folder.0.join("one")] {
        let found = resolve_scene(path.to_str().unwrap(), &[]).unwrap();
        assert_eq!(found.load().unwrap().description, "by path");
        assert_eq!(SceneFile::load(&path).unwrap().file, file.display().to_string());
    }
}

#[test]
fn what_is_not_there() {
    let error = resolve_scene("biliards", &[]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "no scene `biliards`: did you mean `billiards`? There are `falling`, `stack`, `billiards`, `bowling`, `incline`, `pendulum`, `chain`, `piston`, `skeleton`, `robot`, `dominoes`, `newtons_cradle`, `arch`, `card_house`, `wrecking_ball`, `marble_run`, `steam_engine`, `walker`, `cloth`, `jelly`, `sparks`, `campfire`, `flock`, `ball_machine`, `bird` and `mechanism`"
    );
    let error = resolve_scene("no/such.toml", &[]).unwrap_err();
    assert!(error.to_string().starts_with("no/such.toml: cannot read it: "), "{error}");
    assert!(matches!(SceneFile::load("no/such.toml"), Err(SceneError::Read { .. })));
    assert_eq!(error.report(false), format!("error: {error}\n"));
}

#[test]
fn a_mesh_file_is_found_beside_the_scene() {
    let folder = Folder::new("meshes");
    let mesh = folder.write("m/part.STL", b"solid\n");
    let scene = folder.write("scene.toml", b"[meshes.part]\ntype = \"file\"\nfile = \"m/part.STL\"\nscale = 0.001\n");
    let read = SceneFile::load(scene).unwrap();
    assert_eq!(read.meshes[0].source, MeshSource::File { path: mesh, scale: 0.001 });
}

#[test]
fn bytes_that_are_not_text_and_files_that_are_too_large() {
    let folder = Folder::new("bytes");
    let path = folder.write("latin.toml", b"[world]\n# caf\xe9\n");
    let error = SceneFile::load(&path).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("{}:2: byte 13 of the file is not UTF-8; a scene is a UTF-8 text in TOML", path.display())
    );
    let path = folder.write("large.toml", "#".repeat(MAX_BYTES as usize + 1).as_bytes());
    assert!(matches!(SceneFile::load(&path), Err(SceneError::TooLarge { limit: 16_777_216, .. })));
    let path = folder.write("just.toml", "#".repeat(MAX_BYTES as usize).as_bytes());
    assert!(SceneFile::load(&path).is_ok());
}
