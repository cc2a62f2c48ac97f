//! Which closed pieces of a mesh are inside out, told by what they lie in.
//!
//! A piece that lies in no other must have its volume inside, else it is inside out. One that lies in another may be a
//! cavity, wound inwards, or a body, wound outwards; it is wrong where it would leave less than nothing inside: a winding
//! number below zero. What lies in a piece that was inside out is taken for cavities and bodies by turns.

use glam::DVec3;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::patches::Patches;
use crate::grid::TriangleMesh;
use crate::kernel::geometry::winding_number::WindingTree;

/// Volumes below this part of their box's are flat, with no inside to tell.
const FLAT: f64 = 1e-12;

/// A closed piece that has an inside.
struct Piece {
    patch: usize,
    volume: f64,
    lo: [f64; 3],
    hi: [f64; 3],
    /// The pieces that it lies in.
    around: Vec<u32>,
    /// How often what is inside is wound around, and whether the piece had to be turned for that.
    wound: i64,
    turned: bool,
    /// Whether the outermost piece around it was inside out, or itself where there is none around.
    alternates: bool,
}

/// Turns pieces that are inside out; how many closed pieces there are, and how many were turned.
pub(crate) fn turn_outside_out(mesh: &mut TriangleMesh, patches: &Patches) -> (u64, u64) {
    let mut pieces: Vec<Piece> = (0..patches.members.len())
        .filter(|&patch| patches.closed[patch])
        .filter_map(|patch| Piece::new(mesh, patch, &patches.members[patch]))
        .collect();
    find_around(mesh, patches, &mut pieces);
    let mut order: Vec<usize> = (0..pieces.len()).collect();
    order.sort_by_key(|&n| pieces[n].around.len());
    for n in order {
        decide(&mut pieces, n);
    }
    for piece in pieces.iter().filter(|piece| piece.turned) {
        for &triangle in &patches.members[piece.patch] {
            mesh.triangles[triangle as usize].swap(1, 2);
        }
    }
    (pieces.len() as u64, pieces.iter().filter(|piece| piece.turned).count() as u64)
}

/// Decides on a piece, those around it being decided.
fn decide(pieces: &mut [Piece], n: usize) {
    let outward = pieces[n].volume > 0.0;
    let depth = pieces[n].around.len();
    // The innermost of those around lies in all others.
    let parent = pieces[n].around.iter().copied().max_by_key(|&other| pieces[other as usize].around.len());
    let Some(parent) = parent else {
        (pieces[n].turned, pieces[n].alternates, pieces[n].wound) = (!outward, !outward, 1);
        return;
    };
    let (outside, alternates) = (pieces[parent as usize].wound, pieces[parent as usize].alternates);
    let is_body = if alternates { depth.is_multiple_of(2) } else { outward || outside <= 0 };
    let piece = &mut pieces[n];
    piece.turned = is_body != outward;
    piece.alternates = alternates;
    piece.wound = outside + if is_body { 1 } else { -1 };
}

impl Piece {
    /// The piece of these triangles; none where it is flat.
    fn new(mesh: &TriangleMesh, patch: usize, members: &[u32]) -> Option<Self> {
        let from = mesh.corners(*members.first()? as usize)[0];
        let (mut lo, mut hi, mut six) = (from, from, 0.0);
        for &n in members {
            let corners = mesh.corners(n as usize);
            for p in corners {
                for a in 0..3 {
                    lo[a] = lo[a].min(p[a]);
                    hi[a] = hi[a].max(p[a]);
                }
            }
            let [a, b, c] = corners.map(|p| DVec3::from(p) - DVec3::from(from));
            six += a.dot(b.cross(c));
        }
        let volume = six / 6.0;
        let of_box: f64 = (0..3).map(|a| hi[a] - lo[a]).product();
        (volume.abs() > FLAT * of_box && volume.is_finite()).then_some(Self {
            patch,
            volume,
            lo,
            hi,
            around: Vec::new(),
            wound: 0,
            turned: false,
            alternates: false,
        })
    }
}

/// Finds for each piece those that it lies in.
fn find_around(mesh: &TriangleMesh, patches: &Patches, pieces: &mut [Piece]) {
    let boxes = |n: usize| GeomWithData::new(Rectangle::from_corners(pieces[n].lo, pieces[n].hi), n as u32);
    let index = RTree::bulk_load((0..pieces.len()).map(boxes).collect());
    // What might lie in each, so that a tree is made once, and only where it is asked.
    let mut within: Vec<Vec<u32>> = vec![Vec::new(); pieces.len()];
    for (n, piece) in pieces.iter().enumerate() {
        for found in index.locate_in_envelope_intersecting(AABB::from_point(piece.lo)) {
            let other = &pieces[found.data as usize];
            let holds = (0..3).all(|a| other.lo[a] <= piece.lo[a] && piece.hi[a] <= other.hi[a]);
            if found.data as usize != n && holds && other.volume.abs() > piece.volume.abs() {
                within[found.data as usize].push(n as u32);
            }
        }
    }
    for (outer, inner) in within.into_iter().enumerate().filter(|(_, inner)| !inner.is_empty()) {
        let members = &patches.members[pieces[outer].patch];
        let vertices: Vec<[f64; 3]> = members.iter().flat_map(|&n| mesh.corners(n as usize)).collect();
        let triangles = (0..vertices.len() as u32).step_by(3).map(|v| [v, v + 1, v + 2]).collect();
        let tree = WindingTree::new(&TriangleMesh { vertices, triangles });
        for n in inner {
            if lies_in(mesh, &patches.members[pieces[n as usize].patch], &tree) {
                pieces[n as usize].around.push(outer as u32);
            }
        }
    }
}

/// Whether most of three triangles of a piece lie inside another.
fn lies_in(mesh: &TriangleMesh, members: &[u32], tree: &WindingTree) -> bool {
    let picked = [0, members.len() / 2, members.len() - 1].map(|n| mesh.corners(members[n] as usize));
    let is_inside = |[a, b, c]: &[[f64; 3]; 3]| {
        let middle = std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0);
        tree.winding_number(middle).abs() > 0.75
    };
    picked.iter().filter(|corners| is_inside(corners)).count() > 1
}
