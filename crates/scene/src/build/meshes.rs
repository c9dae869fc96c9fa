//! Builds the meshes of `[meshes.NAME]`.

use std::path::PathBuf;

use tumble_core::collide::{RepairSettings, Shape, ShapeError, TreeCache, TreeSettings, TriMesh, Vec3};

use crate::build::error::BuildError;
use crate::build::grid::read_grid;
use crate::build::heights::{HeightGrid, read_heights};
use crate::build::mesh_files::{make_solid, read_with_lines};
use crate::build::shapes::Purpose;
use crate::build::slow::building_surface;
use crate::notes::Notes;
use crate::open::plain::MAX_FILE_BYTES;
use crate::parse::file::SceneFile;
use crate::parse::mesh::{MeshSource, MeshSpec};
use crate::parse::terrain::{Heights, HullPoints};

impl SceneFile {
    /// Builds a mesh as a solid about its center of mass.
    pub(crate) fn solid(&self, spec: &MeshSpec, purpose: Purpose, notes: &mut Notes) -> Result<Shape, BuildError> {
        let file = spec.source.file().map(PathBuf::from);
        let wrong = |why: String| BuildError::Mesh {
            scene: self.file.clone(),
            mesh: spec.name.clone(),
            file: file.clone(),
            why,
        };
        let (mut mesh, lines) = self.triangles(spec, &wrong)?;
        let mut mesh_notes = match spec.repair {
            true => make_solid(&mut mesh, &lines, Some(&RepairSettings::default())).map_err(&wrong)?,
            false => Vec::new(),
        };
        let mut settings = TreeSettings::octree();
        settings.depth = spec.sphere_tree_depth.unwrap_or(settings.depth);
        settings.error = spec.sphere_tree_max_error.unwrap_or(settings.error);
        let (called, count) = (spec.called(), mesh.triangles.len());
        let made = building_surface(&called, count, || purpose.mesh(mesh, &settings, &TreeCache::of_environment()));
        let (shape, note) = made.map_err(|error| match error {
            ShapeError::Mesh(error) if !spec.repair => wrong(error.at_line(&lines).to_string()),
            error => wrong(error.to_string()),
        })?;
        if let Shape::Mesh(solid) = &shape
            && !spec.repair
        {
            mesh_notes = solid.report().notes();
        }
        notes.extend(mesh_notes.into_iter().map(|note| format!("{}: mesh \"{}\": {note}", self.file, spec.name)));
        notes.extend(note.filter(|note| !notes.contains(note)));
        Ok(shape)
    }

    /// Returns the triangles of a mesh. For formats with lines, also the line of each triangle in
    /// the file.
    fn triangles(
        &self,
        spec: &MeshSpec,
        wrong: &impl Fn(String) -> BuildError,
    ) -> Result<(TriMesh, Vec<usize>), BuildError> {
        let made = match &spec.source {
            MeshSource::File { path, scale } => {
                let (mesh, lines) = self.read_mesh(spec, path, wrong)?;
                return Ok((mesh.scaled(*scale), lines));
            }
            MeshSource::Lathe { profile_m, segments } => {
                let profile: Vec<(f64, f64)> = profile_m.iter().map(|[r, z]| (*r, *z)).collect();
                TriMesh::lathe(&profile, *segments as usize).map_err(|e| wrong(e.to_string()))?
            }
            MeshSource::Torus { radius_m, tube_radius_m, segments, tube_segments } => {
                TriMesh::torus(*radius_m, *tube_radius_m, *segments as usize, *tube_segments as usize)
            }
            MeshSource::Icosphere { radius_m, subdivisions } => TriMesh::icosphere(*radius_m, *subdivisions),
            MeshSource::Cylinder { radius_m, length_m, segments } => {
                TriMesh::cylinder(*radius_m, *length_m, *segments as usize)
            }
            MeshSource::Capsule { radius_m, length_m, segments } => {
                TriMesh::capsule(*radius_m, *length_m, *segments as usize, (*segments as usize / 4).max(2))
            }
            MeshSource::Triangles { mesh } => mesh.as_ref().clone(),
            MeshSource::Box { size_m } => TriMesh::cuboid(Vec3::from(*size_m)),
            MeshSource::ConvexHull(HullPoints::Given(points)) => {
                let points: Vec<Vec3> = points.iter().copied().map(Vec3::from).collect();
                TriMesh::hull_of(&points).map_err(|e| wrong(e.to_string()))?
            }
            MeshSource::ConvexHull(HullPoints::File { path, scale }) => {
                let (mesh, lines) = self.read_mesh(spec, path, wrong)?;
                mesh.scaled(*scale).convex_hull().map_err(|e| wrong(e.at_line(&lines).to_string()))?
            }
            MeshSource::HeightField { heights, size_m, thickness_m } => {
                let grid = self.heights(spec, heights, wrong)?;
                TriMesh::height_field(&grid.heights_m, grid.columns, *size_m, *thickness_m)
                    .map_err(|e| wrong(e.to_string()))?
            }
            MeshSource::Terrain { path, scale, thickness_m } => {
                let (mesh, lines) = self.read_mesh(spec, path, wrong)?;
                mesh.scaled(*scale).terrain(*thickness_m).map_err(|e| wrong(e.at_line(&lines).to_string()))?
            }
            MeshSource::OpenMesh { path, scale, thickness_m, centered } => {
                let (mesh, lines) = self.read_mesh(spec, path, wrong)?;
                let solid = mesh.scaled(*scale).thickened(*thickness_m, *centered);
                solid.map_err(|e| wrong(e.at_line(&lines).to_string()))?
            }
            MeshSource::Sdf { path, low_m, high_m } => {
                let grid = read_grid(&self.read_bytes(spec, path, wrong)?);
                let grid = grid.map_err(|why| wrong(format!("{}: {why}", path.display())))?;
                TriMesh::isosurface_within(&grid.values, grid.counts, Vec3::from(*low_m), Vec3::from(*high_m))
                    .map_err(|e| wrong(e.to_string()))?
            }
        };
        Ok((made, Vec::new()))
    }

    fn heights(
        &self,
        spec: &MeshSpec,
        heights: &Heights,
        wrong: &impl Fn(String) -> BuildError,
    ) -> Result<HeightGrid, BuildError> {
        match heights {
            Heights::Given { heights_m, columns } => Ok(HeightGrid { heights_m: heights_m.clone(), columns: *columns }),
            Heights::File { path, range_m } => {
                read_heights(path, &self.read_bytes(spec, path, wrong)?, *range_m).map_err(wrong)
            }
        }
    }

    fn read_mesh(
        &self,
        spec: &MeshSpec,
        path: &PathBuf,
        wrong: &impl Fn(String) -> BuildError,
    ) -> Result<(TriMesh, Vec<usize>), BuildError> {
        read_with_lines(path, &self.read_bytes(spec, path, wrong)?).map_err(wrong)
    }

    fn read_bytes(
        &self,
        spec: &MeshSpec,
        path: &PathBuf,
        wrong: &impl Fn(String) -> BuildError,
    ) -> Result<Vec<u8>, BuildError> {
        let unread = |source| BuildError::MeshFile {
            scene: self.file.clone(),
            mesh: spec.name.clone(),
            file: path.clone(),
            source,
        };
        let size = std::fs::metadata(path).map_err(unread)?.len();
        if size > MAX_FILE_BYTES {
            return Err(wrong(format!("the file has {size} bytes; the limit is {MAX_FILE_BYTES}")));
        }
        crate::read_file(path).map_err(unread)
    }
}
