//! Messages of the operator's console: requests of HTTP/1.1 (RFC 9112), read from untrusted bytes.
//!
//! ```text
//! GET  /                       the page, without a token
//! GET  /api/status             GET /api/log             GET /api/picture/FACET
//! POST /api/pause, resume, reset, next, stop            POST /api/record/FILE.mcap, /api/unrecord
//! POST /api/replay/FILE.mcap                            POST /api/pattern/NAME (off: the scene)
//! ```
//!
//! Everything under `/api` needs `Authorization: Bearer TOKEN`. Requests have no body and are limited
//! in length; a connection carries one. A web page of another origin can send such a header only with
//! a preflight, which is answered by 405.

/// Maximum length of a request, bytes.
pub const MAX_REQUEST_BYTES: usize = 4096;
/// Maximum number of header fields.
const MAX_FIELDS: usize = 48;
/// Minimum length of a token, bytes.
pub const MIN_TOKEN_BYTES: usize = 16;
/// Maximum length of a name in a path, bytes.
const MAX_NAME_BYTES: usize = 128;

/// Request of a console.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// The page.
    Page,
    /// The state of the run, as JSON.
    Status,
    /// The last lines of all processes.
    Log,
    /// The last picture of the facet with this name, as PNG.
    Picture(String),
    /// Simulated time stands.
    Pause,
    /// Simulated time goes on.
    Resume,
    /// The world as before the first step.
    Reset,
    /// The next scene.
    Next,
    /// The end of the run.
    Stop,
    /// A recording into this file: a name without folders that ends with `.mcap`.
    Record(String),
    /// The end of the recording.
    Unrecord,
    /// A replay of this recording, a name as of a new one; then the scene again.
    Replay(String),
    /// A calibration pattern on all facets by its name, or the scene again (`off`).
    Pattern(String),
}

impl Action {
    /// Returns method and path of the request.
    pub fn request(&self) -> (&'static str, String) {
        let post = |what: &str| ("POST", format!("/api/{what}"));
        match self {
            Action::Page => ("GET", "/".into()),
            Action::Status => ("GET", "/api/status".into()),
            Action::Log => ("GET", "/api/log".into()),
            Action::Picture(facet) => ("GET", format!("/api/picture/{}", encoded(facet))),
            Action::Pause => post("pause"),
            Action::Resume => post("resume"),
            Action::Reset => post("reset"),
            Action::Next => post("next"),
            Action::Stop => post("stop"),
            Action::Record(file) => post(&format!("record/{}", encoded(file))),
            Action::Unrecord => post("unrecord"),
            Action::Replay(file) => post(&format!("replay/{}", encoded(file))),
            Action::Pattern(name) => post(&format!("pattern/{}", encoded(name))),
        }
    }

    /// Returns its word, as `tumble console` has it.
    pub fn word(&self) -> String {
        let path = self.request().1;
        path.trim_start_matches("/api").trim_start_matches('/').split('/').next().unwrap_or_default().to_owned()
    }

    fn of(method: &str, path: &str) -> Result<Action, Refusal> {
        let known = [
            Action::Page,
            Action::Status,
            Action::Log,
            Action::Pause,
            Action::Resume,
            Action::Reset,
            Action::Next,
            Action::Stop,
            Action::Unrecord,
        ];
        let named = |prefix: &str| path.strip_prefix(prefix).map(decoded);
        let action = if let Some(facet) = named("/api/picture/") {
            Action::Picture(facet.ok_or(Refusal::NotFound)?)
        } else if let Some(file) = named("/api/record/") {
            Action::Record(file.filter(|file| is_recording_name(file)).ok_or(Refusal::FileName)?)
        } else if let Some(file) = named("/api/replay/") {
            Action::Replay(file.filter(|file| is_recording_name(file)).ok_or(Refusal::FileName)?)
        } else if let Some(name) = named("/api/pattern/") {
            Action::Pattern(name.filter(|name| is_word(name)).ok_or(Refusal::NotFound)?)
        } else {
            known.into_iter().find(|action| action.request().1 == path).ok_or(Refusal::NotFound)?
        };
        if action.request().0 == method { Ok(action) } else { Err(Refusal::Method) }
    }
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// Not HTTP.
    #[error("not a request of HTTP/1.1")]
    Malformed,
    /// Too long, or with too many fields.
    #[error("a request of more than {MAX_REQUEST_BYTES} bytes")]
    TooLong,
    /// With a body.
    #[error("a request with a body")]
    Body,
    /// No such path.
    #[error("no such page")]
    NotFound,
    /// Another method than that of the path.
    #[error("another method than this path has")]
    Method,
    /// No token, or a wrong one.
    #[error("no token, or a wrong one")]
    Token,
    /// A name of a recording that is not accepted.
    #[error("expected the name of a recording without folders that ends with .mcap")]
    FileName,
}

impl Refusal {
    /// Returns the status code of the answer.
    pub fn status(self) -> u16 {
        match self {
            Refusal::Malformed | Refusal::FileName => 400,
            Refusal::Token => 401,
            Refusal::NotFound => 404,
            Refusal::Method => 405,
            Refusal::Body => 413,
            Refusal::TooLong => 431,
        }
    }
}

/// Reads a request. Returns `None` while its end has not arrived.
///
/// # Errors
/// [`Refusal`]. Without the right token the answer does not depend on the path's existence.
pub fn read_request(bytes: &[u8], token: &str) -> Result<Option<Action>, Refusal> {
    let mut fields = [httparse::EMPTY_HEADER; MAX_FIELDS];
    let mut request = httparse::Request::new(&mut fields);
    match request.parse(bytes) {
        Ok(httparse::Status::Complete(length)) if length > MAX_REQUEST_BYTES => return Err(Refusal::TooLong),
        Ok(httparse::Status::Complete(_)) => {}
        Ok(httparse::Status::Partial) if bytes.len() >= MAX_REQUEST_BYTES => return Err(Refusal::TooLong),
        Ok(httparse::Status::Partial) => return Ok(None),
        Err(httparse::Error::TooManyHeaders) => return Err(Refusal::TooLong),
        Err(_) => return Err(Refusal::Malformed),
    }
    let (Some(method), Some(path)) = (request.method, request.path) else { return Err(Refusal::Malformed) };
    let field = |name: &str| request.headers.iter().find(|f| f.name.eq_ignore_ascii_case(name)).map(|f| f.value);
    if field("transfer-encoding").is_some() || field("content-length").is_some_and(|length| length != b"0") {
        return Err(Refusal::Body);
    }
    if (method, path) == ("GET", "/") {
        return Ok(Some(Action::Page));
    }
    let given = field("authorization").and_then(|value| value.strip_prefix(b"Bearer "));
    // hashes are compared in constant time
    if token.len() < MIN_TOKEN_BYTES || given.is_none_or(|given| blake3::hash(given) != blake3::hash(token.as_bytes()))
    {
        return Err(if method == "OPTIONS" { Refusal::Method } else { Refusal::Token });
    }
    Action::of(method, path).map(Some)
}

/// Returns whether a console may record into a file of this name.
pub fn is_recording_name(name: &str) -> bool {
    let plain = |c: char| c.is_alphanumeric() || " _-.".contains(c);
    name.len() <= MAX_NAME_BYTES && name.chars().all(plain) && !name.starts_with('.') && name.ends_with(".mcap")
}

/// Returns whether a name is a word of small letters.
fn is_word(name: &str) -> bool {
    name.len() <= MAX_NAME_BYTES && name.bytes().all(|b| b.is_ascii_lowercase())
}

/// Encodes a name for a path.
fn encoded(name: &str) -> String {
    let one = |b: u8| if b.is_ascii_alphanumeric() { char::from(b).to_string() } else { format!("%{b:02X}") };
    name.bytes().map(one).collect()
}

/// Decodes a name of a path.
fn decoded(path: &str) -> Option<String> {
    let mut out = Vec::new();
    let mut rest = path.bytes();
    while let Some(byte) = rest.next() {
        let digit = |b: Option<u8>| char::from(b?).to_digit(16);
        out.push(if byte == b'%' { (16 * digit(rest.next())? + digit(rest.next())?) as u8 } else { byte });
    }
    String::from_utf8(out).ok().filter(|name| (1..=MAX_NAME_BYTES).contains(&name.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOKEN: &str = "0123456789abcdef0123456789abcdef";

    fn ask(method: &str, path: &str, fields: &str) -> Result<Option<Action>, Refusal> {
        read_request(format!("{method} {path} HTTP/1.1\r\nHost: here\r\n{fields}\r\n").as_bytes(), TOKEN)
    }

    #[test]
    fn every_action_is_read_as_it_is_written_with_the_token_alone() {
        let bearer = format!("authorization: Bearer {TOKEN}\r\n");
        let actions = [
            Action::Status,
            Action::Log,
            Action::Picture("left wall/ü".into()),
            Action::Pause,
            Action::Resume,
            Action::Reset,
            Action::Next,
            Action::Stop,
            Action::Record("a show.mcap".into()),
            Action::Unrecord,
            Action::Replay("a show.mcap".into()),
            Action::Pattern("grid".into()),
        ];
        for action in actions {
            let (method, path) = action.request();
            assert_eq!(ask(method, &path, &bearer), Ok(Some(action.clone())));
            let other = if method == "GET" { "POST" } else { "GET" };
            assert_eq!(ask(other, &path, &bearer), Err(Refusal::Method));
            for wrong in
                ["", "Authorization: Bearer\r\n", "Authorization: Bearer 0123456789abcdef\r\n", "Cookie: x\r\n"]
            {
                assert_eq!(ask(method, &path, wrong), Err(Refusal::Token));
            }
            let whole = format!("{method} {path} HTTP/1.1\r\n{bearer}\r\n");
            for cut in 1..whole.len() {
                assert_eq!(read_request(&whole.as_bytes()[..cut], TOKEN), Ok(None));
            }
        }
        assert_eq!(ask("GET", "/", ""), Ok(Some(Action::Page)));
        assert_eq!(
            read_request(b"GET /api/status HTTP/1.1\r\nAuthorization: Bearer \r\n\r\n", ""),
            Err(Refusal::Token)
        );
    }

    #[test]
    fn foreign_requests_are_refused_by_reason() {
        let bearer = format!("Authorization: Bearer {TOKEN}\r\n");
        assert_eq!(ask("GET", "/api/nothing", &bearer), Err(Refusal::NotFound));
        assert_eq!(ask("GET", "/api/nothing", ""), Err(Refusal::Token));
        assert_eq!(ask("OPTIONS", "/api/stop", ""), Err(Refusal::Method));
        assert_eq!(ask("POST", "/api/stop", &format!("{bearer}Content-Length: 5\r\n")), Err(Refusal::Body));
        assert_eq!(ask("POST", "/api/stop", &format!("{bearer}Transfer-Encoding: chunked\r\n")), Err(Refusal::Body));
        assert_eq!(read_request(b"\x16\x03\x01\x02\x00\x01\x00", TOKEN), Err(Refusal::Malformed));
        assert_eq!(ask("GET", &format!("/{}", "a".repeat(5000)), ""), Err(Refusal::TooLong));
        assert_eq!(ask("GET", "/", &"X: y\r\n".repeat(60)), Err(Refusal::TooLong));
        assert_eq!(read_request(&[b"GET /".to_vec(), vec![b'a'; 5000]].concat(), TOKEN), Err(Refusal::TooLong));
        for file in ["..%2Fa.mcap", "%2Fetc%2Fpasswd", "a.txt", ".hidden.mcap", "%00.mcap", "", "a%2"] {
            assert_eq!(ask("POST", &format!("/api/record/{file}"), &bearer), Err(Refusal::FileName), "{file}");
            assert_eq!(ask("POST", &format!("/api/replay/{file}"), &bearer), Err(Refusal::FileName), "{file}");
        }
        for name in ["", "a%0Ab", "Grid", "a%20b"] {
            assert_eq!(ask("POST", &format!("/api/pattern/{name}"), &bearer), Err(Refusal::NotFound), "{name}");
        }
    }
}
