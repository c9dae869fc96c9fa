//! Makes descriptions of articulated bodies link by link.

use crate::arrays::convert::{Numbers, direction, direction_or, numbers, pose, shown, vec3, vec3_or};
use crate::arrays::whole;
use crate::choices::{JOINT_TYPES, JointType, meaning};
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::appearance::{self, palette};
use crate::objects::articulation::Articulation;
use crate::objects::body::link_inertia;
use crate::objects::joints::{component, drive_at};
use crate::objects::shape_material::Given;
use crate::objects::shapes::Shape;
use crate::world::query;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, MutexGuard};
use tumble::collide::{ContactMode, Mat3, Vec3};
use tumble::dynamics::{Appearance, ArticulationBuilder as Builder, Joint, LinkBuilder, LinkMass, Material, Spring};

/// Makes an articulated body link by link, without a file.
///
/// name: of the body. self_collision: whether its links collide with each other; links that a joint
/// connects never do. ``build`` returns a description; ``World.add_articulation`` takes the builder
/// too.
#[pyclass(frozen, module = "tumble")]
pub struct ArticulationBuilder {
    builder: Mutex<Builder>,
}

impl ArticulationBuilder {
    fn builder(&self) -> MutexGuard<'_, Builder> {
        self.builder.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn change(&self, change: impl FnOnce(Builder) -> Builder) {
        let mut builder = self.builder();
        *builder = change(builder.clone());
    }

    fn has(&self, link: &str) -> Result<()> {
        let builder = self.builder();
        if builder.links().iter().any(|known| known.name() == link) {
            return Ok(());
        }
        let names: Vec<&str> = builder.links().iter().map(LinkBuilder::name).take(12).collect();
        Err(Error::Name(match names.is_empty() {
            true => format!("there is no link named '{link}'; there are none yet"),
            false => format!("there is no link named '{link}'; there are {}", names.join(", ")),
        }))
    }

    /// Returns the description.
    pub fn description(&self) -> Result<Articulation> {
        let body = self.builder().build()?;
        Ok(Articulation::described(body))
    }
}

#[pymethods]
impl ArticulationBuilder {
    #[new]
    #[pyo3(
        signature = (name="articulation", *, self_collision=true, **unknown),
        text_signature = "(name='articulation', *, self_collision=True)"
    )]
    fn new(name: &str, self_collision: bool, unknown: Option<Unknown<'_, '_>>) -> Result<ArticulationBuilder> {
        keywords::check(unknown, "ArticulationBuilder")?;
        Ok(ArticulationBuilder { builder: Mutex::new(Builder::new(name).with_self_collision(self_collision)) })
    }

    /// Adds a link. Its joint has the same name.
    ///
    /// parent: a link that was added before; None: the base. joint: ``"revolute"``, ``"prismatic"``,
    /// ``"spherical"``, ``"fixed"``, or ``"floating"`` without a parent. axis: of a revolute or
    /// prismatic joint, shape (3,), any length above 0, or ``"x"``, ``"-z"`` and so on. position, orientation: the frame of the joint
    /// in the frame of the parent, shape (3,), m, and (4,); with the joint at zero it is the frame of
    /// the link.
    ///
    /// shape: collides and is drawn, at shape_position and shape_orientation in the frame of the link;
    /// ``add_shape`` adds others. mass, kg: spread over the volumes of all shapes; or density, kg/m³,
    /// by default that of water. A link without shapes has no mass. center_of_mass, shape (3,), m, and
    /// inertia about it, shape (3, 3) or (3,), kg·m²: numbers for ``mass``, without regard to the shapes;
    /// a point mass without inertia.
    ///
    /// limits: (lower, upper), rad or m. joint_damping: N·m·s/rad or N·s/m. joint_friction: N·m or N.
    /// armature: inertia of the rotor of a revolute, prismatic or spherical joint, as the joint meets it, kg·m² or kg.
    /// max_velocity: largest speed of the joint, rad/s or m/s. effort: the force of its motor, N·m or N, which limits drives that name no
    /// ``max_force``. stiffness, N·m/rad or N/m, and rest, rad or m: a spring. drive: a dict with the arguments of
    /// ``Articulation.set_drive``; or with ``times``, s, and ``values``, rad or m, of a recorded motion, of a spherical joint of shape (n,) or
    /// (n, 3), with ``repeat``, by default False, and ``max_force``. q, qd: position and velocity of the joint at the start, by its numbers in ``Articulation.q`` and ``qd``: a
    /// number of a revolute or prismatic joint; a unit quaternion, shape (4,), and the angular velocity in the axes of the link, shape
    /// (3,), of a spherical one; position and quaternion in the world, shape (7,), and (6,), of a floating one. A spherical joint has
    /// settings about each axis of the link: rest and the target of its drive may be rotation vectors, shape (3,), a number is for each
    /// component. cone: largest angle of a spherical joint between its axis, x, y or z, on the link and on the parent, rad; twist_limits:
    /// (lower, upper) of the turn of the link about that axis, rad.
    ///
    /// friction, restitution, and the other constants of surfaces, contacts, group, mask, collidable: of the shapes, as the
    /// properties of ``RigidBody``. color: sRGB, shape (3,); appearance: a ``tumble.Appearance`` instead.
    #[pyo3(signature = (name, parent=None, *, joint="revolute", axis=None, position=None, orientation=None, shape=None, shape_position=None,
        shape_orientation=None, mass=None, density=None, center_of_mass=None, inertia=None, limits=None, joint_damping=0.0, joint_friction=0.0,
        armature=0.0, stiffness=0.0, rest=None, drive=None, max_velocity=None, effort=None, q=None, qd=None, collidable=true, color=None, cone=None, contacts="surface", group=0, mask=None,
        twist_limits=None, appearance=None, **surface))]
    #[pyo3(
        text_signature = "($self, name, parent=None, *, joint='revolute', axis=(0.0, 0.0, 1.0), position=None, orientation=None, shape=None, \
        shape_position=None, shape_orientation=None, mass=None, density=None, center_of_mass=None, inertia=None, limits=None, joint_damping=0.0, \
        joint_friction=0.0, armature=0.0, stiffness=0.0, rest=0.0, drive=None, max_velocity=None, effort=None, q=None, qd=None, friction=0.5, restitution=0.0, collidable=True, color=None, cone=None, \
        contacts='surface', group=0, mask=None, twist_limits=None, static_friction=None, stribeck_speed=None, \
        friction_scale=None, rolling_friction=None, torsional_friction=None, tangential_restitution=None, adhesion=None, surface_velocity=None, appearance=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_link(
        &self,
        name: &str,
        parent: Option<&str>,
        joint: &str,
        axis: Option<&Bound<'_, PyAny>>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        shape: Option<PyRef<'_, Shape>>,
        shape_position: Option<&Bound<'_, PyAny>>,
        shape_orientation: Option<&Bound<'_, PyAny>>,
        mass: Option<f64>,
        density: Option<f64>,
        center_of_mass: Option<&Bound<'_, PyAny>>,
        inertia: Option<&Bound<'_, PyAny>>,
        limits: Option<&Bound<'_, PyAny>>,
        joint_damping: f64,
        joint_friction: f64,
        armature: f64,
        stiffness: f64,
        rest: Option<&Bound<'_, PyAny>>,
        drive: Option<&Bound<'_, PyDict>>,
        max_velocity: Option<f64>,
        effort: Option<f64>,
        q: Option<&Bound<'_, PyAny>>,
        qd: Option<&Bound<'_, PyAny>>,
        collidable: bool,
        color: Option<&Bound<'_, PyAny>>,
        cone: Option<f64>,
        contacts: &str,
        #[pyo3(from_py_with = whole::group)] group: u8,
        mask: Option<&Bound<'_, PyAny>>,
        twist_limits: Option<&Bound<'_, PyAny>>,
        appearance: Option<&Bound<'_, PyAny>>,
        surface: Option<&Bound<'_, PyDict>>,
    ) -> Result<()> {
        if self.builder().links().iter().any(|known| known.name() == name) {
            return Err(Error::value(format!("there is a link named '{name}' already")));
        }
        let axis = direction_or(axis, "axis", Vec3::z())?;
        if axis == Vec3::zeros() {
            return Err(Error::value("axis is [0, 0, 0]; expected a direction, any length above 0"));
        }
        let joint = match meaning("joint", joint, JOINT_TYPES)? {
            JointType::Revolute => Joint::revolute(axis),
            JointType::Prismatic => Joint::prismatic(axis),
            JointType::Spherical => Joint::Spherical,
            JointType::Fixed => Joint::Fixed,
            JointType::Floating => Joint::Floating,
        };
        let surface = Given::of_words("ArticulationBuilder.add_link", surface)?;
        let mut link = LinkBuilder::new(name, joint)
            .with_pose(pose(position, orientation)?)
            .with_joint_damping(joint_damping)
            .with_joint_friction(joint_friction)
            .with_armature(armature)
            .with_material(surface.over(Material::default()).unwrap_or_default())
            .with_contact_mode(meaning("contacts", contacts, ContactMode::NAMES)?)
            .with_groups(query::group(group)?, query::mask(mask)?);
        if let Some(parent) = parent {
            self.has(parent)?;
            link = link.with_parent(parent);
        }
        if let Some(limits) = limits {
            link = link.with_limits(pair(limits)?);
        }
        if cone.is_some() || twist_limits.is_some() {
            let along: Vec<usize> = (0..3).filter(|k| axis[*k] != 0.0).collect();
            let [k] = along[..] else {
                return Err(Error::value("axis: expected that of the cone, an axis x, y or z of the joint's frame"));
            };
            link = cone.into_iter().fold(link, |link, cone| link.with_cone(k, cone));
            let twist_limits = twist_limits.map(pair).transpose()?;
            link = twist_limits.into_iter().fold(link, |link, limits| link.with_twist_limits(k, limits));
        }
        link = max_velocity.into_iter().fold(link, LinkBuilder::with_max_velocity);
        link = effort.into_iter().fold(link, LinkBuilder::with_effort);
        link = with_force(link, joint.dof(), (stiffness, rest), drive, effort.unwrap_or(f64::INFINITY))?;
        if let Some(q) = q {
            link = link.with_positions(&flat(q, "q")?);
        }
        if let Some(qd) = qd {
            link = link.with_velocities(&flat(qd, "qd")?);
        }
        let color = match color {
            Some(color) => vec3(color, "color")?.map(|c| c as f32).into(),
            None => palette(self.builder().links().len()),
        };
        link = link.with_appearance(match appearance.map(appearance::given).transpose()? {
            Some(look) => look.in_body(&shape.as_ref().map_or_else(Vec3::zeros, |shape| shape.solid.center_of_mass())),
            None => Appearance { color, ..Appearance::default() },
        });
        link = with_mass(link, (mass, density), center_of_mass, inertia)?;
        if let Some(shape) = shape {
            link = with_shape(link, &shape, shape_position, shape_orientation, collidable)?;
        }
        self.change(|builder| builder.link(link));
        Ok(())
    }

    /// Adds a shape to a link. position, orientation: in the frame of the link. collidable: whether it
    /// collides, or is only drawn; both count for the mass. one_way: direction, shape (3,), in the frame of the shape, of a
    /// shape that collides on one side only, as in ``World.add_rigid``. sensor: no contacts; ``events`` reports the bodies that
    /// overlap it.
    ///
    /// mass, kg, or density, kg/m³: of the shape, for a link without a mass. friction, restitution, the other constants of surfaces,
    /// contacts, group, mask, color: by default those of the link; appearance: a ``tumble.Appearance`` instead of the color. visible: whether it is drawn.
    #[pyo3(signature = (link, shape, position=None, orientation=None, *, collidable=true, one_way=None, sensor=false, mass=None, density=None,
        contacts=None, group=None, mask=None, color=None, visible=true, appearance=None, **surface))]
    #[pyo3(
        text_signature = "($self, link, shape, position=None, orientation=None, *, collidable=True, one_way=None, sensor=False, mass=None, density=None, \
        friction=None, restitution=None, contacts=None, group=None, mask=None, color=None, visible=True, static_friction=None, stribeck_speed=None, \
        friction_scale=None, rolling_friction=None, torsional_friction=None, tangential_restitution=None, adhesion=None, surface_velocity=None, appearance=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_shape(
        &self,
        link: &str,
        shape: PyRef<'_, Shape>,
        position: Option<&Bound<'_, PyAny>>,
        orientation: Option<&Bound<'_, PyAny>>,
        collidable: bool,
        one_way: Option<&Bound<'_, PyAny>>,
        sensor: bool,
        mass: Option<f64>,
        density: Option<f64>,
        contacts: Option<&str>,
        #[pyo3(from_py_with = whole::group)] group: Option<u8>,
        mask: Option<&Bound<'_, PyAny>>,
        color: Option<&Bound<'_, PyAny>>,
        visible: bool,
        appearance: Option<&Bound<'_, PyAny>>,
        surface: Option<&Bound<'_, PyDict>>,
    ) -> Result<()> {
        self.has(link)?;
        if mass.is_some() && density.is_some() {
            return Err(Error::value(format!("shape of link '{link}': expected a mass or a density, not both")));
        }
        let surface = Given::of_words("ArticulationBuilder.add_shape", surface)?;
        let one_way = one_way.map(|given| direction(given, "one_way")).transpose()?;
        let mode = contacts.map(|contacts| meaning("contacts", contacts, ContactMode::NAMES)).transpose()?;
        let (group, mask) =
            (group.map(query::group).transpose()?, mask.map(|mask| query::mask(Some(mask))).transpose()?);
        let color = color.map(|color| vec3(color, "color")).transpose()?;
        let look = appearance.map(appearance::given).transpose()?;
        let pose = pose(position, orientation)? * shape.placement;
        let mut builder = self.builder();
        let Some(known) = builder.link_mut(link) else { return Ok(()) };
        let mut collider = known.collider(shape.solid.clone(), pose).with_sensor(sensor);
        collider.contact_mode = mode.unwrap_or(collider.contact_mode);
        (collider.group, collider.mask) = (group.unwrap_or(collider.group), mask.unwrap_or(collider.mask));
        collider.material = surface.over(collider.material).unwrap_or(collider.material);
        (collider.one_way, collider.name) = (one_way, shape.name.clone());
        let with = match collidable {
            true => known.clone().with_collider(collider),
            false => shape
                .name
                .iter()
                .fold(known.clone().with_visual_shape(shape.solid.clone(), pose), LinkBuilder::with_shape_name),
        };
        let with = mass.into_iter().fold(with.with_shape_visible(visible), LinkBuilder::with_shape_mass);
        let with = density.into_iter().fold(with, LinkBuilder::with_shape_density);
        let plain = color.map(|color| Appearance { color: color.map(|c| c as f32).into(), ..Appearance::default() });
        let looks = look.map(|look| look.in_body(&shape.solid.center_of_mass())).or(plain);
        *known = looks.into_iter().fold(with, LinkBuilder::with_shape_appearance);
        Ok(())
    }

    /// Couples the joint of a link to that of another: ``q = multiplier · q_of + offset``.
    #[pyo3(signature = (link, of, multiplier=1.0, offset=0.0, **unknown), text_signature = "($self, link, of, multiplier=1.0, offset=0.0)")]
    fn mimic(
        &self,
        link: &str,
        of: &str,
        multiplier: f64,
        offset: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "ArticulationBuilder.mimic")?;
        self.has(link)?;
        self.has(of)?;
        self.change(|builder| builder.mimic(link, of, multiplier, offset));
        Ok(())
    }

    /// Disables collisions between two links.
    #[pyo3(signature = (a, b, **unknown), text_signature = "($self, a, b)")]
    fn exclude_collisions(&self, a: &str, b: &str, unknown: Option<Unknown<'_, '_>>) -> Result<()> {
        keywords::check(unknown, "ArticulationBuilder.exclude_collisions")?;
        self.has(a)?;
        self.has(b)?;
        self.change(|builder| builder.exclude_collisions(a, b));
        Ok(())
    }

    /// Returns a description of the body, whose dynamics functions work at once. Later links do not
    /// change it.
    fn build(&self) -> Result<Articulation> {
        self.description()
    }

    fn __repr__(&self) -> String {
        let builder = self.builder();
        let links: Vec<&str> = builder.links().iter().map(LinkBuilder::name).collect();
        format!("<tumble.ArticulationBuilder {links:?}>")
    }
}

/// Sets the spring and the drive of each degree of freedom of a joint.
fn with_force(
    mut link: LinkBuilder,
    count: usize,
    (stiffness, rest): (f64, Option<&Bound<'_, PyAny>>),
    drive: Option<&Bound<'_, PyDict>>,
    effort: f64,
) -> Result<LinkBuilder> {
    // of several degrees of freedom each has its own component
    let count = if count == 3 { 3 } else { 1 };
    let common = link.dof().clone();
    for k in 0..count {
        let mut dof = common.clone();
        let rest = rest.map_or(Ok(0.0), |rest| component("rest", rest, k, count))?;
        if stiffness != 0.0 || !rest.is_finite() {
            dof.spring = Some(Spring { stiffness, rest });
        }
        if let Some(drive) = drive {
            dof.drive = drive_at(drive, effort, k, count)?;
        }
        link = if count == 1 { link.with_dof(dof) } else { link.with_dof_at(k, dof) };
    }
    Ok(link)
}

/// Converts a number, or numbers in a row.
fn flat(value: &Bound<'_, PyAny>, name: &str) -> Result<Vec<f64>> {
    let Numbers { shape, data } = numbers(value, name)?;
    match shape.len() {
        0 | 1 => Ok(data),
        _ => Err(Error::value(format!("{name}: expected a number, or numbers in a row, got {}", shown(&shape)))),
    }
}

fn with_shape(
    link: LinkBuilder,
    shape: &Shape,
    position: Option<&Bound<'_, PyAny>>,
    orientation: Option<&Bound<'_, PyAny>>,
    collidable: bool,
) -> Result<LinkBuilder> {
    let (solid, pose) = (shape.solid.clone(), pose(position, orientation)? * shape.placement);
    let link = if collidable { link.with_shape(solid, pose) } else { link.with_visual_shape(solid, pose) };
    Ok(shape.name.iter().fold(link, LinkBuilder::with_shape_name))
}

fn with_mass(
    link: LinkBuilder,
    mass: (Option<f64>, Option<f64>),
    center: Option<&Bound<'_, PyAny>>,
    tensor: Option<&Bound<'_, PyAny>>,
) -> Result<LinkBuilder> {
    let numbers = center.is_some() || tensor.is_some();
    Ok(match mass {
        (Some(_), Some(_)) => {
            let name = link.name();
            return Err(Error::value(format!("link '{name}': expected a mass or a density, not both")));
        }
        (Some(mass), None) if numbers => {
            let inertia = tensor.map_or(Ok(Mat3::zeros()), link_inertia)?;
            link.with_mass_properties(LinkMass {
                mass,
                center: vec3_or(center, "center_of_mass", Vec3::zeros())?,
                inertia,
            })
        }
        _ if numbers => {
            let name = link.name();
            return Err(Error::value(format!("link '{name}': center_of_mass and inertia need a mass")));
        }
        (Some(mass), None) => link.with_mass(mass),
        (None, Some(density)) => link.with_density(density),
        (None, None) => link,
    })
}

/// Converts limits.
pub fn pair(value: &Bound<'_, PyAny>) -> Result<[f64; 2]> {
    let wrong = |shape: &[usize]| Error::value(format!("limits: expected (lower, upper), got shape {}", shown(shape)));
    // infinite numbers are limits that are not there
    if let Ok([lower, upper]) = value.extract::<[f64; 2]>() {
        return Ok([lower, upper]);
    }
    let Numbers { shape, data } = numbers(value, "limits")?;
    <[f64; 2]>::try_from(data).map_err(|_| wrong(&shape))
}
