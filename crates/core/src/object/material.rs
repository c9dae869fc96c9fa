//! Surface constants of bodies and of pairs.

use tumble_collide::Vec3;

/// Surface constants of one body.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Material {
    /// Coefficient of restitution, 0 to 1.
    pub restitution: f64,
    /// Coefficient of Coulomb friction, at least 0.
    pub friction: f64,
    /// Coefficient of friction of surfaces at rest on each other, if larger than `friction`; 0 for none.
    /// Between rest and [`stribeck_speed`](Self::stribeck_speed) friction falls to `friction`.
    pub static_friction: f64,
    /// Sliding speed `v_s` of Stribeck's law, m/s, above 0: the coefficient at a speed `v` is `μ + (μ_s −
    /// μ)·exp(−(v/v_s)²)`.
    pub stribeck_speed: f64,
    /// Factors of `friction` along the axes of the part's frame, above 0 to 1e3: a surface with a grain. All
    /// 1 for a surface that is the same in every direction.
    pub friction_scale: Vec3,
    /// Moment of rolling friction per normal force, m, at least 0: how far the resultant of the normal
    /// force lies ahead of the center of a contact that rolls.
    pub rolling_friction: f64,
    /// Moment of torsional friction per normal force, m, at least 0, about the normal of a contact that
    /// does not slide: `⅔·μ·a` for a patch of radius `a` under uniform pressure, `3π/16·μ·a` under
    /// that of Hertz. A contact that slides and spins shares its friction between the two.
    pub torsional_friction: f64,
    /// Ratio of the tangential velocity after an impact to the reverse of that before it, 0 to 1, as far
    /// as friction permits: 1 for a superball, 0 for a contact that sticks or slides.
    pub tangential_restitution: f64,
    /// Force with which surfaces in contact attract each other, N, at least 0, shared by the points of a
    /// pair that touch.
    pub adhesion: f64,
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
        Material {
            restitution: 0.0,
            friction: 0.5,
            static_friction: 0.0,
            stribeck_speed: 1e-3,
            friction_scale: Vec3::repeat(1.0),
            rolling_friction: 0.0,
            torsional_friction: 0.0,
            tangential_restitution: 0.0,
            adhesion: 0.0,
            surface_velocity: Vec3::zeros(),
            id: 0,
        }
    }
}

impl Material {
    /// Returns the coefficient of friction of surfaces at rest on each other.
    pub fn friction_at_rest(&self) -> f64 {
        self.friction.max(self.static_friction)
    }

    /// Checks all ranges; the error is what is wrong: name, value and expected range.
    pub(crate) fn validate(&self) -> Result<(), (&'static str, f64, &'static str)> {
        let checks = [
            ("restitution", self.restitution, 0.0, 1.0, "between 0 and 1"),
            ("friction", self.friction, 0.0, f64::MAX, "at least 0"),
            ("static friction", self.static_friction, 0.0, f64::MAX, "at least 0"),
            ("Stribeck speed", self.stribeck_speed, f64::MIN_POSITIVE, f64::MAX, "above 0"),
            ("friction scale", self.friction_scale.min(), 1e-3, 1e3, "1e-3 to 1e3"),
            ("friction scale", self.friction_scale.max(), 1e-3, 1e3, "1e-3 to 1e3"),
            ("friction scale", self.friction_scale.sum(), 3e-3, 3e3, "1e-3 to 1e3"),
            ("rolling friction", self.rolling_friction, 0.0, f64::MAX, "at least 0"),
            ("torsional friction", self.torsional_friction, 0.0, f64::MAX, "at least 0"),
            ("tangential restitution", self.tangential_restitution, 0.0, 1.0, "between 0 and 1"),
            ("adhesion", self.adhesion, 0.0, f64::MAX, "at least 0"),
            ("surface velocity", self.surface_velocity.sum(), f64::MIN, f64::MAX, "finite"),
        ];
        let wrong = checks.into_iter().find(|(_, value, least, most, _)| !(least..=most).contains(&value));
        wrong.map_or(Ok(()), |(what, value, _, _, expected)| Err((what, value, expected)))
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
