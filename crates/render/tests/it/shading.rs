//! Light and shadow against closed forms.

use crate::support::{bare, from_above, linear, picture, white_sun};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use tumble_render::{Camera, DrawList, Image, Light, Material, MeshData, Pattern, Quality, Sky};

/// A matte floor of sRGB white and nothing else on it.
fn floor(list: &mut DrawList, half: f32) {
    let quad = list.add_mesh(MeshData::ground_quad(2.0 * half));
    let dull = Material { roughness: 1.0, ..Material::matte([1.0; 3]) };
    list.add_instance(quad, Isometry3::identity(), dull).casts_shadow = false;
}

/// The pixel in which a world point of the floor appears, seen by `from_above(10)` at 400 x 400.
fn floor_pixel(x: f64, y: f64) -> (u32, u32) {
    let scale = 200.0 / 0.4f64.tan() / 10.0;
    ((200.0 + x * scale) as u32, (200.0 - y * scale) as u32)
}

fn brightness(image: &Image, x: f64, y: f64) -> f64 {
    let (px, py) = floor_pixel(x, y);
    linear(image, px, py, 1)
}

#[test]
fn diffuse_light_follows_the_cosine() {
    // Lambert: brightness = albedo * intensity * cos. The faint reflection of a matte surface adds
    // a few percent at most.
    for degrees in [0f32, 30.0, 60.0] {
        let a = degrees.to_radians();
        let mut list = bare(from_above(10.0));
        floor(&mut list, 3.0);
        list.lights.push(white_sun([a.sin(), 0.0, -a.cos()], 0.8, false));
        let Some(image) = picture(&list, 400, 400) else { return };
        let expected = 0.8 * f64::from(a.cos());
        let got = brightness(&image, 0.0, 0.0);
        assert!((got / expected - 1.0).abs() < 0.05, "{degrees} degrees: {got}, expected {expected}");
    }
}

#[test]
fn lamps_fall_off_with_the_square_of_the_distance() {
    let at = |height: f32| {
        let mut list = bare(from_above(10.0));
        floor(&mut list, 3.0);
        let position = Point3::new(0.0, 0.0, height);
        list.lights.push(Light::Point {
            position,
            color: [1.0; 3],
            intensity: 1.0,
            radius_m: 0.0,
            casts_shadow: false,
        });
        picture(&list, 400, 400).map(|image| (brightness(&image, 0.0, 0.0), brightness(&image, 2.0, 0.0)))
    };
    let (Some((near, near_side)), Some((far, _))) = (at(1.5), at(3.0)) else { return };
    assert!((near / far - 4.0).abs() < 0.1, "{near} {far}");
    // 2 m to the side of 1.5 m: distance 2.5, cosine 0.6: (1.5/2.5)^3 of the light below the lamp
    assert!((near_side / near - 0.216).abs() < 0.015, "{near_side} {near}");
}

#[test]
fn the_shadow_of_a_ball_lies_where_the_light_leaves_it() {
    // a sphere of radius 0.3 at height 2, light inclined 45 degrees towards +x: shadow center at x
    // = 2, an ellipse 0.3 sqrt 2 by 0.3
    let mut list = bare(from_above(10.0));
    floor(&mut list, 3.5);
    list.add_sphere(Point3::new(0.0, 0.0, 2.0), 0.3, UnitQuaternion::identity(), Material::unlit([0.0; 3]));
    list.lights.push(white_sun([1.0, 0.0, -1.0], 1.0, true));
    let Some(image) = picture(&list, 400, 400) else { return };
    let lit = brightness(&image, 2.0, 1.0);
    assert!((lit - 0.5f64.sqrt()).abs() < 0.04, "the open floor: {lit}");
    let (along, across) = (0.3 * 2f64.sqrt(), 0.3);
    for (share, expected) in [(0.0, 0.0), (0.85, 0.0), (1.15, 1.0)] {
        for (x, y) in
            [(2.0 + share * along, 0.0), (2.0 - share * along, 0.0), (2.0, share * across), (2.0, -share * across)]
        {
            let got = brightness(&image, x, y) / lit;
            assert!((got - expected).abs() < 0.02, "at {x} {y}: {got}, expected {expected}");
        }
    }
    assert!((brightness(&image, -2.0, 0.0) / lit - 1.0).abs() < 0.01, "towards the light there is none");
}

#[test]
fn the_shadow_of_a_box_under_a_lamp_is_its_central_projection() {
    // a plate from -0.5 to 0.5 at height 1 under a lamp at height 3: scaled by 3/2 on the floor
    // (0.745 for the lower rim at 0.99)
    let mut list = bare(from_above(10.0));
    floor(&mut list, 3.5);
    let plate = list.add_mesh(MeshData::cuboid([1.0, 1.0, 0.02]));
    list.add_instance(plate, Isometry3::translation(0.0, 0.0, 1.0), Material::unlit([0.0; 3]));
    let position = Point3::new(0.0, 0.0, 3.0);
    list.lights.push(Light::Point { position, color: [1.0; 3], intensity: 9.0, radius_m: 0.0, casts_shadow: true });
    let Some(image) = picture(&list, 400, 400) else { return };
    for (x, y) in [(0.72, 0.0), (-0.72, 0.0), (0.0, 0.72), (0.0, -0.72), (0.7, 0.7)] {
        assert!(brightness(&image, x, y) < 0.02, "in shade at {x} {y}: {}", brightness(&image, x, y));
    }
    for (x, y) in [(0.80f64, 0.0f64), (-0.80, 0.0), (0.0, 0.80), (0.0, -0.80), (0.8, 0.8)] {
        let d2 = x * x + y * y + 9.0;
        let expected = 9.0 / d2 * 3.0 / d2.sqrt();
        assert!(
            (brightness(&image, x, y) / expected - 1.0).abs() < 0.06,
            "lit at {x} {y}: {}",
            brightness(&image, x, y)
        );
    }
}

#[test]
fn penumbra_width_is_the_gap_times_the_size_of_the_sun() {
    // the straight edge of a large plate 1 m above the floor, sun overhead of angular radius 0.1:
    // light rises from 0 to 1 over 0.2 m, half at the edge
    let mut list = bare(from_above(10.0));
    floor(&mut list, 3.5);
    let plate = list.add_mesh(MeshData::cuboid([2.0, 3.0, 0.01]));
    list.add_instance(plate, Isometry3::translation(-1.0, 0.0, 1.0), Material::unlit([0.0; 3]));
    list.lights.push(Light::Directional {
        direction: -Vector3::z(),
        color: [1.0; 3],
        intensity: 0.9,
        angular_radius_rad: 0.1,
        casts_shadow: true,
    });
    // seen from the side below the plate's height, because the plate hides its shadow from above
    list.camera = Camera::LookAt {
        eye: Point3::new(6.0, 0.0, 3.0),
        target: Point3::origin(),
        up: Vector3::z(),
        vertical_fov_rad: 0.6,
        near_m: 0.1,
        far_m: 50.0,
    };
    let Some(image) = picture(&list, 400, 400) else { return };
    let open = |x: f32| {
        // averaged along the edge, which removes the grain of the filter
        let samples = (-10..=10).map(|k| {
            let [px, py, _] = list.camera.project(Point3::new(x, 0.05 * k as f32, 0.0), 400, 400).expect("in front");
            linear(&image, px as u32, py as u32, 1)
        });
        samples.sum::<f64>() / 21.0 / 0.9
    };
    assert!(open(0.16) > 0.93, "open beyond the penumbra: {}", open(0.16));
    assert!((open(0.0) - 0.5).abs() < 0.12, "half at the edge: {}", open(0.0));
    // fraction of a disc beyond a chord half a radius off its middle: 1/3 + sqrt 3 / (4 pi) ... =
    // 0.8045 open
    assert!((open(0.05) - 0.8045).abs() < 0.12, "half way out: {}", open(0.05));
    assert!(open(-0.16) < 0.05, "dark within: {}", open(-0.16));
}

#[test]
fn smooth_surfaces_show_no_acne_and_feet_touch_their_shadows() {
    // a lit sphere resting on the floor under a slanting sun
    let mut list = bare(from_above(10.0));
    floor(&mut list, 3.5);
    let dull = Material { roughness: 1.0, ..Material::matte([1.0; 3]) };
    list.add_sphere(Point3::new(0.0, 0.0, 1.0), 1.0, UnitQuaternion::identity(), dull);
    let a = 0.6f64;
    list.lights.push(white_sun([a.sin() as f32, 0.0, -a.cos() as f32], 0.9, true));
    let Some(image) = picture(&list, 400, 400) else { return };
    let eye = Vector3::new(0.0, 0.0, 10.0);
    let mut checked = 0;
    for py in 0..400u32 {
        for px in 0..400u32 {
            let t = 0.4f64.tan() / 200.0;
            let dir =
                Vector3::new((f64::from(px) + 0.5 - 200.0) * t, (200.0 - f64::from(py) - 0.5) * t, -1.0).normalize();
            let to = Vector3::new(0.0, 0.0, 1.0) - eye;
            let along = to.dot(&dir);
            let miss2 = to.norm_squared() - along * along;
            if miss2 > 0.95 {
                continue;
            }
            let n = eye + dir * (along - (1.0 - miss2).sqrt()) - Vector3::new(0.0, 0.0, 1.0);
            let cosine = n.dot(&Vector3::new(-a.sin(), 0.0, a.cos()));
            if cosine > 0.15 {
                checked += 1;
                let got = linear(&image, px, py, 1);
                assert!((got - 0.9 * cosine).abs() < 0.05, "at {px} {py}: {got}, expected {}", 0.9 * cosine);
            }
        }
    }
    assert!(checked > 4000, "{checked}");
    // seen from above, the sphere hides its foot; beside it the shadow must begin at once: the
    // terminator's tangent ray from the rim lands at x = cos a + (1 + sin a) tan a; everything from
    // the sphere's outline to there is dark
    let end = a.cos() + (1.0 + a.sin()) * a.tan();
    assert!(brightness(&image, 1.12, 0.0) < 0.01 && brightness(&image, end - 0.05, 0.0) < 0.01);
    assert!(brightness(&image, end + 0.05, 0.0) > 0.7, "{}", brightness(&image, end + 0.05, 0.0));
}

#[test]
fn a_wide_floor_that_throws_shadows_shades_itself_nowhere() {
    // 20 m of floor in one shadow map (a texel is 1 cm), under a sun 20 degrees high: light sin 20
    // degrees everywhere except in the box's shadow
    let mut list = bare(from_above(10.0));
    let slab = list.add_mesh(MeshData::cuboid([20.0, 20.0, 0.2]));
    let dull = Material { roughness: 1.0, ..Material::matte([1.0; 3]) };
    list.add_instance(slab, Isometry3::translation(0.0, 0.0, -0.1), dull);
    let cube = list.add_mesh(MeshData::cuboid([0.4; 3]));
    list.add_instance(cube, Isometry3::translation(0.0, 0.0, 0.2), Material::unlit([0.0; 3]));
    let high = 20f64.to_radians();
    list.lights.push(white_sun([high.cos() as f32, 0.0, -high.sin() as f32], 2.0, true));
    let Some(image) = picture(&list, 400, 400) else { return };
    let open = brightness(&image, -2.0, 0.0);
    assert!((open / (2.0 * high.sin()) - 1.0).abs() < 0.08, "{open}");
    for i in -35..=35 {
        for j in -35..=35 {
            let (x, y) = (f64::from(i) * 0.1, f64::from(j) * 0.1);
            // the shadow reaches from the box to x = 0.2 + 0.4 / tan 20 degrees = 1.3
            let beside = !(-0.3..=1.4).contains(&x) || y.abs() > 0.3;
            let within = x > 0.3 && x < 1.2 && y.abs() < 0.15;
            let got = brightness(&image, x, y);
            assert!(!beside || (got / open - 1.0).abs() < 0.02, "acne at {x} {y}: {got} of {open}");
            assert!(!within || got < 0.02, "light leaks at {x} {y}: {got}");
        }
    }
}

#[test]
fn ambient_occlusion_darkens_creases_and_leaves_open_ground() {
    let mut list = bare(Camera::look_at(Point3::new(6.0, 0.0, 4.0), Point3::new(0.5, 0.0, 0.0)));
    list.sky = Sky { zenith: [0.7; 3], horizon: [0.7; 3], ground: [0.7; 3], ambient: 1.0, ..Sky::flat([0.0; 3]) };
    list.settings.occlusion_m = Some(0.5);
    floor(&mut list, 3.0);
    let wall = list.add_mesh(MeshData::cuboid([0.4, 4.0, 1.0]));
    list.add_instance(wall, Isometry3::translation(-0.2, 0.0, 0.5), Material::unlit([0.0; 3]));
    let camera = list.camera;
    let at = |image: &Image, x: f32| {
        let [px, py, _] = camera.project(Point3::new(x, 0.0, 0.0), 400, 400).expect("in front");
        linear(image, px as u32, py as u32, 1)
    };
    let Some(image) = picture(&list, 400, 400) else { return };
    list.settings.occlusion_m = Some(0.0);
    let plain = picture(&list, 400, 400).expect("an adapter");
    let share = |x: f32| at(&image, x) / at(&plain, x);
    // half the sky is hidden at the foot of the wall
    assert!((0.35..0.75).contains(&share(0.04)), "in the crease: {}", share(0.04));
    assert!(share(0.04) < share(0.15) && share(0.15) < share(0.3), "{} {} {}", share(0.04), share(0.15), share(0.3));
    assert!(share(1.0) > 0.99, "beyond the reach: {}", share(1.0));
}

#[test]
fn a_turned_ball_shows_its_other_side() {
    // a striped billiard ball, its stripe around z: from above the pole is white; turned on its
    // side the number's spot or the stripe appears
    let top = |orientation: UnitQuaternion<f32>| {
        let mut list = bare(from_above(4.0));
        let material = Material { shader: tumble_render::Shader::Unlit, ..Material::billiard_ball(10) };
        list.add_sphere(Point3::origin(), 0.5, orientation, material);
        picture(&list, 200, 200).map(|image| image.pixel(100, 100).expect("inside"))
    };
    let Some(pole) = top(UnitQuaternion::identity()) else { return };
    let side =
        top(UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f32::consts::FRAC_PI_2)).expect("an adapter");
    assert!(pole[0] > 220 && pole[1] > 215 && pole[2] > 200, "ivory at the pole: {pole:?}");
    let blue = [0.05, 0.22, 0.62].map(|c: f32| (c * 255.0).round());
    assert!(
        (0..3).all(|k| (f32::from(side[k]) - blue[k]).abs() < 2.0),
        "blue stripe at the side: {side:?}, expected {blue:?}"
    );
}

/// With cheap light, patterns have another noise: the mean and the contrast of each stay.
#[test]
fn patterns_of_cheap_light_keep_color_and_contrast() {
    let patterns = [
        Pattern::Wood { dark: [0.2, 0.1, 0.05], ring_m: 0.3, board_m: 0.0 },
        Pattern::Wood { dark: [0.2, 0.1, 0.05], ring_m: 0.3, board_m: 0.7 },
        Pattern::Felt { thread_m: 0.1 },
        Pattern::Marble { vein: [0.1, 0.1, 0.2], size_m: 0.5 },
    ];
    for pattern in patterns {
        let looks = |reflections: bool| {
            let mut list = bare(from_above(10.0));
            let quad = list.add_mesh(MeshData::ground_quad(20.0));
            // inclined, so that all coordinates of the pattern count
            let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.4);
            let place = Isometry3::from_parts(Vector3::zeros().into(), tilt);
            list.add_instance(quad, place, Material { pattern, ..Material::unlit([0.7, 0.5, 0.3]) });
            Quality { reflections, ..Quality::fastest() }.apply(&mut list.settings);
            let image = picture(&list, 400, 400)?;
            let pixels: Vec<f64> = (0..160_000).map(|k| linear(&image, k % 400, k / 400, 0)).collect();
            let mean = pixels.iter().sum::<f64>() / 160_000.0;
            let variance = pixels.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 160_000.0;
            Some((image.rgba, mean, variance.sqrt()))
        };
        let (Some((full, mean, contrast)), Some((cheap, cheap_mean, cheap_contrast))) = (looks(true), looks(false))
        else {
            return;
        };
        println!("{pattern:?}: {mean:.4} ± {contrast:.4}, cheap {cheap_mean:.4} ± {cheap_contrast:.4}");
        assert!(full != cheap, "{pattern:?}: the same noise");
        assert!((cheap_mean / mean - 1.0).abs() < 0.05, "{pattern:?}: {cheap_mean} instead of {mean}");
        assert!((cheap_contrast / contrast - 1.0).abs() < 0.25, "{pattern:?}: {cheap_contrast} instead of {contrast}");
    }
}
