//! Files against the list of their checksums: each that is listed is there with its bytes, and no other is.

use std::path::Path;

use super::found::{Check, Fault};
use crate::error::{Error, Result};
use crate::exec::{Engine, Workers};
use crate::io::ome_zarr::{CHECKSUMS, FileSum, listed_sums, store_files};

/// Compares all files with the list.
///
/// # Errors
/// When the store's folders cannot be read or the run is interrupted.
pub(super) fn check(engine: &Engine, store: &Path) -> Result<Check> {
    let mut found = Check::new("checksums");
    let files = store_files(store).map_err(|e| Error::from_io("the store cannot be read", &e).at(store))?;
    let listed = match listed_sums(store) {
        Ok(Some(listed)) => listed,
        Ok(None) => {
            let told = "there is no checksums.txt, as in stores of older versions and of runs that were ended: changed bytes show only where they cannot be decoded or where values do not agree";
            found.told = told.into();
            return Ok(found);
        }
        Err(error) => {
            found.wrong_in(CHECKSUMS, error.to_string());
            return Ok(found);
        }
    };
    let stage = engine.stage("checksums", files.len() as u64);
    let told = stage.run(&files, &Workers::none(), |(), file| {
        let Some(line) = listed.get(file) else {
            return Ok((0, Some("is not among the files that were written".to_owned())));
        };
        Ok(match FileSum::of(&store.join(file)) {
            Err(error) => (0, Some(format!("cannot be read: {error}"))),
            Ok(sum) => (sum.length, (sum.line(file) != *line).then(|| differs(sum, line))),
        })
    })?;
    stage.finish();
    let bytes: u64 = told.iter().map(|(length, _)| length).sum();
    for (file, text) in files.iter().zip(told) {
        text.1.into_iter().for_each(|text| found.wrong_in(file, text));
    }
    for file in listed.keys().filter(|file| files.binary_search(file).is_err()) {
        found.add(Fault { file: Some(file.clone()), voxel: None, text: "is missing".into() });
    }
    found.told = format!("{} files, {bytes} bytes", files.len());
    Ok(found)
}

fn differs(sum: FileSum, line: &str) -> String {
    let length = line.split(' ').nth(1).unwrap_or_default();
    if length == sum.length.to_string() {
        format!("its bytes have changed: the checksum is {:08x}", sum.crc)
    } else {
        format!("has {} bytes and was written with {length}", sum.length)
    }
}
