//! Restitution and friction of chosen pairs, instead of what [`Settings`] makes of the materials of
//! two parts.

use crate::object::Material;
use crate::settings::{Settings, SettingsError};
use crate::world::view::ObjectId;
use std::collections::{BTreeMap, BTreeSet};

/// One side of a pair with surface constants of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PairSide {
    /// One part of an object.
    Part(ObjectId, usize),
    /// Every part of an object.
    Object(ObjectId),
    /// Every part whose [`Material::id`] is this, not 0.
    Material(u32),
}

impl From<ObjectId> for PairSide {
    fn from(id: ObjectId) -> PairSide {
        PairSide::Object(id)
    }
}

impl From<(ObjectId, usize)> for PairSide {
    fn from((id, part): (ObjectId, usize)) -> PairSide {
        PairSide::Part(id, part)
    }
}

/// Surface constants of a pair; `None` leaves a constant to the rule of [`Settings`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairMaterial {
    /// Coefficient of restitution, 0 to 1.
    pub restitution: Option<f64>,
    /// Coefficient of Coulomb friction, at least 0.
    pub friction: Option<f64>,
    /// Coefficient of rolling friction, m, at least 0.
    pub rolling_friction: Option<f64>,
    /// Coefficient of torsional friction, m, at least 0.
    pub torsional_friction: Option<f64>,
    /// Whether the two collide at all; `None`: if their groups and masks allow it. A pair that does
    /// not collide is not seen by sensors of the pair either. `true` does not override the groups.
    pub collides: Option<bool>,
}

impl PairMaterial {
    /// Checks all ranges.
    pub(crate) fn validate(&self) -> Result<(), SettingsError> {
        let check = |what, value: Option<f64>, most: f64, expected| match value {
            Some(value) if !(value.is_finite() && (0.0..=most).contains(&value)) => {
                Err(SettingsError { what, value, expected })
            }
            _ => Ok(()),
        };
        check("restitution of a pair", self.restitution, 1.0, "0 to 1")?;
        check("friction of a pair", self.friction, f64::MAX, "finite and at least 0")?;
        check("rolling friction of a pair", self.rolling_friction, f64::MAX, "finite and at least 0")?;
        check("torsional friction of a pair", self.torsional_friction, f64::MAX, "finite and at least 0")
    }
}

/// A part that is in contact, with its material.
pub(crate) type Surface<'a> = (ObjectId, usize, &'a Material);
/// A part, with [`Material::id`] of one of its shapes.
pub(crate) type SurfaceName = (ObjectId, usize, u32);

fn in_order(mut parts: [(ObjectId, usize); 2]) -> [(ObjectId, usize); 2] {
    parts.sort_unstable();
    parts
}

/// The chosen pairs of a world. Which side is named first makes no difference.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairMaterials {
    entries: BTreeMap<[PairSide; 2], PairMaterial>,
    /// Whether an entry that names a material decides whether its sides collide.
    select_by_material: bool,
    /// Parts that joints hold together: they collide only if an entry says so.
    joined: BTreeSet<[(ObjectId, usize); 2]>,
}

impl PairMaterials {
    /// Sets the constants of a pair; constants that are all `None` remove the pair.
    pub fn set(&mut self, mut sides: [PairSide; 2], material: PairMaterial) {
        sides.sort_unstable();
        match material == PairMaterial::default() {
            true => self.entries.remove(&sides),
            false => self.entries.insert(sides, material),
        };
        self.update();
    }

    fn update(&mut self) {
        let decides = |(sides, material): (&[PairSide; 2], &PairMaterial)| {
            material.collides.is_some() && sides.iter().any(|side| matches!(side, PairSide::Material(_)))
        };
        self.select_by_material = self.entries.iter().any(decides);
    }

    /// Returns whether shapes of one part may differ in what they ignore, by their materials.
    pub fn select_by_material(&self) -> bool {
        self.select_by_material
    }

    /// Returns all chosen pairs, in the order of their keys.
    pub fn iter(&self) -> impl Iterator<Item = (&[PairSide; 2], &PairMaterial)> {
        self.entries.iter()
    }

    /// Removes all pairs of an object.
    pub fn forget(&mut self, id: ObjectId) {
        let of = |side: &PairSide| matches!(side, PairSide::Part(other, _) | PairSide::Object(other) if *other == id);
        self.entries.retain(|sides, _| !sides.iter().any(of));
        self.joined.retain(|parts| parts.iter().all(|(other, _)| *other != id));
        self.update();
    }

    /// Returns the constants of a contact of two parts, `a` the one that was added first: for each
    /// constant the entry that names the pair most closely, or else the combination rule.
    pub fn combine(&self, settings: &Settings, a: Surface, b: Surface) -> Material {
        let name = |(id, part, material): Surface| (id, part, material.id);
        let chosen = if self.entries.is_empty() { PairMaterial::default() } else { self.of(name(a), name(b)) };
        let rule = |combine: crate::Combine, of: fn(&Material) -> f64| combine.of(of(a.2), of(b.2));
        let larger = |of: fn(&Material) -> f64| of(a.2).max(of(b.2));
        let at_rest = || rule(settings.combine_friction, Material::friction_at_rest);
        Material {
            restitution: chosen.restitution.unwrap_or_else(|| rule(settings.combine_restitution, |m| m.restitution)),
            friction: chosen.friction.unwrap_or_else(|| rule(settings.combine_friction, |m| m.friction)),
            static_friction: chosen.friction.unwrap_or_else(at_rest),
            stribeck_speed: larger(|m| m.stribeck_speed),
            rolling_friction: chosen.rolling_friction.unwrap_or_else(|| larger(|m| m.rolling_friction)),
            torsional_friction: chosen.torsional_friction.unwrap_or_else(|| larger(|m| m.torsional_friction)),
            tangential_restitution: larger(|m| m.tangential_restitution),
            adhesion: larger(|m| m.adhesion),
            ..Material::default()
        }
    }

    /// Returns whether a chosen pair, or else a joint, keeps two surfaces from colliding.
    pub fn ignores(&self, a: SurfaceName, b: SurfaceName) -> bool {
        let chosen = if self.entries.is_empty() { None } else { self.of(a, b).collides };
        chosen.map_or_else(|| self.joined.contains(&in_order([(a.0, a.1), (b.0, b.1)])), |collides| !collides)
    }

    /// Returns whether no two surfaces are kept from colliding.
    pub fn ignores_none(&self) -> bool {
        self.entries.is_empty() && self.joined.is_empty()
    }

    /// Adds two parts that a joint holds together.
    pub fn join(&mut self, parts: [(ObjectId, usize); 2]) {
        self.joined.insert(in_order(parts));
    }

    /// Forgets all joints.
    pub fn part_all(&mut self) {
        self.joined.clear();
    }

    /// A part goes before its object, and that before its material; between entries that name a
    /// pair equally closely the one that names `a` more closely decides.
    fn of(&self, a: SurfaceName, b: SurfaceName) -> PairMaterial {
        let sides = |(id, part, material): SurfaceName| {
            [PairSide::Part(id, part), PairSide::Object(id), PairSide::Material(material)]
        };
        let (a, b) = (sides(a), sides(b));
        const BY_CLOSENESS: [(usize, usize); 9] =
            [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (2, 0), (1, 2), (2, 1), (2, 2)];
        let found = || {
            BY_CLOSENESS.iter().filter_map(|&(i, j)| {
                let mut key = [a[i], b[j]];
                key.sort_unstable();
                self.entries.get(&key)
            })
        };
        PairMaterial {
            restitution: found().find_map(|entry| entry.restitution),
            friction: found().find_map(|entry| entry.friction),
            rolling_friction: found().find_map(|entry| entry.rolling_friction),
            torsional_friction: found().find_map(|entry| entry.torsional_friction),
            collides: found().find_map(|entry| entry.collides),
        }
    }
}
