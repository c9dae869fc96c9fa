//! What collides: shapes, materials, who meets whom, and the test impulse (thesis §IV.A.3).

use crate::derived::Cache;
use crate::object::Integratable;
use crate::object::part_state::PartState;
use tumble_collide::{ContactMode, Shape, Vec3};

/// A kind of collidable object, 0 to 63 (thesis `CollisionObjectType`): pairs are filtered by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct CollisionGroup(u8);

impl CollisionGroup {
    /// Kind number `n`; `None` above 63.
    pub const fn new(n: u8) -> Option<CollisionGroup> {
        if n < 64 { Some(CollisionGroup(n)) } else { None }
    }

    /// The kind as one bit of a mask.
    pub const fn bit(self) -> u64 {
        1 << self.0
    }
}

/// Surface constants of one body.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Material {
    /// Coefficient of restitution, 0 to 1.
    pub restitution: f64,
    /// Coefficient of Coulomb friction, at least 0.
    pub friction: f64,
    /// Number of the material, by which [`World::set_pair_material`](crate::World::set_pair_material) finds its parts; 0 for none.
    pub id: u32,
}

impl Default for Material {
    fn default() -> Material {
        Material { restitution: 0.0, friction: 0.5, id: 0 }
    }
}

/// How the constants of two bodies in contact make the pair's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Combine {
    /// The smaller of the two.
    Min,
    /// The larger of the two.
    Max,
    /// Half the sum.
    Average,
    /// The product.
    Product,
    /// The square root of the product: 0 if either is 0.
    #[default]
    GeometricMean,
}

impl Combine {
    /// All rules with their names, in the order of their declaration, as scene files and Python write them.
    pub const NAMES: &[(&str, Combine)] = &[
        ("min", Combine::Min),
        ("max", Combine::Max),
        ("average", Combine::Average),
        ("product", Combine::Product),
        ("geometric_mean", Combine::GeometricMean),
    ];

    /// The rule's name.
    pub fn name(self) -> &'static str {
        Combine::NAMES[self as usize].0
    }

    /// The pair's constant.
    pub fn of(self, a: f64, b: f64) -> f64 {
        match self {
            Combine::Min => a.min(b),
            Combine::Max => a.max(b),
            Combine::Average => 0.5 * (a + b),
            Combine::Product => a * b,
            Combine::GeometricMean => (a * b).sqrt(),
        }
    }
}

/// Where and along what a test impulse acts: a world point and orthonormal axes, normal first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactFrame {
    /// World point, meters.
    pub point: Vec3,
    /// Normal and two tangents, unit, right-handed.
    pub axes: [Vec3; 3],
}

impl ContactFrame {
    /// A frame whose tangents are a fixed function of the normal.
    pub fn new(point: Vec3, normal: Vec3) -> ContactFrame {
        let smallest = normal.iamin();
        let first = normal.cross(&Vec3::ith(smallest, 1.0)).normalize();
        ContactFrame { point, axes: [normal, first, normal.cross(&first)] }
    }
}

/// An object with parts that collide. Its response to impulses comes from its [`Integratable`] side, if it has one.
pub trait Collidable {
    /// Number of parts; each has a row in the site table.
    fn parts(&self) -> usize;
    /// Shape of a part, in the part's frame; `None` for a part that meets nothing, and is there to be pushed at, joined or drawn.
    fn shape(&self, part: usize) -> Option<&Shape>;
    /// Surface of a part.
    fn material(&self, part: usize) -> Material;
    /// Kind of a part.
    fn collision_group(&self, part: usize) -> CollisionGroup;
    /// Whether a part meets parts of that kind. Two parts meet when both say so.
    fn collides_with(&self, part: usize, other: CollisionGroup) -> bool;
    /// How a part's mesh or cylinder collides; a pair goes by spheres if either side says so.
    fn contact_mode(&self, part: usize) -> ContactMode {
        let _ = part;
        ContactMode::Surface
    }
    /// Whether impulses can move a part at all: not what of a moving object is fixed to the world.
    fn part_moves(&self, part: usize) -> bool {
        let _ = part;
        true
    }
    /// Whether two parts of this same object meet.
    fn parts_collide(&self, part_a: usize, part_b: usize) -> bool {
        let _ = (part_a, part_b);
        false
    }
    /// "What would unit impulses along these axes at this point do?" (thesis `ApplyTestImpulse`). Adds `sign · L⁻ᵀJᵀ` to `y`: one
    /// row of `dof` numbers per axis.
    #[allow(clippy::too_many_arguments)]
    fn test_impulse(
        &self,
        cache: &mut Cache,
        part: usize,
        part_state: &PartState,
        point: &Vec3,
        axes: &[Vec3],
        sign: f64,
        y: &mut [f64],
    );
}

/// The test impulse of a single rigid part whose coordinates are `[ω; v]` at the site's origin.
pub fn rigid_test_impulse(
    body: &dyn Integratable,
    cache: &mut Cache,
    part_state: &PartState,
    point: &Vec3,
    axes: &[Vec3],
    sign: f64,
    y: &mut [f64],
) {
    let r = point - part_state.position();
    for (axis, y) in axes.iter().zip(y.chunks_exact_mut(6)) {
        let moment = r.cross(axis);
        let jacobian = [moment.x, moment.y, moment.z, axis.x, axis.y, axis.z];
        let mut response = [0.0; 6];
        body.solve_lt(cache, &jacobian, &mut response);
        for (y, response) in y.iter_mut().zip(response) {
            *y += sign * response;
        }
    }
}
