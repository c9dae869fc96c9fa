//! Mesh shapes from the cache: the same contacts to the last bit, and no file is trusted.

use crate::tree_cache::Folder;
use std::fs;
use std::process::Command;
use tumble_collide::{Pose, Quat, Shape, TreeCache, TreeSettings, TriMesh, Vec3, contacts};

/// Returns a ring with bumps: no two of its points are alike.
fn bumpy() -> TriMesh {
    let mut mesh = TriMesh::torus(1.0, 0.35, 40, 20);
    mesh.vertices.iter_mut().for_each(|v| *v *= 1.0 + 0.03 * (7.0 * v.x + 5.0 * v.y + 9.0 * v.z).sin());
    mesh
}

fn cached(mesh: TriMesh, cache: &TreeCache) -> (Shape, Option<String>) {
    Shape::mesh_cached(mesh, &TreeSettings::octree(), cache).unwrap()
}

/// Returns the bits of all contacts of two copies of a shape in many poses, deep, close and apart,
/// and with a sphere, a box and a cylinder, as text.
fn contact_bits(shape: &Shape) -> String {
    let cylinder = Shape::cylinder(0.3, 1.2).unwrap();
    let others =
        [shape.clone(), Shape::sphere(0.3).unwrap(), Shape::cuboid(Vec3::new(0.4, 0.6, 0.8)).unwrap(), cylinder];
    let mut found = Vec::new();
    for n in 0..60 {
        let place = |step: u32, span: f64| span * (f64::from(n * step % 61) / 30.0 - 1.0);
        let turn = Quat::from_euler_angles(place(7, 3.0), place(11, 1.5), place(29, 3.0));
        let pose = Pose::from_parts(Vec3::new(place(1, 2.4), place(17, 1.0), place(23, 0.8)).into(), turn);
        others.iter().for_each(|other| contacts(shape, &Pose::identity(), other, &pose, 0.05, &mut found));
    }
    assert!(found.len() > 300, "{} contacts", found.len());
    format!("{found:?}")
}

#[test]
fn a_shape_from_the_cache_has_the_bits_of_a_fresh_one() {
    let folder = Folder::new();
    let fresh = Shape::mesh(bumpy(), &TreeSettings::octree()).unwrap();
    let expected = contact_bits(&fresh);
    for found in [false, true, true] {
        assert_eq!(folder.files().len(), usize::from(found));
        let (shape, note) = cached(bumpy(), &folder.cache());
        assert_eq!(note, None);
        assert!(fresh.center_of_mass().norm() > 1e-6);
        assert_eq!(shape.center_of_mass(), fresh.center_of_mass());
        assert_eq!((shape.volume(), shape.bounding_radius()), (fresh.volume(), fresh.bounding_radius()));
        assert_eq!(shape.mass_properties(700.0).unwrap(), fresh.mass_properties(700.0).unwrap());
        assert_eq!(shape.aabb(&Pose::identity()), fresh.aabb(&Pose::identity()));
        let (Shape::Mesh(a), Shape::Mesh(b)) = (&shape, &fresh) else { panic!("no meshes") };
        assert_eq!((a, a.report()), (b, b.report()));
        assert!(contact_bits(&shape) == expected, "found: {found}");
        // queried again, and with a copy, after everything was built
        assert!(contact_bits(&shape.clone()) == expected);
    }
}

/// Queries in another order, and from several threads at once, give the same bits.
#[test]
fn contacts_do_not_depend_on_the_order_of_queries() {
    let expected = contact_bits(&Shape::mesh(bumpy(), &TreeSettings::octree()).unwrap());
    let shape = Shape::mesh(bumpy(), &TreeSettings::octree()).unwrap();
    let sphere = Shape::sphere(0.2).unwrap();
    for n in (0..40).rev() {
        let pose = Pose::translation(1.3 - 0.06 * f64::from(n), 0.3, 0.1);
        contacts(&shape, &Pose::identity(), &sphere, &pose, 0.3, &mut Vec::new());
    }
    std::thread::scope(|scope| {
        let each = [(); 4].map(|()| scope.spawn(|| contact_bits(&shape)));
        each.into_iter().for_each(|thread| assert!(thread.join().unwrap() == expected));
    });
}

#[test]
fn repairs_are_reported_from_the_cache_too() {
    let folder = Folder::new();
    let mut mesh = bumpy();
    mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    mesh.triangles[5].swap(0, 1);
    for _ in 0..2 {
        let (shape, ..) = cached(mesh.clone(), &folder.cache());
        let Shape::Mesh(solid) = &shape else { panic!("no mesh") };
        let notes = solid.report().notes();
        assert!(notes.iter().any(|note| note.contains("faces were reversed")), "{notes:?}");
    }
    assert_eq!(folder.files().len(), 1);
}

/// A mesh that is not a solid gives the same error for any content of the cache.
#[test]
fn a_shape_that_cannot_be_built_is_not_cached() {
    let folder = Folder::new();
    let mut mesh = bumpy();
    mesh.triangles.pop();
    let error =
        |cache: &TreeCache| Shape::mesh_cached(mesh.clone(), &TreeSettings::octree(), cache).unwrap_err().to_string();
    assert_eq!(error(&folder.cache()), error(&TreeCache::off()));
    assert!(folder.files().is_empty());
}

#[test]
fn a_damaged_truncated_or_foreign_file_is_reported_and_rebuilt() {
    let folder = Folder::new();
    let small = || TriMesh::torus(1.0, 0.3, 12, 8);
    let (fresh, ..) = cached(small(), &folder.cache());
    let file = folder.files().remove(0);
    let good = fs::read(&file).unwrap();
    let other = Folder::new();
    cached(TriMesh::cuboid(Vec3::repeat(2.0)), &other.cache());
    let mut bad: Vec<Vec<u8>> = vec![Vec::new(), b"\n".to_vec(), fs::read(other.files().remove(0)).unwrap()];
    bad.push([&good[..], b" "].concat());
    bad.push(String::from_utf8_lossy(&good).replacen("shape 1 ", "shape 0 ", 1).into_bytes());
    bad.extend((0..200).step_by(9).chain((200..good.len()).step_by(997)).map(|cut| good[..cut].to_vec()));
    for at in (0..200).step_by(7).chain((200..good.len()).step_by(887)) {
        let mut turned = good.clone();
        turned[at] ^= 1 << (at % 8);
        bad.push(turned);
    }
    for content in bad {
        fs::write(&file, &content).unwrap();
        let (shape, note) = cached(small(), &folder.cache());
        let note = note.expect("the file was trusted");
        assert!(note.starts_with("the cached shape") && note.contains("is rebuilt"), "{note}");
        assert!(matches!((&shape, &fresh), (Shape::Mesh(a), Shape::Mesh(b)) if a == b));
        assert!(fs::read(&file).unwrap() == good, "not mended: {note}");
    }
}

/// A file with a valid checksum that contains no shape.
#[test]
fn a_checksum_alone_is_not_trusted() {
    let folder = Folder::new();
    let small = || TriMesh::torus(1.0, 0.3, 12, 8);
    cached(small(), &folder.cache());
    let file = folder.files().remove(0);
    let good = fs::read(&file).unwrap();
    let name = file.file_stem().unwrap().to_str().unwrap().to_owned();
    for body in [&b""[..], &[0; 1000], &[0xff; 1000]] {
        let checksum = blake3::Hasher::new().update(name.as_bytes()).update(body).finalize().to_hex();
        let head = format!("tumble cached shape 1 {name} {checksum}\n");
        fs::write(&file, [head.as_bytes(), body].concat()).unwrap();
        let note = cached(small(), &folder.cache()).1.unwrap();
        assert!(note.contains("it holds no shape"), "{note}");
        assert!(fs::read(&file).unwrap() == good);
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_a_note_and_the_shape_is_fine() {
    let folder = Folder::new();
    fs::create_dir_all(&folder.0).unwrap();
    // a file instead of the folder: rejected for any user, including root
    let in_the_way = folder.0.join("file");
    fs::write(&in_the_way, "").unwrap();
    let (shape, note) = cached(bumpy(), &TreeCache::at(in_the_way.join("trees")));
    let note = note.unwrap();
    assert!(note.starts_with("the shape is not kept in") && note.contains("trees"), "{note}");
    assert!(contact_bits(&shape) == contact_bits(&Shape::mesh(bumpy(), &TreeSettings::octree()).unwrap()));
}

const ITS_FOLDER: &str = "TUMBLE_TEST_SHAPE_CACHE";

/// Run by the next test in separate processes.
#[test]
#[ignore = "a part of processes_that_write_at_once_leave_one_whole_file"]
fn one_of_several_processes() {
    let folder = std::env::var_os(ITS_FOLDER).expect("run by the test that makes the folder");
    for _ in 0..10 {
        let (_, note) = cached(bumpy(), &TreeCache::at(&folder));
        assert_eq!(note, None);
        fs::read_dir(&folder).unwrap().flatten().map(|e| e.path()).for_each(|f| {
            // all write repeatedly
            if f.extension().is_some_and(|e| e == "shape") {
                _ = fs::remove_file(f);
            }
        });
    }
    cached(bumpy(), &TreeCache::at(&folder));
}

#[test]
fn processes_that_write_at_once_leave_one_whole_file() {
    let folder = Folder::new();
    let child = || {
        Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "--ignored", "shape_cache::one_of_several_processes"])
            .env(ITS_FOLDER, &folder.0)
            .output()
    };
    std::thread::scope(|scope| {
        let children = [(); 3].map(|()| scope.spawn(child));
        for child in children {
            let output = child.join().unwrap().unwrap();
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            assert!(output.status.success() && text.contains("1 passed"), "{text}");
        }
    });
    assert_eq!(folder.files().len(), 1);
    let (shape, note) = cached(bumpy(), &folder.cache());
    assert_eq!(note, None);
    assert!(contact_bits(&shape) == contact_bits(&Shape::mesh(bumpy(), &TreeSettings::octree()).unwrap()));
}
