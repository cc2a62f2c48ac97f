//! A folder's files as planes of channels, times and slices, by the numbers and words of their names.
//!
//! Names of one kind differ in numbers alone. A number that varies counts slices, channels or times, as the letters before it
//! say; names that differ in a word and share their numbers are channels. What does not fit is told or refused.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use super::names::{Marker, Name, natural};
use crate::io::stack::page_axes::PageAxes;
use crate::io::stack::tiff::description::layout::{Axis, Dimensions};

/// The planes of a folder.
#[derive(Debug)]
pub(crate) struct Sequence {
    /// By number of channel and time, counted from 0, and of slice as its name has it.
    planes: BTreeMap<[u64; 2], BTreeMap<u128, Name>>,
    /// The numbers of slices that any channel and time has.
    slices: Vec<u128>,
    /// Whether the slices are counted by the numbers of one column, which must leave none out.
    counted: bool,
    pub(crate) dimensions: Dimensions,
    pub(crate) notes: Vec<String>,
}

/// Puts files in order; `axes` says what varies, in place of the names. Fails with one sentence that names no folder.
pub(crate) fn arrange(mut names: Vec<Name>, axes: Option<&PageAxes>) -> Result<Sequence, String> {
    names.sort_by(|a, b| natural(&a.file(), &b.file()));
    let mut notes = Vec::new();
    let kinds = kinds(names, &mut notes)?;
    let of_channels = |axes: &PageAxes| axes.len() > 1 || axes.named().any(|(axis, _)| axis == Axis::Channel);
    if kinds.len() > 1 && axes.is_some_and(of_channels) {
        return Err(several_words(&kinds));
    }
    // Names that have nothing in common are in order, and say no more.
    let first = kinds[0][0].pattern();
    if axes.is_none() && kinds[0].iter().any(|name| name.pattern() != first) {
        return by_count(kinds, &"zyx".parse()?, notes);
    }
    let columns = varying(&kinds);
    match axes {
        Some(axes) if axes.counts_planes() => by_count(kinds, axes, notes),
        Some(axes) if axes.len() == columns.len() => {
            by_numbers(kinds, &axes.named().map(|(axis, _)| axis).zip(columns).collect::<Vec<_>>(), notes)
        }
        Some(axes) => Err(format!(
            "--axes {axes} names {} axes but {} numbers vary in the names (such as {}); give a letter for each, or sizes as in \
             zc2yx",
            axes.len(),
            columns.len(),
            kinds[0][0].file()
        )),
        None => {
            let roles = roles(&kinds, columns)?;
            by_numbers(kinds, &roles, notes)
        }
    }
}

impl Sequence {
    /// The first of all files.
    pub(crate) fn any_file(&self) -> Option<&PathBuf> {
        self.planes.values().flat_map(BTreeMap::values).map(|name| &name.path).next()
    }

    /// The files of a channel at a time, slice by slice; refuses those of which slices are missing.
    pub(crate) fn files(&self, channel: u64, time: u64) -> Result<Vec<PathBuf>, String> {
        let nothing = BTreeMap::new();
        let planes = self.planes.get(&[channel, time]).unwrap_or(&nothing);
        if self.counted {
            self.refuse_gaps(planes)?;
        }
        Ok(planes.values().map(|name| name.path.clone()).collect())
    }

    /// Slices that are not there, between others or where other channels and times have them.
    fn refuse_gaps(&self, planes: &BTreeMap<u128, Name>) -> Result<(), String> {
        let step = step(&self.slices);
        let (Some(&first), Some(&last)) = (self.slices.first(), self.slices.last()) else { return Ok(()) };
        let mut missing = 0;
        let mut jumps = Vec::new();
        for ((a, before), (b, after)) in
            planes.iter().zip(planes.iter().skip(1)).filter(|((a, _), (b, _))| *b - *a != step)
        {
            missing += ((b - a) / step).max(2) - 1;
            jumps.push(format!("{} is followed by {}", before.stem(), after.stem()));
        }
        let ends = planes.first_key_value().zip(planes.last_key_value());
        let Some(((&low, first_file), (&high, last_file))) = ends else {
            return Err("this channel has no files at this time".to_string());
        };
        if low != first {
            missing += (low - first) / step;
            jumps.push(format!("{} is the first where others begin with number {first}", first_file.stem()));
        }
        if high != last {
            missing += (last - high) / step;
            jumps.push(format!("{} is the last where others end with number {last}", last_file.stem()));
        }
        if jumps.is_empty() {
            return Ok(());
        }
        let more = if jumps.len() > 6 { format!(", and {} gaps more", jumps.len() - 6) } else { String::new() };
        jumps.truncate(6);
        let verb = if missing == 1 { "number is" } else { "numbers are" };
        let anyway =
            if self.planes.len() == 1 { ", or give --axes zyx if the files are neighbours all the same" } else { "" };
        Err(format!(
            "{}{more}: {missing} {verb} missing, and slices beyond would lie at a wrong z; put the files there, for lost ones \
             copies of a neighbour{anyway}",
            jumps.join(", ")
        ))
    }
}

/// The files of one word each, those that do not belong left out.
fn kinds(names: Vec<Name>, notes: &mut Vec<String>) -> Result<Vec<Vec<Name>>, String> {
    let all = names.len();
    let mut groups: BTreeMap<Vec<String>, Vec<Name>> = BTreeMap::new();
    for name in names.iter().cloned() {
        groups.entry(name.pattern()).or_default().push(name);
    }
    let size = |derived: bool| groups.values().filter(|group| group[0].is_derived() == derived).map(Vec::len).max();
    let (plain, derived) = (size(false).unwrap_or(0), size(true).unwrap_or(0));
    // Projections alone are slices like any others.
    let use_plain = plain > 1 || plain >= derived;
    let most = if use_plain { plain } else { derived };
    if most < 2 && all > 1 {
        let left: Vec<Name> = names.iter().filter(|name| name.is_derived()).cloned().collect();
        let kept: Vec<Name> =
            names.into_iter().filter(|name| left.is_empty() || left.len() == all || !name.is_derived()).collect();
        if kept.len() < all {
            note_foreign_files(&left, &kept[0], notes);
        }
        if kept.len() > 1 {
            notes.push(format!(
                "the names have no number in common: {} files are planes along z in the order of their names, from {} to {}",
                kept.len(),
                kept[0].file(),
                kept[kept.len() - 1].file()
            ));
        }
        return Ok(vec![kept]);
    }
    let main = groups.iter().find(|(_, group)| group[0].is_derived() != use_plain && group.len() == most);
    let Some(main) = main.map(|(pattern, _)| pattern.clone()) else { return Ok(vec![names]) };
    let numbers = |group: &[Name]| group.iter().map(|name| name.numbers.clone()).collect::<BTreeSet<_>>();
    let shared = numbers(&groups[&main]);
    let belongs = |group: &[Name]| {
        group[0].is_derived() != use_plain
            && 2 * numbers(group).intersection(&shared).count() > shared.len().max(group.len())
    };
    let (kept, strangers): (Vec<_>, Vec<_>) = groups.into_values().partition(|group| belongs(group));
    let unclear = strangers.iter().any(|group| group.len() > 1 && (!group[0].is_derived() || !use_plain));
    let strangers: Vec<Name> = strangers.into_iter().flatten().collect();
    if unclear && 4 * strangers.iter().filter(|name| !name.is_derived()).count() > most {
        return Err(format!(
            "it holds files of several kinds: {} as {}, {} as {}; put those of one stack into a folder of their own",
            most,
            kept[0][0].file(),
            strangers.len(),
            strangers[0].file()
        ));
    }
    if !strangers.is_empty() {
        note_foreign_files(&strangers, &kept[0][0], notes);
    }
    Ok(kept)
}

fn note_foreign_files(strangers: &[Name], slice: &Name, notes: &mut Vec<String>) {
    let listed: Vec<String> = strangers.iter().take(4).map(Name::file).collect();
    let more = if strangers.len() > 4 { format!(" and {} more", strangers.len() - 4) } else { String::new() };
    let verb = if strangers.len() == 1 { "is not named like the slices" } else { "are not named like the slices" };
    notes.push(format!("{}{more} {verb} ({}) and left out", listed.join(", "), slice.file()));
}

/// The columns of numbers that are not the same in all names.
fn varying(kinds: &[Vec<Name>]) -> Vec<usize> {
    let columns = kinds[0][0].numbers.len();
    let alike = kinds.iter().flatten().all(|name| name.numbers.len() == columns);
    let first = &kinds[0][0].numbers;
    (0..if alike { columns } else { 0 })
        .filter(|&column| kinds.iter().flatten().any(|name| name.numbers[column] != first[column]))
        .collect()
}

/// What the columns count, by the letters before them.
fn roles(kinds: &[Vec<Name>], columns: Vec<usize>) -> Result<Vec<(Axis, usize)>, String> {
    let columns = without_counters(&kinds[0], independent(&kinds[0], columns));
    let alone = columns.len() == 1;
    let marked: Vec<Option<Marker>> = columns.iter().map(|&column| kinds[0][0].marker(column, alone)).collect();
    let holds = |wanted: Option<Marker>| marked.iter().filter(|marker| **marker == wanted).count();
    let z = Some(Marker::Axis(Axis::Z));
    let open = holds(None);
    let free = |marker: Option<Marker>| match marker {
        Some(Marker::Axis(axis)) => Some(axis),
        None if open == 1 && holds(z) == 0 => Some(Axis::Z),
        Some(Marker::Series) if open == 0 && holds(z) == 0 => Some(Axis::Z),
        Some(Marker::Place) if columns.len() == 1 => Some(Axis::Z),
        _ => None,
    };
    let axes: Vec<Option<Axis>> = marked.iter().map(|&marker| free(marker)).collect();
    let twice = |axis: &Option<Axis>| axes.iter().filter(|other| *other == axis).count() > 1;
    let words = kinds.len() > 1 && axes.contains(&Some(Axis::Channel));
    if axes.iter().any(|axis| axis.is_none() || twice(axis)) || words {
        let ranges: Vec<String> = columns.iter().map(|&column| range(kinds, column)).collect();
        let advice = if marked.contains(&Some(Marker::Place)) {
            "places on the stage are no axis of a stack: keep one in the folder"
        } else if kinds.len() > 1 {
            "put the files of one channel into a folder of their own"
        } else {
            "give --axes with a letter for each in their order, as zcyx where the first counts slices and the second channels"
        };
        return Err(format!(
            "{} numbers vary in the names ({}, as in {}) and these do not say which of them counts slices; {advice}",
            columns.len(),
            ranges.join(" and "),
            kinds[0][0].file()
        ));
    }
    Ok(axes.into_iter().flatten().zip(columns).collect())
}

/// The values of a column, with the letters before it.
fn range(kinds: &[Vec<Name>], column: usize) -> String {
    let values: BTreeSet<u128> = kinds.iter().flatten().map(|name| name.numbers[column]).collect();
    let letters = kinds[0][0].texts[column].trim_matches(|c: char| !c.is_alphabetic());
    let (low, high) = (values.first().copied().unwrap_or(0), values.last().copied().unwrap_or(0));
    format!("{letters} {low} to {high}").trim().to_string()
}

/// Leaves out columns that only go along with another, such as the times at which slices were taken.
fn independent(names: &[Name], columns: Vec<usize>) -> Vec<usize> {
    let ordered = |by: usize, column: usize| {
        let mut pairs: Vec<(u128, u128)> = names.iter().map(|name| (name.numbers[by], name.numbers[column])).collect();
        pairs.sort_unstable();
        pairs.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 < pair[1].1)
    };
    let gaps = |column: usize| {
        let values: Vec<u128> =
            names.iter().map(|name| name.numbers[column]).collect::<BTreeSet<_>>().into_iter().collect();
        let step = step(&values);
        values.windows(2).filter(|pair| pair[1] - pair[0] != step).count()
    };
    let is_z = |column: usize| names[0].marker(column, false) == Some(Marker::Axis(Axis::Z));
    let mut kept: Vec<usize> = Vec::new();
    for column in columns {
        match kept.iter().position(|&other| ordered(other, column)) {
            None => kept.push(column),
            Some(place) => {
                let other = kept[place];
                if (!is_z(column), gaps(column)) < (!is_z(other), gaps(other)) {
                    kept[place] = column;
                }
            }
        }
    }
    kept
}

/// Leaves out columns that nothing says what they count, where the others tell slices, channels and times apart.
fn without_counters(names: &[Name], columns: Vec<usize>) -> Vec<usize> {
    let axes =
        columns.iter().copied().filter(|&column| matches!(names[0].marker(column, false), Some(Marker::Axis(_))));
    let axes: Vec<usize> = axes.collect();
    let keys: BTreeSet<Vec<u128>> =
        names.iter().map(|name| axes.iter().map(|&column| name.numbers[column]).collect()).collect();
    let has_z = axes.iter().any(|&column| names[0].marker(column, false) == Some(Marker::Axis(Axis::Z)));
    if has_z && keys.len() == names.len() { axes } else { columns }
}

/// The usual distance of numbers, ascending: their smallest.
fn step(values: &[u128]) -> u128 {
    values.windows(2).map(|pair| pair[1] - pair[0]).min().unwrap_or(1).max(1)
}

/// Files as planes one after the other, of axes with the sizes that were said.
fn by_count(kinds: Vec<Vec<Name>>, axes: &PageAxes, notes: Vec<String>) -> Result<Sequence, String> {
    let channels = kinds.len() as u64;
    let files = kinds[0].len() as u64;
    let order = Dimensions(axes.sizes(&[], files)?);
    let mut sequence =
        Sequence { planes: BTreeMap::new(), slices: Vec::new(), counted: false, dimensions: order, notes };
    for (channel, names) in kinds.into_iter().enumerate() {
        let mut names: Vec<Option<Name>> = names.into_iter().map(Some).collect();
        for (c, t, z) in triples(&order) {
            let name = names.get_mut(order.plane(c, t, z) as usize).and_then(Option::take);
            let name =
                name.ok_or("files of another word are fewer; put those of one channel into a folder of their own")?;
            let channel = if channels > 1 { channel as u64 } else { c };
            sequence.planes.entry([channel, t]).or_default().insert(z.into(), name);
        }
    }
    if channels > 1 {
        let [slices, times] = [Axis::Z, Axis::Time].map(|axis| (axis, order.size(axis)));
        sequence.dimensions = Dimensions([slices, (Axis::Channel, channels), times]);
    }
    Ok(sequence)
}

/// All planes of such sizes.
fn triples(order: &Dimensions) -> impl Iterator<Item = (u64, u64, u64)> + use<> {
    let [channels, times, slices] = [Axis::Channel, Axis::Time, Axis::Z].map(|axis| order.size(axis));
    (0..channels).flat_map(move |c| (0..times).flat_map(move |t| (0..slices).map(move |z| (c, t, z))))
}

/// Files as planes by the numbers in some columns.
fn by_numbers(kinds: Vec<Vec<Name>>, roles: &[(Axis, usize)], mut notes: Vec<String>) -> Result<Sequence, String> {
    let column = |axis: Axis| roles.iter().find(|(a, _)| *a == axis).map(|&(_, column)| column);
    let values = |axis: Axis| -> Vec<u128> {
        let Some(column) = column(axis) else { return vec![0] };
        kinds.iter().flatten().map(|name| name.numbers[column]).collect::<BTreeSet<_>>().into_iter().collect()
    };
    let [channels, times, slices] = [Axis::Channel, Axis::Time, Axis::Z].map(values);
    let held = if kinds.len() > 1 { kinds.len() } else { channels.len() };
    note_axes(&kinds, roles, &slices, &mut notes);
    let order = [(Axis::Z, slices.len()), (Axis::Channel, held), (Axis::Time, times.len())];
    let dimensions = Dimensions(order.map(|(axis, n)| (axis, n as u64)));
    let counted = column(Axis::Z).is_some();
    let several = kinds.len() > 1;
    let mut planes: BTreeMap<[u64; 2], BTreeMap<u128, Name>> = BTreeMap::new();
    for (word, name) in kinds.into_iter().enumerate().flat_map(|(word, kind)| kind.into_iter().map(move |n| (word, n)))
    {
        let number = |axis: Axis| column(axis).map_or(0, |column| name.numbers[column]);
        let rank = |values: &[u128], axis: Axis| values.partition_point(|&v| v < number(axis)) as u64;
        let channel = if several { word as u64 } else { rank(&channels, Axis::Channel) };
        let slot = planes.entry([channel, rank(&times, Axis::Time)]).or_default();
        let (z, file) = (number(Axis::Z), name.file());
        if let Some(other) = slot.insert(z, name) {
            return Err(format!(
                "{} and {file} have the same numbers; leave one of them there, or give --axes zyx if all files are planes \
                 along z",
                other.file()
            ));
        }
    }
    let short = planes.values().filter(|plane| plane.len() < slices.len()).count() + held * times.len() - planes.len();
    if short > 0 && held * times.len() > 1 {
        notes.push(format!("{short} of {} channels and times do not have all slices", held * times.len()));
    }
    Ok(Sequence { planes, slices, counted, dimensions, notes })
}

/// Says what the numbers and words were taken for, where there is more than slices one by one.
fn note_axes(kinds: &[Vec<Name>], roles: &[(Axis, usize)], slices: &[u128], notes: &mut Vec<String>) {
    if kinds.len() > 1 {
        let listed: Vec<String> =
            kinds.iter().enumerate().map(|(n, kind)| format!("{n}: {}", kind[0].file())).collect();
        notes.push(format!("files of {} names are channels ({}); --channel picks one", kinds.len(), listed.join(", ")));
    }
    if roles.len() > 1 {
        let listed: Vec<String> = roles
            .iter()
            .map(|&(axis, column)| {
                let of = match axis {
                    Axis::Channel => "channels",
                    Axis::Z => "slices",
                    Axis::Time => "times",
                };
                format!("{} are {of}", range(kinds, column))
            })
            .collect();
        notes.push(format!(
            "{} numbers vary in the names: {}; --channel and --time pick one, counted from 0",
            roles.len(),
            listed.join(", ")
        ));
    }
    let step = step(slices);
    if step > 1 {
        notes.push(format!(
            "the numbers of the slices go up by {step}; slices are neighbours all the same, so give --image-spacing if the \
             file's counts each number"
        ));
    }
}

fn several_words(kinds: &[Vec<Name>]) -> String {
    format!(
        "files are named in {} ways ({}, {}), which are channels; --axes does not say more of these, so put those of one \
         channel into a folder of their own",
        kinds.len(),
        kinds[0][0].file(),
        kinds[1][0].file()
    )
}
