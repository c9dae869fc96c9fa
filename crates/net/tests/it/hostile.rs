//! Hostile recordings, built by hand from the MCAP specification, because the writer would refuse
//! them.

use crate::support::*;
use tumble_net::record::*;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

fn sized(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn raw(opcode: u8, claimed: u64, body: &[u8]) -> Vec<u8> {
    [&[opcode], &claimed.to_le_bytes()[..], body].concat()
}

fn whole(opcode: u8, body: &[u8]) -> Vec<u8> {
    raw(opcode, body.len() as u64, body)
}

/// A chunk without a checksum.
fn chunk(size: u64, compression: &str, stored: &[u8]) -> Vec<u8> {
    let body = [
        &[0; 16],
        &size.to_le_bytes()[..],
        &[0; 4],
        &sized(compression.as_bytes()),
        &(stored.len() as u64).to_le_bytes(),
        stored,
    ]
    .concat();
    whole(6, &body)
}

fn description() -> Vec<u8> {
    let entries = [sized(b"version"), sized(b"5"), sized(b"world"), sized(b"trap")].concat();
    whole(0x0c, &[sized(b"tumble"), sized(&entries)].concat())
}

/// Reads magic, header, description and then `rest`.
fn error_of(scratch: &Scratch, rest: &[u8]) -> String {
    let path = scratch.file("trap.mcap");
    let header = whole(1, &[sized(b""), sized(b"")].concat());
    let before = [MAGIC, &header, &description()].concat();
    std::fs::write(&path, [&before, rest].concat()).unwrap();
    let (frames, ending) = read_all(&path);
    assert!(frames.is_empty());
    let error = ending.expect_err("a trap is not a recording").to_string();
    assert!(error.contains(&format!("damaged at byte {}:", before.len())), "{error}");
    assert!(recover(&path, scratch.file("out.mcap")).is_err());
    error
}

#[test]
fn lengths_are_not_believed() {
    let scratch = Scratch::new("lengths");
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (raw(5, u64::MAX, b""), "18446744073709551615 bytes, at most 268435456"),
        (raw(0, 0, b""), "opcode 0"),
        (chunk(u64::MAX, "", b""), "a chunk of 18446744073709551615 bytes"),
        (chunk(1 << 28, "", b"x"), "should hold 268435456 bytes and holds 1"),
        (chunk(5, "brotli", b"x"), "compression \"brotli\""),
        (whole(6, &[0; 20]), "chunk size takes 8 bytes, but 4 are left"),
        // a record in a chunk that would extend beyond it
        (chunk(9, "", &raw(5, 1, b"")), "record in the chunk takes 1 bytes, but 0 are left"),
        (chunk(9, "", &raw(5, u64::MAX, b"")), "takes 18446744073709551615 bytes"),
        (chunk(4, "", b"\x05abc"), "record length in the chunk takes 8 bytes, but 3 are left"),
        (chunk(15, "", &whole(3, b"\x01\x00\xff\xff\xff\xff")), "schema name takes 4294967295 bytes, but 0 are left"),
        (chunk(31, "", &whole(5, &[7; 22])), "channel 1799, which the file does not define"),
        (whole(2, &[0; 20]), "a footer without an end of data"),
    ];
    for (rest, wanted) in cases {
        let error = error_of(&scratch, &rest);
        assert!(error.contains(wanted), "got: {error}\nwanted: {wanted}");
    }
}

/// 64 MiB of zeros in a few kilobytes, with a stated size of ten bytes: decompression stops at the
/// eleventh.
#[test]
fn a_bomb_does_not_go_off() {
    let scratch = Scratch::new("bomb");
    let zeros = vec![0u8; 64 << 20];
    let packed = zstd::encode_all(&zeros[..], 3).unwrap();
    assert!(packed.len() < 100_000);
    let error = error_of(&scratch, &chunk(10, "zstd", &packed));
    assert!(error.contains("should hold 10 bytes and holds 11"), "{error}");
    for compression in ["lz4", "zstd"] {
        let error = error_of(&scratch, &chunk(10, compression, b"this is no frame of either"));
        assert!(error.contains(compression) || error.contains("holds"), "{error}");
    }
}

/// Channel and schema definitions, then messages, as a chunk's content.
fn on_topic(topic: &str, schema: &str, message: &[u8]) -> Vec<u8> {
    let schema = [&[1, 0], &sized(schema.as_bytes())[..], &sized(b"protobuf"), &sized(b"")].concat();
    let channel = [&[1, 0, 1, 0], &sized(topic.as_bytes())[..], &sized(b"protobuf"), &sized(b"")].concat();
    let message = [&[1, 0], &[0; 20][..], message].concat();
    [whole(3, &schema), whole(4, &channel), whole(5, &message)].concat()
}

/// Empty submessages take two bytes on the wire, hundreds in memory, and almost none when
/// compressed.
#[test]
fn messages_that_swell_are_refused_before_they_are_decoded() {
    let scratch = Scratch::new("swell");
    let entities = [0x12, 0].repeat(10_000_000);
    let spheres = [&[0x12, 0x80, 0xad, 0xe2, 0x04][..], &[0x4a, 0].repeat(5_000_000)].concat(); // one entity of 10,000,000 bytes
    let transforms = [0x0a, 0].repeat(100_001);
    for (topic, schema, message, wanted) in [
        ("/scene", "foxglove.SceneUpdate", &entities, "bytes of memory, at most 536870912"),
        ("/scene", "foxglove.SceneUpdate", &spheres, "bytes of memory, at most 536870912"),
        ("/tf", "foxglove.FrameTransforms", &transforms, "100001 transforms, at most 100000"),
    ] {
        let content = on_topic(topic, schema, message);
        let packed = zstd::encode_all(&content[..], 3).unwrap();
        assert!(packed.len() < 10_000);
        let error = error_of(&scratch, &chunk(content.len() as u64, "zstd", &packed));
        assert!(error.contains(wanted), "{error}");
    }
}

#[test]
fn definitions_are_counted_and_measured() {
    let scratch = Scratch::new("definitions");
    let schema =
        |id: u16, text: &[u8]| whole(3, &[&id.to_le_bytes(), &sized(b"s")[..], &sized(b""), &sized(text)].concat());
    let plain = |content: &[u8]| chunk(content.len() as u64, "", content);
    let many: Vec<u8> = (1..=257).flat_map(|id| schema(id, b"")).collect();
    assert!(error_of(&scratch, &plain(&many)).contains("more than 256"));
    assert!(error_of(&scratch, &plain(&schema(1, &vec![0; 1 << 20]))).contains("at most 1048576"));
    assert!(error_of(&scratch, &plain(&[schema(1, b"a"), schema(1, b"b")].concat())).contains("defined twice"));
    assert!(error_of(&scratch, &plain(&schema(0, b""))).contains("id 0"));
}

#[test]
fn other_files_are_recognized() {
    let scratch = Scratch::new("other");
    let path = scratch.file("a.mcap");
    assert!(matches!(read(&path), Err(RecordError::Io { .. })), "no such file");
    assert!(read(scratch.file("")).is_err(), "a folder");
    for (bytes, wanted) in
        [(&b""[..], "ends at byte 0"), (b"\x89MCA", "ends at byte 4"), (b"#VRML V2.0 utf8", "begins with")]
    {
        std::fs::write(&path, bytes).unwrap();
        let error = read(&path).err().unwrap().to_string();
        assert!(error.contains(wanted) && error.contains("a.mcap"), "{error}");
    }
    // a valid MCAP file of another program
    let mut writer = mcap::Writer::new(std::fs::File::create(&path).unwrap()).unwrap();
    writer.add_channel(0, "/chat", "json", &Default::default()).unwrap();
    writer.finish().unwrap();
    assert!(matches!(read(&path), Err(RecordError::NotARecording { .. })));
}
