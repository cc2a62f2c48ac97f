//! The speed at which image and shape move an object's surface along its normal, brick by brick.
//!
//! ```text
//! F = ( w D - (1 - w) (phi - b) ) / 3 h     w = U^2 / (U^2 + V^2 / rho)     U^2 = U_0^2 + (c d^2)^2 + e^2 / 12
//! ```
//!
//! phi is the signed distance to the shape of the outlines, b how far outside of the marks the image's border lies, D
//! how far the image says that the border is away, outwards; U is how uncertain the shape is, the more the farther
//! from the outlines and their planes (d) and beyond the last of them (e), V how uncertain the image. The surface rests
//! where both agree, weighed by their variances.

use std::sync::Arc;

use super::shape_field::ShapeField;
use super::survey::{MOST_OFF, Outlined, Sampled, Trust, fade};
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, equal_part, one_wave, run_shared, whole_field};
use crate::grid::{Box3, Geometry};
use crate::kernel::image::border::border_model::{BorderModel, ON_LEVEL};
use crate::kernel::image::border::carried::Carried;
use crate::kernel::image::border::speed::{Grey, Places, Step, Weights, level_offsets, speeds};
use crate::kernel::image::border::wall::{Fields, Wall, wall_offsets};
use crate::kernel::outline::spatial::lattice::Lattice;
use crate::store::{BoxSource, BrickArray};

/// Nodes of the lattices of grey values, about, and how many smallest spacings they are apart at least: grey values
/// under outlines are averaged over more.
const NODES: f64 = 4000.0;
const APART: f64 = 4.0;

/// What the speed is made of.
pub(crate) struct Pulls<'a> {
    pub field: &'a ShapeField<'a>,
    pub trust: Trust,
    /// Weight of the image, 1 where it is to be weighed by its variance alone.
    pub rho: f64,
    /// The smoothed image; none where it is left out.
    pub image: Option<&'a BrickArray<f32>>,
    /// Signed distance, and distance to the outlines.
    pub shape: &'a BrickArray<f32>,
    pub distance: &'a BrickArray<f32>,
}

/// The speed on the cells of the shape. Each rank of several does its part of the cells, and all have all of them in the end.
pub(crate) fn speed(stage: &Stage<'_>, engine: &Engine, object: &Outlined, by: &Pulls<'_>) -> Result<BrickArray<f32>> {
    let geometry = &by.field.geometry;
    let set = by.shape.set();
    let levels = match (by.image, by.trust.reading.model) {
        (Some(_), BorderModel::Level) => Some(levels(stage, geometry, object, &by.trust)?),
        _ => None,
    };
    let weights = Weights {
        spacing: geometry.min_spacing() as f32,
        rho: by.rho as f32,
        image: by.trust.image as f32,
        shape: by.trust.shape as f32,
        growth: by.trust.growth as f32,
        bias: by.trust.reading.bias as f32,
    };
    let own = &Arc::new(equal_part(stage.comm(), set));
    let field = BrickArray::with_faces(engine.scratch(), own)?;
    stage.run(&one_wave(own), &Workers::new(Buffers::default), |buffers, &slot| {
        let part = set.grid().brick_box(own.id(slot));
        buffers.fill(&part, by, geometry, levels.as_ref())?;
        let at = Places {
            shape: &buffers.shape,
            distance: &buffers.distance,
            planes: &buffers.planes,
            beyond: &buffers.beyond,
        };
        speeds(at, &buffers.offsets, &buffers.doubts, weights, &mut buffers.speed);
        field.write_box(&part, &buffers.speed);
        field.refresh_faces(slot);
        Ok(())
    })?;
    whole_field(stage, field, set)
}

#[derive(Default)]
struct Buffers {
    shape: Vec<f32>,
    distance: Vec<f32>,
    planes: Vec<f32>,
    beyond: Vec<f32>,
    /// Where the image says the border is, and how many times its usual deviation that is unsure.
    offsets: Vec<f32>,
    doubts: Vec<f32>,
    speed: Vec<f32>,
    grey: Vec<f32>,
    around: Vec<f32>,
    level: Vec<f32>,
    fall: Vec<f32>,
}

impl Buffers {
    fn fill(&mut self, part: &Box3, by: &Pulls<'_>, geometry: &Geometry, levels: Option<&Levels>) -> Result<()> {
        let fields = [&mut self.shape, &mut self.distance, &mut self.planes, &mut self.beyond];
        for buffer in fields.into_iter().chain([&mut self.offsets, &mut self.doubts, &mut self.speed]) {
            buffer.resize(part.len(), 0.0);
        }
        by.shape.read_box(part, &mut self.shape)?;
        by.distance.read_box(part, &mut self.distance)?;
        by.field.to_sections(part, &mut self.planes);
        by.field.beyond_sections(part, &mut self.beyond);
        self.offsets.fill(0.0);
        self.doubts.fill(f32::INFINITY);
        let Some(image) = by.image else { return Ok(()) };
        let h = geometry.min_spacing() as f32;
        let reading = by.trust.reading;
        if let Some(levels) = levels {
            for buffer in [&mut self.grey, &mut self.level, &mut self.fall] {
                buffer.resize(part.len(), 0.0);
            }
            image.read_box(part, &mut self.grey)?;
            levels.level.read(part, &mut self.level);
            levels.fall.read(part, &mut self.fall);
            let grey = Grey { values: &self.grey, level: &self.level, fall: &self.fall, mean_fall: levels.mean_fall };
            let by = Step { most: MOST_OFF as f32, shift: reading.shift as f32, h };
            level_offsets(grey, by, &mut self.offsets, &mut self.doubts);
        } else if let BorderModel::Wall(sign) = reading.model {
            let around = part.grow(1).intersect(&geometry.domain());
            self.grey.resize(around.len(), 0.0);
            self.around.resize(around.len(), 0.0);
            image.read_box(&around, &mut self.grey)?;
            by.field.read(&around, &mut self.around);
            let wall = Wall { height: sign * reading.contrast as f32, shift: reading.shift as f32 };
            let fields = Fields { grey: &self.grey, shape: &self.around, around, spacing: geometry.spacing };
            wall_offsets(fields, part, wall, &mut self.offsets, &mut self.doubts);
        }
        Ok(())
    }
}

/// The grey value of the border, and how it falls across it per smallest spacing, carried over from the outlines.
struct Levels {
    level: Lattice,
    fall: Lattice,
    mean_fall: f32,
}

fn levels(stage: &Stage<'_>, geometry: &Geometry, object: &Outlined, trust: &Trust) -> Result<Levels> {
    let on_level = (ON_LEVEL[0]..=ON_LEVEL[1]).contains(&trust.reading.share);
    let shift = trust.reading.shift;
    let value = |s: &Sampled| {
        let half = 0.5 * (s.profile.inside() + s.profile.outside());
        [if on_level { s.profile.at(shift) } else { half }, s.profile.fall(shift)]
    };
    let samples = Carried::new(object.profiles.iter().map(|s| (s.point, value(s))));
    let count = object.profiles.len().max(1) as f64;
    // Beside a border that the marks miss the fall at the marks is none.
    let mean_fall = if on_level {
        object.profiles.iter().map(|s| s.profile.fall(shift)).sum::<f64>() / count
    } else {
        0.25 * trust.reading.contrast
    };
    let fade = fade(trust.outlines, geometry.min_spacing());
    let at = |point: [f64; 3]| -> [f64; 2] {
        let [level, fall] = samples.at(point, fade, 0..0).unwrap_or([0.0, mean_fall]);
        [level, if on_level { fall } else { mean_fall }]
    };
    let mut lattices = [0, 1].map(|_| Lattice::for_box(geometry.shape, geometry.spacing, NODES, APART));
    let planes: Vec<usize> = (0..lattices[0].planes()).collect();
    let nodes = run_shared(stage, &planes, &Workers::none(), |(), &n| {
        let values = lattices[0].plane(n, geometry, at);
        Ok([0, 1].map(|m| values.iter().map(|v| v[m] as f32).collect::<Vec<f32>>()))
    })?;
    let [level, fall] = &mut lattices;
    let (levels, falls): (Vec<_>, Vec<_>) = nodes.into_iter().map(|[a, b]| (a, b)).unzip();
    level.fill(&levels);
    fall.fill(&falls);
    let [level, fall] = lattices;
    Ok(Levels { level, fall, mean_fall: mean_fall as f32 })
}
