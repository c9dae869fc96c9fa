//! The files of an archive, with limits against archives that grow when they are read.

use super::CalibrationError;
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Largest number of files.
const MAX_FILES: usize = 1024;
/// Largest file and largest sum of all files that are read, bytes after decompression.
const MAX_FILE: u64 = 64 << 20;
const MAX_TOTAL: u64 = 512 << 20;
/// Largest description, bytes.
const MAX_DESCRIPTION: u64 = 4 << 20;

/// Files that are read one by one.
pub(super) struct Archive<'a> {
    zip: Option<ZipArchive<Cursor<&'a [u8]>>>,
    /// Bytes that may still be read.
    left: u64,
}

impl<'a> Archive<'a> {
    /// No files at all.
    pub fn none() -> Archive<'a> {
        Archive { zip: None, left: 0 }
    }

    /// Reads the list of files.
    pub fn open(bytes: &'a [u8]) -> Result<Archive<'a>, CalibrationError> {
        let fail = |reason: String| CalibrationError::new("the archive", reason);
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|e| fail(format!("is no zip archive: {e}")))?;
        if zip.len() > MAX_FILES {
            return Err(fail(format!("has {} files, expected at most {MAX_FILES}", zip.len())));
        }
        Ok(Archive { zip: Some(zip), left: MAX_TOTAL })
    }

    /// Returns name and bytes of the description: `mpcdi.xml`, or the only XML file.
    pub fn description(&mut self) -> Result<(String, Vec<u8>), CalibrationError> {
        // names that are no text are those of no file here
        let names = self.zip.iter().flat_map(|zip| zip.file_names());
        let names: Vec<String> = names.filter_map(|name| Some(name.ok()?.into_owned())).collect();
        let xml: Vec<&String> = names.iter().filter(|name| name.to_ascii_lowercase().ends_with(".xml")).collect();
        let named = xml.iter().find(|name| name.eq_ignore_ascii_case("mpcdi.xml"));
        let name = match (named, xml.as_slice()) {
            (Some(name), _) => (*name).clone(),
            (None, [only]) => (*only).clone(),
            _ => return Err(CalibrationError::new("the archive", "has no mpcdi.xml")),
        };
        let bytes = self.read(&name, MAX_DESCRIPTION)?;
        Ok((name, bytes))
    }

    /// Returns the bytes of a file.
    pub fn file(&mut self, name: &str) -> Result<Vec<u8>, CalibrationError> {
        self.read(name, MAX_FILE)
    }

    fn read(&mut self, name: &str, most: u64) -> Result<Vec<u8>, CalibrationError> {
        let fail = |reason: String| CalibrationError::new(name, reason);
        let zip = self.zip.as_mut().ok_or_else(|| fail("there are no files beside the description".into()))?;
        let file = zip.by_name(name).map_err(|e| fail(format!("cannot be read from the archive: {e}")))?;
        let most = most.min(self.left);
        let mut bytes = Vec::new();
        // the size in the archive may be wrong: what counts is what comes out
        file.take(most + 1).read_to_end(&mut bytes).map_err(|e| fail(format!("is damaged: {e}")))?;
        if bytes.len() as u64 > most {
            return Err(fail(format!("has more than {most} bytes")));
        }
        self.left -= bytes.len() as u64;
        Ok(bytes)
    }
}
