//! Kernel speed in voxels per second, in cache, on one thread.
#![allow(missing_docs, clippy::disallowed_methods)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use strandline::kernel::image::filter::gaussian::{Block, Gaussian, Smoothed};
use strandline::kernel::level_set::cell::CELL_LEN;
use strandline::kernel::level_set::scheme::covolume::{Planes, assemble};
use strandline::kernel::level_set::scheme::mask::CellMask;
use strandline::kernel::level_set::scheme::sor;
use strandline::kernel::level_set::scheme::system::SCHEME_LEN;
use strandline::kernel::level_set::scheme::velocity::{Fields, Velocity};

fn level_set(c: &mut Criterion) {
    let n = 18usize.pow(3);
    let u: Vec<f32> = (0..n).map(|i| 1.0 / (1.0 + (((i % 18) as f32) - 8.0 + (i / 324) as f32 * 0.1).exp())).collect();
    let d: Vec<f32> = (0..n).map(|i| ((i % 18) as f32 - 8.5).abs() + (i / 18 % 18) as f32 * 0.01).collect();
    let g: Vec<f32> = (0..n).map(|i| ((i * 7919) % 1000) as f32 / 1000.0).collect();
    let mut mask = CellMask::new();
    mask.set(&[1; CELL_LEN], [16; 3], [[false; 2]; 3]);
    let velocity =
        Velocity { theta: 1.0, rho: 0.5, delta: 0.1, epsilon: 0.01, tau: 1.0, normalised: true, speed: false };
    let (mut work, mut scheme) = (Planes::new(), vec![0.0; SCHEME_LEN]);
    let mut group = c.benchmark_group("level_set");
    group.throughput(Throughput::Elements(CELL_LEN as u64));
    let fields = Fields { u: &u, d: &d, g: &g };
    group.bench_function("assemble", |b| {
        b.iter(|| assemble(fields, &mask, [1.0; 3], &velocity, &mut work, &mut scheme));
    });
    let by = sor::Relaxation { scheme: &scheme, mask: &mask, omega: 1.2, iterations: 4 };
    let (mut v, mut halves) = (u.clone(), sor::Halves::new());
    group.bench_function("relax4", |b| b.iter(|| sor::relax(&mut v, &mut halves, by)));
    group.finish();
}

/// A block of 64^3 voxels with its halo, smoothed by two voxels.
fn gaussian(c: &mut Criterion) {
    let gaussian = Gaussian::new([2.0; 3], [1.0; 3]);
    let block = Block::new([64; 3], vec![true; 64], &gaussian);
    let len: usize = block.grown_plane().iter().product();
    let image: Vec<f32> = (0..len).map(|i| ((i * 7919) % 1000) as f32 / 1000.0).collect();
    let (mut smoothed, mut cell) = (Smoothed::default(), vec![0.0; CELL_LEN]);
    let mut group = c.benchmark_group("image");
    group.throughput(Throughput::Elements(64 * CELL_LEN as u64));
    group.bench_function("gaussian", |b| {
        b.iter(|| {
            smoothed.begin(&block);
            (0..block.grown_planes()).for_each(|z| smoothed.plane(&block, &gaussian, z, &image));
            (0..64).for_each(|n| smoothed.cell(&block, &gaussian, [n % 4, n / 4 % 4, n / 16], &mut cell));
        });
    });
    group.finish();
}

criterion_group!(kernels, level_set, gaussian);
criterion_main!(kernels);
