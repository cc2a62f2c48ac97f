//! The assembled co-volume scheme against the formulas as printed (Kósa 2015, sec. 3.3; Kósa PhD, eq. 3.12-3.18), in
//! f64, one voxel and 24 tetrahedra at a time; gradients also against fields whose gradient is known.

use strandline::kernel::image::filter::edge_detector::edge_detector;
use strandline::kernel::level_set::cell::{CELL, CELL_LEN};
use strandline::kernel::level_set::scheme::covolume::{Planes, assemble, mean_gradient};
use strandline::kernel::level_set::scheme::mask::CellMask;
use strandline::kernel::level_set::scheme::system::{SCHEME_LEN, scheme_place};
use strandline::kernel::level_set::scheme::velocity::{Fields, Velocity};

use crate::common::lab::PlainGrid;
use crate::common::plain_scheme::{PlainVelocity, coefficients, gradient_norms, mean_norm, speed_coefficients};
use crate::common::random::Random;

const GROWN: usize = CELL + 2;
const ISOTROPIC: [f64; 3] = [0.05; 3];
const MICROSCOPE: [f64; 3] = [0.3, 0.45, 1.1];

/// A domain with the cell at `lo` in it: values of u, d, g on the whole domain.
struct Scene {
    grid: PlainGrid,
    lo: [i64; 3],
    spacing: [f64; 3],
    fields: [Vec<f64>; 3],
    solved: Vec<u8>,
}

/// Values as f32 would hold them, so that both sides start from the same.
fn rounded(values: impl Iterator<Item = f64>) -> Vec<f64> {
    values.map(|v| f64::from(v as f32)).collect()
}

/// The voxel at a place of the cell.
fn in_cell(at: usize) -> [usize; 3] {
    [at % CELL, at / CELL % CELL, at / (CELL * CELL)]
}

/// A scheme as the kernel gives it, and the sum of gradient norms.
struct Scheme {
    values: Vec<f32>,
    gradient_sum: f64,
}

impl Scene {
    /// Smooth fields as in a real run: a front a few voxels wide, the distance to it, a bright shell's detector.
    fn smooth(shape: [i64; 3], lo: [i64; 3], spacing: [f64; 3]) -> Self {
        let grid = PlainGrid { shape };
        let h = spacing.iter().copied().fold(0.0, f64::max);
        let radius = |v: [i64; 3]| (0..3).map(|a| (v[a] as f64 * spacing[a] - 3.7 * h).powi(2)).sum::<f64>().sqrt();
        let u = |v| 1.0 / (1.0 + ((radius(v) - 6.3 * h) / (1.5 * h)).exp());
        let d = |v| (radius(v) - 7.1 * h).abs();
        let g = |v| 1.0 - 0.8 * (-((radius(v) - 5.2 * h) / h).powi(2)).exp();
        let field = |f: &dyn Fn([i64; 3]) -> f64| rounded(grid.voxels().map(f));
        Self { grid, lo, spacing, fields: [field(&u), field(&d), field(&g)], solved: vec![1; grid.len()] }
    }

    /// Every value drawn for itself, every fourth voxel held.
    fn rough(shape: [i64; 3], lo: [i64; 3], spacing: [f64; 3], seed: u64) -> Self {
        let mut random = Random(seed);
        let grid = PlainGrid { shape };
        let mut field = |scale: f64| rounded((0..grid.len()).map(|_| scale * random.unit()));
        let fields = [field(1.0), field(2.0 * spacing[0]), field(1.0)];
        let solved = (0..grid.len()).map(|_| u8::from(random.below(4) > 0)).collect();
        Self { grid, lo, spacing, fields, solved }
    }

    /// A field on the grown cell, mirrored beyond the domain.
    fn grown(&self, field: usize) -> Vec<f32> {
        let voxels = PlainGrid { shape: [GROWN as i64; 3] }.voxels();
        let value = |v: [i64; 3]| self.fields[field][self.grid.at(std::array::from_fn(|a| self.lo[a] + v[a] - 1))];
        voxels.map(|v| value(v) as f32).collect()
    }

    /// Domain voxels of the cell with their place in the cell.
    fn cell(&self) -> impl Iterator<Item = ([i64; 3], usize)> + '_ {
        let voxels = PlainGrid { shape: [CELL as i64; 3] }.voxels().enumerate();
        voxels.map(|(at, v)| (std::array::from_fn(|a| self.lo[a] + v[a]), at)).filter(|(v, _)| self.grid.contains(*v))
    }

    fn mask(&self) -> CellMask {
        let mut solved = vec![0; CELL_LEN];
        for (v, at) in self.cell() {
            solved[at] = self.solved[self.grid.at(v)];
        }
        let end: [i64; 3] = std::array::from_fn(|a| (self.lo[a] + CELL as i64).min(self.grid.shape[a]));
        let valid = std::array::from_fn(|a| (end[a] - self.lo[a]) as usize);
        let mut mask = CellMask::new();
        mask.set(&solved, valid, std::array::from_fn(|a| [self.lo[a] == 0, end[a] == self.grid.shape[a]]));
        mask
    }

    fn difference(&self, field: usize, v: [i64; 3]) -> [f64; 6] {
        let values = &self.fields[field];
        PlainGrid::around(v).map(|q| values[self.grid.at(q)] - values[self.grid.at(v)])
    }

    fn norms(&self, field: usize, v: [i64; 3], spacing: [f64; 3]) -> [f64; 24] {
        // The thesis counts i along y, j along x.
        let value = |i, j, k| self.fields[field][self.grid.at([v[0] + j, v[1] + i, v[2] + k])];
        gradient_norms(value, spacing)
    }

    /// The scheme with `g` as the edge detector, or as a speed.
    fn assembled(&self, velocity: &PlainVelocity, speed: bool) -> Scheme {
        let [u, d, g] = [0, 1, 2].map(|f| self.grown(f));
        let fields = Fields { u: &u, d: &d, g: if velocity.rho == 0.0 { &[] } else { &g } };
        let mut values = vec![0.0; SCHEME_LEN];
        let mask = self.mask();
        let velocity = Velocity { speed, ..single(velocity) };
        let gradient_sum = assemble(fields, &mask, self.spacing, &velocity, &mut Planes::new(), &mut values);
        Scheme { values, gradient_sum }
    }

    /// Compares weights, old values and the sum of gradient norms with the printed scheme, relative to `tolerance`.
    fn check(&self, velocity: &PlainVelocity, tolerance: f64) {
        self.check_scheme(velocity, false, tolerance);
    }

    fn check_scheme(&self, velocity: &PlainVelocity, speed: bool, tolerance: f64) {
        let out = self.assembled(velocity, speed);
        let mut sum = 0.0;
        for (v, at) in self.cell().filter(|(v, _)| self.solved[self.grid.at(*v)] == 1) {
            let norms = self.norms(0, v, self.spacing);
            let mut a = if speed {
                let still = PlainVelocity { rho: 0.0, ..*velocity };
                coefficients(&norms, self.difference(1, v), [0.0; 6], self.spacing, &still)
            } else {
                coefficients(&norms, self.difference(1, v), self.difference(2, v), self.spacing, velocity)
            };
            if speed {
                let here = velocity.rho * self.fields[2][self.grid.at(v)];
                let more = speed_coefficients(&norms, self.difference(0, v), here, self.spacing, velocity);
                (0..6).for_each(|q| a[q] += more[q]);
            }
            // Neumann: beyond the border lies u_p itself, so the term a_pq (u_q - u_p) is 0.
            let inside = PlainGrid::around(v).map(|q| self.grid.contains(q));
            let diagonal = 1.0 - (0..6).filter(|&q| inside[q]).map(|q| a[q]).sum::<f64>();
            for q in 0..6 {
                let expected = if inside[q] { -a[q] / diagonal } else { 0.0 };
                let found = f64::from(out.values[scheme_place(q, in_cell(at))]);
                assert!(
                    (found - expected).abs() <= tolerance * expected + 1e-7,
                    "weight {q} of {v:?}: {found} for {expected}, {velocity:?}"
                );
            }
            let old = f64::from(out.values[scheme_place(6, in_cell(at))]);
            assert!(old == self.fields[0][self.grid.at(v)], "old value of {v:?}: {old}");
            sum += velocity.epsilon.hypot(mean_norm(&norms));
        }
        assert!((out.gradient_sum - sum).abs() <= 1e-5 * sum, "{} for {sum}", out.gradient_sum);
    }
}

fn single(v: &PlainVelocity) -> Velocity {
    Velocity {
        theta: v.theta as f32,
        rho: v.rho as f32,
        delta: v.delta as f32,
        epsilon: v.epsilon as f32,
        tau: v.tau as f32,
        normalised: v.normalised,
        speed: false,
    }
}

/// Every term alone and all together, for a spacing of about `h`.
fn velocities(h: f64) -> Vec<PlainVelocity> {
    let still = PlainVelocity { theta: 0.0, rho: 0.0, delta: 0.0, epsilon: 0.01, tau: 0.25 * h, normalised: true };
    vec![
        PlainVelocity { theta: 1.0, ..still },
        PlainVelocity { delta: 0.5, ..still },
        PlainVelocity { delta: 0.5, epsilon: 1e-4, ..still },
        PlainVelocity { rho: 0.7, ..still },
        PlainVelocity { rho: 0.7, normalised: false, ..still },
        PlainVelocity { theta: 0.6, rho: 0.3, delta: 0.05, ..still },
        PlainVelocity { theta: 0.6, rho: 0.3, delta: 0.05, tau: 40.0 * h, normalised: false, ..still },
    ]
}

/// Cells amid the domain, at its corners, cut short by its end, and one that is the whole domain.
const PLACES: [([i64; 3], [i64; 3]); 5] = [
    ([48, 48, 48], [16, 16, 16]),
    ([16, 16, 16], [0, 0, 0]),
    ([40, 32, 48], [0, 16, 32]),
    ([21, 35, 29], [16, 32, 16]),
    ([7, 1, 12], [0, 0, 0]),
];

#[test]
fn smooth_fields_are_assembled_as_printed() {
    for spacing in [ISOTROPIC, MICROSCOPE] {
        for (shape, lo) in PLACES {
            let scene = Scene::smooth(shape, lo, spacing);
            for velocity in &velocities(spacing[0]) {
                scene.check(velocity, 1e-4);
            }
        }
    }
}

#[test]
fn rough_fields_are_assembled_as_printed() {
    for (seed, (shape, lo)) in PLACES.into_iter().enumerate() {
        for spacing in [ISOTROPIC, MICROSCOPE] {
            let scene = Scene::rough(shape, lo, spacing, seed as u64);
            for velocity in &velocities(spacing[0]) {
                scene.check(velocity, 2e-5);
            }
        }
    }
}

/// `F |grad u|` alone and with the other terms; F of both signs.
#[test]
fn a_speed_is_assembled_upwind() {
    for (seed, (shape, lo)) in PLACES.into_iter().enumerate() {
        for spacing in [ISOTROPIC, MICROSCOPE] {
            let mut scene = Scene::rough(shape, lo, spacing, 40 + seed as u64);
            scene.fields[2].iter_mut().for_each(|f| *f -= 0.5);
            let tau = 0.25 * spacing[0];
            let alone = PlainVelocity { theta: 0.0, rho: 1.0, delta: 0.0, epsilon: 0.01, tau, normalised: true };
            for velocity in [alone, PlainVelocity { theta: 0.6, rho: 0.8, delta: 0.05, ..alone }] {
                scene.check_scheme(&velocity, true, 2e-5);
            }
        }
    }
}

#[test]
fn voxels_that_are_held_keep_their_value() {
    let scene = Scene::rough([30, 20, 18], [16, 0, 0], MICROSCOPE, 77);
    let out = scene.assembled(&velocities(0.3)[5], false);
    let mask = scene.mask();
    let mut held = 0;
    for (v, at) in scene.cell().filter(|(_, at)| mask.solved[*at] == 0) {
        // Rows without any solved voxel are not assembled; nobody reads them.
        let y = at / CELL % CELL;
        let z = at / (CELL * CELL);
        if (mask.rows[z][0]..mask.rows[z][1]).contains(&y) {
            assert!((0..6).all(|q| out.values[scheme_place(q, in_cell(at))] == 0.0), "{v:?}");
            assert_eq!(out.values[scheme_place(6, in_cell(at))], scene.fields[0][scene.grid.at(v)] as f32, "{v:?}");
            held += 1;
        }
    }
    assert!(held > 500);
    assert_eq!(mask.count as usize, scene.cell().filter(|(v, _)| scene.solved[scene.grid.at(*v)] == 1).count());
}

#[test]
fn mean_gradients_are_those_of_the_24_tetrahedra() {
    for (n, spacing) in [ISOTROPIC, MICROSCOPE].into_iter().enumerate() {
        for (shape, lo) in [PLACES[0], PLACES[2]] {
            for scene in [Scene::smooth(shape, lo, spacing), Scene::rough(shape, lo, spacing, n as u64)] {
                let (mut found, mut detected) = (vec![0.0; CELL_LEN], vec![0.0; CELL_LEN]);
                let grown = scene.grown(2);
                mean_gradient(&grown, spacing, &mut Planes::new(), &mut found);
                let (length, k) = (spacing[0].min(spacing[2]), 37.0);
                edge_detector(&grown, spacing, length, k as f32, &mut Planes::new(), &mut detected);
                for (v, at) in scene.cell() {
                    let s = mean_norm(&scene.norms(2, v, spacing));
                    assert!((f64::from(found[at]) - s).abs() < 1e-5 * s + 1e-5, "{v:?}: {} for {s}", found[at]);
                    let g = 1.0 / (1.0 + k * (s * length).powi(2));
                    assert!((f64::from(detected[at]) - g).abs() < 2e-5, "{v:?}: {} for {g}", detected[at]);
                }
            }
        }
    }
}

/// Away from the border a linear field has one gradient on all tetrahedra: its own, whatever the spacing.
#[test]
fn linear_fields_have_their_exact_gradient() {
    for (spacing, slope) in
        [(ISOTROPIC, [0.3, -0.7, 0.2]), (MICROSCOPE, [0.0, 0.04, -0.03]), ([2.0, 0.5, 1.0], [0.01; 3])]
    {
        let voxels = PlainGrid { shape: [GROWN as i64; 3] }.voxels();
        let linear = |v: [i64; 3]| (0..3).map(|a| slope[a] * spacing[a] * v[a] as f64).sum::<f64>();
        let u: Vec<f32> = voxels.map(|v| linear(v) as f32).collect();
        let mut found = vec![0.0; CELL_LEN];
        mean_gradient(&u, spacing, &mut Planes::new(), &mut found);
        let exact = slope.iter().map(|s| s * s).sum::<f64>().sqrt();
        for &norm in &found {
            assert!((f64::from(norm) / exact - 1.0).abs() < 2e-5, "{norm} for {exact}");
        }
        let mut g = vec![0.0; CELL_LEN];
        edge_detector(&u, spacing, 0.5, 1000.0, &mut Planes::new(), &mut g);
        let detector = 1.0 / (1.0 + 1000.0 * (0.5 * exact).powi(2));
        for g in g {
            assert!((f64::from(g) / detector - 1.0).abs() < 1e-4, "{g} for {detector}");
        }
    }
}
