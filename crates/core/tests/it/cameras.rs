//! Depth and segmentation cameras against closed forms and single rays.

use crate::common::*;
use std::f64::consts::{FRAC_PI_2, PI};
use tumble_core::articulated::{Joint, LinkMass, ModelBuilder};
use tumble_core::collide::{Pose, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

/// A camera one meter above the ground that looks down: x of the image along x, y along −y.
pub fn down(height: f64) -> Pose {
    Pose::new(Vec3::new(0.0, 0.0, height), Vec3::x() * PI)
}

fn camera(world: &mut World, kind: SensorKind, site: Anchor, optics: Optics) -> ObjectId {
    world.add(Sensor::new(kind.name(), kind, site).unwrap().with_optics(optics).unwrap()).unwrap()
}

#[test]
fn the_depth_of_a_plane_is_its_distance_and_that_of_a_sphere_the_closed_form() {
    let mut world = world("time_stepping", 0.01);
    ground(&mut world, 0.0, 0.5);
    let ball = world.add_static(RigidBody::fixed(sphere(0.5)).with_pose(Pose::translation(0.3, 0.2, 0.5))).unwrap();
    let optics = Optics { resolution: [80, 60], vertical_fov: 1.2 };
    let depth = camera(&mut world, SensorKind::Depth, Anchor::world(down(3.0)), optics);
    let parts = camera(&mut world, SensorKind::Segmentation, Anchor::world(down(3.0)), optics);
    let (depth, parts) = (world.depth_image(depth).unwrap(), world.segmentation_image(parts).unwrap());
    assert_eq!((depth.width, depth.height, depth.pixels.len()), (80, 60, 4800));
    let focal = 30.0 / 0.6_f64.tan();
    let mut seen = 0;
    for (k, (depth, part)) in depth.pixels.iter().zip(&parts.pixels).enumerate() {
        let (row, column) = ((k / 80) as f64, (k % 80) as f64);
        let d = Vec3::new((column + 0.5 - 40.0) / focal, -(row + 0.5 - 30.0) / focal, -1.0);
        // |o + s·d − c|² = r², the depth is s
        let to = Vec3::new(0.3, 0.2, 0.5 - 3.0);
        let (a, b, c) = (d.norm_squared(), d.dot(&to), to.norm_squared() - 0.25);
        let root = b * b - a * c;
        let (expected, on_ball) = if root >= 0.0 { ((b - root.sqrt()) / a, true) } else { (3.0, false) };
        assert!((depth - expected).abs() < 1e-12, "{row} {column}: {depth}, expected {expected}");
        let id = part.unwrap().0;
        assert_eq!(id == ball, on_ball, "{row} {column}");
        seen += usize::from(on_ball);
    }
    assert!(seen > 200, "{seen}");
}

#[test]
fn a_camera_sees_what_single_rays_meet_on_any_number_of_threads_and_not_its_own_body() {
    let mut world = world("time_stepping", 0.01);
    ground(&mut world, 0.0, 0.5);
    let torus = Shape::mesh(TriMesh::torus(0.4, 0.15, 48, 24), &TreeSettings::default()).unwrap();
    let shapes = [torus, cube(0.5), sphere(0.3), Shape::cylinder(0.2, 0.6).unwrap(), Shape::cone(0.3, 0.5).unwrap()];
    for (k, shape) in shapes.into_iter().enumerate() {
        let pose = Pose::new(Vec3::new(k as f64 * 0.8 - 1.6, 2.0 + 0.3 * k as f64, 0.6), Vec3::new(0.3, 0.2, k as f64));
        world.add(RigidBody::new(shape).with_pose(pose)).unwrap();
    }
    // in the middle of a box that carries it, looks along y
    let carrier = RigidBody::new(cube(0.4)).with_pose(Pose::new(Vec3::new(0.0, -1.0, 0.8), Vec3::z() * 0.2));
    let carrier = world.add(carrier).unwrap();
    let site = Anchor::on(carrier, 0, Pose::new(Vec3::zeros(), Vec3::x() * -FRAC_PI_2));
    let optics = Optics { resolution: [70, 50], vertical_fov: 1.0 };
    let depth = camera(&mut world, SensorKind::Depth, site, optics);
    let parts = camera(&mut world, SensorKind::Segmentation, site, optics);
    let image = world.depth_image(depth).unwrap();
    let seen = world.segmentation_image(parts).unwrap();
    let pose = world.part_state(carrier, 0).unwrap().pose * site.frame;
    let focal = 25.0 / 0.5_f64.tan();
    let filter = QueryFilter::default().ignoring(carrier);
    let mut none = 0;
    for (k, (depth, part)) in image.pixels.iter().zip(&seen.pixels).enumerate() {
        let d = Vec3::new(((k % 70) as f64 + 0.5 - 35.0) / focal, ((k / 70) as f64 + 0.5 - 25.0) / focal, 1.0);
        let (origin, direction) = (pose.translation.vector, pose.rotation * d);
        let hit = world.cast_ray(&Ray { origin, direction, max_distance: f64::INFINITY }, &filter);
        assert_eq!(part.map(|(id, _)| id), hit.map(|hit| hit.id));
        let expected = hit.map_or(-1.0, |hit| hit.distance / d.norm());
        assert!((depth - expected).abs() < 1e-12, "{depth}, expected {expected}");
        none += usize::from(hit.is_none());
    }
    assert!(none > 100 && none < 3000, "{none} pixels of the sky");
    for threads in [2, 4] {
        world.set_settings(world.settings().with_threads(threads)).unwrap();
        assert_eq!(
            (world.depth_image(depth).unwrap(), world.segmentation_image(parts).unwrap()),
            (image.clone(), seen.clone())
        );
    }
    // what follows the state follows the image: a fork, a snapshot, an archive
    let (fork, saved) = (world.fork(), world.save());
    world.step().unwrap();
    let later = world.depth_image(depth).unwrap();
    assert!(later != image && fork.depth_image(depth).unwrap() == image);
    world.restore(&saved).unwrap();
    assert_eq!(world.depth_image(depth).unwrap(), image);
    let archived = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    let again = archived.find("depth").unwrap();
    assert_eq!(archived.depth_image(again).unwrap(), image);
}

/// The color of a pixel is that of the surface, dimmed in linear light by the angle between its normal and the ray.
#[test]
fn a_color_camera_sees_the_color_that_an_event_gives() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let ball = world.add_static(RigidBody::fixed(sphere(0.5))).unwrap();
    let painted = Action::Recolor { body: Subject::Part(ball, 0), color: [0.0, 1.0, 0.0] };
    world.add(ScriptedEvent::new("event", Trigger::Time { at: 0.005 }).with_action(painted)).unwrap();
    let site = Anchor::world(Pose::new(Vec3::new(0.0, 0.0, 3.0), Vec3::x() * PI));
    let camera = camera(&mut world, SensorKind::Color, site, Optics { resolution: [3, 3], vertical_fov: 0.2 });
    let middle = |world: &World| world.color_image(camera).unwrap().pixels[4];
    let [red, green, blue] = middle(&world);
    assert!(red > 150 && green > 150 && blue > 150);
    let (before, plain) = (world.save(), world.color_image(camera).unwrap());
    world.step().unwrap();
    assert_eq!(middle(&world), [0, 255, 0]);
    // what follows the state follows the color: a fork, a snapshot, an archive
    let (image, saved) = (world.color_image(camera).unwrap(), world.save());
    let archived = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    assert_eq!(archived.color_image(archived.find("color").unwrap()).unwrap(), image);
    assert_eq!(world.fork().color_image(camera).unwrap(), image);
    world.restore(&before).unwrap();
    assert_eq!(world.color_image(camera).unwrap(), plain);
    assert_ne!(plain, image);
    world.restore(&saved).unwrap();
    assert_eq!(world.color_image(camera).unwrap(), image);
}

#[test]
fn a_color_camera_sees_the_colors_of_bodies_by_its_own_light() {
    let mut world = no_gravity(world("time_stepping", 0.01));
    let painted = |color: [f32; 3]| Appearance { color, ..Appearance::default() };
    let red = RigidBody::fixed(sphere(0.5))
        .with_visuals(vec![Visual::shape(0, Pose::identity(), sphere(0.5), painted([0.8, 0.2, 0.1]))])
        .with_pose(Pose::translation(0.0, 0.0, 1.0));
    world.add_static(red).unwrap();
    // one link with two shapes of different colors, the left one blue and the right one green
    let link = |color, x| {
        let look = painted(color);
        (
            Visual::shape(0, Pose::translation(x, 0.0, 0.0), cube(0.4), look),
            Collider::new(cube(0.4), Pose::translation(x, 0.0, 0.0)),
        )
    };
    let mut builder = ModelBuilder::new();
    let mass = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: tumble_core::collide::Mat3::identity() };
    builder.link("carriage", None, Joint::prismatic(Vec3::y()), Pose::translation(0.0, 2.0, 1.0), mass);
    let mut body = ArticulatedBody::new("cart", builder.build().unwrap());
    for (color, x) in [([0.0, 0.0, 1.0], -0.3), ([0.0, 1.0, 0.0], 0.3)] {
        let (visual, collider) = link(color, x);
        body.add_visual("carriage", visual).unwrap();
        body.add_collider("carriage", collider).unwrap();
    }
    world.add(body).unwrap();
    let optics = Optics { resolution: [81, 61], vertical_fov: 1.2 };
    let site = |x: f64, y: f64| Anchor::world(Pose::new(Vec3::new(x, y, 3.0), Vec3::x() * PI));
    let ball = camera(&mut world, SensorKind::Color, site(0.0, 0.0), optics);
    let image = world.color_image(ball).unwrap();
    let curve = |light: f64| if light <= 0.0031308 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    let linear = |c: f64| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    let focal = 30.5 / 0.6_f64.tan();
    let mut seen = 0;
    for (k, pixel) in image.pixels.iter().enumerate() {
        let d = Vec3::new(((k % 81) as f64 - 40.0) / focal, -((k / 81) as f64 - 30.0) / focal, -1.0).normalize();
        let to = Vec3::new(0.0, 0.0, -2.0);
        let root = d.dot(&to).powi(2) - to.norm_squared() + 0.25;
        if root < 0.0 {
            assert_eq!(*pixel, [0; 3], "pixel {k} shows nothing");
            continue;
        }
        let normal = (d * (d.dot(&to) - root.sqrt()) - to) / 0.5;
        let light = 0.25 + 0.75 * -normal.dot(&d);
        let expected = [0.8, 0.2, 0.1].map(|c: f32| 255.0 * curve(light * linear(f64::from(c))));
        assert!(
            pixel.iter().zip(expected).all(|(c, e)| (f64::from(*c) - e).abs() < 0.5001),
            "{k}: {pixel:?}, {expected:?}"
        );
        seen += 1;
    }
    assert!(seen > 300, "{seen}");
    let above = Sensor::new("above", SensorKind::Color, site(0.0, 2.0)).unwrap().with_optics(optics).unwrap();
    let cart = world.add(above).unwrap();
    let image = world.color_image(cart).unwrap();
    let at = |column: usize| image.pixels[30 * 81 + column];
    assert!(at(30)[2] > 240 && at(30)[1] == 0 && at(50)[1] > 240 && at(50)[2] == 0, "{:?} {:?}", at(30), at(50));
    assert_eq!(at(40), [0; 3], "between the shapes");
    assert!(world.depth_image(cart).is_none() && world.color_image(ball).is_some());
}

#[test]
fn the_noise_of_an_image_has_its_deviation_and_is_that_of_seed_and_frame() {
    let made = |seed: u64| {
        let mut world = world("time_stepping", 0.01);
        ground(&mut world, 0.0, 0.5);
        let noise = SensorNoise { deviation: 0.02, seed, ..SensorNoise::default() };
        let sensor = Sensor::new("eye", SensorKind::Depth, Anchor::world(down(2.0))).unwrap();
        let optics = Optics { resolution: [200, 100], vertical_fov: 1.0 };
        let id = world.add(sensor.with_optics(optics).unwrap().with_noise(noise).unwrap()).unwrap();
        (world, id)
    };
    let (mut world, eye) = made(1);
    let image = |world: &World| world.depth_image(eye).unwrap().pixels;
    let first = image(&world);
    assert!(first == image(&world), "reading changes nothing");
    let n = first.len() as f64;
    let mean = first.iter().sum::<f64>() / n;
    let deviation = (first.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    // standard errors: σ/√n, σ/√(2n)
    assert!((mean - 2.0).abs() < 4.0 * 0.02 / n.sqrt() && (deviation - 0.02).abs() < 4.0 * 0.02 / (2.0 * n).sqrt());
    world.step().unwrap();
    let second = image(&world);
    assert!(second != first, "each frame has noise of its own");
    let (mut twin, _) = made(1);
    assert!(image(&twin) == first);
    twin.step().unwrap();
    assert!(image(&twin) == second && image(&world.fork()) == second);
    assert!(image(&made(2).0) != first);
    twin.seed_sensor(eye, 2).unwrap();
    assert!(image(&twin) != second);
}

#[test]
fn constants_of_cameras_out_of_range_are_refused() {
    let depth = || Sensor::new("eye", SensorKind::Depth, Anchor::world(Pose::identity())).unwrap();
    for (optics, what) in [
        (Optics { resolution: [0, 10], ..Optics::default() }, "number of pixels"),
        (Optics { resolution: [1 << 13, 1 << 12], ..Optics::default() }, "number of pixels"),
        (Optics { vertical_fov: PI, ..Optics::default() }, "angle of view"),
        (Optics { vertical_fov: f64::NAN, ..Optics::default() }, "angle of view"),
    ] {
        let why = depth().with_optics(optics).unwrap_err().to_string();
        assert!(why.contains(what), "{why}");
    }
    let gyro = Sensor::new("gyro", SensorKind::Gyroscope, Anchor::world(Pose::identity())).unwrap();
    assert!(gyro.with_optics(Optics::default()).unwrap_err().to_string().contains("only cameras"));
    let parts = Sensor::new("parts", SensorKind::Segmentation, Anchor::world(Pose::identity())).unwrap();
    let (deviation, bias_walk, quantization) = (0.1, 0.1, 0.1);
    for noise in [
        SensorNoise { deviation, ..SensorNoise::default() },
        SensorNoise { bias_walk, ..SensorNoise::default() },
        SensorNoise { quantization, delay: 2, ..SensorNoise::default() },
    ] {
        let why = parts.clone().with_noise(noise).unwrap_err().to_string();
        assert!(why.contains("a segmentation has no noise") && why.contains("it may have a delay"), "{why}");
    }
    assert!(parts.with_noise(SensorNoise { delay: 2, ..SensorNoise::default() }).is_ok());
    let noisy = depth().with_noise(SensorNoise { bias_walk: -1.0, ..SensorNoise::default() });
    assert!(noisy.unwrap_err().to_string().contains("the walk of the bias"));
}
