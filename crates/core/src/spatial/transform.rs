//! Changes of frame [RBDA §2.8] by a rotation and a displacement.
//!
//! ```text
//! frame B has axes R and origin p, both in frame A
//! motion from B to A   ω' = R ω;          v' = R v + p × R ω
//! force  from B to A   n' = R n + p × R f;  f' = R f
//! ```

use super::matrix::Matrix;
use super::motion::{Force, Motion};
use super::scalar::Scalar;
use super::vector::Vector;
use tumble_collide::Pose;

/// The transform from coordinates of frame B to those of frame A.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transform<T = f64> {
    /// `R`: axes of B in A, orthonormal.
    pub rotation: Matrix<T>,
    /// `p`: origin of B in A, m.
    pub position: Vector<T>,
}

impl<T: Scalar> Transform<T> {
    /// Makes the transform of frame B by its axes and its origin in frame A.
    #[inline(always)]
    pub fn new(rotation: Matrix<T>, position: Vector<T>) -> Transform<T> {
        Transform { rotation, position }
    }

    /// Returns the coordinates in A of a motion with coordinates in B.
    #[inline(always)]
    pub fn motion(&self, m: Motion<T>) -> Motion<T> {
        let angular = self.rotation * m.angular;
        Motion { angular, linear: self.rotation * m.linear + self.position.cross(angular) }
    }

    /// Returns the coordinates in A of a force with coordinates in B.
    #[inline(always)]
    pub fn force(&self, f: Force<T>) -> Force<T> {
        Force { torque: self.rotation * f.torque, force: self.rotation * f.force }.from_arm(self.position)
    }

    /// Returns the coordinates in B of a motion with coordinates in A: the inverse of
    /// [`motion`](Self::motion).
    #[inline(always)]
    pub fn motion_back(&self, m: Motion<T>) -> Motion<T> {
        let linear = m.linear - self.position.cross(m.angular);
        Motion { angular: self.rotation.transposed_times(m.angular), linear: self.rotation.transposed_times(linear) }
    }

    /// Returns the coordinates in B of a force with coordinates in A: the inverse of
    /// [`force`](Self::force).
    #[inline(always)]
    pub fn force_back(&self, f: Force<T>) -> Force<T> {
        let torque = f.torque - self.position.cross(f.force);
        Force { torque: self.rotation.transposed_times(torque), force: self.rotation.transposed_times(f.force) }
    }

    /// Returns the transform from C to A, where `inner` is the one from C to B.
    #[inline(always)]
    pub fn then(&self, inner: &Transform<T>) -> Transform<T> {
        Transform { rotation: self.rotation * inner.rotation, position: self.position + self.rotation * inner.position }
    }

    /// Returns the transform from A to B.
    #[inline(always)]
    pub fn inverse(&self) -> Transform<T> {
        let (x, y, z) = (self.rotation.x, self.rotation.y, self.rotation.z);
        let rotation =
            Matrix { x: Vector::new(x.x, y.x, z.x), y: Vector::new(x.y, y.y, z.y), z: Vector::new(x.z, y.z, z.z) };
        Transform { rotation, position: -(rotation * self.position) }
    }
}

impl From<Pose> for Transform<f64> {
    fn from(pose: Pose) -> Transform<f64> {
        Transform {
            rotation: pose.rotation.to_rotation_matrix().into_inner().into(),
            position: pose.translation.vector.into(),
        }
    }
}
