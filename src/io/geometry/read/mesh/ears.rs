//! A polygon of any shape cut into triangles by clipping ears (Meisters 1975, doi:10.2307/2319703), seen along its area
//! vector (Newell's formula).
//!
//! Of n corners come n - 2 triangles whose rim is the polygon's own: no corner is dropped or added, also where it lies
//! straight between its neighbours, as libraries for drawing do it; a neighbour may have a corner there, and the mesh
//! would come out open. Corners may repeat: a hole is a part of the rim that a bridge, run through twice, leads to. A
//! polygon that is not flat is cut as its shadow on the plane is. One that a fan from its first corner covers stays a fan.

use std::collections::VecDeque;

use super::corner_cells::Cells;
use super::flat_polygon::{Flattened, STRAIGHT, flattened, is_star, turn, turns_once};

/// At most so many looks at points for each corner, as long as spare ones are left: polygons that cross themselves
/// everywhere must come to an end.
const LOOKS: u64 = 10_000;

/// So many looks each corner has in any case; polygons whose corners are spread evenly take no more.
const OWN_LOOKS: u64 = 500;

/// Looks that the polygons of a file have beyond those, all of them together: some seconds.
pub(crate) const SPARE_LOOKS: u64 = 200_000_000;

/// How a polygon was cut.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Cut {
    /// The fan from the first corner is right.
    Fan,
    /// These triangles, as places of corners in the polygon.
    Ears(Vec<[u32; 3]>),
    /// The same, of a polygon that crosses itself: they have its rim, but overlap.
    Crossed(Vec<[u32; 3]>),
}

/// Cuts the polygon with these corners, four at least, and takes what it needs of the spare looks of its file.
pub(crate) fn cut(corners: &[[f64; 3]], spare: &mut u64) -> Cut {
    let points = match flattened(corners) {
        Flattened::Line => return Cut::Fan,
        Flattened::Cancelled => return Cut::Crossed((2..corners.len() as u32).map(|n| [0, n - 1, n]).collect()),
        Flattened::Plane(points) if is_star(&points) => return Cut::Fan,
        Flattened::Plane(points) => points,
    };
    let turns_once = turns_once(&points);
    let mut ring = Ring::new(points);
    ring.crossed = !turns_once;
    let own = OWN_LOOKS * corners.len() as u64;
    let triangles = ring.clip((own + *spare).min(LOOKS * corners.len() as u64));
    *spare -= ring.looks.saturating_sub(own).min(*spare);
    if ring.crossed { Cut::Crossed(triangles) } else { Cut::Ears(triangles) }
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

impl Asked {
    /// What is asked for next.
    fn less(self) -> Self {
        match self {
            Self::Clear => Self::Free,
            Self::Free => Self::Flat,
            Self::Flat => Self::Convex,
            Self::Convex | Self::Any => Self::Any,
        }
    }
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

    /// Corners wait in a line to be asked; one that is no ear is asked again once a neighbour is gone, or all have been.
    /// After `most` looks any corner is taken.
    fn clip(&mut self, most: u64) -> Vec<[u32; 3]> {
        let count = self.points.len();
        let mut triangles = Vec::with_capacity(count - 2);
        let mut line: VecDeque<u32> = (0..count as u32).collect();
        let mut waits = vec![true; count];
        let (mut asked, mut has_clipped, mut passed_over) = (Asked::Clear, false, None);
        while triangles.len() + 3 < count {
            let Some(at) = line.pop_front() else {
                asked = if has_clipped { Asked::Clear } else { asked.less() };
                has_clipped = false;
                line.extend((0..count as u32).filter(|&corner| !self.gone[corner as usize]));
                for &corner in &line {
                    waits[corner as usize] = true;
                }
                continue;
            };
            // Leaving out the next corner makes fewer slivers than a fan would have.
            if passed_over.take() == Some(at) && !line.is_empty() {
                line.push_back(at);
                continue;
            }
            waits[at as usize] = false;
            if self.looks > most {
                asked = Asked::Any;
            }
            let [a, b, c] = self.around(at);
            if self.gone[at as usize] || !self.is_ear([a, b, c], asked) {
                continue;
            }
            self.crossed |= asked >= Asked::Convex;
            triangles.push([a, b, c]);
            self.gone[b as usize] = true;
            self.after[a as usize] = c;
            self.before[c as usize] = a;
            (asked, has_clipped, passed_over) = (Asked::Clear, true, Some(c));
            for corner in [c, a] {
                if !std::mem::replace(&mut waits[corner as usize], true) {
                    line.push_back(corner);
                }
            }
        }
        let last = (0..count as u32).find(|&corner| !self.gone[corner as usize]).unwrap_or(0);
        let rest = self.around(last);
        let [p, q, r] = rest.map(|corner| self.place(corner));
        self.crossed |= turn(p, q, r) < -STRAIGHT;
        triangles.push(rest);
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
        let found = self.cells.beside(lo.map(|x| x - STRAIGHT), hi.map(|x| x + STRAIGHT)).any(|cell| {
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn lifted(points: &[[f64; 2]]) -> Vec<[f64; 3]> {
        // A plane in general position, so that no axis is special.
        points.iter().map(|[x, y]| [2.0 * x + 7.0, *y - 3.0, x + 3.0 * y]).collect()
    }

    fn alone(corners: &[[f64; 3]]) -> Cut {
        let mut spare = SPARE_LOOKS;
        cut(corners, &mut spare)
    }

    fn triangles(corners: &[[f64; 3]]) -> (Vec<[u32; 3]>, bool) {
        match alone(corners) {
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
        assert_eq!(alone(&[[1.0; 3]; 5]), Cut::Fan);
        assert_eq!(alone(&[[0.0; 3], [1.0; 3], [2.0; 3], [1.5; 3]]), Cut::Fan);
        assert_eq!(alone(&[[0.0; 3], [1e308; 3], [-1e308, 1e308, 0.0], [5.0; 3]]), Cut::Fan);
    }

    #[test]
    fn polygons_that_cross_themselves_are_told_and_end() {
        let bow = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]];
        let lopsided = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]];
        let pentagram = [[0.0, 3.0], [2.0, -2.0], [-3.0, 1.0], [3.0, 1.0], [-2.0, -2.0]];
        for points in [&bow[..], &lopsided, &pentagram] {
            assert!(matches!(alone(&lifted(points)), Cut::Crossed(found) if found.len() == points.len() - 2));
        }
        let mut far = 1_u64;
        let mut random = || {
            far = far.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (far >> 33) as f64 / f64::from(u32::MAX)
        };
        let points: Vec<[f64; 2]> = (0..400).map(|_| [random(), random()]).collect();
        let (found, crossed) = triangles(&lifted(&points));
        assert!(crossed && found.len() == 398);
        // Polygons that take much leave others what these need.
        let mut spare = 300_000;
        for _ in 0..20 {
            assert!(matches!(cut(&lifted(&points), &mut spare), Cut::Crossed(found) if found.len() == 398));
        }
        assert_eq!(spare, 0);
        let comb = (0..400).map(|n| [f64::from(n), f64::from(n % 2)]).chain([[399.0, -1.0], [0.0, -1.0]]);
        let comb: Vec<[f64; 2]> = comb.collect();
        assert!(matches!(cut(&lifted(&comb), &mut spare), Cut::Ears(found) if found.len() == 400));
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
