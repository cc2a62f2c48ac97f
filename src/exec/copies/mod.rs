//! Copies of what other ranks have: bricks that one asks for, and fields that go to all.

pub(super) mod borrow;
pub(super) mod spread;
pub(super) mod whole;
