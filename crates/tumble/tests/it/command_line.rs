//! Help, completions and the reference of the command line.

use crate::common::*;
use std::collections::BTreeSet;
use std::process::Command;

const COMMANDS: [&str; 14] = [
    "run",
    "view",
    "cave",
    "serve",
    "facet",
    "relay",
    "caves",
    "calibrate",
    "replay",
    "recover",
    "check",
    "spheretree",
    "scenes",
    "completions",
];
/// Commands that end with 130 at a second signal.
const RUNS: [&str; 5] = ["cave", "serve", "facet", "relay", "replay"];

/// Long options in a text.
fn options(text: &str) -> BTreeSet<String> {
    let word = |tail: &str| tail.chars().take_while(|c| c.is_ascii_lowercase() || *c == '-').collect::<String>();
    text.match_indices("--")
        .map(|(at, _)| format!("--{}", word(&text[at + 2..])))
        .filter(|o| o[2..].starts_with(char::is_alphabetic))
        .collect()
}

#[test]
fn every_help_names_the_exit_codes() {
    for name in COMMANDS {
        let help = succeed(&[name, "--help"]);
        let codes: Vec<&str> = help.lines().skip_while(|line| *line != "Exit codes:").skip(1).collect();
        let numbers: Vec<&str> = codes.iter().filter_map(|line| line.split_whitespace().next()).take(4).collect();
        let expected: &[&str] = if RUNS.contains(&name) { &["0", "1", "2", "130"] } else { &["0", "1", "2"] };
        assert_eq!(numbers, expected, "{name}: {help}");
    }
    assert!(succeed(&["--help"]).contains("Exit codes:"));
}

#[test]
fn the_help_lists_every_command_in_a_group_on_one_line() {
    let help = succeed(&["--help"]);
    for group in ["Simulate:", "Caves:", "Recordings:", "Files:", "Shell:"] {
        assert!(help.lines().any(|line| line == group), "no {group} in {help}");
    }
    for name in COMMANDS {
        let lines: Vec<&str> = help.lines().filter(|l| l.split_whitespace().next() == Some(name)).collect();
        assert!(lines.len() == 1 && lines[0].len() <= 100, "{name}: {lines:?}");
    }
}

#[test]
fn completions_complete() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = succeed(&["completions", shell]);
        for name in COMMANDS {
            assert!(script.contains(name), "{shell} does not know {name}");
        }
        assert!(script.contains("debug-draw"), "{shell} does not know --debug-draw");
    }
    let said = fail(&["completions", "cobol"], 2);
    assert!(said.contains("cobol") && said.contains("zsh"), "{said}");
    let folder = Folder::new("completions");
    let script = folder.write("tumble.bash", succeed(&["completions", "bash"]));
    // the completions of "tumble sph<tab>" and "tumble run --scr<tab>"
    for (words, answer) in [("tumble sph", "spheretree"), ("tumble run --scr", "--screenshot")] {
        let last = words.split(' ').next_back().unwrap();
        let count = words.split(' ').count() - 1;
        let asked = format!(
            "source {script}; COMP_WORDS=({words}); COMP_CWORD={count}; COMP_LINE='{words}'; _tumble tumble '{last}' x; echo \"${{COMPREPLY[@]}}\""
        );
        let Ok(out) = Command::new("bash").args(["--norc", "-c", &asked]).output() else { return };
        assert_eq!(String::from_utf8_lossy(&out.stdout).trim(), answer, "{}", String::from_utf8_lossy(&out.stderr));
    }
}

/// `docs/command.md` has a section for each command, with each of its options and no others.
#[test]
fn the_reference_names_every_option() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/command.md");
    let reference = std::fs::read_to_string(path).unwrap();
    let sections: Vec<&str> = reference.split("\n## ").collect();
    for name in COMMANDS {
        let section = sections.iter().find(|s| s.lines().next() == Some(&format!("tumble {name}")));
        let section = section.unwrap_or_else(|| panic!("docs/command.md has no section on tumble {name}"));
        let help = match name {
            // its options are those of its own commands
            "calibrate" => ["patterns", "solve"].map(|action| succeed(&[name, action, "--help"])).concat(),
            _ => succeed(&[name, "--help"]),
        };
        let mut expected = options(&help);
        // options of every command, described once; and an option of features that are not always
        // built
        expected.remove("--help");
        let mut described = options(section);
        described.remove("--foxglove");
        expected.remove("--foxglove");
        assert_eq!(described, expected, "docs/command.md on tumble {name}");
    }
    for line in succeed(&["cave", "--help"]).lines().skip_while(|l| *l != "Exit codes:").skip(1).take(4) {
        let (code, meaning) = line.trim().split_once("  ").unwrap();
        let row = format!("| {code} | {} |", meaning.trim());
        assert!(reference.contains(&row), "docs/command.md has no line {row}");
    }
}
