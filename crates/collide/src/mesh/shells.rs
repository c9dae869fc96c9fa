//! Shells (connected pieces) of a closed surface, and the orientation of each.
//!
//! A shell of negative volume is a cavity if it lies within another shell. If it extends outside
//! all others, it is inside out. Then it is reversed, together with the shells that lie wholly
//! within it, whose winding matches it.

use super::TriMesh;
use super::edges::EdgeGroups;
use super::winding::{WindingNumber, solid_angle};
use crate::{UnionFind, Vec3};
use std::f64::consts::PI;

/// Maximum number of faces of a shell that are tested for its position.
const SAMPLES: usize = 32;

/// Returns the shell of each face, counted from 0 in the order of their first faces, and the number
/// of shells. Faces are connected across edges.
pub(crate) fn shells(mesh: &TriMesh, groups: &EdgeGroups) -> (Vec<u32>, usize) {
    let mut sets = UnionFind::new(mesh.triangles.len());
    for pair in groups.iter().flat_map(|group| group.windows(2)) {
        sets.union(pair[0].face as u32, pair[1].face as u32);
    }
    sets.numbered()
}

impl TriMesh {
    /// Reverses shells that are inside out, one by one. Returns their number.
    pub(super) fn orient_shells(&mut self, shell: &[u32], count: usize) -> usize {
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); count];
        shell.iter().enumerate().for_each(|(face, &s)| members[s as usize].push(face));
        let negative: Vec<bool> = members.iter().map(|faces| self.volume_of(faces) < 0.0).collect();
        if !negative.contains(&true) {
            return 0;
        }
        let all = WindingNumber::new(self);
        let outside = |faces: &Vec<usize>| {
            samples(faces).any(|face| {
                let p = self.centroid(face);
                let own: f64 = faces.iter().filter(|&&f| f != face).map(|&f| solid_angle(&p, &self.corners(f))).sum();
                (all.excluding(&p, &[face as u32]) - own / (4.0 * PI)).abs() < 0.5
            })
        };
        let mut inverted: Vec<bool> =
            members.iter().zip(&negative).map(|(faces, negative)| *negative && outside(faces)).collect();
        let inverted_faces: Vec<[u32; 3]> =
            (0..shell.len()).filter(|&f| inverted[shell[f] as usize]).map(|f| self.triangles[f]).collect();
        if inverted_faces.is_empty() {
            return 0;
        }
        let around = WindingNumber::new(&TriMesh { vertices: self.vertices.clone(), triangles: inverted_faces });
        for (s, faces) in members.iter().enumerate().filter(|(s, _)| !negative[*s]) {
            inverted[s] = samples(faces).all(|face| around.at(&self.centroid(face)) < -0.5);
        }
        for (face, triangle) in self.triangles.iter_mut().enumerate() {
            if inverted[shell[face] as usize] {
                triangle.swap(1, 2);
            }
        }
        inverted.iter().filter(|t| **t).count()
    }

    fn centroid(&self, face: usize) -> Vec3 {
        self.corners(face).iter().sum::<Vec3>() / 3.0
    }

    /// Returns the signed volume of faces that enclose a solid, m³.
    fn volume_of(&self, faces: &[usize]) -> f64 {
        let origin = faces.first().map_or(Vec3::zeros(), |&f| self.corners(f)[0]);
        faces.iter().map(|&f| self.corners(f).map(|p| p - origin)).map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum()
    }
}

fn samples(faces: &[usize]) -> impl Iterator<Item = usize> + '_ {
    let step = faces.len().div_ceil(SAMPLES).max(1);
    faces.iter().copied().step_by(step)
}
