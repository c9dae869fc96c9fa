//! Bodies, joints and sensors that a program adds to a world.

use crate::arrays::convert::{direction, pose, vec3, vec3_or};
use crate::arrays::whole;
use crate::choices::meaning;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::articulation::Articulation;
use crate::objects::body::{self, RigidBody};
use crate::objects::joint::Joint;
use crate::objects::mimic::Mimic;
use crate::objects::sensor::Sensor;
use crate::objects::shapes::Shape;
use crate::world::add::{add, articulated, named_shape, rigid, solid};
use crate::world::class::World;
use crate::world::joints;
use crate::world::mimics;
use crate::world::query::{self};
use crate::world::sensors;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble::collide::{ContactMode, Vec3};
use tumble::dynamics::{Material, Mode, SensorNoise};

#[pymethods]
impl World {
    /// Adds a body that moves.
    ///
    /// name: unique, of any length; without one, as in ``add_rigid(Sphere(0.1), mass=1)``, the world
    /// makes one from the number of objects added before, such as ``"body 3"``.
    /// mass: kg, or density: kg/m³; without both the density is 1000 kg/m³. position: of the shape's frame, for a mesh the
    /// file's, meters. orientation: unit quaternion (x, y, z, w). velocity, m/s, and
    /// angular_velocity, rad/s: world axes. restitution: 0 to 1. friction: at least 0. kinematic:
    /// moves at its prescribed velocity. contacts: contact mode, ``"surface"``, or ``"spheres"``
    /// for the spheres of its tree as in the thesis; a pair uses spheres if either body does. group, mask:
    /// collision group, 0 to 63, and the groups that it collides with, as bits of an integer or a
    /// sequence, None for all; two bodies collide if the group of each is in the mask of the other.
    /// sensor: no contacts; ``events`` reports the bodies that overlap it. inertia: about the center of
    /// mass, shape (3, 3) or (3,), kg·m², by default that of a uniform body; center_of_mass: in the
    /// frame of the shape, shape (3,), m; gravity_scale, locked: as the properties of a body. non_spinning: locks all
    /// rotations, so that forces and impulses act on the center of mass alone. intersect: an object of a subclass of
    /// ``tumble.Intersect``, the body's own intersection test; the shape then surrounds the true surface. one_way: as
    /// the property. appearance: a ``tumble.Appearance``, by default one of a few colors in turn.
    #[pyo3(signature = (name=None, shape=None, mass=None, density=None, position=None, orientation=None, velocity=None, angular_velocity=None, restitution=0.0,
        friction=0.5, *, linear_damping=0.0, angular_damping=0.0, kinematic=false, collidable=true, contacts="surface", group=0, mask=None, sensor=false, inertia=None, center_of_mass=None, gravity_scale=1.0, locked=None, non_spinning=false, intersect=None, one_way=None, appearance=None, **unknown), text_signature = "($self, name=None, shape=None, mass=None, density=None, position=None, orientation=None, velocity=None, angular_velocity=None, restitution=0.0, friction=0.5, *, linear_damping=0.0, angular_damping=0.0, kinematic=False, collidable=True, contacts='surface', group=0, mask=None, sensor=False, inertia=None, center_of_mass=None, gravity_scale=1.0, locked=None, non_spinning=False, intersect=None, one_way=None, appearance=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_rigid(
        &self,
        py: Python<'_>,
        name: Option<&Bound<'_, PyAny>>,
        shape: Option<&Bound<'_, PyAny>>,
        mass: Option<f64>,
        density: Option<f64>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        angular_velocity: Option<&Bound<'_, PyAny>>,
        restitution: f64,
        friction: f64,
        linear_damping: f64,
        angular_damping: f64,
        kinematic: bool,
        collidable: bool,
        contacts: &str,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        sensor: bool,
        inertia: Option<&Bound<'_, PyAny>>,
        center_of_mass: Option<&Bound<'_, PyAny>>,
        gravity_scale: f64,
        locked: Option<&Bound<'_, PyAny>>,
        non_spinning: bool,
        intersect: Option<&Bound<'_, PyAny>>,
        one_way: Option<&Bound<'_, PyAny>>,
        appearance: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<RigidBody> {
        keywords::check(unknown, "World.add_rigid")?;
        let (name, shape) = named_shape(name, shape)?;
        let mode = if kinematic { Mode::Kinematic } else { Mode::Dynamic };
        let motion = [
            vec3_or(velocity, "velocity", Vec3::zeros())?,
            vec3_or(angular_velocity, "angular_velocity", Vec3::zeros())?,
        ];
        let mut body = rigid(&name, &shape, mass, density, kinematic)?
            .with_pose(pose(position, orientation)? * shape.placement)
            .with_material(Material { restitution, friction, ..Material::default() });
        (body.linear_damping, body.angular_damping, body.contact_mode) =
            (linear_damping, angular_damping, meaning("contacts", contacts, ContactMode::NAMES)?);
        let mut body = body
            .with_groups(query::group(group)?, query::mask(mask)?)
            .with_sensor(sensor)
            .with_gravity_scale(gravity_scale)
            .with_locked(locked.map(body::locked).transpose()?.unwrap_or_default());
        if non_spinning {
            body = tumble::behaviors::non_spinning(body);
        }
        if let Some(inertia) = inertia {
            if body.is_fixed() {
                return Err(Error::value("inertia: expected a mass or a density with it"));
            }
            body = body.with_inertia(body::inertia(inertia)?);
        }
        if let Some(center) = center_of_mass {
            body = body.with_center_of_mass(vec3(center, "center_of_mass")?);
        }
        let mut body = body.with_velocity(motion[0]).with_angular_velocity(motion[1]);
        body.one_way = one_way.map(|given| direction(given, "one_way")).transpose()?;
        add(&self.shared, py, body, mode, collidable, intersect, appearance)
    }

    /// Adds geometry that never moves. name, position, orientation, restitution, friction, contacts,
    /// group, mask, sensor, intersect, one_way, appearance: as in ``add_rigid``; by default gray, planes checkered.
    #[pyo3(signature = (name=None, shape=None, position=None, orientation=None, restitution=0.0, friction=0.5, *, collidable=true, contacts="surface", group=0, mask=None, sensor=false, intersect=None, one_way=None, appearance=None, **unknown), text_signature = "($self, name=None, shape=None, position=None, orientation=None, restitution=0.0, friction=0.5, *, collidable=True, contacts='surface', group=0, mask=None, sensor=False, intersect=None, one_way=None, appearance=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_static(
        &self,
        py: Python<'_>,
        name: Option<&Bound<'_, PyAny>>,
        shape: Option<&Bound<'_, PyAny>>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        restitution: f64,
        friction: f64,
        collidable: bool,
        contacts: &str,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        sensor: bool,
        intersect: Option<&Bound<'_, PyAny>>,
        one_way: Option<&Bound<'_, PyAny>>,
        appearance: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<RigidBody> {
        keywords::check(unknown, "World.add_static")?;
        let (name, shape) = named_shape(name, shape)?;
        let pose = pose(position, orientation)? * shape.placement;
        let mut body = solid(&shape)
            .with_name(name)
            .with_pose(pose)
            .with_material(Material { restitution, friction, ..Material::default() })
            .with_contact_mode(meaning("contacts", contacts, ContactMode::NAMES)?)
            .with_groups(query::group(group)?, query::mask(mask)?)
            .with_sensor(sensor);
        body.one_way = one_way.map(|given| direction(given, "one_way")).transpose()?;
        add(&self.shared, py, body, Mode::Static, collidable, intersect, appearance)
    }

    /// Adds an articulated body and returns its handle.
    ///
    /// articulation: a description, a builder, or the path of a URDF, a model of MuJoCo or an SDF file. base: pose
    /// of its base: a position (3,), or position and quaternion (7,), meters and (x, y, z, w). name: by default the
    /// description's. It starts with the ``q``, ``qd`` and ``tau`` of the description; the pose of
    /// a floating root is relative to the base.
    #[pyo3(signature = (articulation, base=None, *, name=None, **unknown), text_signature = "($self, articulation, base=None, *, name=None)")]
    fn add_articulation(
        &self,
        py: Python<'_>,
        articulation: &Bound<'_, PyAny>,
        base: Option<&Bound<'_, PyAny>>,
        name: Option<&str>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Articulation> {
        keywords::check(unknown, "World.add_articulation")?;
        articulated(&self.shared, py, articulation, base, name)
    }

    /// Joins two bodies, or a body and the world, in their present poses, and returns the joint.
    ///
    /// kind: ``"fixed"``, ``"revolute"`` (turns about the axis), ``"prismatic"`` (slides along it),
    /// ``"spherical"``, ``"cylindrical"`` (both turns and slides), ``"universal"`` (turns about the axis,
    /// which is fixed to a, and second_axis, fixed to b), ``"planar"`` (slides across the axis and turns
    /// about it), ``"distance"``, ``"rope"`` (at most a length), ``"spring"``, ``"gear"``, ``"rack"``, ``"screw"`` or ``"pulley"``. a, b: handles or names;
    /// a link is ``"ARTICULATION/LINK"`` or ``(articulation, "LINK")``; None is the world.
    ///
    /// point: shape (3,), m, by default the center of mass of a, or the origin of a link; second_point:
    /// the end on b of a distance, rope or spring, by default likewise of b. axis: shape (3,), any length
    /// above 0. length: of a distance, rope or spring, m, by default the present one.
    ///
    /// teeth: of the gears a and b, negative for inner teeth; they turn about axis and second_axis, which
    /// do not move in the world. radius, m: a rack b moves along second_axis by it per radian of a
    /// about axis. pitch, m: displacement of a screw per turn. ground: the points of the world over which the rope of
    /// a pulley runs, shape (2, 3), m; ratio: the weight of b's side in its length.
    ///
    /// limits: (lower, upper) of the position, rad or m. drive: a dict with the arguments of
    /// ``Joint.set_drive``. stiffness, rest: a spring along the position, N·m/rad or N/m, and rad or m; of a spherical joint, rest
    /// and target may be a rotation vector, shape (3,).
    /// cone: largest angle of a spherical joint between its axis on a and that on b, rad; twist_limits: (lower, upper) of its turn about that axis, rad. max_velocity: largest speed
    /// of the position, rad/s or m/s. damping: N·m·s/rad or N·s/m. friction: N·m or N. effort: the force of its motor, N·m or N, which limits drives
    /// that name no max_force. armature: inertia of its rotor, kg·m² or kg. dofs: dicts of these settings for each degree of freedom in the order of
    /// ``Joint.dofs``, where the joint has several; without them they are those of the first one, of a spherical joint of all three. breaking_force, N, and breaking_torque about the
    /// point, N·m: above one of them the joint breaks; ``events`` has a ``"joint_broken"`` then. The
    /// bodies do not collide with each other, unless ``set_pair_material(a, b, collides=True)`` lets them; those of a distance, rope,
    /// spring or pulley do. Points and axes are in the world. angle: rad, of a revolute joint that counts its turns, where its limits are more than 3π/2 apart or on one
    /// side: of the angles that its frames have now it takes the nearest to this number.
    #[pyo3(signature = (kind, a, b=None, point=None, axis=None, limits=None, drive=None, breaking_force=None, *, name="", second_point=None,
        second_axis=None, length=None, stiffness=0.0, rest=None, damping=0.0, friction=0.0, breaking_torque=None, teeth=None, radius=None, pitch=None, ratio=1.0, ground=None,
        cone=None, max_velocity=None, effort=None, armature=0.0, twist_limits=None, dofs=None, angle=None, **unknown))]
    #[pyo3(
        text_signature = "($self, kind, a, b=None, point=None, axis=(0.0, 0.0, 1.0), limits=None, drive=None, breaking_force=None, *, name='', \
        second_point=None, second_axis=None, length=None, stiffness=0.0, rest=None, damping=0.0, friction=0.0, breaking_torque=None, teeth=None, radius=None, \
        pitch=None, ratio=1.0, ground=None, cone=None, max_velocity=None, effort=None, armature=0.0, twist_limits=None, dofs=None, angle=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_joint(
        &self,
        py: Python<'_>,
        kind: &str,
        a: Option<&Bound<'_, PyAny>>,
        b: Option<&Bound<'_, PyAny>>,
        point: Option<&Bound<'_, PyAny>>,
        axis: Option<&Bound<'_, PyAny>>,
        limits: Option<&Bound<'_, PyAny>>,
        drive: Option<&Bound<'_, PyDict>>,
        breaking_force: Option<f64>,
        name: &str,
        second_point: Option<&Bound<'_, PyAny>>,
        second_axis: Option<&Bound<'_, PyAny>>,
        length: Option<f64>,
        stiffness: f64,
        rest: Option<&Bound<'_, PyAny>>,
        damping: f64,
        friction: f64,
        breaking_torque: Option<f64>,
        #[pyo3(from_py_with = whole::teeth)] teeth: Option<[i32; 2]>,
        radius: Option<f64>,
        pitch: Option<f64>,
        ratio: f64,
        ground: Option<&Bound<'_, PyAny>>,
        cone: Option<f64>,
        max_velocity: Option<f64>,
        effort: Option<f64>,
        armature: f64,
        twist_limits: Option<&Bound<'_, PyAny>>,
        dofs: Option<Vec<Bound<'_, PyDict>>>,
        angle: Option<f64>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Joint> {
        keywords::check(unknown, "World.add_joint")?;
        let given = joints::Arguments {
            kind,
            sides: [a, b],
            points: [point, second_point],
            axes: [axis, second_axis],
            limits,
            drive,
            breaking: [breaking_force, breaking_torque],
            name,
            length,
            stiffness,
            rest,
            damping,
            friction,
            teeth,
            radius,
            pitch,
            ratio,
            ground,
            cone,
            max_velocity,
            effort,
            armature,
            twist_limits,
            dofs,
            angle,
        };
        joints::add(&self.shared, py, &given)
    }

    /// Couples two joints, and returns the coupling: the position of ``joint`` is ``multiplier`` times that of ``of``, plus ``offset``.
    ///
    /// joint, of: joints made by ``add_joint``, by handle or name, of a kind with a position other than ``"spherical"``; or
    /// links that a revolute or prismatic joint moves, ``"ARTICULATION/LINK"`` or ``(articulation, "LINK")``. Together they
    /// join two bodies that move at most. multiplier: not 0; between two angles of joints without limits a ratio of whole
    /// numbers up to 1000. offset: rad or m, as the position of ``joint``.
    #[pyo3(signature = (joint, of, multiplier=1.0, offset=0.0, *, name="", **unknown), text_signature = "($self, joint, of, multiplier=1.0, offset=0.0, *, name='')")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_mimic(
        &self,
        py: Python<'_>,
        joint: &Bound<'_, PyAny>,
        of: &Bound<'_, PyAny>,
        multiplier: f64,
        offset: f64,
        name: &str,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Mimic> {
        keywords::check(unknown, "World.add_mimic")?;
        mimics::add(&self.shared, py, [joint, of], [multiplier, offset], name)
    }

    /// Adds a measuring sensor, read after every step: ``world.sensors[name]``.
    ///
    /// kind: ``"accelerometer"``, ``"gyroscope"``, ``"velocimeter"`` (in the axes of the site), ``"force"`` and ``"torque"`` (of the joint
    /// that moves the link, on the link; of a loop joint, on its side a), ``"touch"`` (normal force on the link or body), ``"range_finder"``
    /// (along z of the site; -1 if nothing is there), ``"position"``, ``"orientation"``, ``"linear_velocity"``, ``"angular_velocity"``,
    /// ``"linear_acceleration"``, ``"angular_acceleration"``, ``"joint_position"``, ``"joint_velocity"`` or ``"drive_force"``. Accelerations
    /// and forces are means over the step.
    ///
    /// on: a body, a link (``"ARTICULATION/LINK"`` or ``(articulation, "LINK")``) or a joint, as handle or name; None is the world.
    /// position: shape (3,), m, and orientation, (x, y, z, w): the site in the frame of the body or link. relative_to: a body or link
    /// against whose frame positions, orientations and velocities are read. volume: a shape at the site; touch outside does not
    /// count. cutoff: largest absolute value of a reading; of a camera of any kind the largest depth that it sees, m.
    ///
    /// deviation: standard deviation of white noise. bias_walk: that of the change of a bias in a second. quantization: distance
    /// of the values that a reading can have. delay: steps by which it is late. seed: start of the noise.
    ///
    /// ``"depth"``, ``"segmentation"`` and ``"color"`` are cameras that look along z of the site, with x to the right and y down in the image.
    /// resolution: pixels in a row and rows, by default (64, 48). vertical_fov: rad, by default π/4. Their readings are made when
    /// they are read: distances along z, m, shape (rows, columns), -1 where nothing is; and what a pixel shows, shape (rows,
    /// columns, 2): the index in ``world.bodies`` and that of the link in its ``link_names``, -1 for nothing and other objects. An
    /// image has one bias; a segmentation has no noise. With a delay a camera makes its image after every step, and keeps it
    /// in the state.
    #[pyo3(signature = (kind, on=None, *, name="", position=None, orientation=None, relative_to=None, volume=None, cutoff=None, deviation=0.0,
        bias_walk=0.0, quantization=0.0, delay=0, seed=0, resolution=None, vertical_fov=None, **unknown), text_signature = "($self, kind, on=None, *, name='', position=None, orientation=None, relative_to=None, volume=None, cutoff=None, deviation=0.0, bias_walk=0.0, quantization=0.0, delay=0, seed=0, resolution=None, vertical_fov=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_sensor(
        &self,
        py: Python<'_>,
        kind: &str,
        on: Option<&Bound<'_, PyAny>>,
        name: &str,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        relative_to: Option<&Bound<'_, PyAny>>,
        volume: Option<&Bound<'_, Shape>>,
        cutoff: Option<f64>,
        deviation: f64,
        bias_walk: f64,
        quantization: f64,
        #[pyo3(from_py_with = whole::delay)] delay: u32,
        #[pyo3(from_py_with = whole::seed)] seed: u64,
        #[pyo3(from_py_with = whole::resolution)] resolution: Option<[u32; 2]>,
        vertical_fov: Option<f64>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Sensor> {
        keywords::check(unknown, "World.add_sensor")?;
        let noise = SensorNoise { deviation, bias_walk, quantization, delay, seed };
        let given = sensors::Arguments {
            kind,
            on,
            name,
            position,
            orientation,
            relative_to,
            volume,
            cutoff,
            noise,
            resolution,
            vertical_fov,
        };
        sensors::add(&self.shared, py, &given)
    }
}
