//! The spheres of a stage: their appearance, and the selection for a viewpoint.

use super::Gpu;
use super::cull::{PixelBox, SphereBounds, visible};
use super::data::{self, Eye};
use super::stage::{Same, cloud_groups, group_items};
use crate::{DrawList, RenderError};
use std::ops::Range;
use wgpu::{Buffer, BufferUsages, TextureView};

/// All spheres of a list, by surface.
pub struct Spheres {
    pub groups: Vec<Same>,
    spheres: Vec<SphereBounds>,
    /// Four texels per sphere, 256 spheres per row.
    pub appearances: TextureView,
    /// First and last index of the spheres of each group.
    pub ranges: Buffer,
    /// All spheres, if viewpoints do not select among them.
    whole: Option<Buffer>,
    samples: u32,
}

/// The spheres that a viewpoint draws.
pub struct Choice {
    /// Center, radius and index of each.
    pub spheres: Buffer,
    /// Ranges in `spheres`, one for each group.
    pub ranges: Vec<Range<u32>>,
    /// For each group all pixels that its spheres may have.
    pub boxes: Vec<PixelBox>,
    /// All pixels.
    pub picture: PixelBox,
    /// Whether a sphere is so near to the eye that its outline is no circle on a plane in front of
    /// it.
    pub near: bool,
}

/// A subset of the spheres.
#[derive(Clone, Copy, PartialEq)]
pub enum Which {
    All,
    /// Shadow casters.
    Casters,
}

impl Spheres {
    pub(super) fn new(gpu: &Gpu, list: &DrawList) -> Result<Self, RenderError> {
        let (mut groups, order) = group_items(&list.spheres, |s| (&s.material, s.casts_shadow));
        groups.extend(cloud_groups(list));
        let mut spheres: Vec<SphereBounds> = Vec::with_capacity(list.sphere_count());
        spheres.extend(order.iter().map(|&i| (list.spheres[i].center, list.spheres[i].radius)));
        list.clouds.iter().for_each(|cloud| spheres.extend(&cloud.spheres));
        let ranges: Vec<u32> = groups.iter().flat_map(|g| [g.all.start, g.all.end]).collect();
        let whole = if gpu.choosy || spheres.is_empty() {
            None
        } else {
            Some(sphere_buffer(gpu, &spheres, 0..spheres.len() as u32)?)
        };
        Ok(Spheres {
            appearances: appearances(gpu, list, &order)?,
            ranges: super::meshes::buffer(gpu, bytemuck::cast_slice(&ranges), BufferUsages::VERTEX, "sphere groups")?,
            samples: list.settings.samples,
            whole,
            groups,
            spheres,
        })
    }

    /// Selects the spheres for a viewpoint: all, or with a software driver those that may be
    /// visible.
    pub(super) fn choose(&self, gpu: &Gpu, eye: &Eye, which: Which) -> Result<Choice, RenderError> {
        let of = |same: &Same| if which == Which::All { same.all.clone() } else { same.casters.clone() };
        if let Some(whole) = &self.whole {
            return Ok(Choice {
                spheres: whole.clone(),
                ranges: self.groups.iter().map(of).collect(),
                boxes: vec![PixelBox::whole(eye); self.groups.len()],
                picture: PixelBox::whole(eye),
                near: eye.near_any(self.spheres.iter()),
            });
        }
        let samples = if which == Which::All { self.samples } else { 1 };
        let chosen = visible(&self.spheres, self.groups.iter().map(of), eye, samples);
        let place = |number: u32| chosen.partition_point(|seen| seen.number < number);
        let ranges: Vec<Range<usize>> =
            self.groups.iter().map(of).map(|range| place(range.start)..place(range.end)).collect();
        let none = PixelBox { from: [0; 2], to: [0; 2] };
        let boxed = |range: &Range<usize>| {
            chosen[range.clone()].iter().map(|seen| seen.pixels).reduce(PixelBox::with).unwrap_or(none)
        };
        let near = eye.near_any(chosen.iter().map(|seen| &self.spheres[seen.number as usize]));
        Ok(Choice {
            spheres: sphere_buffer(gpu, &self.spheres, chosen.iter().map(|seen| seen.number))?,
            boxes: ranges.iter().map(boxed).collect(),
            ranges: ranges.into_iter().map(|range| range.start as u32..range.end as u32).collect(),
            picture: PixelBox::whole(eye),
            near,
        })
    }
}

fn sphere_buffer(
    gpu: &Gpu,
    spheres: &[SphereBounds],
    numbers: impl Iterator<Item = u32>,
) -> Result<Buffer, RenderError> {
    let mut words: Vec<u32> = Vec::with_capacity(data::SPHERE_WORDS as usize * spheres.len());
    for number in numbers {
        let (center, radius) = spheres[number as usize];
        words.extend([center.x.to_bits(), center.y.to_bits(), center.z.to_bits(), radius.to_bits(), number]);
    }
    super::meshes::buffer(gpu, bytemuck::cast_slice(&words), BufferUsages::VERTEX, "spheres")
}

fn appearances(gpu: &Gpu, list: &DrawList, order: &[usize]) -> Result<TextureView, RenderError> {
    let row = 256 * 4 * data::SPHERE_TEXELS;
    let count = list.sphere_count();
    let rows = count.div_ceil(256).max(1);
    let most = gpu.device.limits().max_texture_dimension_2d as usize;
    if rows > most {
        return Err(RenderError::TooMany { what: "spheres", count, cap: 256 * most });
    }
    let mut words = Vec::with_capacity(rows * row);
    order.iter().for_each(|&i| data::sphere(&list.spheres[i], &mut words));
    list.clouds.iter().for_each(|cloud| data::cloud(cloud, &mut words));
    words.resize(rows * row, 0);
    Ok(super::finish::upload(
        gpu,
        [row as u32 / 4, rows as u32],
        wgpu::TextureFormat::Rgba32Uint,
        bytemuck::cast_slice(&words),
    ))
}
