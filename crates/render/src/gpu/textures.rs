//! Textures on the device, uploaded once with mipmaps for distant surfaces.

use super::Gpu;
use super::frame::bind;
use crate::facet::encoded;
use crate::material::linear;
use crate::{Image, RenderError};
use std::sync::Arc;
use wgpu::util::{DeviceExt, TextureDataOrder};
use wgpu::{BindGroup, BindGroupLayout, BindingResource, TextureFormat};

/// Textures on the device, identified by their `Arc`, and freed when a list no longer contains
/// them.
pub struct TextureCache {
    sampler: wgpu::Sampler,
    /// Binding of surfaces without a texture.
    pub white: BindGroup,
    known: Vec<(Arc<Image>, BindGroup)>,
}

impl TextureCache {
    pub(super) fn new(gpu: &Gpu, layout: &BindGroupLayout) -> Self {
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("texture"),
            address_mode_u: wgpu::AddressMode::Repeat,
            address_mode_v: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            ..Default::default()
        });
        let white = send(gpu, layout, &sampler, &Image { width: 1, height: 1, rgba: vec![255; 4] });
        TextureCache { sampler, white, known: Vec::new() }
    }

    /// Returns the bindings for the textures of a list, in its order.
    pub(super) fn sync(
        &mut self,
        gpu: &Gpu,
        layout: &BindGroupLayout,
        textures: &[Arc<Image>],
    ) -> Result<Vec<BindGroup>, RenderError> {
        let most = gpu.device.limits().max_texture_dimension_2d;
        let mut kept = Vec::with_capacity(textures.len());
        for image in textures {
            let fits = |side: u32| (1..=most).contains(&side);
            if !fits(image.width)
                || !fits(image.height)
                || image.rgba.len() != 4 * image.width as usize * image.height as usize
            {
                return Err(RenderError::BadSize {
                    width: image.width,
                    height: image.height,
                    max_side: most,
                    max_pixels: u64::from(most) * u64::from(most),
                });
            }
            let known = self.known.iter().find(|(known, _)| Arc::ptr_eq(known, image)).map(|(_, group)| group.clone());
            kept.push((image.clone(), known.unwrap_or_else(|| send(gpu, layout, &self.sampler, image))));
        }
        self.known = kept;
        Ok(self.known.iter().map(|(_, group)| group.clone()).collect())
    }
}

fn send(gpu: &Gpu, layout: &BindGroupLayout, sampler: &wgpu::Sampler, image: &Image) -> BindGroup {
    let mut levels = vec![image.clone()];
    while let Some(half) = levels.last().and_then(half) {
        levels.push(half);
    }
    let descriptor = wgpu::TextureDescriptor {
        label: Some("texture"),
        size: wgpu::Extent3d { width: image.width, height: image.height, depth_or_array_layers: 1 },
        mip_level_count: levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let bytes: Vec<u8> = levels.into_iter().flat_map(|level| level.rgba).collect();
    let texture = gpu.device.create_texture_with_data(&gpu.queue, &descriptor, TextureDataOrder::LayerMajor, &bytes);
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    bind(gpu, layout, &[BindingResource::TextureView(&view), BindingResource::Sampler(sampler)])
}

/// Halves width and height by averaging in linear light; returns `None` for a single pixel.
fn half(image: &Image) -> Option<Image> {
    let (w, h) = (image.width as usize, image.height as usize);
    if w == 1 && h == 1 {
        return None;
    }
    let (width, height) = ((w / 2).max(1), (h / 2).max(1));
    let light =
        |x: usize, y: usize, k: usize| linear(f32::from(image.rgba[4 * (y.min(h - 1) * w + x.min(w - 1)) + k]) / 255.0);
    let mut rgba = Vec::with_capacity(4 * width * height);
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let mean = |k: usize| {
            [(0, 0), (1, 0), (0, 1), (1, 1)].iter().map(|(i, j)| light(2 * x + i, 2 * y + j, k)).sum::<f32>() / 4.0
        };
        rgba.extend([encoded(mean(0)), encoded(mean(1)), encoded(mean(2)), 255]);
    }
    Some(Image { width: width as u32, height: height as u32, rgba })
}
