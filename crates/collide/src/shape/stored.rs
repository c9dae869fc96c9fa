//! Binary encoding of mesh shapes, for the cache and for archives: the result of the checks, the
//! tree, and the groups of the surface's points.
//!
//! Data that is quick to compute (edges, normals) is computed again, and the cells of fields are
//! built on demand. Input is not trusted: counts are limited by the available bytes, indices must
//! be in range, and nothing may contain itself.

use super::mesh::{MeshShape, Tree};
use crate::bytes::{Reader, Write};
use crate::sdf::Surface;
use crate::{ClosedReport, MassProperties, Mat3, SphereTree, TriMesh};
use std::sync::OnceLock;

impl MeshShape {
    /// Returns the whole shape as bytes; builds its tree and surface if they are not built yet.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut to = Vec::new();
        to.vector(&self.center);
        write_report(&self.report, &mut to);
        self.mesh.write(&mut to);
        self.tree().write(&mut to);
        to.number(self.unit_mass.mass);
        to.vector(&self.unit_mass.center_of_mass);
        self.unit_mass.inertia.iter().for_each(|x| to.number(*x));
        to.list(self.surfaces(), |to, surface| surface.write(to));
        to
    }

    /// Returns `None` if the bytes are not a shape.
    pub(crate) fn of_bytes(bytes: &[u8]) -> Option<MeshShape> {
        let mut from = Reader(bytes);
        let center = from.vector()?;
        let report = read_report(&mut from)?;
        let (mesh, tree) = (TriMesh::read(&mut from)?, SphereTree::read(&mut from)?);
        let (mass, center_of_mass) = (from.number().filter(|m| *m > 0.0)?, from.vector()?);
        let columns = [from.vector()?, from.vector()?, from.vector()?];
        let unit_mass = MassProperties { mass, center_of_mass, inertia: Mat3::from_columns(&columns) };
        let surfaces = from.list(Surface::read)?;
        let (tree, surfaces) = (OnceLock::from(Tree::from(tree)), OnceLock::from(surfaces));
        let shape = MeshShape { tree, surfaces, center, ..MeshShape::of_checked(mesh, unit_mass, report) };
        from.0.is_empty().then_some(shape)
    }
}

fn write_report(report: &ClosedReport, to: &mut Vec<u8>) {
    let ClosedReport { turned, crossing_capped, volume, doubtful, .. } = *report;
    counts(report).for_each(|n| to.size(n));
    to.flag(turned);
    to.flag(crossing_capped);
    to.number(volume);
    to.number(doubtful);
}

fn counts(report: &ClosedReport) -> impl Iterator<Item = usize> {
    let ClosedReport { welded_vertices, degenerate_faces, duplicate_faces, flipped_faces, .. } = *report;
    let ClosedReport { nonmanifold_edges, shells, inverted_shells, crossing_faces, .. } = *report;
    let first = [welded_vertices, degenerate_faces, duplicate_faces, flipped_faces];
    first.into_iter().chain([nonmanifold_edges, shells, inverted_shells, crossing_faces])
}

fn read_report(from: &mut Reader) -> Option<ClosedReport> {
    Some(ClosedReport {
        welded_vertices: from.size()?,
        degenerate_faces: from.size()?,
        duplicate_faces: from.size()?,
        flipped_faces: from.size()?,
        nonmanifold_edges: from.size()?,
        shells: from.size()?,
        inverted_shells: from.size()?,
        crossing_faces: from.size()?,
        turned: from.flag()?,
        crossing_capped: from.flag()?,
        volume: from.number()?,
        doubtful: from.number()?,
    })
}

impl TriMesh {
    pub(crate) fn write(&self, to: &mut Vec<u8>) {
        to.list(&self.vertices, |to, v| to.vector(v));
        to.list(&self.triangles, |to, t| t.iter().for_each(|v| to.u32(*v)));
    }

    /// Returns `None` for a mesh without triangles or with invalid indices.
    pub(crate) fn read(from: &mut Reader) -> Option<TriMesh> {
        let vertices = from.list(Reader::vector)?;
        let triangles = from.list(|from| Some([from.u32()?, from.u32()?, from.u32()?]))?;
        let mesh = TriMesh { vertices, triangles };
        mesh.check_data().is_ok().then_some(mesh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TreeSettings, Vec3};

    fn shapes() -> Vec<TriMesh> {
        let ball = |x: f64| TriMesh::icosphere(0.5, 2).translated(&Vec3::new(x, 0.1, 0.0));
        let mut two = ball(0.0);
        let other = ball(0.6);
        two.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + two.vertices.len() as u32)));
        two.vertices.extend(other.vertices);
        vec![TriMesh::torus(1.0, 0.3, 12, 8), TriMesh::cuboid(Vec3::new(0.2, 0.4, 0.6)), two]
    }

    #[test]
    fn bytes_give_the_same_shape_back() {
        for mesh in shapes() {
            let shape = MeshShape::new(mesh, &TreeSettings::octree()).unwrap();
            let read = MeshShape::of_bytes(&shape.to_bytes()).unwrap();
            // all numbers of all parts, as text that distinguishes all bits
            assert_eq!(format!("{read:?}"), format!("{shape:?}"));
            assert!(!shape.surfaces().is_empty());
        }
    }

    /// Any content with a valid checksum gives a valid shape or none.
    #[test]
    fn no_bytes_are_a_panic() {
        let shape = MeshShape::new(shapes().remove(0), &TreeSettings::octree()).unwrap();
        let good = shape.to_bytes();
        for end in (0..good.len()).step_by(13).chain([good.len() - 1]) {
            assert!(MeshShape::of_bytes(&good[..end]).is_none(), "cut at {end}");
        }
        assert!(MeshShape::of_bytes(&[&good[..], &[0]].concat()).is_none());
        for at in (0..300).chain((300..good.len()).step_by(41)) {
            let mut bad = good.clone();
            bad[at] = [0, 1, 0x7f, 0xff][at % 4];
            if let Some(read) = MeshShape::of_bytes(&bad) {
                read.surfaces().iter().for_each(|s| _ = s.field.nearest(&Vec3::new(1.0, 0.1, 0.2)));
            }
        }
    }
}
