//! Serialization of shapes (serde): only data that cannot be computed again with the same bits is
//! written.
//!
//! | shape | written |
//! |---|---|
//! | primitives | their sizes |
//! | cylinder | radius and half length; the tree is rebuilt |
//! | mesh | the bytes of the cache (`shape/stored.rs`), which are checked when they are read |

use crate::{CylinderShape, MeshShape};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Serializes shared values like unshared ones.
pub mod shared {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::sync::Arc;

    /// Writes the value itself.
    pub fn serialize<T: Serialize, S: Serializer>(value: &Arc<T>, serializer: S) -> Result<S::Ok, S::Error> {
        T::serialize(value, serializer)
    }

    /// Reads the value into a new `Arc`.
    pub fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<T>, D::Error> {
        T::deserialize(deserializer).map(Arc::new)
    }
}

impl Serialize for MeshShape {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_bytes().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for MeshShape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<MeshShape, D::Error> {
        let bytes = Vec::deserialize(deserializer)?;
        MeshShape::of_bytes(&bytes)
            .ok_or_else(|| D::Error::custom("the bytes of a mesh shape are cut off or out of range"))
    }
}

impl Serialize for CylinderShape {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        [self.radius(), self.half_length()].serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for CylinderShape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<CylinderShape, D::Error> {
        let [radius, half_length] = <[f64; 2]>::deserialize(deserializer)?;
        CylinderShape::new(radius, 2.0 * half_length).map_err(D::Error::custom)
    }
}
