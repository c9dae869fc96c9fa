//! `tumble --help`: the commands in groups; the exit codes below the help of each command.

use crate::args::Tumble;
use clap::{Command, CommandFactory};

/// The commands, grouped by purpose; clap would print one list.
const GROUPS: [(&str, &[&str]); 5] = [
    ("Simulate", &["run", "view"]),
    ("Caves", &["cave", "serve", "facet", "console", "relay", "caves", "calibrate", "mpcdi"]),
    ("Recordings", &["replay", "verify", "recover"]),
    ("Files", &["check", "spheretree", "scenes"]),
    ("Shell", &["completions", "help"]),
];

/// Commands that a signal ends, and a second signal ends at once.
const SIGNALED: [&str; 5] = ["cave", "serve", "facet", "relay", "replay"];

const EXIT_CODES: &str = "Exit codes:
  0    success
  1    failure at run time, such as a full disk or a lost graphics device
  2    bad usage or input, such as an unknown option or a file with a mistake";
const SECOND_SIGNAL: &str = "\n  130  ended at once by a second Ctrl-C";

/// Returns the command line with its help.
pub fn command() -> Command {
    let bare = Tumble::command().mut_subcommands(with_exit_codes);
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{}Options:\n{{options}}{{after-help}}",
        groups(&bare)
    );
    bare.help_template(template)
        .after_help(format!("{EXIT_CODES}{SECOND_SIGNAL}\n\nOptions of a command: tumble COMMAND --help"))
}

fn with_exit_codes(command: Command) -> Command {
    let own = command.get_after_help().map_or(String::new(), |help| format!("{help}\n\n"));
    let second = if SIGNALED.contains(&command.get_name()) { SECOND_SIGNAL } else { "" };
    command.after_help(format!("{own}{EXIT_CODES}{second}"))
}

/// Formats the commands with their descriptions, group by group.
fn groups(command: &Command) -> String {
    let about = |name: &str| match command.find_subcommand(name).and_then(Command::get_about) {
        Some(about) => about.to_string(),
        None => "Print the help of a command".into(), // clap adds `help` itself
    };
    let line = |name: &&str| format!("  {name:<12} {}\n", about(name));
    GROUPS.iter().map(|(group, names)| format!("{group}:\n{}\n", names.iter().map(line).collect::<String>())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_is_in_one_group() {
        let mut grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        let command = Tumble::command();
        let mut all: Vec<&str> = command.get_subcommands().map(Command::get_name).chain(["help"]).collect();
        grouped.sort_unstable();
        all.sort_unstable();
        assert_eq!(grouped, all);
    }
}
