//! Pictures on their way to memory: the copy is begun when the picture is drawn, and waited for in any
//! thread, while the device draws others.

use super::Gpu;
use super::targets::PATIENCE;
use crate::{Image, RenderError};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};
use wgpu::{Buffer, BufferAsyncError, Device, Extent3d, SubmissionIndex, Texture};

/// Largest number of buffers that are kept for further pictures.
const MAX_KEPT: usize = 16;

/// Buffers that no picture uses.
#[derive(Clone, Default)]
pub(super) struct Readbacks(Arc<Mutex<Vec<Buffer>>>);

impl Readbacks {
    fn take(&self, device: &Device, size: u64) -> Buffer {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match kept.iter().position(|buffer| buffer.size() == size) {
            Some(k) => kept.swap_remove(k),
            None => device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("readback"),
                size,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            }),
        }
    }

    fn give(&self, buffer: Buffer) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() >= MAX_KEPT {
            kept.remove(0);
        }
        kept.push(buffer);
    }
}

/// A picture whose copy to memory has begun ([`crate::Renderer::begin_read`]).
pub struct Reading {
    device: Device,
    adapter: String,
    size_px: [u32; 2],
    buffer: Buffer,
    submission: SubmissionIndex,
    mapped: Receiver<Result<(), BufferAsyncError>>,
    readbacks: Readbacks,
}

impl Reading {
    /// Submits the copy of a picture with everything recorded before.
    pub(super) fn begin(gpu: &Gpu, readbacks: &Readbacks, from: &Texture) -> Reading {
        let (width, height) = (from.width(), from.height());
        let buffer = readbacks.take(&gpu.device, u64::from(pitch(width)) * u64::from(height));
        let mut encoder =
            gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("readback") });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch(width)), rows_per_image: Some(height) };
        encoder.copy_texture_to_buffer(
            from.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            Extent3d { width, height, depth_or_array_layers: 1 },
        );
        gpu.record(encoder.finish());
        let submission = gpu.submit();
        let (sender, mapped) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |outcome| {
            let _ = sender.send(outcome); // nobody waits for a picture that is not wanted any more
        });
        Reading {
            device: gpu.device.clone(),
            adapter: gpu.adapter.clone(),
            size_px: [width, height],
            buffer,
            submission,
            mapped,
            readbacks: readbacks.clone(),
        }
    }

    /// Waits until the device has drawn and copied the picture.
    ///
    /// # Errors
    /// A device that is lost or hangs.
    pub fn wait(&self) -> Result<(), RenderError> {
        let wait = wgpu::PollType::Wait { submission_index: Some(self.submission.clone()), timeout: Some(PATIENCE) };
        self.device.poll(wait).map(drop).map_err(|e| self.failed(e.to_string()))
    }

    fn failed(&self, reason: String) -> RenderError {
        RenderError::Device { adapter: self.adapter.clone(), reason }
    }

    /// Waits for the picture and returns it.
    ///
    /// # Errors
    /// A device that fails, is lost, or hangs.
    pub fn finish(self) -> Result<Image, RenderError> {
        self.wait()?;
        let failed = |reason: String| self.failed(reason);
        // another thread that polls may be about to report it
        self.mapped.recv_timeout(PATIENCE).map_err(|e| failed(e.to_string()))?.map_err(|e| failed(e.to_string()))?;
        let [width, height] = self.size_px;
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        {
            let bytes = self.buffer.get_mapped_range(..).map_err(|e| failed(e.to_string()))?;
            for row in bytes.chunks_exact(pitch(width) as usize) {
                rgba.extend_from_slice(&row[..4 * width as usize]);
            }
        }
        self.buffer.unmap();
        self.readbacks.give(self.buffer);
        Ok(Image { width, height, rgba })
    }
}

/// Bytes per row in the buffer: wgpu needs a multiple of 256.
fn pitch(width: u32) -> u32 {
    (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}
