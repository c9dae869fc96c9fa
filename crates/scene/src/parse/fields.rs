//! The keys of one table. Each getter checks type and range. A key that no getter has read is an
//! unknown key.
//!
//! Getters always return a value. If the file is wrong they record the problem and return a
//! placeholder, so that reading continues and finds further problems. A scene with any problem is
//! never returned.

use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::parse::axis::axis_by_name;
use crate::parse::bound::Bound;
use crate::parse::log::Log;
use crate::parse::renamed;
use crate::parse::suggest::{listed, nearest};

/// Names of an enumeration in files, with their values.
pub(crate) type Names<T> = &'static [(&'static str, T)];

/// A value with its place in the text.
pub(crate) type Value<'a> = Spanned<DeValue<'a>>;

/// Numbers of smaller magnitude are read as 0, since their inverse overflows.
const MIN_MAGNITUDE: f64 = 1e-300;

/// A table that is being read.
pub(crate) struct Fields<'a> {
    /// Receives the problems.
    pub(crate) log: &'a Log<'a>,
    /// The table's name in messages: `[world]`, `body "crate"`.
    pub(crate) what: String,
    /// The place of the table.
    pub(crate) span: Range<usize>,
    table: &'a DeTable<'a>,
    asked: Vec<&'static str>,
    /// Required keys that are missing, with the expected value.
    missing: Vec<(&'static str, String)>,
}

impl<'a> Fields<'a> {
    /// Reads `value` as a table. Returns `None`, with the problem recorded, if it is not one.
    pub(crate) fn of(log: &'a Log<'a>, value: &'a Value<'a>, what: impl Into<String>, example: &str) -> Option<Self> {
        let what = what.into();
        match value.get_ref() {
            DeValue::Table(table) => Some(Fields::of_table(log, table, value.span(), what)),
            other => {
                let message = format!("{what} is {} {}", article(other.type_str()), log.quote(value.span()));
                log.report(value.span(), message, format!("expected a table, such as {example}"));
                None
            }
        }
    }

    /// Wraps a parsed table.
    pub(crate) fn of_table(
        log: &'a Log<'a>,
        table: &'a DeTable<'a>,
        span: Range<usize>,
        what: impl Into<String>,
    ) -> Self {
        Fields { log, what: what.into(), span, table, asked: Vec::new(), missing: Vec::new() }
    }

    /// Returns the value of `key`, if present.
    pub(crate) fn value(&mut self, key: &'static str) -> Option<&'a Value<'a>> {
        self.asked.push(key);
        self.table.get(key)
    }

    /// Returns the value of a key that nothing has asked for yet, and counts it as asked for.
    pub(crate) fn unread(&mut self, key: &'static str) -> Option<&'a Value<'a>> {
        let value = self.table.get(key).filter(|_| !self.asked.contains(&key))?;
        self.asked.push(key);
        Some(value)
    }

    /// Returns name, place and value of every entry, whatever its name.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (&'a str, Range<usize>, &'a Value<'a>)> + use<'a> {
        self.table.iter().map(|(key, value)| (key.get_ref().as_ref(), key.span(), value))
    }

    /// Returns the value of `key`. Its absence is a problem.
    pub(crate) fn required(&mut self, key: &'static str, expected: &str) -> Option<&'a Value<'a>> {
        let value = self.value(key);
        if value.is_none() {
            self.missing(key, expected);
        }
        value
    }

    /// Records that `key` is missing. [`Fields::finish`] and [`Fields::give_up`] report it.
    pub(crate) fn missing(&mut self, key: &'static str, expected: &str) {
        self.missing.push((key, expected.to_owned()));
    }

    /// Records that the value of `key` is wrong.
    pub(crate) fn wrong(&self, key: &str, value: &Value<'_>, expected: impl std::fmt::Display) {
        let message = format!("`{key}` of {} is {}", self.what, self.log.quote(value.span()));
        self.log.report(value.span(), message, format!("expected {expected}"));
    }

    fn wrong_type(&self, key: &str, value: &Value<'_>, expected: impl std::fmt::Display) {
        let kind = article(value.get_ref().type_str());
        let message = format!("`{key}` of {} is {kind}: {}", self.what, self.log.quote(value.span()));
        self.log.report(value.span(), message, format!("expected {expected}"));
    }

    /// Reports every key that was not read and every required key that is missing. Call it after
    /// all keys have been read.
    pub(crate) fn finish(mut self) {
        self.asked.sort_unstable();
        self.asked.dedup();
        let known = self.asked.clone();
        self.report_unknown(&known, true);
    }

    /// Reports the missing required keys only. The meaning of the other keys depends on them, so
    /// these were not read.
    pub(crate) fn give_up(mut self) {
        let known: Vec<&'static str> = self.missing.iter().map(|(key, _)| *key).collect();
        self.report_unknown(&known, false);
    }

    /// Reports unknown keys. One that is near a missing key is reported instead of the missing key.
    /// Unknown keys without a near match are reported only if `all`.
    fn report_unknown(&mut self, known: &[&'static str], all: bool) {
        for (key, span, _) in self.entries() {
            if self.asked.contains(&key) || self.log.is_full() {
                continue;
            }
            let new_name = renamed::key(key, known);
            let meant = new_name.or_else(|| nearest(key, known.iter().copied()));
            let expected = match (new_name, meant) {
                (Some(new), _) => format!("this is now `{new}`"),
                (None, Some(known)) => format!("did you mean `{known}`?"),
                (None, None) if all => self.known_here(known),
                (None, None) => continue,
            };
            self.missing.retain(|(missing, _)| Some(*missing) != meant);
            self.log.report(span, format!("unknown key `{}` in {}", shortened(key), self.what), expected);
        }
        for (key, expected) in &self.missing {
            self.log.report(self.span.clone(), format!("{} has no `{key}`", self.what), format!("expected {expected}"));
        }
    }

    /// Returns the keys that may still be added, as a sentence.
    fn known_here(&self, known: &[&'static str]) -> String {
        let free: Vec<&str> = known.iter().copied().filter(|key| !self.table.contains_key(*key)).collect();
        match free.is_empty() {
            true => format!("the only keys are {}", listed(known.iter().copied(), "and")),
            false => format!("known keys: {}", listed(free, "and")),
        }
    }

    // Numbers.

    /// Returns a number in `bound`, if the key is present.
    pub(crate) fn optional_number(&mut self, key: &'static str, bound: Bound) -> Option<f64> {
        let value = self.value(key)?;
        Some(self.as_number(key, value, bound))
    }

    /// Returns a number in `bound`.
    pub(crate) fn number(&mut self, key: &'static str, bound: Bound) -> f64 {
        match self.required(key, bound.expected()) {
            Some(value) => self.as_number(key, value, bound),
            None => f64::NAN,
        }
    }

    /// Returns a number in `bound`, or `default` if the key is absent.
    pub(crate) fn number_or(&mut self, key: &'static str, bound: Bound, default: f64) -> f64 {
        self.optional_number(key, bound).unwrap_or(default)
    }

    pub(crate) fn as_number(&self, key: &str, value: &Value<'_>, bound: Bound) -> f64 {
        match number_of(value) {
            Some(x) if bound.holds(x) => return x,
            Some(_) => self.wrong(key, value, bound.expected()),
            None => self.wrong_type(key, value, bound.expected()),
        }
        f64::NAN
    }

    /// Returns an integer in `range`, or `default` if the key is absent.
    pub(crate) fn integer_or(&mut self, key: &'static str, range: RangeInclusive<u32>, default: u32) -> u32 {
        match self.value(key) {
            Some(value) => self.as_integer(key, value, range),
            None => default,
        }
    }

    /// Returns an integer in `range`, or `None` without the key.
    pub(crate) fn optional_integer(&mut self, key: &'static str, range: RangeInclusive<u32>) -> Option<u32> {
        let value = self.value(key)?;
        Some(self.as_integer(key, value, range))
    }

    /// Returns `value` as an integer in `range`.
    pub(crate) fn as_integer(&self, key: &str, value: &Value<'_>, range: RangeInclusive<u32>) -> u32 {
        let expected = format!("an integer from {} to {}", range.start(), range.end());
        match value.get_ref() {
            DeValue::Integer(digits) => {
                let number =
                    i64::from_str_radix(digits.as_str(), digits.radix()).ok().and_then(|n| u32::try_from(n).ok());
                match number.filter(|n| range.contains(n)) {
                    Some(n) => return n,
                    None => self.wrong(key, value, expected),
                }
            }
            _ => self.wrong_type(key, value, expected),
        }
        *range.start()
    }

    /// Returns the key `seed`, a whole number of 64 bits, or 0 if it is absent.
    pub(crate) fn seed(&mut self) -> u64 {
        const EXPECTED: &str = "a whole number from 0 to 18446744073709551615";
        let Some(value) = self.value("seed") else { return 0 };
        match value.get_ref() {
            DeValue::Integer(digits) => match u64::from_str_radix(digits.as_str(), digits.radix()) {
                Ok(seed) => return seed,
                Err(_) => self.wrong("seed", value, EXPECTED),
            },
            _ => self.wrong_type("seed", value, EXPECTED),
        }
        0
    }

    // Lists of numbers.

    /// Returns `N` numbers in `bound`, if the key is present.
    pub(crate) fn optional_vector<const N: usize>(&mut self, key: &'static str, bound: Bound) -> Option<[f64; N]> {
        let value = self.value(key)?;
        Some(self.as_vector(key, value, bound))
    }

    /// Returns `N` numbers in `bound`.
    pub(crate) fn vector<const N: usize>(&mut self, key: &'static str, bound: Bound) -> [f64; N] {
        match self.required(key, &format!("a list of {N} numbers")) {
            Some(value) => self.as_vector(key, value, bound),
            None => [f64::NAN; N],
        }
    }

    /// Returns `N` numbers in `bound`, or `default` if the key is absent.
    pub(crate) fn vector_or<const N: usize>(&mut self, key: &'static str, bound: Bound, default: [f64; N]) -> [f64; N] {
        self.optional_vector(key, bound).unwrap_or(default)
    }

    /// Returns `value` as `N` numbers in `bound`.
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
                self.log.report(value.span(), message, format!("expected a list of {N} numbers"));
            }
            _ => self.wrong_type(key, value, format!("a list of {N} numbers")),
        }
        out
    }

    /// Returns `value` as a direction of any length: three numbers, or the letter of an axis.
    pub(crate) fn as_direction(&self, key: &str, value: &Value<'_>) -> [f64; 3] {
        let Some(word) = value.get_ref().as_str() else { return self.as_vector(key, value, Bound::ANY) };
        axis_by_name(word).unwrap_or_else(|| {
            self.wrong(key, value, "a list of 3 numbers, or \"x\", \"y\", \"z\", \"-x\", \"-y\" or \"-z\"");
            [f64::NAN; 3]
        })
    }

    /// Returns a direction as a unit vector, or `default`, a unit vector already, if the key is
    /// absent.
    pub(crate) fn direction_or(&mut self, key: &'static str, default: [f64; 3]) -> [f64; 3] {
        let Some(value) = self.value(key) else { return default };
        let problems = self.log.count();
        let v = self.as_direction(key, value);
        let length = norm(&v);
        if length >= 1e-9 {
            return v.map(|x| x / length);
        }
        if self.log.count() == problems {
            self.wrong(key, value, "a direction: a vector that is not zero");
        }
        default
    }

    /// Returns a direction as a unit vector.
    pub(crate) fn direction(&mut self, key: &'static str) -> [f64; 3] {
        if self.required(key, "a direction, such as [0, 0, -1]").is_none() {
            return [f64::NAN; 3];
        }
        self.direction_or(key, [f64::NAN; 3])
    }

    // Strings.

    /// Returns `true` or `false`, or `default` if the key is absent.
    pub(crate) fn flag_or(&mut self, key: &'static str, default: bool) -> bool {
        let Some(value) = self.value(key) else { return default };
        value.get_ref().as_bool().unwrap_or_else(|| {
            self.wrong_type(key, value, "true or false");
            default
        })
    }

    /// Returns a string and its value for messages, if the key is present and a string.
    pub(crate) fn optional_text(&mut self, key: &'static str) -> Option<(&'a str, &'a Value<'a>)> {
        let value = self.value(key)?;
        self.as_text(key, value).map(|text| (text, value))
    }

    /// Returns a string and its value for messages.
    pub(crate) fn text(&mut self, key: &'static str, expected: &str) -> Option<(&'a str, &'a Value<'a>)> {
        let value = self.required(key, expected)?;
        self.as_text(key, value).map(|text| (text, value))
    }

    /// Returns `value` as a string.
    pub(crate) fn as_text(&self, key: &str, value: &'a Value<'a>) -> Option<&'a str> {
        let text = value.get_ref().as_str();
        if text.is_none() {
            self.wrong_type(key, value, "a string in quotes");
        }
        text
    }

    /// Returns one of `names`. `None`, with the problem recorded, if the key is absent or has
    /// another value.
    pub(crate) fn choice<T: Copy>(&mut self, key: &'static str, names: Names<T>) -> Option<T> {
        let value = self.required(key, &listed(names.iter().map(|(name, _)| *name), "or"))?;
        self.as_choice(key, value, names)
    }

    /// Returns one of `names`, or `default` if the key is absent.
    pub(crate) fn choice_or<T: Copy>(&mut self, key: &'static str, names: Names<T>, default: T) -> T {
        self.optional_choice(key, names).unwrap_or(default)
    }

    /// Reads one of `names`; `None` if the key is missing, or after a reported problem.
    pub(crate) fn optional_choice<T: Copy>(&mut self, key: &'static str, names: Names<T>) -> Option<T> {
        let value = self.value(key)?;
        self.as_choice(key, value, names)
    }

    /// Returns `value` as one of `names`.
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
        let hint = match (renamed::value(key, typed, &known), nearest(typed, known.iter().copied())) {
            (Some(new), _) => Some(format!("this is now `{new}`")),
            (None, near) => near.map(|near| format!("did you mean `{near}`?")),
        };
        match hint {
            Some(hint) => {
                let message = format!("`{key}` of {} is {}", self.what, self.log.quote(value.span()));
                self.log.report(value.span(), message, hint);
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

    /// Returns the tables of `[[key]]`, at most `limit`; none if the key is absent.
    pub(crate) fn tables(&mut self, key: &'static str, limit: usize) -> Vec<Fields<'a>> {
        let Some(value) = self.value(key) else { return Vec::new() };
        let DeValue::Array(items) = value.get_ref() else {
            self.wrong_type(key, value, format!("tables, each under a line [[{key}]]"));
            return Vec::new();
        };
        if items.len() > limit {
            let message = format!("there are {} tables [[{key}]]", items.len());
            self.log.report(value.span(), message, format!("expected at most {limit}"));
            return Vec::new();
        }
        let example = format!("[[{key}]]");
        let numbered = items.iter().enumerate();
        numbered.filter_map(|(n, item)| Fields::of(self.log, item, format!("{key} {}", n + 1), &example)).collect()
    }
}

/// Returns a number or an integer as a number. It is not finite if the text says so or overflows.
pub(crate) fn number_of(value: &Value<'_>) -> Option<f64> {
    let number: Option<f64> = match value.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(digits) if digits.radix() == 10 => digits.as_str().parse().ok(),
        DeValue::Integer(digits) => i64::from_str_radix(digits.as_str(), digits.radix()).ok().map(|n| n as f64),
        _ => None,
    };
    number.map(|x| if x.abs() < MIN_MAGNITUDE { 0.0 } else { x })
}

/// Returns the Euclidean length of a vector.
pub(crate) fn norm<const N: usize>(v: &[f64; N]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns a key for a message, truncated if it is long.
fn shortened(key: &str) -> String {
    key.chars().map(|c| if c.is_control() { ' ' } else { c }).take(48).collect()
}

fn article(kind: &str) -> String {
    match kind.starts_with(['a', 'i']) {
        true => format!("an {kind}"),
        false => format!("a {kind}"),
    }
}
