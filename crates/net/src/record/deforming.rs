//! Surfaces and points whose shape changes from frame to frame, for viewers: cloth, jelly, particles.
//!
//! | topic | schema | when |
//! |---|---|---|
//! | [`TOPIC_SURFACES`](super::TOPIC_SURFACES) | `foxglove.SceneUpdate` | every frame with a surface, and the one after the last: all surfaces, in world axes |
//! | [`TOPIC_PARTICLES`](super::TOPIC_PARTICLES) | `foxglove.PointCloud` | every frame with a point, and the one after the last: `x, y, z` (`f32`, m), `red, green, blue, alpha` (`u8`) |
//!
//! The state of a frame has all that a replay needs, so a reader ignores both.

use super::error::{RecordError, Result};
use super::messages::{deletion, fox_color, stamp, triangle_list};
use super::schemas::ROOT_FRAME;
use super::{MAX_NAME_BYTES, MAX_SCENE_BYTES};
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud, SceneEntity, SceneUpdate};

/// Most points of a frame; of more, each second, third and so on is recorded.
pub const MAX_POINTS: usize = 100_000;
/// Bytes of a point.
const POINT_BYTES: usize = 16;

/// Everything that changes its shape in a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deforming {
    /// Surfaces.
    pub surfaces: Vec<Surface>,
    /// Points.
    pub points: Vec<Point>,
}

/// A surface in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Name, unique among surfaces; 1 to [`MAX_NAME_BYTES`] bytes.
    pub name: String,
    /// Its vertices, world axes, m.
    pub vertices: Vec<[f64; 3]>,
    /// Three indices each.
    pub triangles: Vec<[u32; 3]>,
    /// Red, green, blue, alpha, each 0 to 1.
    pub color: [f32; 4],
}

/// A point in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// World axes, m.
    pub position: [f32; 3],
    /// Red, green, blue, alpha.
    pub color: [u8; 4],
}

impl Deforming {
    /// Returns the message with all surfaces, and with the removal of those in `before` that are gone.
    ///
    /// # Errors
    /// [`RecordError::Input`]: a name is empty or too long, a number is not finite, an index has no vertex, or the
    /// surfaces are too large.
    pub(crate) fn surfaces_message(&self, log_time: u64, before: &[String]) -> Result<SceneUpdate> {
        let bytes: usize = self.surfaces.iter().map(|s| 32 * s.vertices.len() + 12 * s.triangles.len()).sum();
        if bytes > MAX_SCENE_BYTES {
            let why = format!("they take {bytes} bytes, at most {MAX_SCENE_BYTES} are allowed");
            return Err(RecordError::input("the surfaces", why));
        }
        for surface in &self.surfaces {
            if let Some(why) = surface.fault() {
                return Err(RecordError::input(format!("surface \"{}\"", surface.name), why));
            }
        }
        let gone = before.iter().filter(|name| self.surfaces.iter().all(|surface| surface.name != **name));
        Ok(SceneUpdate {
            deletions: gone.map(|name| deletion(log_time, name)).collect(),
            entities: self.surfaces.iter().map(|surface| surface.entity(log_time)).collect(),
        })
    }

    /// Returns the message with at most [`MAX_POINTS`] of the points.
    pub(crate) fn points_message(&self, log_time: u64) -> PointCloud {
        let every = self.points.len().div_ceil(MAX_POINTS).max(1);
        let mut data = Vec::with_capacity(POINT_BYTES * self.points.len().div_ceil(every));
        for point in self.points.iter().step_by(every) {
            data.extend(point.position.into_iter().flat_map(f32::to_le_bytes));
            data.extend(point.color);
        }
        let field = |(k, name): (usize, &str)| {
            let (offset, kind) = if k < 3 { (4 * k, NumericType::Float32) } else { (9 + k, NumericType::Uint8) };
            PackedElementField { name: name.into(), offset: offset as u32, r#type: kind as i32 }
        };
        PointCloud {
            timestamp: Some(stamp(log_time)),
            frame_id: ROOT_FRAME.into(),
            point_stride: POINT_BYTES as u32,
            fields: ["x", "y", "z", "red", "green", "blue", "alpha"].into_iter().enumerate().map(field).collect(),
            data: data.into(),
            ..Default::default()
        }
    }
}

impl Surface {
    fn fault(&self) -> Option<String> {
        if self.name.is_empty() || self.name.len() > MAX_NAME_BYTES {
            return Some(format!("its name has {} bytes, 1 to {MAX_NAME_BYTES} are allowed", self.name.len()));
        }
        if let Some(k) = self.vertices.iter().position(|vertex| !vertex.iter().all(|x| x.is_finite())) {
            return Some(format!("vertex {k} is not finite: {:?}", self.vertices[k]));
        }
        let wrong = self.triangles.iter().flatten().find(|k| **k as usize >= self.vertices.len())?;
        Some(format!("a triangle names vertex {wrong} of {}", self.vertices.len()))
    }

    fn entity(&self, log_time: u64) -> SceneEntity {
        let triangles = triangle_list(None, Some(fox_color(self.color)), &self.vertices, &self.triangles);
        SceneEntity {
            timestamp: Some(stamp(log_time)),
            frame_id: ROOT_FRAME.into(),
            id: self.name.clone(),
            triangles: vec![triangles],
            ..Default::default()
        }
    }
}
