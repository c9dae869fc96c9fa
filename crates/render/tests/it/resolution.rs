//! Pictures of half resolution: what is drawn is the picture of half the size, enlarged.

use crate::support::{bare, picture_from};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use tumble_render::{DrawList, Ground, Image, Light, Material, MeshData, Quality, Resolution};

fn list(resolution: Resolution, quality: &str) -> DrawList {
    let camera = tumble_render::Camera::look_at(Point3::new(0.0, -4.0, 2.0), Point3::new(0.0, 1.0, 0.4));
    let mut list = bare(camera);
    (list.sky, list.settings) = Default::default();
    let cube = list.add_mesh(MeshData::unit_box());
    list.add_instance(cube, Isometry3::translation(-0.8, 0.3, 0.5), Material::plastic([0.8, 0.3, 0.2]));
    list.add_sphere(Point3::new(0.7, 0.2, 0.5), 0.5, UnitQuaternion::identity(), Material::billiard_ball(9));
    list.ground = Some(Ground::grid(0.0));
    list.lights.push(Light::sun(Vector3::new(0.4, 0.5, -1.0), 2.0));
    Quality { resolution, ..quality.parse().unwrap() }.apply(&mut list.settings);
    list
}

/// Enlarges by the definition: a pixel has the color of its center, mixed between the four nearest centers.
fn enlarged(small: &Image, width: u32, height: u32) -> Vec<[f64; 3]> {
    let place = |at: u32, of: u32, from: u32| {
        ((f64::from(at) + 0.5) * f64::from(from) / f64::from(of) - 0.5).clamp(0.0, f64::from(from - 1))
    };
    let color = |x: u32, y: u32| {
        let [r, g, b, _] = small.pixel(x.min(small.width - 1), y.min(small.height - 1)).unwrap();
        [r, g, b].map(f64::from)
    };
    let mut all = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (place(x, width, small.width), place(y, height, small.height));
            let (i, j, f, g) = (u as u32, v as u32, u.fract(), v.fract());
            let corners = [color(i, j), color(i + 1, j), color(i, j + 1), color(i + 1, j + 1)];
            all.push(std::array::from_fn(|k| {
                let [a, b, c, d] = corners.map(|corner| corner[k]);
                (a * (1.0 - f) + b * f) * (1.0 - g) + (c * (1.0 - f) + d * f) * g
            }));
        }
    }
    all
}

#[test]
fn half_of_the_pixels_are_drawn_and_enlarged() {
    for quality in ["fastest", "fast,samples=4"] {
        for [width, height] in [[160, 120], [161, 119]] {
            let halved = list(Resolution::Half, quality);
            let Some(half) = picture_from(&halved.camera, &halved, width, height) else { return };
            assert_eq!([half.width, half.height], [width, height]);
            // the camera's aspect is that of the whole picture; for odd sizes that of the small one is another one
            let camera = list(Resolution::Full, quality).camera;
            let full = list(Resolution::Full, quality);
            let [w, h] = [width, height].map(|side| side.div_ceil(2));
            let lens = Fixed(camera, width as f32 / height as f32);
            let Some(small) = picture_from(&lens, &full, w, h) else { return };
            let expected = enlarged(&small, width, height);
            let mut far = 0;
            for (k, expected) in expected.iter().enumerate() {
                let got = half.pixel(k as u32 % width, k as u32 / width).unwrap();
                far += usize::from((0..3).any(|c| (f64::from(got[c]) - expected[c]).abs() > TOLERANCE_LEVELS));
            }
            assert!(far * 200 < expected.len(), "{quality}: {far} of {} pixels differ", expected.len());
        }
    }
}

/// Weights of mixing have 8 bits. A driver that mixes light instead of codes is farther away, at edges of high contrast.
const TOLERANCE_LEVELS: f64 = 3.0;

/// A camera whose pictures have another aspect than their number of pixels.
struct Fixed(tumble_render::Camera, f32);

impl tumble_render::Viewpoint for Fixed {
    fn lens(&self, _: f32) -> Result<tumble_render::Lens, tumble_render::RenderError> {
        self.0.lens(self.1)
    }
}

#[test]
fn the_resolution_has_a_word() {
    let quality: Quality = "fastest,resolution=half".parse().unwrap();
    assert_eq!(quality, Quality { resolution: Resolution::Half, ..Quality::fastest() });
    assert_eq!(quality.to_string().parse::<Quality>().unwrap(), quality);
    assert_eq!("fast,resolution=full".parse::<Quality>().unwrap(), Quality::fast());
    let wrong = "resolution=third".parse::<Quality>().unwrap_err().to_string();
    assert!(wrong.contains("'resolution=third'") && wrong.contains("resolution=full|half"), "{wrong}");
    let mut list = DrawList::default();
    assert!(!list.to_text().contains("resolution"));
    list.settings.resolution = Resolution::Half;
    assert!(list.to_text().contains("resolution half"));
}
