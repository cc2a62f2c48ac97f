//! `middle`: the surface equally far from labelled clouds and meshes, straight from source tracking (Kósa & Mikula
//! 2023; docs/algorithms.md, "Labels and middle surfaces").
//!
//! ```text
//! sources -> distance with tracking -> labels -> surfaces between them -> mesh, measures of each pair
//! ```

mod exact;
mod job;
mod surface;
mod table;

pub use job::{LabelMode, MiddleFound, MiddleSettings, SurfaceKind, middle};
