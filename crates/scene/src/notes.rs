//! Notes about files that are usable with changes, and about worlds that start with overlaps.

use tumble_core::{Visual, VisualGeometry, World};

/// Notes for the user: what was repaired or left out.
pub type Notes = Vec<String>;

/// Overlapping pairs that notes list by name.
const MAX_LISTED_OVERLAPS: usize = 8;

/// Returns notes about visual meshes that were to be drawn and could not be read. Reads no mesh
/// itself; [`VisualMesh::triangles`](tumble_core::VisualMesh::triangles) does.
pub fn visual_notes<'v>(visuals: impl IntoIterator<Item = &'v Visual>) -> Vec<String> {
    let mut notes = NoteList::default();
    for visual in visuals {
        if let VisualGeometry::Mesh(mesh) = &visual.geometry
            && let Some(why) = mesh.fault()
        {
            notes.add(format!("visual mesh {}", mesh.name()), format!("left out: {why}"));
        }
    }
    notes.take()
}

/// Returns notes about bodies that overlap at the current state by more than the drift tolerance of
/// contacts. Each step pushes such bodies apart. The deepest come first; beyond the first few they
/// are counted.
pub fn overlap_notes(world: &World) -> Vec<String> {
    let mut overlaps = world.overlapping_pairs(2.0 * world.settings().drift_tolerance);
    overlaps.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    let name = |id| world.name(id).unwrap_or_default();
    let line = |[a, b]: [&str; 2], depth: f64| match a == b {
        true => format!("links of {a} overlap by {depth:.2e} m at the start"),
        false => format!("{a} and {b} overlap by {depth:.2e} m at the start"),
    };
    let listed = overlaps.iter().take(MAX_LISTED_OVERLAPS).map(|o| line(o.objects.map(name), o.depth));
    let more = overlaps.len().saturating_sub(MAX_LISTED_OVERLAPS);
    listed.chain((more > 0).then(|| format!("{more} more pairs of bodies overlap at the start"))).collect()
}

/// Notes that are collected during reading. Equal notes about several subjects become one line.
#[derive(Default)]
pub(crate) struct NoteList {
    /// Subject and text.
    notes: Vec<(String, String)>,
}

impl NoteList {
    pub(crate) fn add(&mut self, subject: impl Into<String>, text: impl Into<String>) {
        self.notes.push((subject.into(), text.into()));
    }

    /// Returns one line for each different text, in the order of first appearance.
    pub(crate) fn take(&mut self) -> Vec<String> {
        let mut merged: Vec<(String, String, Vec<String>)> = Vec::new();
        for (subject, text) in self.notes.drain(..) {
            match merged.iter_mut().find(|(_, other, _)| *other == text) {
                Some((first, _, others)) if *first != subject && !others.contains(&subject) => others.push(subject),
                Some(_) => {}
                None => merged.push((subject, text, Vec::new())),
            }
        }
        let line = |(subject, text, others): &(String, String, Vec<String>)| match others.len() {
            0 => format!("{subject}: {text}"),
            more => format!("{subject} and {more} more: {text}"),
        };
        merged.iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::NoteList;

    #[test]
    fn equal_notes_are_merged() {
        let mut notes = NoteList::default();
        for (subject, text) in [("a", "open"), ("b", "flat"), ("c", "open"), ("c", "open"), ("d", "open")] {
            notes.add(subject, text);
        }
        assert_eq!(notes.take(), ["a and 2 more: open", "b: flat"]);
        assert!(notes.take().is_empty());
    }
}
