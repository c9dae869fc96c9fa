//! Recovery: writes the readable part of a cut or damaged file as a complete file.

use super::MAX_DEFINITIONS;
use super::bytes::{Fields, Problem};
use super::chunk::{Channel, Inner, Schema, define, next_inner, open_chunk, parse_inner};
use super::container::{Container, Ending, Next, RawRecord};
use super::error::{RecordError, Result};
use super::reader::{as_content, metadata_of};
use super::schemas::{Definitions, METADATA_NAME, TOPIC_STATE, VERSION, standard_definitions};
use super::writer::{AppendWriter, append_options};
use mcap::Compression;
use mcap::records::{MessageHeader, Metadata, op};
use mcap::write::NoSeek;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Result of [`recover`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecoverReport {
    /// Number of frames kept.
    pub frames: u64,
    /// Number of messages kept, on all topics.
    pub messages: u64,
    /// Number of chunks kept.
    pub chunks: u64,
    /// Number of chunks left out because their content is damaged.
    pub damaged_chunks: u64,
    /// Number of records of kinds that are not copied (attachments, private records).
    pub dropped_records: u64,
    /// Number of bytes read from the old file; the rest could not be used.
    pub bytes_used: u64,
    /// First fault of the old file; `None` if it was complete.
    pub fault: Option<String>,
}

/// Reads `input` up to the first structural damage and writes a complete file `output`, which must
/// not exist.
///
/// A chunk with damaged content is left out, and reading continues after it. If the first chunk is
/// damaged, the definitions of channels are those that every recording of this version has, and
/// the drawn entities have names and no parts. Damage to the file's own structure ends reading. Messages, their times and the division into chunks stay as they are:
/// a complete recording is copied byte for byte.
///
/// # Errors
/// [`RecordError`] if `input` is no MCAP file, if no frame can be read
/// ([`RecordError::NothingToRecover`]), or if `output` exists or cannot be written. After an error
/// there is no `output`.
pub fn recover(input: impl AsRef<Path>, output: impl AsRef<Path>) -> Result<RecoverReport> {
    let (input, output) = (input.as_ref(), output.as_ref());
    let container = Container::open(input)?;
    let file = File::create_new(output).map_err(RecordError::io(output, "cannot create"))?;
    let result = Mender::new(container, output, file).run(input);
    if result.is_err() {
        // the first error is returned, not one of the removal
        let _ = std::fs::remove_file(output);
    }
    result
}

struct Mender<'a> {
    container: Container,
    output: &'a Path,
    file: Option<File>,
    writer: Option<AppendWriter>,
    library: String,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    /// Definitions for channels that the readable part does not define; empty unless the file is a
    /// recording of this version.
    standard: Definitions,
    /// Metadata that was read before the compression was known.
    metadata: Vec<Metadata>,
    metadata_count: usize,
    report: RecoverReport,
}

impl<'a> Mender<'a> {
    fn new(container: Container, output: &'a Path, file: File) -> Self {
        let report = RecoverReport {
            frames: 0,
            messages: 0,
            chunks: 0,
            damaged_chunks: 0,
            dropped_records: 0,
            bytes_used: 0,
            fault: None,
        };
        Mender {
            container,
            output,
            file: Some(file),
            writer: None,
            library: String::new(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            standard: Definitions::default(),
            metadata: Vec::new(),
            metadata_count: 0,
            report,
        }
    }

    fn run(mut self, input: &Path) -> Result<RecoverReport> {
        loop {
            match self.container.next() {
                Ok(Next::Record(record)) => self.record(record)?,
                Ok(Next::End(ending)) => {
                    if let Ending::Cut { offset, what } = ending {
                        self.fault(format!("cut at byte {offset}: {what}"));
                    }
                    break;
                }
                Err(error @ RecordError::Corrupt { .. }) => {
                    self.fault(error.to_string());
                    break;
                }
                Err(error) => return Err(error),
            }
            self.report.bytes_used = self.container.offset();
        }
        if self.report.frames == 0 {
            let what = self.report.fault.take().unwrap_or_else(|| "the file is complete and has no frames".into());
            return Err(RecordError::NothingToRecover { path: input.to_owned(), offset: self.report.bytes_used, what });
        }
        self.finish()?;
        Ok(self.report)
    }

    /// Keeps the first fault.
    fn fault(&mut self, what: String) {
        self.report.fault.get_or_insert(what);
    }

    fn record(&mut self, record: RawRecord) -> Result<()> {
        let offset = record.offset;
        let done = match record.opcode {
            op::HEADER => self.header(&record.body).map(Ok),
            op::METADATA if self.metadata_count >= MAX_DEFINITIONS => {
                Err(format!("more than {MAX_DEFINITIONS} metadata records"))
            }
            op::METADATA => metadata_of(&record.body).map(|(name, metadata)| {
                if name == METADATA_NAME && metadata.get("version") == Some(&VERSION.to_string()) {
                    self.standard = standard_definitions();
                }
                self.put_metadata(Metadata { name, metadata })
            }),
            op::CHUNK => open_chunk(&record.body).and_then(|chunk| self.content(&chunk.content, &chunk.compression)),
            // outside of chunks; the summary repeats schemas and channels, which changes nothing
            op::SCHEMA | op::CHANNEL | op::MESSAGE => self.content(&as_content(record), ""),
            op::ATTACHMENT | 0x80.. => {
                self.report.dropped_records += 1;
                return Ok(());
            }
            // indexes and statistics are written again
            _ => return Ok(()),
        };
        match done {
            Ok(result) => result,
            Err(what) => {
                self.report.damaged_chunks += 1;
                self.fault(format!("damaged at byte {offset}: {what}"));
                Ok(())
            }
        }
    }

    fn header(&mut self, body: &[u8]) -> std::result::Result<(), Problem> {
        let mut fields = Fields(body);
        fields.string("profile")?;
        self.library = fields.string("library")?.to_owned();
        Ok(())
    }

    /// Copies a chunk: all of it, or none of it if it has a fault.
    fn content(&mut self, content: &[u8], compression: &str) -> std::result::Result<Result<()>, Problem> {
        let parsed = self.parse(content)?;
        Ok(self.put_chunk(parsed, compression))
    }

    fn parse<'b>(&self, content: &'b [u8]) -> std::result::Result<Parsed<'b>, Problem> {
        let mut rest = Fields(content);
        let mut new = Parsed::default();
        while let Some((opcode, body)) = next_inner(&mut rest)? {
            match parse_inner(opcode, body)? {
                Inner::Schema(id, schema) => define(&self.schemas, &mut new.schemas, id, schema)?,
                Inner::Channel(id, channel) => {
                    if channel.schema != 0
                        && !self.schemas.contains_key(&channel.schema)
                        && !new.schemas.contains_key(&channel.schema)
                    {
                        return Err(format!(
                            "channel {id} has schema {}, which the readable part does not define",
                            channel.schema
                        ));
                    }
                    define(&self.channels, &mut new.channels, id, channel)?;
                }
                Inner::Message { channel, sequence, log_time, publish_time, data } => {
                    if !self.channels.contains_key(&channel) && !new.channels.contains_key(&channel) {
                        self.define_standard(channel, &mut new).ok_or_else(|| {
                            format!("a message on channel {channel}, which the readable part does not define")
                        })?;
                    }
                    new.messages.push((MessageHeader { channel_id: channel, sequence, log_time, publish_time }, data));
                }
                Inner::Other => {}
            }
        }
        Ok(new)
    }

    /// Adds the standard definition of a channel; `None` if there is none, or if it contradicts
    /// what was read.
    fn define_standard(&self, id: u16, new: &mut Parsed) -> Option<()> {
        let channel = self.standard.channels.get(&id)?;
        let schema = self.standard.schemas.get(&channel.schema)?;
        define(&self.schemas, &mut new.schemas, channel.schema, schema.clone()).ok()?;
        define(&self.channels, &mut new.channels, id, channel.clone()).ok()
    }
}

/// Content of a chunk: new definitions, and messages.
#[derive(Default)]
struct Parsed<'b> {
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    messages: Vec<(MessageHeader, &'b [u8])>,
}

impl Mender<'_> {
    /// Returns the writer, which the first chunk creates because it determines the compression.
    fn writer(&mut self, compression: &str) -> Result<&mut AppendWriter> {
        if let Some(file) = self.file.take() {
            let compression = match compression {
                "lz4" => Some(Compression::Lz4),
                "zstd" => Some(Compression::Zstd),
                _ => None,
            };
            let options = append_options(compression).library(self.library.as_str());
            let mut writer =
                options.create(NoSeek::new(BufWriter::new(file))).map_err(RecordError::write(self.output))?;
            for metadata in self.metadata.drain(..) {
                writer.write_metadata(&metadata).map_err(RecordError::write(self.output))?;
            }
            self.writer = Some(writer);
        }
        // the writer was created above on the first call, and only `finish` takes it
        self.writer.as_mut().ok_or_else(|| RecordError::input("a recovered file", "its writer is gone"))
    }

    fn put_metadata(&mut self, metadata: Metadata) -> Result<()> {
        self.metadata_count += 1;
        match &mut self.writer {
            None => self.metadata.push(metadata),
            Some(writer) => writer.write_metadata(&metadata).map_err(RecordError::write(self.output))?,
        }
        Ok(())
    }

    fn put_chunk(&mut self, chunk: Parsed, compression: &str) -> Result<()> {
        if chunk.messages.is_empty() && chunk.schemas.is_empty() && chunk.channels.is_empty() {
            return Ok(());
        }
        let writer = self.writer(compression)?;
        let mut put = || {
            for (id, schema) in &chunk.schemas {
                writer.add_schema_with_id(*id, &schema.name, &schema.encoding, &schema.data)?;
            }
            for (id, channel) in &chunk.channels {
                writer.add_channel_with_id(
                    *id,
                    channel.schema,
                    &channel.topic,
                    &channel.encoding,
                    &channel.metadata,
                )?;
            }
            for (header, data) in &chunk.messages {
                writer.write_to_known_channel(header, data)?;
            }
            if chunk.messages.is_empty() { Ok(()) } else { writer.flush() }
        };
        let put: mcap::McapResult<()> = put();
        put.map_err(RecordError::write(self.output))?;
        self.schemas.extend(chunk.schemas);
        self.channels.extend(chunk.channels);
        let is_frame =
            |header: &MessageHeader| self.channels.get(&header.channel_id).is_some_and(|c| c.topic == TOPIC_STATE);
        self.report.frames += chunk.messages.iter().filter(|(header, _)| is_frame(header)).count() as u64;
        self.report.messages += chunk.messages.len() as u64;
        self.report.chunks += u64::from(!chunk.messages.is_empty());
        Ok(())
    }

    fn finish(&mut self) -> Result<()> {
        let Some(mut writer) = self.writer.take() else { return Ok(()) };
        writer.finish().map_err(RecordError::write(self.output))?;
        let file = writer.into_inner().into_inner().into_inner();
        let file = file.map_err(|e| RecordError::io(self.output, "cannot write")(e.into_error()))?;
        file.sync_all().map_err(RecordError::io(self.output, "cannot sync"))
    }
}
