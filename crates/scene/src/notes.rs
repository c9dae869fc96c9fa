//! What is said aloud of files that could be used, but not quite as they are.

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
