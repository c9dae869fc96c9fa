//! Calibrations of projectors as caves: those that other programs have made, and measured ones.
//!
//! [`Pattern`] is a picture of structured light, [`photographs`] decodes photographs of them, and [`calibrate`]
//! makes a cave file with warps and masks of what they show.
//!
//! [`Mpcdi`] is the standard archive of warps and blends. [`mpcdi_to_cave`] makes a cave file of it,
//! [`cave_to_mpcdi`] the reverse. [`sgct_to_cave`] reads configurations of SGCT.
//!
//! ```
//! use tumble_calibrate::Mpcdi;
//! let error = Mpcdi::parse(b"no archive").unwrap_err();
//! assert!(error.to_string().starts_with("the archive: "));
//! ```

mod fit;
mod from_cave;
mod light;
mod marks;
mod measured;
mod mpcdi;
mod sgct;
mod to_cave;

pub use fit::{Mark, Measurement, Quality, View};
pub use from_cave::cave_to_mpcdi;
pub use light::{Decoded, Decoder, Pattern, Photo, Refused, photographs};
pub use marks::parse_marks;
pub use measured::{Calibration, Projector, calibrate};
pub use mpcdi::{CalibrationError, Frustum, Map, Mpcdi, Profile, Region};
pub use sgct::sgct_to_cave;
pub use to_cave::{CaveFiles, mpcdi_to_cave};
