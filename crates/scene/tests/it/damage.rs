//! Damaged texts: words replaced, pieces lost or repeated, ends cut off.

use proptest::prelude::*;
use proptest::sample::Index;

/// A place in a text, the number of a word, and what happens there.
type Edit = (Index, Index, usize);

/// One to four edits.
pub(crate) fn edits() -> impl Strategy<Value = Vec<Edit>> {
    prop::collection::vec((any::<Index>(), any::<Index>(), 0..3usize), 1..5)
}

/// Returns the text of an XML file with a piece between two marks replaced by a word, lost or repeated, for each edit.
pub(crate) fn damaged(text: &str, edits: Vec<Edit>, words: &[&str]) -> String {
    let mut text = text.to_owned();
    for (at, word, kind) in edits {
        let ends: Vec<usize> = text.match_indices(['"', ' ', '<', '>', '=']).map(|(k, _)| k).collect();
        if ends.len() < 2 {
            break;
        }
        let from = at.index(ends.len() - 1);
        let range = ends[from] + 1..ends[from + 1];
        match kind {
            0 => text.replace_range(range, words[word.index(words.len())]),
            1 => text.replace_range(range, ""),
            _ => {
                let piece = text[range].to_owned();
                text.insert_str(ends[from] + 1, &piece);
            }
        }
    }
    text
}

/// Returns beginnings of a text, one for each `step` bytes.
pub(crate) fn beginnings(text: &str, step: usize) -> impl Iterator<Item = &str> {
    (0..text.len()).step_by(step).filter(|end| text.is_char_boundary(*end)).map(|end| &text[..end])
}
