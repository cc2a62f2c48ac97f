//! Sample types of TIFF files, and the conversion of stored rows to the types that are handed out.

use crate::io::stack::number::{ByteOrder, Copying, Number};
use crate::store::{ElementType, SamplesMut};

/// The type of a stored sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampleKind {
    Number(Number),
    /// Unsigned with this many bits, packed from the highest bit of a byte on in either byte order, rows padded to
    /// whole bytes.
    Packed(u8),
}

impl SampleKind {
    /// The kind for the values of `SampleFormat` and `BitsPerSample`, or why there is none.
    pub(crate) fn new(format: u64, bits: u64) -> Result<Self, String> {
        let (family, name) = match format {
            // Format 4 is "undefined", which readers take for unsigned.
            1 | 4 => ("uint", "unsigned"),
            2 => ("int", "signed"),
            3 => ("float", "floating point"),
            5 | 6 => return Err("complex numbers are not supported; save the real part or the magnitude".to_string()),
            _ => ("", "unknown"),
        };
        match (Number::named(&format!("{family}{bits}")), family, bits) {
            (Some(number), ..) => Ok(Self::Number(number)),
            (None, "uint", 1..=31) => Ok(Self::Packed(bits as u8)),
            _ => Err(format!("{name} samples of {bits} bits are not supported; save it as 8, 16 or 32 bit")),
        }
    }

    /// Bits of one sample.
    pub(crate) fn bits(self) -> u16 {
        match self {
            Self::Number(number) => number.bits(),
            Self::Packed(bits) => u16::from(bits),
        }
    }

    /// True for floating-point samples.
    pub(crate) fn is_float(self) -> bool {
        self.format() == 3
    }

    /// The value of the `SampleFormat` tag.
    pub(crate) fn format(self) -> u16 {
        match self {
            Self::Number(Number::I8 | Number::I16 | Number::I32 | Number::I64) => 2,
            Self::Number(Number::F16 | Number::F32 | Number::F64) => 3,
            _ => 1,
        }
    }

    /// The type's name as in the file, like `uint16`.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Number(number) => number.name().to_string(),
            Self::Packed(bits) => format!("uint{bits}"),
        }
    }

    /// The smallest type handed out that holds every value exactly; of 64-bit integers those up to 2^53.
    pub(crate) fn element(self) -> ElementType {
        match self {
            Self::Number(number) => number.element(),
            Self::Packed(..=8) => ElementType::U8,
            Self::Packed(..=16) => ElementType::U16,
            Self::Packed(_) => ElementType::U32,
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
    /// How many pixels are wanted.
    pub(crate) count: usize,
}

impl Copying for Row<'_> {
    fn copy<const N: usize, T>(self, out: &mut [T], convert: impl Fn([u8; N]) -> T) {
        let (out, (values, _)) = (&mut out[..self.count], self.bytes.as_chunks::<N>());
        if self.step == 1 {
            for (place, &value) in out.iter_mut().zip(values) {
                *place = convert(value);
            }
        } else {
            for (place, &value) in out.iter_mut().zip(values.iter().skip(self.sample).step_by(self.step)) {
                *place = convert(value);
            }
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

impl Row<'_> {
    /// Converts the wanted samples into `out[at..]`, whose type is that of [`SampleKind::element`].
    pub(crate) fn copy_to(self, out: &mut SamplesMut<'_>, at: usize) {
        let part = at..at + self.count;
        match (self.kind, out) {
            (SampleKind::Number(number), out) => number.copy(self, self.order, out, at),
            (SampleKind::Packed(b), SamplesMut::U8(o)) => unpack(self, b.into(), &mut o[part], |v| v as u8),
            (SampleKind::Packed(b), SamplesMut::U16(o)) => unpack(self, b.into(), &mut o[part], |v| v as u16),
            (SampleKind::Packed(b), SamplesMut::U32(o)) => unpack(self, b.into(), &mut o[part], |v| v),
            (kind, out) => debug_assert!(false, "{kind:?} does not go into {out:?}: the caller checks the type"),
        }
    }
}
