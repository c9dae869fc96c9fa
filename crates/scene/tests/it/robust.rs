//! Damaged files give an error or a scene, never a panic, and always a report.

use proptest::prelude::*;
use tumble_scene::{SceneFile, shipped};

/// Reads `text`: every text gives a result, and every error can be displayed.
fn read(text: &str) {
    if let Err(error) = SceneFile::parse(text, "damaged.toml") {
        assert!(!error.problems().is_empty());
        let lines = text.split('\n').count();
        for problem in error.problems() {
            assert!((1..=lines).contains(&problem.line) && problem.column >= 1, "{problem:?}");
        }
        assert!(error.report(false).contains("damaged.toml"));
    }
}

/// The longest scenes, which are lists of numbers, are cut at every seventh byte unless `TUMBLE_SLOW=1`.
#[test]
fn every_scene_cut_at_every_byte_full_length() {
    let slow = std::env::var_os("TUMBLE_SLOW").is_some_and(|v| v == "1");
    for scene in shipped() {
        let stride = if slow || scene.text.len() < 23_000 { 1 } else { 7 };
        for end in (0..scene.text.len()).step_by(stride).filter(|&end| scene.text.is_char_boundary(end)) {
            read(&scene.text[..end]);
        }
    }
}

/// Returns the example of every key of articulated bodies.
fn articulated() -> &'static str {
    let reference = include_str!("../../../../scenes/README.md");
    reference.split("```toml\n").nth(1).unwrap().split("```").next().unwrap()
}

#[test]
fn articulated_bodies_cut_at_every_byte() {
    let text = articulated();
    (0..text.len()).filter(|&end| text.is_char_boundary(end)).for_each(|end| read(&text[..end]));
}

/// A damping of 1e-320 had an infinite compliance, which stopped the first step.
#[test]
fn values_too_small_for_an_inverse_are_zero() {
    let with = |damping: &str| {
        articulated().replace("damping_n_m_s_per_rad = 0.001", &format!("damping_n_m_s_per_rad = {damping}"))
    };
    assert_ne!(with("0"), articulated());
    let none = SceneFile::parse(&with("0"), "crane.toml").unwrap();
    assert_eq!(SceneFile::parse(&with("1e-320"), "crane.toml").unwrap(), none);
    assert_ne!(SceneFile::parse(&with("1e-299"), "crane.toml").unwrap(), none);
    let error = SceneFile::parse(&articulated().replace("mass_kg = 40", "mass_kg = 1e-310"), "crane.toml").unwrap_err();
    assert!(error.to_string().contains("mass_kg"), "{error}");
}

#[test]
fn deep_nesting_and_long_lines() {
    read(&"[".repeat(100_000));
    read(&format!("a = {}", "[".repeat(100_000)));
    read(&format!("a = {}", "{a=".repeat(50_000)));
    read(&format!("{} = 1", "a.".repeat(50_000)));
    read(&"x".repeat(1_000_000));
    read(&"\n\u{feff}é = 1\n".repeat(5_000));
    read("\u{feff}description = \"é\u{301}\"\n\u{301}x = 1");
}

const OTHERS: &[&str] = &[
    "nan",
    "-1",
    "0",
    "1e400",
    "[]",
    "[[[]]]",
    "{}",
    "\"\"",
    "true",
    "[1, 2, 3]",
    "{ type = \"box\" }",
    "{ count = 300 }",
    "\"rope_20\"",
    "\"fixed\"",
    "{ type = \"playback\", times_s = [], values_rad = [] }",
    "{ joint = \"wheel\" }",
    "[[\"jib\"]]",
];

#[test]
fn articulated_bodies_with_each_value_swapped_for_others() {
    let lines: Vec<&str> = articulated().lines().collect();
    for at in (0..lines.len()).filter(|&k| lines[k].contains(" = ")) {
        for value in OTHERS {
            let mut changed = lines.clone();
            let line = format!("{} = {value}", lines[at].split(" = ").next().unwrap_or(""));
            changed[at] = &line;
            let text = changed.join("\n");
            read(&text);
            // a valid scene can be built, or is refused with a reason
            if let Ok(scene) = SceneFile::parse(&text, "changed.toml") {
                let _ = scene.build().map_err(|error| assert!(!error.to_string().is_empty()));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes(which in 0usize..5, flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = shipped()[which].text.as_bytes().to_vec();
        for (at, byte) in flips {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        read(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn values_swapped_for_others(which in 0usize..5, line in any::<prop::sample::Index>(), value in prop::sample::select(vec![
        "nan", "-inf", "1e400", "9223372036854775807", "0xffffffffffffffff", "-1", "0", "[]", "[[[]]]", "{}", "\"\"", "true",
        "1979-05-27", "[1, \"a\", {}]", "\"\\u0000\"", "99999999999999999999999999", "{ type = \"box\" }",
    ])) {
        let lines: Vec<&str> = shipped()[which].text.lines().collect();
        let with_value: Vec<usize> = (0..lines.len()).filter(|&k| lines[k].contains(" = ")).collect();
        let at = with_value[line.index(with_value.len())];
        let changed: Vec<String> = lines.iter().enumerate().map(|(k, line)| match k == at {
            true => format!("{} = {value}", line.split(" = ").next().unwrap_or("")),
            false => (*line).to_owned(),
        }).collect();
        read(&changed.join("\n"));
    }
}
