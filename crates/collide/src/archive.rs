//! Shapes as data (serde): what cannot be made anew with the same bits is written, the rest is made anew.
//!
//! | shape | written |
//! |---|---|
//! | primitives | their sizes |
//! | cylinder | radius and half length; the tree is built anew |
//! | mesh | the mesh about its center of mass, its tree, its mass properties, what was mended; elements and fields are made anew |
//!
//! What is read is checked where later code would fail on it: indices in range, numbers finite, children behind their parents.

use crate::tree::SphereNode;
use crate::{ClosedReport, CylinderShape, MassProperties, MeshShape, SphereTree, TriMesh, Vec3};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;

/// Shared values are written as if they were not shared.
pub mod shared {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::sync::Arc;

    /// As the value itself.
    pub fn serialize<T: Serialize, S: Serializer>(value: &Arc<T>, serializer: S) -> Result<S::Ok, S::Error> {
        T::serialize(value, serializer)
    }

    /// The value, shared by nobody yet.
    pub fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<T>, D::Error> {
        T::deserialize(deserializer).map(Arc::new)
    }
}

#[derive(Serialize, Deserialize)]
struct MeshRecord<'a> {
    mesh: Cow<'a, TriMesh>,
    tree: Cow<'a, [SphereNode]>,
    unit_mass: MassProperties,
    report: Cow<'a, ClosedReport>,
    center: Vec3,
}

impl Serialize for MeshShape {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let record = MeshRecord {
            mesh: Cow::Borrowed(self.mesh()),
            tree: Cow::Borrowed(self.tree().nodes()),
            unit_mass: *self.unit_mass(),
            report: Cow::Borrowed(self.report()),
            center: self.center_of_mass(),
        };
        record.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for MeshShape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<MeshShape, D::Error> {
        let MeshRecord { mesh, tree, unit_mass, report, center } = MeshRecord::deserialize(deserializer)?;
        mesh.check_data().map_err(D::Error::custom)?;
        if center.iter().any(|x| !x.is_finite()) {
            return Err(D::Error::custom("the center of mass is not finite"));
        }
        let tree = SphereTree::of_archive(tree.into_owned()).map_err(D::Error::custom)?;
        Ok(MeshShape::of_parts(mesh.into_owned(), tree, unit_mass, report.into_owned(), center))
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
        CylinderShape::new(radius, half_length).map_err(D::Error::custom)
    }
}
