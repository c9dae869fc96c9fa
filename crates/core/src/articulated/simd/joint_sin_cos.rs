//! Sines and cosines of all revolute joints of one state, computed in SIMD lanes if the processor
//! has them. The bits do not depend on the number of lanes.

use crate::articulated::model::compiled::{Compiled, JointKind};
use crate::articulated::simd::lanes::Register;
#[cfg(target_arch = "x86_64")]
use crate::articulated::simd::lanes::{Eight, Four};

/// Sines and cosines of the revolute joints, by link number.
#[derive(Clone, Debug)]
pub(in crate::articulated) struct JointSinCos {
    /// Link and position number of each revolute joint.
    revolute_joints: Vec<(usize, usize)>,
    /// Sine and cosine by link; unused for other joints.
    turns: Vec<(f64, f64)>,
}

impl JointSinCos {
    pub fn new(compiled: &Compiled) -> JointSinCos {
        let revolute_joints =
            compiled.bodies.iter().enumerate().filter(|(_, b)| b.kind == JointKind::Revolute).map(|(i, b)| (i, b.q));
        JointSinCos { revolute_joints: revolute_joints.collect(), turns: vec![(0.0, 1.0); compiled.bodies.len()] }
    }

    /// Computes and returns all sines and cosines for the positions `q`.
    #[inline(always)]
    pub fn take(&mut self, q: &[f64]) -> &[(f64, f64)] {
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(token) = pulp::x86::V4::try_new() {
                token.vectorize(VectorizedFill::<Eight> { token, joint_sin_cos: self, q });
                return &self.turns;
            }
            if let Some(token) = pulp::x86::V3::try_new() {
                token.vectorize(VectorizedFill::<Four> { token, joint_sin_cos: self, q });
                return &self.turns;
            }
        }
        self.fill::<f64, 1>((), q);
        &self.turns
    }

    /// Computes `N` joints at a time; the last group is filled with angles of 0.
    #[inline(always)]
    fn fill<T: Register, const N: usize>(&mut self, token: T::Token, q: &[f64]) {
        for revolute_joints in self.revolute_joints.chunks(N) {
            let mut angles = [0.0; N];
            for (angle, &(_, k)) in angles.iter_mut().zip(revolute_joints) {
                *angle = q[k];
            }
            let (sin, cos) = T::load(token, &angles).sin_cos();
            let (mut joint_sin_cos, mut cosines) = ([0.0; N], [0.0; N]);
            sin.store(&mut joint_sin_cos);
            cos.store(&mut cosines);
            for (&(link, _), turn) in revolute_joints.iter().zip(joint_sin_cos.into_iter().zip(cosines)) {
                self.turns[link] = turn;
            }
        }
    }
}

/// A call of [`JointSinCos::fill`] that is compiled for the instruction set of its caller.
#[cfg(target_arch = "x86_64")]
struct VectorizedFill<'a, T: Register> {
    token: T::Token,
    joint_sin_cos: &'a mut JointSinCos,
    q: &'a [f64],
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for VectorizedFill<'_, Four> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.joint_sin_cos.fill::<Four, 4>(self.token, self.q);
    }
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for VectorizedFill<'_, Eight> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.joint_sin_cos.fill::<Eight, 8>(self.token, self.q);
    }
}
