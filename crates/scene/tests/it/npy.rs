//! NumPy files: what mutations of good ones give is an error or a grid of the announced size, never a panic.

use std::path::Path;
use tumble_core::collide::{TriMesh, Vec3};
use tumble_scene::read_grid;

/// A generator of random numbers (xorshift).
pub(crate) struct Rng(pub u64);

impl Rng {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// The header and the numbers after it; the numbers of the larger seeds are mostly left alone.
fn mutated(seed: &[u8], rng: &mut Rng) -> Vec<u8> {
    const WORDS: [&[u8]; 8] = [b"99999999999", b"-1", b"(", b")", b",", b"True", b"'<f4'", b"\xff"];
    let mut bytes = seed.to_vec();
    for _ in 0..1 + rng.below(4) {
        let header = if rng.below(4) == 0 { bytes.len() } else { bytes.len().min(80) };
        let at = rng.below(header);
        match rng.below(5) {
            0 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << rng.below(8)),
            1 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = rng.below(256) as u8),
            2 => bytes.truncate(rng.below(bytes.len() + 1)),
            3 => drop(bytes.splice(at..at, WORDS[rng.below(WORDS.len())].iter().copied())),
            _ => {
                let end = (at + 1 + rng.below(8)).min(bytes.len());
                drop(bytes.splice(at.min(end)..end, WORDS[rng.below(WORDS.len())].iter().copied()));
            }
        }
    }
    bytes
}

#[test]
fn npy_mutations_give_errors_or_grids() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/npy");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let seeds: Vec<Vec<u8>> = files.iter().map(|path| std::fs::read(path).unwrap()).collect();
    assert_eq!(seeds.iter().filter(|seed| read_grid(seed).is_ok()).count(), 2);
    let count = if std::env::var_os("TUMBLE_SLOW").is_some() { 300_000 } else { 20_000 };
    let (mut rng, mut grids, mut solids) = (Rng(7), 0, 0);
    for n in 0..count {
        let Ok(grid) = read_grid(&mutated(&seeds[n % seeds.len()], &mut rng)) else { continue };
        assert_eq!(grid.values.len(), grid.counts.iter().product::<usize>());
        grids += 1;
        let corner = Vec3::repeat(1.0);
        if grid.values.len() <= 4096
            && let Ok(mut mesh) = TriMesh::isosurface_within(&grid.values, grid.counts, -corner, corner)
        {
            solids += usize::from(mesh.check_closed().is_ok());
        }
    }
    println!("{count} mutations: {grids} grids, {solids} solids");
    assert!(grids > count / 50 && solids > 0, "{grids} grids, {solids} solids of {count}");
}
