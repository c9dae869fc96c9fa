//! The keys of one table, read one by one: each is checked for type and range, and what nobody
//! asked for is an unknown key.
//!
//! Getters always answer. Where the file is wrong they record the problem and give a placeholder,
//! so that reading goes on and finds the next problem; a scene with any problem is never handed out.

use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::bound::Bound;
use crate::log::Log;
use crate::suggest::{listed, nearest};

/// Names of an enumeration as they stand in files, with what they mean.
pub(crate) type Names<T> = &'static [(&'static str, T)];

/// A value with its place in the text.
pub(crate) type Value<'a> = Spanned<DeValue<'a>>;

/// What is nearer to zero is zero: the inverse of less is no number any more.
const LEAST: f64 = 1e-300;

/// One table while it is read.
pub(crate) struct Fields<'a> {
    /// Where problems go.
    pub(crate) log: &'a Log<'a>,
    /// What the table is, for messages: `[world]`, `body "crate"`.
    pub(crate) what: String,
    /// The place of the table.
    pub(crate) span: Range<usize>,
    table: &'a DeTable<'a>,
    asked: Vec<&'static str>,
    /// Required keys that are not there, with what was wanted.
    missing: Vec<(&'static str, String)>,
}

impl<'a> Fields<'a> {
    /// Reads `value` as a table; `None`, with the problem recorded, if it is none.
    pub(crate) fn of(log: &'a Log<'a>, value: &'a Value<'a>, what: impl Into<String>, example: &str) -> Option<Self> {
        let what = what.into();
        match value.get_ref() {
            DeValue::Table(table) => Some(Fields::of_table(log, table, value.span(), what)),
            other => {
                let message = format!("{what} is {} {}", article(other.type_str()), log.quote(value.span()));
                log.report(value.span(), message, format!("wanted a table, such as {example}"));
                None
            }
        }
    }

    /// The same for a table already in hand.
    pub(crate) fn of_table(
        log: &'a Log<'a>,
        table: &'a DeTable<'a>,
        span: Range<usize>,
        what: impl Into<String>,
    ) -> Self {
        Fields { log, what: what.into(), span, table, asked: Vec::new(), missing: Vec::new() }
    }

    /// The value of `key`, if it is there.
    pub(crate) fn value(&mut self, key: &'static str) -> Option<&'a Value<'a>> {
        self.asked.push(key);
        self.table.get(key)
    }

    /// The name and value of every entry, whatever its name.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (&'a str, Range<usize>, &'a Value<'a>)> + use<'a> {
        self.table.iter().map(|(key, value)| (key.get_ref().as_ref(), key.span(), value))
    }

    /// The value of `key`; its absence is a problem.
    pub(crate) fn required(&mut self, key: &'static str, wanted: &str) -> Option<&'a Value<'a>> {
        let value = self.value(key);
        if value.is_none() {
            self.missing(key, wanted);
        }
        value
    }

    /// Records that `key` is not there; told by [`Fields::finish`] or [`Fields::give_up`].
    pub(crate) fn missing(&mut self, key: &'static str, wanted: &str) {
        self.missing.push((key, wanted.to_owned()));
    }

    /// Records that the value of `key` is wrong.
    pub(crate) fn wrong(&self, key: &str, value: &Value<'_>, wanted: impl std::fmt::Display) {
        let message = format!("`{key}` of {} is {}", self.what, self.log.quote(value.span()));
        self.log.report(value.span(), message, format!("wanted {wanted}"));
    }

    fn wrong_type(&self, key: &str, value: &Value<'_>, wanted: impl std::fmt::Display) {
        let kind = article(value.get_ref().type_str());
        let message = format!("`{key}` of {} is {kind}: {}", self.what, self.log.quote(value.span()));
        self.log.report(value.span(), message, format!("wanted {wanted}"));
    }

    /// Tells of every key that nobody asked for and every required one that is not there. Call it
    /// once all that can be asked has been.
    pub(crate) fn finish(mut self) {
        self.asked.sort_unstable();
        self.asked.dedup();
        let known = self.asked.clone();
        self.tell_unknown(&known, true);
    }

    /// Tells only of the required keys that are not there: what else the table may hold was never asked,
    /// because that depends on them.
    pub(crate) fn give_up(mut self) {
        let known: Vec<&'static str> = self.missing.iter().map(|(key, _)| *key).collect();
        self.tell_unknown(&known, false);
    }

    /// Tells of unknown keys, those near a missing one instead of it (and the others only if `all`).
    fn tell_unknown(&mut self, known: &[&'static str], all: bool) {
        for (key, span, _) in self.entries() {
            if self.asked.contains(&key) || self.log.is_full() {
                continue;
            }
            let meant = nearest(key, known.iter().copied());
            let wanted = match meant {
                Some(known) => format!("did you mean `{known}`?"),
                None if all => self.known_here(known),
                None => continue,
            };
            self.missing.retain(|(missing, _)| Some(*missing) != meant);
            self.log.report(span, format!("unknown key `{}` in {}", shortened(key), self.what), wanted);
        }
        for (key, wanted) in &self.missing {
            self.log.report(self.span.clone(), format!("{} has no `{key}`", self.what), format!("wanted {wanted}"));
        }
    }

    /// The keys that could still be added.
    fn known_here(&self, known: &[&'static str]) -> String {
        let free: Vec<&str> = known.iter().copied().filter(|key| !self.table.contains_key(*key)).collect();
        match free.is_empty() {
            true => format!("known here are only {}", listed(known.iter().copied(), "and")),
            false => format!("known here: {}", listed(free, "and")),
        }
    }

    // Numbers.

    /// A number in `bound`, if the key is there.
    pub(crate) fn optional_number(&mut self, key: &'static str, bound: Bound) -> Option<f64> {
        let value = self.value(key)?;
        Some(self.as_number(key, value, bound))
    }

    /// A number in `bound`.
    pub(crate) fn number(&mut self, key: &'static str, bound: Bound) -> f64 {
        match self.required(key, bound.wanted()) {
            Some(value) => self.as_number(key, value, bound),
            None => f64::NAN,
        }
    }

    /// A number in `bound`, or `default` where the key is not there.
    pub(crate) fn number_or(&mut self, key: &'static str, bound: Bound, default: f64) -> f64 {
        self.optional_number(key, bound).unwrap_or(default)
    }

    pub(crate) fn as_number(&self, key: &str, value: &Value<'_>, bound: Bound) -> f64 {
        match number_of(value) {
            Some(x) if bound.holds(x) => return x,
            Some(_) => self.wrong(key, value, bound.wanted()),
            None => self.wrong_type(key, value, bound.wanted()),
        }
        f64::NAN
    }

    /// A whole number in `range`, or `default` where the key is not there.
    pub(crate) fn integer_or(&mut self, key: &'static str, range: RangeInclusive<u32>, default: u32) -> u32 {
        match self.value(key) {
            Some(value) => self.as_integer(key, value, range),
            None => default,
        }
    }

    /// A whole number in `range`.
    pub(crate) fn as_integer(&self, key: &str, value: &Value<'_>, range: RangeInclusive<u32>) -> u32 {
        let wanted = format!("a whole number from {} to {}", range.start(), range.end());
        match value.get_ref() {
            DeValue::Integer(digits) => {
                let number =
                    i64::from_str_radix(digits.as_str(), digits.radix()).ok().and_then(|n| u32::try_from(n).ok());
                match number.filter(|n| range.contains(n)) {
                    Some(n) => return n,
                    None => self.wrong(key, value, wanted),
                }
            }
            _ => self.wrong_type(key, value, wanted),
        }
        *range.start()
    }

    // Lists of numbers.

    /// `N` numbers in `bound`, if the key is there.
    pub(crate) fn optional_vector<const N: usize>(&mut self, key: &'static str, bound: Bound) -> Option<[f64; N]> {
        let value = self.value(key)?;
        Some(self.as_vector(key, value, bound))
    }

    /// `N` numbers in `bound`.
    pub(crate) fn vector<const N: usize>(&mut self, key: &'static str, bound: Bound) -> [f64; N] {
        match self.required(key, &format!("a list of {N} numbers")) {
            Some(value) => self.as_vector(key, value, bound),
            None => [f64::NAN; N],
        }
    }

    /// `N` numbers in `bound`, or `default` where the key is not there.
    pub(crate) fn vector_or<const N: usize>(&mut self, key: &'static str, bound: Bound, default: [f64; N]) -> [f64; N] {
        self.optional_vector(key, bound).unwrap_or(default)
    }

    /// `value` as `N` numbers in `bound`.
    pub(crate) fn as_vector<const N: usize>(&self, key: &str, value: &Value<'_>, bound: Bound) -> [f64; N] {
        let mut out = [f64::NAN; N];
        match value.get_ref() {
            DeValue::Array(items) if items.len() == N => {
                for (slot, item) in out.iter_mut().zip(items.iter()) {
                    *slot = self.as_number(key, item, bound);
                }
            }
            DeValue::Array(items) => {
                let message =
                    format!("`{key}` of {} has {} entries: {}", self.what, items.len(), self.log.quote(value.span()));
                self.log.report(value.span(), message, format!("wanted a list of {N} numbers"));
            }
            _ => self.wrong_type(key, value, format!("a list of {N} numbers")),
        }
        out
    }

    /// A direction, made a unit vector; `default` (already of length 1) where the key is not there.
    pub(crate) fn direction_or(&mut self, key: &'static str, default: [f64; 3]) -> [f64; 3] {
        let Some(value) = self.value(key) else { return default };
        let problems = self.log.count();
        let v: [f64; 3] = self.as_vector(key, value, Bound::ANY);
        let length = norm(&v);
        if length >= 1e-9 {
            return v.map(|x| x / length);
        }
        if self.log.count() == problems {
            self.wrong(key, value, "a direction: a vector that is not zero");
        }
        default
    }

    /// A direction, made a unit vector.
    pub(crate) fn direction(&mut self, key: &'static str) -> [f64; 3] {
        if self.required(key, "a direction, such as [0, 0, -1]").is_none() {
            return [f64::NAN; 3];
        }
        self.direction_or(key, [f64::NAN; 3])
    }

    // Words.

    /// `true` or `false`, or `default` where the key is not there.
    pub(crate) fn flag_or(&mut self, key: &'static str, default: bool) -> bool {
        let Some(value) = self.value(key) else { return default };
        value.get_ref().as_bool().unwrap_or_else(|| {
            self.wrong_type(key, value, "true or false");
            default
        })
    }

    /// A text, with its value for messages, if the key is there and is a text.
    pub(crate) fn optional_text(&mut self, key: &'static str) -> Option<(&'a str, &'a Value<'a>)> {
        let value = self.value(key)?;
        self.as_text(key, value).map(|text| (text, value))
    }

    /// A text, with its value for messages.
    pub(crate) fn text(&mut self, key: &'static str, wanted: &str) -> Option<(&'a str, &'a Value<'a>)> {
        let value = self.required(key, wanted)?;
        self.as_text(key, value).map(|text| (text, value))
    }

    /// `value` as a text.
    pub(crate) fn as_text(&self, key: &str, value: &'a Value<'a>) -> Option<&'a str> {
        let text = value.get_ref().as_str();
        if text.is_none() {
            self.wrong_type(key, value, "a text in quotes");
        }
        text
    }

    /// One of `names`; `None`, with the problem recorded, where it is missing or another word.
    pub(crate) fn choice<T: Copy>(&mut self, key: &'static str, names: Names<T>) -> Option<T> {
        let value = self.required(key, &listed(names.iter().map(|(name, _)| *name), "or"))?;
        self.as_choice(key, value, names)
    }

    /// One of `names`, or `default` where the key is not there.
    pub(crate) fn choice_or<T: Copy>(&mut self, key: &'static str, names: Names<T>, default: T) -> T {
        match self.value(key) {
            Some(value) => self.as_choice(key, value, names).unwrap_or(default),
            None => default,
        }
    }

    /// `value` as one of `names`.
    pub(crate) fn as_choice<T: Copy>(&self, key: &str, value: &'a Value<'a>, names: Names<T>) -> Option<T> {
        let typed = self.as_text(key, value)?;
        let found = names.iter().find(|(name, _)| *name == typed).map(|(_, meaning)| *meaning);
        if found.is_none() {
            self.unknown_name(key, value, typed, names.iter().map(|(name, _)| *name).collect());
        }
        found
    }

    /// Records that `typed` is not among `known`, with the nearest of them.
    pub(crate) fn unknown_name(&self, key: &str, value: &Value<'_>, typed: &str, known: Vec<&str>) {
        match nearest(typed, known.iter().copied()) {
            Some(near) => {
                let message = format!("`{key}` of {} is {}", self.what, self.log.quote(value.span()));
                self.log.report(value.span(), message, format!("did you mean `{near}`?"));
            }
            None => {
                let mut once: Vec<&str> = Vec::new();
                known.into_iter().for_each(|word| {
                    if !once.contains(&word) {
                        once.push(word)
                    }
                });
                self.wrong(key, value, listed(once.into_iter().take(20), "or"));
            }
        }
    }

    /// The tables of `[[key]]`, none where the key is not there; at most `limit` of them.
    pub(crate) fn tables(&mut self, key: &'static str, limit: usize) -> Vec<Fields<'a>> {
        let Some(value) = self.value(key) else { return Vec::new() };
        let DeValue::Array(items) = value.get_ref() else {
            self.wrong_type(key, value, format!("tables, each under a line [[{key}]]"));
            return Vec::new();
        };
        if items.len() > limit {
            let message = format!("there are {} tables [[{key}]]", items.len());
            self.log.report(value.span(), message, format!("wanted at most {limit}"));
            return Vec::new();
        }
        let example = format!("[[{key}]]");
        let numbered = items.iter().enumerate();
        numbered.filter_map(|(n, item)| Fields::of(self.log, item, format!("{key} {}", n + 1), &example)).collect()
    }
}

/// The number a value is, whole or not; not finite where the text says so or overflows.
pub(crate) fn number_of(value: &Value<'_>) -> Option<f64> {
    let number: Option<f64> = match value.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(digits) if digits.radix() == 10 => digits.as_str().parse().ok(),
        DeValue::Integer(digits) => i64::from_str_radix(digits.as_str(), digits.radix()).ok().map(|n| n as f64),
        _ => None,
    };
    number.map(|x| if x.abs() < LEAST { 0.0 } else { x })
}

/// The Euclidean length of a vector.
pub(crate) fn norm<const N: usize>(v: &[f64; N]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A key for a message, cut where it is long.
fn shortened(key: &str) -> String {
    key.chars().map(|c| if c.is_control() { ' ' } else { c }).take(48).collect()
}

fn article(kind: &str) -> String {
    match kind.starts_with(['a', 'i']) {
        true => format!("an {kind}"),
        false => format!("a {kind}"),
    }
}
