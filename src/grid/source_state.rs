//! `SourceState`: what a voxel knows of its source, in 32 bits: which one it is, and whether it may still change.

/// The index of no source.
pub const NO_SOURCE: u32 = u32::MAX >> 1;

/// Set where a source fixed the voxel.
const FROZEN: u32 = 1 << 31;

/// A voxel on its way to its nearest source. *Far*: none is known. *Trial*: one is known, and a nearer one may come.
/// *Frozen*: a source fixed the voxel, whose source stays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd)]
#[repr(transparent)]
pub struct SourceState(u32);

impl SourceState {
    /// No source is known.
    pub const FAR: Self = Self(NO_SOURCE);

    /// A source is known; [`NO_SOURCE`] for none.
    #[inline(always)]
    #[must_use]
    pub const fn trial(source: u32) -> Self {
        Self(source)
    }

    /// A source fixed the voxel.
    #[inline(always)]
    #[must_use]
    pub const fn frozen(source: u32) -> Self {
        Self(source | FROZEN)
    }

    /// The same source, for good.
    #[inline(always)]
    #[must_use]
    pub const fn freeze(self) -> Self {
        Self(self.0 | FROZEN)
    }

    /// The same source, on trial.
    #[inline(always)]
    #[must_use]
    pub const fn thaw(self) -> Self {
        Self(self.0 & !FROZEN)
    }

    /// Whether a source fixed the voxel.
    #[inline(always)]
    #[must_use]
    pub const fn is_frozen(self) -> bool {
        self.0 & FROZEN != 0
    }

    /// The index of the source, [`NO_SOURCE`] where none is known.
    #[inline(always)]
    #[must_use]
    pub const fn source(self) -> u32 {
        self.0 & !FROZEN
    }

    /// Whether a source is known.
    #[inline(always)]
    #[must_use]
    pub const fn has_source(self) -> bool {
        self.source() != NO_SOURCE
    }

    /// The source, where one is known.
    #[inline]
    #[must_use]
    pub fn known(self) -> Option<u32> {
        Some(self.source()).filter(|&source| source != NO_SOURCE)
    }

    /// As it lies in memory and on disk.
    #[must_use]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// From bits as [`SourceState::bits`] gives them.
    #[must_use]
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// The bits, little-endian.
    #[must_use]
    pub const fn to_le_bytes(self) -> [u8; 4] {
        self.0.to_le_bytes()
    }

    /// From the bits, little-endian.
    #[must_use]
    pub const fn from_le_bytes(bytes: [u8; 4]) -> Self {
        Self(u32::from_le_bytes(bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_keep_their_source() {
        for source in [0, 7, NO_SOURCE - 1] {
            let (trial, frozen) = (SourceState::trial(source), SourceState::frozen(source));
            assert_eq!((trial.known(), frozen.known()), (Some(source), Some(source)));
            assert_eq!((trial.is_frozen(), frozen.is_frozen()), (false, true));
            assert_eq!((trial.freeze(), frozen.thaw()), (frozen, trial));
        }
        assert!(!SourceState::FAR.has_source() && !SourceState::FAR.freeze().has_source());
        assert!(!SourceState::FAR.is_frozen());
    }
}
