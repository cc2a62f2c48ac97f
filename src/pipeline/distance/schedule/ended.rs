//! Distances that are ended anywhere while they are solved.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::Engine;
use crate::exec::save_points::ending::{check_ended_anywhere, check_ended_on_ranks};
use crate::grid::{Box3, BrickGrid, BrickSet, Geometry, NO_SOURCE, PointBins};
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::pipeline::distance::{Medium, Method, Options, Reads, Schedule, Sources, solve_watched};
use crate::store::{ElementType, PlaneSource, SamplesMut};

const SHAPE: [i64; 3] = [60, 50, 55];

/// Speeds that vary from voxel to voxel, with walls.
struct Speeds;

impl PlaneSource for Speeds {
    fn shape(&self) -> [i64; 3] {
        SHAPE
    }

    fn element(&self) -> ElementType {
        ElementType::U8
    }

    fn read_plane(&self, z: i64, out: SamplesMut<'_>) -> Result<()> {
        let SamplesMut::U8(out) = out else { panic!("planes are of bytes") };
        let speed = |n: usize| if n % 60 == 31 && n / 60 > 4 { 0 } else { 1 + ((n * 37 + z as usize * 91) % 23) as u8 };
        out.iter_mut().enumerate().for_each(|(n, out)| *out = speed(n));
        Ok(())
    }
}

/// Values and sources of all voxels, as bits; every rank reads all.
fn solved(
    engine: &Engine,
    (method, schedule): (Method, Schedule),
    is_timed: bool,
    options: Options,
) -> Result<(Vec<u32>, Vec<u32>)> {
    let geometry = Geometry::new(SHAPE, [1.0, 1.1, 0.9], [0.0; 3]);
    let cloud: Vec<[f64; 3]> = (0..40)
        .map(|n: i32| [f64::from(n * 37 % 60), f64::from(n * 53 % 50), f64::from(n * 29 % 50)].map(|v| 0.3 + 0.9 * v))
        .collect();
    let set = Arc::new(BrickSet::dense(BrickGrid::new(SHAPE, 16)));
    let bins = PointBins::new(*set.grid(), &geometry, &cloud);
    let medium = is_timed.then(|| Medium::read(engine, &set, &Speeds)).transpose()?;
    let stage = engine.resumable_stage("distance", 0);
    let sources = Sources { medium: medium.as_ref(), ..Sources::cloud(&geometry, &cloud, &bins) };
    let part = Box3::from_shape(SHAPE);
    let reads = Reads { boxes: &[part], ..Reads::default() };
    let solved = solve_watched::<f32>(&stage, &sources, &set, (method, schedule), options, reads)?;
    let (mut values, mut nearest) = (vec![0.0; part.len()], vec![NO_SOURCE; part.len()]);
    solved.values.read_box(&part, &mut values)?;
    solved.sources.read_box(&part, &mut nearest)?;
    stage.finish();
    Ok((values.into_iter().map(f32::to_bits).collect(), nearest))
}

type Run = (Method, Schedule, Neighbours, bool);

fn runs() -> Vec<Run> {
    let sweep = Schedule::Sweep { iterations: 3 };
    let faces = |method, schedule, sources| (method, schedule, Neighbours::Faces, sources);
    vec![
        (Method::VDT, Schedule::Front, Neighbours::All, true),
        faces(Method::VDT, Schedule::Front, true),
        faces(Method::FSM, Schedule::Front, false),
        faces(Method::FSM, Schedule::Front, true),
        faces(Method::FSM, sweep, false),
        faces(Method::FSM, sweep, true),
        faces(Method::VDT, sweep, true),
    ]
}

fn options(neighbours: Neighbours, sources: bool) -> Options {
    Options { neighbours, sources, ..Options::up_to(f64::INFINITY) }
}

#[test]
fn a_distance_that_is_ended_anywhere_goes_on_with_the_same_bits() {
    for run in runs() {
        let (method, schedule, neighbours, sources) = run;
        let (options, order) = (options(neighbours, sources), (method, schedule));
        check_ended_anywhere(&format!("{run:?}"), 6, 1.0, &|engine| solved(engine, order, false, options));
    }
}

#[test]
fn times_through_an_image_that_are_ended_anywhere_go_on_with_the_same_bits() {
    let options = options(Neighbours::Faces, true);
    for order in [(Method::FMM, Schedule::Front), (Method::FSM, Schedule::Sweep { iterations: 3 })] {
        check_ended_anywhere(&format!("{order:?}"), 6, 1.0, &|engine| solved(engine, order, true, options));
    }
}

#[test]
fn a_distance_that_ranks_were_ended_in_goes_on_with_the_same_bits_on_other_numbers_of_them() {
    for run in runs() {
        let (method, schedule, neighbours, sources) = run;
        let (options, order) = (options(neighbours, sources), (method, schedule));
        let solved = |engine: &Engine| solved(engine, order, false, options);
        let resumed = check_ended_on_ranks(&format!("{run:?}"), 5, &solved);
        assert!(resumed >= 4, "{run:?}: {resumed} of 8 had something to go on from");
    }
}
