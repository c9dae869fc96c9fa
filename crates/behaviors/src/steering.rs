//! The forces of a flock (thesis appendix A, `Boid::AccumulateForces`, after Reynolds, *Flocks,
//! herds, and schools*, 1987).
//!
//! ```text
//! d = |x_j − x_i|      u = (x_j − x_i)/d      θ = ∠(u, f_i)
//! w = fade(d, D₀, D)·fade(θ, A₀, A)           fade(s, s₀, s₁) = 1 below s₀, (s₁ − s)/(s₁ − s₀) below s₁, else 0
//! Fa = −m·Ka·Σ w·u/d        Fv = m·Kv·Σ w·(v_j − v_i)        Fc = m·Kc·Σ w·d·u
//!
//! F = cap(Fa)               if |Fa| > F_max
//!     cap(Fa + Fv)          if |Fa + Fv| ≥ F_max
//!     cap(Fa + Fv + Fc)     else                              cap(F) = F·min(1, F_max/|F|)
//!
//! F += m·Ks·(V − |v|)·f  −  k·max(0, |x − o| − R)·(x − o)/|x − o|
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x`, `v`, `m`, `f` | position, velocity, mass and forward direction of a boid |
//! | `d`, `u`, `θ`, `w` | distance, direction, angle off the nose and weight of a neighbor |
//! | `D`, `D₀` | distance at which a neighbor is no longer seen, and from which it is seen less |
//! | `A`, `A₀` | the same for the angle |
//! | `Fa`, `Fv`, `Fc` | avoidance, velocity matching, clustering; `Ka`, `Kv`, `Kc` their coefficients |
//! | `F_max` | limit of the three forces together; the later ones get what the earlier leave |
//! | `V`, `Ks` | desired speed, and the rate at which it is sought |
//! | `o`, `R`, `k` | center, radius and stiffness of the soft boundary |
//!
//! Departures from the appendix:
//!
//! - `acos` has its argument clamped.
//! - Two boids at one point have no direction. The earlier one of the list then sees the later one
//!   along +x, and the later one the earlier along −x, with full weight for the angle. Distances
//!   below 1 µm count as 1 µm in `1/d`.
//! - The desired speed, which the appendix declares and never reads, is sought. This force is beside
//!   the limit, so that a flock under `F_max` does not speed up for ever: `|v| ≤ V + F_max/(m·Ks)`.
//! - Constants belong to the flock and not to each boid. Center, radius and stiffness of the
//!   boundary are constants; in the appendix they are 0, 300 and 1.

use crate::crowd::{Crowd, Nearby, Seen};
use crate::error::{BehaviorError, check};
use crate::grid::Grid;
use crate::registers::{LANES, Lanes, Portable, Registers};
use crate::sight::{CLOSEST, Eye, Sight};
use std::ops::Range;
use tumble_collide::Vec3;

/// Constants of a flock, SI units.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Steering {
    /// Coefficient of avoidance `Ka`, m²/s², at least 0.
    pub avoidance: f64,
    /// Coefficient of velocity matching `Kv`, 1/s, at least 0.
    pub matching: f64,
    /// Coefficient of clustering `Kc`, 1/s², at least 0.
    pub clustering: f64,
    /// Limit of these three forces together, N, at least 0.
    pub max_force: f64,
    /// Distance from which a neighbor is not seen, m, above 0.
    pub visibility_distance: f64,
    /// Distance up to which a neighbor is seen fully, m, at least 0.
    pub inner_visibility_distance: f64,
    /// Angle off the nose from which a neighbor is not seen, rad, above 0; above π all are seen.
    pub visibility_angle: f64,
    /// Angle up to which a neighbor is seen fully, rad, at least 0.
    pub inner_visibility_angle: f64,
    /// Desired speed, m/s, at least 0.
    pub desired_speed: f64,
    /// Rate at which the desired speed is sought `Ks`, 1/s, at least 0; 0 for none.
    pub speed_rate: f64,
    /// Center of the soft boundary, m.
    pub boundary_center: Vec3,
    /// Radius of the soft boundary, m, at least 0.
    pub boundary_radius: f64,
    /// Stiffness of the soft boundary, N/m, at least 0; 0 for none.
    pub boundary_stiffness: f64,
}

impl Default for Steering {
    /// A loose flock of boids of 1 kg at 10 m/s, within 300 m.
    fn default() -> Steering {
        Steering {
            avoidance: 20.0,
            matching: 0.5,
            clustering: 0.05,
            max_force: 20.0,
            visibility_distance: 10.0,
            inner_visibility_distance: 5.0,
            visibility_angle: 2.4,
            inner_visibility_angle: 1.6,
            desired_speed: 10.0,
            speed_rate: 1.0,
            boundary_center: Vec3::zeros(),
            boundary_radius: 300.0,
            boundary_stiffness: 1.0,
        }
    }
}

/// A boid as its flock sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flyer {
    /// Position, m.
    pub position: Vec3,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Direction of the nose, unit.
    pub forward: Vec3,
    /// Mass, kg.
    pub mass: f64,
}

/// A method of finding neighbors. Both give the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Search {
    /// Boids of the same and of adjacent cells.
    #[default]
    Grid,
    /// All boids: the oracle of the grid.
    BruteForce,
}

/// Boids sorted by cells, and the forces on them: memory that is used again.
#[derive(Default)]
pub(crate) struct Sorted {
    grid: Grid,
    crowd: Crowd,
    /// Force on each boid in the order of the cells, N.
    sorted: Vec<Vec3>,
    /// Force on each boid in its own order, N.
    pub forces: Vec<Vec3>,
}

impl Steering {
    /// Checks the ranges of all constants.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names a constant that is out of its range.
    pub fn validate(&self) -> Result<(), BehaviorError> {
        for (what, value) in [
            ("avoidance", self.avoidance),
            ("matching", self.matching),
            ("clustering", self.clustering),
            ("max_force", self.max_force),
            ("inner_visibility_distance", self.inner_visibility_distance),
            ("inner_visibility_angle", self.inner_visibility_angle),
            ("desired_speed", self.desired_speed),
            ("speed_rate", self.speed_rate),
            ("boundary_radius", self.boundary_radius),
            ("boundary_stiffness", self.boundary_stiffness),
        ] {
            check(what, value, value >= 0.0, "at least 0")?;
        }
        for (what, value) in
            [("visibility_distance", self.visibility_distance), ("visibility_angle", self.visibility_angle)]
        {
            check(what, value, value > 0.0, "above 0")?;
        }
        self.boundary_center.iter().try_for_each(|x| check("boundary_center", *x, true, "finite"))
    }

    /// Returns the force on each boid, N, in the same order. Both searches give the same bits.
    pub fn forces(&self, search: Search, flyers: &[Flyer]) -> Vec<Vec3> {
        let mut memory = Sorted::default();
        self.forces_by(search, flyers, &mut memory, |forces, work| work(0, forces));
        memory.forces
    }

    /// Writes the force on each boid, N, to `memory.forces`. `run` is given the forces in the order of the cells; it calls
    /// the work with the number of the first and the forces of each piece of them, in any order.
    pub(crate) fn forces_by(
        &self,
        search: Search,
        flyers: &[Flyer],
        memory: &mut Sorted,
        run: impl FnOnce(&mut [Vec3], &(dyn Fn(usize, &mut [Vec3]) + Sync)),
    ) {
        let Sorted { grid, crowd, sorted, forces } = memory;
        grid.sort(flyers.iter().map(|flyer| flyer.position), self.visibility_distance);
        crowd.sort(flyers, grid.order());
        let (eye, grid, crowd) = (Eye::new(self), &*grid, &*crowd);
        sorted.resize(flyers.len(), Vec3::zeros());
        run(sorted, &|first, forces: &mut [Vec3]| {
            Piece { steering: self, eye: &eye, grid, crowd, search, first, forces, sums: Vec::new() }.vectorized();
        });
        crowd.unsort(sorted, forces);
    }

    /// Returns the force on a boid with these sums over its neighbors.
    #[inline(always)]
    fn force(&self, own: &Flyer, [avoidance, matching, clustering]: &[Vec3; 3]) -> Vec3 {
        let ranked = self.by_priority(
            &(own.mass * self.avoidance * avoidance),
            &(own.mass * self.matching * matching),
            &(own.mass * self.clustering * clustering),
        );
        ranked + self.cruise(own) + self.boundary(own)
    }

    /// Adds the three forces by priority under the limit. What is not taken is computed too: no branch to predict.
    #[inline(always)]
    fn by_priority(&self, avoidance: &Vec3, matching: &Vec3, clustering: &Vec3) -> Vec3 {
        let limit = self.max_force;
        let two = avoidance + matching;
        let (one, two, all) = (cap(avoidance, limit), cap(&two, limit), cap(&(two + clustering), limit));
        let rest = choose(two.size >= limit, &two.capped, &all.capped);
        choose(one.size > limit, &one.capped, &rest)
    }

    /// Returns the force that seeks the desired speed.
    #[inline(always)]
    fn cruise(&self, own: &Flyer) -> Vec3 {
        own.mass * self.speed_rate * (self.desired_speed - length(&own.velocity)) * own.forward
    }

    /// Returns the force of the soft boundary.
    #[inline(always)]
    fn boundary(&self, own: &Flyer) -> Vec3 {
        let arm = own.position - self.boundary_center;
        let distance = length(&arm);
        if distance > self.boundary_radius {
            -self.boundary_stiffness * (distance - self.boundary_radius) * (arm / distance)
        } else {
            Vec3::zeros()
        }
    }
}

/// The forces on a piece of the crowd, from place `first` on.
struct Piece<'a> {
    steering: &'a Steering,
    eye: &'a Eye,
    grid: &'a Grid,
    crowd: &'a Crowd,
    search: Search,
    first: usize,
    forces: &'a mut [Vec3],
    /// Sums over the neighbors of each boid.
    sums: Vec<[Vec3; 3]>,
}

impl Piece<'_> {
    /// Computes them in the widest registers that there are: the same products and sums, so the same bits.
    fn vectorized(self) {
        #[cfg(target_arch = "x86_64")]
        if let Some(token) = pulp::x86::V4::try_new() {
            return token.vectorize(Vectorized(self, token));
        }
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || self.compute(Portable),
        );
    }

    #[inline(always)]
    fn compute<R: Registers>(mut self, registers: R) {
        let (places, mut near) = (self.first..self.first + self.forces.len(), Nearby::default());
        self.sums.resize(self.forces.len(), Default::default());
        match self.search {
            Search::Grid => self.grid.each_cell(
                places,
                #[inline(always)]
                |own, runs| self.cell(registers, own, runs, &mut near),
            ),
            Search::BruteForce => {
                let all = 0..self.crowd.len();
                for place in places {
                    self.cell(registers, place..place + 1, std::slice::from_ref(&all), &mut near);
                }
            }
        }
        // all sums first: a force waits long for its roots, and those of several boids are found at once
        for ((force, sums), own) in self.forces.iter_mut().zip(&self.sums).zip(self.crowd.flyers(self.first)) {
            *force = self.steering.force(own, sums);
        }
    }

    /// Sums over the neighbors of some boids, which are in `runs`.
    #[inline(always)]
    fn cell<R: Registers>(&mut self, registers: R, own: Range<usize>, runs: &[Range<usize>], near: &mut Nearby) {
        self.crowd.candidates(registers, self.eye, own.clone(), runs, near);
        for place in own {
            let seen = self.crowd.seen(registers, self.eye, place, near);
            self.sums[place - self.first] = self.sums(registers, place, &seen);
        }
    }

    /// Returns the sums over the neighbors of a boid: `−Σ w·u/d`, `Σ w·(v_j − v_i)` and `Σ w·d·u`.
    #[inline(always)]
    fn sums<R: Registers>(&self, registers: R, place: usize, seen: &Seen) -> [Vec3; 3] {
        let (crowd, eye) = (self.crowd, self.eye);
        let own = crowd.flyer(place);
        let (mut sums, mut here) = (Sums::default(), 0);
        for near in seen.places {
            let [x, y, z, u, v, w] = crowd.columns(registers, near);
            let arm = less([x, y, z], &own.position);
            let sight = eye.sight(&arm, &own.forward);
            here += registers.at_most(&sight.distance, 0.0).count_ones() as usize;
            sums.add(&sight, &arm, &less([u, v, w], &own.velocity));
        }
        let [mut avoidance, mut matching, clustering] = sums.total();
        if here > seen.fill + 1 {
            for other in crowd.beside(place, seen) {
                let direction = if crowd.index(other) > crowd.index(place) { Vec3::x() } else { -Vec3::x() };
                avoidance -= eye.at_the_same_place() / CLOSEST * direction;
                matching += eye.at_the_same_place() * (crowd.flyer(other).velocity - own.velocity);
            }
        }
        [avoidance, matching, clustering]
    }
}

/// A piece that is compiled for the registers of its token.
#[cfg(target_arch = "x86_64")]
struct Vectorized<'a>(Piece<'a>, pulp::x86::V4);

#[cfg(target_arch = "x86_64")]
impl pulp::NullaryFnOnce for Vectorized<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.0.compute(self.1);
    }
}

/// Subtracts a vector in each lane.
#[inline(always)]
fn less(x: [Lanes; 3], own: &Vec3) -> [Lanes; 3] {
    let mut out = x;
    for axis in 0..3 {
        (0..LANES).for_each(|k| out[axis][k] -= own[axis]);
    }
    out
}

/// Sums over neighbors, one for each lane.
#[derive(Default)]
struct Sums([[Lanes; 3]; 3]);

impl Sums {
    #[inline(always)]
    fn add(&mut self, sight: &Sight, arm: &[Lanes; 3], faster: &[Lanes; 3]) {
        let [avoidance, matching, clustering] = &mut self.0;
        for axis in 0..3 {
            for k in 0..LANES {
                avoidance[axis][k] -= sight.weight[k] * sight.nearness[k] * arm[axis][k];
                matching[axis][k] += sight.weight[k] * faster[axis][k];
                clustering[axis][k] += sight.weight[k] * arm[axis][k];
            }
        }
    }

    /// Returns the sums of all lanes.
    fn total(&self) -> [Vec3; 3] {
        self.0.map(|sum| sum.map(|[a, b, c, d, e, f, g, h]| ((a + e) + (c + g)) + ((b + f) + (d + h))).into())
    }
}

/// A vector of at most some length, and its length before.
struct Capped {
    capped: Vec3,
    size: f64,
}

#[inline(always)]
fn cap(force: &Vec3, limit: f64) -> Capped {
    let size = length(force);
    let share = limit / size;
    // no number for 0/0: all of it then
    Capped { capped: force * if share < 1.0 { share } else { 1.0 }, size }
}

/// Returns the length of a vector. The root is an instruction of the registers in use; that of nalgebra's `norm` is one of the older
/// kind, which waits for all lanes of the wide ones.
#[inline(always)]
fn length(v: &Vec3) -> f64 {
    (v.x * v.x + v.y * v.y + v.z * v.z).sqrt()
}

#[inline(always)]
fn choose(first: bool, a: &Vec3, b: &Vec3) -> Vec3 {
    let of = |a: f64, b: f64| if first { a } else { b };
    Vec3::new(of(a.x, b.x), of(a.y, b.y), of(a.z, b.z))
}
