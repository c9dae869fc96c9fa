//! `tumble console`: asks the console of a run over its link.

use super::read_token;
use crate::cave::args::{ConsoleCommand, ConsoleOptions};
use crate::cave::lock;
use crate::failure::Failure;
use serde_json::Value;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::str::FromStr;
use std::time::Duration;
use tumble::net::control::{Action, is_recording_name};
use tumble::render::CalibrationPattern;

/// Time to connect, and to wait for an answer: longer than the run may take for it.
const TIMEOUT: Duration = Duration::from_secs(12);
/// Maximum length of an answer, bytes.
const MAX_ANSWER_BYTES: u64 = 8 << 20;

/// Asks the console for one thing and prints the answer.
///
/// # Errors
/// Exit code 1: no console answers, it refuses, or the status has alarms. Exit code 2: bad usage.
pub fn console(options: &ConsoleOptions) -> Result<(), Failure> {
    let title = format!("the console at {}", options.address);
    let failed = |why: &dyn std::fmt::Display| Failure::run(&title, why);
    let token = match &options.token_file {
        Some(file) => read_token(file)?,
        None => lock::find_console(options.address)?.ok_or_else(|| {
            failed(&"no run of this user on this machine has it; give the token of another one with --token-file FILE")
        })?,
    };
    let action = match &options.command {
        ConsoleCommand::Status => Action::Status,
        ConsoleCommand::Log => Action::Log,
        ConsoleCommand::Pause => Action::Pause,
        ConsoleCommand::Resume => Action::Resume,
        ConsoleCommand::Reset => Action::Reset,
        ConsoleCommand::Next => Action::Next,
        ConsoleCommand::Stop => Action::Stop,
        ConsoleCommand::Unrecord => Action::Unrecord,
        ConsoleCommand::Record { file } => Action::Record(recording_name(file)?),
        ConsoleCommand::Replay { file } => Action::Replay(recording_name(file)?),
        ConsoleCommand::Pattern { name } => {
            let pattern = CalibrationPattern::from_str(name).map(|_| ());
            pattern
                .or_else(|why| if name == "off" { Ok(()) } else { Err(why) })
                .map_err(|why| Failure::input(format!("{name}: {why}, or off")))?;
            Action::Pattern(name.clone())
        }
    };
    let (code, body) = ask(options.address, &token, &action).map_err(|e| failed(&e))?;
    let text = String::from_utf8_lossy(&body);
    let value: Value = serde_json::from_str(&text).unwrap_or_default();
    let printed = match (options.json || code != 200, &action) {
        (true, Action::Log) if code == 200 => {
            serde_json::json!({ "lines": text.lines().collect::<Vec<_>>() }).to_string()
        }
        (true, _) if options.json => text.trim_end().to_owned(),
        (true, _) => return Err(failed(&value["error"].as_str().unwrap_or("an answer that is not understood"))),
        (false, Action::Log) => text.trim_end().to_owned(),
        (false, Action::Status) => lines(&value),
        (false, _) => value["done"].as_str().unwrap_or("done").to_owned(),
    };
    crate::cave::server::say(&format!("{printed}\n"))?;
    let alarms: Vec<&str> = value["alarms"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    match (code, alarms.is_empty()) {
        (200, true) => Ok(()),
        (200, false) => Err(failed(&alarms.join("; "))),
        _ => Err(failed(&value["error"].as_str().unwrap_or("refused"))),
    }
}

/// Sends a request; returns the status code and the body of the answer.
fn recording_name(file: &str) -> Result<String, Failure> {
    if is_recording_name(file) {
        return Ok(file.to_owned());
    }
    let why = "expected the name of a recording without folders that ends with .mcap";
    Err(Failure::input(format!("{file}: {why}; it lies where the run was started")))
}

fn ask(at: SocketAddr, token: &str, action: &Action) -> Result<(u16, Vec<u8>), String> {
    let text = |e: std::io::Error| e.to_string();
    let mut stream = TcpStream::connect_timeout(&at, TIMEOUT).map_err(text)?;
    stream.set_read_timeout(Some(TIMEOUT)).and_then(|()| stream.set_write_timeout(Some(TIMEOUT))).map_err(text)?;
    let (method, path) = action.request();
    let request =
        format!("{method} {path} HTTP/1.1\r\nHost: {at}\r\nAuthorization: Bearer {token}\r\nContent-Length: 0\r\n\r\n");
    stream.write_all(request.as_bytes()).map_err(text)?;
    let mut answer = Vec::new();
    stream.take(MAX_ANSWER_BYTES).read_to_end(&mut answer).map_err(text)?;
    let end = answer.windows(4).position(|four| four == b"\r\n\r\n").ok_or("no answer of a console")?;
    let head = String::from_utf8_lossy(&answer[..end]);
    let code =
        head.strip_prefix("HTTP/1.1 ").and_then(|head| head.get(..3)?.parse().ok()).ok_or("no answer of a console")?;
    Ok((code, answer[end + 4..].to_vec()))
}

/// Returns the status as lines for a person.
fn lines(status: &Value) -> String {
    let number = |value: &Value, digits: usize| format!("{:.digits$}", value.as_f64().unwrap_or(0.0));
    let word = |value: &Value| value.as_str().unwrap_or("").to_owned();
    let mut text = format!(
        "{} in {}: frame {}, t = {} s, {} frames/s, {} s behind{}{}{}",
        word(&status["scene"]),
        word(&status["cave"]),
        status["frame"],
        number(&status["simulated_s"], 2),
        number(&status["frames_per_s"], 1),
        number(&status["behind_s"], 2),
        status["tracker_lead_ms"].as_f64().map_or(String::new(), |ms| format!(", heads predicted by {ms:.1} ms")),
        if status["paused"] == true { ", paused" } else { "" },
        status["recording"].as_str().map_or(String::new(), |file| format!(", recording {file}")),
    );
    for facet in status["facets"].as_array().into_iter().flatten() {
        text += &format!(
            "\n  {:<12} {:<8} frame {}, {} frames/s, drawn in {} ms, {} late, {} missing, dropped {} times, {} of {} pictures black",
            word(&facet["name"]),
            word(&facet["membership"]),
            facet["frame"],
            number(&facet["frames_per_s"], 1),
            number(&facet["draw_ms"], 2),
            facet["late"],
            facet["missing"],
            facet["dropped"],
            facet["black"],
            facet["pictures"],
        );
    }
    text
}
