//! The `tumble` command: runs scenes, shows them in windows and caves, checks files and builds
//! sphere trees.
//!
//! Exit codes: 0 success, 1 failure at run time, 2 bad usage or input.

mod args;
mod atomic_file;
mod audio;
mod calibrate;
mod capture;
mod cave;
mod caves;
mod check;
mod divergence;
mod failure;
mod frames_folder;
mod help;
mod mpcdi;
mod player;
mod progress;
mod recording_file;
mod run;
mod spheretree;
mod summary;
mod verify;
mod video;
mod view;

use args::{Command, Tumble};
use clap::FromArgMatches;
use failure::Failure;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    set_runtime_dir();
    exit_on_closed_stdout();
    // a closed stderr loses the line, and nothing else
    tumble::scene::set_slow_load_listener(|line| _ = writeln!(std::io::stderr(), "{line} …"));
    let command = match Tumble::from_arg_matches(&help::command().get_matches()) {
        Ok(typed) => typed.command,
        Err(error) => error.exit(),
    };
    let outcome = match command {
        Command::Run(options) => run::run(&options),
        Command::View(options) => view::view(&options),
        Command::Cave(options) => cave::cave(&options),
        Command::Serve(options) => cave::serve(&options),
        Command::Facet(options) => cave::facet(&options),
        Command::Console(options) => cave::console(&options),
        Command::Relay(options) => cave::relay(&options),
        Command::Replay(options) => cave::replay(&options),
        Command::Recover(options) => cave::recover(&options),
        Command::Verify(options) => verify::verify(&options),
        Command::Check(options) => check::check(&options),
        Command::SphereTree(options) => spheretree::spheretree(&options),
        Command::Scenes => scenes(),
        Command::Caves(options) => caves::caves(&options),
        Command::Calibrate(options) => calibrate::calibrate(&options),
        Command::Mpcdi(options) => mpcdi::mpcdi(&options),
        Command::Completions(options) => completions(options.shell),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            // if stderr is closed or full, the exit code still reports the failure
            let _ = std::io::stderr().write_all(failure.report().as_bytes());
            ExitCode::from(failure.code())
        }
    }
}

/// Names a runtime directory for graphics drivers, which complain on stderr without one, as over
/// ssh or in a container. Any folder satisfies them.
#[allow(unsafe_code)]
fn set_runtime_dir() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: nothing ran before in this process, so no other thread exists that could read the
        // environment.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
}

/// Ends the process with 0 and without a message if the reader of its output has closed the pipe,
/// as `head` does. If stdout fails for another reason, such as a full disk, the process ends with a
/// message and 1.
fn exit_on_closed_stdout() {
    let default_hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let message = panic.payload().downcast_ref::<String>();
        match message.and_then(|m| m.strip_prefix("failed printing to stdout: ")) {
            Some(why) if why.contains("Broken pipe") => std::process::exit(0),
            Some(why) => {
                // if stderr fails too, the exit code still reports the failure
                let _ = writeln!(std::io::stderr(), "error: stdout: {why}");
                std::process::exit(1)
            }
            None if message.is_some_and(|m| m.starts_with("failed printing to stderr")) => std::process::exit(1),
            None => default_hook(panic),
        }
    }));
}

fn scenes() -> Result<(), Failure> {
    for scene in tumble::scene::shipped() {
        println!("{:<12} {}", scene.name, scene.description());
    }
    Ok(())
}

fn completions(shell: clap_complete::Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut help::command(), "tumble", &mut script);
    print!("{}", String::from_utf8_lossy(&script));
    Ok(())
}
