//! Inputs that the recorder refuses, without damage to the recording.

use crate::support::*;
use tumble_net::record::*;

#[test]
fn frames_out_of_range_are_refused_and_not_written() {
    let scratch = Scratch::new("frames");
    let path = scratch.file("a.mcap");
    let mut recorder = Recorder::create(&path, WORLD, &entities(), options(Compression::None, 1)).unwrap();
    recorder.frame(time(0), 0, &poses(0), &[], &state(0)).unwrap();
    recorder.frame(time(1), 1, &poses(1), &[], &state(1)).unwrap();
    let with = |pose: Pose| vec![Pose::IDENTITY, pose, Pose::IDENTITY];
    let nan = with(Pose::at([0.0, f64::NAN, 0.0]));
    let zero = with(Pose { position: [0.0; 3], rotation: [0.0; 4] });
    let good = poses(2);
    let big = vec![0; MAX_STATE_BYTES + 1];
    type Case<'a> = (f64, u64, &'a [Pose], &'a [u8], &'a str);
    let bad: [Case; 9] = [
        (1.0, 2, &nan, &[], "entity \"crate\": pose is not finite"),
        (1.0, 2, &zero, &[], "entity \"crate\": rotation [0.0, 0.0, 0.0, 0.0] has length 0"),
        (1.0, 2, &good[..2], &[], "2 poses for 3 entities"),
        (1.0, 1, &good, &[], "frame 1 is already recorded"),
        (0.0, 2, &good, &[], "it must lie from 0.0041"),
        (f64::NAN, 2, &good, &[], "time NaN s"),
        (f64::INFINITY, 2, &good, &[], "time inf s"),
        (1e10, 2, &good, &[], "to 4000000000"),
        (1.0, 2, &good, &big, "67108865 bytes of state"),
    ];
    for (t, k, poses, state, wanted) in bad {
        let error = recorder.frame(t, k, poses, &[], state).unwrap_err().to_string();
        assert!(error.contains(wanted), "got: {error}\nwanted: {wanted}");
    }
    recorder.frame(time(2), 2, &good, &[], &state(2)).unwrap();
    assert_eq!(recorder.finish().unwrap().frames, 3);
    let (frames, ending) = read_all(&path);
    assert_eq!((frames.len(), ending.unwrap()), (3, Ending::Complete));
    assert_frames(&frames);
}

#[test]
fn scenes_out_of_range_are_refused_before_a_file_is_made() {
    let scratch = Scratch::new("scenes");
    let path = scratch.file("a.mcap");
    let one = |name: &str, shape: Shape| vec![Entity { name: name.into(), parts: vec![part(shape)] }];
    let ball = || Shape::Sphere { radius: 1.0 };
    let twice = [one("a", ball()), one("a", ball())].concat();
    let glaring =
        vec![Entity { name: "a".into(), parts: vec![VisualPart { color: [2.0, 0.0, 0.0, 1.0], ..part(ball()) }] }];
    let open = Shape::Mesh { vertices: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 3]] };
    let cases = [
        (one("", ball()), "the name is empty"),
        (one("world", ball()), "taken by the root frame"),
        (one(&"x".repeat(MAX_NAME_BYTES + 1), ball()), "257 bytes"),
        (twice, "entity \"a\": this name is used twice"),
        (glaring, "color [2.0"),
        (one("a", Shape::Sphere { radius: -1.0 }), "part 0: length -1"),
        (one("a", Shape::Box { size: [1.0, f64::NAN, 1.0] }), "length NaN"),
        (one("a", open), "triangle 0 is [0, 1, 3], but there are only 3 vertices"),
    ];
    for (entities, wanted) in cases {
        let error = Recorder::create(&path, WORLD, &entities, RecorderOptions::default()).err().unwrap().to_string();
        assert!(error.contains(wanted), "got: {error}\nwanted: {wanted}");
    }
    for flush_every in
        [FlushEvery::Frames(0), FlushEvery::SimulatedSeconds(0.0), FlushEvery::SimulatedSeconds(f64::NAN)]
    {
        assert!(Recorder::create(&path, WORLD, &[], RecorderOptions { flush_every, ..Default::default() }).is_err());
    }
    for chunk_size in [0, u64::MAX] {
        assert!(Recorder::create(&path, WORLD, &[], RecorderOptions { chunk_size, ..Default::default() }).is_err());
    }
    assert!(!path.exists());
    let error =
        Recorder::create(scratch.file("no/such/folder.mcap"), WORLD, &[], RecorderOptions::default()).err().unwrap();
    assert!(error.to_string().contains("no/such/folder.mcap: cannot create"), "{error}");
}

/// The scene is flushed at once, so a disk without room is noticed before the run.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_an_error() {
    let error =
        Recorder::create("/dev/full", WORLD, &entities(), RecorderOptions::default()).err().unwrap().to_string();
    assert!(error.starts_with("/dev/full: cannot write: No space left"), "{error}");
}
