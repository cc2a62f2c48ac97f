//! What a report's pictures are made of, beside the store that the run has written.

use crate::grid::DataSets;

/// What the image at the root of the store shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Root {
    /// Grey values, with labels beside them.
    Image,
    /// Labels, with these beside them.
    Labels,
    /// The segmentation function, 1 inside, the surface at 1/2.
    LevelSet,
    /// Distances.
    Distance,
    /// Travel times.
    Times,
}

/// What colours a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Measure {
    /// The distance to the nearest mark of the object; the objects' labels are those of the data sets.
    ToMarks,
    /// The distance between the two sets that a surface lies between.
    Thickness,
}

/// What a run was given, as far as pictures show it.
pub(crate) struct Evidence<'a> {
    pub(crate) root: Root,
    pub(crate) measure: Measure,
    /// Marks, points and triangles by label.
    pub(crate) sources: &'a DataSets,
    /// A place that slices go through where there are no points, world coordinates.
    pub(crate) centre: [f64; 3],
    /// What the points are called.
    pub(crate) points: &'static str,
}
