//! Photographs that were never taken: rooms, projectors and cameras with faults, drawn by rays. Shares no
//! code with what is tested. Lenses have a term that the fit does not have: `r⁸`.

use nalgebra::{Point3, Rotation3, Vector3};
use tumble_calibrate::{Decoded, Decoder, Mark, Pattern, Photo, View};

/// A surface of the real room.
pub enum Real {
    /// Lower left corner, lower and left edge.
    Rectangle(Point3<f64>, Vector3<f64>, Vector3<f64>),
    /// Center, radius, and the directions within an angle of an axis.
    Dome(Point3<f64>, f64, Vector3<f64>, f64),
}

impl Real {
    fn hit(&self, from: Point3<f64>, ray: Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        match self {
            Real::Rectangle(a, u, v) => {
                let n = u.cross(v).normalize();
                let t = (a - from).dot(&n) / ray.dot(&n);
                let d = from + ray * t - a;
                let (s, r) = (d.dot(u) / u.norm_squared(), d.dot(v) / v.norm_squared());
                (t > 0.0 && ray.dot(&n) < 0.0 && [s, r].iter().all(|x| (0.0..=1.0).contains(x))).then_some((t, n))
            }
            Real::Dome(center, radius, axis, half) => {
                let o = from - center;
                let (b, c) = (o.dot(&ray) / ray.norm(), o.norm_squared() - radius * radius);
                let t = ((b * b - c).sqrt() - b) / ray.norm();
                let out = (from + ray * t - center) / *radius;
                (out.dot(axis) >= half.cos()).then_some((t, -out))
            }
        }
    }
}

/// Position and axes of a lens: right, down, ahead.
#[derive(Clone, Copy)]
pub struct Stand {
    pub position: Point3<f64>,
    pub axes: [Vector3<f64>; 3],
}

impl Stand {
    /// Looks at a point, then rolls about the line of sight.
    pub fn towards(position: [f64; 3], target: [f64; 3], roll_deg: f64) -> Stand {
        let (position, target) = (Point3::from(position), Point3::from(target));
        let ahead = (target - position).normalize();
        let up = if ahead.z.abs() > 0.95 { Vector3::y() } else { Vector3::z() };
        let right = ahead.cross(&up).normalize();
        let roll = Rotation3::new(ahead * roll_deg.to_radians());
        Stand { position, axes: [roll * right, roll * ahead.cross(&right), ahead] }
    }

    fn local(&self, p: Point3<f64>) -> Vector3<f64> {
        let d = p - self.position;
        Vector3::new(self.axes[0].dot(&d), self.axes[1].dot(&d), self.axes[2].dot(&d))
    }

    fn outward(&self, d: Vector3<f64>) -> Vector3<f64> {
        self.axes[0] * d.x + self.axes[1] * d.y + self.axes[2] * d.z
    }
}

/// Distortion with the eighth power of the radius.
const EIGHTH: f64 = -5e-4;

/// A pinhole with distortion from the ray to the pixel.
#[derive(Clone, Copy)]
pub struct Lens {
    pub size: [u32; 2],
    pub focal: f64,
    pub center: [f64; 2],
    /// k₁, k₂, t₁, t₂
    pub k: [f64; 4],
}

impl Lens {
    fn bent(&self, x: f64, y: f64) -> [f64; 2] {
        let ([k1, k2, t1, t2], r) = (self.k, x * x + y * y);
        let s = 1.0 + r * (k1 + r * (k2 + r * r * EIGHTH));
        [x * s + 2.0 * t1 * x * y + t2 * (r + 2.0 * x * x), y * s + t1 * (r + 2.0 * y * y) + 2.0 * t2 * x * y]
    }

    pub fn pixel(&self, local: Vector3<f64>) -> [f64; 2] {
        let [x, y] = self.bent(local.x / local.z, local.y / local.z);
        [self.center[0] + self.focal * x, self.center[1] + self.focal * y]
    }

    pub fn ray(&self, pixel: [f64; 2]) -> Vector3<f64> {
        let wanted = [0, 1].map(|k| (pixel[k] - self.center[k]) / self.focal);
        let mut at = wanted;
        for _ in 0..15 {
            let there = self.bent(at[0], at[1]);
            at = [0, 1].map(|k| at[k] + wanted[k] - there[k]);
        }
        Vector3::new(at[0], at[1], 1.0)
    }
}

pub struct Room {
    pub surfaces: Vec<Real>,
    pub projectors: Vec<(Stand, Lens)>,
    pub camera: Lens,
}

/// Faults of photographs.
#[derive(Clone, Copy)]
pub struct Faults {
    /// Standard deviation, codes of 255.
    pub noise: f64,
    /// Standard deviation of the blur, pixels of the camera.
    pub blur: f64,
    /// Light of the room, a share of a projector's white.
    pub ambient: f64,
    /// Light that comes by way of the other walls, a share of the mean light.
    pub bounce: f64,
    /// A highlight brighter than the camera shows: middle in shares of the photograph, radius, pixels.
    pub glare: Option<([f64; 2], f64)>,
    /// Standard deviation of marks, pixels of the camera.
    pub marks: f64,
}

pub const FAULTS: Faults =
    Faults { noise: 1.5, blur: 0.8, ambient: 0.03, bounce: 0.1, glare: Some(([0.4, 0.45], 30.0)), marks: 0.3 };

/// Numbers of a normal distribution.
pub struct Normal(u64);

impl Normal {
    pub fn new(seed: u64) -> Normal {
        Normal(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn next(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

impl Room {
    pub fn first(&self, from: Point3<f64>, ray: Vector3<f64>) -> Option<(Point3<f64>, Vector3<f64>)> {
        let hits = self.surfaces.iter().filter_map(|s| s.hit(from, ray));
        hits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(t, n)| (from + ray * t, n))
    }

    /// Returns the point that a place of a projector lights.
    pub fn lit(&self, projector: usize, place: [f64; 2]) -> Option<Point3<f64>> {
        let (stand, lens) = &self.projectors[projector];
        self.first(stand.position, stand.outward(lens.ray(place))).map(|(p, _)| p)
    }

    /// Returns the place of a projector that lights a point, and how much light is there.
    fn lights(&self, projector: usize, (point, normal): (Point3<f64>, Vector3<f64>)) -> Option<([f64; 2], f64)> {
        let (stand, lens) = &self.projectors[projector];
        let local = stand.local(point);
        if local.z <= 0.0 {
            return None;
        }
        let place = lens.pixel(local);
        let inside = (0..2).all(|k| (0.0..f64::from(lens.size[k])).contains(&place[k]));
        let d = point - stand.position;
        let seen = inside && self.first(stand.position, d).is_some_and(|(p, _)| (p - point).norm() < 1e-6);
        seen.then(|| (place, -normal.dot(&d.normalize()) / d.norm_squared()))
    }

    /// The view of the camera: four samples for each pixel, point and normal.
    pub fn look(&self, eye: &Stand) -> Vec<Option<(Point3<f64>, Vector3<f64>)>> {
        let [w, h] = self.camera.size;
        let quarters = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
        let pixels = (0..h).flat_map(|y| (0..w).map(move |x| (f64::from(x), f64::from(y))));
        pixels
            .flat_map(|(x, y)| quarters.map(|(a, b)| [x + a, y + b]))
            .map(|pixel| self.first(eye.position, eye.outward(self.camera.ray(pixel))))
            .collect()
    }

    /// Photographs all patterns of a projector and decodes them.
    pub fn photograph(
        &self,
        look: &[Option<(Point3<f64>, Vector3<f64>)>],
        projector: usize,
        faults: &Faults,
        seed: u64,
    ) -> Result<Decoded, String> {
        let mut decoder = Decoder::new(self.projectors[projector].1.size);
        let scene = Seen::new(self, look, projector);
        let mut normal = Normal::new(seed);
        let noise: Vec<f64> = (0..1 << 16).map(|_| faults.noise / 255.0 * normal.next()).collect();
        while let Some(pattern) = decoder.expected() {
            let start = (normal.uniform() * f64::from(1 << 16)) as usize;
            decoder.add(scene.photo(pattern, faults, &noise, start))?;
        }
        decoder.finish()
    }

    /// Photographs all projectors from one place, with marks at points that are in the picture.
    pub fn view(&self, name: &str, eye: &Stand, points: &[[f64; 3]], faults: &Faults, seed: u64) -> View {
        let mut normal = Normal::new(seed + 77);
        let [w, h] = self.camera.size.map(f64::from);
        let mut marks = Vec::new();
        for point in points {
            let local = eye.local(Point3::from(*point));
            let pixel = self.camera.pixel(local);
            if local.z > 0.0 && (0.0..w).contains(&pixel[0]) && (0.0..h).contains(&pixel[1]) {
                let pixel = pixel.map(|p| p + faults.marks * normal.next());
                marks.push(Mark { point_m: *point, pixel, sigma_px: faults.marks.max(0.1) });
            }
        }
        let look = self.look(eye);
        let decoded = (0..self.projectors.len())
            .map(|p| {
                let decoded = self.photograph(&look, p, faults, seed + p as u64).unwrap();
                (decoded.count() > 300).then_some(decoded)
            })
            .collect();
        View { name: name.into(), size_px: self.camera.size, marks, decoded }
    }
}

/// The view of one projector by the camera.
struct Seen {
    size: [u32; 2],
    projector: [u32; 2],
    /// Four for each pixel: place in the projector and light; light 0 for none.
    samples: Vec<([f32; 2], f32)>,
    /// Share of a pixel that shows the room.
    walls: Vec<f32>,
}

impl Seen {
    fn new(room: &Room, look: &[Option<(Point3<f64>, Vector3<f64>)>], projector: usize) -> Seen {
        let sample = |hit: &Option<(Point3<f64>, Vector3<f64>)>| {
            let lit = hit.and_then(|hit| room.lights(projector, hit));
            lit.map_or(([0.0; 2], 0.0), |(place, light)| (place.map(|p| p as f32), light as f32))
        };
        let mut samples: Vec<([f32; 2], f32)> = look.iter().map(sample).collect();
        let walls = look.chunks_exact(4).map(|four| four.iter().flatten().count() as f32 / 4.0).collect();
        // exposed so that the brightest tenth of what is lit is at 0.8
        let mut lights: Vec<f32> = samples.iter().map(|s| s.1).filter(|l| *l > 0.0).collect();
        lights.sort_by(f32::total_cmp);
        let bright = lights.get(lights.len() * 9 / 10).copied().unwrap_or(1.0);
        samples.iter_mut().for_each(|s| s.1 *= 0.8 / bright / 4.0);
        Seen { size: room.camera.size, projector: room.projectors[projector].1.size, samples, walls }
    }

    fn photo(&self, pattern: Pattern, faults: &Faults, noise: &[f64], start: usize) -> Photo {
        // the projector's transfer curve is not the camera's; patterns depend on one axis
        let axis = usize::from(matches!(pattern, Pattern::Bit { axis: 1, .. } | Pattern::Shift { axis: 1, .. }));
        let level = |i: u32| pattern.level([f64::from(i) + 0.5; 2]).powf(2.4) as f32;
        let levels: Vec<f32> = (0..self.projector[axis]).map(level).collect();
        let mean = levels.iter().sum::<f32>() / levels.len() as f32;
        // the projector's lens spreads a pixel as far as the middles of its neighbors
        let at = |place: f32| {
            let from = (place - 0.5).clamp(0.0, (levels.len() - 1) as f32);
            let (i, f) = (from as usize, from.fract());
            levels[i] * (1.0 - f) + levels[(i + 1).min(levels.len() - 1)] * f
        };
        let of = |s: &([f32; 2], f32)| if s.1 > 0.0 { s.1 * at(s.0[axis]) } else { 0.0 };
        let lit: Vec<f32> = self.samples.chunks_exact(4).map(|four| four.iter().map(of).sum()).collect();
        let share = self.samples.iter().filter(|s| s.1 > 0.0).count() as f32 / self.samples.len() as f32;
        let around = faults.ambient as f32 + 0.8 * faults.bounce as f32 * mean * share;
        let (w, h) = (self.size[0] as usize, self.size[1] as usize);
        let mut light: Vec<f32> = lit.iter().zip(&self.walls).map(|(l, wall)| l + wall * around).collect();
        if let Some((middle, radius)) = faults.glare {
            for (i, light) in light.iter_mut().enumerate() {
                let (x, y) = ((i % w) as f64 - middle[0] * w as f64, (i / w) as f64 - middle[1] * h as f64);
                *light += (1.2 * mean) * (-(x * x + y * y) / (radius * radius)).exp() as f32;
            }
        }
        let light = blurred(&light, w, h, faults.blur);
        let curve: Vec<f64> = (0..=4096).map(|i| (f64::from(i) / 4096.0).powf(1.0 / 2.2)).collect();
        let encoded = |light: f32| {
            let from = 4096.0 * f64::from(light.clamp(0.0, 0.9999));
            let i = from as usize;
            // the curve is steep near black
            if i < 16 { (from / 4096.0).powf(1.0 / 2.2) } else { curve[i] + (curve[i + 1] - curve[i]) * from.fract() }
        };
        let codes: Vec<f32> = light
            .iter()
            .enumerate()
            .map(|(i, l)| {
                let code = encoded(*l) + noise[(start + i * 7919) % noise.len()];
                ((255.0 * code.clamp(0.0, 1.0)).round() / 255.0) as f32
            })
            .collect();
        let clipped = codes.iter().map(|c| *c > 0.99).collect();
        Photo { size_px: self.size, codes, clipped }
    }
}

/// Blurs by a Gaussian of seven taps, along rows and columns.
fn blurred(light: &[f32], w: usize, h: usize, sigma: f64) -> Vec<f32> {
    let kernel: [f32; 7] = std::array::from_fn(|i| (-((i as f64 - 3.0) / sigma).powi(2) / 2.0).exp() as f32);
    let kernel = kernel.map(|k| k / kernel.iter().sum::<f32>());
    let mut rows = vec![0.0; w * h];
    for (from, to) in light.chunks_exact(w).zip(rows.chunks_exact_mut(w)) {
        for (x, to) in to.iter_mut().enumerate() {
            *to = (0..7).map(|k| kernel[k] * from[(x + k).saturating_sub(3).min(w - 1)]).sum();
        }
    }
    let mut out = vec![0.0; w * h];
    for (y, to) in out.chunks_exact_mut(w).enumerate() {
        for k in 0..7 {
            let from = &rows[(y + k).saturating_sub(3).min(h - 1) * w..];
            to.iter_mut().zip(from).for_each(|(to, from)| *to += kernel[k] * from);
        }
    }
    out
}
