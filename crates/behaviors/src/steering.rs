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

use crate::error::{BehaviorError, check};
use crate::grid::Grid;
use crate::sight::{CLOSEST, Eye, LANES, Lanes, Sight};
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
        self.forces_by(search, flyers, |forces, work| work(0, forces))
    }

    /// Returns the force on each boid, N. `run` is given the forces in the order of the cells; it calls the work with the
    /// number of the first and the forces of each piece of them, in any order.
    pub(crate) fn forces_by(
        &self,
        search: Search,
        flyers: &[Flyer],
        run: impl FnOnce(&mut [Vec3], &(dyn Fn(usize, &mut [Vec3]) + Sync)),
    ) -> Vec<Vec3> {
        let grid = Grid::new(flyers.iter().map(|flyer| flyer.position), self.visibility_distance);
        let crowd = Crowd::new(flyers, grid.order().collect());
        let (eye, arch) = (Eye::new(self), pulp::Arch::new());
        let mut sorted = vec![Vec3::zeros(); flyers.len()];
        run(&mut sorted, &|first, forces: &mut [Vec3]| {
            let mut seen = vec![0; flyers.len()];
            let places = first..first + forces.len();
            let mut work = |own: Range<usize>, runs: &[Range<usize>]| {
                // the widest registers that there are: the same products and sums, so the same bits
                arch.dispatch(
                    #[inline(always)]
                    || {
                        for place in own {
                            let near = crowd.within(place, eye.unseen, runs, &mut seen);
                            forces[place - first] = self.force(&eye, &crowd, place, &near);
                        }
                    },
                );
            };
            match search {
                Search::Grid => grid.each_cell(places, work),
                Search::BruteForce => work(places, std::slice::from_ref(&(0..flyers.len()))),
            }
        });
        let mut forces = vec![Vec3::zeros(); flyers.len()];
        crowd.order.iter().zip(sorted).for_each(|(index, force)| forces[*index] = force);
        forces
    }

    /// Returns the force on the boid at a place.
    #[inline(always)]
    fn force(&self, eye: &Eye, crowd: &Crowd, place: usize, near: &Near) -> Vec3 {
        let own = &crowd.flyers[crowd.order[place]];
        let mut sums = Sums::default();
        for near in near.places.chunks(LANES) {
            let (mut arm, mut faster) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
            for (lane, other) in near.iter().enumerate() {
                for axis in 0..3 {
                    arm[axis][lane] = crowd.positions[axis][*other as usize] - own.position[axis];
                    faster[axis][lane] = crowd.velocities[axis][*other as usize] - own.velocity[axis];
                }
            }
            sums.add(&eye.sight(&arm, &own.forward), &arm, &faster);
        }
        let [mut avoidance, mut matching, clustering] = sums.total();
        let here = if near.here > 1 { near.places } else { &[] };
        for other in here.iter().map(|other| *other as usize).filter(|other| crowd.is_at(*other, place)) {
            let direction = if crowd.order[other] > crowd.order[place] { Vec3::x() } else { -Vec3::x() };
            avoidance -= eye.at_the_same_place() / CLOSEST * direction;
            matching += eye.at_the_same_place() * (crowd.flyers[crowd.order[other]].velocity - own.velocity);
        }
        let ranked = self.by_priority(
            &(own.mass * self.avoidance * avoidance),
            &(own.mass * self.matching * matching),
            &(own.mass * self.clustering * clustering),
        );
        ranked + self.cruise(own) + self.boundary(own)
    }

    /// Adds the three forces by priority under the limit.
    fn by_priority(&self, avoidance: &Vec3, matching: &Vec3, clustering: &Vec3) -> Vec3 {
        let limit = self.max_force;
        let two = avoidance + matching;
        if avoidance.norm() > limit {
            cap(avoidance, limit)
        } else if two.norm() >= limit {
            cap(&two, limit)
        } else {
            cap(&(two + clustering), limit)
        }
    }

    /// Returns the force that seeks the desired speed.
    fn cruise(&self, own: &Flyer) -> Vec3 {
        own.mass * self.speed_rate * (self.desired_speed - own.velocity.norm()) * own.forward
    }

    /// Returns the force of the soft boundary.
    fn boundary(&self, own: &Flyer) -> Vec3 {
        let arm = own.position - self.boundary_center;
        let distance = arm.norm();
        if distance > self.boundary_radius {
            -self.boundary_stiffness * (distance - self.boundary_radius) * (arm / distance)
        } else {
            Vec3::zeros()
        }
    }
}

/// The boids in the order of the cells. Coordinates are apart, as the search reads them.
struct Crowd<'a> {
    flyers: &'a [Flyer],
    /// Index of each boid.
    order: Vec<usize>,
    positions: [Vec<f64>; 3],
    velocities: [Vec<f64>; 3],
}

impl<'a> Crowd<'a> {
    fn new(flyers: &'a [Flyer], order: Vec<usize>) -> Crowd<'a> {
        let sorted = |of: &dyn Fn(&Flyer) -> f64| order.iter().map(|index| of(&flyers[*index])).collect::<Vec<_>>();
        let positions = [0, 1, 2].map(|axis| sorted(&|flyer| flyer.position[axis]));
        let velocities = [0, 1, 2].map(|axis| sorted(&|flyer| flyer.velocity[axis]));
        Crowd { flyers, positions, velocities, order }
    }

    /// Returns whether another boid is at the same place as one, to rounding of the square of their distance.
    fn is_at(&self, other: usize, place: usize) -> bool {
        let arm = Vec3::from(self.positions.each_ref().map(|x| x[other] - x[place]));
        other != place && arm.x * arm.x + arm.y * arm.y + arm.z * arm.z == 0.0
    }

    /// Finds the boids of `runs` within a squared distance (m²) of one, itself included. Their places are written to the
    /// front of `seen`, which is as long as the crowd.
    #[inline(always)]
    fn within<'s>(&self, place: usize, squared: f64, runs: &[Range<usize>], seen: &'s mut [u32]) -> Near<'s> {
        let [x, y, z] = &self.positions;
        let (own_x, own_y, own_z) = (x[place], y[place], z[place]);
        let (mut count, mut here) = (0, 0);
        for run in runs {
            let points = x[run.clone()].iter().zip(&y[run.clone()]).zip(&z[run.clone()]);
            for (((x, y), z), other) in points.zip(run.start as u32..) {
                let (dx, dy, dz) = (x - own_x, y - own_y, z - own_z);
                let distance = dx * dx + dy * dy + dz * dz;
                // each is written, and kept by the count: no branch to predict
                seen[count] = other;
                count += usize::from(distance <= squared);
                here += usize::from(distance == 0.0);
            }
        }
        Near { places: &seen[..count], here }
    }
}

/// The boids that one may see.
struct Near<'a> {
    /// Their places, ascending, with its own.
    places: &'a [u32],
    /// Number of those at its own place, itself included.
    here: usize,
}

/// Sums over neighbors, one for each lane: `−Σ w·u/d`, `Σ w·(v_j − v_i)` and `Σ w·d·u`.
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
        self.0.map(|sum| sum.map(|lanes| lanes.iter().sum()).into())
    }
}

/// Returns a vector of at most that length.
fn cap(force: &Vec3, limit: f64) -> Vec3 {
    let size = force.norm();
    if size > limit { force * (limit / size) } else { *force }
}
