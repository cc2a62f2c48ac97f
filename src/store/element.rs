//! The types a stored voxel may have.

use half::f16;

/// The type of a voxel, known only when a file is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ElementType {
    /// Unsigned 8 bit.
    U8,
    /// Unsigned 16 bit.
    U16,
    /// Unsigned 32 bit.
    U32,
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
            Self::U8 => 1,
            Self::U16 | Self::F16 => 2,
            Self::U32 | Self::F32 => 4,
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
        }
    };
}

element!(u8, U8, f64::from, |v: f64| v.round() as u8);
element!(u16, U16, f64::from, |v: f64| v.round() as u16);
element!(u32, U32, f64::from, |v: f64| v.round() as u32);
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
