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
use std::f64::consts::PI;
use tumble_collide::Vec3;

/// Smallest distance in the avoidance, m.
const CLOSEST: f64 = 1e-6;
/// Margin within which a cosine or a square does not decide what is seen.
const MARGIN: f64 = 1e-9;

/// Constants of a flock, SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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

    /// Returns the force on each boid, N, in the same order. The sums over neighbors are in the order
    /// of the list, so both searches give the same bits.
    pub fn forces(&self, search: Search, flyers: &[Flyer]) -> Vec<Vec3> {
        let mut forces = vec![Vec3::zeros(); flyers.len()];
        let eye = Eye::new(self);
        match search {
            Search::BruteForce => {
                let all = || flyers.iter().map(|flyer| flyer.position).enumerate();
                (0..flyers.len()).for_each(|me| forces[me] = self.force(&eye, flyers, me, all()));
            }
            Search::Grid => {
                let mut around: Vec<(usize, Vec3)> = Vec::new();
                let grid = Grid::new(flyers.iter().map(|flyer| flyer.position), self.visibility_distance);
                grid.each_cell(|own, near| {
                    around.clear(); // one piece of memory for all boids of the cell
                    around.extend(near.iter().map(|&other| (other as usize, flyers[other as usize].position)));
                    for &(_, me) in own {
                        forces[me as usize] = self.force(&eye, flyers, me as usize, around.iter().copied());
                    }
                });
            }
        }
        forces
    }

    /// Returns the force on one boid, N. `near` has indices and positions, ascending by index.
    fn force(&self, eye: &Eye, flyers: &[Flyer], me: usize, near: impl Iterator<Item = (usize, Vec3)>) -> Vec3 {
        let own = &flyers[me];
        let [mut avoidance, mut matching, mut clustering] = [Vec3::zeros(); 3];
        for (other, position) in near {
            let arm = position - own.position;
            if arm.norm_squared() > eye.unseen || other == me {
                continue;
            }
            let Some(seen) = eye.sight(&arm, &own.forward, other > me) else { continue };
            avoidance -= (seen.weight / seen.distance.max(CLOSEST)) * seen.direction;
            matching += seen.weight * (flyers[other].velocity - own.velocity);
            clustering += (seen.weight * seen.distance) * seen.direction;
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

/// The limits of what boids see. Squares and cosines decide where they are clear, which costs no root
/// and no `acos`.
struct Eye<'a> {
    steering: &'a Steering,
    /// Square of a distance from which nothing is seen, m².
    unseen: f64,
    /// Cosine above which the angle weighs 1, and below which nothing is seen.
    cosines: [f64; 2],
}

impl Eye<'_> {
    fn new(steering: &Steering) -> Eye<'_> {
        let cosine = |angle: f64, margin: f64| if angle <= PI { angle.cos() + margin } else { -2.0 };
        let cosines = [
            cosine(steering.inner_visibility_angle.min(steering.visibility_angle), MARGIN),
            cosine(steering.visibility_angle, -MARGIN),
        ];
        Eye { steering, unseen: steering.visibility_distance.powi(2) * (1.0 + MARGIN), cosines }
    }

    /// Returns how a boid sees another one, `arm` away; `None` if it does not. `later` states whether
    /// the other one is behind it in the list.
    fn sight(&self, arm: &Vec3, forward: &Vec3, later: bool) -> Option<Sight> {
        let steering = self.steering;
        let distance = arm.norm();
        let by_distance = fade(distance, steering.inner_visibility_distance, steering.visibility_distance)?;
        if distance == 0.0 {
            let direction = if later { Vec3::x() } else { -Vec3::x() };
            return Some(Sight { weight: by_distance, distance, direction });
        }
        let direction = arm / distance;
        let weight = by_distance * self.by_angle(&direction, forward)?;
        Some(Sight { weight, distance, direction })
    }

    /// Returns the weight of a direction; `None` if it is not seen.
    fn by_angle(&self, direction: &Vec3, forward: &Vec3) -> Option<f64> {
        let cosine = direction.dot(forward);
        if cosine > self.cosines[0] {
            Some(1.0)
        } else if cosine < self.cosines[1] {
            None
        } else {
            let angle = direction.angle(forward);
            fade(angle, self.steering.inner_visibility_angle, self.steering.visibility_angle)
        }
    }
}

/// A neighbor as a boid sees it.
struct Sight {
    weight: f64,
    distance: f64,
    direction: Vec3,
}

/// Returns 1 below `inner`, then a line to 0 at `outer`; `None` from there on.
fn fade(s: f64, inner: f64, outer: f64) -> Option<f64> {
    (s < outer).then(|| if s < inner { 1.0 } else { (outer - s) / (outer - inner) })
}

/// Returns a vector of at most that length.
fn cap(force: &Vec3, limit: f64) -> Vec3 {
    let size = force.norm();
    if size > limit { force * (limit / size) } else { *force }
}
