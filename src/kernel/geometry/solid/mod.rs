//! What a triangle mesh bounds: [`Solid`] is the mesh as it is meant, with doubled triangles left out and all of it
//! turned outside out, and what had to be done for that.
//!
//! Three steps: `doubled` finds triangles that are there twice; `patches` lets triangles that meet at an edge agree on
//! what is outside; `nesting` tells of each closed piece whether it is a body, a cavity in one, or inside out.

mod doubled;
mod nesting;
mod patches;

use crate::grid::{BoundaryEdges, TriangleMesh};
use crate::kernel::surface::{Measures, SurfaceMeasure};
use patches::Patches;

/// A mesh as it is meant.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The vertices as they were; triangles in their order, counterclockwise when seen from outside as far as that can
    /// be told.
    pub mesh: TriangleMesh,
    /// For each vertex the lowest number of one at the same place.
    pub names: Vec<u32>,
    /// The edges of `mesh` that keep it from being the boundary of a solid.
    pub edges: BoundaryEdges,
    /// What was wrong with the mesh as it came.
    pub found: Faults,
}

/// What was wrong with a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// How far apart vertices may be that were taken for one; 0 where only equal ones were.
    pub welded_within: f64,
    /// Triangles that are there once more, with the same side outside.
    pub doubled: u64,
    /// Triangles of pieces of which every triangle is there with both sides outside.
    pub two_sided: u64,
    /// Edges whose triangles did not agree on what is outside.
    pub flipped_edges: u64,
    /// Triangles that were turned so that they do.
    pub turned: u64,
    /// Pieces that have no two sides, as a Klein bottle.
    pub one_sided: u64,
    /// Closed pieces that bound a body or a cavity, and those of them that were inside out.
    pub closed_pieces: u64,
    /// See `closed_pieces`.
    pub inverted: u64,
}

impl Solid {
    /// Looks a mesh over and puts right what can be.
    ///
    /// # Panics
    /// When a triangle names a vertex that does not exist; a mesh made by `TriangleMesh::new` has none.
    #[must_use]
    pub fn new(mut mesh: TriangleMesh) -> Self {
        let weld = mesh.weld();
        let names = weld.names;
        let mut found = Faults { welded_within: weld.within, ..Faults::default() };
        (found.doubled, found.two_sided) = doubled::leave_out(&mut mesh.triangles, &names);
        found.flipped_edges = mesh.edges_between(&names).flipped;
        let patches = Patches::new(&mesh.triangles, &names);
        (found.turned, found.one_sided) = patches.agree(&mut mesh.triangles);
        (found.closed_pieces, found.inverted) = nesting::turn_outside_out(&mut mesh, &patches);
        let edges = mesh.edges_between(&names);
        Self { mesh, names, edges, found }
    }

    /// Volume and area; `place` is where each vertex lies, as seen from a place near the mesh.
    #[must_use]
    pub fn measures(&self, place: impl Fn(u32) -> [f64; 3]) -> Measures {
        let mut measure = SurfaceMeasure::new([0.0; 3]);
        for triangle in &self.mesh.triangles {
            measure.add(triangle.map(|v| self.names[v as usize]), triangle.map(&place));
        }
        measure.measures()
    }
}

impl Faults {
    /// A sentence for each fault, without the name of the mesh.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        let mut all = Vec::new();
        if self.welded_within > 0.0 {
            all.push(format!("corners that differ by rounding, {:.1e} at most, are taken for one", self.welded_within));
        }
        if self.doubled > 0 {
            all.push(format!("{} triangles are there more than once; they are left out", self.doubled));
        }
        if self.two_sided > 0 {
            all.push(format!(
                "every triangle is there with both sides outside, as for drawing; {} are left out",
                self.two_sided
            ));
        }
        if self.flipped_edges > 0 {
            let rest = if self.turned > 0 {
                format!("; {} triangles are turned so that they agree", self.turned)
            } else {
                String::new()
            };
            all.push(format!("the triangles at {} edges disagree on what is outside{rest}", self.flipped_edges));
        }
        if self.one_sided > 0 {
            all.push(format!(
                "{} pieces have no two sides (like a Möbius strip): inside and outside mean nothing there",
                self.one_sided
            ));
        }
        if self.inverted > 0 && self.inverted == self.closed_pieces {
            all.push("all of it winds inwards: it is turned outside out, so that inside is what it encloses".into());
        } else if self.inverted > 0 {
            all.push(format!(
                "{} of {} closed pieces wind the wrong way round; they are turned, so that inside is what they enclose",
                self.inverted, self.closed_pieces
            ));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::DataSets;

    /// The surface of a box as twelve triangles, outward.
    fn cuboid(lo: [f64; 3], hi: [f64; 3]) -> TriangleMesh {
        let corner = |n: usize| std::array::from_fn(|a| if n >> a & 1 == 0 { lo[a] } else { hi[a] });
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        TriangleMesh::new((0..8).map(corner).collect(), triangles).unwrap()
    }

    fn cube(centre: f64, half: f64, inward: bool) -> TriangleMesh {
        let mut cube = cuboid([centre - half; 3], [centre + half; 3]);
        if inward {
            cube.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        cube
    }

    fn all(parts: &[TriangleMesh]) -> TriangleMesh {
        let mut sets = DataSets::default();
        for part in parts {
            sets.add_mesh(part);
        }
        sets.mesh
    }

    /// Sum of a . (b x c) / 6.
    fn volume(mesh: &TriangleMesh) -> f64 {
        let six = |[a, b, c]: [[f64; 3]; 3]| {
            a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        };
        (0..mesh.len()).map(|n| six(mesh.corners(n))).sum::<f64>() / 6.0
    }

    fn check(mesh: TriangleMesh, expected: f64) -> Faults {
        let solid = Solid::new(mesh);
        assert!((volume(&solid.mesh) - expected).abs() < 1e-9, "{}: {:?}", volume(&solid.mesh), solid.found);
        assert!(solid.edges.is_closed() && solid.edges.is_oriented(), "{:?}", solid.edges);
        // Done once it is done.
        assert_eq!(Solid::new(solid.mesh.clone()).mesh, solid.mesh);
        solid.found
    }

    #[test]
    fn bodies_and_cavities() {
        let sound = Faults { closed_pieces: 2, ..Faults::default() };
        assert_eq!(check(all(&[cube(0.0, 2.0, false), cube(0.0, 1.0, true)]), 56.0), sound);
        assert_eq!(check(all(&[cube(0.0, 2.0, false), cube(9.0, 1.0, false)]), 72.0), sound);
        // Two bodies that overlap are as they are.
        assert_eq!(check(all(&[cube(0.0, 2.0, false), cube(0.0, 1.0, false)]), 72.0), sound);
    }

    #[test]
    fn inverted_pieces_are_turned() {
        let inverted = |parts: &[TriangleMesh], volume: f64| check(all(parts), volume).inverted;
        assert_eq!(inverted(&[cube(0.0, 1.0, true)], 8.0), 1);
        assert_eq!(inverted(&[cube(0.0, 1.0, true), cube(9.0, 1.0, false)], 16.0), 1);
        // A hollow body, turned as a whole; one of which only the outer shell is.
        assert_eq!(inverted(&[cube(0.0, 2.0, true), cube(0.0, 1.0, false)], 56.0), 2);
        assert_eq!(inverted(&[cube(0.0, 2.0, true), cube(0.0, 1.0, true)], 56.0), 1);
        // An island in a cavity, in any order of the pieces.
        let shells = [cube(0.0, 1.0, true), cube(0.0, 3.0, false), cube(0.0, 2.0, true), cube(20.0, 1.0, false)];
        assert_eq!(inverted(&shells, 216.0 - 64.0 + 8.0 + 8.0), 1);
    }

    #[test]
    fn triangles_that_disagree_are_turned() {
        let mut mesh = cube(0.0, 1.0, false);
        mesh.triangles[5].swap(0, 1);
        let found = check(mesh.clone(), 8.0);
        assert_eq!((found.turned, found.flipped_edges, found.inverted), (1, 3, 0));
        mesh.triangles.iter_mut().step_by(2).for_each(|triangle| triangle.swap(0, 1));
        assert!(check(mesh, 8.0).turned > 0);
    }

    #[test]
    fn doubled_triangles_are_left_out() {
        let whole = cube(0.0, 1.0, false);
        let mut one = whole.clone();
        one.triangles.push([one.triangles[3][1], one.triangles[3][2], one.triangles[3][0]]);
        assert_eq!(check(one, 8.0).doubled, 1);
        assert_eq!(check(all(&[whole.clone(), whole.clone(), whole.clone()]), 8.0).doubled, 24);
        let found = check(all(&[cube(0.0, 1.0, true), whole.clone()]), 8.0);
        assert_eq!((found.doubled, found.two_sided), (0, 12));
        // Two bodies that share a wall keep both sides of it, also where they are inside out.
        let mut two = all(&[whole, cuboid([1.0, -1.0, -1.0], [2.0, 1.0, 1.0])]);
        assert_eq!(check(two.clone(), 12.0), Faults { closed_pieces: 1, ..Faults::default() });
        two.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        assert_eq!(check(two, 12.0).inverted, 1);
    }

    #[test]
    fn strips_without_two_sides_are_told() {
        // A Möbius strip of an odd number of quads.
        let n = 9_u32;
        let place = |i: u32, side: f64| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            let (half, width) = (angle / 2.0, 0.3 * side);
            let out = 1.0 + width * half.cos();
            [out * angle.cos(), out * angle.sin(), width * half.sin()]
        };
        let vertices: Vec<[f64; 3]> = (0..n).flat_map(|i| [place(i, -1.0), place(i, 1.0)]).collect();
        let name = |i: u32, side: u32| if i < n { 2 * i + side } else { 1 - side };
        let triangles = (0..n).flat_map(|i| {
            let [a, b, c, d] = [name(i, 0), name(i, 1), name(i + 1, 0), name(i + 1, 1)];
            [[a, c, b], [b, c, d]]
        });
        let solid = Solid::new(TriangleMesh::new(vertices, triangles.collect()).unwrap());
        assert_eq!((solid.found.one_sided, solid.found.closed_pieces, solid.found.inverted), (1, 0, 0));
        assert!(solid.edges.open > 0);
    }
}
