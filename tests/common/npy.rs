//! A reader for small `.npy` files of 16-bit unsigned numbers in C order (NumPy format 1.0).
#![allow(clippy::unwrap_used)]

use std::path::Path;

/// The shape, slowest axis first, and the values.
pub(crate) fn read_u16(path: &Path) -> (Vec<usize>, Vec<u16>) {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let head = std::str::from_utf8(&bytes[10..end]).unwrap();
    assert!(head.contains("'<u2'") && head.contains("'fortran_order': False"), "{head}");
    let shape = head.split_once('(').unwrap().1.split_once(')').unwrap().0;
    let shape: Vec<usize> = shape.split(',').filter_map(|n| n.trim().parse().ok()).collect();
    let values: Vec<u16> = bytes[end..].chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    assert_eq!(values.len(), shape.iter().product::<usize>());
    (shape, values)
}
