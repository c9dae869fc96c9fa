//! The order in which soft spheres are blended: by their distance from the eye, the farthest first.
//!
//! ```text
//! C ← α·c + (1 − α)·C        from far to near
//! ```
//!
//! The distance is that between eye and center, not the depth along the direction of view: all screens of a cave have
//! one eye and many directions, so a sphere across their common edge is blended in the same order on both. Spheres at equal
//! distances are ordered by their numbers, so the order in the list changes no pixel.
//!
//! A weighted blend without an order would be cheaper, but it is exact only for one layer: in front of dense smoke a
//! flame would shine through.

use super::data::{self, Eye};
use crate::SoftSphere;
use std::cmp::Ordering;

/// Returns the numbers of spheres from the farthest to the nearest, 20 each.
pub fn far_to_near(spheres: &[SoftSphere], eye: &Eye) -> Vec<f32> {
    let mut order: Vec<(f32, &SoftSphere)> =
        spheres.iter().map(|s| (eye.distance(&s.center.coords.cast()) as f32, s)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| by_numbers(a.1, b.1)));
    let mut floats = Vec::with_capacity(data::SPHERE_FLOATS as usize * order.len());
    order.iter().for_each(|(_, sphere)| data::soft(sphere, &mut floats));
    floats
}

/// Compares all numbers of two spheres.
fn by_numbers(a: &SoftSphere, b: &SoftSphere) -> Ordering {
    let numbers = |s: &SoftSphere| {
        let ([x, y, z], [r, g, b]) = (s.center.into(), s.color);
        [x, y, z, s.radius, r, g, b, s.opacity, f32::from(u8::from(s.shader == crate::Shader::Lit))]
    };
    let pairs = numbers(a).into_iter().zip(numbers(b));
    pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}
