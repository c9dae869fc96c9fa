//! The budget bounds the work of a frame, and quality degrades in a way that stands.

use crate::common::{G, cube, ground, position, world};
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::{Material, ObjectId, RigidBody, World};

/// Drops 200 boxes of various sizes in columns onto the ground, and stands a tower of 10 boxes beside
/// them. Returns the boxes and the tower.
fn heap_and_tower(stepper: &str, budget: Option<u32>) -> (World, Vec<ObjectId>, Vec<ObjectId>) {
    let mut world = world(stepper, 1.0 / 60.0);
    world.set_settings(world.settings().with_budget(budget)).unwrap();
    ground(&mut world, 0.0, 0.5);
    let size = |i: usize, k: usize| 0.08 + 0.12 * ((i * 37 + k * 53) % 101) as f64 / 100.0;
    let mut add = |shape: Shape, at: [f64; 3]| {
        let body = RigidBody::new(shape).with_material(Material { restitution: 0.2, ..Material::default() });
        world.add(body.with_pose(Pose::translation(at[0], at[1], at[2]))).unwrap()
    };
    let tower = (0..10).map(|i| add(cube(0.4), [30.0, 0.0, 0.4 * (i as f64 + 0.5)])).collect();
    let heap = (0..200)
        .map(|i| {
            let shape = Shape::cuboid(Vec3::new(size(i, 0), size(i, 1), size(i, 2))).unwrap();
            add(shape, [-0.5 + 0.22 * (i % 5) as f64, -0.5 + 0.22 * (i / 5 % 5) as f64, 0.15 + 0.25 * (i / 25) as f64])
        })
        .collect();
    (world, heap, tower)
}

const BUDGET: u32 = 20_000;

/// Returns the largest displacement of any body, m.
fn moved(world: &World, bodies: &[ObjectId], start: &[Vec3]) -> f64 {
    bodies.iter().zip(start).map(|(b, start)| (position(world, *b) - start).norm()).fold(0.0, f64::max)
}

/// Four seconds of 200 boxes that fall, with a 28th of the work that their worst frame takes
/// without a budget (558,000).
#[test]
fn a_heap_under_a_tight_budget_is_less_accurate_and_stands() {
    let (mut world, heap, tower) = heap_and_tower("time_stepping", Some(BUDGET));
    let start: Vec<Vec3> = tower.iter().map(|b| position(&world, *b)).collect();
    let weight: f64 = heap.iter().map(|b| G * world.get::<RigidBody>(*b).unwrap().mass()).sum();
    let (first, mut unconverged) = (world.energy().total(), 0);
    let step = |world: &mut World| {
        let before = world.energy().total();
        let report = *world.step().unwrap();
        let grown = world.energy().total() - before;
        // a correction lifts bodies by what they overlapped, and nothing else adds energy; the report does
        // not contain overlap that the same step made
        assert!(grown <= weight * report.max_penetration + 1e-4 * first.abs(), "{grown} J, {report:?}");
        report
    };
    for frame in 0..240 {
        let report = step(&mut world);
        assert!(report.relaxations <= u64::from(BUDGET), "{report:?}");
        assert!(report.max_penetration < 0.05, "frame {frame}: {report:?}");
        unconverged += report.unconverged;
    }
    assert!(unconverged > 240, "{unconverged}: the budget is not tight");
    assert!(world.energy().total() < first);
    let off = moved(&world, &tower, &start);
    assert!(off < 1e-6, "the tower has moved by {off} m");
}

/// The table of `docs/steppers.md` (two of its rows without `TUMBLE_SLOW`): no budget makes a frame gain more energy than that of lifting the heap
/// by its overlap.
#[test]
fn the_table_of_budgets_full_length() {
    let all = [Some(200_000), Some(BUDGET), None, Some(100_000), Some(50_000), Some(10_000)];
    let count = if std::env::var_os("TUMBLE_SLOW").is_some() { 6 } else { 2 };
    for budget in all.into_iter().take(count) {
        let (mut world, heap, tower) = heap_and_tower("time_stepping", budget);
        let start: Vec<Vec3> = tower.iter().map(|b| position(&world, *b)).collect();
        let weight: f64 = heap.iter().map(|b| G * world.get::<RigidBody>(*b).unwrap().mass()).sum();
        let (first, mut deepest, mut gain, mut heaviest) = (world.energy().total(), 0.0f64, 0.0f64, 0);
        for _ in 0..240 {
            let before = world.energy().total();
            let report = *world.step().unwrap();
            deepest = deepest.max(report.max_penetration);
            gain = gain.max(world.energy().total() - before);
            heaviest = heaviest.max(report.relaxations);
        }
        let off = moved(&world, &tower, &start);
        let row = format!("{:.1} mm, {gain:.1e} J of {first:.0}, tower {off:.1e} m", 1e3 * deepest);
        println!("budget {budget:?}: {row}, heaviest frame {heaviest} relaxations");
        assert!(gain <= weight * deepest + 1e-4 * first && off < 1e-6, "{budget:?}: {row}");
    }
}

/// Which boxes fall onto which is chance, so the largest overlap after the fall is that of the middle one
/// of seven heaps, each with a little more work than the one before.
#[test]
fn heaps_under_a_tight_budget_overlap_little() {
    let mut deepest = [16_000, 18_000, 19_000, 20_000, 21_000, 22_000, 24_000].map(|budget| {
        let (mut world, ..) = heap_and_tower("time_stepping", Some(budget));
        (0..240)
            .map(|frame| (frame, world.step().unwrap().max_penetration))
            .filter(|(frame, _)| *frame >= 60)
            .fold(0.0, |most: f64, (_, overlap)| most.max(overlap))
    });
    deepest.sort_by(f64::total_cmp);
    println!("{deepest:.4?} m");
    assert!(deepest[3] < 0.02, "{deepest:?}");
}

/// Heaps whose budget is lifted after the fall come to rest without overlap. Which do so within ten
/// seconds is chance, so most of five have to.
#[test]
fn heaps_rest_when_the_budget_is_lifted() {
    let rests = [16_000, 18_000, 20_000, 22_000, 24_000].map(|budget| {
        let (mut world, ..) = heap_and_tower("time_stepping", Some(budget));
        (0..240).for_each(|_| {
            world.step().unwrap();
        });
        world.set_settings(world.settings().with_budget(None)).unwrap();
        (0..600).find(|_| world.step().unwrap().max_penetration < 1e-6)
    });
    println!("frames until no overlap is left: {rests:?}");
    assert!(rests.iter().flatten().count() >= 3, "{rests:?}");
}

/// `backtracking` takes the rest of a frame as one sub-step of `time_stepping` when its work is spent.
/// No overlap is as large as the smallest side of a box, 80 mm.
#[test]
fn backtracking_keeps_to_its_budget() {
    let (mut world, _, tower) = heap_and_tower("backtracking", Some(50_000));
    let start: Vec<Vec3> = tower.iter().map(|b| position(&world, *b)).collect();
    for _ in 0..60 {
        let report = *world.step().unwrap();
        assert!(report.relaxations <= 50_000 && report.max_penetration < 0.08, "{report:?}");
    }
    assert!(moved(&world, &tower, &start) < 1e-6);
}

/// The same budget gives the same bits on one and two threads, after a fork and from an archive.
#[test]
fn the_same_budget_gives_the_same_bits_on_any_number_of_threads() {
    let bits = |world: &World| -> Vec<u64> {
        let report = world.report();
        let counts = [report.relaxations, report.unconverged.into(), report.residual.to_bits()];
        world.state().iter().map(|x| x.to_bits()).chain(counts).collect()
    };
    let record = |world: &mut World, frames: usize| -> Vec<Vec<u64>> {
        let step = |_| {
            world.step().unwrap();
            bits(world)
        };
        (0..frames).map(step).collect()
    };
    let alone = record(&mut heap_and_tower("time_stepping", Some(BUDGET)).0, 60);
    let (mut world, ..) = heap_and_tower("time_stepping", Some(BUDGET));
    world.set_settings(world.settings().with_threads(2)).unwrap();
    assert!(record(&mut world, 30) == alone[..30]);
    let mut read = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    assert_eq!(read.settings().solver_settings.budget, Some(BUDGET));
    assert!(record(&mut read, 30) == alone[30..], "from an archive");
    assert!(record(&mut world.fork(), 30) == alone[30..], "a fork");
    assert!(record(&mut world, 30) == alone[30..]);
}

/// One sweep of a solve is the least, whatever the budget.
#[test]
fn a_budget_of_one_relaxation_still_holds_boxes_up() {
    let (mut world, ..) = heap_and_tower("time_stepping", Some(1));
    for _ in 0..120 {
        let report = *world.step().unwrap();
        // fast pairs have more contacts than were found at the start of the step
        assert!(report.relaxations <= 3 * u64::from(report.contacts) && report.max_penetration < 0.2, "{report:?}");
    }
}

#[test]
fn a_new_budget_wakes_nothing() {
    let sleep = tumble_core::Sleep { after: 0.1, ..Default::default() };
    let mut world = world("time_stepping", 1.0 / 240.0);
    world.set_settings(world.settings().with_sleep(Some(sleep))).unwrap();
    ground(&mut world, 0.0, 0.5);
    let body = world.add(RigidBody::new(cube(0.2)).with_pose(Pose::translation(0.0, 0.0, 0.1))).unwrap();
    (0..100).for_each(|_| {
        world.step().unwrap();
    });
    assert!(world.asleep(body));
    world.set_settings(world.settings().with_budget(Some(5000))).unwrap();
    assert!(world.asleep(body));
}

#[test]
fn a_budget_of_nothing_is_an_error() {
    let error = World::new(tumble_core::Settings::default().with_budget(Some(0))).err().unwrap();
    assert_eq!(error.to_string(), "budget is 0; it must be above 0 relaxations");
}
