//! Surface constants of bodies and of pairs.

use tumble_collide::Vec3;

/// Surface constants of one body.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Material {
    /// Coefficient of restitution, 0 to 1.
    pub restitution: f64,
    /// Coefficient of Coulomb friction, at least 0.
    pub friction: f64,
    /// Velocity of the surface over the body that carries it, in the frame of the part, m/s: a conveyor
    /// belt. Friction acts against the velocity of the other body over the surface; the component along the
    /// normal has no effect.
    pub surface_velocity: Vec3,
    /// Number by which [`World::set_pair_material`](crate::World::set_pair_material) selects parts
    /// of this material; 0 for none.
    pub id: u32,
}

impl Default for Material {
    fn default() -> Material {
        Material { restitution: 0.0, friction: 0.5, surface_velocity: Vec3::zeros(), id: 0 }
    }
}

/// Rule that combines a surface constant of two bodies in contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Combine {
    /// The smaller one.
    Min,
    /// The larger one.
    Max,
    /// Arithmetic mean.
    Average,
    /// The product.
    Product,
    /// Square root of the product: 0 if either is 0.
    #[default]
    GeometricMean,
}

impl Combine {
    /// All rules with their names in scene files and in Python, in the order of declaration.
    pub const NAMES: &[(&str, Combine)] = &[
        ("min", Combine::Min),
        ("max", Combine::Max),
        ("average", Combine::Average),
        ("product", Combine::Product),
        ("geometric_mean", Combine::GeometricMean),
    ];

    /// Returns the rule's name.
    pub fn name(self) -> &'static str {
        Combine::NAMES[self as usize].0
    }

    /// Returns the constant of the pair.
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
