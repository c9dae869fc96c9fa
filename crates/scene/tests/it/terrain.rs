//! Convex hulls, height fields, terrain and planes in scene files: built with their numbers; every
//! fault is one message.

use std::path::PathBuf;
use tumble_core::Ray;
use tumble_core::collide::Vec3;
use tumble_scene::{SceneFile, ShapeSpec, read_heights};

/// A folder of its own with files, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, files: &[(&str, &[u8])]) -> Folder {
        let folder = std::env::temp_dir().join(format!("tumble-terrain-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for (name, bytes) in files {
            std::fs::write(folder.join(name), bytes).unwrap();
        }
        Folder(folder)
    }

    fn load(&self, text: &str) -> Result<SceneFile, String> {
        let path = self.0.join("scene.toml");
        std::fs::write(&path, text).unwrap();
        SceneFile::load(&path).map_err(|error| error.report(false))
    }

    /// Builds the scene; the height of the surface under (x, y) by a ray.
    fn height(&self, text: &str, x: f64, y: f64) -> f64 {
        let (world, _) = self.load(text).unwrap().build().unwrap();
        let hits = world.cast_rays(
            &[Ray { origin: Vec3::new(x, y, 100.0), direction: -Vec3::z(), max_distance: f64::INFINITY }],
            &Default::default(),
        );
        100.0 - hits[0].as_ref().expect("a hit").distance
    }

    fn fault(&self, text: &str) -> String {
        match self.load(text) {
            Err(why) => why,
            Ok(scene) => scene.build().map(|_| ()).unwrap_err().to_string(),
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn scene(mesh: &str) -> String {
    format!(
        "[meshes.land]\n{mesh}\n\n[[body]]\nname = \"land\"\nmode = \"static\"\n\
         shape = {{ type = \"mesh\", mesh = \"land\" }}\n"
    )
}

/// Returns a gray PNG of 16 bits.
fn png(columns: u32, rows: u32, values: &[u16]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, columns, rows);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let data: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
    encoder.write_header().unwrap().write_image_data(&data).unwrap();
    bytes
}

const ROOF: &[u8] = b"v -1 -1 0\nv 1 -1 0\nv 1 1 1\nv -1 1 1\nf 1 2 3\nf 1 3 4\n";

#[test]
fn height_fields_of_lists_images_and_texts_have_their_heights() {
    let image = png(3, 2, &[65535, 0, 13107, 0, 32768, 0]);
    let text = b"# a comment\n0 0.5; 0\n\n1,0, 0.2\n";
    let folder = Folder::new("heights", &[("map.png", &image), ("map.txt", text), ("map.csv", text)]);
    for source in [
        "heights_m = [[0, 0.5, 0], [1, 0, 0.2]]",
        "file = \"map.png\"\nheight_range_m = [0, 1]",
        "file = \"map.png\"",
        "file = \"map.txt\"",
        "file = \"map.csv\"",
    ] {
        let text = scene(&format!("type = \"height_field\"\n{source}\nsize_m = [4, 2]\nthickness_m = 0.5"));
        let places = [(0.0, -0.99, 0.5), (-1.99, 0.99, 1.0), (1.99, 0.99, 0.2)];
        for (x, y, expected) in places {
            assert!((folder.height(&text, x, y) - expected).abs() < 0.02, "{source}: {x} {y}");
        }
    }
    let range = scene("type = \"height_field\"\nfile = \"map.png\"\nheight_range_m = [10, 30]\nsize_m = [4, 2]");
    assert!((folder.height(&range, -1.9999, 0.9999) - 30.0).abs() < 0.01);
    let wrong = scene("type = \"height_field\"\nfile = \"map.txt\"\nheight_range_m = [10, 30]\nsize_m = [4, 2]");
    let error = folder.load(&wrong).unwrap_err().to_string();
    assert!(error.contains("height_range_m") && error.contains("heights of a text are in meters"), "{error}");
}

#[test]
fn hulls_terrain_and_planes_are_built() {
    let level = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 3 2\n";
    let folder = Folder::new("hulls", &[("roof.obj", ROOF), ("level.obj", level)]);
    let points = "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 3], [0.1, 0.1, 0.1]]";
    let text = scene(&format!("type = \"convex_hull\"\npoints_m = {points}"));
    // the plane x + y + z/3 = 1
    assert!((folder.height(&text, 0.25, 0.25) - 1.5).abs() < 1e-9);
    let (world, _) = folder.load(&text).unwrap().build().unwrap();
    assert_eq!(world.ids().len(), 1);
    let text = scene("type = \"terrain\"\nfile = \"roof.obj\"\nscale = 2\nthickness_m = 0.1");
    assert!((folder.height(&text, 0.5, 0.0) - 1.0).abs() < 1e-9);
    // faces that look down have their solid above them; a centered one has half on each side
    for (keys, top) in [("", 1.0), ("\ncentered = true", 0.5)] {
        let text = scene(&format!("type = \"open_mesh\"\nfile = \"level.obj\"\nthickness_m = 1{keys}"));
        assert!((folder.height(&text, 0.5, 0.25) - top).abs() < 1e-9);
    }
    // an open file has a hull if it is not flat
    let folder = Folder::new("open", &[("tent.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 3\nf 1 2 4\nf 2 3 4\n")]);
    let text = scene("type = \"convex_hull\"\nfile = \"tent.obj\"");
    assert!((folder.height(&text, 0.25, 0.25) - 1.5).abs() < 1e-9);

    let plane = "[[body]]\nname = \"floor\"\nmode = \"static\"\nshape = { type = \"plane\" }\nposition_m = [0, 0, 2]\n";
    assert_eq!(folder.load(plane).unwrap().bodies[0].shape, ShapeSpec::HalfSpace);
    assert_eq!(folder.height(plane, 3.0, 4.0), 2.0);
}

#[test]
fn every_fault_is_one_message_with_its_place() {
    let color = {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 2);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().unwrap().write_image_data(&[0; 12]).unwrap();
        bytes
    };
    let files: &[(&str, &[u8])] = &[
        ("roof.obj", ROOF),
        ("wall.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 1\nf 1 2 3\nf 1 2 4\n"),
        ("line.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
        ("color.png", &color),
        ("no.png", b"not a picture"),
        ("word.txt", b"0 1\n2 high\n"),
        ("nan.txt", b"0 1\n2 nan\n"),
        ("ragged.txt", b"0 1 2\n3 4\n"),
        ("empty.txt", b"\n"),
    ];
    let folder = Folder::new("faults", files);
    let field = |keys: &str| format!("type = \"height_field\"\n{keys}\nsize_m = [4, 2]");
    for (mesh, parts) in [
        ("type = \"convex_hull\"".to_owned(), &["has no `points_m`", "or `file`"][..]),
        (field(""), &["has no `heights_m`", "or `file`"]),
        ("type = \"convex_hull\"\npoints_m = [[0, 0, 0]]".into(), &["scene.toml:3", "at least 4 points"]),
        ("type = \"convex_hull\"\npoints_m = [[0,0,0],[1,0,0],[0,1,0],[0,0,nan]]".into(), &["scene.toml:3", "nan"]),
        ("type = \"convex_hull\"\npoints_m = [[0,0,0],[1,0,0],[0,1,0],[1,1,0]]".into(), &["land", "one plane"]),
        ("type = \"convex_hull\"\nfile = \"roof.obj\"".into(), &["roof.obj", "one plane"]),
        ("type = \"convex_hull\"\nfile = \"none.obj\"".into(), &["scene.toml:3", "none.obj"]),
        (field("heights_m = [[0, 1]]"), &["scene.toml:3", "at least 2 rows"]),
        (field("heights_m = [[0, 1], [2]]"), &["scene.toml:3", "a row of 2 heights"]),
        (field("heights_m = [[0, 1], [2, inf]]"), &["scene.toml:3", "inf"]),
        (field("file = \"color.png\""), &["color.png", "in color"]),
        (field("file = \"no.png\""), &["no.png", "no PNG"]),
        (field("file = \"word.txt\""), &["word.txt", "line 2: 'high'"]),
        (field("file = \"nan.txt\""), &["nan.txt", "line 2: 'nan'"]),
        (field("file = \"ragged.txt\""), &["ragged.txt", "line 2 has 2 heights"]),
        (field("file = \"empty.txt\""), &["empty.txt", "0 heights"]),
        (field("file = \"roof.obj\""), &["scene.toml:3", ".png, .txt or .csv"]),
        ("type = \"height_field\"\nheights_m = [[0, 1], [2, 3]]".into(), &["has no `size_m`"]),
        ("type = \"terrain\"\nfile = \"wall.obj\"".into(), &["wall.obj", "line 6: face 2", "90.0°"]),
        ("type = \"terrain\"\nfile = \"roof.obj\"\nthickness_m = -1".into(), &["scene.toml:4", "-1"]),
        ("type = \"open_mesh\"".into(), &["has no `file`"]),
        ("type = \"open_mesh\"\nfile = \"line.obj\"".into(), &["line.obj", "none of the 1 triangles has an area"]),
        ("type = \"open_mesh\"\nfile = \"roof.obj\"\nthickness_m = 0".into(), &["scene.toml:4", "`thickness_m`"]),
        ("type = \"open_mesh\"\nfile = \"roof.obj\"\ncentered = 1".into(), &["scene.toml:4", "`centered`"]),
    ] {
        let message = folder.fault(&scene(&mesh));
        for part in parts {
            assert!(message.contains(part), "{mesh}\n{message}\nshould contain {part}");
        }
    }
}

#[test]
fn damaged_images_are_errors() {
    let image = png(3, 2, &[65535, 0, 13107, 0, 32768, 0]);
    let path = PathBuf::from("map.png");
    assert!(read_heights(&path, &image, [0.0, 1.0]).is_ok());
    for cut in 0..image.len() {
        // a picture can be complete before its last chunk
        if let Ok(grid) = read_heights(&path, &image[..cut], [0.0, 1.0]) {
            assert_eq!((grid.columns, grid.heights_m.len()), (3, 6));
        }
        let mut changed = image.clone();
        changed[cut] ^= 0x55;
        if let Ok(grid) = read_heights(&path, &changed, [0.0, 1.0]) {
            assert!(grid.heights_m.iter().all(|height| (0.0..=1.0).contains(height)));
        }
    }
    assert!(read_heights(&path, &image, [0.0, f64::NAN]).unwrap_err().contains("NaN"));
}
