//! The types a stored voxel may have.

use half::f16;

use crate::grid::SourceState;

/// The type of a voxel, known only when a file is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ElementType {
    /// Unsigned 8 bit.
    U8,
    /// Unsigned 16 bit.
    U16,
    /// Unsigned 32 bit.
    U32,
    /// Signed 8 bit.
    I8,
    /// Signed 16 bit.
    I16,
    /// Signed 32 bit.
    I32,
    /// Half precision.
    F16,
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

impl ElementType {
    /// Bytes of one voxel.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The name Zarr gives the type, also used in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::U8 => "uint8",
            Self::U16 => "uint16",
            Self::U32 => "uint32",
            Self::I8 => "int8",
            Self::I16 => "int16",
            Self::I32 => "int32",
            Self::F16 => "float16",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }
}

mod sealed {
    pub trait Sealed {}
}

/// A type that bricks can hold: plain numbers without padding, for which any bit pattern is a value.
pub trait Element:
    sealed::Sealed + Copy + Default + PartialEq + PartialOrd + Send + Sync + std::fmt::Debug + 'static
{
    /// The same type as a value.
    const TYPE: ElementType;

    /// The value as f64 (exact for every element type).
    fn to_f64(self) -> f64;

    /// The nearest value of this type; integers round half away from zero and saturate.
    fn from_f64(value: f64) -> Self;

    /// Appends the values to `out`, little-endian.
    fn append_bytes(values: &[Self], out: &mut Vec<u8>);

    /// Fills `values` from as many little-endian ones.
    fn fill_from_bytes(values: &mut [Self], bytes: &[u8]);
}

macro_rules! element {
    ($t:ty, $variant:ident, $to:expr, $from:expr) => {
        impl sealed::Sealed for $t {}
        impl Element for $t {
            const TYPE: ElementType = ElementType::$variant;
            #[inline]
            fn to_f64(self) -> f64 {
                ($to)(self)
            }
            #[inline]
            fn from_f64(value: f64) -> Self {
                ($from)(value)
            }
            fn append_bytes(values: &[Self], out: &mut Vec<u8>) {
                let start = out.len();
                out.resize(start + size_of_val(values), 0);
                let words = out[start..].as_chunks_mut().0;
                words.iter_mut().zip(values).for_each(|(word, value)| *word = value.to_le_bytes());
            }
            fn fill_from_bytes(values: &mut [Self], bytes: &[u8]) {
                let words = bytes.as_chunks().0;
                values.iter_mut().zip(words).for_each(|(value, word)| *value = Self::from_le_bytes(*word));
            }
        }
    };
}

element!(u8, U8, f64::from, |v: f64| v.round() as u8);
element!(u16, U16, f64::from, |v: f64| v.round() as u16);
element!(u32, U32, f64::from, |v: f64| v.round() as u32);
element!(i8, I8, f64::from, |v: f64| v.round() as i8);
element!(i16, I16, f64::from, |v: f64| v.round() as i16);
element!(i32, I32, f64::from, |v: f64| v.round() as i32);
element!(SourceState, U32, |s: SourceState| f64::from(s.bits()), |v: f64| SourceState::from_bits(v.round() as u32));
element!(f16, F16, f64::from, f16::from_f64);
element!(f32, F32, f64::from, |v: f64| v as f32);
element!(f64, F64, |v: f64| v, |v: f64| v);

/// A buffer for samples whose type is known only at run time.
#[derive(Debug)]
pub enum SamplesMut<'a> {
    /// Unsigned 8 bit.
    U8(&'a mut [u8]),
    /// Unsigned 16 bit.
    U16(&'a mut [u16]),
    /// Unsigned 32 bit.
    U32(&'a mut [u32]),
    /// Single precision.
    F32(&'a mut [f32]),
    /// Double precision.
    F64(&'a mut [f64]),
}

impl SamplesMut<'_> {
    /// The type of the samples.
    #[must_use]
    pub fn element(&self) -> ElementType {
        match self {
            Self::U8(_) => ElementType::U8,
            Self::U16(_) => ElementType::U16,
            Self::U32(_) => ElementType::U32,
            Self::F32(_) => ElementType::F32,
            Self::F64(_) => ElementType::F64,
        }
    }

    /// How many samples the buffer takes.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::U8(out) => out.len(),
            Self::U16(out) => out.len(),
            Self::U32(out) => out.len(),
            Self::F32(out) => out.len(),
            Self::F64(out) => out.len(),
        }
    }

    /// True for a buffer that takes none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// An element type that stacks hand out: says how its buffers are passed to a reader.
pub trait Sample: Element {
    /// The buffer as the reader wants it.
    fn buffer(out: &mut [Self]) -> SamplesMut<'_>;
}

macro_rules! sample {
    ($type:ty, $variant:ident) => {
        impl Sample for $type {
            fn buffer(out: &mut [Self]) -> SamplesMut<'_> {
                SamplesMut::$variant(out)
            }
        }
    };
}
sample!(u8, U8);
sample!(u16, U16);
sample!(u32, U32);
sample!(f32, F32);
sample!(f64, F64);

/// Work on samples whose type is known only when a file is opened.
pub trait SampleWork {
    /// What comes of it.
    type Output;

    /// Does the work on samples of a type.
    fn on<T: Sample>(self) -> Self::Output;
}

impl ElementType {
    /// Does work on samples of this type, as stacks hand them out: what has no type of its own in the smallest that holds it.
    pub fn with_samples<W: SampleWork>(self, work: W) -> W::Output {
        match self {
            Self::U8 => work.on::<u8>(),
            Self::U16 => work.on::<u16>(),
            Self::U32 => work.on::<u32>(),
            Self::I8 | Self::I16 | Self::F16 | Self::F32 => work.on::<f32>(),
            Self::I32 | Self::F64 => work.on::<f64>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back<T: Element>(values: &[T], bytes: &[u8]) {
        let mut out = vec![7];
        T::append_bytes(values, &mut out);
        assert_eq!(out[1..], *bytes, "{:?}", T::TYPE);
        let mut back = vec![T::default(); values.len()];
        T::fill_from_bytes(&mut back, bytes);
        assert_eq!(back, values);
    }

    #[test]
    fn values_are_little_endian_bytes() {
        there_and_back(&[1_u8, 255], &[1, 255]);
        there_and_back(&[0x1234_u16, 1], &[0x34, 0x12, 1, 0]);
        there_and_back(&[0x8000_0001_u32], &[1, 0, 0, 0x80]);
        there_and_back(&[-2_i16, 5], &[0xfe, 0xff, 5, 0]);
        // 1 and infinity of IEEE 754 binary16, -2 of binary32, 1 of binary64.
        there_and_back(&[f16::ONE, f16::INFINITY], &[0, 0x3c, 0, 0x7c]);
        there_and_back(&[-2.0_f32], &[0, 0, 0, 0xc0]);
        there_and_back(&[1.0_f64], &[0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
    }
}
