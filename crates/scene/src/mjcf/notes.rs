//! Notes about parts of a model that are left out, each with the file, the line and the element of
//! its first occurrence.

use std::cell::RefCell;
use std::collections::BTreeMap;

use crate::xml::Element;

/// Notes that are collected during reading. Equal notes about several elements become one line.
#[derive(Default)]
pub(super) struct Ledger {
    found: RefCell<Found>,
}

#[derive(Default)]
struct Found {
    /// Index in `notes` of each text.
    index: BTreeMap<String, usize>,
    /// Place and element, text, number of further elements.
    notes: Vec<(String, String, usize)>,
}

impl Ledger {
    /// Notes `text` about an element.
    pub(super) fn add(&self, element: &Element<'_, '_>, text: impl Into<String>) {
        let (text, mut found) = (text.into(), self.found.borrow_mut());
        match found.index.get(&text).copied() {
            Some(at) => found.notes[at].2 += 1,
            None => {
                let at = found.notes.len();
                found.notes.push((format!("{}: {}", element.place(), element.what()), text.clone(), 0));
                found.index.insert(text, at);
            }
        }
    }

    /// Returns one line for each different text, in the order of first appearance.
    pub(super) fn take(&self) -> Vec<String> {
        let line = |(subject, text, more): (String, String, usize)| match more {
            0 => format!("{subject}: {text}"),
            more => format!("{subject} and {more} more: {text}"),
        };
        std::mem::take(&mut *self.found.borrow_mut()).notes.into_iter().map(line).collect()
    }
}
