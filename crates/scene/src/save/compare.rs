//! Compares the constants of a world with those of the world that its text gives. A constant that the
//! text lacks is found here, whatever it is.

use std::collections::BTreeSet;

use serde_json::{Map, Value};
use tumble_core::World;

/// Largest difference of two numbers, per magnitude of the larger, or of the largest number of their
/// list.
const ROUNDING: f64 = 1e-9;
/// Magnitude below which a number counts as zero: rounding of sums of larger ones.
const ZERO: f64 = 1e-12;
/// Values of time 0, and values without effect on motion, which the writer notes itself.
/// `original` is the target of a drive before an event set it: the text has the present one.
const SKIPPED: [&str; 8] =
    ["initial_pose", "initial_velocity", "start", "visuals", "cameras", "lights", "properties", "original"];

/// Returns where the constants of two worlds differ by more than rounding, in words.
pub(super) fn differences(ours: &World, read: &World) -> Result<Vec<String>, String> {
    let value = |world: &World| world.serialize_constants(serde_json::value::Serializer).map_err(|e| e.to_string());
    let (ours, read) = (value(ours)?, value(read)?);
    let mut comparison = Comparison { shapes: [&ours["shapes"], &read["shapes"]], found: Vec::new() };
    let names = |world: &Value| -> Vec<String> {
        let objects = world["objects"].as_array().into_iter().flatten();
        objects.map(|object| object["name"].as_str().unwrap_or_default().to_owned()).collect()
    };
    let (names, theirs) = (names(&ours), names(&read));
    if names != theirs {
        return Ok(vec![format!("the objects are {names:?}, and {theirs:?} after reading")]);
    }
    let spawned = spawned(&ours);
    for (k, name) in names.iter().enumerate() {
        let record = |world: &Value| opened(&world["objects"][k]["record"]);
        comparison.compare(&format!("\"{name}\""), &record(&ours)?, &record(&read)?);
        if !spawned.contains(&(k as u64)) {
            comparison.compare(&format!("\"{name}\": status"), &ours["status"][k], &read["status"][k]);
        }
    }
    for key in ["settings", "stepper", "solver"] {
        comparison.compare(key, &ours[key], &read[key]);
    }
    comparison.compare("pairs", &pairs(&ours), &pairs(&read));
    Ok(comparison.found)
}

/// Returns the numbers of the bodies of templates, which are enabled while they are spawned.
fn spawned(world: &Value) -> BTreeSet<u64> {
    let objects = world["objects"].as_array().into_iter().flatten();
    let bodies = objects.filter_map(|object| object["record"]["Template"]["bodies"].as_array());
    bodies.flatten().filter_map(Value::as_u64).collect()
}

/// Returns a record without its name, with the numbers of a behavior instead of its bytes.
fn opened(record: &Value) -> Result<Value, String> {
    let mut record = record.clone();
    // the name of the object in its world counts, which the world makes for an object without one
    record.as_object_mut().into_iter().flat_map(Map::values_mut).for_each(|kind| {
        kind.as_object_mut().map(|constants| constants.remove("name"));
    });
    let Some(bytes) = record["Other"]["bytes"].as_array() else { return Ok(record) };
    let bytes: Vec<u8> = bytes.iter().filter_map(|byte| byte.as_u64()?.try_into().ok()).collect();
    let numbers = tumble_behaviors::serialize_record(&bytes, serde_json::value::Serializer);
    record["Other"]["bytes"] = numbers.map_err(|e| e.to_string())?;
    Ok(record)
}

/// Returns the pairs with the part of a rigid body as the body.
fn pairs(world: &Value) -> Value {
    let mut pairs = world["pairs"].clone();
    for pair in pairs.as_array_mut().into_iter().flatten() {
        for side in pair["sides"].as_array_mut().into_iter().flatten() {
            let object = side["Part"][0].clone();
            let rigid = object.as_u64().is_some_and(|k| world["objects"][k as usize]["record"].get("Rigid").is_some());
            if rigid {
                *side = serde_json::json!({ "Object": object });
            }
        }
    }
    pairs
}

struct Comparison<'v> {
    shapes: [&'v Value; 2],
    found: Vec<String>,
}

impl Comparison<'_> {
    fn compare(&mut self, path: &str, a: &Value, b: &Value) {
        match (a, b) {
            (Value::Object(a), Value::Object(b)) => self.tables(path, a, b),
            (Value::Array(a), Value::Array(b)) if a.len() == b.len() => self.lists(path, a, b),
            (Value::Number(x), Value::Number(y)) => self.numbers(path, &[x.as_f64()], &[y.as_f64()]),
            _ if a == b => {}
            _ => self.found.push(format!("{path} is {}, and {} after reading", shown(a), shown(b))),
        }
    }

    fn tables(&mut self, path: &str, a: &Map<String, Value>, b: &Map<String, Value>) {
        // the placement of a floating root is its pose at time 0
        let floats = a.get("joint").is_some_and(|joint| joint == "Floating");
        let compared = |key: &&String| !SKIPPED.contains(&key.as_str()) && (!floats || *key != "placement");
        for key in a.keys().filter(compared) {
            let path = format!("{path}.{key}");
            let (ours, read) = (&a[key], b.get(key).unwrap_or(&Value::Null));
            match key.as_str() {
                "shape" => {
                    let shape = |list: &Value, index: &Value| list[index.as_u64().unwrap_or(0) as usize].clone();
                    self.compare(&path, &shape(self.shapes[0], ours), &shape(self.shapes[1], read));
                }
                "part_shapes" => {
                    let list = |list: &Value, indices: &Value| -> Value {
                        let indices = indices.as_array().into_iter().flatten().filter_map(Value::as_u64);
                        indices.map(|index| list[index as usize].clone()).collect()
                    };
                    self.compare(&path, &list(self.shapes[0], ours), &list(self.shapes[1], read));
                }
                // a sensor that names no link reads that of its part, which the text names
                "link" if ours.is_null() && a.contains_key("frame") => {}
                "colliders" => self.compare(&path, &sorted(ours, "link"), &sorted(read, "link")),
                "couplings" => self.compare(&path, &sorted(ours, "dof"), &sorted(read, "dof")),
                "excluded_pairs" => self.contained(&path, ours, read),
                "transmission" => {
                    for constant in used_constants(b.get("kind")) {
                        self.compare(&format!("{path}.{constant}"), &ours[constant], &read[constant]);
                    }
                }
                "rotation" => self.compare(&path, &upright(ours), &upright(read)),
                _ => self.compare(&path, ours, read),
            }
        }
    }

    /// Reports the pairs of `a` that `b` lacks. Links between which there are only links without mass and
    /// shape get a pair when they are read.
    fn contained(&mut self, path: &str, a: &Value, b: &Value) {
        let list = |v: &Value| v.as_array().cloned().unwrap_or_default();
        let (a, b) = (list(a), list(b));
        let lost = a.iter().filter(|pair| !b.contains(pair));
        self.found.extend(lost.map(|pair| format!("{path} contains {pair}, but not after reading")));
    }

    fn lists(&mut self, path: &str, a: &[Value], b: &[Value]) {
        if a.iter().chain(b).all(Value::is_number) {
            let numbers = |list: &[Value]| list.iter().map(Value::as_f64).collect::<Vec<_>>();
            return self.numbers(path, &numbers(a), &numbers(b));
        }
        a.iter().zip(b).enumerate().for_each(|(k, (a, b))| self.compare(&format!("{path}[{k}]"), a, b));
    }

    fn numbers(&mut self, path: &str, a: &[Option<f64>], b: &[Option<f64>]) {
        let size = a.iter().chain(b).flatten().fold(0.0, |size: f64, x| size.max(x.abs()));
        let near = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() <= ROUNDING * size + ZERO,
            _ => a == b,
        };
        if !a.iter().zip(b).all(near) {
            let list = |x: &[Option<f64>]| x.iter().flatten().map(f64::to_string).collect::<Vec<_>>().join(", ");
            self.found.push(format!("{path} is {}, and {} after reading", list(a), list(b)));
        }
    }
}

/// Returns the constants of a transmission that a kind of loop joint uses.
fn used_constants(kind: Option<&Value>) -> &'static [&'static str] {
    match kind.and_then(Value::as_str) {
        Some("Gear") => &["teeth", "references"],
        Some("Rack") => &["radius", "references"],
        Some("Screw") => &["pitch"],
        Some("Pulley") => &["ratio", "ground"],
        _ => &[],
    }
}

/// Returns a list sorted by a key of its tables; equal ones keep their order.
fn sorted(list: &Value, key: &str) -> Value {
    let mut list = list.as_array().cloned().unwrap_or_default();
    list.sort_by_key(|item| item[key].as_i64().unwrap_or(-1));
    Value::Array(list)
}

/// Returns a quaternion `x, y, z, w` with the sign that makes its largest component positive.
fn upright(q: &Value) -> Value {
    let Some(list) = q.as_array() else { return q.clone() };
    let numbers: Vec<f64> = list.iter().filter_map(Value::as_f64).collect();
    // components of equal size: the first one within rounding
    let size = numbers.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let sign = numbers.iter().find(|x| x.abs() > size * (1.0 - 1e-6)).map_or(1.0, |x| x.signum());
    numbers.into_iter().map(|x| x * sign).collect()
}

/// Returns the beginning of a value's text.
fn shown(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(80) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
