//! TOML as text: one line for each key, and numbers that read back to the same bits.

use tumble_core::collide::{ContactMode, Pose, Vec3};

/// A value in TOML.
pub(super) trait Toml {
    /// Returns its text.
    fn toml(&self) -> String;
}

impl Toml for f64 {
    /// The shortest decimal number that reads back to the same bits.
    fn toml(&self) -> String {
        format!("{self:?}")
    }
}

impl Toml for f32 {
    fn toml(&self) -> String {
        format!("{self:?}")
    }
}

impl Toml for bool {
    fn toml(&self) -> String {
        self.to_string()
    }
}

impl Toml for u32 {
    fn toml(&self) -> String {
        self.to_string()
    }
}

impl Toml for u64 {
    fn toml(&self) -> String {
        self.to_string()
    }
}

impl Toml for i32 {
    fn toml(&self) -> String {
        self.to_string()
    }
}

impl Toml for str {
    /// JSON escapes strings as TOML does.
    fn toml(&self) -> String {
        serde_json::Value::from(self).to_string()
    }
}

impl Toml for String {
    fn toml(&self) -> String {
        self.as_str().toml()
    }
}

impl<T: Toml> Toml for [T] {
    fn toml(&self) -> String {
        format!("[{}]", self.iter().map(Toml::toml).collect::<Vec<_>>().join(", "))
    }
}

impl<T: Toml, const N: usize> Toml for [T; N] {
    fn toml(&self) -> String {
        self.as_slice().toml()
    }
}

impl<T: Toml> Toml for Vec<T> {
    fn toml(&self) -> String {
        self.as_slice().toml()
    }
}

impl<T: Toml + ?Sized> Toml for &T {
    fn toml(&self) -> String {
        (*self).toml()
    }
}

impl Toml for Vec3 {
    fn toml(&self) -> String {
        [self.x, self.y, self.z].toml()
    }
}

impl Toml for ContactMode {
    fn toml(&self) -> String {
        ContactMode::NAMES.iter().find(|(_, mode)| mode == self).map_or("", |(name, _)| *name).toml()
    }
}

impl Toml for Table {
    fn toml(&self) -> String {
        let keys: Vec<String> = self.keys.iter().map(|(key, value)| format!("{key} = {value}")).collect();
        format!("{{ {} }}", keys.join(", "))
    }
}

/// Keys and the texts of their values.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Table {
    keys: Vec<(&'static str, String)>,
}

impl Table {
    /// Returns a table of one key.
    pub(super) fn of(key: &'static str, value: impl Toml) -> Table {
        let mut table = Table::default();
        table.put(key, value);
        table
    }

    /// Returns whether it has no key.
    pub(super) fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// Adds a key.
    pub(super) fn put(&mut self, key: &'static str, value: impl Toml) {
        self.keys.push((key, value.toml()));
    }

    /// Adds a key if its value is not the one that it has when it is absent.
    pub(super) fn put_unless<T: Toml + PartialEq>(&mut self, absent: T, key: &'static str, value: T) {
        if value != absent {
            self.put(key, value);
        }
    }

    /// Adds all keys of another table.
    pub(super) fn extend(&mut self, other: Table) {
        self.keys.extend(other.keys);
    }

    /// Adds position and orientation, where they are not those of the identity.
    pub(super) fn put_pose(&mut self, pose: &Pose) {
        self.put_unless(Vec3::zeros(), "position_m", pose.translation.vector);
        let q = pose.rotation.coords;
        self.put_unless([0.0, 0.0, 0.0, 1.0], "orientation_xyzw", [q.x, q.y, q.z, q.w]);
    }

    /// Returns the table under a header such as `[[body]]`, one line for each key.
    pub(super) fn under(&self, header: &str) -> String {
        let lines = self.keys.iter().map(|(key, value)| format!("{key} = {value}\n"));
        format!("\n{header}\n{}", lines.collect::<String>())
    }

    /// Returns the keys alone, one line for each.
    pub(super) fn lines(&self) -> String {
        self.keys.iter().map(|(key, value)| format!("{key} = {value}\n")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        for x in [0.1, -1e-300, 5e-324, 1.0 / 3.0, 1e16, f64::MAX, -0.0, 240.0] {
            let text = format!("x = {}", x.toml());
            let table = toml::de::DeTable::parse(&text).unwrap();
            let number = match table.get_ref()["x"].get_ref() {
                toml::de::DeValue::Float(number) => number.as_str().parse::<f64>().unwrap(),
                other => panic!("{other:?}"),
            };
            assert_eq!(number.to_bits(), x.to_bits(), "{text}");
        }
    }

    #[test]
    fn names_are_quoted() {
        let text = format!("x = {}", "a \"b\"\\ \u{e9}".toml());
        let table = toml::de::DeTable::parse(&text).unwrap();
        assert_eq!(table.get_ref()["x"].get_ref().as_str(), Some("a \"b\"\\ \u{e9}"));
    }
}
