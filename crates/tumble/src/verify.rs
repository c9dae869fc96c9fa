//! `tumble verify`: computes a recording again and compares every frame, bit by bit.

use crate::args::VerifyOptions;
use crate::failure::Failure;
use tumble::dynamics::World;
use tumble::net::record::{Ending, Frame, read};

/// Verifies a recording.
pub fn verify(options: &VerifyOptions) -> Result<(), Failure> {
    let file = options.recording.display();
    let mut reader = read(&options.recording).map_err(Failure::input)?;
    let mut world = options.scene.load()?.build().map_err(Failure::input)?.0;
    let mut frames = 0_u64;
    while let Some(frame) = reader.next_frame().map_err(Failure::input)? {
        if let Some(broken) = reader.broken_at() {
            let why = format!(
                "its hash does not follow from those before: frames were changed or removed before frame {broken}"
            );
            return Err(Failure::run(&format!("{file}: the hash chain is broken"), why));
        }
        if frames == 0 {
            restore(&mut world, &frame).map_err(|why| Failure::input(format!("{file}: {why}")))?;
        } else {
            advance(&mut world, frame.frame)?;
        }
        if world.save() != frame.state {
            return Err(Failure::run(
                &format!("{file}: frame {} ({} s) differs", frame.frame, frame.time_s),
                difference(&world, &frame),
            ));
        }
        frames += 1;
    }
    if frames == 0 {
        return Err(Failure::input(format!("{file}: it has no complete frame, so there is nothing to verify")));
    }
    if let Some(Ending::Cut { offset, .. }) = reader.ending() {
        println!("{file}: it is cut at byte {offset}; the frames before are verified");
    }
    let hash: String =
        reader.last_hash().map_or(String::new(), |chain| chain[..8].iter().map(|b| format!("{b:02x}")).collect());
    println!("{file}: {frames} frames computed again, the same bits in all; chain {hash}");
    Ok(())
}

fn restore(world: &mut World, frame: &Frame) -> Result<(), String> {
    world.restore(&frame.state).map_err(|e| format!("frame {} is no state of this scene: {e}", frame.frame))
}

/// Steps to a frame number.
fn advance(world: &mut World, frame: u64) -> Result<(), Failure> {
    while world.frame() < frame {
        let next = world.frame() + 1;
        world.step().map_err(|e| Failure::run(&format!("frame {next} cannot be computed"), e))?;
    }
    Ok(())
}

/// Returns the first object whose numbers differ from those of the recorded frame.
fn difference(world: &World, frame: &Frame) -> String {
    let mut recorded = world.fork();
    if let Err(why) = restore(&mut recorded, frame) {
        return why;
    }
    for &id in world.ids() {
        let [Some(now), Some(then)] = [world.state_of(id), recorded.state_of(id)] else { continue };
        let differs = |(now, then): (&f64, &f64)| now.to_bits() != then.to_bits();
        if let Some(at) = now.iter().zip(then).position(differs) {
            let name = world.name(id).unwrap_or_default();
            let [now, then] = [now[at], then[at]];
            return format!("number {at} of the state of '{name}' is {now:e} here and {then:e} in the recording");
        }
    }
    "the numbers of all objects agree; contact forces, sleep or another part of the snapshot do not".into()
}
