//! `[materials.NAME]`: contact constants and appearance of a surface.

use crate::parse::appearance::AppearanceSpec;
use crate::parse::bound::Bound;
use crate::parse::fields::Fields;

/// Friction of a body without its own.
pub(crate) const DEFAULT_FRICTION: f64 = 0.5;
/// Restitution of a body without its own.
pub(crate) const DEFAULT_RESTITUTION: f64 = 0.0;

/// Range of coefficients of friction.
pub(crate) const FRICTION: Bound = Bound::new(0.0, 100.0, "a friction coefficient from 0 to 100");
/// Range of coefficients of restitution.
pub(crate) const RESTITUTION: Bound = Bound::new(0.0, 1.0, "a restitution from 0 (no bounce) to 1 (no loss)");

/// A named material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialSpec {
    /// The NAME of `[materials.NAME]`.
    pub name: String,
    /// Coulomb's coefficient of friction, at least 0; combined with that of the other body. Default
    /// 0.5.
    pub friction: f64,
    /// Newton's coefficient of restitution, 0 to 1; combined with that of the other body. Default
    /// 0.
    pub restitution: f64,
    /// Appearance of bodies of this material.
    pub appearance: AppearanceSpec,
}

impl MaterialSpec {
    pub(crate) fn read(name: &str, mut f: Fields<'_>) -> Self {
        let material = MaterialSpec {
            name: name.to_owned(),
            friction: f.number_or("friction", FRICTION, DEFAULT_FRICTION),
            restitution: f.number_or("restitution", RESTITUTION, DEFAULT_RESTITUTION),
            appearance: AppearanceSpec::read(&mut f, &AppearanceSpec::default()),
        };
        f.finish();
        material
    }
}
