//! Payloads of the small messages: JOIN, REFUSED, READY, PRESENTED and HEARTBEAT. PRESENT, REJOIN,
//! RESYNC, END and LEAVE have none.

use super::wire::{ByteReader, Hash, MessageError, put_name};

/// Maximum length of a refusal's text, bytes.
const MAX_TEXT: usize = 1024;

/// Content of the frames that a facet receives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Content {
    /// Poses, in the precision of a picture.
    #[default]
    Poses,
    /// Exact messages of the objects that have them: for a replica.
    Exact,
    /// Inputs: the facet steps the world by itself.
    Inputs,
}

impl Content {
    /// Every content, in the order of their codes.
    pub const ALL: [Content; 3] = [Content::Poses, Content::Exact, Content::Inputs];
}

/// Request of a facet to join.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Join {
    /// BLAKE3 hash of the scene file and the files that it names. Equal hashes mean equal scenes. With
    /// [`Content::Inputs`] the hash covers constants and settings of the world too.
    pub scene: [u8; 32],
    /// The facet's name in the cave file.
    pub name: String,
    /// Content of its frames.
    pub content: Content,
}

impl Join {
    /// Appends the payload: hash, name, content.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.scene);
        put_name(out, &self.name);
        out.push(self.content as u8);
    }

    /// Reads the payload.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &[u8]) -> Result<Join, MessageError> {
        let mut rest = ByteReader(payload);
        let (scene, name) = (rest.array()?, rest.name()?.to_owned());
        let content = *Content::ALL.get(rest.u8()? as usize).ok_or(MessageError::Malformed("an unknown content"))?;
        rest.end()?;
        Ok(Join { scene, name, content })
    }
}

/// Text that says why a facet may not join.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal(pub String);

impl Refusal {
    /// Appends the payload.
    pub fn write(&self, out: &mut Vec<u8>) {
        let end = (0..=self.0.len().min(MAX_TEXT)).rev().find(|&n| self.0.is_char_boundary(n)).unwrap_or(0);
        out.extend(&self.0.as_bytes()[..end]);
    }

    /// Reads the payload. Control characters become spaces because the text is printed.
    ///
    /// # Errors
    /// [`MessageError::Malformed`].
    pub fn read(payload: &[u8]) -> Result<Refusal, MessageError> {
        let text = std::str::from_utf8(payload).ok().filter(|t| t.len() <= MAX_TEXT);
        let text = text.ok_or(MessageError::Malformed("a refusal text that is too long or not UTF-8"))?;
        Ok(Refusal(text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()))
    }
}

/// Payload of READY and PRESENTED: a facet has drawn or shown the frame in the header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameAck {
    /// Hash of the state that the facet applied and drew.
    pub hash: Hash,
    /// First 16 bytes of the BLAKE3 hash of the picture's pixels. Zeros without a picture, and in
    /// READY.
    pub image: Hash,
    /// READY: time from the arrival of the state to the end of drawing. PRESENTED: time from there
    /// to the presentation. In µs, saturating.
    pub took_us: u32,
    /// Time from sending the newest input of this facet that the picture is the first to show, to
    /// its presentation, µs, saturating. `None` in READY, and if there is no such input.
    pub input_us: Option<u32>,
    /// Arrival of the state (READY), of PRESENT (PRESENTED) or, in `latest`, of the state, µs by
    /// the facet's clock. `None` if another message took its place.
    pub received_us: Option<u64>,
    /// Time at which the frame was drawn (READY) or shown (PRESENTED), µs by the facet's clock.
    pub completed_us: u64,
}

impl FrameAck {
    /// Appends the payload, 56 bytes. An absent value is encoded as the largest number.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.hash);
        out.extend(self.image);
        out.extend(self.took_us.to_le_bytes());
        out.extend(self.input_us.unwrap_or(u32::MAX).to_le_bytes());
        out.extend(self.received_us.unwrap_or(u64::MAX).to_le_bytes());
        out.extend(self.completed_us.to_le_bytes());
    }

    /// Reads the payload.
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

/// Counts of a facet, which its heartbeats carry to the server. They wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FacetCounts {
    /// Frames shown.
    pub shown: u64,
    /// Frames that never arrived, or were skipped for a newer one.
    pub missing: u64,
    /// Messages received more than once.
    pub duplicate: u64,
    /// Messages of an earlier frame, run or join.
    pub stale: u64,
    /// Messages with a wrong hash.
    pub torn: u64,
    /// Frames that arrived before their object table, and PRESENT messages for a frame not drawn
    /// yet.
    pub early: u64,
    /// Messages refused for any other reason.
    pub refused: u64,
    /// Times that the connection to the server was lost.
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

    /// Appends the counts, 64 bytes.
    pub fn write(mut self, out: &mut Vec<u8>) {
        self.fields().iter().for_each(|n| out.extend(n.to_le_bytes()));
    }

    /// Reads the counts.
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
