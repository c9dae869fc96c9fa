//! A dense stand-in, to be replaced by the articulated-body method: same answers, O(n³).
#![allow(missing_docs)]
use super::*;
use crate::site::Wrench;
use nalgebra::{DMatrix, DVector};
use tumble_collide::{Pose, Vec3};
#[derive(Clone)]
pub struct Dynamics { model: Model, kin: Kinematics, id: InverseDynamics, c: DMatrix<f64>, bad: Option<usize> }
#[derive(Clone)]
pub struct Scratch;
impl Dynamics {
    pub fn new(model: &Model) -> Dynamics { let n = model.dof(); Dynamics { model: model.clone(), kin: Kinematics::new(model), id: InverseDynamics::new(model), c: DMatrix::identity(n, n), bad: None } }
    pub fn scratch(&self) -> Scratch { Scratch }
    pub fn refresh(&mut self, q: &[f64], v: &[f64]) {
        self.kin.refresh(&self.model, q, v);
        let n = self.model.dof();
        let mut m = vec![0.0; n * n];
        MassMatrix::new(&self.model).write(&self.model, &self.kin, &mut m);
        match DMatrix::from_row_slice(n, n, &m).cholesky() { Some(c) => { self.c = c.l(); self.bad = None }, None => self.bad = Some(0) }
    }
    pub fn singular(&self) -> Option<usize> { self.bad }
    pub fn link_pose(&self, i: usize) -> Pose { self.kin.links()[i].pose }
    pub fn link_velocity(&self, i: usize) -> (Vec3, Vec3) { (self.kin.links()[i].angular, self.kin.links()[i].linear) }
    pub fn accelerate(&self, _s: &mut Scratch, tau: &[f64], wrenches: &[Wrench], qdd: &mut [f64]) {
        let n = self.model.dof();
        let mut b = vec![0.0; n];
        self.id.clone().bias(&self.model, &self.kin, &Vec3::zeros(), wrenches, &mut b);
        let rhs: Vec<f64> = (0..n).map(|i| tau.get(i).copied().unwrap_or(0.0) - b[i]).collect();
        let mut y = vec![0.0; n];
        self.respond(&mut Scratch, &rhs, &mut y);
        self.unwhiten(&mut Scratch, &y, qdd);
    }
    pub fn link_accelerations(&self, qdd: &[f64], out: &mut [(Vec3, Vec3)]) {
        let mut r = vec![Rates::zero(); out.len()];
        self.kin.accelerations(&self.model, qdd, &Vec3::zeros(), &mut r);
        out.iter_mut().zip(&r).for_each(|(o, r)| *o = (r.angular, r.linear));
    }
    pub fn whiten(&self, _s: &mut Scratch, v: &[f64], u: &mut [f64]) { u.copy_from_slice((self.c.transpose() * DVector::from_row_slice(v)).as_slice()); }
    pub fn recover(&self, _s: &mut Scratch, u: &[f64], j: &mut [f64]) { j.copy_from_slice((&self.c * DVector::from_row_slice(u)).as_slice()); }
    pub fn respond(&self, _s: &mut Scratch, j: &[f64], y: &mut [f64]) { y.copy_from_slice(self.c.solve_lower_triangular(&DVector::from_row_slice(j)).unwrap().as_slice()); }
    pub fn unwhiten(&self, _s: &mut Scratch, u: &[f64], v: &mut [f64]) { v.copy_from_slice(self.c.tr_solve_lower_triangular(&DVector::from_row_slice(u)).unwrap().as_slice()); }
    pub fn point_response(&self, link: usize, arm: &Vec3, axes: &[Vec3], sign: f64, y: &mut [f64]) {
        let n = self.model.dof();
        let p = self.kin.links()[link].pose.translation.vector + arm;
        let mut j = vec![0.0; 3 * n];
        point_jacobian(&self.model, &self.kin, link, &p, &mut j);
        for (axis, y) in axes.iter().zip(y.chunks_exact_mut(n)) {
            let row: Vec<f64> = (0..n).map(|k| (0..3).map(|r| axis[r] * j[r * n + k]).sum()).collect();
            let mut w = vec![0.0; n];
            self.respond(&mut Scratch, &row, &mut w);
            y.iter_mut().zip(&w).for_each(|(y, w)| *y += sign * w);
        }
    }
}
