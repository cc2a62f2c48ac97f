//! Pictures as PNG: 8 bits of red, green and blue.

use std::io::{BufWriter, Write};
use std::path::Path;

use crate::error::{Error, Result};
use crate::store::HiddenFile;

/// Writes a picture of `width` by `height` pixels; `pixels` are rows from the top, red, green and blue of each pixel. Nothing
/// stands under the name before it is whole; what did is replaced if that may be.
///
/// # Errors
/// When the file cannot be written, or something is there that it may not replace.
///
/// # Panics
/// When `pixels` does not fit the size.
pub fn write_rgb(path: &Path, [width, height]: [u32; 2], pixels: &[u8], replace: bool) -> Result<()> {
    assert_eq!(pixels.len() as u64, 3 * u64::from(width) * u64::from(height), "the pixels do not fit the size");
    let fault = |error: png::EncodingError| {
        Error::failed(format!("the picture cannot be written: {error}")).caused_by(error).at(path)
    };
    let (hidden, file) = HiddenFile::create(path, ".png").map_err(|error| fault(error.into()))?;
    encode(BufWriter::new(file), [width, height], pixels, png::Compression::High).map_err(fault)?;
    hidden.place(replace).map_err(|error| fault(error.into()))
}

/// The bytes of such a picture as a file, packed for speed more than for size.
///
/// # Errors
/// When it cannot be encoded.
///
/// # Panics
/// When `pixels` does not fit the size.
pub fn rgb_bytes([width, height]: [u32; 2], pixels: &[u8]) -> Result<Vec<u8>> {
    assert_eq!(pixels.len() as u64, 3 * u64::from(width) * u64::from(height), "the pixels do not fit the size");
    let mut bytes = Vec::new();
    encode(&mut bytes, [width, height], pixels, png::Compression::Fast)
        .map_err(|error| Error::failed(format!("a picture cannot be made: {error}")).caused_by(error))?;
    Ok(bytes)
}

/// The size and the pixels of such a picture; none of bytes that are no PNG, or one of another kind.
#[must_use]
pub fn read_rgb(bytes: &[u8]) -> Option<([u32; 2], Vec<u8>)> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
    let mut pixels = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut pixels).ok()?;
    let is_rgb = (info.color_type, info.bit_depth) == (png::ColorType::Rgb, png::BitDepth::Eight);
    is_rgb.then_some(([info.width, info.height], pixels))
}

fn encode(
    to: impl Write,
    [width, height]: [u32; 2],
    pixels: &[u8],
    compression: png::Compression,
) -> std::result::Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(to, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(compression);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;

    #[test]
    fn pixels_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let pixels: Vec<u8> = (0..5 * 3 * 3).map(|v| (v * 37 % 251) as u8).collect();
        write_rgb(&path, [5, 3], &pixels, false).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(File::open(&path).unwrap())).read_info().unwrap();
        let mut read = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut read).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (5, 3, png::ColorType::Rgb));
        assert_eq!(read, pixels);
        std::fs::write(&path, rgb_bytes([5, 3], &pixels).unwrap()).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(File::open(&path).unwrap())).read_info().unwrap();
        reader.next_frame(&mut read).unwrap();
        assert_eq!(read, pixels);
        assert_eq!(read_rgb(&rgb_bytes([5, 3], &pixels).unwrap()), Some(([5, 3], pixels)));
        assert_eq!(read_rgb(b"no picture"), None);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = write_rgb(Path::new("/nowhere/at/all.png"), [1; 2], &[0; 3], false).unwrap_err();
        assert_eq!(error.exit_code(), 1);
        assert!(error.to_string().starts_with("/nowhere/at/all.png: "), "{error}");
    }
}
