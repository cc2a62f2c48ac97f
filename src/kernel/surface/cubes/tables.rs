//! The 256 cases of marching cubes (Lorensen and Cline 1987), derived instead of listed.
//!
//! Walk around each face of the cell, counter-clockwise as seen from outside: every run of inside corners is cut
//! off by one segment, from the edge that enters the run to the edge that leaves it. This looks at the four
//! signs of the face alone (on a face with two opposite inside corners it separates them), and the cell behind
//! the face walks it the other way round: so the two cells draw the same segments in opposite directions, and
//! no crack can open. An edge that crosses the surface enters a run on one of its two faces and leaves one on the
//! other; the segments therefore chain into closed loops, which are cut into triangles.
//!
//! A diagonal must not lie in a face of the cell: the cell behind that face might draw it too, and four triangles would
//! meet there. Of the cuts that are left, a case takes the one that encloses, with vertices half way, most nearly an
//! eighth of the cell for each inside corner: the surface of labels then has the volume of their voxels. On loops
//! without an ambiguous face these are the classic table's cuts.
//!
//! Corner c of a cell lies at bits (x, y, z) = (c & 1, c >> 1 & 1, c >> 2). Edge e lies along axis e / 4; the two low
//! bits of e place it along the next two axes in the cycle x, y, z.

use std::sync::LazyLock;

/// The triangles of one case, their corners as edge numbers 0..12, oriented from inside to outside.
pub(crate) type Case = Vec<[u8; 3]>;

/// The triangles of every case; bit c of a case is set where corner c is inside.
pub(crate) static CASES: LazyLock<[Case; 256]> = LazyLock::new(|| std::array::from_fn(|case| triangles(case as u8)));

/// The axis an edge lies along.
pub(crate) const fn axis_of(edge: u8) -> usize {
    (edge / 4) as usize
}

/// The corner at the lower end of an edge.
pub(crate) const fn lower_corner(edge: u8) -> u8 {
    let axis = axis_of(edge);
    ((edge & 1) << ((axis + 1) % 3)) | ((edge >> 1 & 1) << ((axis + 2) % 3))
}

/// The edge between two neighbouring corners.
const fn edge_between(a: u8, b: u8) -> u8 {
    let axis = (a ^ b).trailing_zeros() as u8;
    let lower = a & b;
    4 * axis + (lower >> ((axis + 1) % 3) & 1) + 2 * (lower >> ((axis + 2) % 3) & 1)
}

/// The corners of each face, counter-clockwise as seen from outside the cell.
fn faces() -> [[u8; 4]; 6] {
    std::array::from_fn(|face| {
        let (axis, upper) = (face / 2, face % 2 == 1);
        let (right, up) = ((axis + 1) % 3, (axis + 2) % 3);
        let base = u8::from(upper) << axis;
        let cycle = [0, 1 << right, (1 << right) | (1 << up), 1 << up].map(|corner: u8| base | corner);
        if upper { cycle } else { [cycle[3], cycle[2], cycle[1], cycle[0]] }
    })
}

/// True when the edges border a common face, so that a line between them lies in that face.
fn share_face(a: u8, b: u8) -> bool {
    let ends = |edge: u8| [lower_corner(edge), lower_corner(edge) | 1 << axis_of(edge)];
    let (a, b) = (ends(a), ends(b));
    (0..3).any(|axis| [0, 1].iter().any(|&side| a.iter().chain(&b).all(|corner| corner >> axis & 1 == side)))
}

/// For each crossed edge the edge that follows it on its loop.
fn segments(case: u8) -> [Option<u8>; 12] {
    let inside = |corner: u8| case >> corner & 1 == 1;
    let mut next = [None; 12];
    for face in faces() {
        for start in (0..4).filter(|&i| inside(face[i]) && !inside(face[(i + 3) % 4])) {
            let end = (start..start + 4).take_while(|&i| inside(face[i % 4])).last().unwrap_or(start);
            let enter = edge_between(face[(start + 3) % 4], face[start]);
            next[enter as usize] = Some(edge_between(face[end % 4], face[(end + 1) % 4]));
        }
    }
    next
}

/// The closed loops of crossed edges, each once.
fn loops(case: u8) -> Vec<Vec<u8>> {
    let mut next = segments(case);
    let mut all = Vec::new();
    for first in 0..12 {
        let mut chain = Vec::new();
        let mut edge = first;
        while let Some(following) = next[edge as usize].take() {
            chain.push(edge);
            edge = following;
        }
        if !chain.is_empty() {
            all.push(chain);
        }
    }
    all
}

/// All ways to cut a loop into triangles with diagonals that run through the inside of the cell.
fn cuts(chain: &[u8]) -> Vec<Case> {
    let (first, last) = (chain[0], chain[chain.len() - 1]);
    let mut found = if chain.len() < 3 { vec![Case::new()] } else { Vec::new() };
    for apex in 1..chain.len() - 1 {
        let is_side = |a: usize, b: usize| b == a + 1;
        let crosses_face = |a: usize, b: usize| !is_side(a, b) && share_face(chain[a], chain[b]);
        if crosses_face(0, apex) || crosses_face(apex, chain.len() - 1) {
            continue;
        }
        for before in cuts(&chain[..=apex]) {
            for after in cuts(&chain[apex..]) {
                found.push([before.as_slice(), &after, &[[first, chain[apex], last]]].concat());
            }
        }
    }
    found
}

/// The middle of an edge as seen from the cell's centre, in halves of the cell.
fn middle(edge: u8) -> [i32; 3] {
    let corner = lower_corner(edge);
    std::array::from_fn(|a| if a == axis_of(edge) { 0 } else { 2 * i32::from(corner >> a & 1) - 1 })
}

/// How far the volume enclosed by triangles is from an eighth of the cell for each inside corner, in parts of 1/48.
fn off_volume(case: u8, triangles: &[[u8; 3]]) -> i32 {
    // Pyramids from the centre: those over the faces' inside parts, in eighths of a face, and those over the triangles.
    let inside = |corner: u8| i32::from(case >> corner & 1);
    let part = |face: [u8; 4]| -> i32 {
        let count: i32 = face.iter().map(|&corner| inside(corner)).sum();
        let is_separated = count == 2 && inside(face[0]) == inside(face[2]);
        if is_separated { 2 } else { [0, 1, 4, 7, 8][count as usize] }
    };
    let over_faces: i32 = faces().into_iter().map(part).sum();
    let over_triangle = |corners: &[u8; 3]| {
        let [a, b, c] = corners.map(middle);
        let minor = |m: usize, n: usize| b[m] * c[n] - b[n] * c[m];
        a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1)
    };
    let over_triangles: i32 = triangles.iter().map(over_triangle).sum();
    (over_faces + over_triangles - 6 * case.count_ones() as i32).abs()
}

/// The squared lengths of all sides of the triangles.
fn sides(triangles: &[[u8; 3]]) -> i32 {
    let side = |a: u8, b: u8| (0..3).map(|n| (middle(a)[n] - middle(b)[n]).pow(2)).sum::<i32>();
    triangles.iter().map(|&[a, b, c]| side(a, b) + side(b, c) + side(c, a)).sum()
}

/// The best cut of a case; of equal ones that with the shortest diagonals.
fn triangles(case: u8) -> Case {
    let mut all = vec![Case::new()];
    for chain in loops(case) {
        let cuts = cuts(&chain);
        all = all.iter().flat_map(|one| cuts.iter().map(move |cut| [one.as_slice(), cut].concat())).collect();
    }
    all.into_iter().min_by_key(|one| (off_volume(case, one), sides(one))).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_corner_gives_one_outward_triangle() {
        // Edges 0, 4, 8 run from corner 0 along x, y, z: seen from (1, 1, 1) that order is counter-clockwise.
        let mut triangle = CASES[1].clone();
        let first = triangle[0].iter().position(|&e| e == 0).unwrap();
        triangle[0].rotate_left(first);
        assert_eq!(triangle, [[0, 4, 8]]);
        assert!(CASES[0].is_empty() && CASES[255].is_empty());
    }

    #[test]
    fn triangles_touch_exactly_the_crossed_edges() {
        for (case, triangles) in CASES.iter().enumerate() {
            for edge in 0..12 {
                let low = lower_corner(edge);
                let high = low | 1 << axis_of(edge);
                assert_eq!(edge_between(low, high), edge);
                let is_crossed = (case >> low & 1) != (case >> high & 1);
                assert_eq!(triangles.iter().flatten().any(|&e| e == edge), is_crossed, "case {case}, edge {edge}");
            }
            assert!(triangles.len() <= 5, "the classic tables need no more than five triangles either");
        }
    }

    #[test]
    fn borders_of_a_case_lie_in_faces_and_inner_edges_are_matched() {
        for (case, triangles) in CASES.iter().enumerate() {
            let directed: Vec<_> = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
            for &(a, b) in &directed {
                assert_eq!(directed.iter().filter(|&&e| e == (a, b)).count(), 1, "case {case}");
                assert_ne!(directed.contains(&(b, a)), share_face(a, b), "case {case}: {a} {b}");
            }
        }
    }
}
