//! One world of a batch: what a call asks of it, and its steps.

use crate::batch::crew::Pause;
use crate::batch::fields::{Field, Layout};
use crate::batch::policy::Policy;
use crate::errors::{Error, Result};
use crate::objects::robot::settled;
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tumble::dynamics::{ArticulatedBody, DofSettings, Drive, ObjectId, WorkingMemory, WorldState};

/// The target of a reset: the state, and the generalized forces that act in every step.
pub struct Start {
    state: WorldState,
    efforts: BTreeMap<ObjectId, Vec<f64>>,
}

impl Start {
    /// Returns the present of a world.
    pub fn of(inner: &Inner) -> Start {
        let mut state = WorldState::default();
        inner.world.checkpoint(&mut state);
        Start { state, efforts: inner.efforts.clone() }
    }

    /// Takes a world back to it.
    pub fn restore(&self, inner: &mut Inner) -> Result<()> {
        if !inner.world.roll_back(&self.state) {
            return Err(Error::value("forces were added to this world of a batch, or removed from it"));
        }
        inner.efforts.clone_from(&self.efforts);
        Ok(())
    }
}

/// The work of one world in one call.
pub enum Task<'a> {
    /// Generalized forces and drive targets from now on, if given, and the number of steps.
    /// With a policy the forces are its outputs before each step; it is that of the world's number.
    Step { efforts: Option<&'a [f64]>, targets: Option<&'a [f64]>, policy: Option<(&'a Policy, usize)>, left: usize },
    /// Back to the start; then the whole state, or positions and velocities, if given.
    Reset { start: &'a Start, state: Option<&'a [f64]>, q: Option<&'a [f64]>, v: Option<&'a [f64]> },
}

/// One world in one call.
pub struct Member<'a> {
    /// Its number.
    pub number: usize,
    pub shared: &'a Shared,
    pub task: Task<'a>,
    /// Working memory that no world uses at the moment.
    pub memory: &'a Mutex<Vec<WorkingMemory>>,
    /// Memory for its fields, which are written once it is done.
    pub record: &'a mut [f64],
    pub outcome: Result<()>,
}

impl Member<'_> {
    /// Works until it is done, which returns true, or until the pause. An error is its outcome.
    pub fn advance(&mut self, layout: &Layout, fields: &[Field], pause: &Pause<'_>) -> bool {
        let Member { shared, task, record, memory, .. } = self;
        let worked = shared.unseen(|inner| {
            layout.check(inner)?;
            let mut lent = locked(memory).pop().unwrap_or_default();
            inner.world.lend_working_memory(&mut lent);
            let outcome = task.run(layout, inner, pause);
            inner.world.return_working_memory(&mut lent);
            locked(memory).push(lent);
            if !matches!(outcome, Ok(false)) {
                write(fields, layout, inner, record)?;
            }
            outcome
        });
        match worked {
            Ok(done) => done,
            Err(error) => {
                self.outcome = Err(error);
                true
            }
        }
    }
}

fn locked(memory: &Mutex<Vec<WorkingMemory>>) -> MutexGuard<'_, Vec<WorkingMemory>> {
    memory.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes the fields of a world into its record.
pub fn write(fields: &[Field], layout: &Layout, inner: &Inner, record: &mut [f64]) -> Result<()> {
    let mut rest = record;
    for field in fields {
        let (own, after) = rest.split_at_mut(field.width(layout));
        field.write(layout, inner, own)?;
        rest = after;
    }
    Ok(())
}

impl Task<'_> {
    fn run(&mut self, layout: &Layout, inner: &mut Inner, pause: &Pause<'_>) -> Result<bool> {
        match self {
            Task::Step { efforts, targets, policy, left } => {
                if let Some(row) = efforts.take() {
                    inner.set_efforts(layout.driven.iter().map(|body| (body.id, body.dof)), row);
                }
                if let Some(row) = targets.take() {
                    aim(layout, inner, row)?;
                }
                let (mut observation, mut work) = (vec![0.0; layout.positions() + layout.dof()], Vec::new());
                while *left > 0 {
                    if let Some((policy, world)) = policy {
                        write(&[Field::Q, Field::V], layout, inner, &mut observation)?;
                        let forces = policy.act(*world, &observation, &mut work);
                        inner.set_efforts(layout.driven.iter().map(|body| (body.id, body.dof)), &forces);
                    }
                    inner.step()?;
                    *left -= 1;
                    if *left > 0 && pause.now() {
                        return Ok(false);
                    }
                }
            }
            Task::Reset { start, state, q, v } => {
                start.restore(inner)?;
                if let Some(state) = state {
                    inner.write_state(&[state.len()], state)?;
                }
                if q.is_some() || v.is_some() {
                    place(layout, inner, *q, *v)?;
                }
            }
        }
        Ok(true)
    }
}

/// Sets positions and velocities of the driven bodies.
fn place(layout: &Layout, inner: &mut Inner, mut q: Option<&[f64]>, mut v: Option<&[f64]>) -> Result<()> {
    for body in &layout.driven {
        let mut x = inner.world.state()[body.x.clone()].to_vec();
        if let Some(row) = &mut q {
            let (own, rest) = row.split_at(body.positions);
            let robot = inner.robots.get(&body.id).ok_or_else(|| Error::value("q: a body was removed"))?;
            x[..body.positions].copy_from_slice(&settled(robot, own.to_vec())?);
            *row = rest;
        }
        if let Some(row) = &mut v {
            let (own, rest) = row.split_at(body.dof);
            let first = x.len() - body.dof;
            x[first..].copy_from_slice(own);
            *row = rest;
        }
        inner.world.write_state_of(body.id, &x)?;
    }
    Ok(())
}

/// Sets the targets of the position drives of the driven bodies.
fn aim(layout: &Layout, inner: &mut Inner, mut row: &[f64]) -> Result<()> {
    change(layout, inner, |settings| {
        let Some((wanted, rest)) = row.split_first() else { return Ok(()) };
        row = rest;
        if let Drive::Position { target, .. } = &mut settings.drive {
            *target = *wanted;
        }
        Ok(())
    })
}

/// Changes the settings of each degree of freedom of the driven bodies, in their order.
pub fn change(layout: &Layout, inner: &mut Inner, mut each: impl FnMut(&mut DofSettings) -> Result<()>) -> Result<()> {
    for body in &layout.driven {
        let gone = || Error::value("an articulation was removed from this world of a batch");
        for index in 0..body.dof {
            let own = inner.world.get::<ArticulatedBody>(body.id).ok_or_else(gone)?;
            let before = &own.dofs()[index];
            let mut settings = before.clone();
            each(&mut settings)?;
            if settings.drive != before.drive {
                let own = inner.world.get_mut::<ArticulatedBody>(body.id).ok_or_else(gone)?;
                own.set_dof(index, settings)?;
            }
        }
    }
    Ok(())
}
