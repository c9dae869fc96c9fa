//! The appearance of surfaces.

use super::mounts::Detail;
use std::path::Path;
use std::sync::Arc;

/// Appearance of a surface: a shader by name and its properties (the thesis's shader attributes).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Appearance {
    /// Base color, sRGB, each 0 to 1.
    pub color: [f32; 3],
    /// 0 (a mirror) to 1 (chalk).
    pub roughness: f32,
    /// 0 (not a metal) to 1 (a metal).
    pub metallic: f32,
    /// Name of the surface's pattern; `plain` for none.
    pub shader: String,
    /// Names and values of the shader's properties.
    pub properties: Vec<(String, f64)>,
    /// Image (PNG) over the base color. The renderer opens it.
    #[serde(with = "texture")]
    pub texture: Option<Arc<Path>>,
    /// Level of detail.
    pub detail: Detail,
}

impl Default for Appearance {
    fn default() -> Appearance {
        Appearance {
            color: [0.7, 0.7, 0.72],
            roughness: 0.5,
            metallic: 0.0,
            shader: "plain".into(),
            properties: Vec::new(),
            texture: None,
            detail: Detail::Full,
        }
    }
}

/// The path of a texture in archives, as a string: a path that is not UTF-8 is an error.
mod texture {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::path::{Path, PathBuf};
    use std::sync::Arc;

    pub fn serialize<S: Serializer>(path: &Option<Arc<Path>>, serializer: S) -> Result<S::Ok, S::Error> {
        path.as_deref().serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Arc<Path>>, D::Error> {
        Ok(Option::<PathBuf>::deserialize(deserializer)?.map(Arc::from))
    }
}
