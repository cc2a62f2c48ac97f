//! The types of numbers that stacks are stored in, and how their bytes become the types that are handed out.

use half::f16;

use crate::store::{ElementType, SamplesMut};

/// The type of a stored number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
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

/// Which end of a number comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    /// The order of this machine.
    pub(crate) const NATIVE: Self = if cfg!(target_endian = "big") { Self::Big } else { Self::Little };

    /// The unsigned number in up to eight bytes.
    pub(crate) fn number(self, bytes: &[u8]) -> u64 {
        let join = |n: u64, &b: &u8| (n << 8) | u64::from(b);
        match self {
            Self::Little => bytes.iter().rev().fold(0, join),
            Self::Big => bytes.iter().fold(0, join),
        }
    }
}

/// Stored bytes that know where each number goes.
pub(crate) trait Copying {
    /// Puts numbers of `N` bytes into `out`, converted.
    fn copy<const N: usize, T>(self, out: &mut [T], convert: impl Fn([u8; N]) -> T);
}

macro_rules! copied {
    ($bytes:expr, $order:expr, $out:expr, $t:ty, $convert:expr) => {
        match $order {
            ByteOrder::Little => $bytes.copy($out, |b| ($convert)(<$t>::from_le_bytes(b))),
            ByteOrder::Big => $bytes.copy($out, |b| ($convert)(<$t>::from_be_bytes(b))),
        }
    };
}

impl Number {
    const ALL: [(Self, &'static str, u16); 11] = [
        (Self::U8, "uint8", 8),
        (Self::U16, "uint16", 16),
        (Self::U32, "uint32", 32),
        (Self::U64, "uint64", 64),
        (Self::I8, "int8", 8),
        (Self::I16, "int16", 16),
        (Self::I32, "int32", 32),
        (Self::I64, "int64", 64),
        (Self::F16, "float16", 16),
        (Self::F32, "float32", 32),
        (Self::F64, "float64", 64),
    ];

    /// The type of that name, like `uint16`.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, known, _)| *known == name).map(|(number, ..)| *number)
    }

    /// Its name.
    pub(crate) fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// Bits of a number.
    pub(crate) fn bits(self) -> u16 {
        Self::ALL[self as usize].2
    }

    /// The smallest type handed out that holds every value exactly; of 64-bit integers those up to 2^53.
    pub(crate) fn element(self) -> ElementType {
        match self {
            Self::U8 => ElementType::U8,
            Self::U16 => ElementType::U16,
            Self::U32 => ElementType::U32,
            Self::I8 | Self::I16 | Self::F16 | Self::F32 => ElementType::F32,
            Self::I32 | Self::U64 | Self::I64 | Self::F64 => ElementType::F64,
        }
    }

    /// Copies stored numbers to `out[from..]`, whose type is that of [`Number::element`].
    pub(crate) fn copy(self, bytes: impl Copying, order: ByteOrder, out: &mut SamplesMut<'_>, from: usize) {
        match (self, out) {
            (Self::U8, SamplesMut::U8(o)) => bytes.copy(&mut o[from..], |[b]: [u8; 1]| b),
            (Self::U16, SamplesMut::U16(o)) => copied!(bytes, order, &mut o[from..], u16, |v| v),
            (Self::U32, SamplesMut::U32(o)) => copied!(bytes, order, &mut o[from..], u32, |v| v),
            (Self::F32, SamplesMut::F32(o)) => copied!(bytes, order, &mut o[from..], f32, |v| v),
            (Self::F64, SamplesMut::F64(o)) => copied!(bytes, order, &mut o[from..], f64, |v| v),
            (Self::F16, SamplesMut::F32(o)) => copied!(bytes, order, &mut o[from..], f16, f32::from),
            (Self::I8, SamplesMut::F32(o)) => copied!(bytes, order, &mut o[from..], i8, f32::from),
            (Self::I16, SamplesMut::F32(o)) => copied!(bytes, order, &mut o[from..], i16, f32::from),
            (Self::I32, SamplesMut::F64(o)) => copied!(bytes, order, &mut o[from..], i32, f64::from),
            (Self::U64, SamplesMut::F64(o)) => copied!(bytes, order, &mut o[from..], u64, |v| v as f64),
            (Self::I64, SamplesMut::F64(o)) => copied!(bytes, order, &mut o[from..], i64, |v| v as f64),
            (number, out) => debug_assert!(false, "{number:?} does not go into {out:?}: the caller checks the type"),
        }
    }
}
