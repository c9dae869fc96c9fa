//! Builds an articulated body from its description: the model, colliders, visuals and drives.

use tumble_core::articulated::{
    ArticulatedBody, ArticulatedError, Collider, Coupling, DofSettings, Kinematics, LinkMass, Model, ModelBuilder,
    ModelError,
};
use tumble_core::collide::{Pose, Shape, Vec3, contacts};
use tumble_core::{Appearance, CameraMount, Joint, Material, Object, ShapeFilter, Visual};

use crate::build::appearance::{appearance, material_id};
use crate::build::shapes::{Placed, Purpose, ShapeMaker, mass, own_filters, own_materials};
use crate::parse::articulated::ArticulatedSpec;
use crate::parse::link::{Geometry, LinkSpec};

/// Pairs of links that a note lists by name.
const MAX_LISTED_PAIRS: usize = 8;

/// Returns the tree of links with a mass for each.
pub(crate) fn model(links: &[LinkSpec], masses: &[LinkMass]) -> Result<Model, ModelError> {
    let mut builder = ModelBuilder::new();
    for (link, mass) in links.iter().zip(masses) {
        let number = builder.link(&link.name, link.parent, link.joint.kind, link.placement, *mass);
        builder.set_armature(number, link.joint.armature);
    }
    builder.build()
}

/// Returns the names of all joints that are not fixed, in the order of the model's links and of its
/// coordinates.
pub(crate) fn moving_joints(links: &[LinkSpec]) -> Vec<String> {
    links.iter().filter(|link| moves(link)).map(|link| link.joint.name.clone()).collect()
}

/// Returns the settings of each degree of freedom, in the order of the velocities.
pub(crate) fn dofs(links: &[LinkSpec]) -> Vec<DofSettings> {
    links.iter().filter(|link| moves(link)).flat_map(|link| link.joint.dofs()).collect()
}

fn moves(link: &LinkSpec) -> bool {
    link.joint.kind != Joint::Fixed
}

/// Builds the body of a description. Errors name the link.
pub(crate) fn body(spec: &ArticulatedSpec, maker: &mut ShapeMaker<'_>) -> Result<ArticulatedBody, String> {
    let in_link = |link: &LinkSpec, why: String| format!("link \"{}\": {why}", link.name);
    let mut shapes = Vec::with_capacity(spec.links.len());
    let mut masses = Vec::with_capacity(spec.links.len());
    for link in &spec.links {
        let placed = maker.shapes(link).map_err(|why| in_link(link, why))?;
        masses.push(mass(link, &placed).map_err(|why| in_link(link, why.to_string()))?);
        shapes.push(placed);
    }
    let model = model(&spec.links, &masses).map_err(|e| e.to_string())?;
    assembled(spec, model, &shapes, maker).map_err(|e| e.to_string())
}

/// Builds the body from its model: positions, velocities, colliders, visuals, cameras, lights,
/// joint settings, couplings and disabled collisions.
fn assembled(
    spec: &ArticulatedSpec,
    model: Model,
    shapes: &[Vec<Placed<'_>>],
    maker: &mut ShapeMaker<'_>,
) -> Result<ArticulatedBody, ArticulatedError> {
    let moving: Vec<&LinkSpec> = spec.links.iter().filter(|link| moves(link)).collect();
    let positions: Vec<f64> = moving.iter().flat_map(|link| position(link, &spec.base)).collect();
    let velocities: Vec<f64> = moving.iter().flat_map(|link| link.joint.velocity.clone()).collect();
    let mut body = ArticulatedBody::new(&spec.name, model)
        .with_pose(spec.base)
        .with_positions(&positions)?
        .with_velocities(&velocities)?;
    body.self_collision = spec.self_collision;
    for (link, placed) in spec.links.iter().zip(shapes) {
        for placed in placed {
            attach(&mut body, &link.name, placed)?;
        }
        if let Some(camera) = &link.mounts.camera {
            body.add_camera(&link.name, CameraMount { name: link.name.clone(), ..camera.clone() })?;
        }
        if let Some(light) = &link.mounts.light {
            body.add_light(&link.name, light.clone())?;
        }
    }
    for (number, link) in moving.iter().enumerate() {
        let first = body.model().links()[number].v;
        for (k, dof) in link.joint.dofs().into_iter().enumerate() {
            body.set_dof(first + k, dof)?;
        }
        if let Some(mimic) = link.joint.mimic
            && let Some(of) = body.dof_of(&spec.links[mimic.link].name)
        {
            body.couple(Coupling { dof: first, of, multiplier: mimic.multiplier, offset: mimic.offset })?;
        }
    }
    for [a, b] in &spec.exclude_collisions {
        body.exclude_collisions(&spec.links[*a].name, &spec.links[*b].name)?;
    }
    keep_apart_across_stacks(spec, &mut body)?;
    if spec.exclude_overlapping && spec.self_collision && maker.purpose == Purpose::Stepped {
        let poses = link_poses(spec, body.model(), &positions);
        exclude_overlapping(spec, shapes, &poses, &mut body, maker)?;
    }
    Ok(body)
}

/// Returns the position numbers of a joint at time 0. A floating root starts at its placement in
/// the base.
fn position(link: &LinkSpec, base: &Pose) -> Vec<f64> {
    match link.joint.kind {
        Joint::Floating => {
            let pose = base * link.placement;
            pose.translation.vector.iter().chain(pose.rotation.coords.iter()).copied().collect()
        }
        _ => link.joint.position.clone(),
    }
}

fn attach(body: &mut ArticulatedBody, link: &str, placed: &Placed<'_>) -> Result<(), ArticulatedError> {
    let surface = &placed.spec.surface;
    if let Some(shape) = placed.solid().filter(|_| placed.spec.collidable) {
        let material = Material { id: material_id(surface.material), ..surface.contact };
        let mut collider = Collider {
            contact_mode: surface.contacts,
            group: surface.group,
            mask: surface.mask,
            name: placed.spec.name.clone(),
            one_way: placed.spec.one_way.map(Vec3::from),
            sensor: placed.spec.sensor,
            ..Collider::new(shape.clone(), placed.spec.pose).with_material(material)
        };
        if let Geometry::Shape(spec) = &placed.spec.geometry {
            collider = own_materials(spec).fold(collider, |made, (n, own)| made.with_shape_material(n, own));
            let whole = ShapeFilter { group: collider.group, mask: collider.mask, sensor: collider.sensor };
            collider = own_filters(spec, whole).fold(collider, |made, (n, own)| made.with_shape_filter(n, own));
        }
        body.add_collider(link, collider)?;
    }
    if placed.visible {
        let appearance: Appearance = appearance(&surface.appearance, &placed.center());
        let (geometry, stands_in_for) = (placed.geometry.clone(), placed.stands_in_for.clone());
        body.add_visual(link, Visual { part: 0, pose: placed.pose, geometry, appearance, stands_in_for })?;
    }
    Ok(())
}

/// Disables collisions of links that are connected through links without mass and shape. Such links
/// are intermediate frames of joints with several degrees of freedom.
fn keep_apart_across_stacks(spec: &ArticulatedSpec, body: &mut ArticulatedBody) -> Result<(), ArticulatedError> {
    let empty = |link: &LinkSpec| link.shapes.is_empty() && !link.has_mass();
    for link in &spec.links {
        let mut above = link.parent;
        while let Some(between) = above.map(|k| &spec.links[k]).filter(|between| empty(between)) {
            above = between.parent;
        }
        if let Some(above) = above.filter(|_| above != link.parent) {
            body.exclude_collisions(&link.name, &spec.links[above].name)?;
        }
    }
    Ok(())
}

/// Disables collisions of all links that overlap at time 0. Robot files do not say which links may
/// collide, and the shapes of neighboring links often intersect.
fn exclude_overlapping(
    spec: &ArticulatedSpec,
    shapes: &[Vec<Placed<'_>>],
    poses: &[Pose],
    body: &mut ArticulatedBody,
    maker: &mut ShapeMaker<'_>,
) -> Result<(), ArticulatedError> {
    let solid: Vec<Solid<'_>> = shapes
        .iter()
        .enumerate()
        .flat_map(|(link, placed)| placed.iter().filter(|p| p.spec.collidable).map(move |p| (link, p)))
        .filter_map(|(link, p)| Some(Solid { link, shape: p.solid()?, pose: poses[link] * p.pose }))
        .collect();
    // Parts are the links, the base, then the colliders in this order.
    let first = body.model().links().len() + 1;
    let name = |link: usize| spec.links[link].name.as_str();
    let mut pairs = Vec::new();
    for (n, a) in solid.iter().enumerate() {
        for (m, b) in solid.iter().enumerate().skip(n + 1) {
            let meet =
                |body: &ArticulatedBody| body.collidable().is_some_and(|c| c.parts_collide(first + n, first + m));
            if !meet(body) || !a.overlaps(b) {
                continue;
            }
            let pair = format!("{} and {}", name(a.link), name(b.link));
            body.exclude_collisions(name(a.link), name(b.link))?;
            match meet(body) {
                true => maker.notes.add(pair, "overlap at the start and still collide"),
                false => pairs.push(pair),
            }
        }
    }
    if !pairs.is_empty() {
        let more = pairs.len().saturating_sub(MAX_LISTED_PAIRS);
        let rest = if more > 0 { format!(" and {more} more pairs") } else { String::new() };
        maker
            .notes
            .add("links that overlap at the start do not collide", pairs[..pairs.len() - more].join(", ") + &rest);
    }
    Ok(())
}

/// A collision shape of a link with its pose in the world.
struct Solid<'s> {
    link: usize,
    shape: &'s Shape,
    pose: Pose,
}

impl Solid<'_> {
    fn overlaps(&self, other: &Solid<'_>) -> bool {
        let near = self.shape.aabb(&self.pose).overlaps(&other.shape.aabb(&other.pose));
        let mut found = Vec::new();
        if near {
            contacts(self.shape, &self.pose, other.shape, &other.pose, 0.0, &mut found);
        }
        !found.is_empty()
    }
}

/// Returns the poses of all links in the world at time 0, computed without shapes.
pub(crate) fn link_poses_at_start(spec: &ArticulatedSpec) -> Result<Vec<Pose>, ModelError> {
    let masses: Vec<LinkMass> = spec.links.iter().map(LinkSpec::given_mass).collect();
    let positions: Vec<f64> =
        spec.links.iter().filter(|link| moves(link)).flat_map(|link| position(link, &spec.base)).collect();
    Ok(link_poses(spec, &model(&spec.links, &masses)?, &positions))
}

/// Returns the poses of all links in the world.
fn link_poses(spec: &ArticulatedSpec, model: &Model, q: &[f64]) -> Vec<Pose> {
    let mut kinematics = Kinematics::new(model);
    kinematics.refresh(model, q, &vec![0.0; model.dof()]);
    let carrier = |link: Option<usize>| link.map_or(spec.base, |l| kinematics.links()[l].pose);
    spec.links
        .iter()
        .map(|link| model.frame(&link.name).map_or(Pose::identity(), |f| carrier(f.link) * f.pose))
        .collect()
}
