//! The cache of trees: the same bits as a build, and no file is trusted.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use tumble_collide::{CachedTree, Shape, SphereTree, TreeCache, TreeSettings, TriMesh, Vec3};

/// A folder for one test, removed at the end.
pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new() -> Folder {
        static COUNTER: AtomicU32 = AtomicU32::new(0);
        let name = format!("tumble-cache-{}-{}", std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed));
        Folder(std::env::temp_dir().join(name))
    }

    pub fn cache(&self) -> TreeCache {
        TreeCache::at(&self.0)
    }

    pub fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> =
            fs::read_dir(&self.0).map(|entries| entries.map(|e| e.unwrap().path()).collect()).unwrap_or_default();
        files.sort();
        files
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn ring() -> TriMesh {
    TriMesh::torus(1.0, 0.3, 12, 8)
}

fn settings() -> TreeSettings {
    TreeSettings { depth: 2, error: 0.05, ..TreeSettings::octree() }
}

fn cached(mesh: &TriMesh, cache: &TreeCache) -> CachedTree {
    SphereTree::build_cached(mesh, &settings(), cache).unwrap()
}

#[test]
fn a_tree_from_the_cache_has_the_bits_of_a_fresh_one() {
    let folder = Folder::new();
    let (fresh, stages) = SphereTree::build_with_progress(&ring(), &settings(), &()).unwrap();
    for found in [false, true, true] {
        let cached = cached(&ring(), &folder.cache());
        assert_eq!(cached, CachedTree { tree: fresh.clone(), stages: stages.clone(), found, note: None });
    }
    assert_eq!(folder.files().len(), 1);
    let off = cached(&ring(), &TreeCache::off());
    assert_eq!((off.found, off.note, off.tree), (false, None, fresh));
    let (shape, note) = Shape::mesh_cached(ring(), &settings(), &folder.cache()).unwrap();
    let plain = Shape::mesh(ring(), &settings()).unwrap();
    assert_eq!((shape.tree(), note), (plain.tree(), None));
    // shapes have separate files
    assert_eq!(folder.files().len(), 2);
}

#[test]
fn another_mesh_or_other_settings_have_a_file_of_their_own() {
    let folder = Folder::new();
    let mut moved = ring();
    moved.vertices[0].x = f64::from_bits(moved.vertices[0].x.to_bits() + 1);
    let mut turned = ring();
    turned.triangles[0].rotate_left(1);
    for (n, mesh) in [ring(), moved, turned].iter().enumerate() {
        assert!(!cached(mesh, &folder.cache()).found);
        assert_eq!(folder.files().len(), n + 1);
    }
    let others = [
        TreeSettings { depth: 3, ..settings() },
        TreeSettings { error: f64::from_bits(0.05_f64.to_bits() + 1), ..settings() },
        TreeSettings { even: false, ..settings() },
        TreeSettings { branch: 7, ..settings() },
    ];
    for (n, settings) in others.iter().enumerate() {
        assert!(!SphereTree::build_cached(&ring(), settings, &folder.cache()).unwrap().found);
        assert_eq!(folder.files().len(), n + 4);
    }
}

/// Checks that the content instead of the file is reported, that the tree is rebuilt, and that the
/// file is restored.
fn is_built_anew(folder: &Folder, file: &Path, content: &[u8], what: &str) {
    let good = fs::read(file).unwrap();
    fs::write(file, content).unwrap();
    let cached = cached(&ring(), &folder.cache());
    assert!(!cached.found, "{what}: trusted");
    assert!(cached.note.is_some_and(|note| note.contains(&file.display().to_string())), "{what}: not reported");
    assert_eq!(fs::read(file).unwrap(), good, "{what}: not restored");
}

#[test]
fn a_file_that_was_cut_anywhere_is_built_anew() {
    let folder = Folder::new();
    cached(&ring(), &folder.cache());
    let file = folder.files().remove(0);
    let good = fs::read(&file).unwrap();
    // every byte of the header, then steps that reach all fields of a sphere
    let cuts = (0..300).chain((300..good.len()).step_by(7)).chain([good.len() - 1]);
    for cut in cuts {
        is_built_anew(&folder, &file, &good[..cut], &format!("cut at {cut} of {}", good.len()));
    }
    is_built_anew(&folder, &file, &[&good[..], b" "].concat(), "one byte more");
}

#[test]
fn a_file_with_a_bit_turned_is_built_anew() {
    let folder = Folder::new();
    cached(&ring(), &folder.cache());
    let file = folder.files().remove(0);
    let good = fs::read(&file).unwrap();
    for at in (0..300).chain((300..good.len()).step_by(11)) {
        let mut bad = good.clone();
        bad[at] ^= 1 << (at % 8);
        is_built_anew(&folder, &file, &bad, &format!("byte {at}"));
    }
}

#[test]
fn a_stale_version_another_trees_file_and_a_folder_in_its_place_are_built_anew() {
    let folder = Folder::new();
    cached(&ring(), &folder.cache());
    let file = folder.files().remove(0);
    let text = fs::read_to_string(&file).unwrap();
    is_built_anew(&folder, &file, text.replacen("tree 1 ", "tree 0 ", 1).as_bytes(), "stale");
    is_built_anew(&folder, &file, b"", "empty");
    let other = Folder::new();
    cached(&TriMesh::cuboid(Vec3::repeat(2.0)), &other.cache());
    is_built_anew(&folder, &file, &fs::read(other.files().remove(0)).unwrap(), "another tree's");
    fs::remove_file(&file).unwrap();
    fs::create_dir(&file).unwrap();
    let cached = cached(&ring(), &folder.cache());
    assert!(!cached.found && cached.note.is_some());
}

#[test]
fn many_at_once_all_get_the_tree_and_leave_one_whole_file() {
    let folder = Folder::new();
    let fresh = SphereTree::build(&ring(), &settings()).unwrap();
    let notes: Vec<Option<String>> = std::thread::scope(|scope| {
        let work = || {
            (0..20)
                .filter_map(|n| {
                    // another process empties the folder from time to time
                    if n % 7 == 3 {
                        folder.files().iter().for_each(|f| _ = fs::remove_file(f));
                    }
                    let cached = cached(&ring(), &folder.cache());
                    assert_eq!(cached.tree, fresh);
                    cached.note
                })
                .collect::<Vec<_>>()
        };
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(work)).collect();
        threads.into_iter().flat_map(|t| t.join().unwrap()).map(Some).collect()
    });
    // a file that was removed before its renaming is reported; no file was ever read partially
    assert!(notes.iter().flatten().all(|note| note.contains("is not kept")), "{notes:?}");
    cached(&ring(), &folder.cache());
    assert!(cached(&ring(), &folder.cache()).found);
    assert_eq!(folder.files().len(), 1);
}

#[test]
fn a_folder_that_cannot_be_written_is_a_note() {
    let folder = Folder::new();
    fs::create_dir_all(&folder.0).unwrap();
    // a file instead of the folder: rejected for any user, including root
    let in_the_way = folder.0.join("file");
    fs::write(&in_the_way, "").unwrap();
    let cached = cached(&ring(), &TreeCache::at(in_the_way.join("trees")));
    assert_eq!(cached.tree, SphereTree::build(&ring(), &settings()).unwrap());
    assert!(cached.note.is_some_and(|note| note.contains("trees")));
}

#[test]
fn the_oldest_go_first() {
    let folder = Folder::new();
    let boxes: Vec<TriMesh> = (1..=4).map(|n| TriMesh::cuboid(Vec3::repeat(2.0 * f64::from(n)))).collect();
    for mesh in &boxes[..3] {
        cached(mesh, &folder.cache());
        // file times can have a resolution of a few milliseconds
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let size = |files: &[PathBuf]| files.iter().map(|f| fs::metadata(f).unwrap().len()).sum::<u64>();
    let keep_three = folder.cache().with_max_bytes(size(&folder.files()) + 10);
    fs::write(folder.0.join("notes.txt"), "not ours").unwrap();
    cached(&boxes[3], &keep_three);
    assert_eq!(folder.files().len(), 4);
    let found: Vec<bool> = boxes[1..].iter().map(|mesh| cached(mesh, &keep_three).found).collect();
    assert_eq!(found, [true, true, true]);
    assert!(!cached(&boxes[0], &keep_three).found);
}

#[test]
fn unknown_files_are_never_removed() {
    let folder = Folder::new();
    let ours = cached(&TriMesh::cuboid(Vec3::repeat(2.0)), &folder.cache());
    assert!(!ours.found);
    let kept = folder.files();
    let hex = "0123456789abcdef".repeat(4);
    let unfinished = folder.0.join(format!("{hex}.7.1.tmp"));
    let others = [
        "oak.tree".to_owned(),
        "work.tmp".to_owned(),
        format!("{hex}.tree.tmp"),
        format!("{hex}0.tree"),
        format!("{hex}.x.1.tmp"),
        hex.clone(),
    ];
    others.iter().for_each(|name| fs::write(folder.0.join(name), vec![0; 1000]).unwrap());
    fs::write(&unfinished, vec![0; 1000]).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(20));
    cached(&TriMesh::cuboid(Vec3::repeat(4.0)), &folder.cache().with_max_bytes(1));
    assert!(others.iter().all(|name| folder.0.join(name).exists()));
    assert!(!kept[0].exists() && !unfinished.exists());
}

#[test]
fn a_file_instead_of_the_folder_is_reported() {
    let folder = Folder::new();
    std::fs::create_dir_all(&folder.0).unwrap();
    let file = folder.0.join("file");
    std::fs::write(&file, "mine").unwrap();
    let built = cached(&ring(), &TreeCache::at(&file));
    let note = built.note.unwrap();
    assert!(note.starts_with("the tree is not kept in") && !note.contains("rebuilt"), "{note}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");
}
