//! Pictures of slices: a grey image in a window of intensities, the outlines of labels drawn over it in colour.
//!
//! Between pixels grey values are interpolated linearly. A point belongs to the label with the largest share of the
//! pixels around it, weighted by a Gaussian: outlines are smooth curves close to the labels' edges. Objects too thin
//! for that keep the edges of their pixels, so that nothing is smoothed away.

use super::palette::label_color;

/// A colour picture: rows from the top, red, green and blue of each pixel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgb {
    /// Pixels along a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// `3 * width * height` values.
    pub pixels: Vec<u8>,
}

/// One slice through an image and its labels, dense `[row][column]`.
#[derive(Clone, Copy, Debug)]
pub struct Slice<'a> {
    /// Intensities.
    pub grey: &'a [f32],
    /// Labels, 0 for background.
    pub labels: &'a [u32],
    /// Pixels along a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Height of a pixel in units of its width: the slice is stretched so that lengths come out right.
    pub pixel_aspect: f64,
}

/// Samples along the edge of a drawn pixel, for smooth lines.
const OVERSAMPLING: usize = 3;
/// Width of an outline in drawn pixels; it lies on the object's side of the edge.
const LINE_WIDTH: f64 = 1.7;
/// How much of its colour an object's inside takes on.
const TINT: f64 = 0.08;
pub(super) const BACKGROUND: [u8; 3] = [16, 17, 20];
/// Pixels between pictures and around them.
const MARGIN: usize = 8;

/// The intensities below which the fractions `low` and `high` of the finite values lie; never an empty window.
#[must_use]
pub fn percentile_window(values: &[f32], low: f64, high: f64) -> [f32; 2] {
    let mut sorted: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return [0.0, 1.0] };
    let [black, white] = [low, high].map(|f| sorted[((last as f64 * f.clamp(0.0, 1.0)).round() as usize).min(last)]);
    if white > black { [black, white] } else { [black, black + 1.0] }
}

/// Draws a slice with `scale` pixels to a slice's pixel along its rows; `window` are the intensities of black and
/// white.
///
/// # Panics
/// When the slices do not fit their size, the size is zero, or scale or aspect is not positive.
#[must_use]
pub fn panel(slice: &Slice<'_>, window: [f32; 2], scale: f64) -> Rgb {
    let len = slice.width * slice.height;
    assert!(len > 0 && slice.grey.len() == len && slice.labels.len() == len, "the slices do not fit their size");
    let step = [1.0 / scale, 1.0 / (scale * slice.pixel_aspect)];
    assert!(step.iter().all(|s| s.is_finite() && *s > 0.0), "scale and aspect must be positive");
    let size = |n: usize, step: f64| ((n as f64 / step).round() as usize).max(1);
    let (width, height) = (size(slice.width, step[0]), size(slice.height, step[1]));
    let outlined = outlines(slice, [width * OVERSAMPLING, height * OVERSAMPLING]);
    let mut pixels = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            let grey = window_level(slice.grey_at(slice.place([column, row], [width, height])), window);
            pixels.extend(outlined.blend([column, row], grey));
        }
    }
    Rgb { width, height, pixels }
}

/// Puts pictures in a row, centred, with a margin, on a dark background.
#[must_use]
pub fn side_by_side(pictures: &[Rgb]) -> Rgb {
    let width = pictures.iter().map(|p| p.width + MARGIN).sum::<usize>() + MARGIN;
    let height = pictures.iter().map(|p| p.height).max().unwrap_or(0) + 2 * MARGIN;
    let mut pixels = BACKGROUND.repeat(width * height);
    let mut left = MARGIN;
    for picture in pictures {
        let top = (height - picture.height) / 2;
        for (row, source) in picture.pixels.chunks(3 * picture.width.max(1)).enumerate() {
            pixels[3 * ((top + row) * width + left)..][..source.len()].copy_from_slice(source);
        }
        left += picture.width + MARGIN;
    }
    Rgb { width, height, pixels }
}

fn window_level(value: f32, [black, white]: [f32; 2]) -> f64 {
    let level = (f64::from(value) - f64::from(black)) / (f64::from(white) - f64::from(black));
    // A value that is no number is drawn black.
    if level.is_nan() { 0.0 } else { 255.0 * level.clamp(0.0, 1.0) }
}

impl Slice<'_> {
    /// The middle of sample `at` of a drawing of `size` samples, in pixels of the slice, whole numbers at centres.
    pub(super) fn place(&self, at: [usize; 2], size: [usize; 2]) -> [f64; 2] {
        let extent = [self.width as f64, self.height as f64];
        std::array::from_fn(|a| (at[a] as f64 + 0.5) * extent[a] / size[a] as f64 - 0.5)
    }

    /// The four pixels around a place and their shares.
    fn neighbours(&self, place: [f64; 2]) -> [(usize, f64); 4] {
        let last = [self.width - 1, self.height - 1];
        let inside: [f64; 2] = std::array::from_fn(|a| place[a].clamp(0.0, last[a] as f64));
        let low: [usize; 2] = inside.map(|v| v as usize);
        let high: [usize; 2] = std::array::from_fn(|a| (low[a] + 1).min(last[a]));
        let [u, v]: [f64; 2] = std::array::from_fn(|a| inside[a] - low[a] as f64);
        let at = |x: usize, y: usize| y * self.width + x;
        [
            (at(low[0], low[1]), (1.0 - u) * (1.0 - v)),
            (at(high[0], low[1]), u * (1.0 - v)),
            (at(low[0], high[1]), (1.0 - u) * v),
            (at(high[0], high[1]), u * v),
        ]
    }

    pub(super) fn grey_at(&self, place: [f64; 2]) -> f32 {
        self.neighbours(place).iter().map(|&(at, share)| f64::from(self.grey[at]) * share).sum::<f64>() as f32
    }

    /// The labels of the 25 pixels around one; beyond the border the nearest pixel's.
    fn labels_around(&self, pixel: [usize; 2]) -> [[u32; 5]; 5] {
        let near = |a: usize, n: usize| AROUND.map(|step| (pixel[a] as i64 + step).clamp(0, n as i64 - 1) as usize);
        let (columns, rows) = (near(0, self.width), near(1, self.height));
        rows.map(|y| columns.map(|x| self.labels[y * self.width + x]))
    }

    /// The labels at the samples of a drawing of `size` samples.
    fn sampled_labels(&self, size: [usize; 2]) -> Vec<u32> {
        let pixels = (0..self.height).flat_map(|y| (0..self.width).map(move |x| [x, y]));
        let keeps: Vec<bool> = pixels.map(|pixel| keeps_its_label(&self.labels_around(pixel))).collect();
        // Half-way places lie in the first and last pixels' halves, which round inside.
        let along = |a: usize, n: usize| {
            let place = self.place([n, n], size)[a];
            let pixel = place.round() as usize;
            (pixel, weights(place - pixel as f64))
        };
        let columns: Vec<(usize, [f64; 5])> = (0..size[0]).map(|n| along(0, n)).collect();
        let mut labels = Vec::with_capacity(size[0] * size[1]);
        for (y, down) in (0..size[1]).map(|n| along(1, n)) {
            let mut known = (usize::MAX, [[0; 5]; 5]);
            for (x, across) in &columns {
                let at = y * self.width + x;
                if !keeps[at] && known.0 != at {
                    known = (at, self.labels_around([*x, y]));
                }
                labels.push(if keeps[at] { self.labels[at] } else { largest_share(&known.1, across, &down) });
            }
        }
        labels
    }
}

/// Pixels before and after the nearest one whose labels count.
const AROUND: [i64; 5] = [-2, -1, 0, 1, 2];
/// A label with fewer of the 25 pixels is a line or a dot.
const THIN: usize = 6;

/// True where all pixels around agree with the middle one, or hardly any.
fn keeps_its_label(labels: &[[u32; 5]; 5]) -> bool {
    let alike = labels.iter().flatten().filter(|&&label| label == labels[2][2]).count();
    alike == 25 || alike < THIN
}

/// How much the pixels around count at a point that lies `offset` from the middle one, along an axis.
fn weights(offset: f64) -> [f64; 5] {
    // Standard deviation 0.9 pixels: steps of one pixel become slopes, and nothing moves further than half a pixel.
    AROUND.map(|step| libm::exp(-(step as f64 - offset).powi(2) / (2.0 * 0.9 * 0.9)))
}

/// The label of the largest share where columns and rows count so much.
fn largest_share(labels: &[[u32; 5]; 5], across: &[f64; 5], down: &[f64; 5]) -> u32 {
    let (mut shares, mut count) = ([(0_u32, 0.0_f64); 25], 0);
    for (row, down) in labels.iter().zip(down) {
        for (&label, across) in row.iter().zip(across) {
            let known = shares[..count].iter().position(|(other, _)| *other == label);
            let at = known.unwrap_or(count);
            count = count.max(at + 1);
            shares[at] = (label, shares[at].1 + across * down);
        }
    }
    // Equal shares go to the larger label: the same whatever the order of the pixels.
    let larger = |a: &&(u32, f64), b: &&(u32, f64)| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0));
    shares[..count].iter().max_by(larger).map_or(labels[2][2], |(label, _)| *label)
}

/// The labels of a slice at the samples of its drawing, and which samples lie on an outline.
struct Outlines {
    width: usize,
    labels: Vec<u32>,
    drawn: Vec<bool>,
}

fn outlines(slice: &Slice<'_>, size: [usize; 2]) -> Outlines {
    let [width, height] = size;
    let labels = slice.sampled_labels(size);
    let mut outlined = Outlines { width, drawn: vec![false; labels.len()], labels };
    let reach = (LINE_WIDTH * OVERSAMPLING as f64) as i64;
    for row in 0..height {
        for column in 0..width {
            if outlined.on_edge([column, row], size) {
                outlined.draw_disc([column as i64, row as i64], reach, size);
            }
        }
    }
    outlined
}

impl Outlines {
    /// True where an object's sample touches one that is not of the object; the drawing's border is no edge.
    fn on_edge(&self, [column, row]: [usize; 2], [width, height]: [usize; 2]) -> bool {
        let at = row * width + column;
        let label = self.labels[at];
        let other = |at: usize| self.labels[at] != label;
        label != 0
            && ((column > 0 && other(at - 1))
                || (column + 1 < width && other(at + 1))
                || (row > 0 && other(at - width))
                || (row + 1 < height && other(at + width)))
    }

    /// Draws the samples of the same object around one on its edge.
    fn draw_disc(&mut self, centre: [i64; 2], reach: i64, size: [usize; 2]) {
        let label = self.labels[centre[1] as usize * self.width + centre[0] as usize];
        let span = |a: usize| (centre[a] - reach).max(0)..(centre[a] + reach + 1).min(size[a] as i64);
        for y in span(1) {
            for x in span(0) {
                let at = y as usize * self.width + x as usize;
                let distance2 = (x - centre[0]).pow(2) + (y - centre[1]).pow(2);
                // The centre sample itself is one of the line's width.
                if distance2 < reach * reach && self.labels[at] == label {
                    self.drawn[at] = true;
                }
            }
        }
    }

    /// The colour of a drawn pixel: the mean over its samples of outline, tinted inside and plain grey.
    fn blend(&self, [column, row]: [usize; 2], grey: f64) -> [u8; 3] {
        let mut sum = [0.0; 3];
        let mut known = (0, label_color(0));
        for y in row * OVERSAMPLING..(row + 1) * OVERSAMPLING {
            for x in column * OVERSAMPLING..(column + 1) * OVERSAMPLING {
                let at = y * self.width + x;
                let label = self.labels[at];
                if label != known.0 {
                    known = (label, label_color(label));
                }
                let opacity = if self.drawn[at] { 1.0 } else { TINT * f64::from(u8::from(label != 0)) };
                for (sum, color) in sum.iter_mut().zip(known.1) {
                    *sum += opacity * f64::from(color) + (1.0 - opacity) * grey;
                }
            }
        }
        sum.map(|sum| (sum / (OVERSAMPLING * OVERSAMPLING) as f64).round() as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixel(picture: &Rgb, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * picture.width + x);
        picture.pixels[at..at + 3].try_into().unwrap()
    }

    #[test]
    fn plain_grey_is_windowed_and_stretched() {
        let grey = [10.0, 20.0, 30.0, 5.0, f32::NAN, 90.0];
        let slice = Slice { grey: &grey, labels: &[0; 6], width: 3, height: 2, pixel_aspect: 2.0 };
        let picture = panel(&slice, [10.0, 30.0], 1.0);
        assert_eq!((picture.width, picture.height), (3, 4));
        // Rows of the drawing lie at -0.25, 0.25, 0.75 and 1.25 rows of the slice.
        assert_eq!(pixel(&picture, 0, 0), [0; 3]);
        assert_eq!(pixel(&picture, 1, 0), [0; 3], "the number that is none reaches as far as it is interpolated");
        assert_eq!(pixel(&picture, 2, 0), [255; 3]);
        let slice = Slice { grey: &[10.0, 20.0, 30.0], labels: &[0; 3], width: 3, height: 1, pixel_aspect: 1.0 };
        assert_eq!(panel(&slice, [10.0, 30.0], 1.0).pixels, [0, 0, 0, 128, 128, 128, 255, 255, 255]);
    }

    #[test]
    fn outlines_follow_a_disc() {
        let n = 40_usize;
        let radius = |x: f64, y: f64| (x - 19.5).hypot(y - 19.5);
        let labels: Vec<u32> = (0..n * n).map(|i| u32::from(radius((i % n) as f64, (i / n) as f64) < 12.0)).collect();
        let grey = vec![0.0; n * n];
        let scale = 4.0;
        let picture =
            panel(&Slice { grey: &grey, labels: &labels, width: n, height: n, pixel_aspect: 1.0 }, [0.0, 1.0], scale);
        let color = label_color(1);
        let mut full = 0;
        for y in 0..picture.height {
            for x in 0..picture.width {
                let r = radius((x as f64 + 0.5) / scale - 0.5, (y as f64 + 0.5) / scale - 0.5);
                let found = pixel(&picture, x, y);
                full += usize::from(found == color);
                if found == color {
                    assert!((10.5..12.8).contains(&r), "outline {r} from the centre");
                } else if r > 13.0 {
                    assert_eq!(found, [0; 3]);
                }
            }
        }
        // One to two pixels wide all around a circle of radius 48.
        assert!((200..700).contains(&full), "{full} pixels of outline");
    }

    #[test]
    fn neighbours_get_a_line_each_and_the_border_none() {
        let labels: Vec<u32> = (0..20 * 10).map(|i| if i % 20 < 10 { 1 } else { 2 }).collect();
        let slice = Slice { grey: &[0.0; 200], labels: &labels, width: 20, height: 10, pixel_aspect: 1.0 };
        let picture = panel(&slice, [0.0, 1.0], 4.0);
        assert_eq!(pixel(&picture, 39, 20), label_color(1));
        assert_eq!(pixel(&picture, 40, 20), label_color(2));
        assert_ne!(pixel(&picture, 0, 20), label_color(1));
        assert_ne!(pixel(&picture, 20, 0), label_color(1));
    }

    #[test]
    fn pictures_stand_in_a_row() {
        let picture = |width, height, value: u8| Rgb { width, height, pixels: vec![value; 3 * width * height] };
        let row = side_by_side(&[picture(4, 10, 200), picture(3, 2, 100)]);
        assert_eq!((row.width, row.height), (4 + 3 + 3 * MARGIN, 10 + 2 * MARGIN));
        assert_eq!(pixel(&row, MARGIN, MARGIN), [200; 3]);
        assert_eq!(pixel(&row, 2 * MARGIN + 4, MARGIN + 4), [100; 3]);
        assert_eq!(pixel(&row, 2 * MARGIN + 4, MARGIN + 3), BACKGROUND);
        let drawn = row.pixels.chunks(3).filter(|p| *p != BACKGROUND).count();
        assert_eq!(drawn, 40 + 6);
    }

    #[test]
    fn single_pixels_still_show() {
        let mut labels = vec![0; 25];
        labels[12] = 3;
        let slice = Slice { grey: &[0.0; 25], labels: &labels, width: 5, height: 5, pixel_aspect: 1.0 };
        let picture = panel(&slice, [0.0, 1.0], 8.0);
        let drawn = picture.pixels.chunks(3).filter(|p| *p != [0; 3]).count();
        assert_eq!(drawn, 64, "the pixel is 8 by 8");
    }

    #[test]
    fn windows_are_never_empty() {
        let ramp: Vec<f32> = (0..=1000).map(|v| v as f32).rev().collect();
        assert_eq!(percentile_window(&ramp, 0.01, 0.9), [10.0, 900.0]);
        assert_eq!(percentile_window(&[7.0, f32::NAN], 0.0, 1.0), [7.0, 8.0]);
        assert_eq!(percentile_window(&[], 0.0, 1.0), [0.0, 1.0]);
    }
}
