//! The grey range of an image of which nobody says it: without one a page shows all numbers that its type can hold, of 16 bits mostly black.

use crate::grid::Box3;
use crate::io::stack::formats::open_stack;
use crate::io::stack::volume::Select;
use crate::store::{ElementType, SamplesMut};
use crate::view::described::Image;

/// Voxels that are looked at, at most: those of the coarsest level, or its middle.
const MOST: i64 = 1 << 20;
/// Bytes that reading may take beside that: a server has little memory.
const MOST_BYTES: u64 = 32 << 20;
/// Shares of the voxels that are darker than black, and not brighter than white.
const DARK: f64 = 0.01;
const BRIGHT: f64 = 0.998;

/// The values from black to white of a channel; none where it cannot be read, or is all of one value.
pub(super) fn window(image: &Image, channel: u32) -> Option<[f64; 2]> {
    let times = image.axes.iter().find(|axis| axis.name == "t").map_or(1, |axis| axis.voxels);
    let time = u32::try_from(times.saturating_sub(1) / 2).ok()?;
    let select = Select { channel, time, level: image.levels.saturating_sub(1), ..Select::default() };
    let stack = open_stack(&image.folder, select).ok()?;
    if stack.decoding_bytes() > MOST_BYTES {
        return None;
    }
    let part = middle(stack.shape());
    let length = part.len();
    let mut values: Vec<f64> = match stack.element() {
        ElementType::U8 => read(length, |out| stack.read_box(&part, SamplesMut::U8(out)).is_ok())?,
        ElementType::U16 => read(length, |out| stack.read_box(&part, SamplesMut::U16(out)).is_ok())?,
        ElementType::U32 => read::<u32>(length, |out| stack.read_box(&part, SamplesMut::U32(out)).is_ok())?,
        ElementType::F32 => read::<f32>(length, |out| stack.read_box(&part, SamplesMut::F32(out)).is_ok())?,
        ElementType::F64 => read::<f64>(length, |out| stack.read_box(&part, SamplesMut::F64(out)).is_ok())?,
        // No reader hands out others.
        _ => return None,
    };
    values.retain(|value| value.is_finite());
    values.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| values.get((share * (values.len().saturating_sub(1)) as f64).round() as usize).copied();
    let ends = |low: f64, high: f64| at(low).zip(at(high)).filter(|(low, high)| low < high);
    ends(DARK, BRIGHT).or_else(|| ends(0.0, 1.0)).map(|(low, high)| [low, high])
}

/// A box in the middle that is small enough: thinner along z first.
fn middle(shape: [i64; 3]) -> Box3 {
    let mut size = shape;
    for axis in [2, 1, 0] {
        let others: i64 = (0..3).filter(|&other| other != axis).map(|other| size[other]).product();
        size[axis] = size[axis].min((MOST / others.max(1)).max(1));
    }
    let low: [i64; 3] = std::array::from_fn(|a| (shape[a] - size[a]) / 2);
    Box3::new(low, std::array::from_fn(|a| low[a] + size[a]))
}

fn read<T: Copy + Default + Into<f64>>(length: usize, fill: impl FnOnce(&mut [T]) -> bool) -> Option<Vec<f64>> {
    let mut values = vec![T::default(); length];
    fill(&mut values).then(|| values.into_iter().map(Into::into).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_images_are_looked_at_in_their_middle() {
        assert_eq!(middle([100, 90, 80]), Box3::from_shape([100, 90, 80]));
        assert_eq!(middle([1024, 1024, 50]), Box3::new([0, 0, 24], [1024, 1024, 25]));
        let wide = middle([4096, 2048, 3]);
        assert_eq!((wide.len(), wide.lo), (1 << 20, [0, 896, 1]));
    }
}
