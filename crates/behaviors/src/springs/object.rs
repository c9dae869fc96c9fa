//! The traits of objects for the spring mesh.

use super::SpringMesh;
use super::block::Columns;
use super::factor::{Factor, Pattern};
use crate::record;
use tumble_collide::{Pose, Shape, Vec3};
use tumble_core::archive::{ObjectIndices, ObjectRecord};
use tumble_core::{
    Cache, Collidable, Energy, ForceSlice, Integratable, Material, Object, PartPoint, PartState, Renderable, StateSizes,
};

/// The factor of the last refreshed state, made when it is first asked for.
#[derive(Default)]
pub(super) struct MeshCache {
    pub x: Vec<f64>,
    pub factor: Option<Factor>,
    /// Step and implicitness that the factor was made for.
    pub made_for: [f64; 2],
    /// Memory of a factor that is out of date.
    pub spare: Factor,
    /// Vectors in the order of elimination.
    work: Vec<Vec3>,
    /// Responses in the order of elimination, 0 between calls.
    responses: Vec<Columns>,
}

impl SpringMesh {
    /// Makes the factor if there is none for the state, the step and the implicitness.
    fn make_factor(&self, cache: &mut MeshCache) {
        let MeshCache { x, factor, made_for, spare, .. } = cache;
        let now = [self.step, self.implicitness];
        if std::mem::replace(made_for, now) != now {
            *spare = factor.take().unwrap_or_else(|| std::mem::take(spare));
        }
        factor.get_or_insert_with(|| {
            let mut factor = std::mem::take(spare);
            self.write_factor(x, x, &mut factor);
            factor
        });
    }

    /// Does `work` with the pattern, the factor and the numbers of all nodes in the order of elimination.
    fn with_factor(&self, cache: &mut Cache, work: impl FnOnce(&Pattern, &Factor, &mut [Vec3])) {
        let cache: &mut MeshCache = cache.get();
        self.make_factor(cache);
        let MeshCache { factor: Some(factor), work: vector, .. } = cache else { return };
        vector.resize(self.nodes.len(), Vec3::zeros());
        work(&self.pattern, factor, vector);
    }
}

/// Reads vectors in the order of elimination from numbers in that of the nodes.
fn read_nodes(pattern: &Pattern, from: &[f64], vectors: &mut [Vec3]) {
    for (place, from) in pattern.place.iter().zip(from.chunks_exact(3)) {
        vectors[*place] = Vec3::from_column_slice(from);
    }
}

/// Writes them in the order of the nodes.
fn write_nodes(pattern: &Pattern, vectors: &[Vec3], to: &mut [f64]) {
    for (place, to) in pattern.place.iter().zip(to.chunks_exact_mut(3)) {
        to.copy_from_slice(vectors[*place].as_slice());
    }
}

/// Reads whitened velocities, which are in the order of elimination.
fn read_whitened(from: &[f64], vectors: &mut [Vec3]) {
    vectors.iter_mut().zip(from.chunks_exact(3)).for_each(|(b, from)| *b = Vec3::from_column_slice(from));
}

fn write_whitened(vectors: &[Vec3], to: &mut [f64]) {
    vectors.iter().zip(to.chunks_exact_mut(3)).for_each(|(b, to)| to.copy_from_slice(b.as_slice()));
}

impl Object for SpringMesh {
    fn record(&self, _: &ObjectIndices) -> Option<ObjectRecord> {
        record::mesh(self)
    }
    fn name(&self) -> &str {
        &self.name
    }
    fn new_cache(&self) -> Cache {
        Cache::new(MeshCache::default())
    }
    fn refresh(&self, x: &[f64], cache: &mut Cache, part_states: &mut [PartState]) {
        let cache: &mut MeshCache = cache.get();
        if cache.x != x {
            x.clone_into(&mut cache.x);
            if let Some(factor) = cache.factor.take() {
                cache.spare = factor;
            }
        }
        let (positions, velocities) = x.split_at(3 * self.nodes.len());
        for ((part, x), v) in part_states.iter_mut().zip(positions.chunks_exact(3)).zip(velocities.chunks_exact(3)) {
            part.pose = Pose::translation(x[0], x[1], x[2]);
            part.velocity = Vec3::from_column_slice(v);
        }
    }
    fn integratable(&self) -> Option<&dyn Integratable> {
        Some(self)
    }
    fn collidable(&self) -> Option<&dyn Collidable> {
        Some(self)
    }
    fn renderable(&self) -> Option<&dyn Renderable> {
        Some(self)
    }
}

impl Integratable for SpringMesh {
    fn state_sizes(&self) -> StateSizes {
        let count = self.nodes.len();
        StateSizes { x: 6 * count, dof: 3 * count, parts: count }
    }
    fn write_initial(&self, x: &mut [f64]) {
        let (positions, velocities) = x.split_at_mut(3 * self.nodes.len());
        positions.iter_mut().zip(self.nodes.iter().flat_map(|node| node.iter())).for_each(|(x, node)| *x = *node);
        for (v, pinned) in velocities.chunks_exact_mut(3).zip(&self.pinned) {
            v.copy_from_slice(if *pinned { &[0.0; 3] } else { self.velocity.as_slice() });
        }
    }
    fn part_mass(&self, part: usize) -> f64 {
        self.masses.get(part).copied().unwrap_or(0.0)
    }
    fn jacobian(&self, _cache: &mut Cache, at: &PartPoint, j: &mut [f64]) {
        if self.pinned[at.part] {
            return;
        }
        for (axis, j) in at.axes.iter().zip(j.chunks_exact_mut(3 * self.nodes.len())) {
            j[3 * at.part..3 * at.part + 3].iter_mut().zip(axis.iter()).for_each(|(j, axis)| *j += axis);
        }
    }
    fn mul_l(&self, cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        self.with_factor(cache, |pattern, factor, b| {
            read_nodes(pattern, v, b);
            pattern.mul_transposed(factor, b);
            write_whitened(b, u);
        });
    }
    fn solve_l(&self, cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        self.with_factor(cache, |pattern, factor, b| {
            read_whitened(u, b);
            pattern.solve_transposed(factor, b);
            write_nodes(pattern, b, v);
        });
    }
    fn solve_lt(&self, cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        self.with_factor(cache, |pattern, factor, b| {
            read_nodes(pattern, j, b);
            pattern.solve(factor, b);
            write_whitened(b, y);
        });
    }
    fn mul_lt(&self, cache: &mut Cache, u: &[f64], j: &mut [f64]) {
        self.with_factor(cache, |pattern, factor, b| {
            read_whitened(u, b);
            pattern.mul(factor, b);
            write_nodes(pattern, b, j);
        });
    }
    fn test_impulse(&self, cache: &mut Cache, at: &PartPoint, sign: f64, y: &mut [f64]) {
        if self.pinned[at.part] {
            return;
        }
        let cache: &mut MeshCache = cache.get();
        self.make_factor(cache);
        let MeshCache { factor: Some(factor), responses, .. } = cache else { return };
        let dof = 3 * self.nodes.len();
        for (axes, y) in at.axes.chunks(3).zip(y.chunks_mut(3 * dof)) {
            let axis = |k: usize| axes.get(k).copied().unwrap_or_else(Vec3::zeros);
            let [a, b, c] = [axis(0), axis(1), axis(2)];
            let impulses = Columns([[a.x, b.x, c.x, 0.0], [a.y, b.y, c.y, 0.0], [a.z, b.z, c.z, 0.0]]);
            self.pattern.respond(factor, at.part, impulses, responses, |place, response| {
                for (k, y) in y.chunks_exact_mut(dof).enumerate() {
                    for (y, response) in y[3 * place..].iter_mut().zip(&response.0) {
                        *y += sign * response[k];
                    }
                }
            });
        }
    }
    fn made_for_step(&self) -> Option<f64> {
        Some(self.step)
    }
    fn derivative(&self, cache: &mut Cache, x: &[f64], f: &ForceSlice, dp: &mut [f64]) {
        let mut forces: Vec<Vec3> = f.wrenches.iter().map(|wrench| wrench.force).collect();
        forces.iter_mut().zip(f.generalized.chunks_exact(3)).for_each(|(f, g)| *f += Vec3::from_column_slice(g));
        let change = self.solve_step(cache.get(), x, &forces);
        for (dp, change) in dp.chunks_exact_mut(3).zip(change) {
            dp.copy_from_slice((change / self.step).as_slice());
        }
    }
    fn accelerations(&self, _cache: &mut Cache, _x: &[f64], dp: &[f64], part_states: &mut [PartState]) {
        for (part, dp) in part_states.iter_mut().zip(dp.chunks_exact(3)) {
            part.acceleration = Vec3::from_column_slice(dp);
        }
    }
    fn energy(&self, x: &[f64], gravity: &Vec3) -> Energy {
        let (positions, velocities) = x.split_at(3 * self.nodes.len());
        let of = |numbers: &[f64], of: &dyn Fn(f64, Vec3) -> f64| {
            let nodes = self.masses.iter().zip(numbers.chunks_exact(3));
            nodes.map(|(mass, x)| of(*mass, Vec3::from_column_slice(x))).sum::<f64>()
        };
        let weight = of(positions, &|mass, x| -mass * gravity.dot(&x));
        let kinetic = of(velocities, &|mass, v| 0.5 * mass * v.norm_squared());
        Energy { kinetic, potential: weight + self.spring_energy(x) }
    }
}

impl Collidable for SpringMesh {
    fn parts(&self) -> usize {
        self.nodes.len()
    }
    fn shape(&self, _part: usize) -> Option<&Shape> {
        self.shape.as_ref()
    }
    fn material(&self, _part: usize) -> Material {
        self.material
    }
    fn part_moves(&self, part: usize) -> bool {
        !self.pinned[part]
    }
}
