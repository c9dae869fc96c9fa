//! Nested tables, lists of numbers and lists of strings in [`Fields`].

use toml::de::DeValue;

use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Value};

impl<'a> Fields<'a> {
    /// Returns the table under `key`, if present.
    pub(crate) fn table(&mut self, key: &'static str, example: &str) -> Option<Fields<'a>> {
        let value = self.value(key)?;
        Fields::of(self.log, value, format!("the `{key}` of {}", self.what), example)
    }

    /// Returns the entries of a list, at most `limit`; none if the key is absent.
    pub(crate) fn list(&mut self, key: &'static str, limit: usize, expected: &str) -> Vec<&'a Value<'a>> {
        let Some(value) = self.value(key) else { return Vec::new() };
        match value.get_ref() {
            DeValue::Array(items) if items.len() <= limit => items.iter().collect(),
            DeValue::Array(items) => {
                let message = format!("`{key}` of {} has {} entries", self.what, items.len());
                self.log.report(value.span(), message, format!("expected at most {limit}"));
                Vec::new()
            }
            _ => {
                self.wrong(key, value, expected);
                Vec::new()
            }
        }
    }

    /// Returns a list of numbers in `bound`, if the key is present.
    pub(crate) fn optional_numbers(&mut self, key: &'static str, bound: Bound, limit: usize) -> Option<Vec<f64>> {
        self.value(key)?;
        let items = self.list(key, limit, "a list of numbers");
        Some(items.into_iter().map(|item| self.as_number(key, item, bound)).collect())
    }

    /// Returns one string or a list of strings, each with its value.
    pub(crate) fn texts(&mut self, key: &'static str, limit: usize, expected: &str) -> Vec<(&'a str, &'a Value<'a>)> {
        let Some(value) = self.required(key, expected) else { return Vec::new() };
        let items = match value.get_ref() {
            DeValue::Array(_) => self.list(key, limit, expected),
            _ => vec![value],
        };
        items.into_iter().filter_map(|item| self.as_text(key, item).map(|text| (text, item))).collect()
    }
}
