//! How far the image says that a border is away, and the speed that follows from it and the shape of the outlines.
//! Dense arrays over a box of voxels; lengths physical, outwards positive.

/// Grey values of voxels, that of the border near them, and how it falls outwards across it per smallest spacing.
#[derive(Clone, Copy, Debug)]
pub struct Grey<'a> {
    /// The smoothed image.
    pub values: &'a [f32],
    /// The grey value of the border.
    pub level: &'a [f32],
    /// How it falls.
    pub fall: &'a [f32],
    /// How it falls in the mean.
    pub mean_fall: f32,
}

/// Falls below this part of the mean one count as it.
const LEAST_FALL: f32 = 0.35;

/// How a grey value becomes a distance.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The largest one, in smallest spacings.
    pub most: f32,
    /// How far outside of the border its grey value is, in smallest spacings.
    pub shift: f32,
    /// The smallest spacing.
    pub h: f32,
}

/// The distance to where the border's grey value is, by Newton's step: `D = (I - T) / fall`, less what that lies outside
/// of the border; and how many times less sure that is than in the mean.
pub fn level_offsets(grey: Grey<'_>, by: Step, offsets: &mut [f32], doubts: &mut [f32]) {
    let least = LEAST_FALL * grey.mean_fall.abs();
    let sign = grey.mean_fall.signum();
    for n in 0..offsets.len() {
        let fall = (sign * grey.fall[n]).max(least);
        let away = (sign * (grey.values[n] - grey.level[n]) / fall).clamp(-by.most, by.most);
        offsets[n] = (away - by.shift) * by.h;
        doubts[n] = (grey.mean_fall.abs() / fall).max(1.0);
    }
}

/// What weighs image against shape; `spacing` is the smallest one, deviations are in units of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// The smallest spacing.
    pub spacing: f32,
    /// A factor for the image.
    pub rho: f32,
    /// Deviation of the image's border.
    pub image: f32,
    /// Deviation of the shape at an outline.
    pub shape: f32,
    /// Growth of that with the square of the distance from outlines.
    pub growth: f32,
    /// How far outside of the outlines the image's border lies.
    pub bias: f32,
}

/// Speeds are lengths over so many smallest spacings.
const SPAN: f32 = 3.0;
/// The image counts up to so many deviations from the shape.
const GATE: f32 = 3.0;
/// The fastest.
const FASTEST: f32 = 1.0;
/// An end lies anywhere between the last outline and where the next one would have been marked: the deviation of what is
/// spread evenly from 0 to 1.
pub const OF_AN_END: f32 = 0.289;

/// Where voxels lie; lengths.
#[derive(Clone, Copy, Debug)]
pub struct Places<'a> {
    /// Signed distance to the shape.
    pub shape: &'a [f32],
    /// Distance to the outlines.
    pub distance: &'a [f32],
    /// Distance to the nearest outline's plane.
    pub planes: &'a [f32],
    /// How far beyond the first or last outline.
    pub beyond: &'a [f32],
}

/// The speed outwards at voxels.
pub fn speeds(at: Places<'_>, offsets: &[f32], doubts: &[f32], by: Weights, out: &mut [f32]) {
    let h = by.spacing;
    for n in 0..out.len() {
        let away = at.distance[n].min(at.planes[n]) / h;
        let (grown, end) = (by.growth * away * away, OF_AN_END * at.beyond[n] / h);
        let variance = by.shape * by.shape + grown * grown + end * end;
        let image = by.image * doubts[n] / by.rho.sqrt();
        // No weight where the image's variance is not finite.
        let weight = variance / (variance + image * image);
        let off = at.shape[n] / h - by.bias;
        let reach = GATE * (variance + variance.min(by.image * by.image)).sqrt().max(1.0);
        let beyond = (off.abs() / reach - 1.0).clamp(0.0, 1.0);
        let gate = (1.0 - beyond * beyond) * (1.0 - beyond * beyond);
        let pull = weight * gate * offsets[n] / h - (1.0 - weight * gate) * off;
        out[n] = (pull / SPAN).clamp(-FASTEST, FASTEST);
    }
}
