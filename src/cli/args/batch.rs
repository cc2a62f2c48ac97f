//! The flags of `strandline batch`.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

use super::common::LogArg;
use super::values::parse_size;

/// Run many items of a list, several at a time, each as a run of its own.
#[derive(Clone, Debug, Args)]
pub(crate) struct BatchArgs {
    /// List of what is to be run, see docs/batch.md; paths in it are relative to it
    #[arg(value_name = "JOBS.toml", required_unless_present = "init")]
    pub(crate) jobs: Option<PathBuf>,
    /// Folder for stores, logs and summaries; it is made where there is none. What is done there is not done again
    #[arg(short, long = "output", value_name = "DIR", required_unless_present = "init")]
    pub(crate) output: Option<PathBuf>,
    /// Only the items that fall to part I of N, counted from 1: one for each job of an array
    #[arg(long, value_name = "I/N")]
    pub(crate) shard: Option<Shard>,
    /// Print which items would run, why, and what they would take, and stop
    #[arg(long, conflicts_with = "summary")]
    pub(crate) dry_run: bool,
    /// Run nothing: write summaries of what is done so far, of all shards together
    #[arg(long)]
    pub(crate) summary: bool,
    /// Write FOLDER/jobs.toml for the stacks and points that lie there, and stop; one that is there stays
    #[arg(long, value_name = "FOLDER",
          conflicts_with_all = ["jobs", "output", "shard", "dry_run", "summary", "memory", "threads", "scratch"])]
    pub(crate) init: Option<PathBuf>,
    /// Memory limit of all items together that run at the same time: bytes, or with KiB, MiB, GiB, TiB (K, M, G, T mean
    /// the same) or kB, MB, GB, TB [default: half of what the machine or the control group has]
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Resources")]
    pub(crate) memory: Option<u64>,
    /// Threads of all items together [default: one for each core]
    #[arg(long, value_name = "N", help_heading = "Resources")]
    pub(crate) threads: Option<usize>,
    /// Folder for temporary fields of items, removed at their end [default: $TMPDIR, else DIR]
    #[arg(long, value_name = "DIR", help_heading = "Resources")]
    pub(crate) scratch: Option<PathBuf>,
    /// How it is told what happens: lines to read, or one JSON object an event
    #[arg(long, value_enum, default_value_t = LogArg::Text)]
    pub(crate) log: LogArg,
    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// A part of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    /// Which one, counted from 1.
    pub(crate) number: usize,
    pub(crate) of: usize,
}

impl Shard {
    /// Whether an item, by its place in the sorted list counted from 0, falls to it.
    pub(crate) fn has(self, place: usize) -> bool {
        place % self.of == self.number - 1
    }
}

/// More parts than any scheduler has jobs in an array.
const MOST_SHARDS: usize = 1_000_000;

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let what = "give a part and how many there are, such as 1/8: the part from 1 to their number, and no more than 1000000 of them";
        let number = |text: &str| text.parse().ok().filter(|_| text.bytes().all(|byte| byte.is_ascii_digit()));
        let (text, of) = text.split_once('/').ok_or(what)?;
        let (number, of): (usize, usize) = (number(text).ok_or(what)?, number(of).ok_or(what)?);
        if (1..=of).contains(&number) && of <= MOST_SHARDS { Ok(Self { number, of }) } else { Err(what.into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_falls_to_one_shard() {
        for of in 1..6 {
            let shards: Vec<Shard> = (1..=of).map(|number| format!("{number}/{of}").parse().unwrap()).collect();
            assert!((0..20).all(|place| shards.iter().filter(|shard| shard.has(place)).count() == 1));
        }
        assert_eq!("1000000/1000000".parse(), Ok(Shard { number: 1_000_000, of: 1_000_000 }));
        let absurd = ["1/1000001", "1/99999999999", "1/99999999999999999999999", "99999999999/8"];
        for text in ["", "1", "0/2", "3/2", "1/0", "a/2", "1/2/3", "-1/2", "+1/2", " 1/2", "1 / 2", "1.0/2"]
            .iter()
            .chain(&absurd)
        {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
