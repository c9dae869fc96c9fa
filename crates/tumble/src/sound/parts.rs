//! Which body sounds: shape, mass and material of the part of an object that was struck.
//!
//! A rigid body has one part. A link of an articulated body vibrates as the shape that was struck, with the mass of the
//! link; its density is that mass by the volume of all shapes of the link. Any other object sounds if its part has a
//! shape and a mass.

use super::{SoundBody, SoundMaterial};
use std::collections::BTreeMap;
use tumble_core::collide::{Shape, Vec3};
use tumble_core::{ArticulatedBody, Object, ObjectId, RigidBody, World};
use tumble_scene::SceneFile;

/// Materials that are chosen; parts without one have that of their density.
#[derive(Clone, Debug, Default)]
pub(super) struct Chosen {
    /// By the name of an object.
    pub objects: BTreeMap<String, SoundMaterial>,
    /// By the id of a surface, [`tumble_core::Material::id`].
    pub surfaces: BTreeMap<u32, SoundMaterial>,
}

impl Chosen {
    /// Returns those of the bodies, templates and materials of a scene.
    pub fn of_scene(scene: &SceneFile) -> Chosen {
        let mut chosen = Chosen::default();
        let of_name = |name: Option<&String>| SoundMaterial::of_name(name?);
        let ids = 1..; // 0 is no material
        let surfaces = ids.zip(&scene.materials).filter_map(|(id, spec)| Some((id, of_name(spec.sound.as_ref())?)));
        chosen.surfaces.extend(surfaces);
        for body in &scene.bodies {
            chosen.objects.extend(of_name(body.sound.as_ref()).map(|sound| (body.name.clone(), sound)));
        }
        for template in &scene.templates {
            let sound = of_name(template.body.sound.as_ref());
            chosen.objects.extend(template.names().filter_map(|name| Some((name, sound?))));
        }
        chosen
    }

    /// Returns how a part sounds; `None` for one without a shape or an end, such as the ground, for a fixed one without
    /// a chosen material, and for a deforming surface.
    pub fn body(&self, world: &World, id: ObjectId, part: usize) -> Option<SoundBody> {
        let object = world.object(id)?;
        if object.renderable().is_some_and(|drawn| drawn.surface().is_some()) {
            return None;
        }
        let collidable = object.collidable()?;
        let shape = collidable.shape(part)?;
        let (sides, own_volume) = (sides(shape)?, volume(shape)?);
        let surface = || self.surfaces.get(&collidable.material(part).id);
        let chosen = self.objects.get(world.name(id)?).or_else(surface).copied();
        let moved = moved(object, part);
        let material = match (chosen, moved) {
            (Some(material), _) => material,
            (None, Some((mass, volume))) => SoundMaterial::of_density(mass / volume),
            (None, None) => return None, // what is fixed has no mass of its own
        };
        let mass = moved.map_or(material.density * own_volume, |(mass, _)| mass);
        let (length, thickness) = (sides.max(), sides.min());
        Some(SoundBody { material, length, thickness, mass })
    }
}

/// Returns mass, kg, and volume, m³, of what moves with a part; `None` for what is fixed or has no mass.
fn moved(object: &dyn Object, part: usize) -> Option<(f64, f64)> {
    let any: &dyn std::any::Any = object;
    let (mass, volume) = if let Some(body) = any.downcast_ref::<RigidBody>() {
        (if body.is_fixed() { 0.0 } else { body.mass() }, volume(body.shape())?)
    } else if let Some(body) = any.downcast_ref::<ArticulatedBody>() {
        let link = body.link_of(part)?;
        let parts = body.colliders_of(Some(link));
        let shapes = parts.filter_map(|part| object.collidable()?.shape(part));
        (object.integratable()?.part_mass(link), shapes.filter_map(volume).sum())
    } else {
        (object.integratable()?.part_mass(part), volume(object.collidable()?.shape(part)?)?)
    };
    (mass > 0.0 && volume > 0.0).then_some((mass, volume))
}

/// Returns the volume of a shape, m³; `None` for a half-space.
fn volume(shape: &Shape) -> Option<f64> {
    shape.mass_properties(1.0).ok().map(|unit| unit.mass)
}

/// Returns the sides of the box of a shape, m; `None` for a half-space.
fn sides(shape: &Shape) -> Option<Vec3> {
    let bounds = shape.aabb(&Default::default());
    let sides = bounds.max - bounds.min;
    (sides.iter().all(|x| x.is_finite()) && sides.max() < 1e4 && sides.min() > 1e-6).then_some(sides)
}
