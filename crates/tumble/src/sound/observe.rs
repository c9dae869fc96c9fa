//! Collects what sounds from a world, frame by frame.

use super::mix::Canvas;
use super::voices::Noise;
use super::{Listener, MAX_SECONDS, Mixed, RATE_HZ, Rub, SoundBody, SoundError, SoundMaterial, Strike};
use std::collections::BTreeMap;
use tumble_core::collide::{Shape, Vec3};
use tumble_core::{EventKind, ObjectId, RigidBody, World};
use tumble_scene::SceneFile;

/// Largest number of strikes and of rubs; later ones are not heard.
const MAX_VOICES: usize = 2_000_000;
/// Impulse below which a strike is not heard, N·s.
const QUIET: f64 = 1e-6;
/// Power of friction below which it is not heard, W.
const QUIET_RUB: f64 = 1e-4;

type Pair = (ObjectId, ObjectId);

/// A blow between two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// The bodies.
    pub bodies: [ObjectId; 2],
    /// The place where they meet, world frame, m.
    pub point: Vec3,
    /// Rise of the impulse between them from the step before, N·s, above 0.
    pub impulse: f64,
}

/// Finds impacts from step to step.
#[derive(Clone, Debug, Default)]
pub struct Impacts {
    /// Impulse of each pair in the step before, N·s.
    before: BTreeMap<Pair, f64>,
}

impl Impacts {
    /// Returns the impacts of the last step of a world; called after each step.
    pub fn after_step(&mut self, world: &World) -> Vec<Impact> {
        let (mut now, mut impacts) = (BTreeMap::new(), Vec::new());
        for event in world.events() {
            let (EventKind::ContactBegin | EventKind::ContactPersist, Some(b)) = (event.kind, event.b) else {
                continue;
            };
            let impulse = event.impulse.norm();
            *now.entry((event.a, b)).or_insert(0.0) += impulse;
            // what a lasting contact carries is not struck; a rise of it is
            let struck = impulse - self.before.get(&(event.a, b)).copied().unwrap_or(0.0);
            if struck > QUIET && struck > 0.2 * impulse {
                impacts.push(Impact { bodies: [event.a, b], point: event.point, impulse: struck });
            }
        }
        self.before = now;
        impacts
    }
}

/// A contact that slides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slide {
    /// The bodies.
    pub bodies: [ObjectId; 2],
    /// Its place, world frame, m.
    pub point: Vec3,
    /// Normal force, N.
    pub force: f64,
    /// Speed of sliding, m/s.
    pub speed: f64,
}

/// Returns the contacts of the last step that slide with at least 0.1 mW.
pub fn slides(world: &World) -> impl Iterator<Item = Slide> + '_ {
    let touching = world.contacts().iter().filter(|contact| contact.is_touching());
    let slide = |contact: &tumble_core::ContactPoint| {
        let slip = contact.velocity - contact.normal * contact.velocity.dot(&contact.normal);
        let (force, speed) = (contact.force.dot(&contact.normal).abs(), slip.norm());
        Slide { bodies: [contact.a, contact.b], point: contact.point, force, speed }
    };
    touching.map(slide).filter(|slide| slide.force * slide.speed > QUIET_RUB)
}

/// The sounds of a run.
#[derive(Default)]
pub struct Soundtrack {
    materials: BTreeMap<String, SoundMaterial>,
    impacts: Impacts,
    strikes: Vec<Strike>,
    rubs: Vec<(u64, Rub)>,
    /// Number of each pair that rubs: its noise.
    numbers: BTreeMap<Pair, u64>,
    begin: Option<f64>,
    left_out: u64,
}

impl Soundtrack {
    /// Begins a soundtrack. `materials` names the material of bodies; the others have that of their density.
    pub fn new(materials: BTreeMap<String, SoundMaterial>) -> Soundtrack {
        Soundtrack { materials, ..Soundtrack::default() }
    }

    /// Begins a soundtrack with the `sound` of the bodies, templates and materials of a scene.
    pub fn of_scene(scene: &SceneFile) -> Soundtrack {
        let mut materials = BTreeMap::new();
        let mut add = |name: String, material: Option<usize>, own: Option<&str>| {
            let of_material = material.and_then(|k| scene.materials[k].sound.as_deref());
            materials.extend(own.or(of_material).and_then(SoundMaterial::of_name).map(|sound| (name, sound)));
        };
        scene.bodies.iter().for_each(|body| add(body.name.clone(), body.material, body.sound.as_deref()));
        for template in &scene.templates {
            template.names().for_each(|name| add(name, template.body.material, template.body.sound.as_deref()));
        }
        Soundtrack::new(materials)
    }

    /// Sets the material of a body by its name.
    pub fn set_material(&mut self, body: impl Into<String>, material: SoundMaterial) {
        self.materials.insert(body.into(), material);
    }

    /// Makes a soundtrack of strikes alone.
    pub fn of_strikes(strikes: Vec<Strike>) -> Soundtrack {
        Soundtrack { strikes, ..Soundtrack::default() }
    }

    /// Returns the strikes so far.
    pub fn strikes(&self) -> &[Strike] {
        &self.strikes
    }

    /// Returns how many sounds were left out because there were too many.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Looks at a world after a frame.
    pub fn frame(&mut self, world: &World) {
        let dt = world.settings().dt;
        let begin = *self.begin.get_or_insert(world.time() - dt);
        let time = world.time() - dt - begin;
        for Impact { bodies, point, impulse } in self.impacts.after_step(world) {
            self.strike(world, bodies, time, point, impulse);
        }
        for Slide { bodies: [a, b], point, force, speed } in slides(world) {
            let rub = Rub { time, duration: dt, point: point.into(), force, speed };
            let next = self.numbers.len() as u64;
            let number = *self.numbers.entry((a, b)).or_insert(next);
            match self.rubs.len() < MAX_VOICES {
                true => self.rubs.push((number, rub)),
                false => self.left_out += 1,
            }
        }
    }

    fn strike(&mut self, world: &World, ids: [ObjectId; 2], time: f64, point: Vec3, impulse: f64) {
        let bodies = ids.map(|id| self.body(world, id));
        let contact = duration(&bodies, impulse);
        for body in bodies.into_iter().flatten() {
            match self.strikes.len() < MAX_VOICES {
                true => self.strikes.push(Strike { time, point: point.into(), impulse, body, contact }),
                false => self.left_out += 1,
            }
        }
    }

    /// Returns how a body sounds; `None` for one without an end, such as the ground, and for links.
    fn body(&self, world: &World, id: ObjectId) -> Option<SoundBody> {
        let body = world.get::<RigidBody>(id)?;
        let sides = sides(body.shape())?;
        let volume = body.shape().mass_properties(1.0).ok()?.mass;
        let named = self.materials.get(world.name(id)?).copied();
        let material = match named {
            Some(material) => material,
            None if body.is_fixed() => return None, // a fixed body has no mass of its own
            None => SoundMaterial::of_density(body.mass() / volume),
        };
        let mass = if body.is_fixed() { material.density * volume } else { body.mass() };
        let (length, thickness) = (sides.max(), sides.min());
        Some(SoundBody { material, length, thickness, mass })
    }

    /// Mixes everything for a listener. The sound ends a second after the last frame, at `end` s after the first.
    ///
    /// # Errors
    /// [`SoundError::Long`].
    pub fn mix(&self, listener: &Listener, end: f64) -> Result<Mixed, SoundError> {
        if end.is_nan() || end > MAX_SECONDS {
            return Err(SoundError::Long(end));
        }
        let mut canvas = Canvas::default();
        for strike in &self.strikes {
            canvas.add(listener, strike.time, strike.point, &strike.samples());
        }
        let mut noises: BTreeMap<u64, Noise> = BTreeMap::new();
        for (number, rub) in &self.rubs {
            let noise = noises.entry(*number).or_insert_with(|| Noise::new(*number));
            canvas.add(listener, rub.time, rub.point, &rub.samples(noise));
        }
        canvas.0.resize(((end + 1.0) * f64::from(RATE_HZ)).ceil().max(0.0) as usize, [0.0; 2]);
        Ok(Mixed { samples: canvas.0 })
    }
}

/// Returns the sides of the box of a shape, m; `None` for a half-space.
fn sides(shape: &Shape) -> Option<Vec3> {
    let bounds = shape.aabb(&Default::default());
    let sides = bounds.max - bounds.min;
    (sides.iter().all(|x| x.is_finite()) && sides.max() < 1e4 && sides.min() > 1e-6).then_some(sides)
}

/// Returns the duration of a contact by Hertz' law, s, of the lighter body with its approach speed `J/m`.
fn duration(bodies: &[Option<SoundBody>; 2], impulse: f64) -> f64 {
    let compliance = |body: &Option<SoundBody>| body.map_or(0.0, |body| 1.0 / body.material.young);
    let stiff = 1.0 / (compliance(&bodies[0]) + compliance(&bodies[1])).max(1e-12);
    let Some(light) = bodies.iter().flatten().min_by(|a, b| a.mass.total_cmp(&b.mass)) else { return 1e-3 };
    let (speed, radius) = ((impulse / light.mass).max(1e-3), 0.5 * light.thickness);
    let base = light.mass * light.mass / (radius * stiff * stiff * speed);
    (2.87 * libm::pow(base, 0.2)).clamp(20e-6, 20e-3)
}
