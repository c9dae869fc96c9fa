//! Chunks: decompression with a bound, checksum, and the records inside (MCAP specification,
//! "Records").

use super::bytes::{Fields, Problem};
use super::{MAX_CHUNK_BYTES, MAX_DEFINITION_BYTES, MAX_DEFINITIONS};
use mcap::records::op;
use std::collections::BTreeMap;
use std::io::Read;

/// A schema as stored in the file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Schema {
    pub name: String,
    pub encoding: String,
    pub data: Vec<u8>,
}

/// A channel as stored in the file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channel {
    pub schema: u16,
    pub topic: String,
    pub encoding: String,
    pub metadata: BTreeMap<String, String>,
}

/// Adds a definition unless it is already in `known` or `new`. A different one under the same
/// number is a fault, and so are more than [`MAX_DEFINITIONS`](super::MAX_DEFINITIONS).
pub(crate) fn define<T: PartialEq>(
    known: &BTreeMap<u16, T>,
    new: &mut BTreeMap<u16, T>,
    id: u16,
    value: T,
) -> Result<(), Problem> {
    match known.get(&id).or(new.get(&id)) {
        Some(old) if *old == value => Ok(()),
        Some(_) => Err(format!("schema or channel {id} is defined twice, and differently")),
        None if known.len() + new.len() >= MAX_DEFINITIONS => {
            Err(format!("more than {MAX_DEFINITIONS} schemas or channels"))
        }
        None => {
            new.insert(id, value);
            Ok(())
        }
    }
}

/// A record that can occur in a chunk.
#[derive(Debug)]
pub(crate) enum Inner<'a> {
    Schema(u16, Schema),
    Channel(u16, Channel),
    Message {
        channel: u16,
        sequence: u32,
        log_time: u64,
        publish_time: u64,
        data: &'a [u8],
    },
    /// A record of an unused kind.
    Other,
}

/// Parses one record by its opcode.
pub(crate) fn parse_inner(opcode: u8, body: &[u8]) -> Result<Inner<'_>, Problem> {
    let mut f = Fields(body);
    match opcode {
        op::SCHEMA | op::CHANNEL if body.len() > MAX_DEFINITION_BYTES => {
            Err(format!("a schema or channel of {} bytes, at most {MAX_DEFINITION_BYTES} are read", body.len()))
        }
        op::SCHEMA => {
            let id = f.u16("schema id")?;
            let schema = Schema {
                name: f.string("schema name")?.to_owned(),
                encoding: f.string("schema encoding")?.to_owned(),
                data: f.sized("schema text")?.to_vec(),
            };
            f.end("the schema")?;
            if id == 0 { Err("a schema has id 0".into()) } else { Ok(Inner::Schema(id, schema)) }
        }
        op::CHANNEL => {
            let id = f.u16("channel id")?;
            let channel = Channel {
                schema: f.u16("channel's schema id")?,
                topic: f.string("topic")?.to_owned(),
                encoding: f.string("message encoding")?.to_owned(),
                metadata: f.map("channel metadata")?,
            };
            f.end("the channel")?;
            Ok(Inner::Channel(id, channel))
        }
        op::MESSAGE => {
            let (channel, sequence) = (f.u16("message's channel id")?, f.u32("sequence")?);
            let (log_time, publish_time) = (f.u64("log time")?, f.u64("publish time")?);
            Ok(Inner::Message { channel, sequence, log_time, publish_time, data: f.0 })
        }
        _ => Ok(Inner::Other),
    }
}

/// Returns opcode and body of the next record of a chunk's content; `None` at its end.
pub(crate) fn next_inner<'a>(content: &mut Fields<'a>) -> Result<Option<(u8, &'a [u8])>, Problem> {
    if content.0.is_empty() {
        return Ok(None);
    }
    let opcode = content.u8("opcode in the chunk")?;
    let length = content.u64("record length in the chunk")?;
    Ok(Some((opcode, content.take(length, "record in the chunk")?)))
}

/// A decompressed chunk record.
pub(crate) struct Chunk {
    /// `""`, `"lz4"` or `"zstd"`.
    pub compression: String,
    /// Its records, in sequence.
    pub content: Vec<u8>,
}

/// Decompresses the body of a chunk record; checks sizes, compression and checksum.
pub(crate) fn open_chunk(body: &[u8]) -> Result<Chunk, Problem> {
    let mut f = Fields(body);
    let (_start, _end) = (f.u64("chunk start time")?, f.u64("chunk end time")?);
    let size = f.u64("chunk size")?;
    let checksum = f.u32("chunk checksum")?;
    let compression = f.string("chunk compression")?.to_owned();
    let stored_size = f.u64("stored size")?;
    let stored = f.take(stored_size, "chunk content")?;
    f.end("the chunk")?;
    if size > MAX_CHUNK_BYTES {
        return Err(format!("a chunk of {size} bytes, at most {MAX_CHUNK_BYTES} are read"));
    }
    let content = decompress(&compression, stored, size)?;
    if content.len() as u64 != size {
        return Err(format!("the chunk should hold {size} bytes and holds {}", content.len()));
    }
    // zero means that the writer computed none
    let actual = crc32fast::hash(&content);
    if checksum != 0 && checksum != actual {
        return Err(format!("chunk checksum is {actual:08x}, and should be {checksum:08x}"));
    }
    Ok(Chunk { compression, content })
}

/// Decompresses to at most one byte more than `size`. Memory grows with the decompressed bytes, not
/// with the stated size.
fn decompress(compression: &str, stored: &[u8], size: u64) -> Result<Vec<u8>, Problem> {
    let fault = |e: std::io::Error| format!("{compression} data in the chunk: {e}");
    let mut out = Vec::new();
    match compression {
        "" => out.extend_from_slice(stored),
        "lz4" => {
            lz4::Decoder::new(stored).and_then(|d| d.take(size + 1).read_to_end(&mut out)).map(drop).map_err(fault)?
        }
        "zstd" => zstd::Decoder::with_buffer(stored)
            .and_then(|d| d.take(size + 1).read_to_end(&mut out))
            .map(drop)
            .map_err(fault)?,
        other => return Err(format!("compression \"{other}\", only lz4, zstd and none are known")),
    }
    Ok(out)
}
