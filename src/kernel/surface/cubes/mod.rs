//! Marching cubes: the surface of one level of a field.

pub(crate) mod marching_cubes;
pub(crate) mod surroundings;
pub(crate) mod tables;
