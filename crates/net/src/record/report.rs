//! Channels for people and plots: readings of measuring sensors and events, as JSON.
//!
//! | topic | message |
//! |---|---|
//! | `/tumble/sensors` | an object with an array of numbers for each sensor: `{"imu": [0, 0, 9.81]}` |
//! | `/tumble/events` | `{"events": [{"kind": "contact_begin", "a": "ground", "b": "leg/foot", "bodies": ["ground", "leg"], "links": [null, "foot"], "shapes": [0, 0], "shape_names": [null, "sole"], "impulse": [0, 0, -1], "point": [0, 0, 0]}]}` |
//!
//! A frame without any has no message. Both come before the state message of their frame and have its log time. Readers of
//! earlier versions skip them.

use super::error::{RecordError, Result};
use super::writer::AppendWriter;
use super::{MAX_NAME_BYTES, MAX_STATE_BYTES};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Topic of the readings of sensors.
pub const TOPIC_SENSORS: &str = "/tumble/sensors";
/// Topic of the events.
pub const TOPIC_EVENTS: &str = "/tumble/events";
pub(crate) const SENSORS_SCHEMA: &str = "tumble.Sensors";
pub(crate) const EVENTS_SCHEMA: &str = "tumble.Events";
/// Encoding of the messages.
pub(crate) const JSON: &str = "json";
/// Encoding of the schemas.
const JSON_SCHEMA: &str = "jsonschema";
/// Maximum number of events of a frame that are recorded; the first ones.
pub const MAX_EVENTS: usize = 4096;

const SENSORS_TEXT: &str = r#"{"title": "tumble.Sensors", "type": "object", "additionalProperties": {"type": "array", "items": {"type": "number"}}}"#;
const EVENTS_TEXT: &str = r#"{"title": "tumble.Events", "type": "object", "properties": {"events": {"type": "array", "items": {"type": "object", "properties": {"kind": {"type": "string"}, "a": {"type": "string"}, "b": {"type": "string"}, "bodies": {"type": "array", "items": {"type": ["string", "null"]}}, "links": {"type": "array", "items": {"type": ["string", "null"]}}, "shapes": {"type": "array", "items": {"type": "integer"}}, "shape_names": {"type": "array", "items": {"type": ["string", "null"]}}, "impulse": {"type": "array", "items": {"type": "number"}}, "point": {"type": "array", "items": {"type": "number"}}}}}}}"#;

/// Readings of sensors by their names.
pub type Readings = BTreeMap<String, Vec<f64>>;

/// An event of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordedEvent {
    /// Name of its kind, such as `contact_begin`.
    pub kind: String,
    /// Name of the entity, a body or a link as `BODY/LINK`; for all but contacts and sensors that of the body, joint or
    /// scripted event.
    pub a: String,
    /// Name of the other entity, or of the body that made an event fire, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub b: Option<String>,
    /// Names of the bodies of `a` and `b`, without links; for a joint or scripted event its name.
    pub bodies: [Option<String>; 2],
    /// Names of the links of articulated bodies, fixed ones too; `None` for other bodies.
    pub links: [Option<String>; 2],
    /// Shapes of `a` and `b` at the point: their numbers among the shapes of the link, where the parts of a compound count one
    /// by one; of other bodies the part of a compound, else 0.
    pub shapes: [u32; 2],
    /// Names of these shapes; `None` for those without one, and for all but contacts that begin or persist.
    pub shape_names: [Option<String>; 2],
    /// Impulse on `a` over the frame, N·s, world axes.
    pub impulse: [f64; 3],
    /// Point, world axes, m.
    pub point: [f64; 3],
}

/// The message of the events.
#[derive(Serialize, Deserialize)]
struct Events<E> {
    events: E,
}

/// Channels that exist in a file from their first message on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ReportChannels {
    sensors: Option<u16>,
    events: Option<u16>,
}

impl ReportChannels {
    /// Returns the number of the channel of the readings, and adds it to the file if it is new.
    pub fn sensors(&mut self, writer: &mut AppendWriter, path: &Path) -> Result<u16> {
        known(&mut self.sensors, writer, path, [SENSORS_SCHEMA, SENSORS_TEXT, TOPIC_SENSORS])
    }

    /// Returns the number of the channel of the events, and adds it to the file if it is new.
    pub fn events(&mut self, writer: &mut AppendWriter, path: &Path) -> Result<u16> {
        known(&mut self.events, writer, path, [EVENTS_SCHEMA, EVENTS_TEXT, TOPIC_EVENTS])
    }
}

fn known(
    channel: &mut Option<u16>,
    writer: &mut AppendWriter,
    path: &Path,
    [name, schema, topic]: [&str; 3],
) -> Result<u16> {
    if let Some(channel) = *channel {
        return Ok(channel);
    }
    let mut add = || {
        let schema = writer.add_schema(name, JSON_SCHEMA, schema.as_bytes())?;
        writer.add_channel(schema, topic, JSON, &BTreeMap::new())
    };
    let added = add().map_err(RecordError::write(path))?;
    *channel = Some(added);
    Ok(added)
}

/// Returns the message of readings.
///
/// # Errors
/// The fault: a number that is not finite, a long name, or too many bytes.
pub(crate) fn encode_readings(readings: &Readings) -> std::result::Result<Vec<u8>, String> {
    if let Some((name, _)) = readings.iter().find(|(_, numbers)| numbers.iter().any(|x| !x.is_finite())) {
        return Err(format!("the reading of \"{name}\" is not finite"));
    }
    if let Some(name) = readings.keys().find(|name| name.len() > MAX_NAME_BYTES) {
        return Err(format!("the name of a sensor has {} bytes, at most {MAX_NAME_BYTES} are allowed", name.len()));
    }
    within(serde_json::to_vec(readings).map_err(|e| e.to_string())?, "readings")
}

/// Returns the message of events.
///
/// # Errors
/// The fault: a number that is not finite, or too many events or bytes.
pub(crate) fn encode_events(events: &[RecordedEvent]) -> std::result::Result<Vec<u8>, String> {
    if events.len() > MAX_EVENTS {
        return Err(format!("{} events, at most {MAX_EVENTS} are allowed", events.len()));
    }
    if events.iter().any(|event| event.impulse.iter().chain(&event.point).any(|x| !x.is_finite())) {
        return Err("the impulse or the point of an event is not finite".into());
    }
    within(serde_json::to_vec(&Events { events }).map_err(|e| e.to_string())?, "events")
}

fn within(bytes: Vec<u8>, what: &str) -> std::result::Result<Vec<u8>, String> {
    match bytes.len() <= MAX_STATE_BYTES {
        true => Ok(bytes),
        false => Err(format!("{} bytes of {what}, at most {MAX_STATE_BYTES} are allowed", bytes.len())),
    }
}

/// Reads a message of readings.
pub(crate) fn decode_readings(data: &[u8]) -> std::result::Result<Readings, String> {
    serde_json::from_slice(data).map_err(|e| format!("readings of sensors: {e}"))
}

/// Reads a message of events.
pub(crate) fn decode_events(data: &[u8]) -> std::result::Result<Vec<RecordedEvent>, String> {
    let message: Events<Vec<RecordedEvent>> = serde_json::from_slice(data).map_err(|e| format!("events: {e}"))?;
    match message.events.len() <= MAX_EVENTS {
        true => Ok(message.events),
        false => Err(format!("{} events of a frame, at most {MAX_EVENTS} are read", message.events.len())),
    }
}
