//! What `report.json` tells of neighbouring objects: overlaps, gaps, and the areas of their common faces.

use serde::Serialize;

use crate::kernel::surface;
use crate::pipeline::segment::{FillGaps, NeighboursFound};

/// How objects lie to each other, and what became of what several or none of them claimed. Lengths physical.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Neighbours {
    /// Voxels that several objects claimed and that went to the one they lie deeper in.
    contested_voxels: u64,
    /// Labels of nested objects, each with the smallest that it lies in.
    nested: Vec<[u32; 2]>,
    /// Gaps were filled up to this width; null where they were left.
    gap_width: Option<f64>,
    filled_voxels: u64,
    moved_voxels: u64,
    /// Brightness within objects and between them, of the image taken to [0, 1]; null where no wall was seen.
    wall: Option<[f64; 2]>,
}

impl Neighbours {
    pub(crate) fn new(found: &NeighboursFound) -> Self {
        Self {
            contested_voxels: found.contested,
            nested: found.nested.clone(),
            gap_width: found.gap_width,
            filled_voxels: found.filled,
            moved_voxels: found.moved,
            wall: found.wall,
        }
    }
}

/// The faces between two labels; 0 is what has none.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Contact {
    labels: [u32; 2],
    area: f64,
    centre_xyz: [f64; 3],
    triangles: u64,
}

impl Contact {
    pub(crate) fn new(contact: &surface::Contact) -> Self {
        let surface::Contact { labels, area, centre, triangles } = *contact;
        Self { labels, area, centre_xyz: centre, triangles }
    }
}

/// The setting `--fill-gaps` as the report states it.
pub(crate) fn fill_gaps(given: Option<FillGaps>) -> serde_json::Value {
    match given {
        None => serde_json::Value::Null,
        Some(FillGaps::Auto) => "auto".into(),
        Some(FillGaps::Width(width)) => width.into(),
    }
}
