//! Culling must not change a picture, and must cull what closed forms give as hidden.

use super::*;
use crate::camera::orthographic;
use crate::{Camera, DrawList, Ground, Light, Material, Quality, Renderer, Viewpoint};
use nalgebra::{Matrix4, Point3, UnitQuaternion, Vector3};

/// Reproducible numbers from 0 to 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Spheres of many sizes in a box of 4 x 4 x 2 m, under a sun and a lamp.
fn pile(count: usize, seed: u64) -> DrawList {
    let mut numbers = Numbers(seed);
    let mut list = DrawList { ground: Some(Ground::grid(0.0)), ..DrawList::default() };
    for i in 0..count {
        let at = Point3::new(4.0 * numbers.next() - 2.0, 4.0 * numbers.next() - 2.0, 2.0 * numbers.next());
        let radius = if i % 50 == 0 { 0.5 } else { 0.02 + 0.2 * numbers.next() };
        let color = [numbers.next(), numbers.next(), numbers.next()];
        list.add_sphere(at, radius, UnitQuaternion::identity(), Material::plastic(color)).casts_shadow = i % 7 != 0;
    }
    list.lights =
        vec![Light::sun(Vector3::new(0.3, 0.5, -1.0), 1.0), Light::lamp(Point3::new(3.0, -4.0, 5.0), 0.7, 5.0)];
    list
}

fn parallel() -> Camera {
    let view = Matrix4::look_at_rh(&Point3::new(3.0, -4.0, 5.0), &Point3::new(0.0, 0.0, 1.0), &Vector3::z());
    Camera::Raw { view, projection: orthographic(Vector3::new(-2.5, -2.0, -12.0), Vector3::new(2.0, 2.5, -1.0)) }
}

/// A view through a window beside the middle, as through a screen of a cave.
fn beside() -> Camera {
    let view = Matrix4::look_at_rh(&Point3::new(2.5, -3.0, 1.5), &Point3::new(0.0, 0.0, 1.0), &Vector3::z());
    let mut projection = nalgebra::Perspective3::new(1.3, 1.2, 0.1, 50.0).to_homogeneous();
    // depth from 0 to 1
    let (near, far) = (0.1f32, 50.0f32);
    (projection[(2, 2)], projection[(2, 3)]) = (far / (near - far), near * far / (near - far));
    (projection[(0, 2)], projection[(1, 2)]) = (0.7, -0.4);
    Camera::Raw { view, projection }
}

fn views() -> Vec<Camera> {
    let at = |eye: [f32; 3], target: [f32; 3]| Camera::look_at(eye.into(), target.into());
    vec![
        at([0.0, -7.0, 4.0], [0.0, 0.0, 0.8]),
        at([0.3, 0.2, 1.1], [2.0, 0.4, 1.0]).with_fov(1.6),
        at([1.9, 1.9, 2.6], [0.0, 0.0, 0.0]).with_fov(1.2),
        at([40.0, 5.0, 9.0], [0.0, 0.0, 1.0]).with_fov(0.15),
        parallel(),
        beside(),
    ]
}

#[test]
fn culled_spheres_have_no_pixel() {
    let Ok(mut renderer) = Renderer::new() else { return };
    for (seed, quality) in
        [(1, "fastest"), (2, "fast"), (3, "fast,samples=4,shadows=soft,map=512"), (4, "fast,occlusion=on")]
    {
        let mut list = pile(700, seed);
        quality.parse::<Quality>().unwrap().apply(&mut list.settings);
        for (i, camera) in views().iter().enumerate() {
            let pictures = [true, false].map(|choosy| {
                renderer.gpu.choosy = choosy;
                renderer.render_from(camera, &list, 240, 180).unwrap()
            });
            let off = pictures[0].rgba.chunks(4).zip(pictures[1].rgba.chunks(4)).filter(|(a, b)| a != b).count();
            assert_eq!(off, 0, "{quality}, view {i}");
        }
    }
}

/// The eye of a camera for a picture of 400 x 400.
fn eye(camera: &Camera) -> Eye {
    let lens = camera.lens(1.0).unwrap();
    Eye::new(&lens.view, &lens.projection, 400, 400)
}

#[test]
fn most_of_a_pile_is_culled() {
    // 20 layers of touching spheres, seen from above: in an octahedral arrangement only the first
    // few are visible
    let spheres: Vec<SphereBounds> = (0..20 * 400)
        .map(|i| (i / 400, i / 20 % 20, i % 20))
        .map(|(z, y, x)| {
            (
                Point3::new(
                    0.1 * x as f32 + 0.05 * (z % 2) as f32,
                    0.1 * y as f32 + 0.05 * (z % 2) as f32,
                    -0.07 * z as f32,
                ),
                0.055,
            )
        })
        .collect();
    let eye = eye(&Camera::look_at(Point3::new(1.0, 0.9, 5.0), Point3::new(1.0, 1.0, 0.0)));
    let count = visible(&spheres, std::iter::once(0..8000), &eye, 1).len();
    assert!(count > 400 && count < 2400, "{count} of 8000 are drawn");
}

#[test]
fn a_sphere_is_hidden_behind_a_larger_one() {
    // from the origin along x: a sphere of 1 m at 5 m covers a cone of asin(1/5); one of 0.3 m at
    // 10 m at the angle a is within it while a + asin(0.03) is less
    let camera = Camera::LookAt {
        eye: Point3::origin(),
        target: Point3::new(1.0, 0.0, 0.0),
        up: Vector3::z(),
        vertical_fov_rad: 1.0,
        near_m: 0.1,
        far_m: 100.0,
    };
    let eye = eye(&camera);
    let limit = (0.2f32).asin() - (0.03f32).asin();
    // a cell of 2 pixels and their fraction at the edges: 366 pixels per tangent
    let slack = 6.0 / 366.0;
    for (angle, hidden) in [(0.0, true), (limit - slack, true), (limit + 0.001, false), (2.0 * limit, false)] {
        for turn in [0.0f32, 0.7, 2.0, 4.0] {
            let behind =
                Point3::new(10.0 * angle.cos(), 10.0 * angle.sin() * turn.cos(), 10.0 * angle.sin() * turn.sin());
            // and in front it hides
            for (place, count) in [(behind, if hidden { 1 } else { 2 }), (Point3::from(behind.coords * 0.35), 2)] {
                let spheres = [(place, 0.3 * place.coords.norm() / 10.0), (Point3::new(5.0, 0.0, 0.0), 1.0)];
                assert_eq!(
                    visible(&spheres, std::iter::once(0..2), &eye, 1).len(),
                    count,
                    "{angle} rad, turned {turn}: {place}"
                );
            }
        }
    }
    // behind the eye, beside the picture, beyond the far plane: culled; around the eye: drawn
    let outside = [([-3.0, 0.0, 0.0], 1.0), ([5.0, 6.0, 0.0], 1.0), ([5.0, 0.0, -7.0], 2.0), ([200.0, 0.0, 0.0], 1.0)]
        .map(|(at, r): ([f32; 3], f32)| (Point3::from(at), r));
    assert!(visible(&outside, std::iter::once(0..4), &eye, 1).is_empty());
    let around = visible(&[(Point3::new(0.2, 0.0, 0.0), 1.0)], std::iter::once(0..1), &eye, 1);
    assert_eq!(around, [Visible { number: 0, pixels: PixelBox { from: [0; 2], to: [400; 2] } }]);
    // one of 1 m at 10 m has tan(asin(0.1)) of 366 pixels per tangent around the middle
    let [seen] = visible(&[(Point3::new(10.0, 0.0, 0.0), 1.0)], std::iter::once(0..1), &eye, 1)[..] else { panic!() };
    let half = 366.1 * (0.1f64).asin().tan();
    let expected = [200.0 - half - 1.0, 200.0 + half + 1.0];
    for k in 0..2 {
        assert!((f64::from(seen.pixels.from[k]) - expected[0]).abs() <= 1.0, "{seen:?}, {expected:?}");
        assert!((f64::from(seen.pixels.to[k]) - expected[1]).abs() <= 1.0, "{seen:?}, {expected:?}");
    }
}

/// Four layers of 50 x 50 spheres from in front and above, as in the example `frames`. Rays through
/// the centers of all pixels determine which have one.
#[test]
fn a_third_of_four_layers_is_culled_and_none_that_a_ray_meets() {
    let (width, height, fov) = (1024usize, 768usize, 40f64.to_radians());
    let at =
        |i: usize| [0.21 * ((i / 200) as f64 - 24.5), 0.23 * ((i / 4 % 50) as f64 - 24.5), 0.1 + 0.22 * (i % 4) as f64];
    let spheres: Vec<SphereBounds> = (0..10_000).map(|i| (Point3::from(at(i).map(|x| x as f32)), 0.1)).collect();
    let (from, to) = (Vector3::new(0.0, -14.175, 8.4), Vector3::new(0.0, -0.84, 0.2));
    let ahead = (to - from).normalize();
    let right = ahead.cross(&Vector3::z()).normalize();
    let up = right.cross(&ahead);
    let pixels_per_tangent = 0.5 * height as f64 / (0.5 * fov).tan();
    let mut nearest = vec![(f64::MAX, usize::MAX); width * height];
    for i in 0..spheres.len() {
        let c = Vector3::from(at(i)) - from;
        let depth = c.dot(&ahead);
        let middle = [
            0.5 * width as f64 + pixels_per_tangent * c.dot(&right) / depth,
            0.5 * height as f64 - pixels_per_tangent * c.dot(&up) / depth,
        ];
        let reach = 1.2 * pixels_per_tangent * 0.1 / depth + 1.0;
        let range =
            |k: usize| (middle[k] - reach).max(0.0) as usize..((middle[k] + reach) as usize).min([width, height][k]);
        for (x, y) in range(1).flat_map(|y| range(0).map(move |x| (x, y))) {
            let ray = ahead + right * ((x as f64 + 0.5 - 0.5 * width as f64) / pixels_per_tangent)
                - up * ((y as f64 + 0.5 - 0.5 * height as f64) / pixels_per_tangent);
            let half = ray.dot(&c) / ray.norm_squared();
            let room = half * half - (c.norm_squared() - 0.01) / ray.norm_squared();
            if room >= 0.0 && half - room.sqrt() < nearest[y * width + x].0 {
                nearest[y * width + x] = (half - room.sqrt(), i);
            }
        }
    }
    let mut met: Vec<usize> = nearest.iter().map(|n| n.1).filter(|i| *i < spheres.len()).collect();
    met.sort_unstable();
    met.dedup();
    let eye = Camera::LookAt {
        eye: Point3::from(from.cast()),
        target: Point3::from(to.cast()),
        up: Vector3::z(),
        vertical_fov_rad: fov as f32,
        near_m: 0.05,
        far_m: 500.0,
    };
    let lens = eye.lens(width as f32 / height as f32).unwrap();
    let drawn = visible(
        &spheres,
        std::iter::once(0..10_000),
        &Eye::new(&lens.view, &lens.projection, width as u32, height as u32),
        1,
    );
    assert!(
        met.len() > 2500 && met.iter().all(|i| drawn.binary_search_by_key(&(*i as u32), |seen| seen.number).is_ok()),
        "{} spheres have a pixel",
        met.len()
    );
    assert!(drawn.len() < 6700, "{} spheres are drawn, {} have a pixel", drawn.len(), met.len());
}
