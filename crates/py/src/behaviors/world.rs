//! The methods of `World` that add soft bodies, particles, flocks and fields.

use crate::arrays::convert::{pose, some, vec3_or};
use crate::arrays::whole;
use crate::behaviors::field::{self, Field};
use crate::behaviors::flock::{PyFlock, steering};
use crate::behaviors::particles::{self, Emitter, Given, Particles};
use crate::behaviors::placed;
use crate::behaviors::soft::{self, Common, Grid, Soft};
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::world::class::World;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::behaviors::{Cloth, Flock, Jelly, ParticleSettings, Steering};
use tumble::collide::Vec3;

#[pymethods]
impl World {
    /// Adds a rectangular cloth in the xy-plane of its frame: point masses, the nodes, joined by springs. Returns its
    /// handle.
    ///
    /// nodes: along x and y, at least 2 each. size: along x and y, m. mass: of the whole, kg. stiffness: of the springs
    /// of structure, of shear and of bending, N/m. damping: of each spring over its stiffness, s. position: of the
    /// middle, m; orientation: unit quaternion (x, y, z, w). velocity: m/s. node_radius: with which the nodes collide,
    /// m, None for no collisions. pins: nodes that never move: names of sides (``"x_min"``, ``"x_max"``, ``"y_min"``,
    /// ``"y_max"``), ``"corners"``, and numbers. implicitness: time in a step at which the springs act, 0.5 to 1; 1
    /// damps what a step does not resolve. friction, restitution: of the nodes. color: sRGB, each 0 to 1.
    #[pyo3(signature = (name="", *, nodes=None, size=None, mass=0.2, stiffness=None, damping=0.01, position=None, orientation=None, velocity=None,
        node_radius=None, pins=None, implicitness=1.0, friction=0.5, restitution=0.0, color=None, **unknown), text_signature = "($self, name='', *, nodes=None, size=None, mass=0.2, stiffness=None, damping=0.01, position=None, orientation=None, velocity=None, node_radius=None, pins=None, implicitness=1.0, friction=0.5, restitution=0.0, color=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_cloth(
        &self,
        py: Python<'_>,
        name: &str,
        #[pyo3(from_py_with = whole::nodes)] nodes: Option<[usize; 2]>,
        size: Option<&Bound<'_, PyAny>>,
        mass: f64,
        stiffness: Option<&Bound<'_, PyAny>>,
        damping: f64,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        node_radius: Option<f64>,
        pins: Option<&Bound<'_, PyAny>>,
        implicitness: f64,
        friction: f64,
        restitution: f64,
        color: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Soft> {
        keywords::check(unknown, "World.add_cloth")?;
        let usual = Cloth::default();
        let grid = Grid::Cloth(Cloth {
            nodes: nodes.unwrap_or(usual.nodes),
            size: size.map_or(Ok(usual.size), |size| some(size, "size"))?,
            mass,
            stiffness: stiffness.map_or(Ok(usual.stiffness), |k| some(k, "stiffness"))?,
            damping,
        });
        let (pose, velocity) = (pose(position, orientation)?, vec3_or(velocity, "velocity", Vec3::zeros())?);
        let given = Common { name, pose, velocity, node_radius, pins, implicitness, friction, restitution, color };
        soft::add(&self.shared, py, &grid, &given)
    }

    /// Adds a block of jelly: point masses, the nodes, joined by springs. Returns its handle.
    ///
    /// nodes, size: along x, y and z. pins: names of sides, ``"x_min"`` to ``"z_max"``, ``"corners"``, and numbers of
    /// nodes. The other arguments are those of ``add_cloth``.
    #[pyo3(signature = (name="", *, nodes=None, size=None, mass=2.0, stiffness=None, damping=0.01, position=None, orientation=None, velocity=None,
        node_radius=None, pins=None, implicitness=1.0, friction=0.5, restitution=0.0, color=None, **unknown), text_signature = "($self, name='', *, nodes=None, size=None, mass=2.0, stiffness=None, damping=0.01, position=None, orientation=None, velocity=None, node_radius=None, pins=None, implicitness=1.0, friction=0.5, restitution=0.0, color=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_jelly(
        &self,
        py: Python<'_>,
        name: &str,
        #[pyo3(from_py_with = whole::nodes)] nodes: Option<[usize; 3]>,
        size: Option<&Bound<'_, PyAny>>,
        mass: f64,
        stiffness: Option<&Bound<'_, PyAny>>,
        damping: f64,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        node_radius: Option<f64>,
        pins: Option<&Bound<'_, PyAny>>,
        implicitness: f64,
        friction: f64,
        restitution: f64,
        color: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Soft> {
        keywords::check(unknown, "World.add_jelly")?;
        let usual = Jelly::default();
        let grid = Grid::Jelly(Jelly {
            nodes: nodes.unwrap_or(usual.nodes),
            size: size.map_or(Ok(usual.size), |size| some(size, "size"))?,
            mass,
            stiffness: stiffness.map_or(Ok(usual.stiffness), |k| some(k, "stiffness"))?,
            damping,
        });
        let (pose, velocity) = (pose(position, orientation)?, vec3_or(velocity, "velocity", Vec3::zeros())?);
        let given = Common { name, pose, velocity, node_radius, pins, implicitness, friction, restitution, color };
        soft::add(&self.shared, py, &grid, &given)
    }

    /// Adds a system of particles: sparks, smoke, drops. Returns its handle.
    ///
    /// emitters: its sources, a list of ``Emitter``. capacity: most particles that live at once. seed: of its random
    /// numbers. mass, kg, and radius, m, of a particle. friction, restitution: at bodies. gravity_scale: factor of
    /// gravity, negative for smoke. linear_drag: 1/s, quadratic_drag: 1/m, both per mass. wind: velocity of the air,
    /// shape (3,), m/s. collidable: with bodies. group, mask: as in ``add_rigid``. two_way: whether bodies get the
    /// momentum that particles lose. color: sRGB, each 0 to 1. drawn_radius: in pictures, m, by default the radius.
    /// fade: seconds before its end in which a particle shrinks. opacity: share of the light from behind that the middle
    /// of a particle blocks, 0 to 1, or two numbers, at birth and at the end; None for solid particles. scale: factor of
    /// the drawn radius, one number or two likewise. end_color: sRGB at the end, where color is that at birth.
    /// glow: colors as they are, without light, for sparks and flames.
    #[pyo3(signature = (name="", emitters=vec![], *, capacity=10000, seed=0, mass=0.001, radius=0.01, friction=0.5, restitution=0.0, gravity_scale=1.0,
        linear_drag=0.0, quadratic_drag=0.0, wind=None, collidable=true, group=0, mask=None, two_way=false, color=None, drawn_radius=None, fade=0.0,
        opacity=None, scale=None, end_color=None, glow=false, **unknown),
        text_signature = "(self, name='', emitters=(), *, capacity=10000, seed=0, mass=0.001, radius=0.01, friction=0.5, restitution=0.0, gravity_scale=1.0, \
        linear_drag=0.0, quadratic_drag=0.0, wind=None, collidable=True, group=0, mask=None, two_way=False, color=None, drawn_radius=None, fade=0.0, \
        opacity=None, scale=None, end_color=None, glow=False)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_particles<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        emitters: Vec<PyRef<'py, Emitter>>,
        #[pyo3(from_py_with = whole::capacity)] capacity: usize,
        #[pyo3(from_py_with = whole::seed)] seed: u64,
        mass: f64,
        radius: f64,
        friction: f64,
        restitution: f64,
        gravity_scale: f64,
        linear_drag: f64,
        quadratic_drag: f64,
        wind: Option<&Bound<'py, PyAny>>,
        collidable: bool,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'py, PyAny>>,
        two_way: bool,
        color: Option<&Bound<'py, PyAny>>,
        drawn_radius: Option<f64>,
        fade: f64,
        opacity: Option<&Bound<'py, PyAny>>,
        scale: Option<&Bound<'py, PyAny>>,
        end_color: Option<&Bound<'py, PyAny>>,
        glow: bool,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Particles> {
        keywords::check(unknown, "World.add_particles")?;
        let settings = ParticleSettings {
            capacity,
            seed,
            mass,
            radius,
            gravity_scale,
            linear_drag,
            quadratic_drag,
            collidable,
            two_way,
            ..ParticleSettings::default()
        };
        let surface = [friction, restitution];
        let given = Given {
            name,
            settings,
            surface,
            wind,
            group,
            mask,
            emitters,
            color,
            drawn_radius,
            fade,
            opacity,
            scale,
            end_color,
            glow,
        };
        particles::add(&self.shared, py, given)
    }

    /// Adds a flock without boids and returns its handle; ``Flock.add`` adds boids.
    ///
    /// Keywords are the constants of its forces: ``avoidance`` (m²/s²), ``matching`` (1/s), ``clustering`` (1/s²),
    /// ``max_force`` of these three together (N); ``visibility_distance``, ``inner_visibility_distance`` (m),
    /// ``visibility_angle``, ``inner_visibility_angle`` (rad): within the inner ones a neighbor is seen fully;
    /// ``desired_speed`` (m/s), ``speed_rate`` (1/s); ``boundary_center`` (m), ``boundary_radius`` (m),
    /// ``boundary_stiffness`` (N/m) of a soft sphere around the flock.
    #[pyo3(signature = (name="", **steering))]
    fn add_flock(&self, py: Python<'_>, name: &str, steering: Option<&Bound<'_, PyDict>>) -> Result<PyFlock> {
        let flock = Flock::new(name, self::steering(Steering::default(), steering)?)?;
        let place = self.shared.write(py, |inner| {
            let id = inner.world.add(flock)?;
            Ok(placed(&self.shared, inner, id))
        })?;
        PyFlock::new(py, place)
    }

    /// Adds a force field under a unique name; ``remove`` takes the name.
    ///
    /// targets: the bodies, cloths, jellies and boids that it acts on, as handles or names; None for all that move,
    /// also those that are added later.
    #[pyo3(signature = (name, field, *, targets=None, **unknown), text_signature = "($self, name, field, *, targets=None)")]
    fn add_field(
        &self,
        py: Python<'_>,
        name: &str,
        field: &Bound<'_, Field>,
        targets: Option<Vec<Bound<'_, PyAny>>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "World.add_field")?;
        if name.is_empty() {
            return Err(Error::value("name: a field needs one, to be removed by"));
        }
        field::add(&self.shared, py, name, field.get(), targets)
    }
}
