//! Little-endian fields of a slice. A length is checked against the slice before anything is
//! allocated.

use std::collections::BTreeMap;

/// Description of a fault, for an error message.
pub(crate) type Problem = String;

/// The unread rest of a record.
pub(crate) struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    /// Returns the next `n` bytes.
    pub fn take(&mut self, n: u64, what: &str) -> Result<&'a [u8], Problem> {
        let have = self.0.len();
        let n = usize::try_from(n)
            .ok()
            .filter(|n| *n <= have)
            .ok_or_else(|| format!("{what} takes {n} bytes, but {have} are left"))?;
        let (head, rest) = self.0.split_at(n);
        self.0 = rest;
        Ok(head)
    }

    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Problem> {
        let bytes = self.take(N as u64, what)?;
        bytes.try_into().map_err(|_| format!("{what} is cut"))
    }

    /// Reads a `u8`.
    pub fn u8(&mut self, what: &str) -> Result<u8, Problem> {
        self.array::<1>(what).map(|[b]| b)
    }

    /// Reads a `u16`.
    pub fn u16(&mut self, what: &str) -> Result<u16, Problem> {
        self.array(what).map(u16::from_le_bytes)
    }

    /// Reads a `u32`.
    pub fn u32(&mut self, what: &str) -> Result<u32, Problem> {
        self.array(what).map(u32::from_le_bytes)
    }

    /// Reads a `u64`.
    pub fn u64(&mut self, what: &str) -> Result<u64, Problem> {
        self.array(what).map(u64::from_le_bytes)
    }

    /// Reads bytes after their `u32` length.
    pub fn sized(&mut self, what: &str) -> Result<&'a [u8], Problem> {
        let n = self.u32(what)?;
        self.take(n.into(), what)
    }

    /// Reads a string after its `u32` length.
    pub fn string(&mut self, what: &str) -> Result<&'a str, Problem> {
        std::str::from_utf8(self.sized(what)?).map_err(|e| format!("{what} is not UTF-8: {e}"))
    }

    /// Reads a map of strings after its `u32` length in bytes.
    pub fn map(&mut self, what: &str) -> Result<BTreeMap<String, String>, Problem> {
        let mut inner = Fields(self.sized(what)?);
        let mut map = BTreeMap::new();
        while !inner.0.is_empty() {
            let key = inner.string(what)?.to_owned();
            map.insert(key, inner.string(what)?.to_owned());
        }
        Ok(map)
    }

    /// Refuses unread bytes.
    pub fn end(&self, what: &str) -> Result<(), Problem> {
        if self.0.is_empty() { Ok(()) } else { Err(format!("{} bytes too many after {what}", self.0.len())) }
    }
}
