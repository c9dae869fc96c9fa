//! Sound of a run: impacts excite the modes of bodies, sliding excites noise.
//!
//! A [`Soundtrack`] looks at the world after each frame and collects [`Strike`]s and [`Rub`]s; [`Soundtrack::mix`]
//! renders them for a listener. Everything is a function of the run alone: the noise comes from a fixed generator, and
//! the same run gives the same samples. `docs/sound.md` has the model and its figures.

mod body;
mod live;
mod materials;
mod mix;
mod observe;
mod parts;
mod voices;
mod wav;

#[cfg(test)]
mod tests;

pub use body::{MODES, SoundBody};
pub use live::{LIVE_GAIN_DB, LiveFrame, LiveMixer, LiveSound};
pub use materials::{SOUND_MATERIALS, SoundMaterial};
pub use mix::{Listener, RATE_HZ, SPEED_OF_SOUND};
pub use observe::{Impact, Impacts, Slide, Soundtrack, slides};
pub use voices::{Rub, Strike};
pub use wav::{MAX_GAIN_DB, MAX_SECONDS, Mixed, SoundError};
