//! Ray-cast capsules, lamps amid objects, textures by coordinates, and the orders of passes, each
//! against a closed form or another way to the same picture.

use crate::support::{area, bare, exact_edges, from_above, linear, picture};
use nalgebra::{Isometry3, Matrix4, Point3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use tumble_render::{Camera, DebugDraw, DrawList, Drawing, Image, Light, Material, MeshData};
use tumble_scene::SceneFile;

const WHITE: [f32; 3] = [1.0; 3];

/// A capsule whose axis is tipped from z by an angle, towards x.
fn tipped(angle: f32, at: [f32; 3]) -> Isometry3<f32> {
    Isometry3::from_parts(at.into(), UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle))
}

#[test]
fn a_capsule_covers_a_disc_and_a_strip() {
    // 4 m in 400 pixels, parallel view: pi r² and 2 r times the length across the view, 2 h
    // sin(angle)
    let mut projection = Matrix4::identity();
    (projection[(0, 0)], projection[(1, 1)], projection[(2, 2)], projection[(2, 3)]) = (0.5, 0.5, -0.1, 0.0);
    let view = Matrix4::look_at_rh(&Point3::new(0.0, 0.0, 5.0), &Point3::origin(), &Vector3::y());
    for (half, angle) in [(0.5f32, PI / 2.0), (0.5, 0.6), (0.5, 0.0), (0.0, 0.3)] {
        let mut list = bare(Camera::Raw { view, projection });
        list.add_capsule(tipped(angle as f32, [0.1, 0.2, 0.0]), 0.3, 2.0 * half, Material::unlit(WHITE));
        let Some(image) = picture(&list, 400, 400) else { return };
        let expected = 1e4 * (PI * 0.09 + 0.6 * 2.0 * f64::from(half) * angle.sin());
        assert!(
            (area(&image, 0) / expected - 1.0).abs() < 3e-3,
            "half length {half}, {angle} rad: {} of {expected}",
            area(&image, 0)
        );
    }
}

/// Triangles of half a pixel once had speckled shadows because their points lay slightly off the
/// surface (1,100 pixels of the first pair).
#[test]
fn a_cast_capsule_and_a_tessellated_one_agree() {
    if !exact_edges() {
        return;
    }
    let lit = Material { roughness: 0.6, ..Material::plastic([0.8, 0.7, 0.6]) };
    for (pose, camera) in [
        (tipped(0.7, [0.1, 0.0, 0.2]), Camera::look_at(Point3::new(2.0, -1.5, 1.5), Point3::new(0.1, 0.1, 0.0))),
        // along the axis, and into one end from near
        (tipped(0.0, [0.0; 3]), from_above(3.0)),
        (tipped(1.2, [0.0; 3]), Camera::look_at(Point3::new(1.2, 0.3, 0.5), Point3::origin())),
    ] {
        let pictures = [true, false].map(|cast| {
            let mut list = bare(camera);
            list.lights.push(Light::sun(Vector3::new(0.3, 0.4, -1.0), 0.6));
            if cast {
                list.add_capsule(pose, 0.3, 1.0, lit);
            } else {
                let mesh = list.add_mesh(MeshData::capsule(0.3, 1.0, 400));
                list.add_instance(mesh, pose, lit);
            }
            picture(&list, 300, 200)
        });
        let [Some(cast), Some(mesh)] = pictures else { return };
        let off = |least: u8| cast.rgba.iter().zip(&mesh.rgba).filter(|(a, b)| a.abs_diff(**b) > least).count();
        assert!(area(&mesh, 0) > 500.0, "it is in the picture: {}", area(&mesh, 0));
        // light within two levels everywhere except at edges of coverage, which may differ by a
        // chord's sagitta
        assert!(
            off(2) < 400 && off(40) < 60,
            "{} channels differ by more than 2 levels, {} by more than 40",
            off(2),
            off(40)
        );
    }
}

#[test]
fn the_shadow_of_a_capsule_lies_where_the_light_leaves_it() {
    // along y at height 2, light leaning 45 degrees towards +x: around x = 2, 0.3 sqrt 2 wide to
    // both sides, from y = -0.8 to 0.8
    let mut list = bare(from_above(10.0));
    let floor = list.add_mesh(MeshData::ground_quad(7.0));
    list.add_instance(floor, Isometry3::identity(), Material { roughness: 1.0, ..Material::matte(WHITE) })
        .casts_shadow = false;
    let along_y = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI as f32 / 2.0);
    list.add_capsule(
        Isometry3::from_parts(Vector3::new(0.0, 0.0, 2.0).into(), along_y),
        0.3,
        1.0,
        Material::unlit([0.0; 3]),
    );
    list.lights.push(crate::support::white_sun([1.0, 0.0, -1.0], 1.0, true));
    let Some(image) = picture(&list, 400, 400) else { return };
    let scale = 200.0 / 0.4f64.tan() / 10.0;
    let at = |x: f64, y: f64| linear(&image, (200.0 + x * scale) as u32, (200.0 - y * scale) as u32, 1);
    for y in [-0.45, 0.0, 0.45] {
        assert!(
            at(2.0, y) < 0.02 && at(2.37, y) < 0.02 && at(1.63, y) < 0.02 && at(2.48, y) > 0.6 && at(1.52, y) > 0.6,
            "across at {y}: {:?}",
            [1.52, 1.63, 2.0, 2.37, 2.48].map(|x| at(x, y))
        );
    }
    assert!(
        at(2.0, 0.75) < 0.02 && at(2.0, -0.75) < 0.02 && at(2.0, 0.86) > 0.6 && at(2.0, -0.86) > 0.6,
        "along: {:?}",
        [-0.86, -0.75, 0.75, 0.86].map(|y| at(2.0, y))
    );
}

/// Spheres, capsules and boxes that hide and cut each other, over a floor, in unlit colors.
fn medley() -> DrawList {
    let mut list = bare(Camera::look_at(Point3::new(3.0, -2.5, 2.0), Point3::new(0.0, 0.0, 0.3)));
    let cube = list.add_mesh(MeshData::cuboid([0.8, 0.6, 0.7]));
    for i in 0..6 {
        let (x, y, shade) = (-1.2 + 0.5 * i as f32, 0.4 * (i % 3) as f32 - 0.4, 0.15 * i as f32);
        list.add_instance(
            cube,
            Isometry3::new(Vector3::new(x, y, 0.3), Vector3::new(0.3, 0.2 * i as f32, 0.5)),
            Material::unlit([shade, 1.0, 0.2]),
        );
        list.add_sphere(
            Point3::new(x + 0.2, y - 0.5, 0.35),
            0.35,
            UnitQuaternion::identity(),
            Material::unlit([1.0, shade, 0.1]),
        );
        list.add_capsule(tipped(0.4 * i as f32, [x, y + 0.3, 0.6]), 0.15, 1.0, Material::unlit([0.1, shade, 1.0]));
    }
    list.ground =
        Some(tumble_render::Ground { height_m: 0.0, reach_m: 30.0, material: Material::unlit([0.5, 0.5, 0.4]) });
    list.sky = tumble_render::Sky::default();
    list
}

/// With one sample per pixel, spheres are drawn first, or all depth first if occlusion needs it.
/// The nearest surface is the same.
#[test]
fn whichever_depth_comes_first_the_nearest_is_seen() {
    let mut list = medley();
    list.settings.samples = 1;
    let Some(spheres_first) = picture(&list, 300, 200) else { return };
    list.settings.occlusion_m = Some(0.2);
    let all_first = picture(&list, 300, 200).expect("an adapter");
    let differing = spheres_first.rgba.chunks(4).zip(all_first.rgba.chunks(4)).filter(|(a, b)| a != b).count();
    // at the intersection of a cast surface and a mesh, depths that differ in their last bits may
    // swap
    assert!(differing < 10, "{differing} pixels differ");
    // and with four samples, except at edges
    list.settings.samples = 4;
    let smooth = picture(&list, 300, 200).expect("an adapter");
    let inside = spheres_first.rgba.chunks(4).zip(smooth.rgba.chunks(4)).filter(|(a, b)| a == b).count();
    assert!(inside * 10 > 9 * 300 * 200, "{inside} pixels are alike");
}

#[test]
fn a_lamp_amid_posts_throws_a_shadow_behind_each() {
    // the lamp at height 1, plates 0.5 high and 0.4 wide at a distance of 1 in eight directions:
    // the shadow of each reaches from 1 to 1 / (1 - 0.5) = 2, and is 0.2 times the distance wide to
    // both sides
    let mut list = bare(from_above(10.0));
    let floor = list.add_mesh(MeshData::ground_quad(7.0));
    list.add_instance(floor, Isometry3::identity(), Material { roughness: 1.0, ..Material::matte(WHITE) })
        .casts_shadow = false;
    let plate = list.add_mesh(MeshData::cuboid([0.01, 0.4, 0.5]));
    let directions: Vec<f64> = (0..8).map(|i| f64::from(i) * PI / 4.0 + 0.1).collect();
    for &a in &directions {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), a as f32);
        list.add_instance(
            plate,
            Isometry3::from_parts((turn * Vector3::new(1.0, 0.0, 0.25)).into(), turn),
            Material::unlit([0.0; 3]),
        );
    }
    // an object above the lamp puts it inside the box of the casters
    list.add_instance(plate, Isometry3::translation(0.0, 0.0, 2.0), Material::unlit([0.0; 3]));
    list.lights.push(Light::Point {
        position: Point3::new(0.0, 0.0, 1.0),
        color: WHITE,
        intensity: 2.0,
        radius_m: 0.0,
        casts_shadow: true,
    });
    let Some(image) = picture(&list, 400, 400) else { return };
    let scale = 200.0 / 0.4f64.tan() / 10.0;
    let share = |a: f64, along: f64, aside: f64| {
        let (x, y) = (along * a.cos() - aside * a.sin(), along * a.sin() + aside * a.cos());
        let d2 = x * x + y * y + 1.0;
        linear(&image, (200.0 + x * scale) as u32, (200.0 - y * scale) as u32, 1) / (2.0 / d2 / d2.sqrt())
    };
    for &a in &directions {
        for (along, aside) in [(1.15, 0.0), (1.5, 0.0), (1.5, 0.24), (1.5, -0.24), (1.9, 0.0)] {
            assert!(
                share(a, along, aside) < 0.03,
                "in shade at {along} {aside} of {a} rad: {}",
                share(a, along, aside)
            );
        }
        for (along, aside) in [(0.85, 0.0), (1.5, 0.38), (1.5, -0.38), (2.15, 0.0)] {
            assert!(
                (share(a, along, aside) - 1.0).abs() < 0.08,
                "lit at {along} {aside} of {a} rad: {}",
                share(a, along, aside)
            );
        }
    }
}

/// A cube whose faces have a texture of a red and a blue half: by its coordinates the halves are
/// apart along y on the top face.
#[test]
fn a_texture_lies_where_the_coordinates_of_the_file_say() {
    let folder = std::env::temp_dir().join(format!("tumble-unwrapped-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (red, blue) = ([255, 0, 0, 255], [0, 0, 255, 255]);
    let rgba = (0..32).flat_map(|i| if i % 8 < 4 { red } else { blue }).collect();
    Image { width: 8, height: 4, rgba }.write_png(folder.join("t.png")).unwrap();
    let corners = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nvt 0 0\nvt 0 1\nvt 1 1\nvt 1 0\n";
    // u runs from 0 at y = -1 to 1 at y = 1 above: corners 5 6 7 8 have (0 0) (0 1) (1 1) (1 0)
    let faces = "f 5/1 6/2 7/3 8/4\nf 4/1 3/2 2/3 1/4\nf 1/1 2/2 6/3 5/4\nf 3/1 4/2 8/3 7/4\nf 2/1 3/2 7/3 6/4\nf 4/1 1/2 5/3 8/4\n";
    std::fs::write(folder.join("c.obj"), format!("{corners}{faces}")).unwrap();
    let text = "[materials.m]\ntexture = \"t.png\"\n[meshes.c]\ntype = \"file\"\nfile = \"c.obj\"\n[[body]]\nname = \"b\"\nmode = \"static\"\n\
        shape = { type = \"mesh\", mesh = \"c\" }\nmaterial = \"m\"\n";
    let scene = SceneFile::parse(text, &folder.join("s.toml").display().to_string()).unwrap_or_else(|e| panic!("{e}"));
    let (world, _) = scene.build().unwrap();
    let mut list = Drawing::new(&scene).list(&world, &DebugDraw::default()).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(list.to_text().contains("unwrapped"), "{}", list.to_text());
    // half the texture's width over 1 m
    assert!(list.meshes[0].unwrapped.iter().all(|p| (p[2] - 0.5).abs() < 1e-6), "{:?}", list.meshes[0].unwrapped);
    list.camera = from_above(6.0);
    let Some(image) = picture(&list, 200, 200) else { return };
    let reddish = |x: u32, y: u32| linear(&image, x, y, 0) > 3.0 * linear(&image, x, y, 2);
    let bluish = |x: u32, y: u32| linear(&image, x, y, 2) > 3.0 * linear(&image, x, y, 0);
    for x in [80, 100, 120] {
        assert!(reddish(x, 120) && reddish(x, 110) && bluish(x, 80) && bluish(x, 90), "column {x}");
    }
}
