//! Particles in pictures and in messages to other processes.
//!
//! A message has what a picture needs, in single precision:
//!
//! | bytes | content |
//! |---|---|
//! | 4 | number of particles, `u32` |
//! | 20 of each | position, m, time that is left and lifetime, s: five `f32` |
//!
//! All numbers are little-endian. A message has at most [`MOST_SENT`] particles, 640 KiB. Of `n` more, those are
//! sent whose serial number is a multiple of `⌈n/MOST_SENT⌉`, so a particle stays sent as long as that number stays.

use super::{HEADER, ParticleSystem, RECORD, write};
use crate::error::{BehaviorError, check};
use tumble_collide::Vec3;
use tumble_core::{Appearance, Cloud, CloudSphere, NetSync, Renderable, StateRange, SyncError, Visual, WorldView};

/// Most particles of a message.
pub(super) const MOST_SENT: usize = 32_768;
/// Bytes of a particle in a message.
const SENT: usize = 20;

/// How particles are drawn: as small spheres, solid or transparent. What changes over the life of a particle has a
/// value at its birth and one at its end, and is linear between them.
///
/// ```
/// # use tumble_behaviors::{ParticleSettings, ParticleSystem};
/// # use tumble_core::prelude::*;
/// # let mut world = World::default();
/// use tumble_behaviors::ParticleLook;
/// use tumble_core::Appearance;
/// let appearance = Appearance { color: [0.35, 0.32, 0.3], ..Appearance::default() };
/// let look = ParticleLook { appearance, radius: Some(0.09), scale: [1.0, 5.0], opacity: Some([0.2, 0.0]), ..ParticleLook::default() };
/// let settings = ParticleSettings { gravity_scale: -0.11, linear_drag: 0.9, collidable: false, ..ParticleSettings::default() };
/// world.add(ParticleSystem::new("smoke", settings)?.with_look(look)?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ParticleLook {
    /// Appearance of all particles of the system; textures have no effect.
    pub appearance: Appearance,
    /// Radius in pictures, m, above 0; `None` for that of the settings. Particles without any are not drawn.
    pub radius: Option<f64>,
    /// Time before its end in which a particle shrinks to nothing, s, at least 0.
    pub fade: f64,
    /// Share of the light from behind that the middle of a particle blocks, at birth and at the end, each 0 to 1:
    /// particles are soft spheres. `None` for solid ones.
    pub opacity: Option<[f64; 2]>,
    /// Factor of the drawn radius at birth and at the end, each at least 0.
    pub scale: [f64; 2],
    /// Color at the end, sRGB, each 0 to 1; `None` for the appearance's color at all times.
    pub end_color: Option<[f32; 3]>,
}

impl Default for ParticleLook {
    /// Solid, as large as they are, without a change over their life.
    fn default() -> ParticleLook {
        let appearance = Appearance::default();
        ParticleLook { appearance, radius: None, fade: 0.0, opacity: None, scale: [1.0; 2], end_color: None }
    }
}

impl ParticleSystem {
    /// Sets how particles are drawn.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] names the number that is out of its range.
    pub fn with_look(self, look: ParticleLook) -> Result<ParticleSystem, BehaviorError> {
        let radius = look.radius.unwrap_or(1.0);
        check("the drawn radius of a particle", radius, radius > 0.0, "above 0")?;
        check("the fade of a particle", look.fade, look.fade >= 0.0, "at least 0")?;
        for opacity in look.opacity.into_iter().flatten() {
            check("the opacity of a particle", opacity, (0.0..=1.0).contains(&opacity), "0 to 1")?;
        }
        for scale in look.scale {
            check("the scale of a particle", scale, scale >= 0.0, "at least 0")?;
        }
        for part in look.end_color.into_iter().flatten().map(f64::from) {
            check("the end color of a particle", part, (0.0..=1.0).contains(&part), "0 to 1")?;
        }
        Ok(ParticleSystem { look, ..self })
    }
    /// Returns how particles are drawn.
    pub fn look(&self) -> &ParticleLook {
        &self.look
    }
    /// Returns the sources.
    pub fn emitters(&self) -> &[super::Emitter] {
        &self.emitters
    }
}

impl ParticleLook {
    /// Returns a particle of this radius, m, as it is drawn when a time is left of its lifetime, s.
    fn sphere(&self, center: Vec3, radius: f64, [life, lifetime]: [f64; 2]) -> CloudSphere {
        let age = (1.0 - life / lifetime).clamp(0.0, 1.0);
        let over_life = |[birth, end]: [f64; 2]| birth + age * (end - birth);
        let shrunk = if self.fade > 0.0 { (life / self.fade).min(1.0) } else { 1.0 };
        let between = |k: usize, end: f32| self.appearance.color[k] + age as f32 * (end - self.appearance.color[k]);
        CloudSphere {
            center,
            radius: radius * shrunk * over_life(self.scale),
            opacity: self.opacity.map_or(1.0, over_life),
            color: self.end_color.map(|[r, g, b]| [between(0, r), between(1, g), between(2, b)]),
        }
    }
}

/// Returns the records of the particles that live.
fn living(x: &[f64]) -> impl Iterator<Item = &[f64]> + '_ {
    x.get(HEADER..).unwrap_or_default().chunks_exact(RECORD).filter(|record| record[6] > 0.0)
}

impl Renderable for ParticleSystem {
    fn visuals(&self) -> &[Visual] {
        &[]
    }
    fn cloud<'a>(&'a self, x: &'a [f64]) -> Option<Cloud<'a>> {
        let (look, radius) = (&self.look, self.look.radius.unwrap_or(self.settings.radius));
        let sphere =
            move |record: &[f64]| look.sphere(Vec3::from_column_slice(&record[..3]), radius, [record[6], record[8]]);
        let spheres = living(x).map(sphere).filter(|sphere| sphere.radius > 0.0);
        Some(Cloud { appearance: &look.appearance, transparent: look.opacity.is_some(), spheres: Box::new(spheres) })
    }
}

impl NetSync for ParticleSystem {
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>) {
        let x = &view.x[me.x.clone()];
        let every = living(x).count().div_ceil(MOST_SENT).max(1) as u64;
        let sent = || living(x).filter(|record| (record[7] as u64).is_multiple_of(every)).take(MOST_SENT);
        out.extend((sent().count() as u32).to_le_bytes());
        for record in sent() {
            let times = [6, 8].map(|k| (record[k] as f32).clamp(f32::MIN_POSITIVE, f32::MAX));
            let place = [0, 1, 2].map(|k| (record[k] as f32).clamp(f32::MIN, f32::MAX));
            out.extend(place.into_iter().chain(times).flat_map(f32::to_le_bytes));
        }
    }

    fn read_data(&self, data: &[u8], x: &mut [f64]) -> Result<(), SyncError> {
        let (count, records) = data.split_first_chunk().ok_or(SyncError::Length { got: data.len(), expected: 4 })?;
        let count = u32::from_le_bytes(*count) as usize;
        let most = MOST_SENT.min(self.settings.capacity);
        if count > most || records.len() != SENT * count {
            return Err(SyncError::Length { got: data.len(), expected: 4 + SENT * count.min(most) });
        }
        let numbers: Vec<f64> =
            records.as_chunks::<4>().0.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))).collect();
        let (particles, _) = numbers.as_chunks::<5>();
        let fine = |[a, b, c, life, lifetime]: &[f64; 5]| {
            [a, b, c, life, lifetime].iter().all(|x| x.is_finite()) && *life > 0.0 && *lifetime > 0.0
        };
        if !particles.iter().all(fine) {
            return Err(SyncError::Value);
        }
        x.fill(0.0);
        let (header, records) = x.split_at_mut(HEADER);
        (header[0], header[1]) = (count as f64, 1.0);
        for ((serial, [a, b, c, life, lifetime]), record) in (0..).zip(particles).zip(records.chunks_exact_mut(RECORD))
        {
            write(record, &Vec3::new(*a, *b, *c), &Vec3::zeros(), [*life, *lifetime], f64::from(serial));
        }
        Ok(())
    }
}
