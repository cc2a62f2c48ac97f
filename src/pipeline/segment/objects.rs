//! All objects: looked at together, solved each for itself, small ones side by side; their surfaces drawn and checked.

use super::begun::Solution;
use super::label_image::early::Early;
use super::meshes::{ObjectMeshes, Surface};
use super::object::solve;
use super::object_report::ObjectReport;
use super::object_report::Refused;
use super::outlined::cross_validate::cross_validate;
use super::outlined::outlines::scatter_of;
use super::outlined::survey::{Looking, Outlined, Told, Trust, left_out_of, trust};
use super::picture::Picture;
use super::ranks::parts::Share;
use super::ranks::solved::{Solved, in_order, of_all_ranks};
use super::settings::{Guides, ImageModel, SegmentSettings, Start};
use crate::error::{Error, ErrorKind, Result};
use crate::exec::{Comm, Engine};
use crate::grid::{Geometry, digits};
use crate::io::geometry::write::ply::PlyWriter;
use crate::io::ome_zarr::{Content, ImageSpec, StoreWriter};
use crate::kernel::surface::Hausdorff;
use crate::pipeline::enclosure::needs::SOLVE_BYTES;
use crate::pipeline::enclosure::region::voxel_bounds;
use crate::pipeline::marks::ObjectMarks;
use crate::pipeline::output::pyramid::{Reduce, write_levels};
use crate::pipeline::output::viewer_mesh::{Segments, for_viewers};
use crate::pipeline::surface::{self, Drawn, Isosurface};
use crate::store::{Element, ElementType};

/// What was solved, in order of the labels, and what was not.
pub(super) struct Objects {
    pub solved: Vec<Solved>,
    pub refused: Vec<Refused>,
}

/// Solves all objects, of several ranks each some and all together what is too large for one; all ranks then have all. They are solved on a grid whose first voxel is the
/// origin, so that where the image lies in the world changes nothing but their place.
///
/// # Errors
/// When none can be solved, scratch runs out, the output cannot be written or the run is interrupted.
pub(super) fn solve_all<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    guides: &Guides<'_>,
    settings: &SegmentSettings,
    (store, meshes): (Option<&StoreWriter>, Option<&dyn ObjectMeshes>),
    early: Option<&dyn Early>,
) -> Result<Objects> {
    let (objects, mut refused) = (guides.objects, guides.refused.to_vec());
    let several = objects.len() + refused.len() > 1;
    let origin = picture.geometry.origin;
    let grid = Geometry { origin: [0.0; 3], ..picture.geometry.clone() };
    let picture = Picture { geometry: &grid, ..*picture };
    let local: Vec<ObjectMarks> = objects.iter().map(|marks| marks.moved(origin.map(|v| -v))).collect();
    let share = Share::of(engine.comm(), objects, picture.geometry);
    let most = at_once(engine, share.own.iter().map(|&n| &local[n]), &grid);
    let Seen { together, own } = survey(engine, &picture, (&local, &share), settings, most)?;
    let solve = |engine: &Engine, n: usize, looked: Option<&Looked>| {
        let by = looked.map(|(outlined, trust)| (outlined, *trust));
        solve(engine, &picture, &local[n], by, settings).map(|solution| solution.moved(origin))
    };
    let finish = |engine: &Engine, n: usize, looked: Option<&Looked>, solution: Solution| {
        let mut report = draw(engine, &solution, &objects[n], settings, (store, meshes), several)?;
        early.map_or(Ok(()), |early| early.rest(engine, n, report.label, &solution))?;
        if let Some((outlined, _)) = looked.filter(|_| settings.cross_validate) {
            report.cross_validation = cross_validate(engine, outlined, &grid)?;
        }
        let Solution { window, geometry, u, .. } = solution;
        Ok(Solved { window, geometry, u, report })
    };
    let told = |n: usize, solved: Result<Solved>| match solved {
        // One object that cannot be solved does not stop the others.
        Err(error) if matches!(error.kind(), ErrorKind::Input | ErrorKind::Vanished) && several => {
            Ok((n, Err(Refused { label: objects[n].object, reason: error.to_string() })))
        }
        other => other.map(|solved| (n, Ok(solved))),
    };
    let mut found = Vec::new();
    for (&n, looked) in share.together.iter().zip(&together) {
        let solved = alike(engine.comm(), solve(engine, n, looked.as_ref()))?;
        // The first rank draws and tells of it, as an owner does.
        if engine.comm().rank() == 0 {
            let alone = &*engine.alone();
            found.push(told(n, solved.and_then(|solution| finish(alone, n, looked.as_ref(), solution)))?);
        }
    }
    let items: Vec<(usize, Option<&Looked>)> = share.own.iter().copied().zip(own.iter().map(Option::as_ref)).collect();
    let work = |engine: &Engine, &(n, looked): &(usize, Option<&Looked>)| {
        told(n, solve(engine, n, looked).and_then(|solution| finish(engine, n, looked, solution)))
    };
    found.extend(engine.alone().side_by_side(&items, most, work)?);
    let found = told_to_all(engine, found)?;
    let mut solved = Vec::new();
    for object in found {
        match object {
            Ok(object) => solved.push(object),
            Err(object) => refused.push(object),
        }
    }
    refused.sort_by_key(|refused: &Refused| refused.label);
    if solved.is_empty() {
        let reasons: Vec<String> = refused.into_iter().map(|refused| refused.reason).collect();
        return Err(Error::input(reasons.join("; ")));
    }
    Ok(Objects { solved, refused })
}

/// Voxels of the largest box around an object that is small: larger ones keep all cores busy.
const SMALL: u64 = 2 << 20;

/// What became of the objects of all ranks.
fn told_to_all(
    engine: &Engine,
    own: Vec<(usize, std::result::Result<Solved, Refused>)>,
) -> Result<Vec<std::result::Result<Solved, Refused>>> {
    if engine.comm().ranks() == 1 {
        return Ok(own.into_iter().map(|(_, object)| object).collect());
    }
    let stage = engine.stage("exchange of objects", 0);
    let all = of_all_ranks(&stage, own)?;
    stage.finish();
    Ok(all)
}

/// How many objects are solved at a time: as many as there are threads where all are small and half of the window holds
/// what they take.
fn at_once<'a>(engine: &Engine, objects: impl Iterator<Item = &'a ObjectMarks>, grid: &Geometry) -> usize {
    let all = grid.domain().volume();
    let volume = |marks: &ObjectMarks| match marks.seed {
        Some(_) => all,
        None => voxel_bounds(&marks.contours.concat(), grid).volume(),
    };
    let largest = objects.map(volume).max().unwrap_or(0);
    if largest > SMALL {
        return 1;
    }
    // What is solved reaches around the marks: twice their extent along each axis is more than any band.
    let room = engine.scratch().window() / 2 / (8 * largest * SOLVE_BYTES).max(1);
    (room as usize).clamp(1, engine.threads())
}

/// What became of an object that all ranks solve together: the same on all of them.
///
/// # Errors
/// That of a rank which failed where others did not, and when another rank is gone.
fn alike<R>(comm: &dyn Comm, solved: Result<R>) -> Result<Result<R>> {
    let failed = comm.sum(&[f64::from(u8::from(solved.is_err()))])?;
    if failed == 0.0 || failed == comm.ranks() as f64 {
        return Ok(solved);
    }
    solved.and_then(|_| Err(Error::failed("another rank could not solve an object of all"))).map(Ok)
}

/// An object's outlines and how far they are trusted.
type Looked = (Outlined, Trust);

/// What was seen of a rank's objects, in their order; none where an object's marks are no outlines.
struct Seen {
    /// Of those that all ranks solve together.
    together: Vec<Option<Looked>>,
    /// Of those that this one solves without the others.
    own: Vec<Option<Looked>>,
}

/// Looks at the objects that this rank solves, as far as they are marked by outlines, unless the papers' start was asked for. How far
/// outlines are trusted all objects tell together.
fn survey<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    (objects, share): (&[ObjectMarks], &Share),
    settings: &SegmentSettings,
    most: usize,
) -> Result<Seen> {
    let stage = engine.stage("scatter of marks", 0);
    let scatter = scatter_of(&stage, objects, picture.geometry)?;
    stage.finish();
    let looks = settings.uses_image() && settings.image != ImageModel::Edge;
    let left_out = left_out_of(objects.len());
    let look = |engine: &Engine, &number: &usize| match settings.start {
        Start::Auto if objects[number].seed.is_none() => {
            let by = Looking { scatter, looks, left_out: left_out(number) };
            Outlined::new(engine, picture, &objects[number], by)
        }
        _ => Ok(None),
    };
    let seen_by_all = share.together.iter().map(|n| look(engine, n)).collect::<Result<Vec<_>>>()?;
    let seen_here = engine.by_itself().side_by_side(&share.own, most, look)?;
    // What all have seen one of them tells.
    let first = share.together.iter().zip(&seen_by_all).filter(|_| engine.comm().rank() == 0);
    let told = first.chain(share.own.iter().zip(&seen_here));
    let told = told.filter_map(|(&n, seen)| Some((n, seen.as_ref()?.told(picture.geometry))));
    let told = Told::joined(in_order(engine.comm(), told.collect())?);
    let stage = engine.stage("image model", 0);
    let trusted = |outlined: Vec<Option<Outlined>>| {
        let trusts = trust(&stage, &outlined, &told, (picture.geometry, scatter), settings.image)?;
        Ok(outlined.into_iter().zip(trusts).map(|(outlined, trust)| outlined.zip(trust)).collect())
    };
    let seen = Seen { together: trusted(seen_by_all)?, own: trusted(seen_here)? };
    stage.finish();
    Ok(seen)
}

/// Extracts, measures and writes an object's surface, and writes its segmentation function.
fn draw(
    engine: &Engine,
    solution: &Solution,
    marks: &ObjectMarks,
    settings: &SegmentSettings,
    (store, meshes): (Option<&StoreWriter>, Option<&dyn ObjectMeshes>),
    several: bool,
) -> Result<ObjectReport> {
    let (u, geometry, label) = (&solution.u, &solution.geometry, marks.object);
    let stage = engine.stage(&format!("surface {label}"), 0);
    let name = if several { format!("meshes/object-{label}.ply") } else { "meshes/surface.ply".into() };
    let mut mesh = Surface {
        first: store.map(|store| PlyWriter::on_grid(&store.file(&name)?, geometry)).transpose()?,
        second: meshes.map(|meshes| meshes.begin(label, geometry)).transpose()?,
    };
    let points = marks.contours.concat();
    let Drawn { measures, hausdorff, spread, lost_points, .. } =
        surface::draw(&stage, &Isosurface::of(u, geometry), (&points, geometry.max_spacing()), &mut mesh)?;
    stage.voxels(solution.band_voxels);
    stage.finish();
    check_left(marks, solution, measures.triangles, settings)?;
    check_surface(marks, geometry, hausdorff)?;
    let (written, mut simplified) = (mesh.keep()?, None);
    if let Some(store) = store {
        if let Some(written) = written {
            simplified = for_viewers(engine, store, (&written, geometry), Segments::Object(label))?;
        }
        write_fields(engine, solution, label, store, several)?;
    }
    Ok(ObjectReport {
        label,
        cloud_points: solution.cloud_points,
        beta: solution.beta,
        hole: solution.hole,
        band_voxels: solution.band_voxels,
        evolution: solution.evolution.clone(),
        measures,
        hausdorff,
        spread,
        marks_off: lost_points,
        image_model: solution.image_model.into(),
        theta: solution.theta,
        rho: solution.rho,
        cross_validation: None,
        simplified,
    })
}

/// Writes level set and distance of an object, in groups of its own where there are several.
fn write_fields(engine: &Engine, solution: &Solution, label: u32, store: &StoreWriter, several: bool) -> Result<()> {
    let (geometry, element, content) = (&solution.geometry, ElementType::F32, Content::Field);
    let farthest = f64::from(solution.distance.absent(0));
    for (name, field, high) in [("levelset", &solution.u, 1.0), ("distance", &solution.distance, farthest)] {
        let group = if several { format!("{name}/object-{label}") } else { name.into() };
        let spec = ImageSpec { name, geometry, element, content, window: Some([0.0, high]), extremes: None };
        let stage = engine.resumable_stage(&format!("write {name} {label}"), 0);
        write_levels::<f32>(&stage, engine, store.image_of_one(&group, &spec)?, field, Reduce::Mean)?;
        stage.finish();
    }
    Ok(())
}

/// Marks lie so many largest spacings from their surface in the mean, at most.
const MOST_OFF: f64 = 4.0;

/// Refuses an object that shrank to nothing from a start that was asked for.
fn check_left(marks: &ObjectMarks, solution: &Solution, triangles: u64, settings: &SegmentSettings) -> Result<()> {
    let object = marks.object;
    if triangles > 0 {
        return Ok(());
    }
    let what = match (&marks.seed, settings.beta, solution.larger_beta) {
        (Some(_), _, _) => "the image did not hold it; give its --seed a larger radius, or a larger --rho".to_owned(),
        (None, Some(_), Some(larger)) => format!("give a larger --beta, such as {larger}"),
        (None, Some(_), None) => "leave --beta out, or mark its border on more slices".to_owned(),
        (None, None, _) => return Ok(()),
    };
    Err(Error::vanished(format!("the surface of object {object} vanished: it shrank to nothing; {what}")))
}

/// Refuses a surface that is not that of the marks.
fn check_surface(marks: &ObjectMarks, geometry: &Geometry, hausdorff: Option<Hausdorff>) -> Result<()> {
    let object = marks.object;
    match hausdorff {
        None if marks.seed.is_none() => {
            let points = marks.contours.concat();
            let bound = |a: usize, of: fn(f64, f64) -> f64| points.iter().map(|p| p[a]).reduce(of).unwrap_or(0.0);
            let [low, high] = [f64::min, f64::max].map(|of| [0, 1, 2].map(|a| bound(a, of)));
            let middle = digits::place([0, 1, 2].map(|a| 0.5 * (low[a] + high[a])), geometry.min_spacing());
            let [width, height, depth] = [0, 1, 2].map(|a| digits::number(high[a] - low[a]));
            let [h, k, l] = geometry.spacing;
            Err(Error::input(format!(
                "object {object} encloses nothing: its marks around {middle} span {width} x {height} x {depth}, where voxels \
                 are {h} x {k} x {l}; mark its border all around, on every few slices"
            )))
        }
        Some(found) if found.mean > MOST_OFF * geometry.max_spacing() => Err(Error::input(format!(
            "object {object}: its marks lie {:.3} from the surface that was found, in the mean; leave out --beta, --theta \
             and --rho where they were given, or mark more outlines",
            found.mean
        ))),
        _ => Ok(()),
    }
}
