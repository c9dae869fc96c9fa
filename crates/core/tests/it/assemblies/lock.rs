//! A pin tumbler lock: a key lifts the pins to the shear line of its plug, which then turns.
//!
//! ```text
//! L_k = t − b_k        length of the pin k for a cut of height b_k: its top is at t, just below the radius R of the plug
//! y_k = b_k            height of the tip of the pin on the key
//! ```

use super::grid::Grid;
use super::thread::Parts;
use super::*;

/// The trees of the parts group their vertices; those of octrees are built at once.
pub fn shape(mesh: TriMesh) -> Shape {
    Shape::mesh(mesh, &TreeSettings::octree()).unwrap()
}

/// Radii of the plug, of the hole in which it turns, and of the housing, m.
const PLUG: f64 = 0.060;
const BORE: f64 = 0.0605;
const OUTER: f64 = 0.115;
/// Half the width of a pin hole and of the keyway, play to each side, distance between pins, m.
const WIDE: f64 = 0.008;
const NARROW: f64 = 0.004;
const PLAY: f64 = 0.0003;
const PITCH: f64 = 0.026;
/// Radii of the floor of the keyway, of the ledges that hold the pins, and of the roof of the keyway, m.
const FLOOR: f64 = 0.016;
const LEDGE: f64 = 0.024;
const ROOF: f64 = 0.040;
/// Heights of the cuts of the right key above the axis, m.
const CUTS: [f64; 5] = [0.028, 0.036, 0.032, 0.026, 0.034];
/// Height of the top of a pin on its cut, m.
const TOP: f64 = PLUG - 0.0001;
/// Number of radial columns of the grid; three slots about the y axis follow: side, middle, side.
const RADIAL: usize = 89;
const COLUMNS: usize = RADIAL + 3;

/// Returns the height along z of the hole of pin `k`.
fn hole(k: usize) -> f64 {
    PITCH * (k as f64 - 2.0)
}

/// Returns the height of a wall at `x` of a ring.
fn on_ring(radius: f64, x: f64) -> f64 {
    (radius * radius - x * x).sqrt()
}

/// Returns a ring about z, clockwise; the columns after its points are radial, the last three are slots.
fn ring(radius: f64) -> Vec<[f64; 2]> {
    let start = (WIDE / radius).asin();
    let angle = |k: usize| start + (TAU - 2.0 * start) * k as f64 / RADIAL as f64;
    let mut points: Vec<[f64; 2]> = (0..=RADIAL).map(|k| [radius * angle(k).sin(), radius * angle(k).cos()]).collect();
    points.extend([-NARROW, NARROW].map(|x| [x, on_ring(radius, x)]));
    points
}

/// Returns the mesh of the filled cells (row, column, layer) of a grid of rings at heights between the ends and at the
/// walls of the pin holes.
fn solid(radii: &[f64], filled: impl Fn(usize, usize, usize) -> bool) -> TriMesh {
    let mut planes: Vec<f64> = (0..5).flat_map(|k| [hole(k) - WIDE, hole(k) + WIDE]).collect();
    planes.insert(0, -0.075);
    planes.push(0.075);
    let rings: Vec<_> = radii.iter().map(|r| ring(*r)).collect();
    let grid = Grid { counts: [radii.len() - 1, COLUMNS, planes.len() - 1], wraps: true };
    grid.mesh(|[i, j, k]| Vec3::new(rings[i][j][0], rings[i][j][1], planes[k]), filled)
}

/// Returns the mesh of rectangles of half width `half` along x, from `low` to `high` along y, at each z.
pub fn loft(sections: &[(f64, f64, f64)], half: f64) -> TriMesh {
    let mut out = Parts::default();
    for &(z, low, high) in sections {
        out.vertices.extend([(-half, low), (half, low), (half, high), (-half, high)].map(|(x, y)| Vec3::new(x, y, z)));
    }
    let last = 4 * (sections.len() as u32 - 1);
    out.quad(3, 2, 1, 0);
    out.quad(last, last + 1, last + 2, last + 3);
    (0..last).step_by(4).for_each(|k| out.band(k, k + 4, 4));
    out.mesh()
}

/// Returns a lock for keys with `CUTS` and a key with other cuts before it: the world, the key, the plug and the number of
/// triangles.
fn lock(cuts: [f64; 5]) -> (World, ObjectId, ObjectId, usize) {
    let mut world = world("time_stepping", DT);
    let settings = world.settings().with_gravity(Vec3::y() * -9.81);
    world.set_settings(settings).unwrap();
    let is_hole = |layer: usize| layer % 2 == 1;
    let housing = solid(&[BORE, OUTER], |_, j, k| !(j >= RADIAL && is_hole(k)));
    let core = solid(&[0.010, FLOOR, LEDGE, ROOF, PLUG], |i, j, k| {
        let keyway = j == RADIAL + 1 && (1..3).contains(&i);
        !(keyway || j >= RADIAL && is_hole(k) && i >= 2)
    });
    let triangles = housing.triangles.len() + core.triangles.len();
    world.add_static(steel("housing", shape(housing), 0.1)).unwrap();
    let plug = world.add(steel("plug", shape(core), 0.1)).unwrap();
    let hinge = LoopJoint::revolute_at("axle", &world, Some((plug, 0)), None, Vec3::zeros(), Vec3::z()).unwrap();
    world.add(hinge.with_dof(DofSettings { damping: 0.5, ..DofSettings::default() }).unwrap()).unwrap();
    let (width, ledge, floor) = (WIDE - PLAY, on_ring(LEDGE, NARROW), on_ring(FLOOR, NARROW));
    for (k, cut) in CUTS.into_iter().enumerate() {
        let (flank, length) = (width - 0.002, TOP - cut);
        let sections = [(-width, flank, length), (-0.002, 0.0, length), (0.002, 0.0, length), (width, flank, length)];
        let at = Pose::translation(0.0, ledge + 0.0002, hole(k));
        world.add(steel(&format!("pin {k}"), shape(loft(&sections, width)), 0.1).with_pose(at)).unwrap();
        let driver = loft(&[(-width, 0.0, 0.03), (width, 0.0, 0.03)], width);
        let at = Pose::translation(0.0, ledge + length + 0.0004, hole(k));
        world.add(steel(&format!("driver {k}"), shape(driver), 0.1).with_pose(at)).unwrap();
    }
    let mut high = vec![(-0.085, floor + 0.001)];
    for (k, cut) in cuts.into_iter().enumerate() {
        high.extend([(hole(k) - 0.004, cut), (hole(k) + 0.004, cut)]);
    }
    high.extend([(0.075, cuts[4]), (0.0751, 0.050), (0.12, 0.050)]);
    let sections: Vec<_> = high.into_iter().map(|(z, high)| (z, floor + 0.0005, high)).collect();
    let key = steel("key", shape(loft(&sections, NARROW - PLAY)), 0.1).with_pose(Pose::translation(0.0, 0.0, 0.16));
    let key = world.add(key).unwrap();
    let place = JointPlace::on_line(Vec3::zeros(), Vec3::z());
    let slide = LoopJoint::joining("slide", LoopJointKind::Cylindrical, &world, Some((key, 0)), None, place).unwrap();
    world.add(slide).unwrap();
    (world, key, plug, triangles)
}

/// Puts a key in and turns it with 1 N·m for a second. Returns the largest error of the places of the key, whose shoulder
/// stands on the plug, and of the pins on its cuts, and the angle of the plug.
fn turn(cuts: [f64; 5]) -> (f64, f64) {
    let (mut world, key, plug, triangles) = lock(cuts);
    assert!(triangles <= 20_000, "{triangles}");
    let (mut overlap, mut unconverged) = ([0.0f64; 2], [0; 2]);
    let push = |world: &mut World, force: f64| {
        let at = position(world, key);
        world.apply_force(key, 0, Vec3::z() * force, &at).unwrap();
    };
    let in_time = run(&mut world, 1.5, |world| {
        let speed = world.part_state(key, 0).unwrap().velocity.z;
        push(world, -20.0 - 60.0 * speed);
        overlap[0] = overlap[0].max(world.report().max_penetration);
        unconverged[0] += u32::from(world.report().unconverged > 0);
    });
    let placed = |id: ObjectId| world.body(id).unwrap().position();
    let error = |k: usize| (placed(world.find(&format!("pin {k}")).unwrap()).y - cuts[k]).abs();
    let worst = (0..5).map(error).fold(placed(key).z.abs(), f64::max);
    let mut turns = Turns::of_now(&world, plug);
    let turning = run(&mut world, 1.0, |world| {
        push(world, -5.0);
        world.apply_torque(key, 0, -Vec3::z()).unwrap();
        turns.of(world, plug);
        overlap[1] = overlap[1].max(world.report().max_penetration);
        unconverged[1] += u32::from(world.report().unconverged > 0);
    });
    println!(
        "lock, {triangles} triangles in housing and plug: key and pins {worst:.1e} m from their places, the plug turns by {:.4} rad, overlap {:.1e} m while the key goes in and {:.1e} m while it turns, {} of 360 and {} of 240 steps unconverged, real-time factor {in_time:.2} and {turning:.2}",
        turns.total, overlap[0], overlap[1], unconverged[0], unconverged[1]
    );
    assert!(overlap[0].max(overlap[1]) < 2e-4, "{overlap:?}");
    (worst, turns.total)
}

/// The right key turns the plug against the damping of its axle.
#[test]
fn the_right_key_turns_a_pin_lock() {
    // 1 N·m against 0.5 N·m·s, without friction
    let (error, angle) = turn(CUTS);
    assert!(error < 1e-4, "{error} m");
    assert!(angle < -1.5 && angle > -2.0, "{angle}");
}

/// A key with one cut 4 mm too high jams a pin at the shear line: it does not get in and turns the plug by its play alone, no
/// part leaves its hole, and no energy comes from the jam.
///
/// A flat part of a key meets the next slope, of up to 8 mm over 18 mm, where pins slide along it: such valleys are not
/// foreseen, so pins overlap the slope by the rise of one step.
#[test]
fn wrong_keys_do_not_turn_a_pin_lock() {
    for raised in 0..5 {
        let mut cuts = CUTS;
        cuts[raised] += 0.004;
        let (mut world, key, plug, _) = lock(cuts);
        let [mut turns, mut own] = [plug, key].map(|id| Turns::of_now(&world, id));
        let (mut work, mut gained) = (0.0, 0.0f64);
        let (mut overlap, mut fastest) = (0.0f64, 0.0f64);
        let energy = |world: &World| world.energy().total();
        let start = energy(&world);
        let drivers: Vec<_> = (0..5).map(|k| world.find(&format!("driver {k}")).unwrap()).collect();
        for step in 0..420 {
            let (before, speed) = (position(&world, key), world.part_state(key, 0).unwrap().velocity.z);
            let (force, torque) = if step < 360 { (-20.0 - 60.0 * speed, 0.0) } else { (-5.0, -1.0) };
            let turned = own.total;
            world.apply_force(key, 0, Vec3::z() * force, &before).unwrap();
            world.apply_torque(key, 0, Vec3::z() * torque).unwrap();
            overlap = overlap.max(world.step().unwrap().max_penetration);
            turns.of(&world, plug);
            own.of(&world, key);
            let moved = position(&world, key).z - before.z;
            fastest = fastest.max(moved.abs());
            work += force * moved + torque * (own.total - turned);
            gained = gained.max(energy(&world) - start - work);
        }
        let place = position(&world, key).z;
        let farthest = drivers.iter().map(|id| position(&world, *id).y).fold(0.0, f64::max);
        println!(
            "wrong cut {raised}: the plug turns by {:.4} rad, the key stops at {place:.4} m, overlap {overlap:.1e} m, at most {fastest:.1e} m in a step, energy {gained:.1e} J above the work",
            turns.total
        );
        assert!(turns.total.abs() < 0.02, "cut {raised}: {} rad", turns.total);
        assert!(overlap < fastest * (0.008f64 / 0.018).atan().sin(), "cut {raised}: {overlap} m");
        assert!(farthest < OUTER, "cut {raised}: a driver at {farthest} m");
        assert!(gained < 1e-9, "cut {raised}: {gained} J");
    }
}
