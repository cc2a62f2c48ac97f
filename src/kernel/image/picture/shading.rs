//! A surface that is seen becomes a picture: each pixel's colour, darker the more the surface turns away from the light.
//!
//! Normals are means over the samples around that belong to the same piece of surface, so that the edges of triangles do not show.

use super::camera::{dot, unit};
use super::panel::{BACKGROUND, Rgb};
use super::z_buffer::{OVERSAMPLING, Sample, UNIT, ZBuffer, samples_of};

/// Samples to each side whose normals count, every second of them.
const AROUND: i64 = 2;
const STEP: usize = 2;
/// Samples whose depths lie further apart than so many of them belong to different pieces.
const APART: f64 = 6.0;
/// Light that comes from everywhere; the rest comes from one side.
const AMBIENT: f64 = 0.42;
/// Where the light comes from: to the right, down and towards the viewer.
const LIGHT: [f64; 3] = [-0.35, -0.5, 0.8];

/// The picture; `colors` are red, green and blue of each pixel's surface, rows from the top.
///
/// # Panics
/// When there are not as many colours as pixels.
#[must_use]
pub fn shaded(buffer: &ZBuffer, colors: &[[u8; 3]]) -> Rgb {
    let [width, height] = buffer.camera().size();
    assert_eq!(colors.len(), width * height, "a colour for each pixel");
    let light = unit(buffer.camera().direction(LIGHT));
    let mut pixels = Vec::with_capacity(3 * width * height);
    for (pixel, color) in colors.iter().enumerate() {
        let samples = samples_of([pixel % width, pixel / width], width);
        let mut sum = [0.0; 3];
        for at in samples {
            let shade = shade(buffer, at, light);
            for (c, sum) in sum.iter_mut().enumerate() {
                *sum += shade.map_or(f64::from(BACKGROUND[c]), |shade| shade * f64::from(color[c]));
            }
        }
        pixels.extend(sum.map(|sum| (sum / samples.len() as f64).round() as u8));
    }
    Rgb { width, height, pixels }
}

/// How light the surface is at a sample, 0 to 1; none where nothing is seen.
fn shade(buffer: &ZBuffer, at: usize, light: [f64; 3]) -> Option<f64> {
    let samples = buffer.samples();
    let Sample { depth, normal, .. } = samples[at];
    let own = normal.map(f64::from);
    if !depth.is_finite() {
        return None;
    }
    let [width, height] = buffer.camera().size().map(|n| (n * OVERSAMPLING) as i64);
    let limit = (APART / (buffer.camera().scale() * OVERSAMPLING as f64)) as f32;
    let (column, row) = (at as i64 % width, at as i64 / width);
    let mut sum = own;
    for y in ((row - AROUND).max(0)..(row + AROUND + 1).min(height)).step_by(STEP) {
        for x in ((column - AROUND).max(0)..(column + AROUND + 1).min(width)).step_by(STEP) {
            let beside = &samples[(y * width + x) as usize];
            let normal = beside.normal.map(f64::from);
            if (beside.depth - depth).abs() <= limit && dot(normal, own) > 0.5 * UNIT * UNIT {
                (0..3).for_each(|c| sum[c] += normal[c]);
            }
        }
    }
    Some(AMBIENT + (1.0 - AMBIENT) * dot(unit(sum), light).max(0.0))
}
