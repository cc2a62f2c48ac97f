//! Surfaces between labels: tetrahedra cut by the labels of their corners.

pub(crate) mod contact;
pub(crate) mod corner;
pub(crate) mod creases;
pub(crate) mod equidistant;
pub(crate) mod indicators;
pub(crate) mod interfaces;
pub(crate) mod known;
pub(crate) mod nearby;
pub(crate) mod pairs;
pub(crate) mod partition;
pub(crate) mod polygon;
pub(crate) mod splits;
pub(crate) mod tetrahedron;
