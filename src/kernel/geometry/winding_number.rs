//! Generalised winding number of a triangle mesh (Jacobson, Kavan & Sorkine-Hornung 2013, doi:10.1145/2461912.2461916)
//! by a hierarchy with the dipole approximation (Barill, Dickson, Schmidt, Levin & Jacobson 2018,
//! doi:10.1145/3197517.3201337).
//!
//! w(q) is the sum over triangles of the signed solid angle under which q sees them, over 4 pi (van Oosterom & Strackee
//! 1983). For a closed outward mesh it is 1 inside and 0 outside, and falls off smoothly across the holes of an open
//! one; w > 1/2 is the usual rule for inside. Triangles far away, as a group, act like dipoles about their middle: with
//! p their area-weighted centre, r = p - q, n the normal, d = x - p, and integrals over the group N = int n, C = int d
//! (x) n, Q(r) = int (d . r)^2 (n . r), V = int |d|^2 n + 2 (d . n) d, to the second order
//!
//! ```text
//! 4 pi w ~ (N . r + trace C) / |r|^3 - (3 r^T C r + 3/2 V . r) / |r|^5 + 15/2 Q(r) / |r|^7
//! ```
//!
//! wherever |r| > beta times the group's radius; the error falls with the cube of radius / |r| and stayed below 0.01
//! in all tests. In: world positions, f64. Sums are made in the order of the hierarchy, which depends on the mesh
//! alone. A query costs about the logarithm of the number of triangles; the hierarchy takes some 150 bytes a triangle.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use crate::grid::TriangleMesh;

/// A group is taken as a dipole from this many of its radii on (Barill et al. 2018 use 2).
const BETA: f64 = 2.5;

/// Groups of no more triangles than this are leaves.
const LEAF: usize = 8;

/// The triangles of a mesh as a hierarchy of groups, ready to be asked for winding numbers.
#[derive(Clone, Debug)]
pub struct WindingTree {
    /// Depth first: the first of a group's two halves follows it.
    groups: Vec<Group>,
    /// Corners of the triangles, in the order of the leaves.
    triangles: Vec<[[f64; 3]; 3]>,
}

/// Integrals over a group's triangles, about its centre, as the head of this file names them.
#[derive(Clone, Debug)]
struct Moments {
    /// N.
    normal: DVec3,
    /// C; rows are offsets.
    linear: DMat3,
    /// V.
    vector: DVec3,
    /// Q, by its coefficients of x^2 (x, y, z), y^2 (x, y, z), z^2 (x, y, z) and of x y z.
    cubic: ([DVec3; 3], f64),
}

#[derive(Clone, Debug)]
struct Group {
    /// Area-weighted centre of the triangles.
    centre: DVec3,
    /// The squared distance from the centre beyond which the group is a dipole.
    far: f64,
    moments: Moments,
    /// The triangles of a leaf; none where halves follow.
    leaf: std::ops::Range<u32>,
    /// The group after this one and all within it.
    next: u32,
}

impl WindingTree {
    /// Sorts the triangles of a mesh into groups, halved at the median of their centres along the longest extent.
    ///
    /// # Panics
    /// When a triangle names a vertex that does not exist; a mesh made by `TriangleMesh::new` has none.
    #[must_use]
    pub fn new(mesh: &TriangleMesh) -> Self {
        let mut triangles: Vec<_> = (0..mesh.len()).map(|n| Member::new(n as u32, mesh.corners(n))).collect();
        let mut tree = Self { groups: Vec::new(), triangles: Vec::with_capacity(mesh.len()) };
        if !triangles.is_empty() {
            tree.add(&mut triangles);
        }
        tree
    }

    /// Bytes of the tree of a mesh of so many triangles, and of the list that it is made from: groups are halved until they
    /// have a leaf's triangles or fewer, so that a leaf has more than half as many.
    #[must_use]
    pub fn bytes(triangles: u64) -> u64 {
        let groups = 2 * triangles.div_ceil(LEAF as u64 / 2);
        triangles * (size_of::<Member>() + size_of::<[[f64; 3]; 3]>()) as u64 + groups * size_of::<Group>() as u64
    }

    /// The winding number of the mesh about a finite world position `[x, y, z]`; the mean of both sides' on a triangle.
    #[must_use]
    pub fn winding_number(&self, point: [f64; 3]) -> f64 {
        let mut sum = 0.0;
        let mut at = 0;
        while let Some(group) = self.groups.get(at) {
            let r = group.centre - DVec3::from(point);
            let squared = r.length_squared();
            at = if squared > group.far {
                sum += group.moments.solid_angle(r, squared);
                group.next as usize
            } else {
                let leaf = &self.triangles[group.leaf.start as usize..group.leaf.end as usize];
                sum = leaf.iter().fold(sum, |sum, &corners| sum + solid_angle(corners, point));
                at + 1
            };
        }
        sum / (4.0 * PI)
    }

    /// Adds the group of these triangles and all groups within it.
    fn add(&mut self, members: &mut [Member]) {
        let place = self.groups.len();
        let start = self.triangles.len() as u32;
        self.groups.push(Group::of(members));
        if members.len() <= LEAF {
            self.triangles.extend(members.iter().map(|member| member.corners));
            self.groups[place].leaf = start..self.triangles.len() as u32;
        } else {
            let middle = members.len() / 2;
            let axis = longest_axis(members);
            members.select_nth_unstable_by(middle, |a, b| {
                a.centre[axis].total_cmp(&b.centre[axis]).then(a.index.cmp(&b.index))
            });
            let (below, above) = members.split_at_mut(middle);
            // Selection leaves each half in an order of its own making; sums go by the index.
            below.sort_unstable_by_key(|member| member.index);
            above.sort_unstable_by_key(|member| member.index);
            self.add(below);
            self.add(above);
        }
        self.groups[place].next = self.groups.len() as u32;
    }
}

/// A triangle while the hierarchy is made.
#[derive(Clone, Debug)]
struct Member {
    index: u32,
    corners: [[f64; 3]; 3],
    centre: DVec3,
    /// Half the product of two sides: normal to the triangle, as long as its area.
    area: DVec3,
}

impl Member {
    fn new(index: u32, corners: [[f64; 3]; 3]) -> Self {
        let [a, b, c] = corners.map(DVec3::from);
        Self { index, corners, centre: (a + b + c) / 3.0, area: (b - a).cross(c - a) / 2.0 }
    }
}

impl Group {
    fn of(members: &[Member]) -> Self {
        let centre = weighted_centre(members);
        let (mut moments, mut radius) = (Moments::NONE, 0.0_f64);
        for member in members {
            let corners = member.corners.map(|corner| DVec3::from(corner) - centre);
            moments.add(corners, member.area);
            radius = corners.iter().fold(radius, |radius, arm| radius.max(arm.length_squared()));
        }
        Self { centre, far: BETA * BETA * radius, moments, leaf: 0..0, next: 0 }
    }
}

impl Moments {
    const NONE: Self =
        Self { normal: DVec3::ZERO, linear: DMat3::ZERO, vector: DVec3::ZERO, cubic: ([DVec3::ZERO; 3], 0.0) };

    /// Adds a triangle of these corners, seen from the centre, and this area vector.
    fn add(&mut self, [a, b, c]: [DVec3; 3], n: DVec3) {
        let sum = a + b + c;
        // The means of d and of d (x) d over the triangle.
        let mean = sum / 3.0;
        let row = |i: usize| (a * a[i] + b * b[i] + c * c[i] + sum * sum[i]) / 12.0;
        let m = DMat3::from_cols(row(0), row(1), row(2));
        self.normal += n;
        self.vector += trace(&m) * n + 2.0 * (m * n);
        self.linear += DMat3::from_cols(mean * n.x, mean * n.y, mean * n.z);
        for i in 0..3 {
            let mut mixed = 2.0 * m.col(i) * n[i];
            mixed[i] = 0.0;
            self.cubic.0[i] += m.col(i)[i] * n + mixed;
        }
        self.cubic.1 += 2.0 * (m.x_axis.y * n.z + m.y_axis.z * n.x + m.z_axis.x * n.y);
    }

    /// The solid angle from afar; `r` points from the query to the centre, `squared` is its squared length.
    fn solid_angle(&self, r: DVec3, squared: f64) -> f64 {
        let (squares, product) = &self.cubic;
        let rows = [0, 1, 2].map(|i| r[i] * r[i] * squares[i].dot(r));
        let cubic = rows[0] + rows[1] + rows[2] + product * r.x * r.y * r.z;
        let second = 3.0 * r.dot(self.linear * r) + 1.5 * self.vector.dot(r);
        (self.normal.dot(r) + trace(&self.linear) + (7.5 * cubic / squared - second) / squared)
            / (squared * squared.sqrt())
    }
}

fn trace(m: &DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}

/// The centre of the triangles weighted by area, or of their centres where none has an area.
fn weighted_centre(members: &[Member]) -> DVec3 {
    let total = |weight: fn(&Member) -> f64| {
        members.iter().fold((DVec3::ZERO, 0.0), |(sum, all), member| {
            let w = weight(member);
            (sum + w * member.centre, all + w)
        })
    };
    let (mut sum, mut all) = total(|member| member.area.length());
    if all <= 0.0 {
        (sum, all) = total(|_| 1.0);
    }
    sum / all
}

/// The axis along which the centres extend furthest.
fn longest_axis(members: &[Member]) -> usize {
    let extent = |axis: usize| {
        let along = members.iter().map(|member| member.centre[axis]);
        let (lo, hi) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        hi - lo
    };
    (1..3).fold(0, |longest, axis| if extent(axis) > extent(longest) { axis } else { longest })
}

/// The signed solid angle under which a point sees a triangle (van Oosterom & Strackee 1983,
/// doi:10.1109/TBME.1983.325207), positive from behind: from where its corners turn clockwise. 0 in the triangle's
/// plane.
#[must_use]
pub fn solid_angle(corners: [[f64; 3]; 3], point: [f64; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| DVec3::from(corner) - DVec3::from(point));
    let determinant = a.dot(b.cross(c));
    if determinant == 0.0 {
        // Within the triangle the angle jumps between plus and minus 2 pi: this is the mean.
        return 0.0;
    }
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    2.0 * libm::atan2(determinant, la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_octant_is_an_eighth_of_the_sphere() {
        let triangle = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!((solid_angle(triangle, [0.0; 3]) - PI / 2.0).abs() < 1e-15);
        assert!((solid_angle([triangle[1], triangle[0], triangle[2]], [0.0; 3]) + PI / 2.0).abs() < 1e-15);
        assert_eq!(solid_angle(triangle, [1.0, 0.0, 0.0]), 0.0);
        assert_eq!(solid_angle([triangle[0]; 3], [0.0; 3]), 0.0);
    }

    #[test]
    fn no_triangles_and_flat_ones_wind_about_nothing() {
        assert_eq!(WindingTree::new(&TriangleMesh::default()).winding_number([0.0; 3]), 0.0);
        let flat = TriangleMesh::new(vec![[1.0; 3], [2.0; 3]], vec![[0, 0, 1]; 40]).unwrap();
        let tree = WindingTree::new(&flat);
        assert_eq!(tree.winding_number([0.0; 3]), 0.0);
        assert_eq!(tree.winding_number([1.5; 3]), 0.0);
        assert_eq!(tree.winding_number([1e9; 3]), 0.0);
    }
}
