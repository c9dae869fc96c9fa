//! Problems of a text: one line each, or a report with the lines of the file.

use std::fmt;
use std::ops::Range;

use ariadne::{CharSet, Config, IndexType, Label, Report, ReportKind, Source};

/// Problems that are shown in full; the rest are counted.
const MAX_SHOWN_PROBLEMS: usize = 40;

/// Longest line in bytes that a report shows.
const MAX_DRAWN_LINE_BYTES: usize = 400;

/// A text with problems.
#[derive(Debug)]
pub struct Invalid {
    /// The name of the file as messages show it.
    pub file: String,
    /// The whole text.
    pub text: String,
    /// At least one, in the order of the file.
    pub problems: Vec<Problem>,
}

/// A problem at one place of a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1, in characters.
    pub column: usize,
    /// The bytes of the text that are wrong.
    pub span: Range<usize>,
    /// The fault, with the value.
    pub message: String,
    /// The expected value.
    pub expected: String,
}

impl fmt::Display for Invalid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().take(MAX_SHOWN_PROBLEMS).enumerate() {
            let Problem { line, column, message, expected, .. } = problem;
            let newline = if index == 0 { "" } else { "\n" };
            write!(f, "{newline}{}:{line}:{column}: {message}; {expected}", self.file)?;
        }
        match self.problems.len().saturating_sub(MAX_SHOWN_PROBLEMS) {
            0 => Ok(()),
            more => write!(f, "\n{}: and {more} more", self.file),
        }
    }
}

impl Invalid {
    /// Returns all problems, each with its line of the file.
    pub(crate) fn report(&self, color: bool) -> String {
        let source = Source::from(self.text.as_str());
        let mut out = String::new();
        for problem in self.problems.iter().take(MAX_SHOWN_PROBLEMS) {
            out += &self.drawn(problem, &source, color).unwrap_or_else(|| self.plain(problem));
        }
        let shown = self.problems.len().min(MAX_SHOWN_PROBLEMS);
        let (count, word) = (self.problems.len(), if self.problems.len() == 1 { "error" } else { "errors" });
        out += &format!("{}: {count} {word}", self.file);
        if shown < count {
            out += &format!(", the first {shown} shown");
        }
        out.push('\n');
        out
    }

    fn plain(&self, problem: &Problem) -> String {
        let Problem { line, column, message, expected, .. } = problem;
        format!("error: {message}\n  {}:{line}:{column}: {expected}\n", self.file)
    }

    /// Returns the problem with its line of the file; `None` if the line is too long to show.
    fn drawn(&self, problem: &Problem, source: &Source<&str>, color: bool) -> Option<String> {
        let text = self.text.as_str();
        let start = floor_char(text, problem.span.start);
        let line_end = text[start..].find('\n').map_or(text.len(), |at| start + at);
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        if line_end - line_start > MAX_DRAWN_LINE_BYTES {
            return None;
        }
        // A span over several lines is marked on its first line.
        let end = floor_char(text, problem.span.end.min(line_end)).max(start);
        let name = self.file.as_str();
        let config = Config::default().with_color(color).with_index_type(IndexType::Byte).with_char_set(CharSet::Ascii);
        let label = Label::new((name, start..end)).with_message(&problem.expected).with_color(ariadne::Color::Red);
        let mut bytes = Vec::new();
        Report::build(ReportKind::Error, (name, start..end))
            .with_config(config)
            .with_message(&problem.message)
            .with_label(label)
            .finish()
            .write((name, source), &mut bytes)
            .ok()?;
        let drawn = String::from_utf8(bytes).ok()?.replacen("Error", "error", 1);
        Some(drawn.lines().map(|line| line.trim_end().to_owned() + "\n").collect())
    }
}

/// Returns the largest character boundary of `text` that is at most `at`.
fn floor_char(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}
