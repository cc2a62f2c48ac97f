//! An array on disk: its shape, its chunks, and one decoded chunk at a time.

use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::num::NonZeroU64;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::Value;
use zarrs::array::Array;
use zarrs::filesystem::FilesystemStore;
use zarrs::plugin::{ExtensionName, ZarrVersion};

use super::codecs::Shards;
use super::codecs::{Codecs, ValueType, bytes_of, guarded, one_line, slack};
use super::keys::Keys;
use super::shard_index::range_of;
use crate::error::{Error, Result};
use crate::io::stack::number::Number;

/// The most bytes of a decoded chunk; Blosc packs no more either.
const MAX_CHUNK: u64 = 1 << 31;
/// Entries along an axis, and in an array, that indices still count.
const MAX_EXTENT: u64 = 1 << 31;
const MAX_VALUES: u64 = 1 << 48;
/// Indices of shards that are kept.
const KEPT: usize = 16;

type Index = Arc<Vec<[u64; 2]>>;

/// An opened array.
#[derive(Debug)]
pub(crate) struct ChunkedArray {
    folder: PathBuf,
    array: Array<FilesystemStore>,
    codecs: Codecs,
    value: ValueType,
    /// What Zarr calls the type of its values.
    pub(crate) type_name: String,
    pub(crate) number: Number,
    pub(crate) shape: Vec<u64>,
    /// The shape of what is stored in one file.
    outer: Vec<NonZeroU64>,
    /// The shape of what is decoded at once: the chunks, those in shards where there are some.
    pub(crate) chunk: Vec<NonZeroU64>,
    pub(crate) keys: Keys,
    indices: Mutex<Vec<(Vec<u64>, Index)>>,
}

impl ChunkedArray {
    /// Opens the array in a folder, whose document was read.
    pub(crate) fn open(folder: &Path, document: &Value) -> Result<Self> {
        let refuse = |reason: String| Error::input(reason).at(folder);
        check_shape(document).map_err(refuse)?;
        let unreadable = |error: &dyn std::fmt::Display| {
            let error = one_line(error);
            let about_codecs = ["codec", "configuration"].iter().any(|word| error.to_lowercase().contains(word));
            let save = if about_codecs { "; save it with gzip, zstd or blosc" } else { "" };
            refuse(format!("is no array that can be read: {error}{save}"))
        };
        let array = guarded(|| {
            let store = FilesystemStore::new(folder).map_err(|error| one_line(&error))?;
            Array::open(Arc::new(store), "/").map_err(|error| one_line(&error))
        });
        let array = array.map_err(|reason| unreadable(&reason))?;
        let shape = array.shape().to_vec();
        let type_name = array.data_type().name(ZarrVersion::V3).unwrap_or_default().into_owned();
        // A bool is stored as a byte.
        let number = Number::named(if type_name == "bool" { "uint8" } else { &type_name }).ok_or_else(|| {
            refuse(format!("holds values of type {type_name}; integers, bool and float of up to 64 bits are read"))
        })?;
        let (data_type, fill) = (array.data_type().clone(), array.fill_value().clone());
        let value = ValueType { data_type, fill, size: usize::from(number.bits() / 8) };
        if value.fill.as_ne_bytes().len() != value.size {
            return Err(refuse("has a fill value that is none of its type".into()));
        }
        let outer = array.chunk_shape(&vec![0; shape.len()]).map_err(|error| unreadable(&error))?;
        let codecs = Codecs::new(&array.codecs()).map_err(|reason| unreadable(&reason))?;
        let chunk = match codecs.plain_shards() {
            Some(shards) => {
                shards.index_place(&outer).map_err(|reason| unreadable(&reason))?;
                shards.chunk.clone()
            }
            None => outer.clone(),
        };
        match bytes_of(&chunk, value.size) {
            Some(bytes) if bytes <= MAX_CHUNK => {}
            _ => return Err(refuse("has chunks of more than 2 GiB; save it with smaller ones".into())),
        }
        let keys = Keys::of(folder, shape.len(), |at| array.chunk_key(at).as_str().to_owned());
        if let Keys::Foreign(name) = &keys {
            let due = array.chunk_key(&vec![0; shape.len()]).as_str().to_owned();
            return Err(refuse(format!("has chunks named like {name}, where its metadata name them like {due}")));
        }
        let (folder, indices) = (folder.to_path_buf(), Mutex::default());
        Ok(Self { folder, array, codecs, value, type_name, number, shape, outer, chunk, keys, indices })
    }

    /// The shape of the shards, where there are some.
    pub(crate) fn shards(&self) -> Option<&[NonZeroU64]> {
        self.codecs.shards.is_some().then_some(&self.outer[..])
    }

    /// What is odd about where its chunks are.
    pub(crate) fn note(&self) -> Option<String> {
        match &self.keys {
            Keys::Separated(separator) => Some(format!(
                "its chunks are named with '{separator}' between their numbers, which its metadata do not say; they are \
                 read so"
            )),
            Keys::Nothing => Some("none of its chunks is there: all of its voxels hold the fill value".into()),
            Keys::AsTold | Keys::Foreign(_) => None,
        }
    }

    /// Bytes of a decoded chunk.
    pub(crate) fn chunk_bytes(&self) -> u64 {
        bytes_of(&self.chunk, self.value.size).unwrap_or(MAX_CHUNK)
    }

    /// The value of what is not stored, in the machine's byte order.
    pub(crate) fn fill(&self) -> &[u8] {
        self.value.fill.as_ne_bytes()
    }

    /// The values of the chunk at a place of the grid of chunks, dense; none where it is not stored.
    pub(crate) fn read(&self, at: &[u64]) -> Result<Option<Vec<u8>>> {
        let Some(shards) = self.codecs.plain_shards() else {
            let path = self.path(at);
            let Some(stored) = self.whole_file(&path)? else { return Ok(None) };
            return self
                .codecs
                .decode(stored, &self.chunk, &self.value)
                .map(Some)
                .map_err(|reason| damaged(&path, &reason));
        };
        let per_shard: Vec<u64> = self.outer.iter().zip(&shards.chunk).map(|(o, c)| o.get() / c.get()).collect();
        let shard: Vec<u64> = at.iter().zip(&per_shard).map(|(at, n)| at / n).collect();
        let path = self.path(&shard);
        let Some(mut file) = open(&path)? else { return Ok(None) };
        let fault = |reason: String| damaged(&path, &reason);
        let length = file.metadata().map_err(|e| unreadable(&path, &e))?.len();
        let index = self.index(shards, &shard, &path, &mut file, length)?;
        let number = at.iter().zip(&per_shard).fold(0, |number, (at, n)| number * n + at % n);
        let entry = index.get(number as usize).copied().unwrap_or([u64::MAX; 2]);
        let Some(range) = range_of(entry, length).map_err(fault)? else { return Ok(None) };
        if range.end - range.start > slack(2 * self.chunk_bytes()) {
            return Err(fault("a chunk in it takes more bytes than it could".into()));
        }
        let stored = read_range(&mut file, range.start, range.end - range.start).map_err(|e| unreadable(&path, &e))?;
        shards.codecs.decode(stored, &self.chunk, &self.value).map(Some).map_err(fault)
    }

    fn path(&self, at: &[u64]) -> PathBuf {
        match self.keys.name(at) {
            Some(name) => self.folder.join(name),
            None => self.folder.join(self.array.chunk_key(at).as_str()),
        }
    }

    fn whole_file(&self, path: &Path) -> Result<Option<Vec<u8>>> {
        let Some(mut file) = open(path)? else { return Ok(None) };
        let length = file.metadata().map_err(|e| unreadable(path, &e))?.len();
        if length > slack(2 * self.chunk_bytes()) {
            return Err(damaged(path, "it is longer than a chunk could be"));
        }
        read_range(&mut file, 0, length).map(Some).map_err(|e| unreadable(path, &e))
    }

    /// The index of a shard, which is read once for chunks that are asked for one after the other.
    fn index(&self, shards: &Shards, shard: &[u64], path: &Path, file: &mut File, length: u64) -> Result<Index> {
        let known =
            |kept: &[(Vec<u64>, Index)]| kept.iter().find(|(at, _)| at == shard).map(|(_, index)| index.clone());
        if let Some(index) = known(&self.indices.lock().unwrap_or_else(PoisonError::into_inner)) {
            return Ok(index);
        }
        let fault = |reason: String| damaged(path, &reason);
        let place = shards.index_place(&self.outer).map_err(fault)?;
        let Some(last) = length.checked_sub(place.bytes) else {
            return Err(fault("it is shorter than the index of its chunks: it is truncated".into()));
        };
        let start = if place.first { 0 } else { last };
        let bytes = read_range(file, start, place.bytes).map_err(|e| unreadable(path, &e))?;
        let index = Arc::new(shards.read_index(&place, &bytes).map_err(fault)?);
        let mut kept = self.indices.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() == KEPT {
            kept.remove(0);
        }
        kept.push((shard.to_vec(), index.clone()));
        Ok(index)
    }
}

/// Refuses what no index could count, before anything is made of it.
fn check_shape(document: &Value) -> std::result::Result<(), String> {
    let shape: Option<Vec<u64>> =
        document["shape"].as_array().and_then(|list| list.iter().map(Value::as_u64).collect());
    let shape = shape.ok_or("has a shape that is no list of whole numbers")?;
    let told = shape.iter().map(u64::to_string).collect::<Vec<_>>().join(" x ");
    if shape.contains(&0) {
        return Err(format!("is an array of {told} values, which is empty"));
    }
    let all = shape.iter().try_fold(1_u64, |product, n| product.checked_mul(*n));
    if shape.iter().any(|&n| n >= MAX_EXTENT) || all.is_none_or(|all| all > MAX_VALUES) {
        return Err(format!(
            "is an array of {told} values, more than can be worked on; choose a coarser one with --level"
        ));
    }
    let regular = document["chunk_grid"]["name"].as_str().is_none_or(|name| name == "regular");
    if regular {
        Ok(())
    } else {
        Err("has chunks of different shapes, which are not read; save it with equal ones".into())
    }
}

fn open(path: &Path) -> Result<Option<File>> {
    match File::open(path) {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(unreadable(path, &error)),
    }
}

fn read_range(file: &mut File, start: u64, bytes: u64) -> std::io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(start))?;
    let mut stored = Vec::with_capacity(bytes as usize);
    file.take(bytes).read_to_end(&mut stored)?;
    Ok(stored)
}

fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    Error::input(format!("cannot be read: {error}")).caused_by_io(error).at(path)
}

fn damaged(path: &Path, reason: &str) -> Error {
    Error::input(format!("this chunk cannot be decoded: {reason}")).at(path)
}
