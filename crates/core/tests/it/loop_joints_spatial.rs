//! Bennett's linkage: four bars and four revolute joints in space. By the count of degrees of
//! freedom (6·3 − 5·4 = −2) it should not move, but it does.
//!
//! Opposite bars are equal; lengths and twists are in proportion, `a/sin α = b/sin β`. Angles about
//! neighboring joints are then related by `tan(θ₁/2)·tan(θ₂/2) = sin((β + α)/2)/sin((β − α)/2)`,
//! opposite ones by `θ₃ = −θ₁`, `θ₄ = −θ₂` (Bennett 1903; Denavit–Hartenberg angles).

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

const A: f64 = 0.3;
const ALPHA: f64 = 0.6;
const BETA: f64 = 1.3;

fn sizes(bar: usize) -> (f64, f64) {
    if bar.is_multiple_of(2) { (A, ALPHA) } else { (A * BETA.sin() / ALPHA.sin(), BETA) }
}

fn second_angle(first: f64) -> f64 {
    2.0 * ((0.5 * (BETA + ALPHA)).sin() / (0.5 * (BETA - ALPHA)).sin() / (0.5 * first).tan()).atan()
}

/// Returns the transform from a joint's axes to those of the next: rotated about z, translated
/// along x, twisted about x.
fn turned(angle: f64) -> Pose {
    Pose::rotation(Vec3::z() * angle)
}

fn along(bar: usize) -> Pose {
    let (length, twist) = sizes(bar);
    Pose::new(Vec3::x() * length, Vec3::x() * twist)
}

/// Returns the center of a bar, which lies along the x axis of its joint's frame: half-way, with
/// the same axes.
fn center(bar: usize) -> Pose {
    Pose::translation(0.5 * sizes(bar).0, 0.0, 0.0)
}

struct Bennett {
    world: World,
    bars: [ObjectId; 4],
    hinges: Vec<ObjectId>,
}

fn bennett(stepper: &str, first: f64) -> Bennett {
    let mut world = world(stepper, 1.0 / 240.0);
    let angles = [first, second_angle(first), -first, -second_angle(first)];
    let (mut frame, mut frames) = (Pose::rotation(Vec3::new(0.4, 0.3, 0.0)), Vec::new());
    let ground = frame;
    for (bar, angle) in angles.iter().enumerate() {
        frame *= turned(*angle);
        frames.push(frame);
        frame *= along(bar);
    }
    // the closed form closes the loop
    assert!((frame.to_homogeneous() - ground.to_homogeneous()).norm() < 1e-12);
    let bars = [0, 1, 2, 3].map(|bar| {
        let shape = Shape::cuboid(Vec3::new(sizes(bar).0, 0.02, 0.04)).unwrap();
        let mut body =
            RigidBody::new(shape).with_name(format!("bar {bar}")).with_mass(1.0).with_pose(frames[bar] * center(bar));
        body.mask = 0;
        // the last one is the ground
        if bar == 3 { world.add_static(body).unwrap() } else { world.add(body).unwrap() }
    });
    let hinges = (0..4).map(|bar| {
        let joint = &frames[bar];
        let (one, other) = ((bars[bar], 0), (bars[(bar + 3) % 4], 0));
        let hinge = LoopJoint::revolute_at(
            format!("hinge {bar}"),
            &world,
            Some(one),
            Some(other),
            joint.translation.vector,
            joint.rotation * Vec3::z(),
        )
        .unwrap();
        world.add(hinge).unwrap()
    });
    let hinges = hinges.collect();
    Bennett { world, bars, hinges }
}

impl Bennett {
    /// Returns the angle about a joint, from the poses of the two bars only.
    fn angle(&self, bar: usize) -> f64 {
        let frame = |bar: usize| self.world.part_state(self.bars[bar], 0).unwrap().pose * center(bar).inverse();
        let before = (bar + 3) % 4;
        let x = ((frame(before) * along(before)).inverse() * frame(bar)).rotation * Vec3::x();
        x.y.atan2(x.x)
    }
}

#[test]
fn bennetts_linkage_moves_as_its_closed_form_says() {
    for stepper in STEPPERS {
        let mut linkage = bennett(stepper, 1.0);
        let start = linkage.world.energy().total();
        let (mut gap, mut off, mut energy, mut kinetic) = (PositionError::default(), 0.0f64, 0.0f64, 0.0f64);
        let mut range = (f64::MAX, f64::MIN);
        for _ in 0..240 * 20 {
            linkage.world.step().unwrap();
            for id in &linkage.hinges {
                let now = linkage.world.get::<LoopJoint>(*id).unwrap().position_error(&linkage.world.view()).unwrap();
                gap = PositionError { distance: gap.distance.max(now.distance), angle: gap.angle.max(now.angle) };
            }
            let angles = [0, 1, 2, 3].map(|bar| linkage.angle(bar));
            // tan(θ/2) is unbounded, sine and cosine are not
            let wrong = |one: f64, other: f64| (one - other).sin().abs();
            off = off
                .max(wrong(angles[1], second_angle(angles[0])))
                .max(wrong(angles[2], -angles[0]))
                .max(wrong(angles[3], -angles[1]));
            range = (range.0.min(angles[0]), range.1.max(angles[0]));
            energy = energy.max((linkage.world.energy().total() - start).abs());
            kinetic = kinetic.max(linkage.world.energy().kinetic);
        }
        println!(
            "{stepper}: {gap:?}, angles off by {off:.1e} rad, energy by {energy:.1e} of {kinetic:.2} J, first angle {range:?}"
        );
        assert!(range.1 - range.0 > 1.0, "{stepper}: it moves, {range:?}");
        assert!(gap.distance < 1e-6 && gap.angle < 1e-6, "{stepper}: {gap:?}");
        assert!(off < 1e-6, "{stepper}: angles are {off:e} rad off the closed form");
        assert!(energy < 1e-2 * kinetic, "{stepper}: energy is off by {energy:e} J of {kinetic} J");
    }
}
