//! A mesh shape with its tree, as the cache and archives have it behind their checksums; queried if it is small.
#![no_main]

use libfuzzer_sys::fuzz_target;
use serde::Deserialize;
use serde::de::value::{Error, SeqDeserializer};
use tumble_collide::{MeshShape, Pose, Shape, Vec3, contacts};

fuzz_target!(|bytes: &[u8]| {
    let Ok(shape) = MeshShape::deserialize(SeqDeserializer::<_, Error>::new(bytes.iter().copied())) else { return };
    if shape.mesh().triangles.len() <= 64 {
        let (shape, sphere) = (Shape::Mesh(std::sync::Arc::new(shape)), Shape::sphere(0.1).unwrap());
        for x in [0.0, 0.3, 1.0] {
            let mut found = Vec::new();
            contacts(&shape, &Pose::identity(), &sphere, &Pose::translation(x, 0.1, 0.0), 0.05, &mut found);
        }
        let _ = shape.cast_ray(&Pose::identity(), &Vec3::new(0.1, 0.2, 3.0), &-Vec3::z(), 10.0);
    }
});
