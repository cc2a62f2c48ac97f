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
    /// The triangle's unit normal, turned to the viewer.
    pub(super) normal: [f32; 3],
    /// What its triangle was named.
    pub(super) tag: u32,
}

const NOTHING: Sample = Sample { depth: f32::NEG_INFINITY, normal: [0.0; 3], tag: 0 };

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
    pub tag: u32,
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
    pub fn add(&mut self, corners: [[f64; 3]; 3], tag: u32) {
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

    fn normal_of(&self, [a, b, c]: [[f64; 3]; 3]) -> [f32; 3] {
        let along = |q: [f64; 3]| std::array::from_fn(|n| q[n] - a[n]);
        let normal = cross(along(b), along(c));
        let towards = dot(normal, self.camera.towards());
        let length = dot(normal, normal).sqrt();
        normal.map(|v| (v / length * if towards < 0.0 { -1.0 } else { 1.0 }) as f32)
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
