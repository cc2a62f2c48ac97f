//! `PageAxes`: what the pages of an image are, in the user's words, where its own are wrong or missing.
//!
//! Written as letters, slowest first, ending in `yx`: `zyx`, `tzyx`, `zcyx`; a number behind a letter is the size of that axis: `zc2yx`.

use std::fmt;
use std::str::FromStr;

/// An axis along which planes follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Axis {
    /// Channels.
    Channel,
    /// Slices.
    Z,
    /// Times.
    Time,
}

impl Axis {
    /// The axis of an OME or ImageJ letter.
    #[must_use]
    pub fn from_letter(letter: char) -> Option<Self> {
        match letter.to_ascii_uppercase() {
            'C' => Some(Self::Channel),
            'Z' => Some(Self::Z),
            'T' => Some(Self::Time),
            _ => None,
        }
    }

    /// Its letter.
    #[must_use]
    pub fn letter(self) -> char {
        match self {
            Self::Channel => 'C',
            Self::Z => 'Z',
            Self::Time => 'T',
        }
    }
}

/// The axes of the pages, slowest first, each with its size where that was said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageAxes([Option<(Axis, Option<u64>)>; 3]);

impl PageAxes {
    /// The axes that were named, slowest first.
    pub fn named(&self) -> impl Iterator<Item = (Axis, Option<u64>)> + '_ {
        self.0.iter().flatten().copied()
    }

    /// How many axes were named.
    #[must_use]
    pub fn len(&self) -> usize {
        self.named().count()
    }

    /// True when no axis but y and x was named.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether planes are counted, whatever axes they are said to have: by one letter, or by sizes.
    #[must_use]
    pub fn counts_planes(&self) -> bool {
        self.len() < 2 || self.named().any(|(_, size)| size.is_some())
    }

    /// The size of every axis, fastest first, of an image with so many planes along the axes that its file names
    /// (slowest first, those of one plane left out). Sizes that were not said are the file's, in its order.
    ///
    /// # Errors
    /// When axes and planes do not fit each other: one sentence on why, without the file's name.
    pub fn sizes(&self, stored: &[(Axis, u64)], planes: u64) -> Result<[(Axis, u64); 3], String> {
        let mut sizes: Vec<(Axis, u64)> = if self.counts_planes() {
            self.sizes_of_count(planes)?
        } else if self.len() == stored.len() {
            self.named().zip(stored).map(|((axis, _), &(_, size))| (axis, size)).collect()
        } else {
            self.sizes_by_name(stored, planes)?
        };
        for axis in [Axis::Z, Axis::Channel, Axis::Time] {
            if sizes.iter().all(|(a, _)| *a != axis) {
                sizes.insert(0, (axis, 1));
            }
        }
        sizes.reverse();
        sizes.try_into().map_err(|_| format!("--axes {self} names an axis twice"))
    }

    /// Sizes where one at most is open.
    fn sizes_of_count(&self, planes: u64) -> Result<Vec<(Axis, u64)>, String> {
        let told: u64 = self.named().filter_map(|(_, size)| size).fold(1, u64::saturating_mul);
        let open = self.named().filter(|(_, size)| size.is_none()).count();
        if open > 1 {
            return Err(format!("--axes {self} leaves {open} sizes open; give all but one of them, as in zc2yx"));
        }
        if !planes.is_multiple_of(told) || (open == 0 && told != planes) {
            return Err(format!("--axes {self} does not fit the {planes} planes that there are"));
        }
        Ok(self.named().map(|(axis, size)| (axis, size.unwrap_or(planes / told))).collect())
    }

    /// The file's sizes by name, where it names fewer axes, in the same order.
    fn sizes_by_name(&self, stored: &[(Axis, u64)], planes: u64) -> Result<Vec<(Axis, u64)>, String> {
        let kept: Vec<Axis> =
            self.named().map(|(axis, _)| axis).filter(|a| stored.iter().any(|(b, _)| a == b)).collect();
        if stored.len() > 1 && kept.iter().eq(stored.iter().map(|(axis, _)| axis)) {
            let size = |axis| stored.iter().find(|(a, _)| *a == axis).map_or(1, |&(_, n)| n);
            return Ok(self.named().map(|(axis, _)| (axis, size(axis))).collect());
        }
        let names = stored
            .iter()
            .fold(String::new(), |names, &(axis, n)| names + &format!("{}{n}", axis.letter().to_ascii_lowercase()));
        let held = if names.is_empty() { "1 plane".to_string() } else { format!("{planes} planes, {names}yx") };
        Err(format!("--axes {self} does not fit what is there ({held}); give sizes too, as in zc2yx"))
    }
}

impl FromStr for PageAxes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let what = "give letters, slowest first, y and x last, such as zyx, tzyx or zc2yx";
        let lower = text.trim().to_lowercase();
        // Samples inside a pixel are known from the pages.
        let outer = ["yx", "yxs", "syx"].iter().find_map(|end| lower.strip_suffix(end));
        let outer = outer.ok_or_else(|| format!("'{text}' does not end in yx: a page is a plane of rows; {what}"))?;
        let mut axes: Vec<(Axis, Option<u64>)> = Vec::new();
        let mut rest = outer;
        while let Some(letter) = rest.chars().next() {
            let axis = Axis::from_letter(letter).ok_or_else(|| format!("'{letter}' is none of t, c, z; {what}"))?;
            if axes.iter().any(|(a, _)| *a == axis) {
                return Err(format!("'{letter}' comes twice; {what}"));
            }
            rest = &rest[letter.len_utf8()..];
            let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
            let size = match &rest[..digits] {
                "" => None,
                number => {
                    Some(number.parse().ok().filter(|&n| n > 0).ok_or_else(|| format!("{number} is no size; {what}"))?)
                }
            };
            rest = &rest[digits..];
            axes.push((axis, size));
        }
        let mut held = [None; 3];
        held.iter_mut().zip(axes).for_each(|(place, axis)| *place = Some(axis));
        Ok(Self(held))
    }
}

impl fmt::Display for PageAxes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (axis, size) in self.named() {
            write!(f, "{}{}", axis.letter().to_ascii_lowercase(), size.map_or(String::new(), |n| n.to_string()))?;
        }
        f.write_str("yx")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Axis::{Channel, Time, Z};

    fn sizes(axes: &str, stored: &[(Axis, u64)]) -> Result<[(Axis, u64); 3], String> {
        let planes = stored.iter().map(|(_, n)| n).product();
        axes.parse::<PageAxes>().unwrap().sizes(stored, planes)
    }

    #[test]
    fn letters_rename_what_is_stored() {
        let one = Ok([(Z, 31), (Channel, 1), (Time, 1)]);
        assert_eq!(sizes("zyx", &[(Time, 31)]), one);
        assert_eq!(sizes("ZYX", &[(Channel, 31)]), one);
        assert_eq!(sizes("zyx", &[(Time, 5), (Z, 3)]).map(|s| s[0]), Ok((Z, 15)));
        assert_eq!(sizes("zcyx", &[(Time, 31), (Channel, 2)]), Ok([(Channel, 2), (Z, 31), (Time, 1)]));
        assert_eq!(sizes("ztyx", &[(Time, 31), (Z, 2)]), Ok([(Time, 2), (Z, 31), (Channel, 1)]));
        assert_eq!(sizes("tczyx", &[(Channel, 2), (Z, 9)]), Ok([(Z, 9), (Channel, 2), (Time, 1)]));
        assert_eq!(sizes("zc2yx", &[(Z, 62)]), Ok([(Channel, 2), (Z, 31), (Time, 1)]));
        assert_eq!(sizes("t2z31yxs", &[(Z, 62)]), Ok([(Z, 31), (Time, 2), (Channel, 1)]));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        for (axes, stored) in
            [("zcyx", vec![(Z, 62)]), ("zc4yx", vec![(Z, 62)]), ("z9yx", vec![(Z, 8)]), ("yx", vec![(Z, 8)])]
        {
            assert!(sizes(axes, &stored).is_err(), "{axes}");
        }
        for text in ["", "z", "xyz", "zzyx", "qyx", "z0yx", "zyxt", "\u{e9}yx", "z99999999999999999999yx"] {
            assert!(text.parse::<PageAxes>().is_err(), "{text}");
        }
        assert_eq!("TC3zYX".parse::<PageAxes>().unwrap().to_string(), "tc3zyx");
    }
}
