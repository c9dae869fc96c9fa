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
    assert!(loud.peak() > 1.0 && (loud.peak() * loud.limit() - 0.98).abs() < 1e-12);
    let wav = hound::WavReader::new(std::io::Cursor::new(loud.wav().unwrap())).unwrap();
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
    assert_eq!(samples.wav().unwrap(), run(0.5, 0.0).mix(&FRONT, 1.0).unwrap().wav().unwrap());
}

/// The bar rings on from its first touch. A sliding one is louder than one that lies, and as loud after its
/// stop.
#[test]
fn a_slide_hisses_until_it_stops() {
    let [slide, rest] = [2.0, 0.0].map(|speed| run(0.0, speed).mix(&FRONT, 1.0).unwrap().samples);
    let stop = 2.0 / (0.4 * 9.81); // v/(μ·g)
    let during = level(&slide, 0.2, 0.3) / level(&rest, 0.2, 0.3);
    let after = level(&slide, stop + 0.05, stop + 0.25) / level(&rest, stop + 0.05, stop + 0.25);
    assert!(during > 3.0 && (after - 1.0).abs() < 0.2, "{during} {after}");
}
