//! Data for the shaders, as flat numbers in the layout of the WGSL structs (all members are vec4 or
//! mat4x4).

use crate::list::debug::Stroke;
use crate::material::linear3;
use crate::{Capsule, Instance, Material, Part, Shader, SoftSphere, Sphere, SphereCloud};
use nalgebra::{Matrix2, Matrix3, Matrix4, Point3, Vector2, Vector3, Vector4};

/// Numbers per mesh instance, sphere, capsule and stroke.
pub const INSTANCE_FLOATS: u64 = 24;
pub const SPHERE_FLOATS: u64 = 20;
/// Texels that describe a sphere, of four words each.
pub const SPHERE_TEXELS: usize = 4;
/// Center, radius and index.
pub const SPHERE_WORDS: u64 = 5;
pub const CAPSULE_FLOATS: u64 = 24;
pub const STROKE_FLOATS: u64 = 16;

/// A viewpoint in the terms of the shaders' `struct View`; computed in f64, because distant scenes
/// suffer from cancellation.
pub struct Eye {
    pub clip_from_world: Matrix4<f64>,
    pub depth: [f64; 4],
    pub perspective: bool,
    origin: [Vector3<f64>; 3],
    dir: [Vector3<f64>; 3],
    /// Direction of view, of length 1.
    ahead: Vector3<f64>,
    per_pixel: f64,
    per_ndc: [f64; 2],
    size: [f64; 2],
    /// Index of the first pixel for dither, and the reach of occlusion in pixels.
    grid: [f64; 3],
}

impl Eye {
    /// Converts view and projection (depth 0 near, 1 far) for a picture of the given size in
    /// pixels.
    ///
    /// With `A` the upper left 2 x 2 of the projection, `o` its last column and `s` the view depth,
    /// a perspective point of the picture `n` sees `x(s) = A⁻¹(−o) + s A⁻¹(n + c)`, with `c` the
    /// third column; a parallel one sees `x(s) = A⁻¹(n − o) + s A⁻¹c`.
    pub fn new(view: &Matrix4<f64>, projection: &Matrix4<f64>, width: u32, height: u32) -> Self {
        let p = *projection;
        let perspective = p[(3, 3)] == 0.0;
        let inverse = p.fixed_view::<2, 2>(0, 0).try_inverse().unwrap_or(Matrix2::identity());
        let column = |j: usize| inverse * Vector2::new(p[(0, j)], p[(1, j)]);
        let (c, o) = (column(2), column(3));
        let rotation: Matrix3<f64> = view.fixed_view::<3, 3>(0, 0).transpose();
        let at = -(rotation * view.fixed_view::<3, 1>(0, 3));
        let plane = |v: Vector2<f64>| rotation * Vector3::new(v.x, v.y, 0.0);
        let (ex, ey) = (plane(inverse.column(0).into_owned()), plane(inverse.column(1).into_owned()));
        let forward = plane(c) - rotation.column(2);
        let none = Vector3::zeros();
        let (moving_origin, moving_dir) = if perspective { ([none; 2], [ex, ey]) } else { ([ex, ey], [none; 2]) };
        let mut reversed = p;
        reversed.set_row(2, &(p.row(3) - p.row(2)));
        let depth =
            if perspective { [1.0 + p[(2, 2)], -p[(2, 3)], 1.0, 0.0] } else { [p[(2, 2)], 1.0 - p[(2, 3)], 0.0, 1.0] };
        Eye {
            clip_from_world: reversed * view,
            depth,
            perspective,
            origin: [at - plane(o), moving_origin[0], moving_origin[1]],
            dir: [forward, moving_dir[0], moving_dir[1]],
            ahead: -rotation.column(2).into_owned(),
            per_ndc: [ex.norm(), ey.norm()],
            per_pixel: 2.0 * ey.norm() / f64::from(height),
            size: [f64::from(width), f64::from(height)],
            grid: [0.0, 0.0, 0.25 * f64::from(height)],
        }
    }

    /// Makes the viewpoint a part of a whole, with its own pixel indices and a rim that limits the
    /// reach of occlusion.
    pub fn numbered(mut self, part: &Part) -> Self {
        // far from 0, so that indices stay positive; a multiple of the noise tiles
        let number = |first: i32| f64::from((first - part.rim_px as i32 + 65_536).rem_euclid(131_072));
        self.grid =
            [number(part.first_pixel[0]), number(part.first_pixel[1]), f64::from(part.rim_px.saturating_sub(3))];
        self
    }

    /// Returns whether a sphere contains the eye, is close to it, or crosses the plane through it:
    /// its outline is then no ellipse in front of the eye.
    pub fn near_any<'a>(&self, mut spheres: impl Iterator<Item = &'a (Point3<f32>, f32)>) -> bool {
        let at: Vector3<f32> = self.origin[0].cast();
        let ahead: Vector3<f32> = self.clip_from_world.row(3).transpose().xyz().cast();
        let sides = self.sides();
        let beside = |c: &Point3<f32>, r: f32| {
            sides.iter().any(|side| side.dot(&c.cast().to_homogeneous()) < -1.001 * f64::from(r))
        };
        self.perspective
            && spheres.any(|(center, radius)| {
                let to = center.coords - at;
                // slightly more than the shaders' own bounds
                (to.norm_squared() < 2.1 * radius * radius
                    || (to.dot(&ahead).abs() < 3.0 * radius && to.norm() < 1e6 * radius))
                    && !beside(center, *radius)
            })
    }

    /// Rows of the map from the world to `(x, y, w)`: `x / w` and `y / w` are pixels from the left
    /// and from the top.
    pub fn pixel_rows(&self) -> [Vector4<f64>; 3] {
        let [x, y, w] = [0, 1, 3].map(|i| self.clip_from_world.row(i).transpose());
        [(w + x) * (0.5 * self.size[0]), (w - y) * (0.5 * self.size[1]), w]
    }

    /// Width and height, pixels.
    pub fn size_px(&self) -> [usize; 2] {
        self.size.map(|side| side as usize)
    }

    /// View depth of a place, m.
    pub fn view_depth(&self, place: &Vector3<f64>) -> f64 {
        (place - self.origin[0]).dot(&self.ahead)
    }

    /// Distance of a place from the eye, m; in a parallel view its depth.
    pub fn distance(&self, place: &Vector3<f64>) -> f64 {
        if self.perspective { (place - self.origin[0]).norm() } else { self.view_depth(place) }
    }

    /// Depth as it is drawn, 1 at the near plane and 0 at the far plane; `None` behind the eye.
    pub fn depth_at(&self, view_depth: f64) -> Option<f64> {
        let [x, y, z, w] = self.depth;
        (!self.perspective || view_depth > 0.0).then(|| (x * view_depth + y) / (z * view_depth + w))
    }

    /// Planes of the four sides of the picture, as rows whose product with a homogeneous point is
    /// its distance inside, m.
    pub fn sides(&self) -> [Vector4<f64>; 4] {
        let [x, y, w] = [0, 1, 3].map(|i| self.clip_from_world.row(i).transpose());
        [w + x, w - x, w + y, w - y].map(|side| side / side.xyz().norm().max(1e-300))
    }

    /// Sine of the angle between the direction of view and the direction to a place.
    pub fn sine_beside(&self, place: &Vector3<f64>) -> f64 {
        let to = if self.perspective { place - self.origin[0] } else { self.dir[0] };
        let cosine = to.dot(&self.ahead) / to.norm();
        (1.0 - cosine * cosine).max(0.0).sqrt()
    }

    /// Largest number of pixels that a meter covers at a depth.
    pub fn pixels_per_meter(&self, view_depth: f64) -> f64 {
        let [wide, high] = self.map_widths_per_meter();
        let depth = if self.perspective { view_depth.max(1e-9) } else { 1.0 };
        (wide * self.size[0]).max(high * self.size[1]) / depth
    }

    /// The largest coordinate of the eye.
    pub fn reach(&self) -> f64 {
        self.origin[0].amax()
    }

    /// Picture widths and heights that a meter across the view covers (at view depth 1, for
    /// perspective).
    pub fn map_widths_per_meter(&self) -> [f64; 2] {
        self.per_ndc.map(|meters| 0.5 / meters)
    }

    /// `struct View`.
    pub fn floats(&self) -> Vec<f32> {
        let mut out: Vec<f32> = self.clip_from_world.iter().map(|&x| x as f32).collect();
        for v in self.origin.iter().chain(&self.dir) {
            out.extend([v.x as f32, v.y as f32, v.z as f32, 0.0]);
        }
        out.extend(self.depth.map(|x| x as f32));
        let [w, h] = self.size;
        out.extend([w, h, 1.0 / w, 1.0 / h].map(|x| x as f32));
        let (slope, fixed) = if self.perspective { (self.per_pixel, 0.0) } else { (0.0, self.per_pixel) };
        out.extend([f32::from(u8::from(self.perspective)), slope as f32, fixed as f32, 0.0]);
        let [x, y, reach] = self.grid;
        out.extend([x as f32, y as f32, reach as f32, 0.0]);
        out
    }
}

/// A mesh instance: three rows of object to world, then the material. For a mesh with texture
/// coordinates the repeat is -1 m.
pub fn instance(x: &Instance, unwrapped: bool, out: &mut Vec<f32>) {
    let r = x.pose.rotation.to_rotation_matrix().into_inner() * Matrix3::from_diagonal(&x.scale);
    for i in 0..3 {
        out.extend([r[(i, 0)], r[(i, 1)], r[(i, 2)], x.pose.translation.vector[i]]);
    }
    material(&x.material, if unwrapped { -1.0 } else { x.material.texture.map_or(0.0, |t| t.repeat_m) }, out);
}

/// A sphere as bits: center and radius; colors, roughness and metallic as fractions of 65,535, two
/// per word; orientation; clear coat, repeat of the texture and sizes. Members that all surfaces
/// read come first.
pub fn sphere(s: &Sphere, out: &mut Vec<u32>) {
    let (c, q, m) = (s.center, s.orientation.coords, &s.material);
    let (_, other, size) = m.pattern.packed();
    let ([r, g, b], [or, og, ob]) = (linear3(m.color), linear3(other));
    out.extend([c.x, c.y, c.z, s.radius].map(f32::to_bits));
    out.extend([pair(r, g), pair(b, m.roughness), pair(or, og), pair(ob, m.metallic)]);
    // the texture goes once around a sphere
    out.extend([q.x, q.y, q.z, q.w, m.clearcoat, 0.0, size[0], size[1]].map(f32::to_bits));
}

/// Two fractions in one word.
fn pair(low: f32, high: f32) -> u32 {
    let [low, high] = [low, high].map(|x| (x.clamp(0.0, 1.0) * 65_535.0).round() as u32);
    high << 16 | low
}

/// The spheres of a cloud as [`sphere`]: their appearance is computed once.
pub fn cloud(cloud: &SphereCloud, out: &mut Vec<u32>) {
    let Some(first) = cloud.each().next() else { return };
    let mut words = Vec::with_capacity(4 * SPHERE_TEXELS);
    sphere(&first, &mut words);
    for (i, (center, radius)) in cloud.spheres.iter().enumerate() {
        words[..4].copy_from_slice(&[center.x, center.y, center.z, *radius].map(f32::to_bits));
        if let Some(color) = cloud.colors.get(i) {
            let [r, g, b] = linear3(*color);
            words[4..6].copy_from_slice(&[pair(r, g), pair(b, cloud.material.roughness)]);
        }
        out.extend_from_slice(&words);
    }
}

/// A sphere as numbers: center and radius, orientation, material.
pub fn sphere_floats(s: &Sphere, out: &mut Vec<f32>) {
    let (c, q) = (s.center, s.orientation.coords);
    out.extend([c.x, c.y, c.z, s.radius, q.x, q.y, q.z, q.w]);
    // the texture goes once around a sphere
    material(&s.material, 0.0, out);
}

/// A capsule: center and radius, orientation, material, half length. Its texture is projected by
/// position.
pub fn capsule(c: &Capsule, out: &mut Vec<f32>) {
    let (t, q) = (c.pose.translation.vector, c.pose.rotation.coords);
    out.extend([t.x, t.y, t.z, c.radius, q.x, q.y, q.z, q.w]);
    material(&c.material, c.material.texture.map_or(0.0, |t| t.repeat_m), out);
    out.extend([0.5 * c.length, 0.0, 0.0, 0.0]);
}

/// A translucent sphere; its opacity replaces the roughness.
pub fn shell(s: &crate::DebugSphere, out: &mut Vec<f32>) {
    let [r, g, b] = linear3(s.style.color);
    out.extend([s.center.x, s.center.y, s.center.z, s.radius, 0.0, 0.0, 0.0, 1.0]);
    out.extend([r, g, b, s.style.opacity]);
    out.extend([0.0; 8]);
}

/// A soft sphere; its opacity replaces the roughness, and the other color says whether it is lit.
pub fn soft(s: &SoftSphere, out: &mut Vec<f32>) {
    let [r, g, b] = linear3(s.color);
    out.extend([s.center.x, s.center.y, s.center.z, s.radius, 0.0, 0.0, 0.0, 1.0]);
    out.extend([r, g, b, s.opacity, f32::from(u8::from(s.shader == Shader::Lit))]);
    out.extend([0.0; 7]);
}

/// A stroke: ends with widths, color, kind.
pub fn stroke(s: &Stroke, out: &mut Vec<f32>) {
    let [r, g, b] = linear3(s.style.color);
    out.extend([s.start.x, s.start.y, s.start.z, s.start_px, s.end.x, s.end.y, s.end.z, s.end_px]);
    out.extend([r, g, b, s.style.opacity, f32::from(u8::from(s.round)), 0.0, 0.0, 0.0]);
}

fn material(m: &Material, repeat_m: f32, out: &mut Vec<f32>) {
    let (_, other, size) = m.pattern.packed();
    let ([r, g, b], [or, og, ob]) = (linear3(m.color), linear3(other));
    out.extend([r, g, b, m.roughness, or, og, ob, m.metallic, m.clearcoat, repeat_m, size[0], size[1]]);
}
