//! `PatchIndex`: the exact distance from points to a mesh, by triangles sorted into cells of a uniform grid.
//!
//! Each triangle lies in the one cell that holds the centre of its bounding box; triangles far larger than the cells
//! go into coarser grids, each twice as wide as the one before. Cells are searched in shells of growing Chebyshev
//! distance around the query until no triangle of the next shell can be nearer than the one found.
use serde::{Deserialize, Serialize};

use crate::kernel::geometry::triangle::Triangle;

/// The triangles of a mesh, sorted for distance queries. About 12 bytes a triangle beside the mesh itself.
#[derive(Clone, Debug)]
pub struct PatchIndex<'a> {
    vertices: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
    levels: Vec<Level>,
}

/// The nearest point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Distance from the query.
    pub distance: f64,
    /// The triangle it lies on; of several the one with the lowest number.
    pub triangle: u32,
}

/// Directed Hausdorff distances from a set of points to a surface: over each point's nearest distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hausdorff {
    /// Mean distance.
    pub mean: f64,
    /// Largest distance.
    pub max: f64,
}

impl Hausdorff {
    /// Mean and maximum, summed in the order given; none without any distance.
    pub fn of(distances: impl IntoIterator<Item = f64>) -> Option<Self> {
        let (mut sum, mut max, mut count) = (0.0, 0.0_f64, 0_u64);
        for distance in distances {
            sum += distance;
            max = max.max(distance);
            count += 1;
        }
        (count > 0).then(|| Self { mean: sum / count as f64, max })
    }
}

impl<'a> PatchIndex<'a> {
    /// Sorts the triangles into cells of about `edge`, a length like that of the triangles' sides.
    ///
    /// # Panics
    /// When `edge` is not positive, a position is not finite, a triangle names a vertex that does not exist, or there
    /// are 2^32 triangles.
    #[must_use]
    pub fn new(vertices: &'a [[f32; 3]], triangles: &'a [[u32; 3]], edge: f64) -> Self {
        assert!(edge > 0.0 && edge.is_finite(), "cells need a positive edge");
        assert!(vertices.iter().flatten().all(|x| x.is_finite()), "positions are finite");
        assert!(u32::try_from(triangles.len()).is_ok(), "triangles are numbered with 32 bits");
        let mut index = Self { vertices, triangles, levels: Vec::new() };
        let mut rest: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut edge = edge;
        while !rest.is_empty() {
            let fits = |&t: &u32| index.bounds(t).1 <= edge / 2.0;
            let (small, large): (Vec<u32>, Vec<u32>) = rest.into_iter().partition(fits);
            if !small.is_empty() {
                let level = Level::new(&index, &small, edge);
                index.levels.push(level);
            }
            rest = large;
            edge *= 2.0;
        }
        index
    }

    /// The nearest point of the surface to a finite world position; none when there is no triangle.
    #[must_use]
    pub fn nearest(&self, point: [f64; 3]) -> Option<Nearest> {
        let mut best = Best { squared: f64::INFINITY, triangle: u32::MAX };
        for level in &self.levels {
            level.search(self, point, &mut best);
        }
        (best.triangle != u32::MAX).then(|| Nearest { distance: best.squared.sqrt(), triangle: best.triangle })
    }

    /// Directed Hausdorff distances from `points` to the surface; none without points or triangles.
    pub fn hausdorff_from(&self, points: impl IntoIterator<Item = [f64; 3]>) -> Option<Hausdorff> {
        Hausdorff::of(points.into_iter().map_while(|p| self.nearest(p)).map(|n| n.distance))
    }

    fn corners(&self, triangle: u32) -> [[f64; 3]; 3] {
        self.triangles[triangle as usize].map(|v| self.vertices[v as usize].map(f64::from))
    }

    /// The centre of a triangle's bounding box and the largest of its half extents.
    fn bounds(&self, triangle: u32) -> ([f64; 3], f64) {
        let [a, b, c] = self.corners(triangle);
        let lo: [f64; 3] = std::array::from_fn(|i| a[i].min(b[i]).min(c[i]));
        let hi: [f64; 3] = std::array::from_fn(|i| a[i].max(b[i]).max(c[i]));
        (std::array::from_fn(|i| f64::midpoint(lo[i], hi[i])), (0..3).fold(0.0, |r, i| r.max((hi[i] - lo[i]) / 2.0)))
    }
}

struct Best {
    squared: f64,
    triangle: u32,
}

/// Triangles of like size in a dense grid of cells.
#[derive(Clone, Debug)]
struct Level {
    lo: [f64; 3],
    edge: f64,
    /// The largest half extent of a triangle: how far it may reach beyond its centre's cell.
    reach: f64,
    counts: [i64; 3],
    /// Where each cell's triangles start in `order`; one more entry than cells.
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Level {
    fn new(index: &PatchIndex<'_>, triangles: &[u32], edge: f64) -> Self {
        let (mut lo, mut hi, mut reach) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], 0.0_f64);
        for &t in triangles {
            let (centre, radius) = index.bounds(t);
            lo = std::array::from_fn(|i| lo[i].min(centre[i]));
            hi = std::array::from_fn(|i| hi[i].max(centre[i]));
            reach = reach.max(radius);
        }
        // Which cell a centre falls into is subject to rounding: a little more reach makes up for it.
        let largest = (0..3).fold(0.0_f64, |largest, i| largest.max(lo[i].abs()).max(hi[i].abs()));
        let reach = reach + 1e-9 * edge + 8.0 * f64::EPSILON * largest;
        let (edge, counts) = cells(lo, hi, edge, 2 * triangles.len() as u64);
        let size = counts.iter().product::<i64>() as usize;
        let mut level = Self { lo, edge, reach, counts, starts: vec![0; size + 1], order: vec![0; triangles.len()] };
        level.sort(index, triangles);
        level
    }

    /// Counting sort of the triangles by cell; within a cell they keep their order.
    fn sort(&mut self, index: &PatchIndex<'_>, triangles: &[u32]) {
        for &t in triangles {
            let cell = self.place(self.cell_of(index.bounds(t).0));
            self.starts[cell] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        // Filled from the back, each end moves down to where its cell starts.
        for &t in triangles.iter().rev() {
            let cell = self.place(self.cell_of(index.bounds(t).0));
            self.starts[cell] -= 1;
            self.order[self.starts[cell] as usize] = t;
        }
    }

    /// The cell of a position, or the one nearest to it in the grid.
    fn cell_of(&self, position: [f64; 3]) -> [i64; 3] {
        std::array::from_fn(|i| (((position[i] - self.lo[i]) / self.edge).floor() as i64).clamp(0, self.counts[i] - 1))
    }

    fn place(&self, [x, y, z]: [i64; 3]) -> usize {
        ((z * self.counts[1] + y) * self.counts[0] + x) as usize
    }

    /// Searches shell by shell until the next one lies further off than the best triangle.
    fn search(&self, index: &PatchIndex<'_>, point: [f64; 3], best: &mut Best) {
        let home = self.cell_of(point);
        let last = (0..3).map(|i| home[i].max(self.counts[i] - 1 - home[i])).max().unwrap_or(0);
        for shell in 0..=last {
            // Between the home cell and the shell lie `shell - 1` whole cells.
            let gap = (shell - 1) as f64 * self.edge - self.reach;
            if gap > 0.0 && gap * gap > best.squared {
                break;
            }
            self.search_shell(index, point, home, shell, best);
        }
    }

    fn search_shell(&self, index: &PatchIndex<'_>, point: [f64; 3], home: [i64; 3], shell: i64, best: &mut Best) {
        let range = |i: usize| (home[i] - shell).max(0)..=(home[i] + shell).min(self.counts[i] - 1);
        for z in range(2) {
            for y in range(1) {
                let is_cap = (z - home[2]).abs() == shell || (y - home[1]).abs() == shell;
                if is_cap {
                    range(0).for_each(|x| self.search_cell(index, point, [x, y, z], best));
                } else {
                    let ends = [home[0] - shell, home[0] + shell];
                    let inside = ends.into_iter().filter(|x| range(0).contains(x));
                    inside.for_each(|x| self.search_cell(index, point, [x, y, z], best));
                }
            }
        }
    }

    fn search_cell(&self, index: &PatchIndex<'_>, point: [f64; 3], cell: [i64; 3], best: &mut Best) {
        let place = self.place(cell);
        let range = self.starts[place] as usize..self.starts[place + 1] as usize;
        if range.is_empty() || self.gap_squared(point, cell) > best.squared {
            return;
        }
        for &triangle in &self.order[range] {
            let squared = Triangle::new(index.corners(triangle)).distance_squared(point);
            if squared < best.squared || (squared == best.squared && triangle < best.triangle) {
                *best = Best { squared, triangle };
            }
        }
    }

    /// A lower bound of the squared distance to the triangles of a cell: to the cell grown by their reach.
    fn gap_squared(&self, point: [f64; 3], cell: [i64; 3]) -> f64 {
        (0..3)
            .map(|i| {
                let lo = self.lo[i] + cell[i] as f64 * self.edge - self.reach;
                let hi = lo + self.edge + 2.0 * self.reach;
                (lo - point[i]).max(point[i] - hi).max(0.0).powi(2)
            })
            .sum::<f64>()
            // The bound itself is rounded: only cells that are further off without doubt are passed over.
            * (1.0 - 1e-9)
    }
}

/// The cells a level needs: the edge is doubled until there are no more than `limit`.
fn cells(lo: [f64; 3], hi: [f64; 3], mut edge: f64, limit: u64) -> (f64, [i64; 3]) {
    loop {
        let along: [f64; 3] = std::array::from_fn(|i| ((hi[i] - lo[i]) / edge).floor() + 1.0);
        if along.iter().product::<f64>() <= limit as f64 {
            return (edge, along.map(|n| n as i64));
        }
        edge *= 2.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn brute_force(vertices: &[[f32; 3]], triangles: &[[u32; 3]], p: [f64; 3]) -> f64 {
        let distance = |t: &[u32; 3]| Triangle::new(t.map(|v| vertices[v as usize].map(f64::from))).distance_squared(p);
        triangles.iter().map(distance).fold(f64::INFINITY, f64::min).sqrt()
    }

    fn soup() -> impl Strategy<Value = Vec<[f32; 3]>> {
        let corner = prop::array::uniform3(-1.0..1.0_f32);
        let triangle = (prop::array::uniform3(-20.0..20.0_f32), prop::array::uniform3(corner), 0..8_i32);
        let corners = triangle.prop_map(|(at, corners, size)| {
            corners.map(|c| std::array::from_fn(|i| at[i] + c[i] * 2.0_f32.powi(size - 4)))
        });
        prop::collection::vec(corners, 1..60).prop_map(|all| all.concat())
    }

    proptest! {
        #[test]
        fn agrees_with_brute_force(
            vertices in soup(),
            points in prop::collection::vec(prop::array::uniform3(-40.0..40.0_f64), 20),
            edge in 0.05..30.0_f64,
        ) {
            let triangles: Vec<[u32; 3]> = (0..vertices.len() as u32).step_by(3).map(|v| [v, v + 1, v + 2]).collect();
            let index = PatchIndex::new(&vertices, &triangles, edge);
            for &p in &points {
                prop_assert_eq!(index.nearest(p).unwrap().distance, brute_force(&vertices, &triangles, p));
            }
            let mean = points.iter().map(|&p| brute_force(&vertices, &triangles, p)).sum::<f64>() / 20.0;
            prop_assert!((index.hausdorff_from(points).unwrap().mean - mean).abs() < 1e-12);
        }
    }

    #[test]
    fn far_queries_and_flat_meshes() {
        let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
        let triangles = [[0, 1, 2], [1, 3, 2]];
        let index = PatchIndex::new(&vertices, &triangles, 1e-3);
        assert_eq!(index.nearest([1e12, 0.0, 0.0]).unwrap().distance, 1e12 - 1.0);
        assert_eq!(index.nearest([0.5, 0.5, 7.0]), Some(Nearest { distance: 7.0, triangle: 0 }));
        let found = index.hausdorff_from([[0.5, 0.5, 1.0], [0.5, 0.5, 3.0]]);
        assert_eq!(found, Some(Hausdorff { mean: 2.0, max: 3.0 }));
    }

    #[test]
    fn nothing_is_near_an_empty_mesh() {
        let index = PatchIndex::new(&[], &[], 1.0);
        assert_eq!(index.nearest([0.0; 3]), None);
        assert_eq!(index.hausdorff_from([[0.0; 3]]), None);
    }
}
