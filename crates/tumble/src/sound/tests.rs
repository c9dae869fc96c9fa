//! Frequencies, decays, levels and times against their formulas, by Goertzel's algorithm.

use super::*;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{Material, RigidBody, Settings, World};

const FRONT: Listener = Listener { position: [0.0; 3], right: [1.0, 0.0, 0.0] };

/// A bar of steel of 0.5 m and 10 mm: its first mode is at 1.028·h/L²·√(E/ρ) = 207.5 Hz.
fn bar() -> SoundBody {
    let material = SoundMaterial::of_name("steel").unwrap();
    SoundBody { material, length: 0.5, thickness: 0.01, mass: 1.6 }
}

fn strike(impulse: f64, point: [f64; 3], time: f64) -> Strike {
    Strike { time, point, impulse, body: bar(), contact: 1e-3 }
}

fn heard(strikes: Vec<Strike>) -> Vec<[f64; 2]> {
    Soundtrack::of_strikes(strikes).mix(&FRONT, 2.0).unwrap().samples
}

/// Power of a frequency in a channel between two times, s.
fn power(samples: &[[f64; 2]], channel: usize, frequency: f64, from: f64, to: f64) -> f64 {
    let rate = f64::from(RATE_HZ);
    let (mut re, mut im) = (0.0, 0.0);
    let range = (from * rate) as usize..(to * rate) as usize;
    let length = range.len() as f64;
    for n in range {
        let (sin, cos) = (TAU * frequency * n as f64 / rate).sin_cos();
        (re, im) = (re + samples[n][channel] * cos, im + samples[n][channel] * sin);
    }
    (re * re + im * im) / (length * length)
}

#[test]
fn a_bar_sounds_at_the_frequencies_of_euler_and_bernoulli() {
    let samples = heard(vec![strike(1.0, [0.0, 2.0, 0.0], 0.0)]);
    let wave = (200e9f64 / 7850.0).sqrt();
    let first = 22.3733 / TAU * 0.01 / 12f64.sqrt() / 0.25 * wave;
    assert!((first - 207.5).abs() < 0.2);
    // ratios of a free bar
    for ratio in [1.0, 2.7565, 5.4039] {
        let best = (-60..=60).map(|k| first * ratio * (1.0 + f64::from(k) * 1e-3));
        let loudest =
            best.max_by(|a, b| power(&samples, 0, *a, 0.05, 1.05).total_cmp(&power(&samples, 0, *b, 0.05, 1.05)));
        let found = loudest.unwrap();
        assert!((found / (first * ratio) - 1.0).abs() < 2e-3, "{ratio}: {found} Hz");
    }
}

#[test]
fn the_sound_decays_by_the_loss_factor() {
    let samples = heard(vec![strike(1.0, [0.0, 2.0, 0.0], 0.0)]);
    let frequency = bar().frequency(0);
    let ratio = power(&samples, 0, frequency, 1.1, 1.6) / power(&samples, 0, frequency, 0.1, 0.6);
    let rate = -ratio.ln() / 2.0; // of the amplitude, over 1 s
    assert!((rate / (PI * 0.0006 * frequency) - 1.0).abs() < 0.02, "{rate} 1/s");
}

#[test]
fn levels_are_proportional_to_the_impulse_and_to_one_over_r() {
    let peak = |samples: &[[f64; 2]]| samples.iter().flatten().fold(0.0f64, |m, s| m.max(s.abs()));
    let one = peak(&heard(vec![strike(1.0, [0.0, 2.0, 0.0], 0.0)]));
    let three = peak(&heard(vec![strike(3.0, [0.0, 2.0, 0.0], 0.0)]));
    assert!((three / one - 3.0).abs() < 1e-3, "{}", three / one);
    let energy = |r: f64| {
        let samples = heard(vec![strike(1.0, [0.0, r, 0.0], 0.0)]);
        power(&samples, 0, bar().frequency(0), 0.1, 1.1).sqrt()
    };
    assert!((energy(2.0) / energy(6.0) - 3.0).abs() < 0.05);
}

#[test]
fn a_source_arrives_after_its_distance_at_the_right_ear_more_than_at_the_left() {
    let r = 34.3;
    for (angle, side) in [(0.0f64, 0.0f64), (0.5, 0.5f64.sin()), (-1.2, (-1.2f64).sin()), (PI / 2.0, 1.0)] {
        let samples = heard(vec![strike(100.0, [r * angle.sin(), r * angle.cos(), 0.0], 0.25)]);
        let first = samples.iter().position(|[l, r]| l.abs() + r.abs() > 0.0).unwrap();
        assert!((first as f64 / f64::from(RATE_HZ) - 0.35).abs() < 2.0 / f64::from(RATE_HZ));
        let [left, right] = [0, 1].map(|k| power(&samples, k, bar().frequency(0), 0.4, 1.4).sqrt());
        let expected = ((1.0 + side) * PI / 4.0).tan();
        if side < 0.99 {
            assert!((right / left - expected).abs() < 1e-6 * expected.max(1.0), "{angle}");
        } else {
            assert!(left < 1e-9 * right);
        }
    }
}

#[test]
fn a_compact_ball_clicks_without_a_tone() {
    let material = SoundMaterial::of_name("plastic").unwrap();
    let body = SoundBody { material, length: 0.057, thickness: 0.057, mass: 0.17 };
    assert_eq!(body.modes().count(), 0, "{} Hz", body.frequency(0));
    let samples = heard(vec![Strike { body, contact: 2e-4, ..strike(0.3, [0.0, 1.0, 0.0], 0.0) }]);
    let last = samples.iter().rposition(|[l, _]| *l != 0.0).unwrap() as f64 / f64::from(RATE_HZ);
    assert!(last < 1.0 / SPEED_OF_SOUND + 3e-4 && samples.iter().any(|[l, _]| *l != 0.0));
    let sum: f64 = samples.iter().map(|[l, _]| l).sum();
    assert!(sum.abs() < 1e-12, "no net pressure: {sum}");
}

#[test]
fn the_limiter_keeps_the_proportions() {
    let loud = Soundtrack::of_strikes(vec![strike(500.0, [0.0, 0.5, 0.0], 0.0)]).mix(&FRONT, 1.0).unwrap();
    assert!(loud.peak() > 1.0 && (loud.peak() * loud.gain(Some(0.0)).unwrap() - 0.98).abs() < 1e-12);
    let wav = hound::WavReader::new(std::io::Cursor::new(loud.wav(loud.gain(Some(0.0)).unwrap()).unwrap())).unwrap();
    assert_eq!((wav.spec().channels, wav.spec().sample_rate, wav.duration()), (2, RATE_HZ, 2 * RATE_HZ));
    let most = wav.into_samples::<i16>().map(|s| i32::from(s.unwrap()).abs()).max().unwrap();
    assert_eq!(most, (0.98 * 32767.0f64).round() as i32);
    assert!(Soundtrack::default().mix(&FRONT, 1e9).is_err() && Soundtrack::default().mix(&FRONT, f64::NAN).is_err());
}

/// Drops a cube of steel from a height, m, or slides it along the ground.
fn run(height: f64, speed: f64) -> Soundtrack {
    let mut world = World::new(Settings::default()).unwrap();
    let surface = Material { friction: 0.4, restitution: 0.3, ..Material::default() };
    world.add(RigidBody::fixed(Shape::half_space()).with_material(surface)).unwrap();
    let cube = RigidBody::new(Shape::cuboid(Vec3::new(0.6, 0.1, 0.02)).unwrap()).with_density(7850.0);
    let cube = cube.with_material(surface).with_pose(Pose::translation(0.0, 2.0, 0.01 + height));
    world.add(cube.with_velocity(Vec3::new(speed, 0.0, 0.0))).unwrap();
    let mut track = Soundtrack::new(BTreeMap::new());
    for _ in 0..240 {
        world.step().unwrap();
        track.frame(&world);
    }
    track
}

fn level(samples: &[[f64; 2]], from: f64, to: f64) -> f64 {
    let rate = f64::from(RATE_HZ);
    let range = &samples[(from * rate) as usize..(to * rate) as usize];
    (range.iter().flatten().map(|s| s * s).sum::<f64>() / range.len() as f64).sqrt()
}

#[test]
fn nothing_is_heard_before_anything_touches_and_equal_runs_have_equal_bytes() {
    let track = run(0.5, 0.0);
    let samples = track.mix(&FRONT, 1.0).unwrap();
    let lands = (2.0f64 * 0.5 / 9.81).sqrt();
    assert!(level(&samples.samples, 0.0, lands - 0.01) == 0.0);
    assert!(level(&samples.samples, lands, lands + 0.1) > 1e-4);
    let name = track.strikes()[0].body.material.name;
    assert_eq!(name, "steel");
    assert_eq!(samples.wav(1.0).unwrap(), run(0.5, 0.0).mix(&FRONT, 1.0).unwrap().wav(1.0).unwrap());
}

/// The bar lies on the ground from the start, so it is not struck: alone its slide is heard, until it stops.
#[test]
fn a_slide_hisses_until_it_stops() {
    let [slide, rest] = [2.0, 0.0].map(|speed| run(0.0, speed).mix(&FRONT, 1.0).unwrap().samples);
    let stop = 2.0 / (0.4 * 9.81); // v/(μ·g)
    assert!(level(&slide, 0.2, 0.3) > 1e-4, "{}", level(&slide, 0.2, 0.3));
    assert_eq!((level(&slide, stop + 0.05, stop + 0.25), level(&rest, 0.0, 1.0)), (0.0, 0.0));
}

/// Runs a shipped scene and listens.
fn shipped(name: &str, seconds: f64) -> Soundtrack {
    let file = format!("{}/../../scenes/{name}/scene.toml", env!("CARGO_MANIFEST_DIR"));
    let scene = tumble_scene::SceneFile::load(file).unwrap();
    let (mut world, _) = scene.build().unwrap();
    let mut track = Soundtrack::of_scene(&scene);
    while world.time() < seconds {
        world.step().unwrap();
        track.frame(&world);
    }
    track
}

/// A pendulum of 45° meets the next ball at its lowest point, after a quarter of its period: `K(sin 22.5°)·√(ℓ/g)`
/// with the reduced length `ℓ = I/(m·d)`; the balls touch there.
#[test]
fn a_cradle_clicks_when_its_first_ball_arrives() {
    let track = shipped("newtons_cradle", 0.3);
    let (d, m, own) = (0.18f64, 0.26, 4.16e-5);
    let modulus = (PI / 8.0).sin();
    // K = π/2/agm(1, √(1 − k²))
    let (mut a, mut g) = (1.0, (1.0 - modulus * modulus).sqrt());
    for _ in 0..6 {
        (a, g) = ((a + g) / 2.0, (a * g).sqrt());
    }
    let arrives = PI / 2.0 / a * ((own + m * d * d) / (m * d * 9.81)).sqrt();
    assert!((arrives - 0.2215).abs() < 1e-3, "{arrives} s");
    let first = track.strikes().first().expect("an impact");
    assert!((first.time - arrives).abs() < 1.5 / 240.0, "{} s, expected {arrives} s", first.time);
    assert_eq!((first.body.material.name, first.body.mass, first.body.thickness), ("steel", m, 0.04));
    let speed = (2.0 * 9.81 * 0.18 * (1.0 - (PI / 4.0).cos())).sqrt();
    assert!((first.impulse / (m * speed) - 1.0).abs() < 0.02, "{} N·s", first.impulse);
}

#[test]
fn a_skeleton_clatters_down_the_stairs() {
    let track = shipped("skeleton", 2.0);
    assert!(track.impacts() > 30, "{} impacts", track.impacts());
    assert!(track.strikes().iter().any(|strike| strike.body.material.name == "wood"));
}

#[test]
fn what_stands_at_the_start_is_silent() {
    for name in ["card_house", "stack", "arch"] {
        let track = shipped(name, 0.3);
        let first: Vec<String> =
            track.strikes().iter().take(6).map(|s| format!("{:.4} s {:.2e}", s.time, s.impulse)).collect();
        assert_eq!(track.impacts(), 0, "{name}: {first:?}");
    }
}

/// A boid that flies into the ground is heard, with its own mass.
#[test]
fn an_object_of_another_kind_sounds_by_its_shape_and_mass() {
    let mut world = World::new(Settings::default()).unwrap();
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let boid = tumble_behaviors::Boid::new(Shape::sphere(0.05).unwrap(), 0.4).unwrap();
    let boid = boid.with_velocity(Vec3::new(1.0, 0.0, -2.0));
    let boid = world.add(boid.with_position(Vec3::new(0.0, 0.0, 0.3))).unwrap();
    let mut track = Soundtrack::new(BTreeMap::new());
    for _ in 0..120 {
        world.step().unwrap();
        track.frame(&world);
    }
    let strike = track.strikes().first().expect("an impact");
    assert_eq!((strike.body.mass, strike.body.thickness, strike.body.material.name), (0.4, 0.1, "wood"));
    assert!(world.get::<tumble_behaviors::Boid>(boid).is_some());
}

/// A stack falls asleep, and does not click when it is woken.
#[test]
fn waking_is_no_blow() {
    let mut settings = Settings::default();
    settings.sleep = Some(tumble_core::Sleep::default());
    let mut world = World::new(settings).unwrap();
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let cube = RigidBody::new(Shape::cuboid(Vec3::new(0.2, 0.2, 0.2)).unwrap()).with_density(700.0);
    let cube = world.add(cube.with_pose(Pose::translation(0.0, 0.0, 0.1))).unwrap();
    let mut track = Soundtrack::new(BTreeMap::new());
    let mut woken = 0;
    for frame in 0..480 {
        if frame == 400 {
            assert!(world.asleep(cube));
            world.apply_force(cube, 0, Vec3::new(0.0, 0.0, -1e-3), &Vec3::new(0.0, 0.0, 0.1)).unwrap();
        }
        world.step().unwrap();
        track.frame(&world);
        woken += usize::from(frame >= 400 && !world.events().is_empty());
    }
    assert!(woken > 0, "the contact is reported again");
    assert_eq!(track.impacts(), 0, "{:?}", track.strikes().first());
}

#[test]
fn a_track_is_brought_to_3_db_below_full_scale_unless_a_gain_is_chosen() {
    let quiet = Soundtrack::of_strikes(vec![strike(1e-4, [0.0, 2.0, 0.0], 0.0)]).mix(&FRONT, 1.0).unwrap();
    assert!(quiet.peak() > 0.0 && quiet.peak() < 0.01, "{}", quiet.peak());
    let gain = quiet.gain(None).unwrap();
    assert!((quiet.peak() * gain - 0.5f64.sqrt()).abs() < 1e-12);
    let wav = hound::WavReader::new(std::io::Cursor::new(quiet.wav(gain).unwrap())).unwrap();
    let most = wav.into_samples::<i16>().map(|s| i32::from(s.unwrap()).abs()).max().unwrap();
    assert_eq!(most, (0.5f64.sqrt() * 32767.0).round() as i32);
    assert!((quiet.gain(Some(20.0)).unwrap() - 10.0).abs() < 1e-12);
    assert!((quiet.peak() * quiet.gain(Some(120.0)).unwrap() - 0.98).abs() < 1e-12, "never above full scale");
    assert!(quiet.gain(Some(121.0)).is_err() && quiet.gain(Some(f64::NAN)).is_err());
    assert_eq!(Soundtrack::default().mix(&FRONT, 1.0).unwrap().gain(None).unwrap(), 1.0);
    assert_eq!(Soundtrack::default().mix(&FRONT, 1.0).unwrap().gain(Some(6.0)).unwrap(), 10f64.powf(0.3));
}

/// The listener passes from one side of the source to the other between two blows.
#[test]
fn a_listener_that_moves_hears_from_where_it_is() {
    let blows = vec![strike(1.0, [0.0, 0.0, 0.0], 0.0), strike(1.0, [0.0, 0.0, 0.0], 1.0)];
    let at = |x: f64| Listener { position: [x, 0.0, 0.0], right: [1.0, 0.0, 0.0] };
    let track = Soundtrack::of_strikes(blows);
    let moved = track.mix_moving(&[(0.0, at(2.0)), (0.5, at(-2.0))], 2.0).unwrap().samples;
    let click = |from: f64| {
        let [left, right] = [0, 1].map(|k| power(&moved, k, bar().frequency(0), from, from + 0.4));
        right / left
    };
    assert!(click(0.1) < 1e-9 && click(1.1) > 1.0, "{} {}", click(0.1), click(1.1));
    assert!(track.mix_moving(&[], 1.0).is_err());
}

/// A ball that bounces on a slab and a block that slides, heard frame by frame and all at once.
#[test]
fn a_run_sounds_the_same_while_it_runs() {
    let text = "[[body]]\nname = \"slab\"\nmode = \"static\"\nshape = { type = \"box\", size_m = [4, 4, 0.1] }\nsound = \"wood\"\n\
        [[body]]\nname = \"ball\"\nshape = { type = \"sphere\", radius_m = 0.05 }\nmass_kg = 1.0\nsound = \"steel\"\nposition_m = [0.2, 0, 0.2]\n\
        [[body]]\nname = \"block\"\nshape = { type = \"box\", size_m = [0.1, 0.1, 0.1] }\nmass_kg = 1.0\nsound = \"wood\"\nposition_m = [-0.5, 0, 0.1]\nvelocity_m_per_s = [2, 0, 0]\n";
    let scene = tumble_scene::SceneFile::parse(text, "s.toml").unwrap();
    let mut world = scene.build().unwrap().0;
    let (mut whole, mut live, mut mixer) =
        (Soundtrack::of_scene(&scene), LiveSound::new(scene.clone()), LiveMixer::new(0.0));
    let ears = Listener { position: [0.0, -1.0, 0.5], right: [1.0, 0.0, 0.0] };
    let mut samples = Vec::new();
    for k in 0..240 {
        world.step().unwrap();
        whole.frame(&world);
        live.step(&world);
        if k % 3 == 2 {
            samples.extend(mixer.mix(&live.frame(&ears)));
        }
    }
    let expected = whole.mix(&ears, 1.0).unwrap();
    assert!((47_998..=48_000).contains(&samples.len()), "{} samples of a second", samples.len());
    assert!(expected.peak() > 1e-3 && expected.peak() < 0.98 && mixer.gain_db() == 0.0);
    for (k, (sample, expected)) in samples.iter().zip(&expected.samples).enumerate() {
        assert!((0..2).all(|ear| (sample[ear] - expected[ear]).abs() < 1e-12), "{k}: {sample:?} and {expected:?}");
    }

    // from the start again: what sounded before has ended, and the same is heard
    let first = samples;
    let mut world = scene.build().unwrap().0;
    let mut again = Vec::new();
    for _ in 0..240 {
        world.step().unwrap();
        live.step(&world);
        again.extend(mixer.mix(&live.frame(&ears)));
    }
    let differs = first.iter().zip(&again).filter(|(a, b)| (0..2).any(|ear| (a[ear] - b[ear]).abs() > 1e-9)).count();
    assert_eq!((differs, live.left_out()), (0, 0));
}

/// The gain falls at the first sample that would exceed full scale, and stays.
#[test]
fn a_live_gain_only_falls() {
    let text = "[[body]]\nname = \"floor\"\nmode = \"static\"\nshape = { type = \"half_space\" }\n\
        [[body]]\nname = \"ball\"\nshape = { type = \"sphere\", radius_m = 0.1 }\nmass_kg = 1.0\nsound = \"wood\"\nposition_m = [0, 0, 0.4]\nrestitution = 0.5\n";
    let scene = tumble_scene::SceneFile::parse(text, "s.toml").unwrap();
    let mut world = scene.build().unwrap().0;
    let (mut live, mut mixer) = (LiveSound::new(scene), LiveMixer::new(120.0));
    let ears = Listener { position: [0.0, -1.0, 0.5], right: [1.0, 0.0, 0.0] };
    let (mut gains, mut peak) = (vec![mixer.gain_db()], 0.0f64);
    for _ in 0..480 {
        world.step().unwrap();
        live.step(&world);
        peak = mixer.mix(&live.frame(&ears)).iter().flatten().fold(peak, |most, x| most.max(x.abs()));
        gains.push(mixer.gain_db());
    }
    assert!(gains.is_sorted_by(|a, b| a >= b) && gains[480] < 100.0, "{} dB", gains[480]);
    assert!((peak - 0.98).abs() < 1e-12, "{peak}");
}
