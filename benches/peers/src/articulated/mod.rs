//! Robots for both engines from one description, and the time of forward dynamics in each.

mod dynibo;
mod robot;
mod timing;
mod tumble;

pub use dynibo::Dynibo;
pub use robot::{Motion, Part, Robot, anymal, chain, panda, talos};
pub use timing::{in_turns, median};
pub use tumble::{Batch, Maps, Single};
