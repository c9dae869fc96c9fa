//! Forward dynamics of many states of one model side by side: the sweeps of [`abm`](super::abm), a state per lane.
//!
//! A lane's bits are those of [`forward_dynamics`](super::forward_dynamics) on that state alone, on every processor: what differs is how many lanes
//! one instruction moves.

use super::abm::{Sweep, three};
use super::compiled::Compiled;
use super::lanes::{Lanes, Register};
#[cfg(target_arch = "x86_64")]
use super::lanes::{Eight, Four};
use super::model::Model;
use crate::spatial::{Motion, Scalar, Vector};
use tumble_collide::Vec3;

/// A model made ready for `N` states at a time. Fastest where `N` fills a register: 4 with AVX2, 8 with AVX-512, found out when it is made.
#[derive(Clone, Debug)]
pub struct BatchDynamics<const N: usize> {
    compiled: Compiled,
    way: Way<N>,
}

/// The instructions used.
#[derive(Clone, Debug)]
enum Way<const N: usize> {
    /// One lane.
    One(Sweep<f64>),
    /// What every processor has.
    Plain(Sweep<Lanes<N>>),
    /// Plain numbers, AVX2 where the compiler finds a use for it.
    #[cfg(target_arch = "x86_64")]
    Compiler(pulp::x86::V3, Sweep<Lanes<N>>),
    #[cfg(target_arch = "x86_64")]
    Four(pulp::x86::V3, Sweep<Four>),
    #[cfg(target_arch = "x86_64")]
    Eight(pulp::x86::V4, Sweep<Eight>),
}

impl<const N: usize> BatchDynamics<N> {
    /// Makes a model ready; all allocation happens here.
    pub fn new(model: &Model) -> BatchDynamics<N> {
        let compiled = Compiled::new(model);
        BatchDynamics { way: Way::best(&compiled), compiled }
    }

    /// The same without instructions that some processors lack: slower, the same bits.
    pub fn plain(model: &Model) -> BatchDynamics<N> {
        let compiled = Compiled::new(model);
        BatchDynamics { way: Way::Plain(Sweep::new(&compiled, Lanes::default())), compiled }
    }

    /// `q̈` of every lane from its `q`, `v` and joint forces `tau` (lengths `positions` and `dof` of the model, one state per lane), in uniform gravity,
    /// m/s². Where a joint is singular its axis is held still, as [`Dynamics::singular`](super::Dynamics::singular) says.
    pub fn forward_dynamics(&mut self, gravity: &Vec3, q: &[Lanes<N>], v: &[Lanes<N>], tau: &[Lanes<N>], qdd: &mut [Lanes<N>]) {
        let call = Call { compiled: &self.compiled, gravity, q, v, tau, qdd };
        match &mut self.way {
            Way::One(sweep) => call.run((), sweep),
            Way::Plain(sweep) => call.run((), sweep),
            #[cfg(target_arch = "x86_64")]
            Way::Compiler(token, sweep) => token.vectorize(Within { call, token: (), sweep }),
            #[cfg(target_arch = "x86_64")]
            Way::Four(token, sweep) => token.vectorize(Within { call, token: *token, sweep }),
            #[cfg(target_arch = "x86_64")]
            Way::Eight(token, sweep) => token.vectorize(Within { call, token: *token, sweep }),
        }
    }
}

impl<const N: usize> Way<N> {
    fn best(compiled: &Compiled) -> Way<N> {
        if N == 1 {
            return Way::One(Sweep::new(compiled, 0.0));
        }
        #[cfg(target_arch = "x86_64")]
        {
            if let (8, Some(token)) = (N, pulp::x86::V4::try_new()) {
                return Way::Eight(token, Sweep::new(compiled, Eight::load(token, &[0.0; 8])));
            }
            if let (4, Some(token)) = (N, pulp::x86::V3::try_new()) {
                return Way::Four(token, Sweep::new(compiled, Four::load(token, &[0.0; 4])));
            }
            if let Some(token) = pulp::x86::V3::try_new() {
                return Way::Compiler(token, Sweep::new(compiled, Lanes::default()));
            }
        }
        Way::Plain(Sweep::new(compiled, Lanes::default()))
    }
}

/// One call's arguments.
struct Call<'a, const N: usize> {
    compiled: &'a Compiled,
    gravity: &'a Vec3,
    q: &'a [Lanes<N>],
    v: &'a [Lanes<N>],
    tau: &'a [Lanes<N>],
    qdd: &'a mut [Lanes<N>],
}

impl<const N: usize> Call<'_, N> {
    #[inline(always)]
    fn run<T: Register>(self, token: T::Token, sweep: &mut Sweep<T>) {
        let Call { compiled, gravity, q, v, tau, qdd } = self;
        let (q, v, tau) = (|k: usize| T::load(token, &q[k].0), |k: usize| T::load(token, &v[k].0), |k: usize| T::load(token, &tau[k].0));
        run(compiled, sweep, gravity, q, v, tau, |k, x| x.store(&mut qdd[k].0));
    }
}

/// A call that is compiled for the instructions of the one who makes it.
#[cfg(target_arch = "x86_64")]
struct Within<'a, T: Register, const N: usize> {
    call: Call<'a, N>,
    token: T::Token,
    sweep: &'a mut Sweep<T>,
}

#[cfg(target_arch = "x86_64")]
impl<T: Register, const N: usize> pulp::NullaryFnOnce for Within<'_, T, N> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.call.run(self.token, self.sweep);
    }
}

/// The whole method: place, fold, push, spread.
#[inline(always)]
pub(super) fn run<T: Scalar>(
    compiled: &Compiled,
    sweep: &mut Sweep<T>,
    gravity: &Vec3,
    q: impl Fn(usize) -> T + Copy,
    v: impl Fn(usize) -> T + Copy,
    tau: impl Fn(usize) -> T + Copy,
    out: impl FnMut(usize, T),
) {
    sweep.place::<false>(compiled, q, v);
    for (i, body) in compiled.bodies.iter().enumerate().rev() {
        sweep.fold_link(i + 1, body);
        sweep.push_link(i + 1, body, tau);
    }
    let zero = sweep.slots[0].pivot;
    sweep.slots[0].acceleration = Motion::new(Vector::splat(zero), three(|k| zero.constant(-gravity[k]), 0));
    sweep.spread(compiled, out);
}
