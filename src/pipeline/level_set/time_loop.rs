//! The settings of the time loop, when it ends, and how it ended (docs/algorithms.md, "Time loop").

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::exec::SavePoint;
use crate::kernel::level_set::scheme::velocity::Velocity;
use crate::store::BrickArray;

/// When the time loop ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// When the surface moves slower than this (its mean motion per unit of time).
    Surface(f64),
    /// When the discrete L2 norm of a step's change falls under this (Kósa 2015).
    L2(f64),
}

impl Stop {
    /// What reports call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Surface(_) => "surface",
            Self::L2(_) => "l2",
        }
    }
}

/// Settings of the time loop and its linear solver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeLoop {
    /// What moves the surface.
    pub velocity: Velocity,
    /// When to stop.
    pub stop: Stop,
    /// Steps after which to stop in any case.
    pub max_steps: u32,
    /// Over-relaxation.
    pub omega: f32,
    /// A step is solved when no cell was left with corrections above this (root mean square), what those beside it
    /// passed on since counted in.
    pub solver_tolerance: f64,
}

/// How the time loop ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evolution {
    /// Steps taken.
    pub steps: u32,
    /// Relaxations of a cell, all steps together, mean over the cells.
    pub sor_iterations: u64,
    /// Which rule ended it.
    pub stopped_by: Cow<'static, str>,
    /// What the rule looked at when it ended.
    pub residual: f64,
    /// What it looked at after each step.
    pub residuals: Vec<f64>,
}

/// What ended a loop whose surface was not at rest.
const STEP_LIMIT: &str = "max-steps";

impl Evolution {
    /// Whether the loop ended at its limit of steps, the surface not at rest.
    #[must_use]
    pub fn is_unrested(&self) -> bool {
        self.stopped_by == STEP_LIMIT
    }
}

/// The steps that were taken.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Taken {
    pub(super) steps: u32,
    pub(super) cell_iterations: u64,
    /// What the rule looked at after each.
    residuals: Vec<f64>,
    /// The surface rests.
    pub(super) ended: bool,
}

impl Taken {
    /// None, or those of an earlier run, on any number of ranks, which left the last two time levels. What all ranks counted the first one
    /// takes over.
    pub(super) fn resume(
        save_point: Option<&SavePoint<'_>>,
        is_first: bool,
        levels: [&BrickArray<f32>; 2],
    ) -> Result<Self> {
        let Some(saved) = save_point.and_then(SavePoint::saved) else { return Ok(Self::default()) };
        for (n, level) in levels.into_iter().enumerate() {
            saved.restore(n, level)?;
        }
        let parts: Vec<Self> = saved.facts_of_all()?;
        let counted = if is_first { parts.iter().map(|part| part.cell_iterations).sum() } else { 0 };
        let first = parts.into_iter().next().unwrap_or_default();
        Ok(Self { cell_iterations: counted, ..first })
    }

    pub(super) fn step(&mut self, (residual, limit): (f64, f64), cell_iterations: u64) {
        self.steps += 1;
        self.cell_iterations += cell_iterations;
        self.residuals.push(residual);
        self.ended = residual < limit;
    }

    pub(super) fn evolution(self, stop: Stop, sor_iterations: u64) -> Evolution {
        let stopped_by = if self.ended { stop.name() } else { STEP_LIMIT };
        let residual = self.residuals.last().copied().unwrap_or(f64::INFINITY);
        Evolution {
            steps: self.steps,
            sor_iterations,
            stopped_by: stopped_by.into(),
            residual,
            residuals: self.residuals,
        }
    }
}
