//! XML that is being written.

use std::fmt::Write;

use tumble_core::collide::{Pose, Quat, Vec3};

/// Attributes of an element, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Attributes(Vec<(&'static str, String)>);

impl Attributes {
    pub(super) fn of(name: &'static str, text: impl AsRef<str>) -> Attributes {
        Attributes::default().with(name, text)
    }

    pub(super) fn with(mut self, name: &'static str, text: impl AsRef<str>) -> Attributes {
        self.put(name, text);
        self
    }

    pub(super) fn put(&mut self, name: &'static str, text: impl AsRef<str>) {
        self.0.push((name, text.as_ref().to_owned()));
    }

    pub(super) fn extend(&mut self, others: &Attributes) {
        self.0.extend(others.0.iter().cloned());
    }

    /// Returns the attributes without those of some names.
    pub(super) fn without(&self, names: &[&str]) -> Attributes {
        Attributes(self.0.iter().filter(|(name, _)| !names.contains(name)).cloned().collect())
    }

    /// Adds a text unless a value is the default of MJCF.
    pub(super) fn put_unless<T: PartialEq>(&mut self, default: T, name: &'static str, value: T, text: impl AsRef<str>) {
        if value != default {
            self.put(name, text);
        }
    }

    /// Adds a number if it differs from the default of MJCF.
    pub(super) fn put_number(&mut self, default: f64, name: &'static str, value: f64) {
        self.put_unless(default, name, value, numbers([value]));
    }

    /// Adds `pos` and `quat`, each if it is not the identity.
    pub(super) fn put_pose(&mut self, pose: &Pose) {
        let place = pose.translation.vector;
        self.put_unless(Vec3::zeros(), "pos", place, vector(&place));
        self.put_unless(Quat::identity(), "quat", pose.rotation, wxyz(&pose.rotation));
    }
}

/// An XML document under construction.
#[derive(Default)]
pub(super) struct Xml {
    text: String,
    open: Vec<&'static str>,
}

impl Xml {
    pub(super) fn open(&mut self, tag: &'static str, attributes: &Attributes) {
        self.start(tag, attributes, ">");
        self.open.push(tag);
    }

    pub(super) fn leaf(&mut self, tag: &'static str, attributes: &Attributes) {
        self.start(tag, attributes, "/>");
    }

    pub(super) fn close(&mut self) {
        if let Some(tag) = self.open.pop() {
            let _ = writeln!(self.text, "{}</{tag}>", "  ".repeat(self.open.len()));
        }
    }

    /// Writes a section with these elements, unless there are none.
    pub(super) fn section(&mut self, tag: &'static str, elements: &[(&'static str, Attributes)]) {
        if elements.is_empty() {
            return;
        }
        self.open(tag, &Attributes::default());
        elements.iter().for_each(|(tag, attributes)| self.leaf(tag, attributes));
        self.close();
    }

    /// Adds finished text, one level deeper.
    pub(super) fn verbatim(&mut self, text: &str) {
        let indent = "  ".repeat(self.open.len());
        text.lines().for_each(|line| self.text.extend([&indent, line, "\n"]));
    }

    pub(super) fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.text
    }

    fn start(&mut self, tag: &str, attributes: &Attributes, end: &str) {
        let _ = write!(self.text, "{}<{tag}", "  ".repeat(self.open.len()));
        for (name, value) in &attributes.0 {
            let _ = write!(self.text, " {name}=\"{}\"", escaped(value));
        }
        let _ = writeln!(self.text, "{end}");
    }
}

/// Returns a text as the value of an attribute; control characters become spaces.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// Returns numbers that read back to the same bits, separated by spaces.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    let one = |x: f64| {
        let text = format!("{x:?}");
        text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
    };
    values.into_iter().map(one).collect::<Vec<_>>().join(" ")
}

pub(super) fn vector(v: &Vec3) -> String {
    numbers(v.iter().copied())
}

/// Returns a rotation as MuJoCo writes it: `w x y z`.
pub(super) fn wxyz(q: &Quat) -> String {
    numbers([q.w, q.i, q.j, q.k])
}
