//! Collects what sounds from a world, frame by frame.

use super::mix::Renderer;
use super::parts::Chosen;
use super::{Listener, MAX_SECONDS, Mixed, RATE_HZ, Rub, SoundBody, SoundError, SoundMaterial, Strike};
use std::collections::BTreeMap;
use tumble_core::collide::Vec3;
use tumble_core::{EventKind, ObjectId, World};
use tumble_scene::SceneFile;

/// Largest number of strikes and of rubs; later ones are not heard.
const MAX_VOICES: usize = 2_000_000;
/// Impulse below which a strike is not heard, N·s.
const QUIET: f64 = 1e-6;
/// Power of friction below which it is not heard, W.
const QUIET_RUB: f64 = 1e-4;

/// Two parts that touch.
type Pair = ([ObjectId; 2], [usize; 2]);

/// A blow between two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// The bodies.
    pub bodies: [ObjectId; 2],
    /// Their parts that meet.
    pub parts: [usize; 2],
    /// The place where they meet, world frame, m.
    pub point: Vec3,
    /// Rise of the impulse between them from the step before, N·s, above 0.
    pub impulse: f64,
}

/// Finds impacts from step to step.
///
/// What touches when a world begins or when listening begins was not struck. A pair that sleeps keeps the impulse that
/// it had, so it does not sound when it wakes.
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
            let (bodies, parts, impulse) = ([event.a, b], [event.part_a, event.part_b], event.impulse.norm());
            now.insert((bodies, parts), impulse);
            let known = self.before.get(&(bodies, parts)).copied();
            let began = event.kind == EventKind::ContactBegin && world.frame() > 1;
            // what a lasting contact carries is not struck; a rise of it is
            let struck = impulse - known.unwrap_or(if began { 0.0 } else { impulse });
            if struck > QUIET && struck > 0.2 * impulse {
                impacts.push(Impact { bodies, parts, point: event.point, impulse: struck });
            }
        }
        self.before.retain(|(bodies, _), _| bodies.iter().any(|id| world.asleep(*id)));
        self.before.extend(now);
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
    chosen: Chosen,
    impacts: Impacts,
    heard: u64,
    strikes: Vec<Strike>,
    rubs: Vec<(u64, Rub)>,
    /// Number of each pair that rubs: its noise.
    numbers: BTreeMap<[ObjectId; 2], u64>,
    begin: Option<f64>,
    left_out: u64,
}

impl Soundtrack {
    /// Begins a soundtrack. `materials` names the material of objects; the others have that of their density.
    pub fn new(materials: BTreeMap<String, SoundMaterial>) -> Soundtrack {
        Soundtrack { chosen: Chosen { objects: materials, ..Chosen::default() }, ..Soundtrack::default() }
    }

    /// Begins a soundtrack with the `sound` of the bodies, templates and materials of a scene.
    pub fn of_scene(scene: &SceneFile) -> Soundtrack {
        Soundtrack { chosen: Chosen::of_scene(scene), ..Soundtrack::default() }
    }

    /// Sets the material of a body or of all links of an articulated body by its name.
    pub fn set_material(&mut self, body: impl Into<String>, material: SoundMaterial) {
        self.chosen.objects.insert(body.into(), material);
    }

    /// Makes a soundtrack of strikes alone.
    pub fn of_strikes(strikes: Vec<Strike>) -> Soundtrack {
        Soundtrack { strikes, ..Soundtrack::default() }
    }

    /// Returns the strikes so far.
    pub fn strikes(&self) -> &[Strike] {
        &self.strikes
    }

    /// Returns the number of impacts that are heard: of each, one or both bodies are among the strikes.
    pub fn impacts(&self) -> u64 {
        self.heard
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
        for impact in self.impacts.after_step(world) {
            self.strike(world, time, &impact);
        }
        for Slide { bodies: [a, b], point, force, speed } in slides(world) {
            let rub = Rub { time, duration: dt, point: point.into(), force, speed };
            let next = self.numbers.len() as u64;
            let number = *self.numbers.entry([a, b]).or_insert(next);
            match self.rubs.len() < MAX_VOICES {
                true => self.rubs.push((number, rub)),
                false => self.left_out += 1,
            }
        }
    }

    fn strike(&mut self, world: &World, time: f64, &Impact { bodies, parts, point, impulse }: &Impact) {
        let bodies = [0, 1].map(|side| self.chosen.body(world, bodies[side], parts[side]));
        let contact = duration(&bodies, impulse);
        self.heard += u64::from(bodies.iter().any(Option::is_some));
        for body in bodies.into_iter().flatten() {
            match self.strikes.len() < MAX_VOICES {
                true => self.strikes.push(Strike { time, point: point.into(), impulse, body, contact }),
                false => self.left_out += 1,
            }
        }
    }

    /// Mixes everything for a listener that stays. The sound ends a second after the last frame, at `end` s after the
    /// first.
    ///
    /// # Errors
    /// [`SoundError::Long`].
    pub fn mix(&self, listener: &Listener, end: f64) -> Result<Mixed, SoundError> {
        self.mix_moving(&[(0.0, *listener)], end)
    }

    /// Mixes everything for a listener that moves. `ears` has the listener from a time on, s after the first frame's
    /// start, in ascending order; the first is also heard before its time. Each sound is heard from where the listener
    /// is when it begins.
    ///
    /// # Errors
    /// [`SoundError::Long`]; [`SoundError::NoEars`] without a listener.
    pub fn mix_moving(&self, ears: &[(f64, Listener)], end: f64) -> Result<Mixed, SoundError> {
        if end.is_nan() || end > MAX_SECONDS {
            return Err(SoundError::Long(end));
        }
        let first = ears.first().ok_or(SoundError::NoEars)?;
        let at = |time: f64| match ears.partition_point(|(from, _)| *from <= time + 1e-9) {
            0 => first.1,
            n => ears[n - 1].1,
        };
        let mut renderer = Renderer::default();
        renderer.add(&self.strikes, &self.rubs, at);
        let mut samples = renderer.canvas.samples;
        samples.resize(((end + 1.0) * f64::from(RATE_HZ)).ceil().max(0.0) as usize, [0.0; 2]);
        Ok(Mixed { samples })
    }

    /// Takes what was collected, with the time of the world, s, as seconds after the start of the first frame.
    pub(super) fn take(&mut self, time: f64) -> (Vec<Strike>, Vec<(u64, Rub)>, f64) {
        let seconds = self.begin.map_or(0.0, |begin| time - begin);
        (std::mem::take(&mut self.strikes), std::mem::take(&mut self.rubs), seconds)
    }
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
