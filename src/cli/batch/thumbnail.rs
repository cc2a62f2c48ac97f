//! A small picture of what an item found: the first one of its report's page, made smaller.

use std::fs;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use crate::io::png::{read_rgb, rgb_bytes};

/// Pixels along its longer side.
const SIDE: usize = 144;
/// How pictures begin in a page.
const PICTURE: &str = "data:image/png;base64,";

/// The bytes of a PNG; none where the store has no page or the page no picture.
pub(crate) fn of_store(store: &Path) -> Option<Vec<u8>> {
    let page = fs::read_to_string(store.join("report.html")).ok()?;
    let text = &page[page.find(PICTURE)? + PICTURE.len()..];
    let bytes = STANDARD.decode(&text[..text.find('"')?]).ok()?;
    let ([width, height], pixels) = read_rgb(&bytes)?;
    let (size, pixels) = smaller([width as usize, height as usize], &pixels);
    rgb_bytes(size.map(|n| n as u32), &pixels).ok()
}

/// A picture as an address within a page.
pub(crate) fn address(picture: &Path) -> Option<String> {
    Some(format!("{PICTURE}{}", STANDARD.encode(fs::read(picture).ok()?)))
}

/// Means over the pixels that fall into one.
fn smaller([width, height]: [usize; 2], pixels: &[u8]) -> ([usize; 2], Vec<u8>) {
    let longest = width.max(height);
    if longest <= SIDE {
        return ([width, height], pixels.to_vec());
    }
    let size = [width, height].map(|n| (n * SIDE / longest).max(1));
    let mut small = Vec::with_capacity(3 * size[0] * size[1]);
    for y in 0..size[1] {
        let rows = y * height / size[1]..((y + 1) * height / size[1]);
        for x in 0..size[0] {
            let columns = x * width / size[0]..((x + 1) * width / size[0]);
            let count = rows.len() * columns.len();
            for colour in 0..3 {
                let of_row = |row: usize| {
                    columns.clone().map(move |column| usize::from(pixels[3 * (row * width + column) + colour]))
                };
                small.push((rows.clone().flat_map(of_row).sum::<usize>() / count) as u8);
            }
        }
    }
    (size, small)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_shrink_to_their_means() {
        let (size, small) = smaller([288, 2], &[[10, 20, 30], [30, 40, 50]].concat().repeat(288));
        assert_eq!((size, small), ([144, 1], [20, 30, 40].repeat(144)));
        assert_eq!(smaller([2, 1], &[1, 2, 3, 4, 5, 6]), ([2, 1], vec![1, 2, 3, 4, 5, 6]));
    }
}
