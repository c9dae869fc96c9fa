//! The color of projectors: overlapping light is flat, tables of colors, the device against memory.

use crate::support::renderer;
use nalgebra::{Point3, UnitQuaternion};
use tumble_render::{CaveView, ColorTable, DrawList, Image, Material, ProjectorColor, Sky};
use tumble_scene::SceneFile;
use tumble_scene::cave::Cave;

fn cave(facet: &str) -> Cave {
    let text = format!(
        "[[user]]\nname = \"u\"\neye_m = [0, 0, 1]\n[[screen]]\nname = \"s\"\nlower_left_m = [-1, 2, 0]\nlower_right_m = [1, 2, 0]\nupper_left_m = [-1, 2, 2]\n[[facet]]\nname = \"f\"\nscreen = \"s\"\nsize_px = [100, 100]\n{facet}\n"
    );
    Cave::parse(&text, "my.toml").unwrap_or_else(|e| panic!("{e}"))
}

fn color(keys: &str) -> ProjectorColor {
    ProjectorColor::load(&cave(&format!("color = {{ {keys} }}")).facets[0]).unwrap().unwrap()
}

/// Light of a projector on the wall, for a code of 0 to 1: its black, and above it the transfer
/// curve.
fn light(code: f64, gamma: Option<f64>, black: f64) -> f64 {
    let t = match gamma {
        Some(gamma) => code.powf(gamma),
        None if code <= 0.04045 => code / 12.92,
        None => ((code + 0.055) / 1.055).powf(2.4),
    };
    black + (1.0 - black) * t
}

/// A row across two projectors: alone, overlapping with a ramp, alone; the wall's light is the same
/// everywhere, for each level of the picture, with and without black. In bytes each projector rounds by
/// half a code, which is 1.1 of 255 levels of light at the bright end.
#[test]
fn overlapping_light_is_flat() {
    for (black, gamma) in [(0.0, None), (0.004, None), (0.02, Some(2.2)), (0.01, Some(1.8))] {
        // two projectors at most: the floor is twice the black
        let floor = 2.0 * black;
        let curve = gamma.map_or(String::new(), |gamma| format!("gamma = {gamma}, "));
        let of = color(&format!("{curve}black = [{black}, {black}, {black}], floor = [{floor}, {floor}, {floor}]"));
        let (mut exact, mut bytes) = (0.0f64, [0.0f64; 2]);
        for level in [0.0, 0.02, 0.1, 0.25, 0.5, 0.8, 1.0] {
            let wanted = floor + (1.0 - floor) * level;
            for i in 0..=400 {
                // the share of the left projector; the lift fills where one projector is alone
                let share = (1.5 - f64::from(i) / 200.0).clamp(0.0, 1.0);
                let alone = share == 0.0 || share == 1.0;
                let (mut sum, mut rounded) = (0.0, 0.0);
                for part in [share, 1.0 - share].into_iter().filter(|part| *part > 0.0) {
                    let lift = if alone { 1.0 } else { 0.0 };
                    let code = f64::from(of.code([level as f32; 3], [part as f32; 3], lift)[0]);
                    sum += light(code, gamma, black);
                    rounded += light((255.0 * code).round() / 255.0, gamma, black);
                }
                exact = exact.max((sum - wanted).abs());
                let bright = usize::from(level > 0.5);
                bytes[bright] = bytes[bright].max((rounded - wanted).abs());
            }
        }
        println!(
            "black {black}, gamma {gamma:?}: exact {:.5}, in bytes {:.3} and {:.3} of 255 levels of light (up to half, above)",
            255.0 * exact,
            255.0 * bytes[0],
            255.0 * bytes[1]
        );
        assert!(255.0 * exact < 0.01, "{exact}");
        assert!(255.0 * bytes[0] < 1.0 && 255.0 * bytes[1] < 1.6, "{bytes:?}");
    }
}

#[test]
fn white_and_gamma_are_those_of_the_file() {
    // half light, gain 0.5: a quarter; code 0.25^(1/2) at gamma 2
    let code = color("gamma = 2, white = [1, 0.5, 0.25]").code([0.5; 3], [1.0; 3], 1.0);
    let wanted = [0.5f32.sqrt(), 0.5, 0.125f32.sqrt()];
    assert!((0..3).all(|k| (code[k] - wanted[k]).abs() < 1e-6), "{code:?}");
}

fn table(n: usize, f: impl Fn([f32; 3]) -> [f32; 3]) -> String {
    let mut text = format!("# a comment\nTITLE \"x\"\nLUT_3D_SIZE {n}\nDOMAIN_MIN 0 0 0\nDOMAIN_MAX 1.0 1 1\n\n");
    for (b, g, r) in (0..n).flat_map(|b| (0..n).flat_map(move |g| (0..n).map(move |r| (b, g, r)))) {
        let [x, y, z] = f([r, g, b].map(|i| i as f32 / (n - 1) as f32));
        text += &format!("{x} {y} {z}\n");
    }
    text
}

#[test]
fn a_table_of_a_linear_function_is_that_function() {
    let f = |[r, g, b]: [f32; 3]| [0.5 * r + 0.2 * g, 0.1 + 0.8 * b, 0.3 * r + 0.3 * g + 0.3 * b];
    for n in [2, 3, 9] {
        let table = ColorTable::parse(table(n, f).as_bytes()).unwrap();
        for i in 0..200 {
            let code = [(i % 7) as f32 / 6.0, (i % 11) as f32 / 10.0, (i % 23) as f32 / 22.0];
            let (got, wanted) = (table.color(code), f(code));
            assert!((0..3).all(|k| (got[k] - wanted[k]).abs() < 1e-6), "{code:?}: {got:?} {wanted:?}");
        }
    }
}

#[test]
fn bad_tables_say_what_is_wrong_and_where() {
    let said = |text: &str| ColorTable::parse(text.as_bytes()).unwrap_err();
    assert_eq!(said("LUT_3D_SIZE 900\n"), "line 1: expected `LUT_3D_SIZE n` with n from 2 to 65");
    assert!(said("LUT_1D_SIZE 16\n").starts_with("line 1: a one-dimensional table"));
    assert!(said("\nDOMAIN_MAX 2 2 2\n").starts_with("line 2: expected `DOMAIN_MAX 1 1 1`"));
    assert!(said("0 0 0\n").starts_with("line 1: a color before LUT_3D_SIZE"));
    assert!(said("LUT_3D_SIZE 2\n0 0 x\n").starts_with("line 2: expected a keyword, or three numbers"));
    assert!(said("LUT_3D_SIZE 2\n0 0 0 0\n").starts_with("line 2: expected a keyword"));
    assert!(said("LUT_3D_SIZE 2\n0 0 nan\n").starts_with("line 2: expected a keyword"));
    assert_eq!(said("LUT_3D_SIZE 2\n0 0 0\n"), "the color table ends after 1 colors, expected 8");
    assert!(said(&format!("LUT_3D_SIZE 2\n{}", "0 0 0\n".repeat(9))).starts_with("line 10: more than 8 colors"));
    assert_eq!(said(""), "the color table has no LUT_3D_SIZE");
}

#[test]
fn colors_of_the_device_are_those_of_memory_within_a_level() {
    let Some(mut renderer) = renderer() else { return };
    let folder = std::env::temp_dir().join(format!("tumble-colors-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let swirl = |[r, g, b]: [f32; 3]| [0.9 * r * r + 0.05, 0.3 * r + 0.6 * g, b.sqrt()];
    std::fs::write(folder.join("a.cube"), table(17, swirl)).unwrap();
    let mask = |f: &dyn Fn(u32) -> u8| Image {
        width: 100,
        height: 100,
        rgba: (0..10_000).flat_map(|i| [f(i % 100), f(i / 100), f(i % 100), 255]).collect(),
    };
    mask(&|i| (255 - 2 * i) as u8).write_png(folder.join("blend.png")).unwrap();
    mask(&|i| (55 + 2 * i) as u8).write_png(folder.join("black.png")).unwrap();
    let mut list = DrawList { sky: Sky::flat([0.3, 0.5, 0.7]), ..DrawList::default() };
    for i in 0..40u8 {
        let at = Point3::new(f32::from(i % 8) * 0.3 - 1.0, 4.0, f32::from(i / 8) * 0.4 + 0.2);
        let color = [0.025 * f32::from(i), 1.0 - 0.02 * f32::from(i), 0.5];
        list.add_sphere(at, 0.12, UnitQuaternion::identity(), Material::unlit(color));
    }
    let file = |name: &str| folder.join(name).display().to_string();
    let black = "black = [0.01, 0.02, 0.01], floor = [0.02, 0.04, 0.02]";
    let masks = format!("blend_file = \"{}\"\nblack_file = \"{}\"", file("blend.png"), file("black.png"));
    for facet in [
        "color = { gamma = 2.2 }".to_owned(),
        format!("color = {{ {black} }}"),
        format!("{masks}\ncolor = {{ gamma = 1.8, white = [1, 0.8, 0.9], {black} }}"),
        format!("{masks}\ncolor = {{ {black}, lut_file = \"{}\" }}", file("a.cube")),
    ] {
        let scene = SceneFile::parse("[cave]\norigin_m = [0, 0, 0]\n", "my.toml").unwrap();
        let view = CaveView::new(cave(&facet), &scene).unwrap();
        let device = view.draw(&mut renderer, &list, &view.cave().facets[0]).unwrap();
        let memory = view.draw_in_memory(&mut renderer, &list, &view.cave().facets[0]).unwrap();
        let most = device.rgba.iter().zip(&memory.rgba).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
        assert!(most <= 1, "{facet}: {most} levels");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
