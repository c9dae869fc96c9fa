//! A model in the layout of the sweeps.
//!
//! Link `i` of the model is slot `i + 1`; slot 0 is the world. Links of revolute and prismatic
//! joints are rotated so that the joint axis is z: the *inner* frame of a link is its frame times
//! `own`. A revolute joint then changes two columns, and its axis in the world is the third.
//!
//! The inertia about the link's origin is stored as `λ·1 + n mᵀ + m nᵀ`. With principal moments `λ₁
//! ≥ λ₂ ≥ λ₃` and axes `e`:
//!
//! ```text
//! λ = λ₂    n = a e₁ + b e₃    m = a e₁ − b e₃    2a² = λ₁ − λ₂    2b² = λ₂ − λ₃
//! ```
//!
//! Rotating two vectors into the world takes fewer operations than rotating a matrix, and `λ` has
//! no gyroscopic torque.

use crate::articulated::model::joint::Joint;
use crate::articulated::model::{Inertias, Link, LinkMass, Model};
use crate::spatial::{Matrix, Vector};
use nalgebra::SymmetricEigen;
use tumble_collide::{Mat3, Vec3};

/// Joint of a link, as the sweeps distinguish it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::articulated) enum JointKind {
    Revolute,
    Prismatic,
    /// Index of its factor.
    Spherical(usize),
    /// Index of its factor.
    Floating(usize),
}

impl JointKind {
    /// Returns the number of degrees of freedom.
    pub fn dof(self) -> usize {
        match self {
            JointKind::Revolute | JointKind::Prismatic => 1,
            JointKind::Spherical(_) => 3,
            JointKind::Floating(_) => 6,
        }
    }
}

/// One link. Lengths and axes are in inner frames: the parent's for the placement, its own for the
/// mass.
#[derive(Clone, Debug)]
pub(in crate::articulated) struct CompiledLink {
    pub kind: JointKind,
    /// Slot of the parent.
    pub parent: usize,
    /// Index of its first position number.
    pub q: usize,
    /// Index of its first velocity number.
    pub v: usize,
    /// Inner axes at joint position 0, in the parent's inner axes.
    pub turned: Matrix<f64>,
    /// Origin of the joint in the parent's inner frame.
    pub offset: Vector<f64>,
    /// Inner axes in the link's axes.
    pub own: Mat3,
    pub mass: f64,
    /// Inertia that the joint adds to its pivot `D`.
    pub armature: f64,
    /// First moment of mass, kg·m.
    pub moment: Vector<f64>,
    /// `λ`.
    pub sphere: f64,
    /// `n` and `m`.
    pub pair: [Vector<f64>; 2],
}

/// All links, and the number of those with a factor of three or six rows.
#[derive(Clone, Debug)]
pub(in crate::articulated) struct Compiled {
    pub bodies: Vec<CompiledLink>,
    pub blocks: usize,
    pub positions: usize,
    pub dof: usize,
    /// The inertias of the model that it has.
    inertias: Inertias,
}

impl Compiled {
    /// Takes masses and armatures of the model, which may change between steps. Returns whether they did.
    pub fn set_inertias(&mut self, model: &Model) -> bool {
        if self.inertias.are(&model.inertias) {
            return false;
        }
        self.inertias = model.inertias.clone();
        for (body, link) in self.bodies.iter_mut().zip(model.links()) {
            (body.mass, body.armature) = (link.mass.mass, link.armature);
            body.moment = moment(&link.mass, &body.own);
            (body.sphere, body.pair) = biaxial(&link.mass, &body.own);
        }
        true
    }

    pub fn new(model: &Model) -> Compiled {
        let mut compiled = Compiled {
            bodies: Vec::with_capacity(model.links().len()),
            blocks: 0,
            positions: model.positions(),
            dof: model.dof(),
            inertias: model.inertias.clone(),
        };
        for link in model.links() {
            let outer = link.parent.map_or(Mat3::identity(), |p| compiled.bodies[p].own);
            let kind = compiled.kind(&link.joint);
            compiled.bodies.push(body(link, kind, &outer));
        }
        compiled
    }

    fn kind(&mut self, joint: &Joint) -> JointKind {
        let block = self.blocks;
        match joint {
            Joint::Prismatic { .. } => JointKind::Prismatic,
            Joint::Spherical | Joint::Floating => {
                self.blocks += 1;
                if *joint == Joint::Floating { JointKind::Floating(block) } else { JointKind::Spherical(block) }
            }
            // a model has no fixed links: they are folded into their parents
            Joint::Revolute { .. } | Joint::Fixed => JointKind::Revolute,
        }
    }
}

fn body(link: &Link, kind: JointKind, outer: &Mat3) -> CompiledLink {
    let own = match link.joint {
        Joint::Revolute { axis } | Joint::Prismatic { axis } => axes_with_z(&axis),
        _ => Mat3::identity(),
    };
    let placed = link.placement.rotation.to_rotation_matrix().into_inner();
    let (sphere, pair) = biaxial(&link.mass, &own);
    CompiledLink {
        kind,
        parent: link.parent.map_or(0, |p| p + 1),
        q: link.q,
        v: link.v,
        turned: (outer.transpose() * placed * own).into(),
        offset: (outer.transpose() * link.placement.translation.vector).into(),
        own,
        mass: link.mass.mass,
        armature: link.armature,
        moment: moment(&link.mass, &own),
        sphere,
        pair,
    }
}

/// Returns the first moment of mass, kg·m, in axes `own`.
fn moment(mass: &LinkMass, own: &Mat3) -> Vector<f64> {
    (mass.mass * (own.transpose() * mass.center)).into()
}

/// Returns right-handed unit axes with the third along `axis`; exact for coordinate axes.
fn axes_with_z(axis: &Vec3) -> Mat3 {
    let k = axis.iamin();
    let x = Vec3::ith(k, 1.0);
    let x = (x - axis * axis[k]).normalize();
    Mat3::from_columns(&[x, axis.cross(&x), *axis])
}

/// Returns `λ` and `n`, `m` of the inertia about the link's origin, in axes `own`.
fn biaxial(mass: &LinkMass, own: &Mat3) -> (f64, [Vector<f64>; 2]) {
    let about = own.transpose() * mass.about_origin() * own;
    let eigen = SymmetricEigen::new(0.5 * (about + about.transpose()));
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let [most, middle, least] = order.map(|i| eigen.eigenvalues[i]);
    let along = |k: usize, size: f64| -> Vec3 { eigen.eigenvectors.column(order[k]) * (0.5 * size.max(0.0)).sqrt() };
    let (a, b) = (along(0, most - middle), along(2, middle - least));
    (middle, [(a + b).into(), (a - b).into()])
}
