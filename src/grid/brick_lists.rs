//! `BrickLists`: what lies in each brick of a grid, of the bricks in which something lies: as large as what is listed, not as the grid.

use std::collections::HashMap;

use super::{Box3, BrickGrid, BrickId, BrickSet};

/// Numbers by the bricks that they are listed in, those of each in the order in which they came.
#[derive(Clone, Debug)]
pub(super) struct BrickLists {
    /// The bricks with something in them, ascending.
    bricks: Vec<BrickId>,
    /// Where the list of each begins in `order`, and the end of the last.
    starts: Vec<usize>,
    order: Vec<u32>,
}

impl BrickLists {
    /// Of what `listed` gives, the same each time it is asked.
    pub(super) fn new<I: Iterator<Item = (BrickId, u32)>>(listed: impl Fn() -> I) -> Self {
        let mut places: HashMap<BrickId, usize> = HashMap::new();
        // Most often the next one lies where the last one did.
        let mut run: Option<(BrickId, usize)> = None;
        for (brick, _) in listed() {
            match &mut run {
                Some((of, count)) if *of == brick => *count += 1,
                _ => {
                    if let Some((of, count)) = run.replace((brick, 1)) {
                        *places.entry(of).or_default() += count;
                    }
                }
            }
        }
        if let Some((of, count)) = run {
            *places.entry(of).or_default() += count;
        }
        let mut bricks: Vec<BrickId> = places.keys().copied().collect();
        bricks.sort_unstable();
        let mut starts = vec![0];
        for brick in &bricks {
            let start = starts[starts.len() - 1];
            starts.push(start + places.get(brick).copied().unwrap_or(0));
            places.insert(*brick, start);
        }
        let mut order = vec![0; starts[starts.len() - 1]];
        for (brick, number) in listed() {
            if let Some(place) = places.get_mut(&brick) {
                order[*place] = number;
                *place += 1;
            }
        }
        Self { bricks, starts, order }
    }

    /// What lies in a brick.
    pub(super) fn of(&self, brick: BrickId) -> &[u32] {
        match self.bricks.binary_search(&brick) {
            Ok(n) => &self.order[self.starts[n]..self.starts[n + 1]],
            Err(_) => &[],
        }
    }

    /// The bricks with something in them, ascending.
    pub(super) fn bricks(&self) -> &[BrickId] {
        &self.bricks
    }
}

/// So many bricks may be named before those that are named twice are looked for.
const NAMED: usize = 1 << 16;

/// The bricks of a grid that meet some of the boxes, each `reach` voxels larger along each axis.
pub(super) fn bricks_meeting(grid: BrickGrid, boxes: impl Iterator<Item = Box3>, reach: [i64; 3]) -> BrickSet {
    let (mut named, mut most): (Vec<BrickId>, usize) = (Vec::new(), NAMED);
    for part in boxes {
        let grown = Box3 {
            lo: std::array::from_fn(|a| part.lo[a] - reach[a]),
            hi: std::array::from_fn(|a| part.hi[a] + reach[a]),
        };
        named.extend(grid.bricks_in(&grown));
        if named.len() > most {
            named.sort_unstable();
            named.dedup();
            most = NAMED.max(2 * named.len());
        }
    }
    named.sort_unstable();
    named.dedup();
    BrickSet::from_ids(grid, named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_have_what_was_listed_in_them_and_no_more() {
        let listed = || (0..5000_u32).map(|n| (u64::from(n / 3 * 7919 % 97) * 1_000_000_007, n));
        let lists = BrickLists::new(listed);
        for brick in (0..97).map(|n| n * 1_000_000_007).chain([1, u64::MAX]) {
            let expected: Vec<u32> = listed().filter(|(of, _)| *of == brick).map(|(_, n)| n).collect();
            assert_eq!(lists.of(brick), expected);
            assert_eq!(lists.bricks().contains(&brick), !expected.is_empty());
        }
        assert!(BrickLists::new(std::iter::empty).of(0).is_empty());
    }

    #[test]
    fn bricks_meet_boxes_that_are_grown() {
        let grid = BrickGrid::new([400, 300, 200], 2);
        let boxes = || (0..40).map(|n| Box3::new([n * 9, n * 7, n * 4], [n * 9 + 3, n * 7 + 1, n * 4 + 2]));
        let reach = [15, 3, 20];
        let set = bricks_meeting(grid, boxes(), reach);
        let grown = |part: Box3| Box3 {
            lo: std::array::from_fn(|a| part.lo[a] - reach[a]),
            hi: std::array::from_fn(|a| part.hi[a] + reach[a]),
        };
        for id in (0..grid.len()).step_by(7) {
            let meets = boxes().any(|part| !grown(part).intersect(&grid.brick_box(id)).is_empty());
            assert_eq!(set.slot(id).is_some(), meets, "{id}");
        }
    }
}
