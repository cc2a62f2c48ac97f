//! How far objects move from one time of an image to another, read off the image around each of them.
//!
//! An object is followed from the time at which it is marked, one time after the other, by the patch of the image around it
//! (`crate::kernel::image::shift`), which is found again no farther than half of the object's extent away: so neighbours, whose
//! middles lie a whole extent away, are not taken for it. What many such steps would add up is taken off again by looking, near where they
//! lead, for the patch of the marked time itself. Only boxes around objects are read, averaged while they are where they are large.

use std::collections::BTreeMap;
use std::rc::Rc;

use crate::error::Result;
use crate::grid::Box3;
use crate::kernel::image::filter::downsample::add_to_blocks;
use crate::kernel::image::shift::{Found, Patch, ellipsoid, find};
use crate::store::{Sample, SampleWork, VolumeSource};

/// A patch around an object reaches farther than its marks by this share of their extent, and by so many voxels at least.
const MARGIN: f64 = 0.125;
const LEAST_MARGIN: f64 = 2.0;
/// The share of its extent that an object may move from one time to the next, and voxels that it may in any case.
const REACH: f64 = 0.5;
const LEAST_REACH: f64 = 2.0;
/// The same of how far steps from time to time may be off.
const DRIFT: f64 = 0.125;
/// Voxels of a patch, at most; larger ones are averaged while they are read.
const MOST_VOXELS: u64 = 1 << 18;
/// Voxels that are read at a time, one plane of blocks at least.
const MOST_READ: i64 = 1 << 21;
/// Times of the image that are open at once.
const MOST_OPEN: usize = 4;

/// Opens the image of a time.
pub type Opens<'a> = dyn Fn(u32) -> Result<Box<dyn VolumeSource>> + 'a;

/// Where an object is at a time, as seen from where it is marked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moved {
    /// Voxels along x, y and z.
    pub by: [f64; 3],
    /// The first time, from the marked one on, to which the image did not tell how far it moved; nothing was taken for that step.
    pub lost_at: Option<u32>,
}

/// Objects that are followed.
pub struct Follower<'a> {
    opens: &'a Opens<'a>,
    open: Vec<(u32, Rc<dyn VolumeSource>)>,
    /// By object and the time at which it is marked, where it is at others.
    known: BTreeMap<(u32, u32), BTreeMap<u32, Moved>>,
}

impl<'a> Follower<'a> {
    /// Nobody is followed yet.
    #[must_use]
    pub fn new(opens: &'a Opens<'a>) -> Self {
        Self { opens, open: Vec::new(), known: BTreeMap::new() }
    }

    /// Where an object is at time `to` whose marks at time `from` lie between two corners, in voxels of the image.
    ///
    /// # Errors
    /// When the image cannot be read.
    pub fn moved(&mut self, object: u32, [low, high]: [[f64; 3]; 2], from: u32, to: u32) -> Result<Moved> {
        let key = (object, from);
        self.known.entry(key).or_insert_with(|| BTreeMap::from([(from, Moved::default())]));
        let mut at = from;
        loop {
            let known = self.known[&key].get(&at).copied().unwrap_or_default();
            if at == to {
                return Ok(known);
            }
            let next = if to > at { at + 1 } else { at - 1 };
            if !self.known[&key].contains_key(&next) {
                let moved = self.step([low, high], from, (at, next), known)?;
                self.known.entry(key).or_default().insert(next, moved);
            }
            at = next;
        }
    }

    /// One step from a time to the next.
    fn step(&mut self, bounds: [[f64; 3]; 2], from: u32, (at, next): (u32, u32), known: Moved) -> Result<Moved> {
        let extent: [f64; 3] = std::array::from_fn(|a| bounds[1][a] - bounds[0][a]);
        let within = |share: f64, least: f64| extent.map(|length| (share * length).max(least).ceil() as i64);
        let whole = known.by.map(|v| v.round() as i64);
        let here = bounds.map(|corner| std::array::from_fn(|a| corner[a] + whole[a] as f64));
        let found = self.find(here, (at, next), [0; 3], within(REACH, LEAST_REACH))?;
        let lost_at = known.lost_at.or(found.is_none().then_some(next));
        let by: [f64; 3] = match found {
            // The same voxels were looked at in both images, so what was found is the whole step.
            Some(found) => std::array::from_fn(|a| found.shift[a] + known.by[a]),
            None => return Ok(Moved { lost_at, ..known }),
        };
        if at == from {
            return Ok(Moved { by, lost_at });
        }
        let guess = by.map(|v| v.round() as i64);
        let direct = self.find(bounds, (from, next), guess, within(DRIFT, LEAST_REACH))?;
        Ok(Moved { by: direct.map_or(by, |direct| direct.shift), lost_at })
    }

    /// Finds what lies between two corners at a time again at another.
    fn find(
        &mut self,
        [low, high]: [[f64; 3]; 2],
        (from, to): (u32, u32),
        guess: [i64; 3],
        reach: [i64; 3],
    ) -> Result<Option<Found>> {
        let margin: [f64; 3] = std::array::from_fn(|a| (MARGIN * (high[a] - low[a])).max(LEAST_MARGIN));
        let [low, high]: [[f64; 3]; 2] =
            [std::array::from_fn(|a| low[a] - margin[a]), std::array::from_fn(|a| high[a] + margin[a])];
        // Weights end a third farther out than the ellipsoid.
        let ramp: [f64; 3] = std::array::from_fn(|a| (high[a] - low[a]) / 6.0);
        let around = Box3 {
            lo: std::array::from_fn(|a| (low[a] - ramp[a]).floor() as i64),
            hi: std::array::from_fn(|a| (high[a] + ramp[a]).ceil() as i64 + 1),
        };
        let (before, after) = (self.at(from)?, self.at(to)?);
        let domain = Box3::from_shape(before.shape());
        let template = around.intersect(&domain);
        let sought = Box3 {
            lo: std::array::from_fn(|a| around.lo[a] + guess[a] - reach[a] - 1),
            hi: std::array::from_fn(|a| around.hi[a] + guess[a] + reach[a] + 1),
        };
        let sought = sought.intersect(&domain);
        if template.is_empty() || sought.is_empty() {
            return Ok(None);
        }
        let factors = factors(&sought);
        let template = averaged(before.as_ref(), &template, factors)?;
        let image = averaged(after.as_ref(), &sought, factors)?;
        if template.part.is_empty() || image.part.is_empty() {
            return Ok(None);
        }
        // The middle of a block lies half of it on from its first voxel.
        let coarse = |v: f64, a: usize| (v + 0.5) / factors[a] as f64 - 0.5;
        let [low, high] = [low, high].map(|corner| std::array::from_fn(|a| coarse(corner[a], a)));
        let weights = ellipsoid(&template.part, low, high);
        let guess = std::array::from_fn(|a| (guess[a] as f64 / factors[a] as f64).round() as i64);
        let reach = std::array::from_fn(|a| (reach[a] + factors[a] - 1) / factors[a]);
        let found = find(&template, &weights, &image, guess, reach);
        Ok(found.map(|found| Found { shift: std::array::from_fn(|a| found.shift[a] * factors[a] as f64), ..found }))
    }

    /// The image of a time; those that were asked for last stay open.
    fn at(&mut self, time: u32) -> Result<Rc<dyn VolumeSource>> {
        let opened = match self.open.iter().position(|(known, _)| *known == time) {
            Some(place) => self.open.remove(place),
            None => (time, (self.opens)(time)?.into()),
        };
        let source = opened.1.clone();
        self.open.insert(0, opened);
        self.open.truncate(MOST_OPEN);
        Ok(source)
    }
}

/// How many voxels along each axis are averaged to one.
fn factors(part: &Box3) -> [i64; 3] {
    let mut factors = [1; 3];
    let voxels = |factors: [i64; 3]| (0..3).map(|a| (part.shape()[a] / factors[a]).max(1) as u64).product::<u64>();
    while voxels(factors) > MOST_VOXELS {
        // The axis that is longest as it is.
        let longest = (0..3).max_by_key(|&a| part.shape()[a] / factors[a]).unwrap_or(0);
        factors[longest] *= 2;
    }
    factors
}

/// The means of the blocks of `factors` voxels, counted from voxel 0 on, that lie in a box.
fn averaged(source: &dyn VolumeSource, part: &Box3, factors: [i64; 3]) -> Result<Patch> {
    let coarse = Box3 {
        lo: std::array::from_fn(|a| (part.lo[a] + factors[a] - 1).div_euclid(factors[a])),
        hi: std::array::from_fn(|a| part.hi[a].div_euclid(factors[a])),
    };
    if coarse.is_empty() {
        return Ok(Patch { part: Box3::new(coarse.lo, coarse.lo), values: Vec::new() });
    }
    let mut sums = vec![0.0; coarse.len()];
    source.element().with_samples(Averaging { source, coarse: &coarse, factors, sums: &mut sums })?;
    let block = factors.iter().product::<i64>() as f64;
    Ok(Patch { part: coarse, values: sums.into_iter().map(|sum| (sum / block) as f32).collect() })
}

struct Averaging<'a> {
    source: &'a dyn VolumeSource,
    coarse: &'a Box3,
    factors: [i64; 3],
    sums: &'a mut [f64],
}

impl SampleWork for Averaging<'_> {
    type Output = Result<()>;

    fn on<T: Sample>(self) -> Self::Output {
        let Self { source, coarse, factors, sums } = self;
        let fine = Box3 {
            lo: std::array::from_fn(|a| coarse.lo[a] * factors[a]),
            hi: std::array::from_fn(|a| coarse.hi[a] * factors[a]),
        };
        let row = fine.shape()[0];
        let high = (MOST_READ / (row * factors[2]) / factors[1]).max(1) * factors[1];
        let deep = (MOST_READ / (row * fine.shape()[1].min(high)) / factors[2]).max(1) * factors[2];
        // Pieces end where blocks do.
        let slabs = (fine.lo[2]..fine.hi[2]).step_by(deep as usize).flat_map(|z| {
            (fine.lo[1]..fine.hi[1])
                .step_by(high as usize)
                .map(move |y| Box3::new([fine.lo[0], y, z], [fine.hi[0], y + high, z + deep]).intersect(&fine))
        });
        let mut values = Vec::new();
        for slab in slabs {
            values.resize(slab.len(), T::default());
            source.read_box(&slab, T::buffer(&mut values))?;
            add_to_blocks(&values, &slab, factors, coarse, sums);
        }
        Ok(())
    }
}
