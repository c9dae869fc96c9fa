//! Cameras and lights that objects carry (thesis §III.A: both are interfaces like any other). Data alone: what they see and light is the renderer's matter.
//!
//! Axes of a camera and of a light: x ahead, y to the left, z up.

use tumble_collide::Pose;

/// Carries points of view.
pub trait CameraCarrier {
    /// Its cameras; their names differ.
    fn cameras(&self) -> &[CameraMount];
}

/// Carries lights.
pub trait LightCarrier {
    /// Its lights.
    fn lights(&self) -> &[LightMount];
}

/// A camera fixed to a part.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraMount {
    /// Told apart by it from others of the object; may be empty where there is one.
    pub name: String,
    /// Part of the object that it moves with.
    pub part: usize,
    /// Pose in the part's frame: it looks along its x axis, and z is up in the picture.
    pub pose: Pose,
    /// Angle from the lower to the upper edge of the picture, rad, above 0 and below π.
    pub vertical_fov: f64,
    /// Nearest depth that is drawn, m, above 0.
    pub near: f64,
    /// Farthest depth that is drawn, m, above `near`.
    pub far: f64,
}

impl CameraMount {
    /// A camera of 40 degrees that sees from 5 cm to 500 m.
    pub fn new(name: impl Into<String>, part: usize, pose: Pose) -> CameraMount {
        CameraMount { name: name.into(), part, pose, vertical_fov: 40.0_f64.to_radians(), near: 0.05, far: 500.0 }
    }
}

/// A light fixed to a part.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LightMount {
    /// Part of the object that it moves with.
    pub part: usize,
    /// Pose in the part's frame: a directional light travels along its x axis.
    pub pose: Pose,
    /// How it spreads.
    pub spread: Spread,
    /// sRGB, each 0 to 1.
    pub color: [f64; 3],
    /// A directional light of 1 on a white wall that faces it is white; a point light does that at 1 m.
    pub intensity: f64,
    /// Whether it throws shadows.
    pub casts_shadow: bool,
}

/// How a light spreads.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Spread {
    /// In one direction, from infinitely far.
    Directional,
    /// From a ball in all directions, falling off with the square of the distance.
    Point {
        /// Radius of the ball, m: the softness of shadows.
        radius: f64,
    },
}

/// How much of an object is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Detail {
    /// Its shape and its look.
    #[default]
    Full,
    /// Fewer triangles, and one colour without a pattern.
    Simplified,
    /// The balls of this level of its sphere tree, 0 being the root; what has no tree is drawn in full.
    SphereTree(u32),
    /// Its edges.
    Wireframe,
}

impl Detail {
    /// The words for it: `full`, `simplified`, `wireframe`, `sphere_tree=LEVEL`.
    pub fn words(self) -> String {
        match self {
            Detail::Full => "full".into(),
            Detail::Simplified => "simplified".into(),
            Detail::SphereTree(level) => format!("sphere_tree={level}"),
            Detail::Wireframe => "wireframe".into(),
        }
    }
}

impl std::str::FromStr for Detail {
    type Err = String;

    fn from_str(words: &str) -> Result<Detail, String> {
        match words {
            "full" => Ok(Detail::Full),
            "simplified" => Ok(Detail::Simplified),
            "wireframe" => Ok(Detail::Wireframe),
            _ => {
                let level = words.strip_prefix("sphere_tree=").and_then(|n| n.parse().ok());
                level.map(Detail::SphereTree).ok_or_else(|| "full, simplified, wireframe or sphere_tree=LEVEL".into())
            }
        }
    }
}
