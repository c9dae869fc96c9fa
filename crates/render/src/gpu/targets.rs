//! The textures that are drawn into.

use super::Gpu;
use super::pipelines::{COLOR, DEPTH, ID, OCCLUSION};
use crate::RenderError;
use wgpu::{Extent3d, Texture, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor};

/// Longest time for a picture; after it the device counts as hung.
pub(super) const PATIENCE: std::time::Duration = std::time::Duration::from_secs(600);

const DRAW: TextureUsages = TextureUsages::RENDER_ATTACHMENT;
const LOOK: TextureUsages = DRAW.union(TextureUsages::TEXTURE_BINDING);

/// All targets for one picture size and number of samples.
pub struct Targets {
    pub width: u32,
    pub height: u32,
    /// Color and depth with several samples per pixel; `None` with one.
    pub samples: Option<(TextureView, TextureView)>,
    pub picture: TextureView,
    pub view_depth: TextureView,
    /// Index of the nearest sphere; a single pixel if there are several samples.
    pub ids: TextureView,
    pub occlusion_raw: TextureView,
    pub occlusion: TextureView,
    pub white: TextureView,
    pub resolved: Texture,
}

impl Targets {
    pub fn new(gpu: &Gpu, width: u32, height: u32, samples: u32) -> Self {
        let device = &gpu.device;
        let make = |label, samples, format, usage| texture(device, label, [width, height, 1], samples, format, usage);
        let resolved = finished_texture_for(gpu, "picture", width, height);
        Targets {
            width,
            height,
            samples: (samples > 1)
                .then(|| (whole(make("samples", samples, COLOR, DRAW)), whole(make("depth", samples, DEPTH, DRAW)))),
            picture: resolved.create_view(&TextureViewDescriptor::default()),
            view_depth: whole(make("view depth", 1, DEPTH, LOOK)),
            ids: whole(texture(device, "ids", if samples > 1 { [1, 1, 1] } else { [width, height, 1] }, 1, ID, LOOK)),
            occlusion_raw: whole(make("occlusion raw", 1, OCCLUSION, LOOK)),
            occlusion: whole(make("occlusion", 1, OCCLUSION, LOOK)),
            white: whole(texture(device, "unused", [1, 1, 1], 1, OCCLUSION, LOOK)),
            resolved,
        }
    }

    pub fn fits(&self, width: u32, height: u32, samples: u32) -> bool {
        (self.width, self.height, self.samples.is_some()) == (width, height, samples > 1)
    }

    /// Number of pixels of a picture.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// Largest number of shadow maps: one per light, six for a lamp inside the box of the shadow
/// casters.
pub const MAX_LAYERS: usize = 12;

/// The maps of the lights that cast shadows.
pub struct ShadowMaps {
    pub size: u32,
    pub layers: Vec<TextureView>,
    pub array: TextureView,
    /// The stage whose shadows they hold.
    pub drawn: u64,
}

impl ShadowMaps {
    /// Without shadows, a texel that nobody reads is bound.
    pub fn new(gpu: &Gpu, size: u32, count: usize) -> Self {
        let size = if count == 0 { 1 } else { size };
        let count = count.clamp(1, MAX_LAYERS) as u32;
        // OpenGL treats one layer as no array, and a multiple of six as a cube
        let spare = u32::from(gpu.opengl && (count == 1 || count.is_multiple_of(6)));
        let maps = texture(&gpu.device, "shadow maps", [size, size, count + spare], 1, DEPTH, LOOK);
        let layer = |i| TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_array_layer: i,
            array_layer_count: Some(1),
            ..Default::default()
        };
        ShadowMaps {
            size,
            layers: (0..count).map(|i| maps.create_view(&layer(i))).collect(),
            array: maps.create_view(&TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            drawn: 0,
        }
    }

    pub fn fits(&self, size: u32, count: usize) -> bool {
        count == 0 || self.size == size && self.layers.len() >= count
    }
}

/// Creates a texture for finished pictures: drawn into, copied from and to, shown by a window.
pub fn finished_texture(device: &wgpu::Device, label: &str, width: u32, height: u32) -> Texture {
    texture(device, label, [width, height, 1], 1, COLOR, LOOK | TextureUsages::COPY_SRC | TextureUsages::COPY_DST)
}

/// The same, also for the views by which [`Enlarger`](super::enlarge::Enlarger) mixes colors.
pub fn finished_texture_for(gpu: &Gpu, label: &str, width: u32, height: u32) -> Texture {
    let mixed = [super::enlarge::mixed_format(gpu)];
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: COLOR,
        usage: LOOK | TextureUsages::COPY_SRC | TextureUsages::COPY_DST,
        view_formats: if mixed == [COLOR] { &[] } else { &mixed },
    })
}

/// Waits until all submitted work is done.
pub fn wait(gpu: &Gpu) -> Result<(), RenderError> {
    wait_for(gpu, None)
}

/// Waits until this submission is done, or all are.
pub fn wait_for(gpu: &Gpu, submission_index: Option<wgpu::SubmissionIndex>) -> Result<(), RenderError> {
    let done = gpu.device.poll(wgpu::PollType::Wait { submission_index, timeout: Some(PATIENCE) });
    gpu.complaint()?;
    done.map(drop).map_err(|e| gpu.failed(e.to_string()))
}

fn whole(t: Texture) -> TextureView {
    t.create_view(&TextureViewDescriptor::default())
}

fn texture(
    device: &wgpu::Device,
    label: &str,
    [width, height, layers]: [u32; 3],
    sample_count: u32,
    format: TextureFormat,
    usage: TextureUsages,
) -> Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
