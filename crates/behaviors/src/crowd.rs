//! The boids of a flock in the order of the cells, and the search for those that one may see.
//!
//! ```text
//! |x_j − B|² ≤ |x_j − x_i|²  for x_i in the box B        candidates of a cell: |x_j − B|² ≤ D²
//! ```
//!
//! Coordinates are apart, eight at once. The candidates of a cell are found once for all boids in it; rounding is monotone, so the
//! box hides nobody whose own distance, as it is computed, is within the limit.

use crate::registers::{LANES, Lanes, Registers};
use crate::sight::Eye;
use crate::steering::Flyer;
use std::ops::Range;

/// Boids in the order of the cells.
#[derive(Default)]
pub(crate) struct Crowd {
    flyers: Vec<Flyer>,
    /// Index of each boid.
    order: Vec<u32>,
    /// Coordinates, m, and a register of NaN behind them.
    positions: [Vec<f64>; 3],
    /// Position, m, and velocity, m/s, of each boid.
    rows: Vec<Lanes>,
}

/// The boids that those of a cell may see, and those that one of them may see.
#[derive(Default)]
pub(crate) struct Nearby {
    /// Coordinates of the candidates, m, up to a register of NaN.
    positions: [Vec<f64>; 3],
    /// Their places, ascending, and their number.
    places: Vec<u32>,
    count: usize,
    seen: Vec<u32>,
}

/// The boids that one may see.
pub(crate) struct Seen<'a> {
    /// Their places, ascending, with its own, which also fills the last register.
    pub places: &'a [[u32; LANES]],
    /// Number of those that only fill.
    pub fill: usize,
}

impl Crowd {
    /// Sorts boids by their indices in `order`.
    pub fn sort(&mut self, unsorted: &[Flyer], order: &[u32]) {
        let Crowd { flyers, positions, rows, order: own } = self;
        own.clear();
        own.extend_from_slice(order);
        flyers.clear();
        flyers.extend(order.iter().map(|index| unsorted[*index as usize]));
        for (axis, positions) in positions.iter_mut().enumerate() {
            positions.clear();
            positions.extend(flyers.iter().map(|flyer| flyer.position[axis]).chain([f64::NAN; LANES]));
        }
        rows.clear();
        rows.extend(
            flyers.iter().map(|Flyer { position: x, velocity: v, .. }| [x.x, x.y, x.z, v.x, v.y, v.z, 0.0, 0.0]),
        );
    }

    /// Returns the number of boids.
    pub fn len(&self) -> usize {
        self.order.len()
    }
    /// Returns the index of the boid at a place.
    pub fn index(&self, place: usize) -> usize {
        self.order[place] as usize
    }
    /// Returns the boid at a place.
    pub fn flyer(&self, place: usize) -> &Flyer {
        &self.flyers[place]
    }
    /// Returns the boids from a place on.
    pub fn flyers(&self, first: usize) -> &[Flyer] {
        &self.flyers[first..]
    }
    /// Writes the forces at the places to the indices of their boids.
    pub fn unsort<T: Copy + Default>(&self, sorted: &[T], out: &mut Vec<T>) {
        out.resize(sorted.len(), T::default());
        self.order.iter().zip(sorted).for_each(|(index, value)| out[*index as usize] = *value);
    }

    /// Returns position and velocity of eight boids, a coordinate in each register.
    #[inline(always)]
    pub fn columns<R: Registers>(&self, registers: R, places: &[u32; LANES]) -> [Lanes; 6] {
        let mut rows = [&self.rows[0]; LANES];
        (0..LANES).for_each(|k| rows[k] = &self.rows[places[k] as usize]);
        registers.columns(rows)
    }

    /// Returns the other boids at the same place as one, to rounding of the square of their distance.
    pub fn beside<'s>(&'s self, place: usize, seen: &'s Seen) -> impl Iterator<Item = usize> + 's {
        let own = &self.rows[place];
        seen.places.as_flattened().iter().map(|other| *other as usize).filter(move |other| {
            let [x, y, z] = [0, 1, 2].map(|axis| self.rows[*other][axis] - own[axis]);
            *other != place && x * x + y * y + z * z == 0.0
        })
    }

    /// Finds the boids in `runs` that one of the boids at `own` may see.
    #[inline(always)]
    pub fn candidates<R: Registers>(
        &self,
        registers: R,
        eye: &Eye,
        own: Range<usize>,
        runs: &[Range<usize>],
        near: &mut Nearby,
    ) {
        let most = runs.iter().map(Range::len).sum::<usize>() + LANES;
        if near.places.len() < most {
            near.positions.iter_mut().for_each(|x| x.resize(most, 0.0));
            near.places.resize(most, 0);
            near.seen.resize(most + LANES, 0);
        }
        let bounds = self.positions.each_ref().map(|x| {
            x[own.clone()].iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(*x), high.max(*x)])
        });
        let mut count = 0;
        for run in runs {
            for start in run.clone().step_by(LANES) {
                let [x, y, z] = &self.positions;
                let (x, y, z) = (register(x, start), register(y, start), register(z, start));
                let mut squares = [0.0; LANES];
                for k in 0..LANES {
                    let (dx, dy, dz) =
                        (outside(x[k], &bounds[0]), outside(y[k], &bounds[1]), outside(z[k], &bounds[2]));
                    squares[k] = dx * dx + dy * dy + dz * dz;
                }
                let inside = u8::MAX >> (LANES - (run.end - start).min(LANES));
                let bits = inside & registers.at_most(&squares, eye.unseen);
                for (kept, x) in near.positions.iter_mut().zip([x, y, z]) {
                    *register_mut(kept, count) = registers.pack(bits, x);
                }
                let mut places = [start as u32; LANES];
                (0..LANES).for_each(|k| places[k] += k as u32);
                *register_mut(&mut near.places, count) = registers.pack_places(bits, &places);
                count += bits.count_ones() as usize;
            }
        }
        near.positions.iter_mut().for_each(|x| *register_mut(x, count) = [f64::NAN; LANES]);
        near.count = count;
    }

    /// Finds the boids that one may see among the candidates of its cell.
    #[inline(always)]
    pub fn seen<'n, R: Registers>(&self, registers: R, eye: &Eye, place: usize, near: &'n mut Nearby) -> Seen<'n> {
        let own = &self.rows[place];
        let mut count = 0;
        for start in (0..near.count).step_by(LANES) {
            let [x, y, z] = &near.positions;
            let (x, y, z) = (register(x, start), register(y, start), register(z, start));
            let mut squares = [0.0; LANES];
            for k in 0..LANES {
                let (dx, dy, dz) = (x[k] - own[0], y[k] - own[1], z[k] - own[2]);
                squares[k] = dx * dx + dy * dy + dz * dz;
            }
            let bits = registers.at_most(&squares, eye.unseen);
            *register_mut(&mut near.seen, count) = registers.pack_places(bits, register(&near.places, start));
            count += bits.count_ones() as usize;
        }
        *register_mut(&mut near.seen, count) = [place as u32; LANES];
        let registers = count.div_ceil(LANES);
        Seen { places: &near.seen.as_chunks().0[..registers], fill: LANES * registers - count }
    }
}

/// Returns how far a coordinate is outside bounds; 0 inside.
#[inline(always)]
fn outside(x: f64, [low, high]: &[f64; 2]) -> f64 {
    let (below, above) = (low - x, x - high);
    let farther = if below > above { below } else { above };
    if farther > 0.0 { farther } else { 0.0 }
}

/// Returns the register that begins at a place; the list has a register more than it has places.
#[inline(always)]
fn register<T>(x: &[T], start: usize) -> &[T; LANES] {
    x[start..].first_chunk().expect("lists end with a register to spare")
}

#[inline(always)]
fn register_mut<T>(x: &mut [T], start: usize) -> &mut [T; LANES] {
    x[start..].first_chunk_mut().expect("lists end with a register to spare")
}
