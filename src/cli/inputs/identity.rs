//! What tells one run from another: the program's version, what was asked for, and what its inputs hold. A run is gone on with only
//! by its equal.

use std::fs::{self, File, Metadata};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use clap::CommandFactory;
use clap::builder::ValueParser;
use clap::parser::ValueSource;

use crate::cli::args::command_line::Cli;
use crate::error::{Error, Result};
use crate::io::geometry::read::sources::is_standard_input;
use crate::job::resources::folder_of;
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

/// Files are read in pieces of so many bytes, all of them up to so many.
const PIECE: u64 = 1 << 20;
const WHOLE: u64 = 1 << 10;
/// Of a larger file so many pieces are looked at, beside its length and time.
const PIECES: u64 = 64;
/// No header is longer.
const HEADER: u64 = 1 << 16;

/// The identity of the run that was typed.
///
/// # Errors
/// When an input cannot be read.
pub(crate) fn identity(typed: &[String]) -> Result<Option<Identity>> {
    let mut identity: Identity = vec![("the version".into(), env!("CARGO_PKG_VERSION").into())];
    let command = Cli::command();
    let Ok(matches) = command.clone().try_get_matches_from(typed) else { return Ok(Some(identity)) };
    let Some((name, given)) = matches.subcommand() else { return Ok(Some(identity)) };
    identity.push(("the command".into(), name.to_owned()));
    let Some(flags) = command.find_subcommand(name) else { return Ok(Some(identity)) };
    let mut flags: Vec<_> = flags.get_arguments().collect();
    flags.sort_by_key(|flag| flag.get_id().to_string());
    for flag in flags {
        let id = flag.get_id().as_str();
        if WITHOUT_EFFECT.contains(&id) || given.value_source(id) != Some(ValueSource::CommandLine) {
            continue;
        }
        let name = flag.get_long().map_or_else(|| id.to_uppercase(), |long| format!("--{long}"));
        let is_path = flag.get_value_parser().type_id() == ValueParser::path_buf().type_id();
        let values = given.get_raw(id).into_iter().flatten().map(Path::new);
        let values = if is_path {
            let Some(values) = values.map(told).collect::<Result<Option<Vec<_>>>>()? else { return Ok(None) };
            values
        } else {
            values.map(|value| value.to_string_lossy().into_owned()).collect()
        };
        identity.push((name, values.join(" ")));
    }
    Ok(Some(identity))
}

/// The name of a file or folder and what it holds, wherever it lies; none where it can be read once only.
fn told(value: &Path) -> Result<Option<String>> {
    if is_standard_input(value) {
        return Ok(None);
    }
    let Ok(metadata) = value.metadata() else { return Ok(Some(value.to_string_lossy().into_owned())) };
    if !metadata.is_file() && !metadata.is_dir() {
        return Ok(None);
    }
    let name = value.file_name().unwrap_or(value.as_os_str()).to_string_lossy();
    let digest = digest(value, &metadata).map_err(|error| Error::from_io("cannot be read", &error).at(value))?;
    Ok(Some(format!("{name} ({digest})")))
}

fn digest(path: &Path, metadata: &Metadata) -> io::Result<String> {
    let mut sum = 0;
    let mut bytes = 0;
    if metadata.is_dir() {
        add_folder(path, &mut sum, &mut bytes)?;
    } else if metadata.is_file() {
        bytes = metadata.len();
        sum = add_file(path, sum, metadata)?;
        // Values that lie in other files than their header.
        for other in detached(path)? {
            let metadata = other.metadata()?;
            bytes += metadata.len();
            sum = add_file(&other, sum, &metadata)?;
        }
    }
    Ok(format!("{bytes} bytes, checksum {sum:08x}"))
}

/// The names and lengths of the files in a folder, and what small ones hold, in the order of their names.
fn add_folder(folder: &Path, sum: &mut u32, bytes: &mut u64) -> io::Result<()> {
    let mut entries: Vec<_> = fs::read_dir(folder)?.collect::<io::Result<_>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        let metadata = fs::metadata(&path)?;
        *sum = crc32c::crc32c_append(*sum, entry.file_name().as_encoded_bytes());
        if metadata.is_dir() {
            add_folder(&path, sum, bytes)?;
        } else if metadata.is_file() {
            *bytes += metadata.len();
            *sum = add_file(&path, *sum, &metadata)?;
        }
    }
    Ok(())
}

/// What a file holds: all of it, or, of a large one, its time and pieces from its first byte to its last.
fn add_file(path: &Path, sum: u32, metadata: &Metadata) -> io::Result<u32> {
    let mut file = File::open(path)?;
    let bytes = metadata.len();
    let mut sum = crc32c::crc32c_append(sum, &bytes.to_le_bytes());
    let all = bytes.div_ceil(PIECE);
    let (count, step) = if all <= WHOLE { (all, PIECE) } else { (PIECES, (bytes - PIECE) / (PIECES - 1)) };
    if all > WHOLE {
        let time = metadata.modified()?.duration_since(UNIX_EPOCH).unwrap_or_default();
        sum = crc32c::crc32c_append(sum, &time.as_nanos().to_le_bytes());
    }
    let mut piece = Vec::new();
    for n in 0..count {
        // The last one ends with the file.
        let at = if all > WHOLE && n + 1 == count { bytes - PIECE } else { n * step };
        file.seek(SeekFrom::Start(at))?;
        piece.clear();
        file.by_ref().take(PIECE).read_to_end(&mut piece)?;
        sum = crc32c::crc32c_append(sum, &piece);
    }
    Ok(sum)
}

/// The files that an NRRD header names as those of its values; of a list or a pattern all files beside it.
fn detached(header: &Path) -> io::Result<Vec<PathBuf>> {
    let mut start = Vec::new();
    File::open(header)?.take(HEADER).read_to_end(&mut start)?;
    if !start.starts_with(b"NRRD") {
        return Ok(Vec::new());
    }
    let text = String::from_utf8_lossy(&start);
    let text = text.split("\n\n").next().unwrap_or_default();
    let named = text.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        matches!(key.trim().to_lowercase().as_str(), "data file" | "datafile").then(|| value.trim())
    });
    let Some(named) = named else { return Ok(Vec::new()) };
    let folder = folder_of(header);
    if !named.starts_with("LIST") && !named.contains('%') {
        return Ok(vec![folder.join(named)].into_iter().filter(|path| path.is_file()).collect());
    }
    let entries = fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    let mut files: Vec<_> = entries.into_iter().map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::FileExt;

    use super::*;

    fn of(words: &[&str]) -> Identity {
        let typed: Vec<String> = ["strandline"].iter().chain(words).map(|word| (*word).to_owned()).collect();
        identity(&typed).unwrap().unwrap()
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
    fn what_is_read_once_is_nobody_and_what_lies_beside_a_header_counts() {
        let dir = tempfile::tempdir().unwrap();
        let typed =
            |words: &[&str]| ["strandline"].iter().chain(words).map(|word| (*word).to_owned()).collect::<Vec<_>>();
        assert!(identity(&typed(&["distance", "-", "-o", "a.zarr"])).unwrap().is_none());
        let (header, values) = (dir.path().join("v.nhdr"), dir.path().join("v.raw"));
        fs::write(&header, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 2\ndata file: v.raw\n").unwrap();
        fs::write(&values, [1, 2]).unwrap();
        let marks = dir.path().join("30");
        fs::write(&marks, "1").unwrap();
        let words = ["segment", header.to_str().unwrap(), "--points", marks.to_str().unwrap(), "-o", "a.zarr"];
        let before = of(&words);
        fs::write(&values, [1, 3]).unwrap();
        assert_ne!(of(&words), before);
        fs::write(&values, [1, 2]).unwrap();
        assert_eq!(of(&words), before);
    }

    #[test]
    fn large_files_are_looked_at_from_the_first_byte_to_the_last() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("large");
        let length = (WHOLE + 5) * PIECE + 12_345;
        let file = File::options().create_new(true).read(true).write(true).open(&path).unwrap();
        file.set_len(length).unwrap();
        let time = fs::metadata(&path).unwrap().modified().unwrap();
        let sum = |file: &File| {
            file.set_modified(time).unwrap();
            add_file(&path, 0, &fs::metadata(&path).unwrap()).unwrap()
        };
        let before = sum(&file);
        for at in [0, length - 1] {
            file.write_all_at(&[8], at).unwrap();
            assert_ne!(sum(&file), before, "byte {at}");
            file.write_all_at(&[0], at).unwrap();
        }
        assert_eq!(sum(&file), before);
        file.set_modified(time + std::time::Duration::from_secs(1)).unwrap();
        assert_ne!(add_file(&path, 0, &fs::metadata(&path).unwrap()).unwrap(), before, "its time");
    }
}
