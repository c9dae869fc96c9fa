//! Rows against finite differences: errors, velocities and biases of every kind, on dynamic,
//! kinematic and static bodies.

use super::*;
use crate::articulated::DofSettings;
use crate::constraint::rows::Rows;
use crate::object::part_state::{PartState, StateSizes};
use crate::rigid::RigidBody;
use crate::world::ObjectState;
use crate::world::view::{Mode, Status, Table};
use tumble_collide::{Pose, Quat, Shape, Vec3};

/// Two bodies of one part each in a table, with their state and part states.
struct Pairing {
    table: Table,
    states: Vec<ObjectState>,
    ids: Vec<ObjectId>,
    x: Vec<f64>,
    part_states: Vec<PartState>,
    dof: usize,
}

/// The rows of a loop joint at a state.
struct RecordedRows {
    errors: Vec<f64>,
    velocities: Vec<f64>,
    biases: Vec<f64>,
}

impl Pairing {
    fn new(bodies: Vec<(RigidBody, Mode)>) -> Pairing {
        let mut all = Pairing {
            table: Table::default(),
            states: Vec::new(),
            ids: Vec::new(),
            x: Vec::new(),
            part_states: Vec::new(),
            dof: 0,
        };
        for (serial, (body, mode)) in bodies.into_iter().enumerate() {
            let Some(StateSizes { x, dof, parts }) = (&body as &dyn Object).integratable().map(|i| i.state_sizes())
            else {
                continue;
            };
            let state_range = StateRange {
                x: all.x.len()..all.x.len() + x,
                v: all.dof..all.dof + dof,
                parts: all.part_states.len()..all.part_states.len() + parts,
            };
            all.x.resize(state_range.x.end, 0.0);
            all.part_states.resize(state_range.parts.end, PartState::default());
            all.dof = state_range.v.end;
            crate::object::Integratable::write_initial(&body, &mut all.x[state_range.x.clone()]);
            let status = Status { mode, ..Status::default() };
            all.states.push(ObjectState { serial: serial as u32, status, ..ObjectState::default() });
            all.ids.push(all.table.push("".into(), Box::new(body), state_range));
        }
        all
    }

    /// Everything moves on for `t` with its generalized velocity held.
    fn after(&self, t: f64) -> Pairing {
        let mut next = Pairing {
            table: self.table.clone(),
            states: self.states.clone(),
            ids: self.ids.clone(),
            x: self.x.clone(),
            part_states: self.part_states.clone(),
            dof: self.dof,
        };
        let Pairing { table, states, x, part_states, .. } = &mut next;
        for (entry, state) in table.placed.iter().zip(states) {
            let x = &mut x[entry.state_range.x.clone()];
            if let (Some(body), true) = (entry.object.integratable(), state.status.mode != Mode::Static) {
                let mut v = vec![0.0; entry.state_range.v.len()];
                body.velocity(x, &mut v);
                body.integrate_positions(x, &v, t);
                body.write_velocity(x, &v);
            }
            let part_states = &mut part_states[entry.state_range.parts.clone()];
            entry.object.refresh(x, &mut entry.object.new_cache(), part_states);
            if state.status.mode == Mode::Static {
                part_states.iter_mut().for_each(|s| *s = PartState { pose: s.pose, ..PartState::default() });
            }
        }
        next
    }

    fn record(&self, rows_of: impl FnOnce(&WorldView, &mut RowBuilder)) -> RecordedRows {
        let (mut rows, mut bias, mut targets, mut kinds, mut problem) =
            (Rows::default(), Vec::new(), Vec::new(), Vec::new(), None);
        rows.clear(self.dof);
        let mut caches: Vec<_> = self.table.placed.iter().map(|placed| placed.object.new_cache()).collect();
        for (placed, cache) in self.table.placed.iter().zip(&mut caches) {
            let mut part_states = self.part_states[placed.state_range.parts.clone()].to_vec();
            placed.object.refresh(&self.x[placed.state_range.x.clone()], cache, &mut part_states);
        }
        let view = WorldView {
            time: 0.0,
            gravity: Vec3::zeros(),
            implicit: true,
            x: &self.x,
            part_states: &self.part_states,
            objects: self.table.with(&self.states),
            threads: &crate::threads::Threads::NONE,
        };
        let mut out = RowBuilder {
            rows: &mut rows,
            bias: &mut bias,
            targets: &mut targets,
            kinds: &mut kinds,
            objects: self.table.with(&self.states),
            x: &self.x,
            caches: &mut caches,
            part_states: &self.part_states,
            problem: &mut problem,
            owner: ObjectId::default(),
        };
        rows_of(&view, &mut out);
        assert_eq!(problem, None);
        let mut u = vec![0.0; self.dof];
        for entry in self.table.with(&self.states).iter() {
            if let Some(body) = entry.object.integratable() {
                body.whitened_velocity(
                    &mut caches[entry.place],
                    &self.x[entry.state_range.x.clone()],
                    &mut u[entry.state_range.v.clone()],
                );
            }
        }
        rows.add_velocity(&u, &mut bias);
        RecordedRows {
            errors: targets.iter().map(|t| t.error).collect(),
            velocities: bias,
            biases: targets.iter().map(|t| t.bias_acceleration).collect(),
        }
    }

    fn record_loop_joint(&self, loop_joint: &LoopJoint) -> RecordedRows {
        self.record(|view, out| {
            loop_joint.rows(&StateRange::default(), view, Level::Acceleration { h: 1.0, soft: None }, out)
        })
    }
}

fn body(name: &str, pose: Pose, velocity: Vec3, spin: Vec3) -> RigidBody {
    let shape = Shape::cuboid(Vec3::new(0.6, 0.4, 0.2)).unwrap();
    RigidBody::new(shape)
        .with_name(name)
        .with_mass(2.0)
        .with_pose(pose)
        .with_velocity(velocity)
        .with_angular_velocity(spin)
}

/// Two bodies whose frames are parallel (so that rotations are closed) and `offset` apart.
fn pairing(modes: [Mode; 2], offset: Vec3) -> (Pairing, [Anchor; 2]) {
    let frames = [
        Pose::new(Vec3::new(0.2, -0.1, 0.3), Vec3::new(0.5, 1.0, -0.7)),
        Pose::new(Vec3::new(-0.3, 0.2, 0.1), Vec3::new(-0.4, 0.3, 1.1)),
    ];
    let closed = Pose::new(Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.3, -0.8, 0.6));
    let places = [Pose::from_parts((closed.translation.vector + offset).into(), closed.rotation), closed];
    let bodies = [
        (Vec3::new(1.0, -2.0, 0.5), Vec3::new(3.0, -1.0, 2.0)),
        (Vec3::new(-0.5, 0.7, 1.5), Vec3::new(-2.0, 1.5, 0.5)),
    ];
    let made = (0..2)
        .map(|i| (body(["a", "b"][i], places[i] * frames[i].inverse(), bodies[i].0, bodies[i].1), modes[i]))
        .collect();
    let pairing = Pairing::new(made).after(0.0);
    let anchors = [0, 1].map(|i| Anchor::on(pairing.ids[i], 0, frames[i]));
    (pairing, anchors)
}

const KINDS: [(LoopJointKind, usize); 11] = [
    (LoopJointKind::Spherical, 3),
    (LoopJointKind::Revolute, 5),
    (LoopJointKind::Fixed, 6),
    (LoopJointKind::Prismatic, 5),
    (LoopJointKind::Cylindrical, 4),
    (LoopJointKind::Universal, 4),
    (LoopJointKind::Planar, 3),
    (LoopJointKind::Distance, 1),
    (LoopJointKind::Gear, 1),
    (LoopJointKind::Rack, 1),
    (LoopJointKind::Screw, 5),
];
const MODES: [[Mode; 2]; 4] = [
    [Mode::Dynamic, Mode::Dynamic],
    [Mode::Dynamic, Mode::Kinematic],
    [Mode::Kinematic, Mode::Dynamic],
    [Mode::Dynamic, Mode::Static],
];

#[test]
fn velocities_are_the_rates_of_errors_and_biases_the_rates_of_velocities() {
    let t = 1e-5;
    for (kind, rows) in KINDS {
        for modes in MODES {
            let (pairing, [a, b]) = pairing(modes, Vec3::new(0.3, -0.2, 0.4));
            // with a static or kinematic side, and with the world instead
            let world = Anchor::world(pairing.part_states[1].pose * b.frame);
            let sides = if modes[1] == Mode::Static { vec![(a, b), (a, world), (world, a)] } else { vec![(a, b)] };
            for (a, b) in sides {
                let mut loop_joint = match LoopJoint::new("joint", kind, a, b) {
                    Err(LoopJointError::OnePart(..)) => continue,
                    made => made.unwrap(),
                };
                let constants = Transmission { teeth: [3, -2], radius: 0.2, pitch: 0.3, ..Transmission::default() };
                let place = |side: Anchor| {
                    side.part.map_or(side.frame, |(id, part)| {
                        let first = pairing.table.get(id).unwrap().state_range.parts.start;
                        pairing.part_states[first + part].pose * side.frame
                    })
                };
                loop_joint.transmission = Transmission { references: [place(a), place(b)], ..constants };
                let [before, now, after] = [-t, 0.0, t].map(|t| pairing.after(t).record_loop_joint(&loop_joint));
                assert_eq!(now.errors.len(), rows);
                for i in 0..rows {
                    let rate = (after.errors[i] - before.errors[i]) / (2.0 * t);
                    assert!(
                        (rate - now.velocities[i]).abs() < 1e-8,
                        "{kind:?} {modes:?} row {i}: velocity {}, error's rate {rate}",
                        now.velocities[i]
                    );
                    let rate = (after.velocities[i] - before.velocities[i]) / (2.0 * t);
                    assert!(
                        (rate - now.biases[i]).abs() < 1e-7,
                        "{kind:?} {modes:?} row {i}: bias {}, velocity's rate {rate}",
                        now.biases[i]
                    );
                }
            }
        }
    }
}

#[test]
fn a_row_on_a_rotation_has_the_angular_velocity_along_its_axis() {
    for modes in MODES {
        let (pairing, _) = pairing(modes, Vec3::zeros());
        for axis in [Vec3::z(), Vec3::new(0.6, -0.8, 0.0), Vec3::new(1.0, 2.0, -2.0) / 3.0] {
            let row = |ends: &[(usize, f64)]| {
                let recorded = pairing.record(|_, out| {
                    let row = out.row(RowTarget::new(RowSet::Equality, 0.0));
                    ends.iter().for_each(|&(i, sign)| {
                        row.on_rotation(pairing.ids[i], 0, &axis, sign);
                    });
                });
                recorded.velocities[0]
            };
            let spin = |i: usize| pairing.part_states[i].angular_velocity.dot(&axis);
            assert!((row(&[(0, 1.0), (1, -2.0)]) - (spin(0) - 2.0 * spin(1))).abs() < 1e-13, "{modes:?}");
            // both sides on one part: nothing is left
            assert!(row(&[(0, 1.0), (0, -1.0)]).abs() < 1e-13, "{modes:?}");
        }
    }
}

#[test]
fn errors_of_rotations_are_the_rotation_that_is_left() {
    // A is turned against B by a rotation vector of the world
    let frame = Pose::new(Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.4, -0.9, 0.2));
    for turn in [Vec3::new(1e-6, -2e-6, 3e-6), Vec3::new(0.5, 1.0, -0.3)] {
        let turned = Pose::from_parts(frame.translation, Quat::from_scaled_axis(turn) * frame.rotation);
        let pairing = Pairing::new(vec![(body("a", turned, Vec3::zeros(), Vec3::zeros()), Mode::Dynamic)]).after(0.0);
        let recorded = |kind| {
            pairing.record_loop_joint(
                &LoopJoint::new("joint", kind, Anchor::on(pairing.ids[0], 0, Pose::identity()), Anchor::world(frame))
                    .unwrap(),
            )
        };
        let fixed = recorded(LoopJointKind::Fixed);
        assert!((Vec3::from_column_slice(&fixed.errors[3..]) - turn).norm() < 1e-12, "{:?}", fixed.errors);
        // a hinge does not see the turn about its axis: z_B and the tilt make z_A
        let hinge = recorded(LoopJointKind::Revolute);
        let tilt = frame.rotation * Vec3::new(hinge.errors[3], hinge.errors[4], 0.0);
        let reached = Quat::from_scaled_axis(tilt) * (frame.rotation * Vec3::z());
        assert!((reached - turned.rotation * Vec3::z()).norm() < 1e-12);
    }
}

/// Checks the rows from `first` on: velocities are the rates of `errors`, and biases those of velocities.
fn check_rates(pairing: &Pairing, joint: &LoopJoint, first: usize, errors: usize) -> RecordedRows {
    let t = 1e-5;
    let [before, now, after] = [-t, 0.0, t].map(|t| pairing.after(t).record_loop_joint(joint));
    for row in first..now.errors.len() {
        if row < first + errors {
            let rate = (after.errors[row] - before.errors[row]) / (2.0 * t);
            let velocity = now.velocities[row];
            assert!((rate - velocity).abs() < 1e-8, "{:?} row {row}: {velocity} {rate}", joint.kind());
        }
        let rate = (after.velocities[row] - before.velocities[row]) / (2.0 * t);
        assert!((rate - now.biases[row]).abs() < 1e-7, "{:?} row {row}: {} {rate}", joint.kind(), now.biases[row]);
    }
    now
}

#[test]
fn swing_and_twist_of_a_spherical_joint_have_the_rates_and_biases_of_their_rows() {
    for modes in MODES {
        let (pairing, [mut a, b]) = pairing(modes, Vec3::zeros());
        let (swing, twist) = (0.9, 0.6);
        let tilt = Quat::from_scaled_axis(Vec3::new(0.6, -0.8, 0.0) * swing);
        a.frame.rotation *= (tilt * Quat::from_scaled_axis(Vec3::z() * twist)).inverse();
        let dof = DofSettings { friction: 2.0, ..DofSettings::default() };
        let joint = LoopJoint::new("joint", LoopJointKind::Spherical, b, a).unwrap().with_dof(dof).unwrap();
        let joint = joint.with_cone(1.5).unwrap().with_twist_limits([-1.0, 2.0]).unwrap();
        // three of the origin, the cone, two of the twist, friction about three axes
        let now = check_rates(&pairing, &joint, 3, 3);
        assert_eq!(now.errors.len(), 9);
        for (row, gap) in [(3, 1.5 - swing), (4, twist + 1.0), (5, 2.0 - twist)] {
            assert!((now.errors[row] - gap).abs() < 1e-12, "row {row}: {}", now.errors[row]);
        }
    }
}

/// The positions are the numbers by which A's frame was moved, at any of them, and their rows have their rates.
#[test]
fn positions_of_joints_of_several_degrees_of_freedom_have_the_rates_of_their_rows() {
    let along = |k: usize, x: f64| Pose::from_parts((Vec3::ith(k, 1.0) * x).into(), Quat::identity());
    let about =
        |k: usize, x: f64| Pose::from_parts(Vec3::zeros().into(), Quat::from_scaled_axis(Vec3::ith(k, 1.0) * x));
    let cases = [
        (LoopJointKind::Cylindrical, vec![0.4, -0.7], along(2, 0.4) * about(2, -0.7), 4),
        (LoopJointKind::Universal, vec![0.8, -1.1], about(0, -1.1) * about(2, 0.8), 4),
        (LoopJointKind::Planar, vec![0.3, -0.2, 1.2], along(0, 0.3) * along(1, -0.2) * about(2, 1.2), 3),
    ];
    for modes in MODES {
        for (kind, positions, moved, held) in &cases {
            let (pairing, [a, mut b]) = pairing(modes, Vec3::zeros());
            b.frame *= moved.inverse();
            let mut joint = LoopJoint::new("joint", *kind, a, b).unwrap();
            for k in 0..positions.len() {
                let dof = DofSettings { limits: Some([-2.0, 2.5]), friction: 1.0, ..DofSettings::default() };
                joint.set_dof_at(k, dof).unwrap();
            }
            let now = check_rates(&pairing, &joint, *held, 2 * positions.len());
            assert_eq!(now.errors.len(), held + 3 * positions.len());
            for (k, q) in positions.iter().enumerate() {
                let [below, above] = [0, 1].map(|side| now.errors[held + 2 * k + side]);
                assert!(
                    (below - (q + 2.0)).abs() < 1e-12 && (above - (2.5 - q)).abs() < 1e-12,
                    "{kind:?} {k}: {below}"
                );
            }
            // off the constraint too
            let (pairing, [a, mut b]) = crate::constraint::loop_joint::tests::pairing(modes, Vec3::new(0.1, 0.2, -0.3));
            b.frame *= moved.inverse() * about(0, 0.2) * about(1, -0.3);
            joint = LoopJoint { a, b, ..joint };
            let along = if *kind == LoopJointKind::Universal { 2 * positions.len() } else { 0 };
            check_rates(&pairing, &joint, *held, along);
        }
    }
}
