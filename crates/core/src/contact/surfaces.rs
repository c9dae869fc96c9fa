//! The surface constants of the contacts of a pair of parts: those of the parts, or of single shapes of them.

use super::laws::ContactLaws;
use super::pair_material::{PairMaterials, Surface};
use crate::object::Material;
use crate::object::part_state::PartState;
use crate::settings::Settings;
use tumble_collide::Vec3;

/// The surfaces of a pair of parts, A first.
pub(crate) struct PairSurfaces<'a> {
    pub settings: &'a Settings,
    pub pair_materials: &'a PairMaterials,
    pub part_states: [&'a PartState; 2],
    /// Those of the parts.
    pub whole: [Surface<'a>; 2],
    /// Constants of single shapes of each part, ascending.
    pub of_shapes: [&'a [(usize, Material)]; 2],
}

/// The constants of a contact.
pub(crate) struct SurfaceLaws {
    pub friction: f64,
    pub restitution: f64,
    /// World axes, m/s, of A relative to B.
    pub surface_velocity: Vec3,
    pub laws: Option<Box<ContactLaws>>,
}

impl<'a> PairSurfaces<'a> {
    /// Returns the constants of a contact of two shapes.
    pub fn laws(&self, shapes: [u32; 2]) -> SurfaceLaws {
        let ([a, b], [state_a, state_b]) = (self.at(shapes), self.part_states);
        let material = self.pair_materials.combine(self.settings, a, b);
        let velocity = |state: &PartState, (.., material): Surface| state.pose.rotation * material.surface_velocity;
        SurfaceLaws {
            friction: material.friction,
            restitution: material.restitution,
            surface_velocity: velocity(state_a, a) - velocity(state_b, b),
            laws: ContactLaws::of_pair(&material, [(state_a, a.2), (state_b, b.2)]),
        }
    }

    /// Returns the surfaces of two shapes.
    fn at(&self, shapes: [u32; 2]) -> [Surface<'a>; 2] {
        [0, 1].map(|k| {
            let ((id, part, material), own) = (self.whole[k], self.of_shapes[k]);
            let found = own.binary_search_by_key(&(shapes[k] as usize), |(shape, _)| *shape);
            (id, part, found.map_or(material, |at| &own[at].1))
        })
    }
}
