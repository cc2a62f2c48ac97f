//! Which ROIs belong to one object: those of one group, or of one name but for the number at its end.

use std::collections::BTreeMap;

use super::decode::Roi;
use crate::io::text::quoted;

/// The object of each ROI, counted from 1, and what is to be told of it.
///
/// Groups decide where there are several. Names decide where all of them start with a word, there are several such words
/// and each has two ROIs at least: `embryo-5`, `embryo-10`, `seed-5`, `seed-10`. Else all is one object.
pub(crate) fn objects_of(rois: &[Roi]) -> (Vec<u32>, Option<String>) {
    let groups: Vec<u16> = rois.iter().map(|roi| roi.group).collect();
    if groups.iter().any(|&group| group != groups[0]) {
        let (objects, listed) = numbered(&groups, |group: &u16| format!("group {group}"));
        return (objects, Some(format!("its objects are the groups of its ROIs: {listed}")));
    }
    let words: Option<Vec<String>> = rois.iter().map(|roi| word_of(&roi.name)).collect();
    if let Some(words) = words.filter(|words| tells_apart(words)) {
        let (objects, listed) = numbered(&words, |word: &String| quoted(word));
        return (objects, Some(format!("its objects are told by the names of its ROIs: {listed}")));
    }
    let told = (rois.len() > 1).then(|| {
        format!(
            "all {} ROIs are taken as one object; groups, or names such as cell-5 and nucleus-5, divide them",
            rois.len()
        )
    });
    (vec![1; rois.len()], told)
}

/// Numbers in order of first appearance, and the list of them.
fn numbered<T: Ord>(keys: &[T], name: impl Fn(&T) -> String) -> (Vec<u32>, String) {
    const LISTED: usize = 6;
    let mut numbers: BTreeMap<&T, u32> = BTreeMap::new();
    let mut names = Vec::new();
    let mut objects = Vec::new();
    for key in keys {
        let next = numbers.len() as u32 + 1;
        let number = *numbers.entry(key).or_insert(next);
        if number == next {
            names.push(format!("{number} is {}", name(key)));
        }
        objects.push(number);
    }
    let more = names.len().saturating_sub(LISTED);
    names.truncate(LISTED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (objects, names.join(", ") + &more)
}

/// A name without the number of the slice at its end; none where no letter is left.
fn word_of(name: &str) -> Option<String> {
    let signs = ['-', '_', ' ', '.', ':', '#', '='];
    let digits = name.trim().trim_end_matches(|c: char| c.is_ascii_digit());
    if digits.len() == name.trim().len() {
        return Some(name.trim().to_owned()).filter(|name| name.chars().any(char::is_alphabetic));
    }
    // `z012` and `slice12` say what the number counts; `cell12` is a word of its own.
    let lower = digits.to_lowercase();
    let counts = ["slice", "z"].into_iter().find(|word| {
        lower.trim_end_matches(signs).strip_suffix(word).is_some_and(|rest| rest.is_empty() || rest.ends_with(signs))
    });
    let rest = digits.trim_end_matches(signs);
    let rest = counts.map_or(rest, |word| &rest[..rest.len() - word.len()]);
    let rest = rest.trim_end_matches(signs);
    rest.chars().any(char::is_alphabetic).then(|| rest.to_owned())
}

fn tells_apart(words: &[String]) -> bool {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for word in words {
        *counts.entry(word).or_default() += 1;
    }
    counts.len() > 1 && counts.values().all(|&count| count > 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::geometry::read::roi::decode::Marks;

    fn rois(names: &[(&str, u16)]) -> Vec<Roi> {
        let roi = |&(name, group): &(&str, u16)| Roi {
            name: name.into(),
            group,
            slice: None,
            time: None,
            marks: Marks::None,
            is_open: false,
        };
        names.iter().map(roi).collect()
    }

    #[test]
    fn groups_and_names_tell_objects_apart() {
        let objects = |names: &[(&str, u16)]| objects_of(&rois(names)).0;
        assert_eq!(objects(&[("a", 3), ("b", 1), ("c", 3)]), [1, 2, 1]);
        assert_eq!(objects(&[("cell-5", 0), ("seed-5", 0), ("cell-10", 0), ("seed-10", 0)]), [1, 2, 1, 2]);
        assert_eq!(
            objects(&[("cell1_z005", 0), ("cell2_z005", 0), ("cell1_z010", 0), ("cell2_z010", 0)]),
            [1, 2, 1, 2]
        );
        assert_eq!(objects(&[("0005-0100-0100", 0), ("0010-0100-0100", 0)]), [1, 1]);
        assert_eq!(objects(&[("cell 1", 0), ("cell 2", 0), ("cell 3", 0)]), [1, 1, 1]);
        assert_eq!(objects(&[("first", 0), ("second", 0)]), [1, 1]);
    }
}
