//! What the names of slices say: numbers, the text around them, and what a number counts by the letters before it.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use crate::io::stack::tiff::description::layout::Axis;

/// Longer runs of digits than this count as text: no number of a slice has so many.
const MOST_DIGITS: usize = 36;

/// Words of pictures that were made of the slices, or show something beside them.
const DERIVED: [&str; 24] = [
    "max",
    "min",
    "avg",
    "mean",
    "sum",
    "std",
    "stdev",
    "med",
    "median",
    "mip",
    "proj",
    "projection",
    "thumb",
    "thumbnail",
    "thumbs",
    "preview",
    "overview",
    "montage",
    "snapshot",
    "label",
    "macro",
    "composite",
    "colormap",
    "maxproj",
];

/// The name of a slice, taken apart.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Name {
    pub(crate) path: PathBuf,
    /// The text before, between and behind the numbers: one piece more than there are numbers.
    pub(crate) texts: Vec<String>,
    pub(crate) numbers: Vec<u128>,
}

impl Name {
    /// Takes the name of a file apart; endings (`.tif`, `.ome.tiff`) are no part of it.
    pub(crate) fn of(path: &Path) -> Self {
        let file = file_name(path);
        let stem = file.rsplit_once('.').map_or(file.as_str(), |(stem, _)| stem);
        let stem = if stem.to_lowercase().ends_with(".ome") { &stem[..stem.len() - 4] } else { stem };
        let (mut texts, mut numbers, mut rest) = (vec![String::new()], Vec::new(), stem);
        while !rest.is_empty() {
            let (token, behind) = split_token(rest);
            let number = token.parse::<u128>().ok().filter(|_| token.len() <= MOST_DIGITS && is_digits(token));
            match (number, texts.last_mut()) {
                (Some(number), _) => {
                    numbers.push(number);
                    texts.push(String::new());
                }
                (None, Some(text)) => text.push_str(token),
                (None, None) => {}
            }
            rest = behind;
        }
        Self { path: path.to_path_buf(), texts, numbers }
    }

    /// The file's name.
    pub(crate) fn file(&self) -> String {
        file_name(&self.path)
    }

    /// The file's name without its ending.
    pub(crate) fn stem(&self) -> String {
        let file = self.file();
        file.rsplit_once('.').map_or(file.clone(), |(stem, _)| stem.to_string())
    }

    /// The text alone, upper and lower case as one: names of one kind have the same.
    pub(crate) fn pattern(&self) -> Vec<String> {
        self.texts.iter().map(|text| text.to_lowercase()).collect()
    }

    /// What the numbers of a column count, by the letters before them; none where these say nothing. Where one number
    /// alone varies (`alone`), a letter apart from it may be a word of another meaning: `sample_c_001`.
    pub(crate) fn marker(&self, column: usize, alone: bool) -> Option<Marker> {
        let text = &self.texts[column];
        let joined = text.trim_end_matches('=');
        let bare = joined.trim_end_matches(['_', '-', ' ', '.', '(', '[', ':', '#']);
        let word = last_word(bare);
        let marker = match word.as_str() {
            "z" | "slice" | "sl" | "section" | "sec" | "plane" | "layer" | "zslice" | "zplane" | "zpos" | "zstack"
            | "depth" => Marker::Axis(Axis::Z),
            "c" | "ch" | "chan" | "channel" | "w" | "wv" | "wave" | "wavelength" | "color" | "colour" => {
                Marker::Axis(Axis::Channel)
            }
            "t" | "time" | "tp" | "timepoint" | "frame" | "tm" | "times" => Marker::Axis(Axis::Time),
            "s" => Marker::Series,
            "x" | "y" | "m" | "p" | "pos" | "position" | "tile" | "field" | "fov" | "view" | "angle" | "stage"
            | "scene" | "well" => Marker::Place,
            _ => return None,
        };
        (!alone || word.chars().count() > 1 || bare.len() == joined.len()).then_some(marker)
    }

    /// Whether a word says that this is a picture of slices, such as a projection.
    pub(crate) fn is_derived(&self) -> bool {
        self.texts.iter().any(|text| {
            text.split(|c: char| !c.is_alphabetic()).any(|word| DERIVED.contains(&word.to_lowercase().as_str()))
        })
    }
}

/// What a number counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Marker {
    /// Planes along an axis.
    Axis(Axis),
    /// A series or a slice: `s`.
    Series,
    /// A place on the stage, a side from which was looked.
    Place,
}

/// The letters at the end of a text, from the last small to large letter on (`ImageZ` ends in `z`), in small letters.
fn last_word(text: &str) -> String {
    let letters: Vec<char> = text.chars().rev().take_while(|c| c.is_alphabetic()).collect();
    let mut word = Vec::new();
    for (n, &letter) in letters.iter().enumerate() {
        word.push(letter);
        if letter.is_uppercase() && letters.get(n + 1).is_some_and(|before| before.is_lowercase()) {
            break;
        }
    }
    word.into_iter().rev().collect::<String>().to_lowercase()
}

pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn is_digits(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_digit())
}

/// Compares names with runs of digits taken as numbers of any length; names that differ only in leading zeros are
/// compared as text, so that the order is total.
pub(crate) fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    loop {
        let ((p, rest_left), (q, rest_right)) = (split_token(left), split_token(right));
        if p.is_empty() || q.is_empty() {
            return p.len().cmp(&q.len()).then_with(|| a.cmp(b));
        }
        let order = if is_digits(p) && is_digits(q) {
            let (p, q) = (p.trim_start_matches('0'), q.trim_start_matches('0'));
            p.len().cmp(&q.len()).then_with(|| p.cmp(q))
        } else {
            p.cmp(q)
        };
        if order != Ordering::Equal {
            return order;
        }
        (left, right) = (rest_left, rest_right);
    }
}

/// The leading run of digits, or else one character, and the rest.
fn split_token(text: &str) -> (&str, &str) {
    let Some(first) = text.chars().next() else { return ("", "") };
    if !first.is_ascii_digit() {
        return text.split_at(first.len_utf8());
    }
    text.split_at(text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let mut names = ["s10.tif", "s9.tif", "s009a.tif", "a.tif", "s.tif", "s99999999999999999999999.tif", "s09.tif"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(
            names,
            ["a.tif", "s.tif", "s09.tif", "s9.tif", "s009a.tif", "s10.tif", "s99999999999999999999999.tif"]
        );
    }

    #[test]
    fn names_come_apart_and_say_what_their_numbers_count() {
        use Marker::{Place, Series};
        let [c, t, z] = [Axis::Channel, Axis::Time, Axis::Z].map(|axis| Some(Marker::Axis(axis)));
        for (file, numbers, markers) in [
            ("img_z000_c0.tif", vec![0, 0], vec![z, c]),
            ("t001_z012.tif", vec![1, 12], vec![t, z]),
            ("C=1_Z=05.ome.tif", vec![1, 5], vec![c, z]),
            ("a-ch1-Slice 007.TIFF", vec![1, 7], vec![c, z]),
            ("ImageZ001T02.tif", vec![1, 2], vec![z, t]),
            ("001.tif", vec![1], vec![None]),
            ("embryo_c_001.tif", vec![1], vec![None]),
            ("channel_1_12.tif", vec![1, 12], vec![c, None]),
            ("s1_x2.tif", vec![1, 2], vec![Some(Series), Some(Place)]),
            ("plain.tif", vec![], vec![]),
        ] {
            let name = Name::of(Path::new(file));
            assert_eq!(name.numbers, numbers, "{file}");
            let found: Vec<Option<Marker>> = (0..name.numbers.len()).map(|column| name.marker(column, true)).collect();
            assert_eq!((found, name.is_derived()), (markers, false), "{file}");
        }
        assert_eq!(Name::of(Path::new("a_z_1_c_0.tif")).marker(1, false), c);
        for file in ["MAX_img.tif", "s_thumb_01.tif", "Overview.tif"] {
            assert!(Name::of(Path::new(file)).is_derived(), "{file}");
        }
    }
}
