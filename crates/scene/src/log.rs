//! Where readers put the problems they find, so that one pass finds them all.

use std::cell::RefCell;
use std::ops::Range;

use crate::error::Problem;

/// Problems kept; more than these help nobody.
const KEPT_PROBLEMS: usize = 1000;
/// Characters of a value that a message shows.
const QUOTED_CHARS: usize = 48;

/// The problems found so far in one text.
pub(crate) struct Log<'a> {
    text: &'a str,
    folder: std::path::PathBuf,
    found: RefCell<Vec<(Range<usize>, String, String)>>,
}

impl<'a> Log<'a> {
    pub(crate) fn new(text: &'a str) -> Self {
        Log { text, folder: Default::default(), found: RefCell::new(Vec::new()) }
    }

    /// The same for a text whose file names are meant from this folder.
    pub(crate) fn in_folder(mut self, folder: &std::path::Path) -> Self {
        self.folder = folder.to_path_buf();
        self
    }

    /// The folder that file names of the text are meant from.
    pub(crate) fn folder(&self) -> &std::path::Path {
        &self.folder
    }

    /// Records that what stands at `span` is wrong as `message` says, and what is `wanted` there.
    pub(crate) fn report(&self, span: Range<usize>, message: impl Into<String>, wanted: impl Into<String>) {
        let mut found = self.found.borrow_mut();
        if found.len() < KEPT_PROBLEMS {
            found.push((span, message.into(), wanted.into()));
        }
    }

    /// How many problems there are.
    pub(crate) fn count(&self) -> usize {
        self.found.borrow().len()
    }

    /// Whether further problems would be dropped.
    pub(crate) fn is_full(&self) -> bool {
        self.count() >= KEPT_PROBLEMS
    }

    /// What stands at `span`, on one line and not too long.
    pub(crate) fn quote(&self, span: Range<usize>) -> String {
        let text = self.text.get(span).unwrap_or("").trim();
        let line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(QUOTED_CHARS + 1).collect();
        if line.chars().count() > QUOTED_CHARS {
            line.chars().take(QUOTED_CHARS - 3).chain("...".chars()).collect()
        } else {
            line
        }
    }

    /// The line of a byte of the text, from 1.
    pub(crate) fn line(&self, byte: usize) -> usize {
        let before = &self.text.as_bytes()[..byte.min(self.text.len())];
        1 + before.iter().filter(|&&b| b == b'\n').count()
    }

    /// The problems in the order of the text, with line and column.
    pub(crate) fn into_problems(self) -> Vec<Problem> {
        let mut found = self.found.into_inner();
        found.sort_by_key(|(span, ..)| (span.start, span.end));
        let (mut at, mut line, mut line_start) = (0, 1, 0);
        let mut problems = Vec::with_capacity(found.len());
        for (span, message, wanted) in found {
            let start = span.start.min(self.text.len());
            for (offset, byte) in self.text.as_bytes()[at..start].iter().enumerate() {
                if *byte == b'\n' {
                    (line, line_start) = (line + 1, at + offset + 1);
                }
            }
            at = start;
            let before = String::from_utf8_lossy(&self.text.as_bytes()[line_start..start]);
            problems.push(Problem { line, column: 1 + before.chars().count(), span, message, wanted });
        }
        problems
    }
}
