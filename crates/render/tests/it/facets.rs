//! Facets against independent geometry: corners, shared edges, ray casting through a cube, one wall
//! in parts.

use crate::support::{bare, picture, picture_from};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use tumble_render::{DrawList, FacetView, Ground, Image, Light, Material, MeshData, RIM_PX, unfold};
use tumble_scene::cave::{Cave, Screen, gaps, resolve_cave, shipped_caves};

/// Uniform numbers from 0 to 1 (xorshift64*).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

fn corners(s: &Screen) -> [Point3<f64>; 3] {
    [s.lower_left_m, s.lower_right_m, s.upper_left_m]
}

/// A point near the cave's first user that is in front of all these screens.
fn eye_before(random: &mut Random, cave: &Cave, screens: &[usize]) -> Point3<f64> {
    loop {
        let step = Vector3::new(random.within(-0.6, 0.6), random.within(-0.6, 0.6), random.within(-0.6, 0.6));
        let eye = cave.users[0].eye_m + step;
        if screens.iter().all(|&s| cave.screens[s].distance_m(&eye) > 0.05) {
            return eye;
        }
    }
}

#[test]
fn corners_of_every_screen_land_in_the_corners_of_the_picture() {
    let mut random = Random(1);
    for shipped in shipped_caves() {
        let cave = shipped.read().unwrap();
        for (index, screen) in cave.screens.iter().enumerate().filter(|(_, screen)| screen.is_flat()) {
            for _ in 0..200 {
                let view =
                    FacetView::new(eye_before(&mut random, &cave, &[index]), corners(screen), 0.05, 500.0).unwrap();
                let named = [
                    (screen.lower_left_m, -1.0, -1.0),
                    (screen.lower_right_m, 1.0, -1.0),
                    (screen.upper_left_m, -1.0, 1.0),
                    (screen.upper_right_m(), 1.0, 1.0),
                ];
                for (corner, x, y) in named {
                    let ndc = view.project(&corner).expect("in front");
                    assert!(
                        (ndc.x - x).abs() < 1e-12 && (ndc.y - y).abs() < 1e-12,
                        "{}/{}: {ndc:?}",
                        shipped.name,
                        screen.name
                    );
                }
            }
        }
    }
}

/// A screen a little out of square is still filled from corner to corner.
#[test]
fn a_wall_measured_out_of_square_is_filled_to_its_corners() {
    let [a, b, c] = [Point3::new(-1.0, 2.0, 0.0), Point3::new(1.0, 2.1, 0.0), Point3::new(-0.9985, 2.0, 1.5)];
    let view = FacetView::new(Point3::new(0.3, -0.4, 1.1), [a, b, c], 0.1, 50.0).unwrap();
    for (corner, x, y) in [(a, -1.0, -1.0), (b, 1.0, -1.0), (c, -1.0, 1.0), (c + (b - a), 1.0, 1.0)] {
        let ndc = view.project(&corner).unwrap();
        assert!((ndc.x - x).abs() < 1e-12 && (ndc.y - y).abs() < 1e-12, "{ndc:?}");
    }
}

/// The ray from the eye is intersected with the screen by plane geometry; depth follows from its
/// definition.
#[test]
fn points_land_where_their_ray_meets_the_screen() {
    let (screen, mut random) = (resolve_cave("cylinder5").unwrap().load().unwrap().screens[3].clone(), Random(2));
    let (near, far) = (0.2, 80.0);
    for _ in 0..1000 {
        let eye = Point3::new(random.within(-1.0, 0.5), random.within(-1.0, 1.0), random.within(0.5, 2.5));
        let view = FacetView::new(eye, corners(&screen), near, far).unwrap();
        let on_screen = screen.lower_left_m
            + screen.across() * random.within(-0.5, 1.5)
            + screen.upward() * random.within(-0.5, 1.5);
        let beyond = random.within(0.1, 30.0);
        let point = eye + (on_screen - eye) * beyond;
        let ndc = view.project(&point).unwrap();
        let share = |edge: Vector3<f64>| 2.0 * (on_screen - screen.lower_left_m).dot(&edge) / edge.norm_squared() - 1.0;
        assert!((ndc.x - share(screen.across())).abs() < 1e-9 && (ndc.y - share(screen.upward())).abs() < 1e-9);
        let s = beyond * screen.distance_m(&eye);
        assert!((ndc.z - far * (s - near) / (s * (far - near))).abs() < 1e-9, "{}", ndc.z);
    }
}

#[test]
fn both_pictures_of_a_shared_edge_have_its_points_at_the_same_place() {
    let mut random = Random(3);
    let mut worst: f64 = 0.0;
    let edges: Vec<(Cave, _)> = shipped_caves()
        .iter()
        .map(|c| c.read().unwrap())
        .flat_map(|cave| gaps(&cave.screens).into_iter().map(move |gap| (cave.clone(), gap)))
        .collect();
    assert_eq!(edges.len(), 27);
    for k in 0..10_000 {
        let (cave, gap) = &edges[k % edges.len()];
        let middle = eye_before(&mut random, cave, &[gap.first.0, gap.second.0]);
        let facing =
            Vector3::new(random.within(-1.0, 1.0), random.within(-1.0, 1.0), random.within(-1.0, 1.0)).normalize();
        let [width, height] = cave.facets[0].size_px;
        // a point of the edge as the first screen has it, and something beyond or before it on the
        // same ray
        let screen = &cave.screens[gap.first.0];
        let (ll, u, v) = (screen.lower_left_m, screen.across(), screen.upward());
        let t = random.next();
        let on_edge = [ll + u * t, ll + u + v * t, ll + v + u * t, ll + v * t][gap.first.1];
        let far = random.within(0.3, 40.0);
        for side in [-1.0, 1.0] {
            let eye = middle + facing * (0.5 * side * 0.063);
            if [gap.first.0, gap.second.0].iter().any(|&s| cave.screens[s].distance_m(&eye) < 0.01) {
                continue;
            }
            let point = eye + (on_edge - eye) * far;
            let mut along = Vec::new();
            for (screen, edge) in [gap.first, gap.second] {
                let view = FacetView::new(eye, corners(&cave.screens[screen]), 0.05, 500.0).unwrap();
                let [x, y] = view.pixel(&point, width, height).unwrap();
                let (w, h) = (f64::from(width), f64::from(height));
                // distance off the picture's edge, and along it from the edge's first corner
                let (off, at) = [(y - h, x), (x - w, h - y), (y, x), (x, h - y)][edge];
                worst = worst.max(off.abs());
                let s = &cave.screens[screen];
                let (from, length) = (
                    [s.lower_left_m, s.lower_right_m, s.upper_left_m, s.lower_left_m][edge],
                    if edge % 2 == 0 { s.across() } else { s.upward() },
                );
                let pixels = if edge % 2 == 0 { w } else { h };
                along.push(from + length * (at / pixels));
            }
            worst = worst.max((along[0] - along[1]).norm() / screen.size_m()[0] * f64::from(width));
        }
    }
    assert!(worst < 1e-3, "{worst} px");
}

#[test]
fn six_faces_see_every_direction_once_and_where_it_meets_the_cube() {
    let cave = resolve_cave("cube6").unwrap().load().unwrap();
    let mut random = Random(4);
    for k in 0..20_000 {
        // anywhere inside the room of 3 m over the floor's middle
        let eye = Point3::new(random.within(-1.4, 1.4), random.within(-1.4, 1.4), random.within(0.1, 2.9));
        let direction = match k % 3 {
            // into corners and edges too
            0 => Vector3::new([-1.5, 1.5][k / 3 % 2], [-1.5, 1.5][k / 6 % 2], random.within(0.0, 3.0)) - eye.coords,
            _ => Vector3::new(random.within(-1.0, 1.0), random.within(-1.0, 1.0), random.within(-1.0, 1.0)),
        };
        // slabs: the shortest distance out of the room
        let way = (0..3).map(|a| {
            let (lo, hi) = if a == 2 { (0.0, 3.0) } else { (-1.5, 1.5) };
            ((if direction[a] > 0.0 { hi } else { lo }) - eye[a]) / direction[a]
        });
        let hit = eye + direction * way.filter(|t| t.is_finite()).fold(f64::MAX, f64::min);
        let (mut inside, mut on_rim) = (0, 0);
        for screen in &cave.screens {
            let view = FacetView::new(eye, corners(screen), 0.05, 500.0).unwrap();
            let Some(ndc) = view.project(&(eye + direction * 7.0)) else { continue };
            let most = ndc.x.abs().max(ndc.y.abs());
            if most > 1.0 + 1e-9 {
                continue;
            }
            if most < 1.0 - 1e-9 {
                inside += 1
            } else {
                on_rim += 1
            }
            let seen =
                screen.lower_left_m + screen.across() * (0.5 + 0.5 * ndc.x) + screen.upward() * (0.5 + 0.5 * ndc.y);
            assert!((seen - hit).norm() < 1e-9, "{}: {seen} and {hit}", screen.name);
        }
        assert!(
            (inside == 1 && on_rim == 0) || (inside == 0 && on_rim >= 2),
            "{eye} {direction}: {inside} faces, {on_rim} rims"
        );
    }
}

#[test]
fn bad_facets_are_refused_by_name() {
    let [a, b, c] = [Point3::new(-1.0, 2.0, 0.0), Point3::new(1.0, 2.0, 0.0), Point3::new(-1.0, 2.0, 1.5)];
    let said = |eye: Point3<f64>, corners, near, far| {
        FacetView::new(eye, corners, near, far).expect_err("refused").to_string()
    };
    assert!(said(Point3::new(0.0, 3.0, 1.0), [a, b, c], 0.1, 9.0).contains("a point in front of the screen"));
    assert!(said(Point3::origin(), [a, b, b], 0.1, 9.0).contains("three corners of a rectangle"));
    assert!(said(Point3::origin(), [a, b, c], 9.0, 9.0).contains("near_m"));
    assert!(said(Point3::new(f64::NAN, 0.0, 0.0), [a, b, c], 0.1, 9.0).contains("finite"));
}

#[test]
fn unfolded_caves_are_nets_without_overlap() {
    // in units of a face: the classic room is a T of 3 x 2, the closed one a cross of 4 x 3
    for (name, wide, high, least) in [("cube4", 3, 2, 4), ("cube6", 4, 3, 6)] {
        let cave = resolve_cave(name).unwrap().load().unwrap();
        let ([w, h], tiles) = unfold(&cave, [1200, 1200]);
        assert_eq!([w * high, tiles.len() as u32], [h * wide, least], "{name}: {w} x {h}");
        for (i, a) in tiles.iter().enumerate() {
            assert!((0..2).all(|k| a.position_px[k] + a.size_px[k] <= [w, h][k] && a.size_px[k] == w / wide));
            assert!(tiles[..i].iter().all(|b| (0..2).any(|k| a.position_px[k] + a.size_px[k] <= b.position_px[k]
                || b.position_px[k] + b.size_px[k] <= a.position_px[k])));
        }
    }
}

/// A window is created with the size of an unfolded cave, and the cave is then unfolded into the
/// window.
#[test]
fn what_is_unfolded_into_its_own_size_stays_as_it_is() {
    for cave in tumble_scene::cave::shipped_caves() {
        let cave = cave.read().unwrap();
        for most in (20..400).step_by(7).map(|w| [w, 100]).chain([[1280, 720], [1920, 1080], [150, 100]]) {
            let (size, tiles) = unfold(&cave, most);
            assert!(
                (0..2).all(|k| size[k] <= most[k]) && (0..2).any(|k| size[k] == most[k]),
                "{}: {size:?} in {most:?}",
                cave.file
            );
            assert_eq!(unfold(&cave, size), (size, tiles), "{}: {most:?}", cave.file);
        }
    }
}

// Pictures.

/// Objects, a floor, sun and lamp shadows, occlusion, gloss: everything that could depend on the
/// facet.
fn still_life() -> DrawList {
    let mut list = bare(tumble_render::Camera::default());
    (list.sky, list.settings) = Default::default();
    list.settings.shadow_map_size = 1024;
    let cube = list.add_mesh(MeshData::rounded_cuboid([1.0, 1.0, 1.0], 0.05, 2));
    for i in 0..9 {
        let (x, y) = (-3.6 + 0.9 * i as f32, 4.0 + 1.3 * (i % 3) as f32);
        let turn = UnitQuaternion::from_euler_angles(0.1 * i as f32, 0.3, 0.5 * i as f32);
        list.add_instance(
            cube,
            nalgebra::Isometry3::from_parts(nalgebra::Translation3::new(x, y, 0.6), turn),
            Material::plastic([0.2 + 0.08 * i as f32, 0.5, 0.3]),
        );
        list.add_sphere(
            Point3::new(x + 0.4, y - 0.8, 0.35),
            0.35,
            UnitQuaternion::identity(),
            Material::billiard_ball(i as u8 + 1),
        );
    }
    list.ground = Some(Ground::grid(0.0));
    list.lights.push(Light::sun(Vector3::new(0.4, 0.5, -1.0), 2.0));
    list.lights.push(Light::lamp(Point3::new(1.0, 1.0, 4.0), 1.0, 4.0));
    list
}

const EYE: Point3<f64> = Point3::new(0.3, 0.0, 1.6);

/// The part of a wall 6 m wide and 2 m high at y = 2 from `from` to `to` of its width, in a picture
/// of this size in pixels.
fn part_of_wall(list: &DrawList, eye: Point3<f64>, from: f64, to: f64, width: u32, height: u32) -> Option<Image> {
    let at = |t: f64, z: f64| Point3::new(-3.0 + 6.0 * t, 2.0, z);
    let view = FacetView::new(eye, [at(from, 0.2), at(to, 0.2), at(from, 2.2)], 0.05, 200.0)
        .unwrap()
        .part(width, height, RIM_PX);
    picture_from(&view, list, width, height)
}

/// Pixels of two pictures that differ by more than one level.
fn differing(a: &Image, b: &Image) -> Vec<(u32, u32)> {
    let all = (0..a.height).flat_map(|y| (0..a.width).map(move |x| (x, y)));
    all.filter(|&(x, y)| levels_apart(a.pixel(x, y).unwrap(), b.pixel(x, y).unwrap()) > 1).collect()
}

fn levels_apart(p: [u8; 4], q: [u8; 4]) -> u8 {
    p.iter().zip(&q).map(|(p, q)| p.abs_diff(*q)).max().unwrap_or(0)
}

/// Whether a picture has an edge within two pixels of a place.
fn at_edge(image: &Image, &(x, y): &(u32, u32)) -> bool {
    let here = image.pixel(x, y).unwrap();
    let near = |at: u32, most: u32| at.saturating_sub(2)..=(at + 2).min(most - 1);
    near(y, image.height).any(|j| near(x, image.width).any(|i| levels_apart(image.pixel(i, j).unwrap(), here) > 6))
}

fn joined(parts: &[Image]) -> Image {
    let (width, height) = (parts.iter().map(|p| p.width).sum(), parts[0].height);
    let rows = (0..height as usize).flat_map(|y| {
        parts.iter().flat_map(move |p| p.rgba[4 * y * p.width as usize..][..4 * p.width as usize].to_vec())
    });
    Image { width, height, rgba: rows.collect() }
}

/// Differences lie at edges of objects, whose corners are rounded to a fraction of a pixel that
/// differs between the parts.
#[test]
fn a_wall_in_parts_is_the_wall() {
    let all = 768 * 256;
    for (occlusion, shadows) in [(false, false), (false, true), (true, true)] {
        let mut list = still_life();
        list.settings.occlusion_m = if occlusion { None } else { Some(0.0) };
        for light in &mut list.lights {
            let (Light::Directional { casts_shadow, .. } | Light::Point { casts_shadow, .. }) = light;
            *casts_shadow = shadows;
        }
        let Some(whole) = part_of_wall(&list, EYE, 0.0, 1.0, 768, 256) else { return };
        for parts in [2u32, 6] {
            let share = |i: u32| f64::from(i) / f64::from(parts);
            let cut = |step: f64| {
                joined(
                    &(0..parts)
                        .filter_map(|i| {
                            part_of_wall(
                                &list,
                                EYE + Vector3::x() * (step * f64::from(i)),
                                share(i),
                                share(i + 1),
                                768 / parts,
                                256,
                            )
                        })
                        .collect::<Vec<_>>(),
                )
            };
            let parted = cut(0.0);
            let off = differing(&whole, &parted);
            let elsewhere: Vec<_> = off.iter().filter(|at| !at_edge(&whole, at)).collect();
            let most = elsewhere
                .iter()
                .map(|&&(x, y)| levels_apart(whole.pixel(x, y).unwrap(), parted.pixel(x, y).unwrap()))
                .max()
                .unwrap_or(0);
            println!(
                "{parts} parts, occlusion {occlusion}, shadows {shadows}: {} of {all} pixels off; {} away from edges, by {most} levels",
                off.len(),
                elsewhere.len()
            );
            assert!(off.len() * 1000 < all, "{parts} parts: {} of {all} pixels off", off.len());
            assert!(
                elsewhere.is_empty(),
                "{parts} parts: {} away from edges, by {most} levels: {elsewhere:?}",
                elsewhere.len()
            );
        }
        // and a fault would show: each part from an eye 2 cm off
        let aside = joined(
            &(0..3)
                .filter_map(|i| {
                    part_of_wall(
                        &list,
                        EYE + Vector3::x() * (0.02 * i as f64),
                        i as f64 / 3.0,
                        (i + 1) as f64 / 3.0,
                        256,
                        256,
                    )
                })
                .collect::<Vec<_>>(),
        );
        let shifted = differing(&whole, &aside).len();
        assert!(shifted * 50 > all, "shifted: only {shifted} of {all} pixels off");
    }
}

/// Along the edge of two walls at a right angle, the last column of one and the first of the other
/// are neighbors like any two columns: brightness does not jump there.
#[test]
fn brightness_does_not_jump_where_walls_meet() {
    let list = still_life();
    let (a, b, c) = (Point3::new(-2.0, 2.0, 0.2), Point3::new(0.5, 2.0, 0.2), Point3::new(0.5, -0.5, 0.2));
    let up = Vector3::z() * 2.0;
    let draw = |from: Point3<f64>, to: Point3<f64>| {
        picture_from(
            &FacetView::new(Point3::new(-0.4, 0.0, 1.6), [from, to, from + up], 0.05, 200.0)
                .unwrap()
                .part(320, 256, RIM_PX),
            &list,
            320,
            256,
        )
    };
    let (Some(left), Some(right)) = (draw(a, b), draw(b, c)) else { return };
    let column = |image: &Image, x: u32| -> Vec<f64> {
        (0..image.height)
            .map(|y| image.pixel(x, y).unwrap()[..3].iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0)
            .collect()
    };
    let apart = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(p, q)| (p - q).abs()).sum::<f64>() / p.len() as f64;
    let bias = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(p, q)| p - q).sum::<f64>() / p.len() as f64;
    let inside = (300..319).map(|x| apart(&column(&left, x), &column(&left, x + 1))).sum::<f64>() / 19.0;
    let (last, first) = (column(&left, 319), column(&right, 0));
    println!(
        "levels between columns: {inside:.3} inside, {:.3} across the seam; bias {:.3}",
        apart(&last, &first),
        bias(&last, &first)
    );
    assert!(
        apart(&last, &first) < 2.0 * inside + 0.3 && bias(&last, &first).abs() < 0.5,
        "{inside} inside, {} across, bias {}",
        apart(&last, &first),
        bias(&last, &first)
    );
}

#[test]
fn a_facet_straight_ahead_is_the_pinhole() {
    // a wall 2 m ahead, 2 m high: 2 atan(1/2) from bottom to top
    let list = still_life();
    let at = |x: f64, z: f64| Point3::new(x, 2.0, z);
    let view =
        FacetView::new(Point3::new(0.0, 0.0, 1.2), [at(-1.5, 0.2), at(1.5, 0.2), at(-1.5, 2.2)], 0.05, 500.0).unwrap();
    let Some(facet) = picture_from(&view, &list, 240, 160) else { return };
    let mut pinhole = list.clone();
    pinhole.camera = tumble_render::Camera::look_at(Point3::new(0.0, 0.0, 1.2), Point3::new(0.0, 5.0, 1.2))
        .with_fov(2.0 * 0.5f32.atan());
    let off = differing(&facet, &picture(&pinhole, 240, 160).unwrap());
    let inside = off.iter().filter(|at| !at_edge(&facet, at)).count();
    println!("{} pixels off, {inside} away from edges", off.len());
    assert!(off.len() < 240 * 160 / 500 && inside == 0, "{} pixels, {inside} away from edges", off.len());
}
