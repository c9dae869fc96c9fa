//! The small messages: payloads of JOIN, REFUSED, READY, PRESENTED and BEAT. PRESENT, REJOIN, RESYNC, END and LEAVE have none.

use super::wire::{ByteReader, Hash, MessageError, put_name};

/// Most bytes of a refusal's text.
const MAX_TEXT: usize = 1024;

/// A facet asks to be let in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Join {
    /// BLAKE3 of the scene file and of what it names, by which both know that they mean the same scene.
    pub scene: [u8; 32],
    /// The facet's name in the cave file.
    pub name: String,
    /// Whether it wants exact messages (a replica) and not poses.
    pub exact: bool,
}

impl Join {
    /// Appends it: 32, 64, and 1 byte.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.scene);
        put_name(out, &self.name);
        out.push(self.exact as u8);
    }

    /// Reads it.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &[u8]) -> Result<Join, MessageError> {
        let mut rest = ByteReader(payload);
        let (scene, name) = (rest.array()?, rest.name()?.to_owned());
        let exact = match rest.u8()? {
            exact @ (0 | 1) => exact == 1,
            _ => return Err(MessageError::Malformed("a flag that there is not")),
        };
        rest.end()?;
        Ok(Join { scene, name, exact })
    }
}

/// Why a facet is not let in, in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal(pub String);

impl Refusal {
    /// Appends it.
    pub fn write(&self, out: &mut Vec<u8>) {
        let end = (0..=self.0.len().min(MAX_TEXT)).rev().find(|&n| self.0.is_char_boundary(n)).unwrap_or(0);
        out.extend(&self.0.as_bytes()[..end]);
    }

    /// Reads it; control characters become spaces, since it will be printed.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &[u8]) -> Result<Refusal, MessageError> {
        let text = std::str::from_utf8(payload).ok().filter(|t| t.len() <= MAX_TEXT);
        let text = text.ok_or(MessageError::Malformed("a refusal that is no short text"))?;
        Ok(Refusal(text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()))
    }
}

/// READY and PRESENTED: what a facet has drawn or shown. The frame is in the header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameAck {
    /// Hash of what it applied and drew.
    pub hash: Hash,
    /// First 16 bytes of the BLAKE3 of the picture's pixels; zeros where there are none (null rendering), and in READY.
    pub image: Hash,
    /// READY: from the arrival of the state to the end of drawing. PRESENTED: from there to being shown. µs, saturating.
    pub took_us: u32,
    /// From when the facet sent the newest of its inputs that the picture is the first to show, to showing it, µs, saturating; `None` in READY, and where there is none.
    pub input_us: Option<u32>,
    /// When the state (READY) or PRESENT (PRESENTED; in `latest` the state) came, µs by the facet's own clock; `None`: something else stood for it.
    pub received_us: Option<u64>,
    /// When the frame was drawn (READY) or shown (PRESENTED), µs by the facet's own clock.
    pub completed_us: u64,
}

impl FrameAck {
    /// Appends it: 56 bytes. What there is not travels as the largest number.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.hash);
        out.extend(self.image);
        out.extend(self.took_us.to_le_bytes());
        out.extend(self.input_us.unwrap_or(u32::MAX).to_le_bytes());
        out.extend(self.received_us.unwrap_or(u64::MAX).to_le_bytes());
        out.extend(self.completed_us.to_le_bytes());
    }

    /// Reads it.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &[u8]) -> Result<FrameAck, MessageError> {
        let mut rest = ByteReader(payload);
        let (hash, image, took_us) = (rest.array()?, rest.array()?, rest.u32()?);
        let (input_us, received_us, completed_us) =
            (Some(rest.u32()?).filter(|us| *us < u32::MAX), Some(rest.u64()?).filter(|us| *us < u64::MAX), rest.u64()?);
        let done = FrameAck { hash, image, took_us, input_us, received_us, completed_us };
        rest.end()?;
        Ok(done)
    }
}

/// What a facet counted; its beat carries it to the server. Counts wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FacetCounts {
    /// Frames shown.
    pub shown: u64,
    /// Frames that never came, or were skipped for a newer one.
    pub missing: u64,
    /// Messages that came again.
    pub duplicate: u64,
    /// Messages of an earlier frame, run or joining.
    pub stale: u64,
    /// Messages whose hash did not fit.
    pub torn: u64,
    /// Frames that came before their list of objects, or were to be shown before they were drawn.
    pub early: u64,
    /// Messages refused for any other reason.
    pub refused: u64,
    /// Times that the server was lost.
    pub lost: u64,
}

impl FacetCounts {
    fn fields(&mut self) -> [&mut u64; 8] {
        [
            &mut self.shown,
            &mut self.missing,
            &mut self.duplicate,
            &mut self.stale,
            &mut self.torn,
            &mut self.early,
            &mut self.refused,
            &mut self.lost,
        ]
    }

    /// Appends them: 64 bytes.
    pub fn write(mut self, out: &mut Vec<u8>) {
        self.fields().iter().for_each(|n| out.extend(n.to_le_bytes()));
    }

    /// Reads them.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &[u8]) -> Result<FacetCounts, MessageError> {
        let (mut rest, mut counts) = (ByteReader(payload), FacetCounts::default());
        for n in counts.fields() {
            *n = rest.u64()?;
        }
        rest.end()?;
        Ok(counts)
    }
}

/// Adds one, wrapping.
pub(crate) fn increment(n: &mut u64) {
    *n = n.wrapping_add(1);
}
