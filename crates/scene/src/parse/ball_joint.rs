//! Keys of a spherical joint of a link: cone, twist, settings of single axes, and drives that hold the start.

use std::f64::consts::{PI, TAU};

use nalgebra::Quaternion;
use tumble_core::articulated::Drive;
use tumble_core::collide::{Quat, Vec3};

use crate::parse::bound::Bound;
use crate::parse::fields::Fields;
use crate::parse::joint::{JointSpec, Key, number, read_limits};

impl JointSpec {
    /// Reads the cone of a spherical joint of a link, the limits of its twist, and the axis of both.
    pub(super) fn read_swing_and_twist(&mut self, f: &mut Fields<'_>) {
        const EXPECTED: &str = "an axis of the joint's frame: [1, 0, 0], [0, 1, 0] or [0, 0, 1], or its letter";
        let cone = read_cone(f);
        let twist = read_limits(f, TWIST);
        let mut axis = 2;
        if let Some(value) = f.value("axis") {
            let problems = f.log.count();
            let given = f.as_direction("axis", value);
            let along: Vec<usize> = (0..3).filter(|k| given[*k] != 0.0).collect();
            match along[..] {
                _ if f.log.count() > problems => {}
                _ if cone.is_none() && twist.is_none() => {
                    f.wrong(
                        "axis",
                        value,
                        "none: a spherical joint without a cone and limits of the twist has no axis",
                    );
                }
                [k] => axis = k,
                _ => f.wrong("axis", value, EXPECTED),
            }
        }
        self.cone = cone.map(|cone| (axis, cone)).or(self.cone);
        if let Some(limits) = twist {
            self.twist_limits = limits.map(|limits| (axis, limits));
        }
        check_twist(f);
    }

    /// Reads the tables `dof` of a spherical joint of a link, each with settings of one degree of freedom, and with the cone and the
    /// limits of the twist about that axis.
    pub(super) fn read_own_dofs(&mut self, f: &mut Fields<'_>) {
        let tables = f.tables("dof", self.kind.dof());
        if tables.is_empty() {
            return;
        }
        let holds = |k: usize| self.dofs_hold_start.get(k).copied().unwrap_or(self.holds_start);
        let own = |k: usize| JointSpec {
            dof: self.dofs.get(k).unwrap_or(&self.dof).clone(),
            holds_start: holds(k),
            dofs: Vec::new(),
            ..self.clone()
        };
        let mut joints: Vec<JointSpec> = (0..self.kind.dof()).map(own).collect();
        for (joint, mut table) in joints.iter_mut().zip(tables) {
            joint.read_settings(&mut table, true, false);
            if let Some(cone) = read_cone(&mut table) {
                joint.dof.limits = Some([0.0, cone]);
            }
            if let Some(limits) = read_limits(&mut table, TWIST) {
                joint.dof.twist_limits = limits;
            }
            check_twist(&mut table);
            table.finish();
        }
        self.dofs_hold_start = joints.iter().map(|joint| joint.holds_start).collect();
        self.dofs = joints.into_iter().map(|joint| joint.dof).collect();
    }

    pub(super) fn settle_rotation(&mut self) {
        let holds = |k: usize| self.dofs_hold_start.get(k).copied().unwrap_or(self.holds_start);
        if !(0..3).any(holds) {
            return;
        }
        let start = match self.position[..] {
            [x, y, z, w] => Quat::new_normalize(Quaternion::new(w, x, y, z)).scaled_axis(),
            _ => Vec3::zeros(),
        };
        if self.dofs.is_empty() {
            self.dofs = vec![self.dof.clone(); 3];
        }
        for (k, holds) in [0, 1, 2].map(|k| (k, holds(k))) {
            if let (true, Drive::Position { target, .. }) = (holds, &mut self.dofs[k].drive) {
                *target = start[k];
            }
        }
    }
}

/// Keys of the limits of a twist.
pub(crate) const TWIST: Key = ("twist_limits_rad", Some("twist_limits_deg"));

/// Reads the half angle of a cone, rad.
pub(crate) fn read_cone(f: &mut Fields<'_>) -> Option<f64> {
    let problems = f.log.count();
    let cone = number(f, ("cone_rad", Some("cone_deg")))?;
    let keys = [("cone_rad", "an angle from 0 to π"), ("cone_deg", "an angle from 0 to 180")];
    for (key, expected) in keys {
        if let (false, true, Some(value)) = ((0.0..=PI).contains(&cone), f.log.count() == problems, f.value(key)) {
            f.wrong(key, value, expected);
        }
    }
    Some(cone)
}

/// Reports limits of a twist that no spherical joint can have.
pub(crate) fn check_twist(f: &mut Fields<'_>) {
    const EXPECTED: &str = "[lower, upper], at most 3π/2 (270°) apart and within 2π (360°) of 0; or false for none";
    for (key, turn) in [("twist_limits_rad", TAU), ("twist_limits_deg", 360.0)] {
        let problems = f.log.count();
        let Some(value) = f.value(key) else { continue };
        if value.get_ref().as_bool() == Some(false) {
            continue;
        }
        let [lower, upper]: [f64; 2] = f.as_vector(key, value, Bound::LIMIT);
        let fine = upper - lower <= 0.75 * turn && lower.abs().max(upper.abs()) <= turn;
        if f.log.count() == problems && lower <= upper && !fine {
            f.wrong(key, value, EXPECTED);
        }
    }
}
