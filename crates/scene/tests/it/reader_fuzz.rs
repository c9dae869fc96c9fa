//! The fuzz targets of COLLADA documents, height fields and scenes with files, run without a fuzzer: on their seeds, and
//! on these with words and numbers replaced, pieces repeated or lost, and ends cut off. `TUMBLE_SLOW=1` runs 100,000 of each.

use crate::npy::Rng;
use std::path::Path;
use std::time::Instant;
use tumble_scene::{SceneFile, read_heights, read_triangles};

#[allow(unused_attributes, unused_imports)]
#[path = "../../../../fuzz/fuzz_targets/collada.rs"]
mod collada;
#[allow(unused_attributes, unused_imports)]
#[path = "../../../../fuzz/fuzz_targets/scene_files.rs"]
mod scene_files;

const WORDS: [&str; 30] = [
    "0",
    "-1",
    "1",
    "2",
    "0.5",
    "4294967295",
    "1e300",
    "-1e-300",
    "1e-9",
    "1e9",
    "nan",
    "inf",
    "true",
    "#g",
    "#a",
    "#b",
    "node",
    "p",
    "instance_node",
    "instance_geometry",
    "[",
    "]",
    "\"",
    "{",
    "}",
    "<",
    "/>",
    "mesh",
    "\"map.png\"",
    "[0.0, 1.0]",
];

/// Returns the text of a seed with one to four changes at words.
fn changed(seeds: &[Vec<u8>], rng: &mut Rng) -> Vec<u8> {
    let mut bytes = seeds[rng.below(seeds.len())].clone();
    for _ in 0..1 + rng.below(4) {
        let is_mark = |b: &u8| b" \"<>=[],\n".contains(b);
        let marks: Vec<usize> = (0..bytes.len()).filter(|k| is_mark(&bytes[*k])).collect();
        if marks.len() < 2 {
            break;
        }
        let k = rng.below(marks.len() - 1);
        let (from, to) = (marks[k] + 1, marks[k + 1]);
        let further = marks[(k + 1 + rng.below(12)).min(marks.len() - 1)].max(from);
        let word = WORDS[rng.below(WORDS.len())].as_bytes();
        match rng.below(9) {
            0..4 => drop(bytes.splice(from..to, word.iter().copied())),
            4 => drop(bytes.drain(from..to)),
            5 => drop(bytes.drain(from..further)),
            6 => {
                let piece = bytes[from..further].to_vec();
                bytes.splice(from..from, piece);
            }
            7 if rng.below(8) == 0 => bytes.truncate(from),
            _ => bytes[from.min(to)] ^= 1 << rng.below(8),
        }
    }
    bytes
}

fn seeds(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(name);
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

fn fuzz(name: &str, normally: usize, target: impl Fn(&[u8]), is_read: impl Fn(&[u8]) -> bool) {
    let seeds = seeds(name);
    assert!(seeds.len() > 1);
    let slow = std::env::var_os("TUMBLE_SLOW").is_some_and(|value| value == "1");
    let count = if slow { 100_000 } else { normally };
    let (mut rng, mut read, mut longest) = (Rng(5), 0, 0.0_f64);
    for n in 0..count {
        let bytes = if n < seeds.len() { seeds[n].clone() } else { changed(&seeds, &mut rng) };
        let start = Instant::now();
        target(&bytes);
        longest = longest.max(start.elapsed().as_secs_f64());
        read += usize::from(is_read(&bytes));
        assert!(n >= seeds.len() || read == n + 1, "{name}: seed {n} is refused");
    }
    println!("{name}: {count} inputs, {read} read, at most {longest:.3} s");
    assert!(read > count / 50 && read < count, "{name}: {read} of {count}");
    assert!(longest < 5.0, "{name}: {longest} s for a few hundred bytes");
}

#[test]
fn changed_collada_documents_give_meshes_or_errors_full_length() {
    fuzz("collada", 5000, collada::target, |bytes| read_triangles(Path::new("a.dae"), bytes).is_ok());
}

#[test]
fn changed_height_fields_give_grids_or_errors_full_length() {
    let read = |bytes: &[u8], name: &str| read_heights(Path::new(name), bytes, [-1.0, 2.0]).is_ok();
    let target = |bytes: &[u8]| _ = (read(bytes, "map.png"), read(bytes, "map.txt"));
    fuzz("heights", 5000, target, |bytes| read(bytes, "map.png") || read(bytes, "map.txt"));
}

/// In a process of its own, in which no sphere tree is kept on disk.
#[test]
fn changed_scenes_with_files_give_worlds_or_errors_full_length() {
    if std::env::var_os("TUMBLE_CACHE").is_none_or(|value| value != "off") {
        let name = "reader_fuzz::changed_scenes_with_files_give_worlds_or_errors_full_length";
        let mut again = std::process::Command::new(std::env::current_exe().unwrap());
        let done = again.args([name, "--exact", "--nocapture"]).env("TUMBLE_CACHE", "off").output().unwrap();
        let said = String::from_utf8_lossy(&done.stdout);
        println!("{said}{}", String::from_utf8_lossy(&done.stderr));
        assert!(done.status.success() && said.contains("1 passed"), "the test in a process of its own");
        return;
    }
    let target = |bytes: &[u8]| scene_files::target(&String::from_utf8_lossy(bytes));
    let is_read = |bytes: &[u8]| SceneFile::parse(&String::from_utf8_lossy(bytes), &scene_files::file()).is_ok();
    fuzz("scene_files", 2000, target, is_read);
    std::fs::remove_dir_all(scene_files::folder()).unwrap();
}

/// Nodes that instance each other twice at each depth, or a large geometry: small documents with more nodes or triangles
/// than memory or time has.
#[test]
fn documents_that_instance_themselves_end() {
    let cube = String::from_utf8(seeds("collada").remove(0)).unwrap();
    let read = |text: &str| {
        let start = Instant::now();
        let read = read_triangles(Path::new("a.dae"), text.as_bytes());
        assert!(start.elapsed().as_secs_f64() < 5.0);
        read.unwrap_err()
    };
    let nested = |geometry: &str| {
        let nodes: String = (0..60)
            .map(|k| {
                format!("<node id=\"n{k}\"><instance_node url=\"#n{0}\"/><instance_node url=\"#n{0}\"/></node>", k + 1)
            })
            .collect();
        let nodes =
            format!("<library_nodes>{nodes}<node id=\"n60\">{geometry}</node></library_nodes><library_visual_scenes>");
        let start = "<instance_node url=\"#n0\"/>";
        cube.replacen("<instance_geometry url=\"#g\"/>", start, 1).replacen("<library_visual_scenes>", &nodes, 1)
    };
    let said = read(&nested(""));
    assert!(said.contains("more than") && said.contains("nodes"), "{said}");
    let said = read(&nested("<instance_geometry url=\"#g\"/>"));
    assert!(said.contains("more than"), "{said}");
    let own = cube.replacen(
        "<instance_geometry url=\"#g\"/>",
        "<node id=\"o\"><instance_node url=\"#o\"/><instance_node url=\"#o\"/></node>",
        1,
    );
    let said = read(&own);
    assert!(said.contains("nested more than 64 deep") || said.contains("nodes"), "{said}");
}
