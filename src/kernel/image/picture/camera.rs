//! From where a surface is seen: a parallel projection, so that lengths across the line of sight are kept.

/// A view of a box along a direction. Columns go to the right, rows down, depth towards the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Unit vectors to the right, down and towards the viewer.
    axes: [[f64; 3]; 3],
    /// What is in the middle of the picture.
    centre: [f64; 3],
    /// Pixels for a unit of length.
    scale: f64,
    /// Pixels along a row, and rows.
    size: [usize; 2],
}

/// Pixels around what is seen, as a part of the picture.
const MARGIN: f64 = 0.03;

impl Camera {
    /// Sees the box between two corners whole in a picture of `size` pixels, from the direction `from`, with z upwards.
    ///
    /// # Panics
    /// When the direction is that of z, or no direction.
    #[must_use]
    pub fn around([lowest, highest]: [[f64; 3]; 2], from: [f64; 3], size: [usize; 2]) -> Self {
        let towards = unit(from);
        let right = unit(cross([0.0, 0.0, 1.0], towards));
        let down = cross(right, towards);
        assert!([towards, right, down].as_flattened().iter().all(|v| v.is_finite()), "a direction beside z");
        let centre = std::array::from_fn(|a| f64::midpoint(lowest[a], highest[a]));
        let half: [f64; 3] = std::array::from_fn(|a| 0.5 * (highest[a] - lowest[a]));
        let extent = |axis: [f64; 3]| (0..3).map(|a| (axis[a] * half[a]).abs()).sum::<f64>().max(f64::MIN_POSITIVE);
        let fits = |extent: f64, pixels: usize| pixels as f64 * (0.5 - MARGIN) / extent;
        let scale = fits(extent(right), size[0]).min(fits(extent(down), size[1]));
        // A single place has no extent: any scale shows it.
        let scale = if scale.is_finite() { scale } else { 1.0 };
        Self { axes: [right, down, towards], centre, scale, size }
    }

    /// Pixels along a row, and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Pixels for a unit of length.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The unit vector towards the viewer.
    #[must_use]
    pub fn towards(&self) -> [f64; 3] {
        self.axes[2]
    }

    /// A direction of the picture (to the right, down, towards the viewer) in the world.
    #[must_use]
    pub fn direction(&self, [right, down, towards]: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| self.axes[0][a] * right + self.axes[1][a] * down + self.axes[2][a] * towards)
    }

    /// Where a position is seen: column and row in pixels from the upper left corner, and its depth, a length.
    #[must_use]
    #[inline]
    pub fn project(&self, position: [f64; 3]) -> [f64; 3] {
        let from: [f64; 3] = std::array::from_fn(|a| position[a] - self.centre[a]);
        let [right, down, depth] = self.axes.map(|axis| dot(axis, from));
        let [width, height] = self.size.map(|n| 0.5 * n as f64);
        [width + self.scale * right, height + self.scale * down, depth]
    }

    /// The position that is seen at a column and row, at a depth.
    #[must_use]
    pub fn position(&self, [column, row, depth]: [f64; 3]) -> [f64; 3] {
        let [width, height] = self.size.map(|n| 0.5 * n as f64);
        let from = self.direction([(column - width) / self.scale, (row - height) / self.scale, depth]);
        std::array::from_fn(|a| self.centre[a] + from[a])
    }
}

#[inline]
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
pub(super) fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    v.map(|c| c / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_come_back_and_lengths_are_kept() {
        let camera = Camera::around([[-3.0, 1.0, 10.0], [5.0, 2.0, 30.0]], [1.0, -1.2, 0.6], [300, 200]);
        let p = [1.25, 1.5, 12.0];
        let seen = camera.project(p);
        let back = camera.position(seen);
        assert!((0..3).all(|a| (back[a] - p[a]).abs() < 1e-12), "{back:?}");
        for corner in 0..8 {
            let at = std::array::from_fn(|a| [[-3.0, 5.0], [1.0, 2.0], [10.0, 30.0]][a][corner >> a & 1]);
            let [x, y, _] = camera.project(at);
            assert!((0.0..=300.0).contains(&x) && (0.0..=200.0).contains(&y), "{x} {y}");
        }
        // Upwards is up, and what lies towards the viewer is nearer.
        assert!(camera.project([1.0, 1.5, 25.0])[1] < camera.project([1.0, 1.5, 15.0])[1]);
        assert!(camera.project([2.0, 0.3, 20.6])[2] > camera.project([1.0, 1.5, 20.0])[2]);
        // To the right of somebody who looks along y is x.
        let front = Camera::around([[0.0; 3], [1.0; 3]], [0.0, -1.0, 0.0], [100, 100]);
        assert!(front.project([1.0, 0.0, 0.0])[0] > front.project([0.0; 3])[0]);
    }
}
