//! `Clustering`: a mesh with fewer triangles, made while those of a larger one pass (Lindstrom, "Out-of-core simplification of large
//! polygonal models", SIGGRAPH 2000, after Rossignac and Borrel 1993).
//!
//! Space is cut into cubes. All vertices in a cube become one, at the place nearest to the planes of their triangles
//! ([`Quadric`]), kept in the cube; a triangle stays where its corners lie in three cubes. Planes are weighed by area, where the
//! paper takes its square. Cubes of twice the edge take the sums of eight: where more triangles stay than wanted, edges double
//! and all goes on, so that memory goes with what comes out and the mesh passes once.
//!
//! Triangles of the same corners and labels are kept once, whichever way they turn: a plate thinner than a cube becomes one sheet.
//! So a closed mesh stays closed except there, and pieces smaller than a cube go. A vertex of what stays moves by no more than
//! the diagonal of a cube.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::quadric::Quadric;
use crate::kernel::geometry::triangle::Triangle;

/// Cubes for each triangle, at most: a closed surface has half as many vertices as triangles.
const CUBES: [usize; 2] = [2, 3];

/// A triangle by the numbers of its cubes, and its labels.
type Facet = ([u32; 3], [u32; 2]);

/// A mesh on its way to fewer triangles.
#[derive(Debug)]
pub struct Clustering {
    cubes: Cubes,
    most: usize,
    places: Vec<[i32; 3]>,
    quadrics: Vec<Quadric>,
    facets: Vec<Facet>,
    /// Those of `facets` with sorted corners.
    known: HashSet<Facet>,
}

/// Cubes by the places that lie in them.
#[derive(Debug)]
struct Cubes {
    origin: DVec3,
    /// Edge of the finest cubes, and how many times it was doubled.
    finest: f64,
    doubled: u32,
    numbers: HashMap<[i32; 3], u32>,
}

/// A mesh with fewer triangles.
#[derive(Debug)]
pub struct Clustered {
    /// World positions.
    pub vertices: Vec<[f64; 3]>,
    /// Corners, turned as those of the first mesh.
    pub triangles: Vec<[u32; 3]>,
    /// The two labels that each triangle separates; 0 where it came with none.
    pub labels: Vec<[u32; 2]>,
    /// Edge of the cubes.
    pub edge: f64,
    cubes: Cubes,
    /// The triangles at each vertex: where its list starts in `around`.
    starts: Vec<u32>,
    around: Vec<u32>,
    /// The vertex of each cube, `u32::MAX` where no triangle has it.
    of_cube: Vec<u32>,
}

impl Clustering {
    /// An empty one, whose finest cubes have this edge and one corner at `origin`, and which keeps at most so many triangles.
    #[must_use]
    pub fn new(origin: [f64; 3], finest: f64, most: usize) -> Self {
        let cubes = cubes_for(most);
        Self {
            cubes: Cubes { origin: origin.into(), finest, doubled: 0, numbers: HashMap::with_capacity(cubes) },
            most,
            places: Vec::with_capacity(cubes),
            quadrics: Vec::with_capacity(cubes),
            facets: Vec::with_capacity(most + 1),
            known: HashSet::with_capacity(most + 1),
        }
    }

    /// Bytes of memory that one which keeps at most so many triangles takes, with what is made of it.
    #[must_use]
    pub fn bytes(most: usize) -> u64 {
        let cubes = cubes_for(most);
        let places = |entries: usize| (entries + entries / 7 + 1).next_power_of_two();
        let of_cubes = cubes * (size_of::<Quadric>() + 12 + 24 + 3 * 4) + places(cubes) * 17;
        // Of a triangle: itself, the list of who knows it, and, when its sorted form has gone, its corners and its place in three lists.
        let of_facets = (most + 1) * (size_of::<Facet>() + 20 + 12) + places(most + 1) * (size_of::<Facet>() + 1);
        (of_cubes + of_facets) as u64
    }

    /// Takes a triangle: its corners in the world, counter-clockwise as seen from outside.
    pub fn add(&mut self, corners: [[f64; 3]; 3], labels: [u32; 2]) {
        let local = corners.map(|p| DVec3::from(p) - self.cubes.origin);
        let numbers = corners.map(|corner| self.number(corner));
        for (number, corner) in numbers.into_iter().zip(local) {
            self.quadrics[number as usize].add_plane(local, corner);
        }
        if is_triangle(numbers) && self.known.insert(sorted((numbers, labels))) {
            self.facets.push((numbers, labels));
        }
        while self.facets.len() > self.most || self.places.len() + 3 > cubes_for(self.most) {
            self.double();
        }
    }

    /// The number of the cube that a place lies in.
    fn number(&mut self, corner: [f64; 3]) -> u32 {
        let place = self.cubes.place(corner);
        let next = self.places.len() as u32;
        let number = *self.cubes.numbers.entry(place).or_insert(next);
        if number == next {
            self.places.push(place);
            self.quadrics.push(Quadric::default());
        }
        number
    }

    /// Makes the cubes' edges twice as long.
    fn double(&mut self) {
        self.cubes.doubled += 1;
        self.cubes.numbers.clear();
        let mut count = 0;
        let mut moved = Vec::with_capacity(self.places.len());
        for n in 0..self.places.len() {
            let place = self.places[n].map(|v| v >> 1);
            let number = *self.cubes.numbers.entry(place).or_insert(count);
            let quadric = self.quadrics[n];
            if number == count {
                // Never behind the one that is looked at.
                (self.places[number as usize], self.quadrics[number as usize]) = (place, quadric);
                count += 1;
            } else {
                self.quadrics[number as usize].merge(&quadric);
            }
            moved.push(number);
        }
        self.places.truncate(count as usize);
        self.quadrics.truncate(count as usize);
        self.known.clear();
        let known = &mut self.known;
        self.facets.retain_mut(|facet| {
            facet.0 = facet.0.map(|number| moved[number as usize]);
            is_triangle(facet.0) && known.insert(sorted(*facet))
        });
    }

    /// The mesh of what passed.
    #[must_use]
    pub fn finish(self) -> Clustered {
        let Self { cubes, places, quadrics, facets, known, .. } = self;
        drop(known);
        let (mut of_cube, mut vertices) = (vec![u32::MAX; places.len()], Vec::new());
        for number in facets.iter().flat_map(|(numbers, _)| numbers).map(|&n| n as usize) {
            if of_cube[number] == u32::MAX {
                of_cube[number] = vertices.len() as u32;
                vertices.push(cubes.vertex(places[number], &quadrics[number]));
            }
        }
        drop((places, quadrics));
        let triangles: Vec<[u32; 3]> =
            facets.iter().map(|(numbers, _)| numbers.map(|number| of_cube[number as usize])).collect();
        let labels = facets.into_iter().map(|(_, labels)| labels).collect();
        let (starts, around) = lists(&triangles, vertices.len());
        Clustered { vertices, triangles, labels, edge: cubes.edge(), cubes, starts, around, of_cube }
    }
}

impl Cubes {
    fn edge(&self) -> f64 {
        self.finest * 2.0_f64.powi(self.doubled as i32)
    }

    fn place(&self, corner: [f64; 3]) -> [i32; 3] {
        // By whole numbers, so that cubes of twice the edge hold eight of the finer ones whatever is rounded.
        let finest = (DVec3::from(corner) - self.origin) / self.finest;
        finest.floor().to_array().map(|v| v as i32 >> self.doubled)
    }

    /// The vertex of a cube, in the world: the place nearest to the planes, or where the way there from the mean leaves the cube.
    fn vertex(&self, place: [i32; 3], quadric: &Quadric) -> [f64; 3] {
        let (mean, best) = (quadric.mean(), quadric.nearest_place());
        let low = DVec3::from(place.map(f64::from)) * self.edge();
        let high = low + self.edge();
        let step = best - mean;
        let part = (0..3).map(|a| {
            let room = if step[a] > 0.0 { high[a] - mean[a] } else { low[a] - mean[a] };
            if step[a] == 0.0 { 1.0 } else { (room / step[a]).clamp(0.0, 1.0) }
        });
        (self.origin + mean + step * part.fold(1.0, f64::min)).to_array()
    }
}

impl Clustered {
    /// How far, at most, a triangle of the first mesh lies from this one, at its corners and its middle: to the triangles around
    /// its corners' vertices. None where no such triangle stays.
    #[must_use]
    pub fn distance(&self, corners: [[f64; 3]; 3]) -> Option<f64> {
        let near: Vec<Triangle> = corners.iter().flat_map(|&corner| self.around(corner)).collect();
        let middle = std::array::from_fn(|a| corners.iter().map(|corner| corner[a]).sum::<f64>() / 3.0);
        let distance = |place: [f64; 3]| near.iter().map(|t| t.distance_squared(place)).reduce(f64::min);
        let farthest = corners.into_iter().chain([middle]).filter_map(distance).reduce(f64::max);
        farthest.map(f64::sqrt)
    }

    /// The longest way of a vertex that stays: the diagonal of a cube.
    #[must_use]
    pub fn bound(&self) -> f64 {
        self.edge * 3.0_f64.sqrt()
    }

    /// The triangles at the vertex of a place's cube.
    fn around(&self, corner: [f64; 3]) -> impl Iterator<Item = Triangle> {
        let cube = self.cubes.numbers.get(&self.cubes.place(corner));
        let vertex =
            cube.map(|&cube| self.of_cube[cube as usize] as usize).filter(|&vertex| vertex < self.vertices.len());
        let list = vertex.map_or(0..0, |vertex| self.starts[vertex] as usize..self.starts[vertex + 1] as usize);
        let corners = |&t: &u32| self.triangles[t as usize].map(|v| self.vertices[v as usize]);
        self.around[list].iter().map(move |t| Triangle::new(corners(t)))
    }
}

/// For each vertex its triangles: where each list starts, and all lists.
fn lists(triangles: &[[u32; 3]], vertices: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0; vertices + 1];
    triangles.iter().flatten().for_each(|&vertex| starts[vertex as usize + 1] += 1);
    (0..vertices).for_each(|n| starts[n + 1] += starts[n]);
    let (mut next, mut around) = (starts.clone(), vec![0; 3 * triangles.len()]);
    for (n, corners) in (0..).zip(triangles) {
        for &corner in corners {
            around[next[corner as usize] as usize] = n;
            next[corner as usize] += 1;
        }
    }
    (starts, around)
}

fn cubes_for(most: usize) -> usize {
    most * CUBES[0] / CUBES[1] + 16
}

fn is_triangle([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && c != a
}

fn sorted((mut corners, labels): Facet) -> Facet {
    corners.sort_unstable();
    (corners, labels)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of unit cells, cut into two triangles each, with two labels.
    fn plane(clustering: &mut Clustering, cells: i32, height: f64) {
        for (x, y) in (0..cells * cells).map(|n| (n % cells, n / cells)) {
            let at = |dx: i32, dy: i32| [f64::from(x + dx) + 0.5, f64::from(y + dy) + 0.5, height];
            let labels = [1, 2 + u32::from(x >= cells / 2)];
            clustering.add([at(0, 0), at(1, 0), at(1, 1)], labels);
            clustering.add([at(0, 0), at(1, 1), at(0, 1)], labels);
        }
    }

    #[test]
    fn edges_double_until_few_triangles_stay() {
        let mut clustering = Clustering::new([0.0; 3], 1.0, 1 << 11);
        plane(&mut clustering, 128, 0.25);
        let found = clustering.finish();
        assert_eq!(found.edge, 4.0);
        assert_eq!((found.vertices.len(), found.triangles.len()), (33 * 33, 2 * 32 * 32));
        assert!(found.vertices.iter().all(|v| (v[2] - 0.25).abs() < 1e-12));
        assert_eq!(found.labels.iter().filter(|labels| **labels == [1, 3]).count(), found.labels.len() / 2);
        assert_eq!(found.distance([[8.0, 8.0, 0.75], [9.0, 8.0, 0.75], [8.0, 9.0, 0.75]]), Some(0.5));
        assert_eq!(found.distance([[800.0; 3]; 3]), None);
    }

    #[test]
    fn a_thin_plate_becomes_one_sheet() {
        let mut clustering = Clustering::new([0.0; 3], 4.0, 1 << 20);
        plane(&mut clustering, 32, 1.0);
        let once = clustering.facets.len();
        plane(&mut clustering, 32, 2.0);
        assert_eq!(clustering.facets.len(), once);
        let found = clustering.finish();
        assert!(found.vertices.iter().all(|v| (v[2] - 1.5).abs() < 1e-9));
    }
}
