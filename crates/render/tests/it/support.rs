//! A shared renderer, and measurements on pictures.

use nalgebra::Point3;
use std::sync::{Mutex, OnceLock, PoisonError};
use tumble_render::{Camera, DrawList, Image, Light, RenderError, Renderer, Settings, Sky, Viewpoint};

/// The picture of a list, or `None` without an adapter, which is printed. One renderer serves all
/// tests.
pub fn picture(list: &DrawList, width: u32, height: u32) -> Option<Image> {
    picture_from(&list.camera, list, width, height)
}

/// The picture from another viewpoint than the list's camera.
pub fn picture_from(from: &dyn Viewpoint, list: &DrawList, width: u32, height: u32) -> Option<Image> {
    static SHARED: OnceLock<Option<Mutex<Renderer>>> = OnceLock::new();
    let shared = SHARED.get_or_init(|| renderer().map(Mutex::new));
    let Some(shared) = shared else {
        // past the harness, which keeps what passing tests print
        let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("\nSKIPPED: no graphics adapter\n"));
        return None;
    };
    let mut renderer = shared.lock().unwrap_or_else(PoisonError::into_inner);
    Some(renderer.render_from(from, list, width, height).expect("the list is valid"))
}

/// Whether spheres have exact edges; OpenGL, the fallback, draws them in whole pixels, which is
/// printed.
pub fn exact_edges() -> bool {
    let exact = renderer().is_some_and(|r| !r.adapter().contains("Gl)"));
    if !exact {
        // past the harness, which keeps what passing tests print
        let _ = std::io::Write::write_fmt(
            &mut std::io::stderr(),
            format_args!("\nSKIPPED: no adapter with sample masks\n"),
        );
    }
    exact
}

/// A separate renderer; any failure except a missing adapter fails the test.
pub fn renderer() -> Option<Renderer> {
    match Renderer::new() {
        Ok(renderer) => Some(renderer),
        Err(RenderError::NoAdapter { reason }) => {
            // past the harness, which keeps what passing tests print
            let _ = std::io::Write::write_fmt(
                &mut std::io::stderr(),
                format_args!("\nSKIPPED: no graphics adapter ({reason})\n"),
            );
            None
        }
        Err(other) => panic!("an adapter exists and fails: {other}"),
    }
}

/// No ambient light, no tone curve, no occlusion, a black background: only the lights give light.
pub fn bare(camera: Camera) -> DrawList {
    DrawList {
        camera,
        sky: Sky::flat([0.0; 3]),
        settings: Settings { tone_map: false, occlusion_m: Some(0.0), ..Settings::default() },
        ..DrawList::default()
    }
}

/// Straight down from `height` onto the origin, y up in the picture.
pub fn from_above(height: f32) -> Camera {
    Camera::LookAt {
        eye: Point3::new(0.0, 0.0, height),
        target: Point3::origin(),
        up: nalgebra::Vector3::y(),
        vertical_fov_rad: 0.8,
        near_m: 0.1,
        far_m: 100.0,
    }
}

/// White parallel light, so that numbers are simple.
pub fn white_sun(direction: [f32; 3], intensity: f32, casts_shadow: bool) -> Light {
    Light::Directional {
        direction: direction.into(),
        color: [1.0; 3],
        intensity,
        angular_radius_rad: 0.0,
        casts_shadow,
    }
}

/// One channel of a pixel as linear light, 0 to 1 (inverse of the sRGB curve, IEC 61966-2-1).
pub fn linear(image: &Image, x: u32, y: u32, channel: usize) -> f64 {
    let c = f64::from(image.pixel(x, y).expect("inside the picture")[channel]) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// Sum of a channel's linear light over the picture: for white on black the area in pixels, with
/// edges counted partly.
pub fn area(image: &Image, channel: usize) -> f64 {
    moments(image, channel).0
}

/// Area, and mean x and y in pixels, of a channel's light.
pub fn moments(image: &Image, channel: usize) -> (f64, f64, f64) {
    let (mut sum, mut sx, mut sy) = (0.0, 0.0, 0.0);
    for y in 0..image.height {
        for x in 0..image.width {
            let c = linear(image, x, y, channel);
            sum += c;
            sx += c * (f64::from(x) + 0.5);
            sy += c * (f64::from(y) + 0.5);
        }
    }
    (sum, sx / sum, sy / sum)
}
