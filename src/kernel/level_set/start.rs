//! The start of the time loop on one brick (algorithms: section 5, "Initial condition", "Narrow band").
//!
//! u = 0 where the flood reaches at threshold beta, 1 elsewhere. Solved are the voxels within `inner` of the cloud on
//! the inside and within `outer` on the outside; all others keep their start value. Comparisons alone, voxel by voxel,
//! so the result does not depend on how the volume is divided. No halo, no work buffers.
//!
//! Bricks are dense `[z][y][x]` with row length and plane height `edge`; `valid` voxels along each axis are inside the
//! domain. `d` is the distance to the cloud, `b` the flood's level; both f32, physical lengths.

/// How far the band reaches, and where the start surface lies. Physical lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaches {
    /// The start surface lies at this distance outside of the cloud.
    pub beta: f32,
    /// The band's reach on the inside.
    pub inner: f32,
    /// The band's reach on the outside.
    pub outer: f32,
}

impl Reaches {
    /// The start value of a voxel.
    #[inline]
    #[must_use]
    pub fn start(&self, b: f32) -> f32 {
        if b >= self.beta { 0.0 } else { 1.0 }
    }

    /// True for voxels that are solved.
    #[inline]
    #[must_use]
    pub fn solves(&self, d: f32, b: f32) -> bool {
        d <= if b >= self.beta { self.outer } else { self.inner }
    }
}

/// The start values of a brick.
pub fn fill(b: &[f32], reaches: &Reaches, u: &mut [f32]) {
    u.iter_mut().zip(b).for_each(|(u, &b)| *u = reaches.start(b));
}

/// Sets 1 at voxels of the domain that are solved, 0 elsewhere; returns how many there are.
pub fn mark(d: &[f32], b: &[f32], edge: usize, valid: [usize; 3], reaches: &Reaches, solved: &mut [u8]) -> u64 {
    solved.fill(0);
    let mut count = 0;
    for row in rows(edge, valid) {
        for place in row {
            solved[place] = u8::from(reaches.solves(d[place], b[place]));
            count += u64::from(solved[place]);
        }
    }
    count
}

/// The first and last place along x, y, z of solved voxels, or none when nothing is solved.
#[must_use]
pub fn hull(d: &[f32], b: &[f32], edge: usize, valid: [usize; 3], reaches: &Reaches) -> Option<[[usize; 2]; 3]> {
    let mut hull: Option<[[usize; 2]; 3]> = None;
    for place in rows(edge, valid).flatten().filter(|&place| reaches.solves(d[place], b[place])) {
        let at = [place % edge, place / edge % edge, place / (edge * edge)];
        let hull = hull.get_or_insert(at.map(|v| [v, v]));
        (0..3).for_each(|a| hull[a] = [hull[a][0].min(at[a]), hull[a][1].max(at[a])]);
    }
    hull
}

/// The places of each row inside the domain.
fn rows(edge: usize, valid: [usize; 3]) -> impl Iterator<Item = std::ops::Range<usize>> {
    let starts = (0..valid[2]).flat_map(move |z| (0..valid[1]).map(move |y| (z * edge + y) * edge));
    starts.map(move |start| start..start + valid[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGE: usize = 4;
    const REACHES: Reaches = Reaches { beta: 1.0, inner: 2.0, outer: 3.0 };

    /// A distance and a level in one brick: inside (b = 0) at first, outside from z = 2 on.
    fn fields() -> ([f32; 64], [f32; 64]) {
        let d = std::array::from_fn(|n| 0.5 * (n % EDGE + n / EDGE % EDGE) as f32 + 0.5);
        (d, std::array::from_fn(|n| if n < 32 { 0.0 } else { 1.0 }))
    }

    #[test]
    fn the_threshold_itself_is_outside() {
        let (_, b) = fields();
        let mut u = [9.0; 64];
        fill(&b, &REACHES, &mut u);
        assert!(u[..32].iter().all(|&u| u == 1.0) && u[32..].iter().all(|&u| u == 0.0));
    }

    #[test]
    fn each_side_has_its_reach_and_the_domain_its_end() {
        let (d, b) = fields();
        let mut solved = [7; 64];
        // x + y <= 3 inside, x + y <= 5 outside; of 3 x 4 x 3 voxels.
        let count = mark(&d, &b, EDGE, [3, 4, 3], &REACHES, &mut solved);
        let wanted = |n: usize| {
            let [x, y, z] = [n % EDGE, n / EDGE % EDGE, n / 16];
            x < 3 && z < 3 && x + y <= if z < 2 { 3 } else { 5 }
        };
        assert!((0..64).all(|n| solved[n] == u8::from(wanted(n))), "{solved:?}");
        assert_eq!(count, 2 * (3 + 3 + 2 + 1) + 12);
    }

    #[test]
    fn hulls_hold_what_is_solved_and_no_more() {
        let (d, b) = fields();
        assert_eq!(hull(&d, &b, EDGE, [3, 4, 3], &REACHES), Some([[0, 2], [0, 3], [0, 2]]));
        let near = Reaches { beta: 1.0, inner: 0.0, outer: 0.5 };
        assert_eq!(hull(&d, &b, EDGE, [4; 3], &near), Some([[0, 0], [0, 0], [2, 3]]));
        assert_eq!(hull(&d, &b, EDGE, [4, 4, 2], &near), None);
    }
}
