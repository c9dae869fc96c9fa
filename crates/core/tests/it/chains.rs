//! Chains of rigid bodies joined by equality rows.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::rows::RowSet;
use tumble_core::*;

/// Half the length of a bar, meters.
const HALF: f64 = 0.1;

/// Joins the right end of a bar to the left end of another; `Err` is a point of the world.
#[derive(Clone)]
struct Pin {
    name: String,
    a: Result<ObjectId, Vec3>,
    b: Result<ObjectId, Vec3>,
}

impl Object for Pin {
    fn name(&self) -> &str {
        &self.name
    }
    fn constraint(&self) -> Option<&dyn Constraint> {
        Some(self)
    }
}

/// Position and centripetal acceleration of one end of a bar.
fn end(part_state: &PartState, x: f64) -> (Vec3, Vec3) {
    let (arm, spin) = (part_state.pose.rotation * Vec3::new(x, 0.0, 0.0), part_state.angular_velocity);
    (part_state.position() + arm, spin.cross(&spin.cross(&arm)))
}

impl Constraint for Pin {
    fn rows(&self, _me: &StateRange, view: &WorldView, _level: Level, out: &mut RowBuilder) {
        let of = |part: Result<ObjectId, Vec3>, x: f64| {
            part.map_or_else(|p| (p, Vec3::zeros()), |id| end(view.part_state(id, 0).unwrap(), x))
        };
        let ((a, a_turning), (b, b_turning)) = (of(self.a, HALF), of(self.b, -HALF));
        for k in 0..3 {
            let target = RowTarget {
                bias_acceleration: (b_turning - a_turning)[k],
                ..RowTarget::new(RowSet::Equality, (b - a)[k])
            };
            out.row(target);
            for (part, p, sign) in [(self.a, a, -1.0), (self.b, b, 1.0)] {
                if let Ok(id) = part {
                    out.on_point(id, 0, &p, &Vec3::ith(k, 1.0), sign);
                }
            }
        }
    }
}

/// Adds bars along the lower half of a circle, joined to each other and to the world at both ends,
/// and pushed sideways: with the world they form a closed chain. The last bar has `heavy` times the
/// mass of the others. No bar collides.
fn festoon(stepper: &str, dt: f64, count: usize, pins: usize, heavy: f64) -> (World, Vec<ObjectId>) {
    let mut world = world(stepper, dt);
    let turn = std::f64::consts::PI / count as f64;
    let radius = HALF / (0.5 * turn).tan();
    let mut bars = Vec::new();
    for i in 0..count {
        let angle = turn * (i as f64 + 0.5) - 0.5 * std::f64::consts::PI;
        let mass = if i + 1 == count { 0.5 * heavy } else { 0.5 };
        let body = RigidBody::new(Shape::cuboid(Vec3::new(2.0 * HALF, 0.04, 0.04)).unwrap())
            .with_name(format!("bar{i}"))
            .with_mass(mass);
        let at = Pose::new(Vec3::new(radius * angle.sin(), 0.0, -radius * angle.cos()), Vec3::new(0.0, -angle, 0.0));
        bars.push(world.add(body.with_pose(at).with_velocity(Vec3::new(0.0, 0.3 * angle.cos(), 0.0))).unwrap());
        world.set_collidable(bars[i], false).unwrap();
    }
    let hook = |bar: usize, x: f64| end(world.part_state(bars[bar], 0).unwrap(), x).0;
    let hooks = [hook(0, -HALF), hook(count - 1, HALF)];
    let part = |i: usize| if (1..=count).contains(&i) { Ok(bars[i - 1]) } else { Err(hooks[i.min(1)]) };
    for i in 0..=count {
        for k in 0..pins {
            world.add(Pin { name: format!("pin{i}.{k}"), a: part(i), b: part(i + 1) }).unwrap();
        }
    }
    (world, bars)
}

/// Returns the largest distance between ends that are joined, meters.
fn apart(world: &World, bars: &[ObjectId]) -> f64 {
    let of = |i: usize, x: f64| end(world.part_state(bars[i], 0).unwrap(), x).0;
    (1..bars.len()).map(|i| (of(i - 1, HALF) - of(i, -HALF)).norm()).fold(0.0, f64::max)
}

#[test]
fn a_closed_chain_of_twenty_bars_swings_with_its_pins_solved() {
    for (stepper, pins, heavy) in
        [("time_stepping", 1, 1.0), ("time_stepping", 2, 1.0), ("time_stepping", 1, 1000.0), ("backtracking", 1, 1.0)]
    {
        let (mut world, bars) = festoon(stepper, 1.0 / 240.0, 20, pins, heavy);
        assert!(apart(&world, &bars) < 1e-12);
        let (mut residual, mut gap, mut unconverged, start) = (0.0f64, 0.0f64, 0, world.energy().total());
        for _ in 0..480 {
            world.step().unwrap();
            residual = residual.max(world.report().residual);
            unconverged += world.report().unconverged;
            gap = gap.max(apart(&world, &bars));
        }
        let lost = world.energy().total() - start;
        println!(
            "{stepper}, {pins} a joint, {heavy}: residual {residual:.1e} m/s, pins apart {gap:.1e} m, energy {lost:.1e} J"
        );
        assert!(residual < 1e-9 && unconverged == 0, "{stepper}: residual {residual:e}, {unconverged} unconverged");
        // backtracking projects at the beginning of the next step: until then a fall of ½·h²·2g
        // remains
        let bound = if stepper == "time_stepping" { 1e-5 } else { G / (240.0 * 240.0) };
        assert!(gap < bound, "{stepper}: pins apart by {gap:e} m");
    }
}
