//! Texts between commas.

/// A text as a cell, in quotation marks where it needs them (RFC 4180). What a spreadsheet would compute begins with an
/// apostrophe, which tells it that this is a text.
pub(crate) fn quoted(text: &str) -> String {
    let text = if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { format!("'{text}") } else { text.into() };
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_keep_what_is_in_them() {
        assert_eq!((quoted("a b"), quoted("a, \"b\"")), ("a b".into(), "\"a, \"\"b\"\"\"".into()));
        assert_eq!((quoted("=SUM(1)"), quoted("a=1")), ("'=SUM(1)".into(), "a=1".into()));
    }
}
