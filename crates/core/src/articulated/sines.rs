//! Sines and cosines of all hinges of one state, several at a time in SIMD lanes where the processor has them. The bits are those of one at a time.

use super::compiled::{Compiled, Kind};
use super::lanes::Register;
#[cfg(target_arch = "x86_64")]
use super::lanes::{Eight, Four};

/// The hinges' sines and cosines, by the number of the link.
#[derive(Clone, Debug)]
pub(super) struct Sines {
    /// Link and position number of each hinge.
    hinges: Vec<(usize, usize)>,
    /// Sine and cosine by link; of links that are no hinges nothing.
    turns: Vec<(f64, f64)>,
}

impl Sines {
    pub fn new(compiled: &Compiled) -> Sines {
        let hinges =
            compiled.bodies.iter().enumerate().filter(|(_, b)| b.kind == Kind::Revolute).map(|(i, b)| (i, b.q));
        Sines { hinges: hinges.collect(), turns: vec![(0.0, 1.0); compiled.bodies.len()] }
    }

    /// Takes new angles, and gives all sines and cosines.
    #[inline(always)]
    pub fn take(&mut self, q: &[f64]) -> &[(f64, f64)] {
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(token) = pulp::x86::V4::try_new() {
                token.vectorize(Wide::<Eight> { token, sines: self, q });
                return &self.turns;
            }
            if let Some(token) = pulp::x86::V3::try_new() {
                token.vectorize(Wide::<Four> { token, sines: self, q });
                return &self.turns;
            }
        }
        self.fill::<f64, 1>((), q);
        &self.turns
    }

    /// `N` hinges at a time, the last of them filled up with angles of 0.
    #[inline(always)]
    fn fill<T: Register, const N: usize>(&mut self, token: T::Token, q: &[f64]) {
        for hinges in self.hinges.chunks(N) {
            let mut angles = [0.0; N];
            for (angle, &(_, k)) in angles.iter_mut().zip(hinges) {
                *angle = q[k];
            }
            let (sin, cos) = T::load(token, &angles).sin_cos();
            let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
            sin.store(&mut sines);
            cos.store(&mut cosines);
            for (&(link, _), turn) in hinges.iter().zip(sines.into_iter().zip(cosines)) {
                self.turns[link] = turn;
            }
        }
    }
}

/// A call of [`Sines::fill`] that is compiled for the instructions of the one who makes it.
#[cfg(target_arch = "x86_64")]
struct Wide<'a, T: Register> {
    token: T::Token,
    sines: &'a mut Sines,
    q: &'a [f64],
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Wide<'_, Four> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.sines.fill::<Four, 4>(self.token, self.q);
    }
}

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Wide<'_, Eight> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.sines.fill::<Eight, 8>(self.token, self.q);
    }
}
