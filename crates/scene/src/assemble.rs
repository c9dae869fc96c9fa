//! From links to what the dynamics knows: a model, and a body with colliders, pictures and motors.

use tumble_core::articulated::{
    ArticulatedBody, ArticulatedError, Collider, Coupling, DofSettings, Kinematics, LinkMass, Model, ModelBuilder,
    ModelError,
};
use tumble_core::collide::{Pose, Shape, contacts};
use tumble_core::{Appearance, CameraMount, Joint, Material, Object, Visual};

use crate::articulated::ArticulatedSpec;
use crate::build::{look, material_id};
use crate::link::LinkSpec;
use crate::link_shapes::{Placed, Purpose, ShapeMaker, mass};

/// Pairs of links told by name.
const TOLD_PAIRS: usize = 8;

/// The tree of links, with a mass for each.
pub(crate) fn model(links: &[LinkSpec], masses: &[LinkMass]) -> Result<Model, ModelError> {
    let mut builder = ModelBuilder::new();
    for (link, mass) in links.iter().zip(masses) {
        builder.link(&link.name, link.parent, link.joint.kind, link.placement, *mass);
    }
    builder.build()
}

/// Names of the joints that move, in the order of the model's links and so of its coordinates.
pub(crate) fn moving_joints(links: &[LinkSpec]) -> Vec<String> {
    links.iter().filter(|link| moves(link)).map(|link| link.joint.name.clone()).collect()
}

/// What acts on each degree of freedom, in the order of the velocities.
pub(crate) fn freedoms(links: &[LinkSpec]) -> Vec<DofSettings> {
    let of = |link: &LinkSpec| vec![link.joint.freedom.clone(); link.joint.kind.dof()];
    links.iter().filter(|link| moves(link)).flat_map(of).collect()
}

fn moves(link: &LinkSpec) -> bool {
    link.joint.kind != Joint::Fixed
}

/// The body of a description; what is wrong names the link.
pub(crate) fn body(spec: &ArticulatedSpec, maker: &mut ShapeMaker<'_>) -> Result<ArticulatedBody, String> {
    let told = |link: &LinkSpec, why: String| format!("link \"{}\": {why}", link.name);
    let mut shapes = Vec::with_capacity(spec.links.len());
    let mut masses = Vec::with_capacity(spec.links.len());
    for link in &spec.links {
        let placed = maker.shapes(link).map_err(|why| told(link, why))?;
        masses.push(mass(link, &placed).map_err(|why| told(link, why.to_string()))?);
        shapes.push(placed);
    }
    let model = model(&spec.links, &masses).map_err(|e| e.to_string())?;
    furnished(spec, model, &shapes, maker).map_err(|e| e.to_string())
}

/// The body with all that is on its links and joints.
fn furnished(
    spec: &ArticulatedSpec,
    model: Model,
    shapes: &[Vec<Placed<'_>>],
    maker: &mut ShapeMaker<'_>,
) -> Result<ArticulatedBody, ArticulatedError> {
    let moving: Vec<&LinkSpec> = spec.links.iter().filter(|link| moves(link)).collect();
    let positions: Vec<f64> = moving.iter().flat_map(|link| position(link, &spec.base)).collect();
    let velocities: Vec<f64> = moving.iter().flat_map(|link| link.joint.velocity.clone()).collect();
    let mut body = ArticulatedBody::new(&spec.name, model)
        .at(spec.base)
        .with_positions(&positions)?
        .with_velocities(&velocities)?;
    body.self_collision = spec.self_collision;
    for (link, placed) in spec.links.iter().zip(shapes) {
        for placed in placed {
            furnish(&mut body, &link.name, placed)?;
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
        for index in first..first + link.joint.kind.dof() {
            body.set_dof(index, link.joint.freedom.clone())?;
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
    if spec.part_overlaps && spec.self_collision && maker.purpose == Purpose::Stepped {
        let poses = link_poses(spec, body.model(), &positions);
        part_overlaps(spec, shapes, &poses, &mut body, maker)?;
    }
    Ok(body)
}

/// Position numbers of a joint at time 0; a floating root starts where it is placed.
fn position(link: &LinkSpec, base: &Pose) -> Vec<f64> {
    match link.joint.kind {
        Joint::Floating => {
            let pose = base * link.placement;
            pose.translation.vector.iter().chain(pose.rotation.coords.iter()).copied().collect()
        }
        _ => link.joint.position.clone(),
    }
}

fn furnish(body: &mut ArticulatedBody, link: &str, placed: &Placed<'_>) -> Result<(), ArticulatedError> {
    let surface = &placed.spec.surface;
    if let Some(shape) = placed.solid().filter(|_| placed.spec.collides) {
        let id = material_id(surface.material);
        let material = Material { restitution: surface.restitution, friction: surface.friction, id };
        body.add_collider(
            link,
            Collider { material, contact_mode: surface.contacts, ..Collider::new(shape.clone(), placed.spec.pose) },
        )?;
    }
    if placed.visible {
        let look: Appearance = look(&surface.look, &placed.center());
        let (geometry, stands_in_for) = (placed.geometry.clone(), placed.stands_in_for.clone());
        body.add_visual(link, Visual { part: 0, pose: placed.pose, geometry, appearance: look, stands_in_for })?;
    }
    Ok(())
}

/// Links that are joined through links without mass and shape, the stacks that joints of several freedoms are made of, are neighbours.
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

/// Keeps apart all links that overlap at the start: files of robots do not say which links may meet, and their shapes reach into each other.
fn part_overlaps(
    spec: &ArticulatedSpec,
    shapes: &[Vec<Placed<'_>>],
    poses: &[Pose],
    body: &mut ArticulatedBody,
    maker: &mut ShapeMaker<'_>,
) -> Result<(), ArticulatedError> {
    let solid: Vec<Solid<'_>> = shapes
        .iter()
        .enumerate()
        .flat_map(|(link, placed)| placed.iter().filter(|p| p.spec.collides).map(move |p| (link, p)))
        .filter_map(|(link, p)| Some(Solid { link, shape: p.solid()?, pose: poses[link] * p.pose }))
        .collect();
    // parts are the links, the base, then the colliders in this order
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
                true => maker.notes.add(pair, "overlap at the start and meet all the same"),
                false => pairs.push(pair),
            }
        }
    }
    if !pairs.is_empty() {
        let more = pairs.len().saturating_sub(TOLD_PAIRS);
        let rest = if more > 0 { format!(" and {more} more pairs") } else { String::new() };
        maker.notes.add("links that overlap at the start never meet", pairs[..pairs.len() - more].join(", ") + &rest);
    }
    Ok(())
}

/// A shape of a link in the world.
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

/// Poses of all links in the world at time 0, without shapes.
pub(crate) fn link_poses_at_start(spec: &ArticulatedSpec) -> Result<Vec<Pose>, ModelError> {
    let masses: Vec<LinkMass> = spec.links.iter().map(LinkSpec::given_mass).collect();
    let positions: Vec<f64> =
        spec.links.iter().filter(|link| moves(link)).flat_map(|link| position(link, &spec.base)).collect();
    Ok(link_poses(spec, &model(&spec.links, &masses)?, &positions))
}

/// Poses of all links in the world.
fn link_poses(spec: &ArticulatedSpec, model: &Model, q: &[f64]) -> Vec<Pose> {
    let mut kinematics = Kinematics::new(model);
    kinematics.refresh(model, q, &vec![0.0; model.dof()]);
    let carrier = |link: Option<usize>| link.map_or(spec.base, |l| kinematics.links()[l].pose);
    spec.links
        .iter()
        .map(|link| model.frame(&link.name).map_or(Pose::identity(), |f| carrier(f.link) * f.pose))
        .collect()
}
