//! Triangles that are there more than once: with the same side outside, as an export written twice has them, or with
//! both, as programs write them that draw only one side of a triangle.

use crate::kernel::topology::union_find::Forest;

/// Leaves out triangles that are there again, and one of each two of opposite sides in pieces that have only such.
/// Returns how many of either. Two bodies that share a wall keep both of its sides.
pub(crate) fn leave_out(triangles: &mut Vec<[u32; 3]>, names: &[u32]) -> (u64, u64) {
    let mut order: Vec<([u32; 3], bool, u32)> = Vec::with_capacity(triangles.len());
    for (n, triangle) in triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|v| names[v as usize]);
        if a != b && b != c && a != c {
            let mut corners = [a, b, c];
            corners.sort_unstable();
            // The three turns of a triangle that keep its side are those in which the middle follows the lowest.
            let is_even = corners[1] == [b, c, a][[a, b, c].iter().position(|&v| v == corners[0]).unwrap_or(0)];
            order.push((corners, is_even, n as u32));
        }
    }
    order.sort_unstable();
    let mut keep = vec![true; triangles.len()];
    let mut twins = Vec::new();
    let mut doubled = 0;
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        let mut sides = same.chunk_by(|a, b| a.1 == b.1).map(|side| {
            side[1..].iter().for_each(|again| keep[again.2 as usize] = false);
            doubled += side.len() as u64 - 1;
            side[0].2
        });
        if let (Some(first), second) = (sides.next(), sides.next()) {
            twins.push((first, second));
        }
    }
    let mut pieces = Forest::of_singles(names.len());
    for (corners, ..) in &order {
        pieces.join(corners[0], corners[1]);
        pieces.join(corners[0], corners[2]);
    }
    let mut is_two_sided = vec![true; names.len()];
    for (first, _) in twins.iter().filter(|(_, second)| second.is_none()) {
        is_two_sided[pieces.root(names[triangles[*first as usize][0] as usize]) as usize] = false;
    }
    let mut two_sided = 0;
    for (first, second) in twins {
        let Some(second) = second else { continue };
        if is_two_sided[pieces.root(names[triangles[first as usize][0] as usize]) as usize] {
            keep[first.max(second) as usize] = false;
            two_sided += 1;
        }
    }
    let mut kept = keep.iter();
    triangles.retain(|_| kept.next().is_none_or(|keep| *keep));
    (doubled, two_sided)
}
