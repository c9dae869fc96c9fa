//! Finishing of facet pictures: stereo, mirroring, warps, blends, calibration.

use crate::support::renderer;
use nalgebra::{Point3, Vector3};
use tumble_render::{Blend, CalibrationPattern, CaveView, DrawList, Image, Light, Material, Warp, calibration_picture};
use tumble_scene::SceneFile;
use tumble_scene::cave::{Cave, Stereo, resolve_cave, shipped_caves};

/// A picture whose every pixel is different.
fn colorful(width: u32, height: u32) -> Image {
    let pixel = |x: u32, y: u32| [(7 * x + 3 * y) as u8, (x * y) as u8, (40 + 11 * y) as u8, 255];
    Image { width, height, rgba: (0..height).flat_map(|y| (0..width).flat_map(move |x| pixel(x, y))).collect() }
}

const UNIT: &str = "v 0 0\nv 1 0\nv 1 1\nv 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

#[test]
fn a_warp_that_changes_nothing_changes_no_byte() {
    let image = colorful(37, 23);
    assert_eq!(Warp::from_obj(format!("{UNIT}f 1/1 2/2 3/3 4/4\n").as_bytes()).unwrap().apply(&image), image);
    let mut pfm = b"PF\n5 4\n-1.0\n".to_vec();
    for y in 0..4 {
        for x in 0..5 {
            for value in [x as f32 / 4.0, y as f32 / 3.0, 0.0] {
                pfm.extend(value.to_le_bytes());
            }
        }
    }
    assert_eq!(Warp::from_pfm(&pfm).unwrap().apply(&image), image);
}

#[test]
fn a_mirroring_warp_mirrors_and_a_half_leaves_the_rest_black() {
    let image = colorful(20, 10);
    let mirrored = Warp::from_obj(format!("{UNIT}f 1/2 2/1 3/4 4/3\n").as_bytes()).unwrap().apply(&image);
    let half = Warp::from_obj(
        "v 0 0\nv 0.5 0\nv 0.5 1\nv 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n".as_bytes(),
    )
    .unwrap()
    .apply(&image);
    for y in 0..10 {
        for x in 0..20 {
            assert_eq!(mirrored.pixel(x, y), image.pixel(19 - x, y));
        }
        assert!((10..20).all(|x| half.pixel(x, y) == Some([0, 0, 0, 255])));
        // the fourth pixel shows the point between the seventh and the eighth
        let between = |k: usize| (image.pixel(6, y).unwrap()[k], image.pixel(7, y).unwrap()[k]);
        let got = half.pixel(3, y).unwrap();
        assert!((0..3).all(|k| got[k] >= between(k).0.min(between(k).1) && got[k] <= between(k).0.max(between(k).1)));
    }
}

/// A grid of 3 x 3 places whose corner is slightly outside shows the picture's edge there, as an
/// OBJ does. A place marked by -1 stays black with its cell.
#[test]
fn a_place_slightly_outside_blacks_out_no_cell() {
    let image = colorful(40, 40);
    let bent = |corner: [f32; 2]| {
        let mut pfm = b"PF\n3 3\n-1.0\n".to_vec();
        let mut obj = String::new();
        for (i, (x, y)) in (0..3).flat_map(|y| (0..3).map(move |x| (x as f32 / 2.0, y as f32 / 2.0))).enumerate() {
            let [u, v] = if i == 0 { corner } else { [x, y] };
            [u, v, 0.0].iter().for_each(|value| pfm.extend(value.to_le_bytes()));
            obj += &format!("v {x} {y}\nvt {} {}\n", f64::from(u), f64::from(v));
        }
        for [a, b, c, d] in [[1, 2, 5, 4], [2, 3, 6, 5], [4, 5, 8, 7], [5, 6, 9, 8]] {
            obj += &format!("f {a} {b} {c} {d}\n");
        }
        (Warp::from_pfm(&pfm).unwrap().apply(&image), obj)
    };
    let (outside, obj) = bent([-0.1, -0.05]);
    assert_eq!(outside, Warp::from_obj(obj.as_bytes()).unwrap().apply(&image));
    assert!((0..1600).all(|i| outside.pixel(i % 40, i / 40) != Some([0, 0, 0, 255])
        || image.pixel(i % 40, i / 40) == Some([0, 0, 0, 255])));
    let (marked, _) = bent([-1.0, -1.0]);
    let black = (0..1600).filter(|i| marked.pixel(i % 40, i / 40) == Some([0, 0, 0, 255])).count();
    assert_eq!(black, 400, "the lower left quarter");
}

#[test]
fn bad_warps_say_what_is_wrong_and_where() {
    let obj = |text: &str| Warp::from_obj(text.as_bytes()).unwrap_err();
    assert!(obj("v 0 0\nv 1 zero\n").starts_with("line 2: expected `v x y`"));
    assert!(
        obj(&format!("{UNIT}f 1/1 2/2 9/3\n"))
            .contains("line 9: the corner `9/3` names no `v` above it, of which there are 4")
    );
    for pixels in ["v 0 0\nv 480 320\n", "v 0 0\nvt 480 320\n", "v 0 0\nv 1.6 0\n", "v 0 0\nv 0 -0.6\n"] {
        assert!(
            obj(pixels).starts_with("line 2: expected `v") && obj(pixels).contains("not pixels"),
            "{}",
            obj(pixels)
        );
    }
    // a grid for a projector that throws past its screen
    assert!(Warp::from_obj(b"v -0.2 -0.2\nv 1.3 -0.2\nv 0.5 1.5\nvt -0.1 0\nvt 1.1 0\nvt 0.5 1.2\nf 1 2 3\n").is_ok());
    // quads over the whole picture are two triangles with a box of one picture each: 50 are
    // accepted
    assert!(Warp::from_obj(format!("{UNIT}{}", "f 1 2 3 4\n".repeat(50)).as_bytes()).is_ok());
    assert!(obj(&format!("{UNIT}{}", "f 1 2 3 4\n".repeat(3000))).contains("cover the picture 6000 times"));
    assert!(obj(&format!("{UNIT}f 1/1 2/2\n")).contains("a face of 2 corners"));
    assert!(obj("# nothing\n").contains("has no faces"));
    let pfm = |bytes: &[u8]| Warp::from_pfm(bytes).unwrap_err();
    assert!(pfm(b"PF\n3").contains("cut off"));
    assert!(pfm(b"PF\n1 9 -1.0\n").contains("the side 1"));
    assert!(pfm(b"PF\n4 4 -1.0\nxx").contains("2 bytes of floats, expected 192"));
    assert!(pfm(b"PF\n9999999 4 -1.0\n").contains("expected 2 to 4096"));
    let error = Warp::load(std::path::Path::new("/nowhere/a.obj")).unwrap_err().to_string();
    assert!(error.starts_with("/nowhere/a.obj: the warp grid cannot be read"), "{error}");
}

#[test]
fn a_blend_takes_its_share_of_the_light() {
    let folder = std::env::temp_dir().join(format!("tumble-blend-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("mask.png");
    // 255 keeps all, 0 nothing, 51 a fifth of the light
    let mask = Image { width: 3, height: 1, rgba: vec![255, 255, 255, 255, 0, 0, 0, 255, 51, 51, 51, 255] };
    mask.write_png(&path).unwrap();
    let mut image = Image { width: 3, height: 1, rgba: [255, 200, 100, 255].repeat(3) };
    Blend::load(&path, [3, 1]).unwrap().apply(&mut image);
    assert_eq!(image.rgba[..8], [255, 200, 100, 255, 0, 0, 0, 255]);
    // a fifth of full light: 1.055 * 0.2^(1/2.4) - 0.055 = 0.4845 of 255
    assert_eq!(image.rgba[8], 124);
    let error = Blend::load(&path, [4, 1]).unwrap_err().to_string();
    assert!(error.contains("the blend mask is 3 x 1 pixels, and the facet's picture 4 x 1"), "{error}");
    assert!(Blend::load(&folder.join("none.png"), [3, 1]).is_err());
    std::fs::remove_dir_all(&folder).unwrap();
}

/// The limits on cave files are those of the renderer.
#[test]
fn cave_files_know_how_large_a_picture_may_be() {
    use tumble_scene::cave::{MAX_PIXELS, MAX_SIDE_PX, RIM_PX};
    assert_eq!(
        (MAX_SIDE_PX, MAX_PIXELS, RIM_PX),
        (tumble_render::MAX_SIDE, tumble_render::MAX_PIXELS, tumble_render::RIM_PX)
    );
}

fn cave(facet: &str) -> Cave {
    let text = format!(
        "[[user]]\nname = \"u\"\neye_m = [0, 0, 1]\ninterpupillary_m = 0.1\n[[screen]]\nname = \"s\"\nlower_left_m = [-1, 2, 0]\nlower_right_m = [1, 2, 0]\nupper_left_m = [-1, 2, 2]\n[[facet]]\nname = \"f\"\nscreen = \"s\"\nsize_px = [100, 100]\n{facet}\n"
    );
    Cave::parse(&text, "my.toml").unwrap_or_else(|e| panic!("{e}"))
}

/// A scene with its cave at the origin.
fn empty_scene() -> SceneFile {
    SceneFile::parse("[cave]\norigin_m = [0, 0, 0]\n", "my.toml").unwrap()
}

/// A white sphere in unlit surroundings: 4 m ahead at eye height, behind the screen.
fn ball() -> DrawList {
    let mut list = crate::support::bare(tumble_render::Camera::default());
    list.add_sphere(Point3::new(0.0, 4.0, 1.0), 0.2, nalgebra::UnitQuaternion::identity(), Material::unlit([1.0; 3]));
    list.lights.push(Light::sun(Vector3::y(), 1.0));
    list
}

fn middle(image: &Image, channel: usize, from: u32, to: u32) -> f64 {
    let lit: Vec<f64> = (0..image.height)
        .flat_map(|y| (from..to).map(move |x| (x, y)))
        .filter(|&(x, y)| image.pixel(x, y).unwrap()[channel] > 128)
        .map(|(x, _)| f64::from(x) + 0.5)
        .collect();
    lit.iter().sum::<f64>() / lit.len() as f64
}

#[test]
fn eyes_see_the_ball_apart_by_what_similar_triangles_say() {
    let Some(mut renderer) = renderer() else { return };
    let mut draw = |facet: &str| {
        let view = CaveView::new(cave(facet), &empty_scene()).unwrap();
        view.draw(&mut renderer, &ball(), &view.cave().facets[0]).unwrap()
    };
    // eyes 0.1 m apart, screen at 2 m, sphere at 4 m: its images on the screen are 0.05 m apart, at
    // 50 pixels per meter; the left eye sees it to the right of its own axis: at -0.05 + 0.05 * 2 /
    // 4 = -0.025 m
    let side = draw("stereo = \"side_by_side\"");
    assert_eq!((side.width, side.height), (200, 100));
    let (left, right) = (middle(&side, 0, 0, 100), middle(&side, 0, 100, 200) - 100.0);
    assert!((left - 48.75).abs() < 0.1 && (right - 51.25).abs() < 0.1, "{left} {right}");
    let below = draw("stereo = \"top_bottom\"");
    assert_eq!((below.width, below.height), (100, 200));
    assert_eq!(
        below.rgba[..4 * 100 * 50],
        side.rgba.chunks_exact(800).take(50).flat_map(|row| row[..400].to_vec()).collect::<Vec<u8>>()[..]
    );
    let red_cyan = draw("stereo = \"anaglyph\"");
    assert_eq!((red_cyan.width, red_cyan.height), (100, 100));
    assert!((middle(&red_cyan, 0, 0, 100) - left).abs() < 1e-9 && (middle(&red_cyan, 2, 0, 100) - right).abs() < 1e-9);
    let mono = draw("");
    assert!((middle(&mono, 0, 0, 100) - 50.0).abs() < 0.1);
}

/// Interlaced pictures have whole pixels of the eyes' own pictures, each where the display shows it to that
/// eye; mirroring happens before. On the device and in memory.
#[test]
fn interlaced_eyes_have_their_own_pixels() {
    let Some(mut renderer) = renderer() else { return };
    let mut list = ball();
    let color = Material::unlit([0.2, 0.9, 0.4]);
    list.add_sphere(Point3::new(0.8, 4.0, 1.6), 0.3, nalgebra::UnitQuaternion::identity(), color);
    for flip in ["", "flip = \"both\""] {
        let mut draw = |keys: &str, frame: u64| {
            let mut view = CaveView::new(cave(&format!("{flip}\n{keys}")), &empty_scene()).unwrap();
            view.set_frame(frame);
            let facet = view.cave().facets[0].clone();
            let picture = view.draw(&mut renderer, &list, &facet).unwrap();
            assert_eq!(picture, view.draw_in_memory(&mut renderer, &list, &facet).unwrap(), "{keys}");
            picture
        };
        let (left, right) = (draw("stereo = \"left\"", 0), draw("stereo = \"right\"", 0));
        assert_ne!(left, right);
        type IsFirst = fn(u32, u32) -> bool;
        let modes: [(&str, IsFirst); 3] =
            [("rows", |_, y| y % 2 == 0), ("columns", |x, _| x % 2 == 0), ("checkerboard", |x, y| (x + y) % 2 == 0)];
        for (name, is_first) in modes {
            let plain = draw(&format!("stereo = \"{name}\""), 0);
            let swapped = draw(&format!("stereo = \"{name}\"\nswap_eyes = true"), 0);
            for (x, y) in (0..100).flat_map(|y| (0..100).map(move |x| (x, y))) {
                let [first, second] = [&left, &right].map(|eye| eye.pixel(x, y));
                let [first, second] = if is_first(x, y) { [first, second] } else { [second, first] };
                assert_eq!((plain.pixel(x, y), swapped.pixel(x, y)), (first, second), "{name} {x} {y}");
            }
        }
        let frames = [4, 5].map(|frame| draw("stereo = \"frame_sequential\"", frame));
        assert_eq!(frames, [left.clone(), right.clone()]);
        let side = draw("stereo = \"side_by_side\"\nswap_eyes = true", 0);
        assert!((0..100).all(|x| side.pixel(x, 50) == right.pixel(x, 50)));
        assert!((0..100).all(|x| side.pixel(100 + x, 50) == left.pixel(x, 50)));
    }
}

/// The eyes of curved screens are interlaced in the same pass that puts their pictures together.
#[test]
fn interlaced_eyes_have_their_own_pixels_on_a_curved_screen() {
    let Some(mut renderer) = renderer() else { return };
    let (list, mut dome) = (ball(), resolve_cave("dome").unwrap().load().unwrap());
    dome.facets[0].size_px = [96, 96];
    let mut draw = |stereo: Stereo| {
        let mut cave = dome.clone();
        cave.facets[0].stereo = stereo;
        let view = CaveView::new(cave, &empty_scene()).unwrap();
        view.draw(&mut renderer, &list, &view.cave().facets[0]).unwrap()
    };
    let (left, right, mixed) = (draw(Stereo::Left), draw(Stereo::Right), draw(Stereo::Checkerboard));
    assert_ne!(left, right);
    for (x, y) in (0..96).flat_map(|y| (0..96).map(move |x| (x, y))) {
        let eye = if (x + y) % 2 == 0 { &left } else { &right };
        assert_eq!(mixed.pixel(x, y), eye.pixel(x, y), "{x} {y}");
    }
}

#[test]
fn flips_mirror_the_finished_picture() {
    let Some(mut renderer) = renderer() else { return };
    let mut list = ball();
    list.add_sphere(
        Point3::new(0.8, 4.0, 1.6),
        0.3,
        nalgebra::UnitQuaternion::identity(),
        Material::unlit([0.2, 0.9, 0.4]),
    );
    let mut draw = |flip: &str| {
        let view = CaveView::new(cave(&format!("flip = \"{flip}\"")), &empty_scene()).unwrap();
        view.draw(&mut renderer, &list, &view.cave().facets[0]).unwrap()
    };
    let (plain, across, upward, both) = (draw("none"), draw("horizontal"), draw("vertical"), draw("both"));
    for (x, y) in (0..100).flat_map(|y| (0..100).map(move |x| (x, y))) {
        assert_eq!(plain.pixel(x, y), across.pixel(99 - x, y));
        assert_eq!(plain.pixel(x, y), upward.pixel(x, 99 - y));
        assert_eq!(plain.pixel(x, y), both.pixel(99 - x, 99 - y));
    }
    assert_ne!(plain, across);
}

/// Mirroring is for projectors behind the screen: each eye's picture is mirrored in its own half
/// and stays with its eye.
#[test]
fn each_eye_is_mirrored_in_its_own_place() {
    let Some(mut renderer) = renderer() else { return };
    let mut list = ball();
    list.add_sphere(
        Point3::new(0.8, 4.0, 1.6),
        0.3,
        nalgebra::UnitQuaternion::identity(),
        Material::unlit([0.2, 0.9, 0.4]),
    );
    let mut draw = |stereo: &str, flip: &str| {
        let view = CaveView::new(cave(&format!("stereo = \"{stereo}\"\nflip = \"{flip}\"")), &empty_scene()).unwrap();
        view.draw(&mut renderer, &list, &view.cave().facets[0]).unwrap()
    };
    for (stereo, eyes) in
        [("side_by_side", vec![[0, 0], [100, 0]]), ("top_bottom", vec![[0, 0], [0, 100]]), ("anaglyph", vec![[0, 0]])]
    {
        let plain = draw(stereo, "none");
        for (flip, across, upward) in [("horizontal", true, false), ("vertical", false, true), ("both", true, true)] {
            let mirrored = draw(stereo, flip);
            assert_ne!(plain, mirrored, "{stereo}, {flip}");
            for (&[x0, y0], (x, y)) in eyes.iter().flat_map(|eye| (0..10_000).map(move |i| (eye, (i % 100, i / 100)))) {
                let there = [x0 + if across { 99 - x } else { x }, y0 + if upward { 99 - y } else { y }];
                assert_eq!(
                    plain.pixel(x0 + x, y0 + y),
                    mirrored.pixel(there[0], there[1]),
                    "{stereo}, {flip}: {x} {y} of the eye at {x0} {y0}"
                );
            }
        }
    }
}

#[test]
fn a_scene_puts_its_cave_and_scales_it() {
    // a quarter turn to the left and doubled: the cave's y is the world's -x
    let scene = SceneFile::parse("[cave]\norigin_m = [10, 20, 30]\nheading_deg = 90\nscale = 2\n", "my.toml").unwrap();
    let view = CaveView::new(cave(""), &scene).unwrap();
    let eye = view.eye(&view.cave().facets[0], 0.0).unwrap();
    // the screen's middle is at (0, 2, 1) of the cave
    let ndc = eye.project(&Point3::new(10.0 - 4.0, 20.0, 32.0)).unwrap();
    assert!(ndc.x.abs() < 1e-12 && ndc.y.abs() < 1e-12, "{ndc:?}");
    // without [cave] the user stands with the eye at the camera, upright, facing as it does: here
    // along x
    let scene = SceneFile::parse("[camera]\neye_m = [1, 2, 3]\ntarget_m = [4, 2, 1]\n", "my.toml").unwrap();
    let view = CaveView::new(cave(""), &scene).unwrap();
    let ndc = view.eye(&view.cave().facets[0], 0.0).unwrap().project(&Point3::new(9.0, 2.0, 3.0)).unwrap();
    assert!(ndc.x.abs() < 1e-12 && ndc.y.abs() < 1e-12, "{ndc:?}");
}

#[test]
fn calibration_pictures_have_their_lines_where_a_tape_measures_them() {
    // 2 m on 400 pixels: half meters are 100 pixels apart, and the middle cross at 200
    let mut cave = cave("");
    cave.facets[0].size_px = [400, 400];
    let grid = calibration_picture(&cave, &cave.facets[0], CalibrationPattern::Grid);
    assert_eq!((grid.width, grid.height), (400, 400));
    let white = |x: u32, y: u32| grid.pixel(x, y) == Some([255, 255, 255, 255]);
    assert!((0..400).all(|i| white(i, 0) && white(i, 399) && white(0, i) && white(399, i)), "the rim");
    assert!(
        white(99, 30) && white(100, 30) && white(300, 30) && !white(103, 30) && !white(200, 30),
        "lines of half a meter"
    );
    for shipped in shipped_caves() {
        let cave = shipped.read().unwrap();
        let facet = &cave.facets[0];
        let pictures =
            ["grid", "corners", "colors", "name"].map(|word| calibration_picture(&cave, facet, word.parse().unwrap()));
        for picture in &pictures {
            assert_eq!([picture.width, picture.height], facet.whole_px());
            let lit = picture.rgba.chunks_exact(4).filter(|p| p[..3].iter().any(|&c| c > 60)).count();
            assert!(lit * 300 > picture.rgba.len() / 4, "{} pixels are lit", lit);
        }
        assert!((0..4).all(|i| (0..i).all(|j| pictures[i] != pictures[j])));
    }
    assert!("gird".parse::<CalibrationPattern>().is_err());
}

#[test]
fn calibration_pictures_of_every_small_size_are_drawn() {
    let mut cave = cave("");
    // 1 x 1 to 64 x 64, and long ones that are only low or only narrow
    let sizes = (1..=64).flat_map(|h| (1..=64).map(move |w| [w, h])).chain((1..=64).flat_map(|n| [[500, n], [n, 500]]));
    for size in sizes {
        cave.facets[0].size_px = size;
        for word in ["grid", "corners", "colors", "name"] {
            let picture = calibration_picture(&cave, &cave.facets[0], word.parse().unwrap());
            assert_eq!(
                ([picture.width, picture.height], picture.rgba.len() as u32),
                (size, 4 * size[0] * size[1]),
                "{word}"
            );
        }
    }
}

/// A cave whose facet warps its picture by a wavy grid and darkens it towards an edge; the files
/// are in a folder of their own.
fn bent_cave(folder: &std::path::Path, facet: &str) -> CaveView {
    std::fs::create_dir_all(folder).unwrap();
    let (mut obj, n) = (String::new(), 8);
    for y in 0..=n {
        for x in 0..=n {
            let (u, v) = (x as f64 / n as f64, y as f64 / n as f64);
            obj += &format!(
                "v {u} {v}\nvt {} {}\n",
                0.06 + 0.88 * u + 0.03 * (5.0 * v).sin(),
                0.05 + 0.9 * v + 0.03 * (7.0 * u).cos()
            );
        }
    }
    for y in 0..n {
        for x in 0..n {
            let a = y * (n + 1) + x + 1;
            // a corner of the grid is missing, and black
            if x + y > 0 {
                obj += &[a, a + 1, a + n + 2, a + n + 1].iter().fold("f".to_string(), |f, i| format!("{f} {i}/{i}"));
                obj += "\n";
            }
        }
    }
    std::fs::write(folder.join("warp.obj"), obj).unwrap();
    let mask = Image {
        width: 100,
        height: 100,
        rgba: (0..10_000u32).flat_map(|i| [(255 - i % 100) as u8, (155 + i % 100) as u8, 255, 255]).collect(),
    };
    mask.write_png(folder.join("mask.png")).unwrap();
    let (warp, blend) = (folder.join("warp.obj"), folder.join("mask.png"));
    let cave = cave(&format!("{facet}\nwarp_file = \"{}\"\nblend_file = \"{}\"", warp.display(), blend.display()));
    CaveView::new(cave, &empty_scene()).unwrap()
}

#[test]
fn finishing_on_the_device_is_finishing_in_memory_within_a_level() {
    let Some(mut renderer) = renderer() else { return };
    let mut list = ball();
    for i in 0..40 {
        let (x, z) = ((i % 8) as f32 * 0.3 - 1.0, (i / 8) as f32 * 0.4 + 0.2);
        list.add_sphere(
            Point3::new(x, 4.0 + 0.1 * x, z),
            0.12,
            nalgebra::UnitQuaternion::identity(),
            Material::plastic([0.3 + 0.01 * i as f32, 0.8 - 0.015 * i as f32, 0.5]),
        );
    }
    let folder = std::env::temp_dir().join(format!("tumble-finish-{}", std::process::id()));
    for stereo in ["mono", "side_by_side", "top_bottom", "anaglyph"] {
        for flip in ["none", "horizontal", "both"] {
            for bent in [false, true] {
                let facet = format!("stereo = \"{stereo}\"\nflip = \"{flip}\"");
                let view = if bent {
                    bent_cave(&folder, &facet)
                } else {
                    CaveView::new(cave(&facet), &empty_scene()).unwrap()
                };
                let facet = &view.cave().facets[0];
                let (device, memory) = (
                    view.draw(&mut renderer, &list, facet).unwrap(),
                    view.draw_in_memory(&mut renderer, &list, facet).unwrap(),
                );
                assert_eq!((device.width, device.height), (memory.width, memory.height));
                let most = device.rgba.iter().zip(&memory.rgba).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
                assert!(most <= if bent { 1 } else { 0 }, "{stereo}, flip {flip}, bent {bent}: {most} levels");
                assert!(device.rgba.chunks_exact(4).filter(|p| p[0] > 40).count() > 300, "something is seen");
            }
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
