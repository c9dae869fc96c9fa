//! Outlines, depth and determinism, measured on pictures against the projection's closed forms.

use crate::support::{area, bare, exact_edges, from_above, linear, moments, picture, renderer};
use nalgebra::{Isometry3, Matrix4, Point3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use tumble_render::{
    Camera, DebugStyle, DrawList, Image, Instance, Material, MeshData, RenderError, Renderer, SphereCloud,
};

const WHITE: [f32; 3] = [1.0; 3];

fn ball(list: &mut DrawList, center: [f32; 3], radius: f32, color: [f32; 3]) {
    list.add_sphere(center.into(), radius, UnitQuaternion::identity(), Material::unlit(color));
}

fn block(list: &mut DrawList, half: [f32; 3], at: [f32; 3], color: [f32; 3]) -> &mut Instance {
    let mesh = list.add_mesh(MeshData::cuboid(half.map(|h| 2.0 * h)));
    list.add_instance(mesh, Isometry3::translation(at[0], at[1], at[2]), Material::unlit(color))
}

/// Semi-axes and center (pixels) of the ellipse of a sphere whose center is on the picture's
/// horizontal middle line, `angle` off the axis and `distance` away: its cone of half angle a =
/// asin(r/d) meets the plane at unit distance between tan(angle - a) and tan(angle + a). Along y
/// the ellipse's half width is sin a / sqrt(cos(angle + a) cos(angle - a)).
fn outline(radius: f64, distance: f64, angle: f64, pixels_per_tan: f64) -> (f64, f64, f64) {
    let a = (radius / distance).asin();
    let (left, right) = ((angle - a).tan(), (angle + a).tan());
    let high = a.sin() / ((angle + a).cos() * (angle - a).cos()).sqrt();
    ((right - left) / 2.0 * pixels_per_tan, high * pixels_per_tan, (right + left) / 2.0 * pixels_per_tan)
}

#[test]
fn a_ball_in_the_middle_has_the_radius_of_its_cone() {
    let mut list = bare(from_above(5.0));
    ball(&mut list, [0.0; 3], 1.0, WHITE);
    let Some(image) = picture(&list, 400, 400) else { return };
    let pixels_per_tan = 200.0 / 0.4f64.tan();
    let (a, b, _) = outline(1.0, 5.0, 0.0, pixels_per_tan);
    let (sum, x, y) = moments(&image, 0);
    assert!((sum / (PI * a * b) - 1.0).abs() < 2e-3, "area {sum}, expected {}", PI * a * b);
    assert!((x - 200.0).abs() < 0.02 && (y - 200.0).abs() < 0.02, "center {x} {y}");
}

#[test]
fn a_ball_at_the_side_is_the_predicted_ellipse() {
    let mut list = bare(from_above(5.0));
    let (x, radius) = (1.2f32, 0.5f32);
    ball(&mut list, [x, 0.0, 0.0], radius, WHITE);
    let Some(image) = picture(&list, 400, 400) else { return };
    let distance = f64::from((25.0 + x * x).sqrt());
    let (a, b, center) = outline(f64::from(radius), distance, f64::from(x / 5.0).atan(), 200.0 / 0.4f64.tan());
    let (sum, mx, my) = moments(&image, 0);
    assert!((sum / (PI * a * b) - 1.0).abs() < 3e-3, "area {sum}, expected {}", PI * a * b);
    assert!(
        (mx - 200.0 - center).abs() < 0.05 && (my - 200.0).abs() < 0.02,
        "center {mx} {my}, expected {}",
        200.0 + center
    );
}

/// Among other spheres, before and behind them, with light and shadows.
#[test]
fn a_cloud_is_drawn_as_its_spheres_are() {
    let mut list = bare(from_above(5.0));
    list.add_sphere(Point3::origin(), 0.6, UnitQuaternion::identity(), Material::plastic([0.2, 0.4, 0.9]));
    list.add_sphere(Point3::new(0.9, 0.2, 0.3), 0.2, UnitQuaternion::identity(), Material::walnut());
    let place = |k: usize| {
        let turn = 2.4 * k as f32;
        (Point3::new(0.05 * turn.cos() * k as f32, 0.05 * turn.sin() * k as f32, 0.1 * (k % 9) as f32), 0.1)
    };
    let clouds = [Material::plastic([0.9, 0.5, 0.1]), Material::unlit([0.1, 0.9, 0.2])].map(|material| SphereCloud {
        spheres: Vec::new(),
        colors: Vec::new(),
        material,
    });
    list.clouds = clouds.to_vec();
    (0..40).for_each(|k| list.clouds[k % 2].spheres.push(place(k)));
    let mut single = list.clone();
    for cloud in std::mem::take(&mut single.clouds) {
        for (center, radius) in cloud.spheres {
            single.add_sphere(center, radius, UnitQuaternion::identity(), cloud.material).casts_shadow = false;
        }
    }
    let (Some(cloud), Some(spheres)) = (picture(&list, 160, 120), picture(&single, 160, 120)) else { return };
    assert_eq!(cloud.rgba, spheres.rgba);
    list.clouds.clear();
    let without = picture(&list, 160, 120).expect("as before");
    let changed = without.rgba.chunks(4).zip(cloud.rgba.chunks(4)).filter(|(a, b)| a != b).count();
    assert!(changed > 300, "{changed} pixels show the cloud");
}

#[test]
fn a_box_covers_its_projected_face() {
    let mut list = bare(from_above(5.0));
    block(&mut list, [0.5, 0.25, 0.5], [0.3, -0.2, 0.0], WHITE);
    let Some(image) = picture(&list, 400, 400) else { return };
    // the top face, 4.5 m below the eye, from x -0.2 to 0.8 and y -0.45 to 0.05; it extends across
    // the axis, so it hides all sides
    let scale = 200.0 / 0.4f64.tan();
    let hull = 1.0 * 0.5 * (scale / 4.5).powi(2);
    let sum = area(&image, 0);
    // edges along the pixel grid are known to an eighth of a pixel with four samples
    assert!((sum / hull - 1.0).abs() < 4e-3, "area {sum}, expected {hull}");
    // edges: left edge of the top face at x = 200 + scale * -0.2/4.5, lower edge at y = 200 + scale
    // * 0.45/4.5
    let edge_x = (200.0 - scale * 0.2 / 4.5).floor() as u32;
    let edge_y = (200.0 + scale * 0.45 / 4.5).floor() as u32;
    assert_eq!((linear(&image, edge_x - 1, 200, 0), linear(&image, edge_x + 1, 200, 0)), (0.0, 1.0));
    assert_eq!((linear(&image, 220, edge_y - 1, 0), linear(&image, 220, edge_y + 1, 0)), (1.0, 0.0));
}

#[test]
fn a_cast_ball_and_a_tessellated_one_agree() {
    if !exact_edges() {
        return;
    }
    let pictures = [true, false].map(|cast| {
        let mut list = bare(Camera::look_at(Point3::new(3.0, -2.0, 2.0), Point3::new(0.3, 0.1, 0.0)));
        if cast {
            ball(&mut list, [0.0; 3], 0.6, WHITE);
        } else {
            let mesh = list.add_mesh(MeshData::uv_sphere(0.6, 200));
            list.add_instance(mesh, Isometry3::identity(), Material::unlit(WHITE));
        }
        picture(&list, 300, 200)
    });
    let [Some(cast), Some(mesh)] = pictures else { return };
    let differing = cast.rgba.chunks(4).zip(mesh.rgba.chunks(4)).filter(|(a, b)| a != b).count();
    let inner = cast.rgba.chunks(4).filter(|p| p[0] == 255).count();
    assert!(inner > 5000, "the ball is in the picture: {inner}");
    // same samples, same outline: only samples within a chord's sagitta (0.02 pixels) of the edge
    // may differ
    assert!(differing < 20, "{differing} pixels differ");
    assert!((area(&cast, 0) - area(&mesh, 0)).abs() < 6.0, "{} and {}", area(&cast, 0), area(&mesh, 0));
}

#[test]
fn edges_have_quarter_steps() {
    if !exact_edges() {
        return;
    }
    let mut list = bare(from_above(5.0));
    ball(&mut list, [0.0; 3], 1.0, WHITE);
    block(&mut list, [0.25, 0.25, 0.1], [1.5, 0.0, 0.0], WHITE).pose.rotation =
        UnitQuaternion::from_euler_angles(0.0, 0.0, 0.3);
    let Some(image) = picture(&list, 400, 400) else { return };
    let columns = [("ball", 0..300), ("box", 300..400)];
    for (what, range) in columns {
        for quarter in 1..4 {
            let close = |v: f64| (v - f64::from(quarter) / 4.0).abs() < 0.01;
            let found = (0..400u32)
                .flat_map(|y| range.clone().map(move |x| (x, y)))
                .filter(|&(x, y)| close(linear(&image, x, y, 0)))
                .count();
            assert!(found > 3, "{what}: {found} pixels are covered by {quarter} of 4 samples");
        }
    }
}

#[test]
fn nearer_things_hide_farther_ones_in_any_order() {
    // along the axis from the eye at 5 m: red sphere top at 2.0, green box top at 1.5, blue sphere
    // top at 1.0
    let build = |order: [usize; 3]| {
        let mut list = bare(from_above(5.0));
        for k in order {
            match k {
                0 => ball(&mut list, [0.0, 0.0, 1.8], 0.2, [1.0, 0.0, 0.0]),
                1 => drop(block(&mut list, [0.4, 0.4, 0.25], [0.0, 0.0, 1.25], [0.0, 1.0, 0.0])),
                _ => ball(&mut list, [0.0; 3], 1.0, [0.0, 0.0, 1.0]),
            }
        }
        list
    };
    let Some(first) = picture(&build([0, 1, 2]), 200, 200) else { return };
    let at = |x: f64| first.pixel((100.0 + x * 100.0 / 0.4f64.tan()) as u32, 100).expect("inside");
    assert_eq!(at(0.0), [255, 0, 0, 255]);
    assert_eq!(at(0.3 / 3.5), [0, 255, 0, 255], "the box beside the small ball");
    assert_eq!(at(0.7 / 4.3), [0, 0, 255, 255], "the large ball beside the box");
    assert_eq!(at(0.95 / 3.0), [0, 0, 0, 255], "nothing");
    for order in [[2, 1, 0], [1, 2, 0]] {
        assert_eq!(picture(&build(order), 200, 200).expect("an adapter").rgba, first.rgba, "order {order:?}");
    }
}

#[test]
fn a_ball_sinks_into_a_floor_at_its_waterline() {
    // a sphere of radius 1 with its center 0.6 below a plate: a cap of radius sqrt(1 - 0.36) = 0.8
    // sticks out
    let mut list = bare(from_above(10.0));
    ball(&mut list, [0.0, 0.0, -0.6], 1.0, [1.0, 0.0, 0.0]);
    let plate = list.add_mesh(MeshData::ground_quad(6.0));
    list.add_instance(plate, Isometry3::identity(), Material::unlit([0.0, 0.0, 1.0]));
    let Some(image) = picture(&list, 400, 400) else { return };
    let radius = 0.8 / 10.0 * 200.0 / 0.4f64.tan();
    let sum = area(&image, 0);
    assert!((sum / (PI * radius * radius) - 1.0).abs() < 5e-3, "area {sum}, expected {}", PI * radius * radius);
}

#[test]
fn off_axis_projection_shifts_the_picture() {
    if !exact_edges() {
        return;
    }
    // a frustum through the window x 0..2, y -1..1 at distance 1: the point straight ahead lies on
    // the left edge
    let mut projection = Matrix4::zeros();
    (projection[(0, 0)], projection[(0, 2)], projection[(1, 1)]) = (1.0, 1.0, 1.0);
    let (near, far) = (0.1, 100.0);
    (projection[(2, 2)], projection[(2, 3)], projection[(3, 2)]) =
        (far / (near - far), near * far / (near - far), -1.0);
    let Camera::LookAt { eye, .. } = from_above(5.0) else { unreachable!("from_above makes a look-at camera") };
    let view = Matrix4::look_at_rh(&eye, &Point3::origin(), &Vector3::y());
    let mut list = bare(Camera::Raw { view, projection });
    ball(&mut list, [5.0, 0.0, 0.0], 0.5, WHITE);
    let Some(image) = picture(&list, 400, 400) else { return };
    // its middle direction has tangent 1: window x = 1 of 0..2, the middle of the picture; the
    // ellipse's center as in `outline`
    let (a, b, center) = outline(0.5, 50f64.sqrt(), PI / 4.0, 200.0);
    let (sum, x, y) = moments(&image, 0);
    assert!((sum / (PI * a * b) - 1.0).abs() < 5e-3, "area {sum}, expected {}", PI * a * b);
    assert!((x - center).abs() < 0.1 && (y - 200.0).abs() < 0.05, "{x} {y}, expected {center}");
}

#[test]
fn parallel_projection_shows_true_size() {
    let mut projection = Matrix4::identity();
    (projection[(0, 0)], projection[(1, 1)], projection[(2, 2)], projection[(2, 3)]) = (0.5, 0.5, -0.1, 0.0); // 4 m wide, 10 m deep
    let view = Matrix4::look_at_rh(&Point3::new(0.3, 0.0, 5.0), &Point3::new(0.3, 0.0, 0.0), &Vector3::y());
    let mut list = bare(Camera::Raw { view, projection });
    ball(&mut list, [0.8, 0.0, 0.0], 0.6, WHITE);
    let Some(image) = picture(&list, 400, 400) else { return };
    let (sum, x, y) = moments(&image, 0);
    assert!((sum / (PI * 3600.0) - 1.0).abs() < 2e-3, "area {sum}");
    assert!((x - 250.0).abs() < 0.03 && (y - 200.0).abs() < 0.03, "{x} {y}");
}

#[test]
fn lines_are_hidden_by_what_is_in_front_unless_on_top() {
    for on_top in [false, true] {
        let mut list = bare(from_above(5.0));
        block(&mut list, [0.5, 0.5, 0.5], [0.0; 3], WHITE);
        let style = DebugStyle { on_top, ..DebugStyle::new([1.0, 0.0, 0.0]).width(4.0) };
        list.line(Point3::new(-1.5, 0.0, -1.0), Point3::new(1.5, 0.0, -1.0), style);
        let Some(image) = picture(&list, 400, 400) else { return };
        let inside = image.pixel(200, 200).expect("inside");
        assert_eq!(inside, if on_top { [255, 0, 0, 255] } else { [255; 4] });
        // 4 pixels wide where it is free: at x = -1.2, 6 m away
        let x = (200.0 - 1.2 / 6.0 * 200.0 / 0.4f64.tan()) as u32;
        let width: f64 = (0..400).map(|y| linear(&image, x, y, 0)).sum();
        assert!((width - 4.0).abs() < 0.3, "{width} pixels wide");
    }
}

#[test]
fn the_same_list_gives_the_same_bytes() {
    let (Some(mut one), Some(mut two)) = (renderer(), renderer()) else { return };
    let mut list = DrawList::default();
    for i in 0..20 {
        let at = Point3::new((i as f32 * 1.7).sin(), (i as f32 * 2.9).cos(), 0.2 + 0.05 * i as f32);
        list.add_sphere(at, 0.2, UnitQuaternion::from_euler_angles(i as f32, 0.3, 0.0), Material::billiard_ball(i));
    }
    block(&mut list, [0.5, 0.3, 0.2], [0.0, 0.0, 0.2], [0.5, 0.4, 0.3]).material = Material::walnut();
    list.ground = Some(tumble_render::Ground::grid(0.0));
    list.lights.push(tumble_render::Light::sun(Vector3::new(0.4, 0.5, -1.0), 2.0));
    list.lights.push(tumble_render::Light::lamp(Point3::new(0.0, 1.0, 4.0), 1.0, 3.0));
    list.camera = list.framing_camera(Vector3::new(-1.0, 0.7, -0.6));
    let first = one.render(&list, 320, 200).expect("valid");
    assert_eq!(first, two.render(&list, 320, 200).expect("valid"), "another renderer");
    one.render(&bare(from_above(3.0)), 64, 64).expect("valid");
    assert_eq!(first, one.render(&list, 320, 200).expect("valid"), "after another picture");
    assert!(
        first.rgba.chunks(4).any(|p| p[0] > 200) && first.rgba.chunks(4).any(|p| p[0] < 60),
        "the picture has light and dark"
    );
}

#[test]
fn balls_at_behind_and_around_the_eye() {
    let white_share = |center: [f32; 3]| {
        let mut list = bare(from_above(5.0));
        ball(&mut list, center, 1.0, WHITE);
        picture(&list, 100, 100).map(|image| area(&image, 0) / 1e4)
    };
    // 1.2 radii in front of the eye a sphere spans asin(1/1.2) = 0.985 rad to each side: more than
    // the 0.4 of the picture and the 0.54 of its corners
    let Some(close) = white_share([0.0, 0.0, 3.8]) else { return };
    assert_eq!(close, 1.0);
    assert_eq!(white_share([0.0, 0.0, 6.5]), Some(0.0), "behind the eye");
    assert_eq!(white_share([0.0, 0.0, 4.9]), Some(0.0), "around the eye: its back is not drawn");
    // abreast of the eye, its nearest direction pi/2 - asin(1/1.05) = 0.31 rad off the axis: only
    // pixels beyond tan 0.31 to that side
    let share = white_share([1.05, 0.0, 5.0]).expect("an adapter");
    assert!(share > 0.05 && share < 0.14, "{share}");
}

#[test]
fn what_lies_in_the_plane_of_the_ground_is_seen() {
    let mut list = bare(Camera::look_at(Point3::new(3.0, -2.0, 1.0), Point3::origin()));
    list.ground =
        Some(tumble_render::Ground { height_m: 0.0, reach_m: 80.0, material: Material::unlit([1.0, 0.0, 0.0]) });
    let quad = list.add_mesh(MeshData::ground_quad(120.0));
    list.add_instance(quad, Isometry3::rotation(Vector3::z() * 0.3), Material::unlit([0.0, 0.0, 1.0])).casts_shadow =
        false;
    let Some(image) = picture(&list, 300, 200) else { return };
    for y in 60..200 {
        for x in 0..300 {
            assert_eq!(image.pixel(x, y), Some([0, 0, 255, 255]), "at {x} {y}");
        }
    }
}

#[test]
fn a_body_that_fell_away_changes_nothing_for_the_rest() {
    let mut list = DrawList::default();
    ball(&mut list, [0.0, 0.0, 0.5], 0.5, WHITE);
    block(&mut list, [0.3, 0.3, 0.3], [1.0, 0.2, 0.3], WHITE).material = Material::plastic([0.8, 0.2, 0.1]);
    list.ground = Some(tumble_render::Ground::grid(0.0));
    list.lights.push(tumble_render::Light::sun(Vector3::new(0.4, 0.5, -1.0), 2.0));
    list.lights.push(tumble_render::Light::lamp(Point3::new(0.0, 1.0, 4.0), 1.0, 3.0));
    list.camera = Camera::look_at(Point3::new(5.0, -4.0, 3.0), Point3::origin());
    let Some(before) = picture(&list, 300, 200) else { return };
    ball(&mut list, [300.0, 20.0, -9000.0], 0.5, WHITE);
    assert_eq!(picture(&list, 300, 200).expect("an adapter"), before);
}

#[test]
fn an_adapter_is_chosen_by_a_part_of_its_name() {
    let Some(any) = renderer() else { return };
    let word = any.adapter().split(' ').next().unwrap().to_uppercase();
    let chosen = Renderer::with_adapter(Some(&word)).unwrap();
    assert!(chosen.adapter().to_uppercase().contains(&word));
    let refused = Renderer::with_adapter(Some("no such card")).err().unwrap().to_string();
    assert!(refused.starts_with("no graphics adapter has \"no such card\" in its name; there are: "), "{refused}");
    assert!(refused.to_uppercase().contains(&word), "{refused}");
}

#[test]
fn a_missing_adapter_names_the_packages() {
    let message = RenderError::NoAdapter { reason: "none".into() }.to_string();
    assert!(message.contains("apt-get install mesa-vulkan-drivers libvulkan1"), "{message}");
}

#[test]
fn png_gives_the_same_bytes_back() {
    let noise = |i: u32| (i.wrapping_mul(2654435761) >> 24) as u8;
    let image = Image { width: 37, height: 11, rgba: (0..37 * 11 * 4).map(noise).collect() };
    let path = std::env::temp_dir().join(format!("tumble-render-{}.png", std::process::id()));
    image.write_png(&path).expect("a temporary folder");
    let back = Image::read_png(&path);
    std::fs::remove_file(&path).expect("just written");
    assert_eq!(back.expect("a PNG"), image);
    let missing = image.write_png("no such folder/picture.png").expect_err("refused").to_string();
    assert!(missing.starts_with("no such folder/picture.png: "), "{missing}");
}

#[test]
fn bad_sizes_and_lists_leave_the_renderer_usable() {
    let Some(mut renderer) = renderer() else { return };
    let list = bare(from_above(5.0));
    for (width, height) in [(0, 10), (10, 0), (20000, 10), (16384, 16384)] {
        assert!(
            matches!(renderer.render(&list, width, height), Err(RenderError::BadSize { .. })),
            "{width} x {height}"
        );
    }
    let mut bad = list.clone();
    ball(&mut bad, [f32::NAN, 0.0, 0.0], 1.0, WHITE);
    assert!(matches!(renderer.render(&bad, 32, 32), Err(RenderError::BadValue { what: "sphere", .. })));
    let mut torn = MeshData::unit_box();
    torn.indices[0] = 99;
    let mut bad = list.clone();
    let mesh = bad.add_mesh(torn);
    bad.add_instance(mesh, Isometry3::identity(), Material::default());
    assert!(matches!(renderer.render(&bad, 32, 32), Err(RenderError::BadMesh(_))));
    let image = renderer.render(&list, 33, 7).expect("an empty list is a picture too");
    assert_eq!((image.width, image.height, image.rgba.len()), (33, 7, 33 * 7 * 4));
}
