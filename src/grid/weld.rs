//! `Weld`: which vertices of a mesh are one place, also where they differ by rounding.
//!
//! Files without shared vertices (STL) give a corner as often as triangles have it, and programs that compute it anew for
//! each come to values that differ in the last digits. Vertices of equal coordinates are one. Where sides of triangles
//! still find no partner, the ends of these, and no others, are joined within a tolerance: first the rounding of f64, then
//! that of the numbers as they were written. The first that leaves no side alone is taken, else the one that leaves the
//! fewest. So a body that is closed is never changed, however thin; and a side that has a length keeps it.

use std::collections::HashMap;

use super::TriangleMesh;

/// Rounding of f64 in a computation of some steps, in units of the largest coordinate.
const FINE: f64 = 1e-12;

/// So many coordinates are looked at to tell how many digits they have.
const SAMPLE: usize = 3000;

/// Names for the places of a mesh's vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weld {
    /// For each vertex the lowest number of a vertex at the same place.
    pub names: Vec<u32>,
    /// How far apart vertices may be that are taken for one; 0 where only equal ones are.
    pub within: f64,
}

impl Weld {
    /// Joins the vertices of a mesh.
    #[must_use]
    pub(super) fn new(mesh: &TriangleMesh) -> Self {
        let exact = equal_places(&mesh.vertices);
        let mut open = open_sides(&mesh.triangles, &exact);
        if open.is_empty() {
            return Self { names: exact, within: 0.0 };
        }
        let corners = mesh.triangles.iter().flatten().flat_map(|&v| mesh.vertices[v as usize]);
        let largest = corners.fold(0.0_f64, |most, x| most.max(x.abs()));
        let mut ends: Vec<u32> = open.iter().flat_map(|&(a, b)| [a, b]).collect();
        ends.sort_unstable();
        ends.dedup();
        let mut best = Self { names: exact.clone(), within: 0.0 };
        let rims = open.clone();
        for within in [FINE * largest, written_rounding(&mesh.vertices, largest)] {
            let joined = joined_within(&mesh.vertices, &ends, within);
            let at = |v: u32| mesh.vertices[v as usize];
            let name = |v: u32| joined.get(&v).copied().unwrap_or(v);
            let shrinks = |&(a, b): &(u32, u32)| name(a) == name(b) && distance(at(a), at(b)) > FINE * largest;
            if rims.iter().any(shrinks) {
                continue;
            }
            let names: Vec<u32> = exact.iter().map(|&v| name(v)).collect();
            let left = open_sides(&mesh.triangles, &names);
            if left.len() < open.len() {
                (open, best) = (left, Self { names, within });
            }
            if open.is_empty() {
                break;
            }
        }
        best
    }
}

/// For each vertex the lowest number of a vertex with the same coordinates.
fn equal_places(vertices: &[[f64; 3]]) -> Vec<u32> {
    // Adding 0 makes one of the two zeros, which are equal but have different bits.
    let key = |v: u32| vertices[v as usize].map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (key(v), v));
    let mut names = vec![0; order.len()];
    for same in order.chunk_by(|&a, &b| key(a) == key(b)) {
        for &v in same {
            names[v as usize] = same[0];
        }
    }
    names
}

/// The sides that an odd number of triangles have, by the names of their ends.
fn open_sides(triangles: &[[u32; 3]], names: &[u32]) -> Vec<(u32, u32)> {
    let mut sides = Vec::with_capacity(3 * triangles.len());
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| names[v as usize]);
        sides.extend([(a, b), (b, c), (c, a)].into_iter().filter(|(a, b)| a != b).map(|(a, b)| (a.min(b), a.max(b))));
    }
    sides.sort_unstable();
    sides.chunk_by(|a, b| a == b).filter(|same| same.len() % 2 == 1).map(|same| same[0]).collect()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).fold(0.0_f64, |most, i| most.max((a[i] - b[i]).abs()))
}

/// For each of these vertices the lowest of them within a distance of it that stands for itself.
///
/// The vertices that stand for others lie farther apart than that, so that a cube of it holds few of them, and nothing
/// creeps from neighbour to neighbour.
fn joined_within(vertices: &[[f64; 3]], ascending: &[u32], within: f64) -> HashMap<u32, u32> {
    let mut cubes: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut names = HashMap::with_capacity(ascending.len());
    if !(within > 0.0 && within.is_finite()) {
        return names;
    }
    for &v in ascending {
        let place = vertices[v as usize];
        let cube = place.map(|x| (x / within).floor() as i64);
        let near = |step: usize| {
            let beside: [i64; 3] =
                std::array::from_fn(|a| cube[a].saturating_add((step / 3_usize.pow(a as u32) % 3) as i64 - 1));
            let close = |&&other: &&u32| distance(vertices[other as usize], place) <= within;
            cubes.get(&beside).and_then(|held| held.iter().filter(close).min().copied())
        };
        let name = (0..27).filter_map(near).min();
        names.insert(v, name.unwrap_or(v));
        if name.is_none() {
            cubes.entry(cube).or_default().push(v);
        }
    }
    names
}

/// How far equal places may lie apart by the rounding with which coordinates were written: f32, or so many decimals.
fn written_rounding(vertices: &[[f64; 3]], largest: f64) -> f64 {
    let single = 4.0 * f64::from(f32::EPSILON) * largest;
    let step = (3 * vertices.len()).div_ceil(SAMPLE).max(1);
    let sample: Vec<f64> = vertices.iter().flatten().copied().step_by(step).collect();
    if sample.iter().all(|&x| f64::from(x as f32) == x) {
        return single;
    }
    let has_digits = |digits: usize| {
        sample.iter().all(|&x| format!("{x:.*e}", digits - 1).parse::<f64>().is_ok_and(|rounded| rounded == x))
    };
    // The first place of the largest coordinate, which has the coarsest last digit.
    let leading = libm::pow(10.0, libm::floor(libm::log10(largest)));
    match (1..16).find(|&digits| has_digits(digits)) {
        // Round numbers tell nothing of the digits that were to be had; nine digits are what f32 is written with.
        Some(1..=5 | 8 | 9) => single,
        Some(digits) => 1.5 * leading * libm::pow(10.0, 1.0 - digits as f64),
        None => 4.0 * f64::EPSILON * largest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of these sides as triangles with corners of their own, each moved by what `noise` says; without the two
    /// triangles of its last side where it is `open`.
    fn soup(sides: [f64; 3], open: bool, noise: impl Fn(usize) -> f64) -> TriangleMesh {
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = if open { &quads[1..] } else { &quads[..] };
        let names = faces.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]);
        let corner = |n: usize| -> [f64; 3] { std::array::from_fn(|a| if n >> a & 1 == 0 { 0.0 } else { sides[a] }) };
        let vertices: Vec<[f64; 3]> = names.enumerate().map(|(n, name)| corner(name).map(|x| x + noise(n))).collect();
        let triangles = (0..vertices.len() as u32).step_by(3).map(|v| [v, v + 1, v + 2]).collect();
        TriangleMesh::new(vertices, triangles).unwrap()
    }

    fn open(mesh: &TriangleMesh) -> u64 {
        mesh.boundary_edges().open
    }

    #[test]
    fn rounding_of_any_width_closes_a_box() {
        assert_eq!((open(&soup([1.0, 2.0, 3.0], false, |_| 0.0)), open(&soup([1.0, 2.0, 3.0], true, |_| 0.0))), (0, 4));
        let noisy = |size: f64| move |n: usize| size * ((n * 7919 % 13) as f64 / 6.0 - 1.0);
        // Of f64; of f32, as far as that has it; of six decimals.
        let fine = soup([1.0, 2.0, 3.0], false, noisy(1e-15));
        let mut single = soup([1.0, 2.0, 3.0], false, noisy(1e-7));
        single.vertices.iter_mut().flatten().for_each(|x| *x = f64::from(*x as f32));
        let mut decimal = soup([1.234_567_5, 2.345_678_5, 3.0], false, noisy(4e-7));
        decimal.vertices.iter_mut().flatten().for_each(|x| *x = format!("{x:.6}").parse().unwrap());
        for mesh in [&fine, &single, &decimal] {
            let weld = mesh.weld();
            assert!(open(mesh) == 0 && weld.within > 0.0, "{:?}", weld.within);
            let mut names = weld.names;
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), 8);
        }
        // Noise wider than the numbers' own rounding is a gap.
        assert!(open(&soup([1.0, 2.0, 3.0], false, noisy(1e-5))) > 0);
    }

    #[test]
    fn thin_bodies_stay_open_where_they_are() {
        for thickness in [1e-3, 1e-5, 1e-6, 3e-7, 1e-9] {
            let plate = soup([thickness, 1.0, 1.0], false, |_| 0.0);
            assert_eq!((open(&plate), plate.weld().within), (0, 0.0), "{thickness}");
            // Without a narrow side: its rim has sides as short as the plate is thick.
            for sides in [[1.0, thickness, 1.0], [1.0, 1.0, thickness]] {
                assert_eq!(open(&soup(sides, true, |_| 0.0)), 4, "{thickness}");
            }
        }
    }

    #[test]
    fn vertices_that_no_open_side_has_are_left_alone() {
        let mut mesh = soup([1.0; 3], true, |_| 0.0);
        mesh.vertices.extend([[1e-14, 0.0, 0.0], [0.5; 3]]);
        assert_eq!(mesh.weld().names[30..], [30, 31]);
    }
}
