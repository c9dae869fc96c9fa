//! A zipper of 20 teeth: two tapes of hinged teeth, and a slider that closes and opens them when it is pulled.
//!
//! ```text
//! d = √((2r + c)² − (p/2)²)    distance between the heads' center lines of closed tapes: neighbors of both tapes are c apart
//! 2r > p/2                     heads are wider than half a pitch, so the teeth of closed tapes hook into each other
//! u = a + d/2                  length of a tooth from its tape to the center of its head, of tapes at x = ±a
//! c(s) = (−a − R(1 − cos t), R·sin t), t = s/R      line of the left tape in the slider, up to t = α, then straight
//! ```
//!
//! `r` radius of the heads, `p` pitch of a tape, `c` play. Teeth turn about the hinges of their tape alone, so they stay in
//! the plane of the zipper.

use super::grid::Grid;
use super::lock::{loft, shape};
use super::*;
use tumble_core::articulated::Joint;

/// Number of teeth of a tape, and their pitch, m.
const TEETH: usize = 10;
const PITCH: f64 = 0.020;
/// Radius of the thick ends at the tape, half width of necks, half thickness of teeth, m.
const BASE: f64 = 0.0075;
const NECK: f64 = 0.0033;
const HALF: f64 = 0.005;
/// Play of heads, of teeth between the walls of the slider, and above its plate, m.
const PLAY: f64 = 0.0002;
const WALL: f64 = 0.0008;
const LID: f64 = 0.001;
/// Half the distance between closed tapes, radius of the bend of a tape in the slider, m, and its angle, rad.
const APART: f64 = 0.0114;
const BEND: f64 = 0.080;
const ANGLE: f64 = std::f64::consts::FRAC_PI_6;
/// Force on each tooth away from the other tape, as of cloth, N.
const TENSION: f64 = 0.2;
/// Lengths of the throat and of the straight part of the slider, m.
const THROAT: f64 = 0.030;
const MOUTH: f64 = 0.030;

/// Number of facets of an end of a tooth, and the angle of its flat tip, rad.
const ARC: usize = 6;
const BLUNT: f64 = 0.25;

/// Returns how far apart the center lines of two rows of heads are whose neighbors have a distance, m.
fn across(distance: f64) -> f64 {
    (distance.powi(2) - (0.5 * PITCH).powi(2)).max(0.0).sqrt()
}

/// The teeth of a zipper, whose heads have a radius, m.
#[derive(Clone, Copy)]
struct Tooth {
    head: f64,
}

impl Tooth {
    /// Returns the distance of the head's center from the tape, m.
    fn reach(self) -> f64 {
        APART + 0.5 * self.hook()
    }

    /// Returns how far closed tapes must part until their heads are beside each other, m. Without hooks it is 0.
    fn hook(self) -> f64 {
        across(2.0 * self.head + PLAY)
    }

    /// Returns how far closed tapes part until edges of neighboring heads meet at the middles of facets, m.
    fn play(self) -> f64 {
        let facet = (0.5 * TAU - BLUNT - (NECK / self.head).asin()) / ARC as f64;
        self.hook() - across(2.0 * self.head * (0.5 * facet).cos())
    }

    /// Returns a tooth along x: two rounded ends and a neck, half as thick on either side of z = 0.
    fn mesh(self) -> TriMesh {
        let mut sections = Vec::new();
        let mut arc = |center: f64, radius: f64, from: f64, to: f64| {
            sections.extend((0..=ARC).map(|k| {
                let angle = from + (to - from) * k as f64 / ARC as f64;
                let half = radius * angle.sin();
                (center - radius * angle.cos(), -half, half)
            }));
        };
        arc(0.0, BASE, BLUNT, 0.5 * TAU - (NECK / BASE).asin());
        arc(self.reach(), self.head, (NECK / self.head).asin(), 0.5 * TAU - BLUNT);
        let mut mesh = loft(&sections, HALF);
        // the loft is along z
        mesh.vertices.iter_mut().for_each(|v| *v = Vec3::new(v.z, v.y, -v.x));
        mesh
    }
}

/// Returns the place and direction of the line of the left tape in the slider at an arc length.
fn line(s: f64) -> ([f64; 2], f64) {
    let angle = (s / BEND).clamp(0.0, ANGLE);
    let beyond = if s < 0.0 { s } else { (s - BEND * ANGLE).max(0.0) };
    let (sin, cos) = angle.sin_cos();
    ([-APART - BEND * (1.0 - cos) - beyond * sin, BEND * sin + beyond * cos], angle)
}

/// Returns a slider for teeth: a plate, the walls that close the tapes and the wedge that opens them.
fn slider(tooth: Tooth) -> TriMesh {
    const ROWS: usize = 24;
    const EDGE: f64 = 0.0015;
    let stations: Vec<f64> = (0..=ROWS)
        .map(|i| match i {
            0 => -THROAT,
            ROWS => BEND * ANGLE + MOUTH,
            _ => BEND * ANGLE * (i - 1) as f64 / (ROWS - 2) as f64,
        })
        .collect();
    let beside = |s: f64, off: f64| {
        let ([x, y], angle) = line(s);
        [x + off * angle.cos(), y + off * angle.sin()]
    };
    let wall = |i: usize| beside(stations[i], -BASE - WALL);
    let wedge = |i: usize| beside(stations[i], tooth.reach() + tooth.head + WALL);
    let side = wall(ROWS)[0] - 0.006;
    let layers = [-HALF - LID - 0.004, -HALF - LID, HALF];
    let place = |[i, j, k]: [usize; 3]| {
        let (column, sign) = if j < 3 { (j, 1.0) } else { (5 - j, -1.0) };
        let [x, y] = match column {
            0 => [side, wall(i)[1]],
            1 => wall(i),
            _ => [wedge(i)[0].min(-EDGE), wedge(i)[1]],
        };
        Vec3::new(sign * x, y, layers[k])
    };
    Grid { counts: [ROWS, 5, 2], wraps: false }
        .mesh(place, |i, j, k| k != 1 || matches!(j, 0 | 4) || j == 2 && wedge(i)[0] < -EDGE)
}

struct Zipper {
    world: World,
    tapes: [ObjectId; 2],
    slider: ObjectId,
    triangles: usize,
    overlap: f64,
    unconverged: u32,
}

impl Zipper {
    /// Makes a zipper with the slider at a height, m, and its tapes open above it.
    fn open(tooth: Tooth, height: f64) -> Zipper {
        let mut world = no_gravity(world("time_stepping", DT));
        let (teeth, pull) = (tooth.mesh(), slider(tooth));
        let triangles = 2 * TEETH * teeth.triangles.len() + pull.triangles.len();
        let teeth = shape(teeth);
        // the right tape is the mirror image of the left one, half a pitch lower
        let tapes = [1.0, -1.0].map(|side| {
            let foot = Vec3::new(-side * APART, if side > 0.0 { 0.0 } else { -0.5 * PITCH }, 0.0);
            let turned = if side > 0.0 { Vec3::zeros() } else { Vec3::y() * (0.5 * TAU) };
            let mut tape =
                ArticulationBuilder::new(if side > 0.0 { "left" } else { "right" }).with_self_collision(false);
            let lean = |k: usize| side * line((k as f64 + 0.5) * PITCH + foot.y - height).1;
            for k in 0..TEETH {
                let at = Pose::new(Vec3::y() * (0.5 * PITCH), turned);
                let pose = if k == 0 { Pose::from(foot) } else { Pose::translation(0.0, PITCH, 0.0) };
                let mut link = LinkBuilder::new(format!("tooth {k}"), Joint::Revolute { axis: Vec3::z() })
                    .with_pose(pose)
                    .with_shape(teeth.clone(), at)
                    .with_density(7800.0)
                    .with_joint_damping(0.002)
                    .with_material(Material { friction: 0.1, ..Material::default() })
                    .with_position(lean(k) - if k == 0 { 0.0 } else { lean(k - 1) });
                if k > 0 {
                    link = link.with_parent(format!("tooth {}", k - 1));
                }
                tape = tape.link(link);
            }
            world.add(tape.build().unwrap()).unwrap()
        });
        let pull = steel("slider", shape(pull), 0.1).with_pose(Pose::translation(0.0, height, 0.0));
        let slider = world.add(pull).unwrap();
        let rail = LoopJoint::prismatic_at("rail", &world, Some((slider, 0)), None, Vec3::zeros(), Vec3::y()).unwrap();
        world.add(rail).unwrap();
        Zipper { world, tapes, slider, triangles, overlap: 0.0, unconverged: 0 }
    }

    fn step(&mut self) {
        let report = self.world.step().unwrap();
        self.overlap = self.overlap.max(report.max_penetration);
        self.unconverged += report.unconverged;
    }

    /// Pulls the slider to a height at up to 0.2 m/s. Returns the largest force, N.
    fn pull(&mut self, height: f64, seconds: f64) -> f64 {
        let mut most = 0.0f64;
        for _ in 0..(seconds / DT).round() as usize {
            let (at, speed) = (position(&self.world, self.slider), velocity(&self.world, self.slider).y);
            let force = 200.0 * ((8.0 * (height - at.y)).clamp(-0.2, 0.2) - speed);
            self.world.apply_force(self.slider, 0, Vec3::y() * force, &at).unwrap();
            self.tear(TENSION);
            most = most.max(force.abs());
            self.step();
        }
        most
    }

    /// Pulls every tooth away from the other tape in the next step, N.
    fn tear(&mut self, force: f64) {
        for (id, sign) in self.tapes.into_iter().zip([-1.0, 1.0]) {
            for k in 0..TEETH {
                let at = self.tooth(id, k);
                self.world.apply_force(id, k, Vec3::x() * (sign * force), &at).unwrap();
            }
        }
    }

    /// Pulls the tapes apart, N per tooth.
    fn part(&mut self, force: f64, seconds: f64) {
        for _ in 0..(seconds / DT).round() as usize {
            self.tear(force);
            self.step();
        }
    }

    /// Returns the center of a tooth at its tape.
    fn tooth(&self, tape: ObjectId, k: usize) -> Vec3 {
        (self.world.part_state(tape, k).unwrap().pose * Pose::translation(0.0, 0.5 * PITCH, 0.0)).translation.vector
    }

    /// Returns how far each pair of teeth is from its place in closed tapes, m: the distance across them.
    fn gaps(&self) -> Vec<f64> {
        let [left, right] = self.tapes;
        (0..TEETH).map(|k| self.tooth(right, k).x - self.tooth(left, k).x - 2.0 * APART).collect()
    }
}

/// Heads hook into each other where the slider has passed, so the tapes hold against a pull that no wall of the slider takes
/// up; they part where the slider has come back. Heads are prisms inscribed in circles, which adds to their play.
#[test]
fn a_slider_closes_and_opens_a_zipper_full_length() {
    let (tooth, cycles) = (Tooth { head: 0.0055 }, if slow() { 3 } else { 1 });
    let mut zipper = Zipper::open(tooth, 0.03);
    let began = Stopwatch::start();
    let (mut closing, mut opening, mut play) = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..cycles {
        closing = closing.max(zipper.pull(0.2, 1.25));
        zipper.part(5.0, 0.25);
        let gaps = zipper.gaps();
        play = gaps[..8].iter().copied().fold(play, f64::max);
        assert!(gaps.iter().all(|gap| *gap < tooth.hook()), "{gaps:?} m, hooks of {} m", tooth.hook());
        opening = opening.max(zipper.pull(0.03, 1.25));
    }
    let seconds = zipper.world.time();
    let speed = seconds / began.seconds();
    zipper.part(5.0, 0.25);
    let parted = zipper.gaps();
    println!(
        "zipper, {} triangles, {seconds} s: slider pulled by {closing:.0} and {opening:.0} N, closed tapes pulled by 50 N are apart by {play:.2e} m of {:.2e} m, open ones by {:.2} m, overlap {:.1e} m, {} unconverged, real-time factor {speed:.2}",
        zipper.triangles,
        tooth.play(),
        parted[9],
        zipper.overlap,
        zipper.unconverged
    );
    assert!(play < tooth.play() + 2e-5, "{play} m, {} m", tooth.play());
    assert!(parted[2..].iter().all(|gap| *gap > 0.05), "{parted:?} m");
    assert!(zipper.overlap < 1e-4, "{} m", zipper.overlap);
}

/// Straight teeth are not held by each other: the same pull parts closed tapes between their foot and the slider.
#[test]
fn a_zipper_without_hooks_does_not_hold() {
    for head in [0.0055, 0.0045] {
        let tooth = Tooth { head };
        let mut zipper = Zipper::open(tooth, 0.2);
        zipper.part(5.0, 0.15);
        let gap = zipper.gaps()[..8].iter().copied().fold(0.0, f64::max);
        println!(
            "heads of {head} m hook by {:.1e} m: tapes apart by {gap:.2e} m, overlap {:.1e} m",
            tooth.hook(),
            zipper.overlap
        );
        assert!(if tooth.hook() > 0.0 { gap < tooth.play() + 2e-5 } else { gap > 0.005 }, "{gap} m");
    }
}
