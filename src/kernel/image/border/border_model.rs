//! Which border the image shows under the marks, and how well it tells where that is.
//!
//! *Level*: inside and outside differ in brightness, and the border runs where the grey value is that under the
//! outlines. *Wall*: a bright (or dark) sheet runs along the border, which lies on its crest. Told by the profiles at
//! the marks: a wall stands out from both its flanks, a step from one.

use super::profiles::{LEN, Profile, REACH, STEP};

/// What the image shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BorderModel {
    /// A step of brightness; positive where the inside is brighter.
    Level,
    /// The crest of a sheet that is brighter (1) or darker (-1) than what is beside it.
    Wall(f32),
    /// Nothing that could be relied on.
    None,
}

/// What the profiles at marks say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// What is shown.
    pub model: BorderModel,
    /// How far outside of the marks the border lies in the mean, in smallest spacings.
    pub bias: f64,
    /// Height of a wall, or difference between inside and outside, in grey values.
    pub contrast: f64,
    /// How many times its standard error the mean contrast is.
    pub significance: f64,
    /// The mean place of the value under the outlines between outside (0) and inside (1).
    pub share: f64,
    /// How far outside of the border what tells it is looked for, in smallest spacings: the crest of a wall, or a grey
    /// value, that of the border itself but where outlines run so high on it that what is inside would be taken for outside.
    pub shift: f64,
    /// Profiles that were read.
    pub profiles: usize,
}

/// A wall stands out from the higher of its flanks by more than this part of the difference of inside and outside.
const WALL_OVER_STEP: f64 = 0.45;
/// Its flanks are so many smallest spacings from its crest, and that so far from the marks at most.
const WALL_FLANK: f64 = 2.5;
const FARTHEST_CREST: f64 = 3.5;
/// Outlines that near to a crest were drawn along it.
const ON_CREST: f64 = 0.5;
/// A contrast counts from so many standard errors on.
const SIGNIFICANT: f64 = 4.0;
/// Marks that run at such a share of the contrast were drawn along that level on purpose; beyond, beside the border.
pub const ON_LEVEL: [f64; 2] = [0.15, 0.85];

impl Reading {
    /// Reads the profiles at the marks of one object or of several as a border of one kind, whether it stands out or not.
    #[must_use]
    pub fn forced(profiles: &[Profile], wall: bool) -> Self {
        let found = Self::of(profiles);
        match (wall, found.model) {
            (false, BorderModel::Level) | (true, BorderModel::Wall(_)) => found,
            (false, _) => {
                let contrast = mean_step(profiles);
                Self { model: BorderModel::Level, bias: 0.0, shift: 0.0, share: 0.5, contrast, ..found }
            }
            (true, _) => {
                let above = |p: &Profile| p.here() - 0.5 * (p.inside() + p.outside());
                let height = profiles.iter().map(above).sum::<f64>() / profiles.len().max(1) as f64;
                let model = BorderModel::Wall(if height < 0.0 { -1.0 } else { 1.0 });
                Self { model, bias: 0.0, shift: 0.0, contrast: height.abs().max(1e-6), ..found }
            }
        }
    }

    /// Reads the profiles at the marks of one object or of several.
    #[must_use]
    pub fn of(profiles: &[Profile]) -> Self {
        let steps: Vec<f64> = profiles.iter().map(|p| p.inside() - p.outside()).collect();
        let shared_crest = |sign: f32| median(profiles.iter().map(|p| p.crest(sign)).collect());
        let ridge = |sign: f32| {
            let crest = shared_crest(sign);
            let value = |p: &Profile, place: f64| f64::from(sign) * p.at(place);
            let mean = |place: f64| profiles.iter().map(|p| value(p, place)).sum::<f64>();
            let flanks = [crest - WALL_FLANK, crest + WALL_FLANK];
            let higher = if mean(flanks[0]) > mean(flanks[1]) { flanks[0] } else { flanks[1] };
            let heights = profiles.iter().map(|p| value(p, crest) - value(p, higher));
            (crest, heights.collect::<Vec<f64>>())
        };
        let (step, step_error) = mean_and_error(&steps);
        let mut found = Self {
            model: BorderModel::None,
            bias: 0.0,
            contrast: step,
            significance: step.abs() / step_error,
            share: 0.5,
            shift: 0.0,
            profiles: profiles.len(),
        };
        for sign in [1.0, -1.0] {
            let (crest, heights) = ridge(sign);
            let (height, error) = mean_and_error(&heights);
            let is_wall = height > WALL_OVER_STEP * step.abs() && height > SIGNIFICANT * error;
            if is_wall && crest.abs() <= FARTHEST_CREST {
                let significance = height / error;
                // Half a voxel is what blur and what joins a wall make of its crest, not where the outlines run.
                let mean = profiles.iter().map(|p| p.crest(sign).clamp(-FARTHEST_CREST, FARTHEST_CREST)).sum::<f64>();
                let shift = (mean / profiles.len() as f64).clamp(-ON_CREST, ON_CREST);
                let (bias, shift) = if crest.abs() < ON_CREST { (0.0, shift) } else { (crest, 0.0) };
                let model = BorderModel::Wall(sign);
                return Self { model, bias, shift, contrast: height, significance, ..found };
            }
        }
        if found.significance > SIGNIFICANT {
            found.model = BorderModel::Level;
            let flanks = Flanks::of(profiles);
            let (share, off) = flanks.beside(flanks.rim);
            found.share = share;
            if !(ON_LEVEL[0]..=ON_LEVEL[1]).contains(&share) {
                found.bias = off;
            } else if let (high, shift) = flanks.beside(flanks.inside)
                && high > HIGH
            {
                found.shift = shift;
            }
        }
        found
    }
}

fn mean_step(profiles: &[Profile]) -> f64 {
    profiles.iter().map(|p| p.inside() - p.outside()).sum::<f64>() / profiles.len().max(1) as f64
}

/// A rim is higher than what lies inside of it by more than this part of the difference of inside and outside.
const RIM: f64 = 0.1;
/// Outlines run high on a border from this share of the way up on.
const HIGH: f64 = 0.7;

/// The mean profile, and what its border is between.
struct Flanks {
    mean: [f64; LEN],
    outside: f64,
    /// Where the inside is darkest (brightest, if that is darker than the outside).
    inside: f64,
    /// The inside, or a rim that outshines what it bounds.
    rim: f64,
}

impl Flanks {
    fn of(profiles: &[Profile]) -> Self {
        let count = profiles.len().max(1) as f64;
        let mean = std::array::from_fn(|n| profiles.iter().map(|p| f64::from(p.0[n])).sum::<f64>() / count);
        let plateau = |of: fn(&Profile) -> f64| profiles.iter().map(of).sum::<f64>() / count;
        let (inside, outside) = (plateau(Profile::inside), plateau(Profile::outside));
        let sign = (inside - outside).signum();
        let peak = mean.iter().map(|v: &f64| sign * v).fold(f64::NEG_INFINITY, f64::max) * sign;
        let has_rim = (peak - mean[0]) * sign > RIM * (inside - outside).abs();
        let rim = if has_rim { peak } else { inside };
        Self { mean, outside, inside: sign * (sign * inside).min(sign * mean[0]), rim }
    }

    /// Where the value under the outlines lies between outside (0) and `top` (1), and how far outside of them the mean
    /// profile is half way, where that is nearest.
    fn beside(&self, top: f64) -> (f64, f64) {
        let half = 0.5 * (top + self.outside);
        let crossing = |n: usize| {
            let (a, b) = (self.mean[n] - half, self.mean[n + 1] - half);
            (a * b <= 0.0 && a != b).then(|| (n as f64 + a / (a - b) - REACH as f64) * STEP)
        };
        let nearest = (0..LEN - 1).filter_map(crossing).min_by(|a, b| a.abs().total_cmp(&b.abs()));
        ((self.mean[REACH] - self.outside) / (top - self.outside), nearest.unwrap_or(0.0))
    }
}

fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
    // Neighbouring marks see the same noise: as many independent ones as a third of them.
    (mean, (variance / (count / 3.0).max(1.0)).sqrt().max(1e-9))
}

/// The middle value; 0 of none.
#[must_use]
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profiles(of: impl Fn(f64, f64) -> f64) -> Vec<Profile> {
        let profile = |k: usize| {
            let wobble = ((k * 7919) % 101) as f64 / 101.0 - 0.5;
            Profile(std::array::from_fn(|n| of((n as f64 - REACH as f64) * STEP, wobble) as f32))
        };
        (0..60).map(profile).collect()
    }

    #[test]
    fn steps_walls_and_nothing_are_told_apart() {
        let blurred = |t: f64| 1.0 / (1.0 + (1.8 * t).exp());
        let level = Reading::of(&profiles(|t, w| blurred(t - 0.3 * w) + 0.1 * w));
        assert!(level.model == BorderModel::Level && level.bias == 0.0, "{level:?}");
        let beside = Reading::of(&profiles(|t, w| blurred(t + 2.0 - 0.3 * w)));
        assert!(beside.model == BorderModel::Level && (beside.bias + 2.0).abs() < 0.2, "{beside:?}");
        let wall = Reading::of(&profiles(|t, w| (-(t - 1.0 - w).powi(2) / 2.0).exp() + 0.2 * blurred(t)));
        assert!(wall.model == BorderModel::Wall(1.0) && (wall.bias - 1.0).abs() < 0.2, "{wall:?}");
        let near = profiles(|t, w| (-(t - 0.3 - 0.1 * w).powi(2) / 2.0).exp());
        let (crest, level) = (Reading::of(&near), Reading::forced(&near, false));
        assert!(crest.bias == 0.0 && (crest.shift - 0.3).abs() < 0.1, "{crest:?}");
        assert_eq!((level.model, level.shift), (BorderModel::Level, 0.0), "a crest is no level");
        let dark = Reading::of(&profiles(|t, _| 1.0 - (-t * t / 2.0).exp()));
        assert_eq!(dark.model, BorderModel::Wall(-1.0));
        let nothing = Reading::of(&profiles(|t, w| 0.5 + (13.0 * t * (1.0 + w)).sin() * w));
        assert_eq!(nothing.model, BorderModel::None, "{nothing:?}");
    }
}
