//! tumble and its peers: the same scenes, the same clock, the same measure of error.

pub mod articulated;
pub mod broad;
pub mod clock;
pub mod measure;
pub mod overlap;
pub mod random;
pub mod rapier;
pub mod residuals;
pub mod scene;
pub mod scenes;
pub mod tumble;

/// Motion of a body at one time.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Center, meters.
    pub center: [f64; 3],
    /// Rotation matrix, body to world.
    pub rotation: [[f64; 3]; 3],
    /// Speed of the center, m/s.
    pub speed: f64,
}

impl Motion {
    /// Returns a point of the body in the world for its place in the axes of the body, meters.
    pub fn point(&self, local: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|i| self.center[i] + (0..3).map(|k| self.rotation[i][k] * local[k]).sum::<f64>())
    }
}

/// The solves of a frame, as an engine reports them.
#[derive(Clone, Copy, Debug)]
pub struct Solves {
    /// Largest residual, m/s.
    pub residual: f64,
    /// Number of solves that did not reach their tolerance.
    pub unconverged: u32,
}

/// An engine with one scene loaded.
pub trait Engine {
    /// Advances by one frame.
    fn step(&mut self);
    /// Returns the motion of body `i` of the scene.
    fn motion(&self, i: usize) -> Motion;
    /// Returns the report on the last frame; `None` if the engine has none.
    fn solves(&self) -> Option<Solves> {
        None
    }
}
