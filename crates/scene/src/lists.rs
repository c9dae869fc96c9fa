//! More of what a table can hold: tables within it, lists of numbers and of texts.

use toml::de::DeValue;

use crate::bound::Bound;
use crate::fields::{Fields, Value};

impl<'a> Fields<'a> {
    /// The table under `key`, if it is there.
    pub(crate) fn table(&mut self, key: &'static str, example: &str) -> Option<Fields<'a>> {
        let value = self.value(key)?;
        Fields::of(self.log, value, format!("the `{key}` of {}", self.what), example)
    }

    /// The entries of a list, none where the key is not there; at most `limit`.
    pub(crate) fn list(&mut self, key: &'static str, limit: usize, wanted: &str) -> Vec<&'a Value<'a>> {
        let Some(value) = self.value(key) else { return Vec::new() };
        match value.get_ref() {
            DeValue::Array(items) if items.len() <= limit => items.iter().collect(),
            DeValue::Array(items) => {
                let message = format!("`{key}` of {} has {} entries", self.what, items.len());
                self.log.report(value.span(), message, format!("wanted at most {limit}"));
                Vec::new()
            }
            _ => {
                self.wrong(key, value, wanted);
                Vec::new()
            }
        }
    }

    /// A list of numbers in `bound`, if the key is there.
    pub(crate) fn optional_numbers(&mut self, key: &'static str, bound: Bound, limit: usize) -> Option<Vec<f64>> {
        self.value(key)?;
        let items = self.list(key, limit, "a list of numbers");
        Some(items.into_iter().map(|item| self.as_number(key, item, bound)).collect())
    }

    /// One text or a list of texts, each with its value.
    pub(crate) fn texts(&mut self, key: &'static str, limit: usize, wanted: &str) -> Vec<(&'a str, &'a Value<'a>)> {
        let Some(value) = self.required(key, wanted) else { return Vec::new() };
        let items = match value.get_ref() {
            DeValue::Array(_) => self.list(key, limit, wanted),
            _ => vec![value],
        };
        items.into_iter().filter_map(|item| self.as_text(key, item).map(|text| (text, item))).collect()
    }
}
