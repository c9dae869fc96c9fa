//! What is said aloud of files that could be used, but not quite as they are, and of worlds that start in an unlikely way.

use tumble_core::{Visual, VisualGeometry, World};

/// Pairs of bodies that overlap told by name.
const TOLD_OVERLAPS: usize = 8;

/// Notes of the visual meshes that somebody wanted to draw and that could not be read. Reads none ([`VisualMesh::triangles`](tumble_core::VisualMesh::triangles)
/// does).
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

/// Notes of the bodies that overlap as the world stands, by more than contacts may drift: each step pushes them apart. The deepest come first; of many the
/// rest is counted.
pub fn overlap_notes(world: &World) -> Vec<String> {
    let mut overlaps = world.overlaps(2.0 * world.settings().drift_tolerance);
    overlaps.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    let name = |id| world.object(id).map_or("", |object| object.name());
    let line = |[a, b]: [&str; 2], depth: f64| match a == b {
        true => format!("links of {a} overlap by {depth:.2e} m at the start"),
        false => format!("{a} and {b} overlap by {depth:.2e} m at the start"),
    };
    let told = overlaps.iter().take(TOLD_OVERLAPS).map(|o| line(o.objects.map(name), o.depth));
    let more = overlaps.len().saturating_sub(TOLD_OVERLAPS);
    told.chain((more > 0).then(|| format!("{more} more pairs of bodies overlap at the start"))).collect()
}

/// Notes as they come up; those that say the same of several are told together.
#[derive(Default)]
pub(crate) struct NoteList {
    /// Of whom, and what.
    notes: Vec<(String, String)>,
}

impl NoteList {
    pub(crate) fn add(&mut self, who: impl Into<String>, what: impl Into<String>) {
        self.notes.push((who.into(), what.into()));
    }

    /// One line for each different thing said, in the order of the first of each.
    pub(crate) fn take(&mut self) -> Vec<String> {
        let mut told: Vec<(String, String, Vec<String>)> = Vec::new();
        for (who, what) in self.notes.drain(..) {
            match told.iter_mut().find(|(_, other, _)| *other == what) {
                Some((first, _, others)) if *first != who && !others.contains(&who) => others.push(who),
                Some(_) => {}
                None => told.push((who, what, Vec::new())),
            }
        }
        let line = |(who, what, others): &(String, String, Vec<String>)| match others.len() {
            0 => format!("{who}: {what}"),
            more => format!("{who} and {more} more: {what}"),
        };
        told.iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::NoteList;

    #[test]
    fn the_same_is_told_once() {
        let mut notes = NoteList::default();
        for (who, what) in [("a", "open"), ("b", "flat"), ("c", "open"), ("c", "open"), ("d", "open")] {
            notes.add(who, what);
        }
        assert_eq!(notes.take(), ["a and 2 more: open", "b: flat"]);
        assert!(notes.take().is_empty());
    }
}
