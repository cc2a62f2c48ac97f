//! What is seen of triangles: of each sample of a picture the nearest (Catmull 1974). Triangles come one by one and none is
//! kept, so a surface may be of any size.

use super::camera::{Camera, cross, dot};

/// Samples along the edge of a pixel.
pub(super) const OVERSAMPLING: usize = 2;

/// The nearest place at a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Depth, a length towards the viewer; minus infinity where nothing is seen.
    pub(super) depth: f32,
    /// The triangle's unit normal, turned to the viewer, in [`UNIT`]s.
    pub(super) normal: [i16; 3],
    /// What its triangle was named.
    pub(super) tag: u16,
}

const NOTHING: Sample = Sample { depth: f32::NEG_INFINITY, normal: [0; 3], tag: 0 };
/// A normal is kept in whole numbers, its length this.
pub(super) const UNIT: f64 = 32_000.0;

/// A picture in the making.
#[derive(Clone, Debug)]
pub struct ZBuffer {
    camera: Camera,
    /// Rows from the top, two samples to a pixel along each axis.
    samples: Vec<Sample>,
}

/// What is seen at a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// The pixel, rows from the top.
    pub pixel: usize,
    /// The position.
    pub place: [f64; 3],
    /// What its triangle was named.
    pub tag: u16,
}

impl ZBuffer {
    /// A picture in which nothing is seen yet.
    #[must_use]
    pub fn new(camera: Camera) -> Self {
        let [width, height] = camera.size().map(|n| n * OVERSAMPLING);
        Self { camera, samples: vec![NOTHING; width * height] }
    }

    /// Bytes that a picture of `size` pixels takes.
    #[must_use]
    pub fn bytes([width, height]: [usize; 2]) -> u64 {
        (width * height * OVERSAMPLING * OVERSAMPLING * size_of::<Sample>()) as u64
    }

    /// From where it is seen.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    pub(super) fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// Adds a triangle named `tag`. Of two at the same depth the first is seen; one that is seen edge on, or has no area, is not.
    pub fn add(&mut self, corners: [[f64; 3]; 3], tag: u16) {
        let step = OVERSAMPLING as f64;
        let at = corners.map(|corner| {
            let [column, row, depth] = self.camera.project(corner);
            [column * step - 0.5, row * step - 0.5, depth]
        });
        let size = self.camera.size().map(|n| n * OVERSAMPLING);
        let span = |a: usize| {
            let (low, high) =
                at.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[a]), h.max(p[a])));
            // Samples lie at whole numbers; what is no number is nowhere.
            (low.ceil().max(0.0) as usize, (high.floor() + 1.0).clamp(0.0, size[a] as f64) as usize)
        };
        let (columns, rows) = (span(0), span(1));
        if columns.0 >= columns.1 || rows.0 >= rows.1 {
            return;
        }
        let side = |p: [f64; 3], q: [f64; 3], x: f64, y: f64| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        let area = side(at[0], at[1], at[2][0], at[2][1]);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        let normal = self.normal_of(corners);
        for row in rows.0..rows.1 {
            for column in columns.0..columns.1 {
                let (x, y) = (column as f64, row as f64);
                let shares = [side(at[1], at[2], x, y), side(at[2], at[0], x, y), side(at[0], at[1], x, y)];
                let shares = shares.map(|share| share / area);
                if shares.iter().any(|&share| share < 0.0) {
                    continue;
                }
                let depth = (0..3).map(|n| shares[n] * at[n][2]).sum::<f64>() as f32;
                let sample = &mut self.samples[row * size[0] + column];
                if depth > sample.depth {
                    *sample = Sample { depth, normal, tag };
                }
            }
        }
    }

    fn normal_of(&self, [a, b, c]: [[f64; 3]; 3]) -> [i16; 3] {
        let along = |q: [f64; 3]| std::array::from_fn(|n| q[n] - a[n]);
        let normal = cross(along(b), along(c));
        let towards = dot(normal, self.camera.towards());
        let length = dot(normal, normal).sqrt();
        let turned = if towards < 0.0 { -UNIT } else { UNIT };
        normal.map(|v| (v / length * turned).round() as i16)
    }

    /// What is seen at each pixel that shows anything: the nearest of its samples.
    pub fn seen(&self) -> impl Iterator<Item = Seen> + '_ {
        let [width, height] = self.camera.size();
        (0..width * height).filter_map(move |pixel| {
            let (column, row) = (pixel % width, pixel / width);
            let samples = samples_of([column, row], width);
            let near = |a: &usize, b: &usize| self.samples[*a].depth.total_cmp(&self.samples[*b].depth);
            let nearest = samples.into_iter().max_by(near)?;
            let Sample { depth, tag, .. } = self.samples[nearest];
            let at = [nearest % (width * OVERSAMPLING), nearest / (width * OVERSAMPLING)];
            let [x, y] = at.map(|n| (n as f64 + 0.5) / OVERSAMPLING as f64);
            let place = || self.camera.position([x, y, f64::from(depth)]);
            depth.is_finite().then(|| Seen { pixel, place: place(), tag })
        })
    }

    /// Where a position is seen, in pixels from the upper left corner; none where something hides it by more than `slack`, or it
    /// lies outside of the picture.
    #[must_use]
    pub fn shows(&self, position: [f64; 3], slack: f64) -> Option<[f64; 2]> {
        let [width, height] = self.camera.size();
        let [x, y, depth] = self.camera.project(position);
        let inside = x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64;
        let at = || (y * OVERSAMPLING as f64) as usize * width * OVERSAMPLING + (x * OVERSAMPLING as f64) as usize;
        (inside && depth + slack >= f64::from(self.samples[at()].depth)).then_some([x, y])
    }
}

/// The places of a pixel's samples.
pub(super) fn samples_of([column, row]: [usize; 2], width: usize) -> [usize; OVERSAMPLING * OVERSAMPLING] {
    std::array::from_fn(|n| {
        let (x, y) = (OVERSAMPLING * column + n % OVERSAMPLING, OVERSAMPLING * row + n / OVERSAMPLING);
        y * width * OVERSAMPLING + x
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::image::picture::shading::shaded;

    const CENTRE: [f64; 3] = [3.0, -2.0, 40.0];
    const RADIUS: f64 = 2.5;

    /// A ball of triangles between circles of latitude.
    fn ball(buffer: &mut ZBuffer) {
        let (rings, sectors) = (90, 180);
        let at = |ring: usize, sector: usize| {
            let (height, turn) = (
                std::f64::consts::PI * ring as f64 / rings as f64,
                std::f64::consts::TAU * sector as f64 / sectors as f64,
            );
            let out = [libm::sin(height) * libm::cos(turn), libm::sin(height) * libm::sin(turn), libm::cos(height)];
            std::array::from_fn(|a| CENTRE[a] + RADIUS * out[a])
        };
        for (ring, sector) in (0..rings).flat_map(|ring| (0..sectors).map(move |sector| (ring, sector))) {
            let [a, b, c, d] = [at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1), at(ring, sector + 1)];
            buffer.add([a, b, c], 1);
            buffer.add([a, c, d], 1);
        }
    }

    fn around_ball(from: [f64; 3]) -> ZBuffer {
        let box_ = [CENTRE.map(|c| c - RADIUS), CENTRE.map(|c| c + RADIUS)];
        ZBuffer::new(Camera::around(box_, from, [200, 160]))
    }

    #[test]
    fn a_ball_has_the_outline_and_the_depth_of_a_ball() {
        for from in [[0.0, -1.0, 0.0], [0.55, -1.0, 0.5], [-1.0, 0.2, -2.0]] {
            let mut buffer = around_ball(from);
            ball(&mut buffer);
            let scale = buffer.camera().scale() * OVERSAMPLING as f64;
            let area = buffer.samples.iter().filter(|sample| sample.depth.is_finite()).count() as f64;
            let expected = std::f64::consts::PI * (RADIUS * scale).powi(2);
            assert!((area / expected - 1.0).abs() < 0.005, "{area} of {expected} samples");
            let mut seen = 0;
            for Seen { place, tag, .. } in buffer.seen() {
                let off: [f64; 3] = std::array::from_fn(|a| place[a] - CENTRE[a]);
                assert_eq!(tag, 1);
                // Triangles cut off at most the height of an arc of two degrees.
                assert!((dot(off, off).sqrt() / RADIUS - 1.0).abs() < 1e-3);
                assert!(dot(off, buffer.camera().towards()) > -0.05 * RADIUS, "the side towards the viewer");
                seen += 1;
            }
            assert!(seen as f64 > 0.99 * area / 4.0);
        }
    }

    #[test]
    fn of_two_triangles_the_nearer_is_seen_in_any_order() {
        let camera = Camera::around([[0.0; 3], [1.0; 3]], [0.0, -1.0, 0.0], [60, 60]);
        let near = [[0.0, 0.2, 0.0], [1.0, 0.2, 0.0], [0.0, 0.2, 1.0]];
        let far = [[0.0, 0.8, 0.0], [1.0, 0.8, 0.0], [1.0, 0.8, 1.0]];
        let mut pictures = Vec::new();
        for order in [[0, 1], [1, 0]] {
            let mut buffer = ZBuffer::new(camera);
            for n in order {
                buffer.add([near, far][n], n as u16 + 1);
            }
            let mut colors = vec![[0; 3]; 3600];
            buffer.seen().for_each(|seen| colors[seen.pixel] = [[200, 0, 0], [0, 200, 0]][usize::from(seen.tag) - 1]);
            let picture = shaded(&buffer, &colors);
            let at = |x: f64, z: f64| {
                let [column, row, _] = camera.project([x, 0.5, z]);
                picture.pixels[3 * (row as usize * 60 + column as usize)..][..3].to_vec()
            };
            // Where both lie, the near one; where it does not reach, the far one; where neither is, the ground.
            assert!(at(0.5, 0.2)[0] > 60 && at(0.5, 0.2)[1] == 0, "{:?}", at(0.5, 0.2));
            assert!(at(0.85, 0.5)[1] > 60 && at(0.85, 0.5)[0] == 0);
            assert_eq!(at(0.4, 0.9), crate::kernel::image::picture::panel::BACKGROUND);
            let hidden = buffer.shows([0.5, 0.7, 0.2], 0.1);
            assert!(hidden.is_none() && buffer.shows([0.5, 0.1, 0.2], 0.1).is_some());
            pictures.push(picture);
        }
        assert_eq!(pictures[0], pictures[1]);
    }

    #[test]
    fn what_has_no_area_or_lies_elsewhere_is_not_seen() {
        let mut buffer = around_ball([0.0, -1.0, 0.0]);
        let edge_on = [[0.0, 0.0, 40.0], [0.0, 5.0, 40.0], [0.0, 5.0, 41.0]].map(|p: [f64; 3]| [3.0, p[1], p[2]]);
        for corners in [edge_on, [CENTRE; 3], [[f64::NAN; 3]; 3], [[1e300; 3]; 3], [[900.0, 0.0, 0.0]; 3]] {
            buffer.add(corners, 1);
        }
        assert_eq!(buffer.seen().count(), 0);
    }
}
