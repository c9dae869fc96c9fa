//! The fuzz targets of mesh files, sphere trees and cached shapes, run without a fuzzer: on their seeds, and on these with bytes
//! flipped, replaced by numbers and words, pieces repeated or lost, and ends cut off. `TUMBLE_SLOW=1` runs 200,000 of each.

use crate::rng::Rng;
use serde::Deserialize;
use serde::de::value::SeqDeserializer;
use std::path::Path;
use std::time::Instant;
use tumble_collide::{MeshShape, TreeSettings, TriMesh, Vec3};

#[allow(unused_attributes, unused_imports)]
#[path = "../../../../fuzz/fuzz_targets/cached_shape.rs"]
mod cached_shape;
#[allow(unused_attributes, unused_imports)]
#[path = "../../../../fuzz/fuzz_targets/obj.rs"]
mod obj;
#[allow(unused_attributes, unused_imports)]
#[path = "../../../../fuzz/fuzz_targets/ply.rs"]
mod ply;
#[allow(unused_attributes, unused_imports)]
#[path = "../../../../fuzz/fuzz_targets/sphere_tree.rs"]
mod sphere_tree;
#[allow(unused_attributes, unused_imports)]
#[path = "../../../../fuzz/fuzz_targets/stl.rs"]
mod stl;

/// Words that replace bytes: extreme numbers, numbers in binary, marks of the formats.
const WORDS: [&[u8]; 24] = [
    b"0",
    b"-1",
    b"4294967295",
    b"99999999999",
    b"1e300",
    b"-1e-300",
    b"nan",
    b"inf",
    b"\n",
    b" ",
    b"list",
    b"int",
    b"double",
    b"uchar",
    b"face",
    b"vertex",
    b"tristrips",
    b"[",
    b"}",
    b"null",
    b"\xff\xff\xff\xff",
    b"\x00\x00\x00\x00\x00\x00\xf8\x7f",
    b"\xff\xff\xff\xff\xff\xff\xef\x7f",
    b"\x80",
];

fn changed(seeds: &[Vec<u8>], rng: &mut Rng) -> Vec<u8> {
    let mut bytes = seeds[rng.below(seeds.len())].clone();
    for _ in 0..1 + rng.below(4) {
        if bytes.is_empty() {
            break;
        }
        let at = rng.below(bytes.len());
        let end = (at + 1 + rng.below(12)).min(bytes.len());
        let word = WORDS[rng.below(WORDS.len())];
        match rng.below(8) {
            0 => bytes[at] ^= 1 << rng.below(8),
            1 => bytes[at] = rng.below(256) as u8,
            2 if rng.below(4) == 0 => bytes.truncate(at),
            3 => drop(bytes.splice(at..at, word.iter().copied())),
            4 => drop(bytes.drain(at..end)),
            5 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            6 => {
                // one number of a text for another
                let is_number = |b: &u8| b.is_ascii_digit() || b".-".contains(b);
                let from = bytes[..at].iter().rposition(|b| !is_number(b)).map_or(0, |k| k + 1);
                let to = bytes[at..].iter().position(|b| !is_number(b)).map_or(bytes.len(), |k| at + k);
                let number = [&b"0"[..], b"1", b"2", b"3", b"7", b"-0.5", b"1e9", b"0.25"][rng.below(8)];
                bytes.splice(from..to.max(from), number.iter().copied());
            }
            _ => drop(bytes.splice(at..end, word.iter().copied())),
        }
    }
    bytes
}

/// Runs a target on the seeds of its name and on changed ones. `is_read` says whether an input is read.
fn fuzz(name: &str, target: impl Fn(&[u8]), is_read: impl Fn(&[u8]) -> bool) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(name);
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let seeds: Vec<Vec<u8>> = files.iter().map(|path| std::fs::read(path).unwrap()).collect();
    assert!(seeds.len() > 1 && seeds.iter().all(|seed| is_read(seed)), "{name}");
    let slow = std::env::var_os("TUMBLE_SLOW").is_some_and(|value| value == "1");
    let count = if slow { 200_000 } else { 5000 };
    let (mut rng, mut read, mut longest) = (Rng::new(31), 0, 0.0_f64);
    for n in 0..count {
        let bytes = if n < seeds.len() { seeds[n].clone() } else { changed(&seeds, &mut rng) };
        let start = Instant::now();
        target(&bytes);
        longest = longest.max(start.elapsed().as_secs_f64());
        read += usize::from(is_read(&bytes));
    }
    println!("{name}: {count} inputs, {read} read, at most {longest:.3} s");
    assert!(read > count / 50 && read < count, "{name}: {read} of {count}");
    assert!(longest < 5.0, "{name}: {longest} s for a few hundred bytes");
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn changed_ply_files_give_meshes_or_errors_full_length() {
    fuzz("ply", ply::target, |bytes| tumble_collide::TriMesh::from_ply(bytes).is_ok());
}

#[test]
fn changed_stl_files_give_meshes_or_errors_full_length() {
    fuzz("stl", stl::target, |bytes| tumble_collide::TriMesh::from_stl(bytes).is_ok());
}

#[test]
fn changed_obj_files_give_meshes_or_errors_full_length() {
    fuzz("obj", |bytes| obj::target(&text(bytes)), |bytes| tumble_collide::TriMesh::from_obj(&text(bytes)).is_ok());
}

#[test]
fn changed_sphere_trees_give_trees_or_errors_full_length() {
    let is_read = |bytes: &[u8]| tumble_collide::TreeFile::from_json(&text(bytes)).is_ok();
    fuzz("sphere_tree", |bytes| sphere_tree::target(&text(bytes)), is_read);
}

/// The bytes of a mesh shape without the checksum before them.
fn bytes_of(mesh: TriMesh) -> Vec<u8> {
    let shape = MeshShape::new(mesh, &TreeSettings::octree()).unwrap();
    serde_json::from_slice(&serde_json::to_vec(&shape).unwrap()).unwrap()
}

/// `TUMBLE_KEEP_SEEDS=1` writes the seeds anew, in the present format.
#[test]
fn changed_cached_shapes_give_shapes_or_errors_full_length() {
    if std::env::var_os("TUMBLE_KEEP_SEEDS").is_some() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/cached_shape");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("box"), bytes_of(TriMesh::cuboid(Vec3::new(0.2, 0.4, 0.6)))).unwrap();
        std::fs::write(folder.join("ring"), bytes_of(TriMesh::torus(0.3, 0.1, 5, 4))).unwrap();
    }
    let is_read = |bytes: &[u8]| {
        MeshShape::deserialize(SeqDeserializer::<_, serde::de::value::Error>::new(bytes.iter().copied())).is_ok()
    };
    fuzz("cached_shape", cached_shape::target, is_read);
}
