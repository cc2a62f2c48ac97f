//! Surfaces between labels: tetrahedra cut by the labels of their corners.

pub(crate) mod corner;
pub(crate) mod creases;
pub(crate) mod cuts;
pub(crate) mod equidistant;
pub(crate) mod indicators;
pub(crate) mod interfaces;
pub(crate) mod known;
pub(crate) mod measured;
pub(crate) mod nearby;
pub(crate) mod partition;
pub(crate) mod polygon;
pub(crate) mod sides;
pub(crate) mod splits;
pub(crate) mod tetrahedron;
pub(crate) mod touching;
pub(crate) mod walls;
