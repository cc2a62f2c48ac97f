//! A polygon of any shape cut into triangles by clipping ears (Meisters 1975, doi:10.2307/2319703), seen along its area
//! vector (Newell's formula).
//!
//! Of n corners come n - 2 triangles whose rim is the polygon's own: no corner is dropped or added, also where it lies
//! straight between its neighbours, as libraries for drawing do it; a neighbour may have a corner there, and the mesh
//! would come out open. Corners may repeat: a hole is a part of the rim that a bridge, run through twice, leads to. A
//! polygon that is not flat is cut as its shadow on the plane is. One that a fan from its first corner covers stays a fan.

/// A corner is straight within this, in squares of the polygon's size: the rounding of the products.
const STRAIGHT: f64 = 1e-12;

/// Polygons of fewer corners are searched whole.
const FEW: usize = 32;

/// At most so many looks at points for each corner: polygons that cross themselves everywhere must come to an end.
const LOOKS: u64 = 4000;

/// How a polygon was cut.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cut {
    /// The fan from the first corner is right.
    Fan,
    /// These triangles, as places of corners in the polygon.
    Ears(Vec<[u32; 3]>),
    /// The same, of a polygon that crosses itself: they have its rim, but overlap.
    Crossed(Vec<[u32; 3]>),
}

/// Cuts the polygon with these corners, four at least.
pub(super) fn cut(corners: &[[f64; 3]]) -> Cut {
    let Some(points) = seen_flat(corners) else { return Cut::Fan };
    if is_star(&points) {
        return Cut::Fan;
    }
    let mut ring = Ring::new(points);
    let triangles = ring.clip();
    if ring.crossed { Cut::Crossed(triangles) } else { Cut::Ears(triangles) }
}

/// The corners in the plane of two axes from which the area is seen largest, counterclockwise, scaled by a power of two
/// to the size of 1; none where all lie on a line or cancel each other's area.
fn seen_flat(corners: &[[f64; 3]]) -> Option<Vec<[f64; 2]>> {
    let from = *corners.first()?;
    let local: Vec<[f64; 3]> = corners.iter().map(|p| std::array::from_fn(|a| p[a] / 4.0 - from[a] / 4.0)).collect();
    let size = local.iter().flatten().fold(0.0_f64, |size, x| size.max(x.abs()));
    if size == 0.0 {
        return None;
    }
    let (_, exponent) = libm::frexp(size);
    let scaled: Vec<[f64; 3]> = local.iter().map(|p| p.map(|x| libm::ldexp(x, -exponent))).collect();
    let mut area = [0.0_f64; 3];
    for (n, p) in scaled.iter().enumerate() {
        let q = scaled[(n + 1) % scaled.len()];
        for (a, sum) in area.iter_mut().enumerate() {
            let (i, j) = ((a + 1) % 3, (a + 2) % 3);
            *sum += p[i] * q[j] - p[j] * q[i];
        }
    }
    let axis = (1..3).fold(0, |most, a| if area[a].abs() > area[most].abs() { a } else { most });
    if area[axis].abs() <= STRAIGHT {
        return None;
    }
    let (mut i, mut j) = ((axis + 1) % 3, (axis + 2) % 3);
    if area[axis] < 0.0 {
        (i, j) = (j, i);
    }
    Some(scaled.iter().map(|p| [p[i], p[j]]).collect())
}

/// Twice the area of a triangle, positive where its corners turn counterclockwise.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// True when all of the polygon is seen from its first corner.
fn is_star(points: &[[f64; 2]]) -> bool {
    let first = points[0];
    let is_convex = turn(points[points.len() - 1], first, points[1]) >= -STRAIGHT;
    is_convex && points[1..].windows(2).all(|side| turn(first, side[0], side[1]) >= -STRAIGHT)
}

/// What a corner must be for its triangle to be cut off; the next is asked for where no corner is the one before.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
enum Asked {
    /// A convex corner whose triangle no other corner touches.
    Clear,
    /// One whose triangle holds no other corner.
    Free,
    /// One that is straight, whose triangle has no area.
    Flat,
    /// Any convex corner.
    Convex,
    Any,
}

/// What is left of a polygon.
struct Ring {
    points: Vec<[f64; 2]>,
    before: Vec<u32>,
    after: Vec<u32>,
    gone: Vec<bool>,
    cells: Cells,
    looks: u64,
    crossed: bool,
}

impl Ring {
    fn new(points: Vec<[f64; 2]>) -> Self {
        let n = points.len() as u32;
        Self {
            before: (0..n).map(|i| (i + n - 1) % n).collect(),
            after: (0..n).map(|i| (i + 1) % n).collect(),
            gone: vec![false; points.len()],
            cells: Cells::new(&points),
            points,
            looks: 0,
            crossed: false,
        }
    }

    fn clip(&mut self) -> Vec<[u32; 3]> {
        let count = self.points.len();
        let most = LOOKS * count as u64;
        let mut triangles = Vec::with_capacity(count - 2);
        let (mut at, mut since, mut asked) = (0_u32, 0, Asked::Clear);
        while triangles.len() + 3 < count {
            let [a, b, c] = self.around(at);
            if self.is_ear([a, b, c], asked) {
                self.crossed |= asked >= Asked::Convex;
                triangles.push([a, b, c]);
                self.gone[b as usize] = true;
                self.after[a as usize] = c;
                self.before[c as usize] = a;
                // Leaving out the next corner makes fewer slivers than a fan would have.
                at = self.after[c as usize];
                since = 0;
                asked = if self.looks > most { Asked::Any } else { Asked::Clear };
                continue;
            }
            at = self.after[at as usize];
            since += 1;
            if since + triangles.len() > count {
                since = 0;
                asked = match asked {
                    Asked::Clear => Asked::Free,
                    Asked::Free => Asked::Flat,
                    Asked::Flat => Asked::Convex,
                    Asked::Convex | Asked::Any => Asked::Any,
                };
            }
            if self.looks > most {
                asked = Asked::Any;
            }
        }
        triangles.push(self.around(at));
        triangles
    }

    fn around(&self, at: u32) -> [u32; 3] {
        [self.before[at as usize], at, self.after[at as usize]]
    }

    fn place(&self, corner: u32) -> [f64; 2] {
        self.points[corner as usize]
    }

    fn is_ear(&mut self, [a, b, c]: [u32; 3], asked: Asked) -> bool {
        self.looks += 1;
        let corners = [a, b, c].map(|corner| self.place(corner));
        let [p, q, r] = corners;
        // A corner that repeats its neighbour, or the end of a spike, encloses nothing.
        if p == q || q == r || p == r {
            return true;
        }
        let turned = turn(p, q, r);
        match asked {
            Asked::Clear => turned > STRAIGHT && !self.is_blocked([a, b, c], corners, asked),
            Asked::Free => turned > 0.0 && !self.is_blocked([a, b, c], corners, asked),
            Asked::Flat => turned.abs() <= STRAIGHT,
            Asked::Convex => turned > 0.0,
            Asked::Any => true,
        }
    }

    /// Whether the triangle of three successive corners holds another that is not convex. Corners at the same place as
    /// one of the three do not count: these are the other side of a bridge.
    fn is_blocked(&mut self, names: [u32; 3], [p, q, r]: [[f64; 2]; 3], asked: Asked) -> bool {
        let margin = if asked == Asked::Clear { -STRAIGHT } else { STRAIGHT };
        let [lo, hi] =
            [f64::min, f64::max].map(|pick| -> [f64; 2] { std::array::from_fn(|a| pick(pick(p[a], q[a]), r[a])) });
        let mut looks = 0;
        let found = self.cells.beside(lo, hi).any(|cell| {
            looks += 1;
            cell.iter().any(|&other| {
                looks += 1;
                let x = self.place(other);
                let is_near = (0..2).all(|a| x[a] >= lo[a] - STRAIGHT && x[a] <= hi[a] + STRAIGHT);
                if !is_near || self.gone[other as usize] || names.contains(&other) || x == p || x == q || x == r {
                    return false;
                }
                let holds = turn(p, q, x) >= margin && turn(q, r, x) >= margin && turn(r, p, x) >= margin;
                let [e, f, g] = self.around(other).map(|corner| self.place(corner));
                holds && turn(e, f, g) <= STRAIGHT
            })
        });
        self.looks += looks;
        found
    }
}

/// Corners by squares of the plane.
struct Cells {
    lo: [f64; 2],
    /// Squares along each axis for each unit of length.
    scale: [f64; 2],
    side: usize,
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Cells {
    fn new(points: &[[f64; 2]]) -> Self {
        let side = if points.len() < FEW { 1 } else { ((points.len() as f64).sqrt() as usize).min(1024) };
        let bound = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 2] {
            std::array::from_fn(|a| points.iter().fold(start, |best, p| pick(best, p[a])))
        };
        let (lo, hi) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        let scale = std::array::from_fn(|a| if hi[a] > lo[a] { side as f64 / (hi[a] - lo[a]) } else { 0.0 });
        let mut cells = Self { lo, scale, side, starts: vec![0; side * side + 1], order: vec![0; points.len()] };
        let square = |cells: &Self, p: [f64; 2]| cells.along(1, p[1]) * side + cells.along(0, p[0]);
        for &p in points {
            let at = square(&cells, p);
            cells.starts[at + 1] += 1;
        }
        for n in 1..cells.starts.len() {
            cells.starts[n] += cells.starts[n - 1];
        }
        let mut next = cells.starts.clone();
        for (n, &p) in points.iter().enumerate() {
            let at = square(&cells, p);
            cells.order[next[at] as usize] = n as u32;
            next[at] += 1;
        }
        cells
    }

    fn along(&self, axis: usize, x: f64) -> usize {
        (((x - self.lo[axis]) * self.scale[axis]).max(0.0) as usize).min(self.side - 1)
    }

    /// The corners of the squares that a box touches, square by square.
    fn beside(&self, lo: [f64; 2], hi: [f64; 2]) -> impl Iterator<Item = &[u32]> {
        let range = |a: usize| self.along(a, lo[a] - STRAIGHT)..=self.along(a, hi[a] + STRAIGHT);
        let columns = range(0);
        range(1)
            .flat_map(move |y| columns.clone().map(move |x| y * self.side + x))
            .map(|at| &self.order[self.starts[at] as usize..self.starts[at + 1] as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lifted(points: &[[f64; 2]]) -> Vec<[f64; 3]> {
        // A plane in general position, so that no axis is special.
        points.iter().map(|[x, y]| [2.0 * x + 7.0, *y - 3.0, x + 3.0 * y]).collect()
    }

    fn triangles(corners: &[[f64; 3]]) -> (Vec<[u32; 3]>, bool) {
        match cut(corners) {
            Cut::Fan => ((1..corners.len() as u32 - 1).map(|n| [0, n, n + 1]).collect(), false),
            Cut::Ears(found) => (found, false),
            Cut::Crossed(found) => (found, true),
        }
    }

    /// Sum of the areas of triangles without and with their signs, and that of the polygon by the shoelace formula.
    fn areas(points: &[[f64; 2]], found: &[[u32; 3]]) -> [f64; 3] {
        let area = |t: &[u32; 3]| turn(points[t[0] as usize], points[t[1] as usize], points[t[2] as usize]) / 2.0;
        let shoelace: f64 = (0..points.len())
            .map(|n| (points[n], points[(n + 1) % points.len()]))
            .map(|(p, q)| (p[0] * q[1] - p[1] * q[0]) / 2.0)
            .sum();
        [found.iter().map(|t| area(t).abs()).sum(), found.iter().map(area).sum(), shoelace]
    }

    /// The rim of triangles: their sides that no other runs back along.
    fn rim(found: &[[u32; 3]]) -> Vec<(u32, u32)> {
        let mut sides: Vec<_> = found.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
        let all = sides.clone();
        sides.retain(|&(a, b)| !all.contains(&(b, a)));
        sides.sort_unstable();
        sides
    }

    fn assert_exact(points: &[[f64; 2]]) {
        let (found, crossed) = triangles(&lifted(points));
        assert!(!crossed && found.len() == points.len() - 2, "{points:?}");
        let [plain, signed, shoelace] = areas(points, &found);
        assert!((plain - shoelace.abs()).abs() < 1e-9 && (signed - shoelace).abs() < 1e-9, "{points:?}: {found:?}");
        let n = points.len() as u32;
        let mut expected: Vec<_> = (0..n).map(|i| (i, (i + 1) % n)).collect();
        expected.sort_unstable();
        assert_eq!(rim(&found), expected, "{points:?}");
    }

    #[test]
    fn polygons_of_all_kinds_are_covered_once() {
        let u = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [7.0, 10.0], [7.0, 2.0], [3.0, 2.0], [3.0, 10.0], [0.0, 10.0]];
        let dart = [[0.0, 0.0], [4.0, 2.0], [0.0, 4.0], [1.0, 2.0]];
        // Straight corners on a concave rim; a frame whose hole a bridge leads to; corners that repeat.
        let comb: Vec<[f64; 2]> =
            (0..9).map(|n| [f64::from(n), f64::from(n % 2)]).chain([[8.0, -1.0], [4.0, -1.0], [0.0, -1.0]]).collect();
        let frame = [
            [0.0, 0.0],
            [6.0, 0.0],
            [6.0, 6.0],
            [0.0, 6.0],
            [0.0, 0.0],
            [2.0, 2.0],
            [2.0, 4.0],
            [4.0, 4.0],
            [4.0, 2.0],
            [2.0, 2.0],
        ];
        let repeated = [[0.0, 0.0], [4.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0], [0.0, 4.0]];
        for points in [&u[..], &dart, &comb, &frame, &repeated] {
            for start in 0..points.len() {
                let turned: Vec<_> = points[start..].iter().chain(&points[..start]).copied().collect();
                assert_exact(&turned);
                assert_exact(&turned.iter().rev().copied().collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn two_holes_on_bridges() {
        let hole = |x: f64| [[x, 1.0], [x, 2.0], [x + 1.0, 2.0], [x + 1.0, 1.0], [x, 1.0]];
        let mut points = vec![[0.0, 0.0]];
        points.extend(hole(1.0));
        points.extend([[0.0, 0.0], [6.0, 0.0]]);
        points.extend([[4.0, 1.0], [3.0, 1.0], [3.0, 2.0], [4.0, 2.0], [4.0, 1.0]]);
        points.extend([[6.0, 0.0], [6.0, 3.0], [0.0, 3.0]]);
        assert_exact(&points);
    }

    #[test]
    fn what_encloses_nothing_stays_a_fan() {
        assert_eq!(cut(&[[1.0; 3]; 5]), Cut::Fan);
        assert_eq!(cut(&[[0.0; 3], [1.0; 3], [2.0; 3], [1.5; 3]]), Cut::Fan);
        assert_eq!(cut(&[[0.0; 3], [1e308; 3], [-1e308, 1e308, 0.0], [5.0; 3]]), Cut::Fan);
    }

    #[test]
    fn polygons_that_cross_themselves_are_told_and_end() {
        let mut far = 1_u64;
        let mut random = || {
            far = far.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (far >> 33) as f64 / f64::from(u32::MAX)
        };
        let points: Vec<[f64; 2]> = (0..400).map(|_| [random(), random()]).collect();
        let (found, crossed) = triangles(&lifted(&points));
        assert!(crossed && found.len() == 398);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        /// Polygons seen from their middle, of any number of corners, are covered once.
        #[test]
        fn stars_of_any_shape(radii in prop::collection::vec(0.05..1.0_f64, 4..90), start in 0..90_usize) {
            let n = radii.len();
            let point = |i: usize| {
                let angle = std::f64::consts::TAU * ((i + start) % n) as f64 / n as f64;
                [radii[i] * angle.cos(), radii[i] * angle.sin()]
            };
            assert_exact(&(0..n).map(point).collect::<Vec<_>>());
        }
    }
}
