//! Bodies of a model as bodies of a scene: static ones, rigid ones and trees of links. `mocap.rs` has kinematic ones.

use nalgebra::{Translation3, one};
use tumble_core::articulated::LinkMass;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{Joint, LockedAxes, Mode};

use super::compiler::about;
use super::geom::{Form, Geom};
use super::joint::{JointItem, Kind};
use super::names::Taken;
use super::scene::{Assembly, Place};
use super::shapes::{is_level, make, on_link};
use crate::parse::appearance::AppearanceSpec;
use crate::parse::articulated::ArticulatedSpec;
use crate::parse::body::{BodySpec, MassSpec};
use crate::parse::joint::JointSpec;
use crate::parse::link::{LinkMassSpec, LinkSpec, Surface};
use crate::parse::mount::Mounts;
use crate::parse::shape::{CompoundPartSpec, PartFilter, ShapeSpec};
use crate::parse::view::GroundSpec;

impl Assembly<'_, '_> {
    /// Adds all bodies.
    pub(super) fn add_bodies(&mut self) {
        let mut order: Vec<usize> = (0..self.bodies.len()).collect();
        // Moving bodies keep their names where static geoms have the same.
        order.sort_by_key(|body| self.fixed[*body]);
        let roots = order.iter().copied().filter(|&b| !self.fixed[b] && self.fixed[self.bodies[b].parent]);
        for body in roots.collect::<Vec<_>>() {
            if self.mocap_of(self.bodies[body].parent).is_some() {
                let why = "bodies with joints below a mocap body are fixed to the world: they do not follow it";
                self.reader.notes.add(&self.bodies[body].element, why);
            }
            if !(self.is_free_leaf(body) && self.add_rigid(body)) {
                self.add_tree(body);
            }
        }
        for body in 0..self.bodies.len() {
            match self.mocap_of(body) {
                Some(mocap) if mocap == body => self.add_mocap(body),
                None if self.fixed[body] => self.add_static(body),
                _ => {}
            }
        }
    }

    /// Returns the name of a body: its own, or one with its number.
    pub(super) fn name_of(&self, body: usize) -> String {
        self.bodies[body].name.clone().unwrap_or_else(|| format!("body{body}"))
    }

    /// Adds a static body for each geom of a body that is fixed to the world.
    fn add_static(&mut self, body: usize) {
        let (bodies, pose) = (self.bodies, self.poses[body]);
        for (k, geom) in bodies[body].geoms.iter().enumerate() {
            let collidable = self.groups.collides(geom);
            if !collidable && !geom.visible {
                continue;
            }
            let Some(made) = make(geom, self.reader) else { continue };
            let owner = if body == 0 { "world".to_owned() } else { self.name_of(body) };
            let name = geom.name.clone().unwrap_or_else(|| format!("{owner}/geom{k}"));
            let (name, shape) = (self.taken.unique(name), self.meshes.shape(made));
            let spec = body_spec(name, Mode::Static, shape, &(pose * geom.pose), self.groups.surface(geom));
            let shape_name = geom.name.clone();
            let spec = BodySpec { collidable, visible: geom.visible, shape_name, ..spec };
            self.statics[body].push((k, self.scene.bodies.len()));
            let spec = self.with_ground(spec, geom, &(pose * geom.pose));
            self.scene.bodies.push(spec);
        }
    }

    /// Draws the first level plane as the ground of the scene.
    fn with_ground(&mut self, spec: BodySpec, geom: &Geom<'_>, pose: &Pose) -> BodySpec {
        if geom.form != Form::Plane || !is_level(pose) || !geom.visible || self.scene.ground.is_some() {
            return spec;
        }
        let plain = geom.appearance.pattern == AppearanceSpec::default().pattern;
        let appearance = if plain { GroundSpec::default_appearance() } else { geom.appearance.clone() };
        self.scene.ground = Some(GroundSpec { height_m: pose.translation.z, appearance });
        BodySpec { visible: false, ..spec }
    }

    /// Adds a free body as a rigid body. Returns whether that can express it.
    fn add_rigid(&mut self, body: usize) -> bool {
        let own = &self.bodies[body];
        let alike = |geom: &Geom<'_>| {
            self.groups.collides(geom)
                && geom.visible
                && self.groups.surface(geom) == self.groups.surface(&own.geoms[0])
                && !matches!(geom.form, Form::Plane | Form::Field(_))
        };
        let plain =
            own.sites.iter().all(|site| self.is_joint_end(site)) && own.cameras.is_empty() && own.lights.is_empty();
        let damped = own.joints[0].dof.damping > 0.0 || own.joints[0].dof.friction > 0.0;
        let mass = self.masses[body];
        if own.geoms.is_empty() || !plain || damped || mass.mass <= 0.0 || !own.geoms.iter().all(alike) {
            return false;
        }
        let mut parts = Vec::new();
        for geom in &own.geoms {
            let Some(made) = make(geom, self.reader) else { return false };
            parts.push(part(geom, self.meshes.shape(made)));
        }
        let name = self.taken.unique(self.name_of(body));
        let (shape, shape_name) = joined(parts);
        let surface = self.groups.surface(&own.geoms[0]);
        let spec = body_spec(name, Mode::Dynamic, shape, &self.poses[body], surface);
        self.places[body] = Place::Rigid(self.scene.bodies.len());
        self.scene.bodies.push(BodySpec {
            mass: Some(MassSpec::Mass(mass.mass)),
            center_m: Some(mass.center.into()),
            inertia_kg_m2: Some(mass.inertia),
            gravity_scale: own.gravity_scale,
            shape_name,
            ..spec
        });
        true
    }

    /// Adds a body that moves and all below it as an articulated body.
    fn add_tree(&mut self, root: usize) {
        let tree = self.scene.articulated.len();
        let name = self.taken.unique(self.name_of(root));
        // Bodies below a root follow it in the order of the file.
        let inside = |body: &usize| *body == root || self.bodies[*body].parent >= root;
        let members: Vec<usize> = (root..self.bodies.len()).take_while(inside).collect();
        let (mut links, mut taken) = (Vec::new(), Taken::default());
        let names: Vec<String> = members.iter().map(|body| taken.unique(self.name_of(*body))).collect();
        for (body, name) in members.into_iter().zip(names) {
            let base = match self.places[self.bodies[body].parent] {
                Place::Link(_, link) if body != root => Some(link),
                _ => None,
            };
            let pose = if base.is_some() { self.bodies[body].pose } else { self.poses[body] };
            self.add_links(body, name, (base, pose), tree, (&mut links, &mut taken));
            if self.bodies[body].gravity_scale != 1.0 {
                self.reader.notes.add(&self.bodies[body].element, "`gravcomp` of articulated bodies is left out");
            }
        }
        self.scene.articulated.push(ArticulatedSpec::of(name, links));
    }

    /// Adds the links of one body: a chain of massless links for all joints but the last, then the
    /// body itself. Its frame is that of the model.
    fn add_links(
        &mut self,
        body: usize,
        name: String,
        (mut parent, mut placement): (Option<usize>, Pose),
        tree: usize,
        (links, taken): (&mut Vec<LinkSpec>, &mut Taken),
    ) {
        let own = &self.bodies[body];
        // The joint's origin in the frame of the body, so far.
        let mut at = Vec3::zeros();
        let last = own.joints.len().wrapping_sub(1);
        for (k, joint) in own.joints.iter().enumerate() {
            let label = joint.name.clone().unwrap_or_else(|| match own.joints.len() {
                1 => name.clone(),
                _ => format!("{name}/joint{k}"),
            });
            let ends = k == last && joint.anchor == Vec3::zeros();
            let link = if ends { name.clone() } else { taken.unique(format!("{name}/{label}")) };
            let step = Pose::from_parts(Translation3::from(joint.anchor - at), one());
            let spec = self.joint_spec(joint, label);
            at = joint.anchor;
            let mass = if ends { self.masses[body] } else { LinkMass::none() };
            self.joints[body].push((tree, links.len()));
            links.push(link_spec(link, parent, placement * step * before(joint), spec, mass));
            (parent, placement) = (Some(links.len() - 1), Pose::identity());
        }
        if own.joints.last().is_none_or(|joint| joint.anchor != Vec3::zeros()) {
            let back = placement * Pose::from_parts(Translation3::from(-at), one());
            let joint = JointSpec::new(name.clone(), Joint::Fixed);
            links.push(link_spec(name, parent, back, joint, self.masses[body]));
        }
        let carrier = links.len() - 1;
        self.places[body] = Place::Link(tree, carrier);
        for geom in &own.geoms {
            if matches!(geom.form, Form::Plane | Form::Field(_)) {
                geom.element.problem("is on a body that moves", "expected planes and height fields on static bodies");
            }
            links[carrier].shapes.extend(on_link(geom, &self.groups, self.reader));
        }
        for (k, site) in own.sites.iter().enumerate().filter(|(_, site)| !self.is_joint_end(site)) {
            let label = site.name.clone().unwrap_or_else(|| format!("{}/site{k}", links[carrier].name));
            add_frame(links, taken, carrier, label, site.pose, Mounts::default());
        }
        for (label, pose, mounts) in super::views::mounts(own) {
            let label = label.unwrap_or_else(|| format!("{}/view", links[carrier].name));
            add_frame(links, taken, carrier, label, pose, mounts);
        }
    }

    fn joint_spec(&self, joint: &JointItem<'_>, name: String) -> JointSpec {
        let mut spec = JointSpec::new(name, joint.joint());
        spec.dof = joint.dof.clone();
        if joint.is_single() {
            spec.position = vec![joint.reference];
        }
        if joint.is_single() || joint.kind == Kind::Ball {
            spec.armature = joint.armature;
        }
        if let Some(most) = joint.ball_range {
            spec.cone = Some((2, most));
            spec.twist_limits = (most <= WIDEST_TWIST).then_some((2, [-most, most]));
        }
        let effort = joint.actuator_range.map(|[low, high]| high.max(-low)).filter(|most| *most > 0.0);
        spec.dof.effort = effort.filter(|_| joint.is_single()).unwrap_or(f64::INFINITY);
        spec
    }
}

/// Returns a body with a pose, a surface, and defaults.
pub(super) fn body_spec(name: String, mode: Mode, shape: ShapeSpec, pose: &Pose, surface: Surface) -> BodySpec {
    let q = pose.rotation.coords;
    BodySpec {
        name,
        mode,
        shape,
        shape_name: None,
        mass: None,
        position_m: pose.translation.vector.into(),
        orientation_xyzw: [q.x, q.y, q.z, q.w],
        velocity_m_per_s: [0.0; 3],
        angular_velocity_rad_per_s: [0.0; 3],
        material: surface.material,
        contact: surface.contact,
        contacts: surface.contacts,
        center_m: None,
        inertia_kg_m2: None,
        gravity_scale: 1.0,
        locked: LockedAxes::default(),
        linear_damping_per_s: 0.0,
        angular_damping_per_s: 0.0,
        collidable: true,
        group: surface.group,
        mask: surface.mask,
        sensor: false,
        one_way: None,
        enabled: true,
        visible: true,
        sound: None,
        appearance: surface.appearance,
        mounts: Mounts::default(),
    }
}

/// Half of the widest limits of a twist, rad.
const WIDEST_TWIST: f64 = 0.75 * std::f64::consts::PI;

/// Returns the motion of a joint from its reference position back to 0.
fn before(joint: &JointItem<'_>) -> Pose {
    let back = -joint.reference;
    match joint.kind {
        Kind::Hinge => {
            let turn = about(&nalgebra::Unit::new_unchecked(joint.axis), back);
            if back == 0.0 { Pose::identity() } else { Pose::from_parts(Translation3::identity(), turn) }
        }
        Kind::Slide => Pose::from_parts(Translation3::from(back * joint.axis), one()),
        _ => Pose::identity(),
    }
}

fn link_spec(name: String, parent: Option<usize>, placement: Pose, joint: JointSpec, mass: LinkMass) -> LinkSpec {
    let (shapes, mounts) = (Vec::new(), Mounts::default());
    LinkSpec { name, parent, placement, joint, mass: LinkMassSpec::Given(mass), shapes, mounts }
}

/// Adds a frame that is fixed to a link.
fn add_frame(links: &mut Vec<LinkSpec>, taken: &mut Taken, carrier: usize, label: String, pose: Pose, mounts: Mounts) {
    let name = taken.unique(label);
    let joint = JointSpec::new(name.clone(), Joint::Fixed);
    links.push(LinkSpec { mounts, ..link_spec(name, Some(carrier), pose, joint, LinkMass::none()) });
}

/// Returns a geom as a part of its body, with this shape.
pub(super) fn part(geom: &Geom<'_>, shape: ShapeSpec) -> CompoundPartSpec {
    CompoundPartSpec {
        shape,
        pose: geom.pose,
        density_kg_per_m3: None,
        surface: None,
        filter: PartFilter::default(),
        name: geom.name.clone(),
    }
}

/// Returns one shape of several in the same frame, and its name, unless it is a compound, whose parts have names.
pub(super) fn joined(mut parts: Vec<CompoundPartSpec>) -> (ShapeSpec, Option<String>) {
    if parts.len() == 1 && parts[0].pose == Pose::identity() {
        let CompoundPartSpec { shape, name, .. } = parts.remove(0);
        return (shape, name);
    }
    (ShapeSpec::Compound { parts }, None)
}
