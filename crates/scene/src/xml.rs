//! Elements and attributes of an XML file. All problems are recorded, as in
//! [`Fields`](crate::parse::fields::Fields) for TOML.

use std::collections::BTreeMap;
use std::ops::Range;

use roxmltree::{Document, Node, ParsingOptions};

use crate::parse::bound::Bound;
use crate::parse::log::Log;

/// Largest number of nodes of a file.
pub(crate) const MAX_NODES: u32 = 2_000_000;
/// Largest magnitude of a number. Limits beyond it count as no limit.
pub(crate) const MAX_MAGNITUDE: f64 = 1e12;

/// An element that is being read.
#[derive(Clone, Copy)]
pub(crate) struct Element<'a, 'd> {
    pub(crate) log: &'d Log<'d>,
    node: Node<'a, 'd>,
}

/// Parses an XML text. Returns `None`, with the problem recorded, if it is not XML. `expected` names
/// the format and its outermost element.
pub(crate) fn parse<'d>(log: &Log<'_>, text: &'d str, expected: &str) -> Option<Document<'d>> {
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options)
        .map_err(|error| {
            let place = error.pos();
            let at = byte_of(text, place.row as usize, place.col as usize);
            let end = matches!(error, roxmltree::Error::UnclosedRootNode | roxmltree::Error::UnexpectedEndOfStream);
            let message = error.to_string();
            let words = message.strip_suffix(&format!(" at {place}")).unwrap_or(&message);
            let at = if end { text.len() } else { at };
            log.report(at..at, format!("XML: {words}"), format!("expected {expected}"));
        })
        .ok()
}

/// Returns the byte at a line and a column, both from 1, columns in characters.
fn byte_of(text: &str, line: usize, column: usize) -> usize {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    let rest = text.get(start..).unwrap_or("");
    start + rest.char_indices().nth(column.saturating_sub(1)).map_or(rest.len(), |(at, _)| at)
}

impl<'a, 'd> Element<'a, 'd> {
    pub(crate) fn new(log: &'d Log<'d>, node: Node<'a, 'd>) -> Self {
        Element { log, node }
    }

    /// Returns the parser's node.
    pub(crate) fn node(&self) -> Node<'a, 'd> {
        self.node
    }

    /// Returns its tag.
    pub(crate) fn tag(&self) -> &'a str {
        self.node.tag_name().name()
    }

    /// Returns the place of `<tag`.
    pub(crate) fn span(&self) -> Range<usize> {
        let start = self.node.range().start;
        start..start + 1 + self.tag().len()
    }

    /// Returns the element's name in messages: `link "base"`, `the origin of joint "j"`.
    pub(crate) fn what(&self) -> String {
        if let Some(name) = self.node.attribute("name") {
            return format!("{} \"{}\"", self.tag(), shortened(name));
        }
        match self.node.parent().filter(|p| p.is_element() && p.parent_element().is_some()) {
            Some(parent) => format!("the {} of {}", self.tag(), Element { node: parent, ..*self }.what()),
            None => format!("<{}>", self.tag()),
        }
    }

    /// Records a problem with the element.
    pub(crate) fn problem(&self, message: impl std::fmt::Display, expected: impl Into<String>) {
        self.log.report(self.span(), format!("{} {message}", self.what()), expected);
    }

    /// Records that the value of an attribute is wrong.
    pub(crate) fn wrong(&self, name: &str, expected: impl std::fmt::Display) {
        let span = self.node.attribute_node(name).map_or(self.span(), |a| a.range_value());
        let message = format!("`{name}` of {} is \"{}\"", self.what(), self.log.quote(span.clone()));
        self.log.report(span, message, format!("expected {expected}"));
    }

    /// Returns the children with that tag, in the order of the file.
    pub(crate) fn children(&self, tag: &'static str) -> impl Iterator<Item = Element<'a, 'd>> + use<'a, 'd> {
        let log = self.log;
        self.node.children().filter(move |n| n.has_tag_name(tag)).map(move |node| Element { log, node })
    }

    /// Returns the first child with that tag.
    pub(crate) fn child(&self, tag: &'static str) -> Option<Element<'a, 'd>> {
        self.children(tag).next()
    }

    /// Returns the only child with that tag. Its absence is a problem.
    pub(crate) fn required(&self, tag: &'static str, expected: &str) -> Option<Element<'a, 'd>> {
        let child = self.child(tag);
        if child.is_none() {
            self.problem(format_args!("has no <{tag}>"), format!("expected {expected}"));
        }
        child
    }

    /// Returns between one and `most` numbers separated by white space, if present and valid.
    pub(crate) fn list(&self, name: &str, most: usize, bound: Bound) -> Option<Vec<f64>> {
        let words: Vec<&str> = self.text(name)?.split_whitespace().take(most + 1).collect();
        let numbers: Option<Vec<f64>> = words.iter().map(|w| w.parse().ok().filter(|x| bound.holds(*x))).collect();
        let numbers = numbers.filter(|numbers| (1..=most).contains(&numbers.len()));
        if numbers.is_none() {
            self.wrong(name, format_args!("1 to {most} numbers separated by spaces; each {}", bound.expected()));
        }
        numbers
    }

    /// Returns the meaning of a word, if present and valid.
    pub(crate) fn word<T: Copy>(&self, name: &str, words: &[(&'static str, T)]) -> Option<T> {
        let typed = self.text(name)?.trim();
        let found = words.iter().find(|(word, _)| *word == typed).map(|(_, meaning)| *meaning);
        if found.is_none() {
            self.wrong(name, crate::parse::suggest::listed(words.iter().map(|(word, _)| *word), "or"));
        }
        found
    }

    /// Returns the file and the line of the element.
    pub(crate) fn place(&self) -> String {
        format!("{}:{}", self.log.file(), self.log.line(self.node.range().start))
    }

    /// Returns the first child element.
    pub(crate) fn first(&self) -> Option<Element<'a, 'd>> {
        self.node.children().find(Node::is_element).map(|node| Element { log: self.log, node })
    }

    /// Returns an attribute, if present.
    pub(crate) fn text(&self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    /// Returns an attribute. Its absence is a problem.
    pub(crate) fn required_text(&self, name: &str, expected: &str) -> Option<&'a str> {
        let text = self.text(name);
        if text.is_none() {
            self.problem(format_args!("has no `{name}`"), format!("expected {expected}"));
        }
        text
    }

    /// Returns a number in `bound`, if present and valid.
    pub(crate) fn number(&self, name: &str, bound: Bound) -> Option<f64> {
        let number = self.text(name)?.trim().parse().ok().filter(|x| bound.holds(*x));
        if number.is_none() {
            self.wrong(name, bound.expected());
        }
        number
    }

    /// Returns a number in `bound`. Its absence is a problem. The result is not finite if it is
    /// wrong.
    pub(crate) fn required_number(&self, name: &str, bound: Bound) -> f64 {
        self.required_text(name, bound.expected()).and_then(|_| self.number(name, bound)).unwrap_or(f64::NAN)
    }

    /// Returns one end of a limit: a number, or infinity if its magnitude is beyond 1e12.
    pub(crate) fn open_number(&self, name: &str) -> Option<f64> {
        let number = self.text(name)?.trim().parse().ok().filter(|x: &f64| !x.is_nan());
        match number {
            Some(x) if x.abs() > MAX_MAGNITUDE => Some(f64::INFINITY.copysign(x)),
            Some(x) => Some(x),
            None => {
                self.wrong(name, "a number");
                None
            }
        }
    }

    /// Returns `N` numbers separated by white space, if present.
    pub(crate) fn numbers<const N: usize>(&self, name: &str, bound: Bound) -> Option<[f64; N]> {
        let numbers: Option<Vec<f64>> = self.text(name)?.split_whitespace().map(|word| word.parse().ok()).collect();
        let array = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        if !array.is_some_and(|a| a.iter().all(|x| bound.holds(*x))) {
            self.wrong(name, format_args!("{N} numbers separated by spaces; each {}", bound.expected()));
            return Some([f64::NAN; N]);
        }
        array
    }
}

/// Returns the name of a shape; none if it is empty.
pub(crate) fn shape_name(element: &Element<'_, '_>) -> Option<String> {
    element.text("name").filter(|name| !name.is_empty()).map(str::to_owned)
}

/// Reports each shape with the name of an earlier one. `owner` says whose shapes they are.
pub(crate) fn check_names<'a, 'd: 'a>(elements: impl Iterator<Item = Element<'a, 'd>>, owner: &str) {
    let mut known: BTreeMap<String, Element<'a, 'd>> = BTreeMap::new();
    for (element, name) in elements.filter_map(|element| Some((element, shape_name(&element)?))) {
        match known.get(&name) {
            Some(first) => element.problem(
                format_args!("has the name of the one at {}", first.place()),
                format!("expected different names of the shapes of {owner}"),
            ),
            None => drop(known.insert(name, element)),
        }
    }
}

fn shortened(name: &str) -> String {
    name.chars().map(|c| if c.is_control() { ' ' } else { c }).take(48).collect()
}
