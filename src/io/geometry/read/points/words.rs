//! The words in the name of a column that holds coordinates: an axis, words that only say that a position follows, a unit.

use crate::io::geometry::read::point_units::{Unit, mended};

/// Words that say that a position follows, or of what; those that say it best come first.
const FILLERS: [&str; 25] = [
    "position",
    "pos",
    "coordinate",
    "coordinates",
    "coord",
    "coords",
    "location",
    "loc",
    "point",
    "points",
    "centroid",
    "center",
    "centre",
    "of",
    "mass",
    "spot",
    "cell",
    "nucleus",
    "world",
    "marker",
    "the",
    "at",
    "in",
    // XM, YM and CX, CY, CZ: centres of mass and of volume (ImageJ).
    "m",
    "c",
];

/// The name of a column that holds coordinates.
pub(crate) struct Name {
    pub(crate) axis: usize,
    /// The places of its other words in [`FILLERS`]; columns of one position share them.
    pub(crate) family: Vec<usize>,
    pub(crate) unit: Option<Unit>,
}

impl Name {
    pub(crate) fn in_voxels(&self) -> bool {
        self.unit == Some(Unit::Voxels)
    }

    /// What a name says; none where it is no coordinate's.
    pub(crate) fn of(name: &str) -> Option<Self> {
        let name = mended(name.trim().trim_matches('"'));
        let (mut unit, mut bare) = (None, name.clone());
        if let Some(open) = name.find(['(', '[']) {
            let inner = &name[open + 1..];
            let end = inner.find([')', ']'])?;
            unit = Unit::of(&inner[..end]);
            bare = format!("{} {}", &name[..open], &inner[end + 1..]);
        }
        let (mut axis, mut family) = (None, Vec::new());
        let words = words(&bare);
        for word in &words {
            if let Some(found) = ["x", "y", "z"].iter().position(|axis| axis == word) {
                if axis.replace(found).is_some() {
                    return None;
                }
            } else if let Some(filler) = FILLERS.iter().position(|filler| filler == word) {
                family.push(filler);
            } else if let Some(said) = Unit::of(word).filter(|_| word.chars().count() > 1) {
                unit = unit.or(Some(said));
            } else if let Some(found) = word.parse().ok().filter(|&axis: &usize| axis < 3 && words[0] == "points") {
                axis = Some(found);
            } else {
                return None;
            }
        }
        Some(Self { axis: axis?, family, unit })
    }
}

/// The words of a name in lower case: between signs, and where a capital follows a small letter; `xpos` is two.
fn words(name: &str) -> Vec<String> {
    let mut spaced = String::new();
    let mut before = ' ';
    for letter in name.chars() {
        if letter.is_uppercase() && before.is_lowercase() {
            spaced.push(' ');
        }
        spaced.push(if letter.is_alphanumeric() { letter } else { ' ' });
        before = letter;
    }
    let mut words = Vec::new();
    for word in spaced.to_lowercase().split_whitespace() {
        let glued = |axis: &&str| {
            let rest = word.strip_prefix(axis).or(word.strip_suffix(axis))?;
            FILLERS.contains(&rest).then(|| [(*axis).to_owned(), rest.to_owned()])
        };
        match ["x", "y", "z"].iter().find_map(glued) {
            Some(two) => words.extend(two),
            None => words.push(word.to_owned()),
        }
    }
    words
}

/// The families of names, first those with the fewest and best words: of each those in lengths, those in voxels, and
/// both together.
pub(crate) fn families(read: &[Option<Name>]) -> Vec<(Vec<usize>, Option<bool>)> {
    let mut families: Vec<Vec<usize>> = read.iter().flatten().map(|name| name.family.clone()).collect();
    families.sort_by(|a, b| a.len().min(1).cmp(&b.len().min(1)).then(a.cmp(b)));
    families.dedup();
    families.into_iter().flat_map(|family| [Some(false), Some(true), None].map(|v| (family.clone(), v))).collect()
}
