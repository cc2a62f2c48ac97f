//! Reads whole TIFF stacks for comparison.

use std::path::Path;

use strandline::error::Result;
use strandline::io::tiff_stack::{Select, StackInfo, TiffStack};
use strandline::store::{ElementType, PlaneSource, SamplesMut};

/// Plane `z` as f64, exact for every type.
pub(crate) fn plane(stack: &TiffStack, z: i64) -> Result<Vec<f64>> {
    macro_rules! read {
        ($t:ty, $variant:ident) => {{
            // Not zero, so that a voxel that was left out shows.
            let mut out = vec![77 as $t; (stack.shape()[0] * stack.shape()[1]) as usize];
            stack.read_plane(z, SamplesMut::$variant(&mut out))?;
            Ok(out.into_iter().map(f64::from).collect())
        }};
    }
    match stack.element() {
        ElementType::U8 => read!(u8, U8),
        ElementType::U16 => read!(u16, U16),
        ElementType::U32 => read!(u32, U32),
        ElementType::F32 => read!(f32, F32),
        ElementType::F64 => read!(f64, F64),
        ElementType::F16 => panic!("half precision is never handed out"),
    }
}

/// A channel at a time of a file: what it says of itself, and all voxels, x fastest.
pub(crate) fn stack(path: &Path, channel: u32, time: u32) -> Result<(StackInfo, Vec<f64>)> {
    selected(path, Select { channel, time, ..Select::default() })
}

/// What was chosen of a file: what it says of itself, and all voxels, x fastest.
pub(crate) fn selected(path: &Path, select: Select) -> Result<(StackInfo, Vec<f64>)> {
    let stack = TiffStack::open(path, select)?;
    let mut voxels = Vec::new();
    for z in 0..stack.shape()[2] {
        voxels.extend(plane(&stack, z)?);
    }
    Ok((stack.info().clone(), voxels))
}
