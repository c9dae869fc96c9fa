//! Recordings are read as they were written, and the same input gives the same bytes.

use crate::support::*;
use tumble_net::record::*;

#[test]
fn frames_come_back_bit_for_bit() {
    let scratch = Scratch::new("roundtrip");
    for compression in COMPRESSIONS {
        let path = scratch.file("a.mcap");
        record(&path, 100, options(compression, 16));
        let mut reader = read(&path).unwrap();
        assert_eq!(reader.world(), WORLD);
        let names: Vec<_> = reader.entities().iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names, ["ball", "crate", "ground"]);
        let frames: Vec<Frame> = reader.by_ref().map(|frame| frame.unwrap()).collect();
        assert_eq!(frames.len(), 100);
        assert_frames(&frames);
        assert_eq!(reader.ending(), Some(&Ending::Complete));
    }
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let scratch = Scratch::new("same");
    for compression in COMPRESSIONS {
        let [a, b] = ["a.mcap", "b.mcap"].map(|name| {
            let path = scratch.file(name);
            record(&path, 50, options(compression, 8));
            std::fs::read(path).unwrap()
        });
        assert!(a == b, "{compression:?}: two runs differ");
    }
}

/// A reader that shares no code with this crate accepts the file and its index.
#[test]
fn the_container_is_valid_for_another_reader() {
    let scratch = Scratch::new("container");
    let path = scratch.file("a.mcap");
    record(&path, 20, options(Compression::Zstd, 6));
    let bytes = std::fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let stats = summary.stats.unwrap();
    assert_eq!((stats.schema_count, stats.channel_count, stats.message_count), (4, 5, 1 + 2 * 20));
    assert_eq!(stats.chunk_count, 1 + 4, "the scene's, and 20 frames by 6");
    assert_eq!((stats.message_start_time, stats.message_end_time), (0, 79_166_667), "19/240 s in ns, to the nearest");
    let topics: Vec<String> =
        mcap::MessageStream::new(&bytes).unwrap().map(|m| m.unwrap().channel.topic.clone()).collect();
    assert_eq!(topics[..3], [TOPIC_SCENE, TOPIC_TRANSFORMS, TOPIC_STATE]);
}

#[test]
fn every_shape_is_drawn_where_it_stands() {
    let scratch = Scratch::new("shapes");
    let path = scratch.file("a.mcap");
    // a quarter turn about y takes z to x
    let turned = Pose { position: [1.0, 2.0, 3.0], rotation: [0.0, 0.5f64.sqrt(), 0.0, 0.5f64.sqrt()] };
    let vertices = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mesh = part(Shape::Mesh { vertices, triangles });
    let capsule =
        VisualPart { shape: Shape::Capsule { radius: 0.25, length: 4.0 }, pose: turned, color: [1.0, 0.0, 0.0, 0.5] };
    let all = [
        Entity { name: "mesh".into(), parts: vec![mesh.clone()] },
        Entity { name: "capsule".into(), parts: vec![capsule] },
        Entity { name: "none".into(), parts: vec![] },
    ];
    Recorder::create(&path, "", &all, RecorderOptions::default()).unwrap().finish().unwrap();
    let reader = read(&path).unwrap();
    let [a, b, c] = reader.entities() else { panic!("three entities") };
    assert_eq!(a.parts, [mesh]);
    assert!(c.parts.is_empty());
    let [first, second, tube] = &b.parts[..] else { panic!("two spheres and a cylinder") };
    assert_eq!(tube.shape, Shape::Cylinder { radius: 0.25, length: 4.0 });
    assert_eq!((tube.pose, tube.color), (turned, [1.0, 0.0, 0.0, 0.5]));
    for (cap, x) in [(first, -1.0), (second, 3.0)] {
        assert_eq!(cap.shape, Shape::Sphere { radius: 0.25 });
        for (got, want) in cap.pose.position.iter().zip([x, 2.0, 3.0]) {
            assert!((got - want).abs() < 1e-15, "cap at {:?}, should be at x = {x}", cap.pose.position);
        }
    }
}

#[test]
fn objects_come_and_go() {
    let scratch = Scratch::new("change");
    let path = scratch.file("a.mcap");
    let all = entities();
    let mut recorder = Recorder::create(&path, WORLD, &all[..2], RecorderOptions::default()).unwrap();
    recorder.frame(0.0, 0, &poses(0)[..2], &[], b"two").unwrap();
    recorder.set_entities(0.5, &all).unwrap();
    recorder.frame(0.5, 1, &poses(1), &[], b"three").unwrap();
    recorder.set_entities(0.75, &all[2..]).unwrap();
    recorder.frame(0.75, 2, &poses(2)[2..], &[], b"one").unwrap();
    recorder.finish().unwrap();
    let mut reader = read(&path).unwrap();
    for (names, state) in
        [(&["ball", "crate"][..], "two"), (&["ball", "crate", "ground"], "three"), (&["ground"], "one")]
    {
        let frame = reader.next_frame().unwrap().unwrap();
        assert_eq!(frame.state, state.as_bytes());
        assert_eq!(frame.poses.len(), names.len());
        assert!(reader.entities().iter().map(|e| e.name.as_str()).eq(names.iter().copied()));
    }
    assert!(reader.next_frame().unwrap().is_none());
}

#[test]
fn a_dropped_recorder_leaves_a_complete_file() {
    let scratch = Scratch::new("drop");
    let path = scratch.file("a.mcap");
    let mut recorder = Recorder::create(&path, WORLD, &entities(), options(Compression::Lz4, 1000)).unwrap();
    for k in 0..10 {
        recorder.frame(time(k), k, &poses(k), &[], &state(k)).unwrap();
    }
    assert_eq!(recorder.flushed_frames(), 0);
    drop(recorder);
    let (frames, ending) = read_all(&path);
    assert_eq!((frames.len(), ending.unwrap()), (10, Ending::Complete));
    assert_frames(&frames);
}

/// 240 frames per second for a second: a flush every quarter second leaves 60, 120 and 180 frames,
/// and the frame that completes it.
#[test]
fn flushes_follow_simulated_time_and_size() {
    let scratch = Scratch::new("flush");
    let by_time = RecorderOptions { flush_every: FlushEvery::SimulatedSeconds(0.25), ..Default::default() };
    let mut recorder = Recorder::create(scratch.file("t.mcap"), WORLD, &entities(), by_time).unwrap();
    let mut flushed = Vec::new();
    for k in 0..240 {
        recorder.frame(time(k), k, &poses(k), &[], &state(k)).unwrap();
        flushed.push(recorder.flushed_frames());
    }
    assert_eq!((flushed[59], flushed[60], flushed[119], flushed[120], flushed[180]), (0, 61, 61, 121, 181));
    let by_size = RecorderOptions { chunk_size: 1, flush_every: FlushEvery::Frames(u32::MAX), ..Default::default() };
    let mut recorder = Recorder::create(scratch.file("s.mcap"), WORLD, &entities(), by_size).unwrap();
    recorder.frame(0.0, 0, &poses(0), &[], &[]).unwrap();
    assert_eq!(recorder.flushed_frames(), 1);
}

/// Readings and events come back with their frames; another reader finds JSON in their channels.
#[test]
fn readings_and_events_come_back_with_their_frames() {
    let scratch = Scratch::new("report");
    let path = scratch.file("a.mcap");
    let mut recorder = Recorder::create(&path, WORLD, &entities(), options(Compression::Lz4, 2)).unwrap();
    let readings =
        |k: u64| Readings::from([("imu".into(), vec![0.1 * k as f64, -1e-300, 9.81]), ("ß".into(), vec![1.0])]);
    let hit = |k: u64| RecordedEvent {
        kind: "contact_begin".into(),
        a: "ball".into(),
        b: (k == 3).then(|| "ground".into()),
        bodies: [Some("ball".into()), (k == 3).then(|| "ground".into())],
        links: [None, Some("plate".into())],
        shapes: [k as u32, 7],
        shape_names: [Some("rind".into()), None],
        impulse: [0.0, 0.0, k as f64],
        point: [1.0 / 3.0, 0.0, 0.0],
    };
    for k in 0..6 {
        let events = if k >= 3 { vec![hit(k), hit(k)] } else { Vec::new() };
        let sensors = if k == 5 { Readings::new() } else { readings(k) };
        recorder.report(&sensors, &events).unwrap();
        let nan = Readings::from([("imu".into(), vec![f64::NAN])]);
        assert!(recorder.report(&nan, &[]).unwrap_err().to_string().contains("the reading of \"imu\" is not finite"));
        recorder.frame(time(k), k, &poses(k), &[], &state(k)).unwrap();
    }
    assert!(recorder.report(&Readings::new(), &vec![hit(0); MAX_EVENTS + 1]).is_err());
    recorder.finish().unwrap();
    let (frames, _) = read_all(&path);
    assert_frames(&frames);
    for (k, frame) in (0..).zip(&frames) {
        assert_eq!(frame.sensors, if k == 5 { Readings::new() } else { readings(k) });
        assert_eq!(frame.events, if k >= 3 { vec![hit(k), hit(k)] } else { Vec::new() });
    }
    let bytes = std::fs::read(&path).unwrap();
    let messages: Vec<mcap::Message> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    let json = |topic: &str| messages.iter().filter(|m| m.channel.topic == topic).count();
    assert_eq!((json(TOPIC_SENSORS), json(TOPIC_EVENTS)), (5, 3));
    let first = messages.iter().find(|m| m.channel.topic == TOPIC_SENSORS).unwrap();
    assert_eq!(first.channel.message_encoding, "json");
    assert_eq!(String::from_utf8_lossy(&first.data), r#"{"imu":[0.0,-1e-300,9.81],"ß":[1.0]}"#);
}

/// Images of cameras: what is written is read, by the project and by the reader of MCAP, and a recovered file has them too.
#[test]
fn images_of_cameras_are_read_as_they_were_written() {
    let scratch = Scratch::new("images");
    let path = scratch.file("a.mcap");
    let mut recorder = Recorder::create(&path, WORLD, &entities(), RecorderOptions::default()).unwrap();
    let images = |k: u64| {
        let depth =
            Pixels::Depth((0..6).map(|pixel| if pixel == 2 { -1.0 } else { 0.1 * (k + pixel) as f32 }).collect());
        let color = Pixels::Color(vec![[k as u8, 128, 255]; 2]);
        let parts = Pixels::Parts(vec![None, Some(0), Some(2), Some(65_534)]);
        let image = |width, height, pixels| RecordedImage { width, height, pixels };
        let all = [("eye", image(3, 2, depth)), ("left/ß", image(1, 2, color)), ("parts", image(4, 1, parts))];
        Images::from(all.map(|(name, image)| (name.to_owned(), image)))
    };
    let shown = |k: u64| if k.is_multiple_of(2) { images(k) } else { Images::new() };
    for k in 0..20 {
        recorder.images(&shown(k)).unwrap();
        let mut wrong = |pixels, why: &str| {
            let image = RecordedImage { width: 2, height: 1, pixels };
            let error = recorder.images(&Images::from([("eye".into(), image)])).unwrap_err().to_string();
            assert!(error.contains("\"eye\"") && error.contains(why), "{error}");
        };
        wrong(Pixels::Depth(vec![1.0]), "1 pixels for 2 x 1");
        wrong(Pixels::Depth(vec![1.0, f32::NAN]), "not finite");
        wrong(Pixels::Parts(vec![None, Some(65_535)]), "entity 65535; the first 65535 can be recorded");
        recorder.frame(time(k), k, &poses(k), &[], &state(k)).unwrap();
    }
    let many = (0..=MAX_CAMERAS).map(|k| (format!("camera {k}"), images(0)["eye"].clone())).collect();
    recorder.images(&many).unwrap();
    assert!(recorder.frame(time(20), 20, &poses(20), &[], &state(20)).unwrap_err().to_string().contains("128 cameras"));
    drop(recorder);
    let path = scratch.file("b.mcap");
    let mut recorder = Recorder::create(&path, WORLD, &entities(), RecorderOptions::default()).unwrap();
    for k in 0..20 {
        recorder.images(&shown(k)).unwrap();
        recorder.frame(time(k), k, &poses(k), &[], &state(k)).unwrap();
    }
    recorder.finish().unwrap();
    let mended = scratch.file("mended.mcap");
    recover(&path, &mended).unwrap();
    for file in [&path, &mended] {
        let (frames, _) = read_all(file);
        assert_eq!(frames.len(), 20);
        for (k, frame) in (0..).zip(&frames) {
            assert_eq!(frame.images, shown(k));
        }
    }
    let bytes = std::fs::read(&path).unwrap();
    let messages: Vec<mcap::Message> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    let eye: Vec<_> = messages.iter().filter(|m| m.channel.topic == "/tumble/cameras/eye").collect();
    assert_eq!((eye.len(), eye[0].channel.schema.as_ref().unwrap().name.as_str()), (10, "foxglove.RawImage"));
}
