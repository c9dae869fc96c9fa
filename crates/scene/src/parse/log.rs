//! Collects the problems of one text, so that one pass finds them all.

use std::cell::RefCell;
use std::ops::Range;

use crate::parse::problem::Problem;

/// Largest number of problems kept.
const MAX_PROBLEMS: usize = 1000;
/// Characters of a value that a message shows.
const MAX_QUOTED_CHARS: usize = 48;

/// The problems found so far in one text.
pub(crate) struct Log<'a> {
    text: &'a str,
    folder: std::path::PathBuf,
    file: String,
    found: RefCell<Vec<(Range<usize>, String, String)>>,
}

impl<'a> Log<'a> {
    pub(crate) fn new(text: &'a str) -> Self {
        Log { text, folder: Default::default(), file: String::new(), found: RefCell::new(Vec::new()) }
    }

    /// Sets the folder that file names in the text are relative to.
    pub(crate) fn in_folder(mut self, folder: &std::path::Path) -> Self {
        self.folder = folder.to_path_buf();
        self
    }

    /// Sets the name of the file as notes show it.
    pub(crate) fn named(mut self, file: &str) -> Self {
        self.file = file.to_owned();
        self
    }

    /// Returns the name of the file; empty if none was set.
    pub(crate) fn file(&self) -> &str {
        &self.file
    }

    /// Returns the whole text.
    pub(crate) fn text(&self) -> &'a str {
        self.text
    }

    /// Returns the folder that file names in the text are relative to.
    pub(crate) fn folder(&self) -> &std::path::Path {
        &self.folder
    }

    /// Records that the text at `span` is wrong as `message` says, and the expected value.
    pub(crate) fn report(&self, span: Range<usize>, message: impl Into<String>, expected: impl Into<String>) {
        let mut found = self.found.borrow_mut();
        if found.len() < MAX_PROBLEMS {
            found.push((span, message.into(), expected.into()));
        }
    }

    /// Returns the number of problems.
    pub(crate) fn count(&self) -> usize {
        self.found.borrow().len()
    }

    /// Returns whether further problems would be dropped.
    pub(crate) fn is_full(&self) -> bool {
        self.count() >= MAX_PROBLEMS
    }

    /// Returns the text at `span` on one line, truncated if it is long.
    pub(crate) fn quote(&self, span: Range<usize>) -> String {
        let text = self.text.get(span).unwrap_or("").trim();
        let line: String =
            text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(MAX_QUOTED_CHARS + 1).collect();
        if line.chars().count() > MAX_QUOTED_CHARS {
            line.chars().take(MAX_QUOTED_CHARS - 3).chain("...".chars()).collect()
        } else {
            line
        }
    }

    /// Returns the line of a byte of the text, from 1.
    pub(crate) fn line(&self, byte: usize) -> usize {
        let before = &self.text.as_bytes()[..byte.min(self.text.len())];
        1 + before.iter().filter(|&&b| b == b'\n').count()
    }

    /// Returns the problems in the order of the text, with line and column.
    pub(crate) fn into_problems(self) -> Vec<Problem> {
        let mut found = self.found.into_inner();
        found.sort_by_key(|(span, ..)| (span.start, span.end));
        let (mut at, mut line, mut line_start) = (0, 1, 0);
        let mut problems = Vec::with_capacity(found.len());
        for (span, message, expected) in found {
            let start = span.start.min(self.text.len());
            for (offset, byte) in self.text.as_bytes()[at..start].iter().enumerate() {
                if *byte == b'\n' {
                    (line, line_start) = (line + 1, at + offset + 1);
                }
            }
            at = start;
            let before = String::from_utf8_lossy(&self.text.as_bytes()[line_start..start]);
            problems.push(Problem { line, column: 1 + before.chars().count(), span, message, expected });
        }
        problems
    }
}
