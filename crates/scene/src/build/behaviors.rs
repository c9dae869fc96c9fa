//! Adds the behaviors of a scene to its world: soft bodies, particles, flocks and fields.

use tumble_behaviors::{
    Attractor, BehaviorError, BodyFlock, Boid, Buoyancy, DragLaw, Emitter, Explosion, Flock, Panel, Panels,
    ParticleLook, ParticleSystem, SpringMesh, Targets, Wind,
};
use tumble_core::collide::{Shape, Vec3};
use tumble_core::{Material, ObjectId, World};

use crate::build::appearance::{appearance, material_id};
use crate::build::error::BuildError;
use crate::parse::behavior::field::{FieldKind, FieldSpec, PanelSpec};
use crate::parse::behavior::flock::{BodyFlockSpec, BoidGroupSpec, FlockSpec};
use crate::parse::behavior::particles::{EmitterSpec, ParticleSystemSpec};
use crate::parse::behavior::soft::{Grid, SoftSpec};
use crate::parse::file::SceneFile;

impl SceneFile {
    /// Adds all behaviors to a world that has the bodies of the scene.
    pub(crate) fn add_behaviors(&self, world: &mut World) -> Result<(), BuildError> {
        let specs = &self.behaviors;
        let wrong = |name: &str, why: BehaviorError| BuildError::Behavior {
            scene: self.file.clone(),
            name: name.to_owned(),
            why: why.to_string(),
        };
        for spec in &specs.soft {
            add_soft(spec, world).map_err(|why| wrong(&spec.name, why))?;
        }
        for spec in &specs.particle_systems {
            self.add_particles(spec, world).map_err(|why| wrong(&spec.name, why))?;
        }
        for spec in &specs.flocks {
            add_flock(spec, world).map_err(|why| wrong(&spec.name, why))?;
        }
        for spec in &specs.body_flocks {
            add_body_flock(spec, world).map_err(|why| wrong(&spec.name, why))?;
        }
        for spec in &specs.fields {
            self.add_field(spec, world).map_err(|why| wrong(&spec.name, why))?;
        }
        Ok(())
    }

    fn add_particles(&self, spec: &ParticleSystemSpec, world: &mut World) -> Result<(), BehaviorError> {
        let look = ParticleLook {
            appearance: appearance(&spec.appearance, &Vec3::zeros()),
            radius: spec.drawn_radius_m,
            fade: spec.fade_s,
            opacity: spec.opacity,
            scale: spec.scale,
            end_color: spec.end_color.map(|color| color.map(|c| c as f32)),
        };
        let mut system = ParticleSystem::new(spec.name.as_str(), spec.settings.clone())?.with_look(look)?;
        for EmitterSpec { emitter, mount } in &spec.emitters {
            let mount = mount.as_ref().and_then(|part| self.part(world, part));
            system = system.with_emitter(Emitter { mount, ..emitter.clone() })?;
        }
        let id = world.add(system)?;
        Ok(world.set_enabled(id, spec.enabled)?)
    }

    fn add_field(&self, spec: &FieldSpec, world: &mut World) -> Result<(), BehaviorError> {
        let name = spec.name.as_str();
        let targets = match &spec.targets {
            Some(names) => Targets::Only(names.iter().filter_map(|name| world.find(name)).collect()),
            None => Targets::All,
        };
        let id = match &spec.kind {
            FieldKind::Wind { velocity_m_per_s, drag_n_s_per_m, density_kg_per_m3, drag_coefficient } => {
                let law = match *drag_n_s_per_m {
                    Some(coefficient) => DragLaw::Linear { coefficient },
                    None => DragLaw::Quadratic { density: *density_kg_per_m3, coefficient: *drag_coefficient },
                };
                world.add(Wind::new(name, Vec3::from(*velocity_m_per_s), law)?.with_targets(targets))?
            }
            FieldKind::Attractor { position_m, strength_m3_per_s2, softening_m } => {
                let center = Vec3::from(*position_m);
                world.add(Attractor::new(name, center, *strength_m3_per_s2, *softening_m)?.with_targets(targets))?
            }
            FieldKind::Explosion { position_m, impulse_n_s, start_s, decay_s } => {
                let center = Vec3::from(*position_m);
                world.add(Explosion::new(name, center, *impulse_n_s, *start_s, *decay_s)?.with_targets(targets))?
            }
            FieldKind::Buoyancy { position_m, density_kg_per_m3, drag_per_s, current_m_per_s } => {
                let fluid = Buoyancy::new(name, Vec3::from(*position_m), *density_kg_per_m3)?;
                let fluid = fluid.with_drag(*drag_per_s, Vec3::from(*current_m_per_s))?;
                world.add(fluid.with_targets(targets))?
            }
            FieldKind::Panels { density_kg_per_m3, wind_m_per_s, panels } => {
                let panels: Vec<Panel> = panels.iter().filter_map(|panel| self.panel(panel, world)).collect();
                world.add(Panels::new(name, *density_kg_per_m3, Vec3::from(*wind_m_per_s), panels)?)?
            }
        };
        Ok(world.set_enabled(id, spec.enabled)?)
    }

    fn panel(&self, spec: &PanelSpec, world: &World) -> Option<Panel> {
        let (id, part) = self.part(world, &spec.body)?;
        let (point, normal) = (Vec3::from(spec.point_m), Vec3::from(spec.normal));
        Some(Panel { id, part, point, normal, area: spec.area_m2, lift_slope: spec.lift_slope, drag: spec.drag })
    }
}

fn add_soft(spec: &SoftSpec, world: &mut World) -> Result<(), BehaviorError> {
    let mesh = match &spec.grid {
        Grid::Cloth(cloth) => cloth.mesh()?,
        Grid::Jelly(jelly) => jelly.mesh()?,
    };
    let mut mesh = mesh
        .with_name(spec.name.as_str())
        .with_pose(spec.pose)
        .with_velocity(Vec3::from(spec.velocity_m_per_s))
        .with_pinned_nodes(&spec.pins)?
        .with_implicitness(spec.implicitness)?
        .with_material(Material { id: material_id(spec.material), ..spec.contact })
        .with_appearance(appearance(&spec.appearance, &Vec3::zeros()));
    if let Some(radius) = spec.node_radius_m {
        mesh = mesh.with_radius(radius)?;
    }
    let id = SpringMesh::add(world, mesh)?;
    set_status(world, id, spec.enabled, spec.collidable)
}

fn set_status(world: &mut World, id: ObjectId, enabled: bool, collidable: bool) -> Result<(), BehaviorError> {
    world.set_collidable(id, collidable)?;
    Ok(world.set_enabled(id, enabled)?)
}

fn add_flock(spec: &FlockSpec, world: &mut World) -> Result<(), BehaviorError> {
    let flock = world.add(Flock::new(spec.name.as_str(), spec.steering)?)?;
    for group in &spec.groups {
        let visuals = Boid::dart(4.0 * group.radius_m, appearance(&group.appearance, &Vec3::zeros()));
        for k in 0..group.count {
            let boid = boid(group)?.with_name(group.name_of(k)).with_position(group.start(k));
            let id = Flock::add(world, flock, boid.with_visuals(visuals.clone()))?;
            set_status(world, id, group.enabled, group.collidable)?;
        }
    }
    Ok(world.set_enabled(flock, spec.enabled)?)
}

fn add_body_flock(spec: &BodyFlockSpec, world: &mut World) -> Result<(), BehaviorError> {
    let mut flock = BodyFlock::new(spec.name.as_str(), spec.steering, spec.helm)?;
    spec.bodies.iter().filter_map(|name| world.find(name)).for_each(|id| flock.push(id));
    let id = world.add(flock)?;
    Ok(world.set_enabled(id, spec.enabled)?)
}

fn boid(group: &BoidGroupSpec) -> Result<Boid, BehaviorError> {
    let boid = Boid::new(Shape::Sphere { radius: group.radius_m }, group.mass_kg)?;
    boid.with_velocity(Vec3::from(group.velocity_m_per_s)).with_bank(group.bank_time_s, group.roll_time_s)
}
