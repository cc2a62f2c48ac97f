//! What the outlines and the image say before anything is solved: which border the image shows under the marks, how
//! well it tells where that is, and how sure the shape is between the outlines.

use serde::{Deserialize, Serialize};

use super::outlines;
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, Geometry};
use crate::kernel::image::border::border_model::{BorderModel, Reading, median};
use crate::kernel::image::border::carried::Carried;
use crate::kernel::image::border::profiles::{LEN, Profile, REACH, STEP, interpolate};
use crate::kernel::outline::planar::marked::Scatter;
use crate::kernel::outline::planar::section::Section;
use crate::kernel::outline::spatial::cross_validation::{HeldOut, leave_out};
use crate::kernel::outline::spatial::fitted::{Fit, Fitted, LEAST_BESIDE, MOST_SAMPLES};
use crate::pipeline::enclosure::region::RegionOfInterest;
use crate::pipeline::image::intensity::Normalised;
use crate::pipeline::image::smoothing::smoothed;
use crate::pipeline::marks::ObjectMarks;
use crate::pipeline::segment::picture::{Picture, name};
use crate::pipeline::segment::settings::ImageModel;
use crate::store::{BoxSource, Element};

/// Profiles are taken so many smallest spacings apart, and so many at most for an object.
const APART: f64 = 1.5;
const MOST_PROFILES: usize = 3000;
/// The image is smoothed by so many smallest spacings before profiles are taken.
const SIGMA: f64 = 1.0;
/// Sections that are left out in turn, of all objects together about, and of one at least and at most; of more objects
/// than these some are taken.
const LEFT_OUT: usize = 32;
const LEFT_OUT_OF_ONE: [usize; 2] = [2, 8];
const MOST_LEAVING_OUT: usize = 32;
/// With fewer profiles an object is read together with the others.
const ENOUGH_PROFILES: usize = 36;
/// How far a shape is off a smallest spacing from the outlines, of it, where nothing could be left out.
const DEFAULT_GROWTH: f64 = 0.015;

/// An object whose marks are outlines.
pub(crate) struct Outlined {
    pub sections: Vec<Section>,
    pub fitted: Fitted,
    pub profiles: Vec<Sampled>,
    /// Marks of sections that were left out.
    pub held_out: Vec<HeldOut>,
}

/// How objects are looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Looking {
    /// How marks scatter around their outlines.
    pub scatter: Scatter,
    /// Whether the image has a say.
    pub looks: bool,
    /// Sections of an object that are left out in turn, at most.
    pub left_out: usize,
}

/// How many sections are left out of each object, by its number among all of them.
pub(crate) fn left_out_of(objects: usize) -> impl Fn(usize) -> usize + Sync {
    let of_one = (LEFT_OUT / objects.max(1)).clamp(LEFT_OUT_OF_ONE[0], LEFT_OUT_OF_ONE[1]);
    let every = objects.div_ceil(MOST_LEAVING_OUT).max(1);
    move |number| if number.is_multiple_of(every) { of_one } else { 0 }
}

/// A profile, and where it was taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampled {
    pub point: [f64; 3],
    /// The section that it belongs to.
    pub section: usize,
    pub profile: Profile,
}

/// What is taken from the image and how far it is trusted; lengths in smallest spacings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Trust {
    pub reading: Reading,
    /// Standard deviation of where the image shows the border.
    pub image: f64,
    /// Standard deviation of the outlines.
    pub outlines: f64,
    /// Standard deviation of the shape at an outline.
    pub shape: f64,
    /// How much that grows with the square of the distance from outlines.
    pub growth: f64,
}

impl Outlined {
    /// Looks at an object; none where its marks are no outlines or tell no shape.
    pub(crate) fn new<T: Element>(
        engine: &Engine,
        picture: &Picture<'_, T>,
        marks: &ObjectMarks,
        by: Looking,
    ) -> Result<Option<Self>> {
        let image = picture.geometry;
        let Some(groups) = outlines::drawn_by_plane(marks, image) else { return Ok(None) };
        let stage = engine.stage(&name("marks", marks), 0);
        let sections = stage.run(&groups, &Workers::none(), |(), group| {
            Ok(outlines::section(group, by.scatter, image.min_spacing()))
        })?;
        let all: Vec<&Section> = sections.iter().collect();
        let least = LEAST_BESIDE * image.min_spacing();
        let fit = Fit::new(&all, MOST_SAMPLES, least);
        let functions = stage.run(fit.windows(), &Workers::none(), |(), window| Ok(fit.solve(window)))?;
        let tells = sections.len() > 2 && by.left_out > 0;
        let every = sections.len().div_ceil(by.left_out.max(1));
        let left_out: Vec<usize> = (0..sections.len()).step_by(every).filter(|_| tells).collect();
        let held_out = stage.run(&left_out, &Workers::none(), |(), &n| Ok(leave_out(&all, n, least)))?;
        stage.finish();
        let Some(fitted) = fit.join(functions) else { return Ok(None) };
        let held_out = held_out.into_iter().flatten().flatten().collect();
        let profiles = if by.looks { profiles(engine, picture, marks, &sections, &fitted)? } else { Vec::new() };
        Ok(Some(Self { sections, fitted, profiles, held_out }))
    }

    /// Whether the body is less than twice `most` thick: so deep is no section of it, or so far does it not reach across
    /// them.
    fn is_thinner(&self, most: f64) -> bool {
        let is_deep = |section: &Section| section.deepest().is_some_and(|(_, depth)| depth >= most);
        self.fitted.ends().is_some_and(|ends| 0.5 * ends.extent() < most) || !self.sections.iter().any(is_deep)
    }

    /// What it tells of others.
    pub(crate) fn told(&self, image: &Geometry) -> Told {
        let is_thin = self.is_thinner(THIN * image.min_spacing());
        let profiles = if is_thin { Vec::new() } else { self.profiles.iter().map(|s| s.profile).collect() };
        Told { profiles, held_out: self.held_out.clone() }
    }

    fn deviation(&self) -> f64 {
        let curves = || self.sections.iter().flat_map(|section| &section.curves);
        curves().map(|curve| curve.deviation).sum::<f64>() / curves().count().max(1) as f64
    }
}

/// Grey values along the normals of the shape at points of its outlines.
fn profiles<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    marks: &ObjectMarks,
    sections: &[Section],
    fitted: &Fitted,
) -> Result<Vec<Sampled>> {
    let h = picture.geometry.min_spacing();
    let mut places: Vec<(usize, [f64; 3])> = Vec::new();
    for (number, section) in sections.iter().enumerate() {
        for curve in &section.curves {
            // Points of a curve are about half a spacing apart.
            let every = ((APART / 0.5) as usize).min(curve.points.len() / 6).max(1);
            places.extend(curve.points.iter().step_by(every).map(|&p| (number, section.plane.lift(p, 0.0))));
        }
    }
    let every = places.len().div_ceil(MOST_PROFILES).max(1);
    let places: Vec<(usize, [f64; 3])> = places.into_iter().step_by(every).collect();
    let points: Vec<[f64; 3]> = places.iter().map(|place| place.1).collect();
    let RegionOfInterest { geometry, window, cells, .. } =
        RegionOfInterest::new(picture.geometry, &points, (REACH as f64 * STEP + 1.5) * h);
    let stage = engine.stage(&name("profiles", marks), 0);
    let image = Normalised::new(picture.voxels, picture.range, window);
    let grey = smoothed(&stage, engine, &image, &std::sync::Arc::new(cells), geometry.spacing, [SIGMA * h; 3])?;
    let found = stage.run(&places, &Workers::new(Vec::new), |values, &(section, point)| {
        let profile = profile_at(&grey, &geometry, point, fitted.distance(point).1, values)?;
        Ok(Sampled { point, section, profile })
    })?;
    stage.finish();
    Ok(found)
}

fn profile_at(
    grey: &dyn BoxSource<f32>,
    geometry: &Geometry,
    point: [f64; 3],
    normal: [f64; 3],
    values: &mut Vec<f32>,
) -> Result<Profile> {
    let h = geometry.min_spacing();
    let place = |n: usize| {
        let by = (n as f64 - REACH as f64) * STEP * h;
        geometry.to_voxels(std::array::from_fn(|a| point[a] + by * normal[a]))
    };
    let (first, last) = (place(0), place(LEN - 1));
    let part = Box3::new(
        std::array::from_fn(|a| first[a].min(last[a]).floor() as i64),
        std::array::from_fn(|a| first[a].max(last[a]).floor() as i64 + 2),
    );
    let part = part.intersect(&geometry.domain());
    values.resize(part.len(), 0.0);
    grey.read_box(&part, values)?;
    Ok(Profile(std::array::from_fn(|n| interpolate(values, &part, place(n)))))
}

/// Profiles of bodies thinner than twice so many smallest spacings reach out of them on the other side: they tell no
/// border from another.
const THIN: f64 = 3.5;

/// What objects tell of each other.
#[derive(Default, Serialize, Deserialize)]
pub(crate) struct Told {
    /// The profiles of thick bodies.
    profiles: Vec<Profile>,
    /// Marks of sections that were left out.
    held_out: Vec<HeldOut>,
}

impl Told {
    /// What all objects tell together, by their numbers, in order of these.
    pub(crate) fn joined(objects: Vec<(usize, Self)>) -> Self {
        objects.into_iter().fold(Self::default(), |mut all, (_, told)| {
            all.profiles.extend(told.profiles);
            all.held_out.extend(told.held_out);
            all
        })
    }
}

/// How far the image and the shape of each of some objects are trusted, where all tell of each other what is `told`.
pub(crate) fn trust(
    stage: &Stage<'_>,
    objects: &[Option<Outlined>],
    told: &Told,
    (image, scatter): (&Geometry, Scatter),
    model: ImageModel,
) -> Result<Vec<Option<Trust>>> {
    let h = image.min_spacing();
    let is_thin = |object: &Outlined| object.is_thinner(THIN * h);
    let all = &told.profiles;
    let growth = growth(told.held_out.iter(), scatter, h).unwrap_or(DEFAULT_GROWTH);
    let trust = |object: &Outlined| {
        let own: Vec<Profile> = object.profiles.iter().map(|s| s.profile).collect();
        let profiles = if own.len() < ENOUGH_PROFILES && !all.is_empty() { all } else { &own };
        let reading = match model {
            ImageModel::Level if !profiles.is_empty() => Reading::forced(profiles, false),
            ImageModel::Wall if !profiles.is_empty() => Reading::forced(profiles, true),
            _ if is_thin(object) => Reading::of(&[]),
            _ => Reading::of(profiles),
        };
        Trust {
            reading,
            image: image_deviation(&object.profiles, &reading, object.deviation(), h),
            outlines: object.deviation() / h,
            shape: libm::hypot(libm::hypot(object.deviation() / h, 0.2), reading.bias),
            growth,
        }
    };
    stage.run(objects, &Workers::none(), |(), object| Ok(object.as_ref().map(trust)))
}

/// How the shape's error grows with the square of the distance from outlines: marks that were left out lie that far from it, their own
/// scatter apart. The worst tenth is left aside.
fn growth<'a>(held_out: impl Iterator<Item = &'a HeldOut>, scatter: Scatter, h: f64) -> Option<f64> {
    let share = |held: &HeldOut| {
        let (off, away) = ((held.off.powi(2) - scatter.sigma.powi(2)).max(0.0) / (h * h), held.away / h);
        off / away.powi(4).max(1e-12)
    };
    let mut shares: Vec<f64> = held_out.map(share).collect();
    shares.sort_by(f64::total_cmp);
    shares.truncate(shares.len() * 9 / 10);
    (!shares.is_empty()).then(|| (shares.iter().sum::<f64>() / shares.len() as f64).sqrt())
}

/// Of where the image shows the border beside an outline so much is the outlines' own variance: that of the one, and of
/// those beside it.
const OUTLINES_OWN: f64 = 1.5;

/// So many profiles are compared with those of other sections.
const ENOUGH_COMPARED: usize = 400;

/// How well the image tells a border, in smallest spacings: of a step how far a section's own outlines lie from where
/// the grey values under the others' would put them; of a wall how far its crest is from where it mostly is.
fn image_deviation(profiles: &[Sampled], reading: &Reading, deviation: f64, h: f64) -> f64 {
    const LEAST: f64 = 0.3;
    let apart = |off: f64| (off.powi(2) - OUTLINES_OWN * (deviation / h).powi(2)).max(LEAST.powi(2)).sqrt();
    match reading.model {
        BorderModel::None => f64::INFINITY,
        BorderModel::Wall(sign) => {
            let usual = reading.bias + reading.shift;
            let off = profiles.iter().map(|s| (s.profile.crest(sign) - usual).abs());
            apart(1.4826 * median(off.collect()))
        }
        BorderModel::Level => {
            let at = reading.shift;
            let grey = Carried::new(profiles.iter().map(|s| (s.point, [s.profile.at(at), 0.0])));
            let fall = profiles.iter().map(|s| s.profile.fall(at)).sum::<f64>() / profiles.len().max(1) as f64;
            let every = profiles.len().div_ceil(ENOUGH_COMPARED);
            let off = profiles.iter().step_by(every.max(1)).filter_map(|s| {
                // Profiles lie in order of their sections.
                let own = profiles.partition_point(|p| p.section < s.section)
                    ..profiles.partition_point(|p| p.section <= s.section);
                let [grey, _] = grey.at(s.point, fade(deviation / h, h), own)?;
                Some(((s.profile.at(at) - grey) / fall).clamp(-MOST_OFF, MOST_OFF).powi(2))
            });
            let (sum, count) = off.fold((0.0, 0), |(sum, count), square| (sum + square, count + 1));
            if count == 0 { 1.0 } else { apart((sum / f64::from(count)).sqrt()) }
        }
    }
}

/// The image moves the border by so many smallest spacings at most.
pub(crate) const MOST_OFF: f64 = 3.0;
/// Grey values are carried over from the outlines, others than the nearest fading over so many smallest spacings more,
/// and over as many times again as the outlines are unsure of theirs.
const FADE: [f64; 2] = [6.0, 8.0];

/// What the squares of distances are divided by for how unsure outlines are, in smallest spacings.
pub(crate) fn fade(outlines: f64, h: f64) -> f64 {
    2.0 * ((FADE[0] + FADE[1] * outlines) * h).powi(2)
}
