//! The settings of the time loop, when it ends, and how it ended (docs/algorithms.md, "Time loop").

use crate::kernel::level_set::scheme::velocity::Velocity;

/// When the time loop ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// When the surface moves slower than this (its mean motion per unit of time).
    Surface(f64),
    /// When the discrete L2 norm of a step's change falls under this (Kósa 2015).
    L2(f64),
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
#[derive(Clone, Debug, PartialEq)]
pub struct Evolution {
    /// Steps taken.
    pub steps: u32,
    /// Relaxations of a cell, all steps together, mean over the cells.
    pub sor_iterations: u64,
    /// Which rule ended it.
    pub stopped_by: &'static str,
    /// What the rule looked at when it ended.
    pub residual: f64,
    /// What it looked at after each step.
    pub residuals: Vec<f64>,
}
