//! `segment`: objects in a 3-D image, guided by border points that were marked on it.
//!
//! ```text
//! stack -> bricks -> root image        marks -> contours -> cloud, object by object, each in a box of its own
//! cloud -> distance -> flood -> band   image -> presmoothing -> edge detector      band + edges -> time loop -> u
//! u -> surface -> mesh, measures       u of all objects -> neighbours -> one label volume, common faces
//! ```

pub(crate) mod begun;
pub mod checks;
mod estimate;
mod kept;
mod label_image;
mod labels;
mod marks_table;
mod meshes;
mod neighbours;
mod object;
pub(crate) mod object_report;
mod objects;
pub mod outlined;
mod output;
pub(crate) mod picture;
mod ranks;
mod reach;
mod seed;
mod settings;
mod tissue;

pub use checks::all_marks::{CheckedMarks, check_all_marks};
pub use checks::doubts::{doubts, open_outlines, spans_slices};
pub use checks::lengths::{Grids, check_lengths, check_marks, check_seed, check_smoothing};
pub use checks::same_object::{Extent, shared};
pub use estimate::{Estimate, estimate, plan};
pub use kept::{Kept, KeptObject};
pub use labels::{Overlap, Placed};
pub use marks_table::MARKS;
pub use meshes::{ObjectMesh, ObjectMeshes};
pub use neighbours::{FillGaps, Found as NeighboursFound, Joined, Joining, draw_faces, join};
pub use object_report::Refused;
pub use object_report::{CrossValidation, ObjectReport};
pub use outlined::outlines::crossed;
pub use output::{LARGEST_WHOLE, Outcome, image_alone, segment, segment_kept};
pub use settings::{Guides, ImageModel, SegmentSettings, Start};
