//! Who reads a distance out while the rest of it is still solved.

use super::field::Solved;
use crate::error::Result;
use crate::pipeline::distance::schedule::passing::Passed;

/// Reads a distance out as far as a front has passed it.
pub trait Early<P>: Sync {
    /// The front has come farther; `solved` is what can be read where it has passed.
    ///
    /// # Errors
    /// When the output cannot be written or the run is interrupted.
    fn passed(&self, passed: &Passed<'_>, solved: &Solved<'_, P>) -> Result<()>;

    /// Something has changed that was read.
    fn reopened(&self);
}
