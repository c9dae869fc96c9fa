//! The console's connections: one request each, with a time-out, in a thread of its own.

use super::{Asked, Shown, lock};
use crate::cave::listener::Listener;
use crate::cave::request::receive;
use std::io::Write;
use std::net::{SocketAddr, TcpStream};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tumble::net::control::{Action, MAX_REQUEST_BYTES, Refusal, read_request};

/// Time for a request to arrive, and again for its answer to be taken.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(3);
/// Time for the run to do what is asked.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(10);
/// Maximum number of connections at a time; further ones are closed at once.
const MAX_CONNECTIONS: usize = 16;
/// Fields that keep browsers from guessing types, framing the page or loading anything else.
const SAFE: &str = "X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\nCache-Control: no-store\r\nContent-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src blob:; connect-src 'self'\r\n";

/// Data that all connections of a console share.
struct Context {
    token: String,
    shown: Arc<Mutex<Shown>>,
    ask: SyncSender<Asked>,
}

/// Starts to serve consoles at an address.
pub fn start(
    at: SocketAddr,
    token: String,
    shown: Arc<Mutex<Shown>>,
    ask: SyncSender<Asked>,
) -> std::io::Result<Listener> {
    let context = Context { token, shown, ask };
    Listener::start(at, "console", MAX_CONNECTIONS, move |stream| {
        let _ = serve(stream, &context); // a client that goes away needs no answer
    })
}

fn serve(mut stream: TcpStream, context: &Context) -> std::io::Result<()> {
    stream.set_write_timeout(Some(REQUEST_TIMEOUT))?;
    let limit = (MAX_REQUEST_BYTES, Refusal::TooLong);
    let read = receive(&mut stream, REQUEST_TIMEOUT, limit, |request| read_request(request, &context.token))?;
    let action = match read {
        Ok(action) => action,
        Err(refusal) => return send(&mut stream, refusal.status(), "application/json", &error(&refusal.to_string())),
    };
    let shown = || lock(&context.shown);
    match action {
        Action::Page => send(&mut stream, 200, "text/html; charset=utf-8", include_bytes!("page.html")),
        Action::Status => {
            let status = shown().status.clone();
            send(&mut stream, 200, "application/json", status.as_bytes())
        }
        Action::Log => {
            let lines: String = shown().lines.iter().flat_map(|line| [line.as_str(), "\n"]).collect();
            send(&mut stream, 200, "text/plain; charset=utf-8", lines.as_bytes())
        }
        Action::Picture(facet) => {
            let picture = shown().pictures.get(&facet).cloned();
            match picture {
                Some(png) => send(&mut stream, 200, "image/png", &png),
                None => send(&mut stream, 404, "application/json", &error("no picture of this facet yet")),
            }
        }
        action => {
            let (code, text) = perform(action, context);
            send(&mut stream, code, "application/json", &text)
        }
    }
}

/// Passes an action to the run and waits for the answer.
fn perform(action: Action, context: &Context) -> (u16, Vec<u8>) {
    let (answer, answered) = sync_channel(1);
    if context.ask.try_send(Asked { action, answer }).is_err() {
        return (503, error("too many actions wait for the run"));
    }
    match answered.recv_timeout(ANSWER_TIMEOUT) {
        Ok(Ok(done)) => (200, serde_json::json!({ "done": done }).to_string().into_bytes()),
        Ok(Err(why)) => (409, error(&why)),
        Err(_) => (504, error("the run does not answer")),
    }
}

fn error(why: &str) -> Vec<u8> {
    serde_json::json!({ "error": why }).to_string().into_bytes()
}

fn send(stream: &mut TcpStream, code: u16, kind: &str, body: &[u8]) -> std::io::Result<()> {
    let reason = match code {
        200 => "OK",
        401 => "Unauthorized",
        404 => "Not Found",
        _ => "Refused",
    };
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {code} {reason}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n{SAFE}\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.flush()
}
