//! Calibrations of projectors that other programs have made, as caves.
//!
//! [`Mpcdi`] is the standard archive of warps and blends. [`mpcdi_to_cave`] makes a cave file of it,
//! [`cave_to_mpcdi`] the reverse. [`sgct_to_cave`] reads configurations of SGCT.
//!
//! ```
//! use tumble_calibrate::Mpcdi;
//! let error = Mpcdi::parse(b"no archive").unwrap_err();
//! assert!(error.to_string().starts_with("the archive: "));
//! ```

mod from_cave;
mod mpcdi;
mod sgct;
mod to_cave;

pub use from_cave::cave_to_mpcdi;
pub use mpcdi::{CalibrationError, Frustum, Map, Mpcdi, Profile, Region};
pub use sgct::sgct_to_cave;
pub use to_cave::{CaveFiles, mpcdi_to_cave};
