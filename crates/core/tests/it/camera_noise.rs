//! Delay, walk of a bias and noise of cameras.

use crate::cameras::down;
use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

/// A ball that falls past a camera above the ground, and takes another color on its way.
fn falling(kind: SensorKind, noise: SensorNoise) -> (World, ObjectId) {
    let mut world = world("time_stepping", 0.01);
    ground(&mut world, 0.0, 0.5);
    let ball = RigidBody::new(sphere(0.2)).with_mass(1.0).with_pose(Pose::translation(0.0, 0.0, 1.8));
    let ball = world.add(ball).unwrap();
    let painted = Action::Recolor { body: Subject::Part(ball, 0), color: [0.9, 0.1, 0.1] };
    world.add(ScriptedEvent::new("event", Trigger::Time { at: 0.05 }).with_action(painted)).unwrap();
    let camera = Sensor::new("eye", kind, Anchor::world(down(2.5))).unwrap();
    let optics = Optics { resolution: [16, 12], vertical_fov: 1.0 };
    let id = world.add(camera.with_optics(optics).unwrap().with_noise(noise).unwrap()).unwrap();
    (world, id)
}

/// The image of a camera of any kind, as numbers.
fn image(world: &World, id: ObjectId) -> Vec<f64> {
    match world.get::<Sensor>(id).unwrap().kind() {
        SensorKind::Depth => world.depth_image(id).unwrap().pixels,
        SensorKind::Color => world.color_image(id).unwrap().pixels.into_iter().flatten().map(f64::from).collect(),
        _ => {
            let seen = world.segmentation_image(id).unwrap().pixels;
            let number = |part: Option<(ObjectId, usize)>| {
                part.map_or(-1.0, |(id, part)| {
                    world.ids().iter().position(|other| *other == id).unwrap() as f64 + 0.001 * part as f64
                })
            };
            seen.into_iter().map(number).collect()
        }
    }
}

#[test]
fn a_delayed_image_is_that_of_so_many_frames_before_to_the_bit() {
    for kind in [SensorKind::Depth, SensorKind::Color, SensorKind::Segmentation] {
        let noise = match kind {
            SensorKind::Segmentation => SensorNoise::default(),
            SensorKind::Color => SensorNoise { deviation: 4.0, bias_walk: 20.0, seed: 3, ..SensorNoise::default() },
            _ => SensorNoise { deviation: 0.01, bias_walk: 0.1, quantization: 1e-3, seed: 3, ..SensorNoise::default() },
        };
        for delay in [1, 3] {
            let ((mut prompt, eye), (mut late, same)) =
                (falling(kind, noise), falling(kind, SensorNoise { delay, ..noise }));
            assert_eq!(eye, same);
            let mut images = vec![image(&prompt, eye)];
            assert_eq!(image(&late, eye), images[0]);
            for frame in 1..=30_usize {
                prompt.step().unwrap();
                late.step().unwrap();
                images.push(image(&prompt, eye));
                let expected = &images[frame.saturating_sub(delay as usize)];
                assert!(image(&late, eye) == *expected, "{} at frame {frame}", kind.name());
                if frame == 12 {
                    // forks, snapshots and archives have the images that are on their way
                    let saved = late.save();
                    let archived = World::from_archive(&late.archive(&[]).unwrap(), &mut |_| None).unwrap();
                    let (mut copies, restored) =
                        (vec![late.fork(), archived], falling(kind, SensorNoise { delay, ..noise }).0);
                    copies.push(restored);
                    copies[2].restore(&saved).unwrap();
                    let mut end = late.fork();
                    (0..5).for_each(|_| _ = end.step().unwrap());
                    for mut copy in copies {
                        let own = copy.find("eye").unwrap();
                        assert!(image(&copy, own) == image(&late, eye));
                        (0..5).for_each(|_| _ = copy.step().unwrap());
                        assert!(image(&copy, own) == image(&end, eye));
                    }
                }
            }
            assert!(images.windows(2).any(|pair| pair[0] != pair[1]));
        }
    }
}

/// All pixels of an image have one bias, whose variance grows with time: `σ_b²·t`.
#[test]
fn the_bias_of_an_image_walks_as_one_number() {
    let (walk, dt, frames, runs) = (0.05, 0.01, 50, 600);
    let mut last = Vec::new();
    for seed in 0..runs {
        let mut world = world("time_stepping", dt);
        ground(&mut world, 0.0, 0.5);
        let noise = SensorNoise { bias_walk: walk, seed, ..SensorNoise::default() };
        let camera = Sensor::new("eye", SensorKind::Depth, Anchor::world(down(2.0))).unwrap();
        let optics = Optics { resolution: [4, 3], vertical_fov: 1.0 };
        let eye = world.add(camera.with_optics(optics).unwrap().with_noise(noise).unwrap()).unwrap();
        assert!(image(&world, eye).iter().all(|depth| (depth - 2.0).abs() < 1e-12), "no bias before the first step");
        (0..frames).for_each(|_| _ = world.step().unwrap());
        let seen = image(&world, eye);
        assert!(seen.iter().all(|depth| (depth - seen[0]).abs() < 1e-12), "one bias for all pixels");
        assert_eq!(seen, image(&world, eye), "reading changes nothing");
        last.push(seen[0] - 2.0);
    }
    let n = last.len() as f64;
    let (mean, expected) = (last.iter().sum::<f64>() / n, walk * walk * dt * f64::from(frames));
    let variance = last.iter().map(|x| x * x).sum::<f64>() / n;
    // standard errors: σ/√n, σ²·√(2/n)
    assert!(mean.abs() < 4.0 * (expected / n).sqrt(), "{mean}");
    assert!((variance - expected).abs() < 4.0 * expected * (2.0 / n).sqrt(), "{variance}, expected {expected}");
}

/// Noise of colors is added to values of 0 to 255, rounded and kept in this range.
#[test]
fn the_noise_of_colors_has_its_deviation() {
    let seen = |noise: SensorNoise| {
        let mut world = no_gravity(world("time_stepping", 0.01));
        let wall = RigidBody::fixed(Shape::cuboid(Vec3::new(9.0, 9.0, 0.2)).unwrap());
        let gray = Appearance { color: [0.5; 3], ..Appearance::default() };
        let shape = Shape::cuboid(Vec3::new(9.0, 9.0, 0.2)).unwrap();
        world.add_static(wall.with_visuals(vec![Visual::shape(0, Pose::identity(), shape, gray)])).unwrap();
        let camera = Sensor::new("eye", SensorKind::Color, Anchor::world(down(2.0))).unwrap();
        let optics = Optics { resolution: [80, 60], vertical_fov: 0.02 };
        let eye = world.add(camera.with_optics(optics).unwrap().with_noise(noise).unwrap()).unwrap();
        image(&world, eye)
    };
    let plain = seen(SensorNoise::default());
    assert!(plain.iter().all(|c| *c == 128.0 || *c == 127.0));
    let noisy = seen(SensorNoise { deviation: 10.0, seed: 1, ..SensorNoise::default() });
    let n = noisy.len() as f64;
    let errors = || noisy.iter().zip(&plain).map(|(seen, plain)| seen - plain);
    let mean = errors().sum::<f64>() / n;
    let deviation = errors().map(|error| error * error).sum::<f64>().sqrt() / n.sqrt();
    // rounding adds a variance of 1/12
    let expected = (100.0_f64 + 1.0 / 12.0).sqrt();
    assert!(mean.abs() < 4.0 * expected / n.sqrt(), "{mean}");
    assert!((deviation - expected).abs() < 4.0 * expected / (2.0 * n).sqrt(), "{deviation}");
    let wild = seen(SensorNoise { deviation: 1e4, seed: 1, ..SensorNoise::default() });
    assert!(wild.iter().all(|c| (0.0..=255.0).contains(c)) && wild.contains(&0.0) && wild.contains(&255.0));
    let steps = seen(SensorNoise { deviation: 10.0, quantization: 32.0, seed: 1, ..SensorNoise::default() });
    assert!(steps.iter().all(|c| c % 32.0 == 0.0 || *c == 255.0));
}

#[test]
fn delays_that_keep_too_many_pixels_are_refused() {
    let noise = SensorNoise { delay: 10, ..SensorNoise::default() };
    let camera = || Sensor::new("eye", SensorKind::Depth, Anchor::world(down(2.0))).unwrap();
    let large = Optics { resolution: [1000, 1000], vertical_fov: 1.0 };
    // in whatever order the two are set
    let first = camera().with_noise(noise).unwrap().with_optics(large).unwrap_err().to_string();
    let second = camera().with_optics(large).unwrap().with_noise(noise).unwrap_err().to_string();
    assert_eq!(first, second);
    assert!(first.contains("'eye'") && first.contains("is 10000000; it must be at most 4194304"), "{first}");
}
