//! Soft spheres against the closed form of their blend, along the rays of pixels.
//!
//! ```text
//! α = 1 − max(1 − opacity, 10⁻⁶)^(q³),   q² = 1 − (distance of the ray from the center / radius)²
//! C ← α·c + (1 − α)·C           from the farthest to the nearest
//! ```

use crate::support::{bare, from_above, linear, picture, picture_from};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use tumble_render::{
    Camera, DrawList, FacetView, GlslTranslator, Image, Lens, Material, MeshData, PortableItems, PortablePicture,
    RIM_PX, Shader, SoftSphere, Viewpoint,
};

/// Largest difference in linear light of one rounding: a level of the picture is at most 0.009 of it, and devices may round by 0.6 of
/// one (Vulkan's and Direct3D's rule for sRGB). A picture rounds its background and each blend.
const ROUNDING: f64 = 0.6 * 0.009;
/// That of a background and one blend.
const CLOSE: f64 = 2.0 * ROUNDING;

fn soft(center: [f32; 3], radius: f32, color: [f32; 3], opacity: f32) -> SoftSphere {
    SoftSphere { center: center.into(), radius, color, opacity, shader: Shader::Unlit }
}

/// A white square, 2 m wide, in the plane z = 0.
fn square(list: &mut DrawList) {
    let mesh = list.add_mesh(MeshData::cuboid([2.0, 2.0, 0.002]));
    list.add_instance(mesh, Isometry3::identity(), Material::unlit([1.0; 3]));
}

fn light_of(color: f32) -> f64 {
    let c = f64::from(color);
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// The color of a ray over `background`, by the closed form in double precision.
fn expected(spheres: &[SoftSphere], eye: &Point3<f64>, way: &Vector3<f64>, background: [f64; 3]) -> [f64; 3] {
    let away = |s: &SoftSphere| (s.center.cast::<f64>() - eye).norm();
    let mut order: Vec<&SoftSphere> = spheres.iter().collect();
    order.sort_by(|a, b| away(b).total_cmp(&away(a)));
    blended(&order, eye, way, background)
}

fn blended(order: &[&SoftSphere], eye: &Point3<f64>, way: &Vector3<f64>, mut color: [f64; 3]) -> [f64; 3] {
    for s in order {
        let miss = miss(s, eye, way);
        let alpha = 1.0 - (1.0 - f64::from(s.opacity)).max(1e-6).powf((1.0 - miss * miss).max(0.0).powf(1.5));
        (0..3).for_each(|k| color[k] = alpha * light_of(s.color[k]) + (1.0 - alpha) * color[k]);
    }
    color
}

/// Returns the distance of a ray from the center of a ball, in its radii.
fn miss(ball: &SoftSphere, eye: &Point3<f64>, way: &Vector3<f64>) -> f64 {
    (ball.center.cast::<f64>() - eye).cross(&way.normalize()).norm() / f64::from(ball.radius)
}

/// The direction of the ray through the middle of a pixel.
fn way(lens: &Lens, image: &Image, x: u32, y: u32) -> Vector3<f64> {
    let at = |pixel: u32, side: u32| (2.0 * f64::from(pixel) + 1.0) / f64::from(side) - 1.0;
    let ndc = |depth: f64| Point3::new(at(x, image.width), -at(y, image.height), depth);
    let world = (lens.projection * lens.view).try_inverse().unwrap();
    world.transform_point(&ndc(0.9)) - world.transform_point(&ndc(0.1))
}

/// Compares all pixels with the closed form; returns how many have a ball in front.
fn compare(image: &Image, from: &dyn Viewpoint, spheres: &[SoftSphere], eye: Point3<f64>, background: [f64; 3]) -> u32 {
    let lens = from.lens(image.width as f32 / image.height as f32).unwrap();
    let mut changed = 0;
    for (x, y) in (0..image.height).flat_map(|y| (0..image.width).map(move |x| (x, y))) {
        let way = way(&lens, image, x, y);
        let want = expected(spheres, &eye, &way, background);
        let close = ROUNDING * (1 + spheres.iter().filter(|ball| miss(ball, &eye, &way) < 1.0).count()) as f64;
        changed += u32::from((0..3).any(|k| (want[k] - background[k]).abs() > 0.05));
        for (k, want) in want.into_iter().enumerate() {
            let have = linear(image, x, y, k);
            assert!((have - want).abs() < close, "pixel {x} {y}, channel {k}: {have}, expected {want}");
        }
    }
    changed
}

/// In the middle, opacity a over white gives a·c + (1 − a); elsewhere the closed form.
#[test]
fn a_soft_sphere_over_white_has_the_blended_color() {
    for (samples, opacity) in [(4, 0.25), (4, 0.6), (1, 0.6), (1, 0.95), (4, 1.0)] {
        let mut list = bare(from_above(5.0));
        list.settings.samples = samples;
        square(&mut list);
        let ball = soft([0.0, 0.0, 1.0], 0.8, [0.9, 0.3, 0.1], opacity);
        list.soft_spheres.push(ball);
        let Some(image) = picture(&list, 61, 61) else { return };
        for (k, color) in ball.color.into_iter().enumerate() {
            let want = f64::from(opacity) * light_of(color) + (1.0 - f64::from(opacity));
            let have = linear(&image, 30, 30, k);
            assert!((have - want).abs() < CLOSE, "{opacity}: {have}, expected {want}");
        }
        // the square takes up 28 pixels of the middle
        let lens = list.camera.lens(1.0).unwrap();
        for (x, y) in (17..44).flat_map(|y| (17..44).map(move |x| (x, y))) {
            let want = expected(&[ball], &Point3::new(0.0, 0.0, 5.0), &way(&lens, &image, x, y), [1.0; 3]);
            for (k, want) in want.into_iter().enumerate() {
                assert!((linear(&image, x, y, k) - want).abs() < CLOSE, "{opacity}: pixel {x} {y}");
            }
        }
    }
}

/// Many overlapping balls; the list in three orders, with one and four samples.
#[test]
fn the_order_of_a_list_changes_no_pixel() {
    let eye = Point3::new(0.0, 0.0, 5.0);
    let mut balls: Vec<SoftSphere> = (0..24)
        .map(|k| {
            let t = 2.4 * k as f32;
            let color = [0.5 + 0.5 * t.sin(), 0.5 + 0.5 * (1.3 * t).sin(), 0.5 + 0.5 * (1.7 * t).cos()];
            soft([0.7 * t.cos(), 0.5 * t.sin(), 0.13 * (k % 7) as f32], 0.4 + 0.02 * k as f32, color, 0.3)
        })
        .collect();
    balls.push(soft([0.1, 0.0, 0.5], 0.5, [1.0, 0.0, 0.0], 0.5));
    balls.push(soft([0.1, 0.0, 0.5], 0.5, [0.0, 0.0, 1.0], 0.5)); // at the same place
    for samples in [4, 1] {
        let mut list = bare(from_above(5.0));
        list.settings.samples = samples;
        list.soft_spheres = balls.clone();
        let Some(first) = picture(&list, 120, 90) else { return };
        list.soft_spheres.reverse();
        assert_eq!(picture(&list, 120, 90).unwrap().rgba, first.rgba);
        list.soft_spheres.sort_by(|a, b| a.center.x.total_cmp(&b.center.x));
        assert_eq!(picture(&list, 120, 90).unwrap().rgba, first.rgba);
        list.soft_spheres.truncate(4);
        let shown = picture(&list, 120, 90).unwrap();
        assert!(compare(&shown, &list.camera, &list.soft_spheres, eye, [0.0; 3]) > 500);
    }
}

/// A solid ball hides what is behind it and is veiled by what is in front of it; soft spheres hide no soft spheres.
#[test]
fn opaque_items_hide_soft_spheres_behind_them() {
    for samples in [4, 1] {
        let mut list = bare(from_above(5.0));
        list.settings.samples = samples;
        list.add_sphere(Point3::origin(), 0.5, UnitQuaternion::identity(), Material::unlit([0.0, 1.0, 0.0]));
        list.soft_spheres = vec![soft([0.0, 0.0, -2.0], 0.6, [1.0, 0.0, 0.0], 0.9)];
        let Some(hidden) = picture(&list, 61, 61) else { return };
        assert_eq!(hidden.pixel(30, 30).unwrap()[..3], [0, 255, 0]);
        list.soft_spheres.push(soft([0.0, 0.0, 2.0], 0.6, [0.0, 0.0, 1.0], 0.5));
        let veiled = picture(&list, 61, 61).unwrap();
        let [r, g, b] = [0, 1, 2].map(|k| linear(&veiled, 30, 30, k));
        assert!(r == 0.0 && (g - 0.5).abs() < CLOSE && (b - 0.5).abs() < CLOSE, "{r} {g} {b}");
    }
}

/// With the eye in the middle of a ball, half of it is in front: light passes by the root of what the whole lets pass.
#[test]
fn an_eye_inside_a_soft_sphere_sees_the_part_in_front() {
    let mut list = bare(from_above(5.0));
    square(&mut list);
    list.soft_spheres.push(soft([0.0, 0.0, 5.0], 1.0, [0.0; 3], 0.75));
    let Some(image) = picture(&list, 61, 61) else { return };
    let have = linear(&image, 30, 30, 0);
    assert!((have - 0.5).abs() < CLOSE, "{have}, expected √(1 − 0.75)");
}

/// Two walls of a cave that meet at a right angle, and balls across their edge. Along the directions of view the order of the
/// balls is another on each wall; by their distance from the eye it is the same.
#[test]
fn walls_of_a_cave_agree_where_they_meet() {
    let eye: Point3<f64> = Point3::new(0.3, -0.2, 1.5);
    let up = Vector3::new(0.0, 0.0, 3.0);
    let corners = [Point3::new(-1.5, 1.5, 0.0), Point3::new(1.5, 1.5, 0.0), Point3::new(1.5, -1.5, 0.0)];
    let along = |turn: f64, distance: f64| {
        let edge = (corners[1] - eye).xy();
        let angle = edge.y.atan2(edge.x) + turn;
        let at = eye + Vector3::new(angle.cos(), angle.sin(), 0.0) * distance;
        [at.x as f32, at.y as f32, at.z as f32]
    };
    let balls = [
        soft(along(0.08, 3.0), 0.6, [1.0, 0.2, 0.1], 0.7),
        soft(along(-0.08, 3.05), 0.6, [0.1, 0.3, 1.0], 0.7),
        soft(along(0.02, 4.0), 0.9, [0.9, 0.9, 0.9], 0.5),
    ];
    let mut list = bare(Camera::default());
    list.soft_spheres = balls.to_vec();
    let wall = |from: Point3<f64>, to: Point3<f64>| {
        FacetView::new(eye, [from, to, from + up], 0.05, 100.0).unwrap().part(160, 160, RIM_PX)
    };
    let [left, right] = [wall(corners[0], corners[1]), wall(corners[1], corners[2])];
    for view in [&left, &right] {
        let Some(image) = picture_from(view, &list, 160, 160) else { return };
        assert!(compare(&image, view, &balls, eye, [0.0; 3]) > 300);
    }
    // the test would notice an order by depth: on the walls it differs, and so do the colors
    let depth = |view: &FacetView, s: &SoftSphere| -view.matrices().0.transform_point(&s.center.cast()).z;
    let order = |view: &FacetView| depth(view, &balls[0]) < depth(view, &balls[1]);
    assert_ne!(order(&left), order(&right));
    let edge = Vector3::new(corners[1].x - eye.x, corners[1].y - eye.y, 0.0);
    let [one, other] = [[1, 0], [0, 1]].map(|order| blended(&order.map(|k| &balls[k]), &eye, &edge, [0.0; 3])[0]);
    assert!((one - other).abs() > 10.0 * CLOSE, "{one} {other}");
}

/// A lit puff of smoke scatters light of the sun and of the sky: white under a sun behind the eye.
#[test]
fn lit_soft_spheres_scatter_light() {
    let mut list = bare(from_above(5.0));
    let smoke = SoftSphere { shader: Shader::Lit, ..soft([0.0, 0.0, 1.0], 0.8, [1.0; 3], 1.0) };
    list.soft_spheres.push(smoke);
    list.lights.push(crate::support::white_sun([0.0, 0.0, -1.0], 0.5, false));
    let Some(image) = picture(&list, 61, 61) else { return };
    // the normal in the middle is towards the light: ½ + ½ of its intensity
    let middle = linear(&image, 30, 30, 0);
    assert!((middle - 0.5).abs() < CLOSE, "{middle}");
    list.lights = vec![crate::support::white_sun([0.0, 0.0, 1.0], 0.5, false)];
    let behind = linear(&picture(&list, 61, 61).unwrap(), 30, 30, 0);
    assert!(behind < CLOSE, "{behind}: lit from behind");
}

#[test]
fn soft_spheres_out_of_range_are_refused() {
    for (change, words) in [
        (SoftSphere { opacity: 1.5, ..soft([0.0; 3], 1.0, [0.5; 3], 0.5) }, "opacity"),
        (SoftSphere { opacity: f32::NAN, ..soft([0.0; 3], 1.0, [0.5; 3], 0.5) }, "opacity"),
        (soft([0.0; 3], 0.0, [0.5; 3], 0.5), "radius"),
        (soft([f32::INFINITY, 0.0, 0.0], 1.0, [0.5; 3], 0.5), "center"),
        (soft([0.0; 3], 1.0, [0.5, 2.0, 0.5], 0.5), "color"),
    ] {
        let list = DrawList { soft_spheres: vec![change], ..DrawList::default() };
        let message = list.validate().unwrap_err().to_string();
        assert!(message.contains("soft sphere 0") && message.contains(words), "{message}");
    }
}

/// The numbers for browsers have all soft spheres once, farthest first, with a program that blends.
#[test]
fn portable_pictures_have_soft_spheres_in_order() {
    let mut list = bare(from_above(5.0));
    list.soft_spheres = [0.5, -1.0, 2.0].map(|z| soft([0.0, 0.0, z], 0.4, [0.5; 3], 0.5)).to_vec();
    let picture = PortablePicture::new(&list, &list.camera, [320, 240]).unwrap();
    let heights: Vec<f32> = picture.items[PortableItems::Soft as usize].chunks(20).map(|ball| ball[2]).collect();
    assert_eq!(heights, [-1.0, 0.5, 2.0]);
    let [draw] = picture.draws.iter().filter(|d| d.items == PortableItems::Soft).collect::<Vec<_>>()[..] else {
        panic!("one draw")
    };
    let recipe = draw.key.recipe();
    assert_eq!((draw.count, recipe.blend, recipe.write, recipe.floats), (3, true, false, 20));
    let program = GlslTranslator::new().unwrap().program(draw.key).unwrap();
    assert!(program.fragment.contains("void main()"));
}

/// A cloud may have a color for each of its solid spheres.
#[test]
fn spheres_of_a_cloud_have_their_own_colors() {
    let mut list = bare(from_above(5.0));
    let spheres = [-1.0, 0.0, 1.0].map(|x| (Point3::new(x, 0.0, 0.0), 0.3)).to_vec();
    let colors = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    list.clouds.push(tumble_render::SphereCloud {
        spheres,
        colors: colors.clone(),
        material: Material::unlit([1.0; 3]),
    });
    let Some(image) = picture(&list, 121, 61) else { return };
    let pixels = 61.0 / 2.0 / 0.4f64.tan() / 5.0;
    for (k, x) in [-1.0, 0.0, 1.0].into_iter().enumerate() {
        let pixel = image.pixel((60.5 + pixels * x) as u32, 30).unwrap();
        assert_eq!(pixel[..3], colors[k].map(|c| 255 * c as u8));
    }
    list.clouds[0].colors.pop();
    assert!(list.validate().unwrap_err().to_string().contains("colors"));
}
