//! Connections of browsers: one request each, and for the page's WebSocket a thread that reads and one
//! that writes.

use super::crowd::Crowd;
use crate::cave::facet_report::Reporter;
use crate::cave::request::receive;
use std::io::{ErrorKind, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tumble::net::browser::{BrowserMessage, MAX_MESSAGE_BYTES, MAX_REQUEST_BYTES, Refusal, Request, read_request};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, WebSocket, handshake::derive_accept_key};

/// Time for a request to arrive.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(3);
/// Time for a browser to say how it draws.
const HELLO_TIMEOUT: Duration = Duration::from_secs(20);
/// Time for a message to leave.
const WRITE_TIMEOUT: Duration = Duration::from_secs(10);
/// Interval at which a silent connection is looked at.
const POLL_INTERVAL: Duration = Duration::from_millis(500);
/// Messages that wait for a browser: a frame, its `show`, and one more of each.
const MAX_WAITING: usize = 4;
/// Fields that keep browsers from guessing types, framing the page, loading anything else, and passing
/// the link on.
const SAFE: &str = "X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\nCache-Control: no-store\r\nContent-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'\r\n";

const PAGE: &str = concat!(
    include_str!("page.html"),
    "<script>\n",
    include_str!("webgl.js"),
    "</script>\n<script>\n",
    include_str!("webgpu.js"),
    "</script>\n<script>\n",
    include_str!("screen.js"),
    "</script>\n</html>\n",
);

/// Data that all connections of a facet share.
pub struct Shared {
    pub key: String,
    pub crowd: Mutex<Crowd>,
    /// A browser has drawn, joined or left.
    pub changed: Condvar,
    pub reporter: Reporter,
    /// Title of the facet in messages.
    pub title: String,
}

impl Shared {
    pub fn crowd(&self) -> MutexGuard<'_, Crowd> {
        self.crowd.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Prints a message, and sends it to the operator's console.
    pub fn say(&self, what: &str) {
        eprintln!("{}: {what}", self.title);
        self.reporter.line(what);
    }
}

/// Serves a connection to its end.
pub fn serve(mut stream: TcpStream, shared: &Shared) {
    // a browser that goes away needs no answer
    let _ = answer(&mut stream, shared);
    let _ = stream.shutdown(Shutdown::Both);
}

fn answer(stream: &mut TcpStream, shared: &Shared) -> std::io::Result<()> {
    stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
    stream.set_nodelay(true)?;
    let limit = (MAX_REQUEST_BYTES, Refusal::Malformed);
    match receive(stream, REQUEST_TIMEOUT, limit, |request| read_request(request, &shared.key))? {
        Ok(Request::Page) => {
            let head = format!("Content-Type: text/html; charset=utf-8\r\nContent-Length: {}\r\n{SAFE}", PAGE.len());
            send(stream, "200 OK", &head, PAGE)
        }
        Ok(Request::Socket { nonce }) => {
            let head = format!(
                "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {}\r\n\r\n",
                derive_accept_key(nonce.as_bytes())
            );
            stream.write_all(head.as_bytes())?;
            screen(stream, shared)
        }
        Err(refusal) => {
            let reason = if refusal == Refusal::Forbidden { "Forbidden" } else { "Bad Request" };
            send(stream, &format!("{} {reason}", refusal.status()), "Content-Length: 0\r\n", "")
        }
    }
}

fn send(stream: &mut TcpStream, status: &str, fields: &str, body: &str) -> std::io::Result<()> {
    stream.write_all(format!("HTTP/1.1 {status}\r\nConnection: close\r\n{fields}\r\n").as_bytes())?;
    stream.write_all(body.as_bytes())?;
    stream.flush()
}

/// Returns a WebSocket over a connection whose handshake is done.
fn socket(stream: &TcpStream) -> std::io::Result<WebSocket<TcpStream>> {
    let config = WebSocketConfig::default()
        .max_message_size(Some(MAX_MESSAGE_BYTES))
        .max_frame_size(Some(MAX_MESSAGE_BYTES))
        .read_buffer_size(4096)
        .write_buffer_size(0);
    Ok(WebSocket::from_raw_socket(stream.try_clone()?, Role::Server, Some(config)))
}

/// Serves a browser that shows the facet, until it goes away or breaks the protocol.
fn screen(stream: &TcpStream, shared: &Shared) -> std::io::Result<()> {
    let mut incoming = socket(stream)?;
    stream.set_read_timeout(Some(POLL_INTERVAL))?;
    let until = Instant::now() + HELLO_TIMEOUT;
    let backend = loop {
        match next(&mut incoming) {
            Next::Silence if Instant::now() < until => {}
            Next::Message(BrowserMessage::Hello(backend)) => break backend,
            Next::Message(BrowserMessage::Failed(why)) => {
                shared.say(&format!("a browser cannot draw: {why}"));
                return Ok(());
            }
            _ => return Ok(()),
        }
    };
    let (outbox, inbox) = sync_channel(MAX_WAITING);
    let Some(id) = shared.crowd().join(backend, outbox) else {
        shared.say("a browser is turned away: there are too many");
        return Ok(());
    };
    let peer = stream.peer_addr().map_or("somewhere".into(), |at| at.ip().to_string());
    shared.say(&format!("a browser at {peer} joins and draws by {}", backend.name()));
    let (outgoing, writing) = (socket(stream)?, stream.try_clone()?);
    let writer =
        std::thread::Builder::new().name("browser".into()).spawn(move || write_all(outgoing, &inbox, &writing));
    if writer.is_ok() {
        read_all(&mut incoming, id, shared);
    }
    shared.crowd().leave(id);
    shared.changed.notify_all();
    shared.say(&format!("the browser at {peer} has left"));
    let _ = stream.shutdown(Shutdown::Both); // ends the other thread
    Ok(())
}

/// Writes messages until there is no sender left.
fn write_all(mut socket: WebSocket<TcpStream>, inbox: &Receiver<Vec<u8>>, stream: &TcpStream) {
    while let Ok(message) = inbox.recv() {
        if socket.send(Message::binary(message)).is_err() {
            break;
        }
    }
    let _ = stream.shutdown(Shutdown::Both);
}

/// Reads messages until the browser goes away, breaks the protocol, or was removed.
fn read_all(socket: &mut WebSocket<TcpStream>, id: u64, shared: &Shared) {
    loop {
        match next(socket) {
            Next::Silence if shared.crowd().has(id) => {}
            Next::Message(message) => {
                let well = shared.crowd().take(id, &message, Instant::now());
                shared.changed.notify_all();
                if let BrowserMessage::Failed(why) = &message {
                    shared.say(&format!("a browser cannot draw: {why}"));
                }
                if !well {
                    return;
                }
            }
            Next::Silence | Next::End => return,
        }
    }
}

/// Outcome of a read.
enum Next {
    Message(BrowserMessage),
    /// Nothing for a while.
    Silence,
    /// The connection has ended, or must: by anything that the page does not send.
    End,
}

fn next(socket: &mut WebSocket<TcpStream>) -> Next {
    match socket.read() {
        Ok(Message::Text(text)) => BrowserMessage::read(&text).map_or(Next::End, Next::Message),
        Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Next::Silence,
        Ok(_) | Err(_) => Next::End,
    }
}
