//! Stacks and other 3-D images from files and folders, told apart by content. [`FORMATS`] is the one table of what is read.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::raw::{nrrd, vti};
use super::tiff;
use super::tiff::TiffStack;
use super::volume::{Select, Stack};
use super::zarr::ZarrImage;
use crate::error::{Error, Result};
use crate::io::geometry::read::foreign;
use crate::io::ome_zarr::is_store;

/// A format of stacks.
#[derive(Debug)]
pub struct Format {
    /// What a stack of this format is called.
    pub name: &'static str,
    /// How names of such files usually end, without the dot. What is of no format by its content, but ends so, is
    /// opened as one: its reader says best what is wrong with it.
    pub extensions: &'static [&'static str],
    /// Whether what lies at a path, which exists, is of this format by its content.
    pub sniff: fn(&Path) -> bool,
    /// Opens one channel and time and reads what the file says of itself; no plane is decoded. Fails with an input
    /// error that names the file and says what is wrong.
    pub open: fn(&Path, Select) -> Result<Box<dyn Stack>>,
}

/// The formats, in the order in which they are tried.
pub const FORMATS: &[Format] = &[
    Format {
        name: "TIFF stack",
        extensions: &["tif", "tiff"],
        sniff: |path| head(path).is_some_and(tiff::is_tiff),
        open: open_tiff,
    },
    Format {
        name: "folder of TIFF slices",
        extensions: &[],
        sniff: |path| path.is_dir() && !is_store(path),
        open: open_tiff,
    },
    Format { name: "Zarr image", extensions: &[], sniff: is_store, open: open_zarr },
    Format {
        name: "NRRD volume",
        extensions: &["nrrd", "nhdr"],
        sniff: |path| head(path).is_some_and(|head| head == *b"NRRD"),
        open: |path, select| nrrd::open(path, without_axes(path, select)?),
    },
    Format {
        name: "VTI volume",
        extensions: &["vti"],
        sniff: |path| first_bytes(path).is_some_and(|head| vti::is_vti(&head)),
        open: |path, select| vti::open(path, without_axes(path, select)?),
    },
];

/// The format of what lies at a path; none when it is no stack, or nothing lies there.
#[must_use]
pub fn format_of(path: &Path) -> Option<&'static Format> {
    // What is read from a pipe to tell what it holds is gone for who reads it then; a volume is read in no order either.
    if !(path.is_file() || path.is_dir()) {
        return None;
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let by_content = FORMATS.iter().find(|format| (format.sniff)(path));
    by_content.or_else(|| FORMATS.iter().find(|format| format.extensions.contains(&extension.as_str())))
}

/// Opens one channel and time of a stack.
///
/// # Errors
/// When there is nothing at the path, it is of no format in [`FORMATS`], unreadable, damaged, of a kind that is not
/// supported, or has no such channel or time.
pub fn open_stack(path: &Path, select: Select) -> Result<Box<dyn Stack>> {
    if !path.exists() {
        let is_address = path.to_string_lossy().contains("://");
        let what =
            if is_address { "is an address; copy what is there to a disk" } else { "there is no such file or folder" };
        return Err(Error::input(what).at(path));
    }
    if !(path.is_file() || path.is_dir()) {
        let what = "is a pipe or a device, where an image has to be a file or a folder; write it to a file first";
        return Err(Error::input(what).at(path));
    }
    let Some(format) = format_of(path) else {
        if let Some(error) = first_bytes(path).as_deref().and_then(foreign::no_stack) {
            return Err(error.at(path));
        }
        if let Some(reason) = near_miss(path) {
            return Err(Error::input(reason).at(path));
        }
        let names: Vec<&str> = FORMATS.iter().map(|format| format.name).collect();
        return Err(Error::input(format!("is no stack of images that can be read ({})", names.join(", "))).at(path));
    };
    (format.open)(path, select)
}

/// What is nearly an image: a file inside of a store, or a store that is packed.
fn near_miss(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| is_store(folder));
    if let (Some(folder), true) = (folder, path.is_file()) {
        return Some(format!("is a file of a Zarr store; name its folder, {}", folder.display()));
    }
    (head(path)? == *b"PK\x03\x04").then(|| "is a ZIP archive; unpack it first".to_owned())
}

fn open_zarr(path: &Path, select: Select) -> Result<Box<dyn Stack>> {
    Ok(Box::new(ZarrImage::open(path, without_axes(path, select)?)?))
}

/// Refuses to hear of axes from somebody else.
fn without_axes(path: &Path, select: Select) -> Result<Select> {
    match select.axes {
        Some(axes) => Err(Error::usage(format!("names its axes itself; --axes {axes} is for TIFF files")).at(path)),
        None => Ok(select),
    }
}

fn open_tiff(path: &Path, select: Select) -> Result<Box<dyn Stack>> {
    Ok(Box::new(TiffStack::open(path, select)?))
}

/// The first bytes of a file, enough to tell formats that are not read.
fn first_bytes(path: &Path) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path).and_then(|file| file.take(512).read_to_end(&mut bytes)).ok().map(|_| bytes)
}

/// The first bytes of a file, where there are so many.
fn head(path: &Path) -> Option<[u8; 4]> {
    let mut head = [0; 4];
    File::open(path).and_then(|mut file| file.read_exact(&mut head)).ok().map(|()| head)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides_and_the_name_only_where_nothing_else_does() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, bytes).unwrap();
            path
        };
        let (slice, node) = (write("slices/s1.tif", b"II*\0"), write("a.zarr/zarr.json", b"{}"));
        let (slices, store) = (slice.parent().unwrap(), node.parent().unwrap());
        let name = |path: &Path| format_of(path).map(|format| format.name);
        for bytes in [b"II*\0----", b"MM\0*----", b"II+\0----", b"MM\0+----"] {
            assert_eq!(name(&write("data.bin", bytes)), Some("TIFF stack"), "{bytes:?}");
        }
        assert_eq!(name(slices), Some("folder of TIFF slices"));
        assert_eq!(name(store), Some("Zarr image"));
        assert_eq!(name(&write("text.TIF", b"no image")), Some("TIFF stack"));
        for other in [&write("marks.csv", b"x,y,z\n"), &write("empty", b""), &folder.path().join("missing")] {
            assert_eq!(name(other), None, "{}", other.display());
            let error = open_stack(other, Select::default()).err().unwrap();
            assert_eq!((error.exit_code(), error.path()), (2, Some(&**other)));
        }
    }
}
