//! Loop joints of a world: their forces, changes of their settings, and breaking.

use super::{Core, World, WorldError};
use crate::constraint::loop_joint::{JointForce, LoopJoint};
use crate::constraint::mimic::Mimic;
use crate::contact::warm_starts::RowStart;
use crate::world::view::{ObjectId, WorldView};

impl World {
    /// Returns the force that a loop joint carried in the last sub-step: the mean over it. Zero before
    /// the first step and for a joint that is broken or disabled. While its bodies sleep it is what holds
    /// them: the force with which they fell asleep. `None` if it was removed or is no loop joint.
    pub fn joint_force(&self, id: ObjectId) -> Option<JointForce> {
        let joint = self.get::<LoopJoint>(id)?;
        let serial = self.core.objects().get(id)?.serial;
        if !self.status(id)?.enabled {
            return Some(JointForce::default());
        }
        Some(joint.transmitted(&self.view(), self.core.row_forces(serial)))
    }

    /// Changes a loop joint between steps, and wakes the objects that it joins.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if it was removed, [`WorldError::NotJoint`] for another object, and the error of
    /// `change`, which changes nothing then.
    pub fn change_joint<E: From<WorldError>>(
        &mut self,
        id: ObjectId,
        change: impl FnOnce(&mut LoopJoint) -> Result<(), E>,
    ) -> Result<(), E> {
        let name = self.name(id).ok_or(WorldError::Stale)?.to_string();
        let joint = self.get_mut::<LoopJoint>(id).ok_or(WorldError::NotJoint(name))?;
        let mut changed = joint.clone();
        change(&mut changed)?;
        *joint = changed;
        self.fit_turns(id);
        Ok(())
    }
}

impl World {
    /// Returns the force of a [`Mimic`] along the position of the joint that follows, N·m or N: the mean over the last
    /// sub-step. Zero while it makes no row. `None` if it was removed or is no mimic.
    pub fn mimic_force(&self, id: ObjectId) -> Option<f64> {
        self.get::<Mimic>(id)?;
        let serial = self.core.objects().get(id)?.serial;
        let acts = self.status(id)?.enabled;
        Some(self.core.row_forces(serial).iter().filter(|_| acts).map(|row| row.force).sum())
    }

    /// Changes the multiplier and the offset (rad or m) of a [`Mimic`] between steps, and wakes the objects that it
    /// couples.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if it was removed, [`WorldError::NotJoint`] for another object, [`WorldError::Mimic`] for a
    /// number out of its range. Nothing changes then.
    pub fn set_mimic_ratio(&mut self, id: ObjectId, multiplier: f64, offset: f64) -> Result<(), WorldError> {
        let name = self.name(id).ok_or(WorldError::Stale)?.to_string();
        let mimic = self.get::<Mimic>(id).ok_or(WorldError::NotJoint(name.clone()))?;
        let changed = mimic.changed(multiplier, offset, &self.view())?;
        *self.get_mut::<Mimic>(id).ok_or(WorldError::NotJoint(name))? = changed;
        Ok(())
    }
}

impl Core {
    /// Returns whether any loop joint can break.
    pub(crate) fn has_breakable_joints(&self) -> bool {
        self.objects().iter().any(|e| {
            let any: &dyn std::any::Any = e.object;
            any.downcast_ref::<LoopJoint>().is_some_and(LoopJoint::is_breakable)
        })
    }

    /// Lists the parts that joints hold together.
    pub(crate) fn find_joined(&mut self) {
        self.pair_materials.part_all();
        let enabled = self.table.with(&self.state.objects).all().filter(|entry| entry.status.enabled);
        let joined = enabled.filter_map(|entry| entry.object.constraint()?.joined_parts());
        joined.for_each(|parts| self.pair_materials.join(parts));
    }

    /// Lists the joints that break under the forces of the rows of constraints, in N and N·m.
    pub(crate) fn break_joints(&mut self, rows: &[RowStart]) {
        let view = WorldView { implicit: self.implicit, ..self.view(self.state.time) };
        let mut broken = Vec::new();
        for rows in rows.chunk_by(|a, b| a.owner == b.owner) {
            let Some(entry) = self.by_serial(rows[0].owner).map(|place| self.objects().at(place)) else { continue };
            let any: &dyn std::any::Any = entry.object;
            let Some(joint) = any.downcast_ref::<LoopJoint>().filter(|joint| joint.is_breakable()) else { continue };
            if joint.breaks(&joint.transmitted(&view, rows)) {
                broken.push(entry.serial);
            }
        }
        self.broken.extend(broken);
    }

    /// Disables the joints that broke in the frame.
    pub(crate) fn disable_broken(&mut self) {
        self.broken.sort_unstable();
        self.broken.dedup();
        if !self.broken.is_empty() {
            self.forces.wrenches.clear();
        }
        for serial in &self.broken {
            if let Some(place) = self.by_serial(*serial) {
                self.state.objects[place].status.enabled = false;
            }
        }
        if !self.broken.is_empty() {
            self.find_joined();
        }
    }
}
