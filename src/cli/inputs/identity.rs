//! What tells one run from another: the program's version, what was asked for, and what its inputs hold. A run is gone on with only
//! by its equal.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::time::UNIX_EPOCH;

use super::content::files_of;
use super::typed::Typed;
use crate::error::{Error, Result};
use crate::io::geometry::read::sources::is_standard_input;
use crate::store::checkpoint::Identity;

/// What changes neither what is solved nor on which bricks: how it is run, told and written.
const WITHOUT_EFFECT: [&str; 19] = [
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
];

/// Files of so many bytes are read whole.
const WHOLE: u64 = 1 << 30;
/// Of larger ones so many pieces of so many bytes are, beside their length and time.
const PIECES: u64 = 64;
const PIECE: usize = 1 << 20;
/// Digits of a hash that are told.
const HASH_DIGITS: usize = 16;

/// The identity of the run that was typed.
///
/// # Errors
/// When an input cannot be read.
pub(crate) fn identity(typed: &[String]) -> Result<Option<Identity>> {
    let mut identity: Identity = vec![("the version".into(), env!("CARGO_PKG_VERSION").into())];
    let Ok(Typed { command, mut given }) = Typed::read(typed) else { return Ok(Some(identity)) };
    identity.push(("the command".into(), command));
    given.retain(|given| !WITHOUT_EFFECT.contains(&given.id.as_str()));
    given.sort_by(|a, b| a.id.cmp(&b.id));
    for given in given {
        let name = given.name();
        let values = given.values.iter().map(Path::new);
        let values = if given.is_path {
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
    let digest = digest(value).map_err(|error| Error::from_io("cannot be read", &error).at(value))?;
    Ok(Some(format!("{name} ({digest})")))
}

/// The names, lengths and contents of an input's files.
fn digest(input: &Path) -> io::Result<String> {
    let (mut hasher, mut bytes) = (blake3::Hasher::new(), 0);
    for (name, path) in files_of(input)? {
        hasher.update(name.as_os_str().as_encoded_bytes());
        bytes += add_file(&mut hasher, &path)?;
    }
    Ok(format!("{bytes} bytes, hash {}", &hasher.finalize().to_hex()[..HASH_DIGITS]))
}

/// What a file holds: all of it, or, of a large one, its time and pieces from its first byte to its last. Returns its bytes.
fn add_file(hasher: &mut blake3::Hasher, path: &Path) -> io::Result<u64> {
    let mut file = File::open(path)?;
    let metadata = file.metadata()?;
    let bytes = metadata.len();
    hasher.update(&bytes.to_le_bytes());
    if bytes <= WHOLE {
        hasher.update_reader(file)?;
        return Ok(bytes);
    }
    let time = metadata.modified()?.duration_since(UNIX_EPOCH).unwrap_or_default();
    hasher.update(&time.as_nanos().to_le_bytes());
    let mut piece = vec![0; PIECE];
    for n in 0..PIECES {
        // The last one ends with the file.
        file.seek(SeekFrom::Start((bytes - PIECE as u64) / (PIECES - 1) * n))?;
        if n + 1 == PIECES {
            file.seek(SeekFrom::End(-(PIECE as i64)))?;
        }
        file.read_exact(&mut piece)?;
        hasher.update(&piece);
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::FileExt;

    use clap::CommandFactory;

    use super::*;
    use crate::cli::args::command_line::Cli;

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
        let timed = of(&["distance", cloud, "--speed", cloud, "-o", "a.zarr"]);
        fs::write(cloud, "0 0 2\n").unwrap();
        assert_ne!(timed, of(&["distance", "b.xyz", "--speed", cloud, "-o", "a.zarr"]));
        assert!(timed.iter().any(|(name, value)| name == "--speed" && value.contains("hash")), "{timed:?}");
        assert!(one.iter().any(|(name, value)| name == "--spacing" && value == "0.5"), "{one:?}");
    }

    #[test]
    fn what_is_read_once_is_nobody_and_what_lies_beside_a_header_counts() {
        let dir = tempfile::tempdir().unwrap();
        let typed =
            |words: &[&str]| ["strandline"].iter().chain(words).map(|word| (*word).to_owned()).collect::<Vec<_>>();
        assert!(identity(&typed(&["distance", "-", "-o", "a.zarr"])).unwrap().is_none());
        let (header, values) = (dir.path().join("v.nhdr"), dir.path().join("v.raw"));
        fs::write(&header, "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 2\nencoding: raw\ndata file: v.raw\n\n")
            .unwrap();
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
        let length = WHOLE + 5_012_345;
        let file = File::options().create_new(true).read(true).write(true).open(&path).unwrap();
        file.set_len(length).unwrap();
        let time = fs::metadata(&path).unwrap().modified().unwrap();
        let hash = |time| {
            file.set_modified(time).unwrap();
            digest(&path).unwrap()
        };
        let before = hash(time);
        for at in [0, length - 1] {
            file.write_all_at(&[8], at).unwrap();
            assert_ne!(hash(time), before, "byte {at}");
            file.write_all_at(&[0], at).unwrap();
        }
        assert_eq!(hash(time), before);
        assert_ne!(hash(time + std::time::Duration::from_secs(1)), before, "its time");
    }

    #[test]
    fn what_has_no_effect_is_a_flag_of_some_command() {
        let command = Cli::command();
        let is_flag =
            |id: &str| command.get_subcommands().any(|one| one.get_arguments().any(|flag| flag.get_id() == id));
        for id in WITHOUT_EFFECT {
            assert!(is_flag(id), "{id}");
        }
    }
}
