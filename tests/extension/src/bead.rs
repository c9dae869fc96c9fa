//! A bead that slides without friction on a wire bent to a cycloid (Huygens' pendulum): one degree
//! of freedom whose inertia depends on it.
//!
//! ```text
//! r(φ) = R·(φ + sin φ, 0, 1 − cos φ)                    |r'|² = 4R²·cos²(φ/2)
//! M(φ) = 4mR²·cos²(φ/2)     p = M·φ̇                     H = p²/2M + m·g·z
//! ℓ(φ) = 4R·sin(φ/2)         σ = ℓ̇ = 2R·cos(φ/2)·φ̇      arc length from the lowest point, and speed along the wire
//! ```
//!
//! Without forces the bead keeps `σ`, and `p` changes with `M`:
//! [`Bead::free_motion`](Integratable::free_motion) is exact. Under gravity `ℓ̈ = −(g/4R)·ℓ`:
//! harmonic at *every* amplitude, with the period `4π√(R/g)` (Huygens, *Horologium Oscillatorium*,
//! 1673).
//!
//! | symbol | meaning |
//! |---|---|
//! | `X = [φ, p]` | state: angle (rad), and its canonical momentum (kg·m²/s) |
//! | `R` | radius of the rolling circle, m |
//! | `L = √M` | so that `u = p/√M = √m·σ` |

use tumble_core::collide::{Pose, Quat, Shape, Vec3};
use tumble_core::{
    Cache, Collidable, Constraint, Integratable, Level, Material, MomentumKind, Object, PartPoint, PartState,
    RowBuilder, RowTarget, StateRange, StateSizes, WorldView, rows::RowSet,
};

/// A bead on a cycloid in the x–z plane, lowest at the origin; its ends are at `|φ| = π`.
#[derive(Clone)]
pub struct Bead {
    name: String,
    mass: f64,
    radius: f64,
    shape: Shape,
    /// Surface constants.
    pub material: Material,
    /// Angle at time 0, rad.
    pub angle: f64,
    /// Speed along the wire at time 0, m/s.
    pub speed: f64,
    /// A stop: `φ` cannot go beyond it, rad.
    pub stop: Option<f64>,
}

/// Values that a bead derives from its state.
struct BeadCache {
    /// `√M`.
    root: f64,
    /// `r'`.
    tangent: Vec3,
}

impl Bead {
    /// A bead of `mass` kg and the given shape on the cycloid of a circle of `radius` m (both above
    /// 0).
    pub fn new(name: impl Into<String>, mass: f64, radius: f64, shape: Shape) -> Bead {
        Bead {
            name: name.into(),
            mass,
            radius,
            shape,
            material: Material::default(),
            angle: 0.0,
            speed: 0.0,
            stop: None,
        }
    }

    /// Sets the angle (rad, within ±π) and the speed along the wire (m/s) at time 0.
    pub fn at(mut self, angle: f64, speed: f64) -> Bead {
        (self.angle, self.speed) = (angle, speed);
        self
    }

    /// Sets the constants of the surface.
    pub fn with_material(mut self, material: Material) -> Bead {
        self.material = material;
        self
    }

    /// Sets a stop at an angle, rad.
    pub fn stopped_at(mut self, angle: f64) -> Bead {
        self.stop = Some(angle);
        self
    }

    fn position(&self, phi: f64) -> Vec3 {
        self.radius * Vec3::new(phi + phi.sin(), 0.0, 1.0 - phi.cos())
    }

    fn tangent(&self, phi: f64) -> Vec3 {
        self.radius * Vec3::new(1.0 + phi.cos(), 0.0, phi.sin())
    }

    /// `|r'| = 2R·cos(φ/2)`.
    fn stretch(&self, phi: f64) -> f64 {
        2.0 * self.radius * (0.5 * phi).cos()
    }

    fn inertia(&self, phi: f64) -> f64 {
        self.mass * self.stretch(phi).powi(2)
    }
}

impl Object for Bead {
    fn name(&self) -> &str {
        &self.name
    }

    fn new_cache(&self) -> Cache {
        Cache::new(BeadCache { root: 0.0, tangent: Vec3::zeros() })
    }

    fn refresh(&self, x: &[f64], cache: &mut Cache, part_states: &mut [PartState]) {
        let cache: &mut BeadCache = cache.get();
        (cache.root, cache.tangent) = (self.inertia(x[0]).sqrt(), self.tangent(x[0]));
        let (bend, rate) = (self.radius * Vec3::new(-x[0].sin(), 0.0, x[0].cos()), x[1] / cache.root.powi(2));
        part_states[0].pose = Pose::from_parts(self.position(x[0]).into(), Quat::identity());
        part_states[0].velocity = cache.tangent * rate;
        part_states[0].bias_acceleration = bend * (rate * rate);
    }

    fn integratable(&self) -> Option<&dyn Integratable> {
        Some(self)
    }

    fn collidable(&self) -> Option<&dyn Collidable> {
        Some(self)
    }

    fn constraint(&self) -> Option<&dyn Constraint> {
        self.stop.map(|_| self as &dyn Constraint)
    }
}

impl Integratable for Bead {
    fn state_sizes(&self) -> StateSizes {
        StateSizes { x: 2, dof: 1, parts: 1 }
    }

    fn write_initial(&self, x: &mut [f64]) {
        x.copy_from_slice(&[self.angle, self.mass * self.stretch(self.angle) * self.speed]);
    }

    fn part_mass(&self, _part: usize) -> f64 {
        self.mass
    }

    fn momentum_kind(&self) -> MomentumKind {
        MomentumKind::Conjugate
    }

    fn velocity(&self, x: &[f64], v: &mut [f64]) {
        v[0] = x[1] / self.inertia(x[0]);
    }

    fn write_velocity(&self, x: &mut [f64], v: &[f64]) {
        x[1] = self.inertia(x[0]) * v[0];
    }

    /// Exact: the arc length grows by `σ·h`, and `p` follows `M`.
    fn free_motion(&self, _cache: &mut Cache, x: &mut [f64], h: f64) {
        let sigma = x[1] / (self.mass * self.stretch(x[0]));
        let arc = 4.0 * self.radius * (0.5 * x[0]).sin() + sigma * h;
        x[0] = 2.0 * (arc / (4.0 * self.radius)).clamp(-1.0, 1.0).asin();
        x[1] = self.mass * self.stretch(x[0]) * sigma;
    }

    /// `½·M'·φ̇²`, because `M·φ̈ = Q − ½·M'·φ̇²`.
    fn gyroscopic(&self, x: &[f64], out: &mut [f64]) {
        out[0] = -self.mass * self.radius.powi(2) * x[0].sin() * (x[1] / self.inertia(x[0])).powi(2);
    }

    /// `J = axisᵀ·r'`.
    fn jacobian(&self, cache: &mut Cache, at: &PartPoint, j: &mut [f64]) {
        let cache: &mut BeadCache = cache.get();
        at.axes.iter().zip(j).for_each(|(axis, j)| *j += axis.dot(&cache.tangent));
    }

    fn mul_l(&self, cache: &mut Cache, v: &[f64], u: &mut [f64]) {
        u[0] = cache.get::<BeadCache>().root * v[0];
    }

    fn solve_l(&self, cache: &mut Cache, u: &[f64], v: &mut [f64]) {
        v[0] = u[0] / cache.get::<BeadCache>().root;
    }

    fn solve_lt(&self, cache: &mut Cache, j: &[f64], y: &mut [f64]) {
        y[0] = j[0] / cache.get::<BeadCache>().root;
    }

    fn mul_lt(&self, cache: &mut Cache, u: &[f64], j: &mut [f64]) {
        j[0] = cache.get::<BeadCache>().root * u[0];
    }
}

impl Collidable for Bead {
    fn shape(&self, _part: usize) -> Option<&Shape> {
        Some(&self.shape)
    }

    fn material(&self, _part: usize) -> Material {
        self.material
    }
}

/// The stop: `0 ≤ (φ_stop − φ) ⟂ λ ≥ 0`.
impl Constraint for Bead {
    fn rows(&self, me: &StateRange, view: &WorldView, _level: Level, out: &mut RowBuilder) {
        let (Some(stop), owner) = (self.stop, out.owner()) else { return };
        out.row(RowTarget::new(RowSet::HalfLine, stop - view.x[me.x.start])).on_coordinates(owner, &[-1.0]);
    }

    fn gaps(&self, me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        out.extend(self.stop.map(|stop| stop - view.x[me.x.start]));
    }
}
