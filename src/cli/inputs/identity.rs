//! What tells one run from another: the program's version, what was asked for, and what its inputs hold. A run is gone on with only
//! by its equal.

use std::fs::{self, File, Metadata};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use clap::CommandFactory;
use clap::parser::ValueSource;

use crate::cli::args::command_line::Cli;
use crate::error::{Error, Result};
use crate::store::checkpoint::Identity;

/// What changes neither what is solved nor on which bricks: how it is run, told and written.
const WITHOUT_EFFECT: [&str; 20] = [
    "checkpoint",
    "checkpoint_every",
    "compress",
    "dry_run",
    "live",
    "log",
    "memory",
    "mesh",
    "ome",
    "output",
    "overwrite",
    "picture",
    "quiet",
    "ranks",
    "report",
    "resume",
    "scratch",
    "threads",
    "verbose",
    "vti",
];

/// Of a larger file so many pieces of so many bytes are looked at, beside its length and time.
const PIECES: u64 = 64;
const PIECE: u64 = 1 << 20;

/// The identity of the run that was typed.
///
/// # Errors
/// When an input cannot be read.
pub(crate) fn identity(typed: &[String]) -> Result<Identity> {
    let mut identity: Identity = vec![("the version".into(), env!("CARGO_PKG_VERSION").into())];
    let command = Cli::command();
    let Ok(matches) = command.clone().try_get_matches_from(typed) else { return Ok(identity) };
    let Some((name, given)) = matches.subcommand() else { return Ok(identity) };
    identity.push(("the command".into(), name.to_owned()));
    let Some(flags) = command.find_subcommand(name) else { return Ok(identity) };
    let mut flags: Vec<_> = flags.get_arguments().collect();
    flags.sort_by_key(|flag| flag.get_id().to_string());
    for flag in flags {
        let id = flag.get_id().as_str();
        if WITHOUT_EFFECT.contains(&id) || given.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        let name = flag.get_long().map_or_else(|| id.to_uppercase(), |long| format!("--{long}"));
        let values = given.get_raw(id).into_iter().flatten();
        let values: Vec<String> = values.map(|value| told(Path::new(value))).collect::<Result<_>>()?;
        identity.push((name, values.join(" ")));
    }
    Ok(identity)
}

/// A value; of a file or folder its name and what it holds, wherever it lies.
fn told(value: &Path) -> Result<String> {
    let Ok(metadata) = value.metadata() else { return Ok(value.to_string_lossy().into_owned()) };
    let name = value.file_name().unwrap_or(value.as_os_str()).to_string_lossy();
    let digest = digest(value, &metadata).map_err(|error| Error::from_io("cannot be read", &error).at(value))?;
    Ok(format!("{name} ({digest})"))
}

fn digest(path: &Path, metadata: &Metadata) -> io::Result<String> {
    let mut sum = 0;
    let mut bytes = 0;
    if metadata.is_dir() {
        add_folder(path, &mut sum, &mut bytes)?;
    } else if metadata.is_file() {
        bytes = metadata.len();
        sum = add_file(path, sum, bytes)?;
    }
    Ok(format!("{bytes} bytes, checksum {sum:08x}"))
}

/// The names and lengths of the files in a folder, and what small ones hold, in the order of their names.
fn add_folder(folder: &Path, sum: &mut u32, bytes: &mut u64) -> io::Result<()> {
    let mut entries: Vec<_> = fs::read_dir(folder)?.collect::<io::Result<_>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let (path, metadata) = (entry.path(), entry.metadata()?);
        *sum = crc32c::crc32c_append(*sum, entry.file_name().as_encoded_bytes());
        if metadata.is_dir() {
            add_folder(&path, sum, bytes)?;
        } else if metadata.is_file() {
            *bytes += metadata.len();
            *sum = add_file(&path, *sum, metadata.len())?;
        }
    }
    Ok(())
}

/// What a file holds, whole or in pieces from its first byte to its last.
fn add_file(path: &Path, sum: u32, bytes: u64) -> io::Result<u32> {
    let mut file = File::open(path)?;
    let mut sum = crc32c::crc32c_append(sum, &bytes.to_le_bytes());
    let count = bytes.div_ceil(PIECE).clamp(1, PIECES);
    let step = if count == bytes.div_ceil(PIECE) { PIECE } else { (bytes - PIECE) / (PIECES - 1) };
    let mut piece = Vec::new();
    for n in 0..count {
        file.seek(SeekFrom::Start(n * step))?;
        piece.clear();
        file.by_ref().take(PIECE).read_to_end(&mut piece)?;
        sum = crc32c::crc32c_append(sum, &piece);
    }
    Ok(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(words: &[&str]) -> Identity {
        let typed: Vec<String> = ["strandline"].iter().chain(words).map(|word| (*word).to_owned()).collect();
        identity(&typed).unwrap()
    }

    #[test]
    fn what_has_an_effect_is_told_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let cloud = dir.path().join("a.xyz");
        fs::write(&cloud, "0 0 0\n").unwrap();
        let cloud = cloud.to_str().unwrap();
        let one = of(&["distance", cloud, "--spacing", "0.5", "-o", "a.zarr", "--threads", "2"]);
        assert_eq!(one, of(&["distance", "--spacing=0.5", cloud, "-o", "b.zarr", "--memory", "1GiB", "--resume"]));
        assert_ne!(one, of(&["distance", cloud, "--spacing", "0.5", "--labels", "-o", "a.zarr"]));
        assert_ne!(one, of(&["distance", cloud, "--spacing", "0.25", "-o", "a.zarr"]));
        fs::write(cloud, "0 0 1\n").unwrap();
        assert_ne!(one, of(&["distance", cloud, "--spacing", "0.5", "-o", "a.zarr"]));
        assert!(one.iter().any(|(name, value)| name == "--spacing" && value == "0.5"), "{one:?}");
    }

    #[test]
    fn large_files_are_looked_at_from_the_first_byte_to_the_last() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("large");
        let mut bytes = vec![7_u8; (PIECES * PIECE) as usize + 12_345];
        let sum = |bytes: &[u8]| {
            fs::write(&path, bytes).unwrap();
            add_file(&path, 0, bytes.len() as u64).unwrap()
        };
        let before = sum(&bytes);
        let last = bytes.len() - 1;
        for at in [0, last] {
            bytes[at] = 8;
            assert_ne!(sum(&bytes), before, "byte {at}");
            bytes[at] = 7;
        }
        assert_eq!(sum(&bytes), before);
    }
}
