//! The text of a cave file with other screens.

use super::grid::Part;
use crate::fit::Wall;
use crate::mpcdi::CalibrationError;
use nalgebra::{Point3, Vector3};
use std::path::Path;
use toml::Value;
use tumble_scene::cave::{Cave, Flip};

/// A cave file as its tables. Comments are not kept.
pub(super) struct Table {
    root: toml::Table,
    /// By facet.
    screens: Vec<Value>,
    /// As they were found.
    walls: Vec<Wall>,
}

/// Returns the word of cave files.
pub(super) fn flip(flip: Flip) -> &'static str {
    match flip {
        Flip::None => "none",
        Flip::Horizontal => "horizontal",
        Flip::Vertical => "vertical",
        Flip::Both => "both",
    }
}

fn numbers(values: impl IntoIterator<Item = f64>) -> Value {
    Value::Array(values.into_iter().map(Value::Float).collect())
}

fn point(p: Point3<f64>) -> Value {
    numbers([p.x, p.y, p.z])
}

impl Table {
    /// Reads the text of a cave that was read before. Names of files become absolute, because the new file
    /// lies elsewhere.
    pub fn parse(text: &str, cave: &Cave) -> Result<Table, CalibrationError> {
        let fail = |reason: String| CalibrationError::new(cave.file.clone(), reason);
        let mut root: toml::Table = text.parse().map_err(|e: toml::de::Error| fail(e.to_string()))?;
        let folder = Path::new(&cave.file).parent().unwrap_or(Path::new(""));
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let absolute = |value: Option<&mut Value>| {
            if let Some(Value::String(name)) = value {
                *name = folder.join(name.as_str()).display().to_string();
            }
        };
        absolute(root.get_mut("security").and_then(|t| t.get_mut("key_file")));
        absolute(root.get_mut("recording").and_then(|t| t.get_mut("file")));
        for facet in facets(&mut root) {
            absolute(facet.get_mut("color").and_then(|c| c.get_mut("lut_file")));
            ["warp_file", "blend_file", "black_file"].iter().for_each(|key| drop(facet.remove(*key)));
        }
        if facets(&mut root).count() != cave.facets.len() {
            return Err(fail("its facets are not those of the cave".into()));
        }
        Ok(Table { root, screens: Vec::new(), walls: Vec::new() })
    }

    /// Returns the text with the screens of the file at other places.
    pub fn with_screens(&mut self, walls: &[Wall]) -> String {
        self.walls = walls.to_vec();
        let mut root = self.root.clone();
        let screens = root.get_mut("screen").and_then(Value::as_array_mut);
        let tables = screens.into_iter().flatten().filter_map(Value::as_table_mut);
        tables.zip(walls).for_each(|(table, wall)| place(table, wall));
        toml::to_string(&root).unwrap_or_default()
    }

    /// Moves the first user's eye.
    pub fn set_eye(&mut self, eye: Point3<f64>) {
        let users = self.root.get_mut("user").and_then(Value::as_array_mut);
        if let Some(user) = users.and_then(|users| users.first_mut()).and_then(Value::as_table_mut) {
            user.insert("eye_m".into(), point(eye));
        }
    }

    /// Gives a facet a part of a flat wall as its screen.
    pub fn set_flat(&mut self, facet: usize, name: &str, part: Part) {
        let Wall::Flat { corner, across, upward } = self.walls[part.wall] else { return };
        let at = |s: f64, t: f64| corner + across * s + upward * t;
        let ([s0, t0], [s1, t1]) = (part.low, part.high);
        let mut screen = toml::Table::new();
        screen.insert("name".into(), name.into());
        screen.insert("lower_left_m".into(), point(at(s0, t0)));
        screen.insert("lower_right_m".into(), point(at(s1, t0)));
        screen.insert("upper_left_m".into(), point(at(s0, t1)));
        self.set_screen(facet, name, screen);
    }

    /// Gives a facet a mesh as its screen.
    pub fn set_mesh(&mut self, facet: usize, name: &str, file: &str) {
        let mut screen = toml::Table::new();
        screen.insert("name".into(), name.into());
        screen.insert("shape".into(), "mesh".into());
        screen.insert("mesh_file".into(), file.into());
        self.set_screen(facet, name, screen);
    }

    fn set_screen(&mut self, facet: usize, name: &str, screen: toml::Table) {
        self.screens.push(Value::Table(screen));
        self.set_file(facet, "screen", name);
    }

    /// Sets a key of a facet to a text.
    pub fn set_file(&mut self, facet: usize, key: &str, text: &str) {
        if let Some(table) = facets(&mut self.root).nth(facet) {
            table.insert(key.into(), text.into());
        }
    }

    /// Returns the text with one screen for each facet.
    pub fn text(mut self) -> String {
        self.root.insert("screen".into(), Value::Array(self.screens));
        toml::to_string(&self.root).unwrap_or_default()
    }
}

fn facets(root: &mut toml::Table) -> impl Iterator<Item = &mut toml::Table> {
    root.get_mut("facet").and_then(Value::as_array_mut).into_iter().flatten().filter_map(Value::as_table_mut)
}

/// Writes the place of a wall into the table of its screen.
fn place(table: &mut toml::Table, wall: &Wall) {
    let mut set = |key: &str, value: Value| drop(table.insert(key.into(), value));
    match wall {
        Wall::Flat { corner, across, upward } => {
            set("lower_left_m", point(*corner));
            set("lower_right_m", point(corner + across));
            set("upper_left_m", point(corner + upward));
        }
        Wall::Cylinder { frame, radius, .. } | Wall::Dome { frame, radius, .. } | Wall::Globe { frame, radius, .. } => {
            set("center_m", numbers(Vector3::from(frame.center_m.coords).iter().copied()));
            set("radius_m", Value::Float(*radius));
        }
    }
}
