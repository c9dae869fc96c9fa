//! Cameras and lights that objects carry (thesis §III.A: both are interfaces like any other). They
//! are data for a renderer.
//!
//! Axes of a camera and of a light: x forward, y to the left, z up.

use tumble_collide::Pose;

/// An object that carries cameras.
pub trait CameraCarrier {
    /// Returns its cameras, whose names are unique.
    fn cameras(&self) -> &[CameraMount];
}

/// An object that carries lights.
pub trait LightCarrier {
    /// Returns its lights.
    fn lights(&self) -> &[LightMount];
}

/// A camera fixed to a part.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraMount {
    /// Name, unique in the object; may be empty for a single camera.
    pub name: String,
    /// Part of the object that it is fixed to.
    pub part: usize,
    /// Pose in the part's frame: the view direction is the x axis, and z is up in the image.
    pub pose: Pose,
    /// Vertical field of view, rad, above 0 and below π.
    pub vertical_fov: f64,
    /// Depth of the near plane, m, above 0.
    pub near: f64,
    /// Depth of the far plane, m, above `near`.
    pub far: f64,
}

impl CameraMount {
    /// Makes a camera with a vertical field of view of 40 degrees and a depth range of 5 cm to 500
    /// m.
    pub fn new(name: impl Into<String>, part: usize, pose: Pose) -> CameraMount {
        CameraMount { name: name.into(), part, pose, vertical_fov: 40.0_f64.to_radians(), near: 0.05, far: 500.0 }
    }
}

/// A light fixed to a part.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LightMount {
    /// Part of the object that it is fixed to.
    pub part: usize,
    /// Pose in the part's frame: a directional light shines along its x axis.
    pub pose: Pose,
    /// Kind of light.
    pub spread: Spread,
    /// sRGB, each 0 to 1.
    pub color: [f64; 3],
    /// Brightness. A directional light of 1 makes a white wall that faces it white; a point light
    /// does so at 1 m.
    pub intensity: f64,
    /// Whether it casts shadows.
    pub casts_shadow: bool,
}

/// Distribution of a light.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Spread {
    /// Parallel rays from infinitely far.
    Directional,
    /// From a sphere in all directions, with the inverse square of the distance.
    Point {
        /// Radius of the sphere, m: it sets the softness of shadows.
        radius: f64,
    },
}

/// Level of detail of an object in an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Detail {
    /// Its shape with its appearance.
    #[default]
    Full,
    /// Fewer triangles, one color and no pattern.
    Simplified,
    /// The spheres of this level of its sphere tree, with 0 the root, and the leaves above it. Shapes without a tree are drawn in full.
    /// Words have a level of 0 to 63, which is that of any tree.
    SphereTree(u32),
    /// Its edges.
    Wireframe,
}

/// Largest number of levels of a sphere tree.
const TREE_LEVELS: u32 = 64;

impl Detail {
    /// Returns its name: `full`, `simplified`, `wireframe`, `sphere_tree=LEVEL`.
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
                let level =
                    words.strip_prefix("sphere_tree=").and_then(|n| n.parse().ok()).filter(|n| *n < TREE_LEVELS);
                level
                    .map(Detail::SphereTree)
                    .ok_or_else(|| "full, simplified, wireframe or sphere_tree=LEVEL, LEVEL from 0 to 63".into())
            }
        }
    }
}
