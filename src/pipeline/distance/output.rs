//! Writes a solved distance: the distance itself, the label of the nearest data set, the position of the nearest
//! source.

use super::{DistanceSettings, Solved};
use crate::error::Result;
use crate::exec::Engine;
use crate::grid::{Box3, DataSets, Geometry};
use crate::io::ome_zarr::{ImageSpec, LabelColor, LabelSpec, StoreWriter};
use crate::kernel::distance::initialise::NO_SOURCE;
use crate::kernel::distance::precision::Precision;
use crate::kernel::image::palette::label_color;
use crate::kernel::triangle::Triangle;
use crate::pipeline::pyramid::{Reduce, write_levels};
use crate::store::{BoxSource, Element};

/// Writes all fields that the settings ask for.
///
/// # Errors
/// When the output cannot be written or the run is interrupted.
pub fn write_fields<P: Precision>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    settings: &DistanceSettings,
    solved: &Solved<'_, P>,
    max: f64,
    store: &StoreWriter,
) -> Result<()> {
    let window = Some([if settings.signed { -max } else { 0.0 }, max]);
    let image = store.image("", &ImageSpec { name: "distance", geometry, element: P::TYPE, window })?;
    let stage = engine.stage("write distance", 0);
    stage.voxels(geometry.domain().volume());
    write_levels::<P>(&stage, engine, image.levels(), &*solved.values, Reduce::Mean)?;
    stage.finish();
    if settings.labels {
        let nearest = NearestLabels { sources: &*solved.sources, sets };
        write_label_field(engine, geometry, sets, "nearest", &nearest, store)?;
    }
    if settings.closest_point {
        // Single precision would move places that are far from zero.
        if geometry.fits_single() {
            write_closest_points::<f32, P>(engine, geometry, sets, solved, store)?;
        } else {
            write_closest_points::<f64, P>(engine, geometry, sets, solved, store)?;
        }
    }
    Ok(())
}

/// Writes the place on the nearest source, an image for each coordinate, as `T`.
fn write_closest_points<T: Element, P: Precision>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    solved: &Solved<'_, P>,
    store: &StoreWriter,
) -> Result<()> {
    let triangles: Vec<_> = (0..sets.mesh.len()).map(|n| Triangle::new(sets.mesh.corners(n))).collect();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let group = format!("closest-point/{name}");
        let spec = ImageSpec { name: &group, geometry, element: T::TYPE, window: None };
        let closest = ClosestPoint { solved, sets, triangles: &triangles, geometry, axis };
        let stage = engine.stage(&format!("write closest {name}"), 0);
        stage.voxels(geometry.domain().volume());
        write_levels::<T>(&stage, engine, store.image(&group, &spec)?.levels(), &closest, Reduce::Mean)?;
        stage.finish();
    }
    Ok(())
}

/// Writes a label volume of that name, in the smallest type that holds all labels.
///
/// # Errors
/// When the output cannot be written or the run is interrupted.
pub fn write_label_field<L>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    name: &str,
    labels: &L,
    store: &StoreWriter,
) -> Result<()>
where
    L: BoxSource<u8> + BoxSource<u16> + BoxSource<u32>,
{
    match sets.last_label() {
        0..=0xff => write_labels::<u8>(engine, geometry, sets, name, labels, store),
        0x100..=0xffff => write_labels::<u16>(engine, geometry, sets, name, labels, store),
        _ => write_labels::<u32>(engine, geometry, sets, name, labels, store),
    }
}

fn write_labels<T: Element>(
    engine: &Engine,
    geometry: &Geometry,
    sets: &DataSets,
    name: &str,
    labels: &dyn BoxSource<T>,
    store: &StoreWriter,
) -> Result<()> {
    let color = |label: u32| {
        let [red, green, blue] = label_color(label);
        LabelColor { label, rgba: [red, green, blue, 255] }
    };
    let colors: Vec<LabelColor> = sets.labels().iter().copied().map(color).collect();
    let image = store.labels(&LabelSpec { name, geometry, element: T::TYPE, colors: &colors })?;
    let stage = engine.stage(&format!("write {name}"), 0);
    stage.voxels(geometry.domain().volume());
    write_levels::<T>(&stage, engine, image.levels(), labels, Reduce::Mode)?;
    stage.finish();
    Ok(())
}

/// The label of each voxel's nearest data set; 0 where no source is known.
pub struct NearestLabels<'a> {
    /// The nearest source of each voxel.
    pub sources: &'a dyn BoxSource<u32>,
    /// What the sources belong to.
    pub sets: &'a DataSets,
}

impl<T: Element> BoxSource<T> for NearestLabels<'_> {
    fn shape(&self) -> [i64; 3] {
        self.sources.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        let mut sources = vec![NO_SOURCE; part.len()];
        self.sources.read_box(part, &mut sources)?;
        let label = |&source: &u32| T::from_f64(f64::from(self.sets.label(source)));
        out.iter_mut().zip(&sources).for_each(|(out, source)| *out = label(source));
        Ok(())
    }
}

/// One coordinate of the point of the nearest source that is closest to the voxel; NaN where no source is known.
struct ClosestPoint<'a, 'b, P> {
    solved: &'a Solved<'b, P>,
    sets: &'a DataSets,
    triangles: &'a [Triangle],
    geometry: &'a Geometry,
    axis: usize,
}

impl<P: Precision, T: Element> BoxSource<T> for ClosestPoint<'_, '_, P> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        let mut sources = vec![NO_SOURCE; part.len()];
        self.solved.sources.read_box(part, &mut sources)?;
        let points = &self.sets.positions;
        for (y, z) in part.rows() {
            for x in part.lo[0]..part.hi[0] {
                let at = part.offset_of([x, y, z]);
                let source = sources[at] as usize;
                let triangle = || self.triangles.get(source.checked_sub(points.len())?);
                out[at] = T::from_f64(match points.get(source) {
                    Some(point) => point[self.axis],
                    None => triangle().map_or(f64::NAN, |triangle| {
                        triangle.closest_point(self.geometry.position([x, y, z]))[self.axis]
                    }),
                });
            }
        }
        Ok(())
    }
}
