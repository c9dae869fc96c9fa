//! Curved screens: places of points against closed forms, seams between the faces of the cube, the
//! device against memory, mesh files.

use crate::support::{bare, renderer, white_sun};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use tumble_render::{Camera, CaveView, DrawList, Ground, Image, Material, ScreenMesh, Sky};
use tumble_scene::SceneFile;
use tumble_scene::cave::Cave;

/// A cave of one user and one screen, with the scene's axes.
fn view(eye: [f64; 3], screen: &str, facet: &str) -> CaveView {
    let text = format!(
        "[[user]]\nname = \"u\"\neye_m = {eye:?}\n[[screen]]\nname = \"s\"\n{screen}\n[[facet]]\nname = \"f\"\nscreen = \"s\"\nnear_m = 0.1\n{facet}\n"
    );
    let cave = Cave::parse(&text, "my.toml").unwrap_or_else(|e| panic!("{e}"));
    CaveView::new(cave, &SceneFile::parse("[cave]\norigin_m = [0, 0, 0]\n", "my.toml").unwrap()).unwrap()
}

/// Points around the eye in all directions (a spiral over the sphere), 3 to 6 m away.
fn points(eye: Point3<f64>, count: usize) -> Vec<Point3<f64>> {
    (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
            let (r, a) = ((1.0 - z * z).sqrt(), 2.399963 * i as f64);
            eye + Vector3::new(r * a.cos(), r * a.sin(), z) * (3.0 + 3.0 * ((7 * i % count) as f64 / count as f64))
        })
        .collect()
}

/// Center of the light within 20 pixels of a place; `None` if there is none.
fn center(image: &Image, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let (mut sum, mut at) = (0.0, [0.0; 2]);
    for row in (y - 20.0).max(0.0) as u32..((y + 20.0) as u32).min(image.height) {
        for column in (x - 20.0).max(0.0) as u32..((x + 20.0) as u32).min(image.width) {
            let light = crate::support::linear(image, column, row, 0);
            sum += light;
            at = [at[0] + light * (f64::from(column) + 0.5), at[1] + light * (f64::from(row) + 0.5)];
        }
    }
    (sum > 3.0).then(|| at.map(|x| x / sum))
}

/// Draws small spheres and returns the largest distance of one from the place that a closed form
/// gives (pixels from the upper left corner), and how many were measured.
fn worst(
    eye: [f64; 3],
    screen: &str,
    size: [u32; 2],
    place: impl Fn(Point3<f64>, Point3<f64>) -> Option<[f64; 2]>,
) -> Option<(f64, usize)> {
    let mut renderer = renderer()?;
    let view = view(eye, screen, &format!("size_px = {size:?}"));
    let eye = Point3::from(eye);
    let mut list = bare(Camera::default());
    let mut seen: Vec<[f64; 2]> = Vec::new();
    for point in points(eye, 160) {
        let radius = 0.02 * (point - eye).norm();
        let Some(at) = outline(eye, point, radius, &place) else { continue };
        let inside = (0..2).all(|k| at[k] > 21.0 && at[k] < f64::from(size[k]) - 21.0);
        if inside && seen.iter().all(|other| (other[0] - at[0]).hypot(other[1] - at[1]) > 45.0) {
            list.add_sphere(point.cast(), radius as f32, UnitQuaternion::identity(), Material::unlit([1.0; 3]));
            seen.push(at);
        }
    }
    let image = view.draw(&mut renderer, &list, &view.cave().facets[0]).unwrap();
    let off = |at: &[f64; 2]| {
        let [x, y] = center(&image, *at).unwrap_or_else(|| panic!("nothing at {at:?}"));
        (x - at[0]).hypot(y - at[1])
    };
    Some((seen.iter().map(off).fold(0.0, f64::max), seen.len()))
}

/// Center of the area that the outline of a sphere encloses in the picture: a closed polygon of 90
/// tangent rays.
fn outline(
    eye: Point3<f64>,
    point: Point3<f64>,
    radius: f64,
    place: &impl Fn(Point3<f64>, Point3<f64>) -> Option<[f64; 2]>,
) -> Option<[f64; 2]> {
    let d = point - eye;
    let sin = radius / d.norm();
    let u = d.cross(&if d.z.abs() < 0.9 * d.norm() { Vector3::z() } else { Vector3::x() }).normalize();
    let v = u.cross(&d.normalize());
    let tangent = |i: usize| {
        let a = 2.0 * PI * i as f64 / 90.0;
        eye + d * (1.0 - sin * sin).sqrt() + (u * a.cos() + v * a.sin()) * (sin * d.norm())
    };
    let corners: Vec<[f64; 2]> = (0..90).map(|i| place(eye, tangent(i))).collect::<Option<_>>()?;
    // across the edge of a picture, or larger than the window of `center`
    let wide = (0..2).any(|k| corners.iter().any(|p| (p[k] - corners[0][k]).abs() > 36.0));
    if wide {
        return None;
    }
    let (mut area, mut sum) = (0.0, [0.0; 2]);
    for (i, p) in corners.iter().enumerate() {
        let q = corners[(i + 1) % corners.len()];
        let cross = p[0] * q[1] - q[0] * p[1];
        area += cross;
        sum = [sum[0] + cross * (p[0] + q[0]), sum[1] + cross * (p[1] + q[1])];
    }
    Some(sum.map(|x| x / (3.0 * area)))
}

/// The point where the ray from the eye through `p` leaves a sphere, or a cylinder along z, around
/// `c`.
fn exit(eye: Point3<f64>, p: Point3<f64>, c: Point3<f64>, radius: f64, round: Vector3<f64>) -> Vector3<f64> {
    let (d, o) = (p - eye, eye - c);
    let (dr, or) = (d.component_mul(&round), o.component_mul(&round));
    let (a, b, k) = (dr.norm_squared(), dr.dot(&or), or.norm_squared() - radius * radius);
    o + d * ((-b + (b * b - a * k).sqrt()) / a)
}

#[test]
fn points_on_a_cylinder_are_where_their_rays_meet_it() {
    let place = |eye: Point3<f64>, p: Point3<f64>| {
        let x = exit(eye, p, Point3::new(0.2, 0.1, 1.3), 3.0, Vector3::new(1.0, 1.0, 0.0));
        let angle = x.x.atan2(x.y);
        Some([(angle / (220f64.to_radians()) + 0.5) * 1200.0, (0.5 - x.z / 2.6) * 300.0])
    };
    let screen = "shape = \"cylinder\"\nradius_m = 3\nheight_m = 2.6\nangle_deg = 220\ncenter_m = [0.2, 0.1, 1.3]";
    let Some((off, count)) = worst([0.9, -0.6, 1.5], screen, [1200, 300], place) else { return };
    println!("cylinder: {off:.4} px of {count} points");
    assert!(count > 20 && off < 0.1, "{off} px of {count} points");
}

#[test]
fn points_on_a_dome_are_where_their_rays_meet_it() {
    let place = |eye: Point3<f64>, p: Point3<f64>| {
        let x = exit(eye, p, Point3::new(0.0, 0.0, 1.7), 4.0, Vector3::new(1.0, 1.0, 1.0)).normalize();
        let theta = x.z.acos();
        // zenith in the middle, the front (y) below, x to the right
        let r = theta / PI / x.x.hypot(x.y);
        (theta < 0.5 * PI).then(|| [(0.5 + r * x.x) * 700.0, (0.5 + r * x.y) * 700.0])
    };
    let screen = "shape = \"fisheye\"\nradius_m = 4\ncenter_m = [0, 0, 1.7]";
    let Some((off, count)) = worst([1.1, 0.7, 1.2], screen, [700, 700], place) else { return };
    println!("dome: {off:.4} px of {count} points");
    assert!(count > 20 && off < 0.1, "{off} px of {count} points");
}

#[test]
fn points_of_a_panorama_are_at_their_longitude_and_latitude() {
    let place = |eye: Point3<f64>, p: Point3<f64>| {
        let d = (p - eye).normalize();
        let elevation = d.z.asin();
        // close to the poles the picture stretches a sphere to a line
        (elevation.abs() < 1.1).then(|| [(d.x.atan2(d.y) / (2.0 * PI) + 0.5) * 1600.0, (0.5 - elevation / PI) * 800.0])
    };
    let Some((off, count)) = worst([0.3, -0.2, 1.5], "shape = \"equirectangular\"", [1600, 800], place) else { return };
    println!("panorama: {off:.4} px of {count} points");
    assert!(count > 60 && off < 0.1, "{off} px of {count} points");
}

#[test]
fn points_of_a_cube_map_are_on_the_square_of_their_largest_coordinate() {
    let place = |eye: Point3<f64>, p: Point3<f64>| {
        let d = p - eye;
        let most = d.amax();
        // square of the cross, right and down
        let (column, row, a, b) = match () {
            _ if d.y == most => (1.0, 1.0, d.x, -d.z),
            _ if d.x == most => (2.0, 1.0, -d.y, -d.z),
            _ if d.y == -most => (3.0, 1.0, -d.x, -d.z),
            _ if d.x == -most => (0.0, 1.0, d.y, -d.z),
            _ if d.z == most => (1.0, 0.0, d.x, d.y),
            _ => (1.0, 2.0, d.x, -d.y),
        };
        // spheres across the edge of a square are cut
        let inner = a.abs().max(b.abs()) < 0.95 * most;
        inner.then(|| [(column + 0.5 + 0.5 * a / most) * 300.0, (row + 0.5 + 0.5 * b / most) * 300.0])
    };
    let Some((off, count)) = worst([0.3, -0.2, 1.5], "shape = \"cube_map\"", [1200, 900], place) else { return };
    println!("cube map: {off:.4} px of {count} points");
    assert!(count > 60 && off < 0.1, "{off} px of {count} points");
}

/// The mesh is the flat screen of a projector: its picture is that of the flat screen.
#[test]
fn a_flat_mesh_shows_the_picture_of_a_flat_screen() {
    let flat = "lower_left_m = [-1, 2, 0]\nlower_right_m = [1, 2, 0]\nupper_left_m = [-1, 2, 2]";
    let place = |eye: Point3<f64>, p: Point3<f64>| {
        let d = p - eye;
        let t = (2.0 - eye.y) / d.y;
        let x = eye + d * t;
        (t > 0.0).then(|| [(0.5 + 0.5 * x.x) * 500.0, (1.0 - 0.5 * x.z) * 500.0])
    };
    let folder = std::env::temp_dir().join(format!("tumble-mesh-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let obj = "v -1 2 0\nv 1 2 0\nv 1 2 2\nv -1 2 2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    std::fs::write(folder.join("wall.obj"), obj).unwrap();
    let mesh = format!("shape = \"mesh\"\nmesh_file = \"{}\"", folder.join("wall.obj").display());
    for screen in [flat, &mesh] {
        let Some((off, count)) = worst([0.4, 0.1, 1.3], screen, [500, 500], place) else { return };
        println!("{off:.4} px of {count} points");
        assert!(count > 4 && off < 0.1, "{off} px of {count} points on {screen}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

fn furnished() -> DrawList {
    let mut list = DrawList { ground: Some(Ground::grid(0.0)), sky: Sky::hall(), ..DrawList::default() };
    for (i, p) in points(Point3::new(0.0, 0.0, 1.5), 60).into_iter().enumerate() {
        let color = [0.2 + 0.012 * i as f32, 0.9 - 0.012 * i as f32, 0.4];
        list.add_sphere(p.cast(), 0.25, UnitQuaternion::identity(), Material::plastic(color));
    }
    list.lights.push(white_sun([0.3, 0.5, -1.0], 2.0, true));
    list
}

/// The same panorama with the faces of the cube turned by 45 degrees, where seams are now in the
/// middle of faces.
#[test]
fn seams_of_the_cube_cannot_be_seen() {
    let Some(mut renderer) = renderer() else { return };
    let mut draw = |heading: f64| {
        let (sin, cos) = heading.to_radians().sin_cos();
        // the cave turns left, its picture right
        let screen = format!("shape = \"equirectangular\"\nforward = [{sin}, {cos}, 0]");
        let mut view = view([0.0, 0.0, 1.5], &screen, "size_px = [1024, 512]");
        let mut place = *view.place();
        place.heading_deg = heading;
        view.set_place(place);
        view.draw(&mut renderer, &furnished(), &view.cave().facets[0]).unwrap()
    };
    let (straight, turned) = (draw(0.0), draw(45.0));
    let level = |image: &Image, x: u32, y: u32| f64::from(image.pixel(x, y).unwrap()[1]);
    let column = |x: u32| (100..412).map(|y| level(&straight, x, y) - level(&turned, x, y)).sum::<f64>() / 312.0;
    // seams are at 45, 135, 225 and 315 degrees from the left edge of one picture, and at 0, 90, 180 and
    // 270 of the other
    let far = (0..1024).map(|x| column(x).abs()).sum::<f64>() / 1024.0;
    let seams: Vec<f64> =
        [128, 384, 640, 896, 256, 512, 768].iter().flat_map(|&x| [column(x - 1), column(x)]).collect();
    let most = seams.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    let differ = straight.rgba.iter().zip(&turned.rgba).filter(|(a, b)| a.abs_diff(**b) > 12).count() as f64
        / straight.rgba.len() as f64;
    println!("mean {far:.3}, at seams {most:.3} levels; {:.3} % of bytes differ by more than 12", 100.0 * differ);
    assert!(most < 0.5 && differ < 0.01, "{most} levels at a seam, {differ} of bytes differ");
    assert!(level(&straight, 512, 300) > 20.0, "something is seen");
}

#[test]
fn curved_pictures_of_the_device_are_those_of_memory_within_a_level() {
    let Some(mut renderer) = renderer() else { return };
    let screen = "shape = \"fisheye\"\nradius_m = 4\ncenter_m = [0, 0, 1.7]";
    for facet in ["", "stereo = \"side_by_side\"\nflip = \"horizontal\"", "stereo = \"anaglyph\""] {
        let view = view([0.4, 0.2, 1.5], screen, &format!("size_px = [300, 300]\n{facet}"));
        let facet = &view.cave().facets[0];
        let device = view.draw(&mut renderer, &furnished(), facet).unwrap();
        let memory = view.draw_in_memory(&mut renderer, &furnished(), facet).unwrap();
        let off: Vec<u8> = device.rgba.iter().zip(&memory.rgba).map(|(a, b)| a.abs_diff(*b)).collect();
        // directions are floats of 32 bits on the device: at the edges of objects a place of 1e-4 pixels counts
        let more = off.iter().filter(|d| **d > 1).count();
        assert!(more * 1000 < off.len() && *off.iter().max().unwrap() <= 8, "{more} of {} bytes", off.len());
        // the corners outside of the disk
        assert_eq!(device.pixel(2, 2), Some([0, 0, 0, 255]));
    }
}

#[test]
fn unfolded_curves_and_every_face_a_moved_eye_needs() {
    let Some(mut renderer) = renderer() else { return };
    let screen = "shape = \"cylinder\"\nradius_m = 3\nheight_m = 2.4\nangle_deg = 180\ncenter_m = [0, 0, 1.5]";
    let mut view = view([0.0, 0.0, 1.5], screen, "size_px = [600, 160]");
    // far to the back right, where the wall's left part is seen through another face
    view.users_mut()[0].eye_m = Point3::new(1.9, -1.9, 1.5);
    let whole = view.draw(&mut renderer, &furnished(), &view.cave().facets[0]).unwrap();
    let black = whole.rgba.chunks_exact(4).filter(|p| p[..3] == [0, 0, 0]).count();
    assert_eq!(black, 0, "every pixel has its face");
    // 9.42 m x 2.4 m
    let unfolded = view.draw_unfolded(&mut renderer, &furnished(), [400, 400]).unwrap();
    assert_eq!((unfolded.width, unfolded.height), (400, 102));
    assert!(unfolded.rgba.chunks_exact(4).all(|p| p[..3] != [0, 0, 0]));
}

#[test]
fn lines_of_sight_are_those_of_the_picture() {
    let view = view([0.5, 0.0, 1.5], "shape = \"equirectangular\"", "size_px = [720, 360]");
    let facet = &view.cave().facets[0];
    let (eye, ahead) = view.sight(facet, 0.0, [0.5, 0.5]).unwrap();
    assert_eq!(eye, Point3::new(0.5, 0.0, 1.5));
    // the middle of the next pixel is a quarter of a degree off
    assert!((ahead - Vector3::y()).norm() < 0.007, "{ahead}");
    let (_, right) = view.sight(facet, 0.0, [0.75, 0.5]).unwrap();
    assert!((right - Vector3::x()).norm() < 0.007, "{right}");
    let dome = self::view([0.0, 0.0, 1.7], "shape = \"fisheye\"\nradius_m = 4", "size_px = [100, 100]");
    assert!(dome.sight(&dome.cave().facets[0], 0.0, [0.01, 0.01]).is_none(), "outside of the disk");
}

#[test]
fn bad_meshes_say_what_is_wrong_and_where() {
    let obj = |text: &str| ScreenMesh::from_obj(text.as_bytes()).unwrap_err();
    assert!(obj("v 0 0\n").starts_with("line 1: expected `v x y z`"));
    assert!(obj("v 0 0 0\nvt 2 0\n").starts_with("line 2: expected `vt u v`"));
    assert!(
        obj("v 0 0 0\nvt 0 0\nf 1 1 4\n")
            .contains("line 3: the corner `4` names no `v` above it, of which there are 1")
    );
    assert!(obj("v 0 0 0\n").contains("no faces"));
    assert!(ScreenMesh::from_pfm(b"PF\n2 2 -1.0\n").unwrap_err().contains("0 bytes of floats, expected 48"));
    let nan = [b"PF\n2 2\n-1.0\n".to_vec(), f32::NAN.to_le_bytes().repeat(12)].concat();
    assert!(ScreenMesh::from_pfm(&nan).unwrap_err().contains("no cell"));
}
