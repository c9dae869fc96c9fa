//! The impulses of a frame on every part, for sensors of forces.
//!
//! A sub-step adds the wrench of its forces, contacts and loop joints on each part, at the place of the part in the middle
//! of the sub-step. Constraints of other crates have rows without a place, and are not part of it.

use crate::ArticulatedBody;
use crate::constraint::loop_joint::LoopJoint;
use crate::constraint::mimic::Mimic;
use crate::contact::detect::ContactConstraint;
use crate::contact::warm_starts::RowStart;
use crate::object::part_state::Wrench;
use crate::sensor::Sensor;
use crate::step::PatchMoment;
use crate::world::Core;
use crate::world::view::WorldView;
use std::collections::BTreeMap;
use tumble_collide::Vec3;

/// Impulses of a frame; empty unless a sensor needs them.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameLoads {
    /// Whether they are collected in this frame.
    on: bool,
    /// Wrench-impulses of finished sub-steps on each part: a torque about the world's origin, N·m·s, and a force, N·s.
    pub parts: Vec<Wrench>,
    /// Impulses along the normals of contacts.
    pub touches: Vec<TouchLoad>,
    /// Impulses of loop joints on their side A, by serial number.
    pub joints: BTreeMap<u32, JointLoad>,
    /// Impulses of the drives and of applied generalized forces on each degree of freedom, N·m·s or N·s.
    pub drives: Vec<f64>,
    /// Numbers of the present sub-step.
    pending: Pending,
}

/// Impulse of a contact along its normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TouchLoad {
    /// Rows in the table of part states.
    pub parts: [u32; 2],
    /// World point, m.
    pub point: Vec3,
    /// N·s.
    pub impulse: f64,
}

/// Impulse of a loop joint on side A: force, N·s; torque about its point on A, N·m·s; drive.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct JointLoad {
    pub force: Vec3,
    pub torque: Vec3,
    pub drive: f64,
}

/// Forces of a sub-step that is not finished.
#[derive(Clone, Debug, Default)]
struct Pending {
    /// Wrench on each part about its origin.
    wrenches: Vec<Wrench>,
    /// Positions of the parts at the start of the sub-step.
    from: Vec<Vec3>,
    touches: Vec<TouchLoad>,
    joints: Vec<(u32, JointLoad)>,
    /// Forces of the rows of constraints, N or N·m.
    rows: Vec<RowStart>,
}

impl Pending {
    fn clear(&mut self) {
        self.wrenches.clear();
        self.from.clear();
        self.touches.clear();
        self.joints.clear();
        self.rows.clear();
    }
}

impl FrameLoads {
    /// Adds a frame's impulse on the part in a row, at a world point.
    pub fn add(&mut self, row: usize, impulse: &Vec3, point: &Vec3) {
        if let Some(wrench) = self.parts.get_mut(row) {
            wrench.force += impulse;
            wrench.torque += point.cross(impulse);
        }
    }
}

/// Forces of a solved sub-step, or impulses of an impact.
pub(crate) struct SubstepForces<'a> {
    pub constraints: &'a [ContactConstraint],
    /// On side A of each contact.
    pub forces: Vec<Vec3>,
    pub moments: &'a [PatchMoment],
    /// Factor of the moments that makes them torques.
    pub scale: f64,
    /// Forces of the rows of constraints.
    pub rows: Vec<RowStart>,
}

impl Core {
    /// Starts a frame: decides whether any sensor needs its impulses.
    pub(crate) fn start_loads(&mut self) {
        let needs =
            |object: &dyn std::any::Any| object.downcast_ref::<Sensor>().is_some_and(|s| s.kind().needs_loads());
        let on = self.objects().iter().any(|entry| entry.status.enabled && needs(entry.object));
        let loads = &mut self.loads;
        loads.on = on;
        loads.touches.clear();
        loads.joints.clear();
        loads.pending.clear();
        loads.parts.clear();
        loads.drives.clear();
        if on {
            loads.parts.resize(self.derived.part_states.len(), Wrench::default());
            loads.drives.resize(self.dof, 0.0);
        }
    }

    /// Returns whether the impulses of this frame are collected.
    pub(crate) fn collects_loads(&self) -> bool {
        self.loads.on
    }

    /// Stores the forces of the present sub-step, whose part states are those at its start. What was stored before in the
    /// same sub-step is dropped.
    pub(crate) fn load_substep(&mut self, solved: &SubstepForces) {
        let mut pending = std::mem::take(&mut self.loads.pending);
        pending.clear();
        pending.wrenches.extend_from_slice(&self.forces.wrenches);
        self.load_rows(solved, &mut pending);
        self.loads.pending = pending;
    }

    /// Adds the impulses of an impact between two sub-steps.
    pub(crate) fn load_impact(&mut self, solved: &SubstepForces) {
        let mut struck = Pending::default();
        self.load_rows(solved, &mut struck);
        let at = struck.from.clone();
        self.loads.keep(&struck, &at, 1.0);
    }

    fn load_rows(&self, solved: &SubstepForces, out: &mut Pending) {
        out.from.extend(self.derived.part_states.iter().map(|state| state.position()));
        out.wrenches.resize(out.from.len(), Wrench::default());
        self.load_contacts(solved, out);
        self.load_joints(&solved.rows, out);
        out.rows.extend_from_slice(&solved.rows);
    }

    fn load_contacts(&self, solved: &SubstepForces, out: &mut Pending) {
        for (constraint, on_a) in solved.constraints.iter().zip(&solved.forces) {
            for (part, sign) in [(constraint.a, 1.0), (constraint.b, -1.0)] {
                let state = &self.derived.part_states[part as usize];
                let (arm, force) = (constraint.point_on(part, state) - state.position(), sign * on_a);
                let wrench = &mut out.wrenches[part as usize];
                wrench.force += force;
                wrench.torque += arm.cross(&force);
            }
            let impulse = on_a.dot(&constraint.contact.normal);
            if impulse > 0.0 {
                let parts = [constraint.a, constraint.b];
                out.touches.push(TouchLoad { parts, point: constraint.contact.point, impulse });
            }
        }
        for patch in solved.moments {
            let (constraint, torque) = (&solved.constraints[patch.contact], solved.scale * patch.moment);
            out.wrenches[constraint.a as usize].torque += torque;
            out.wrenches[constraint.b as usize].torque -= torque;
        }
    }

    fn load_joints(&self, rows: &[RowStart], out: &mut Pending) {
        let view = WorldView { implicit: self.implicit, ..self.view(self.state.time) };
        for rows in rows.chunk_by(|a, b| a.owner == b.owner) {
            let Some(entry) = self.by_serial(rows[0].owner).map(|place| self.objects().at(place)) else { continue };
            let any: &dyn std::any::Any = entry.object;
            if let Some(joint) = any.downcast_ref::<LoopJoint>() {
                let sum = joint.transmitted(&view, rows);
                out.joints
                    .push((entry.serial, JointLoad { force: sum.force, torque: sum.torque, drive: sum.drives[0] }));
                joint.add_wrenches(&view, rows, &mut out.wrenches);
            } else if let Some(mimic) = any.downcast_ref::<Mimic>() {
                rows.iter().for_each(|row| mimic.add_wrenches(&view, row.force, &mut out.wrenches));
            }
        }
    }

    /// Ends a sub-step of `h` seconds, after the part states are those of its end.
    pub(crate) fn keep_loads(&mut self, h: f64) {
        if !self.loads.on {
            return;
        }
        let to: Vec<Vec3> = self.derived.part_states.iter().map(|state| state.position()).collect();
        let mut pending = std::mem::take(&mut self.loads.pending);
        self.loads.keep(&pending, &to, h);
        self.keep_drives(&pending.rows, h);
        pending.clear();
        self.loads.pending = pending;
    }

    /// Adds the impulses of the drives of articulated bodies in a sub-step of `h` seconds.
    fn keep_drives(&mut self, rows: &[RowStart], h: f64) {
        let mut drives = std::mem::take(&mut self.loads.drives);
        for entry in self.objects().iter().filter(|entry| entry.moves()) {
            let any: &dyn std::any::Any = entry.object;
            let Some(body) = any.downcast_ref::<ArticulatedBody>() else { continue };
            let start = rows.partition_point(|row| row.owner < entry.serial);
            let own = rows[start..].partition_point(|row| row.owner == entry.serial);
            let (x, v) = (&self.state.x[entry.state_range.x.clone()], entry.state_range.v.clone());
            body.add_drives(x, self.state.time, &rows[start..start + own], h, &mut drives[v]);
        }
        self.loads.drives = drives;
    }
}

impl FrameLoads {
    /// Adds forces over `h` seconds, in which the parts moved to `to`.
    fn keep(&mut self, pending: &Pending, to: &[Vec3], h: f64) {
        let parts = self.parts.iter_mut().zip(&pending.wrenches).zip(pending.from.iter().zip(to));
        for ((sum, wrench), (from, to)) in parts {
            let force = h * wrench.force;
            sum.force += force;
            sum.torque += h * wrench.torque + (0.5 * (from + to)).cross(&force);
        }
        self.touches.extend(pending.touches.iter().map(|touch| TouchLoad { impulse: h * touch.impulse, ..*touch }));
        for (serial, load) in &pending.joints {
            let sum = self.joints.entry(*serial).or_default();
            sum.force += h * load.force;
            sum.torque += h * load.torque;
            sum.drive += h * load.drive;
        }
    }
}
