//! The constant data of an articulated body, and its algorithms over batches of states.
//!
//! Every argument is one row (its numbers) or a batch of rows (a leading axis). A single row
//! applies to every row of a batch. Rows are independent, so a batch gives the same bits as its
//! rows one by one, on any number of threads.

use crate::arrays::convert::{Numbers, room, shown};
use crate::errors::{Error, Result, caught};
use crate::pool;
use nalgebra::DMatrix;
use rayon::prelude::*;
use tumble::collide::{Pose, Vec3};
use tumble::dynamics::articulated::{
    BatchDynamics, Dynamics, InverseDynamics, Kinematics, Lanes, LinkFrame, MassMatrix, Model, center_of_mass,
    forward_dynamics, forward_dynamics_derivatives, inverse_dynamics, inverse_dynamics_derivatives, link_jacobian,
    normalize,
};

/// States that one call of the batched algorithm processes.
const LANES: usize = 8;
/// Number of results from which on threads share the work.
const SHARED: usize = 4096;
/// Largest deviation from 1 of the length of a quaternion in `q`.
const UNIT: f64 = 1e-6;

/// A tree of links at its base, with the names of its joints.
#[derive(Clone, Debug)]
pub struct Robot {
    /// The model, with its roots at the base.
    pub model: Model,
    /// Pose of the base.
    pub base: Pose,
    /// Names of the joints that are not fixed, in the order of the coordinates.
    pub joints: Vec<String>,
}

/// Arguments of one call, each a row or one row per element of the batch.
pub struct Rows {
    /// `None` if no argument has a leading axis.
    pub batch: Option<usize>,
    arguments: Vec<(Vec<f64>, usize, bool)>,
}

impl Rows {
    /// Checks the shapes of `(name, numbers, width of a row)`.
    pub fn new(arguments: Vec<(&str, Numbers, usize)>) -> Result<Rows> {
        let mut rows = Rows { batch: None, arguments: Vec::new() };
        for (name, Numbers { shape, data }, width) in arguments {
            let batched = match shape.as_slice() {
                [w] if *w == width => false,
                [count, w] if *w == width && rows.batch.is_none_or(|batch| batch == *count) => {
                    rows.batch = Some(*count);
                    true
                }
                [_, w] if *w == width => {
                    return Err(Error::value(format!(
                        "{name}: shape {} in a batch of {}",
                        shown(&shape),
                        rows.batch.unwrap_or(0)
                    )));
                }
                _ => {
                    return Err(Error::value(format!(
                        "{name}: expected shape ({width},) or (batch, {width}), got {}",
                        shown(&shape)
                    )));
                }
            };
            rows.arguments.push((data, width, batched));
        }
        Ok(rows)
    }

    /// Returns the number of rows of results.
    pub fn count(&self) -> usize {
        self.batch.unwrap_or(1)
    }

    fn row(&self, argument: usize, k: usize) -> &[f64] {
        let (data, width, batched) = &self.arguments[argument];
        if *batched { &data[k * width..(k + 1) * width] } else { data }
    }

    /// Normalizes the quaternions of `q`, the first argument. One that is far from unit length is
    /// an error.
    fn settle(&mut self, model: &Model) -> Result<()> {
        let (data, width, _) = &mut self.arguments[0];
        if *width == 0 {
            return Ok(());
        }
        for (k, row) in data.chunks_exact_mut(*width).enumerate() {
            for (link, at) in model.links().iter().filter_map(|link| Some((link, link.q + link.joint.quaternion()?))) {
                let norm = row[at..at + 4].iter().map(|x| x * x).sum::<f64>().sqrt();
                if (norm - 1.0).abs() > UNIT {
                    return Err(Error::value(format!(
                        "q: the quaternion of link '{}' in row {k} has length {norm}; it must be 1",
                        link.name
                    )));
                }
            }
            normalize(model, row);
        }
        Ok(())
    }

    /// Computes one result of `width` numbers per row; `make` makes the working memory of each
    /// thread.
    fn each<W>(
        &self,
        width: usize,
        make: impl Fn() -> W + Sync + Send,
        run: impl Fn(&mut W, usize, &mut [f64]) + Sync + Send,
    ) -> Result<Vec<f64>> {
        self.chunks(width, 1, make, run)
    }

    /// Computes results by chunks of rows; `run` gets the first row and room for the results.
    fn chunks<W>(
        &self,
        width: usize,
        rows: usize,
        make: impl Fn() -> W + Sync + Send,
        run: impl Fn(&mut W, usize, &mut [f64]) + Sync + Send,
    ) -> Result<Vec<f64>> {
        let numbers = self.count().saturating_mul(width);
        let mut out = room(numbers, "the result")?;
        out.resize(numbers, 0.0);
        let size = rows * width;
        if out.is_empty() {
            return Ok(out);
        }
        if out.len() < SHARED {
            let mut work = make();
            out.chunks_mut(size).enumerate().for_each(|(k, out)| run(&mut work, k * rows, out));
        } else {
            pool::shared()?.install(|| {
                out.par_chunks_mut(size).enumerate().for_each_init(make, |work, (k, out)| run(work, k * rows, out))
            });
        }
        Ok(out)
    }
}

/// Writes matrices by rows, one after the other.
fn by_rows(matrices: [&DMatrix<f64>; 3], out: &mut [f64]) {
    let numbers = matrices
        .into_iter()
        .flat_map(|matrix| matrix.row_iter().flat_map(|row| row.iter().copied().collect::<Vec<_>>()));
    out.iter_mut().zip(numbers).for_each(|(out, x)| *out = x);
}

/// Returns one row of positions with normalized quaternions.
pub fn settled(robot: &Robot, q: Vec<f64>) -> Result<Vec<f64>> {
    let width = q.len();
    let mut rows = Rows { batch: None, arguments: vec![(q, width, false)] };
    rows.settle(&robot.model)?;
    Ok(rows.arguments.swap_remove(0).0)
}

impl Robot {
    /// Returns the length of `q`.
    pub fn positions(&self) -> usize {
        self.model.positions()
    }

    /// Returns the length of `qd` and `tau`.
    pub fn dof(&self) -> usize {
        self.model.dof()
    }

    /// Returns a frame by name. The error lists the names.
    pub fn frame(&self, link: &str) -> Result<&LinkFrame> {
        self.model.frame(link).ok_or_else(|| {
            let names: Vec<&str> = self.model.frames().iter().map(|f| f.name.as_str()).take(12).collect();
            Error::Name(format!("there is no link named '{link}'; there are {}", names.join(", ")))
        })
    }

    /// Returns `q̈` from `q`, `qd`, `tau`.
    pub fn forward_dynamics(&self, gravity: &Vec3, rows: &mut Rows) -> Result<Vec<f64>> {
        rows.settle(&self.model)?;
        let (rows, model, dof) = (&*rows, &self.model, self.dof());
        let out = caught(|| {
            if rows.count() < LANES {
                return rows.each(
                    dof,
                    || Dynamics::new(model),
                    |d, k, qdd| {
                        let [q, v, tau] = [0, 1, 2].map(|argument| rows.row(argument, k));
                        if forward_dynamics(d, gravity, q, v, tau, qdd).is_err() {
                            qdd.fill(f64::NAN);
                        }
                    },
                );
            }
            let make = || {
                (
                    BatchDynamics::<LANES>::new(model),
                    [self.positions(), dof, dof, dof].map(|n| vec![Lanes([0.0; LANES]); n]),
                )
            };
            rows.chunks(dof, LANES, make, |(batch, [q, v, tau, qdd]), first, out| {
                let last = first + out.len() / dof - 1;
                for lane in 0..LANES {
                    // Lanes behind the last row repeat it.
                    let k = (first + lane).min(last);
                    for (argument, to) in [&mut *q, &mut *v, &mut *tau].into_iter().enumerate() {
                        to.iter_mut().zip(rows.row(argument, k)).for_each(|(to, x)| to.0[lane] = *x);
                    }
                }
                let held = batch.forward_dynamics(gravity, q, v, tau, qdd).err().map(|held| held.lane);
                for (lane, out) in out.chunks_exact_mut(dof).enumerate() {
                    out.iter_mut().zip(&*qdd).for_each(|(out, x)| *out = x.0[lane]);
                    if held == Some(lane) {
                        out.fill(f64::NAN);
                    }
                }
            })
        })?;
        self.regular(rows, out, dof)
    }

    /// Refuses results of `width` numbers per row if a row that begins with NaN has a singular mass matrix.
    fn regular(&self, rows: &Rows, out: Vec<f64>, width: usize) -> Result<Vec<f64>> {
        let failed = (0..).zip(out.chunks(width.max(1))).filter(|(_, row)| row[0].is_nan()).map(|(k, _)| k);
        let still = vec![0.0; self.dof()];
        let mut dynamics = Dynamics::new(&self.model);
        for k in failed {
            dynamics.refresh(rows.row(0, k), &still);
            if let Some(link) = dynamics.singular() {
                let of = rows.batch.map_or(String::new(), |_| format!(" of row {k}"));
                let why = self.model.singularity(link);
                return Err(Error::value(format!("the mass matrix at the positions{of} is singular: {why}")));
            }
        }
        Ok(out)
    }

    /// Returns `tau` from `q`, `qd`, `qdd`.
    pub fn inverse_dynamics(&self, gravity: &Vec3, rows: &mut Rows) -> Result<Vec<f64>> {
        rows.settle(&self.model)?;
        let (rows, model) = (&*rows, &self.model);
        let make = || (Kinematics::new(model), InverseDynamics::new(model));
        caught(|| {
            rows.each(self.dof(), make, |(kin, work), k, tau| {
                inverse_dynamics(model, (kin, work), gravity, rows.row(0, k), rows.row(1, k), rows.row(2, k), &[], tau);
            })
        })
    }

    /// Returns `∂τ/∂q`, `∂τ/∂v` and `M` at `q`, `qd`, `qdd`: three matrices by rows.
    pub fn inverse_dynamics_derivatives(&self, gravity: &Vec3, rows: &mut Rows) -> Result<Vec<f64>> {
        rows.settle(&self.model)?;
        let (rows, model) = (&*rows, &self.model);
        caught(|| {
            rows.each(
                3 * self.dof() * self.dof(),
                || Kinematics::new(model),
                |kin, k, out| {
                    let [q, v, qdd] = [0, 1, 2].map(|argument| rows.row(argument, k));
                    let d = inverse_dynamics_derivatives(model, kin, gravity, q, v, qdd);
                    by_rows([&d.by_q, &d.by_v, &d.by_qdd], out);
                },
            )
        })
    }

    /// Returns `∂q̈/∂q`, `∂q̈/∂v` and `M⁻¹` at `q`, `qd`, `tau`: three matrices by rows.
    pub fn forward_dynamics_derivatives(&self, gravity: &Vec3, rows: &mut Rows) -> Result<Vec<f64>> {
        rows.settle(&self.model)?;
        let (rows, model, width) = (&*rows, &self.model, 3 * self.dof() * self.dof());
        let out = caught(|| {
            rows.each(
                width,
                || (Kinematics::new(model), Dynamics::new(model)),
                |(kin, dynamics), k, out| {
                    let [q, v, tau] = [0, 1, 2].map(|argument| rows.row(argument, k));
                    // the same poses count as singular as in forward dynamics
                    dynamics.refresh(q, v);
                    let regular = dynamics.singular().is_none();
                    match regular.then(|| forward_dynamics_derivatives(model, kin, gravity, q, v, tau)).flatten() {
                        Some(d) => by_rows([&d.by_q, &d.by_v, &d.by_tau], out),
                        None => out.fill(f64::NAN),
                    }
                },
            )
        })?;
        let out = self.regular(rows, out, width)?;
        match out.chunks(width.max(1)).position(|row| row[0].is_nan()) {
            Some(row) => Err(Error::value(format!(
                "the mass matrix at the positions of row {row} is singular to working precision"
            ))),
            None => Ok(out),
        }
    }

    /// Returns `M` of `q`, by rows.
    pub fn mass_matrix(&self, rows: &mut Rows) -> Result<Vec<f64>> {
        self.at_positions(rows, self.dof() * self.dof(), |kin, _, out| {
            MassMatrix::new(&self.model).write(&self.model, kin, out)
        })
    }

    /// Returns the angular, then the linear velocity of a frame's origin per unit of each velocity,
    /// world axes: 6 rows.
    pub fn jacobian(&self, frame: &LinkFrame, rows: &mut Rows) -> Result<Vec<f64>> {
        let dof = self.dof();
        self.at_positions(rows, 6 * dof, |kin, _, out| {
            let Some(link) = frame.link else { return };
            link_jacobian(&self.model, kin, link, out);
            // From the link's origin to the frame's: v' = v + ω × r.
            let r = kin.frame_pose(frame).translation.vector - kin.links()[link].pose.translation.vector;
            for k in 0..dof {
                let turn = Vec3::new(out[k], out[dof + k], out[2 * dof + k]).cross(&r);
                (0..3).for_each(|row| out[(3 + row) * dof + k] += turn[row]);
            }
        })
    }

    /// Returns the poses of all frames in the world: position and quaternion of each.
    pub fn link_poses(&self, rows: &mut Rows) -> Result<Vec<f64>> {
        self.at_positions(rows, 7 * self.model.frames().len(), |kin, _, out| {
            for (frame, out) in self.model.frames().iter().zip(out.chunks_exact_mut(7)) {
                let pose = frame.link.map_or(self.base * frame.pose, |_| kin.frame_pose(frame));
                out.copy_from_slice(&crate::arrays::convert::pose_numbers(&pose));
            }
        })
    }

    /// Returns the center of mass in the world; the origin for a body without mass.
    pub fn center_of_mass(&self, rows: &mut Rows) -> Result<Vec<f64>> {
        self.at_positions(rows, 3, |kin, _, out| {
            let center = center_of_mass(&self.model, kin).map_or(Vec3::zeros(), |(center, _)| center);
            out.copy_from_slice(center.as_slice());
        })
    }

    /// Computes something that depends on the positions alone, with the kinematics there.
    fn at_positions(
        &self,
        rows: &mut Rows,
        width: usize,
        run: impl Fn(&mut Kinematics, usize, &mut [f64]) + Sync + Send,
    ) -> Result<Vec<f64>> {
        rows.settle(&self.model)?;
        let (rows, still) = (&*rows, vec![0.0; self.dof()]);
        caught(|| {
            rows.each(
                width,
                || Kinematics::new(&self.model),
                |kin, k, out| {
                    kin.refresh(&self.model, rows.row(0, k), &still);
                    run(kin, k, out);
                },
            )
        })
    }
}
