//! Particles in pictures and in messages to other processes.
//!
//! A message has what a picture needs, in single precision:
//!
//! | bytes | content |
//! |---|---|
//! | 4 | number of particles, `u32` |
//! | 16 of each | position, m, and time that is left, s: four `f32` |
//!
//! All numbers are little-endian. A message has at most [`MOST_SENT`] particles, 512 KiB. Of `n` more, those are
//! sent whose serial number is a multiple of `⌈n/MOST_SENT⌉`, so a particle stays sent as long as that number stays.

use super::{HEADER, ParticleSystem, RECORD, write};
use crate::error::{BehaviorError, check};
use tumble_collide::Vec3;
use tumble_core::{Appearance, Cloud, NetSync, Renderable, StateRange, SyncError, Visual, WorldView};

/// Most particles of a message.
pub(super) const MOST_SENT: usize = 32_768;
/// Bytes of a particle in a message.
const SENT: usize = 16;

/// How particles are drawn: as small spheres.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ParticleLook {
    /// Appearance of all particles of the system; textures have no effect.
    pub appearance: Appearance,
    /// Radius in pictures, m, above 0; `None` for that of the settings. Particles without any are not drawn.
    pub radius: Option<f64>,
    /// Time before its end in which a particle shrinks to nothing, s, at least 0.
    pub fade: f64,
}

impl Default for ParticleLook {
    /// As large as they are, without a fade.
    fn default() -> ParticleLook {
        ParticleLook { appearance: Appearance::default(), radius: None, fade: 0.0 }
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

/// Returns the records of the particles that live.
fn living(x: &[f64]) -> impl Iterator<Item = &[f64]> + '_ {
    x.get(HEADER..).unwrap_or_default().chunks_exact(RECORD).filter(|record| record[6] > 0.0)
}

impl Renderable for ParticleSystem {
    fn visuals(&self) -> &[Visual] {
        &[]
    }
    fn cloud<'a>(&'a self, x: &'a [f64]) -> Option<Cloud<'a>> {
        let (whole, fade) = (self.look.radius.unwrap_or(self.settings.radius), self.look.fade);
        let sphere = move |record: &[f64]| {
            let share = if fade > 0.0 { (record[6] / fade).min(1.0) } else { 1.0 };
            (Vec3::from_column_slice(&record[..3]), whole * share)
        };
        let spheres = living(x).map(sphere).filter(|(_, radius)| *radius > 0.0);
        Some(Cloud { appearance: &self.look.appearance, spheres: Box::new(spheres) })
    }
}

impl NetSync for ParticleSystem {
    fn get_data(&self, me: &StateRange, view: &WorldView, out: &mut Vec<u8>) {
        let x = &view.x[me.x.clone()];
        let every = living(x).count().div_ceil(MOST_SENT).max(1) as u64;
        let sent = || living(x).filter(|record| (record[7] as u64).is_multiple_of(every)).take(MOST_SENT);
        out.extend((sent().count() as u32).to_le_bytes());
        for record in sent() {
            let life = (record[6] as f32).clamp(f32::MIN_POSITIVE, f32::MAX);
            let place = [0, 1, 2].map(|k| (record[k] as f32).clamp(f32::MIN, f32::MAX));
            out.extend(place.into_iter().chain([life]).flat_map(f32::to_le_bytes));
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
        let (particles, _) = numbers.as_chunks::<4>();
        if !particles.iter().all(|[a, b, c, life]| [a, b, c, life].iter().all(|x| x.is_finite()) && *life > 0.0) {
            return Err(SyncError::Value);
        }
        x.fill(0.0);
        let (header, records) = x.split_at_mut(HEADER);
        (header[0], header[1]) = (count as f64, 1.0);
        for ((serial, [a, b, c, life]), record) in (0..).zip(particles).zip(records.chunks_exact_mut(RECORD)) {
            write(record, &Vec3::new(*a, *b, *c), &Vec3::zeros(), *life, f64::from(serial));
        }
        Ok(())
    }
}
