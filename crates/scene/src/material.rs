//! `[materials.NAME]`: what a surface does in a contact, and how it looks.

use crate::bound::Bound;
use crate::fields::Fields;
use crate::look::Appearance;

/// Friction of a body that says nothing.
pub(crate) const DEFAULT_FRICTION: f64 = 0.5;
/// Restitution of a body that says nothing.
pub(crate) const DEFAULT_RESTITUTION: f64 = 0.0;

/// A coefficient of friction.
pub(crate) const FRICTION: Bound = Bound::new(0.0, 100.0, "a friction coefficient from 0 to 100");
/// A coefficient of restitution.
pub(crate) const RESTITUTION: Bound = Bound::new(0.0, 1.0, "a restitution from 0 (no bounce) to 1 (no loss)");

/// A named material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialSpec {
    /// The NAME of `[materials.NAME]`.
    pub name: String,
    /// Coulomb's coefficient, at least 0; combined with the other body's. Default 0.5.
    pub friction: f64,
    /// Newton's coefficient, 0 to 1; combined with the other body's. Default 0.
    pub restitution: f64,
    /// Look of bodies of this material.
    pub look: Appearance,
}

impl MaterialSpec {
    pub(crate) fn read(name: &str, mut f: Fields<'_>) -> Self {
        let material = MaterialSpec {
            name: name.to_owned(),
            friction: f.number_or("friction", FRICTION, DEFAULT_FRICTION),
            restitution: f.number_or("restitution", RESTITUTION, DEFAULT_RESTITUTION),
            look: Appearance::read(&mut f, &Appearance::default()),
        };
        f.finish();
        material
    }
}
