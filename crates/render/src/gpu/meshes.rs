//! Meshes and buffers on the device.

use super::Gpu;
use crate::{MeshData, RenderError};
use std::sync::Arc;
use wgpu::{Buffer, BufferUsages};

/// Meshes on the device, identified by their `Arc`: a mesh is uploaded once, and freed when a list
/// no longer contains it.
#[derive(Default)]
pub struct MeshCache {
    known: Vec<(Arc<MeshData>, MeshBuffers)>,
}

/// Vertices and indices.
#[derive(Clone)]
pub struct MeshBuffers {
    pub vertices: Buffer,
    pub indices: Buffer,
    pub count: u32,
}

impl MeshCache {
    /// Returns the buffers for the meshes of a list, in its order.
    pub(crate) fn sync(&mut self, gpu: &Gpu, meshes: &[Arc<MeshData>]) -> Result<Vec<MeshBuffers>, RenderError> {
        let mut kept = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            let place = self.known.binary_search_by_key(&Arc::as_ptr(mesh), |(m, _)| Arc::as_ptr(m));
            let buffers = match place {
                Ok(i) => self.known[i].1.clone(),
                Err(_) => {
                    mesh.validate()?;
                    MeshBuffers::new(gpu, mesh)?
                }
            };
            kept.push((mesh.clone(), buffers));
        }
        let buffers = kept.iter().map(|(_, b)| b.clone()).collect();
        // addresses order the cache only; nothing drawn depends on them
        kept.sort_by_key(|(m, _)| Arc::as_ptr(m));
        kept.dedup_by_key(|(m, _)| Arc::as_ptr(m));
        self.known = kept;
        Ok(buffers)
    }
}

impl MeshBuffers {
    pub(crate) fn new(gpu: &Gpu, mesh: &MeshData) -> Result<Self, RenderError> {
        let place = |i: usize| mesh.unwrapped.get(i).copied().unwrap_or_default();
        let corners = mesh.positions.iter().zip(&mesh.normals).enumerate();
        let vertices: Vec<f32> =
            corners.flat_map(|(i, (p, n))| p.iter().chain(n).copied().chain(place(i)).collect::<Vec<_>>()).collect();
        Ok(MeshBuffers {
            vertices: vertex_buffer(gpu, &vertices, "mesh vertices")?,
            indices: buffer(gpu, bytemuck::cast_slice(&mesh.indices), BufferUsages::INDEX, "mesh indices")?,
            count: mesh.indices.len() as u32,
        })
    }
}

/// Creates a vertex buffer.
pub fn vertex_buffer(gpu: &Gpu, floats: &[f32], what: &'static str) -> Result<Buffer, RenderError> {
    buffer(gpu, bytemuck::cast_slice(floats), BufferUsages::VERTEX, what)
}

/// Creates a uniform buffer, constant for a whole pass.
pub fn uniform_buffer(gpu: &Gpu, floats: &[f32], what: &'static str) -> Result<Buffer, RenderError> {
    buffer(gpu, bytemuck::cast_slice(floats), BufferUsages::UNIFORM, what)
}

/// Creates a buffer with these bytes; never empty.
///
/// # Errors
/// More bytes than the device can hold.
pub fn buffer(gpu: &Gpu, bytes: &[u8], usage: BufferUsages, what: &'static str) -> Result<Buffer, RenderError> {
    let cap = gpu.device.limits().max_buffer_size;
    if bytes.len() as u64 > cap {
        return Err(RenderError::TooMany { what, count: bytes.len(), cap: cap as usize });
    }
    let contents = if bytes.is_empty() { &[0; 16] } else { bytes };
    // not mapped at creation, which panics on a lost device
    let size = contents.len() as u64;
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(what),
        size,
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, contents);
    Ok(buffer)
}
