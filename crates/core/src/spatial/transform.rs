//! Changes of frame [RBDA §2.8], by a rotation and a displacement.
//!
//! ```text
//! frame B has axes R and origin p, both seen from frame A
//! motion of B seen in A   ω' = R ω;          v' = R v + p × R ω
//! force  of B seen in A   n' = R n + p × R f;  f' = R f
//! ```

use super::matrix::Matrix;
use super::motion::{Force, Motion};
use super::scalar::Scalar;
use super::vector::Vector;
use tumble_collide::Pose;

/// How what is seen in frame B looks from frame A.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Transform<T = f64> {
    /// `R`: axes of B in A, orthonormal.
    pub rotation: Matrix<T>,
    /// `p`: origin of B in A, metres.
    pub position: Vector<T>,
}

impl<T: Scalar> Transform<T> {
    /// Frame B by its axes and its origin in frame A.
    #[inline(always)]
    pub fn new(rotation: Matrix<T>, position: Vector<T>) -> Transform<T> {
        Transform { rotation, position }
    }

    /// The motion of B's coordinates in those of A.
    #[inline(always)]
    pub fn motion(&self, m: Motion<T>) -> Motion<T> {
        let angular = self.rotation * m.angular;
        Motion { angular, linear: self.rotation * m.linear + self.position.cross(angular) }
    }

    /// The force of B's coordinates in those of A.
    #[inline(always)]
    pub fn force(&self, f: Force<T>) -> Force<T> {
        Force { torque: self.rotation * f.torque, force: self.rotation * f.force }.from_arm(self.position)
    }

    /// The motion of A's coordinates in those of B: the inverse of [`motion`](Self::motion).
    #[inline(always)]
    pub fn motion_back(&self, m: Motion<T>) -> Motion<T> {
        let linear = m.linear - self.position.cross(m.angular);
        Motion { angular: self.rotation.transposed_times(m.angular), linear: self.rotation.transposed_times(linear) }
    }

    /// The force of A's coordinates in those of B: the inverse of [`force`](Self::force).
    #[inline(always)]
    pub fn force_back(&self, f: Force<T>) -> Force<T> {
        let torque = f.torque - self.position.cross(f.force);
        Force { torque: self.rotation.transposed_times(torque), force: self.rotation.transposed_times(f.force) }
    }

    /// Frame C seen from A, where `inner` is C seen from B.
    #[inline(always)]
    pub fn then(&self, inner: &Transform<T>) -> Transform<T> {
        Transform { rotation: self.rotation * inner.rotation, position: self.position + self.rotation * inner.position }
    }

    /// A seen from B.
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
