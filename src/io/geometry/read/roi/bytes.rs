//! Numbers at given places of a ROI, all of them with their most significant byte first.

use crate::error::{Error, Result};

/// The bytes of a ROI.
#[derive(Clone, Copy)]
pub(crate) struct Bytes<'a>(pub(crate) &'a [u8]);

impl Bytes<'_> {
    /// The bytes at a place.
    pub(crate) fn at<const N: usize>(self, place: usize) -> Result<[u8; N]> {
        let end = place.checked_add(N);
        let found = end.and_then(|end| self.0.get(place..end)).and_then(|bytes| bytes.try_into().ok());
        found.ok_or_else(|| Error::input("is cut off: a ROI of ImageJ goes on after its end"))
    }

    pub(crate) fn u8(self, place: usize) -> Result<u8> {
        self.at::<1>(place).map(|[byte]| byte)
    }

    pub(crate) fn i16(self, place: usize) -> Result<i16> {
        self.at(place).map(i16::from_be_bytes)
    }

    pub(crate) fn u16(self, place: usize) -> Result<u16> {
        self.at(place).map(u16::from_be_bytes)
    }

    pub(crate) fn i32(self, place: usize) -> Result<i32> {
        self.at(place).map(i32::from_be_bytes)
    }

    /// A finite number.
    pub(crate) fn f32(self, place: usize) -> Result<f64> {
        let value = self.at(place).map(f32::from_be_bytes)?;
        if value.is_finite() { Ok(f64::from(value)) } else { Err(Error::input("has a coordinate that is not finite")) }
    }

    /// A place or a count, which no number below 0 is.
    pub(crate) fn place(self, place: usize) -> Result<usize> {
        self.i32(place).map(|value| usize::try_from(value).unwrap_or(0))
    }
}
