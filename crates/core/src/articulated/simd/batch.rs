//! Forward dynamics of many states of one model in parallel: the sweeps of
//! [`abm`](crate::articulated::algorithms::abm) with one state per lane.
//!
//! A lane has the bits of [`forward_dynamics`](crate::articulated::forward_dynamics) for that
//! state, on every processor. Processors differ only in the number of lanes per instruction.

use crate::articulated::algorithms::abm::{Input, Sweep};
use crate::articulated::algorithms::singular::SingularJoint;
use crate::articulated::model::Model;
use crate::articulated::model::compiled::Compiled;
#[cfg(target_arch = "x86_64")]
use crate::articulated::simd::lanes::{Eight, Four};
use crate::articulated::simd::lanes::{Lanes, Register};
use tumble_collide::Vec3;

/// A model prepared for `N` states at a time. It is fast if `N` fills registers: a multiple of 8 on
/// processors with AVX-512, of 4 on those with AVX2. Otherwise the states are computed one by one.
#[derive(Clone, Debug)]
pub struct BatchDynamics<const N: usize> {
    compiled: Compiled,
    width: SimdWidth,
}

/// The register width in use, with the proof that the processor supports it.
#[derive(Clone, Debug)]
enum SimdWidth {
    One(Sweep<f64>),
    #[cfg(target_arch = "x86_64")]
    Four(pulp::x86::V3, Sweep<Four>),
    #[cfg(target_arch = "x86_64")]
    Eight(pulp::x86::V4, Sweep<Eight>),
}

impl<const N: usize> BatchDynamics<N> {
    /// Prepares a model. No later call allocates memory.
    pub fn new(model: &Model) -> BatchDynamics<N> {
        let compiled = Compiled::new(model);
        BatchDynamics { width: SimdWidth::best(&compiled, N), compiled }
    }

    /// Prepares a model for computation of one state at a time, as on a processor without SIMD:
    /// slower, with the same bits.
    pub fn plain(model: &Model) -> BatchDynamics<N> {
        let compiled = Compiled::new(model);
        BatchDynamics { width: SimdWidth::One(Sweep::new(&compiled, 0.0)), compiled }
    }

    /// Writes `q̈` of every lane for its `q`, `v` and joint forces `tau`, in uniform gravity, m/s².
    /// Lengths are `positions` and `dof` of the model, with one state per lane.
    ///
    /// # Errors
    /// [`SingularJoint`] if the mass matrix of a lane is singular: the first lane, and its first link. All of `qdd` is
    /// written, with the axes held that meet no inertia.
    pub fn forward_dynamics(
        &mut self,
        gravity: &Vec3,
        q: &[Lanes<N>],
        v: &[Lanes<N>],
        tau: &[Lanes<N>],
        qdd: &mut [Lanes<N>],
    ) -> Result<(), SingularJoint> {
        let call = Call { compiled: &self.compiled, gravity, q, v, tau, qdd };
        match &mut self.width {
            SimdWidth::One(sweep) => call.run((), sweep),
            #[cfg(target_arch = "x86_64")]
            SimdWidth::Four(token, sweep) => token.vectorize(VectorizedCall { call, token: *token, sweep }),
            #[cfg(target_arch = "x86_64")]
            SimdWidth::Eight(token, sweep) => token.vectorize(VectorizedCall { call, token: *token, sweep }),
        }
    }
}

impl SimdWidth {
    fn best(compiled: &Compiled, lanes: usize) -> SimdWidth {
        #[cfg(target_arch = "x86_64")]
        {
            if let (0, Some(token)) = (lanes % Eight::LANES, pulp::x86::V4::try_new()) {
                return SimdWidth::Eight(token, Sweep::new(compiled, Eight::load(token, &[0.0; Eight::LANES])));
            }
            if let (0, Some(token)) = (lanes % Four::LANES, pulp::x86::V3::try_new()) {
                return SimdWidth::Four(token, Sweep::new(compiled, Four::load(token, &[0.0; Four::LANES])));
            }
        }
        let _ = lanes;
        SimdWidth::One(Sweep::new(compiled, 0.0))
    }
}

/// Arguments of a call.
struct Call<'a, const N: usize> {
    compiled: &'a Compiled,
    gravity: &'a Vec3,
    q: &'a [Lanes<N>],
    v: &'a [Lanes<N>],
    tau: &'a [Lanes<N>],
    qdd: &'a mut [Lanes<N>],
}

impl<const N: usize> Call<'_, N> {
    /// Computes one register of lanes after the other.
    #[inline(always)]
    fn run<T: Register>(self, token: T::Token, sweep: &mut Sweep<T>) -> Result<(), SingularJoint> {
        let Call { compiled, gravity, q, v, tau, qdd } = self;
        let mut held: Option<SingularJoint> = None;
        for first in (0..N).step_by(T::LANES) {
            sweep.run(compiled, gravity, &LaneInput::<T, N> { token, first, q, v, tau }, |k, x| {
                x.store(&mut qdd[k].0[first..])
            });
            sweep.inverses(compiled, |link, inverse| {
                let mut lanes = [1.0; N];
                inverse.store(&mut lanes[first..]);
                let at = lanes.iter().position(|x| *x == 0.0);
                if let Some(lane) = at.filter(|lane| held.is_none_or(|held| *lane < held.lane)) {
                    held = Some(SingularJoint { lane, link });
                }
            });
        }
        held.map_or(Ok(()), Err)
    }
}

/// Input of a sweep: a register of lanes, from lane `first` on.
struct LaneInput<'a, T: Register, const N: usize> {
    token: T::Token,
    first: usize,
    q: &'a [Lanes<N>],
    v: &'a [Lanes<N>],
    tau: &'a [Lanes<N>],
}

impl<T: Register, const N: usize> Input<T> for LaneInput<'_, T, N> {
    #[inline(always)]
    fn joint_angle_sin_cos(&self, _: usize, q: usize) -> (T, T) {
        self.q(q).sin_cos()
    }
    #[inline(always)]
    fn q(&self, k: usize) -> T {
        T::load(self.token, &self.q[k].0[self.first..])
    }
    #[inline(always)]
    fn v(&self, k: usize) -> T {
        T::load(self.token, &self.v[k].0[self.first..])
    }
    #[inline(always)]
    fn tau(&self, k: usize) -> T {
        T::load(self.token, &self.tau[k].0[self.first..])
    }
}

/// A call that is compiled for the instruction set of its caller.
#[cfg(target_arch = "x86_64")]
struct VectorizedCall<'a, T: Register, const N: usize> {
    call: Call<'a, N>,
    token: T::Token,
    sweep: &'a mut Sweep<T>,
}

#[cfg(target_arch = "x86_64")]
impl<T: Register, const N: usize> pulp::NullaryFnOnce for VectorizedCall<'_, T, N> {
    type Output = Result<(), SingularJoint>;
    #[inline(always)]
    fn call(self) -> Self::Output {
        self.call.run(self.token, self.sweep)
    }
}
