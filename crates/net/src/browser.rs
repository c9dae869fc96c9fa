//! Messages of a web browser that shows a facet: its requests of HTTP/1.1 and its messages over the
//! WebSocket (RFC 6455), read from untrusted bytes.
//!
//! ```text
//! GET /KEY/          the page
//! GET /KEY/socket    the WebSocket, asked for by that page alone (Origin)
//! ```
//!
//! Everything else is forbidden, and the answer does not depend on why. Messages are short texts:
//! `hello webgl2`, `drawn 17`, `shown 17`, `failed WHY`.

use std::fmt;

/// Maximum length of a request, bytes.
pub const MAX_REQUEST_BYTES: usize = 8192;
/// Maximum length of a message, bytes.
pub const MAX_MESSAGE_BYTES: usize = 512;
/// Minimum length of a key, bytes.
pub const MIN_KEY_BYTES: usize = 16;
/// Maximum number of header fields.
const MAX_FIELDS: usize = 64;
/// Length of a nonce of RFC 6455, bytes in base64.
const NONCE_BYTES: usize = 24;

/// Request of a browser with the right key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// The page.
    Page,
    /// The WebSocket.
    Socket {
        /// `Sec-WebSocket-Key`: 24 bytes of base64.
        nonce: String,
    },
}

/// A request that is not answered but by its status code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Not HTTP, too long, or with a body.
    #[error("not a request of HTTP/1.1 without a body and of at most {MAX_REQUEST_BYTES} bytes")]
    Malformed,
    /// A wrong key or path, or a socket for another page.
    #[error("forbidden")]
    Forbidden,
}

impl Refusal {
    /// Returns the status code of the answer.
    pub fn status(self) -> u16 {
        match self {
            Refusal::Malformed => 400,
            Refusal::Forbidden => 403,
        }
    }
}

/// Reads a request. Returns `None` while its end has not arrived.
///
/// # Errors
/// [`Refusal`]. Without the right key the answer does not depend on the rest of the path.
pub fn read_request(bytes: &[u8], key: &str) -> Result<Option<Request>, Refusal> {
    let mut fields = [httparse::EMPTY_HEADER; MAX_FIELDS];
    let mut request = httparse::Request::new(&mut fields);
    match request.parse(bytes) {
        Ok(httparse::Status::Complete(length)) if length <= MAX_REQUEST_BYTES => {}
        Ok(httparse::Status::Partial) if bytes.len() < MAX_REQUEST_BYTES => return Ok(None),
        _ => return Err(Refusal::Malformed),
    }
    let (Some(method), Some(path)) = (request.method, request.path) else { return Err(Refusal::Malformed) };
    let field = |name: &str| {
        let mut all = request.headers.iter().filter(|f| f.name.eq_ignore_ascii_case(name));
        let one = all.next().and_then(|f| std::str::from_utf8(f.value).ok());
        one.filter(|_| all.next().is_none())
    };
    let named = |name: &str| request.headers.iter().any(|f| f.name.eq_ignore_ascii_case(name));
    if named("transfer-encoding") || named("content-length") && field("content-length") != Some("0") {
        return Err(Refusal::Malformed);
    }
    let (given, rest) = path.strip_prefix('/').and_then(|path| path.split_once('/')).unwrap_or(("", ""));
    // hashes are compared in constant time
    let right = key.len() >= MIN_KEY_BYTES && blake3::hash(given.as_bytes()) == blake3::hash(key.as_bytes());
    match (method, rest) {
        ("GET", "") if right => Ok(Some(Request::Page)),
        ("GET", "socket") if right => {
            socket(field).map(|nonce| Some(Request::Socket { nonce })).ok_or(Refusal::Forbidden)
        }
        _ => Err(Refusal::Forbidden),
    }
}

/// Returns the nonce of a socket that the page of this server asks for.
fn socket<'a>(field: impl Fn(&str) -> Option<&'a str>) -> Option<String> {
    let has = |name: &str, word: &str| {
        field(name).is_some_and(|value| value.split(',').any(|one| one.trim().eq_ignore_ascii_case(word)))
    };
    let (host, origin) = (field("host")?, field("origin")?);
    let of = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"))?;
    let nonce = field("sec-websocket-key")?;
    let base64 = |b: u8| b.is_ascii_alphanumeric() || b"+/=".contains(&b);
    let well = has("upgrade", "websocket")
        && has("connection", "upgrade")
        && field("sec-websocket-version") == Some("13")
        && of.eq_ignore_ascii_case(host)
        && nonce.len() == NONCE_BYTES
        && nonce.bytes().all(base64);
    well.then(|| nonce.to_owned())
}

/// Interface by which a page draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// WebGL 2.
    Webgl2,
    /// WebGPU.
    Webgpu,
}

impl Backend {
    /// Its name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Backend::Webgl2 => "webgl2",
            Backend::Webgpu => "webgpu",
        }
    }
}

/// Message of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BrowserMessage {
    /// The first one: how it draws.
    Hello(Backend),
    /// This frame is drawn and not shown yet.
    Drawn(u64),
    /// This frame is on the screen.
    Shown(u64),
    /// It cannot draw, and why: printable characters.
    Failed(String),
}

impl BrowserMessage {
    /// Reads a message; `None` for anything else.
    pub fn read(text: &str) -> Option<BrowserMessage> {
        let (word, rest) = text.split_once(' ').filter(|_| text.len() <= MAX_MESSAGE_BYTES)?;
        // numbers in the one form in which they are written
        let number = || rest.parse::<u64>().ok().filter(|n| n.to_string() == rest);
        match word {
            "hello" => {
                let backend = [Backend::Webgl2, Backend::Webgpu].into_iter().find(|b| b.name() == rest)?;
                Some(BrowserMessage::Hello(backend))
            }
            "drawn" => number().map(BrowserMessage::Drawn),
            "shown" => number().map(BrowserMessage::Shown),
            "failed" => {
                let printable = rest.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
                Some(BrowserMessage::Failed(printable))
            }
            _ => None,
        }
    }
}

impl fmt::Display for BrowserMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BrowserMessage::Hello(backend) => write!(f, "hello {}", backend.name()),
            BrowserMessage::Drawn(frame) => write!(f, "drawn {frame}"),
            BrowserMessage::Shown(frame) => write!(f, "shown {frame}"),
            BrowserMessage::Failed(why) => write!(f, "failed {why}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: &str = "0123456789abcdef0123456789abcdef";
    const SOCKET: [&str; 6] = [
        "Host: wall:47400",
        "Origin: http://wall:47400",
        "Connection: keep-alive, Upgrade",
        "Upgrade: websocket",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    ];

    fn ask(path: &str, fields: &[&str]) -> Result<Option<Request>, Refusal> {
        let first = format!("GET {path} HTTP/1.1");
        let text = [&[first.as_str()], fields, &["\r\n"]].concat().join("\r\n");
        for cut in 0..text.len() - 1 {
            assert_eq!(read_request(&text.as_bytes()[..cut], KEY), Ok(None), "{cut} of {text}");
        }
        read_request(text.as_bytes(), KEY)
    }

    #[test]
    fn the_key_opens_the_page_and_its_own_socket_alone() {
        assert_eq!(ask(&format!("/{KEY}/"), &["Host: wall"]), Ok(Some(Request::Page)));
        let socket = format!("/{KEY}/socket");
        let nonce = "dGhlIHNhbXBsZSBub25jZQ==".to_owned();
        assert_eq!(ask(&socket, &SOCKET), Ok(Some(Request::Socket { nonce })));
        // behind a proxy that encrypts
        let mut sealed = SOCKET;
        sealed[1] = "Origin: https://wall:47400";
        assert!(ask(&socket, &sealed).is_ok());
        for k in 0..SOCKET.len() {
            let without: Vec<&str> = SOCKET.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, f)| *f).collect();
            assert_eq!(ask(&socket, &without), Err(Refusal::Forbidden), "without {}", SOCKET[k]);
            let twice = [&SOCKET[..], &[SOCKET[k]]].concat();
            assert!(k > 1 || ask(&socket, &twice) == Err(Refusal::Forbidden), "twice {}", SOCKET[k]);
        }
        for origin in ["Origin: http://elsewhere", "Origin: null", "Origin: http://wall:47400.elsewhere"] {
            let mut foreign = SOCKET;
            foreign[1] = origin;
            assert_eq!(ask(&socket, &foreign), Err(Refusal::Forbidden), "{origin}");
        }
    }

    #[test]
    fn a_wrong_key_and_a_wrong_path_look_the_same() {
        let other = KEY.replace('f', "0");
        for path in [
            "/".to_owned(),
            format!("/{other}/"),
            format!("/{other}/socket"),
            format!("/{KEY}"),
            format!("/{KEY}/other"),
            format!("/{}/", &KEY[..31]),
            format!("//{KEY}/"),
        ] {
            assert_eq!(ask(&path, &SOCKET), Err(Refusal::Forbidden), "{path}");
        }
        // no key is never the right one
        assert_eq!(read_request(b"GET // HTTP/1.1\r\n\r\n", ""), Err(Refusal::Forbidden));
        let post = format!("POST /{KEY}/ HTTP/1.1\r\n\r\n");
        assert_eq!(read_request(post.as_bytes(), KEY), Err(Refusal::Forbidden));
    }

    #[test]
    fn foreign_bytes_are_malformed() {
        let body = format!("GET /{KEY}/ HTTP/1.1\r\nContent-Length: 3\r\n\r\n");
        for bytes in [b"\x16\x03\x01\x02\x00".to_vec(), vec![b'a'; 9000], body.into_bytes()] {
            assert_eq!(read_request(&bytes, KEY), Err(Refusal::Malformed));
        }
        let long = [b"GET /".to_vec(), vec![b'a'; 9000]].concat();
        assert_eq!(read_request(&long, KEY), Err(Refusal::Malformed));
    }

    #[test]
    fn messages_are_read_as_they_are_written() {
        for message in [
            BrowserMessage::Hello(Backend::Webgl2),
            BrowserMessage::Hello(Backend::Webgpu),
            BrowserMessage::Drawn(0),
            BrowserMessage::Shown(u64::MAX),
            BrowserMessage::Failed("no WebGL 2".into()),
        ] {
            assert_eq!(BrowserMessage::read(&message.to_string()), Some(message));
        }
        for text in ["", "drawn", "drawn ", "drawn -1", "drawn 01", "drawn 1 ", "drawn 18446744073709551616", "hello x"]
        {
            assert_eq!(BrowserMessage::read(text), None, "{text}");
        }
        assert_eq!(BrowserMessage::read(&format!("failed {}", "x".repeat(600))), None);
        let said = BrowserMessage::read("failed a\x1b[2Jb\nc");
        assert_eq!(said, Some(BrowserMessage::Failed("a [2Jb c".into())));
    }
}
