//! What is connected to what.

pub mod blocks;
pub mod growth;
pub mod levels;
pub mod neighbourhood;
pub mod seams;
pub mod sides;
pub mod simplify;
pub mod union_find;
