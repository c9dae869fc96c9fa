//! MPCDI: round trips, the views that archives mean, faults with their places, archives that grow.

use nalgebra::{Point3, Vector3};
use std::io::{Cursor, Write};
use tumble_calibrate::{CaveFiles, Map, Mpcdi, Profile, cave_to_mpcdi, mpcdi_to_cave};
use tumble_render::{Blend, CaveView, Pfm};
use tumble_scene::SceneFile;
use tumble_scene::cave::Cave;

/// Writes a cave and its files, and returns its view at the origin.
pub fn view(files: &CaveFiles, name: &str) -> CaveView {
    let folder = std::env::temp_dir().join(format!("tumble-mpcdi-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    files.files.iter().for_each(|(file, bytes)| std::fs::write(folder.join(file), bytes).unwrap());
    let cave = Cave::parse(&files.cave, &folder.join("cave.toml").display().to_string());
    let cave = cave.unwrap_or_else(|e| panic!("{e}\n{}", files.cave));
    let view = CaveView::new(cave, &SceneFile::parse("[cave]\norigin_m = [0, 0, 0]\n", "a").unwrap()).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    view
}

const FRAME: &str = "<coordinateFrame><posx>1</posx><posy>2</posy><posz>3</posz><yawx>0</yawx><yawy>-1</yawy><yawz>0</yawz><pitchx>1</pitchx><pitchy>0</pitchy><pitchz>0</pitchz><rollx>0</rollx><rolly>0</rolly><rollz>-1</rollz></coordinateFrame>";

fn frustum(yaw: f64, pitch: f64, roll: f64, [left, right, down, up]: [f64; 4]) -> String {
    format!(
        "<frustum><yaw>{yaw}</yaw><pitch>{pitch}</pitch><roll>{roll}</roll><rightAngle>{right}</rightAngle><leftAngle>{left}</leftAngle><upAngle>{up}</upAngle><downAngle>{down}</downAngle></frustum>"
    )
}

fn description(profile: &str, region: &str, files: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<MPCDI profile=\"{profile}\" version=\"1.0\"><display><buffer id=\"b\" xResolution=\"300\" yResolution=\"100\">\n<region id=\"left one\" xResolution=\"40\" yResolution=\"20\" x=\"0.5\" y=\"0\" xsize=\"0.5\" ysize=\"1\">{region}</region>\n</buffer></display><files>{files}</files></MPCDI>"
    )
}

fn zipped(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// The edges of a turned view, by the rotations of a pilot done one after another.
#[test]
fn frusta_look_where_yaw_pitch_and_roll_turn_them() {
    for (yaw, pitch, roll) in
        [(0.0, 0.0, 0.0), (90.0, 0.0, 0.0), (0.0, 30.0, 0.0), (0.0, 0.0, 90.0), (40.0, -25.0, 15.0)]
    {
        let text = description("3d", &frustum(yaw, pitch, roll, [-30.0, 20.0, -10.0, 25.0]), "");
        let files = mpcdi_to_cave(&Mpcdi::parse(text.as_bytes()).unwrap(), [0.1, 0.2, 1.5]).unwrap();
        let view = view(&files, "frustum");
        let turn = |axis: Vector3<f64>, degrees: f64| nalgebra::Rotation3::new(axis * degrees.to_radians());
        // right turns are negative about z; rolling lowers the right wing, a positive turn about the line of sight
        let rotation = turn(Vector3::z(), -yaw) * turn(Vector3::x(), pitch) * turn(Vector3::y(), roll);
        let eye = view.eye(&view.cave().facets[0], 0.0).unwrap();
        for (side, up) in [(-30.0f64, -10.0f64), (20.0, 25.0), (-30.0, 25.0), (0.0, 0.0)] {
            let (a, b) = (side.to_radians().tan(), up.to_radians().tan());
            let seen = eye.project(&(Point3::new(0.1, 0.2, 1.5) + rotation * Vector3::new(a, 1.0, b) * 3.0)).unwrap();
            let share = |at: f64, from: f64, to: f64| {
                let tan = |angle: f64| angle.to_radians().tan();
                2.0 * (at - tan(from)) / (tan(to) - tan(from)) - 1.0
            };
            let wanted = [share(a, -30.0, 20.0), share(b, -10.0, 25.0)];
            assert!(
                (seen.x - wanted[0]).abs() < 1e-9 && (seen.y - wanted[1]).abs() < 1e-9,
                "{yaw} {pitch} {roll}: {seen}"
            );
        }
    }
}

#[test]
fn a_shader_lamp_is_seen_from_its_projector_and_a_part_of_a_buffer_lies_in_it() {
    // y up, back along z: (1, 2, 3) is 1 to the right, 3 back, 2 up
    let text = description("sl", &format!("{}{FRAME}", frustum(0.0, 0.0, 0.0, [-45.0, 45.0, -45.0, 45.0])), "");
    let files = mpcdi_to_cave(&Mpcdi::parse(text.as_bytes()).unwrap(), [0.0; 3]).unwrap();
    let cave = view(&files, "lamp").cave().clone();
    assert_eq!(cave.users[0].eye_m, Point3::new(1.0, -3.0, 2.0));
    assert!((cave.screens[0].lower_left_m - Point3::new(-1.0, -1.0, 0.0)).norm() < 1e-12);
    // 300 x 100 pixels are 6 m x 2 m; the right half begins in the middle
    let flat = mpcdi_to_cave(&Mpcdi::parse(description("2d", "", "").as_bytes()).unwrap(), [0.0, 0.0, 1.0]).unwrap();
    let screen = view(&flat, "part").cave().screens[0].clone();
    assert!((screen.lower_left_m - Point3::new(0.0, 2.0, 0.0)).norm() < 1e-12);
    assert!((screen.size_m()[0] - 3.0).abs() < 1e-12 && (screen.size_m()[1] - 2.0).abs() < 1e-12);
    assert!(flat.notes[0].contains("set its corners"));
}

/// Nodes in the middle of cells, rows from the top, v down, in millimeters: a plane's points.
#[test]
fn points_and_places_of_warps_are_at_their_pixels() {
    let grid = |f: &dyn Fn(f64, f64) -> [f32; 3]| {
        let mut bytes = b"PF\n8 4\n-1.0\n".to_vec();
        for (row, column) in (0..4).flat_map(|row| (0..8).map(move |column| (row, column))) {
            let values = f((f64::from(column) + 0.5) / 8.0, (f64::from(row) + 0.5) / 4.0);
            values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        }
        bytes
    };
    // 2 m to the right over the width, 1 m down over the height; y up, back along z
    let points = grid(&|x, y| [(2000.0 * x) as f32, (1500.0 - 1000.0 * y) as f32, -2500.0]);
    let set = "<fileset region=\"left one\"><geometryWarpFile><path>a.pfm</path></geometryWarpFile><geometricUnit>mm</geometricUnit></fileset>";
    let archive = zipped(&[("mpcdi.xml", description("a3", FRAME, set).as_bytes()), ("a.pfm", &points)]);
    let files = mpcdi_to_cave(&Mpcdi::parse(&archive).unwrap(), [0.0, 0.0, 1.0]).unwrap();
    let view = view(&files, "points");
    for (i, point) in view.points(&view.cave().facets[0]).unwrap().into_iter().enumerate() {
        let (x, y) = ((i % 40) as f64 + 0.5, (i / 40) as f64 + 0.5);
        let wanted = [2.0 * x / 40.0, 2.5, 1.5 - y / 20.0];
        assert!((0..3).all(|k| (point.unwrap()[k] - wanted[k]).abs() < 1e-5), "{point:?} {wanted:?}");
    }
    // a warp that shows the picture smaller and to the lower right, on the part of a flat picture
    let places = grid(&|x, y| [(0.2 + 0.7 * x) as f32, (0.1 + 0.5 * y) as f32, 0.0]);
    let archive = zipped(&[("mpcdi.xml", description("2d", "", set).as_bytes()), ("a.pfm", &places)]);
    let files = mpcdi_to_cave(&Mpcdi::parse(&archive).unwrap(), [0.0, 0.0, 1.0]).unwrap();
    let view = self::view(&files, "places");
    for (i, point) in view.points(&view.cave().facets[0]).unwrap().into_iter().enumerate() {
        let (x, y) = ((i % 40) as f64 + 0.5, (i / 40) as f64 + 0.5);
        let wanted = [3.0 * (0.2 + 0.7 * x / 40.0), 2.0, 2.0 - 2.0 * (0.1 + 0.5 * y / 20.0)];
        assert!((0..3).all(|k| (point.unwrap()[k] - wanted[k]).abs() < 1e-5), "{point:?} {wanted:?}");
    }
}

#[test]
fn an_archive_of_a_cave_gives_its_points_and_masks_back() {
    let folder = std::env::temp_dir().join(format!("tumble-mpcdi-cave-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let shares: Vec<[f32; 3]> = (0..60 * 30).map(|i| [(i % 60) as f32 / 59.0, 1.0, (i / 60) as f32 / 29.0]).collect();
    std::fs::write(folder.join("mask.png"), Blend::png(&shares, [60, 30]).unwrap()).unwrap();
    let text = "[[user]]\nname = \"u\"\neye_m = [0, 0, 1.5]\n[[screen]]\nname = \"wall\"\nlower_left_m = [-1, 2, 0.5]\nlower_right_m = [1, 2, 0.5]\nupper_left_m = [-1, 2, 1.5]\n[[screen]]\nname = \"dome\"\nshape = \"fisheye\"\nradius_m = 4\n[[facet]]\nname = \"wall\"\nscreen = \"wall\"\nsize_px = [60, 30]\nblend_file = \"mask.png\"\nblack_file = \"mask.png\"\ncolor = { black = [0.01, 0.01, 0.01], floor = [0.03, 0.03, 0.03] }\n[[facet]]\nname = \"dome\"\nscreen = \"dome\"\nsize_px = [50, 50]\n";
    let scene = SceneFile::parse("[cave]\norigin_m = [0, 0, 0]\n", "a").unwrap();
    let cave = Cave::parse(text, &folder.join("cave.toml").display().to_string()).unwrap();
    let before = CaveView::new(cave, &scene).unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let archive = cave_to_mpcdi(&before).unwrap();
    let bytes = archive.to_bytes().unwrap();
    assert_eq!(bytes, archive.to_bytes().unwrap());
    let read = Mpcdi::parse(&bytes).unwrap();
    assert_eq!((read.profile, read.regions.len()), (Profile::Advanced3D, 2));
    let after = view(&mpcdi_to_cave(&read, [0.0, 0.0, 1.5]).unwrap(), "after");
    for (a, b) in before.cave().facets.iter().zip(&after.cave().facets) {
        let mut compared = 0;
        for (a, b) in before.points(a).unwrap().into_iter().zip(after.points(b).unwrap()) {
            // pixels across the dome's rim show nothing in one of them
            if let (Some(a), Some(b)) = (a, b) {
                compared += 1;
                // a curved screen is interpolated between pixels 0.25 m apart
                assert!((0..3).all(|k| (a[k] - b[k]).abs() < 0.01), "{a:?} {b:?}");
            }
        }
        assert!(compared > 1500, "{compared}");
    }
    let (a, b) = (before.masks(&before.cave().facets[0]).unwrap(), after.masks(&after.cave().facets[0]).unwrap());
    assert!(a.iter().zip(b).all(|(a, b)| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-4)));
    // the lift is (0.03 - 0.01) / 0.99 of full light where the mask is 1, now as a floor over a black of 0
    let floor = after.cave().facets[0].color.as_ref().unwrap().floor[0];
    assert!((floor - 0.02 / 0.99).abs() < 1e-4, "{floor}");
    assert!(a.iter().zip(b).all(|(a, b)| (a[3] - b[3]).abs() < 1e-3));
    assert!(after.masks(&after.cave().facets[1]).is_none());
}

#[test]
fn masks_of_a_gamma_become_shares_of_light() {
    let text = description("2d", "", "");
    let mut archive = Mpcdi::parse(text.as_bytes()).unwrap();
    let png = Blend::png(&[[0.5; 3]; 800], [40, 20]).unwrap();
    archive.regions[0].alpha = Some(Map { png: png.clone(), gamma: 2.0 });
    let after = view(&mpcdi_to_cave(&archive, [0.0; 3]).unwrap(), "gamma");
    assert!((after.masks(&after.cave().facets[0]).unwrap()[7][0] - 0.25).abs() < 1e-4);
    archive.regions[0].size_px = [41, 20];
    let error = mpcdi_to_cave(&archive, [0.0; 3]).unwrap_err().to_string();
    assert!(error.contains("the alphaMap of region \"left one\": the blend mask is 40 x 20 pixels"), "{error}");
}

#[test]
fn faults_are_named_with_their_places() {
    let said = |bytes: &[u8]| Mpcdi::parse(bytes).unwrap_err().to_string();
    assert!(said(b"").starts_with("the archive: is no zip archive"));
    assert_eq!(said(&zipped(&[("a.txt", b"x")])), "the archive: has no mpcdi.xml");
    assert!(said(b"<MPCDI>\n<a></MPCDI>").starts_with("the description:2:"));
    assert!(said(b"<x profile='2d'/>").ends_with("<x>, expected <MPCDI>"));
    assert!(said(b"<MPCDI profile='5d'/>").contains("profile \"5d\", expected 2d, 3d, a3 or sl"));
    assert!(said(b"<MPCDI profile='2d'/>").contains("has no <region>"));
    let text = description("3d", &frustum(0.0, 0.0, 0.0, [20.0, -20.0, -10.0, 10.0]), "");
    assert!(said(text.as_bytes()).starts_with("the description:3:"), "{}", said(text.as_bytes()));
    let text = description("2d", "", "").replace("xResolution=\"40\"", "xResolution=\"40000\"");
    assert!(said(text.as_bytes()).contains("xResolution is 40000, expected a number from 1 to 16384"));
    let set = "<fileset region=\"left one\"><alphaMap><path>no.png</path></alphaMap></fileset>";
    let text = description("2d", "", set);
    assert!(said(text.as_bytes()).contains("no.png: there are no files beside the description"));
    assert!(said(&zipped(&[("mpcdi.xml", text.as_bytes())])).starts_with("no.png: cannot be read from the archive"));
    let text = description("2d", "", "<fileset region=\"other\"/>");
    assert!(said(text.as_bytes()).contains("files of region \"other\", which there is not"));
    let error = mpcdi_to_cave(&Mpcdi::parse(description("a3", "", "").as_bytes()).unwrap(), [0.0; 3]).unwrap_err();
    assert!(error.to_string().contains("has no geometryWarpFile"), "{error}");
    let doctype = "<!DOCTYPE a [<!ENTITY b \"c\">]><MPCDI profile='2d'/>";
    assert!(said(doctype.as_bytes()).contains("DTD"), "{}", said(doctype.as_bytes()));
}

/// 65 MiB of zeros are 64 kB of archive.
#[test]
fn an_archive_that_grows_is_refused() {
    let zeros = vec![0; (64 << 20) + 1];
    let set = "<fileset region=\"left one\"><alphaMap><path>a.png</path></alphaMap></fileset>";
    let archive = zipped(&[("mpcdi.xml", description("2d", "", set).as_bytes()), ("a.png", &zeros)]);
    assert!(archive.len() < 1 << 20, "{}", archive.len());
    assert_eq!(Mpcdi::parse(&archive).unwrap_err().to_string(), "a.png: has more than 67108864 bytes");
    let blanks = [b"<MPCDI>".to_vec(), vec![b' '; 5 << 20]].concat();
    assert_eq!(
        Mpcdi::parse(&zipped(&[("mpcdi.xml", &blanks)])).unwrap_err().to_string(),
        "mpcdi.xml: has more than 4194304 bytes"
    );
}

#[test]
fn damaged_archives_are_errors_and_never_panics() {
    let warp = Pfm { size: [3, 2], values: vec![[0.5; 3]; 6] };
    let mut archive = Mpcdi::parse(description("2d", "", "").as_bytes()).unwrap();
    archive.regions[0].warp = Some(warp);
    archive.regions[0].alpha = Some(Map { png: Blend::png(&[[0.5; 3]; 800], [40, 20]).unwrap(), gamma: 2.2 });
    let bytes = archive.to_bytes().unwrap();
    assert_eq!(Mpcdi::parse(&bytes).unwrap(), archive);
    let mut opened = 0;
    for i in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[i] ^= 0x41;
        for bytes in [&damaged[..], &bytes[..i]] {
            if let Ok(read) = Mpcdi::parse(bytes) {
                opened += 1;
                let _ = mpcdi_to_cave(&read, [0.0, 0.0, 1.5]);
            }
        }
    }
    assert!(opened < bytes.len(), "{opened}");
}
