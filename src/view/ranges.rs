//! The part of a file that a request asks for: RFC 9110, sections 13 and 14, for one range of bytes.

/// What a request says about parts and about copies that it has.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Asked<'a> {
    /// `Range`.
    pub(super) range: Option<&'a str>,
    /// `If-Range`.
    pub(super) if_range: Option<&'a str>,
    /// `If-None-Match`.
    pub(super) if_none_match: Option<&'a str>,
}

/// What it gets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// All bytes.
    Whole,
    /// Those from the first up to and without the second.
    Bytes(u64, u64),
    /// Nothing: the copy that it has is this file.
    Unchanged,
    /// Nothing: the file has no such bytes.
    Outside,
}

/// The part of a file of `length` bytes whose copies bear `tag`.
pub(super) fn part(asked: Asked<'_>, length: u64, tag: &str) -> Part {
    if asked.if_none_match.is_some_and(|tags| names(tags, tag)) {
        return Part::Unchanged;
    }
    // A part of an older file would not fit the parts that the client has.
    if asked.if_range.is_some_and(|known| known.trim() != tag) {
        return Part::Whole;
    }
    // What is no range of bytes, or several, is passed over, as the standard allows.
    asked.range.and_then(|text| bytes(text, length)).unwrap_or(Part::Whole)
}

/// Whether a list of tags has one; a tag may be said to be weak.
fn names(tags: &str, tag: &str) -> bool {
    tags.split(',').map(str::trim).any(|known| known == "*" || known.strip_prefix("W/").unwrap_or(known) == tag)
}

fn bytes(text: &str, length: u64) -> Option<Part> {
    let (unit, spec) = text.trim().split_once('=')?;
    if !unit.trim().eq_ignore_ascii_case("bytes") {
        return None;
    }
    let (first, last) = spec.trim().split_once('-')?;
    let number = |digits: &str| -> Option<u64> {
        let is_number = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        // A number that no file is long enough for is as good as the largest.
        is_number.then(|| digits.parse().unwrap_or(u64::MAX))
    };
    let (from, to) = match (number(first), last) {
        (None, last) if first.is_empty() => (length.saturating_sub(number(last)?), length),
        (Some(from), "") => (from, length),
        (Some(from), last) => {
            let last = number(last)?;
            if last < from {
                return None;
            }
            (from, last.saturating_add(1).min(length))
        }
        _ => return None,
    };
    Some(if from < to { Part::Bytes(from, to) } else { Part::Outside })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(range: &str) -> Part {
        part(Asked { range: Some(range), ..Asked::default() }, 100, "\"a\"")
    }

    #[test]
    fn ranges_of_the_standard() {
        assert_eq!(of("bytes=0-0"), Part::Bytes(0, 1));
        assert_eq!(of("bytes=10-19"), Part::Bytes(10, 20));
        assert_eq!(of("Bytes = 10-"), Part::Bytes(10, 100));
        assert_eq!(of("bytes=90-1000"), Part::Bytes(90, 100));
        assert_eq!(of("bytes=-7"), Part::Bytes(93, 100));
        assert_eq!(of("bytes=-700"), Part::Bytes(0, 100));
        assert_eq!(of("bytes=0-99999999999999999999999"), Part::Bytes(0, 100));
        assert_eq!(
            [of("bytes=100-"), of("bytes=-0"), of("bytes=100-200")],
            [Part::Outside, Part::Outside, Part::Outside]
        );
        for odd in
            ["", "bytes", "bytes=", "bytes=-", "bytes=9-3", "bytes=a-b", "lines=1-2", "bytes=1-2,4-5", "bytes=+1-2"]
        {
            assert_eq!(of(odd), Part::Whole, "{odd}");
        }
        let empty = part(Asked { range: Some("bytes=-5"), ..Asked::default() }, 0, "\"a\"");
        assert_eq!(empty, Part::Outside);
    }

    #[test]
    fn copies_are_known_by_their_tag() {
        let held = |tags| part(Asked { if_none_match: Some(tags), ..Asked::default() }, 100, "\"a\"");
        assert_eq!(
            [held("\"a\""), held("\"b\", W/\"a\""), held("*")],
            [Part::Unchanged, Part::Unchanged, Part::Unchanged]
        );
        assert_eq!(held("\"b\""), Part::Whole);
        let resumed = |tag| Asked { range: Some("bytes=5-6"), if_range: Some(tag), ..Asked::default() };
        assert_eq!(part(resumed("\"a\""), 100, "\"a\""), Part::Bytes(5, 7));
        assert_eq!(part(resumed("\"old\""), 100, "\"a\""), Part::Whole);
    }
}
