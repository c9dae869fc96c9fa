//! The texts of a model: its file and the files that it includes, joined to one tree of elements.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use roxmltree::{Document, Node, ParsingOptions};

use super::error::{MAX_BYTES, MjcfError};
use crate::parse::log::Log;
use crate::parse::problem::{Invalid, Problem};
use crate::xml::{self, Element};

/// The format, for messages about a text that is no XML.
const EXPECTED: &str = "MJCF: an XML document with one element <mujoco>";
/// Largest number of files of a model.
const MAX_FILES: usize = 256;
/// Largest depth of nested elements.
const MAX_DEPTH: usize = 200;
/// Largest number of elements of a model.
const MAX_ELEMENTS: usize = 1_000_000;

/// A file of a model.
pub(super) struct Text {
    pub(super) path: PathBuf,
    pub(super) text: String,
}

/// The files of a model, the model itself first, and where each `<include>` leads.
pub(super) struct Texts {
    pub(super) all: Vec<Text>,
    /// Index of the file of each name, or why it cannot be read.
    included: BTreeMap<String, Result<usize, String>>,
}

impl Texts {
    /// Reads a file and those that it includes. Files that cannot be included are reported later.
    pub(super) fn of_file(path: &Path) -> Result<Texts, MjcfError> {
        let mut texts = Texts::alone(read(path)?, path)?;
        let mut at = 0;
        while at < texts.all.len() {
            texts.follow(at);
            at += 1;
        }
        Ok(texts)
    }

    /// Takes a text without the files that it includes.
    pub(super) fn alone(text: String, path: &Path) -> Result<Texts, MjcfError> {
        if text.len() as u64 > MAX_BYTES {
            return Err(MjcfError::TooLarge { file: path.to_path_buf() });
        }
        Ok(Texts { all: vec![Text { path: path.to_path_buf(), text }], included: BTreeMap::new() })
    }

    /// Reads the files that a file includes. Their names are relative to the folder of the model.
    fn follow(&mut self, at: usize) {
        let folder = self.all[0].path.parent().unwrap_or(Path::new("")).to_path_buf();
        let options = ParsingOptions { nodes_limit: xml::MAX_NODES, ..ParsingOptions::default() };
        let names: Vec<String> = match Document::parse_with_options(&self.all[at].text, options) {
            Ok(document) => {
                let named = |node: Node<'_, '_>| node.attribute("file").map(str::to_owned);
                document.descendants().filter(|node| node.has_tag_name("include")).filter_map(named).collect()
            }
            Err(_) => return,
        };
        for name in names {
            if self.included.contains_key(&name) {
                continue;
            }
            let held: u64 = self.all.iter().map(|text| text.text.len() as u64).sum();
            let path = folder.join(&name);
            let outcome = match read(&path) {
                _ if self.all.len() >= MAX_FILES => Err(format!("the model has more than {MAX_FILES} files")),
                Ok(text) if held + text.len() as u64 > MAX_BYTES => {
                    Err(format!("the files of the model have more than {MAX_BYTES} bytes"))
                }
                Ok(text) => {
                    self.all.push(Text { path, text });
                    Ok(self.all.len() - 1)
                }
                Err(error) => Err(error.to_string()),
            };
            self.included.insert(name, outcome);
        }
    }

    /// Returns a log for each file.
    pub(super) fn logs(&self) -> Vec<Log<'_>> {
        self.all.iter().map(|text| Log::new(&text.text).named(&text.path.display().to_string())).collect()
    }

    /// Parses all files; those that are no XML are reported.
    pub(super) fn documents<'t>(&'t self, logs: &[Log<'_>]) -> Vec<Option<Document<'t>>> {
        self.all.iter().zip(logs).map(|(text, log)| xml::parse(log, &text.text, EXPECTED)).collect()
    }

    /// Returns the error of all files with problems, one list for each file.
    pub(super) fn invalid(&self, problems: Vec<Vec<Problem>>) -> MjcfError {
        let one = |(text, problems): (&Text, Vec<Problem>)| {
            let file = text.path.display().to_string();
            (!problems.is_empty()).then(|| Invalid { file, text: text.text.clone(), problems })
        };
        MjcfError::Invalid(self.all.iter().zip(problems).filter_map(one).collect())
    }
}

fn read(path: &Path) -> Result<String, MjcfError> {
    let unread = |source| MjcfError::Read { file: path.to_path_buf(), source };
    let mut bytes = Vec::new();
    crate::open_file(path).map_err(unread)?.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unread)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(MjcfError::TooLarge { file: path.to_path_buf() });
    }
    String::from_utf8(bytes).map_err(|error| {
        let byte = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..byte].iter().filter(|&&b| b == b'\n').count();
        MjcfError::NotUtf8 { file: path.to_path_buf(), line, byte }
    })
}

/// An element with its children, those of included files among them.
pub(super) struct XmlNode<'a> {
    pub(super) element: Element<'a, 'a>,
    pub(super) children: Vec<XmlNode<'a>>,
}

impl<'a> XmlNode<'a> {
    pub(super) fn tag(&self) -> &'a str {
        self.element.tag()
    }

    /// Returns the children with that tag.
    pub(super) fn all(&self, tag: &'static str) -> impl Iterator<Item = &XmlNode<'a>> {
        self.children.iter().filter(move |child| child.tag() == tag)
    }
}

/// Joins the files of a model. `None`, with the problem recorded, if the model is no XML.
pub(super) fn join<'a>(
    texts: &Texts,
    logs: &'a [Log<'a>],
    documents: &'a [Option<Document<'a>>],
) -> Option<XmlNode<'a>> {
    let mut joiner = Joiner { texts, logs, documents, used: vec![false; documents.len()], count: 0 };
    joiner.used[0] = true;
    let element = Element::new(&logs[0], documents[0].as_ref()?.root_element());
    if element.tag() != "mujoco" {
        let hint = if element.tag() == "robot" { "; a URDF has the extension .urdf" } else { "" };
        element.problem("is the outermost element", format!("expected <mujoco>{hint}"));
        return None;
    }
    Some(joiner.node(element, 0))
}

struct Joiner<'a, 't> {
    texts: &'t Texts,
    logs: &'a [Log<'a>],
    documents: &'a [Option<Document<'a>>],
    /// Whether each file was included before.
    used: Vec<bool>,
    count: usize,
}

impl<'a> Joiner<'a, '_> {
    fn node(&mut self, element: Element<'a, 'a>, depth: usize) -> XmlNode<'a> {
        let mut children = Vec::new();
        self.count += 1;
        if depth >= MAX_DEPTH {
            element.problem("is nested too deeply", format!("expected at most {MAX_DEPTH} levels of elements"));
        } else if self.count == MAX_ELEMENTS {
            element.problem("is one element too many", format!("expected at most {MAX_ELEMENTS}"));
        } else if self.count < MAX_ELEMENTS {
            self.children(&element, depth, &mut children);
        }
        XmlNode { element, children }
    }

    fn children(&mut self, element: &Element<'a, 'a>, depth: usize, out: &mut Vec<XmlNode<'a>>) {
        for node in element.node().children().filter(Node::is_element) {
            let child = Element::new(element.log, node);
            if child.tag() == "include" {
                self.include(&child, depth, out);
            } else {
                out.push(self.node(child, depth + 1));
            }
        }
    }

    /// Adds the children of the outermost element of an included file.
    fn include(&mut self, include: &Element<'a, 'a>, depth: usize, out: &mut Vec<XmlNode<'a>>) {
        let expected = "the path of a file, relative to the folder of the model";
        let Some(name) = include.required_text("file", expected) else { return };
        match self.texts.included.get(name) {
            Some(Ok(file)) if self.used[*file] => include.wrong("file", "a file that is not included a second time"),
            Some(Ok(file)) => {
                self.used[*file] = true;
                if let Some(document) = &self.documents[*file] {
                    self.children(&Element::new(&self.logs[*file], document.root_element()), depth, out);
                }
            }
            Some(Err(why)) => {
                include.wrong("file", format_args!("{expected} ({why})"));
            }
            None => include.wrong("file", expected),
        }
    }
}
