//! `segment`: objects in a 3-D image, guided by border points that were marked on it.
//!
//! ```text
//! stack -> bricks -> root image        marks -> contours -> cloud, object by object, each in a box of its own
//! cloud -> distance -> flood -> band   image -> presmoothing -> edge detector      band + edges -> time loop -> u
//! u -> surface -> mesh, measures       u of all objects -> one label volume
//! ```

mod check;
mod estimate;
mod labels;
mod outlines;
mod object;
mod output;
mod reach;
mod seed;
mod settings;
mod shape_field;
mod shape_start;
mod speed;
mod survey;


pub use check::{check_marks, check_seed, check_smoothing};
pub use estimate::{Estimate, estimate};
pub use labels::Overlap;
pub use object::ObjectReport;
pub use output::{Outcome, segment};
pub use outlines::crossed;
pub use settings::{Guides, ImageModel, SegmentSettings, Start};
