//! The motion of one particle in a frame: free flight, impacts and sliding.
//!
//! ```text
//! impact   u_n' = −e·u_n,   |Δu_t| = min(μ·(1 + e)·|u_n|, |u_t|)         u = v − velocity of the surface
//! contact  p = max(0, −a·n),   a' = a + p·n,   |Δu_t| = min(μ·p·t, |u_t|)
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `u_n`, `u_t` | velocity over the surface along the normal `n`, and across |
//! | `e`, `μ` | restitution and friction of the pair |
//! | `a`, `p` | acceleration without contact; that by which the surface presses |
//!
//! Times of impact are those of the exact path, so an elastic bounce keeps its height. An impact slower than the
//! acceleration gives in a frame does not bounce: the particle slides for the rest of the frame, along the tangent. If the surface recedes by more than
//! `½·p·t²` in the time `t` after the gap opened, beyond an edge or in a curve that is taken too fast, free flight begins there.

use super::first_contact::{Stretch, lifts};
use super::obstacles::{Hit, Obstacle, Obstacles};
use super::path::{Air, Path};
use tumble_collide::Vec3;
use tumble_core::{Frame, FrameImpulse, Material};

/// Most impacts of a particle in a frame.
const IMPACTS: usize = 8;
/// Gap at which a particle has left a surface that it slid on, m.
const LEFT: f64 = 1e-5;
/// Gap at which an overlap ends, m, per meter from the origin.
const APART: f64 = 1e-12;

/// The constants of a flight.
pub(super) struct Flight<'a> {
    pub frame: &'a Frame<'a>,
    pub obstacles: &'a Obstacles<'a>,
    pub air: Air,
    pub radius: f64,
    pub mass: f64,
    pub material: Material,
    pub two_way: bool,
}

/// Working memory of flights.
#[derive(Default)]
pub(super) struct Memory {
    near: Vec<usize>,
    pub impulses: Vec<FrameImpulse>,
}

impl Flight<'_> {
    /// Moves a particle from `start` (s after the start of the frame) to the end of the frame.
    pub fn fly(&self, x: &mut Vec3, v: &mut Vec3, start: f64, memory: &mut Memory) {
        let (dt, mut time) = (self.frame.dt, start);
        for _ in 0..IMPACTS {
            if time >= dt {
                return; // born at the end of the frame, or an impact or a slide ends there
            }
            let left = dt - time;
            let path = self.air.path(*x, *v, left);
            let end = path.end();
            self.obstacles.near(x, &end.0, &mut memory.near);
            let Some(hit) = self.first(&memory.near, &path, time, left, None) else {
                return (*x, *v) = end;
            };
            (*x, *v) = path.at(hit.time);
            time += hit.time;
            let obstacle = self.obstacles.get(hit.obstacle);
            let normal = self.part(obstacle, x, time);
            let bounced = self.impact(obstacle, &normal, x, v, &path.pull, memory);
            if !bounced && time < dt {
                time += self.slide(hit.obstacle, &normal, x, v, (time, &path.pull), memory);
            }
        }
    }

    /// Returns the first contact of a path that begins at `time` of the frame, within `length` seconds.
    fn first(&self, near: &[usize], path: &Path, time: f64, length: f64, but: Option<usize>) -> Option<Hit> {
        if near.is_empty() {
            return None;
        }
        let (mut first, mut end): (Option<Hit>, _) = (None, path.at(length).0);
        for &obstacle in near.iter().filter(|index| but != Some(**index)) {
            let length = first.map_or(length, |hit| hit.time);
            let stretch = Stretch { path, end: &end, start: time, length, dt: self.frame.dt, radius: self.radius };
            if let Some(time) = self.obstacles.get(obstacle).meets(&stretch) {
                (first, end) = (Some(Hit { time, obstacle }), path.at(time).0);
            }
        }
        first
    }

    /// Moves a particle out of an obstacle, and returns the normal.
    fn part(&self, obstacle: &Obstacle, x: &mut Vec3, time: f64) -> Vec3 {
        let (gap, normal) = obstacle.gap(x, time / self.frame.dt, self.radius);
        let least = APART * (1.0 + x.amax());
        if gap < least {
            *x += (least - gap) * normal;
        }
        normal
    }

    /// Changes the velocity by an impact. Returns false if the particle stays in contact.
    fn impact(&self, obstacle: &Obstacle, n: &Vec3, x: &Vec3, v: &mut Vec3, a: &Vec3, memory: &mut Memory) -> bool {
        let u = *v - obstacle.velocity(x);
        let along = u.dot(n);
        if along > 0.0 {
            // rounding gives a particle at rest a speed that does not lift it off
            let lifts = lifts(along, a.dot(n));
            *v -= if lifts { 0.0 } else { along } * n;
            return lifts;
        }
        let settings = self.frame.settings;
        let e = settings.combine_restitution.of(self.material.restitution, obstacle.material.restitution);
        let slow = -along <= a.dot(n).abs() * self.frame.dt;
        let e = if slow { 0.0 } else { e };
        let across = u - along * n;
        let grip = self.friction(obstacle) * (1.0 + e) * -along;
        let change = -(1.0 + e) * along * n - shorten(&across, grip);
        *v += change;
        self.push(obstacle, x, &change, memory);
        e > 0.0
    }

    /// Slides a particle along an obstacle up to the end of the frame, or to the next contact, from a time before
    /// that end. Returns the time that this takes, s.
    fn slide(
        &self,
        index: usize,
        n: &Vec3,
        x: &mut Vec3,
        v: &mut Vec3,
        (time, a): (f64, &Vec3),
        memory: &mut Memory,
    ) -> f64 {
        let obstacle = self.obstacles.get(index);
        let (carrier, left) = (obstacle.velocity(x), self.frame.dt - time);
        let press = (-a.dot(n)).max(0.0);
        let ease = a + press * n;
        let u = *v - carrier;
        let (pushed, grip) = (u + left * ease, self.friction(obstacle) * press);
        let end = pushed - shorten(&pushed, grip * left);
        let stopped = end == Vec3::zeros() && ease.norm() * left < 1e-9 * u.norm();
        let way = if stopped { u * (0.5 * u.norm() / grip / left) } else { 0.5 * (u + end) };
        let path = Path::straight(*x, carrier + way);
        self.obstacles.near(x, &path.at(left).0, &mut memory.near); // a slide goes elsewhere than free flight
        let hit = self.first(&memory.near, &path, time, left, Some(index)).filter(|hit| hit.time > 0.0);
        let mut took = hit.map_or(left, |hit| hit.time);
        let end_of = path.at(took).0;
        let gap = obstacle.gap(&end_of, (time + took) / self.frame.dt, self.radius).0;
        let mut leaves = false;
        if gap > LEFT {
            let (dt, radius) = (self.frame.dt, self.radius);
            let stretch = Stretch { path: &path, end: &end_of, start: time, length: took, dt, radius };
            let fall = obstacle.leaves(&stretch, LEFT);
            leaves = gap > 0.5 * press * (took - fall).powi(2);
            took = if leaves { fall } else { took };
        }
        let share = took / left;
        *x = path.at(took).0;
        let change = share * (end - u);
        *v += change;
        self.push(obstacle, x, &(change - took * a), memory);
        if hit.is_none() && !leaves {
            self.part(obstacle, x, self.frame.dt);
        }
        took
    }

    /// Returns the coefficient of friction with an obstacle.
    fn friction(&self, obstacle: &Obstacle) -> f64 {
        self.frame.settings.combine_friction.of(self.material.friction, obstacle.material.friction)
    }

    /// Gives an obstacle the opposite of a change of the particle's velocity.
    fn push(&self, obstacle: &Obstacle, x: &Vec3, change: &Vec3, memory: &mut Memory) {
        if self.two_way && obstacle.dynamic {
            let impulse = -self.mass * change;
            memory.impulses.push(FrameImpulse { id: obstacle.id, part: obstacle.part, impulse, point: *x });
        }
    }
}

/// Returns the part of a vector that a reduction of its length takes away: all of it if it is shorter.
fn shorten(vector: &Vec3, by: f64) -> Vec3 {
    let length = vector.norm();
    if length > by { vector * (by / length) } else { *vector }
}
