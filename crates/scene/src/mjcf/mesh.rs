//! Meshes of a model: MuJoCo's own file format, and the mass of a mesh as MuJoCo computes it.
//!
//! Each triangle and an apex span a tetrahedron of volume `V = (c − o)·n·A/3`. The sums need no closed
//! surface. By default MuJoCo adds `|V|` and so counts parts of a mesh that is not convex twice; models
//! are made for these numbers, so they are reproduced.
//!
//! ```text
//! center     Σ V·(¾c + ¼o)/Σ V        apex o: the center of the surface
//! ∫ x xᵀ     Σ V/20·(s sᵀ + a aᵀ + b bᵀ + d dᵀ)     apex: the center of mass, s = a + b + d
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `a`, `b`, `d` | corners of a triangle |
//! | `c`, `n`, `A` | its center, unit normal and area |
//! | `o` | the apex |

use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Mat3, TriMesh, Vec3};

/// How the volume of a mesh is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Volume {
    /// Tetrahedra about the center, all positive.
    Positive,
    /// Signed tetrahedra: exact for a closed mesh.
    Signed,
    /// The convex hull.
    Hull,
}

/// Returns the mass of a mesh at density 1. Errors are sentences without the mesh's name.
pub(super) fn mass(mesh: &TriMesh, volume: Volume) -> Result<LinkMass, String> {
    mesh.check_data().map_err(|e| e.to_string())?;
    let hull = match volume {
        Volume::Hull => Some(hull(mesh)?),
        _ => None,
    };
    let mesh = hull.as_ref().unwrap_or(mesh);
    let signed = |v: f64| if volume == Volume::Positive { v.abs() } else { v };
    let triangles = || (0..mesh.triangles.len()).map(|t| mesh.corners(t));
    let middle = |[a, b, d]: [Vec3; 3]| (a + b + d) / 3.0;
    let (mut area, mut apex) = (0.0, Vec3::zeros());
    for [a, b, d] in triangles() {
        let own = (b - a).cross(&(d - a)).norm();
        area += own;
        apex += own * middle([a, b, d]);
    }
    if area == 0.0 {
        return Err("its area is 0".into());
    }
    apex /= area;
    let (mut total, mut center) = (0.0, Vec3::zeros());
    for [a, b, d] in triangles() {
        let v = signed((a - apex).dot(&(b - a).cross(&(d - a))) / 6.0);
        total += v;
        center += v * (0.75 * middle([a, b, d]) + 0.25 * apex);
    }
    if !(total > 0.0 && total.is_finite()) {
        return Err(format!("its volume is {total:e} m³; expected a positive one, with triangles wound outwards"));
    }
    center /= total;
    let (mut mass, mut second) = (0.0, Mat3::zeros());
    for corners in triangles() {
        let [a, b, d] = corners.map(|p| p - center);
        let v = signed(a.dot(&b.cross(&d)) / 6.0);
        let s = a + b + d;
        mass += v;
        second += (s * s.transpose() + a * a.transpose() + b * b.transpose() + d * d.transpose()) * (v / 20.0);
    }
    let inertia = Mat3::from_diagonal_element(second.trace()) - second;
    Ok(LinkMass { mass, center, inertia })
}

/// Returns the convex hull, with the vertices of the mesh where that is quick: those of
/// [`TriMesh::convex_hull`] are rounded.
pub(super) fn hull(mesh: &TriMesh) -> Result<TriMesh, String> {
    const MOST: usize = 10_000_000;
    let mut hull = mesh.convex_hull().map_err(|e| e.to_string())?;
    if hull.vertices.len().saturating_mul(mesh.vertices.len()) <= MOST {
        for vertex in &mut hull.vertices {
            let distance = |v: &&Vec3| (*v - *vertex).norm_squared();
            let nearest = mesh.vertices.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            *vertex = nearest.copied().unwrap_or(*vertex);
        }
    }
    Ok(hull)
}

/// Reads MuJoCo's own format: the numbers of vertices, normals, texture coordinates and triangles as
/// `i32`, then these as `f32` and `i32`, little-endian.
pub(super) fn read_msh(bytes: &[u8]) -> Result<TriMesh, String> {
    let word = |k: usize| bytes.get(4 * k..4 * k + 4).and_then(|b| b.try_into().ok());
    let integer = |k: usize| word(k).map(i32::from_le_bytes).ok_or("it ends too early");
    let mut counts = [0; 4];
    for (k, count) in counts.iter_mut().enumerate() {
        *count = usize::try_from(integer(k)?).map_err(|_| "a count is negative")?;
    }
    let [vertices, normals, coordinates, triangles] = counts;
    let words = [(3, vertices), (3, normals), (2, coordinates), (3, triangles)];
    let expected = words.iter().try_fold(4_usize, |sum, (width, n)| sum.checked_add(n.checked_mul(*width)?));
    if expected.and_then(|words| words.checked_mul(4)) != Some(bytes.len()) {
        return Err(format!("it has {} bytes, which its four counts contradict", bytes.len()));
    }
    let number = |k: usize| f64::from(word(k).map_or(0.0, f32::from_le_bytes));
    let first = 4 + 3 * vertices + 3 * normals + 2 * coordinates;
    let vertex = |k: usize| Vec3::new(number(4 + 3 * k), number(5 + 3 * k), number(6 + 3 * k));
    let corner = |k: usize| u32::try_from(integer(k)?).map_err(|_| "an index is negative");
    let triangle = |t: usize| -> Result<[u32; 3], &str> {
        let k = first + 3 * t;
        Ok([corner(k)?, corner(k + 1)?, corner(k + 2)?])
    };
    let triangles = (0..triangles).map(triangle).collect::<Result<Vec<_>, _>>()?;
    let mesh = TriMesh { vertices: (0..vertices).map(vertex).collect(), triangles };
    Ok(with_triangles(mesh))
}

/// Returns the mesh with a triangle on each vertex if it has none, so that its hull is that of the
/// vertices.
pub(super) fn with_triangles(mut mesh: TriMesh) -> TriMesh {
    if mesh.triangles.is_empty() {
        mesh.triangles = (0..mesh.vertices.len() as u32).map(|k| [k; 3]).collect();
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of 2 m with a mass of 8 kg: `I = m·(2² + 2²)/12`.
    #[test]
    fn all_volumes_of_a_cube_are_the_same() {
        let cube = TriMesh::cuboid(Vec3::new(2.0, 2.0, 2.0)).translated(&Vec3::new(3.0, 0.0, 1.0));
        for volume in [Volume::Positive, Volume::Signed, Volume::Hull] {
            let mass = mass(&cube, volume).unwrap();
            assert!((mass.mass - 8.0).abs() < 1e-12 && (mass.center - Vec3::new(3.0, 0.0, 1.0)).norm() < 1e-12);
            assert!((mass.inertia - Mat3::from_diagonal_element(16.0 / 3.0)).amax() < 1e-12, "{}", mass.inertia);
        }
    }

    #[test]
    fn a_msh_file_is_read_and_a_damaged_one_is_an_error() {
        let mut bytes: Vec<u8> = [4, 0, 0, 0].iter().flat_map(|n: &i32| n.to_le_bytes()).collect();
        let points = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0_f32];
        bytes.extend(points.iter().flat_map(|x| x.to_le_bytes()));
        let solid = hull(&read_msh(&bytes).unwrap()).unwrap();
        assert!((mass(&solid, Volume::Signed).unwrap().mass - 1.0 / 6.0).abs() < 1e-15);
        (0..bytes.len()).for_each(|end| drop(read_msh(&bytes[..end]).unwrap_err()));
        bytes[0] = 255;
        bytes[3] = 127;
        assert!(read_msh(&bytes).unwrap_err().contains("counts"));
    }
}
