//! From links to what the dynamics knows: a model, and a body with colliders, pictures and motors.

use tumble_core::Joint;
use tumble_core::articulated::{LinkMass, Model, ModelBuilder, ModelError};

use crate::link::LinkSpec;

/// The tree of links, with a mass for each.
pub(crate) fn model(links: &[LinkSpec], masses: &[LinkMass]) -> Result<Model, ModelError> {
    let mut builder = ModelBuilder::new();
    for (link, mass) in links.iter().zip(masses) {
        builder.link(&link.name, link.parent, link.joint.kind, link.placement, *mass);
    }
    builder.build()
}

/// Names of the joints that move, in the order of the model's links and so of its coordinates.
pub(crate) fn moving_joints(links: &[LinkSpec]) -> Vec<String> {
    links.iter().filter(|link| link.joint.kind != Joint::Fixed).map(|link| link.joint.name.clone()).collect()
}
