//! The inertia that a force on joints meets in the reference configuration.

use std::collections::BTreeMap;

use tumble_core::Model;
use tumble_core::articulated::{Dynamics, LinkMass};

use super::scene::Assembly;
use crate::parse::link::LinkSpec;

/// Factors of the mass matrices of articulated bodies in the reference configuration, each made once.
#[derive(Default)]
pub(super) struct Inertias {
    trees: BTreeMap<usize, Option<(Model, Dynamics)>>,
}

impl Inertias {
    /// Returns the inertia that a force with these moment arms (link, arm) meets where all other joints
    /// are free: `1/(m·M⁻¹·mᵀ)`. `None` if nothing moves.
    pub(super) fn of(&mut self, arms: &[(usize, f64)], tree: usize, assembly: &Assembly<'_, '_>) -> Option<f64> {
        let made = self.trees.entry(tree).or_insert_with(|| factored(tree, assembly));
        let (model, dynamics) = made.as_ref()?;
        let links = &assembly.scene.articulated[tree].links;
        let mut j = vec![0.0; model.dof()];
        for (link, arm) in arms {
            j[model.links()[model.link(&links[*link].name)?].v] = *arm;
        }
        let mut y = vec![0.0; model.dof()];
        dynamics.solve_lt(&mut dynamics.scratch(), &j, &mut y);
        let mobility: f64 = y.iter().map(|y| y * y).sum();
        (mobility > 0.0 && mobility.is_finite()).then(|| 1.0 / mobility)
    }
}

/// Returns the model of a tree, and its dynamics in the reference configuration.
fn factored(tree: usize, assembly: &Assembly<'_, '_>) -> Option<(Model, Dynamics)> {
    let links = &assembly.scene.articulated[tree].links;
    let masses: Vec<LinkMass> = links.iter().map(LinkSpec::given_mass).collect();
    let model = crate::build::articulated::model(links, &masses).ok()?;
    let mut q = vec![0.0; model.positions()];
    model.write_zero(&mut q);
    let by_name: BTreeMap<&str, usize> = model.links().iter().map(|link| (link.name.as_str(), link.q)).collect();
    for (body, joints) in assembly.bodies.iter().zip(&assembly.joints) {
        let own = body.joints.iter().zip(joints).filter(|(joint, (of, _))| *of == tree && joint.is_single());
        for (joint, (_, link)) in own {
            q[*by_name.get(links[*link].name.as_str())?] = joint.reference;
        }
    }
    let mut dynamics = Dynamics::new(&model);
    dynamics.refresh(&q, &vec![0.0; model.dof()]);
    Some((model, dynamics))
}

/// Sets stiffness and damping of joints with `springdamper`, a time constant `T` and a damping ratio
/// `ζ`: `k = I/(T·ζ)²`, `c = 2I/T` for the inertia `I` that the joint meets.
pub(super) fn set_spring_dampers(assembly: &mut Assembly<'_, '_>) {
    let mut inertias = Inertias::default();
    let bodies = assembly.bodies;
    for (number, body) in bodies.iter().enumerate() {
        for (k, joint) in body.joints.iter().enumerate() {
            let (Some([time, ratio]), Some(&(tree, link))) = (joint.spring_damper, assembly.joints[number].get(k))
            else {
                continue;
            };
            let Some(inertia) = inertias.of(&[(link, 1.0)], tree, assembly) else { continue };
            let dof = &mut assembly.scene.articulated[tree].links[link].joint.dof;
            if assembly.reader.springs {
                let rest = dof.spring.map_or(joint.spring_rest, |spring| spring.rest);
                let stiffness = inertia / (time * ratio).powi(2).max(1e-15);
                dof.spring = Some(tumble_core::articulated::Spring { stiffness, rest });
            }
            if assembly.reader.dampers {
                dof.damping = 2.0 * inertia / time.max(1e-15);
            }
        }
    }
}
