//! The outer file, record by record, from the first byte to the last (MCAP specification, "File
//! structure").
//!
//! ```text
//! magic  Header  (Chunk MessageIndex* | Metadata | …)*  DataEnd(crc)  summary  Footer(crc)  magic
//! ```
//!
//! A record is an opcode of one byte, a length of eight bytes, and the body. Both checksums are
//! verified on the way: after [`Ending::Complete`] a checksum has covered every byte of the file.

use super::MAX_RECORD_BYTES;
use super::bytes::Fields;
use super::error::{RecordError, Result};
use mcap::MAGIC;
use mcap::records::op;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// The end of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The file has its footer; all checksums agree.
    Complete,
    /// The file is cut in the middle, as a killed run leaves it. Everything before `offset` was
    /// read.
    Cut {
        /// First unusable byte.
        offset: u64,
        /// Description of the missing part.
        what: String,
    },
}

/// One record of the outer file.
pub(crate) struct RawRecord {
    /// Offset of its opcode in the file.
    pub offset: u64,
    pub opcode: u8,
    pub body: Vec<u8>,
}

/// A record, or the end of them.
pub(crate) enum Next {
    Record(RawRecord),
    End(Ending),
}

#[derive(Debug)]
enum Section {
    Data,
    Summary,
}

/// Bytes of opcode and length.
const HEAD_BYTES: u64 = 9;

/// Reads an MCAP file from start to end.
#[derive(Debug)]
pub(crate) struct Container {
    path: PathBuf,
    file: BufReader<File>,
    /// Length of the file when it was opened; later additions are not read.
    length: u64,
    offset: u64,
    crc: crc32fast::Hasher,
    section: Section,
}

impl Container {
    /// Opens a file and checks its first bytes.
    pub fn open(path: &Path) -> Result<Container> {
        let not_mcap = |why: String| RecordError::NotMcap { path: path.to_owned(), why };
        let plain = |about: std::fs::Metadata| match about.is_file() {
            true => Ok(about),
            false => Err(not_mcap("it is not a plain file".into())),
        };
        // before the opening, which waits for a writer if the file is a pipe
        plain(std::fs::metadata(path).map_err(RecordError::io(path, "cannot open"))?)?;
        let file = File::open(path).map_err(RecordError::io(path, "cannot open"))?;
        let metadata = plain(file.metadata().map_err(RecordError::io(path, "cannot ask for its size"))?)?;
        let mut container = Container {
            path: path.to_owned(),
            file: BufReader::new(file),
            length: metadata.len(),
            offset: 0,
            crc: crc32fast::Hasher::new(),
            section: Section::Data,
        };
        if container.length < MAGIC.len() as u64 {
            return Err(not_mcap(format!("it ends at byte {}, within the signature", container.length)));
        }
        let magic: [u8; 8] = container.array()?;
        if magic != MAGIC {
            Err(not_mcap(format!("it begins with {magic:02x?}, not with {MAGIC:02x?}")))
        } else {
            Ok(container)
        }
    }

    /// Returns the file's name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of bytes read so far.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// Reads the next record. Must not be called after an end or an error.
    pub fn next(&mut self) -> Result<Next> {
        let (offset, left) = (self.offset, self.length - self.offset);
        let cut = |what: String| Ok(Next::End(Ending::Cut { offset, what }));
        if left < HEAD_BYTES {
            return cut(format!("the file stops {left} bytes into a record, before its footer"));
        }
        let crc_before = self.crc.clone();
        let [opcode] = self.array()?;
        let size = u64::from_le_bytes(self.array()?);
        let fault = |what: String| Err(RecordError::corrupt(&self.path, offset, what));
        if opcode == 0 {
            return fault("a record has opcode 0".into());
        }
        if size > MAX_RECORD_BYTES {
            return fault(format!("a record of {size} bytes, at most {MAX_RECORD_BYTES} are read"));
        }
        if size > left - HEAD_BYTES {
            return cut(format!("a record of {size} bytes begins, and {} follow", left - HEAD_BYTES));
        }
        let body = self.bytes(size)?;
        match opcode {
            op::DATA_END => self.end_of_data(offset, &body, crc_before)?,
            op::FOOTER => return self.footer(offset, &body, crc_before),
            _ => {}
        }
        Ok(Next::Record(RawRecord { offset, opcode, body }))
    }

    /// Checks the data section, and starts the summary's checksum.
    fn end_of_data(&mut self, offset: u64, body: &[u8], crc: crc32fast::Hasher) -> Result<()> {
        if !matches!(self.section, Section::Data) {
            return Err(RecordError::corrupt(&self.path, offset, "the data ends twice"));
        }
        self.section = Section::Summary;
        self.crc = crc32fast::Hasher::new();
        self.compare_crc(offset, body, 0, crc, "data")
    }

    /// Checks the summary, the footer and the signature behind it: the file's last bytes.
    fn footer(&mut self, offset: u64, body: &[u8], mut crc: crc32fast::Hasher) -> Result<Next> {
        if !matches!(self.section, Section::Summary) {
            return Err(RecordError::corrupt(&self.path, offset, "a footer without an end of data before it"));
        }
        // the summary's checksum covers the footer up to the checksum itself
        crc.update(&[op::FOOTER]);
        crc.update(&(body.len() as u64).to_le_bytes());
        crc.update(&body[..body.len().min(16)]);
        self.compare_crc(offset, body, 16, crc, "summary")?;
        let left = self.length - self.offset;
        if left < MAGIC.len() as u64 {
            return Ok(Next::End(Ending::Cut {
                offset: self.offset,
                what: format!("the file stops {left} bytes into its last signature"),
            }));
        }
        let at = self.offset;
        let magic: [u8; 8] = self.array()?;
        if magic != MAGIC {
            return Err(RecordError::corrupt(
                &self.path,
                at,
                format!("the file should end with {MAGIC:02x?}, not with {magic:02x?}"),
            ));
        }
        if self.offset != self.length {
            return Err(RecordError::corrupt(
                &self.path,
                self.offset,
                format!("{} bytes follow the end", self.length - self.offset),
            ));
        }
        Ok(Next::End(Ending::Complete))
    }

    /// Compares a checksum with the one stored as the last field of `body`, after `skip` bytes.
    /// Zero means that none was computed.
    fn compare_crc(&self, offset: u64, body: &[u8], skip: u64, crc: crc32fast::Hasher, what: &str) -> Result<()> {
        let fault = |what: String| RecordError::corrupt(&self.path, offset, what);
        let mut fields = Fields(body);
        fields.take(skip, what).map_err(fault)?;
        let stored = fields.u32("the checksum").map_err(fault)?;
        fields.end("the checksum").map_err(fault)?;
        let actual = crc.finalize();
        if stored != 0 && stored != actual {
            return Err(fault(format!("the {what}'s checksum is {actual:08x}, and should be {stored:08x}")));
        }
        Ok(())
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.file.read_exact(&mut bytes).map_err(RecordError::io(&self.path, "cannot read"))?;
        self.crc.update(&bytes);
        self.offset += N as u64;
        Ok(bytes)
    }

    /// Reads `size` bytes, which must be within the file's length.
    fn bytes(&mut self, size: u64) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        (&mut self.file).take(size).read_to_end(&mut bytes).map_err(RecordError::io(&self.path, "cannot read"))?;
        if bytes.len() as u64 != size {
            return Err(RecordError::corrupt(&self.path, self.offset, "the file became shorter while it was read"));
        }
        self.crc.update(&bytes);
        self.offset += size;
        Ok(bytes)
    }
}
