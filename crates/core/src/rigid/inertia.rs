//! The inertia of a rigid body and its symmetric root.

use super::BodyError;
use nalgebra::SymmetricEigen;
use tumble_collide::{Mat3, Quat, Vec3};

/// The inertia about the center of mass in body axes, kg·m², and its roots.
#[derive(Clone)]
pub(super) struct Inertia {
    pub tensor: Mat3,
    pub inverse: Mat3,
    /// Symmetric root.
    pub root: Mat3,
    /// Inverse of the root.
    pub inverse_root: Mat3,
    /// Principal moments.
    pub moments: Vec3,
    /// Orientation of the principal axes in the body.
    pub principal: Quat,
}

impl Inertia {
    /// Returns the unit inertia.
    pub fn unit() -> Inertia {
        let (unit, principal) = (Mat3::identity(), Quat::identity());
        Inertia { tensor: unit, inverse: unit, root: unit, inverse_root: unit, moments: Vec3::repeat(1.0), principal }
    }

    /// Checks and factors a tensor; only its symmetric part counts.
    ///
    /// # Errors
    /// [`BodyError::Inertia`].
    pub fn new(tensor: &Mat3) -> Result<Inertia, BodyError> {
        let symmetric = symmetric(tensor);
        let bad = |moments: [f64; 3]| BodyError::Inertia { moments };
        if symmetric.iter().any(|x| !x.is_finite()) {
            return Err(bad([f64::NAN; 3]));
        }
        let (mut axes, moments) = principal_axes(&symmetric);
        let (sum, largest) = (moments.sum(), moments.max());
        if moments.min() <= 0.0 || 2.0 * largest > sum * (1.0 + 1e-9) {
            return Err(bad([moments.x, moments.y, moments.z]));
        }
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        let with = |f: fn(f64) -> f64| axes * Mat3::from_diagonal(&moments.map(f)) * axes.transpose();
        let principal = Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(axes));
        Ok(Inertia {
            tensor: symmetric,
            inverse: with(|i| 1.0 / i),
            root: with(f64::sqrt),
            inverse_root: with(|i| 1.0 / i.sqrt()),
            moments,
            principal,
        })
    }
}

/// Returns the symmetric part.
pub(super) fn symmetric(tensor: &Mat3) -> Mat3 {
    0.5 * (tensor + tensor.transpose())
}

/// Returns eigenvectors (columns) and eigenvalues; a diagonal tensor keeps its own axes.
fn principal_axes(tensor: &Mat3) -> (Mat3, Vec3) {
    let off = tensor.m12.abs().max(tensor.m13.abs()).max(tensor.m23.abs());
    if off <= 1e-14 * tensor.diagonal().amax() {
        return (Mat3::identity(), tensor.diagonal());
    }
    let eigen = SymmetricEigen::new(*tensor);
    (eigen.eigenvectors, eigen.eigenvalues)
}
