//! Settings of loop joints: degrees of freedom, armature, cones, lengths, strength.

use super::turns::WIDE;
use super::{LoopJoint, LoopJointError, LoopJointKind, Transmission};
use crate::articulated::DofSettings;
use crate::articulated::twist_fault;
use std::f64::consts::{PI, TAU};

impl LoopJoint {
    /// Sets the constants of a gear, a rack, a screw or a pulley. The length of a pulley that was not given
    /// one follows them: its rope is taut in the poses in which it was made.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for a constant out of its range, and for limits that exclude the length of a pulley that
    /// follows them; [`LoopJointError::Parameter`] for a constant of another kind that is not the default one.
    pub fn set_transmission(&mut self, transmission: Transmission) -> Result<(), LoopJointError> {
        if let Some((what, value, expected)) = transmission.range_error() {
            return Err(LoopJointError::Range { name: self.name.clone(), what, value, expected });
        }
        if let (None, Some(limits)) = (self.length, self.dof().limits) {
            self.check_limits(limits, transmission.rope_length())?;
        }
        if let Some(parameter) = transmission.foreign_to(self.kind) {
            return Err(self.without(parameter));
        }
        self.transmission = transmission;
        Ok(())
    }

    /// Sets the teeth of two gears, the radius of a pinion, m, the pitch of a screw, m, or the ratio of a
    /// pulley, by a change of its constants.
    ///
    /// # Errors
    /// As [`set_transmission`](Self::set_transmission).
    pub fn with_transmission(mut self, change: impl FnOnce(&mut Transmission)) -> Result<Self, LoopJointError> {
        let mut transmission = self.transmission;
        change(&mut transmission);
        self.set_transmission(transmission)?;
        Ok(self)
    }

    /// Returns the constants of a gear, a rack, a screw or a pulley.
    pub fn transmission(&self) -> &Transmission {
        &self.transmission
    }

    /// Sets the settings of its first degree of freedom, or of all three of a spherical joint: limits, damping, friction,
    /// spring, drive, effort and velocity limit.
    ///
    /// # Errors
    /// As [`set_dof_at`](Self::set_dof_at).
    pub fn set_dof(&mut self, dof: DofSettings) -> Result<(), LoopJointError> {
        if self.kind != LoopJointKind::Spherical {
            return self.set_dof_at(0, dof);
        }
        (0..self.kind.dofs()).try_for_each(|k| self.check_dof(k, &dof))?;
        self.dofs.iter_mut().for_each(|own| own.settings.clone_from(&dof));
        Ok(())
    }

    /// Sets the settings of degree of freedom `k` in the order of [`LoopJointKind::dofs`]. Those of an angle are about an angle in
    /// (−π, π] without limits, and within π of the middle of its limits with them. A revolute joint with limits more than
    /// 3π/2 apart, or with a limit on one side (the other infinite), follows its angle from frame to frame instead, so it does not
    /// pass its stops. A joint of a world gets other limits by [`World::change_joint`](crate::World::change_joint). A spherical
    /// joint has [cones](Self::set_cone) and [limits of its twist](Self::set_twist_limits) instead of limits; targets and rest positions of its three
    /// degrees of freedom are the components of a rotation vector. A velocity drive of it that may meet them needs a largest torque.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for a setting out of its range, and for limits that exclude the length that the joint
    /// keeps; [`LoopJointError::Kind`] for a joint without such a degree of freedom.
    pub fn set_dof_at(&mut self, k: usize, dof: DofSettings) -> Result<(), LoopJointError> {
        self.check_dof(k, &dof)?;
        if let (LoopJointKind::Spring, Some(spring)) = (self.kind, dof.spring) {
            self.length = Some(spring.rest);
        }
        self.dofs[k].settings = dof;
        Ok(())
    }

    fn check_dof(&self, k: usize, dof: &DofSettings) -> Result<(), LoopJointError> {
        if k >= self.kind.dofs() {
            return match (k, *dof == DofSettings::default()) {
                (0, true) => Ok(()),
                _ => Err(self.wrong_dof(k)),
            };
        }
        if self.kind == LoopJointKind::Spherical && dof.limits.is_some() {
            return Err(self.wrong_kind("limits; it has a cone and limits of its twist"));
        }
        if let Some((what, value, expected)) = dof.range_error(true) {
            return Err(LoopJointError::Range { name: self.name.clone(), what, value, expected });
        }
        let own = match (self.kind, dof.spring) {
            (LoopJointKind::Spring, Some(spring)) => spring.rest,
            _ => self.length(),
        };
        if self.kind == LoopJointKind::Spring {
            self.check("the length of its spring", own, own >= 0.0, "at least 0")?;
        }
        if let Some(limits) = dof.limits {
            self.check_limits(limits, own)?;
        }
        let span = dof.limits.map_or(0.0, |[lo, hi]| hi - lo);
        let expected = match self.kind {
            LoopJointKind::Revolute if span.is_finite() && span > TAU => {
                "at most 2π, or infinite on one side: between two limits its angle has no count of turns"
            }
            LoopJointKind::Revolute => return Ok(()),
            kind if kind != LoopJointKind::Revolute && kind.turns_at(k) && span > WIDE => {
                "at most 3π/2: only a revolute joint follows its angle"
            }
            _ => return Ok(()),
        };
        self.check("the range of its limits", span, false, expected)
    }

    fn wrong_dof(&self, k: usize) -> LoopJointError {
        match self.kind.dofs() {
            0 => self.wrong_kind("limits, damping, friction, springs, drives and armature"),
            count => LoopJointError::NoDof { name: self.name.clone(), kind: self.kind.name(), dof: k, count },
        }
    }

    /// Sets the armature of its first degree of freedom, or of all three of a spherical joint: the inertia of a rotor between its sides, as the joint meets it, kg·m² or
    /// kg, at least 0. It acts against accelerations of the position. A rotor has no weight and no momentum of its own.
    ///
    /// # Errors
    /// As [`set_armature_at`](Self::set_armature_at).
    pub fn set_armature(&mut self, armature: f64) -> Result<(), LoopJointError> {
        let all = if self.kind == LoopJointKind::Spherical { 3 } else { 1 };
        (0..all).try_for_each(|k| self.set_armature_at(k, armature))
    }

    /// Sets the armature of degree of freedom `k`, kg·m² or kg, at least 0.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for a value out of its range, [`LoopJointError::Parameter`] for a joint whose positions are
    /// lengths, [`LoopJointError::Kind`] or [`LoopJointError::NoDof`] without such a degree of freedom.
    pub fn set_armature_at(&mut self, k: usize, armature: f64) -> Result<(), LoopJointError> {
        let fine = armature.is_finite() && (armature == 0.0 || (1e-12..=1e12).contains(&armature));
        self.check("the armature", armature, fine, "0, or from 1e-12 to 1e12")?;
        match k < self.kind.dofs() {
            _ if self.kind.has_length() && armature != 0.0 => return Err(self.without("armature")),
            false if armature != 0.0 || k > 0 => return Err(self.wrong_dof(k)),
            _ => self.dofs[k].armature = armature,
        }
        Ok(())
    }

    /// Sets the largest swing of a spherical joint, rad, 0 to π: the half angle of a cone about the z axis of B's frame in
    /// which the z axis of A's stays; `None` for none.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for an angle out of its range, [`LoopJointError::Parameter`] for another kind.
    pub fn set_cone(&mut self, cone: Option<f64>) -> Result<(), LoopJointError> {
        if self.kind != LoopJointKind::Spherical && cone.is_some() {
            return Err(self.without("cone"));
        }
        let angle = cone.unwrap_or(0.0);
        self.check("the cone", angle, (0.0..=PI).contains(&angle), "0 to π rad; None for none")?;
        self.cone = cone;
        Ok(())
    }

    /// Sets the limits of the twist of a spherical joint, rad, at most 3π/2 apart: of the rotation of A about its z axis after the shortest turn
    /// of B's z axis to it; `None` for none. The twist has no value where both axes are opposite: a cone below π keeps them
    /// from there.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for limits out of their range, [`LoopJointError::Parameter`] for another kind.
    pub fn set_twist_limits(&mut self, limits: Option<[f64; 2]>) -> Result<(), LoopJointError> {
        if self.kind != LoopJointKind::Spherical && limits.is_some() {
            return Err(self.without("twist_limits"));
        }
        if let Some((what, value, expected)) = limits.and_then(twist_fault) {
            return Err(LoopJointError::Range { name: self.name.clone(), what, value, expected });
        }
        self.twist_limits = limits;
        Ok(())
    }

    /// Sets the length of a distance, a rope or a spring, m.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for a length that is not finite and at least 0, or that the limits exclude,
    /// [`LoopJointError::Parameter`] for a joint without a length.
    pub fn set_length(&mut self, length: f64) -> Result<(), LoopJointError> {
        if !self.kind.has_length() {
            return Err(self.without("length"));
        }
        self.check("the length", length, length.is_finite() && length >= 0.0, "finite and at least 0")?;
        if let Some(limits) = self.dof().limits {
            self.check_limits(limits, length)?;
        }
        self.length = Some(length);
        if let (LoopJointKind::Spring, Some(spring)) = (self.kind, &mut self.dofs[0].settings.spring) {
            spring.rest = length;
        }
        Ok(())
    }

    /// Sets the force, N, and the torque about its point, N·m, above which the joint breaks; infinite
    /// if it does not.
    ///
    /// # Errors
    /// [`LoopJointError::Range`] for a number that is not above 0.
    pub fn set_breaking(&mut self, force: f64, torque: f64) -> Result<(), LoopJointError> {
        self.check("the breaking force", force, force > 0.0, "above 0; infinite for none")?;
        self.check("the breaking torque", torque, torque > 0.0, "above 0; infinite for none")?;
        (self.breaking_force, self.breaking_torque) = (force, torque);
        Ok(())
    }

    /// Sets the settings of its position.
    ///
    /// # Errors
    /// As [`set_dof`](Self::set_dof).
    pub fn with_dof(mut self, dof: DofSettings) -> Result<Self, LoopJointError> {
        self.set_dof(dof)?;
        Ok(self)
    }

    /// Sets the limits of its position, rad or m.
    ///
    /// # Errors
    /// As [`set_dof`](Self::set_dof).
    pub fn with_limits(self, limits: [f64; 2]) -> Result<Self, LoopJointError> {
        let dof = DofSettings { limits: Some(limits), ..self.dof().clone() };
        self.with_dof(dof)
    }

    /// Sets the settings of degree of freedom `k`.
    ///
    /// # Errors
    /// As [`set_dof_at`](Self::set_dof_at).
    pub fn with_dof_at(mut self, k: usize, dof: DofSettings) -> Result<Self, LoopJointError> {
        self.set_dof_at(k, dof)?;
        Ok(self)
    }

    /// Sets the armature of its first degree of freedom, or of all three of a spherical joint, kg·m² or kg.
    ///
    /// # Errors
    /// As [`set_armature`](Self::set_armature).
    pub fn with_armature(mut self, armature: f64) -> Result<Self, LoopJointError> {
        self.set_armature(armature)?;
        Ok(self)
    }

    /// Sets the largest swing of a spherical joint, rad.
    ///
    /// # Errors
    /// As [`set_cone`](Self::set_cone).
    pub fn with_cone(mut self, angle: f64) -> Result<Self, LoopJointError> {
        self.set_cone(Some(angle))?;
        Ok(self)
    }

    /// Sets the limits of the twist of a spherical joint, rad.
    ///
    /// # Errors
    /// As [`set_twist_limits`](Self::set_twist_limits).
    pub fn with_twist_limits(mut self, limits: [f64; 2]) -> Result<Self, LoopJointError> {
        self.set_twist_limits(Some(limits))?;
        Ok(self)
    }

    /// Sets the force of its motor, N·m or N, above 0: the limit of drives of Python and scenes that name none.
    ///
    /// # Errors
    /// As [`set_dof`](Self::set_dof).
    pub fn with_effort(self, effort: f64) -> Result<Self, LoopJointError> {
        let dof = DofSettings { effort, ..self.dof().clone() };
        self.with_dof(dof)
    }

    /// Sets the largest speed of its position, of a spherical joint that about each axis, rad/s or m/s.
    ///
    /// # Errors
    /// As [`set_dof`](Self::set_dof).
    pub fn with_max_velocity(self, max_velocity: f64) -> Result<Self, LoopJointError> {
        let dof = DofSettings { max_velocity, ..self.dof().clone() };
        self.with_dof(dof)
    }

    /// Sets the length of a distance, a rope or a spring, m.
    ///
    /// # Errors
    /// As [`set_length`](Self::set_length).
    pub fn with_length(mut self, length: f64) -> Result<Self, LoopJointError> {
        self.set_length(length)?;
        Ok(self)
    }

    /// Sets the force above which it breaks, N.
    ///
    /// # Errors
    /// As [`set_breaking`](Self::set_breaking).
    pub fn with_breaking_force(mut self, force: f64) -> Result<Self, LoopJointError> {
        self.set_breaking(force, self.breaking_torque)?;
        Ok(self)
    }

    /// Sets the torque above which it breaks, N·m.
    ///
    /// # Errors
    /// As [`set_breaking`](Self::set_breaking).
    pub fn with_breaking_torque(mut self, torque: f64) -> Result<Self, LoopJointError> {
        self.set_breaking(self.breaking_force, torque)?;
        Ok(self)
    }

    /// Returns the settings of its first degree of freedom; the default ones if it has none.
    pub fn dof(&self) -> &DofSettings {
        &self.dofs[0].settings
    }

    /// Returns the settings of degree of freedom `k`; `None` if there is no such one.
    pub fn dof_at(&self, k: usize) -> Option<&DofSettings> {
        self.dofs.get(k).filter(|_| k < self.kind.dofs()).map(|dof| &dof.settings)
    }

    /// Returns the armature of its first degree of freedom, kg·m² or kg.
    pub fn armature(&self) -> f64 {
        self.dofs[0].armature
    }

    /// Returns the armature of degree of freedom `k`, kg·m² or kg; `None` if there is no such one.
    pub fn armature_at(&self, k: usize) -> Option<f64> {
        self.dofs.get(k).filter(|_| k < self.kind.dofs()).map(|dof| dof.armature)
    }

    /// Returns the largest swing of a spherical joint, rad; `None` without one.
    pub fn cone(&self) -> Option<f64> {
        self.cone
    }

    /// Returns the limits of the twist of a spherical joint, rad; `None` without any.
    pub fn twist_limits(&self) -> Option<[f64; 2]> {
        self.twist_limits
    }

    /// Returns the length of a distance, a rope, a spring or a pulley, m.
    pub fn length(&self) -> f64 {
        self.length.unwrap_or_else(|| self.transmission.rope_length())
    }

    /// Returns the length that it was given, m; `None` of a pulley that has the length by default, and of kinds without one.
    pub fn given_length(&self) -> Option<f64> {
        self.length
    }

    /// Returns the force, N, and the torque, N·m, above which it breaks.
    pub fn breaking(&self) -> [f64; 2] {
        [self.breaking_force, self.breaking_torque]
    }
}
