//! Texts that programs for SDF read and strict XML readers do not.
//!
//! | in a file | for the reader of XML |
//! |---|---|
//! | `--` within a comment | spaces instead of all comments |
//! | a prefix that nothing declares, `<gz:word>` | `<gz.word>` |
//!
//! Lengths and lines stay, so places in messages are those of the file.

/// Returns the text as XML. Whatever else is wrong with it stays wrong.
pub(super) fn as_xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('<') {
        let (before, from) = rest.split_at(at);
        out.push_str(before);
        let end = |mark: &str| from.find(mark).map(|at| at + mark.len());
        let (length, blank, tag) = if from.starts_with("<!--") {
            // the end may share no hyphen with the beginning
            (from.get(4..).and_then(|inside| inside.find("-->")).map(|at| at + 7), true, false)
        } else if from.starts_with("<![CDATA[") {
            (end("]]>"), false, false)
        } else if from.starts_with("<?") {
            (end("?>"), false, false)
        } else {
            (Some(tag_length(from)), false, true)
        };
        // what has no end is an error of the reader
        let (piece, left) = from.split_at(length.unwrap_or(from.len()));
        match (length, blank, tag) {
            (Some(_), true, _) => {
                out.extend(piece.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }));
            }
            (_, _, true) => push_tag(piece, text, &mut out),
            _ => out.push_str(piece),
        }
        rest = left;
    }
    out.push_str(rest);
    out
}

/// Returns the length of a tag: to its `>` outside quotes, or to the end.
fn tag_length(from: &str) -> usize {
    let mut quote = None;
    for (at, c) in from.char_indices() {
        match (quote, c) {
            (None, '>') => return at + 1,
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if c == open => quote = None,
            _ => {}
        }
    }
    from.len()
}

/// Adds a tag with a dot after each prefix that the text does not declare.
fn push_tag(tag: &str, text: &str, out: &mut String) {
    let (mut quote, mut word) = (None, String::new());
    for c in tag.chars() {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if c == open => quote = None,
            _ => {}
        }
        if quote.is_none() && c == ':' && !is_declared(&word, text) {
            out.push('.');
        } else {
            out.push(c);
        }
        if c.is_alphanumeric() || matches!(c, '_' | '-' | '.') { word.push(c) } else { word.clear() }
    }
}

fn is_declared(prefix: &str, text: &str) -> bool {
    prefix.is_empty() || prefix == "xml" || prefix == "xmlns" || text.contains(&format!("xmlns:{prefix}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_and_lines_stay() {
        let text = "<a>\n<!-- -- é\n> --><gz:b c:d='x:y' e=\"<!-- -->\"/>z:z<![CDATA[<!-- f:g -->]]></a><!---->";
        let xml = as_xml(text);
        assert_eq!(xml, "<a>\n          \n     <gz.b c.d='x:y' e=\"<!-- -->\"/>z:z<![CDATA[<!-- f:g -->]]></a>       ");
        assert_eq!(xml.len(), text.len());
        let declared = "<a xmlns:gz=\"u\"><gz:b/></a>";
        assert_eq!(as_xml(declared), declared);
        for broken in ["<!--", "<!-->", "<a b='", "<![CDATA[ <", "<?x", "<", ">"] {
            assert_eq!(as_xml(broken), broken);
        }
    }
}
