//! The textures that are drawn into, and the way back to memory.

use super::Gpu;
use super::pipelines::{COLOR, DEPTH, OCCLUSION, SAMPLES};
use crate::{Image, MAX_SHADOWS, RenderError};
use wgpu::{Extent3d, Texture, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor};

/// All targets for one picture size and one size of shadow maps.
pub struct Targets {
    pub width: u32,
    pub height: u32,
    pub shadow_size: u32,
    pub color: TextureView,
    pub depth: TextureView,
    pub picture: TextureView,
    pub shadow_layers: Vec<TextureView>,
    pub shadow_array: TextureView,
    pub view_depth: TextureView,
    pub occlusion_raw: TextureView,
    pub occlusion: TextureView,
    pub white: TextureView,
    resolved: Texture,
    readback: wgpu::Buffer,
}

impl Targets {
    pub fn new(device: &wgpu::Device, width: u32, height: u32, shadow_size: u32) -> Self {
        let draw = TextureUsages::RENDER_ATTACHMENT;
        let look = draw | TextureUsages::TEXTURE_BINDING;
        let make = |label, (width, height, layers), samples, format, usage| texture(device, label, Extent3d { width, height, depth_or_array_layers: layers }, samples, format, usage);
        let whole = |t: Texture| t.create_view(&TextureViewDescriptor::default());
        let full = (width, height, 1);
        let shadows = make("shadow maps", (shadow_size, shadow_size, MAX_SHADOWS as u32), 1, DEPTH, look);
        let layer = |i| TextureViewDescriptor { dimension: Some(wgpu::TextureViewDimension::D2), base_array_layer: i, array_layer_count: Some(1), ..Default::default() };
        let resolved = make("picture", full, 1, COLOR, look | TextureUsages::COPY_SRC);
        Targets {
            width,
            height,
            shadow_size,
            color: whole(make("samples", full, SAMPLES, COLOR, draw)),
            depth: whole(make("depth", full, SAMPLES, DEPTH, draw)),
            picture: resolved.create_view(&TextureViewDescriptor::default()),
            shadow_layers: (0..MAX_SHADOWS as u32).map(|i| shadows.create_view(&layer(i))).collect(),
            shadow_array: shadows.create_view(&TextureViewDescriptor { dimension: Some(wgpu::TextureViewDimension::D2Array), ..Default::default() }),
            view_depth: whole(make("view depth", full, 1, DEPTH, look)),
            occlusion_raw: whole(make("occlusion raw", full, 1, OCCLUSION, look)),
            occlusion: whole(make("occlusion", full, 1, OCCLUSION, look)),
            white: whole(make("unused", (1, 1, 1), 1, OCCLUSION, look)),
            resolved,
            readback: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("readback"),
                size: u64::from(pitch(width)) * u64::from(height),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            }),
        }
    }

    pub fn fits(&self, width: u32, height: u32, shadow_size: u32) -> bool {
        (self.width, self.height, self.shadow_size) == (width, height, shadow_size)
    }

    /// Picture to buffer.
    pub fn copy_out(&self, encoder: &mut wgpu::CommandEncoder) {
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch(self.width)), rows_per_image: Some(self.height) };
        encoder.copy_texture_to_buffer(
            self.resolved.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &self.readback, layout },
            Extent3d { width: self.width, height: self.height, depth_or_array_layers: 1 },
        );
    }

    /// Buffer to memory; waits for the device.
    pub fn read(&self, gpu: &Gpu) -> Result<Image, RenderError> {
        let (tell, told) = std::sync::mpsc::channel();
        self.readback.map_async(wgpu::MapMode::Read, .., move |r| {
            let _ = tell.send(r); // the receiver waits below
        });
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| gpu.failed(e.to_string()))?;
        told.recv().map_err(|e| gpu.failed(e.to_string()))?.map_err(|e| gpu.failed(e.to_string()))?;
        let mut rgba = Vec::with_capacity(4 * self.width as usize * self.height as usize);
        {
            let bytes = self.readback.get_mapped_range(..).map_err(|e| gpu.failed(e.to_string()))?;
            for row in bytes.chunks_exact(pitch(self.width) as usize) {
                rgba.extend_from_slice(&row[..4 * self.width as usize]);
            }
        }
        self.readback.unmap();
        Ok(Image { width: self.width, height: self.height, rgba })
    }
}

/// Bytes per row in the buffer: wgpu wants a multiple of 256.
fn pitch(width: u32) -> u32 {
    (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

fn texture(device: &wgpu::Device, label: &str, size: Extent3d, sample_count: u32, format: TextureFormat, usage: TextureUsages) -> Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size,
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
