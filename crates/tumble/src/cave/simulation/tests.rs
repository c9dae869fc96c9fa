//! A simulation that joins later continues with the same bits, with users that walk and pull.

use super::*;
use crate::cave::args::CaveSceneOptions;
use crate::cave::run_setup::Role;
use tumble::collide::Pose;
use tumble::net::sync::StateHashes;
use tumble::scene::resolve_scene;

fn setup() -> RunSetup {
    let scene = resolve_scene("billiards", &[]).ok().unwrap().load().unwrap();
    let surroundings = CaveSceneOptions { cave: "cube4".into(), environment: None };
    RunSetup::load(scene, &surroundings, Role::Server).ok().unwrap()
}

fn simulation(user_colliders: bool) -> CaveSimulation {
    let setup = setup();
    CaveSimulation::new(&setup, setup.world.fork(), user_colliders).ok().unwrap()
}

/// Returns the inputs of a frame: a user walks, looks around and pulls what is in front, and the
/// operator pauses and resets.
fn inputs(frame: u64) -> FrameInputs {
    let turn = nalgebra::UnitQuaternion::from_euler_angles(-0.4, 0.0, 0.02 * frame as f64);
    let head = Pose::from_parts([0.0, 0.05, 1.6].into(), turn);
    let input = Input {
        sequence: frame,
        user: 0,
        head: Some(head),
        wand: Some(head),
        hands: [Some(head), None],
        buttons: u32::from(frame % 40 > 10),
        keys: vec![0x1A, 0x50],
    };
    let pace = Input { sequence: 1_500_000, ..Request::Pause.input(0) };
    let mut inputs = vec![(3, input), (PACE_SOURCE, pace)];
    let request = match frame {
        20 => Some(Request::Pause),
        25 => Some(Request::Resume),
        70 => Some(Request::Reset),
        _ => None,
    };
    inputs.extend(request.map(|request| (OPERATOR_SOURCE, request.input(frame))));
    FrameInputs { steps: 4, inputs }
}

fn hash(simulation: &CaveSimulation, frame: u64) -> [u8; 16] {
    StateHashes::of(frame, simulation.world(), simulation.viewer()).hash
}

#[test]
fn a_simulation_that_joins_at_any_frame_continues_with_the_same_bits() {
    let mut server = simulation(true);
    let mut nodes = vec![simulation(true)];
    let place = server.viewer().cave;
    for frame in 1..=100 {
        if frame % 9 == 0 {
            let mut late = simulation(true);
            late.restore(&server.save()).unwrap();
            nodes.push(late);
        }
        server.advance(&inputs(frame)).unwrap();
        for (k, node) in nodes.iter_mut().enumerate() {
            node.advance(&inputs(frame)).unwrap();
            assert_eq!(hash(node, frame), hash(&server, frame), "frame {frame}, node {k}");
            assert_eq!(node.save(), server.save(), "frame {frame}, node {k}");
        }
    }
    assert!(server.viewer().cave != place, "the user walked");
    // 29 frames before the reset are not in the time: 100 - 70 + 1 since then
    let dt = server.world().settings().dt;
    assert!((server.world().time() - 31.0 * 4.0 * dt).abs() < 1e-9, "{}", server.world().time());
}

#[test]
fn time_stands_while_paused() {
    let mut simulation = simulation(false);
    simulation.take(OPERATOR_SOURCE, Request::Pause.input(1)).ok().unwrap();
    let before = simulation.world.save();
    simulation.step(10, |_| {}).ok().unwrap();
    assert!(simulation.is_paused() && simulation.world.save() == before);
    simulation.take(OPERATOR_SOURCE, Request::Resume.input(2)).ok().unwrap();
    simulation.step(10, |_| {}).ok().unwrap();
    assert!((simulation.world.time() - 10.0 * simulation.world.settings().dt).abs() < 1e-12);
    simulation.take(OPERATOR_SOURCE, Request::Reset.input(3)).ok().unwrap();
    assert!(simulation.world.save() == before);
}

#[test]
fn damaged_bytes_change_nothing() {
    let mut simulation = simulation(false);
    (1..50).for_each(|frame| simulation.advance(&inputs(frame)).unwrap());
    let (good, now) = (simulation.save(), hash(&simulation, 0));
    for cut in (0..good.len()).step_by(1 + good.len() / 300) {
        assert!(simulation.restore(&good[..cut]).is_err());
        assert_eq!(hash(&simulation, 0), now);
    }
    for at in (1..good.len().min(800)).step_by(3) {
        let mut flipped = good.clone();
        flipped[at] ^= 0x40;
        let _ = simulation.restore(&flipped); // it may be another valid state
    }
    simulation.restore(&good).unwrap();
    assert_eq!(hash(&simulation, 0), now);
}

#[test]
fn other_constants_and_settings_have_another_hash_and_threads_have_not() {
    let mut simulation = simulation(false);
    let setup = setup();
    let hash = |simulation: &CaveSimulation| simulation.hash(&setup).ok().unwrap();
    let first = hash(&simulation);
    let settings = *simulation.world.settings();
    simulation.world.set_settings(settings.with_threads(2)).unwrap();
    assert_eq!(hash(&simulation), first);
    simulation.world.set_settings(settings.with_dt(settings.dt * 0.5)).unwrap();
    assert_ne!(hash(&simulation), first);
}
