//! NRRD volumes: raw or gzip, of either byte order, with their voxels in the same file or in one beside it.

use std::fs::File;
use std::io::{BufRead, BufReader, Seek, SeekFrom};
use std::path::{Component, Path, PathBuf};

use super::nrrd_fields::{self, Fields};
use super::planes::{RawVolume, Stored};
use crate::error::{Error, Result};
use crate::io::stack::volume::{Select, Stack, StackInfo};

/// Opens a volume; of several, one after the other as a fourth axis has them, that of a channel.
pub(crate) fn open(path: &Path, select: Select) -> Result<Box<dyn Stack>> {
    let refuse = |reason: String| Error::input(reason).at(path);
    let unreadable = |error: std::io::Error| Error::input(format!("cannot be read: {error}")).caused_by(error).at(path);
    let mut file = BufReader::new(File::open(path).map_err(unreadable)?);
    let fields = nrrd_fields::parse(&mut file).map_err(refuse)?;
    let volumes = fields.sizes.get(3).copied().unwrap_or(1);
    if u64::from(select.channel) >= volumes || select.time > 0 || select.level > 0 {
        let what = format!("holds {volumes} channels of one time and one level, counted from 0");
        return Err(Error::usage(what).at(path));
    }
    let (data, start) = voxels(path, &fields).map_err(refuse)?;
    let data = data.as_deref().unwrap_or(path);
    if !data.is_file() {
        return Err(Error::input("is no file with voxels, as its header has it").at(data));
    }
    let unreadable = |error: std::io::Error| Error::input(format!("cannot be read: {error}")).caused_by(error).at(data);
    let start = start.map(|start| behind_lines(data, start, fields.skip[1])).transpose().map_err(unreadable)?;
    let bytes = fields.skip[0].max(0).unsigned_abs();
    let volume = fields.sizes[..3].iter().product::<u64>() * u64::from(fields.number.bits() / 8);
    let stored = Stored {
        file: data.to_path_buf(),
        start,
        is_gzip: fields.is_gzip,
        number: fields.number,
        order: fields.order,
        // Of a packed stream bytes are skipped when it is unpacked.
        before: (volume * u64::from(select.channel)).saturating_add(bytes),
    };
    Ok(Box::new(RawVolume::new(path, info(&fields, volumes), stored)?))
}

/// The file in which a header says that its voxels lie, where that is another one; none where the file is no such header.
pub(crate) fn file_of_voxels(path: &Path) -> Option<PathBuf> {
    let fields = nrrd_fields::parse(BufReader::new(File::open(path).ok()?)).ok()?;
    voxels(path, &fields).ok()?.0
}

fn info(fields: &Fields, volumes: u64) -> StackInfo {
    StackInfo {
        shape: [0, 1, 2].map(|axis| fields.sizes[axis] as i64),
        channels: u32::try_from(volumes).unwrap_or(u32::MAX),
        times: 1,
        file_type: fields.number.name().to_owned(),
        element: fields.number.element(),
        spacing: fields.spacing,
        origin: fields.origin,
        unit: fields.unit.clone(),
        interval: None,
        axes: if fields.sizes.len() > 3 { "CZYX" } else { "ZYX" }.to_owned(),
        compression: if fields.is_gzip { "gzip" } else { "none" }.to_owned(),
        notes: fields.notes.clone(),
    }
}

/// The file with the voxels, where it is another one, and the byte at which they begin; none where the file ends with them.
fn voxels(path: &Path, fields: &Fields) -> std::result::Result<(Option<PathBuf>, Option<u64>), String> {
    let start = |first: u64| (fields.skip[0] >= 0).then_some(first);
    let Some(name) = &fields.data_file else { return Ok((None, start(fields.length))) };
    let is_list = name.starts_with("LIST") || name.contains('%') || name.split_whitespace().count() > 1;
    let is_beside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if is_list || !is_beside {
        return Err(format!("has its voxels in '{name}'; one file in its own folder is read"));
    }
    Ok((Some(path.with_file_name(name)), start(0)))
}

/// The place behind so many lines.
fn behind_lines(path: &Path, start: u64, lines: i64) -> std::io::Result<u64> {
    let mut file = BufReader::new(File::open(path)?);
    file.seek(SeekFrom::Start(start))?;
    for _ in 0..lines {
        if file.skip_until(b'\n')? == 0 {
            break;
        }
    }
    file.stream_position()
}
