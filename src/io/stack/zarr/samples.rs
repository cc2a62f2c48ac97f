//! How decoded chunks become a part of a dense `[z][y][x]` box.

use crate::io::stack::number::{ByteOrder, Copying, Number};
use crate::store::SamplesMut;

/// A box of values among those of a chunk: where it begins, and how far apart its neighbours along x, y, z are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) first: usize,
    pub(crate) strides: [usize; 3],
}

/// Values of a chunk, in the machine's byte order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Values<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) number: Number,
    pub(crate) place: Place,
}

/// Values of a chunk, and the box of the output that they fill.
#[derive(Clone, Copy, Debug)]
struct Filling<'a> {
    bytes: &'a [u8],
    from: Place,
    to: Place,
    shape: [usize; 3],
}

impl Values<'_> {
    /// Copies a box of `shape` values to `to` in `out`, whose type is that of [`Number::element`].
    pub(crate) fn copy_to(self, out: &mut SamplesMut<'_>, to: Place, shape: [usize; 3]) {
        let filling = Filling { bytes: self.bytes, from: self.place, to, shape };
        self.number.copy(filling, ByteOrder::NATIVE, out, 0);
    }
}

impl Copying for Filling<'_> {
    fn copy<const N: usize, T>(self, out: &mut [T], convert: impl Fn([u8; N]) -> T) {
        let words = self.bytes.as_chunks::<N>().0;
        let [width, height, depth] = self.shape;
        for (y, z) in (0..depth).flat_map(|z| (0..height).map(move |y| (y, z))) {
            let row = |place: Place| place.first + y * place.strides[1] + z * place.strides[2];
            let out = &mut out[row(self.to)..][..width];
            let words = &words[row(self.from)..];
            match self.from.strides[0] {
                0 => out.iter_mut().for_each(|o| *o = convert(words[0])),
                step => out.iter_mut().zip(words.iter().step_by(step)).for_each(|(o, word)| *o = convert(*word)),
            }
        }
    }
}
