//! The JSON Schema of cave files against the shipped caves and the parser.

use crate::caves::SMALL;
use std::collections::BTreeSet;
use toml::de::{DeTable, DeValue};
use tumble_scene::cave::{Cave, shipped_caves};

fn schema() -> serde_json::Value {
    serde_json::from_str(include_str!("../../../../caves/cave.schema.json")).unwrap()
}

/// Returns the violations of a schema by a value, for the few keywords of JSON Schema that ours
/// uses; any other keyword is an error.
fn violations(
    schema: &serde_json::Value,
    root: &serde_json::Value,
    value: &DeValue<'_>,
    at: &str,
    out: &mut Vec<String>,
) {
    let number = |v: &DeValue<'_>| match v {
        DeValue::Float(f) => f.as_str().parse::<f64>().ok(),
        DeValue::Integer(i) => i.as_str().parse::<f64>().ok(),
        _ => None,
    };
    let mut wrong = |what: String| out.push(format!("{at}: {what}"));
    for (word, rule) in schema.as_object().unwrap() {
        match word.as_str() {
            "$schema"
            | "$id"
            | "$defs"
            | "title"
            | "description"
            | "default"
            | "required"
            | "additionalProperties"
            | "properties"
            | "items"
            | "minItems"
            | "maxItems" => {}
            "$ref" => {
                let name = rule.as_str().unwrap().strip_prefix("#/$defs/").unwrap();
                violations(&root["$defs"][name], root, value, at, out);
                return;
            }
            "type" => {
                let fits = match rule.as_str().unwrap() {
                    "object" => matches!(value, DeValue::Table(_)),
                    "array" => matches!(value, DeValue::Array(_)),
                    "string" => matches!(value, DeValue::String(_)),
                    "boolean" => matches!(value, DeValue::Boolean(_)),
                    "integer" => matches!(value, DeValue::Integer(_)),
                    "number" => number(value).is_some(),
                    other => panic!("type {other}"),
                };
                if !fits {
                    wrong(format!("is no {rule}"));
                    return;
                }
            }
            "enum" => {
                if !rule.as_array().unwrap().iter().any(|one| one.as_str() == value.as_str()) {
                    wrong(format!("is none of {rule}"));
                }
            }
            "minimum" if number(value).unwrap() < rule.as_f64().unwrap() => wrong(format!("is below {rule}")),
            "maximum" if number(value).unwrap() > rule.as_f64().unwrap() => wrong(format!("is above {rule}")),
            "exclusiveMinimum" if number(value).unwrap() <= rule.as_f64().unwrap() => {
                wrong(format!("is not above {rule}"))
            }
            "minimum" | "maximum" | "exclusiveMinimum" => {}
            other => panic!("the test knows no word `{other}` of schemas"),
        }
    }
    if let DeValue::Table(table) = value {
        for required in schema["required"].as_array().into_iter().flatten() {
            if table.get(required.as_str().unwrap()).is_none() {
                out.push(format!("{at}: has no {required}"));
            }
        }
        for (key, item) in table.iter() {
            match schema["properties"].get(key.get_ref().as_ref()) {
                Some(rule) => violations(rule, root, item.get_ref(), &format!("{at}/{}", key.get_ref()), out),
                None if schema["additionalProperties"] == false => {
                    out.push(format!("{at}: unknown key {}", key.get_ref()))
                }
                None => {}
            }
        }
    }
    if let DeValue::Array(items) = value {
        let count = items.len() as u64;
        if schema["minItems"].as_u64().is_some_and(|least| count < least)
            || schema["maxItems"].as_u64().is_some_and(|most| count > most)
        {
            out.push(format!("{at}: has {count} entries"));
        }
        if schema["items"].is_object() {
            items
                .iter()
                .enumerate()
                .for_each(|(i, item)| violations(&schema["items"], root, item.get_ref(), &format!("{at}[{i}]"), out));
        }
    }
}

fn against_schema(text: &str) -> Vec<String> {
    let (schema, table) = (schema(), DeTable::parse(text).unwrap());
    let mut out = Vec::new();
    violations(&schema, &schema, &DeValue::Table(table.into_inner()), "", &mut out);
    out
}

#[test]
fn shipped_caves_satisfy_the_schema_and_wrong_ones_do_not() {
    for cave in shipped_caves() {
        assert_eq!(against_schema(cave.text), Vec::<String>::new(), "{}", cave.name);
    }
    for (right, wrong) in [
        ("eye_m = [0, 0, 1.5]", "eye = [0, 0, 1.5]"),
        ("size_px = [800, 600]", "size_px = [0, 600]"),
        ("screen = \"s\"", "screen = 3"),
        ("eye_m = [0, 0, 1.5]", "eye_m = [0, 0]"),
    ] {
        let text = SMALL.replace(right, wrong);
        assert!(!against_schema(&text).is_empty() && Cave::parse(&text, "my.toml").is_err(), "{wrong}");
    }
}

/// Returns the keys that the parser knows in a table, from its message about an unknown key: the
/// keys that are present, and the keys it names as available.
fn known_keys(text: &str, table: &str) -> BTreeSet<String> {
    let error = Cave::parse(text, "my.toml").expect_err("there is an unknown key");
    let problem = error
        .problems()
        .iter()
        .find(|p| p.message.contains("`zzzzzzzzzzzz`") && p.message.contains(table))
        .unwrap_or_else(|| panic!("{table}: {error}"));
    let list = problem
        .expected
        .split_once(": ")
        .map_or_else(|| problem.expected.split_once("only ").map_or("", |(_, list)| list), |(_, list)| list);
    list.split('`')
        .filter(|word| !word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase() || c == '_'))
        .map(str::to_owned)
        .collect()
}

/// Each shape has keys of its own; the schema has those of all.
#[test]
fn schema_and_parser_know_the_same_keys_of_screens() {
    let mut in_parser: BTreeSet<String> = ["name", "shape"].map(str::to_owned).into();
    for shape in ["flat", "cylinder", "equirectangular", "fisheye", "cube_map", "mesh"] {
        let start = SMALL.split("lower_left_m").next().unwrap();
        in_parser.extend(known_keys(&format!("{start}shape = \"{shape}\"\nzzzzzzzzzzzz = 1\n"), "screen"));
    }
    let required = ["lower_left_m", "lower_right_m", "upper_left_m", "radius_m", "height_m", "mesh_file"];
    in_parser.extend(required.map(str::to_owned));
    let rule = &schema()["$defs"]["screen"];
    assert_eq!(in_parser, rule["properties"].as_object().unwrap().keys().cloned().collect());
    assert_eq!(rule["required"], serde_json::json!(["name"]));
}

#[test]
fn schema_and_parser_know_the_same_keys() {
    let odd = "zzzzzzzzzzzz = 1\n";
    let schema = schema();
    let tables = [
        (format!("{odd}{SMALL}"), "the cave", "", vec!["user", "screen", "facet"]),
        (SMALL.replace("name = \"u\"\n", &format!("name = \"u\"\n{odd}")), "user", "user", vec!["name", "eye_m"]),
        (format!("{SMALL}{odd}"), "facet", "facet", vec!["name", "screen", "size_px"]),
        (
            format!("{SMALL}[[node]]\nname = \"n\"\naddress = \"127.0.0.1\"\n{odd}"),
            "node",
            "node",
            vec!["name", "address"],
        ),
        (format!("{SMALL}color = {{ {} }}\n", odd.trim()), "color", "color", vec![]),
        (format!("{SMALL}[sync]\n{odd}"), "sync", "sync", vec![]),
        (format!("{SMALL}[security]\nkey_file = \"k\"\n{odd}"), "security", "security", vec!["key_file"]),
        (format!("{SMALL}[recording]\nfile = \"k\"\n{odd}"), "recording", "recording", vec!["file"]),
        (format!("{SMALL}[tracker]\n{odd}"), "tracker", "tracker", vec![]),
    ];
    for (text, called, name, present) in tables {
        let rule = if name.is_empty() { &schema } else { &schema["$defs"][name] };
        let in_schema: BTreeSet<String> = rule["properties"].as_object().unwrap().keys().cloned().collect();
        let mut in_parser = known_keys(&text, called);
        in_parser.extend(present.iter().map(|key| (*key).to_owned()));
        assert_eq!(in_parser, in_schema, "{called}");
        let required: BTreeSet<&str> =
            rule["required"].as_array().into_iter().flatten().filter_map(|key| key.as_str()).collect();
        assert_eq!(required, present.iter().copied().collect(), "{called}: required keys");
        assert_eq!(rule["additionalProperties"], false, "{called}");
    }
}
