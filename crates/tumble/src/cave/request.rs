//! Reads one request from a connection, with a cap and a time-out.

use std::io::{ErrorKind, Read};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Reads until `parse` finds the request whole or refuses it, for at most `timeout`. More than `most` bytes without a
/// whole request are refused as `too_long`.
pub fn receive<T, R>(
    stream: &mut TcpStream,
    timeout: Duration,
    (most, too_long): (usize, R),
    parse: impl Fn(&[u8]) -> Result<Option<T>, R>,
) -> std::io::Result<Result<T, R>> {
    let until = Instant::now() + timeout;
    let (mut request, mut bytes) = (Vec::new(), [0; 1024]);
    loop {
        match parse(&request) {
            Ok(Some(found)) => return Ok(Ok(found)),
            Err(refusal) => return Ok(Err(refusal)),
            Ok(None) if request.len() > most => return Ok(Err(too_long)),
            Ok(None) => {}
        }
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut bytes)? {
            0 => return Err(ErrorKind::UnexpectedEof.into()),
            length => request.extend(&bytes[..length]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::net::TcpListener;

    /// Sends pieces to a reader that wants a line of at most four bytes, within 0.2 s.
    fn read(pieces: &[&str], close: bool) -> std::io::Result<Result<String, &'static str>> {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (mut stream, _) = listener.accept().unwrap();
        pieces.iter().for_each(|piece| client.write_all(piece.as_bytes()).unwrap());
        let client = (!close).then_some(client);
        let parse = |bytes: &[u8]| match bytes {
            [b'!', ..] => Err("refused"),
            [line @ .., b'\n'] => Ok(Some(String::from_utf8_lossy(line).into_owned())),
            _ => Ok(None),
        };
        let got = receive(&mut stream, Duration::from_millis(200), (4, "too long"), parse);
        drop(client);
        got
    }

    #[test]
    fn a_request_is_whole_refused_too_long_late_or_cut() {
        assert_eq!(read(&["ab", "c\n"], false).unwrap(), Ok("abc".into()));
        assert_eq!(read(&["!"], false).unwrap(), Err("refused"));
        assert_eq!(read(&["abcde"], false).unwrap(), Err("too long"));
        let late = read(&["ab"], false).unwrap_err().kind();
        assert!(matches!(late, ErrorKind::TimedOut | ErrorKind::WouldBlock), "{late}");
        assert_eq!(read(&["ab"], true).unwrap_err().kind(), ErrorKind::UnexpectedEof);
    }
}
