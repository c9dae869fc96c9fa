//! The vertex of a mesh that is farthest in a direction, by its groups.

use super::{Elements, Group, MAX_CHILDREN};
use crate::Vec3;
use arrayvec::ArrayVec;

/// Number of vertices up to which all are compared.
const FEW: usize = 64;

impl Elements {
    /// Returns the vertex that is farthest along `n`, the first of several in their order; the origin
    /// if there is none.
    pub fn support(&self, n: &Vec3) -> Vec3 {
        let mut best = (f64::NEG_INFINITY, usize::MAX);
        if self.points.len() <= FEW {
            for (index, point) in self.points.iter().enumerate() {
                let height = point.at.dot(n);
                best = if height > best.0 { (height, index) } else { best };
            }
        } else if let Some(all) = self.groups.first() {
            self.search_support(all, n, &mut best);
        }
        self.points.get(best.1).map_or(Vec3::zeros(), |point| point.at)
    }

    /// Searches a group; `best` is the height along `n` and the index of the best vertex so far.
    fn search_support(&self, group: &Group, n: &Vec3, best: &mut (f64, usize)) {
        if !group.has_children {
            for (index, point) in self.points_of(group).iter().enumerate() {
                let (height, index) = (point.at.dot(n), group.first as usize + index);
                if height > best.0 || (height == best.0 && index < best.1) {
                    *best = (height, index);
                }
            }
            return;
        }
        let length = n.norm();
        for children in self.children_of(group).chunks(MAX_CHILDREN) {
            let bound = |child: &Group| child.center().dot(n) + child.reach(true) * length;
            let mut bounds: ArrayVec<(f64, &Group), MAX_CHILDREN> = children.iter().map(|c| (bound(c), c)).collect();
            bounds.sort_unstable_by(|x, y| y.0.total_cmp(&x.0));
            for (bound, child) in bounds {
                if bound >= best.0 {
                    self.search_support(child, n, best);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::sdf::Surface;
    use crate::{SphereTree, TreeSettings, TriMesh, Vec3};

    #[test]
    fn the_farthest_vertex_is_that_of_all_vertices() {
        let heights: Vec<f64> = (0..900_u32).map(|n| f64::from(n.wrapping_mul(2_654_435_761) >> 24) / 256.0).collect();
        let meshes = [
            TriMesh::cuboid(Vec3::new(1.0, 2.0, 3.0)),
            TriMesh::torus(1.0, 0.3, 32, 16),
            TriMesh::height_field(&heights, 30, [8.0, 8.0], None).unwrap(),
        ];
        for mesh in meshes {
            let surface = Surface::new(&mesh, &SphereTree::build(&mesh, &TreeSettings::octree()).unwrap());
            let points: Vec<Vec3> = surface.elements.points.iter().map(|point| point.at).collect();
            for k in 0..500 {
                let angles = [f64::from(k) * 0.7, f64::from(k) * 0.0123 - 3.0];
                let n = match k {
                    // ties
                    0..3 => Vec3::ith(k as usize, 1.0),
                    3..6 => Vec3::ith(k as usize - 3, -1.0),
                    _ => {
                        Vec3::new(angles[0].cos() * angles[1].sin(), angles[0].sin() * angles[1].sin(), angles[1].cos())
                    }
                };
                let first = points.iter().fold((f64::NEG_INFINITY, Vec3::zeros()), |best, p| {
                    if p.dot(&n) > best.0 { (p.dot(&n), *p) } else { best }
                });
                assert_eq!(surface.elements.support(&n), first.1, "{n:?}");
            }
        }
    }
}
