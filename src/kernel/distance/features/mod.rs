//! What is looked up among sources exactly, by trees and by leaving out what cannot be nearest, and what is read off a
//! solved field: labels, closest points, insides, extents.

pub mod closest_distance;
pub mod closest_point;
pub mod culling;
pub mod exact_labels;
pub mod exact_sources;
pub mod extent;
mod halves;
pub mod inside;
pub mod labelled_shapes;
pub mod source_labels;
pub mod source_trees;
