//! Sample types of TIFF files, and the conversion of stored rows to the types that are handed out.

use half::f16;

use super::ifd::ByteOrder;
use crate::store::{ElementType, SamplesMut};

/// The type of a stored sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampleKind {
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
    /// Unsigned with this many bits, packed from the highest bit of a byte on in either byte order, rows padded to
    /// whole bytes.
    Packed(u8),
}

impl SampleKind {
    /// The kind for the values of `SampleFormat` and `BitsPerSample`, or why there is none.
    pub(crate) fn new(format: u64, bits: u64) -> Result<Self, String> {
        match (format, bits) {
            // Format 4 is "undefined", which readers take for unsigned.
            (1 | 4, 8) => Ok(Self::U8),
            (1 | 4, 16) => Ok(Self::U16),
            (1 | 4, 32) => Ok(Self::U32),
            (1 | 4, 64) => Ok(Self::U64),
            (1 | 4, 1..=31) => Ok(Self::Packed(bits as u8)),
            (2, 8) => Ok(Self::I8),
            (2, 16) => Ok(Self::I16),
            (2, 32) => Ok(Self::I32),
            (2, 64) => Ok(Self::I64),
            (3, 16) => Ok(Self::F16),
            (3, 32) => Ok(Self::F32),
            (3, 64) => Ok(Self::F64),
            (5 | 6, _) => Err("complex numbers are not supported; save the real part or the magnitude".to_string()),
            _ => {
                let name = match format {
                    1 | 4 => "unsigned",
                    2 => "signed",
                    3 => "floating point",
                    _ => "unknown",
                };
                Err(format!("{name} samples of {bits} bits are not supported; save it as 8, 16 or 32 bit"))
            }
        }
    }

    /// Bits of one sample.
    pub(crate) fn bits(self) -> u16 {
        match self {
            Self::U8 | Self::I8 => 8,
            Self::U16 | Self::I16 | Self::F16 => 16,
            Self::U32 | Self::I32 | Self::F32 => 32,
            Self::U64 | Self::I64 | Self::F64 => 64,
            Self::Packed(bits) => u16::from(bits),
        }
    }

    /// True for floating-point samples.
    pub(crate) fn is_float(self) -> bool {
        matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    /// The value of the `SampleFormat` tag.
    pub(crate) fn format(self) -> u16 {
        match self {
            Self::U8 | Self::U16 | Self::U32 | Self::U64 | Self::Packed(_) => 1,
            Self::I8 | Self::I16 | Self::I32 | Self::I64 => 2,
            Self::F16 | Self::F32 | Self::F64 => 3,
        }
    }

    /// The type's name as in the file, like `uint16`.
    pub(crate) fn name(self) -> String {
        let family = ["uint", "int", "float"][usize::from(self.format()) - 1];
        format!("{family}{}", self.bits())
    }

    /// The smallest type handed out that holds every value exactly; of 64-bit integers those up to 2^53.
    pub(crate) fn element(self) -> ElementType {
        match self {
            Self::U8 | Self::Packed(..=8) => ElementType::U8,
            Self::U16 | Self::Packed(..=16) => ElementType::U16,
            Self::U32 | Self::Packed(_) => ElementType::U32,
            Self::I8 | Self::I16 | Self::F16 | Self::F32 => ElementType::F32,
            Self::I32 | Self::U64 | Self::I64 | Self::F64 => ElementType::F64,
        }
    }
}

/// Stored samples of one row: those of one pixel next to each other.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) kind: SampleKind,
    pub(crate) order: ByteOrder,
    /// Samples per pixel in `bytes`, and which one is wanted.
    pub(crate) step: usize,
    pub(crate) sample: usize,
}

/// The wanted samples of `N` bytes each, converted.
fn fill<const N: usize, T>(row: Row<'_>, out: &mut [T], convert: impl Fn([u8; N]) -> T) {
    let (values, _) = row.bytes.as_chunks::<N>();
    if row.step == 1 {
        for (place, &value) in out.iter_mut().zip(values) {
            *place = convert(value);
        }
    } else {
        for (place, &value) in out.iter_mut().zip(values.iter().skip(row.sample).step_by(row.step)) {
            *place = convert(value);
        }
    }
}

/// The wanted samples of a row of packed bits.
fn unpack<T>(row: Row<'_>, bits: usize, out: &mut [T], convert: impl Fn(u32) -> T) {
    for (x, place) in out.iter_mut().enumerate() {
        let start = (x * row.step + row.sample) * bits;
        let value = (start..start + bits).fold(0, |n, bit| {
            let byte = row.bytes.get(bit / 8).copied().unwrap_or(0);
            (n << 1) | u32::from(byte >> (7 - bit % 8) & 1)
        });
        *place = convert(value);
    }
}

macro_rules! numbers {
    ($row:expr, $out:expr, $t:ty, $convert:expr) => {
        match $row.order {
            ByteOrder::Little => fill($row, $out, |b| ($convert)(<$t>::from_le_bytes(b))),
            ByteOrder::Big => fill($row, $out, |b| ($convert)(<$t>::from_be_bytes(b))),
        }
    };
}

impl Row<'_> {
    /// Converts the wanted samples into `out[at..at + count]`, whose type is that of [`SampleKind::element`].
    pub(crate) fn copy_to(self, out: &mut SamplesMut<'_>, at: usize, count: usize) {
        let part = at..at + count;
        match (self.kind, out) {
            (SampleKind::U8, SamplesMut::U8(o)) => fill(self, &mut o[part], |[b]| b),
            (SampleKind::U16, SamplesMut::U16(o)) => numbers!(self, &mut o[part], u16, |v| v),
            (SampleKind::U32, SamplesMut::U32(o)) => numbers!(self, &mut o[part], u32, |v| v),
            (SampleKind::F32, SamplesMut::F32(o)) => numbers!(self, &mut o[part], f32, |v| v),
            (SampleKind::F64, SamplesMut::F64(o)) => numbers!(self, &mut o[part], f64, |v| v),
            (SampleKind::F16, SamplesMut::F32(o)) => numbers!(self, &mut o[part], f16, f32::from),
            (SampleKind::I8, SamplesMut::F32(o)) => numbers!(self, &mut o[part], i8, f32::from),
            (SampleKind::I16, SamplesMut::F32(o)) => numbers!(self, &mut o[part], i16, f32::from),
            (SampleKind::I32, SamplesMut::F64(o)) => numbers!(self, &mut o[part], i32, f64::from),
            (SampleKind::U64, SamplesMut::F64(o)) => numbers!(self, &mut o[part], u64, |v| v as f64),
            (SampleKind::I64, SamplesMut::F64(o)) => numbers!(self, &mut o[part], i64, |v| v as f64),
            (SampleKind::Packed(b), SamplesMut::U8(o)) => unpack(self, b.into(), &mut o[part], |v| v as u8),
            (SampleKind::Packed(b), SamplesMut::U16(o)) => unpack(self, b.into(), &mut o[part], |v| v as u16),
            (SampleKind::Packed(b), SamplesMut::U32(o)) => unpack(self, b.into(), &mut o[part], |v| v),
            (kind, out) => debug_assert!(false, "{kind:?} does not go into {out:?}: the caller checks the type"),
        }
    }
}
