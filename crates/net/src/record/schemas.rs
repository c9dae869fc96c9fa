//! Topics, and the schemas that a recording contains.

use super::bytes::Fields;
use super::chunk::{Channel, Inner, Schema, next_inner, parse_inner};
use super::error::{RecordError, Result};
use super::writer::append_options;
use foxglove::Encode;
use foxglove::messages::{FrameTransforms, PointCloud, SceneUpdate};
use mcap::Writer;
use mcap::write::NoSeek;
use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};
use std::collections::BTreeMap;
use std::io::{Cursor, Seek, Write};
use std::path::Path;

/// Topic of the drawn entities.
pub const TOPIC_SCENE: &str = "/scene";
/// Topic of the poses.
pub const TOPIC_TRANSFORMS: &str = "/tf";
/// Topic of the state.
pub const TOPIC_STATE: &str = "/tumble/state";
/// Topic of surfaces that change their shape.
pub const TOPIC_SURFACES: &str = "/surfaces";
/// Topic of particles.
pub const TOPIC_PARTICLES: &str = "/particles";
/// Name of the parent frame of all entities: meters, z up, right-handed.
pub const ROOT_FRAME: &str = "world";

pub(crate) const STATE_SCHEMA: &str = "tumble.State";
pub(crate) const SCENE_SCHEMA: &str = "foxglove.SceneUpdate";
pub(crate) const TRANSFORMS_SCHEMA: &str = "foxglove.FrameTransforms";
const PARTICLES_SCHEMA: &str = "foxglove.PointCloud";
pub(crate) const PROTOBUF: &str = "protobuf";
/// Name of the metadata record that marks a recording of tumble.
pub(crate) const METADATA_NAME: &str = "tumble";
/// Version of the recording's layout.
pub(crate) const VERSION: u32 = 5;

/// The state message, as text. Every file contains it twice: compiled, as the channel's schema, and
/// as this text.
///
/// It is protobuf instead of plain bytes, so viewers open the channel without a warning and any
/// protobuf tool decodes it. Fixed-width fields are little-endian on the wire; the payload belongs
/// to the caller and is little-endian by convention.
pub const STATE_PROTO: &str = r#"syntax = "proto3";
package tumble;

// One frame of a simulation. The schema's name takes the place of a magic number.
message State {
  fixed32 version = 1;  // layout of this message: 5
  fixed64 frame = 2;    // frame number, strictly increasing within a file
  double time_s = 3;    // simulated time in seconds from 0, not rounded; the log time is this in whole nanoseconds
  bytes payload = 4;    // the state, opaque here; little-endian
  bytes contacts = 5;   // 96 bytes each, little-endian: indices of entities a and b in /tf, shapes of a and b (4 u32); point, normal from b to a, depth, force on a (10 f64)
  bytes chain = 6;      // BLAKE3 of the chain of the frame before (none for the first), frame, time_s and payload: 32 bytes
}
"#;

/// A message of the state channel; [`STATE_PROTO`] documents the fields.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct State {
    #[prost(fixed32, tag = "1")]
    pub version: u32,
    #[prost(fixed64, tag = "2")]
    pub frame: u64,
    #[prost(double, tag = "3")]
    pub time_s: f64,
    #[prost(bytes = "vec", tag = "4")]
    pub payload: Vec<u8>,
    #[prost(bytes = "vec", tag = "5")]
    pub contacts: Vec<u8>,
    #[prost(bytes = "vec", tag = "6")]
    pub chain: Vec<u8>,
}

/// Returns the compiled form of [`STATE_PROTO`], as `protoc --descriptor_set_out` writes it.
fn state_descriptor() -> Vec<u8> {
    let field = |(number, name, kind): (i32, &str, Type)| FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        label: Some(Label::Optional as i32),
        r#type: Some(kind as i32),
        json_name: Some(if name == "time_s" { "timeS".into() } else { name.into() }),
        ..Default::default()
    };
    let fields = [
        (1, "version", Type::Fixed32),
        (2, "frame", Type::Fixed64),
        (3, "time_s", Type::Double),
        (4, "payload", Type::Bytes),
        (5, "contacts", Type::Bytes),
        (6, "chain", Type::Bytes),
    ];
    let message =
        DescriptorProto { name: Some("State".into()), field: fields.map(field).to_vec(), ..Default::default() };
    let file = FileDescriptorProto {
        name: Some("tumble/State.proto".into()),
        package: Some("tumble".into()),
        message_type: vec![message],
        syntax: Some("proto3".into()),
        ..Default::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

/// Channel numbers of one file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Channels {
    pub scene: u16,
    pub transforms: u16,
    pub state: u16,
    pub surfaces: u16,
    pub particles: u16,
}

/// Writes the schemas, then the channels.
pub(crate) fn add_channels<W: Write + Seek>(writer: &mut Writer<W>, path: &Path) -> Result<Channels> {
    let mut all = || {
        let scene = writer.add_schema(SCENE_SCHEMA, PROTOBUF, &published::<SceneUpdate>())?;
        let transforms = writer.add_schema(TRANSFORMS_SCHEMA, PROTOBUF, &published::<FrameTransforms>())?;
        let state = writer.add_schema(STATE_SCHEMA, PROTOBUF, &state_descriptor())?;
        let particles = writer.add_schema(PARTICLES_SCHEMA, PROTOBUF, &published::<PointCloud>())?;
        let (none, proto) = (BTreeMap::new(), BTreeMap::from([("proto".to_owned(), STATE_PROTO.to_owned())]));
        Ok(Channels {
            scene: writer.add_channel(scene, TOPIC_SCENE, PROTOBUF, &none)?,
            transforms: writer.add_channel(transforms, TOPIC_TRANSFORMS, PROTOBUF, &none)?,
            state: writer.add_channel(state, TOPIC_STATE, PROTOBUF, &proto)?,
            surfaces: writer.add_channel(scene, TOPIC_SURFACES, PROTOBUF, &none)?,
            particles: writer.add_channel(particles, TOPIC_PARTICLES, PROTOBUF, &none)?,
        })
    };
    all().map_err(RecordError::write(path))
}

/// Schemas and channels by their numbers in a file.
#[derive(Debug, Default)]
pub(crate) struct Definitions {
    pub schemas: BTreeMap<u16, Schema>,
    pub channels: BTreeMap<u16, Channel>,
}

/// Returns the definitions that every recording of this [`VERSION`] has, for files in which they
/// are damaged. They are read from an empty file, so they are what the recorder writes.
pub(crate) fn standard_definitions() -> Definitions {
    let mut found = Definitions::default();
    let Some(bytes) = empty_file() else { return found };
    let mut records = Fields(bytes.get(mcap::MAGIC.len()..).unwrap_or_default());
    // the signature at the end is no record
    while let Ok(Some((opcode, body))) = next_inner(&mut records) {
        match parse_inner(opcode, body) {
            Ok(Inner::Schema(id, schema)) => _ = found.schemas.insert(id, schema),
            Ok(Inner::Channel(id, channel)) => _ = found.channels.insert(id, channel),
            _ => {}
        }
    }
    found
}

/// Returns the bytes of a recording without metadata and messages: its summary lists the
/// definitions.
fn empty_file() -> Option<Vec<u8>> {
    let mut writer = append_options(None).create(NoSeek::new(Cursor::new(Vec::new()))).ok()?;
    add_channels(&mut writer, Path::new("")).ok()?;
    writer.finish().ok()?;
    Some(writer.into_inner().into_inner().into_inner())
}

/// Returns the published schema of a Foxglove message: a compiled descriptor set.
fn published<M: Encode>() -> Vec<u8> {
    // every generated message has a schema; `None` occurs for hand-written encoders only
    M::get_schema().map(|schema| schema.data.into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text and its compiled form have the same content.
    #[test]
    fn text_and_descriptor_say_the_same() {
        let set = FileDescriptorSet::decode(&state_descriptor()[..]).unwrap();
        let file = &set.file[0];
        assert!(STATE_PROTO.contains(&format!("package {};", file.package())));
        assert!(STATE_PROTO.contains(&format!("syntax = \"{}\";", file.syntax())));
        let message = &file.message_type[0];
        assert!(STATE_PROTO.contains(&format!("message {} {{", message.name())));
        let compiled: Vec<String> =
            message.field.iter().map(|f| format!("{} {} = {}", type_word(f.r#type()), f.name(), f.number())).collect();
        let text: Vec<&str> =
            STATE_PROTO.lines().filter_map(|line| line.strip_prefix("  ")?.split(';').next()).collect();
        assert_eq!(compiled, text);
    }

    fn type_word(kind: Type) -> String {
        kind.as_str_name().trim_start_matches("TYPE_").to_lowercase()
    }

    /// Wire bytes computed by hand: key = number·8 + wire type (5 fixed32, 1 fixed64, 2 bytes),
    /// little-endian values.
    #[test]
    fn state_bytes_are_as_documented() {
        let state =
            State { version: 4, frame: 0x0102, time_s: 0.5, payload: vec![7, 8], contacts: vec![9], chain: vec![5] };
        let wire = [
            &[0x0d, 4, 0, 0, 0][..],
            &[0x11, 2, 1, 0, 0, 0, 0, 0, 0],
            &[0x19, 0, 0, 0, 0, 0, 0, 0xe0, 0x3f],
            &[0x22, 2, 7, 8],
            &[0x2a, 1, 9],
            &[0x32, 1, 5],
        ];
        assert_eq!(state.encode_to_vec(), wire.concat());
    }
}
