//! Text files with or without byte order mark, in UTF-8 or Latin-1, with lines ended by `\n`,
//! `\r\n` or `\r`.

use std::borrow::Cow;

/// Decodes text. Bytes that are not UTF-8 are read as Latin-1, which old programs write in comments
/// and names.
///
/// # Errors
/// The offset of the first byte 0, from 0: such data is not text.
pub fn decode_text(bytes: &[u8]) -> Result<Cow<'_, str>, usize> {
    if let Some(zero) = bytes.iter().position(|b| *b == 0) {
        return Err(zero);
    }
    Ok(match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|b| char::from(*b)).collect::<String>().into(),
    })
}

/// Returns the lines with their numbers from 1, without the byte order mark.
pub(super) fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    // a `\r` before a `\n` is harmless white space; without any `\n` it ends a line
    let alone = !text.contains('\n');
    text.split(if alone { '\r' } else { '\n' }).enumerate().map(|(n, line)| (n + 1, line))
}

/// Returns the lines with their numbers; a line that ends in `\` is joined with the next and has
/// the first one's number.
pub fn obj_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = numbered_lines(text);
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let Some(mut begun) = first.trim_end().strip_suffix('\\').map(str::to_owned) else {
            return Some((number, first.into()));
        };
        // a comment ends with its line, even if that ends in `\`
        if first.trim_start().starts_with('#') {
            return Some((number, first.into()));
        }
        for (_, next) in lines.by_ref() {
            begun.push(' ');
            match next.trim_end().strip_suffix('\\') {
                Some(part) => begun.push_str(part),
                None => {
                    begun.push_str(next);
                    break;
                }
            }
        }
        Some((number, begun.into()))
    })
}
