//! The derivative of a step of `time_stepping` by the state and by the forces.
//!
//! ```text
//! x' = f(x, τ)        δx' = A·δx + B·δτ
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x` | the state of the objects that move, in the coordinates of [`LinearizedStep`] |
//! | `τ` | generalized forces, constant over the frame, in addition to those that are applied already |
//!
//! **Contacts and joints.** A step contains several contact problems: impacts, the solve of all rows, rebounds,
//! overlap. Each is differentiated at its active set by the implicit function theorem (`held_solver`): no
//! solver runs, and its tolerance is not in the result. The branches at which the map of a step has a kink (a gap
//! that opens, overlap above the tolerance) are held as well (`branches`). So the result is the derivative of the
//! one smooth map that holds on one side of a kink, also exactly at it.
//!
//! **The rest** of a step (free motion, forces, kinematics, the motion of contacts) is differenced: columns are
//! `(8·(y(ε) − y(−ε)) − y(2ε) + y(−2ε))/12ε`, with a truncation of `ε⁴`. Where the displaced steps differ in what
//! cannot be held (the number of contacts, impacts or sub-steps), the column is that of the side that agrees with the step,
//! `(4·y(ε) − y(2ε))/2ε`, and is listed; where neither agrees, smaller `ε` are tried.

mod branches;
mod held_solver;

pub use branches::Switch;
pub(crate) use branches::{Branches, ROUNDING};

use crate::solver::{GaussSeidel, RowSolver};
use crate::step::{Stepper, TimeStepping};
use crate::world::view::{Entry, ObjectId};
use crate::world::{StepError, World, WorldState};
use held_solver::{HeldSolver, Tape};
use nalgebra::DMatrix;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Displacements of positions (m, rad) and of velocities (m/s, rad/s).
const POSITION: f64 = 1e-6;
const VELOCITY: f64 = 2e-6;
/// Change of velocity by the displacement of a force, in free motion, m/s or rad/s.
const PUSH: f64 = 1e-5;
/// Factors of the displacements, tried in this order until no contact appears or disappears.
const SHRINK: [f64; 3] = [1.0, 0.1, 0.01];
/// Sweeps of the step that is linearized, and its tolerance, m/s.
const SWEEPS: u32 = 20_000;
const TOLERANCE: f64 = 1e-12;
/// Largest number of rows of an island.
pub const MAX_LINEARIZED_ROWS: usize = 1000;

/// The derivative of one frame. Rows and columns of `a` and rows of `b` are the coordinates of the state, `2·n`
/// numbers for `n` degrees of freedom: first the positions of all objects that move, then their velocities, object
/// by object in the order of addition.
///
/// Coordinates of positions are displacements along generalized velocities: the angle of a revolute joint, `δθ`
/// in world axes and then `δp` for a rigid body or a floating root (the body is turned by `exp(δθ)`), `δθ` in the
/// link's axes for a spherical joint. Coordinates of velocities are generalized velocities: `ω`, then `v`.
#[derive(Clone, Debug)]
pub struct LinearizedStep {
    /// `A`, `2n × 2n`.
    pub a: DMatrix<f64>,
    /// `B`, `2n × n`: by generalized forces (N, N·m) that are constant over the frame.
    pub b: DMatrix<f64>,
    /// Objects that move, and their ranges in the `n` degrees of freedom.
    pub objects: Vec<(ObjectId, Range<usize>)>,
    /// Kinks within the displacements: there the derivative is that of one side.
    pub switches: Vec<Switching>,
    /// Columns of `[A B]` that are one-sided, since the number of contacts or impacts is another on the other side.
    pub one_sided: Vec<usize>,
    /// Columns of `[A B]` on both sides of which the number of contacts or impacts is another: they are differenced across the jump.
    pub across: Vec<usize>,
    /// Largest error of the contact solutions that are differentiated, m/s.
    pub residual: f64,
    /// Whether rigid contact leaves the velocities open: forces are shared by redundant contacts, as by four corners
    /// of a box that slides and turns, and another share would give another friction. The derivative is then
    /// that of the nearest solution.
    pub indeterminate: bool,
}

/// A kink of the map of a step next to its state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Switching {
    /// The kind.
    pub switch: Switch,
    /// The objects in contact; `None` for a limit or a motor, and in frames of several sub-steps.
    pub objects: Option<[ObjectId; 2]>,
}

/// An error of [`World::linearize`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinearizeError {
    /// The stepper or the solver is another one.
    #[error("a step by '{found}' cannot be linearized; set the {kind} '{expected}'")]
    Method {
        /// `stepper` or `solver`.
        kind: &'static str,
        /// Name of the one in use.
        found: &'static str,
        /// Name of the one that can.
        expected: &'static str,
    },
    /// An island is too large.
    #[error("an island has {rows} rows; a step can be linearized with at most {MAX_LINEARIZED_ROWS}")]
    Rows {
        /// Number of rows.
        rows: usize,
    },
    /// A step failed.
    #[error(transparent)]
    Step(#[from] StepError),
}

impl World {
    /// Returns the derivative of the next frame by the state and by generalized forces, with the forces that are
    /// applied now. The world stays as it is.
    ///
    /// ```
    /// use tumble_core::{collide::{Shape, Vec3}, prelude::*};
    /// let mut world = World::default(); // gravity −9.81 m/s², frames of 1/240 s
    /// world.add(RigidBody::new(Shape::sphere(0.1)?).with_mass(2.0))?;
    /// let step = world.linearize()?;
    /// let (dt, z, vz) = (world.settings().dt, 5, 11);
    /// assert!((step.a[(z, vz)] - dt).abs() < 1e-9); // δz' = δz + dt·δv
    /// assert!((step.b[(vz, z)] - dt / 2.0).abs() < 1e-9); // δv' = δv + dt/m·δf
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`LinearizeError`]: the stepper is not `time_stepping`, the solver not `gauss_seidel`, or the frame fails.
    pub fn linearize(&self) -> Result<LinearizedStep, LinearizeError> {
        let method = |kind, found, expected| match found == expected {
            true => Ok(()),
            false => Err(LinearizeError::Method { kind, found, expected }),
        };
        method("stepper", self.stepper_name(), TimeStepping::default().name())?;
        method("solver", self.solver_name(), GaussSeidel.name())?;
        Linearizer::new(self)?.derivative()
    }
}

/// A world that repeats a frame with displaced states.
struct Linearizer {
    world: World,
    tape: Arc<Mutex<Tape>>,
    start: WorldState,
    /// The state after the frame.
    end: Vec<f64>,
    /// Counts that a displaced frame must share.
    counts: [u32; 3],
    dof: usize,
    moving: Vec<Moving>,
    /// Displacement of each generalized force.
    forces: Vec<f64>,
    switches: Vec<Switching>,
}

/// An object that moves.
struct Moving {
    id: ObjectId,
    place: usize,
    /// Its range in the numbers of all objects that move.
    range: Range<usize>,
}

/// The displacement of a column.
#[derive(Clone, Copy)]
enum Coordinate {
    Position(usize),
    Velocity(usize),
    Force(usize),
}

impl Linearizer {
    fn new(of: &World) -> Result<Linearizer, LinearizeError> {
        let mut world = of.fork();
        let settings = &mut world.core.settings;
        (settings.threads, settings.sleep) = (1, None);
        let solver = &mut settings.solver_settings;
        (solver.max_sweeps, solver.max_relaxations, solver.budget) = (SWEEPS, u32::MAX, None);
        solver.tolerance = solver.tolerance.min(TOLERANCE);
        settings.projection_sweeps = SWEEPS;
        world.core.wake_all();
        let tape = Arc::<Mutex<Tape>>::default();
        world.core.solver = Box::new(HeldSolver { inner: Box::new(GaussSeidel), tape: tape.clone() });
        world.core.branches.record();
        let (mut moving, mut dof) = (Vec::new(), 0);
        for entry in world.core.objects().all().filter(Entry::dynamic) {
            let id = world.core.table.order[entry.place];
            let range = dof..dof + entry.state_range.v.len();
            dof = range.end;
            moving.push(Moving { id, place: entry.place, range });
        }
        let start = world.core.state.clone();
        let forces = displacements_of_forces(&mut world, &moving, dof);
        let report = *world.step()?;
        let tape_now = lock(&tape);
        if tape_now.largest > MAX_LINEARIZED_ROWS {
            return Err(LinearizeError::Rows { rows: tape_now.largest });
        }
        drop(tape_now);
        let end = world.core.state.x.to_vec();
        let counts = [report.substeps, report.contacts, report.impact_passes];
        Ok(Linearizer { world, tape, start, end, counts, dof, moving, forces, switches: Vec::new() })
    }

    fn derivative(mut self) -> Result<LinearizedStep, LinearizeError> {
        let n = self.dof;
        let mut all = DMatrix::zeros(2 * n, 3 * n);
        let (mut one_sided, mut across) = (Vec::new(), Vec::new());
        for column in 0..3 * n {
            let coordinate = match column / n {
                0 => Coordinate::Position(column),
                1 => Coordinate::Velocity(column - n),
                _ => Coordinate::Force(column - 2 * n),
            };
            let (values, side) = self.column(coordinate)?;
            all.column_mut(column).copy_from_slice(&values);
            match side {
                Side::Both => {}
                Side::One => one_sided.push(column),
                Side::Across => across.push(column),
            }
        }
        self.switches.sort_unstable();
        self.switches.dedup();
        let (residual, indeterminate) = {
            let tape = lock(&self.tape);
            (tape.residual, tape.indeterminate)
        };
        Ok(LinearizedStep {
            a: all.columns(0, 2 * n).into_owned(),
            b: all.columns(2 * n, n).into_owned(),
            objects: self.moving.into_iter().map(|m| (m.id, m.range)).collect(),
            switches: self.switches,
            one_sided,
            across,
            residual,
            indeterminate,
        })
    }

    /// Returns one column, and on which sides of the state it holds.
    fn column(&mut self, coordinate: Coordinate) -> Result<(Vec<f64>, Side), LinearizeError> {
        let full = match coordinate {
            Coordinate::Position(_) => POSITION,
            Coordinate::Velocity(_) => VELOCITY,
            Coordinate::Force(i) => self.forces[i],
        };
        let combine = |a: &[f64], b: &[f64], weights: [f64; 2]| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| weights[0] * a + weights[1] * b).collect()
        };
        let mut across = Vec::new();
        for e in SHRINK.map(|shrink| shrink * full) {
            let half = 0.5 / e;
            let mut side = |e: f64| -> Result<_, LinearizeError> {
                let ((near, fits), (far, fits_far)) =
                    (self.displaced(coordinate, e)?, self.displaced(coordinate, 2.0 * e)?);
                Ok((near, far, fits && fits_far))
            };
            let ((more, far_more, above), (less, far_less, below)) = (side(e)?, side(-e)?);
            if above && below {
                let (near, far) = (combine(&more, &less, [half, -half]), combine(&far_more, &far_less, [half, -half]));
                return Ok((combine(&near, &far, [4.0 / 3.0, -1.0 / 6.0]), Side::Both));
            }
            if above {
                return Ok((combine(&more, &far_more, [4.0 * half, -half]), Side::One));
            }
            if below {
                return Ok((combine(&less, &far_less, [-4.0 * half, half]), Side::One));
            }
            across = combine(&more, &less, [half, -half]);
        }
        Ok((across, Side::Across))
    }

    /// Returns the coordinates of the state after a displaced frame, from those of the frame, and whether both are
    /// frames of the same smooth map.
    fn displaced(&mut self, coordinate: Coordinate, by: f64) -> Result<(Vec<f64>, bool), LinearizeError> {
        self.world.roll_back(&self.start);
        self.displace(coordinate, by);
        lock(&self.tape).repeat();
        self.world.core.branches.repeat();
        let report = *self.world.step()?;
        let counts = [report.substeps, report.contacts, report.impact_passes];
        let (contacts, several) = (&self.world.core.contacts, report.substeps > 1);
        let objects = |contact: usize| contacts.get(contact).filter(|_| !several).map(|c| [c.a, c.b]);
        let mut same = counts == self.counts;
        match self.world.core.branches.differing() {
            Some(differing) => {
                let of =
                    |&(switch, place): &(Switch, Option<usize>)| Switching { switch, objects: place.and_then(objects) };
                self.switches.extend(differing.iter().map(of));
            }
            None => same = false,
        }
        match lock(&self.tape).switched() {
            Some(switched) => {
                let of = |&(switch, block): &(Switch, usize)| Switching { switch, objects: objects(block) };
                self.switches.extend(switched.iter().map(of));
            }
            None => same = false,
        }
        if self.switches.len() > 1000 {
            self.switches.sort_unstable();
            self.switches.dedup();
        }
        Ok((self.difference(), same))
    }

    /// Displaces the state, or adds to the forces.
    fn displace(&mut self, coordinate: Coordinate, by: f64) {
        let (Coordinate::Position(i) | Coordinate::Velocity(i) | Coordinate::Force(i)) = coordinate;
        let Some(moving) = self.moving.iter().find(|m| m.range.contains(&i)) else { return };
        let core = &mut self.world.core;
        core.table.walk.unsettle(moving.place);
        let placed = &core.table.placed[moving.place];
        let (ranges, local) = (placed.state_range.clone(), i - moving.range.start);
        if let Coordinate::Force(_) = coordinate {
            core.state.applied_generalized[ranges.v.start + local] += by;
            return;
        }
        let Some(body) = placed.object.integratable() else { return };
        let x = &mut core.state.x[ranges.x];
        let mut v = vec![0.0; moving.range.len()];
        body.velocity(x, &mut v);
        if let Coordinate::Position(_) = coordinate {
            let mut way = vec![0.0; v.len()];
            way[local] = by;
            body.integrate_positions(x, &way, 1.0);
        } else {
            v[local] += by;
        }
        body.write_velocity(x, &v);
    }

    /// Returns the coordinates of the present state, from those of the state after the frame.
    fn difference(&self) -> Vec<f64> {
        let mut out = vec![0.0; 2 * self.dof];
        let core = &self.world.core;
        for Moving { place, range, .. } in &self.moving {
            let placed = &core.table.placed[*place];
            let Some(body) = placed.object.integratable() else { continue };
            let [now, end] = [&core.state.x[placed.state_range.x.clone()], &self.end[placed.state_range.x.clone()]];
            let (positions, velocities) = out.split_at_mut(self.dof);
            body.difference(end, now, &mut positions[range.clone()]);
            let mut before = vec![0.0; range.len()];
            body.velocity(end, &mut before);
            body.velocity(now, &mut velocities[range.clone()]);
            velocities[range.clone()].iter_mut().zip(&before).for_each(|(v, before)| *v -= before);
        }
        out
    }
}

/// On which sides of the state a column holds.
#[derive(Clone, Copy)]
enum Side {
    Both,
    One,
    Across,
}

/// Returns for every degree of freedom the force that changes its free velocity by [`PUSH`] in a frame.
fn displacements_of_forces(world: &mut World, moving: &[Moving], dof: usize) -> Vec<f64> {
    let core = &mut world.core;
    core.refresh();
    let dt = core.settings.dt;
    let mut out = vec![1.0; dof];
    for Moving { place, range, .. } in moving {
        let Some(body) = core.table.placed[*place].object.integratable() else { continue };
        for local in 0..range.len() {
            let (mut unit, mut y) = (vec![0.0; range.len()], vec![0.0; range.len()]);
            unit[local] = 1.0;
            body.solve_lt(&mut core.derived.caches[*place], &unit, &mut y);
            let mobility = y.iter().map(|y| y * y).sum::<f64>();
            if mobility.is_finite() && mobility > 0.0 {
                out[range.start + local] = PUSH / (dt * mobility);
            }
        }
    }
    out
}

fn lock(tape: &Mutex<Tape>) -> MutexGuard<'_, Tape> {
    tape.lock().unwrap_or_else(PoisonError::into_inner)
}
