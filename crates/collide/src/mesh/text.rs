//! Text files as programs write them: with or without a byte order mark, in UTF-8 or Latin-1, lines ended by `\n`, `\r\n` or `\r`.

use std::borrow::Cow;

/// The text of bytes that are one: what is not UTF-8 is taken as Latin-1, which old programs write into comments and names.
///
/// # Errors
/// Where a byte is 0: that is no text. The error is the offset of the first, from 0.
pub fn decode_text(bytes: &[u8]) -> Result<Cow<'_, str>, usize> {
    if let Some(zero) = bytes.iter().position(|b| *b == 0) {
        return Err(zero);
    }
    Ok(match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().map(|b| char::from(*b)).collect::<String>().into(),
    })
}

/// Lines with their numbers from 1, without the mark at the beginning of the text.
pub(super) fn numbered_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    // a `\r` before a `\n` is white space, which nobody minds; one alone ends a line
    let alone = !text.contains('\n');
    text.split(if alone { '\r' } else { '\n' }).enumerate().map(|(n, line)| (n + 1, line))
}

/// The same, where a line that ends in `\` goes on in the next one; it has the number of its first line.
pub fn obj_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = numbered_lines(text);
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let Some(mut begun) = first.trim_end().strip_suffix('\\').map(str::to_owned) else {
            return Some((number, first.into()));
        };
        // a comment ends with its line, whatever that ends in
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
