//! Random trees of links and random states of them, from a seed.

use tumble_core::articulated::normalize;
use tumble_core::collide::{Mat3, Pose, Quat, Vec3};
use tumble_core::{Joint, LinkMass, Model, ModelBuilder};

/// A repeatable stream of numbers: the linear congruential generator of Knuth's MMIX, upper half.
pub struct Random(pub u64);

impl Random {
    /// Uniform in [low, high).
    pub fn real(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 32) as f64 / (1_u64 << 32) as f64)
    }

    /// Uniform in 0..n.
    pub fn index(&mut self, n: usize) -> usize {
        self.real(0.0, n as f64) as usize
    }

    pub fn vector(&mut self, size: f64) -> Vec3 {
        Vec3::from_fn(|_, _| self.real(-size, size))
    }

    pub fn numbers(&mut self, count: usize, size: f64) -> Vec<f64> {
        (0..count).map(|_| self.real(-size, size)).collect()
    }

    pub fn axis(&mut self) -> Vec3 {
        loop {
            let v = self.vector(1.0);
            if v.norm() > 0.1 && v.norm() < 1.0 {
                return v.normalize();
            }
        }
    }

    pub fn rotation(&mut self) -> Quat {
        Quat::from_scaled_axis(self.axis() * self.real(0.0, 3.1))
    }

    pub fn pose(&mut self, size: f64) -> Pose {
        Pose::from_parts(self.vector(size).into(), self.rotation())
    }

    /// Returns a box of up to 0.4 m and 0.2 to 3 kg, rotated and offset from the origin.
    pub fn mass(&mut self) -> LinkMass {
        let (mass, size) = (self.real(0.2, 3.0), Vec3::from_fn(|_, _| self.real(0.05, 0.4)));
        let square = size.component_mul(&size);
        let moments = mass / 12.0 * Vec3::new(square.y + square.z, square.z + square.x, square.x + square.y);
        let r = self.rotation().to_rotation_matrix().into_inner();
        let inertia = r * Mat3::from_diagonal(&moments) * r.transpose();
        LinkMass { mass, center: self.vector(0.2), inertia: 0.5 * (inertia + inertia.transpose()) }
    }
}

/// The kinds of joints in a random tree.
#[derive(Clone, Copy, PartialEq)]
pub enum Kinds {
    /// Revolute joints only.
    Hinges,
    /// Every kind, including fixed links and stacks with massless links.
    All,
}

/// Returns a tree of `count` links (including fixed ones), each on one of the last few or on any
/// earlier one; root 0 floats if `floating` is set.
pub fn random_tree(random: &mut Random, count: usize, floating: bool, kinds: Kinds) -> Model {
    let mut builder = ModelBuilder::new();
    let root = if floating { Joint::Floating } else { Joint::revolute(random.axis()) };
    builder.link("link 0", None, root, random.pose(0.3), random.mass());
    let mut i = 1;
    while i < count {
        let parent = if random.index(3) == 0 { random.index(i) } else { i - 1 };
        let kind = if kinds == Kinds::Hinges { 0 } else { random.index(8) };
        let axis = random.axis();
        let joint = match kind {
            0..=3 => Joint::revolute(axis),
            4 => Joint::prismatic(axis),
            5 => Joint::Spherical,
            6 => Joint::Fixed,
            _ if i + 2 < count => {
                i = stack(random, &mut builder, i, parent);
                continue;
            }
            _ => Joint::revolute(axis),
        };
        builder.link(format!("link {i}"), Some(parent), joint, random.pose(0.4), random.mass());
        i += 1;
    }
    builder.build().unwrap()
}

/// A universal joint of three revolute joints through one point, the first two on massless links;
/// far from gimbal lock while the second stays near zero.
fn stack(random: &mut Random, builder: &mut ModelBuilder, i: usize, parent: usize) -> usize {
    let at =
        builder.link(format!("link {i}"), Some(parent), Joint::revolute(Vec3::z()), random.pose(0.4), LinkMass::none());
    let at = builder.link(
        format!("link {}", i + 1),
        Some(at),
        Joint::revolute(Vec3::y()),
        Pose::identity(),
        LinkMass::none(),
    );
    builder.link(format!("link {}", i + 2), Some(at), Joint::revolute(Vec3::x()), Pose::identity(), random.mass());
    i + 3
}

/// Returns arbitrary positions, except that joints of massless stacks are within 1 rad of zero, and
/// velocities up to `speed`.
pub fn random_state(random: &mut Random, model: &Model, speed: f64) -> (Vec<f64>, Vec<f64>) {
    let mut q = random.numbers(model.positions(), 1.0);
    for link in model.links() {
        if matches!(link.joint, Joint::Revolute { .. }) && link.mass.mass > 0.0 {
            q[link.q] *= 3.0;
        }
    }
    normalize(model, &mut q);
    (q, random.numbers(model.dof(), speed))
}

/// Returns trees of many sizes with both kinds of base and all kinds of joints.
pub fn random_trees(seed: u64) -> Vec<Model> {
    let mut random = Random(seed);
    [(1, false), (1, true), (2, false), (5, true), (12, false), (12, true), (40, true), (100, false), (100, true)]
        .map(|(count, floating)| random_tree(&mut random, count, floating, Kinds::All))
        .into()
}

/// Greatest difference of two lists relative to the greatest number of the second (or to 1, where
/// that is less).
pub fn apart(a: &[f64], b: &[f64]) -> f64 {
    greatest_difference(a, b) / b.iter().fold(1.0f64, |m, x| m.max(x.abs()))
}

/// Greatest difference of two lists relative to the greatest number of the second.
pub fn relative(a: &[f64], b: &[f64]) -> f64 {
    greatest_difference(a, b) / b.iter().fold(0.0f64, |m, x| m.max(x.abs()))
}

fn greatest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    // not `max`, which ignores NaN
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, |m, d| if d <= m { m } else { d })
}
