//! `reconstruct`: a closed surface from a point cloud without normals (Kósa 2015).
//!
//! ```text
//! cloud -> grid -> points without noise -> distance -> flood -> band -> time loop -> u -> surface -> mesh, measures
//! ```

mod begun;
mod bridges;
mod caps;
#[cfg(test)]
mod ended;
mod estimate;
mod fitted;
mod flat;
mod grid;
mod isolated;
mod noise;
mod normals;
mod on_grid;
mod output;
mod settings;
mod spacing;

pub use caps::Cap;
pub use estimate::{Estimate, estimate, plan, refuse_too_fine, spacing_memory};
pub use grid::grid_for;
pub use isolated::without_isolated;
pub use noise::Noise;
pub use output::{Reconstruction, reconstruct, reconstruct_shown};
pub use settings::{ReconstructSettings, Vertices};
pub use spacing::typical_spacing;
