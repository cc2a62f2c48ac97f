//! Surfaces in 3-D volumes that may be larger than memory: distances to points, triangle meshes and labels; the surfaces
//! in the middle between them; closed surfaces from point clouds; objects in images, guided by a few marks on their border.
//!
//! Each of the four is a builder that refuses what makes no sense before anything is computed, and returns its results as
//! values: fields that are read by boxes ([`Field`]), labels, meshes in memory or handed to a [`MeshSink`] as they are drawn.
//!
//! | builder | gives |
//! | --- | --- |
//! | [`DistanceField`] | the distance to points, meshes and labels, signed where meshes are closed; the nearest label and source |
//! | [`MiddleSurface`] | the surfaces equally far from two data sets or more |
//! | [`Reconstruction`] | a closed surface from points without normals |
//! | [`Segmentation`] | objects in an image, from outlines, points or a ball in each |
//!
//! Results do not depend on threads, memory or bricks, to the bit; they are those of the program `strandline`.
//!
//! # The distance to a cloud and a mesh
//!
//! ```
//! use strandline::{Box3, DistanceField, TriangleMesh};
//!
//! # fn main() -> strandline::Result<()> {
//! let cloud = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let mesh = TriangleMesh::new(vec![[2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 0.0, 1.0]], vec![[0, 1, 2]])?;
//! let found = DistanceField::new().points(&cloud).mesh(&mesh).spacing([0.1; 3]).labels().solve()?;
//! let corner = Box3::new([0; 3], [4, 2, 2]);
//! let (distances, labels) = (found.distance().read_box(&corner)?, found.labels()?.read_box(&corner)?);
//! assert_eq!((distances.len(), labels[0]), (16, 1));
//! # Ok(())
//! # }
//! ```
//!
//! # The surface between two points
//!
//! ```
//! use strandline::MiddleSurface;
//!
//! # fn main() -> strandline::Result<()> {
//! let (left, right) = ([[0.0, 0.0, 0.0]], [[2.0, 0.0, 0.0]]);
//! let found = MiddleSurface::new().points(&left).points(&right).spacing([0.1; 3]).solve()?;
//! assert!(found.mesh.mesh.vertices.iter().all(|v| (v[0] - 1.0).abs() < 1e-6));
//! # Ok(())
//! # }
//! ```
//!
//! # The surface of a cloud
//!
//! ```
//! use strandline::Reconstruction;
//!
//! # fn main() -> strandline::Result<()> {
//! let on_sphere = |n: u32| {
//!     let (z, turn) = (1.0 - (2.0 * f64::from(n) + 1.0) / 400.0, 2.399_963 * f64::from(n));
//!     [(1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z]
//! };
//! let cloud: Vec<_> = (0..400).map(on_sphere).collect();
//! let found = Reconstruction::of(&cloud).solve()?;
//! println!("{} triangles around {}", found.mesh.len(), found.measures().volume);
//! # Ok(())
//! # }
//! ```
//!
//! # An object in an image
//!
//! ```
//! use strandline::{Geometry, Segmentation, Volume};
//!
//! # fn main() -> strandline::Result<()> {
//! let is_inside = |n: i64| [n % 32, n / 32 % 32, n / 1024].iter().map(|v| (v - 16).pow(2)).sum::<i64>() <= 100;
//! let image = Volume::new([32; 3], (0..32_768).map(|n| if is_inside(n) { 200 } else { 50_u8 }).collect::<Vec<_>>())?;
//! let ring = |z: f64, r: f64| -> Vec<[f64; 3]> {
//!     (0..24).map(|n| f64::from(n) * 0.2618).map(|a| [16.0 + r * a.cos(), 16.0 + r * a.sin(), z]).collect()
//! };
//! let outlines = [(9.0, 7.1), (16.0, 10.0), (23.0, 7.1)].map(|(z, r)| ring(z, r));
//! let empty = Segmentation::of(&image, Geometry::new([32; 3], [1.0; 3], [0.0; 3]));
//! let found = outlines.iter().fold(empty, |job, outline| job.outline(1, outline)).solve()?;
//! println!("{} voxels, {} triangles", found.outcome().label_voxels[&1], found.mesh(1)?.len());
//! # Ok(())
//! # }
//! ```
//!
//! # Axes and units
//!
//! Triples are `[x, y, z]` everywhere. Arrays lie `[z][y][x]`: x changes fastest. Positions are world positions in `f64`, the
//! same ones for points, meshes and grids; a [`Geometry`] says where the centre of voxel `[0, 0, 0]` lies and how far apart
//! voxels are. Lengths, areas and volumes are in the unit of the positions, whatever that is; settings such as
//! [`DistanceField::max_distance`] and [`Reconstruction::beta`] are such lengths. Signed distances are negative inside.
//! Triangles are counterclockwise when seen from outside. Label 0 is what has none.
//!
//! # Memory, threads, stores
//!
//! Every builder has `memory` and `threads`. Fields that do not fit the memory lie in temporary files, in the folder that
//! `scratch` names; a result keeps them until it goes. `store` writes an OME-Zarr store beside that, with a pyramid, as the
//! program does; `cancel` and `progress` are for those who wait. A job that is ended begins anew: checkpoints, from which a run
//! goes on, are the program's (`--checkpoint`, `--resume`).
//!
//! # Errors
//!
//! An [`Error`] is one sentence: what is wrong, where, what to do. Its [`kind`](Error::kind) tells wrong settings from
//! unusable inputs and from runs that failed; its [`source`](std::error::Error::source) is the error of the operating system
//! or of another library, where it came of one.
//!
//! # Features
//!
//! `cli`, on by default: the program `strandline`, with clap, indicatif and signal-hook; `viewer`, too: its `strandline view`, with a
//! server and the page that it serves. A library does without:
//! `strandline = { version = "0.1", default-features = false }`.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

// The rooms that everything is made of. They can be named for this project's own tests and measurements; semantic versioning
// covers what is on the front page alone, and they may change in any version.
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod exec;
#[doc(hidden)]
pub mod grid;
#[doc(hidden)]
pub mod io;
#[doc(hidden)]
pub mod job;
#[doc(hidden)]
pub mod kernel;
#[doc(hidden)]
pub mod pipeline;
#[doc(hidden)]
pub mod store;
#[doc(hidden)]
pub mod tile;
#[cfg(feature = "viewer")]
#[doc(hidden)]
pub mod view;

pub use error::{Error, ErrorKind, Result};
pub use exec::{Cancel, Progress, Silent};
pub use grid::{Box3, Geometry, TriangleMesh};
pub use io::ome_zarr::{Compression, OmeVersion};
pub use job::{
    DistanceField, Field, LabelledMesh, MiddleSurface, Reconstruction, Segmentation, SolvedDistance, SolvedMiddle,
    SolvedReconstruction, SolvedSegmentation, Volume,
};
pub use kernel::distance::state::neighbours::Neighbours;
pub use kernel::distance::state::precision::Precision;
pub use kernel::surface::{Contact, Hausdorff, LabelMeasures, Measures, Pair};
pub use pipeline::distance::{DistanceFound, Init, Method, Schedule};
pub use pipeline::enclosure::search::Hole;
pub use pipeline::image::terms::Smoothing;
pub use pipeline::level_set::time_loop::{Evolution, Stop};
pub use pipeline::middle::{LabelMode, SurfaceKind};
pub use pipeline::reconstruct::Vertices;
pub use pipeline::segment::{
    CrossValidation, FillGaps, ImageModel, NeighboursFound, ObjectReport, Outcome, Overlap, Refused, Start,
};
pub use store::{BoxSource, Element, ElementType, MeshSink, NoMesh, Sample};
