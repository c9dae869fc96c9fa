//! A block in the corner of a pit, which meets a wall head-on below its rim: it is as deep as it is in the wall, however near
//! the rim is.

use crate::rng::Rng;
use tumble_collide::{Pose, Quat, Shape, TreeSettings, TriMesh, Vec3, contacts};

const HALF: f64 = 0.05;

fn shape(mesh: &TriMesh) -> Shape {
    Shape::mesh(mesh.clone(), &TreeSettings::octree()).unwrap()
}

/// Returns an angle: the walls x = 0 and y = 0 meet in an inner corner, and end at the rim z = 0.
fn pit() -> TriMesh {
    let outline = [[-1.0, -1.0], [1.0, -1.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [-1.0, 1.0]];
    let at = |z: f64| outline.iter().map(move |[x, y]| Vec3::new(*x, *y, z));
    let mut triangles: Vec<[u32; 3]> = (1..5).flat_map(|k| [[0, k + 1, k], [6, 6 + k, 7 + k]]).collect();
    triangles.extend((0..6).flat_map(|k| [[k, (k + 1) % 6, (k + 1) % 6 + 6], [k, (k + 1) % 6 + 6, k + 6]]));
    TriMesh { vertices: at(-1.0).chain(at(0.0)).collect(), triangles }
}

/// The wall is x = 0. The block reaches below the rim by up to 1 % of the pit's body and leans to the wall by up to a degree,
/// at which its edges along x count as perpendicular to the wall. Near its other side is the wall y = 0.
#[test]
fn a_block_before_a_wall_is_no_deeper_than_it_is_in_the_wall() {
    // at its center of mass, which is the origin of the shape
    let (pit, stands) = (shape(&pit()), Pose::translation(-1.0 / 6.0, -1.0 / 6.0, -0.5));
    let block = shape(&TriMesh::cuboid(Vec3::repeat(2.0 * HALF)));
    let (mut rng, mut found) = (Rng::new(21), Vec::new());
    for case in 0..4000 {
        let turn = Quat::from_scaled_axis(Vec3::new(0.0, rng.between(1e-4, 0.0195), rng.between(-1e-4, 1e-4)));
        let corners = (0..8).map(|k| turn * Vec3::from_fn(|i, _| if k >> i & 1 == 0 { -HALF } else { HALF }));
        let low = corners.fold(Vec3::zeros(), |low, corner| low.inf(&corner));
        // the side that leans to the wall is higher than the other
        let low = Vec3::new(low.x, low.y, (turn * Vec3::repeat(-HALF)).z);
        let gap = [1.0, -1.0][case % 2] * 10f64.powf(rng.between(-12.0, -4.0));
        let pose =
            Pose::from_parts((Vec3::new(gap, rng.between(2e-4, 2e-3), -rng.between(1e-3, 0.02)) - low).into(), turn);
        for first in [true, false] {
            found.clear();
            match first {
                true => contacts(&block, &pose, &pit, &stands, 1e-3, &mut found),
                false => contacts(&pit, &stands, &block, &pose, 1e-3, &mut found),
            }
            let least = found.iter().map(|c| c.gap).fold(f64::INFINITY, f64::min);
            assert!((least - gap).abs() <= 1e-9 + 0.02 * gap.abs(), "case {case}: {least} m, not {gap} m: {found:?}");
        }
    }
}
