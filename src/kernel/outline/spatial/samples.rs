//! What a section tells a function in space: 0 on its outlines, the signed distance a little beside them and where it
//! is deepest; and, where nothing was marked beyond the first and last section, that the object ends there.

use crate::kernel::outline::planar::section::Section;

/// Points with the values that a function is to have there.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// World positions.
    pub points: Vec<[f64; 3]>,
    /// Signed distances, negative inside.
    pub values: Vec<f64>,
}

/// Points beside an outline lie so far from it, of the section's radius.
const BESIDE: f64 = 0.2;

impl Samples {
    /// Adds `count` points along each outline of a section and those beside them; none nearer to an outline than
    /// `least`.
    pub fn add_section(&mut self, section: &Section, count: usize, least: f64) {
        let beside = (BESIDE * section.radius()).max(least);
        for curve in &section.curves {
            let len = curve.points.len();
            let count = count.min(len);
            for m in 0..count {
                let n = m * len / count;
                let (here, normal) = (curve.points[n], normal(&curve.points, n));
                self.add(section, here, 0.0);
                for by in [beside, -beside] {
                    let point = [here[0] + by * normal[0], here[1] + by * normal[1]];
                    let value = section.distance(point);
                    // In a narrow place the other side's outline is nearer.
                    if value.abs() > 0.5 * beside {
                        self.add(section, point, value);
                    }
                }
            }
        }
        if let Some((point, depth)) = section.deepest() {
            self.add(section, point, -depth);
        }
    }

    fn add(&mut self, section: &Section, point: [f64; 2], value: f64) {
        self.points.push(section.plane.lift(point, 0.0));
        self.values.push(value);
    }

    /// Adds that an object whose last section this is has its end at `height` beyond it, where `open` says that it
    /// would go on there: the section shrinks to its deepest point.
    pub fn add_end(&mut self, section: &Section, height: f64, open: impl Fn([f64; 3]) -> bool) {
        const STEPS: usize = 5;
        let Some((top, depth)) = section.deepest() else { return };
        let [low, high] = section.bounds();
        let at = |n: usize, a: usize| low[a] + (high[a] - low[a]) * (n as f64 + 0.5) / STEPS as f64;
        let lattice = (0..STEPS).flat_map(|j| (0..STEPS).map(move |i| [at(i, 0), at(j, 1)]));
        for point in lattice.filter(|&p| section.holds(p)).chain([top]) {
            let place = section.plane.lift(point, height);
            if open(place) {
                self.points.push(place);
                self.values.push((section.distance(point) + depth).max(0.0));
            }
        }
    }
}

/// The unit normal of a polygon at a corner, to one side of the way along it.
fn normal(points: &[[f64; 2]], n: usize) -> [f64; 2] {
    let len = points.len();
    let (before, after) = (points[(n + len - 1) % len], points[(n + 1) % len]);
    let along = [after[0] - before[0], after[1] - before[1]];
    let length = libm::hypot(along[0], along[1]).max(f64::MIN_POSITIVE);
    [along[1] / length, -along[0] / length]
}
