//! Records of checkpoints as bytes, and the files of their manifests: the one place where `bincode` is used.
//!
//! A manifest is a magic, the version of this form, the length and the CRC-32C of what follows, each little-endian, and the packed
//! record.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// What manifests begin with.
const MAGIC: [u8; 8] = *b"slchkpt\n";
/// The version of their form.
const VERSION: u32 = 3;
/// Magic, version, length, checksum.
const HEAD: usize = 8 + 4 + 8 + 4;
/// No record is larger: what claims to be is damaged.
const MOST: usize = 1 << 32;

type Config = Configuration<LittleEndian, Fixint, Limit<MOST>>;

fn config() -> Config {
    bincode::config::standard().with_fixed_int_encoding().with_limit::<MOST>()
}

/// A record as bytes.
///
/// # Errors
/// When it has no such form.
pub fn pack<R: Serialize>(record: &R) -> io::Result<Vec<u8>> {
    bincode::serde::encode_to_vec(record, config()).map_err(io::Error::other)
}

/// A record out of its bytes, all of them.
///
/// # Errors
/// When they are no such record.
pub fn unpack<R: DeserializeOwned>(bytes: &[u8]) -> io::Result<R> {
    let (record, used) = bincode::serde::decode_from_slice(bytes, config()).map_err(io::Error::other)?;
    if used == bytes.len() { Ok(record) } else { Err(io::Error::other("more bytes than a record has")) }
}

/// Writes a manifest's file.
pub(super) fn write<R: Serialize>(out: &mut impl Write, record: &R) -> io::Result<()> {
    let body = pack(record)?;
    out.write_all(&MAGIC)?;
    out.write_all(&VERSION.to_le_bytes())?;
    out.write_all(&(body.len() as u64).to_le_bytes())?;
    out.write_all(&crc32c::crc32c(&body).to_le_bytes())?;
    out.write_all(&body)
}

/// Reads a manifest's file.
pub(super) fn read<R: DeserializeOwned>(path: &Path) -> io::Result<R> {
    let bytes = fs::read(path)?;
    let damaged = |what: &str| io::Error::new(io::ErrorKind::InvalidData, what.to_owned());
    let Some((head, body)) = bytes.split_at_checked(HEAD) else { return Err(damaged("is cut short")) };
    if head[..8] != MAGIC {
        return Err(damaged("is no checkpoint"));
    }
    if head[8..12] != VERSION.to_le_bytes() {
        return Err(damaged("has the form of another version"));
    }
    if head[12..20] != (body.len() as u64).to_le_bytes() {
        return Err(damaged("is cut short"));
    }
    if head[20..24] != crc32c::crc32c(body).to_le_bytes() {
        return Err(damaged("is damaged: its checksum does not fit"));
    }
    unpack(body)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_damage_to_a_manifest_is_seen() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m");
        let record = ("name".to_string(), vec![1.5_f64, f64::INFINITY], 7_u64);
        let mut whole = Vec::new();
        write(&mut whole, &record).unwrap();
        fs::write(&path, &whole).unwrap();
        assert_eq!(read::<(String, Vec<f64>, u64)>(&path).unwrap(), record);
        for at in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 1 << (at % 8);
            fs::write(&path, &damaged).unwrap();
            assert!(read::<(String, Vec<f64>, u64)>(&path).is_err(), "a bit of byte {at}");
            fs::write(&path, &whole[..at]).unwrap();
            assert!(read::<(String, Vec<f64>, u64)>(&path).is_err(), "cut at {at}");
        }
    }
}
