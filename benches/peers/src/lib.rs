//! tumble and its peers: the same scenes, the same clock, the same measure of error.

pub mod articulated;
pub mod broad;
pub mod clock;
pub mod measure;
pub mod rapier;
pub mod scene;
pub mod tumble;

/// Length of a frame, s.
pub const DT: f64 = 1.0 / 60.0;
/// Friction and restitution of every body and pair.
pub const FRICTION: f64 = 0.5;
/// See [`FRICTION`].
pub const RESTITUTION: f64 = 0.0;
/// Density of every body, kg/m³.
pub const DENSITY: f64 = 1000.0;

/// An engine with one scene loaded.
pub trait Engine {
    /// Advances by one frame of [`DT`].
    fn step(&mut self);
    /// Center of body `i` (in the order of the scene), meters.
    fn center(&self, i: usize) -> [f64; 3];
    /// Returns the residual that the engine reports for its last solve, m/s; `None` if it reports none.
    fn residual(&self) -> Option<f64> {
        None
    }
}
