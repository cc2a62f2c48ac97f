//! What deserves a second look, a line for each kind: notes that say the same of many objects are one line that lists these.

/// Objects that a line lists; of more it says how many.
const MOST_LISTED: usize = 40;

/// A note of an object.
struct OfObject<'a> {
    number: &'a str,
    before: &'a str,
    after: &'a str,
}

impl<'a> OfObject<'a> {
    fn of(note: &'a str) -> Option<Self> {
        let (before, rest) = note.split_once("object ")?;
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        // Part of a longer word, or no number.
        if digits == 0 || before.ends_with(|c: char| c.is_alphanumeric() || c == '-' || c == '_') {
            return None;
        }
        let (number, after) = rest.split_at(digits);
        Some(Self { number, before, after })
    }

    /// What it says whatever its numbers are.
    fn kind(&self) -> [String; 2] {
        [self.before, self.after].map(|text| text.split(|c: char| c.is_ascii_digit()).collect())
    }
}

/// The lines that tell notes, in the order of the first of each kind.
pub(super) fn lines(notes: &[String]) -> Vec<String> {
    let kinds: Vec<_> = notes.iter().map(|note| OfObject::of(note).map(|of| of.kind())).collect();
    let mut lines = Vec::new();
    for (n, note) in notes.iter().enumerate() {
        let alike = |m: &usize| kinds[*m].is_some() && kinds[*m] == kinds[n];
        if (0..n).any(|m| alike(&m)) {
            continue;
        }
        let all: Vec<OfObject<'_>> = (n..notes.len()).filter(alike).filter_map(|m| OfObject::of(&notes[m])).collect();
        lines.push(if all.len() > 1 { together(&all) } else { sentence(note) });
    }
    lines
}

/// What several objects have in common, and of which it is said.
fn together(all: &[OfObject<'_>]) -> String {
    let first = &all[0];
    let listed: Vec<&str> = all.iter().take(MOST_LISTED).map(|of| of.number).collect();
    let more = if all.len() > MOST_LISTED { ", ..." } else { "" };
    let said = sentence(&format!("{}object {}{}", first.before, first.number, first.after));
    let is_same = all.iter().all(|of| (of.before, of.after) == (first.before, first.after));
    let numbers = if is_same { "" } else { "; the numbers of each are in report.json" };
    format!("{said} The same is said of {} objects{numbers}: {}{more}.", all.len(), listed.join(", "))
}

/// A note as a sentence.
fn sentence(note: &str) -> String {
    // A file's name stays as it is.
    let is_word = note.split([' ', ':']).next().is_some_and(|word| word.chars().all(|c| c.is_ascii_lowercase()));
    let (start, rest) = note.split_at(note.chars().next().map_or(0, char::len_utf8));
    let start = if is_word { start.to_ascii_uppercase() } else { start.to_owned() };
    let end = if note.ends_with(['.', '?', '!']) { "" } else { "." };
    format!("{start}{rest}{end}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_many_objects_is_said_once() {
        let mut notes: Vec<String> = vec!["a.tif: no unit".into()];
        notes.extend((1..=30).map(|n| format!("object {n}: {} marks lie more than a voxel from the surface", 7 * n)));
        notes.push("object 3: its surface is in 2 pieces".into());
        notes.extend((4..=5).map(|n| format!("the marks of object {n} span nothing")));
        let lines = lines(&notes);
        assert_eq!(lines.len(), 4, "{lines:?}");
        let numbers: Vec<String> = (1..=30).map(|n| n.to_string()).collect();
        assert!(
            lines[1].starts_with(
                "Object 1: 7 marks lie more than a voxel from the surface. The same is said of 30 objects;"
            )
        );
        assert!(lines[1].ends_with(&format!(": {}.", numbers.join(", "))), "{}", lines[1]);
        assert_eq!(lines[2], "Object 3: its surface is in 2 pieces.");
        assert_eq!(lines[3], "The marks of object 4 span nothing. The same is said of 2 objects: 4, 5.");
    }

    #[test]
    fn notes_become_sentences() {
        assert_eq!(sentence("object 3: one mark is off"), "Object 3: one mark is off.");
        assert_eq!(sentence("a.tif: is it whole?"), "a.tif: is it whole?");
        assert_eq!(sentence(""), ".");
    }
}
