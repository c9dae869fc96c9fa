//! Surface constants of chosen pairs.

use super::{World, WorldError};
use crate::contact::pair_material::{PairMaterial, PairSide};
use crate::object::Material;
use crate::world::view::ObjectId;

impl World {
    /// Sets restitution and the frictions for the contacts of two sides, from the next step on: two
    /// objects, two parts `(id, part)`, or two materials ([`PairSide::Material`]), in any order. A
    /// part takes precedence over its object, an object over its material. A constant that is
    /// `None` follows the rule of [`Settings`](crate::Settings); a pair whose constants are all `None` is removed. Forks
    /// have the same pairs; like materials they are not in [`save`](World::save). Removing an
    /// object removes its pairs.
    ///
    /// # Errors
    /// [`WorldError`]: an object that was removed, a part that it does not have, or a constant out
    /// of its range.
    pub fn set_pair_material(
        &mut self,
        a: impl Into<PairSide>,
        b: impl Into<PairSide>,
        material: PairMaterial,
    ) -> Result<(), WorldError> {
        let sides = [a.into(), b.into()];
        material.validate()?;
        sides.iter().try_for_each(|side| self.check_side(side))?;
        self.core.wake_all();
        self.core.pair_materials.set(sides, material);
        Ok(())
    }

    /// Returns all pairs that were set, in the order of their sides.
    pub fn pair_materials(&self) -> impl Iterator<Item = (&[PairSide; 2], &PairMaterial)> {
        self.core.pair_materials.iter()
    }

    /// Returns restitution, frictions and the other constants of contacts between these two parts.
    ///
    /// # Errors
    /// [`WorldError`]: an object that was removed, or a part that it does not have.
    pub fn pair_material(&self, a: (ObjectId, usize), b: (ObjectId, usize)) -> Result<Material, WorldError> {
        let in_order = self.part(a.0, a.1, &[])? <= self.part(b.0, b.1, &[])?;
        let (a, b) = if in_order { (a, b) } else { (b, a) };
        let [of_a, of_b] = [a, b].map(|side| self.material_of(side));
        Ok(self.core.pair_materials.combine(&self.core.settings, (a.0, a.1, &of_a), (b.0, b.1, &of_b)))
    }

    fn material_of(&self, (id, part): (ObjectId, usize)) -> Material {
        let material = self.object(id).and_then(|o| o.collidable()).map(|c| c.material(part));
        material.unwrap_or_default()
    }

    fn check_side(&self, side: &PairSide) -> Result<(), WorldError> {
        match *side {
            PairSide::Part(id, part) => self.part(id, part, &[]).map(drop),
            PairSide::Object(id) => self.object(id).map(drop).ok_or(WorldError::Stale),
            PairSide::Material(0) => Err(crate::SettingsError {
                what: "number of a pair's material",
                value: 0.0,
                expected: "above 0; 0 stands for none",
            }
            .into()),
            PairSide::Material(_) => Ok(()),
        }
    }
}
