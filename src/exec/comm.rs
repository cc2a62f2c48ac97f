//! `Comm`: what ranks say to each other. One rank is a case of many: [`SelfComm`] is all there is to say to oneself.
//!
//! The engine calls these at the points where ranks must agree: after each wave of bricks (neighbours on other ranks
//! need the faces that changed), for each sum that decides something, and before a shared decision.

use crate::error::Result;
use crate::grid::Slot;

/// The ranks of a run.
pub trait Comm: Send + Sync {
    /// This rank's number, from 0.
    fn rank(&self) -> usize;

    /// Number of ranks.
    fn ranks(&self) -> usize;

    /// Hands the faces of the bricks of a finished wave to the ranks that read them.
    ///
    /// # Errors
    /// When another rank is gone.
    fn publish_faces(&self, wave: &[Slot]) -> Result<()>;

    /// The sum of all ranks' partial sums, given per cell in grid order and added in that order in f64.
    ///
    /// # Errors
    /// When another rank is gone.
    fn sum(&self, partial: &[f64]) -> Result<f64>;
}

/// One rank that owns every brick: its neighbours' faces are already in its own arena.
#[derive(Clone, Copy, Debug, Default)]
pub struct SelfComm;

impl Comm for SelfComm {
    fn rank(&self) -> usize {
        0
    }

    fn ranks(&self) -> usize {
        1
    }

    fn publish_faces(&self, _wave: &[Slot]) -> Result<()> {
        Ok(())
    }

    fn sum(&self, partial: &[f64]) -> Result<f64> {
        Ok(partial.iter().sum())
    }
}
