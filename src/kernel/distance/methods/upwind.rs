//! The upwind (Godunov) solution of `|grad d| = 1` at a voxel (docs/algorithms.md, "Upwind solution"), that of `|grad T| =
//! 1/F` where a speed F is given (docs/algorithms.md, "Travel times"), and which
//! neighbours it is made of, which says where the voxel's source comes from (Kósa & Mikula 2023, Alg. 7, lines 8 to 20;
//! docs/algorithms.md, "Source tracking").
//!
//! With `a_s` the smaller neighbour along axis s, the solution is the x with `sum (((x - a_s)^+) / h_s)^2 = 1`, taken
//! with one, two, then three axes in order of a. Of two equal neighbours along an axis the upper one counts, which Alg.
//! 7 names first; of equal axes x comes before y before z, as its sorting leaves them. An axis counts as entered when
//! the solution without it, rounded as it would be stored, is above its neighbour (lines 15 and 18): rounding must not
//! let in one that is just as far, or symmetric sources would get unequal shares. The source is the one of the voxel at
//! the sum of the offsets of the neighbours that entered; where that voxel has none (the paper is silent there), the
//! one of the first, smallest, of these neighbours.

use crate::kernel::distance::state::precision::{Precision, Real};

/// What the solution needs of the spacing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes<A> {
    spacing: [A; 3],
    /// `1 / h^2`.
    weight: [A; 3],
    /// One over the sum of the other two weights.
    without: [A; 3],
    /// The sum of all weights, and one over it.
    total: [A; 2],
    one: A,
    pub(crate) isotropic: bool,
}

impl<A: Real> Axes<A> {
    pub(crate) fn new(spacing: [f64; 3]) -> Self {
        let weight = spacing.map(|h| 1.0 / (h * h));
        let total: f64 = weight.iter().sum();
        let without = [weight[1] + weight[2], weight[0] + weight[2], weight[0] + weight[1]];
        Self {
            spacing: spacing.map(A::of),
            weight: weight.map(A::of),
            without: without.map(|sum| A::of(1.0 / sum)),
            total: [A::of(total), A::of(1.0 / total)],
            one: A::of(1.0),
            isotropic: spacing.iter().all(|&h| h == spacing[0]),
        }
    }
}

/// One axis of an update: the smaller neighbour, the spacing, its weight, one over the others' weights.
type Axis<A> = (A, A, A, A);

#[inline(always)]
fn order<A: Real, const ISOTROPIC: bool>(axes: &mut [Axis<A>; 3], i: usize, j: usize) {
    let (p, q) = (axes[i], axes[j]);
    let swap = q.0 < p.0;
    let pick = |a: A, b: A| if swap { b } else { a };
    if ISOTROPIC {
        (axes[i].0, axes[j].0) = (pick(p.0, q.0), pick(q.0, p.0));
    } else {
        axes[i] = (pick(p.0, q.0), pick(p.1, q.1), pick(p.2, q.2), pick(p.3, q.3));
        axes[j] = (pick(q.0, p.0), pick(q.1, p.1), pick(q.2, p.2), pick(q.3, p.3));
    }
}

/// An upwind solution.
#[derive(Clone, Copy)]
pub(crate) struct Solution<A> {
    pub(crate) value: A,
    /// The smaller neighbours of the second and the third axis, and the solutions without them.
    second: (A, A),
    third: (A, A),
}

impl<A: Real> Solution<A> {
    /// How many axes entered beside the first, for a solution that is stored as `P`.
    #[inline(always)]
    pub(crate) fn more<P: Precision>(self) -> u32 {
        let enters = |(neighbour, without): (A, A)| u32::from(A::of_lane(P::round(without)) > neighbour);
        let second = enters(self.second);
        second + (second & enters(self.third))
    }
}

/// The upwind solution for the smaller neighbours `near` along the three axes; infinity when all of them are.
#[inline(always)]
pub(crate) fn solve<A: Real, const ISOTROPIC: bool>(near: [A; 3], k: &Axes<A>) -> Solution<A> {
    solve_at::<A, ISOTROPIC, false>(near, k, k.one)
}

/// The same where values are times and a front passes the voxel at `speed`; at 0 it never does. Where not `UNEVEN`, values
/// are distances and there is no speed.
///
/// Values are counted from the smallest neighbour, so that nothing cancels, and times are turned into lengths, so that
/// nothing overflows. Without branches: every lane of a vector computes all three solutions and keeps the one that holds.
#[inline(always)]
pub(crate) fn solve_at<A: Real, const ISOTROPIC: bool, const UNEVEN: bool>(
    near: [A; 3],
    k: &Axes<A>,
    speed: A,
) -> Solution<A> {
    let slowness = if UNEVEN { speed.inverse() } else { k.one };
    let length = |time: A| if UNEVEN { time * speed } else { time };
    let time = |length: A| if UNEVEN { length * slowness } else { length };
    let axis = |a: usize| (near[a], k.spacing[a], k.weight[a], k.without[a]);
    let mut axes = [axis(0), axis(1), axis(2)];
    order::<A, ISOTROPIC>(&mut axes, 0, 1);
    order::<A, ISOTROPIC>(&mut axes, 1, 2);
    order::<A, ISOTROPIC>(&mut axes, 0, 1);
    let [(first, h, w1, _), (second, _, w2, _), (third, _, w3, without_third)] = axes;
    let (b, c) = (length(second - first), length(third - first));
    let zero = A::default();
    // The larger root of sum w (x - a)^2 = 1 over two axes, then over three.
    let mean = w2 * b;
    let discriminant = mean * mean - (w1 + w2) * (mean * b - k.one);
    let of_two = (mean + discriminant.larger(zero).root()) * without_third;
    let mean3 = mean + w3 * c;
    let discriminant = mean3 * mean3 - k.total[0] * (mean * b + w3 * c * c - k.one);
    let of_three = (mean3 + discriminant.larger(zero).root()) * k.total[1];
    let two = if h > b { of_two } else { h };
    let x = if two > c { of_three } else { two };
    Solution { value: first + time(x), second: (second, first + time(h)), third: (third, first + time(two)) }
}

/// The upwind solution alone.
#[inline(always)]
pub(crate) fn godunov<A: Real, const ISOTROPIC: bool>(near: [A; 3], k: &Axes<A>) -> A {
    solve::<A, ISOTROPIC>(near, k).value
}

/// The upwind solution alone, at a speed.
#[inline(always)]
pub(crate) fn godunov_at<A: Real, const ISOTROPIC: bool, const UNEVEN: bool>(near: [A; 3], k: &Axes<A>, speed: A) -> A {
    solve_at::<A, ISOTROPIC, UNEVEN>(near, k, speed).value
}

/// The neighbours that entered a voxel's upwind solution: bit a that the upper one along axis a counts, bit 3 + a that
/// axis a entered, from bit 6 on the axis that was first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Upwind(pub(crate) u8);

impl Upwind {
    /// For neighbours in the order -x, +x, -y, +y, -z, +z, when so many axes entered beside the first. Without
    /// branches: bits of whole lanes.
    #[inline(always)]
    pub(crate) fn new<L: Real>([xl, xu, yl, yu, zl, zu]: [L; 6], more: u32) -> Self {
        let is = u32::from;
        let [x, y, z] = [xu.smaller(xl), yu.smaller(yl), zu.smaller(zl)];
        let sides = is(xu <= xl) | is(yu <= yl) << 1 | is(zu <= zl) << 2;
        // The axes that come first and last in a sorting that keeps the order of equal ones.
        let x_first = is(x <= y) & is(x <= z);
        let y_first = (1 - x_first) & is(y <= z);
        let z_first = 1 - (x_first | y_first);
        let z_last = is(z >= x) & is(z >= y);
        let y_last = (1 - z_last) & is(y >= x);
        let x_last = 1 - (z_last | y_last);
        let (second, third) = (is(more > 0), is(more > 1));
        let entered = |first: u32, last: u32| first | (second & (1 - last)) | third;
        let axes = entered(x_first, x_last) | entered(y_first, y_last) << 1 | entered(z_first, z_last) << 2;
        Self((sides | axes << 3 | y_first << 6 | z_first << 7) as u8)
    }

    /// The step to the neighbour along an axis.
    fn step(self, axis: usize) -> [i8; 3] {
        let mut step = [0; 3];
        step[axis] = if self.0 >> axis & 1 == 1 { 1 } else { -1 };
        step
    }

    fn first_axis(self) -> usize {
        usize::from(self.0 >> 6).min(2)
    }

    /// The sum of the offsets of the neighbours that entered, one of 26.
    pub(crate) fn sum(self) -> [i8; 3] {
        std::array::from_fn(|a| if self.0 >> (3 + a) & 1 == 1 { self.step(a)[a] } else { 0 })
    }

    /// The offset of the first neighbour that entered.
    pub(crate) fn first(self) -> [i8; 3] {
        self.step(self.first_axis())
    }

    /// As if the first neighbour alone had entered.
    pub(crate) fn first_alone(self) -> Self {
        Self(self.0 & 0b1100_0111 | 8 << self.first_axis())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(beside: [f64; 6]) -> Upwind {
        let near = std::array::from_fn(|a| beside[2 * a].min(beside[2 * a + 1]));
        let axes = Axes::new([1.0; 3]);
        let (equal, any) = (solve::<_, true>(near, &axes).more::<f64>(), solve::<_, false>(near, &axes).more::<f64>());
        assert_eq!(equal, any);
        Upwind::new(beside, equal)
    }

    #[test]
    fn neighbours_enter_in_order_of_their_values() {
        const FAR: f64 = f64::INFINITY;
        for (beside, sum, first) in [
            ([FAR, FAR, 3.0, FAR, FAR, FAR], [0, -1, 0], [0, -1, 0]),
            ([FAR, 3.5, 3.0, FAR, 4.5, FAR], [1, -1, 0], [0, -1, 0]),
            ([2.0, 3.5, 3.0, 2.1, 2.2, 2.2], [-1, 1, 1], [-1, 0, 0]),
            // Exactly one spacing apart does not enter.
            ([FAR, 1.0, 2.0, FAR, FAR, FAR], [1, 0, 0], [1, 0, 0]),
            // All equal: upper sides, x first.
            ([1.0; 6], [1, 1, 1], [1, 0, 0]),
            ([FAR, FAR, 1.0, 1.0, 1.0, FAR], [0, 1, -1], [0, 1, 0]),
        ] {
            let found = of(beside);
            assert_eq!((found.sum(), found.first()), (sum, first), "{beside:?}");
            assert_eq!((found.first_alone().sum(), found.first_alone().first()), (first, first), "{beside:?}");
        }
    }

    /// The solution is the root of its equation: checked against bisection, which knows nothing of cases.
    #[test]
    fn at_a_speed_the_gradient_is_the_slowness() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        for _ in 0..2000 {
            let spacing = [0.5 + random(), 0.5 + random(), 0.5 + random()];
            let speed = libm::pow(10.0, 6.0 * random() - 3.0);
            let near = [2.0 * random() / speed, 2.0 * random() / speed, 2.0 * random() / speed];
            let excess = |x: f64| {
                let sum: f64 = (0..3).map(|a| ((x - near[a]).max(0.0) / spacing[a]).powi(2)).sum();
                sum - 1.0 / (speed * speed)
            };
            let (mut low, mut high) = (0.0, 10.0 / speed);
            for _ in 0..200 {
                let middle = f64::midpoint(low, high);
                if excess(middle) < 0.0 { low = middle } else { high = middle }
            }
            let found = solve_at::<f64, false, true>(near, &Axes::new(spacing), speed).value;
            assert!((found - low).abs() <= 1e-12 * low, "{found} {low} at {speed}");
        }
    }

    #[test]
    fn nothing_passes_where_the_speed_is_zero_and_speed_one_is_no_speed() {
        const FAR: f64 = f64::INFINITY;
        let axes = Axes::new([0.5, 1.0, 0.25]);
        for near in [[1.0, 1.1, 1.2], [FAR, 1.0, FAR], [FAR, 1.0, 1.05], [FAR; 3]] {
            assert_eq!(solve_at::<f64, false, true>(near, &axes, 0.0).value, FAR, "{near:?}");
            let plain = solve::<f64, false>(near, &axes).value;
            assert_eq!(solve_at::<f64, false, true>(near, &axes, 1.0).value, plain, "{near:?}");
            assert_eq!(solve_at::<f64, false, true>(near.map(|a| 0.25 * a), &axes, 4.0).value, 0.25 * plain);
        }
    }
}
