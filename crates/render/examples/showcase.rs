//! Draws a test composition to a PNG: `cargo run --release -p tumble-render --example showcase --
//! out.png [billiards|bowling|boxes|debug|many] [width height]`.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use tumble_render::{
    Camera, DebugStyle, DrawList, Ground, Light, Material, MeshData, Pattern, RenderError, Renderer, Sky,
};

fn main() -> Result<(), RenderError> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().unwrap_or_else(|| "showcase.png".into());
    let scene = arguments.next().unwrap_or_else(|| "billiards".into());
    let mut side = |default: u32| arguments.next().and_then(|a| a.parse().ok()).unwrap_or(default);
    let (width, height) = (side(1280), side(720));
    let list = match scene.as_str() {
        "bowling" => bowling(),
        "boxes" => boxes(false),
        "debug" => boxes(true),
        "many" => many(),
        _ => billiards(),
    };
    let mut renderer = Renderer::new()?;
    println!("{}", renderer.adapter());
    renderer.render(&list, width, height)?; // warms up: shaders, uploads
    let start = std::time::Instant::now();
    let image = renderer.render(&list, width, height)?;
    println!("{path}: {width} x {height} in {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    image.write_png(&path)?;
    Ok(())
}

/// A reproducible rotation that looks random.
fn turn(i: usize) -> UnitQuaternion<f32> {
    let k = i as f32;
    UnitQuaternion::from_euler_angles((k * 1.7).sin() * 1.2, (k * 2.3).cos() * 0.9, k * 2.4)
}

fn billiards() -> DrawList {
    let mut list = DrawList::default();
    let r = 0.028575;
    let (long, wide) = (2.54, 1.27);
    let slab = list.add_mesh(MeshData::cuboid([long + 0.2, wide + 0.2, 0.04]));
    list.add_instance(slab, Isometry3::translation(0.0, 0.0, -0.02), Material::felt()).casts_shadow = false;
    let wood = Material { clearcoat: 0.5, ..Material::walnut() };
    let rails = [
        (long / 2.0 + 0.14, 0.0, wide / 2.0 + 0.07, 0.0),
        (wide / 2.0, long / 2.0 + 0.07, 0.0, std::f32::consts::FRAC_PI_2),
    ];
    for (half, x, y, angle) in rails {
        let rail = list.add_mesh(MeshData::rounded_cuboid([2.0 * half, 0.14, 0.09], 0.015, 4));
        for sign in [-1.0, 1.0] {
            list.add_instance(rail, Isometry3::new(Vector3::new(sign * x, sign * y, 0.0), Vector3::z() * angle), wood);
        }
    }
    let order = [1, 9, 2, 10, 8, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15];
    let mut next = 0;
    for row in 0..5 {
        for k in 0..=row {
            let (x, y) = (0.25 + row as f32 * r * 1.75, (k as f32 - row as f32 / 2.0) * r * 2.02);
            list.add_sphere(Point3::new(x, y, r), r, turn(next), Material::billiard_ball(order[next]));
            next += 1;
        }
    }
    list.add_sphere(Point3::new(-0.28, 0.06, r), r, turn(40), Material::billiard_ball(0));
    list.add_sphere(
        Point3::new(-0.05, -0.14, r),
        r,
        UnitQuaternion::from_euler_angles(0.1, 0.0, -2.2),
        Material::billiard_ball(9),
    );
    list.add_sphere(
        Point3::new(-0.12, 0.22, r),
        r,
        UnitQuaternion::from_euler_angles(0.2, 0.2, -2.2),
        Material::billiard_ball(3),
    );
    list.lights.push(Light::lamp(Point3::new(0.1, 0.1, 1.1), 1.9, 1.1));
    list.lights.push(Light::lamp(Point3::new(-0.9, 0.1, 1.1), 0.9, 1.1));
    list.sky = Sky { ground: [0.10, 0.36, 0.22], ..Sky::hall() };
    list.camera = Camera::look_at(Point3::new(-0.85, -0.42, 0.42), Point3::new(0.1, 0.02, 0.0)).with_fov(0.62);
    list
}

/// The outline of a regulation pin: radius and height, m.
const PIN: [[f32; 2]; 19] = [
    [0.0, 0.0],
    [0.0258, 0.0],
    [0.0280, 0.003],
    [0.0359, 0.01905],
    [0.0496, 0.05715],
    [0.0573, 0.0857],
    [0.0605, 0.1143],
    [0.0580, 0.1492],
    [0.0470, 0.1842],
    [0.0314, 0.2191],
    [0.0250, 0.2381],
    [0.0228, 0.2540],
    [0.0237, 0.2762],
    [0.0266, 0.2985],
    [0.0306, 0.3207],
    [0.0323, 0.3429],
    [0.0250, 0.3680],
    [0.0140, 0.3775],
    [0.0, 0.3810],
];

fn bowling() -> DrawList {
    let mut list = DrawList::default();
    let lane = list.add_mesh(MeshData::cuboid([8.0, 1.054, 0.06]));
    list.add_instance(lane, Isometry3::translation(2.2, 0.0, -0.03), Material::lane_wood()).casts_shadow = false;
    let gutter = list.add_mesh(MeshData::cuboid([8.0, 0.24, 0.04]));
    let divider = list.add_mesh(MeshData::rounded_cuboid([8.0, 0.1, 0.14], 0.015, 3));
    for side in [-1.0, 1.0] {
        list.add_instance(
            gutter,
            Isometry3::translation(2.2, side * 0.647, -0.08),
            Material::plastic([0.16, 0.16, 0.18]),
        )
        .casts_shadow = false;
        list.add_instance(divider, Isometry3::translation(2.2, side * 0.82, 0.0), Material::walnut()).casts_shadow =
            false;
    }
    let pin = list.add_mesh(MeshData::lathe(&smooth(&PIN), 48, 0.9));
    let mut i = 0;
    for row in 0..4 {
        for k in 0..=row {
            let (x, y) = (4.0 + row as f32 * 0.264, (k as f32 - row as f32 / 2.0) * 0.3048);
            let pose = match i {
                0 => Isometry3::new(Vector3::new(3.9, 0.22, 0.06), Vector3::new(1.35, 0.7, 0.0)),
                2 => Isometry3::new(Vector3::new(x, y + 0.05, 0.01), Vector3::new(0.25, 0.15, 0.0)),
                _ => Isometry3::translation(x, y, 0.0),
            };
            list.add_instance(pin, pose, Material::bowling_pin(0.0));
            i += 1;
        }
    }
    let mut ball = Material::glossy([0.10, 0.14, 0.42]);
    ball.pattern = Pattern::Plain;
    list.add_sphere(Point3::new(3.45, -0.08, 0.1085), 0.1085, turn(3), ball);
    list.lights.push(Light::lamp(Point3::new(2.6, 0.8, 2.6), 1.6, 2.8));
    list.lights.push(Light::lamp(Point3::new(4.3, -0.3, 2.2), 1.0, 2.2));
    list.sky = Sky { ground: [0.52, 0.38, 0.24], ..Sky::hall() };
    list.camera = Camera::look_at(Point3::new(1.9, -0.75, 0.75), Point3::new(4.15, 0.02, 0.12)).with_fov(0.6);
    list
}

/// A Catmull-Rom curve through the outline, four pieces per edge; the flat base stays flat.
fn smooth(points: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let at = |i: isize| points[i.clamp(1, points.len() as isize - 1) as usize];
    let mut out = vec![points[0]];
    for i in 1..points.len() as isize - 1 {
        let (a, b, c, d) = (at(i - 1), at(i), at(i + 1), at(i + 2));
        for k in 0..4 {
            let t = k as f32 / 4.0;
            out.push(std::array::from_fn(|j| {
                let (p0, p1, p2, p3) = (a[j], b[j], c[j], d[j]);
                0.5 * (2.0 * p1
                    + (p2 - p0) * t
                    + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * t * t
                    + (3.0 * p1 - p0 - 3.0 * p2 + p3) * t * t * t)
            }));
        }
    }
    out.push(points[points.len() - 1]);
    out
}

/// A heap of a thousand spheres.
fn many() -> DrawList {
    let mut list = DrawList::default();
    for i in 0..1000 {
        let (layer, k) = (i / 100, i % 100);
        let at = Point3::new(
            (k % 10) as f32 * 0.21 + 0.02 * (i as f32).sin(),
            (k / 10) as f32 * 0.21 + 0.02 * (i as f32 * 1.3).cos(),
            0.1 + layer as f32 * 0.19,
        );
        list.add_sphere(at, 0.1, turn(i), Material::billiard_ball((i % 16) as u8));
    }
    list.ground = Some(Ground::grid(0.0));
    list.lights.push(Light::sun(Vector3::new(0.5, 0.75, -1.0), 2.0));
    list.camera = list.framing_camera(Vector3::new(1.0, 0.6, -0.45));
    list
}

fn boxes(debug: bool) -> DrawList {
    let mut list = DrawList::default();
    let cube = list.add_mesh(MeshData::rounded_cuboid([0.5; 3], 0.02, 3));
    let colors = [
        [0.80, 0.27, 0.20],
        [0.93, 0.69, 0.25],
        [0.26, 0.50, 0.70],
        [0.35, 0.60, 0.38],
        [0.88, 0.85, 0.78],
        [0.55, 0.36, 0.60],
    ];
    let mut i = 0;
    for level in 0..4 {
        for k in 0..4 - level {
            let y = (k as f32 - (3 - level) as f32 / 2.0) * 0.54;
            let pose = Isometry3::new(
                Vector3::new(0.0, y, 0.25 + 0.5 * level as f32),
                Vector3::z() * 0.06 * ((i as f32) * 2.1).sin(),
            );
            list.add_instance(cube, pose, Material::plastic(colors[i % colors.len()]));
            i += 1;
        }
    }
    let capsule = list.add_mesh(MeshData::capsule(0.15, 0.6, 48));
    list.add_instance(
        capsule,
        Isometry3::new(Vector3::new(-0.9, -0.5, 0.15), Vector3::new(0.0, std::f32::consts::FRAC_PI_2, 0.0)),
        Material::glossy([0.85, 0.35, 0.15]),
    );
    let cylinder = list.add_mesh(MeshData::cylinder(0.2, 0.6, 64));
    list.add_instance(cylinder, Isometry3::translation(-0.8, 0.7, 0.3), Material::metal([0.90, 0.75, 0.45]));
    list.add_sphere(
        Point3::new(-1.1, 0.15, 0.2),
        0.2,
        turn(2),
        Material::glossy([0.2, 0.35, 0.5]).with_pattern(Pattern::Checker { other: [0.9, 0.9, 0.88], size_m: 0.1 }),
    );
    list.add_sphere(Point3::new(0.35, -1.35, 0.3), 0.3, turn(2), Material::metal([0.95, 0.93, 0.90]));
    list.ground = Some(Ground { height_m: 0.0, reach_m: 30.0, material: Material::checker(0.5) });
    list.lights.push(Light::sun(Vector3::new(0.5, -0.75, -1.0), 2.0));
    list.camera = Camera::look_at(Point3::new(-4.3, -2.1, 2.0), Point3::new(0.0, -0.1, 0.72)).with_fov(0.62);
    if debug {
        add_debug(&mut list);
    }
    list
}

fn add_debug(list: &mut DrawList) {
    let contact = Point3::new(-1.1, 0.15, 0.0);
    list.point(contact, DebugStyle::new([1.0, 0.1, 0.1]).width(9.0).on_top());
    list.arrow(contact, Vector3::z() * 0.7, DebugStyle::new([0.1, 0.9, 0.2]).width(3.0).on_top());
    list.arrow(
        Point3::new(-1.1, 0.15, 0.2),
        Vector3::new(-0.3, -0.5, 0.1),
        DebugStyle::new([0.1, 0.3, 1.0]).width(3.0),
    );
    list.line(Point3::new(-2.0, -2.0, 0.0), Point3::new(2.0, 2.0, 0.0), DebugStyle::new([1.0, 0.9, 0.1]));
    list.wire_sphere(Point3::new(0.35, -1.35, 0.3), 0.42, DebugStyle::new([0.9, 0.2, 0.7]).width(1.5));
    for k in 0..8 {
        let corner = |b: usize| if k >> b & 1 == 0 { -0.14 } else { 0.14 };
        list.shell(
            Point3::new(corner(0), -0.8 + corner(1), 0.25 + corner(2)),
            0.16,
            DebugStyle::new([0.2, 0.8, 0.9]).opacity(0.5),
        );
    }
}
