//! Separating axes of oriented boxes: a test whether two parts stay apart during a step, for pairs
//! with expensive contact queries.
//!
//! ```text
//! s(n) = |n·(c_A − c_B)| − h_A·|R_Aᵀn| − h_B·|R_Bᵀn|        the gap between the boxes along n, from B to A
//! separated if s(n) > the distance that the pair can close along n       for the faces of either, pairs of edges, the line of centers
//! ```

use tumble_collide::{Mat3, Pose, Shape, Vec3};

/// An oriented bounding box of a part. A half-space has no extent and one axis.
pub(crate) struct OrientedBox {
    center: Vec3,
    half: Vec3,
    axes: Mat3,
    bounded: bool,
}

impl OrientedBox {
    pub fn around(shape: &Shape, pose: &Pose) -> OrientedBox {
        let axes = *pose.rotation.to_rotation_matrix().matrix();
        if matches!(shape, Shape::HalfSpace) {
            return OrientedBox { center: pose.translation.vector, half: Vec3::zeros(), axes, bounded: false };
        }
        let own = shape.aabb(&Pose::identity());
        let center = pose.translation.vector + axes * (0.5 * (own.min + own.max));
        OrientedBox { center, half: 0.5 * (own.max - own.min), axes, bounded: true }
    }

    fn extent(&self, n: &Vec3) -> f64 {
        self.axes.tr_mul(n).abs().dot(&self.half)
    }
}

/// Returns whether some unit direction `n`, from B to A, has a gap above `closing(n)`. `false` for
/// two half-spaces.
pub(crate) fn are_separated(a: &OrientedBox, b: &OrientedBox, closing: impl Fn(&Vec3) -> f64) -> bool {
    let off = a.center - b.center;
    let gap = |n: Vec3| {
        let n = if n.dot(&off) < 0.0 { -n } else { n };
        n.dot(&off) - a.extent(&n) - b.extent(&n) > closing(&n)
    };
    match (a.bounded, b.bounded) {
        (true, true) => {
            let faces = a.axes.column_iter().chain(b.axes.column_iter()).map(|n| n.into_owned());
            let edges = a
                .axes
                .column_iter()
                .flat_map(|x| b.axes.column_iter().filter_map(move |y| x.cross(&y).try_normalize(1e-6)));
            off.try_normalize(1e-300).into_iter().chain(faces).chain(edges).any(gap)
        }
        // a half-space extends without bound below its plane
        (true, false) => beyond(b, a, closing(&b.axes.column(2).into_owned())),
        (false, true) => beyond(a, b, closing(&-a.axes.column(2))),
        (false, false) => false,
    }
}

fn beyond(plane: &OrientedBox, body: &OrientedBox, closing: f64) -> bool {
    let n = plane.axes.column(2).into_owned();
    n.dot(&(body.center - plane.center)) - body.extent(&n) > closing
}
