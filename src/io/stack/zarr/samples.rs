//! The types of stored values, and how decoded chunks become a part of a dense `[z][y][x]` box.

use half::f16;

use crate::store::{ElementType, SamplesMut};

/// The type of a stored value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Bool,
    U8,
    U16,
    U32,
    U64,
    I8,
    I16,
    I32,
    I64,
    F16,
    F32,
    F64,
}

impl Kind {
    const ALL: [(Self, &'static str); 12] = [
        (Self::Bool, "bool"),
        (Self::U8, "uint8"),
        (Self::U16, "uint16"),
        (Self::U32, "uint32"),
        (Self::U64, "uint64"),
        (Self::I8, "int8"),
        (Self::I16, "int16"),
        (Self::I32, "int32"),
        (Self::I64, "int64"),
        (Self::F16, "float16"),
        (Self::F32, "float32"),
        (Self::F64, "float64"),
    ];

    /// The type that Zarr calls so.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, known)| *known == name).map(|(kind, _)| *kind)
    }

    /// What Zarr calls it.
    pub(crate) fn name(self) -> &'static str {
        Self::ALL.iter().find(|(kind, _)| *kind == self).map_or("", |(_, name)| name)
    }

    /// Bytes of a value.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The smallest type handed out that holds every value exactly; of 64-bit integers those up to 2^53.
    pub(crate) fn element(self) -> ElementType {
        match self {
            Self::Bool | Self::U8 => ElementType::U8,
            Self::U16 => ElementType::U16,
            Self::U32 => ElementType::U32,
            Self::I8 | Self::I16 | Self::F16 | Self::F32 => ElementType::F32,
            Self::I32 | Self::U64 | Self::I64 | Self::F64 => ElementType::F64,
        }
    }
}

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
    pub(crate) kind: Kind,
    pub(crate) place: Place,
}

impl Values<'_> {
    /// Copies a box of `shape` values to `to` in `out`, whose type is that of [`Kind::element`].
    pub(crate) fn copy_to(self, out: &mut SamplesMut<'_>, to: Place, shape: [usize; 3]) {
        match (self.kind, out) {
            (Kind::Bool | Kind::U8, SamplesMut::U8(o)) => self.copy(o, to, shape, |[b]: [u8; 1]| b),
            (Kind::U16, SamplesMut::U16(o)) => self.copy(o, to, shape, u16::from_ne_bytes),
            (Kind::U32, SamplesMut::U32(o)) => self.copy(o, to, shape, u32::from_ne_bytes),
            (Kind::I8, SamplesMut::F32(o)) => self.copy(o, to, shape, |b| f32::from(i8::from_ne_bytes(b))),
            (Kind::I16, SamplesMut::F32(o)) => self.copy(o, to, shape, |b| f32::from(i16::from_ne_bytes(b))),
            (Kind::F16, SamplesMut::F32(o)) => self.copy(o, to, shape, |b| f32::from(f16::from_ne_bytes(b))),
            (Kind::F32, SamplesMut::F32(o)) => self.copy(o, to, shape, f32::from_ne_bytes),
            (Kind::I32, SamplesMut::F64(o)) => self.copy(o, to, shape, |b| f64::from(i32::from_ne_bytes(b))),
            (Kind::I64, SamplesMut::F64(o)) => self.copy(o, to, shape, |b| i64::from_ne_bytes(b) as f64),
            (Kind::U64, SamplesMut::F64(o)) => self.copy(o, to, shape, |b| u64::from_ne_bytes(b) as f64),
            (Kind::F64, SamplesMut::F64(o)) => self.copy(o, to, shape, f64::from_ne_bytes),
            (kind, out) => debug_assert!(false, "{kind:?} does not go into {out:?}: the caller checks the type"),
        }
    }

    fn copy<const N: usize, T>(self, out: &mut [T], to: Place, shape: [usize; 3], convert: impl Fn([u8; N]) -> T) {
        let words = self.bytes.as_chunks::<N>().0;
        let [width, height, depth] = shape;
        for (y, z) in (0..depth).flat_map(|z| (0..height).map(move |y| (y, z))) {
            let row = |place: Place| place.first + y * place.strides[1] + z * place.strides[2];
            let out = &mut out[row(to)..][..width];
            let words = &words[row(self.place)..];
            match self.place.strides[0] {
                0 => out.iter_mut().for_each(|o| *o = convert(words[0])),
                step => out.iter_mut().zip(words.iter().step_by(step)).for_each(|(o, word)| *o = convert(*word)),
            }
        }
    }
}
